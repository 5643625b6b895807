"""Figures and ParaView files of a run: there, readable, and in the right place.

Source: the record, solid geometry by the divergence theorem, the forms of the sea.
"""

import math
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from matplotlib.image import imread

from dolfbuoy import InputError, simulate
from dolfbuoy.forms import sea
from dolfbuoy.model.sea import elevation_at, heading, ramp, velocity_at, wavenumber
from dolfbuoy.results import record as results
from dolfbuoy.results.figures import draw_all
from dolfbuoy.results.paraview import export, hull_surface
from dolfbuoy.results.snapshot import snapshot
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
        record.add(values | {"surface_elevation": 0.0})
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
    names = ["trajectory", "orbit", "tension", "heave", "cone_angle", "shapes", "snapshot"]
    check_images(draw_all(folder), names)


def test_a_cable_alone_has_no_buoy_figures(tmp_path):
    simulate(HANGING, out=tmp_path)
    check_images(draw_all(tmp_path), ["tension", "shapes", "snapshot"])
    assert {file.name.split(".")[0].split("_")[0] for file in export(tmp_path)} == {"cable"}


@pytest.mark.parametrize("rows", [1, 2])
def test_a_buoy_alone_has_no_cable_figures(tmp_path, rows):
    """Nor does a record that ends at once trouble them."""
    folder = write_free_buoy(tmp_path, np.arange(rows) * 0.04)
    check_images(draw_all(folder), ["trajectory", "heave", "cone_angle", "snapshot"])
    assert len(export(folder)) == rows + 1


def test_snapshot_at_a_time_takes_the_nearest_frame(moored):
    folder, record = moored
    figure = snapshot(record, load_scene(folder / "scene.toml"), time=0.9)
    assert figure.texts[0].get_text() == f"t = {record.frame.values[2]:.4g} s"


def test_paraview_cable_is_the_record(moored):
    folder, record = moored
    export(folder)
    for i in (0, record.sizes["frame"] - 1):
        mesh = meshio.read(folder / "paraview" / f"cable_{i:04d}.vtu")
        np.testing.assert_array_equal(mesh.points, record.cable_position.values[i])
        np.testing.assert_array_equal(mesh.point_data["s"], record.s.values)
        np.testing.assert_array_equal(mesh.cell_data["tension"][0], record.cable_tension.values[i])


def test_paraview_cable_of_higher_degree_has_its_tension_on_every_piece(tmp_path):
    scene = load_scene(HANGING, cable={"elements": 2, "position_degree": 3, "tension_degree": 2})
    scene.save(tmp_path / "scene.toml")
    s = np.linspace(0, 5, 7)
    record = results.Record(tmp_path / "results.nc", {}, {"s": s, "s_cell": np.array([1.25, 3.75])})
    shape = np.outer(s, [0.0, 0.6, -0.8])
    record.add({"time": 0.0, "frame": 0.0, "cable_position": shape, "cable_tension": np.array([70.0, 20.0])})
    record.flush()
    mesh = meshio.read(export(tmp_path)[0])
    np.testing.assert_array_equal(mesh.cell_data["tension"][0], [70, 70, 70, 20, 20, 20])


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
    files = export(folder)
    assert [f.name for f in files[-2:]] == ["cable.pvd", "hull.pvd"]
    assert record.sizes["frame"] == 7
    for collection in files[-2:]:
        sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
        np.testing.assert_array_equal([float(s.get("timestep")) for s in sets], record.frame.values)
        assert all((folder / "paraview" / s.get("file")).is_file() for s in sets)


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
