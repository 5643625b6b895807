"""Forces given by a caller's function of time and state, within the solve of every step."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.buoy import MOTION
from ..model.rigid import rotation_of
from ..motion.simulation import Simulation
from .paths import Array, BodyState, PointState

#: Step of finite differences, relative to the typical size of an unknown.
DIFFERENCE = 1e-6


class Force:
    """A load on rows of the equations, evaluated with its derivative in every Newton iteration.

    `rows`: of the force (3) and, for a buoy, of the moment (6).  Columns: unknowns of the state.
    function: (t, state) -> force [N], for a buoy optionally (force, moment [N m]); None: the load has ended.
    """

    def __init__(self, simulation: Simulation, rows: Array, body: Any = None) -> None:
        self.function: Callable[[float, Any], Any] | None = None
        self.simulation, self.system, self.rows = simulation, simulation.system, rows
        if body is None:
            self._columns, self._sizes = rows, np.full(3, max(1.0, simulation.problem.lines.longest))
            self._state: Callable[[Array], Any] = self._of_point
        else:
            self._columns = np.arange(body.part.slice.start, body.part.slice.stop)
            self._sizes, self._state = body.state_sizes, lambda y: state_of(body, y)
        self._slopes: Array
        self._places: Array
        self._slopes, self._places = self.system.slopes(rows, self._columns)
        self.system.hooks.add(self._evaluate)

    def _evaluate(self, values: Array) -> None:
        if self.function is None:
            return
        y = self.system.u[self._columns]
        load = self._load(y)
        self.system.loads[self.rows] = -load
        if not self.simulation.newton.numbers.valid:  # a matrix is about to be assembled
            for k, step in enumerate(DIFFERENCE * self._sizes):
                near = y.copy()
                near[k] += step
                self._slopes[self._places[:, k]] = -(self._load(near) - load) / step

    def stop(self) -> None:
        """End the load."""
        self.function = None
        self._slopes[self._places] = 0.0

    def _load(self, y: Array) -> Array:
        function: Any = self.function
        found = np.ravel(function(float(self.simulation.problem.time[0]), self._state(y))).astype(float)
        if found.shape not in ((3,), (len(self.rows),)) or not np.all(np.isfinite(found)):
            allowed = (
                "3 finite numbers" if len(self.rows) == 3 else "a force, or a force and a moment, of finite numbers"
            )
            raise InputError(f"load: a function gave {found.tolist()}; must be {allowed}.")
        return np.concatenate([found, np.zeros(len(self.rows) - len(found))])

    def _of_point(self, position: Array) -> PointState:
        past = self.simulation.past
        for evolution, place in zip(past.evolutions, past.places, strict=True):
            first = self._columns - evolution.part.offset
            if evolution.order > 1 and first[0] >= 0 and first[-1] < evolution.part.size:
                history = past.series[0].history[place][first]
                return PointState(position, past.operations.gammas[0] * position + history)
        raise InputError("load: nothing is known of the velocity there.")


def state_of(body: Any, numbers: Array) -> BodyState:
    """Motion of a Buoy from its state vector."""
    y, inertia = MOTION.of(numbers), np.array(body.mass.inertia)
    q4 = y.orientation / np.linalg.norm(y.orientation)
    R = rotation_of(q4)
    return BodyState(y.position.copy(), q4, y.momentum / body.mass.mass, R @ ((R.T @ y.angular_momentum) / inertia))
