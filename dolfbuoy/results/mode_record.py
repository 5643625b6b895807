"""Natural modes as a dataset, modes.nc: eigenvalues, names, and shapes with the variable names of frames of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .labelled import PARTS, labelled
from .observe import Observer, attributes
from .quantities import over

if TYPE_CHECKING:
    import xarray as xr

#: Largest displacement in a picture, as a fraction of its largest extent, and largest rotation shown [rad].
SHOWN, TURNED = 0.12, 0.25
#: Words for each kind of mode, in place of a period.
KINDS = {
    "oscillates": "",
    "overdamped": "overdamped",
    "drifts": "nothing holds it",
    "leaves": "unstable: leaves",
    "grows": "unstable: grows",
}
UNITS = {
    "eigenvalue": ("1/s", "lambda of x exp(lambda t)"),
    "omega": ("rad s-1", "|lambda|"),
    "period": ("s", "2 pi/|lambda| of what oscillates"),
    "damping_ratio": ("1", "-Re(lambda)/|lambda|"),
    "residual": ("1", "backward error of the eigenpair"),
    "name": ("", "what moves, by its share of the kinetic energy"),
    "kind": ("", "oscillates, overdamped, drifts (lambda = 0), leaves or grows (unstable)"),
    "cable_position": ("m", "displacement of the cable's nodes, in order from the anchor"),
    "cable_tension": ("N", "change of the mean tension of each element, in order from the anchor"),
    "buoy_position": ("m", "displacement of the buoy's centre of mass"),
    "buoy_rotation": ("rad", "rotation vector of the buoy"),
    "rest_cable_position": ("m", "position of the cable's nodes at rest"),
    "rest_buoy_position": ("m", "position of the buoy's centre of mass at rest"),
    "rest_buoy_orientation": ("1", "orientation of the buoy at rest, q_4 = (q0, q), body to world"),
} | {name: (one.unit, one.long_name) for name, one in over("").items()}


def dataset_of_modes(found: Any, modes: list[Any]) -> xr.Dataset:
    """The modes of a linearised scene (`linear.natural`), complete on rank 0.  Collective.

    The real part of a shape is Re(x exp(lambda t)) at t = 0, its imaginary part minus that a quarter period later; the
    largest displacement is 1 m, or the largest rotation 1 rad.
    """
    data = _numbers(modes) | _lines(found, modes) | _bodies(found.bodies, modes)
    made = {name: (dims, values, UNITS.get(name, ("", name))) for name, (dims, values) in data.items()}
    labels = {"mode": range(1, len(modes) + 1), "part": PARTS, "xyz": "xyz", "quaternion": ("q0", "q1", "q2", "q3")}
    labels |= {"buoy": [body.name for body in found.bodies]}
    used = {dim for dims, *_ in made.values() for dim in dims}
    labels = {name: names for name, names in labels.items() if name in used}
    if found.problem.lines is not None:
        labels["cable"] = found.problem.network.cables
    return labelled(made, labels, attributes(found.problem)).set_coords([n for n in over("") if n in made])


def _numbers(modes: list[Any]) -> dict[str, Any]:
    roots = np.array([mode.root for mode in modes], dtype=complex)
    found: dict[str, Any] = {"eigenvalue": (("mode", "part"), roots)}
    for name in ("omega", "period", "damping_ratio", "residual"):
        found[name] = (("mode",), np.array([getattr(mode, name) for mode in modes], dtype=float))
    for name in ("name", "kind"):
        found[name] = (("mode",), np.array([getattr(mode, name) for mode in modes], dtype=object))
    shares = list(dict.fromkeys(name for mode in modes for name in mode.shares))
    for name in shares:
        key = f"share_{name.replace(' ', '_')}"
        found[key] = (("mode",), np.array([mode.shares[name] for mode in modes]))
    return found


def _lines(found: Any, modes: list[Any]) -> dict[str, Any]:
    """Displacements and tensions of the lines' nodes and elements, by the Observer that records frames."""
    problem = found.problem
    if problem.lines is None:
        return {}
    observer, numbering = Observer(problem), problem.system.numbering
    fixed, frames = observer.fixed(), []
    shapes = [part for mode in modes for part in (mode.vector.real, mode.vector.imag)]
    own = numbering.global_index  # negative for prescribed unknowns, which do not move
    for values in [found.u, *(np.where(own >= 0, shape[own], 0.0) for shape in shapes)]:
        problem.system.u[:] = values
        frames.append(observer.frame())
    problem.system.u[:] = found.u
    if problem.comm.rank != 0:
        return {}
    made = {name: (over("")[name].dims, values) for name, values in fixed.items()}
    made["rest_cable_position"] = (("node", "xyz"), frames[0]["cable_position"])
    for name, dims in (("cable_position", ("node", "xyz")), ("cable_tension", ("cell",))):
        values = np.array([frame[name] for frame in frames[1:]])
        made[name] = (("mode", "part", *dims), values.reshape(len(modes), 2, *values.shape[1:]))
    return made


def _bodies(bodies: list[Any], modes: list[Any]) -> dict[str, Any]:
    if not bodies:
        return {}
    motions = np.array([[body.motion(mode.vector) for body in bodies] for mode in modes], dtype=complex)
    return {
        "buoy_position": (("mode", "part", "buoy", "xyz"), motions[..., :3]),
        "buoy_rotation": (("mode", "part", "buoy", "xyz"), motions[..., 3:]),
        "rest_buoy_position": (("buoy", "xyz"), np.array([body.position for body in bodies])),
        "rest_buoy_orientation": (("buoy", "quaternion"), np.array([body.orientation for body in bodies])),
    }


def enlargement(dataset: xr.Dataset, mode: xr.Dataset) -> float:
    """Factor that enlarges a shape to SHOWN of the extent of the picture, with rotations at most TURNED."""
    places = [dataset[n].values.reshape(-1, 3) for n in ("rest_cable_position", "rest_buoy_position") if n in dataset]
    places = np.concatenate(places)
    extent = np.ptp(places, axis=0).max() or 1.0
    moved = [np.abs(mode[n].values).max() for n in ("cable_position", "buoy_position") if n in mode]
    turned = np.abs(mode.buoy_rotation.values).max() if "buoy_rotation" in mode else 0.0
    return float(min(SHOWN * extent / max(*moved, 1e-12), TURNED / max(turned, 1e-12)))


def moving(dataset: xr.Dataset, number: int, times: NDArray[Any], phases: NDArray[Any]) -> xr.Dataset:
    """Record of a run in which the system moves in mode `number` (from 1) only, enlarged, about the rest position.
    times [s]; phases: complex (n,); the displacement is Re(phase x)."""
    import xarray as xr

    mode = dataset.isel(mode=number - 1)
    z = enlargement(dataset, mode) * np.asarray(phases, dtype=complex)

    def moved(name: str) -> NDArray[Any]:
        return np.tensordot(np.column_stack([z.real, -z.imag]), mode[name].values, axes=1)

    data: dict[str, Any] = {"time": ("time", times)} | {
        n: dataset[n] for n in (*over(""), "cable", "buoy") if n in dataset
    }
    if "cable_position" in mode:
        positions = dataset.rest_cable_position.values + moved("cable_position")
        data |= {"frame": ("frame", times), "cable_position": (("frame", "node", "xyz"), positions)}
        data["cable_tension"] = (("frame", "cell"), moved("cable_tension"))
    if "buoy_position" in mode:
        turned = [list(map(_turned, dataset.rest_buoy_orientation.values, turns)) for turns in moved("buoy_rotation")]
        positions = dataset.rest_buoy_position.values + moved("buoy_position")
        data["buoy_position"] = ("time", "buoy", "xyz"), positions
        data["buoy_orientation"] = ("time", "buoy", "quaternion"), np.array(turned)
    return xr.Dataset(data)


def _turned(q4: NDArray[Any], turn: NDArray[Any]) -> NDArray[Any]:
    """A unit quaternion rotated by a rotation vector in the world frame."""
    angle = np.linalg.norm(turn)
    w, v = np.cos(angle / 2), (np.sin(angle / 2) / angle if angle else 0.0) * turn
    return np.concatenate([[w * q4[0] - v @ q4[1:]], w * q4[1:] + q4[0] * v + np.cross(v, q4[1:])])
