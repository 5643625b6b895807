"""Parts of sessions, each alone: paths, names, packed data, step counts, forces from functions.

Source: parabolas, quaternions and weighted means by hand; rotations with scipy.
"""

import json
import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI
from scipy.spatial.transform import Rotation

from dolfbuoy import InputError, load_scene
from dolfbuoy.coupling import names, paths, saved
from dolfbuoy.coupling.carried import Carried
from dolfbuoy.coupling.forces import Force, state_of
from dolfbuoy.coupling.session import Session

ROPE = {"length": 16.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 3}
FLOAT = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
TIME = {"end": 7.0, "step": 0.25}

# -- paths -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "good"),
    [
        ([1e9, 1e9, -1e9], True),
        ([1e9, 0, 0], True),
        ([1.001e9, 0, 0], False),
        ([0, -1.001e9, 0], False),
        ([math.nan, 0, 0], False),
        ([1, 2], False),
        ([1, 2, 3, 4], False),
        (7, False),
        (["x", 0, 0], False),
        (["2", 0, 0], True),
    ],
)
def test_numbers_that_are_taken(value, good):
    if good:
        assert paths.numbers_of("position", value, 3) == [float(x) for x in value]
    else:
        with pytest.raises(InputError, match=r"must be 3 numbers of 1e\+09 at most"):
            paths.numbers_of("position", value, 3)
    assert paths.numbers_of("position", None, 3) is None


def test_a_product_of_quaternions():
    assert paths.product([1, 2, 3, 4], [5, 6, 7, 8]) == [-60, 12, 30, 24]


def test_a_parabola_through_three_places():
    """t^2 at 0, 1, 3; also its rates, and exactly the given number at the end."""
    path = paths.Path(-1.0, [0.0])
    for t, x in ((0.0, 0.0), (1.0, 1.0), (3.0, 9.0)):
        path.go(t, [x])
    assert (path.at(2.0)[0][0], path.at(2.0)[1][0], path.at(3.0)[1][0]) == pytest.approx((4.0, 4.0, 6.0))
    assert path.at(3.0)[0] == [9.0]
    for early, same in ((1e-9, True), (1.9e-9, True), (2.1e-9, False)):  # a thousand-millionth of the step
        assert (path.at(3.0 - early)[0][0] == 9.0) == (path(3.0 - early)[0] == 9.0) == same


def test_a_path_that_cannot_begin_its_step_has_not_gone():
    """The next step is unaffected; a path that has never started stays at rest."""
    one, other = paths.Path(0.0, [0.0]), paths.Path(0.0, [0.0])
    for path in (one, other):
        path.go(1.0, [1.0])
    one.go(2.0, [50.0])
    one.cut(1.0)
    assert (one.start[0], one.end) == (0.0, (1.0, [1.0], None))
    for path in (one, other):
        path.go(3.0, [9.0])
    assert one.at(2.0)[0] == other.at(2.0)[0] == pytest.approx(4.0)
    still = paths.Path(2.0, [7.0])
    still.cut(2.0)
    assert still.end == still.start == (2.0, [7.0], [0.0])
    assert (still.at(2.0)[0], still(2.0)) == ([7.0], [7.0])


@pytest.mark.parametrize("rate", [None, [6.0]])
def test_a_path_that_is_cut_ends_there(rate):
    path = paths.Path(-1.0, [0.0])
    for t, x in ((0.0, 0.0), (1.0, 1.0)):
        path.go(t, [x], None if rate is None else [2 * t])
    path.go(3.0, [9.0], rate)
    path.cut(2.0)
    assert path.end[0] == 2.0
    assert path.end[1] == pytest.approx([4.0])
    assert path.end[2] is None if rate is None else path.end[2] == pytest.approx([4.0])
    assert path(2.0) == pytest.approx([4.0])


def test_a_path_rests_after_it_has_gone():
    path = paths.Path(0.0, [1.0])
    path.follow(1.0, ([3.0], [2.0]))
    path.follow(2.0, None)
    assert (path.before, path.start, path.end) == (None, (1.0, [3.0], [0.0]), (2.0, [3.0], [0.0]))
    assert (path(1.5).tolist(), path.at(1.25)[1].tolist()) == ([3.0], [0.0])
    path.function = lambda t: [10 * t]
    path.follow(4.0, ([99.0], None))
    assert (path.end, path(3.0)) == ((4.0, [40.0], None), [30.0])


def test_a_pose_goes_the_nearer_way():
    """A quaternion of any norm, with the sign of the previous one; a perpendicular one keeps its own."""
    pose = paths.Pose(0.0, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    given = pose.target("body", [1, 2, 3], [-3, 4, 0, 0], [1, 0, 0], [0, 0, 2])
    assert given[0] == [1, 2, 3, 0.6, -0.8, 0, 0]
    assert given[1] == [1, 0, 0, 0, 0, -0.8, 0.6]
    assert pose.target("body", [1, 2, 3], [0, 5, 0, 0], None, None) == ([1, 2, 3, 0, 1, 0, 0], None)
    pose.function = lambda t: ([t, 0, 0], [0, -2, 0, 0], [1, 0, 0], [0, 0, t])
    pose.follow(0.5, None)
    assert [part.tolist() for part in pose(2.0)] == [[2, 0, 0], [0, -2, 0, 0], [1, 0, 0], [0, 0, 2]]
    assert pose.end[1] == [0.5, 0, 0, 0, -1, 0, 0]
    for orientation, velocity, spin in (
        (None, None, None),
        ([1, 0, 0, 0], None, [0] * 3),
        ([1, 0, 0, 0], [0] * 3, None),
    ):
        with pytest.raises(InputError, match="needs position and orientation"):
            pose.target("body", [0, 0, 0], orientation, velocity, spin)


def test_a_length_is_one_number():
    path = paths.Length(0.0, [16.0])
    assert path.target("line.winch", 15, None, None, None) == ([15.0], None)
    assert path.target("line.winch", [1e-3], None, -0.5, None) == ([1e-3], [-0.5])
    path.function = lambda t: 16.0 - t
    path.follow(0.5, None)
    assert (path.end[1].tolist(), path(0.25)) == ([15.5], 15.75)
    for orientation, spin in (([1, 0, 0, 0], None), (None, [0, 0, 1])):
        with pytest.raises(InputError, match="is a length: it has a position and a velocity only"):
            path.target("line.winch", 15.0, orientation, None, spin)
        with pytest.raises(InputError, match="is an end of a line: it has a position and a velocity only"):
            paths.Path(0.0, [0.0] * 3).target("line.to", [0, 0, 0], orientation, None, spin)


# -- names -------------------------------------------------------------------------------------------------------------


def test_mean_tension_is_weighed_by_lengths():
    lines = Fake(cells_of={2: np.array([1, 2])}, cell_ends=np.array([[0, 9], [10, 11], [11, 14.0]]))
    lines.mean_tension = lambda u: np.array([1e9, 40.0, 80.0])
    problem = Fake(lines=Fake(holder=lambda piece: (lines, piece - 5)), comm=MPI.COMM_SELF, system=Fake(u=None))
    assert names.mean_tension(problem, 7) == 70.0


def test_rows_of_loads():
    """For a buoy the momentum rows, for a body its own, for another joint those of the first line's end there."""
    legs = [
        {"name": n, "from": [x, 0, 0], "to": j, **ROPE} for n, x, j in (("a", 0, "Y"), ("b", 5, "Y"), ("c", 9, "Z"))
    ]
    legs += [
        {"name": "d", "from": [3, 0, 0], "to": "Z", **ROPE},
        {"name": "e", "from": [4, 0, 0], "to": "buoy", **ROPE},
    ]
    legs += [{"name": "f", "from": [2, 0, 0], "top": {"kind": "free"}, **ROPE}]
    network = load_scene({"cable": legs, "joint": [{"name": "Y"}, {"name": "Z", "mass": 9.0}], "buoy": FLOAT}).network
    bodies = Fake(part=Fake(offset=100), dofs=np.array([[2, 3, 4]]), names=["Z"])
    ends = [[np.arange(3) + 10 * k, np.arange(3) + 10 * k + 5] for k in range(6)]
    lines = Fake(end_dofs=ends, owns_end=lambda piece, end: True)
    buoys = {"buoy": Fake(part=Fake(slice=slice(200, 213)))}
    problem = Fake(network=network, bodies=bodies, lines=lines, buoys=buoys)
    found = {name: names.loaded_rows(problem, name, ()) for name in ("buoy", "Y", "Z", "f.to")}
    assert {name: (count, rows.tolist()) for name, (count, rows) in found.items()} == {
        "buoy": (6, [203, 204, 205, 210, 211, 212]),
        "Y": (3, [5, 6, 7]),
        "Z": (3, [102, 103, 104]),
        "f.to": (3, [55, 56, 57]),
    }
    problem.bodies, problem.buoys, lines.owns_end = None, {}, lambda piece, end: False  # on another rank
    for name in found:
        count, rows = names.loaded_rows(problem, name, ())
        assert (count, rows.tolist()) == (found[name][0], [])
    for name, driven, said in (
        ("a.from", (), r"must be of what moves freely: buoy, Y, Z, f\.to\."),
        ("buoy", ("buoy",), r"must be of what moves freely: Y, Z, f\.to\."),
    ):
        with pytest.raises(InputError, match=said):
            names.loaded_rows(problem, name, driven)


@pytest.mark.parametrize("to", [[0.0, 0.0, 9.0], "Z"])
def test_a_take_off_keeps_an_end_that_is_free(to):
    legs = [
        {"name": n, "from": [x, 0, 0], "to": j, **ROPE} for n, x, j in (("a", 0, "Y"), ("b", 5, "Y"), ("c", 9, "Z"))
    ]
    legs += [{"name": "d", "from": [3, 0, 0], "to": "Z", **ROPE}]
    device = {"from": "Y", "to": to, "stiffness": 500.0, "length": 1.0}
    scene = load_scene({"cable": legs, "joint": [{"name": "Y"}, {"name": "Z"}], "take_off": device, "time": TIME})
    with pytest.raises(InputError, match=r"driven = 'Y': both ends of take_off would be held"):
        names.holding_joints(scene, ["Z", "Y"], MPI.COMM_SELF)
    assert names.holding_joints(scene, ["a.from"], MPI.COMM_SELF) is scene


def test_a_place_is_of_the_rank_that_has_it():
    lines = Fake(end_dofs=[None, (np.array([3, 4, 5]), None)], owns_end=lambda piece, end: True)
    problem = Fake(network=Fake(meetings=lambda: {"Y": [(1, 0), (0, 1)]}), lines=lines)
    problem.system = Fake(u=np.arange(9.0))
    problem.comm = Fake(allgather=lambda mine: [None, mine, [9.0] * 3])
    assert names._place_of(problem, "Y") == (3.0, 4.0, 5.0)


def test_vessels_that_cannot_be_driven():
    vessel = {"name": "ship", "position": [1, 0, 0], "fairleads": {"bow": [3.0, 0, -1]}, "hull": [12, 4, -1, 2]}
    line = {"name": "fore", "from": [12.0, 6.0, -10.0], "to": "ship.bow", **ROPE}
    for change, bent, said in (
        ({"motion": [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]]}, {}, "the scene moves it"),
        ({"wind": {"speed_10m": 12.0, "area": 9.0, "height": 2.5}}, {}, "it has wind"),
        ({}, {"bending_stiffness": 9.0, "to_end": {"direction": [0, 0, 1]}}, "it holds a line in a direction"),
    ):
        scene = load_scene({"vessel": [vessel | change], "cable": line | bent, "time": TIME})
        with pytest.raises(InputError, match=f"driven = 'ship': {said}"):
            Carried(Fake(scene=scene, t=0.0), scene.vessel[0])


# -- what is packed ----------------------------------------------------------------------------------------------------


def test_what_is_packed_is_unpacked():
    """Arrays of all kinds and shapes, tuples, numeric keys, numpy scalars."""
    tree = {
        "a": np.arange(6, dtype=np.int32).reshape(2, 3).T,
        "b": [np.array(1.5), np.array([True, False]), None, "x", 0.1, np.float64(0.3), np.int64(7)],
        "c": {"d": (1, (2.5, "y")), "e": np.zeros((0, 3)), 3: False},
    }
    found = saved._tree(json.loads(json.dumps(saved._plain(tree))))
    assert list(found) == list(tree)
    np.testing.assert_array_equal(found["a"], tree["a"])
    assert (found["a"].dtype, found["a"].shape, found["a"].flags.writeable) == (np.int32, (3, 2), True)
    first, second, *rest = found["b"]
    assert (first, first.shape, second.tolist(), rest) == (1.5, (), [True, False], [None, "x", 0.1, 0.3, 7])
    assert (found["c"]["d"], found["c"]["e"].shape, found["c"][3]) == ((1, (2.5, "y")), (0, 3), False)
    with pytest.raises(InputError, match="give numbers instead"):
        saved._plain([lambda: 1])


def test_a_copy_is_apart():
    tree = {"a": [np.zeros(2), {"b": np.ones(1)}], "c": (1,)}
    found = saved.copied(tree)
    tree["a"][0][:] = tree["a"][1]["b"][:] = 9.0
    tree["a"].append(3)
    assert (found["a"][0].tolist(), found["a"][1]["b"].tolist(), len(found["a"]), found["c"]) == ([0, 0], [1], 2, (1,))


# -- steps -------------------------------------------------------------------------------------------------------------


def test_steps_are_counted_from_where_their_size_began():
    went = []
    s = Fake(_step=0.1, _series=(0.0, -1.0, 0), t=2.0, simulation=Fake(t=2.0))

    def advance_to(t):
        went.append(t)
        s.t = s.simulation.t = t

    s.advance_to = advance_to
    for dt in (None, 0.1, 0.1, 0.3, 0.3):
        Session.step(s, dt)
    begin = 2.0 + 3 * 0.1
    assert went == [2.0 + 0.1, 2.0 + 2 * 0.1, begin, begin + 0.3, begin + 2 * 0.3]
    s.simulation.t = s.t = begin + 0.6 + 0.5e-9 * 0.3  # rounding
    Session.step(s, 0.3)
    assert went[-1] == begin + 3 * 0.3
    s.simulation.t = s.t = begin + 0.9 + 2e-9 * 0.3  # somebody else's step
    Session.step(s, 0.3)
    assert went[-1] == begin + 0.9 + 2e-9 * 0.3 + 0.3
    for dt in (0.0, -0.1, math.inf, math.nan):
        with pytest.raises(InputError, match="must be a positive number of seconds"):
            Session.step(s, dt)


@pytest.mark.parametrize(
    ("way", "count"), [(0.2, 1), (0.25, 1), (0.2500002, 1), (0.250001, 2), (0.75, 3), (1.0 - 1e-9, 4), (1e-9, 1)]
)
def test_a_way_in_equal_steps(way, count):
    """At most 0.25 s each, to rounding."""
    went, path = [], paths.Path(1.0, [0.0])
    simulation = Fake(t=1.0, control=Fake(step=0.25), advance=lambda t: went.append(t) or [])
    s = Fake(simulation=simulation, _targets={"a": ([5.0], None)}, paths={"a": path}, _longest=0.25, _required={})
    s._recorder = None
    Session.advance_to(s, 1.0 + way)
    np.testing.assert_allclose(went, 1.0 + way * np.arange(1, count + 1) / count, rtol=1e-14)
    assert went[-1] == 1.0 + way
    assert (path.end, s._targets) == ((1.0 + way, [5.0], None), {})
    for t in (1.0, 0.5, math.inf, math.nan):
        with pytest.raises(InputError, match="must be after 1 s, the time that was reached"):
            Session.advance_to(s, t)


@pytest.mark.parametrize("reached", [1.0, 1.5])
def test_after_a_failure_all_is_ready_for_another_try(reached):
    forgotten, path = [], paths.Path(1.0, [0.0])
    path.go(2.0, [4.0])
    s = Fake(t=reached, paths={"a": path}, simulation=Fake(control=Fake(step=1e-6)))
    s.simulation.past = Fake(forget=lambda: forgotten.append(1))
    Session._give_up(s, 1.0, 0.25)
    assert (s.simulation.control.step, len(forgotten)) == (0.25, int(reached > 1.0))
    assert path.end[0] == reached


# -- forces ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "rows", "load"),
    [
        ([1, 2, 3], 3, [1, 2, 3]),
        ([1, 2, 3], 6, [1, 2, 3, 0, 0, 0]),
        (([1, 2, 3], [4, 5, 6]), 6, [1, 2, 3, 4, 5, 6]),
        (([1, 2, 3], [4, 5, 6]), 3, "must be 3 finite numbers."),
        ([1, 2], 6, "must be a force, or a force and a moment, of finite numbers."),
        ([1, math.nan, 3], 6, "must be a force, or a force and a moment, of finite numbers."),
        ([1, math.inf, 3], 3, "must be 3 finite numbers."),
    ],
)
def test_what_a_function_of_loads_gives(given, rows, load):
    asked = []
    force = Fake(function=lambda t, y: asked.append((t, y)) or given, rows=range(rows), _state=lambda y: y + 1)
    force.simulation = Fake(problem=Fake(time=np.array([2.5])))
    if isinstance(load, str):
        with pytest.raises(InputError, match=load):
            Force._load(force, 4)
    else:
        assert Force._load(force, 4).tolist() == load
    assert asked == [(2.5, 5)]


def test_velocity_of_a_point_that_is_loaded():
    """Its rate by the scheme's rule, from the unknowns and history of its part."""
    evolutions = [Fake(part=Fake(offset=k, size=6), order=n) for k, n in ((0, 2), (6, 1), (12, 2))]
    past = Fake(evolutions=evolutions, places=[slice(0, 6), slice(6, 12), slice(12, 18)])
    past.series, past.operations = [Fake(history=np.arange(18.0))], Fake(gammas=[10.0, 100.0])
    force = Fake(simulation=Fake(past=past))
    for columns, history in (([0, 1, 2], [0, 1, 2]), ([3, 4, 5], [3, 4, 5]), ([15, 16, 17], [15, 16, 17])):
        force._columns = np.array(columns)
        found = Force._of_point(force, np.array([1.0, 2.0, 3.0]))
        assert found.velocity.tolist() == (np.array([10.0, 20.0, 30.0]) + history).tolist()
        assert found.position.tolist() == [1.0, 2.0, 3.0]
    for columns in ([6, 7, 8], [9, 10, 11]):  # of first order
        force._columns = np.array(columns)
        with pytest.raises(InputError, match="nothing is known of the velocity there"):
            Force._of_point(force, np.zeros(3))


def test_motion_of_a_body_from_its_numbers():
    """With a quaternion that is not normalised."""
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8])
    omega, q4 = np.array([0.4, -0.7, 1.1]), np.roll(turn.as_quat(), 1)
    L = turn.apply(np.array([2.0, 3.0, 5.0]) * turn.inv().apply(omega))
    body = Fake(mass=Fake(mass=4.0, inertia=(2.0, 3.0, 5.0)))
    found = state_of(body, np.concatenate([[1, 2, 3], [8, -4, 12], 1.5 * q4, L]))
    expected = [1, 2, 3], q4, [2, -1, 3], omega
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-14)


def test_only_buoys_on_lines_can_be_driven():
    """Of two floats, the one tied to a line, not the one held by a take-off."""
    rope = {**ROPE, "diameter": 0.02, "from": [0.0, 0.0, -15.0], "to": "tied"}
    floats = [{**FLOAT, "name": "tied"}, {**FLOAT, "name": "loose"}]
    device = {"from": [9.0, 0.0, -15.0], "to": "loose", "stiffness": 500.0, "length": 1.0}
    scene = {"sea": {"depth": 15.0}, "cable": rope, "buoy": floats, "take_off": device, "time": TIME}
    network = load_scene(scene).network
    assert "tied" in names.drivable(network)
    assert "loose" not in names.drivable(network)
    names.check_body(network, "tied")
    with pytest.raises(InputError, match="driven = 'loose': no line hangs on it"):
        names.check_body(network, "loose")
