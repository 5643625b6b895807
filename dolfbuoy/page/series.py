"""Series of a run as panels of curves, those of a spectrum, of the lines, and of the track from above."""

import numpy as np

from ..errors import InputError
from ..results.behind_ramp import TooShort, after_ramp, density, enough_for_a_spectrum, mean_over_time, unwrapped
from ..results.tables import force_unit
from .pack import single

#: Rows of the part of the file that holds series: about so many bytes of text.
MOST_OF_SERIES = 1_250_000


class Panel(dict):
    """A chart over time: {part, title, unit, factor, curves: [{name, values}]}; part: the cable or buoy it is of."""


def columns_of(parts) -> list[tuple]:
    """(part, kind, title, unit, factor, [(name, values of all rows), ...]) of every panel of a record's parts."""
    found = []
    for name, record in parts:
        if "tension_top" in record:
            unit, factor = force_unit([record.tension_top.max(), record.tension_anchor.max()])
            ends = [("upper end", record.tension_top.values), ("lower end", record.tension_anchor.values)]
            found.append((name, "line", "tension", unit, factor, ends))
        if "length_on_bed" in record:
            found.append((name, "line", "length on the bed", "m", 1.0, [("on the bed", record.length_on_bed.values)]))
        if "buoy_position" in record:
            x, y, z = record.buoy_position.values.T
            heave = [("C", z)] + ([("water", record.surface_elevation.values)] if "surface_elevation" in record else [])
            found.append((name, "buoy", "height", "m", 1.0, heave))
            found += [(name, "buoy", *panel) for panel in _horizontal(x, y)]
            turns = [(turn, unwrapped(record, turn)) for turn in ("roll", "pitch", "yaw") if turn in record]
            found += [(name, "buoy", *panel) for panel in _angles(turns)]
    return found


#: Curves share an axis unless together they span so many times what the widest of the first spans.
APART = 3.0


def _fit(first, *others):
    """Whether curves can be told on one axis with the first ones."""
    spans = [values for _, values in (*first, *others)]
    whole = max(values.max() for values in spans) - min(values.min() for values in spans)
    return whole <= APART * max(np.ptp(values) for _, values in first)


def _horizontal(x, y):
    """Panels of x and y: one, or two where one axis would show neither."""
    curves = [("x", x), ("y", y)]
    if _fit(curves):
        return [("horizontal position of C", "m", 1.0, curves)]
    return [(f"{name} of C", "m", 1.0, [(name, values)]) for name, values in curves]


def _angles(turns):
    """Panels of the turns: a yaw that goes far has its own."""
    if not turns:
        return []
    if _fit(turns[:2], *turns[2:]):
        return [("angle", "deg", 1.0, turns)]
    return [("angle", "deg", 1.0, turns[:2]), ("yaw", "deg", 1.0, turns[2:])]


def rows_that_fit(record, parts, columns) -> int:
    """How many instants there is room for."""
    bodies = sum("buoy_position" in part.record for part in parts)
    forces = sum(int(np.prod(record[name].shape[1:])) for name in ("mooring_force", "anchor_force") if name in record)
    width = 8 + 4 * sum(len(curves) for *_, curves in columns) + 14 * bodies + 2 * forces
    return max(int(MOST_OF_SERIES * 3 / 4 / width), 600)


def panels(columns, rows) -> list[Panel]:
    """The panels with the chosen rows."""
    return [
        Panel(
            part=part,
            kind=kind,
            title=title,
            unit=unit,
            factor=factor,
            curves=[{"name": name, "values": single(values[rows])} for name, values in curves],
        )
        for part, kind, title, unit, factor, curves in columns
    ]


def envelopes(parts, scene) -> list[dict]:
    """Least, mean and largest tension of every element of every cable behind the ramp [N], as `figures.envelope`."""
    found = []
    for name, record in parts:
        if "cable_tension" not in record:
            continue
        frames, T = record.frame.values, record.cable_tension.values
        try:
            rows = after_ramp(frames, scene, 2, "envelope of the tension")
        except TooShort:
            continue
        unit, factor = force_unit(T[rows])
        curves = T[rows].min(axis=0), mean_over_time(frames[rows], T[rows]), T[rows].max(axis=0)
        packed = {key: single(v) for key, v in zip(("low", "mean", "high"), curves, strict=True)}
        span = {"from": float(frames[rows[0]]), "to": float(frames[rows[-1]]), "instants": len(rows)}
        found.append(
            {"part": name, "s": single(record.s_cell.values), "unit": unit, "factor": factor, **packed, **span}
        )
    return found


def spectra(parts, scene) -> list[dict]:
    """Power spectral densities of tensions and motions, as the figures have them; none of what is too short."""
    found = []
    for name, record in parts:
        for title, unit, curves in _quantities(record):
            try:
                rows, period = enough_for_a_spectrum(record.time.values, scene, f"spectrum of the {title}")
            except InputError:
                continue
            t = record.time.values[rows]
            densities = [(label, *density(t, values[rows], period)) for label, values in curves]
            found.append(_spectrum(name, title, unit, densities, period))
    return found


def _quantities(record):
    if "tension_top" in record:
        unit, factor = force_unit([record.tension_top.max(), record.tension_anchor.max()])
        ends = [("upper end", record.tension_top.values), ("lower end", record.tension_anchor.values)]
        yield "tension", unit, [(label, factor * values) for label, values in ends]
    if "buoy_position" in record:
        yield "position of C", "m", list(zip("xyz", record.buoy_position.values.T, strict=True))
        turns = [(turn, unwrapped(record, turn)) for turn in ("roll", "pitch", "yaw") if turn in record]
        if turns:
            yield "angles", "deg", turns


#: Decades below the peak in which a spectrum is shown.
DECADES = 6


def _spectrum(part, title, unit, densities, period):
    """Cut where nothing is seen any more."""
    _, f, S = max(densities, key=lambda curve: curve[2].max())
    highest = max(float(S.max()), 1e-12)
    end = max(f[highest / 10 ** (DECADES - 1) <= S].max(initial=2 * f[S.argmax()]), 4 / period if period else 0.0)
    kept = f <= max(end, 4 * f[1])
    curves = [{"name": label, "values": single(S[kept])} for label, _, S in densities]
    found = {"part": part, "title": title, "unit": unit, "frequency": single(f[kept]), "curves": curves}
    return found | {"drive": 1 / period if period else None, "low": highest / 10**DECADES, "high": 4 * highest}
