"""Start of libraries outside the current folder, in which they would look for settings.

A folder may come from an untrusted source.  PETSc (petscrc, petsc.cfg), UCX of MPI (ucx.conf), dolfinx and FFCx
(dolfinx_jit_options.json, ffcx_options.json), netCDF (.ncrc, .dodsrc, .daprc) and matplotlib (matplotlibrc) each read
a file there when they start; some of these files can make them run code.  Files in the user's home and the environment
are used as always.
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
    """Load libraries and build forms faster: this saves a seventh of the start-up time.

    Garbage collection is off, because the objects created are permanent; and few of the 85,000 functions of PETSc's
    libraries are ever called, so each is bound at its first call.
    """
    collecting, flags = gc.isenabled(), sys.getdlopenflags()
    gc.disable()
    sys.setdlopenflags(flags & ~os.RTLD_NOW | os.RTLD_LAZY)
    try:
        yield
    finally:
        sys.setdlopenflags(flags)
        if collecting:
            if not gc.get_freeze_count():  # else objects frozen by the host program would be unfrozen
                gc.freeze()  # with the next line: moves all objects to the oldest generation
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
        if name == "netCDF4":  # starts on opening the first file
            with suppress(OSError):
                library.Dataset("/")
    globals()[name] = library
    return library


#: Settings of Open MPI for a single process, which needs no daemon and no network: each saves 0.2 s.
_ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}


@contextmanager
def _alone() -> Iterator[None]:
    """Set _ALONE in the environment meanwhile, unless started by mpirun or srun; the user's own settings take priority.

    Only meanwhile, because this process may start others in parallel, to which mpirun would pass the settings on.
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
    """Raise InputError if Open MPI would end the process with a page of text."""
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
