"""Unknowns, compiled forms and Newton's method, independent of the physics.

The first import from here starts PETSc, and with it MPI.
"""

import importlib.metadata
import os
import sys
from types import ModuleType
from typing import Any

import petsc4py
from numpy.typing import NDArray

from ..elsewhere import MPI, elsewhere

Array = NDArray[Any]  #: of numbers

# PETSc's libraries read this once, when they are loaded; threads only cost time here.
_ours = "OMP_NUM_THREADS" not in os.environ
os.environ.setdefault("OMP_NUM_THREADS", "1")
if "petsc4py.PETSc" not in sys.modules:  # Python handles Ctrl-C, SIGTERM and closed pipes, not PETSc
    # Workers of an executor start PETSc with their first task, each at its own time, not collectively.
    own = MPI.COMM_SELF if "mpi4py.futures" in sys.modules else None
    with elsewhere():
        petsc4py.init(["dolfbuoy", "-no_signal_handler"], comm=own)


def _import_without_pkg_resources() -> None:
    """Import UFL and FFCx without pkg_resources, which they use in Debian 12 to look up their version (0.1 s)."""
    light = ModuleType("pkg_resources")
    light.get_distribution = importlib.metadata.distribution
    sys.modules["pkg_resources"] = light
    try:
        import ffcx  # noqa: F401
        import ufl  # noqa: F401
    finally:
        del sys.modules["pkg_resources"]


if "pkg_resources" not in sys.modules:
    _import_without_pkg_resources()
arguments, sys.argv = sys.argv, ["dolfbuoy"]  # read by dolfinx, which requires UTF-8
try:
    with elsewhere():  # this also imports numba, if installed
        import dolfinx  # noqa: F401
finally:
    sys.argv = arguments
if _ours:
    del os.environ["OMP_NUM_THREADS"]
