"""What a scatter diagram makes of sea states: wear of a year, and the largest value of many.

Each sea state, a set of runs, comes with a probability; what is left of 1 is calm, and neither wears nor loads.
"""

import math
from pathlib import Path

import numpy as np
import xarray as xr

from ..errors import InputError
from ..roots import brentq
from ..scene.variants import probabilities
from . import cycles
from .certainty import HOURS
from .ensemble import Fatigue, Run, gumbels
from .statistics import OF_PART, described

#: Years of the largest value, by default.
YEARS = 50.0


def lifetime(runs: list[Run], scatter: Path, fatigue: Fatigue, years: float = YEARS) -> xr.Dataset:
    """Over `series`, each of the cable or buoy `part`: damage per year, life in years, equivalent load of the whole
    year, and the value that the largest of 3 h exceeds once in so many years on the average (nan: some sea state has
    too few seeds).

    scatter: CSV with the keys that the sweep varies and `probability`.  Raises InputError if a sea state with a
    probability has no run.
    """
    if not 0 < years < math.inf:
        raise InputError(f"--years {years}: must be a positive number.")
    states = _states(runs, scatter)
    labels = list(dict.fromkeys(label for run in runs for label in run.sample["peaks"]))
    rows = [_row(label, states, fatigue, years) for label in labels]
    names = {
        "damage_per_year": "Miner sum of a year",
        "life": "years until the Miner sum is 1",
        "equivalent_load": "constant range that does the same, in the unit of the series",
        "largest": f"exceeded by the largest of {HOURS:g} h once in {years:g} years, in the unit of the series",
    }
    data = {n: ("series", np.array([row[n] for row in rows]), {"long_name": text}) for n, text in names.items()}
    series, parts = ([label.partition(OF_PART)[i] for label in labels] for i in (0, 2))
    coordinates = {"series": series, "part": ("series", parts)}
    coordinates["unit"] = ("series", [described(label)[0] for label in labels])
    told = {"years": years, "probability": sum(p for p, _ in states), "notes": _why_not(labels, states, years)}
    return xr.Dataset(data, coordinates, attrs=told)


def _why_not(labels, states, years):
    """A sentence on why there is no largest value, if there is none of a series."""
    for label, (_, mine) in ((label, state) for label in labels for state in states):
        try:
            gumbels(mine, label)
        except InputError as error:
            return f"No largest value of {years:g} years: {error}."
    return ""


def _states(runs, scatter):
    """[(probability, its runs), ...]."""
    found = []
    for changes, probability in probabilities(scatter):
        mine = [run for run in runs if run.changes == changes]
        if probability > 0 and not mine:
            what = ", ".join(f"{key} = {value}" for key, value in changes.items())
            raise InputError(f"--scatter {scatter}: there is no run with {what}, whose probability is {probability:g}.")
        if probability > 0:
            found.append((probability, mine))
    return found


def _row(label, states, fatigue, years):
    wear = sum(p * _rate(label, mine, fatigue.exponent) for p, mine in states)  # sum n S^m per second
    damage = wear * cycles.YEAR / fatigue.constant if fatigue.constant and _worn(label, states) else math.nan
    load = (wear / fatigue.frequency) ** (1 / fatigue.exponent) if _worn(label, states) else math.nan
    life = 1 / damage if damage > 0 else math.nan
    return {"damage_per_year": damage, "life": life, "equivalent_load": load, "largest": _largest(label, states, years)}


def _worn(label, states):
    return all(label in run.sample["cycles"] for _, mine in states for run in mine)


def _rate(label, runs, exponent):
    """sum n S^m per second of a sea state, over all its runs."""
    pairs = [map(np.array, run.sample["cycles"].get(label, ([], []))) for run in runs]
    return sum(cycles.miner_sum(*pair, exponent, 1.0) for pair in pairs) / sum(r.sample["duration"] for r in runs)


def _largest(label, states, years):
    """Root of the probability that the largest value of any 3 h is above it."""
    allowed = HOURS * 3600 / (years * cycles.YEAR)
    try:
        found = [(p, *gumbels(mine, label)) for p, mine in states]
    except InputError:
        return math.nan

    def above(x):
        return sum(p * -math.expm1(-HOURS * 3600 / t * math.exp(-(x - g.location) / g.scale)) for p, g, t in found)

    if sum(p for p, _ in states) <= allowed:
        return math.nan  # so rare are they
    low = min(g.location - 5 * g.scale for _, g, _ in found)
    high = max(g.most_probable(HOURS * 3600 / t) + g.scale * (math.log(1 / allowed) + 5) for _, g, t in found)
    return float(brentq(lambda x: math.log(above(x) / allowed), low, high, xtol=1e-12 * max(abs(high), 1e-300)))
