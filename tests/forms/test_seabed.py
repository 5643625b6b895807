"""The contact law of the sea bed at a point, and the friction slider at the quadrature points.

Source: the law programmed again in plain Python.
"""

import math

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from dolfbuoy import load_scene
from dolfbuoy.forms import seabed
from dolfbuoy.model.contact import hardness, parameters_of_body, parameters_of_line, plane
from dolfbuoy.model.problem import Problem
from dolfbuoy.scene.lines import Body
from dolfbuoy.solver.compat import real_space
from dolfbuoy.solver.unknowns import Contribution, Part
from dolfbuoy.solver.vector_ops import Work

K, C, SAG, STICK, MU = 7e4, 3e3, 0.013, 9e3, 0.6
NORMAL = np.array([-0.2, 0.1, 1.0]) / math.sqrt(1.05)
RISING, SINKING = np.array([0.3, -0.2, 0.9]), np.array([0.1, 0.4, -0.7])


def number(expression):
    """Numerical value of a UFL expression of numbers, or of an array of them."""
    if expression.ufl_shape:
        return np.array([number(expression[i]) for i in range(expression.ufl_shape[0])])
    return float(apply_derivatives(apply_algebra_lowering(ufl.as_ufl(expression)))(()))


def point(gap, velocity, displacement=None):
    """A contact point with this gap, velocity and r - r_a."""

    def vector(x):
        return ufl.as_vector([ufl.as_ufl(float(c)) for c in x])

    speed = None if velocity is None else ufl.dot(vector(NORMAL), vector(velocity))
    moved = None if displacement is None else vector(displacement)
    return seabed.Contact(vector(NORMAL), ufl.as_ufl(gap), K, C, SAG, speed, STICK, moved)


def pressure(gap, velocity):
    below = max(-gap, 0.0)
    return max(K * below - C * min(below / SAG, 1.0) * float(NORMAL @ velocity), 0.0)


@pytest.mark.parametrize("velocity", [RISING, SINKING, np.zeros(3)], ids=["rising", "sinking", "at rest"])
@pytest.mark.parametrize("gap", [0.4, 1e-9, -0.2 * SAG, -3 * SAG])
def test_pressure(gap, velocity):
    """Zero above the bed, and never tensile; the damper fades in over the sag."""
    p = number(seabed.pressure(point(gap, velocity)))
    assert p == pytest.approx(pressure(gap, velocity), rel=1e-13)
    assert (p > 0) == (gap < 0 and pressure(gap, velocity) > 0)
    np.testing.assert_allclose(number(seabed.support(None, point(gap, velocity))), p * NORMAL, rtol=1e-13)


def test_statics_have_no_damper():
    assert number(seabed.pressure(point(-SAG, None))) == pytest.approx(K * SAG, rel=1e-14)


@pytest.mark.parametrize(("size", "slides"), [(1e-4, False), (0.9, True), (0.0, False)])
def test_friction(size, slides):
    """Along the bed, against the displacement: a spring force, limited to mu p."""
    displacement = size * np.array([0.5, -0.7, 0.4])
    u = displacement - (displacement @ NORMAL) * NORMAL
    at, p = point(-2 * SAG, SINKING, displacement), pressure(-2 * SAG, SINKING)
    force = number(seabed.friction(MU, at))
    assert abs(force @ NORMAL) < 1e-9 * p
    expected = -u * (MU * p / np.linalg.norm(u) if slides else STICK)
    np.testing.assert_allclose(force, expected, rtol=1e-9, atol=1e-12)
    assert (STICK * np.linalg.norm(u) > MU * p) == slides
    assert not np.any(number(seabed.friction(MU, point(0.1, RISING, displacement))))


@pytest.mark.parametrize("velocity", [RISING, SINKING])
def test_only_the_damper_takes_energy(velocity):
    """Power of the support = rate of the spring's energy + damper power, which is never positive."""
    at = point(-0.6 * SAG, velocity)
    along = float(NORMAL @ velocity)
    damper = number(seabed.damping_power(at))
    assert damper < 0
    spring = -K * 0.6 * SAG * along  # d/dt of 1/2 k g^2 with g_t = n . v
    assert number(seabed.support(None, at)) @ velocity == pytest.approx(damper - spring, rel=1e-12)
    assert number(seabed.spring_energy(at)) == pytest.approx(0.5 * K * (0.6 * SAG) ** 2, rel=1e-13)


# -- numbers of a scene, and points ------------------------------------------------------------------------------------

CABLE = {"length": 40.0, "line_density": 30.0, "diameter": 0.1, "axial_stiffness": 1e7, "elements": 5}
CABLE |= {"position_degree": 2, "tension_degree": 1, "top": {"kind": "fixed", "position": [30.0, 4.0, -2.0]}}
BED = {"friction": 0.7, "slope": [0.1, -0.05], "damping_ratio": 0.8}
SCENE = {"sea": {"depth": 20.0}, "cable": CABLE, "seabed": BED}


def test_numbers_of_a_line():
    """The heaviest line sinks by the sag, and all share one bed; a given bed is kept."""
    scene = load_scene(SCENE)
    heavy = scene.network.pieces[0].section.model_copy(update={"line_density": 60.0, "diameter": 0.2})
    w = (30.0 - 1025.0 * math.pi * 0.1**2 / 4) * 9.81
    w_heavy = (60.0 - 1025.0 * math.pi * 0.2**2 / 4) * 9.81
    assert w_heavy / 0.2 < w / 0.1
    for sections in ([scene.network.pieces[0].section], [scene.network.pieces[0].section, heavy]):
        found = parameters_of_line(scene, scene.network.pieces[0].section, hardness(scene, sections))
        assert found.sag == pytest.approx(1e-4 * 20.0, rel=1e-12)
        assert found.stiffness == pytest.approx(w / found.sag, rel=1e-12)
        assert found.damping == pytest.approx(2 * 0.8 * math.sqrt(found.stiffness * 30.0), rel=1e-12)
        assert found.stick == pytest.approx(0.7 * w / 0.02, rel=1e-12)
    assert parameters_of_line(
        scene, heavy, hardness(scene, [scene.network.pieces[0].section, heavy])
    ).stiffness == pytest.approx(2 * found.stiffness, rel=1e-12)
    given = load_scene(SCENE, seabed__stiffness=1e6, seabed__stick_length=0.004, sea__depth=500.0)
    found = parameters_of_line(
        given, given.network.pieces[0].section, hardness(given, [given.network.pieces[0].section])
    )
    assert found[::2] == pytest.approx((1e5, w / 1e5), rel=1e-12)
    assert found.stick == pytest.approx(0.7 * w / 0.004, rel=1e-12)
    deep = load_scene(SCENE, sea__depth=500.0)
    assert parameters_of_line(
        deep, deep.network.pieces[0].section, hardness(deep, [deep.network.pieces[0].section])
    ).sag == pytest.approx(0.01, rel=1e-12)


def test_numbers_of_a_body():
    """A joint body sinks by the sag under its weight in water."""
    scene = load_scene(SCENE)
    found = parameters_of_body(scene, Body(mass=3000.0, volume=0.4))
    weight = (3000.0 - 1025.0 * 0.4) * 9.81
    assert found.stiffness == pytest.approx(weight / 0.002, rel=1e-12)
    assert found.damping == pytest.approx(1.6 * math.sqrt(found.stiffness * 3000.0), rel=1e-12)
    assert found.stick == pytest.approx(0.7 * weight / 0.02, rel=1e-12)
    normal, level = plane(scene)
    x = np.array([3.0, -2.0, -20.0 + 0.3 + 0.1 - 0.002 / normal[2]])
    n = ufl.as_vector(normal.tolist())
    at = seabed.Contact(n, seabed.gap(n, level, ufl.as_vector(x.tolist())), *found[:3], None, found.stick, None)
    assert number(seabed.pressure(at)) == pytest.approx(weight, rel=1e-9)


@pytest.fixture
def problem():
    problem = Problem(load_scene(SCENE), dynamic=True, comm=MPI.COMM_SELF)
    yield problem
    problem.destroy()


@pytest.mark.parametrize("in_c", [False, True])
def test_the_slider(problem, in_c):
    """r_a := r - u min(1, mu p/(k_t |u|)): some points stick, some slide, some are off the bed."""
    lines, bed, u, rng = problem.lines, problem.lines.bed, problem.system.u, np.random.default_rng(3)
    n, d = plane(problem.scene)
    k, c, sag, stick = parameters_of_line(
        problem.scene,
        problem.scene.network.pieces[0].section,
        hardness(problem.scene, [problem.scene.network.pieces[0].section]),
    )
    nodes = len(lines.node_s)
    foot = np.column_stack([lines.node_s, rng.uniform(-1, 1, nodes), np.zeros(nodes)])
    u[lines.node_dofs] = foot + np.multiply.outer(rng.uniform(-2, 0.8, nodes) * sag - foot @ n + d, n)
    r = bed.points.of(u[lines.node_dofs])
    held = r + rng.normal(size=r.shape) * np.geomspace(1e-4, 1.0, r[..., 0].size).reshape(*r.shape[:2], 1)
    bed.hold(held)
    lines.gamma_v.value = 3.0
    speed = rng.uniform(-0.3, 0.3, (nodes, 3))
    lines.history_v.x.array[lines.node_dofs] = speed - 3.0 * u[lines.node_dofs]
    (accept,) = bed.when_accepted(u)
    assert isinstance(accept, Work)
    accept() if in_c else bed.accept(u)
    speed, seen = bed.points.of(speed), set()
    for at in np.ndindex(r.shape[:2]):
        below = max(d - float(r[at] @ n), 0.0)
        p = max(k * below - c * min(below / sag, 1.0) * float(n @ speed[at]), 0.0)
        slide = (np.eye(3) - np.outer(n, n)) @ (r[at] - held[at])
        share = min(1.0, 0.7 * p / (stick * np.linalg.norm(slide)))
        seen.add("off" if p == 0 else "sticks" if share == 1 else "slides")
        np.testing.assert_allclose(bed.holds[at], r[at] - share * slide, atol=1e-9)
    assert seen == {"off", "sticks", "slides"}


def test_points_are_those_of_the_forms(problem):
    """A function of s interpolated at the nodes: its polynomial's values at the quadrature points."""
    lines, bed = problem.lines, problem.lines.bed
    values = np.column_stack([lines.node_s, lines.node_s**2, 1 + 0 * lines.node_s])
    s = bed.points.s
    np.testing.assert_allclose(bed.points.of(values), np.stack([s, s**2, 1 + 0 * s], axis=-1), atol=1e-10)
    bed.hold(bed.points.of(values))
    stored = assembled(bed.held, lines)
    np.testing.assert_allclose(stored, [40.0**2 / 2, 40.0**3 / 3, 40.0], rtol=1e-12)
    rate = assembled(bed.held, lines, lambda x: x * ufl.SpatialCoordinate(lines.mesh)[0])
    np.testing.assert_allclose(rate, [40.0**3 / 3, 40.0**4 / 4, 40.0**2 / 2], rtol=1e-12)


def assembled(function, lines, times=lambda x: x):
    """Integral of a three-component function over the lines."""
    test = ufl.TestFunction(real_space(lines.mesh, 3))
    part = Part("sum", fem.Function(test.ufl_function_space()), 0)
    contribution, b = Contribution(ufl.inner(times(function), test) * lines.dx, part), np.zeros(3)
    contribution.prepare()
    contribution.add_to_vector(b)
    return b


def test_what_lies(problem):
    """Length, touchdown and sag of a straight line crossing the bed."""
    lines, u = problem.lines, problem.system.u
    n, d = plane(problem.scene)
    start = np.array([1.0, 2.0, 0.0])
    start = start + (d - start @ n - 0.3) * n
    along = np.array([0.9, 0.1, 0.0])
    along = along / np.linalg.norm(along)
    along = along - (along @ n) * n + 0.05 * n  # leaves the bed after 6 m
    lines.set_shape(u, lambda s: start + np.multiply.outer(s, along), lambda s: 0 * s)
    found = lines.bed.grounded(u)
    assert [found.length, found.s] == pytest.approx([6.0, 6.0], rel=1e-9)
    np.testing.assert_allclose(found.touchdown, start + 6.0 * along, rtol=1e-9)
    assert found.sag == pytest.approx(0.3, rel=1e-9)
    lines.set_shape(u, lambda s: start + n + np.multiply.outer(s, along), lambda s: 0 * s)
    nothing = lines.bed.grounded(u)
    assert nothing.length == nothing.sag == 0
    assert np.isnan(nothing.touchdown).all()


def test_waves_of_elements_lie(problem):
    """A node that an element lifts between points that touch lies with them; two elements that hang do not."""
    lines, u = problem.lines, problem.system.u
    n, d = plane(problem.scene)
    along = np.array([1.0, 0.0, 0.0]) - n[0] * n

    def lay(height):
        heights = np.interp(lines.node_s, np.arange(0.0, 41.0, 4.0), height)  # five elements, nodes every 4 m
        u[lines.node_dofs] = np.multiply.outer(lines.node_s, along) + np.multiply.outer(heights + d, n)

    lay([-0.2, -0.2, 0.1, -0.2, -0.2, 0.4, 1.0, 2.0, 3.0, 4.0, 5.0])
    found = lines.bed.grounded(u)
    assert [found.length, found.s] == pytest.approx(2 * [16.0 + 8.0 * 0.2 / 1.2], rel=1e-9)
    lay([-0.2, -0.2, -0.2, 0.5, 1.0, 1.0, 1.0, 0.5, -0.2, -0.2, -0.2])
    arch = lines.bed.grounded(u)
    assert arch.s == 40.0
    assert 16.0 < arch.length < 24.0


def test_without_a_bed_there_is_nothing():
    problem = Problem(load_scene(SCENE, seabed=None), dynamic=True, comm=MPI.COMM_SELF)
    assert problem.lines.bed is None
    assert problem.lines.memory == {}
    problem.destroy()
