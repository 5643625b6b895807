"""Moving parts of a mode: shares of its kinetic energy, added mass included, and names from them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.sea import heading
from .layout import Body, LineNodes
from .linearisation import Linearisation

#: Ways in which a line moves, in the order of `LineNodes.directions`; of a vertical one the last two are one.
ALONG, IN_PLANE, OUT_OF_PLANE, ACROSS = "axial", "in plane", "out of plane", "transverse"
#: The second motion of a mode is named from this part of the energy on.
NAMED = 0.25
#: Relative difference up to which two displacements of a mode, or two shares, are equal.
EQUAL = 1e-6
#: Displacements below this part of the largest do not count as half waves.
LEAST_WAVE = 0.02


class Moving:
    """Energies of vectors of all unknowns; direction_deg: of surge and roll, from x."""

    def __init__(self, found: Linearisation, direction_deg: float = 0.0):
        self.bodies, self.lines = found.bodies, found.lines
        _, self.E, self.M = found.whole
        self.axes = axes_along(direction_deg)

    def sized(self, x: NDArray[Any]) -> NDArray[Any]:
        """The vector with its largest displacement 1 m, or turn 1 rad, and real there: of equal ones with the first."""
        changes = [body.motion(x) for body in self.bodies] + [line.moved(x).ravel() for line in self.lines]
        changes = np.concatenate(changes)
        sizes = np.abs(changes)
        return np.asarray(x / changes[(sizes >= (1 - EQUAL) * sizes.max()).argmax()])

    def motions(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Displacements and turns, at the radius of gyration [m], of all buoys (6 b, k) in columns of all unknowns."""
        arms = [np.sqrt(np.trace(body.inertia) / body.mass) for body in self.bodies]
        scales = (np.array([[1.0]] * 3 + [[arm]] * 3) for arm in arms)
        parts = [scale * body.motion(vectors) for body, scale in zip(self.bodies, scales, strict=True)]
        return np.concatenate(parts) if parts else vectors[:0]

    def at_rest(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """The columns without momenta."""
        vectors = vectors.copy()
        for body in self.bodies:
            vectors[[*body.at.momentum, *body.at.angular_momentum]] = 0.0
        return vectors

    def separated(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Combinations of vectors of one eigenvalue: first what moves most in the vertical plane, last what least."""
        every = slice(None)
        moved = [np.concatenate([self._displacements(x, every), self.motions(x[:, None])[:, 0]]) for x in vectors.T]
        triangle = np.linalg.qr(np.array(moved).T, mode="r")
        if np.linalg.cond(triangle) > 1e6:  # they move alike
            return vectors
        vectors = vectors @ np.linalg.inv(triangle)  # now of displacements that are orthonormal
        inside = np.array([self._displacements(x, slice(2)) for x in vectors.T]).T
        return np.asarray(vectors @ np.linalg.svd(inside, full_matrices=False)[2].conj().T)

    def _displacements(self, x: NDArray[Any], ways: slice) -> NDArray[Any]:
        """Displacements of all buoys and lines in the directions (ahead or along, up or across, aside)."""
        parts = [self.axes[[0, 2, 1]][ways] @ body.motion(x)[:3] for body in self.bodies]
        for line in self.lines:
            parts += [(d * line.moved(x)).sum(axis=1) for d in line.directions(self.axes[0])[ways]]
        return np.concatenate(parts)

    def shares(self, x: NDArray[Any]) -> dict[str, float]:
        """Part of each motion in the kinetic energy; their sum is 1.

        All unknowns move in one phase of the mode, so that velocities are counted as displacements: of what drifts too.
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
        """Its velocities and, by the inertia in the rows of its momenta, effective momenta, along the axes."""
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
    """Number of changes of sign of complex displacements at the phase in which they are largest."""
    largest = values[np.abs(values).argmax()]
    real = (values / largest).real if largest else np.zeros(1)
    return int(np.count_nonzero(np.diff(np.sign(real[np.abs(real) > LEAST_WAVE]))))


def named(shares: dict[str, float], half_waves: dict[str, int]) -> str:
    """The largest share, and the second if it is large too, lines with their number of half waves.

    Of equal shares, as legs of a symmetric mooring have, the first comes first, whatever the rounding.
    """
    first, *others = sorted(shares, key=lambda name: -round(shares[name] / EQUAL))
    names = [first] + [name for name in others[:1] if shares[name] >= NAMED]
    return " + ".join(f"{name} {half_waves[name]}" if name in half_waves else name for name in names)


class Motions(NamedTuple):
    """Motions of C along a direction, across it (to the left) and up [m], and turns about these three axes [rad].

    pitch > 0 turns the top along the direction.  Small; complex where they are amplitudes.
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
