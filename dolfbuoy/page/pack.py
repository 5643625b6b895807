"""Arrays as JSON text: exact, in single precision, or in scaled 16-bit integers, little-endian in base64."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: The 16-bit integer that represents nan.
NOTHING = -32768


def _packed(array: NDArray[Any], kind: str, **more: Any) -> dict[str, Any]:
    return {"type": kind, "data": base64.b64encode(np.ascontiguousarray(array).tobytes()).decode(), **more}


def exact(values: NDArray[Any]) -> dict[str, Any]:
    """Pack in double precision."""
    return _packed(np.asarray(values, dtype="<f8"), "f8")


def single(values: NDArray[Any]) -> dict[str, Any]:
    """Pack in single precision: seven digits, for numbers that are read."""
    return _packed(np.asarray(values, dtype="<f4"), "f4")


def coarse(values: NDArray[Any] | list[float]) -> dict[str, Any]:
    """Pack in 16 bits: to 1/131068 of the whole range, for pictures; keeps nan."""
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    low, high = (values.min(where=finite, initial=np.inf), values.max(where=finite, initial=-np.inf))
    if not low <= high:
        low = high = 0.0
    scale, offset = (high - low) / 65534 or 1.0, (high + low) / 2
    numbers = np.where(finite, np.rint((np.where(finite, values, offset) - offset) / scale), NOTHING)
    return _packed(numbers.astype("<i2"), "i2", scale=float(scale), offset=float(offset))


def chosen_rows(columns: list[NDArray[Any]], count: int) -> NDArray[Any]:
    """About `count` rows at most of columns of equal length, in order; all if there are no more.
    Evenly spaced rows, and those of the extremes of every column in equal intervals, so that no peak is lost."""
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
