"""Figs. 2 to 4 of the paper: errors of the static cable against the closed-form catenary, and their orders.

Unit cable of weight 1, held at s = 0; at s = 1 the force (0.5, 0, 0.75) (Neumann end, as in the paper) or the position
(Dirichlet end) is prescribed.  Fig. 2: EA = inf, optimal pairs P_k-P_(k-1).  Fig. 3: EA such that the cable stretches
to 1.5 L, with the strain averaged on each element (Sect. 3.3.2) and exact.  Fig. 4: EA = inf, mu = 4, nu = 0..3.
"""

import itertools
import math
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval, polyvander
from numpy.typing import ArrayLike

from ...elsewhere import MPI
from ...errors import InputError
from ...model.problem import Problem
from ...parallel.cases import evaluate_all
from ...results.compare import orders
from ...results.style import COLORS, PAGE, PALETTE, Figure, new_figure
from ...results.tables import groups
from ...scene import load_scene
from ...statics import catenary
from ...statics.catenary import Array, Catenary
from ...statics.equilibrium import solve_equilibrium
from ..study import Row, Table

#: Keys of a case that determine the compiled forms, and the curve over h.
STRUCTURE = ("material", "strain", "end", "mu", "nu")

FORCE = (0.5, 0.0, 0.75)
#: EA/(w L) for which FORCE stretches the cable to exactly 1.5 L.
EA_50_PERCENT = 1.2347888733299130364
#: Dirichlet ends: a moderate sag, and the position to which FORCE brings the elastic cable.
ENDS = {"inextensible": (0.6, 0.0, 0.5), "elastic": (1.2429150442499342867, 0.0, 0.54483458602933885465)}
CELLS = (2, 4, 8, 16, 32, 64)
OPTIMAL = [(k, k - 1) for k in (1, 2, 3, 4)]
#: Figure -> (material, strains, pairs mu, nu).
FIGURES = {
    2: ("inextensible", ("exact",), OPTIMAL),
    3: ("elastic", ("element-average", "exact"), OPTIMAL),
    4: ("inextensible", ("exact",), [(4, nu) for nu in range(4)]),
}
ENDS_OF_CABLE = ("Neumann", "Dirichlet")
ERRORS = {"r_L2": "r, L2", "r_H1": "r, H1", "T_L2": "T, L2"}
#: Errors below this are rounding errors: about twice the level at which errors stopped falling.
ROUNDING = {"r_L2": 2e-13, "r_H1": 2e-12, "T_L2": 2e-13}


def parse_figures(text: str) -> tuple[int, ...]:
    """`2`, `3`, `4` or `all`."""
    if text not in ("all", *map(str, FIGURES)):
        raise InputError(f"--figure {text}: must be 2, 3, 4 or all.")
    return tuple(FIGURES) if text == "all" else (int(text),)


def parse_cells(text: str) -> tuple[int, ...]:
    """`2,4,8`: numbers of elements, increasing."""
    cells = tuple(int(part) if part.strip().isdecimal() else 0 for part in text.split(","))
    if min(cells) < 1 or list(cells) != sorted(set(cells)):
        raise InputError(f"--cells {text}: must be positive whole numbers, increasing, for example 2,4,8.")
    return cells


def cases(figures: Sequence[int] = tuple(FIGURES), cells: Sequence[int] = CELLS) -> list[Row]:
    """All cases of these figures without duplicates, Neumann and Dirichlet."""
    found = [case for figure, end in itertools.product(figures, ENDS_OF_CABLE) for case in _of(figure, end, cells)]
    return [case for i, case in enumerate(found) if case not in found[:i]]


def _of(figure: int, end: str, cells: Sequence[int]) -> list[Row]:
    material, strains, pairs = FIGURES[figure]
    return [
        {"material": material, "strain": strain, "end": end, "mu": mu, "nu": nu, "cells": n}
        for strain in strains
        for mu, nu in pairs
        for n in cells
    ]


class Profile:
    """r_h and T_h of a solved Problem on one rank, as polynomials on equal elements."""

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


def evaluate(case: Row) -> Row:
    """Solve one case on this rank: errors of r in L2 and H1 and of T in L2, smallest T_h."""
    elastic = case["material"] == "elastic"
    EA, end = EA_50_PERCENT if elastic else math.inf, ENDS[case["material"]]
    neumann = case["end"] == "Neumann"
    top = {"kind": "free", "force": FORCE} if neumann else {"kind": "fixed", "position": end}
    scene = unit_cable(case["mu"], case["nu"], case["cells"], top, axial_stiffness=EA, strain=case["strain"])
    scene["solver"] = {"quadrature_degree": 20} if elastic else {}  # (1+e) in a denominator: exact to rounding
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    profile = Profile(problem)
    problem.destroy()
    H, _, V = FORCE
    pulled = Catenary(np.zeros(3), np.array([1.0, 0.0, 0.0]), 1.0, EA, H, V - 1.0)
    exact = pulled if neumann else catenary.between(np.zeros(3), end, 1.0, 1.0, EA)
    return {"h": 1 / case["cells"], **errors(profile, exact)}


def theory(row: Row) -> Row:
    """Orders expected: nu + 2, nu + 1 and nu + 1.

    The averaged strain limits r to 2 and 1.  Between fixed ends T depends on the length, and is limited to 2 too.
    """
    averaged = row["strain"] == "element-average"
    k = 1 if averaged else row["nu"] + 1
    of_T = min(row["nu"] + 1, 2) if averaged and row["end"] == "Dirichlet" else row["nu"] + 1
    return {"r_L2": k + 1, "r_H1": k, "T_L2": of_T}


def add_orders(rows: list[Row]) -> list[Row]:
    """Copies of the rows of one curve with observed and theoretical orders; no order where the error is rounding."""
    rows = [dict(row) for row in rows]
    for name in ERRORS:
        orders(rows, name)
        for row in rows:
            row[f"theory_{name}"] = theory(row)[name]
            row[f"rounding_{name}"] = row[name] < ROUNDING[name]
            row[f"order_{name}"] = None if row[f"rounding_{name}"] else row[f"order_{name}"]
    return rows


def curves(rows: list[Row]) -> list[list[Row]]:
    """Rows grouped into curves over h, in their order."""
    return list(groups(rows, *STRUCTURE).values())


COLUMNS = {"pair": "pair", "cells": "cells"}
for _name, _text in ERRORS.items():
    COLUMNS |= {f"shown_{_name}": _text, f"shown_order_{_name}": "order"}


def study(folder: Path, figures: tuple[int, ...] = tuple(FIGURES), cells: tuple[int, ...] = CELLS) -> list[Table]:
    """A table with orders for every figure and end."""
    wanted, made = cases(figures, cells), []
    rows = evaluate_all(evaluate, wanted, folder, itemgetter(*STRUCTURE))
    if rows is None:
        return []
    for figure, end in itertools.product(figures, ENDS_OF_CABLE):
        plain = [rows[wanted.index(case)] for case in _of(figure, end, cells)]
        found = [row for curve in curves(plain) for row in add_orders(curve)]
        notes, material = in_words(found), found[0]["material"]
        made.append(Table(f"figure{figure}-{end.lower()}", found, notes=notes, figure=draw(figure, found)))
        for strain, chosen in groups(found, "strain").items():
            which = f"{material} cable" + (f", {strain} strain" if material == "elastic" else "")
            title = f"\nFig. {figure}, {end} end, {which}; order (theory)"
            made.append(Table("", [row | texts(row) for row in chosen], title, COLUMNS))
        made[-1].notes = notes
    return made


def texts(row: Row) -> Row:
    """Entries of the table for a row: its pair, and orders or the reason for their absence."""
    found = {"pair": _pair(row)}
    for name in ERRORS:
        order = row[f"order_{name}"]
        observed = "rounding" if row[f"rounding_{name}"] else "-" if order is None else f"{order:.2f}"
        found |= {f"shown_{name}": f"{row[name]:.2e}", f"shown_order_{name}": f"{observed} ({row[f'theory_{name}']})"}
    return found


def _pair(row: Row) -> str:
    return f"P{row['mu']}-P{row['nu']}"


def in_words(rows: list[Row]) -> list[str]:
    """Sentences on the rows of one figure."""
    notes, gaps = [], []
    for curve, name in itertools.product(curves(rows), ERRORS):
        known = [row for row in curve if row[f"order_{name}"] is not None]
        if known:
            gap = abs(known[-1][f"order_{name}"] - known[-1][f"theory_{name}"])
            gaps.append((gap, f"{gap:.2g} ({_pair(curve[0])}, {ERRORS[name]})"))
    agree = bool(gaps) and max(gaps)[0] < 0.1
    if gaps:
        verdict = "agree with" if agree else "DIFFER from"
        notes.append(f"The orders on the finest meshes {verdict} theory: the largest difference is {max(gaps)[1]}.")
    high = [[r for r in rows if r["strain"] == strain and r["mu"] > 1] for strain in ("element-average", "exact")]
    if agree and all(high):  # error due to the paper's element-averaged strain, at the highest degree and finest mesh
        (a, e), neumann = (found[-1] for found in high), rows[0]["end"] == "Neumann"
        fixed = "and T at order 2 for every k >= 3: between fixed ends it depends on the length"
        of_T, key = ("while T keeps order k: the end force alone decides it", "r_L2") if neumann else (fixed, "T_L2")
        notes.append(
            "With the strain averaged on each element (Sect. 3.3.2 of the paper) r stalls at order 2 in L2 and 1 in H1 "
            f"for every k >= 2, {of_T}. {_pair(a)} on {a['cells']} elements has the error {a[key]:.2g} in "
            f"{ERRORS[key]}, with the exact strain {e[key]:.2g}."
        )
    if agree and rows[0]["mu"] == rows[-1]["mu"]:
        notes.append("The tension's degree sets the order of r as well: nu + 2 in L2 and nu + 1 in H1, whatever mu.")
    if any(row[f"rounding_{name}"] for row in rows for name in ERRORS):
        notes.append("'rounding': the error is that of floating-point arithmetic and has no order.")
    pressed = [f"{_pair(row)} on {row['cells']}" for row in rows if row["smallest_tension"] <= 0]
    if pressed:
        notes.append(f"Compressed states (T <= 0 somewhere): {', '.join(pressed)} elements.")
    return notes


MARKERS = "os^D"


def draw(figure_number: int, rows: list[Row]) -> Figure:
    """Errors over h as in the paper; in Fig. 3 the lower row has the exact strain."""
    strains = FIGURES[figure_number][1]
    panels = [("r_L2", "r_H1"), ("T_L2",)] if figure_number == 3 else [(name,) for name in ERRORS]
    figure = new_figure(PAGE, 2.9 * len(strains))
    grid = figure.subplots(len(strains), len(panels), squeeze=False, sharex=True)
    for strain, line in zip(strains, grid, strict=True):
        found = curves([row for row in rows if row["strain"] == strain])
        for names, axes in zip(panels, line, strict=True):
            _panel(axes, found, names)
            title = f"error of {ERRORS[names[0]]}" + (" (solid) and H1 (dashed)" if len(names) > 1 else "")
            axes.set_title(title + (f"; strain: {strain}" if len(strains) > 1 else ""))
    figure.supxlabel("h", fontsize=8)
    grid[0, 0].legend(loc="lower right")
    return figure


def _panel(axes: Any, found: list[list[Row]], names: Sequence[str]) -> None:
    for name, style in zip(names, ("-", "--"), strict=False):
        for color, marker, curve in zip(PALETTE, MARKERS, found, strict=False):
            h, error = [row["h"] for row in curve], [row[name] for row in curve]
            label = _pair(curve[0]) if name == names[0] else None
            axes.loglog(h, error, style, color=color, marker=marker, ms=3, label=label)
            noise = [(row["h"], row[name]) for row in curve if row[f"rounding_{name}"]]
            axes.plot(*np.reshape(noise, (-1, 2)).T, "x", color=COLORS["ink"], ms=7)
    axes.set_xticks([row["h"] for row in found[0]], [f"1/{row['cells']}" for row in found[0]], minor=False)
    axes.set_xticks([], minor=True)
    _slopes(axes, found, names)
    axes.margins(x=0.12, y=0.08)


def _slopes(axes: Any, found: list[list[Row]], names: Sequence[str]) -> None:
    """One reference slope per theoretical order, below the lowest curve of that order."""
    lowest: dict[int, tuple[float, float]] = {}
    for curve, name in itertools.product(found, names):
        sound = [row for row in curve if not row[f"rounding_{name}"]]
        if len(sound) > 1:
            p, h, error = (sound[-1][key] for key in (f"theory_{name}", "h", name))
            lowest[p] = min(lowest.get(p, (np.inf, h)), (error / h**p, h))
    for p, (factor, h) in lowest.items():
        axes.plot([h, 4 * h], [0.45 * factor * x**p for x in (h, 4 * h)], "-", color="#888888", lw=0.7)
        axes.annotate(f"$h^{p}$", (4 * h, 0.45 * factor * (4 * h) ** p), (2, -3), textcoords="offset points")
