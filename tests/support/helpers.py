"""Shared by the tests: reference values, convergence rates, errors of a cable's finite-element solution."""

import json
from pathlib import Path

import numpy as np

from dolfbuoy.statics.catenary import Catenary

REFERENCE = Path(__file__).parents[1] / "reference"


def reference(name):
    """Content of tests/reference/<name>.json."""
    return json.loads((REFERENCE / f"{name}.json").read_text())


def rates(errors, sizes):
    """Observed order of every consecutive pair of errors under refinement from sizes[i] to sizes[i+1] elements."""
    errors, sizes = np.asarray(errors), np.asarray(sizes)
    return np.log(errors[:-1] / errors[1:]) / np.log(sizes[1:] / sizes[:-1])


def _lagrange(nodes, x):
    """Values and derivatives of the Lagrange polynomials of `nodes` at `x`, arrays (len(x), len(nodes))."""
    scale = (nodes[-1] - nodes[0]) / 2 or 1.0
    y, z = (nodes - nodes.mean()) / scale, (np.asarray(x) - nodes.mean()) / scale
    power = np.arange(len(nodes))
    inverse = np.linalg.inv(y[:, None] ** power)
    slope = np.column_stack([k * z ** max(k - 1, 0) for k in power]) / scale
    return z[:, None] ** power @ inverse, slope @ inverse


class CableSolution:
    """r_h, r_h' and T_h of a solved Problem as functions of arc length, element by element."""

    def __init__(self, problem):
        cable, u = problem.lines, problem.system.u
        degree = problem.scene.network.pieces[0].section.position_degree
        order = np.argsort(cable.node_s)
        s, r = cable.node_s[order], u[cable.node_dofs[order]]
        cells = np.argsort(cable.T_s.mean(axis=1))
        self.elements = []
        for e, c in enumerate(cells):
            node = slice(e * degree, (e + 1) * degree + 1)
            T_order = np.argsort(cable.T_s[c])
            self.elements.append((s[node], r[node], cable.T_s[c][T_order], u[cable.T_dofs[c][T_order]]))
        assert len(s) == degree * len(cells) + 1

    def in_element(self, e, s):
        """(r, r', T) at arc lengths s inside element e."""
        s_r, r, s_T, T = self.elements[e]
        value, slope = _lagrange(s_r, s)
        return value @ r, slope @ r, _lagrange(s_T, s)[0] @ T

    def at(self, s):
        """(r, r', T) at one arc length."""
        e = next(i for i, (nodes, *_) in enumerate(self.elements) if s <= nodes[-1] * (1 + 1e-12))
        return tuple(x[0] for x in self.in_element(e, np.array([s])))

    def errors(self, position, slope, tension, points=12):
        """L2 error of r and of r', H1 error of r and L2 error of T, against functions of arrays of s."""
        x, w = np.polynomial.legendre.leggauss(points)
        total = np.zeros(3)
        for e, (nodes, *_) in enumerate(self.elements):
            a, b = nodes[0], nodes[-1]
            s = a + (b - a) * (x + 1) / 2
            r, dr, T = self.in_element(e, s)
            squares = (((r - position(s)) ** 2).sum(1), ((dr - slope(s)) ** 2).sum(1), (T - tension(s)) ** 2)
            total += (b - a) / 2 * np.array([w @ q for q in squares])
        r, slope, T = total
        return {"L2r": np.sqrt(r), "L2slope": np.sqrt(slope), "H1r": np.sqrt(r + slope), "L2T": np.sqrt(T)}


def catenary_slope(shape):
    """r'(s) of a closed-form Catenary."""

    def slope(s):
        V, T = shape.vertical(s), shape.tension(s)
        stretch = (1 + T / shape.EA) / T
        return np.multiply.outer(shape.H * stretch, shape.along) + np.multiply.outer(V * stretch, [0.0, 0.0, 1.0])

    return slope


def reference_buoy(name, **buoy):
    """Section [buoy] of one of the reference cylinders; its mooring point is the centre of the keel."""
    b = reference("buoy_statics")[name]
    masses = [{"mass": mass, "height": height} for mass, height in b["point_masses"]]
    hull = [[0.0, b["D"]], [b["H"], b["D"]]]
    return {"hull": hull, "mass": b["hull_mass"], "center_of_mass": b["hull_zG"], "point_masses": masses} | buoy


def under_end_force(start, force, L, w, EA):
    """Catenary held at `start` and pulled at s = L by `force` (world vector) [N]."""
    H = float(np.hypot(force[0], force[1]))
    along = np.array([force[0] / H, force[1] / H, 0.0]) if H > 0 else np.array([1.0, 0.0, 0.0])
    return Catenary(np.asarray(start, float), along, w, EA, H, float(force[2]) - w * L)
