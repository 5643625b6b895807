"""Parts of results, each alone: boxes of vessels, largest tensions of pieces, positions, fatigue lives, pictures.

Source: the same numbers by hand; the Gumbel distribution in closed form.
"""

import importlib
import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from made_up import RECORD, SCENE
from matplotlib.image import imread
from mpi4py import MPI

from dolfbuoy import figures, load_scene
from dolfbuoy.results import bars, devices, lifetime, record, running, style, sweep_figure
from dolfbuoy.results.after_ramp import Missing
from dolfbuoy.results.extremes import Gumbel
from dolfbuoy.results.observe import Observer
from dolfbuoy.results.places import Place
from dolfbuoy.results.sample import Fatigue
from dolfbuoy.results.statistics import collect

snapshot = importlib.import_module("dolfbuoy.results.snapshot")
HERE = Fake(size=1, rank=0, allgather=lambda mine: [mine])

# -- vessels and devices -----------------------------------------------------------------------------------------------


def test_boxes_of_vessels():
    """Of those that have one and that no session drove: corners where the vessel is, turned as it is."""
    ship = {"name": "ship", "position": [1, 0, 0], "heading_deg": 90.0, "fairleads": {"bow": [3.0, 0, -1]}}
    moved = {"name": "boat", "position": [0, 50, 0], "fairleads": {"bow": [3.0, 0, -1]}, "hull": [4, 2, -1, 1]}
    moved["motion"] = [[0, 0, 0, 0, 0, 0, 0], [10, 5, 0, 0, 0, 0, 0]]
    rope = {"length": 90.0, "line_density": 2.0, "from": [12.0, 6.0, -10.0]}
    lines = [rope | {"name": name, "to": f"{name}.bow"} for name in ("ship", "boat")]
    for hull, session, names in (
        ([12, 4, -1, 2], None, ["ship", "boat"]),
        ([12, 4, -1, 2], "driven: x, ship", ["boat"]),
        ([12, 4, -1, 2], "driven: boat", ["ship"]),
        (None, None, ["boat"]),
    ):
        vessel = ship | ({"hull": hull} if hull else {})
        scene = load_scene({"vessel": [vessel, moved], "cable": lines, "time": {"end": 10.0, "step": 0.1}})
        attrs = {"session": session} if session else {}
        found = {one.name: one for one in devices.shells_of(Fake(scene=scene, record=Fake(attrs=attrs)))}
        assert list(found) == names
        if "ship" in names:
            expected = [[1 - y, x, z] for x in (-6, 6) for y in (-2, 2) for z in (-1, 2)]
            np.testing.assert_allclose(found["ship"].at(3.0), expected, atol=1e-12)
            assert not found["ship"].moves
            assert found["ship"].at(3.0)[devices.DECK, 2].tolist() == [2.0] * 4
        if "boat" in names:
            expected = [[5 + x, 50 + y, z] for x in (-2, 2) for y in (-1, 1) for z in (-1, 1)]
            np.testing.assert_allclose(found["boat"].at(10.0), expected, atol=1e-12)
            assert found["boat"].moves
    assert list(devices.shells_of(Fake(scene=Fake(vessel=None), record=Fake(attrs={})))) == []


def test_sides_of_a_box_are_its_faces():
    """Each in one plane, its corners one after the other around it."""
    corners = np.array(devices.corners_of((2.0, 4.0, -1.0, 5.0)))
    assert corners.tolist() == [[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-1, 5)]
    faces = corners[devices.SIDES]
    flat = [(int(np.argmin(np.ptp(face, axis=0))), float(face[0][np.argmin(np.ptp(face, axis=0))])) for face in faces]
    assert flat == [(0, -1.0), (0, 1.0), (1, -2.0), (1, 2.0), (2, -1.0), (2, 5.0)]
    steps = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=2)
    assert (np.sort(steps, axis=1) == np.array([[4, 4, 6, 6]] * 2 + [[2, 2, 6, 6]] * 2 + [[2, 2, 4, 4]] * 2)).all()


def test_ends_of_take_offs():
    """On a buoy, held, moved, or at a joint of lines, the node of its mark."""
    rope = {"length": 20.0, "line_density": 2.0, "diameter": 0.02}
    scene = load_scene(
        {
            "sea": {"depth": 30.0},
            "joint": [{"name": "Y"}],
            "cable": [
                {"name": "a", "from": [0, 0, -30], "to": "Y", **rope},
                {"name": "b", "from": [20, 0, -30], "to": "Y", **rope},
            ],
            "buoy": [
                {"name": n, "mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
                for n in ("near", "far")
            ],
            "take_off": [
                {"name": "one", "from": "Y", "to": "far", "stiffness": 500.0, "length": 1.0},
                {"name": "two", "from": [1.0, 2.0, -30.0], "to": "near", "stiffness": 500.0, "length": 1.0},
            ],
        }
    )
    frames = Fake(network=scene.network, buoys=["near", "far"], marks=[Fake(name="", node=0), Fake(name="Y", node=7)])
    one, two = devices.devices_of(frames)
    assert (one.name, two.name) == ("one", "two")
    (joint, far), (held, near) = one.ends, two.ends
    assert (joint.node, joint.buoy, joint.path) == (7, None, None)
    assert (far.buoy, near.buoy, far.node) == (1, 0, None)
    np.testing.assert_allclose(held.path(3.0), [1.0, 2.0, -30.0])
    assert not held.moves


# -- tensions ----------------------------------------------------------------------------------------------------------


def stressed_problem(loads, degrees, cells, T, comm=HERE):
    """Pieces with these breaking loads and degrees of tension, on elements (begin, end) of piece k each."""
    pieces = [Fake(section=Fake(breaking_load=x, tension_degree=d)) for x, d in zip(loads, degrees, strict=True)]
    network = Fake(pieces=pieces, name_of=lambda k: f"cable.{k}")
    numbers = np.array([k for k, *_ in cells])
    lines = Fake(line_of_cell=numbers, cell_ends=np.array([ends for _, *ends in cells], dtype=float))
    lines.T_dofs, lines.weight_of = np.arange(T.size).reshape(T.shape), lambda k: -3.0
    return Fake(network=network, lines=lines, comm=comm, system=Fake(u=T.ravel()))


def test_largest_tensions_are_those_of_the_nodes():
    T = np.array([[10.0, 30.0], [40.0, 20.0], [90.0, 90.0], [-5.0, -8.0]])
    problem = stressed_problem([100.0, None, 50.0], [1, 1, 1], [(0, 0, 1), (0, 1, 2), (1, 2, 3), (2, 3, 4)], T)
    assert running.stressed(problem.network) == {"cable.0": 0, "cable.2": 2}
    found = running.Utilisation(problem)
    found.note()
    assert found.values.tolist() == [0.4, -0.1]


@pytest.mark.parametrize(
    ("tensions", "largest"),
    [
        ((5.0, 6.0, 9.0), 9 + (9 - 6) * 2 / 3.5),  # half of the last element beyond its middle
        ((9.0, 6.0, 5.0), 9 + (9 - 6) * 1 / 2.5),
        ((6.0, 9.0, 6.0), 9.0),
    ],
)
def test_constant_tensions_go_on_to_the_ends(tensions, largest):
    """Elements of 2, 3 and 4 m in any order; a piece that is one element has half its weight beyond its middle."""
    cells = [(0, 15, 19), (0, 10, 12), (1, 19, 23), (0, 12, 15), (2, 23, 24)]
    low, middle, high = tensions
    T = np.array([high, low, 20.0, middle, 70.0])[:, None]
    problem = stressed_problem([10.0, 50.0, 100.0], [0, 0, 1], cells, T)
    found = running.Utilisation(problem)
    found.note()
    np.testing.assert_allclose(found.values, [largest / 10, (20 + 3 * 4 / 2) / 50, 0.7], rtol=1e-14)


def test_largest_tensions_of_several_ranks():
    """The largest of each, and ends from elements that lie on two of them: here the upper two of three."""
    asked = []

    def reduce(mine, found, op=MPI.SUM):
        asked.append(op)
        found[:] = np.maximum(mine, 8.0) if op == MPI.MAX else mine + [5 * 1.4, 0.0]

    comm = Fake(size=2, rank=0, Reduce=reduce, allgather=lambda mine: [[(11.0, 2.0)], mine])
    T = np.array([6.0, 9.0])[:, None]
    found = running.Utilisation(stressed_problem([10.0], [0], [(0, 12, 15), (0, 15, 19)], T, comm))
    found.note()
    assert asked == [MPI.MAX, MPI.SUM]
    np.testing.assert_allclose(found.values, [(9 + 3 * 4 / 7 * 1.5) / 10], rtol=0.1)
    np.testing.assert_allclose(found.values, [(9 + (9 - 6) * 2 / 3.5) / 10], rtol=1e-14)


def test_smallest_tensions_of_several_ranks():
    found, least = object.__new__(running.Smallest), []
    found.values = np.zeros(2)
    found._find = lambda: found.values.__setitem__(slice(None), [3.0, math.inf])
    found._comm = Fake(size=2, Reduce=lambda mine, out, op: least.append(op) or np.minimum(mine, [5.0, 4.0], out=out))
    found.note()
    assert (found.values.tolist(), least) == ([3.0, 4.0], [MPI.MIN])
    found._comm = Fake(size=1)
    found.note()
    assert found.values.tolist() == [3.0, math.inf]


@pytest.mark.parametrize(
    ("s", "dof"),
    [(0.0, 0), (0.4, 0), (0.6, 1), (1.0, 1), (1.2, 1), (1.7, 3), (9.0, 3)],  # of two elements the lower one
)
@pytest.mark.parametrize("cells", [[0, 1], [1, 0]])  # however they are numbered
def test_the_tension_nearest_to_a_place(s, dof, cells):
    group = Fake(cells_of=[np.array(cells)], T_s=np.array([[10.0, 11.0 + 2e-10], [11.0, 12.0]]), begins=[10.0])
    group.cell_ends, group.T_dofs = np.array([[10.0, 11.0], [11.0, 12.0]]), np.array([[0, 1], [2, 3]])
    group.part = Fake(offset=100)
    lines = Fake(holder=lambda piece: {4: (group, 0)}[piece])
    u = np.zeros(200)
    observer = Fake(problem=Fake(lines=lines, system=Fake(u=u)), comm=HERE)
    assert Observer._tension_near(observer, Place("a", 4, s)) == [(u, 100 + dof, 1.0)]
    observer.comm = Fake(rank=0, allgather=lambda mine: [mine, (0.0, -1.0, 1, 5)])  # another rank has it
    ((array, place, factor),) = Observer._tension_near(observer, Place("a", 4, 0.4))
    assert (array.tolist(), place, factor) == ([0.0], 0, 1.0)


# -- numbers -----------------------------------------------------------------------------------------------------------


def test_names_of_outputs():
    assert {name: bars._name(name) for name in ("anchor", "smallest_tension", "tension_top", "buoy_position_x")} == {
        "anchor": "anchor force",
        "smallest_tension": "tension where it is least",
        "tension_top": "top tension",
        "buoy_position_x": "buoy position, x",
    }


def test_the_largest_value_of_a_life():
    """Root of sum p (1 - exp(-n e^(-(x - u)/b))) = a, of one sea state in closed form; of rarer ones there is none."""
    years, u, b = 50.0, 100.0, 7.0
    allowed = lifetime.DURATION / (years * lifetime.YEAR)
    assert allowed == pytest.approx(3 * 3600 / (50 * 365.25 * 86400), rel=1e-12)
    for p in (1.0, 0.3, allowed * 1.01):
        found = lifetime._largest([(p, Gumbel(u, b), 1800.0)], years)
        assert found == pytest.approx(u - b * math.log(-math.log1p(-allowed / p) / 6), rel=1e-9)
    one = lifetime._largest([(0.5, Gumbel(u, b), 1800.0), (0.5, Gumbel(u, b), 3600.0)], years)
    found = sum(0.5 * float(Gumbel(u, b).above(one, n)) for n in (6, 3))
    assert found == pytest.approx(allowed, rel=1e-9)
    assert math.isnan(lifetime._largest([(allowed / 2, Gumbel(u, b), 1800.0)] * 2, years))


def test_damage_of_a_year_is_that_of_its_sea_states():
    """Runs of a state together, states by their probabilities, whatever the lengths of runs."""

    def run(duration, ranges, counts):
        sample = {"duration": duration, "cycles": {"tension_top of a": [ranges, counts]}, "peaks": {}, "series": {}}
        return Fake(sample=sample, set="x")

    states = [(0.25, [run(100.0, [2.0], [5.0]), run(300.0, [1.0, 3.0], [2.0, 0.5])]), (0.5, [run(50.0, [4.0], [1.0])])]
    reasons, curves = [], {}
    fatigue = Fatigue(exponent=2.0, constant=1e9, frequency=0.1)
    found = lifetime._row("tension_top of a", states, fatigue, 50.0, reasons, curves)
    rate = 0.25 * (5 * 4 + 2 + 4.5) / 400 + 0.5 * 16 / 50
    damage = 31557600.0 * rate / 1e9
    assert found[:3] == pytest.approx((damage, 1 / damage, math.sqrt(rate / 0.1)), rel=1e-12)
    assert math.isnan(found[3])
    assert reasons[0].startswith("No largest value of 50 years: ")
    assert [*curves.values()] == [["tension_top of a"] * 3]
    found = lifetime._row("another", states, fatigue, 50.0, reasons, curves)
    assert all(map(math.isnan, found))


# -- files and pictures ------------------------------------------------------------------------------------------------


def test_a_picture_has_its_dots(tmp_path):
    """200 to the inch in a file, without another layout afterwards; 150 in a notebook."""
    figure = style.new_figure(2.0, 1.5)
    figure.subplots().set(xlabel="x [m]")
    assert style.save(figure, tmp_path / "a.b") == [tmp_path / "a.b.png", tmp_path / "a.b.svg"]
    assert imread(tmp_path / "a.b.png").shape[:2] == (300, 400)
    assert b"<dc:date>" not in (tmp_path / "a.b.svg").read_bytes()
    assert (
        figure.get_layout_engine() is None or figure.get_layout_engine().__class__.__name__ == "PlaceHolderLayoutEngine"
    )
    assert style.save(figure, tmp_path / "c", svg=False) == [tmp_path / "c.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.b.png", "a.b.svg", "c.png"]
    (tmp_path / "d.png").write_bytes(style.new_figure(2.0, 1.0)._repr_png_())
    assert imread(tmp_path / "d.png").shape[:2] == (150, 300)


def test_a_line_that_does_not_bend_has_no_curvatures():
    straight = RECORD.assign(curvature=0.0 * RECORD.cable_position.isel(xyz=0, drop=True))
    with pytest.raises(Missing, match="It does not bend"):
        figures.curvature(straight, SCENE)


@pytest.mark.parametrize("count", [200, 201])
def test_many_cases_are_points(count):
    """Of their mean and both ends, which are fainter; up to 200 are bars."""
    numbers = [{"mean": 1.0 * k, "minimum": k - 2.0, "maximum": k + 3.0} for k in range(count)]
    rows = [
        {"changes": {"a.x": 0.5 * k}, "status": "done", "criteria": [], "statistics": {"cone_angle of b": one}}
        for k, one in enumerate(numbers)
    ]
    (axes,) = sweep_figure.draw(collect(rows)).axes
    if count == 200:
        assert len(axes.containers) == 1
        return
    assert not axes.containers
    middle, low, high = axes.lines
    for line, shift, size, faint in ((middle, 0, 3, None), (low, -2, 1, 0.4), (high, 3, 1, 0.4)):
        np.testing.assert_allclose(line.get_data(), [0.5 * np.arange(count), np.arange(count) + shift])
        assert (line.get_markersize(), line.get_alpha(), line.get_rasterized()) == (size, faint, True)
        assert line.get_color() == middle.get_color()


def test_light_on_patches():
    """From above and one side, on either face; the colour's opacity stays."""
    flat = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]]
    upright = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
    patches = np.array([flat, flat[::-1], upright, np.roll(upright, 1, axis=1).tolist()], dtype=float)
    found = snapshot._shaded(patches, "#ff8040")
    light = np.array([0.8, 0.8, 0.36, 0.48]) * 0.28 + 0.72
    np.testing.assert_allclose(found[:, :3], light[:, None] * np.array([255, 128, 64]) / 255, rtol=1e-12)
    assert found[:, 3].tolist() == [1.0] * 4


def test_lines_that_leave_a_box_or_pass_a_height():
    x = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 2.0], [4.0, 0.0, -2.0]])
    crossed = snapshot._crossing(x, 1.0)
    np.testing.assert_allclose(crossed, [[0, 0, 0], [2, 0, 1], [4, 0, 2], [4, 0, 1], [4, 0, -2]])
    assert snapshot._crossing(x, 2.0).tolist() == x.tolist()
    box = np.array([[0.0, -1.0, -2.0], [4.0, 1.0, 2.0]])
    assert snapshot._inside(x, box) is x
    cut = snapshot._inside(x, box + [[0, 0, 2], [-2, 0, 0]])
    np.testing.assert_allclose(cut, np.linspace([0, 0, 0], [2, 0, 1], 101), atol=1e-12)


def test_a_record_without_time_is_sealed(tmp_path):
    """So that a byte that changes is seen; what is put into it later is sealed again."""
    made = xr.Dataset({"a": ("x", [1.0, 2.0])}, attrs={"title": "t"})
    record.save(made, tmp_path / "r.nc")
    assert "_FillValue" not in record.read(tmp_path / "r.nc").a.encoding
    record.put(tmp_path / "r.nc", xr.Dataset({"b": ("y", [3, 4, 5]), "w": ("y", np.array([*"uvw"], dtype=object))}))
    record.put(tmp_path / "r.nc", xr.Dataset({"b": ("y", [6, 7, 8], {"units": "m"})}, attrs={"more": 1.5}))
    found = record.read(tmp_path / "r.nc")
    assert (found.a.values.tolist(), found.b.values.tolist(), found.w.values.tolist()) == ([1, 2], [6, 7, 8], [*"uvw"])
    assert (found.attrs, found.b.attrs) == ({"title": "t", "more": 1.5}, {"units": "m"})
    whole = (tmp_path / "r.nc").read_bytes()
    assert whole[-12:-4] == b"dolfbuoy"
    (tmp_path / "r.nc").write_bytes(whole[:-13] + bytes([whole[-13] ^ 1]) + whole[-12:])
    with pytest.raises(record.InputError, match="is damaged, or not a record"):
        record.read(tmp_path / "r.nc")
