"""Damped motion to rest: steps of backward Euler that grow until nothing is left of the inertia.

The inertia rho0 (r - r*)/h^2 holds lines and buoys, with r* where they were (each step from rest), or where they would
have gone on to.  A line without tension on the bed stays where it comes to lie, which nothing else determines.
"""

import numpy as np

from ..elsewhere import MPI
from ..errors import SolveError
from ..model.problem import Problem
from ..parallel import interruption
from ..parallel.ranks import allreduce

#: Inertia that is left, relative to the weight.
LEFT = 1e-11


def approach(problem: Problem, first: float, steps: int = 60, most: int = 4, growth: float = 2.0) -> None:
    """Move to rest from a start near it: steps, each from rest, left after `most` iterations of Newton's method.

    They begin with `first` periods, and grow by up to `growth` as the speed falls (switched evolution relaxation).
    Where Newton's method alone goes round in circles, between what is slack and what is not, or finds a singular
    matrix, because nothing holds a slack line on the bed or the surface, this ends after a tenth of the iterations that
    `relax` takes, or not at all.  Raises SolveError.
    """
    lines, system, newton = problem.lines, problem.system, problem.newton
    acceleration = problem.scene.gravity or problem.typical_force / (lines.section.line_density * lines.longest)
    h, last = float(first * np.sqrt(lines.longest / acceleration)), None  # floats of Python overflow silently
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
            moved = np.abs(system.u - before)[lines.node_dofs].max(initial=0.0)
            farthest = allreduce(problem.comm, float(moved), MPI.MAX)
            if solved and farthest <= LEFT * acceleration * h**2:
                return
            speed = max(float(farthest) / h, 1e-300)
            h *= growth**2 if solved else 1.0 if last is None else min(max(last / speed, 1 / growth), growth)
            last = speed
        raise SolveError(f"after {steps} steps something still moves")
    finally:
        for model in problem.models:
            model.let_go()
        newton.set_scales(1.0)


def relax(problem: Problem, growth: float = 1.5, steps: int = 400, momentum: bool = False) -> None:
    """Move to rest from the present positions; h grows by `growth` from step to step.  Raises SolveError."""
    lines, system = problem.lines, problem.system
    acceleration = problem.scene.gravity or problem.typical_force / (lines.section.line_density * lines.longest)
    h = 1e-2 * np.sqrt(lines.longest / acceleration)
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
            farthest = allreduce(problem.comm, float(np.abs(moved[lines.node_dofs]).max(initial=0.0)), MPI.MAX)
            if farthest <= LEFT * acceleration * h**2:
                return
            velocity = moved / h if momentum else velocity
            h *= growth
        raise SolveError(f"after {steps} steps of a damped motion something still moves")
    finally:
        for model in problem.models:
            model.let_go()
        problem.newton.set_scales(1.0)
