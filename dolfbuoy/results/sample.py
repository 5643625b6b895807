"""Sample of a run: the numbers kept for its statistics, and the fatigue damage of its cycles.

Only the time after the ramp counts.  A sample is a plain dict, so that a store of many cases can hold it:

    {"start": s, "duration": s, "series": {label: {NUMBERS}}, "peaks": {label: [values, counts]},
     "cycles": {label: [ranges, counts]}, "corners": {buoy: [[x, y], ...]}, of the convex hull of the track of C,
     "parted": which lines have, where and when, if any have, "criteria": verdicts, if the scene has criteria,
     "strength": {label: {"breaking_load", "steel_area", "curve": as far as the scene gives them}} of tensions,
     "fatigue": {"corrosion", "corrosion_rate", "safety_factor"} of a scene with [fatigue]}
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..model.airy import AirySum
from ..scene import Scene
from ..scene.fatigue import Curve, curve_of, curve_on
from ..scene.quantities import Missing, Wrong
from ..scene.settings import ramp_of
from .bars import by_label
from .criteria import kept, verdicts
from .offsets import corners
from .parts import names_of
from .places import piece_of
from .quantities import chosen, declared
from .series import Series, begun, place_of, series_of

if TYPE_CHECKING:
    import xarray as xr

#: Numbers of every recorded quantity over the whole run, and of every series after the ramp.
STATISTICS = ("minimum", "maximum", "mean", "standard_deviation", "dominant_period")
NUMBERS = ("mean", "standard_deviation", "skewness", "minimum", "maximum", "period", "memory")
#: Series of the elevation at a fixed point; statistic of forces only.
FIXED_POINT, LASTS = "fixed_point_elevation", "lasting_maximum"

#: Seconds of a year of 365.25 days.
YEAR = 31557600.0
#: Keys of [fatigue] kept in a sample.
CORRODING = ("corrosion", "corrosion_rate", "safety_factor")


def numbers_of(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS of every series over the whole run, in the units of the record.
    Also the lasting maximum of forces, and the single number of quantities known at the beginning."""
    found = {one.label: one.numbers(STATISTICS + ((LASTS,) if lasts(one.label) else ())) for one in series_of(record)}
    return found | {one.label: one.numbers([declared(place_of(one.label).name).counts]) for one in begun(record)}


def sample_of(
    record: xr.Dataset,
    scene: Scene,
    start: float | None = None,
    point: Sequence[float] | None = None,
    bins: int | None = None,
) -> dict[str, Any]:
    """The sample of a record.

    start: begin of the time that counts [s]; by default the end of the ramp.  point: (x, y) of the fixed point [m]; by
    default the initial position of the buoy, else the anchor.  bins: number of bins of peaks and ranges, then rounded
    to seven digits.  Raises InputError if fewer than two instants are left.
    """
    start = ramp_of(scene) if start is None else start
    late = record.isel(time=record.time.values >= start - 1e-9 * max(abs(start), 1.0))
    if late.sizes["time"] < 2:
        raise InputError(
            f"The run ends at t = {float(record.time[-1]):g} s, and statistics begin at t = {start:g} s: they need at "
            "least two instants; compute a longer run, or give an earlier --from."
        )
    tracks, network = _tracks(late), scene.network
    if point is None:
        place = network.pieces[0].ends[0].position if network.pieces else None
        point = next((track[0] for track in _tracks(record).values()), (place or (0.0, 0.0))[:2])
    every = [*series_of(late), *begun(late), *_elevation(late, scene, point)]
    peaked, cycled = chosen("peaks"), chosen("cycles")
    by_chance = scene.waves is not None and scene.waves.spectrum is not None  # otherwise there is no memory
    numbers = NUMBERS if by_chance else NUMBERS[:-1]
    found: dict[str, Any] = {
        "start": float(late.time[0]),
        "duration": float(late.time[-1] - late.time[0]),
        "series": {s.label: s.numbers(numbers + ((LASTS,) if lasts(s.label) else ())) for s in every},
        "peaks": {s.label: _listed(s.peaks(), bins) for s in every if place_of(s.label).name in peaked},
        "cycles": {s.label: _listed(s.ranges(), bins) for s in every if place_of(s.label).name in cycled},
    }
    if abs(record.attrs.get("bar_window_from_s", math.inf) - start) < 1e-9:  # bars of exactly these instants
        for label, bars in by_label(record).items():
            found["series"].get(label, {}).update(bars)
    if tracks:
        found["corners"] = {name: corners(track).tolist() for name, track in tracks.items()}
    if scene.criteria is not None:
        found["criteria"] = kept(verdicts(record, scene, start))
    strength = {label: line for label in found["cycles"] if (line := _strength(label, scene))}
    found |= {"strength": strength} if strength else {}
    if scene.fatigue is not None:
        found["fatigue"] = {name: getattr(scene.fatigue, name) for name in CORRODING}
    return found | {key: value for key, value in record.attrs.items() if key == "parted"}


def _strength(label: str, scene: Scene) -> dict[str, Any]:
    """Strength of the line where a tension acts, to which its ranges refer, and its fatigue curve."""
    network, (name, dimension, part) = scene.network, place_of(label)
    if dimension == "place":
        piece, linked = piece_of(part, network)
    elif dimension == "cable" and part in network.cables:
        cable, linked = network.cables.index(part), True
        piece = network.last_of(cable) if name == "tension_top" else network.first_of(cable)
    else:
        return {}
    section = network.pieces[piece].section
    found = {
        "breaking_load": section.breaking_load,
        "steel_area": section.steel_area,
        "curve": curve_on(section, scene.fatigue, linked),
    }
    return {key: value for key, value in found.items() if value is not None}


def lasts(label: str) -> bool:
    """True for a force whose peaks are kept, so that its lasting maximum counts."""
    name = place_of(label).name
    return name in chosen("peaks") and declared(name).unit == "N"


def binned(values: NDArray[Any], counts: NDArray[Any], bins: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Values and counts in at most `bins` bins of equal width, each at its mean value; unchanged if few enough.

    A sum of value^m then misses a fraction of about m (m - 1) / (24 bins^2) of the contribution of the largest values.
    """
    if len(values) <= bins:
        return values, counts
    place = np.floor((values - values.min()) / np.ptp(values) * bins).clip(max=bins - 1).astype(int)
    total = np.bincount(place, counts, bins)
    kept = total > 0
    return np.bincount(place, counts * values, bins)[kept] / total[kept], total[kept]


def _listed(pair: tuple[NDArray[Any], NDArray[Any]], bins: int | None) -> list[list[float]]:
    """[values, counts] as lists; if binned, to seven digits."""
    if bins is None:
        return [column.tolist() for column in pair]
    return [[float(f"{x:.7g}") for x in column] for column in binned(*pair, bins)]


def _elevation(late: xr.Dataset, scene: Scene, point: Sequence[float]) -> Iterator[Series]:
    """Series of the elevation at the fixed point, if there are waves."""
    if scene.waves:
        t = late.time.values
        eta = AirySum.of(scene).over_time(t, np.asarray(point))
        yield Series(FIXED_POINT, t, eta, 1e-9 * np.abs(eta).max())


def _tracks(record: xr.Dataset) -> dict[str, NDArray[Any]]:
    """(x, y) of every buoy over time."""
    return {name: record.buoy_position.sel(buoy=name).values[:, :2] for name in names_of(record, "buoy")}


def pair_of(sample: dict[str, Any], kept: str, label: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """(values, counts) of the "peaks" or "cycles" of a series in a sample."""
    values, counts = sample[kept].get(label, ([], []))
    return np.array(values, dtype=float), np.array(counts, dtype=float)


class Damage(NamedTuple):
    """Miner sum of the cycles of a run, and its curve in words."""

    sum: float
    curve: str


#: Number of ages at which the damage of a corroding chain is evaluated.
AGES = 2001


@dataclass(frozen=True)
class Fatigue:
    """Fatigue curve that overrides those of the scenes' lines, and reference of equivalent loads.

    exponent, frequency [Hz]: of the equivalent load.  curve: as in a scene.  constant: of N = constant S^-exponent,
    with the range S in N; corrosion [m], safety_factor: override those of [fatigue].  None: as in the scene.
    """

    exponent: float = 3.0
    constant: float | None = None
    frequency: float = 1.0
    curve: str | None = None
    corrosion: float | None = None
    safety_factor: float | None = None

    def __post_init__(self) -> None:
        for name in ("exponent", "constant", "frequency", "safety_factor"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise InputError(f"{name} = {value}: must be a positive number.")
        if self.corrosion is not None and not 0 <= self.corrosion < np.inf:
            raise InputError(f"corrosion = {self.corrosion}: must be a number of metres, 0 or more.")
        if self.curve is not None and self.constant is not None:
            raise InputError("constant: does not go with curve: give one of them.")
        if self.curve is not None:
            try:
                curve_of(self.curve)
            except ValueError as error:
                raise InputError(f"curve = {self.curve!r}: {error}.") from None

    def equivalent_load(self, sample: dict[str, Any], label: str) -> float:
        """Constant range that does the same damage at the frequency, (sum n S^m / N)^(1/m) [unit of ranges]."""
        ranges, counts = pair_of(sample, "cycles", label)
        largest, m = ranges.max(initial=0.0), self.exponent
        if largest == 0:
            return 0.0
        number = self.frequency * sample["duration"]
        return float(largest * (np.sum(counts * (ranges / largest) ** m) / number) ** (1 / m))

    def power_sum(self, sample: dict[str, Any], label: str) -> float:
        """Sum of n S^m."""
        ranges, counts = pair_of(sample, "cycles", label)
        return float(np.sum(counts * ranges**self.exponent))

    def factor(self, sample: dict[str, Any]) -> float:
        """Safety factor on the life, 1 without one."""
        own = sample.get("fatigue", {}).get("safety_factor", 1.0)
        return float(own if self.safety_factor is None else self.safety_factor)

    def life(self, sample: dict[str, Any], label: str, yearly: float) -> float:
        """Years until the Miner sum of a tension is 1; yearly: damage in the first year.  nan without damage.

        If the bar of a chain corrodes at a rate r, the damage rate after t years is (R(c)/R(c + r t))^m times the
        initial one, with the reference R of its curve; its life ends at the latest when nothing of the bar is left.
        """
        if not yearly > 0:
            return np.nan
        line, own = sample.get("strength", {}).get(label, {}), sample.get("fatigue", {})
        rate, text = own.get("corrosion_rate", 0.0), self.curve or line.get("curve")
        if not rate or self.constant is not None or text is None or not curve_of(text).bar:
            return 1 / yearly
        curve, corroded = curve_of(text), own.get("corrosion", 0.0) if self.corrosion is None else self.corrosion
        left = np.sqrt(2 * line["steel_area"] / np.pi) - corroded
        years = np.linspace(0.0, min(1 / yearly, left / rate * (1 - 1e-9)), AGES)
        numbers = line.get("breaking_load"), line.get("steel_area")
        references = np.array([curve.reference(*numbers, corroded + rate * t) for t in years])
        pace = yearly * (references[0] / references) ** curve.exponent
        sums = np.concatenate([[0.0], np.cumsum((pace[1:] + pace[:-1]) / 2 * np.diff(years))])
        return float(np.interp(1.0, sums, years))

    def damage(self, sample: dict[str, Any], label: str) -> Damage | None:
        """Damage by the cycles of a tension; None if it has no curve.

        Raises InputError if the line lacks the breaking load or steel area to which the ranges of the curve refer.
        """
        if self.constant is not None:
            found = self.power_sum(sample, label) / self.constant
            doubt = ", which lead to failure within a run: are they of stresses in MPa?" if found > 1 else ""
            return Damage(found, f"K = {self.constant:g} and m = {self.exponent:g} of ranges in N{doubt}")
        line = sample.get("strength", {}).get(label, {})
        text = self.curve or line.get("curve")
        if text is None:
            return None
        curve, corrosion = curve_of(text), sample.get("fatigue", {}).get("corrosion", 0.0)
        corrosion = corrosion if self.corrosion is None else self.corrosion
        try:
            reference = curve.reference(line.get("breaking_load"), line.get("steel_area"), corrosion)
        except (Missing, Wrong) as error:
            raise InputError(f"{label}: {error} of the line there.") from None
        ranges, counts = pair_of(sample, "cycles", label)
        constant = log_constant(curve, sample["series"][label]["mean"], reference)
        with np.errstate(divide="ignore"):  # sums of logarithms: R^13 of a small range is not representable
            logs = np.log10(ranges / reference) * curve.exponent - constant
        return Damage(float(np.sum(counts * 10.0**logs)), _in_words(curve, reference, corrosion))


def log_constant(curve: Curve, mean: float, reference: float) -> float:
    """Logarithm of K at the mean tension [N], if it depends on that; compression counts as zero tension."""
    return curve.log_constant + curve.by_mean * max(mean, 0.0) / reference


def _in_words(curve: Curve, reference: float, corrosion: float) -> str:
    """Words for the curve and the reference of its ranges."""
    words = {"MBL": f", ranges over {reference / 1e3:.5g} kN", "MPa": f", ranges over {reference:.5g} mm²"}
    thinner = f", bar thinner by {1e3 * corrosion:g} mm" if corrosion and curve.bar else ""
    return f"{curve.name}{words.get(curve.unit, '')}{thinner}"


def lives(sample: dict[str, Any], fatigue: Fatigue | None = None) -> dict[str, float]:
    """Years until the Miner sum of each tension with a curve is 1, if the run is repeated; inf without damage."""
    how, found = fatigue or Fatigue(), {}
    for label in sample["cycles"]:
        if (damage := how.damage(sample, label)) is not None:
            yearly = YEAR * damage.sum / sample["duration"]
            found[label] = how.life(sample, label, yearly) if yearly > 0 else np.inf
    return found


def lives_of(record: xr.Dataset, scene: Scene) -> tuple[dict[str, float], float, float]:
    """(`lives` of a run, their safety factor, the counted time [s]); empty without curves, or within the ramp."""
    curved = any(
        curve_on(piece.section, scene.fatigue, linked) for piece in scene.network.pieces for linked in (False, True)
    )
    try:
        sample = sample_of(record, scene) if curved else None
    except InputError:
        sample = None
    return (lives(sample), Fatigue().factor(sample), sample["duration"]) if sample else ({}, 1.0, 0.0)
