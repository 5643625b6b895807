"""Libraries that look for settings in the current folder are started in another one.

A folder may come from a stranger.  PETSc (petscrc, petsc.cfg), UCX of MPI (ucx.conf), dolfinx and FFCx
(dolfinx_jit_options.json, ffcx_options.json), netCDF (.ncrc, .dodsrc, .daprc) and matplotlib (matplotlibrc) each read
a file there when they start; some of these files make them run code.  Files of the user's own home and environment
count as they always do.
"""

import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError


@contextmanager
def elsewhere() -> Iterator[None]:
    """The current folder is the root of the file system meanwhile."""
    here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    try:
        os.chdir("/")
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def __getattr__(name):
    """`from dolfbuoy.elsewhere import matplotlib`: a library of the names below, started elsewhere."""
    if name not in ("matplotlib", "netCDF4", "MPI"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "MPI" and "mpi4py.MPI" not in sys.modules:
        _check_temporary_folder()
    with elsewhere():
        library = importlib.import_module("mpi4py.MPI" if name == "MPI" else name)
        if name == "netCDF4":  # starts with the first file
            with suppress(OSError):
                library.Dataset("/")
    return library


def _check_temporary_folder():
    """Raise InputError where Open MPI would end the process with a page of text."""
    given = next(((name, os.environ[name]) for name in ("TMPDIR", "TEMP", "TMP") if os.environ.get(name)), None)
    if given is None:
        return
    name, folder = given
    there = next(path for path in (Path(folder).absolute(), *Path(folder).absolute().parents) if path.exists())
    try:
        os.rmdir(tempfile.mkdtemp(prefix="dolfbuoy-", dir=there))
    except OSError as error:
        raise InputError(
            f"{name} = {folder!r}: must be a folder in which files can be written ({error.strerror})."
        ) from None
