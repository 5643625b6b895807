"""Mean drift of a hull with coefficients of potential flow, in waves of one frequency, and the strips' share of it.

The far field gives the total mean force along a wave (`formats.capytaine`), for the motions of the buoy without drag
and without its lines, except for their weight.  Strips (their hydrostatics and Froude-Krylov force on the instantaneous
wet hull, and the diffraction at C) already contain a part of it, to second order in the amplitude.  It is replaced by
Newman's approximation of the total force.
"""

from typing import Any, NamedTuple

import numpy as np

from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.potential_flow import hermitian
from . import Array
from .airy import AirySum, remembered
from .potential_flow import (
    Coefficients,
    coefficients_of,
    diffraction_at,
    disks,
    draft_of,
    froude_krylov,
    plane_and_heave,
    points_on_axis,
)
from .rigid import float_upright, mass_properties, shape_of


class Drift(NamedTuple):
    """Mean drift per square of the wave amplitude, in waves of n frequencies along x.

    whole: mean force (n,) [N/m^2].  left, right: complex (4, n), for surge, lean, heave and the elevation; the slow
    force of strips in a sea is 1/2 Re of the sum over these four of conj(sum of left) (sum of right).
    """

    whole: Array
    left: Array
    right: Array

    @property
    def strips(self) -> Array:
        """Mean force on strips (n,) [N/m^2]."""
        return np.asarray(0.5 * (self.left.conj() * self.right).real.sum(axis=0))


def transfer(drift: Drift, cosine: Array, sine: Array) -> Array:
    """Six pairs (n, 6, 3) of (left, right along x, right along y); the slow force is the sum of Re conj(left) right.

    Newman's 1/2 (D_i + D_j) for waves i and j, less the strips' share.  cosine, sine: those of the directions (n,).
    """
    (surge, lean, heave, wave), (*moved, still) = drift.left, -0.5 * drift.right
    ways = cosine, sine
    pairs = [(wave, drift.whole + still), (heave, moved[2])]
    pairs += [(x * way, y * way) for x, y in zip((surge, lean), moved, strict=False) for way in ways]
    return np.array([(left, right * cosine, right * sine) for left, right in pairs]).transpose(2, 0, 1)


def of_components(scene: Scene, buoy: Buoy) -> Drift:
    """Mean drift of a buoy in each component of the scene's waves."""

    def made() -> Drift:
        waves = AirySum.of(scene)
        return mean_drift(scene, buoy, waves.in_water, waves.wavenumber)

    return remembered(made, buoy, scene.sea, scene.waves, scene.current, scene.gravity, "drift")


def mean_drift(scene: Scene, buoy: Buoy, omega: Array, k: Array) -> Drift:
    """Mean drift at intrinsic angular frequencies [rad/s] and their wavenumbers [1/m], (n,)."""
    c, lever = coefficients_of(scene, buoy), _lever(scene, buoy)
    surge, lean, heave = free_motions(scene, buoy, omega, k, _of_file(c, omega)).T
    y = np.stack([np.ones_like(surge), surge + lever * lean, heave, lean], axis=-1)
    form = _between(c.omega, hermitian(buoy.potential_flow.mean_drift), omega)
    whole = np.einsum("ni,nij,nj->n", y.conj(), form, y).real
    states = plane_and_heave(scene, buoy)  # near resonance a run moves according to its few memory states
    own = free_motions(scene, buoy, omega, k, np.array([states(w) for w in omega]).conj())
    return Drift(whole, *_of_strips(scene, buoy, omega, k, own))


def _of_file(c: Coefficients, omega: Array) -> Array:
    """B - i w (A - A_inf) (n, 3, 3)."""
    from scipy.interpolate import CubicSpline  # half a second of every start

    A = CubicSpline(c.omega, c.added_mass)(np.clip(omega, c.omega[0], c.omega[-1]))
    return np.asarray(_between(c.omega, c.damping, omega) - 1j * omega[:, None, None] * (A - c.at_once))


def free_motions(scene: Scene, buoy: Buoy, omega: Array, k: Array, radiated: Array) -> Array:
    """Surge, lean and heave of C per metre of amplitude (n, 3), without drag and the stiffness of lines.

    radiated: B - i w (A - A_inf) (n, 3, 3).
    """
    c, mass = coefficients_of(scene, buoy), mass_properties(buoy)
    shape, draft = shape_of(buoy), draft_of(scene, buoy)
    density, g = scene.sea.density, scene.gravity
    pull = (density * shape.volume(draft) - mass.mass) * g
    heights = [z for _, _, z in (buoy.fairleads or {}).values()] or [buoy.mooring_height]
    afloat = float_upright(shape, mass, density, g, pull, float(np.mean(heights)))
    stiffness = np.diag([0.0, afloat.GM * mass.mass * g, afloat.heave_stiffness])
    inertia = np.diag([mass.mass, float(np.mean(mass.inertia[:2])), mass.mass])
    w = omega[:, None, None]
    force = _between(c.omega, c.force, omega) + froude_krylov(scene, buoy, draft, k)
    A = stiffness - 1j * w * radiated - w**2 * (inertia + c.at_once)
    return np.asarray(np.linalg.solve(A, force[..., None])[..., 0])


def _lever(scene: Scene, buoy: Buoy) -> float:
    """Height of the file's point above C [m]."""
    return float(buoy.potential_flow.height + draft_of(scene, buoy) - mass_properties(buoy).height)


def _between(omega: Array, values: Any, at: Array) -> Array:
    """Values interpolated over frequency, 0 at 0 and constant above the highest."""
    from scipy.interpolate import CubicSpline

    known = np.concatenate([np.zeros_like(values[:1]), values])
    return np.asarray(CubicSpline(np.append(0.0, omega), known)(np.minimum(at, omega[-1])))


def _of_strips(scene: Scene, buoy: Buoy, omega: Array, k: Array, motions: Array) -> tuple[Array, Array]:
    """Pairs of `Drift` for strips and diffraction, from first-order motions (n, 3).

    They are rho A a_x of the undisturbed water at each disk, which moves with the hull and, by stretching, with the
    surface; the disks wetted in addition by the surface; and the diffraction at C.
    """
    draft, h = draft_of(scene, buoy), scene.sea.depth
    shape, C = shape_of(buoy), mass_properties(buoy).height
    heights, R, length = points_on_axis(shape, draft)
    plane = np.array([shape.waterplane_radius(draft)])
    z, K = heights - draft, k[:, None]
    area, top = (disks(k, r, not buoy.disk_averages)[0] for r in (R, plane))
    acceleration, slope = (scene.sea.density * area * x for x in _along(scene, K, z))
    water = scene.sea.density * (top * _along(scene, K, np.zeros(1))[0])[:, 0]
    diffracted = diffraction_at(scene, buoy, omega, k)[:, 0]
    stretched = (1 + z / h) * (scene.waves.stretching == "wheeler")
    right = [
        1j * k * (acceleration @ length + diffracted),
        1j * k * (acceleration @ (length * (heights - C))),
        slope @ length - water,
        water * top[:, 0] / (np.pi * plane**2) - slope @ (length * stretched),
    ]
    return np.stack([*motions.T, np.ones(len(k))]), np.stack(right)


def _along(scene: Scene, k: Array, z: Array) -> tuple[Array, Array]:
    """Complex horizontal acceleration at heights z below a crest of unit height, and its derivative in z."""
    down, up, bed = np.exp(k * z), np.exp(-k * (z + 2 * scene.sea.depth)), 1 + np.exp(-2 * k * scene.sea.depth)
    size = -1j * k * scene.gravity / bed
    return size * (down + up), size * k * (down - up)
