"""The printable report of a run or a sweep: inputs, results, and whether the criteria are met."""

from __future__ import annotations

import base64
import io
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..check import derived
from ..errors import InputError
from ..model.varying import range_of_tide
from ..results import criteria as judging
from ..results.after_ramp import Missing, TooShort, scene_of
from ..results.record import fitting, read
from ..results.summary import summary, warnings
from ..results.tables import rounded, unit_of, years
from ..scene.floats import SOURCE as SOURCE_OF_FLOATS
from ..scene.floats import float_of
from ..scene.inputs import inputs_of
from ..scene.variants import SEED
from . import html
from .html import Markup, paragraphs, section, table, tag
from .run_page import worth

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..results.style import Figure
    from ..scene import Scene

#: Figures in the report of a run, in order, with captions; of several lines or buoys, for the governing one.
FIGURES = {
    "snapshot": "The system at the end of the run.",
    "tension": "Tension at both ends of the line.",
    "envelope": "Least, mean and largest tension along the line after the ramp.",
    "trajectory": "Path of the buoy's centre of mass C from above and from the side.",
    "heave": "Heights of C and of the water above it.",
    "cone_angle": "Lean of the buoy.",
    "curvature": "Curvature along the line.",
}
#: Most cases of a sweep that are listed, and most values of a varied key.
MOST_CASES, MOST_VALUES = 200, 12


def report_of(folder: Path) -> tuple[str, str]:
    """(kind of the result, HTML of its report) for the folder of a run or sweep.  Raises InputError."""
    if os.path.isfile(folder / "sweep.nc"):
        with fitting(folder / "sweep.nc"):
            return "sweep", of_sweep(read(folder / "sweep.nc"), folder)
    if not os.path.isfile(folder / "results.nc"):
        raise InputError(f"{folder} holds neither a run nor a sweep: there is no results.nc and no sweep.nc in it.")
    from ..results.paraview import read_run

    record, scene = read_run(folder)
    with fitting(folder / "results.nc"):
        return "run", of_run(record, scene)


def of_run(record: xr.Dataset, scene: Scene) -> str:
    """HTML of the report of a run."""
    judged = judging.governing(judging.verdicts(record, scene))
    warned = list(dict.fromkeys([*derived(scene).warnings, *warnings(record, scene)]))
    return html.page(
        scene.title or "Report of a run",
        [],
        _sheet(
            _revision(scene, record.attrs),
            _conclusion(scene, judged),
            html.warnings(warned),
            _inputs(scene, [("run", f"{_duration(scene)}, {_sea(scene)}")]),
            _criteria(judged),
            section("results", "Results", table(("quantity", "value", "unit"), summary(record, scene))),
            _figures(_of_run(record, scene)),
            worth(record, scene),
            _appendix(scene, record.attrs),
        ),
    )


def of_sweep(dataset: xr.Dataset, folder: Path) -> str:
    """HTML of the report of a sweep, with statistics of the cases that run beyond their ramp."""
    from ..results.sweep_figure import draw

    scene = scene_of(dataset)
    found = _statistics(folder)
    judged = [] if found is None else found[1]
    notes = [] if found is None else [line for line in found[0].attrs["notes"].split("\n") if line]
    done = int((dataset.status == "done").sum())
    failed = [f"{dataset.sizes['case'] - done} of {dataset.sizes['case']} cases have no result."]
    return html.page(
        dataset.attrs.get("title") or "Report of a sweep",
        [],
        _sheet(
            _revision(scene, dataset.attrs),
            _conclusion(scene, judged),
            html.warnings([*(failed if done < dataset.sizes["case"] else []), *derived(scene).warnings]),
            _inputs(scene, _cases(dataset), _varied(dataset)),
            _criteria(judged),
            None if found is None else _extremes(found[0], notes),
            _figures([("mean and range of every case", draw(dataset))]),
            section("settings", "Settings", table(("setting", "value"), _settings(scene))),
            _appendix(scene, dataset.attrs),
        ),
    )


# -- parts -------------------------------------------------------------------------------------------------------------


def _sheet(*parts: Markup | None) -> Markup:
    """All parts in one column."""
    return tag("div", *parts, class_="sheet")


def _revision(scene: Scene, attributes: dict[str, Any]) -> Markup:
    """Table of project, author, revision and date, and the program version."""
    named = [(name, getattr(scene, name)) for name in ("project", "author", "revision")]
    program = attributes.get("computed_by") or f"dolfbuoy {attributes.get('version_dolfbuoy', '')}".strip()
    rows = [(name, text) for name, text in [*named, ("computed", attributes.get("created", ""))] if text]
    return section("revision", "Report", table(("", ""), [*rows, ("program", program)]))


def _conclusion(scene: Scene, judged: list[judging.Verdict]) -> Markup:
    """Verdict on all criteria, and a sentence for each that is not met."""
    missed = judging.never_met(judged)
    if scene.criteria is None:
        said = ["No criteria were given: [criteria] in the scene names them."]
    elif not judged:
        said = ["The criteria were not judged: no case has numbers after its ramp, by this version of the program."]
    elif not missed:
        least = min(judged, key=lambda one: (one.use, one.margin))
        left = f"; {least.criterion} is the closest ({least.says})" if math.isfinite(least.use) else ""
        said = [f"All {len(judged)} criteria are met{left}."]
    else:
        said = [f"{len(missed)} of {len(judged)} criteria are not met.", *missed]
    return section("conclusion", "Conclusion", paragraphs(said))


def _criteria(judged: list[judging.Verdict]) -> Markup | None:
    rows = [one.row() for one in judged]
    return section("criteria", "Criteria", table(judging.HEADINGS, rows)) if rows else None


def _inputs(scene: Scene, cases: Iterable[tuple[str, str]], varied: Mapping[str, str] | None = None) -> Markup:
    """The scene in words, its values, sources of its materials, and load cases; varied: key -> its values."""
    others = dict(varied or {})
    seeds = others.pop(SEED, "") if scene.waves is not None and scene.waves.irregular else ""  # shown with the sea
    over = "; ".join(f"{key} {values}" for key, values in others.items())
    said = [f"Over the cases vary {over}; elsewhere stand those of the scene that they begin from."] if over else []
    values = [row for row in inputs_of(scene) if row.section != "criteria"]
    sources = [(name, m.source) for name, m in (scene.material or {}).items() if m.source]
    floats = dict.fromkeys(filter(None, map(float_of, scene.network.bodies.values())))
    sources += [(name, SOURCE_OF_FLOATS) for name in floats]
    return section(
        "inputs",
        "Inputs",
        paragraphs([*in_words(scene, seeds), *said]),
        tag("h3", "Load cases"),
        table(("case", "load"), cases),
        tag("h3", "Values"),
        table(("section", "what", "value", "unit"), values),
        *([tag("h3", "Sources"), table(("material or float", "source"), sources)] if sources else []),
    )


def in_words(scene: Scene, seeds: str = "") -> list[str]:
    """Sentences that describe a scene: lines, buoys, water, wind; seeds: shown instead of its own."""
    network, found = scene.network, []
    water = f"{scene.sea.depth:g} m of water" if scene.sea else "air"
    bed = ", lying on the sea bed where it touches it" if scene.seabed else ""
    for number, name in enumerate(network.cables):
        sections = network.sections_of(number)
        low, high = network.ends_of(number)
        length = sum(one.length for one in sections)
        made = f" in {len(sections)} segments" if len(sections) > 1 else ""
        called = f"Line {name}" if len(network.cables) > 1 else "Line"
        found.append(f"{called}: {length:g} m{made}, from {low} to {high}, in {water}{bed}.")
    for name, buoy in network.buoys.items():
        mass = buoy.mass + sum(point.mass for point in buoy.point_masses)
        found.append(f"{f'Buoy {name}' if len(network.buoys) > 1 else 'Buoy'}: {mass:g} kg.")
    return [*found, f"Loads: {', '.join(dict.fromkeys([_sea(scene, seeds), *_pushes(scene)]))}."]


def _pushes(scene: Scene) -> Iterator[str]:
    """Wind and external force on each buoy in words."""
    for buoy in scene.network.buoys.values():
        if wind := buoy.wind:
            gusts = " with gusts" if wind.gusts else ""
            yield f"wind of {wind.speed_10m:g} m/s 10 m above the water{gusts}{_changes(wind)}"
        if force := buoy.external_force:
            yield f"a force of {np.linalg.norm(force.force):g} N{_changes(force)}"


def _changes(load: Any) -> str:
    return ", changing over time" if load.over_time else ""


def _sea(scene: Scene, seeds: str = "") -> str:
    """Waves and current in words."""
    waves, current, parts = scene.waves, scene.current, []
    if waves is None:
        parts.append("no waves")
    elif waves.irregular:
        height = f" of Hs = {waves.significant_height:g} m" if waves.significant_height else ""
        parts.append(f"an irregular sea{height}, period {waves.main_period:.4g} s{_chance(waves, seeds)}")
    else:
        parts.append(f"regular waves of {2 * waves.size:g} m and {waves.main_period:g} s")
    if current is not None:
        speed = "by depth" if current.speed is None else f"of {current.speed:g} m/s"
        towards = "and time" if current.grid else f"towards {current.direction_deg:g} degrees"
        parts.append(f"a current {speed} {towards}{_changes(current)}")
    if scene.sea is not None and scene.sea.tide is not None:
        parts.append(f"a tide of {np.subtract(*range_of_tide(scene)[::-1]):.3g} m")
    return ", ".join(parts)


def _chance(waves: Any, seeds: str) -> str:
    """The seeds of a sea in words; a sea given by components has none."""
    if seeds:
        return f", seeds {seeds}"
    return f", seed {waves.seed}" if waves.spectrum is not None else ""


def _duration(scene: Scene) -> str:
    return f"{scene.time.end:g} s" if scene.time else ""


def _cases(dataset: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Each case of a sweep: its changes, and how it ended."""
    keys = dataset.attrs["varied"].split(", ")
    for i in range(min(dataset.sizes["case"], MOST_CASES)):
        one = dataset.isel(case=i)
        varied = ", ".join(f"{key} = {one[key.replace('.', '_')].item()}" for key in keys)
        left = one.criterion_left.item() if "criterion_left" in one else math.nan
        size = f"{rounded(abs(left))} % {'left' if left >= 0 else 'missing'}"
        word = "" if math.isnan(left) else f"; {one.criterion.item()}: {size}"
        if "shortest_life" in one and not np.isnan(one.shortest_life):
            word += f"; life {years(one.shortest_life.item())} years, {one.shortest_life_of.item()}"
        yield str(i + 1), f"{varied} ({one.status.item()}{word})"
    if dataset.sizes["case"] > MOST_CASES:
        yield "...", f"and {dataset.sizes['case'] - MOST_CASES} more"


def _varied(dataset: xr.Dataset) -> dict[str, str]:
    """The varied keys of a sweep and their values; for many numbers, their range and count."""
    found = {}
    for key in dataset.attrs["varied"].split(", "):
        values = list(dict.fromkeys(dataset[key.replace(".", "_")].values.tolist()))
        if len(values) <= MOST_VALUES or isinstance(values[0], str):
            found[key] = ", ".join(map(str, values[:MOST_VALUES])) + (", ..." if len(values) > MOST_VALUES else "")
        else:
            found[key] = f"{min(values):g} to {max(values):g} ({len(values)} values)"
    return found


def _statistics(folder: Path) -> tuple[xr.Dataset, list[judging.Verdict]] | None:
    """Statistics of all cases together, and the governing verdicts; None if no case ran beyond its ramp."""
    from ..results.sample import Fatigue
    from ..results.statistics import runs_of, together

    try:
        runs = runs_of([folder])
    except InputError:
        return None
    return together(runs, Fatigue()), judging.governing(judging.over_cases((run.name, run.sample) for run in runs))


def _extremes(found: xr.Dataset, notes: list[str]) -> Markup:
    """Table of the extremes of every quantity over all cases, with the most probable maximum of a set."""
    from ..results.quantities import declared, shown_in
    from ..results.sample import LASTS
    from ..results.series import LASTING, each_series

    rows = []
    for label, name, one in each_series(found, "mean", shown_in("statistics")):
        low, high = (one[f"{name}_{word}"].values for word in ("minimum", "maximum"))
        if not np.isfinite(high).any():
            continue
        unit, factor = unit_of([low, high], one[f"{name}_mean"].attrs["units"])
        least_counts = declared(name).counts == "minimum"
        case = str(one.run.values[int(np.nanargmin(low) if least_counts else np.nanargmax(high))])
        known = f"{name}_most_probable" in one and not least_counts
        probable = one[f"{name}_most_probable"].values[:, 0] if known else np.array([np.nan])
        lasting = one[f"{name}_{LASTS}"].values if f"{name}_{LASTS}" in one else np.array([np.nan])
        numbers = [_largest(factor * x) for x in (lasting, probable)]
        least = rounded(factor * float(np.nanmin(low)), 4)
        label = f"{label.replace('_', ' ')} [{unit}]" if unit != "1" else label.replace("_", " ")
        rows.append((label, least, _largest(factor * high), *numbers, case))
    heading = ("quantity", "least", "largest", f"for {LASTING:g} s", "probable maximum of 3 h", "governed by")
    return section("extremes", "Extremes after the ramp", table(heading, rows), paragraphs(notes))


def _largest(values: NDArray[Any]) -> str:
    """The largest finite value, to four digits; empty if there is none."""
    return rounded(float(np.nanmax(values)), 4) if np.isfinite(values).any() else ""


def _settings(scene: Scene) -> list[tuple[str, str]]:
    from ..scene.sections import SCHEMES

    time = scene.time
    return [("scheme", SCHEMES[time.scheme]), ("step", f"{time.step:g} s")] if time else []


def _of_run(record: xr.Dataset, scene: Scene) -> Iterator[tuple[str, Figure]]:
    """(caption, figure) for every figure that a run has data for."""
    from ..results import figures  # noqa: F401  # which register themselves
    from ..results.parts import names_of
    from ..results.style import FIGURES as KNOWN

    for name, caption in FIGURES.items():
        if (draw := KNOWN.get(name)) is None:
            continue
        part = _governing(record, draw.part, names_of(record, draw.part)) if draw.part else None
        try:
            figure = draw(record, scene, **({draw.part: part} if part else {}))
        except (Missing, TooShort):
            continue
        several = draw.part is not None and len(names_of(record, draw.part)) > 1
        yield f"{caption[:-1]}: {part}." if several else caption, figure


def _governing(record: xr.Dataset, kind: str, names: list[str]) -> str | None:
    """The line with the largest tension, or the buoy that leans most; the first if the record has neither."""
    values = record.get({"cable": "tension_top", "buoy": "cone_angle"}.get(kind, ""))
    if values is None or len(names) < 2:
        return next(iter(names), None)
    return names[int(np.nanargmax(np.nan_to_num(values.max("time").values, nan=-np.inf)))]


def _figures(every: Iterable[tuple[str, Figure]]) -> Markup:
    """Figures as images in the page, with captions."""
    shown = []
    for words, figure in every:
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=150)
        source = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
        image = tag("img", src=source, alt=words).removesuffix("</img>")
        shown.append(tag("figure", Markup(image), tag("figcaption", words)))
    return section("figures", "Figures", *shown)


def _appendix(scene: Scene, attributes: dict[str, Any]) -> Markup:
    """Versions, and the scene that reproduces the result (common to all cases of a sweep)."""
    scene_of_it = html.scene(scene.to_toml(), common="varied" in attributes)
    return tag("div", html.versions(attributes), scene_of_it, class_="grid")
