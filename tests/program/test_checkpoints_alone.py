"""Checkpoints alone: restored data, completeness of a run, and refusals.

Source: states and times by hand.
"""

import numpy as np
import pytest
from chains import CHAIN

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import checkpoint

SCENE = load_scene(CHAIN)
STEP = SCENE.time.step


@pytest.fixture
def stopped(tmp_path):
    """A folder with a checkpoint of two ranks at half the end, and an empty record."""
    states = [{"t": 0.5 * SCENE.time.end, "x": np.arange(3.0), "list": [{"k": i} for i in range(12)], "no": None}] * 2
    SCENE.save(tmp_path / "scene.toml")
    (tmp_path / "results.nc").touch()
    checkpoint.write(checkpoint.Checkpoint(tmp_path, SCENE, states, {"time": 4, "frame": 2}, 0.75))
    return tmp_path


def test_a_checkpoint_holds_what_was_put_into_it(stopped):
    point = checkpoint.load(stopped, 2)
    assert (point.folder, point.scene, point.rows, point.next_frame) == (stopped, SCENE, {"time": 4, "frame": 2}, 0.75)
    assert len(point.states) == 2
    for state in point.states:
        assert state.keys() == {"t", "x", "list"}
        assert (state["x"].tolist(), state["list"]) == ([0.0, 1.0, 2.0], [{"k": i} for i in range(12)])
    assert (point.t, point.complete) == (0.5 * SCENE.time.end, False)
    with pytest.raises(InputError, match=r"holds a run on 2 MPI ranks; it cannot be resumed on 1\.$"):
        checkpoint.load(stopped, 1)


@pytest.mark.parametrize("short", [0.9e-9, 1.1e-9])
def test_the_end_of_a_run_is_reached_but_for_rounding(stopped, short):
    """So a run is complete, and may end where it is."""
    reached = 0.5 * SCENE.time.end
    point = checkpoint.Checkpoint(stopped, SCENE, [{"t": SCENE.time.end - short * STEP}], {}, 0.0)
    assert point.complete == (short < 1e-9)
    if short < 1e-9:
        assert checkpoint.load(stopped, 2, reached - short * STEP).scene.time.end < reached
        return
    with pytest.raises(InputError, match=f"the run has reached t = {reached:g} s already"):
        checkpoint.load(stopped, 2, reached - short * STEP)


def test_another_scene_is_named_by_its_key(stopped):
    changed = load_scene(SCENE, time__step=STEP / 2, time__end=9.0)
    changed.save(stopped / "scene.toml")
    with pytest.raises(InputError, match=r"no longer the scene of the run: time\.step is different\.$"):
        checkpoint.load(stopped, 2)
    assert checkpoint._difference({"a": {"b": 1}}, {"a": {"b": 1, "c": None}}) is None
    assert checkpoint._difference({"a": {"b": 1}}, {"a": {}, "d": 2}) == "a.b"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows/time": -1}, "is damaged, or not a checkpoint"),
        ({"rows/frame": -1}, "is damaged, or not a checkpoint"),
        ({"states/1/t": -0.1}, "is damaged, or not a checkpoint"),
        ({"format": 4}, "has format 4, and this version resumes format 5 only"),
        ({"rows/time": 0, "rows/frame": 0, "states/0/t": 0.0, "states/1/t": 0.0}, ""),
    ],
)
def test_numbers_of_a_checkpoint_are_sound(stopped, change, said):
    with np.load(stopped / checkpoint.NAME) as leaves:
        kept = dict(leaves)
    with open(stopped / checkpoint.NAME, "wb") as file:
        np.savez(file, **kept | change)
    if not said:
        assert checkpoint.load(stopped, 2).t == 0.0
        return
    with pytest.raises(InputError, match=said):
        checkpoint.load(stopped, 2)
