"""What a time step does with arrays, in C: linear combinations, copies, numbers picked out.

The functions in Python say the same as those in C, to the last bit: they are the oracle.  Arrays stay where they are.
"""

from functools import partial
from math import prod

import numpy as np

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

typedef struct {{
    const double *from;
    double factor;
}} entry;

void add_rows(const sum *sums, int count, const double *weights);
void copy_all(const copy *copies, int count);
void lagrange(const double *times, int count, double t, double *weights);
void pick(const entry *entries, int count, double *out);
double smallest(const double *values, const int *places, int count, double bound);
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

void lagrange(const double *times, int count, double t, double *weights)
{
    for (int i = 0; i < count; ++i) {
        weights[i] = 1;
        for (int j = 0; j < count; ++j)
            if (times[j] != times[i])
                weights[i] *= (t - times[j]) / (times[i] - times[j]);
    }
}

void pick(const entry *entries, int count, double *out)
{
    for (int k = 0; k < count; ++k)
        out[k] = entries[k].factor * *entries[k].from;
}

double smallest(const double *values, const int *places, int count, double bound)
{
    for (int k = 0; k < count; ++k)
        bound = values[places[k]] < bound ? values[places[k]] : bound;
    return bound;
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


class Extrapolation:
    """The polynomial through the values of some rows at their times.

    times, rows: arrays of as many.  `out`: its value at the latest `t`.
    """

    in_c = True

    def __init__(self, times, rows):
        self._times, self._weights, self.out = times, np.ones(len(times) + 1), np.zeros(len(rows[0]))
        self._sum = Sums([(self.out, rows)], self._weights)
        self._call = partial(compiled().lib.lagrange, address(times), len(times))
        self._place = address(self._weights)

    def __call__(self, t):
        if self.in_c:
            self._call(t, self._place)
        else:
            self._weights[:-1] = self.weights(t)
        self._sum()
        return self.out

    def weights(self, t):
        """Of the rows, in Python [Lagrange]."""
        times = self._times.tolist()
        return [prod((t - tj) / (ti - tj) for tj in times if tj != ti) for ti in times]


def picked(entries, out):
    """A function that picks numbers out of arrays: out[k] = factor * array[place].

    entries: [(array, place, factor), ...], as many as `out` has numbers.
    """
    library = compiled()
    described = library.ffi.new("entry[]", max(1, len(entries)))
    for one, (array, place, factor) in zip(described, entries, strict=False):
        setattr(one, "from", address(array) + int(place))
        one.factor = factor
    call = partial(library.lib.pick, described, len(entries), address(out))
    call.alive = entries, out
    return call


def traced(function, arrays):
    """Entries for `picked` of what a function returns, which copies numbers of these arrays, perhaps with another sign.

    Found by calling it with their places in them.  Numbers that come from elsewhere are taken as they are, for good.
    """
    ends = np.cumsum([1, *map(len, arrays)])
    kept, found = [array.copy() for array in arrays], []
    try:
        for shift in (0.0, float(ends[-1])):
            for array, first in zip(arrays, ends, strict=False):
                array[:] = first + shift + np.arange(len(array))
            found.append(np.array(function(), dtype=float).ravel())
    finally:
        for array, values in zip(arrays, kept, strict=True):
            array[:] = values
    return [_entry(number, more - number, arrays, ends) for number, more in zip(*found, strict=True)]


def _entry(number, change, arrays, ends):
    if change == 0:
        return np.array([number]), 0, 1.0
    sign, place = np.copysign(1.0, change), round(abs(number))
    if abs(abs(change) - ends[-1]) > 1e-6 or abs(abs(number) - place) > 1e-6:
        raise ValueError(f"a number that changes from {number:g} by {change:g} is no copy of one")
    which = np.searchsorted(ends, place, side="right") - 1
    return arrays[which], place - ends[which], sign


def smallest(values, places, bound):
    """A function that returns the smallest of values[places], or the bound if that is smaller."""
    library, places = compiled(), np.array(places, dtype=np.int32).ravel()
    call = partial(library.lib.smallest, address(values), address(places), len(places), bound)
    call.alive = values, places
    return call
