"""Needs of statistics in an irregular sea: components, length and number of runs, computing time."""

import math

from ..model.airy import components_of, spectrum_of
from ..results.compare import duration, percent
from ..results.extremes import (
    DURATION,
    HOURS,
    components_needed,
    crests_of,
    deviation_uncertainty,
    largest_crest,
    memory_of,
)

#: Numbers of seeds for which it is said how well they tell the largest value.
SEEDS = (10, 30, 100)


def has_seeds(scene) -> bool:
    """True if the scene's sea is one of many: a spectrum with random phases."""
    return scene.waves is not None and scene.waves.spectrum is not None


def mean_period(scene) -> float:
    """Tz of its sea [s]."""
    sea = components_of(scene.waves)
    return 2 * math.pi * math.sqrt(sea.moment(0) / sea.moment(2))


def components_for(scene, part: float) -> int:
    """Components that keep the largest crest of HOURS within a part of itself, beside infinitely many."""
    return components_needed(crests_of(mean_period(scene)), part)


def of_components(scene, part: float) -> str:
    """One sentence."""
    return (
        f"The sea: {components_for(scene, part)} components keep its largest crest of {HOURS:g} h within "
        f"{percent(part)}; the scene has {scene.waves.components}."
    )


def of_statistics(scene, seconds: float | None = None) -> str:
    """One sentence on whatever follows the sea; seconds: computing time of a run of the scene.

    Beside the mean, for which no theory is needed; a pilot is too short to tell more.
    """
    memory = memory_of(spectrum_of(scene.waves))
    lengths = dict.fromkeys((max(scene.time.end - scene.waves.ramp, memory), DURATION))
    known = [f"{percent(deviation_uncertainty(memory, length))} by {duration(length)}" for length in lengths]
    crest = largest_crest(crests_of(mean_period(scene)))
    largest = "; ".join(_told(scene, crest, seeds, seconds) for seeds in SEEDS)
    return (
        f"19 times in 20 a standard deviation is known to {', '.join(known)}; {HOURS:g} h maximum, above the mean, "
        f"{largest}. "
        "So it is of what follows the sea; snaps and slow drift ask for more, as `dolfbuoy statistics` then says."
    )


def _told(scene, largest, seeds, seconds):
    each = "" if seconds is None else f", {duration(seeds * DURATION / scene.time.end * seconds)} of computing"
    return f"+- {percent(largest.uncertainty(seeds))}: {seeds} seeds{each}"
