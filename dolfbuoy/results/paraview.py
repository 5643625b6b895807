"""Files for ParaView: cable, hull, buoy, water and bed, one mesh per recorded instant, and collections with times."""

import itertools
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from ..errors import InputError
from ..meshes import line_mesh
from ..model.rigid import mass_properties, rotation_of, shape_of
from ..model.sea import elevation_at, heading, velocity_at, wavenumber
from ..model.seabed import height_of_bed
from ..scene.network import attached_ends
from ..writing import made, replacing
from .checkpoint import read_scene
from .folder import enlist, remarks
from .parts import names_of, parts_of
from .record import UNFIT, read, undamaged

#: Instants that are written unless others are asked for: each is a file of everything that moves.
INSTANTS = 50


def export(folder: str | Path, most: int = INSTANTS) -> list[Path]:
    """Write folder/paraview/ from the results.nc and scene.toml of a run; returns the files, collections last.

    One mesh per instant (cable_NNNN.vtu, ...), of `most` of them evenly from the first to the last that is recorded,
    and a collection to open (cable.pvd, ...) of each kind that the run has; names of fields have their units.  Of
    several cables or buoys each has its own, with its name behind that of the kind, and network.pvd shows all at once.
    Raises InputError if the folder holds no run.
    """
    record, scene = read_run(folder)
    target, recorded = Path(folder) / "paraview", instants(record, scene)
    chosen = np.linspace(0, len(recorded) - 1, min(most, len(recorded))).round().astype(int)
    times = recorded[chosen]
    with undamaged(Path(folder) / "results.nc", UNFIT):
        meshes = _meshes(record, scene)
    shown = {kind: times[:1] if kind in still(scene) else times for kind in meshes}
    paths = {kind: [target / f"{kind}_{i:04d}.vtu" for i in range(len(shown[kind]))] for kind in meshes}
    several = max(len(names_of(record, part)) for part in ("cable", "buoy")) > 1
    collections = {kind: target / f"{kind}.pvd" for kind in paths}
    collections |= {"": target / f"{NETWORK}.pvd"} if several else {}
    files = [file for kind in paths for file in paths[kind]] + [*collections.values()]
    made(folder, target.name)
    enlist(folder, files)
    of_before = remarks(folder, "run")["files"]
    for name in of_before:
        if name.startswith("paraview/") and Path(folder) / name not in files:
            (Path(folder) / name).unlink(missing_ok=True)
    for kind, names in paths.items():
        for i, path in enumerate(names):
            with undamaged(Path(folder) / "results.nc", UNFIT):
                mesh = meshes[kind](chosen[i], shown[kind][i])
            _write_mesh(mesh, path)
        _write_collection(collections[kind], shown[kind], names)
    if several:
        _write_collection(
            collections[""], times, *(names * len(times) if len(names) == 1 else names for names in paths.values())
        )
    return files


def _meshes(record, scene):
    """Name of files -> what makes their meshes of an instant's number and time."""
    network = scene.network
    found = {file_of("cable", part.label): cable_meshes(part.record) for part in parts_of(record, "cable")}
    for part in parts_of(record, "buoy"):
        name = part.record.buoy.item()
        buoy, pulled = network.buoys[name], _with_pull(record, part.record, network, name)
        found[file_of("hull", part.label)] = hull_meshes(part.record, buoy)
        found[file_of("buoy", part.label)] = buoy_meshes(pulled, buoy)
    found |= {kind: make(record, scene) for kind, make in TOGETHER.items()}
    return {name: of_instant for name, of_instant in found.items() if of_instant}


def file_of(kind: str, label: str) -> str:
    """Name of the files of a cable or a buoy; label: see `parts.Part`."""
    return f"{kind}_{label.replace('-', '_')}" if label else kind


def _with_pull(record, part, network, buoy):
    """A buoy's part of a record with the force of all lines on it."""
    mine = [i for i, (k, end) in enumerate(attached_ends(network)) if network.pieces[k].ends[end].name == buoy]
    return part.assign(mooring_force=record.mooring_force.isel(attachment=mine).sum("attachment")) if mine else part


def write_series(name: Path, times, meshes, announce) -> list[Path]:
    """Write meshes as name_0000.vtu and so on, with name.pvd that lists them; announce: told the files before."""
    paths = [name.parent / f"{name.name}_{i:04d}.vtu" for i in range(len(meshes))]
    collection = name.parent / f"{name.name}.pvd"
    announce([*paths, collection])
    made(name.parent.parent, name.parent.name)
    for path, mesh in zip(paths, meshes, strict=True):
        _write_mesh(mesh, path)
    return [*paths, _write_collection(collection, times, paths)]


def still(scene) -> set[str]:
    """What does not move: one mesh is enough."""
    return {"bed"} if scene.waves else {"bed", "water"}


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
    row = _row(record, time)
    return record.buoy_position.values[row], rotation_of(record.buoy_orientation.values[row])


def _row(record, time):
    """Of the recorded time nearest to `time`."""
    return int(np.abs(record.time.values - time).argmin())


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


# -- meshes of an instant ----------------------------------------------------------------------------------------------


def cable_meshes(record):
    """A cable with s and velocity at its nodes and the tension of its elements."""
    positions, tensions = record.cable_position.values, record.cable_tension.values
    pieces = (positions.shape[1] - 1) // tensions.shape[1]  # straight pieces that an element is drawn with

    def of_instant(i, _time):
        nodes = {"s [m]": record.s.values}
        if "cable_velocity" in record:
            nodes["velocity [m/s]"] = record.cable_velocity.values[i]
        cells = {"tension [N]": tensions[i]}
        cells |= {f"{name} [1]": record[f"{name}_of_cell"].values for name in ("cable", "segment")}
        return line_mesh(positions[i], nodes, {name: [np.repeat(of, pieces)] for name, of in cells.items()})

    return of_instant


def hull_meshes(record, buoy):
    """Surface of the hull of a buoy, a section, where it is, with its velocity; None without a hull."""
    shape = shape_of(buoy)
    if shape is None:
        return None
    points, quads = hull_surface(shape.stations, mass_properties(buoy, shape).height)

    def of_instant(_i, time):
        r_C, R = pose(record, time)
        arms, fields = points @ R.T, {}
        if "linear_momentum" in record:
            v, omega = velocities(record, buoy, time)
            fields["velocity [m/s]"] = v + np.cross(omega, arms)
        return meshio.Mesh(r_C + arms, [("quad", quads)], point_data=fields)

    return of_instant


#: Of the record, what is shown at C: name of the field with its unit.
AT_C = {
    "cone_angle": "cone angle [degree]",
    "roll": "roll [degree]",
    "pitch": "pitch [degree]",
    "yaw": "yaw [degree]",
    "mooring_force": "mooring force [N]",
    "displaced_mass": "displaced mass [kg]",
    "surface_elevation": "surface elevation [m]",
}


def buoy_meshes(record, buoy):
    """The point C with the buoy's axis, velocities and what the record has of AT_C, for glyphs."""

    def of_instant(_i, time):
        (r_C, R), row = pose(record, time), _row(record, time)
        fields = {"axis [1]": R[:, 2]}
        if "linear_momentum" in record:
            fields["velocity [m/s]"], fields["angular velocity [rad/s]"] = velocities(record, buoy, time)
        fields |= {field: record[name].values[row] for name, field in AT_C.items() if name in record}
        return meshio.Mesh([r_C], [("vertex", [[0]])], point_data={k: np.array([v]) for k, v in fields.items()})

    return of_instant


def joint_meshes(record, scene):
    """The joints as points, with their numbers in the record and the net weight of their bodies."""
    if "joint_position" not in record:
        return None
    network, density = scene.network, scene.sea.density if scene.sea else 0.0
    bodies = [network.bodies.get(name) for name in network.joints]
    weight = [scene.gravity * (body.mass - density * body.volume) if body else 0.0 for body in bodies]
    fields = {"joint [1]": np.arange(len(bodies)), "net weight [N]": np.array(weight)}
    vertices = [("vertex", np.arange(len(bodies))[:, None])]

    def of_instant(_i, time):
        return meshio.Mesh(record.joint_position.values[_row(record, time)], vertices, point_data=fields)

    return of_instant


def velocities(record, buoy, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of C [m/s] and angular velocity [rad/s] of the buoy, in the world frame, from its recorded momenta."""
    body = mass_properties(buoy, shape_of(buoy))
    (_, R), row = pose(record, time), _row(record, time)
    L = record.angular_momentum.values[row]
    return record.linear_momentum.values[row] / body.mass, R @ ((R.T @ L) / body.inertia)


def water_meshes(record, scene):
    """Surface of the water, in rows along the crests, with its elevation and velocity; None without a sea."""
    if scene.sea is None:
        return None
    flat, quads = water_grid(record, scene)

    def of_instant(_i, time):
        points = flat.copy()
        points[:, 2] = elevation_at(scene, time, flat)
        fields = {"elevation [m]": points[:, 2].copy(), "velocity [m/s]": velocity_at(scene, time, points)}
        return meshio.Mesh(points, [("quad", quads)], point_data=fields)

    return of_instant


def bed_meshes(record, scene):
    """The sea bed below the water that is shown; None without a sea."""
    if scene.sea is None:
        return None
    flat, _ = water_grid(record, scene)
    corners = flat.reshape(-1, ROWS + 1, 3)[[0, -1, -1, 0], [0, 0, -1, -1]]
    corners = np.column_stack([corners[:, :2], height_of_bed(scene, corners)])
    return lambda _i, _time: meshio.Mesh(corners, [("quad", [[0, 1, 2, 3]])])


#: Strips of the water across the waves, and quadrilaterals along a wavelength.
ROWS, PER_WAVELENGTH = 8, 24


def water_grid(record, scene) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) with z = 0 and quadrilaterals (m, 4): a rectangle along the waves around all that the record shows.

    It reaches beyond that by a quarter of its extent, at least half a wavelength or five metres.
    """
    along = heading(scene.waves.direction_deg if scene.waves else 0.0)
    frame = np.array([along, [-along[1], along[0], 0.0]])
    places = [record[name].values.reshape(-1, 3) for name in ("cable_position", "buoy_position") if name in record]
    seen = np.concatenate(places) @ frame.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    length = 2 * np.pi / wavenumber(scene) if scene.waves else 0.0
    reach = max(0.25 * (high - low).max(), 0.5 * length, 5.0)
    low, high = low - reach, high + reach
    columns = int(np.clip(PER_WAVELENGTH * (high[0] - low[0]) / length, ROWS, 2000)) if length else ROWS
    a, b = np.meshgrid(np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], ROWS + 1), indexing="ij")
    i, j = np.meshgrid(np.arange(columns) * (ROWS + 1), np.arange(ROWS), indexing="ij")
    first = (i + j).ravel()
    quads = np.column_stack([first, first + ROWS + 1, first + ROWS + 2, first + 1])
    return a.reshape(-1, 1) * frame[0] + b.reshape(-1, 1) * frame[1], quads


#: What all cables and buoys have together, name of the files: what makes their meshes from (record, scene), as a
#: function of the instant's number, time; the collection that shows all.
TOGETHER, NETWORK = {"joint": joint_meshes, "water": water_meshes, "bed": bed_meshes}, "network"


def _write_mesh(mesh, path):
    with replacing(path) as part:
        mesh.write(part, file_format="vtu")


def _write_collection(path, times, *series):
    """series: lists of files, one for each time."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for time, *files in zip(times, *series, strict=True):
        for part, file in enumerate(files):
            ElementTree.SubElement(collection, "DataSet", timestep=repr(float(time)), part=str(part), file=file.name)
    ElementTree.indent(root)
    with replacing(path) as part:
        ElementTree.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)
    return path
