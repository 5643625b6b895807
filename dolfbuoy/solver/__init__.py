"""Unknowns, compiled forms and Newton's method, independent of the physics.

Whatever is imported from here first starts PETSc, and MPI with it.
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

# The libraries that PETSc calls read it once, when they are loaded: threads only cost time here.
_ours = "OMP_NUM_THREADS" not in os.environ
os.environ.setdefault("OMP_NUM_THREADS", "1")
if "petsc4py.PETSc" not in sys.modules:  # Ctrl-C, SIGTERM and a closed pipe are Python's business, not PETSc's
    # The workers of an executor start PETSc with their first task, each at its own time: not all ranks together.
    own = MPI.COMM_SELF if "mpi4py.futures" in sys.modules else None
    with elsewhere():
        petsc4py.init(["dolfbuoy", "-no_signal_handler"], comm=own)


def _import_without_pkg_resources() -> None:
    """UFL and FFCx of Debian 12 import it to look up their own version: 0.1 s of every start."""
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
arguments, sys.argv = sys.argv, ["dolfbuoy"]  # which dolfinx reads, and only if they are UTF-8
try:
    with elsewhere():  # and numba, where it is installed
        import dolfinx  # noqa: F401
finally:
    sys.argv = arguments
if _ours:
    del os.environ["OMP_NUM_THREADS"]
