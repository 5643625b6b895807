"""Coefficients of potential flow for the hull of a buoy, by Capytaine, a boundary element method (optional).

The hull is paneled on two meshes, the second with panels of half the size, and what a third would add is extrapolated:
errors go with the power `POWER` of the size, from the edges of a hull on.  At infinite frequency there is a finer one.
Polygons around the axis are as large as their circles, so that the volume is right.  A lid on the water plane inside
keeps irregular frequencies away.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from ..meshes import HullShape
from ..scene.potential_flow import DIFFRACTED, DOFS, MEAN_DRIFT, UNDISTURBED, WHOLE, fault_of
from .far_field import quadratic_forms

#: Panels around the axis of the coarse mesh; power of their size that errors go with, measured on a truncated cylinder.
AROUND, POWER = 24, 1.6
#: How many of them at most, and times as many where a scene would refuse the coefficients.
MOST_AROUND, REFINED = 80, 1.4
#: Panels in place of each of the coarse mesh for infinite frequency, which is quick; the power near that size.
FINEST, FINE_POWER = 4, 2.0
#: Frequencies, in sqrt(g/R) of the largest wet radius R: steps up to the highest.
STEP, STEPS = 0.05, 50
#: Angle between pieces of the outline from which on there is an edge [deg].
EDGE = 20.0
#: The coefficients; what depends on the water alone is not among them.
NAMES = ("added_mass", "radiation_damping", WHOLE, UNDISTURBED, DIFFRACTED, MEAN_DRIFT)


@dataclass(frozen=True)
class Floating:
    """An upright hull in water: its draft [m], depth of the water (inf: deep), density, gravity, in SI units."""

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
    """The module.  Raises InputError where it is not installed."""
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
    """Coefficients about the axis in the water plane, as `scene.potential_flow` reads them.

    around: panels around the axis of the coarse mesh.  progress: takes a sentence on each mesh.  Raises InputError
    without Capytaine, or for a hull that does not cut the surface.
    """
    cpt = capytaine()
    if not 0 < hull.draft < hull.shape.height or hull.shape.waterplane_radius(hull.draft) <= 0:
        raise InputError("buoy.hull: must cut the water surface at rest, or it makes no such waves.")
    found = []
    for finer in (1, 2):
        body = _body(cpt, hull, around, finer)
        found.append(_solved(cpt, hull, body))
        more = 100 * (body.mesh.volume / hull.shape.volume(hull.draft) - 1)
        progress(
            f"{body.mesh.nb_faces} panels, {body.lid_mesh.nb_faces} on the lid: added mass in heave at infinite "
            f"frequency {_heave(found[-1].added_mass.sel(omega=np.inf)):.6g} kg, volume {more:+.2g} %"
        )
    coarse, fine = found
    data = fine.copy()
    for name in NAMES:
        data[name] = fine[name] + (fine[name] - coarse[name]) / (2**POWER - 1)
    finest, last = _at_once(cpt, hull, _body(cpt, hull, around, FINEST)), {"omega": np.inf}
    at_once = finest + (finest - fine.added_mass.loc[last]) / ((FINEST / 2) ** FINE_POWER - 1)
    data["added_mass"] = data.added_mass + (at_once - data.added_mass.loc[last])  # at all, or its memory would differ
    kept = _heave(data.added_mass.loc[last])
    progress(f"{FINEST**2} times the panels at infinite frequency: {_heave(finest):.6g} kg, of which {kept:.6g} kg")
    usable = np.all(np.isfinite(data.radiation_damping), axis=(1, 2)) | np.isinf(data.omega)
    if not usable.all():
        progress(f"{int((~usable).sum())} frequencies are left out, for which Capytaine finds no finite numbers")
        data = data.isel(omega=np.flatnonzero(usable))
    for name, label in (("added_mass", "added mass"), ("radiation_damping", "damping"), (WHOLE, "wave force")):
        progress(f"{label}: the fine mesh is {100 * _apart(fine, data, name):.2g} % of the largest from what is kept")
    data.attrs = {"draft": hull.draft, "made_by": f"dolfbuoy with Capytaine {cpt.__version__}"}
    return data[list(NAMES)]


def compute_usable(hull: Floating, around: int = AROUND, progress: Callable[[str], object] = print) -> xr.Dataset:
    """As `compute`, with more panels until a scene takes the coefficients.

    Meshes too coarse for short waves lie so far apart there that what is extrapolated may be a damping below zero.
    Raises InputError also where MOST_AROUND panels are not enough.
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
    """Write the coefficients as netCDF, complex numbers as Capytaine does."""
    capytaine().export_dataset(str(path), data, format="netcdf")


def _heave(added_mass: xr.DataArray) -> float:
    return float(added_mass.sel(influenced_dof="Heave", radiating_dof="Heave"))


def _apart(fine: xr.Dataset, kept: xr.Dataset, name: str) -> float:
    """Largest difference in heave, and in surge, over the largest number of each."""
    found = []
    for dof in ("Surge", "Heave"):
        chosen = {"influenced_dof": dof} | ({} if name == WHOLE else {"radiating_dof": dof})
        one, two = (np.abs(data[name].sel(chosen).sel(omega=kept.omega).values) for data in (fine, kept))
        found.append(float(np.nanmax(np.abs(one - two)) / np.nanmax(two)))
    return max(found)


def _at_once(cpt: Any, hull: Floating, body: Any) -> xr.DataArray:
    """Added mass at infinite frequency."""
    solver = cpt.BEMSolver(method="direct", green_function=_green_function(cpt))
    water = {"water_depth": hull.depth, "rho": hull.density, "g": hull.gravity, "omega": np.inf}
    problems = [cpt.RadiationProblem(body=body, radiating_dof=dof, **water) for dof in DOFS]
    columns = [solver.solve(problem, keep_details=False, _check_wavelength=False).added_masses for problem in problems]
    values = np.array([[column[dof] for column in columns] for dof in DOFS])
    return xr.DataArray(values, {"influenced_dof": list(DOFS), "radiating_dof": list(DOFS)})


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
    """Capytaine's, but for infinite frequency in finite depth, where its fit of exponentials is off by 1e-3.

    There it is the images in the bed and the surface, 2/(1 + exp(2x)) = 2 sum (-1)^(n+1) exp(-2nx).
    """

    class Images(cpt.Delhommeau):  # type: ignore[misc]
        def find_best_exponential_decomposition(self, kh: float, *, method: str | None = None) -> Any:
            if kh < 1e5:
                return super().find_best_exponential_decomposition(kh, method=method)
            n = np.arange(1, 31)
            sizes = 2.0 * (-1.0) ** (n + 1)
            sizes[-1] *= 0.5  # the mean of both partial sums, right at x = 0
            return np.stack([-2.0 * n, sizes])

    return Images()


def _body(cpt: Any, hull: Floating, around: int, finer: int) -> Any:
    """Hull and lid; finer: panels in place of each one of the coarse mesh, in both directions."""
    size = 2 * math.pi * hull.radius / around / 1.2
    R = hull.shape.waterplane_radius(hull.draft)
    rings = np.linspace(0.0, R, finer * max(2, round(R / size)) + 1)
    dofs = cpt.rigid_body_dofs(only=list(DOFS), rotation_center=(0.0, 0.0, 0.0))
    outlines = meridian(hull.outline, size, finer), np.column_stack([rings, 0 * rings])
    wet, lid = (_turned(cpt, points, finer * around) for points in outlines)
    return cpt.FloatingBody(mesh=wet, lid_mesh=lid, dofs=dofs, name="hull")


def meridian(outline: NDArray[Any], size: float, finer: int = 1) -> NDArray[Any]:
    """Points (radius, z) along an outline about size/finer apart, closer towards its edges and the water line."""
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
    """Mesh of points (radius, z) from below, turned about the axis; its polygons have the area of their circles."""
    angle = 2 * math.pi / around
    r, z = points[:, 0] * math.sqrt(angle / math.sin(angle)), points[:, 1]
    first, second = np.column_stack([r, 0 * r, z]), np.column_stack([r * math.cos(angle), r * math.sin(angle), z])
    k, n = np.arange(len(r) - 1), len(r)
    faces = np.column_stack([k, k + n, k + n + 1, k + 1])
    return cpt.RotationSymmetricMesh(cpt.Mesh(np.concatenate([first, second]), faces), n=around)
