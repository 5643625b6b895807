"""Response to waves of a given height and to irregular seas, drag linearised: motions of buoys, tensions of lines.

Everything is linear but for the drag, whose slope goes with the response itself (`drag`): found by iteration.
(K - i omega E - omega^2 M) X = -F about the equilibrium.  Amplitudes are complex: eta = Re[exp(i (k x - omega t))],
x along the waves from C of the first buoy, or from the top of the first line, and a motion is Re[X exp(-i omega t)].  F
is the slope of the residual in the amplitude, at two phases a quarter period apart.  In small waves drag counts where a
mean current gives it a slope; in still water |v| v has none.
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

#: Relative change of the response at which the iteration ends, and the most iterations.
SETTLED, MOST = 1e-3, 60
#: A change that is more than this part of the one before it is no fast convergence.
SLOW = 0.5


@dataclass
class Wave:
    """A wave of one frequency and direction: omega at a fixed point [rad/s], k and direction as a vector [1/m].

    Per metre of amplitude, the slope F of the residual and the water's velocities.
    """

    omega: float
    k: NDArray[Any]
    F: NDArray[Any]
    water: Sea


class Seaway:
    """A scene linearised about its rest in waves, on this rank alone.

    direction_deg: of regular waves, and of surge.  X are amplitudes of all unknowns and of the forces at the ends of
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
        """Give PETSc's objects back."""
        self.found.destroy()

    # -- waves -------------------------------------------------------------------------------------------------------

    def wave(self, omega: float, direction_deg: float | None = None, wavelength: None = None) -> Wave:
        """The wave of one frequency of `waves.period`, in a direction (None: that of all).

        wavelength: if it does not follow from dispersion [m].
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
        """X per metre (unknowns and reactions, waves) of one frequency, with the drag as it is at the moment."""
        (K, E), M, omega, n = self.drag.matrices(), self.equations.M, waves[0].omega, self.equations.size
        F = np.column_stack([wave.F + self.drag.force(wave.water) for wave in waves])
        A = K - 1j * omega * E - omega**2 * M
        own = A[:n] + self.radiated.at_frequency(omega) if self.radiated.there else A[:n]
        x = Equilibrated(own)(-F[:n])
        return np.vstack([x, A[n:] @ x + F[n:]])

    def regular(self, wave: Wave, amplitude: float = 0.0) -> NDArray[Any]:
        """X per metre in regular waves of an amplitude [m]; 0: small.  Begins with the drag at hand.

        Raises SolveError if the drag does not settle.
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

        Raises SolveError if the drag does not settle.
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
        """X, found in turn with the drag, which takes half a step where the whole ones go to and fro."""
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
        """`solve` of waves of several frequencies, in their order."""
        same, X = dict[float, list[int]](), np.zeros((self.equations.rows, len(waves)), dtype=complex)
        for i, wave in enumerate(waves):
            same.setdefault(wave.omega, []).append(i)
        for chosen in same.values():
            X[:, chosen] = self.solve(*(waves[i] for i in chosen))
        return X

    def _change(self, before: NDArray[Any], X: NDArray[Any], energies: NDArray[Any]) -> float:
        """Largest relative change of the standard deviations of what moves."""
        moving = [
            np.concatenate([*(body.motion(x) for body in self.found.bodies), self.tensions(x)]) for x in (before, X)
        ]
        old, new = (np.sqrt(np.abs(x) ** 2 @ energies) for x in moving)
        return float((np.abs(new - old) / np.maximum(new, 1e-3 * new.max())).max(initial=0.0))

    # -- what is read ------------------------------------------------------------------------------------------------

    def motions(self, X: NDArray[Any]) -> list[Motions]:
        """Motions of every buoy along and across the direction, of columns of all unknowns."""
        axes = axes_along(self.direction_deg)
        moved = [body.motion(X) for body in self.found.bodies]
        return [Motions(*(axes @ motion[:3]), *(axes @ motion[3:])) for motion in moved]

    def named(self, X: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Name -> changes (waves,) of each motion [m, rad], with its buoy if there are several, and of each tension."""
        names, found = [body.name for body in self.found.bodies], dict[str, NDArray[Any]]()
        for body, moved in zip(names, self.motions(X), strict=True):
            ending = f" of {body}" if len(names) > 1 else ""
            found |= {f"{name}{ending}": values for name, values in moved._asdict().items()}
        lines = self.found.lines
        tensions = (f"{what}_{lines[k].name}" if len(lines) > 1 else what for what, k in self.tension_slopes())
        return found | dict(zip(tensions, self.tensions(X), strict=True))

    def tensions(self, X: NDArray[Any]) -> NDArray[Any]:
        """Changes (tensions, waves) of the tensions of `tension_slopes` [N]."""
        slopes = [slope for _, slope in self.tension_slopes().values()]
        return np.asarray(np.reshape(slopes, (-1, self.equations.rows)) @ X)

    def tension_slopes(self) -> dict[tuple[str, int], tuple[float, NDArray[Any]]]:
        """(name, line) -> tension at rest [N] and its slope in X: on top of every line that is not free, at its anchor.

        Those of a record: the size of the force that holds the upper end, and T_h(0).
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
        """pitch over d(eta)/dx at C: -1 where the buoy follows the slope (about the axis to the left of the wave)."""
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
    """V of the velocity Re[V exp(-i omega t)]: now, and a quarter period later."""
    return water.flow(0.0, x)[0] + 1j * water.flow(quarter, x)[0]


def _slope(problem: Any, function: Callable[..., Any]) -> NDArray[Any]:
    """Slope of a linear function of the local unknowns, in all unknowns."""
    unit, row = np.zeros(problem.system.size), np.zeros(problem.system.unknowns)
    places = np.flatnonzero(np.isin(problem.system.order, problem.lines.force_dofs()))
    for place in places:
        unit[problem.system.order[place]] = 1.0
        row[place] = function(unit)
        unit[:] = 0.0
    return row
