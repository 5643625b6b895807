"""A solved cable as polynomials on its elements, and its distance from the closed form."""

from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval, polyvander
from numpy.typing import ArrayLike

from ...model.problem import Problem
from ...statics.catenary import Array, Catenary


class Profile:
    """r_h and T_h of a solved Problem on one rank, as polynomials on each element; all elements are alike."""

    def __init__(self, problem: Problem):
        cable, u, mu = problem.lines, problem.system.u, problem.lines.section.position_degree
        order = np.argsort(cable.node_s)
        node = mu * np.arange(len(cable.T_s))[:, None] + np.arange(mu + 1)
        self.s, self.r = cable.node_s[order][node], u[cable.node_dofs[order]][node]
        cells = np.argsort(cable.T_s.mean(axis=1))
        places = np.argsort(cable.T_s[cells], axis=1)
        self.s_T = np.take_along_axis(cable.T_s[cells], places, axis=1)
        self.T = np.take_along_axis(u[cable.T_dofs[cells]], places, axis=1)
        self.sizes = self.s[:, -1] - self.s[:, 0]

    def at(self, xi: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """(s, r, r', T) at -1 <= xi <= 1 of every element: arrays (elements, len(xi)[, 3])."""
        middle, half = self.s[0, [0, -1]].mean(), self.sizes[0] / 2
        value, slope = lagrange((self.s[0] - middle) / half, xi)
        tension, _ = lagrange((self.s_T[0] - middle) / half, xi)
        s = self.s[:, :1] + self.sizes[:, None] * (np.asarray(xi) + 1) / 2
        r_prime = 2 / self.sizes[:, None, None] * np.einsum("ij,ejk->eik", slope, self.r)
        return s, np.einsum("ij,ejk->eik", value, self.r), r_prime, self.T @ tension.T


def lagrange(nodes: Array, x: ArrayLike) -> tuple[Array, Array]:
    """Lagrange polynomials of `nodes` and their derivatives at `x`, arrays (len(x), len(nodes))."""
    coefficients = np.linalg.inv(polyvander(nodes, len(nodes) - 1))
    return polyval(x, coefficients).T, polyval(x, polyder(coefficients)).T


def errors(profile: Profile, exact: Catenary) -> dict[str, float]:
    """Norms of the errors by Gauss quadrature on each element, and the smallest T_h at its points."""
    xi, weights = np.polynomial.legendre.leggauss(16)
    s, r, r_prime, T = profile.at(xi)
    r_prime_exact = (1 / exact.tension(s) + 1 / exact.EA)[..., None] * exact.force(s)  # 1/inf = 0
    off = {"r": r - exact.position(s), "slope": r_prime - r_prime_exact, "T": (T - exact.tension(s))[..., None]}
    squares = {name: float(profile.sizes / 2 @ (x**2).sum(axis=2) @ weights) for name, x in off.items()}
    norms = {"r_L2": squares["r"], "r_H1": squares["r"] + squares["slope"], "T_L2": squares["T"]}
    return {name: square**0.5 for name, square in norms.items()} | {"smallest_tension": float(T.min())}


def unit_cable(mu: int, nu: int, cells: int, top: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A scene in air: a cable of length and weight 1, held at the origin, with elements P_mu-P_nu."""
    cable = {"length": 1.0, "line_density": 1.0, "elements": cells, "position_degree": mu, "tension_degree": nu}
    return {"gravity": 1.0, "cable": cable | {"top": top} | more}
