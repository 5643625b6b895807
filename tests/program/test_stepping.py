"""Step size control: controllers alone, without integration, and adaptive runs.

Source: model errors given as functions of the step; a much finer run.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged, running
from scipy.interpolate import CubicSpline

from dolfbuoy.errors import SolveError
from dolfbuoy.motion.stepping import AdaptiveControl, StepControl


def march(control, ends, error=lambda t, h: 0.5, fails=lambda t, h: False, most=10000):
    """Steps (t at their end, size) that a control takes through these milestones."""
    t, taken = 0.0, []
    for end in ends:
        while end - t > 1e-12:
            assert len(taken) < most
            h = control.propose(end - t)
            assert 0 < h <= (end - t) * (1 + 1e-12), "past the milestone"
            if fails(t, h):
                control.fail(h, "no solution")
            elif control.judge(h, error(t, h)):
                t = end if abs(end - t - h) < 1e-12 else t + h
                taken.append((t, h))
    return np.array(taken)


# -- steps of a nominal size -------------------------------------------------------------------------------------------


def test_nominal_steps_and_milestones():
    """Every milestone is hit exactly; the steps between are nominal, and none is a sliver."""
    taken = march(StepControl(0.1), [0.1 * k for k in range(1, 31)], error=lambda t, h: None)
    assert len(taken) == 30
    np.testing.assert_allclose(taken[:, 1], 0.1, rtol=1e-9)
    taken = march(StepControl(0.1), [0.25, 1.0], error=lambda t, h: None)
    assert {0.25, 1.0} <= set(taken[:, 0])
    assert taken[:, 1].min() > 0.05 * (1 - 1e-9)


def test_a_failed_step_is_halved_and_grows_back():
    """Halved until it can be solved, doubled after every success, never above the nominal size."""
    control = StepControl(0.08)
    taken = march(control, [0.8], error=lambda t, h: None, fails=lambda t, h: t < 0.1 and h > 0.011)
    assert control.failed > 0
    assert taken[0, 1] == pytest.approx(0.01)
    growth = taken[1:, 1] / taken[:-1, 1]
    assert growth.max() <= 2 * (1 + 1e-12)
    assert taken[:, 1].max() == pytest.approx(0.08)
    assert control.step == control.nominal
    assert control.accepted == len(taken)


@pytest.mark.parametrize("halvings", [1, 2, 5, 12])
def test_no_sliver_is_left_before_the_next_milestone(halvings):
    """After failures steps double, over milestones too: a sliver, 2^-n of the full step after it, would upset BDF2."""
    control, left = StepControl(1.0, smallest=1e-9), [halvings]

    def fails(t, h):
        left[0] -= 1
        return left[0] >= 0

    taken = march(control, [1.0, 2.0, 3.0, 4.0], error=lambda t, h: None, fails=fails)
    assert taken[0, 1] == 2.0**-halvings
    assert (taken[1:, 1] / taken[:-1, 1]).max() <= 2 * (1 + 1e-12)
    assert control.step == 1.0


def test_the_smallest_step_is_the_end():
    """A step that fails at any size ends with the reason and the size."""
    control = StepControl(0.1, smallest=0.01)
    with pytest.raises(SolveError, match="no solution") as error:
        march(control, [1.0], fails=lambda t, h: True)
    assert "0.01" in str(error.value)
    assert control.failed == 4  # 0.1, 0.05, 0.025, 0.0125


# -- adaptive steps ----------------------------------------------------------------------------------------------------


def smooth(order, best):
    """Local error over the tolerance of steps whose best size is `best(t)`."""
    return lambda t, h: (h / best(t)) ** (order + 1)


@pytest.mark.parametrize("order", [1, 2])
def test_it_finds_the_step(order):
    """From far too small and far too large first steps to the size at which the error meets the tolerance."""
    for first in (1e-4, 5.0):
        control = AdaptiveControl(first, order, 1e-6, 10.0)
        taken = march(control, [20.0], smooth(order, lambda t: 0.05))
        later = taken[taken[:, 0] > 10.0, 1]
        assert later.min() > 0.6 * 0.05
        assert later.max() <= 0.05 * (1 + 1e-9)
        assert control.accepted == len(taken)
        assert (control.rejected > 0) == (first > 1)


def test_it_follows_what_happens():
    """A quiet time with long steps, a burst with short ones, each within the tolerance."""

    def best(t):
        return 0.01 if 4 < t < 5 else 0.2

    control = AdaptiveControl(0.1, 2, 1e-6, 10.0)
    taken = march(control, [10.0], smooth(2, best))
    start = taken[:, 0] - taken[:, 1]
    assert np.all(taken[:, 1] <= np.vectorize(best)(start) * (1 + 1e-9))
    assert control.rejected > 0
    assert np.median(taken[(start > 4.2) & (start < 4.8), 1]) > 0.006
    assert np.median(taken[start > 8, 1]) > 0.1


def test_growth_is_limited_and_held():
    """It grows by no more than `growth` at once, and keeps a step long enough for a past at one step size."""
    control = AdaptiveControl(1e-3, 2, 1e-6, 10.0)
    taken = march(control, [200.0], lambda t, h: 1e-12)
    ratio = taken[1:, 1] / taken[:-1, 1]
    assert ratio.max() <= control.growth * (1 + 1e-9)
    grown = np.flatnonzero(ratio > 1.05)
    assert len(grown) > 5
    assert np.diff(grown).min() >= control.hold
    assert taken[:, 1].max() == pytest.approx(control.largest)


def test_a_step_is_kept_while_the_best_differs_little():
    """Errors that waver by a fifth change nothing."""
    control = AdaptiveControl(0.05, 2, 1e-6, 10.0)
    taken = march(control, [10.0], lambda t, h: 0.5 + 0.1 * np.sin(40 * t))
    assert np.ptp(taken[:-4, 1]) == 0.0


def test_a_rejected_step_shrinks_in_limits():
    """By no more than a factor of five, and at least by a tenth."""
    control = AdaptiveControl(0.1, 2, 1e-6, 1.0)
    assert not control.judge(0.1, 1e12)
    assert control.step == pytest.approx(0.02)
    assert not control.judge(0.02, 1.0001)
    assert control.step < 0.9 * 0.02 * (1 + 1e-12)
    assert control.rejected == 2


def test_smallest_and_failed_adaptive_steps():
    """An error that no step can meet, and a step that cannot be solved, end the run; one of them does not."""
    with pytest.raises(SolveError, match="times the tolerance"):
        march(AdaptiveControl(0.1, 2, 0.01, 1.0), [1.0], lambda t, h: 100.0)
    with pytest.raises(SolveError, match="no solution"):
        march(AdaptiveControl(0.1, 2, 0.01, 1.0), [1.0], fails=lambda t, h: True)
    control = AdaptiveControl(0.1, 2, 1e-4, 1.0)
    taken = march(control, [2.0], smooth(2, lambda t: 0.1), fails=lambda t, h: 0.5 < t < 0.6 and h > 0.02)
    assert control.failed > 0
    assert taken[-1, 1] > 0.05


def test_adaptive_milestones():
    """Output times are met exactly, and the steps before one are alike rather than a long one and a sliver."""
    ends = [0.37 * k for k in range(1, 20)]
    taken = march(AdaptiveControl(0.05, 2, 1e-6, 10.0), ends, smooth(2, lambda t: 0.11))
    assert set(ends) <= set(taken[:, 0])
    assert taken[5:, 1].min() > 0.4 * 0.11


def test_without_an_estimate_a_step_counts():
    """The first steps have no past to be judged by."""
    control = AdaptiveControl(0.05, 2, 1e-6, 10.0)
    assert control.judge(0.05, None)
    assert (control.accepted, control.step) == (1, 0.05)


# -- adaptive runs -----------------------------------------------------------------------------------------------------

DRIVEN = {
    "sea": {"depth": 20.0},
    "cable": {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "elements": 4, "normal_drag": 0.8},
    "time": {"end": 6.0, "step": 0.01},
}
DRIVEN["cable"]["top"] = {"kind": "prescribed", "position": [12.0, 0.0, -3.5], "amplitude": [0.0, 0.0, 1.0]}
DRIVEN["cable"]["top"] |= {"period": 5.0, "ramp": 0.5}
RODS = {
    "cable": {"length": 1.0, "line_density": 1.0, "elements": 2, "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0, 0, 0], [0.3, 0.0, -0.4], [0.3, 0.0, -0.9]]},
    "time": {"end": 1.0, "step": 0.001},
}
WAVES = merged(
    MOORED,
    cable__axial_stiffness=None,
    cable__elements=4,
    waves__ramp=2.0,
    time={"end": 6.0, "step": 0.01},
)


CALM = merged(WAVES, waves=None, buoy__rotational_damping=2000.0, time={"end": 20.0, "step": 0.01})
#: Kicked: it swings out and comes to rest.
KICKED = merged(CALM, initial={"buoy_velocity": [0.5, 0.3, -1.0]})
#: Waves that grow over the whole run.
GROWING = merged(WAVES, waves__ramp=20.0, time={"end": 20.0, "step": 0.01})


def history(scene):
    """(times, positions and velocities over their typical sizes, Newton iterations of all steps, rejected ones too)."""
    times, rows = [], []
    with running(scene) as simulation:

        def look():
            u, cable, buoy = simulation.system.u, simulation.problem.lines, simulation.problem.buoy
            L, nodes = scene["cable"]["length"], cable.node_dofs
            parts = [u[nodes].ravel() / L, simulation.past.series[0].rate[nodes].ravel() / np.sqrt(9.81 * L)]
            parts += [u[simulation.problem.buoy.part.slice] / buoy.state_sizes] if buoy else []
            times.append(simulation.t)
            rows.append(np.concatenate(parts))

        look()
        before = simulation.newton.iterations_total
        for _ in simulation.run():
            look()
        return np.array(times), np.array(rows), simulation.newton.iterations_total - before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "share"),
    [(KICKED, 0.9), (GROWING, 0.9), (DRIVEN, 0.9), (RODS, 1.1), (WAVES, 1.1)],
    ids=["kicked buoy", "growing waves", "driven fast", "rods", "regular waves"],
)
def test_adaptive_runs_meet_their_tolerance(scene, share):
    """The error of the whole run is the tolerance within a factor of five, in `share` of the Newton iterations that
    equal steps of the same error take.

    Where there is little to adapt to (regular waves, rods that swing on) it only must not cost a tenth more.
    """
    end, tolerance = scene["time"]["end"], 0.01
    times, rows, _ = history(merged(scene, time={"end": end, "step": end / 4000, "scheme": "bdf2"}))
    fine = CubicSpline(times, rows)

    def error_and_cost(**time):
        times, rows, iterations = history(merged(scene, time={"end": end, "scheme": "bdf2", **time}))
        return np.abs(rows - fine(times)).max(), iterations

    error, cost = error_and_cost(step=end / 2000, tolerance=tolerance, output_every=end)
    assert tolerance / 5 < error < 5 * tolerance
    coarse, _ = error_and_cost(step=end / 400)
    equal, equal_cost = error_and_cost(step=end / round(400 * np.sqrt(coarse / error)))
    assert error / 1.5 < equal < 1.5 * error
    measured = cost / (equal_cost * np.sqrt(equal / error))
    print(f"{measured:.2f} of the Newton iterations of equal steps")
    assert measured < share
