"""The record of a run: NetCDF-4, written as the run goes, readable after a kill at any moment.

New rows are appended to a copy of the file which then replaces it in one atomic step, so that the file on disk is
complete at every instant, on a full disk too.
"""

import os
import shutil
import struct
import time as clock
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..elsewhere import netCDF4
from ..errors import InputError
from ..scene.mesh_file import check_hdf5
from ..writing import replacing

if TYPE_CHECKING:  # imported where it is used: with pandas it takes as long to load as dolfinx, before the first step
    import xarray as xr

#: name: (dimensions after time or frame, unit, long name)
SERIES = {
    "time": ((), "s", "time"),
    "time_step": ((), "s", "step that led to this time"),
    "newton_iterations": ((), "1", "Newton iterations of that step"),
    "tension_top": (("cable",), "N", "tension at the upper end of the cable, |T_bnd|"),
    "tension_anchor": (("cable",), "N", "tension at the anchor, T_h(0)"),
    "anchor_force": (("cable", "xyz"), "N", "force that holds the lower end of the cable, s = 0"),
    "end_tension": (("cable", "xyz"), "N", "force that holds the upper end of the cable, T_bnd"),
    "utilisation": (("segment",), "1", "largest tension over the breaking load"),
    "length_on_bed": (("cable",), "m", "unstretched length of the cable on the sea bed"),
    "touchdown": (
        ("cable", "xyz"),
        "m",
        "where the cable leaves the sea bed towards its upper end; nan if nothing lies",
    ),
    "buoy_position": (("buoy", "xyz"), "m", "position of the buoy's centre of mass, r_C"),
    "buoy_orientation": (("buoy", "quaternion"), "1", "orientation of the buoy, q_4 = (q0, q), body to world"),
    "linear_momentum": (("buoy", "xyz"), "kg m s-1", "linear momentum of the buoy, p"),
    "angular_momentum": (("buoy", "xyz"), "kg m2 s-1", "angular momentum of the buoy about C, L_C (world frame)"),
    "cone_angle": (("buoy",), "degree", "angle between the vertical and the axis of the buoy"),
    "roll": (("buoy",), "degree", "turn of the buoy about its own x axis, after yaw and pitch"),
    "pitch": (("buoy",), "degree", "turn of the buoy about its y axis as the yaw leaves it"),
    "yaw": (("buoy",), "degree", "turn of the buoy about the vertical, before pitch and roll"),
    "mooring_point": (("attachment", "xyz"), "m", "mooring point, r_O"),
    "mooring_force": (("attachment", "xyz"), "N", "force of the cable on the buoy, T_O"),
    "joint_position": (("joint", "xyz"), "m", "position of the joints"),
    "surface_elevation": (("buoy",), "m", "water surface above C, eta(r_C, t)"),
    "displaced_mass": (("buoy",), "kg", "mass of the displaced water, M_D"),
    "buoyancy_center": (("buoy", "xyz"), "m", "centre of buoyancy, r_BC"),
    "submerged_length": (("buoy",), "m", "wetted length of the axis, H_sub"),
    "submerged_diameter": (("buoy",), "m", "mean diameter of the wetted hull, <D_sub>"),
}
FRAMES = {
    "frame": ((), "s", "time of a frame"),
    "cable_position": (("node", "xyz"), "m", "position of the cable's nodes, in order from the anchor"),
    "cable_velocity": (("node", "xyz"), "m s-1", "velocity of the cable's nodes, in order from the anchor"),
    "cable_tension": (("cell",), "N", "mean tension of each element, in order from the anchor"),
}
FIXED = {
    "s": (("node",), "m", "unstretched arc length of the nodes"),
    "s_cell": (("cell",), "m", "unstretched arc length of the middle of each element"),
    "cable_of_node": (("node",), "1", "number of the cable to which each node belongs, from 0"),
    "cable_of_cell": (("cell",), "1", "number of the cable to which each element belongs, from 0"),
    "segment_of_cell": (("cell",), "1", "number of the segment of its cable, from 0"),
    "growth_diameter": (("cell",), "1", "factor of marine growth on the diameter of each element"),
    "growth_mass": (("cell",), "1", "factor of marine growth on the mass of each element"),
    "growth_weight": (("cell",), "N", "weight in water that marine growth adds to each element"),
    "wave_amplitude": (("component",), "m", "amplitude of a component of the sea"),
    "wave_period": (("component",), "s", "its period"),
    "wave_direction_deg": (("component",), "degree", "direction towards which it runs, from x towards y"),
    "wave_phase_deg": (("component",), "degree", "its phase in a cos(k.x - omega t + phase)"),
}
#: Names that CF has for some of these; x of the body points to the fore, y to port.
STANDARD_NAMES = {
    "surface_elevation": "sea_surface_height_above_mean_sea_level",
    "roll": "platform_roll_starboard_down",
    "pitch": "platform_pitch_fore_down",
    "yaw": "platform_yaw_fore_port",
}
#: Where nodes and elements are along which cable: coordinates of what has these dimensions.
ALONG = {"node": ("s", "cable_of_node"), "cell": ("s_cell", "cable_of_cell", "segment_of_cell")}
LABELS = {"xyz": np.array(["x", "y", "z"]), "quaternion": np.array(["q0", "q1", "q2", "q3"])}
LABELED = {"xyz": "axes of the world, z up", "quaternion": "q0, and q = (q1, q2, q3)"}
LABELED |= {"cable": "names of the cables", "buoy": "names of the buoys", "joint": "names of the joints"}
LABELED |= {"attachment": "ends of cables on buoys, CABLE.from or CABLE.to"}
LABELED |= {"segment": "cables with a breaking load, or of several segments those, CABLE.NUMBER"}
#: Of all records, as an attribute: 2 since there is a dimension for cables and buoys also where there is one of them.
FORMAT = 2
INTEGERS = {"newton_iterations", "cable_of_node", "cable_of_cell", "segment_of_cell"}
SEAL = b"dolfbuoy"  # and CRC-32 of all that stands before it
DAMAGED = "is damaged, or not a record: compute it again with --overwrite."
UNFIT = "does not hold what its scene must have: it is damaged, or of another program."
CHUNK = 512  # rows of a series that lie together in the file


def reserve(part, size):
    """Claim `size` more bytes on the disk for a file.  Raises OSError when they are not to be had.

    HDF5, once it has run out of space in the middle of something, crashes at the end of the program.
    """
    with open(part, "ab") as file:
        os.posix_fallocate(file.fileno(), file.tell(), size)


class Record:
    """Rows of named values that go to one NetCDF file.

    path: the file; written by the rank that calls.  attributes: global attributes.  fixed: values without time.
    labels: of the dimensions beside xyz and quaternion.  counts: rows on disk along `time` and `frame`.
    """

    def __init__(self, path, attributes, fixed, labels):
        self.path, self.attributes, self.fixed = Path(path), dict(attributes), fixed
        self.labels = LABELS | labels
        self.counts = {"time": 0, "frame": 0}
        self._blocks: list[dict] = []
        self._started = clock.monotonic()

    @property
    def pending(self) -> bool:
        """Whether anything that was added is not on disk yet."""
        return bool(self._blocks)

    def add(self, values):
        """More rows of each of the named values, (rows, ...) each; on disk after the next `flush`."""
        self._blocks.append({name: np.array(rows) for name, rows in values.items()})

    def series(self) -> "xr.Dataset":
        """What was added and is not on disk yet, over time, as `read` would return it; without frames."""
        import xarray as xr

        columns = {name: values for name, values in self._columns().items() if name in SERIES}
        data = {name: (("time", *SERIES[name][0]), values, _attributes(name)) for name, values in columns.items()}
        return xr.Dataset(data, _named(data, self.labels), self.attributes).set_coords("time")

    def _columns(self):
        """All rows that are not on disk yet, by name."""
        blocks = {name: [block[name] for block in self._blocks if name in block] for name in (*SERIES, *FRAMES)}
        return {name: np.concatenate(of_name) for name, of_name in blocks.items() if of_name}

    def flush(self):
        """Bring everything that was added to the disk.  Raises OSError; what was on disk before stays there."""
        fresh = self.counts["time"] == 0
        columns = self._columns()
        with replacing(self.path) as part:
            if not fresh:
                shutil.copyfile(self.path, part)
            reserve(
                part, _room(columns) + _length(self.attributes) + sum(v.nbytes for v in self.fixed.values()) * fresh
            )
            with netCDF4.Dataset(part, "w" if fresh else "a", format="NETCDF4") as file:
                if fresh:
                    self._define(file)
                for name, values in columns.items():
                    self._append(file, name, values)
                self.attributes["wall_time_s"] = clock.monotonic() - self._started
                known = {name: file.getncattr(name) for name in file.ncattrs()}
                file.setncatts({k: v for k, v in self.attributes.items() if k not in known or known[k] != v})
            seal(part)
        for axis in self.counts:
            self.counts[axis] += len(columns.get(axis, ()))
        self._blocks.clear()

    def take_up(self, counts):
        """Go on with the record on disk, cut back to `counts` rows.  Raises InputError if it is shorter."""
        with netCDF4.Dataset(self.path) as old:
            old.set_auto_mask(False)
            lengths = {axis: len(old.dimensions[axis]) if axis in old.dimensions else 0 for axis in counts}
            if any(lengths[axis] < counts[axis] for axis in counts):
                raise InputError(f"{self.path} is shorter than at its checkpoint ({lengths['time']} rows).")
            self.attributes["created"] = old.created
            self._started -= old.wall_time_s
            if lengths != counts:
                self._copy(old, counts)
        self.counts = dict(counts)

    def _copy(self, old, counts):
        """Write the record again, as long as `counts`."""
        with replacing(self.path) as part:
            reserve(part, self.path.stat().st_size)
            with netCDF4.Dataset(part, "w", format="NETCDF4") as file:
                self._define(file)
                for name in (n for n in old.variables if n in SERIES or n in FRAMES):
                    self._append(file, name, old.variables[name][: counts[_axis(name)]])
                file.setncatts({name: old.getncattr(name) for name in old.ncattrs()})
            seal(part)

    def _define(self, file):
        file.createDimension("time", None)
        for name, labels in self.labels.items():
            file.createDimension(name, len(labels))
            variable = file.createVariable(name, str, (name,))
            variable.long_name = LABELED[name]
            variable[:] = labels.astype(object)
        for name, value in self.fixed.items():
            dimensions = FIXED[name][0]
            if dimensions[0] not in file.dimensions:
                file.createDimension(dimensions[0], len(value))
            self._variable(file, name, dimensions)[:] = value
        if any(set(FIXED[name][0]) & set(ALONG) for name in self.fixed):
            file.createDimension("frame", None)

    def _append(self, file, name, rows):
        if name not in file.variables:
            self._variable(file, name, (_axis(name), *{**SERIES, **FRAMES}[name][0]))
        first = self.counts[_axis(name)]
        file.variables[name][first : first + len(rows)] = rows

    @staticmethod
    def _variable(file, name, dimensions):
        kind = "i4" if name in INTEGERS else "f8"
        sizes = [CHUNK if d == "time" else 1 if d == "frame" else len(file.dimensions[d]) for d in dimensions]
        variable = file.createVariable(name, kind, dimensions, chunksizes=sizes)
        variable.setncatts(_attributes(name))
        along = [where for d in dimensions if name not in FIXED for where in ALONG.get(d, ())]
        if along:
            variable.coordinates = " ".join(along)
        return variable


def _named(data, labels):
    """Coordinates with the names of what these variables have dimensions of."""
    used = {dimension for dimensions, *_ in data.values() for dimension in dimensions}
    return {k: (k, labels[k], {"long_name": LABELED[k]}) for k in labels if k in used}


def _attributes(name):
    """Of a variable: unit, long name, and CF's name for it."""
    _, unit, long_name = {**SERIES, **FRAMES, **FIXED}[name]
    found = {"units": unit, "long_name": long_name}
    return found | ({"standard_name": STANDARD_NAMES[name]} if name in STANDARD_NAMES else {})


def _axis(name):
    return "time" if name in SERIES else "frame"


def _room(columns):
    """Bytes that these new rows may take in the file, with chunks begun and what HDF5 notes about them."""
    size = 2**17
    for name, rows in columns.items():
        row = rows.nbytes // len(rows)
        size += rows.nbytes + (CHUNK * row if _axis(name) == "time" else 128 * len(rows))
    return size


def _length(attributes):
    """Bytes of attributes, about; a scene may be long."""
    return sum(len(str(value).encode()) for value in attributes.values())


def read(path) -> "xr.Dataset":
    """Load a record into memory.  Raises InputError for a damaged one, or one of an older dolfbuoy."""
    import xarray as xr

    verify(path)
    with undamaged(path, DAMAGED), xr.open_dataset(path, decode_times=False, engine="netcdf4") as dataset:
        return dataset.load()


def verify(path) -> None:
    """Raise InputError for a record that is damaged, at which HDF5 may crash, whose numbers are in other files, or that
    is an old one."""
    with undamaged(path, DAMAGED):
        _check_seal(path)
        check_hdf5(path)
        with netCDF4.Dataset(path) as file:
            found = {name: file.getncattr(name) for name in file.ncattrs()}
    check_format(found, str(path))


def check_format(attributes, name: str) -> None:
    """Raise InputError for the attributes of a record that an older dolfbuoy wrote."""
    version = attributes.get("version_dolfbuoy")
    if version is not None and attributes.get("format") != FORMAT:
        raise InputError(
            f"{name} was written by an older dolfbuoy ({version}), without the dimensions cable and buoy that every "
            "record has now: compute it again, with --overwrite in the same folder."
        )


def seal(path) -> None:
    """Put a checksum behind the end of a file that is complete, where HDF5 does not look."""
    with open(path, "r+b") as file:
        file.write(SEAL + struct.pack("<I", _checksum(file, os.fstat(file.fileno()).st_size)))


def _check_seal(path):
    """Raise ValueError for a file that has changed since it was sealed; one without a seal passes."""
    size = os.stat(path).st_size - len(SEAL) - 4
    with open(path, "rb") as file:
        checksum = _checksum(file, size)
        if file.read(len(SEAL)) == SEAL and struct.unpack("<I", file.read()) != (checksum,):
            raise ValueError("the checksum is another one")


def _checksum(file, size):
    """CRC-32 of the first bytes of an open file, which is left behind them."""
    checksum = 0
    while size > 0:
        piece = file.read(min(size, 2**20))
        checksum, size = zlib.crc32(piece, checksum), size - len(piece)
    return checksum


@contextmanager
def undamaged(path, otherwise):
    """Raise InputError, with the path and `otherwise`, for whatever the libraries run into in a damaged file."""
    try:
        yield
    except (FileNotFoundError, PermissionError, InputError):
        raise
    except Exception as error:  # zip, NumPy, HDF5, netCDF4 and xarray have errors of many kinds for it
        raise InputError(f"{path} {otherwise}") from error


def nothing() -> "xr.Dataset":
    """The record on ranks that do not have it."""
    import xarray as xr

    return xr.Dataset()


def dataset_of(values, fixed, attributes, labels) -> "xr.Dataset":
    """A record without time: variables named as in SERIES and FRAMES, without their first dimension."""
    import xarray as xr

    known = {**SERIES, **FRAMES}
    data = {name: (known[name][0], value, _attributes(name)) for name, value in values.items()}
    named = _named(data, LABELS | labels)
    along = {name: (FIXED[name][0], value, _attributes(name)) for name, value in fixed.items()}
    return xr.Dataset(data, coords=named | along, attrs=attributes)


def save(dataset: "xr.Dataset", path) -> None:
    """Write a record without time.  Raises OSError."""
    with replacing(path) as part:
        reserve(part, dataset.nbytes + 2**17 + _length(dataset.attrs))
        unfilled = {name: {"_FillValue": None} for name in dataset.variables if dataset[name].dtype.kind == "f"}
        dataset.to_netcdf(part, engine="netcdf4", encoding=unfilled)
        seal(part)
