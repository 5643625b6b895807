"""A solved cable as polynomials on its elements, and how far it is from the closed form."""

import numpy as np

from .catenary import Catenary


class Profile:
    """r_h and T_h of a solved Problem on one rank, as polynomials on each element."""

    def __init__(self, problem):
        cable, u, mu = problem.lines, problem.system.u, problem.lines.section.position_degree
        order = np.argsort(cable.node_s)
        node = mu * np.arange(len(cable.T_s))[:, None] + np.arange(mu + 1)
        self.s, self.r = cable.node_s[order][node], u[cable.node_dofs[order]][node]
        cells = np.argsort(cable.T_s.mean(axis=1))
        places = np.argsort(cable.T_s[cells], axis=1)
        self.s_T = np.take_along_axis(cable.T_s[cells], places, axis=1)
        self.T = np.take_along_axis(u[cable.T_dofs[cells]], places, axis=1)
        self.sizes = self.s[:, -1] - self.s[:, 0]

    def at(self, xi):
        """(s, r, r', T) at -1 <= xi <= 1 of every element: arrays (elements, len(xi)[, 3])."""
        middle, half = self.s[0, [0, -1]].mean(), self.sizes[0] / 2  # all elements are alike
        value, slope = lagrange((self.s[0] - middle) / half, xi)
        tension, _ = lagrange((self.s_T[0] - middle) / half, xi)
        s = self.s[:, :1] + self.sizes[:, None] * (np.asarray(xi) + 1) / 2
        r_prime = 2 / self.sizes[:, None, None] * np.einsum("ij,ejk->eik", slope, self.r)
        return s, np.einsum("ij,ejk->eik", value, self.r), r_prime, self.T @ tension.T


def lagrange(nodes, x):
    """Lagrange polynomials of `nodes` and their derivatives at `x`, arrays (len(x), len(nodes))."""
    x, power = np.asarray(x, float), np.arange(len(nodes))
    coefficients = np.linalg.inv(nodes[:, None] ** power)
    slope = np.column_stack([k * x ** max(k - 1, 0) for k in power])
    return x[:, None] ** power @ coefficients, slope @ coefficients


def errors(profile: Profile, exact: Catenary, points: int = 16) -> dict:
    """Norms of the errors by Gauss quadrature on each element, and the smallest T_h at its points."""
    xi, weights = np.polynomial.legendre.leggauss(points)
    s, r, r_prime, T = profile.at(xi)
    V, T_exact = exact.vertical(s), exact.tension(s)
    force = exact.H * exact.along + V[..., None] * np.array([0.0, 0.0, 1.0])
    r_prime_exact = (1 / T_exact + 1 / exact.EA)[..., None] * force  # 1/inf = 0

    def square(difference):
        return float((profile.sizes / 2) @ (difference**2 @ weights))

    in_r = sum(square((r - exact.position(s))[..., k]) for k in range(3))
    in_slope = sum(square((r_prime - r_prime_exact)[..., k]) for k in range(3))
    norms = {"r_L2": in_r**0.5, "r_H1": (in_r + in_slope) ** 0.5, "T_L2": square(T - T_exact) ** 0.5}
    return norms | {"smallest_tension": float(T.min())}


def unit_cable(mu: int, nu: int, cells: int, top: dict, **more) -> dict:
    """A scene in air: a cable of length and weight 1, held at the origin, with elements P_mu-P_nu."""
    cable = {"length": 1.0, "line_density": 1.0, "elements": cells, "position_degree": mu, "tension_degree": nu}
    return {"gravity": 1.0, "cable": cable | {"top": top} | more}
