"""Response to waves of a given height and to irregular seas with linearised drag: motions of buoys, tensions of lines.

Everything is linear except the drag, whose linearisation depends on the response (`drag`) and is found by iteration.
(K - i omega E - omega^2 M) X = -F about the equilibrium.  Amplitudes are complex: eta = Re[exp(i (k x - omega t))],
x along the waves from C of the first buoy, or from the top of the first line, and a motion is Re[X exp(-i omega t)].  F
is the derivative of the residual with respect to the amplitude, at two phases a quarter period apart.  In small waves
there is drag damping only in a mean current; in still water |v| v has zero derivative.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..model.airy import AirySum, components_of
from ..model.sea import heading, main_propagation
from ..scene.sections import Scene
from ..scene.waves import Waves
from .drag import LinearDrag, Sea, Velocities
from .linearisation import Equilibrated, WithReactions, linearise
from .moving import Motions, axes_along
from .radiated import Radiated
from .spectrum import slope, small_waves

#: Relative change of the response at which the iteration ends, and the largest number of iterations.
SETTLED, MOST = 1e-3, 60
#: Ratio of successive changes above which convergence is slow.
SLOW = 0.5


@dataclass
class Wave:
    """A wave of one frequency and direction: omega at a fixed point [rad/s], k and direction as a vector [1/m].

    F: derivative of the residual, and water: velocities, both per metre of amplitude.
    """

    omega: float
    k: NDArray[Any]
    F: NDArray[Any]
    water: Sea


class Seaway:
    """A scene in waves, linearised about its equilibrium, on this rank only.

    direction_deg: direction of regular waves and of surge.  X are amplitudes of all unknowns and of the end forces of
    `reactions.WithReactions`.
    """

    def __init__(self, scene: Scene, direction_deg: float = 0.0):
        if scene.sea is None or not scene.gravity:
            raise InputError("The response to waves needs [sea] and gravity.")
        self.scene, self.direction_deg = scene, direction_deg
        self.found = linearise(scene, MPI.COMM_SELF, small_waves(scene, 10.0))
        bodies, lines = self.found.bodies, self.found.lines
        self.crest = bodies[0].position if bodies else lines[0].positions[-1]
        self.equations = WithReactions(self.found)
        self.velocities = Velocities(self.found)
        self.drag, self.radiated = LinearDrag(self.velocities, self.equations), Radiated(self.found)
        self._scales: dict[tuple[str, int], tuple[float, NDArray[Any]]] = {}

    def destroy(self) -> None:
        """Free PETSc objects."""
        self.found.destroy()

    # -- waves -------------------------------------------------------------------------------------------------------

    def wave(self, omega: float, direction_deg: float | None = None, wavelength: None = None) -> Wave:
        """The wave of one frequency, as in `waves.period`, and one direction (None: the default).

        wavelength: to override the dispersion relation [m].
        """
        problem, turned = self.found.problem, self.direction_deg if direction_deg is None else direction_deg
        waves = small_waves(problem.scene, 2 * math.pi / omega, turned).model_copy(update={"wavelength": wavelength})
        problem.change(problem.scene.model_copy(update={"waves": waves}))
        runs = main_propagation(problem.scene)
        k = runs.wavenumber * heading(turned)
        phase = -float(k @ self.crest)
        F = self.equations.of_residual(slope(self.found, phase) + 1j * slope(self.found, phase - math.pi / 2))
        for model in problem.models:
            model.sea.set_wave(0.0, 0.0)
        unit = {"amplitude": 1.0, "phase_deg": math.degrees(phase), "ramp": 0.0, "stretching": "vertical"}
        water = AirySum.of(problem.scene.model_copy(update={"waves": waves.model_copy(update=unit)}))
        quarter = math.pi / 2 / runs.at_ground
        return Wave(runs.at_ground, k, F, self.velocities.of_water(lambda x: _complex(water, x, quarter)))

    def solve(self, *waves: Wave) -> NDArray[Any]:
        """X per metre (unknowns and reactions, waves) at one frequency, with the present linearised drag."""
        (K, E), M, omega, n = self.drag.matrices(), self.equations.M, waves[0].omega, self.equations.size
        F = np.column_stack([wave.F + self.drag.force(wave.water) for wave in waves])
        A = K - 1j * omega * E - omega**2 * M
        own = A[:n] + self.radiated.at_frequency(omega) if self.radiated.there else A[:n]
        x = Equilibrated(own)(-F[:n])
        return np.vstack([x, A[n:] @ x + F[n:]])

    def regular(self, wave: Wave, amplitude: float = 0.0) -> NDArray[Any]:
        """X per metre in regular waves of an amplitude [m]; 0: small.  Starts from the present drag.

        Raises SolveError if the drag does not converge.
        """
        if not amplitude:
            self.drag.forget()
            return self.solve(wave)[:, 0]

        def average(X: NDArray[Any], share: float) -> None:
            self.drag.in_cycle(self.velocities.relative(X[:, 0], wave.omega, wave.water), amplitude, share)

        words = f"waves of {2 * math.pi / wave.omega:.4g} s"
        return self._settled(average, lambda: self.solve(wave), np.ones(1), words)[:, 0]

    def irregular(self, waves: list[Wave], energies: NDArray[Any]) -> NDArray[Any]:
        """X per metre (unknowns and reactions, waves) in a Gaussian sea with S dw = energies [m^2] of the waves.

        Raises SolveError if the drag does not converge.
        """
        energies = np.asarray(energies)
        self.drag.forget()

        def average(X: NDArray[Any], share: float) -> None:
            moving = [self.velocities.relative(x, w.omega, w.water) for x, w in zip(X.T, waves, strict=True)]
            self.drag.in_sea(moving, energies, share)

        return self._settled(average, lambda: self.all_of(waves), energies, "this sea")

    def _settled(
        self, average: Callable[..., Any], solve: Callable[..., Any], energies: NDArray[Any], words: str
    ) -> NDArray[Any]:
        """X, computed alternately with the drag, whose updates are halved if full ones oscillate."""
        X: NDArray[Any] = solve()
        last, share = np.inf, 1.0
        for _ in range(MOST):
            average(X, share)
            before, X = X, solve()
            change = self._change(before, X, energies)
            if change < SETTLED:
                return X
            last, share = change, 0.5 if change > SLOW * last else share
        raise SolveError(f"the drag in {words} did not settle in {MOST} iterations")

    def over_time(self, waves: Waves, times: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """`named` at times [s] in the components of an irregular sea, a section [waves], drag linearised for them."""
        sea = components_of(waves)
        parts = [self.wave(*pair) for pair in zip(sea.frequency, sea.direction_deg, strict=True)]
        found = self.named(self.irregular(parts, sea.amplitude**2 / 2))
        phase = sea.phase + np.array([part.k for part in parts]) @ self.crest
        amplitudes = np.array(list(found.values())) * sea.amplitude * np.exp(1j * phase)
        omega, many = np.array([part.omega for part in parts]), max(1, len(times) * len(parts) // 2_000_000)
        rows = [(amplitudes @ np.exp(-1j * np.outer(omega, some))).real for some in np.array_split(times, many)]
        return dict(zip(found, np.concatenate(rows, axis=1), strict=True))

    def all_of(self, waves: list[Wave]) -> NDArray[Any]:
        """`solve` for waves of several frequencies, in their order."""
        same, X = dict[float, list[int]](), np.zeros((self.equations.rows, len(waves)), dtype=complex)
        for i, wave in enumerate(waves):
            same.setdefault(wave.omega, []).append(i)
        for chosen in same.values():
            X[:, chosen] = self.solve(*(waves[i] for i in chosen))
        return X

    def _change(self, before: NDArray[Any], X: NDArray[Any], energies: NDArray[Any]) -> float:
        """Largest relative change of the standard deviations of motions and tensions."""
        moving = [
            np.concatenate([*(body.motion(x) for body in self.found.bodies), self.tensions(x)]) for x in (before, X)
        ]
        old, new = (np.sqrt(np.abs(x) ** 2 @ energies) for x in moving)
        return float((np.abs(new - old) / np.maximum(new, 1e-3 * new.max())).max(initial=0.0))

    # -- results -----------------------------------------------------------------------------------------------------

    def motions(self, X: NDArray[Any]) -> list[Motions]:
        """Motions of every buoy along and across the direction, from columns of all unknowns."""
        axes = axes_along(self.direction_deg)
        moved = [body.motion(X) for body in self.found.bodies]
        return [Motions(*(axes @ motion[:3]), *(axes @ motion[3:])) for motion in moved]

    def named(self, X: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Name -> amplitudes (waves,) of each motion [m, rad], with its buoy if there are several, and each tension."""
        names, found = [body.name for body in self.found.bodies], dict[str, NDArray[Any]]()
        for body, moved in zip(names, self.motions(X), strict=True):
            ending = f" of {body}" if len(names) > 1 else ""
            found |= {f"{name}{ending}": values for name, values in moved._asdict().items()}
        lines = self.found.lines
        tensions = (f"{what}_{lines[k].name}" if len(lines) > 1 else what for what, k in self.tension_slopes())
        return found | dict(zip(tensions, self.tensions(X), strict=True))

    def tensions(self, X: NDArray[Any]) -> NDArray[Any]:
        """Amplitudes (tensions, waves) of the tensions of `tension_slopes` [N]."""
        slopes = [slope for _, slope in self.tension_slopes().values()]
        return np.asarray(np.reshape(slopes, (-1, self.equations.rows)) @ X)

    def tension_slopes(self) -> dict[tuple[str, int], tuple[float, NDArray[Any]]]:
        """(name, line) -> tension at rest [N] and its derivative in X: at the top of each line if not free, and anchor.

        As in a record: the magnitude of the force that holds the upper end, and T_h(0).
        """
        if not self._scales:
            self._scales = self._tops() | self._anchors()
        return self._scales

    def _tops(self) -> dict[tuple[str, int], tuple[float, NDArray[Any]]]:
        slopes, forces = {}, dict(self.equations.ends)
        forces |= {hold.cable: (hold.force, hold.force_places) for hold in self.found.holds if hold.is_top}
        for k, (force, places) in sorted(forces.items()):
            size, row = float(np.linalg.norm(force)), np.zeros(self.equations.rows)
            row[places] = force / (size or 1.0)
            slopes["tension_top", k] = size, row
        return slopes

    def _anchors(self) -> dict[tuple[str, int], tuple[float, NDArray[Any]]]:
        problem, slopes = self.found.problem, {}
        lines: Any = problem.lines
        for k in range(len(self.found.lines)):
            piece, row = problem.network.first_of(k), np.zeros(self.equations.rows)
            slope_in = _slope(problem, lambda u, piece=piece: lines.anchor_tension(u, piece))
            row[: self.equations.size] = slope_in
            slopes["tension_anchor", k] = lines.anchor_tension(self.found.u, piece), row
        return slopes


class Response(NamedTuple):
    """Response of a buoy to small waves of one period [s], per metre of amplitude [m/m, rad/m], complex."""

    period: float
    wavenumber: float
    motions: Motions

    @property
    def pitch_over_slope(self) -> complex:
        """Pitch over d(eta)/dx at C: -1 if the buoy follows the slope (about the axis to the left of the wave)."""
        return self.motions.pitch / (1j * self.wavenumber)


def responses(scene: Scene, periods: Iterable[float], direction_deg: float = 0.0) -> list[Response]:
    """Response of the scene's first buoy to small waves of these periods [s], in one direction.

    Raises InputError for a scene without buoy, water or gravity, SolveError if the equilibrium is not found.
    """
    if not scene.buoys:
        raise InputError("The response to waves is that of a buoy in water: it needs [buoy], [sea] and gravity.")
    seaway = Seaway(scene, direction_deg)
    try:
        waves = [(float(T), seaway.wave(2 * math.pi / T)) for T in periods]
        moved = [seaway.motions(seaway.regular(wave))[0] for _, wave in waves]
        return [Response(T, float(np.linalg.norm(w.k)), own) for (T, w), own in zip(waves, moved, strict=True)]
    finally:
        seaway.destroy()


def _complex(water: AirySum, x: NDArray[Any], quarter: float) -> Any:
    """V of the velocity Re[V exp(-i omega t)], from t = 0 and a quarter period later."""
    return water.flow(0.0, x)[0] + 1j * water.flow(quarter, x)[0]


def _slope(problem: Any, function: Callable[..., Any]) -> NDArray[Any]:
    """Gradient of a linear function of the local force unknowns, in all unknowns."""
    unit, row = np.zeros(problem.system.size), np.zeros(problem.system.unknowns)
    places = np.flatnonzero(np.isin(problem.system.order, problem.lines.force_dofs()))
    for place in places:
        unit[problem.system.order[place]] = 1.0
        row[place] = function(unit)
        unit[:] = 0.0
    return row
