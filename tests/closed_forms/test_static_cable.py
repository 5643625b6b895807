"""Static cable by finite elements against the closed-form catenary and the errors of a separate numpy code.

Source: the closed-form catenary, errors of a separate numpy code (tests/reference).
"""

import math

import numpy as np
import pytest
from alone import solve_static
from helpers import CableSolution, catenary_slope, rates, reference, under_end_force

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model.problem import Problem
from dolfbuoy.results.summary import static_warnings
from dolfbuoy.statics import catenary, ways
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.start import closed_form

ANCHOR = (0.3, -0.2, 0.1)
HEADING = 0.7  # [rad] of the cable's vertical plane: not a coordinate plane
FORCE = (0.5 * math.cos(HEADING), 0.5 * math.sin(HEADING), 0.75)
END = (ANCHOR[0] + 0.6 * math.cos(HEADING), ANCHOR[1] + 0.6 * math.sin(HEADING), ANCHOR[2] + 0.5)
FREE, FIXED = {"kind": "free", "force": FORCE}, {"kind": "fixed", "position": END}
INF = math.inf
EA50 = reference("catenary")["E1_neumann_elastic50"]["EA"]  # stretches to 1.5 L
PAIRS = [(1, 0), (2, 1), (3, 2), (4, 3)]
QUANTITIES = ("L2r", "H1r", "L2T")


def cable_scene(degrees, elements, top, EA=INF, quadrature=None, **cable):
    """The cable of the reference, w = 1 N/m from density 0.5 kg/m and gravity 2 m/s^2."""
    solver = {"quadrature_degree": quadrature} if quadrature else {}
    section = {"length": 1.0, "line_density": 0.5, "axial_stiffness": EA, "elements": elements, "anchor": ANCHOR}
    section |= {"position_degree": degrees[0], "tension_degree": degrees[1], "top": top}
    return load_scene({"gravity": 2.0, "cable": section | cable, "solver": solver})


def exact_shape(top, EA):
    if top["kind"] == "free":
        return under_end_force(ANCHOR, top["force"], 1.0, 1.0, EA)
    return catenary.between(ANCHOR, top["position"], 1.0, 1.0, EA)


def errors_of(scene, shape):
    problem = solve_equilibrium(scene)
    errors = CableSolution(problem).errors(shape.position, catenary_slope(shape), shape.tension)
    problem.destroy()
    return errors


def convergence(degrees, sizes, top, EA=INF, **options):
    shape = exact_shape(top, EA)
    errors = [errors_of(cable_scene(degrees, n, top, EA, **options), shape) for n in sizes]
    return {q: np.array([e[q] for e in errors]) for q in QUANTITIES}


@pytest.mark.parametrize("degrees", PAIRS)
@pytest.mark.parametrize(
    ("top", "EA", "options"),
    [
        (FREE, INF, {}),
        (FIXED, INF, {}),
        (FREE, EA50, {}),
        (FIXED, EA50, {}),
        (FIXED, 1e6, {}),
        (FREE, EA50, {"strain_form": "energy"}),
    ],
    ids=["free-inf", "fixed-inf", "free-50%", "fixed-50%", "fixed-1e6", "free-50%-energy"],
)
def test_orders_of_convergence(degrees, top, EA, options):
    """r: mu+1 in L2 and mu in H1, T: nu+1 in L2, between every two meshes."""
    mu, nu = degrees
    sizes = [16, 32, 64]
    errors = convergence(degrees, sizes, top, EA, **options)
    orders = {q: rates(errors[q], sizes) for q in QUANTITIES}
    for quantity, order in (("L2r", mu + 1), ("H1r", mu), ("L2T", nu + 1)):
        np.testing.assert_allclose(orders[quantity], order, atol=0.1, err_msg=quantity)


def errors_match(table, pair, EA, **options):
    """Each error equals that of the other code but for rounding, which is about 1e-14 of |r| and 1e-13 of T."""
    rows = [row for row in reference("convergence")[table][pair] if row["N"] <= 32]
    degrees = (int(pair[1]), int(pair[3]))
    errors = convergence(degrees, [row["N"] for row in rows], FREE, EA, **options)
    for quantity, rounding in (("L2r", 1e-13), ("H1r", 1e-12), ("L2T", 1e-12)):
        expected = np.array([row[quantity] for row in rows])
        np.testing.assert_allclose(errors[quantity], expected, rtol=1e-6, atol=rounding, err_msg=quantity)


@pytest.mark.parametrize("pair", ["P1P0", "P2P1", "P3P2", "P4P3"])
def test_errors_of_inextensible_cable(pair):
    errors_match("inextensible", pair, INF)


@pytest.mark.parametrize("pair", ["P4P0", "P4P1", "P4P2"])
def test_errors_where_the_tension_limits_the_order(pair):
    """The paper's Fig. 4: position degree 4, tension degrees 0, 1, 2."""
    errors_match("inextensible_mu4", pair, INF)


@pytest.mark.parametrize("pair", ["P1P0", "P2P1", "P3P2", "P4P3"])
def test_errors_of_elastic_cable(pair):
    """With the integrals exact to rounding, as in the other code."""
    errors_match("elastic", pair, EA50, quadrature=20)


@pytest.mark.parametrize("pair", ["P1P0", "P2P1", "P3P2", pytest.param("P4P3", marks=pytest.mark.slow)])
def test_errors_with_averaged_strain(pair):
    """The paper's Fig. 3 and Sect. 3.3.2: the order of r stays 2 whatever the degree."""
    errors_match("elastic_element_average", pair, EA50, quadrature=20, strain="element-average")


@pytest.mark.parametrize("degrees", PAIRS[1:])
def test_averaging_costs_the_order_of_position_and_not_that_of_tension(degrees):
    sizes = [8, 16, 32]
    errors = convergence(degrees, sizes, FREE, EA50, quadrature=20, strain="element-average")
    np.testing.assert_allclose(rates(errors["L2r"], sizes), 2, atol=0.1)
    np.testing.assert_allclose(rates(errors["H1r"], sizes), 1, atol=0.1)
    np.testing.assert_allclose(rates(errors["L2T"], sizes), degrees[1] + 1, atol=0.1)


def test_default_quadrature_is_exact_for_an_inextensible_cable():
    """T r' . v' has degree 3 mu - 3, the default rule integrates 2 mu + 1: the same discrete solution to rounding."""
    coarse, fine = (convergence((4, 3), [4], FREE, quadrature=q)["L2r"] for q in (None, 20))
    np.testing.assert_allclose(coarse, fine, rtol=1e-6)


def test_energy_form_differs_from_the_papers_form_only_within_the_error():
    paper, energy = (convergence((2, 1), [4], FREE, EA50, strain_form=f) for f in ("paper", "energy"))
    for quantity in QUANTITIES:
        difference = abs(energy[quantity] / paper[quantity] - 1)[0]
        assert 1e-5 < difference < 1e-2


@pytest.mark.parametrize("EA", [INF, EA50])
@pytest.mark.parametrize("degrees", PAIRS[:3])
def test_forces_at_the_ends_balance_the_weight(degrees, EA):
    """The reaction of a fixed end is the discrete one: with the anchor's it carries the weight exactly."""
    shape, errors = exact_shape(FIXED, EA), []
    exact = np.array([*(shape.H * shape.along[:2]), float(shape.vertical(1.0))])
    for elements in (10, 20):
        problem = solve_equilibrium(cable_scene(degrees, elements, FIXED, EA))
        reaction = problem.end_tension()
        np.testing.assert_allclose(reaction + problem.anchor_force(), [0, 0, 1.0], atol=1e-12)
        errors.append(np.abs(reaction - exact).max())
        problem.destroy()
    assert errors[0] > 1e-10
    assert rates(errors, [10, 20])[0] > 2 * degrees[0] - 0.4  # superconvergent


def test_newton_ends_at_rounding_for_every_heading():
    """A start that is nearly the solution leaves residuals of rounding size, which no line search can reduce."""
    for angle in np.random.default_rng(1).uniform(0, 6, 40):
        force = (0.5 * math.cos(angle), 0.5 * math.sin(angle), 0.75)
        problem = solve_equilibrium(cable_scene((4, 3), 16, {"kind": "free", "force": force}))
        assert problem.iterations <= 3
        problem.destroy()


@pytest.mark.parametrize("case", ["P_short_EA2.3e8", "P_long_EA2.3e8"])
def test_cables_of_the_paper(case):
    """Tensions of the two moorings hung between their end points in water."""
    values = reference("catenary")[case]
    length, end = values["L"], values["table"][-1]
    heading = np.array([math.cos(HEADING), math.sin(HEADING)])
    density, diameter, gravity = 1025.0, 0.08, 9.81
    line_density = values["w_sub"] / gravity + density * math.pi * diameter**2 / 4
    position = [1.0 + end["x"] * heading[0], 2.0 + end["x"] * heading[1], end["z"] - 900.0]
    cable = {"length": length, "line_density": line_density, "diameter": diameter, "axial_stiffness": 2.3e8}
    cable |= {"elements": 128, "position_degree": 3, "tension_degree": 2, "anchor": [1.0, 2.0, -900.0]}
    cable["top"] = {"kind": "fixed", "position": position}
    problem = solve_equilibrium(load_scene({"sea": {"depth": 900.0, "density": density}, "cable": cable}))
    solution = CableSolution(problem)
    for row in values["table"]:
        r, _, T = solution.at(row["s"])
        expected = [1.0 + row["x"] * heading[0], 2.0 + row["x"] * heading[1], row["z"] - 900.0]
        np.testing.assert_allclose(r, expected, atol=2e-8 * length)
        assert pytest.approx(row["T"], rel=1e-5) == T
    assert pytest.approx(values["VL"], rel=1e-9) == problem.end_tension()[2]
    assert pytest.approx(values["H"], rel=1e-9) == np.hypot(*problem.end_tension()[:2])
    anchor = [*(-values["H"] * heading), -values["V0"]]
    np.testing.assert_allclose(problem.anchor_force(), anchor, atol=1e-9 * values["VL"])
    assert problem.smallest_tension() > 0
    problem.destroy()


@pytest.mark.parametrize(("degrees", "tolerance"), [((1, 0), 2e-12), ((2, 1), 2e-12), ((3, 2), 2e-12)])
def test_vertical_elastic_cable(degrees, tolerance):
    """Straight up; quadratic in s, hence exact at the nodes and, from degree 2 on, everywhere."""
    values = reference("catenary")["V1_vertical_elastic"]
    force = (0.0, 0.0, values["V0"] + values["w"])
    problem = solve_equilibrium(cable_scene(degrees, 4, {"kind": "free", "force": force}, values["EA"]))
    solution = CableSolution(problem)
    for s, z in zip((0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0), values["z"], strict=True):
        if degrees[0] > 1 or s * 4 == int(s * 4):
            np.testing.assert_allclose(solution.at(s)[0] - ANCHOR, [0, 0, z], atol=tolerance)
    problem.destroy()


def test_buoyant_cable_hangs_upwards():
    """Lighter than water: the mirror image of the heavy cable."""
    values = reference("catenary")["buoyant_0.6_0.5"]
    area = math.pi * 0.1**2 / 4
    gravity, density = 2.0, 500.0
    line_density = density * area - 1.0 / gravity  # w = -1 N/m
    cable = {"length": 1.0, "line_density": line_density, "diameter": 0.1, "elements": 32, "anchor": ANCHOR}
    cable |= {"position_degree": 3, "tension_degree": 2, "top": FIXED}
    problem = solve_equilibrium(
        load_scene({"gravity": gravity, "sea": {"depth": 5.0, "density": density, "dry_above": False}, "cable": cable})
    )
    solution = CableSolution(problem)
    for s in ("0.25", "0.5", "0.75", "1"):
        r = solution.at(float(s))[0] - ANCHOR
        x, z = values["x_of_s"][s], values["z_of_s"][s]
        np.testing.assert_allclose(r, [x * math.cos(HEADING), x * math.sin(HEADING), z], atol=1e-7)
        assert pytest.approx(values["T_of_s"][s], rel=1e-4) == solution.at(float(s))[2]
    assert pytest.approx(values["H"], rel=1e-8) == np.hypot(*problem.end_tension()[:2])
    assert problem.end_tension()[2] < 0  # the top must be held down
    problem.destroy()


# -- hard cases --------------------------------------------------------------------------------------------------------


def fixed_at(x, z, elements=20, degrees=(2, 1), EA=INF, **cable):
    """Unit cable, w = 1 N/m, from ANCHOR to a point x aside along HEADING and z above."""
    position = (ANCHOR[0] + x * math.cos(HEADING), ANCHOR[1] + x * math.sin(HEADING), ANCHOR[2] + z)
    return cable_scene(degrees, elements, {"kind": "fixed", "position": position}, EA, **cable)


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1)])
def test_stiff_cables_approach_the_inextensible_one_at_the_same_cost(degrees):
    """EA = 1e6 ... 1e14 times the weight: the difference falls like 1/EA to rounding, iterations stay the same."""
    states, iterations = [], []
    for EA in (1e6, 1e8, 1e10, 1e12, 1e14, INF):
        problem = solve_equilibrium(fixed_at(0.6, 0.5, degrees=degrees, EA=EA))
        states.append(problem.system.u.copy())
        iterations.append(problem.iterations)
        problem.destroy()
    away = [np.abs(u - states[-1]).max() for u in states[:-1]]
    assert away[0] < 1e-5
    assert away[1] == pytest.approx(away[0] / 100, rel=0.01)
    assert max(away[2:]) < 2e-10
    assert max(iterations) <= min(iterations) + 1 <= 5


@pytest.mark.parametrize("EA", [2.0, 1e3, 1e6, 1e10, 1e12])
@pytest.mark.parametrize(("x", "z"), [(1.2, 0.0), (0.7, 1.0), (1.0, 0.0), (0.99999, 0.0)])
def test_elastic_cable_that_is_too_short_is_taut(x, z, EA):
    """Stretched by 20 %, or exactly as long as the distance: the tensions of the closed form."""
    scene = fixed_at(x, z, EA=EA)
    problem = solve_equilibrium(scene)
    top = problem.scene.network.pieces[0].ends[1].top.position
    exact = catenary.between(ANCHOR, top, 1.0, 1.0, EA)
    assert np.linalg.norm(problem.end_tension()) == pytest.approx(float(exact.tension(1.0)), rel=2e-4)
    assert problem.smallest_tension() > 0
    problem.destroy()


def test_what_cannot_be_is_refused_in_a_sentence():
    for x, z in ((1.0, 0.0), (0.6, 0.8)):
        with pytest.raises(InputError, match="then exactly taut and its tension undetermined"):
            solve_equilibrium(fixed_at(x, z))
    with pytest.raises(InputError, match="too short"):
        solve_equilibrium(fixed_at(1.2, 0.0))
    weightless = fixed_at(0.6, 0.5).model_copy(update={"gravity": 0.0})
    with pytest.raises(InputError, match="nothing determines its equilibrium"):
        solve_equilibrium(weightless)


@pytest.mark.parametrize("high", [25.0, 24.0])
def test_inextensible_cables_in_a_row_that_are_taut_are_refused(high):
    """By way of a joint, and of two that go side by side the shorter one; with stretch, or longer, there is a rest."""
    rope = {"elements": 2, "line_density": 2.0, "diameter": 0.01}
    lines = [
        {**rope, "name": "a", "from": [0.0, 0.0, -30.0], "to": "j", "length": 6.0},
        {**rope, "name": "b", "from": [0.0, 0.0, -5.0], "to": "j", "length": high - 6.0},
        {**rope, "name": "c", "from": "j", "to": [0.0, 0.0, -5.0], "length": 40.0},
    ]
    with pytest.raises(
        InputError, match=f"^Inextensible cables {high:g} m long together .* more than the 25 m between"
    ):
        solve_equilibrium(load_scene({"sea": {"depth": 30.0}, "joint": [{"name": "j"}], "cable": lines}))
    lines[1]["axial_stiffness"] = 1e6
    solve_equilibrium(load_scene({"sea": {"depth": 30.0}, "joint": [{"name": "j"}], "cable": lines[:2]})).destroy()


def test_weightless_taut_cable_is_straight():
    problem = solve_equilibrium(fixed_at(1.1, 0.0, EA=50.0).model_copy(update={"gravity": 0.0}))
    np.testing.assert_allclose(problem.system.u[problem.lines.T_dofs], 5.0, rtol=1e-9)
    problem.destroy()


class Line:
    """A start that is no catenary: heights over the chord from ANCHOR."""

    def __init__(self, end, bulge, tension=np.ones_like):
        self.end, self.bulge, self.tension = np.array(end), bulge, tension

    def position(self, s):
        s = np.asarray(s)
        return np.array(ANCHOR) + np.outer(s, self.end - ANCHOR) + np.outer(self.bulge(s), [0, 0, 1.0])

    def put(self, problem):
        problem.lines.set_shape(problem.system.u, self.position, self.tension)
        problem.set_time(0.0)


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1)])
def test_bad_starts_do_not_end_compressed(degrees):
    """An upward arch leads Newton to the arch with T < 0, a chord is nearly singular; each ends at the catenary."""
    scene = fixed_at(0.6, 0.5, degrees=degrees)
    good = solve_equilibrium(scene)
    assert good.route == "newton"
    end = scene.network.pieces[0].ends[1].top.position
    arch = catenary.between(ANCHOR, end, 1.0, -1.0, INF)
    up = Line(end, lambda s: 0.6 * np.sin(np.pi * s), lambda s: -arch.tension(s))
    pushed = Line(end, None, up.tension)
    pushed.position = arch.position
    problem = Problem(scene, dynamic=False)
    problem.iterations = 0
    pushed.put(problem)
    problem.newton.solve()
    assert ways.is_compressed(problem)
    for start in (Line(end, lambda s: -1e-3 * np.sin(np.pi * s)), up, pushed):
        ways.find_rest(problem, lambda start=start: start.put(problem), ways.WAYS)
        assert not ways.is_compressed(problem)
        np.testing.assert_allclose(problem.system.u, good.system.u, atol=1e-9)
    problem.destroy()
    good.destroy()


@pytest.mark.parametrize(
    ("top", "EA", "names"),
    [
        (FIXED, INF, ["end position"]),
        (FIXED, EA50, ["stiffness", "end position"]),
        (FREE, EA50, ["stiffness", "end force"]),
    ],
    ids=["fixed-inf", "fixed-50%", "free-50%"],
)
def test_every_way_ends_where_newton_does(top, EA, names):
    scene = cable_scene((2, 1), 10, top, EA)
    direct = solve_equilibrium(scene)
    problem = Problem(scene, dynamic=False)
    problem.iterations = 0
    suited = {way.name: way.go for way in ways.WAYS if way.suits(problem)}
    assert list(suited) == ["newton", "relaxation", "other slack law", *names, "damped motion"]
    for name, go in suited.items():
        problem.system.u[:] = 0.0
        closed_form(problem).put()
        go(problem)
        np.testing.assert_allclose(problem.system.u, direct.system.u, atol=1e-9, err_msg=name)
    problem.destroy()
    direct.destroy()


def test_strong_current_against_the_catenary():
    """4 m/s against a cable whose top is upstream: no start hangs in still water; in balance and taut."""
    cable = {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "elements": 10, "normal_drag": 0.8}
    cable |= {"tangential_drag": 0.1, "top": {"kind": "fixed", "position": [-12.0, 0.0, -3.5]}}
    scene = load_scene({"sea": {"depth": 20.0}, "cable": cable, "current": {"speed": 4.0}})
    problem = solve_equilibrium(scene)
    assert problem.smallest_tension() > 0
    free = problem.system.order
    assert np.abs(problem.system.evaluate()[free]).max() < 1e-6
    problem.destroy()


def test_faults_of_an_equilibrium_are_said():
    """Compressed, slack, and the fold that is smaller than an element; nothing where it is resolved."""
    said = {}
    for name, place, slack in (
        ("rods", (0.01, 0.99), "compressive"),
        ("rope", (0.01, 0.99), "tension-only"),
        ("fine", (0.3, 0.5), "compressive"),
    ):
        scene = fixed_at(*place, 10, (1, 0), slack=slack)
        said[name] = " ".join(static_warnings(dolfbuoy.solve_static(scene), scene))
    assert "is compressed in this equilibrium (smallest tension -0.02356 N; element 1 " in said["rods"]
    assert "Slack (T = 0) in equilibrium: element 1 (s = 0 ... 0.1 m)" in said["rope"]
    assert "compressed" not in said["rope"]
    assert said["fine"] == ""
    coarse = fixed_at(0.01, 0.8, 7)
    (fold,) = static_warnings(dolfbuoy.solve_static(coarse), coarse)
    assert "A fold of the cable is not resolved: elements 1 to 2 (s = 0 ... 0.2857 m)" in fold


@pytest.mark.parametrize("strain_form", ["paper", "energy"])
def test_no_element_is_turned_inside_out(strain_form):
    """|r'| = |1 + e| has the root 1 + e = -1/2 too, T = -150 N; a straight element of half its length has T = -50 N."""
    cable = {
        "length": 1.0,
        "line_density": 1.0,
        "elements": 1,
        "axial_stiffness": 100.0,
        "strain_form": strain_form,
        "top": {"kind": "fixed", "position": [0.5, 0.0, 0.0]},
    }
    record = solve_static({"cable": cable})
    assert record.cable_tension.values == pytest.approx(-50.0, rel=1e-9)
    assert record.end_tension.values == pytest.approx([-50.0, 0.0, 9.81 / 2], rel=1e-9)
