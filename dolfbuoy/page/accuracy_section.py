"""Accuracy of the numbers of a run: scheme, step, what is left of each period, and an error if one is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..check import check, derived
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..results.bars import rows_of
from ..results.summary import remaining_amplitude
from ..scene.sections import SCHEMES
from ..scene.settings import period_of
from .html import Markup, paragraphs, section, table, tag

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene


def worth(record: xr.Dataset, scene: Scene) -> Markup:
    """The section: settings, what the scheme leaves of free motions, and error bars if they were estimated."""
    rows = [
        (f"{r.part}: {r.name}" if r.part else r.name, r.value, r.bar, r.step, r.mesh, r.unit, r.verdict, r.chance)
        for r in rows_of(record)
    ]
    unknown = (
        "The error of this run is not known: dolfbuoy run SCENE --bars estimates it, dolfbuoy advise SCENE measures "
        "what its settings leave of an accuracy, and dolfbuoy study work-precision SCENE draws error over time."
    )
    known = [record.attrs["bar_says"]] if record.attrs.get("bar_says") else [] if rows else [unknown]
    return section(
        "worth",
        "What these numbers are worth",
        table(("setting", "value"), settings_of(record, scene)),
        _periods(scene),
        tag("h3", "Error"),
        paragraphs(known),
        table(("output", "value", "+-", "step", "mesh", "unit", "verdict", "scatter over seeds"), rows)
        if rows
        else None,
    )


def settings_of(record: xr.Dataset, scene: Scene) -> list[tuple[str, str]]:
    """Name and value of each setting with which it was computed."""
    time, steps = scene.time, record.time_step.values[1:]
    if time is None:  # no run has none
        return []
    step = f"{time.step:g} s" if time.tolerance is None else f"adaptive, local error {time.tolerance:g}"
    if time.tolerance is not None and len(steps):
        step += f": {steps.min():.3g} ... {steps.max():.3g} s"
    rows = [("scheme", SCHEMES[time.scheme]), ("step", step)]
    period = period_of(scene)
    if period is not None and time.tolerance is None:
        rows.append(("steps in a period of the drive", f"{period / time.step:.4g}"))
    elements = [str(piece.section.elements) for piece in scene.network.pieces]
    if elements:
        first = scene.network.pieces[0].section
        rows.append(("elements", f"P{first.position_degree}-P{first.tension_degree}, {_counted(elements)}"))
    rows.append(("unknowns", str(record.attrs["unknowns"])))
    if len(steps):
        rows.append(("Newton iterations in a step", f"{float(record.newton_iterations[1:].mean()):.3g}"))
    failed = int(record.attrs.get("failed_steps", 0))
    rows.append(("steps that failed and were retried", str(failed)))
    return rows


def _counted(elements: list[str]) -> str:
    """`20` or `3 x 20` or `64 + 20 + 30`."""
    if len(set(elements)) == 1:
        return elements[0] if len(elements) == 1 else f"{len(elements)} x {elements[0]}"
    return " + ".join(elements)


def _periods(scene: Scene) -> Markup | None:
    """Table of the part of a free motion's amplitude that the scheme leaves."""
    try:
        periods = check(scene, MPI.COMM_SELF).periods  # a page is written by one rank
    except (InputError, SolveError):  # without its equilibrium
        periods = derived(scene).periods
    if not periods or scene.time is None or not scene.time.end:
        return None
    rows = [(name, f"{T:.5g}", f"{100 * remaining_amplitude(T, scene):.3g} %") for name, T in periods.items()]
    caption = "What the scheme at its step leaves of the amplitude of a free motion, to the end of the run"
    return table(("period", "s", "left"), rows, caption)
