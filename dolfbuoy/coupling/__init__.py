"""Coupling with other programs: a scene that a caller advances step by step, drives and loads."""

from .. import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone
from .session import Session

__all__ = ["Session"]
