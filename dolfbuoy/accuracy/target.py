"""Successively finer runs, until the error bars of the requested outputs meet an accuracy.

The last run but one is the companion of the last, so that all together take about twice as long as the last.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..parallel.ranks import bcast
from ..results.quantities import QUANTITIES
from ..results.sample import lasts
from ..scene import Scene
from ..scene.settings import NEWTON, Space, Stepping, fitting, period_of, space_of, with_settings
from .bars import NONE, Bar, bars_of
from .companion import companion_of
from .outputs import ANCHOR, LASTING, NUMBERS, Output, unit_of_series

if TYPE_CHECKING:
    import xarray as xr

    from .companion import Event

#: Outputs requested by default, as far as the scene has them.
USUAL = ("tension_top.max", "anchor.max", "cone_angle.max")
#: Steps per period in the first run, least number of elements per piece of line, and Newton tolerance over accuracy.
STEPS, ELEMENTS, OF_NEWTON = 40, 8, 1e-2
#: A run is accurate enough if all bars are within this fraction of the target, as bars are estimates.
ENOUGH = 0.7
#: Least and largest refinement from one run to the next, and safety factor on the predicted error.
LEAST, MOST, MARGIN = 1.4, 3.0, 1.6
#: Smallest tensions are scaled by at least this fraction of the largest.
OF_LARGEST = 0.2


@dataclass
class Round:
    """A run with its bars; worst: the largest ratio of a bar to its target, for `output`."""

    scene: Scene
    record: "xr.Dataset"
    bars: dict[Output, Bar]
    sentences: list[str]
    worst: float
    output: Output


def reach(scene: Scene, run: Callable[[Scene, bool], "xr.Dataset"], comm: Any = MPI.COMM_SELF) -> Round:
    """The first run whose outputs are accurate enough, or the last of `accuracy.rounds`; collective.

    run: computes a scene; its second argument is True if the run may be the last.  Raises InputError for outputs that a
    run does not have, SolveError if all runs failed.
    """
    check_names(scene)
    chosen, found, ratio = first(scene), None, 2.0
    companion = _tried(run, companion_of(chosen), False)
    for _ in range(scene.accuracy.rounds):
        record = _tried(run, chosen, True)
        if isinstance(record, Exception):
            failure, ratio, companion = record, 2.0, record
        else:
            found = _judged_by_first(comm, chosen, record, companion, ratio)
            if found.worst <= ENOUGH:
                return found
            companion, ratio = record, _refinement(found)
        chosen = _finer(chosen, ratio)
    if found is None:
        raise failure
    return found


def first(scene: Scene) -> Scene:
    """The scene with the settings of the first run: BDF2, P1-P0, equal steps."""
    period, space = period_of(scene), space_of(scene)
    step = min(period / STEPS, scene.time.end / STEPS) if period else scene.time.step
    newton = min(OF_NEWTON * scene.accuracy.target, 1e-4, max(scene.solver.step_tolerance, NEWTON))
    if space.mu:
        cells = max(space.cells, ELEMENTS * len(scene.network.pieces))
        space = fitting(scene, Space(1, 0, cells))
    return with_settings(scene, space, Stepping("bdf2", step, newton=newton))


def _tried(run, scene, last):
    """The record of a run, or its SolveError."""
    try:
        return run(scene, last)
    except SolveError as error:
        return error


def _judged_by_first(comm, scene, record, companion, ratio):
    """As `judged`, by rank 0, which has the records, for all ranks."""
    found = None
    if comm.rank == 0:
        try:
            found = judged(scene, record, companion, ratio)
        except InputError as error:
            found = error
    found = bcast(comm, found if isinstance(found, InputError | None) else replace(found, record=None))
    if isinstance(found, InputError):
        raise found
    return replace(found, record=record)


def judged(
    scene: Scene,
    record: "xr.Dataset",
    companion: "xr.Dataset | Exception",
    ratio: float = 2.0,
    events: "Mapping[Event, xr.Dataset] | None" = None,
) -> Round:
    """A run with its bars, and the largest of those requested; arguments as in `bars_of`."""
    bars, sentences = bars_of(record, scene, companion, ratio, events)
    wanted = wanted_of(scene, bars)
    shares = {output: bars[output].bar / (scene.accuracy.target * scale_of(output, bars)) for output in wanted}
    shares = {o: math.inf if bars[o].verdict == NONE or math.isnan(share) else share for o, share in shares.items()}
    worst = max(shares, key=shares.get)
    return Round(scene, record, bars, sentences, shares[worst], worst)


def check_names(scene: Scene) -> None:
    """Raise InputError, before a run, for outputs that no run of the scene has."""
    check_outputs(scene, scene.accuracy.of, "accuracy.of")


def check_outputs(scene: Scene, names: Iterable[str], where: str, every: bool = False) -> None:
    """Raise InputError, naming `where`, for outputs (SERIES.NUMBER) that no run of the scene has.

    every: also allow outputs without error bars, as in `outputs_of`.
    """
    network = scene.network
    missing = {kind for kind, there in (("cable", network.cables), ("buoy", network.buoys)) if not there}
    timed = [one for one in QUANTITIES.values() if one.over == "time" or (every and not one.over and one.read)]
    there = [one for one in timed if not one.effort and one.kind not in missing]
    known = {label: one for one in there for label in (one.name, *(one.series("xyz") if "xyz" in one.dims else ()))}
    for name in names:
        series, _, number = name.rpartition(".")
        numbers = NUMBERS + ((LASTING,) if every and series in known and lasts(series) else ())
        if number not in numbers or not (series in known or (series == ANCHOR and network.cables)):
            outputs = [label for label, one in known.items() if one.has_outputs or not one.over]
            near = get_close_matches(series or name, outputs, 3, 0.0)
            raise InputError(
                f"{where} {name}: must be an output of this scene, SERIES.NUMBER as tension_top.max; near it are "
                f"{', '.join(near)}; numbers are {', '.join(numbers)}."
            )


def wanted_of(scene: Scene, bars: dict[Output, Bar]) -> list[Output]:
    """The requested outputs of all lines and buoys.  Raises InputError for one that the scene does not have."""
    names = list(dict.fromkeys(str(output) for output in bars))
    asked = scene.accuracy.of or [name for name in USUAL if name in names]
    for name in asked:
        if name not in names:
            raise InputError(f"accuracy.of {name}: this scene has {', '.join(names)}.")
    return [output for output in bars if str(output) in asked]


def scale_of(output: Output, bars: dict[Output, Bar]) -> float:
    """Scale of the accuracy of an output: its value for forces, else the range of its series."""
    value, least, largest = (bars[output._replace(number=n)].value for n in (output.number, "min", "max"))
    if unit_of_series(output.series) != "N":
        return max(largest - least, 1e-300)
    return max(abs(value), OF_LARGEST * abs(largest) if output.number == "min" else 0.0, 1e-300)


def _refinement(found):
    """Factor by which to refine the next run, for second-order errors."""
    if math.isinf(found.worst):
        return 2.0
    return min(max(math.sqrt(MARGIN * found.worst / ENOUGH), LEAST), MOST)


def _finer(scene, ratio):
    space = space_of(scene)
    if space.mu:
        space = fitting(scene, replace(space, cells=round(space.cells * ratio)))
    tolerance = scene.solver.step_tolerance
    return with_settings(scene, space, Stepping("bdf2", scene.time.step / ratio, newton=tolerance))


def sentence_of(found: Round) -> str:
    """Sentence on the accuracy reached, for the least accurate output."""
    output, bar = found.output, found.bars[found.output]
    name = f"{output} of {output.part}" if output.part else str(output)
    target = 100 * found.scene.accuracy.target
    if math.isinf(found.worst):
        return f"{target:g} % was not reached: the error of {name} is not known. {' '.join(found.sentences)}".rstrip()
    share = 100 * bar.bar / scale_of(output, found.bars)
    return f"{target:g} % was not reached: {name} is known to {share:.2g} %."
