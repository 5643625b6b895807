"""Kernels of FFCx for several cells at once, a cell in each lane of the vector registers.

FFCx writes kernels for one cell, of which compilers make hardly any but scalar instructions.  Their text says the same
of several cells if `double` is a vector of GNU C; tables of basis functions stay numbers.  What has to be put in other
words: initial values, choices, and the functions of <math.h>.  A kernel with anything else stays as it is.
"""

import ctypes
import platform
import re
from functools import cache, partial
from pathlib import Path

from . import c_code, compat, instructions

#: Functions that kernels may call.
FUNCTIONS = ["sqrt", "fabs", "exp", "log", "cos", "sin", "tan", "acos", "asin", "atan", "cosh", "sinh", "tanh", "erf"]
FUNCTIONS += ["atan2", "pow", "jn", "fmin", "fmax"]

#: x/y may be x times the reciprocal of y, and -0 is 0: results agree with those of single cells to rounding.
OPTIONS = ("-freciprocal-math", "-fno-signed-zeros", "-Wno-psabi")
LIBRARIES = ("mvec", "m") if platform.machine() == "x86_64" else ("m",)

_DECLARATIONS = """
extern const int lanes;
void several(double *A, const double *w, const double *c, const double *x);
"""

_VECTORS = """
typedef double real __attribute__((vector_size(8 * LANES)));
typedef int64_t choice __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))
#define V(x) ((real){0} + (x))          /* of a vector or a number */

INLINE real pick(choice c, real a, real b) { return (real)((c & (choice)a) | (~c & (choice)b)); }
INLINE real smaller(real a, real b) { return pick(a < b, a, b); }
INLINE real larger(real a, real b) { return pick(a > b, a, b); }

#define EACH(name) INLINE real v_##name(real x) \\
    { real y; for (int k = 0; k < LANES; ++k) y[k] = name(x[k]); return y; }
#define EACH_OF_TWO(name) INLINE real each_##name(real a, real b) \\
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
"""

_SOURCE = """
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#define LANES %(lanes)d
const int lanes = LANES;
%(vectors)s
static %(kernel)s
void several(double *A, const double *w, const double *c, const double *x)
{
    %(name)s((void *)A, (const void *)w, (const void *)c, (const void *)x, 0, 0%(data)s);
}
"""


class _Place(ctypes.Structure):
    """Dl_info of <dlfcn.h>."""

    _fields_ = [("file", ctypes.c_char_p), ("base", ctypes.c_void_p)]
    _fields_ += [("symbol", ctypes.c_char_p), ("address", ctypes.c_void_p)]


def several(kernel: int):
    """Address of a function that does for several cells what the kernel at an address does for one, and their number.

    It takes A, w, c and x of the kernel, each number as a vector, aligned as vectors are.  None where FFCx has not left
    the text of the kernel.
    """
    text, name = _place_of(kernel)
    return _compiled(text, name, instructions.best()) if text.exists() else None


def _place_of(kernel):
    """File with the text of a kernel, beside what FFCx has compiled of it, and its name there."""
    place = _Place()
    ctypes.CDLL(None).dladdr(ctypes.c_void_p(kernel), ctypes.byref(place))
    library = Path(place.file.decode())
    return library.with_name(library.name.split(".")[0] + ".c"), place.symbol.decode()


@cache
def _compiled(text, name, chosen):
    key = text.stem, name, chosen.name, Path(__file__).read_text()
    source = partial(_source, text, name, chosen.lanes)
    module = c_code.module("lanes", _DECLARATIONS, source, key, (*OPTIONS, *chosen.options), LIBRARIES)
    address = module.ffi.cast("uintptr_t", module.ffi.addressof(module.lib, "several"))
    return int(address), module.lib.lanes


def _source(text, name, lanes):
    """C for so many cells, or for one if the kernel needs what is not known here."""
    text = re.sub(r"//.*", "", text.read_text())
    begin = text.index(f"void {name}(")
    body = text.index("{", begin) + 1
    kernel = text[begin : body + _length(text[body:], "{}") + 1] + "\n"
    arguments = {"name": name, "data": ", 0" if compat.KERNEL_TAKES_DATA else ""}
    if not is_known(kernel):
        return _SOURCE % {"lanes": 1, "vectors": "", "kernel": kernel, **arguments}
    return _SOURCE % {"lanes": lanes, "vectors": _VECTORS, "kernel": in_vectors(kernel), **arguments}


def is_known(kernel: str) -> bool:
    """Whether a kernel's text has nothing but what `in_vectors` can put in other words."""
    body = kernel[kernel.index("{") :]
    called = set(re.findall(r"\b([A-Za-z_]\w*)\(", body)) - {"for"}
    return called <= set(FUNCTIONS) and not re.search(r"[!%^~]|->|\b(if|while|switch)\b", body)


def in_vectors(kernel: str) -> str:
    """The text of a kernel with vectors for numbers."""
    kernel = re.sub(r"(?<!static const )\bdouble\b", "real", re.sub(r"\bbool\b", "choice", kernel))
    kernel = re.sub(rf"\b({'|'.join(FUNCTIONS)})\(", r"v_\1(", kernel).replace(" && ", " & ").replace(" || ", " | ")
    kernel = "\n".join(map(_with_picks, kernel.split("\n")))
    return re.sub(r"^( *(?:(?:const )?real )?\w+(?:\[[^=;]*\])?) = ([^{};]*);$", r"\1 = V(\2);", kernel, flags=re.M)


def _with_picks(line):
    """Every `condition ? a : b` of a line as pick(condition, a, b)."""
    while "?" in line:
        at = line.rindex("?")
        begin, end = at - _length(line[at - 1 :: -1], ")(", "="), at + 1 + _length(line[at + 1 :], "()", ";")
        colon = at + 1 + _length(line[at + 1 :], "()", ":")
        parts = line[begin:at], line[at + 1 : colon], line[colon + 1 : end]
        line = f"{line[:begin]}pick({parts[0]}, V({parts[1]}), V({parts[2]})){line[end:]}"
    return line


def _length(text, brackets, end=""):
    """Of the beginning of a text up to one of `end`, or to a closing bracket that was not opened in it."""
    depth = 0
    for n, letter in enumerate(text):
        if depth == 0 and (letter in end or letter == brackets[1]):
            return n
        depth += (letter == brackets[0]) - (letter == brackets[1])
    return len(text)
