"""Equilibrium of a cable without buoy when plain Newton fails: ways from an easy problem to the one asked for.

Each way changes one thing step by step - current, end position, end force, axial stiffness - and keeps the solution as
the start of the next step.  Under the two-sided law there is one more: the tension-only law first, whose states at
rest are minima of a convex energy where no current blows, so that nothing compressed can be found on the way.
"""

import numpy as np

from ..errors import SolveError
from ..model.problem import Problem
from ..scene.network import single
from . import catenary
from .relaxation import laid_out, relax

#: A compressed element counts if its T is below this part of the largest tension.
ROUNDING = 1e-9


def solve_cable(problem, shape) -> None:
    """Newton from the closed-form `shape`; where it fails or ends compressed, one continuation after the other.

    Sets and raises what `find_rest` does.
    """
    find_rest(problem, lambda: begin(problem, shape), ways(problem, shape), _why)


def find_rest(problem, begin, ways, why=lambda problem: "") -> None:
    """The first of the ways, each after a `begin`, that leads to a state where nothing is compressed.

    Sets problem.iterations (all of them) and problem.route, the name of the way that led there ("newton" if none was
    needed).  A compressed state is kept only if no way leads to another.  Raises SolveError, with what `why` adds.
    """
    system, failures, compressed = problem.system, [], None
    problem.iterations = 0
    for name, way in ways:
        begin()
        try:
            way()
        except SolveError as error:
            failures.append((name, error))
            continue
        if not is_compressed(problem):
            problem.route = name
            return
        compressed = compressed or (name, system.u.copy())
    if compressed is None:
        tried = ", ".join(name for name, _ in failures[1:])
        raise SolveError(f"{failures[0][1]}{f' (continuation tried: {tried})' if tried else ''}{why(problem)}")
    problem.route, system.u[:] = compressed
    system.publish()
    system.evaluate()


def begin(problem, shape) -> None:
    """Put the closed-form shape into the unknowns, with all data as the scene has them."""
    floor = 1e-3 * problem.typical_force  # a slack point of the closed form has no stiffness at all
    problem.lines.set_shape(problem.system.u, shape.position, lambda s: np.maximum(shape.tension(s), floor))
    problem.set_time(0.0)


def is_compressed(problem) -> bool:
    """Whether some dof of T is negative beyond rounding, on any rank."""
    T = problem.system.u[problem.lines.T_dofs]
    worst, largest = (problem.comm.allreduce(x, op=max) for x in (-T.min(initial=0.0), np.abs(T).max(initial=0.0)))
    return worst > ROUNDING * largest


def march(problem, set_fraction, smallest=1e-3) -> None:
    """Solve for set_fraction(x), x from 0 to 1 in steps that shrink when Newton fails and grow when it does not.

    Raises SolveError, with all of the data set, when a step of `smallest` fails.
    """
    reached, step, system = 0.0, 0.25, problem.system
    try:
        set_fraction(0.0)
        problem.iterations += problem.newton.solve()
        while reached < 1.0:
            target = min(reached + step, 1.0)
            set_fraction(target)
            before = system.u.copy()
            try:
                problem.iterations += problem.newton.solve()
            except SolveError:
                system.u[:] = before
                step /= 3
                if step < smallest:
                    raise
                continue
            reached, step = target, 2 * step
    finally:
        if reached < 1.0:
            set_fraction(1.0)


# -- the ways ----------------------------------------------------------------------------------------------------------


def ways(problem, shape):
    """(name, function) of every way that the scene has, in the order of their cost."""
    scene, cable = problem.scene, single(problem.scene).cable

    def newton():
        problem.iterations += problem.newton.solve()

    yield "newton", newton
    if problem.lines.bed is not None:
        yield "relaxation", lambda: relax(problem, None if cable.top.kind == "free" else laid_out(problem.lines))
    if scene.current is not None:
        yield "current", lambda: march(problem, lambda x: problem.lines.sea.scale_current(x))
    if cable.slack == "compressive":
        yield "tension-only law", lambda: _one_sided_first(problem, shape)
    if np.isfinite(cable.axial_stiffness) and scene.current is None:
        yield "axial stiffness", lambda: _stiffen(problem)
    if cable.top.kind == "free":
        if problem.lines.end_loads.get(0) is not None:
            yield "end force", lambda: _load(problem)
    else:
        yield "end position", lambda: _move_end(problem)


def _one_sided_first(problem, shape):
    relaxed = problem.scene.cable[0].model_copy(update={"slack": "tension-only"})
    other = Problem(problem.scene.model_copy(update={"cable": [relaxed]}), dynamic=False, comm=problem.comm)
    other.lines.grow_as(problem.lines)
    try:
        solve_cable(other, shape)
        problem.system.u[:] = other.system.u
        problem.iterations += other.iterations
    finally:
        other.destroy()
    problem.iterations += problem.newton.solve()


def _stiffen(problem):
    """From a cable that its weight stretches by half, in equal ratios."""
    c, w, constant = single(problem.scene).cable, problem.lines.weight_per_length, problem.lines.cable.EA
    soft = min(max(abs(w) * c.length, 1e-6 * c.axial_stiffness), c.axial_stiffness)
    _begin_with(problem, EA=soft)

    def stiffness(x):
        constant.value = soft ** (1 - x) * c.axial_stiffness**x

    march(problem, stiffness)


def _load(problem):
    """From an end force straight up that carries the cable twice."""
    c, load = single(problem.scene).cable, problem.lines.end_loads.get(0)
    force = np.array(c.top.force)
    easy = np.array([0.0, 0.0, 2 * abs(problem.lines.weight_per_length) * c.length or np.linalg.norm(force)])
    _begin_with(problem, force=easy)

    def pull(x):
        load.value[:] = (1 - x) * easy + x * force

    march(problem, pull)


def _move_end(problem):
    """From an end that is beside the anchor by 0.7 lengths at 45 degrees, towards the side of the end asked for."""
    c, anchor, target = (
        single(problem.scene).cable,
        np.array(single(problem.scene).anchor),
        problem.lines.top_position(0.0),
    )
    aside = (target - anchor) * [1.0, 1.0, 0.0]
    distance = np.linalg.norm(aside)
    direction = aside / distance if distance else np.array([1.0, 0.0, 0.0])
    easy = anchor + 0.5 * c.length * (direction + [0.0, 0.0, 1.0 if target[2] >= anchor[2] else -1.0])
    _begin_with(problem, end=easy)

    def move(x):
        u, top = problem.system.u, problem.lines.top_dofs()
        u[top] = np.tile((1 - x) * easy + x * target, len(top) // 3)

    march(problem, move)


def _begin_with(problem, EA=None, force=None, end=None):
    """The closed-form shape of the easy problem."""
    c, w, anchor = single(problem.scene).cable, problem.lines.weight_per_length, single(problem.scene).anchor
    EA = c.axial_stiffness if EA is None else EA
    if c.top.kind == "free":
        shape = catenary.under_end_force(anchor, c.top.force if force is None else force, c.length, w, EA)
    else:
        shape = catenary.between(anchor, problem.lines.top_position(0.0) if end is None else end, c.length, w, EA)
    begin(problem, shape)


def _why(problem):
    """What is special about a scene that has no solution, if it is known."""
    c = single(problem.scene).cable
    if c.top.kind == "free" or problem.scene.current is not None:
        return ""
    chord = problem.lines.top_position(0.0) - np.array(single(problem.scene).anchor)
    if np.hypot(*chord[:2]) > 1e-4 * c.length or np.linalg.norm(chord) >= c.length:
        return ""
    return (
        ": one end is right above the other and the cable longer than their distance, so that its fold has no width; "
        "move an end sideways by 0.001 of the length"
    )
