"""What stays sound: pairs of elements, explicit steps, slack cables, rounded-off terms, long runs."""

from ... import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone
