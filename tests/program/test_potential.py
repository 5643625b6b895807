"""`dolfbuoy potential`: hull meshes, the command without Capytaine, and with it if installed.

Source: areas and volumes of bodies of revolution; eigenfunction matching of a truncated cylinder (Yeung 1981); Hulme's
hemisphere; the integrand of Green's function by mpmath.
"""

import builtins
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
import xarray as xr
from helpers import reference

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.commands.potential import _floating
from dolfbuoy.errors import InputError
from dolfbuoy.formats import capytaine
from dolfbuoy.formats.capytaine import Floating, compute, compute_usable, meridian
from dolfbuoy.meshes import HullShape

CYLINDER = Floating(HullShape(((0.0, 2.0), (1.6, 2.0))), 0.8, 20.0, 1025.0, 9.81)
STEPPED = Floating(HullShape(((0.0, 1.0), (0.4, 1.0), (0.4, 3.0), (1.2, 2.0))), 0.8, math.inf, 1025.0, 9.81)


def test_outline_of_the_wet_hull():
    assert CYLINDER.outline == pytest.approx(np.array([[0, -0.8], [1, -0.8], [1, 0]]))
    expected = [[0, -0.8], [0.5, -0.8], [0.5, -0.4], [1.5, -0.4], [1.25, 0.0]]
    assert STEPPED.outline == pytest.approx(np.array(expected))
    assert STEPPED.radius == 1.5


@pytest.mark.parametrize("hull", [CYLINDER, STEPPED])
def test_points_along_an_outline(hull):
    """They keep its corners, have twice as many pieces on the finer mesh, and become shorter towards edges."""
    coarse, fine = meridian(hull.outline, 0.2), meridian(hull.outline, 0.2, 2)
    assert len(fine) - 1 == 2 * (len(coarse) - 1)
    for points in (coarse, fine):
        for corner in hull.outline:
            assert np.linalg.norm(points - corner, axis=1).min() < 1e-12
    r, z = fine.T
    cones = math.pi / 3 * np.sum((r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) * np.diff(z))
    assert cones == pytest.approx(hull.shape.volume(hull.draft), rel=1e-12)
    lengths = np.linalg.norm(np.diff(fine, axis=0), axis=1)
    assert lengths[-1] < lengths[-3]


def test_without_capytaine(monkeypatch):
    real = builtins.__import__

    def none(name, *rest, **more):
        if name == "capytaine":
            raise ModuleNotFoundError("No module named 'capytaine'")
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(InputError, match=r"Capytaine is not installed: pip install 'dolfbuoy\[potential\]'"):
        compute(CYLINDER)


@pytest.fixture
def file():
    path = Path(dolfbuoy.__file__).parent / "scenes" / "calm-buoy.nc"
    with xr.open_dataset(path, engine="netcdf4") as data:
        return data.load()


def _below_zero(data):
    """With a damping of heave below zero in the shortest wave."""
    found, heave = data.copy(deep=True), {"influenced_dof": "Heave", "radiating_dof": "Heave"}
    shortest = float(found.omega[np.isfinite(found.omega)].max())
    largest = float(found.radiation_damping.sel(heave).max())
    found.radiation_damping.loc[heave | {"omega": shortest}] = -0.2 * largest
    return found


def test_finer_where_a_scene_would_refuse(monkeypatch, file):
    """The command's own rule is that of scenes: a damping below zero is not written."""
    taken, said = [], []

    def made(hull, around, progress):
        taken.append(around)
        return file if around > 40 else _below_zero(file)

    monkeypatch.setattr(capytaine, "compute", made)
    assert compute_usable(CYLINDER, 24, said.append) is file
    assert taken == [24, 34, 48]
    assert "of 34 panels around the axis: damping must not be below 0, as that of heave is" in said[1]


def test_refused_where_the_finest_are_too_coarse(monkeypatch, file):
    monkeypatch.setattr(capytaine, "compute", lambda *_: _below_zero(file))
    with pytest.raises(InputError, match=r"of 80 panels around the axis: damping .* as that of heave is"):
        compute_usable(CYLINDER, 60, lambda sentence: None)


def test_limit_of_meshes():
    """Errors of the powers that are named are taken out, of as many meshes as there are."""
    sizes = [1 / n for n in capytaine.MESHES]

    def of(value):
        return xr.Dataset({name: ("x", [value, 2 * value]) for name in capytaine.NAMES})

    whole = [of(3.0 + 0.4 * h**2 - 0.7 * h ** (8 / 3)) for h in sizes]
    assert capytaine._limit(whole, 3).added_mass.values == pytest.approx([3.0, 6.0], rel=1e-13)
    assert capytaine._limit([of(3.0 + 0.4 * h**2) for h in sizes[1:]], 2).mean_drift.values == pytest.approx([3.0, 6.0])


@pytest.mark.parametrize("kh", [0.2, 0.7, 3.0, 18.3, 400.0])
def test_exponentials_of_the_bed(kh):
    """They add up to the integrand, which falls to its limit 2, without its pole, by the exact digits of mpmath."""
    for x in (0.013, 0.4, 2.77, 9.3, 31.0):
        with mpmath.workdps(60):
            K = mpmath.mpf(kh) * mpmath.tanh(kh)
            pole = (1 + mpmath.tanh(kh)) ** 2 / (1 - mpmath.tanh(kh) ** 2 + mpmath.tanh(kh) / kh) / (x - mpmath.mpf(kh))
            whole = (x + K) * mpmath.exp(x) / (x * mpmath.sinh(x) - K * mpmath.cosh(x)) - pole - 2
        found = capytaine.amplitudes(kh) @ np.exp(capytaine.RATES * x)
        assert found == pytest.approx(float(whole), abs=2.5e-5)


@pytest.mark.slow
def test_a_keel_below_a_disc():
    """Its damping of pitch nearly vanishes in short waves, where the meshes of the usual panels are too coarse."""
    pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    shape, said = HullShape(((0.0, 0.6), (2.0, 0.6), (2.25, 3.0), (3.1, 3.0))), []
    data = compute_usable(Floating(shape, 2.72, 25.0, 1025.0, 9.81), progress=said.append)
    damping = data.radiation_damping.sel(influenced_dof="Pitch", radiating_dof="Pitch").values
    assert damping.min() > -0.05 * damping.max()
    assert not any("Again with" in sentence for sentence in said)


@pytest.mark.slow
def test_with_capytaine(monkeypatch):
    """Coefficients of a cylinder in heave within 2e-4, as the reference has them."""
    pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    monkeypatch.setattr(capytaine, "STEP", 0.5 / math.sqrt(9.81))
    monkeypatch.setattr(capytaine, "STEPS", 6)
    said = []
    data = compute(CYLINDER, progress=said.append)
    case = next(c for c in reference("radiation")["cases"] if c["name"] == "truncated_cylinder_heave")
    heave, exact = {"influenced_dof": "Heave", "radiating_dof": "Heave"}, case["outputs"]
    found = data.sel(heave).sel(omega=case["inputs"]["omega"], method="nearest")
    force = np.abs(data.excitation_force.sel(influenced_dof="Heave").sel(omega=found.omega).values.ravel())
    assert found.added_mass.values == pytest.approx(exact["added_mass"], rel=2e-4)
    assert found.radiation_damping.values == pytest.approx(exact["damping"], rel=2e-4)
    assert force == pytest.approx(exact["excitation"], rel=2e-4)
    at_once = float(data.added_mass.sel(heave).sel(omega=np.inf))
    assert at_once == pytest.approx(exact["added_mass_infinite"], rel=2e-4)
    assert data.attrs["draft"] == 0.8
    assert sum("on the lid" in sentence for sentence in said) == 3


@pytest.mark.slow
def test_hemisphere_with_capytaine(monkeypatch):
    """Half the displaced mass at infinite frequency, exactly; 0.831 of it at none, in deep water (Hulme 1982)."""
    pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    monkeypatch.setattr(capytaine, "STEPS", 2)
    angles = np.linspace(0.0, math.pi / 2, 91)
    outline = [(5 - 5 * math.cos(angle), 10 * math.sin(angle)) for angle in angles[:-1]]
    hull = Floating(HullShape((*outline, (5.0, 10.0), (6.0, 10.0))), 5.0 - 1e-6, math.inf, 1000.0, 9.81)
    data = compute(hull, 24, lambda sentence: None)
    heave = data.added_mass.sel(influenced_dof="Heave", radiating_dof="Heave") / (hull.shape.volume(5.0) * 1000.0)
    assert float(heave[-1]) == pytest.approx(0.5, rel=1e-3)
    kR = data.omega.values[:2] ** 2 / 9.81 * 5.0
    slow = np.column_stack([np.ones(2), 0.75 * kR])  # a source in its water plane: A + 3/4 kR (c - log kR) M
    limit, _ = np.linalg.solve(slow, heave.values[:2] + 0.75 * kR * np.log(kR))
    assert limit == pytest.approx(0.831, rel=1e-3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["driven"], "needs [buoy], [sea] and gravity"),
        (["two-buoys", "--buoy", "third"], "--buoy third: must be one of"),
        (["two-buoys"], "--buoy : must be one of"),
    ],
)
def test_what_it_refuses(arguments, said):
    with pytest.raises(InputError) as caught:
        _floating(load_scene(arguments[0]), *arguments[2:] or [None])
    assert said in str(caught.value)
