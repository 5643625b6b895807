"""Equilibrium of catenary networks without a given start: clumps, floats, bridles, loops, slack lines, bed joints.

Source: tests/reference (mpmath and shooting, checked with MoorPy), the closed forms of single lines, balances by hand.
"""

import dataclasses
import math

import numpy as np
import pytest
from helpers import reference

from dolfbuoy.errors import SolveError
from dolfbuoy.scene.stiffness import TensionTable
from dolfbuoy.statics import catenary, on_bed
from dolfbuoy.statics.network import Joint, Network, Piece, solve
from dolfbuoy.statics.network_equations import Equations
from dolfbuoy.statics.on_bed import UP, Bed

CASES = reference("bed_and_networks")["cases"]
INF = math.inf


def force_on(rest, joint):
    """Force of all pieces on a joint."""
    total = np.zeros(3)
    for piece, pull, lying in zip(rest.network.pieces, rest.pulls, rest.lying, strict=True):
        total += pull if piece.start == joint else 0.0
        total -= pull + piece.w * (piece.length - lying) * UP if piece.end == joint else 0.0
    return total


def chain_of(case):
    """Segments of a case between its anchor and its top."""
    data = case["input"]
    net_loads = {
        int(i): (0.0, 0.0, (data["density"] * body["volume"] - body["mass"]) * data["gravity"])
        for i, body in data["bodies"].items()
    }
    between = [Joint(free=True, load=net_loads.get(i, (0.0, 0.0, 0.0))) for i in range(len(data["segments"]) - 1)]
    pieces = [
        Piece(i, i + 1, part["length"], part["weight_in_water"], part["axial_stiffness"])
        for i, part in enumerate(data["segments"])
    ]
    return Network([Joint(data["anchor"]), *between, Joint(data["top"])], pieces, Bed(UP, 0.0))


@pytest.mark.parametrize("name", ["cwc_clump_still", "s_float_still"])
def test_clump_and_float(name):
    case = CASES[name]
    network, exact = chain_of(case), {key: case["exact"][key] for key in ("T_top", "H", "V_top", "length_on_bed")}
    rest = solve(network)
    top = rest.shapes[-1].force(network.pieces[-1].length)
    found = {"T_top": np.linalg.norm(top), "H": np.hypot(*top[:2]), "V_top": top[2]}
    found["length_on_bed"] = sum(shape.length_on_bed for shape in rest.shapes)
    for key, value in found.items():
        assert value == pytest.approx(float(exact[key]), rel=1e-11, abs=1e-9), key
    for i, joint in enumerate(case["exact"]["joints"]):
        x, z, T_below, T_above = (float(value) for value in joint)
        np.testing.assert_allclose(rest.positions[i + 1], [x, 0.0, z], atol=1e-10)
        assert rest.shapes[i].tension(network.pieces[i].length) == pytest.approx(T_below, rel=1e-11)
        assert rest.shapes[i + 1].tension(0.0) == pytest.approx(T_above, rel=1e-11)


def y_bridle(**changes):
    data = CASES["y_bridle_still"]["input"]
    ends = [(0, 3), (3, 1), (3, 2)]
    pieces = [Piece(*ends[i], *(data[name][key] for key in ("L", "w", "EA"))) for i, name in enumerate(PARTS)]
    held = [Joint(data[name]) for name in ("anchor", "fairlead1", "fairlead2")]
    joint = Joint(free=True, load=(0.0, 0.0, -data["joint_net_weight"]))
    return Network([*held, joint], [dataclasses.replace(piece, **changes) for piece in pieces])


PARTS = ("main", "leg1", "leg2")


def test_bridle():
    values, network = CASES["y_bridle_still"]["values"], y_bridle()
    rest = solve(network)
    np.testing.assert_allclose(rest.positions[3], values["joint"], atol=1e-9)
    for name, shape, piece in zip(PARTS, rest.shapes, network.pieces, strict=True):
        at_joint, far = (0.0, piece.length) if name != "main" else (piece.length, 0.0)
        assert np.hypot(*shape.force(at_joint)[:2]) == pytest.approx(values[name]["H"], rel=1e-11)
        assert shape.tension(at_joint) == pytest.approx(values[name]["T_joint"], rel=1e-11)
        assert shape.tension(far) == pytest.approx(values[name]["T_top" if name != "main" else "T_anchor"], rel=1e-11)


def three_lines(offset):
    """All three legs at one held point, from whose position the force follows."""
    case = CASES["three_lines_fixed_point"]["input"]
    angles = np.radians([0.0, 120.0, 240.0])
    anchors = [Joint((520 * np.cos(angle), 520 * np.sin(angle), -100.0)) for angle in angles]
    pieces = [Piece(i, 3, case["L"], case["w"], case["EA"]) for i in range(3)]
    return solve(Network([*anchors, Joint(offset)], pieces, Bed(UP, -100.0)))


def test_three_lines_and_their_stiffness():
    values = CASES["three_lines_fixed_point"]["values"]
    for row in values["offsets"]:
        rest = three_lines((*row["offset"], 0.0))
        np.testing.assert_allclose(force_on(rest, 3), row["restoring_force"], rtol=1e-10, atol=1e-5)
        tensions = [shape.tension(560.0) for shape in rest.shapes]
        np.testing.assert_allclose(tensions, row["line_tensions"], rtol=1e-10)
    for axis, key in ((0, "K_surge"), (2, "K_heave")):
        step = 1e-2 * np.eye(3)[axis]
        forces = [force_on(three_lines(k * step), 3)[axis] for k in (-2, -1, 1, 2)]
        slope = (forces[0] - 8 * forces[1] + 8 * forces[2] - forces[3]) / 12e-2
        assert -slope == pytest.approx(values[key], rel=1e-9)


def balance(rest, joint):
    """Forces on a free joint that is not on the bed."""
    return force_on(rest, joint) + np.array(rest.network.joints[joint].load)


def check(rest, joints=()):
    """Ends where they should be, forces in balance at `joints`, nothing below the bed; tensions are never negative."""
    bed = -math.inf if rest.network.bed is None else rest.network.floor
    for shape, piece, ends in zip(rest.shapes, rest.network.pieces, rest.ends, strict=True):
        s = np.linspace(0.0, piece.length, 101)
        np.testing.assert_allclose(shape.position(s[[0, -1]]), ends, atol=1e-7 * piece.length)
        assert shape.position(s)[:, 2].min() > bed - 1e-7 * piece.length
        assert shape.tension(s).min() >= 0
    for joint in joints:
        np.testing.assert_allclose(balance(rest, joint), 0, atol=1e-8 * max(np.abs(rest.pulls).max(), 1.0))


def test_single_lines_are_the_closed_forms_of_one_line():
    bed = Bed(UP, -100.0)
    for end, L, w, EA in (
        ((520.0, 0.0, 0.0), 560.0, 700.0, 4e8),
        ((400.0, 30.0, 0.0), 560.0, 700.0, 4e8),
        ((80.0, 30.0, 0.0), 140.0, 700.0, INF),
        ((80.0, 30.0, 0.0), 140.0, -700.0, 1e5),
    ):
        start = np.array([0.0, 0.0, -100.0])
        alone = on_bed.between(start, np.array(end), L, w, EA, bed)
        rest = solve(Network([Joint(start), Joint(end)], [Piece(0, 1, L, w, EA)], Bed(UP, -100.0)))
        back = solve(Network([Joint(end), Joint(start)], [Piece(0, 1, L, w, EA)], Bed(UP, -100.0)))
        s = np.linspace(0.0, L, 57)
        np.testing.assert_allclose(rest.shapes[0].tension(s), alone.tension(s), atol=1e-9 * abs(w) * L)
        np.testing.assert_allclose(rest.shapes[0].position(s), alone.position(s), atol=1e-7 * L)
        np.testing.assert_allclose(back.shapes[0].tension(L - s), alone.tension(s), atol=1e-9 * abs(w) * L)
        assert rest.shapes[0].length_on_bed == pytest.approx(alone.length_on_bed, abs=1e-7 * L)


def test_cutting_a_line_changes_nothing():
    """Joints without weight in the air, on the bed, and where the line lies without tension."""
    for X in (520.0, 400.0):
        held = [Joint((0.0, 0.0, 0.0)), Joint((X, 0.0, 100.0))]
        whole = solve(Network(held, [Piece(0, 1, 560.0, 700.0, 4e8)], Bed(UP, 0.0)))
        cuts = [Joint(free=True)] * 3
        places = [(0, 2, 60.0), (2, 3, 250.0), (3, 4, 200.0), (4, 1, 50.0)]
        parts = solve(Network([*held, *cuts], [Piece(a, b, L, 700.0, 4e8) for a, b, L in places], Bed(UP, 0.0)))
        check(parts, joints=[4])
        np.testing.assert_allclose(force_on(parts, 1), force_on(whole, 1), rtol=1e-9, atol=1e-4)
        np.testing.assert_allclose(parts.positions[4], whole.shapes[0].position(510.0), atol=1e-6)


@pytest.mark.parametrize("other", [{"EA": 3e7}, {"drag": (4.0, -7.0, 1.0)}, {"w": 200.0}])
def test_from_a_neighbour_as_from_nowhere(other, monkeypatch):
    """The same rest in a quarter of the evaluations, the unit of force too being another."""
    counts, evaluate = [0, 0], Equations.evaluate

    def counted(equations, *arguments, **options):
        counts[-1] += 1
        return evaluate(equations, *arguments, **options)

    monkeypatch.setattr(Equations, "evaluate", counted)
    near, network = solve(y_bridle()), y_bridle(**other)
    counts.append(0)
    fresh = solve(network)
    counts.append(0)
    found = solve(network, near)
    np.testing.assert_allclose(found.positions, fresh.positions, rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(found.pulls, fresh.pulls, rtol=1e-11, atol=1e-9)
    np.testing.assert_allclose(found.lying, fresh.lying, atol=1e-9)
    assert counts[-1] < 0.25 * counts[-2]


def test_a_neighbour_that_does_not_help():
    """Of other pieces, not smoothed to the end, or far away: then as from nowhere."""
    whole, network = solve(y_bridle()), y_bridle()
    cut = Network([*network.joints], network.pieces[:2])
    np.testing.assert_array_equal(solve(cut, whole).positions, solve(cut).positions)
    rough = dataclasses.replace(whole, state=whole.state._replace(eps=1e-8))
    np.testing.assert_array_equal(solve(network, rough).positions, whole.positions)
    far = dataclasses.replace(whole, state=whole.state._replace(y=-whole.state.y))
    np.testing.assert_allclose(solve(network, far).positions, whole.positions, atol=1e-10)
    with pytest.raises(SolveError, match="inextensible ones are too short"):
        solve(y_bridle(EA=INF, length=20.0), whole)


def test_a_slack_leg_of_a_bridle_hangs():
    network = y_bridle()
    network.pieces[2] = dataclasses.replace(network.pieces[2], length=60.0)
    rest = solve(network)
    check(rest, joints=[3])
    assert np.linalg.norm(rest.pulls[2]) < 0.05 * np.linalg.norm(rest.pulls[1])


def test_inextensible_bridle_is_the_limit_of_stiff_ones():
    limit = solve(y_bridle(EA=INF))
    check(limit, joints=[3])
    gaps = [np.linalg.norm(solve(y_bridle(EA=EA)).positions[3] - limit.positions[3]) for EA in (1e9, 1e10)]
    assert gaps[0] / gaps[1] == pytest.approx(10, rel=1e-2)


def test_sinker_and_joint_on_the_bed():
    """A sinker that is heavier than the line can lift: the leg behind it is as if it were an anchor."""
    joints = [Joint((0.0, 0.0, 0.0)), Joint(free=True, load=(0.0, 0.0, -2e5)), Joint((150.0, 0.0, 60.0))]
    pieces = [Piece(0, 1, 100.0, 300.0, 1e8), Piece(1, 2, 90.0, 300.0, 1e8)]
    rest = solve(Network(joints, pieces, Bed(UP, 0.0)))
    check(rest)
    assert abs(rest.positions[1, 2]) < 1e-8
    alone = on_bed.between(*rest.ends[1], 90.0, 300.0, 1e8, Bed(UP, 0.0))
    assert alone.last.H > 1e3
    assert np.hypot(*rest.pulls[0, :2]) == pytest.approx(alone.last.H, rel=1e-8)
    np.testing.assert_allclose(force_on(rest, 1)[:2], 0, atol=1e-4)
    assert rest.shapes[0].length_on_bed == pytest.approx(100.0, abs=1e-4)


def test_a_float_that_lands_and_rises():
    """A float between two lines, which takes on weight."""

    def loaded(force):
        joints = [Joint((0.0, 0.0, 0.0)), Joint(free=True, load=(0.0, 0.0, force)), Joint((60.0, 0.0, 40.0))]
        return solve(Network(joints, [Piece(0, 1, 50.0, 10.0, 1e7), Piece(1, 2, 45.0, 10.0, 1e7)], Bed(UP, 0.0)))

    light, heavy = loaded(500.0), loaded(-1e4)
    check(light, joints=[1])
    check(heavy)
    assert light.positions[1, 2] > 1.0
    assert abs(heavy.positions[1, 2]) < 1e-7


def test_line_between_two_buoys_that_goes_slack():
    anchors = [Joint((0.0, 0.0, -50.0)), Joint((60.0, 0.0, -50.0))]
    buoys = [Joint(free=True, load=(0.0, 0.0, 1e4))] * 2
    for w, L in ((30.0, 90.0), (0.0, 90.0), (-30.0, 61.0), (30.0, 50.0)):
        shared = Piece(2, 3, L, w, INF)
        rest = solve(
            Network(
                [*anchors, *buoys], [Piece(0, 2, 48.0, 50.0, 1e6), Piece(1, 3, 48.0, 50.0, 1e6), shared], Bed(UP, -50.0)
            )
        )
        check(rest, joints=[2, 3])
        np.testing.assert_allclose(rest.positions[2] + rest.positions[3] * [1, -1, -1], [60.0, 0.0, 0.0], atol=1e-7)
    assert np.linalg.norm(rest.pulls[2]) > 1e3  # the last one is taut


def test_loop_and_lines_lighter_than_water():
    joints = [Joint((0.0, 0.0, 0.0)), Joint(free=True, load=(0.0, 0.0, 3e4)), Joint(free=True, load=(0.0, 0.0, -1e3))]
    loop = solve(
        Network(joints, [Piece(0, 1, 50.0, 100.0, INF), Piece(1, 2, 30.0, 100.0, INF), Piece(2, 0, 60.0, 100.0, INF)])
    )
    check(loop, joints=[1, 2])
    np.testing.assert_allclose(loop.positions[1:], [[0, 0, 50], [0, 0, 20]], atol=1e-6)
    wave = chain_of(CASES["lazy_wave_current"])
    rest = solve(wave)
    check(rest, joints=[1, 2])
    assert rest.shapes[1].position(np.array([35.0]))[0, 2] > max(rest.positions[1, 2], rest.positions[2, 2])


def test_fifty_legs_and_a_body_with_fairleads():
    """The force on a body that is off its equilibrium is what turns up in its load."""
    angles = np.arange(50) * 2 * np.pi / 50
    legs = [
        Piece(i + 1, 0, 560.0, 700.0, 4e8, end_offset=(5 * np.cos(a), 5 * np.sin(a), 0.0)) for i, a in enumerate(angles)
    ]
    anchors = [Joint((525 * np.cos(a), 525 * np.sin(a), -100.0)) for a in angles]
    stiffness = np.diag([0.0, 0.0, 3e6])

    def load(position):
        """A moored body: a steady push, and buoyancy that follows its depth."""
        return np.array([1e5, 0.0, 6e6]) - stiffness @ position, -stiffness

    rest = solve(Network([Joint(free=True, load=load), *anchors], legs, Bed(UP, -100.0)))
    check(rest)
    np.testing.assert_allclose(force_on(rest, 0) + load(rest.positions[0])[0], 0, atol=1e-3)
    held = solve(Network([Joint(rest.positions[0]), *anchors], legs, Bed(UP, -100.0)))
    np.testing.assert_allclose(force_on(held, 0), force_on(rest, 0), atol=1e-3)


def test_catenary_without_bed_between_two_points():
    end = np.array([30.0, 40.0, 20.0])
    rest = solve(Network([Joint((0.0, 0.0, 0.0)), Joint(end)], [Piece(0, 1, 70.0, 90.0, 1e5)]))
    exact = catenary.between(np.zeros(3), end, 70.0, 90.0, 1e5)
    assert pytest.approx(exact.V0, rel=1e-12) == rest.shapes[0].V0
    assert pytest.approx(exact.H, rel=1e-12) == rest.shapes[0].H


@pytest.mark.parametrize(
    ("joints", "pieces", "said"),
    [
        ([Joint((0, 0, 0)), Joint((9, 0, 0))], [Piece(0, 1, 8.0, 1.0, INF)], "piece 0: .* cannot span 9 m"),
        (
            [Joint((0, 0, 0)), Joint(free=True), Joint((9, 0, 0))],
            [Piece(0, 1, 4.0, 1.0, INF), Piece(1, 2, 4.0, 1.0, INF)],
            "inextensible ones are too short",
        ),
    ],
)
def test_what_has_no_rest(joints, pieces, said):
    with pytest.raises(SolveError, match=said):
        solve(Network(joints, pieces))


def test_a_table_counts_as_the_stiffness_where_it_is_pulled_hardest():
    """A line that hangs down with a weight on it: pulled hardest at its top, by both weights."""
    rows, L, w, load = [(0.0, 0.0), (0.01, 2e3), (0.02, 1e4)], 30.0, 100.0, 2500.0
    pieces = [Piece(0, 1, L, w, TensionTable(rows))]
    rest = solve(Network([Joint((0.0, 0.0, 0.0)), Joint(free=True, load=(0.0, 0.0, -load))], pieces, None))
    strain = np.interp(load + w * L, *np.array(rows).T[::-1])
    assert pytest.approx((load + w * L) / strain, rel=1e-3) == rest.network.pieces[0].EA


BRIDLED = [(0, 2, 13.0, 7.0, 3e4), (1, 2, 12.0, 9.0, INF), (2, 3, 11.0, 40.0, 5e4)]


def bridled(turn, **more):
    """Two lines that meet in a third one at a clump, all turned by a matrix; more: of the Network."""
    places = [np.array(place) for place in ([-8.0, 1.0, 0.5], [7.0, -2.0, 1.0], [0.0, 3.0, 12.0])]
    joints = [Joint(turn @ places[0]), Joint(turn @ places[1]), Joint(free=True, load=turn @ [0.0, 0.0, -90.0])]
    return Network([*joints, Joint(turn @ places[2])], [], **more)


def test_weight_and_drag_are_one_load():
    """A network in a stream, seen from the frame in which the loads point down, is one in still water: places and
    tensions are those of the network that is turned."""
    angle = math.atan(0.75)  # 3 across to 4 down
    turn = np.array([[math.cos(angle), 0, -math.sin(angle)], [0, 1, 0], [math.sin(angle), 0, math.cos(angle)]])
    down = turn @ [0.0, 0.0, -1.0]
    still = dataclasses.replace(bridled(np.eye(3)), pieces=[Piece(*keys) for keys in BRIDLED])
    pieces = []
    for start, end, length, w, EA in BRIDLED:
        load = w * down
        pieces.append(Piece(start, end, length, -load[2], EA, drag=(load[0], load[1], 0.0)))
    one, other = solve(still), solve(dataclasses.replace(bridled(turn), pieces=pieces))
    np.testing.assert_allclose(other.positions, one.positions @ turn.T, atol=1e-9)
    np.testing.assert_allclose(other.pulls, one.pulls @ turn.T, atol=1e-6)
    for piece, mine, turned in zip(still.pieces, one.shapes, other.shapes, strict=True):
        s = np.linspace(0.0, piece.length, 7)
        np.testing.assert_allclose(turned.position(s), mine.position(s) @ turn.T, atol=1e-9)
        np.testing.assert_allclose(turned.tension(s), mine.tension(s), rtol=1e-9, atol=1e-6)


def test_a_line_without_weight_in_a_stream():
    """A parabola's exact sister: a catenary on its side, whose force at its ends is half of the drag each."""
    line = Piece(0, 1, 12.0, 0.0, INF, drag=(5.0, 0.0, 0.0))
    rest = solve(Network([Joint((0.0, 0.0, 0.0)), Joint((0.0, 10.0, 0.0))], [line]))
    (shape,) = rest.shapes
    low, high = shape.force(np.array([0.0, 12.0]))
    assert (low[0], high[0]) == pytest.approx((30.0, -30.0), rel=1e-9)
    sag = shape.position(np.array([6.0]))[0]
    across = catenary.between(np.array([0.0, 0, 0]), np.array([10.0, 0, 0]), 12.0, 5.0, INF)
    assert sag == pytest.approx([-across.position(np.array([6.0]))[0, 2], 5.0, 0.0], abs=1e-9)


def test_light_lines_under_the_surface_are_heavy_ones_on_a_bed():
    """The same network upside down: floats are clumps, the surface at z = 2 a bed at z = -2."""
    anchors, buoyancy, s = [(0.0, 0.0, -9.0), (30.0, 4.0, -12.0)], 80.0, np.linspace(0.0, 12.0, 25)

    def found(bed, surface, sign):
        joints = [Joint((x, y, -sign * z)) for x, y, z in anchors]
        joints += [Joint(free=True, load=(0.0, 0.0, -sign * load)) for load in (0.0, buoyancy)]
        lines = ((0, 2, 16.0, 9.0, 2e4), (2, 3, 12.0, 6.0, INF), (3, 1, 24.0, 8.0, 3e4))
        pieces = [Piece(start, end, length, sign * w, EA) for start, end, length, w, EA in lines]
        rest, flip = solve(Network(joints, pieces, bed, surface)), np.array([1.0, 1.0, sign])
        shapes = [shape.position(s) * flip for shape in rest.shapes]
        return [rest.positions * flip, rest.pulls * flip, *shapes], rest.lying

    under, floating = found(None, 2.0, -1.0)
    over, lying = found(Bed(UP, -2.0), None, 1.0)
    assert max(lying) > 3.0
    assert floating == pytest.approx(lying, abs=1e-5)
    assert max(shape[:, 2].min() for shape in over[2:]) > -2.0 - 1e-6
    for mine, other in zip(under, over, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-5)


@pytest.mark.parametrize("size", [1e-2, 1.0, 1e3])
@pytest.mark.parametrize("turn", [0.5, 1.7])
def test_shapes_lead_from_end_to_end_at_any_size(size, turn):
    """Of lines that hang, lie, and hang in a stream, in any direction, with the pull that the network has."""
    c, s = math.cos(turn), math.sin(turn)
    rotate = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) * size
    joints = [
        Joint(rotate @ [0.0, 0.0, -20.0]),
        Joint(free=True, load=(0.0, 0.0, 30.0 * size)),
        Joint(rotate @ [28.0, 3.0, 0.0]),
        Joint(free=True, load=(0.0, 0.0, -9.0 * size)),
    ]
    pieces = [
        Piece(0, 1, 22.0 * size, 2.0, 1e4 * size),
        Piece(1, 2, 30.0 * size, 0.5, 1e4 * size),
        Piece(1, 3, 12.0 * size, 3.0, INF),
        Piece(3, 0, 26.0 * size, 1.5, 1e4 * size, drag=rotate @ [0.2, 0.3, 0.0] / size),
        Piece(0, 2, 50.0 * size, 2.0, 1e4 * size),
    ]
    rest = solve(Network(joints, pieces, Bed(UP, -20.0 * size)))
    for piece, shape, ends, pull in zip(pieces, rest.shapes, rest.ends, rest.pulls, strict=True):
        found = np.concatenate([shape.position(np.array([at])) for at in (0.0, piece.length)])
        np.testing.assert_allclose(found, ends, atol=1e-6 * piece.length)
        np.testing.assert_allclose(shape.force(np.zeros(1))[0], pull, atol=1e-5 * size)
    assert rest.lying[4] > 5 * size
