"""Error bars of outputs from a run and its companion, and what they are worth.

With steps h and N elements the error is about C_t h^p + C_s N^-q.  A companion with r h and N/r is off by r^p and r^q
times as much, so that the difference of the two numbers is r^2 - 1 times the error where p = q = 2, and about half of
that where part of it is of first order: of backward Euler, of lines that go slack or land, and of tensions of the
element at an end.  Source: Richardson's extrapolation; half is what covers the errors of runs whose truth is known.
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
#: Least bar of an extreme over the rms difference of the series, divided as the differences are, and of a mean.
FLOOR = {"max": 1.0, "min": 1.0, "mean": 0.25, "std": 0.25}
#: Share of the range beyond which a bar says that nothing is known.
LARGEST = 0.25
#: Share of the range by which a tension may jump to and fro from step to step (rms): with 0.48 % maxima are still what
#: the bars say, with 0.66 % (`short`, generalized-alpha, a fiftieth of the period) they are 4 % of the range off.
RINGING = 0.006
#: Rms difference over the standard deviation of a series beyond which the companion goes another way.
LOST = 0.3
#: An error of the steps (rms) that is so many times what the companion shows contradicts it.
CONTRADICTED = 3
#: Errors of which nothing is known.
UNKNOWN = dict.fromkeys(FLOOR, math.nan)
#: Newton's tolerance bounds its error up to here, by this share of it and of the range.
BOUNDED, OF_NEWTON = 1e-4, 0.25

#: Lines of a tapered periodogram that stand for frequency 0.
LOWEST = slice(2, 10)


class Bar(NamedTuple):
    """Half the width of an error bar and its verdict, and what is known apart.

    time, space: parts of the steps and of the elements.  newton: bound of the solver's part.  chance: scatter of one
    seed of a sea, no part of the bar.  All in the unit of the output; nan where nothing is known.
    """

    value: float
    bar: float
    verdict: str
    time: float = math.nan
    space: float = math.nan
    newton: float = math.nan
    chance: float = math.nan


def dataset_of(found: dict[Output, Bar], sentences: list[str], scene: Scene) -> "xr.Dataset":
    """Bars of all outputs of a run over `output`, as its record has them."""
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

    companion: record of a coarser run, why it failed, or None where the steps' part alone is asked for.
    ratio: of its steps and elements to the run's.  events: records of companions around extremes, in their own times.
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
    """Series of a record and of the companion around an event, from where that has settled."""
    companion = companion.assign_coords(time=companion.time.values + event.begin)
    return [series_after(one, event.settled, event.end) for one in (record, companion)]


def _compared(
    series: Series, fine: Series, coarse: Series, factor: float, whole: bool = False
) -> tuple[dict[str, float], float, bool]:
    """({number: its error}, rms difference, True if the companion goes another way) of a series.

    fine, coarse: in one window, which stands for all of the series by the range in it, unless it is the `whole` matter.
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
    """({number: error that the steps make}, its rms over time), nan where that is not known.

    alongside, corrected: in one window, which stands for all of the series by the range in it.
    """
    if alongside is None or corrected is None or not np.all(np.isfinite(corrected.x)):
        return UNKNOWN, math.nan
    one, other = numbers_of(alongside), numbers_of(corrected)
    share = np.ptp(series.x) / np.ptp(alongside.x) if np.ptp(alongside.x) > 0 else 1.0
    return {n: share * (one[n] - other[n]) for n in FLOOR}, share * math.sqrt(np.mean((alongside.x - corrected.x) ** 2))


def _left(corrected: Series, alongside: Series | None) -> bool:
    """True if the trajectory without the error of the steps could not follow the run, a finite one, to its end."""
    followed = np.isfinite(corrected.x[:-1])  # the last step may be a shorter one
    return not followed.all() and alongside is not None and bool(np.isfinite(alongside.x).all())


def corrected_of(record: "xr.Dataset") -> "xr.Dataset":
    """The record without the errors of the steps that were found; empty of series without any."""
    names = [name for name in record.data_vars if name + ERROR in record]
    return record[names].assign({name: record[name] - record[name + ERROR] for name in names})


def _instant(series: Series, number: str) -> float:
    """When a series has its largest or smallest value [s]; -inf of a mean, which every part of a sea shows."""
    extremes = {"max": series.x.argmax, "min": series.x.argmin}
    return series.t[extremes[number]()] if number in extremes else -math.inf


def _verdict(bar: float, size: float, reason: str | None, lost: bool, noise: float) -> str:
    if reason is not None or math.isnan(bar) or bar > max(LARGEST * size, 10 * noise):
        return NONE
    return SUSPECT if lost else RESOLVED


def _cut(record: "xr.Dataset", companion: "xr.Dataset") -> str | None:
    """A sentence if steps of one of two records had to be retried."""
    for name, one in (("the run", record), ("a run with twice the step and half the elements", companion)):
        if one.attrs.get("failed_steps", 0):
            return f"Steps of {name} failed and were retried with smaller ones."
    return None


def _rings(series: AllSeries) -> str | None:
    """A sentence if a tension jumps to and fro from step to step, as it does where a scheme's steps are too long."""
    for (name, _), one in series.items():
        if unit_of_series(name) != "N" or len(one.x) < 8 or np.ptp(one.x) <= 100 * one.noise:
            continue
        share = alternating(one) / np.ptp(one.x)
        if share > RINGING:
            share = f"{100 * share:.2g} % of its range"
            return f"{one.label} jumps to and fro from step to step, by {share}: the steps are too long."
    return None


def alternating(series: Series) -> float:
    """Rms of the part of a series that changes its sign with every step, by fourth differences over 16."""
    return math.sqrt(np.mean(np.diff(series.x, 4) ** 2)) / 16


def is_smooth(scene: Scene) -> bool:
    """True if no line goes slack or lands on a bed."""
    return scene.seabed is None and all(piece.section.slack == "compressive" for piece in scene.network.pieces)


def _of_elements(scene: Scene) -> bool:
    """True if tensions at ends are those of the elements there: off by half an element, which is of first order."""
    return any(piece.section.tension_degree == 0 for piece in scene.network.pieces)


def _newton(scene: Scene, series: Series) -> float:
    tolerance = scene.solver.step_tolerance
    return OF_NEWTON * tolerance * float(np.ptp(series.x)) if tolerance <= BOUNDED else math.nan


def _chance(scene: Scene, series: Series) -> dict[str, float]:
    """Standard deviations of mean and standard deviation over seeds of an irregular sea, from one run.

    Of the mean, from the spectrum next to frequency 0; of the standard deviation s, s sqrt(memory/T)/2.
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
