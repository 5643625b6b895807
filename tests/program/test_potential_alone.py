"""Hull coefficients, each part alone: meshes, the Green function with a bed, limits, and waves far from a hull.

Source: circles, images in the bed, ring waves and integrals by hand; stand-ins for Capytaine.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad

from dolfbuoy import InputError
from dolfbuoy.formats import capytaine
from dolfbuoy.formats.capytaine import Floating, meridian
from dolfbuoy.meshes import HullShape

CYLINDER = Floating(HullShape(((0.0, 2.0), (1.6, 2.0))), 0.8, 20.0, 1025.0, 9.81)


# -- Green's function --------------------------------------------------------------------------------------------------


class Delhommeau:
    """What Capytaine's own is asked for."""

    def evaluate(self, mesh1, mesh2, **parameters):
        return mesh1, mesh2.faces_radiuses, mesh2.faces_areas, mesh2.mesh, parameters

    def find_best_exponential_decomposition(self, kh, *, method=None):
        return "own", kh, method


GREEN = capytaine._green_function(Fake(Delhommeau=Delhommeau))


def test_panels_are_integrated_exactly_twenty_times_as_far():
    mesh = Fake(faces_radiuses=np.array([1.0, 2.0]), faces_areas=3.0)
    first, radiuses, areas, own, parameters = GREEN.evaluate("one", mesh, wavenumber=4.0)
    assert (first, radiuses.tolist(), areas, own) == ("one", [20.0, 40.0], 3.0, mesh)
    assert parameters == {"wavenumber": 4.0}


def test_the_bed_in_waves_of_no_length_is_its_images():
    """2 sum (-1)^(n+1) exp(-2nx) of 30 terms, the last one halved."""
    expected = [[-2.0 * n for n in range(1, 31)], [2.0, -2.0] * 15]
    expected[1][-1] = -1.0
    for kh in (1e5, math.inf):
        assert GREEN.find_best_exponential_decomposition(kh).tolist() == expected
    rates, sizes = expected
    assert np.dot(sizes, np.exp(np.multiply(rates, 0.5))) == pytest.approx(2 / (1 + math.e), rel=1e-9)
    assert sum(sizes) == 1.0  # as 2/(1 + exp(0))


def test_which_decomposition_of_the_bed_is_taken():
    for kh in (0.05, 0.1):
        assert GREEN.find_best_exponential_decomposition(kh, method="m") == ("own", kh, "m")
    for kh in (0.11, 99999.0):
        rates, sizes = GREEN.find_best_exponential_decomposition(kh, method="m")
        assert rates.tolist() == capytaine.RATES.tolist()
        assert sizes.tolist() == capytaine.amplitudes(kh).tolist()
    assert (rates[0], rates[-1], len(rates)) == (-0.02, pytest.approx(-40.0), 20)


# -- meshes ------------------------------------------------------------------------------------------------------------


def made(around, finer, hull=CYLINDER):
    """What `_body` asks Capytaine for."""
    module = Fake(
        Mesh=lambda vertices, faces: (vertices, faces),
        RotationSymmetricMesh=lambda mesh, n: (*mesh, n),
        rigid_body_dofs=lambda only, rotation_center: (only, rotation_center),
        FloatingBody=lambda **parts: parts,
    )
    return capytaine._body(module, hull, around, finer)


@pytest.mark.parametrize(("finer", "rows", "rings"), [(1, 5 + 4, 5), (2, 10 + 8, 10)])
def test_a_mesh_of_a_hull_and_its_lid(finer, rows, rings):
    """Panels 1/1.2 as high as 2 pi/24 = 0.262 m wide: 1 m has 5 (4.58), 0.8 m has 4 (3.67)."""
    body = made(24, finer)
    assert (body["name"], body["dofs"]) == ("hull", (["Surge", "Heave", "Pitch"], (0.0, 0.0, 0.0)))
    (hull, faces, n), (lid, lid_faces, lid_n) = body["mesh"], body["lid_mesh"]
    assert (len(faces), len(hull), n) == (rows, 2 * (rows + 1), 24 * finer)
    assert (len(lid_faces), len(lid), lid_n) == (rings, 2 * (rings + 1), 24 * finer)
    angle = 2 * math.pi / (24 * finer)
    wide = math.sqrt(angle / math.sin(angle))  # triangles R^2 sin(angle)/2 have the area of a sector
    first, second = np.split(lid, 2)
    np.testing.assert_allclose(first, [[wide * k / rings, 0.0, 0.0] for k in range(rings + 1)], atol=1e-15)
    turn = [math.cos(angle), math.sin(angle)]
    np.testing.assert_allclose(second, [[*np.multiply(wide * k / rings, turn), 0] for k in range(rings + 1)])
    assert lid_faces[1].tolist() == [1, rings + 2, rings + 3, 2]
    first, second = np.split(hull, 2)
    np.testing.assert_allclose(np.hypot(*second[:, :2].T), first[:, 0], atol=1e-15)
    np.testing.assert_allclose([first[0], first[-1]], [[0, 0, -0.8], [wide, 0, 0]], atol=1e-12)


def test_a_small_water_plane_has_two_rings():
    neck = Floating(HullShape(((0.0, 2.0), (1.0, 2.0), (1.0, 0.2), (3.0, 0.2))), 2.0, 20.0, 1025.0, 9.81)
    assert len(made(8, 1, neck)["lid_mesh"][1]) == 2


def test_points_along_an_outline_by_hand():
    """From the axis as the sine of even steps, between edges as their cosine; corners of 20 degrees are none."""
    found = meridian(np.array([[0.0, -1.0], [3.0, -1.0], [3.0, 1.0]]), 1.0)
    r = [3 * math.sin(math.pi / 2 * k / 3) for k in range(4)]
    np.testing.assert_allclose(found, [[x, -1.0] for x in r] + [[3.0, 0.0], [3.0, 1.0]], atol=1e-12)
    for angle, edge in ((19.0, False), (21.0, True)):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        found = meridian(np.array([[0.0, 0.0], [1.0, 0.0], [1 + c, s]]), 1.0)
        assert (np.linalg.norm(found - [1.0, 0.0], axis=1).min() < 1e-12) == edge
        assert len(found) == 3
    few = meridian(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 9.0)
    np.testing.assert_allclose(few, [[0, 0], [1, 0], [1, 1]], atol=1e-12)


def test_an_outline_has_no_point_twice():
    """Where a hull begins with a point, or the water ends at a step."""
    pointed = Floating(HullShape(((0.0, 0.0), (1.0, 2.0), (1.0, 3.0), (2.0, 3.0))), 1.0, 20.0, 1025.0, 9.81)
    assert pointed.outline.tolist() == [[0.0, -1.0], [1.0, 0.0]]
    assert pointed.radius == 1.0
    deep = Floating(pointed.shape, 1.5, 20.0, 1025.0, 9.81)
    assert deep.outline.tolist() == [[0.0, -1.5], [1.0, -0.5], [1.5, -0.5], [1.5, 0.0]]


@pytest.mark.parametrize("draft", [0.0, 1.6, 2.0, -0.1])
def test_a_hull_that_does_not_cut_the_surface(monkeypatch, draft):
    monkeypatch.setattr(capytaine, "capytaine", lambda: None)
    with pytest.raises(InputError, match="must cut the water surface at rest, or it makes no such waves"):
        capytaine.compute(Floating(CYLINDER.shape, draft, 20.0, 1025.0, 9.81))


def test_how_far_a_mesh_is_from_the_limit():
    """The larger one of surge and heave, each over its own largest number; nothing of what is no number."""
    numbers = {"Surge": ([1.0, np.nan, 4.0], [1.0, 2.0, 5.0]), "Heave": ([10.0, 9.0, 3.0], [10.0, 10.0, 0.0])}
    dofs = list(numbers)

    def data(which, name="added_mass"):
        values = np.full((3, 2, 2), 1e3)
        for i, dof in enumerate(dofs):
            values[:, i, i] = numbers[dof][which]
        dims, at = ("omega", "radiating_dof", "influenced_dof"), {"radiating_dof": dofs, "influenced_dof": dofs}
        if name == capytaine.WHOLE:
            values, dims = np.stack([values[:, 0, 0], 1j * values[:, 1, 1]], axis=1), ("omega", "influenced_dof")
            del at["radiating_dof"]
        return xr.Dataset({name: (dims, values)}, {"omega": [1.0, 2.0, 3.0], **at})

    for name in ("added_mass", capytaine.WHOLE):
        fine, kept = data(0, name), data(1, name)
        assert capytaine._apart(fine, kept, name) == pytest.approx(0.3)  # heave: 3 of 10; surge: 1 of 5
        assert capytaine._apart(fine, kept.isel(omega=[0, 1]), name) == pytest.approx(0.1)


# -- far from the hull -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("k", "h"), [(0.7, 2.0), (0.7, math.inf), (2.5, 1.0), (0.05, 4.0)])
def test_weight_of_a_depth(k, h):
    """1 over twice the integral of (cosh k(z+h)/cosh kh)^2."""
    omega = math.sqrt(9.79 * k * math.tanh(k * h))
    low = -h if math.isfinite(h) else -40 / k
    whole, _ = quad(
        lambda z: (math.exp(k * z) if math.isinf(h) else math.cosh(k * (z + h)) / math.cosh(k * h)) ** 2, low, 0
    )
    found = capytaine.weight(Fake(wavenumber=k, water_depth=h, omega=omega, g=9.79))
    assert found == pytest.approx(1 / (2 * whole), rel=1e-7)


@pytest.mark.parametrize("h", [3.0, math.inf])
def test_waves_of_panels(h):
    """Two panels of the hull, and one of the lid that has no part: differences of E give its slope along normals."""
    k, centers = 0.6, np.array([[0.5, 0.2, -0.7], [9.0, 9.0, 0.0], [-0.3, 0.8, -1.4]])
    normals, areas = np.array([[0.6, 0.0, -0.8], [0.0, 0.0, 1.0], [0.36, 0.48, 0.8]]), np.array([0.25, 9.0, 0.5])
    phi, velocity = np.array([1 + 2j, 9.0, -0.5 + 1j]), np.array([0.3 - 1j, 9.0, 2 + 0.5j])
    mesh = Fake(faces_centers=centers, faces_normals=normals, faces_areas=areas)
    body = Fake(mesh_including_lid=mesh, hull_mask=np.array([True, False, True]))
    result = Fake(body=body, wavenumber=k, water_depth=h, potential=phi, problem=Fake(boundary_condition=velocity))

    def wave(place, theta):
        down = math.exp(k * place[2]) if math.isinf(h) else math.cosh(k * (place[2] + h)) / math.cosh(k * h)
        return down * np.exp(-1j * k * (place[0] * math.cos(theta) + place[1] * math.sin(theta)))

    expected = []
    for theta in (0.0, math.pi / 2, math.pi, 1.5 * math.pi):
        total = 0.0
        for i in (0, 2):
            step = 1e-5 * normals[i]
            slope = (wave(centers[i] + step, theta) - wave(centers[i] - step, theta)) / 2e-5
            total += areas[i] * (velocity[i] * wave(centers[i], theta) - phi[i] * slope)
        expected.append(total / (4 * math.pi))
    np.testing.assert_allclose(capytaine.kochin(result, 4), expected, rtol=1e-9)


def test_forces_of_known_waves(monkeypatch):
    """Waves a + b cos(theta) of each part: the integral of |H|^2 cos(theta) is 2 pi a b; the incoming wave's share."""
    parts = {"": (1.0, 2.0), "Surge": (0.5j, 0.25), "Heave": (2.0, 0.0), "Pitch": (0.0, -1j)}

    def result(omega, dof):
        own = {"radiating_dof": dof} if dof else {}
        water = {"rho": 1000.0, "wavenumber": 0.5, "g": 9.81, "water_depth": math.inf}
        return Fake(omega=omega, potential=1, name=dof, **water, **own)

    def waves(of, count):
        a, b = parts[of.name]
        return a + b * np.cos(2 * math.pi / count * np.arange(count))

    monkeypatch.setattr(capytaine, "kochin", waves)
    results = [result(omega, dof) for omega in (2.0, math.inf) for dof in parts]
    results += [result(3.0, dof) for dof in ("", "Surge", "Heave")]
    results += [Fake(omega=4.0, radiating_dof=dof) for dof in parts]  # without details
    found = capytaine.quadratic_forms(results[::-1])
    assert list(found) == [2.0]
    expected = np.empty((4, 4), dtype=complex)
    for i, (a, b) in enumerate(parts.values()):
        for j, (c, d) in enumerate(parts.values()):
            whole = math.pi * (np.conj(a) * d + np.conj(b) * c)
            expected[i, j] = -2 * math.pi * 1000.0 * 0.5 * 0.5 * whole  # the weight of deep water is k
    forward = -math.pi * 1000.0 * 9.81 * 0.5 / 2.0 * np.array([a + b for a, b in parts.values()])  # i times i H(0)
    expected[0] += forward
    expected[:, 0] += forward.conj()
    np.testing.assert_allclose(found[2.0], expected, rtol=1e-12, atol=1e-9)


def test_a_file_is_written_as_capytaine_does(monkeypatch, tmp_path):
    calls = []
    module = Fake(export_dataset=lambda *given, **named: calls.append((*given, named)))
    monkeypatch.setattr(capytaine, "capytaine", lambda: module)
    capytaine.write("data", tmp_path / "a.nc")
    assert calls == [(str(tmp_path / "a.nc"), "data", {"format": "netcdf"})]
