"""Response of a floating body by potential flow: coefficients from a netCDF file of Capytaine.

The file holds, over omega, added_mass, radiation_damping and excitation_force (or Froude_Krylov_force and
diffraction_force, which it is the sum of), complex numbers along a dimension `complex` of real and imaginary part.
Capytaine's motions are Re[X exp(-i omega t)] in waves eta = Re[exp(i (k x - omega t))], as those of `response`.
"""

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

DOFS = ("Surge", "Heave", "Pitch")
_FORCES = ("excitation_force",), ("Froude_Krylov_force", "diffraction_force")


@dataclass(frozen=True)
class PotentialFlow:
    """Coefficients of surge, heave and pitch over omega [rad/s]: (frequencies, 3, 3), force (frequencies, 3) complex.

    rotation_height: of the point about which pitch is counted, above still water [m]; None if the file does not say.
    depth: of the water [m], inf in deep water.
    """

    omega: NDArray[Any]
    added_mass: NDArray[Any]
    damping: NDArray[Any]
    force: NDArray[Any]
    rotation_height: float | None
    depth: float

    @property
    def periods(self) -> list[float]:
        """[s], from the longest on if frequencies rise."""
        return [float(T) for T in 2 * math.pi / self.omega]

    def responses(self, mass: tuple[float, float, float], stiffness: tuple[float, float, float]) -> NDArray[Any]:
        """Surge, heave and pitch per metre of amplitude at every period, complex (frequencies, 3).

        mass: of the body, (m, m, I) [kg, kg, kg m^2].  stiffness: hydrostatic, of surge, heave and pitch.
        """
        w = self.omega[:, None, None]
        A = np.diag(stiffness) - 1j * w * self.damping - w**2 * (np.diag(mass) + self.added_mass)
        return np.linalg.solve(A, self.force[:, :, None])[:, :, 0]


def read_capytaine(path: Path) -> PotentialFlow:
    """Coefficients of waves along x.  Raises InputError if the file cannot be read or does not hold them."""
    path = Path(path)
    try:
        if not path.is_file():
            raise FileNotFoundError("there is no such file")
        check_netcdf(path)
        with xr.open_dataset(path) as data:
            return _read(data, path)
    except InputError:
        raise
    except Exception as error:  # netCDF4, HDF5 and xarray have errors of many kinds for a damaged file
        raise InputError(f"{path}: not a netCDF file of Capytaine ({str(error).rstrip('.')}).") from None


def _read(data: xr.Dataset, path: Path) -> PotentialFlow:
    names = next((names for names in _FORCES if set(names) <= set(data)), ())
    missing = {"added_mass", "radiation_damping"} - set(data) | (set() if names else {"excitation_force"})
    if missing:
        raise InputError(f"{path}: {', '.join(sorted(missing))} is missing; Capytaine writes it over omega.")
    data = data.sortby("omega")
    influenced, radiating = (_places(data, f"{kind}_dof", path) for kind in ("influenced", "radiating"))
    added_mass, damping = [
        data[name].transpose("omega", "influenced_dof", "radiating_dof").values[:, influenced][:, :, radiating]
        for name in ("added_mass", "radiation_damping")
    ]
    along = np.flatnonzero(np.abs(np.atleast_1d(data.wave_direction.values)) < 1e-9)
    if not len(along):
        raise InputError(f"{path}: has no waves along x (wave_direction 0).")
    excitation: Any = sum(_complex(data[name]) for name in names)
    force = excitation.values[:, along[0]][:, influenced]
    center = float(data.rotation_center.values[2]) if "rotation_center" in data.variables else None
    depth = float(data.water_depth.values) if "water_depth" in data.variables else math.inf
    found = PotentialFlow(data.omega.values.astype(float), added_mass, damping, force, center, depth)
    if not (np.all(found.omega > 0) and all(np.all(np.isfinite(x)) for x in (added_mass, damping, force))):
        raise InputError(f"{path}: holds frequencies or coefficients that are no finite positive numbers.")
    return found


def _complex(array: xr.DataArray) -> xr.DataArray:
    """re + i im of what is stored along `complex`, in the order omega, wave_direction, influenced_dof."""
    if "complex" in array.dims:
        array = array.isel(complex=0) + 1j * array.isel(complex=1)
    return array.transpose("omega", "wave_direction", "influenced_dof")


def _places(data: xr.Dataset, dimension: str, path: Path) -> list[int]:
    """Places of surge, heave and pitch; Capytaine puts a body's name before those of several bodies."""
    found = [str(name).split("__")[-1].lower() for name in data[dimension].values]
    missing = [dof for dof in DOFS if dof.lower() not in found]
    if missing:
        raise InputError(f"{path}: {dimension} lacks {', '.join(missing)}.")
    return [found.index(dof.lower()) for dof in DOFS]
