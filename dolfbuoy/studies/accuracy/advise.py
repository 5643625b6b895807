"""Cheapest settings that meet an accuracy: pilot on a shortened run, prediction, and verification."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...results import measured as acc
from ...results.compare import Curve, percent
from ...results.measured import QUANTITIES
from ...results.style import COLORS, PAGE, PALETTE, STYLE, Figure, matplotlib, new_figure, plain_ticks
from ...results.tables import groups, rounded, show
from ...scene import Scene, settings
from ...scene.sections import SCHEMES
from ...scene.settings import Stepping
from .. import sea
from ..study import Row, Table, save
from .cheapest import COLUMNS, Verified, cheapest
from .pilot import ALPHA, Candidate, Pilot

#: Fraction of the accuracy that a prediction may use.
TARGET = 0.7


@dataclass
class Advice:
    """A scene with advised settings, the prediction, and the measurements of the verification."""

    scene: Scene
    choice: Candidate
    measured: float
    candidates: list[Candidate]
    pilot: Pilot
    notes: list[str]


def advise(scene: Scene, quantity: str, accuracy: float, say: Callable[..., object] = print, tries: int = 3) -> Advice:
    """Find and verify settings.  Raises InputError, and SolveError if no settings can be recommended."""
    acc.check_quantity(scene, quantity)
    pilot = Pilot(scene, quantity, accuracy, say)
    part, whole = (s.time.end if s.time else 0.0 for s in (pilot.scene, scene))
    say(f"Pilot until t = {part:g} s of {whole:g} s; errors count from {pilot.start:g} s.")
    pilot.measure_time()
    families = {
        SCHEMES[name] + (" adaptive" if adaptive else ""): c for (name, adaptive), c in pilot.time_curves.items()
    }
    say(f"Errors in time: {pilot.mesh}{_orders(families)}.")
    pilot.measure_space()
    if pilot.mesh.mu:
        pairs = {f"P{mu}-P{nu}": curve for (mu, nu), curve in pilot.space_curves.items()}
        say(f"Errors in space: dt {pilot.step:.4g} s, {_orders(pairs)}.")
    pilot.measure_newton()
    words = f"error {percent(pilot.of_newton)}, {pilot.work_of_newton:.2g} of the work with {settings.NEWTON:g}"
    say(f"Newton's tolerance {pilot.newton:g}: {words}.")
    return verified(pilot, tries)


def verified(pilot: Pilot, tries: int) -> Advice:
    """The cheapest candidate that meets its prediction; after a failure the target shrinks by the excess."""
    from .linear_answer import linear_answer  # 0.1 s of every start

    truth_at = (pilot.best, Stepping(ALPHA, pilot.finest))
    truth, own = pilot.run(*truth_at), pilot.own_time + pilot.own_space
    if truth is None:
        raise SolveError("The run that the advice would be verified against fails.")
    notes = [f"Verified against {truth_at[0]}{truth_at[1]}, whose own error is {percent(own)}."]
    linear = linear_answer(pilot.scene, truth, pilot.quantity, pilot.start)
    notes += [f"For screening, the {linear}"] if linear else []
    target, refused = TARGET * pilot.accuracy, set()
    for _ in range(tries):
        candidates = [c for c in pilot.candidates(target) if str(c) not in refused]
        if not candidates:
            break
        choice = candidates[0]
        run = pilot.run(choice.space, choice.stepping)
        measured = pilot.difference(run, truth) if run else math.inf
        if measured + own <= pilot.accuracy:
            settled = settings.with_settings(pilot.whole, choice.space, choice.stepping)
            return Advice(settled, choice, measured, candidates, pilot, notes)
        missed = f"with {percent(measured)} and the reference's own {percent(own)}" if run else "it fails"
        notes.append(f"{choice} does not keep the promise: {missed}; the next safer settings are taken.")
        pilot.say(notes[-1])
        refused.add(str(choice))
        target *= min(max(0.8 * choice.error / measured, 0.3), 0.8)
    raise SolveError(f"No settings of the pilot keep {percent(pilot.accuracy)} in {QUANTITIES[pilot.quantity]}.")


def _orders(curves: dict[str, Curve]) -> str:
    return ", ".join(f"{name} order {curve.order:.2g}" for name, curve in curves.items() if len(curve.x) > 1)


def advise_all(
    scene: Scene,
    quantity: str,
    accuracy: float,
    say: Callable[..., object] = print,
    comm: Any = MPI.COMM_WORLD,
    of: list[str] | None = None,
) -> Advice | Verified | Scene:
    """Advice on rank 0, the advised scene alone on the others: only rank 0 runs the pilot.

    of: outputs such as tension_top.max, instead of the quantity.
    """
    found: Any = None
    if comm.rank == 0:
        try:
            found = cheapest(scene, of, accuracy, say) if of else advise(scene, quantity, accuracy, say)
        except (InputError, SolveError) as error:
            found = error
    shared = comm.bcast(getattr(found, "scene", found))
    if isinstance(shared, Exception):
        raise shared
    result: Advice | Verified | Scene = found if comm.rank == 0 else shared
    return result


def sentences(advice: Advice) -> list[str]:
    """The advice in words."""
    pilot, choice = advice.pilot, advice.choice
    end = pilot.whole.time.end if pilot.whole.time else 0.0
    what = f"{percent(pilot.accuracy)} in {QUANTITIES[pilot.quantity]}"
    own = (settings.space_of(pilot.whole), settings.stepping_of(pilot.whole))
    messages = [
        f"{what}: {choice}: about {rounded(choice.seconds)} s for the run until t = {end:g} s.",
        f"Predicted {percent(choice.error)}, measured {percent(advice.measured)} in the pilot.",
        *advice.notes,
    ]
    if own != (choice.space, choice.stepping):
        error = pilot.predicted(*own)
        known = f": {percent(error)} predicted" if math.isfinite(error) else ""
        messages.append(f"The scene's own setting, {own[0]}{own[1]}{known}.")
    if sea.has_seeds(pilot.whole):
        messages += [sea.of_components(pilot.whole, 0.01), sea.of_statistics(pilot.whole, choice.seconds)]
    if not settings.period_of(pilot.whole):
        messages.append("Nothing periodic drives this scene: errors of phase may grow after the end of the pilot.")
    return messages


def table_rows(advice: Advice) -> list[Row]:
    """The cheapest candidate of each pair and each way of stepping, cheapest first."""
    rows: list[Row] = []
    seen: set[object] = set()
    for c in advice.candidates:
        kinds = {c.space.pair, (c.stepping.scheme, c.stepping.tolerance is None)}
        if kinds <= seen:
            continue
        seen |= kinds
        row = {"settings": str(c), "pair": c.space.pair, "cells": c.space.cells, "scheme": c.stepping.scheme}
        row |= {"step": None if c.stepping.tolerance else c.stepping.step, "tolerance": c.stepping.tolerance}
        row |= {"newton": c.stepping.newton}
        row |= {"predicted_percent": 100 * c.error, "predicted_seconds": c.seconds}
        rows.append(row | {"remark": "extrap." if c.extrapolated else ""})
    rows[0]["remark"] = "advised"
    return rows


def report(advice: Advice, folder: Path | None) -> None:
    """Print the advice; save table, measurements and figure in `folder`."""
    rows, messages = table_rows(advice), sentences(advice)
    show("Cheapest settings that are predicted to meet it", rows, COLUMNS, messages)
    if folder is not None:
        with matplotlib.rc_context(STYLE):
            save(folder, Table("advise", rows, notes=messages, figure=draw(advice)))
        save(folder, Table("advise-pilot", advice.pilot.rows))


def draw(advice: Advice) -> Figure:
    """Errors of the pilot: in time over the loop's computing time, in space over the cells; accuracy as a line."""
    pilot = advice.pilot
    figure = new_figure(PAGE, 3.4)
    left, right = figure.subplots(1, 2)
    _lines(left, pilot, "time", lambda row: SCHEMES[row["scheme"]] + (" adaptive" if row.get("tolerance") else ""))
    _lines(right, pilot, "space", lambda row: row["pair"])
    left.set(title=f"in time, {str(pilot.mesh).strip(', ')}", xlabel="steps of the pilot")
    right.set(title="in space", xlabel="elements")
    left.set_ylabel(f"error of {QUANTITIES[pilot.quantity]} [%]")
    return figure


def _lines(axes: Any, pilot: Pilot, kind: str, label: Callable[[Row], str]) -> None:
    axes.set(xscale="log", yscale="log")
    lines = groups([row | {"label": label(row)} for row in pilot.rows if row["error_in"] == kind], "label")
    for (name, rows), color in zip(lines.items(), PALETTE, strict=False):
        x = [row["steps" if kind == "time" else "cells"] for row in rows]
        style = "o--" if "adaptive" in name else "o-"
        axes.plot(x, [row["error_percent"] for row in rows], style, color=color, ms=3, label=name)
    axes.axhline(100 * pilot.accuracy, color=COLORS["ink"], lw=0.8, ls=":")
    plain_ticks(axes)
    if lines:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncol=2)
