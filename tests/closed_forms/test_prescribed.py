"""Line ends moved according to a table or towed at constant velocity.

Source: a sine in closed form, and the run with it given as amplitude and period; a towed rod by hand.
"""

import math

import numpy as np
import pytest
from dynamics_helpers import running

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model.lines import top_position
from dolfbuoy.scene import Top

AMPLITUDE, PERIOD = (0.3, 0.0, 0.2), 2.0
POSITION = (3.0, 0.5, 4.0)


def sine(step=0.01, end=4.0):
    """Rows of a motion starting from rest: a (1 - cos)."""
    t = np.arange(0.0, end + step / 2, step)
    return np.column_stack([t, np.multiply.outer(1 - np.cos(2 * np.pi * t / PERIOD), AMPLITUDE)]).tolist()


def swing(top, end=2.0, **cable):
    section = {"length": 6.0, "line_density": 2.0, "axial_stiffness": 1e4, "elements": 8, "top": top}
    section |= {"anchor": [0.0, 0.0, 0.0]}
    return load_scene({"cable": section | cable, "time": {"end": end, "step": 0.02, "scheme": "bdf2"}})


def motion_of(scene):
    """(t, r of all nodes) after every step."""
    found = []
    with running(scene) as simulation:
        lines = simulation.problem.lines
        for _ in simulation.run():
            found.append(np.append(simulation.t, simulation.system.u[lines.node_dofs].ravel()))
    return np.array(found)


def test_rows_of_a_sine_are_the_sine():
    """1 - cos is a sine about another position, a quarter of a period later."""
    middle = [a + b for a, b in zip(POSITION, AMPLITUDE, strict=True)]
    sinus = {"kind": "prescribed", "amplitude": AMPLITUDE, "period": PERIOD, "phase_deg": -90.0, "position": middle}
    rows = {"kind": "prescribed", "motion": sine(), "position": POSITION}
    x, y = motion_of(swing(rows)), motion_of(swing(sinus))
    assert np.ptp(x[:, 1:], axis=0).max() > 0.3
    np.testing.assert_allclose(x, y, atol=1e-6)


@pytest.mark.parametrize("t", [0.0, 0.317, 2.5, 4.0, 9.0])
def test_between_and_beyond_the_rows(t):
    top = Top(kind="prescribed", position=POSITION, motion=sine())
    inside = np.clip(t, 0.0, 4.0)
    expected = POSITION + (1 - math.cos(2 * math.pi * inside / PERIOD)) * np.array(AMPLITUDE)
    np.testing.assert_allclose(top_position(top, t), expected, atol=1e-8)


def test_rows_begin_and_end_at_rest():
    """Even where the rows themselves have a velocity."""
    top = Top(kind="prescribed", position=POSITION, motion=[[0, 0, 0, 0], [1, 1, 0, 0], [2, 3, 0, 0]])
    for t in (1e-4, 2 - 1e-4):
        assert abs(top_position(top, t)[0] - top_position(top, round(t))[0]) < 1e-6


def test_rows_from_a_file_beside_the_scene(tmp_path):
    """The scene keeps them; a stranger's scene may not name files elsewhere."""
    rows = sine(0.1)
    lines = ["t, x, y, z", *(", ".join(map(repr, row)) for row in rows)]
    (tmp_path / "motion.csv").write_text("\n".join(lines))
    text = """
        [cable]
        length = 6.0
        line_density = 2.0
        anchor = [0.0, 0.0, 0.0]
        top = { kind = "prescribed", position = [3.0, 0.5, 4.0], motion = "NAME" }
        [time]
        end = 1.0
        step = 0.1
    """
    path = tmp_path / "scene.toml"
    path.write_text(text.replace("NAME", "motion.csv"))
    assert load_scene(path).cable[0].top.motion == [tuple(row) for row in rows]
    for name in ("../motion.csv", str(tmp_path / "motion.csv")):
        path.write_text(text.replace("NAME", name))
        with pytest.raises(InputError, match="below the folder of the scene"):
            load_scene(path)


def test_a_ramp_grows_from_the_first_row():
    rows = [[t, x + 1.0, y, z] for t, x, y, z in sine()]
    top, plain = (Top(kind="prescribed", position=POSITION, motion=rows, ramp=ramp) for ramp in (2.0, 0.0))
    np.testing.assert_allclose(top_position(top, 0.0), np.add(POSITION, [1.0, 0.0, 0.0]), atol=1e-12)
    share = top_position(top, 1.0)[0] - POSITION[0] - 1.0, top_position(plain, 1.0)[0] - POSITION[0] - 1.0
    assert 0 < share[0] < share[1]
    np.testing.assert_allclose(top_position(top, 3.0), top_position(plain, 3.0), atol=1e-12)


def test_tow():
    """A vertical inextensible line towed sideways from rest trails behind; its end moves as prescribed."""
    tow = {"kind": "prescribed", "position": [0.0, 0.0, 6.0], "velocity": [0.5, -0.25, 0.0], "ramp": 0.5}
    scene = swing(tow, end=1.0, anchor=[0.0, 0.0, 1.0])
    found = motion_of(scene)
    t = found[:, 0]
    ends = found[:, 1:].reshape(len(t), -1, 3)
    top = ends[:, ends[0, :, 2].argmax()]
    late = t >= 0.5
    np.testing.assert_allclose(
        top[late], np.array([0, 0, 6]) + np.multiply.outer(t[late] - 0.25, [0.5, -0.25, 0]), atol=1e-12
    )
    assert np.all(np.diff(top[:, 0]) > 0)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"motion": [[0, 0, 0, 0]]}, "at least 2 items"),
        ({"motion": [[0, 0, 0, 0], [0, 1, 0, 0]]}, "growing time"),
        ({"motion": [[0, 0, 0], [1, 1, 0]]}, "4 finite numbers"),
        ({"motion": sine(), "velocity": [1, 0, 0]}, "does not go with velocity"),
        ({"amplitude": [1, 0, 0], "period": 3.0, "velocity": [1, 0, 0]}, "does not go with amplitude"),
        ({"period": 3.0}, "amplitude: must be given"),
        ({}, "needs amplitude and period, a velocity or a motion"),
        ({"kind": "fixed", "velocity": [1, 0, 0]}, "prescribed"),
    ],
)
def test_what_is_no_motion(keys, said):
    with pytest.raises(InputError, match=said):
        swing({"kind": "prescribed", "position": POSITION} | keys)
