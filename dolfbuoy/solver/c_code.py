"""C of our own, compiled once per machine with cffi as FFCx does it with its forms, and kept beside them."""

import hashlib
import os
import sysconfig
from functools import cache
from tempfile import TemporaryDirectory

import cffi
import numpy as np
from _cffi_backend import FFI

from ..errors import InputError
from . import compat, jit

ALIGNED = 8  #: doubles of the largest vector

#: In front of a source whose sums are those of NumPy to the last bit: no fused multiply-add.
EVERY_PRODUCT_ROUNDED = """
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#else
#pragma GCC optimize("fp-contract=off")
#endif
"""


@cache
def module(name, declarations, source, key=None, options=(), libraries=()):
    """The compiled module (`.lib`, `.ffi`), from the cache of compiled forms or built into it.

    declarations: of what Python sees, as cffi wants them; they stand in front of the source too.  source: or a function
    that makes it, if a `key` stands for it.  options, libraries: more of them for compiler and linker.  Raises
    InputError where there is no C compiler, PermissionError for a cache that cannot be written.
    """
    options = (*jit.COMPILER, *options)
    key = repr((declarations, key or source, options, libraries, cffi.__version__, sysconfig.get_config_var("SOABI")))
    name = f"dolfbuoy_{name}_{hashlib.sha1(key.encode()).hexdigest()[:16]}"
    path = compat.jit_cache() / (name + sysconfig.get_config_var("EXT_SUFFIX"))
    if not path.exists():
        with jit.alone(compat.jit_cache()):
            if not path.exists():  # still
                text = declarations + (source() if callable(source) else source)
                _build(name, declarations, text, path, extra_compile_args=list(options), libraries=list(libraries))
    return jit.load(name, path.parent)


def _build(name, declarations, source, path, **options):
    """Compile apart and move into place, so that other processes see all of it or nothing."""
    builder = cffi.FFI()
    builder.cdef(declarations)
    builder.set_source(name, source, **options)
    try:
        with TemporaryDirectory(dir=path.parent) as folder, jit.quiet_compiler():
            os.replace(builder.compile(tmpdir=folder), path)
    except cffi.VerificationError as error:
        raise InputError(f"C code cannot be compiled, dolfbuoy needs a C compiler: {error}.") from None
    except PermissionError as error:
        raise PermissionError(error.errno, error.strerror, str(path)) from None


def aligned(size):
    """Zeros that begin where vectors of `ALIGNED` doubles may."""
    array = np.zeros(size + ALIGNED)
    first = -array.ctypes.data // 8 % ALIGNED
    return array[first : first + size]


def address(array):
    """Of integers or doubles, for C; whoever asks for it keeps the array alive."""
    return _ffi.cast("int *" if array.dtype == np.int32 else "double *", array.ctypes.data)


_ffi = FFI()  # that of compiled modules: cffi's own makes itself a parser of C, a twentieth of a start
