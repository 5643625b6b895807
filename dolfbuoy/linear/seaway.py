"""Response to waves of a given height and to irregular seas, drag linearised: motions of buoys, tensions of lines.

Everything is linear but for the drag, whose slope goes with the response itself (`drag`): found by iteration.
Amplitudes are complex as in `response`: eta = Re[exp(i (k x - omega t))], x along the waves from C of the first buoy,
or from the top of the first line.
"""

import math
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import splu

from ..errors import InputError, SolveError
from ..model.airy import AirySum
from ..model.sea import heading, main_propagation
from .drag import LinearDrag, Sea, Velocities
from .layout import Hold
from .linearisation import linearise
from .motions import Motions, axes_along
from .response import force, small_waves

#: Relative change of the response at which the iteration ends, and the most iterations.
SETTLED, MOST = 1e-3, 60


@dataclass
class Wave:
    """Of one frequency: omega at a fixed point [rad/s], slope F of the residual, the water's velocities; per metre."""

    omega: float
    F: np.ndarray
    water: Sea


class Seaway:
    """A scene linearised about its rest in waves of one direction [deg], on this rank alone."""

    def __init__(self, scene, direction_deg=0.0):
        if scene.sea is None or not scene.gravity:
            raise InputError("The response to waves needs [sea] and gravity.")
        self.scene, self.direction_deg = scene, direction_deg
        self.found = linearise(scene, MPI.COMM_SELF, small_waves(scene, 10.0))
        bodies, lines = self.found.bodies, self.found.lines
        self.crest = bodies[0].position if bodies else lines[0].positions[-1]
        self.velocities = Velocities(self.found)
        self.drag = LinearDrag(self.velocities)
        self._scales = None

    def destroy(self):
        """Give PETSc's objects back."""
        self.found.destroy()

    # -- waves -------------------------------------------------------------------------------------------------------

    def wave(self, omega) -> Wave:
        """What there is to know of one frequency of `waves.period`."""
        problem = self.found.problem
        waves = small_waves(problem.scene, 2 * math.pi / omega, self.direction_deg)
        problem.change(problem.scene.model_copy(update={"waves": waves}))
        runs = main_propagation(problem.scene)
        phase = -runs.wavenumber * float(heading(self.direction_deg) @ self.crest)
        F = force(self.found, phase) + 1j * force(self.found, phase - math.pi / 2)
        for model in problem.models:
            model.sea.set_wave(0.0, 0.0)
        unit = {"amplitude": 1.0, "phase_deg": math.degrees(phase), "ramp": 0.0, "stretching": "vertical"}
        water = AirySum.of(problem.scene.model_copy(update={"waves": waves.model_copy(update=unit)}))
        quarter = math.pi / 2 / runs.at_ground
        return Wave(runs.at_ground, F, self.velocities.of_water(lambda x: _complex(water, x, quarter)))

    def solve(self, wave: Wave) -> np.ndarray:
        """X per metre, with the drag as it is at the moment."""
        K, E = self.drag.matrices()
        A = K - 1j * wave.omega * E - wave.omega**2 * self.found.M
        rows = 1 / np.maximum(abs(A).max(axis=1).toarray().ravel(), 1e-300)
        A = diags(rows) @ A
        columns = 1 / np.maximum(abs(A).max(axis=0).toarray().ravel(), 1e-300)
        x = splu(csc_matrix(A @ diags(columns))).solve(-rows * (wave.F + self.drag.force(wave.water)))
        return columns * x

    def regular(self, wave: Wave, amplitude=0.0) -> np.ndarray:
        """X per metre in regular waves of an amplitude [m]; 0: small.  Begins with the drag at hand.

        Raises SolveError if the drag does not settle.
        """
        if not amplitude:
            self.drag.forget()
            return self.solve(wave)
        X = self.solve(wave)
        for _ in range(MOST):
            self.drag.in_cycle(self.velocities.relative(X, wave.omega, wave.water), amplitude)
            before, X = X, self.solve(wave)
            if self._change(before[:, None], X[:, None], np.ones(1)) < SETTLED:
                return X
        raise SolveError(f"the drag in waves of {2 * math.pi / wave.omega:.4g} s did not settle in {MOST} iterations")

    def irregular(self, waves: list[Wave], energies) -> np.ndarray:
        """X per metre (unknowns, frequencies) in a Gaussian sea with S dw = energies [m^2] at the frequencies.

        Raises SolveError if the drag does not settle.
        """
        energies = np.asarray(energies)
        X = self._all(waves)
        for _ in range(MOST):
            moving = [self.velocities.relative(x, w.omega, w.water) for x, w in zip(X.T, waves, strict=True)]
            self.drag.in_sea(moving, energies)
            before, X = X, self._all(waves)
            if self._change(before, X, energies) < SETTLED:
                return X
        raise SolveError(f"the drag in this sea did not settle in {MOST} iterations")

    def _all(self, waves):
        return np.array([self.solve(wave) for wave in waves]).T

    def _change(self, before, X, energies):
        """Largest relative change of the standard deviations of what moves."""
        old, new = (np.sqrt((np.abs(self._moving(x)) ** 2) @ energies) for x in (before, X))
        return float((np.abs(new - old) / np.maximum(new, 1e-3 * new.max())).max(initial=0.0))

    def _moving(self, X):
        return np.concatenate([*(body.motion(X) for body in self.found.bodies), *self.tensions(X).values()])

    # -- what is read ------------------------------------------------------------------------------------------------

    def motions(self, X) -> list[Motions]:
        """Of every buoy along and across the direction, of columns of all unknowns."""
        axes = axes_along(self.direction_deg)
        moved = [body.motion(X) for body in self.found.bodies]
        return [Motions(*(axes @ motion[:3]), *(axes @ motion[3:])) for motion in moved]

    def tensions(self, X) -> dict[str, np.ndarray]:
        """Changes (1, frequencies) of the tension [N]: on top of every line that holds a buoy, and at every anchor."""
        return {name: (values @ X)[None] for name, (_, values) in self.tension_slopes().items()}

    def tension_slopes(self) -> dict[str, tuple[float, np.ndarray]]:
        """Name -> tension at rest [N] and its slope in all unknowns."""
        if self._scales is None:
            self._scales = self._find_slopes()
        return self._scales

    def _find_slopes(self):
        found, slopes = self.found, {}
        problem, lines = found.problem, found.problem.lines
        several = len(found.lines) > 1
        for i, hold in enumerate(found.holds):
            slopes[f"tension_top_{i + 1}" if several else "tension_top"] = _of_hold(hold, found.K.shape[1])
        for k, line in enumerate(found.lines):
            name = f"tension_anchor_{line.name}" if several else "tension_anchor"
            slope = _slope(problem, lambda u, k=k: lines.anchor_tension(u, k))
            slopes[name] = (lines.anchor_tension(found.u, k), slope)
        return slopes


def _complex(water, x, quarter):
    """V of the velocity Re[V exp(-i omega t)]: now, and a quarter period later."""
    return water.flow(0.0, x)[0] + 1j * water.flow(quarter, x)[0]


def _slope(problem, function):
    """Of a linear function of the local unknowns, in all unknowns."""
    unit, row = np.zeros(problem.system.size), np.zeros(problem.system.unknowns)
    places = np.flatnonzero(np.isin(problem.system.order, problem.lines.force_dofs()))
    for place in places:
        unit[problem.system.order[place]] = 1.0
        row[place] = function(unit)
        unit[:] = 0.0
    return row


def _of_hold(hold: Hold, size):
    force, row = np.linalg.norm(hold.force), np.zeros(size)
    row[hold.force_places] = hold.force / force
    return force, row
