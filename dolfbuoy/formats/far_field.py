"""Mean drift force from the momentum that waves carry away (Maruo 1960, Newman 1967), from Capytaine's potentials.

Far from a body its waves are H(theta) times a ring wave.  With H = H_wave + sum of H_j times the motions per metre of
amplitude, the force along the incoming wave is quadratic in y = (1, surge, heave, pitch): y* Q y per metre squared.
Q knows nothing of mass or moorings, which decide the motions.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.potential_flow import DOFS

#: Directions over which the far field is integrated, evenly: exact for harmonics below half as many.
DIRECTIONS = 96


def quadratic_forms(results: Iterable[Any]) -> dict[float, NDArray[Any]]:
    """Frequency [rad/s] -> Q (4, 4) [N/m^2, ...], hermitian, of Capytaine's results with their details.

    The results hold waves along x and the motions of DOFS; infinite frequencies are left out.
    """
    found: dict[float, dict[str, Any]] = {}
    for result in results:
        omega = float(result.omega)  # Capytaine's infinity is no float
        if np.isfinite(omega) and getattr(result, "potential", None) is not None:
            found.setdefault(omega, {})[getattr(result, "radiating_dof", "")] = result
    names = "", *DOFS
    return {omega: _form([of[name] for name in names]) for omega, of in found.items() if set(names) <= set(of)}


def _form(results: list[Any]) -> NDArray[Any]:
    one = results[0]
    H = 1j * np.array([kochin(result, DIRECTIONS) for result in results])
    turn, k = 2 * math.pi / DIRECTIONS, one.wavenumber
    own = -2 * math.pi * one.rho * k * weight(one) * turn * (H.conj() * np.cos(turn * np.arange(DIRECTIONS))) @ H.T
    forward = 1j * math.pi * one.rho * one.g * k / one.omega * H[:, 0]
    own[0] += forward  # with the incoming wave: Im(H . y)
    own[:, 0] += forward.conj()
    return np.asarray(own)


def weight(result: Any) -> float:
    """1 over twice the integral of (cosh k(z+h)/cosh kh)^2 over the depth [1/m]: k in deep water."""
    k, h, deep = result.wavenumber, result.water_depth, result.omega**2 / result.g
    return float(k if np.isinf(h) else k**2 / (h * (k**2 - deep**2) + deep))


def kochin(result: Any, directions: int) -> NDArray[Any]:
    """H(theta) in even directions from x on, of potential and velocity on the hull.

    The integral of phi_n E - phi E_n over it, E = cosh k(z+h)/cosh kh exp(-ik(x cos theta + y sin theta)), over 4 pi.
    """
    body, k, h = result.body, result.wavenumber, result.water_depth
    mesh, on_hull = body.mesh_including_lid, body.hull_mask
    centers, normals, areas = (x[on_hull] for x in (mesh.faces_centers, mesh.faces_normals, mesh.faces_areas))
    phi, velocity = result.potential[on_hull], result.problem.boundary_condition[on_hull]
    theta = 2 * math.pi / directions * np.arange(directions)
    heading = np.array([np.cos(theta), np.sin(theta)])
    bed = 0.0 if np.isinf(h) else np.exp(-2 * k * (centers[:, 2] + h))
    up = np.exp(k * centers[:, 2]) * (1 + bed) / (1 if np.isinf(h) else 1 + math.exp(-2 * k * h))
    slope = k * up * (1 - bed) / (1 + bed)
    E = np.exp(-1j * k * (centers[:, :2] @ heading))
    across = slope[:, None] * normals[:, 2:] - 1j * k * up[:, None] * (normals[:, :2] @ heading)
    return np.asarray(areas @ (E * (velocity[:, None] * up[:, None] - phi[:, None] * across))) / (4 * math.pi)
