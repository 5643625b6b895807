"""The price of accuracy: stable pairs of elements, errors of elements and schemes, and the time of a run."""

from ... import api, solver  # noqa: F401  # before dolfinx: what is missing is named, PETSc leaves signals alone
