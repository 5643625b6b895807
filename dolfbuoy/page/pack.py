"""Arrays as text in JSON: exact, in single precision, or in 16 bits with a scale, little-endian in base64."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: What stands for "no number" among 16-bit integers.
NOTHING = -32768


def _packed(array: NDArray[Any], kind: str, **more: Any) -> dict[str, Any]:
    return {"type": kind, "data": base64.b64encode(np.ascontiguousarray(array).tobytes()).decode(), **more}


def exact(values: NDArray[Any]) -> dict[str, Any]:
    """In double precision."""
    return _packed(np.asarray(values, dtype="<f8"), "f8")


def single(values: NDArray[Any]) -> dict[str, Any]:
    """In single precision: seven digits, for numbers that are read."""
    return _packed(np.asarray(values, dtype="<f4"), "f4")


def coarse(values: NDArray[Any] | list[float]) -> dict[str, Any]:
    """In 16 bits: to 1/131068 of the range of all, for pictures; nan stays."""
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    low, high = (values.min(where=finite, initial=np.inf), values.max(where=finite, initial=-np.inf))
    if not low <= high:
        low = high = 0.0
    scale, offset = (high - low) / 65534 or 1.0, (high + low) / 2
    numbers = np.where(finite, np.rint((np.where(finite, values, offset) - offset) / scale), NOTHING)
    return _packed(numbers.astype("<i2"), "i2", scale=float(scale), offset=float(offset))


def chosen_rows(columns: list[NDArray[Any]], count: int) -> NDArray[Any]:
    """At most about `count` rows of columns of one length, in order: evenly spaced ones, and in each of some equal
    parts those of the least and largest value of every column, so that no peak is lost; all if there are no more."""
    rows = len(columns[0])
    if rows <= count:
        return np.arange(rows)
    parts = max(count // 2 // max(2 * len(columns), 1), 1)
    size = rows // parts
    chosen = [np.linspace(0, rows - 1, count // 2).round().astype(int)]
    for column in columns:
        blocks = np.asarray(column)[: size * parts].reshape(parts, size)
        begins = size * np.arange(parts)
        chosen += [begins + blocks.argmin(axis=1), begins + blocks.argmax(axis=1)]
    return np.asarray(np.unique(np.concatenate(chosen)))
