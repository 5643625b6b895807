"""The core in C, compiled once per machine like FFCx forms, and kept in the same cache."""

import hashlib
import sysconfig
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import cffi
import numpy as np
import petsc4py
from _cffi_backend import FFI
from petsc4py import PETSc

from ..core import build
from . import Array, compat, instructions, jit

ALIGNED = 8  #: doubles of the largest vector


@cache
def core() -> ModuleType:
    """The compiled core (`.lib`, `.ffi`), from the cache of compiled forms or built into it.

    Raises InputError without a C compiler, PermissionError for a cache that cannot be written.
    """
    chosen, int_bytes = instructions.best().options, np.dtype(PETSc.IntType).itemsize
    texts = [file.read_text() for file in sorted(build.FOLDER.iterdir()) if file.suffix in (".c", ".h", ".py")]
    petsc = PETSc.__file__, int_bytes, PETSc.Sys.getVersion()

    def make(path: Path) -> None:
        config = petsc4py.get_config()  # imports a parser: 2 ms
        folder, arch = config["PETSC_DIR"], config.get("PETSC_ARCH") or ""
        build.core(path, chosen, compat.KERNEL_TAKES_DATA, build.Petsc(folder, arch, int_bytes, PETSc.__file__))

    path = kept("core", (petsc, chosen, compat.KERNEL_TAKES_DATA, texts, cffi.__version__), make)
    return jit.load(path.name.split(".")[0], path.parent)


def kept(name: str, key: object, make: Callable[[Path], object]) -> Path:
    """A file in the cache of compiled forms, created by `make`, in one process at a time, if it does not exist.

    key: everything its contents depend on, except the sanitizers.
    """
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    digest = hashlib.sha1(repr((key, build.sanitized(), suffix)).encode()).hexdigest()[:16]
    path = compat.jit_cache() / f"dolfbuoy_{name}_{digest}{suffix}"
    if not path.exists():
        with jit.alone(compat.jit_cache(), path.name):
            if not path.exists():  # still
                make(path)
    return path


def check(error: int) -> None:
    """Raise PETSc.Error for a nonzero error code of a PETSc function."""
    if error:
        raise PETSc.Error(error)


def aligned(size: int) -> Array:
    """Array of zeros, aligned for vectors of `ALIGNED` doubles."""
    array = np.zeros(size + ALIGNED)
    first = -array.ctypes.data // 8 % ALIGNED
    return array[first : first + size]


def address(array: Array) -> Any:
    """C pointer to an array of integers, doubles or bools; the caller must keep the array alive."""
    return _ffi.cast(_POINTERS[array.dtype.char], array.ctypes.data)


_KINDS = (np.int32, "int"), (np.int64, "int64_t"), (np.float64, "double"), (np.bool_, "bool")
_POINTERS = {np.dtype(kind).char: f"{name} *" for kind, name in _KINDS}
_ffi = FFI()  # that of compiled modules: cffi.FFI() creates a C parser, a twentieth of the start-up time
