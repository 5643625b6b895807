"""Scatter of outputs due to uncertain numbers: first order, polynomial chaos, samples.

Source: closed forms of a hanging line, moments of polynomials of normal variables, samples.
"""

import importlib
import math

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged

import dolfbuoy
from dolfbuoy.errors import InputError
from dolfbuoy.sensitivity.uncertainty import _chaos, _hypercube, _sampled, uncertain_of, uncertainty

module = importlib.import_module("dolfbuoy.sensitivity.uncertainty")
METHODS = ("chaos", None), ("samples", 100)
LENGTH = 10.0
HANGING = {  # at rest: the tension at its top is its weight and that of what hangs on it
    "cable": {
        "length": LENGTH,
        "line_density": 2.0,
        "axial_stiffness": 1e6,
        "elements": 3,
        "from": "weight",
        "to": [0.0, 0.0, 1.0],
    },
    "joint": [{"name": "weight", "mass": 30.0, "volume": 0.0}],
    "time": {"end": 0.5, "step": 0.1, "scheme": "bdf2"},
    "uncertain": {"cable.line_density": "10%", "joint.weight.mass": 2.0},
}
SIGMAS = np.array([9.81 * LENGTH * 0.2, 9.81 * 2.0])
TOTAL = math.hypot(*SIGMAS)


@pytest.mark.parametrize("method", ["first", "chaos", pytest.param("samples", marks=pytest.mark.slow)])
def test_weight_of_a_hanging_line(method):
    """9.81 (w L + m): variances add, and the larger sigma has the larger share."""
    found = uncertainty(HANGING, method, of=["tension_top.mean"])
    scatter = 0.0 if method != "samples" else 0.1
    assert float(found["mean"][0]) == pytest.approx(9.81 * (2.0 * LENGTH + 30.0), rel=1e-6 + scatter / 10)
    assert float(found.sigma[0]) == pytest.approx(TOTAL, rel=1e-4 + scatter)
    assert float(found.p95[0] - found["mean"][0]) == pytest.approx(1.6449 * TOTAL, rel=0.01 + 2 * scatter)
    assert found.share.values[:, 0] == pytest.approx((SIGMAS / TOTAL) ** 2, abs=1e-3 + scatter)
    if method != "samples":
        assert float(found.r2[0]) > 0.9999


def test_the_smallest_tension_of_a_hanging_line():
    """In the lowest of three elements, 9.81 (w L/6 + m)."""
    found = uncertainty(HANGING, of=["smallest_tension.min"])
    sigmas = np.array([SIGMAS[0] / 6, SIGMAS[1]])
    assert float(found["mean"][0]) == pytest.approx(9.81 * (2.0 * LENGTH / 6 + 30.0), rel=1e-6)
    assert float(found.sigma[0]) == pytest.approx(math.hypot(*sigmas), rel=1e-4)
    assert found.share.values[:, 0] == pytest.approx((sigmas / math.hypot(*sigmas)) ** 2, abs=1e-3)


def test_expansion_of_a_polynomial():
    """y = 1 + 2 x + 3 (x^2 - 1)/sqrt(2) + 4 x z: mean 1, variance 4 + 9 + 16, of which 13 is due to x alone."""
    xi = _hypercube(30, 2)
    x, z = xi.T
    (mean, sigma, low, high, r2), share = _chaos(xi, 1 + 2 * x + 3 * (x**2 - 1) / math.sqrt(2) + 4 * x * z)
    assert (mean, sigma, r2) == pytest.approx((1.0, math.sqrt(29), 1.0))
    assert share == pytest.approx([13 / 29, 0.0], abs=1e-12)
    points = np.random.default_rng(7).standard_normal((400_000, 2))
    x, z = points.T
    expected = np.percentile(1 + 2 * x + 3 * (x**2 - 1) / math.sqrt(2) + 4 * x * z, [5, 95])
    assert (low, high) == pytest.approx(tuple(expected), rel=0.02)


@pytest.mark.parametrize("kind", ["normal", "lognormal", "uniform"])
def test_distributions(kind):
    """Mean and standard deviation of the number itself; a uniform one is bounded, a lognormal one positive."""
    scene = dolfbuoy.load_scene(HANGING | {"uncertain": {"cable.line_density": f"{kind} 30%"}})
    (one, *_) = uncertain_of(scene)
    values = 2.0 + 2.0 * one.x(_hypercube(20_000, 1)[:, 0])
    assert values.mean() == pytest.approx(2.0, rel=1e-3)
    assert values.std() == pytest.approx(0.6, rel=0.01)
    if kind == "uniform":
        assert np.abs(values - 2.0).max() <= 0.6 * math.sqrt(3)
    if kind == "lognormal":
        assert values.min() > 0
        assert np.log(values).std() == pytest.approx(math.sqrt(math.log1p(0.09)), rel=0.01)


def test_a_linear_answer_that_would_mislead_is_none():
    """The response is quadratic: R^2 is below 0.8, and no sigma is given."""
    parameters = uncertain_of(dolfbuoy.load_scene(HANGING))
    slopes = xr.Dataset(
        {"d_output": (("parameter", "output"), [[1.0], [1.0]]), "output_value": ("output", [0.0])},
        {"output": ["tension_top.max"], "output_of": ("output", ["cable"])},
    )
    xi = _hypercube(8, 2)
    row, share = module._first(parameters, slopes, module.Output("tension_top", "max", "cable"), xi, xi[:, 0] ** 2)
    assert np.isnan(row[1:4]).all()
    assert row[4] < 0.8
    assert np.isnan(share).all()


def test_runs_that_are_there_are_not_made_again(tmp_path, monkeypatch):
    first = uncertainty(HANGING, "samples", 6, ["tension_top.mean"], tmp_path)
    monkeypatch.setattr(module, "simulate", None)
    again = uncertainty(HANGING, "samples", 6, ["tension_top.mean"], tmp_path)
    assert again.equals(first)
    assert xr.load_dataset(tmp_path / "uncertain.nc").sizes == {"output": 1, "parameter": 2}


REFUSED = [
    ({}, "uncertain: must be given"),
    ({"cable.line_density": -1.0}, "must be a number > 0"),
    ({"cable.line_density": "twenty"}, "must be a number > 0"),
    ({"cable.line_density": "triangular 20%"}, "must be a number > 0"),
    ({"cable.lenght": "5%"}, "is no number of this scene"),
    ({"cable.elements": "5%"}, "is not a physical number"),
    ({"cable.to": 1.0}, "must end in %"),
    ({"cable.to.1": "5%"}, "of a number that is 0 it must be absolute"),
    ({"cable.to.1": "lognormal 1.0"}, "must be > 0"),
]


@pytest.mark.parametrize(("table", "message"), REFUSED)
def test_refused(table, message):
    with pytest.raises(InputError, match=message):
        uncertainty(merged(HANGING, uncertain=None) | ({"uncertain": table} if table else {}))


def test_command(call, tmp_path):
    """Table and record; an unknown method, and too few runs."""
    data = merged(MOORED, time={"end": 1.0, "step": 0.1, "scheme": "bdf2"}, uncertain={"buoy.mass": "5%"})
    scene = tmp_path / "scene.toml"
    dolfbuoy.load_scene(data).save(scene)
    code, out, _ = call("uncertain", scene, "--method", "chaos", "--out", tmp_path / "out")
    assert code == 0
    for text in ("tension_top.max of cable", "kN", "buoy.mass", "100 %"):
        assert text in out
    assert xr.load_dataset(tmp_path / "out" / "uncertain.nc").attrs["runs"] == 6
    for options, message in (
        (["--method", "magic"], "must be one of"),
        (["--method", "chaos", "--runs", 3], "must be at least"),
    ):
        code, _, err = call("uncertain", scene, "--out", tmp_path / "out", *options)
        assert code == 2
        assert message in " ".join(err.split())


def test_numbers_of_samples_are_those_of_their_table():
    """Unbiased variance of few runs; shares by the squares of correlations."""
    xi, y = np.array([[1.0, 0.5], [2.0, -0.5], [3.0, -0.5], [4.0, 0.5]]), np.array([2.0, 5.0, 6.0, 9.0])
    (mean, sigma, low, high, r2), share = _sampled(xi, y)
    assert (mean, sigma) == (5.5, pytest.approx(math.sqrt((3.5**2 + 0.5**2 + 0.5**2 + 3.5**2) / 3)))
    assert (low, high) == (pytest.approx(2.45), pytest.approx(8.55))
    assert math.isnan(r2)
    assert share == pytest.approx([11.0**2 / 5 / 25, 0.0], abs=1e-12)
    assert _sampled(xi, np.full(4, 7.0))[1].tolist() == [0.0, 0.0]  # nothing moves it


@pytest.mark.slow
def test_scatter_of_a_maximum_over_uncertain_coefficients():
    """Largest top tension of `short`: an expansion from 42 runs against 100 independent samples."""
    changes = {"time.end": 20.0, "uncertain": {"buoy.normal_drag": "20%", "buoy.added_mass": "30%"}}
    changes["uncertain"] |= {"current.speed": "10%", "waves.amplitude": "5%", "buoy.mass": "5%"}
    of = ["tension_top.max"]
    chaos, samples = (uncertainty("short", method, runs, of, **changes) for method, runs in METHODS)
    assert float(chaos.r2[0]) > 0.98
    assert float(chaos["mean"][0]) == pytest.approx(float(samples["mean"][0]), rel=0.02)
    assert float(chaos.sigma[0]) == pytest.approx(float(samples.sigma[0]), rel=0.15)
    for name in ("p05", "p95"):
        assert float(chaos[name][0]) == pytest.approx(float(samples[name][0]), abs=0.5 * float(samples.sigma[0]))
