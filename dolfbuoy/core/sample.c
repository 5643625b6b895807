/* Where wave components are summed: at the points of the forms, and where hulls look for the surface. */

#include "core.h"

#include <math.h>
#include <string.h>

#define REACH 20.0              /* k |z| from which on a component is less than 2e-9 of itself */
enum {ETA = 3, VELOCITY = 6, ACCELERATION = 14, SMALL = 22, CURVATURE = 22, VELOCITY_2 = 25, ACCELERATION_2 = 32};

/* Axis of a body whose quaternion need not be a unit. */
void axis_of(const double *q, double *d)
{
    const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    d[0] = 2 * (q[1] * q[3] + q[0] * q[2]) / square;
    d[1] = 2 * (q[2] * q[3] - q[0] * q[1]) / square;
    d[2] = (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]) / square;
}

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
        weigh(K->waves, radius);
    return kind == PLAIN ? K->waves->ones : kind == MEAN ? K->waves->mean : K->waves->moment;
}

/* Add to the local acceleration and its gradient what the moving water sees: G v, and G G + v . grad G if it is there.
   The trace of G G, by which the gradient of the total acceleration has one, follows from G. */
static void add_convection(const double *v, double ramp, bool large, double *a)
{
    const double g[5] = {v[3], v[4], v[5], v[6], v[7]}, zz = -g[0] - g[2];
    const double G[3][3] = {{g[0], g[1], g[3]}, {g[1], g[2], g[4]}, {g[3], g[4], zz}};
    const int rows[5] = {0, 0, 1, 0, 1}, columns[5] = {0, 1, 1, 2, 2};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            a[i] += ramp * G[i][k] * v[k];
    for (int n = 0; n < 5; ++n)
        for (int k = 0; k < 3; ++k)
            a[3 + n] += ramp * G[rows[n]][k] * G[k][columns[n]];
    if (!large)
        return;
    const double *T = v + 8;    /* xxx, xxy, xyy, yyy, xxz, xyz, yyz */
    a[3] += ramp * (T[0] * v[0] + T[1] * v[1] + T[4] * v[2]);
    a[4] += ramp * (T[1] * v[0] + T[2] * v[1] + T[5] * v[2]);
    a[5] += ramp * (T[2] * v[0] + T[3] * v[1] + T[6] * v[2]);
    a[6] += ramp * (T[4] * v[0] + T[5] * v[1] - (T[0] + T[2]) * v[2]);
    a[7] += ramp * (T[5] * v[0] + T[6] * v[1] - (T[1] + T[3]) * v[2]);
}

static void sample_at(const kinematics *K, const points *P, const double *x, double radius, double *out)
{
    const waves *w = K->waves;
    const double *weight = weights(K, P->weight, radius);
    double of_surface[6], v[15], a[15], z = w->level ? x[2] - *w->level : x[2];
    const bool large = P->size > SMALL;
    phases_at(w, x[0], x[1]);
    sum_surface(w, w->ones, of_surface);
    const double eta = w->ramp * of_surface[0];
    if (P->kind == ON_SURFACE)
        z = eta;
    if (w->stretching == WHEELER)
        z = w->depth * (z - eta) / (w->depth + eta);
    if (w->stretching != NO_STRETCHING)
        z = fmin(z, 0);
    if (w->steep)
        z = fmin(z, w->highest);
    if (P->weight != PLAIN)
        sum_surface(w, weight, of_surface);
    sum_below(w, z, reaching(w, z), weight, large, v, a);
    if (w->steep)
        add_convection(v, w->ramp, large, a);
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
static bool moved(const kinematics *K, const points *P)
{
    if (P->kind != ON_AXIS || !P->heights)
        return false;
    if (*P->cells != P->seen)
        return true;
    for (int k = 0; k < *P->cells * P->nodes; ++k)
        if (fabs(P->source[P->places[k]] - P->heights[k]) > K->moved)
            return true;
    return false;
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
    bool wanted = K->exact || *K->stale;
    (void)values;
    for (int n = 0; n < K->count && !wanted; ++n)
        wanted = moved(K, K->sets + n);
    if (!wanted)
        return;
    double d[3] = {0, 0, 0};
    if (K->quaternion)
        axis_of(K->quaternion, d);
    for (int n = 0; n < K->count; ++n) {
        for (int cell = 0; cell < *K->sets[n].cells; ++cell)
            sample_cell(K, K->sets + n, d, cell);
        remember(K->sets + n);
    }
    *K->stale = 0;
}

/* Elevation and slope on the axis of a hull; over disks of a radius if averaged. */
void surface_at(const kinematics *K, double x, double y, double radius, bool averaged, double *out)
{
    double of_surface[6], slope[6];
    phases_at(K->waves, x, y);
    sum_surface(K->waves, weights(K, averaged ? MEAN : PLAIN, radius), of_surface);
    memcpy(slope, of_surface, sizeof slope);
    if (averaged)
        sum_surface(K->waves, K->waves->moment, slope);
    out[0] = K->waves->ramp * of_surface[0];
    out[1] = K->waves->ramp * slope[1];
    out[2] = K->waves->ramp * slope[2];
}

/* Number of the time, by which one knows that all is new; 0 if nothing but the sums themselves will do. */
int serial_of(const kinematics *K)
{
    return K->exact ? 0 : K->waves->serial;
}

/* Elevation, slope, curvature and third derivatives, and how far away they tell what the shortest component adds to the
   elevation to a thousandth. */
void expand_at(const kinematics *K, double x, double y, double *out)
{
    const waves *w = K->waves;
    phases_at(w, x, y);
    sum_surface(w, w->ones, out);
    sum_third(w, out + 6);
    for (int i = 0; i < 10; ++i)
        out[i] *= w->ramp;
    out[10] = 0.4 / w->k[w->count - 1];
}
