"""Series of a run as panels of curves; spectra, envelopes of the lines, and track."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..results.after_ramp import TooShort, spectra_of, window_of
from ..results.bars import extremes
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

#: Approximate limit of the text that holds series [bytes].
MOST_OF_SERIES = 1_250_000


#: Kinds of parts by dimension, whose panels are chosen together; all devices are shown.
KINDS = {"buoy": "buoy", "take_off": "device", "winch": "device", "vessel": "device"}


class Panel(dict[str, Any]):
    """A chart over time: {part, title, unit, factor, curves: [{name, values, bars}]}; part: its cable or buoy.

    bars: [{t, value, bar}], error bars of a curve's extremes, in its own unit.
    """


class Line(NamedTuple):
    """A curve over all rows of a record, and the error bars of its extremes, [{t, value, bar}]."""

    name: str
    values: NDArray[Any]
    bars: Sequence[dict[str, float]] = ()


def columns_of(parts: list[Part]) -> list[tuple[Any, ...]]:
    """(part, kind, title, unit, factor, [Line, ...]) of every panel of a record's parts."""
    found = []
    for name, record in parts:
        for title, (kind, unit, curves) in _panels_of(record).items():
            if unit == "N":
                found.append((name, kind, title, *force_unit([line.values.max() for line in curves]), curves))
            else:
                found += [(name, kind, *panel) for panel in _split(title, unit, curves)]
    return found


def _panels_of(record: xr.Dataset) -> dict[str, tuple[str, str, list[Line]]]:
    """Title -> (kind, unit, curves) of the declared curves that a part of a record has."""
    found: dict[str, tuple[str, str, list[Line]]] = {}
    estimated = extremes(record)
    for quantity in QUANTITIES.values():
        for curve in quantity.curves if quantity.name in record else ():
            values, series = unwrapped(record, quantity.name), quantity.name
            if quantity.kind == "place":
                found[curve.panel] = "line", quantity.unit, list(_at_places(record.place.values, values))
                continue
            if curve.component:
                values, series = values[:, "xyz".index(curve.component)], f"{series}_{curve.component}"
            kind, unit = (
                KINDS.get(quantity.kind, "line"),
                "1/m" if quantity.unit == "m-1" else quantity.unit.replace("degree", "deg"),
            )
            bars = [
                {"t": float(record.time[np.nanargmin(np.abs(values - value))]), "value": value, "bar": bar}
                for value, bar in estimated.get(series, {}).values()
            ]
            found.setdefault(curve.panel, (kind, unit, []))[2].append(Line(curve.name, values, bars))
    return found


#: Most curves of places in one panel.
MOST_PLACES = 6


def _at_places(names: NDArray[Any], values: NDArray[Any]) -> Iterator[Line]:
    """Tensions at the places where they vary most."""
    for k in sorted(np.argsort(-np.ptp(values, axis=0), kind="stable")[:MOST_PLACES]):
        segment, _, where = str(names[k]).partition(AT)
        yield Line(f"{segment.partition('.')[2]} {where}".strip(), values[:, k])


#: Curves share an axis unless together they span this many times the range of the widest of the first.
APART = 3.0


def _fit(first: list[Line], *others: Line) -> Any:
    """True if curves can be distinguished on one axis with the first ones."""
    spans = [line.values for line in (*first, *others)]
    whole = max(values.max() for values in spans) - min(values.min() for values in spans)
    return whole <= APART * max(np.ptp(line.values) for line in first)


def _split(title: str, unit: str, curves: list[Line]) -> list[tuple[str, str, float, list[Line]]]:
    """Panels of curves: one, unless one axis would hide some of them.

    Then x and y get a panel each; among the angles, yaw does.
    """
    if title == "horizontal position of C" and not _fit(curves):
        return [(f"{line.name} of C", unit, 1.0, [line]) for line in curves]
    if title == "angle" and not _fit(curves[:2], *curves[2:]):
        return [(title, unit, 1.0, curves[:2]), ("yaw", unit, 1.0, curves[2:])]
    return [(title, unit, 1.0, curves)]


def rows_that_fit(record: xr.Dataset, parts: list[Part], columns: list[tuple[Any, ...]]) -> int:
    """Number of instants that fit."""
    bodies = sum("buoy_position" in part.record for part in parts)
    forces = sum(int(np.prod(record[name].shape[1:])) for name in ("mooring_force", "anchor_force") if name in record)
    width = 8 + 4 * sum(len(curves) for *_, curves in columns) + 14 * bodies + 2 * forces
    return max(int(MOST_OF_SERIES * 3 / 4 / width), 600)


def panels(columns: list[tuple[Any, ...]], rows: NDArray[Any]) -> list[Panel]:
    """The panels with the chosen rows."""
    names = ("part", "kind", "title", "unit", "factor")
    return [
        Panel(
            zip(names, of, strict=True),
            curves=[{"name": k, "values": single(values[rows]), "bars": list(bars)} for k, values, bars in curves],
        )
        for *of, curves in columns
    ]


def envelopes(parts: list[Part], scene: Scene) -> list[dict[str, Any]]:
    """The `Envelope` of every cable [N], as in `figures.envelope`."""
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
    """Power spectral densities of tensions and motions, as in the figures; none for records that are too short."""
    found = []
    for name, record in parts:
        for title, unit, curves in _quantities(record):
            try:
                densities, period = spectra_of(record, scene, f"spectrum of the {title}", curves)
            except TooShort:
                continue
            f, (end, low, high) = densities[0][1], window_of(densities, period)
            kept = f <= end  # nothing is visible beyond
            packed = [{"name": label, "values": single(S[kept])} for label, _, S in densities]
            one = {"part": name, "title": title, "unit": unit, "frequency": single(f[kept]), "curves": packed}
            found.append(one | {"drive": 1 / period if period else None, "low": low, "high": high})
    return found


def _quantities(record: xr.Dataset) -> Iterator[tuple[str, str, list[tuple[str, NDArray[Any]]]]]:
    found = _panels_of(record)
    if "tension" in found:
        curves = found["tension"][2]
        unit, factor = force_unit([line.values.max() for line in curves])
        yield "tension", unit, [(line.name, factor * line.values) for line in curves]
    if "buoy_position" in record:
        yield "position of C", "m", list(zip("xyz", record.buoy_position.values.T, strict=True))
    if "angle" in found:
        _, unit, curves = found["angle"]
        yield "angles", unit, [(line.name, line.values) for line in curves]
