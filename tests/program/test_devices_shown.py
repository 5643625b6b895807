"""Take-offs and winches in all outputs: record, summary, snapshot, page, replay.

Source: the scene's own table of the winch; recorded take-off lengths against the drawn end points.
"""

import numpy as np
import pytest
from chromium import CHROMIUM, browser

from dolfbuoy import figures, load_scene, simulate
from dolfbuoy.model.winch import path_of
from dolfbuoy.page.run_page import data_of, run_page
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.summary import summary

ROWS = [[0.05, 10.0], [0.2, 9.9], [0.3, 9.95]]
#: A mass on a winch, held aside by a take-off.
SCENE = {
    "gravity": 9.81,
    "joint": [{"name": "load", "mass": 50.0}],
    "cable": {"length": 10.0, "elements": 2, "line_density": 1.0, "from": "load", "to": [0.0, 0.0, 0.0], "winch": ROWS},
    "take_off": {"from": [3.0, 0.0, -10.0], "to": "load", "stiffness": 20.0, "length": 1.0, "damping": 50.0},
    "time": {"end": 0.4, "step": 0.02, "scheme": "bdf2", "output_every": 0.1},
}


@pytest.fixture(scope="module")
def record():
    return simulate(SCENE)


def test_record_and_summary(record):
    np.testing.assert_allclose(record.winch_length.sel(winch="cable"), path_of(ROWS)(record.time), rtol=1e-12)
    rows = {name: value for name, value, _ in summary(record, load_scene(SCENE))}
    assert rows["unstretched length by the winch"] == "9.9 ... 10"


def test_they_are_drawn_where_they_are(record):
    frames = Frames(record, load_scene(SCENE))
    for number, time in enumerate(frames.times):
        now = frames.at(time)
        (ends,) = [device.at(now) for device in frames.devices]
        length = record.take_off_length.sel(time=time, method="nearest").item()
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(length, rel=1e-9), number
    (winch,) = [mark.node for mark in frames.marks if mark.kind == "winch"]
    np.testing.assert_allclose(now.x[winch], 0.0, atol=1e-12)
    legend = {text.get_text() for text in figures.snapshot(record).legends[0].get_texts()}
    assert {"take-off", "winch"} <= legend


def test_page(record):
    data = data_of(record, load_scene(SCENE))
    titles = {panel["title"] for panel in data["panels"] if panel["kind"] == "device"}
    assert titles == {"length of take-offs", "tension of take-offs", "absorbed power", "unstretched length"}
    assert {label["text"] for label in data["view"]["labels"]} == {"take-off", "winch"}
    assert data["view"]["devices"] == [{"ends": [{"at": [3.0, 0.0, -10.0]}, {"node": 0}]}]


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_replay(record, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(run_page(record), encoding="utf-8")
    with browser(tmp_path / "chromium") as page:
        page.open(path, width=760, height=560)
        page.choose("time", 0.2)
        page.pause()
        labels = page.run("[...document.querySelectorAll('.labels span:not([hidden])')].map(e => e.textContent)")
        assert set(labels) == {"take-off", "winch"}
        shown = page.run("[...document.querySelectorAll('.panel:not([hidden]) output')].map(e => e.textContent)")
        assert "9.9" in shown
        assert page.errors() == []
