"""The record of a run: NetCDF-4, written as the run goes, readable after a kill at any moment.

New rows are appended to a copy of the file which then replaces it in one atomic step, so that the file on disk is
complete at every instant.  This happens at most as often as it costs two percent of the run.
"""

import os
import shutil
import time as clock
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

#: name: (dimensions after time or frame, unit, long name)
SERIES = {
    "time": ((), "s", "time"),
    "time_step": ((), "s", "step that led to this time"),
    "newton_iterations": ((), "1", "Newton iterations of that step"),
    "tension_top": ((), "N", "tension at the upper end of the cable, |T_bnd|"),
    "tension_anchor": ((), "N", "tension at the anchor, T_h(0)"),
    "end_tension": (("xyz",), "N", "force that holds the upper end of the cable, T_bnd"),
    "buoy_position": (("xyz",), "m", "position of the buoy's centre of mass, r_C"),
    "buoy_orientation": (("quaternion",), "1", "orientation of the buoy, q_4 = (q0, q), body to world"),
    "linear_momentum": (("xyz",), "kg m s-1", "linear momentum of the buoy, p"),
    "angular_momentum": (("xyz",), "kg m2 s-1", "angular momentum of the buoy about C, L_C (world frame)"),
    "cone_angle": ((), "degree", "angle between the vertical and the axis of the buoy"),
    "mooring_point": (("xyz",), "m", "mooring point, r_O"),
    "mooring_force": (("xyz",), "N", "force of the cable on the buoy, T_O"),
    "surface_elevation": ((), "m", "water surface above C, eta(r_C, t)"),
    "displaced_mass": ((), "kg", "mass of the displaced water, M_D"),
    "buoyancy_center": (("xyz",), "m", "centre of buoyancy, r_BC"),
    "submerged_length": ((), "m", "wetted length of the axis, H_sub"),
    "submerged_diameter": ((), "m", "mean diameter of the wetted hull, <D_sub>"),
}
FRAMES = {
    "frame": ((), "s", "time of a frame"),
    "cable_position": (("node", "xyz"), "m", "position of the cable's nodes, in order from the anchor"),
    "cable_tension": (("cell",), "N", "mean tension of each element, in order from the anchor"),
}
FIXED = {
    "s": (("node",), "m", "unstretched arc length of the nodes"),
    "s_cell": (("cell",), "m", "unstretched arc length of the middle of each element"),
}
LABELS = {"xyz": np.array(["x", "y", "z"]), "quaternion": np.array(["q0", "q1", "q2", "q3"])}
INTEGERS = {"newton_iterations"}


class Record:
    """Rows of named values that go to one NetCDF file.

    path: the file; written by the rank that calls.  attributes: global attributes.  fixed: values without time.
    """

    def __init__(self, path, attributes, fixed):
        self.path, self.attributes, self.fixed = Path(path), dict(attributes), fixed
        self._rows: dict[str, list] = {}
        self._written: dict[str, int] = {}
        self._started = self._last_flush = clock.monotonic()
        self._flush_cost, self._created = 0.0, False

    def add(self, values):
        """One more row of each of the named values; written when it is time."""
        for name, value in values.items():
            self._rows.setdefault(name, []).append(value)
        due = max(1.0, 50 * self._flush_cost)
        if clock.monotonic() - self._last_flush > due:
            self.flush()

    def flush(self):
        """Bring everything that was added to the disk."""
        begin = clock.monotonic()
        part = self.path.with_name(f".{self.path.name}.part")
        if self._created:
            shutil.copyfile(self.path, part)
        with netCDF4.Dataset(part, "a" if self._created else "w", format="NETCDF4") as file:
            if not self._created:
                self._define(file)
            for name, rows in self._rows.items():
                self._append(file, name, np.array(rows))
            self.attributes["wall_time_s"] = clock.monotonic() - self._started
            file.setncatts(self.attributes)
        os.replace(part, self.path)
        self._created = True
        self._rows.clear()
        self._last_flush = clock.monotonic()
        self._flush_cost = self._last_flush - begin

    def _define(self, file):
        file.createDimension("time", None)
        for name, labels in LABELS.items():
            file.createDimension(name, len(labels))
            variable = file.createVariable(name, str, (name,))
            variable[:] = labels.astype(object)
        for name, value in self.fixed.items():
            (dimension,), unit, long_name = FIXED[name]
            file.createDimension(dimension, len(value))
            self._variable(file, name, (dimension,), unit, long_name)[:] = value
        if self.fixed:
            file.createDimension("frame", None)

    def _append(self, file, name, rows):
        axis, table = ("time", SERIES) if name in SERIES else ("frame", FRAMES)
        dimensions, unit, long_name = table[name]
        if name not in file.variables:
            self._variable(file, name, (axis, *dimensions), unit, long_name)
        first = self._written.get(name, 0)
        file.variables[name][first : first + len(rows)] = rows
        self._written[name] = first + len(rows)

    @staticmethod
    def _variable(file, name, dimensions, unit, long_name):
        kind = "i4" if name in INTEGERS else "f8"
        sizes = [512 if d == "time" else 1 if d == "frame" else len(file.dimensions[d]) for d in dimensions]
        variable = file.createVariable(name, kind, dimensions, chunksizes=sizes)
        variable.units, variable.long_name = unit, long_name
        return variable


def read(path) -> xr.Dataset:
    """Load a record into memory."""
    with xr.open_dataset(path, decode_times=False) as dataset:
        return dataset.load()


def dataset_of(values, fixed, attributes) -> xr.Dataset:
    """A record without time: variables named as in SERIES and FRAMES, without their first dimension."""
    data = {}
    for name, value in {**values, **fixed}.items():
        dimensions, unit, long_name = {**SERIES, **FRAMES, **FIXED}[name]
        data[name] = (dimensions, value, {"units": unit, "long_name": long_name})
    return xr.Dataset(
        data, coords={k: v for k, v in LABELS.items() if any(k in d[0] for d in data.values())}, attrs=attributes
    )
