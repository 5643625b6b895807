"""Coefficients of WAMIT and Nemoh, read with the example code in the README of `formats`.

Source: a Capytaine file and Capytaine's exports of it in the formats of WAMIT and Nemoh; a hull of a few panels.
"""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers import REFERENCE

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.check import check

README = Path(dolfbuoy.__file__).parent / "formats" / "README.md"
WAMIT, RESULTS, NEMOH = re.findall(
    r"```python\n(.*?)```", README.read_text().split("## Coefficients of WAMIT")[1], re.DOTALL
)
CYLINDER = {
    "sea": {"depth": 20.0, "density": 1025.0},
    "buoy": {"hull": [[0.0, 2.0], [1.6, 2.0]], "mass": 2576.1, "center_of_mass": 0.6, "inertia": [1500.0, 1300.0]},
    "time": {"end": 1.0, "step": 0.1},
}


def warnings_of(path):
    scene = load_scene(CYLINDER | {"buoy": CYLINDER["buoy"] | {"potential_flow": str(path)}})
    return scene.buoys[0].potential_flow, [w for w in check(scene).warnings if "potential_flow" in w]


def as_wamit(data, folder, signs=1):
    """buoy.1 and buoy.3 of a file, as WAMIT writes numbers; signs -1: of exp(-i omega t)."""
    numbers = {"Surge": 1, "Heave": 3, "Pitch": 5}
    radiated, waves = [], []
    for w in data.omega.values:
        of, period = data.sel(omega=w), 0.0 if np.isinf(w) else 2 * np.pi / w
        for one, i in numbers.items():
            for two, j in numbers.items():
                pair = of.sel(influenced_dof=one, radiating_dof=two)
                row = f"{period:.8e} {i} {j} {float(pair.added_mass) / 1025.0:.8e}"
                row += f" {float(pair.radiation_damping) / (1025.0 * w):.8e}" if period else ""
                radiated.append(row)
            if period:
                re_, im = of.excitation_force.sel(influenced_dof=one).isel(wave_direction=0).values / (1025.0 * 9.81)
                size, turned = np.hypot(re_, im), -signs * np.degrees(np.arctan2(im, re_))
                waves.append(f"{period:.8e} 0.0 {i} {size:.8e} {turned:.6f} {re_:.8e} {-signs * im:.8e}")
    (folder / "buoy.1").write_text("\n".join(radiated) + "\n")
    (folder / "buoy.3").write_text("\n".join(waves) + "\n")


def test_wamit(tmp_path, monkeypatch):
    """What comes back is what went, and check has nothing to say; of phases of another sign it has."""
    monkeypatch.chdir(tmp_path)
    with xr.open_dataset(REFERENCE / "truncated_cylinder.nc") as data:
        as_wamit(data.load(), tmp_path)
        exec(WAMIT, {})
        found, said = warnings_of(tmp_path / "buoy.nc")
        known = load_scene(
            CYLINDER | {"buoy": CYLINDER["buoy"] | {"potential_flow": str(REFERENCE / "truncated_cylinder.nc")}}
        )
        expected = known.buoys[0].potential_flow
        for name in ("omega", "added_mass", "added_mass_infinite", "damping", "excitation"):
            values = np.array(getattr(expected, name))
            assert np.array(getattr(found, name)) == pytest.approx(values, abs=1e-5 * np.abs(values).max()), name
        assert said == []
        as_wamit(data, tmp_path, signs=-1)
        (tmp_path / "buoy.nc").unlink()
        exec(WAMIT, {})
    assert any("its phases are of exp(+i omega t)" in sentence for sentence in warnings_of(tmp_path / "buoy.nc")[1])


@pytest.mark.slow
def test_wamit_of_capytaine(tmp_path, monkeypatch):
    """Files that Capytaine itself writes as WAMIT's."""
    pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    from capytaine.io.wamit import export_wamit_1, export_wamit_3

    monkeypatch.chdir(tmp_path)
    with xr.open_dataset(REFERENCE / "truncated_cylinder.nc") as data:
        whole = data.load().assign_coords(forward_speed=0.0, rho=1025.0, g=9.81)
        whole = whole.assign_coords(period=("omega", 2 * np.pi / whole.omega.values))
        force = whole.excitation_force
        whole["excitation_force"] = force.isel(complex=0) + 1j * force.isel(complex=1)
    export_wamit_1(whole, "buoy.1")
    export_wamit_3(whole, "buoy.3")
    exec(WAMIT, {})
    found, said = warnings_of(tmp_path / "buoy.nc")
    assert found.excitation[3][2] == pytest.approx(float(whole.excitation_force.values[3, 0, 1].real), rel=1e-5)
    assert said == []


def as_nemoh(data, folder):
    """Three files of a file, as Nemoh 2 writes its results."""
    names, table = ["Surge", "Heave", "Pitch"], "".join(f'"A   1   {i}" "B   1   {i}"\n' for i in (1, 3, 5))
    finite = data.isel(omega=np.isfinite(data.omega.values))

    def rows(first, *columns):
        pairs = np.stack(columns, axis=-1).reshape(len(first), -1)
        return "".join(" " + " ".join(f"{x:14.7E}" for x in row) + "\n" for row in np.column_stack([first, pairs]))

    radiated, impulse = (f'VARIABLES="{first}"\n{table}' for first in ("w (rad/s)", "Time (s)"))
    for k, name in enumerate(names, 1):
        of = data.sel(radiating_dof=name, influenced_dof=names)
        A, B = (of[x].transpose("omega", "influenced_dof").values for x in ("added_mass", "radiation_damping"))
        title = f'Zone t="Motion of body    1 in DoF   {k}",I={finite.sizes["omega"]:6d},F=POINT\n'
        radiated += title + rows(finite.omega.values, A[:-1], B[:-1])
        impulse += title + rows(np.array([0.0, 0.1]), A[[-1, -1]], 0.3 * A[[-1, -1]])
    force = finite.excitation_force.isel(wave_direction=0).sel(influenced_dof=names)
    force = force.transpose("omega", "influenced_dof", "complex").values @ [1, 1j]
    wave = 'VARIABLES="w (rad/s)"\n' + '"abs(F   1   1)" "angle(F   1   1)"\n' * 3
    for beta in (0.0, 90.0):
        wave += f'Zone t="Diffraction force - beta = {beta:.3f} deg",I={len(force):6d},F=POINT\n'
        wave += rows(finite.omega.values, (1 + beta) * np.abs(force), np.angle(force))
    (folder / "results").mkdir()
    for name, text in (("RadiationCoefficients", radiated), ("ExcitationForce", wave), ("IRF", impulse)):
        (folder / "results" / f"{name}.tec").write_text(text)


@pytest.mark.parametrize("writer", ["Nemoh", pytest.param("Capytaine", marks=pytest.mark.slow)])
def test_results_of_nemoh(writer, tmp_path, monkeypatch):
    """What comes back is what went; with files of Capytaine's own writer in place of two of them too."""
    monkeypatch.chdir(tmp_path)
    with xr.open_dataset(REFERENCE / "truncated_cylinder.nc") as data:
        data.load()
        as_nemoh(data, tmp_path)
        if writer == "Capytaine":
            pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
            from capytaine.io.legacy import write_dataset_as_tecplot_files

            names = ["Surge", "Heave", "Pitch"]
            one = data.isel(omega=np.isfinite(data.omega.values)).sel(influenced_dof=names, radiating_dof=names)
            one["diffraction_force"] = one.excitation_force.isel(complex=0) + 1j * one.excitation_force.isel(complex=1)
            one["Froude_Krylov_force"] = 0 * one.diffraction_force
            write_dataset_as_tecplot_files(tmp_path / "results", one.drop_vars("excitation_force"))
    exec(RESULTS, {})
    found, said = warnings_of(tmp_path / "buoy.nc")
    known = CYLINDER["buoy"] | {"potential_flow": str(REFERENCE / "truncated_cylinder.nc")}
    expected = load_scene(CYLINDER | {"buoy": known}).buoys[0].potential_flow
    for name in ("omega", "added_mass", "added_mass_infinite", "damping", "excitation"):
        values = np.array(getattr(expected, name))
        assert np.array(getattr(found, name)) == pytest.approx(values, abs=1e-5 * np.abs(values).max()), name
    assert said == []


@pytest.mark.slow
def test_nemoh(tmp_path, monkeypatch):
    """A case of few panels: added mass in heave within 10 % of the cylinder's, and a file that a scene takes."""
    cpt = pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    monkeypatch.chdir(tmp_path)
    mesh = cpt.mesh_vertical_cylinder(length=1.6, radius=1.0, center=(0, 0, 0), resolution=(6, 16, 8)).immersed_part()
    rows = ["2 0"]
    rows += [f"{n} {x:.6f} {y:.6f} {z:.6f}" for n, (x, y, z) in enumerate(mesh.vertices, 1)] + ["0 0 0 0"]
    rows += [" ".join(str(k + 1) for k in face) for face in mesh.faces] + ["0 0 0 0"]
    (tmp_path / "buoy.dat").write_text("\n".join(rows) + "\n")
    moved = ["1 1. 0. 0. 0. 0. 0.", "1 0. 0. 1. 0. 0. 0.", "2 0. 1. 0. 0. 0. 0."]
    case = ["--- Environment", "1025.0", "9.81", "20.0", "0. 0.", "--- Bodies", "1", "--- Body 1", "buoy.dat"]
    case += [f"{mesh.nb_vertices} {mesh.nb_faces}", "3", *moved, "3", *moved, "0"]
    case += ["--- Cases", "1 20 0.3 6.0", "1 0. 0.", "--- Post", "0 0.1 10.", "0", "0 0. 180.", "0 50 400. 400."]
    (tmp_path / "Nemoh.cal").write_text("\n".join(case) + "\n")
    exec(NEMOH, {})
    found, _ = warnings_of(tmp_path / "buoy.nc")
    assert len(found.omega) == 20
    assert found.added_mass_infinite[1] == pytest.approx(1854.0, rel=0.1)
    assert found.depth == 20.0
