"""Readers of files named in a scene, each alone: wrong files are refused, text and units are read as written.

Source: files written here with h5py, netCDF4 and as text; Hermitian matrices with numpy.
"""

import h5py
import numpy as np
import pytest
import xarray as xr

from dolfbuoy.scene import bathymetry, mesh_file, potential_flow, wave_files

READERS = {
    "a spectrum": wave_files.spectrum_of,
    "a current": wave_files.grid_of,
    "a motion": wave_files.motions_of,
    "depths": bathymetry.depths_of,
    "coefficients": potential_flow.potential_flow_of,
}


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_no_reader_follows_a_link(tmp_path, reader):
    """Each looks for links before anything is read."""
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["far"] = h5py.ExternalLink("other.h5", "/a")
    with pytest.raises(ValueError, match="its HDF5 file must hold its numbers itself, and 'far' is a link"):
        reader(tmp_path / "a.nc")


def test_numbers_that_lie_elsewhere(tmp_path):
    """Behind links of any kind, in raw files, or in parts of other data sets; deep in a file too."""

    def raw(group):
        group.create_dataset("x", (4,), "f8", external=[("raw.bin", 0, 32)])

    def virtual(group):
        layout = h5py.VirtualLayout((4,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", (4,))
        group.create_virtual_dataset("x", layout)

    def soft(group):
        group["x"] = h5py.SoftLink("/y")

    def plain(group):
        group["x"] = np.arange(4.0)

    for fill, said in (
        (raw, "those of '%sx' are elsewhere"),
        (virtual, "those of '%sx' are elsewhere"),
        (soft, "'x' is a link"),
        (plain, None),
    ):
        for deep in ("/", "/a/b/"):
            path = tmp_path / f"{fill.__name__}{deep.count('/')}.h5"
            with h5py.File(path, "w") as file:
                file["first"] = np.zeros(2)
                fill(file.require_group(deep))
            if said is None:
                mesh_file.check_netcdf(path)
                continue
            with pytest.raises(ValueError, match="must hold its numbers itself") as error:
                mesh_file.check_netcdf(path)
            assert str(error.value).endswith(said % deep if "%" in said else said)
    (tmp_path / "torn.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(ValueError, match="its HDF5 file cannot be read"):
        mesh_file.check_netcdf(tmp_path / "torn.h5")
    (tmp_path / "old.nc").write_bytes(b"CDF\x01")
    mesh_file.check_netcdf(tmp_path / "old.nc")


BEGINNINGS = {b"\x89HDF\r": True, b"CDF\x01": True, b"CDF\x02": True, b"CDF\x05": True}
BEGINNINGS |= {b"CDF\x03": False, b"0 1\n": False, b"": False}


@pytest.mark.parametrize(("start", "found"), BEGINNINGS.items())
def test_files_that_begin_as_netcdf_does(tmp_path, start, found):
    (tmp_path / "a").write_bytes(start)
    assert wave_files.is_netcdf(tmp_path / "a") == found


def test_columns_of_text(tmp_path):
    """Between blanks, commas or semicolons, with one line of names, comments and empty lines."""
    path = tmp_path / "a.csv"
    path.write_text("\ufefft; eta\n# a remark\n\n0 ,1\n 2;3e0 # more\n4\t.5\n", encoding="utf-8")
    assert wave_files._columns(path, 2) == [[0.0, 1.0], [2.0, 3.0], [4.0, 0.5]]
    for text, said in (
        ("0 1\n2 3 4\n", "line 2 of its file must be 2 numbers"),
        ("0 1\na b\n", "line 2 of its file must be 2 numbers"),
        ("1\n", "line 1 of its file must be 2 numbers"),
        ("a b\n# 1 2\n", "its file must hold rows of 2 numbers"),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=f"^{said}$"):
            wave_files._columns(path, 2)
    path.write_bytes(b"\xff\xfe1 2")
    with pytest.raises(ValueError, match="its file must be text with 2 columns"):
        wave_files._columns(path, 2)


@pytest.mark.parametrize(
    ("units", "seconds"),
    [
        ("s", 1),
        ("seconds since 2000-01-01", 1),
        ("minutes", 60),
        ("hours since noon", 3600),
        ("days", 86400),
        (None, 1),
    ],
)
def test_a_current_over_time_and_depth(tmp_path, units, seconds):
    """Times count from the first one; depths are heights below; axes in any order."""
    u = np.array([[[0.1, 0.2, 0.3]], [[0.4, 0.5, 0.6]]])  # depth, one place, time
    data = xr.Dataset(
        {"uo": (("depth", "x", "time"), u), "vo": (("time", "depth", "x"), 10 * np.transpose(u, (2, 0, 1)))},
        {"time": ("time", [2.0, 3.0, 5.0], {} if units is None else {"units": units}), "depth": [0.0, 9.0]},
    )
    data.to_netcdf(tmp_path / "a.nc")
    expected = [
        [k * seconds, -z, u[j, 0, i], 10 * u[j, 0, i]] for i, k in enumerate((0, 1, 3)) for j, z in enumerate((0, 9))
    ]
    np.testing.assert_allclose(wave_files.grid_of(tmp_path / "a.nc"), expected, rtol=1e-14)


def test_a_grid_of_elevations(tmp_path):
    """In any order of lines and axes; upwards they count as heights."""
    z = np.array([[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]])
    coordinates = {"x": [9.0, 3.0], "y": [0.0, 2.0, 1.0]}
    for name, sign in (("elevation", -1), ("deptho", 1)):
        xr.Dataset({name: (("band", "x", "y"), z)}, coordinates).to_netcdf(tmp_path / f"{name}.nc")
        found = bathymetry.depths_of(tmp_path / f"{name}.nc")
        assert (found["x"], found["y"]) == ([3.0, 9.0], [0.0, 1.0, 2.0])
        assert (sign * np.array(found["depth"])).tolist() == [[4.0, 1.0], [6.0, 3.0], [5.0, 2.0]]


def test_a_directional_spectrum_towards_where_waves_go(tmp_path):
    """Directions are those from which they come, clockwise from north; a density may be per radian."""
    efth = np.array([[1.0, 2.0], [3.0, np.nan]])
    data = xr.Dataset(
        {"efth": (("dir", "freq"), efth, {"units": "m2/Hz/rad"})}, {"freq": [0.2, 0.1], "dir": [300.0, 0.0]}
    )
    data.to_netcdf(tmp_path / "a.nc")
    found = wave_files.spectrum_of(tmp_path / "a.nc")
    assert (found["frequency"], found["direction_deg"]) == ([0.1, 0.2], [270.0, 330.0])
    np.testing.assert_allclose(found["density"], np.radians([[0.0, 2.0], [3.0, 1.0]]), rtol=1e-14)


def test_motions_by_other_names_and_in_radians(tmp_path):
    names = ["time", "surge", "y", "heave", "roll", "pitch", "yaw"]
    columns = {name: ("time", np.array([k, 2.0 + k])) for k, name in enumerate(names) if k}
    columns["pitch"] = ("time", np.array([0.1, 0.2]), {"units": "radian"})
    xr.Dataset(columns, {"time": ("time", [0.5, 1.5])}).to_netcdf(tmp_path / "a.nc")
    expected = [[0.5, 1, 2, 3, 4, np.degrees(0.1), 6], [1.5, 3, 4, 5, 6, np.degrees(0.2), 8]]
    np.testing.assert_allclose(wave_files.motions_of(tmp_path / "a.nc"), expected, rtol=1e-14)


def test_rows_of_a_hermitian_form():
    """Real parts on and above the diagonal, imaginary ones of these below; and back."""
    numbers = np.random.default_rng(3)
    form = numbers.normal(size=(2, 4, 4)) + 1j * numbers.normal(size=(2, 4, 4))
    form = form + form.conj().swapaxes(1, 2)
    data = xr.Dataset({"mean_drift": (("drift_column", "omega", "drift_row"), form.transpose(2, 0, 1))})
    rows = potential_flow._sixteen(data)
    np.testing.assert_allclose(rows[1].reshape(4, 4)[1:3, 1:3], [[form[1, 1, 1].real, form[1, 1, 2].real],
                                                                 [form[1, 1, 2].imag, form[1, 2, 2].real]])  # fmt: skip
    np.testing.assert_allclose(potential_flow.hermitian(rows.tolist()), form, rtol=1e-14)
    with pytest.raises(ValueError, match="its mean_drift must be 4 x 4"):
        potential_flow._sixteen(data.isel(drift_row=slice(0, 3)))


def test_matrices_and_forces_in_rows():
    matrices = np.arange(9.0).reshape(1, 3, 3)
    assert potential_flow._four(matrices).tolist() == [[0.0, 4.0, 8.0, 4.0]]
    assert potential_flow._six(np.array([[1 + 2j, 3 - 4j, 5j]])).tolist() == [[1.0, 2.0, 3.0, -4.0, 0.0, 5.0]]
    data = xr.Dataset(coords={"influenced_dof": ["b__Pitch", "b__Surge", "b__Heave", "b__Yaw"]})
    assert potential_flow._places(data, "influenced_dof") == [1, 2, 0]
    with pytest.raises(ValueError, match="influenced_dof lacks Heave"):
        potential_flow._places(data.isel(influenced_dof=[0, 1, 3]), "influenced_dof")


# -- coefficients that are refused -------------------------------------------------------------------------------------


def coefficients_with(at_once, draft=None, **rows):
    """Twelve frequencies; surge takes 100 from the motion at each, heave and pitch nothing but what is given at one."""
    damping = [[100.0, 0.0, 0.0, 0.0] for _ in range(12)]
    for place, name in enumerate(("surge", "heave", "pitch")):
        damping[5][place] = rows.get(name, damping[5][place])
    return {
        "omega": [float(k) for k in range(1, 13)],
        "added_mass": [[1.0, 1.0, 1.0, 0.0]] * 12,
        "added_mass_infinite": [*map(float, at_once), 0.0],
        "damping": damping,
        "excitation": [[0.0] * 6] * 12,
        "height": 0.0,
        "draft": draft,
    }


@pytest.mark.parametrize(
    ("at_once", "draft", "dof", "least"),
    [
        ((2, 4, 8), None, "surge", -5.0),  # a twentieth of the largest of its own
        ((2, 4, 8), None, "heave", -0.5),  # a twentieth of a twentieth of surge, by the added masses
        ((2, -4, 8), None, "heave", -0.5),
        ((2, 4, 8), None, "pitch", -1.0),
        ((0, 4, 8), None, "heave", -1.0),  # a hull without an added mass: as if it were 1 kg
        ((2, 0, 0), None, "heave", -0.05 * 1e-4 * 100),  # rounding of panels
        ((2, 0, 0), 30.0, "heave", -0.05 * 1e-4 * 100),
        ((2, 0, 0), 30.0, "pitch", -0.05 * 1e-4 * 100 * 900),
        ((2, 0, 0), None, "pitch", 0.0),
    ],
)
def test_how_far_below_zero_a_damping_may_be(at_once, draft, dof, least):
    given = coefficients_with(at_once, draft, **{dof: least * (1 - 1e-9)})
    assert potential_flow.PotentialFlow.model_validate(given).damping[5]
    given = coefficients_with(at_once, draft, **{dof: least * (1 + 1e-6) - 1e-12})
    with pytest.raises(ValueError, match=f"must not be below 0, as that of {dof} is: a hull takes no energy"):
        potential_flow.PotentialFlow.model_validate(given)


@pytest.mark.parametrize("name", ["added_mass", "damping", "excitation", "froude_krylov", "mean_drift"])
def test_rows_of_coefficients_are_those_of_the_frequencies(name):
    given = coefficients_with((1, 1, 1))
    given[name] = [given.get(name, [[0.0] * (16 if name == "mean_drift" else 6)])[0]] * 13
    with pytest.raises(ValueError, match="must hold a row for each of the 12 frequencies"):
        potential_flow.PotentialFlow.model_validate(given)


def test_the_fault_of_coefficients_in_words(monkeypatch):
    """As the refusal of a scene, without the sentence's key where it is of the whole; nothing of what is good."""
    for change, said in (
        ({}, ""),
        ({"damping": coefficients_with((2, 4, 8), heave=-1.0)["damping"]}, "damping must not be below 0, as that of"),
        ({"omega": [2.0, *range(2, 13)]}, "must rise"),
        ({"omega": [1.0]}, "List should have at least 12 items"),
    ):
        monkeypatch.setattr(potential_flow, "_read", lambda data, change=change: coefficients_with((2, 4, 8)) | change)
        found = potential_flow.fault_of(None)
        assert found.startswith(said)
        assert bool(found) == bool(change)

    def none(data):
        raise ValueError("it has no waves along x")

    monkeypatch.setattr(potential_flow, "_read", none)
    assert potential_flow.fault_of(None) == "it has no waves along x"


# -- what a file of Capytaine holds ------------------------------------------------------------------------------------


def of_capytaine(parts=True):
    """Frequencies in any order, motions of a body that has a name, waves along -x and x, real and imaginary parts."""
    rng = np.random.default_rng(2)
    dofs, omega = ["b__Heave", "b__Yaw", "b__Pitch", "b__Surge"], [*np.arange(13.0, 0.0, -1.0), np.inf, 0.0]
    matrix, force = (
        ("omega", "radiating_dof", "influenced_dof"),
        ("complex", "influenced_dof", "omega", "wave_direction"),
    )
    names = ("Froude_Krylov_force", "diffraction_force") if parts else ("excitation_force",)
    data = xr.Dataset(
        {name: (matrix, rng.uniform(1, 2, (15, 4, 4))) for name in ("added_mass", "radiation_damping")}
        | {name: (force, rng.normal(size=(2, 4, 15, 2))) for name in names},
        {"omega": omega, "radiating_dof": dofs, "influenced_dof": dofs[::-1], "wave_direction": [np.pi, 5e-10]},
    )
    return data.expand_dims(water_depth=[20.0], rho=[1000.0], g=[9.81])


@pytest.mark.parametrize("parts", [True, False])
def test_the_table_of_a_file(parts):
    data = of_capytaine(parts).assign_attrs(draft=1.25)
    data["rotation_center"] = "xyz", [0.0, 1e-6, -0.5]
    found = potential_flow._read(data)
    flat = data.squeeze(drop=True).sortby("omega").isel(omega=slice(1, 14))

    def entry(name, mine, caused):
        return flat[name].sel(influenced_dof=f"b__{mine}", radiating_dof=f"b__{caused}").values

    pairs = [("Surge", "Surge"), ("Heave", "Heave"), ("Pitch", "Pitch")]
    for key, name in (("added_mass", "added_mass"), ("damping", "radiation_damping")):
        columns = [entry(name, *pair) for pair in pairs]
        columns.append((entry(name, "Surge", "Pitch") + entry(name, "Pitch", "Surge")) / 2)
        np.testing.assert_allclose(found[key], np.transpose(columns), rtol=1e-14)
    last = data.squeeze(drop=True).sel(omega=np.inf).added_mass
    surge = last.sel(influenced_dof="b__Surge", radiating_dof="b__Surge").item()
    assert (found["added_mass_infinite"][0], len(found["added_mass_infinite"])) == (surge, 4)

    def six(name):
        along = flat[name].isel(wave_direction=1)
        return np.column_stack(
            [
                along.sel(influenced_dof=f"b__{dof}").isel(complex=k)
                for dof in ("Surge", "Heave", "Pitch")
                for k in (0, 1)
            ]
        )

    whole = six("Froude_Krylov_force") + six("diffraction_force") if parts else six("excitation_force")
    np.testing.assert_allclose(found["excitation"], whole, rtol=1e-14)
    assert ("froude_krylov" in found) == parts
    if parts:
        np.testing.assert_allclose(found["froude_krylov"], six("Froude_Krylov_force"), rtol=1e-14)
    assert found["omega"] == [float(k) for k in range(1, 14)]
    assert [found[name] for name in ("height", "draft", "depth", "density")] == [-0.5, 1.25, 20.0, 1000.0]
    assert "mean_drift" not in found


def test_what_a_file_need_not_say():
    """Deep water is no depth; the point is in still water, the density that of the sea."""
    data = of_capytaine().squeeze(drop=True)
    assert not {"draft", "depth", "density"} & set(potential_flow._read(data))
    assert potential_flow._read(data)["height"] == 0.0
    assert "depth" not in potential_flow._read(data.assign_coords(water_depth=np.inf))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.drop_vars("added_mass"), "^added_mass is missing; Capytaine writes it over omega"),
        (
            lambda d: d.drop_vars(["radiation_damping", "diffraction_force"]),
            "^excitation_force, radiation_damping is missing",
        ),
        (lambda d: d.assign_coords(wave_direction=[1.1e-9, 2.0]), "no waves along x"),
        (lambda d: d.assign(rotation_center=("xyz", [1.1e-6, 0, 0])), "must lie on the axis"),
        (lambda d: d.assign(rotation_center=("xyz", [0, -1.1e-6, 0])), "must lie on the axis"),
        (lambda d: d.assign(rotation_center=("two", [0.0, 0.0])), "must lie on the axis"),
        (lambda d: d.isel(omega=slice(0, 13)), "lacks omega = inf"),
        (
            lambda d: d.assign(added_mass=d.added_mass * np.nan, radiation_damping=d.added_mass * np.inf),
            "those of added_mass and added_mass_infinite and damping are not",
        ),
    ],
)
def test_files_without_what_they_must_have(change, said):
    with pytest.raises(ValueError, match=said):
        potential_flow._read(change(of_capytaine()))
