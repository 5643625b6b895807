"""Response of a disc and of `free-buoy` to waves against potential flow, and coefficients read from Capytaine's file.

Source: Capytaine 3.0, a boundary element method (tests/reference).
"""

import math
import shutil

import h5py
import numpy as np
import pytest
import xarray as xr
from helpers import REFERENCE, reference

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.linear.potential_flow import read_capytaine
from dolfbuoy.linear.seaway import responses

RHO = 1025.0
PERIODS = [5.0, 6.0, 8.0, 12.0, 20.0]
HULL = reference("hull")


def scene_of(name):
    """The body of the reference, its coefficients chosen for A11, A33 and A55 about C as said there."""
    case = HULL[f"rao_capytaine_{name}"]["input"]
    given = case["strip_coefficients"]
    if name == "disc":
        coefficients = {key: given[key] for key in ("added_mass", "axial_added_mass", "rotational_added_mass")}
    else:  # the volume of disc and cone up to the water line is that of half a sphere over it; A55 comes from A11, A33
        radius = 1.0 + 0.2 * case["draft"] / 0.3
        axial = given["A33_kg"] / (RHO * 2 / 3 * math.pi * radius**3)
        coefficients = {"added_mass": given["added_mass"], "axial_added_mass": axial}
    body = {"hull": case["hull"], "mass": case["mass"], "center_of_mass": case["z_C"], "inertia": case["inertia"]}
    return load_scene({"sea": {"depth": 1000.0, "density": RHO}, "buoy": body | coefficients})


@pytest.mark.parametrize("name", ["disc", "free-buoy"])
def test_response(name):
    """Surge, heave and pitch, amplitude and phase, within 3 % of |X| from 5 s on."""
    exact = HULL[f"rao_capytaine_{name}"]["expected"]
    for found in responses(scene_of(name), PERIODS):
        expected = np.array([complex(*x) for x in exact[f"{found.period:.0f}"]])
        mine = np.array([found.motions.surge, found.motions.heave, found.motions.pitch])
        assert np.all(np.abs(mine - expected) < 0.03 * np.abs(expected)), found.period


def test_coefficients_of_a_file():
    """A disc's file: with its mass and stiffness the response agrees with the finer mesh, to the panels' 1 %."""
    case = HULL["rao_capytaine_disc"]
    mass, radius = case["input"]["mass"], 1.5
    stiffness = RHO * 9.81 * math.pi * radius**2
    GM = 0.25 + radius**2 / (4 * 0.5) - 0.5
    flow = read_capytaine(REFERENCE / "disc.nc")
    assert flow.rotation_height == 0
    assert math.isinf(flow.depth)
    found = flow.responses((mass, mass, 2500.0), (0.0, stiffness, mass * 9.81 * GM))
    assert flow.periods == pytest.approx([20, 15, 10, 8, 6, 5, 4])
    for period, X in zip(flow.periods, found, strict=True):
        expected = np.array([complex(*x) for x in case["expected"][f"{period:.0f}"]])
        assert np.all(np.abs(X - expected) < 0.01 * np.abs(expected)), period


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: data.drop_vars("added_mass"), "added_mass is missing"),
        (lambda data: data.isel(influenced_dof=[0, 1]), "lacks Pitch"),
        (lambda data: data.assign_coords(wave_direction=[1.0]), "no waves along x"),
        (lambda data: data.assign(added_mass=data.added_mass * np.nan), "no finite positive numbers"),
        (lambda data: data.assign_coords(omega=data.omega - data.omega.min()), "no finite positive numbers"),
        (lambda data: data.assign(rotation_center=1.0), "not a netCDF file"),
        (lambda data: data.assign(water_depth=("x", [1.0, 2.0])), "not a netCDF file"),
        (lambda data: data.isel(complex=[0]), "not a netCDF file"),
    ],
)
def test_files_that_do_not_serve(change, said, tmp_path):
    with xr.open_dataset(REFERENCE / "disc.nc") as data:
        change(data.load()).to_netcdf(tmp_path / "changed.nc")
    with pytest.raises(InputError, match=said):
        read_capytaine(tmp_path / "changed.nc")
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(InputError, match="not a netCDF file"):
        read_capytaine(tmp_path / "text.nc")


def test_force_in_two_parts_and_names_with_the_body(tmp_path):
    """Files with Froude-Krylov and diffraction forces, and with the dofs of one body of several."""
    whole = read_capytaine(REFERENCE / "disc.nc")
    with xr.open_dataset(REFERENCE / "disc.nc") as data:
        parts = data.load().rename(excitation_force="Froude_Krylov_force")
    parts["diffraction_force"] = 0.25 * parts.Froude_Krylov_force
    for kind in ("influenced_dof", "radiating_dof"):
        parts[kind] = [f"disc__{name}" for name in parts[kind].values]
    parts.isel(influenced_dof=[2, 0, 1], omega=[3, 0]).to_netcdf(tmp_path / "parts.nc")
    found = read_capytaine(tmp_path / "parts.nc")
    np.testing.assert_allclose(found.force, 1.25 * whole.force[[0, 3]])
    np.testing.assert_allclose(found.added_mass, whole.added_mass[[0, 3]])
    np.testing.assert_allclose(found.damping, whole.damping[[0, 3]])


def test_numbers_of_another_file_are_not_read(tmp_path):
    """An HDF5 link in an untrusted file to another file."""
    with xr.open_dataset(REFERENCE / "disc.nc") as data:
        data.load().to_netcdf(tmp_path / "whole.nc", engine="netcdf4")
    shutil.copy(tmp_path / "whole.nc", tmp_path / "linked.nc")
    read_capytaine(tmp_path / "linked.nc")
    with h5py.File(tmp_path / "linked.nc", "a") as file:
        del file["added_mass"]
        file["added_mass"] = h5py.ExternalLink(str(tmp_path / "whole.nc"), "added_mass")
    with pytest.raises(InputError, match="must hold its numbers itself"):
        read_capytaine(tmp_path / "linked.nc")
