"""Output and errors of several MPI ranks: only the first prints, one message per error, no rank is left waiting."""

import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

from ..errors import InputError

_TAG = 4711  # tag of "I have ended", distinct from all other messages between ranks


def only_first_speaks() -> None:
    """Silence Python output on all ranks but 0 from now on; `end` still prints."""
    if rank() != 0:
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115  # until the process ends


def several() -> bool:
    """True if this process is one of several ranks."""
    comm = _world()
    return comm is not None and comm.size > 1


def rank() -> int:
    """Rank of this process; 0 if mpi4py is not installed."""
    comm = _world()
    return 0 if comm is None else comm.rank


def _world() -> Any:
    """Communicator of all ranks; None without mpi4py."""
    try:
        from ..elsewhere import MPI
    except ImportError:
        return None
    return MPI.COMM_WORLD


def allreduce(comm: Any, value: Any, op: Any) -> Any:
    """allreduce, skipped on a single rank, because the call takes as long as the kernels of a short cable."""
    return value if comm.size == 1 else comm.allreduce(value, op=op)


def bcast(comm: Any, value: Any, root: int = 0) -> Any:
    """bcast, skipped on a single rank."""
    return value if comm.size == 1 else comm.bcast(value, root=root)


def end(say: Callable[[], None], code: int) -> None:
    """Leave the program with an error; does not return.

    say: prints the message to standard error; called on one rank.  Every failing rank calls this.  If all ranks do
    within a second or so, each exits with the code; otherwise the others may be waiting in a collective call for this
    one, and the lowest rank that failed aborts them.
    """
    try:
        comm = _world()
    except InputError:  # MPI cannot start, which is the error to report
        comm = None
    if comm is None:
        say()
        sys.exit(code)
    if comm.size > 1:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)  # only the abort itself can still come
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
    """True if all ranks have ended before a timeout of this one, which is shortest on the lowest rank."""
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
