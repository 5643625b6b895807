"""Routes to an equilibrium: the same for both spellings of a scene; tails, tethers, and given starts.

Source: balance of forces (weights, Archimedes, drag of each element by hand); runs of the same scene from other starts.
"""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from respelling import respelled
from tethers import CHAIN, HULL, tail, tether

import dolfbuoy
from dolfbuoy import InputError, SolveError, load_scene, simulate, solve_static
from dolfbuoy.model.problem import Problem
from dolfbuoy.parallel import interruption
from dolfbuoy.statics import damped, start, ways
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.start import closed_form

RHO, G = 1025.0, 9.81
SCENES = Path(dolfbuoy.__file__).parent / "scenes"
#: Most iterations of Newton, as they were when the ways became one list.
MOST = {
    "articulated-column": 1, "power-cable": 13, "hose": 6, "calm-buoy": 3, "steep-wave": 3,
    "bridle": 2, "chain-on-bed": 4, "disc-buoy": 9, "driven": 2, "driven-slack": 3, "free-buoy": 1, "hanging-chain": 1,
    "jumper": 2, "jumper-waves": 2, "lazy-wave": 7, "long": 4, "long-bed": 4, "navigation-buoy": 68, "short": 4,
    "short-bed": 4, "spar": 1, "storm": 4, "subsurface-float": 4, "three-legs": 5, "towed-array": 5, "two-buoys": 5,
    "wave-rider": 4,
}  # fmt: skip


def at_rest(scene):
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    found = problem.route, problem.iterations, problem.system.u.copy()
    problem.destroy()
    return found


def test_every_shipped_scene_is_listed():
    assert {path.stem for path in SCENES.glob("*.toml")} == set(MOST)


@pytest.mark.parametrize("name", MOST)
def test_both_spellings_go_the_same_way(name, monkeypatch):
    """Equal unknowns after equally many iterations, by Newton's method alone, and no more of them than before."""
    monkeypatch.chdir(SCENES)  # for the files that a scene names
    given = tomllib.loads(Path(f"{name}.toml").read_text())
    route, iterations, u = at_rest(given)
    assert route == "newton"
    assert iterations <= MOST[name]
    other = respelled(given)
    if other != given:
        way, count, v = at_rest(other)
        assert (way, count) == (route, iterations)
        np.testing.assert_array_equal(u, v)


@pytest.mark.parametrize("brackets", [False, True])
def test_a_cable_that_hangs_in_a_fold_below_its_anchor(brackets):
    """22 m in 20 m of water: the buoy carries the hanging part, without horizontal force or compression."""
    cable = {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "axial_stiffness": 2.3e8, "elements": 44}
    buoy = {"hull": [[0.0, 1.6], [2.8, 1.6]], "mass": 2400.0, "center_of_mass": 0.9}
    scene = {"sea": {"depth": 20.0}, "cable": [cable] if brackets else cable, "buoy": buoy}
    found = solve_static(scene)
    draft = -float(np.ravel(found.mooring_point)[2])
    pull = RHO * math.pi * 0.8**2 * draft * G - 2400 * G
    hanging = (22.0 + 20.0 - draft) / 2  # both parts reach as deep
    w = (27.6 - RHO * math.pi * 0.04**2) * G
    assert float(found.tension_top) == pytest.approx(pull, rel=1e-8)
    assert pull == pytest.approx(w * hanging, abs=w * 0.5 / 2)  # the fold is in one of the elements
    assert float(found.cable_tension.min()) > -1e-6
    assert found.attrs["route"] == "newton"


# -- a heavy tail under a buoyant rope, and tethers of wave riders -----------------------------------------------------


def drag_and_weight(problem, speed):
    """[N] of all lines of straight elements in a uniform current along x, element by element, and of their bodies."""
    lines, u, total = problem.lines, problem.system.u, np.zeros(3)
    for k, section in enumerate(lines.sections):
        order = np.argsort(lines.node_s[lines.line_of_node == k])
        chords = np.diff(u[lines.node_dofs[lines.line_of_node == k][order]], axis=0)
        size = np.linalg.norm(chords, axis=1)[:, None]
        along = chords / size
        normal = speed * (np.array([1.0, 0.0, 0.0]) - along[:, :1] * along)
        drag = (
            0.5 * RHO * section.normal_drag * section.diameter * size * np.linalg.norm(normal, axis=1)[:, None] * normal
        )
        total += drag.sum(axis=0)
        total[2] -= (section.line_density - RHO * math.pi / 4 * section.diameter**2) * G * section.length
    for body in problem.network.bodies.values():
        total += [0.5 * RHO * body.drag_area * speed**2, 0.0, (RHO * body.volume - body.mass) * G]
    return total


def test_a_heavy_tail_under_a_rope_that_floats():
    """The start includes the current.  A run started from a polyline comes to rest in the same state."""
    found = solve_static(tail())
    assert found.attrs["route"] == "newton"
    assert float(found.cable_tension.min()) > 1000.0
    first = {"kind": "polyline", "points": [[0, 0, -100], [5, 0, -100], [60, 0, 0]], "buoy_position": [60, 0, 0.3]}
    run = simulate(tail(initial=first, time={"end": 250.0, "step": 0.25}))
    np.testing.assert_allclose(run.cable_tension[-1], found.cable_tension, rtol=1e-7)
    np.testing.assert_allclose(run.cable_position[-1], found.cable_position, atol=1e-5)


TETHERS = {
    "as usual": {},
    "strong current": {"speed": 1.5},
    "hardly any": {"speed": 0.02},
    "two-sided law": {"slack": "compressive"},
    "taut": {"depth": 85.0},
    "too long": {"rope": 80.0},
    "no bodies": {"bodies": ()},
    "curved elements": {"position_degree": 2, "tension_degree": 1},
    "friction": {"bed": {"friction": 0.6, "start": "pulled"}},
    "still water": {"speed": 0.0},
    "still water, two-sided law": {"speed": 0.0, "slack": "compressive"},
    "still water, no bodies": {"speed": 0.0, "bodies": ()},
    "no bed": {"bed": None},
    "no bed, still water": {"bed": None, "speed": 0.0},
}


@pytest.mark.parametrize("more", TETHERS.values(), ids=TETHERS)
def test_tethers_of_wave_riders(more):
    """No compression, the buoy floating on its line, and anchor force, drag, weights and buoyancy in balance."""
    problem = solve_equilibrium(load_scene(tether(**more)), MPI.COMM_SELF)
    top, anchor = problem.end_tension(), problem.anchor_force()
    scale, T = np.linalg.norm(top), problem.system.u[problem.lines.T_dofs]
    assert T.min() >= -1e-9 * T.max()
    assert anchor[1] == pytest.approx(0.0, abs=1e-6 * scale)
    if more.get("position_degree", 1) == 1:
        force = top + anchor + drag_and_weight(problem, more.get("speed", 0.5))
        rubs = more.get("bed") and more["bed"]["friction"]
        assert abs(force[0]) < (1.0 if rubs else 1e-6) * scale
        assert force[2] < (1e-6 * scale if more.get("bed", True) is None else 10 * 5.0 * G)  # the bed carries the rest
        assert more.get("bed", True) is not None or abs(force[2]) < 1e-6 * scale
    pose = problem.buoy.fields.of(problem.system.u[problem.buoy.part.slice])
    submerged = RHO * math.pi * 0.45**2 * (0.3 - pose.position[2])  # upright: nothing draws it aside
    assert (submerged - 225.0) * G == pytest.approx(top[2], rel=1e-6)
    problem.destroy()


# -- starts that are given, buoys alone, and what is said --------------------------------------------------------------


@pytest.mark.parametrize(
    "points", [[[0, 0, -100], [5, 0, -100], [60, 0, 0]], [[0, 0, -100], [0, 30, -40], [-40, 10, 0]]]
)
def test_a_start_that_is_given(points):
    """From two polylines, one of them upstream, to the same state as from the closed form; the record states it."""
    found = solve_static(tail(), initial__points=points)
    assert found.attrs["route"] == "initial.points, relaxation"
    np.testing.assert_allclose(found.cable_tension, solve_static(tail()).cable_tension, rtol=1e-6)


def test_where_the_polyline_of_a_run_is_of_use(monkeypatch):
    """The equilibrium search falls back on the run's polyline if the closed form fails."""
    first = {"kind": "polyline", "points": [[0, 0, -100], [5, 0, -100], [60, 0, 0]], "buoy_position": [60, 0, 0.3]}
    assert at_rest(tail(initial=first))[0] == "newton"

    def fails(problem):
        raise SolveError("no closed form")

    monkeypatch.setattr("dolfbuoy.statics.equilibrium.closed_form", fails)
    assert at_rest(tail(initial=first))[0] == "initial.points, relaxation"
    with pytest.raises(SolveError, match=r"^no closed form$"):
        at_rest(tail())


def test_a_start_that_is_given_beside_a_take_off():
    """Its ends are where the points have the buoy and the joints; a buoy at none of them has no place."""
    line = {"name": "line", "segments": [CHAIN | {"length": 60.0, "elements": 8}], "slack": "tension-only"}
    side = {"from": [30.0, 0.0, -50.0], "to": "buoy", "stiffness": 20.0, "length": 45.0}
    scene = {"sea": {"depth": 50.0}, "cable": [line], "buoy": HULL, "take_off": side}
    points = [[0.0, 0.0, -50.0], [10.0, 0.0, -30.0], [25.0, 0.0, 0.0]]
    found, given = solve_static(scene), solve_static(scene, initial__points=points)
    assert given.attrs["route"].startswith("initial.points")
    for name in ("cable_tension", "take_off_tension", "buoy_position"):
        np.testing.assert_allclose(given[name], found[name], rtol=1e-6, atol=1e-6)
    scene |= {"buoy": [HULL | {"name": "a"}, HULL | {"name": "b"}], "take_off": side | {"from": "a", "to": "b"}}
    with pytest.raises(
        InputError, match=r"^initial\.points: no line ends at b, so that they do not say where it is\.$"
    ):
        solve_static(scene | {"cable": [line | {"to": "a"}]}, initial__points=points)


def test_points_that_begin_elsewhere():
    with pytest.raises(InputError, match=r"initial\.points\[0\] = .*: must be the anchor"):
        solve_static(tail(), initial__points=[[1, 0, -100], [60, 0, 0]])


def test_a_run_says_how_its_equilibrium_was_found():
    assert simulate("short", time__end=0.02).attrs["route"] == "newton"
    assert "route" not in simulate("hanging-chain", time__end=0.02).attrs  # it begins along a line


@pytest.mark.parametrize("number", [2, 3])
def test_buoys_without_any_cable(number):
    """Each floats at its own draft, under any horizontal force."""
    push = {"force": [100.0, 0.0, 0.0]}
    buoys = [HULL | {"name": f"b{k}", "mass": 225.0 + 30 * k, "external_force": push} for k in range(number)]
    problem = solve_equilibrium(load_scene({"sea": {"depth": 20.0}, "current": {"speed": 1.0}, "buoy": buoys}))
    assert problem.route == "newton"
    for k, buoy in enumerate(problem.buoys.values()):
        pose = buoy.fields.of(problem.system.u[buoy.part.slice])
        assert RHO * math.pi * 0.45**2 * (0.3 - pose.position[2]) == pytest.approx(225.0 + 30 * k, rel=1e-8)
    problem.destroy()


def test_what_failed_is_said():
    """A nearly inextensible line, exactly taut: all methods tried, with the first and the last reason."""
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 1e14, "elements": 10, "anchor": [0.0, 0.0, 0.0]}
    cable |= {"position_degree": 3, "tension_degree": 2, "top": {"kind": "fixed", "position": [0.6, 0.0, 0.8]}}
    with pytest.raises(SolveError) as caught:
        solve_static({"gravity": 1.0, "cable": cable})
    tried = "relaxation, other slack law, stiffness, end position, damped motion"
    assert str(caught.value).startswith("DIVERGED_LINEAR_SOLVE after ")
    assert f"(then tried: {tried}; this ended with: " in str(caught.value)
    assert "fold" not in str(caught.value)


def test_every_reason_is_the_one_of_its_way(monkeypatch):
    def failing(name):
        def way(problem):
            raise SolveError(f"{name} was not made to work")

        return ways.Way(name, way)

    monkeypatch.setattr("dolfbuoy.statics.equilibrium.WAYS", [failing(name) for name in "abc"])
    words = r"^a was not made to work \(then tried: b, c; this ended with: c was not made to work\)$"
    with pytest.raises(SolveError, match=words):
        at_rest(tail())


# -- the last way ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [tail(), tether(), tether(speed=1.5), "short", "three-legs"], ids=range(5))
def test_motions_end_where_newton_does(scene):
    """With momentum or with each step from rest, starting from the closed form."""
    problem = Problem(load_scene(scene), dynamic=False, comm=MPI.COMM_SELF)
    expected = at_rest(scene)[2]
    for way in ways.MOTIONS:
        problem.iterations = 0
        closed_form(problem).put()
        way.go(problem)
        nodes = problem.lines.node_dofs
        np.testing.assert_allclose(problem.system.u[nodes], expected[nodes], atol=1e-6 * problem.lines.longest)
        assert all(model.relaxation.value == 0 for model in (problem.lines, *problem.buoys.values()))
    problem.destroy()


def test_a_motion_has_an_end_and_can_be_interrupted(monkeypatch):
    problem = Problem(load_scene(tail()), dynamic=False, comm=MPI.COMM_SELF)
    problem.iterations = 0
    closed_form(problem).put()
    with pytest.raises(SolveError, match="after 5 steps of a damped motion something still moves"):
        damped.relax(problem, steps=5)
    monkeypatch.setattr(interruption, "_received", True)
    with pytest.raises(KeyboardInterrupt):
        damped.relax(problem)
    assert problem.lines.relaxation.value == 0
    problem.destroy()


def test_a_step_that_moves_nothing_is_no_rest():
    """A very short step may need no increment: equilibrium must also hold without inertia."""
    problem = solve_equilibrium(load_scene(tail()), MPI.COMM_SELF)
    scale = damped.Scale.of(problem)
    assert scale.is_rest(problem, farthest=0.0, h=1e-3)
    assert not scale.is_rest(problem, farthest=1e-3, h=1e-3)
    problem.system.u[problem.buoy.part.slice][2] += 0.01
    problem.system.publish()
    assert not scale.is_rest(problem, farthest=0.0, h=1e-3)
    problem.destroy()


@pytest.mark.parametrize("floats", [True, False])
def test_a_network_without_rest_under_the_surface_is_solved_without_it(floats, monkeypatch):
    """Once; one that has no surface has no rest then."""
    seen, solve = [], start.still.solve

    def solved(network, near=None):
        seen.append(network.surface)
        if network.surface is not None or not floats:
            raise SolveError("no rest")
        return solve(network, near)

    monkeypatch.setattr(start.still, "solve", solved)
    monkeypatch.setattr(start, "leaves_water", lambda scene: floats)
    problem = Problem(load_scene("short"), dynamic=False, comm=MPI.COMM_SELF)
    try:
        if floats:
            closed_form(problem)
            assert seen[:2] == [0.0, None]
            assert 0.0 not in seen[1:]
        else:
            with pytest.raises(SolveError, match="no rest"):
                closed_form(problem)
            assert seen == [None]
    finally:
        problem.destroy()
