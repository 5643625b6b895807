"""ParaView files of a run: present, readable, and with all recorded data in the right place.

Source: the record, solid geometry by the divergence theorem, the forms of the sea.
"""

import math
import re
from types import SimpleNamespace
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from alone import simulate
from figure_scenes import HANGING, MOORED, NETWORK, write_free_buoy
from made_up import RECORD, SCENE
from scipy.spatial.transform import Rotation

from dolfbuoy import simulate as whole
from dolfbuoy.errors import InputError
from dolfbuoy.model.sea import elevation_at, heading, velocity_at, wavenumber
from dolfbuoy.results import record as results
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.hulls import surface_of
from dolfbuoy.results.paraview import buoy_mesh, export, hull_mesh, water_grid
from dolfbuoy.scene import load_scene


@pytest.fixture(scope="module")
def moored(tmp_path_factory):
    """(folder, record) of a short run with everything in it."""
    folder = tmp_path_factory.mktemp("moored")
    return folder, simulate(MOORED, out=folder)


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    folder = tmp_path_factory.mktemp("network")
    return folder, simulate(NETWORK, out=folder)


def test_paraview_has_all_of_a_network(network):
    """A file for all lines, for hulls, buoys, joints, water and bed around all of it, and a collection of them all."""
    folder, record = network
    names = {file.name for file in export(folder)}
    parts = ["cable", "hull", "buoy", "joint", "water", "bed"]
    assert {f"{name}.pvd" for name in [*parts, "network"]} == {name for name in names if name.endswith(".pvd")}
    shown = ElementTree.parse(folder / "paraview" / "network.pvd").getroot().iter("DataSet")
    shown = {(one.get("timestep"), one.get("file").rsplit("_", 1)[0]) for one in shown}
    assert shown == {(repr(float(t)), name) for t in record.frame.values for name in parts}
    lines, joint, bed = (meshio.read(folder / "paraview" / f"{name}_0000.vtu") for name in ("cable", "joint", "bed"))
    for name in ("cable", "segment"):
        np.testing.assert_array_equal(lines.cell_data[f"{name} [1]"][0], record[f"{name}_of_cell"])
    drawn = lines.cells_dict["line"]
    for number in range(4):
        (nodes,), mine = np.nonzero(record.cable_of_node.values == number), record.cable_of_cell.values == number
        np.testing.assert_array_equal(drawn[mine], np.column_stack([nodes[:-1], nodes[1:]]))
    np.testing.assert_allclose(joint.points, record.joint_position.values[0])
    heavy = {"Y": 200.0 * 9.81, "ring": -3.0 * 1025 * 9.81, "port.1": -0.1 * 1025 * 9.81}
    np.testing.assert_allclose(joint.point_data["net weight [N]"], [heavy[name] for name in record.joint.values])
    assert bed.points[:, 0].max() > 30.0


def test_paraview_hulls_have_the_numbers_of_their_buoys():
    scene = load_scene("two-buoys", time__end=0.2)
    record = whole(scene)
    mesh = hull_mesh(Frames(record, scene).at(0.0))
    for number, place in enumerate(record.buoy_position.values[0]):
        mine = mesh.cells_dict["quad"][mesh.cell_data["buoy [1]"][0] == number]
        np.testing.assert_allclose(mesh.points[np.unique(mine)][:, :2].mean(axis=0), place[:2], atol=0.1)
    assert np.ptp(record.buoy_position.values[0, :, 0]) > 1.0


def test_paraview_cable_is_the_record(moored):
    folder, record = moored
    export(folder)
    for i in (0, record.sizes["frame"] - 1):
        mesh = meshio.read(folder / "paraview" / f"cable_{i:04d}.vtu")
        np.testing.assert_array_equal(mesh.points, record.cable_position.values[i])
        np.testing.assert_array_equal(mesh.point_data["s [m]"], record.s.values)
        np.testing.assert_array_equal(mesh.point_data["velocity [m/s]"], record.cable_velocity.values[i])
        np.testing.assert_array_equal(mesh.cell_data["tension [N]"][0], record.cable_tension.values[i])
        np.testing.assert_array_equal(mesh.cell_data["largest tension [N]"][0], record.cable_tension_maximum)


def test_paraview_has_the_bending_of_lines_that_bend(tmp_path):
    """Moment and curvature in the nodes of an instant, and the largest curvature of all steps."""
    time = {"end": 0.4, "step": 0.1, "output_every": 0.2}
    rod = {"bending_stiffness": 1e3, "top": {"kind": "free"}, "from_end": {"direction": [1.0, 0.0, 0.0]}}
    points = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]
    scene = load_scene(HANGING, cable=rod, time=time, initial={"kind": "polyline", "points": points})
    simulate(scene, out=tmp_path)
    mesh, record = meshio.read(export(tmp_path)[1]), results.read(tmp_path / "results.nc")
    np.testing.assert_array_equal(mesh.point_data["moment m [N m]"], record.cable_moment.values[1])
    np.testing.assert_array_equal(mesh.point_data["curvature [m-1]"], record.curvature.values[1])
    np.testing.assert_array_equal(mesh.point_data["largest curvature [m-1]"], record.curvature_maximum)
    assert np.abs(record.cable_moment.values[1]).max() > 0


def test_paraview_cable_of_higher_degree_has_its_tension_on_every_piece(tmp_path):
    scene = load_scene(HANGING, cable={"elements": 2, "position_degree": 3, "tension_degree": 2})
    scene.save(tmp_path / "scene.toml")
    s = np.linspace(0, 5, 7)
    along = {"s": s, "s_cell": np.array([1.25, 3.75]), "segment_of_cell": np.zeros(2)}
    along |= {"cable_of_node": np.zeros(7), "cable_of_cell": np.zeros(2)}
    record = results.Record(tmp_path / "results.nc", {}, along, {"cable": np.array(["cable"])})
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


def test_instants_for_paraview_are_as_many_as_are_wanted(tmp_path):
    """Evenly from the first to the last; what there was of more is gone, and what is the user's stays."""
    record = simulate(HANGING, out=tmp_path, time={"output_every": 0.02, "scheme": "backward-euler"})
    assert len(record.frame) > 6
    files = export(tmp_path)
    (tmp_path / "paraview" / "cable_mine.vtu").write_text("mine")
    assert len([file for file in files if file.name.startswith("cable_")]) == len(record.frame)
    few = export(tmp_path, 3)
    assert {file.name for file in few} | {"cable_mine.vtu"} == {path.name for path in (tmp_path / "paraview").iterdir()}
    sets = ElementTree.parse(tmp_path / "paraview" / "cable.pvd").getroot().iter("DataSet")
    expected = record.frame.values[[0, round((len(record.frame) - 1) / 2), -1]]
    assert [float(one.get("timestep")) for one in sets] == pytest.approx(expected)
    last = meshio.read(tmp_path / "paraview" / "cable_0002.vtu").points
    (tmp_path / "paraview").rename(tmp_path / "elsewhere")
    (tmp_path / "paraview").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="is a link"):  # it leads out of the folder
        export(tmp_path, 2)
    assert (tmp_path / "elsewhere" / "cable_0002.vtu").exists()
    np.testing.assert_allclose(last, record.cable_position.isel(frame=-1))


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
    fine = results.read(folder / "results.nc").isel(frame=slice(0, 3))
    frames = Frames(fine.assign_coords(frame=record.time.values[30:33]), scene)
    before, now = (hull_mesh(frames.at(t)) for t in frames.times[:2])
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


@pytest.mark.parametrize(("size", "reach"), [(10.0, 5.0), (40.0, 10.0)])
def test_water_reaches_as_far_on_every_side(size, reach):
    """Around places that are all on one side of the origin; a quarter of their extent, or five metres."""
    places = np.array([[100.0, 30.0, -20.0], [100.0 + size, 33.0, 0.0]])
    points, quads = water_grid(SimpleNamespace(scene=load_scene(HANGING), places=places))
    np.testing.assert_allclose(points.min(axis=0), [100.0 - reach, 30.0 - reach, 0.0])
    np.testing.assert_allclose(points.max(axis=0), [100.0 + size + reach, 33.0 + reach, 0.0])
    corners = points[quads]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]
    sizes = np.ptp(points, axis=0)[:2] / 8
    np.testing.assert_allclose(first, np.tile([sizes[0], 0.0, 0.0], (64, 1)), atol=1e-12)
    np.testing.assert_allclose(second, np.tile([0.0, sizes[1], 0.0], (64, 1)), atol=1e-12)


def test_still_water_is_one_mesh(tmp_path):
    simulate({"sea": {"depth": 9.0}} | HANGING, out=tmp_path, cable={"diameter": 0.01})
    assert [f.name for f in export(tmp_path) if f.name.startswith("water")] == ["water_0000.vtu", "water.pvd"]


def test_surface_of_a_hull_is_closed_and_points_outwards():
    """The divergence theorem on the quadrilaterals gives the volume of two frusta of 48-gons."""
    points, quads = surface_of(np.array([[h - 0.7, d / 2] for h, d in MOORED["buoy"]["hull"]]), cell=0.3)
    a, b, c, d = (points[quads[:, i]] for i in range(4))
    volume = (np.einsum("ij,ij", a, np.cross(b, c)) + np.einsum("ij,ij", a, np.cross(c, d))) / 6
    solid = 0.4 / 3 * (0.8**2 + 0.8 * 1.2 + 1.2**2) + 0.8 * 1.2**2
    assert volume == pytest.approx(solid * 24 * math.sin(2 * math.pi / 48), rel=1e-12)
    assert np.ptp(points[:, 2]) == pytest.approx(1.2)


def test_paraview_has_the_mooring_force_of_the_instant():
    """Of the row of the frame's time: there are four rows to a frame here."""
    force = np.random.default_rng(4).uniform(-1e4, 1e4, (RECORD.sizes["time"], 1, 3))
    record = RECORD.assign(mooring_force=(("time", "attachment", "xyz"), force))
    frame = Frames(record.assign_coords(attachment=["cable.to"]), SCENE).at(12.0)
    np.testing.assert_array_equal(buoy_mesh(frame).point_data["mooring force [N]"], force[120])
