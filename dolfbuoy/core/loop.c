/* The loop over the cells of all forms, and what is copied around it. */

#include "core.h"

#include <string.h>

#ifdef KERNEL_TAKES_DATA
typedef void tabulate_tensor(double *, const double *, const double *, const double *, const int *, const uint8_t *,
                             void *);
#define NO_DATA , NULL
#else
typedef void tabulate_tensor(double *, const double *, const double *, const double *, const int *, const uint8_t *);
#define NO_DATA
#endif

typedef void several(double *, const double *, const double *, const double *);  /* of simd.c */

static void gather(double *to, const double *from, const int *places, ptrdiff_t n)
{
    for (ptrdiff_t k = 0; k < n; ++k)
        to[k] = from[places[k]];
}

static void spread(double *to, const double *from, const int *places, int n, int lanes)
{
    for (int k = 0; k < n; ++k)
        for (int lane = 0; lane < lanes; ++lane)
            to[k * lanes + lane] = from[places[k]];
}

/* Adds the tensors of the first `used` lanes. */
static void scatter(const integral *G, const double *tensor, ptrdiff_t begin, int used, double *out)
{
    const int *targets = G->targets + (G->shared ? 0 : begin * G->tensor);
    for (int k = 0; k < G->tensor; ++k)
        for (int lane = 0; lane < used; ++lane)
            out[G->shared ? targets[k] : targets[k * G->lanes + lane]] += tensor[k * G->lanes + lane];
}

static void integrate(const integral *G, const double *values, double *work, double *out)
{
    static const uint8_t permutation[2] = {0, 0};
    const int lanes = G->lanes, cells = *G->cells;
    double *c = work, *w = c + lanes * G->constants, *x = w + lanes * G->coefficients;
    double *own = x + lanes * G->coordinates;
    spread(c, values, G->c, G->constants, lanes);
    for (ptrdiff_t begin = 0; begin < cells; begin += lanes) {
        double *tensor = G->targets ? own : out + G->first + begin * G->tensor;
        gather(w, values, G->w + begin * G->coefficients, lanes * G->coefficients);
        gather(x, G->mesh, G->x + begin * G->coordinates, lanes * G->coordinates);
        if (G->targets)
            memset(own, 0, lanes * G->tensor * sizeof(double));
        if (lanes > 1)
            ((several *)G->kernel)(tensor, w, c, x);
        else
            ((tabulate_tensor *)G->kernel)(tensor, w, c, x, G->facets ? G->facets + begin : NULL, permutation NO_DATA);
        if (G->targets)
            scatter(G, own, begin, cells - begin < lanes ? cells - begin : lanes, out);
    }
}

void add_up(const evaluation *E)
{
    for (int n = 0; n < E->before->count; ++n)
        E->before->all[n].call(E->before->all[n].context, E->values);
    if (E->begin)
        memcpy(E->out, E->begin, E->length * sizeof(double));
    else
        memset(E->out, 0, E->length * sizeof(double));
    for (int n = 0; n < E->count; ++n)
        integrate(E->integrals + n, E->values, E->work, E->out);
}

void integrate_all(const void *context)
{
    add_up(context);
}

void put(const scaled *S, const double *x)
{
    for (ptrdiff_t k = 0; k < S->n; ++k)
        S->values[S->places[k]] = S->scale[k] * x[k];
    for (ptrdiff_t k = 0; k < S->ties; ++k)
        S->values[S->tied[k]] = S->scale[S->to[k]] * x[S->to[k]];
}

void take(const scaled *S, double *x)
{
    for (ptrdiff_t k = 0; k < S->n; ++k)
        x[k] = S->scale[k] * S->values[S->places[k]];
    for (ptrdiff_t k = 0; k < S->ties; ++k)
        x[S->to[k]] += S->scale[S->to[k]] * S->values[S->tied[k]];
}
