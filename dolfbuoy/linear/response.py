"""Response to small waves: (K - i omega E - omega^2 M) X = -F about the equilibrium, per metre of amplitude.

All amplitudes are complex: eta = Re[exp(i (k x - omega t))] with x along the wave from the place of C at rest, and a
motion is Re[X exp(-i omega t)].  F is the slope of the residual in the amplitude, at two phases a quarter period apart.
Drag counts where a mean current gives it a slope; in still water |v| v has none.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..elsewhere import MPI
from ..errors import InputError
from ..model.sea import heading, wavenumber
from ..scene.sections import Scene
from ..scene.sentences import made
from ..scene.waves import Waves
from .linearisation import Linearisation, free_rows, linearise, without_rates
from .motions import Motions, motions

#: Amplitude [m] of the waves whose forces are taken for linear: what drag adds, and what rounding does, are below 1e-5.
SMALL = 1e-5
#: Periods of waves that may be requested lie between these [s].
SHORTEST, LONGEST = 0.01, 10_000.0


def check_periods(name: str, periods: NDArray[Any] | list[float]) -> None:
    """Refuse periods of no waves.  Raises InputError that names where they are from."""
    for period in periods:
        if not SHORTEST <= period <= LONGEST:
            raise InputError(f"{name} {period:g}: must be from {SHORTEST:g} to {LONGEST:g} s.")


@dataclass(frozen=True)
class Response:
    """Response of a buoy to waves of one period [s] and direction, per metre of amplitude [m/m, rad/m], complex."""

    period: float
    direction_deg: float
    wavenumber: float
    motions: Motions

    @property
    def pitch_over_slope(self) -> complex:
        """pitch over d(eta)/dx at C: -1 where the buoy follows the slope (about the axis to the left of the wave)."""
        return self.motions.pitch / (1j * self.wavenumber)


def responses(scene: Scene, periods: NDArray[Any] | list[float], *directions_deg: Any) -> list[Response]:
    """Response of the scene's buoy to small waves of these periods [s], in each of some directions (default: along x).

    Wavelengths follow from dispersion.  Raises InputError for a scene without buoy, water or gravity, SolveError if the
    equilibrium is not found.
    """
    if scene.buoy is None or scene.sea is None or not scene.gravity:
        raise InputError("The response to waves is that of a buoy in water: it needs [buoy], [sea] and gravity.")
    found = linearise(scene, MPI.COMM_SELF, small_waves(scene, periods[0]))
    try:
        return [response(found, period, direction) for direction in directions_deg or (0.0,) for period in periods]
    finally:
        found.destroy()


def small_waves(scene: Scene, period: float, direction_deg: float = 0.0, amplitude: float = 0.0) -> Waves:
    """A regular section [waves]; its stretching, which does not count in small waves, as in the scene: the same forms
    serve.  Periods are seen from where the scene's are."""
    same = {name: getattr(scene.waves, name) for name in ("stretching", "period_seen_from")} if scene.waves else {}
    waves: Waves = made(Waves, amplitude=amplitude, period=period, direction_deg=direction_deg, **same)
    return waves


def response(found: Linearisation, period: float, direction_deg: float = 0.0) -> Response:
    """Response of a buoy whose scene was linearised with `small_waves`."""
    problem: Any = found.problem
    buoy = problem.buoy
    problem.change(problem.scene.model_copy(update={"waves": small_waves(problem.scene, period, direction_deg)}))
    omega, k = 2 * math.pi / period, wavenumber(problem.scene)
    at_rest = buoy.fields.of(found.u[buoy.part.slice])
    crest = -k * float(heading(direction_deg) @ at_rest.position)  # phase with which it is above C at t = 0
    F = force(found, crest) + 1j * force(found, crest - math.pi / 2)
    A = found.K - 1j * omega * found.E - omega**2 * found.M
    X = np.zeros(problem.system.size, dtype=complex)
    X[problem.system.order] = splu(A.tocsc()).solve(-F)
    moved = motions(at_rest, buoy.fields.of(X[buoy.part.slice]), direction_deg)
    return Response(period, direction_deg, k, moved)


def force(found: Linearisation, time_phase: float) -> NDArray[Any]:
    """Residual of the free unknowns in a small wave at a phase (phase - omega t), over its amplitude [physical / m].

    With its sign turned, in the rows of the buoy's momenta: what an undisturbed wave does to the buoy at rest.
    """
    return free_rows(found.problem, slope(found, time_phase))


def slope(found: Linearisation, time_phase: float) -> NDArray[Any]:
    """`force`, of all local unknowns."""
    system: Any = found.problem.system
    without_rates(found.problem)
    system.u[:] = found.u
    system.publish()
    sides = []
    for amplitude in (SMALL, -SMALL):
        for model in found.problem.models:
            model.sea.set_wave(amplitude, time_phase)
        sides.append(system.evaluate().copy())
    return np.asarray((sides[0] - sides[1]) / (2 * SMALL))
