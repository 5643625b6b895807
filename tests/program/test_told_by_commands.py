"""Tables and messages of computing commands: derivatives, scatter, designs, fits, modes, stiffness, sweeps.

Source: made-up datasets of distinct numbers in place of computed ones.
"""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import api, linear_api, load_scene, sensitivity
from dolfbuoy.commands import design as designs
from dolfbuoy.commands import linear, response, sweep
from dolfbuoy.commands import sensitivity as command
from dolfbuoy.results.elasticities import columns_of_run, order_of, percent, value_of
from dolfbuoy.results.labelled import PARTS
from dolfbuoy.results.statistics import collect
from dolfbuoy.studies.physics import response_runs


def texts(values):
    return np.array(values, dtype=object)


def table_rows(text):
    """First cell -> the other cells of all that look like rows and heads of tables."""
    rows = [[cell for cell in re.split(r"\s{2,}|\s*[│┃]\s*", line.strip()) if cell] for line in text.splitlines()]
    return {row[0]: row[1:] for row in rows if len(row) > 1}


# -- derivatives -------------------------------------------------------------------------------------------------------

NUMBERS = {
    "parameter_value": ("parameter", [400.0, math.nan, 0.25]),
    "parameter_unit": ("parameter", texts(["kg", "m", "1"])),
}
KEYS = {"parameter": texts(["buoy.mass", "cable.to", "buoy.drag"])}


def test_elasticities_of_a_run():
    """Of the usual outputs, or of those asked for, with a part where there are several; the largest first."""
    data = {
        "elasticity": (("parameter", "output"), [[0.5, 1.0, -0.2, 9.0], [-2.0, np.nan, 0.1, 8.0], [0.7, 0.9, 0.3, 7.0]])
    }
    names = ["tension_top.max", "cone_angle.max", "cone_angle.max", "offset.mean"]
    found = xr.Dataset(
        data | NUMBERS, KEYS | {"output": texts(names), "output_of": ("output", texts(["a", "p", "q", "p"]))}
    )
    columns = columns_of_run(found, asked=False)
    assert {name: list(x) for name, x in columns.items() if "of q" in name} == {"cone_angle.max of q": [-0.2, 0.1, 0.3]}
    assert list(columns) == ["tension_top.max", "cone_angle.max of p", "cone_angle.max of q"]
    assert list(columns_of_run(found, asked=True))[-1] == "offset.mean"
    assert order_of(found, columns).tolist() == [1, 0, 2]
    assert [value_of(found, k) for k in range(3)] == ["400 kg", "all of it", "0.25"]
    assert [percent(x) for x in (np.nan, 4e-5, -5e-5, 0.12345, -1.0, 12.3456)] == [
        "-", "0", "-0.0001", "+0.1235", "-1.000", "+12.346",
    ]  # fmt: skip


def test_elasticities_at_rest_and_of_periods():
    """Slope times number over value; of a vector, which is varied by a factor, the slope over the value."""
    top, slope = np.array([2e3, 5e3]), np.array([[10.0, 20.0], [300.0, 400.0], [-8e3, 0.0]])
    data = {"tension_top": ("cable", top), "d_tension_top": (("parameter", "cable"), slope)}
    data |= {"cone_angle": ("buoy", [4.0]), "d_cone_angle": (("parameter", "buoy"), [[0.01], [0.4], [-2.0]])}
    found = xr.Dataset(data | NUMBERS, KEYS | {"cable": texts(["fore", "aft"]), "buoy": texts(["buoy"])})
    columns = command._at_rest(found, False)
    assert list(columns) == ["tension_top of fore", "tension_top of aft", "cone_angle"]
    np.testing.assert_allclose(columns["tension_top of aft"], [20 * 400 / 5e3, 400 / 5e3, 0.0])
    np.testing.assert_allclose(columns["cone_angle"], [0.01 * 400 / 4, 0.4 / 4, -2 * 0.25 / 4])
    lower = found.rename(tension_top="tension_anchor", d_tension_top="d_tension_anchor")
    np.testing.assert_allclose(command._at_rest(lower, False)["tension_anchor of fore"], columns["tension_top of fore"])
    modes = {"period": ("mode", [np.nan, 3.25]), "name": ("mode", texts(["surge", "heave"]))}
    modes["d_period"] = ("parameter", "mode"), [[1.0, 0.004], [1.0, 0.5], [1.0, -3.0]]
    found = xr.Dataset(modes | NUMBERS, KEYS)
    ((name, values),) = command._of_modes(found, False).items()
    assert name == "heave 3.25 s"
    np.testing.assert_allclose(values, [0.004 * 400 / 3.25, 0.5 / 3.25, -3 * 0.25 / 3.25])


def test_the_table_of_elasticities(call, tmp_path, monkeypatch):
    asked = []

    def find(scene, by, of, folder, what):
        asked.append((by, of, what))
        data = {"elasticity": (("parameter", "output"), [[0.5], [-2.0], [0.7]])}
        labels = {"output": texts(["offset.mean"]), "output_of": ("output", texts(["buoy"]))}
        return xr.Dataset(data | NUMBERS, KEYS | labels)

    monkeypatch.setattr(sensitivity, "sensitivities", find)
    code, out, _ = call("sensitivity", "short", "--by", "buoy.mass, cable.to", "--of", "offset.mean", "--out", tmp_path)
    assert code == 0
    assert asked == [(["buoy.mass", "cable.to"], ["offset.mean"], "run")]
    rows = table_rows(out)
    assert rows["number"] == ["value", "offset.mean"]
    assert rows["buoy.mass"] == ["400 kg", "+0.5000"]
    assert list(rows).index("cable.to") < list(rows).index("buoy.drag") < list(rows).index("buoy.mass")
    assert (tmp_path / "figures" / "tornado.png").is_file()
    for option, what in (("--static", "static"), ("--modes", "modes"), ("--response", "response")):
        monkeypatch.setattr(
            sensitivity, "sensitivities", lambda *given: asked.append(given[-1]) or xr.Dataset(NUMBERS, KEYS)
        )
        if what != "modes":
            assert call("sensitivity", "short", option, "--no-plot", "--out", tmp_path)[0] == 0
            assert asked[-1] == what
    assert call("sensitivity", "short", "--static", "--modes", "--out", tmp_path)[0] == 2
    assert call("sensitivity", "short", "--by", "a", "--all", "--out", tmp_path)[0] == 2


# -- scatter, designs, fits --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["first", "chaos"])
def test_the_table_of_scatter(call, tmp_path, monkeypatch, method):
    """Forces in kN by their mean; shares in per cent; who is told that a model is none."""
    numbers = {"mean": [2500.0, 12.0], "sigma": [150.0, 0.5], "p05": [2250.0, 11.0], "p95": [2750.0, 13.0]}
    data = {name: ("output", values) for name, values in numbers.items()} | {"r2": ("output", [0.79, 0.8])}
    data |= {"share": (("parameter", "output"), [[0.75, 0.1], [0.2, 0.9]])}
    data["output_unit"] = "output", texts(["N", "degree"])
    labels = {"output": texts(["tension_top.max", "cone_angle.max"]), "parameter": texts(["buoy.mass", "sea.depth"])}
    labels["output_of"] = "output", texts(["line", "buoy"])
    monkeypatch.setattr(sensitivity, "uncertainty", lambda *_: xr.Dataset(data, labels))
    code, out, _ = call("uncertain", "short", "--method", method, "--out", tmp_path)
    assert code == 0
    rows = table_rows(out)
    assert rows["output"] == ["mean", "sigma", "5 %", "95 %", "unit", "R^2", "buoy.mass", "sea.depth"]
    assert rows["tension_top.max of line"] == ["2.5", "0.15", "2.25", "2.75", "kN", "0.79", "75 %", "20 %"]
    assert rows["cone_angle.max of buoy"] == ["12", "0.5", "11", "13", "degree", "0.80", "10 %", "90 %"]
    assert out.count("are not what this model says of them (R^2 = 0.79)") == 1
    assert ("A linear answer would mislead" in out) == (method == "first")


def test_the_tables_of_a_design(call, tmp_path, monkeypatch):
    asked = []
    data = {
        "begin": ("parameter", [20.0, 0.05]),
        "value": ("parameter", [18.25, 0.0625]),
        "parameter_unit": ("parameter", texts(["m", "kg"])),
        "limit_value": ("limit", [699.5, 3.5]),
        "limit_bar": ("limit", [1.25, np.nan]),
        "active": ("limit", [True, False]),
        "multiplier": ("limit", [0.125, 7.0]),
    }
    labels = {"parameter": texts(["cable.length", "buoy.mass"]), "limit": texts(["top < 700", "lean < 9"])}
    made = xr.Dataset(data, labels, {"least_of": "cable.mass", "least": 412.5, "runs": 9})

    def find(scene, vary, least, hold, cases, folder):
        asked.append((vary, least, hold, cases))
        return SimpleNamespace(dataset=made, sentences=["it is so"])

    monkeypatch.setattr(sensitivity, "design", find)
    options = ["--vary", "cable.length=15..25,buoy.mass=1..2", "--least", "cable.mass", "--hold", "top < 700"]
    cases = ["--case", "waves.amplitude=1.5;current.speed=0.5", "--case", "waves.period=7"]
    code, out, _ = call("design", "short", *options, *cases, "--out", tmp_path)
    assert code == 0
    vary = {"cable.length": (15.0, 25.0), "buoy.mass": (1.0, 2.0)}
    loads = [{"waves.amplitude": 1.5, "current.speed": 0.5}, {"waves.period": 7}]
    assert asked == [(vary, "cable.mass", ["top < 700"], loads)]
    rows = table_rows(out)
    assert rows["cable.length"] == ["20", "18.25", "m"]
    assert rows["buoy.mass"] == ["0.05", "0.0625", "kg"]
    assert rows["top < 700"] == ["699.5", "1.2", "yes", "0.125"]
    assert rows["lean < 9"] == ["3.5", "-", "no", "-"]
    assert "cable.mass = 412.5, after 9 runs" in out
    assert "it is so" in out
    assert [designs._multiplier(made, k) for k in range(2)] == ["0.125", "-"]


@pytest.mark.parametrize("noise", [None, 2.0])
def test_the_table_of_a_fit(call, tmp_path, monkeypatch, noise):
    asked = []
    data = {
        "begin": ("parameter", [1.2, 29.0]),
        "estimate": ("parameter", [1.05, 27.5]),
        "deviation": ("parameter", [0.025, 0.5]),
        "parameter_unit": ("parameter", texts(["1", "kg/m"])),
    }
    made = xr.Dataset(
        data, {"parameter": texts(["cable.normal_drag", "cable.line_density"])}, {"runs": 6, "residual": 0.0123}
    )

    def find(*given):
        asked.append(given[1:])
        return SimpleNamespace(dataset=made, sentences=["a bound"])

    monkeypatch.setattr(sensitivity, "calibrate", find)
    options = [
        "--fit",
        "cable.normal_drag=0.5..2",
        "--of",
        "tension_top,offset",
        "--point",
        "1,2,3.5",
        "--offset=-1..2",
    ]
    noisy = [] if noise is None else ["--noise", noise]
    code, out, _ = call("calibrate", "short", "--record", "m.csv", *options, *noisy, "--no-plot", "--out", tmp_path)
    assert code == 0
    (record, bounds, of, given, _, point, clock) = asked[0]
    assert (str(record), bounds, of) == ("m.csv", {"cable.normal_drag": (0.5, 2.0)}, ["tension_top", "offset"])
    assert (given, point, clock) == (noise, [1.0, 2.0, 3.5], (-1.0, 2.0))
    rows = table_rows(out)
    assert rows["cable.normal_drag"] == ["1.2", "1.05", "0.025"]
    assert rows["cable.line_density"] == ["29", "27.5", "0.5", "kg/m"]
    of_what = "the noise" if noise else "the standard deviation of the series"
    assert f"6 runs; residuals are 0.0123 of {of_what} (rms)." in out
    assert "a bound" in out


# -- small motions -----------------------------------------------------------------------------------------------------


def test_the_table_of_modes(call, tmp_path, monkeypatch):
    """Motions of buoys first, with the numbers of their modes; damping that is rounding is none."""
    data = {
        "name": ("mode", texts(["cable in plane 1", "heave", "sway"])),
        "kind": ("mode", texts(["oscillates", "oscillates", "drifts"])),
        "period": ("mode", [9.5, 2.25, np.nan]),
        "omega": ("mode", [0.661388, 2.79253, 0.0]),
        "damping_ratio": ("mode", [1e-10, -0.0125, np.nan]),
        "residual": ("mode", [3e-11, 4e-12, 0.0]),
    }
    asked = []
    monkeypatch.setattr(linear_api, "modes", lambda *given, **more: asked.append((given[1], more)) or xr.Dataset(data))
    code, out, _ = call(
        "modes", "short", "--number", 3, "--direction", 30, "--oscillating", "--no-plot", "--out", tmp_path
    )
    assert code == 0
    assert asked == [(3, {"direction_deg": 30.0, "oscillating": True})]
    rows = table_rows(out)
    assert rows["2"][:5] == ["heave", "2.25", "2.7925", "-0.0125", "4e-12"]
    assert rows["3"][:5] == ["sway", "-", "0", "-", "0e+00"]
    assert rows["1"][:5] == ["cable in plane 1", "9.5", "0.66139", "0", "3e-11"]
    assert [name for name in rows if name.isdigit()] == ["2", "3", "1"]


def test_texts_of_stiffness():
    """What is far below the largest is 0, and rigid directions have words."""
    values = np.array([[1e6, 2e-5, -np.inf], [np.inf, -1.1e-4, 12.3456]])
    assert linear._stiffness_texts(values) == [["1e+06", "0", "-rigid"], ["rigid", "-0.00011", "12.346"]]


@pytest.mark.parametrize(
    ("periods", "chosen"),
    [
        (np.arange(1.0, 17.0), np.arange(1.0, 17.0)),
        (np.arange(1.0, 40.0), [2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 25, 30]),
        (
            np.linspace(3.1, 3.9, 31),
            np.linspace(3.1, 3.9, 31)[[0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30]],
        ),
    ],
)
def test_few_of_many_periods(periods, chosen):
    found = xr.Dataset({"x": ("period", periods)}, {"period": periods})
    np.testing.assert_allclose(response._few_periods(found).period, chosen)


def test_what_is_verified():
    assert response._to_verify("5, 8.5,sea") == ([5.0, 8.5], True)
    assert response._to_verify("sea") == ([], True)
    assert response._to_verify("7") == ([7.0], False)
    assert response._to_verify(None) == ([], False)


def test_runs_beside_a_response(capsys, monkeypatch):
    """In small waves a millimetre high; a run that has not settled is told; a sea with its own deviations."""
    asked = []
    X = np.array([[3.0, 4.0], [6.0, 8.0]])
    data = {
        "rao": (("buoy", "motion", "period", "part"), X[None, None]),
        "tension_mean": (("cable", "tension"), [[1e3, np.nan]]),
    }
    data["rao_tension"] = ("cable", "tension", "period", "part"), np.stack([X * 100, X * 0])[None]
    labels = {"buoy": ["buoy"], "motion": ["heave"], "period": [5.0, 9.0], "part": list(PARTS)}
    labels |= {"cable": ["cable"], "tension": ["tension_top", "tension_anchor"]}
    found = xr.Dataset(data, labels, {"direction_deg": 25.0})

    def measured(scene, period, direction, amplitude):
        asked.append((period, direction, amplitude))
        return {"seconds": 1.26, "unsettled": 0.02 if period == 9.0 else 0.01, "heave": 8.0, "tension_top": 400.0}

    monkeypatch.setattr(response_runs, "measured", measured)
    runs = response._verified(found, load_scene("short"), [5.0, 9.0], None)
    assert asked == [(5.0, 25.0, 1e-3), (9.0, 25.0, 1e-3)]
    assert [run["period"] for run in runs] == [5.0, 9.0]
    out = " ".join(capsys.readouterr().out.split())
    assert "5 s against a run of 1.3 s: heave -37.5 %, tension_top +25.0 %" in out
    assert out.count("has not settled") == 1
    assert "The run of 9 s waves has not settled, its amplitudes still change by up to 2 %" in out
    pair = {"seconds": 0.52, "heave": 0.55}, {"seconds": 12.34, "time": 1800.0, "heave": 0.5}
    monkeypatch.setattr(response_runs, "measured_in_sea", lambda *_: pair)
    response._verify_in_sea(load_scene("short"), None)
    out = " ".join(capsys.readouterr().out.split())
    assert (
        "The sea, in 0.52 s, against a run of 12 s in 1800 s of it, both in the same components: heave +10.0 %" in out
    )


def test_a_limit_cycle_says_how_good_it_is(call, tmp_path, monkeypatch):
    from made_up import RECORD

    record = RECORD.assign_attrs(cycle_periods=17, cycle_error=0.00123)
    asked = []
    monkeypatch.setattr(api, "periodic", lambda *given, **how: asked.append(how) or record)
    code, out, _ = call("periodic", "short", "--accuracy", "0.2%", "--periods", 50, "--out", tmp_path)
    assert code == 0
    assert asked == [{"accuracy": pytest.approx(0.002), "most": 50}]
    assert "The limit cycle to 0.12 % of its ranges (estimated), after 17 periods." in out
    assert table_rows(out)["wall time"] == ["12.5", "s"]


# -- sweeps ------------------------------------------------------------------------------------------------------------


def test_the_table_of_a_sweep(capsys, tmp_path, monkeypatch):
    """Largest of each case in one unit, what is left of the criteria, and how many cases more there are."""
    monkeypatch.setattr(sweep, "MOST_ROWS", 4)
    rows = []
    for k in range(sweep.MOST_ROWS + 2):
        numbers = {"mean": 1.0, "minimum": 0.0, "maximum": 1000.0 + 12.5 * k, "standard_deviation": 1.0}
        criteria = [{"criterion": "offset", "part": "buoy", "value": 6.0, "limit": 8.0 + k, "unit": "m"}]
        changes = {"waves.amplitude": 0.5 * k, "current.speed": 2}
        row = {"changes": changes, "status": "done", "statistics": {"tension_top of line": numbers}}
        rows.append(row | {"criteria": criteria})
    sweep._show(collect(rows), tmp_path)
    out = capsys.readouterr().out
    found = table_rows(out)
    assert found["waves amplitude"] == ["current speed", "tension top max [kN]", "left of criteria [%]", "status"]
    assert found["0.0"] == ["2", "1", "25", "done"]
    assert found["1.5"] == ["2", "1.0375", f"{100 * 5 / 11:.5g}", "done"]
    assert "... and 2 more" in out
    assert f"{sweep.MOST_ROWS + 2} cases, " in out


@pytest.mark.parametrize(
    ("shares", "said"), [([0.0, 0.05], None), ([0.06, 0.0], "In 1 case many"), ([0.06, 0.5], "In 2 cases many")]
)
def test_cases_of_cut_steps(shares, said, capsys, tmp_path):
    rows = [{"changes": {"a.b": k}, "status": "done", "statistics": {}} for k in range(2)]
    sweep._end(collect(rows).assign(cut_steps=("case", np.array(shares))), tmp_path)
    out = " ".join(capsys.readouterr().out.split())
    assert ("steps failed" in out) == (said is not None)
    if said:
        worst = int(np.argmax(shares))
        assert said in out
        assert f"most in number {worst + 1}, {100 * shares[worst]:.3g} %" in out
