"""Difficult networks at rest by finite elements: slack and light lines, loops, many legs, a sinker on the bed.

Source: tests/reference (mpmath and shooting), the closed forms of statics/network.
"""

import math

import numpy as np
import pytest
from helpers import reference

from dolfbuoy import InputError, load_scene
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.network import solve
from dolfbuoy.statics.start import still_network

CASES = reference("bed_and_networks")["cases"]
G = 9.81


def line(name, low, high, length, weight, EA, elements=12, degrees=(2, 1), **more):
    section = {"name": name, "from": low, "to": high, "length": length, "line_density": weight / G}
    section |= {"axial_stiffness": EA, "elements": elements}
    return section | {"position_degree": degrees[0], "tension_degree": degrees[1]} | more


def at_rest(cables, joints=(), **more):
    """(problem, closed form of its still water) of a network in vacuum, or with a section [sea]."""
    scene = {"gravity": G, "cable": cables, "joint": list(joints), "time": {"end": 1.0, "step": 0.01}}
    problem = solve_equilibrium(load_scene(scene | more))
    return problem, solve(still_network(problem))


def end_of(problem, piece, end):
    return problem.system.u[problem.lines.end_dofs[piece][end]]


def bridle(length=36.0, EA=None, elements=12, **more):
    data = CASES["y_bridle_still"]["input"]
    main, leg = data["main"], data["leg1"]
    places = {name: [float(x) for x in data[name]] for name in ("anchor", "fairlead1", "fairlead2")}
    given = {"elements": elements, "degrees": (3, 2)} | more
    cables = [
        line("main", places["anchor"], "ring", main["L"], main["w"], EA or main["EA"], **given),
        line("leg1", "ring", places["fairlead1"], leg["L"], leg["w"], EA or leg["EA"], **given),
        line("leg2", "ring", places["fairlead2"], length, leg["w"], EA or leg["EA"], **given),
    ]
    return at_rest(cables, [{"name": "ring", "mass": data["joint_net_weight"] / G}])


def floats(w, length, slack):
    """Two moored floats with a line between them."""
    more = {"slack": slack, "diameter": 0.01}
    cables = [
        line("a", [0.0, 0.0, -50.0], "A", 48.0, 50.0, 1e6, **more),
        line("b", [60.0, 0.0, -50.0], "B", 48.0, 50.0, 1e6, **more),
        line("shared", "A", "B", length, w, 1e6, **more),
    ]
    joints = [{"name": name, "volume": 2.0, "mass": 1000.0} for name in "AB"]
    return at_rest(cables, joints, sea={"depth": 50.0})


def light_between_heavy(slack):
    more = {"slack": slack, "diameter": 0.01, "elements": 40}
    cables = [
        line("low", [0.0, 0.0, -100.0], "p", 100.0, 411.0, 3e8, **more),
        line("light", "p", "q", 50.0, 1.0, 3e8, **(more | {"diameter": 0.4})),
        line("high", "q", [115.0, 0.0, 0.0], 90.0, 411.0, 3e8, **more),
    ]
    return at_rest(cables, [{"name": "p"}, {"name": "q"}], sea={"depth": 500.0, "dry_above": False})


def twelve_legs(slack):
    angles = np.arange(12) * np.pi / 6
    feet = [[520 * math.cos(a), 520 * math.sin(a), -100.0] for a in angles]
    legs = [line(f"leg{i}", foot, "hub", 540.0, 200.0, 4e8, slack=slack, diameter=0.05) for i, foot in enumerate(feet)]
    return at_rest(legs, [{"name": "hub", "volume": 120.0, "mass": 2000.0}], sea={"depth": 500.0, "dry_above": False})


def loop(slack):
    """A float with two lines to one anchor, and a third between a clump in one of them and the other's end."""
    more = {"slack": slack, "diameter": 0.01}
    cables = [
        line("up", [0.0, 0.0, -50.0], "float", 40.0, 100.0, 1e7, **more),
        line("down", "float", "clump", 25.0, 100.0, 1e7, **more),
        line("back", "clump", [20.0, 5.0, -50.0], 40.0, 100.0, 1e7, **more),
        line("across", "clump", "float", 30.0, 50.0, 1e7, **more),
    ]
    joints = [{"name": "float", "volume": 4.0, "mass": 500.0}, {"name": "clump", "mass": 100.0}]
    return at_rest(cables, joints, sea={"depth": 500.0})


@pytest.mark.parametrize("slack", ["compressive", "tension-only"])
@pytest.mark.parametrize(
    "made",
    [
        lambda slack: bridle(length=60.0, slack=slack),
        lambda slack: bridle(EA=math.inf, slack=slack),
        lambda slack: floats(30.0, 90.0, slack),
        lambda slack: floats(30.0, 52.0, slack),
        light_between_heavy,
        twelve_legs,
        loop,
    ],
    ids=["slack leg", "inextensible", "slack between floats", "taut between floats", "light", "twelve", "loop"],
)
def test_hard_networks(made, slack):
    """Positions and tensions of the closed form, no compression anywhere, forces in balance at every joint."""
    problem, rest = made(slack)
    lines, u = problem.lines, problem.system.u
    T = u[lines.T_dofs]
    assert T.min() > 0
    for piece, shape in enumerate(rest.shapes):
        length = rest.network.pieces[piece].length
        mine = lines.line_of_cell == piece
        s = lines.T_s[mine] - lines.begins[piece]
        np.testing.assert_allclose(T[mine], shape.tension(s), atol=3e-3 * T.max())
        for end in (0, 1):
            expected = shape.position(np.array([end * length]))[0]
            np.testing.assert_allclose(end_of(problem, piece, end), expected, atol=1e-3 * length)
    problem.destroy()


def streamer(slack, degrees):
    """Almost as light as the water, above the end of the line it hangs on: folds of no width, hardly any tension."""
    more = {"slack": slack, "degrees": degrees}
    cables = [
        line("streamer", "drogue", "end", 100.0, 1.288 * G, 2e6, diameter=0.04, elements=25, **more),
        line("tow", "end", [0.0, 0.0, 0.0], 120.0, 2.4 * G, 2e7, diameter=0.02, elements=30, **more),
    ]
    joints = [{"name": "drogue", "mass": 5.0, "volume": 4.878e-3}, {"name": "end"}]
    return at_rest(cables, joints, sea={"depth": 200.0})


@pytest.mark.parametrize("slack", ["compressive", "tension-only"])
def test_a_streamer_that_floats_back_along_its_tow(slack):
    problem, _ = streamer(slack, (1, 0))
    assert problem.system.u[problem.lines.T_dofs].min() > 0
    tow, array = (w - 1025 * math.pi / 4 * d**2 for w, d in ((2.4, 0.02), (1.288, 0.04)))
    weight = G * (120 * tow + 100 * array + 5.0 - 1025 * 4.878e-3)
    np.testing.assert_allclose(problem.end_force(1, 1), [0.0, 0.0, weight], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(end_of(problem, 1, 0), [0.0, 0.0, -120 * (1 + weight / 2 / 2e7)], atol=1e-4)
    assert end_of(problem, 0, 0)[2] == pytest.approx(end_of(problem, 0, 1)[2] + 100, abs=1e-3)
    problem.destroy()


def test_a_streamer_of_curved_elements_that_take_no_compression():
    """Folds of no width leave slack nodes, at which Newton's matrix is singular: it is found by its motion."""
    problem, _ = streamer("tension-only", (2, 1))
    assert problem.route == "relaxation"
    assert problem.system.u[problem.lines.T_dofs].min() == 0
    np.testing.assert_allclose(problem.end_force(1, 1), [0.0, 0.0, 2446.1545149], rtol=1e-9, atol=1e-9)
    problem.destroy()


def test_an_inextensible_line_that_is_exactly_taut_is_named():
    with pytest.raises(InputError, match=r"cable\.length = 30.0: must be more than the 30 m between its ends"):
        at_rest([line("a", [0.0, 0.0, -30.0], [0.0, 0.0, 0.0], 30.0, 100.0, math.inf)])


# -- on a bed ----------------------------------------------------------------------------------------------------------


def test_chain_wire_chain_with_a_clump():
    """On a bed about as rigid as that of the reference, to 5e-5 with 96 elements."""
    case = CASES["cwc_clump_still"]
    data, body = case["input"], case["input"]["bodies"]["0"]
    total = sum(part["length"] for part in data["segments"])
    keys = ("length", "line_density", "diameter", "axial_stiffness")
    segments = [
        {key: part[key] for key in keys} | {"elements": max(2, round(96 * part["length"] / total))}
        for part in data["segments"]
    ]
    segments[0]["body"] = {"mass": body["mass"], "volume": body["volume"]}
    down = -data["depth"]
    cable = {"segments": segments, "anchor": [0.0, 0.0, down], "position_degree": 2, "tension_degree": 1}
    cable["top"] = {"kind": "fixed", "position": [432.0, 0.0, 145.0 + down]}
    problem, _ = at_rest([cable], sea={"depth": -down, "density": 1025.0}, seabed={"stiffness": 1e7})
    top, exact = np.linalg.norm(problem.end_force(2, 1)), float(case["exact"]["T_top"])
    assert top == pytest.approx(exact, rel=5e-5)
    problem.destroy()


def test_a_sinker_lies_on_the_bed():
    """It sinks in by its sag, and its reaction is its weight less what its lines lift."""
    wet = {"line_density": 300 / G + 1025 * math.pi / 4 * 0.05**2, "diameter": 0.05, "elements": 30}
    cables = [
        line("lying", [0.0, 0.0, -100.0], "sinker", 100.0, 0.0, 1e8) | wet,
        line("rising", "sinker", [150.0, 0.0, -40.0], 90.0, 0.0, 1e8) | wet,
    ]
    problem, rest = at_rest(cables, [{"name": "sinker", "mass": 2e4}], sea={"depth": 100.0}, seabed={})
    sag, place = 0.01, end_of(problem, 0, 1)  # 1e-4 of the depth carries its weight
    pull = problem.end_force(0, 1) + problem.end_force(1, 0)
    assert (-100 - place[2]) / sag == pytest.approx(1 - abs(pull[2]) / (2e4 * G), abs=0.05)
    assert np.abs(pull[:2]).max() < 1e-3
    assert np.linalg.norm(problem.end_force(1, 1)) == pytest.approx(rest.shapes[1].tension(90.0), rel=5e-3)
    problem.destroy()
