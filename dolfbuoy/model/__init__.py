"""What a scene is made of, as unknowns and forms on meshes."""

from .. import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone
