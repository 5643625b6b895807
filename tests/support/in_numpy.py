"""Array operations of a time step in NumPy, the reference for core/step.c, and time schemes on single series."""

from collections.abc import Callable
from functools import partial
from math import prod

import numpy as np

from dolfbuoy.motion.history import Operations
from dolfbuoy.motion.schemes import HISTORY, Scheme, Series


def value(terms: list[tuple[float, np.ndarray]], over: float = 1.0) -> np.ndarray:
    """Sum of weight x row over a divisor; terms: [(weight, row), ...]."""
    (weight, row), *more = terms
    total = weight * row
    for weight, row in more:
        total = total + weight * row
    return total / over


def extrapolation(times: np.ndarray, rows: list[np.ndarray], t: np.ndarray, out: np.ndarray) -> Callable:
    """As `rows.extrapolation`."""

    def do() -> None:
        weights = [prod((t.item() - tj) / (ti - tj) for tj in times.tolist() if tj != ti) for ti in times.tolist()]
        out[:] = value(list(zip(weights, rows, strict=True)))

    return do


def work(name: str, context: object, operations: Operations) -> Callable:
    """As `rows.Work` of a function of `motion.past.Operations`."""
    return partial({"make_histories": make_histories, "find_rates": find_rates, "advance": advance}[name], operations)


def make_histories(operations: Operations) -> None:
    """Apply a rule to each derivative's gamma and history."""
    below = None
    for k, series in enumerate(operations.series):
        gamma, history = rule(operations.scheme, operations.step, series)
        series.rows[HISTORY][:] = history if k == 0 else gamma * below.history[: len(history)] + history
        operations.gammas[k], below = gamma ** (k + 1), series


def find_rates(operations: Operations) -> None:
    """From the new values of the first series."""
    new = operations.series[0].new if operations.series else None
    for gamma, series in zip(operations.gammas, operations.series, strict=False):
        series.new_rate = gamma * new[: len(series.new)] + series.history


def advance(operations: Operations) -> None:
    """Make the new values the past."""
    for series in operations.series:
        _update(operations.scheme, operations.step, series)
    for series in operations.series:
        _pass(series, operations.scheme.keep)


def _of(series, total):
    return value([(weight, series.rows[row]) for weight, row in total.terms], total.over)


def _update(scheme, step, series):
    for row, total in scheme.updates(step):
        series.rows[row][:] = _of(series, total)


def _pass(series, keep):
    series.previous_rate, series.rate = series.rate, series.new_rate
    for k in reversed(range(1, keep)):
        series.rows[k][:] = series.rows[k - 1]
    series.rows[0][:] = series.new


def rule(scheme: Scheme, step: float, series: Series) -> tuple[float, np.ndarray]:
    """(gamma, history) of the rate of a Series for the coming step."""
    gamma, history = scheme.formula(step)
    return gamma, _of(series, history)


def accept(scheme: Scheme, series: Series, new: np.ndarray, rate: np.ndarray) -> None:
    """Accept a step of a Series."""
    series.new, series.new_rate = new, rate
    _update(scheme, series.step, series)
    _pass(series, scheme.keep)
    series.count_step(scheme.keep)
