/* The text of a kernel of FFCx (KERNEL, a file; NAME, its function) for LANES cells at once, a cell in each lane of the
   vector registers.  With LANES > 1 the text is that of solver/simd.py: `real` for double, `choice` for bool, pick for
   ?:, and v_... for the functions of <math.h>. */

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if LANES > 1
typedef double real __attribute__((vector_size(8 * LANES)));
typedef int64_t choice __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))
#define V(x) ((real){0} + (x))          /* of a vector or a number */

INLINE real pick(choice c, real a, real b) { return (real)((c & (choice)a) | (~c & (choice)b)); }
INLINE real smaller(real a, real b) { return pick(a < b, a, b); }
INLINE real larger(real a, real b) { return pick(a > b, a, b); }

#define EACH(name) INLINE real v_##name(real x) \
    { real y; for (int k = 0; k < LANES; ++k) y[k] = name(x[k]); return y; }
#define EACH_OF_TWO(name) INLINE real each_##name(real a, real b) \
    { real y; for (int k = 0; k < LANES; ++k) y[k] = name(a[k], b[k]); return y; }
EACH(sqrt) EACH(fabs) EACH(tan) EACH(asin) EACH(atan) EACH(cosh) EACH(sinh) EACH(tanh) EACH(erf) EACH_OF_TWO(atan2)
INLINE real v_jn(int n, real x) { real y; for (int k = 0; k < LANES; ++k) y[k] = jn(n, x[k]); return y; }

#if defined(__x86_64__) && defined(__GLIBC__) && __GLIBC_PREREQ(2, 35)  /* to 4 units in the last place */
#if LANES == 8
#define GLIBC(kind, name) _ZGVeN8##kind##_##name
#elif LANES == 4
#define GLIBC(kind, name) _ZGVdN4##kind##_##name
#else
#define GLIBC(kind, name) _ZGVbN2##kind##_##name
#endif
#define VECTOR(name) real GLIBC(v, name)(real); INLINE real v_##name(real x) { return GLIBC(v, name)(x); }
real GLIBC(vv, pow)(real, real);
#define each_pow GLIBC(vv, pow)
#else
#define VECTOR EACH
EACH_OF_TWO(pow)
#endif
VECTOR(exp) VECTOR(log) VECTOR(cos) VECTOR(sin) VECTOR(acos)

INLINE real real_power(real x, real p) { return each_pow(x, p); }
INLINE real number_power(real x, double p) { return each_pow(x, V(p)); }
INLINE real whole_power(real x, int n)
{
    real y = V(1);
    for (int k = 0; k < (n < 0 ? -n : n); ++k)
        y *= x;
    return n < 0 ? 1 / y : y;
}
#define v_pow(x, p) _Generic((p), int: whole_power, double: number_power, real: real_power)(V(x), p)
#define v_atan2(y, x) each_atan2(V(y), V(x))
#define v_fmin(a, b) smaller(V(a), V(b))
#define v_fmax(a, b) larger(V(a), V(b))
#endif

#include KERNEL

#ifdef KERNEL_TAKES_DATA
#define NO_DATA , NULL
#else
#define NO_DATA
#endif

__attribute__((visibility("default"))) void several(double *, const double *, const double *, const double *);

void several(double *A, const double *w, const double *c, const double *x)
{
    NAME((void *)A, (const void *)w, (const void *)c, (const void *)x, NULL, NULL NO_DATA);
}
