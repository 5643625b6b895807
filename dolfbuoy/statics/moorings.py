"""Equilibrium of a network: from the closed form of its still water to current, wind and turned buoys."""

import math

import numpy as np

from ..errors import InputError, SolveError
from ..model.feasible import shape_and_mass
from ..model.lines import top_position
from ..model.problem import Problem
from ..model.rigid import mooring_offset
from ..model.sea import wind_at
from ..scene.network import single, with_buoy
from . import network as still
from .continuation import find_rest, march
from .relaxation import relax

#: A yaw that still changes by less [rad] has been found.
SETTLED = 1e-11
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def solve_network(problem) -> None:
    """Newton from the rest in still water; where it fails or ends compressed, other ways (`continuation.find_rest`).

    Sets problem.iterations and problem.route.  Raises SolveError.
    """
    _check_reach(problem.network)
    rest = still.solve(still_network(problem))
    find_rest(problem, lambda: _begin(problem, rest), _ways(problem, rest), lambda problem: _why(problem, rest))
    let_turn(problem)


def _check_reach(network):
    """Refuse an inextensible line exactly taut between held ends; shorter ones no scene has.  Raises InputError."""
    for k, piece in enumerate(network.pieces):
        if math.isinf(piece.section.axial_stiffness) and all(end.held for end in piece.ends):
            distance = math.dist(*(top_position(end.top, 0.0) for end in piece.ends))
            if distance >= piece.section.length * (1 - 1e-12):
                raise InputError(
                    f"cable.{network.name_of(k)}.length = {piece.section.length}: must be more than the "
                    f"{distance:.6g} m between its ends, which an inextensible line does not bridge."
                )


def _ways(problem, rest):
    """(name, function) of every way that the scene has."""

    def newton():
        problem.iterations += problem.newton.solve()

    yield "newton", newton
    if problem.scene.current is not None:
        yield "current", lambda: march(problem, lambda x: _scale_current(problem, x))
    if problem.lines.bed is not None:
        yield "relaxation", lambda: relax(problem)
    if problem.lines.section.slack == "compressive":
        yield "tension-only law", lambda: _by_the_other_law(problem, "tension-only", solve_network)
    else:
        yield "two-sided law", lambda: _by_the_other_law(problem, "compressive", lambda other: _newton(other, rest))


#: A rope whose smallest tension is below this part of the largest in the network may hang slack.
HARDLY = 1e-3


def _why(problem, rest):
    """Which ropes hardly pull, so that they fold without width and nothing holds them sideways, if any."""
    if problem.lines.section.slack != "tension-only":
        return ""
    shapes = zip(rest.network.pieces, rest.shapes, strict=True)
    least, largest = np.array([np.sort(shape.tension(np.array([0.0, piece.length]))) for piece, shape in shapes]).T
    loose = [problem.network.name_of(k) for k in np.flatnonzero(least < HARDLY * largest.max())]
    if not loose:
        return ""
    return (
        f": {', '.join(loose)} hardly pulled at one end, where a rope folds and nothing holds it sideways; give "
        "slack = 'compressive', elements of another degree or a current"
    )


def _newton(problem, rest):
    _begin(problem, rest)
    problem.iterations = problem.newton.solve()


def _by_the_other_law(problem, slack, solve):
    """From the state of lines that take no compression to those that do, or the other way round: without slack nodes,
    which have no stiffness, on the way."""
    scene = problem.scene
    cables = [cable.model_copy(update={"slack": slack}) for cable in scene.cables]
    changed = scene.model_copy(update={"cable": cables})
    other = Problem(changed, dynamic=False, comm=problem.comm)
    other.lines.grow_as(problem.lines)
    try:
        solve(other)
        problem.system.u[:] = other.system.u
        problem.iterations += other.iterations
    finally:
        other.destroy()
    problem.iterations += problem.newton.solve()


def _scale_current(problem, fraction):
    for model in problem.models:
        model.sea.scale_current(fraction)


# -- still water, upright buoys ----------------------------------------------------------------------------------------


def still_network(problem) -> still.Network:
    """The network of a Problem as `statics.network` has it: every buoy a joint at its C that stays upright."""
    scene, network, joints, number = problem.scene, problem.network, [], {}

    def place(end):
        """(number of the joint, offset of the end from it)."""
        if end.name is None:
            joints.append(_held(end) if end.held else _pulled(end))
            return len(joints) - 1, still.ORIGIN
        if end.name not in number:
            number[end.name] = len(joints)
            joints.append(_joint(scene, network, end))
        offset = mooring_offset(network.buoys[end.name], end.fairlead) if end.kind == "buoy" else still.ORIGIN
        return number[end.name], offset

    pieces = []
    for k, piece in enumerate(network.pieces):
        (low, a), (high, b) = (place(end) for end in piece.ends)
        c = piece.section
        pieces.append(still.Piece(low, high, c.length, problem.lines.weight_of(k), c.axial_stiffness, a, b))
    # a sloped bed is left to `relax`, from lines that hang through it
    flat = scene.seabed is not None and scene.seabed.slope == (0.0, 0.0)
    return still.Network(joints, pieces, -scene.sea.depth if flat else None)


def _held(end):
    return still.Joint(position=top_position(end.top, 0.0))


def _pulled(end):
    return still.Joint(free=True, load=end.top.force)


def _joint(scene, network, end):
    """A joint by its name, or the buoy in its place."""
    if end.kind == "buoy":
        return still.Joint(free=True, load=_Floating(with_buoy(scene, end.name)))
    if end.held:
        return _held(end)
    body, weight = network.bodies.get(end.name), 0.0
    if body is not None:
        displaced = scene.sea.density * body.volume if scene.sea else 0.0
        weight = (body.mass - displaced) * scene.gravity
    return still.Joint(free=True, load=(0.0, 0.0, -weight))


class _Floating:
    """Weight, buoyancy, wind and external force of an upright buoy, and their derivative, by the place of its C."""

    def __init__(self, scene):
        self.scene = scene
        self.shape, self.mass = shape_and_mass(single(scene).buoy)
        self.steady = np.array([0.0, 0.0, -self.mass.mass * scene.gravity])
        if single(scene).external_force:
            self.steady = self.steady + single(scene).external_force.force
        if single(scene).wind:
            self.steady = self.steady + wind_at(single(scene).wind, max(single(scene).wind.height, 0.1))

    def __call__(self, position):
        force, slope = self.steady.copy(), np.zeros((3, 3))
        if self.scene.sea is not None:
            pressure, draft = self.scene.sea.density * self.scene.gravity, self.mass.height - position[2]
            force[2] += pressure * self.shape.volume(min(max(draft, 0.0), self.shape.height)) if draft > 0 else 0.0
            if 0 < draft < self.shape.height:
                slope[2, 2] = -pressure * np.pi * self.shape.waterplane_radius(draft) ** 2
        return force, slope


# -- elements ----------------------------------------------------------------------------------------------------------


def _begin(problem, rest):
    """Put the closed forms and the upright buoys into the unknowns, with all data as the scene has them."""
    u, lines = problem.system.u, problem.lines
    floor = 1e-3 * problem.typical_force  # a slack point of the closed form has no stiffness at all
    for k, shape in enumerate(rest.shapes):
        lines.set_shape(u, shape.position, lambda s, shape=shape: np.maximum(shape.tension(s), floor), k)
    for attachment in problem.attachments:
        shape, piece = rest.shapes[attachment.piece], problem.network.pieces[attachment.piece]
        s = np.array([piece.section.length * attachment.end])
        pull = shape.force(s)[0] * (-1 if attachment.end else 1)
        u[attachment.slice] = np.concatenate([shape.position(s)[0], pull])
    for buoy in problem.buoys.values():
        attachment = problem.attached_to(buoy)[0]
        r_C = attachment.of(u).point - attachment.offset.value
        u[buoy.part.slice] = np.concatenate([r_C, UPRIGHT])
        buoy.reference.x.array[:] = u[buoy.part.slice]
    problem.set_time(0.0)
    problem.system.share()


def let_turn(problem, rounds=20):
    """The yaw that lines off the axis want: what holds a buoy against turning about its axis goes away by and by."""
    off_axis = any(end.fairlead for piece in problem.network.pieces for end in piece.ends)
    if not off_axis:
        return
    for _ in range(rounds):
        before = problem.system.u.copy()
        for buoy in problem.buoys.values():
            buoy.reference.x.array[:] = before[buoy.part.slice]
            buoy.gauge.value = 0.1 * buoy.gauge.value
        try:
            problem.iterations += problem.newton.solve()
        except SolveError:  # nothing but the gauge holds it: where it is it may stay
            problem.system.u[:] = before
            problem.system.publish()
            return
        turned = max((_largest_turn(b, before, problem.system.u) for b in problem.buoys.values()), default=0.0)
        if max(problem.comm.allgather(turned)) < SETTLED:
            return
    raise SolveError(f"the yaw of the buoys was not found in {rounds} rounds")


def _largest_turn(buoy, before, after):
    x, y = (buoy.fields.of(u[buoy.part.slice]).orientation for u in (before, after))
    return float(np.abs(x - y).max())
