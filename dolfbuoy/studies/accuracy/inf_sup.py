"""Stability of element pairs: the discrete inf-sup constant of the linearised problem (21).

Newton's matrix (20) at a state (r, T) is [[A, B^T], [B, 0]] with A = (T w', v') and B = (q, r'.w').  Besides T > 0
(A coercive) it needs

    beta_h = inf_q sup_w (q, r'.w') / (|w'| |q|),    |.| the norm of L2(0, L),  q in Q_h,  w in V_h with w(0) = 0,

bounded away from 0 as h -> 0; |w'| is a norm of H1, as w(0) = 0.  The state is the exact shape of an inextensible
cable, interpolated in V_h.  Pairs with nu >= mu are allowed only here; scenes reject them.

In the continuous problem the best w' is q t (t = r', free end), or q t minus its mean (fixed end), so that beta = 1
(free) and beta^2 = 1 - (largest eigenvalue of the mean of t t^T) (fixed): 0 for a straight cable, where T is determined
up to a constant.
"""

import math
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from scipy.linalg import cholesky, solve_triangular, svdvals

from ...elsewhere import MPI
from ...forms import cable as form
from ...meshes import cable_nodes
from ...parallel.cases import evaluate_all
from ...results.style import COLORS, PAGE, PALETTE, Figure, Line2D, legend_below, new_figure
from ...results.tables import groups
from ...solver import compat
from ...statics import catenary
from ...statics.catenary import Array
from ..study import Row, Table

ENDS = {"dir": "fixed", "free": "free"}
DEGREES = range(1, 5)
#: (mu, nu): all with nu < mu, then the counter-examples nu = mu and nu = mu + 1.
PAIRS = [(mu, nu) for mu in DEGREES for nu in range(mu)] + [(mu, mu + k) for k in (0, 1) for mu in DEGREES]
SIZES = (4, 8, 16, 32, 64)
#: Singular values below this count as zero: a true zero is computed as 1e-16, the smallest other one here is 3e-12.
ZERO = 1e-13
FLOOR = 1e-14  # value at which the figure draws a zero


#: Inextensible cables of L = 1 from the origin, the first two with w = 1.
STATES = {
    "catenary": catenary.between((0, 0, 0), (0.8, 0, 0), 1.0, 1.0, math.inf),
    "folded": catenary.between((0, 0, 0), (0.01, 0, 0.8), 1.0, 1.0, math.inf),  # Fig. 5; half turn within 0.0015 L
    "straight": catenary.Catenary(np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.0, math.inf, 0.6, 0.8),
}


def mean_tangent_product(shape: catenary.Catenary) -> Array:
    """Mean of t t^T over 0 <= s <= 1 in the vertical plane, from t = (H, V)/|(H, V)|."""
    H, V0, V1 = shape.H, shape.V0, shape.V0 + shape.w
    if shape.w == 0:
        return np.outer([H, V0], [H, V0]) / (H**2 + V0**2)
    xx = H * (np.arctan(V1 / H) - np.arctan(V0 / H)) / shape.w
    xz = H * np.log(np.hypot(H, V1) / np.hypot(H, V0)) / shape.w
    return np.array([[xx, xz], [xz, 1 - xx]])


def continuous_constant(state: str, end: str) -> float:
    """beta of the continuous problem; end: "dir" (both ends fixed) or "free"."""
    if end == "free":
        return 1.0
    largest = np.linalg.eigvalsh(mean_tangent_product(STATES[state]))[-1]
    return math.sqrt(max(1 - largest, 0.0)) if largest < 1 - 1e-12 else 0.0


def newton_matrix(state: str, mu: int, nu: int, elements: int) -> tuple[Array, Array, Array, Array]:
    """(A, B, M, places): blocks of (21) at T = 1, Gram matrix of Q_h, and s of every row of A."""
    mesh = compat.interval_mesh(MPI.COMM_SELF, cable_nodes(1.0, elements))
    parts = [compat.element(mesh, "P", mu, 3), compat.element(mesh, "DG", nu)]
    W = compat.function_space(mesh, compat.mixed_element(parts))
    V, r_dofs = compat.collapse(W, 0)
    _, T_dofs = compat.collapse(W, 1)
    r_dofs, T_dofs, s = np.asarray(r_dofs), np.asarray(T_dofs), V.tabulate_dof_coordinates()[:, 0]

    w = fem.Function(W)
    w.x.array[r_dofs.reshape(-1, 3)] = STATES[state].position(s)
    w.x.array[T_dofs] = 1.0
    (r, T), (v, q), p = ufl.split(w), ufl.TestFunctions(W), ufl.TrialFunctions(W)[1]
    F = form.tension_term(r, T, None, v) * ufl.dx + form.strain_equation(r, None, q) * ufl.dx  # (11), e = 0
    a = compat.compile_form(ufl.derivative(F, w) + p * q * ufl.dx)  # (20), with (p, q) in place of its 0
    J = fem.assemble_matrix(a).to_dense()
    return J[np.ix_(r_dofs, r_dofs)], J[np.ix_(T_dofs, r_dofs)], J[np.ix_(T_dofs, T_dofs)], np.repeat(s, 3)


def singular_values(A: Array, B: Array, M: Array) -> Array:
    """Increasing beta of B A^-1 B^T q = beta^2 M q, one for each row of M.

    They are the singular values of M^(-1/2) B A^(-1/2), which gives a zero as 1e-16; the square root of an eigenvalue
    would give 1e-8.
    """
    G = solve_triangular(cholesky(M, lower=True), B, lower=True)
    G = solve_triangular(cholesky(A, lower=True), G.T, lower=True)
    beta = svdvals(G)[::-1]
    return np.concatenate([np.zeros(max(len(M) - len(beta), 0)), beta])


def evaluate(case: Row) -> Row:
    """Constants of one state, pair and mesh for both kinds of end, and of the continuous problem."""
    state = case["state"]
    A, B, M, s = newton_matrix(state, case["mu"], case["nu"], case["elements"])
    result = {"h": 1 / case["elements"]}
    for end in ENDS:
        keep = (s > 1e-9) & ((s < 1 - 1e-9) | (end == "free"))
        beta = singular_values(A[np.ix_(keep, keep)], B[:, keep], M)
        zeros = int((beta < ZERO).sum())
        result |= {f"beta_{end}": float(beta[0]) if zeros == 0 else 0.0, f"n_zero_{end}": zeros}
        # without the zero of the continuous problem
        own = int(continuous_constant(state, end) == 0)
        result[f"reduced_{end}"] = float(beta[own]) if zeros <= own else 0.0
        if end == "dir":
            result |= {"beta_dir_2nd": float(beta[1]) if zeros <= 1 else 0.0, "beta_max": float(beta[-1])}
        result[f"continuous_{end}"] = continuous_constant(state, end)
    return result


def cases(
    states: Sequence[str] = tuple(STATES), pairs: Sequence[tuple[int, int]] = PAIRS, sizes: Sequence[int] = SIZES
) -> list[Row]:
    """All cases of the study."""
    keys = ("study", "state", "mu", "nu", "elements")
    return [dict(zip(keys, ("inf-sup", state, *p, n), strict=True)) for state in states for p in pairs for n in sizes]


def verdict(rows: list[Row], end: str) -> tuple[str, float | None]:
    """("stable" | "decays" | "spurious", observed power of h) of the rows of one state and pair.

    The zero of a straight cable between fixed ends is not due to the elements and is left out.
    """
    last, target = rows[-1], rows[-1][f"continuous_{end}"] or 1.0
    beta = [row[f"reduced_{end}"] for row in rows]
    if beta[-1] == 0:
        return "spurious", None
    order = math.log(beta[0] / beta[-1]) / math.log(rows[0]["h"] / last["h"])
    return ("decays" if order > 0.7 and beta[-1] < 0.1 * target else "stable"), order


def summary(rows: list[Row]) -> list[Row]:
    """One row per state and pair, comparing the coarsest and the finest mesh."""
    table = []
    for (state, mu, nu), group in groups(rows, "state", "mu", "nu").items():
        line = {"state": state, "pair": f"P{mu}-P{nu}"}
        for end in ENDS:
            line |= {f"first_{end}": group[0][f"beta_{end}"], f"last_{end}": group[-1][f"beta_{end}"]}
            line |= {f"least_{end}": min(row[f"reduced_{end}"] for row in group)}
            word, order = verdict(group, end)
            if word == "decays":
                word = f"unstable, h^{order:.0f}"
            elif word == "spurious":
                zeros = group[-1][f"n_zero_{end}"] - (group[-1][f"continuous_{end}"] == 0)
                word = f"unstable, {zeros / group[-1]['elements']:.3g} zero(s)/cell"
            line |= {f"n_zero_{end}": group[-1][f"n_zero_{end}"], f"verdict_{end}": word}
        fixed, free = (line[f"verdict_{end}"] for end in ENDS)
        line["verdict"] = free if fixed == free else f"fixed: {fixed}; free: {free}"
        table.append(line)
    return table


def notes(rows: list[Row]) -> list[str]:
    """The answer in words."""
    words: dict[str, set[str]] = {}
    for line in summary(rows):
        words.setdefault(line["pair"], set()).update(line[f"verdict_{end}"] for end in ENDS)
    good = [pair for pair, found in words.items() if found == {"stable"}]
    bad = [pair for pair, found in words.items() if "stable" not in found]
    return [
        f"Stable at every state and both kinds of end: {', '.join(good) or 'none'}.",
        f"Unstable at every state and both kinds of end: {', '.join(bad) or 'none'}.",
        "Why, and what fixed ends and unresolved folds do: Stable pairs in dolfbuoy/studies/README.md.",
    ]


_COLOR = dict(zip(DEGREES, PALETTE, strict=False))
_SIZE = {1: 8, 2: 6, 3: 4, 4: 2}
_WHOLE = {"color": "#999999", "lw": 2.5, "alpha": 0.6}
_LINE = {-1: ("-", r"$\nu < \mu$"), 0: ("--", r"$\nu = \mu$"), 1: (":", r"$\nu = \mu + 1$")}
COLUMNS = {
    "state": "state",
    "pair": "pair",
    "first_dir": f"fixed: {SIZES[0]}",
    "last_dir": f"{SIZES[-1]}",
    "n_zero_dir": "zeros",
    "first_free": f"free: {SIZES[0]}",
    "last_free": f"{SIZES[-1]}",
    "n_zero_free": "zeros",
    "verdict": "verdict",
}


def figure(rows: list[Row]) -> Figure:
    """beta_h over h for every state (columns) and kind of end (rows)."""
    states = groups(rows, "state")
    figure = new_figure(PAGE, 4.9)
    panels = figure.subplots(2, len(states), sharex=True, sharey=True, squeeze=False)
    for panel, end in zip(panels, ENDS, strict=True):
        for axes, (state, chosen) in zip(panel, states.items(), strict=True):
            _draw(axes, chosen, end)
            zero = "" if continuous_constant(state, end) else " (without its zero)"
            axes.set_title(f"{state}, {ENDS[end]} end{zero}")
        panel[0].set_ylabel(r"$\beta_h$")
    sizes = sorted({row["elements"] for row in rows})
    for axes in panels[-1]:
        axes.set(xlabel="h/L", xticks=[1 / n for n in sizes], xticklabels=[f"1/{n}" for n in sizes])
        axes.minorticks_off()
    panels[0][0].set_ylim(FLOOR / 10, 10)
    dot, ink = {"marker": "o", "mfc": "none"}, {"color": COLORS["ink"]}
    styles: Row = {f"$\\mu$ = {mu}": dot | {"color": color, "ms": _SIZE[mu]} for mu, color in _COLOR.items()}
    styles |= {label: ink | {"ls": line} for line, label in _LINE.values()}
    styles |= {"no elements": _WHOLE, "zero": ink | {"ls": "none", "marker": "x", "ms": 4}}
    legend_below(figure, 0.49, 5, [Line2D([], [], label=label, **style) for label, style in styles.items()])
    return figure


def _draw(axes: Any, rows: list[Row], end: str) -> None:
    axes.set(xscale="log", yscale="log")
    axes.axhline(rows[0][f"continuous_{end}"] or 1.0, **_WHOLE)
    for (mu, nu), group in groups(rows, "mu", "nu").items():
        h, beta = [row["h"] for row in group], [row[f"reduced_{end}"] for row in group]
        style = {"color": _COLOR[mu], "ls": _LINE[int(np.sign(nu - mu))][0], "ms": _SIZE[mu]}
        if beta[-1] > 0:
            axes.plot(h, beta, marker="o", mfc="none", mew=0.7, **style)
        else:
            axes.plot(h, [FLOOR] * len(h), marker="x", **style)


def study(folder: Path) -> list[Table]:
    """Tables of all constants, and of the verdict on each pair at each state."""
    rows = evaluate_all(evaluate, cases(), folder, itemgetter("mu", "nu"))
    if rows is None:
        return []
    messages = notes(rows)
    title = f"Inf-sup constant of (21) for {SIZES[0]} and {SIZES[-1]} elements, by the end at s = L"
    return [
        Table("inf-sup", rows, notes=messages, figure=figure(rows)),
        Table("inf-sup-summary", summary(rows), title, COLUMNS, messages),
    ]
