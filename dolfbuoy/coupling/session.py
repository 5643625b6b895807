"""A scene that a caller advances step by step, drives, loads, reads and rewinds.

World frame: z up, z = 0 at still water.  SI units, angles in rad.  Quaternions (q0, q1, q2, q3), q0 first, rotate
vectors from body to world.  Forces are those on the caller's side, as documented for each function.
"""

import math
from collections.abc import Iterable
from contextlib import ExitStack
from functools import partial
from pathlib import Path as File
from typing import Any, Self

import numpy as np

from ..elsewhere import MPI
from ..errors import InputError
from ..model.attachment import FIELDS
from ..model.buoy import MOTION
from ..model.rigid import rotation_of
from ..model.sea import elevation_at, velocity_at
from ..motion.simulation import Simulation
from ..parallel import interruption
from ..parallel.ranks import bcast
from ..results import checkpoint
from ..results import folder as folders
from ..results.observe import Observer
from ..results.recorder import Recorder
from ..scene import Scene, load_scene
from . import names
from .carried import Carried
from .forces import Force, state_of
from .paths import LARGEST, Array, BodyState, Length, Path, Pose, Wrench, numbers_of
from .saved import Saved, copied, kept, own_of, pack, put_back, take_up, unpack


class Session:
    """A scene in its equilibrium at t = 0, or from a checkpoint, advanced by the caller; a context manager.

    scene: as for `simulate`, with a section [time]: its step is the longest allowed, its end is ignored.
    driven: names of the parts that the caller moves.  Held ends of lines: "CABLE.from", "CABLE.to", or the name of a
    joint, which if free is then held, without its body; buoys, which then follow the caller regardless of the forces on
    them; vessels that rest in the scene; and "CABLE.winch", the unstretched length of a line, or "CABLE.NUMBER.winch"
    for one of its segments.
    out: folder for results.nc, scene.toml and checkpoint.npz, written as in a run; without it nothing is recorded.
    resume: folder of a run or session to continue, instead of scene and out.  comm: on several ranks all functions are
    collective.  overwrite, overrides: as for `simulate`.
    Raises InputError for an invalid scene, folder or name, SolveError if no equilibrium is found.
    """

    def __init__(
        self,
        scene: Scene | str | File | dict[str, Any] | None = None,
        out: str | File | None = None,
        *,
        driven: Iterable[str] = (),
        resume: str | File | None = None,
        comm: Any = MPI.COMM_WORLD,
        overwrite: bool = False,
        **overrides: Any,
    ) -> None:
        self.comm, self._open, self._recorder = comm, ExitStack(), None
        if (scene is None) == (resume is None) or (resume is not None and (out is not None or overrides)):
            raise InputError("A session needs a scene, or resume = a folder, which then brings its own scene.")
        try:
            folder, point = (out, None) if resume is None else (resume, checkpoint.load(resume, comm.size))
            self.scene = load_scene(scene or {}, **overrides) if point is None else point.scene
            if point is None:
                driven = [driven] if isinstance(driven, str) else list(driven)
                self.scene = names.holding_joints(self.scene, driven, comm)
            if folder is not None:
                self._open.enter_context(folders.claimed(folder, comm))
                point = point and checkpoint.load(folder, comm.size)  # no other process writes there now
                self._take(File(folder), point, overwrite)
            self._begin(driven, point)
            if folder is not None:
                self._recorder = Recorder(self.simulation, File(folder), point, more=partial(kept, self))
                self._recorder.record.attributes["session"] = "driven: " + (", ".join(self.paths) or "nothing")
        except BaseException:
            self._open.close()
            raise

    # -- set-up -------------------------------------------------------------------------------------------------------

    def _take(self, folder: File, point: checkpoint.Checkpoint | None, overwrite: bool) -> None:
        """Prepare to write in a folder."""
        if point is not None:
            folders.go_on(folder, self.scene, self.comm)
        else:
            if folders.holds(folder, "run", self.scene, overwrite, self.comm):
                raise InputError(f"{folder} holds a run of this scene: take another folder, or overwrite = True.")
            if self.comm.rank == 0:
                folders.begin(folder, "run", self.scene)
        if self.comm.rank == 0:
            folders.remark(folder, "run", session=True)

    def _begin(self, driven: Iterable[str], point: checkpoint.Checkpoint | None) -> None:
        network, driven = self.scene.network, [driven] if isinstance(driven, str) else list(driven)
        wound = {name: piece for name in driven if (piece := names.wound_piece(network, name)) is not None}
        vessels = {vessel.name: vessel for vessel in self.scene.vessel or []}
        others = [name for name in driven if name not in wound and name not in vessels]
        ends = {name: names.driven_ends(network, name) for name in others if name not in network.buoys}
        bodies = {name: partial(self._place, name) for name in others if name not in ends}
        for name in bodies:
            names.check_body(network, name)
        self.paths: dict[str, Path] = {}
        self._targets: dict[str, tuple[Any, ...]] = {}
        self._ends: dict[str, list[tuple[int, int]]] = {}  # by names requested from `pull`
        self._forces: dict[str, Force] = {}
        state = point.states[self.comm.rank] if point else None
        self.simulation = Simulation(self.scene, self.comm, state, driven=bodies)
        self._open.callback(self.simulation.problem.destroy)
        self.carried = {name: Carried(self.simulation, vessels[name]) for name in driven if name in vessels}
        self.paths |= {name: carried.path for name, carried in self.carried.items()}
        for name, piece in wound.items():
            self.paths[name] = Length(self.t, [network.pieces[piece].section.length])
            self.simulation.wind(piece, self.paths[name])
        for name in others:
            if name in bodies:
                self.paths[name] = Pose(self.t, [float(x) for x in np.concatenate(self.state(name)[:2])])
                continue
            self.paths[name] = Path(self.t, names.end_now(self.simulation.problem, *ends[name][0]))
            for piece, end in ends[name]:
                self.simulation.drive(piece, end, self.paths[name])
        time: Any = self.scene.time
        self._step, self._longest = time.step, time.step if time.tolerance is None else math.inf
        self._series = self.t, -1.0, 0  # start, size and number of equal steps
        self._required = {name: Wrench(np.zeros(3), np.zeros(3)) for name in bodies}
        self._observer: Observer | None = None
        #: (t, name) of functions that were loads when the checkpoint was written: its matrix has their slopes.
        self._awaited: set[tuple[float, str]] = set()
        if state is None or not take_up(self, state):
            self._find_required()

    def _place(self, name: str, t: float) -> Any:
        """Motion of a driven body at a time, as needed by `Buoy.moving_state`."""
        path = self.paths.get(name)
        return path and path(t)  # None while a run starts: it is at its position in the scene

    # -- what the caller does -----------------------------------------------------------------------------------------

    def drive(
        self,
        name: str,
        position: Any,
        orientation: Any = None,
        velocity: Any = None,
        angular_velocity: Any = None,
    ) -> None:
        """Move a driven part over the next step; without a call it stays in place.

        position: of an end of a line, of C of a buoy, or length of a line, at the end of the step [m]; or a function of
        time that holds until the next call: t -> position of an end, or length; for a buoy (position, orientation,
        velocity, angular_velocity).
        orientation: of a buoy, a quaternion.  velocity [m/s] and, for a buoy, angular_velocity [rad/s]: at the end of
        the step.  Shorter steps in between follow the cubic through positions and velocities at both ends (error of
        order 4 in the step); without velocities, the parabola through the last three positions (order 3), at first a
        straight line.
        """
        path = self.paths.get(name)
        if path is None:
            raise InputError(f"{name!r} is not driven: {', '.join(self.paths) or 'nothing'} is, as the session began.")
        if callable(position):
            path.function = position
        else:
            self._targets[name] = path.target(name, position, orientation, velocity, angular_velocity)
            path.function = None

    def load(self, name: str, force: Any = (0.0, 0.0, 0.0), moment: Any = (0.0, 0.0, 0.0)) -> None:
        """Apply a force [N] and a moment [N m] (world frame) to a part, from the next step until another call.

        name: a buoy that is not driven, with the force at C; a free joint or a free "CABLE.to", without moment.
        The load applies at the end of every step, where the equations are solved.  force may be a function (t, state)
        -> force, for a buoy optionally (force, moment), which becomes part of the equations: it is evaluated in
        Newton's method, with a finite-difference derivative; state is a BodyState or a PointState.
        """
        given = None
        if not callable(force):
            given = [numbers_of(key, x, 3, LARGEST) for key, x in (("force", force), ("moment", moment))]
        problem = self.simulation.problem
        count, rows = names.loaded_rows(problem, name, self.paths)
        if given and any(given[1]) and count < 6:
            raise InputError(f"moment: {name!r} is a point of a line, which takes none.")
        if given is None and len(rows):
            if name not in self._forces:
                self._forces[name] = Force(self.simulation, rows, problem.buoys.get(name))
            self._forces[name].function = force
            self.simulation.newton.numbers.valid &= (self.t, name) in self._awaited
        elif given is not None and len(rows):
            if name in self._forces:
                self._forces[name].stop()
            self.simulation.system.loads[rows] = [-x for pair in given for x in pair][:count]

    def step(self, dt: float | None = None) -> None:
        """Advance by dt [s], by default the scene's step.  Equal steps are counted: the time is k dt, not a sum."""
        dt = self._step if dt is None else dt
        begin, size, count = self._series
        if dt != size or abs(begin + count * size - self.simulation.t) > 1e-9 * dt:
            begin, count = self.t, 0
            if not 0 < dt < math.inf:
                raise InputError(f"dt = {dt}: must be a positive number of seconds.")
        self.advance_to(begin + (count + 1) * dt)
        self._series = begin, dt, count + 1

    def advance_to(self, t: float) -> None:
        """Advance to the time t [s], in equal steps of at most the scene's, or in adaptive steps with a tolerance.

        Driven parts reach their targets at t.  Raises SolveError, at an earlier time, if a step fails for good.
        """
        simulation, targets = self.simulation, self._targets
        begin, size = simulation.t, simulation.control.step
        if not begin < t < math.inf:
            raise InputError(f"t = {t}: must be after {begin:g} s, the time that was reached.")
        for name, path in self.paths.items():
            path.follow(t, targets.pop(name, None))
        count = max(1, math.ceil((t - begin) / self._longest - 1e-6))
        try:
            for k in range(1, count + 1):
                target = t if k == count else begin + k * (t - begin) / count
                for taken in simulation.advance(target):
                    if self._recorder is not None:
                        self._recorder.add(*taken)
                interruption.check()
        except BaseException:
            self._give_up(begin, size)
            raise
        if self._required:
            self._find_required()

    def _give_up(self, begin: float, size: float) -> None:
        """Prepare for another try after a failed solve, from where the driven parts have come to.
        With steps as large as before, since a history of ever smaller steps would upset the next one."""
        for path in self.paths.values():
            path.cut(self.t)
        self.simulation.control.step = size
        if self.t > begin:
            self.simulation.past.forget()

    def save(self) -> Saved:
        """Save the present instant in memory; any number of instants may be kept while the session is open."""
        simulation = self.simulation
        state = copied(simulation.state())
        mark = self._recorder.mark() if self._recorder is not None else None
        return Saved(id(self), state, simulation.newton.numbers.assembled, own_of(self), mark)

    def pack(self, saved: Saved) -> bytes:
        """A saved instant as bytes, to be read by `unpack` of another session of this scene, in any process.

        Raises InputError if a Python function moves or loads anything, or if the session writes a record.
        """
        return pack(self, saved)

    def unpack(self, content: bytes) -> Saved:
        """The instant in bytes from `pack`, for `restore` here; the continuation is identical, bit for bit.

        Raises InputError for invalid bytes, or those of another scene or of other driven parts.
        """
        return unpack(self, content)

    def restore(self, saved: Saved) -> None:
        """Return to a saved instant, bit for bit: the continuation is the same as it would have been then.

        Later rows of the record are dropped.  Driven positions and loads are restored too.
        """
        if saved.session != id(self):
            raise InputError("restore: the state is that of another session.")
        if self._recorder is not None and saved.mark is None:
            raise InputError("restore: the session writes a record, which a state from elsewhere has no part in.")
        numbers, state = self.simulation.newton.numbers, saved.state
        same = numbers.assembled == saved.assembled  # neither the matrix nor its factors have been renewed since
        if same:
            state = state | {"newton": state["newton"] | {"matrix": None}}
        self.simulation.restore(state)
        if same:
            numbers.valid, numbers.kept = saved.state["newton"]["matrix"] is not None, False
        put_back(self, saved.own)
        for name, force in self._forces.items():
            force.stop()
            force.function = saved.own["functions"].get(name)
        if self._recorder is not None and saved.mark is not None:
            self._recorder.rewind(saved.mark)

    # -- what the caller reads ----------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time reached [s]."""
        return float(self.simulation.t)

    def pull(self, name: str) -> Array:
        """Force of the lines on the support of their end [N]: "CABLE.from", "CABLE.to", or a held joint.

        World frame.  The record has the opposite, the force that holds the end.  For a driven "CABLE.winch" a single
        number, the mean tension of the line that it winds.
        """
        wound = names.wound_piece(self.scene.network, name) if name.endswith(".winch") and name in self.paths else None
        if wound is not None:
            return np.array([names.mean_tension(self.simulation.problem, wound)])
        total = np.zeros(3)
        if (ends := self._ends.get(name)) is None:
            ends = self._ends[name] = names.ends_of(self.scene.network, name)
        if not ends:
            cables = ", ".join(f"{cable}.from, {cable}.to" for cable in self.scene.network.cables)
            raise InputError(f"pull: {name!r} must be an end of a line or a joint: {cables or 'there is none'}.")
        for piece, end in ends:
            force = self.simulation.latest_end_forces["end_tension" if end else "anchor_force"]
            total -= force[self.scene.network.pieces[piece].cable]
        return total

    def pulls(self, buoy: str) -> Wrench:
        """Force [N] and moment [N m] of all lines and take-offs on a buoy, or on a driven vessel, in the world frame.
        The moment is about C, or about the reference point of the vessel."""
        if buoy in self.carried:
            return self.carried[buoy].pulls()
        problem, found = self.simulation.problem, None
        held = problem.buoys.get(self._buoy(buoy))
        if held is not None:
            u, force, moment = problem.system.u, np.zeros(3), np.zeros(3)
            R = rotation_of(MOTION.of(u[held.part.slice]).orientation)
            for attachment in (*problem.attached_to(held), *problem.take_offs_on(held)):
                offset: Any = attachment.offset
                T_O = FIELDS.of(u[attachment.slice]).force
                force, moment = force + T_O, moment + np.cross(R @ offset.value, T_O)
                if attachment.clamp is not None:
                    moment = moment + attachment.clamp.torque_of(u)
            found = Wrench(force, moment)
        return Wrench(*bcast(self.comm, found, problem.buoy_ranks[buoy]))

    def required(self, buoy: str) -> Wrench:
        """Force [N] and moment about C [N m], world frame, that the caller must apply to move a driven buoy as given.

        They include its inertia, weight and hull forces as well as its lines; 0 before the first step.
        """
        if buoy not in self._required:
            raise InputError(f"{buoy!r} must be a buoy that is driven: {', '.join(self._required) or 'none is'}.")
        return self._required[buoy]

    def state(self, buoy: str) -> BodyState:
        """Motion of a buoy."""
        problem, found = self.simulation.problem, None
        held = problem.buoys.get(self._buoy(buoy))
        if held is not None:
            found = state_of(held, problem.system.u[held.part.slice])
        return BodyState(*bcast(self.comm, found, problem.buoy_ranks[buoy]))

    def values(self) -> dict[str, Array]:
        """Quantities of this instant by name as in a record, with the same signs, on rank 0: tensions, poses, ..."""
        return self.observer.values({})

    def shape(self) -> dict[str, Array]:
        """Points (node, 3) [m] of the lines, their velocities and tensions (cell) [N], as in a record, on rank 0."""
        fixed = self.observer.fixed()
        return fixed | self.observer.frame(self.simulation.line_velocity)

    @property
    def observer(self) -> Observer:
        """Reader of all recorded quantities."""
        if self._observer is None:
            made = self._recorder and self._recorder.observer
            self._observer = made or Observer(self.simulation.problem, self.simulation.latest_end_forces)
        return self._observer

    def elevation(self, points: Any) -> Array:
        """Elevation of the undisturbed water surface at points (..., 3) at this instant [m]."""
        return elevation_at(self.scene, self.t, points)

    def water_velocity(self, points: Any) -> Array:
        """Velocity (..., 3) of the undisturbed water, waves and current, at points (..., 3) at this instant [m/s]."""
        return velocity_at(self.scene, self.t, points)

    def _buoy(self, name: str) -> str:
        known = self.scene.network.buoys
        if name not in known:
            raise InputError(f"{name!r} must be a buoy: {', '.join(known) or 'the scene has none'}.")
        return name

    def _find_required(self) -> None:
        """Take `required` from the residual of a driven buoy's rows in the last Newton evaluation."""
        problem = self.simulation.problem
        for name in self._required if self.t > 0 else ():
            found = None
            if (buoy := problem.buoys.get(name)) is not None:
                rows = MOTION.of(problem.system.last_residual[buoy.part.slice])
                found = Wrench(rows.momentum.copy(), rows.angular_momentum.copy())
            self._required[name] = Wrench(*bcast(self.comm, found, problem.buoy_ranks[name]))

    # -- end ----------------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Bring the record to the disk and give everything back; a second time it does nothing."""
        recorder, self._recorder = self._recorder, None
        with self._open:
            if recorder is not None:
                recorder.save()
                if self.comm.rank == 0:
                    folders.finish(recorder.folder, "run")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
            return
        recorder, self._recorder = self._recorder, None
        with self._open:
            if recorder is not None:
                recorder.close()
