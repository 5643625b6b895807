"""What an irregular sea asks of whoever wants its statistics: components, length and number of runs, computing time."""

import math

from ..model.components import components_of, spectrum_of
from ..model.sea_statistics import components_needed, scatter_of_m0
from ..results.certainty import HOURS, deviation_known, largest_crest, part_known
from ..results.compare import duration, percent

#: Numbers of seeds for which it is said how well they tell the largest value.
SEEDS = (10, 30, 100)


def has_seeds(scene) -> bool:
    """Whether the scene's sea is one of many: a spectrum with random phases."""
    return scene.waves is not None and scene.waves.spectrum is not None


def mean_period(scene) -> float:
    """Tz of its sea [s]."""
    sea = components_of(scene.waves)
    return 2 * math.pi * math.sqrt(sea.moment(0) / sea.moment(2))


def components_for(scene, part: float) -> int:
    """Components that keep the largest crest of HOURS within a part of itself, beside infinitely many."""
    return components_needed(max(HOURS * 3600 / mean_period(scene), 2.0), part)


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
    memory = scatter_of_m0(spectrum_of(scene.waves), 1.0) ** 2
    lengths = dict.fromkeys((max(scene.time.end - scene.waves.ramp, memory), HOURS * 3600))
    deviation = ", ".join(f"{percent(deviation_known(memory, length))} by {duration(length)}" for length in lengths)
    largest = "; ".join(_told(scene, largest_crest(mean_period(scene)), seeds, seconds) for seeds in SEEDS)
    return (
        f"19 times in 20 a standard deviation is known to {deviation}; {HOURS:g} h maximum, above the mean, {largest}. "
        "So it is of what follows the sea; snaps and slow drift ask for more, as `dolfbuoy statistics` then says."
    )


def _told(scene, largest, seeds, seconds):
    each = "" if seconds is None else f", {duration(seeds * HOURS * 3600 / scene.time.end * seconds)} of computing"
    return f"+- {percent(part_known(largest, seeds))}: {seeds} seeds{each}"
