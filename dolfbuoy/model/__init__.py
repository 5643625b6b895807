"""Models of the parts of a scene: unknowns and forms on meshes."""

from .. import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone
