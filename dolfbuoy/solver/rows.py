"""What a time step does with arrays: linear combinations and copies, in C.

The functions in Python say the same as those in C, to the last bit: they are the oracle.  Arrays stay where they are.
"""

from functools import partial

from . import c_code
from .c_code import address

MOST = 5  # rows in a sum

_DECLARATIONS = f"""
typedef struct {{
    double *out;
    const double *rows[{MOST}];
    int terms;
    ptrdiff_t n;
}} sum;

typedef struct {{
    double *to;
    const double *from;
    ptrdiff_t n;
}} copy;

void add_rows(const sum *sums, int count, const double *weights);
void copy_all(const copy *copies, int count);
"""

_SOURCE = """
#include <stddef.h>
#include <string.h>
enum {PIECE = 64};

static void add_piece(const sum *S, const double *weights, ptrdiff_t first, ptrdiff_t n)
{
    double total[PIECE];  /* a row may be `out` */
    const double over = weights[S->terms];
    for (ptrdiff_t k = 0; k < n; ++k)
        total[k] = weights[0] * S->rows[0][first + k];
    for (int term = 1; term < S->terms; ++term) {
        const double weight = weights[term], *row = S->rows[term] + first;
        for (ptrdiff_t k = 0; k < n; ++k)
            total[k] += weight * row[k];
    }
    for (ptrdiff_t k = 0; k < n; ++k)
        S->out[first + k] = over == 1 ? total[k] : total[k] / over;
}

void add_rows(const sum *sums, int count, const double *weights)
{
    for (int s = 0; s < count; ++s) {
        for (ptrdiff_t first = 0; first < sums[s].n; first += PIECE) {
            const ptrdiff_t left = sums[s].n - first;
            add_piece(sums + s, weights, first, left < PIECE ? left : PIECE);
        }
        weights += sums[s].terms + 1;
    }
}

void copy_all(const copy *copies, int count)
{
    for (int k = 0; k < count; ++k)
        memmove(copies[k].to, copies[k].from, copies[k].n * sizeof(double));
}
"""


def compiled():
    """The compiled module."""
    return c_code.module("rows", _DECLARATIONS, c_code.EVERY_PRODUCT_ROUNDED + _SOURCE)


class Sums:
    """Linear combinations of rows, one after the other: each the sum of weight x row, over a divisor.

    sums: [(out, [row, ...]), ...], arrays of one length.  weights: those of each sum and its divisor, one sum after the
    other, in an array that may be changed in place.
    """

    in_c = True

    def __init__(self, sums, weights):
        library = compiled()
        self._sums, self._weights, described = sums, weights, library.ffi.new("sum[]", max(1, len(sums)))
        for one, (out, rows) in zip(described, sums, strict=False):
            one.out, one.terms, one.n = address(out), len(rows), len(out)
            one.rows[0 : len(rows)] = [address(row) for row in rows]
        self._call = partial(library.lib.add_rows, described, len(sums), address(weights))

    def __call__(self):
        if self.in_c:
            self._call()
        else:
            self.in_python()

    def in_python(self):
        """The same."""
        weights = iter(self._weights.tolist())
        for out, rows in self._sums:
            total = next(weights) * rows[0]
            for row in rows[1:]:
                total = total + next(weights) * row
            out[:] = total / next(weights)


def copies(pairs):
    """A function that copies arrays, one after the other; pairs: [(to, from), ...], each of one length."""
    library = compiled()
    described = library.ffi.new("copy[]", max(1, len(pairs)))
    for one, (to, origin) in zip(described, pairs, strict=False):
        one.to, one.n = address(to), len(origin)
        setattr(one, "from", address(origin))
    call = partial(library.lib.copy_all, described, len(pairs))
    call.alive = pairs
    return call
