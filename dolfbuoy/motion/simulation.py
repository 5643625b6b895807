"""A scene in time: initial state, implicit steps, and retries when a step fails."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from ..elsewhere import MPI, quick_start
from ..errors import InputError, SolveError
from ..model.problem import Problem
from ..parallel import pace
from ..parallel.ranks import allreduce
from ..solver.vector_ops import copies, picked, together, traced
from .consistent import make_consistent
from .history import Past
from .schemes import GeneralizedAlpha, Predictor, make_scheme
from .start import initial_state
from .stepping import AdaptiveControl, JumpControl, StepControl


class Simulation:
    """The state of a scene at time `t`, advanced by `advance`.

    scene: with a section [time].  state: that of an earlier Simulation of it, to continue from instead of the start.
    problem: a dynamic Problem of a scene that differs in numbers only, to be reused.  pool: see `model.pool`.
    driven: prescribed motions of buoys for a Problem created here; the buoys start at rest at their positions.
    Raises InputError for an impossible scene, SolveError if a solve fails.
    """

    @quick_start()
    def __init__(self, scene, comm=MPI.COMM_WORLD, state=None, problem=None, pool=None, driven=MappingProxyType({})):
        if scene.time is None:
            raise InputError("time: must be given, a run needs at least its keys end and step.")
        self.scene, self.comm, self.t = scene, comm, 0.0
        self.followers: list[Callable[[], object]] = []  #: called when a step is accepted, before it enters the past
        self.finishers: list[Callable[[], object]] = []  #: called afterwards
        make = Problem if pool is None else pool.problem
        start = initial_state(scene, comm, make, driven) if state is None else None
        self.at_rest = start is not None and start.at_rest
        if problem is None:
            self.problem = make(scene, dynamic=True, comm=comm, **({"driven": driven} if driven else {}))
        else:
            self.problem = problem
            problem.change(scene)
        self.system, self.newton = self.problem.system, self.problem.newton
        self.iterations = 0
        #: `end_forces` in arrays at fixed addresses.
        self.read_end_forces, self.latest_end_forces = self.reader_of_end_forces()
        scheme = make_scheme(scene.time.scheme, scene.time.spectral_radius)
        self.past = Past(self.problem.evolutions(), self.system.u, scheme)
        self.ropes = self._damped_ropes()
        self.predictor, self.control = Predictor(), self._make_control()
        before = self._before = np.zeros_like(self.system.u)
        self._keep, self._go_back = copies([(before, self.system.u)]), copies([(self.system.u, before)])
        self._made_for = None
        if state is None:
            self._load(start)
        else:
            self.restore(state)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _make_control(self):
        time = self.scene.time
        if time.tolerance is None:
            return StepControl(time.step) if self.ropes is None else JumpControl(time.step)
        smallest = time.min_step or 1e-4 * time.step
        largest = time.max_step or min(100 * time.step, max(time.end / 10, time.step))
        return AdaptiveControl(time.step, self.scheme.order, smallest, largest)

    def _damped_ropes(self):
        """Tension unknowns of tension-only lines with internal damping; None without such lines.

        Without damping no step is small enough for the jump when a line becomes taut.
        """
        lines = self.problem.lines
        if lines is None:
            return None
        found = np.array([c.slack == "tension-only" and c.damping > 0 for c in lines.sections])
        return lines.T_dofs[found[lines.line_of_cell]].ravel() if found.any() else None

    def _load(self, start):
        """Set the unknowns to the initial state, make it consistent, and start the series of past values."""
        u = self.system.u
        self.problem.set_time(0.0)
        start.put(self.problem, u)
        self.begin(start.line_velocity)
        self.set_end_forces(start.end_forces)
        if not start.at_rest:
            make_consistent(self)
        self.system.publish()
        self.predictor = Predictor()
        self.predictor.add(0.0, u)

    def begin(self, velocity=None):
        """Restart the past from the present unknowns; velocity: that of the lines' unknowns, default 0 [m/s]."""
        rate = np.zeros(sum(evolution.size for evolution in self.past.evolutions))
        if velocity is not None:
            rate[self.past.place_of(self.problem.lines.part)] = velocity
        self.past.begin([rate])

    def reader_of_end_forces(self) -> tuple[Callable[[], object], dict[str, np.ndarray]]:
        """A function that reads `end_forces` after a residual evaluation, and the arrays it writes to."""

        def find():
            forces = self.problem.end_forces(fresh=False)
            return np.concatenate([np.zeros(0), *(force.ravel() for force in forces.values())])

        flat, place, found = find(), 0, {}
        for name, force in self.problem.end_forces(fresh=False).items():
            found[name] = flat[place : place + force.size].reshape(force.shape)
            place += force.size
        if self.comm.size > 1:
            return lambda: np.copyto(flat, find()), found
        return picked(traced(find, [self.system.u, self.system.last_residual]), flat), found

    @property
    def end_forces(self) -> dict[str, np.ndarray]:
        """Forces that hold the ends of each cable [N], (cable, 3), by their names in a record; empty without any."""
        return {name: force.copy() for name, force in self.latest_end_forces.items()}

    def set_end_forces(self, forces):
        """Set the end forces."""
        for name, force in forces.items():
            self.latest_end_forces[name][:] = force

    @property
    def scheme(self):
        """The time scheme."""
        return self.past.scheme

    @property
    def memory(self):
        """State of accepted steps other than unknowns, model by model."""
        return [model.memory for model in self.problem.models]

    @property
    def quaternion_drift(self) -> float:
        """Largest deviation of a quaternion from unit length before normalisation."""
        return max((float(m["quaternion_drift"][0]) for m in self.memory if "quaternion_drift" in m), default=0.0)

    @property
    def end_tension(self) -> np.ndarray | None:
        """T_bnd, the forces that hold the upper ends of the cables [N], (cable, 3); None without any."""
        return self.end_forces.get("end_tension")

    @property
    def line_velocity(self) -> np.ndarray:
        """Velocity of the lines' unknowns, numbered as these [m/s]."""
        return self.past.rate_of(self.problem.lines.part).copy()

    # -- interruption -----------------------------------------------------------------------------------------------

    def state(self):
        """Everything the rest of the run depends on, on this rank: nested dicts and lists of arrays and numbers.

        Nothing is copied, so it must be stored before the next step.
        """
        return {name: getattr(self, name) for name in ("t", "end_forces", "iterations")} | {
            "places": self.problem.places(),
            "u": self.system.u,
            "newton": self.newton.state(),
            "memory": {str(k): memory for k, memory in enumerate(filter(None, self.memory))},
            "past": self.past.state(),
            "predictor": self.predictor.state(),
            "control": vars(self.control),
        }

    def restore(self, state):
        """Restore the state of a Simulation of the same scene, on the same rank of as many.  Raises InputError."""
        try:
            self._restore(state)
        except InputError:
            raise
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise InputError("The state is not one of this scene: the run can only begin anew.") from error

    def _restore(self, state):
        if not np.array_equal(state["places"], self.problem.places()):
            raise InputError("The unknowns are numbered in another way than in the state: not the same dolfinx.")
        self.t, self.iterations = state["t"], state["iterations"]
        self.set_end_forces(state.get("end_forces", {}))
        self.newton.restore(state["newton"])
        self.past.restore(listed(state, "past"))
        for memory, kept in zip(filter(None, self.memory), listed(state, "memory"), strict=True):
            for name, values in memory.items():
                values[:] = kept[name]
        self.predictor.restore(state["predictor"])
        vars(self.control).update(state["control"])
        self.problem.set_time(self.t)
        self.system.u[:] = state["u"]
        self.system.publish()

    def drive(self, piece, end, motion):
        """See `Problem.drive`."""
        self.problem.drive(piece, end, motion)
        self._made_for = None

    def wind(self, piece, length):
        """See `Problem.wind`."""
        self.problem.wind(piece, length)
        self._made_for = None

    def stop_ends(self):
        """Stop all moving ends at their present positions."""
        self.problem.stop_ends()
        self._made_for = None

    # -- steps --------------------------------------------------------------------------------------------------------

    def step(self, h, judge=None):
        """Take one step of size h [s]; returns the number of Newton iterations.

        judge: (h, local error) -> whether the step is accepted; None is returned if it is not.
        Raises SolveError, leaving the state unchanged.
        """
        self.newton.set_scales(self.past.prepare(h))
        basis = self.past.operations, self.predictor, self.predictor.count, self.problem.scene
        if self._made_for != basis:  # `problem.change` between two steps sets another scene
            self._made_for = basis
            self._make_functions()
        t = self.problem.time[0] = self.t + h
        counts = False
        try:
            self._begin()
            iterations = self.newton.end()
            counts = judge is None or judge(h, self._error())
        finally:
            if not counts:
                self._go_back()
                self.past.give_up()
        if not counts:
            return None
        for follow in self.followers:
            follow()
        if self._accept():
            self.newton.forget()
        for finish in self.finishers:
            finish()
        self.past.count_step()
        self.predictor.counted()
        self.t = t
        return iterations

    def _error(self):
        """Error measure of a step for the step control."""
        if not isinstance(self.control, JumpControl):
            return self._local_error()
        T = self.system.u[self.ropes]
        found = np.abs(T - self._before[self.ropes]).max(initial=0.0), np.abs(T).max(initial=0.0)
        return tuple(float(allreduce(self.comm, one, MPI.MAX)) for one in found)

    def _local_error(self):
        """Largest local error of position and velocity over the tolerance; None without a tolerance or enough past.

        Milne's device: the scheme and the extrapolation of its past are of the same order, and their difference gives
        the derivative contained in both errors.  Differences are relative to the sizes of the evolution.
        """
        tolerance, order = self.scene.time.tolerance, self.scheme.order
        if tolerance is None:
            return None
        self._find_rates()
        largest = self.past.largest_difference(order)
        if largest is None:
            return None
        constant = self.scheme.error_constant
        # Local errors of order p + 1 within this bound accumulate to about `tolerance` over a run (measured).
        allowed = (tolerance / 2.5) ** ((order + 1) / order)
        return allreduce(self.comm, largest, MPI.MAX) * constant / (1 + constant) / allowed

    def _make_functions(self):
        """Create the functions of a step, in C where possible: before it is judged, and after it is accepted."""
        past, problem = self.past.operations, self.problem
        predict, remember = self.predictor.functions(problem.time, self.system.u)
        self._begin = together(self._keep, *past.begin, predict, *problem.clock(), self.newton.begin)
        self._find_rates = together(*past.find_rates)
        models = problem.when_accepted()
        self._accept = together(self._find_rates, self.read_end_forces, *models, *past.accept, remember)

    def advance(self, target):
        """Advance to the time `target`; yields (step, iterations) after each accepted step."""
        control, nominal = self.control, self.scene.time.step
        judge = control.judge
        while target - self.t > 1e-9 * nominal:
            h = control.propose(target - self.t)
            try:
                iterations = self.step(h, judge)
            except SolveError as error:
                try:
                    control.fail(h, str(error))
                except SolveError as final:
                    raise SolveError(f"At t = {self.t:.6g} s, step {h:.3g} s: {final}{self._why()}.") from None
                continue
            if control.restart:
                self.past.forget()
                control.restart = False
            if iterations is not None:
                self.iterations += iterations
                yield h, iterations

    def _why(self):
        """Known reason why steps of this scene fail, or an empty string."""
        radius = self.scene.time.spectral_radius
        if self.scheme.name != GeneralizedAlpha.name or radius == 0 or self.scene.cable is None:
            return ""
        return (
            f"; generalized-alpha with time.spectral_radius = {radius:g} keeps jumps of the tension from step to step, "
            "and in a whip or snap they grow: take 0, or time.scheme = 'bdf2' or 'backward-euler'"
        )

    def run(self):
        """Run to the end of the scene; yields (step, iterations) after each step.

        Times hit exactly are multiples of the step, or with a tolerance those of output_every.
        """
        time = self.scene.time
        interval = time.step if time.tolerance is None else (time.output_every or time.end / 200 or 1.0)
        count = int(np.ceil(time.end / interval - 1e-9))
        for k in range(1, count + 1):
            yield from self.advance(min(k * interval, time.end))
            if pace.watch is not None:
                pace.watch.reached(k, count)


def listed(state, name):
    """Values of state[name] in order; a checkpoint stores lists as dicts with numbered keys."""
    kept = state.get(name, [])
    return kept if isinstance(kept, list) else [kept[str(k)] for k in sorted(map(int, kept))]
