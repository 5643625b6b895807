"""Error bars of outputs from a run and its companion, and their verdicts.

With steps h and N elements the error is about C_t h^p + C_s N^-q.  The terms are r^p and r^q times as large in a
companion with r h and N/r, so that the runs differ by r^2 - 1 times the error if p = q = 2, and about half of that if
part of it is of first order: with backward Euler, lines that go slack or land, and tensions of end elements.  Source:
Richardson's extrapolation; the half covers the errors of runs whose exact result is known.
"""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..results.measured import window_start
from ..results.quantities import ERROR
from ..results.series import Series
from ..scene import Scene
from .companion import followed
from .outputs import Output, numbers_of, series_after, unit_of_series

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

    from .companion import Event

#: Series by (name, part).
AllSeries = dict[tuple[str, str], Series]
RESOLVED, SUSPECT, NONE = VERDICTS = ("resolved", "suspect", "none")
#: Least bar of each statistic, as a multiple of the rms difference of the series (divided as the differences are).
FLOOR = {"max": 1.0, "min": 1.0, "mean": 0.25, "std": 0.25}
#: Fraction of the range beyond which a bar counts as "nothing is known".
LARGEST = 0.25
#: Fraction of the range by which a tension may alternate from step to step (rms): at 0.48 % maxima are still within the
#: bars, at 0.66 % (`short`, generalized-alpha, a fiftieth of the period) they are off by 4 % of the range.
RINGING = 0.006
#: Rms difference over the standard deviation of a series beyond which the companion diverges from the run.
LOST = 0.3
#: A time-step error (rms) of this many times that shown by the companion contradicts it.
CONTRADICTED = 3
#: Unknown errors.
UNKNOWN = dict.fromkeys(FLOOR, math.nan)
#: Largest Newton tolerance that bounds the solver's error, and the error as a multiple of tolerance times range.
BOUNDED, OF_NEWTON = 1e-4, 0.25

#: Lines of a tapered periodogram that represent frequency 0.
LOWEST = slice(2, 10)


class Bar(NamedTuple):
    """Value of an output, half-width of its error bar, its verdict, and separate contributions.

    time, space: contributions of steps and elements.  newton: bound of the solver's contribution.  chance: scatter of
    one seed of a sea, not part of the bar.  All in the unit of the output; nan if unknown.
    """

    value: float
    bar: float
    verdict: str
    time: float = math.nan
    space: float = math.nan
    newton: float = math.nan
    chance: float = math.nan


def dataset_of(found: dict[Output, Bar], sentences: list[str], scene: Scene) -> "xr.Dataset":
    """Bars of all outputs of a run over `output`, as in its record."""
    import xarray as xr

    attributes = {"bar_says": " ".join(sentences), "bar_window_from_s": window_start(scene)}
    return xr.Dataset(_variables(found), _labels(found), attributes)


def bars_of(
    record: "xr.Dataset",
    scene: Scene,
    companion: "xr.Dataset | Exception | None",
    ratio: float = 2.0,
    events: "Mapping[Event, xr.Dataset] | None" = None,
) -> tuple[dict[Output, Bar], list[str]]:
    """(Bar of each output, sentences about all of them).

    companion: record of a coarser run, its exception, or None if only the time-step error is wanted.  ratio: of its
    step and element size to the run's.  events: records of companions around extremes, in their own times.
    """
    start, end = window_start(scene), scene.time.end
    whole, fine, until = series_after(record, start), {}, end if companion is None else followed(scene)
    alongside, corrected = series_after(record, start, until), series_after(corrected_of(record), start, until)
    if companion is None:
        coarse, reason = {}, "The elements' part of the errors is not estimated (accuracy.estimate)."
    elif isinstance(companion, Exception):
        coarse, reason = {}, f"A run with twice the step and half the elements fails: {companion}"
    else:
        end = min(end, float(companion.time[-1]))
        fine, coarse = series_after(record, start, end), series_after(companion, start, end)
        reason = _cut(record, companion) or _rings(fine)
    irregular = scene.waves is not None and scene.waves.irregular
    second = ratio**2 - 1
    first, sentences = second / 2, [] if reason is None else [reason]
    factor = second if is_smooth(scene) and scene.time.scheme != "backward-euler" else first
    if not is_smooth(scene):
        sentences.append("Lines go slack or lie on a bed: bars are orders of magnitude.")
    if end < scene.time.end:
        later = "; extremes of a sea are those of runs around them, or suspect" if irregular else ""
        sentences.append(
            f"Bars are those of the run until {end:g} s, in proportion to the range of each series{later}."
        )
    found, far, left = {}, [], any(_left(one, alongside.get(key)) for key, one in corrected.items())
    if left and reason is None:
        sentences.append("The error of the steps cannot be followed to the end of the run, so that bars are suspect.")
    around = {event: _around(record, event, other) for event, other in (events or {}).items()}
    for (name, part), series in whole.items():
        if not np.isfinite(series.x).all():
            found |= {Output(name, n, part): Bar(x, math.nan, NONE) for n, x in numbers_of(series).items()}
            continue
        both = (fine.get((name, part)), coarse.get((name, part)))
        divided = first if name == "tension_anchor" and _of_elements(scene) else factor
        total, rms, lost = _compared(series, *both, divided) if all(both) else (UNKNOWN, math.nan, False)
        steps, of_steps_rms = _of_steps(series, alongside.get((name, part)), corrected.get((name, part)))
        doubtful = lost or left or of_steps_rms > CONTRADICTED * rms / divided
        size = float(np.ptp(series.x))
        newton, chance = _newton(scene, series), _chance(scene, series)
        for number, value in numbers_of(series).items():
            bar, of_steps = max(abs(total[number]), FLOOR[number] * rms / divided), abs(steps[number])
            unseen, error = irregular and end < (t := _instant(series, number)), total[number]
            if unseen and (event := next((e for e in around if e.settled <= t <= e.end), None)) is not None:
                both = (all_of[name, part] for all_of in around[event])
                error, of_event, astray = _compared(series, *both, divided, whole=True)
                error, unseen = error[number], astray
                bar = max(abs(error), of_event / divided)
            bar = of_steps if of_steps > bar else bar
            verdict = _verdict(bar, size, reason, doubtful or unseen, series.noise)
            parts = of_steps, abs(error - steps[number]), newton, chance.get(number, math.nan)
            found[Output(name, number, part)] = Bar(value, bar, verdict, *parts)
        far += [series.label] * lost
    if far and reason is None:
        sentences.append(f"Half as fine a run goes another way, so that bars are suspect: {', '.join(far)}.")
    return found, sentences


def _around(record: "xr.Dataset", event: "Event", companion: "xr.Dataset") -> list[AllSeries]:
    """Series of a record and of the companion around an event, from the time at which that has settled."""
    companion = companion.assign_coords(time=companion.time.values + event.begin)
    return [series_after(one, event.settled, event.end) for one in (record, companion)]


def _compared(
    series: Series, fine: Series, coarse: Series, factor: float, whole: bool = False
) -> tuple[dict[str, float], float, bool]:
    """({statistic: its error}, rms difference, True if the companion diverges from the run) of a series.

    fine, coarse: in the same window; errors are scaled from it to the series by their ranges, unless it is the `whole`.
    """
    if not all(np.isfinite(one.x).all() for one in (fine, coarse)):
        return UNKNOWN, math.nan, False
    x = np.interp(coarse.t, fine.t, fine.x)
    rms = math.sqrt(np.mean((x - coarse.x) ** 2))
    share = np.ptp(series.x) / np.ptp(fine.x) if np.ptp(fine.x) > 0 and not whole else 1.0
    one, other = numbers_of(fine), numbers_of(coarse)
    lost = bool(rms > LOST * fine.standard_deviation and rms > 100 * series.noise)
    return {n: share * (other[n] - one[n]) / factor for n in FLOOR}, share * rms, lost


def _of_steps(series: Series, alongside: Series | None, corrected: Series | None) -> tuple[dict[str, float], float]:
    """({statistic: error due to the time steps}, its rms over time), nan if unknown.

    alongside, corrected: in the same window; errors are scaled from it to the series by their ranges.
    """
    if alongside is None or corrected is None or not np.all(np.isfinite(corrected.x)):
        return UNKNOWN, math.nan
    one, other = numbers_of(alongside), numbers_of(corrected)
    share = np.ptp(series.x) / np.ptp(alongside.x) if np.ptp(alongside.x) > 0 else 1.0
    return {n: share * (one[n] - other[n]) for n in FLOOR}, share * math.sqrt(np.mean((alongside.x - corrected.x) ** 2))


def _left(corrected: Series, alongside: Series | None) -> bool:
    """True if the corrected trajectory could not follow a run of finite values to its end."""
    followed = np.isfinite(corrected.x[:-1])  # the last step may be a shorter one
    return not followed.all() and alongside is not None and bool(np.isfinite(alongside.x).all())


def corrected_of(record: "xr.Dataset") -> "xr.Dataset":
    """The record minus the time-step errors found; series without them are left out."""
    names = [name for name in record.data_vars if name + ERROR in record]
    return record[names].assign({name: record[name] - record[name + ERROR] for name in names})


def _instant(series: Series, number: str) -> float:
    """Time at which a series has its extreme [s]; -inf for a mean, which every part of a sea shows."""
    extremes = {"max": series.x.argmax, "min": series.x.argmin}
    return series.t[extremes[number]()] if number in extremes else -math.inf


def _verdict(bar: float, size: float, reason: str | None, lost: bool, noise: float) -> str:
    if reason is not None or math.isnan(bar) or bar > max(LARGEST * size, 10 * noise):
        return NONE
    return SUSPECT if lost else RESOLVED


def _cut(record: "xr.Dataset", companion: "xr.Dataset") -> str | None:
    """A sentence if steps of either record had to be retried."""
    for name, one in (("the run", record), ("a run with twice the step and half the elements", companion)):
        if one.attrs.get("failed_steps", 0):
            return f"Steps of {name} failed and were retried with smaller ones."
    return None


def _rings(series: AllSeries) -> str | None:
    """A sentence if a tension alternates from step to step, as with steps that are too long for the scheme."""
    for (name, _), one in series.items():
        if unit_of_series(name) != "N" or len(one.x) < 8 or np.ptp(one.x) <= 100 * one.noise:
            continue
        share = alternating(one) / np.ptp(one.x)
        if share > RINGING:
            share = f"{100 * share:.2g} % of its range"
            return f"{one.label} jumps to and fro from step to step, by {share}: the steps are too long."
    return None


def alternating(series: Series) -> float:
    """Rms of the component of a series that changes sign with every step, from fourth differences over 16."""
    return math.sqrt(np.mean(np.diff(series.x, 4) ** 2)) / 16


def is_smooth(scene: Scene) -> bool:
    """True if no line goes slack or lands on a bed."""
    return scene.seabed is None and all(piece.section.slack == "compressive" for piece in scene.network.pieces)


def _of_elements(scene: Scene) -> bool:
    """True if end tensions are those of the end elements: off by half an element, hence first order."""
    return any(piece.section.tension_degree == 0 for piece in scene.network.pieces)


def _newton(scene: Scene, series: Series) -> float:
    tolerance = scene.solver.step_tolerance
    return OF_NEWTON * tolerance * float(np.ptp(series.x)) if tolerance <= BOUNDED else math.nan


def _chance(scene: Scene, series: Series) -> dict[str, float]:
    """Scatter over seeds of an irregular sea of the mean and standard deviation, estimated from one run.

    For the mean, from the spectrum near frequency 0; for the standard deviation s, s sqrt(memory/T)/2.
    """
    if scene.waves is None or not scene.waves.irregular or series.standard_deviation <= 100 * series.noise:
        return {}
    grid = np.linspace(series.t[0], series.t[-1], len(series.t))
    taper = np.hanning(len(grid))
    power = np.abs(np.fft.rfft(taper * np.interp(grid, series.t, series.x - series.mean))) ** 2
    of_mean = math.sqrt(power[LOWEST].mean() / (len(grid) * np.sum(taper**2)))
    return {"mean": of_mean, "std": series.standard_deviation * math.sqrt(series.memory / np.ptp(grid)) / 2}


def _variables(found: dict[Output, Bar]) -> dict[str, Any]:
    """Variables of a record over `output`, by name."""
    bars = list(found.values())
    columns = {
        "bar_value": ([b.value for b in bars], "value of the output, after the ramp"),
        "bar": ([b.bar for b in bars], "half the width of its error bar; nan where nothing is known"),
        "bar_time": ([b.time for b in bars], "part of the time steps; nan where it is not known apart"),
        "bar_space": ([b.space for b in bars], "part of the elements; nan where it is not known apart"),
        "bar_newton": ([b.newton for b in bars], "bound of the solver's part of it; nan: not bounded"),
        "bar_statistics": ([b.chance for b in bars], "scatter over seeds of the sea, no part of the bar"),
    }
    made = {name: ("output", np.array(x), {"units": "1", "long_name": text}) for name, (x, text) in columns.items()}
    for name in made:
        made[name][2]["units"] = "as bar_unit"
    made["bar_unit"] = ("output", np.array([unit_of_series(o.series) for o in found], dtype=object))
    verdicts = np.array([b.verdict for b in bars], dtype=object)
    made["bar_verdict"] = ("output", verdicts, {"long_name": "resolved, suspect, or none: nothing is known"})
    return made


def _labels(found: dict[Output, Bar]) -> dict[str, Any]:
    names = np.array([str(output) for output in found], dtype=object)
    parts = np.array([output.part for output in found], dtype=object)
    return {
        "output": ("output", names, {"long_name": "series and its max, min, mean or std"}),
        "output_of": ("output", parts, {"long_name": "name of the cable or buoy"}),
    }
