"""What a time step does with arrays, in C: linear combinations, copies, numbers picked out.

The functions in Python say the same as those in C, to the last bit: they are the oracle.  Arrays stay where they are.
"""

import itertools
from functools import partial
from math import prod

import numpy as np

from . import c_code, instructions
from .c_code import address

_DECLARATIONS = """
typedef struct {
    double *out;
    double **rows;
    int terms;
    ptrdiff_t n;
} sum;

typedef struct {
    double *to;
    const double *from;
    ptrdiff_t n;
} copy;

typedef struct {
    const double *from;
    double factor;
} entry;

typedef struct {
    const sum *sums;
    int count;
    const double *weights;      /* of each sum, and its divisor */
} sums;

typedef struct {
    const copy *copies;
    int count;
} copies;

typedef struct {
    const double *times;
    int count;
    const double *t;
    double *weights;
} polynomial;

typedef struct {
    const entry *entries;
    int count;
    double *out;
} picked;

typedef struct {
    uintptr_t call;             /* void (*)(const void *context) */
    const void *context;
} work;

typedef struct {
    const work *works;
    int count;
} works;

void add_rows(const void *context);
void copy_all(const void *context);
void lagrange(const void *context);
void pick(const void *context);
void do_all(const void *context);
double smallest(const double *values, const int *places, int count, double bound);
"""

_SOURCE = """
#include <stddef.h>
#include <stdint.h>
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

void add_rows(const void *context)
{
    const sums *A = context;
    const double *weights = A->weights;
    for (const sum *S = A->sums; S < A->sums + A->count; ++S) {
        for (ptrdiff_t first = 0; first < S->n; first += PIECE) {
            const ptrdiff_t left = S->n - first;
            add_piece(S, weights, first, left < PIECE ? left : PIECE);
        }
        weights += S->terms + 1;
    }
}

void copy_all(const void *context)
{
    const copies *C = context;
    for (int k = 0; k < C->count; ++k)
        memmove(C->copies[k].to, C->copies[k].from, C->copies[k].n * sizeof(double));
}

void lagrange(const void *context)
{
    const polynomial *P = context;
    const double *times = P->times, t = *P->t;
    for (int i = 0; i < P->count; ++i) {
        P->weights[i] = 1;
        for (int j = 0; j < P->count; ++j)
            if (times[j] != times[i])
                P->weights[i] *= (t - times[j]) / (times[i] - times[j]);
    }
}

void pick(const void *context)
{
    const picked *P = context;
    for (int k = 0; k < P->count; ++k)
        P->out[k] = P->entries[k].factor * *P->entries[k].from;
}

void do_all(const void *context)
{
    const works *W = context;
    for (int k = 0; k < W->count; ++k)
        ((void (*)(const void *))W->works[k].call)(W->works[k].context);
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
    options = instructions.best().options
    return c_code.module("rows", _DECLARATIONS, c_code.EVERY_PRODUCT_ROUNDED + _SOURCE, options=options)


class Work(partial):
    """A function of C that takes its context only: arrays that stay where they are.  See `together`."""

    @classmethod
    def of(cls, library, name, context, alive):
        """The function `name` of a module of `c_code`; alive: what the context points to."""
        made = cls(getattr(library.lib, name), context)
        pointers = library.ffi.addressof(library.lib, name), context
        made.numbers = [int(library.ffi.cast("uintptr_t", pointer)) for pointer in pointers]
        made.alive = alive
        return made


def _work(name, kind, fields, alive):
    library = compiled()
    context = library.ffi.new(f"{kind} *", fields)
    return Work.of(library, name, context, (fields, alive))


def _described(kind, count):
    return compiled().ffi.new(f"{kind}[]", max(1, count))


def together(*functions):
    """One function that calls these, without Python between those that are `Work`; says whether any said True."""
    parts = []
    for in_c, group in itertools.groupby(functions, lambda function: isinstance(function, Work)):
        run = list(group)
        parts += [_in_a_row(run)] if in_c else run
    if len(parts) > 1 or not all(isinstance(part, Work) for part in parts):
        return lambda: any([part() for part in parts])  # noqa: C419  # all of them
    return parts[0] if parts else _in_a_row([])


def _in_a_row(works):
    described, ffi = _described("work", len(works)), compiled().ffi
    for one, work in zip(described, works, strict=False):
        one.call, one.context = work.numbers[0], ffi.cast("void *", work.numbers[1])
    return _work("do_all", "works", [described, len(works)], works)


class Sums:
    """Linear combinations of rows, one after the other: each the sum of weight x row, over a divisor.

    sums: [(out, [row, ...]), ...], arrays of one length.  weights: those of each sum and its divisor, one sum after the
    other, in an array that may be changed in place.
    """

    in_c = True

    def __init__(self, sums, weights):
        self._sums, self._weights = sums, weights

    def work(self):
        """A function that does it."""
        if not self.in_c:
            return self.in_python
        described = _described("sum", len(self._sums))
        lists = [compiled().ffi.new("double *[]", [address(row) for row in rows]) for _, rows in self._sums]
        for one, of_one, (out, rows) in zip(described, lists, self._sums, strict=False):
            one.out, one.rows, one.terms, one.n = address(out), of_one, len(rows), len(out)
        return _work("add_rows", "sums", [described, len(self._sums), address(self._weights)], (self, lists))

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
    described = _described("copy", len(pairs))
    for one, (to, origin) in zip(described, pairs, strict=False):
        one.to, one.n = address(to), len(origin)
        setattr(one, "from", address(origin))
    return _work("copy_all", "copies", [described, len(pairs)], pairs)


class Extrapolation:
    """The polynomial through the values of some rows at their times.

    times, rows: arrays of as many.  t: array of the time (1,) at which `work` puts its value into the array `out`.
    """

    in_c = True

    def __init__(self, times, rows, t, out):
        self._times, self._t, self.weights = times, t, np.ones(len(times) + 1)
        weigh = self.weigh
        if self.in_c:
            fields = [address(times), len(times), address(t), address(self.weights)]
            weigh = _work("lagrange", "polynomial", fields, (times, t, self.weights))
        self.work = together(weigh, Sums([(out, rows)], self.weights).work())

    def weigh(self):
        """Weights of the rows, in Python [Lagrange]."""
        times, t = self._times.tolist(), self._t.item()
        self.weights[:-1] = [prod((t - tj) / (ti - tj) for tj in times if tj != ti) for ti in times]


def picked(entries, out):
    """A function that picks numbers out of arrays: out[k] = factor * array[place].

    entries: [(array, place, factor), ...], as many as `out` has numbers.
    """
    described = _described("entry", len(entries))
    for one, (array, place, factor) in zip(described, entries, strict=False):
        setattr(one, "from", address(array) + int(place))
        one.factor = factor
    return _work("pick", "picked", [described, len(entries), address(out)], (entries, out))


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
