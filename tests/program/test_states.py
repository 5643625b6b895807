"""Summary messages about buoys that lean, capsize or are under water.

Source: made-up series, and an equilibrium on a short line.
"""

import numpy as np
import pytest
from made_up import RECORD, SCENE

from dolfbuoy import load_scene, solve_static
from dolfbuoy.model.rigid import shape_of
from dolfbuoy.results.cautions import states_of
from dolfbuoy.results.summary import static_warnings, warnings

VOLUME = shape_of(SCENE.network.buoys["buoy"]).volume() * SCENE.sea.density


def said(**values):
    """Sentences about the buoy of the made-up record with other values at some instants."""
    record = RECORD.copy(deep=True)
    record["displaced_mass"] = ("time", "buoy"), np.full((record.sizes["time"], 1), 0.6 * VOLUME)
    for name, rows in values.items():
        for number, value in rows.items():
            record[name][number, 0] = value
    return [sentence for sentence in warnings(record, SCENE) if sentence.startswith("The buoy ")]


@pytest.mark.parametrize(
    ("angles", "sentence"),
    [
        ({10: 44.9}, None),
        ({10: 52.34, 30: 46.0}, "The buoy leaned by up to 52.3 degrees, at t = 1 s."),
        ({20: 95.0, 35: 171.0}, "The buoy capsized: it leaned by more than 90 degrees from t = 2 s on, up to 171."),
    ],
)
def test_lean_and_capsize(angles, sentence):
    assert said(cone_angle=angles) == ([sentence] if sentence else [])


def test_under_water():
    assert said(displaced_mass={7: 0.999 * VOLUME}) == []
    share = 100 * 2 / RECORD.sizes["time"]
    words = f"The buoy was all under water in {share:.2g} % of the instants, first at t = 0.9 s."
    assert said(displaced_mass={9: VOLUME, 12: VOLUME}) == [words]


@pytest.mark.parametrize(("angle", "words"), [(44.9, ""), (45.0, "leans"), (46.0, "leans"), (91.0, "is capsized")])
def test_lean_at_rest(angle, words):
    record = RECORD[["cone_angle"]].isel(time=0, drop=True)
    record["cone_angle"] = ("buoy",), np.array([angle])
    assert states_of(record, SCENE) == ([f"The buoy {words} at rest: {angle:g} degrees."] if words else [])


def test_at_rest_under_water():
    cable = {"line_density": 31.0, "diameter": 0.09, "axial_stiffness": 4e6}
    scene = {"sea": {"depth": 24.0}, "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0}}
    for length, sentences in ((16.0, ["The buoy is all under water at rest."]), (24.0, [])):
        loaded = load_scene(scene | {"cable": cable | {"length": length}})
        found = static_warnings(solve_static(loaded), loaded)
        assert [sentence for sentence in found if sentence.startswith("The buoy ")] == sentences
