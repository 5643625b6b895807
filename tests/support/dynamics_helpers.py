"""Shared by the dynamic tests: scenes, and an independent cable and sea in plain numpy.

The numpy code is written from the equations in the project's documentation, not from the package: it is dense, slow
and short.
"""

from contextlib import contextmanager

import numpy as np
from alone import simulate

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.scene import merged as merged  # for the tests that import it from here

MOORED = {
    "sea": {"depth": 20.0},
    "cable": {
        "length": 22.0,
        "line_density": 27.6,
        "diameter": 0.08,
        "axial_stiffness": 2.3e8,
        "elements": 20,
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "tangential_drag": 0.1,
    },
    "buoy": {
        "hull": [[0.0, 2.4], [1.2, 2.4]],
        "mass": 400.0,
        "center_of_mass": 0.5,
        "inertia": [192.0, 288.0],
        "point_masses": [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 3.0}],
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "axial_drag": 1.0,
        "rotational_damping": 100.0,
    },
    "current": {"speed": 0.5},
    "external_force": {"force": [500.0, 0.0, 0.0]},
    "waves": {"amplitude": 0.8, "period": 5.0, "ramp": 5.0},
    "time": {"end": 2.0, "step": 0.01},
}
#: A sinker on a slope, dragged by a rope whose upper end moves.
DRAGGED = {
    "sea": {"depth": 20.0},
    "seabed": {"friction": 0.3, "slope": [0.0, 0.1]},
    "anchor": {"weight": 2e3, "friction": 0.5, "density": 2000.0, "drags": True},
    "cable": {
        "length": 13.0,
        "elements": 4,
        "diameter": 0.02,
        "line_density": 1.0,
        "axial_stiffness": 1e5,
        "damping": 1e3,
        "top": {
            "kind": "prescribed",
            "position": [8.0, 2.0, -10.0],
            "amplitude": [1.5, 0.5, 0.5],
            "period": 1.5,
            "ramp": 0.1,
        },
    },
    "time": {"end": 0.4, "step": 0.01, "scheme": "bdf2"},
}


def simulate_evenly(scene):
    """Record of a run in which no step failed or was halved."""
    run = simulate(scene)
    assert run.attrs["failed_steps"] == 0
    np.testing.assert_allclose(run.time_step[1:], scene["time"]["step"], rtol=1e-6)
    return run


@contextmanager
def running(scene):
    """A Simulation of a scene given as a dict."""
    simulation = Simulation(load_scene(scene))
    try:
        yield simulation
    finally:
        simulation.problem.destroy()


def rates(errors, factor=2.0):
    """Observed order of each consecutive pair of errors when the step is divided by `factor`."""
    errors = np.asarray(errors, dtype=float)
    return np.log(errors[:-1] / errors[1:]) / np.log(factor)


def rotation_matrix(q4):
    """Body to world, from the paper's formula in angle and axis."""
    q4 = np.asarray(q4) / np.linalg.norm(q4)
    sine = np.linalg.norm(q4[1:])
    if sine == 0:
        return np.eye(3)
    beta, axis = 2 * np.arctan2(sine, q4[0]), q4[1:] / sine
    S = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.cos(beta) * np.eye(3) + (1 - np.cos(beta)) * np.outer(axis, axis) + np.sin(beta) * S


def quaternion_product(a, b):
    """a o b."""
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


# -- one-dimensional finite elements -----------------------------------------------------------------------------------


def lagrange(degree, xi):
    """Values and derivatives at xi in [0, 1] of the Lagrange basis on equidistant points, one row per point of xi."""
    powers = np.arange(degree + 1)
    points = np.linspace(0.0, 1.0, degree + 1)
    coefficients = np.linalg.inv(points[:, None] ** powers)
    xi = np.atleast_1d(xi)[:, None]
    derivative = np.where(powers > 0, powers * xi ** np.maximum(powers - 1, 0), 0.0)
    return xi**powers @ coefficients, derivative @ coefficients


def gauss(points):
    """Gauss rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, w / 2


def string_matrices(degree, breaks, tension):
    """(M, K) of y_tt - (tension(s) y')' per unit density, continuous elements of `degree`, no end conditions."""
    cells = len(breaks) - 1
    xi, weights = gauss(degree + 2)
    N, dN = lagrange(degree, xi)
    M = np.zeros((cells * degree + 1,) * 2)
    K = np.zeros_like(M)
    for e in range(cells):
        h = breaks[e + 1] - breaks[e]
        i = slice(e * degree, (e + 1) * degree + 1)
        M[i, i] += h * N.T @ np.diag(weights) @ N
        K[i, i] += dN.T @ np.diag(weights * tension(breaks[e] + h * xi)) @ dN / h
    return M, K


# -- a P1-P0 cable with backward Euler, dense --------------------------------------------------------------------------


class NumpyCable:
    """Eq. (11) with piecewise linear r and piecewise constant T in a constant field of force per unstretched length.

    fixed: indices of the nodes whose positions are given.  EA = inf is inextensible.
    """

    def __init__(self, breaks, density, EA, weight, fixed, end_force=(0.0, 0.0, 0.0)):
        self.h, self.EA, self.n = np.diff(breaks), EA, len(breaks)
        self.M = density * string_matrices(1, breaks, np.ones_like)[0]
        lumped = string_matrices(1, breaks, np.ones_like)[0].sum(axis=1)
        self.load = lumped[:, None] * np.asarray(weight)
        self.load[-1] += end_force
        self.free = np.setdiff1d(np.arange(self.n), fixed)
        self.fixed = np.asarray(fixed)

    def residual(self, r, T, a):
        """Momentum at every node, and the strain equation on every element."""
        e = T / self.EA
        tau = np.diff(r, axis=0) / self.h[:, None]
        pull = (T / (1 + e))[:, None] * tau
        momentum = self.M @ a - self.load
        momentum[1:] += pull
        momentum[:-1] -= pull
        return momentum, 0.5 * self.h * ((tau**2).sum(axis=1) / (1 + e) - (1 + e))

    def jacobian(self, r, T, gamma_a):
        n, m = 3 * self.n, len(self.h)
        e = T / self.EA
        tau = np.diff(r, axis=0) / self.h[:, None]
        J = np.zeros((n + m, n + m))
        J[:n, :n] = np.kron(gamma_a * self.M, np.eye(3))
        for k, h in enumerate(self.h):
            i, j = slice(3 * k, 3 * k + 3), slice(3 * k + 3, 3 * k + 6)
            stiff = T[k] / (1 + e[k]) / h * np.eye(3)
            J[i, i] += stiff
            J[j, j] += stiff
            J[i, j] -= stiff
            J[j, i] -= stiff
            J[j, n + k] += tau[k] / (1 + e[k]) ** 2
            J[i, n + k] -= tau[k] / (1 + e[k]) ** 2
            J[n + k, j] += tau[k] / (1 + e[k])
            J[n + k, i] -= tau[k] / (1 + e[k])
            J[n + k, n + k] -= 0.5 * h / self.EA * (tau[k] @ tau[k] / (1 + e[k]) ** 2 + 1)
        return J

    def step(self, r0, r1, T, dt, ends=None):
        """(r2, T2) from r0, r1 at equal steps; `ends` are the new positions of the fixed nodes."""
        r, T, n = 2 * r1 - r0, T.copy(), 3 * self.n
        if ends is not None:
            r[self.fixed] = ends
        else:
            r[self.fixed] = r1[self.fixed]
        rows = np.concatenate([np.arange(n).reshape(-1, 3)[self.free].ravel(), np.arange(n, n + len(T))])
        for _ in range(30):
            momentum, strain = self.residual(r, T, (r - 2 * r1 + r0) / dt**2)
            b = np.concatenate([momentum.ravel(), strain])[rows]
            x = np.linalg.solve(self.jacobian(r, T, dt**-2)[np.ix_(rows, rows)], -b)
            change = np.zeros(n + len(T))
            change[rows] = x
            r += change[:n].reshape(-1, 3)
            T += change[n:]
            if np.abs(change[:n]).max() < 1e-14 * np.abs(r).max():
                return r, T
        return r, T


# -- sea and loads, pointwise ------------------------------------------------------------------------------------------


class NumpySea:
    """A uniform current and an Airy wave in finite depth with Wheeler stretching."""

    def __init__(self, scene):
        self.depth, self.density = scene["sea"]["depth"], scene["sea"].get("density", 1025.0)
        self.gravity = scene.get("gravity", 9.81)
        self.wave, current = scene.get("waves"), scene.get("current")
        angle = np.radians(current.get("direction_deg", 0.0)) if current else 0.0
        self.current = (current["speed"] if current else 0.0) * np.array([np.cos(angle), np.sin(angle), 0.0])
        if self.wave:
            self.omega, k = 2 * np.pi / self.wave["period"], 1.0
            for _ in range(200):  # Newton on omega^2 = g k tanh(k h)
                th = np.tanh(k * self.depth)
                slope = self.gravity * (th + k * self.depth * (1 - th**2))
                k -= (self.gravity * k * th - self.omega**2) / slope
            self.k = k
            heading = np.radians(self.wave.get("direction_deg", 0.0))
            self.direction = np.array([np.cos(heading), np.sin(heading), 0.0])

    def at(self, x, t):
        """(elevation, velocity, acceleration of the wave) at points x (n, 3)."""
        if not self.wave:
            return np.zeros(len(x)), np.tile(self.current, (len(x), 1)), np.zeros((len(x), 3))
        eta = self._elevation(x, t)
        velocity, acceleration = self._linear(self._stretched(x, eta), t)
        return eta, velocity + self.current, acceleration

    def _theta(self, x, t):
        return self.k * x @ self.direction - self.omega * t + np.radians(self.wave.get("phase_deg", 0.0))

    def _amplitude(self, t):
        ramp = self.wave.get("ramp", 0.0)
        return self.wave["amplitude"] * (0.5 * (1 - np.cos(np.pi * t / ramp)) if t < ramp else 1.0)

    def _elevation(self, x, t):
        return self._amplitude(t) * np.cos(self._theta(x, t))

    def _stretched(self, x, eta):
        """The points at the heights where linear theory is evaluated."""
        z = np.minimum(self.depth * (x[:, 2] - eta) / (self.depth + eta), 0.0)
        return np.column_stack([x[:, :2], z])

    def _linear(self, x, t):
        """Velocity and acceleration in linear theory."""
        k, om, h, theta, up = self.k, self.omega, self.depth, self._theta(x, t), np.array([0.0, 0.0, 1.0])
        C, S = np.cosh(k * (x[:, 2] + h)) / np.sinh(k * h), np.sinh(k * (x[:, 2] + h)) / np.sinh(k * h)
        velocity = om * ((C * np.cos(theta))[:, None] * self.direction + (S * np.sin(theta))[:, None] * up)
        acceleration = om**2 * ((C * np.sin(theta))[:, None] * self.direction - (S * np.cos(theta))[:, None] * up)
        return self._amplitude(t) * velocity, self._amplitude(t) * acceleration

    def slope(self, x, t):
        """Gradient of the elevation, by finite differences."""
        if not self.wave:
            return np.zeros_like(x)
        rate = [(self._elevation(x + e, t) - self._elevation(x - e, t)) / 2e-4 for e in 1e-4 * np.eye(3)]
        return np.stack(rate, axis=1)

    def derivative(self, x, e, t):
        """(e . grad) of the acceleration in linear theory, by finite differences; e: (n, 3)."""
        if not self.wave:
            return np.zeros_like(x)
        at = self._stretched(x, self._elevation(x, t))
        return (self._linear(at + 1e-4 * e, t)[1] - self._linear(at - 1e-4 * e, t)[1]) / 2e-4


def along(x, t):
    """Component of the rows of x along the unit rows of t."""
    return np.sum(x * t, axis=1, keepdims=True) * t


def length(x):
    """Norms of the rows, as a column."""
    return np.linalg.norm(x, axis=1, keepdims=True)


def cable_residual(scene, r, T, v, a, t):
    """Eq. (11)_1 at every node and the largest defect of (11)_2 over the cells, with Morison forces.

    r, v, a: (nodes, 3) in order from the anchor.  T: (cells, degree) values at equidistant points of each cell.
    """
    c, sea = scene["cable"], NumpySea(scene)
    mu, nu = c.get("position_degree", 1), c.get("tension_degree", 0)
    h, D, rho = c["length"] / c["elements"], c["diameter"], sea.density
    A, EA = np.pi * D**2 / 4, c.get("axial_stiffness", np.inf)
    xi, weights = gauss(mu + 1)
    N, dN = lagrange(mu, xi)
    Q = lagrange(nu, xi)[0] if nu else np.ones((len(xi), 1))
    weight = np.array([0.0, 0.0, -(c["line_density"] - rho * A) * sea.gravity])
    momentum, strain = np.zeros_like(r), 0.0
    for cell in range(c["elements"]):
        i = slice(cell * mu, (cell + 1) * mu + 1)
        slope, tension = dN @ r[i] / h, (Q @ T[cell])[:, None]
        e, tangent = tension / EA, slope / length(slope)
        _, water, a_w = sea.at(N @ r[i], t)
        v_rel, a_q = N @ v[i] - water, N @ a[i]
        v_t, a_t = along(v_rel, tangent), along(a_w, tangent)
        v_n, a_n = v_rel - v_t, a_q - along(a_q, tangent)
        C_n, C_t, C_A = (c.get(key, 0.0) for key in ("normal_drag", "tangential_drag", "added_mass"))
        f = -0.5 * rho * D * (C_n * length(v_n) * v_n + C_t * length(v_t) * v_t)
        f += rho * A * ((1 + C_A) * (a_w - a_t) - C_A * a_n + a_t)
        inertia = c["line_density"] * a_q - weight - (1 + e) * f
        momentum[i] += N.T @ (weights[:, None] * h * inertia) + dN.T @ (weights[:, None] * tension / (1 + e) * slope)
        defect = 0.5 * (length(slope) ** 2 / (1 + e) - (1 + e))
        strain = max(strain, np.abs(Q.T @ (weights[:, None] * defect)).max())
    return momentum, strain


class Body:
    """Mass [kg], height of C above the keel [m] and principal moments about C of a scene's buoy."""

    def __init__(self, scene):
        b = scene["buoy"]
        parts = [(b["mass"], b["center_of_mass"]), *((p["mass"], p["height"]) for p in b.get("point_masses", []))]
        self.mass = sum(m for m, _ in parts)
        self.center = sum(m * h for m, h in parts) / self.mass
        steiner = sum(m * (h - self.center) ** 2 for m, h in parts)
        across, along = b["inertia"]
        self.inertia = np.array([across + steiner, across + steiner, along])


class Strips:
    """A tilted cylinder cut into many thin slices at one instant: where each is, how wet, and how the water flows past.

    A slice is the circular segment that the tangent plane of the surface cuts from the disk; the water is that on the
    axis.
    motion: (velocity, angular velocity, acceleration, angular acceleration) of C; None for a hull at rest.
    """

    def __init__(self, scene, r_C, q4, center, t, motion=None, cells=400):
        self.scene, self.b, self.sea, self.t = scene, scene["buoy"], NumpySea(scene), t
        (_, diameter), (self.height, _) = self.b["hull"]
        self.R, self.center, self.r_C = diameter / 2, center, np.asarray(r_C)
        self.d = rotation_matrix(q4)[:, 2]
        self.motion = motion or np.zeros((4, 3))
        xi, weights = gauss(8)
        self.zeta = ((np.arange(cells)[:, None] + xi) * self.height / cells).ravel()
        self.weights = np.tile(weights * self.height / cells, cells)

    def at(self, zeta):
        """(wet area, its first moment, lever from C, velocity past the water, acceleration, water's acceleration)."""
        velocity, omega, acceleration, omega_t = self.motion
        lever = (zeta - self.center)[:, None] * self.d
        x = self.r_C + lever
        eta, water, a_w = self.sea.at(x, self.t)
        normal = np.array([0.0, 0.0, 1.0]) - self.sea.slope(x, self.t)
        normal /= length(normal)
        uphill = normal - (normal @ self.d)[:, None] * self.d
        w = self.R * length(uphill)[:, 0]
        c = np.clip(normal[:, 2] * (eta - x[:, 2]) / w, -1, 1)
        area = self.R**2 * (np.arccos(-c) + c * np.sqrt(1 - c**2))
        moment = -(2 / 3) * self.R**4 * ((1 - c**2) ** 1.5 / w)[:, None] * uphill
        v_rel = velocity + np.cross(omega, lever) - water
        a = acceleration + np.cross(omega_t, lever) + np.cross(omega, np.cross(omega, lever))
        return area[:, None], moment, lever, v_rel, a, a_w

    def loads(self):
        """Hydrodynamic force and torque about C on the hull, with its end discs."""
        b, rho, d = self.b, self.sea.density, self.d
        area, moment, lever, v_rel, a, a_w = self.at(self.zeta)
        C_A = b.get("added_mass", 0.0)
        v_n = v_rel - (v_rel @ d)[:, None] * d
        drag = 0.5 * b.get("normal_drag", 0.0) * rho * length(v_n) * v_n
        lift = [0.0, 0.0, rho * self.sea.gravity]
        pushed = (a_w - a) - ((a_w - a) @ d)[:, None] * d
        per_area = rho * (a_w + C_A * pushed) - 2 / (np.pi * self.R) * drag + lift
        force = self.weights @ (area * per_area)
        torque = self.weights @ np.cross(area * lever + moment, per_area) + self.gradient_couple(area, lever)
        torque -= (torque @ d) * d
        return force + self.ends(), torque

    def gradient_couple(self, area, lever):
        """rho R^2 A/4 sum e_i x (e_i . grad) a_w over two directions in the disk."""
        first = np.cross(self.d, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(self.d, [1.0, 0.0, 0.0]))
        total = 0
        for e in (first, np.cross(self.d, first)):
            rows = np.tile(e, (len(lever), 1))
            total = total + np.cross(rows, self.sea.derivative(self.r_C + lever, rows, self.t))
        return self.sea.density * self.R**2 / 4 * self.weights @ (area * total)

    def ends(self):
        """Force on the end discs, which submerge gradually over R/20 or R sin(tilt)."""
        b, rho, d = self.b, self.sea.density, self.d
        zeta = np.array([0.0, self.height])
        _, _, lever, v_rel, a, a_w = self.at(zeta)
        x = self.r_C + lever
        normal = np.array([0.0, 0.0, 1.0]) - self.sea.slope(x, self.t)
        normal /= length(normal)
        tilt2 = np.sum((normal - (normal @ d)[:, None] * d) ** 2, axis=1)
        depth = self.sea.at(x, self.t)[0] - x[:, 2]
        c = np.clip(normal[:, 2] * depth / (self.R * np.sqrt(tilt2 + 0.05**2)), -1, 1)
        area = (self.R**2 * (np.arccos(-c) + c * np.sqrt(1 - c**2)))[:, None]
        speed, pushed = (v_rel @ d)[:, None], ((a - a_w) @ d)[:, None]
        discs = 0.5 * b.get("axial_drag", 0) * np.abs(speed) * speed
        discs += b.get("axial_added_mass", 0) * 2 / 3 * self.R * pushed
        return -np.sum(rho * area * discs * d, axis=0)

    def wet(self):
        """(displaced mass, centre of buoyancy, wetted length, mean wetted diameter)."""
        area, moment, lever, *_ = self.at(self.zeta)
        volume = self.weights @ area[:, 0]
        center = self.r_C + self.weights @ (area * lever + moment) / volume
        share = area[:, 0] / (np.pi * self.R**2)
        return self.sea.density * volume, center, self.weights @ share, 2 * self.R


def wind_force(scene, point, t):
    """Eq. (2) at a point: wind with the seventh-root profile above the wave."""
    w = scene["wind"]
    height = point[2] - NumpySea(scene).at(point[None, :], t)[0][0]
    speed = w["speed_10m"] * (max(height, 0.0) / 10) ** (1 / 7)
    angle = np.radians(w["direction_deg"])
    size = 0.5 * w["drag_coefficient"] * w["air_density"] * w["area"] * speed**2
    return size * np.array([np.cos(angle), np.sin(angle), 0.0])
