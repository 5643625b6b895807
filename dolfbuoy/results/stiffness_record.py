"""Restoring matrices as a dataset, stiffness.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .labelled import Variable, labelled
from .observe import attributes

if TYPE_CHECKING:
    import xarray as xr

    from ..model.problem import Problem
    from ..scene import Scene

MOTIONS = ("x", "y", "z", "about x", "about y", "about z")
REACTIONS = ("F_x", "F_y", "F_z", "tau_x", "tau_y", "tau_z")
NAMES = {
    "mooring": "Restoring matrix of the mooring about C",
    "hull": "Restoring matrix of the hull with all its loads about C",
    "total": "Restoring matrix of both about C",
}
#: Less than this in a rigid direction, of length 1, is rounding.
LEAST = 1e-6


def dataset_of_stiffness(problem: Problem, found: Any) -> xr.Dataset:
    """Matrices of `linear.stiffness.Restoring`: the blocks of each body, with the others held.

    What is rigid is infinite, and `rigid` has its directions.
    """
    data: dict[str, Variable] = {}
    is_rigid = any(rigid.shape[1] for rigid in found.rigid)
    matrices = {"mooring": found.mooring, "hull": found.hull, "total": found.mooring + found.hull}
    for name, matrix in matrices.items():
        blocks, values, finite = [], [], []
        for i, (body, rigid) in enumerate(zip(found.bodies, found.rigid, strict=True)):
            block = matrix[6 * i : 6 * i + 6, 6 * i : 6 * i + 6]
            directions = rigid if name != "hull" else rigid[:, :0]
            blocks.append(_with_infinite(body, block, directions))
            values.append(_eigenvalues(body, block, directions))
            finite.append(_across(body, block, directions))
        data[name] = (("buoy", "reaction", "motion"), np.array(blocks), ("N/m, N m/rad", NAMES[name]))
        what = "N m-1", "eigenvalues of its symmetric part, turns at the radius of gyration"
        data[f"{name}_eigenvalue"] = (("buoy", "number"), np.array(values), what)
        if is_rigid and name != "hull":
            what = "N/m, N m/rad", f"{NAMES[name]}, of motions across what is rigid"
            data[f"{name}_across"] = (("buoy", "reaction", "motion"), np.array(finite), what)
    if is_rigid:
        rows = [_motions(body, rigid) for body, rigid in zip(found.bodies, found.rigid, strict=True)]
        data["rigid"] = (
            ("buoy", "number", "motion"),
            np.array(rows),
            ("m, rad", "motion of each eigenvalue that is infinite"),
        )
    labels = {"reaction": REACTIONS, "motion": MOTIONS, "buoy": [body.name for body in found.bodies]}
    return labelled(data, labels, attributes(problem))


def _with_infinite(body: Any, block: NDArray[Any], rigid: NDArray[Any]) -> NDArray[Any]:
    """The block across rigid directions (6, k), infinite where these have a part."""
    infinite = rigid @ rigid.T
    return np.where(np.abs(infinite) > LEAST, np.copysign(np.inf, infinite), _across(body, block, rigid))


def _across(body: Any, block: NDArray[Any], rigid: NDArray[Any]) -> NDArray[Any]:
    """The block of motions of which the part along rigid directions is taken away."""
    if not rigid.shape[1]:
        return block
    arms, across = body.arms, np.eye(6) - rigid @ rigid.T
    return np.asarray(across @ (arms[:, None] * block * arms) @ across / arms[:, None] / arms)


def _eigenvalues(body: Any, block: NDArray[Any], rigid: NDArray[Any]) -> NDArray[Any]:
    """Rising, infinite ones last."""
    across = np.linalg.svd(rigid)[0][:, rigid.shape[1] :] if rigid.shape[1] else np.eye(6)
    finite = np.linalg.eigvalsh(across.T @ body.scaled(block) @ across)
    return np.concatenate([finite, np.full(rigid.shape[1], np.inf)])


def _motions(body: Any, rigid: NDArray[Any]) -> NDArray[Any]:
    """(6, 6): rows of the eigenvalues that are infinite, the largest entry positive; nan of the others."""
    rows = np.full((6, 6), np.nan)
    for row, direction in zip(rows[6 - rigid.shape[1] :], rigid.T, strict=True):
        motion = body.arms * np.where(np.abs(direction) > LEAST, direction, 0.0)
        row[:] = motion * np.sign(motion[np.abs(motion).argmax()])
    return rows


def notes(dataset: xr.Dataset, scene: Scene) -> list[str]:
    """Notes on these matrices."""
    found = ["The mooring follows at rest; motion is in world axes, about C."]
    if "rigid" in dataset:
        found.append(
            "An inextensible line that is taut holds rigidly: 'rigid' is an infinite stiffness, and the other entries "
            "are those of motions across it, which is along "
            + ", and ".join(f"({', '.join(f'{x:.4g}' for x in row)})" for row in _rows(dataset.rigid.values))
            + " in the order of the columns; mooring_across and total_across of stiffness.nc are without it."
        )
    found += on_friction(scene)
    total = np.where(np.isfinite(dataset.total.values), dataset.total.values, 0.0)
    if np.abs(total - np.swapaxes(total, -1, -2)).max() > 1e-6 * np.abs(total).max():
        found.append("The matrices are not symmetric: current, wind and the quaternion's torques have no potential.")
    return found


def on_friction(scene: Scene) -> list[str]:
    """Notes on the friction of the bed in linear equations."""
    if scene.seabed is None:
        return []
    words = "sticks: its springs are in these numbers" if scene.seabed.friction else "is 0: what lies slides freely"
    return [f"Friction of the bed {words}."]


def _rows(rigid: NDArray[Any]) -> NDArray[Any]:
    rows = rigid.reshape(-1, rigid.shape[-1])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)] + 0.0)
