"""Size of the next step, whatever is being integrated."""

import math

from ..errors import SolveError


class StepControl:
    """Steps of a nominal size: halved when one fails, doubled back to the nominal size after successes.

    The base of the others.  accepted, rejected, failed: counts for the record.
    """

    def __init__(self, nominal, smallest=None):
        self.nominal = self.step = self.largest = nominal
        self.smallest = smallest if smallest is not None else nominal * 2.0**-12
        self.accepted = self.rejected = self.failed = self.restarts = 0
        self.restart = False  # whether the past is of no use to the next step

    def propose(self, remaining):
        """Size of the next step on the way to a milestone that is `remaining` away: never past it, and never so that
        a sliver of a step is left before it."""
        count = math.ceil(remaining / self.step - 1e-6)
        return remaining if count <= 1 else self._share(remaining, count)

    def _share(self, remaining, count):
        """Two steps are halves: after failures doubled steps leave 2^-n of a step, which the next full one upsets."""
        return remaining / 2 if count == 2 else self.step

    def judge(self, step, error):
        """True if a step that was solved counts; `error` is its local error over the tolerance, or None."""
        self.accepted += 1
        self.step = min(max(self.step, 2 * step), self.nominal)
        return True

    def fail(self, step, reason):
        """A step could not be solved.  Raises SolveError when it cannot be made smaller."""
        self.failed += 1
        if step / 2 < self.smallest:
            raise SolveError(f"{reason} (smallest step {self.smallest:.3g} s)")
        self.step = step / 2


class JumpControl(StepControl):
    """Steps of a nominal size, made smaller where a quantity jumps.

    No step may change it by more than `most` of the largest size that it ever had, down to a fraction of the nominal
    step.  Where the step changes, the past begins anew: across a jump it is of no use.
    """

    most, parts = 0.2, 64

    def __init__(self, nominal):
        super().__init__(nominal)
        self.size = 0.0

    def judge(self, step, error):
        """error: (largest change, largest size) of the quantity in this step."""
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

    A step is kept as long as the best one differs little, because every change costs the multistep schemes accuracy.
    After a kink (a ramp that ends, a cable that comes taut) the error shown by the past does not fall with the step:
    `restart` then asks for a past that begins anew.
    """

    safety, growth, shrink = 0.85, 2.0, 0.2

    def __init__(self, first, order, smallest, largest):
        super().__init__(first, smallest)
        self.largest, self.exponent = largest, 1 / (order + 1)
        self.hold, self.since_change = order + 2, 0  # steps between changes: the past must have one step
        self.in_a_row = self.unjudged = 0  # rejections since the last step that counted; steps taken on trust

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
            if self.in_a_row == 3:  # a fresh past, and a few small steps on trust until it is long enough to judge by
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
