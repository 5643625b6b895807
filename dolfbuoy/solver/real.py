"""Global Real unknowns: numbers that belong to no place on the mesh.

A Real space is a vector of piecewise constants whose every cell refers to the same dofs.  It lives entirely
on one rank; other ranks hold a copy of their own that nothing reads, because only `ds` terms at the cable's upper
end couple it to the cable.
"""

import numpy as np

from . import compat


def real_space(mesh, size):
    """Space of `size` global numbers (size > 1) on `mesh`; its Function has an array of `size` values."""
    template = compat.function_space(mesh, compat.element(mesh, "DG", 0, size))
    cells = template.dofmap.index_map.size_local + template.dofmap.index_map.num_ghosts
    cell_dofs = np.zeros((cells, 1), dtype=np.int32)
    return compat.space_on_dofmap(mesh, template, compat.local_index_map(1), cell_dofs, size)
