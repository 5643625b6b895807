"""Error bars predicted by `check` from the scene alone, within a factor of four of those of runs.

Source: error bars of runs with BDF2 and P1-P0 at these steps per period, for their largest tensions and cone angle
(`run --accuracy 1%`, first rounds); the free motion by each scheme's recurrence.
"""

import math

import pytest

from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.check.accuracy import SPREAD
from dolfbuoy.scene.settings import period_of

#: Scene -> steps a period, and the bar in percent.
BARS = {
    "bridle": (40, 0.55),
    "chain-on-bed": (40, 1.38),
    "disc-buoy": (40, 19.48),
    "driven": (40, 1.58),
    "free-buoy": (40, 13.51),
    "jumper": (40, 0.3),
    "jumper-waves": (40, 0.58),
    "lazy-wave": (40, 0.25),
    "long": (40, 10.76),
    "navigation-buoy": (40, 10.1),
    "short": (80, 2.56),
    "spar": (40, 3.05),
    "storm": (40, 2.47),
    "three-legs": (40, 3.43),
    "two-buoys": (40, 3.65),
    "wave-rider": (40, 11.45),
}


def rows_of(scene):
    return {
        name: (value, remark) for name, value, _, remark in check(scene).numbers if name.startswith(("error", "time"))
    }


@pytest.mark.parametrize("name", BARS)
def test_bars_are_in_the_range_that_is_given(name):
    steps, bar = BARS[name]
    period = period_of(load_scene(name))
    found, _ = rows_of(load_scene(name, time={"scheme": "bdf2", "step": period / steps}))[
        "error bar to expect of largest values"
    ]
    assert found / SPREAD <= bar <= found * SPREAD


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2), ("generalized-alpha", 2)])
def test_the_order_is_that_of_the_scheme(scheme, order):
    """A quarter of the step is a quarter, or a sixteenth, of the bar; its size is that of the rate of a free motion."""
    found = [
        rows_of(load_scene("driven", time={"scheme": scheme, "step": h}))["error bar to expect of largest values"][0]
        for h in (0.04, 0.01)
    ]
    assert math.log(found[0] / found[1], 4) == pytest.approx(order, abs=0.02)
    theory = {"backward-euler": math.pi * 0.01 / 5, "bdf2": (2 * math.pi * 0.01 / 5) ** 2 / 3}
    if scheme in theory:
        assert found[1] == pytest.approx(100 * theory[scheme], rel=0.02)


def test_the_fastest_motion_of_a_buoy_counts():
    """The pitch of a disc buoy in 1.8 s, not its wave of 9 s; of a line alone the drive; else nothing."""
    assert "step against buoy pitch, 1.81 s" in rows_of("disc-buoy")["error bar to expect of largest values"][1]
    assert "step against drive, 5 s" in rows_of("driven")["error bar to expect of largest values"][1]
    assert "nodes land" in rows_of("chain-on-bed")["error bar to expect of largest values"][1]
    assert rows_of("towed-array") == {}
    adaptive = rows_of(load_scene("driven", time={"scheme": "bdf2", "step": 0.01, "tolerance": 1e-3}))
    assert list(adaptive) == ["time of a run with 1 %"]


def test_what_one_percent_costs():
    """Steps of sqrt(3 %)/omega and half and twice of it, 50 microseconds each for 20 elements of P2-P1, 70 with all."""
    seconds, remark = rows_of("driven")["time of a run with 1 %"]
    step = math.sqrt(0.03) * 5 / (2 * math.pi)
    assert seconds == pytest.approx(60 / step * (3e-5 + 40e-6))
    assert f"steps of {step / 2:.2g} to {2 * step:.2g} s" in remark
    longer, _ = rows_of(load_scene("driven", time__end=600.0))["time of a run with 1 %"]
    assert longer == pytest.approx(10 * seconds)
