"""Lines on a sea bed brought to rest step by step, where Newton finds no way or a slack line has no stiffness.

Steps of backward Euler, each from rest: the inertia rho0 (r - r_before)/h^2 holds the line, and h grows until nothing
is left of it.  A line without tension on the bed stays where it comes to lie, which nothing else determines.
"""

import numpy as np
from mpi4py import MPI

from ..errors import SolveError
from ..parallel.ranks import combined
from ..roots import brentq

GROWTH = 1.5  #: of h
#: Inertia that is left, relative to the weight.
LEFT = 1e-11
STEPS = 400


def relax(problem, shape=None) -> None:
    """From the positions at hand, or from `shape` (s -> (n, 3)) of a line that is alone.  Raises SolveError."""
    lines, system = problem.lines, problem.system
    if shape is not None:
        typical = max(abs(lines.weight_per_length), 1e-3 * lines.section.line_density)
        lines.set_shape(system.u, shape, lambda s: np.full(s.shape, typical))
        problem.set_time(0.0)
    g = problem.scene.gravity
    h = smallest = 1e-2 * np.sqrt(lines.longest / g)
    smallest *= 1e-4
    try:
        for _ in range(STEPS):
            before = system.u.copy()
            for model in problem.models:
                model.hold(before, h)
            problem.newton.set_scales(1 / h)
            try:
                problem.iterations += problem.newton.solve()
            except SolveError:
                h /= GROWTH**4
                if h < smallest:
                    raise
                continue
            moved = np.abs(system.u - before)[lines.node_dofs].max(initial=0.0)
            if combined(problem.comm, float(moved), MPI.MAX) <= LEFT * g * h**2:
                return
            h *= GROWTH
        raise SolveError(f"the lines did not come to rest on the sea bed in {STEPS} steps")
    finally:
        for model in problem.models:
            model.let_go()
        problem.newton.set_scales(1.0)


def laid_out(lines, line=0):
    """s -> points of a line that lies from its anchor along the bed and then goes straight to its top."""
    section, bed = lines.sections[line], lines.bed
    start, end = np.array(lines.pieces[line].ends[0].top.position), lines.top_position(0.0, line)
    n, along = bed.normal.value, (end - start) * [1.0, 1.0, 0.0]
    along = along if np.any(along) else np.array([1.0, 0.0, 0.0])
    along = along - (along @ n) * n  # in the plane of the bed
    along /= np.linalg.norm(along)

    def spare(x):
        return section.length - x - np.linalg.norm(end - start - x * along)

    corner = brentq(spare, 0.0, section.length) if spare(0.0) > 0 > spare(section.length) else 0.0
    foot = start + corner * along

    def shape(s):
        lying = start + np.multiply.outer(s, along)
        rising = foot + np.multiply.outer((s - corner) / (section.length - corner), end - foot)
        return np.where((s <= corner)[:, None], lying, rising)

    return shape
