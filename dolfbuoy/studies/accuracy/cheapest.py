"""Cheapest settings for outputs such as largest tensions: short pilot, prediction, and a run with error bars.

The pilot is the beginning of the scene.  In time, every scheme runs on one mesh with steps halved; in space, every
pair runs at one step with elements doubled.  The share of a run, its bar from the run before it over the required
accuracy, falls as a power of step and elements.  The cheapest settings whose shares add up to ENOUGH are run over the
whole scene with a companion, as in `run --bars`, and compared with a run of half the step and twice the elements.  If
the error exceeds the prediction, the shares of this pair and scheme are raised by the ratio, those of others by its
square root, and the next cheapest settings are tried.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...accuracy.bars import is_smooth
from ...accuracy.companion import companion_around, companion_of, covered, events_of
from ...accuracy.outputs import unit_of_series
from ...accuracy.target import ENOUGH, OF_NEWTON, USUAL, Round, check_names, judged, scale_of, wanted_of
from ...errors import SolveError
from ...results.bars import number_with
from ...results.compare import Curve, nice_numbers, percent
from ...results.style import COLORS, PAGE, PALETTE, STYLE, Figure, matplotlib, new_figure, plain_ticks
from ...results.tables import force_unit, groups, rounded, show
from ...scene import Scene, load_scene
from ...scene.sections import SCHEMES
from ...scene.settings import (
    Space,
    Stepping,
    check_time,
    fitting,
    period_of,
    shortened,
    space_of,
    stepping_of,
    with_settings,
)
from ..one_case import run
from ..study import Row, Table, save
from .pilot import meshes, moderate

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = {
    "settings": "settings",
    "predicted_percent": "error [%]",
    "predicted_seconds": "time [s]",
    "remark": "remark",
}
#: Highest order of each scheme in the step, and of each pair in the elements; fewest elements of a piece of line.
ORDERS = {"bdf2": 2, "generalized-alpha": 2, "backward-euler": 1}
PAIRS = {(2, 1): (4, 2), (3, 2): (4, 2), (1, 0): (2, 4)}
#: Steps per period in the pilot's first run, and largest number of halvings of step and elements.
FIRST, LEVELS = 10, 6
#: Share at which the pilot stops; beyond it the power laws are trusted.
NEAR = 2.0
#: A scheme or pair is dropped if it takes this many times the time of another to come as near.
DEARER = 2.0
#: Share that a prediction may use, largest number of verification runs, and share assumed for an unknown bar.
AIM, TRIES, UNKNOWN = 0.9 * ENOUGH, 7, 4.0
#: Largest share of an error against a finer run.
SURE = 0.9
#: Fraction of failed steps at which a run is given up: retries are expensive and give no valid result.
OFTEN = 0.2
#: Largest Newton tolerance.
LOOSEST = 1e-4


class Share(Curve):
    """Share over the step, or over 1/elements; below the finest with the observed order, but at most `highest`."""

    def __init__(self, points: Iterable[tuple[float, float]], highest: float) -> None:
        super().__init__((x, share) for x, share in points if math.isfinite(share))
        self.highest = highest

    @property
    def order(self) -> float:
        return min(max(super().order, 1.0), self.highest) if len(self.x) > 1 else min(2.0, self.highest)


@dataclass
class Choice:
    """Settings with their predicted share of the required accuracy, and CPU seconds of the whole run's steps."""

    space: Space
    stepping: Stepping
    share: float
    seconds: float

    def __str__(self) -> str:
        return f"{self.space}{self.stepping}"

    @property
    def family(self) -> tuple[str, str]:
        """Pair and scheme."""
        return self.space.pair, self.stepping.scheme


@dataclass
class Verified:
    """Settings for which the run of the whole scene has bars within the required accuracy."""

    scene: Scene
    accuracy: float
    choice: Choice
    found: Round
    candidates: list[Choice]
    rows: list[Row]
    notes: list[str]


class Pilot:
    """Runs of the beginning of a scene with [accuracy], each made once, and predictions for other settings."""

    def __init__(self, scene: Scene, accuracy: float) -> None:
        self.whole, self.accuracy = scene, accuracy
        self.scene = shortened(scene, periods=4)
        self.newton = min(OF_NEWTON * accuracy, LOOSEST)
        time, period = check_time(self.scene), period_of(scene)
        self.first = min(period / FIRST, time.end / FIRST) if period else min(8 * time.step, time.end / FIRST)
        self.mesh = moderate(scene)
        self.rows: list[Row] = []
        self.in_time: dict[str, Share] = {}
        self.in_space: dict[tuple[int, int], Share] = {}
        self._work: dict[str, dict[float, float]] = {}  #: scheme -> step -> Newton iterations and one more, a step
        self._rates: dict[tuple[int, int], dict[int, float]] = {}  #: pair -> elements -> seconds of one of these

    def measure(self) -> None:
        """Measure curves of all schemes and pairs.  Raises SolveError if no run comes near the required accuracy."""
        smooth, dearest, steps = is_smooth(self.whole), math.inf, {}
        for scheme, order in ORDERS.items():
            if order > 1 or not smooth:
                ways = [(self.mesh, self.first / 2**k, scheme) for k in range(LEVELS)]
                points, seconds = self._refined(ways, dearest)
                steps[scheme], dearest = min(points, default=math.inf), min(dearest, DEARER * seconds)
                self.in_time[scheme] = Share(points.items(), order)
        known = [scheme for scheme, curve in self.in_time.items() if len(curve.x)]
        if not known:
            raise SolveError(
                f"The pilot cannot promise {percent(self.accuracy)}: with no step down to "
                f"{self.first / 2 ** (LEVELS - 1):.3g} s is the error of the outputs known."
            )
        scheme, dearest = min(known, key=lambda name: self.in_time[name].error[0]), math.inf
        for (mu, nu), (order, fewest) in PAIRS.items() if self.mesh.mu else ():
            cells = [fewest * 2**k * len(self.whole.network.pieces) for k in range(LEVELS)]
            ways = [(fitting(self.whole, Space(mu, nu, n)), steps[scheme], scheme) for n in cells]
            points, seconds = self._refined(ways, dearest)
            dearest = min(dearest, DEARER * seconds)
            self.in_space[mu, nu] = Share(((1 / cells, share) for cells, share in points.items()), order)

    def _refined(self, ways: list[tuple[Space, float, str]], dearest: float) -> tuple[dict[float, float], float]:
        """({step or number of elements: share}, seconds of the finest run), each run the companion of the next.

        Stops when the share is NEAR, a run takes longer than `dearest`, or two refinements bring nothing.  Seconds are
        inf if the share is not NEAR.
        """
        coarse: xr.Dataset | Exception | None = None
        points, best, in_vain = {}, math.inf, 0
        in_space = len({space for space, _, _ in ways}) > 1
        for space, step, scheme in ways:
            scene = with_settings(self.scene, space, Stepping(scheme, step, newton=self.newton))
            record = tried(scene)
            if isinstance(record, Exception):
                coarse = record
                continue
            self._note(record, space, step, scheme)
            share = judged(scene, record, coarse).worst if coarse is not None else math.inf
            coarse, seconds = record, float(record.attrs["loop_seconds"])
            points[float(space.cells if in_space else step)] = share
            self.rows[-1] |= {"error_in": "space" if in_space else "time", "share": share}
            if share <= NEAR:
                return points, seconds
            in_vain = 0 if share < 0.7 * best or math.isinf(share) else in_vain + 1
            best = min(best, share)
            if (seconds > dearest and math.isfinite(best)) or in_vain > 1:
                break
        return points, math.inf

    def _note(self, record: "xr.Dataset", space: Space, step: float, scheme: str) -> None:
        """Record the cost of a run."""
        steps, seconds = record.sizes["time"] - 1, float(record.attrs["loop_seconds"])
        work = float(record.newton_iterations.sum()) / steps + 1
        self._work.setdefault(scheme, {})[step] = work
        self._rates.setdefault((space.mu, space.nu), {})[space.cells] = seconds / (work * steps)
        self.rows.append({"pair": space.pair, "cells": space.cells, "scheme": scheme, "step": step, "seconds": seconds})

    def seconds(self, space: Space, scheme: str, step: float) -> float:
        """CPU seconds of the whole run's steps: linear in the elements, with the iterations at the nearest step."""
        steps, works = zip(*sorted(self._work[scheme].items()), strict=True)
        cells, rates = zip(*sorted(self._rates[space.mu, space.nu].items()), strict=True)
        slope = max(np.polyfit(cells, rates, 1)[0], 0.0) if len(cells) > 1 else 0.0
        rate = max(np.mean(rates) + slope * (space.cells - np.mean(cells)), 0.5 * min(rates))
        return float(check_time(self.whole).end / step * np.interp(step, steps, works) * rate)

    def candidates(self, worse: dict[tuple[str, str], float], others: float) -> list[Choice]:
        """The cheapest settings of each pair and scheme predicted to suffice, cheapest first.

        worse: ratio of actual to predicted shares, by pair and scheme; others: for those not tried.
        """
        best: dict[tuple[str, str], Choice] = {}
        # a difference of 2 % in the number of elements does not matter
        spaces = meshes(self.whole, self.in_space, 8, 1.12) if self.mesh.mu else [(self.mesh, 0.0)]
        for space, of_space in spaces:
            for scheme, curve in self.in_time.items():
                factor = worse.get((space.pair, scheme), others)
                room = AIM / factor - of_space
                if not len(curve.x) or room <= 0:
                    continue
                step = curve.largest(room, nice_numbers(curve.x[0] / 1e3, curve.x[-1]))
                if step is None:
                    continue
                share, seconds = factor * (of_space + curve(step)), self.seconds(space, scheme, step)
                choice = Choice(space, Stepping(scheme, step, newton=self.newton), share, seconds)
                if choice.family not in best or seconds < best[choice.family].seconds:
                    best[choice.family] = choice
        return sorted(best.values(), key=lambda choice: choice.seconds)


def requested(scene: Scene, of: list[str], accuracy: float) -> Scene:
    """The scene with these outputs and accuracy required.  Raises InputError for outputs that it does not have."""
    scene = load_scene(scene, accuracy={"target": accuracy, "of": of})
    check_names(scene)
    return scene


def cheapest(scene: Scene, of: list[str], accuracy: float, say: Callable[..., object] = print) -> Verified:
    """Find and verify settings with which outputs meet an accuracy.

    of: names such as tension_top.max; if empty, the usual ones.  Raises InputError for outputs that the scene does not
    have, SolveError if no settings can be recommended.
    """
    scene = requested(scene, of, accuracy)
    pilot = Pilot(scene, accuracy)
    say(f"Pilot until t = {check_time(pilot.scene).end:g} s of {check_time(scene).end:g} s.")
    pilot.measure()
    worse: dict[tuple[str, str], float] = {}
    notes: list[str] = []
    others = 1.0
    for _ in range(TRIES):
        candidates = pilot.candidates(worse, others)
        if not candidates:
            break
        choice = candidates[0]
        settled = with_settings(scene, choice.space, choice.stepping)
        found = _verified(settled)
        share = math.inf if isinstance(found, Exception) else found.worst
        finer = _by_a_finer_run(found) if not isinstance(found, Exception) and share <= ENOUGH else math.inf
        if not isinstance(found, Exception) and finer <= SURE:
            return Verified(load_scene(settled, accuracy=None), accuracy, choice, found, candidates, pilot.rows, notes)
        times = UNKNOWN
        if isinstance(found, Exception):
            reason = f"it fails: {found}"
        elif math.isinf(min(share, finer)):
            reason = f"the error of {found.output} is not known. {' '.join(found.sentences)}".rstrip()
        else:
            off = share if share > ENOUGH else finer
            how = "known to" if off is share else "by a run of half the step and twice the elements off by"
            reason = f"{found.output} is {how} {percent(accuracy * off)}."
            times = UNKNOWN if math.isinf(off) else max(off / choice.share, 1.1)
            others = max(others, math.sqrt(times * worse.get(choice.family, others)))
        worse[choice.family] = times * worse.get(choice.family, 1.0)
        notes.append(f"{choice} is not enough: {reason}")
        say(notes[-1])
    names = ", ".join(of or USUAL)
    raise SolveError(f"No settings of the pilot keep {percent(accuracy)} in {names}. {' '.join(notes)}".rstrip())


def _verified(scene: Scene) -> Round | Exception:
    """A run of the whole scene with its bars, or its error."""
    record = tried(scene)
    if isinstance(record, Exception):
        return record
    around = {event: tried(companion_around(scene, event)) for event in events_of(scene, record)}
    events = {event: one for event, one in around.items() if not isinstance(one, Exception)}
    return judged(scene, record, tried(companion_of(scene)), events=events)


def _by_a_finer_run(found: Round) -> float:
    """Largest error over the required one, against a run with half the step and twice the elements.

    The cheapest of many settings may have small bars by luck; the finer run reveals it.
    """
    scene, stepping = found.scene, stepping_of(found.scene)
    space = space_of(scene)
    if space.mu:
        space = fitting(scene, replace(space, cells=2 * space.cells))
    finer = with_settings(scene, space, replace(stepping, step=stepping.step / 2))
    fine = load_scene(finer, time__end=covered(scene))
    record = tried(fine)
    if isinstance(record, Exception):
        return math.inf
    second = is_smooth(scene) and stepping.scheme != "backward-euler"
    return (4.0 if second else 2.5) * judged(fine, record, found.record).worst  # includes the finer run's own error


def tried(scene: Scene) -> "xr.Dataset | Exception":
    """The series of a run on this rank alone, or the reason why it failed or was given up."""
    time = check_time(scene)
    try:
        return run(load_scene(scene, accuracy=None), most=OFTEN * time.end / time.step)
    except SolveError as error:
        return error


def sentences(found: Verified) -> list[str]:
    """The advice in words."""
    bars, scene = found.found.bars, found.found.scene
    wanted = wanted_of(scene, bars)
    named = [str(output) for output in wanted]
    names = ", ".join(dict.fromkeys(named))
    seconds, coarse = found.found.record.attrs["loop_seconds"], companion_of(scene)
    end, until = check_time(scene).end, check_time(coarse).end
    what = f"{percent(found.accuracy)} in {names}: {found.choice}"
    messages = [f"{what}: {rounded(seconds)} s for the run until t = {end:g} s.", *found.notes]
    for output in wanted:
        bar, unit = bars[output], unit_of_series(output.series)
        unit, factor = force_unit(bar.value) if unit == "N" else (unit, 1.0)
        value, width = number_with(factor * bar.value, factor * bar.bar)
        share = percent(bar.bar / scale_of(output, bars))
        part = f" of {output.part}" if named.count(str(output)) > 1 else ""
        messages.append(f"{output}{part}: {value} +- {width} {unit}, {share}.")
    shorter = f" until t = {until:g} s" if until < end else ""
    return [*messages, f"Bars are those of this run and one with twice the step and half the elements{shorter}."]


def report(found: Verified, folder: Path) -> None:
    """Print the advice; save the table and the pilot's runs in `folder`."""
    keys = ("pair", "cells", "scheme", "step", "newton", "predicted_percent", "predicted_seconds")
    rows: list[Row] = []
    for choice in found.candidates:
        space, stepping, error = choice.space, choice.stepping, 100 * choice.share * found.accuracy
        numbers = space.pair, space.cells, stepping.scheme, stepping.step, stepping.newton, error, choice.seconds
        rows.append({"settings": str(choice)} | dict(zip(keys, numbers, strict=True)) | {"remark": ""})
    rows[0]["remark"] = "advised"
    messages = sentences(found)
    show("Cheapest settings that are predicted to meet it", rows, COLUMNS, messages)
    with matplotlib.rc_context(STYLE):
        save(folder, Table("advise", rows, notes=messages, figure=draw(found)))
    save(folder, Table("advise-pilot", found.rows))


def draw(found: Verified) -> Figure:
    """Bars of the pilot and of the advised settings over step and elements, with the required accuracy."""
    figure = new_figure(PAGE, 3.4)
    bar = 100 * found.accuracy * found.found.worst
    advised = {"time": found.choice.stepping.step, "space": found.choice.space.cells}
    of = {"time": ("scheme", "step [s]"), "space": ("pair", "elements")}
    panels = [kind for kind in of if any(row.get("error_in") == kind for row in found.rows)]
    for axes, kind in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        name, label = of[kind]
        rows = [row for row in found.rows if row.get("error_in") == kind and math.isfinite(row["share"])]
        axes.set(xscale="log", yscale="log", xlabel=label, title=f"in {kind}")
        for (which, own), color in zip(groups(rows, name).items(), PALETTE, strict=False):
            x = [row["step" if kind == "time" else "cells"] for row in own]
            y = [100 * found.accuracy * row["share"] for row in own]
            axes.plot(x, y, "o-", color=color, ms=3, label=SCHEMES.get(which, which))
        axes.plot(advised[kind], bar, "D", color=COLORS["ink"], ms=5, label="advised, whole run")
        axes.axhline(100 * found.accuracy, color=COLORS["ink"], lw=0.8, ls=":")
        axes.margins(0.3)
        plain_ticks(axes)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncol=2)
    figure.axes[0].set_ylabel("largest error bar [%]")
    return figure
