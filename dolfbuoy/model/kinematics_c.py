"""C of `kinematics`: sums over wave components, and where they are taken.

The sums are a module of their own: compiled with -ffast-math they use the vectors of the processor and of libmvec.  It
is never linked with that option, for gcc would then turn off denormal numbers in the whole process.  cos(x - pi/2) is a
sine that gcc does not fuse with the cosine, which it could not do in vectors.
"""

_WAVES = """
typedef struct {
    int count, padded;          /* components, rounded up to whole vectors; by rising k */
    /* of each: k and its parts along x and y, phase - omega t, A, p = A sigma/(k (1 - exp(-2kh))), sigma, exp(-2kh) */
    double *k, *kx, *ky, *phase, *amplitude, *potential, *sigma, *bottom;
    double *mean, *moment, *ones;                   /* weights */
    double *c, *s, *cosh, *sinh;                    /* room: at a point */
    double radius;              /* of the disk to which the weights belong */
    double ramp, depth;
    int serial;                 /* of the time */
    int stretching;             /* WHEELER, VERTICAL or NONE */
} waves;
"""

SUMS_DECLARATIONS = (
    _WAVES
    + """
void phases_at(const waves *w, double x, double y);
void sum_surface(const waves *w, const double *weight, double *out);
void sum_third(const waves *w, double *out);
void sum_below(const waves *w, double z, int count, const double *weight, int large, double *velocity,
               double *acceleration);
void weigh(waves *w, double radius);
"""
)

SUMS = """
#include <math.h>
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__gnu_linux__)
#define VECTORS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define VECTORS
#endif
#define WHOLE 8                 /* components of the widest vector */
#define aligned(x) __builtin_assume_aligned(x, 64)

/* Cosines and sines of all phases at a place, for the sums that follow. */
VECTORS void phases_at(const waves *w, double x, double y)
{
    const int n = w->padded / WHOLE * WHOLE;
    const double *kx = aligned(w->kx), *ky = aligned(w->ky), *phase = aligned(w->phase);
    double *restrict c = aligned(w->c), *restrict s = aligned(w->s);
    for (int i = 0; i < n; ++i)
        c[i] = cos(kx[i] * x + ky[i] * y + phase[i]);
    for (int i = 0; i < n; ++i)
        s[i] = cos(kx[i] * x + ky[i] * y + phase[i] - M_PI_2);
}

/* Elevation, slope and curvature. */
VECTORS void sum_surface(const waves *w, const double *weight, double *out)
{
    const int n = w->padded / WHOLE * WHOLE;
    const double *kx = aligned(w->kx), *ky = aligned(w->ky), *A = aligned(w->amplitude), *W = aligned(weight);
    const double *c = aligned(w->c), *s = aligned(w->s);
    double eta = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < n; ++i) {
        const double up = A[i] * W[i] * c[i], along = A[i] * W[i] * s[i];
        eta += up;
        x -= kx[i] * along;
        y -= ky[i] * along;
        xx -= kx[i] * kx[i] * up;
        xy -= kx[i] * ky[i] * up;
        yy -= ky[i] * ky[i] * up;
    }
    out[0] = eta, out[1] = x, out[2] = y, out[3] = xx, out[4] = xy, out[5] = yy;
}

/* Third derivatives of the elevation: xxx, xxy, xyy, yyy. */
VECTORS void sum_third(const waves *w, double *out)
{
    const int n = w->padded / WHOLE * WHOLE;
    const double *kx = aligned(w->kx), *ky = aligned(w->ky), *A = aligned(w->amplitude), *s = aligned(w->s);
    double xxx = 0, xxy = 0, xyy = 0, yyy = 0;
    for (int i = 0; i < n; ++i) {
        const double x = kx[i], y = ky[i], along = A[i] * s[i];
        xxx += x * x * x * along;
        xxy += x * x * y * along;
        xyy += x * y * y * along;
        yyy += y * y * y * along;
    }
    out[0] = xxx, out[1] = xxy, out[2] = xyy, out[3] = yyy;
}

/* Of the first components velocity and acceleration at the height z <= 0 of linear theory: 3 numbers, 5 of the
   gradient, and if large 7 of the next. */
VECTORS void sum_below(const waves *w, double z, int count, const double *weight, int large, double *velocity,
                       double *acceleration)
{
    const int n = count / WHOLE * WHOLE;
    const double *k = aligned(w->k), *kx = aligned(w->kx), *ky = aligned(w->ky), *p = aligned(w->potential);
    const double *sigma = aligned(w->sigma), *bottom = aligned(w->bottom), *W = aligned(weight);
    const double *c = aligned(w->c), *s = aligned(w->s);
    double *restrict C = aligned(w->cosh), *restrict S = aligned(w->sinh);
    for (int i = 0; i < n; ++i) {
        const double down = exp(k[i] * z), up = bottom[i] / down, size = p[i] * W[i];
        C[i] = size * (down + up);
        S[i] = size * k[i] * (down - up);
    }
    double vx = 0, vy = 0, vz = 0, vxx = 0, vxy = 0, vyy = 0, vxz = 0, vyz = 0;
    double ax = 0, ay = 0, az = 0, axx = 0, axy = 0, ayy = 0, axz = 0, ayz = 0;
    for (int i = 0; i < n; ++i) {
        const double x = kx[i], y = ky[i], Cc = C[i] * c[i], Cs = C[i] * s[i], Sc = S[i] * c[i], Ss = S[i] * s[i];
        const double aCc = sigma[i] * Cc, aCs = sigma[i] * Cs, aSc = sigma[i] * Sc, aSs = sigma[i] * Ss;
        vx += x * Cc, vy += y * Cc, vz += Ss;
        vxx -= x * x * Cs, vxy -= x * y * Cs, vyy -= y * y * Cs, vxz += x * Sc, vyz += y * Sc;
        ax += x * aCs, ay += y * aCs, az -= aSc;
        axx += x * x * aCc, axy += x * y * aCc, ayy += y * y * aCc, axz += x * aSs, ayz += y * aSs;
    }
    const double v[8] = {vx, vy, vz, vxx, vxy, vyy, vxz, vyz}, a[8] = {ax, ay, az, axx, axy, ayy, axz, ayz};
    for (int i = 0; i < 8; ++i)
        velocity[i] = v[i], acceleration[i] = a[i];
    if (!large)
        return;
    double v3 = 0, v21 = 0, v12 = 0, v03 = 0, v2 = 0, v11 = 0, v02 = 0;
    double a3 = 0, a21 = 0, a12 = 0, a03 = 0, a2 = 0, a11 = 0, a02 = 0;
    for (int i = 0; i < n; ++i) {
        const double xx = kx[i] * kx[i], xy = kx[i] * ky[i], yy = ky[i] * ky[i];
        const double Cc = C[i] * c[i], aCs = sigma[i] * C[i] * s[i], Ss = S[i] * s[i], aSc = sigma[i] * S[i] * c[i];
        v3 -= xx * kx[i] * Cc, v21 -= xx * ky[i] * Cc, v12 -= yy * kx[i] * Cc, v03 -= yy * ky[i] * Cc;
        v2 -= xx * Ss, v11 -= xy * Ss, v02 -= yy * Ss;
        a3 -= xx * kx[i] * aCs, a21 -= xx * ky[i] * aCs, a12 -= yy * kx[i] * aCs, a03 -= yy * ky[i] * aCs;
        a2 += xx * aSc, a11 += xy * aSc, a02 += yy * aSc;
    }
    const double v_2[7] = {v3, v21, v12, v03, v2, v11, v02}, a_2[7] = {a3, a21, a12, a03, a2, a11, a02};
    for (int i = 0; i < 7; ++i)
        velocity[8 + i] = v_2[i], acceleration[8 + i] = a_2[i];
}

/* Weights of a disk for means, 2 J1(kR)/(kR), and first moments, 8 J2(kR)/(kR)^2. */
void weigh(waves *w, double radius)
{
    if (radius == w->radius)
        return;
    w->radius = radius;
    for (int i = 0; i < w->count; ++i) {
        const double x = fmax(w->k[i] * radius, 1e-6);
        w->mean[i] = 2 * j1(x) / x;
        w->moment[i] = 8 * jn(2, x) / (x * x);
    }
}
"""

DECLARATIONS = (
    _WAVES
    + """
enum {ON_LINE, ON_AXIS, ON_SURFACE};
enum {WHEELER, VERTICAL, NONE};
enum {PLAIN, MEAN, MOMENT};

typedef struct {                /* points on the cells of a mesh, and where their numbers go */
    int kind, weight, size;
    const int *cells;           /* how many, from the first on */
    int points, nodes;          /* of a cell */
    const double *shape;        /* values at the points of what interpolates between the nodes */
    const double *source;       /* positions on a line; heights and radii on the axis */
    const int *places;          /* there, of the nodes of every cell: three numbers on a line, else one */
    int radius;                 /* place of the radius behind the height */
    double *out;
    const int *to;              /* there, of the numbers of each point */
    int seen;                   /* cells when the numbers were taken */
    double *heights;            /* of the nodes then */
} points;

typedef struct {
    waves *waves;
    void (*phases_at)(const waves *, double, double);
    void (*sum_surface)(const waves *, const double *, double *);
    void (*sum_third)(const waves *, double *);
    void (*sum_below)(const waves *, double, int, const double *, int, double *, double *);
    void (*weigh)(waves *, double);
    int exact;                  /* at every evaluation, not only when stale */
    int *stale;
    int count;
    points *sets;
    const double *position, *quaternion, *center;   /* of a body, or NULL */
    double moved;               /* along the axis, from which on the points are others */
} kinematics;

void sample(void *context, double *values);
void surface(void *context, double x, double y, double radius, int averaged, double *out);
int serial(void *context);
void expand(void *context, double x, double y, double *out);
"""
)

SOURCE = """
#include <math.h>
#include <stddef.h>
#include <string.h>

#define REACH 20.0              /* k |z| from which on a component is less than 2e-9 of itself */
enum {ETA = 3, VELOCITY = 6, ACCELERATION = 14, SMALL = 22, CURVATURE = 22, VELOCITY_2 = 25, ACCELERATION_2 = 32};

static int reaching(const waves *w, double z)
{
    int low = 0, high = w->count;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (-w->k[middle] * z > REACH)
            high = middle;
        else
            low = middle + 1;
    }
    return (low + 7) / 8 * 8;
}

static const double *weights(const kinematics *K, int kind, double radius)
{
    if (kind != PLAIN)
        K->weigh(K->waves, radius);
    return kind == PLAIN ? K->waves->ones : kind == MEAN ? K->waves->mean : K->waves->moment;
}

static void sample_at(const kinematics *K, const points *P, const double *x, double radius, double *out)
{
    const waves *w = K->waves;
    const double *weight = weights(K, P->weight, radius);
    double of_surface[6], v[15], a[15], z = x[2];
    const int large = P->size > SMALL;
    K->phases_at(w, x[0], x[1]);
    K->sum_surface(w, w->ones, of_surface);
    const double eta = w->ramp * of_surface[0];
    if (P->kind == ON_SURFACE)
        z = eta;
    if (w->stretching == WHEELER)
        z = w->depth * (z - eta) / (w->depth + eta);
    if (w->stretching != NONE)
        z = fmin(z, 0);
    if (P->weight != PLAIN)
        K->sum_surface(w, weight, of_surface);
    K->sum_below(w, z, reaching(w, z), weight, large, v, a);
    out[0] = x[0], out[1] = x[1], out[2] = z;
    memcpy(out + ETA, of_surface, 3 * sizeof(double));
    memcpy(out + VELOCITY, v, 8 * sizeof(double));
    memcpy(out + ACCELERATION, a, 8 * sizeof(double));
    if (large) {
        memcpy(out + CURVATURE, of_surface + 3, 3 * sizeof(double));
        memcpy(out + VELOCITY_2, v + 8, 7 * sizeof(double));
        memcpy(out + ACCELERATION_2, a + 8, 7 * sizeof(double));
    }
    for (int i = ETA; i < P->size; ++i)
        out[i] *= w->ramp;
}

/* Place of a point of a cell; returns the radius there. */
static double place(const kinematics *K, const points *P, const double *d, const int *nodes, const double *N, double *x)
{
    double height = 0, radius = 0;
    memset(x, 0, 3 * sizeof(double));
    for (int n = 0; n < P->nodes; ++n) {
        if (P->kind == ON_LINE)
            for (int i = 0; i < 3; ++i)
                x[i] += N[n] * P->source[nodes[3 * n + i]];
        else if (P->kind == ON_AXIS) {
            height += N[n] * (P->source[nodes[n]] - *K->center);
            radius += N[n] * P->source[nodes[n] + P->radius];
        }
    }
    if (P->kind != ON_LINE)
        for (int i = 0; i < 3; ++i)
            x[i] = K->position[i] + height * d[i];
    return radius;
}

static void sample_cell(const kinematics *K, const points *P, const double *d, int cell)
{
    const int *nodes = P->places + cell * P->nodes * (P->kind == ON_LINE ? 3 : 1), *to = P->to + cell * P->points;
    for (int q = 0; q < P->points; ++q) {
        double x[3];
        const double radius = place(K, P, d, nodes, P->shape + q * P->nodes, x);
        sample_at(K, P, x, radius, P->out + to[q]);
    }
}

/* Whether the points of a hull are others than those whose numbers are at hand. */
static int moved(const kinematics *K, const points *P)
{
    if (P->kind != ON_AXIS || !P->heights)
        return 0;
    if (*P->cells != P->seen)
        return 1;
    for (int k = 0; k < *P->cells * P->nodes; ++k)
        if (fabs(P->source[P->places[k]] - P->heights[k]) > K->moved)
            return 1;
    return 0;
}

static void remember(points *P)
{
    P->seen = *P->cells;
    for (int k = 0; P->heights && k < *P->cells * P->nodes; ++k)
        P->heights[k] = P->source[P->places[k]];
}

void sample(void *context, double *values)
{
    kinematics *K = context;
    int wanted = K->exact || *K->stale;
    for (int n = 0; n < K->count && !wanted; ++n)
        wanted = moved(K, K->sets + n);
    if (!wanted)
        return;
    double d[3] = {0, 0, 0};
    if (K->quaternion) {
        const double *q = K->quaternion, square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        d[0] = 2 * (q[1] * q[3] + q[0] * q[2]) / square;
        d[1] = 2 * (q[2] * q[3] - q[0] * q[1]) / square;
        d[2] = (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]) / square;
    }
    for (int n = 0; n < K->count; ++n) {
        for (int cell = 0; cell < *K->sets[n].cells; ++cell)
            sample_cell(K, K->sets + n, d, cell);
        remember(K->sets + n);
    }
    *K->stale = 0;
}

/* Elevation and slope on the axis of a hull; over disks of a radius if averaged. */
void surface(void *context, double x, double y, double radius, int averaged, double *out)
{
    const kinematics *K = context;
    double of_surface[6], slope[6];
    K->phases_at(K->waves, x, y);
    K->sum_surface(K->waves, weights(K, averaged ? MEAN : PLAIN, radius), of_surface);
    memcpy(slope, of_surface, sizeof slope);
    if (averaged)
        K->sum_surface(K->waves, K->waves->moment, slope);
    out[0] = K->waves->ramp * of_surface[0];
    out[1] = K->waves->ramp * slope[1];
    out[2] = K->waves->ramp * slope[2];
}

/* Number of the time, by which one knows that all is new; 0 if nothing but the sums themselves will do. */
int serial(void *context)
{
    const kinematics *K = context;
    return K->exact ? 0 : K->waves->serial;
}

/* Elevation, slope, curvature and third derivatives, and how far away they tell what the shortest component adds to the
   elevation to a thousandth. */
void expand(void *context, double x, double y, double *out)
{
    const kinematics *K = context;
    const waves *w = K->waves;
    K->phases_at(w, x, y);
    K->sum_surface(w, w->ones, out);
    K->sum_third(w, out + 6);
    for (int i = 0; i < 10; ++i)
        out[i] *= w->ramp;
    out[10] = 0.4 / w->k[w->count - 1];
}
"""
