"""Quadrature along the axis of a hull that follows the water plane.

What is wet is smooth along the axis but for the stations of the hull and for the two heights at which the surface
begins and ends to cut the disks, where the wet area goes like the power 3/2 of the distance.  So the intervals between
stations are cut there, dry pieces are left out, and on the pieces that are cut the angle theta, c = -cos(theta), is
the variable of integration: Gauss's points then converge as fast as on the others, at any tilt, upright too.

Points are found anew before every evaluation of residual and Jacobian, and stay where they are in differentiation:
what the integral changes by their motion is the error of the quadrature.  It is done in C, as a hook of the System.
"""

import numpy as np
from dolfinx import fem

from ..forms import hull
from ..solver import compat
from ..solver.c_code import address, core

ZETA, RADIUS, LENGTH, TAPER = range(4)  #: numbers of a point: on the axis, R, weight [m], |R'|


class PointGroup:
    """Points, each on a cell of the length 1 of a mesh: a piece of the axis has those of Gauss's rule of `degree`.

    coefficient: a Function of four numbers, ZETA, RADIUS, LENGTH and TAPER.  To integrate over the axis is to integrate
    LENGTH over the `cells`, with one point.  (One cell with many points would be the same to FFCx; but cells are done
    several at a time, `solver.lanes`.)
    """

    def __init__(self, mesh, cells, degree):
        self.mesh, self.cells = mesh, np.array(cells, dtype=np.int32)
        space = compat.function_space(mesh, compat.element(mesh, "DG", 0, 4))
        self.coefficient = fem.Function(space)
        self.at, self.weights = map(np.ascontiguousarray, compat.interval_quadrature(degree))
        self.places = np.ascontiguousarray(4 * compat.cell_dofs(space)[self.cells], dtype=np.int32)

    def describe(self, group, out, count):
        """Fill in C's description.  out: for the numbers of the coefficient, count: of points in use, array of one."""
        group.points, group.at, group.weights = len(self.at), address(self.at), address(self.weights)
        group.capacity, group.places = len(self.cells), address(self.places)
        group.out, group.count = address(out), address(count)


class HullPoints:
    """The points of a hull: `wet` where its disks are all wet, `cut` where the surface cuts them.

    frusta: [(height, height, radius, radius)], each with points of either kind.  averaged: waves over the disks.
    """

    def __init__(self, frusta, wet, cut, averaged=False):
        self.frusta, self.wet, self.cut = np.array(frusta, dtype=np.float64), wet, cut
        self.averaged = averaged

    def following(self, position, quaternion, center, wave, out, count, sea=None):
        """What C's function `follow` needs to make the points follow: a struct.

        position, quaternion, center: arrays that hold r_C, q_4 and the height of C.  wave: the arrays of amplitude,
        wavenumber, time phase, cosine and sine of its direction; None without a regular wave.  sea: an irregular one,
        of `Kinematics.of_hull`.  out, count: of a PointGroup, where its numbers and the number of its points in use go.
        The arrays must live as long as the struct.
        """
        context = core().ffi.new("hull_points *")
        context.frusta, context.frustum = len(self.frusta), address(self.frusta)
        for group, described in ((self.wet, context.wet), (self.cut, context.cut)):
            group.describe(described, out(group), count(group))
        context.position, context.quaternion, context.center = map(address, (position, quaternion, center))
        names = "amplitude", "wavenumber", "time_phase", "cos_direction", "sin_direction"
        for name, array in zip(names, wave or (), strict=False):
            setattr(context, name, address(array))
        if sea is not None:
            context.sea = sea
        context.averaged, context.least_tilt = self.averaged, hull.LEAST_TILT
        return context
