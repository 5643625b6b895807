"""Operations of a time step on arrays, in C: extrapolation, copies, numbers picked out, ranges widened.

To the last bit what NumPy does (`tests/support/in_numpy.py`).  Arrays stay where they are.
"""

import itertools
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from . import Array
from .c_code import address, core


class Work(partial[Any]):
    """A function of the core that takes its context only: arrays that stay where they are.  See `together`.

    name: of the function.  context: struct of C.  alive: what the context points to.
    """

    name: str
    context: Any
    alive: object

    def __new__(cls, name: str, context: Any, alive: object) -> "Work":
        made = super().__new__(cls, getattr(core().lib, name), context)
        made.name, made.context, made.alive = name, context, alive
        return made


def work(name: str, kind: str, fields: dict[str, Any], alive: object = ()) -> Work:
    """A `Work` whose context is a struct of this kind with these fields, of which arrays are given as they are."""
    return Work(name, core().ffi.new(f"{kind} *", _in_c(fields)), (fields, alive))


def _in_c(value: Any) -> Any:
    """A field of a struct: the address of an array, the same of the fields of a struct in it."""
    if isinstance(value, dict):
        return {key: _in_c(one) for key, one in value.items()}
    return address(value) if isinstance(value, np.ndarray) else value


def _described(kind: str, count: int) -> Any:
    return core().ffi.new(f"{kind}[]", max(1, count))


def together(*functions: Callable[[], Any]) -> Callable[[], Any]:
    """One function that calls these, without Python between those that are `Work`; True if any returned True."""
    parts: list[Any] = []
    for in_c, group in itertools.groupby(functions, lambda function: isinstance(function, Work)):
        run: list[Any] = list(group)
        parts += [in_a_row(run)] if in_c else run
    if len(parts) == 1 and isinstance(parts[0], Work):
        return parts[0]

    def all_of_them() -> bool:  # faster than any([...])
        found = False
        for part in parts:
            if part():
                found = True
        return found

    return all_of_them if parts else in_a_row([])


def in_a_row(works: Sequence[Work]) -> Work:
    """`together` of what C does alone."""
    described = _described("work", len(works))
    for one, part in zip(described, works, strict=False):
        one.call, one.context = core().ffi.addressof(core().lib, part.name), part.context
    return work("do_all", "works", {"works": described, "count": len(works)}, works)


def copies(pairs: Sequence[tuple[Array, Array]]) -> Work:
    """A function that copies arrays, one after the other; pairs: [(to, from), ...], each of one length."""
    described = _described("copy", len(pairs))
    for one, (to, origin) in zip(described, pairs, strict=False):
        one.to, one.n = address(to), len(origin)
        setattr(one, "from", address(origin))
    return work("copy_all", "copies", {"copies": described, "count": len(pairs)}, pairs)


def extrapolation(times: Array, rows: Sequence[Array], t: Array, out: Array) -> Work:
    """A function that puts into `out` the value at t[0] of the polynomial through rows at their times [Lagrange].

    times, rows: arrays of as many.  t: array of the time (1,).
    """
    places = core().ffi.new("double *[]", [address(row) for row in rows])
    fields = {"times": times, "rows": places, "count": len(times), "t": t, "weights": np.ones(len(times))}
    return work("extrapolate", "polynomial", {**fields, "out": out, "n": len(out)}, rows)


def combination(out: Array, rows: Sequence[Array], weights: Array) -> Work:
    """A function that puts the sum of weight x row into `out`, which may be a row; weights (rows,) may be changed."""
    places = core().ffi.new("double *[]", [address(row) for row in rows])
    fields = {"rows": places, "count": len(rows), "weights": weights, "out": out, "n": len(out)}
    return work("combine", "polynomial", fields, rows)


def picked(entries: Sequence[tuple[Array, int, float]], out: Array) -> Work:
    """A function that picks numbers out of arrays: out[k] = factor * array[place].

    entries: [(array, place, factor), ...], as many as `out` has numbers.
    """
    described = _described("entry", len(entries))
    for one, (array, place, factor) in zip(described, entries, strict=False):
        setattr(one, "from", address(array) + int(place))
        one.factor = factor
    return work("pick", "picked", {"entries": described, "count": len(entries), "out": out}, entries)


def widening(values: Array, least: Array, largest: Array) -> Work:
    """A function that keeps the least and the largest of what the values have been, in arrays of as many."""
    fields = {"values": values, "least": least, "largest": largest, "n": len(values)}
    return work("widen", "range", fields)


def lengths(values: Array, places: Any, out: Array) -> Work:
    """A function that puts the lengths of vectors into `out`; places (n, 3) of their components among the values."""
    places = np.array(places, dtype=np.int32)
    return work("find_lengths", "vectors", {"values": values, "places": places, "out": out, "n": len(out)})


def traced(function: Callable[[], Any], arrays: Sequence[Array]) -> list[tuple[Array, int, float]]:
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


def _entry(number: float, change: float, arrays: Sequence[Array], ends: Array) -> tuple[Array, int, float]:
    if change == 0:
        return np.array([number]), 0, 1.0
    sign, place = np.copysign(1.0, change), round(abs(number))
    if abs(abs(change) - ends[-1]) > 1e-6 or abs(abs(number) - place) > 1e-6:
        raise ValueError(f"a number that changes from {number:g} by {change:g} is no copy of one")
    which = int(np.searchsorted(ends, place, side="right")) - 1
    return arrays[which], place - ends[which], sign


def smallest(values: Array, groups: Sequence[Array], bound: float, out: Array) -> Work:
    """A function that puts the smallest of the values at the places of each group into `out`, the bound at most."""
    places = np.concatenate([np.zeros(0, np.int32), *(np.ravel(group) for group in groups)]).astype(np.int32)
    firsts = np.cumsum([0, *map(np.size, groups)]).astype(np.int32)
    fields = {"values": values, "places": places, "firsts": firsts, "groups": len(groups)}
    return work("find_smallest", "smallest", fields | {"bound": bound, "out": out})
