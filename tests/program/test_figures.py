"""Figures and ParaView files of a run: there, readable, and in the right place.

Source: the record, solid geometry by the divergence theorem, the forms of the sea.
"""

import math
import re
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from figure_helpers import nothing_overlaps
from matplotlib.image import imread
from scipy.spatial.transform import Rotation

from dolfbuoy import InputError, figures, simulate
from dolfbuoy.forms import sea
from dolfbuoy.model.sea import elevation_at, heading, ramp, velocity_at, wavenumber
from dolfbuoy.results import paraview
from dolfbuoy.results import record as results
from dolfbuoy.results.figures import draw_all
from dolfbuoy.results.paraview import export, hull_surface
from dolfbuoy.results.snapshot import JOINTS
from dolfbuoy.scene import load_scene

WAVES = {"amplitude": 0.8, "period": 5.0, "ramp": 3.0, "direction_deg": 25.0, "phase_deg": 40.0}
MOORED = {
    "sea": {"depth": 20},
    "cable": {
        "length": 22,
        "line_density": 27.6,
        "diameter": 0.08,
        "axial_stiffness": 2.3e8,
        "elements": 6,
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "tangential_drag": 0.1,
    },
    "buoy": {
        "hull": [[0, 1.6], [0.4, 2.4], [1.2, 2.4]],
        "mass": 400,
        "center_of_mass": 0.5,
        "inertia": [192, 288],
        "point_masses": [{"mass": 100, "height": 1.5}],
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "axial_drag": 1.0,
    },
    "current": {"speed": 0.5, "direction_deg": 60},
    "wind": {"speed_10m": 10, "direction_deg": 30, "area": 1.0, "height": 2.0},
    "external_force": {"force": [500, 0, 0]},
    "waves": {**WAVES, "period": 2.0, "amplitude": 0.15, "ramp": 0.0},
    "time": {"end": 2.4, "step": 0.04, "output_every": 0.4},
}
HANGING = {
    "cable": {"length": 5, "line_density": 2, "elements": 5, "anchor": [0, 0, 0], "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0, 0, 0], [5, 0, 0]]},
    "time": {"end": 0.2, "step": 0.02, "output_every": 0.05},
}


@pytest.fixture(scope="module")
def moored(tmp_path_factory):
    """(folder, record) of a short run with everything in it."""
    folder = tmp_path_factory.mktemp("moored")
    return folder, simulate(MOORED, out=folder)


def write_free_buoy(folder, times):
    """The record of a buoy without a cable that heaves and turns about y; made up, not computed."""
    scene = load_scene({key: MOORED[key] for key in ("sea", "buoy", "waves")} | {"time": {"end": 1.0, "step": 0.02}})
    folder.mkdir(exist_ok=True)
    scene.save(folder / "scene.toml")
    record = results.Record(folder / "results.nc", {"title": "made up"}, {})
    for t in times:
        beta = 0.2 + 0.3 * t
        values = {
            "time": t,
            "buoy_position": np.array([3.0, -2.0, 0.1 * math.sin(t)]),
            "cone_angle": math.degrees(beta),
        }
        values["buoy_orientation"] = np.array([math.cos(beta / 2), 0.0, math.sin(beta / 2), 0.0])
        values["surface_elevation"] = 0.0
        record.add({name: [value] for name, value in values.items()})
    record.flush()
    return folder


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
    drawn = [figures.FIGURES[name](record) for name in figures.FIGURES if "spectrum" not in name]
    drawn += [figures.snapshot(record[["time", "buoy_position", "buoy_orientation"]], shallow)]
    long = record.assign(cable_position=record.cable_position * [30.0, 1.0, 1.0])
    drawn += [figures.snapshot(long.drop_vars("buoy_position")), figures.shapes(long)]
    assert len(drawn) == 13
    for figure in drawn:
        assert nothing_overlaps(figure)


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


NETWORK = {
    "sea": {"depth": 20.0},
    "seabed": {"friction": 0.4},
    "material": {"rope": {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "normal_drag": 1.1}},
    "joint": [{"name": "Y", "mass": 200.0}, {"name": "ring", "volume": 3.0}],
    "cable": [
        {"name": "a-b", "material": "rope", "from": [0.0, 0.0, -20.0], "to": "Y", "length": 30.0, "elements": 4},
        {"name": "port", "material": "rope", "from": "Y", "to": "ring", "segments": [
            {"length": 8.0, "elements": 3, "body": {"volume": 0.1}}, {"length": 9.0, "elements": 2}]},
        {"name": "starboard", "material": "rope", "from": [30.0, -25.0, -20.0], "to": "Y", "length": 34.0,
         "elements": 5},
        {"name": "up", "material": "rope", "from": "ring", "to": "buoy.side", "length": 8.0, "elements": 3},
    ],
    "buoy": MOORED["buoy"] | {"fairleads": {"side": [0.3, 0.0, 0.1]}},
    "time": {"end": 0.2, "step": 0.1},
}  # fmt: skip


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
    assert {"a-b", "port", "starboard", "up", "float", "clump", "held end", "sea bed", "buoy"} <= set(words)
    names = {file.stem for file in draw_all(folder)}
    assert {"snapshot", "snapshot_buoy", "tension_port", "shapes_a_b", "heave_buoy"} <= names
    assert "snapshot_port" not in names
    with pytest.raises(InputError, match=r"figures\.tension draws one cable or one buoy"):
        figures.tension(record)


def test_paraview_has_all_of_a_network(network):
    """A file for each line and buoy, one for joints, water and bed around all of it, and a collection of them all."""
    folder, record = network
    names = {file.name for file in export(folder)}
    parts = [
        "cable_a_b",
        "cable_port",
        "cable_starboard",
        "cable_up",
        "hull_buoy",
        "buoy_buoy",
        "joint",
        "water",
        "bed",
    ]
    assert {f"{name}.pvd" for name in [*parts, "network"]} == {name for name in names if name.endswith(".pvd")}
    shown = ElementTree.parse(folder / "paraview" / "network.pvd").getroot().iter("DataSet")
    shown = {(one.get("timestep"), one.get("file").rsplit("_", 1)[0]) for one in shown}
    assert shown == {(repr(float(t)), name) for t in record.frame.values for name in parts}
    port, joint, bed = (
        meshio.read(folder / "paraview" / f"{name}_0000.vtu") for name in ("cable_port", "joint", "bed")
    )
    np.testing.assert_array_equal(port.cell_data["segment [1]"][0], [0, 0, 0, 1, 1])
    np.testing.assert_array_equal(port.cell_data["cable [1]"][0], 5 * [1])
    np.testing.assert_allclose(joint.points, record.joint_position.values[0])
    heavy = {"Y": 200.0 * 9.81, "ring": -3.0 * 1025 * 9.81, "port.1": -0.1 * 1025 * 9.81}
    np.testing.assert_allclose(joint.point_data["net weight [N]"], [heavy[name] for name in record.joint.values])
    assert bed.points[:, 0].max() > 30.0


def test_snapshot_at_a_time_takes_the_nearest_frame(moored):
    folder, record = moored
    figure = figures.snapshot(record, load_scene(folder / "scene.toml"), time=0.9)
    assert figure.texts[0].get_text() == f"t = {record.frame.values[2]:.4g} s"


def test_paraview_cable_is_the_record(moored):
    folder, record = moored
    export(folder)
    for i in (0, record.sizes["frame"] - 1):
        mesh = meshio.read(folder / "paraview" / f"cable_{i:04d}.vtu")
        np.testing.assert_array_equal(mesh.points, record.cable_position.values[i])
        np.testing.assert_array_equal(mesh.point_data["s [m]"], record.s.values)
        np.testing.assert_array_equal(mesh.point_data["velocity [m/s]"], record.cable_velocity.values[i])
        np.testing.assert_array_equal(mesh.cell_data["tension [N]"][0], record.cable_tension.values[i])


def test_recorded_velocity_of_the_cable_is_that_of_its_positions(tmp_path):
    """Backward Euler: the difference of two steps over the step, to the last digits."""
    record = simulate(HANGING, time={"output_every": 0.02, "scheme": "backward-euler"})
    difference = np.diff(record.cable_position.values, axis=0) / 0.02
    np.testing.assert_allclose(record.cable_velocity.values[1:], difference, rtol=1e-9, atol=1e-9)
    assert np.abs(difference).max() > 0.5


def test_paraview_cable_of_higher_degree_has_its_tension_on_every_piece(tmp_path):
    scene = load_scene(HANGING, cable={"elements": 2, "position_degree": 3, "tension_degree": 2})
    scene.save(tmp_path / "scene.toml")
    s = np.linspace(0, 5, 7)
    record = results.Record(tmp_path / "results.nc", {}, {"s": s, "s_cell": np.array([1.25, 3.75])})
    shape = np.outer(s, [0.0, 0.6, -0.8])
    record.add({"time": [0.0], "frame": [0.0], "cable_position": [shape], "cable_tension": [np.array([70.0, 20.0])]})
    record.flush()
    mesh = meshio.read(export(tmp_path)[0])
    np.testing.assert_array_equal(mesh.cell_data["tension [N]"][0], [70, 70, 70, 20, 20, 20])


def test_paraview_hull_hangs_on_the_cable(moored):
    """The keel is at the end of the cable, the axis leans by the cone angle."""
    folder, record = moored
    export(folder)
    i = record.sizes["frame"] - 1
    mesh = meshio.read(folder / "paraview" / f"hull_{i:04d}.vtu")
    rings = mesh.points.reshape(5, 48, 3)  # keel's centre, three stations, centre of the top
    keel, top = rings[0, 0], rings[-1, 0]
    np.testing.assert_allclose(keel, record.cable_position.values[i, -1], atol=1e-6)
    lean = math.degrees(math.acos((top - keel)[2] / np.linalg.norm(top - keel)))
    assert lean > 0.1
    assert lean == pytest.approx(record.cone_angle.values[-1], abs=1e-4)


def test_paraview_hull_is_turned_as_the_quaternion_says(tmp_path):
    times = np.linspace(0, 1, 5)
    folder = write_free_buoy(tmp_path, times)
    export(folder)
    center = (400 * 0.5 + 100 * 1.5) / 500
    for i, t in enumerate(times):
        beta, mesh = 0.2 + 0.3 * t, meshio.read(folder / "paraview" / f"hull_{i:04d}.vtu")
        d = np.array([math.sin(beta), 0.0, math.cos(beta)])
        r_C = np.array([3.0, -2.0, 0.1 * math.sin(t)])
        rings = mesh.points.reshape(5, 48, 3)
        np.testing.assert_allclose(rings[0, 0], r_C - center * d, atol=1e-12)
        np.testing.assert_allclose(rings[1].mean(axis=0), r_C - center * d, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(rings[2] - (r_C + (0.4 - center) * d), axis=1), 1.2, atol=1e-12)


def test_collections_hold_the_times_of_the_frames(moored):
    folder, record = moored
    collections = export(folder)[-5:]
    assert [f.name for f in collections] == ["cable.pvd", "hull.pvd", "buoy.pvd", "water.pvd", "bed.pvd"]
    assert record.sizes["frame"] == 7
    for collection in collections:
        sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
        times = record.frame.values[:1] if collection.name == "bed.pvd" else record.frame.values
        np.testing.assert_array_equal([float(s.get("timestep")) for s in sets], times)
        assert all((folder / "paraview" / s.get("file")).is_file() for s in sets)


def test_every_field_for_paraview_has_a_unit(moored):
    folder, _ = moored
    for file in export(folder):
        if file.suffix == ".vtu":
            mesh = meshio.read(file)
            fields = [*mesh.point_data, *mesh.cell_data]
            assert all(re.fullmatch(r"[\w ]+ \[.+\]", field) for field in fields), file.name
            assert fields or file.name.startswith("bed")


def test_paraview_buoy_and_hull_move_as_recorded(moored):
    """p / m at C; the hull's points move so from one step of backward Euler to the next."""
    folder, record = moored
    scene = load_scene(folder / "scene.toml")
    fine = record.isel(frame=slice(0, 3)).assign_coords(frame=record.time.values[30:33])
    moving = paraview.hull_meshes(fine, scene)
    before, now = (moving(i, t) for i, t in enumerate(fine.frame.values[:2]))
    v = now.point_data["velocity [m/s]"]
    turning = np.abs(v - v.mean(axis=0)).max()
    assert turning > 0.02
    assert np.abs((now.points - before.points) / 0.04 - v).max() < 0.01 * turning
    export(folder)
    mesh = meshio.read(folder / "paraview" / "buoy_0003.vtu")
    row = int(np.abs(record.time.values - record.frame.values[3]).argmin())
    np.testing.assert_allclose(mesh.points[0], record.buoy_position.values[row])
    np.testing.assert_allclose(mesh.point_data["velocity [m/s]"][0], record.linear_momentum.values[row] / 500)
    np.testing.assert_allclose(mesh.point_data["axis [1]"][0], rotation(record.buoy_orientation.values[row])[:, 2])
    for name in ("roll", "pitch", "yaw"):
        assert mesh.point_data[f"{name} [degree]"][0] == record[name].values[row]


def rotation(q4):
    return Rotation.from_quat([*q4[1:], q4[0]]).as_matrix()


def test_paraview_water_is_the_sea_of_the_scene(moored):
    """Its surface and velocity at each instant, around all that moves; the bed is below it at the depth."""
    folder, record = moored
    scene = load_scene(folder / "scene.toml")
    export(folder)
    for i in (0, 4):
        mesh = meshio.read(folder / "paraview" / f"water_{i:04d}.vtu")
        t = float(record.frame.values[i])
        np.testing.assert_allclose(mesh.points[:, 2], elevation_at(scene, t, mesh.points * [1, 1, 0]), atol=1e-14)
        np.testing.assert_array_equal(mesh.point_data["elevation [m]"], mesh.points[:, 2])
        np.testing.assert_allclose(mesh.point_data["velocity [m/s]"], velocity_at(scene, t, mesh.points), atol=1e-14)
        assert np.ptp(mesh.points[:, 2]) == pytest.approx(2 * 0.15, rel=0.02)
        a, b, c, d = (mesh.points[mesh.cells_dict["quad"][:, k], :2] for k in range(4))
        p, q = c - a, d - b
        area = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum() / 2  # of quadrilaterals, without gap or overlap
        along = mesh.points @ heading(25.0), mesh.points @ heading(115.0)
        assert area == pytest.approx(np.ptp(along[0]) * np.ptp(along[1]))
        steps = np.diff(np.unique(along[0].round(9)))
        assert steps.max() < 2 * math.pi / wavenumber(scene) / 20  # it shows the waves
        for axis in (25.0, 115.0):
            seen = record.cable_position.values.reshape(-1, 3) @ heading(axis)
            assert (mesh.points @ heading(axis)).min() < seen.min() - 2
            assert (mesh.points @ heading(axis)).max() > seen.max() + 2
    bed = meshio.read(folder / "paraview" / "bed_0000.vtu").points
    np.testing.assert_array_equal(bed[:, 2], -20)
    assert np.ptp(bed @ heading(25.0)) == pytest.approx(np.ptp(along[0]))


def test_still_water_is_one_mesh(tmp_path):
    simulate({"sea": {"depth": 9.0}} | HANGING, out=tmp_path, cable={"diameter": 0.01})
    assert [f.name for f in export(tmp_path) if f.name.startswith("water")] == ["water_0000.vtu", "water.pvd"]


def test_hull_surface_is_closed_and_points_outwards():
    """The divergence theorem on the quadrilaterals gives the volume of two frusta of 48-gons."""
    points, quads = hull_surface(MOORED["buoy"]["hull"], 0.7, cell=0.3)
    a, b, c, d = (points[quads[:, i]] for i in range(4))
    volume = (np.einsum("ij,ij", a, np.cross(b, c)) + np.einsum("ij,ij", a, np.cross(c, d))) / 6
    solid = 0.4 / 3 * (0.8**2 + 0.8 * 1.2 + 1.2**2) + 0.8 * 1.2**2
    assert volume == pytest.approx(solid * 24 * math.sin(2 * math.pi / 48), rel=1e-12)
    assert np.ptp(points[:, 2]) == pytest.approx(1.2)


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
