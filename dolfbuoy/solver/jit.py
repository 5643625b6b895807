"""Compilation of forms: once per machine, each by one process, without output.

Knows no dolfinx; `compat` puts `one_at_a_time` around its compiler.
"""

import fcntl
import functools
import importlib.util
import logging
import os
import re
import sysconfig
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from ffcx.codegeneration import jit as ffcx_jit

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
def alone(folder: Path, name: str = "") -> Iterator[bool]:
    """No other process compiles `name` into the cache `folder` meanwhile (yields True), if its file system can promise
    that; other names are compiled at the same time.

    The lock, a byte of one file, ends with the process that holds it.  Nothing collective may happen inside: other
    ranks may want it too.
    """
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder / "dolfbuoy.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        try:
            fcntl.lockf(handle, fcntl.LOCK_EX, 1, zlib.crc32(name.encode()))
            locked = True
        except OSError:  # some network file systems
            locked = False
        yield locked
    finally:
        os.close(handle)


def one_at_a_time(local_jit: Callable[..., Any], name: str, cache: Callable[[], Path]) -> Callable[..., Any]:
    """dolfinx's compiler of one process, each form by one process only; what is compiled already waits for none.

    name: of its argument with the options.  cache: returns the folder of what it has compiled.

    FFCx claims a form by creating its C file, and who finds that file waits for the result: in vain, if the process
    was killed meanwhile.  While this process alone compiles the form, a claim without a result is a leftover; it is
    removed.
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
    """A form, the name of its module, is not in the cache."""


@contextmanager
def _looking_at_once() -> Iterator[None]:
    """FFCx looks for what it has compiled at one place, instead of listing a cache that may hold thousands of files."""
    look = ffcx_jit.get_cached_module
    ffcx_jit.get_cached_module = _cached_module
    try:
        yield
    finally:
        ffcx_jit.get_cached_module = look


def _cached_module(
    module_name: str, object_names: list[str], cache_dir: str | Path, timeout: float
) -> tuple[list[Any], ModuleType]:
    """As FFCx's function of that name.  Raises _NotCompiledError."""
    cache = Path(cache_dir)
    if not (cache / f"{module_name}.c.cached").exists():
        raise _NotCompiledError(module_name)
    module = load(module_name, cache)
    return [getattr(module.lib, name) for name in object_names], module


@functools.cache
def load(name: str, folder: Path) -> ModuleType:
    """The extension module of a name in a folder."""
    spec: Any = importlib.util.spec_from_file_location(name, folder / (name + sysconfig.get_config_var("EXT_SUFFIX")))
    module: ModuleType = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
