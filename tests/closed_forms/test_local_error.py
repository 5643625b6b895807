"""Local error estimates in a circular motion, and BDF2 behind a kink.

Source: the leading error of each scheme's rate in closed form (Taylor), derivatives of a circle.
"""

import numpy as np
import pytest
from dynamics_helpers import running
from in_numpy import accept, rule

from dolfbuoy.motion.schemes import BDF2, Series
from dolfbuoy.results.observe import Observer

BODY, ROD, TOLERANCE = 2.0, 1.0, 1e-3  # kg, kg/m of the rod
#: Order p, and C of the local error C h^(p+1) y^(p+1).
CONSTANTS = {"backward-euler": (1, 1 / 2), "bdf2": (2, 2 / 9), "generalized-alpha": (2, 1 / 6)}


def circle(scheme, length=1.0, speed=0.5):
    """A body at the end of a rigid rod, thrown across it: both turn at constant speed."""
    return {
        "gravity": 0.0,
        "cable": {"length": length, "line_density": ROD, "elements": 1},
        "buoy": {"mass": BODY, "center_of_mass": 0.0, "inertia": [1.0, 1.0]},
        "initial": {"kind": "straight", "buoy_position": [length, 0.0, 0.0], "buoy_velocity": [0.0, speed, 0.0]},
        "time": {"end": 10.0, "step": 0.01, "scheme": scheme, "tolerance": TOLERANCE},
    }


def estimates(scene, h, steps):
    """(angle that was turned, estimated error over the tolerance) after each step that has a past to be judged by."""
    found = []
    with running(scene) as simulation:
        observer = Observer(simulation.problem)
        for _ in range(steps):
            assert simulation.step(h, lambda _, error: found.append(error) or True) is not None
            x, y, _ = observer.values(simulation.end_forces)["buoy_position"][0]
            found[-1] = (np.arctan2(y, x), found[-1])
    return np.array([pair for pair in found if pair[1] is not None])


def expected(scheme, h, angle, omega, length):
    """Milne's estimate over what is allowed, of the largest component of positions and velocities.

    A smooth solution differs by h^(p+1) y^(p+1) from the extrapolation of its own past, of which C/(1 + C) is taken.
    On the cable lengths count over L and velocities over sqrt(g L), on a body without a hull over 1 m and sqrt(g 1 m),
    with 1 m/s^2 where there is no gravity.  Errors that add up to the tolerance over a run are smaller,
    (tolerance/2.5)^((p+1)/p): 2.5 is measured.
    """
    order, constant = CONSTANTS[scheme]
    place = length * omega ** (order + 1) * np.abs([np.cos(angle), np.sin(angle)])
    velocity = omega * place[::-1]
    if order == 2:  # a derivative more turns it by a quarter more
        place, velocity = place[::-1], velocity[::-1]
    largest = max(*place / length, *velocity / np.sqrt(length), *place, *velocity)
    return constant / (1 + constant) * h ** (order + 1) * largest / (TOLERANCE / 2.5) ** ((order + 1) / order)


@pytest.mark.parametrize(
    ("length", "speed"), [(0.25, 0.1), (0.25, 1.0), (4.0, 1.0)], ids=["place on cable", "velocity on cable", "body"]
)
@pytest.mark.parametrize("scheme", CONSTANTS)
def test_size_of_the_local_error(scheme, length, speed):
    """Within some per cent for a step that turns by little."""
    omega = speed * BODY / (BODY + ROD * length / 3) / length
    h = 0.01 / omega
    late = estimates(circle(scheme, length, speed), h, 40)[-15:]
    right = np.array([expected(scheme, h, angle, omega, length) for angle, _ in late])
    assert late[:, 1] == pytest.approx(right, rel=0.05)


def test_no_estimate_without_a_past():
    assert len(estimates(circle("bdf2"), 0.02, 5)) == 3


@pytest.mark.parametrize("factor", [0.5, 0.1])
def test_bdf2_behind_a_kink(factor):
    """When the step shrinks, the velocities of the past are those of the positions as they are told now.

    After a kink, r = max(0, t), the two would else differ by what no smaller step removes.
    """
    scheme, h = BDF2(), 0.1
    r, v = Series(np.zeros(1), np.zeros(1)), Series(np.zeros(1), np.zeros(1), lagged=True)
    for n in range(-6, 3):
        for series, base in ((r, None), (v, r)):
            scheme.begin(h, series, base)
        (gamma, h_r), (_, h_v) = (rule(scheme, h, series) for series in (r, v))
        value = np.array([max(0.0, n * h)])
        rate = gamma * value + h_r
        accept(scheme, r, value, rate)
        accept(scheme, v, rate, gamma * rate + h_v)
    new = factor * h
    scheme.begin(new, r)
    scheme.begin(new, v, r)
    t = -new * np.arange(len(r.values))
    for j, told in enumerate(v.values):
        slope = np.polyder(np.polyfit(t[j : j + 3], np.ravel(r.values[j : j + 3]), 2))  # of the parabola through three
        assert told[0] == pytest.approx(np.polyval(slope, t[j]), abs=1e-9)
    assert len(v.values) >= 2
    assert abs(v.values[0][0] - 1) > 0.01  # the kink is felt


def test_sizes_of_a_buoys_numbers():
    """Errors of r_C count over the height of the hull, of p over M sqrt(g h), of L_C over I sqrt(g h)/h."""
    height, mass = 1.6, 700.0
    scene = {
        "gravity": 9.0,
        "sea": {"depth": 30.0},
        "buoy": {"hull": [[0.0, 2.0], [height, 2.0]], "mass": mass, "center_of_mass": 0.5, "inertia": [300.0, 200.0]},
        "time": {"end": 1.0, "step": 0.01},
    }
    with running(scene) as simulation:
        found = simulation.problem.buoy.state_sizes
    speed = np.sqrt(9.0 * height)
    assert found == pytest.approx(np.repeat([height, mass * speed, 1.0, 300.0 * speed / height], [3, 3, 4, 3]))
