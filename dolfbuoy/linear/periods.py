"""Natural periods of a buoy as its scene holds it: of the mode that moves it most in heave, in pitch, and so on."""

import math
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from .eigenvalues import DENSE, modes_near
from .linearisation import Linearisation, linearise
from .motions import Motions, axes_along, motions

#: Modes are looked for near these angular frequencies [rad/s]: periods of 50 s to 0.4 s, and what is about them.
FREQUENCIES = 2 * math.pi / np.geomspace(50.0, 0.4, 8)

#: Periods of a buoy [s]: beyond them there is no stiffness but rounding, or a constraint in the place of one.
SHORTEST, LONGEST = 0.01, 1000.0

#: A mode with less than this part of its kinetic energy in a motion is none of that motion.
LEAST_SHARE = 0.1


class NaturalPeriod(NamedTuple):
    """2 pi/|lambda| [s], -Re(lambda)/|lambda|, and the part of the kinetic energy that is in the named motion."""

    period: float
    damping_ratio: float
    share: float


def buoy_periods(scene, comm=MPI.COMM_SELF, direction_deg=0.0) -> dict[str, NaturalPeriod]:
    """Natural periods of the scene's buoy: "surge", "sway", "heave", "roll", "pitch", "yaw" -> NaturalPeriod.

    Those of small motions about the equilibrium in current, wind and external force, moored as in the scene (a buoy
    without cable: in still water), with all added mass.  A motion without stiffness, or of which no mode is made,
    is absent: so is pitch if the buoy would capsize.  direction_deg: of surge and roll, from x.
    Raises InputError for a scene without buoy, water or gravity, SolveError if the equilibrium is not found.
    """
    if scene.buoy is None or scene.sea is None or not scene.gravity:
        raise InputError("Natural periods are those of a floating buoy: they need [buoy], [sea] and gravity.")
    found = linearise(scene, comm, scene.waves)  # with the forms that a run will need
    try:
        return natural_periods(found, direction_deg)
    finally:
        found.destroy()


def natural_periods(found: Linearisation, direction_deg=0.0) -> dict[str, NaturalPeriod]:
    """`buoy_periods` of a scene that is linearised."""
    best = {}
    for root, vector in _oscillations(found):
        for name, share in _shares(found, root, vector, direction_deg)._asdict().items():
            if share > max(LEAST_SHARE, best[name].share if name in best else 0.0):
                best[name] = NaturalPeriod(2 * math.pi / abs(root), -root.real / abs(root), share)
    return {name: best[name] for name in Motions._fields if name in best}


def _oscillations(found):
    """(lambda, vector) with Im(lambda) > 0 of all modes near the FREQUENCIES; some may come twice."""
    small = 2 * len(found.problem.system.order) <= DENSE  # all come at once
    for omega in [1.0] if small else FREQUENCIES:
        for root, vector in zip(*(x.T for x in modes_near(found, 1j * omega)), strict=True):
            if 2 * math.pi / LONGEST < root.imag < 2 * math.pi / SHORTEST:
                yield root, vector


def _shares(found, root, vector, direction_deg) -> Motions:
    """Parts of a mode's kinetic energy, added mass included, in the six motions; the rest is the cable's."""
    problem, buoy = found.problem, found.problem.buoy
    state = buoy.fields.of(_local(problem, vector)[buoy.part.slice])
    inertia = _local(problem, found.E @ vector)  # effective, in the rows p_t and L_C_t
    momenta = buoy.fields.of(inertia[buoy.part.slice])
    at_rest = buoy.fields.of(found.u[buoy.part.slice])
    velocity = root * np.array(motions(at_rest, state, direction_deg))
    axes = axes_along(direction_deg)
    momentum = np.concatenate([axes @ momenta.momentum, axes @ momenta.angular_momentum])
    energies = (velocity.conj() * momentum).real
    in_lines = abs(root) ** 2 * (vector.conj() @ (found.M @ vector)).real
    return Motions(*energies / (energies.sum() + in_lines))


def _local(problem, values):
    """Values of the free unknowns, or of their rows, among those of this rank."""
    found = np.zeros(problem.system.size, dtype=complex)
    found[problem.system.order] = values
    return found
