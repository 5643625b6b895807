"""Natural periods of moored buoys, from the mode with most heave, most surge and so on, and of lines."""

import math
from collections.abc import Iterator
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, splu

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..model.problem import Problem
from ..scene.sections import Scene
from ..solver.quadratic import FEW
from .linearisation import Linearisation, linearise
from .moving import Moving
from .natural import Mode, lowest_modes, mode_of
from .radiated import Radiated

#: Angular frequencies near which modes are computed [rad/s]: periods of about 50 s to 0.4 s.
FREQUENCIES = 2 * math.pi / np.geomspace(50.0, 0.4, 8)

#: Range of periods of a buoy [s]: longer ones have no stiffness except rounding, shorter ones are due to a constraint.
SHORTEST, LONGEST = 0.01, 1000.0

#: Least share of a mode's kinetic energy in a motion for it to be a mode of that motion.
LEAST_SHARE = 0.1
#: Share without radiation memory below which the share with it stays below LEAST_SHARE.
LOST = 0.01
#: Number of slow modes of lines whose periods are shown.
SLOWEST = 4


class NaturalPeriod(NamedTuple):
    """2 pi/|lambda| [s], -Re(lambda)/|lambda|, and the share of kinetic energy in the named motion."""

    period: float
    damping_ratio: float
    share: float


def buoy_periods(scene: Scene, direction_deg: float = 0.0) -> dict[str, NaturalPeriod]:
    """Natural periods of the scene's buoys: "surge", "sway", "heave", "roll", "pitch", "yaw" -> NaturalPeriod.

    With several buoys the names include the buoy's, "left surge".  The periods are those of small motions about the
    equilibrium in current, wind and external force, moored as in the scene (a buoy without cable: in still water), with
    all added mass.  A motion without stiffness, or without a mode of its own, is absent, as is pitch if the buoy would
    capsize.  direction_deg: direction of surge, from x.  Raises InputError for a scene without buoy, water or gravity,
    SolveError if the equilibrium is not found.
    """
    _check_floating(scene)
    found = linearise(scene, MPI.COMM_SELF, scene.waves)  # with the forms that a run will need
    try:
        return natural_periods(found, direction_deg)
    finally:
        found.destroy()


def moored_periods(scene: Scene, rest: Problem | None = None) -> dict[str, float]:
    """Periods [s] of buoys as in `buoy_periods`, and of the slowest modes of lines, "cable in plane 1"; one rank."""
    _check_floating(scene)
    found = linearise(scene, MPI.COMM_SELF, scene.waves, rest)
    try:
        ending = "buoy, {}" if len(found.bodies) == 1 else "{}"
        of_buoys = {ending.format(name): mode.period for name, mode in natural_periods(found).items()}
        return _of_lines(found) | of_buoys
    finally:
        found.destroy()


def _check_floating(scene: Scene) -> None:
    if not scene.buoys or scene.sea is None or not scene.gravity:
        raise InputError("Natural periods are those of a floating buoy: they need [buoy], [sea] and gravity.")


def natural_periods(found: Linearisation, direction_deg: float = 0.0) -> dict[str, NaturalPeriod]:
    """`buoy_periods` of a linearised scene, on one rank."""
    best = _of_motions(found, Moving(found, direction_deg))
    return {n: NaturalPeriod(2 * math.pi / abs(r), -r.real / abs(r), share) for n, (share, r, _) in best.items()}


def modes_of_buoys(found: Linearisation, direction_deg: float = 0.0) -> list[Mode]:
    """The modes of `natural_periods`, the slowest first: available even if a line is slack."""
    moving = Moving(found, direction_deg)
    best = {root: (root, vector) for _, root, vector in _of_motions(found, moving).values()}
    modes = [mode_of(moving, root, vector, _residual(found, root, vector)) for root, vector in best.values()]
    return sorted(modes, key=lambda mode: mode.omega)


def _residual(found: Linearisation, root: complex, vector: NDArray[Any]) -> float:
    """Backward error of an eigenpair, in the scales of the system."""
    system = found.problem.system
    terms = [diags(system.row_scales) @ A @ diags(system.unknown_scales) for A in (found.K, found.E, found.M)]
    x, powers = vector / system.unknown_scales, (1.0, root, root**2)
    left = sum(power * (A @ x) for power, A in zip(powers, terms, strict=True))
    size = sum(abs(power) * float(abs(A).sum(axis=1).max()) for power, A in zip(powers, terms, strict=True))
    return float(np.abs(left).max() / (size * np.abs(x).max()))


def _of_motions(found: Linearisation, moving: Moving) -> dict[str, tuple[float, complex, NDArray[Any]]]:
    """Share, root and vector of the mode with the largest share of each motion of a buoy, if large enough."""
    best: dict[str, tuple[float, complex, NDArray[Any]]] = {}
    names = [name for body in found.bodies for name in moving.names_of(body)]
    radiated = Radiated(found)
    for root, vector in _oscillations(found, radiated.there):
        shares = moving.shares(vector)
        if radiated.there:
            if max(shares[name] for name in names) < LOST:
                continue
            root, vector, _ = radiated.followed(root, vector)
            shares = moving.shares(vector)
        for name in names:
            if shares[name] > max(LEAST_SHARE, best[name][0] if name in best else 0.0):
                best[name] = shares[name], root, vector
    return {name: best[name] for name in names if name in best}


def _oscillations(found: Linearisation, once: bool) -> Iterator[tuple[complex, NDArray[Any]]]:
    """(lambda, vector) with Im(lambda) > 0 of all modes near the FREQUENCIES; without `once` some are repeated.

    Near some of these ARPACK may find none, if hundreds of similar lines have hundreds of similar modes.
    """
    known = list[complex]()
    small = 2 * len(found.problem.system.order) <= DENSE  # all are computed at once
    for omega in [1.0] if small else FREQUENCIES:
        try:
            modes = modes_near(found, 1j * omega)
        except SolveError:
            continue
        for root, vector in zip(*(x.T for x in modes), strict=True):
            twice = any(abs(root - other) < 1e-6 * abs(root) for other in known) if once else False
            if 2 * math.pi / LONGEST < root.imag < 2 * math.pi / SHORTEST and not twice:
                known.append(root)
                yield root, vector


def _of_lines(found: Linearisation) -> dict[str, float]:
    """Periods of slow modes dominated by a line, by name; empty if lines are slack."""
    try:
        modes = lowest_modes(found, SLOWEST + 6 * len(found.bodies), restarts=FEW) if found.lines else []
    except (InputError, SolveError):
        return {}
    moving = Moving(found)
    of_buoys = {name for body in found.bodies for name in moving.names_of(body)}
    own = [m for m in modes if m.kind == "oscillates" and max(m.shares.items(), key=itemgetter(1))[0] not in of_buoys]
    periods: dict[str, float] = {}
    for mode in own[:SLOWEST]:
        periods.setdefault(mode.name, mode.period)  # the slowest of each name
    return periods


#: Size of the standard problem up to which all its eigenvalues are computed.
DENSE = 500
#: Limit of restarts of ARPACK, which needs a few tens at most if it converges.
RESTARTS = 60


def modes_near(found: Linearisation, shift: complex, count: int = 20) -> tuple[NDArray[Any], NDArray[Any]]:
    """Eigenvalues closest to a shift, nearest first, and their physical vectors (unknowns of `system.order`, modes).

    At least `count` of them if there are as many; vectors have unit 2-norm in the system's scales.
    """
    system, n = found.problem.system, len(found.problem.system.order)
    scales = diags(system.unknown_scales)
    K, E, M = (diags(system.row_scales) @ matrix @ scales for matrix in (found.K, found.E, found.M))
    try:
        solve = splu((K + shift * E + shift**2 * M).astype(complex).tocsc()).solve
    except RuntimeError:
        raise SolveError(f"no modes next to {shift:.3g}/s: the linearised equations are singular there") from None

    def invert(v: NDArray[Any]) -> NDArray[Any]:
        """(C - shift B)^-1 B v of the companion form in (x, lambda x)."""
        x, y = v[:n], v[n:]
        first = -solve(E @ x + shift * (M @ x) + M @ y)
        return np.concatenate([first, x + shift * first])

    if 2 * n <= DENSE:
        mu, vectors = np.linalg.eig(invert(np.eye(2 * n, dtype=complex)))
    else:
        operator = LinearOperator((2 * n, 2 * n), invert, dtype=complex)
        start = np.random.default_rng(0).standard_normal(2 * n).astype(complex)
        try:
            mu, vectors = eigs(operator, k=min(count, 2 * n - 2), which="LM", v0=start, tol=1e-10, maxiter=RESTARTS)
        except ArpackError as error:
            mu, vectors = getattr(error, "eigenvalues", []), getattr(error, "eigenvectors", None)
            if not len(mu):
                raise SolveError(f"no modes next to {shift:.3g}/s: ARPACK finds none in {RESTARTS} restarts") from None
    order = [k for k in np.argsort(-np.abs(mu)) if abs(mu[k]) > 1e-12 * np.abs(mu).max()]
    x = vectors[:n, order]
    x = x / np.linalg.norm(x, axis=0)
    return shift + 1 / mu[order], scales @ x
