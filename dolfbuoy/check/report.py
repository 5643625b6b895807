"""Report of `check`: effects, derived numbers, periods and warnings of a scene."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..elsewhere import MPI
from ..model.effects import names as effects_of
from ..model.feasible import check_feasible
from ..model.prescribed_ends import overshoot
from ..model.problem import Problem
from ..parallel.ranks import bcast
from ..scene import Scene, load_scene
from ..scene.cable import Top
from ..statics.equilibrium import solve_equilibrium
from ..statics.first_shape import check_first_shape
from .accuracy import expected
from .buoys import buoys_at_rest, buoys_of, of_buoys
from .lines import lines_at_rest, lines_of, of_fatigue, of_lines
from .potential_flow import of_potential_flow
from .waves import in_waves, of_shapes
from .weather import of_weather

#: Fraction of its range by which a motion interpolated in rows may overshoot without warning.
OVERSHOOT = 0.01
#: Jump of velocity between rows: least fraction of the largest speed, and least multiple of the median jump.
JUMP = 0.5, 5


@dataclass
class Report:
    """Compiled effects, numbers (name, value, unit, remark), periods (name -> s), and warnings.

    prefix: precedes the names of numbers and the sentences that are added.
    """

    effects: list[str]
    numbers: list[tuple[str, float, str, str]] = field(default_factory=list)
    periods: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    prefix: str = ""

    def about(self, name: str) -> "Report":
        """The same report with the prefix for a line or buoy of this name; "": no prefix."""
        return replace(self, prefix=f"{name}: " if name else "")

    def add(self, name: str, value: float, unit: str = "", remark: str = "") -> None:
        self.numbers.append((self.prefix + name, float(value), unit, remark))

    def warn(self, when: object, sentence: str) -> None:
        """Add a warning if `when` is true."""
        if when:
            self.warnings.append(self.prefix + sentence)


def check(scene: Scene | str | Path | dict[str, Any], comm: Any = MPI.COMM_WORLD, **overrides: Any) -> Report:
    """Derived numbers and warnings of a scene; solves for the equilibrium if it starts from it; collective.

    overrides: see load_scene.
    Raises InputError for an impossible scene, SolveError if the equilibrium is not found.
    """
    scene = load_scene(scene, **overrides)
    check_feasible(scene)
    check_first_shape(scene)
    if scene.initial.kind != "equilibrium" or not (scene.cable or scene.sea):
        report = derived(scene)
    else:
        problem = solve_equilibrium(scene, comm)
        report = derived(scene, problem)
        _at_rest(problem, report)
        problem.destroy()
    expected(scene, report)
    return report


def derived(scene: Scene, rest: Problem | None = None) -> Report:
    """Numbers and warnings of lines, buoys and waves; rest: the equilibrium, a solved static Problem, if known.

    Raises InputError for a buoy that sinks.
    """
    report, network, buoys = Report(effects_of(scene)), scene.network, buoys_of(scene, rest)
    _motions(scene, report)
    of_lines(scene, network, report)
    of_fatigue(scene, report)
    if scene.sea and scene.gravity:
        of_buoys(scene.sea.depth, buoys, report)
        of_shapes(scene, buoys, report)
        of_potential_flow(scene, buoys, report)
    for name, material in (scene.material or {}).items():
        if material.source is not None:
            report.add(f"breaking load of {name}", material.breaking_load or math.nan, "N", material.source)
    of_weather(scene, report)
    in_waves(scene, lines_of(network), buoys, report)
    return report


def _motions(scene: Scene, report: Report) -> None:
    """Add warnings on ends moved along rows (overshoot, jumps, early end), and on vessels in other waves."""
    network, end = scene.network, scene.time.end if scene.time else 0.0
    for vessel in scene.vessel or []:
        period = scene.waves.main_period if scene.waves else 0.0
        periods = [row[0] for row in vessel.raos or []] or [period]
        first, last = min(periods), max(periods)
        report.warn(
            not first <= period <= last,
            f"Waves of {period:.3g} s are beyond the {first:g} to {last:g} s of the raos of {vessel.name}: those of "
            "the nearest period are taken.",
        )
    ends = {one.name or network.ends_of(p.cable)[k]: one.top for p in network.pieces for k, one in enumerate(p.ends)}
    for name, top in ends.items():
        if top is None or not top.motion:
            continue
        beyond, (jump, t) = overshoot(top.motion), _jump(top)
        report.warn(
            beyond > OVERSHOOT,
            f"The motion of {name} goes {100 * beyond:.2g} % of its range beyond its rows, which a cubic spline "
            "joins: give more rows where it turns.",
        )
        last = top.motion[-1][0]
        report.warn(last < end, f"The motion of {name} ends at {last:g} s, and the run at {end:g} s: it rests then.")
        report.warn(
            jump,
            f"The velocity of {name} jumps by {jump:.3g} m/s from one row of its motion to the next at "
            f"t = {t:g} s: lines feel that as a blow.",
        )


def _jump(top: Top) -> tuple[float, float]:
    """(size [m/s], time [s]) of the largest velocity jump along rows; (0, 0) if there is none.

    An end rests before the first row, unless there is a ramp, and after the last one.
    """
    rows = np.array(top.motion)
    velocity = np.diff(rows[:, 1:], axis=0) / np.diff(rows[:, :1], axis=0)
    speed = np.linalg.norm(velocity, axis=1).max()
    before = velocity[:1] if top.ramp else np.zeros((1, 3))
    jumps = np.linalg.norm(np.diff(velocity, axis=0, prepend=before, append=np.zeros((1, 3))), axis=1)
    k, (part, times) = int(jumps.argmax()), JUMP
    return (jumps[k], rows[k, 0]) if jumps[k] > max(part * speed, times * np.median(jumps)) else (0.0, 0.0)


def _at_rest(problem: Problem, report: Report) -> None:
    """Add forces, shapes and positions at rest, periods of small motions, and Newton tolerances."""
    scene, tolerance = problem.scene, problem.scene.solver.step_tolerance
    if problem.lines:
        lines_at_rest(problem, report)
        buoys_at_rest(problem, report)
    if scene.criteria is not None or scene.anchor:
        _judged(problem, report)
    if scene.buoys and scene.sea and scene.gravity:
        from ..linear.periods import moored_periods  # with scipy, which no run needs

        report.periods |= moored_periods(scene, problem if problem.comm.size == 1 else None)
    sizes = {(b.name, b.unit): tolerance * b.unknown_size(1.0, tolerance) for b in problem.system.blocks if b.unit}
    for (name, unit), size in sizes.items():
        report.add(f"tolerance of {name}", size, unit)


def _judged(problem: Problem, report: Report) -> None:
    """Add the verdicts of criteria on the equilibrium, and the utilisation of anchors."""
    from ..results.criteria import governing, never_met, verdicts
    from ..results.observe import Observer
    from ..results.record import dataset_of

    observer = Observer(problem)
    values = observer.values(problem.end_forces())
    judged = verdicts(dataset_of(values, {}, {}, observer.labels()), problem.scene) if problem.comm.rank == 0 else []
    judged = bcast(problem.comm, governing(judged))
    uses = bcast(problem.comm, values.get("anchor_use", np.zeros(0)))
    for name, use in zip(observer.labels().get("anchor", ()), uses, strict=False):
        report.add(f"at rest: part of what {name} holds", use, "", "above 1 it moves")
    for one in judged:
        report.add(f"at rest: {one.criterion}", one.value, one.unit, one.says)
    for sentence in never_met(judged):
        report.warn(True, f"At rest already: {sentence}")
