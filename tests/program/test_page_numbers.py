"""Every number on a page: largest values, tables, curves, envelopes, spectra, the 3D view, modes.

Source: a made-up record of distinct quantities, with each number computed again here; the datasets of modes and of a
sweep; numbers in the browser against the page's own data, checked before.
"""

import html
import math
import re

import numpy as np
import pytest
from made_up import ALONE, PERIOD, RECORD, SCENE
from scipy.integrate import trapezoid
from scipy.signal import welch
from test_page import data_of, sweep_dataset, unpacked

from dolfbuoy import modes, simulate
from dolfbuoy.page.result_pages import modes_page, sweep_page
from dolfbuoy.page.run_page import run_page
from dolfbuoy.page.view import view_of
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.mode_record import enlargement
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import STATISTICS
from dolfbuoy.results.series import Series
from dolfbuoy.results.summary import summary

RUN = RECORD.assign_attrs(unknowns=345, version_dolfbuoy="1.2", created="now", effects="all", ranks=2)
T, LATE = RUN.time.values, RUN.time.values >= SCENE.waves.ramp - 1e-9
FRAMES, LATE_FRAMES = RUN.frame.values, RUN.frame.values >= SCENE.waves.ramp - 1e-9


@pytest.fixture(scope="module")
def page():
    return run_page(RUN, SCENE)


@pytest.fixture(scope="module")
def found(page):
    return data_of(page)


def rows(page, section):
    """Texts of the cells of each row of the tables of a section, and of their heads."""
    text = re.search(rf'<section[^>]*id="{section}".*?</section>', page, re.DOTALL)[0]
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", text, re.DOTALL)]
    return [tuple(map(html.unescape, row)) for row in cells]


def close(packed, values, **how):
    np.testing.assert_allclose(unpacked(packed), np.ravel(values), **({"rtol": 6e-8, "atol": 1e-30} | how))


# -- a run -------------------------------------------------------------------------------------------------------------


def test_largest_values_and_their_times(page, found):
    C = ALONE.buoy_position.values
    wanted = {
        "largest tension, upper end": (ALONE.tension_top.values / 1000, "kN", "line"),
        "largest force at a lower end": (np.linalg.norm(ALONE.anchor_force, axis=1) / 1000, "kN", "line"),
        "farthest from the start": (np.hypot(C[:, 0] - C[0, 0], C[:, 1] - C[0, 1]), "m", "buoy"),
        "largest lean": (ALONE.cone_angle.values, "deg", "buoy"),
    }
    buttons = re.findall(r"<button[^>]*data-t=.*?</button>", page)
    assert len(buttons) == len(wanted)
    for button, moment, (label, (values, unit, kind)) in zip(buttons, found["moments"], wanted.items(), strict=True):
        t = T[values.argmax()]
        said = [html.unescape(text) for text in re.findall(r">([^<]+)<", button)]
        lasting = [f"exceeded there for 1 s: {Series('', T, values).lasting_maximum:.4g} kN"] if unit == "kN" else []
        assert said == [label, f"{values.max():.4g}", f" {unit}", *lasting, f"at {t:.4g} s"]
        assert (float(re.search(r'data-t="([^"]*)"', button)[1]), moment["t"]) == (t, t)
        assert (moment["kind"], moment["part"]) == (kind, "")


#: Output, its value, its error bar and what is thought of it.
LEAN, TENSION = ALONE.cone_angle.values, ALONE.tension_top.values
BARS = {
    "tension_top.max": (TENSION.max() * (1 - 1e-3), 23.4, "trusted"),
    "tension_top.min": (TENSION.min(), 0.5, "suspect"),
    "tension_top.mean": (TENSION.mean(), 0.25, "trusted"),
    "tension_anchor.max": (ALONE.tension_anchor.values.max(), math.nan, "none"),
    "anchor.max": (0.9 * np.linalg.norm(ALONE.anchor_force, axis=1).max(), 3.0, "trusted"),  # after the ramp
    "cone_angle.max": (LEAN.max(), 0.0, "trusted"),
    "buoy_position_z.max": (ALONE.buoy_position.values[:, 2].max(), 0.012, "trusted"),
}


def with_bars(record):
    """The record of a run whose error bars were estimated."""
    of = ["buoy" if name.startswith(("cone", "buoy")) else "cable" for name in BARS]
    value, bar, verdict = zip(*BARS.values(), strict=True)
    columns = {"output": list(BARS), "output_of": of, "bar_value": value, "bar": bar, "bar_verdict": verdict}
    columns |= dict.fromkeys(("bar_time", "bar_space"), [math.nan] * len(of))
    columns |= {"bar_statistics": [math.nan] * len(of), "bar_unit": ["degree" if "angle" in n else "N" for n in BARS]}
    return record.assign({name: ("output", list(column)) for name, column in columns.items()})


def test_error_bars_of_largest_values_and_of_curves():
    """They stand behind the large numbers, if these are the ones that were estimated, and at the extremes of curves."""
    page = run_page(with_bars(RUN), SCENE)
    found, position = data_of(page), ALONE.buoy_position.values[:, 2]
    assert [moment["bar"] for moment in found["moments"]] == [" ± 0.023", "", "", " ± 0"]
    shown = re.findall(r'<span class="number">([^<]+)<small>([^<]+)', page)
    assert shown[0] == (f"{TENSION.max() / 1000:.3f}", " ± 0.023 kN")
    assert shown[3] == (f"{LEAN.max():.6g}", " ± 0 deg")
    bars = {(p["title"], c["name"]): c["bars"] for p in found["panels"] for c in p["curves"] if c["bars"]}
    top = [
        {"t": T[TENSION.argmax()], "value": TENSION.max() * (1 - 1e-3), "bar": 23.4},
        {"t": T[TENSION.argmin()], "value": TENSION.min(), "bar": 0.5},
    ]
    near = np.abs(TENSION - top[0]["value"]).argmin()
    assert bars == {
        ("tension", "upper end"): [top[0] | {"t": T[near]}, top[1]],
        ("height", "C"): [{"t": T[position.argmax()], "value": position.max(), "bar": 0.012}],
    }


def test_largest_values_are_of_the_line_and_the_buoy_that_have_them():
    record = simulate("two-buoys", time__end=0.2)
    for moment in data_of(run_page(record))["moments"]:
        what = moment["label"].removeprefix(f"{moment['part']}: ")
        values = {
            "largest tension, upper end": lambda r: r.tension_top.values,
            "largest force at a lower end": lambda r: np.linalg.norm(r.anchor_force, axis=-1),
            "farthest from the start": lambda r: np.hypot(*(r.buoy_position - r.buoy_position[0]).values.T[:2]).T,
            "largest lean": lambda r: r.cone_angle.values,
        }[what](record)
        row, part = np.unravel_index(np.nanargmax(values), values.shape)
        assert moment["part"] == record[{"line": "cable", "buoy": "buoy"}[moment["kind"]]].values[part]
        assert moment["t"] == float(record.time[row])


def test_tables_of_a_run(page):
    assert rows(page, "matters") == [("quantity", "value", "unit"), *summary(RUN, SCENE)]
    settings = dict(row for row in rows(page, "worth")[1:] if len(row) == 2)
    assert settings["step"] == "0.1 s"
    assert settings["steps in a period of the drive"] == f"{PERIOD / 0.1:.4g}"
    assert settings["elements"] == "P1-P0, 20"
    assert settings["unknowns"] == "345"
    assert settings["Newton iterations in a step"] == f"{RUN.newton_iterations.values[1:].mean():.3g}"
    assert settings["steps that failed and were retried"] == "7"
    periods = {row[0]: row[1:] for row in rows(page, "worth") if row[-1].endswith("%")}
    left = (1 + (2 * math.pi * 0.1 / PERIOD) ** 2) ** (-0.5 * 40 / 0.1)  # backward Euler
    assert periods["wave"] == ("5", f"{100 * left:.1f} %")
    assert len(periods) > 3
    versions = dict(rows(page, "versions")[1:])
    assert versions == {"computed": "now", "dolfbuoy": "1.2", "ranks": "2"}
    assert "40 s in 400 steps of" in page


def test_panels_are_the_series(found):
    x, y, z = ALONE.buoy_position.values.T
    wanted = {
        ("line", "tension", "kN", 1e-3): {"upper end": ALONE.tension_top, "lower end": ALONE.tension_anchor},
        ("buoy", "height", "m", 1.0): {"C": z, "water": ALONE.surface_elevation},
        ("buoy", "horizontal position of C", "m", 1.0): {"x": x, "y": y},
        ("buoy", "offset", "m", 1.0): {"of C": ALONE.offset},
        ("buoy", "freeboard", "m", 1.0): {"lowest of the rim": ALONE.freeboard},
    }
    shown = {(p["kind"], p["title"], p["unit"], p["factor"]): p["curves"] for p in found["panels"]}
    assert shown.keys() == wanted.keys()
    for key, curves in wanted.items():
        assert [curve["name"] for curve in shown[key]] == list(curves)
        for curve, values in zip(shown[key], curves.values(), strict=True):
            close(curve["values"], values)
    np.testing.assert_array_equal(unpacked(found["time"]), T)
    assert (found["kept"], found["every"], found["period"]) == (401, 401, PERIOD)


def test_the_envelope_is_of_what_comes_after_the_ramp(found):
    (envelope,) = found["envelopes"]
    tension, t = ALONE.cable_tension.values[LATE_FRAMES], FRAMES[LATE_FRAMES]
    close(envelope["s"], ALONE.s_cell)
    close(envelope["low"], ALONE.cable_tension_minimum_after_ramp)
    close(envelope["high"], ALONE.cable_tension_maximum_after_ramp)
    close(envelope["mean"], trapezoid(tension, t, axis=0) / (t[-1] - t[0]), rtol=1e-6)
    said = {key: envelope[key] for key in ("part", "unit", "factor", "from", "to", "instants")}
    wanted = {"from": T[LATE][0], "to": 40.0, "instants": len(t)}
    assert said == {"part": "", "unit": "kN", "factor": 1e-3, **wanted}
    assert T[LATE][0] != t[0]  # a step ends with the ramp, a frame does not


def test_spectra_are_those_of_their_series_after_the_ramp(found):
    C = ALONE.buoy_position.values.T
    wanted = {
        ("tension", "kN"): {"upper end": ALONE.tension_top / 1000, "lower end": ALONE.tension_anchor / 1000},
        ("position of C", "m"): dict(zip("xyz", C, strict=True)),
    }
    assert {(s["title"], s["unit"]) for s in found["spectra"]} == wanted.keys()
    size = 150  # of 351 instants the half, in whole periods
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(size) / size))
    for spectrum in found["spectra"]:
        curves = wanted[spectrum["title"], spectrum["unit"]]
        assert [curve["name"] for curve in spectrum["curves"]] == list(curves)
        f = unpacked(spectrum["frequency"])
        highest = 0.0
        for curve, values in zip(spectrum["curves"], curves.values(), strict=True):
            x = np.asarray(values)[LATE]
            at, S = welch(x, 10.0, window, size, size // 2, detrend="linear")
            np.testing.assert_allclose(f, at[: len(f)], rtol=1e-6)
            np.testing.assert_allclose(unpacked(curve["values"]), S[: len(f)], rtol=1e-6, atol=1e-9 * S.max())
            highest = max(highest, S.max())
        assert (spectrum["drive"], spectrum["part"]) == (1 / PERIOD, "")
        assert [spectrum["low"], spectrum["high"]] == pytest.approx([1e-6 * highest, 4 * highest])


def test_the_picture_in_space(found):
    view, buoy = found["view"], found["view"]["buoys"][0]
    step = np.ptp(ALONE.buoy_position.values) / 131068 * 1.001
    close(buoy["position"], ALONE.buoy_position, rtol=0, atol=step)
    close(buoy["orientation"], ALONE.buoy_orientation, rtol=0, atol=1e-5)
    lines = view["lines"]
    close(lines["time"], FRAMES)
    close(lines["tension"], ALONE.cable_tension)
    close(lines["position"], ALONE.cable_position, rtol=0, atol=np.ptp(ALONE.cable_position.values) / 131068 * 1.001)
    assert lines["velocity"] is None
    assert lines["cables"] == [{"name": "cable", "node": [0, 7], "cell": [0, 6], "per": 1}]
    assert lines["scale"] == pytest.approx(np.quantile(ALONE.cable_tension.values, [0.005, 0.995]))
    assert lines["largest"] == float(ALONE.cable_tension_maximum.max())
    assert (view["sea"]["depth"], view["sea"]["slope"]) == (20.0, [0.0, 0.0])
    assert found["anchors"] == [ALONE.cable_position.values[0, 0, :2].tolist()]
    headings = {"waves": 30.0, "current": 0.0, "wind": 70.0, "force": math.degrees(math.atan2(-400.0, 300.0))}
    assert [name for name, _ in found["headings"]] == list(headings)
    for (_, direction), angle in zip(found["headings"], headings.values(), strict=True):
        assert direction == pytest.approx([math.cos(math.radians(angle)), math.sin(math.radians(angle))])


def test_arrows_are_the_forces_where_they_act(found):
    center = (400 * 0.5 + 150 * 2.0 + 150 * 3.0) / 700  # of the masses, over the keel
    holds, force, wind = found["view"]["forces"]
    assert (holds["kind"], holds["node"]) == ("holds", 0)
    size = np.ptp(ALONE.anchor_force.values) / 131068 * 1.001
    close(holds["values"], ALONE.anchor_force, rtol=0, atol=size)
    for one, height in ((force, 2.0), (wind, 2.6)):
        assert (one["kind"], one["buoy"]) == ("outside", 0)
        assert one["place"] == pytest.approx([0, 0, height - center])
    np.testing.assert_allclose(
        unpacked(force["values"]).reshape(-1, 3), np.tile([300, -400, 1200], (401, 1)), atol=0.02
    )
    blows = unpacked(wind["values"]).reshape(-1, 3)
    np.testing.assert_allclose(blows[:, 1] / blows[:, 0], math.tan(math.radians(70)), rtol=1e-3)
    largest = np.linalg.norm(ALONE.anchor_force, axis=1).max()
    assert found["view"]["largestForce"] == pytest.approx(largest)  # above 1300 N, and the wind


def test_what_is_wide_is_seen_broadside():
    """Along x or y where the box is half as wide again, else along the waves."""
    for stretch, direction in (((1, 8, 1), 90.0), ((8, 1, 1), 0.0), ((1, 1, 1), 30.0)):
        record = RUN.copy()
        record["cable_position"] = 0 * RUN.cable_position + [0.0, 0.0, -1.0]
        record["buoy_position"] = 0 * RUN.buoy_position
        record["cable_position"][:, 0] = [6.0 * stretch[0], 6.0 * stretch[1], -20.0]
        assert view_of(Frames(record, SCENE), np.arange(len(T)))["direction"] == direction


# -- modes, a sweep ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shapes():
    return modes("short", number=3)


def test_numbers_of_modes(shapes):
    found, one = data_of(modes_page(shapes)), alone(shapes)
    for i, mode in enumerate(found["modes"]):
        own, factor = one.isel(mode=i), enlargement(shapes, shapes.isel(mode=i))
        for name in ("period", "omega", "damping_ratio", "residual"):
            value = float(own[name])
            assert mode[name] == (value if math.isfinite(value) else None), name
        assert mode["factor"] == factor
        close(mode["tension"], own.cable_tension)
        largest = factor * np.abs(own.cable_tension.values).max()
        assert mode["scale"]["size"] == pytest.approx(largest)
        said, unit = mode["scale"]["text"].split()
        assert float(said) * {"N": 1, "kN": 1000}[unit] == pytest.approx(largest, rel=6e-3)
    close(found["view"]["rest"], one.rest_cable_position)
    close(found["view"]["lines"]["s"], one.s)
    assert found["view"]["buoys"][0]["rest"] == one.rest_buoy_position.values.tolist()
    assert found["view"]["buoys"][0]["turn"] == one.rest_buoy_orientation.values.tolist()


def cases():
    """A sweep of which no two numbers of a case are equal."""
    dataset = sweep_dataset()
    for k, name in enumerate(STATISTICS):
        dataset[f"tension_top_{name}"] = dataset[f"tension_top_{name}"] * (1 + k)
    return dataset


def test_numbers_of_a_sweep():
    dataset = cases()
    page = sweep_page(dataset)
    assert "6 cases over waves.amplitude, waves.stretching; 4 of them done" in page
    (tension,) = data_of(page)["quantities"]
    assert (data_of(page)["main"], tension["unit"]) == (["tension_top"], "kN")
    assert list(tension["statistics"]) == list(STATISTICS)
    for name, packed in tension["statistics"].items():
        factor = 1.0 if name == "dominant_period" else 1e-3
        close(packed, factor * dataset[f"tension_top_{name}"].values)
