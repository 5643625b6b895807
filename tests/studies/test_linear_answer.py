"""The linear estimate in `advise` and `study work-precision` nearly agrees with runs in low waves, and reports this.

Source: the program's own runs in time.
"""

import re

import pytest

from dolfbuoy import load_scene
from dolfbuoy.results.measured import compute, quantities_of
from dolfbuoy.studies.accuracy.linear_answer import linear_answer

LOW = {"amplitude": 0.01, "period": 6.0, "ramp": 18.0}
LOW_SEA = {"spectrum": "jonswap", "significant_height": 0.05, "peak_period": 6.0, "components": 40, "ramp": 18.0}
TIME = {"end": 90.0, "step": 0.03, "scheme": "bdf2"}


def said(scene, start=36.0):
    """Quantity -> sentence."""
    run = compute(scene, quantities_of(scene))
    return {name: linear_answer(scene, run, name, start) for name in run.values}


def off(sentence):
    """[%], of a sentence."""
    assert re.match(
        r"linear response: [\d.]+ s, the standard deviation of the .* off; that run in time: [\d.]+ s\.$", sentence
    )
    return float(re.search(r"([\d.e+-]+) % off", sentence)[1])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("short", ["tension_top", "tension_anchor", "buoy_position", "cone_angle"]),
        ("driven", ["tension_top", "tension_anchor"]),
        ("hanging-chain", ["tension_anchor"]),
    ],
)
def test_what_varies(name, expected):
    """A free end has no tension of its own."""
    assert quantities_of(load_scene(name)) == expected


@pytest.mark.parametrize("waves", [LOW, LOW_SEA | {"spreading": 3.0}], ids=["regular", "irregular"])
@pytest.mark.parametrize("name", ["short", pytest.param("three-legs", marks=pytest.mark.slow)])
def test_low_waves(name, waves):
    """Of one line and of three, in a wave and in a sea: tensions and positions within 1.5 %; no word on cone angles."""
    found = said(load_scene(load_scene(name).to_dict() | {"waves": waves, "time": TIME}))
    assert found.pop("cone_angle") is None
    assert set(found) == {"tension_top", "tension_anchor", "buoy_position"}
    assert all(off(sentence) < 1.5 for sentence in found.values()), found


def test_nothing_is_said():
    """Without waves, and where ends are moved."""
    still = load_scene(load_scene("short").to_dict() | {"waves": None, "time": TIME | {"end": 0.3}})
    assert set(said(still, 0.0).values()) == {None}
    moved = load_scene(load_scene("bridle").to_dict() | {"time": TIME | {"end": 0.3}})
    assert set(said(moved, 0.0).values()) == {None}
