"""Forces of small waves about the equilibrium, per metre of amplitude: the slope of the residual in the amplitude."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.sections import Scene
from ..scene.sentences import made
from ..scene.waves import Waves
from .linearisation import Linearisation, free_rows, without_rates

#: Amplitude [m] of the waves whose forces are taken for linear: what drag adds, and what rounding does, are below 1e-5.
SMALL = 1e-5
#: Periods of waves that may be requested lie between these [s].
SHORTEST, LONGEST = 0.01, 10_000.0


def check_periods(name: str, periods: NDArray[Any] | list[float]) -> None:
    """Refuse periods of no waves.  Raises InputError that names where they are from."""
    for period in periods:
        if not SHORTEST <= period <= LONGEST:
            raise InputError(f"{name} {period:g}: must be from {SHORTEST:g} to {LONGEST:g} s.")


def small_waves(scene: Scene, period: float, direction_deg: float = 0.0, amplitude: float = 0.0) -> Waves:
    """A regular section [waves]; its stretching, which does not count in small waves, as in the scene: the same forms
    serve.  Periods are seen from where the scene's are."""
    same = {name: getattr(scene.waves, name) for name in ("stretching", "period_seen_from")} if scene.waves else {}
    waves: Waves = made(Waves, amplitude=amplitude, period=period, direction_deg=direction_deg, **same)
    return waves


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
