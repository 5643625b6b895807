"""Fig. 5 of the paper: the end point of a unit cable rises from (0.01, 0, 0.8) to (0.01, 0, 0.99).

    .venv/bin/python -m tests.verification.rising [--pair 2,0 --cells 20]

EA = inf, weight 1.  The exact cable is folded: a half turn of radius about 0.001 between two nearly vertical branches.
Ten P1-P0 elements are rigid beams: at the end the lowest is longer than the fold is deep, stands aside and is
compressed.  Five P2-P0 elements bend, and the shape is right; but an element with one value of T only cannot follow the
tension through the fold, and the lowest carries far too much.
"""

import math
from operator import itemgetter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.style import COLORS, PAGE, legend_below, matplotlib, new_figure
from dolfbuoy.scene import load_scene
from dolfbuoy.statics import catenary
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.studies.accuracy.convergence import Profile, unit_cable
from dolfbuoy.studies.study import Table

from .script import kept, make, start

X_END, START, STEP = 0.01, 0.80, 0.01
#: Heights of the end point at which the state is kept.
STAGES = (0.80, 0.85, 0.90, 0.95, 0.99)
#: (mu, nu, elements) of the paper's figure.
PAPER = ((1, 0, 10), (2, 0, 5))
#: Continuation gives up below this step of the height.
SMALLEST_STEP = 1e-5
#: Points on an element: for the curves, and for what is largest or smallest.
XI, FINE = np.linspace(-1, 1, 41), np.linspace(-1, 1, 1001)


def parse_pair(pair: str | None, cells: int | None) -> tuple:
    """`4,1` and a number of elements -> ((4, 1, cells),); without cells as many position unknowns as in the paper."""
    if pair is None:
        if cells is not None:
            raise InputError("--pair: must be given with --cells, for example --pair 2,1 --cells 5.")
        return ()
    try:
        mu, nu = (int(part) for part in pair.split(","))
    except ValueError:
        raise InputError(f"--pair {pair}: must be the degrees of r and T, for example 2,1.") from None
    n = cells if cells is not None else max(1, round(10 / max(mu, 1)))
    if n < 1:
        raise InputError(f"--cells {n}: must be positive.")
    load_scene(unit_cable(mu, nu, n, {"kind": "free"}))  # refuses unstable pairs in one sentence
    return ((mu, nu, n),)


def cases(extra=()) -> list[dict]:
    """The paper's two discretisations and any (mu, nu, elements) besides."""
    return [{"mu": mu, "nu": nu, "cells": n, "stages": STAGES} for mu, nu, n in dict.fromkeys((*PAPER, *extra))]


def evaluate(case: dict) -> dict:
    """Raise the end point by continuation; the state at every stage, and how often a step was halved."""
    top = {"kind": "fixed", "position": (X_END, 0.0, START)}
    scene = unit_cable(case["mu"], case["nu"], case["cells"], top)
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    height, halved, states = START, 0, []
    for stage in case["stages"]:
        while height < stage - 1e-9:
            target = round(min(height + STEP, stage), 9)
            halved += raise_end(problem, height, target)
            height = target
        states.append({"z_end": stage, **_state(Profile(problem), exact_cable(stage))})
    problem.destroy()
    return {"halved_steps": halved, "states": states}


def raise_end(problem, start: float, target: float) -> int:
    """Move the end point up from the present solution; a step on which Newton fails is halved.

    Returns the number of halvings.  Raises SolveError if steps of SMALLEST_STEP do not help either.
    """
    system, top = problem.system, problem.lines.top_dofs()
    height, step, halved = start, target - start, 0
    while height < target:
        goal = min(height + step, target)
        system.u[top] = [X_END, 0.0, goal]
        try:
            problem.newton.solve()
        except SolveError:
            step, halved = step / 2, halved + 1
            if step < SMALLEST_STEP:
                raise
            continue
        height = goal
    return halved


def exact_cable(height: float) -> catenary.Catenary:
    """The folded catenary with its end at (0.01, 0, height)."""
    return catenary.between((0.0, 0.0, 0.0), (X_END, 0.0, height), 1.0, 1.0, math.inf)


def mean_tension(shape: catenary.Catenary, a, b):
    """Average of T over a <= s <= b; w not 0."""

    def integral(s):
        V = shape.vertical(s)
        return (V * shape.tension(s) + shape.H**2 * np.arcsinh(V / shape.H)) / (2 * shape.w)

    return (integral(b) - integral(a)) / (b - a)


def _state(profile, exact):
    """Numbers and curves of one state."""
    s, r, _, T = profile.at(FINE)
    xi, weights = np.polynomial.legendre.leggauss(12)
    _, r_gauss, _, T_gauss = profile.at(xi)
    lowest_point = min(max(-exact.V0 / exact.w, 0.0), 1.0)
    return {
        "smallest_tension": float(T.min()),
        "exact_smallest_tension": float(exact.tension(lowest_point)),
        "largest_tension": float(T.max()),
        "x_max": float(r[..., 0].max()),
        "x_min": float(r[..., 0].min()),
        "z_min": float(r[..., 2].min()),
        "deviation_x": float(np.abs(r[..., 0] - exact.plane(s)[0]).max()),
        "potential_energy": float(profile.sizes / 2 @ (r_gauss[..., 2] @ weights)),
        "tensions": (T_gauss @ weights / 2).tolist(),
        "exact_tensions": mean_tension(exact, profile.s[:, 0], profile.s[:, -1]).tolist(),
        "curves": _curves(profile, exact),
    }


def _curves(profile, exact):
    """Shape and tension over s, element after element, with the exact ones."""
    s, r, _, T = profile.at(XI)
    x_exact, z_exact = exact.plane(s)
    curves = {"s": s, "x": r[..., 0], "z": r[..., 2], "T": T}
    curves |= {"x_exact": x_exact, "z_exact": z_exact, "T_exact": exact.tension(s)}
    return {name: values.ravel().tolist() for name, values in curves.items()}


#: Key of a row -> heading; `T lowest` is the mean of T on the element at s = 0.
COLUMNS = {
    "discretisation": "elements",
    "z_end": "z end",
    "smallest_tension": "T min",
    "lowest_element": "T lowest",
    "exact_lowest_element": "exact",
    "x_max": "x max",
    "state": "state",
}


def study(folder: Path, extra: tuple = ()) -> list[Table]:
    """A row per discretisation and stage; beside them all elements, and the curves."""
    rows = evaluate_all(evaluate, cases(extra), kept(folder, __file__), itemgetter("mu", "nu"))
    if rows is None:
        return []
    stages, elements, profiles = (
        [row for case in rows for row in of(case)] for of in (stage_rows, _elements, _profiles)
    )
    notes = [sentence for case in rows for sentence in in_words(case)]
    return [
        Table("rising", stages, "Fig. 5: the end point rises to (0.01, 0, 0.99)", COLUMNS, notes, draw(rows)),
        Table("rising-elements", elements),
        Table("rising-profiles", profiles),
    ]


def name_of(case: dict) -> str:
    """`10 P1-P0`."""
    return f"{case['cells']} P{case['mu']}-P{case['nu']}"


def stage_rows(case: dict):
    """The numbers of every stage of a case."""
    for state in case["states"]:
        numbers = {key: value for key, value in state.items() if not isinstance(value, list | dict)}
        yield {
            "discretisation": name_of(case),
            **numbers,
            "lowest_element": state["tensions"][0],
            "exact_lowest_element": state["exact_tensions"][0],
            "state": "compressed" if state["smallest_tension"] <= 0 else "in tension",
        }


def _elements(case):
    for state in case["states"]:
        n = len(state["tensions"])
        for i, (T, exact) in enumerate(zip(state["tensions"], state["exact_tensions"], strict=True)):
            ends = {"element": i + 1, "s_from": i / n, "s_to": (i + 1) / n}
            yield {"discretisation": name_of(case), "z_end": state["z_end"], **ends, "mean_T": T, "exact_mean_T": exact}


def _profiles(case):
    for state in case["states"]:
        curves = state["curves"]
        for values in zip(*curves.values(), strict=True):
            yield {"discretisation": name_of(case), "z_end": state["z_end"], **dict(zip(curves, values, strict=True))}


def in_words(case: dict) -> list[str]:
    """What the last state of a discretisation is worth, and at which stages it is compressed."""
    last, name = case["states"][-1], name_of(case)
    T, right = last["tensions"][0], last["exact_tensions"][0]
    aside = "as the exact cable" if last["x_max"] < 1.001 * X_END else f"where the exact cable keeps to x <= {X_END}"
    notes = [
        f"{name} at z = {last['z_end']}: x up to {last['x_max']:.3g}, {aside}; the lowest element carries the mean "
        f"tension {T:.3g}, {T / right:.2g} times the right one ({right:.3g})."
    ]
    pressed = [state for state in case["states"] if state["smallest_tension"] <= 0]
    if pressed:
        heights = ", ".join(f"{state['z_end']} (T = {state['smallest_tension']:.3g})" for state in pressed)
        notes.append(f"{name}: COMPRESSED at z = {heights}: such a state is no equilibrium of a cable.")
    if case["halved_steps"]:
        notes.append(f"{name}: the step of the continuation was halved {case['halved_steps']} times.")
    return notes


def draw(computed: list[dict]):
    """Above the shapes at all stages, the scale of x stretched; below the tension at the last one."""
    figure = new_figure(max(PAGE, 3.6 * len(computed)), 6.5)
    grid = figure.subplots(2, len(computed), squeeze=False, gridspec_kw={"height_ratios": (1.3, 1)})
    for case, above, below in zip(computed, *grid, strict=True):
        _draw_shapes(above, case)
        _draw_tension(below, case["states"][-1])
        above.set_title(f"{name_of(case)} elements", fontweight="bold")
    grid[0, 0].set_ylabel("z")
    grid[1, 0].set_ylabel("T")
    handles = {h.get_label(): h for axes in grid[:, 0] for h in axes.get_legend_handles_labels()[0]}
    legend_below(figure, 0.6, 4, list(handles.values()))
    return figure


def _draw_shapes(axes, case):
    colors = matplotlib.colormaps["viridis"](np.linspace(0, 0.9, len(case["states"])))
    for color, state in zip(colors, case["states"], strict=True):
        curves = state["curves"]
        axes.plot(curves["x_exact"], curves["z_exact"], "--", color=color, lw=0.8)
        axes.plot(curves["x"], curves["z"], "-", color=color, label=f"end at z = {state['z_end']:.2f}")
        nodes = [*range(0, len(curves["x"]), len(XI)), -1]
        axes.plot([curves["x"][i] for i in nodes], [curves["z"][i] for i in nodes], "o", color=color, ms=2.2)
    axes.plot([], [], "--", color=COLORS["ink"], lw=0.8, label="exact shape, T(s)")
    axes.set_xlabel("x (note its scale)")
    axes.locator_params(axis="x", nbins=5)
    axes.margins(x=0.08)


def _draw_tension(axes, state):
    s, T = (np.reshape(state["curves"][name], (-1, len(XI))) for name in "sT")
    fine = np.linspace(0, 1, 801)
    axes.axhline(0, color="#888888", lw=0.7)
    axes.plot(fine, exact_cable(state["z_end"]).tension(fine), "--", color=COLORS["ink"], lw=0.8)
    for i, mean in enumerate(state["exact_tensions"]):
        label = "exact mean on the element" if i == 0 else None
        axes.plot(s[i, [0, -1]], [mean, mean], "-", color="#aaaaaa", lw=1.6, label=label)
        color = COLORS["red"] if T[i].min() <= 0 else COLORS["blue"]
        axes.plot(s[i], T[i], "-", color=color, lw=1.8, label="finite elements" if i == len(T) - 1 else None)
    T1, right = state["tensions"][0], state["exact_tensions"][0]
    pressed = " compressed" if state["smallest_tension"] <= 0 else ""
    title = f"smallest T {state['smallest_tension']:.3g}{pressed} (exact {state['exact_smallest_tension']:.2g})\n"
    title += f"lowest element {T1:.3g} = {T1 / right:.2g} × exact mean {right:.3g}"
    axes.set_title(title, fontsize=7)
    axes.set_xlabel(f"s, end point at z = {state['z_end']}")


def main(
    pair: Annotated[str | None, typer.Option(metavar="MU,NU", help="A pair besides the paper's.")] = None,
    cells: Annotated[int | None, typer.Option(help="Number of elements of that pair.")] = None,
    out: Path | None = None,
) -> None:
    """Fig. 5: a folded cable whose end rises."""
    make("rising", study, out, extra=parse_pair(pair, cells))


if __name__ == "__main__":
    start(main)
