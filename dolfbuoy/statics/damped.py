"""Damped motion to rest: backward Euler steps that grow until the inertia is negligible.

The inertia rho0 (r - r*)/h^2 restrains lines and buoys, where r* is their last position (each step from rest) or that
extrapolated with their velocity.  A line without tension on the bed, otherwise undetermined, stays where it settles.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..errors import SolveError
from ..model.problem import Problem
from ..parallel import interruption
from ..parallel.ranks import allreduce

#: Residual inertia, relative to the weight.
LEFT = 1e-11
#: Residual forces at rest, relative to typical ones: a short step may satisfy `LEFT` without a balance.
BALANCED = 1e-6


class Scale(NamedTuple):
    """Position unknowns (n,) of everything that moves in a Problem, typical length [m] and acceleration [m/s^2]."""

    places: NDArray[np.int64]
    length: float
    acceleration: float

    @classmethod
    def of(cls, problem: Problem) -> "Scale":
        """Scale from the nodes of all lines and the centres of buoys without lines; length: of the longest one."""
        lines, places, mass = problem.lines, [], 0.0
        for buoy in problem.buoys.values():
            if not problem.attached_to(buoy):
                places.append(np.arange(buoy.part.slice.start, buoy.part.slice.stop)[:3])
        if lines:
            places.append(lines.node_dofs.ravel())
            length, mass = lines.longest, lines.section.line_density * lines.longest
        else:
            hulls = problem.network.buoys.values()
            length = max((max(map(max, buoy.hull)) for buoy in hulls if buoy.hull), default=1.0)
            mass = max(buoy.mass for buoy in hulls)
        there = np.concatenate(places) if places else np.zeros(0, int)
        return cls(there, length, problem.scene.gravity or problem.typical_force / mass)

    @property
    def period(self) -> float:
        """Period over 2 pi of a pendulum of this length [s]."""
        return float(np.sqrt(self.length / self.acceleration))  # Python floats overflow silently

    def farthest(self, problem: Problem, moved: NDArray[np.float64]) -> float:
        """Largest displacement on any rank [m] for a change of the unknowns."""
        return float(allreduce(problem.comm, float(np.abs(moved[self.places]).max(initial=0.0)), MPI.MAX))

    def is_rest(self, problem: Problem, farthest: float, h: float) -> bool:
        """True if in a step h [s] all displacements imply negligible inertia, and forces balance without it."""
        if farthest > LEFT * self.acceleration * h**2:
            return False
        _let_go(problem)
        return max(problem.system.residual_by_block().values()) < BALANCED


def _let_go(problem: Problem) -> None:
    for model in problem.models:
        model.let_go()
    problem.newton.set_scales(1.0)


def approach(problem: Problem, first: float, steps: int = 60, most: int = 4, growth: float = 2.0) -> None:
    """Move to rest from a start near it: steps, each from rest, ended after `most` Newton iterations.

    The first step is `first` periods; steps grow by up to `growth` as the speed falls (switched evolution relaxation).
    Where Newton's method alone cycles between slack and taut states, or meets a singular matrix because a slack line on
    the bed or the surface is not restrained, this either converges in a tenth of the iterations of `relax` or fails.
    Raises SolveError.
    """
    system, newton, scale = problem.system, problem.newton, Scale.of(problem)
    h, last = first * scale.period, None
    try:
        for _ in range(steps):
            interruption.check()
            before = system.u.copy()
            for model in problem.models:
                model.hold(before, h)
            newton.set_scales(1 / h)
            try:
                iterations, solved = newton.approach(most)
            except SolveError:
                problem.iterations += most
                h /= growth**2
                continue
            problem.iterations += iterations
            farthest = scale.farthest(problem, system.u - before)
            if solved and scale.is_rest(problem, farthest, h):
                return
            speed = max(farthest / h, 1e-300)
            h *= growth**2 if solved else 1.0 if last is None else min(max(last / speed, 1 / growth), growth)
            last = speed
        raise SolveError(f"after {steps} steps something still moves")
    finally:
        _let_go(problem)


def relax(problem: Problem, growth: float = 1.5, steps: int = 400, momentum: bool = False) -> None:
    """Move to rest from the present positions; h grows by `growth` from step to step.  Raises SolveError."""
    system, scale = problem.system, Scale.of(problem)
    h = 1e-2 * scale.period
    smallest, velocity = 1e-4 * h, np.zeros_like(system.u)
    try:
        for _ in range(steps):
            interruption.check()
            before = system.u.copy()
            for model in problem.models:
                model.hold(before + h * velocity, h)
            problem.newton.set_scales(1 / h)
            try:
                problem.iterations += problem.newton.solve()
            except SolveError:
                h /= growth**4
                velocity[:] = 0.0
                if h < smallest:
                    raise
                continue
            moved = system.u - before
            if scale.is_rest(problem, scale.farthest(problem, moved), h):
                return
            velocity = moved / h if momentum else velocity
            h *= growth
        raise SolveError(f"after {steps} steps of a damped motion something still moves")
    finally:
        _let_go(problem)
