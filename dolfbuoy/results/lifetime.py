"""Lifetime over sea states with their probabilities, and a design wave compared with the seeds of one sea state."""

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from ..errors import InputError
from ..scene.variants import in_words, probabilities
from .extremes import DURATION, HOURS, Gumbel
from .sample import YEAR, Fatigue
from .series import described, place_of
from .statistics import Run, curves_in_words, gumbels, labels_of, shortest_life

#: Default return period of the largest value.
YEARS = 50.0


def lifetime(runs: list[Run], scatter: Path, fatigue: Fatigue, years: float = YEARS) -> xr.Dataset:
    """Fatigue and largest value over a life, over `series` of a cable or buoy `part`.

    Damage and equivalent load per year, life in years (also divided by a safety factor in the scenes), and the value
    exceeded by the maximum of 3 h once in this many years on average (nan: some sea state has too few seeds).
    scatter: CSV with the keys varied by the sweep and `probability`; the remainder to 1 is calm, without damage or
    load.  Raises InputError if a sea state with a probability has no run.
    """
    if not 0 < years < math.inf:
        raise InputError(f"--years {years}: must be a positive number.")
    states, reasons = list(_states(runs, scatter)), list[str]()
    labels = list(dict.fromkeys([*labels_of(runs, "peaks"), *labels_of(runs, "cycles")]))
    curves: dict[str, list[str]] = {}
    rows = [_row(label, states, fatigue, years, reasons, curves) for label in labels]
    factor = max((fatigue.factor(run.sample) for _, mine in states for run in mine), default=1.0)
    names = {
        "damage_per_year": "Miner sum of a year",
        "life": "years until the Miner sum is 1",
        "equivalent_load": "constant range that does the same, in the unit of the series",
        "largest": f"exceeded by the largest of {HOURS:g} h once in {years:g} years, in the unit of the series",
    }
    data = {n: ("series", [row[i] for row in rows], {"long_name": names[n]}) for i, n in enumerate(names)}
    if factor > 1:
        with_factor = {"long_name": f"life over the safety factor {factor:g}"}
        data["life_with_factor"] = "series", [row[1] / factor for row in rows], with_factor
    notes = "\n".join([*reasons[:1], *curves_in_words(curves), *shortest_life(labels, data["life"][1], factor)])
    attributes = {"years": years, "probability": sum(p for p, _ in states), "safety_factor": factor, "notes": notes}
    return xr.Dataset(data, _over_series(labels), attrs=attributes)


def _over_series(labels: list[str]) -> dict[str, Any]:
    """Coordinates of a dataset with one value for each series."""
    return {
        "series": [place_of(label).name for label in labels],
        "part": ("series", [place_of(label).part for label in labels]),
        "unit": ("series", [described(label)[0] for label in labels]),
    }


def against_seeds(runs: list[Run], design: Run) -> xr.Dataset:
    """Largest values of a design-wave run compared with the 3 h extremes of one set of runs, over `series`.
    Gives the probability that the 3 h maximum exceeds it, and the `most_probable` maximum.  Raises InputError.
    """
    if len({run.set for run in runs}) != 1:
        raise InputError("--design: goes with runs that differ in their seed only.")
    rows = {}
    for label in labels_of(runs, "peaks"):
        if label in design.sample["series"]:
            gumbel, length = gumbels(runs, label)
            largest, times = design.sample["series"][label]["maximum"], DURATION / length
            rows[label] = largest, gumbel.most_probable(times), float(gumbel.above(largest, times))
    names = {
        "largest": "largest value in the design wave, in the unit of the series",
        "most_probable": f"most probable largest value of {HOURS:g} h, in the unit of the series",
        "above": f"probability that the largest value of {HOURS:g} h is above that of the design wave",
    }
    columns = zip(*rows.values(), strict=True)
    data = {n: ("series", list(column), {"long_name": names[n]}) for n, column in zip(names, columns, strict=True)}
    return xr.Dataset(data, _over_series(list(rows)))


def _states(runs: list[Run], scatter: Path) -> Iterator[tuple[float, list[Run]]]:
    """(probability, runs) of every sea state that occurs."""
    for changes, probability in probabilities(scatter):
        mine = [run for run in runs if run.changes == changes]
        if probability > 0 and not mine:
            which = f"{in_words(changes)}, whose probability is {probability:g}"
            raise InputError(f"--scatter {scatter}: there is no run with {which}.")
        if probability > 0:
            yield probability, mine


def _row(
    label: str,
    states: list[tuple[float, list[Run]]],
    fatigue: Fatigue,
    years: float,
    reasons: list[str],
    curves: dict[str, list[str]],
) -> tuple[float, float, float, float]:
    """Damage per year, life, equivalent load, largest value; nan if unknown, for the last with a reason."""
    damage = load = largest = life = math.nan
    if all(label in run.sample["cycles"] for _, mine in states for run in mine):
        lengths = [sum(run.sample["duration"] for run in mine) for _, mine in states]
        rate = sum(  # sum n S^m per second
            p * (sum(fatigue.power_sum(run.sample, label) for run in mine) / length)
            for (p, mine), length in zip(states, lengths, strict=True)
        )
        load = (rate / fatigue.frequency) ** (1 / fatigue.exponent)
        worn = [[fatigue.damage(run.sample, label) for run in mine] for _, mine in states]
        known = [[one for one in some if one is not None] for some in worn]
        if known == worn:
            sums = (sum(one.sum for one in some) for some in known)
            damage = YEAR * sum(p * x / t for (p, _), x, t in zip(states, sums, lengths, strict=True))
            life = fatigue.life(states[0][1][0].sample, label, damage)
            for one in itertools.chain.from_iterable(known):
                curves.setdefault(one.curve, []).append(label)
    try:
        largest = _largest([(p, *gumbels(mine, label)) for p, mine in states], years)
    except InputError as error:
        reasons.append(f"No largest value of {years:g} years: {error}.")
    return damage, life, load, largest


def _largest(states: list[tuple[float, Gumbel, float]], years: float) -> float:
    """The value exceeded by the maximum of 3 h once in this many years; states: (probability, Gumbel, length of a run).

    Root of the exceedance probability of the maximum of any 3 h; nan if the states together are rarer than that.
    """
    from scipy.optimize import brentq

    allowed = DURATION / (years * YEAR)
    if sum(p for p, *_ in states) <= allowed:
        return math.nan

    def above(x: float) -> float:
        return float(sum(p * g.above(x, DURATION / t) for p, g, t in states))

    low = min(g.location - 5 * g.scale for _, g, _ in states)
    high = max(g.most_probable(DURATION / t) + g.scale * (math.log(1 / allowed) + 5) for _, g, t in states)
    return float(brentq(lambda x: math.log(above(x) / allowed), low, high, xtol=1e-12 * max(abs(high), 1e-300)))
