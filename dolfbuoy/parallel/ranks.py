"""One output of several MPI ranks: by the first, one message for an error, no rank left waiting."""

import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

from ..errors import InputError

_TAG = 4711  # of "I have ended", apart from whatever else is under way between the ranks


def only_first_speaks() -> None:
    """Silence what Python prints on any rank but 0 from now on; `end` still prints."""
    if rank() != 0:
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115  # until the process ends


def several() -> bool:
    """True if this process is one of several ranks."""
    comm = _world()
    return comm is not None and comm.size > 1


def rank() -> int:
    """Rank of this process; 0 where mpi4py is not installed."""
    comm = _world()
    return 0 if comm is None else comm.rank


def _world() -> Any:
    """All ranks; None without mpi4py, with which goes whatever needs several."""
    try:
        from ..elsewhere import MPI
    except ImportError:
        return None
    return MPI.COMM_WORLD


def allreduce(comm: Any, value: Any, op: Any) -> Any:
    """allreduce; one rank alone keeps its value, since the call alone takes as long as the kernels of a short cable."""
    return value if comm.size == 1 else comm.allreduce(value, op=op)


def bcast(comm: Any, value: Any, root: int = 0) -> Any:
    """bcast; one rank alone keeps its value."""
    return value if comm.size == 1 else comm.bcast(value, root=root)


def end(say: Callable[[], None], code: int) -> None:
    """Leave the program with an error; does not return.

    say: prints the message to standard error; called on one rank.  Every rank that fails comes here.  When all ranks
    do within a second or so, each exits with the code; otherwise the others may be waiting for this one in a
    collective call that will never come, and the lowest rank that failed aborts them.
    """
    try:
        comm = _world()
    except InputError:  # MPI cannot start, which is the error to be shown
        comm = None
    if comm is None:
        say()
        sys.exit(code)
    if comm.size > 1:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)  # what can still come is the end itself
    together = _all_ended(comm)
    if comm.rank == 0 or not together:
        if comm.rank != 0:
            sys.stderr = sys.__stderr__
        say()
        sys.stderr.flush()
    if not together:
        comm.Abort(code)
    sys.exit(code)


def _all_ended(comm: Any) -> bool:
    """True if all ranks have come to their end before this one loses patience; the lowest loses it first."""
    others = [rank for rank in range(comm.size) if rank != comm.rank]
    requests = [comm.isend(None, rank, _TAG) for rank in others]
    deadline = time.monotonic() + 1.0 + min(0.5 * comm.rank, 10.0)
    missing = set(others)
    while missing and time.monotonic() < deadline:
        missing -= {rank for rank in missing if comm.iprobe(rank, _TAG) and comm.recv(source=rank, tag=_TAG) is None}
        time.sleep(0.01)
    if not missing:
        for request in requests:
            request.wait()
    return not missing
