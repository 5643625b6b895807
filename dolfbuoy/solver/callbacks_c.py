"""C of `callbacks`: what PETSc's Newton method calls."""

import numpy as np
from petsc4py import PETSc

from . import c_code

_DECLARATIONS = """
typedef int%d_t petsc_int;

typedef struct {                /* of PETSc */
    int (*VecGetArrayRead)(void *, const double **);
    int (*VecRestoreArrayRead)(void *, const double **);
    int (*VecGetArray)(void *, double **);
    int (*VecRestoreArray)(void *, double **);
    int (*VecNorm)(void *, int, double *);
    int (*MatSetValuesCOO)(void *, const double *, int);
    int (*MatSeqAIJGetArray)(void *, double **);
    int (*MatSeqAIJRestoreArray)(void *, double **);
    int (*MatZeroRowsLocal)(void *, petsc_int, const petsc_int *, double, void *, void *);
    int (*MatGetDiagonal)(void *, void *);
    int (*MatDiagonalSet)(void *, void *, int);
    int (*KSPSetNormType)(void *, int);
    int (*KSPGetTolerances)(void *, double *, double *, double *, petsc_int *);
    int (*KSPSetTolerances)(void *, double, double, double, petsc_int);
    int (*SNESGetKSP)(void *, void **);
    int (*SNESGetSolution)(void *, void **);
    int (*SNESGetTolerances)(void *, double *, double *, double *, petsc_int *, petsc_int *);
    int (*SNESGetSolutionUpdate)(void *, void **);
    int (*SNESSolve)(void *, void *, void *);
    int (*SNESGetConvergedReason)(void *, int *);
    int (*SNESGetIterationNumber)(void *, petsc_int *);
} petsc;

typedef struct {                /* what Python reads and changes too */
    _Bool keep, valid, kept;    /* of JacobianAge */
    int checked;                /* whether linear solves are checked; -1: not known */
    int64_t assembled_for;      /* `assembled` of the System when the matrix at hand was made */
    int64_t residuals_total, jacobians_total;
    double last_increment, last_norm;
    double tolerance;           /* of the increments */
    double margin, slow;        /* of JacobianAge */
    _Bool own_options;          /* the scene chooses how linear solves are checked */
    double linear_tolerance;
    int linear_solves[2], linear_norm[2];               /* without a check, with one */
    int iterating, converged, not_finite, too_many;     /* reasons */
    int reason, error, iterations;                      /* of the latest attempt: SNES's and PETSc's */
    _Bool in_order;             /* it has converged, and nothing failed on the way */
    int many;                   /* iterations after which a matrix is not kept */
    _Bool clocked;              /* count the seconds of this process in `seconds` */
    double seconds;
} numbers;

typedef struct {                /* arguments of add_up */
    void *hooks, *integrals;
    int count;
    double *values, *work, *out;
    ptrdiff_t length;
} sum;

typedef struct {                /* arguments of put and take */
    double *values, *scale;
    int *places;
    ptrdiff_t n;
    int *tied, *to;
    ptrdiff_t ties;
} scaled;

typedef struct {                /* of TensionOnly */
    petsc_int count;
    const petsc_int *rows;
    const int64_t *places;      /* of the rows on the diagonal */
    const double *c, *u;
    uint8_t *slack, *slack_before;
    petsc_int *zeroed;          /* room for rows */
    void *diagonal;
} one_sided;

typedef struct {
    const petsc *petsc;
    numbers *numbers;
    int64_t *assembled;
    const int *failed;          /* a Python function before an evaluation has raised */
    void (*add_up)(void *, void *, int, double *, double *, double *, ptrdiff_t);
    void (*put)(const double *, const double *, const int *, ptrdiff_t, const int *, const int *, ptrdiff_t, double *);
    void (*take)(const double *, const double *, const int *, ptrdiff_t, const int *, const int *, ptrdiff_t, double *);
    sum residuals, jacobians;
    scaled unknowns, rows;
    void *matrix;               /* of PETSc */
    const petsc_int *begins, *columns;                  /* of its rows; column of each entry */
    const double *row_scale, *unknown_scale;
    const one_sided *law;       /* or NULL */
    void *snes, *x;
    ptrdiff_t n;                /* unknowns in x */
} newton;

int residual(void *snes, void *x, void *f, void *context);
int jacobian(void *snes, void *x, void *J, void *P, void *context);
int converged(void *snes, petsc_int iteration, double x, double step, double norm, int *reason, void *context);
void attempt(const void *context);
void judge_solve(const void *context);
"""

_SOURCE = """
#include <math.h>
#include <stdint.h>
#include <stddef.h>
#include <string.h>
#include <time.h>

#define TRY(call) do { const int error = (call); if (error) return error; } while (0)
enum {INSERT_VALUES = 1, NORM_2 = 1, NORM_INFINITY = 3};  /* PETSc's */

static double larger(double a, double b)
{
    return b > a ? b : a;
}

/* Scaled unknowns x -> u. */
static int read_solution(const newton *N, void *x)
{
    const double *values;
    const scaled *u = &N->unknowns;
    TRY(N->petsc->VecGetArrayRead(x, &values));
    N->put(values, u->scale, u->places, u->n, u->tied, u->to, u->ties, u->values);
    return N->petsc->VecRestoreArrayRead(x, &values);
}

/* u -> scaled unknowns x. */
static int set_start(const newton *N)
{
    double *values;
    TRY(N->petsc->VecGetArray(N->x, &values));
    for (ptrdiff_t k = 0; k < N->n; ++k)
        values[k] = N->unknowns.values[N->unknowns.places[k]] / N->unknowns.scale[k];
    return N->petsc->VecRestoreArray(N->x, &values);
}

/* The sum at scaled unknowns x; means nothing once a Python function has failed. */
static int add_up_at(const newton *N, const sum *S, void *x)
{
    TRY(read_solution(N, x));
    if (!*N->failed)
        N->add_up(S->hooks, S->integrals, S->count, S->values, S->work, S->out, S->length);
    return 0;
}

static void change_residual(const one_sided *L, double *b)
{
    for (petsc_int k = 0; k < L->count; ++k) {
        const double bound = -L->c[k] * L->u[L->rows[k]];
        L->slack[k] = !(b[L->rows[k]] > bound);
        if (L->slack[k])
            b[L->rows[k]] = bound;
    }
}

static int change_matrix(const petsc *petsc, const one_sided *L, void *A)
{
    petsc_int zeroed = 0;
    double *diagonal;
    memcpy(L->slack_before, L->slack, L->count);
    for (petsc_int k = 0; k < L->count; ++k)
        if (L->slack[k])
            L->zeroed[zeroed++] = L->rows[k];
    TRY(petsc->MatZeroRowsLocal(A, zeroed, L->zeroed, 0, NULL, NULL));
    TRY(petsc->MatGetDiagonal(A, L->diagonal));
    TRY(petsc->VecGetArray(L->diagonal, &diagonal));
    for (petsc_int k = 0; k < L->count; ++k)
        if (L->slack[k])
            diagonal[L->places[k]] = -L->c[k];
    TRY(petsc->VecRestoreArray(L->diagonal, &diagonal));
    return petsc->MatDiagonalSet(A, L->diagonal, INSERT_VALUES);
}

static int unsettled(const one_sided *L)
{
    return memcmp(L->slack, L->slack_before, L->count) != 0;
}

int residual(void *snes, void *x, void *f, void *context)
{
    const newton *N = context;
    const scaled *r = &N->rows;
    double *to;
    ++N->numbers->residuals_total;
    TRY(add_up_at(N, &N->residuals, x));
    if (N->law)
        change_residual(N->law, N->residuals.out);
    TRY(N->petsc->VecGetArray(f, &to));
    N->take(r->values, r->scale, r->places, r->n, r->tied, r->to, r->ties, to);
    if (*N->failed && r->n)  /* the solve ends in order, then Python tells: an error code leaves vectors locked */
        to[0] = NAN;
    return N->petsc->VecRestoreArray(f, &to);
}

static int check_linear_solves(const petsc *petsc, numbers *n, void *snes, int check)
{
    void *ksp;
    double divergence;
    if (check == n->checked)
        return 0;
    n->checked = check;
    TRY(petsc->SNESGetKSP(snes, &ksp));
    TRY(petsc->KSPSetNormType(ksp, n->linear_norm[check]));
    TRY(petsc->KSPGetTolerances(ksp, NULL, NULL, &divergence, NULL));
    return petsc->KSPSetTolerances(ksp, n->linear_tolerance, 0, divergence, n->linear_solves[check]);
}

/* As MatDiagonalScale, which goes through the matrix twice. */
static int scale(const newton *N, void *A)
{
    double *values;
    TRY(N->petsc->MatSeqAIJGetArray(A, &values));
    for (ptrdiff_t row = 0; row < N->n; ++row) {
        const double of_row = N->row_scale[row];
        for (petsc_int k = N->begins[row]; k < N->begins[row + 1]; ++k)
            values[k] = values[k] * of_row * N->unknown_scale[N->columns[k]];
    }
    return N->petsc->MatSeqAIJRestoreArray(A, &values);
}

static int assemble(const newton *N, void *A)
{
    TRY(N->petsc->MatSetValuesCOO(A, N->jacobians.out, INSERT_VALUES));
    ++*N->assembled;
    if (N->law)
        TRY(change_matrix(N->petsc, N->law, A));
    return scale(N, A);
}

int jacobian(void *snes, void *x, void *J, void *P, void *context)
{
    const newton *N = context;
    numbers *n = N->numbers;
    TRY(add_up_at(N, &N->jacobians, x));
    if (*N->failed)
        return 0;
    TRY(assemble(N, P));
    n->valid = 1;
    n->kept = 0;
    n->assembled_for = *N->assembled;
    ++n->jacobians_total;
    return 0;
}

static int judge(const petsc *petsc, numbers *n, void *snes, petsc_int iteration, double step, double norm, int *reason)
{
    void *update;
    double increment, length, shrinking = 0, ratio = 1;
    petsc_int most;
    *reason = isfinite(norm) ? n->iterating : n->not_finite;
    if (!isfinite(norm))
        return 0;
    if (iteration == 0) {
        n->last_norm = norm;
        return 0;
    }
    TRY(petsc->SNESGetSolutionUpdate(snes, &update));
    TRY(petsc->VecNorm(update, NORM_INFINITY, &increment));
    if (increment > 0) {
        TRY(petsc->VecNorm(update, NORM_2, &length));
        increment *= larger(1, step / length);
    }
    if (iteration > 1) {
        shrinking = increment / larger(n->last_increment, 1e-300);
        ratio = larger(shrinking, norm / larger(n->last_norm, 1e-300));
        ratio = ratio < 1 ? ratio : 1;
    }
    n->last_increment = increment;
    n->last_norm = norm;
    if (increment * ratio <= n->tolerance * (n->kept ? n->margin : 1)) {
        *reason = n->converged;
        return 0;
    }
    n->valid = n->keep && shrinking <= n->slow;
    TRY(petsc->SNESGetTolerances(snes, NULL, NULL, NULL, &most, NULL));
    if (iteration >= most)
        *reason = n->too_many;
    return 0;
}

/* Before an iteration: a new Jacobian if the one at hand does not serve. */
static int choose_matrix(newton *N, void *snes)
{
    numbers *n = N->numbers;
    void *x;
    n->valid = n->valid && n->assembled_for == *N->assembled;
    n->kept = n->valid;
    if (!n->own_options)
        TRY(check_linear_solves(N->petsc, n, snes, !n->kept));
    if (n->valid)
        return 0;
    TRY(N->petsc->SNESGetSolution(snes, &x));
    return jacobian(snes, x, N->matrix, N->matrix, N);
}

int converged(void *snes, petsc_int iteration, double x, double step, double norm, int *reason, void *context)
{
    newton *N = context;
    TRY(judge(N->petsc, N->numbers, snes, iteration, step, norm, reason));
    if (N->law && *reason > 0 && unsettled(N->law) && N->numbers->last_increment > N->numbers->tolerance)
        *reason = N->numbers->iterating;
    return *reason == N->numbers->iterating ? choose_matrix(N, snes) : 0;
}

static int solve(const newton *N)
{
    TRY(set_start(N));
    return N->petsc->SNESSolve(N->snes, NULL, N->x);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

/* From u to the solution, in u. */
void attempt(const void *context)
{
    const newton *N = context;
    numbers *n = N->numbers;
    petsc_int iterations = 0;
    const double begin = n->clocked ? seconds() : 0;
    n->error = solve(N);
    N->petsc->SNESGetConvergedReason(N->snes, &n->reason);
    N->petsc->SNESGetIterationNumber(N->snes, &iterations);
    n->iterations = iterations;
    read_solution(N, N->x);
    n->in_order = !n->error && n->reason > 0 && !*N->failed;
    n->seconds += n->clocked ? seconds() - begin : 0;
}

void judge_solve(const void *context)
{
    numbers *n = ((const newton *)context)->numbers;
    n->valid = n->valid && n->keep && n->iterations < n->many;
}
"""


def compiled():
    """The compiled module."""
    return c_code.module("callbacks", _DECLARATIONS % (8 * np.dtype(PETSc.IntType).itemsize), _SOURCE)
