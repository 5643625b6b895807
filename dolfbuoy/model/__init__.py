"""Models of the parts of a scene: their unknowns and forms on meshes."""

from typing import Any

from numpy.typing import NDArray

from .. import solver  # noqa: F401  # before dolfinx: it tells PETSc to leave signals alone

Array = NDArray[Any]  #: of numbers
