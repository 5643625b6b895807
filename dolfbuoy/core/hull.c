/* Quadrature points on the axis of a hull, which follow the water plane; see model/hull_points.py. */

#include "core.h"

#include <math.h>

#define FAR 3.0  /* pieces: roots beyond do no harm */

typedef struct {
    const hull_points *h;
    const double *frustum;      /* the present one */
    double d[3];
} axis;

typedef struct {
    double gap, half;           /* n_z (eta - z), and half the extent of the disk across the tangent plane */
} cut;

/* Height of still water. */
static double tide(const hull_points *h)
{
    return h->level ? *h->level : 0;
}

static double radius(const double *f, double zeta)
{
    return f[2] + (f[3] - f[2]) * (zeta - f[0]) / (f[1] - f[0]);
}

/* Elevation and slope of an irregular sea: all components take as long as a hundred expansions.  Farther away it
   tells on which side a disk is. */
static void look(const axis *A, const double *x, double R, double *found)
{
    const hull_points *h = A->h;
    const double dx = x[0] - h->place[0], dy = x[1] - h->place[1], far = sqrt(dx * dx + dy * dy), *s = h->near;
    if (h->expanded) {
        const double xx = s[6] * dx + s[7] * dy, xy = s[7] * dx + s[8] * dy, yy = s[8] * dx + s[9] * dy;
        const double bend[2] = {s[3] * dx + s[4] * dy, s[4] * dx + s[5] * dy};
        const double twist[2] = {xx * dx + xy * dy, xy * dx + yy * dy};
        found[0] = s[0];
        for (int i = 0; i < 2; ++i) {
            found[0] += (s[1 + i] + bend[i] / 2 + twist[i] / 6) * (i ? dy : dx);
            found[1 + i] = s[1 + i] + bend[i] + twist[i] / 2;
        }
        const double lean = sqrt(A->d[0] * A->d[0] + A->d[1] * A->d[1]), slope = hypot(found[1], found[2]);
        if (far <= s[10] || (far <= 5 * s[10] && fabs(found[0] - x[2]) > R * (1 + lean + slope) + far))
            return;
    }
    surface_at(h->sea, x[0], x[1], R, h->averaged, found);
}

static cut cut_at(const axis *A, double zeta)
{
    const hull_points *h = A->h;
    const double lever = zeta - *h->center, R = radius(A->frustum, zeta), *d = A->d;
    double x[3], eta = 0, slope[2] = {0, 0};
    for (int i = 0; i < 3; ++i)
        x[i] = h->position[i] + lever * d[i];
    x[2] -= tide(h);
    if (h->amplitude) {
        const double k = *h->wavenumber, c = *h->cos_direction, s = *h->sin_direction;
        const double theta = k * (c * x[0] + s * x[1]) + *h->time_phase, kR = fmax(k * R, 1e-6);
        const double mean = h->averaged ? 2 * j1(kR) / kR : 1, moment = h->averaged ? 8 * jn(2, kR) / (kR * kR) : 1;
        const double along = -moment * *h->amplitude * k * sin(theta);
        eta = mean * *h->amplitude * cos(theta);
        slope[0] = along * c;
        slope[1] = along * s;
    } else if (h->sea) {
        double found[3];
        look(A, x, R, found);
        eta = found[0];
        slope[0] = found[1];
        slope[1] = found[2];
    }
    const double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double n[3] = {-slope[0] / length, -slope[1] / length, 1 / length};
    const double nd = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
    double up2 = 0;
    for (int i = 0; i < 3; ++i)
        up2 += (n[i] - nd * d[i]) * (n[i] - nd * d[i]);
    const cut found = {.gap = n[2] * (eta - x[2]), .half = R * sqrt(up2 + h->least_tilt * h->least_tilt)};
    return found;
}

/* side 1: positive where the disk is all wet.  side -1: negative where it is dry. */
static double level(cut c, int side)
{
    return c.gap - side * c.half;
}

/* Height between a and b at which the level vanishes, and the cut there: false position, exact in still water. */
static double root(const axis *A, int side, double a, double b, cut ca, cut cb, cut *there)
{
    double z = a, fa = level(ca, side), fb = level(cb, side);
    for (int n = 0; n < 40; ++n) {
        z = a - fa * (b - a) / (fb - fa);
        *there = cut_at(A, z);
        const double f = level(*there, side);
        if (fabs(f) <= 1e-7 * there->half || z == a || z == b)
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

/* Where the level vanishes, the piece being [0, 1] and the level linear: a bound of what is nearest on each side. */
static void bound(double fa, double fb, double *left, double *right)
{
    const double t = fa == fb ? INFINITY : fa / (fa - fb);
    if (t < 0.5)
        *left = fmax(*left, fmin(t, 0));
    else
        *right = fmin(*right, fmax(t, 1));
}

/* The points of one piece between the heights a and b: where disks are cut, even in an angle that takes the roots out
   of what is integrated, at the heights where the surface begins and ends to cut the frustum. */
static void place(const axis *A, const group *g, double a, double b, cut ca, cut cb, bool is_cut)
{
    const double taper = fabs((A->frustum[3] - A->frustum[2]) / (A->frustum[1] - A->frustum[0]));
    double first = M_PI / 2, last = first;
    if (*g->count + g->points > g->capacity)
        return;
    if (is_cut) {
        double left = -FAR, right = 1 + FAR;
        bound(level(ca, 1), level(cb, 1), &left, &right);
        bound(level(ca, -1), level(cb, -1), &left, &right);
        first = acos(fmax(-1, fmin(1, (left + right) / (right - left))));
        last = acos(fmax(-1, fmin(1, (left + right - 2) / (right - left))));
    }
    const double mean = sin((first + last) / 2), delta = (last - first) / 2;
    const bool even = fabs(delta) < 1e-8;
    for (int q = 0; q < g->points; ++q) {
        const double u = g->at[q], theta = first + 2 * u * delta;
        const double t = even ? u : sin(first + u * delta) / mean * sin(u * delta) / sin(delta);
        double *point = g->out + g->places[*g->count + q];
        point[0] = a + (b - a) * t;
        point[1] = radius(A->frustum, point[0]);
        point[2] = (b - a) * g->weights[q] * (even ? 1 : sin(theta) / mean * delta / sin(delta));
        point[3] = taper;
    }
    *g->count += g->points;
}

/* A frustum in what is wet and what is cut; ca, cb: at its ends. */
static void divide(const axis *A, cut ca, cut cb)
{
    double ends[4] = {A->frustum[0], A->frustum[1], A->frustum[1], A->frustum[1]};
    cut cuts[4] = {ca, cb, cb, cb};
    int n = 1;
    for (int side = -1; side <= 1; side += 2) {
        if ((level(ca, side) > 0) == (level(cb, side) > 0))
            continue;
        cut there;
        const double z = root(A, side, ends[0], A->frustum[1], ca, cb, &there);
        const int k = n == 2 && z < ends[1] ? 1 : n;
        if (k < n) {
            ends[n] = ends[k];
            cuts[n] = cuts[k];
        }
        ends[k] = z;
        cuts[k] = there;
        ++n;
    }
    ends[n] = A->frustum[1];
    cuts[n] = cb;
    for (int k = 0; k < n; ++k) {
        const cut a = cuts[k], b = cuts[k + 1];  /* levels are as good as linear: their means are those of the middle */
        if (ends[k + 1] <= ends[k] || level(a, -1) + level(b, -1) <= 0)
            continue;
        const bool is_cut = level(a, 1) + level(b, 1) < 0;
        place(A, is_cut ? &A->h->cut : &A->h->wet, ends[k], ends[k + 1], a, b, is_cut);
    }
}

/* For who looks at all cells: points that count for nothing. */
static void clear(const group *g, double center)
{
    for (int k = *g->count; k < g->capacity; ++k) {
        double *point = g->out + g->places[k];
        point[0] = center;
        point[1] = 1;
        point[2] = point[3] = 0;
    }
}

/* Where the axis meets the water, from where it meets still water; the hull's nearer end, if it does not.  Once for
   each time, in the pose that comes first, as the sums of the forms: whoever goes far from there looks at the sums. */
static void expand_near(hull_points *h, const double *d)
{
    const int now = serial_of(h->sea);
    if (now && now == h->expanded)
        return;
    const double steep = copysign(fmax(fabs(d[2]), 0.1), d[2]);
    const double low = h->frustum[0] - *h->center, high = h->frustum[4 * h->frusta - 3] - *h->center;
    h->near[0] = 0;
    for (int n = 0; n < 2 && now; ++n) {
        const double lever = fmax(low, fmin(high, (h->near[0] + tide(h) - h->position[2]) / steep));
        for (int i = 0; i < 2; ++i)
            h->place[i] = h->position[i] + lever * d[i];
        expand_at(h->sea, h->place[0], h->place[1], h->near);
    }
    h->expanded = now;
}

void follow(void *context, double *values)
{
    hull_points *h = context;
    axis A = {.h = h};
    (void)values;
    axis_of(h->quaternion, A.d);
    *h->wet.count = *h->cut.count = 0;
    if (h->sea && !h->averaged)
        expand_near(h, A.d);
    for (int n = 0; n < h->frusta; ++n) {
        A.frustum = h->frustum + 4 * n;
        divide(&A, cut_at(&A, A.frustum[0]), cut_at(&A, A.frustum[1]));
    }
    clear(&h->wet, *h->center);
    clear(&h->cut, *h->center);
}
