"""Quadrature points that follow the water plane along the hull: accuracy, number, and continuity.

Source: the wet segments of the same hull, integrated adaptively between the heights where they are not smooth.
"""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.spatial.transform import Rotation

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem

DENSITY, GRAVITY = 1025.0, 9.81
SHIPPED = ("short", "long", "free-buoy")


class Hull:
    """A buoy, or a shipped one without its cable, in still water at any pose."""

    def __init__(self, buoy, **solver):
        buoy = buoy if isinstance(buoy, dict) else load_scene(buoy).to_dict()["buoy"]
        scene = load_scene({"sea": {"depth": 50.0, "density": DENSITY}, "buoy": buoy, "solver": solver})
        self.problem = Problem(scene, dynamic=False)
        self.buoy, self.system = self.problem.buoy, self.problem.system

    def put(self, height, tilt, heading=0.4):
        """Place C at a height above the water; tilt in radians."""
        x, y, z, w = Rotation.from_rotvec(tilt * np.array([-math.sin(heading), math.cos(heading), 0.0])).as_quat()
        self.system.u[self.buoy.part.slice] = self.buoy.reference.x.array[:] = [0.0, 0.0, height, w, x, y, z]
        self.system.publish()

    def displaced(self):
        """Volume and its moment about C, over g, from the residual."""
        residual = self.system.evaluate()[self.buoy.part.slice] / (DENSITY * GRAVITY)
        return np.array([self.buoy.mass.mass / DENSITY - residual[2], np.linalg.norm(residual[4:7])])

    def stiffness(self):
        """Area of the water plane, from the Jacobian."""
        self.system.assemble_jacobian()
        return self.system.A.getValue(2, 2) / (DENSITY * GRAVITY)

    def points(self):
        """Points used in the last evaluation."""
        groups = self.buoy.hull.points.wet, self.buoy.hull.points.cut
        return sum(int(self.system.shared.count(g.mesh, g.cells)[0]) for g in groups)

    def size(self):
        shape = self.buoy.shape
        return np.array([shape.volume(), shape.volume() * shape.height])


def exact(hull, height, tilt):
    """Volume, its moment about C and the area of the water plane, by adaptive quadrature of the wet segments."""
    up, s = math.cos(tilt), abs(math.sin(tilt))
    total = np.zeros(3)
    for a, b, ra, rb in hull.buoy.shape.segments:
        R = lambda z, a=a, b=b, ra=ra, rb=rb: ra + (rb - ra) * (z - a) / (b - a)  # noqa: E731
        depth = lambda z: -(height + (z - hull.buoy.mass.height) * up)  # noqa: E731
        ends = [a, b]
        for side in (1, -1):  # depth = side R sin(tilt), both linear
            f, g = (depth(z) - side * R(z) * s for z in (a, b))
            if f * g < 0:
                ends.append(a + (b - a) * f / (f - g))

        def segment(z, R=R, depth=depth):
            c = np.clip(depth(z) / (R(z) * s), -1, 1)
            area, lever = R(z) ** 2 * (math.acos(-c) + c * math.sqrt(1 - c * c)), z - hull.buoy.mass.height
            lower = (
                2 / 3 * R(z) ** 3 * (1 - c * c) ** 1.5
            )  # first moment towards the lower side, where the hull leans to
            return area, area * lever * s + lower * up, 2 * R(z) / s * math.sqrt(1 - c * c)

        for low, high in itertools.pairwise(sorted(ends)):
            total += quad_vec(lambda z, f=segment: np.array(f(z)), low, high, epsabs=1e-13, epsrel=1e-12)[0]
    return np.array([total[0], abs(total[1])]), total[2]


@pytest.fixture(scope="module", params=SHIPPED)
def hull(request):
    made = Hull(request.param)
    yield made
    made.problem.destroy()


@pytest.mark.parametrize("largest", [10, 180])
def test_volume_centre_and_water_plane(hull, largest):
    """Random partly wet poses, with at most 80 points."""
    draw, shape = np.random.default_rng(3), hull.buoy.shape
    area = math.pi * shape.max_diameter**2 / 4
    for _ in range(25):
        tilt = math.radians(draw.uniform(0.5, largest))
        height = (hull.buoy.mass.height - draw.uniform(0, 1) * shape.height) * math.cos(tilt) + draw.uniform(-0.5, 0.5)
        hull.put(height, tilt)
        expected, plane = exact(hull, height, tilt)
        assert np.abs(hull.displaced() - expected).max() < 1e-8 * hull.size().min()
        assert abs(hull.stiffness() - plane) < 1e-8 * area
        assert hull.points() <= 80


@pytest.mark.parametrize("tilt", [0.0, 1e-6])
def test_upright(hull, tilt):
    """Volume and water plane at any draft, the water line on a station, at the keel and at the deck among them."""
    shape = hull.buoy.shape
    drafts = [0.3 * shape.height, 0.97 * shape.height, *shape.heights, 1e-9, shape.height - 1e-9]
    for draft in drafts:
        hull.put(hull.buoy.mass.height * math.cos(tilt) - draft, tilt)
        on_station = np.abs(shape.heights - draft).min() < 1e-6 * shape.height
        # a disc in the water line is half wet over the height R tilt, or R LEAST_TILT
        allowed = tilt + 3e-8 if on_station else 1e-8
        assert abs(hull.displaced()[0] - shape.volume(draft)) < allowed * shape.volume()
    hull.put((hull.buoy.mass.height - 0.5 * shape.height) * math.cos(tilt), tilt)
    plane = math.pi * shape.waterplane_radius(0.5 * shape.height) ** 2
    assert hull.stiffness() == pytest.approx(plane, rel=1e-8)


def test_inverted_and_lying(hull):
    """Upside down the other end is wet; on its side half of it."""
    shape, center = hull.buoy.shape, hull.buoy.mass.height
    hull.put(0.4 * shape.height - center, math.pi)
    # the body height h is at z = height - (h - center): wet from there to the deck
    cut = 0.4 * shape.height
    assert hull.displaced()[0] == pytest.approx(shape.volume() - shape.volume(cut), rel=1e-9)
    hull.put(0.0, math.pi / 2)
    assert hull.displaced()[0] == pytest.approx(shape.volume() / 2, rel=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 1e-4, 0.3])
def test_no_jumps(hull, tilt):
    """A breakpoint that crosses a station, appears or vanishes changes the residual by the quadrature error only."""
    shape, s = hull.buoy.shape, math.sin(tilt)
    for station, radius in zip(shape.heights, shape.radii, strict=True):
        for side in (-1, 1):
            at = (hull.buoy.mass.height - station) * math.cos(tilt) + side * radius * s
            both = []
            for step in (-1e-11, 1e-11):
                hull.put(at + step, tilt)
                both.append(hull.displaced())
            assert np.abs(both[1] - both[0]).max() < 3e-9 * hull.size().min()


def test_dry_and_drowned(hull):
    shape = hull.buoy.shape
    for tilt in (0.0, 0.7, 2.0):
        hull.put(20.0, tilt)
        assert hull.displaced()[0] == pytest.approx(0.0, abs=1e-14)
        assert hull.points() == 0
        hull.put(-20.0, tilt)
        assert hull.displaced()[0] == pytest.approx(shape.volume(), rel=1e-13)


@pytest.mark.parametrize(
    "hull",
    [
        [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]],
        [[0.0, 2.0], [1.0, 0.0], [2.0, 2.0]],
        [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [1.5, 0.0], [1.5, 1.5], [2.0, 1.5]],
    ],
    ids=["no faces", "waist", "nothing between"],
)
@pytest.mark.parametrize("tilt", [0.02, 0.5, 1.5])
def test_pointed_hulls(hull, tilt):
    """Zero diameters: hulls without end faces, and heights where they have no disk."""
    buoy = {"hull": hull, "mass": 500.0, "axial_added_mass": 0.6, "rotational_added_mass": 0.5, "axial_drag": 1.0}
    found = Hull(buoy)
    for height in (-1.4, -0.3, 0.0, 0.9):
        found.put(height, tilt)
        volume, moment = exact(found, height, tilt)[0]
        assert np.abs(found.displaced() - [volume, moment]).max() < 1e-8 * found.size().max()
