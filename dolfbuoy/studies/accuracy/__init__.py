"""Cost of accuracy: stable element pairs, errors of elements and schemes, and computing time."""

from ... import api, solver  # noqa: F401  # before dolfinx: what is missing is named, PETSc leaves signals alone
