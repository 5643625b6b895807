"""Files for ParaView: meshes of lines, hulls, buoys, joints, water and bed per instant, and collections with times."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import meshio
import numpy as np

from ..errors import InputError
from ..model.sea import heading, wavenumber
from ..scene.settings import LEAST_FRAMES, frame_interval
from ..writing import made, replacing
from . import quantities
from .checkpoint import read_scene
from .folder import enlist, remarks
from .frame import Frame, Frames
from .parts import names_of
from .record import fitting, read

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene

#: Default number of instants written: each gives a file of everything that moves.
INSTANTS = 50
#: Name of the collection of all meshes of a run with several cables or buoys.
NETWORK = "network"
#: Function that makes a mesh of a frame.
Make = Callable[[Frame], meshio.Mesh]


def export(folder: str | Path, most: int = INSTANTS) -> list[Path]:
    """Write folder/paraview/ from the results.nc and scene.toml of a run; returns the files, collections last.

    One mesh per instant (cable_NNNN.vtu, ...) for up to `most` recorded instants at even spacing, and a collection to
    open (cable.pvd, ...) for each kind that the run has; field names include units.  A mesh contains all cables, or
    buoys, with their numbers; if there are several, network.pvd shows everything at once.  Raises InputError if the
    folder holds no run.
    """
    folder = Path(folder)
    record, scene = read_run(folder)
    with fitting(folder / "results.nc"):
        recorded, frames = instants(record, scene), Frames(record, scene)
        meshes: dict[str, Make] = {
            name: partial(_of_record, folder / "results.nc", make) for name, make in meshes_of(frames).items()
        }
        chosen = np.linspace(0, len(recorded) - 1, min(most, len(recorded))).round().astype(int)
        shown = [frames.at(time) for time in recorded[chosen]]
    together = NETWORK if max(len(frames.spans), len(frames.buoys)) > 1 else None
    files = write_series(folder, "run", shown, meshes, together)
    for name in remarks(folder, "run")["files"]:  # from an earlier export
        if name.startswith("paraview/") and folder / name not in files:
            (folder / name).unlink(missing_ok=True)
    return files


def write_series(
    folder: Path, owner: str, frames: list[Frame], meshes: dict[str, Make], together: str | None = None
) -> list[Path]:
    """Write folder/paraview/NAME_0000.vtu and so on, only one of what does not move, and NAME.pvd with their times.

    owner: kind of result to which the files belong.  meshes: by NAME.  together: name of a collection of all.
    """
    target, still = folder / "paraview", {"bed"} if frames[0].scene.waves else {"bed", "water"}
    moving = {name: frames[:1] if name in still else frames for name in meshes}
    series = {name: [target / f"{name}_{i:04d}.vtu" for i in range(len(shown))] for name, shown in moving.items()}
    collections = [target / f"{name}.pvd" for name in (*series, *([together] if together else []))]
    files = [*(path for paths in series.values() for path in paths), *collections]
    made(folder, target.name)
    enlist(folder, files, owner)
    for name, paths in series.items():
        for path, frame in zip(paths, moving[name], strict=True):
            mesh = meshes[name](frame)
            with replacing(path) as part:
                mesh.write(part, file_format="vtu")
        _write_collection(target / f"{name}.pvd", moving[name], paths)
    if together:
        every = [paths * len(frames) if len(paths) == 1 else paths for paths in series.values()]
        _write_collection(collections[-1], frames, *every)
    return files


def meshes_of(frames: Frames) -> dict[str, Make]:
    """Functions that make the meshes of a run, by the names of their files."""
    hulls = any(frames.network.buoys[name].hull for name in frames.buoys)
    there = {"cable": frames.spans, "hull": hulls, "buoy": frames.buoys, "joint": frames.joints}
    makes = {"cable": cable_mesh, "hull": hull_mesh, "buoy": buoy_mesh, "joint": joint_mesh}
    found: dict[str, Make] = {name: makes[name] for name in makes if there[name]}
    if frames.scene.sea is not None:
        grid = water_grid(frames)
        found |= {"water": partial(water_mesh, *grid), "bed": partial(bed_mesh, grid[0])}
    return found


def _of_record(file: Path, make: Callable[..., Any], frame: Frame) -> Any:
    """Make a mesh from a record.  Raises InputError if it is damaged."""
    with fitting(file):
        return make(frame)


def read_run(folder: str | Path) -> tuple[xr.Dataset, Scene]:
    """(record, scene) of a run's folder.  Raises InputError if either is missing, or if they do not match."""
    folder = Path(folder)
    for name in ("results.nc", "scene.toml"):
        if not (folder / name).is_file():
            raise InputError(f"{folder} holds no run: there is no {name} in it.")
    record = read(folder / "results.nc")
    if not record.sizes.get("time"):
        raise InputError(f"{folder / 'results.nc'} is not the record of a run: compute it with dolfbuoy run.")
    scene = read_scene(folder)
    for kind, named in (("cable", scene.network.cables), ("buoy", scene.network.buoys)):
        if names_of(record, kind) != list(named):
            raise InputError(f"{folder / 'results.nc'} and scene.toml have not the same {kind}s: restore the scene.")
    return record, scene


def instants(record: xr.Dataset, scene: Scene) -> NDArray[Any]:
    """Times of the frames of the cable [s]; without a cable, of the rows selected by the scene's output interval."""
    if "frame" in record:
        return np.asarray(record.frame.values)
    times = record.time.values
    interval = frame_interval(scene) if scene.time is not None else times[-1] / LEAST_FRAMES
    if interval <= 0:
        return np.asarray(times)
    number = np.floor((times - times[0]) / interval * (1 + 1e-9) + 1e-6)
    chosen = np.concatenate([[True], np.diff(number) > 0])
    chosen[-1] = True
    return np.asarray(times[chosen])


def cable_mesh(frame: Frame) -> meshio.Mesh:
    """All cables, without parted elements: s, velocity, moment and curvature at nodes, tension of elements."""
    record, spans = frame.run.record, frame.run.spans
    first = np.concatenate([np.arange(span.node.start, span.node.stop - 1) for span in spans])
    cell = np.concatenate([np.repeat(np.arange(span.cell.start, span.cell.stop), span.per) for span in spans])
    first, cell = first[frame.whole[cell]], cell[frame.whole[cell]]
    nodes, cells = {"s [m]": record.s.values}, {"tension [N]": [frame.tension[cell]]}
    if "cable_velocity" in record:
        nodes["velocity [m/s]"] = record.cable_velocity.values[frame.number]
    nodes |= _fields(frame, "node", "frame") | _fields(frame, "node", "run")
    cells |= {field: [values[cell]] for field, values in _fields(frame, "cell", "run").items()}
    cells |= {
        field: [values[record.cable_of_cell.values[cell]]] for field, values in _fields(frame, "cable", "time").items()
    }
    cells |= {f"{name} [1]": [record[f"{name}_of_cell"].values[cell]] for name in ("cable", "segment")}
    return meshio.Mesh(frame.x, [("line", np.column_stack([first, first + 1]))], nodes, cells)


def hull_mesh(frame: Frame) -> meshio.Mesh:
    """Surfaces of all hulls, with their velocity and the number of the buoy."""
    points, quads, velocity, number, count = [], [], [], [], 0
    for k, buoy in enumerate(frame.buoys):
        if buoy.shape is None:
            continue
        surface, four = buoy.surface()
        points.append(surface)
        quads.append(four + count)
        number.append(np.full(len(four), k))
        count += len(surface)
        if buoy.spin is not None:
            velocity.append(buoy.velocity + np.cross(buoy.spin, surface - buoy.r_C))
    fields = {"velocity [m/s]": np.concatenate(velocity)} if velocity else {}
    cells = {"buoy [1]": [np.concatenate(number)]}
    return meshio.Mesh(np.concatenate(points), [("quad", np.concatenate(quads))], fields, cells)


def _fields(frame: Frame, kind: str, over: str) -> dict[str, NDArray[Any]]:
    """Values of the quantities shown for each buoy, cell, ..., by field name with unit."""
    record, every = frame.run.record, quantities.over(over).values()
    shown = [one for one in every if one.paraview and one.kind == kind and one.name in record]
    row = {"time": frame.row, "frame": frame.number}.get(over, ...)
    return {one.field: record[one.name].values[row] for one in shown}


def buoy_mesh(frame: Frame) -> meshio.Mesh:
    """The points C with the buoys' axes, velocities, mooring forces and recorded quantities, for glyphs."""
    record, count = frame.run.record, len(frame.buoys)
    fields = {"buoy [1]": np.arange(count), "axis [1]": np.array([buoy.R[:, 2] for buoy in frame.buoys])}
    if "linear_momentum" in record:
        fields["velocity [m/s]"] = np.array([buoy.velocity for buoy in frame.buoys])
        fields["angular velocity [rad/s]"] = np.array([buoy.spin for buoy in frame.buoys])
    if "mooring_force" in record:
        fields["mooring force [N]"] = pull = np.zeros((count, 3))
        on = np.array([force.buoy for force in frame.run.forces if force.kind == "pulls"], dtype=int)
        np.add.at(pull, on, record.mooring_force.values[frame.row])
    fields |= _fields(frame, "buoy", "time")
    return meshio.Mesh([buoy.r_C for buoy in frame.buoys], [("vertex", np.arange(count)[:, None])], fields)


def joint_mesh(frame: Frame) -> meshio.Mesh:
    """The joints as points, with their numbers in the record and the net weight of their bodies."""
    joints = frame.run.joints
    numbers = np.arange(len(joints))
    fields = {"joint [1]": numbers, "net weight [N]": np.array([mark.weight for mark in joints])}
    return meshio.Mesh(frame.x[[mark.node for mark in joints]], [("vertex", numbers[:, None])], fields)


def water_mesh(flat: NDArray[Any], quads: NDArray[Any], frame: Frame) -> meshio.Mesh:
    """Surface of the water on a `water_grid`, with its elevation and velocity."""
    points = np.column_stack([flat[:, :2], frame.elevation(flat)])
    fields = {"elevation [m]": points[:, 2].copy(), "velocity [m/s]": frame.flow(points)}
    return meshio.Mesh(points, [("quad", quads)], fields)


def bed_mesh(flat: NDArray[Any], frame: Frame) -> meshio.Mesh:
    """The sea bed below a `water_grid`."""
    corners = flat.reshape(-1, ROWS + 1, 3)[[0, -1, -1, 0], [0, 0, -1, -1]]
    return meshio.Mesh(frame.on_bed(corners), [("quad", [[0, 1, 2, 3]])])


#: Strips of the water across the waves, and quadrilaterals along a wavelength.
ROWS, PER_WAVELENGTH = 8, 24


def water_grid(frames: Frames) -> tuple[NDArray[Any], NDArray[Any]]:
    """Points (n, 3) with z = 0 and quadrilaterals (m, 4): a rectangle along the waves around all that is shown.

    The margin is a quarter of its extent, but at least half a wavelength and five metres.
    """
    waves = frames.scene.waves
    along = heading(waves.direction_deg if waves else 0.0)
    frame = np.array([along, [-along[1], along[0], 0.0]])
    seen = frames.places @ frame.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    length = 2 * np.pi / wavenumber(frames.scene) if waves else 0.0
    reach = max(0.25 * (high - low).max(), 0.5 * length, 5.0)
    low, high = low - reach, high + reach
    columns = int(np.clip(PER_WAVELENGTH * (high[0] - low[0]) / length, ROWS, 2000)) if length else ROWS
    a, b = np.meshgrid(np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], ROWS + 1), indexing="ij")
    i, j = np.meshgrid(np.arange(columns) * (ROWS + 1), np.arange(ROWS), indexing="ij")
    first = (i + j).ravel()
    quads = np.column_stack([first, first + ROWS + 1, first + ROWS + 2, first + 1])
    return a.reshape(-1, 1) * frame[0] + b.reshape(-1, 1) * frame[1], quads


def _write_collection(path: Path, frames: list[Frame], *series: Any) -> None:
    """Write a .pvd collection; series: lists of files, one per frame."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for frame, *files in zip(frames, *series, strict=True):
        for number, file in enumerate(files):
            ElementTree.SubElement(collection, "DataSet", timestep=repr(frame.time), part=str(number), file=file.name)
    ElementTree.indent(root)
    with replacing(path) as part:
        ElementTree.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)
