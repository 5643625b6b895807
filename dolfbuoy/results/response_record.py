"""The linear response to waves as a dataset, response.nc."""

from typing import TYPE_CHECKING

import numpy as np

from .observe import attributes

if TYPE_CHECKING:
    import xarray as xr

MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
PARTS = ("real", "imaginary")
#: What is said wherever these numbers are shown.
LINEAR = (
    "Linear: standard deviations and amplitudes about the mean, no extremes; slack lines, snaps, a buoy under water "
    "and drift are not in it."
)
#: What is said of a scene that moves the ends of its lines.
HELD = "Ends that the scene moves are held still: only the waves are in this response."


def dataset_of_response(seaway, periods, small, high, height, sea=None) -> "xr.Dataset":
    """Amplitudes per metre over periods, in small waves and in waves of a height [m] (None: not asked for).

    seaway: `linear.seaway.Seaway`.  small, high: its X (rows, periods).  sea: (`linear.spectrum.Bins`, its X) of an
    irregular one.
    """
    import xarray as xr

    data = {"period": ("period", periods, {"units": "s", "long_name": "period of the waves"})}
    for name, X, words in (("rao", small, "in small waves"), ("rao_drag", high, "in waves of this height")):
        if X is not None:
            data |= _amplitudes(seaway, name, X, words)
    slopes = seaway.tension_slopes()
    data["tension_mean"] = ("tension", np.array([mean for mean, _ in slopes.values()]), _said("N", "tension at rest"))
    if sea is not None:
        data |= _irregular(seaway, *sea)
    labels = {"motion": list(MOTIONS), "part": list(PARTS), "tension": list(slopes)}
    if len(seaway.found.bodies) > 1:
        labels["buoy"] = [body.name for body in seaway.found.bodies]
    info = attributes(seaway.found.problem) | {"direction_deg": seaway.direction_deg, "comment": LINEAR}
    if high is not None:
        info["height_m"] = height
    return xr.Dataset(data, labels, info)


def _said(unit, words):
    return {"units": unit, "long_name": words}


def _motions(seaway, X):
    """(motion, ...) of the only buoy, or (buoy, motion, ...); (0, ...) without one."""
    found = np.array([np.array(motion) for motion in seaway.motions(X)])
    return found[0] if len(found) == 1 else found


def _amplitudes(seaway, name, X, words):
    found, tensions = {}, seaway.tensions(X)
    dims = _dims(seaway)
    if dims:
        motions = _motions(seaway, X)
        found[name] = ((*dims, "period", "part"), _parts(motions), _said("m/m, rad/m", f"motions of C {words}"))
    said = _said("N/m", f"tensions {words}")
    return found | {f"{name}_tension": (("tension", "period", "part"), _parts(tensions), said)}


def _dims(seaway):
    bodies = seaway.found.bodies
    return () if not bodies else ("motion",) if len(bodies) == 1 else ("buoy", "motion")


def _parts(values):
    return np.stack([values.real, values.imag], axis=-1)


def _irregular(seaway, bins, X):
    """Spectra and standard deviations."""
    tensions = np.abs(seaway.tensions(X)) ** 2
    elevation = bins.density(np.ones_like(bins.energy))
    found = {
        "omega": ("omega", bins.omega, _said("rad s-1", "angular frequency")),
        "spectrum": ("omega", elevation, _said("m2 s rad-1", "spectral density of the elevation")),
        "tension_spectrum": (("tension", "omega"), bins.density(tensions), _said("N2 s rad-1", "of the tensions")),
        "tension_std": (
            ("tension",),
            np.sqrt(tensions @ bins.energy),
            _said("N", "standard deviation of the tensions"),
        ),
    }
    dims = _dims(seaway)
    if dims:
        motions = np.abs(_motions(seaway, X)) ** 2
        said = _said("m2 s/rad, rad2 s/rad", "spectral density of the motions")
        found["motion_spectrum"] = ((*dims, "omega"), bins.density(motions), said)
        said = _said("m, rad", "standard deviation of the motions")
        found["motion_std"] = (dims, np.sqrt(motions @ bins.energy), said)
    return found


def each_buoy(dataset) -> list[tuple[str, "xr.Dataset"]]:
    """(" of its name", its part) of each of several buoys; ("", all of it) of the only one, or without any."""
    if "buoy" not in dataset.dims:
        return [("", dataset)]
    return [(f" of {name}", dataset.sel(buoy=name)) for name in dataset.buoy.values.tolist()]


def complex_of(variable) -> np.ndarray:
    """Complex numbers of what has a dimension `part`, which is its last."""
    return variable.isel(part=0).values + 1j * variable.isel(part=1).values


def warnings(dataset) -> list[str]:
    """Where the response is no longer linear: a line that goes slack."""
    found = []
    for name in dataset.tension.values.tolist():
        one = dataset.sel(tension=name)
        if "tension_std" in one and 3 * one.tension_std.item() > one.tension_mean.item():
            found.append(
                f"{name}: three standard deviations, {3 * one.tension_std.item():.4g} N, are more than the mean, "
                f"{one.tension_mean.item():.4g} N: the line goes slack in this sea, which is not linear."
            )
        if "rao_drag_tension" in one:
            half = dataset.attrs["height_m"] / 2 * np.abs(complex_of(one.rao_drag_tension))
            over = dataset.period.values[half > one.tension_mean.item()]
            if len(over):
                reach = f"{over.min():g}" if len(over) == 1 else f"{over.min():g} to {over.max():g}"
                found.append(
                    f"{name}: in waves of {dataset.attrs['height_m']:g} m the amplitude is more than the mean at "
                    f"{reach} s: the line goes slack there, which is not linear."
                )
    return found
