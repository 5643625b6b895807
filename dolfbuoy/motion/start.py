"""Initial state of a run: equilibrium, or given shapes and poses."""

from dataclasses import dataclass, field

import numpy as np

from ..model.feasible import check_feasible
from ..model.lines import top_position
from ..model.problem import Problem
from ..model.rigid import rotation_of
from ..scene.network import attached_ends
from ..statics.equilibrium import solve_equilibrium
from ..statics.first_shape import (
    check_first_shape,
    given_pose,
    given_shapes,
    place_of,
    with_buoys_held,
)


@dataclass
class Pose:
    """Motion of a buoy: r_C [m], q_4, velocity of C [m/s], omega in the world frame [1/s]."""

    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular_velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass
class Start:
    """Initial values on this rank; the lines' arrays are numbered as their dofs.

    route: how the equilibrium was found, if it is one.  memory: that of the lines and the bodies at joints.  moorings:
    unknowns of each attachment; take_offs: those of each take-off of this rank.  poses: those of the buoys by name, at
    least of this rank.
    """

    at_rest: bool = True
    route: str | None = None
    lines: np.ndarray | None = None
    memory: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    line_velocity: np.ndarray | None = None
    end_forces: dict[str, np.ndarray] = field(default_factory=dict)
    moorings: list[np.ndarray] = field(default_factory=list)
    take_offs: list[np.ndarray] = field(default_factory=list)
    poses: dict[str, Pose] = field(default_factory=dict)

    def put(self, problem, u):
        """Write the start to the local unknowns of a dynamic Problem, and its memory to that of the models."""
        problem.route = self.route
        if problem.lines:
            u[problem.lines.part.slice] = self.lines
        for attachment, values in zip(problem.attachments, self.moorings, strict=True):
            u[attachment.whole] = values
        for device, values in zip(problem.take_offs, self.take_offs, strict=True):
            u[device.slice] = values
        for name, buoy in problem.buoys.items():
            pose = self.poses[name]
            state = buoy.moving_state(pose.position, pose.quaternion, pose.velocity, pose.angular_velocity)
            u[buoy.part.slice] = state
        if problem.network.joints:
            problem.system.share()
        for model in problem.models:
            model.begin(u)
        for model, memory in self.memory.items():
            for name, values in memory.items():
                getattr(problem, model).memory[name][:] = values


def initial_state(scene, comm, make=Problem, driven=()) -> Start:
    """Start of a run; make: see solve_equilibrium; driven: names of buoys with prescribed motion.

    Raises InputError for an infeasible scene.
    """
    check_feasible(scene)
    check_first_shape(scene)
    network = scene.network
    own = (getattr(b.initial, key) for b in network.buoys.values() for key in ("buoy_position", "buoy_orientation"))
    if scene.initial.kind == "equilibrium" and all(given is None for given in own):
        start = _from_equilibrium(solve_equilibrium(scene, comm, make))
    elif not network.pieces:
        start = _from_equilibrium(solve_equilibrium(scene, comm, make))
        start.at_rest = False
    else:
        start = _from_shape(scene, comm)
        start.at_rest = scene.initial.kind == "equilibrium" and network.buoys.keys() <= set(driven)
    for name, buoy in network.buoys.items():
        _set_buoy(start, name, buoy.initial)
    if start.take_offs and not network.pieces and not start.at_rest:
        poses = {name: (pose.position, pose.quaternion) for name, pose in start.poses.items()}
        start.take_offs = [_at_ends(network, device, poses) for device in network.take_offs.values()]
    for part, length in [
        *((piece, piece.section.length) for piece in network.pieces),
        *((device, 1.0) for device in network.take_offs.values()),
    ]:
        start.at_rest &= not any(_moves(end.top, length) for end in part.ends)
    return start


def _moves(top, length):
    """True if a prescribed end moves at t = 0; length: that of its line [m]."""
    if top is None or top.kind != "prescribed":
        return False
    step = 1e-6 * (top.period or 1.0)
    same = np.allclose(top_position(top, step), top_position(top, 0.0), rtol=0, atol=1e-10 * length)
    return not same


def _from_equilibrium(problem) -> Start:
    start = start_from(problem)
    problem.destroy()
    return start


def start_from(problem) -> Start:
    """Start at rest, copied from a solved static Problem, which may be reused."""
    u = problem.system.u
    start = Start(route=problem.route)
    if problem.lines:
        start.lines = u[problem.lines.part.slice].copy()
        models = {name: model for name in ("lines", "bodies") if (model := getattr(problem, name))}  # of this rank
        start.memory = {
            name: {key: values.copy() for key, values in model.memory.items()} for name, model in models.items()
        }
        start.line_velocity = np.zeros_like(start.lines)
        start.end_forces = problem.end_forces()
    start.moorings = [u[attachment.whole].copy() for attachment in problem.attachments]
    start.take_offs = [u[device.slice].copy() for device in problem.take_offs]
    for name, buoy in problem.buoys.items():
        pose = buoy.fields.of(u[buoy.part.slice])
        start.poses[name] = Pose(pose.position.copy(), pose.orientation / np.linalg.norm(pose.orientation))
    return start


def _from_shape(scene, comm) -> Start:
    """Lines along polylines, or at rest between buoys whose poses are given."""
    start = Start(at_rest=False)
    network = scene.network
    poses = {name: given_pose(buoy.initial) for name, buoy in network.buoys.items()}
    start.poses = {name: Pose(*pose) for name, pose in poses.items()}
    if scene.initial.kind == "equilibrium":
        held = _from_equilibrium(solve_equilibrium(with_buoys_held(scene, poses), comm))
        start.lines, start.memory, start.end_forces = held.lines, held.memory, held.end_forces
        start.route = held.route
    else:
        problem = Problem(scene, dynamic=False, comm=comm)
        start.lines = np.zeros(problem.lines.part.size)
        for piece, shape in enumerate(given_shapes(scene, poses)):
            problem.lines.set_shape(start.lines, shape, lambda s: np.zeros_like(s), piece)
        problem.destroy()
        zero = np.zeros((len(network.cables), 3))
        start.end_forces = {"anchor_force": zero, "end_tension": zero.copy()}
    start.line_velocity = np.zeros_like(start.lines)
    start.moorings = _moorings(network, poses, start.end_forces)
    start.take_offs = [_at_ends(network, device, poses) for device in network.take_offs.values() if comm.rank == 0]
    return start


def _at_ends(network, device, poses):
    """Unknowns of a take-off: positions of its ends, and zero force for those on buoys; 0 for ends at joints."""
    places = [place_of(network, end, poses) for end in device.ends]
    numbers = [np.zeros(3) if place is None else place for place in places]
    pairs = zip(numbers, device.ends, strict=True)
    return np.concatenate([np.pad(x, (0, 3 if end.kind == "buoy" else 0)) for x, end in pairs])


def _moorings(network, poses, end_forces):
    """Unknowns of each attachment, buoy by buoy as in a Problem; without the moments of clamps."""
    found = []
    for piece, end in attached_ends(network):
        held = network.pieces[piece].ends[end]
        force = end_forces["end_tension" if end else "anchor_force"][network.pieces[piece].cable]
        found.append(np.concatenate([place_of(network, held, poses), -force]))
        if held.clamp:
            turned = rotation_of(poses[held.name][1]) @ held.clamp.unit
            found[-1] = np.concatenate([found[-1], turned, np.zeros(3)])
    return found


def _set_buoy(start, name, initial):
    """Override the equilibrium by the pose and velocities given in the section [initial] of a buoy."""
    pose = start.poses.get(name)
    moves = initial.buoy_velocity is not None or initial.buoy_angular_velocity is not None
    start.at_rest &= not moves
    if pose is None:  # it is on another rank
        return
    if initial.buoy_position is not None:
        pose.position = np.array(initial.buoy_position)
    if initial.buoy_orientation is not None:
        q4 = np.array(initial.buoy_orientation)
        pose.quaternion = q4 / np.linalg.norm(q4)
    pose.velocity = np.array(initial.buoy_velocity or (0.0, 0.0, 0.0))
    pose.angular_velocity = np.array(initial.buoy_angular_velocity or (0.0, 0.0, 0.0))
