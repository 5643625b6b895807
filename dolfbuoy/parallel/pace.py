"""Estimated duration of a run after its first steps, used when many runs are to follow.

`Simulation.run` reports its progress; for most runs there is no Watch.
"""

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Seconds, or fraction of a run, sufficient to estimate its pace.
ENOUGH, PART = 0.5, 0.1


class Watch:
    """Timer of a run; told(seconds) is called once with its estimated duration, including the time before it.

    runs: number of similar runs in sequence.
    """

    def __init__(self, told: Callable[[float], None]):
        self._told, self._begin = told, clock.monotonic()
        self._first: tuple[int, float] | None = None
        self.runs = 1

    def reached(self, step: int, steps: int) -> None:
        """Report that `step` of `steps` is done; the first one is not timed, because it may include compilation."""
        global watch
        now = clock.monotonic()
        if self._first is None:
            self._first = step, now
            return
        done, since = step - self._first[0], now - self._first[1]
        if since >= ENOUGH or done >= PART * steps:
            watch = None
            self._told(self.runs * (self._first[1] - self._begin + since / done * (steps - self._first[0])))


#: The active Watch, if any.
watch: Watch | None = None


@contextmanager
def watched(told: Callable[[float], None]) -> Iterator[None]:
    """Inside the block, the first run of several steps calls told(seconds) with its duration and what precedes it."""
    global watch
    watch = Watch(told)
    try:
        yield
    finally:
        watch = None
