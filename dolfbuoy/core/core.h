/* The C core: types and functions of all its files.  See README.md of dolfbuoy/solver. */

#ifndef DOLFBUOY_CORE_H
#define DOLFBUOY_CORE_H

#include <assert.h>
#include <petscsnes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef PETSC_USE_COMPLEX
#error "PETSc is built for complex numbers; dolfbuoy needs the real one"
#endif
static_assert(sizeof(PetscScalar) == sizeof(double), "PETSc must be built for double precision");
static_assert(sizeof(PetscInt) == PETSC_INT_BYTES, "petscsnes.h must be that of petsc4py");
static_assert(sizeof(int) == sizeof(int32_t), "numpy.int32 is read as int");

/* Of petscsnes.h, for cffi. */
#ifdef FOR_CFFI
typedef int... PetscInt;
typedef int... PetscErrorCode;
typedef struct _p_Vec *Vec;
typedef struct _p_Mat *Mat;
typedef struct _p_IS *IS;
typedef struct _p_SNES *SNES;
typedef struct _p_PC *PC;
PetscErrorCode SNESSetLagJacobian(SNES, PetscInt);
PetscErrorCode MatSetPreallocationCOO(Mat, ptrdiff_t, PetscInt *, PetscInt *);
PetscErrorCode MatSetValuesCOO(Mat, const double *, int);
#endif

/* From here on cffi reads too: no preprocessor. */

/* -- loop.c: all forms of a residual or a Jacobian, added up over their cells -------------------------------------- */

typedef struct {
    uintptr_t kernel;           /* for one cell: tabulate_tensor of FFCx; for several: of simd.c */
    int lanes;                  /* cells at once */
    const int *cells;           /* how many; the last lanes may be too many */
    int tensor, coefficients, constants, coordinates;   /* numbers of a cell */
    int apart;                  /* 3 where kernels read x alone of the vertices' coordinates, 1 where all */
    int common;                 /* coefficients that all cells read at the same place, as unknowns of a body */
    const int *order;           /* which coefficients these are, then which the others are */
    const int *w_common, *w, *c, *x;    /* places of these, of the others (of each cell) and of constants in `values`,
                                           and of coordinates in `mesh` */
    const double *mesh;         /* coordinates of all cells of the mesh */
    bool shared;                /* all cells have the same dofs: one tensor is the sum of all */
    const int *targets;         /* places of the tensors in `out`; NULL: one after the other, from `first` on */
    ptrdiff_t first;
    const int *facets;          /* local number of the facet, or NULL; then there is one lane */
} integral;

typedef void hook_function(void *context, double *values);

typedef struct {
    hook_function *call;
    void *context;
} hook;

typedef struct {                /* what is called before an evaluation */
    int count;
    const hook *all;
} hooks;

typedef struct {
    const hooks *before;
    const integral *integrals;
    int count;
    ptrdiff_t room;             /* doubles of the form with the largest cells */
    double *values, *out;
    ptrdiff_t length;           /* of out */
    const double *begin;        /* what is added to, or NULL: zeros */
} evaluation;

typedef struct {                /* entry k of a vector of PETSc is scale[k] * values[places[k]] */
    double *values;
    const double *scale;
    const int *places;
    ptrdiff_t n;
    const int *tied, *to;       /* places that share entries */
    ptrdiff_t ties;
} scaled;

void add_up(const evaluation *E);
void integrate_all(const void *context); /* the same, of an evaluation */
void put(const scaled *S, const double *x);
void take(const scaled *S, double *x);

/* -- newton.c: what PETSc's Newton method calls ---------------------------------------------------------------------- */

typedef struct {                /* what Python reads and changes too */
    bool keep;                  /* the matrix of an earlier iteration or step may serve */
    bool valid, kept;           /* the one at hand may be used; it is not that of the present iterate */
    int checked;                /* whether linear solves are checked; -1: not known */
    int64_t assembled, assembled_for;                   /* how often the matrix was; then, for the one at hand */
    int64_t residuals_total, jacobians_total;
    double last_increment, last_norm, last_drop;
    double shrinking;           /* of the last two increments; 1: there was one */
    double tolerance;           /* of the increments */
    double fast;                /* factor of the norm after which one that falls no more is rounding; 0: none is */
    double margin, slow;        /* part of the tolerance with a kept matrix; shrinking that asks for a new one */
    bool own_options;           /* the scene chooses how linear solves are checked */
    double linear_tolerance;
    int linear_solves[2];       /* without a check, with one */
    int reason, error, iterations;                      /* of the latest attempt: SNES's and PETSc's */
    bool in_order;              /* it has converged, and nothing failed on the way */
    int many;                   /* iterations after which a matrix is not kept */
    bool improved;              /* the last increment outside of Newton's method was small enough */
    int taken, missed;          /* increments of derivatives, and derivatives for which none was small enough */
    bool clocked;               /* count the seconds of this process in `seconds` */
    double seconds;
} numbers;

typedef struct {                /* of TensionOnly */
    PetscInt count;
    const PetscInt *rows;
    const int64_t *places;      /* of the rows on the diagonal */
    const double *c, *u;
    bool *slack, *slack_before;
    PetscInt *zeroed;           /* room for rows */
    Vec diagonal;
} one_sided;

typedef struct {
    numbers *numbers;
    const int *failed;          /* a Python function before an evaluation has raised */
    const evaluation *residuals, *jacobians;
    const scaled *unknowns, *rows;                      /* with `ghosted` rows in physical units, ghosts behind them */
    Mat matrix;
    const PetscInt *begins, *columns;                   /* of its rows; column of each entry; not with `ghosted` */
    const double *row_scale, *unknown_scale;
    Vec row_scales, unknown_scales;                     /* the same */
    Vec ghosted;                /* room for own unknowns and ghosts where several ranks share them, or NULL */
    const one_sided *law;       /* or NULL */
    SNES snes;
    IS elimination;             /* places of the whole matrix in their order, or NULL: one rank numbers them so */
    Vec x, f, increment;
} newton;

PetscErrorCode read_solution(const newton *N, Vec x);
PetscErrorCode make_residual(const newton *N, Vec f);
void change_residual(const one_sided *L, double *b);
PetscErrorCode change_matrix(const one_sided *L, Mat A);
PetscErrorCode install(newton *N);
PetscErrorCode factorise_everywhere(PC pc, const char *package, bool natural);
void attempt(const void *context);
void judge_solve(const void *context);

typedef struct {                /* entries of the Jacobian in rows that forces at ends are read of: */
    ptrdiff_t count;
    const int *places, *of_rows, *of_columns;           /* where its tensors have them, and to what they belong */
} at_ends;

typedef struct {                /* of the unknowns, with the matrix at hand */
    const newton *newton;
    scaled unknowns;            /* of `increment` */
    double *increment;          /* of local unknowns; zero where they are held */
    double enough;              /* size of the last one, in units of the unknowns */
    int most;                   /* of them */
    at_ends ends;
} increments;

void improve(const void *context);

typedef struct {                /* a change of the unknowns that goes with a change of the residual */
    newton *newton;
    scaled rows, unknowns;      /* of `residual` and of `increment` */
    double *residual, *change, *increment;              /* of local unknowns; increment: zero where they are held */
    double enough, quiet;       /* size of the increment to come with which it is right, of the change and in units, */
    double rough;               /* ... and of one that shrinks no more, or ten times `quiet` */
    double size;                /* of the change */
    double last;                /* that of the increment before; 0: none */
    double rate;                /* by which increments shrink, as far as known */
    at_ends ends;
} tangent;

void renew_matrix(const void *context);
void improve_tangent(const void *context);

/* -- step.c: what a time step does with arrays ------------------------------------------------------------------------- */

/* Rows of a series: values at t_n, t_(n-1) ..., then these. */
enum {HELD = 5, RATE = 5, PREVIOUS_RATE, SECOND, AUXILIARY, NEW, NEW_RATE, HISTORY, CHANGE, ROWS};

typedef struct {                /* a row becomes the sum of weight x row, over a divisor */
    int into, terms;
    const int *rows;
    const double *weights;
    double over;
} rule;

typedef struct {                /* a time scheme for a step: y_t = gamma y + history */
    double gamma;
    rule history;
    int updates;
    const rule *update;         /* what a step that was taken changes besides values and rates */
} formula;

typedef struct {
    double *rows[13];
    ptrdiff_t n;
} series;

typedef struct {                /* quantities, their rates, the rates of those ... */
    int levels, keep;           /* keep: values */
    const series *series;       /* none longer than the one before; what is new in it is the new rate of that */
    const formula *formula;
    double *gammas;             /* of every derivative */
} past;

typedef struct {
    double *to;
    const double *from;
    ptrdiff_t n;
} copy;

typedef struct {
    const copy *copies;
    int count;
} copies;

typedef struct {                /* through rows at their times, at *t */
    const double *times;
    const double *const *rows;
    int count;
    const double *t;
    double *weights, *out;      /* weights: room, of the rows */
    ptrdiff_t n;
} polynomial;

typedef struct {
    const double *from;
    double factor;
} entry;

typedef struct {
    const entry *entries;
    int count;
    double *out;
} picked;

typedef struct {                /* least and largest of what the values have been */
    const double *values;
    double *least, *largest;
    ptrdiff_t n;
} range;

typedef struct {                /* lengths of vectors whose three components are at places among values */
    const double *values;
    const int *places;
    double *out;
    ptrdiff_t n;
} vectors;

typedef struct {                /* the smallest of each group of values, and at most the bound */
    const double *values;
    const int *places, *firsts; /* the first place of each group, and of one more */
    int groups;
    double bound, *out;
} smallest;

typedef struct {                /* a regular wave */
    const double *t;
    double size, ramp, phase, frequency;
    double *amplitude, *time_phase;
} wave;

typedef struct {                /* an end that swings */
    const double *t;
    double position[3], amplitude[3], phase[3], period, ramp;
    double *out;
} swing;

typedef struct {                /* L_C . d of a rigid body */
    const double *quaternion, *angular_momentum;
    double *out;
} spinning;

typedef struct {
    double *quaternion, *drift; /* drift: the largest distance of its length from 1 so far */
} unit;

typedef void work_function(const void *context);

typedef struct {
    work_function *call;
    const void *context;
} work;

typedef struct {
    const work *works;
    int count;
} works;

typedef struct {                /* what is done until the increment of a derivative is small enough */
    tangent *tangent;
    const works *works;
    int most;
} improvement;

void make_histories(const void *context);
void find_rates(const void *context);
void advance(const void *context);
void extrapolate(const void *context);
void combine(const void *context);
void copy_all(const void *context);
void pick(const void *context);
void widen(const void *context);
void find_lengths(const void *context);
void advance_wave(const void *context);
void advance_swing(const void *context);
void spin(const void *context);
void make_unit(const void *context);
void do_all(const void *context);
void improve_until(const void *context);
void find_smallest(const void *context);

/* -- waves.c: sums over wave components, at a point ---------------------------------------------------------------------- */

typedef struct {
    int count, padded;          /* components, rounded up to whole vectors; by rising k */
    /* of each: k and its parts along x and y, phase - omega t, A, p = A sigma/(k (1 - exp(-2kh))), sigma, exp(-2kh) */
    double *k, *kx, *ky, *phase, *amplitude, *potential, *sigma, *bottom;
    double *mean, *moment, *ones;                       /* weights */
    double *c, *s, *cosh, *sinh;                        /* room: at a point */
    double radius;              /* of the disk to which the weights belong */
    double ramp, depth;
    int serial;                 /* of the time */
    int stretching;             /* WHEELER, VERTICAL or NO_STRETCHING */
    int steep;                  /* harmonics of one wave, whose acceleration is the total one */
    double highest;             /* above which no water is, and the series of a steep wave means nothing */
    const double *level;        /* of still water, or NULL: 0 */
} waves;

void phases_at(const waves *w, double x, double y);
void sum_surface(const waves *w, const double *weight, double *out);
void sum_third(const waves *w, double *out);
void sum_below(const waves *w, double z, int count, const double *weight, bool large, double *velocity,
               double *acceleration);
void weigh(waves *w, double radius);

/* -- sample.c: the points of the forms at which the waves are summed ------------------------------------------------------ */

enum {ON_LINE, ON_AXIS, ON_SURFACE};                    /* kinds of points */
enum {WHEELER, VERTICAL, NO_STRETCHING};
enum {PLAIN, MEAN, MOMENT};                             /* weights of components over a disk */

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
    bool exact;                 /* at every evaluation, not only when stale */
    int *stale;
    int count;
    points *sets;
    const double *position, *quaternion, *center;       /* of a body, or NULL */
    double moved;               /* along the axis, from which on the points are others */
} kinematics;

void sample(void *context, double *values);

/* -- hull.c: points on the axis of a hull that follow the water plane ----------------------------------------------------- */

typedef struct {
    int points;                 /* of a piece */
    const double *at, *weights; /* where they are on [0, 1] */
    int capacity;               /* points */
    const int *places;          /* of the numbers of every point */
    double *out;
    int *count;                 /* points in use, from the first on */
} group;

typedef struct {
    int frusta;
    const double *frustum;      /* of each: heights of its ends, radii there */
    group wet, cut;
    const double *position, *quaternion, *center;
    const double *amplitude, *wavenumber, *time_phase, *cos_direction, *sin_direction;  /* NULL without such a wave */
    const kinematics *sea;      /* an irregular one, or NULL */
    const double *level;        /* of still water, or NULL: 0 */
    int expanded;               /* serial of the time at which the sea was expanded near where it meets the axis: */
    double place[2], near[11];  /* elevation, slope, curvature, third derivatives, how far away they serve */
    bool averaged;              /* over the disks */
    double least_tilt;
} hull_points;

void follow(void *context, double *values);

/* -- radiation.c: waves that a hull makes and diffracts ----------------------------------------------------------------------- */

typedef struct {                /* complex states z, z_t = rate z + into . v, each as real and imaginary part */
    int modes;
    const double *rate, *into, *out;                    /* into, out: five numbers of each */
    const double *gamma, *history;                      /* z_t = gamma z + history */
    double *damping, *force;    /* (5, 5) and 5: the force on the five velocities is force - damping v */
    const double *momentum, *quaternion, *angular_momentum, *mass, *inertia;
    double *states;
} memory;

void eliminate(const void *context);
void recall(const void *context);

typedef struct {                /* a sum of components: scale Re(transfer exp(i (kx x + ky y + phase))) */
    int count;
    const double *kx, *ky, *phase, *scale, *transfer;   /* transfer: five complex numbers of each; of drift 18, of it as a whole 3 */
    const double *position;     /* of C */
    double *force, *slope, *place;                      /* 5, (5, 2), and the x and y to which they belong; of drift 2 */
    const int *serial;          /* of the time, with which it is summed once; NULL: at every evaluation */
    int seen;
} diffraction;

void diffract(void *context, double *values);
void drift(void *context, double *values);
void find_drift(const void *context);

/* -- bed.c: lines on a sea bed -------------------------------------------------------------------------------------------- */

typedef struct {                /* points of cells: values there are those of the basis times those at nodes */
    int cells, points, nodes;
    const double *basis;        /* (points, nodes) */
    const int *dofs;            /* (cells, nodes, 3) */
} on_cells;

typedef struct {
    const double *normal, *level;   /* gap = normal . r - level */
} plane;

typedef struct {
    on_cells at;
    plane plane;
    const double *u;            /* positions; dofs are places in it and in `history` */
    const double *gamma, *history;  /* velocity = gamma u + history; gamma NULL: at rest */
    const double *stiffness, *damping, *sag, *stick, *coefficient;  /* of each cell; of friction: one */
    double *holds;              /* where friction holds on, numbers at `places` (cells, points, 3) */
    const int *places;
} friction;

enum {LENGTH, LEAVES, TOUCHDOWN, SAG = 5, COMES, FOOT, LYING = 10};     /* numbers of a line: see GroundedLength */

typedef struct {                /* a line, its cells and their points in order */
    on_cells at;
    plane plane;
    const double *u;            /* NULL: gaps and places are there already */
    const double *s;            /* of the points */
    const bool *presses;        /* points of a cell at which there is contact */
    double begin;
    double *gaps, *places, *out;
    bool *bridged;              /* room */
} lying;

typedef struct {
    const double *pieces;       /* what `find_lying` found for each */
    const int *firsts;          /* piece of each cable, and of one more */
    int cables;
    double *rows;               /* of each cable: length, touchdown */
    int *last;                  /* piece that leaves the bed there */
} lying_cables;

void drag_along(const void *context);
void find_lying(const void *context);
void sum_lying(const void *context);

/* -- bend.c: lines that bend ---------------------------------------------------------------------------------------------- */

typedef struct {                /* vertices between cells, each with one of its two cells */
    on_cells m, slope;          /* m and r' (of the reference cell) at the points of the quadrature */
    const double *u, *weights, *size_per_EI;    /* length of a cell over its bending stiffness */
    const int *vertex, *row;    /* node of the cell, place among the sizes */
    double *sizes;
} vertices;

void size_moments(const void *context);

/* To here. */

static inline double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void value_at(const on_cells *C, const double *values, int cell, int point, double *x);
void axis_of(const double *quaternion, double *d);
void surface_at(const kinematics *K, double x, double y, double radius, bool averaged, double *out);
int serial_of(const kinematics *K);
void expand_at(const kinematics *K, double x, double y, double *out);

#endif
