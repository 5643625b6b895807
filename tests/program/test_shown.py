"""Displays show recorded data: curves of figures and pictures of an instant, with their units.

Source: a made-up record of distinct quantities, read back from the figures.
"""

import itertools
import math
import re
import sys

import numpy as np
import pytest
from dynamics_helpers import rotation_matrix
from made_up import ALONE, PERIOD, RECORD, SCENE
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from scipy import signal
from scipy.integrate import trapezoid

from dolfbuoy import InputError, figures, load_scene
from dolfbuoy.model.sea import heading, velocity_at, wavenumber
from dolfbuoy.results.after_ramp import density, welch
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.series import mean_over_time
from dolfbuoy.results.snapshot import snapshot
from dolfbuoy.results.style import COLORS


def curves(axes):
    """Label -> (x, y) of the lines of a panel; a name of matplotlib's own for what has no label."""
    return {line.get_label(): np.array(line.get_data()) for line in axes.lines}


# -- figures -----------------------------------------------------------------------------------------------------------


def test_tension():
    """Both ends in kN over the whole time, and enlarged over the last three periods."""
    whole, end = figures.tension(RECORD, SCENE).axes
    assert whole.get_ylabel() == "tension [kN]"
    assert end.get_xlabel() == "time [s]"
    late = RECORD.time.values >= 40 - 3 * PERIOD
    for axes, rows in ((whole, slice(None)), (end, late)):
        found = curves(axes)
        for label, name in (("upper end", "tension_top"), ("anchor", "tension_anchor")):
            np.testing.assert_allclose(found[label], [RECORD.time[rows], ALONE[name][rows] / 1000])


def test_heave_and_cone_angle():
    """Height of C, of the water, and their difference; the angle in degrees."""
    z, water = ALONE.buoy_position.values[:, 2], ALONE.surface_elevation.values
    heights, difference, _ = figures.heave(RECORD, SCENE).axes
    found = curves(heights)
    np.testing.assert_allclose(found["$r_{C,z}$, centre of mass"], [RECORD.time, z])
    np.testing.assert_allclose(found["$z_w$, water surface"], [RECORD.time, water])
    np.testing.assert_allclose(difference.lines[0].get_ydata(), z - water)
    assert [axes.get_ylabel() for axes in (heights, difference)] == ["height [m]", "$r_{C,z} - z_w$ [m]"]
    (angle, _) = figures.cone_angle(RECORD, SCENE).axes
    np.testing.assert_allclose(angle.lines[0].get_data(), [RECORD.time, ALONE.cone_angle])
    assert angle.get_ylabel() == "cone angle [°]"


def test_trajectory_and_orbit():
    """The path from above and from the side, its last period set off; the same period alone."""
    x, late = ALONE.buoy_position.values, RECORD.time.values >= 40 - PERIOD - 1e-6
    for axes, (i, j) in zip(figures.trajectory(RECORD, SCENE).axes, ((0, 1), (0, 2)), strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == (f"{'xyz'[i]} [m]", f"{'xyz'[j]} [m]")
        np.testing.assert_allclose(axes.lines[0].get_data(), x[:, [i, j]].T)
        found = curves(axes)
        np.testing.assert_allclose(found["last period"], x[late][:, [i, j]].T)
        np.testing.assert_allclose(found["start"].ravel(), x[0, [i, j]])
        np.testing.assert_allclose(found["end"].ravel(), x[-1, [i, j]])
    (space,) = figures.orbit(RECORD, SCENE).axes
    paths = [np.array(line.get_data_3d()) for line in space.lines]
    assert any(path.shape == x[late].T.shape and np.allclose(path, x[late].T) for path in paths)
    marks = {line.get_label(): np.ravel(line.get_data_3d()) for line in space.lines}
    np.testing.assert_allclose(marks["start of the period"], x[late][0])
    np.testing.assert_allclose(marks["end"], x[-1])


def test_a_constant_is_a_line_in_the_middle():
    """Rounding noise does not fill a panel."""
    record = RECORD.copy(deep=True)
    record["cone_angle"] = 7.0 + 1e-9 * np.cos(record.time)
    low, high = figures.cone_angle(record, SCENE).axes[0].get_ylim()
    assert (low + high) / 2 == pytest.approx(7.0, abs=1e-6)
    assert 1e-3 * (1 - 1e-9) < high - low < 0.1


def test_a_planar_path_is_shown_from_its_side():
    record = RECORD.copy(deep=True)
    record.buoy_position[:, 0, 0] = 3.0
    side, time = figures.trajectory(record, SCENE).axes
    np.testing.assert_allclose(side.lines[0].get_data(), record.buoy_position.values[:, 0, 1:].T)
    np.testing.assert_allclose(time.lines[0].get_data(), [record.time, record.buoy_position[:, 0, 1]])
    assert (side.get_xlabel(), time.get_xlabel(), time.get_ylabel()) == ("y [m]", "time [s]", "y [m]")


def test_shapes():
    """Cables of the last period, each with the colour of its time."""
    axes = figures.shapes(RECORD, SCENE).axes[0]
    (lines,) = axes.collections
    times = np.array(lines.get_array())
    assert len(times) == 13
    assert times[0] == pytest.approx(40 - PERIOD, abs=0.21)
    assert times[-1] == pytest.approx(40)
    for time, segment in zip(times, lines.get_segments(), strict=True):
        row = ALONE.cable_position.sel(frame=time, method="nearest")
        assert float(row.frame) == pytest.approx(time)
        np.testing.assert_allclose(segment, row.values[:, [0, 2]])


def test_envelope():
    """Least and largest of every step, mean of the frames of every element, after the ramp, over its arc length."""
    (axes,) = figures.envelope(RECORD, SCENE).axes
    ramp = SCENE.waves.ramp
    assert ramp > 0
    T = ALONE.cable_tension.sel(frame=slice(ramp - 1e-6, None)) / 1000
    found = curves(axes)
    for label, values in (
        ("largest", ALONE.cable_tension_maximum_after_ramp / 1000),
        ("mean", T.integrate("frame") / float(40 - T.frame[0])),
        ("least", ALONE.cable_tension_minimum_after_ramp / 1000),
    ):
        np.testing.assert_allclose(found[label], [ALONE.s_cell, values], rtol=1e-12)
    assert axes.get_ylabel() == "tension [kN]"
    first = float(ALONE.time.sel(time=slice(ramp - 1e-6, None))[0])
    assert (
        axes.get_xlabel() == "arc length from the anchor, s [m]\n"
        f"(all steps from {first:.4g} to 40 s, mean of {T.sizes['frame']} instants)"
    )


def test_track():
    """From above, to equal scale, after the ramp, with the mean place and the directions of all that pushes."""
    axes, compass = figures.track(RECORD, SCENE).axes
    after = ALONE.sel(time=slice(SCENE.waves.ramp - 1e-6, None)).buoy_position
    found = curves(axes)
    np.testing.assert_allclose(axes.lines[0].get_data(), after.values[:, :2].T)
    mean = after.integrate("time") / float(after.time[-1] - after.time[0])
    np.testing.assert_allclose(found["mean"].ravel(), mean[:2], atol=1e-13)  # that of y is 0
    np.testing.assert_allclose(found["start"].ravel(), after[0, :2])
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x [m]", "y [m]", 1.0)
    shown = [text.get_text() for text in compass.get_legend().get_texts()]
    directions = [math.atan2(arrow.V[0], arrow.U[0]) for arrow in compass.collections]
    expected = {
        "waves": 30,
        "current": SCENE.current.direction_deg,
        "wind": 70,
        "force": math.degrees(math.atan2(-4, 3)),
    }
    assert dict(zip(shown, np.degrees(directions), strict=True)) == pytest.approx(expected)


def test_mean_over_unequal_steps():
    """Of a function with straight pieces, exact."""
    t = np.array([0.0, 1.0, 4.0])
    np.testing.assert_allclose(mean_over_time(t, np.array([[0.0, 5.0], [2.0, 5.0], [2.0, 5.0]])), [7 / 4, 5.0])


def test_roll_pitch_and_yaw_over_time():
    """A turn over 180 degrees goes on, without a line across the panel."""
    t = RECORD.time.values
    angles = {"roll": 3 * np.sin(t), "pitch": 5 * np.cos(t), "yaw": (9 * t + 180) % 360 - 180}
    record = RECORD.assign({name: ("time", values) for name, values in angles.items()})
    panels = figures.roll_pitch_yaw(record, SCENE).axes
    for axes, name, values in zip(
        panels, ("roll", "pitch", "yaw"), (angles["roll"], angles["pitch"], 9 * t), strict=True
    ):
        np.testing.assert_allclose(axes.lines[0].get_data(), [t, values], atol=1e-9)
        assert axes.get_ylabel() == f"{name} [°]"


def test_density_of_a_sinusoid_and_of_noise():
    """The integral over frequencies is the variance, a^2 / 2 of a sinusoid; a trend is none of it; steps may differ."""
    t = np.sort(np.concatenate([[0.0, 60.0], np.random.default_rng(2).uniform(0, 60, 5998)]))
    f, S = density(t, 3 + 0.2 * t + 1.7 * np.sin(2 * math.pi * t / 4), period=4.0)
    assert f[S.argmax()] == pytest.approx(0.25, rel=1e-3)
    assert trapezoid(S, f) == pytest.approx(1.7**2 / 2, rel=0.01)
    noise = np.random.default_rng(3).standard_normal(20_000)
    f, S = density(0.05 * np.arange(20_000), noise)
    assert f[-1] == pytest.approx(10)
    assert np.mean(S[5:-5]) == pytest.approx(1 / 10, rel=0.05)  # variance 1 over 0 to 10 Hz


@pytest.mark.parametrize("size", [64, 101, 350])
def test_welch_is_that_of_scipy(size):
    """Windows of an even and an odd number of values, and of all of them but a few."""
    x = np.random.default_rng(4).standard_normal(357).cumsum()
    expected = signal.welch(x, 3.7, nperseg=size, detrend="linear")
    np.testing.assert_allclose(welch(x, 3.7, size), expected, rtol=1e-9, atol=1e-12 * expected[1].max())


def test_spectra():
    """Of the time after the ramp; the largest peak and the frequency of the waves are marked."""
    t = RECORD.time.values
    late = t >= SCENE.waves.ramp - 1e-6
    turned = RECORD.assign(roll=np.sin(RECORD.time), pitch=0 * RECORD.time, yaw=0 * RECORD.time)
    motion, turns = figures.motion_spectrum(turned, SCENE).axes
    (tension,) = figures.tension_spectrum(RECORD, SCENE).axes
    assert [a.get_ylabel() for a in (motion, turns, tension)] == [
        f"spectral density [{u}²/Hz]" for u in ("m", "°", "kN")
    ]
    for axes, label, values in (
        (motion, "x", ALONE.buoy_position.values[:, 0]),
        (motion, "z", ALONE.buoy_position.values[:, 2]),
        (tension, "upper end", ALONE.tension_top.values / 1000),
        (tension, "anchor", ALONE.tension_anchor.values / 1000),
    ):
        np.testing.assert_allclose(curves(axes)[label], density(t[late], values[late], PERIOD), atol=1e-12)
    for axes in (motion, tension):
        found = curves(axes)
        np.testing.assert_allclose(found["drive 0.2 Hz"][0], 1 / PERIOD)
        assert found["peak 0.2 Hz"][0] == pytest.approx(1 / PERIOD)
        assert found["peak 0.2 Hz"][1] == max(line.get_ydata().max() for line in axes.lines[:2])
    assert tension.get_xlabel() == "frequency [Hz]"


def test_too_short_and_not_recorded():
    """Each in one sentence; a record that carries no scene asks for it."""
    short = RECORD.sel(time=slice(0, 20))
    with pytest.raises(InputError, match=r"No spectrum of the motion: it needs 4 periods after the ramp of .* has 3\."):
        figures.motion_spectrum(short, SCENE)
    with pytest.raises(InputError, match=r"No track of the buoy: it needs 2 instants after the ramp of"):
        figures.track(RECORD.sel(time=slice(0, 2)), SCENE)
    with pytest.raises(InputError, match=r"figures\.heave needs buoy_position, which this record does not have\."):
        figures.heave(RECORD.drop_vars("buoy_position"), SCENE)
    with pytest.raises(InputError, match="does not carry its scene"):
        figures.tension(RECORD)
    with pytest.raises(InputError, match="not the record of a run"):
        figures.shapes(RECORD.isel(time=0, frame=0), SCENE)


def test_a_record_brings_its_scene():
    carried = RECORD.assign_attrs(scene=SCENE.to_toml())
    np.testing.assert_array_equal(
        *(figure.axes[1].lines[0].get_data() for figure in (figures.tension(carried), figures.tension(RECORD, SCENE)))
    )


def test_a_notebook_shows_a_figure_once():
    """As PNG, by itself; pyplot, which would show it a second time, does not know it."""
    shown = figures.tension(RECORD, SCENE)
    assert shown._repr_png_().startswith(b"\x89PNG")
    assert not hasattr(shown, "_repr_html_") or shown._repr_html_() is None
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_water_and_bed_in_the_shapes():
    """Lines at z = 0 and at the bed where they are near; what is below the bed lies in the ground."""
    axes = figures.shapes(RECORD, SCENE).axes[0]
    assert {label: set(y) for label, (_, y) in curves(axes).items() if label in ("still water", "sea bed")} == {
        "still water": {0.0},
        "sea bed": {-20.0},
    }
    ground = axes.patches[0].get_extents().transformed(axes.transData.inverted())
    assert (ground.y0 < -20.5, ground.y1) == (True, pytest.approx(-20))
    low, high = axes.get_ylim()
    assert low < -20 < 0 < high
    deep = load_scene(SCENE, sea={"depth": 300.0})
    assert "sea bed" not in curves(figures.shapes(RECORD, deep).axes[0])


# -- snapshot ----------------------------------------------------------------------------------------------------------


def artists(axes, kind):
    """3D collections of a kind, and the points (pieces, n, 3) of each."""
    return [c for c in axes.collections if type(c) is kind]


def shafts(collection):
    """Tail and tip (n, 2, 3) of arrows in space."""
    segments = np.array(collection._segments3d)
    return segments[: len(segments) // 3, ::-1]  # barbs follow


def words(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


#: Height of C above the keel.
CENTER = (400 * 0.5 + 150 * 2 + 150 * 3) / 700


def held_by_its_cable():
    """RECORD with what the cable does to the buoy, at its keel: (record, places, forces)."""
    axes = [rotation_matrix(q4)[:, 2] for q4 in ALONE.buoy_orientation.values]
    place = ALONE.buoy_position.values - CENTER * np.array(axes)
    force = np.column_stack([-900 + RECORD.time, 200 - RECORD.time, -6800 + 40 * RECORD.time])
    dims = ("time", "attachment", "xyz")
    return RECORD.assign(mooring_point=(dims, place[:, None]), mooring_force=(dims, force[:, None])), place, force


def test_arrows_of_a_snapshot_are_to_their_scale():
    """Water: in each panel to that of the arrow whose speed stands over it.  Forces, around the buoy: the legend says
    size and scale, and that of the cable has one of its own."""
    record, place, pull = held_by_its_cable()
    figure, now = snapshot(record, SCENE, 12.1), Frames(record, SCENE).at(12.1)
    row = int(np.abs(record.time.values - 12).argmin())
    for axes in figure.axes:
        flow, key, *forces = (shafts(c) for c in artists(axes, Line3DCollection))
        (speed,) = (float(text.get_text().removesuffix(" m/s")) for text in axes.texts)
        known = (key[0, 1] - key[0, 0]) / speed
        scale = 1 / np.linalg.norm(known)
        np.testing.assert_allclose(known * scale, heading(SCENE.waves.direction_deg), atol=1e-12)
        speeds = velocity_at(SCENE, now.time, flow[:, 0])
        np.testing.assert_allclose((flow[:, 1] - flow[:, 0]) * scale, speeds, atol=1e-9)
        assert 0.4 < speed / np.linalg.norm(speeds, axis=1).max() <= 1
        assert len(forces) == (3 if axes is figure.axes[-1] else 0)
    expected = [(at, push) for _, at, push in now.arrows("outside")] + [(place[row], pull[row])]
    for shaft, name, (at, push) in zip(forces, ("external", "wind", "mooring"), expected, strict=True):
        (said,) = (label for label in words(figure) if label.startswith(f"{name} force, "))
        size, unit, scale, _ = re.fullmatch(r".*force, (\S+) (k?N) \((\S+) (k?N) per m\)", said).groups()
        newton = {"N": 1.0, "kN": 1000.0}[unit]
        assert float(size) * newton == pytest.approx(np.linalg.norm(push), rel=0.005)
        np.testing.assert_allclose(shaft[0, 0], at)
        np.testing.assert_allclose((shaft[0, 1] - shaft[0, 0]) * float(scale) * newton, push)


def test_a_snapshot_names_what_it_shows():
    """Scene and time, what moves the water, the anchor, the tensions of this instant, still water at its height."""
    named = load_scene(SCENE, title="Here it is")
    figure = snapshot(RECORD, named, 12.1)
    assert figure.texts[0].get_text().replace("\xa0", " ") == "Here it is, t = 12 s"
    T = ALONE.cable_tension.sel(frame=12.0, method="nearest").values / 1000
    assert {"water velocity, waves and current", "anchor", f"cable, tension {T.min():.3g} to {T.max():.3g} kN"} <= set(
        words(figure)
    )
    for axes in figure.axes:
        (still,) = (line for line in axes.lines if line.get_linestyle() == "--")
        assert set(still.get_data_3d()[2]) == {0.0}
    without = load_scene({key: value for key, value in named.to_dict().items() if key != "waves"})
    assert "water velocity, current" in words(snapshot(RECORD, without, 12.1))
    assert "still water" not in words(snapshot(RECORD, without, 12.1))


def test_panels_of_a_snapshot_stand_on_one_line():
    """What is seen of their boxes begins and ends at the same heights, and is inside the figure."""
    figure = snapshot(RECORD, SCENE, 12.1)
    figure.draw_without_rendering()
    edges = []
    for axes in figure.axes:
        corners = np.array(list(itertools.product(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())))
        x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
        seen = figure.transFigure.inverted().transform(axes.transData.transform(np.column_stack([x, y])))
        edges.append([seen.min(axis=0), seen.max(axis=0)])
    (left, right), whole = np.array(edges), np.array(edges)
    np.testing.assert_allclose(left[:, 1], right[:, 1], atol=1e-9)
    assert 0 < whole.min() < whole.max() < 1
    assert left[1, 0] < right[0, 0]


def test_a_cable_below_the_bed_is_seen_there():
    """In the box, in a colour of its own, with a curtain up to the bed; its depth is said."""
    record = RECORD.copy(deep=True)
    i = int(np.abs(record.frame.values - 12).argmin())
    record.cable_position.values[i, 1:3, 2] = -20.8, -21.3
    axes = snapshot(record, SCENE, 12.0).axes[0]
    labels = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert "cable, up to 1.3 m below the bed" in labels
    assert axes.get_zlim()[0] < -21.3
    lowest = [np.nanmin(line.get_data_3d()[2]) for line in axes.lines]
    assert lowest.count(pytest.approx(-21.3)) == 2  # the cable, and again what of it is below
    below = next(line for line in axes.lines if np.isnan(line.get_data_3d()[2]).any())
    z = np.array(below.get_data_3d()[2])
    assert np.nanmax(z) <= -20
    assert below.get_color() != axes.lines[0].get_color()
    assert not any("below the bed" in text.get_text() for text in snapshot(RECORD, SCENE, 12.0).legends[0].get_texts())


def test_a_snapshot_is_the_right_way_up():
    figure = snapshot(RECORD, SCENE, 12.1)
    for axes in figure.axes:
        assert axes.zaxis.label.get_rotation() == 90
        assert axes.elev > 0
        x = [proj3d.proj_transform(x, 0, 0, axes.get_proj())[0] for x in (0.0, 1.0)]
        assert x[1] > x[0]  # to the right


def test_a_snapshot_without_waves_and_current_is_along_the_lines():
    still = load_scene(SCENE, waves=None, current=None)
    way = ALONE.cable_position.values[30, -1] - ALONE.cable_position.values[30, 0]
    heading = Frames(RECORD, still).at(12.0).direction_deg
    assert heading == pytest.approx(math.degrees(math.atan2(way[1], way[0])))
    assert abs(heading) > 5
    assert Frames(RECORD, SCENE).at(12.0).direction_deg == 30.0


def test_what_a_snapshot_knows():
    """Points of the axis lie at their heights above the keel, forces where they act; the legend has their numbers."""
    now = Frames(RECORD, SCENE).at(12.1)
    assert now.time == pytest.approx(12.0)
    row = ALONE.sel(time=12.0, method="nearest")
    R, C = rotation_matrix(row.buoy_orientation.values), row.buoy_position.values
    center = CENTER
    np.testing.assert_allclose(now.x, ALONE.cable_position.sel(frame=12.0, method="nearest"))
    np.testing.assert_allclose(now.buoys[0].masses, [C + (h - center) * R[:, 2] for h in (2.0, 3.0)])
    (name, place, force), (wind, at, push) = now.arrows("outside")
    assert (name, wind) == ("external force", "wind force")
    np.testing.assert_allclose(place, C + (2.0 - center) * R[:, 2])
    np.testing.assert_allclose(force, [300, -400, 1200])
    np.testing.assert_allclose(at, C + (2.6 - center) * R[:, 2])
    k = wavenumber(SCENE)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    ramp = SCENE.waves.ramp
    assert ramp <= 12.0
    theta = k * (c * at[0] + s * at[1]) - 2 * math.pi / PERIOD * now.time + math.radians(20)
    speed = 12.0 * ((at[2] - 0.7 * math.cos(theta)) / 10) ** (1 / 7)
    size = 0.5 * 1.1 * SCENE.wind.air_density * 1.7 * speed**2
    angle = math.radians(70)
    np.testing.assert_allclose(push, size * np.array([math.cos(angle), math.sin(angle), 0.0]), rtol=1e-12)
    figure = snapshot(RECORD, SCENE, 12.1)
    whole, detail = figure.axes
    ends = [C + (h - center) * R[:, 2] for h in (0.0, 3.0)]  # keel and highest mass
    for i, limits in enumerate((detail.get_xlim(), detail.get_ylim(), detail.get_zlim())):
        assert np.mean(limits) == pytest.approx((ends[0][i] + ends[1][i]) / 2)
        assert np.ptp(limits) > 3.0
    assert whole.get_zlim()[0] <= -20 < whole.get_zlim()[1] - 20
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any(label.startswith("external force, 1.3 kN (") for label in labels)
    assert any(label.startswith(f"wind force, {size:.3g} N") for label in labels)


def test_the_wind_on_a_vessel_away_from_the_buoy_is_drawn_in_the_panel_that_has_it():
    """To a scale of its own, and there alone; of a vessel within the panel around the buoy it is drawn there."""
    wind = {"speed_10m": 10.0, "area": 30.0, "height": 2.0}
    record = RECORD.assign(wind_force=(("time", "vessel", "xyz"), np.full((RECORD.sizes["time"], 1, 3), 750.0)))
    for x, where in ((12.0, 0), (4.0, 1)):
        ship = {"name": "ship", "position": [x, 0.0, 0.0], "fairleads": {"bow": [0.0, 0.0, 0.0]}, "wind": wind}
        moved = ship | {"motion": [[t] + 6 * [0.0] for t in (0.0, 40.0)]}
        scene = load_scene(SCENE, vessel=[moved], cable__from="ship.bow", cable__anchor=None)
        figure = snapshot(record, scene, 12.1)
        labels = [text.get_text().partition(",")[0] for text in figure.legends[0].get_texts()]
        assert ("wind force on a vessel" in labels) == (where == 0)
        green = to_rgb(COLORS["green"])
        drawn = [
            sum(tuple(one.get_color()[0][:3]) == pytest.approx(green) for one in artists(axes, Line3DCollection))
            for axes in figure.axes
        ]
        assert drawn == ([1, 1] if where == 0 else [0, 2])  # one is that of the buoy


def test_an_instant_without_a_buoy_has_no_forces():
    assert Frames(RECORD.drop_vars("buoy_position"), SCENE).at().arrows("outside") == []
