"""The linear response to waves as a dataset, response.nc, and restoring matrices, stiffness.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .labelled import PARTS, Variable, complex_of, labelled
from .observe import attributes
from .parts import names_of
from .tables import newtons

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from ..model.problem import Problem
    from ..scene import Scene
    from .labelled import Variable

MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
TENSIONS = ("tension_top", "tension_anchor")
#: Note shown with these numbers.
LINEAR = (
    "Linear: standard deviations and amplitudes about the mean, no extremes; slack lines, snaps, a buoy under water "
    "and drift are not in it."
)
#: Note for a scene that moves the ends of its lines.
HELD = "Ends that the scene moves are held still: only the waves are in this response."


def dataset_of_response(
    seaway: Any,
    periods: NDArray[Any],
    small: NDArray[Any] | None,
    high: NDArray[Any] | None,
    height: float | None,
    sea: tuple[Any, Any] | None = None,
) -> xr.Dataset:
    """Amplitudes per metre over periods, in small waves and in waves of a height [m] (None: not requested).

    seaway: `linear.seaway.Seaway`.  small, high: its X (rows, periods).  sea: (`linear.spectrum.Bins`, X) of an
    irregular sea.
    """
    data: dict[str, Variable] = {"period": (("period",), periods, ("s", "period of the waves"))}
    for name, X, words in (("rao", small, "in small waves"), ("rao_drag", high, "in waves of this height")):
        if X is not None:
            data |= _amplitudes(seaway, name, X, words)
    means = _by_line(seaway, np.array([mean for mean, _ in seaway.tension_slopes().values()]))
    data["tension_mean"] = (("cable", "tension"), means, ("N", "tension at rest"))
    if sea is not None:
        data |= _irregular(seaway, *sea)
    labels: dict[str, Sequence[str]] = {"motion": MOTIONS, "part": PARTS, "tension": TENSIONS}
    labels["cable"] = [line.name for line in seaway.found.lines]
    if seaway.found.bodies:
        labels["buoy"] = [body.name for body in seaway.found.bodies]
    info = attributes(seaway.found.problem) | {"direction_deg": seaway.direction_deg, "comment": LINEAR}
    if high is not None:
        info["height_m"] = height
    return labelled(data, labels, info)


def _motions(seaway: Any, X: NDArray[Any]) -> NDArray[Any]:
    """Array (buoy, motion, ...) of the motions in X."""
    return np.array([np.array(motion) for motion in seaway.motions(X)])


def _by_line(seaway: Any, values: NDArray[Any]) -> NDArray[Any]:
    """Tensions of a Seaway as (cable, tension, ...); nan for a free top."""
    found = np.full((len(seaway.found.lines), len(TENSIONS), *values.shape[1:]), np.nan, dtype=values.dtype)
    for (what, cable), value in zip(seaway.tension_slopes(), values, strict=True):
        found[cable, TENSIONS.index(what)] = value
    return found


def _amplitudes(seaway: Any, name: str, X: NDArray[Any], words: str) -> dict[str, Variable]:
    found, tensions = {}, _by_line(seaway, seaway.tensions(X))
    if seaway.found.bodies:
        what = "m/m, rad/m", f"motions of C {words}"
        found[name] = (("buoy", "motion", "period", "part"), _motions(seaway, X), what)
    what = "N/m", f"tensions {words}"
    return found | {f"{name}_tension": (("cable", "tension", "period", "part"), tensions, what)}


def _irregular(seaway: Any, bins: Any, X: NDArray[Any]) -> dict[str, Variable]:
    """Spectra and standard deviations."""
    tensions = np.abs(_by_line(seaway, seaway.tensions(X))) ** 2
    elevation = bins.density(np.ones_like(bins.energy))
    spectra, deviations = bins.density(tensions), np.sqrt(tensions @ bins.energy)
    found = {
        "omega": (("omega",), bins.omega, ("rad s-1", "angular frequency")),
        "spectrum": (("omega",), elevation, ("m2 s rad-1", "spectral density of the elevation")),
        "tension_spectrum": (("cable", "tension", "omega"), spectra, ("N2 s rad-1", "of the tensions")),
        "tension_std": (("cable", "tension"), deviations, ("N", "standard deviation of the tensions")),
    }
    if seaway.found.bodies:
        motions = np.abs(_motions(seaway, X)) ** 2
        what = "m2 s/rad, rad2 s/rad", "spectral density of the motions"
        found["motion_spectrum"] = (("buoy", "motion", "omega"), bins.density(motions), what)
        what = "m, rad", "standard deviation of the motions"
        found["motion_std"] = (("buoy", "motion"), np.sqrt(motions @ bins.energy), what)
    return found


def each_buoy(dataset: xr.Dataset, kind: str = "buoy") -> list[tuple[str, xr.Dataset]]:
    """(" of NAME", or "" if there is only one; its part) of each buoy or vessel."""
    names = names_of(dataset, kind)
    return [(f" of {name}" if len(names) > 1 else "", dataset.sel({kind: name})) for name in names]


def each_tension(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """(name, including the cable's if there are several; its part) of each tension except those of free tops."""
    names = names_of(dataset, "cable")
    found = [
        (f"{what}_{name}" if len(names) > 1 else what, dataset.sel(cable=name, tension=what))
        for what in TENSIONS
        for name in names
    ]
    return [(name, one) for name, one in found if np.isfinite(one.tension_mean)]


def warnings(dataset: xr.Dataset) -> list[str]:
    """Warnings where a line goes slack, so that the response is no longer linear."""
    found = []
    for name, one in each_tension(dataset):
        if "tension_std" in one and 3 * one.tension_std.item() > one.tension_mean.item():
            found.append(
                f"{name}: three standard deviations, {newtons(3 * one.tension_std.item())}, are more than the mean, "
                f"{newtons(one.tension_mean.item())}: the line goes slack in this sea, which is not linear."
            )
        if "rao_drag_tension" in one:
            half = dataset.attrs["height_m"] / 2 * np.abs(complex_of(one.rao_drag_tension))
            over = dataset.period.values[half > one.tension_mean.item()]
            if len(over):
                reach = f"{over.min():g}" if len(over) == 1 else f"{over.min():g} to {over.max():g}"
                found.append(
                    f"{name}: in waves of {dataset.attrs['height_m']:g} m the amplitude is more than the mean at "
                    f"{reach} s: the line goes slack there, which is not linear."
                )
    return found


AXES = ("x", "y", "z", "about x", "about y", "about z")
REACTIONS = ("F_x", "F_y", "F_z", "tau_x", "tau_y", "tau_z")
NAMES = {
    "mooring": "Restoring matrix of the mooring about C",
    "hull": "Restoring matrix of the hull with all its loads about C",
    "total": "Restoring matrix of both about C",
}
#: Components of a unit vector along a rigid direction below this are rounding errors.
LEAST_PART = 1e-6


def dataset_of_stiffness(problem: Problem, found: Any, vessels: Sequence[Any] = ()) -> xr.Dataset:
    """Restoring matrices of each body with the others held, and of vessels with the pull of their lines.

    found: `linear.stiffness.Restoring`; vessels: `linear.stiffness.on_vessels`.  Rigid entries are infinite, with their
    directions in `rigid`.
    """
    labels: dict[str, Any] = {"reaction": REACTIONS, "motion": AXES}
    data = _of_bodies(found) if found.bodies else {}
    if found.bodies:
        labels["buoy"] = [body.name for body in found.bodies]
    if vessels:
        labels["vessel"] = [one.name for one in vessels]
        matrices, pulls = np.array([one.stiffness for one in vessels]), np.array([one.pull for one in vessels])
        what = "N/m, N m/rad", "Restoring matrix of the mooring about the reference point"
        data["vessel_mooring"] = (("vessel", "reaction", "motion"), matrices, what)
        what = "N, N m", "force and moment of the mooring about the reference point at rest"
        data["vessel_pull"] = (("vessel", "reaction"), pulls, what)
    return labelled(data, labels, attributes(problem))


def _of_bodies(found: Any) -> dict[str, Variable]:
    """Variables of `linear.stiffness.Restoring`."""
    data: dict[str, Variable] = {}
    is_rigid = any(rigid.shape[1] for rigid in found.rigid)
    matrices = {"mooring": found.mooring, "hull": found.hull, "total": found.mooring + found.hull}
    for name, matrix in matrices.items():
        blocks, values, finite = [], [], []
        for i, (body, rigid) in enumerate(zip(found.bodies, found.rigid, strict=True)):
            block = matrix[6 * i : 6 * i + 6, 6 * i : 6 * i + 6]
            directions = rigid if name != "hull" else rigid[:, :0]
            infinite = directions @ directions.T  # nonzero where the rigid directions (6, k) have components
            finite.append(_across(body, block, directions))
            blocks.append(np.where(np.abs(infinite) > LEAST_PART, np.copysign(np.inf, infinite), finite[-1]))
            values.append(_eigenvalues(body, block, directions))
        data[name] = (("buoy", "reaction", "motion"), np.array(blocks), ("N/m, N m/rad", NAMES[name]))
        what = "N m-1", "eigenvalues of its symmetric part, turns at the radius of gyration"
        data[f"{name}_eigenvalue"] = (("buoy", "number"), np.array(values), what)
        if is_rigid and name != "hull":
            what = "N/m, N m/rad", f"{NAMES[name]}, of motions across what is rigid"
            data[f"{name}_across"] = (("buoy", "reaction", "motion"), np.array(finite), what)
    if is_rigid:
        rows = [_rigid_motions(body, rigid) for body, rigid in zip(found.bodies, found.rigid, strict=True)]
        what = "m, rad", "motion of each eigenvalue that is infinite"
        data["rigid"] = (("buoy", "number", "motion"), np.array(rows), what)
    return data


def _across(body: Any, block: NDArray[Any], rigid: NDArray[Any]) -> NDArray[Any]:
    """The block for motions with their component along rigid directions removed."""
    if not rigid.shape[1]:
        return block
    arms, across = body.arms, np.eye(6) - rigid @ rigid.T
    return np.asarray(across @ (arms[:, None] * block * arms) @ across / arms[:, None] / arms)


def _eigenvalues(body: Any, block: NDArray[Any], rigid: NDArray[Any]) -> NDArray[Any]:
    """Eigenvalues in increasing order, infinite ones last."""
    across = np.linalg.svd(rigid)[0][:, rigid.shape[1] :] if rigid.shape[1] else np.eye(6)
    finite = np.linalg.eigvalsh(across.T @ body.scaled(block) @ across)
    return np.concatenate([finite, np.full(rigid.shape[1], np.inf)])


def _rigid_motions(body: Any, rigid: NDArray[Any]) -> NDArray[Any]:
    """Motions (6, 6) of the infinite eigenvalues, largest entry positive; the other rows are nan."""
    rows = np.full((6, 6), np.nan)
    for row, direction in zip(rows[6 - rigid.shape[1] :], rigid.T, strict=True):
        motion = body.arms * np.where(np.abs(direction) > LEAST_PART, direction, 0.0)
        row[:] = motion * np.sign(motion[np.abs(motion).argmax()])
    return rows


def notes(dataset: xr.Dataset, scene: Scene) -> list[str]:
    """Notes on these matrices."""
    found = ["The mooring follows at rest; motion is in world axes, about C."] if "total" in dataset else []
    if "vessel_mooring" in dataset:
        found.append("Of a vessel: lines and buoys follow at rest; motion is in world axes, about its reference point.")
    if "rigid" in dataset:
        found.append(
            "An inextensible line that is taut holds rigidly: 'rigid' is an infinite stiffness, and the other entries "
            "are those of motions across it, which is along "
            + ", and ".join(f"({', '.join(f'{x:.4g}' for x in row)})" for row in _rows(dataset.rigid.values))
            + " in the order of the columns; mooring_across and total_across of stiffness.nc are without it."
        )
    found += on_friction(scene)
    for name in (name for name in ("total", "vessel_mooring") if name in dataset):
        matrix = np.where(np.isfinite(dataset[name].values), dataset[name].values, 0.0)
        if np.abs(matrix - np.swapaxes(matrix, -1, -2)).max() > 1e-6 * np.abs(matrix).max():
            reason = "a moment about fixed axes" if name == "vessel_mooring" else "the quaternion's torques"
            found.append(f"The matrices are not symmetric: current, wind and {reason} have no potential.")
    return found


def on_friction(scene: Scene) -> list[str]:
    """Notes on bed friction in the linear equations."""
    if scene.seabed is None:
        return []
    words = "sticks: its springs are in these numbers" if scene.seabed.friction else "is 0: what lies slides freely"
    return [f"Friction of the bed {words}."]


def _rows(rigid: NDArray[Any]) -> NDArray[Any]:
    rows = rigid.reshape(-1, rigid.shape[-1])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)] + 0.0)
