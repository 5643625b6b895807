"""Figures of a run: present, legible, without overlaps, and with the water in its place.

Source: the record, solid geometry by the divergence theorem, the forms of the sea.
"""

import math
from xml.etree import ElementTree

import numpy as np
import pytest
from figure_helpers import nothing_overlaps
from figure_scenes import HANGING, MOORED, NETWORK, WAVES, write_free_buoy
from matplotlib.image import imread

from dolfbuoy import InputError, figures, simulate
from dolfbuoy.forms import sea
from dolfbuoy.model.airy import ramp
from dolfbuoy.model.sea import elevation_at, heading, velocity_at, wavenumber
from dolfbuoy.results.figures import draw_all
from dolfbuoy.results.paraview import export
from dolfbuoy.results.snapshot import JOINTS
from dolfbuoy.scene import load_scene


@pytest.fixture(scope="module")
def moored(tmp_path_factory):
    """(folder, record) of a short run with everything in it."""
    folder = tmp_path_factory.mktemp("moored")
    return folder, simulate(MOORED, out=folder)


def check_images(files, names):
    """PNG and SVG of each name; the PNG shows something and is large enough to print, the SVG is well formed."""
    assert sorted(f.name for f in files) == sorted(f"{name}{suffix}" for name in names for suffix in (".png", ".svg"))
    for file in files:
        if file.suffix == ".png":
            image = imread(file)[..., :3]
            assert min(image.shape[:2]) >= 300
            assert 0.005 < np.mean(image.min(axis=-1) < 0.9) < 0.6, file.name
            border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
            assert border.min() > 0.9, f"{file.name} is cut off"
        else:
            assert len(list(ElementTree.parse(file).getroot().iter())) > 50


def test_figures_are_drawn_in_one_order(monkeypatch):
    """Whatever was imported first: files of a run come in the order of their figures."""
    names = list(figures.in_order())
    monkeypatch.setattr(figures, "FIGURES", dict(reversed(figures.FIGURES.items())))
    found = list(figures.in_order())
    own = {module: [name for name in names if figures.FIGURES[name].__module__ == module] for module in figures._ORDER}
    assert names == [name for module in own.values() for name in module]
    assert found == [name for module in own.values() for name in reversed(module)]


def test_every_figure_of_a_moored_buoy(moored):
    folder, _ = moored
    names = ["trajectory", "track", "orbit", "tension", "envelope", "heave", "cone_angle", "roll_pitch_yaw"]
    said = []
    check_images(draw_all(folder, said.append), [*names, "shapes", "snapshot"])
    assert said == [
        f"No spectrum of the {what}: it needs 64 instants after the start, the record has 61."
        for what in ("motion", "tension")
    ]


def test_nothing_in_a_figure_stands_over_anything_else(moored):
    """No text is cut off, none lies on another one; not in a long and high box, nor in a flat one."""
    _, record = moored
    shallow = load_scene({key: MOORED[key] for key in ("sea", "buoy", "waves", "wind")} | {"time": MOORED["time"]})
    drawn = [
        figures.FIGURES[name](record) for name in figures.FIGURES if "spectrum" not in name and name != "curvature"
    ]
    drawn += [figures.snapshot(record[["time", "buoy_position", "buoy_orientation"]], shallow)]
    long = record.assign(cable_position=record.cable_position * [30.0, 1.0, 1.0])
    drawn += [figures.snapshot(long.drop_vars("buoy_position")), figures.shapes(long)]
    assert len(drawn) == 13
    for figure in drawn:
        assert nothing_overlaps(figure)


def test_curvature_of_a_line_that_bends(tmp_path):
    """Largest and allowed curvature along the line are those of the record and of the scene."""
    cable = {"bending_stiffness": 100.0, "minimum_bend_radius": 4.0, "from_end": {"direction": [1.0, 0.0, 0.0]}}
    record = simulate({**HANGING, "cable": HANGING["cable"] | cable}, out=tmp_path)
    assert "curvature.png" in {file.name for file in draw_all(tmp_path)}
    (axes,) = figures.curvature(record).axes
    found = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(found["largest"], record.curvature.values.max(axis=0))
    np.testing.assert_allclose(found["allowed"], 0.25)


def test_a_cable_alone_has_no_buoy_figures(tmp_path):
    simulate(HANGING, out=tmp_path)
    check_images(draw_all(tmp_path), ["tension", "envelope", "shapes", "snapshot"])
    assert {file.name.split(".")[0].split("_")[0] for file in export(tmp_path)} == {"cable"}


@pytest.mark.parametrize("rows", [1, 2])
def test_a_buoy_alone_has_no_cable_figures(tmp_path, rows):
    """Nor does a record that ends at once trouble them."""
    folder = write_free_buoy(tmp_path, np.arange(rows) * 0.04)
    figures = ["trajectory", "heave", "cone_angle", "snapshot"]
    check_images(draw_all(folder), figures if rows == 1 else [*figures, "track"])
    exported = [file.name for file in export(folder)]
    assert [name for name in exported if name.endswith(".pvd")] == ["hull.pvd", "buoy.pvd", "water.pvd", "bed.pvd"]
    assert len(exported) == 3 * rows + 1 + 4


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    folder = tmp_path_factory.mktemp("network")
    return folder, simulate(NETWORK, out=folder)


def test_a_network_is_drawn_as_a_whole(network):
    """Every line where the record has it, joints by their kind, bed, hull; each part has the other figures."""
    folder, record = network
    whole, plan = figures.snapshot(record).axes
    x, joints = record.cable_position.values[-1], record.joint_position.values[-1]
    for drawn, dimensions in (
        ([np.array(line.get_data_3d()).T for line in whole.lines], 3),
        ([np.array(line.get_data()).T for line in plan.lines], 2),
    ):
        for number in range(4):
            nodes = x[record.cable_of_node.values == number, :dimensions]
            assert any(line.shape == nodes.shape and np.allclose(line, nodes) for line in drawn)
        for place in (*joints, [0.0, 0.0, -20.0], [30.0, -25.0, -20.0]):
            assert any(len(line) == 1 and np.allclose(line[0], place[:dimensions]) for line in drawn)
    symbols = {tuple(np.ravel(line.get_data_3d())): line.get_marker() for line in whole.lines}
    for name, kind in {"Y": "clump", "ring": "float", "port.1": "float"}.items():
        assert symbols[tuple(record.joint_position.sel(joint=name).values[-1])] == JOINTS[kind][0]
    words = [text.get_text() for text in whole.figure.legends[0].get_texts()]
    assert {"a-b", "port", "starboard", "up", "float", "clump", "anchor", "sea bed", "buoy"} <= set(words)
    names = {file.stem for file in draw_all(folder)}
    assert {"snapshot", "tension_port", "shapes_a_b", "heave"} <= names
    assert not {"snapshot_port", "tension", "heave_buoy"} & names
    with pytest.raises(InputError, match=r"figures\.tension draws one cable of a-b, port, starboard, up: give cable="):
        figures.tension(record)
    with pytest.raises(InputError, match=r"cable = 'keel' is none"):
        figures.tension(record, cable="keel")
    (axes,) = figures.tension(record, cable="port").axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e-3 * record.tension_top.sel(cable="port"), rtol=1e-12)


def test_snapshot_at_a_time_takes_the_nearest_frame(moored):
    folder, record = moored
    figure = figures.snapshot(record, load_scene(folder / "scene.toml"), time=0.9)
    assert figure.texts[0].get_text().replace("\xa0", " ") == f"t = {record.frame.values[2]:.4g} s"


def test_recorded_velocity_of_the_cable_is_that_of_its_positions(tmp_path):
    """Backward Euler: the difference of two steps over the step, to the last digits."""
    record = simulate(HANGING, time={"output_every": 0.02, "scheme": "backward-euler"})
    difference = np.diff(record.cable_position.values, axis=0) / 0.02
    np.testing.assert_allclose(record.cable_velocity.values[1:], difference, rtol=1e-9, atol=1e-9)
    assert np.abs(difference).max() > 0.5


@pytest.mark.parametrize("stretching", ["wheeler", "vertical", "none"])
@pytest.mark.parametrize("profile", ["uniform", "power", [[-15.0, 0.2], [-5.0, 0.6], [0.0, 0.9]]])
def test_water_in_pictures_is_the_water_of_the_forms(stretching, profile):
    current = {"direction_deg": 70.0, "profile": profile} | ({} if isinstance(profile, list) else {"speed": 0.7})
    data = {"waves": {**WAVES, "stretching": stretching}, "current": current}
    scene = load_scene({key: MOORED[key] for key in ("sea", "buoy")} | data)
    t = 1.3
    c, s, _ = heading(25.0)
    omega = 2 * math.pi / 5.0
    wave = sea.Wave(
        0.8 * ramp(t, 3.0), wavenumber(scene), omega, math.radians(40) - omega * t, c, s, scene.sea.depth, stretching
    )
    velocity = [float(v) for v in heading(70.0)]
    if isinstance(profile, list):
        flow = sea.tabulated_current(sea.as_vector(velocity), *zip(*profile, strict=True))
    else:
        velocity = sea.as_vector([0.7 * v for v in velocity])
        uniform = profile == "uniform"
        flow = sea.uniform_current(velocity) if uniform else sea.power_law_current(velocity, 20.0, 1 / 7)
    for x in ([1.0, 2.0, -7.0], [4.0, -3.0, 0.2], [0.0, 0.0, -0.3], [11.0, 5.0, -19.99]):
        expected = sea.flow(x, wave, flow)
        assert elevation_at(scene, t, x) == pytest.approx(float(expected.elevation), rel=1e-13)
        np.testing.assert_allclose(
            velocity_at(scene, t, x), [float(expected.velocity[i]) for i in range(3)], rtol=1e-12
        )


def test_a_folder_without_a_run(tmp_path):
    with pytest.raises(InputError, match=r"holds no run: there is no results\.nc"):
        draw_all(tmp_path)
