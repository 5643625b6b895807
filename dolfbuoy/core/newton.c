/* Residual, Jacobian and stopping rule that PETSc's Newton method calls. */

#include "core.h"

#include <math.h>
#include <string.h>
#include <time.h>

#define TRY(call) do { const PetscErrorCode error = (call); if (error) return error; } while (0)

/* SNES_DIVERGED_FNORM_NAN, or SNES_DIVERGED_FUNCTION_NANORINF since PETSc 3.25. */
static const SNESConvergedReason NOT_FINITE = (SNESConvergedReason)-4;

/* Of linear solves without a check, and with one. */
static const double STAGNANT = 0.3;  /* factor of the residual's norm in an iteration where it falls no more */
static const KSPNormType LINEAR_NORM[2] = {KSP_NORM_NONE, KSP_NORM_UNPRECONDITIONED};

static const double LEAST_RATE = 1e-3;  /* measured: impacts have such rates, a hundred times those before */

static double larger(double a, double b)
{
    return b > a ? b : a;
}

/* Own unknowns x and ghosts -> values. */
static PetscErrorCode read_shared(const newton *N, const scaled *to, Vec x)
{
    Vec local;
    const PetscScalar *values;
    TRY(VecCopy(x, N->ghosted));
    TRY(VecGhostUpdateBegin(N->ghosted, INSERT_VALUES, SCATTER_FORWARD));
    TRY(VecGhostUpdateEnd(N->ghosted, INSERT_VALUES, SCATTER_FORWARD));
    TRY(VecGhostGetLocalForm(N->ghosted, &local));
    TRY(VecGetArrayRead(local, &values));
    put(to, values);
    TRY(VecRestoreArrayRead(local, &values));
    return VecGhostRestoreLocalForm(N->ghosted, &local);
}

static PetscErrorCode read_into(const newton *N, const scaled *to, Vec x)
{
    const PetscScalar *values;
    if (N->ghosted)
        return read_shared(N, to, x);
    TRY(VecGetArrayRead(x, &values));
    put(to, values);
    return VecRestoreArrayRead(x, &values);
}

/* Scaled unknowns x -> u. */
PetscErrorCode read_solution(const newton *N, Vec x)
{
    return read_into(N, N->unknowns, x);
}

/* u -> scaled unknowns x. */
static PetscErrorCode set_start(const newton *N)
{
    PetscInt n;
    PetscScalar *values;
    const scaled *u = N->unknowns;
    TRY(VecGetLocalSize(N->x, &n));
    TRY(VecGetArray(N->x, &values));
    for (PetscInt k = 0; k < n; ++k)
        values[k] = u->values[u->places[k]] / u->scale[k];
    return VecRestoreArray(N->x, &values);
}

/* Sums of all ranks of a residual. */
static PetscErrorCode add_ranks(const newton *N, const scaled *rows)
{
    Vec local;
    PetscScalar *to;
    TRY(VecGhostGetLocalForm(N->ghosted, &local));
    TRY(VecGetArray(local, &to));
    take(rows, to);
    TRY(VecRestoreArray(local, &to));
    TRY(VecGhostRestoreLocalForm(N->ghosted, &local));
    TRY(VecGhostUpdateBegin(N->ghosted, ADD_VALUES, SCATTER_REVERSE));
    return VecGhostUpdateEnd(N->ghosted, ADD_VALUES, SCATTER_REVERSE);
}

static PetscErrorCode make_rows(const newton *N, const scaled *rows, Vec f)
{
    PetscScalar *to;
    if (N->ghosted) {
        TRY(add_ranks(N, rows));
        return VecPointwiseMult(f, N->ghosted, N->row_scales);
    }
    TRY(VecGetArray(f, &to));
    take(rows, to);
    return VecRestoreArray(f, &to);
}

/* The latest residual -> scaled rows f. */
PetscErrorCode make_residual(const newton *N, Vec f)
{
    return make_rows(N, N->rows, f);
}

/* The sum at scaled unknowns x; means nothing once a Python function has failed. */
static PetscErrorCode add_up_at(const newton *N, const evaluation *E, Vec x)
{
    TRY(read_solution(N, x));
    if (!*N->failed)
        add_up(E);
    return 0;
}

void change_residual(const one_sided *L, double *b)
{
    for (PetscInt k = 0; k < L->count; ++k) {
        const double bound = -L->c[k] * L->u[L->rows[k]];
        L->slack[k] = !(b[L->rows[k]] > bound);
        if (L->slack[k])
            b[L->rows[k]] = bound;
    }
}

PetscErrorCode change_matrix(const one_sided *L, Mat A)
{
    PetscInt zeroed = 0;
    PetscScalar *diagonal;
    memcpy(L->slack_before, L->slack, L->count * sizeof *L->slack);
    for (PetscInt k = 0; k < L->count; ++k)
        if (L->slack[k])
            L->zeroed[zeroed++] = L->rows[k];
    TRY(MatZeroRowsLocal(A, zeroed, L->zeroed, 0, NULL, NULL));
    TRY(MatGetDiagonal(A, L->diagonal));
    TRY(VecGetArray(L->diagonal, &diagonal));
    for (PetscInt k = 0; k < L->count; ++k)
        if (L->slack[k])
            diagonal[L->places[k]] = -L->c[k];
    TRY(VecRestoreArray(L->diagonal, &diagonal));
    return MatDiagonalSet(A, L->diagonal, INSERT_VALUES);
}

/* Whether on any rank the rows are not those of the last increment. */
static PetscErrorCode compare_rows(const newton *N, bool *changed)
{
    const one_sided *L = N->law;
    *changed = L->count && memcmp(L->slack, L->slack_before, L->count * sizeof *L->slack) != 0;
    if (N->ghosted)
        TRY(MPI_Allreduce(MPI_IN_PLACE, changed, 1, MPI_C_BOOL, MPI_LOR, PetscObjectComm((PetscObject)N->x)));
    return 0;
}

/* The solve ends in order, then Python raises: an error code would leave vectors locked. */
static PetscErrorCode spoil(Vec f)
{
    PetscInt n;
    PetscScalar *to;
    TRY(VecGetLocalSize(f, &n));
    TRY(VecGetArray(f, &to));
    if (n)
        to[0] = NAN;
    return VecRestoreArray(f, &to);
}

static PetscErrorCode residual(SNES snes, Vec x, Vec f, void *context)
{
    const newton *N = context;
    (void)snes;
    ++N->numbers->residuals_total;
    TRY(add_up_at(N, N->residuals, x));
    if (N->law)
        change_residual(N->law, N->residuals->out);
    TRY(make_residual(N, f));
    return *N->failed ? spoil(f) : 0;
}

static PetscErrorCode check_linear_solves(numbers *n, SNES snes, int check)
{
    KSP ksp;
    PetscReal divergence;
    if (check == n->checked)
        return 0;
    n->checked = check;
    TRY(SNESGetKSP(snes, &ksp));
    TRY(KSPSetNormType(ksp, LINEAR_NORM[check]));
    TRY(KSPGetTolerances(ksp, NULL, NULL, &divergence, NULL));
    return KSPSetTolerances(ksp, n->linear_tolerance, 0, divergence, n->linear_solves[check]);
}

/* As MatDiagonalScale, which goes through the matrix twice. */
static PetscErrorCode scale(const newton *N, Mat A)
{
    PetscScalar *values;
    if (N->ghosted)
        return MatDiagonalScale(A, N->row_scales, N->unknown_scales);
    TRY(MatSeqAIJGetArray(A, &values));
    for (ptrdiff_t row = 0; row < N->unknowns->n; ++row) {
        const double of_row = N->row_scale[row];
        for (PetscInt k = N->begins[row]; k < N->begins[row + 1]; ++k)
            values[k] = values[k] * of_row * N->unknown_scale[N->columns[k]];
    }
    return MatSeqAIJRestoreArray(A, &values);
}

static PetscErrorCode assemble(const newton *N, Mat A)
{
    TRY(MatSetValuesCOO(A, N->jacobians->out, INSERT_VALUES));
    ++N->numbers->assembled;
    if (N->law)
        TRY(change_matrix(N->law, A));
    return scale(N, A);
}

static PetscErrorCode jacobian(SNES snes, Vec x, Mat J, Mat P, void *context)
{
    const newton *N = context;
    numbers *n = N->numbers;
    (void)snes, (void)J;
    TRY(add_up_at(N, N->jacobians, x));
    TRY(assemble(N, P));  /* even if a Python function has failed: other ranks take part */
    if (*N->failed)
        return 0;
    n->valid = true;
    n->kept = false;
    n->assembled_for = n->assembled;
    ++n->jacobians_total;
    return 0;
}

static PetscErrorCode judge(numbers *n, SNES snes, PetscInt iteration, double step, double norm,
                            SNESConvergedReason *reason)
{
    Vec update;
    PetscReal increment, length;
    PetscInt most;
    double shrinking = 0, ratio = 1, drop = norm / larger(n->last_norm, 1e-300);
    bool at_rounding;
    *reason = isfinite(norm) ? SNES_CONVERGED_ITERATING : NOT_FINITE;
    if (!isfinite(norm))
        return 0;
    if (iteration == 0) {
        n->shrinking = 1;
        n->last_norm = norm;
        n->last_drop = 1;
        return 0;
    }
    TRY(SNESGetSolutionUpdate(snes, &update));
    TRY(VecNorm(update, NORM_INFINITY, &increment));
    if (increment > 0) {
        TRY(VecNorm(update, NORM_2, &length));
        increment *= larger(1, step / length);
    }
    if (iteration > 1) {
        n->shrinking = shrinking = increment / larger(n->last_increment, 1e-300);
        ratio = larger(shrinking, drop);
        ratio = ratio < 1 ? ratio : 1;
    }
    n->last_increment = increment;
    /* Rounding: a residual that fell fast and falls no more; a matrix that is too old lets it fall evenly. */
    at_rounding = increment <= n->tolerance && drop > STAGNANT && n->last_drop < n->fast;
    n->last_norm = norm;
    n->last_drop = drop;
    if (at_rounding || increment * ratio <= n->tolerance * (n->kept ? n->margin : 1)) {
        *reason = SNES_CONVERGED_SNORM_RELATIVE;
        return 0;
    }
    /* Where rounding is told from slowness a residual that falls counts too: the first increment of a tension is small,
       as that of the position has not turned anything yet, and the second no sign of a bad matrix. */
    shrinking = n->fast > 0 && iteration > 1 && drop < shrinking ? drop : shrinking;
    n->valid = n->keep && shrinking <= n->slow;
    TRY(SNESGetTolerances(snes, NULL, NULL, NULL, &most, NULL));
    if (iteration >= most)
        *reason = SNES_DIVERGED_MAX_IT;
    return 0;
}

/* Before an iteration: a new Jacobian if the one at hand does not serve. */
static PetscErrorCode choose_matrix(newton *N, SNES snes)
{
    numbers *n = N->numbers;
    Vec x;
    n->valid = n->valid && n->assembled_for == n->assembled;
    n->kept = n->valid;
    if (!n->own_options)
        TRY(check_linear_solves(n, snes, !n->kept));
    if (n->valid)
        return 0;
    TRY(SNESGetSolution(snes, &x));
    return jacobian(snes, x, N->matrix, N->matrix, N);
}

static PetscErrorCode converged(SNES snes, PetscInt iteration, PetscReal x, PetscReal step, PetscReal norm,
                                SNESConvergedReason *reason, void *context)
{
    newton *N = context;
    bool changed = false;
    (void)x;
    TRY(judge(N->numbers, snes, iteration, step, norm, reason));
    if (N->law && *reason > 0)
        TRY(compare_rows(N, &changed));
    if (changed && N->numbers->last_increment > N->numbers->tolerance)
        *reason = SNES_CONVERGED_ITERATING;
    return *reason == SNES_CONVERGED_ITERATING ? choose_matrix(N, snes) : 0;
}

/* Let SNES call these functions. */
PetscErrorCode install(newton *N)
{
    TRY(SNESSetFunction(N->snes, N->f, residual, N));
    TRY(SNESSetJacobian(N->snes, N->matrix, N->matrix, jacobian, N));
    return SNESSetConvergenceTest(N->snes, converged, N, NULL);
}

static IS elimination;  /* of the solve under way: PETSc gives an ordering no context */

/* Rows of equal pattern that follow each other ("inodes") stay together: PETSc wants the order of such groups. */
static PetscErrorCode order_of_elimination(Mat A, MatOrderingType type, IS *rows, IS *columns)
{
    PetscInt groups, *sizes, most, n, group = 0, count = 0, *of_row, *order;
    const PetscInt *places;
    (void)type;
    TRY(MatInodeGetInodeSizes(A, &groups, &sizes, &most));
    TRY(ISGetLocalSize(elimination, &n));
    TRY(PetscMalloc2(n, &of_row, n, &order));
    for (PetscInt row = 0; row < n; ++group)
        for (PetscInt end = row + (sizes ? sizes[group] : 1); row < end; ++row)
            of_row[row] = group;
    TRY(ISGetIndices(elimination, &places));
    for (PetscInt k = 0; k < n; ++k)
        if (places[k] == 0 || of_row[places[k]] != of_row[places[k] - 1])  /* the first of its group */
            order[count++] = of_row[places[k]];
    TRY(ISRestoreIndices(elimination, &places));
    TRY(ISCreateGeneral(PETSC_COMM_SELF, count, order, PETSC_COPY_VALUES, rows));
    TRY(ISCreateGeneral(PETSC_COMM_SELF, count, order, PETSC_COPY_VALUES, columns));
    return PetscFree2(of_row, order);
}

/* Let every rank have the whole matrix and factorise it: one way to add up, and no messages while it lasts. */
PetscErrorCode factorise_everywhere(PC pc, const char *package, bool natural)
{
    KSP ksp;
    TRY(PCSetType(pc, PCREDUNDANT));
    TRY(PCRedundantGetKSP(pc, &ksp));
    TRY(KSPSetType(ksp, KSPPREONLY));
    TRY(KSPGetPC(ksp, &pc));
    TRY(PCSetType(pc, PCLU));
    TRY(PCFactorSetMatSolverType(pc, package));
    if (!natural)
        return 0;
    TRY(MatOrderingRegister("elimination", order_of_elimination));
    return PCFactorSetMatOrderingType(pc, "elimination");
}

static PetscErrorCode solve(const newton *N)
{
    elimination = N->elimination;
    TRY(set_start(N));
    return SNESSolve(N->snes, NULL, N->x);
}

/* What came of a solve, be it an error. */
static PetscErrorCode read_outcome(const newton *N)
{
    SNESConvergedReason reason;
    PetscInt iterations;
    TRY(SNESGetConvergedReason(N->snes, &reason));
    TRY(SNESGetIterationNumber(N->snes, &iterations));
    N->numbers->reason = reason;
    N->numbers->iterations = iterations;
    return read_solution(N, N->x);
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
    const double begin = n->clocked ? seconds() : 0;
    const PetscErrorCode of_solve = solve(N), of_outcome = read_outcome(N);
    n->error = of_solve ? of_solve : of_outcome;
    n->in_order = !n->error && n->reason > 0 && !*N->failed;
    n->seconds += n->clocked ? seconds() - begin : 0;
}

void judge_solve(const void *context)
{
    numbers *n = ((const newton *)context)->numbers;
    n->valid = n->valid && n->keep && n->iterations < n->many;
}

static PetscErrorCode evaluate(const newton *N)
{
    TRY(add_up_at(N, N->residuals, N->x));
    return make_residual(N, N->f);
}

/* The residual after an increment, in rows that forces at ends are read of. */
static void change_at_ends(const at_ends *E, const newton *N, const double *increment, double *residual)
{
    for (ptrdiff_t k = 0; k < E->count; ++k)
        residual[E->of_rows[k]] -= N->jacobians->out[E->places[k]] * increment[E->of_columns[k]];
}

static PetscErrorCode take_increments(const increments *S)
{
    KSP ksp;
    PetscReal size = 0;
    const newton *N = S->newton;
    numbers *n = N->numbers;
    TRY(SNESGetKSP(N->snes, &ksp));
    TRY(set_start(N));
    for (int k = 0; k < S->most && !n->improved && isfinite(size); ++k) {
        TRY(evaluate(N));
        TRY(KSPSolve(ksp, N->f, N->increment));
        TRY(VecAXPY(N->x, -1, N->increment));
        TRY(VecNorm(N->increment, NORM_INFINITY, &size));
        n->improved = size <= S->enough;
    }
    TRY(read_into(N, &S->unknowns, N->increment));
    change_at_ends(&S->ends, N, S->increment, N->residuals->out);
    return read_solution(N, N->x);
}

/* From u, increments with the matrix at hand until one is small enough; then the residual in rows of ends. */
void improve(const void *context)
{
    const increments *S = context;
    numbers *n = S->newton->numbers;
    n->improved = false;
    if (take_increments(S) || *S->newton->failed)
        n->improved = false;
}

static PetscErrorCode take_matrix(newton *N)
{
    KSP ksp;
    TRY(set_start(N));
    TRY(jacobian(N->snes, N->x, N->matrix, N->matrix, N));
    TRY(SNESGetKSP(N->snes, &ksp));
    return KSPSetOperators(ksp, N->matrix, N->matrix);
}

/* The Jacobian at u, for solves that are no Newton's. */
void renew_matrix(const void *context)
{
    newton *N = (newton *)context;
    N->numbers->error = take_matrix(N);
}

/* Largest of own unknowns, in their units. */
static PetscErrorCode largest(const newton *N, const double *values, double *size)
{
    const scaled *u = N->unknowns;
    PetscInt n;
    *size = 0;
    TRY(VecGetLocalSize(N->x, &n));
    for (PetscInt k = 0; k < n; ++k) {
        const double value = fabs(values[u->places[k]]);
        if (value > *size * u->scale[k])  /* hardly ever: a division takes longer */
            *size = value / u->scale[k];
    }
    if (N->ghosted)
        TRY(MPI_Allreduce(MPI_IN_PLACE, size, 1, MPI_DOUBLE, MPI_MAX, PetscObjectComm((PetscObject)N->x)));
    return 0;
}

/* Whether a change of the unknowns is right after an increment of this size.

The rate is that of the last two increments, not trusted below LEAST_RATE nor below that of Newton's method with this
matrix, and a little less with every step that was content with one. */
static bool enough(tangent *T, double size)
{
    const bool first = T->last == 0, stalls = !first && size > T->last / 2;
    T->rate = first ? 1.1 * T->rate : size / T->last;
    T->rate = larger(larger(LEAST_RATE, T->newton->numbers->shrinking), T->rate < 1 ? T->rate : 1);
    T->last = larger(size, 1e-300);
    return T->rate * size <= larger(T->enough * T->size, T->quiet) ||
           (stalls && size <= larger(T->rough * T->size, 10 * T->quiet));
}

/* The increment of a residual in f.  Once a solve with a new matrix has been looked at, its factors are all that the
   others need: KSPSolve looks up options each time. */
static PetscErrorCode solve_once(const newton *N, bool *solved)
{
    KSP ksp;
    PC pc;
    KSPConvergedReason reason;
    numbers *n = N->numbers;
    TRY(SNESGetKSP(N->snes, &ksp));
    if (n->kept && !n->own_options) {
        TRY(KSPGetPC(ksp, &pc));
        *solved = true;
        return PCApply(pc, N->f, N->increment);
    }
    if (!n->own_options)
        TRY(check_linear_solves(n, N->snes, true));
    n->kept = true;
    elimination = N->elimination;
    TRY(KSPSolve(ksp, N->f, N->increment));
    TRY(KSPGetConvergedReason(ksp, &reason));
    *solved = reason > 0;
    return 0;
}

static PetscErrorCode take_tangent_increment(tangent *T)
{
    const newton *N = T->newton;
    const one_sided *L = N->law;
    numbers *n = N->numbers;
    bool solved;
    PetscReal size;
    for (PetscInt k = 0; L && k < L->count; ++k)
        if (L->slack[k])
            T->residual[L->rows[k]] = -L->c[k] * T->change[L->rows[k]];
    TRY(make_rows(N, &T->rows, N->f));
    TRY(solve_once(N, &solved));
    TRY(read_into(N, &T->unknowns, N->increment));
    for (ptrdiff_t k = 0; k < N->residuals->length; ++k)
        T->change[k] -= T->increment[k];
    change_at_ends(&T->ends, N, T->increment, T->residual);
    TRY(VecNorm(N->increment, NORM_INFINITY, &size));
    TRY(largest(N, T->change, &T->size));
    n->improved = enough(T, size) && solved;
    return 0;
}

/* One increment of a change of the unknowns, from the residual's, which is then that after it in rows that are held. */
void improve_tangent(const void *context)
{
    tangent *T = (tangent *)context;
    T->newton->numbers->improved = false;
    if (take_tangent_increment(T))
        T->newton->numbers->improved = false;
}

/* Until one is small enough, which `improved` says. */
void improve_until(const void *context)
{
    const improvement *S = context;
    numbers *n = S->tangent->newton->numbers;
    S->tangent->last = 0;
    n->improved = false;
    for (int k = 0; k < S->most && !n->improved; ++k, ++n->taken)
        do_all(S->works);
    n->missed += !n->improved;
}
