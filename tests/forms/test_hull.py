"""Hull strips against the exact geometry of a partly submerged cylinder, and their sum against Eq. (10).

Source: exact geometry by quadrature over still-water columns, righting levers in tests/reference, Eq. (10) by hand.
"""

import itertools
import math

import numpy as np
import pytest
from helpers import reference, reference_buoy
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.meshes import HullShape
from dolfbuoy.model.problem import Problem
from dolfbuoy.model.rigid import float_upright, mass_properties, shape_of
from dolfbuoy.results.observe import Observer

BUOYS = ("buoyA_short", "buoyA0_short_unstable", "buoyB_long")
HEADING = 0.4  # [rad] towards which the hull is tilted
DENSITY, GRAVITY = 1025.0, 9.81


class Pose:
    """Wet hull and loads of a static problem for a free buoy in any pose."""

    def __init__(self, buoy, **solver):
        scene = load_scene({"sea": {"depth": 50.0, "density": DENSITY}, "buoy": buoy, "solver": solver})
        self.problem = Problem(scene, dynamic=False)
        self.observer = Observer(self.problem)
        self.center, self.mass = self.problem.buoy.mass.height, self.problem.buoy.mass.mass
        self.lean = np.array([math.cos(HEADING), math.sin(HEADING), 0.0])  # direction in which the top leans

    def put(self, keel_height, degrees):
        """Place the keel point at (0, 0, keel_height), tilted."""
        turn = Rotation.from_rotvec(math.radians(degrees) * np.array([-self.lean[1], self.lean[0], 0.0]))
        turn = turn * Rotation.from_rotvec([0, 0, 1.1])  # a turn about the axis changes nothing
        x, y, z, w = turn.as_quat()
        r_C = np.array([0, 0, keel_height]) + turn.apply([0, 0, self.center])
        self.problem.system.u[self.problem.buoy.part.slice] = [*r_C, w, x, y, z]
        self.problem.buoy.reference.x.array[:] = [*r_C, w, x, y, z]  # no turn, hence no gauge torque
        self.problem.system.publish()
        return r_C

    def displaced(self, keel_height, degrees):
        """(displaced mass, moment of it about C towards the lean)."""
        r_C = self.put(keel_height, degrees)
        values = self.observer.values({})
        mass, center = values["displaced_mass"].item(), values["buoyancy_center"][0]
        return mass, mass * float((center - r_C) @ self.lean)

    def loads(self, keel_height, degrees):
        """(force, torque about C) of weight and water on the buoy, from the compiled residual."""
        self.put(keel_height, degrees)
        residual = self.problem.system.evaluate()[self.problem.buoy.part.slice]
        return -residual[:3], -residual[4:7]

    def close(self):
        self.problem.destroy()


def exact_displaced(b, keel_height, degrees):
    """Volume and its moment about C towards the lean, by quadrature over the disk of the still water's columns.

    At the body point (x, y) of the cross-section the column from keel to top is wet where its height is below 0.
    """
    R, H, s, c = b["D"] / 2, b["H"], math.sin(math.radians(degrees)), math.cos(math.radians(degrees))

    c = 0.0 if abs(c) < 1e-12 else c

    def column(x):
        """Wet part of 0 < zeta < H at distance x in the direction of the lean: keel + c zeta - s x < 0."""
        at_keel, at_top = keel_height - s * x, keel_height + c * H - s * x
        if c == 0:
            return (0.0, H) if at_keel < 0 else (0.0, 0.0)
        crossing = min(max(-at_keel / c, 0.0), H)
        return (0.0, crossing) if at_keel < at_top else (crossing, H)

    def volume(phi):
        low, high = column(R * math.sin(phi))
        return 2 * R**2 * math.cos(phi) ** 2 * (high - low)

    def moment(phi):
        x = R * math.sin(phi)
        low, high = column(x)
        arm = (high**2 - low**2) / 2 - b["zG_above_keel"] * (high - low)
        return 2 * R**2 * math.cos(phi) ** 2 * (c * x * (high - low) + s * arm)

    kinks = [keel_height / s, (keel_height + c * H) / s] if s > 1e-12 else []
    ends = sorted({-math.pi / 2, math.pi / 2, *(math.asin(x / R) for x in kinks if abs(x) < R)})
    return tuple(
        DENSITY * sum(quad(f, low, high, epsrel=1e-11)[0] for low, high in itertools.pairwise(ends))
        for f in (volume, moment)
    )


@pytest.fixture(scope="module", params=BUOYS)
def named_pose(request):
    pose = Pose(reference_buoy(request.param))
    yield reference("buoy_statics")[request.param], pose
    pose.close()


def test_exact_geometry_agrees_with_the_reference():
    """The quadrature of this file against the righting levers of the reference."""
    for name in BUOYS:
        b = reference("buoy_statics")[name]
        for row in b["GZ_curve_free"]:
            mass, moment = exact_displaced(b, row["zK"], row["deg"])
            assert pytest.approx(b["M"], rel=1e-9) == mass
            assert pytest.approx(row["GZ"], abs=1e-8) == moment / b["M"]


def test_draft_and_metacentre_in_closed_form():
    for name in BUOYS:
        b = reference("buoy_statics")[name]
        buoy = load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy(name)}).buoy[0]
        shape, mass = shape_of(buoy), mass_properties(buoy)
        assert pytest.approx(b["M"], rel=1e-14) == mass.mass
        assert pytest.approx(b["zG_above_keel"], rel=1e-14) == mass.height
        upright = float_upright(shape, mass, DENSITY, GRAVITY)
        for key, value in (("draft", upright.draft), ("KB", upright.KB), ("BM", upright.BM), ("GM", upright.GM)):
            assert pytest.approx(b[key], rel=1e-12) == value, key
        for row in b["moored_table"]:
            if row["draft"] is None:
                with pytest.raises(InputError, match="sinks"):
                    float_upright(shape, mass, DENSITY, GRAVITY, row["T_keel"], 0.0)
                continue
            moored = float_upright(shape, mass, DENSITY, GRAVITY, row["T_keel"], 0.0)
            assert pytest.approx(row["draft"], rel=1e-12) == moored.draft
            assert pytest.approx(row["heave_stiffness"], rel=1e-12) == moored.heave_stiffness
            assert pytest.approx(row["pitch_stiffness_about_keel"], rel=1e-10) == moored.GM * mass.mass * GRAVITY


def test_inertia_of_hull_and_point_masses():
    """Uniform solid hull, its own centre given: the transverse inertia of the reference is about the common centre."""
    for name in BUOYS:
        b = reference("buoy_statics")[name]
        mass = mass_properties(load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy(name)}).buoy[0])
        np.testing.assert_allclose(mass.inertia, [b["I_transverse_about_C"]] * 2 + [b["I_axial"]], rtol=1e-13)


def test_hull_that_sinks_is_refused():
    buoy = load_scene({"sea": {"depth": 50.0}, "buoy": reference_buoy("buoyA_short")}).buoy[0]
    shape, mass = shape_of(buoy), mass_properties(buoy)
    with pytest.raises(InputError, match="sinks"):
        float_upright(shape, mass, DENSITY, GRAVITY, pull=48e3)
    assert float_upright(shape, mass, DENSITY, GRAVITY, pull=47.7e3).draft < shape.height  # reserve buoyancy 47720 N


def test_upright_displacement_between_the_ends(named_pose):
    """A cylinder that floats upright displaces its area times its draft."""
    b, pose = named_pose
    area = math.pi * b["D"] ** 2 / 4
    for draft in np.linspace(0.2, 0.8, 7) * b["H"]:
        mass, moment = pose.displaced(-draft, 0)
        assert pytest.approx(DENSITY * area * draft, rel=1e-13) == mass
        assert abs(moment) < 1e-12 * mass


@pytest.mark.parametrize("degrees", [0, 17, 90, 133, 180])
def test_deep_and_dry_hull_are_exact(named_pose, degrees):
    b, pose = named_pose
    full = DENSITY * math.pi * b["D"] ** 2 / 4 * b["H"]
    mass, moment = pose.displaced(-10.0, degrees)
    assert pytest.approx(full, rel=1e-11) == mass  # 1e-15 by the clamp of acos, the rest by quadrature
    lever = (b["H"] / 2 - b["zG_above_keel"]) * math.sin(math.radians(degrees))
    assert pytest.approx(full * lever, abs=1e-9 * full) == moment
    mass, moment = pose.displaced(10.0, degrees)
    assert abs(mass) < 1e-11 * full
    assert abs(moment) < 1e-11 * full


#: Largest error of the wet mass over that mass, and of the righting lever over the diameter.
DEFAULT_MASS, DEFAULT_LEVER = 1e-10, 2e-8


@pytest.mark.parametrize("degrees", [1e-4, 1, 5, 30, 90, 150, 179, 180])
def test_displacement_and_righting_lever(named_pose, degrees):
    """Half submerged and a little deeper."""
    b, pose = named_pose
    for keel in (_keel_when_half_submerged(b, degrees), _keel_when_half_submerged(b, degrees) - 0.11 * b["H"]):
        mass, moment = pose.displaced(keel, degrees)
        exact_mass, exact_moment = exact_displaced(b, keel, degrees)
        assert abs(mass - exact_mass) < DEFAULT_MASS * exact_mass
        assert abs(moment - exact_moment) < DEFAULT_LEVER * b["D"] * exact_mass


def _keel_when_half_submerged(b, degrees):
    """Keel height with the midpoint of the axis at the water surface."""
    return -b["H"] / 2 * math.cos(math.radians(degrees))


def test_righting_levers_of_the_reference(named_pose):
    b, pose = named_pose
    for row in b["GZ_curve_free"]:
        mass, moment = pose.displaced(row["zK"], row["deg"])
        assert pytest.approx(b["M"], rel=DEFAULT_MASS) == mass
        assert pytest.approx(row["GZ"], abs=DEFAULT_LEVER * b["D"]) == moment / b["M"]


@pytest.mark.parametrize("degrees", [30, 150])
def test_points_converge_like_those_of_a_smooth_function(degrees):
    """Every two extra points reduce the error tenfold or more: the square roots at the ends of the cut do no harm."""
    b, orders = reference("buoy_statics")["buoyB_long"], [5, 9, 13, 17]
    keel = _keel_when_half_submerged(b, degrees) - 0.11 * b["H"]
    exact = exact_displaced(b, keel, degrees)
    errors = []
    for degree in orders:
        pose = Pose(reference_buoy("buoyB_long"), hull_quadrature_degree=degree)
        errors.append(np.abs(np.subtract(pose.displaced(keel, degrees), exact)).max() / exact[0])
        pose.close()
    assert errors[0] > 1e-4
    assert np.all(np.array(errors[1:]) < 0.1 * np.array(errors[:-1]))


def test_metacentric_height_from_the_compiled_torque():
    """dtau/dtheta of the upright hull is - M g GM."""
    for name in BUOYS:
        b = reference("buoy_statics")[name]
        pose = Pose(reference_buoy(name))
        angle = 0.01
        levers = []
        for degrees in (angle, -angle):
            force, torque = pose.loads(-b["draft"], degrees)
            assert abs(force[2]) < 1e-6 * b["M"] * GRAVITY
            about = torque @ [-pose.lean[1], pose.lean[0], 0.0]
            levers.append(about / (b["M"] * GRAVITY))
        pose.close()
        GM = -(levers[0] - levers[1]) / (2 * math.sin(math.radians(angle)))
        assert pytest.approx(b["GM"], rel=1e-6) == GM, name


def test_loads_and_outputs_are_the_same_integrals(named_pose):
    """Force and torque of the residual equal those of the weight at C and the displaced mass at B."""
    b, pose = named_pose
    force, torque = pose.loads(-0.3 * b["H"], 25)
    mass, moment = pose.displaced(-0.3 * b["H"], 25)
    np.testing.assert_allclose(force, [0, 0, GRAVITY * (mass - b["M"])], atol=1e-9 * b["M"])
    np.testing.assert_allclose(
        torque, GRAVITY * moment * np.array([pose.lean[1], -pose.lean[0], 0.0]), atol=1e-9 * b["M"]
    )


def test_uniform_flow_and_acceleration_add_up_to_equation_10():
    """Deep hull of varying diameter in a uniform current, translating and accelerating: one Morison force in B.

    F = -1/2 C rho <D> H |v_n| v_n - C_A M_D a + axial terms of the ends, with the torque r_CB x F of the strips.
    """
    speed, heading, C_d, C_A, mass = 1.7, 35.0, 0.9, 0.45, 300.0  # added mass: across the axis
    hull = [[0.0, 1.2], [2.0, 1.2]]
    body = {"hull": hull, "mass": mass, "center_of_mass": 0.55, "added_mass": C_A, "normal_drag": C_d}
    scene = load_scene(
        {
            "sea": {"depth": 50.0, "density": DENSITY},
            "buoy": body,
            "current": {"speed": speed, "direction_deg": heading},
        }
    )
    problem = Problem(scene, dynamic=True)
    buoy = problem.buoy
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])
    x, y, z, w = turn.as_quat()
    velocity, acceleration = np.array([0.4, -0.8, 0.3]), np.array([0.7, 0.2, -0.5])
    state = np.concatenate([[1.0, 2.0, -20.0], mass * velocity, [w, x, y, z], [0, 0, 0]])
    rate = np.concatenate([velocity, mass * acceleration, np.zeros(4), np.zeros(3)])
    buoy.gamma.value = 3.0
    buoy.history.x.array[:] = rate - 3.0 * state
    problem.system.u[:] = state
    problem.system.publish()
    for contribution in problem.system.residuals:
        contribution.prepare()
    residual = problem.system.evaluate()
    force, torque = mass * acceleration - residual[3:6], -residual[10:13]

    R, H = 0.6, 2.0
    displaced = DENSITY * math.pi * R**2 * H
    current = speed * np.array([math.cos(math.radians(heading)), math.sin(math.radians(heading)), 0])
    d = turn.apply([0, 0, 1])
    relative = velocity - current
    across = relative - (relative @ d) * d
    expected = -0.5 * C_d * DENSITY * 2 * R * H * np.linalg.norm(across) * across
    expected -= C_A * displaced * (acceleration - (acceleration @ d) * d)
    lift = displaced * np.array([0, 0, GRAVITY])
    weight = mass * np.array([0, 0, -GRAVITY])
    r_CB = (H / 2 - 0.55) * d
    np.testing.assert_allclose(force, expected + lift + weight, rtol=1e-9)
    about_C = np.cross(r_CB, expected + lift)
    np.testing.assert_allclose(torque, about_C - (about_C @ d) * d, rtol=1e-9, atol=1e-6)
    assert np.linalg.norm(expected) > 500
    problem.destroy()


STEPPED = HullShape(((0.0, 0.8), (0.5, 0.8), (0.5, 0.3), (1.7, 0.5), (2.0, 1.6), (2.9, 1.2)))


def test_projected_areas_of_a_hull_that_widens_and_narrows():
    """Keel, and what turns along the axis between it and the draft, whichever way: areas, half spheres, discs."""
    shape = HullShape(((0.0, 1.0), (1.0, 3.0), (2.0, 3.0), (4.0, 1.0)))
    for draft, radii in ((1.5, (0.0, 0.5, 1.5)), (3.0, (0.0, 0.5, 1.5, 1.0)), (4.0, (0.0, 0.5, 1.5, 0.5, 0.0))):
        found = shape.projected(draft)
        for (n, factor), sum_ in zip(((2, np.pi), (3, 2 / 3 * np.pi), (5, 8 / 45)), found, strict=True):
            assert sum_ == pytest.approx(factor * sum(abs(b**n - a**n) for a, b in itertools.pairwise(radii)))


def stepped_radius(z):
    """Half the diameters interpolated between the stations above."""
    return np.interp(z, [0.5, 1.7, 2.0, 2.9], [0.15, 0.25, 0.8, 0.6]) if z > 0.5 else 0.4


@pytest.mark.parametrize("draft", [0.3, 1.1, 1.9, 2.5, None])
def test_volume_and_centroid_of_a_stepped_hull(draft):
    """Cones and a step, wet up to any height, by adaptive quadrature."""
    top = 2.9 if draft is None else draft

    def integral(f):
        ends = sorted({z for z in (0.0, 0.5, 1.7, 2.0, top) if z <= top})
        return sum(quad(lambda z: f(z, stepped_radius(z)), *e, epsabs=1e-13)[0] for e in itertools.pairwise(ends))

    volume = integral(lambda _, r: math.pi * r**2)
    center = integral(lambda z, r: math.pi * r**2 * z) / volume
    assert STEPPED.volume(draft) == pytest.approx(volume, rel=1e-10)
    assert STEPPED.centroid(draft) == pytest.approx(center, rel=1e-10)
    assert STEPPED.waterplane_radius(top) == pytest.approx(stepped_radius(top), rel=1e-6)
    if draft is None:
        transverse = integral(lambda z, r: math.pi * r**4 / 4 + math.pi * r**2 * (z - center) ** 2) / volume
        axial = integral(lambda _, r: math.pi * r**4 / 2) / volume
        assert STEPPED.solid_inertia() == pytest.approx((transverse, axial), rel=1e-10)
        assert (STEPPED.height, STEPPED.max_diameter) == (2.9, 1.6)


def test_pieces_are_shared_out_by_length():
    """Every station is the end of a piece; a very short frustum has one."""
    pieces = STEPPED.pieces(29)
    ends = [pieces[0][0], *(b for _, b, _, _ in pieces)]
    np.testing.assert_allclose(ends, np.linspace(0.0, 2.9, 30), atol=1e-12)
    assert [(a, b) for a, b, _, _ in STEPPED.pieces(3)] == [(0.0, 0.5), (0.5, 1.7), (1.7, 2.0), (2.0, 2.9)]
    for a, b, ra, rb in pieces:
        assert (ra + rb) / 2 == pytest.approx(stepped_radius((a + b) / 2), rel=1e-9)


def test_faces_are_ends_and_steps():
    assert STEPPED.faces() == [(0.0, 0.0, 0.4), (0.5, 0.15, 0.4), (2.9, 0.0, 0.6)]
    assert HullShape(((0.0, 0.0), (1.0, 2.0), (2.0, 0.0))).faces() == []
    assert STEPPED.tapered
    assert not HullShape(((0.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 2.0))).tapered


def test_stations_that_nearly_coincide_are_a_step():
    """A frustum too thin for a finite slope is ignored."""
    thin = HullShape(((0.0, 1.0), (5e-324, 0.8), (1.0, 0.8), (1.0 + 2.3e-16, 0.5), (2.0, 0.5)))
    step = HullShape(((0.0, 1.0), (0.0, 0.8), (1.0, 0.8), (1.0, 0.5), (2.0, 0.5)))
    assert thin.volume() == pytest.approx(step.volume(), rel=1e-14)
    np.testing.assert_allclose(thin.radius(np.array([0.5, 1.5]), np.array([0.5, 1.5])), [0.4, 0.25])
    np.testing.assert_allclose(thin.pieces(4), step.pieces(4), atol=1e-14)
    np.testing.assert_allclose(thin.faces(), step.faces(), rtol=1e-14)


def test_water_plane_at_the_end_of_a_part():
    """Where a cylinder continues as a cone both have the same water plane; at a step it is that of the part below."""
    hull = HullShape([[0.0, 2.0], [1.0, 2.0], [1.0, 3.0], [2.0, 1.0], [3.0, 1.0]])
    expected = [(0.0, 1.0), (0.5, 1.0), (1.0, 1.0), (1.5, 1.0), (2.0, 0.5), (3.0, 0.5), (3.1, 0.0), (-0.1, 0.0)]
    assert [hull.waterplane_radius(draft) for draft, _ in expected] == pytest.approx([r for _, r in expected], abs=1e-9)
