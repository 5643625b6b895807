"""Hulls, their disks and points, nodes and energies of lines, and minimal scenes; each alone.

Source: frusta and moments by hand, quadrature over disks.
"""

import builtins
import io
import math
import resource
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from scipy.integrate import quad

from dolfbuoy import InputError, load_scene
from dolfbuoy.meshes import HullShape, cable_nodes, number_of_cells
from dolfbuoy.model import feasible, line_energy, potential_flow
from dolfbuoy.model.rigid import mooring_offset

ROPE = {"length": 20.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 2}
FLOAT = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
HELD = {"top": {"kind": "fixed", "position": [15.0, 0.0, 0.0]}}
PILED = HullShape(((0.0, 2.0), (1.0, 4.0), (1.0, 2.0), (3.0, 0.0), (4.0, 0.0), (6.0, 1.0)))


def test_a_hull_by_hand():
    """A cone, a step, a tip, nothing for a metre, and a cone upside down."""
    assert (PILED.height, PILED.max_diameter, PILED.tapered) == (6.0, 4.0, True)
    assert PILED.segments == [(0, 1, 1, 2), (1, 3, 1, 0), (4, 6, 0, 0.5)]
    assert PILED.faces() == [(0, 0, 1), (1, 1, 2), (6, 0, 0.5)]
    assert [tuple(map(float, piece)) for piece in PILED.pieces(6)] == [
        (0, 1, 1, 2), (1, 2, 1, 0.5), (2, 3, 0.5, 0), (4, 5, 0, 0.25), (5, 6, 0.25, 0.5),
    ]  # fmt: skip
    assert len(HullShape(((0.0, 1.0), (6.0, 1.0))).pieces(1)) == 3  # no longer than two diameters
    assert len(HullShape(((0.0, 1.0), (6.0001, 1.0))).pieces(1)) == 4
    frusta = math.pi / 3 * np.array([7.0, 2.0, 0.5])
    assert PILED.volume() == pytest.approx(frusta.sum(), rel=1e-14)
    assert [PILED.volume(z) for z in (0.0, 1.0, 3.5, 9.0)] == pytest.approx(
        [0, frusta[0], frusta[:2].sum(), frusta.sum()]
    )
    centers = frusta @ [(1 + 4 + 12) / 28, 1.5, 5.5]
    assert PILED.centroid() == pytest.approx(centers / frusta.sum(), rel=1e-13)
    assert [PILED.waterplane_radius(z) for z in (0.0, 0.5, 2.0, 3.5, 5.0, 6.0, 6.1, -0.1)] == pytest.approx(
        [1.0, 1.5, 0.5, 0.0, 0.25, 0.5, 0.0, 0.0], abs=1e-8
    )
    wet = [PILED.projected(z) for z in (0.5, 1.0, 6.0)]
    changes = [[(0, 1), (1, 1.5)], [(0, 1), (1, 2), (1, 2)]]
    changes.append([*changes[1], (1, 0), (0, 0.5), (0, 0.5)])
    for found, pairs in zip(wet, changes, strict=True):
        powers = (sum(abs(b**n - a**n) for a, b in pairs) for n in (2, 3, 5))
        expected = [factor * power for factor, power in zip((math.pi, 2 / 3 * math.pi, 8 / 45), powers, strict=True)]
        assert found == pytest.approx(expected, rel=1e-13)
    transverse, axial = HullShape(((0.0, 2.0), (3.0, 2.0))).solid_inertia()
    assert (transverse, axial) == pytest.approx((1 / 4 + 9 / 12, 1 / 2))


def test_disks_and_the_axis_of_a_hull():
    """Integrals of exp(i k x), and of x exp(i k x)/i, over a disk; the points sum to the wet volume."""
    k, R = np.array([0.3, 2.0]), np.array([1.5, 0.4])
    area, first = potential_flow.disks(k, R, narrow=False)
    for i, wave in enumerate(k):
        for j, r in enumerate(R):
            mean = quad(lambda x, r=r, wave=wave: 2 * math.sqrt(r * r - x * x) * math.cos(wave * x), -r, r)[0]
            moment = quad(lambda x, r=r, wave=wave: 2 * math.sqrt(r * r - x * x) * x * math.sin(wave * x), -r, r)[0]
            assert (area[i, j], first[i, j]) == pytest.approx((mean, moment), rel=1e-7)
    area, first = potential_flow.disks(k, R, narrow=True)
    np.testing.assert_allclose(area, math.pi * R**2 * [[1], [1]], rtol=1e-14)
    np.testing.assert_allclose(first, math.pi / 4 * np.outer(k, R**4), rtol=1e-14)
    for draft in (0.5, 2.5, 6.0):
        zeta, radius, length = potential_flow.points_on_axis(PILED, draft)
        assert math.pi * radius**2 @ length == pytest.approx(PILED.volume(draft), rel=1e-13)
        assert math.pi * (radius**2 * zeta) @ length == pytest.approx(PILED.centroid(draft) * PILED.volume(draft))
        assert 0 < zeta.min() < zeta.max() < draft
    assert len(potential_flow.points_on_axis(HullShape(((0.0, 2.0), (3.0, 2.0))), 2.0)[0]) == 17 * 6


def test_both_vertical_planes_are_alike():
    """Surge goes with the axis' lean in its plane, heave with nothing."""
    found = potential_flow.on_five(np.array([[1.0, 2, 9], [3, 4, 9], [9, 9, 5]]))
    assert found.tolist() == [[1, 0, 0, 2, 0], [0, 1, 0, 0, 2], [0, 0, 5, 0, 0], [3, 0, 0, 4, 0], [0, 3, 0, 0, 4]]
    heave = Fake(rate=np.array([-1.0]), into=np.array([[2.0]]), out=np.array([[3.0]]))
    plane = Fake(rate=np.array([-4.0, -5]), into=np.array([[1.0, 2], [3, 4]]), out=np.array([[5.0, 6], [7, 8]]))
    rate, into, out = potential_flow.modes_of_five(heave, plane, 10.0)
    assert rate.tolist() == [-1, -4, -5, -4, -5]
    assert into.real.tolist() == [
        [0, 0, 2, 0, 0],
        [1, 0, 0, 20, 0],
        [3, 0, 0, 40, 0],
        [0, 1, 0, 0, 20],
        [0, 3, 0, 0, 40],
    ]
    assert out.real.tolist() == [
        [0, 0, 3, 0, 0],
        [5, 0, 0, 70, 0],
        [6, 0, 0, 80, 0],
        [0, 5, 0, 0, 70],
        [0, 6, 0, 0, 80],
    ]


def test_places_of_a_buoy_from_its_centre():
    buoy = load_scene(
        {"sea": {"depth": 9.0}, "buoy": FLOAT | {"mooring_height": 0.3, "fairleads": {"bow": [1, 2, 0.9]}}}
    ).buoys[0]
    assert mooring_offset(buoy).tolist() == pytest.approx([0, 0, -0.1])
    assert mooring_offset(buoy, "bow").tolist() == pytest.approx([1, 2, 0.5])


# -- nodes and memory --------------------------------------------------------------------------------------------------


def test_nodes_of_a_line():
    """Twice as long from one to the next where three are graded by four; of parts one behind the other."""
    assert cable_nodes(7.0, 3, 4.0).tolist() == pytest.approx([0, 1, 3, 7])
    assert cable_nodes(7.0, 1, 4.0).tolist() == [0, 7]
    assert cable_nodes(8.0, [(2.0, 2), (6.0, 2)], 2.0).tolist() == pytest.approx([0, 2 / 3, 2, 4, 8])
    assert [number_of_cells(elements) for elements in (5, [(2.0, 2), (6.0, 3)])] == [5, 5]


def test_memory_that_a_group_of_processes_may_have(monkeypatch):
    given = {"/sys/fs/cgroup/memory.max": "12345\n"}
    monkeypatch.setattr(builtins, "open", lambda name, *_: io.StringIO(given[name]))
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY, 5))
    assert feasible.memory() == 12345.0
    given["/sys/fs/cgroup/memory.max"] = "max\n"
    assert feasible.memory() > 1e8


@pytest.mark.parametrize(("mass", "said"), [(1.0, True), (0.999, True), (1.001, False)])
def test_an_effective_mass_is_more_than_nothing(mass, said):
    """Of 1 kg of water in each metre, taken away."""
    scene = load_scene({"sea": {"depth": 30.0, "density": 1000.0}, "cable": ROPE | HELD | {
        "line_density": mass, "area": 1e-3, "diameter": 0.05, "added_mass": -1.0,
        "anchor": [0, 0, -1.0], "top": {"kind": "fixed", "position": [15.0, 0, -1.0]}}})  # fmt: skip
    if not said:
        feasible.check_feasible(scene)
        return
    with pytest.raises(InputError, match="is not positive"):
        feasible.check_feasible(scene)


# -- energies ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("blended", [False, True])
@pytest.mark.parametrize("beta", [None, "beta"])
@pytest.mark.parametrize("e", [None, "e"])
def test_energies_that_a_line_has(monkeypatch, e, beta, blended):
    """Of stretching where it stretches; of bending where it bends, of the part of the moment that is elastic."""
    called = Fake(split=lambda w: ["r", "T", "m"], CellVolume=lambda mesh: "h")
    named = Fake(**{name: lambda *of, name=name: (name, *of) for name in ("elastic_energy", "blended_energy")})
    named.bending_energy, named.elastic_moment = lambda *of: ("bending", *of), lambda *of: ("moment", *of)
    named.taut_energy = None
    for name, made in (("ufl", called), ("form", named), ("bending", named)):
        monkeypatch.setattr(line_energy, name, made)
    monkeypatch.setattr(line_energy, "partial", lambda *_, **__: None)
    monkeypatch.setattr(line_energy, "or_taut", lambda lines, value, taut: value)
    lines = Fake(kinematics=lambda: ("r", "T", e, "r_t", None), cable="cable", w="w", mesh="mesh", EI="EI")
    lines.moment_dofs, lines.blended, lines.bending_damping = None, blended, beta
    stretching = [] if e is None else [("elastic_energy", "cable", "e", "T", "r", "r_t")]
    assert line_energy.elastic_energies(lines) == stretching
    lines.moment_dofs = np.zeros((1, 3))
    m = "m" if beta is None else ("moment", "m", "EI", "beta", "r", "r_t")
    more = [("blended_energy", "r", "m", "EI", "h")] if blended else []
    assert line_energy.elastic_energies(lines) == [*stretching, *more, ("bending", m, "EI")]
