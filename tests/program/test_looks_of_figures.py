"""Layout of figures: legends, margins, sizes, 3D views, pictures for files.

Source: positions and sizes chosen on paper without overlaps; pixels of matplotlib's own savefig; the made-up datasets
of test_numbers_shown and test_figures_read_back.
"""

import base64
import importlib
import io
import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_up import PERIOD, RECORD, SCENE
from matplotlib import colormaps, rc_context
from matplotlib.figure import Figure
from matplotlib.image import imread
from test_figures_read_back import swept
from test_numbers_shown import RUNS, made_up_offsets, made_up_response, run

from dolfbuoy import figures
from dolfbuoy.page.report import _figures
from dolfbuoy.results import draw3d, linear_figures, statistics_figures, style
from dolfbuoy.results.devices import DECK
from dolfbuoy.results.sample import Fatigue
from dolfbuoy.results.statistics import together
from dolfbuoy.results.sweep_figure import draw, tornado

snapshot = importlib.import_module("dolfbuoy.results.snapshot")  # a function hides it
T = RECORD.time.values
TURNS = {
    name: (("time", "buoy"), np.sin(2 * np.pi * T / PERIOD + k)[:, None])
    for k, name in enumerate(("roll", "pitch", "yaw"))
}
BENT = {"curvature": (("frame", "node"), 0.1 + 0.01 * RECORD.frame.values[:, None] + 0.001 * np.arange(7))}


@pytest.fixture(scope="module")
def drawn():
    """Name -> figure: those of the made-up run, of statistics, of a response, of offsets and of a sweep."""
    record = RECORD.assign(TURNS | BENT | {"curvature_maximum": ("node", 1.0 + 0.1 * np.arange(7))})
    found = {name: draw_one(record, SCENE) for name, draw_one in figures.in_order().items()}
    numbers = together([run(k) for k in range(RUNS)], Fatigue(4.0, 1e20, 0.5))
    found |= {name: statistics_figures.FIGURES[name](numbers) for name in ("exceedance", "cycles", "extremes")}
    found |= {name: getattr(linear_figures, name)(made_up_response()) for name in ("amplitudes", "spectra")}
    found["offsets"] = linear_figures.offset_curves(made_up_offsets(), [(3.0, -4.0)])
    found["sweep"] = draw(swept([{"a.x": x, "b.y": y} for y in (5, 6) for x in (1.0, 2.0, 3.0)]))
    return found | {"bars": tornado(["a", "b"], {"top": np.array([1.0, -2.0])})}


def numbers(values, digits=4):
    return " ".join(f"{value:.{digits}g}" for value in np.ravel(values))


def of_legend(legend):
    """Place by its number, its corner in the panel, room at its edge and between columns, length of its lines."""
    corner = legend.get_bbox_to_anchor()._bbox.bounds[:2] if legend.axes else ()
    return (legend._loc_real, *corner, legend.borderaxespad, legend.columnspacing, legend.handlelength)


def test_where_legends_stand(drawn):
    """Over the left of their panel; of few words as wide as others, of many narrower; below the figure."""
    above, named, small = (3, 0, 1, 0.1, 1.2, 1.8), (3, 0, 1, 0.1, 1.0, 1.8), (3, 0, 1, 0.1, 1.0, 1.2)
    found = {name: (*(of_legend(a.get_legend()) for a in f.axes if a.get_legend()),) for name, f in drawn.items()}
    assert found == {
        **dict.fromkeys(("trajectory", "shapes", "envelope", "curvature", "tension", "heave"), (above,)),
        **{"track": (above, (9, 0.5, 0, 0, 2.0, 1.8)), "motion_spectrum": (above, above), "tension_spectrum": (above,)},
        **dict.fromkeys(("orbit", "cone_angle", "roll_pitch_yaw", "snapshot", "bars", "offsets"), ()),
        **dict.fromkeys(("exceedance", "cycles", "extremes"), ()),
        **{"amplitudes": (named,) * 3, "spectra": (small, named, named), "sweep": ((8, 0.5, 1, 0.5, 2.0, 1.8),)},
    }
    below = {name: (*map(of_legend, figure.legends),) for name, figure in drawn.items() if figure.legends}
    assert below == {
        **dict.fromkeys(("orbit", "amplitudes", "offsets"), ((8, 0.5, 2.0, 1.8),)),
        **dict.fromkeys(("exceedance", "extremes"), ((8, 0.5, 2.0, 2.0),)),
        "snapshot": ((8, 0.2, 2.0, 1.8),),
    }


def test_room_of_panels(drawn):
    """Inches below for the legend, and shares of the panels; what is laid out by hand has its places."""
    rooms = {}
    for name, figure in drawn.items():
        if (engine := figure.get_layout_engine()) is None:
            assert name in ("orbit", "snapshot")
            continue
        left, low, width, height = engine.get()["rect"]
        assert (left, width, low + height) == (0, 1, 1), name
        rooms[name] = round(low * figure.get_figheight(), 9)
    assert {name: room for name, room in rooms.items() if room} == {
        "exceedance": 0.3, "extremes": 0.3, "amplitudes": 0.25, "offsets": 0.25,
    }  # fmt: skip
    shares = {name: figure.axes[0].get_gridspec() for name, figure in drawn.items() if name in ("track", "trajectory")}
    assert shares["track"].get_width_ratios() == (3.2, 1)
    x = RECORD.buoy_position.values[:, 0]
    heights = [max(1.0, 1.05 * 2.9 * np.ptp(x[:, k]) / np.ptp(x[:, 0])) for k in (1, 2)]
    np.testing.assert_allclose(shares["trajectory"].get_height_ratios(), heights)
    assert drawn["trajectory"].get_figheight() == pytest.approx(sum(heights) + 1.1)
    assert numbers(drawn["orbit"].axes[0].get_position(original=True).bounds) == "0 0.08 1 0.92"
    assert [drawn["sweep"]._suptitle.get_fontsize(), drawn["bars"].axes[0].get_yticklabels()[0].get_fontsize()] == [
        9,
        6,
    ]
    adjustable = {name: {axes.get_adjustable() for axes in figure.axes} for name, figure in drawn.items()}
    assert [name for name, kinds in adjustable.items() if "datalim" in kinds] == [
        "trajectory", "track", "shapes", "offsets",
    ]  # fmt: skip


def in_space(axes):
    """View and box, ticks, distances of labels and numbers of x, y and z, of a panel in space."""
    three = (axes.xaxis, axes.yaxis, axes.zaxis)
    assert (axes.get_zlabel(), axes.zaxis._rotate_label, axes.zaxis.label.get_rotation()) == ("z [m]", False, 90)
    assert {axis.pane.get_facecolor() for axis in three} == {(0.97, 0.97, 0.97, 1.0)}
    assert (axes.computed_zorder, axes._focal_length) == (False, math.inf)
    pads = [(axis.labelpad, axis.get_major_ticks()[0].get_pad()) for axis in three]
    return [
        f"from {axes.elev:g} {axes.azim:g}, box {numbers(axes._box_aspect)}, z {numbers(axes.get_zlim())}",
        "; ".join(numbers(axis.get_major_locator().locs) for axis in three),
        numbers(pads),
    ]


def test_views_in_space(drawn):
    """One scale, round numbers that do not meet at the corners, and words near their axes."""
    (orbit,), (whole, detail) = drawn["orbit"].axes, drawn["snapshot"].axes
    assert in_space(orbit) == [
        "from 22 -60, box 1.311 0.9513 0.4587, z -0.4085 1.208",
        "4 5 6 7 8; -1 0 1; 0 1",
        "-0.6554 -1.871 -5.136 -3.551 -2.136 -1.551",
    ]
    assert in_space(whole) == [
        "from 14 -60, box 0.6867 0.5707 1.427, z -20.89 3.607",
        "0 5; -4 4; -20 -15 -10 -5 0",
        "-6.102 -3.913 -6.102 -3.913 8.64 2.49",
    ]
    assert in_space(detail) == [
        "from 14 -60, box 1.003 1.003 0.907, z -2.057 3.643",
        "6 8 10; -2 0 2; 0 2",
        "-1.491 -2.184 -1.491 -2.184 1.509 -0.1842",
    ]
    assert numbers(drawn["snapshot"].get_size_inches()) == "7 4.95"
    places = [numbers(axes.get_position(original=True).bounds) for axes in (whole, detail)]
    assert places == ["-0.1284 0.1746 0.5329 0.7536", "0.2846 0.05465 0.6981 0.9872"]
    assert numbers(drawn["snapshot"].texts[0].get_position()) == f"0.5 {1 - 0.08 / 4.95:.4g}"
    assert [axes.patch.get_visible() for axes in (orbit, whole, detail)] == [True, False, False]


def test_marks_that_are_hollow(drawn):
    """The start of a path, peaks of spectra, places of largest values: what is below them is seen."""
    hollow = {
        name: sum(str(line.get_markerfacecolor()) == "none" for axes in figure.axes for line in axes.lines)
        for name, figure in drawn.items()
    }
    assert {name: count for name, count in hollow.items() if count} == {
        "trajectory": 2, "track": 1, "orbit": 1, "motion_spectrum": 2, "tension_spectrum": 1, "extremes": 1,
    }  # fmt: skip
    assert [line.get_markeredgewidth() for line in drawn["track"].axes[0].lines] == [1.0, 1.0, 1.0, 1.5]


def test_the_style_of_every_figure(drawn):
    """Thin lines about and behind the curves, small numbers."""
    (axes, _) = drawn["tension"].axes
    tick = axes.xaxis.get_major_ticks()[0]
    widths = [axes.spines["left"].get_linewidth(), tick.tick1line.get_markeredgewidth()]
    assert [*widths, axes.yaxis.get_major_ticks()[0].tick1line.get_markeredgewidth()] == [0.6, 0.6, 0.6]
    assert (tick.gridline.get_color(), tick.gridline.get_linewidth(), tick.gridline.get_visible()) == (
        "#e6e6e6", 0.5, True,
    )  # fmt: skip
    assert [axis.get_ticklabels()[0].get_fontsize() for axis in (axes.xaxis, axes.yaxis)] == [7, 7]
    assert axes.get_axisbelow() is True
    assert style.STYLE["font.size"] == 8
    with rc_context(style.STYLE):
        (line,) = Figure().subplots().plot([0, 1])
    assert (line.get_linewidth(), line.get_color()) == (1.0, style.COLORS["blue"])


# -- pictures ----------------------------------------------------------------------------------------------------------


def small(**options):
    with rc_context(style.STYLE):
        figure = style.new_figure(2.0, 1.5, **options)
        figure.subplots().plot([0, 1], [1, 0])
    return figure


@pytest.mark.parametrize("constrained", [True, False])
def test_a_picture_is_that_of_matplotlib(tmp_path, constrained):
    """Laid out once, 200 pixels an inch."""
    figure = small(constrained=constrained)
    assert [file.name for file in style.save(figure, tmp_path / "one")] == ["one.png", "one.svg"]
    assert figure.get_layout_engine() is None or type(figure.get_layout_engine()).__name__ == "PlaceHolderLayoutEngine"
    assert [file.name for file in style.save(small(), tmp_path / "two", svg=False)] == ["two.png"]
    assert not (tmp_path / "two.svg").exists()
    small(constrained=constrained).savefig(tmp_path / "other.png")
    pixels, expected = (imread(tmp_path / f"{name}.png") for name in ("one", "other"))
    assert pixels.shape[:2] == (300, 400)
    assert np.array_equal(pixels, expected)
    assert b"dc:date" not in (tmp_path / "one.svg").read_bytes()


def test_pictures_of_notebooks_and_reports():
    """150 pixels an inch."""
    shown = small()._repr_png_()
    assert imread(io.BytesIO(shown)).shape[:2] == (225, 300)
    page = _figures([("Words.", small())])
    picture = page.split("base64,")[1].split('"')[0]
    assert imread(io.BytesIO(base64.b64decode(picture))).shape[:2] == (225, 300)


# -- what figures of several things name -------------------------------------------------------------------------------


def entries(handles):
    return [(h.get_label(), h.get_color(), h.get_linestyle(), h.get_marker()) for h in handles]


def test_directions_buoys_and_marks_of_offsets():
    """Twelve directions at most by name; several buoys by their lines; marks that there are."""
    red, ink = style.COLORS["red"], style.COLORS["ink"]
    marks = [("line slack", red, "None", "x"), ("buoy under water", red, "None", "v")]
    made = made_up_offsets()
    for count, step in ((3, 1), (12, 1), (13, 2), (25, 3)):
        sides, colours = 10.0 * np.arange(count), colormaps["plasma"](np.linspace(0, 0.9, count))
        found = linear_figures._legend(made, sides, colours)
        assert [h.get_label() for h in found[:-2]] == [f"towards {side:g}°" for side in sides[::step]]
        assert all(np.array_equal(h.get_color(), colours[k * step]) for k, h in enumerate(found[:-2]))
        assert entries(found[-2:]) == marks
    two = made.isel(buoy=[0, 0]).assign_coords(buoy=["fore", "aft"])
    two["slack"] = 0 * two.slack
    found = linear_figures._legend(two, np.array([0.0]), ["black"])
    assert entries(found[1:]) == [("fore", ink, "-", "None"), ("aft", ink, "--", "None"), marks[1]]


@pytest.mark.parametrize(("sides", "closed"), [((0, 120, 240), True), ((0, 120, 241), False), ((0, 180), False)])
def test_rings_of_offsets_are_closed_where_they_go_all_round(sides, closed):
    made = made_up_offsets().isel(direction=slice(len(sides))).assign_coords(direction=np.array(sides, dtype=float))
    rings = [line for line in linear_figures.offset_curves(made).axes[2].lines if str(line.get_color()) == "#bbbbbb"]
    x = made.buoy_position.values[:, :, 0, 0]
    assert len(rings) == 3
    for k, ring in enumerate(rings):
        np.testing.assert_allclose(ring.get_xdata(), [*x[:, k], *([x[0, k]] if closed else [])])
        assert ring.get_linewidth() == 0.6


def test_runs_beside_a_response():
    """Amplitudes of runs are hollow circles in the colour of their curve, in its unit."""
    runs = [{"period": 5.0, "heave": 3.0 + 4.0j, "pitch": 0.1j}, {"period": 8.0, "tension_top": -2000.0}]
    figure = linear_figures.amplitudes(made_up_response(), runs)
    marks = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "o"]
    assert [line.get_xydata().tolist() for line in marks] == [
        [[5.0, 5.0]], [[5.0, pytest.approx(math.degrees(0.1))]], [[8.0, 2.0]],
    ]  # fmt: skip
    assert [(line.get_markersize(), line.get_markerfacecolor()) for line in marks] == [(3.5, "none")] * 3
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["small waves", "height 3 m, drag linearised", "runs in time"]
    last = figure.legends[0].get_lines()[2]
    assert (last.get_marker(), last.get_markerfacecolor(), last.get_linestyle()) == ("o", "none", "None")


def test_points_of_many_cases():
    """Small, the ends of ranges smaller and pale, as a picture."""
    lines = draw(swept([{"a.x": float(k)} for k in range(201)])).axes[0].lines
    assert [(x.get_markersize(), x.get_alpha(), x.get_rasterized(), x.get_zorder()) for x in lines] == [
        (3, None, True, 3), (1, 0.4, True, 2), (1, 0.4, True, 2),
    ]  # fmt: skip
    assert len({x.get_color() for x in lines}) == 1


# -- a snapshot --------------------------------------------------------------------------------------------------------


def test_a_plan_names_its_lines_where_the_legend_does_not():
    """More than five of them, at a quarter of their nodes; hulls of vessels and buoys from above."""
    x = np.stack([np.arange(8.0), np.arange(8.0) ** 2, -np.arange(8.0)], axis=1)
    corners = np.arange(24.0).reshape(8, 3)
    shells = [SimpleNamespace(at=lambda time: corners + time)]
    hull = SimpleNamespace(r_C=np.array([1.0, 2.0, 3.0]), outline=np.array([[0.0, 0.5], [1.0, 0.7], [2.0, 0.6]]))
    for count in (5, 6):
        lines = [(f"line{k}", [x + k, x - k]) for k in range(count)]
        now = SimpleNamespace(
            lines=lines, x=x, time=2.0, hulls=[hull], run=SimpleNamespace(spans=lines, marks=[], shells=shells)
        )
        axes = Figure().subplots()
        snapshot._draw_plan(axes, now)
        told = [(text.get_text(), *text.xy, *text.xyann, text.get_fontsize()) for text in axes.texts]
        assert told == [(f"line{k}", 2.0 + k, 4.0 + k, 3, 3, 6) for k in range(count)] * (count > 5)
        np.testing.assert_allclose([line.get_xydata() for line in axes.lines[:2]], [x[:, :2]] * 2)
        deck, circle = axes.patches
        np.testing.assert_allclose(deck.get_xy()[:4], corners[DECK, :2] + 2.0)
        assert (tuple(circle.center), circle.radius, deck.get_zorder(), circle.get_zorder()) == (
            (1.0, 2.0),
            0.7,
            2.5,
            3,
        )
        assert (axes.margins(), axes.get_adjustable(), axes.get_aspect()) == ((0.08, 0.08), "datalim", 1.0)


def test_columns_of_a_legend():
    """Eighteen letters an inch, eight beside each word; three at most."""
    labels = ["x" * 10, "y" * 9, "z" * 11]
    widths = (54 / 18, 53.9 / 18, 37 / 18, 36.9 / 18)
    assert [snapshot._columns(labels, width) for width in widths] == [3, 2, 2, 1]
    assert [snapshot._columns([], width) for width in (24 / 18, 23.9 / 18, 15.9 / 18)] == [3, 2, 1]


@pytest.mark.parametrize(
    ("size", "label"),
    [
        (1500.0, "wind, 1.5 kN (1 kN per m)"),
        (1499.0, "wind, 1.5 kN, too short to see"),
        (900.0, "wind, 900 N, too short to see"),
    ],
)
def test_arrows_that_are_too_short_are_said(size, label):
    """Of 1.5 % of the box."""
    box = np.array([[0.0, 0.0, -100.0], [50.0, 1.0, 0.0]])
    assert snapshot._label_of("wind", np.array([0.0, 0.6, 0.8]) * size, 1000.0, box) == label


@pytest.mark.parametrize(
    ("largest", "length", "scale"),
    [(7.0, 1.0, 10.0), (5.0, 1.0, 5.0), (5.1, 1.0, 10.0), (0.3, 2.0, 0.2), (2.0, 2.0, 1.0), (130.0, 1.0, 200.0)],
)
def test_scales_are_round(largest, length, scale):
    """1, 2 or 5 times a power of ten, so that the largest is as long at most."""
    assert draw3d.nice_scale(largest, length) == pytest.approx(scale, rel=1e-12)


def test_a_detail_is_a_little_larger_than_its_buoy():
    buoy = SimpleNamespace(heights=[0.5, -1.0, 2.0], at=lambda h: np.array([1.0, 2.0, h]), size=4.0)
    box = snapshot._detail(SimpleNamespace(alone=True, buoys=[buoy]))
    np.testing.assert_allclose(box, [[1 - 4.2, 2 - 4.2, 0.5 - 3.8], [1 + 4.2, 2 + 4.2, 0.5 + 3.8]])
    assert snapshot._detail(SimpleNamespace(alone=False, buoys=[buoy])) is None
    assert snapshot._detail(SimpleNamespace(alone=True, buoys=[])) is None
