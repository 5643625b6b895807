"""Ctrl-C and SIGTERM, noted as well as raised.

KeyboardInterrupt comes at any instruction.  In a finaliser, or in a callback of a library, it is lost or turned into
another error; then the note tells.
"""

import signal

_received = False


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


def _interrupt(signum, frame):
    global _received
    _received = True
    raise KeyboardInterrupt


def received() -> bool:
    """Whether one came since `listen`."""
    return _received


def check() -> None:
    """Raise KeyboardInterrupt if a signal came, perhaps once more."""
    if _received:
        raise KeyboardInterrupt
