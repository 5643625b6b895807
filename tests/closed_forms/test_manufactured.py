"""A manufactured cable motion in closed form: temporal orders of r, v and T, elastic and inextensible.

The cable bends into arcs of changing curvature and turns meanwhile; a force that is added to the residual makes this an
exact solution:

    r' = (1 + e) t,  t = (sin a, -cos a),  a = phi(t) + kappa(t) s,  T = T0(t) (L - s),  e = T/EA,  L = 1.

`Motion` writes it once for both UFL (which differentiates it for the force) and numpy (which judges the result).

Source: the motion itself, written once for ufl and numpy.
"""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dynamics_helpers import rates, running

from dolfbuoy.model.lines import Lines
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion.schemes import Predictor
from dolfbuoy.solver.unknowns import array_of
from dolfbuoy.solver.vector_ops import copies

DENSITY = 1.3
AXES = np.linalg.qr(np.array([[1.0, 2.0, 2.0], [0.3, -1.0, 0.5]]).T)[0].T  # a plane at random
END = 0.8


class Motion:
    """r and T at arc lengths s and time t with the functions of a library (numpy or ufl)."""

    def __init__(self, library, EA):
        self.sin, self.cos, self.EA = library.sin, library.cos, EA

    def tension(self, s, t):
        return (3 + self.sin(2 * t)) * (1 - s)

    def position(self, s, t):
        """(x, y) in the plane of the motion: the integral of (1 + c (1 - s)) t, c = T0/EA, in closed form."""
        phi, kappa = 0.4 + 0.8 * self.sin(1.5 * t), 1.2 + 0.4 * self.cos(2 * t + 0.3)
        c = 0 if np.isinf(self.EA) else (3 + self.sin(2 * t)) / self.EA

        def primitive(s):
            a, stretch = phi + kappa * s, 1 + c * (1 - s)
            x = -stretch * self.cos(a) / kappa - c * self.sin(a) / kappa**2
            y = -stretch * self.sin(a) / kappa + c * self.cos(a) / kappa**2
            return x, y

        (x1, y1), (x0, y0) = primitive(s), primitive(0 * s)
        return x1 - x0, y1 - y0


def in_space(x, y):
    """Points of the plane, (n, 3)."""
    return np.multiply.outer(x, AXES[0]) + np.multiply.outer(y, AXES[1])


def history(motion, s, degree=16, span=0.3):
    """r and its first three derivatives at t = 0, from Chebyshev polynomials in time."""
    nodes = span * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    values = np.array([in_space(*motion.position(s, t)) for t in nodes])
    coefficients = np.polynomial.chebyshev.chebfit(nodes / span, values.reshape(len(nodes), -1), degree)
    derivatives = []
    for k in range(4):
        at_zero = np.polynomial.chebyshev.chebval(0.0, coefficients) / span**k
        derivatives.append(at_zero.reshape(values.shape[1:]))
        coefficients = np.polynomial.chebyshev.chebder(coefficients)
    return derivatives


@pytest.fixture
def forced(monkeypatch):
    """forced(EA): from now on every cable in motion feels the force of the manufactured solution."""
    plain_residual, plain_clock = Lines.residual, Problem.clock

    def force(EA):
        def residual(self, test):
            F = plain_residual(self, test)
            if not self.dynamic:
                return F
            self.now = fem.Constant(self.mesh, 0.0)
            t, s = ufl.variable(self.now), ufl.SpatialCoordinate(self.mesh)[0]
            motion = Motion(ufl, EA)
            plane = motion.position(s, t)
            r = ufl.as_vector([plane[0] * AXES[0, i] + plane[1] * AXES[1, i] for i in range(3)])
            r_tt = ufl.diff(ufl.diff(r, t), t)
            T = motion.tension(s, t)
            stretch = 1 if np.isinf(EA) else 1 + T / EA
            f = DENSITY * r_tt - (T / stretch * r.dx(0)).dx(0)
            return F - ufl.inner(f, ufl.split(test)[0]) * self.dx

        def clock(self):
            return [*plain_clock(self), copies([(array_of(self.lines.now), self.time)])]

        monkeypatch.setattr(Lines, "residual", residual)
        monkeypatch.setattr(Problem, "clock", clock)

    return force


def start(simulation, motion):
    """From the motion at t = 0, with the acceleration and jerk that belong to it."""
    u, cable = simulation.system.u, simulation.problem.lines
    r, *derivatives = history(motion, cable.node_s)
    cable.set_shape(u, lambda _: r, lambda s: motion.tension(s, 0.0))
    rate, acceleration, jerk = (np.zeros_like(u) for _ in range(3))
    for array, values in zip((rate, acceleration, jerk), derivatives, strict=True):
        array[cable.node_dofs] = values
    simulation.past.begin([rate, acceleration])
    simulation.past.series[0].second, simulation.past.series[1].second = acceleration, jerk
    simulation.predictor = Predictor()
    simulation.predictor.add(0.0, u)


def errors(scheme, EA, count):
    """Largest errors of r, v and T at the nodes at END after so many steps."""
    cable = {"length": 1.0, "line_density": DENSITY, "elements": 8, "position_degree": 4, "tension_degree": 3}
    cable |= {"top": {"kind": "free"}} | ({} if np.isinf(EA) else {"axial_stiffness": EA})
    points = {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [0.6, 0.0, -0.8]]}
    time = {"end": END, "step": END / count, "scheme": scheme}
    motion = Motion(np, EA)
    with running({"gravity": 0.0, "cable": cable, "initial": points, "time": time}) as simulation:
        start(simulation, motion)
        for _ in range(count):
            simulation.step(END / count)
        c, u = simulation.problem.lines, simulation.system.u
        r, v = u[c.node_dofs], simulation.past.series[0].rate[c.node_dofs]
        T = u[c.T_dofs]
    tiny = 1e-30
    velocity = in_space(*(x.imag / tiny for x in motion.position(c.node_s, END + 1j * tiny)))
    exact = (in_space(*motion.position(c.node_s, END)), velocity, motion.tension(c.T_s, END))
    return [np.abs(found - right).max() for found, right in zip((r, v, T), exact, strict=True)]


def test_the_motion_is_a_solution():
    """Its slope has the length 1 + e, and its rates are those that Chebyshev polynomials tell."""
    for EA in (np.inf, 10.0):
        motion, s, tiny = Motion(np, EA), np.linspace(0, 1, 7), 1e-30
        slope = in_space(*(x.imag / tiny for x in motion.position(s + 1j * tiny, 0.5)))
        stretch = 1 + motion.tension(s, 0.5) / EA
        assert np.linalg.norm(slope, axis=1) == pytest.approx(stretch, rel=1e-13)
        rate = in_space(*(x.imag / tiny for x in motion.position(s, 1j * tiny)))
        np.testing.assert_allclose(history(motion, s)[1], rate, atol=1e-11)


@pytest.mark.parametrize("EA", [np.inf, 10.0], ids=["inextensible", "elastic"])
@pytest.mark.parametrize(
    ("scheme", "order", "first"), [("backward-euler", 1, 40), ("bdf2", 2, 40), ("generalized-alpha", 2, 60)]
)
def test_order_of_a_manufactured_motion(scheme, order, first, EA, forced):
    forced(EA)
    table = np.array([errors(scheme, EA, count) for count in (first, 2 * first, 4 * first)])
    found = np.array([rates(column) for column in table.T])
    assert np.all((found > order - 0.2) & (found < order + 0.35)), f"orders {found} of errors {table}"
