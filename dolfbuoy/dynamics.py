"""A scene in time: initial state, implicit steps, and what is retried when a step fails."""

import numpy as np
from mpi4py import MPI

from .errors import InputError, SolveError
from .problem import Problem
from .schemes import SCHEMES, Predictor, Series
from .start import initial_state

#: A failing step is halved at most this often.
MAX_HALVINGS = 12


class Simulation:
    """The state of a scene at time `t`, advanced by `advance`.

    scene: with a section [time].  Raises InputError for an impossible scene, SolveError when a solve fails.
    """

    def __init__(self, scene, comm=MPI.COMM_WORLD):
        if scene.time is None:
            raise InputError("Missing section [time]: a run needs at least its keys end and step.")
        self.scene, self.comm, self.t = scene, comm, 0.0
        self.scheme = SCHEMES[scene.time.scheme]()
        start = initial_state(scene, comm)
        self.problem = Problem(scene, dynamic=True, comm=comm)
        self.system, self.cable, self.buoy = self.problem.system, self.problem.cable, self.problem.buoy
        self.failed_steps, self.quaternion_drift, self.iterations = 0, 0.0, 0
        self._load(start)

    # -- set-up -----------------------------------------------------------------------------------------------------

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
            self._make_consistent(u.copy())
        self.system.publish()
        self.predictor = Predictor()
        self.predictor.add(0.0, u)

    def _reset(self, u, velocity):
        self.series = {}
        if self.cable:
            r = u[self.problem.cable_part.slice]
            self.series["r"] = Series(r, velocity)
            self.series["v"] = Series(velocity, np.zeros_like(r))
        if self.buoy:
            y = u[self.problem.state_part.slice]
            self.series["y"] = Series(y, np.zeros_like(y))

    def _make_consistent(self, u0):
        """Velocity projected onto the constraint, then tension and acceleration that go with it.

        Two backward-Euler steps of a thousandth of the time step from the same positions: the first one ends with the
        admissible velocity that is nearest in kinetic energy, the second one with tension and acceleration, up to
        terms of the size of that small step.
        """
        scheme, self.scheme = self.scheme, SCHEMES["backward-euler"]()
        h = 1e-3 * self.scene.time.step
        for _ in range(2):
            self.system.u[:] = u0
            self._prepare(h)
            self.problem.set_time(0.0)
            self.system.solve()
            rates = {name: rate.copy() for name, rate in self._rates().items()}
            solved = self.system.u.copy()
            if self.cable:
                self.series["v"] = Series(rates["r"], rates["v"])
                self.series["r"] = Series(u0[self.problem.cable_part.slice], rates["r"])
                u0[self._tension_dofs()] = solved[self._tension_dofs()]
            if self.buoy:
                y0, y1 = u0[self.problem.state_part.slice], solved[self.problem.state_part.slice]
                y0[3:6], y0[10:13] = y1[3:6], y1[10:13]
                self.series["y"] = Series(y0, rates["y"])
                if self.problem.mooring_slice:
                    u0[self.problem.mooring_slice][3:] = solved[self.problem.mooring_slice][3:]
        self.end_tension = self.problem.end_tension() if self.cable else None
        self.system.u[:] = u0
        self.scheme = scheme

    def _tension_dofs(self):
        c = self.cable
        dofs = c.T_dofs.ravel()
        return dofs if c.mean_dofs is None else np.concatenate([dofs, c.mean_dofs])

    # -- steps --------------------------------------------------------------------------------------------------------

    def _prepare(self, step):
        """Hand gamma and history of a step to the forms."""
        gamma = 1 / step
        if self.cable:
            c = self.cable
            gamma, h_r = self.scheme.rule(step, self.series["r"])
            _, h_v = self.scheme.rule(step, self.series["v"])
            c.gamma_v.value, c.gamma_a.value = gamma, gamma**2
            c.history_v.x.array[:] = h_r
            c.history_a.x.array[:] = gamma * h_r + h_v
        if self.buoy:
            gamma, h_y = self.scheme.rule(step, self.series["y"])
            self.buoy.gamma.value = gamma
            self.buoy.history.x.array[:] = h_y
        self.system.set_scales(gamma)

    def _rates(self):
        """Rates of r, v and y at the end of the step that was just solved."""
        u, rates = self.system.u, {}
        if self.cable:
            r, c = u[self.problem.cable_part.slice], self.cable
            rates["r"] = c.gamma_v.value * r + c.history_v.x.array
            rates["v"] = c.gamma_a.value * r + c.history_a.x.array
        if self.buoy:
            rates["y"] = self.buoy.gamma.value * u[self.problem.state_part.slice] + self.buoy.history.x.array
        return rates

    def step(self, h):
        """One step of size h [s]; returns Newton's iterations.  Raises SolveError and leaves the state as it was."""
        before = self.system.u.copy()
        t = self.t + h
        self._prepare(h)
        self.system.u[:] = self.predictor.at(t)
        self.problem.set_time(t)
        try:
            iterations = self.system.solve()
        except SolveError:
            self.system.u[:] = before
            raise
        self._accept(t, self._rates())
        return iterations

    def _accept(self, t, rates):
        u, keep = self.system.u, self.scheme.keep
        self.end_tension = self.problem.end_tension(fresh=False) if self.cable else None
        if self.cable:
            r = u[self.problem.cable_part.slice]
            self.series["r"].push(r, rates["r"], keep)
            self.series["v"].push(rates["r"], rates["v"], keep)
        if self.buoy:
            y = u[self.problem.state_part.slice]
            length = np.linalg.norm(y[6:10])
            self.quaternion_drift = max(self.quaternion_drift, abs(length - 1))
            y[6:10] /= length
            self.series["y"].push(y, rates["y"], keep)
        self.predictor.add(t, u)
        self.t = t

    def advance(self, target, nominal):
        """To the time `target` in steps of at most `nominal`; yields (step, iterations) after each.

        A step that fails is halved, and doubled again after each success.
        """
        h = nominal
        while target - self.t > 1e-9 * nominal:
            remaining = target - self.t
            h = min(h, remaining)
            if remaining - h < 1e-6 * nominal:
                h = remaining
            try:
                iterations = self.step(h)
            except SolveError as error:
                self.failed_steps += 1
                if h <= nominal * 2.0**-MAX_HALVINGS:
                    raise SolveError(f"At t = {self.t:.6g} s, step {h:.3g} s: {error}.") from None
                h /= 2
                continue
            self.iterations += iterations
            yield h, iterations
            h = min(2 * h, nominal)

    def run(self):
        """Steps to the end of the scene; yields (step, iterations) after each."""
        end, nominal = self.scene.time.end, self.scene.time.step
        count = int(np.ceil(end / nominal - 1e-9))
        for k in range(1, count + 1):
            yield from self.advance(min(k * nominal, end), nominal)
