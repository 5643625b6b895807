"""Derivatives of a run by a number of its scene, step by step with it.

Two neighbours of the scene, at p - eps and p + eps, show how the equations of a step change; the unknowns follow with
the Jacobian J:

    r = [F+(u + eps pd; h + eps hd, m + eps md) - F-(u - eps pd; h - eps hd, m - eps md)] / (2 eps)
    ud = pd - J^-1 r

u, h, m: unknowns, histories and memory of the run, a dot (here d) their derivatives, pd those of u extrapolated.  Rules
of a scheme are linear in what is past, so that the past of derivatives is a `Past` too.  Steps, and which elements are
slack, are the run's.  J is that of a neighbour at the predicted derivative, so that the run keeps its own; one
increment is enough where the prediction is good.  One factorisation serves the derivatives by all numbers.
"""

from collections.abc import Callable

import numpy as np

from ..scene import Scene
from ..solver.vector_ops import combination, copies, together
from .history import Past
from .schemes import NEW, Predictor
from .simulation import Simulation

#: Increments end when the next would be of this size, relative to the derivative, or when they shrink no more and one
#: is smaller than the second, or than the third in typical sizes of the unknowns: rounding.
ENOUGH, ROUGH, NOISE = 1e-6, 1e-3, 1e-6
MOST = 12  #: increments
#: Distance of starts that are not at rest: the tiny steps that make them consistent have rounding in their forces.
FAR = 1e-3


class Neighbour:
    """Simulation of a neighbour of a run's scene, whose equations are evaluated where the run is."""

    def __init__(self, simulation: Simulation):
        self.simulation, self.problem, self.system = simulation, simulation.problem, simulation.system
        self.past, self.u, self.memory = simulation.past, simulation.system.u, _arrays(simulation)
        self.read_end_forces = simulation.read_end_forces
        operations = self.past.operations
        _, self.hand_over = operations.begin
        *self.read, _ = operations.find_rates
        self.evaluate = self.system.add_residuals.in_c()


class Tangent:
    """Derivative of a Simulation by x, of which its scene is a function.

    scene_at: x -> Scene, whose numbers but no sizes of arrays depend on x; 0 is the run's.  eps: of the neighbours.
    make: Scene -> Simulation at its start.  `below`, `above`: the neighbours; after each step their unknowns, memory
    and forces at ends are those of the run at -eps and eps, so that what is read from them differs by 2 eps times its
    derivative.  leader: an earlier Tangent of the same run, whose matrix serves this one too.  fault: a sentence, where
    no derivative was found; nothing follows then.
    """

    def __init__(
        self,
        simulation: Simulation,
        scene_at: Callable[[float], Scene],
        make: Callable[[Scene], Simulation],
        eps: float = 1e-5,
        leader: "Tangent | None" = None,
    ) -> None:
        self.simulation, self.eps = simulation, eps
        self.below, self.above = (Neighbour(make(scene_at(x))) for x in (-eps, eps))
        u = simulation.system.u
        self.u, self._residual = np.zeros_like(u), np.zeros_like(u)
        self._memory = [np.zeros_like(one) for one in _arrays(simulation)]
        self.past = Past(self.above.problem.evolutions(), self.u, simulation.scheme)
        self._predictor, self._time, self._made_for = Predictor(), np.zeros(1), None
        self._leads, self.solver = leader is None, self.above.simulation.newton if leader is None else leader.solver
        callbacks = self.solver.system.callbacks
        self._renew = callbacks.work("renew_matrix")
        self._increment = callbacks.improving_tangent(self._residual, self.u, ENOUGH, ROUGH, NOISE)
        self._weights, self._halves = np.array([[1.0, -eps], [1.0, eps]]), np.array([0.5, -0.5]) / eps
        self.fault = ""
        if simulation.at_rest:
            self._start(self.below.simulation, self.above.simulation, eps)
        else:
            pair = [make(scene_at(x)) for x in (-FAR, FAR)]
            self._start(*pair, FAR)
            for one in pair:
                one.problem.destroy()
        simulation.followers.append(self.follow)

    def _start(self, low, high, eps):
        """Take the differences of starts at -eps and eps."""
        run, half = self.simulation, 0.5 / eps
        self.u[:] = half * (high.system.u - low.system.u)
        for rate, below, above in zip(self._memory, _arrays(low), _arrays(high), strict=True):
            rate[:] = half * (above - below)
        state = run.past.state()
        for level, one in state.items():
            below, above = (np.array(end.past.state()[level]["rows"]) for end in (low, high))
            one["rows"] = half * (above - below)
        self.past.restore(state)
        self._predictor.add(run.t, self.u)

    def destroy(self) -> None:
        """Give PETSc's objects of the neighbours back."""
        for one in (self.below, self.above):
            one.problem.destroy()

    # -- steps --------------------------------------------------------------------------------------------------------

    def follow(self) -> None:
        """Take the step that the run is about to accept."""
        run = self.simulation.past
        if self.fault:
            return
        if run.series and run.series[0].steps_since_start < self.past.series[0].steps_since_start:
            self.past.forget()
        self.past.prepare(run.operations.step)
        basis = run.operations, self.past.operations, self._predictor.count
        if self._made_for != basis:
            self._make_functions()
            self._made_for = basis
        self._time[0] = self.simulation.problem.time[0]
        if self._leads:
            self._set_up_matrix()
        self._begin()
        if not self._solve():
            self.solver.choose_solver("mumps")  # with pivots
            self._renew()
            if not self._solve():
                self.fault = f"At t = {self._time[0]:.6g} s: increments of the derivative do not become small"
                return
        self._accept()
        self.past.count_step()
        self._predictor.counted()

    def _solve(self):
        """Increments; False if they do not become small."""
        self._increment.context.last = 0.0
        for _ in range(MOST):
            self._improve()
            if self.solver.numbers.improved:
                return True
        return False

    def _set_up_matrix(self):
        system, law = self.solver.system, self.simulation.system.law
        system.set_scales(self.simulation.system.gamma)
        if law is not None:
            system.law.slack[:] = law.slack

    def _pair(self):
        return (self.below, self._weights[0]), (self.above, self._weights[1])

    def _remembered(self, one, x):
        pairs = zip(one.memory, _arrays(self.simulation), self._memory, strict=True)
        return [combination(to, [of_run, rate], x) for to, of_run, rate in pairs]

    def _difference(self, out, get):
        """Function that makes `out` the derivative of an array of the neighbours."""
        return combination(out, [get(self.above), get(self.below)], self._halves)

    def _make_functions(self):
        run, past, pair = self.simulation, self.past.operations, self._pair()
        make_histories, _ = past.begin
        *_, find_rates = past.find_rates
        *_, advance = past.accept
        predict, remember = self._predictor.functions(self._time, self.u)
        move = [combination(one.u, [run.system.u, self.u], x) for one, x in pair]
        evaluate = [one.evaluate for one, _ in pair]
        unknowns = self._difference(self.u, lambda one: one.u)
        new = (
            [self._difference(self.past.series[0].rows[NEW], lambda one: one.past.series[0].rows[NEW])]
            if self.past.series
            else []
        )
        self._begin = together(
            make_histories,
            predict,
            *(f for one in pair for f in self._given(*one)),
            *move,
            *(f for one, _ in pair for f in (*one.problem.clock(), one.system.read_given)),
            unknowns,
            *([*move, self._renew] if self._leads else []),
        )
        self._improve = together(
            *move,
            *evaluate,
            self._difference(self._residual, lambda one: one.system.last_residual),
            self._increment,
        )
        read = [f for one, _ in pair for f in one.read]
        end_forces = run.system.last_residual, self._residual  # where forces at ends are read of it
        self._accept = together(
            *move,
            *(combination(one.system.last_residual, end_forces, x) for one, x in pair),
            *(one.read_end_forces for one, _ in pair),
            *read,
            *new,
            find_rates,
            *(f for one, _ in pair for f in one.problem.when_accepted()),
            *(self._difference(rate, lambda one, k=k: one.memory[k]) for k, rate in enumerate(self._memory)),
            unknowns,
            *read,
            *new,
            advance,
            remember,
        )

    def _given(self, one, x):
        """Functions that hand a neighbour the time, the histories and the memory of the run at x."""
        run = self.simulation
        yield copies([(one.problem.time, run.problem.time), (one.past.operations.gammas, run.past.operations.gammas)])
        for to, of_run, rate in zip(one.past.series, run.past.series, self.past.series, strict=True):
            yield combination(to.history, [of_run.history, rate.history], x)
        yield from self._remembered(one, x)
        yield one.hand_over


def _arrays(simulation):
    """Memory of accepted steps, flat arrays."""
    return [values.reshape(-1) for memory in simulation.memory for values in memory.values()]
