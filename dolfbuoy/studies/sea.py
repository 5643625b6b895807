"""Requirements of statistics in an irregular sea: components, length and number of runs, computing time."""

import math
from typing import Any

from ..model.airy import components_of, spectrum_of
from ..parallel.cases import duration
from ..results.compare import percent
from ..results.extremes import (
    DURATION,
    HOURS,
    components_needed,
    crests_of,
    deviation_uncertainty,
    largest_crest,
    memory_of,
)
from ..scene import Scene

#: Numbers of seeds for which the uncertainty of the largest value is given.
SEEDS = (10, 30, 100)


def has_seeds(scene: Scene) -> bool:
    """True if the scene's sea is a realisation of a spectrum with random phases."""
    return scene.waves is not None and scene.waves.spectrum is not None


def mean_period(scene: Scene) -> float:
    """Tz of the scene's sea [s]."""
    waves: Any = scene.waves
    sea = components_of(waves)
    return 2 * math.pi * math.sqrt(sea.moment(0) / sea.moment(2))


def components_for(scene: Scene, part: float) -> int:
    """Components for which the largest crest of HOURS is within `part` of that with infinitely many."""
    return components_needed(crests_of(mean_period(scene)), part)


def of_components(scene: Scene, part: float) -> str:
    """One sentence."""
    waves: Any = scene.waves
    return (
        f"The sea: {components_for(scene, part)} components keep its largest crest of {HOURS:g} h within "
        f"{percent(part)}; the scene has {waves.components}."
    )


def of_statistics(scene: Scene, seconds: float | None = None) -> str:
    """One sentence on quantities that follow the sea; seconds: computing time of a run of the scene.

    About the mean, for which no theory is needed; a pilot is too short for more.
    """
    waves: Any = scene.waves
    spectrum: Any = spectrum_of(waves)
    memory, end = memory_of(spectrum), scene.time.end if scene.time else math.inf
    lengths = dict.fromkeys((max(end - waves.ramp, memory), DURATION))
    known = [f"{percent(deviation_uncertainty(memory, length))} by {duration(length)}" for length in lengths]
    crest, largest = largest_crest(crests_of(mean_period(scene))), []
    for seeds in SEEDS:
        largest.append(f"+- {percent(crest.uncertainty(seeds))}: {seeds} seeds")
        if seconds is not None:
            largest[-1] += f", {duration(seeds * DURATION / end * seconds)} of computing"
    return (
        f"19 times in 20 a standard deviation is known to {', '.join(known)}; {HOURS:g} h maximum, above the mean, "
        f"{'; '.join(largest)}. "
        "So it is of what follows the sea; snaps and slow drift ask for more, see `dolfbuoy statistics`."
    )
