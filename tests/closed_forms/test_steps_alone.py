"""Parts of solvers and searches, each alone: initial drag, arc lengths, drift, the pilot's search.

Source: Morison's equation by hand; summed arc lengths; radii of gyration; damped oscillators; the rules as written.
"""

import inspect
import math
from types import SimpleNamespace

import numpy as np
import pytest
from dynamics_helpers import rotation_matrix
from mpi4py import MPI
from scipy.sparse import csr_matrix

from dolfbuoy import linear_api, load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.linear import periods
from dolfbuoy.linear.drag import _crossing
from dolfbuoy.linear.layout import MOTION, Body, _inextensible_tensions
from dolfbuoy.linear.moving import Motions, Moving, _changes_of_sign
from dolfbuoy.linear.natural import lowest_modes
from dolfbuoy.linear.radiated import Radiated, _places
from dolfbuoy.linear.seaway import Response, Seaway, responses
from dolfbuoy.model.memory_fit import fitted
from dolfbuoy.results.places import _nodes
from dolfbuoy.scene.settings import Space
from dolfbuoy.sensitivity.parameters import _has_neighbours
from dolfbuoy.solver.quadratic import lowest_pairs
from dolfbuoy.solver.tension_only import OneSidedRows, TensionOnly
from dolfbuoy.statics.righting import righting_curve
from dolfbuoy.statics.start import _drag
from dolfbuoy.studies.accuracy import cheapest

LINE = {"length": 20.0, "line_density": 5.0, "diameter": 0.08, "axial_stiffness": 1e6}
LINE |= {"normal_drag": 1.2, "tangential_drag": 0.07, "anchor": [0, 0, -15.0]}
LINE |= {"top": {"kind": "fixed", "position": [12.0, 0.0, -1.0]}}


@pytest.mark.parametrize("angle", [0.0, 35.0, 90.0])
def test_drag_of_a_straight_line_in_a_current(angle):
    """1/2 rho D (C_n |u_n| u_n + C_t |u_t| u_t) per length, at any angle to the current; in waves without them."""
    scene = load_scene({
        "sea": {"depth": 15.0, "density": 1020.0},
        "current": {"speed": 0.8, "direction_deg": 30.0},
        "waves": {"amplitude": 1.0, "period": 6.0},
        "cable": LINE,
    })  # fmt: skip
    t = np.array([math.cos(math.radians(angle)), 0.0, math.sin(math.radians(angle))])
    shape = SimpleNamespace(position=lambda s: np.array([0.0, 0.0, -14.0]) + np.outer(s, 0.6 * t))
    section = scene.network.pieces[0].section
    found = _drag(SimpleNamespace(scene=scene, lines=SimpleNamespace(sections=[section])), 0, shape)
    U = 0.8 * np.array([math.cos(math.radians(30)), math.sin(math.radians(30)), 0.0])
    along, across = (U @ t) * t, U - (U @ t) * t
    force = 1.2 * np.linalg.norm(across) * across + 0.07 * np.linalg.norm(along) * along
    np.testing.assert_allclose(found, 0.5 * 1020 * 0.08 * force * 0.6, rtol=1e-9, atol=1e-12)
    smooth = SimpleNamespace(**vars(section) | {"normal_drag": 0.0, "tangential_drag": 0.0})
    bare = SimpleNamespace(scene=scene, lines=SimpleNamespace(sections=[smooth]))
    assert not _drag(bare, 0, shape).any()


def test_arc_lengths_of_the_nodes_of_each_cable():
    """From the lower end of each cable on, over all its pieces, in order."""
    lengths, numbers, cables = [3.0, 2.0, 4.0, 1.0], [0, 1, 0, 1], [0, 0, 1, 1]
    pieces = [
        SimpleNamespace(section=SimpleNamespace(length=length), number=number, cable=cable)
        for length, number, cable in zip(lengths, numbers, cables, strict=True)
    ]
    begins = np.array([100.0, 200.0, 300.0, 400.0])
    piece = np.array([3, 0, 2, 1, 0, 3, 2, 1])
    own = np.array([1.0, 3.0, 0.0, 0.5, 0.0, 0.0, 2.5, 2.0])
    u = np.zeros(30)
    dofs = np.arange(24).reshape(8, 3)
    u[dofs[:, 2]] = 10.0 * np.arange(8)
    lines = SimpleNamespace(owned_nodes=8, line_of_node=piece, part=SimpleNamespace(slice=slice(0, 30)))
    lines.node_s, lines.begins, lines.node_dofs = begins[piece] + own, begins, dofs
    network = SimpleNamespace(pieces=pieces, cables=["one", "two"])
    problem = SimpleNamespace(lines=lines, network=network, system=SimpleNamespace(u=u))
    problem.comm = SimpleNamespace(allgather=lambda rows: [rows])
    (s, z), (other, height) = _nodes(problem)
    assert s.tolist() == [0.0, 3.0, 3.5, 5.0]
    assert z.tolist() == [40.0, 10.0, 30.0, 70.0]
    assert other.tolist() == [0.0, 2.5, 4.0, 5.0]
    assert height.tolist() == [20.0, 60.0, 50.0, 0.0]


def test_turns_count_at_the_radius_of_gyration():
    """sqrt(trace I/m) of each body."""
    moving = Moving.__new__(Moving)
    moving.bodies = [
        SimpleNamespace(inertia=np.diag([1.0, 2.0, 5.0]), mass=2.0, motion=lambda x: np.ones((6, x.shape[1]))),
        SimpleNamespace(inertia=np.diag([9.0, 9.0, 9.0]), mass=3.0, motion=lambda x: 2 * np.ones((6, x.shape[1]))),
    ]
    found = moving.motions(np.zeros((20, 2)))
    assert found[:, 0].tolist() == [1.0] * 3 + [2.0] * 3 + [2.0] * 3 + [6.0] * 3
    assert found.shape == (12, 2)


def test_pitch_over_the_slope_of_the_wave():
    """-1 of a buoy that follows it: eta = e^{ikx} has the slope i k."""
    still = Motions(0, 0, 0, 0, pitch=-0.2j, yaw=0)
    assert Response(5.0, 0.2, still).pitch_over_slope == pytest.approx(-1.0)


@pytest.mark.parametrize(
    ("shares", "seconds", "made", "last"),
    [
        ([1.0, 1.0, 0.5, 0.2, 0.09], [1, 2, 4, 8, 16], 5, 16.0),
        ([1.0, 1.0, 0.9, 0.8, 0.7], [1, 2, 4, 8, 16], 4, math.inf),  # twice no better by 30 %
        ([1.0, 1.0, 0.6, 0.5, 0.4], [1, 2, 4, 80, 160], 4, math.inf),  # too dear
    ],
)
def test_a_pilot_refines_while_it_pays(shares, seconds, made, last, monkeypatch):
    """Until the share is NEAR, a run takes longer than allowed, or two in a row are hardly better."""
    runs = iter(zip(shares, seconds, strict=True))
    now = {}

    def tried(scene):
        now["share"], time = next(runs)
        return SimpleNamespace(attrs={"loop_seconds": time})

    judged = lambda scene, record, coarse: SimpleNamespace(worst=now["share"] * cheapest.NEAR / 0.1)  # noqa: E731
    for name, value in (("tried", tried), ("judged", judged), ("with_settings", lambda *_: None)):
        monkeypatch.setattr(cheapest, name, value)
    pilot = SimpleNamespace(scene=None, newton=1e-6, rows=[], _note=lambda *_: pilot.rows.append({}))
    space = Space(1, 0, 10)
    ways = [(space, 0.1 / 2**k, "bdf2") for k in range(len(shares))]
    points, time = cheapest.Pilot._refined(pilot, ways, 50.0)
    assert len(points) == made == len(pilot.rows)
    assert time == last
    assert list(points) == [0.1 / 2**k for k in range(made)]
    assert points[0.1] == math.inf  # nothing to compare the first with
    assert pilot.rows[-1]["error_in"] == "time"


def test_pairs_come_by_their_size():
    """Of oscillators w, zeta: |lambda| = w, however small what a damped one has of its frequency."""
    w, zeta = np.array([0.8, 1.0, 1.5, 2.5, 4.0]), np.array([0.1, 0.95, 0.3, 0.99, 0.0])
    order = np.array([3, 1, 4, 0, 2])
    K, E, M = (csr_matrix(np.diag(values[order])) for values in (w**2, 2 * zeta * w, np.ones(5)))
    pairs = lowest_pairs(MPI.COMM_SELF, K, E, M, 4)
    np.testing.assert_allclose(np.abs(pairs.roots), w[:4], rtol=1e-9)
    np.testing.assert_allclose(-pairs.roots.real / np.abs(pairs.roots), zeta[:4], atol=1e-9)
    assert [int(np.abs(x).argmax()) for x in pairs.vectors.T] == [int(np.flatnonzero(order == k)[0]) for k in range(4)]
    assert not pairs.zero.any()


def test_poses_of_a_body():
    """Changes of its state by six motions: momenta of speeds as large, half turns of its quaternion."""
    inertia = np.array([[3.0, 0.2, 0.1], [0.2, 4.0, 0.3], [0.1, 0.3, 5.0]])
    q = np.array([0.5, -0.5, 0.7, 0.1])
    q /= np.linalg.norm(q)
    body = Body("buoy", np.arange(13), np.zeros(3), q, 7.0, inertia)
    x = body.poses()
    np.testing.assert_allclose(body.motion(x), np.eye(6), atol=1e-12)
    np.testing.assert_allclose(x[MOTION.slices["momentum"]], np.hstack([7 * np.eye(3), np.zeros((3, 3))]))
    np.testing.assert_allclose(x[MOTION.slices["angular_momentum"]], np.hstack([np.zeros((3, 3)), inertia]))
    np.testing.assert_allclose(body.arms, [1, 1, 1, *[math.sqrt(7 / 12)] * 3])
    moving = Moving.__new__(Moving)
    moving.bodies = [body]
    still = moving.at_rest(x)
    for name in ("momentum", "angular_momentum"):
        assert not still[MOTION.slices[name]].any()
    np.testing.assert_allclose(body.motion(still), np.eye(6), atol=1e-12)
    assert x[MOTION.slices["momentum"]].any()


def test_as_many_modes_that_oscillate_as_were_asked_for(monkeypatch):
    """More are looked for until there are, and no more are given."""
    asked, given = [], []
    kinds = ["drifts", "oscillates", "overdamped", "oscillates", "oscillates", "oscillates", "drifts", "oscillates"]

    def lowest(found, count, direction):
        asked.append(count)
        return [SimpleNamespace(kind=kind, k=k) for k, kind in enumerate(kinds[:count])]

    found = SimpleNamespace(destroy=lambda: None, bodies={})
    monkeypatch.setattr(linear_api, "linearise", lambda *_: found)
    monkeypatch.setattr(linear_api, "lowest_modes", lowest)
    monkeypatch.setattr(linear_api, "dataset_of_modes", lambda _, chosen: given.append([m.k for m in chosen]) or "all")
    linear_api.modes("short", 3, comm=MPI.COMM_SELF, oscillating=True)
    assert asked == [3, 6]
    assert given.pop() == [1, 3, 4]
    linear_api.modes("short", 3, comm=MPI.COMM_SELF)
    assert given.pop() == [0, 1, 2]


def test_forces_of_radiated_waves_on_momenta():
    """-K of the velocities of C and of the tip of the axis, whose forces turn about C; K need not be symmetric."""
    inertia, q = np.array([[3.0, 0.2, 0.1], [0.2, 4.0, 0.3], [0.1, 0.3, 5.0]]), np.array([0.9, 0.3, -0.1, 0.3])
    q /= np.linalg.norm(q)
    body = Body("buoy", 2 + np.arange(13), np.zeros(3), q, 7.0, inertia)
    made = Radiated.__new__(Radiated)
    made.size, made._known = 16, [(_places(body), None)]
    K = np.array([[5.0, 2.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 4.0]]) * (1 + 0.5j)
    x = np.random.default_rng(3).normal(size=16)
    p, L = (x[getattr(body.at, name)] for name in ("momentum", "angular_momentum"))
    d, v, omega = rotation_matrix(q)[:, 2], p / 7, np.linalg.solve(inertia, L)
    tip = np.cross(omega, d)
    on_C = [*(K[0, 0] * v[:2] + K[0, 1] * tip[:2]), K[2, 2] * v[2]]
    on_tip = [*(K[1, 0] * v[:2] + K[1, 1] * tip[:2]), 0.0]
    expected = np.zeros(16, dtype=complex)
    expected[body.at.momentum], expected[body.at.angular_momentum] = on_C, np.cross(d, on_tip)
    np.testing.assert_allclose(made._matrix([K]) @ x, expected, rtol=1e-12, atol=1e-12)


def test_memory_of_two_decays():
    """K(s) = s/((s + 1)(s + 2)) has two rates without oscillations, which both stay."""
    w = np.linspace(0.02, 12, 300)
    s = 1j * w
    K = s / ((s + 1) * (s + 2))
    states = fitted(w, K.real[:, None, None], (K.imag / w)[:, None, None], order=2)
    np.testing.assert_allclose(sorted(states.rate, key=lambda rate: rate.real), [-2, -1], rtol=0.02)
    np.testing.assert_allclose(states.at(w)[:, 0, 0], K, atol=0.01 * K.real.max())


def test_lengths_that_tensions_of_inextensible_elements_stand_for():
    """Of several in an element a part of it each; none of elements that stretch."""
    lines = SimpleNamespace(T_dofs=np.array([[0, 1], [2, 3], [4, 5]]), stretches=np.array([False, True, False]))
    lines.part, lines.cell_ends = SimpleNamespace(offset=2), np.array([[0.0, 1.0], [1.0, 3.0], [3.0, 9.0]])
    places, sizes = _inextensible_tensions(lines, 10 * np.arange(8))
    assert (places.tolist(), sizes.tolist()) == ([20, 30, 60, 70], [0.5, 0.5, 3.0, 3.0])


def test_matrix_of_a_cross_product():
    v, w = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    np.testing.assert_array_equal(_crossing(v) @ w, np.cross(v, w))


def test_half_waves_smaller_than_a_fiftieth_do_not_count():
    """At the phase of the largest; nothing that moves has none."""
    small, large = np.array([1.0, -0.019, 0.5]), np.array([1.0, -0.021, 0.5])
    assert [_changes_of_sign(values * (1 + 2j)) for values in (small, large, np.zeros(3))] == [0, 2, 0]


def test_directions_are_from_x_on_unless_they_are_given():
    for function in (
        periods.buoy_periods,
        periods.natural_periods,
        periods.modes_of_buoys,
        lowest_modes,
        Moving,
        Seaway,
    ):
        assert inspect.signature(function).parameters["direction_deg"].default == 0.0
    assert inspect.signature(responses).parameters["direction_deg"].default == 0.0


@pytest.mark.parametrize(("bad", "there"), [(None, True), (-0.1, False), (0.1, False)])
def test_numbers_by_which_there_are_derivatives_have_neighbours_on_both_sides(bad, there):
    def scene_at(scene, x):
        if x == bad:
            raise InputError("no scene")

    assert _has_neighbours(None, SimpleNamespace(distance=0.1, scene_at=scene_at)) is there
    assert inspect.signature(righting_curve).parameters["pull"].default == 0.0


def test_tensions_that_make_an_element_slack():
    """By the strain of a newton: elastic, and of half a step's motion; at rest what a table has."""
    rows, weights, inertia = np.array([3, 5]), np.array([2.0, 4.0]), np.array([0.5, 0.25])
    law = TensionOnly(OneSidedRows(rows, weights, inertia, np.array([1e-3, 2e-3]), 7.0))
    law.set_scales(10.0)
    np.testing.assert_allclose(law.c, [2 * (1e-3 + 0.04), 4 * (2e-3 + 0.08)], rtol=1e-14)
    law.resize(OneSidedRows(rows, weights, None, 1e-3, np.array([5e-4, 6e-4])))
    law.set_scales(10.0)
    np.testing.assert_allclose(law.c, [1e-3, 2.4e-3], rtol=1e-14)
    assert (law.slack.any(), law.slack_before.any()) == (False, False)
