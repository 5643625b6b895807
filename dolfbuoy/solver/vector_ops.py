"""Array operations of a time step, in C: extrapolation, copies, selected numbers, ranges.

Identical to NumPy to the last bit (`tests/support/in_numpy.py`).  Arrays must stay at their addresses.
"""

import itertools
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from . import Array
from .c_code import address, core


class Work(partial[Any]):
    """A function of the core whose only argument is its context, with arrays at fixed addresses.  See `together`.

    name: that of the function.  context: C struct.  alive: objects the context points to.
    """

    name: str
    context: Any
    alive: object

    def __new__(cls, name: str, context: Any, alive: object) -> "Work":
        made = super().__new__(cls, getattr(core().lib, name), context)
        made.name, made.context, made.alive = name, context, alive
        return made


def work(name: str, kind: str, fields: dict[str, Any], alive: object = ()) -> Work:
    """A `Work` whose context is a struct of this kind with these fields; arrays are passed by address."""
    return Work(name, core().ffi.new(f"{kind} *", _in_c(fields)), (fields, alive))


def _in_c(value: Any) -> Any:
    """C value of a struct field: the address for an array, recursively for a nested struct."""
    if isinstance(value, dict):
        return {key: _in_c(one) for key, one in value.items()}
    return address(value) if isinstance(value, np.ndarray) else value


def _described(kind: str, count: int) -> Any:
    return core().ffi.new(f"{kind}[]", max(1, count))


def together(*functions: Callable[[], Any]) -> Callable[[], Any]:
    """One function that calls these, without Python between consecutive `Work`; True if any returned True."""
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
    """`together` for `Work` only."""
    described = _described("work", len(works))
    for one, part in zip(described, works, strict=False):
        one.call, one.context = core().ffi.addressof(core().lib, part.name), part.context
    return work("do_all", "works", {"works": described, "count": len(works)}, works)


def copies(pairs: Sequence[tuple[Array, Array]]) -> Work:
    """A function that copies arrays in order; pairs: [(to, from), ...] of equal length each."""
    described = _described("copy", len(pairs))
    for one, (to, origin) in zip(described, pairs, strict=False):
        one.to, one.n = address(to), len(origin)
        setattr(one, "from", address(origin))
    return work("copy_all", "copies", {"copies": described, "count": len(pairs)}, pairs)


def extrapolation(times: Array, rows: Sequence[Array], t: Array, out: Array) -> Work:
    """A function that writes to `out` the value at t[0] of the Lagrange polynomial through rows at their times.

    times, rows: of equal number.  t: array (1,) with the time.
    """
    places = core().ffi.new("double *[]", [address(row) for row in rows])
    fields = {"times": times, "rows": places, "count": len(times), "t": t, "weights": np.ones(len(times))}
    return work("extrapolate", "polynomial", {**fields, "out": out, "n": len(out)}, rows)


def combination(out: Array, rows: Sequence[Array], weights: Array) -> Work:
    """A function that writes the sum of weight x row to `out`, which may be a row; weights (rows,) may be changed."""
    places = core().ffi.new("double *[]", [address(row) for row in rows])
    fields = {"rows": places, "count": len(rows), "weights": weights, "out": out, "n": len(out)}
    return work("combine", "polynomial", fields, rows)


def picked(entries: Sequence[tuple[Array, int, float]], out: Array) -> Work:
    """A function that selects numbers from arrays: out[k] = factor * array[place].

    entries: [(array, place, factor), ...], one for each number of `out`.
    """
    described = _described("entry", len(entries))
    for one, (array, place, factor) in zip(described, entries, strict=False):
        setattr(one, "from", address(array) + int(place))
        one.factor = factor
    return work("pick", "picked", {"entries": described, "count": len(entries), "out": out}, entries)


def widening(values: Array, least: Array, largest: Array) -> Work:
    """A function that updates running minima and maxima of the values, in arrays of the same size."""
    fields = {"values": values, "least": least, "largest": largest, "n": len(values)}
    return work("widen", "range", fields)


def lengths(values: Array, places: Any, out: Array) -> Work:
    """A function that writes the lengths of vectors to `out`; places (n, 3): of their components in the values."""
    places = np.array(places, dtype=np.int32)
    return work("find_lengths", "vectors", {"values": values, "places": places, "out": out, "n": len(out)})


def traced(function: Callable[[], Any], arrays: Sequence[Array]) -> list[tuple[Array, int, float]]:
    """Entries for `picked` that reproduce a function returning numbers of these arrays, possibly with opposite sign.

    Found by calling it with the arrays filled with their indices.  All other numbers are treated as constants.
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
    """A function that writes to `out` the smallest value at the places of each group, at most `bound`."""
    places = np.concatenate([np.zeros(0, np.int32), *(np.ravel(group) for group in groups)]).astype(np.int32)
    firsts = np.cumsum([0, *map(np.size, groups)]).astype(np.int32)
    fields = {"values": values, "places": places, "firsts": firsts, "groups": len(groups)}
    return work("find_smallest", "smallest", fields | {"bound": bound, "out": out})
