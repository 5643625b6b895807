"""The past of an evolution: a series of values for the unknowns and for every derivative but the last."""

import numpy as np

from .schemes import Series


class Past:
    """Series of an `Evolution`: of the unknowns, of their first derivative if the order is two, ...

    The rate of each series is the value of the next one.  Derivatives are rates that the scheme makes: they lag.
    """

    def __init__(self, evolution):
        self.evolution, self.series, self._rules = evolution, [], []

    def begin(self, values, rates):
        """As at a start: the unknowns, and their derivatives from the first one on."""
        known, lagged = [values, *rates], self.evolution.lagged
        self.series = [Series(known[k], known[k + 1], lagged if k == 0 else True) for k in range(self.evolution.order)]

    def prepare(self, scheme, step):
        """Hand the rules of a step to the forms; returns gamma of the first derivative."""
        self._rules, first = [], 0.0
        for k, series in enumerate(self.series):
            scheme.begin(step, series, base=self.series[k - 1] if k else None)
        for k, series in enumerate(self.series):
            gamma, history = scheme.rule(step, series)
            if k:  # the rule applied to a rate that is itself gamma x unknown + history
                gamma, history = first ** (k + 1), first * self._rules[-1][1] + history
            else:
                first = gamma
            self._rules.append((gamma, history))
            self.evolution.hand_out(k, gamma, history)
        return first

    def rates(self, u):
        """Derivatives at the end of a step that was solved, from the first one on."""
        values = self.evolution.values(u)
        return [gamma * values + history for gamma, history in self._rules]

    def accept(self, scheme, u, rates):
        """The step was taken."""
        known = [self.evolution.values(u), *rates]
        for k, series in enumerate(self.series):
            scheme.accept(series, known[k], known[k + 1])

    def largest_difference(self, u, rates, order):
        """Largest difference to the extrapolated past, relative to the evolution's sizes; None without enough past."""
        known, largest = [self.evolution.values(u), *rates], 0.0
        for k, series in enumerate(self.series):
            predicted = series.extrapolated(order)
            if predicted is None:
                return None
            largest = max(largest, (np.abs(known[k] - predicted) / self.evolution.sizes[k]).max(initial=0.0))
        return largest

    def forget(self):
        """Begin anew from the present values and rates."""
        for series in self.series:
            series.forget()
        for series, rate in zip(self.series, self.series[1:], strict=False):
            series.second = rate.rate

    # -- what a step that is given up, and an interruption, bring back -------------------------------------------------

    def kept(self):
        """Of a step that may be given up."""
        return [series.state() for series in self.series]

    def give_up(self, kept):
        """Back to what was kept."""
        for series, state in zip(self.series, kept, strict=True):
            series.restore(state)

    def state(self):
        """Of a run that may be interrupted: level -> all of the series."""
        return {str(k): vars(series) for k, series in enumerate(self.series)}

    def restore(self, state):
        """Be as in that state."""
        kept = state if isinstance(state, list) else [state[str(k)] for k in sorted(map(int, state))]
        self.series = []
        for values in kept:
            self.series.append(Series(values["rate"], values["rate"]))
            vars(self.series[-1]).update(values)
