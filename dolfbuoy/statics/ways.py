"""Solution strategies for the equilibrium, tried in turn for every scene, each from a start to the full problem.

All but the last vary one quantity step by step - current, loads, stiffness, positions of ends - or let the lines move,
with each solution as the guess for the next.  With the tension-only law equilibria without current are minima of a
convex energy, so no compressed states are found on the way.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import SolveError
from ..model.lines import top_position
from ..model.problem import Problem
from ..solver.unknowns import array_of
from .damped import Scale, approach, relax
from .network import Network
from .rods import angle_between, turned
from .start import closed_form

#: Compression counts above this fraction of the largest tension.
ROUNDING = 1e-9
#: Largest distance of points in two states that count as equal, in lengths of the longest line.
SAME = 1e-6
#: Largest angle [rad] between the direction of an end and that of the start for which Newton is used directly.
FAR = 1.0


class Way(NamedTuple):
    """A strategy; `go` takes a Problem from the start in its unknowns to equilibrium; `suits`: applicable problems."""

    name: str
    go: Callable[[Problem], None]
    suits: Callable[[Problem], Any] = lambda problem: True


def find_rest(problem: Problem, put: Callable[[], None], ways: Sequence[Way]) -> None:
    """Find an equilibrium by the first way that leads to one without compression; `put` writes the start.

    Adds to problem.iterations and sets problem.route to the name of that way ("newton" if none was needed).  A
    compressed state is kept if neither relaxation nor the other law leads to another.  Raises SolveError.
    """
    system, failures, compressed = problem.system, [], None
    for way in (way for way in ways if way.suits(problem)):
        if compressed and way.name not in ("relaxation", "other slack law"):
            continue
        put()
        try:
            way.go(problem)
        except SolveError as error:
            failures.append((way.name, error))
            continue
        if not is_compressed(problem):
            problem.route = way.name
            return
        compressed = compressed or (way.name, system.u.copy())
    if compressed is None:
        names = ", ".join(name for name, _ in failures[1:])
        more = f" (then tried: {names}; this ended with: {failures[-1][1]})" if names else ""
        raise SolveError(f"{failures[0][1]}{more}")
    problem.route, system.u[:] = compressed
    system.publish()
    system.evaluate()


def is_compressed(problem: Problem) -> bool:
    """True if a dof of T of a line that would fold is negative beyond rounding, on any rank.

    In scenes with tension-only lines the two-sided ones are struts, for which compression is intended.
    """
    if problem.law is not None or not problem.lines:
        return False
    T = problem.system.u[problem.lines.T_dofs[~problem.lines.keeps_shape]]
    worst, largest = (problem.comm.allreduce(x, op=max) for x in (-T.min(initial=0.0), np.abs(T).max(initial=0.0)))
    return bool(worst > ROUNDING * largest)


def march(problem: Problem, set_fraction: Callable[[float], None], smallest: float = 1e-3) -> None:
    """Solve for set_fraction(x), x from 0 to 1 in steps that shrink when Newton fails and grow when it succeeds.

    Raises SolveError, with the full data set, when a step of `smallest` fails.
    """
    reached, step = 0.0, 0.25
    try:
        set_fraction(0.0)
        newton(problem)
        while reached < 1.0:
            target = min(reached + step, 1.0)
            set_fraction(target)
            try:
                newton(problem)
            except SolveError:
                step /= 3
                if step < smallest:
                    raise
                continue
            reached, step = target, 2 * step
    finally:
        if reached < 1.0:
            set_fraction(1.0)


def newton(problem: Problem) -> None:
    """Newton directly from the start."""
    problem.iterations += problem.newton.solve()


def directly(problem: Problem) -> None:
    """Newton directly from the start; ends whose direction is far from that of the start are rotated in steps."""
    turns, u = [], problem.system.u
    for group in problem.lines.groups if problem.lines else ():
        for (piece, end), (direction, _) in group.clamps.items():
            if group.owns_end(piece, end):
                nodes = group.nodes_of[piece][np.argsort(group.node_s[group.nodes_of[piece]])]
                low, high = u[group.part.slice][group.node_dofs[nodes[[-2, -1] if end else [0, 1]]]]
                if not (size := np.linalg.norm(high - low)):
                    raise SolveError("the start has elements of no length: give a shape by initial.points")
                way, to = (high - low) / size, direction.value.copy()
                turns.append((direction, way, to, angle_between(way, to)))
    if problem.comm.allreduce(max((angle for *_, angle in turns), default=0.0), op=max) < FAR:
        newton(problem)
        return

    def turn(x: float) -> None:
        for direction, way, to, _ in turns:
            direction.value[:] = turned(way, to, x)

    march(problem, turn)


def by_current(problem: Problem) -> None:
    """Continuation in the current, from still water."""
    seas = [part.sea for model in problem.models for part in getattr(model, "groups", [model])]

    def scale(x: float) -> None:
        for sea in seas:
            sea.scale_current(x)

    march(problem, scale)


def by_bending(problem: Problem) -> None:
    """Continuation in the bending term, from lines without bending stiffness."""
    rates = [group.share_of_bending for group in problem.lines.groups if group.moment_dofs is not None]

    def bend(x: float) -> None:
        for rate in rates:
            rate.value = x

    march(problem, bend)


def by_relaxation(problem: Problem, **motion: Any) -> None:
    """Damped motion from the start, then Newton, whose result is kept if it agrees with the state at rest.

    motion: see `damped.relax`.
    """
    relax(problem, **motion)
    _at_rest(problem)


def by_approach(problem: Problem, first: float) -> None:
    """Pseudo-time steps of a few iterations, which soon become so large that inertia is negligible; see `damped`."""
    approach(problem, first)
    _at_rest(problem)


def _at_rest(problem: Problem) -> None:
    """Newton from a state at rest; the result is kept if Newton does not fail and finds the same state."""
    system, before = problem.system, problem.system.u.copy()
    try:
        newton(problem)
    except SolveError:
        return
    scale = Scale.of(problem)
    if scale.farthest(problem, system.u - before) > SAME * scale.length:
        system.u[:] = before
        system.publish()
        system.evaluate()


def by_the_other_law(problem: Problem) -> None:
    """From the solution with the other slack law, tension-only or compressive: it avoids slack nodes, which have no
    stiffness, on the way."""
    scene, start = problem.scene, problem.system.u.copy()
    pushed = problem.law is None
    slack = "tension-only" if pushed else "compressive"
    cables = [cable.model_copy(update={"slack": slack}) for cable in scene.cables]
    other = Problem(scene.model_copy(update={"cable": cables}), dynamic=False, comm=problem.comm)
    if problem.lines.growth is not None:
        other.lines.growth.factors = problem.lines.growth.factors

    def put() -> None:
        other.system.u[:] = start
        other.set_time(0.0)

    try:
        other.iterations = 0
        find_rest(other, put, WAYS[: WAYS.index(MOTIONS[0]) + 1 if pushed else 1])
        problem.system.u[:] = other.system.u
        problem.iterations += other.iterations
    finally:
        other.destroy()
    newton(problem)


def by_stiffness(problem: Problem) -> None:
    """Continuation in the axial stiffness, in equal ratios, from lines that their weight stretches by half."""
    arrays = [array_of(group.cable.EA) for group in problem.lines.groups]
    given, sections = [array.copy() for array in arrays], problem.lines.sections
    soft = max(*_weights(problem), *(1e-6 * section.axial_stiffness for section in sections))

    def easier(network: Network) -> Network:
        return replace(network, pieces=[replace(piece, EA=min(soft, piece.EA)) for piece in network.pieces])

    def stiffen(x: float) -> None:
        for array, EA in zip(arrays, given, strict=True):
            array[:] = np.minimum(soft, EA) ** (1 - x) * EA**x

    closed_form(problem, easier).put()
    march(problem, stiffen)


def _weights(problem: Problem) -> list[float]:
    """Weights of the pieces [N]."""
    return [abs(problem.lines.weight_of(k)) * c.length for k, c in enumerate(problem.lines.sections)]


def by_end_force(problem: Problem) -> None:
    """Continuation in the force on free ends, from an upward pull of twice the weight of the line."""
    loads, weights = problem.lines.end_loads, _weights(problem)
    given = {k: load.value.copy() for k, load in loads.items()}
    easy = {k: np.array([0.0, 0.0, 2 * weights[k] or np.linalg.norm(given[k])]) for k in loads}

    def easier(network: Network) -> Network:
        joints = list(network.joints)
        for k, force in easy.items():
            joints[network.pieces[k].end] = replace(joints[network.pieces[k].end], load=force)
        return replace(network, joints=joints)

    def pull(x: float) -> None:
        for k, load in loads.items():
            load.value[:] = (1 - x) * easy[k] + x * given[k]

    closed_form(problem, easier).put()
    march(problem, pull)


def by_end_position(problem: Problem) -> None:
    """Continuation in the position of an end, from 0.7 lengths away from the other at 45 degrees, on the given side."""
    (piece,), lines, u = problem.network.pieces, problem.lines, problem.system.u
    ends: Sequence[Any] = piece.ends
    low, high = (top_position(end.top, 0.0) for end in ends)
    aside = (high - low) * [1.0, 1.0, 0.0]
    size = np.linalg.norm(aside)
    aside = aside / size if size > SAME * piece.section.length else np.array([1.0, 0.0, 0.0])
    easy = low + 0.5 * piece.section.length * (aside + [0.0, 0.0, 1.0 if high[2] >= low[2] else -1.0])
    top = lines.end_dofs[0][1]

    def easier(network: Network) -> Network:
        return replace(network, joints=[network.joints[0], replace(network.joints[1], position=easy)])

    def move(x: float) -> None:
        u[top] = np.tile((1 - x) * easy + x * high, len(top) // 3)

    closed_form(problem, easier).put()
    march(problem, move)


#: For starts far from any equilibrium; the motion has the lines' own inertia, in steps that hardly grow.
MOTIONS = (
    Way("relaxation", by_relaxation),
    Way("damped motion", partial(by_relaxation, growth=1.2, steps=300, momentum=True)),
)
#: All ways, in the order of trial.
WAYS = (
    Way("newton", directly),
    *(
        Way(f"large steps{more}", partial(by_approach, first=first), lambda problem: problem.law is not None)
        for more, first in (("", 1.0), (", smaller first", 0.1))
    ),
    Way("current", by_current, lambda problem: problem.scene.current is not None),
    MOTIONS[0],
    Way("bending", by_bending, lambda problem: problem.network.bends),
    Way("other slack law", by_the_other_law, lambda problem: problem.lines and not problem.network.bends),
    Way(
        "stiffness",
        by_stiffness,
        lambda problem: (
            problem.lines and all(g.cable.EA is not None and not g.cable.kinks for g in problem.lines.groups)
        ),
    ),
    Way("end force", by_end_force, lambda problem: problem.lines and bool(problem.lines.end_loads)),
    Way(
        "end position",
        by_end_position,
        lambda problem: [end.held for piece in problem.network.pieces for end in piece.ends] == [True, True],
    ),
    MOTIONS[1],
)
