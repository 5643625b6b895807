"""Compilation of forms: once per machine, each by one process, in parallel on all cores.

Independent of dolfinx; `compat` wraps its compiler in `one_at_a_time`.
"""

import fcntl
import functools
import importlib.util
import logging
import os
import re
import signal
import struct
import sysconfig
import time
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any

from ffcx.codegeneration import jit as ffcx_jit

#: Options for every compiled form.  Forms are compiled once per machine and kept in the cache of dolfinx.  Square roots
#: without errno and comparisons without traps halve the time of the hull's Jacobian; results remain IEEE.
COMPILER = ["-O3", "-g0", "-fno-math-errno", "-fno-trapping-math"]


@contextmanager
def quiet_compiler() -> Iterator[None]:
    """Suppress the reports of every compiler call by the root logger when an extension module is built."""
    level = logging.root.manager.disable
    logging.disable(logging.INFO)
    try:
        yield
    finally:
        logging.disable(level)


@contextmanager
def alone(folder: Path, name: str) -> Iterator[bool]:
    """Exclude other processes from compiling `name` into the cache `folder`; yields True, or False if the file system
    cannot lock.  Other names may be compiled at the same time.

    The lock, a byte of one file, is released with the process that holds it.  No collective calls are allowed inside:
    other ranks may need the lock too.
    """
    _call_helpers()
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder / "dolfbuoy.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        try:
            _lock(handle, name)
            locked = True
        except OSError as error:
            if isinstance(error, BlockingIOError):
                raise
            locked = False  # some network file systems
        yield locked
    finally:
        os.close(handle)


def _lock(handle: int, name: str) -> None:
    """Take the lock of a name; after a second report its holder.  Raises BlockingIOError in a helper."""
    place, until = zlib.crc32(name.encode()), time.monotonic() + SECONDS_OF_SILENCE
    while True:
        try:
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return
        except BlockingIOError:
            if _team.is_helper:
                raise
        other = _holder(handle, place)
        if other in _team.helpers or time.monotonic() > until:
            break
        time.sleep(0.02)
    if other and other not in _team.helpers:
        words = "Waiting for process %d, which %scompiles %s."
        logging.getLogger("dolfbuoy").warning(words, other, "is stopped and " * _is_stopped(other), name)
    fcntl.lockf(handle, fcntl.LOCK_EX, 1, place)


SECONDS_OF_SILENCE = 1.0
NOTICE = 25  #: log level of messages for interactive users only
_FLOCK = "hhqqi"  #: of <fcntl.h>: type, whence, start, length, process


def _holder(handle: int, place: int) -> int:
    """Number of the process that has locked a byte of a file; 0 if none on this machine."""
    asked = struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, place, 1, 0)
    kind, *_, process = struct.unpack(_FLOCK, fcntl.fcntl(handle, fcntl.F_GETLK, asked))
    return 0 if kind == fcntl.F_UNLCK else int(process)


def _is_stopped(process: int) -> bool:
    """True if a process has been stopped, as by Ctrl-Z."""
    with suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "T"
    return False


class _Team:
    """Helper processes that compile for this one, and their steps, which write to the cache."""

    def __init__(self) -> None:
        self.steps: Sequence[Callable[[], object]] = ()
        self.helpers: list[int] = []
        self.is_helper = False


_team = _Team()


@contextmanager
def helped(steps: Sequence[Callable[[], object]]) -> Iterator[None]:
    """Let other cores execute steps too, the last first, as soon as something is missing from the cache.

    steps: compile what the block needs, without MPI; forms being compiled by another process are skipped.
    """
    _team.steps, finished = steps, False
    try:
        yield
        finished = True
    finally:
        _team.steps = ()
        for process in _team.helpers:
            if not finished:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGINT)
            with suppress(ChildProcessError):  # the host program has waited for all its children
                os.waitpid(process, 0)
        _team.helpers.clear()


def _call_helpers() -> None:
    """Start one helper process for every other core, if there are steps."""
    steps, _team.steps = _team.steps, ()
    if steps:
        words = "Compiling what this combination of effects needs, once on this machine."
        logging.getLogger("dolfbuoy").log(NOTICE, words)
        _team.helpers += [_helper(steps) for _ in range(min(len(steps), len(os.sched_getaffinity(0))) - 1)]


def _helper(steps: Sequence[Callable[[], object]]) -> int:
    """Number of a new process that executes steps and ends."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # about threads of the host program, which are not copied
        process = os.fork()
    if process:
        return process
    try:
        _team.is_helper, parent = True, os.getppid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(silent, stream)
        for step in reversed(steps):
            with suppress(Exception):  # what cannot be compiled is reported by the parent
                step()
            if os.getppid() != parent:
                break
    finally:
        os._exit(0)


def one_at_a_time(local_jit: Callable[..., Any], name: str, cache: Callable[[], Path]) -> Callable[..., Any]:
    """dolfinx's local compiler, restricted to one process per form; compiled forms are loaded without waiting.

    name: that of its argument with the options.  cache: returns the folder of compiled forms.

    FFCx claims a form by creating its C file, and other processes finding that file wait for the result: in vain, if
    the first was killed.  Since here only this process compiles the form, a claim without a result is a leftover and
    is removed.
    """

    @functools.wraps(local_jit)
    def locked_jit(*arguments: Any, **options: Any) -> Any:
        try:
            with _looking_at_once():
                return local_jit(*arguments, **options)
        except _NotCompiledError as missing:
            module = str(missing)
        with alone(cache(), module) as locked:
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


class _NotCompiledError(Exception):
    """Raised with the name of a module if a form is not in the cache."""


@contextmanager
def _looking_at_once() -> Iterator[None]:
    """Let FFCx look up a compiled form directly, instead of listing a cache that may hold thousands of files."""
    look = ffcx_jit.get_cached_module
    ffcx_jit.get_cached_module = _cached_module
    try:
        yield
    finally:
        ffcx_jit.get_cached_module = look


def _cached_module(
    module_name: str, object_names: list[str], cache_dir: str | Path, timeout: float
) -> tuple[list[Any], ModuleType]:
    """Replacement of FFCx's `get_cached_module`.  Raises _NotCompiledError."""
    cache = Path(cache_dir)
    if not (cache / f"{module_name}.c.cached").exists():
        raise _NotCompiledError(module_name)
    module = load(module_name, cache)
    return [getattr(module.lib, name) for name in object_names], module


@functools.cache
def load(name: str, folder: Path) -> ModuleType:
    """The extension module with this name in a folder."""
    spec: Any = importlib.util.spec_from_file_location(name, folder / (name + sysconfig.get_config_var("EXT_SUFFIX")))
    module: ModuleType = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
