"""Files of numbers named by a scene: waves (spectra, components, records of the elevation) and motions.

They are read with the scene, under the rules of `mesh_file` for untrusted scenes.  The scene stores their numbers and
is complete without the files.
"""

import math
import os.path
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import AfterValidator, BeforeValidator, Field

from .mesh_file import Named, check_netcdf, inside
from .quantities import is_rising, number_of

FORMULAS = ("jonswap", "pierson-moskowitz")
MOST_BYTES = 20_000_000


def spectrum_of(value: Any) -> Any:
    """Value of `waves.spectrum`, with the name of a file replaced by its contents.  Raises ValueError."""
    name = value.name if isinstance(value, Named) else value
    if name in FORMULAS if isinstance(name, str) else not is_file(value):
        return name
    path = file_of(value, f"{' or '.join(map(repr, FORMULAS))}, a table, or the name of a file")
    return _directional(path) if is_netcdf(path) else _columns(path, 2)


def columns_of(count: int, allowed: str) -> Callable[[Any], Any]:
    """Validator of a key that may name a text file of `count` columns: replaces the name by its rows."""
    return lambda value: _columns(file_of(value, allowed), count) if is_file(value) else value


#: Most rows of a table over time, and most numbers of a variable of a netCDF file.
MOST_ROWS, MOST_NUMBERS = 200_000, 1_000_000
#: Units of time in netCDF files.
_SECONDS = {"s": 1.0, "seconds": 1.0, "minutes": 60.0, "hours": 3600.0, "days": 86400.0}


def rows_of(count: int) -> tuple[Any, ...]:
    """Constraints on a table of rows [t, ...] with t increasing, or the name of a text file of these columns."""

    def check(rows: list[Any]) -> list[Any]:
        if not is_rising([row[0] for row in rows]):
            raise ValueError("must hold rows with t increasing")
        return rows

    names = BeforeValidator(columns_of(count, "a table, or the name of a file"))
    return Field(min_length=1, max_length=MOST_ROWS), AfterValidator(check), names


def grid_of(value: Any) -> Any:
    """Value of `current.grid`, with the name of a file replaced by its rows [t, z, u, v].  Raises ValueError."""
    if not is_file(value):
        return value
    path = file_of(value, "a table, or the name of a file")
    return _stream(path) if is_netcdf(path) else _columns(path, 4)


def _check_size(found: Any, fits: bool, what: str, most: int = MOST_NUMBERS) -> None:
    """Raise ValueError for a variable that does not fit, or has too many numbers."""
    if not fits:
        raise ValueError(f"{what}, not over {found.dims}")
    if found.size > most:
        raise ValueError(f"{what} of at most {most} numbers, not {found.size}")


def _stream(path: Path) -> list[list[float]]:
    """u and v (or uo and vo, eastward and northward) of a netCDF file over time [s] and depth, or z, [m]."""
    import numpy as np
    import xarray as xr

    from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it

    check_netcdf(path)
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            u, v = (data[a if a in data else b].squeeze() for a, b in (("u", "uo"), ("v", "vo")))
            level = "depth" if "depth" in u.dims else "z"
            _check_size(u, set(u.dims) == {"time", level}, "u and v must be over time and depth, or z", MOST_ROWS)
            east, north = (x.transpose("time", level).values.astype(float).tolist() for x in (u, v))
            t, z = data["time"].values.astype(float), data[level].values.astype(float)
            t = t * _SECONDS.get(str(data["time"].attrs.get("units", "s")).split()[0], math.nan)
    except (OSError, KeyError, RuntimeError) as error:
        raise ValueError(f"its netCDF file must hold u and v over time and depth ({error})") from None
    if not np.isfinite(t).all():
        raise ValueError("time of its netCDF file must be in seconds, minutes, hours or days")
    t, z = t - t[0], -z if level == "depth" else z
    return [[float(t[i]), float(z[k]), east[i][k], north[i][k]] for i in range(len(t)) for k in range(len(z))]


#: Columns of a file of motions, with the names that each may have in a netCDF file.
MOTIONS = (("time", "t"), ("x", "surge"), ("y", "sway"), ("z", "heave"), ("roll",), ("pitch",), ("yaw",))


def motions_of(value: Any) -> Any:
    """Value of `vessel.motion`, with the name of a file replaced by its rows.  Raises ValueError."""
    if not is_file(value):
        return value
    path = file_of(value, "a table, or the name of a file")
    return _motions(path) if is_netcdf(path) else _columns(path, len(MOTIONS))


def _motions(path: Path) -> list[list[float]]:
    """time, x, y, z, roll, pitch, yaw of a netCDF file over time; angles in degrees unless their units are rad."""
    import numpy as np
    import xarray as xr

    from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it

    check_netcdf(path)
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            columns = []
            for names in MOTIONS:
                found = data[next((name for name in names if name in data.variables), names[0])]
                _check_size(found, found.ndim == 1, f"{names[0]} must be a series over time")
                is_radian = str(found.attrs.get("units", "")).startswith("rad")
                columns.append(found.values.astype(float) * (180 / np.pi if is_radian else 1.0))
    except (OSError, KeyError, RuntimeError) as error:
        raise ValueError(f"its netCDF file must hold time, x, y, z, roll, pitch, yaw ({error})") from None
    return [[float(x) for x in row] for row in zip(*columns, strict=True)]


def is_netcdf(path: Path) -> bool:
    """True if a file begins like netCDF."""
    with path.open("rb") as file:
        return file.read(4) in (b"\x89HDF", b"CDF\x01", b"CDF\x02", b"CDF\x05")


def is_file(value: Any) -> bool:
    """True if a value is the name of a file."""
    return isinstance(value, str | Path | Named)


def file_of(value: Any, allowed: str) -> Path:
    """The named file.  Raises ValueError if it is too large."""
    if isinstance(value, Named):
        path = inside(value.folder, value.name)
    elif os.path.isfile(value):
        path = Path(value)
    else:
        raise ValueError(f"must be {allowed}; file not found")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"its file must have {MOST_BYTES:,} bytes at most")
    return path


def _columns(path: Path, count: int) -> list[list[float]]:
    """Rows of a text file: numbers between blanks, commas or semicolons; # begins a comment; one line of names."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError):
        raise ValueError(f"its file must be text with {count} columns") from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            row = [number_of(word) for word in words]
        except ValueError:
            row = []
        if len(row) != count and (rows or row):
            raise ValueError(f"line {number} of its file must be {count} numbers")
        if row:
            rows.append(row)
    if not rows:
        raise ValueError(f"its file must hold rows of {count} numbers")
    return rows


def _directional(path: Path) -> dict[str, Any]:
    """efth(freq, dir) of a netCDF file, as in wavespectra: `dir` degrees from which waves come, clockwise from north;
    here x points east and y north, and directions are those of travel."""
    import numpy as np
    import xarray as xr

    from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it

    check_netcdf(path)
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            efth = data["efth"].squeeze()
            _check_size(efth, set(efth.dims) == {"freq", "dir"}, "efth must be one spectrum over freq and dir")
            efth = efth.transpose("freq", "dir").load()
            per_radian = "rad" in str(efth.attrs.get("units", ""))
            frequency, towards = efth["freq"].values, (270.0 - efth["dir"].values) % 360.0
    except (OSError, KeyError, RuntimeError) as error:
        raise ValueError(f"its netCDF file must hold efth(freq, dir) ({error})") from None
    rising, turned = np.argsort(frequency), np.argsort(towards)
    density = np.nan_to_num(efth.values.astype(float))[rising][:, turned] * (np.pi / 180 if per_radian else 1.0)
    found = {"frequency": frequency[rising], "direction_deg": towards[turned], "density": density}
    return {name: values.astype(float).tolist() for name, values in found.items()}
