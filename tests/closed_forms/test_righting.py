"""Righting levers of hulls at any heel, integrated with the program's own hull strips.

Source: levers in tests/reference (scipy/mpmath), metacentric heights in closed form.
"""

import math

import pytest
from helpers import reference, reference_buoy

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model.rigid import mass_properties
from dolfbuoy.statics.righting import righting_curve

BUOYS = ("buoyA_short", "buoyA0_short_unstable", "buoyB_long")


@pytest.mark.parametrize("name", BUOYS)
def test_levers_of_a_free_cylinder(name):
    """Lever and draft at every heel of the reference, from 1 to 179 degrees."""
    b = reference("buoy_statics")[name]
    scene = load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy(name)})
    rows = b["GZ_curve_free"]
    for found, row in zip(righting_curve(scene, [row["deg"] for row in rows]), rows, strict=True):
        keel = found.height - b["zG_above_keel"] * math.cos(math.radians(row["deg"]))
        assert keel == pytest.approx(row["zK"], abs=1e-5 * b["D"])
        assert found.lever == pytest.approx(row["GZ"], abs=1e-5 * b["D"])


@pytest.mark.parametrize("name", BUOYS)
def test_levers_under_a_pull(name):
    """Their slope at small heels is the stiffness of the reference under every pull that the buoy carries."""
    b = reference("buoy_statics")[name]
    scene = load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy(name)})
    heel = 0.1
    for row in (row for row in b["moored_table"] if row["draft"] is not None):
        lever = righting_curve(scene, [heel], row["T_keel"])[0].lever
        stiffness = lever * mass_properties(scene.buoy[0]).mass * 9.81 / math.sin(math.radians(heel))
        assert stiffness == pytest.approx(row["pitch_stiffness_about_keel"], rel=1e-3, abs=1.0)


def test_a_pull_that_sinks():
    scene = load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy("buoyA_short")})
    with pytest.raises(InputError, match="sinks"):
        righting_curve(scene, [10.0], 1e6)
    with pytest.raises(InputError, match=r"\[sea\]"):
        righting_curve(load_scene("driven"), [10.0])
