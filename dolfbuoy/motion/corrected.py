"""A second trajectory alongside a run, without the leading error of its time steps.

A scheme's rate is y_t - lag h^p y^(p+1).  If lag D^p y_t, from differences of the run's own rates, is added to the
histories of all derivatives, the same equations give the solution on this mesh without that error.  It is so close to
the run that one solve with Newton's last matrix suffices, or a few if steps are long:

    w = v - J^-1 F(v; h_w + lag D^p y_t),        v = u + (w - u extrapolated)

Source: deferred correction; the truncation error is that of `Scheme.lag`.
"""

import math
from typing import Any

import numpy as np

from ..scene import Scene
from ..solver.vector_ops import combination, copies, together
from .history import Past
from .schemes import Predictor, make_scheme, same_step
from .simulation import Simulation, listed

#: (-1)^j (p over j): differences of order p of the rates, newest first.
DIFFERENCES = {1: (1.0, -1.0, 0.0), 2: (1.0, -2.0, 1.0)}

#: Size of the last increment, relative to the unknowns' typical sizes, and the largest number of increments.
ENOUGH, MOST = 1e-3, 6


def can_follow(scene: Scene) -> bool:
    """True if a run of the scene can have a corrected trajectory.

    It cannot with bed contact, tension-only or failing lines (not smooth in time), with adaptive steps (not equal), or
    with generalized-alpha (rates not smooth enough).
    """
    smooth = all(p.section.slack == "compressive" and not p.section.fails_at for p in scene.network.pieces)
    scheme = make_scheme(scene.time.scheme)
    return smooth and scene.seabed is None and scene.time.tolerance is None and scheme.lag > 0


class Corrected:
    """The trajectory w that follows a Simulation with equal steps of backward Euler or BDF2.

    For scenes without any memory other than the unknowns.  `end_forces`: forces that hold the ends of each cable [N],
    (cable, 3), by their names in a record, at the latest step.
    """

    def __init__(self, simulation: Simulation, state: dict[str, Any] | None = None, until: float = math.inf) -> None:
        """state: from the Corrected that followed the same run so far; None: the run is at its start.  until: [s]."""
        self.until = until
        self.simulation, self.system = simulation, simulation.system
        run, u = simulation.past, self.system.u
        self.past = Past(simulation.problem.evolutions(), u, simulation.scheme)
        self._difference, self._time = Predictor(), np.zeros(1)
        self._older = [np.array(series.previous_rate) for series in run.series]  #: the run's rates before its last two
        self._u, self._apart = u.copy(), np.zeros_like(u)
        self.steps, self.step, self.follows = 0, 0.0, True  #: follows: all steps were equal and short enough
        self._read_end_forces, self.end_forces = simulation.reader_of_end_forces()
        self._leave, self._made_for = copies([(u, self._u)]), None
        if state is None:
            self.past.restore(run.state())
            self._difference.add(simulation.t, self._apart)
        else:
            self._restore(state)

    # -- interruption -------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything that the rest of the run depends on; nothing is copied."""
        known = {"steps": self.steps, "step": self.step, "follows": self.follows, "past": self.past.state()}
        older = {str(level): row for level, row in enumerate(self._older)}
        jacobians, (places, *_) = self.system.add_jacobians.out, self.system.entries_of_ends
        return known | {"older": older, "difference": self._difference.state(), "at_ends": jacobians[places]}

    def _restore(self, state):
        self.past.restore(state["past"])
        self._difference.restore(state["difference"])
        self.steps, self.step, self.follows = int(state["steps"]), float(state["step"]), bool(state["follows"])
        for row, kept in zip(self._older, listed(state, "older"), strict=True):
            row[:] = kept
        places, *_ = self.system.entries_of_ends  # of Newton's last matrix, which remains in use
        self.system.add_jacobians.out[places] = state["at_ends"]

    # -- steps --------------------------------------------------------------------------------------------------------

    def follow(self, step: float) -> bool:
        """Take the step that the run has just taken; `u` of the System is w until `leave`.

        Returns False, with `u` that of the run, after `until`, and from the first step on that differs in size or is
        too long for this trajectory.
        """
        self.follows &= self.steps == 0 or same_step(self.step, step)
        self.follows &= self.simulation.t < self.until + step / 2
        if not self.follows:
            return False
        self.step = step
        self.past.prepare(step)
        basis = self.past.operations, self._difference.count, self.steps + 1 < self.simulation.scheme.order
        if self._made_for != basis:
            self._make_functions()
            self._made_for = basis
        self._time[0] = self.simulation.t
        self._begin()
        self.follows = self.simulation.newton.numbers.improved
        if not self.follows:
            self.leave()
            return False
        self._accept()
        self.past.count_step()
        self._difference.counted()
        self.steps += 1
        return True

    def leave(self) -> None:
        """Restore `u` of the System to that of the run."""
        self._leave()

    def _make_functions(self):
        past, u = self.past.operations, self.system.u
        predict, remember = self._difference.functions(self._time, self._apart)
        make_histories, hand_over = past.begin
        self._begin = together(
            copies([(self._u, u)]),
            make_histories,
            *self._truncation(),
            hand_over,
            self.system.read_given,
            predict,
            combination(u, [u, self._apart], np.ones(2)),
            self.system.callbacks.improving(ENOUGH, MOST),
        )
        self._accept = together(
            combination(self._apart, [u, self._u], np.array([1.0, -1.0])),
            self._read_end_forces,
            *past.find_rates,
            *past.accept,
            remember,
        )

    def _truncation(self):
        """Functions that add the run's truncation error to the histories and then shift the past rates."""
        scheme, run, functions = self.simulation.scheme, self.simulation.past.series, []
        gamma, _ = scheme.formula(self.simulation.scene.time.step)  # the nominal step, regardless of rounding
        weights = scheme.lag * np.array(DIFFERENCES[scheme.order])
        if self.steps + 1 < scheme.order:  # there is no motion before the start
            weights[:] = 0.0
        for level, series in enumerate(self.past.series):
            rows, factors = [series.history], [np.ones(1)]
            for below in range(level + 1):
                rates = run[below].rate, run[below].previous_rate, self._older[below]
                rows += [rate[: len(series.history)] for rate in rates]
                factors.append(gamma ** (level - below) * weights)
            functions.append(combination(series.history, rows, np.concatenate(factors)))
        ages = [(older, series.previous_rate) for older, series in zip(self._older, run, strict=True)]
        return [*functions, copies(ages)]
