"""Every number a page shows in a browser: legends, labels, charts, tables, and the picture between frames.

Source: the made-up record and datasets of test_page_numbers; a motion that cubics interpolate exactly.
"""

import json
import math
import re

import numpy as np
import pytest
from chromium import CHROMIUM, browser
from dynamics_helpers import rotation_matrix
from made_up import ALONE, PERIOD, SCENE
from test_page import data_of, precision_rows, unpacked
from test_page_numbers import BARS, LATE_FRAMES, RUN, cases, with_bars

from dolfbuoy import modes
from dolfbuoy.page.html import _with_imports
from dolfbuoy.page.result_pages import modes_page, precision_page, sweep_page
from dolfbuoy.page.run_page import run_page
from dolfbuoy.results.mode_record import KINDS, enlargement
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import STATISTICS

pytestmark = [pytest.mark.browser, pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")]


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.fixture(scope="module")
def page():
    return run_page(RUN, SCENE)


@pytest.fixture(scope="module")
def shapes():
    return modes("short", number=3)


def opened(window, folder, page):
    (folder / "page.html").write_text(page, encoding="utf-8")
    window.open(folder / "page.html", width=760, height=560)
    return window


def texts(window, chosen, what="textContent"):
    return window.run(f"[...document.querySelectorAll({json.dumps(chosen)})].map(e => e.{what})")


def labels(window):
    """What charts say of themselves to those who do not see them."""
    return texts(window, "svg.chart", "getAttribute('aria-label')")


def short(x, digits=4):
    """As core.js writes a number."""
    return f"{float(f'{x:.{digits - 1}e}'):.12g}".replace("-", "−")


def single(values):
    """As the page has them, in single precision."""
    return np.asarray(values, dtype="f4").astype(float)


def between(values, digits=4):
    return f"from {short(np.min(values), digits)} to {short(np.max(values), digits)}"


def test_error_bars_end_where_they_say(window, tmp_path):
    """Half as long as the bar, above and below the extreme, in the first picture."""
    opened(window, tmp_path, run_page(with_bars(RUN), SCENE))
    said = labels(window)[0]
    value, bar, _ = BARS["tension_top.max"]
    assert f"with error bars: {short(value / 1000)} ± {short(bar / 1000, 2)}, " in said
    first = "document.querySelector('#panels .chart')"
    paths = window.run(f"[...{first}.querySelectorAll('.errorbar')].map(e => e.getAttribute('d'))")
    assert len(paths) == 2
    high, low = (float(x) for x in re.fullmatch(r"M[\d.]+ ([\d.]+)h10m-5 0V([\d.]+)m-5 0h10", paths[0]).groups())
    heights = f"[...{first}.querySelectorAll('text[text-anchor=end]:not(.name)')]"
    ticks = window.run(f"{heights}.map(e => [e.getAttribute('y') - 4, e.textContent])")
    (y0, first_value), *_, (y1, last_value) = [(y, float(text)) for y, text in ticks]
    pixel = (last_value - first_value) / (y1 - y0)  # [kN]
    found = [first_value + pixel * (y - y0) for y in (high, low)]
    assert found == pytest.approx([(value + bar) / 1000, (value - bar) / 1000], abs=0.15 * abs(pixel))
    assert window.run(f"{first}.parentElement.querySelectorAll('.head .sample .errorbar').length") == 1


def test_numbers_of_a_run(window, tmp_path, page):
    found = data_of(page)
    opened(window, tmp_path, page)
    low, high = (short(x / 1000, 3) for x in found["view"]["lines"]["scale"])
    most = short(found["view"]["lines"]["largest"] / 1000, 3)
    assert texts(window, "#legend .tension") == [f"{low}{high} kN tension, in any step {most} at most"]
    assert len({low, high, most}) == 3
    x, y, z = ALONE.buoy_position.values.T
    curves = {
        "tension over time [kN]": {"upper end": ALONE.tension_top, "lower end": ALONE.tension_anchor},
        "height over time [m]": {"C": z, "water": ALONE.surface_elevation},
        "horizontal position of C over time [m]": {"x": x, "y": y},
    }
    said = labels(window)
    for title, each in curves.items():
        factor = 1e-3 if "[kN]" in title else 1.0
        packed = {name: single(factor * single(values)) for name, values in each.items()}
        assert f"{title}: " + "; ".join(f"{name} {between(values)}" for name, values in packed.items()) in said
    low, high = (ALONE[f"cable_tension_{name}_after_ramp"] / 1000 for name in ("minimum", "maximum"))
    mean = unpacked(found["envelopes"][0]["mean"]) / 1000
    label = f"Tension along the line [kN], from {short(mean.min())} to {short(high.max())}"
    assert label in said
    note = f"Range of all steps from 5 to 40 s, mean of {LATE_FRAMES.sum()} instants"
    assert any(text.startswith(note) for text in texts(window, ".figure .note"))
    room = [0.08 * np.ptp(values) + 0.02 for values in (x, y)]
    spans = [between([v.min() - r, v.max() + r], 3) + " m" for v, r in zip((x, y), room, strict=True)]
    assert f"Horizontal track of the buoys, within x {spans[0]}, y {spans[1]}" in said
    assert texts(window, ".drive + text") == [f"drive {short(1 / PERIOD, 3)} Hz"] * 2
    assert [label for label in said if "Spectrum" in label] == [
        "Spectrum of tension [kN²/Hz]",
        "Spectrum of position of C [m²/Hz]",
    ]
    arrows = [
        [float(x) for x in re.findall(r"-?[\d.]+(?:e-\d+)?", d)]
        for d in texts(window, "path.heading", "getAttribute('d')")
    ]
    assert len(arrows) == len(found["headings"]) == 4
    for (x0, y0, x1, y1, *_), (_, direction) in zip(arrows, found["headings"], strict=True):
        assert [x1 - x0, y0 - y1] == pytest.approx(26 * np.array(direction), abs=1e-9)  # y of SVG is downwards
    assert window.errors() == []


def test_turns_and_waves_of_a_picture(window, tmp_path, page):
    opened(window, tmp_path, page)
    q4, x, axis = np.array([0.5, 0.1, -0.7, 0.5]), [1.0, -2.0, 3.0], np.array([0.6, -0.48, 0.64])
    q4 /= np.linalg.norm(q4)
    R, moved, matrix, about = window.run(f"""(() => {{ {_with_imports("shapes")}
        const R = turnOf({q4.tolist()});
        return [R, turned(R, {x}), [...placed({x}, 2, R)], upright({axis.tolist()})] }})()""")
    assert np.array(R) == pytest.approx(rotation_matrix(q4), abs=1e-12)
    assert moved == pytest.approx(rotation_matrix(q4) @ x)
    assert np.reshape(matrix, (4, 4)).T[:3] == pytest.approx(np.column_stack([2 * np.array(R), x]), rel=1e-6, abs=1e-6)
    assert np.array(about)[:, 2] == pytest.approx(axis)
    assert np.array(about).T @ about == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(about) == pytest.approx(1.0)
    a, kx, ky, omega, phase = [0.8, 0.3], [0.1, 0.2], [0.05, -0.3], [1.0, 1.6], [0.4, 2.0]
    heights = window.run(f"""(() => {{ {_with_imports("sea")}
        const waves = Object.assign(Object.create(Waves.prototype),
            {{ amplitude: {a}, kx: {kx}, ky: {ky}, omega: {omega}, phase: {phase}, ramp: 8, count: 2 }});
        return [...waves.heights(2.0, [1, 5], [0, 3, 4])] }})()""")
    xs, ys = (places[..., None] for places in np.meshgrid([1, 5], [0, 3, 4], indexing="ij"))
    eta = np.cos(xs * kx + ys * ky - 2.0 * np.array(omega) + phase) @ a
    assert np.reshape(heights, (2, 3)) == pytest.approx(0.5 * (1 - math.cos(math.pi / 4)) * eta)


def test_a_camera_goes_along_with_a_buoy_and_labels_are_at_their_points(window, tmp_path, page):
    """Seen from the side, the heading of the waves is to the right or to the left, and the eye is on the near side."""
    opened(window, tmp_path, page)
    asides, target, style, hidden = window.run(f"""(() => {{ {_with_imports("viewer")}
        const made = (all) => Object.assign(Object.create(Viewer.prototype), {{ redraw: () => 0, ...all }});
        const one = made({{ follow: 1, camera: {{ target: [1, 2, 3] }},
            state: {{ buoys: [{{ at: [9, 9, 9] }}, {{ at: [4, 5, 6] }}] }} }});
        one.show({{ buoys: [{{ at: [0, 0, 0] }}, {{ at: [4.5, 4, 8] }}] }});
        const labels = [[3, 4, 5], null].map((node) => ({{ shown: {{ style: {{}} }}, node }}));
        const named = made({{ labels, shown: {{ names: true }}, node: (place) => place,
            painter: {{ project: (place) => place && [place[0] / 10, place[1] / 20] }} }});
        named.placeLabels();
        return [[0.3, 2, 4, 6].map((x) => one.aside(x)), one.camera.target, labels[0].shown.style,
            labels.map((label) => label.shown.hidden)] }})()""")
    for heading, azimuth in zip([0.3, 2, 4, 6], asides, strict=True):
        assert math.sin(azimuth) < 0
        assert math.cos(azimuth - heading) == pytest.approx(0, abs=1e-12)
    assert target == [1.5, 1, 5]
    assert style == {"left": "30%", "top": "20%"}
    assert hidden == [False, True]


def test_paper_is_light(window, tmp_path, page):
    """Whatever the colours of the screen, which come back afterwards."""
    opened(window, tmp_path, page)
    worn = "document.documentElement.dataset.theme"
    window.run("[1, 2].map(() => document.getElementById('theme').click())")
    assert window.run(worn) == "dark"
    assert window.run(f"(dispatchEvent(new Event('beforeprint')), {worn})") == "light"
    assert window.run(f"(dispatchEvent(new Event('afterprint')), {worn})") == "dark"


def test_a_picture_between_frames(window, tmp_path, page):
    """Nodes by cubics from positions and velocities: exact for a motion that is one."""
    opened(window, tmp_path, page)
    times = np.array([0.0, 1.5, 2.0])
    places = np.array([[[t**3 - t, 2 * t**2, 1 - t], [t, t**2, 3 * t**3]] for t in times])
    speeds = np.array([[[3 * t**2 - 1, 4 * t, -1], [1, 2 * t, 9 * t**2]] for t in times])
    script = f"""(() => {{ {_with_imports("motion")}
        const source = Object.create(Recorded.prototype);
        Object.assign(source, {{ frames: {times.tolist()}, nodes: 6, cells: 1,
            position: {places.ravel().tolist()}, velocity: {speeds.ravel().tolist()}, tension: [10, 40, 60] }});
        const {{ nodes, tension }} = source.lines(0.6);
        return [[...nodes], [...tension], source.frame(1.8).t, [...source.frame(0.7).tension]] }})()"""
    nodes, tension, nearest, before = window.run(script)
    t = 0.6
    assert nodes == pytest.approx([t**3 - t, 2 * t**2, 1 - t, t, t**2, 3 * t**3], abs=1e-12)
    assert tension == pytest.approx([10 + 30 * 0.4])
    assert (nearest, before) == (2.0, [10])


def test_numbers_of_modes(window, tmp_path, shapes):
    opened(window, tmp_path, modes_page(shapes))
    for k, row in enumerate(window.run("[...document.querySelectorAll('#table tbody tr')].map(r => r.innerText)")):
        mode = shapes.isel(mode=k)
        number, name, period, omega, damping, residual = row.split("\t")
        assert (number, name) == (str(k + 1), mode.name.item())
        assert period == (KINDS[mode.kind.item()] or short(mode.period.item(), 5))
        assert omega == short(mode.omega.item(), 5)
        ratio = mode.damping_ratio.item()
        assert damping == ("–" if math.isnan(ratio) else short(ratio))
        assert float(residual.replace("−", "-")) == pytest.approx(mode.residual.item(), rel=0.5)
    for k in range(3):
        window.run(f"document.querySelectorAll('#table tbody tr')[{k}].click()")
        shape = alone(shapes).isel(mode=k).cable_position.values
        most = np.hypot(shape[0], shape[1]).max()
        assert labels(window) == [f"Displacement along the line of mode {k + 1}, at most {short(most)}"]
        enlarged = short(enlargement(shapes, shapes.isel(mode=k)), 3)
        assert f"{enlarged} times the shape of modes.nc" in texts(window, "#legend")[0]
    assert window.errors() == []


def test_numbers_of_a_sweep(window, tmp_path):
    dataset = cases()
    opened(window, tmp_path, sweep_page(dataset))
    largest = dataset.tension_top_maximum.values[:, 0] / 1000
    listed = window.run("[...document.querySelectorAll('#table tbody tr')].map(r => r.innerText.split('\\t'))")
    for k, row in enumerate(listed):
        a, word = dataset.waves_amplitude.values[k], dataset.waves_stretching.values[k]
        value = "–" if np.isnan(largest[k]) else short(largest[k])
        assert row == [str(k + 1), short(a), word, value, dataset.status.values[k]]
    window.run("document.querySelectorAll('#table tbody tr')[2].click()")
    (shown,) = window.run("[...document.querySelectorAll('#chosen tbody tr')].map(r => r.innerText.split('\\t'))")
    values = {name: float(dataset[f"tension_top_{name}"][2, 0]) for name in STATISTICS}
    numbers = [value / (1 if name == "dominant_period" else 1000) for name, value in values.items()]
    assert shown == ["tension top", "kN", *map(short, numbers)]
    assert texts(window, "#chosen thead th")[2:] == ["least", "largest", "mean", "deviation", "period [s]"]
    assert texts(window, "#chosen strong")[0] == "Case 3: "
    assert texts(window, "#chosen pre")[0].endswith(" --out case-3")
    assert window.errors() == []


def test_numbers_of_work_and_precision(window, tmp_path):
    opened(window, tmp_path, precision_page(precision_rows(), []))
    listed = window.run("[...document.querySelectorAll('#table tbody tr')].map(r => r.innerText.split('\\t'))")
    assert listed[0][1:4] == ["0.4", "100", "1 %"]
    assert listed[1][1:4] == ["0.2", "100", "0.2 %"]
    assert labels(window) == ["Error of top tension over time of the loop, 2 cases, from 0.2 % on"]
