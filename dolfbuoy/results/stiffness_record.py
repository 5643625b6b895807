"""Restoring matrices as a dataset, stiffness.nc."""

from typing import TYPE_CHECKING

import numpy as np

from .observe import attributes

if TYPE_CHECKING:
    import xarray as xr

MOTIONS = ("x", "y", "z", "about x", "about y", "about z")
REACTIONS = ("F_x", "F_y", "F_z", "tau_x", "tau_y", "tau_z")
SAID = {
    "mooring": "Restoring matrix of the mooring about C",
    "hull": "Restoring matrix of the hull with all its loads about C",
    "total": "Restoring matrix of both about C",
}
#: Stiffness beyond this many times the forces of the scene over a metre is that of what does not stretch.
RIGID = 1e8


def dataset_of_stiffness(problem, bodies, total, mooring) -> "xr.Dataset":
    """Matrices (6 b, 6 b) of b bodies: the blocks of each body, with the others held."""
    import xarray as xr

    several = ("buoy",) if len(bodies) > 1 else ()
    data = {}
    for name, matrix in {"mooring": mooring, "hull": total - mooring, "total": total}.items():
        blocks = np.array([matrix[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] for i in range(len(bodies))])
        values = np.array([_eigenvalues(block, body) for block, body in zip(blocks, bodies, strict=True)])
        said = {"units": "N/m, N m/rad", "long_name": SAID[name]}
        data[name] = ((*several, "reaction", "motion"), blocks if several else blocks[0], said)
        said = {"units": "N m-1", "long_name": "eigenvalues of its symmetric part, turns at the radius of gyration"}
        data[f"{name}_eigenvalue"] = ((*several, "number"), values if several else values[0], said)
    labels = {"reaction": list(REACTIONS), "motion": list(MOTIONS)}
    if several:
        labels["buoy"] = [body.name for body in bodies]
    info = attributes(problem) | {"typical_force_N": problem.typical_force}
    return xr.Dataset(data, labels, info)


def _eigenvalues(block, body):
    arms = np.array([1.0] * 3 + [np.sqrt(body.mass / np.trace(body.inertia))] * 3)
    scaled = arms[:, None] * block * arms
    return np.linalg.eigvalsh((scaled + scaled.T) / 2)


def notes(dataset, scene) -> list[str]:
    """What one should know of these matrices."""
    found = ["The mooring follows at rest; motion is in world axes, about C."]
    if np.abs(dataset.mooring.values).max() > RIGID * dataset.attrs["typical_force_N"]:
        found.append("Entries as large as that are those of an inextensible line that is taut: it holds rigidly.")
    if getattr(scene, "seabed", None) is not None:
        words = "sticks: its springs are in the matrix" if scene.seabed.friction else "is 0: the line slides freely"
        found.append(f"Friction of the bed {words}.")
    asymmetry = np.abs(dataset.total.values - np.swapaxes(dataset.total.values, -1, -2)).max()
    if asymmetry > 1e-6 * np.abs(dataset.total.values).max():
        found.append("The matrices are not symmetric: current, wind and the quaternion's torques have no potential.")
    return found
