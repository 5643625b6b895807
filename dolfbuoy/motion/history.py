"""The history of all evolving quantities: a series of values for the unknowns and for every derivative but the last.

The series of a level hold the entries of all models together, so that a step takes as few operations for many lines
and bodies as for one.
"""

import itertools
from typing import Any

import numpy as np

from ..solver.c_code import address, core
from ..solver.unknowns import array_of
from ..solver.vector_ops import Work, copies, together
from .schemes import HISTORY, KEPT, Series, Sum, same_step


class Past:
    """Series of the evolutions of a rank: of their entries, of the first derivatives of those of second order, ...

    evolutions: those of higher order first.  u: the local unknowns, an array at a fixed address.
    The rate of each series is the value of the next one.  Derivatives are rates computed by the scheme, hence lagged.
    """

    def __init__(self, evolutions, u, scheme):
        self.evolutions, self.u, self.scheme, self.series = evolutions, u, scheme, []
        ends = np.cumsum([0, *(evolution.size for evolution in evolutions)])
        #: Place of the entries of each evolution.
        self.places = [slice(a, b) for a, b in itertools.pairwise(ends)]
        self.order = max((evolution.order for evolution in evolutions), default=0)
        if any(one.order < two.order for one, two in itertools.pairwise(evolutions)):
            raise ValueError("evolutions of higher order come first")
        self.lagged = self._of_all(lambda e: np.broadcast_to(e.lagged, e.size), bool)
        self.sizes = [self._of_all(lambda e, k=k: e.sizes[k], order=k + 1) for k in range(self.order)]
        for evolution in evolutions:
            for level in range(evolution.order):
                evolution.hand_out(level, 0.0, 0.0)

    def _of_all(self, get, kind=float, order=1):
        """get(evolution) for evolutions of at least this order, concatenated."""
        return np.concatenate([np.zeros(0, kind), *(get(e) for e in self.evolutions if e.order >= order)])

    def entries(self, u):
        """Values of the entries for unknowns u."""
        return self._of_all(lambda evolution: evolution.values(u))

    def begin(self, rates=()):
        """Restart from the present unknowns; rates: their derivatives from the first one on, 0 if not given."""
        known = [self.entries(self.u), *rates]
        known += [np.zeros_like(known[0])] * (self.order + 1 - len(known))
        self.set_series([(known[k][: len(sizes)], known[k + 1][: len(sizes)]) for k, sizes in enumerate(self.sizes)])

    def set_series(self, pairs):
        """Create series starting from these (value, rate), level by level."""
        self.series = []
        for value, rate in pairs:
            new = self.series[-1].new_rate[: len(value)] if self.series else None
            self.series.append(Series(value, rate, True if self.series else self.lagged, new))
        self._operations = None

    def use(self, scheme):
        """Continue with another scheme."""
        self.scheme, self._operations = scheme, None

    @property
    def operations(self):
        """`Operations` of a step with the present scheme and series."""
        if self._operations is None:
            self._operations = Operations(self)
        return self._operations

    def prepare(self, step):
        """Prepare the operations of a step; returns gamma of the first derivative."""
        if not self.series:
            self._kept = None, None
            return 1 / step
        last = self.series[0].step
        if last is None or not same_step(last, step):
            self._kept = last, [series.state() | {"rows": np.array(series.rows[:KEPT])} for series in self.series]
            for series, base in zip(self.series, [None, *self.series], strict=False):
                self.scheme.begin(step, series, base)
        else:
            self._kept = last, None
        if step != last:
            for series in self.series:
                series.step = step
        return self.operations.choose(step)

    def count_step(self):
        """Count a step taken."""
        for series in self.series:
            series.count_step(self.scheme.keep)

    def give_up(self):
        """Undo `prepare`."""
        last, kept = self._kept
        for series in self.series:
            series.step = last
        if kept is not None:
            self.restore(kept)

    def largest_difference(self, order):
        """Largest difference from the extrapolated past, relative to the entries' sizes; None if the past is short."""
        largest = 0.0
        for series, sizes in zip(self.series, self.sizes, strict=True):
            predicted = series.extrapolated(order)
            if predicted is None:
                return None
            largest = max(largest, (np.abs(series.new - predicted) / sizes).max(initial=0.0))
        return largest

    def forget(self):
        """Restart from the present values and rates."""
        for series in self.series:
            series.forget()
        for series, rate in zip(self.series, self.series[1:], strict=False):
            series.second[: len(rate.rate)] = rate.rate

    def reading(self):
        """Functions that copy the entries from the present unknowns to the new value of the first series.

        The first copies those that are unknowns, the others one by one those that are `computed`.
        """
        if not self.series:
            return ()
        pairs, functions = [], []
        for evolution, place in zip(self.evolutions, self.places, strict=True):
            found = evolution.reader(self.u, self.series[0].new[place])
            (functions if callable(found) else pairs).append(found)
        return copies(pairs), *functions

    @property
    def computed(self):
        """Places of entries that are functions of the unknowns."""
        pairs = zip(self.evolutions, self.places, strict=True)
        return [place for e, place in pairs if callable(e.reader(self.u, np.zeros(e.size)))]

    def rules_of_forms(self, gammas):
        """[(array of a Constant or Function of the forms, its source: gamma or history), ...]."""
        pairs = []
        for evolution, place in zip(self.evolutions, self.places, strict=True):
            for k, (gamma, history) in enumerate(evolution.rates):
                pairs += [(array_of(gamma), gammas[k : k + 1]), (array_of(history), self.series[k].history[place])]
        return pairs

    def rate_of(self, part):
        """Present first derivative of the unknowns of a Part."""
        return self.series[0].rate[self.place_of(part)]

    def place_of(self, part):
        """Place of the unknowns of a Part, or of those of `LineGroups`, among the entries."""
        parts = getattr(part, "parts", [part])
        found = [p for e, p in zip(self.evolutions, self.places, strict=True) if any(e.part is one for one in parts)]
        return slice(found[0].start, found[-1].stop)

    def state(self):
        """State for an interruptible run: level -> state of the series; nothing is copied."""
        return {str(k): series.state() for k, series in enumerate(self.series)}

    def restore(self, state):
        """Restore that state."""
        kept = state if isinstance(state, list) else [state[str(k)] for k in sorted(map(int, state))]
        if not self.series:
            self.set_series([(np.zeros(len(sizes)),) * 2 for sizes in self.sizes])
        for series, of_level in zip(self.series, kept, strict=True):
            series.restore(of_level)


class Operations:
    """Operations of a step on the series of a Past and on the data of the forms, in C.

    Lists of functions: `begin`, before the solve, passes the rules to the forms; `find_rates`, after it, computes new
    values and rates; `accept`, once the step is accepted, shifts the new values to the past (the unknowns may have been
    modified in between).
    """

    REMEMBERED = 100  #: number of cached formulas; equal steps differ by rounding

    def __init__(self, past: Past):
        self.scheme, self.series, self.step = past.scheme, past.series, None
        #: Step -> gamma, the scheme's formula for C, and the arrays it points to.
        self._known: dict[float, tuple[float, Any, Any]] = {}
        self.gammas = np.zeros(max(1, len(past.series)))
        described = core().ffi.new("series[]", max(1, len(past.series)))
        for one, series in zip(described, past.series, strict=False):
            one.n, one.rows = len(series.new), [address(row) for row in series.rows]
        numbers = {"levels": len(past.series), "keep": past.scheme.keep, "gammas": address(self.gammas)}
        self._past, self._alive = core().ffi.new("past *", {**numbers, "series": described}), described
        read = past.reading()
        histories, rates, advance = (
            Work(name, self._past, self) for name in ("make_histories", "find_rates", "advance")
        )
        handed = [function for evolution in past.evolutions for function in evolution.handed(past.u)]
        self.begin = [histories, together(copies(past.rules_of_forms(self.gammas)), *handed)]
        self.find_rates = [*read, rates]
        self.accept = [*read, advance]

    def choose(self, step: float) -> float:
        """Select the formula of a step; returns gamma of the first derivative."""
        if step not in self._known:
            if len(self._known) == self.REMEMBERED:
                self._known.clear()
            gamma, history = self.scheme.formula(step)
            updates = self.scheme.updates(step)
            alive = [_rule(HISTORY, history), *(_rule(row, total) for row, total in updates)]
            rules = [rule for rule, _ in alive]
            update = core().ffi.new("rule[]", rules[1:])
            fields = {"gamma": gamma, "history": rules[0], "updates": len(updates), "update": update}
            self._known[step] = gamma, core().ffi.new("formula *", fields), (alive, update)
        self.step, (gamma, self._past.formula, _) = step, self._known[step]
        return gamma


def _rule(row: int, total: Sum) -> tuple[dict[str, Any], tuple]:
    """Fields of the C rule that writes a Sum to a row, and the arrays they point to."""
    weights, rows = zip(*total.terms, strict=True)
    arrays = core().ffi.new("int[]", rows), core().ffi.new("double[]", weights)
    return {"into": row, "terms": len(rows), "rows": arrays[0], "weights": arrays[1], "over": total.over}, arrays
