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

from ..forms.hull import LEAST_TILT
from ..solver import c_code, compat
from ..solver.c_code import address

ZETA, RADIUS, LENGTH, TAPER = range(4)  #: numbers of a point: on the axis, R, weight [m], |R'|

_DECLARATIONS = """
typedef struct {
    int frusta;
    const double *frustum;      /* of each: heights of its ends, radii there */
    int points;
    const double *gauss;        /* on [0, 1] */
    const double *position, *quaternion, *center;
    const double *amplitude, *wavenumber, *time_phase, *cos_direction, *sin_direction;  /* NULL without waves */
    int averaged;               /* over the disks */
    double least_tilt;
    int capacity;               /* cells */
    const int *places;          /* of the numbers of every point, cell by cell */
    double *out;
    int *count;                 /* cells that are used, from the first on */
} hull_points;

void follow(void *context, double *values);
"""

_SOURCE = """
#include <math.h>
#include <stddef.h>

typedef struct {
    const hull_points *h;
    const double *frustum;      /* the present one */
    double d[3];
} axis;

typedef struct {
    double gap, half;           /* n_z (eta - z), and half the extent of the disk across the tangent plane */
} cut;

static double radius(const double *f, double zeta)
{
    return f[2] + (f[3] - f[2]) * (zeta - f[0]) / (f[1] - f[0]);
}

static cut cut_at(const axis *A, double zeta)
{
    const hull_points *h = A->h;
    const double lever = zeta - *h->center, R = radius(A->frustum, zeta), *d = A->d;
    double x[3], eta = 0, slope[2] = {0, 0};
    for (int i = 0; i < 3; ++i)
        x[i] = h->position[i] + lever * d[i];
    if (h->amplitude) {
        const double k = *h->wavenumber, c = *h->cos_direction, s = *h->sin_direction;
        const double theta = k * (c * x[0] + s * x[1]) + *h->time_phase, kR = fmax(k * R, 1e-6);
        const double mean = h->averaged ? 2 * j1(kR) / kR : 1, moment = h->averaged ? 8 * jn(2, kR) / (kR * kR) : 1;
        const double along = -moment * *h->amplitude * k * sin(theta);
        eta = mean * *h->amplitude * cos(theta);
        slope[0] = along * c;
        slope[1] = along * s;
    }
    const double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double n[3] = {-slope[0] / length, -slope[1] / length, 1 / length};
    const double nd = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
    double up2 = 0;
    for (int i = 0; i < 3; ++i)
        up2 += (n[i] - nd * d[i]) * (n[i] - nd * d[i]);
    const cut found = {n[2] * (eta - x[2]), R * sqrt(up2 + h->least_tilt * h->least_tilt)};
    return found;
}

/* side 1: positive where the disk is all wet.  side -1: negative where it is dry. */
static double level(const axis *A, int side, double zeta)
{
    const cut c = cut_at(A, zeta);
    return c.gap - side * c.half;
}

/* Height between a and b at which the level vanishes: false position, which is exact in still water. */
static double root(const axis *A, int side, double a, double b, double fa, double fb)
{
    double z = a;
    for (int n = 0; n < 40 && fa != fb; ++n) {
        z = a - fa * (b - a) / (fb - fa);
        const double f = level(A, side, z);
        if (fabs(f) <= 1e-15 * (fabs(z) + fabs(b - a)))
            break;
        if ((f > 0) == (fb > 0)) {
            b = z;
            fb = f;
            fa /= n ? 2 : 1;   /* the other end must not stay for ever */
        } else {
            a = b;
            fa = fb;
            b = z;
            fb = f;
        }
    }
    return z;
}

static double angle(cut c)
{
    const double ratio = c.half > 0 ? c.gap / c.half : (c.gap > 0 ? 1 : -1);
    return acos(-fmax(-1, fmin(1, ratio)));
}

/* The points of one cell between the heights a and b: even in the angle where the disks are cut. */
static void place(const axis *A, double a, double b, int is_cut, double *out, const int *places)
{
    const hull_points *h = A->h;
    const cut ca = cut_at(A, a), cb = cut_at(A, b);
    const double taper = fabs((A->frustum[3] - A->frustum[2]) / (A->frustum[1] - A->frustum[0]));
    double first = M_PI / 2, last = first, ratio = 1;
    if (is_cut) {
        first = angle(ca);
        last = angle(cb);
        if (sin((first + last) / 2) < 1e-6)
            first = last = M_PI / 2;
        if (fmin(ca.half, cb.half) > 1e-6 * fmax(ca.half, cb.half))
            ratio = cb.half / ca.half;
    }
    const double mean = sin((first + last) / 2), delta = (last - first) / 2, even = fabs(delta) < 1e-8;
    for (int q = 0; q < h->points; ++q) {
        const double u = h->gauss[q], theta = first + 2 * u * delta;
        const double x = sin(first + u * delta) / mean * (even ? u : sin(u * delta) / sin(delta));
        const double x_u = sin(theta) / mean * (even ? 1 : delta / sin(delta));
        const double sum = x + ratio * (1 - x);  /* of a cone, c is a ratio of linear functions */
        double *point = out + places[q];
        point[0] = a + (b - a) * x / sum;
        point[1] = radius(A->frustum, point[0]);
        point[2] = (b - a) * x_u * ratio / (sum * sum);
        point[3] = taper;
    }
}

static int pieces(const axis *A, int count)
{
    const hull_points *h = A->h;
    const double a = A->frustum[0], b = A->frustum[1];
    double ends[4] = {a, b, b, b};
    int n = 1;
    for (int side = -1; side <= 1; side += 2) {
        const double fa = level(A, side, a), fb = level(A, side, b);
        if ((fa > 0) != (fb > 0)) {
            double z = root(A, side, a, b, fa, fb);
            if (n == 2 && z < ends[1]) {
                const double other = ends[1];
                ends[1] = z;
                z = other;
            }
            ends[n++] = z;
        }
    }
    ends[n] = b;
    for (int k = 0; k < n && count < h->capacity; ++k) {
        const double middle = (ends[k] + ends[k + 1]) / 2;
        if (ends[k + 1] <= ends[k] || level(A, -1, middle) <= 0)
            continue;
        place(A, ends[k], ends[k + 1], level(A, 1, middle) < 0, h->out, h->places + count * h->points);
        ++count;
    }
    return count;
}

void follow(void *context, double *values)
{
    const hull_points *h = context;
    const double *q = h->quaternion, square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    axis A = {h, NULL, {2 * (q[1] * q[3] + q[0] * q[2]) / square, 2 * (q[2] * q[3] - q[0] * q[1]) / square,
                        (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]) / square}};
    int count = 0;
    for (int n = 0; n < h->frusta; ++n) {
        A.frustum = h->frustum + 4 * n;
        count = pieces(&A, count);
    }
    *h->count = count;
    for (int k = count * h->points; k < h->capacity * h->points; ++k) {  /* for who looks at all cells */
        double *point = h->out + h->places[k];
        point[0] = *h->center;
        point[1] = 1;
        point[2] = point[3] = 0;
    }
}
"""


class HullPoints:
    """Points and weights on some cells of a mesh, each of the length 1, for a hull.

    coefficient: a Function of four numbers, ZETA, RADIUS, LENGTH and TAPER.  To integrate over the axis is to
    integrate LENGTH over the `cells`, with Gauss's rule of `degree`.
    """

    def __init__(self, mesh, frusta, cells, degree, averaged=False):
        self.frusta, self.cells = np.array(frusta, dtype=np.float64), np.array(cells, dtype=np.int32)
        space = compat.function_space(mesh, compat.quadrature_element(mesh, degree, 4))
        self.coefficient = fem.Function(space)
        self._gauss, self.averaged = np.ascontiguousarray(compat.interval_quadrature(degree)[0]), averaged
        self._places = np.ascontiguousarray(4 * compat.cell_dofs(space)[self.cells], dtype=np.int32)

    @staticmethod
    def capacity(frusta) -> int:
        """Cells that a hull may need: a frustum is wet, or cut, or wet and then cut."""
        return 2 * len(frusta)

    def following(self, position, quaternion, center, wave, out, count):
        """What C needs to make the points follow: (address of the function, its context).

        position, quaternion, center: arrays that hold r_C, q_4 and the height of C.  wave: the arrays of amplitude,
        wavenumber, time phase, cosine and sine of its direction; None in still water.  out: takes the numbers of the
        coefficient, count: the number of cells in use, an array of one.  The arrays must live as long as the context.
        """
        module = c_code.module("hull_points", _DECLARATIONS, _SOURCE)
        context = module.ffi.new("hull_points *")
        context.frusta, context.frustum = len(self.frusta), address(self.frusta)
        context.points, context.gauss = len(self._gauss), address(self._gauss)
        context.position, context.quaternion, context.center = map(address, (position, quaternion, center))
        names = "amplitude", "wavenumber", "time_phase", "cos_direction", "sin_direction"
        for name, array in zip(names, wave or (), strict=False):
            setattr(context, name, address(array))
        context.averaged, context.least_tilt = self.averaged, LEAST_TILT
        context.capacity, context.places = len(self.cells), address(self._places)
        context.out, context.count = address(out), address(count)
        return module, context
