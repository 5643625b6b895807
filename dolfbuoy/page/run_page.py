"""The page of a run: replay, series, envelope, track, spectra, tables, and the accuracy of the numbers."""

from __future__ import annotations

import math
import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from ..check import check, derived
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..results.after_ramp import scene_of
from ..results.attitude import length
from ..results.bars import extremes, number_with, rows_of
from ..results.criteria import HEADINGS, governing, verdicts
from ..results.elasticities import columns_of_run, order_of, percent, value_of
from ..results.frame import Frames
from ..results.parts import parts_of
from ..results.summary import exceeded, remaining_amplitude, summary, warnings
from ..results.tables import unit_of
from ..results.trajectories import pushes
from ..scene import load_scene
from ..scene.inputs import inputs_of
from ..scene.sections import SCHEMES
from ..scene.settings import period_of
from . import html
from .html import Markup, fragment, paragraphs, section, table, tag
from .pack import chosen_rows, exact
from .series import columns_of, envelopes, panels, rows_that_fit, spectra
from .view import view_of

if TYPE_CHECKING:
    import xarray as xr

    from ..results.parts import Part
    from ..scene.sections import Scene
    from .html import Markup


def run_page(
    record: xr.Dataset, scene: Scene | None = None, case: str | None = None, slopes: xr.Dataset | None = None
) -> str:
    """HTML of the record of a run; case: changes in a sweep; slopes: result of `sensitivity` for the same scene.

    Raises InputError for a record without a scene.
    """
    scene = scene or scene_of(record)
    found, count, scheme = data_of(record, scene), record.sizes["time"], scene.time.scheme if scene.time else ""
    steps = f"{float(record.time[-1]):g} s in {count - 1:,} steps of {SCHEMES[scheme]}"
    made = f"dolfbuoy {record.attrs.get('version_dolfbuoy', '')}, {record.attrs.get('created', '')}"
    thinned = f"Series are drawn with {found['kept']:,} of {count:,} instants, all peaks among them; tables are of all."
    matters = html.table(("quantity", "value", "unit"), summary(record, scene))
    return html.page(
        scene.title or "Run",
        [*([f"case {case}"] if case else []), f"{steps}; {made}"],
        html.warnings(list(dict.fromkeys([*derived(scene).warnings, *warnings(record, scene)]))),
        inputs(scene, record.attrs.get("effects", "")),
        _keys(found["moments"]),
        fragment("stage", note="" if found["kept"] == found["every"] else thinned),
        fragment("series"),
        tag(
            "div",
            html.section("matters", "What matters", matters),
            criteria(record, scene),
            worth(record, scene),
            None if slopes is None else movers(slopes, scene),
            tag("div", html.scene(scene.to_toml()), html.versions(record.attrs), class_="wide"),
            class_="grid",
        ),
        data=found,
        script="run",
    )


def inputs(scene: Scene, effects: str) -> Markup:
    """The section of values of the scene that differ from their defaults, and of compiled effects."""
    rows = inputs_of(scene)
    folded = tag(
        "details",
        tag("summary", f"{len(rows)} values that differ from their defaults"),
        table(("section", "what", "value", "unit"), rows),
    )
    return section("inputs", "Inputs", folded, paragraphs([f"Effects: {effects}"] if effects else []))


def criteria(record: xr.Dataset, scene: Scene) -> Markup | None:
    """The section of criteria, with the governing part of each; None without criteria."""
    judged = governing(verdicts(record, scene))
    return section("criteria", "Criteria", table(HEADINGS, [one.row() for one in judged])) if judged else None


def data_of(record: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """Data for the script of a run's page."""
    frames, parts = Frames(record, scene), parts_of(record, "cable", "buoy")
    columns = columns_of([*parts, *parts_of(record, "take_off", "winch", "vessel")])
    main = [line.values for *_, curves in columns for line in curves]
    count = rows_that_fit(record, parts, columns)
    rows = chosen_rows(main, count) if main else np.arange(record.sizes["time"])
    headings, buoys = dict[str, list[float]](), scene.network.buoys
    for name in buoys or [None]:
        for what, direction in pushes(scene, name).items():
            own = what in ("wind", "force") and len(buoys) > 1
            headings[f"{what} on {name}" if own else what] = direction.tolist()
    return {
        "kind": "run",
        "time": exact(record.time.values[rows]),
        "kept": len(rows),
        "every": record.sizes["time"],
        "period": period_of(scene),
        "panels": panels(columns, rows),
        "moments": moments(record, parts),
        "envelopes": envelopes(parts, scene),
        "spectra": spectra(parts, scene),
        "view": view_of(frames, rows),
        "headings": list(headings.items()),  # directions [x, y] of waves, current, and wind and force on each buoy
        "anchors": frames.at(frames.times[0]).x[[span.node.start for span in frames.spans], :2].tolist(),
    }


#: Key figures: label, kind of part, required quantity, output with its error bar (empty: none), unit, and function that
#: computes it from the record of a part.
LARGEST = (
    ("largest tension, upper end", "line", "tension_top", "tension_top", "N", lambda part: part.tension_top.values),
    (
        "largest force at a lower end",
        "line",
        "anchor_force",
        "anchor",
        "N",
        lambda part: length(part.anchor_force.values),
    ),
    (
        "farthest from the start",
        "buoy",
        "buoy_position",
        "",
        "m",
        lambda part: np.linalg.norm((part.buoy_position.values - part.buoy_position.values[0])[:, :2], axis=1),
    ),
    ("largest lean", "buoy", "cone_angle", "cone_angle", "deg", lambda part: part.cone_angle.values),
)


def moments(record: xr.Dataset, parts: list[Part]) -> list[dict[str, Any]]:
    """The largest value of each key figure over all parts, and its time, to which the replay can jump.
    With its error bar if estimated and, for forces, the lasting level."""
    found = []
    for label, kind, quantity, output, unit, series in LARGEST:
        able = [(name, part, series(part)) for name, part in parts if quantity in part]
        if not able:
            continue
        name, part, values = max(able, key=lambda one: np.nanmax(one[2]))
        row = int(np.nanargmax(values))
        shown, factor = unit_of(values, unit)
        estimated, bar = extremes(part).get(output, {}).get("max", (math.nan, math.nan))
        known = abs(estimated - values[row]) <= bar + 1e-9 * abs(estimated)  # else the largest is in the ramp
        value, error = number_with(factor * values[row], factor * bar if known else math.nan)
        moment: dict[str, Any] = {"label": f"{name}: {label}" if name else label, "value": value}
        moment["bar"] = f" ± {error}" if error else ""
        below = exceeded(record, values) if unit == "N" else []
        moment["lasting"] = [f"{what}: {level} {of}" for what, level, of in below]
        found.append(moment | {"unit": shown, "t": float(record.time[row]), "part": name, "kind": kind})
    return found


def _keys(moments: list[dict[str, Any]]) -> Markup | None:
    """Key figures as buttons that show their instant."""
    items = [
        tag(
            "button",
            tag("span", moment["label"], class_="what"),
            tag("span", moment["value"], tag("small", f"{moment['bar']} {moment['unit']}"), class_="number"),
            *(tag("span", words, class_="what") for words in moment["lasting"]),
            tag("span", f"at {moment['t']:.4g} s", class_="when"),
            type="button",
            data_t=repr(moment["t"]),
            data_kind=moment["kind"],
            data_part=moment["part"],
        )
        for moment in moments
    ]
    label = "Largest values; each shows its moment"
    return tag("div", *items, class_="keys", role="group", aria_label=label) if items else None


def movers(slopes: xr.Dataset, scene: Scene) -> Markup | None:
    """The section of elasticities of outputs, largest first, with bars; None for results other than a run's."""
    if "elasticity" not in slopes:
        return None
    computed = (load_scene(one, accuracy=None, title="") for one in (tomllib.loads(slopes.attrs["scene"]), scene))
    if len({one.to_toml() for one in computed}) > 1:
        hint = "sensitivity.nc in this folder is of another scene; dolfbuoy sensitivity computes it again."
        return section("movers", "What moves the answer", tag("p", hint))
    columns = columns_of_run(slopes, asked=False) or columns_of_run(slopes, asked=True)
    largest = max((abs(x) for one in columns.values() for x in one if np.isfinite(x)), default=0.0) or 1.0
    rows = [
        (
            slopes.parameter.values[k],
            value_of(slopes, k),
            *(Markup(_bar(x[k] / largest) + percent(x[k])) for x in columns.values()),
        )
        for k in order_of(slopes, columns)
    ]
    caption = "Change in per cent for one per cent of each number, largest values after the ramp"
    return section("movers", "What moves the answer", table(("number", "value", *columns), rows, caption))


def _bar(share: float) -> Markup:
    """A bar to the left or right, with length relative to the largest."""
    width = 30 * min(1.0, abs(share)) if np.isfinite(share) else 0.0
    rect = tag("rect", x=30 - width if share < 0 else 30, y=1, width=f"{width:.2f}", height=8, fill="currentColor")
    return tag("svg", rect, viewBox="0 0 60 10", width=60, height=10, aria_hidden="true")


def worth(record: xr.Dataset, scene: Scene) -> Markup:
    """The section of settings, amplitudes left by the scheme, and error bars if estimated."""
    rows = [
        (f"{r.part}: {r.name}" if r.part else r.name, r.value, r.bar, r.step, r.mesh, r.unit, r.verdict, r.chance)
        for r in rows_of(record)
    ]
    bars, advise, study = (
        tag("code", f"dolfbuoy {text}") for text in ("run SCENE --bars", "advise SCENE", "study work-precision SCENE")
    )
    unknown = Markup(
        f"The error of this run is not known: {bars} estimates it, {advise} measures what its settings leave of an "
        f"accuracy, and {study} draws error over time."
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
    """Name and value of each setting of the computation."""
    time, steps = scene.time, record.time_step.values[1:]
    if time is None:  # not a run
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
        first, alike = scene.network.pieces[0].section, len(elements) > 1 and len(set(elements)) == 1
        counted = f"{len(elements)} x {elements[0]}" if alike else " + ".join(elements)
        rows.append(("elements", f"P{first.position_degree}-P{first.tension_degree}, {counted}"))
    rows.append(("unknowns", str(record.attrs["unknowns"])))
    if len(steps):
        rows.append(("Newton iterations in a step", f"{float(record.newton_iterations[1:].mean()):.3g}"))
    failed = int(record.attrs.get("failed_steps", 0))
    rows.append(("steps that failed and were retried", str(failed)))
    return rows


def _periods(scene: Scene) -> Markup | None:
    """Table of the fractions of free motions' amplitudes left by the scheme."""
    try:
        periods = check(scene, MPI.COMM_SELF).periods  # one rank writes a page
    except (InputError, SolveError):  # without its equilibrium
        periods = derived(scene).periods
    if not periods or scene.time is None or not scene.time.end:
        return None
    rows = [(name, f"{T:.5g}", f"{100 * remaining_amplitude(T, scene):.1f} %") for name, T in periods.items()]
    caption = "What the scheme at its step leaves of the amplitude of a free motion, to the end of the run"
    return table(("period", "s", "left"), rows, caption)
