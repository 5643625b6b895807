"""The time that a run will take, known after its first steps, for who waits for many of them.

`Simulation.run` says how far it is; of most runs nobody wants to know.
"""

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Seconds, and part of a run, of which one is enough to know its pace.
ENOUGH, PART = 0.5, 0.1


class Watch:
    """Waits for a run to show its pace; told(seconds) is called then, with how long it takes, and what came before it.

    runs: how many like it are to follow each other.
    """

    def __init__(self, told: Callable[[float], None]):
        self._told, self._begin = told, clock.monotonic()
        self._first: tuple[int, float] | None = None
        self.runs = 1

    def reached(self, step: int, steps: int) -> None:
        """After `step` of so many; the first is no measure, it may compile."""
        global watch
        now = clock.monotonic()
        if self._first is None:
            self._first = step, now
            return
        done, since = step - self._first[0], now - self._first[1]
        if since >= ENOUGH or done >= PART * steps:
            watch = None
            self._told(self.runs * (self._first[1] - self._begin + since / done * (steps - self._first[0])))


#: Who wants to know, if anybody.
watch: Watch | None = None


@contextmanager
def watched(told: Callable[[float], None]) -> Iterator[None]:
    """Inside, the first run of several steps tells how many seconds it takes, with what comes before it."""
    global watch
    watch = Watch(told)
    try:
        yield
    finally:
        watch = None
