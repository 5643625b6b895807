"""`potential` with a Capytaine that is made up: panels, potentials that are no solutions, what is made of them."""

import math
import sys
from types import ModuleType, SimpleNamespace
from unittest.mock import patch

import numpy as np
import xarray as xr

from dolfbuoy.commands import potential
from dolfbuoy.errors import InputError
from dolfbuoy.formats import capytaine
from dolfbuoy.scene import load_scene

DOFS = ("Surge", "Heave", "Pitch")


class Mesh:
    """Quadrilaterals."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = np.asarray(vertices, dtype=float), np.asarray(faces)

    @property
    def nb_faces(self):
        return len(self.faces)

    @property
    def _vectors(self):
        a, b, c, d = (self.vertices[self.faces[:, k]] for k in range(4))
        return np.cross(c - a, d - b) / 2

    @property
    def faces_centers(self):
        return self.vertices[self.faces].mean(axis=1)

    @property
    def faces_areas(self):
        return np.linalg.norm(self._vectors, axis=1)

    @property
    def faces_normals(self):
        return self._vectors / np.maximum(self.faces_areas, 1e-30)[:, None]

    @property
    def faces_radiuses(self):
        return np.linalg.norm(self.vertices[self.faces[:, 0]] - self.faces_centers, axis=1)

    @property
    def volume(self):
        return 1.001 * float(np.sum(self.faces_centers * self._vectors) / 3)  # not by rounding alone off what it is


def turned(mesh, n):
    """The whole of a mesh of which this is one of n parts about z."""
    parts, faces = [], []
    for k in range(n):
        c, s = math.cos(2 * math.pi * k / n), math.sin(2 * math.pi * k / n)
        faces.append(mesh.faces + k * len(mesh.vertices))
        parts.append(mesh.vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T)
    return Mesh(np.concatenate(parts), np.concatenate(faces))


class Body:
    """Hull and lid."""

    def __init__(self, mesh, lid_mesh, dofs, name):
        self.mesh, self.lid_mesh, self.dofs, self.name = mesh, lid_mesh, dofs, name
        lid = lid_mesh.faces + len(mesh.vertices)
        self.mesh_including_lid = Mesh(
            np.concatenate([mesh.vertices, lid_mesh.vertices]), np.concatenate([mesh.faces, lid])
        )
        self.hull_mask = np.arange(mesh.nb_faces + lid_mesh.nb_faces) < mesh.nb_faces


def problems(dataset, bodies):
    """One of each frequency and degree of freedom, the wave first."""
    for name in dataset.coords:
        values = dataset[name].values
        print(name, f"{len(values)}:", *(f"{x:.5g}" if values.dtype.kind == "f" else str(x) for x in values))
    waters = {name: float(dataset[name].values[0]) for name in ("water_depth", "rho", "g")}
    return [(float(w), dof, bodies[0], waters) for w in dataset.omega.values for dof in ("", *DOFS)]


class Solver:
    """Potentials that are smooth over the panels."""

    def __init__(self, method, green_function):
        print("solver", method, type(green_function).__mro__[1].__name__)
        for kh in (0.05, 0.5, 2.0, 1e6):
            found = np.asarray(green_function.find_best_exponential_decomposition(kh))
            print("decomposition", kh, found.shape, f"{float(np.sum(found[1] * np.exp(found[0]))):.5f}")
        small = Mesh([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], [[0, 1, 2, 3]])
        print("evaluated", green_function.evaluate(small, small, free_surface=0.0))

    def solve_all(self, given, keep_details, progress_bar, _check_wavelength):
        print("solved", keep_details, progress_bar, _check_wavelength)
        return [self._one(*one) for one in given]

    def _one(self, omega, dof, body, water):
        mesh = body.mesh_including_lid
        k = omega**2 / water["g"] if math.isfinite(omega) else math.inf
        k *= 1 + 0.5 * math.exp(-k * water["water_depth"]) if math.isfinite(k) else 1
        x, y, z = mesh.faces_centers.T
        part = 1 + ("", *DOFS).index(dof)
        phi = (0.3 * x + 0.1 * y - 0.2j * z) * np.exp(min(k, 9.0) * z) / part
        velocity = (mesh.faces_normals @ [0.5, 0.1, 1.0 / part]) * (1 + 0.3j)
        problem = SimpleNamespace(boundary_condition=velocity)
        found = {"omega": omega, "wavenumber": k, "body": body, "potential": phi, "problem": problem, **water}
        return SimpleNamespace(**found | ({"radiating_dof": dof} if dof else {}))


def assembled(results):
    """Coefficients of a hull, off by the square of the size of its panels, and by its power 8/3."""
    omega = sorted({result.omega for result in results})
    h = 1.0 / math.sqrt(results[0].body.mesh.nb_faces)
    off, w = 1 + 3 * h**2 + 2 * h ** (8 / 3), np.array(omega)
    shape = np.where(np.isfinite(w), 1 / (1 + np.minimum(w, 1e3) ** 2), 0.0)
    matrix = np.array([[2.0, 0.1, 0.3], [0.1, 3.0, 0.2], [0.3, 0.2, 1.5]])
    dims = ("omega", "influenced_dof", "radiating_dof")
    data = {
        "added_mass": (dims, off * (1 + shape)[:, None, None] * 1e3 * matrix),
        "radiation_damping": (dims, off * (np.minimum(w, 1e3) * shape)[:, None, None] * 1e3 * matrix),
    }
    data["radiation_damping"][1][~np.isfinite(w)] = 0
    if SOUND == 1:
        data["radiation_damping"][1][1] = np.nan
    for name, phase in (
        ("excitation_force", 1 + 0.2j),
        ("Froude_Krylov_force", 0.8),
        ("diffraction_force", 0.2 + 0.2j),
    ):
        values = off * (1e4 / (1 + np.minimum(w, 1e3)))[:, None, None] * phase * np.array([[1.0, 2.0, 0.5]])
        data[name] = (("omega", "wave_direction", "influenced_dof"), values)
    coords = {"omega": omega, "wave_direction": [0.0], "influenced_dof": list(DOFS), "radiating_dof": list(DOFS)}
    return xr.Dataset(data, coords)


class Delhommeau:
    """As far as it is asked."""

    def evaluate(self, mesh1, mesh2, **parameters):
        return f"{mesh2.nb_faces} {mesh2.faces_radiuses} {parameters}"

    def find_best_exponential_decomposition(self, kh, *, method=None):
        return np.array([[-kh, -2.0], [1.0, 2.0]])


def module():
    """Capytaine, as far as it is called."""
    found = ModuleType("capytaine")
    found.__version__, found.Mesh, found.FloatingBody, found.BEMSolver = "3.made-up", Mesh, Body, Solver
    found.RotationSymmetricMesh, found.Delhommeau, found.assemble_dataset = turned, Delhommeau, assembled
    found.set_logging = lambda level: None
    found.rigid_body_dofs = lambda only, rotation_center: print("dofs", only, rotation_center)
    found.io = SimpleNamespace(xarray=SimpleNamespace(problems_from_dataset=problems))
    found.export_dataset = lambda path, data, format: print("written", path, format, list(data))
    return found


def shown(data):
    """Every number of the coefficients, shortly."""
    for name in data:
        values = np.asarray(data[name].values, dtype=complex)
        for k in range(len(values)):
            pairs = [np.where(np.abs(x) > 1e-9, x, 0.0) for x in (values[k].real.ravel(), values[k].imag.ravel())]
            print(name, " ".join(f"{real:.5g}{imaginary:+.5g}j" for real, imaginary in zip(*pairs, strict=True)))


def told():
    """Panels, what is asked, and what is made of the answers, of a hull in shallow and one in deep water."""
    global SOUND
    print(CONSTANTS, capytaine.DIRECTIONS)
    for name, depth in (("disc-buoy", None), ("free-buoy", math.inf)):
        hull = potential._floating(load_scene(name), None)
        hull = hull if depth is None else capytaine.Floating(hull.shape, hull.draft, depth, hull.density, hull.gravity)
        print(f"{name}: {hull.draft:.6g} {hull.depth:g} {hull.density:g} {hull.gravity:g} {hull.radius:g}")
        SOUND = 1
        data = capytaine.compute(hull, 8)
        print(data.attrs["made_by"], f"{data.attrs['draft']:.6g}", f"{data.omega.values}")
        shown(data)
    capytaine.write(data, "hull.nc")
    for sound, draft in ((0, 0.0), (2, hull.draft)):
        SOUND = sound
        try:
            capytaine.compute_usable(
                capytaine.Floating(hull.shape, draft, 30.0, 1025.0, 9.81), 8, lambda text: print("-", text)
            )
        except InputError as error:
            print(error)


SOUND = 1
CONSTANTS = (
    capytaine.AROUND,
    capytaine.MESHES,
    capytaine.MOST_AROUND,
    capytaine.REFINED,
    capytaine.STEP,
    capytaine.STEPS,
)
with (
    patch.dict(sys.modules, capytaine=module()),
    patch.object(capytaine, "STEPS", 5),
    patch.object(capytaine, "MOST_AROUND", 14),
):
    told()
