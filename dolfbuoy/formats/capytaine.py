"""Potential-flow coefficients of a buoy's hull from Capytaine, a boundary element method (optional).

The hull is panelled on three meshes, with panels of full, one half and one third size, and the limit is extrapolated:
errors scale with the square of the size and, from right-angled edges, with its power 8/3, as the potential there varies
with the power 2/3 of the distance and the panel size with its root.  Polygons around the axis have the area of their
circles, so that the volume is exact.  A lid on the interior water plane removes irregular frequencies.

Mean drift force from the momentum flux of the waves in the far field (Maruo 1960, Newman 1967).

Far from a body, its waves are H(theta) times a ring wave.  With H = H_wave + sum of H_j times the motions per metre of
amplitude, the force along the incoming wave is quadratic in y = (1, surge, heave, pitch): y* Q y per metre squared.  Q
does not depend on mass or moorings, which determine the motions.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from ..meshes import HullShape
from ..scene.potential_flow import DIFFRACTED, DOFS, MEAN_DRIFT, UNDISTURBED, WHOLE, fault_of

#: Number of equally spaced directions of the far-field integral: exact for harmonics below half of it.
DIRECTIONS = 96


def quadratic_forms(results: Iterable[Any]) -> dict[float, NDArray[Any]]:
    """Frequency [rad/s] -> Hermitian Q (4, 4) [N/m^2, ...] from Capytaine's results with details.

    The results are for waves along x and the motions of DOFS; infinite frequencies are left out.
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
    """H(theta) in equally spaced directions from x, from potential and velocity on the hull.

    The hull integral of phi_n E - phi E_n, E = cosh k(z+h)/cosh kh exp(-ik(x cos theta + y sin theta)), over 4 pi.
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


#: Panels around the axis of the coarse mesh; divisors of the panel size; powers with which errors scale.
AROUND, MESHES, POWERS = 32, (1, 2, 3), (2.0, 8 / 3)
#: Largest number of these panels, and factor on it if a scene would reject the coefficients.
MOST_AROUND, REFINED = 80, 1.4
#: Factor on Capytaine's distance within which panels are integrated exactly; farther off they are points, whose sum has
#: a first-order error that the extrapolation does not remove.
FARTHER = 20.0
#: Rates of exponentials for the bed's part of the Green function, and the points at which they are fitted.
RATES, FITTED = -np.geomspace(0.02, 40.0, 20), np.append(np.linspace(0.0, 10.0, 400), np.geomspace(10.1, 60.0, 200))
#: Frequencies, in sqrt(g/R) of the largest wet radius R: steps up to the highest.
STEP, STEPS = 0.05, 50
#: Angle between pieces of the outline above which there is an edge [deg].
EDGE = 20.0
#: Names of the coefficients, without those that depend on the water only.
NAMES = ("added_mass", "radiation_damping", WHOLE, UNDISTURBED, DIFFRACTED, MEAN_DRIFT)


@dataclass(frozen=True)
class Floating:
    """An upright hull in water: draft [m], water depth (inf: deep), density, gravity, in SI units."""

    shape: HullShape
    draft: float
    depth: float
    density: float
    gravity: float

    @property
    def radius(self) -> float:
        """Largest radius below the water [m]."""
        return float(self.outline[:, 0].max())

    @property
    def outline(self) -> NDArray[Any]:
        """Corners (radius, z) from the axis at the keel up to the water line [m]."""
        points = [(0.0, -self.draft)]
        for a, b, ra, rb in self.shape.segments:
            if a < self.draft:
                end = min(b, self.draft)
                points += [(ra, a - self.draft), (ra + (rb - ra) * (end - a) / (b - a), end - self.draft)]
        found = np.array(points)
        moved = np.linalg.norm(np.diff(found, axis=0), axis=1) > 1e-9 * self.shape.height
        return np.asarray(found[np.append(True, moved)])


def capytaine() -> Any:
    """The module capytaine.  Raises InputError if it is not installed."""
    try:
        import capytaine as found
    except ImportError as error:
        said = "" if isinstance(error, ModuleNotFoundError) else f" ({error})"
        raise InputError(
            f"Capytaine is not installed{said}: pip install 'dolfbuoy[potential]', or take a file made elsewhere."
        ) from None
    found.set_logging("ERROR")
    return found


def compute(hull: Floating, around: int = AROUND, progress: Callable[[str], object] = print) -> xr.Dataset:
    """Coefficients about the point on the axis in the water plane, as read by `scene.potential_flow`.

    around: panels around the axis of the coarse mesh.  progress: called with a sentence for each mesh.  Raises
    InputError without Capytaine, or for a hull that does not cut the surface.
    """
    cpt = capytaine()
    if not 0 < hull.draft < hull.shape.height or hull.shape.waterplane_radius(hull.draft) <= 0:
        raise InputError("buoy.hull: must cut the water surface at rest, or it makes no such waves.")
    found = []
    for finer in MESHES:
        body = _body(cpt, hull, around, finer)
        found.append(_solved(cpt, hull, body))
        more = 100 * (body.mesh.volume / hull.shape.volume(hull.draft) - 1)
        heave = float(found[-1].added_mass.sel(omega=np.inf, influenced_dof="Heave", radiating_dof="Heave"))
        progress(
            f"{body.mesh.nb_faces} panels, {body.lid_mesh.nb_faces} on the lid: added mass in heave at infinite "
            f"frequency {heave:.6g} kg, volume {more:+.2g} %"
        )
    data, two = (_limit(found[-count:], count) for count in (len(MESHES), 2))
    usable = np.all(np.isfinite(data.radiation_damping), axis=(1, 2)) | np.isinf(data.omega)
    if not usable.all():
        progress(f"{int((~usable).sum())} frequencies are left out, for which Capytaine finds no finite numbers")
        data = data.isel(omega=np.flatnonzero(usable))
    for name, label in (("added_mass", "added mass"), ("radiation_damping", "damping"), (WHOLE, "wave force")):
        apart, less = (100 * _apart(one, data, name) for one in (found[-1], two))
        progress(
            f"{label}: the fine mesh is {apart:.2g} % of the largest from the limit, that of two meshes {less:.2g} %"
        )
    data.attrs = {"draft": hull.draft, "made_by": f"dolfbuoy with Capytaine {cpt.__version__}"}
    return data[list(NAMES)]


def compute_usable(hull: Floating, around: int = AROUND, progress: Callable[[str], object] = print) -> xr.Dataset:
    """As `compute`, with more and more panels until a scene accepts the coefficients.

    Meshes too coarse for short waves differ so much that the extrapolated damping may be negative.
    Raises InputError also if MOST_AROUND panels are not enough.
    """
    while True:
        data = compute(hull, around, progress)
        if not (fault := fault_of(data)):
            return data
        if around >= MOST_AROUND:
            raise InputError(f"A scene would refuse the coefficients of {around} panels around the axis: {fault}.")
        now, around = around, min(MOST_AROUND, math.ceil(REFINED * around))
        progress(f"A scene would refuse the coefficients of {now} panels around the axis: {fault}. Again with {around}")


def write(data: xr.Dataset, path: Path) -> None:
    """Write the coefficients as netCDF, with complex numbers as in Capytaine."""
    capytaine().export_dataset(str(path), data, format="netcdf")


def _limit(meshes: list[xr.Dataset], count: int) -> xr.Dataset:
    """Coefficients extrapolated to zero panel size from the `count` finest meshes."""
    sizes = 1 / np.array(MESHES[-count:], dtype=float)
    powers = np.column_stack([sizes**0, *(sizes**p for p in POWERS[: count - 1])])
    weights, data = np.linalg.solve(powers.T, np.eye(count)[0]), meshes[-1].copy()
    for name in NAMES:
        data[name] = sum(float(weight) * mesh[name] for weight, mesh in zip(weights, meshes, strict=True))
    return data


def _apart(fine: xr.Dataset, kept: xr.Dataset, name: str) -> float:
    """Largest difference in heave and in surge, relative to the largest value of each."""
    found = []
    for dof in ("Surge", "Heave"):
        chosen = {"influenced_dof": dof} | ({} if name == WHOLE else {"radiating_dof": dof})
        one, two = (np.abs(data[name].sel(chosen).sel(omega=kept.omega).values) for data in (fine, kept))
        found.append(float(np.nanmax(np.abs(one - two)) / np.nanmax(two)))
    return max(found)


def _solved(cpt: Any, hull: Floating, body: Any) -> xr.Dataset:
    omega = math.sqrt(hull.gravity / hull.radius) * STEP * np.arange(1, STEPS + 1)
    water = {"water_depth": [hull.depth], "rho": [hull.density], "g": [hull.gravity]}
    cases = {"omega": [*omega, np.inf], "radiating_dof": list(DOFS), "wave_direction": [0.0], **water}
    problems = cpt.io.xarray.problems_from_dataset(xr.Dataset(coords=cases), [body])
    solver = cpt.BEMSolver(method="direct", green_function=_green_function(cpt))
    results = solver.solve_all(problems, keep_details=True, progress_bar=False, _check_wavelength=False)
    found: xr.Dataset = cpt.assemble_dataset(results)
    forms, none = quadratic_forms(results), np.full((4, 4), np.nan)
    drift = np.array([forms.get(float(w), none) for w in found.omega.values], dtype=complex)
    found[MEAN_DRIFT] = (("omega", "drift_row", "drift_column"), drift)
    return found


def _green_function(cpt: Any) -> Any:
    """Capytaine's Green function, with exact panels out to FARTHER, and the bed's part fitted to 3e-5 above kh = 0.2.

    Capytaine's own fit of exponentials is off by 1e-2 (mean square 1e-4).  At infinite frequency the bed's part is that
    of images in bed and surface, 2/(1 + exp(2x)) = 2 sum (-1)^(n+1) exp(-2nx).
    """

    class Near:
        def __init__(self, mesh: Any) -> None:
            self.mesh, self.faces_radiuses = mesh, FARTHER * mesh.faces_radiuses

        def __getattr__(self, name: str) -> Any:
            return getattr(self.mesh, name)

    class Accurate(cpt.Delhommeau):  # type: ignore[misc]
        def evaluate(self, mesh1: Any, mesh2: Any, **parameters: Any) -> Any:
            return super().evaluate(mesh1, Near(mesh2), **parameters)

        def find_best_exponential_decomposition(self, kh: float, *, method: str | None = None) -> Any:
            if kh <= 0.1:
                return super().find_best_exponential_decomposition(kh, method=method)  # says that it cannot
            if kh < 1e5:
                return np.stack([RATES, amplitudes(kh)])
            n = np.arange(1, 31)
            sizes = 2.0 * (-1.0) ** (n + 1)
            sizes[-1] *= 0.5  # mean of both partial sums, exact at x = 0
            return np.stack([-2.0 * n, sizes])

    return Accurate()


def amplitudes(kh: float) -> NDArray[Any]:
    """Amplitudes of exponentials with `RATES` for the bed's part of the Green function (Delhommeau 1989).
    Their sum over x = kz fits its integrand without the pole at kh and the limit 2; kh: wave number times depth."""
    t = math.tanh(kh)
    x = FITTED[np.abs(FITTED - kh) > 1e-3 * max(1.0, kh)]  # at the pole itself 0/0
    pole = (1 + t) ** 2 / (1 - t**2 + t / kh) / (x - kh)
    values = 2 * (x + kh * t) / ((x - kh * t) - (x + kh * t) * np.exp(-2 * x)) - pole - 2
    return np.asarray(np.linalg.lstsq(np.exp(np.outer(x, RATES)), values, rcond=1e-11)[0])


def _body(cpt: Any, hull: Floating, around: int, finer: int) -> Any:
    """Hull and lid; finer: number of panels that replace each one of the coarse mesh, in both directions."""
    size = 2 * math.pi * hull.radius / around / 1.2
    R = hull.shape.waterplane_radius(hull.draft)
    rings = np.linspace(0.0, R, finer * max(2, round(R / size)) + 1)
    dofs = cpt.rigid_body_dofs(only=list(DOFS), rotation_center=(0.0, 0.0, 0.0))
    outlines = meridian(hull.outline, size, finer), np.column_stack([rings, 0 * rings])
    wet, lid = (_turned(cpt, points, finer * around) for points in outlines)
    return cpt.FloatingBody(mesh=wet, lid_mesh=lid, dofs=dofs, name="hull")


def meridian(outline: NDArray[Any], size: float, finer: int = 1) -> NDArray[Any]:
    """Points (radius, z) along an outline, about size/finer apart, closer near its edges and the water line."""
    ways = np.diff(outline, axis=0)
    angles = np.degrees(np.abs(np.diff(np.unwrap(np.arctan2(ways[:, 1], ways[:, 0])))))
    ends = [0, *(np.flatnonzero(angles > EDGE) + 1), len(outline) - 1]
    found = [outline[:1]]
    for k, (a, b) in enumerate(itertools.pairwise(ends)):
        piece = outline[a : b + 1]
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(piece, axis=0), axis=1)))
        x = np.linspace(0.0, 1.0, finer * max(1, round(along[-1] / size)) + 1)
        x = (1 - np.cos(np.pi * x)) / 2 if k else np.sin(np.pi / 2 * x)  # the axis is no edge
        found.append(np.column_stack([np.interp(x * along[-1], along, column) for column in piece.T])[1:])
    return np.concatenate(found)


def _turned(cpt: Any, points: NDArray[Any], around: int) -> Any:
    """Mesh from points (radius, z), lowest first, turned about the axis; polygons have the area of their circles."""
    angle = 2 * math.pi / around
    r, z = points[:, 0] * math.sqrt(angle / math.sin(angle)), points[:, 1]
    first, second = np.column_stack([r, 0 * r, z]), np.column_stack([r * math.cos(angle), r * math.sin(angle), z])
    k, n = np.arange(len(r) - 1), len(r)
    faces = np.column_stack([k, k + n, k + n + 1, k + 1])
    return cpt.RotationSymmetricMesh(cpt.Mesh(np.concatenate([first, second]), faces), n=around)
