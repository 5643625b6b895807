"""How forms are compiled: once per machine, by one process at a time, without a word.

Knows no dolfinx; `compat` puts `one_at_a_time` around its compiler.
"""

import fcntl
import functools
import logging
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

#: Options of every compiled form.  Forms are compiled once per machine and kept in the cache of dolfinx.  Square roots
#: that need not set errno and comparisons that need not trap halve the time of the hull's Jacobian; results stay IEEE.
COMPILER = ["-O3", "-g0", "-fno-math-errno", "-fno-trapping-math"]


@contextmanager
def quiet_compiler() -> Iterator[None]:
    """Building an extension module reports every compiler call through the root logger."""
    level = logging.root.manager.disable
    logging.disable(logging.INFO)
    try:
        yield
    finally:
        logging.disable(level)


@contextmanager
def alone(folder: Path) -> Iterator[bool]:
    """No other process compiles into the cache `folder` meanwhile (yields True), if its file system can promise that.

    The lock ends with the process that holds it.  Nothing collective may happen inside: other ranks may want it too.
    """
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            locked = True
        except OSError:  # some network file systems
            locked = False
        yield locked
    finally:
        os.close(handle)


def one_at_a_time(local_jit: Callable, name: str, cache: Callable[[], Path]) -> Callable:
    """dolfinx's compiler of one process, for one process at a time.

    name: of its argument with the options.  cache: says in which folder it keeps what it has compiled.

    FFCx claims a form by creating its C file, and who finds that file waits for the result: in vain, if the process
    was killed meanwhile.  While this process alone compiles, a claim without a result is a leftover; it is removed.
    """

    @functools.wraps(local_jit)
    def locked_jit(*arguments, **options):
        with alone(cache()) as locked:
            options[name] = {**(options.get(name) or {}), "timeout": 2 if locked else 600}
            try:
                return local_jit(*arguments, **options)
            except TimeoutError as error:
                claim = re.search(r"remove (.+\.c)\)", str(error))
                if not locked or not claim:
                    raise
                Path(claim[1]).unlink(missing_ok=True)
                return local_jit(*arguments, **options)

    return locked_jit
