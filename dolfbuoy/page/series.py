"""Series of a run as panels of curves, those of a spectrum, of the lines, and of the track from above."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.after_ramp import TooShort, spectra_of, window_of
from ..results.places import AT
from ..results.quantities import QUANTITIES
from ..results.running import envelope_of
from ..results.series import unwrapped
from ..results.tables import force_unit
from .pack import single

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..results.parts import Part
    from ..scene.sections import Scene

#: Rows of the part of the file that holds series: about so many bytes of text.
MOST_OF_SERIES = 1_250_000


#: Kinds of parts whose panels are chosen together, by dimension; devices are all shown.
KINDS = {"buoy": "buoy", "take_off": "device", "winch": "device", "vessel": "device"}


class Panel(dict[str, Any]):
    """A chart over time: {part, title, unit, factor, curves: [{name, values}]}; part: the cable or buoy it is of."""


def columns_of(parts: list[Part]) -> list[tuple[Any, ...]]:
    """(part, kind, title, unit, factor, [(name, values of all rows), ...]) of every panel of a record's parts."""
    found = []
    for name, record in parts:
        for title, (kind, unit, curves) in _panels_of(record).items():
            if unit == "N":
                found.append((name, kind, title, *force_unit([values.max() for _, values in curves]), curves))
            else:
                found += [(name, kind, *panel) for panel in _split(title, unit, curves)]
    return found


def _panels_of(record: xr.Dataset) -> dict[str, tuple[str, str, list[tuple[Any, ...]]]]:
    """Title -> (kind, unit, curves) of what a part of a record has, as it is declared."""
    found: dict[str, tuple[str, str, list[tuple[Any, ...]]]] = {}
    for quantity in QUANTITIES.values():
        for curve in quantity.curves if quantity.name in record else ():
            values = unwrapped(record, quantity.name)
            if quantity.kind == "place":
                found[curve.panel] = "line", quantity.unit, list(_at_places(record.place.values, values))
                continue
            if curve.component:
                values = values[:, "xyz".index(curve.component)]
            kind, unit = (
                KINDS.get(quantity.kind, "line"),
                "1/m" if quantity.unit == "m-1" else quantity.unit.replace("degree", "deg"),
            )
            found.setdefault(curve.panel, (kind, unit, []))[2].append((curve.name, values))
    return found


#: Curves of places in one panel.
MOST_PLACES = 6


def _at_places(names: NDArray[Any], values: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """(place, its tension) of those places whose tension varies most."""
    for k in sorted(np.argsort(-np.ptp(values, axis=0), kind="stable")[:MOST_PLACES]):
        segment, _, where = str(names[k]).partition(AT)
        yield f"{segment.partition('.')[2]} {where}".strip(), values[:, k]


#: Curves share an axis unless together they span so many times what the widest of the first spans.
APART = 3.0


def _fit(first: list[tuple[str, NDArray[Any]]], *others: Any) -> Any:
    """True if curves can be distinguished on one axis with the first ones."""
    spans = [values for _, values in (*first, *others)]
    whole = max(values.max() for values in spans) - min(values.min() for values in spans)
    return whole <= APART * max(np.ptp(values) for _, values in first)


def _split(title: str, unit: str, curves: list[Any]) -> list[tuple[str, str, float, list[Any]]]:
    """Panels of curves: one, unless one axis would hide some of them.

    Of x and y each then has its own; of the turns, the yaw.
    """
    if title == "horizontal position of C" and not _fit(curves):
        return [(f"{name} of C", unit, 1.0, [(name, values)]) for name, values in curves]
    if title == "angle" and not _fit(curves[:2], *curves[2:]):
        return [(title, unit, 1.0, curves[:2]), ("yaw", unit, 1.0, curves[2:])]
    return [(title, unit, 1.0, curves)]


def rows_that_fit(record: xr.Dataset, parts: list[Part], columns: list[tuple[Any, ...]]) -> int:
    """Number of instants there is room for."""
    bodies = sum("buoy_position" in part.record for part in parts)
    forces = sum(int(np.prod(record[name].shape[1:])) for name in ("mooring_force", "anchor_force") if name in record)
    width = 8 + 4 * sum(len(curves) for *_, curves in columns) + 14 * bodies + 2 * forces
    return max(int(MOST_OF_SERIES * 3 / 4 / width), 600)


def panels(columns: list[tuple[Any, ...]], rows: NDArray[Any]) -> list[Panel]:
    """The panels with the chosen rows."""
    names = ("part", "kind", "title", "unit", "factor")
    return [
        Panel(zip(names, of, strict=True), curves=[{"name": k, "values": single(values[rows])} for k, values in curves])
        for *of, curves in columns
    ]


def envelopes(parts: list[Part], scene: Scene) -> list[dict[str, Any]]:
    """The `Envelope` of every cable [N], as `figures.envelope` shows it."""
    found = []
    for name, record in parts:
        if "cable_tension_maximum" not in record:
            continue
        try:
            of = envelope_of(record, scene)
        except TooShort:
            continue
        unit, factor = force_unit([of.least, of.largest])
        packed: dict[str, Any] = {"low": single(of.least), "mean": single(of.mean), "high": single(of.largest)}
        packed |= {"from": of.begin, "to": of.end, "instants": of.frames}
        found.append({"part": name, "s": single(record.s_cell.values), "unit": unit, "factor": factor} | packed)
    return found


def spectra(parts: list[Part], scene: Scene) -> list[dict[str, Any]]:
    """Power spectral densities of tensions and motions, as the figures have them; none of what is too short."""
    found = []
    for name, record in parts:
        for title, unit, curves in _quantities(record):
            try:
                densities, period = spectra_of(record, scene, f"spectrum of the {title}", curves)
            except TooShort:
                continue
            f, (end, low, high) = densities[0][1], window_of(densities, period)
            kept = f <= end  # beyond nothing is seen any more
            packed = [{"name": label, "values": single(S[kept])} for label, _, S in densities]
            one = {"part": name, "title": title, "unit": unit, "frequency": single(f[kept]), "curves": packed}
            found.append(one | {"drive": 1 / period if period else None, "low": low, "high": high})
    return found


def _quantities(record: xr.Dataset) -> Iterator[tuple[str, str, list[tuple[str, NDArray[Any]]]]]:
    found = _panels_of(record)
    if "tension" in found:
        curves = found["tension"][2]
        unit, factor = force_unit([values.max() for _, values in curves])
        yield "tension", unit, [(label, factor * values) for label, values in curves]
    if "buoy_position" in record:
        yield "position of C", "m", list(zip("xyz", record.buoy_position.values.T, strict=True))
    if "angle" in found:
        yield "angles", *found["angle"][1:]
