"""Derivatives of a run with respect to numbers of its scene, computed step by step with it.

A neighbour of the scene, at p + eps, gives the change of the equations of a step, and the Jacobian J the unknowns':

    r = [F+(u + eps pd; h + eps hd, m + eps md) - F(u; h, m)] / eps
    ud = pd - J^-1 r

u, h, m: unknowns, histories and memory of the run; ud, hd, md: their derivatives, pd: ud extrapolated.  F is the
residual left by Newton's method.  The rules of a scheme are linear in the past, so the past of derivatives is a `Past`
too.  Steps and slack elements are those of the run.  J is that of the run, with its factors, if it was computed in this
step and few more increments are needed than there are numbers; otherwise that of a neighbour at the predicted
derivative, so that the run keeps its own; one increment suffices if the prediction is good.  One factorisation serves
the derivatives with respect to all numbers, and one `Past` holds them all.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, Protocol

import numpy as np

from ..elsewhere import MPI
from ..model.interface import Evolution
from ..parallel.ranks import allreduce
from ..scene import Scene
from ..solver.vector_ops import combination, copies, together
from .history import Past
from .schemes import NEW, Predictor
from .simulation import Simulation

#: Increments end when the next one is expected to have this size, relative to the derivative; or when they no longer
#: decrease and one is below the second.  BORROWED: with the run's matrix, whose rate of convergence is known.
ENOUGH, ROUGH, BORROWED = 1e-6, 1e-3, 2e-6
#: Rounding of unknowns relative to their typical sizes: in statics, and in dynamics over gamma^2.
ROUNDING, OF_MOTION = 1e-13, 5e-16
MOST = 12  #: largest number of increments
#: Number of increments beyond one per number that cost more than a matrix and its factors, whatever the scene's size;
#: and for how many steps the run's matrix is then not borrowed.
SPARE, PAUSE = 16, 4
#: Change of the unknowns to a one-sided neighbour, in typical sizes, that balances curvature and rounding errors; and
#: the least derivative of a start used to place one.
APART, LEAST = 2e-6, 0.01
#: Distance for starts not at rest: the tiny steps that make them consistent have rounding errors in their forces.
FAR = 1e-3


class Neighbour:
    """Simulation of a neighbour of a run's scene, whose equations are evaluated near the state of the run.

    x: its distance; 0: the scene of the run itself.
    """

    def __init__(self, run: Simulation, simulation: Simulation, x: float):
        self.run, self.simulation, self.problem, self.system = run, simulation, simulation.problem, simulation.system
        self.past, self.u, self.memory, self.x = simulation.past, simulation.system.u, _arrays(simulation), x
        self.evaluate = self.system.add_residuals.in_c()

    def moved(self, to, of_run, rate=None):
        """Function that sets an array of this simulation to that of the run extrapolated to x."""
        return copies([(to, of_run)]) if rate is None else combination(to, [of_run, rate], np.array([1.0, self.x]))

    def given(self, histories=(), memory=()) -> Iterator[Callable]:
        """Functions that copy the time, histories and memory of the run to it, extrapolated to x.

        histories: (level, place, derivative of the history there), ...; memory: its derivatives; default: plain copies.
        """
        run, operations = self.run, self.past.operations
        yield copies([(self.problem.time, run.problem.time), (operations.gammas, run.past.operations.gammas)])
        levels = [(to.history, of_run.history) for to, of_run in zip(self.past.series, run.past.series, strict=True)]
        for k, place, rate in histories or [(k, slice(None), None) for k in range(len(levels))]:
            to, of_run = levels[k]
            yield self.moved(to[place], of_run[place], rate)
        for to, of_run, rate in itertools.zip_longest(self.memory, _arrays(run), memory):
            yield self.moved(to, of_run, rate)
        yield operations.begin[1]

    def follow(self) -> Iterator[Callable]:
        """Functions that evaluate the run's equations at its state."""
        yield from (*self.given(), self.moved(self.u, self.run.system.u), *self.clock(), self.evaluate)

    def clock(self) -> tuple[Callable, ...]:
        """Functions that update everything prescribed over time to the time of the run."""
        return *self.problem.clock(), self.system.read_given


class Direction(Protocol):
    """A scalar parameter x of scenes, with respect to which a run is differentiated.

    scene_at: (scene of a run, x) -> scene at x, with the same array sizes.  distance, near, surely: see `Pair`.
    """

    distance: float
    near: float
    surely: bool

    def scene_at(self, scene: Scene, x: float) -> Scene: ...


class Pair:
    """Two simulations near a run, whose difference is the derivative of the run times the distance `apart`.

    make: Scene -> Simulation at its start.  After each step unknowns, memory and end forces of `near`, a neighbour, are
    those of the run at its x.  `other` is the run itself if its start depends on x and the direction's `near` is not 0;
    the neighbour is then so close that the start changes little, or, if `surely`, at `near`.  Otherwise the two are
    neighbours at -distance and distance, whose difference has smaller rounding and curvature errors but costs more.
    """

    def __init__(self, run: Simulation, direction: Direction, make: Callable[[Scene], Simulation]) -> None:
        def at(x):
            return make(direction.scene_at(run.scene, x))

        self.run, self._at, near, eps = run, at, direction.near, direction.distance
        there = [(near, at(near))] if near else []
        if there and not direction.surely:
            size = self._size(there[0][1], near)
            x = min(APART / size, eps) if size > LEAST else 0.0
            if not near / 2 < x < 2 * near:
                there.pop()[1].problem.destroy()
                there = [(x, at(x))] if x else []
        to_one_side = bool(there)
        there = there or [(x, at(x)) for x in (eps, -eps)]
        self.sides = [Neighbour(run, one, x) for x, one in there]
        self.near = self.sides[0].simulation
        self.other, self.apart = (run, self.sides[0].x) if to_one_side else (self.sides[1].simulation, 2 * eps)
        self.memory = [np.zeros_like(one) for one in _arrays(run)]  #: derivatives

    def _size(self, near, x):
        """Size of the derivative of a start, in typical sizes of the unknowns."""
        run, visible = self.run, self.run.system.numbering.visible
        change = (near.system.u - run.system.u)[visible] / near.system.unknown_scales
        largest = float(allreduce(run.comm, np.abs(change).max(initial=0.0), MPI.MAX))
        return max(largest / x, 1e-300) if run.at_rest else 1e-300

    def start(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Derivatives at the start: of the unknowns, and of the past, level by level; sets those of the memory."""
        far = [] if self.run.at_rest else [self._at(x) for x in (-FAR, FAR)]
        (low, high), apart = (far, 2 * FAR) if far else ((self.other, self.near), self.apart)
        for rate, below, above in zip(self.memory, _arrays(low), _arrays(high), strict=True):
            rate[:] = (above - below) / apart
        below, above = ([np.array(level["rows"]) for level in one.past.state().values()] for one in (low, high))
        change = high.system.u - low.system.u
        for one in far:
            one.problem.destroy()
        return change / apart, [(b - a) / apart for a, b in zip(below, above, strict=True)]

    def difference(self, out, get):
        """Function that sets `out` to the derivative of an array of the simulations."""
        return combination(out, [get(self.near), get(self.other)], np.array([1.0, -1.0]) / self.apart)


@dataclass(frozen=True)
class InDirection:
    """Evolution of a derivative, among those of all: like that of the scene, but its rates are not used in forms.

    of: evolution of the scene.  at: place of the derivative of the unknowns among those of all.
    """

    of: Evolution
    at: slice
    rates: tuple[()] = ()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.of, name)

    def reader(self, u, out):
        """As for an `Evolution`."""
        return self.of.reader(u[self.at], out)

    def hand_out(self, level, gamma, history) -> None:
        """Do nothing."""


class Tangents:
    """Derivatives of a Simulation in some directions, which follow its steps.

    u: derivatives of the unknowns, (directions, unknowns).  pairs: a Pair for each.  fault: a sentence if a derivative
    was not found; further steps are then ignored.
    """

    def __init__(self, run: Simulation, directions: Sequence[Direction], make: Callable[[Scene], Simulation]) -> None:
        self.run, self.pairs, self.fault = run, [], ""
        try:
            for one in directions:
                self.pairs.append(Pair(run, one, make))
            #: The run's own equations, if they differ from its neighbours' after the first evaluation of a step
            self._own = Neighbour(run, make(run.scene), 0.0) if run.problem.samples_once else None
        except BaseException:
            self._own = None
            self.destroy()
            raise
        n = len(run.system.u)
        self.u, self._residual = np.zeros((len(self.pairs), n)), np.zeros(n)
        self._all, self._time = self.u.reshape(-1), np.zeros(1)
        evolutions = [(k, one) for k, pair in enumerate(self.pairs) for one in pair.near.problem.evolutions()]
        evolutions.sort(key=lambda pair: -pair[1].order)
        parts = [InDirection(one, slice(k * n, (k + 1) * n)) for k, one in evolutions]
        self.past = Past(parts, self._all, run.scheme)
        #: For each direction, the places of its evolutions in `past`, in the order of the run's.
        self._places: list[list[slice]] = [[] for _ in self.pairs]
        for (k, _), place in zip(evolutions, self.past.places, strict=True):
            self._places[k].append(place)
        self._predictor, self._made_for, self._gamma = Predictor(), None, None
        #: Newton's method of the run, whose matrix may be borrowed, and one with its own matrix
        self._lender, self.solver = run.newton, self.pairs[0].near.newton
        self._made, self._pause = run.newton.numbers.jacobians_total, 0
        self._renew, self.solver.numbers.shrinking = self.solver.system.callbacks.work("renew_matrix"), 0.0
        self._increments = {
            solver: [solver.system.callbacks.improving_tangent(self._residual, u, enough, ROUGH) for u in self.u]
            for solver, enough in ((self._lender, BORROWED), (self.solver, ENOUGH))
        }
        self._start()
        run.followers.append(self.follow)
        run.finishers.append(self.finish)

    def _start(self):
        starts = [pair.start() for pair in self.pairs]
        self.u[:] = [u for u, _ in starts]
        state = self.run.past.state()
        for level, one in enumerate(state.values()):
            one["rows"] = np.zeros((len(one["rows"]), len(self.past.sizes[level])))
            for k, (_, past) in enumerate(starts):
                for place, of_all in self._blocks(k, level):
                    one["rows"][:, of_all] = past[level][:, place]
        self.past.restore(state)
        self._predictor.add(self.run.t, self._all)

    def _blocks(self, k, level):
        """(place in a series of the run, place in `past`), ... of evolutions with this level, in a direction."""
        of_run = self.run.past
        orders = [evolution.order for evolution in of_run.evolutions]
        known = zip(orders, of_run.places, self._places[k], strict=True)
        for order, group in itertools.groupby(known, key=itemgetter(0)):
            block = list(group)
            if order > level:
                yield tuple(slice(block[0][i].start, block[-1][i].stop) for i in (1, 2))

    def destroy(self) -> None:
        """Free the PETSc objects of the neighbours."""
        own = [self._own] if self._own else []
        for one in (*(side for pair in self.pairs for side in pair.sides), *own):
            one.problem.destroy()

    # -- steps --------------------------------------------------------------------------------------------------------

    def follow(self) -> None:
        """Take the step that the run is about to accept."""
        run = self.run.past
        if self.fault:
            return
        if run.series and run.series[0].steps_since_start < self.past.series[0].steps_since_start:
            self.past.forget()
        gamma = self.past.prepare(run.operations.step)
        if gamma != self._gamma:
            for pair, increment in zip(self.pairs, self._increments[self.solver], strict=True):
                increment.context.quiet = max(ROUNDING, OF_MOTION * gamma**2) / pair.apart
            self._gamma = gamma
        basis = run.operations, self.past.operations, self._predictor.count
        if self._made_for != basis:
            self._make_functions()
            self._made_for = basis
        self._time[0] = self.run.problem.time[0]
        if self._may_borrow() and self._found(self._lender):
            return
        self._set_up_matrix()
        if not self._found(self.solver):
            self.solver.choose_solver("mumps")  # with pivots
            self._renew()
            if not self._found(self.solver):
                self.fault = f"At t = {self._time[0]:.6g} s: increments of the derivative do not become small"

    def finish(self) -> None:
        """Shift the step to the past, after the run has done so."""
        if self.fault:
            return
        self._accept()
        self.past.count_step()
        self._predictor.counted()

    def _may_borrow(self):
        """True if the run's matrix was computed in this step, with the same slack elements, and works well."""
        law, before, self._made = self.run.system.law, self._made, self._lender.numbers.jacobians_total
        self._pause -= 1
        if self._pause > 0 or self._made == before:
            return False
        same = law is None or np.array_equal(law.slack, law.slack_before)
        return bool(allreduce(self.run.comm, int(same), MPI.MIN))

    def _found(self, solver):
        """Take the step with the matrix of a solver; returns whether all increments became small."""
        numbers = solver.numbers
        numbers.taken = numbers.missed = 0
        self._step[solver]()
        if numbers.missed or numbers.taken > len(self.pairs) + SPARE:
            self._pause = PAUSE
        return not numbers.missed

    def _set_up_matrix(self):
        system, law = self.solver.system, self.run.system.law
        system.set_scales(self.run.system.gamma)
        if law is not None:
            system.law.slack[:] = law.slack

    def _make_functions(self):
        past, numbers = self.past, range(len(self.pairs))
        make_histories, _ = past.operations.begin
        *_, find_rates = past.operations.find_rates
        *_, advance = past.operations.accept
        predict, remember = self._predictor.functions(self._time, self._all)
        read = [
            *self.run.past.reading()[1:],
            *past.reading()[:1],
            *(function for k in numbers for function in self._reading(k)),
        ]
        self._step = {
            solver: together(
                *(self._own.follow() if self._own else ()),
                make_histories,
                predict,
                *(function for k in numbers for function in self._taking(k, solver)),
                *read,
                find_rates,
                *(f for pair in self.pairs for one in pair.sides for f in one.problem.when_accepted()),
            )
            for solver in self._increments
        }
        self._accept = together(
            *(function for k in numbers for function in self._accepting(k)),
            *read,
            advance,
            remember,
        )

    def _taking(self, k, solver):
        """Functions that compute the derivative of the unknowns in a direction, with the matrix of a solver."""
        run, pair, rate, increment = self.run, self.pairs[k], self.u[k], self._increments[solver][k]
        sides, series = pair.sides, self.past.series
        histories = [
            (level, place, series[level].history[of_all])
            for level in range(len(series))
            for place, of_all in self._blocks(k, level)
        ]
        move = [one.moved(one.u, run.system.u, rate) for one in sides]
        residuals = [one.system.last_residual for one in (sides[0], *(sides[1:] or [self._own or run]))]
        improve = (
            *(one.evaluate for one in sides),
            combination(self._residual, residuals, np.array([1.0, -1.0]) / pair.apart),
            increment,
            *move,
        )
        yield from (function for one in sides for function in one.given(histories, pair.memory))
        yield from move
        yield from (function for one in sides for function in one.clock())
        yield pair.difference(rate, lambda one: one.system.u)
        if k == 0 and solver is self.solver:
            yield self._renew
        yield solver.system.callbacks.until_improved(increment, improve, MOST)
        yield from (one.moved(one.system.last_residual, run.system.last_residual, self._residual) for one in sides)
        yield from (one.simulation.read_end_forces for one in sides)

    def _reading(self, k):
        """Functions that compute the new derivatives of entries that are functions of the unknowns."""
        pair, computed = self.pairs[k], self.run.past.computed
        yield from (function for one in pair.sides for function in one.past.reading()[1:])
        for place, of_all in zip(self.run.past.places, self._places[k], strict=True):
            if place in computed:
                yield pair.difference(_new(self.past)[of_all], lambda one, p=place: _new(one.past)[p])

    def _accepting(self, k):
        """Functions that update derivatives after the run and its neighbours have modified accepted values."""
        pair, touched = self.pairs[k], [buoy.part.slice for buoy in self.run.problem.buoys.values()]
        for i, rate in enumerate(pair.memory):
            yield pair.difference(rate, lambda one, i=i: _arrays(one)[i])
        for place in touched:
            yield pair.difference(self.u[k][place], lambda one, p=place: one.system.u[p])


def _arrays(simulation):
    """State of accepted steps other than unknowns, as flat arrays."""
    return [values.reshape(-1) for memory in simulation.memory for values in memory.values()]


def _new(past):
    """Entries at the end of the step."""
    return past.series[0].rows[NEW]
