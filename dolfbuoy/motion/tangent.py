"""Derivatives of a run by a number of its scene, step by step with it.

A neighbour of the scene, at p + eps, shows how the equations of a step change; the unknowns follow with the Jacobian J:

    r = [F+(u + eps pd; h + eps hd, m + eps md) - F(u; h, m)] / eps
    ud = pd - J^-1 r

u, h, m: unknowns, histories and memory of the run, a dot (here d) their derivatives, pd those of u extrapolated.  F is
what Newton's method has left.  Rules of a scheme are linear in what is past, so that the past of derivatives is a
`Past` too.  Steps, and which elements are slack, are the run's.  J is that of a neighbour at the predicted derivative,
so that the run keeps its own; one increment is enough where the prediction is good.  One factorisation serves the
derivatives by all numbers.
"""

from collections.abc import Callable, Iterator

import numpy as np

from ..elsewhere import MPI
from ..parallel.ranks import allreduce
from ..scene import Scene
from ..solver.vector_ops import combination, copies, together
from .history import Past
from .schemes import NEW, Predictor
from .simulation import Simulation

#: Increments end when the next would be of this size, relative to the derivative; or when they shrink no more and one
#: is smaller than the second.
ENOUGH, ROUGH = 1e-6, 1e-3
#: Rounding of unknowns, of their typical sizes: at rest, and in motion over gamma^2.
ROUNDING, OF_MOTION = 1e-13, 5e-16
MOST = 12  #: increments
#: Change of the unknowns to a neighbour on one side, in their typical sizes, by which curvature and rounding are alike;
#: and the least derivative of a start by which one is placed.
APART, LEAST = 2e-6, 0.01
#: Distance of starts that are not at rest: the tiny steps that make them consistent have rounding in their forces.
FAR = 1e-3


class Neighbour:
    """Simulation of a neighbour of a run's scene, whose equations are evaluated next to where the run is.

    x: its distance; 0: the scene of the run itself.
    """

    def __init__(self, run: Simulation, simulation: Simulation, x: float):
        self.run, self.simulation, self.problem, self.system = run, simulation, simulation.problem, simulation.system
        self.past, self.u, self.memory, self.x = simulation.past, simulation.system.u, _arrays(simulation), x
        self.evaluate = self.system.add_residuals.in_c()

    def moved(self, to, of_run, rate=None):
        """Function that makes an array of this one that of the run at x."""
        return copies([(to, of_run)]) if rate is None else combination(to, [of_run, rate], np.array([1.0, self.x]))

    def given(self, past=None, memory=()) -> Iterator[Callable]:
        """Functions that hand it the time, the histories and the memory of the run; past, memory: their derivatives."""
        run, operations = self.run, self.past.operations
        yield copies([(self.problem.time, run.problem.time), (operations.gammas, run.past.operations.gammas)])
        for k, (to, of_run) in enumerate(zip(self.past.series, run.past.series, strict=True)):
            yield self.moved(to.history, of_run.history, past.series[k].history if past else None)
        for k, (to, of_run) in enumerate(zip(self.memory, _arrays(run), strict=True)):
            yield self.moved(to, of_run, memory[k] if past else None)
        yield operations.begin[1]

    def follow(self) -> Iterator[Callable]:
        """Functions that evaluate the run's equations where it is."""
        yield from (*self.given(), self.moved(self.u, self.run.system.u), *self.clock(), self.evaluate)

    def clock(self) -> tuple[Callable, ...]:
        """Functions that bring what is given in time to the time of the run."""
        return *self.problem.clock(), self.system.read_given


class Tangent:
    """Derivative of a Simulation by x, of which its scene is a function.

    scene_at: x -> Scene, whose numbers but no sizes of arrays depend on x; 0 is the run's.  make: Scene -> Simulation
    at its start.  After each step unknowns, memory and forces at ends of `near`, a neighbour, are those of the run
    there, so that what is read of it differs from that of `other` by the derivative times the distance `apart`.
    `other` is the run if its start changes with x, and the neighbour then so near that it changes little, if
    `near` is not 0; or, `surely`, at `near`.  Else they are neighbours at -eps and eps, whose difference has less
    rounding and curvature in it, for more time.  leader: an earlier Tangent of the same run, whose matrix serves this
    one too.  fault: a sentence, where no derivative was found; nothing follows then.
    """

    def __init__(
        self,
        simulation: Simulation,
        scene_at: Callable[[float], Scene],
        make: Callable[[Scene], Simulation],
        eps: float = 1e-4,
        leader: "Tangent | None" = None,
        near: float = 0.0,
        surely: bool = False,
    ) -> None:
        run = self.simulation = simulation
        there = [(near, make(scene_at(near)))] if near else []
        if there and not surely:
            size = self._size(there[0][1], near)
            x = min(APART / size, eps) if size > LEAST else 0.0
            if not near / 2 < x < 2 * near:
                there.pop()[1].problem.destroy()
                there = [(x, make(scene_at(x)))] if x else []
        to_one_side = bool(there)
        there = there or [(x, make(scene_at(x))) for x in (eps, -eps)]
        self.sides = [Neighbour(run, one, x) for x, one in there]
        self.near = self.sides[0]
        self.other, self.apart = (run, self.near.x) if to_one_side else (self.sides[1].simulation, 2 * eps)
        #: The run's own equations, where it has others than its neighbours, after the first evaluation of a step
        self.own: Neighbour | None = None
        if leader is not None:
            self.own = leader.own
        elif simulation.problem.samples_once:
            self.own = Neighbour(simulation, make(simulation.scene), 0.0)
        u = simulation.system.u
        self.u, self._residual = np.zeros_like(u), np.zeros_like(u)
        self._memory = [np.zeros_like(one) for one in _arrays(simulation)]
        self.past = Past(self.near.problem.evolutions(), self.u, simulation.scheme)
        self._predictor, self._time, self._made_for = Predictor(), np.zeros(1), None
        self._leads, self.solver = leader is None, self.near.simulation.newton if leader is None else leader.solver
        callbacks = self.solver.system.callbacks
        self._renew = callbacks.work("renew_matrix")
        self._increment = callbacks.improving_tangent(self._residual, self.u, ENOUGH, ROUGH)
        self.fault = ""
        if run.at_rest:
            self._start(self.other, self.near.simulation, self.apart)
        else:
            pair = [make(scene_at(x)) for x in (-FAR, FAR)]
            self._start(*pair, 2 * FAR)
            for one in pair:
                one.problem.destroy()
        run.followers.append(self.follow)
        run.finishers.append(self.finish)

    def _size(self, near, x):
        """Size of the derivative of a start, in typical sizes of the unknowns."""
        run, visible = self.simulation, self.simulation.system.numbering.visible
        change = (near.system.u - run.system.u)[visible] / near.system.unknown_scales
        largest = float(allreduce(run.comm, np.abs(change).max(initial=0.0), MPI.MAX))
        return max(largest / x, 1e-300) if run.at_rest else 1e-300

    def _start(self, low, high, apart):
        """Take the differences of two starts."""
        run = self.simulation
        self.u[:] = (high.system.u - low.system.u) / apart
        for rate, below, above in zip(self._memory, _arrays(low), _arrays(high), strict=True):
            rate[:] = (above - below) / apart
        state = run.past.state()
        for level, one in state.items():
            below, above = (np.array(end.past.state()[level]["rows"]) for end in (low, high))
            one["rows"] = (above - below) / apart
        self.past.restore(state)
        self._predictor.add(run.t, self.u)

    def destroy(self) -> None:
        """Give PETSc's objects of the neighbours back."""
        for one in (*self.sides, *([self.own] if self._leads and self.own else [])):
            one.problem.destroy()

    # -- steps --------------------------------------------------------------------------------------------------------

    def follow(self) -> None:
        """Take the step that the run is about to accept."""
        run = self.simulation.past
        if self.fault:
            return
        if run.series and run.series[0].steps_since_start < self.past.series[0].steps_since_start:
            self.past.forget()
        gamma = self.past.prepare(run.operations.step)
        self._increment.context.quiet = max(ROUNDING, OF_MOTION * gamma**2) / self.apart
        basis = run.operations, self.past.operations, self._predictor.count
        if self._made_for != basis:
            self._make_functions()
            self._made_for = basis
        self._time[0] = self.simulation.problem.time[0]
        if self._leads:
            self._set_up_matrix()
        self._step()
        if not self.solver.numbers.improved:
            self.solver.choose_solver("mumps")  # with pivots
            self._renew()
            self._step()
            if not self.solver.numbers.improved:
                self.fault = f"At t = {self._time[0]:.6g} s: increments of the derivative do not become small"

    def finish(self) -> None:
        """Make past of it, when the run has."""
        if self.fault:
            return
        self._accept()
        self.past.count_step()
        self._predictor.counted()

    def _set_up_matrix(self):
        system, law = self.solver.system, self.simulation.system.law
        system.set_scales(self.simulation.system.gamma)
        if law is not None:
            system.law.slack[:] = law.slack

    def _difference(self, out, get):
        """Function that makes `out` the derivative of an array of simulations."""
        return combination(out, [get(self.near.simulation), get(self.other)], np.array([1.0, -1.0]) / self.apart)

    def _make_functions(self):
        run, past, sides = self.simulation, self.past, self.sides
        make_histories, _ = past.operations.begin
        *_, find_rates = past.operations.find_rates
        *_, advance = past.operations.accept
        predict, remember = self._predictor.functions(self._time, self.u)
        move = [one.moved(one.u, run.system.u, self.u) for one in sides]
        residuals = [one.system.last_residual for one in (self.near, *(sides[1:] or [self.own or run]))]
        improve = (
            *(one.evaluate for one in sides),
            combination(self._residual, residuals, np.array([1.0, -1.0]) / self.apart),
            self._increment,
            *move,
        )
        past_of = [run.past, *(one.past for one in sides)]
        read = [*past.reading()[:1], *(function for one in past_of for function in one.reading()[1:])]
        for place in past.computed:
            read.append(self._difference(_new(self)[place], lambda one, p=place: _new(one)[p]))
        self._step = together(
            *(self.own.follow() if self.own and self._leads else ()),
            make_histories,
            predict,
            *(f for one in sides for f in one.given(past, self._memory)),
            *move,
            *(f for one in sides for f in one.clock()),
            self._difference(self.u, lambda one: one.system.u),
            *([self._renew] if self._leads else []),
            self.solver.system.callbacks.until_improved(self._increment, improve, MOST),
            *(one.moved(one.system.last_residual, run.system.last_residual, self._residual) for one in sides),
            *(one.simulation.read_end_forces for one in sides),
            *read,
            find_rates,
            *(f for one in sides for f in one.problem.when_accepted()),
        )
        touched = [buoy.part.slice for buoy in run.problem.buoys.values()]
        self._accept = together(
            *(self._difference(rate, lambda one, k=k: _arrays(one)[k]) for k, rate in enumerate(self._memory)),
            *(self._difference(self.u[p], lambda one, p=p: one.system.u[p]) for p in touched),
            *read,
            advance,
            remember,
        )


def _arrays(simulation):
    """Memory of accepted steps, flat arrays."""
    return [values.reshape(-1) for memory in simulation.memory for values in memory.values()]


def _new(one):
    """Entries at the end of the step."""
    return one.past.series[0].rows[NEW]
