"""Figs. 2 to 4 of the paper: errors of the static cable against the closed-form catenary, and their orders.

Unit cable of weight 1, held at s = 0; at s = 1 the force (0.5, 0, 0.75) is given (Neumann end, as in the paper) or the
position (Dirichlet end).  Fig. 2: EA = inf, optimal pairs P_k-P_(k-1).  Fig. 3: EA such that the cable stretches to
1.5 L, with the strain averaged on each element (Sect. 3.3.2) and exact.  Fig. 4: EA = inf, mu = 4, nu = 0..3.
"""

import math

import matplotlib
import numpy as np
from mpi4py import MPI

from .. import catenary
from ..errors import InputError
from ..scene import load_scene
from ..snapshot import COLORS, PAGE, STYLE, new_figure
from ..statics import solve_equilibrium
from .common import evaluate_all, orders, save, show

FORCE = (0.5, 0.0, 0.75)
#: EA/(w L) for which FORCE stretches the cable to exactly 1.5 L.
EA_50_PERCENT = 1.2347888733299130364
#: Dirichlet ends: a moderate sag, and the place to which FORCE brings the elastic cable.
ENDS = {"inextensible": (0.6, 0.0, 0.5), "elastic": (1.2429150442499342867, 0.0, 0.54483458602933885465)}
CELLS = (2, 4, 8, 16, 32, 64)
OPTIMAL = [(k, k - 1) for k in (1, 2, 3, 4)]
#: Figure -> (material, strains, pairs mu, nu).
FIGURES = {
    2: ("inextensible", ("exact",), OPTIMAL),
    3: ("elastic", ("element-average", "exact"), OPTIMAL),
    4: ("inextensible", ("exact",), [(4, nu) for nu in range(4)]),
}
ERRORS = {"r_L2": "r, L2", "r_H1": "r, H1", "T_L2": "T, L2"}
#: Errors below this are rounding: about twice what is left where the error has stopped to fall (measured).
ROUNDING = {"r_L2": 2e-13, "r_H1": 2e-12, "T_L2": 2e-13}


def cases(figures=tuple(FIGURES), cells=CELLS) -> list[dict]:
    """Every case of these figures once, Neumann and Dirichlet."""
    found = [case for figure in figures for end in ("Neumann", "Dirichlet") for case in _of(figure, end, cells)]
    return [case for i, case in enumerate(found) if case not in found[:i]]


def _of(figure, end, cells):
    material, strains, pairs = FIGURES[figure]
    return [
        {"material": material, "strain": strain, "end": end, "mu": mu, "nu": nu, "cells": n}
        for strain in strains
        for mu, nu in pairs
        for n in cells
    ]


def structure(case: dict) -> tuple:
    """What decides which forms are compiled."""
    return tuple(case[key] for key in ("material", "strain", "end", "mu", "nu"))


def evaluate(case: dict) -> dict:
    """Solve one case on this rank: errors of r in L2 and H1 and of T in L2, smallest T_h."""
    elastic = case["material"] == "elastic"
    EA, end = EA_50_PERCENT if elastic else math.inf, ENDS[case["material"]]
    neumann = case["end"] == "Neumann"
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": EA, "elements": case["cells"]}
    cable |= {"position_degree": case["mu"], "tension_degree": case["nu"], "strain": case["strain"]}
    cable["top"] = {"kind": "free", "force": FORCE} if neumann else {"kind": "fixed", "position": end}
    solver = {"quadrature_degree": 20} if elastic else {}  # (1+e) in a denominator: exact to rounding
    problem = solve_equilibrium(load_scene({"gravity": 1.0, "cable": cable, "solver": solver}), MPI.COMM_SELF)
    origin = (0.0, 0.0, 0.0)
    ends = (catenary.under_end_force, FORCE) if neumann else (catenary.between, end)
    profile = Profile(problem)
    problem.destroy()
    return {"h": 1 / case["cells"], **errors(profile, ends[0](origin, ends[1], 1.0, 1.0, EA))}


class Profile:
    """r_h and T_h of a solved Problem on one rank, as polynomials on each element."""

    def __init__(self, problem):
        cable, u, mu = problem.cable, problem.system.u, problem.scene.cable.position_degree
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
        value, slope = _lagrange((self.s[0] - middle) / half, xi)
        tension, _ = _lagrange((self.s_T[0] - middle) / half, xi)
        s = self.s[:, :1] + self.sizes[:, None] * (np.asarray(xi) + 1) / 2
        r_prime = 2 / self.sizes[:, None, None] * np.einsum("ij,ejk->eik", slope, self.r)
        return s, np.einsum("ij,ejk->eik", value, self.r), r_prime, self.T @ tension.T


def _lagrange(nodes, x):
    """Lagrange polynomials of `nodes` and their derivatives at `x`, arrays (len(x), len(nodes))."""
    x, power = np.asarray(x, float), np.arange(len(nodes))
    coefficients = np.linalg.inv(nodes[:, None] ** power)
    slope = np.column_stack([k * x ** max(k - 1, 0) for k in power])
    return x[:, None] ** power @ coefficients, slope @ coefficients


def errors(profile: Profile, exact: catenary.Catenary, points: int = 16) -> dict:
    """Norms of the errors by Gauss quadrature on each element, and the smallest T_h at its points."""
    xi, weights = np.polynomial.legendre.leggauss(points)
    s, r, r_prime, T = profile.at(xi)
    V, T_exact = exact.vertical(s), exact.tension(s)
    force = exact.H * exact.along + V[..., None] * np.array([0.0, 0.0, 1.0])
    r_prime_exact = ((1 / T_exact + 1 / exact.EA) if np.isfinite(exact.EA) else 1 / T_exact)[..., None] * force

    def square(difference):
        return float((profile.sizes / 2) @ (difference**2 @ weights))

    in_r = sum(square((r - exact.position(s))[..., k]) for k in range(3))
    in_slope = sum(square((r_prime - r_prime_exact)[..., k]) for k in range(3))
    norms = {"r_L2": in_r**0.5, "r_H1": (in_r + in_slope) ** 0.5, "T_L2": square(T - T_exact) ** 0.5}
    return norms | {"smallest_tension": float(T.min())}


def theory(row: dict) -> dict:
    """Orders expected: nu + 2, nu + 1 and nu + 1; averaged strain limits r to 2 and 1."""
    limit = 1 if row["strain"] == "element-average" else row["nu"] + 1
    return {"r_L2": limit + 1, "r_H1": limit, "T_L2": row["nu"] + 1}


def add_orders(rows: list[dict]) -> list[dict]:
    """Copies of the rows of one curve with observed and theoretical orders; none where the error is rounding."""
    rows = [dict(row) for row in rows]
    for name in ERRORS:
        orders(rows, name)
        for row in rows:
            row[f"theory_{name}"] = theory(row)[name]
            row[f"rounding_{name}"] = row[name] < ROUNDING[name]
            if row[f"rounding_{name}"]:
                row[f"order_{name}"] = None
    return rows


def curves(rows: list[dict]) -> list[list[dict]]:
    """Rows grouped into curves over h, in their order."""
    groups = {}
    for row in rows:
        groups.setdefault(structure(row), []).append(row)
    return list(groups.values())


def run(folder, figures=tuple(FIGURES), cells=CELLS) -> dict | None:
    """The study: (figure, end) -> rows, shown and written to `folder`; None on all ranks but 0."""
    wanted = cases(figures, cells)
    computed = evaluate_all(evaluate, wanted, folder, structure)
    if computed is None:
        return None
    by_case = {tuple(case.values()): row for case, row in zip(wanted, computed, strict=True)}
    tables = {}
    for figure in figures:
        for end in ("Neumann", "Dirichlet"):
            plain = [by_case[tuple(case.values())] for case in _of(figure, end, cells)]
            rows = tables[figure, end] = [row for curve in curves(plain) for row in add_orders(curve)]
            notes = in_words(rows)
            save(folder, f"figure{figure}-{end.lower()}", rows, draw(figure, rows), notes)
            _show(f"\nFig. {figure}, {end} end, {rows[0]['material']} cable", rows, notes)
    return tables


def _show(title, rows, notes):
    columns = {"strain": "strain"} if rows[0]["material"] == "elastic" else {}
    columns |= {"pair": "pair", "cells": "elements"}
    for name, heading in ERRORS.items():
        columns |= {name: heading, f"shown_{name}": "order (theory)"}
    show(title, [row | {"pair": _pair(row)} | _order_texts(row) for row in rows], columns, notes)


def _order_texts(row):
    texts = {}
    for name in ERRORS:
        order = row[f"order_{name}"]
        observed = "rounding" if row[f"rounding_{name}"] else "-" if order is None else f"{order:.2f}"
        texts[f"shown_{name}"] = f"{observed} ({row[f'theory_{name}']})"
    return texts


def _pair(row):
    return f"P{row['mu']}-P{row['nu']}"


def in_words(rows: list[dict]) -> list[str]:
    """What the rows of one figure show."""
    last, notes = list(_last_orders(rows)), []
    if last:
        worst, name = max(last, key=lambda x: abs(x[0][f"order_{x[1]}"] - x[0][f"theory_{x[1]}"]))
        gap = abs(worst[f"order_{name}"] - worst[f"theory_{name}"])
        verdict = "agree with" if gap < 0.1 else "DIFFER from"
        notes.append(
            f"The orders between the two finest meshes {verdict} theory: the largest difference is {gap:.2g} "
            f"({_pair(worst)}, {ERRORS[name]})."
        )
    notes += _averaged_in_words(rows)
    if rows[0]["mu"] == rows[-1]["mu"]:
        notes.append("The tension's degree sets the order of r as well: nu + 2 in L2 and nu + 1 in H1, whatever mu.")
    if any(row[f"rounding_{name}"] for row in rows for name in ERRORS):
        notes.append("'rounding': the error is that of floating-point arithmetic and has no order.")
    pressed = [f"{_pair(row)} on {row['cells']}" for row in rows if row["smallest_tension"] <= 0]
    if pressed:
        notes.append(f"Compressed states (T <= 0 somewhere): {', '.join(pressed)} elements.")
    return notes


def _last_orders(rows):
    for curve in curves(rows):
        for name in ERRORS:
            known = [row for row in curve if row[f"order_{name}"] is not None]
            if known:
                yield known[-1], name


def _averaged_in_words(rows):
    """The cost of the paper's element-averaged strain, from the highest degree on the finest mesh of both."""
    averaged = [row for row in rows if row["strain"] == "element-average" and row["mu"] >= 2]
    exact = [row for row in rows if row["strain"] == "exact" and row["material"] == "elastic"]
    if not averaged or not exact:
        return []
    a, e = averaged[-1], exact[-1]
    return [
        "With the strain averaged on each element (the paper's Sect. 3.3.2) r stalls at order 2 in L2 and 1 in H1 for "
        f"every k >= 2, while T keeps order k: {_pair(a)} on {a['cells']} elements has the L2 error {a['r_L2']:.2g} of "
        f"r, {e['r_L2']:.2g} with the exact strain."
    ]


# -- figure ------------------------------------------------------------------------------------------------------------

LOOKS = [("blue", "o"), ("red", "s"), ("green", "^"), ("orange", "D")]


@matplotlib.rc_context(STYLE)
def draw(figure_number: int, rows: list[dict]):
    """Errors over h as in the paper; in Fig. 3 the lower row has the exact strain."""
    strains = FIGURES[figure_number][1]
    panels = [("r_L2", "r_H1"), ("T_L2",)] if figure_number == 3 else [(name,) for name in ERRORS]
    figure = new_figure(PAGE, 2.9 * len(strains))
    grid = figure.subplots(len(strains), len(panels), squeeze=False, sharex=True)
    for strain, line in zip(strains, grid, strict=True):
        groups = curves([row for row in rows if row["strain"] == strain])
        for names, axes in zip(panels, line, strict=True):
            _panel(axes, groups, names)
            title = "error of " + (f"{ERRORS[names[0]]}" if len(names) == 1 else "r, L2 (solid) and H1 (dashed)")
            axes.set_title(title + (f"; {strain.replace('-', ' ')} strain" if len(strains) > 1 else ""))
    for axes in grid[-1]:
        axes.set_xlabel("h")
    grid[0, 0].legend(*_legend(grid[0, 0]), loc="lower right")
    return figure


def _legend(axes):
    handles, labels = axes.get_legend_handles_labels()
    return handles[:4], labels[:4]


def _panel(axes, groups, names):
    for name, style in zip(names, ("-", "--"), strict=False):
        for (color, marker), curve in zip(LOOKS, groups, strict=False):
            h, error = [row["h"] for row in curve], [row[name] for row in curve]
            axes.loglog(h, error, style, color=COLORS[color], marker=marker, ms=3, label=_pair(curve[0]))
            noise = [(x, y) for x, y, row in zip(h, error, curve, strict=True) if row[f"rounding_{name}"]]
            axes.plot(*np.array(noise).reshape(-1, 2).T, "x", color=COLORS["ink"], ms=6)
        _slopes(axes, groups, name)
    axes.margins(x=0.12, y=0.08)


def _slopes(axes, groups, name):
    """One reference slope per theoretical order, below the lowest curve of that order."""
    lowest = {}
    for curve in groups:
        sound = [row for row in curve if not row[f"rounding_{name}"]]
        if len(sound) > 1:
            p = sound[-1][f"theory_{name}"]
            lowest[p] = min(lowest.get(p, sound[-1]), sound[-1], key=lambda row: row[name] / row["h"] ** p)
    for p, row in lowest.items():
        h = np.array([row["h"], 4 * row["h"]])
        error = 0.45 * row[name] * (h / row["h"]) ** p
        axes.plot(h, error, "-", color="#888888", lw=0.7)
        axes.annotate(f"$h^{p}$", (h[1], error[1]), (2, -3), textcoords="offset points", color="#666666", fontsize=7)


# -- options of the command line ---------------------------------------------------------------------------------------


def parse_figures(text: str) -> tuple[int, ...]:
    """`2`, `3`, `4` or `all`."""
    if text == "all":
        return tuple(FIGURES)
    if text not in {str(figure) for figure in FIGURES}:
        raise InputError(f"--figure {text}: must be 2, 3, 4 or all.")
    return (int(text),)


def parse_cells(text: str) -> tuple[int, ...]:
    """`2,4,8`: numbers of elements, increasing."""
    try:
        cells = tuple(int(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--cells {text}: must be whole numbers with commas between them, for example 2,4,8."
        ) from None
    if min(cells) < 1 or list(cells) != sorted(set(cells)):
        raise InputError(f"--cells {text}: must be positive and increasing.")
    return cells
