"""Time schemes: the rate of a quantity at t_(n+1), affine in its unknown value there.

    y_t = gamma y + history

Velocity and acceleration of the cable are the same rule applied twice, v = gamma r + h_r and
a = gamma v + h_v = gamma^2 r + gamma h_r + h_v, so that v is eliminated and one compiled form serves every scheme.
Constraints hold at t_(n+1).
"""

import numpy as np


class Series:
    """Past values of one array-valued quantity, newest first, and its rate at the newest time."""

    def __init__(self, value, rate):
        self.values = [np.array(value)]
        self.rate = np.array(rate)

    def push(self, value, rate, keep):
        self.values = [np.array(value), *self.values[: keep - 1]]
        self.rate = np.array(rate)


class BackwardEuler:
    """y_t = (y - y_n)/dt: order 1, the scheme of the paper (30)."""

    name = "backward-euler"
    order = 1
    keep = 1  # past values that the rule needs

    def rule(self, step, series):
        """(gamma, history) of the rate of a Series for the coming step."""
        return 1 / step, -series.values[0] / step


SCHEMES = {"backward-euler": BackwardEuler}


class Predictor:
    """Start of Newton: the polynomial through the last `points` solutions, extrapolated."""

    def __init__(self, points=3):
        self.points, self.times, self.values = points, [], []

    def add(self, t, value):
        self.times = [t, *self.times[: self.points - 1]]
        self.values = [value.copy(), *self.values[: self.points - 1]]

    def at(self, t):
        """Value extrapolated to t."""
        weights = [
            np.prod([(t - tj) / (ti - tj) for tj in self.times if tj != ti]) if len(self.times) > 1 else 1.0
            for ti in self.times
        ]
        return sum(w * v for w, v in zip(weights, self.values, strict=True))
