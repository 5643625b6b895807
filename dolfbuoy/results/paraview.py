"""Files for ParaView: the cable and the hull of a run, one mesh per recorded instant, and collections with times."""

import itertools
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from ..errors import InputError
from ..meshes import HullShape, write_line
from ..model.rigid import mass_properties, rotation_of
from .checkpoint import read_scene
from .folder import enlist
from .record import read


def export(folder: str | Path) -> list[Path]:
    """Write folder/paraview/ from the results.nc and scene.toml of a run; returns the files, collections last.

    cable_NNNN.vtu: nodes of the cable with s [m], and the tension [N] of its cells.  hull_NNNN.vtu: the hull where it
    is at that time.  cable.pvd, hull.pvd: what to open.  Raises InputError if the folder holds no run.
    """
    record, scene = read_run(folder)
    target, times = Path(folder) / "paraview", instants(record, scene)
    writers = {"cable": _cable_writer(record), "hull": _hull_writer(record, scene)}
    paths = {kind: [target / f"{kind}_{i:04d}.vtu" for i in range(len(times))] for kind in writers if writers[kind]}
    collections = {kind: target / f"{kind}.pvd" for kind in paths}
    files = [file for kind in paths for file in paths[kind]] + [*collections.values()]
    enlist(folder, files)
    target.mkdir(exist_ok=True)
    for kind, names in paths.items():
        for i, path in enumerate(names):
            writers[kind](path, i, times[i])
        _write_collection(collections[kind], times, names)
    return files


def read_run(folder: str | Path):
    """(record, scene) of a run's folder.  Raises InputError if there is none."""
    folder = Path(folder)
    for name in ("results.nc", "scene.toml"):
        if not (folder / name).is_file():
            raise InputError(f"{folder} holds no run: there is no {name} in it.")
    record = read(folder / "results.nc")
    if not record.sizes.get("time"):
        raise InputError(f"{folder / 'results.nc'} is not the record of a run: compute it with dolfbuoy run.")
    return record, read_scene(folder)


def instants(record, scene) -> np.ndarray:
    """Times [s] of the frames of the cable; without a cable, of the rows that the scene's output interval selects."""
    if "frame" in record:
        return record.frame.values
    times = record.time.values
    interval = times[-1] / 200
    if scene.time is not None and scene.time.output_every:
        interval = scene.time.output_every
    if interval <= 0:
        return times
    number = np.floor((times - times[0]) / interval * (1 + 1e-9) + 1e-6)
    chosen = np.concatenate([[True], np.diff(number) > 0])
    chosen[-1] = True
    return times[chosen]


def pose(record, time: float) -> tuple[np.ndarray, np.ndarray]:
    """(r_C, R) of the buoy at the recorded time nearest to `time` [s]."""
    row = int(np.abs(record.time.values - time).argmin())
    return record.buoy_position.values[row], rotation_of(record.buoy_orientation.values[row])


def hull_surface(stations, center: float, around: int = 48, cell: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) relative to C and quadrilaterals (m, 4) of the closed hull of revolution, upright.

    stations: (height, diameter) from the keel up.  center: height of C above the keel [m].  around: number of
    meridians.  cell: longest quadrilateral along a meridian [m].
    """
    outline = np.array([(h, d / 2) for h, d in stations], dtype=float)
    bottom, top = (outline[0, 0], 0.0), (outline[-1, 0], 0.0)
    outline = _refined(np.array([bottom, *outline, top]), cell)
    angle = 2 * np.pi * np.arange(around) / around
    z, r = outline[:, 0, None] - center, outline[:, 1, None]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), np.broadcast_to(z, (len(z), around))], axis=-1)
    ring, j = np.arange(len(outline) - 1)[:, None] * around, np.arange(around)
    following = (j + 1) % around
    quads = np.stack([ring + j, ring + following, ring + around + following, ring + around + j], axis=-1)
    return points.reshape(-1, 3), quads.reshape(-1, 4)


def _refined(outline, cell):
    """The outline with its pieces divided so that none is longer than `cell`; pieces of no length are left out."""
    points = [outline[:1]]
    for a, b in itertools.pairwise(outline):
        length = float(np.hypot(*(b - a)))
        count = int(np.ceil(length / cell)) if np.isfinite(cell) else 1
        if length > 0:
            points.append(a + (b - a) * np.arange(1, max(count, 1) + 1)[:, None] / max(count, 1))
    return np.concatenate(points)


def _cable_writer(record):
    if "cable_position" not in record:
        return None
    positions, tensions, s = (record[name].values for name in ("cable_position", "cable_tension", "s"))
    pieces = (positions.shape[1] - 1) // tensions.shape[1]  # straight pieces that an element is drawn with

    def write(path, i, _time):
        write_line(path, positions[i], {"s": s}, {"tension": [np.repeat(tensions[i], pieces)]})

    return write


def _hull_writer(record, scene):
    if "buoy_position" not in record or scene.buoy is None or scene.buoy.hull is None:
        return None
    shape = HullShape(tuple(scene.buoy.hull))
    points, quads = hull_surface(shape.stations, mass_properties(scene.buoy, shape).height)

    def write(path, _i, time):
        r_C, R = pose(record, time)
        meshio.Mesh(r_C + points @ R.T, [("quad", quads)]).write(path)

    return write


def _write_collection(path, times, files):
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for time, file in zip(times, files, strict=True):
        ElementTree.SubElement(collection, "DataSet", timestep=repr(float(time)), part="0", file=file.name)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path
