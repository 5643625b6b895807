"""Motion: initial states, time schemes, steps."""

from .. import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone
