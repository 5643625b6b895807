/* Waves that a hull makes and diffracts: forces on five velocities, those of C and of the tip of its unit axis, whose
   vertical one does not count; see model/radiation.py. */

#include "core.h"

#include <complex.h>
#include <math.h>

enum {FIVE = 5};

static double complex at(const double *pairs, int k)
{
    return CMPLX(pairs[2 * k], pairs[2 * k + 1]);
}

/* What z = (into . v - history)/(gamma - rate) makes of F = -Re(out z): F = force - damping v. */
void eliminate(const void *context)
{
    const memory *M = context;
    for (int i = 0; i < FIVE; ++i)
        M->force[i] = 0;
    for (int i = 0; i < FIVE * FIVE; ++i)
        M->damping[i] = 0;
    for (int k = 0; k < M->modes; ++k) {
        const double complex factor = 1 / (*M->gamma - at(M->rate, k)), history = at(M->history, k);
        for (int i = 0; i < FIVE; ++i) {
            const double complex out = at(M->out, FIVE * k + i) * factor;
            if (out == 0)
                continue;
            M->force[i] += creal(out * history);
            for (int j = 0; j < FIVE; ++j)
                M->damping[FIVE * i + j] += creal(out * at(M->into, FIVE * k + j));
        }
    }
}

/* The five velocities of a body. */
static void velocities(const memory *M, double *v)
{
    const double *q = M->quaternion, a = q[0], b = q[1], c = q[2], d = q[3], *L = M->angular_momentum;
    const double square = a * a + b * b + c * c + d * d;
    const double along[2][3] = {    /* first and second axis of the body */
        {(a * a + b * b - c * c - d * d) / square, 2 * (b * c + a * d) / square, 2 * (b * d - a * c) / square},
        {2 * (b * c - a * d) / square, (a * a - b * b + c * c - d * d) / square, 2 * (c * d + a * b) / square},
    };
    double turn[2];
    for (int i = 0; i < 2; ++i)
        turn[i] = (along[i][0] * L[0] + along[i][1] * L[1] + along[i][2] * L[2]) / M->inertia[i];
    for (int i = 0; i < 3; ++i)
        v[i] = M->momentum[i] / *M->mass;
    for (int i = 0; i < 2; ++i)
        v[3 + i] = turn[1] * along[0][i] - turn[0] * along[1][i];
}

/* z of a step, from the unknowns. */
void recall(const void *context)
{
    const memory *M = context;
    double v[FIVE];
    velocities(M, v);
    for (int k = 0; k < M->modes; ++k) {
        double complex z = -at(M->history, k);
        for (int j = 0; j < FIVE; ++j)
            z += at(M->into, FIVE * k + j) * v[j];
        z /= *M->gamma - at(M->rate, k);
        M->states[2 * k] = creal(z);
        M->states[2 * k + 1] = cimag(z);
    }
}

/* False if a sum of many components was taken at this time already: once a step, as the water's motion. */
static bool stale(diffraction *D)
{
    if (D->serial && D->seen == *D->serial)
        return false;
    D->seen = D->serial ? *D->serial : 0;
    return true;
}

static double complex component(const diffraction *D, int n)
{
    const double theta = D->kx[n] * D->position[0] + D->ky[n] * D->position[1] + D->phase[n];
    return *D->scale * CMPLX(cos(theta), sin(theta));
}

/* Force of the diffracted waves where the body is, with its slope there. */
void diffract(void *context, double *values)
{
    (void)values;
    diffraction *D = context;
    if (!stale(D))
        return;
    for (int i = 0; i < FIVE; ++i)
        D->force[i] = D->slope[2 * i] = D->slope[2 * i + 1] = 0;
    for (int n = 0; n < D->count; ++n) {
        const double complex wave = component(D, n);
        for (int i = 0; i < FIVE; ++i) {
            const double complex part = at(D->transfer, FIVE * n + i) * wave;
            D->force[i] += creal(part);
            D->slope[2 * i] -= D->kx[n] * cimag(part);
            D->slope[2 * i + 1] -= D->ky[n] * cimag(part);
        }
    }
    D->place[0] = D->position[0];
    D->place[1] = D->position[1];
}

/* A slow force where the body is, of pairs of sums over the components: Re(conj(left) right), which has no part at sums
   of frequencies.  transfer: left, right along x, right along y of each pair.  It changes over the length of groups. */
static void add_pairs(const diffraction *D, int pairs)
{
    enum {MOST = 6};
    double complex sum[3 * MOST] = {0};
    for (int n = 0; n < D->count; ++n) {
        const double complex wave = component(D, n);
        for (int i = 0; i < 3 * pairs; ++i)
            sum[i] += at(D->transfer, 3 * pairs * n + i) * wave;
    }
    D->force[0] = D->force[1] = 0;
    for (int i = 0; i < pairs; ++i)
        for (int j = 0; j < 2; ++j)
            D->force[j] += creal(conj(sum[3 * i]) * sum[3 * i + j + 1]);
}

/* Less what strips have of it: six pairs. */
void drift(void *context, double *values)
{
    (void)values;
    diffraction *D = context;
    if (stale(D))
        add_pairs(D, 6);
}

/* As a whole: one pair. */
void find_drift(const void *context)
{
    add_pairs(context, 1);
}
