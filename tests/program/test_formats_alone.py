"""MoorDyn files, each part alone: types of body, wave tables around a buoy, a run, and file sizes.

Source: MoorDyn's manual, "Input Files", for the meaning of values; sums, levers and grids by hand; a stand-in MoorDyn.
"""

import math
import os
from types import SimpleNamespace as Fake

import numpy as np
import pytest

from dolfbuoy import InputError, load_scene
from dolfbuoy.formats import files, from_yaml, moordyn_body, moordyn_events, moordyn_files, moordyn_run, moordyn_water
from dolfbuoy.formats.moordyn_text import Row, Tables, is_nothing
from dolfbuoy.formats.names import Note
from dolfbuoy.formats.to_moordyn import Export, start_of


def row(**values):
    """A row of a table, as text."""
    return Row(7, {name: str(value) for name, value in values.items()})


# -- bodies and loads --------------------------------------------------------------------------------------------------


def test_centre_and_moments_by_axes_or_in_one_column():
    """A column of an axis that is not there is 0; one number is a height, or all three moments."""
    for given, center in (({"xcg": 0.5}, [0.5, 0, 0]), ({"CG": "0.3"}, [0, 0, 0.3]), ({"CG": "1|2|3"}, [1, 2, 3])):
        assert moordyn_body._center(row(**given)).tolist() == center
    assert moordyn_body._center(row(xcg=0.5, ycg=0.25, zcg=-1)).tolist() == [0.5, 0.25, -1.0]
    assert moordyn_body._center(None).tolist() == [0.0, 0.0, 0.0]
    for given, moments in (({"Ix": 3}, [3, 0, 0]), ({"I": "2"}, [2, 2, 2]), ({"I": "1|2|3"}, [1, 2, 3])):
        assert moordyn_body._moments(row(**given)).tolist() == moments
    assert moordyn_body._moments(row(Ix=3, Iy=4, Iz=5)).tolist() == [3.0, 4.0, 5.0]


def test_values_of_axes_and_what_is_of_turning():
    said = []
    for text, values, notes in (
        ("2", [2, 2, 2], 0),
        ("2|0", [2, 2, 2], 0),
        ("2|1", [2, 2, 2], 1),
        ("1|2|3", [1, 2, 3], 0),
        ("1|2|3|0|0|0", [1, 2, 3], 0),
        ("1|2|3|0|4|0", [1, 2, 3], 1),
    ):
        said.clear()
        assert moordyn_body._of_axes(row(CdA=text), "CdA", lambda *note: said.append(note)).tolist() == values
        assert said == [(7, f"of CdA = {text} what is of turning is not carried over")] * notes
    for text in ("1|2|3|4", "1|x", "", "1|2|3|4|5"):
        with pytest.raises(InputError, match=r"line 7: CdA is .* must be 1 or 2 or 3 or 6 numbers, with \| between"):
            moordyn_body.numbers(row(CdA=text), "CdA")


def test_inertia_of_parts_about_a_point():
    """Steiner's, of a quarter of a mass of 8 kg one metre aside; a rod's beyond that of a thin one."""
    found = moordyn_body._about_point(
        (8.0, np.array([1.0, 0, 2.0]), np.diag([4.0, 8.0, 12.0])), 0.25, np.array([0, 0, 2])
    )
    np.testing.assert_allclose(found, np.diag([1.0, 4.0, 5.0]), atol=1e-15)
    rod, kind = row(xa=1, ya=2, za=3, xb=1, yb=2, zb=7), row(diameter=2, mass_density=10)
    # m d^2/16 across and m d^2/8 along
    np.testing.assert_allclose(moordyn_body._spin(rod, kind), np.diag([10.0, 10.0, 20.0]), atol=1e-14)
    (mass, center, inertia), *_ = moordyn_body._parts(None, np.zeros(3), [rod], [kind])
    assert (mass, center.tolist()) == (40.0, [1.0, 2.0, 5.0])
    across = 40 * (16 / 12 + 4 / 16)
    np.testing.assert_allclose(inertia, np.diag([across, across, 40 * 4 / 8]), rtol=1e-14, atol=1e-14)


def test_all_loads_are_looked_at():
    """One without a force hides none that follow; a rod's acts at its end A."""
    said, buoy = [], moordyn_body.BodyOf({"name": "body1"}, np.array([0.0, 0.0, -2.0]), np.eye(3))
    rods = [row(id=4, xa=0, ya=0, za=1.5, xb=0, yb=0, zb=3), row(id=5, xa=1, ya=0, za=0, xb=1, yb=0, zb=1)]
    loads = [row(object="Body1", force="0|0|0"), row(object="Body1", force="1|2|3", linear="0|0", quadratic="0|1|0")]
    tables, places = (
        Tables({"external loads": loads, "rods": rods}),
        Fake(buoys={"1": buoy, "rod4": buoy, "rod5": buoy}),
    )
    moordyn_events.external_loads(tables, places, lambda *note: said.append(note))
    assert buoy.section.pop("external_force") == {"force": [1.0, 2.0, 3.0], "height": 2.0}
    assert said == [(7, "the damping of Body1 is not carried over")]
    loads[:] = [
        row(object="Rod5", force="1|0|0"),
        row(object="Rod4", force="0|0|9"),
        row(object="Body2", force="1|0|0"),
    ]
    said.clear()
    moordyn_events.external_loads(tables, places, lambda *note: said.append(note))
    assert buoy.section["external_force"] == {"force": [0.0, 0.0, 9.0], "height": 3.5}
    where = "is not carried over: here buoys have one, on their axis"
    assert said == [(7, f"the force on {name} {where}") for name in ("Rod5", "Body2")]


@pytest.mark.parametrize(
    ("text", "nothing"), [("-", True), ("#", True), ("0", True), ("0.0e3", True), ("1e-300", False), ("x", False)]
)
def test_what_stands_where_there_is_no_value(text, nothing):
    assert is_nothing(text) == nothing


def test_a_note_begins_with_its_line():
    assert [str(Note("a\nb", line)) for line in (3, None)] == [r"line 3: a\nb", r"a\nb"]


# -- water -------------------------------------------------------------------------------------------------------------


def test_the_table_of_a_wave_reaches_along_lines_to_a_buoy():
    """Half a wave beyond the buoy and the part of its line that is not half a wave down."""
    length, depth = 20.0, 40.0
    scene = load_scene(
        {
            "sea": {"depth": depth},
            "cable": {"length": 60.0, "line_density": 1.0, "diameter": 0.1, "anchor": [30.0, 0.0, -40.0]},
            "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0, "initial": {"buoy_position": [-6.0, 1.0, 0.0]}},
            "waves": {"amplitude": 0.1, "wavelength": length, "period": 3.6},
        }
    )
    text = moordyn_water._grid(scene, scene.network, scene.waves, depth)
    x, y, z = (np.array(line.split(), float) for line in text.splitlines()[4::2])
    # a quarter of the way to the anchor, which is 4 halves of a wave down
    low, high = -6.0 - length / 2, -6.0 + 0.25 * 36.0 + length / 2
    assert (x[0], x[-1]) == (low, high)
    assert len(x) == math.ceil((high - low) * moordyn_water.PER_WAVE / length) + 1
    assert y.tolist() == [-1e4, 1e4]
    near = z[z > -length / 2 + 1e-6]
    np.testing.assert_allclose(near[::-1], -np.arange(len(near)) * length / 64, atol=1e-6)
    assert (len(near), z[0], len(z)) == (32, -depth, 43)


def test_records_between_their_rows():
    """As they are if their steps are equal, within rounding; else at the step that is wanted."""
    said = []
    at = 7, lambda *note: said.append(note)
    even = [[1.0, 0.1], [1.5, 0.3], [2.0 + 4e-7, 0.2]]
    assert moordyn_files._record(even, 0.2, at) == [[1.0, 0.1], [1.5 + 2e-7, 0.3], [2.0 + 4e-7, 0.2]]
    assert said == []
    odd = moordyn_files._record([[1.0, 0.0], [1.5, 1.0], [2.0 + 1e-5, 2.0], [2.4, 0.0]], 0.25, at)
    np.testing.assert_allclose(np.array(odd)[:, 0], [1.0, 1.25, 1.5, 1.75, 2.0, 2.25])
    np.testing.assert_allclose(np.array(odd)[:3, 1], [0.0, 0.5, 1.0])
    assert said == [(7, "wave_elevation.txt: its steps are not equal; it is brought to 0.25 s between its rows")]
    for rows in ([[1.0, 0.1]], [[1.0, 0.1], [1.0, 0.2]]):
        with pytest.raises(InputError, match="must hold times that grow"):
            moordyn_files._record(rows, 0.2, at)


@pytest.mark.parametrize(("extra", "there"), [(0, True), (1, False)])
def test_files_beside_the_input_have_a_size(tmp_path, monkeypatch, extra, there):
    """They lie in its folder, or by a longer name anyway."""
    monkeypatch.setattr(moordyn_files, "MOST_BYTES", 4)
    (tmp_path / "a.txt").write_bytes(b"x" * (4 + extra))
    for name in ("a.txt", "/elsewhere/a.txt"):
        if there:
            assert moordyn_files.found_beside(tmp_path, name) == tmp_path / "a.txt"
        else:
            with pytest.raises(InputError, match=f"{name}: must have 4 bytes at most"):
                moordyn_files.found_beside(tmp_path, name)
    assert moordyn_files.found_beside(tmp_path, "b.txt") is None
    assert moordyn_files.found_beside(None, "a.txt") is None


# -- files -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("extra", "said"), [(0, "no input file of MoorDyn"), (1, "must hold at most 0 MB")])
def test_a_file_has_a_size(tmp_path, monkeypatch, extra, said):
    monkeypatch.setattr(files, "MOST_BYTES", 9)
    (tmp_path / "a.dat").write_bytes(b"x" * (9 + extra))
    with pytest.raises(InputError, match=said):
        files.read("moordyn", tmp_path / "a.dat")


def test_what_is_read_is_the_text_its_name_and_its_folder(tmp_path, monkeypatch):
    """Of MoorDyn's files also how columns are meant; bytes that are no text do no harm."""
    seen = []

    def reader(text, title, **options):
        seen.append((text, title, options))
        return {"buoy": {"mass": 1.0, "center_of_mass": 0.0, "inertia": [1.0, 1.0]}}, [Note("a")]

    monkeypatch.setattr(files, "READERS", {"moordyn": reader, "raft": reader})
    path = tmp_path / ("n" * 210 + ".dat")
    path.write_bytes(b"a\xff")
    for kind, columns in (("moordyn", "name"), ("moordyn", "place"), ("raft", "name")):
        assert files.read(kind, path, columns, 3.0)[1] == [Note("a")]
    own = [{"by_place": by_place, "folder": tmp_path} for by_place in (False, True)]
    assert seen == [("a�", "n" * 200, {"depth": 3.0} | more) for more in (*own, {})]
    os.mkfifo(tmp_path / "pipe")
    for kind, name, columns, said in (
        ("map", "a.dat", "name", r"FORMAT = 'map': must be moordyn or raft"),
        ("raft", "a.dat", "place", r"--columns = 'place': must be name, or place with moordyn"),
        ("moordyn", "a.dat", "both", r"--columns = 'both': must be name"),
        ("moordyn", "pipe", "name", r"pipe: must be a file, and is a pipe"),
        ("moordyn", "none.dat", "name", r"none.dat: cannot be read \(No such file or directory\)"),
    ):
        with pytest.raises(InputError, match=said):
            files.read(kind, tmp_path / name, columns)


@pytest.mark.parametrize(
    ("value", "found"),
    [(3, 3.0), ("1e2", 100.0), (True, None), ("x", None), (math.inf, None), (None, None), ([1], None)],
)
def test_numbers_of_yaml(value, found):
    if found is not None:
        assert from_yaml.number(value, "here") == found
        return
    with pytest.raises(InputError) as error:
        from_yaml.number(value, "here")
    assert str(error.value) == f"here is {value!r}, which is no number."


def test_a_start_is_what_the_record_has():
    import xarray as xr

    places = np.arange(6.0).reshape(2, 3)
    record = xr.Dataset({"joint_position": (("joint", "xyz"), places)}, {"joint": ["a", "b"]})
    found = start_of(record)
    assert ({name: x.tolist() for name, x in found.joints.items()}, found.buoys) == (
        {"a": [0, 1, 2], "b": [3, 4, 5]},
        {},
    )
    found = start_of(record.rename(joint="buoy", joint_position="buoy_position"))
    assert (found.joints, {name: x.tolist() for name, x in found.buoys.items()}) == (
        {},
        {"a": [0, 1, 2], "b": [3, 4, 5]},
    )


# -- a run -------------------------------------------------------------------------------------------------------------


class MoorDyn:
    """What MoorDyn is asked for; a line of two segments whose tensions are the time, and a body."""

    LEVEL_NONE = "none"

    def __init__(self, breaks=None, tension=0.0, place=0.0):
        self.calls, self.breaks, self.tension, self.place, self.t = [], breaks, tension, place, 0.0

    def Create(self, path):
        with open(path) as file:
            self.calls.append(
                ("Create", os.path.basename(path), file.read(), sorted(os.listdir(os.path.dirname(path))))
            )
        return "system"

    def SetVerbosity(self, system, level):
        self.calls.append(("SetVerbosity", level))

    def Init(self, system, x, v):
        self.calls.append(("Init", x, v))

    def Step(self, system, x, v, t, step):
        if self.breaks is not None and t > self.breaks:
            raise RuntimeError
        self.calls.append(("Step", x, v, t, step))
        self.t = t + step
        return [t, 0.0, 1.0]

    def Close(self, system):
        self.calls.append(("Close",))

    def GetLineNodeTen(self, line, node):
        return (3.0 * (node + self.t) + self.tension, 4.0 * (node + self.t), 0.0)

    def GetBodyState(self, body):
        return [self.t + self.place, 2.0, 3.0, 4.0, 5.0, 6.0], None

    GetNumberLines = GetNumberBodies = staticmethod(lambda system: 1)
    GetLine = GetBody = staticmethod(lambda system, number: number)
    GetLineN = staticmethod(lambda line: 3)


def exported(*driven):
    """Files of a scene with a step of 0.01 s."""
    return Export({"lines.txt": "lines", "b.txt": "more"}, [], 0.01, list(driven))


def test_a_run_of_moordyn(monkeypatch):
    """Ten of its steps in a call, driven ends one; tensions and places of as many instants as are wanted."""
    other = MoorDyn()
    monkeypatch.setattr(moordyn_run, "moordyn_module", lambda: other)
    found = moordyn_run.run(exported(), 0.6, most=3)
    assert other.calls[:3] == [
        ("Create", "lines.txt", "lines", ["b.txt", "lines.txt"]),
        ("SetVerbosity", "none"),
        ("Init", [], []),
    ]
    steps = [call for call in other.calls if call[0] == "Step"]
    np.testing.assert_allclose([call[3:] for call in steps], [(0.1 * k, 0.1) for k in range(6)], rtol=1e-11, atol=1e-15)
    assert all(step < 0.1 for *_, step in steps)
    assert other.calls[-1] == ("Close",)
    np.testing.assert_allclose(found.t, [0.2, 0.4, 0.6], rtol=1e-11)
    ends = [[5 * t, 5 * (3 + t)] for t in (0.2, 0.4, 0.6)]  # node 0 and 3, carried on from those beside them
    np.testing.assert_allclose(found.tension[:, 0], ends, rtol=1e-11)
    np.testing.assert_allclose(found.body[:, 0], [[t, 2.0, 3.0] for t in (0.2, 0.4, 0.6)], rtol=1e-11)
    np.testing.assert_allclose(found.force[:, 0], [0.1, 0.3, 0.5], rtol=1e-11)
    assert found.seconds >= 0


def test_ends_that_are_driven(monkeypatch):
    """From place to place with the speed between them, in calls of one step, or as many as are asked for."""
    other = MoorDyn()
    monkeypatch.setattr(moordyn_run, "moordyn_module", lambda: other)
    monkeypatch.setattr(moordyn_run, "top_position", lambda top, t: np.array([top + t**2, 0.0, 0.0]))
    for per_call, steps, speed in ((None, 4, 0.01), (2, 2, 0.02)):
        other.calls.clear()
        moordyn_run.run(exported(1.0, 5.0), 0.04, per_call=per_call)
        assert other.calls[2] == ("Init", [1.0, 0.0, 0.0, 5.0, 0.0, 0.0], [0.0] * 6)
        found = [call for call in other.calls if call[0] == "Step"]
        assert len(found) == steps
        np.testing.assert_allclose(found[0][2], [speed, 0, 0, speed, 0, 0], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("other", "known"),
    [
        (MoorDyn(), True),
        (MoorDyn(breaks=0.05), False),
        (MoorDyn(tension=math.nan), False),
        (MoorDyn(place=math.nan), False),
    ],
)
def test_a_run_that_diverges_is_none_and_is_closed(monkeypatch, other, known):
    monkeypatch.setattr(moordyn_run, "moordyn_module", lambda: other)
    assert (moordyn_run.run(exported(), 0.2) is not None) == known
    assert [call for call in other.calls if call == ("Close",)] == [("Close",)]


def test_what_moordyn_says_goes_nowhere(capfd):
    """Until the end, also of a run that fails; nothing stays open."""
    before = len(os.listdir("/proc/self/fd"))
    for fails in (False, True):
        try:
            with moordyn_run.silent():
                os.write(1, b"greeting")
                os.write(2, b"warning")
                if fails:
                    raise KeyError
        except KeyError:
            pass
        os.write(1, b"out")
        os.write(2, b"err")
        assert capfd.readouterr() == ("out", "err")
    assert len(os.listdir("/proc/self/fd")) == before
