"""Moving parts of a mode: shares of kinetic energy, including added mass, and names derived from them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.sea import heading
from .layout import Body, LineNodes
from .linearisation import Linearisation

#: Directions of line motion, in the order of `LineNodes.directions`; for a vertical line the last two are combined.
ALONG, IN_PLANE, OUT_OF_PLANE, ACROSS = "axial", "in plane", "out of plane", "transverse"
#: Least fraction of the energy for which the second motion of a mode is named.
NAMED = 0.25
#: Relative difference up to which two displacements of a mode, or two shares, are equal.
EQUAL = 1e-6
#: Least displacement that counts as a half wave, as a fraction of the largest.
LEAST_WAVE = 0.02


class Moving:
    """Energies of vectors of all unknowns; direction_deg: direction of surge and roll axis, from x."""

    def __init__(self, found: Linearisation, direction_deg: float = 0.0):
        self.bodies, self.lines = found.bodies, found.lines
        _, self.E, self.M = found.whole
        self.axes = axes_along(direction_deg)

    def sized(self, x: NDArray[Any]) -> NDArray[Any]:
        """The vector scaled so that its largest displacement (the first of equal ones) is 1 m or 1 rad, and real."""
        changes = [body.motion(x) for body in self.bodies] + [line.moved(x).ravel() for line in self.lines]
        changes = np.concatenate(changes)
        sizes = np.abs(changes)
        return np.asarray(x / changes[(sizes >= (1 - EQUAL) * sizes.max()).argmax()])

    def motions(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Displacements, and rotations times the radius of gyration [m], of all buoys (6 b, k) for column vectors."""
        arms = [np.sqrt(np.trace(body.inertia) / body.mass) for body in self.bodies]
        scales = (np.array([[1.0]] * 3 + [[arm]] * 3) for arm in arms)
        parts = [scale * body.motion(vectors) for body, scale in zip(self.bodies, scales, strict=True)]
        return np.concatenate(parts) if parts else vectors[:0]

    def at_rest(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """The columns with zero momenta."""
        vectors = vectors.copy()
        for body in self.bodies:
            vectors[[*body.at.momentum, *body.at.angular_momentum]] = 0.0
        return vectors

    def separated(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Combinations of eigenvectors of one eigenvalue, sorted from most to least in-plane motion."""
        every = slice(None)
        moved = [np.concatenate([self._displacements(x, every), self.motions(x[:, None])[:, 0]]) for x in vectors.T]
        triangle = np.linalg.qr(np.array(moved).T, mode="r")
        if np.linalg.cond(triangle) > 1e6:  # (nearly) the same motion
            return vectors
        vectors = vectors @ np.linalg.inv(triangle)  # now with orthonormal displacements
        inside = np.array([self._displacements(x, slice(2)) for x in vectors.T]).T
        return np.asarray(vectors @ np.linalg.svd(inside, full_matrices=False)[2].conj().T)

    def _displacements(self, x: NDArray[Any], ways: slice) -> NDArray[Any]:
        """Displacements of all buoys and lines in the directions (ahead or along, up or across, aside)."""
        parts = [self.axes[[0, 2, 1]][ways] @ body.motion(x)[:3] for body in self.bodies]
        for line in self.lines:
            parts += [(d * line.moved(x)).sum(axis=1) for d in line.directions(self.axes[0])[ways]]
        return np.concatenate(parts)

    def shares(self, x: NDArray[Any]) -> dict[str, float]:
        """Share of each motion in the kinetic energy; their sum is 1.

        All velocities are the displacements times lambda, so displacements are used in their place: for drifts too.
        """
        energies: dict[str, float] = {}
        for body in self.bodies:
            energies |= self._of_body(body, x)
        momenta = self.M @ x
        for line in self.lines:
            energies |= self._of_line(line, line.moved(x), line.moved(momenta))
        total = sum(energies.values())
        return {name: energy / total for name, energy in energies.items()}

    def names_of(self, body: Body) -> list[str]:
        """Names of the six motions of a buoy, with its own name if there are several."""
        prefix = f"{body.name} " if len(self.bodies) > 1 else ""
        return [f"{prefix}{name}" for name in Motions._fields]

    def _of_body(self, body: Body, x: NDArray[Any]) -> dict[str, float]:
        """Kinetic energies of a body along the axes, from its motion and effective momenta (its momentum rows of E)."""
        motion, moved = body.motion(x), np.zeros(len(x), dtype=complex)
        moved[body.places] = body.poses() @ motion
        momenta = (self.E @ moved)[[*body.at.momentum, *body.at.angular_momentum]]
        pairs = [(self.axes @ motion[part], self.axes @ momenta[part]) for part in (slice(0, 3), slice(3, 6))]
        energies = np.concatenate([(v.conj() * p).real for v, p in pairs])
        return dict(zip(self.names_of(body), energies, strict=True))

    def _of_line(self, line: LineNodes, moved: NDArray[Any], momenta: NDArray[Any]) -> dict[str, float]:
        directions = line.directions(self.axes[0])
        along = [(d * moved).sum(axis=1).conj() @ (d * momenta).sum(axis=1) for d in directions]
        axial, inside, outside = (float(energy.real) for energy in along)
        if line.heading is None:
            return {f"{line.name} {ALONG}": axial, f"{line.name} {ACROSS}": inside + outside}
        names = (f"{line.name} {way}" for way in (ALONG, IN_PLANE, OUT_OF_PLANE))
        return dict(zip(names, (axial, inside, outside), strict=True))

    def half_waves(self, x: NDArray[Any]) -> dict[str, int]:
        """Name of each motion of a line -> half waves along it."""
        found = {}
        for line in self.lines:
            directions, moved = line.directions(self.axes[0]), line.moved(x)
            along = [(d * moved).sum(axis=1) for d in directions]
            for way, values in zip((ALONG, IN_PLANE, OUT_OF_PLANE), along, strict=True):
                found[f"{line.name} {way}"] = _changes_of_sign(values) + 1
            found[f"{line.name} {ACROSS}"] = _changes_of_sign(max(along[1:], key=lambda v: np.abs(v).max())) + 1
        return found


def _changes_of_sign(values: NDArray[Any]) -> int:
    """Number of sign changes of complex displacements, at the phase of the largest one."""
    largest = values[np.abs(values).argmax()]
    real = (values / largest).real if largest else np.zeros(1)
    return int(np.count_nonzero(np.diff(np.sign(real[np.abs(real) > LEAST_WAVE]))))


def named(shares: dict[str, float], half_waves: dict[str, int]) -> str:
    """Names of the largest share, and of the second if it is large too; lines with their number of half waves.

    Equal shares, as for legs of a symmetric mooring, stay in order regardless of rounding.
    """
    first, *others = sorted(shares, key=lambda name: -round(shares[name] / EQUAL))
    names = [first] + [name for name in others[:1] if shares[name] >= NAMED]
    return " + ".join(f"{name} {half_waves[name]}" if name in half_waves else name for name in names)


class Motions(NamedTuple):
    """Small motions of C along a direction, to its left and upwards [m], and rotations about these axes [rad].

    pitch > 0 tilts the top along the direction.  Complex if they are amplitudes.
    """

    surge: complex
    sway: complex
    heave: complex
    roll: complex
    pitch: complex
    yaw: complex


def axes_along(direction_deg: float) -> NDArray[Any]:
    """Rows: unit vectors along a direction, to its left, and up."""
    ahead = heading(direction_deg)
    return np.array([ahead, np.cross([0.0, 0.0, 1.0], ahead), [0.0, 0.0, 1.0]])


def turn(q4: NDArray[Any], change: NDArray[Any]) -> NDArray[Any]:
    """Rotation vector (world frame) of a small change of the unit quaternion q4, which may be complex."""
    w, v = change[0], np.asarray(change[1:])
    return np.asarray(2 * (q4[0] * v - w * q4[1:] - np.cross(v, q4[1:])))
