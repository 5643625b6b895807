"""Pages in a real browser: replay, scrubbing, keys, values, sizes, print, no network access, no injected content.

Source: the record a page is made from; the browser's console, request list and screenshots.
"""

import re
import shlex

import numpy as np
import pytest
from chromium import CHROMIUM, browser
from test_page import EVIL, evil_pages, precision_rows, sweep_dataset

from dolfbuoy import load_scene, modes, show, simulate
from dolfbuoy.page.result_pages import precision_page, sweep_page
from dolfbuoy.page.run_page import run_page
from dolfbuoy.results.parts import alone
from dolfbuoy.results.record import read
from dolfbuoy.studies.sweep import sweep

pytestmark = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")]
SMALL = {"width": 760, "height": 560}


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.fixture(scope="module")
def record():
    return simulate("short", time={"end": 30.0})


@pytest.fixture(scope="module")
def file(record, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(run_page(record), encoding="utf-8")
    return path


@pytest.fixture
def page(window, file):
    window.open(file, **SMALL)
    yield window
    assert window.errors() == []


def clock(page):
    return float(re.search(r"[\d.]+", page.run("document.getElementById('clock').textContent"))[0])


def scrub(page, t):
    page.choose("time", t)


def readouts(page):
    """(name of a curve, what stands behind it) of all panels that are seen."""
    return page.run(
        "[...document.querySelectorAll('.panel:not([hidden]) .key')].map(k => "
        "[k.children[1].textContent, k.querySelector('output').textContent])"
    )


def number(text):
    return float(text.replace("−", "-"))


def test_opens_from_disk_and_asks_for_nothing(page, file):
    assert page.requests() == [file.as_uri()]
    assert page.run("document.querySelector('.without').hidden")


def test_scrubbing_shows_the_values_of_the_record(page, record):
    record = alone(record)
    for t in (0.0, 7.31, 19.999, 30.0):
        scrub(page, t)
        row = int(np.abs(record.time.values - t).argmin())
        x, y, z = record.buoy_position.values[row]
        expected = {
            "upper end": 1e-3 * record.tension_top.values[row],
            "lower end": 1e-3 * record.tension_anchor.values[row],
            "C": z,
            "water": record.surface_elevation.values[row],
            "x": x,
            "y": y,
            "of C": record.offset.values[row],
            "lowest of the rim": record.freeboard.values[row],
            **{turn: record[turn].values[row] for turn in ("roll", "pitch", "yaw")},
        }
        shown = {name: number(text) for name, text in readouts(page)}
        assert shown.keys() == expected.keys()
        for name, value in expected.items():
            assert shown[name] == pytest.approx(value, rel=6e-4, abs=1e-12), (t, name)


def test_moments_jump_to_the_extremes_of_the_record(page, record):
    page.run("document.querySelector('.keys button').click()")
    row = int(record.tension_top.values.argmax())
    assert clock(page) == pytest.approx(float(record.time[row]), abs=0.006)
    said = page.run("document.querySelector('.keys .number').textContent")
    assert said == f"{1e-3 * float(record.tension_top.max()):.4g} kN"


def test_replay_advances_and_stops(page):
    scrub(page, 3.0)
    page.run("document.getElementById('play').click()")
    page.wait("parseFloat(document.getElementById('time').value) > 3.2")
    page.run("document.getElementById('play').click()")
    stopped = clock(page)
    page.pause()
    assert clock(page) == stopped
    page.wait("Math.abs(parseFloat(document.getElementById('canvas').dataset.t) - " + str(stopped) + ") < 0.01")


def test_keys_play_step_and_go_to_the_ends(page):
    page.run("document.getElementById('canvas').focus()")
    page.press("End")
    assert clock(page) == 30.0
    page.press(",")
    assert clock(page) == 29.99
    page.press("Home")
    assert clock(page) == 0.0
    page.press("2")
    assert page.run("document.querySelector('[data-look=buoy]').getAttribute('aria-pressed')") == "true"
    page.press(" ", " ")
    assert page.run("document.getElementById('play').textContent") == "Pause"
    page.press(" ", " ")
    assert page.run("document.getElementById('play').textContent") == "Play"


def test_picture_changes_with_time_view_and_what_is_shown(page):
    def pixels():
        page.pause()
        return page.run("document.getElementById('canvas').toDataURL()")

    scrub(page, 12.0)
    seen = [pixels()]
    for change in (
        "document.querySelector('[data-look=side]').click()",
        "document.querySelector('[data-show=water]').click()",
        "document.querySelector('[data-show=forces]').click()",
        "document.getElementById('theme').click(), document.getElementById('theme').click()",
    ):
        page.run(change)
        seen.append(pixels())
    scrub(page, 14.0)
    seen.append(pixels())
    assert len(set(seen)) == len(seen)


def test_window_follows_the_replay(page):
    def times():
        return page.run(
            "[...document.querySelector('.panel').querySelectorAll('text[text-anchor=middle]')].map(t => t.textContent)"
        )

    whole = times()
    page.choose("window", "document.getElementById('window').options[1].value")
    scrub(page, 11.0)
    first = times()
    scrub(page, 15.5)
    assert len({*map(tuple, (whole, first, times()))}) == 3


@pytest.mark.parametrize(("width", "height", "phone"), [(390, 844, True), (760, 560, False), (1500, 900, False)])
def test_nothing_is_wider_than_the_window(window, file, width, height, phone):
    window.open(file, width=width, height=height, phone=phone)
    assert window.run("document.documentElement.scrollWidth") <= width
    assert window.errors() == []


def test_paper_shows_it_all_in_the_light(window, file):
    window.open(file, **SMALL, dark=True)
    window.prefer(dark=True, media="print")
    window.pause()
    assert window.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert window.run("getComputedStyle(document.querySelector('.controls')).display") == "none"
    shape = "(c => c.clientWidth / c.clientHeight * c.height / c.width)(document.getElementById('canvas'))"
    assert window.run(shape) == pytest.approx(1, abs=0.02)
    window.prefer(dark=True)
    printed = window.paper()
    assert printed.startswith(b"%PDF")
    assert 2 <= printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") <= 9
    assert window.run("document.querySelector('#scene details').open")
    assert window.errors() == []


def test_paper_gets_the_same_picture_from_a_dark_page(window, file):
    pictures = []
    for dark in (False, True):
        window.open(file, **SMALL, dark=dark)
        seen = window.run("document.getElementById('canvas').toDataURL()")
        pictures.append(re.findall(rb"/Subtype /Image.*?endstream", window.paper(), re.DOTALL))
        window.pause()
        assert window.run("document.getElementById('canvas').toDataURL()") == seen
    assert pictures[0]
    assert pictures[0] == pictures[1]


def test_titles_and_names_are_only_text(window, tmp_path):
    scene = load_scene("three-legs", **{"title": EVIL, "time.end": 0.1}).to_dict()
    text = str(scene).replace("east", "x-onload").replace("north", "alert")
    record = simulate(eval(text))
    (tmp_path / "page.html").write_text(run_page(record), encoding="utf-8")
    window.open(tmp_path / "page.html", **SMALL)
    assert window.run("document.title") == EVIL
    assert window.run("document.querySelector('h1').textContent") == EVIL
    assert window.run("document.querySelectorAll('img, iframe, object').length") == 0
    assert window.run("document.scripts.length") == 2
    assert "x-onload" in window.run("document.querySelector('.labels').textContent")
    assert window.errors() == []


def test_texts_of_all_pages_are_only_text(window, tmp_path):
    for name, page in evil_pages().items():
        (tmp_path / "page.html").write_text(page, encoding="utf-8")
        window.open(tmp_path / "page.html", **SMALL)
        every = "document.querySelectorAll('tbody tr, button, summary, .mark')"
        window.run(f"{every}.forEach(e => e.dispatchEvent(new Event('click')))")
        window.pause()
        assert window.run("document.title") != "taken", name
        assert window.run("document.querySelectorAll('img, iframe, object, a').length") == 0, name
        assert window.run("document.scripts.length") == 2, name
        assert EVIL in window.run("document.body.textContent"), name
        assert window.errors() == [], name
        assert len(window.requests()) == 1, name


def test_policy_stops_what_were_to_get_in(window, file):
    window.open(file, **SMALL)
    window.run("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.taken = 1\">')")
    window.run(
        "document.body.append(Object.assign(document.createElement('script'), {textContent: 'window.taken = 1'}))"
    )
    window.pause()
    assert window.run("window.taken === undefined")
    assert len(window.requests()) == 1


def test_what_is_seen_has_names_for_those_who_do_not_see_it(page):
    unnamed = """[...document.querySelectorAll('button, input, select, canvas, svg[role=img]')].filter(e =>
        !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label')?.textContent.trim())).length"""
    assert page.run(unnamed) == 0
    assert page.run("document.querySelectorAll('h1').length") == 1
    assert page.run("document.documentElement.lang") == "en"
    assert "from" in page.run("document.querySelector('.panel svg.chart').getAttribute('aria-label')")


def test_modes_move_and_are_chosen(window, tmp_path):
    dataset = modes("short", number=4)
    (tmp_path / "modes.html").write_text(show(dataset).page, encoding="utf-8")
    window.open(tmp_path / "modes.html", **SMALL)
    window.run("document.querySelectorAll('#table tbody tr')[2].click()")
    legend = window.run("document.getElementById('legend').textContent")
    assert f"3: {dataset.name.values[2]}" in legend
    assert f"period {float(dataset.period[2]):.4g} s" in legend
    assert float(window.run("document.getElementById('time').max")) == pytest.approx(float(dataset.period[2]))
    window.pause()
    first = window.run("document.getElementById('canvas').toDataURL()")
    scrub(window, 0.5 * float(dataset.period[2]))
    window.pause()
    assert window.run("document.getElementById('canvas').toDataURL()") != first
    assert window.errors() == []


def test_without_webgl_the_charts_are_there(window, file, record):
    hide = "HTMLCanvasElement.prototype.getContext = () => null"
    hidden = window.ask("Page.addScriptToEvaluateOnNewDocument", source=hide)["identifier"]
    window.open(file, **SMALL)
    window.ask("Page.removeScriptToEvaluateOnNewDocument", identifier=hidden)
    assert "needs WebGL 2" in window.run("document.querySelector('.without:not([hidden])').textContent")
    assert window.run("[...document.querySelectorAll('.views')].every(views => views.hidden)")
    window.press("2")
    window.press("f")
    window.run("document.getElementById('play').click()")
    window.wait("parseFloat(document.getElementById('time').value) % 1 > 0.2")
    window.run("document.getElementById('play').click()")
    scrub(window, 8.0)
    row = int(np.abs(record.time.values - 8.0).argmin())
    shown = {name: number(text) for name, text in readouts(window)}
    assert shown["upper end"] == pytest.approx(1e-3 * record.tension_top.values[row], rel=6e-4)
    assert window.errors() == []


def test_graphics_that_are_lost_come_back(page):
    def pixels():
        page.pause()
        return page.run("document.getElementById('canvas').toDataURL()")

    scrub(page, 12.0)
    before = pixels()
    page.run(
        "window.graphics = document.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context')"
    )
    page.run("graphics.loseContext()")
    page.wait("document.querySelector('.without').textContent.includes('taken its graphics away')")
    scrub(page, 14.0)
    page.run("document.querySelector('[data-look=side]').click()")
    page.pause()
    page.run("graphics.restoreContext()")
    page.wait("document.querySelector('.without').hidden")
    after = pixels()
    page.run("document.querySelector('[data-look=whole]').click()")
    scrub(page, 12.0)
    assert pixels() == before != after
    expected = "CONTEXT_LOST_WEBGL: loseContext"  # the browser says so too, as a warning
    assert all(expected in str(event) for event in page.errors())
    page.events.clear()


def test_a_frame_in_a_notebook_plays_apart(window, record, tmp_path):
    cell = f"<!doctype html><meta charset=utf-8><title>notebook</title>{show(record)._repr_html_()}"
    (tmp_path / "notebook.html").write_text(cell, encoding="utf-8")
    window.open(tmp_path / "notebook.html", **SMALL)
    row = int(record.tension_top.values.argmax())
    said = window.run_in_frame("document.getElementById('clock').textContent")
    assert said == f"t = {float(record.time[row]):.2f} s"
    assert window.run_in_frame("window.origin") == "null"  # the notebook is out of its reach
    assert window.errors() == []


def cells(window, column):
    return window.run(f"[...document.querySelectorAll('#table tbody tr')].map(r => r.children[{column}].textContent)")


def test_a_sweep_is_sorted_and_its_cases_open(window, tmp_path):
    dataset = sweep_dataset(EVIL)
    (tmp_path / "sweep.html").write_text(sweep_page(dataset), encoding="utf-8")
    window.open(tmp_path / "sweep.html", **SMALL)
    assert cells(window, 3) == ["1", "1", "2", "2", "–", "–"]
    for _ in range(2):  # rising, then falling
        window.run("document.querySelectorAll('#table thead button')[3].click()")
    assert cells(window, 3) == ["2", "2", "1", "1", "–", "–"]
    assert window.run("document.querySelectorAll('#table thead th')[3].getAttribute('aria-sort')") == "descending"
    window.run("document.querySelectorAll('#table tbody tr')[5].click()")
    opened = window.run("document.getElementById('chosen').textContent")
    assert "SolveError: <b>no</b>" in opened
    assert "--set waves.amplitude=3 --set 'waves.stretching=\"wheeler\"'" in opened
    assert window.run("document.querySelectorAll('img, b').length") == 0
    assert window.errors() == []


def click_on_case(window, number):
    """With the mouse, as browsers let only what was asked for open a window."""
    row = f"document.querySelectorAll('#table tbody tr')[{number - 1}]"
    window.run(f"{row}.scrollIntoView({{block: 'center'}})")
    x, y = window.run(f"(({{left, top}}) => [left + 40, top + 8])({row}.getBoundingClientRect())")
    for kind in ("mousePressed", "mouseReleased"):
        window.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)


def test_a_click_on_a_case_opens_its_replay(window, tmp_path):
    scene = load_scene("short", **{"time.end": 1.0})
    dataset = sweep(scene, ["waves.amplitude=0.2,0.5"], None, tmp_path, keep=True)
    window.open(tmp_path / "sweep.html", **SMALL)
    click_on_case(window, 2)
    path = tmp_path / dataset.record.values[1]
    with window.opened((path / "page.html").as_uri()):
        window.wait("document.readyState === 'complete' && document.title !== ''")
        record = read(path / "results.nc")
        assert "case waves.amplitude = 0.5" in window.run("document.querySelector('header').textContent")
        said = window.run("document.querySelector('.keys .number').textContent")
        assert said == f"{1e-3 * float(record.tension_top.max()):.4g} kN"
        scrub(window, 0.5)
        assert clock(window) == 0.5
    link = window.run("document.querySelector('#chosen a').getAttribute('href')")
    assert link == f"{dataset.record.values[1]}/page.html"
    assert window.errors() == []


def test_the_command_of_a_case_gives_its_numbers(window, call, tmp_path):
    vary = ["--vary", "waves.amplitude=0.2,0.5", "--vary", "waves.stretching=none,wheeler"]
    common = ["short", "--set", "time.end=0.5", "--set", 'title="it\'s one"']
    assert call("sweep", *common, *vary, "--out", tmp_path / "sw")[0] == 0
    window.open(tmp_path / "sw" / "sweep.html", **SMALL)
    click_on_case(window, 4)
    command, *arguments = shlex.split(window.run("document.querySelector('#chosen pre').textContent"))
    window.run("document.querySelector('#chosen button').click()")
    window.wait("/Copied|Selected/.test(document.querySelector('#chosen button').textContent)")
    assert shlex.split(window.run("getSelection().toString()")) == [command, *arguments]
    assert command == "dolfbuoy"
    assert call(*arguments[:-1], tmp_path / "alone", "--no-plot")[0] == 0
    swept, alone = read(tmp_path / "sw" / "sweep.nc"), read(tmp_path / "alone" / "results.nc")
    assert float(swept.tension_top_maximum[3]) == float(alone.tension_top.max())
    assert "record" not in swept
    assert window.run("document.querySelector('#chosen a')") is None
    assert window.errors() == []


def test_a_mark_of_work_and_precision_finds_its_row(window, tmp_path):
    (tmp_path / "wp.html").write_text(precision_page(precision_rows(), [EVIL]), encoding="utf-8")
    window.open(tmp_path / "wp.html", **SMALL)
    marks = window.run("[...document.querySelectorAll('#charts .chart .mark')].map(m => m.getAttribute('aria-label'))")
    assert EVIL in window.run("document.getElementById('answer').textContent")
    assert [mark.rpartition(": ")[2] for mark in marks] == ["1 % in 0.4 s", "0.2 % in 0.2 s"]
    window.run("document.querySelectorAll('#charts .chart .mark')[1].dispatchEvent(new Event('click'))")
    assert "bdf2" in window.run("document.querySelector('#table tr.current').textContent")
    assert window.errors() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        "hanging-chain",
        "subsurface-float",
        "driven",
        "free-buoy",
        "chain-on-bed",
        "two-buoys",
        "lazy-wave",
        "storm",
        "towed-array",
    ],
)
def test_pages_of_all_kinds_of_scenes(window, tmp_path, scene):
    record = simulate(scene, time={"end": 6.0})
    (tmp_path / "page.html").write_text(run_page(record), encoding="utf-8")
    for dark in (False, True):
        window.open(tmp_path / "page.html", **SMALL, dark=dark)
        for look in ("buoy", "side", "above", "whole"):
            window.run(f"document.querySelector('[data-look={look}]').click()")
            scrub(window, 5.0)
            window.pause()
        assert window.errors() == []
        assert len(window.requests()) == 1
        assert window.run("document.documentElement.scrollWidth") <= SMALL["width"]
