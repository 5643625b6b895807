"""Libraries that look for settings in the current folder are started in another one.

A folder may come from a stranger.  PETSc (petscrc, petsc.cfg), UCX of MPI (ucx.conf), dolfinx and FFCx
(dolfinx_jit_options.json, ffcx_options.json), netCDF (.ncrc, .dodsrc, .daprc) and matplotlib (matplotlibrc) each read
a file there when they start; some of these files make them run code.  Files of the user's own home and environment
count as they always do.
"""

import importlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress


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
    with elsewhere():
        library = importlib.import_module("mpi4py.MPI" if name == "MPI" else name)
        if name == "netCDF4":  # starts with the first file
            with suppress(OSError):
                library.Dataset("/")
    return library
