"""How a run starts: from equilibrium, or from a given shape and pose."""

from dataclasses import dataclass, field

import numpy as np

from ..model.feasible import check_feasible
from ..model.first_shape import check_first_shape, given_pose, points_of
from ..model.lines import top_position
from ..model.problem import Problem
from ..scene import Top
from ..statics.equilibrium import solve_equilibrium


@dataclass
class Start:
    """Initial values on this rank; the lines' arrays are numbered as their dofs."""

    at_rest: bool = True
    lines: np.ndarray | None = None
    line_memory: dict[str, np.ndarray] = field(default_factory=dict)
    line_velocity: np.ndarray | None = None
    end_forces: dict[str, np.ndarray] = field(default_factory=dict)
    mooring: np.ndarray | None = None
    position: np.ndarray | None = None
    quaternion: np.ndarray | None = None
    velocity: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None

    def put(self, problem, u):
        """Into the local unknowns of a dynamic Problem."""
        if problem.lines:
            u[problem.lines.part.slice] = self.lines
        for attachment in problem.attachments:
            u[attachment.slice] = self.mooring
        if problem.buoy:
            pose = self.position, self.quaternion, self.velocity, self.angular_velocity
            u[problem.buoy.part.slice] = problem.buoy.moving_state(*pose)

    def remember(self, problem):
        """What the equilibrium left behind besides unknowns (where friction holds), into a dynamic Problem."""
        for name, values in self.line_memory.items():
            problem.lines.memory[name][:] = values


def initial_state(scene, comm, make=Problem) -> Start:
    """Start of a run; make: see solve_equilibrium.  Raises InputError for what cannot be."""
    initial = scene.initial
    check_feasible(scene)
    check_first_shape(scene)
    if initial.kind == "equilibrium" and not _pose_given(scene):
        start = _from_equilibrium(solve_equilibrium(scene, comm, make))
    elif scene.cable is None:
        start = _from_equilibrium(solve_equilibrium(scene, comm, make))
        start.at_rest = False
    else:
        start = _from_shape(scene, comm)
    _set_buoy(start, scene)
    if scene.cable and scene.cable.top and scene.cable.top.kind == "prescribed":
        step = 1e-6 * scene.cable.top.period
        start.at_rest &= bool(
            np.allclose(
                top_position(scene.cable.top, step),
                top_position(scene.cable.top, 0.0),
                rtol=0,
                atol=1e-10 * scene.cable.length,
            )
        )
    return start


def _pose_given(scene):
    initial = scene.initial
    return scene.buoy is not None and (initial.buoy_position or initial.buoy_orientation) is not None


def _from_equilibrium(problem) -> Start:
    u = problem.system.u
    start = Start()
    if problem.lines:
        start.lines = u[problem.lines.part.slice].copy()
        start.line_memory = {name: values.copy() for name, values in problem.lines.memory.items()}
        start.line_velocity = np.zeros_like(start.lines)
        start.end_forces = problem.end_forces()
    for attachment in problem.attachments:
        start.mooring = u[attachment.slice].copy()
    if problem.buoy:
        pose = problem.buoy.fields.of(u[problem.buoy.part.slice])
        start.position, start.quaternion = pose.position.copy(), pose.orientation / np.linalg.norm(pose.orientation)
    problem.destroy()
    return start


def _from_shape(scene, comm) -> Start:
    """Cable along a straight line or polyline, or at rest below a buoy whose pose is given."""
    start = Start(at_rest=False)
    r_O = None
    if scene.buoy:
        start.position, start.quaternion, r_O = given_pose(scene)
    if scene.initial.kind == "equilibrium":
        top = Top(kind="fixed", position=tuple(float(x) for x in r_O))
        cable = scene.cable.model_copy(update={"top": top})
        alone = scene.model_copy(update={"cable": cable, "buoy": None, "wind": None, "external_force": None})
        held = _from_equilibrium(solve_equilibrium(alone, comm))
        start.lines, start.line_memory, start.end_forces = held.lines, held.line_memory, held.end_forces
    else:
        problem = Problem(scene, dynamic=False, comm=comm)
        points = points_of(scene, r_O)
        start.lines = np.zeros(problem.lines.part.size)
        problem.lines.set_shape(start.lines, _along(points, scene.cable), lambda s: np.zeros_like(s))
        start.end_forces = {"anchor_force": np.zeros(3), "end_tension": np.zeros(3)}
        problem.destroy()
    start.line_velocity = np.zeros_like(start.lines)
    if scene.buoy:
        T_O = -start.end_forces["end_tension"]
        start.mooring = np.concatenate([r_O, T_O])
    return start


def _set_buoy(start, scene):
    """Pose and velocities that the scene gives, over those of the equilibrium."""
    if scene.buoy is None:
        return
    initial = scene.initial
    if start.position is not None or scene.cable is None:
        if initial.buoy_position is not None:
            start.position = np.array(initial.buoy_position)
        if initial.buoy_orientation is not None:
            q4 = np.array(initial.buoy_orientation)
            start.quaternion = q4 / np.linalg.norm(q4)
    start.velocity = np.array(initial.buoy_velocity or (0.0, 0.0, 0.0))
    start.angular_velocity = np.array(initial.buoy_angular_velocity or (0.0, 0.0, 0.0))
    if initial.buoy_velocity is not None or initial.buoy_angular_velocity is not None:
        start.at_rest = False


def _along(points, cable):
    """s -> point on the polyline, arc length proportional to s."""
    points = np.array(points)
    corners = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    corners *= cable.length / corners[-1]
    return lambda s: np.column_stack([np.interp(s, corners, points[:, k]) for k in range(3)])
