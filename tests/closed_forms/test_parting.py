"""Lines that part at a time or tension, and the motion of what remains.

Source: free fall by hand, tensions before and after, the same run resumed.
"""

import copy

import numpy as np
import pytest
from alone import simulate
from dynamics_helpers import running

import dolfbuoy
from dolfbuoy import load_scene, statistics
from dolfbuoy.errors import InputError
from dolfbuoy.studies.sweep import sweep

ELEMENTS, G = 8, 9.81


def chain(fails_at, **more):
    """An inextensible chain hanging straight down from its anchor, in vacuum."""
    cable = {"length": 4.0, "line_density": 3.0, "elements": ELEMENTS, "anchor": [0.0, 0.0, 0.0]}
    cable |= {"top": {"kind": "free"}, "fails_at": fails_at}
    time = {"end": 0.6, "step": 0.02, "scheme": "backward-euler"}
    return load_scene({"cable": cable, "time": time} | more)


def test_a_chain_that_parts_at_its_top_falls():
    """Nothing bends or stretches: it falls at g, except for the half element that stays and what it drags along."""
    heights = []
    with running(chain({"time": 0.2, "at": 0.0})) as simulation:
        lines, u = simulation.problem.lines, simulation.system.u
        free = lines.end_dofs[0][1][2]
        first = np.argmin(lines.T_s[:, 0])
        for _ in simulation.run():
            heights.append(u[free])
            assert (abs(u[lines.T_dofs[first, 0]]) < 1e-9) == (simulation.t > 0.21)
    a = G * (ELEMENTS - 1 / 2) / (ELEMENTS - 2 / 3)
    fallen = np.arange(1, 21) * (np.arange(1, 21) + 1) / 2 * a * 0.02**2  # as backward Euler falls from rest
    np.testing.assert_allclose(heights[:10], -4.0, atol=1e-12)
    np.testing.assert_allclose(-4.0 - np.array(heights[10:]), fallen, rtol=1e-9)


def test_the_upper_end_is_where_it_parts_if_nothing_else_is_said():
    with running(chain({"time": 0.2})) as simulation:
        lines, u = simulation.problem.lines, simulation.system.u
        list(simulation.run())
        order = np.argsort(lines.T_s[:, 0])
        T = u[lines.T_dofs[order, 0]]
        np.testing.assert_allclose(T[:-1], T[0] - 3.0 * G * 0.5 * np.arange(ELEMENTS - 1), rtol=1e-6)
        assert abs(T[-1]) < 1e-9


def pulled(tension, slack="compressive", pair=(2, 1)):
    """A line whose upper end is pulled up without limit."""
    top = {"kind": "prescribed", "position": [1.0, 0.0, 5.0], "velocity": [0.0, 0.0, 0.5], "ramp": 0.5}
    cable = {"length": 5.0, "line_density": 1.0, "axial_stiffness": 2e3, "elements": 6, "top": top, "slack": slack}
    cable |= {"position_degree": pair[0], "tension_degree": pair[1], "anchor": [0.0, 0.0, 0.0], "damping": 5.0}
    cable |= {"diameter": 0.02, "normal_drag": 1.0, "added_mass": 1.0, "fails_at": {"tension": tension}}
    time = {"end": 4.0, "step": 0.02, "scheme": "bdf2"}
    return load_scene({"sea": {"depth": 50.0}, "cable": cable, "time": time})


@pytest.mark.parametrize(
    ("slack", "pair"), [("compressive", (2, 1)), ("tension-only", (1, 0)), ("compressive", (1, 0))]
)
def test_a_line_that_is_pulled_too_hard(slack, pair):
    """The tension rises to the limit, falls to zero at once, and the rest sinks."""
    limit = 600.0
    record = simulate(pulled(limit, slack, pair))
    T = record.tension_top.values
    peak = T.argmax()
    assert 0.98 * limit < T[peak] < 1.05 * limit
    assert np.median(T[-20:]) < 0.01 * limit
    parted = record.cable_tension.isel(frame=-1).values
    assert np.abs(parted).min() < 1e-6 * limit
    middle = record.cable_position.isel(node=4).values[:, 2]
    assert middle[-1] < middle[peak] - 0.1


def test_a_leg_that_parts_lets_its_float_go():
    line = {"length": 12.0, "line_density": 1.0, "axial_stiffness": 1e5, "diameter": 0.02, "elements": 6}
    line |= {"normal_drag": 1.2, "added_mass": 1.0}
    angles = dict(zip("abc", np.radians([0.0, 120.0, 240.0]), strict=True))
    legs = [line | {"name": n, "from": [6 * np.cos(a), 6 * np.sin(a), -10.0], "to": "F"} for n, a in angles.items()]
    legs[0]["fails_at"] = {"time": 1.0}
    floating = {"name": "F", "mass": 100.0, "volume": 0.5, "drag_area": 1.0, "added_mass": 0.5}
    scene = {"sea": {"depth": 10.0}, "cable": legs, "joint": [floating]}
    record = simulate(load_scene(scene | {"time": {"end": 6.0, "step": 0.05, "scheme": "bdf2"}}))
    x, before = record.joint_position[:, 0, 0].values, record.time.values <= 1.0
    assert np.ptp(x[before]) < 1e-6
    assert x[-1] < x[0] - 0.3  # away from the leg that is gone, to the middle of the others
    np.testing.assert_allclose(record.tension_top[:, 1], record.tension_top[:, 2], rtol=1e-6)


def test_a_run_goes_on_from_its_state():
    """Parted lines remain parted."""
    scene = pulled(600.0)
    with running(scene) as simulation:
        run = simulation.run()
        while simulation.t < 3.0:
            next(run)
        state = copy.deepcopy(simulation.state())
        list(run)
        expected = simulation.system.u.copy()
    with running(scene) as simulation:
        simulation.restore(state)
        list(simulation.run())
        np.testing.assert_array_equal(simulation.system.u, expected)
        assert simulation.problem.lines.memory["parted_elements"].max() == 1.0


def test_statistics_say_that_a_line_parted(tmp_path):
    """Where and when, of a record as of a case of a sweep; nothing of lines that hold."""
    scene = chain({"time": 0.2, "at": 0.0})
    record = dolfbuoy.simulate(scene)
    assert record.attrs["parted"] == "cable at s = 0.25 m, t = 0.2 s"
    said = f"Lines parted, run 0: {record.attrs['parted']}; numbers mix what was before and after"
    assert statistics(record).attrs["notes"].startswith(said)
    assert "parted" not in statistics(dolfbuoy.simulate(chain({"tension": 1e9}))).attrs["notes"]
    sweep(scene, ["cable.fails_at.time=0.2,9"], None, tmp_path)
    assert "Lines parted, in 1 of 2 runs, cable.fails_at.time = 0.2: " in statistics(tmp_path).attrs["notes"]


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ({}, "time: must be given"),
        ({"time": 1.0, "tension": 2.0}, "must be given"),
        ({"tension": 2.0, "at": 1.0}, "at"),
    ],
)
def test_what_is_no_rule(rule, said):
    with pytest.raises(InputError, match=said):
        chain(rule)


def segmented(fails_at, own=None):
    """The chain in three segments, the middle one with a rule of its own."""
    segments = [{"length": length, "elements": n} for length, n in ((1.0, 2), (2.0, 4), (1.0, 2))]
    segments[1] |= {"fails_at": own} if own else {}
    cable = {"line_density": 3.0, "anchor": [0.0, 0.0, 0.0], "top": {"kind": "free"}, "fails_at": fails_at}
    time = {"end": 0.4, "step": 0.02, "scheme": "backward-euler"}
    return load_scene({"cable": cable | {"segments": segments}, "time": time})


@pytest.mark.parametrize(
    ("rule", "own", "places"),
    [
        ({"time": 0.2}, None, [(3.75, 0.2)]),
        ({"time": 0.2, "at": 1.7}, None, [(1.75, 0.2)]),
        ({"time": 0.2, "at": 1.0}, None, [(0.75, 0.2)]),
        ({"tension": 100.0}, None, [(0.25, 0.02)]),
        ({"time": 0.2}, {"time": 0.3, "at": 0.2}, [(3.75, 0.2), (1.25, 0.3)]),
    ],
)
def test_a_line_of_segments_parts_once(rule, own, places):
    """By the cable's rule at one place, counted from its lower end; a segment by its own besides."""
    said = "; ".join(f"cable at s = {s} m, t = {t} s" for s, t in places)
    assert simulate(segmented(rule, own)).attrs["parted"] == said


def test_where_no_line_is():
    with pytest.raises(InputError, match=r"cable.fails_at.at = 4.1: must be on the cable, 0 to length = 4 m"):
        segmented({"time": 0.2, "at": 4.1})
