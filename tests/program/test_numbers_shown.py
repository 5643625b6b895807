"""Numbers in figures and tables of statistics, sweeps, responses and offsets are those of their datasets, with units.

Source: made-up datasets of distinct numbers, read back from curves, bars and table rows.
"""

import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import api, linear_api, load_scene
from dolfbuoy.commands import linear, response, sensitivity, shared, sweep
from dolfbuoy.commands import run as progress
from dolfbuoy.commands import statistics as command
from dolfbuoy.parallel.cases import duration
from dolfbuoy.results import linear_figures, linear_record, offset_record, statistics_figures
from dolfbuoy.results.labelled import PARTS, labelled
from dolfbuoy.results.sample import NUMBERS, STATISTICS, Fatigue
from dolfbuoy.results.series import each_series
from dolfbuoy.results.statistics import Run, collect, together
from dolfbuoy.results.sweep_figure import draw
from dolfbuoy.studies import peer
from dolfbuoy.studies.physics import response_runs


@pytest.fixture
def told(monkeypatch):
    """Rows of the tables that are shown, by title, and the sentences."""
    titles, sentences = {}, []

    def take(shown, **_):
        if isinstance(shown, str):
            sentences.append(shown)
        else:
            cells = [list(column.cells) for column in shown.columns]
            titles[str(shown.title).strip()] = [tuple(row) for row in zip(*cells, strict=True)]

    monkeypatch.setattr(shared.out, "print", take)
    return titles, sentences


def row_of(titles, begin, name):
    """Cells of the row of this name in the table whose title begins so."""
    (rows,) = [rows for title, rows in titles.items() if title.startswith(begin)]
    (row,) = [row for row in rows if row[0] == name]
    return row[1:]


# -- statistics --------------------------------------------------------------------------------------------------------

RUNS, LENGTH = 12, 900.0
MAXIMA = 9000.0 + 400 * np.array([3, 1, 4, 1.5, 9, 2, 6, 5, 3.5, 8, 7, 2.5])


def run(k):
    """Of one line, all of whose numbers differ; two ranges, one of half a cycle."""
    numbers = {
        "mean": 5000.0 + k,
        "standard_deviation": 700.0 + k,
        "skewness": 0.3 + 0.01 * k,
        "minimum": 1000.0 + 50 * k,
    }
    numbers |= {"maximum": MAXIMA[k], "period": 6.0 + 0.1 * k, "memory": 8.0 + k}
    assert numbers.keys() == set(NUMBERS)
    numbers["lasting_maximum"] = 4000.0 + 7 * k
    peaks, cycles = [[6000.0 + k, MAXIMA[k]], [1.0, 1.0]], [[1000.0 + k, 3000.0 + k], [5.0, 0.5]]
    sample = {"start": 50.0, "duration": LENGTH, "series": {"tension_top of line": numbers}}
    sample |= {"peaks": {"tension_top of line": peaks}, "cycles": {"tension_top of line": cycles}}
    return Run(f"run{k}", sample, "sea", seconds=10.0 + k)


@pytest.fixture(scope="module")
def found():
    return together([run(k) for k in range(RUNS)], Fatigue(4.0, 1e20, 0.5))


def power_sum(k, m=4):
    return 5 * (1000.0 + k) ** m + 0.5 * (3000.0 + k) ** m


def test_the_table_of_series(found, told, tmp_path):
    command.show(found, tmp_path)
    mean, deviation = 1e-3 * (5000 + 5.5), 1e-3 * (700 + 5.5)
    numbers = [f"{mean:.4g}", f"{deviation:.4g}", f"{0.3 + 0.055:.2f}", "1", f"{MAXIMA.max() / 1000:.4g}"]
    shown = row_of(told[0], "12 runs, 900 s from t = 50 s on", "tension top")
    assert shown == ("kN", *numbers, f"{(4000 + 77) / 1000:.4g}", "6.55", "24")


def test_the_table_of_fatigue(found, told, tmp_path):
    command.show(found, tmp_path)
    every = sum(map(power_sum, range(RUNS)))
    load = (every / RUNS / (0.5 * LENGTH)) ** 0.25 / 1000
    damage = every / 1e20 / (RUNS * LENGTH) * 365.25 * 86400
    assert row_of(told[0], "Fatigue, m = 4", "tension top") == (
        f"{load:.4g} kN",
        f"{damage:.4g}",
        f"{1 / damage:.4g}",
    )


def test_the_tables_of_extremes_and_how_well_they_are_known(found, told, tmp_path):
    command.show(found, tmp_path)
    values = found.tension_top_most_probable.values[0, 0] / 1000
    assert row_of(told[0], "Most probable maximum", "tension top") == ("kN", *(f"{x:.4g}" for x in values))
    deviation, largest, count, seconds = row_of(told[0], "How well they are known", "tension top")
    memory = 8 + 5.5
    assert deviation == f"+- {100 * 1.96 * 0.5 * math.sqrt(memory / (RUNS * LENGTH)):.2g} %"
    rise, scale = math.log(10800 / LENGTH), found.tension_top_gumbel_scale.item()
    above = found.tension_top_gumbel_location.item() + scale * rise - 5005.5
    part = 1.96 * scale * math.sqrt(1.1087 + 0.6079 * rise**2 + 2 * 0.2570 * rise) / above
    assert largest == f"+- {100 * part / math.sqrt(RUNS - 4):.2g} %"
    assert count == f"{math.ceil(4 + (part / 0.05) ** 2)}"
    assert seconds == duration(int(count) * 15.5)


def test_the_design_wave_against_the_seeds(told, tmp_path):
    """What each column is, and forces in kN."""
    numbers = {"largest": [9100.0, 3.0], "most_probable": [8800.0, 3.5], "above": [0.41, 0.7]}
    words = {"part": ["port", ""], "unit": ["N", "m"]}
    columns = {name: ("series", values) for name, values in (numbers | words).items()}
    command._show_design(xr.Dataset(columns, {"series": ["tension_top", "offset"]}), tmp_path)
    (rows,) = told[0].values()
    assert rows[0] == ("tension top of port", "kN", "9.1", "8.8", "0.41")
    assert rows[1] == ("offset", "m", "3", "3.5", "0.7")


def test_figures_of_statistics(found):
    peaks = statistics_figures.exceedance(found).axes[0].lines[0].get_xydata()
    order = np.sort([*MAXIMA, *(6000.0 + np.arange(RUNS))])[::-1] / 1000
    np.testing.assert_allclose(peaks, np.column_stack([order, np.arange(1, 25) / 25]))
    steps = statistics_figures.cycles(found).axes[0].lines[0].get_xydata()
    ranges = np.array([*(3000.0 + np.arange(RUNS))[::-1], *(1000.0 + np.arange(RUNS))[::-1]]) / 1000
    number = np.cumsum([0.5] * RUNS + [5.0] * RUNS) / (RUNS * LENGTH / 3600)
    np.testing.assert_allclose(steps, np.column_stack([ranges, number]))
    points, line, *_ = statistics_figures.extremes(found).axes[0].lines
    reduced = -np.log(-np.log(np.arange(1, RUNS + 1) / (RUNS + 1)))
    np.testing.assert_allclose(points.get_xydata(), np.column_stack([np.sort(MAXIMA) / 1000, reduced]))
    location, scale = found.tension_top_gumbel_location.item(), found.tension_top_gumbel_scale.item()
    x, y = line.get_xydata().T
    np.testing.assert_allclose(1000 * x, location + scale * y)
    rise = math.log(10800 / LENGTH)  # of the most probable value, which stands on the line
    np.testing.assert_allclose(y, [reduced[0], max(reduced[-1], rise)])
    (bar,) = statistics_figures.extremes(found).axes[0].containers
    np.testing.assert_allclose(bar[0].get_xydata(), [[(location + scale * rise) / 1000, rise]])
    (reach,) = bar[2][0].get_segments()
    np.testing.assert_allclose(1000 * reach[:, 0], found.tension_top_most_probable.values[0, 0, 1:])


def test_the_figure_of_circles():
    """The hull of the tracks of each set, its circle and its middle; the legend has the radius."""
    data = {
        f"circle_{part}": (("set", "buoy"), [[value]]) for part, value in (("x", 3.0), ("y", -1.0), ("radius", 2.5))
    }
    data |= {f"corner_{axis}": ("corner", np.array(x)) for axis, x in (("x", [1.0, 5.0, 3.0]), ("y", [0.0, 1.0, -3.0]))}
    data |= {"corner_set": ("corner", np.zeros(3, dtype=int)), "corner_buoy": ("corner", np.array(["buoy"] * 3))}
    (axes,) = statistics_figures.circle(xr.Dataset(data)).axes
    around, patch = axes.patches
    assert (patch.center, patch.radius, patch.get_label()) == ((3.0, -1.0), 2.5, "radius 2.5 m")
    (middle,) = axes.lines
    corners = around.get_xy()
    assert {tuple(corner) for corner in corners.tolist()} == {(1, 0), (5, 1), (3, -3)}
    np.testing.assert_allclose(corners[0], corners[-1])  # closed
    assert around.get_label() == "around the track of buoy"
    np.testing.assert_allclose(middle.get_xydata(), [[3, -1]])


def test_peaks_and_ranges_of_several_lines_are_their_own():
    def both(k):
        one, other = run(k).sample, run(k + 5).sample
        of = {part: {"fore": one[part]["tension_top of line"], "aft": other[part]["tension_top of line"]} for part in
              ("series", "peaks", "cycles")}  # fmt: skip
        named = {part: {f"tension_top of {name}": values for name, values in each.items()} for part, each in of.items()}
        return Run(f"run{k}", one | named, "sea")

    every = each_series(together([both(0), both(1)], Fatigue()), "mean")
    assert [said for said, _, _ in every] == ["tension_top of fore", "tension_top of aft"]
    for (_, _, mine), first in zip(every, (0, 5), strict=True):
        assert sorted(mine.tension_top_range.values) == [1000.0 + first, 1001.0 + first, 3000.0 + first, 3001.0 + first]
        assert sorted(mine.tension_top_peak.values)[:2] == [6000.0 + first, 6001.0 + first]
        assert len(mine.tension_top_peak) == 4


# -- a sweep -----------------------------------------------------------------------------------------------------------


def test_bars_of_a_sweep_are_means_and_ranges():
    factors = dict(zip(STATISTICS, (0.5, 3.0, 1.0, 0.2, 7.0), strict=True))
    rows = [
        {"changes": {"waves.amplitude": a}, "status": "done", "statistics": {"tension_top of line": own}}
        for a in (1.0, 2.0, 4.0)
        for own in [{name: a * factor for name, factor in factors.items()}]
    ]
    (axes,) = draw(collect(rows)).axes
    (bars,) = axes.containers
    means, _, (reach,) = bars
    np.testing.assert_allclose(means.get_xydata(), [[1, 1], [2, 2], [4, 4]])
    ends = [segment[:, 1].tolist() for segment in reach.get_segments()]
    np.testing.assert_allclose(ends, [[0.5, 3], [1, 6], [2, 12]])


def test_how_far_a_run_is(monkeypatch):
    """Speed against the clock, and iterations of a step in the mean."""
    bar = progress._Bar(load_scene("driven", time__end=60.0))
    with bar:
        task = bar.progress.tasks[0]
        for t, iterations in ((15.0, 2), (30.0, 4), (60.0, 6)):
            bar.update(SimpleNamespace(t=t), iterations)
        assert (task.completed, task.total, task.fields["newton"]) == (60.0, 60.0, 4.0)
        assert task.elapsed > 0
        assert task.fields["speed"] >= 60.0 / task.elapsed


def test_how_far_a_sweep_is(told, tmp_path):
    """Five cases of a quarter of an hour each are left."""
    found = {
        "cases": 10,
        "done": 4,
        "failed": 1,
        "missing": 5,
        "begun": 2,
        "seconds": 900.0,
        "damaged": [],
        "foreign": 0,
    }
    sweep._show_status(found | {"reasons": {"rare": 1, "often": 3}}, tmp_path, None)
    cases, reasons = told[0].values()
    assert [row[:2] for row in cases] == [("all", "10"), ("done", "4"), ("failed", "1"), ("missing", "5")]
    assert cases[1][2] == "900 s each"
    assert cases[3][2] == "2 of the sweep have begun; about 1.2 h of one core"
    assert reasons == [("3", "often"), ("1", "rare")]


# -- the response ------------------------------------------------------------------------------------------------------

PERIODS, HEIGHT = np.array([4.0, 5.0, 8.0]), 3.0


def made_up_response(**attrs):
    """Of one buoy on one line: complex numbers that all differ."""
    motions = np.arange(1, 19).reshape(1, 6, 3) * (0.6 + 0.8j)
    pulls = 1000.0 * np.arange(1, 7).reshape(1, 2, 3) * (0.8 - 0.6j)
    dims, of_line = ("buoy", "motion", "period", "part"), ("cable", "tension", "period", "part")
    w, density = np.array([0.5, 1.0, 2.0]), np.array([1.0, 3.0, 2.0])
    data = {
        "period": (("period",), PERIODS, ("s", "period")),
        "rao": (dims, motions, ("m/m", "")),
        "rao_tension": (of_line, pulls, ("N/m", "")),
        "rao_drag": (dims, 0.9 * motions, ("m/m", "")),
        "rao_drag_tension": (of_line, 0.9 * pulls, ("N/m", "")),
        "tension_mean": (("cable", "tension"), np.array([[3500.0, 9e4]]), ("N", "")),
        "tension_std": (("cable", "tension"), np.array([[1300.0, 50.0]]), ("N", "")),
        "motion_std": (("buoy", "motion"), np.array([[0.1, 0.2, 0.3, 0.04, 0.05, 0.06]]), ("m", "")),
        "omega": (("omega",), w, ("rad s-1", "")),
        "spectrum": (("omega",), density, ("m2 s rad-1", "")),
        "motion_spectrum": (("buoy", "motion", "omega"), np.arange(1, 7)[None, :, None] * density, ("", "")),
        "tension_spectrum": (("cable", "tension", "omega"), np.array([[2e6, 5e6]])[..., None] * density, ("", "")),
    }
    labels = {"motion": linear_record.MOTIONS, "part": PARTS, "tension": linear_record.TENSIONS}
    return labelled(data, labels | {"cable": ["cable"], "buoy": ["buoy"]}, {"height_m": HEIGHT} | attrs)


def test_figures_of_a_response():
    found = made_up_response()
    curves = {
        line.get_label(): line.get_xydata()
        for axes in linear_figures.amplitudes(found).axes
        for line in axes.lines
        if not line.get_label().startswith("_")
    }
    names = linear_record.MOTIONS[:5]
    for k, (name, factor) in enumerate(zip(names, (1, 1, 1, 180 / np.pi, 180 / np.pi), strict=True)):
        np.testing.assert_allclose(curves[name], np.column_stack([PERIODS, factor * np.arange(3 * k + 1, 3 * k + 4)]))
    np.testing.assert_allclose(curves["tension_top"], np.column_stack([PERIODS, [1, 2, 3]]))  # kN
    np.testing.assert_allclose(curves["tension_anchor"], np.column_stack([PERIODS, [4, 5, 6]]))
    for axes in linear_figures.amplitudes(found).axes:  # with linearised drag in the same unit and colour
        whole = [line for line in axes.lines if line.get_linestyle() == "-"]
        dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
        for line, other in zip(whole, dashed, strict=True):
            np.testing.assert_allclose(other.get_xydata(), line.get_xydata() * [1, 0.9])
            assert other.get_color() == line.get_color()
    f, per_hertz = np.array([0.5, 1.0, 2.0]) / (2 * np.pi), 2 * np.pi * np.array([1.0, 3.0, 2.0])
    drawn = [line for axes in linear_figures.spectra(found).axes for line in axes.lines]
    factors = {"elevation": 1, "surge": 1, "sway": 2, "heave": 3, "tension top": 2, "tension anchor": 5}
    factors |= {"roll": 4 * (180 / np.pi) ** 2, "pitch": 5 * (180 / np.pi) ** 2}
    assert {line.get_label() for line in drawn} == factors.keys()
    for line in drawn:
        np.testing.assert_allclose(line.get_xydata(), np.column_stack([f, factors[line.get_label()] * per_hertz]))


def test_what_a_response_is_warned_of():
    """Three standard deviations, and half the height, above the mean."""
    anchor = made_up_response()
    sea, waves = linear_record.warnings(anchor)
    assert "tension_top: three standard deviations, 3.9 kN, are more than the mean, 3.5 kN" in sea
    assert "in waves of 3 m the amplitude is more than the mean at 8 s:" in waves  # 1.5 x 0.9 x 3000 N, not 2000 N


def test_tables_of_a_response(told, tmp_path):
    response._show_response(made_up_response(), tmp_path)
    for k, T in enumerate(PERIODS):
        sizes = [f"{f * (3 * i + k + 1):.4g}" for i, f in enumerate((1, 1, 1, 180 / np.pi, 180 / np.pi))]
        pulls = [f"{1000 * (k + 1):.4g}", f"{1000 * (k + 4):.4g}"]
        (small,) = [rows for title, rows in told[0].items() if "in small waves" in title]
        assert small[k] == (f"{T:g}", *sizes, *pulls)
    assert row_of(told[0], "Standard deviations", "tension_top") == ("1300", "3500", "N")
    assert row_of(told[0], "Standard deviations", "pitch") == (f"{math.degrees(0.05):.4g}", "", "deg")


def test_what_moves_the_largest_amplitude_of_a_response():
    """In per cent for one per cent, of the size and not of a part of it."""
    X, slope = np.array([1.0, 1.0 + 2.0j, 2.0]), np.array([0.0, 0.3 - 0.1j, 5.0])
    parts = {"rao": X, "d_rao": slope}
    data = {name: np.stack([x.real, x.imag], axis=-1)[None, None] for name, x in parts.items()}
    dims = ("buoy", "motion", "period", "part")
    variables = {"rao": (dims, data["rao"]), "d_rao": (("parameter", *dims), data["d_rao"][None])}
    labels = {"buoy": ["left"], "motion": ["heave"], "period": [5.0, 8.0, 11.0], "part": ["real", "imaginary"]}
    found = xr.Dataset(variables | {"parameter_value": ("parameter", [40.0])}, labels)
    ((name, (relative,)),) = sensitivity._of_response(found, False).items()
    size = abs(X[1])
    assert name == "heave, 8 s"
    assert relative == pytest.approx((X[1].conjugate() * slope[1]).real / size * 40.0 / size)


def test_waves_of_a_response_and_of_the_runs_beside_it(call, tmp_path, monkeypatch):
    """Drag is that of the scene's own height, and the runs have its amplitude."""
    asked, amplitudes = [], []

    def find(scene, periods, height, *_):
        asked.append(height)
        return made_up_response(direction_deg=0.0)

    def measured(scene, period, direction, amplitude):
        amplitudes.append(amplitude)
        return {"seconds": 1.0, "unsettled": 0.0, "heave": 7.2, "tension_top": 2000.0}

    monkeypatch.setattr(linear_api, "response", find)
    monkeypatch.setattr(response_runs, "measured", measured)
    arguments = ["short", "--periods", "4,5,8", "--verify", "5", "--no-plot", "--out", tmp_path]
    code, out, _ = call("response", *arguments, "--set", "waves.amplitude=0.7")
    assert code == 0
    assert asked == [pytest.approx(1.4)]
    assert amplitudes == [pytest.approx(0.7)]
    assert f"heave {0.9 * 8 / 7.2 * 100 - 100:+.1f} %, tension_top {-10.0:+.1f} %" in out


# -- offsets -----------------------------------------------------------------------------------------------------------

FORCES, SIDES = np.array([0.0, 2000.0, 4000.0]), np.array([0.0, 90.0, 200.0])


def made_up_offsets():
    """Of one buoy on one line, the largest offset towards 90 degrees at the middle force."""
    along = np.array([[1.0, 3.0, 5.0], [2.0, 7.0, 6.5], [1.5, 4.0, 8.0]])
    top = 10.0 * np.array([[10, 30, 50], [20, 70, 60], [15, 40, 80]])
    places = np.stack([along, 2 * along, -3 * along], axis=-1)[:, :, None]
    two = ("direction", "force")
    data = {
        "offset_along": ((*two, "buoy"), along[..., None]),
        "tension_top": ((*two, "cable"), top[..., None]),
        "buoy_position": ((*two, "buoy", "xyz"), places),
        "watch_radius": (("force", "buoy"), np.array([[1.0], [2.0], [9.25]])),
        "watch_centre": (("force", "buoy", "xy"), np.arange(6.0).reshape(3, 1, 2)),
    }
    data |= {name: (two, np.zeros((3, 3), dtype=bool)) for name in ("slack", "under")}
    labels = {"direction": SIDES, "force": FORCES, "cable": ["cable"], "buoy": ["buoy"], "xyz": list("xyz")}
    made = xr.Dataset(data | {"found": (two, np.ones((3, 3), dtype=bool))}, labels | {"xy": ["x", "y"]})
    made.slack[0, 1:], made.slack[1, 2], made.under[2, 2] = True, True, True
    return made


def test_the_figure_of_offsets():
    left, middle, right = linear_figures.offset_curves(made_up_offsets(), [(3.0, -4.0)]).axes
    curves = [[line.get_xydata() for line in axes.lines if line.get_linestyle() == "-"] for axes in (left, middle)]
    made = made_up_offsets()
    for i in range(3):
        np.testing.assert_allclose(curves[0][i], np.column_stack([FORCES / 1000, made.offset_along[i, :, 0]]))
        np.testing.assert_allclose(curves[1][i], np.column_stack([FORCES / 1000, made.tension_top[i, :, 0]]))  # N
    assert (left.get_xlabel(), middle.get_ylabel()) == ("force [kN]", "tension at the upper end [N]")
    bad = [tuple(point) for line in left.lines if line.get_marker() in "xv" for point in line.get_xydata()]
    assert bad == [(2.0, 3.0), (4.0, 5.0), (4.0, 6.5), (4.0, 8.0)]
    assert [3.0, -4.0] in [line.get_xydata()[0].tolist() for line in right.lines]


def test_the_table_of_offsets(told, tmp_path):
    """The largest offset along the load of each direction, the force there, and the largest tension."""
    linear._show_offsets(made_up_offsets(), "force", tmp_path)
    (rows,) = told[0].values()
    assert rows == [("0", "4000", "5", "500"), ("90", "2000", "7", "700"), ("200", "4000", "8", "800")]
    assert told[1] == ["At 4000 N the watch circle has a radius of 9.25 m about (4, 5)."]


@pytest.mark.parametrize("kind", [bool, "i1", float])
def test_sentences_about_offsets(kind):
    """Flags that were read back from a file may be numbers."""
    made = made_up_offsets()
    made = made.assign({name: made[name].astype(kind) for name in ("slack", "under", "found")})
    assert offset_record.sentences(made) == [
        "Towards 0 degrees, at 2000 to 4000 N: some of the line is slack.",
        "Towards 90 degrees, at 4000 N: some of the line is slack.",
        "Towards 200 degrees, at 4000 N: the buoy is drawn under the water.",
    ]


def test_loads_come_from_all_sides_that_are_given(call, tmp_path, monkeypatch):
    sides = []

    def find(_scene, _sizes, turns, *_, **__):
        sides.extend(turns)
        return made_up_offsets()

    monkeypatch.setattr(api, "offsets", find)
    arguments = ["short", "--force", "1", "--directions", "0,270,360,-45", "--no-plot", "--out", tmp_path]
    assert call("offsets", *arguments)[0] == 0
    assert sides == [0.0, 270.0, 315.0]


# -- beside MoorDyn ----------------------------------------------------------------------------------------------------


def test_the_table_beside_moordyn(call, tmp_path, monkeypatch):
    """Per cent in the table, a part in the file."""
    row = {"quantity": "anchor of line", "unit": "kN", "relative": 0.0123, "of": "range"}
    row |= {f"{what}{of}": 3.0 + k for k, what in enumerate(("mean", "least", "largest")) for of in ("", "_moordyn")}
    row |= {"mean_moordyn": 7.5, "bar": 0.25, "beyond": "yes"}
    monkeypatch.setattr(peer, "compare", lambda *_: peer.Comparison([row], ["no wind"], None, None))
    monkeypatch.setattr(peer, "draw", lambda *_: None)
    code, out, err = call("compare", "moordyn", "bridle", "--out", tmp_path)
    assert code == 0
    (line,) = [line for line in out.splitlines() if "anchor of line" in line]
    assert re.split(r"\s*\│\s*|\s{2,}", line.strip()) == [
        *("anchor of line", "kN", "3", "7.5", "4", "4", "5", "5", "0.25", "yes", "1.23", "range")
    ]
    assert "MoorDyn: no wind" in err
    assert json.loads((tmp_path / "comparison.json").read_text())["rows"] == [row]
