"""Response of a floating body in potential flow, with coefficients from a Capytaine netCDF file."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it
from ..errors import InputError
from ..scene.mesh_file import check_netcdf
from ..scene.potential_flow import coefficients


@dataclass(frozen=True)
class PotentialFlow:
    """Coefficients of surge, heave and pitch over omega [rad/s]: (frequencies, 3, 3), force (frequencies, 3) complex.

    rotation_height: height of the rotation centre above still water [m]; None if the file does not give it.
    depth: water depth [m], inf in deep water.
    """

    omega: NDArray[Any]
    added_mass: NDArray[Any]
    damping: NDArray[Any]
    force: NDArray[Any]
    rotation_height: float | None
    depth: float

    @property
    def periods(self) -> list[float]:
        """Periods [s], longest first if frequencies increase."""
        return [float(T) for T in 2 * math.pi / self.omega]

    def responses(self, mass: tuple[float, float, float], stiffness: tuple[float, float, float]) -> NDArray[Any]:
        """Surge, heave and pitch per metre of amplitude at every period, complex (frequencies, 3).

        mass: (m, m, I) of the body [kg, kg, kg m^2].  stiffness: hydrostatic stiffness in surge, heave and pitch.
        """
        w = self.omega[:, None, None]
        A = np.diag(stiffness) - 1j * w * self.damping - w**2 * (np.diag(mass) + self.added_mass)
        return np.linalg.solve(A, self.force[:, :, None])[:, :, 0]


def read_capytaine(path: Path) -> PotentialFlow:
    """Coefficients for waves along x.  Raises InputError if the file cannot be read or does not contain them."""
    path = Path(path)
    try:
        if not path.is_file():
            raise FileNotFoundError("there is no such file")
        check_netcdf(path)
        with xr.open_dataset(path) as data:
            return _read(data, path)
    except InputError:
        raise
    except Exception as error:  # netCDF4, HDF5 and xarray raise many kinds of errors for a damaged file
        raise InputError(f"{path}: not a netCDF file of Capytaine ({str(error).rstrip('.')}).") from None


def _read(data: xr.Dataset, path: Path) -> PotentialFlow:
    data = data.sortby("omega")
    added_mass, damping, force, _ = coefficients(data)
    center = float(data.rotation_center.values[2]) if "rotation_center" in data.variables else None
    depth = float(data.water_depth.values) if "water_depth" in data.variables else math.inf
    found = PotentialFlow(data.omega.values.astype(float), added_mass, damping, force, center, depth)
    if not (np.all(found.omega > 0) and all(np.all(np.isfinite(x)) for x in (added_mass, damping, force))):
        raise InputError(f"{path}: holds frequencies or coefficients that are no finite positive numbers.")
    return found
