"""Criteria of a scene checked on a record: value, limit, margin, and the governing part."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..scene.criteria import API, CHARACTERISTIC_STRENGTH, DNV
from ..scene.settings import ramp_of
from .series import Series, place_of, series_of
from .tables import rounded, unit_of

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene

#: Statistics of a series that may be limited.
NUMBERS = {"max": "maximum", "min": "minimum", "mean": "mean", "std": "standard_deviation"}

#: An uplift below this fraction of the largest tension (0.006 degrees) counts as none: the bed springs give a chain
#: lying in front of its anchor that much.
ROUNDING = 1e-4


@dataclass(frozen=True)
class Verdict:
    """A criterion checked for one part: value, limit and error bar of the value (nan: unknown) [unit].
    upper: the limit is an upper one.  case: which of several runs."""

    criterion: str
    part: str
    value: float
    limit: float
    unit: str
    upper: bool = True
    bar: float = math.nan
    case: str = ""

    @property
    def margin(self) -> float:
        """Margin to the limit, negative if not met [unit]."""
        return self.limit - self.value if self.upper else self.value - self.limit

    @property
    def met(self) -> bool:
        """True if the limit is met, or just reached."""
        return self.margin >= 0

    @property
    def use(self) -> float:
        """Margin as a fraction of the limit, by which the governing part is found; infinite if the limit is 0."""
        return self.margin / abs(self.limit) if self.limit else math.copysign(math.inf, self.margin)

    @property
    def says(self) -> str:
        """Verdict in words: met or not, by how much, and whether the error bar could reverse it."""
        unit, factor = unit_of([self.value, self.limit], self.unit)
        size = f"{rounded(100 * abs(self.use))} %" if self.limit else f"{rounded(factor * abs(self.margin))} {unit}"
        doubt = ", within its error bar" if abs(self.margin) < self.bar else ""
        return f"{'met' if self.met else 'not met'}, {size} {'left' if self.met else 'missing'}{doubt}"

    def row(self) -> tuple[str, str, str, str, str, str]:
        """(criterion, part, value, limit, unit, verdict) as texts."""
        unit, factor = unit_of([self.value, self.limit], self.unit)
        bar = f" +- {rounded(factor * self.bar)}" if math.isfinite(self.bar) else ""
        sign = "<=" if self.upper else ">="
        where = ", ".join(filter(None, (self.part, self.case)))
        limit = f"{sign} {rounded(factor * self.limit, 5)}"
        return self.criterion, where, f"{rounded(factor * self.value, 5)}{bar}", limit, unit, self.says


#: Headings of rows.
HEADINGS = ("criterion", "governed by", "value", "limit", "unit", "verdict")


def verdicts(record: xr.Dataset, scene: Scene, start: float | None = None) -> list[Verdict]:
    """Verdicts of all criteria for all parts of a run after its ramp, or of an equilibrium.
    start: begin from here instead [s].  Raises InputError for a limit on an output that the record lacks."""
    if scene.criteria is None:
        return []
    found = _Record(record, scene, start)
    return [*_of_strength(found), *_of_places(found), *_of_limits(found)]


def governing(every: Iterable[Verdict]) -> list[Verdict]:
    """The verdict with the least margin for each criterion."""
    worst: dict[str, Verdict] = {}
    for one in every:
        worst[one.criterion] = min(worst.get(one.criterion, one), one, key=lambda each: (each.use, each.margin))
    return list(worst.values())


def kept(every: Iterable[Verdict]) -> list[dict[str, Any]]:
    """Verdicts as plain values, for storage."""
    return [asdict(one) for one in every]


def over_cases(samples: Iterable[tuple[str, dict[str, Any]]]) -> list[Verdict]:
    """Verdicts held in samples of runs, with the names of the runs."""
    found = [(name, one) for name, sample in samples for one in sample.get("criteria", [])]
    return [Verdict(**(one | {"case": name})) for name, one in found]


class _Record:
    """Series of a record by name, over the time that counts, and their error bars."""

    def __init__(self, record: xr.Dataset, scene: Scene, start: float | None) -> None:
        self.scene, self.criteria = scene, scene.criteria
        if "time" not in record.dims:  # an equilibrium
            names = [name for name, one in record.data_vars.items() if not {"frame", "node", "cell"} & set(one.dims)]
            late = record[names].expand_dims(time=[0.0])
        else:
            begin = ramp_of(scene) if start is None else start
            late = record.isel(time=record.time.values >= begin - 1e-9 * max(abs(begin), 1.0))
            late = late if late.sizes["time"] > 1 else record
        self.late = late
        self.bars: dict[tuple[str, str], float] = {}
        if "bar" in record:
            columns = (record[name].values.tolist() for name in ("output", "output_of", "bar", "bar_verdict"))
            self.bars = {(o, of): x for o, of, x, verdict in zip(*columns, strict=True) if verdict != "none"}

    def series(self, name: str) -> list[tuple[str, Series]]:
        """(part, series) of all series of this name, scalars or components."""
        own = [one for one in series_of(self.late) if place_of(one.label).name == name]
        return [(place_of(one.label).part, one) for one in own]

    def judged(
        self, criterion: str, name: str, number: str, limit: float, unit: str, upper: bool = True, part: str = ""
    ) -> Iterator[Verdict]:
        """Verdicts on a statistic of a series, for one part or for each."""
        for mine, one in self.series(name):
            if not part or mine == part:
                value = float(getattr(one, NUMBERS[number]))
                bar = self.bars.get((f"{name}.{number}", mine), math.nan)
                yield Verdict(criterion, mine, value, limit, unit, upper, bar)


def _of_strength(found: _Record) -> Iterator[Verdict]:
    """Utilisations with their safety factors; for DNV, mean and dynamic tension separately."""
    criteria: Any = found.criteria
    factors = {"safety factor": criteria.safety_factor}
    if criteria.safety == "API":
        factors[f"API RP 2SK, {criteria.condition}"] = API[criteria.condition]
    for name, factor in factors.items():
        for one in found.judged("", "utilisation", "max", math.nan, "1") if factor else ():
            value, bar = 1 / max(one.value, 1e-300), one.bar / max(one.value, 1e-300) ** 2
            yield Verdict(name, one.part, value, factor, "", False, bar)
    if criteria.safety == "DNV":
        of_mean, of_rest = DNV[criteria.condition, criteria.consequence_class]
        name = f"DNV-OS-E301, {criteria.condition}, class {criteria.consequence_class}: use of the strength"
        for part, series in found.series("utilisation"):
            use = (of_mean * series.mean + of_rest * (series.maximum - series.mean)) / CHARACTERISTIC_STRENGTH
            bar = of_rest * found.bars.get(("utilisation.max", part), math.nan) / CHARACTERISTIC_STRENGTH
            yield Verdict(name, part, use, 1.0, "", True, bar)


def _of_places(found: _Record) -> Iterator[Verdict]:
    """Offsets, lean, freeboard, and forces on anchors."""
    c: Any = found.criteria
    if c.largest_offset is not None:
        yield from found.judged("offset", "offset", "max", c.largest_offset, "m")
    if c.largest_lean_deg is not None:
        yield from found.judged("lean", "cone_angle", "max", c.largest_lean_deg, "deg")
    if c.least_freeboard is not None:
        yield from found.judged("freeboard", "freeboard", "min", c.least_freeboard, "m", upper=False)
    if c.no_uplift:
        sizes = [one.maximum for _, one in found.series("anchor_horizontal") + found.series("tension_top")]
        least = ROUNDING * max(sizes, default=0.0)
        for one in found.judged("no uplift of anchors", "anchor_uplift", "max", 0.0, "N"):
            yield replace(one, value=0.0) if 0 < one.value < least else one
    if c.largest_anchor_force is not None:
        name = "horizontal force on anchors"
        yield from found.judged(name, "anchor_horizontal", "max", c.largest_anchor_force, "N")


def _of_limits(found: _Record) -> Iterator[Verdict]:
    """Limits on outputs.  Raises InputError for an output or part that the record lacks."""
    from .series import described

    criteria: Any = found.criteria
    for text, limit in zip(criteria.limits, criteria.parsed, strict=True):
        if not found.series(limit.series):
            names = ", ".join(dict.fromkeys(place_of(one.label).name for one in series_of(found.late)))
            raise InputError(f"criteria.limits: {text!r} is of what this scene does not record; it has {names}.")
        unit = {"1": "", "degree": "deg"}.get(own_unit := described(limit.series)[0], own_unit)
        name, upper = f"{limit.series}.{limit.number}", limit.sign == "<"
        own = list(found.judged(name, limit.series, limit.number, limit.bound, unit, upper, limit.part))
        if not own:
            parts = ", ".join(part for part, _ in found.series(limit.series))
            raise InputError(f"criteria.limits: {text!r}: [{limit.part}] must be one of {parts}.")
        yield from own


def never_met(every: Iterable[Verdict]) -> list[str]:
    """A sentence for each criterion that is not met."""
    return [
        f"Criterion not met: {one.criterion}, {', '.join(filter(None, (one.part, one.case)))}: "
        f"{rounded(factor * one.value, 5)} {unit}".rstrip()
        + f", {'at most' if one.upper else 'at least'} {rounded(factor * one.limit, 5)} {unit}".rstrip()
        + f" ({one.says.partition(', ')[2]})."
        for one in governing(every)
        if not one.met
        for unit, factor in [unit_of([one.value, one.limit], one.unit)]
    ]
