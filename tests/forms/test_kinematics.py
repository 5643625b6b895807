"""Sums over wave components in C: values, derivatives, weights over disks; the process keeps denormals.

Source: tests/reference/sea.json (mpmath), the sum in numpy (`model.airy`) and its finite differences, Bessel functions.
"""

import numpy as np
import pytest
from helpers import reference
from scipy.special import j1, jv

from dolfbuoy import load_scene
from dolfbuoy.core import build
from dolfbuoy.forms import sea
from dolfbuoy.model.airy import AirySum
from dolfbuoy.model.kinematics import Kinematics
from dolfbuoy.model.problem import Problem
from dolfbuoy.scene.waves import Waves
from dolfbuoy.solver import compat
from dolfbuoy.solver.c_code import core

THREE = next(case for case in reference("sea")["cases"] if "sum_of_three" in case["id"])
STORM = {"spectrum": "jonswap", "significant_height": 3.0, "peak_period": 7.0, "spreading": 6.0, "components": 100}


def scene_of(waves, depth=20.0):
    return load_scene({"sea": {"depth": depth}, "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0}, "waves": waves})


class Sums:
    """The C functions at points, without any form."""

    def __init__(self, scene, t):
        self.kinematics, self.airy, self.t = Kinematics(scene), AirySum.of(scene), t
        self.kinematics.set_time(t)
        self.module, self.waves = core(), self.kinematics.waves

    def at(self, x, weights="ones"):
        """(eta, slope, curvature), (v, 5, 7), (a, 5, 7) at x, the ramp included."""
        pointer = lambda array: self.module.ffi.cast("double *", array.ctypes.data)  # noqa: E731
        surface, velocity, acceleration = np.zeros(6), np.zeros(15), np.zeros(15)
        lib, w = self.module.lib, self.waves
        lib.phases_at(w, x[0], x[1])
        lib.sum_surface(w, w.ones, pointer(surface))
        z = float(self.airy.stretched(x[2], w.ramp * surface[0]))
        lib.sum_surface(w, getattr(w, weights), pointer(surface))
        lib.sum_below(w, z, w.padded, getattr(w, weights), 1, pointer(velocity), pointer(acceleration))
        return w.ramp * surface, w.ramp * velocity, w.ramp * acceleration


def test_three_components():
    """Elevation, slope, velocity and acceleration under Wheeler's stretching with the total elevation."""
    given, expected = THREE["input"], THREE["expected"]
    scene, x = scene_of({"components": given["values"]}, given["depth"]), np.array(given["x"])
    surface, velocity, acceleration = Sums(scene, given["t"]).at(x)
    assert surface[:3] == pytest.approx([expected["eta"], *expected["slope"]], abs=1e-12)
    assert velocity[:3] == pytest.approx(expected["velocity"], abs=1e-12)
    assert acceleration[:3] == pytest.approx(expected["acceleration"], abs=1e-12)
    airy = AirySum.of(scene)
    assert airy.elevation(given["t"], x) == pytest.approx(expected["eta"], abs=1e-12)
    for found, name in zip(airy.flow(given["t"], x), ("velocity", "acceleration"), strict=True):
        assert found == pytest.approx(expected[name], abs=1e-12)


@pytest.mark.parametrize("stretching", ["wheeler", "vertical"])
@pytest.mark.parametrize("depth", [6.0, 300.0])
def test_sums_in_vectors_are_those_of_numpy(stretching, depth):
    """100 components, not a multiple of the vector length, during a ramp; also above the water."""
    sums = Sums(scene_of(STORM | {"stretching": stretching, "ramp": 40.0}, depth), 23.7)
    for x in np.random.default_rng(3).uniform([-500, -500, -5], [500, 500, 2], (20, 3)):
        surface, velocity, acceleration = sums.at(x)
        assert surface[0] == pytest.approx(float(sums.airy.elevation(23.7, x)), abs=1e-12)
        for found, expected in zip((velocity, acceleration), sums.airy.flow(23.7, x), strict=True):
            np.testing.assert_allclose(found[:3], expected, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 3])
def test_points_of_a_deep_cable(degree):
    """From the surface to 300 m, below the reach of most components: at the quadrature points, in order."""
    cable = {"length": 320.0, "line_density": 20.0, "diameter": 0.05, "axial_stiffness": 1e7, "elements": 7}
    cable |= {"position_degree": degree, "tension_degree": 0, "normal_drag": 1.0, "top": {"kind": "free"}}
    scene = {"sea": {"depth": 300.0}, "cable": cable, "waves": STORM | {"kinematics": "exact"}}
    problem = Problem(load_scene(scene), dynamic=True)
    along = (
        np.random.default_rng(2).standard_normal((3, 4)) * [[3.0], [2.0], [4.0]] * [1, 1, 1, 0]
    )  # the anchor is held
    bent = lambda s: np.array([np.polyval(p, s / 320) for p in along]).T + np.outer(s, [0.1, 0.0, 0.95]) - [0, 0, 300]  # noqa: E731
    problem.lines.set_shape(problem.system.u, bent, lambda s: 1e3 + s)
    problem.set_time(11.0)
    problem.system.publish()
    problem.system.evaluate()
    (points,) = problem.lines.sea.kinematics.sets
    found = problem.system.numbers_of(points.coefficient).reshape(-1, sea.SMALL)
    u, airy = problem.system.numbers_of(problem.lines.w), AirySum.of(problem.scene)
    places = np.einsum("qn,cni->cqi", points.shape, u[points.places]).reshape(-1, 3)
    dofs = compat.cell_dofs(points.coefficient.function_space).ravel()
    velocity, acceleration = airy.flow(11.0, places)
    np.testing.assert_allclose(found[dofs][:, sea.V : sea.V + 3], velocity, atol=1e-8)
    np.testing.assert_allclose(found[dofs][:, sea.A : sea.A + 3], acceleration, atol=1e-8)
    np.testing.assert_allclose(found[dofs][:, sea.ETA], airy.elevation(11.0, places), atol=1e-11)
    s, at = problem.lines.cell_ends, compat.interval_quadrature(max(2 * degree + 1, 3 * degree - 3))[0]
    expected = bent((s[:, :1] + np.diff(s, axis=1) * at).ravel())
    assert degree < 3 or np.abs(places - expected).max() < 1e-10  # a cubic is what the elements hold
    assert places[:, 2].min() < -250
    problem.destroy()


def tensor(g):
    """Symmetric traceless tensor from xx, xy, yy, xz, yz."""
    xx, xy, yy, xz, yz = g
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])


def test_derivatives():
    """Slope, curvature and gradients equal finite differences, in linear theory."""
    waves = Waves(**STORM).model_copy(update={"stretching": "none"})
    sums = Sums(scene_of(STORM).model_copy(update={"waves": waves}), 5.0)
    x, h = np.array([12.0, -31.0, -1.7]), 1e-4
    at = sums.at(x)
    ends = [(sums.at(x + h * e), sums.at(x - h * e)) for e in np.eye(3)]
    change = [[(a - b) / (2 * h) for a, b in zip(*pair, strict=True)] for pair in ends]
    slope, curvature = at[0][1:3], at[0][3:]
    assert slope == pytest.approx([change[0][0][0], change[1][0][0]], abs=1e-7)
    assert curvature == pytest.approx([change[0][0][1], change[0][0][2], change[1][0][2]], abs=1e-7)
    for part in (1, 2):
        gradient = np.array([change[i][part][:3] for i in range(3)]).T
        np.testing.assert_allclose(tensor(at[part][3:8]), gradient, atol=1e-7)
        xxx, xxy, xyy, yyy, xxz, xyz, yyz = at[part][8:]
        second = [[xxx, xxy, xyy, xxz, xyz], [xxy, xyy, yyy, xyz, yyz], [xxz, xyz, yyz, -xxx - xyy, -xxy - yyy]]
        np.testing.assert_allclose(second, [change[i][part][3:8] for i in range(3)], atol=1e-7)
        assert np.abs(second).max() > 1e-2


def test_weights_over_disks():
    sums = Sums(scene_of(STORM), 5.0)
    sums.module.lib.weigh(sums.waves, 1.3)
    x = sums.airy.wavenumber * 1.3
    for name, expected in (("mean", 2 * j1(x) / x), ("moment", 8 * jv(2, x) / x**2)):
        np.testing.assert_allclose([getattr(sums.waves, name)[i] for i in range(100)], expected, rtol=1e-12)


def test_denormal_numbers_survive():
    """gcc's start-up code of -ffast-math would flush them in the whole process."""
    assert core().lib.phases_at
    assert np.float64(1e-310) * np.float64(0.5) == 5e-311


def test_without_vectors_the_sums_are_the_same(tmp_path, monkeypatch):
    """The version compiled without libmvec."""
    monkeypatch.setattr(build.platform, "machine", lambda: "another")
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)
    plain = core.__wrapped__()
    fast, x = Sums(scene_of(STORM), 9.0), np.array([3.0, 4.0, -2.0])
    slow = Sums(scene_of(STORM), 9.0)
    slow.module, slow.waves = plain, plain.ffi.cast("waves *", int(core().ffi.cast("uintptr_t", slow.waves)))
    for a, b in zip(fast.at(x), slow.at(x), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_layout_of_a_sample():
    """`forms.sea` and C use the same positions."""
    sizes = {"PLACE": 3, "ETA": 1, "SLOPE": 2, "V": 3, "GRAD_V": 5, "A": 3, "GRAD_A": 5}
    sizes |= {"CURVATURE": 3, "GRAD2_V": 7, "GRAD2_A": 7}
    ends = np.cumsum([0, *sizes.values()])
    assert [getattr(sea, name) for name in sizes] == list(ends[:-1])
    assert (22, ends[-1]) == (sea.SMALL, sea.LARGE)
