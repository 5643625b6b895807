"""Typical sizes of unknowns and rows, the scales of Newton's residual; each model alone.

Source: the same sizes by hand, for distinct numbers; no equation is built.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.attachment import Attachment, Clamp
from dolfbuoy.model.bodies import Bodies
from dolfbuoy.model.buoy import Buoy
from dolfbuoy.model.line_groups import LineGroups
from dolfbuoy.model.lines import Lines
from dolfbuoy.model.problem import Problem

NODES, TENSIONS = np.arange(6).reshape(2, 3), np.array([[6], [7]])
LINE = {"length": 20.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 4}
BUOY = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
SEA = {"depth": 30.0, "density": 1000.0}


def told(blocks):
    """What each block says."""
    return {b.name: (b.dofs.tolist(), *(vars(b)[name] for name in NUMBERS)) for b in blocks}


NUMBERS = ("unknown", "rest", "moving", "order", "rounding", "of_shape", "unit")


def lines(**changes):
    """Two pieces of 20 and 8 m in elements of at least 0.5 m, behind 100 other unknowns."""
    sections = [Fake(line_density=3.0, position_degree=2), Fake(line_density=2.0, position_degree=1)]
    found = Fake(longest=20.0, smallest_cell=0.5, part=Fake(offset=100), sections=sections, node_dofs=NODES)
    found.T_dofs, found.mean_dofs, found.moment_dofs, found.dynamic = TENSIONS, None, None, True
    found.pieces, found.typical_EI = [Fake(ends=[Fake(clamp=None)] * 2)], Fake(value=4.0)
    return Fake(**vars(found) | changes)


POSITIONS = ([100, 101, 102, 103, 104, 105], 20.0, 7.0, 30.0, 2, 0.0, 0.0, "m")  # 3 kg/m x 0.5 m x 20 m


def test_sizes_of_lines():
    found = told(Lines.blocks(lines(mean_dofs=np.array([8, 9])), 1.0, 7.0))
    assert found == {
        "cable position": POSITIONS,
        "cable tension": ([106, 107], 7.0, 0.5, 0.0, 1, 30.0, 0.0, "N"),
        "cable mean tension": ([108, 109], 7.0, 3.5, 0.0, 1, 30.0, 0.0, "N"),
    }


@pytest.mark.parametrize(
    ("dynamic", "clamp", "force", "size", "share", "of_shape"),
    [
        (True, None, 7.0, 0.2, 30.0, 10 * 4 * 20 / 0.25**2),  # nodes 0.25 m apart
        (True, "held", 1e4, 0.2, 30.0, 10 * 4 * 20 / 0.25**2),
        (False, None, 1e4, 0.2, 0.1, 0.0),
        (False, "held", 1e-3, 0.2, 0.1, 0.0),
        (False, "held", 9.0, 6.0, 0.1, 0.0),  # sqrt(4 N m^2 x 9 N)
    ],
)
def test_sizes_of_moments(dynamic, clamp, force, size, share, of_shape):
    ends = [Fake(ends=[Fake(clamp=None), Fake(clamp=clamp)])]
    found = told(Lines.blocks(lines(moment_dofs=NODES + 10, dynamic=dynamic, pieces=ends), 1.0, force))
    places = [*range(110, 116)]
    assert found["cable moment"] == (places, size, 4.0 * share, 0.0, 1, 0.0, pytest.approx(of_shape), "N m")
    assert list(found) == ["cable position", "cable tension", "cable moment"]


@pytest.mark.parametrize(("gravity", "speed"), [(9.0, math.sqrt(180.0)), (0.25, math.sqrt(20.0))])
def test_sizes_of_the_evolution_of_lines(gravity, speed):
    model = Fake(longest=20.0, scene=Fake(gravity=gravity), part=None, rates=[1, 2], node_dofs=NODES)
    model.w = Fake(x=Fake(array=np.zeros(8)))
    (found,) = Lines.evolutions(model)
    assert (found.order, found.lagged) == (2, False)
    for size, value in zip(found.sizes, (20.0, speed), strict=True):
        np.testing.assert_allclose(size, [*[value] * 6, np.inf, np.inf], rtol=1e-14)


def buoy(dynamic, gravity=9.0, shape=None):
    """A buoy behind 50 other unknowns."""
    found = object.__new__(Buoy)
    count = 13 if dynamic else 7
    vars(found).update(scene=Fake(gravity=gravity), shape=shape, dynamic=dynamic)
    found.mass, found.part = Fake(mass=3.0, inertia=(2.0, 2.0, 5.0)), Fake(slice=slice(50, 50 + count))
    return found


def test_sizes_of_a_buoy():
    """Of 4 m and 3 kg, where g is 9 m/s^2: 6 m/s and 27 N, or what its line has if that is more."""
    one = buoy(True, shape=Fake(height=4.0))
    assert told(one.blocks(2.0, 20.0)) == {
        "buoy position r_C": ([50, 51, 52], 4.0, 0.0, 4.0, 1, 0.0, 0.0, "m"),
        "buoy momentum p": ([53, 54, 55], 18.0, 27.0, 18.0, 1, 0.0, 0.0, "N s"),
        "buoy orientation q_4": ([56, 57, 58, 59], 1.0, 0.0, 1.0, 1, 0.0, 0.0, ""),
        "buoy angular momentum L_C": ([60, 61, 62], 7.5, 108.0, 7.5, 1, 0.0, 0.0, "N m s"),
    }
    found = told(one.blocks(30.0, 50.0))
    assert found["buoy position r_C"][1:4] == (30.0, 0.0, 30.0)
    assert found["buoy momentum p"][2] == 50.0
    assert found["buoy angular momentum L_C"][2] == 200.0
    assert one.state_sizes.tolist() == [4.0] * 3 + [18.0] * 3 + [1.0] * 4 + [7.5] * 3
    assert buoy(True, gravity=0.5).state_sizes.tolist() == [1.0] * 3 + [3.0] * 3 + [1.0] * 4 + [5.0] * 3


def test_sizes_of_a_buoy_at_rest():
    assert told(buoy(False, shape=Fake(height=4.0)).blocks(2.0, 50.0)) == {
        "buoy position r_C": ([50, 51, 52], 4.0, 50.0, 0.0, 1, 0.0, 0.0, "m"),
        "buoy orientation q_4": ([53], 1.0, 1.0, 0.0, 1, 0.0, 0.0, ""),
        "buoy torque balance": ([54, 55, 56], 1.0, 200.0, 0.0, 1, 0.0, 0.0, ""),
    }


def test_sizes_at_ends_on_buoys():
    clamp = object.__new__(Clamp)
    clamp._lines, clamp.line_part = Fake(typical_EI=Fake(value=40.0), longest=20.0), Fake(slice=slice(26, 32))
    end = object.__new__(Attachment)
    end.line_part, end.clamp = Fake(slice=slice(20, 26)), None
    alone = {
        "mooring point r_O": ([20, 21, 22], 4.0, 4.0, 0.0, 1, 0.0, 0.0, "m"),
        "mooring force T_O": ([23, 24, 25], 7.0, 4.0, 0.0, 1, 12.0, 0.0, "N"),
    }
    assert told(end.blocks(4.0, 7.0, 3.0)) == alone
    end.clamp = clamp
    assert told(end.blocks(4.0, 7.0, 3.0)) == alone | {
        "direction of an end": ([26, 27, 28], 1.0, 1.0, 0.0, 1, 0.0, 0.0, ""),
        "moment of an end": ([29, 30, 31], 2.0, 2.0, 0.0, 1, 0.0, 0.0, "N m"),
    }


def test_sizes_of_bodies_at_joints():
    model = Fake(part=Fake(offset=9), dofs=NODES, bodies=[Fake(mass=4.0), Fake(mass=5.0)], rates=[1, 2])
    assert told(Bodies.blocks(model, 20.0, 7.0)) == {
        "position of bodies at joints": ([9, 10, 11, 12, 13, 14], 20.0, 7.0, 100.0, 2, 0.0, 0.0, "")
    }
    (evolution,) = Bodies.evolutions(model)
    assert [size.tolist() for size in evolution.sizes] == [[math.inf] * 6] * 2
    assert (evolution.order, evolution.lagged) == (2, False)


# -- a typical force ---------------------------------------------------------------------------------------------------

HELD = {"kind": "fixed", "position": [20.0, 0.0, 0.0]}
TAUT = (1e5 * 400.0**2 / 24) ** (1 / 3)  # of a line that is as long as its chord and weighs 400 N
FLOATING = LINE | {"area": 4e-3, "diameter": 0.07, "anchor": [0.0, 0.0, -1.0], "top": HELD | {"position": [9, 0, -1]}}


@pytest.mark.parametrize(
    ("scene", "force"),
    [
        ({"cable": LINE | {"top": HELD | {"position": [9, 0, 0]}}}, 400.0),  # its weight
        ({"gravity": 0.5, "cable": LINE | {"top": HELD | {"position": [9, 0, 0]}}}, 40.0),  # its mass
        ({"sea": SEA, "cable": FLOATING}, 400.0),
        ({"cable": LINE | {"top": HELD}}, TAUT),
        ({"cable": LINE | {"top": HELD | {"position": [20.0 * (1 - 0.9e-6), 0, 0]}}}, TAUT),
        ({"cable": LINE | {"top": HELD | {"position": [20.0 * (1 - 1.1e-6), 0, 0]}}}, 400.0),
        ({"cable": LINE | {"top": HELD | {"position": [22.0, 0, 0]}}}, 1e4),  # a strain of 0.1
        ({"cable": LINE | {"axial_stiffness": math.inf, "top": HELD}}, 400.0),
        ({"cable": LINE | {"anchor": [20.0, 0, 0], "top": {"kind": "free", "force": [0, 300.0, 400.0]}}}, 500.0),
        ({"sea": SEA, "buoy": BUOY, "external_force": {"force": [3e3, 0.0, 4e3]}}, 5e3),
        ({"sea": SEA, "buoy": BUOY}, 3e3),
        ({"gravity": 0.0, "sea": SEA, "buoy": BUOY | {"initial": {"buoy_position": [0, 0, 0]}}}, 1e-6),
    ],
)
def test_a_typical_force(scene, force):
    found = load_scene({"gravity": 10.0} | scene)
    assert Problem.typical_force.fget(Fake(scene=found, network=found.network)) == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize(("body", "force"), [({"mass": 90.0}, 900.0), ({"mass": 90.0, "volume": 0.2}, 1100.0)])
def test_bodies_and_take_offs_make_a_typical_force(body, force):
    """A body weighs what the water leaves of it, either way."""
    cable = LINE | {"line_density": 0.1, "diameter": 0.01, "from": [0, 0, -20], "to": "Y"}
    cables = [cable | {"name": "a"}, cable | {"name": "b", "from": [5.0, 0, -20]}]
    scene = {"gravity": 10.0, "sea": SEA, "cable": cables, "joint": [{"name": "Y"} | body]}
    device = {"from": "Y", "to": [0, 0, -1.0], "stiffness": 9.0, "length": 1.0}
    for pretension, expected in ((0.0, force), (2e3, 2e3), (-3e3, 3e3)):
        found = load_scene(scene | {"take_off": device | {"pretension": pretension}})
        assert Problem.typical_force.fget(Fake(scene=found, network=found.network)) == pytest.approx(expected)


# -- elements that are turned inside out, or slack ---------------------------------------------------------------------


def test_an_element_is_pushed_flat():
    """Half flat is what may be; the softest of those that may turn counts."""
    sections = [Fake(axial_stiffness=100.0), Fake(axial_stiffness=60.0), Fake(axial_stiffness=8.0)]
    groups = [Fake(sections=sections, turnable=np.array([True, True, False]))]
    least, given = np.zeros(1), [-30.0]
    problem = Fake(lines=Fake(groups=groups, smallest_stretch=lambda u: -0.25), _least=least)
    problem._find_least = lambda: least.fill(given[0])
    problem.comm, problem.system = MPI.COMM_SELF, Fake(u=None)
    problem._bearable = Problem._pushed_half_flat(problem)
    assert problem._bearable == -30.0
    assert Problem._inside_out(problem) is None
    given[0] = -30.1
    assert Problem._inside_out(problem) == "the cable tension turns an element inside out, to a stretch of -0.25"
    problem.lines.smallest_stretch = lambda u: 0.0
    assert Problem._inside_out(problem) is None


@pytest.mark.parametrize("dynamic", [True, False])
def test_which_pieces_may_turn_inside_out(dynamic):
    """Elastic ones that take compression; in motion not what damps, whose tension is not its stretch."""
    kinds = [
        (1e3, "compressive", 0.0),
        (1e3, "compressive", 2.0),
        (1e3, "tension-only", 0.0),
        (math.inf, "compressive", 0),
    ]
    sections = [Fake(axial_stiffness=EA, slack=slack, damping=c) for EA, slack, c in kinds]
    found = Lines.turnable.fget(Fake(sections=sections, dynamic=dynamic))
    assert found.tolist() == [True, not dynamic, False, False]


@pytest.mark.parametrize("dynamic", [True, False])
def test_sizes_of_rows_that_are_one_sided(dynamic):
    """Elements P2-P1 of 0.5 and 2 m; the third one takes compression, the last tension is another rank's."""
    rope = Fake(line_density=3.0, axial_stiffness=50.0, tension_degree=1, position_degree=2)
    cord = Fake(line_density=2.0, axial_stiffness=4.0, tension_degree=1, position_degree=2)
    model = Fake(section=rope, sections=[rope, cord], line_of_cell=np.array([0, 1, 1]), dynamic=dynamic)
    model.space = Fake(dofmap=Fake(index_map=Fake(size_local=13)))
    model.cell_ends, model.T_dofs = np.array([[0, 0.5], [5, 7], [7, 9.0]]), np.array([[9, 10], [12, 13], [5, 6]])
    model.one_sided = np.array([True, True, False])
    found = Lines.one_sided_rows(model, 70.0)
    assert found.rows.tolist() == [9, 10, 12]
    assert found.weights.tolist() == [0.25, 0.25, 1.0]
    assert (found.inertia.tolist() if dynamic else found.inertia) == ([0.1875, 0.1875, 2.0] if dynamic else None)
    assert found.compliance.tolist() == [0.02, 0.02, 0.25]
    np.testing.assert_allclose(found.rest, [1 / 7, 1 / 7, 0.25], rtol=1e-14)
    groups = [Fake(part=Fake(offset=k), one_sided_rows=lambda force: found) for k in (0, 100)]
    joined = LineGroups.one_sided_rows(Fake(groups=groups, dynamic=dynamic), 70.0)
    assert joined.rows.tolist() == [9, 10, 12, 109, 110, 112]
    assert joined.compliance.tolist() == [0.02, 0.02, 0.25] * 2
    assert (joined.inertia is None) != dynamic
