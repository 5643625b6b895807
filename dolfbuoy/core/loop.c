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

#define VECTOR 8                /* doubles of the largest vector, where it may begin: ALIGNED of solver/c_code.py */

typedef void several(double *, const double *, const double *, const double *);  /* of simd.c */

static inline void fill(double *to, double number, int lanes)
{
    for (int lane = 0; lane < lanes; ++lane)
        to[lane] = number;
}

static inline void gather(double *to, const double *from, const int *places, int lanes)
{
    for (int lane = 0; lane < lanes; ++lane)
        to[lane] = from[places[lane]];
}

/* Adds the tensors of the first `used` lanes. */
static void scatter(const integral *G, const double *tensor, ptrdiff_t begin, int used, double *out)
{
    const int *targets = G->targets + (G->shared ? 0 : begin * G->tensor);
    for (int k = 0; k < G->tensor; ++k)
        for (int lane = 0; lane < used; ++lane)
            out[G->shared ? targets[k] : targets[k * G->lanes + lane]] += tensor[k * G->lanes + lane];
}

/* Inlined where the number of lanes is a constant: what is copied is most of what is done for small forms. */
static inline __attribute__((always_inline)) void integrate_by(int lanes, const integral *G, const double *values,
                                                               double *work, double *out)
{
    static const uint8_t permutation[2] = {0, 0};
    const int cells = *G->cells, own = G->coefficients - G->common;
    double *c = work, *w = c + lanes * G->constants, *x = w + lanes * G->coefficients;
    double *tensor = x + lanes * G->coordinates;
    for (int k = 0; k < G->constants; ++k)
        fill(c + k * lanes, values[G->c[k]], lanes);
    for (int k = 0; k < G->common; ++k)
        fill(w + G->order[k] * lanes, values[G->w_common[k]], lanes);
    for (ptrdiff_t begin = 0; begin < cells; begin += lanes) {
        const int *from_w = G->w + begin * own, *from_x = G->x + begin * (G->coordinates / G->apart);
        if (!G->targets)
            tensor = out + G->first + begin * G->tensor;
        for (int k = 0; k < own; ++k)
            gather(w + G->order[G->common + k] * lanes, values, from_w + k * lanes, lanes);
        for (int k = 0; k < G->coordinates; k += G->apart, from_x += lanes)
            gather(x + k * lanes, G->mesh, from_x, lanes);
        if (G->targets)
            memset(tensor, 0, lanes * G->tensor * sizeof(double));
        if (lanes > 1)
            ((several *)G->kernel)(tensor, w, c, x);
        else
            ((tabulate_tensor *)G->kernel)(tensor, w, c, x, G->facets ? G->facets + begin : NULL, permutation NO_DATA);
        if (G->targets)
            scatter(G, tensor, begin, cells - begin < lanes ? cells - begin : lanes, out);
    }
}

static void integrate(const integral *G, const double *values, double *work, double *out)
{
    if (G->lanes == 8)
        integrate_by(8, G, values, work, out);
    else if (G->lanes == 1)
        integrate_by(1, G, values, work, out);
    else
        integrate_by(G->lanes, G, values, work, out);
}

/* What a cell reads and writes is on the stack, which is always at hand: a scene has several evaluations, a derivative
   many scenes. */
void add_up(const evaluation *E)
{
    double room[E->room + VECTOR];
    double *work = room + -((uintptr_t)room / sizeof(double)) % VECTOR;
    for (int n = 0; n < E->before->count; ++n)
        E->before->all[n].call(E->before->all[n].context, E->values);
    if (E->begin)
        memcpy(E->out, E->begin, E->length * sizeof(double));
    else
        memset(E->out, 0, E->length * sizeof(double));
    for (int n = 0; n < E->count; ++n)
        integrate(E->integrals + n, E->values, work, E->out);
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
