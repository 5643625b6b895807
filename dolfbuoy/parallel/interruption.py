"""Ctrl-C and SIGTERM, noted as well as raised.

KeyboardInterrupt comes at any instruction.  In a finaliser, or in a callback of a library, it is lost or turned into
another error; the note remains.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

_received = _held = False


class TimeUp(KeyboardInterrupt):
    """An interruption that was announced: a time limit is reached."""


def listen() -> None:
    """From now on both signals raise KeyboardInterrupt and are noted."""
    global _received
    _received = False
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)


def ignore() -> None:
    """From now on both signals do nothing."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def _interrupt(signum: int, frame: object) -> None:
    global _received
    first, _received = not _received, True
    if not (_held and first):
        raise KeyboardInterrupt


@contextmanager
def held() -> Iterator[None]:
    """Inside, the first of them is only noted, so that what is being done can be brought to a good end."""
    global _held
    _held = True
    try:
        yield
    finally:
        _held = False


def received() -> bool:
    """True if one came since `listen`."""
    return _received


def check() -> None:
    """Raise KeyboardInterrupt if a signal came, perhaps once more."""
    if _received:
        raise KeyboardInterrupt
