"""A published cable test: Lowe and Langley 2006, a hanging jumper without sea bed, top tension in kN.

Their water is linear wave theory without stretching.  The runs start at rest in the middle of a motion (the top's
velocity and the wave are there from t = 0 on), so that the comparison begins when that transient is over; the
published curves are periodic by then.

Source: Lowe and Langley 2006 as digitised (tests/reference).
"""

import alone
import numpy as np
import pytest
from dynamics_helpers import merged
from helpers import REFERENCE

from dolfbuoy.sensitivity import calibrate

JUMPER = {
    "gravity": 9.807,
    "sea": {"depth": 1000.0, "density": 1000.0},
    "cable": {
        "length": 170.0,
        "line_density": 165.0,
        "diameter": 0.396,
        "axial_stiffness": 5e8,
        "elements": 20,
        "position_degree": 2,
        "tension_degree": 1,
        "added_mass": 1.0,
        "normal_drag": 1.0,
        "anchor": [-100.0, 0.0, -55.0],
        "top": {"kind": "fixed", "position": [0.0, 0.0, -5.0]},
    },
}
TOP_MOVES = merged(
    JUMPER,
    cable__top={"kind": "prescribed", "position": [0.0, 0.0, -5.0], "amplitude": [10.0, 0.0, 0.0], "period": 27.0},
    time={"end": 80.0, "step": 0.1},
)
IN_WAVES = merged(
    JUMPER,
    waves={"amplitude": 5.0, "period": 10.0, "phase_deg": 230.0, "stretching": "none"},
    time={"end": 40.0, "step": 0.05},
)


def difference(run, case, start, shift=0.0):
    """Computed minus published top tension [kN] at the published instants after `start`."""
    time, tension = np.loadtxt(REFERENCE / f"case{case}.csv", delimiter=",").T
    time = time + shift
    seen = (time >= start) & (time <= float(run.time[-1]))
    assert seen.sum() > 0.9 * np.sum(time >= start)
    published = tension[seen]
    return np.interp(time[seen], run.time.values, run.tension_top.values / 1e3) - published, published


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def test_top_moves_in_still_water():
    """Case 1: within 0.5 kN rms; the signal itself has 3.3."""
    error, published = difference(alone.simulate(TOP_MOVES), 1, start=10.0)
    assert rms(error) < 0.5
    assert abs(error.mean()) < 0.15
    assert rms(published - published.mean()) > 5 * 0.5


def test_fixed_ends_in_waves():
    """Case 4: within 0.8 kN rms of a signal of 3.5, and only with the tangential Froude-Krylov force."""
    error, published = difference(alone.simulate(IN_WAVES), 4, start=10.0, shift=10.0)
    assert rms(error) < 0.8
    assert rms(published - published.mean()) > 3 * 0.8
    without = alone.simulate(IN_WAVES, cable__tangential_froude_krylov=False)
    assert rms(difference(without, 4, start=10.0, shift=10.0)[0]) > 3.0


@pytest.mark.slow
def test_refined_jumper_stays_with_the_measurement():
    """Backward Euler at a quarter of the step changes little: the agreement is not due to its damping."""
    error, _ = difference(alone.simulate(TOP_MOVES, time__step=0.025), 1, start=10.0)
    assert rms(error) < 0.5
    error, _ = difference(alone.simulate(IN_WAVES, time__step=0.0125), 4, start=10.0, shift=10.0)
    assert rms(error) < 0.8


@pytest.mark.slow
def test_drag_and_stiffness_found_from_the_measurement(tmp_path):
    """Case 1, `jumper`: its tension is that of a coefficient of 0.95 and of a cable that stretches; with the stiffness
    of the paper, 500 MN, which the tension hardly feels, of 0.99."""
    time, tension = np.loadtxt(REFERENCE / "case1.csv", delimiter=",").T
    rows = "\n".join(f"{t + 27},{1e3 * T}" for t, T in zip(time, tension, strict=True))
    (tmp_path / "case1.csv").write_text(f"time,tension_top\n{rows}\n")
    drag, stiffness = {"cable.normal_drag": (0.3, 3.0)}, {"cable.axial_stiffness": (5e6, 5e9)}
    one = calibrate("jumper", tmp_path / "case1.csv", drag, offset=(-1.0, 1.0), **{"time.step": 0.1}).dataset
    both = calibrate(
        "jumper", tmp_path / "case1.csv", drag | stiffness, offset=(-1.0, 1.0), **{"time.step": 0.1}
    ).dataset
    assert one.estimate.values == pytest.approx([0.989, -0.131], abs=0.01)
    assert both.estimate.values == pytest.approx([0.949, 8.6e6, -0.153], rel=0.05)
    assert both.deviation.values == pytest.approx([0.004, 2.8e5, 0.003], rel=0.1)
    assert both.attrs["residual"] < 0.75 * one.attrs["residual"] < 0.03
    assert max(one.attrs["runs"], both.attrs["runs"]) <= 12
