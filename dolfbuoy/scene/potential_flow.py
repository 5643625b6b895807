"""Potential-flow coefficients of a hull of revolution, which replace the file named by a scene.

The file is a netCDF file of Capytaine over omega, also converted by Capytaine from WAMIT or Nemoh: added_mass,
radiation_damping, and excitation_force, or diffraction_force and Froude_Krylov_force, complex numbers along a dimension
`complex` of real and imaginary part.  Motions are Re[X exp(-i omega t)] in waves eta = Re[exp(i (k x - omega t))].
"""

from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, model_validator

from . import quantities as q
from .quantities import Wrong
from .section import Section, key
from .wave_files import file_of, is_file

if TYPE_CHECKING:
    import xarray as xr

DOFS = ("Surge", "Heave", "Pitch")
WHOLE, UNDISTURBED, DIFFRACTED = "excitation_force", "Froude_Krylov_force", "diffraction_force"
#: Quadratic form of (1, surge, heave, pitch) made by `formats.capytaine`.
MEAN_DRIFT = "mean_drift"
#: Fewest frequencies for a radiation memory; largest negative damping, as a fraction of the largest damping.
FEWEST, BELOW_ZERO = 12, 0.05
#: Part of the damping of surge, turned into another motion by their added masses, that counts as none.
NOTHING = 0.05
#: Part of the damping of surge, for pitch times the draft squared, that is rounding of panels.
ROUNDING = 1e-4

_size = Annotated[float, Field(ge=-1e15, le=1e15)]
Motions = Annotated[tuple[_size, _size, _size, _size], BeforeValidator(q.finite_numbers(4))]
Forces = Annotated[tuple[_size, _size, _size, _size, _size, _size], BeforeValidator(q.finite_numbers(6))]
Hermitian = Annotated[tuple[_size, ...], Field(min_length=16, max_length=16), BeforeValidator(q.finite_numbers(16))]
_many = Field(min_length=FEWEST, max_length=1000)


def _rising(values: list[float]) -> list[float]:
    if not q.is_rising(values):
        raise ValueError("must rise")
    return values


class PotentialFlow(Section):
    """Coefficients of a hull of revolution by linear potential flow, about a point of its axis, over frequency."""

    omega: Annotated[list[Annotated[float, Field(gt=0, le=1e3)]], _many, AfterValidator(_rising)] = key(
        "angular frequencies in ascending order", "rad/s"
    )
    added_mass: Annotated[list[Motions], _many] = key(
        "added mass [surge, heave, pitch, surge-pitch] at each of them", "kg, kg, kg m^2, kg m"
    )
    added_mass_infinite: Motions = key("the same at infinite frequency", "kg, kg, kg m^2, kg m")
    damping: Annotated[list[Motions], _many] = key(
        "radiation damping [surge, heave, pitch, surge-pitch]", "N s/m, N s/m, N m s, N s"
    )
    excitation: Annotated[list[Forces], _many] = key(
        "wave force per metre: real, imaginary part of surge, heave, pitch", "N/m, N/m, N"
    )
    froude_krylov: Annotated[list[Forces], _many] | None = key(
        "its part from the undisturbed wave; absent: that of the hull", "N/m, N/m, N", default=None
    )
    mean_drift: Annotated[list[Hermitian], _many] | None = key(
        "force of mean drift, a form in (1, surge, heave, pitch): re 4 x 4 above the diagonal, im below",
        "Pa, N/m, N",
        default=None,
    )
    height: q.Height = key("height of the point above still water", "m")
    draft: q.Length | None = key("draft of the hull; absent: as the buoy floats without lines", "m", default=None)
    depth: q.Length | None = key("water depth of the coefficients; absent: deep water", "m", default=None)
    density: q.Density | None = key("water density of the coefficients; absent: that of [sea]", "kg/m^3", default=None)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("added_mass", "damping", "excitation", "froude_krylov", MEAN_DRIFT):
            rows = getattr(self, name)
            if rows is not None and len(rows) != len(self.omega):
                raise Wrong(name, "...", f"must hold a row for each of the {len(self.omega)} frequencies")
        at_once, largest = self.added_mass_infinite, max(row[0] for row in self.damping)
        for place, dof in enumerate(DOFS):
            column = [row[place] for row in self.damping]
            like_surge = largest * abs(at_once[place] / (at_once[0] or 1.0))  # pitch may hardly radiate
            rounding = (
                ROUNDING * largest * (1.0 if dof != "Pitch" else (self.draft or 0.0) ** 2)
            )  # or not at all: a sphere
            if min(column) < -BELOW_ZERO * max(max(column), NOTHING * like_surge, rounding):
                allowed = f"must not be below 0, as that of {dof.lower()} is: a hull takes no energy from still water"
                raise Wrong("damping", "...", allowed)
        return self


def potential_flow_of(value: Any) -> Any:
    """Value of `buoy.potential_flow`, with the name of a file replaced by its contents.  Raises ValueError."""
    if not is_file(value):
        return value
    import xarray as xr

    from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it
    from .mesh_file import check_netcdf

    path = file_of(value, "a table, or the name of a netCDF file")
    check_netcdf(path)
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            return _read(data)
    except ValueError:
        raise
    except Exception as error:  # netCDF4, HDF5 and xarray raise many kinds of errors for a damaged file
        raise ValueError(f"its file must be a netCDF file of Capytaine ({str(error).rstrip('.')})") from None


def fault_of(data: "xr.Dataset") -> str:
    """The reason why a scene rejects a file with these coefficients, in words; empty if it does not."""
    try:
        PotentialFlow.model_validate(_read(data))
    except ValidationError as error:
        first = error.errors()[0]
        said = first.get("ctx", {}).get("error", first["msg"])
        return f"{said.key} {said.allowed}" if isinstance(said, Wrong) else str(said)
    except ValueError as error:
        return str(error)
    return ""


def coefficients(data: "xr.Dataset") -> tuple[Any, ...]:
    """Added mass and damping (omega, 3, 3), excitation and its Froude-Krylov part or None (omega, 3) in waves along x.

    For surge, heave and pitch, from a file of Capytaine.  Raises ValueError for missing data.
    """
    import numpy as np

    parts = {UNDISTURBED, DIFFRACTED} <= set(data)
    missing = {"added_mass", "radiation_damping"} - set(data) | ({WHOLE} if not parts else set()) - set(data)
    if missing:
        raise ValueError(f"{', '.join(sorted(missing))} is missing; Capytaine writes it over omega")
    influenced, radiating = (_places(data, f"{kind}_dof") for kind in ("influenced", "radiating"))
    motions = [
        data[name].transpose("omega", "influenced_dof", "radiating_dof").values[:, influenced][:, :, radiating]
        for name in ("added_mass", "radiation_damping")
    ]
    along = np.flatnonzero(np.abs(np.atleast_1d(data.wave_direction.values)) < 1e-9)
    if not len(along):
        raise ValueError("it has no waves along x (wave_direction 0)")

    def force(name: str) -> Any:
        return _complex(data[name]).values[:, along[0]][:, influenced]

    undisturbed = force(UNDISTURBED) if parts else None
    return *motions, force(UNDISTURBED) + force(DIFFRACTED) if parts else force(WHOLE), undisturbed


def _complex(array: "xr.DataArray") -> "xr.DataArray":
    """Complex numbers of a variable along `complex`, in the order omega, wave_direction, influenced_dof."""
    return _merged(array).transpose("omega", "wave_direction", "influenced_dof")


def _merged(array: "xr.DataArray") -> "xr.DataArray":
    return array.isel(complex=0) + 1j * array.isel(complex=1) if "complex" in array.dims else array


def _places(data: "xr.Dataset", dimension: str) -> list[int]:
    """Indices of surge, heave and pitch; with several bodies, Capytaine puts a body's name in front."""
    found = [str(name).split("__")[-1].lower() for name in data[dimension].values]
    missing = [dof for dof in DOFS if dof.lower() not in found]
    if missing:
        raise ValueError(f"{dimension} lacks {', '.join(missing)}")
    return [found.index(dof.lower()) for dof in DOFS]


def _read(data: "xr.Dataset") -> dict[str, Any]:
    """The table of a file."""
    import numpy as np

    data = data.squeeze([name for name in ("water_depth", "rho", "g", "body", "body_name") if name in data.dims])
    data = data.sortby("omega")
    omega = data.omega.values.astype(float)
    if not np.isinf(omega[-1]):
        raise ValueError("its file lacks omega = inf, the added mass at infinite frequency")
    center = np.zeros(3) if "rotation_center" not in data.variables else np.reshape(data.rotation_center.values, -1)
    if len(center) != 3 or np.abs(center[:2]).max() > 1e-6:
        raise ValueError("the rotation_center of its file must lie on the axis of the hull, x = y = 0")
    added_mass, damping, whole, undisturbed = coefficients(data)
    finite = slice(int(np.searchsorted(omega, 0.0, side="right")), -1)
    depth = float(data.water_depth.values) if "water_depth" in data.variables else np.inf
    found = {
        "omega": omega[finite],
        "added_mass": _four(added_mass[finite]),
        "added_mass_infinite": _four(added_mass[-1:])[0],
        "damping": _four(damping[finite]),
        "excitation": _six(whole[finite]),
        "froude_krylov": undisturbed if undisturbed is None else _six(undisturbed[finite]),
        MEAN_DRIFT: _sixteen(data)[finite] if MEAN_DRIFT in data else None,
        "height": center[2],
        "draft": data.attrs.get("draft"),
        "depth": depth if np.isfinite(depth) else None,
        "density": data.rho.values if "rho" in data.variables else None,
    }
    numbers = {name: np.asarray(value, dtype=float) for name, value in found.items() if value is not None}
    wrong = [name for name, value in numbers.items() if not np.all(np.isfinite(value))]
    if wrong:
        raise ValueError(f"its file must hold finite numbers, which those of {' and '.join(wrong)} are not")
    return {name: value.tolist() for name, value in numbers.items()}


def _four(matrices: Any) -> Any:
    """[surge, heave, pitch, surge-pitch] of symmetric matrices (omega, 3, 3)."""
    import numpy as np

    coupled = (matrices[:, 0, 2] + matrices[:, 2, 0]) / 2
    return np.column_stack([matrices[:, 0, 0], matrices[:, 1, 1], matrices[:, 2, 2], coupled])


def _six(force: Any) -> Any:
    """Real and imaginary parts of numbers (omega, 3)."""
    import numpy as np

    return np.stack([force.real, force.imag], axis=-1).reshape(len(force), 6)


def _sixteen(data: "xr.Dataset") -> Any:
    """Numbers of Hermitian 4 x 4 mean-drift matrices: real parts on and above the diagonal, imaginary parts below."""
    import numpy as np

    form = _merged(data[MEAN_DRIFT]).transpose("omega", "drift_row", "drift_column").values
    if form.shape[1:] != (4, 4):
        raise ValueError(f"its {MEAN_DRIFT} must be 4 x 4")
    return (np.triu(form.real) + np.tril(form.imag.swapaxes(1, 2), -1)).reshape(-1, 16)


def hermitian(rows: Any) -> Any:
    """Complex matrices (n, 4, 4) from rows of `mean_drift`."""
    import numpy as np

    numbers = np.array(rows).reshape(-1, 4, 4)
    above = np.triu(numbers) + 1j * np.tril(numbers, -1).swapaxes(1, 2)
    return above + np.triu(above, 1).conj().swapaxes(1, 2)
