"""A scene in time: initial state, implicit steps, and what is retried when a step fails."""

import numpy as np
from mpi4py import MPI

from ..errors import InputError, SolveError
from ..model.problem import Problem
from ..parallel.ranks import combined
from .consistent import MOMENTA, make_consistent
from .schemes import GeneralizedAlpha, Predictor, Series, make_scheme
from .start import initial_state
from .stepping import AdaptiveControl, StepControl


class Simulation:
    """The state of a scene at time `t`, advanced by `advance`.

    scene: with a section [time].  state: of an earlier Simulation of it, to go on from there instead of the start.
    Raises InputError for an impossible scene, SolveError when a solve fails.
    """

    def __init__(self, scene, comm=MPI.COMM_WORLD, state=None):
        if scene.time is None:
            raise InputError("Missing section [time]: a run needs at least its keys end and step.")
        self.scene, self.comm, self.t = scene, comm, 0.0
        self.scheme = make_scheme(scene.time.scheme, scene.time.spectral_radius)
        start = initial_state(scene, comm) if state is None else None
        self.problem = Problem(scene, dynamic=True, comm=comm)
        self.system, self.cable, self.buoy = self.problem.system, self.problem.cable, self.problem.buoy
        self.quaternion_drift, self.iterations = 0.0, 0
        self._rules = {}  # {series: (gamma, history)} of the step in hand: its rate is gamma x position + history
        self.control = self._make_control()
        if state is None:
            self._load(start)
        else:
            self.restore(state)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _make_control(self):
        time = self.scene.time
        if time.tolerance is None:
            return StepControl(time.step)
        smallest = time.min_step or 1e-4 * time.step
        largest = time.max_step or min(100 * time.step, max(time.end / 10, time.step))
        return AdaptiveControl(time.step, self.scheme.order, smallest, largest)

    def _load(self, start):
        """Put the initial state into the unknowns, make it consistent, and start the series of past values."""
        problem, u = self.problem, self.system.u
        problem.set_time(0.0)
        if self.cable:
            u[problem.cable_part.slice] = start.cable
        if problem.mooring_slice:
            u[problem.mooring_slice] = start.mooring
        state = None
        if self.buoy:
            inertia = np.array(self.buoy.mass.inertia)
            R = start.rotation
            momentum = self.buoy.mass.mass * start.velocity
            spin = R @ (inertia * (R.T @ start.angular_velocity))
            state = np.concatenate([start.position, momentum, start.quaternion, spin])
            u[problem.state_part.slice] = state
        velocity = start.cable_velocity
        self._reset(u, velocity)
        self.end_tension = start.end_tension
        if not start.at_rest:
            make_consistent(self)
        self.system.publish()
        self.predictor = Predictor()
        self.predictor.add(0.0, u)

    def _reset(self, u, velocity):
        self.series = {}
        if self.cable:
            r = u[self.problem.cable_part.slice]
            self.series["r"] = Series(r, velocity)
            self.series["v"] = Series(velocity, np.zeros_like(r), lagged=True)
        if self.buoy:
            y = u[self.problem.state_part.slice]
            self.series["y"] = Series(y, np.zeros_like(y), lagged=MOMENTA)

    # -- interruption -----------------------------------------------------------------------------------------------

    def state(self):
        """All that the rest of the run depends on, on this rank: nested dicts and lists of arrays and numbers.

        Nothing is copied, so it has to be stored before the next step.
        """
        own = ("t", "end_tension", "quaternion_drift", "iterations")
        return {name: getattr(self, name) for name in own} | {
            "node_s": self.cable.node_s if self.cable else None,
            "u": self.system.u,
            "system": self.system.state(),
            "series": {name: vars(series) for name, series in self.series.items()},
            "predictor": vars(self.predictor),
            "control": vars(self.control),
        }

    def restore(self, state):
        """Be where a Simulation of the same scene was, on the same rank of as many.  Raises InputError if it cannot."""
        if self.cable and not np.array_equal(state["node_s"], self.cable.node_s):
            raise InputError(
                "The cable's unknowns are numbered in another way than in the state: not the same dolfinx."
            )
        self.t, self.end_tension = state["t"], state.get("end_tension")
        self.quaternion_drift, self.iterations = state["quaternion_drift"], state["iterations"]
        self.system.restore(state["system"])
        self.series, self.predictor = {}, Predictor()
        for name, values in state.get("series", {}).items():
            self.series[name] = Series(values["rate"], values["rate"])
            vars(self.series[name]).update(values)
        vars(self.predictor).update(state["predictor"])
        vars(self.control).update(state["control"])
        self.problem.set_time(self.t)
        self.system.u[:] = state["u"]
        self.system.publish()

    # -- steps --------------------------------------------------------------------------------------------------------

    def _prepare(self, step):
        """Hand gamma and history of a step to the forms."""
        for name, series in self.series.items():
            self.scheme.begin(step, series, base=self.series["r"] if name == "v" else None)
        gamma = 1 / step
        if self.cable:
            c = self.cable
            gamma, h_r = self.scheme.rule(step, self.series["r"])
            _, h_v = self.scheme.rule(step, self.series["v"])
            c.gamma_v.value, c.gamma_a.value = gamma, gamma**2
            h_a = gamma * h_r + h_v
            c.history_v.x.array[:], c.history_a.x.array[:] = h_r, h_a
            self._rules |= {"r": (gamma, h_r), "v": (gamma**2, h_a)}
        if self.buoy:
            gamma, h_y = self.scheme.rule(step, self.series["y"])
            self.buoy.gamma.value = gamma
            self.buoy.history.x.array[:] = h_y
            self._rules["y"] = gamma, h_y
        self.system.set_scales(gamma)

    def _rates(self):
        """Rates of r, v and y at the end of the step that was just solved."""
        parts = {"r": self.problem.cable_part, "v": self.problem.cable_part, "y": self.problem.state_part}
        return {name: gamma * self.system.u[parts[name].slice] + h for name, (gamma, h) in self._rules.items()}

    def step(self, h, judge=None):
        """One step of size h [s]; returns Newton's iterations.

        judge: called with h and the local error, says whether the step counts; None is returned if it does not.
        Raises SolveError and leaves the state as it was.
        """
        before, kept = self.system.u.copy(), {name: series.state() for name, series in self.series.items()}
        t = self.t + h
        self._prepare(h)
        self.system.u[:] = self.predictor.at(t)
        self.problem.set_time(t)
        counts = False
        try:
            iterations = self.system.solve()
            rates = self._rates()
            counts = judge is None or judge(h, self._local_error(rates))
        finally:
            if not counts:
                self.system.u[:] = before
                for name, state in kept.items():
                    self.series[name].restore(state)
        if not counts:
            return None
        self._accept(t, rates)
        return iterations

    def _local_error(self, rates):
        """Largest local error of position and velocity over the tolerance; None without a tolerance or without a past.

        Milne's device: the scheme's rule and the extrapolation of its past are of the same order, and their difference
        shows the derivative that both errors contain.  Positions count relative to the length of the cable or the
        size of the buoy, velocities relative to sqrt(g length).
        """
        tolerance, order = self.scene.time.tolerance, self.scheme.order
        if tolerance is None:
            return None
        predicted = {name: series.extrapolated(order) for name, series in self.series.items()}
        if any(value is None for value in predicted.values()):
            return None
        largest, g, u = 0.0, max(self.scene.gravity, 1.0), self.system.u
        if self.cable:
            nodes, L = self.cable.node_dofs, self.scene.cable.length
            difference_r = (u[self.problem.cable_part.slice] - predicted["r"])[nodes]
            difference_v = (rates["r"] - predicted["v"])[nodes]
            largest = max(np.abs(difference_r).max() / L, np.abs(difference_v).max() / np.sqrt(g * L))
        if self.buoy:
            difference = np.abs(u[self.problem.state_part.slice] - predicted["y"])
            largest = max(largest, (difference / self.buoy.state_sizes).max())
        constant = self.scheme.error_constant
        # Local errors of order p + 1 that are this small add up to about `tolerance` over a run (measured).
        allowed = (tolerance / 2.5) ** ((order + 1) / order)
        return combined(self.comm, largest, MPI.MAX) * constant / (1 + constant) / allowed

    def _forget_the_past(self):
        """Begin the series anew from the present values and rates."""
        for series in self.series.values():
            series.forget()
        if self.cable:
            self.series["r"].second = self.series["v"].rate

    def _accept(self, t, rates):
        u, accept = self.system.u, self.scheme.accept
        self.end_tension = self.problem.end_tension(fresh=False) if self.cable else None
        if self.cable:
            r = u[self.problem.cable_part.slice]
            accept(self.series["r"], r, rates["r"])
            accept(self.series["v"], rates["r"], rates["v"])
        if self.buoy:
            y = u[self.problem.state_part.slice]
            length = np.linalg.norm(y[6:10])
            self.quaternion_drift = max(self.quaternion_drift, abs(length - 1))
            y[6:10] /= length
            accept(self.series["y"], y, rates["y"])
        self.predictor.add(t, u)
        self.t = t

    def advance(self, target):
        """To the time `target`; yields (step, iterations) after each step that counts."""
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
            if iterations is not None:
                self.iterations += iterations
                yield h, iterations
            elif control.restart:
                self._forget_the_past()
                control.restart = False

    def _why(self):
        """What is known to make steps of this scene fail."""
        radius = self.scene.time.spectral_radius
        if self.scheme.name != GeneralizedAlpha.name or radius == 0 or self.cable is None:
            return ""
        return (
            f"; generalized-alpha with time.spectral_radius = {radius:g} keeps jumps of the tension from step to step, "
            "and in a whip or snap they grow: take 0, or time.scheme = 'bdf2' or 'backward-euler'"
        )

    def run(self):
        """Steps to the end of the scene; yields (step, iterations) after each.

        Milestones are the multiples of the step, or with a tolerance those of output_every.
        """
        time = self.scene.time
        interval = time.step if time.tolerance is None else (time.output_every or time.end / 200 or 1.0)
        count = int(np.ceil(time.end / interval - 1e-9))
        for k in range(1, count + 1):
            yield from self.advance(min(k * interval, time.end))
