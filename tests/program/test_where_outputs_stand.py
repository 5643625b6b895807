"""Location of outputs: tables and figures, nodes, bodies; messages about anchors; folders.

Source: lists by hand of visible output; the exact wording; positions, weights and limits by hand.
"""

import itertools
import json
import os
import stat
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from mpi4py import MPI

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import folder, frame, offset_record, summary
from dolfbuoy.results.quantities import QUANTITIES, chosen, shown_in
from dolfbuoy.scene.lines import Sinker

# -- quantities --------------------------------------------------------------------------------------------------------

MAIN = ["tension_top", "tension_anchor"]
BOTH = ["length_on_bed", "anchor_uplift", "anchor_horizontal", "needed_weight", "anchor_use", "anchor_moved"]
BOTH += ["utilisation", "smallest_tension", "anchor_moment", "end_moment"]
DEVICE = ["take_off_length", "take_off_tension", "absorbed_power"]


def test_what_is_shown_where():
    assert shown_in("statistics") == [
        *MAIN, *BOTH, "touchdown_moment", "largest_curvature", "bend_utilisation",
        *(f"buoy_position_{axis}" for axis in "xyz"), "offset", "freeboard", "cone_angle", "lean_at_start", "roll",
        "pitch", *DEVICE, "wind_force_x", "wind_force_y", "drift_force_x", "drift_force_y", "surface_elevation",
        "fixed_point_elevation", "place_tension",
    ]  # fmt: skip
    lean = ["bend_utilisation", "offset", "freeboard", "cone_angle", "lean_at_start"]
    assert shown_in("sweep") == [*MAIN, *BOTH, *lean, *DEVICE]
    elevations = ["surface_elevation", "fixed_point_elevation"]
    assert shown_in("statistics figure") == [*MAIN, "absorbed_power", *elevations]
    places = ["buoy_position_x", "buoy_position_z"]
    assert shown_in("sweep figure") == [*MAIN, *places, "cone_angle", "absorbed_power"]
    assert chosen("peaks") == {
        *MAIN, "anchor_uplift", "anchor_horizontal", "needed_weight", "buoy_position_z", "offset", "cone_angle", "roll",
        "pitch", "take_off_tension", "absorbed_power", *elevations,
    }  # fmt: skip
    assert {name: one.place for name, one in QUANTITIES.items() if one.place} == dict(
        zip(elevations, ("at the buoy", "at a fixed point"), strict=True)
    )


def test_curves_of_a_page():
    """Curves by their panels, in order; components of vectors."""
    panels = {}
    for name, one in QUANTITIES.items():
        for curve in one.curves:
            panels.setdefault(curve.panel, []).append(f"{name} {curve.component}".strip())
    assert panels == {
        "tension": MAIN,
        "length on the bed": ["length_on_bed"],
        "dragging": ["anchor_moved"],
        "bending moment": ["anchor_moment", "end_moment", "touchdown_moment"],
        "largest curvature": ["largest_curvature"],
        "height": ["buoy_position z", "surface_elevation"],
        "horizontal position of C": ["buoy_position x", "buoy_position y"],
        "offset": ["offset"],
        "freeboard": ["freeboard"],
        "angle": ["roll", "pitch", "yaw"],
        "length of take-offs": ["take_off_length"],
        "tension of take-offs": ["take_off_tension"],
        "absorbed power": ["absorbed_power"],
        "unstretched length": ["winch_length"],
        "wind force on vessels": ["wind_force x", "wind_force y"],
        "mean drift of waves": ["drift_force x", "drift_force y"],
        "tension at places": ["place_tension"],
    }
    assert [name for name, one in QUANTITIES.items() if one.paraview] == [
        "cone_angle", "roll", "pitch", "yaw", "displaced_mass", "surface_elevation", "cable_moment", "curvature",
        "curvature_maximum", "cable_tension_maximum", "cable_utilisation_maximum",
    ]  # fmt: skip
    at_ends = {name: one.at_ends.format(low="A", high="B") for name, one in QUANTITIES.items() if one.at_ends}
    assert at_ends == {
        "anchor_force": "force that holds it at A",
        "end_tension": "force that holds it at B",
        "tension_top": "tension at B",
        "tension_anchor": "tension at A",
        "anchor_moment": "bending moment at A",
        "end_moment": "bending moment at B",
    }


# -- frames ------------------------------------------------------------------------------------------------------------


def test_nodes_at_ends_of_pieces():
    """Of two cables, the second of two segments of two elements, drawn with two pieces each."""
    along = {
        "cable_of_node": [0] * 5 + [1] * 9,
        "cable_of_cell": [0] * 2 + [1] * 4,
        "segment_of_cell": [0] * 4 + [1] * 2,
    }
    record = xr.Dataset(
        {"tension_top": ("cable", [1.0, 2.0])}, {"cable": ["a", "b"]} | {k: (k[9:], v) for k, v in along.items()}
    )
    spans = frame._spans(record)
    assert spans == [frame.Span("a", slice(0, 5), slice(0, 2)), frame.Span("b", slice(5, 14), slice(2, 6))]
    assert [span.per for span in spans] == [2, 2]
    pieces = [Fake(cable=0, number=0), Fake(cable=1, number=0), Fake(cable=1, number=1)]
    frames = Fake(spans=spans, record=record, network=Fake(pieces=pieces))
    found = [frame.Frames.node_of(frames, piece, end) for piece in range(3) for end in (0, 1)]
    assert found == [0, 4, 5, 9, 9, 13]


def test_marks_of_joints():
    """By the weight of their bodies in water, m g - rho g V; ends on buoys have none."""
    rope = {"length": 20.0, "line_density": 2.0, "diameter": 0.02}
    bodies = {"C": {"mass": 100.0, "volume": 0.01}, "D": {"mass": 1.0, "volume": 0.01}, "E": {}, "F": {"mass": 10.0}}
    names = [*bodies]
    lines = [{"name": f"l{k}", "from": n, "to": m, **rope} for k, (n, m) in enumerate(itertools.pairwise(names))]
    lines.append({"name": "low", "from": [0, 0, -30], "to": "C", **rope})
    lines.append({"name": "high", "from": "F", "to": [60.0, 0, -10], **rope})
    joints = [{"name": name, **body} for name, body in bodies.items()]
    joints.append({"name": "H", "position": [0.0, 9.0, -20.0]})
    lines.append({"name": "held", "from": "H", "to": "C", **rope})
    sea = {"depth": 30.0, "density": 1000.0}
    scene = load_scene({"sea": sea, "joint": joints, "cable": lines, "gravity": 10.0})
    network = scene.network
    body = network.bodies["F"]
    network.bodies["F"] = Sinker.model_construct(**{**body.__dict__, "friction": 0.5, "place": (0.0, 0.0, -30.0)})
    frames = Fake(network=network, scene=scene, node_of=lambda piece, end: (piece, end))
    low, high = (next(k for k, p in enumerate(network.pieces) if network.name_of(k) == n) for n in ("low", "high"))
    frames._ends = lambda: [(k, i, end) for k, piece in enumerate(network.pieces) for i, end in enumerate(piece.ends)]
    found = list(frame.Frames._marks(frames))
    named = {mark.name: (mark.kind, mark.weight) for mark in found if mark.name}
    assert named == {
        "C": ("clump", pytest.approx(900.0)),
        "D": ("float", pytest.approx(-90.0)),
        "E": ("joint", 0.0),
        "F": ("fixed", pytest.approx(100.0)),
        "H": ("fixed", 0.0),
    }
    assert [mark for mark in found if not mark.name] == [("", "fixed", 0.0, (low, 0)), ("", "fixed", 0.0, (high, 1))]


def test_forces_in_boxes():
    """On buoys wherever; on vessels inside the box, its faces too, or of a coarser panel outside the finer one."""

    def of(name, **more):
        return frame.Force("outside", name, lambda rows: np.array([[r, 2.0, 3.0] for r in rows]), **more)

    places = {"in": [0.0, 0.0, 0.0], "on": [1.0, 1.0, -1.0], "out": [1.1, 0.0, 0.0]}
    forces = [of("buoy", buoy=1, arm=np.array([0.0, 0.0, 2.0])), frame.Force("pulls", "rope", None)]
    forces += [of(name, path=lambda t, x=x: [x[0], x[1], x[2] + t - 4.0]) for name, x in places.items()]
    buoys = [None, Fake(place=lambda arm: arm + 50.0)]
    now = Fake(row=7, time=4.0, run=Fake(forces=forces), buoys=buoys)

    def names(*boxes):
        return [name for name, *_ in frame.Frame.arrows(now, "outside", *boxes)]

    assert names() == ["buoy", "in", "on", "out"]
    box = np.array([[-1.0] * 3, [1.0] * 3])
    assert names(box) == ["buoy", "in", "on"]
    assert names(2 * box, box) == ["out"]
    assert names(2 * box, box * [1, 1, 0.9]) == ["on", "out"]
    (_, place, vector), *_ = frame.Frame.arrows(now, "outside")
    assert (place.tolist(), vector.tolist()) == ([50.0, 50.0, 52.0], [7.0, 2.0, 3.0])


# -- sentences ---------------------------------------------------------------------------------------------------------


def test_anchors_that_move_are_told():
    """Above what they hold, not at it; of a run when, and of a sinker how far."""
    use = xr.Dataset(
        {
            "anchor_use": (("time", "anchor"), [[0.5, 1.0, 0.5], [1.25, 0.9, 3.0], [1.0, 0.5, 2.0]]),
            "anchor_moved": (("time", "anchor"), [[0.0, np.nan, np.nan], [0.5, np.nan, np.nan], [2.5, np.nan, np.nan]]),
        },
        {"time": [0.0, 1.5, 3.0], "anchor": ["S", "B", "A"]},
    )
    scene = Fake(network=Fake(bodies={"S": 1}))
    assert summary._moved_anchors(use, scene) == [
        "The sinker S did not hold: it is pulled with 1.25 times what it holds at t = 1.5 s; it lies 2.5 m from its "
        "place at the end.",
        "The anchor A would not hold: it is pulled with 3 times what it holds at t = 1.5 s; here it stays.",
    ]
    at_rest = use.isel(time=1, drop=True)
    said = "would not hold: it is pulled with {} times what it holds; here it stays."
    assert summary._moved_anchors(at_rest, scene) == [
        "The anchor S " + said.format(1.25), "The anchor A " + said.format(3),
    ]  # fmt: skip
    assert summary._moved_anchors(use.drop_vars("anchor_use"), scene) == []


def test_growth_is_told_where_it_grows():
    grown = {"growth_weight": ("cell", [1500.0, 900.0]), "growth_diameter": ("cell", [1.0, 1.0])}
    grown["growth_mass"] = "cell", [1.0, 1.0]
    assert summary._grown(xr.Dataset(grown)) == []
    assert summary._grown(xr.Dataset()) == []
    grown["growth_diameter"] = "cell", [1.0, 1.5]
    assert summary._grown(xr.Dataset(grown)) == [
        ("marine growth adds in water", "2.4", "kN"),
        ("its largest factors of diameter and mass", "1.5, 1", ""),
    ]


# -- offsets -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("smallest", "wet", "flags"),
    [
        (1e-4 * 500.0, True, (True, True)),  # a ten-thousandth of the typical force is slack
        (1.001e-4 * 500.0, True, (False, True)),
        (-3.0, False, (True, False)),
    ],
)
def test_states_of_offsets(monkeypatch, smallest, wet, flags):
    """Slack, and under water if there is any; what is told besides is not noted twice."""
    asked = []
    numbers = {"displaced_mass": np.array([7.0, 8.0]), "tension_top": np.array([1.0]), "offset": np.array([9.0])}

    def made(problem):
        asked.append("made")
        return Fake(problem=problem, labels=lambda: {"cable": "a"}, values=lambda ends: {"ends": ends} | numbers)

    monkeypatch.setattr(offset_record, "Observer", made)
    monkeypatch.setattr(offset_record, "attributes", lambda problem: {"title": "t"})
    monkeypatch.setattr(offset_record, "is_under", lambda mass, scene, buoy: (mass, buoy) == (8.0, "far"))
    scene = Fake(sea="sea" if wet else None, network=Fake(buoys={"a": "near", "b": "far"}))
    problem = Fake(scene=scene, typical_force=500.0, end_forces=lambda: "forces")
    problem.smallest_tension = lambda of_rods: asked.append(of_rods) or smallest
    rows = offset_record.Rows("force")
    for size in (1.0, 2.0):
        rows.add(Fake(problem=problem, direction=30.0, size=size))
    rows.add(Fake(problem=None, direction=30.0, size=3.0))
    assert asked == ["made", False, False]
    (direction, size, row), _, none = rows._rows
    assert (direction, size, len(rows), rows.attributes, rows.labels) == (30, 1, 3, {"title": "t"}, {"cable": "a"})
    assert (row["slack"], row["under"], row["found"], row["smallest_tension"]) == (*flags, True, smallest)
    assert (row["ends"], "offset" in row, "tension_top" in row) == ("forces", False, True)
    assert none == (30.0, 3.0, {"found": False, "slack": False, "under": False})


def test_a_table_of_offsets():
    """Over directions and sizes in the order in which they came; along the load, and nan without an equilibrium."""
    rows = offset_record.Rows("force")
    rows.attributes, rows.labels = {"title": "t"}, {"buoy": np.array(["b"]), "cable": np.array(["a"])}
    places = {(0, 10): (4.0, 2.0), (0, 20): (6.0, 2.0), (90, 10): (1.0, 5.0), (90, 20): None}
    for (direction, size), place in places.items():
        row = {"found": place is not None, "slack": False, "under": size == 20}
        if place is not None:
            row |= {"buoy_position": np.array([[*place, -1.0]]), "tension_top": np.array([size * 7.0])}
        rows._rows.append((float(direction), float(size), row))
    made = rows.dataset(np.array([1.0, 2.0, -1.0]))
    assert made.buoy_position.dims == ("direction", "force", "buoy", "xyz")
    assert (made.direction.values.tolist(), made.force.values.tolist()) == ([0, 90], [10, 20])
    assert (made.direction.attrs["units"], made.force.attrs["units"], made.attrs["title"]) == ("degree", "N", "t")
    np.testing.assert_allclose(made.offset[..., 0], [[3, 5], [3, np.nan]])
    np.testing.assert_allclose(made.offset_along[..., 0], [[3, 5], [3, np.nan]])
    np.testing.assert_allclose(made.tension_top[..., 0], [[70, 140], [70, np.nan]])
    assert made.under.values.tolist() == [[False, True]] * 2
    assert made.found.values.tolist() == [[True, True], [True, False]]
    np.testing.assert_allclose(made.watch_radius[..., 0], [np.hypot(3, 3) / 2, np.nan])
    np.testing.assert_allclose(made.watch_centre[..., 0, :], [[2.5, 3.5], [np.nan, np.nan]])
    assert made.watch_centre.dims == ("force", "buoy", "xy")
    assert "offset" not in rows.dataset(None)
    assert offset_record.sentences(made) == [
        "Towards 0 degrees, at 20 N: the buoy is drawn under the water.",
        "Towards 90 degrees, at 20 N: the buoy is drawn under the water.",
        "Towards 90 degrees, at 20 N: no equilibrium was found.",
    ]
    current = made.rename(force="current")
    assert offset_record.sentences(current)[0] == "Towards 0 degrees, at 20 m/s: the buoy is drawn under the water."


# -- folders -----------------------------------------------------------------------------------------------------------


def test_a_refusal_is_raised_on_all_ranks():
    """Where rank 0 refuses; no other rank is asked, and other errors pass."""
    for rank in (0, 1):
        comm = Fake(rank=rank, size=2, bcast=lambda error, root=0: error or InputError("refused by rank 0"))
        asked = []

        def refused(comm=comm, asked=asked):
            with folder._agreed(comm) as root:
                asked.append(root)
                if root:
                    raise InputError("refused by rank 0")

        with pytest.raises(InputError, match="refused by rank 0"):
            refused()
        assert asked == [rank == 0]
    with folder._agreed(MPI.COMM_SELF) as root:
        assert root is True
    with pytest.raises(ZeroDivisionError), folder._agreed(MPI.COMM_SELF):
        raise ZeroDivisionError


def test_which_files_may_be_replaced(tmp_path):
    """Those that are listed, links too, and no folder; a scene only as it was written."""
    scene = load_scene("short")
    scene.save(tmp_path / "scene.toml")
    entry = {"files": ["results.nc", "scene.toml", "figures"], "scene": folder.digest(scene)}
    for name in ("results.nc", "scene.toml"):
        folder._check_own(tmp_path, name, entry)  # not there, or as it was written
    (tmp_path / "results.nc").symlink_to("nowhere")
    folder._check_own(tmp_path, "results.nc", entry)
    (tmp_path / "figures").mkdir()
    (tmp_path / "other.nc").touch()
    (tmp_path / "scene.toml").write_text((tmp_path / "scene.toml").read_text() + "# mine\n")
    for name in ("figures", "other.nc", "scene.toml"):
        with pytest.raises(InputError, match=f"{name} would be replaced, and dolfbuoy did not write it as it is"):
            folder._check_own(tmp_path, name, entry)
    with pytest.raises(InputError, match="would be replaced"):
        folder._check_own(tmp_path, "results.nc", {})


def test_a_result_begins_without_the_one_before(tmp_path):
    """What was listed goes, folders of pictures if nothing else is in them; nothing behind a link to another folder."""
    for name in ("figures", "elsewhere"):
        (tmp_path / name).mkdir()
    (tmp_path / "paraview").symlink_to("elsewhere")
    files = ["results.nc", "figures/a.png", "paraview/b.vtu", "gone.csv"]
    for name in (*files[:3], "mine.txt"):
        (tmp_path / name).touch()
    other = {"scene": "x", "finished": True, "files": ["static.nc"]}
    (tmp_path / folder.MANIFEST).write_text(json.dumps({"run": {"files": files}, "static": other}))
    scene = load_scene("short")
    folder.begin(tmp_path, "run", scene)
    left = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
    assert left == {folder.MANIFEST, "scene.toml", "mine.txt", "elsewhere", "elsewhere/b.vtu", "paraview"}
    manifest = json.loads((tmp_path / folder.MANIFEST).read_text())
    assert manifest["static"] == other
    entry = manifest["run"]
    assert (entry["scene"], entry["finished"], entry["files"]) == (folder.digest(scene), False, [*folder.FILES["run"]])
    assert load_scene(tmp_path / "scene.toml") == scene
    folder.finish(tmp_path, "run")
    assert json.loads((tmp_path / folder.MANIFEST).read_text())["run"] == entry | {"finished": True}
    folder.finish(tmp_path, "run", load_scene("driven"))
    folder.remark(tmp_path, "run", session=True)
    more = {"finished": True, "requested": folder.digest(load_scene("driven")), "session": True}
    assert folder.remarks(tmp_path, "run") == entry | more
    assert folder.remarks(tmp_path, "modes") == {}


def test_a_folder_may_be_a_link(tmp_path):
    """That the user made: what was written through it goes."""
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "real" / "results.nc").touch()
    (tmp_path / "real" / folder.MANIFEST).write_text(json.dumps({"run": {"files": ["results.nc"]}}))
    folder.begin(tmp_path / "link", "run", load_scene("short"))
    assert sorted(path.name for path in (tmp_path / "real").iterdir()) == [folder.MANIFEST, "scene.toml"]


def test_a_lock_is_given_back(tmp_path):
    """And no link is followed; the folder is made with those above it."""
    before = len(os.listdir("/proc/self/fd"))
    with folder.claimed(tmp_path / "a" / "b"):
        assert len(os.listdir("/proc/self/fd")) == before + 1
        with (
            pytest.raises(InputError, match="is in use by another run: wait for its end"),
            folder.claimed(tmp_path / "a/b"),
        ):
            pass
        with pytest.raises(InputError, match="is in use"), folder.claimed(tmp_path / "a/b", shared=True):
            pass
        assert len(os.listdir("/proc/self/fd")) == before + 1
    with folder.claimed(tmp_path / "a/b", shared=True), folder.claimed(tmp_path / "a/b", shared=True):
        pass
    assert len(os.listdir("/proc/self/fd")) == before
    lock = tmp_path / "a" / "b" / folder.LOCK
    assert stat.S_IMODE(lock.stat().st_mode) & 0o600 == 0o600
    lock.unlink()
    lock.symlink_to(tmp_path / "far")
    with pytest.raises(InputError, match="cannot hold results: Too many levels of symbolic links; take another"):
        folder.claimed(tmp_path / "a/b").__enter__()
    assert not (tmp_path / "far").exists()
