/* Sums over wave components at a point.

With -ffast-math they use the vectors of the processor and of libmvec.  The library is never linked with that option, for
gcc would then turn off denormal numbers in the whole process.  cos(x - pi/2) is a sine that gcc does not fuse with the
cosine, which it could not do in vectors. */

#include "core.h"

#include <math.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__gnu_linux__)
#define VECTORS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define VECTORS
#endif
#define WHOLE 8                 /* components of the widest vector */
#define ALIGNED(x) __builtin_assume_aligned(x, 64)

/* Cosines and sines of all phases at a place, for the sums that follow. */
VECTORS void phases_at(const waves *w, double x, double y)
{
    const int n = w->padded / WHOLE * WHOLE;
    const double *kx = ALIGNED(w->kx), *ky = ALIGNED(w->ky), *phase = ALIGNED(w->phase);
    double *restrict c = ALIGNED(w->c), *restrict s = ALIGNED(w->s);
    for (int i = 0; i < n; ++i)
        c[i] = cos(kx[i] * x + ky[i] * y + phase[i]);
    for (int i = 0; i < n; ++i)
        s[i] = cos(kx[i] * x + ky[i] * y + phase[i] - M_PI_2);
}

/* Elevation, slope and curvature. */
VECTORS void sum_surface(const waves *w, const double *weight, double *out)
{
    const int n = w->padded / WHOLE * WHOLE;
    const double *kx = ALIGNED(w->kx), *ky = ALIGNED(w->ky), *A = ALIGNED(w->amplitude), *W = ALIGNED(weight);
    const double *c = ALIGNED(w->c), *s = ALIGNED(w->s);
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
    const double *kx = ALIGNED(w->kx), *ky = ALIGNED(w->ky), *A = ALIGNED(w->amplitude), *s = ALIGNED(w->s);
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
VECTORS void sum_below(const waves *w, double z, int count, const double *weight, bool large, double *velocity,
                       double *acceleration)
{
    const int n = count / WHOLE * WHOLE;
    const double *k = ALIGNED(w->k), *kx = ALIGNED(w->kx), *ky = ALIGNED(w->ky), *p = ALIGNED(w->potential);
    const double *sigma = ALIGNED(w->sigma), *bottom = ALIGNED(w->bottom), *W = ALIGNED(weight);
    const double *c = ALIGNED(w->c), *s = ALIGNED(w->s);
    double *restrict C = ALIGNED(w->cosh), *restrict S = ALIGNED(w->sinh);
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
