"""Running extremes of every element and node cover all steps, for any number of frames, in one run or in two.

Source: the unknowns at every step, and records of every step.
"""

import itertools

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.page.series import envelopes
from dolfbuoy.results import checkpoint
from dolfbuoy.results.parts import parts_of
from dolfbuoy.results.quantities import over
from dolfbuoy.results.record import read

RAMP = 0.2
TIME = {"end": 0.5, "step": 0.02, "output_every": 0.5}
SCENE = merged(MOORED, cable__elements=6, waves__ramp=RAMP, time=TIME)
EXTREMES = over("run")
OF_ALL = {name for name in EXTREMES if "utilisation" not in name and "curvature" not in name}
OF_WHOLE_RUN = {name for name in OF_ALL if not name.endswith("_after_ramp")}


def legs():
    """Legs of two pairs of elements, the first of which parts, the second of two segments; adaptive steps."""
    scene = load_scene("three-legs").to_dict() | {"time": {**TIME, "scheme": "bdf2", "tolerance": 0.05}}
    scene["waves"]["ramp"] = RAMP
    for cable, degrees in zip(scene["cable"], ((1, 0), (2, 1), (1, 0)), strict=True):
        cable |= {"position_degree": degrees[0], "tension_degree": degrees[1], "breaking_load": 2e4, "elements": 3}
    east, north, _ = scene["cable"]
    east["fails_at"] = {"time": 0.3}
    north["segments"] = [{"length": length, "elements": 2} for length in (20.0, 30.0)]
    for key in ("length", "elements", "grading"):
        del north[key]
    return scene


def of_every_step(scene):
    """Record of a run, and (times, tensions at the nodes of T of each element, places of nodes) of all its steps."""
    states = []

    def look(simulation, _iterations=0):
        lines, u = simulation.problem.lines, simulation.system.u
        cells, nodes = np.argsort(lines.cell_ends.mean(axis=1)), np.argsort(lines.node_s, kind="stable")
        states.append((simulation.t, u[lines.T_dofs][cells], u[lines.node_dofs][nodes]))

    first = Simulation(load_scene(scene))
    look(first)
    first.problem.destroy()
    record = dolfbuoy.simulate(scene, progress=look)
    t, tensions, places = (np.array(values) for values in zip(*states, strict=True))
    np.testing.assert_array_equal(record.time, t)
    moved = np.ptp(np.diff(places, axis=1), axis=0).any(axis=1) | np.diff(places[0], axis=0).any(axis=1)
    return record, t, tensions, places[:, np.append(True, moved)]  # a node of two segments counts once


@pytest.mark.parametrize("scene", [SCENE, legs()], ids=["moored buoy", "legs"])
def test_extremes_are_those_of_all_steps(scene):
    """To the last bit; frames alone miss them, and what comes before the end of the ramp is told apart."""
    record, t, tensions, places = of_every_step(scene)
    assert record.sizes["frame"] == 2 < len(t) - 3
    np.testing.assert_array_equal(record.cable_tension_minimum, tensions.min(axis=(0, 2)))
    np.testing.assert_array_equal(record.cable_tension_maximum, tensions.max(axis=(0, 2)))
    behind = tensions[t >= RAMP * (1 - 1e-9)]
    assert 0 < len(behind) < len(t) - 1
    np.testing.assert_array_equal(record.cable_tension_minimum_after_ramp, behind.min(axis=(0, 2)))
    np.testing.assert_array_equal(record.cable_tension_maximum_after_ramp, behind.max(axis=(0, 2)))
    np.testing.assert_array_equal(record.cable_position_minimum, places.min(axis=0))
    np.testing.assert_array_equal(record.cable_position_maximum, places.max(axis=0))
    assert (record.cable_tension_maximum > record.cable_tension.max("frame")).any()
    wider = record.cable_tension_minimum < record.cable_tension_minimum_after_ramp
    assert (wider | (record.cable_tension_maximum > record.cable_tension_maximum_after_ramp)).any()
    assert record.cable_tension_maximum.attrs["cell_methods"] == "time: maximum"


def test_utilisation_is_that_of_the_largest_tension():
    """Of each segment, over its breaking load: exactly that of its nodes of T; of degree 0 more, at its ends."""
    record = dolfbuoy.simulate(legs())
    names = {"east": (0, 0), "north.0": (1, 0), "north.1": (1, 1), "south": (2, 0)}
    for name, (cable, segment) in names.items():
        mine = (record.cable_of_cell == cable) & (record.segment_of_cell == segment)
        largest = float(record.cable_tension_maximum.where(mine).max()) / 2e4
        told = float(record.utilisation.sel(segment=name).max())
        assert told == largest if cable == 1 else largest < told < 1.2 * largest
    np.testing.assert_array_equal(record.cable_utilisation_maximum, record.cable_tension_maximum / 2e4)
    assert record.attrs["parted"].startswith("east")
    assert record.cable_tension_minimum[2] == 0 != record.cable_tension_minimum[3]  # where it has parted


def test_frames_change_nothing():
    """Dense and sparse frames: the same extremes, and those of the dense ones."""
    dense = dolfbuoy.simulate(merged(SCENE, time__output_every=0.02))
    sparse = dolfbuoy.simulate(SCENE)
    for name in OF_ALL:
        np.testing.assert_array_equal(dense[name], sparse[name])
    np.testing.assert_array_equal(dense.cable_tension_maximum, dense.cable_tension.max("frame"))
    np.testing.assert_array_equal(sparse.cable_position_minimum, dense.cable_position.min("frame"))


def test_without_a_ramp_there_is_one_range():
    """And the envelope is that; before the end of the ramp there is none."""
    found = dolfbuoy.simulate(merged(SCENE, waves__ramp=0.0, time__output_every=0.1))
    assert set(EXTREMES) & set(found.variables) == OF_WHOLE_RUN
    parts = [(part.label, part.record) for part in parts_of(found, "cable")]
    (envelope,) = envelopes(parts, load_scene(SCENE, waves__ramp=0.0))
    assert (envelope["from"], envelope["instants"]) == (0.0, 6)
    early = dolfbuoy.simulate(merged(SCENE, time__end=0.1))
    assert set(EXTREMES) & set(early.variables) == OF_WHOLE_RUN
    assert dolfbuoy.solve_static(SCENE).keys().isdisjoint(EXTREMES)


class Stop(Exception):
    """Somebody pulled the plug."""


def test_a_run_in_two_parts(tmp_path):
    """Stopped, the record has the extremes of the steps it has; taken up again from the start, those of all."""
    scene, count = merged(SCENE, time__output_every=0.02), itertools.count(1)

    def stop(_simulation, _iterations):
        if next(count) == 14:
            raise Stop

    with pytest.raises(Stop):
        dolfbuoy.simulate(scene, out=tmp_path, progress=stop)
    half = read(tmp_path / "results.nc")
    assert checkpoint.load(tmp_path, 1).rows["time"] < len(half.time) == 15
    np.testing.assert_array_equal(half.cable_tension_maximum, half.cable_tension.max("frame"))
    np.testing.assert_array_equal(half.cable_position_maximum, half.cable_position.max("frame"))
    whole, resumed = dolfbuoy.simulate(scene), dolfbuoy.simulate(resume=tmp_path)
    for name in OF_ALL:
        np.testing.assert_array_equal(resumed[name], whole[name])


@pytest.mark.parametrize("kept", [np.zeros(3), np.full((2, 2, 45), "x")])
def test_extremes_of_something_else_in_a_checkpoint(tmp_path, kept):
    dolfbuoy.simulate(merged(SCENE, time__end=0.04), out=tmp_path)
    with np.load(tmp_path / checkpoint.NAME) as file:
        leaves = dict(file)
    assert leaves["states/0/extremes"].shape[:2] == (2, 2)
    np.savez(tmp_path / checkpoint.NAME, **leaves | {"states/0/extremes": kept})
    with pytest.raises(InputError, match="are not of this scene: the run can only begin anew"):
        dolfbuoy.simulate(resume=tmp_path, time__end=0.1)


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks(tmp_path):
    """The same on two ranks, element by element."""
    done = start_scenes(2, {"legs": legs(), "moored": SCENE}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    for name, scene in (("legs", legs()), ("moored", SCENE)):
        one, together = dolfbuoy.simulate(scene), read(tmp_path / name / "results.nc")
        for quantity in set(EXTREMES) & set(one.variables):
            size = np.abs(one[quantity]).max()
            np.testing.assert_allclose(together[quantity], one[quantity], rtol=0, atol=1e-8 * float(size))


def test_largest_curvature_of_every_step():
    """|m|/EI of all steps, in the nodes of lines that bend beside one that does not; frames alone miss it."""
    rod = {"name": "rod", "length": 12.0, "line_density": 5.0, "bending_stiffness": 1e3, "elements": 4, "to": "tip"}
    rod |= {
        "from": [0.0, 0.0, 0.0],
        "from_end": {"direction": [1.0, 0.0, 0.0]},
        "position_degree": 2,
        "tension_degree": 1,
    }
    shaken = {
        "kind": "prescribed",
        "position": [20.0, 0.0, 1.0],
        "amplitude": [0.0, 0.5, 1.0],
        "period": 0.4,
        "ramp": 0.2,
    }
    chain = {"name": "chain", "length": 10.0, "line_density": 5.0, "elements": 3, "from": "tip", "top": shaken}
    scene = {"cable": [rod, chain], "joint": [{"name": "tip"}], "time": TIME | {"scheme": "bdf2"}}
    found = []

    def look(simulation, _iterations=0):
        lines = simulation.problem.lines
        m = np.linalg.norm(lines.moments(simulation.system.u), axis=1)
        found.append(m[np.lexsort((lines.node_s, lines.line_of_node))] / 1e3)

    first = Simulation(load_scene(scene))
    look(first)
    first.problem.destroy()
    record = dolfbuoy.simulate(scene, progress=look)
    np.testing.assert_allclose(record.curvature_maximum, np.max(found, axis=0), rtol=1e-14)
    assert (record.curvature_maximum > 1.01 * record.curvature.max("frame")).any()
    assert (record.curvature_maximum[record.cable_of_node == 1] == 0).all()
    assert record.curvature_maximum.attrs["cell_methods"] == "time: maximum"
