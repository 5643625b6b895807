/* What a time step does with arrays: linear combinations, copies, numbers picked out, what is given in time.

Sums are those of NumPy to the last bit: compiled without fused products. */

#include "core.h"

#include <math.h>
#include <string.h>

enum {PIECE = 64};

static_assert(sizeof(((series *)0)->rows) / sizeof(double *) == ROWS, "a pointer for each row");

static void add_piece(double *out, const double *const *rows, const double *weights, int terms, double over,
                      ptrdiff_t first, ptrdiff_t n)
{
    double total[PIECE];  /* a row may be `out` */
    for (ptrdiff_t k = 0; k < n; ++k)
        total[k] = weights[0] * rows[0][first + k];
    for (int term = 1; term < terms; ++term) {
        const double weight = weights[term], *row = rows[term] + first;
        for (ptrdiff_t k = 0; k < n; ++k)
            total[k] += weight * row[k];
    }
    for (ptrdiff_t k = 0; k < n; ++k)
        out[first + k] = over == 1 ? total[k] : total[k] / over;
}

/* out = the sum of weight x row, over a divisor, for n numbers. */
static void add(double *out, const double *const *rows, const double *weights, int terms, double over, ptrdiff_t n)
{
    for (ptrdiff_t first = 0; first < n; first += PIECE)
        add_piece(out, rows, weights, terms, over, first, n - first < PIECE ? n - first : PIECE);
}

static void follow_rule(const series *S, const rule *R)
{
    const double *rows[ROWS];
    for (int term = 0; term < R->terms; ++term)
        rows[term] = S->rows[R->rows[term]];
    add(S->rows[R->into], rows, R->weights, R->terms, R->over, S->n);
}

/* weight x + y */
static void add_to(double *out, double weight, const double *x, const double *y, ptrdiff_t n)
{
    add(out, (const double *const[]){x, y}, (const double[]){weight, 1}, 2, 1, n);
}

/* Before a step is solved: gamma and history of every derivative, a rule applied to what is a rule itself. */
void make_histories(const void *context)
{
    const past *P = context;
    for (int k = 0; k < P->levels; ++k) {
        const series *S = P->series + k;
        follow_rule(S, &P->formula->history);
        if (k)
            add_to(S->rows[HISTORY], P->formula->gamma, S[-1].rows[HISTORY], S->rows[HISTORY], S->n);
        P->gammas[k] = pow(P->formula->gamma, k + 1);
    }
}

/* When it was solved: the new rates, from the new values of the first series. */
void find_rates(const void *context)
{
    const past *P = context;
    for (int k = 0; k < P->levels; ++k) {
        const series *S = P->series + k;
        add_to(S->rows[NEW_RATE], P->gammas[k], P->series->rows[NEW], S->rows[HISTORY], S->n);
    }
}

/* When it counts: what was new is past. */
void advance(const void *context)
{
    const past *P = context;
    for (const series *S = P->series; S < P->series + P->levels; ++S)
        for (int k = 0; k < P->formula->updates; ++k)
            follow_rule(S, P->formula->update + k);
    for (const series *S = P->series; S < P->series + P->levels; ++S) {
        const size_t size = S->n * sizeof(double);
        memcpy(S->rows[PREVIOUS_RATE], S->rows[RATE], size);
        memcpy(S->rows[RATE], S->rows[NEW_RATE], size);
        for (int k = P->keep - 1; k > 0; --k)
            memcpy(S->rows[k], S->rows[k - 1], size);
        memcpy(S->rows[0], S->rows[NEW], size);
    }
}

void extrapolate(const void *context)
{
    const polynomial *P = context;
    const double *times = P->times, t = *P->t;
    for (int i = 0; i < P->count; ++i) {
        P->weights[i] = 1;
        for (int j = 0; j < P->count; ++j)
            if (times[j] != times[i])
                P->weights[i] *= (t - times[j]) / (times[i] - times[j]);
    }
    combine(P);
}

/* out = the sum of weight x row; `out` may be one of the rows. */
void combine(const void *context)
{
    const polynomial *P = context;
    add(P->out, P->rows, P->weights, P->count, 1, P->n);
}

void copy_all(const void *context)
{
    const copies *C = context;
    for (int k = 0; k < C->count; ++k)
        memmove(C->copies[k].to, C->copies[k].from, C->copies[k].n * sizeof(double));
}

void pick(const void *context)
{
    const picked *P = context;
    for (int k = 0; k < P->count; ++k)
        P->out[k] = P->entries[k].factor * *P->entries[k].from;
}

void widen(const void *context)
{
    const range *R = context;
    const double *restrict x = R->values;
    double *restrict least = R->least, *restrict largest = R->largest;
    for (ptrdiff_t k = 0; k < R->n; ++k) {
        least[k] = x[k] < least[k] ? x[k] : least[k];
        largest[k] = x[k] > largest[k] ? x[k] : largest[k];
    }
}

void find_lengths(const void *context)
{
    const vectors *V = context;
    for (ptrdiff_t k = 0; k < V->n; ++k) {
        double square = 0;
        for (int i = 0; i < 3; ++i)
            square += V->values[V->places[3 * k + i]] * V->values[V->places[3 * k + i]];
        V->out[k] = sqrt(square);
    }
}

void do_all(const void *context)
{
    const works *W = context;
    for (int k = 0; k < W->count; ++k)
        W->works[k].call(W->works[k].context);
}

void find_smallest(const void *context)
{
    const smallest *S = context;
    for (int k = 0; k < S->groups; ++k) {
        S->out[k] = S->bound;
        for (int i = S->firsts[k]; i < S->firsts[k + 1]; ++i)
            S->out[k] = fmin(S->out[k], S->values[S->places[i]]);
    }
}

static const double PI = 3.141592653589793;

static double grown(double t, double duration)
{
    return t < duration ? 0.5 * (1 - cos(PI * t / duration)) : 1.0;
}

void advance_wave(const void *context)
{
    const wave *W = context;
    *W->amplitude = W->size * grown(*W->t, W->ramp);
    *W->time_phase = W->phase - W->frequency * *W->t;
}

void advance_swing(const void *context)
{
    const swing *S = context;
    const double angle = 2 * PI * *S->t / S->period, size = grown(*S->t, S->ramp);
    for (int k = 0; k < 3; ++k)
        S->out[k] = S->position[k] + size * sin(angle + S->phase[k]) * S->amplitude[k];
}

void spin(const void *context)
{
    const spinning *S = context;
    const double *q = S->quaternion, a = q[0], b = q[1], c = q[2], d = q[3];
    const double x = S->angular_momentum[0], y = S->angular_momentum[1], z = S->angular_momentum[2];
    const double along = 2 * (b * d + a * c) * x + 2 * (c * d - a * b) * y + (a * a - b * b - c * c + d * d) * z;
    *S->out = along / (a * a + b * b + c * c + d * d);
}

void make_unit(const void *context)
{
    const unit *U = context;
    double square = 0;
    for (int k = 0; k < 4; ++k)
        square += U->quaternion[k] * U->quaternion[k];
    const double length = sqrt(square), apart = fabs(length - 1);
    *U->drift = apart > *U->drift ? apart : *U->drift;
    for (int k = 0; k < 4; ++k)
        U->quaternion[k] /= length;
}
