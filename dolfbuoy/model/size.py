"""What a scene takes, looked at before anything is built."""

import os
import resource

from ..elsewhere import MPI
from ..errors import InputError
from ..meshes import number_of_cells
from ..scene import Scene

#: Memory of a run: measured 1.9 to 2.4 kB for each unknown of a line, 0.7 MB for a buoy, whatever the scheme.
PER_UNKNOWN, PER_BUOY = 1.9e3, 0.7e6


def check_size(scene: Scene, comm: MPI.Comm) -> None:
    """Refuse more ranks than elements, and more elements or buoys than memory holds.  Raises InputError."""
    network = scene.network
    cells = [number_of_cells(piece.section.elements) for piece in network.pieces]
    if cells and comm.size > sum(cells):
        raise InputError(
            f"cable.elements = {sum(cells)}: must be at least the number of MPI ranks of this run, {comm.size}."
        )
    lines = sum(n * _unknowns(piece.section) for n, piece in zip(cells, network.pieces, strict=True)) * PER_UNKNOWN
    buoys = len(network.buoys) * PER_BUOY
    needed, here = (lines + buoys) / comm.size, memory()
    if needed > here:
        what = f"cable.elements = {sum(cells)}" if lines > buoys else f"buoy: {len(network.buoys)} tables"
        raise InputError(
            f"{what} in all: must be fewer, they take {needed / 1e9:.3g} GB of {here / 1e9:.3g} GB memory."
        )


def _unknowns(section):
    """Of an element, but for what a line has in one more node."""
    return 3 * section.position_degree + section.tension_degree + 1


def memory() -> float:
    """Memory that this process may have [bytes]."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    try:
        with open("/sys/fs/cgroup/memory.max") as file:
            limits.append(int(file.read()))
    except (OSError, ValueError):  # no such group, or "max"
        pass
    allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
    return float(min(limits if allowed == resource.RLIM_INFINITY else [*limits, allowed]))
