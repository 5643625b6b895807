"""Libraries that look for settings in the current folder are started in another one.

A folder may come from a stranger.  PETSc (petscrc, petsc.cfg), UCX of MPI (ucx.conf), dolfinx and FFCx
(dolfinx_jit_options.json, ffcx_options.json), netCDF (.ncrc, .dodsrc, .daprc) and matplotlib (matplotlibrc) each read
a file there when they start; some of these files make them run code.  Files of the user's own home and environment
count as they always do.
"""

import gc
import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import ModuleType

from .errors import InputError


@contextmanager
def quick_start() -> Iterator[None]:
    """Load libraries and build forms in less time: a seventh of a start.

    What they make stays, so that nothing is gained by looking for garbage in it; and of 85,000 functions of PETSc's
    libraries few are ever called: each is looked up when it is.
    """
    collecting, flags = gc.isenabled(), sys.getdlopenflags()
    gc.disable()
    sys.setdlopenflags(flags & ~os.RTLD_NOW | os.RTLD_LAZY)
    try:
        yield
    finally:
        sys.setdlopenflags(flags)
        if collecting:
            if not gc.get_freeze_count():  # else what the host has frozen would thaw
                gc.freeze()  # with the next line: all is old, without a look at it
                gc.unfreeze()
            gc.enable()


@contextmanager
def elsewhere() -> Iterator[None]:
    """Start a library while the current folder is the root of the file system."""
    here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    try:
        os.chdir("/")
        with quick_start():
            yield
    finally:
        os.fchdir(here)
        os.close(here)


def __getattr__(name: str) -> ModuleType:
    """`from dolfbuoy.elsewhere import matplotlib`: a library of the names below, started elsewhere."""
    if name not in ("matplotlib", "netCDF4", "MPI"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "MPI" and "mpi4py.MPI" not in sys.modules:
        _check_temporary_folder()
    with elsewhere(), _alone():
        library = importlib.import_module("mpi4py.MPI" if name == "MPI" else name)
        if name == "netCDF4":  # starts with the first file
            with suppress(OSError):
                library.Dataset("/")
    globals()[name] = library
    return library


#: Settings of Open MPI for a process alone, which needs no daemon and no network: 0.2 s of a start each.
_ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}


@contextmanager
def _alone() -> Iterator[None]:
    """_ALONE is in the environment meanwhile, unless mpirun or srun started this process; the user's own settings stay.

    Not longer: what is started from here may be several, and mpirun would pass it on to them.
    """
    several = {"PMIX_RANK", "PMI_RANK"} & os.environ.keys()
    ours = {} if several else {name: value for name, value in _ALONE.items() if name not in os.environ}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            os.environ.pop(name, None)


def _check_temporary_folder() -> None:
    """Raise InputError where Open MPI would end the process with a page of text."""
    given = next(((name, os.environ[name]) for name in ("TMPDIR", "TEMP", "TMP") if os.environ.get(name)), None)
    if given is None:
        return
    name, folder = given
    try:
        os.rmdir(tempfile.mkdtemp(prefix="dolfbuoy-", dir=folder))
    except OSError as error:
        raise InputError(
            f"{name} = {folder!r}: must be a folder in which files can be written ({error.strerror})."
        ) from None
