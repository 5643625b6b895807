"""Calibration: numbers of a scene fitted to measured series.

Source: twin experiments (runs of known numbers, with and without noise); the Cramer-Rao lower bound in closed form.
"""

import importlib
import math

import numpy as np
import pytest
import xarray as xr

import dolfbuoy
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.rigid import rotation_of
from dolfbuoy.sensitivity import calibrate
from dolfbuoy.sensitivity.accelerations import _second, accelerations

module = importlib.import_module("dolfbuoy.sensitivity.calibration")
DRIVEN = {"time.end": 20.0, "time.step": 0.1, "time.scheme": "bdf2", "cable.elements": 10}
DRIVEN |= {"cable.position_degree": 1, "cable.tension_degree": 0}
TRUE = {"cable.normal_drag": 1.05, "cable.line_density": 29.0, "cable.length": 21.8, "cable.added_mass": 0.45}
BOUNDS = {"cable.normal_drag": (0.3, 2.0), "cable.line_density": (20.0, 35.0)}
BOUNDS |= {"cable.length": (21.6, 22.5), "cable.added_mass": (0.1, 1.0)}
HANGING = {  # at rest: its tension is g (w L + m)
    "cable": {
        "length": 10.0,
        "line_density": 2.0,
        "axial_stiffness": 1e6,
        "elements": 3,
        "from": "weight",
        "to": [0, 0, 0],
    },
    "joint": [{"name": "weight", "mass": 30.0, "volume": 0.0}],
    "time": {"end": 1.0, "step": 0.1, "scheme": "bdf2"},
}


@pytest.fixture(scope="module")
def twin():
    """A run with the true numbers."""
    return dolfbuoy.simulate("driven", **DRIVEN, **TRUE)


def test_twin_without_noise(twin):
    fit = calibrate("driven", twin, BOUNDS, **DRIVEN)
    assert fit.dataset.estimate.values == pytest.approx(list(TRUE.values()), rel=1e-5)
    assert fit.scene.network.pieces[0].section.length == fit.dataset.estimate.values[2]
    assert fit.dataset.attrs["runs"] <= 12
    assert fit.sentences == []


def test_deviations_know_no_units():
    """(J^T J)^-1 with columns in newtons and in fractions is that of the same columns, scaled."""
    J = np.random.default_rng(1).normal(size=(50, 3))
    units = np.array([1.0, 1e-9, 1e6])
    found = module.inverse_of_squares(J * units)
    np.testing.assert_allclose(found, np.linalg.inv(J.T @ J) / np.outer(units, units), rtol=1e-9)
    nothing = module.inverse_of_squares(J * [1.0, 0.0, 1.0])
    np.testing.assert_allclose(nothing[::2, ::2], np.linalg.inv(J[:, ::2].T @ J[:, ::2]), rtol=1e-9)
    assert not nothing[1].any()


@pytest.mark.slow
def test_twin_with_noise(twin, tmp_path):
    """The truth within 3 standard deviations; residuals as large as the noise."""
    noise = 0.01 * float(np.ptp(twin.tension_top.values))
    x = twin.tension_top.values[:, 0] + np.random.default_rng(3).normal(0, noise, twin.sizes["time"])
    rows = "\n".join(f"{t},{v}" for t, v in zip(twin.time.values, x, strict=True))
    (tmp_path / "measured.csv").write_text(f"time,tension_top\n{rows}\n")
    fit = calibrate("driven", tmp_path / "measured.csv", BOUNDS, noise=noise, out=tmp_path / "out", **DRIVEN)
    away = (fit.dataset.estimate.values - list(TRUE.values())) / fit.dataset.deviation.values
    assert np.abs(away).max() < 3
    assert fit.dataset.attrs["runs"] <= 12
    assert fit.dataset.attrs["residual"] == pytest.approx(1.0, abs=0.2)
    assert dolfbuoy.load_scene(tmp_path / "out" / "calibrated.toml") == fit.scene


def test_offset_of_clocks(twin):
    """A record whose clock is 0.37 s ahead."""
    late = twin.assign_coords(time=twin.time + 0.37)
    fit = calibrate("driven", late, {"cable.length": (21.6, 22.5)}, offset=(-1.0, 1.0), **DRIVEN | TRUE)
    assert fit.dataset.parameter.values.tolist() == ["cable.length", "time_offset"]
    assert fit.dataset.estimate.values == pytest.approx([21.8, 0.37], abs=2e-3)  # linear between steps of 0.1 s
    with pytest.raises(InputError, match=r"--offset 1..-1: must be finite numbers that rise"):
        calibrate("driven", late, {"cable.length": (21.6, 22.5)}, offset=(1.0, -1.0), **DRIVEN)


AFLOAT = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2"}


@pytest.mark.slow
def test_accelerations_of_a_point():
    """A twin with another mast and centre of mass, from accelerations at the top of the mast."""
    true = {"buoy.mass": 420.0, "buoy.center_of_mass": 1.3}
    record, place = dolfbuoy.simulate("short", **AFLOAT, **true), (0.3, 0.0, 4.0)
    arms = {"buoy": np.array(place) - (0, 0, 1.3)}
    t, csv = record.time.values, {label: x for label, x, _ in accelerations(record, arms)}
    q = record.buoy_orientation.values[:, 0]
    p = record.buoy_position.values[:, 0] + np.array([rotation_of(one) @ arms["buoy"] for one in q])
    expected = (p[2:] - 2 * p[1:-1] + p[:-2]) / 0.1**2
    assert np.array([csv[f"acceleration_{k}"] for k in "xyz"]).T[1:-1] == pytest.approx(expected, abs=1e-9)
    series = xr.Dataset({name: ("time", x) for name, x in csv.items()}, {"time": t})
    bounds = {"buoy.mass": (350.0, 480.0), "buoy.center_of_mass": (1.0, 1.5)}
    fit = calibrate("short", series, bounds, ["acceleration_x", "acceleration_z"], point=place, **AFLOAT)
    assert fit.dataset.estimate.values == pytest.approx(list(true.values()), rel=1e-4)
    assert fit.dataset.attrs["runs"] <= 12
    with pytest.raises(InputError, match="--point: must be three finite numbers"):
        calibrate("short", series, bounds, ["acceleration_x"], point=(1.0, 2.0), **AFLOAT)


def test_deviation_in_closed_form():
    """n measurements of g (w L + m) with noise s: m is known to s/(g sqrt(n))."""
    record = dolfbuoy.simulate(HANGING, joint__weight__mass=33.0)
    fit = calibrate(HANGING, record, {"joint.weight.mass": (10.0, 50.0)}, noise=5.0)
    count = fit.dataset.sizes["sample"]
    assert float(fit.dataset.estimate[0]) == pytest.approx(33.0, rel=1e-6)
    assert float(fit.dataset.deviation[0]) == pytest.approx(5.0 / (9.81 * math.sqrt(count)), rel=1e-4)


def test_what_cannot_be_told_apart():
    """In the tension weights of line and body are one number; numbers without effect and bounds are reported too."""
    record = dolfbuoy.simulate(HANGING)
    fit = calibrate(HANGING, record, {"cable.line_density": (1.0, 4.0), "joint.weight.mass": (10.0, 50.0)}, noise=5.0)
    assert any("are not separable" in sentence for sentence in fit.sentences)
    fit = calibrate(HANGING, record, {"joint.weight.mass": (31.0, 50.0)}, noise=5.0)
    assert any("lies on its bound, 31" in sentence for sentence in fit.sentences)


def test_a_run_that_fails_is_a_step_that_is_not_taken(monkeypatch):
    record, real, failed = dolfbuoy.simulate(HANGING, joint__weight__mass=33.0), module.of_run, []

    def run(scene, *rest):
        failed.append(scene.network.bodies["weight"].mass)
        if len(failed) == 2 or failed[-1] >= 100.0:
            raise SolveError("it snaps")
        return real(scene, *rest)

    monkeypatch.setattr(module, "of_run", run)
    scene = HANGING | {"joint": [{"name": "weight", "mass": 12.0, "volume": 0.0}]}
    fit = calibrate(scene, record, {"joint.weight.mass": (10.0, 5000.0)}, noise=5.0)
    assert 12.0 < failed[2] < failed[1]  # less far
    assert float(fit.dataset.estimate[0]) == pytest.approx(33.0, rel=1e-5)
    with pytest.raises(SolveError, match="first run of the fit fails: it snaps"):
        calibrate(HANGING, record, {"joint.weight.mass": (100.0, 200.0)})


@pytest.mark.parametrize(
    ("fit", "of", "message"),
    [
        ({}, ["tension_top"], "--fit: must be given"),
        ({"cable.lenght": (1, 2)}, ["tension_top"], "is no number of this scene"),
        ({"cable.elements": (1, 20)}, ["tension_top"], "is not a physical number"),
        ({"cable.length": (22.0, 21.0)}, ["tension_top"], "must be finite numbers that rise"),
        ({"cable.top.position": (1, 2)}, ["tension_top"], "is a vector; name its entries"),
        ({"cable.length": (21.0, 23.0)}, ["tension_middle"], "the record has"),
    ],
)
def test_refused(twin, fit, of, message):
    with pytest.raises(InputError, match=message):
        calibrate("driven", twin, fit, of, **DRIVEN)


FILES = {
    "no column time": "t,tension_top\n1,2\n",
    "a word": "time,tension_top\n1,high\n",
    "a short row": "time,tension_top\n1,2\n2\n",
    "times that fall": "time,tension_top\n2,1\n1,1\n",
    "nothing": "",
    "no numbers": "time,tension_top\n",
    "too few": "time,tension_top\n11,1\n12,1\n",
}


@pytest.mark.parametrize("text", FILES.values(), ids=FILES)
def test_csv_refused(text, tmp_path):
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(InputError, match=r"^--(record|of) .*\.$"):
        calibrate("driven", tmp_path / "m.csv", {"cable.length": (21.0, 23.0)}, **DRIVEN)


def test_command(call, twin, tmp_path):
    twin.tension_top.squeeze().to_series().to_csv(tmp_path / "m.csv")
    (tmp_path / "m.csv").write_text((tmp_path / "m.csv").read_text().replace("tension_top", "tension_top", 1))
    options = [f"--set={key}={value}" for key, value in (DRIVEN | TRUE).items() if key != "cable.length"]
    where = ["--record", tmp_path / "m.csv", "--out", tmp_path / "out"]
    code, out, _ = call("calibrate", "driven", *where, "--fit", "cable.length=21.6..22.5", *options)
    assert code == 0
    for text in ("cable.length", "21.8", "calibrated.toml", "residuals.png"):
        assert text in out
    assert float(xr.load_dataset(tmp_path / "out" / "calibrate.nc").estimate[0]) == pytest.approx(21.8, rel=1e-6)
    assert (tmp_path / "out" / "figures" / "residuals.png").stat().st_size > 10_000
    for bad, text in (("--point=1,2,up", "must be X,Y,Z"), ("--offset=1", "must have the form")):
        code, _, err = call("calibrate", "driven", *where, "--fit", "cable.length=21.6..22.5", bad)
        assert code == 2
        assert text in " ".join(err.split())
    for bad in ("cable.length", "cable.length=1", "cable.length=1..x", "cable.length=1..2,cable.length=1..2"):
        code, _, err = call("calibrate", "driven", *where, "--fit", bad)
        assert code == 2
        assert "must have the form KEY=LOW..HIGH" in " ".join(err.split())


def test_accelerations_at_both_ends_go_on_in_a_line():
    """Exact for a cubic at equal steps, including both ends."""
    t = np.arange(0.0, 2.05, 0.1)
    x = np.column_stack([t**3 - t, 4 * t**2, 0 * t])
    assert _second(t, x) == pytest.approx(np.column_stack([6 * t, 0 * t + 8.0, 0 * t]), abs=1e-9)
