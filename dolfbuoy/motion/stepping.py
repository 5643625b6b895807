"""Control of the step size, independent of the equations."""

import math

from ..errors import SolveError


class StepControl:
    """Steps of a nominal size: halved when one fails, doubled back to the nominal size after successes.

    Base class.  accepted, rejected, failed: counts for the record.
    """

    def __init__(self, nominal, smallest=None):
        self.nominal = self.step = self.largest = nominal
        self.smallest = smallest if smallest is not None else nominal * 2.0**-12
        self.accepted = self.rejected = self.failed = self.restarts = 0
        self.restart = False  # discard the past before the next step

    def propose(self, remaining):
        """Size of the next step towards a target time that is `remaining` away: never beyond it, and never leaving a
        sliver of a step before it."""
        count = math.ceil(remaining / self.step - 1e-6)
        return remaining if count <= 1 else self._share(remaining, count)

    def _share(self, remaining, count):
        """Share the last two steps equally: after failures 2^-n of a step would be left, to upset the next full one."""
        return remaining / 2 if count == 2 else self.step

    def judge(self, step, error):
        """True if a solved step is accepted; `error` is its local error over the tolerance, or None."""
        self.accepted += 1
        self.step = min(max(self.step, 2 * step), self.nominal)
        return True

    def fail(self, step, reason):
        """Reduce the step after a failed solve.  Raises SolveError if it cannot be reduced further."""
        self.failed += 1
        if step / 2 < self.smallest:
            raise SolveError(f"{reason} (smallest step {self.smallest:.3g} s)")
        self.step = step / 2


class JumpControl(StepControl):
    """Steps of a nominal size, reduced where a quantity jumps.

    No step may change the quantity by more than a fraction `most` of its largest size so far, down to 1/`parts` of the
    nominal step.  When the step is reduced the past is discarded: it is useless across a jump.
    """

    most, parts = 0.2, 64

    def __init__(self, nominal):
        super().__init__(nominal)
        self.size = 0.0

    def judge(self, step, error):
        """Accept or reject; error: (largest change, largest size) of the quantity in this step."""
        change, size = error
        allowed = self.most * max(self.size, size)
        if change > allowed and step / 2 >= self.nominal / self.parts:
            self.rejected += 1
            self.step, self.restart = step / 2, True
            return False
        self.size = max(self.size, size)
        if 2 * change <= allowed:
            super().judge(step, None)
        else:
            self.accepted += 1
        self.restart = abs(self.step - step) > 1e-9 * step
        return True


class AdaptiveControl(StepControl):
    """Local error control: the error of a step of order p behaves like step^(p+1).

    A step is kept as long as the optimal one differs little, because every change costs multistep schemes accuracy.
    After a kink (end of a ramp, a cable becoming taut) the error estimated from the past does not fall with the step:
    `restart` then asks for a new past.
    """

    safety, growth, shrink = 0.85, 2.0, 0.2

    def __init__(self, first, order, smallest, largest):
        super().__init__(first, smallest)
        self.largest, self.exponent = largest, 1 / (order + 1)
        self.hold, self.since_change = order + 2, 0  # steps between changes: the past needs equal steps
        self.in_a_row = self.unjudged = 0  # rejections since the last accepted step; steps accepted unjudged

    def _share(self, remaining, count):
        return remaining / count if count < 4 else self.step  # the last few steps before a milestone are equal

    def judge(self, step, error):
        if error is None or self.unjudged > 0:
            self.accepted += 1
            self.unjudged = max(self.unjudged - 1, 0)
            self.in_a_row = 0
            return True
        factor = self.safety * max(error, 1e-10) ** -self.exponent
        if error > 1:
            self.rejected += 1
            self.in_a_row += 1
            if self.in_a_row == 1:
                self.first_rejected = step
            if self.in_a_row == 3:  # a new past, and a few small steps accepted unjudged until it is long enough
                self.restart, self.restarts, self.unjudged = True, self.restarts + 1, self.hold
                self.step = max(0.1 * self.first_rejected, self.smallest)
                return False
            if step <= self.smallest * (1 + 1e-9):
                raise SolveError(
                    f"the error of the smallest step, {self.smallest:.3g} s, is {error:.3g} times the tolerance"
                )
            self.step = max(step * min(max(factor, self.shrink), 0.9), self.smallest)
            return False
        self.accepted += 1
        self.in_a_row = 0
        self.since_change += 1
        if factor < 0.95 or (factor > 1.2 and self.since_change >= self.hold):
            self.since_change = 0
            self.step = min(max(step * min(factor, self.growth), self.smallest), self.largest)
        return True
