"""Rarer figures and pictures: residuals of a fit, elasticities, crowded sweeps, slopes, gusts, error bands.

Source: made-up datasets and records, read back from curves, bars and polygons.
"""

import math

import numpy as np
import pytest
import xarray as xr
from made_up import ALONE, PERIOD, RECORD, SCENE

from dolfbuoy import InputError, figures, load_scene
from dolfbuoy.model.varying import wind_over_time
from dolfbuoy.results.after_ramp import TooShort
from dolfbuoy.results.figures import MOST_PARTS, _largest
from dolfbuoy.results.frame import Frames, pieces_of
from dolfbuoy.results.statistics import collect
from dolfbuoy.results.style import COLORS
from dolfbuoy.results.sweep_figure import draw, residuals, tornado


def drawn(axes):
    """Label -> (x, y) of the lines of a panel."""
    return {line.get_label(): np.array(line.get_data()) for line in axes.lines}


# -- fits and derivatives ----------------------------------------------------------------------------------------------


def test_residuals_of_a_fit():
    """Each series has its column: measured, computed, and below the computed less the measured, in its unit."""
    t = np.arange(5.0)
    top, height = 1000 + 50 * t, 0.5 - 0.1 * t
    data = {"time": np.concatenate([t, t + 0.5]), "measured": np.concatenate([top, height])}
    data |= {"computed": np.concatenate([top + t, height + 0.01 * t**2])}
    data |= {"series": np.array(["tension_top of port"] * 5 + ["buoy_position_z"] * 5, dtype=object)}
    panels = residuals(xr.Dataset({name: ("sample", values) for name, values in data.items()})).axes
    for k, (title, unit, at, measured, more) in enumerate(
        [("tension_top of port", "N", t, top, t), ("buoy_position_z", "m", t + 0.5, height, 0.01 * t**2)]
    ):
        above, below = panels[k], panels[2 + k]
        assert (above.get_title(), above.get_ylabel()) == (title, f"[{unit}]")
        np.testing.assert_allclose(drawn(above)["measured"], [at, measured])
        np.testing.assert_allclose(drawn(above)["computed"], [at, measured + more])
        np.testing.assert_allclose(below.lines[0].get_data(), [at, more], atol=1e-12)


def test_elasticities_as_bars():
    """The 15 largest of either sign, the largest on top, what is not known as none; three results at most."""
    values = np.array([0.1, -0.9, np.nan, 0.5, *(0.01 * np.arange(20))])
    names = [f"key{k}" for k in range(len(values))]
    figure = tornado(names, {"top": values, "lean": -values, "third": values, "fourth": values})
    assert [axes.get_title() for axes in figure.axes] == ["top", "lean", "third"]
    for axes, sign in zip(figure.axes, (1, -1, 1), strict=True):
        found = [(bar.get_width(), bar.get_facecolor()[:3]) for bar in axes.patches]
        known = np.nan_to_num(values)
        order = sorted(range(len(known)), key=lambda k: -abs(known[k]))[:15][::-1]
        np.testing.assert_allclose([width for width, _ in found], sign * known[order])
        assert [label.get_text() for label in axes.get_yticklabels()] == [names[k] for k in order]
        assert names[order[-1]] == "key1"
        red, blue = (tuple(int(COLORS[c][i : i + 2], 16) / 255 for i in (1, 3, 5)) for c in ("red", "blue"))
        for width, colour in found:
            assert colour == pytest.approx(red if width > 0 else blue, abs=1e-3)


# -- sweeps ------------------------------------------------------------------------------------------------------------


def swept(changes, failed=()):
    """Cases whose mean is their number in kN, between 2 less and 3 more."""
    rows = []
    for k, change in enumerate(changes):
        numbers = {"mean": 1e3 * k, "minimum": 1e3 * (k - 2), "maximum": 1e3 * (k + 3), "standard_deviation": 1.0}
        done = k not in failed
        rows.append(
            {
                "changes": change,
                "status": "done" if done else "no",
                "statistics": {"tension_top": numbers} if done else {},
            }
        )
    return collect(rows)  # fmt: skip


def test_cases_in_groups_stand_beside_each_other():
    """Over the first key, a colour for each value of the second, 1.5 % of the width apart; failed ones are left out."""
    found = swept([{"a.x": x, "b.y": y} for y in (5, 6) for x in (1.0, 2.0, 3.0)], failed=[4])
    (axes,) = draw(found).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("a.x", "tension top [kN]")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["y = 5", "y = 6"]
    first, second = (bars[0].get_xydata() for bars in axes.containers)
    np.testing.assert_allclose(first, [[1 - 0.015, 0], [2 - 0.015, 1], [3 - 0.015, 2]])
    np.testing.assert_allclose(second, [[1 + 0.015, 3], [3 + 0.015, 5]])


@pytest.mark.parametrize(
    "changes",
    [
        [{"a.x": word} for word in ("p", "q", "r")],
        [{"a.x": 1.0, "b.y": y} for y in range(12)],
        [{"a.x": x} for x in (1.0, 1.0, 2.0)],
        [{"a.x": 1.0, "b.y": "w" * (30 + 5 * y)} for y in range(3)],
        [{"waves.seed": seed} for seed in (3886192580, 584834780)],
    ],
    ids=["words", "many groups", "twice the same", "long words", "seeds"],
)
def test_what_is_no_abscissa_is_shown_case_by_case(changes):
    (axes,) = draw(swept(changes)).axes
    assert axes.get_xlabel() == "case"
    (bars,) = axes.containers
    np.testing.assert_allclose(bars[0].get_xydata(), [[k, k] for k in range(len(changes))])


def test_many_cases_are_points():
    """Means and both ends of their ranges, beyond 200 cases."""
    (axes,) = draw(swept([{"a.x": float(k)} for k in range(201)])).axes
    assert not axes.containers
    for line, more in zip(axes.lines, (0, -2, 3), strict=True):
        np.testing.assert_allclose(line.get_xydata(), [[k, k + more] for k in range(201)])
    assert draw(swept([{"a.x": float(k)} for k in range(200)])).axes[0].containers


# -- a run -------------------------------------------------------------------------------------------------------------


def planar():
    record = RECORD.copy(deep=True)
    record.buoy_position[:, 0, 0] = 3.0
    return record


def test_an_orbit_in_a_plane_and_one_that_is_not_there():
    (axes,) = figures.orbit(planar(), SCENE).axes
    late = RECORD.time.values >= 40 - PERIOD - 1e-6
    np.testing.assert_allclose(axes.lines[0].get_data(), planar().buoy_position.values[late][:, 0, 1:].T)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("y [m]", "z [m]")
    with pytest.raises(InputError, match="needs waves"):
        figures.orbit(RECORD, load_scene(SCENE, waves=None))
    with pytest.raises(TooShort, match="one period of the waves, 5 s"):
        figures.orbit(RECORD.sel(time=slice(0, 4.9)), SCENE)
    assert figures.orbit(RECORD.sel(time=slice(0, 5.05)), SCENE)


def test_heights_without_water():
    (axes, _) = figures.heave(RECORD.drop_vars("surface_elevation"), SCENE).axes
    (line,) = axes.lines
    np.testing.assert_allclose(line.get_ydata(), ALONE.buoy_position[:, 2])
    assert axes.get_ylabel() == "height [m]"


def test_errors_of_the_steps_are_a_band_on_one_side():
    """Between the curve and the curve less its error, in the unit of the curve."""
    error = 10 + RECORD.time.values[:, None]
    record = RECORD.assign(tension_top_error=(("time", "cable"), error))
    record = record.assign(buoy_position_error=(("time", "buoy", "xyz"), error[..., None] * [1e3, 1e3, 0.01]))
    for axes, values, band in (
        (figures.tension(record, SCENE).axes[0], ALONE.tension_top.values / 1000, error[:, 0] / 1000),
        (figures.heave(record, SCENE).axes[0], ALONE.buoy_position.values[:, 2], 0.01 * error[:, 0]),
    ):
        (shade,) = axes.collections
        corners = shade.get_paths()[0].vertices
        t = RECORD.time.values
        expected = np.concatenate([np.column_stack([t, values]), np.column_stack([t, values - band])])
        assert {tuple(p) for p in expected.round(9)} == {tuple(p) for p in corners.round(9)}


def test_a_bed_that_slopes_below_the_shapes():
    """As high as it is below each end of a line that is three times as wide as the shapes."""
    scene = load_scene(SCENE, seabed={"slope": [0.1, 0.0]})
    axes = figures.shapes(RECORD, scene).axes[0]
    x, z = drawn(axes)["sea bed"]
    seen = ALONE.cable_position.values[-13:]
    assert x[1] > x[0]
    np.testing.assert_allclose(np.diff(z) / np.diff(x), 0.1, rtol=1e-9)
    np.testing.assert_allclose(z, -20 + 0.1 * x, rtol=1e-9)
    assert x[0] < seen[..., 0].min() < seen[..., 0].max() < x[1]


def test_shapes_without_a_period_are_of_the_whole_run():
    axes = figures.shapes(RECORD, load_scene(SCENE, waves=None)).axes[0]
    times = np.array(axes.collections[0].get_array())
    assert (times[0], times[-1], len(times)) == (0.0, pytest.approx(40.0), 13)


def test_curvature():
    """Least, largest of all steps and mean of the frames after the ramp; what each segment allows, where it is."""
    scene = load_scene({
        "cable": {"anchor": [0, 0, 0], "top": {"kind": "free"}, "line_density": 1.0, "axial_stiffness": 1e5,
                  "segments": [{"length": 8.0, "minimum_bend_radius": 4.0, "bending_stiffness": 9.0}, {"length": 6.0},
                               {"length": 8.0, "minimum_bend_radius": 2.5, "bending_stiffness": 9.0}]},
        "time": {"end": 40.0, "step": 0.1},
    })  # fmt: skip
    frames = RECORD.frame.values
    values = 0.1 + 0.01 * frames[:, None] + 0.001 * np.arange(7)
    largest = 1.0 + 0.1 * np.arange(7)
    record = RECORD.assign(curvature=(("frame", "node"), values), curvature_maximum=("node", largest))
    (axes,) = figures.curvature(record, scene).axes
    found = drawn(axes)
    np.testing.assert_allclose(found["largest"], [ALONE.s, largest])
    np.testing.assert_allclose(found["mean"][1], 0.1 + 0.2 + 0.001 * np.arange(7))
    allowed = [np.array(line.get_data()) for line in axes.lines if line.get_color() == COLORS["blue"]]
    np.testing.assert_allclose(allowed, [[[0, 8], [0.25, 0.25]], [[14, 22], [0.4, 0.4]]])
    late = record.assign(curvature_maximum_after_ramp=("node", 2 * largest))
    np.testing.assert_allclose(drawn(figures.curvature(late, scene).axes[0])["largest"][1], 2 * largest)
    corners = axes.collections[0].get_paths()[0].vertices
    assert {round(y, 9) for _, y in corners} == {round(y, 9) for y in [*values.min(axis=0), *largest]}
    column = record.assign(curvature=1e-5 * record.curvature, curvature_maximum=1e-5 * record.curvature_maximum)
    (slight,) = figures.curvature(column, scene).axes
    assert (axes.get_ylabel(), slight.get_ylabel()) == ("curvature [1/m]", "curvature [1/km]")
    np.testing.assert_allclose(drawn(slight)["largest"][1], 1e-2 * largest)


def test_of_many_lines_those_with_the_largest_tension_have_figures():
    """In their order, with a word about it."""
    count = MOST_PARTS + 3
    tension = np.zeros((2, count))
    tension[0] = np.arange(count) % 5
    tension[1, 2], tension[1, 7] = -50.0, 60.0
    record = xr.Dataset({"tension_top": (("time", "cable"), tension)}, {"cable": [f"c{k}" for k in range(count)]})
    notes = {}
    chosen = _largest(record, "cable", notes)
    peaks = np.abs(tension).max(axis=0)
    assert len(chosen) == MOST_PARTS
    assert {"c2", "c7"} <= set(chosen)
    assert chosen == sorted(chosen, key=lambda name: int(name[1:]))
    assert min(peaks[int(name[1:])] for name in chosen) >= max(peaks[k] for k in range(count) if f"c{k}" not in chosen)
    assert list(notes) == [
        f"Of {count} cables the {MOST_PARTS} with the largest tension_top have figures of their own."
    ]
    few = record.isel(cable=slice(MOST_PARTS))
    assert _largest(few, "cable", notes) == few.cable.values.tolist()
    assert len(notes) == 1


# -- in space ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gusts", [None, "npd"])
def test_arrows_of_a_wind_that_changes(gusts):
    """Of the steady wind times the square of its factor, turned; with gusts those of its seed."""
    rows = [[0.0, 0.5, 0.0], [40.0, 1.5, 80.0]]
    wind = SCENE.wind.model_dump(exclude_none=True) | {"over_time": rows}
    wind |= {"gusts": gusts, "seed": 3} if gusts else {}
    steady = Frames(RECORD, SCENE).at(12.0).arrows("outside")[1][2]
    scene = load_scene(SCENE, wind=None, buoy__wind=wind)
    push = Frames(RECORD, scene).at(12.0).arrows("outside")[1][2]
    factor = 0.7 * 0.5 + 0.3 * 1.5 * np.exp(1j * np.radians(80.0))
    speed, way = wind_over_time(scene.network.buoys["buoy"].wind, 3)(12.0)
    if not gusts:
        assert speed == pytest.approx(12.0 * abs(factor))
    turn = math.atan2(factor.imag, factor.real) + math.radians(70.0)
    np.testing.assert_allclose(way, [math.cos(turn), math.sin(turn), 0.0], atol=1e-12)
    np.testing.assert_allclose(push, np.linalg.norm(steady) * (speed / 12.0) ** 2 * way, rtol=1e-9)
    many = Frames(RECORD, scene).forces[-1].vectors(np.arange(400))
    row = int(np.abs(RECORD.time.values - 12.0).argmin())
    np.testing.assert_allclose(many[row], push, rtol=2e-3, atol=1e-9)


def test_pieces_of_a_line_that_has_parted():
    """Two straight pieces an element; apart where one is gone, without pieces of no length."""
    x = np.arange(9.0)[:, None] * [1.0, 0.0, 0.0]
    for whole, parts in (
        ([1, 1, 1, 1], [(0, 8)]),
        ([1, 0, 1, 1], [(0, 2), (4, 8)]),
        ([0, 1, 1, 0], [(2, 6)]),
        ([1, 0, 0, 1], [(0, 2), (6, 8)]),
    ):
        found = pieces_of(x, np.array(whole, dtype=bool))
        assert [(piece[0, 0], piece[-1, 0]) for piece in found] == parts
        assert all(len(piece) == last - first + 1 for piece, (first, last) in zip(found, parts, strict=True))
