"""The limit cycle of a periodically driven scene, without waiting for transients to die out.

A state x becomes F(x) one period later.  The cycle satisfies x = F(x); a plain run approaches it only as fast as its
slowest transient decays, and a mooring may creep for hours.  Here runs of some periods alternate with leaps by Anderson
acceleration [Walker, Ni 2011], which extrapolates from the differences of the last periods.  Leaps are bounded, and
undone if they do not approach the cycle.

Moving the nodes of a line far along straight paths would stretch it: instead its chords from node to node are
extrapolated as directions and lengths, and whatever is attached to its end follows.  Rotation of a buoy about its axis
of revolution is excluded from the cycle: nothing restrains it, and it may continue for ever.
"""

import math
from typing import NamedTuple

import numpy as np

from ..errors import InputError, SolveError
from ..model.varying import varies
from ..scene import Scene, load_scene, settings
from .schemes import KEPT, Predictor
from .stepping import StepControl

#: Number of pairs (x, F(x)) used in a leap; threshold of linear dependence of their differences.
MEMORY, DEPENDENT = 20, 1e-4
#: Periods run between leaps, and as many more before them once a leap leaves more than SLOW of |F(x) - x|, or fails.
RUN, SLOW = 2, 0.5
#: Longest leap of a point, relative to the length of its line.
REACH = 0.01
#: A leap has failed if |F(x) - x| has grown by this factor; this many pairs are then kept.
WORSE, KEPT_PAIRS = 10.0, 4
#: Ratio of the error to the last changes if these do not fall; a ratio of 30 was found in the scene `long`.
ASTRAY = 100.0


def in_equal_steps(scene: Scene) -> Scene:
    """The scene with equal steps per period, none larger than its own.  Raises InputError if no cycle can exist."""
    settings.check_time(scene)
    period = period_of_cycle(scene)
    return load_scene(scene, **{"time.step": period / math.ceil(period / scene.time.step - 1e-9)})


def period_of_cycle(scene: Scene) -> float:
    """The single period of excitation of a scene [s].  Raises InputError if there is none, or no cycle can exist."""
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
    """Cost and accuracy of a cycle: periods run, including the ramp; estimated `error` relative to the ranges."""

    periods: int
    error: float


class State:
    """State of a Simulation from step to step, except friction, in one array, with weights for comparison.

    length: length of line that may turn [m].
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
        #: 1/size for the lines' positions and velocities, 0 for all else.
        self._weights = np.concatenate(weights)

    def values(self):
        """A copy of the rows, followed by the directions and lengths of the chords of a line in one piece."""
        if not self._chained:
            return np.concatenate(self._rows)
        chords = np.diff(self._positions, axis=0)
        lengths = np.linalg.norm(chords, axis=1)
        return np.concatenate([*self._rows, (chords / lengths[:, None]).ravel(), lengths])

    @property
    def _positions(self):
        return self.simulation.past.series[0].rows[0][self._nodes]

    def weighed(self, change):
        """Weighted difference of two states, in typical sizes."""
        weights = self._weights
        return (change[: len(weights)] * weights)[weights > 0]

    def moved(self, change):
        """Largest displacement of a point of the lines [m]."""
        begin = len(self.simulation.system.u)
        return float(np.abs(change[begin:][self._nodes]).max())

    def put(self, values):
        """Set this state; the time must differ from that of `values` by whole periods."""
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
        """Place the nodes by chords from the first one on, and move whatever is attached to the last one with it."""
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
        """Observed quantities: magnitudes of the end forces [N], then coordinates of the nodes [m]."""
        forces = [np.linalg.norm(force, axis=-1).ravel() for force in self.simulation.latest_end_forces.values()]
        self._forces = sum(map(len, forces))
        return np.concatenate([*forces, self._positions.ravel()])

    def difference(self, one, other):
        """Largest difference of the observations in two periods, relative to the range of a force or of the points."""
        ranges = np.ptp(other, axis=0)
        ranges[self._forces :] = ranges[self._forces :].max()
        differences = np.abs(one - other).max(axis=0)
        return float((differences / np.maximum(ranges, 1e-300)).max())


class Cycle:
    """A Simulation on one rank, of a scene from `in_equal_steps`, to be brought to its limit cycle."""

    def __init__(self, simulation):
        scene = simulation.scene
        self.simulation, self.period, self.periods = simulation, period_of_cycle(scene), 0
        simulation.control = StepControl(scene.time.step)  # periods have equal steps
        self.steps = round(self.period / scene.time.step)
        self.state = State(simulation)
        self.before, self.after = [], []  # states x, and F(x) a period later

    def run(self, count):
        """Run some periods; returns the observations during the last one, an array (instant, quantity)."""
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
        """Run some periods and store their start and end states; returns the observations during the last one."""
        for _ in range(count):
            x = self.state.values()
            seen = self.run(1)
            self.before, self.after = [*self.before, x][-MEMORY:], [*self.after, self.state.values()][-MEMORY:]
        return seen

    def missing(self):
        """Size of F(x) - x for the last period."""
        return float(np.linalg.norm(self.state.weighed(self.after[-1] - self.before[-1])))

    def leap(self, reach):
        """Leap from F(x) by Anderson acceleration, at most `reach` [m]; returns whether the leap was complete."""
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
        """Leap and return (observations, whether it was complete); after a failed leap go back and return None."""
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
        """The estimated error after a complete leap.

        change, last: differences of the observations due to this leap and the one before.  shrunk: |F(x) - x| after the
        leap over that before.  A leap that misses a creeping motion changes little, but does not reduce F(x) - x.
        """
        if change >= last / 2 or shrunk >= 1:  # at rounding level, or failing
            return ASTRAY * max(change, last)
        return change * max(change / last, shrunk / (1 - shrunk), 0.1)

    def find(self, accuracy, most):
        """Go from the start to the cycle, to this accuracy relative to ranges.

        Returns the cost.  Raises SolveError if `most` periods do not suffice.
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
