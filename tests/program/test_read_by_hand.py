"""Intermediate numbers of results, each from a made-up scene or record of distinct numbers.

Source: the same numbers by hand.
"""

from types import SimpleNamespace as Fake

import numpy as np
import pytest

from dolfbuoy import load_scene
from dolfbuoy.accuracy.bars import _instant
from dolfbuoy.model.problem import Problem
from dolfbuoy.results.quantities import QUANTITIES
from dolfbuoy.results.sample import _strength
from dolfbuoy.results.series import Series
from dolfbuoy.results.snapshot import _tension
from dolfbuoy.studies.physics.hull import MOTIONS, _compared


def test_a_tension_is_that_of_its_own_end_of_a_line():
    """Breaking load and steel of the segment there, the upper one at the top."""
    strong = {"breaking_load": 9e5, "steel_area": 4e-3, "length": 10.0, "elements": 2}
    weak = {"breaking_load": 3e5, "steel_area": 2e-3, "length": 12.0, "elements": 2}
    own = {"line_density": 20.0, "diameter": 0.05, "axial_stiffness": 1e8}
    top = {"kind": "fixed", "position": [0.0, 0.0, -1.0]}
    scene = load_scene({"sea": {"depth": 20.0}, "cable": {"segments": [strong | own, weak | own], "top": top}})
    assert _strength("tension_anchor of cable", scene) == {"breaking_load": 9e5, "steel_area": 4e-3}
    assert _strength("tension_top of cable", scene) == {"breaking_load": 3e5, "steel_area": 2e-3}
    assert _strength("offset of buoy", scene) == {}


def test_instants_of_extremes():
    series = Series("x", np.array([0.0, 1.0, 2.0, 3.0]), np.array([4.0, 9.0, 1.0, 5.0]))
    assert [_instant(series, number) for number in ("max", "min", "mean")] == [1.0, 2.0, -np.inf]


def test_turns_of_a_buoy_by_their_names():
    turns = Fake(turns=(10.0, 20.0, 30.0))
    assert [QUANTITIES[name].read(turns) for name in ("roll", "pitch", "yaw")] == [10.0, 20.0, 30.0]


@pytest.mark.parametrize(
    ("tensions", "said"),
    [
        ([500.0, 2500.0, 1500.0], ", tension 0.5 to 2.5 kN"),
        ([30.0, 7.0], ", tension 7 to 30 N"),
        ([4e3], ", tension 4 kN"),
    ],
)
def test_tension_in_the_legend_of_a_snapshot(tensions, said):
    assert _tension(Fake(run=Fake(spans=[None]), tension=np.array(tensions))) == said
    assert _tension(Fake(run=Fake(spans=[None, None]), tension=np.array(tensions))) == ""


def test_tension_where_two_elements_meet_is_the_larger_one():
    lines = Fake(cell_ends=np.array([[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]), begins=[0.0], line_of_cell=np.zeros(3, int))
    for values in ([5.0, 9.0, 1.0], [9.0, 5.0, 1.0]):
        lines.mean_tension = lambda u, values=values: np.array(values)
        problem = Fake(lines=lines, system=Fake(u=None), comm=Fake(size=1))
        assert [Problem.tension_at(problem, s) for s in (0.5, 1.0, 2.5)] == [values[0], 9.0, 1.0]


def test_differences_of_responses_are_per_cent_of_the_other():
    other = dict.fromkeys(MOTIONS, 2.0 + 0j)
    motions = Fake(**dict.fromkeys(MOTIONS, 2.0 + 0.5j))
    row = _compared(other, Fake(period=8.0, wavenumber=0.1, motions=motions), "run")
    assert [row[f"{name}_difference"] for name in MOTIONS] == pytest.approx([25.0] * len(MOTIONS))
    assert row["pitch_over_slope_run"] == pytest.approx(20.0)
