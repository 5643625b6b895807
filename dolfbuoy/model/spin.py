"""The angular momentum about a buoy's axis, which time schemes follow as a quantity of its own."""

import numpy as np
from dolfinx import fem

from ..forms import buoy as body
from .evolution import Evolution
from .rigid import rotation_of


class Spin:
    """L_C . d of a buoy: no unknown, but a series of values with a rate gamma x value + history."""

    def __init__(self, buoy):
        self.buoy = buoy
        self.gamma, self.history, self.followed = (fem.Constant(buoy.mesh, 0.0) for _ in range(3))

    def defect(self, y, rates, inertia):
        """`forms.buoy.spin_defect`, once a scheme has handed out its rule."""
        rate = self.gamma * body.spin(y.orientation, y.angular_momentum) + self.history
        q4, L_C = y.orientation, y.angular_momentum
        return self.followed * body.spin_defect(q4, L_C, rates.angular_momentum, rate, inertia)

    def value(self, u) -> np.ndarray:
        """L_C . d of local unknowns [N m s], an array of one."""
        y = self.buoy.fields.of(u[self.buoy.part.slice])
        return np.array([y.angular_momentum @ rotation_of(y.orientation)[:, 2]])

    def evolution(self) -> Evolution:
        """Of first order; its local error does not count."""
        return SpinEvolution(self.buoy.part, [(self.gamma, self.history)], True, [np.array([np.inf])], self)


class SpinEvolution(Evolution):
    """Evolution of a value that is made of unknowns."""

    def __init__(self, part, rates, lagged, sizes, spin):
        super().__init__(part, rates, lagged, sizes)
        self.spin = spin

    def values(self, u):
        return self.spin.value(u)

    def hand_out(self, level, gamma, history):
        constant, past = self.rates[level]
        constant.value, past.value = gamma, np.asarray(history).item()
        self.spin.followed.value = 1.0
