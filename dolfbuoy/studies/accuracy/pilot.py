"""The pilot of `advise`: errors in time and in space, measured separately on a shortened run, and predictions.

In time: one moderate mesh, steps and tolerances of every scheme, against the finest run of generalized-alpha on this
mesh.  In space: one step, cells of every pair, against the finest P3-P2 at this step.  Both references are refined
until Richardson's estimate of their own error is an eighth of the accuracy.  Newton tolerance: the loosest that is at
most a hundredth of the accuracy, as is its error against the same run with the usual one.  The predicted error is the
sum of the errors, interpolated by power laws (observed orders); the cost is the units of work of the run (Newton
iterations and steps) times the seconds per unit.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import InputError, SolveError
from ...results import compare
from ...results import measured as acc
from ...results.compare import Curve, Reference, percent
from ...results.measured import Run
from ...scene import Scene, settings
from ...scene.settings import Space, Stepping
from ..study import Row

#: Fraction of the accuracy allowed for the error of each reference.
OWN = 1 / 8
#: Newton tolerance, and the change that it may cause, over the accuracy.
OF_NEWTON = 1 / 100
#: A looser Newton tolerance saves nothing more, and gave results of `long` that were 2 % wrong.
LOOSEST = 1e-4
ALPHA = "generalized-alpha"


@dataclass
class Candidate:
    """Settings with the predicted error and seconds of the whole run."""

    space: Space
    stepping: Stepping
    error: float
    seconds: float
    extrapolated: bool = False

    def __str__(self) -> str:
        return f"{self.space}{self.stepping}"


@dataclass
class Pilot:
    """Runs of the shortened scene, each made once; say: called with sentences on the progress."""

    whole: Scene
    quantity: str
    accuracy: float
    say: Callable[..., object] = print
    runs: dict[tuple[Space, Stepping], Run | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.scene = settings.shortened(self.whole)
        self.largest = settings.largest_step(self.whole)
        self.start = acc.window_start(self.scene)
        time: Any = self.scene.time
        period, end = settings.period_of(self.scene), time.end
        largest = period / (25 if self.accuracy > 0.03 else 50) if period else end / 200
        self.first_step = min(largest, end / 50)
        self.mesh, self.pieces = moderate(self.scene), len(self.scene.network.pieces)
        self.time_curves: dict[tuple[str, bool], Curve] = {}
        self.space_curves: dict[tuple[int, int], Curve] = {}
        self.newton, self.of_newton, self.work_of_newton = settings.NEWTON, 0.0, 1.0
        self.rows: list[Row] = []

    def run(self, space: Space, stepping: Stepping) -> Run | None:
        """The run with these settings; None if it fails."""
        key = (space, stepping)
        if key not in self.runs:
            try:
                self.runs[key] = acc.compute(settings.with_settings(self.scene, space, stepping), [self.quantity])
            except SolveError as error:
                self.runs[key] = None
                self.say(f"  {space}{stepping} fails: {error}")
        return self.runs[key]

    def difference(self, run: Run, fine: Run) -> float:
        """Error of a run, with `fine` as the reference."""
        reference = Reference(fine, self.start)
        if not reference.range_of(self.quantity) > 0:
            raise InputError(f"--quantity {self.quantity}: it does not change in this scene.")
        return reference.error(run, self.quantity).rms

    def refine(
        self, chosen: Iterable[tuple[Space, Stepping]], what: str, highest: float
    ) -> tuple[list[tuple[tuple[Space, Stepping], float]], Run, float]:
        """Run settings, each twice as fine as the last, until the error of the last is below OWN times the accuracy.

        highest: largest order for Richardson's estimate.  Returns ([(settings, error)], last run, its error), without
        failed runs.
        """
        good: list[tuple[Space, Stepping]] = []
        runs: list[Run] = []
        own, changes = math.inf, []
        for setting in chosen:
            run = self.run(*setting)
            if run is None and len(runs) > 1:
                break  # finer is no better here
            if run is None:
                continue
            good, runs = [*good, setting], [*runs, run]
            if len(runs) > 1:
                changes.append(self.difference(runs[-2], runs[-1]))
                own = compare.own_error(changes, highest)
                if own <= OWN * self.accuracy:
                    errors = [self.difference(run, runs[-1]) + own for run in runs[:-1]]
                    return list(zip(good, [*errors, own], strict=True)), runs[-1], own
            if len(changes) > 2 and changes[-1] > 0.7 * changes[-3]:
                break  # two refinements have not helped
        raise SolveError(
            f"The pilot cannot promise {percent(self.accuracy)}: {what}, its finest run is itself uncertain by "
            f"{percent(own)}, more than 1/{1 / OWN:g} of that; ask for less."
        )

    def _finer(
        self,
        chosen: Iterable[tuple[Space, Stepping]],
        truth: Run,
        own: float,
        enough: float = 0.5,
        dearest: float = math.inf,
    ) -> list[tuple[tuple[Space, Stepping], float]]:
        """[(settings, error)], ever finer until the error is `enough` of the accuracy, or the work `dearest`."""
        points = []
        for setting in chosen:
            run = self.run(*setting)
            if run is None:
                continue
            points.append((setting, self.difference(run, truth) + own))
            if points[-1][1] <= enough * self.accuracy or _work(run) > dearest:
                break
        return points

    def _keep(self, kind: str, points: Any) -> None:
        for (space, stepping), error in points:
            run = self.run(space, stepping)
            row = {"error_in": kind, "pair": space.pair, "cells": space.cells, "scheme": stepping.scheme}
            row |= {"tolerance": stepping.tolerance} if stepping.tolerance else {"step": stepping.step}
            row |= {"newton": stepping.newton, "error_percent": 100 * error}
            costs = {key: getattr(run, key) for key in ("steps", "iterations", "unknowns", "cpu", "wall")}
            self.rows.append(row | costs)

    def measure_time(self) -> None:
        """Measure error curves over step or tolerance for every scheme, on the moderate mesh."""

        def at(scheme: str, steps: Any) -> list[tuple[Space, Stepping]]:
            return [(self.mesh, Stepping(scheme, h)) for h in steps]

        steps = [self.first_step / 2**k for k in range(9)]
        points, truth, self.own_time = self.refine(at(ALPHA, steps), "in time", 2)
        self.finest = points[-1][0][1].step
        steps, found = [h for h in steps if h >= self.finest], {(ALPHA, False): points}
        found["bdf2", False] = self._finer(at("bdf2", steps), truth, self.own_time)
        found["backward-euler", False] = self._finer(at("backward-euler", steps[1:][-2:]), truth, self.own_time, 0.0)
        for scheme in ("bdf2", ALPHA):
            adaptive = [
                (self.mesh, Stepping(scheme, steps[-1], tolerance, self.largest))
                for tolerance in (1e-2, 1e-3, 1e-4, 1e-5)
            ]
            found[scheme, True] = self._finer(adaptive, truth, self.own_time, dearest=0.5 * _work(truth))
        for family, points in found.items():
            self.time_curves[family] = Curve([(s.tolerance or s.step, error) for (_, s), error in points])
            self._keep("time", points)
        alpha = self.time_curves[ALPHA, False]
        self.step = alpha.largest(2 * self.accuracy, alpha.x) or self.finest  # about as exact as requested

    def measure_space(self) -> None:
        """Measure error curves over 1/cells for every pair, at the same step."""
        if not self.mesh.mu:
            self.own_space, self.best = 0.0, self.mesh
            return

        def doubled(pair: tuple[int, int], first: int, count: int) -> list[tuple[Space, Stepping]]:
            cells = (first * 2**k * self.pieces for k in range(count))
            return [(settings.fitting(self.scene, Space(*pair, n)), Stepping(ALPHA, self.step)) for n in cells]

        points, truth, self.own_space = self.refine(doubled((3, 2), 2, 7), "in space", 3)
        self.best, found = points[-1][0][0], {(3, 2): points}
        for pair, first in (((2, 1), 3), ((1, 0), 5)):
            chosen = [setting for setting in doubled(pair, first, 10) if setting[0].cells <= 4 * self.best.cells]
            found[pair] = self._finer(chosen, truth, self.own_space)
        for pair, points in found.items():
            self.space_curves[pair] = Curve([(1 / space.cells, error) for (space, _), error in points])
            self._keep("space", points)

    def measure_newton(self) -> None:
        """Find the Newton tolerance, its error, and the remaining work, at the same step on the moderate mesh."""
        truth, allowed = self.run(self.mesh, Stepping(ALPHA, self.step)), OF_NEWTON * self.accuracy
        for newton in (10.0**-k for k in range(4, 9)):
            stepping = Stepping(ALPHA, self.step, newton=newton)
            run = self.run(self.mesh, stepping) if newton <= min(LOOSEST, allowed) * (1 + 1e-9) else None
            error = self.difference(run, truth) if run and truth else math.inf
            if run and truth and error <= allowed:
                self.newton, self.of_newton, self.work_of_newton = newton, error, _work(run) / _work(truth)
                self._keep("Newton", [((self.mesh, stepping), error)])
                return

    def second_per_work(self, space: Space) -> float:
        """CPU seconds per unit of work, linear in the cells of a pair."""
        found = [(s.cells, r) for (s, _), r in self.runs.items() if r and (s.mu, s.nu) == (space.mu, space.nu)]
        sizes = sorted({n for n, _ in found})
        means = [sum(r.cpu for n, r in found if n == m) / sum(_work(r) for n, r in found if n == m) for m in sizes]
        if len(sizes) < 2:
            return float(means[0])
        slope, constant = np.polyfit(sizes, means, 1)
        return float(means[0] if slope < 0 else max(constant + slope * space.cells, 0.5 * min(means)))

    def seconds(self, space: Space, scheme: str, adaptive: bool, x: float) -> float:
        """Wall time of the stepping loop of the whole run; work as a power law in x, as the errors."""
        known = sorted(
            (s.tolerance if adaptive else s.step, _work(r))
            for (m, s), r in self.runs.items()
            if r and (m, s.scheme, s.newton) == (self.mesh, scheme, settings.NEWTON)
            if (s.tolerance is not None) == adaptive
        )
        sizes, works = np.log(np.array(known)).T
        work = math.exp(np.interp(math.log(x), sizes, works))
        if math.log(x) < sizes[0]:
            power = 1.0 if not adaptive else 1 / 3  # steps of order 2 scale with the cube root of the tolerance
            work *= (math.exp(sizes[0]) / x) ** power
        done = [run for run in self.runs.values() if run]
        work *= self.work_of_newton
        load = sum(run.wall for run in done) / sum(run.cpu for run in done)
        whole, part = (scene.time.end if scene.time else 1.0 for scene in (self.whole, self.scene))
        return float(work * whole / part * self.second_per_work(space) * max(load, 1.0))

    def predicted(self, space: Space, stepping: Stepping) -> float:
        """Error of these settings; inf where the pilot has no curve."""
        in_time = self.time_curves.get((stepping.scheme, stepping.tolerance is not None))
        in_space = self.space_curves.get((space.mu, space.nu))
        if in_time is None or (in_space is None and space.mu):
            return math.inf
        error = in_space(1 / space.cells) if in_space and space.mu else 0.0
        return float(in_time(stepping.tolerance or stepping.step) + error + self.of_newton)

    def candidates(self, target: float) -> list[Candidate]:
        """The cheapest settings of every pair and family with a predicted error of at most `target`, cheapest first."""
        best: dict[tuple[str, str, bool], Candidate] = {}
        for space, in_space in self._spaces(target - self.of_newton):
            known = in_space + self.of_newton
            for (scheme, adaptive), curve in self.time_curves.items():
                if len(curve.x) == 0:
                    continue
                x = curve.largest(target - known, compare.nice_numbers(curve.x[0] / 1e3, curve.x[-1]))
                if x is None:
                    continue
                seconds = self.seconds(space, scheme, adaptive, x)
                size = (self.finest, x, self.largest) if adaptive else (x,)
                stepping = replace(Stepping(scheme, *size), newton=self.newton)
                key = space.pair, scheme, adaptive
                if key not in best or seconds < best[key].seconds:
                    best[key] = Candidate(space, stepping, known + curve(x), seconds, x < curve.x[0])
        return sorted(best.values(), key=lambda candidate: candidate.seconds)

    def _spaces(self, target: float) -> list[tuple[Space, float]]:
        if not self.mesh.mu:
            return [(self.mesh, 0.0)]
        found = meshes(self.scene, self.space_curves, 2, 1.15)
        return [(space, error) for space, error in found if error < target]


def moderate(scene: Scene) -> Space:
    """P2-P1 mesh on which schemes are compared; the scene's own without lines."""
    own, pieces = settings.space_of(scene), len(scene.network.pieces)
    if not own.mu:
        return own
    return settings.fitting(scene, Space(2, 1, min(max(own.mu * own.cells // (2 * pieces), 4), 20) * pieces))


def meshes(
    scene: Scene, curves: Mapping[tuple[int, int], Curve], finer: int, ratio: float
) -> list[tuple[Space, float]]:
    """Meshes of each pair with their errors, from the coarsest measured to `finer` times the finest."""
    found = []
    for pair, curve in curves.items():
        if len(curve.x):
            low, high = round(1 / curve.x[-1]), round(finer / curve.x[0])
            sizes = sorted({round(low * ratio**k) for k in range(80) if low * ratio**k <= high})
            spaces = dict.fromkeys(settings.fitting(scene, Space(*pair, n)) for n in sizes)
            found += [(space, curve(1 / space.cells)) for space in spaces]
    return found


def _work(run: Run) -> int:
    """Units of work of a run: Newton iterations, plus one residual per step, including rejected steps."""
    each = (run.iterations + run.steps) / max(run.steps, 1)
    return int(each * (run.steps + run.rejected))
