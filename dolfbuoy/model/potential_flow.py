"""Coefficients of potential flow of a buoy about C, and the corresponding memory, as numbers.

The coefficients are transformed to C once, for the hull floating upright; they then refer to five velocities, (x, y, z)
of C and (x, y) of the tip of its unit axis.  Heave has its own memory; the two vertical planes have the same one.
"""

import itertools
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..scene import Scene
from ..scene.buoy import Buoy
from . import Array
from .airy import dispersion_wavenumber, remembered
from .memory_fit import States, fitted
from .rigid import float_upright, mass_properties, shape_of

#: Indices of heave, and of surge and the lean of the axis in each vertical plane, among the five velocities.
HEAVE, PLANES = (2,), ((0, 3), (1, 4))


class Coefficients(NamedTuple):
    """Coefficients about C over omega (n,) [rad/s] for (surge, lean of the axis, heave): 3 numbers or 3 x 3 each.

    force: diffraction per metre of a wave along x, (n, 3) complex; undisturbed: the Froude-Krylov part of the file.
    """

    omega: Array
    added_mass: Array
    at_once: Array
    damping: Array
    force: Array
    undisturbed: Array | None


def coefficients_of(scene: Scene, buoy: Buoy) -> Coefficients:
    """Coefficients about C of a section [buoy] with potential_flow.  Raises InputError for a hull that sinks."""
    return remembered(partial(_coefficients, scene, buoy), *of_body(buoy), scene.sea, scene.gravity, "radiation")


def of_body(buoy: Buoy) -> tuple[Any, ...]:
    """Parts of a section that determine coefficients and memory; copies with another start share these objects."""
    mass = buoy.mass, buoy.point_masses, buoy.center_of_mass, buoy.inertia
    return buoy.potential_flow, buoy.memory_order, buoy.hull, *mass


def draft_of(scene: Scene, buoy: Buoy) -> float:
    """Draft for which the coefficients hold [m]: the file's, or that of the buoy without lines."""
    given = buoy.potential_flow.draft
    if given is not None:
        return float(given)
    return float_upright(shape_of(buoy), mass_properties(buoy), scene.sea.density, scene.gravity or 1.0).draft


def _coefficients(scene: Scene, buoy: Buoy) -> Coefficients:
    flow, draft, center = buoy.potential_flow, draft_of(scene, buoy), mass_properties(buoy).height
    omega = np.array(flow.omega)
    lever = flow.height + draft - center  # of the file's point above C
    turn = np.eye(3)
    turn[0, 1] = lever  # velocity of that point

    def about_C(rows: Any) -> Array:
        surge, heave, pitch, both = np.atleast_2d(rows).T
        zero = np.zeros_like(surge)
        found = np.array([[surge, both, zero], [both, pitch, zero], [zero, zero, heave]]).transpose(2, 0, 1)
        return turn.T @ found @ turn

    def forces(rows: Any) -> Array:
        numbers = np.array(rows)
        surge, heave, pitch = (numbers[:, k] + 1j * numbers[:, k + 1] for k in (0, 2, 4))
        return np.column_stack([surge, pitch, heave]) @ turn

    whole, own = forces(flow.excitation), flow.froude_krylov
    undisturbed = None if own is None else forces(own)
    part = froude_krylov(scene, buoy, draft, wavenumbers(scene, omega)) if undisturbed is None else undisturbed
    A, B = about_C(flow.added_mass), about_C(flow.damping)
    return Coefficients(omega, A, about_C(flow.added_mass_infinite)[0], B, whole - part, undisturbed)


def froude_krylov(scene: Scene, buoy: Buoy, draft: float, k: Array, narrow: bool = False) -> Array:
    """Force of the undisturbed wave on the upright hull per metre, (n, 3) complex: surge, lean, heave, about C.

    k: wavenumbers (n,).  narrow: for strips without `disk_averages`, which use the water on the axis and its gradient,
    valid for small k R.

    By Gauss' theorem -grad p and its moment are integrated over the disks, which gives J_n(k R) for a wave along x, and
    the pressure over the water plane.
    """
    shape, h = shape_of(buoy), scene.sea.depth
    zeta, R, length = points_on_axis(shape, draft)
    z, (area, first) = zeta - draft, disks(k, R, narrow)
    down, up = np.exp(np.outer(k, z)), np.exp(-np.outer(k, z + 2 * h))
    bottom = (1 + np.exp(-2 * k * h))[:, None]
    along, rise = -1j * k[:, None] * (down + up) / bottom * area, -k[:, None] * (down - up) / bottom
    lean = along * (zeta - mass_properties(buoy).height) - 1j * rise * first
    inside = np.stack([along @ length, lean @ length, (rise * area) @ length], axis=-1)
    area, first = (x[:, 0] for x in disks(k, np.array([shape.waterplane_radius(draft)]), narrow))
    plane = np.stack([0 * area, -1j * first, area], axis=-1)
    return np.asarray(scene.sea.density * scene.gravity * (inside + plane))


def wavenumbers(scene: Scene, omega: Array) -> Array:
    """k [1/m] for angular frequencies, in the scene's water depth."""
    return np.array([dispersion_wavenumber(2 * np.pi / w, scene.sea.depth, scene.gravity) for w in omega])


def disks(k: Array, R: Array, narrow: bool) -> tuple[Array, Array]:
    """Integrals of exp(i k x) and of x exp(i k x)/i over disks, (wavenumbers, radii)."""
    from scipy.special import j1, jn

    kR = np.maximum(np.outer(k, R), 1e-9)
    if narrow:
        return np.pi * R**2 + 0 * kR, np.pi / 4 * R**3 * kR
    return 2 * np.pi * R**2 * j1(kR) / kR, 2 * np.pi * R**3 * jn(2, kR) / kR


def points_on_axis(shape: Any, draft: float) -> tuple[Array, Array, Array]:
    """Heights, radii and weights [m] of Gauss points on the wet axis, in pieces short enough for the waves."""
    x, weights = np.polynomial.legendre.leggauss(6)
    found = []
    for a, b, ra, rb in shape.segments:
        end = min(b, draft)
        ends = np.linspace(a, end, 2 + int(16 * (end - a) / draft)) if end > a else np.zeros(0)
        for low, high in itertools.pairwise(ends):
            zeta = low + (high - low) * (x + 1) / 2
            found.append((zeta, ra + (rb - ra) * (zeta - a) / (b - a), (high - low) / 2 * weights))
    zeta, R, length = (np.concatenate(part) for part in zip(*found, strict=True))
    return zeta, R, length


def on_five(three: Array) -> Array:
    """Matrices (..., 5, 5) from (..., 3, 3), the same in both vertical planes."""
    found = np.zeros((*three.shape[:-2], 5, 5), dtype=three.dtype)
    for places in PLANES:
        found[..., np.array(places)[:, None], places] = three[..., :2, :2]
    found[..., 2, 2] = three[..., 2, 2]
    return found


def states_of(scene: Scene, buoy: Buoy) -> tuple[States, States]:
    """Memory of heave, and of (surge, lean times the height of the hull)."""
    return remembered(partial(_states, scene, buoy), *of_body(buoy), scene.sea, scene.gravity, "memory")


def _states(scene, buoy):
    c, size = coefficients_of(scene, buoy), np.array([1.0, shape_of(buoy).height])
    apart = c.added_mass - c.at_once
    pair = 1 / np.outer(size, size)
    try:
        heave = fitted(c.omega, c.damping[:, 2:, 2:], apart[:, 2:, 2:], buoy.memory_order)
        plane = fitted(c.omega, c.damping[:, :2, :2] * pair, apart[:, :2, :2] * pair, buoy.memory_order)
    except ValueError as error:
        raise InputError(f"buoy.potential_flow: {error}.") from None
    return heave, plane


def radiation_memory(scene: Scene) -> str:
    """Text with the states of the radiation memory of each buoy that has one, and the error of their kernel."""
    said = []
    for name, buoy in scene.network.buoys.items() if scene.sea else ():
        if buoy.potential_flow:
            heave, plane = (f"{s.order} states ({100 * s.error:.2g} %)" for s in states_of(scene, buoy))
            said.append(f"{name}: heave {heave}, a vertical plane {plane}")
    return "; ".join(said)


def plane_and_heave(scene: Scene, buoy: Buoy) -> Callable[[complex], Array]:
    """Function omega -> K(iw) of the states (3, 3) for (surge, lean, heave); omega may be complex."""
    heave, plane = states_of(scene, buoy)
    size, found = np.array([1.0, shape_of(buoy).height]), np.zeros((3, 3), dtype=complex)

    def at(omega: complex) -> Array:
        found[:2, :2] = plane.at(omega) * np.outer(size, size)
        found[2:, 2:] = heave.at(omega)
        return found.copy()

    return at


def modes_of_five(heave: States, plane: States, size: float) -> tuple[Array, Array, Array]:
    """rate (n,), into (n, 5), out (n, 5) for the five velocities, from those of heave and (surge, size x lean)."""
    rates, intos, outs = [heave.rate], [np.zeros((len(heave.rate), 5), complex)], []
    intos[0][:, HEAVE] = heave.into
    outs.append(np.zeros_like(intos[0]))
    outs[0][:, HEAVE] = heave.out.T
    for places in PLANES:
        rates.append(plane.rate)
        for found, values in ((intos, plane.into), (outs, plane.out.T)):
            found.append(np.zeros((len(plane.rate), 5), complex))
            found[-1][:, places] = values * [1.0, size]
    return np.concatenate(rates), np.concatenate(intos), np.concatenate(outs)


def diffraction_at(scene: Scene, buoy: Buoy, omega: Array, k: Array) -> Array:
    """Force (n, 3) per metre of waves along x in addition to the strips', (surge, lean, heave).

    Diffraction, constant above the highest frequency of the file, and the part of the force of the undisturbed wave
    that strips without `disk_averages` lack.  omega: intrinsic frequencies, k: wavenumbers (n,).
    """
    from scipy.interpolate import CubicSpline

    c = coefficients_of(scene, buoy)
    known = np.concatenate([np.zeros((1, 3)), c.force])
    found = CubicSpline(np.append(0.0, c.omega), known)(np.minimum(omega, c.omega[-1]))
    if not buoy.disk_averages:
        draft = draft_of(scene, buoy)
        found = found + froude_krylov(scene, buoy, draft, k) - froude_krylov(scene, buoy, draft, k, narrow=True)
    return np.asarray(found)
