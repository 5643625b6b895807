"""The limit cycle of what is driven periodically, before its transient has died out.

A state x is followed by F(x) a period later.  The cycle is x = F(x); the plain run approaches it as slowly as its
slowest transient dies out, and a mooring may creep for hours.  Here runs of some periods alternate with leaps:
Anderson's acceleration [Walker, Ni 2011], which takes from the last periods where their differences lead.  Leaps are
bounded, and taken back when the cycle is not nearer afterwards.

A line that is carried far along straight lines would stretch: its chords from node to node are extrapolated as
directions and lengths, and what hangs on its end follows.  A buoy's turn about an axis of revolution is no part of the
cycle: nothing holds it, and it may go on for ever.
"""

import math
from typing import NamedTuple

import numpy as np

from ..errors import InputError, SolveError
from ..model.varying import varies
from ..scene import Scene, load_scene, settings
from .schemes import KEPT, Predictor
from .stepping import StepControl

#: Pairs (x, F(x)) that a leap is made of; what counts as linearly dependent among their differences.
MEMORY, DEPENDENT = 20, 1e-4
#: Periods that are run between leaps; as many more before them, once leaps bring less than SLOW or go wrong.
RUN, SLOW = 2, 0.5
#: Longest leap of a point, relative to the length of its line.
REACH = 0.01
#: A leap has led away where the state comes back less well than before by this factor; as many pairs are then kept.
WORSE, KEPT_PAIRS = 10.0, 4
#: Error over the last changes where these do not fall; leaps that did nothing for `long` left one 30 times as large.
ASTRAY = 100.0


def in_equal_steps(scene: Scene) -> Scene:
    """The scene with whole steps to a period, none larger than its own.  Raises InputError where no cycle can be."""
    settings.check_time(scene)
    period = period_of_cycle(scene)
    return load_scene(scene, **{"time.step": period / math.ceil(period / scene.time.step - 1e-9)})


def period_of_cycle(scene: Scene) -> float:
    """The one period with which a scene is driven [s].  Raises InputError where there is none, or no cycle can be."""
    network, waves = scene.network, scene.waves
    tops = [end.top for piece in network.pieces for end in piece.ends if end.top]
    periods = {top.period for top in tops if top.period} | ({waves.main_period} if waves else set())
    wrong = {
        "needs a line that holds what moves": not network.pieces,
        "needs one period that drives all, of regular waves or of an end that is moved": len(periods) != 1,
        "is one of a regular wave, not of an irregular sea": waves is not None and waves.irregular,
        "needs waves whose period the ground sees (waves.period_seen_from)": (
            waves is not None and waves.period_seen_from == "water" and scene.current is not None
        ),
        "is none of an end that is towed or follows a record": any(top.velocity or top.motion for top in tops),
        "is one of steady current, wind and force, which change over time here": any(
            section is not None and varies(section)
            for section in (scene.current, *(x for b in network.buoys.values() for x in (b.wind, b.external_force)))
        ),
        "needs equal steps, without time.tolerance": scene.time.tolerance is not None,
        "is not looked for on a bed with friction, which remembers how it was reached": (
            scene.seabed is not None and scene.seabed.friction > 0
        ),
    }
    for what, is_so in wrong.items():
        if is_so:
            raise InputError(f"A limit cycle {what}.")
    return periods.pop()


class Found(NamedTuple):
    """Cost of a cycle: periods that were run, the ramp's among them; `error`, estimated, relative to the ranges."""

    periods: int
    error: float


class State:
    """All that a Simulation carries from step to step, friction apart, in one array, and what of it decides.

    length: that along which a line may turn [m].
    """

    def __init__(self, simulation):
        self.simulation, past, problem = simulation, simulation.past, simulation.problem
        self._rows = [simulation.system.u, *(row for series in past.series for row in series.rows[:KEPT])]
        lines, self._place = problem.lines, past.place_of(problem.lines.part)
        self.length = float(np.ptp(lines.node_s))
        order = np.argsort(lines.node_s)
        self._nodes = lines.node_dofs[order] - lines.part.offset + self._place.start
        self._chained = len(problem.network.pieces) == 1
        weights = [np.zeros(len(simulation.system.u))]
        for series, sizes in zip(past.series, past.sizes, strict=True):
            for row in range(KEPT):
                weights.append(np.zeros(len(series.rows[row])))
                if row == 0:
                    weights[-1][self._place] = 1 / sizes[self._place]
        #: 1/size of the lines' positions and velocities, 0 of all else.
        self._weights = np.concatenate(weights)

    def values(self):
        """A copy; after the rows directions and lengths of the chords of a line in one piece."""
        if not self._chained:
            return np.concatenate(self._rows)
        chords = np.diff(self._positions, axis=0)
        lengths = np.linalg.norm(chords, axis=1)
        return np.concatenate([*self._rows, (chords / lengths[:, None]).ravel(), lengths])

    @property
    def _positions(self):
        return self.simulation.past.series[0].rows[0][self._nodes]

    def weighed(self, change):
        """Difference of two states as far as it counts, in typical sizes."""
        weights = self._weights
        return (change[: len(weights)] * weights)[weights > 0]

    def moved(self, change):
        """Farthest way of a point of the lines [m]."""
        begin = len(self.simulation.system.u)
        return float(np.abs(change[begin:][self._nodes]).max())

    def put(self, values):
        """Be there; the time is whole periods away from that of `values`."""
        simulation, begin = self.simulation, 0
        for row in self._rows:
            row[:] = values[begin : begin + len(row)]
            begin += len(row)
        if self._chained:
            self._bend(values[begin:])
        simulation.predictor = Predictor()
        simulation.predictor.add(simulation.t, simulation.system.u)
        simulation.system.publish()

    def _bend(self, chords):
        """Nodes where their chords lead from the first one on, and what hangs on the last one with it."""
        past, problem, u = self.simulation.past, self.simulation.problem, self.simulation.system.u
        count = len(self._nodes) - 1
        directions, lengths = chords[: 3 * count].reshape(count, 3), chords[3 * count :]
        directions = directions / np.linalg.norm(directions, axis=1)[:, None]
        at = self._positions
        shift = np.zeros_like(at)
        shift[1:] = at[0] + np.cumsum(directions * lengths[:, None], axis=0) - at[1:]
        change = np.zeros(len(past.series[0].rows[0]))
        change[self._nodes] = shift
        for buoy in problem.buoys.values():
            change[past.place_of(buoy.part)][:3] = shift[-1]
        for value in past.series[0].values:
            value += change
        for evolution, place in zip(past.evolutions, past.places, strict=True):
            if evolution.size == evolution.part.size:
                u[evolution.part.slice] += change[place]
        for attachment in problem.attachments:
            u[attachment.slice][:3] += shift[-1]

    def seen(self):
        """Sizes of the forces at the ends [N], then the coordinates of the nodes [m]."""
        forces = [np.linalg.norm(force, axis=-1).ravel() for force in self.simulation.latest_end_forces.values()]
        self._forces = sum(map(len, forces))
        return np.concatenate([*forces, self._positions.ravel()])

    def difference(self, one, other):
        """Largest difference of what was seen in two periods, relative to the range of a force, or of the points."""
        ranges = np.ptp(other, axis=0)
        ranges[self._forces :] = ranges[self._forces :].max()
        differences = np.abs(one - other).max(axis=0)
        return float((differences / np.maximum(ranges, 1e-300)).max())


class Cycle:
    """A Simulation on one rank, of a scene `in_equal_steps`, to be brought onto its limit cycle."""

    def __init__(self, simulation):
        scene = simulation.scene
        self.simulation, self.period, self.periods = simulation, period_of_cycle(scene), 0
        simulation.control = StepControl(scene.time.step)  # the past of a period is one of equal steps
        self.steps = round(self.period / scene.time.step)
        self.state = State(simulation)
        self.before, self.after = [], []  # states, and those a period later

    def run(self, count):
        """Some periods; what was seen during the last one, an array (instant, quantity)."""
        simulation, seen = self.simulation, []
        for _ in range(count):
            first, seen = simulation.t, []
            for k in range(1, self.steps + 1):
                for _ in simulation.advance(first + k * self.period / self.steps):
                    pass
                seen.append(self.state.seen())
            self.periods += 1
        return np.array(seen)

    def noted(self, count):
        """Some periods whose ends are remembered; what was seen during the last one."""
        for _ in range(count):
            x = self.state.values()
            seen = self.run(1)
            self.before, self.after = [*self.before, x][-MEMORY:], [*self.after, self.state.values()][-MEMORY:]
        return seen

    def missing(self):
        """Size of F(x) - x: distance by which the last period misses its start."""
        return float(np.linalg.norm(self.state.weighed(self.after[-1] - self.before[-1])))

    def leap(self, reach):
        """From F(x) to where the differences of the last periods lead, at most `reach` [m]; whether all the way."""
        after = np.array(self.after)
        residuals = np.array([self.state.weighed(b - a) for a, b in zip(self.before, after, strict=True)])
        changes = np.diff(residuals, axis=0).T
        sizes = np.maximum(np.linalg.norm(changes, axis=0), 1e-300)
        weights = np.linalg.lstsq(changes / sizes, residuals[-1], rcond=DEPENDENT)[0] / sizes
        way = -weights @ np.diff(after, axis=0)
        part = min(1.0, reach / max(self.state.moved(way), 1e-300))
        self.state.put(after[-1] + part * way)
        return part == 1.0

    def tried(self, reach, relax):
        """(what was seen, whether the leap was whole) after a leap; None, and where it began, if it led away."""
        kept, size, t = (self.before, self.after), self.missing(), self.simulation.t
        whole = self.leap(reach)
        try:
            self.run(relax)
            seen = self.noted(RUN)
            if self.missing() <= WORSE * size:
                return seen, whole
        except SolveError:
            self.simulation.t = t
        self.before, self.after = kept
        self.state.put(self.after[-1])
        return None

    @staticmethod
    def left(change, last, shrunk):
        """The error after a whole leap, estimated.

        change, last: differences of what was seen, by this leap and by the one before.  shrunk: |F(x) - x| after the
        leap over that before.  A leap that misses what creeps changes little, but then F(x) - x does not shrink either.
        """
        if change >= last / 2 or shrunk >= 1:  # at the rounding, or astray
            return ASTRAY * max(change, last)
        return change * max(change / last, shrunk / (1 - shrunk), 0.1)

    def find(self, accuracy, most):
        """From the start onto the cycle, to this accuracy relative to ranges.

        Returns what it took.  Raises SolveError if `most` periods do not suffice.
        """
        self.run(math.ceil(settings.ramp_of(self.simulation.scene) / self.period - 1e-9))
        reach = longest = REACH * self.state.length
        seen, relax, last = self.noted(RUN), 0, math.inf
        while self.periods < most:
            size, found = self.missing(), self.tried(reach, relax)
            if found is None:
                reach, relax, last = reach / 4, RUN, math.inf
                self.before, self.after = self.before[-KEPT_PAIRS:], self.after[-KEPT_PAIRS:]
                continue
            if self.missing() > SLOW * size:
                relax = RUN
            change, seen = self.state.difference(seen, found[0]), found[0]
            error = self.left(change, last, self.missing() / max(size, 1e-300)) if found[1] else math.inf
            if error <= accuracy:
                return Found(self.periods, error)
            last = change if found[1] else math.inf
            reach = min(2 * reach, longest)
        raise SolveError(f"No limit cycle was found within {most} periods of {self.period:g} s; there may be none.")
