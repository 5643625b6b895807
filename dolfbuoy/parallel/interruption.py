"""Ctrl-C and SIGTERM, recorded as well as raised.

KeyboardInterrupt may occur at any instruction.  In a finaliser, or in a callback of a library, it is lost or turned
into another error; the record remains.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

_received = _held = False


class TimeUp(KeyboardInterrupt):
    """Interruption because a time limit is reached."""


def listen() -> None:
    """Make both signals raise KeyboardInterrupt and be recorded from now on."""
    global _received
    _received = False
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)


def ignore() -> None:
    """Ignore both signals from now on."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def _interrupt(signum: int, frame: object) -> None:
    global _received
    first, _received = not _received, True
    if not (_held and first):
        raise KeyboardInterrupt


@contextmanager
def held() -> Iterator[None]:
    """Inside the block, only record the first signal, so that the current operation can be completed."""
    global _held
    _held = True
    try:
        yield
    finally:
        _held = False


def received() -> bool:
    """True if a signal has come since `listen`."""
    return _received


def check() -> None:
    """Raise KeyboardInterrupt, possibly again, if a signal has come."""
    if _received:
        raise KeyboardInterrupt
