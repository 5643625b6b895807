"""Pictures of modes and hulls, each alone: magnification of shapes, boxes, silhouettes, phases, files.

Source: shapes, rotations and boxes by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import rotation_matrix
from made_up import SCENE

from dolfbuoy import load_scene
from dolfbuoy.results import mode_figures, mode_record
from dolfbuoy.results.draw3d import clear_azimuth
from dolfbuoy.results.hulls import Floating, _refined, surface_of

HALF = math.sqrt(0.5)
REST = np.column_stack([np.linspace(0.0, 6.0, 7), np.zeros(7), np.linspace(-20.0, 0.0, 7)])


def made_up_modes(turn=0.3, kind="oscillates"):
    """Of a line of six elements and a buoy: two modes, of which the second is twice as large and has no period."""
    shape = np.zeros((2, 2, 7, 3))
    shape[0, 0, :, 1] = np.linspace(0.0, 1.0, 7)
    shape[0, 1, :, 2] = np.linspace(0.0, 0.5, 7)
    shape[1] = 2 * shape[0]
    motion, rotation = np.zeros((2, 2, 1, 3)), np.zeros((2, 2, 1, 3))
    motion[:, 0, 0, 1], rotation[:, 0, 0, 2] = [1.0, 2.0], [turn, 2 * turn]
    data = {
        "rest_cable_position": (("node", "xyz"), REST),
        "cable_position": (("mode", "part", "node", "xyz"), shape),
        "cable_tension": (("mode", "part", "cell"), 1000.0 * np.arange(24).reshape(2, 2, 6)),
        "rest_buoy_position": (("buoy", "xyz"), np.array([[6.0, 0.0, 1.0]])),
        "rest_buoy_orientation": (("buoy", "quaternion"), np.array([[HALF, HALF, 0.0, 0.0]])),
        "buoy_position": (("mode", "part", "buoy", "xyz"), motion),
        "buoy_rotation": (("mode", "part", "buoy", "xyz"), rotation),
        "period": ("mode", [4.0, np.nan]),
        "damping_ratio": ("mode", [0.125, 1.0]),
        "kind": ("mode", np.array([kind, "overdamped"], dtype=object)),
        "name": ("mode", np.array(["sway", "drift"], dtype=object)),
    }
    nodes = np.linspace(0.0, 22.0, 7)
    along = {"s": ("node", nodes), "s_cell": ("cell", (nodes[1:] + nodes[:-1]) / 2)}
    along |= {"cable_of_node": ("node", np.zeros(7, dtype=int)), "cable_of_cell": ("cell", np.zeros(6, dtype=int))}
    along["segment_of_cell"] = "cell", np.zeros(6, dtype=int)
    return xr.Dataset(data, along | {"mode": [1, 2], "cable": ["cable"], "buoy": ["buoy"], "xyz": list("xyz")})


@pytest.mark.parametrize(("turn", "factor"), [(0.0, 0.12 * 21), (0.09, 0.12 * 21), (0.3, 0.25 / 0.3)])
def test_how_much_shapes_are_enlarged(turn, factor):
    """To 12 % of the extent, 21 m; a turn to a quarter of a radian at most."""
    made = made_up_modes(turn)
    assert mode_record.enlargement(made, made.isel(mode=0)) == pytest.approx(factor)
    assert mode_record.enlargement(made, made.isel(mode=1)) == pytest.approx(factor / 2)
    still = made.isel(mode=0) * 0
    assert mode_record.enlargement(made, still) == pytest.approx(0.25 / 1e-12)
    point = made.drop_vars(["rest_cable_position", "cable_position", "cable_tension"])
    assert mode_record.enlargement(point, point.isel(mode=0)) == pytest.approx(min(0.12, 0.25 / max(turn, 1e-12)))


def test_a_shape_moves_as_its_phases_say():
    """The real part at its largest, minus the imaginary one a quarter of a period later; the buoy turns with it."""
    made, factor = made_up_modes(), 0.25 / 0.3
    found = mode_record.moving(made, 1, np.array([0.0, 1.0, 2.0, 3.0]), np.array([0, 1, -1, 1j]))
    real, imaginary = made.cable_position.values[0]
    for k, moved in enumerate((0 * real, real, -real, -imaginary)):
        np.testing.assert_allclose(found.cable_position[k], REST + factor * moved, atol=1e-14)
    np.testing.assert_allclose(found.cable_tension[1:3], factor * made.cable_tension[0, 0].values * [[1], [-1]])
    np.testing.assert_allclose(found.buoy_position[:, 0], [[6, y, 1] for y in (0, factor, -factor, 0)], atol=1e-14)
    rest = rotation_matrix(np.array([HALF, HALF, 0.0, 0.0]))
    for k, angle in enumerate((0.0, 0.25, -0.25, 0.0)):
        c, s = math.cos(angle), math.sin(angle)
        turned = rotation_matrix(found.buoy_orientation.values[k, 0])
        np.testing.assert_allclose(turned, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ rest, atol=1e-14)
    assert (found.time.values.tolist(), found.frame.values.tolist()) == ([0, 1, 2, 3], [0, 1, 2, 3])


def test_boxes_of_two_views():
    """With the same heights; the narrow one at least 0.3 as wide as high, or a quarter of the other one."""
    seen = [np.array([[0.0, -10.0], [4.0, 0.0]]), np.array([[0.0, -9.0], [1.0, -1.0]])]
    flat = [points * [1.0, 0.01] for points in seen]
    for views, expected in (
        (seen, [((-0.5, 4.5), (-10.5, 0.5)), ((-1.5, 2.5), (-10.5, 0.5))]),
        (flat, [((-0.05, 4.05), (-0.15, 0.05)), ((-0.05, 1.05), (-0.15, 0.05))]),
        ([flat[0], flat[1] * [0.1, 1.0]], [((-0.05, 4.05), (-0.15, 0.05)), ((-0.5, 0.6), (-0.15, 0.05))]),
    ):
        for box, (across, up) in zip(mode_figures._boxes(views), expected, strict=True):
            np.testing.assert_allclose(box, (across, up))


@pytest.mark.parametrize(("depth", "kind", "water", "said"), [
    (20.0, "oscillates", 2, "1: sway, period 4 s, damping ratio 0.125; 0.833 times the shape of modes.nc"),
    (None, "grows", 0, "1: sway, unstable: grows; 0.833 times the shape of modes.nc"),
])  # fmt: skip
def test_the_figure_of_a_mode(depth, kind, water, said):
    """Words, still water where there is any, the four phases, and the same scale in both panels."""
    scene = SCENE if depth else SimpleNamespace(sea=None, network=SCENE.network, gravity=9.81, seabed=None, vessel=None)
    figure = mode_figures.mode_shape(made_up_modes(kind=kind), 1, scene)
    ahead, aside = figure.axes
    lines = [line for axes in figure.axes for line in axes.lines if str(line.get_color()) == "#56B4E9"]
    assert (len(lines), figure._suptitle.get_text(), figure._suptitle.get_fontsize()) == (water, said, 8)
    assert all(line.get_zorder() == 0.5 for line in lines)
    assert [axes.get_xlabel() for axes in (ahead, aside)] == ["ahead [m]", "aside [m]"]
    assert (ahead.get_ylabel(), ahead.get_ylim()) == ("z [m]", aside.get_ylim())
    widths = [float(np.ptp(axes.get_xlim())) for axes in figure.axes]
    np.testing.assert_allclose(ahead.get_gridspec().get_width_ratios(), widths)
    height = min(max(5.8 * np.ptp(ahead.get_ylim()) / sum(widths), 1.6), 4.5)
    np.testing.assert_allclose(figure.get_size_inches(), [7.0, height + 1.1])
    assert all(len(axes.get_xticks()) <= 7 for axes in figure.axes)
    assert [axes.xaxis.get_major_locator()._nbins for axes in figure.axes] == [5, 5]
    assert figure.get_layout_engine().get()["rect"][1] == pytest.approx(0.25 / (height + 1.1))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(mode_figures.PHASE_STYLES)
    np.testing.assert_allclose(ahead.lines[0].get_xydata(), REST[:, [0, 2]])
    np.testing.assert_allclose(aside.lines[2].get_xydata()[-1], [0.25 / 0.3, 0.0], atol=1e-12)


@pytest.mark.parametrize("paraview", [True, False])
def test_files_of_modes(monkeypatch, tmp_path, paraview):
    """Sixteen instants of a period, or of a second; figures are called by their numbers."""
    kept, written = [], []
    monkeypatch.setattr(mode_figures, "mode_shape", lambda dataset, number, scene, direction: (number, direction))
    monkeypatch.setattr(mode_figures, "keep", lambda *arguments: kept.append(arguments) or [arguments[2]])
    monkeypatch.setattr(mode_figures, "write_series", lambda *arguments: written.append(arguments) or ["vtu"])
    files = mode_figures.draw_modes(
        tmp_path, made_up_modes(), SCENE, **({} if paraview else {"paraview": False, "svg": False})
    )
    assert kept == [((k, 0.0), tmp_path, f"mode_{k:02d}", "modes", paraview) for k in (1, 2)]
    assert files == (["mode_01", "vtu", "mode_02", "vtu"] if paraview else ["mode_01", "mode_02"])
    assert len(written) == 2 * paraview
    for (folder, kind, frames, meshes), period, k in zip(written, (4.0, 1.0), (1, 2), strict=False):
        assert (folder, kind, sorted(meshes)) == (tmp_path, "modes", [f"mode_{k:02d}_cable", f"mode_{k:02d}_hull"])
        np.testing.assert_allclose([frame.time for frame in frames], period * np.arange(16) / 16)


# -- hulls -------------------------------------------------------------------------------------------------------------


def test_pieces_of_an_outline():
    """None longer than a cell; what has no length is left out."""
    outline = np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 4.0]])
    for cell, count in ((5.0, 1), (4.99, 2), (2.5, 2), (np.inf, 1), (100.0, 1), (1.0, 5)):
        found = _refined(outline, cell)
        np.testing.assert_allclose(found, np.outer(np.arange(count + 1) / count, [3.0, 4.0]))
    points, quads = surface_of(np.array([[0.0, 1.0], [2.0, 1.0]]))
    assert (points.shape, quads.shape) == ((4 * 48, 3), (3 * 48, 4))
    np.testing.assert_allclose(points[48:50], [[1.0, 0.0, 0.0], [math.cos(math.pi / 24), math.sin(math.pi / 24), 0.0]])


def test_the_silhouette_of_a_leaning_cylinder():
    """As it is seen along y, about which it leans, and along x, where it is as wide as it was."""
    buoy = load_scene(SCENE, buoy__hull=[[0.0, 2.0], [3.0, 2.0]]).network.buoys["buoy"]
    a = 0.3
    R = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    one = Floating(buoy, np.array([5.0, 7.0, -1.0]), R)
    low, high = -one.center, 3.0 - one.center
    along = np.array([[low, 1], [high, 1], [high, -1], [low, -1], [low, 1]])
    upright = np.column_stack([along[:, 1], along[:, 0]])
    seen = upright @ [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]] + [5.0, -1.0]
    np.testing.assert_allclose(one.silhouette(np.array([1.0, 0.0, 0.0])), seen, atol=1e-12)
    other = one.silhouette(np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(
        other, np.column_stack([7.0 + along[:, 1], -1.0 + along[:, 0] * math.cos(a)]), atol=1e-12
    )


@pytest.mark.parametrize(
    ("direction", "azimuth"),
    [(0.0, -60.0), (30.0, -60.0), (60.0, -30.0), (90.0, -30.0), (120.0, -150.0), (150.0, -120.0)],
)
def test_from_where_a_plane_is_seen_best(direction, azimuth):
    assert clear_azimuth(direction) == azimuth
