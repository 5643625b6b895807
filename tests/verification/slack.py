"""What the two slack laws do: on a folded cable at rest, and on snap loads of a cable that goes slack in every period.

    .venv/bin/python -m tests.verification.slack [--t-end 30]

`compressive` is the two-sided law, an element that is pushed carries T < 0; `tension-only` lets it be shorter instead.
Both have the same limit under refinement where the exact cable is in tension.  The folded cable is that of `rising`,
exact from the closed form.  The snap loads are those of the scene `driven-slack`, against two independent programs
that were converged under refinement.
"""

from operator import itemgetter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.api import simulate
from dolfbuoy.errors import SolveError
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.parts import alone
from dolfbuoy.results.tables import groups
from dolfbuoy.scene import load_scene
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.studies.accuracy.convergence import Profile, errors, unit_cable
from dolfbuoy.studies.study import Table

from .rising import X_END, exact_cable
from .script import kept, make, start

LAWS = ("compressive", "tension-only")
PAIRS = ((1, 0), (2, 1))
#: Folded: heights of the end point (a fold of radius 0.0007 and depth 0.1, and one of depth 0.004), elements.
HEIGHTS, FOLDED_CELLS = (0.80, 0.99), (5, 10, 20, 40, 80, 160)
#: Snap: elements of each pair, (scheme, step [s]), and what of a run counts [s].
SNAP_CELLS = {(1, 0): (20, 40, 80, 160), (2, 1): (20, 40, 80)}
SNAP_STEPS = (("backward-euler", 0.01), ("backward-euler", 0.005), ("bdf2", 0.005))
SNAP_COUNTS = 15.0
#: Largest tensions of `driven-slack` from the independent programs [N], good to 5 and 10 N.
REFERENCE = {"top_max": 8850.0, "anchor_max": 5256.0}


def cases(t_end: float) -> list[dict]:
    """Folded cables, then runs until `t_end` [s]; both laws next to each other."""
    pairs = [(mu, nu, slack) for mu, nu in PAIRS for slack in LAWS]
    folded = [
        {"kind": "folded", "z_end": z, "mu": mu, "nu": nu, "cells": n, "slack": slack}
        for z in HEIGHTS
        for n in FOLDED_CELLS
        for mu, nu, slack in pairs
    ]
    snap = [
        {"kind": "snap", "mu": mu, "nu": nu, "cells": n, "slack": slack, "scheme": scheme, "step": step, "end": t_end}
        for scheme, step in SNAP_STEPS
        for mu, nu, slack in pairs
        for n in SNAP_CELLS[mu, nu]
    ]
    return folded + snap


def evaluate(case: dict) -> dict:
    """The numbers of one case; `failed` holds the reason of a solve that failed."""
    try:
        return fold(case) if case["kind"] == "folded" else snap(case)
    except SolveError as error:
        return {"failed": str(error)}


def fold(case: dict) -> dict:
    """A unit cable, weight 1, EA = inf, between the origin and (0.01, 0, z_end), against the catenary."""
    top = {"kind": "fixed", "position": (X_END, 0.0, case["z_end"])}
    scene = unit_cable(case["mu"], case["nu"], case["cells"], top, slack=case["slack"])
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    exact = exact_cable(case["z_end"])
    norms = errors(Profile(problem), exact)
    top = float(np.linalg.norm(problem.end_tension()) / exact.tension(1.0) - 1)
    found = {"r_L2": norms["r_L2"], "T_L2": norms["T_L2"], "top_error": top}
    found |= {"T_min": float(problem.system.u[problem.lines.T_dofs].min()), "iterations": problem.iterations}
    problem.destroy()
    return found


def snap(case: dict) -> dict:
    """Extremes of `driven-slack` over the last SNAP_COUNTS seconds."""
    cable = {"elements": case["cells"], "position_degree": case["mu"], "tension_degree": case["nu"]}
    time = {"end": case["end"], "step": case["step"], "scheme": case["scheme"], "output_every": 0.05}
    cable["slack"] = case["slack"]
    record = alone(simulate("driven-slack", comm=MPI.COMM_SELF, cable=cable, time=time))
    last, frames = record.time > case["end"] - SNAP_COUNTS, record.frame > case["end"] - SNAP_COUNTS
    found = {f"{end}_max": float(record[f"tension_{end}"][last.values].max()) for end in ("top", "anchor")}
    for end in ("top", "anchor"):
        found[f"{end}_error"] = found[f"{end}_max"] / REFERENCE[f"{end}_max"] - 1
    found["T_min"] = float(record.cable_tension[frames.values].min())
    found |= {"failed_steps": int(record.attrs["failed_steps"]), "newton": float(record.newton_iterations[1:].mean())}
    return found


FOLDED = {
    "z_end": "z end",
    "discretisation": "elements",
    "slack": "law",
    "r_L2": "error of r",
    "T_L2": "error of T",
    "top_error": "of top tension",
    "T_min": "T min",
    "iterations": "iterations",
}
SNAP = {
    "discretisation": "elements",
    "scheme": "scheme",
    "step": "step",
    "slack": "law",
    "top_max": "top [N]",
    "top_percent": "error [%]",
    "anchor_max": "anchor [N]",
    "anchor_percent": "error [%]",
    "T_min": "T min [N]",
    "failed_steps": "retried",
    "newton": "iterations",
}


def study(folder: Path, t_end: float) -> list[Table]:
    """All rows in one file, shown in two."""
    rows = evaluate_all(evaluate, cases(t_end), kept(folder, __file__), itemgetter("kind", "mu", "nu")) or []
    for row in rows:
        row["discretisation"] = f"{row['cells']} P{row['mu']}-P{row['nu']}"
        if "failed" not in row and row["kind"] == "snap":
            row |= {f"{end}_percent": round(100 * row[f"{end}_error"], 2) for end in ("top", "anchor")}
            row["T_min"] = round(row["T_min"], 1) + 0.0
    if not rows:
        return []
    folded, snaps = groups(rows, "kind").values()
    notes, title = in_words(folded, snaps), f"Snap loads: driven-slack, last {SNAP_COUNTS:g} s of {t_end:g} s"
    return [
        Table("slack", rows, notes=notes),
        Table("", folded, "Folded cable at rest, end at (0.01, 0, z)", FOLDED),
        Table("", snaps, title, SNAP, notes),
    ]


def in_words(folded: list[dict], snaps: list[dict]) -> list[str]:
    """What the rows show, in sentences made from their numbers."""
    notes = []
    pressed = [pair for pair in _pairs(folded) if pair[0]["T_min"] < 0]
    if pressed:
        gain = [two["r_L2"] / one["r_L2"] for two, one in pressed]
        notes.append(
            f"Folded: the two-sided law ends compressed in {len(pressed)} cases; there its error of r is "
            f"{min(gain):.2g} to {max(gain):.2g} times that of tension-only."
        )
    same = [(two, one) for two, one in _pairs(folded) if two["T_min"] >= 0]
    if same:
        difference = max(abs(two["r_L2"] - one["r_L2"]) for two, one in same)
        notes.append(f"Where it does not, the two laws agree: {len(same)} cases, difference {difference:.1g}.")
    for law in LAWS:
        good = [row for row in snaps if row["slack"] == law and "failed" not in row]
        for end in ("top", "anchor") if good else ():
            worst = max(good, key=lambda row: abs(row[f"{end}_error"]))
            where = f"{worst['discretisation']}, {worst['scheme']}, {worst['step']} s"
            notes.append(
                f"Snap, {law}: largest error at the {end} {100 * worst[f'{end}_error']:+.2g} % ({where}), smallest "
                f"tension {min(row['T_min'] for row in good) + 0.0:.0f} N."
            )
    notes += [f"{row['discretisation']}, {row['slack']}: {row['failed']}" for row in folded + snaps if "failed" in row]
    return notes


def _pairs(rows):
    """(two-sided, tension-only) rows of the same case."""
    key = lambda row: tuple(row.get(k) for k in ("z_end", "mu", "nu", "cells"))  # noqa: E731
    tables = [{key(row): row for row in rows if row["slack"] == law and "failed" not in row} for law in LAWS]
    return [(tables[0][k], tables[1][k]) for k in tables[0] if k in tables[1]]


def main(
    t_end: Annotated[float, typer.Option(min=15.0, help="End of the runs with snap loads [s].")] = 30.0,
    out: Path | None = None,
) -> None:
    """Compressed or slack: a folded cable and snap loads under both laws."""
    make("slack", study, out, t_end=t_end)


if __name__ == "__main__":
    start(main)
