"""Scales of the two regularisations: the effect of varying them, and their restoration afterwards.

Source: the original scales, hydrostatics in closed form.
"""

import json

import pytest
from verification import regularisation as study

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.forms import hull, morison
from dolfbuoy.studies.study import run

CABLE = {
    "sea": {"depth": 20.0},
    "cable": {
        "length": 22.0,
        "line_density": 27.6,
        "diameter": 0.08,
        "elements": 6,
        "normal_drag": 0.8,
        "top": {"kind": "fixed", "position": [12.0, 0.0, -2.0]},
    },
    "current": {"speed": 0.5},
    "time": {"end": 0.1, "step": 0.05},
}
SPAR = {
    "sea": {"depth": 20.0},
    "buoy": {"hull": [[0.0, 1.0], [3.0, 1.0]], "mass": 1200.0, "center_of_mass": 0.5, "inertia": [900.0, 150.0]},
    "time": {"end": 0.0, "step": 0.05},
}


def test_scales_come_back():
    """Also when the run in between fails."""
    before = [morison.SMOOTHING_SPEED, hull.LEAST_TILT, hull.FACE_TILT]
    for what in study.SCALES:
        with pytest.raises(ArithmeticError), study.scaled(what, 10.0):  # noqa: PT012
            assert before != [morison.SMOOTHING_SPEED, hull.LEAST_TILT, hull.FACE_TILT]
            raise ArithmeticError
    assert before == [morison.SMOOTHING_SPEED, hull.LEAST_TILT, hull.FACE_TILT]


@pytest.mark.slow
def test_the_draft_depends_on_nothing_of_it(tmp_path):
    """A cylinder's wet volume is right for any cut and any number of points."""
    rows = run(study.study, tmp_path, scene=load_scene(SPAR)).rows["regularisation"]
    assert sorted(row["scale"] for row in rows if row["what"] == study.POINTS) == [9, 13, 17, 25]
    assert sorted(row["factor"] for row in rows if row["unit"] == "rad") == [0.1, 0.2, 0.5, 1.0, 1.0, 2.0, 1e2, 1e4]
    assert max(abs(row["change_static_height"]) for row in rows) < 1e-9
    assert json.loads((tmp_path / "regularisation.json").read_text())["rows"] == rows


@pytest.mark.slow
def test_the_tension_does_not_depend_on_the_smoothing_speed(tmp_path):
    """The change grows like eps^2 and is far below what counts at a hundred times the scale."""
    rows = run(study.study, tmp_path, scene=load_scene(CABLE)).rows["regularisation"]
    change = {row["factor"]: abs(row["change_largest_tension"]) for row in rows}
    assert change[1e2] < 1e-8
    assert change[1e-2] < 1e-11
    assert 1e3 < change[1e4] / change[1e2] < 1e5


def test_a_dry_scene_has_nothing_to_vary():
    dry = {"cable": {k: v for k, v in CABLE["cable"].items() if k not in ("diameter", "normal_drag")}}
    with pytest.raises(InputError, match="nothing to vary"):
        study.cases(load_scene(dry))
