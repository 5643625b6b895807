/* Lines on a sea bed: where they lie, and where friction holds on. */

#include "core.h"

#include <math.h>

/* Value at a point of a cell, of values at nodes. */
void value_at(const on_cells *C, const double *values, int cell, int point, double *x)
{
    const double *weight = C->basis + point * C->nodes;
    const int *place = C->dofs + 3 * cell * C->nodes;
    x[0] = x[1] = x[2] = 0;
    for (int node = 0; node < C->nodes; ++node)
        for (int i = 0; i < 3; ++i)
            x[i] += weight[node] * values[place[3 * node + i]];
}

/* A step was taken: where friction pulls more than it can, it slides after the line. */
void drag_along(const void *context)
{
    const friction *F = context;
    const double *n = F->plane.normal;
    for (int cell = 0; cell < F->at.cells; ++cell)
        for (int point = 0; point < F->at.points; ++point) {
            const int *place = F->places + 3 * (cell * F->at.points + point);
            double r[3], history[3], slide[3], speed = 0;
            value_at(&F->at, F->u, cell, point, r);
            if (F->gamma) {
                value_at(&F->at, F->history, cell, point, history);
                speed = *F->gamma * dot(n, r) + dot(n, history);
            }
            const double below = fmax(*F->plane.level - dot(n, r), 0), into = fmin(below / F->sag[cell], 1);
            const double pressure = fmax(F->stiffness[cell] * below - F->damping[cell] * into * speed, 0);
            for (int i = 0; i < 3; ++i)
                slide[i] = r[i] - F->holds[place[i]];
            const double along = dot(n, slide);
            for (int i = 0; i < 3; ++i)
                slide[i] -= along * n[i];
            const double pull = F->stick[cell] * sqrt(dot(slide, slide));
            const double share = fmin(1, *F->coefficient * pressure / fmax(pull, 1e-300));
            for (int i = 0; i < 3; ++i)
                F->holds[place[i]] = r[i] - share * slide[i];
        }
}

/* Gaps and places of the soundings of a line. */
static void sound(const lying *L)
{
    for (int k = 0; k < L->at.cells * L->at.points; ++k) {
        value_at(&L->at, L->u, k / L->at.points, k % L->at.points, L->places + 3 * k);
        L->gaps[k] = dot(L->plane.normal, L->places + 3 * k) - *L->plane.level;
    }
}

/* All lies between two points of the quadrature that touch the bed, if they are of one element or of neighbours. */
static void bridge(const lying *L)
{
    const int points = L->at.points;
    int before = -1;
    for (int k = 0; k < L->at.cells * points; ++k) {
        L->bridged[k] = false;
        if (L->gaps[k] < 0 && L->presses[k % points]) {
            const bool near = before >= 0 && k / points - before / points <= 1;
            for (int i = near ? before : k; i < k; ++i)
                L->bridged[i] = true;
            before = k;
        }
    }
}

/* Values at two points, a stride apart: rise between them, and what a parabola through the end of their cell that is farther
 * away, as a line that bends leaves the bed in one, has of x (x - 1) a share x of the way. */
static void parabola(const lying *L, int k, const double *values, int stride, double *rise, double *curve)
{
    const int points = L->at.points, i = k % points, third = 2 * (i + 1) > points ? -i : points - 1 - i;
    const double *s = L->s + k, step = s[1] - s[0], *y = values + stride * k;
    *rise = y[stride] - y[0], *curve = 0;
    if (L->at.nodes > 2 && i < points - 1 && step > 0) {
        const double x = (s[third] - s[0]) / step;
        *curve = (y[third * stride] - y[0] - x * *rise) / (x * (x - 1));
    }
}

static void point_on(const lying *L, int k, double x, double *s, double *place)
{
    double rise, curve;
    *s = (1 - x) * L->s[k] + x * L->s[k + 1] - L->begin;
    for (int i = 0; i < 3; ++i) {
        parabola(L, k, L->places + i, 3, &rise, &curve);
        place[i] = L->places[3 * k + i] + x * (rise + (x - 1) * curve);
    }
}

/* Share of the way between two points at which the gap is 0, which it differs in sign at. */
static double crossing(const lying *L, int k)
{
    double rise, curve;
    parabola(L, k, L->gaps, 1, &rise, &curve);
    const double gap = L->gaps[k], b = rise - curve;
    const double q = -(b + copysign(sqrt(fmax(b * b - 4 * curve * gap, 0)), b)) / 2, near = gap / q;
    return curve == 0 ? -gap / rise : near >= 0 && near <= 1 ? near : fmin(fmax(q / curve, 0), 1);
}

void find_lying(const void *context)
{
    const lying *L = context;
    double *out = L->out, *gap = L->gaps, lowest = INFINITY;
    int first = -1;
    if (L->u)
        sound(L);
    bridge(L);
    out[LENGTH] = 0;
    out[LEAVES] = -INFINITY, out[COMES] = INFINITY;
    for (int i = 0; i < 3; ++i)
        out[TOUCHDOWN + i] = out[FOOT + i] = NAN;
    for (int k = 0; k < L->at.cells * L->at.points; ++k)
        lowest = fmin(lowest, gap[k]);
    out[SAG] = fmax(-lowest, 0);
    for (int k = 0; k + 1 < L->at.cells * L->at.points; ++k) {
        const bool all = L->bridged[k] || (gap[k] <= 0 && gap[k + 1] <= 0), none = gap[k] >= 0 && gap[k + 1] >= 0;
        const double share = all ? 1 : none ? 0 : gap[k] < 0 ? crossing(L, k) : 1 - crossing(L, k);  /* that lies */
        if (share > 0) {
            out[LENGTH] += share * (L->s[k + 1] - L->s[k]);
            if (first < 0)
                point_on(L, k, L->bridged[k] || gap[k] < 0 ? 0 : 1 - share, out + COMES, out + FOOT);
            point_on(L, k, L->bridged[k] || gap[k] >= 0 ? 1 : share, out + LEAVES, out + TOUCHDOWN);
            first = first < 0 ? k : first;
        }
    }
}

/* Of cables: the length that lies, and the point where the uppermost piece that lies leaves the bed. */
void sum_lying(const void *context)
{
    const lying_cables *C = context;
    for (int cable = 0; cable < C->cables; ++cable) {
        double *row = C->rows + 4 * cable, length = 0;
        int last = C->firsts[cable + 1] - 1;
        for (int piece = last; piece >= C->firsts[cable]; --piece)
            length += C->pieces[LYING * piece + LENGTH];
        while (last > C->firsts[cable] && !(C->pieces[LYING * last + LENGTH] > 0))
            --last;
        row[0] = length;
        for (int i = 0; i < 3; ++i)
            row[1 + i] = C->pieces[LYING * last + TOUCHDOWN + i];
        C->last[cable] = last;
    }
}
