"""Parts of pages, each alone at its limits: moving objects in the 3D view, boxes, fitting rows, bars, settings.

Source: positions and numbers by hand; a made-up record with a moving vessel.
"""

import importlib
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import PERIOD, RECORD, SCENE
from test_figures_read_back import swept
from test_page import unpacked

from dolfbuoy import InputError, load_scene, show
from dolfbuoy.errors import SolveError
from dolfbuoy.page import html, report, result_pages, run_page, series, view
from dolfbuoy.page.series import Line
from dolfbuoy.results import folder as folders
from dolfbuoy.results.criteria import Verdict
from dolfbuoy.results.frame import Frames

T = RECORD.time.values
pages = importlib.import_module("dolfbuoy.page.folder")

# -- the picture in space ----------------------------------------------------------------------------------------------

SHIP = {
    "name": "ship",
    "position": [12.0, 5.0, 0.0],
    "heading_deg": 90.0,
    "hull": [8.0, 2.0, -1.0, 3.0],
    "fairleads": {"bow": [3.0, 0.0, 1.0], "stern": [-3.0, 0.0, 1.0]},
    "motion": [[0.0, 0, 0, 0, 0, 0, 0], [20.0, 2.0, 0, 0.5, 0, 0, 0], [40.0, 0, 0, 0, 0, 0, 0]],
    "wind": {"speed_10m": 10.0, "area": 30.0, "height": 2.0},
}


@pytest.fixture(scope="module")
def with_a_ship():
    """Picture of the made-up run beside a ship that surges 2 m and heaves half a metre, held by a take-off."""
    scene = load_scene(
        SCENE,
        vessel=[SHIP],
        take_off=[{"name": "pto", "from": "ship.stern", "to": "buoy", "stiffness": 5.0, "length": 9.0, "damping": 3.0}],
    )
    force = np.array([3.0, 4.0, 0.0]) * T[:, None, None]
    record = RECORD.assign(wind_force=(("time", "vessel", "xyz"), force)).assign_coords(vessel=["ship"])
    rows = np.array([0, 100, 200, 400])
    return view.view_of(Frames(record, scene), rows), rows


def places(packed, count=1):
    return unpacked(packed).reshape(-1, count, 3)


def test_a_ship_and_what_is_on_it_move_in_a_page(with_a_ship):
    """Corners of its box, an end of the take-off, and where the wind pushes, in the world's axes."""
    found, rows = with_a_ship
    there = np.interp(T[rows], [0.0, 20.0, 40.0], [0.0, 1.0, 0.0])
    start = np.array([12.0, 5.0, 0.0]) + np.outer(there, [2.0, 0.0, 0.5])
    np.testing.assert_allclose(places(found["forces"][-1]["path"])[:, 0], start + [0.0, 0.0, 2.0], atol=1e-3)
    corners = [[-b, a, c] for a in (-4.0, 4.0) for b in (-1.0, 1.0) for c in (-1.0, 3.0)]
    (ship,) = found["vessels"]
    np.testing.assert_allclose(np.reshape(ship["at"], (8, 3)), start[0] + corners, atol=1e-12)
    np.testing.assert_allclose(places(ship["path"], 8), start[:, None] + corners, atol=1e-3)
    (device,) = found["devices"]
    low, high = device["ends"]
    np.testing.assert_allclose(places(low["path"])[:, 0], start + [0.0, -3.0, 1.0], atol=1e-3)
    assert (high["buoy"], high.get("path"), len(high["place"])) == (0, None, 3)
    np.testing.assert_allclose(
        places(found["forces"][-1]["values"])[:, 0], np.outer(T[rows], [3.0, 4.0, 0.0]), atol=2e-3
    )
    assert found["largestForce"] == pytest.approx(
        max(200.0, *np.linalg.norm(RECORD.anchor_force.values[rows, 0], axis=1))
    )
    assert [label for label in found["labels"] if "node" not in label] == [
        {"text": "take-off", "device": 0}, {"text": "ship", "vessel": 0},
    ]  # fmt: skip


@pytest.mark.parametrize("count", [1, 2])
def test_what_has_a_name_in_a_picture(monkeypatch, count):
    """Lines, at their middles, and buoys where there are several; devices, winches and vessels always."""
    monkeypatch.setattr(view, "winches_of", lambda network: [("w", 0, 1)])
    named = [SimpleNamespace(name=name, node=slice(*node)) for name, node in (("a", (0, 5)), ("b", (5, 12)))][:count]
    frames = SimpleNamespace(spans=named, buoys=["x", "y"][:count], devices=named, network=None)
    frames.shells, frames.node_of = [SimpleNamespace(name="ship")], lambda piece, end: 7 + piece + 10 * end
    always = [{"text": "ship", "vessel": 0}, {"text": "winch w" if count > 1 else "winch", "node": 17}]
    assert view.labels(frames) == {
        1: [{"text": "take-off", "device": 0}, *always],
        2: [
            {"text": "a", "node": 2}, {"text": "b", "node": 8}, {"text": "x", "buoy": 0}, {"text": "y", "buoy": 1},
            {"text": "a", "device": 0}, {"text": "b", "device": 1}, *always,
        ],
    }[count]  # fmt: skip


@pytest.mark.parametrize(
    ("low", "high", "size", "depth", "bottom", "top"),
    [
        (-8.0, 2.0, 0.0, 20.0, -8.0, 2.5),  # the surface within; the bed more than 0.4 of the height below
        (-8.0, 2.0, 0.0, 11.9, -11.9, 2.5),
        (-8.0, 2.0, 0.0, 12.1, -8.0, 2.5),
        (-8.0, 2.0, 5.0, 20.0, -8.0, 5.0),  # 0.6 of the buoy's size above
        (-15.0, -5.1, 0.0, 50.0, -15.0, -5.1),  # further below the water than half the height
        (-15.0, -4.9, 0.0, 50.0, -15.0, 2.5),
        (4.9, 15.0, 0.0, 50.0, -2.5, 15.0),
        (5.1, 15.0, 0.0, 50.0, 5.1, 15.0),
        (-1.0, 9.0, 0.0, 50.0, -2.5, 9.0),
    ],
)
def test_the_box_of_a_picture(monkeypatch, low, high, size, depth, bottom, top):
    """Around everything; water and bed if they are near."""
    monkeypatch.setattr(view, "highest_water", lambda scene: 2.5)
    scene = SimpleNamespace(sea=SimpleNamespace(depth=depth))
    points = np.array([[0.0, 1.0, low], [2.0, 4.0, high]])
    box = view.box_around(SimpleNamespace(scene=scene, places=points), [{"size": size}, {"size": size / 2}])
    room = 0.6 * size
    np.testing.assert_allclose(box, [[-room, 1 - room, bottom], [2 + room, 4 + room, top]])
    dry = view.box_around(SimpleNamespace(scene=SimpleNamespace(sea=None), places=points), [])
    np.testing.assert_allclose(dry, points)


def test_colours_leave_out_half_a_percent_at_either_end():
    assert view.scale_of(np.array([*range(1001), np.nan])) == pytest.approx([5.0, 995.0])


def test_frames_that_a_picture_keeps(monkeypatch):
    """Every second, third, ..., and the last one, by the bytes that they take: 16 characters for each three numbers."""
    frames = RECORD.frame.values
    size = 7 * 3 * len(frames) * 16 / 3
    for most, every in ((size, 1), (size - 1, 2), (size / 3, 3), (size / 3.01, 4)):
        monkeypatch.setattr(view, "MOST_OF_FRAMES", most)
        found = view.view_of(Frames(RECORD, SCENE), np.arange(3))["lines"]
        kept = sorted({*frames[::every], frames[-1]})
        np.testing.assert_array_equal(unpacked(found["time"]), kept)
        rows = np.searchsorted(frames, kept)
        np.testing.assert_allclose(unpacked(found["tension"]), RECORD.cable_tension.values[rows].ravel(), rtol=1e-7)
    assert found["largest"] == RECORD.cable_tension_maximum.values.max()


@pytest.mark.parametrize(("wide", "direction"), [(1.5, 30.0), (1.51, 0.0), (1 / 1.5, 30.0), (1 / 1.51, 90.0)])
def test_from_where_a_picture_is_seen(monkeypatch, wide, direction):
    """Along the waves unless something is half as wide again."""
    monkeypatch.setattr(view, "box_around", lambda frames, buoys: [[0.0, 0.0, 0.0], [3 * wide, 3.0, 9.0]])
    assert view.view_of(Frames(RECORD, SCENE), np.arange(3))["direction"] == direction


# -- series ------------------------------------------------------------------------------------------------------------


def test_rows_that_fit(monkeypatch):
    """Bytes of a row: 8 of the time, 4 of each curve, 14 of a buoy and 2 of each component of a force."""
    columns = [("", "line", "tension", "N", 1.0, [("a", 0), ("b", 0)]), ("", "buoy", "height", "m", 1.0, [("C", 0)])]
    parts = [SimpleNamespace(record={"buoy_position"}), SimpleNamespace(record={"tension_top"})]
    width = 8 + 4 * 3 + 14 + 2 * 3
    assert series.rows_that_fit(RECORD, parts, columns) == int(1_250_000 * 0.75 / width)
    monkeypatch.setattr(series, "MOST_OF_SERIES", 600 * width)
    assert series.rows_that_fit(RECORD, parts, columns) == 600


@pytest.mark.parametrize(("far", "apart"), [(3.0, False), (3.01, True)])
def test_curves_share_an_axis_where_they_can_be_told_apart(far, apart):
    """Together three times as high as the widest of the first at most."""
    near = [Line("roll", np.array([0.0, 1.0])), Line("pitch", np.array([0.5, 0.6]))]
    every = [*near, Line("yaw", np.array([far - 0.2, far]))]
    panels = series._split("angle", "deg", every)
    assert panels == (
        [("angle", "deg", 1.0, near), ("yaw", "deg", 1.0, every[2:])] if apart else [("angle", "deg", 1.0, every)]
    )
    both = [Line("x", np.array([0.0, 1.0])), Line("y", np.array([far - 0.2, far]))]
    panels = series._split("horizontal position of C", "m", both)
    assert [title for title, *_ in panels] == (["x of C", "y of C"] if apart else ["horizontal position of C"])
    assert [title for title, *_ in series._split("height", "m", both)] == ["height"]


def test_places_whose_tension_varies_most():
    """Six of them, in their order, by their segments where there are several."""
    names = np.array([f"line.{k} at {10 * k} m" for k in range(7)] + ["line at touchdown"])
    sizes = np.array([5.0, 1.0, 7.0, 2.0, 2.0, 8.0, 9.0, 3.0])
    values = np.array([[0.0], [1.0]]) * sizes
    found = {line.name: line.values for line in series._at_places(names, values)}
    assert list(found) == ["0 0 m", "2 20 m", "3 30 m", "5 50 m", "6 60 m", "touchdown"]
    assert [x[1] for x in found.values()] == [5.0, 7.0, 2.0, 8.0, 9.0, 3.0]


# -- words and tables --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("share", "x", "width"),
    [(1.0, "30", "30.00"), (0.5, "30", "15.00"), (-0.25, "22.5", "7.50"), (-2.0, "0.0", "30.00"),
     (math.nan, "30", "0.00")],
)  # fmt: skip
def test_bars_in_a_table(share, x, width):
    bar = run_page._bar(share)
    assert (re.search(r'<rect x="([^"]*)"', bar)[1], re.search(r' width="([^"]*)" height="8"', bar)[1]) == (x, width)
    assert bar.startswith('<svg viewBox="0 0 60 10" width="60" height="10"')
    assert all(part in bar for part in (' y="1" ', 'fill="currentColor"', 'aria-hidden="true"'))


def test_settings_of_a_run():
    """Steps of a period, elements of lines that are alike and that are not, steps that adapt."""
    record = RECORD.assign_attrs(unknowns=345)
    rows = dict(run_page.settings_of(record, SCENE))
    elements = SCENE.network.pieces[0].section.elements
    assert rows == {
        "scheme": rows["scheme"], "step": "0.1 s", "steps in a period of the drive": f"{PERIOD / 0.1:.4g}",
        "elements": f"P1-P0, {elements}", "unknowns": "345",
        "Newton iterations in a step": rows["Newton iterations in a step"],
        "steps that failed and were retried": "7",
    }  # fmt: skip
    assert float(rows["Newton iterations in a step"]) == pytest.approx(3.0, abs=0.01)
    sizes = np.where(np.arange(len(T)) == 5, 0.025, 0.1)
    sizes[0] = 0.001  # no step has led there
    adaptive = load_scene(SCENE, time__tolerance=1e-3)
    rows = dict(run_page.settings_of(record.assign(time_step=("time", sizes)), adaptive))
    assert rows["step"] == "adaptive, local error 0.001: 0.025 ... 0.1 s"
    assert "steps in a period of the drive" not in rows
    assert run_page.settings_of(record, SimpleNamespace(time=None)) == []
    line = {"line_density": 9.0, "axial_stiffness": 1e6, "from": [0.0, 0.0, 0.0], "to": [9.0, 0.0, 0.0], "length": 9.0}
    for counts, said in (((4, 4, 4), "P1-P0, 3 x 4"), ((4, 5), "P1-P0, 4 + 5"), ((4,), "P1-P0, 4")):
        cables = [line | {"name": f"c{k}", "elements": n} for k, n in enumerate(counts)]
        scene = load_scene({"cable": cables, "time": {"end": 1.0, "step": 0.1}})
        assert dict(run_page.settings_of(record, scene))["elements"] == said
    begun = dict(run_page.settings_of(record.isel(time=slice(1)), SCENE))
    assert "Newton iterations in a step" not in begun
    sound = record.copy()
    sound.attrs = {"unknowns": 345}
    assert dict(run_page.settings_of(sound, SCENE))["steps that failed and were retried"] == "0"


def test_what_the_scheme_leaves_of_free_motions(monkeypatch):
    """By (1 + (w h)^2)^(-n/2) of backward Euler; of what `check` finds, or `derived` without its equilibrium."""
    found, fails = SimpleNamespace(periods={"heave": 60.0}), [InputError("no"), SolveError("no")]
    monkeypatch.setattr(run_page, "check", lambda scene, comm: found)
    monkeypatch.setattr(run_page, "derived", lambda scene: SimpleNamespace(periods={"pitch": 30.0}))
    for name, period in (("heave", 60.0), ("pitch", 30.0), ("pitch", 30.0)):
        left = 100 * (1 + (2 * math.pi / period * 0.1) ** 2) ** (-400 / 2)
        cells = re.findall(r'scope="row">(.*?)</th><td>(.*?)</td><td>(.*?)</td>', run_page._periods(SCENE))
        assert cells == [(name, f"{period:g}", f"{left:.1f} %")]
        monkeypatch.setattr(run_page, "check", lambda scene, comm: (_ for _ in ()).throw(fails.pop()))
    monkeypatch.setattr(run_page, "check", lambda scene, comm: found)
    for scene in (SimpleNamespace(time=None), SimpleNamespace(time=SimpleNamespace(end=0.0))):
        assert run_page._periods(scene) is None
    found.periods = {}
    assert run_page._periods(SCENE) is None
    assert run_page.movers(xr.Dataset(), SCENE) is None


@pytest.mark.parametrize(
    ("value", "judged", "said"),
    [
        (5.0, True, "All 1 criteria are met; offset is the closest (met, 50 % left)."),
        (12.0, True, "1 of 1 criteria are not met."),
        (
            5.0,
            False,
            "The criteria were not judged: no case has numbers after its ramp, by this version of the program.",
        ),
    ],
)
def test_what_a_report_concludes(value, judged, said):
    scene = load_scene(SCENE, criteria={"largest_offset": 10.0})
    found = report._conclusion(scene, [Verdict("offset", "buoy", value, 10.0, "m")] if judged else [])
    assert re.findall("<p>(.*?)</p>", found)[0].startswith(said)
    assert ("12 m, at most 10 m" in found) == (value > 10.0)


def test_what_governs_is_known_where_it_is_a_number():
    """The first where a record does not say."""
    tension = np.array([[1.0, 5.0, np.nan], [2.0, 3.0, np.nan]])
    record = xr.Dataset({"tension_top": (("time", "cable"), tension)})
    assert report._governing(record, "cable", ["a", "b", "c"]) == "b"
    assert report._governing(record, "buoy", ["a", "b"]) == "a"
    assert report._governing(record, "cable", []) is None
    assert report._governing(record.isel(cable=[2]), "cable", ["c"]) == "c"


def test_a_page_in_a_notebook(monkeypatch):
    """As high as is asked for, 820 pixels else; of a run and of modes."""
    monkeypatch.setattr(run_page, "run_page", lambda record, scene: "x" * 2_340_000)
    monkeypatch.setattr(result_pages, "modes_page", lambda record, scene: "modes")
    whole = show(RECORD)
    assert (whole.height, repr(whole)) == (820, "<page of 2.3 MB: the last line of a notebook's cell shows it>")
    assert "width: 100%; height: 300px; border: 1px" in show(RECORD, SCENE, 300)._repr_html_()
    modes = show(xr.Dataset({"eigenvalue": 1.0}), height=90)
    assert (modes.page, modes.height) == ("modes", 90)


def test_every_page_of_a_folder_or_one_of_them(tmp_path, monkeypatch):
    """Each belongs to its result."""
    known = {name: page._replace(make=lambda file: file.name) for name, page in pages.PAGES.items()}
    monkeypatch.setattr(pages, "PAGES", known)
    for name in ("modes.nc", "sweep.nc"):
        (tmp_path / name).touch()
    assert [path.name for path in pages.write_pages(tmp_path, "sweep.nc")] == ["sweep.html"]
    assert [path.name for path in pages.write_pages(tmp_path)] == ["modes.html", "sweep.html"]
    assert (tmp_path / "modes.html").read_text() == "modes.nc"
    assert [folders.remarks(tmp_path, kind)["files"] for kind in ("modes", "sweep")] == [["modes.html"], ["sweep.html"]]


def test_numbers_of_a_sweep_that_are_too_many(monkeypatch):
    """Of more than so many numbers the largest, the mean and the deviation."""
    kept = []
    monkeypatch.setattr(result_pages, "_quantity", lambda label, name, one, which: kept.append(which) or {})
    monkeypatch.setattr(result_pages, "each_series", lambda dataset, word: [("a", "a", dataset)] * 2)
    dataset = xr.Dataset({"x": ("case", np.arange(3.0)), "status": ("case", ["done"] * 3)}, attrs={"varied": "x"})
    for most in (30, 29):
        monkeypatch.setattr(result_pages, "MOST_NUMBERS", most)
        result_pages.sweep_data(dataset)
    assert kept == [result_pages.STATISTICS] * 2 + [("maximum", "mean", "standard_deviation")] * 2


def test_parts_of_a_page():
    """Names of attributes, escaped texts, and what is not there."""
    assert html.tag("p", "a<b", None, html.Markup("<i>"), class_="x", data_t='"') == (
        '<p class="x" data-t="&quot;">a&lt;b<i></p>'
    )
    assert html.warnings([]) is None
    assert [re.search("<strong>(.*?)</strong>", html.warnings(["w"] * n))[1] for n in (1, 2)] == [
        "Warning",
        "2 warnings",
    ]
    assert "All cases are this scene" in html.scene("t", common=True)
    assert "it gives the same again: dolfbuoy run FILE." in html.scene("t")
    told = html.versions({"version_b": "2", "created": "now", "ranks": 3, "other": 1})
    assert re.findall(r'scope="row">(.*?)</th><td>(.*?)</td>', told) == [
        ("computed", "now"),
        ("b", "2"),
        ("ranks", "3"),
    ]
    page = html.page("a & b", ["one"], html.Markup("<hr>"), data={"x": math.inf, "y": (1, 2.5)})
    assert "<title>a &amp; b</title>" in page
    assert '{"x":null,"y":[1,2.5]}' in page
    assert "img-src data:; style-src" in page
    assert ("Colours: auto" in page, "noscript" in page) == (False, False)
    assert "caption" not in html.table(["a"], [])


def test_a_page_of_a_sweep_leads_to_its_own_records_only():
    good = "records/0123456789abcdef0123"
    places = [good, "records/0123456789abcdef012", "records/../x", "http://a/" + good, good + "4", ""]
    made = swept([{"a.x": float(k)} for k in range(6)]).assign(record=("case", np.array(places, dtype=object)))
    assert result_pages.sweep_data(made)["records"] == [good, "", "", "", "", ""]
    assert "opens its replay" in result_pages.sweep_page(made)
    assert "opens its replay" not in result_pages.sweep_page(made.drop_vars("record"))
