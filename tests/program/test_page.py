"""Result pages as files: packed data, protection against injected content, sizes, and refusals.

Source: the record each page is made from, unpacked from the page; the policy's hashes, computed here.
"""

import base64
import hashlib
import html
import json
import re

import numpy as np
import pytest
import xarray as xr
from mpi_helpers import needs_mpirun, start

from dolfbuoy import InputError, load_scene, modes, sensitivities, show, simulate
from dolfbuoy.page.html import as_json, style_sheet, tag
from dolfbuoy.page.pack import chosen_rows, coarse, exact, single
from dolfbuoy.page.result_pages import precision_page, sweep_page
from dolfbuoy.page.run_page import run_page
from dolfbuoy.results.bars import rows_of
from dolfbuoy.results.parts import alone
from dolfbuoy.results.record import read
from dolfbuoy.results.sample import STATISTICS
from dolfbuoy.results.statistics import collect
from dolfbuoy.studies.study import Table, save

EVIL = "</title></script><script>document.title='taken'</script><img src=x onerror=\"document.title='taken'\">"


def unpacked(packed):
    """What core.js makes of an array."""
    raw = np.frombuffer(base64.b64decode(packed["data"]), dtype={"f8": "<f8", "f4": "<f4", "i2": "<i2"}[packed["type"]])
    if packed["type"] != "i2":
        return raw
    return np.where(raw == -32768, np.nan, packed["offset"] + packed["scale"] * raw)


def data_of(page):
    """The JSON block of a page."""
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)[1])


@pytest.fixture(scope="module")
def record():
    return simulate("short", waves__phase_deg=25.0)


@pytest.fixture(scope="module")
def page(record):
    return run_page(record)


def test_what_moves_the_answer(tmp_path, call):
    """Elasticities in the folder of a run are on its page, escaped, but not those of another scene."""
    changes = {"time.end": 12.0, "time.step": 0.1}
    options = [f"--set={key}={value}" for key, value in changes.items()]
    assert call("run", "short", *options, "--out", tmp_path, "--no-plot", "--page")[0] == 0
    assert "What moves the answer" not in (tmp_path / "page.html").read_text()
    found = sensitivities("short", ["buoy.mass", "sea.depth"], out=tmp_path, **changes)
    assert call("page", tmp_path)[0] == 0
    page = (tmp_path / "page.html").read_text()
    part = re.search(r'<section id="movers".*?</section>', page, re.DOTALL)[0]
    assert part.index("sea.depth") < part.index("buoy.mass")
    assert f"{float(found.elasticity.sel(output='tension_top.max')[1]):+.3f}" in part
    record = read(tmp_path / "results.nc")
    found["parameter"] = np.array([EVIL, "b"], dtype=object)
    assert EVIL not in run_page(record, slopes=found)
    other = run_page(record, load_scene("short", **changes, buoy__mass=500.0), slopes=found)
    assert "sensitivity.nc in this folder is of another scene" in other


def test_arrays_survive_their_packing():
    values = np.random.default_rng(1).uniform(-3e4, 7e4, (40, 3))
    np.testing.assert_array_equal(unpacked(exact(values)), values.ravel())
    np.testing.assert_allclose(unpacked(single(values)), values.ravel(), rtol=6e-8)
    values[5, 1] = np.nan
    np.testing.assert_allclose(unpacked(coarse(values)), values.ravel(), atol=np.nanmax(values) * 2e-5 + 0.6)
    assert unpacked(coarse(np.full(3, 2.5))).tolist() == [2.5, 2.5, 2.5]
    assert np.isnan(unpacked(coarse([np.nan, np.nan]))).all()


def test_peaks_stay_where_rows_are_left_out():
    rng = np.random.default_rng(2)
    columns = [rng.standard_normal(50_000) for _ in range(4)]
    columns[2][31_234] = 60.0
    rows = chosen_rows(columns, 4000)
    assert len(rows) <= 4000 + 2
    assert (np.diff(rows) > 0).all()
    assert rows[0] == 0
    assert rows[-1] == 49_999
    assert 31_234 in rows
    for column in columns:
        assert column[rows].max() == column.max()
        assert column[rows].min() == column.min()
    np.testing.assert_array_equal(chosen_rows(columns, 50_000), np.arange(50_000))


def test_a_page_holds_the_numbers_of_its_record(page, record):
    record = alone(record)
    found = data_of(page)
    np.testing.assert_array_equal(unpacked(found["time"]), record.time.values)
    curves = {(p["title"], c["name"]): unpacked(c["values"]) for p in found["panels"] for c in p["curves"]}
    x, y, z = record.buoy_position.values.T
    expected = {
        ("tension", "upper end"): record.tension_top,
        ("tension", "lower end"): record.tension_anchor,
        ("height", "C"): z,
        ("height", "water"): record.surface_elevation,
        ("horizontal position of C", "x"): x,
        ("horizontal position of C", "y"): y,
        ("angle", "pitch"): record.pitch,
    }
    for key, values in expected.items():
        np.testing.assert_allclose(curves[key], values, rtol=6e-8, atol=1e-30, err_msg=str(key))
    lines = found["view"]["lines"]
    reach = np.ptp(record.cable_position.values)
    np.testing.assert_allclose(
        unpacked(lines["position"]), record.cable_position.values.ravel(), atol=reach / 131068 * 1.001
    )
    np.testing.assert_allclose(unpacked(lines["tension"]), record.cable_tension.values.ravel(), rtol=6e-8)
    assert lines["largest"] == float(record.cable_tension_maximum.max()) > lines["scale"][1]
    (envelope,) = found["envelopes"]
    for key, name in (("low", "cable_tension_minimum_after_ramp"), ("high", "cable_tension_maximum_after_ramp")):
        np.testing.assert_allclose(unpacked(envelope[key]), record[name], rtol=6e-8)


def test_water_of_a_page_is_the_water_of_the_record(page, record):
    record = alone(record)
    found = data_of(page)
    waves = {name: unpacked(v) for name, v in found["view"]["sea"]["waves"].items() if name != "ramp"}
    t, (x, y, _) = record.time.values, record.buoy_position.values.T
    phases = np.outer(x, waves["kx"]) + np.outer(y, waves["ky"]) - np.outer(t, waves["omega"]) + waves["phase"]
    ramp = found["view"]["sea"]["waves"]["ramp"]
    grown = np.where(t < ramp, 0.5 * (1 - np.cos(np.pi * t / ramp)), 1.0)
    np.testing.assert_allclose(np.cos(phases) @ waves["amplitude"] * grown, record.surface_elevation, atol=1e-9)


def test_ends_of_lines_meet_their_buoys(page, record):
    record = alone(record)
    (held,) = data_of(page)["view"]["lines"]["held"]
    q = record.buoy_orientation.values
    w, v = q[:, :1], q[:, 1:]
    place = np.broadcast_to(held["place"], v.shape)
    turned = place + 2 * np.cross(v, np.cross(v, place) + w * place)
    np.testing.assert_allclose(record.buoy_position.values + turned, record.mooring_point.values, atol=1e-9)
    assert held["node"] == record.sizes["node"] - 1


def test_buoys_of_a_page_stand_upright_about_their_centres_of_mass(page, record):
    """Outline, point masses and mast over C; size of the largest extent."""
    (found,) = data_of(page)["view"]["buoys"]
    buoy = load_scene("short").buoys[0]
    bodies = [(buoy.mass, buoy.center_of_mass), *((p.mass, p.height) for p in buoy.point_masses)]
    center = sum(m * h for m, h in bodies) / sum(m for m, _ in bodies)
    np.testing.assert_allclose(found["outline"], [[h - center, d / 2] for h, d in buoy.hull])
    np.testing.assert_allclose(found["masses"], [h - center for _, h in bodies[1:]])
    np.testing.assert_allclose(found["mast"], [buoy.hull[-1][0] - center, max(h for _, h in bodies) - center])
    widest = max(d for _, d in buoy.hull)
    assert found["size"] == pytest.approx(max(widest, max(buoy.hull[-1][0], *(h for _, h in bodies))))
    np.testing.assert_allclose(found["start"], alone(record).buoy_position[0])


def test_policy_lets_in_what_is_there_and_nothing_else(page):
    policy = html.unescape(re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)[1])
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
    script = re.search(r'<script type="module">(.*?)</script>', page, re.DOTALL)[1]
    for text in (style, script):
        assert base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() in policy
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    assert "import" not in re.sub(r"\\w+import|//.*|/\*.*?\*/", "", script).split()
    assert not re.search(r"https?://(?!www\.w3\.org)", page)


def test_nothing_in_a_scene_gets_out_of_its_place(record):
    evil = record.copy()
    evil.attrs["scene"] = record.attrs["scene"].replace(
        "Tethered buoy, short cable (Sect. 5.1)", EVIL.replace('"', '\\"')
    )
    page = run_page(evil)
    assert page.count("<script") == 2
    assert page.count("</script>") == 2
    assert "<img" not in page
    assert html.escape(EVIL) in page
    assert "<" not in as_json({"title": EVIL})
    assert json.loads(as_json({"title": EVIL, "x": float("nan")})) == {"title": EVIL, "x": None}
    assert tag("p", EVIL, title=EVIL).count("<") == 2


def evil_pages():
    """Name -> page, of a run, modes, a sweep and work-precision whose every free text is EVIL, damaged files' too."""
    text = {"title": EVIL, "material__leg__source": EVIL}
    found = {"run": simulate("bridle", time__end=0.1, **text), "modes": modes("bridle", 2, **text)}
    for dataset in found.values():
        labels = {k: EVIL for k, v in dataset.attrs.items() if isinstance(v, str) and k not in ("scene", "conventions")}
        dataset.attrs |= labels | {"version_" + EVIL: EVIL, "parted": EVIL}
    found["modes"]["name"] = ("mode", np.array([EVIL, EVIL], dtype=object))
    rows = [{"changes": {EVIL: EVIL}, "status": EVIL, "statistics": {}}]
    rows += [
        {
            "changes": {EVIL: EVIL},
            "status": "done",
            "statistics": {f"tension_top of {EVIL}": dict.fromkeys(STATISTICS, 1.0)},
        }
    ]
    swept = collect(rows)
    swept["record"] = ("case", np.array(["javascript:alert(1)", EVIL], dtype=object))
    swept.attrs |= {"title": EVIL, "scene": EVIL, "source": EVIL}
    precise = [{k: EVIL if isinstance(v, str) else v for k, v in row.items()} for row in precision_rows()]
    pages = {"run": run_page(found["run"], case=EVIL), "modes": show(found["modes"]).page}
    return pages | {"sweep": sweep_page(swept), "precision": precision_page(precise, [EVIL], EVIL)}


def test_nothing_gets_out_of_its_place_in_any_page():
    for name, page in evil_pages().items():
        assert page.count("<script") == page.count("</script>") == 2, name
        assert page.count("</title>") == page.count("</pre>") + 1 - page.count("<pre") == 1, name
        assert "<img" not in page, name
        assert html.escape(EVIL) in page, name
        assert "javascript:" not in page, name


def test_a_run_of_two_minutes_is_below_two_megabytes(page, record):
    assert record.time[-1] == 120
    assert len(page.encode()) < 2e6


def test_command_writes_the_page_and_run_too(call, tmp_path):
    folder = tmp_path / "a"
    code, out, _ = call("run", "hanging-chain", "--out", folder, "--t-end", "0.5", "--no-plot", "--page")
    assert code == 0
    assert "page.html" in out
    first = (folder / "page.html").read_text()
    (folder / "page.html").unlink()
    assert call("page", folder)[0] == 0
    assert (folder / "page.html").read_text() == first
    assert call("run", "hanging-chain", "--out", tmp_path / "b", "--t-end", "0.5", "--no-plot")[0] == 0
    assert not (tmp_path / "b" / "page.html").exists()


def test_error_bars_stand_in_the_page(call, tmp_path):
    assert call("run", "driven", "--out", tmp_path / "plain", "--t-end", "2", "--no-plot", "--page")[0] == 0
    assert "The error of this run is not known" in (tmp_path / "plain" / "page.html").read_text()
    assert call("run", "driven", "--out", tmp_path / "bars", "--t-end", "2", "--no-plot", "--page", "--bars")[0] == 0
    page, rows = (tmp_path / "bars" / "page.html").read_text(), rows_of(read(tmp_path / "bars" / "results.nc"))
    assert "is not known" not in page
    assert len(rows) == 24
    for row in rows:
        assert f'<th scope="row">{row.name}</th><td>{row.value}</td><td>{row.bar}</td>' in page


@pytest.mark.parametrize("name", ["results.nc", "modes.nc", "sweep.nc", "work-precision.json"])
def test_damaged_results_are_named(call, tmp_path, name):
    (tmp_path / name).write_text('{"rows": [')
    (tmp_path / "scene.toml").touch()
    code, _, err = call("page", tmp_path)
    assert code == 2
    assert f"{name} is damaged" in err


def themes():
    """Name of a theme -> its colours (custom properties) as sRGB from 0 to 1."""
    blocks = re.findall(r":root[^{]*\{([^}]*)\}", style_sheet())
    assert blocks[1] == blocks[2].replace("  }", "    }") or blocks[1].split() == blocks[2].split()
    for name, block in zip(("light", "dark"), blocks, strict=False):
        pairs = re.findall(r"--([\w-]+): #([0-9a-f]{6});", block)
        yield name, {key: np.array([int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)]) for key, text in pairs}


def contrast(a, b):
    """Of two colours, as the Web Content Accessibility Guidelines count it."""
    linear = [np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) for c in (a, b)]
    low, high = sorted(float(c @ [0.2126, 0.7152, 0.0722]) for c in linear)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(("name", "colors"), list(themes()))
def test_texts_and_curves_stand_out_from_their_ground(name, colors):
    for text in ("text", "soft", "accent"):
        for ground in ("ground", "panel"):
            assert contrast(colors[text], colors[ground]) >= 4.5, (name, text, ground)
    assert contrast(colors["warn"], colors["warn-ground"]) >= 4.5
    assert contrast(colors["on-accent"], colors["accent"]) >= 4.5
    for k in range(6):
        assert contrast(colors[f"c{k}"], colors["ground"]) >= 3, (name, k)
    for kind in ("holds", "pulls", "outside"):
        assert contrast(colors[f"force-{kind}"], colors["sky-top"]) >= 4.5, (name, kind)
    away = [contrast(colors[f"scale-{k}"], colors["sky-low"]) for k in range(5)]
    assert (np.diff(away) > 0).all(), (name, away)  # more tension stands out more, without colour too


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_one_of_several_ranks_writes_the_page(tmp_path):
    arguments = ["-m", "dolfbuoy.commands.entry", "run", "short", "--out", "a", "--t-end", "0.1", "--no-plot", "--page"]
    done = start(2, arguments, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("page.html") == 1
    assert "buoy, heave" in (tmp_path / "a" / "page.html").read_text()


def test_a_page_of_ones_own_is_not_replaced(call, tmp_path):
    folder = tmp_path / "a"
    assert call("run", "hanging-chain", "--out", folder, "--t-end", "0.5", "--no-plot")[0] == 0
    (folder / "page.html").write_text("mine")
    code, _, err = call("page", folder)
    assert code == 2
    assert "page.html" in err
    assert (folder / "page.html").read_text() == "mine"


def test_a_folder_without_results_is_refused(call, tmp_path):
    code, _, err = call("page", tmp_path)
    assert code == 2
    assert "holds nothing that has a page" in err


def test_a_record_in_a_notebook_is_a_frame_apart(record):
    shown = show(record)
    framed = shown._repr_html_()
    assert framed.startswith("<iframe srcdoc=")
    assert 'sandbox="allow-scripts"' in framed
    assert framed.count("<") == 2
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', framed)[1]) == run_page(record)
    with pytest.raises(InputError, match="neither the record of a run nor modes"):
        show(xr.Dataset())


def test_modes_in_a_page_are_those_of_the_dataset():
    dataset = modes("short", number=4)
    found = data_of(show(dataset).page)
    assert [mode["name"] for mode in found["modes"]] == dataset.name.values.tolist()
    for mode, number in zip(found["modes"], range(4), strict=True):
        one = alone(dataset).isel(mode=number)
        assert mode["damping_ratio"] == (None if np.isnan(one.damping_ratio) else float(one.damping_ratio))
        np.testing.assert_allclose(unpacked(mode["position"]), one.cable_position.values.ravel(), rtol=6e-8, atol=1e-37)
        motion = np.concatenate([one.buoy_position.values, one.buoy_rotation.values], axis=-1)
        np.testing.assert_allclose(unpacked(mode["buoys"][0]), motion.ravel(), rtol=6e-8, atol=1e-37)


def sweep_dataset(title="a sweep"):
    """What a sweep of two keys leaves, with a case that failed."""
    rows = [
        {
            "changes": {"waves.amplitude": a, "waves.stretching": word},
            "status": "done" if a < 3 else "SolveError: <b>no</b>",
            "statistics": {"tension_top": dict.fromkeys(STATISTICS, 1000.0 * a)} if a < 3 else {},
        }
        for a in (1.0, 2.0, 3.0)
        for word in ("none", "wheeler")
    ]
    dataset = collect(rows)
    dataset.attrs["title"] = title
    return dataset


def test_a_sweep_in_a_page_has_all_its_cases():
    dataset = sweep_dataset()
    found = data_of(sweep_page(dataset))
    assert {one["key"]: one["values"] for one in found["varied"]} == {
        "waves.amplitude": [1.0, 1.0, 2.0, 2.0, 3.0, 3.0],
        "waves.stretching": ["none", "wheeler"] * 3,
    }
    (tension,) = found["quantities"]
    assert tension["unit"] == "kN"
    largest = unpacked(tension["statistics"]["maximum"])
    np.testing.assert_allclose(1000 * largest, alone(dataset).tension_top_maximum.values, rtol=6e-8)
    assert found["status"] == dataset.status.values.tolist()
    assert "<b>" not in sweep_page(dataset)


def precision_rows():
    """Two cases of work-precision, the scene's own and a better one, and one that failed."""
    common = {"pair": "P1-P0", "cells": 20, "step": 0.01, "tolerance": None, "steps": 100, "unknowns": 99}
    own = common | {"scheme": "backward-euler", "own": True, "reason": None, "wall": 0.4}
    own |= {"bound_tension_top": 0.01, "resolved_tension_top": True}
    better = own | {"scheme": "bdf2", "own": False, "wall": 0.2, "bound_tension_top": 0.002}
    return [own, better, common | {"scheme": "bdf2", "own": False, "reason": "it diverged"}]


def test_a_study_with_a_page_writes_it(tmp_path):
    save(tmp_path, Table("work-precision", precision_rows(), "a scene", notes=["a note"]))
    assert "<title>Work and precision of a scene</title>" in (tmp_path / "work-precision.html").read_text()
    assert data_of((tmp_path / "work-precision.html").read_text())["rows"] == precision_rows()
    save(tmp_path, Table("work-precision-front", precision_rows()))
    assert len(list(tmp_path.glob("*.html"))) == 1


def test_work_and_precision_in_a_page():
    page = precision_page(precision_rows(), ["1 % in top tension: P1-P0 & so on.", EVIL])
    found = data_of(page)
    assert found["rows"] == precision_rows()
    assert found["quantities"] == [{"key": "tension_top", "name": "top tension", "front": [1]}]
    assert "P1-P0 &amp; so on" in page
    assert "<img" not in page
