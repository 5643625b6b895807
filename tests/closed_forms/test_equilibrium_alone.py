"""Network equations and decisions of the equilibrium search, each alone: slopes, growth tables, yaw, refusals.

Source: finite differences of the same functions, quadrature with scipy, the same numbers by hand; made-up solves.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.statics import equilibrium, growth, ways
from dolfbuoy.statics.equilibrium import _check_determined, let_turn
from dolfbuoy.statics.first_shape import SAME, _along, _check_length, _check_place, points_of
from dolfbuoy.statics.network import Joint, Network, Piece
from dolfbuoy.statics.network_equations import Equations, _integral_of_one_over_T, _pair, _solved
from dolfbuoy.statics.offsets import loaded
from dolfbuoy.statics.on_bed import UP, Bed
from dolfbuoy.statics.start import _Ball, _drag, _Floating, _overturns, leaves_water

INF = math.inf
SEA = {"depth": 50.0, "density": 1000.0}


# -- equations of networks --------------------------------------------------------------------------------------------


def load(position):
    """A force that turns with the place, and its derivative."""
    x, y, z = position
    return np.array([y * z, -x, -30.0 - z**2]), np.array([[0, z, y], [-1, 0, 0], [0, 0, -2 * z]])


BEDDED = Network(
    [
        Joint((0.0, 0.0, -20.0)),
        Joint(free=True, load=load),
        Joint(free=True, load=(1.0, 2.0, -3.0)),
        Joint((30.0, 5.0, 2.0)),
    ],
    [
        Piece(0, 1, 15.0, 8.0, 1e3, end_offset=(0.3, 0.0, -0.5)),
        Piece(1, 2, 12.0, -4.0, 2e3, start_offset=(0.0, 0.2, 0.1)),
        Piece(2, 3, 20.0, 3.0, INF, drag=(2.0, -1.0, 0.5)),
        Piece(2, 0, 25.0, 2.0, 5e2),
    ],
    Bed(UP, -20.0),
)
AFLOAT = Network(
    [Joint((0.0, 0.0, -5.0)), Joint(free=True, load=(4.0, 1.0, 0.0)), Joint(free=True, load=(-1.0, 0.0, 0.5))],
    [Piece(0, 1, 9.0, -2.0, 1e3), Piece(1, 2, 6.0, -1.0, 4e2)],
    None,
    surface=0.0,
)


@pytest.mark.parametrize("network", [BEDDED, AFLOAT], ids=["on a bed", "under the surface"])
@pytest.mark.parametrize("eps", [1.0, 1e-2])
def test_slopes_of_equations_are_their_differences(network, eps):
    """Of every equation by every unknown: places, tensions, heights and reactions."""
    equations = Equations(network)
    y = np.random.default_rng(4).normal(size=equations.slices[-1].stop)
    y[equations.slices[0]] = equations.held[equations.free].ravel() + 0.1 * y[equations.slices[0]]
    _, jacobian = equations.evaluate(y, eps, 0.3 * eps, jacobian=True)
    step = 1e-6
    units = np.eye(len(y)) * step
    sides = [[equations.evaluate(y + s * e, eps, 0.3 * eps) for e in units] for s in (1, -1)]
    expected = (np.array(sides[0]) - np.array(sides[1])).T / (2 * step)
    np.testing.assert_allclose(jacobian, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())
    assert np.abs(expected).max() > 1


@pytest.mark.parametrize(
    ("w", "V0", "length", "H"),
    [(2.0, 5.0, 3.0, 1.0), (2.0, -5.0, 3.0, 1.0), (2.0, -2.0, 3.0, 0.1), (1e-6, 3.0, 2.0, 4.0), (-2.0, 1.0, 3.0, 0.5)],
)
def test_integral_of_one_over_the_tension(w, V0, length, H):
    """Over what hangs, whether V changes its sign or hardly changes at all."""
    V1 = V0 + w * length
    arrays = [np.array([x]) for x in (V0, V1, math.hypot(H, V0), math.hypot(H, V1), H, w, length)]
    expected = quad(lambda s: 1 / math.hypot(H, V0 + w * s), 0.0, length, epsabs=0, epsrel=1e-13)[0]
    assert _integral_of_one_over_T(*arrays)[0] == pytest.approx(expected, rel=1e-12)


def test_a_pair_is_zero_where_one_of_two_is():
    """a b = eps of two that are positive, and the derivatives of that."""
    np.testing.assert_allclose(_pair(np.array([2.0]), np.array([0.5]), 1.0)[0], 0.0, atol=1e-15)
    a, b, eps = np.array([0.3]), np.array([-0.8]), 0.1
    found, by_a, by_b = _pair(a, b, eps)
    assert by_a[0] == pytest.approx((_pair(a + 1e-6, b, eps)[0] - _pair(a - 1e-6, b, eps)[0])[0] / 2e-6, rel=1e-6)
    assert by_b[0] == pytest.approx((_pair(a, b + 1e-6, eps)[0] - _pair(a, b - 1e-6, eps)[0])[0] / 2e-6, rel=1e-6)
    assert found[0] == pytest.approx(-0.5 - math.sqrt(0.09 + 0.64 + 0.2))
    assert np.isinf(_solved(np.zeros((2, 2)), np.ones(2))).all()


def test_lengths_that_lie():
    """d = eps (1/l - 1/(L - l)) of each; none of what touches nothing."""
    equations = Equations(BEDDED)
    assert equations.touches.tolist() == [True, False, False, True]
    L, eps = equations.L, 0.05
    lying = equations.lying(np.array([0.4, 1.0, 1.0, -0.7]), eps)
    assert not lying[1:3].any()
    for d, length, whole in zip((0.4, -0.7), lying[[0, 3]], L[[0, 3]], strict=True):
        assert d == pytest.approx(eps * (1 / length - 1 / (whole - length)), rel=1e-9)


@pytest.mark.parametrize("z", [-3.0, -0.9, -0.5, 0.0, 0.4, 0.9, 3.0])
def test_slopes_of_what_floats(z):
    """Of a ball of 1 m radius that leaves the water, and of a hull; by hand where all or nothing is wet."""
    volume = 4 / 3 * math.pi
    scene = load_scene({"sea": SEA, "buoy": {"hull": [[0, 2], [1, 3], [2, 1]], "mass": 900.0, "center_of_mass": 0.5}})
    ball = _Ball(scene, Fake(volume=volume, mass=700.0, drag_area=2.0), np.array([10.0, 0.0, 0.0]))
    hull = _Floating(scene, scene.network.buoys["buoy"], np.zeros(3))
    for one, top in ((ball, 1.0), (hull, 0.5)):
        found, slope = one(np.array([5.0, 6.0, z]))
        above, below = (one(np.array([5.0, 6.0, z + h]))[0] for h in (1e-5, -1e-5))
        np.testing.assert_allclose(slope[:, 2], (above - below) / 2e-5, rtol=1e-5, atol=1e-3)
        assert not slope[:, :2].any()
        if z == 3.0:
            assert top < 3.0
            assert found[2] == pytest.approx(-9.81 * (700.0 if one is ball else 900.0), rel=1e-12)
    force = ball(np.array([0.0, 0.0, z]))[0]
    assert force[0] == 20.0
    cap = min(max(1.0 - z, 0.0), 2.0)  # height of what is under water
    assert force[2] == pytest.approx(9.81 * (1000 * math.pi * cap**2 * (3 - cap) / 3 - 700.0), rel=1e-12)


def test_mean_drag_of_a_current_on_a_line():
    """Across and along a straight line; none of one that has no coefficient or no diameter."""
    scene = load_scene("short", sea=SEA, current={"speed": 2.0, "profile": "uniform"}, waves=None)
    way = np.array([0.6, 0.0, 0.8])
    shape = Fake(position=lambda s: np.array([0.0, 0.0, -40.0]) + 1.1 * np.multiply.outer(s, way))
    c = Fake(diameter=0.1, normal_drag=1.2, tangential_drag=0.05, length=10.0)
    problem = Fake(scene=scene, lines=Fake(sections=[c]))
    along = 1.2 * way
    across = np.array([2.0, 0.0, 0.0]) - along
    expected = 0.5 * 1000 * 0.1 * 1.1 * (1.2 * np.linalg.norm(across) * across + 0.05 * 1.2 * along)
    np.testing.assert_allclose(_drag(problem, 0, shape), expected, rtol=1e-12)
    c.normal_drag = 0.0
    np.testing.assert_allclose(_drag(problem, 0, shape), 0.5 * 1000 * 0.1 * 1.1 * 0.05 * 1.2 * along, rtol=1e-12)
    c.tangential_drag = 0.0
    assert not _drag(problem, 0, shape).any()
    c.normal_drag, c.diameter = 1.2, None
    assert not _drag(problem, 0, shape).any()


@pytest.mark.parametrize(("pull", "overturned"), [(-5.0, False), (0.0, False), (5.0, True)])
def test_a_buoy_in_air_hangs_below_what_holds_it(pull, overturned):
    """Its mooring point is 0.5 m below C: a line that pulls it upwards there turns it over; not in water."""
    buoy = {"mass": 9.0, "center_of_mass": 0.5, "inertia": [1.0, 1.0]}
    cable = {"length": 10.0, "line_density": 1.0, "diameter": 0.01, "elements": 1, "anchor": [0.0, 0.0, 0.0]}
    for sea in ({}, {"sea": SEA}):
        scene = load_scene({"cable": cable, "buoy": buoy | ({"hull": [[0, 1], [1, 1]]} if sea else {})} | sea)
        start = Fake(
            problem=Fake(network=scene.network, scene=scene), end=lambda k, i: (None, np.array([0.0, 0.0, pull]))
        )
        assert _overturns(start, "buoy") is (overturned and not sea)


@pytest.mark.parametrize("dry", [True, False])
def test_whether_lines_leave_the_water_is_said_by_the_scene(dry):
    assert leaves_water(load_scene("short", **{"sea.dry_above": dry})) is dry


def test_what_cannot_be_is_refused_before_anything_is_made(monkeypatch):
    def refuses(scene):
        raise InputError("it cannot be")

    monkeypatch.setattr(equilibrium, "check_feasible", refuses)
    with pytest.raises(InputError, match="it cannot be"):
        equilibrium.solve_equilibrium(load_scene("short"), MPI.COMM_SELF, None)


# -- growth -----------------------------------------------------------------------------------------------------------


def test_growth_settles_by_aitkens_rule(monkeypatch):
    """Factors go to 0.6 f + c by shares of 1, then 1/(1 - 0.6) of the way, which is all of it; at most the whole."""
    goal, gone = np.array([2.0, 3.0]), []
    table = Fake(factors=None, of_the_water=lambda: np.zeros(2))
    table.at = lambda u: goal + slope[0] * (table.factors - goal)
    problem, slope = Fake(lines=Fake(growth=table), system=Fake(u=None), comm=MPI.COMM_SELF), [-0.5]

    def go(problem, now, way, share, rest):
        gone.append(share)
        table.factors = now + share * way
        return share

    monkeypatch.setattr(growth, "_go", go)
    rests = []
    growth.settle(problem, lambda: rests.append(table.factors.copy()))
    np.testing.assert_allclose(table.factors, goal, rtol=1e-8)
    np.testing.assert_allclose(gone, [1.0, 1 / 1.5], rtol=1e-12)
    np.testing.assert_array_equal(rests, [np.zeros(2)])
    gone.clear()
    slope[0] = np.array([-0.5, 0.2])  # ways (3, 2.4) and (-1.5, 0.48), which turn by (-4.5, -1.92)
    growth.settle(problem, lambda: None)
    np.testing.assert_allclose(gone[:2], [1.0, (3 * 4.5 + 2.4 * 1.92) / (4.5**2 + 1.92**2)], rtol=1e-12)
    np.testing.assert_allclose(table.factors, goal, rtol=1e-8)
    gone.clear()
    slope[0] = 0.6
    monkeypatch.setattr(growth, "ROUNDS", 3)
    with pytest.raises(SolveError, match=r"do not come to agree .* in 3 rounds"):
        growth.settle(problem, lambda: None)
    assert gone == [1.0, 1.0, 1.0]
    gone.clear()
    slope[0] = -99.0
    with pytest.raises(SolveError):
        growth.settle(problem, lambda: None)
    np.testing.assert_allclose(gone, [1.0, 0.02, 0.02], rtol=1e-12)


# -- yaw --------------------------------------------------------------------------------------------------------------


class Turning:
    """A problem of one buoy with a fairlead, which each solve turns by what it is told to, or that fails."""

    def __init__(self, *turns, fairlead="north", left=1.0):
        self.turns, self.gauges, self.iterations, self.comm = iter(turns), [], 0, MPI.COMM_SELF
        self.network = Fake(pieces=[Fake(ends=(Fake(fairlead=fairlead),))], take_offs={})
        self.system = Fake(u=np.zeros(7), residual_by_block=lambda: dict.fromkeys(BLOCKS, 0.0) | {BLOCKS[1]: left})
        self.newton, self.take_offs_on = Fake(solve=self.solve), lambda buoy: []
        fields = Fake(of=lambda u: Fake(position=u[:3], orientation=u[3:]))
        buoy = Fake(
            reference=Fake(x=Fake(array=np.ones(7))), part=Fake(slice=slice(0, 7)), gauge=Fake(value=1.0), fields=fields
        )
        self.buoys = {"buoy": buoy}

    def solve(self):
        self.gauges.append(self.buoys["buoy"].gauge.value)
        turn = next(self.turns)
        if turn is None:
            raise SolveError("it turns")
        self.system.u[3:] += turn
        self.system.u[:3] += 1.0  # a place counts with take-offs only
        return 2


BLOCKS = ("buoy torque balance", "buoy position r_C")


def test_a_yaw_is_found_as_what_holds_it_goes_away(monkeypatch):
    """By a tenth each time, until it is still; else in a damped motion, unless nothing else held it."""
    relaxed = []
    monkeypatch.setattr(equilibrium, "relax", lambda problem, **motion: relaxed.append(motion))
    problem = Turning(0.1, 1e-3, 0.9e-11)
    let_turn(problem)
    np.testing.assert_allclose(problem.gauges, [0.1, 0.01, 1e-3], rtol=1e-12)
    np.testing.assert_allclose(problem.buoys["buoy"].reference.x.array[3:], 0.101, rtol=1e-12)
    assert (problem.iterations, relaxed) == (6, [])
    held = Turning(0.1, None, left=0.9e-8)
    let_turn(held)
    assert (held.iterations, relaxed) == (2, [])
    turning = Turning(0.1, None, left=1.1e-8)
    let_turn(turning)
    assert relaxed == [{"growth": 1.1, "steps": 900}]
    assert turning.buoys["buoy"].gauge.value == pytest.approx(1e-11)
    never = Turning(*[1.1e-11] * 20)
    let_turn(never)
    assert (len(never.gauges), len(relaxed)) == (20, 2)
    axis = Turning(fairlead=None)
    let_turn(axis)
    assert axis.gauges == []

    def fails(problem, **motion):
        raise SolveError("it spins")

    monkeypatch.setattr(equilibrium, "relax", fails)
    with pytest.raises(SolveError, match=r"^the yaw and the places of the buoys were not found: it spins$"):
        let_turn(Turning(None))


def test_ways_that_suit_buoys_alone():
    """Nothing is looked for in lines that are not there."""
    problem = Fake(lines=None, law=None, scene=Fake(current=None), network=Fake(bends=False, pieces=[]))
    assert [way.name for way in ways.WAYS if way.suits(problem)] == ["newton", "relaxation", "damped motion"]


# -- what is refused --------------------------------------------------------------------------------------------------


def determined(data):
    """What is said against an equilibrium of a scene; None: nothing."""
    scene = load_scene(data)
    try:
        _check_determined(Fake(scene=scene, network=scene.network))
    except InputError as error:
        return str(error).partition(":")[0]
    return None


def spanning(length, **more):
    top = {"kind": "fixed", "position": [3.0, 0.0, 4.0]}
    return {
        "cable": {"length": length, "line_density": 1.0, "elements": 2, "anchor": [0.0, 0.0, 0.0], "top": top} | more
    }


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (spanning(5.0), "cable.length = 5.0"),
        (spanning(5.0 * (1 + 1e-9)), None),
        (spanning(5.0, axial_stiffness=1e5), None),
        (spanning(5.1, axial_stiffness=1e5) | {"gravity": 0.0}, "cable.line_density = 1.0"),
        (spanning(5.0, axial_stiffness=1e5) | {"gravity": 0.0}, None),
        (spanning(5.1, axial_stiffness=1e5, bending_stiffness=1.0) | {"gravity": 0.0}, None),
        (spanning(5.1, top={"kind": "free"}) | {"gravity": 0.0}, "cable.top.force = [0.0, 0.0, 0.0]"),
        (spanning(5.1, top={"kind": "free", "force": [0, 0, 1]}) | {"gravity": 0.0}, None),
        (spanning(5.1, top={"kind": "free"}), None),
    ],
)
def test_what_leaves_a_tension_or_a_place_open(data, said):
    assert determined(data) == said


@pytest.mark.parametrize(
    ("lengths", "said"),
    [
        ([2.0, 3.0], "Inextensible cables 5 m long together lead from [0.0, 0.0, 0.0] to [3.0, 0.0, 4.0]"),
        ([2.0, 3.0 + 1e-8], None),
        ([9.0, 3.0, 2.0], "Inextensible cables 5 m long together lead from [0.0, 0.0, 0.0] to [3.0, 0.0, 4.0]"),
        ([9.0, 3.0, 2.1], None),
        ([1.0, 3.0, 9.0], "Inextensible cables 4 m long together lead from [0.0, 0.0, 0.0] to [3.0, 0.0, 4.0]"),
    ],
)
def test_inextensible_cables_that_are_taut_together(lengths, said):
    """By way of joints; of two between the same ends the shorter counts."""
    ends = [([0.0, 0.0, 0.0], "J"), ("J", [3.0, 0.0, 4.0]), ([0.0, 0.0, 0.0], "J")]
    cables = [
        {"name": f"c{k}", "from": low, "to": high, "length": length, "line_density": 1.0, "elements": 2}
        for k, (length, (low, high)) in enumerate(zip(lengths, ends, strict=False))
    ]
    assert determined({"cable": cables, "joint": [{"name": "J"}]}) == said


@pytest.mark.parametrize("stretches", [0, 1])
def test_cables_that_stretch_may_be_taut(stretches):
    """One of two is enough."""
    ends = [([0.0, 0.0, 0.0], "J"), ("J", [3.0, 0.0, 4.0])]
    cables = [
        {"name": f"c{k}", "from": low, "to": high, "length": length, "line_density": 1.0, "elements": 2}
        for k, (length, (low, high)) in enumerate(zip((2.0, 3.0), ends, strict=True))
    ]
    cables[stretches]["axial_stiffness"] = 1e5
    assert determined({"cable": cables, "joint": [{"name": "J"}]}) is None


def test_a_current_is_scaled_by_its_speed_at_the_upper_end():
    """Of a table of three rows the last, and all of them with it."""
    rows = [[-40.0, 0.1], [-20.0, 0.2], [0.0, 0.8]]
    scene = load_scene("short", current={"speed": None, "profile": rows})
    found = loaded(scene, "current", 1.6, 45.0).current
    np.testing.assert_allclose(found.profile, [[-40.0, 0.2], [-20.0, 0.4], [0.0, 1.6]], rtol=1e-14)
    assert found.direction_deg == 45.0


def test_places_and_lengths_of_first_shapes():
    """To a millionth of a length; an elastic line may have any but none."""
    points, kind = [np.zeros(3), np.array([1.0, 0.0, 0.0])], Fake(initial=Fake(kind="polyline"))
    _check_place(points, "key", 1, np.array([1.0 + 0.99e-5, 0.0, 0.0]), 10.0, "must be")
    with pytest.raises(InputError, match=r"^key\[1\] = \(1\.0, 0\.0, 0\.0\): must be \(1\.0000101, 0\.0, 0\.0\)\.$"):
        _check_place(points, "key", 1, np.array([1.0 + 1.01e-5, 0.0, 0.0]), 10.0, "must be")
    _check_length(kind, points, "cable", 1.0 + 0.99 * SAME, elastic=False)
    _check_length(kind, points, "cable", 7.0, elastic=True)
    with pytest.raises(InputError, match=r"must keep its cable\.length = 7 m"):
        _check_length(kind, points, "cable", 7.0, elastic=False)
    with pytest.raises(InputError, match="not one point"):
        _check_length(kind, [np.zeros(3)] * 2, "cable", 7.0, elastic=True)
    shape = _along([np.zeros(3), np.array([0.0, 3.0, 0.0]), np.array([0.0, 3.0, 1.0])], 8.0, 2.0)
    np.testing.assert_allclose(shape(np.array([0.0, 4.0, 5.0])), [[0, 1, 0], [0, 3, 0], [0, 3, 0.5]], atol=1e-14)


def test_points_of_several_cables_have_names():
    two, one = (Fake(network=Fake(cables=names), initial=Fake(points=None)) for names in (["a", "b"], ["a"]))
    assert points_of(one, 0) == []
    for scene, given in ((two, None), (two, {"a": []}), (one, {"a": [], "c": []})):
        scene.initial.points = given
        with pytest.raises(InputError, match=r"^initial\.points"):
            points_of(scene, len(scene.network.cables) - 1)
    two.initial.points = {"a": [[0, 0, 0]], "b": [[1, 2, 3]]}
    np.testing.assert_array_equal(points_of(two, 1), [[1, 2, 3]])
