"""The record of a run: NetCDF-4, written during the run and readable even if the run is killed at any moment.

New rows are appended to a copy of the file, which then replaces it in one atomic step, so that the file on disk is
always complete, even on a full disk.
"""

from __future__ import annotations

import os
import shutil
import struct
import time as clock
import traceback
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import netCDF4, quick_start
from ..errors import InputError
from ..scene.mesh_file import check_hdf5
from ..writing import replacing
from .quantities import QUANTITIES, over

if TYPE_CHECKING:  # imported where it is used: with pandas it takes as long to load as dolfinx
    import xarray as xr

#: Coordinates of variables with these dimensions: arc lengths, and numbers of cable and segment.
ALONG = {"node": ("s", "cable_of_node"), "cell": ("s_cell", "cable_of_cell", "segment_of_cell")}
ALONG["place"] = ("place_s",)
LABELS = {"xyz": np.array(["x", "y", "z"]), "quaternion": np.array(["q0", "q1", "q2", "q3"])}
LABELED = {"xyz": "axes of the world, z up", "quaternion": "q0, and q = (q1, q2, q3)"}
LABELED |= {"cable": "names of the cables", "buoy": "names of the buoys", "joint": "names of the joints"}
LABELED |= {"attachment": "ends of cables on buoys, CABLE.from or CABLE.to"}
LABELED |= {"place": "places of [fatigue], CABLE at WHERE or CABLE.NUMBER at WHERE"}
LABELED |= {"anchor": "joints that are held, or CABLE.from or CABLE.to of other ends that are"}
LABELED |= {"take_off": "names of the power take-offs", "winch": "cables with a winch, or segments, CABLE.NUMBER"}
LABELED |= {"vessel": "names of the vessels with wind"}
LABELED |= {"segment": "cables with a breaking load, or of several segments those, CABLE.NUMBER"}
#: Attribute of all records: 2 since cables and buoys have a dimension even where there is only one.
FORMAT = 2
SEAL = b"dolfbuoy"  # followed by the CRC-32 of everything before it
DAMAGED = "is damaged, or not a record: compute it again with --overwrite."
UNFIT = "does not hold what its scene must have: it is damaged, or of another program."
CHUNK = 512  # rows of a series stored together in the file


def reserve(part: Path, size: int) -> None:
    """Reserve `size` more bytes on disk for a file.  Raises OSError if they are not available.

    HDF5 crashes at the end of the program once it has run out of space in the middle of an operation.
    """
    with open(part, "ab") as file:
        os.posix_fallocate(file.fileno(), file.tell(), size)


class Record:
    """Rows of named values written to one NetCDF file.

    path: the file, written by the calling rank.  attributes: global attributes.  fixed: values without time; only those
    that are `changing` may change.  labels: of the dimensions other than xyz and quaternion.  counts: rows on disk
    along `time` and `frame`.
    """

    def __init__(
        self,
        path: str | Path,
        attributes: dict[str, Any],
        fixed: dict[str, NDArray[Any]],
        labels: dict[str, NDArray[Any]],
    ) -> None:
        self.path, self.attributes, self.fixed = Path(path), dict(attributes), fixed
        self.labels = LABELS | labels
        self.counts = {"time": 0, "frame": 0}
        self.extremes: dict[str, NDArray[Any]] = {}  #: over all steps until the next `flush`, by name
        self._blocks: list[dict[str, NDArray[Any]]] = []
        self._started = clock.monotonic()

    @property
    def pending(self) -> bool:
        """True if added rows are not on disk yet."""
        return bool(self._blocks)

    def add(self, values: Mapping[str, Any]) -> None:
        """Add rows of the named values, (rows, ...) each; they are on disk after the next `flush`."""
        self._blocks.append({name: np.array(rows) for name, rows in values.items()})

    def series(self) -> xr.Dataset:
        """Added rows that are not on disk yet, and extremes, in the form returned by `read`; without frames."""
        import xarray as xr

        columns = {name: values for name, values in self._columns().items() if _axis(name) == "time"}
        data = {
            name: (("time", *QUANTITIES[name].dims), x, QUANTITIES[name].attributes()) for name, x in columns.items()
        }
        for name, x in self.extremes.items():
            along = {one: self.fixed[one] for one in ALONG.get(QUANTITIES[name].dims[0], ()) if one in self.fixed}
            data |= {one: (QUANTITIES[one].dims, values, {}) for one, values in (along | {name: x}).items()}
        data |= {name: (QUANTITIES[name].dims, self.fixed[name], QUANTITIES[name].attributes()) for name in self._begun}
        return xr.Dataset(data, _named(data, self.labels), self.attributes).set_coords("time")

    @property
    def _begun(self) -> list[str]:
        """Names of quantities read at the first instant."""
        return [name for name in self.fixed if QUANTITIES[name].read]

    def _columns(self) -> dict[str, NDArray[Any]]:
        """All rows not on disk yet, by name."""
        blocks = {name: [block[name] for block in self._blocks if name in block] for name in over("time", "frame")}
        return {name: np.concatenate(of_name) for name, of_name in blocks.items() if of_name}

    def flush(self) -> None:
        """Write all added rows to disk.  Raises OSError, and then leaves the file on disk unchanged."""
        fresh = self.counts["time"] == 0
        columns = self._columns()
        with replacing(self.path) as part:
            if not fresh:
                shutil.copyfile(self.path, part)
            whole = [*self.extremes.values(), *(self.fixed.values() if fresh else ())]
            reserve(part, _room(columns) + _length(self.attributes) + sum(v.nbytes for v in whole))
            with netCDF4.Dataset(part, "w" if fresh else "a") as file:
                if fresh:
                    self._define(file)
                for name, values in columns.items():
                    self._append(file, name, values)
                self._put_extremes(file)
                for name in (name for name in self.fixed if QUANTITIES[name].changing):
                    file.variables[name][:] = self.fixed[name]
                self.attributes["wall_time_s"] = clock.monotonic() - self._started
                known = {name: file.getncattr(name) for name in file.ncattrs()}
                file.setncatts({k: v for k, v in self.attributes.items() if k not in known or known[k] != v})
            seal(part)
        for axis in self.counts:
            self.counts[axis] += len(columns.get(axis, ()))
        self._blocks.clear()

    def take_up(self, counts: dict[str, int]) -> None:
        """Continue the record on disk, cut back to `counts` rows.  Raises InputError if it is shorter."""
        with netCDF4.Dataset(self.path) as old:
            old.set_auto_mask(False)
            lengths = {axis: len(old.dimensions[axis]) if axis in old.dimensions else 0 for axis in counts}
            if any(lengths[axis] < counts[axis] for axis in counts):
                raise InputError(f"{self.path} is shorter than at its checkpoint ({lengths['time']} rows).")
            with undamaged(self.path, UNFIT):
                self.attributes["created"] = str(old.created)
                self._started -= float(old.wall_time_s)
                if not all(name in old.variables for name in (*self.labels, *self.fixed)):
                    raise ValueError("labels or fixed values are missing")
                self.fixed |= {name: old.variables[name][:] for name in self._begun}
            if lengths != counts or "output" in old.dimensions:  # error bars hold for the whole run only
                self._copy(old, counts)
        self.counts = dict(counts)

    def lengths(self) -> dict[str, int]:
        """Numbers of rows added along `time` and `frame`, on disk or not."""
        pending = {axis: sum(_rows(block, axis) for block in self._blocks) for axis in self.counts}
        return {axis: self.counts[axis] + pending[axis] for axis in self.counts}

    def cut(self, lengths: dict[str, int]) -> bool:
        """Drop rows added after these `lengths`; True if some were on disk."""
        left, kept = {axis: lengths[axis] - self.counts[axis] for axis in self.counts}, []
        for block in self._blocks:
            taken = {axis: min(max(left[axis], 0), _rows(block, axis)) for axis in left}
            kept.append({name: rows[: taken[_axis(name)]] for name, rows in block.items() if taken[_axis(name)]})
            left = {axis: left[axis] - taken[axis] for axis in left}
        self._blocks = [block for block in kept if block]
        on_disk = {axis: min(lengths[axis], self.counts[axis]) for axis in lengths}
        if on_disk == self.counts:
            return False
        with netCDF4.Dataset(self.path) as old:
            old.set_auto_mask(False)
            self.counts = dict.fromkeys(self.counts, 0)
            self._copy(old, on_disk)
        self.counts = on_disk
        return True

    def _copy(self, old: Any, counts: dict[str, int]) -> None:
        """Write the record again with `counts` rows."""
        with replacing(self.path) as part:
            reserve(part, self.path.stat().st_size)
            with netCDF4.Dataset(part, "w") as file:
                self._define(file)
                for name in (n for n in old.variables if n in over("time", "frame")):
                    self._append(file, name, old.variables[name][: counts[_axis(name)]])
                self._put_extremes(file)
                file.setncatts({name: old.getncattr(name) for name in old.ncattrs() if not name.startswith("bar_")})
            seal(part)

    def _define(self, file: Any) -> None:
        file.createDimension("time", None)
        for name, labels in self.labels.items():
            file.createDimension(name, len(labels))
            variable = file.createVariable(name, str, (name,))
            variable.long_name = LABELED[name]
            variable[:] = labels.astype(object)
        for name, value in self.fixed.items():
            dimensions = QUANTITIES[name].dims
            if dimensions[0] not in file.dimensions:
                file.createDimension(dimensions[0], len(value))
            self._variable(file, name, dimensions)[:] = value
        if any(set(QUANTITIES[name].dims) & set(ALONG) for name in self.fixed):
            file.createDimension("frame", None)

    def _append(self, file: Any, name: str, rows: NDArray[Any]) -> None:
        if name not in file.variables:
            self._variable(file, name, (_axis(name), *QUANTITIES[name].dims))
        first = self.counts[_axis(name)]
        file.variables[name][first : first + len(rows)] = rows

    def _put_extremes(self, file: Any) -> None:
        for name, values in self.extremes.items():
            if name not in file.variables:
                self._variable(file, name, QUANTITIES[name].dims)
            file.variables[name][:] = values

    @staticmethod
    def _variable(file: Any, name: str, dimensions: Sequence[str]) -> Any:
        quantity = QUANTITIES[name]
        kind = "i4" if quantity.integer else "f8"
        sizes = [CHUNK if d == "time" else 1 if d == "frame" else len(file.dimensions[d]) for d in dimensions]
        variable = file.createVariable(name, kind, dimensions, chunksizes=sizes)
        variable.setncatts(quantity.attributes())
        along = [where for d in dimensions if quantity.over for where in ALONG.get(d, ())]
        if along:
            variable.coordinates = " ".join(along)
        return variable


def _named(data: Mapping[str, Any], labels: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """Coordinates with the names along the dimensions of these variables."""
    used = {dimension for dimensions, *_ in data.values() for dimension in dimensions}
    return {k: (k, labels[k], {"long_name": LABELED[k]}) for k in labels if k in used}


def _rows(block: Mapping[str, NDArray[Any]], axis: str) -> int:
    """Number of rows of a block along an axis."""
    return max((len(rows) for name, rows in block.items() if _axis(name) == axis), default=0)


def _axis(name: str) -> str:
    return QUANTITIES[name].over


def _room(columns: dict[str, NDArray[Any]]) -> int:
    """Upper bound of the bytes of these new rows in the file, with started chunks and HDF5 metadata."""
    size = 2**17
    for name, rows in columns.items():
        row = rows.nbytes // len(rows)
        size += rows.nbytes + (CHUNK * row if _axis(name) == "time" else 128 * len(rows))
    return size


def _length(attributes: dict[str, Any]) -> int:
    """Approximate number of bytes of attributes; a scene may be long."""
    return sum(len(str(value).encode()) for value in attributes.values())


def read(path: str | Path, own: bool = False) -> xr.Dataset:
    """Load a record into memory.  Raises InputError if it is damaged, or written by an older dolfbuoy.

    own: written entirely by this process, so that it cannot link to other files; checking loads h5py, which takes 30
    ms.
    """
    with quick_start():
        import xarray as xr

    if not own:
        verify(path)
    with undamaged(path, DAMAGED), xr.open_dataset(path, decode_times=False, engine="netcdf4") as dataset:
        return dataset.load()


def verify(path: str | Path) -> None:
    """Raise InputError for a record that is damaged, may crash HDF5, links to other files, or is too old."""
    with undamaged(path, DAMAGED):
        size = os.stat(path).st_size - len(SEAL) - 4
        with open(path, "rb") as sealed:  # a file without a seal passes
            checksum = _checksum(sealed, size)
            if sealed.read(len(SEAL)) == SEAL and struct.unpack("<I", sealed.read()) != (checksum,):
                raise ValueError("the checksum is another one")
        check_hdf5(Path(path))
        with netCDF4.Dataset(path) as file:
            found = {name: file.getncattr(name) for name in file.ncattrs()}
    check_format(found, str(path))


def check_format(attributes: dict[str, Any], name: str) -> None:
    """Raise InputError if these are attributes of a record written by an older dolfbuoy."""
    version = attributes.get("version_dolfbuoy")
    if version is not None and attributes.get("format") != FORMAT:
        raise InputError(
            f"{name} was written by an older dolfbuoy ({version}), without the dimensions cable and buoy that every "
            "record has now: compute it again, with --overwrite in the same folder."
        )


def put(path: str | Path, more: xr.Dataset) -> None:
    """Add variables without time to a finished record, or replace those of the same names.  Raises OSError."""
    with replacing(path) as part:
        shutil.copyfile(path, part)
        reserve(part, more.nbytes + 2**17 + _length(more.attrs))
        with netCDF4.Dataset(part, "a") as file:
            for name, size in more.sizes.items():
                if name not in file.dimensions:
                    file.createDimension(name, size)
            for name, variable in more.variables.items():
                kind = str if variable.dtype.kind == "O" else variable.dtype
                place = file.variables.get(name) or file.createVariable(name, kind, variable.dims)
                place.setncatts(variable.attrs)
                place[:] = variable.values
            file.setncatts(more.attrs)
        seal(part)


def seal(path: str | Path) -> None:
    """Append a checksum to a complete file, after the part that HDF5 reads."""
    with open(path, "r+b") as file:
        file.write(SEAL + struct.pack("<I", _checksum(file, os.fstat(file.fileno()).st_size)))


def _checksum(file: Any, size: int) -> int:
    """CRC-32 of the first `size` bytes of an open file, which is left positioned after them."""
    checksum = 0
    while size > 0:
        piece = file.read(min(size, 2**20))
        checksum, size = zlib.crc32(piece, checksum), size - len(piece)
    return checksum


@contextmanager
def undamaged(path: str | Path, otherwise: str) -> Iterator[None]:
    """Raise InputError, with the path and `otherwise`, for any library error on reading a damaged file."""
    try:
        yield
    except (FileNotFoundError, PermissionError, InputError):
        raise
    except Exception as error:  # zip, NumPy, HDF5, netCDF4 and xarray raise many kinds of errors
        raise InputError(f"{path} {otherwise}") from error


@contextmanager
def fitting(path: str | Path) -> Iterator[None]:
    """Raise InputError, with the path, for a record without a required variable, label or row.

    It shows as a failed look-up of a name in xarray, or as sizes that do not match.  All other errors are bugs of the
    program and pass through.
    """
    try:
        yield
    except InputError:
        raise
    except (LookupError, AttributeError, ValueError) as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        looked_up = frame.f_globals["__name__"].startswith(("xarray.", "pandas."))
        if isinstance(error, KeyError | AttributeError) and not looked_up:
            raise
        raise InputError(f"{path} {UNFIT}") from error


def nothing() -> xr.Dataset:
    """Empty record, for the ranks that do not hold it."""
    import xarray as xr

    return xr.Dataset()


def dataset_of(
    values: Mapping[str, Any], fixed: Mapping[str, Any], attributes: dict[str, Any], labels: dict[str, NDArray[Any]]
) -> xr.Dataset:
    """A record without time: variables without the dimensions time and frame, and coordinates."""
    import xarray as xr

    data, along = (
        {name: (QUANTITIES[name].dims, value, QUANTITIES[name].attributes()) for name, value in found.items()}
        for found in (values, fixed)
    )
    return xr.Dataset(data, coords=_named(data, LABELS | labels) | along, attrs=attributes)


def save(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a record without time.  Raises OSError."""
    with replacing(path) as part:
        reserve(part, dataset.nbytes + 2**17 + _length(dataset.attrs))
        unfilled = {name: {"_FillValue": None} for name in dataset.variables if dataset[name].dtype.kind == "f"}
        dataset.to_netcdf(part, engine="netcdf4", encoding=unfilled)
        seal(part)
