"""Parts of the search for equilibrium, each alone: failing motions, load steps, growth, rotating ends and buoys.

Source: the same numbers by hand; made-up problems with prescribed outcomes.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion.start import _at_ends, _moorings, initial_state
from dolfbuoy.scene.buoy import BuoyStart
from dolfbuoy.statics import damped, growth, offsets, ways
from dolfbuoy.statics.adrift import floating_height, held_by_take_offs, places_adrift
from dolfbuoy.statics.damped import Scale
from dolfbuoy.statics.first_shape import given_pose, with_buoys_held
from dolfbuoy.statics.rods import _Chain
from dolfbuoy.statics.start import _direction, _spring, still_network

UPRIGHT, QUARTER = np.array([1.0, 0.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 1.0]) / math.sqrt(2)  # about z
SEA = {"depth": 50.0, "density": 1000.0}
HULL = {"hull": [[0.0, 2.0], [2.0, 2.0]], "mass": 1000.0 * math.pi, "center_of_mass": 0.25}  # draws 1 m
LINE = {"length": 60.0, "line_density": 5.0, "diameter": 0.05, "axial_stiffness": 1e6, "elements": 2}


PLACE, SPRING = [0.0, 0.0, -50.0], {"stiffness": 10.0, "length": 6.0}


# -- buoys without lines ----------------------------------------------------------------------------------------------


def adrift(*pairs, own=SPRING):
    """A scene of buoys, and take-offs between them or from places."""
    devices = [{"name": f"d{k}", "from": low, "to": high} | own for k, (low, high) in enumerate(pairs)]
    named = [HULL | {"name": name, "mass": HULL["mass"] * (1 + k / 10)} for k, name in enumerate("abcd")]
    return load_scene({"sea": SEA, "buoy": named, "take_off": devices})


@pytest.mark.parametrize(
    ("pairs", "held"),
    [
        ([("a", "b"), ("b", "c")], set()),
        ([("c", "b"), (PLACE, "a"), ("c", "a")], {"a", "b", "c"}),
        ([("a", "b"), ("b", PLACE)], {"a", "b"}),
        ([(PLACE, "d")], {"d"}),
    ],
)
def test_buoys_are_held_over_any_number_of_take_offs(pairs, held):
    """Whichever way round these are written; not by those that only damp."""
    assert held_by_take_offs(adrift(*pairs).network) - {None} == held
    assert held_by_take_offs(adrift(*pairs, own={"damping": 5.0}).network) == set()


def test_buoys_afloat_are_beside_each_other():
    """By the lengths of their take-offs, drawn out by a millionth; hull to hull without one; none that is held."""
    scene = adrift(("b", "a"), ("b", "c"), (PLACE, "d"))
    found = places_adrift(scene, lambda device: 6.0 if device.name == "d0" else 0.0)
    heights = [0.25 - 1.0 - k / 10 for k in range(3)]
    expected = {"a": [0.0, 0.0], "b": [6 * (1 + 1e-6), 0.0], "c": [6 * (1 + 1e-6) + 2 * (1 + 1e-6), 0.0]}
    assert found.keys() == expected.keys()
    for (name, place), height in zip(expected.items(), heights, strict=True):
        np.testing.assert_allclose(found[name], [*place, height], rtol=1e-14)
    assert floating_height(scene.model_copy(update={"gravity": 0.0}), scene.network.buoys["a"]) == 0.0
    assert floating_height(scene.model_copy(update={"sea": None}), scene.network.buoys["a"]) == 0.0
    lines = load_scene(scene, cable=LINE | {"anchor": PLACE, "to": "a"})
    assert places_adrift(lines, lambda device: 6.0) == {}


# -- starts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("device", "length", "stiffness"),
    [
        ({"stiffness": 50.0, "length": 6.0}, 6.0, 300.0),
        ({"stiffness": 50.0, "length": 6.0, "pretension": 100.0}, 4.0, 200.0),
        ({"stiffness": 50.0, "length": 6.0, "pretension": 400.0}, 1e-3, 0.05),
        ({"stiffness": 0.0, "length": 0.0, "pretension": -70.0}, 1e-3, 0.07),
        ({"stiffness": 0.0, "length": 0.0, "pretension": 0.0}, 1e-3, 5e-9 * 1e3 / 1e3),
    ],
)
def test_a_take_off_is_an_elastic_line(device, length, stiffness):
    """T = pretension + k (distance - length) of a spring, or one that pulls as hard; a weak one that only damps."""
    found = _spring(Fake(**{"pretension": 0.0} | device), 5.0)
    assert found == pytest.approx((length, 0.0, stiffness), rel=1e-14)
    assert _spring(Fake(stiffness=0.0, length=0.0, pretension=0.0), 0.5) == pytest.approx((1e-3, 0.0, 1e-9), rel=1e-14)


def test_directions_of_no_length_are_none():
    np.testing.assert_array_equal(_direction(np.array([0.0, 3.0, -4.0])), [0.0, 0.6, -0.8])
    np.testing.assert_array_equal(_direction(np.zeros(3)), np.zeros(3))


def test_a_line_that_would_float_between_ends_above_the_water_weighs_what_it_does_in_air():
    """Not one whose ends are in the water, nor one that would sink."""
    light = LINE | {"line_density": 1.0, "elements": 2}
    found = []
    for cable, z in ((light, 2.0), (light, -2.0), (LINE, 2.0)):
        top = {"kind": "fixed", "position": [40.0, 0.0, z]}
        scene = load_scene({"sea": SEA, "cable": cable | {"anchor": [0.0, 0.0, z], "top": top}})
        problem = Problem(scene, dynamic=False, comm=MPI.COMM_SELF)
        (piece,) = still_network(problem).pieces
        found.append(piece.w)
        problem.destroy()
    displaced = 1000 * math.pi / 4 * 0.05**2
    np.testing.assert_allclose(found, [9.81, (1 - displaced) * 9.81, (5 - displaced) * 9.81], rtol=1e-12)


def clamped(**more):
    """A line held in directions between a place and a buoy, beside another buoy and a joint."""
    own = {"from_end": {"direction": [1.0, 0.0, 0.0]}, "to_end": {"direction": [0.6, 0.0, 0.8]}}
    cables = [LINE | {"name": "rod", "from": PLACE, "to": "a", "bending_stiffness": 10.0} | own]
    cables += [LINE | {"name": "rope", "from": "J", "to": [40.0, 0.0, -20.0]}]
    devices = [{"from": "J", "to": "a"}, {"from": "b", "to": "J"}, {"from": "a", "to": "b"}]
    devices = [one | {"name": f"d{k}", "stiffness": 10.0, "length": 6.0} for k, one in enumerate(devices)]
    buoys = [HULL | {"name": name} | more for name in "ab"]
    return load_scene({"sea": SEA, "cable": cables, "joint": [{"name": "J"}], "buoy": buoys, "take_off": devices})


POSES = {"a": (np.array([1.0, 2.0, -0.5]), QUARTER), "b": (np.array([9.0, 2.0, -0.25]), UPRIGHT)}


def test_buoys_that_are_held_are_ends_with_directions_that_turn():
    """Of take-offs those stay that end at a joint."""
    scene = with_buoys_held(clamped(mooring_height=0.25), POSES)
    assert (scene.buoy, scene.wind, scene.external_force) == (None, None, None)
    rod, rope = scene.cables
    assert (rod.to, rope.to) == ((1.0, 2.0, -0.5), (40.0, 0.0, -20.0))
    assert rod.from_end.direction == (1.0, 0.0, 0.0)
    np.testing.assert_allclose(rod.to_end.direction, [0.0, 0.6, 0.8], atol=1e-14)
    first, second = scene.take_off
    ends = [[getattr(device, key) for key in ("from", "to")] for device in (first, second)]
    assert ends == [["J", (1.0, 2.0, -0.5)], [(9.0, 2.0, -0.25), "J"]]
    apart = load_scene({"sea": SEA, "cable": LINE | {"anchor": PLACE, "to": "a"}, "buoy": [HULL | {"name": "a"}]})
    assert with_buoys_held(apart, POSES).take_off is None


def test_numbers_of_ends_where_lines_and_take_offs_begin():
    """Place and force of each, the direction of a clamp as the buoy has turned, no moment; a joint has its place."""
    network = clamped(mooring_height=0.5).network
    forces = {"anchor_force": np.ones((2, 3)), "end_tension": np.array([[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]])}
    (rod,) = _moorings(network, POSES, forces)
    np.testing.assert_allclose(rod, [1, 2, -0.25, -3, -4, -5, 0, 0.6, 0.8, 0, 0, 0], atol=1e-14)
    at_joint, _, between = (_at_ends(network, device, POSES) for device in network.take_offs.values())
    np.testing.assert_allclose(at_joint, [0, 0, 0, 1, 2, -0.25, 0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(between, [1, 2, -0.25, 0, 0, 0, 9, 2, 0, 0, 0, 0], atol=1e-14)


@pytest.mark.parametrize("given", [None, BuoyStart()])
def test_a_pose_must_be_given(given):
    """Its quaternion may have any length."""
    with pytest.raises(InputError, match="buoy_position: must be given"):
        given_pose(given)
    place, q4 = given_pose(BuoyStart(buoy_position=[1.0, 2.0, 3.0], buoy_orientation=[0.0, 0.0, 3.0, 4.0]))
    np.testing.assert_array_equal(place, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(q4, [0.0, 0.0, 0.6, 0.8], rtol=1e-15)
    np.testing.assert_array_equal(given_pose(BuoyStart(buoy_position=[0.0, 0.0, 0.0]))[1], UPRIGHT)


@pytest.mark.parametrize("velocity", [None, [0.1, 0.0, 0.0]])
def test_take_offs_begin_where_buoys_are_put(velocity):
    """Of buoys alone that are not at rest; without any force yet."""
    initial = {"buoy_position": [0.5, 0.0, -0.6]} | ({"buoy_velocity": velocity} if velocity else {})
    scene = {"sea": SEA, "buoy": HULL | {"name": "a", "initial": initial}}
    scene |= {"take_off": {"from": PLACE, "to": "a", "stiffness": 10.0, "length": 49.0}}
    start = initial_state(load_scene(scene), MPI.COMM_SELF)
    (numbers,) = start.take_offs
    np.testing.assert_allclose(numbers[-6:], [0.5, 0.0, -0.85, 0.0, 0.0, 0.0], atol=1e-12)
    assert not start.at_rest


# -- motions ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gravity", "acceleration"), [(9.81, 9.81), (0.0, 7.0 / 500.0)])
def test_scales_of_buoys_alone(gravity, acceleration):
    """Places of all, the longest hull, the heaviest mass."""
    hulls = [
        Fake(hull=[[0, 2], [3, 1]], mass=500.0),
        Fake(hull=None, mass=200.0),
        Fake(hull=[[0, 4], [1, 4]], mass=9.0),
    ]
    problem = Fake(lines=None, typical_force=7.0, scene=Fake(gravity=gravity), comm=MPI.COMM_SELF)
    problem.network = Fake(buoys=dict(zip("abc", hulls, strict=True)))
    parts = [Fake(part=Fake(slice=slice(first, first + 7))) for first in (2, 10, 20)]
    problem.buoys, problem.attached_to = dict(zip("abc", parts, strict=True)), lambda buoy: buoy is parts[1]
    scale = Scale.of(problem)
    assert (scale.places.tolist(), scale.length, scale.acceleration) == ([2, 3, 4, 20, 21, 22], 4, acceleration)
    assert scale.period == pytest.approx(math.sqrt(4 / acceleration))
    moved = np.zeros(30)
    moved[[3, 7, 12, 22]] = [0.5, 9.0, 9.0, -0.75]
    assert scale.farthest(problem, moved) == 0.75
    problem.network.buoys = {"b": hulls[1]}
    assert Scale.of(problem).length == 1.0


class Moving:
    """A problem of one unknown whose steps end as they are told to: how far it moves, or None where it fails."""

    def __init__(self, monkeypatch, *steps, rest=False):
        self.told, self.held, self.scales, self.iterations, self.asked = iter(steps), [], [], 0, []
        monkeypatch.setattr(damped.interruption, "check", lambda: self.asked.append(0))
        self.system = Fake(u=np.zeros(1))
        self.models = [Fake(hold=lambda at, h: self.held.append((float(at[0]), h)), let_go=lambda: None)]
        self.newton = Fake(set_scales=self.scales.append, solve=self.solve, approach=self.approach)
        scale = Fake(period=1.0, farthest=lambda _, moved: abs(float(moved[0])), is_rest=lambda *_: rest)
        monkeypatch.setattr(damped, "Scale", Fake(of=lambda problem: scale))

    def solve(self):
        step = next(self.told)
        if step is None:
            raise SolveError("it diverged")
        self.system.u += step
        return 2

    def approach(self, most):
        step, solved = next(self.told, (None, None))
        if step is None:
            raise SolveError("no step")
        self.system.u += step
        return most - 1, solved


def test_a_motion_that_fails_goes_on_in_smaller_steps_from_rest(monkeypatch):
    """Five times as small ones; with momentum each aims where the last one led."""
    problem = Moving(monkeypatch, 0.1, 0.2, None, 0.4, None, None)
    with pytest.raises(SolveError, match="after 5 steps of a damped motion something still moves"):
        damped.relax(problem, growth=1.5, steps=5, momentum=True)
    h = np.array([1e-2, 1.5e-2, 1.5**2 * 1e-2, 1e-2 / 1.5**2, 1e-2 / 1.5])
    aims = [0.0, 0.1 + 1.5 * 0.1, 0.3 + 1.5 * 0.2, 0.3, 0.7 + 1.5 * 0.4]
    np.testing.assert_allclose(problem.held, np.column_stack([aims, h]), rtol=1e-14)
    np.testing.assert_allclose(problem.scales, [*1 / h, 1.0], rtol=1e-14)
    assert (problem.iterations, len(problem.asked)) == (6, 5)
    plain = Moving(monkeypatch, 0.1, 0.2, 0.3)
    with pytest.raises(SolveError, match="after 3 steps"):
        damped.relax(plain, steps=3)
    np.testing.assert_allclose([at for at, _ in plain.held], [0.0, 0.1, 0.3], rtol=1e-14)


def test_a_motion_ends_with_steps_ten_thousand_times_as_small(monkeypatch):
    problem = Moving(monkeypatch, *[None] * 30)
    with pytest.raises(SolveError, match="it diverged"):
        damped.relax(problem, growth=2.0)
    np.testing.assert_allclose([h for _, h in problem.held], 1e-2 / 16.0 ** np.arange(4), rtol=1e-14)


def test_large_steps_grow_as_the_speed_falls(monkeypatch):
    """Nine times as large where solved and nine times as small where not; a limit of three for the rest."""
    steps = (1.0, False), (1.5, False), (1.5, False), (9.0, False), (None, None), (0.1, True)
    problem = Moving(monkeypatch, *steps)
    with pytest.raises(SolveError, match="after 6 steps something still moves"):
        damped.approach(problem, 0.5, steps=6, most=4, growth=3.0)
    # speeds 2, 3, 4.5, 40.5
    h = np.array([0.5, 0.5, 1 / 3, 2 / 9, 2 / 27, 2 / 243])
    np.testing.assert_allclose(problem.held, np.column_stack([[0.0, 1.0, 2.5, 4.0, 13.0, 13.0], h]), rtol=1e-14)
    assert (problem.iterations, len(problem.asked)) == (3 * 5 + 4, 6)
    resting = Moving(monkeypatch, (1.0, False), (1.0, True), rest=True)
    damped.approach(resting, 0.5, most=4)
    assert (resting.iterations, resting.scales[-1]) == (6, 1.0)


# -- marches ----------------------------------------------------------------------------------------------------------


def test_a_load_is_reached_in_halves_where_newton_fails(monkeypatch):
    """From what was reached last; a sixteenth is the smallest step."""
    asked, state = [], Fake(reached=0.0, target=0.0)

    def solve():
        if state.target - problem.system.u[0] > 0.3:
            problem.system.u[0] = 77.0
            raise SolveError("too far")
        problem.system.u[0] = state.target

    problem = Fake(system=Fake(u=np.zeros(1)), newton=Fake(solve=solve), set_time=lambda t: None)
    problem.change = lambda size: (asked.append(size), setattr(state, "target", size))
    turned = []
    monkeypatch.setattr(offsets, "let_turn", lambda problem: turned.append(float(problem.system.u[0])))
    offsets._march(problem, lambda size: size, 0.0, 1.0)
    assert asked == [1.0, 0.5, 0.25, 0.5, 1.0, 0.75, 1.0]
    assert (problem.system.u[0], turned) == (1.0, [0.25, 0.5, 0.75, 1.0])
    asked.clear()
    problem.system.u[0] = 0.0
    with pytest.raises(SolveError):
        offsets._march(problem, lambda size: size, 0.0, 16.0)
    assert asked == [16.0, 8.0, 4.0, 2.0, 1.0]


def test_a_march_gives_up_where_no_sixteenth_leads_on(monkeypatch):
    """Behind what was reached in larger steps too: each half has one halving less than the whole."""
    asked = []

    def solve():
        if asked[-1] > 9.5:
            raise SolveError("nothing holds it")

    problem = Fake(system=Fake(u=np.zeros(1)), newton=Fake(solve=solve), set_time=lambda t: None, change=asked.append)
    monkeypatch.setattr(offsets, "let_turn", lambda problem: None)
    with pytest.raises(SolveError, match="nothing holds it"):
        offsets._march(problem, lambda size: size, 0.0, 16.0)
    assert asked == [16.0, 8.0, 16.0, 12.0, 10.0, 9.0, 10.0]


def test_growth_goes_a_share_of_its_way_that_newton_can_follow(monkeypatch):
    """From the last rest, then from nowhere, then less and less; what is compressed is none, if the last was not."""
    shares, fails = [], Fake(until=1.0)

    def solve():
        shares.append(float(problem.lines.growth.factors[0]))
        if shares[-1] > fails.until:
            problem.system.u[0] = 5.0
            raise SolveError("it diverged")
        return 3

    def rest():
        shares.append("nowhere")
        problem.iterations = 7
        if fails.until < 1.0:
            raise SolveError("no rest")

    problem = Fake(system=Fake(u=np.zeros(1)), newton=Fake(solve=solve), iterations=10, comm=MPI.COMM_SELF)
    problem.lines = Fake(growth=Fake(factors=None))
    monkeypatch.setattr(growth, "is_compressed", lambda problem: False)
    arguments = problem, np.array([0.0]), np.array([1.0]), 0.8, rest
    assert (growth._go(*arguments), shares, problem.iterations) == (0.8, [0.8], 13)
    shares.clear()
    fails.until, problem.iterations = 0.3, 10
    assert (growth._go(*arguments), shares) == (0.2, [0.8, "nowhere", 0.4, 0.2])
    shares.clear()
    fails.until = 0.0
    with pytest.raises(SolveError, match=r"do not come to agree .*: it diverged$"):
        growth._go(*arguments)
    np.testing.assert_allclose(shares[2:], 0.8 / 2.0 ** np.arange(1, 12), rtol=1e-14)
    assert problem.system.u[0] == 0.0
    shares.clear()
    monkeypatch.setattr(growth, "is_compressed", lambda problem: len(shares) == 1)
    fails.until, problem.iterations = 1.0, 10
    assert (growth._go(*arguments), shares, problem.iterations) == (0.8, [0.8, "nowhere"], 7 + 10)


def test_ends_are_turned_there_where_they_are_far(monkeypatch):
    """From the direction of the first or the last nodes; at once where it is nearer than 1 rad."""
    nodes = np.arange(12).reshape(4, 3)
    direction = {0: Fake(value=np.array([0.0, 0.0, 1.0])), 1: Fake(value=np.array([0.0, 1.0, 0.0]))}
    group = Fake(clamps={(0, end): (direction[end], None) for end in (0, 1)}, owns_end=lambda piece, end: True)
    group.nodes_of, group.node_s = {0: np.array([0, 2, 1, 3])}, np.array([0.0, 1.0, 2.0, 3.0])
    group.part, group.node_dofs = Fake(slice=slice(2, 14)), nodes
    u = np.concatenate([[7.0, 7.0], [0, 0, 0], [2, 0, 0], [5, 0, 0], [5, 3, 0]]).astype(float)
    problem, done = Fake(lines=Fake(groups=[group]), system=Fake(u=u), comm=MPI.COMM_SELF), []

    def march(problem, turn):
        for x in (0.0, 0.5, 1.0):
            turn(x)
            done.append([direction[end].value.copy() for end in (0, 1)])

    monkeypatch.setattr(ways, "march", march)
    monkeypatch.setattr(ways, "newton", lambda problem: done.append("newton"))
    ways.directly(problem)
    half = math.sqrt(0.5)
    turned = [[[1, 0, 0], [0, 1, 0]], [[half, 0, half], [0, 1, 0]], [[0, 0, 1], [0, 1, 0]]]
    np.testing.assert_allclose(done, turned, atol=1e-15)
    done.clear()
    direction[0].value[:] = [math.cos(0.9), 0.0, math.sin(0.9)]
    ways.directly(problem)
    assert done == ["newton"]
    u[5:8] = u[2:5]
    with pytest.raises(SolveError, match="elements of no length"):
        ways.directly(problem)


def test_what_bends_begins_as_what_does_not(monkeypatch):
    """Only lines that have a stiffness."""
    rods = [Fake(moment_dofs=dofs, share_of_bending=Fake(value=1.0)) for dofs in ([1], None)]
    monkeypatch.setattr(ways, "march", lambda problem, bend: bend(0.25))
    ways.by_bending(Fake(lines=Fake(groups=rods)))
    assert [rod.share_of_bending.value for rod in rods] == [0.25, 1.0]


def test_a_buoy_at_the_tip_of_a_rod_goes_on_from_it():
    """Turned from its own direction to that of the last link, or of the first."""
    end = Fake(clamp=Fake(unit=[0.0, 0.0, 1.0]), name="a")
    bent = [
        Fake(places=np.array(places, float)) for places in ([[0, 0, 0], [0, 2, 0], [0, 2, 1]], [[0, 2, 1], [3, 2, 1]])
    ]
    half = math.sqrt(0.5)
    found = [_Chain.turned_buoy(Fake(tip=tip, at_tip=end), bent)["a"] for tip in (0, 1)]
    np.testing.assert_allclose(found, [[half, -half, 0, 0], [half, 0, half, 0]], atol=1e-15)
    assert _Chain.turned_buoy(Fake(tip=None, at_tip=end), bent) == {}
    assert _Chain.turned_buoy(Fake(tip=1, at_tip=Fake(clamp=None)), bent) == {}
