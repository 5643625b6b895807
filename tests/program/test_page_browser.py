"""Pages in a real browser: replay, scrubbing, keys, values, sizes, paper, no network, and nothing that gets in.

Source: the record that a page is made of; the browser's own console, list of requests and pictures.
"""

import re

import numpy as np
import pytest
from chromium import CHROMIUM, browser
from test_page import EVIL

from dolfbuoy import load_scene, simulate
from dolfbuoy.page.run_page import run_page

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
    window.prefer(dark=True)
    printed = window.paper()
    assert printed.startswith(b"%PDF")
    assert 2 <= printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") <= 9
    assert window.run("document.querySelector('#scene details').open")
    assert window.errors() == []


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
