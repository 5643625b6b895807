"""Record and recorder, each alone on a few numbers: reserved space, rows, clocks, limits.

Source: bytes, rows and seconds counted by hand; file contents read with netCDF4.
"""

import io
import json
import zlib
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
import xarray as xr
from chains import CHAIN

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import checkpoint, record, recorder
from dolfbuoy.results.recorder import Recorder

SCENE = load_scene(CHAIN)
STEP = SCENE.time.step


def clock(*ticks):
    """A clock that shows these instants one after the other."""
    return SimpleNamespace(monotonic=iter(ticks).__next__)


# -- the file ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def written(tmp_path, monkeypatch):
    """(a record of two instants and a frame on the disk, what was claimed for it)."""
    claimed, reserve = [], record.reserve
    monkeypatch.setattr(record, "reserve", lambda part, size: claimed.append(size) or reserve(part, size))
    monkeypatch.setattr(record, "clock", clock(10.0, 13.5, 20.25))
    made = record.Record(
        tmp_path / "results.nc",
        {"scene": "\u00fc", "n": 12, "created": "then"},
        {"s": np.arange(3.0), "s_cell": np.array([0.5, 1.5]), "parted_at": np.full(2, np.nan)},
        {"cable": np.array(["line"])},
    )
    made.extremes = {"cable_tension_maximum": np.array([5.0, 6.0])}
    made.add({"time": [0.0, 0.1], "tension_top": [[1.0], [2.0]], "newton_iterations": [0, 3]})
    made.add({"frame": [0.0], "cable_position": np.zeros((1, 3, 3))})
    made.flush()
    return made, claimed


def test_room_is_claimed_for_all_that_is_written(written, tmp_path):
    """128 KiB, rows and the 512 of a chunk, 128 bytes of each row of a frame, attributes, extremes; once what is
    fixed."""
    made, claimed = written
    series = 3 * (2 * 8 + 512 * 8)
    frames = (8 + 128) + (9 * 8 + 128)
    words = len("\u00fc".encode()) + len("12") + len("then")
    assert claimed == [2**17 + series + frames + words + 2 * 8 + (3 + 2 + 2) * 8]
    made.add({"time": [0.2], "tension_top": [[3.0]], "newton_iterations": [2]})
    made.flush()
    assert claimed[1:] == [2**17 + 3 * (8 + 512 * 8) + words + len("3.5") + 2 * 8]
    size = made.path.stat().st_size
    assert made.cut({"time": 1, "frame": 0})
    assert claimed[2:] == [size]
    more = xr.Dataset({"bar": ("output", [1.0, 2.0])}, attrs={"bar_says": "\u00fcber"})
    record.put(made.path, more)
    record.save(more, tmp_path / "other.nc")
    assert claimed[3:] == [2**17 + 16 + 5] * 2
    part = tmp_path / "part"
    part.write_bytes(b"12345")
    record.reserve(part, 1000)
    assert part.stat().st_size == 1005


def test_what_stands_in_the_file(written):
    """Kinds, chunks, names, and where nodes and elements are; the time that it took."""
    with netCDF4.Dataset(written[0].path) as file:
        kinds = {name: str(one.dtype) for name, one in file.variables.items() if name not in ("xyz", "quaternion")}
        chunks = {name: file[name].chunking() for name in ("time", "tension_top", "frame", "cable_position", "s")}
        along = {name: getattr(one, "coordinates", "") for name, one in file.variables.items()}
        named = {name: file[name].long_name for name in ("cable", "xyz", "quaternion")}
        assert (file.dimensions["time"].isunlimited(), file.dimensions["frame"].isunlimited()) == (True, True)
        assert {name: file.getncattr(name) for name in file.ncattrs()} == {
            "scene": "\u00fc", "n": 12, "created": "then", "wall_time_s": 3.5,
        }  # fmt: skip
    assert kinds.pop("cable") == "<class 'str'>"
    assert kinds.pop("newton_iterations") == "int32"
    assert set(kinds.values()) == {"float64"}
    assert chunks == {
        "time": [512], "tension_top": [512, 1], "frame": [1], "cable_position": [1, 3, 3], "s": [3],
    }  # fmt: skip
    assert {name: text for name, text in along.items() if text} == {
        "cable_position": "s cable_of_node",
        "cable_tension_maximum": "s_cell cable_of_cell segment_of_cell",
    }
    assert named == {
        "cable": "names of the cables",
        "xyz": "axes of the world, z up",
        "quaternion": "q0, and q = (q1, q2, q3)",
    }


def test_what_changes_is_written_again(written):
    """When elements part, extremes, and attributes that have become others."""
    made, _ = written
    made.fixed["parted_at"] = np.array([np.nan, 0.15])
    made.extremes["cable_tension_maximum"] = np.array([7.0, 6.0])
    made.attributes["n"] = 13
    made.add({"time": [0.2], "tension_top": [[3.0]], "newton_iterations": [2]})
    assert (made.pending, made.lengths()) == (True, {"time": 3, "frame": 1})
    made.flush()
    assert (made.pending, made.counts) == (False, {"time": 3, "frame": 1})
    found = record.read(made.path)
    assert found.parted_at.values.tolist() == [pytest.approx(np.nan, nan_ok=True), 0.15]
    assert found.cable_tension_maximum.values.tolist() == [7.0, 6.0]
    assert (found.attrs["n"], found.attrs["wall_time_s"]) == (13, 10.25)
    assert (found.time.values.tolist(), found.tension_top.values[:, 0].tolist()) == ([0.0, 0.1, 0.2], [1.0, 2.0, 3.0])


def test_rows_are_cut_where_they_are(written):
    """Those that are not on the disk first; error bars, which are of a whole run, go with rows of the disk."""
    made, _ = written
    made.add({"time": [0.2, 0.3], "tension_top": [[3.0], [4.0]]})
    made.add({"frame": [0.2], "cable_position": np.ones((1, 3, 3))})
    made.add({"time": [0.4], "tension_top": [[5.0]]})
    assert not made.cut({"time": 3, "frame": 2})
    assert made.lengths() == {"time": 3, "frame": 2}
    assert not made.cut({"time": 2, "frame": 1})
    assert not made.pending
    record.put(made.path, xr.Dataset({"bar": ("output", [1.0])}, attrs={"bar_says": "so", "n": 14}))
    made.add({"time": [0.2], "tension_top": [[3.0]]})
    assert made.cut({"time": 1, "frame": 1})
    assert (made.lengths(), made.counts) == ({"time": 1, "frame": 1}, {"time": 1, "frame": 1})
    found = record.read(made.path)
    assert (found.sizes["time"], found.sizes["frame"], found.tension_top.values.tolist()) == (1, 1, [[1.0]])
    assert "output" not in found.dims
    assert found.attrs == {"scene": "\u00fc", "n": 14, "created": "then", "wall_time_s": 3.5}
    assert found.cable_tension_maximum.values.tolist() == [5.0, 6.0]
    assert found.newton_iterations.values.tolist() == [0]


@pytest.mark.parametrize(("rows", "copied"), [({"time": 2, "frame": 1}, 0), ({"time": 1, "frame": 1}, 1)])
def test_a_record_is_taken_up_as_long_as_it_was(written, monkeypatch, rows, copied):
    """When it was begun, and how long it has taken, go on; what is there already is not written again."""
    made, claimed = written
    monkeypatch.setattr(record, "clock", clock(100.0, 101.0))
    again = record.Record(made.path, {"created": "now", "scene": "\u00fc"}, dict(made.fixed), {"cable": ["line"]})
    again.labels = made.labels
    again.take_up(rows)
    assert (again.counts, again.attributes["created"], len(claimed)) == (rows, "then", 1 + copied)
    again.add({"time": [0.2], "tension_top": [[3.0]]})
    again.flush()
    found = record.read(made.path)
    assert found.attrs["wall_time_s"] == 101.0 - 100.0 + 3.5
    assert found.time.values.tolist() == [*[0.0, 0.1][: rows["time"]], 0.2]


def test_a_record_that_cannot_be_taken_up(written):
    made, _ = written
    for rows in ({"time": 3, "frame": 1}, {"time": 2, "frame": 2}):
        with pytest.raises(InputError, match=r"is shorter than at its checkpoint \(2 rows\)\.$"):
            made.take_up(rows)
    made.fixed["growth_mass"] = np.ones(2)
    with pytest.raises(InputError, match=r"results\.nc does not hold what its scene must have"):
        made.take_up({"time": 2, "frame": 1})


def test_bars_of_a_run_that_goes_on_are_dropped(written):
    """However long it is."""
    made, claimed = written
    record.put(made.path, xr.Dataset({"bar": ("output", [1.0])}))
    made.take_up({"time": 2, "frame": 1})
    assert len(claimed) == 3
    assert "output" not in record.read(made.path).dims


def test_a_record_without_lines_has_no_frames(tmp_path):
    made = record.Record(tmp_path / "r.nc", {"created": "then"}, {}, {"buoy": np.array(["b"])})
    made.add({"time": [0.0, 0.1]})
    made.flush()
    before = made.path.stat().st_mtime_ns
    made.take_up({"time": 2, "frame": 0})
    assert (made.counts, made.path.stat().st_mtime_ns) == ({"time": 2, "frame": 0}, before)
    assert "frame" not in record.read(made.path).dims


def test_checksums_are_of_files_of_any_size():
    content = np.random.default_rng(1).bytes(2**21 + 5)
    for size in (0, 1, 2**20, 2**20 + 1, len(content)):
        file = io.BytesIO(content)
        assert (record._checksum(file, size), file.tell()) == (zlib.crc32(content[:size]), size)


@pytest.mark.parametrize(
    ("raised", "passes"),
    [
        (KeyError("own"), True),
        (AttributeError("own"), True),
        (IndexError("own"), False),
        (ValueError("own"), False),
        (ZeroDivisionError("own"), True),
        (InputError("own"), True),
    ],
)
def test_faults_of_the_program_are_not_called_damage(raised, passes):
    error, said = (type(raised), "own") if passes else (InputError, "here does not hold")
    with pytest.raises(error, match=said), record.fitting("here"):
        raise raised
    with pytest.raises(InputError, match="here does not hold"), record.fitting("here"):
        xr.Dataset()["nothing"]


@pytest.mark.parametrize("error", [FileNotFoundError, PermissionError, InputError])
def test_what_is_said_already_is_not_called_damage(error):
    with pytest.raises(error, match="so"), record.undamaged("here", "is broken"):
        raise error("so")
    with pytest.raises(InputError, match="here is broken"), record.undamaged("here", "is broken"):
        raise OSError("so")


# -- the recorder ------------------------------------------------------------------------------------------------------


def states_of(size=1):
    """A communicator, and what a recorder needs of a simulation."""
    comm = SimpleNamespace(size=size, rank=0, gather=lambda state: [state] * size, allreduce=lambda x, op: x)
    comm.bcast = lambda x, root=0: x
    control = SimpleNamespace(failed=1, rejected=2, restarts=3)
    return SimpleNamespace(
        comm=comm, state=lambda: {"t": 0.5}, quaternion_drift=1e-9, scene=SCENE, control=control,
        newton=SimpleNamespace(fallbacks=4),
    )  # fmt: skip


@pytest.mark.parametrize(("took", "pause"), [(0.5, 25.0), (0.001, 1.0)])
@pytest.mark.parametrize("corrected", [None, SimpleNamespace(state=lambda: {"v": 2})])
def test_records_are_saved_every_second_or_for_a_fiftieth_of_the_time(monkeypatch, tmp_path, took, pause, corrected):
    """The state is that of the simulation, of the caller and of what is recorded; rows are those on the disk."""
    kept, done = [], []
    monkeypatch.setattr(recorder, "clock", clock(100.0, 100.0 + took))
    monkeypatch.setattr(checkpoint, "write", kept.append)
    observer = SimpleNamespace(places=[("a at b", 1, 2.5)], parted=lambda fixed: "gone")
    own = SimpleNamespace(simulation=states_of(), observer=observer, _more=lambda: {"more": 7}, _fixed={}, root=True)
    own._extremes = SimpleNamespace(kept=np.ones(2), values=lambda observer: {"x": 1})
    own.record, own._flush = SimpleNamespace(counts={"time": 3, "frame": 1}), lambda: done.append("flushed")
    own.folder, own._next_frame, own._corrected = tmp_path, 0.7, corrected
    own.pause, own.share = Recorder.pause, Recorder.share
    Recorder.save(own)
    (point,) = kept
    assert own._next_save == pytest.approx(100.0 + took + pause)
    (state,) = point.states
    assert (state["t"], state["more"], json.loads(state["fatigue_places"])) == (0.5, 7, [["a at b", 1, 2.5]])
    assert state.get("corrected") == ({"v": 2} if corrected else None)
    assert (point.folder, point.rows, point.next_frame) == (tmp_path, {"time": 3, "frame": 1}, 0.7)
    assert (own._parted, own._drift, own.record.extremes, done) == ("gone", 1e-9, {"x": 1}, ["flushed"])
    own.record.attributes = {}
    Recorder._put_attributes(own)
    assert own.record.attributes == {
        "failed_steps": 1, "rejected_steps": 2, "restarts": 3, "quaternion_drift": 1e-9,
        "linear_solver_fallbacks": 4, "parted": "gone",
    }  # fmt: skip


def adding(times, interval=0.1, end=0.25, tolerance=1e-8, rows=100, lines=True):
    """Frames, blocks of rows and instants of saving of a recorder to which these instants are added."""
    blocks, saved, seen = [], [], []
    sim = states_of()
    sim.problem, sim.line_velocity = SimpleNamespace(lines=lines), 1.0
    own = SimpleNamespace(simulation=sim, root=True, _rows=np.zeros((rows, 5)), _count=0, _corrected=None)
    own._extremes, own._next_frame, own.interval = SimpleNamespace(note=seen.append), 0.0, interval
    own._end, own._tolerance, own._next_save = end, tolerance, 4.5
    own.observer = SimpleNamespace(note=lambda: np.array([7.0, 8.0]), frame=lambda velocity: {"v": velocity})
    own.observer.values_of = lambda noted: {"noted": noted.copy()}
    own.record = SimpleNamespace(add=lambda block: blocks.append({k: np.array(x) for k, x in block.items()}))
    own._make_values = lambda: Recorder._make_values(own)
    own.save = lambda: saved.append(sim.t)
    for sim.t in times:
        Recorder.add(own, 0.05, 2)
    assert seen == list(times)
    return own, [block["frame"][0] for block in blocks if "frame" in block], blocks, saved


def test_frames_are_those_of_their_interval(monkeypatch):
    """And the last instant; a hair before counts, more does not."""
    monkeypatch.setattr(recorder, "clock", SimpleNamespace(monotonic=lambda: 0.0))
    assert adding([0.0, 0.05, 0.1 - 0.9e-8, 0.15, 0.2 - 1.1e-8, 0.22, 0.25 - 0.9e-8])[1] == [
        0.0, 0.1 - 0.9e-8, 0.22, 0.25 - 0.9e-8,
    ]  # fmt: skip
    assert adding([0.0, 0.31, 0.35, 0.4], end=9.0)[1] == [0.0, 0.31, 0.4]


def test_rows_become_quantities_when_there_is_no_more_room(monkeypatch):
    """Of two rows; steps, iterations and notes are in their columns, and time is saved after its pause."""
    ticks = iter([4.4, 4.5, 4.6])
    monkeypatch.setattr(recorder, "clock", SimpleNamespace(monotonic=lambda: next(ticks)))
    own, _, blocks, saved = adding([0.0, 0.05, 0.12], rows=2)
    (made,) = (block for block in blocks if "time" in block)
    assert {name: np.ravel(values).tolist() for name, values in made.items()} == {
        "time": [0.0, 0.05], "time_step": [0.05, 0.05], "newton_iterations": [2, 2], "noted": [7, 8, 7, 8],
    }  # fmt: skip
    assert (own._count, saved) == (1, [0.12])
    blocks.clear()
    own._make_values()
    own._make_values()
    assert [block["time"].tolist() for block in blocks] == [[0.12]]


def test_errors_are_what_is_recorded_less_what_is_corrected(monkeypatch):
    """Of all rows that were noted; without lines there are no frames."""
    blocks = []
    own = SimpleNamespace(_rows=np.array([[0.0, 0.1, 2, 5.0], [0.1, 0.1, 3, 7.0], [9.0, 9.0, 9, 9.0]]), _count=2)
    own._corrected, own._corrected_rows = True, np.array([[4.0], [9.0], [1.0]])
    own.observer = SimpleNamespace(values_of=lambda rows: {"tension_top": rows.copy()})
    own.record = SimpleNamespace(add=blocks.append)
    Recorder._make_values(own)
    (made,) = blocks
    assert {name: np.ravel(values).tolist() for name, values in made.items()} == {
        "time": [0.0, 0.1], "time_step": [0.1, 0.1], "newton_iterations": [2, 3],
        "tension_top": [5.0, 7.0], "tension_top_error": [1.0, -2.0],
    }  # fmt: skip
    monkeypatch.setattr(recorder, "clock", SimpleNamespace(monotonic=lambda: 0.0))
    assert adding([0.0, 0.1], lines=None)[1] == []


@pytest.mark.parametrize(("step", "follows", "noted"), [(0.0, True, 5.0), (0.1, True, 9.0), (0.1, False, np.nan)])
def test_notes_of_the_corrected_trajectory(step, follows, noted):
    """At the start those of the run, later its own; nan where there is none."""
    left = []
    own = SimpleNamespace(_corrected_rows=np.zeros((2, 1)), _count=1, root=True)
    own._corrected = SimpleNamespace(follow=lambda step: follows, leave=lambda: left.append(step))
    own._corrected_observer = SimpleNamespace(note=lambda: 9.0)
    Recorder._note_corrected(own, step, 5.0)
    np.testing.assert_array_equal(own._corrected_rows, [[0.0], [noted]])
    assert left == [0.1] * (step > 0 and follows)


@pytest.mark.parametrize(
    ("root", "count", "pending", "size", "flushed", "extremes"),
    [
        (True, 1, False, 1, 1, "new"),
        (True, 0, True, 2, 1, "old"),
        (True, 0, False, 1, 0, "old"),
        (False, 1, True, 1, 0, "old"),
    ],
)
def test_what_is_left_at_the_end_goes_to_the_disk(root, count, pending, size, flushed, extremes):
    """Extremes of one rank with it; of several they are not gathered any more."""
    done = []
    own = SimpleNamespace(root=root, _count=count, simulation=states_of(size), observer=None)
    own.record = SimpleNamespace(pending=pending, extremes="old")
    own._extremes, own._flush = SimpleNamespace(values=lambda observer: "new"), lambda: done.append(1)
    Recorder.close(own)
    assert (len(done), own.record.extremes) == (flushed, extremes)
