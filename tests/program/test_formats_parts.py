"""Parts of MoorDyn files alone: spectra, currents and accompanying tables; frames, masses and hydrodynamics of bodies.

Source: MoorDyn's manual, "Input Files" and "Water Kinematics", for the meaning of files; spectra, rotations, Archimedes
and Steiner by hand.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dolfbuoy.errors import InputError
from dolfbuoy.formats import moordyn_body, moordyn_files, moordyn_rods, moordyn_text
from dolfbuoy.formats.moordyn_text import Row, Tables


def row(**values):
    """A row of a table, as text."""
    return Row(7, {name: str(value) for name, value in values.items()})


@pytest.fixture
def at():
    """A line, and what is said of it, which the list `said` has."""
    said = []
    found = 7, lambda *note: said.append(note)
    found[1].said = said
    return found


# -- files beside the input --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "rows", "found"),
    [
        ("2", [[2.0, 3.0, 4.0]], [[5.0, math.pi, 0.0, 360 - math.degrees(math.atan2(4, 3))]]),
        ("7", [[2.0, 3.0, 4.0, 0.5]], [[5.0, math.pi, math.degrees(0.5), 90 - math.degrees(math.atan2(4, 3))]]),
        ("7", [[4.0, 1.0, 0.0], [2.0, 0.0, 2.0]], [[1.0, math.pi / 2, 0.0, 90.0], [2.0, math.pi, 0.0, 0.0]]),
        ("2", [[0.0, 9.0, 0.0], [1.0, 0.0, -1.0]], [[1.0, 2 * math.pi, 0.0, 90.0]]),
        # from 0.5 on in steps of 0.5, of which the last but one is between two rows
        (
            "2",
            [[0.5, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 3.0, 0.0]],
            [
                [1.0, 4 * math.pi, 0.0, 0.0],
                [1.0, 2 * math.pi, 0.0, 0.0],
                [2.0, 4 / 3 * math.pi, 0.0, 0.0],
                [3.0, math.pi, 0.0, 0.0],
            ],
        ),
    ],
)
def test_components_of_a_spectrum(mode, rows, found):
    """The real part of A exp(i omega t), of mode 7 its imaginary part; what stands at omega = 0 is no wave."""
    components = moordyn_files._components(rows, mode)["components"]
    np.testing.assert_allclose(components, found, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    ("mode", "rows", "said"),
    [
        ("2", [[1.0, 1.0, 0.0], [0.5, 1.0, 0.0]], "must hold frequencies from 0 on, growing"),
        ("7", [[-0.5, 1.0, 0.0], [0.5, 1.0, 0.0]], "must hold frequencies from 0 on, growing"),
        ("7", [[0.0, 1.0, 0.0], [0.5, 0.0, 0.0]], "must hold an amplitude that is not 0"),
    ],
)
def test_spectra_that_are_refused(mode, rows, said):
    with pytest.raises(InputError, match=f"wave_frequencies.txt: {said}"):
        moordyn_files._components(rows, mode)


def test_a_steady_current(at):
    """One value is a current, values in one direction a profile, with its sign, others a grid of one instant."""
    angle = math.degrees(math.atan2(4, -3))
    one = moordyn_files._steady(np.array([[-5.0, -3.0, 4.0, 0.0]]), at)
    assert one == {"speed": pytest.approx(5.0), "direction_deg": pytest.approx(angle)}
    found = moordyn_files._steady(np.array([[0.0, -3.0, 4.0, 0.0], [-9.0, 1.5, -2.0, 0.0]]), at)
    assert found["direction_deg"] == pytest.approx(angle)
    np.testing.assert_allclose(found["profile"], [[-9.0, -2.5], [0.0, 5.0]], rtol=1e-14)
    still = moordyn_files._steady(np.zeros((2, 4)) - [[9.0, 0, 0, 0], [0, 0, 0, 0]], at)
    assert still == {"direction_deg": 0.0, "profile": [[-9.0, 0.0], [0.0, 0.0]]}
    for across, key in ((0.5e-9, "profile"), (2e-9, "grid")):
        assert key in moordyn_files._steady(np.array([[0.0, 1.0, 0.0, 0.0], [-9.0, 0.5, across, 0.0]]), at)
    assert at[1].said == []
    turned = moordyn_files._steady(np.array([[0.0, 1.0, 0.0, 0.0], [-9.0, 0.0, 0.5, -0.1]]), at)
    assert turned == {"grid": [[0.0, -9.0, 0.0, 0.5], [0.0, 0.0, 1.0, 0.0]]}
    assert at[1].said == [(7, "current_profile.txt: what runs up or down is not carried over")]


@pytest.mark.parametrize(("count", "grid"), [(1, [0.0, 0.0]), (2, [0.3, 0.4]), (3, [0.3, 0.4])])
def test_a_current_that_changes(at, count, grid):
    """What is not given of v and w is none."""
    values = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6][: 2 * count]
    text = "a\nb\nc\nd\n-40 0\nf\n" + " ".join(map(str, (3, *values))) + "\n"
    found = moordyn_files._dynamic(text, at)
    assert found == {"grid": [[3.0, -40.0, 0.1, grid[0]], [3.0, 0.0, 0.2, grid[1]]]}
    assert len(at[1].said) == (count == 3)


@pytest.mark.parametrize(("apart", "same"), [(0.0, True), (0.9e-12, True), (1e-9, False)])
def test_a_current_over_x_and_y(at, apart, same):
    """In order of time and depth; of places where it is another there is none."""
    rows = [(0, 0, -1, 5, 0.1, 0.2, 0), (0, 0, -2, 5, 0.3, 0.4, 0), (1, 0, -1, 5, 0.1 + apart, 0.2, 0)]
    rows.append((0, 1, -3, 4, 0.5, 0.6, 0))
    text = "a\nb\nc\nd\ne\n" + "\n".join(" ".join(map(repr, one)) for one in rows)
    found = moordyn_files._everywhere(text, at)
    expected = [[4.0, -3.0, 0.5, 0.6], [5.0, -2.0, 0.3, 0.4], [5.0, -1.0, 0.1, 0.2]]
    assert found == ({"grid": expected} if same else None)
    assert len(at[1].said) == (not same)


@pytest.mark.parametrize(
    ("text", "counts", "found"),
    [
        ("a b\n1, 2\n3,4\nend\n", (2,), [[1.0, 2.0], [3.0, 4.0]]),
        ("1 2\n3\n", (1, 2), [[1.0, 2.0], [3.0]]),
        ("1 2\n3\n", (), [[1.0, 2.0], [3.0]]),
        ("1 2\n3\n4 5 6\n", (), "f: must hold lines of some numbers."),
        ("1 2\n3\n4 5 6\n", (1, 2, 3), "f: must hold lines of 1 or 2 or 3 numbers."),
        ("1 2 3\n", (2, 4), "f: must hold lines of 2 or 4 numbers."),
        ("a\n", (), "f: must hold lines of some numbers."),
    ],
)
def test_lines_of_numbers(text, counts, found):
    if isinstance(found, list):
        assert moordyn_files._rows(text, "f", counts) == found
    else:
        with pytest.raises(InputError) as error:
            moordyn_files._rows(text, "f", counts)
        assert str(error.value) == found


WATER = "{waves} WaveKinMod\neta.txt WaveKinFile\n{step} dtWave\n{angle} WaveDir\n{current} CurrentMod\nz u v\n{rows}"
PLAIN = {"waves": 0, "step": 0.5, "angle": 0, "current": 0, "rows": "0 0 0\n"}


@pytest.mark.parametrize(
    ("changes", "found", "said"),
    [
        ({}, {}, []),
        (
            {"waves": 3},
            {"waves": {"elevation": [[0.0, 1.0], [0.5, 1.5], [1.0, 2.0], [1.5, 1.0], [2.0, 0.0]]}},
            ["steps"],
        ),
        (
            {"waves": 1, "step": 1, "angle": -20},
            {"waves": {"elevation": [[0.0, 1.0], [1.0, 2.0], [2.0, 0.0]], "direction_deg": -20.0}},
            ["steps"],
        ),
        ({"waves": 2}, {}, ["WaveKinMod = 2: waves come from OpenFAST; add [waves]"]),
        ({"current": 2}, {}, ["CurrentMod = 2: the current comes from OpenFAST; add [current]"]),
        (
            {"current": 1, "rows": "0 1 0\n-9 0.5 0\n"},
            {"current": {"direction_deg": 0.0, "profile": [[-9.0, 0.5], [0.0, 1.0]]}},
            [],
        ),
        (
            {"current": 1, "rows": "0 1 0\n9 0.5 0\n"},
            {"current": {"direction_deg": 0.0, "profile": [[-9.0, 0.5], [0.0, 1.0]]}},
            [],
        ),
    ],
)
def test_water_of_openfasts_files(tmp_path, at, changes, found, said):
    """Depths or heights; a record brought to dtWave."""
    (tmp_path / "eta.txt").write_text("0 1\n1 2\n1.5 1\n2 0\n")
    assert moordyn_files._of_openfast(WATER.format(**PLAIN | changes), tmp_path, at) == found
    assert [line for line, _ in at[1].said] == [7] * len(said)
    assert all(words in text for words, (_, text) in zip(said, at[1].said, strict=True))


@pytest.mark.parametrize("step", ["0", "DEFAULT", "-"])
def test_a_record_of_openfast_without_a_step(tmp_path, at, step):
    """0.25 s, MoorDyn's own."""
    (tmp_path / "eta.txt").write_text("0 1\n1 2\n1.5 1\n")
    found = moordyn_files._of_openfast(WATER.format(**PLAIN | {"waves": 3, "step": step}), tmp_path, at)
    assert [t for t, _ in found["waves"]["elevation"]] == [0.25 * k for k in range(7)]


def test_which_file_of_water_counts(tmp_path, at):
    """Without one of OpenFAST MoorDyn's own options; a step of the record from dtWave, or 0.25 s."""
    (tmp_path / "wave_elevation.txt").write_text("0 1\n1 2\n1.5 1\n")
    for step, count in (("0.5", 4), ("x", 7), (None, 7)):
        options = {"waterkin": (1, "0"), "wavekin": (2, "3.0")} | ({} if step is None else {"dtwave": (3, step)})
        found = moordyn_files.water(Tables(options=options), tmp_path, at[1])
        assert len(found["waves"]["elevation"]) == count
    at[1].said.clear()
    assert moordyn_files.water(Tables(), tmp_path, at[1]) == {}
    assert moordyn_files.water(Tables(options={"wavekin": (2, "9"), "currents": (4, "x")}), tmp_path, at[1]) == {}
    assert at[1].said == [
        (2, "WaveKin = 9: is not known and not carried over; add [waves]"),
        (4, "Currents = x: MoorDyn itself has no current of this kind"),
    ]


# -- rows --------------------------------------------------------------------------------------------------------------


def rows_of(section, columns, *lines):
    tables = Tables(columns={section: (3, columns.split())})
    for line in lines:
        moordyn_text._row(tables, section, 9, line)
    return [(found.values, found.other) for found in tables.rows[section]]


def test_values_of_rows():
    """Outputs and what is not known may be missing at the end, words may follow it; numbers may not."""
    columns = "ID LineType AttachA AttachB UnstrLen Odd Outputs More"
    known = {"id": "1", "type": "a", "A": "2", "B": "3", "length": "9"}
    found = rows_of("lines", columns, "1 a 2 3 9", "1 a 2 3 9 x p y word words")
    assert found == [(known, {}), (known | {"outputs": "p"}, {"Odd": "x", "More": "y"})]
    for line in ("1 a 2 3", "1 a 2 3 9 x p y 8", "1 a 2 3 9 x p y word 8"):
        with pytest.raises(InputError, match=rf"line 9: there are {len(line.split())} values in 8 columns, ID Line"):
            rows_of("lines", columns, line)
    assert rows_of("failure", "ID Point", "1", "1 2 3") == [({"id": "1"}, {}), ({"id": "1", "point": "2"}, {})]


def test_bodies_and_what_they_hang_on_in_one_word():
    columns = "ID Attachment X0 Y0 Z0 r0 p0 y0"
    whole = {"x": "1", "y": "2", "z": "3", "roll": "4", "pitch": "5", "yaw": "6"}
    assert rows_of("bodies", columns, "7 Free 1 2 3 4 5 6") == [({"id": "7", "attachment": "Free"} | whole, {})]
    short = rows_of("bodies", columns.replace(" Attachment", ""), "7Coupled 1 2 3 4 5 6", "8 1 2 3 4 5 6")
    assert short == [({"id": "7", "attachment": "Coupled"} | whole, {}), ({"id": "8"} | whole, {})]
    assert rows_of("bodies", columns, "7Pinned Free 1 2 3 4 5 6") == [({"id": "7", "attachment": "Free"} | whole, {})]


@pytest.mark.parametrize(
    ("text", "key"),
    [("12", "12"), ("R1A", "rod1a"), ("rod12b", "rod12b"), ("r3B", "rod3b"), ("R1C", None), ("x", None), ("RA", None)],
)
def test_ends_of_lines_by_name(text, key):
    assert moordyn_rods.key_of(text) == key


# -- bodies ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "axis", [[0.6, 0.0, 0.8], [0.36, 0.48, 0.8], [-0.36, -0.48, -0.8], [0.0, 1.0, 0.0], [0, 0, -1.0]]
)
def test_a_frame_is_turned_the_short_way(axis):
    """About the horizontal across its third column, which is the axis, upwards."""
    up = np.array(axis) * (-1 if axis[2] < 0 else 1)
    turn = np.cross([0, 0, 1], up)
    angle = math.acos(up[2])
    size = np.linalg.norm(turn)
    expected = Rotation.from_rotvec(turn / size * angle if size else np.zeros(3)).as_matrix()
    np.testing.assert_allclose(moordyn_body._about(np.array(axis)), expected, atol=1e-14)


def rod(a, b, **more):
    return row(
        **{
            f"{axis}{end}": value
            for end, place in (("a", a), ("b", b))
            for axis, value in zip("xyz", place, strict=True)
        },
        **more,
    )


def test_the_frame_of_rods_in_a_row():
    """The lowest point of them all, from A or B; axes of length 1 along the rods, upwards."""
    way, start = np.array([0.36, 0.48, 0.8]), np.array([1.0, 2.0, -3.0])
    for spans in ([(0, 5), (5, 7)], [(7, 5), (5, 0)], [(5, 7), (5, 0)]):
        keel, axes = moordyn_body._frame([rod(start + a * way, start + b * way) for a, b in spans], np.zeros(3))
        np.testing.assert_allclose(keel, start, atol=1e-14)
        np.testing.assert_allclose(axes[:, 2], way, atol=1e-14)
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
    keel, axes = moordyn_body._frame([], np.array([0.0, 3.0, -4.0]))
    assert keel.tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(axes[:, 2], [0.0, -0.6, 0.8], atol=1e-14)
    np.testing.assert_array_equal(moordyn_body._frame([], np.array([0.0, 0.9e-6, 0.0]))[1], np.eye(3))


@pytest.mark.parametrize(
    ("second", "why"),
    [
        (([0, 0, 2], [0, 0, 2 + 0.5e-6]), "has a rod without length"),
        (([0.5e-6, 0, 2], [0, 0.5e-6, 3]), None),
        (([2e-6, 0, 2], [0, 0, 3]), "has rods that do not stand on one axis"),
        (([0, 0, 2 + 0.5e-6], [0, 0, 3]), None),
        (([0, 0, 2 + 2e-6], [0, 0, 3]), "has rods with gaps between them"),
        (([0, 0, 1.5], [0, 0, 3]), "has rods with gaps between them"),
    ],
)
def test_which_rods_are_in_a_row(second, why):
    """Within a micrometre."""
    rods = [rod([0, 0, 0], [0, 0, 2]), rod(*second)]
    if why is None:
        moordyn_body._frame(rods, np.zeros(3))
    else:
        with pytest.raises(moordyn_body.NoBuoy, match=why):
            moordyn_body._frame(rods, np.zeros(3))


@pytest.mark.parametrize(
    ("given", "turned", "moments"), [(20, 20, [5, 9, 7]), (-40, -40, [5, 9, 7]), (70, -20, [9, 5, 7])]
)
def test_masses_about_the_main_axes(given, turned, moments, at):
    """Two parts 6 m apart on the axis, of 2 and 4 kg: their centre, and 2 x 16 + 4 x 4 = 48 kg m^2 across."""
    c, s = math.cos(math.radians(given)), math.sin(math.radians(given))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    parts = [
        (2.0, np.array([1, 2, 3.0]), turn @ np.diag([5, 9, 7.0]) @ turn.T),
        (4.0, np.array([1, 2, 9.0]), np.zeros((3, 3))),
    ]
    found, axes = moordyn_body._masses("x", parts, np.array([1, 2, -1.0]), np.eye(3), 7, at[1])
    assert found == {
        "mass": 6.0,
        "center_of_mass": 8.0,
        "inertia": pytest.approx([moments[0] + 48, moments[1] + 48, moments[2]]),
    }
    c, s = math.cos(math.radians(turned)), math.sin(math.radians(turned))
    np.testing.assert_allclose(axes, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-14)
    assert at[1].said == []


def test_masses_off_the_axis_and_without_moments(at):
    """A part without mass may be anywhere; of products across and along the axis is said what is left out."""
    heavy, nothing = (
        (2.0, np.array([0, 0, 1.0]), np.diag([3.0, 4.0, 0.0])),
        (0.0, np.array([9, 9, 9.0]), np.zeros((3, 3))),
    )
    found, _ = moordyn_body._masses("x", [heavy, nothing], np.zeros(3), np.eye(3), 7, at[1])
    assert found == {"mass": 2.0, "center_of_mass": 1.0}
    assert at[1].said == [(7, "x has no inertia: that of its mass spread over the hull is taken")]
    for off in (0.5e-6, 2e-6):
        beside = (1.0, np.array([0, -off, 0.0]), np.diag([1.0, 1.0, 1.0]))
        if off < 1e-6:
            moordyn_body._masses("x", [heavy, beside], np.zeros(3), np.eye(3), 7, at[1])
        else:
            with pytest.raises(moordyn_body.NoBuoy, match="has its centre of mass off the axis of its rods"):
                moordyn_body._masses("x", [heavy, beside], np.zeros(3), np.eye(3), 7, at[1])
    at[1].said.clear()
    skew = np.array([[4.0, 0, 0], [0, 8.0, -1.0], [0, -1.0, 5.0]])
    moordyn_body._masses("x", [(2.0, np.zeros(3), skew)], np.zeros(3), np.eye(3), 7, at[1])
    said = "products of inertia of x, up to 0.12 of its largest moment, are left out"
    assert at[1].said == [(7, said)]


def test_water_of_rods_is_that_of_the_lowest(at):
    """Whatever the order of their rows and ends."""
    kinds = [row(diameter=3, Cd=0.1, Ca=0.2, CdEnd=0.3, CaEnd=0.4), row(diameter=2, Cd=0.5, Ca=0.2, CdEnd=0.6)]
    rods = [Row(8, rod([0, 0, 5], [0, 0, 3]).values), rod([0, 0, 1], [0, 0, 3])]
    found = moordyn_body._water_of_rods(rods, kinds, np.array([0, 0, 1.0]), np.eye(3), at[1])
    assert found == {
        "hull": [[0.0, 2.0], [2.0, 2.0], [2.0, 3.0], [4.0, 3.0]],
        **{"normal_drag": 0.5, "added_mass": 0.2, "axial_drag": 0.6, "axial_added_mass": 0.0},
    }
    differ = "rods differ in {}: that of the lowest is taken for the whole hull"
    assert at[1].said == [(8, differ.format(column)) for column in ("Cd", "CdEnd", "CaEnd")]


@pytest.mark.parametrize("rho", [1025.0, 0.0])
def test_water_of_a_body_without_rods(rho, at):
    """A cylinder as high as wide: drag areas over d^2 and two faces, added mass along it over two half spheres."""
    axes, d = np.eye(3)[:, [1, 2, 0]], 2.0  # the third along x
    body = row(volume=math.pi / 4 * d**3, CdA="3|5|7", Ca="0.3|0.5|0.7", id=1)
    keel, found = moordyn_body._own_water(body, np.array([1, 2, 3.0]), axes, 9.0, rho, at[1])
    np.testing.assert_allclose(keel, [0, 2, 3], atol=1e-14)
    np.testing.assert_allclose(found.pop("hull"), [[0, d], [d, d]], rtol=1e-15)
    assert found == pytest.approx(
        {
            "normal_drag": 6 / d**2,
            "added_mass": 0.6,
            "axial_drag": 3 / (2 * math.pi),
            "axial_added_mass": 0.3 * 2 * math.pi / (4 / 3 * math.pi),
        }
    )
    assert at[1].said == []
    _, found = moordyn_body._own_water(row(id=1), np.zeros(3), np.eye(3), 9.0, rho, at[1])
    volume = 9.0e-4 / (rho or 1.0)
    assert math.pi / 4 * found["hull"][1][1] ** 3 == pytest.approx(volume, rel=1e-13)
    said = "body 1 has no volume: a hull that displaces 0.0001 of its mass stands for it"
    assert at[1].said == [(7, said)]
