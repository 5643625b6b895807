"""The linear response to waves as a dataset, response.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .labelled import PARTS, complex_of, labelled
from .observe import attributes
from .parts import names_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from .labelled import Variable

MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
TENSIONS = ("tension_top", "tension_anchor")
#: Note wherever these numbers are shown.
LINEAR = (
    "Linear: standard deviations and amplitudes about the mean, no extremes; slack lines, snaps, a buoy under water "
    "and drift are not in it."
)
#: Note on a scene that moves the ends of its lines.
HELD = "Ends that the scene moves are held still: only the waves are in this response."


def dataset_of_response(
    seaway: Any,
    periods: NDArray[Any],
    small: NDArray[Any] | None,
    high: NDArray[Any] | None,
    height: float | None,
    sea: tuple[Any, Any] | None = None,
) -> xr.Dataset:
    """Amplitudes per metre over periods, in small waves and in waves of a height [m] (None: not requested).

    seaway: `linear.seaway.Seaway`.  small, high: its X (rows, periods).  sea: (`linear.spectrum.Bins`, its X) of an
    irregular one.
    """
    data: dict[str, Variable] = {"period": (("period",), periods, ("s", "period of the waves"))}
    for name, X, words in (("rao", small, "in small waves"), ("rao_drag", high, "in waves of this height")):
        if X is not None:
            data |= _amplitudes(seaway, name, X, words)
    means = _by_line(seaway, np.array([mean for mean, _ in seaway.tension_slopes().values()]))
    data["tension_mean"] = (("cable", "tension"), means, ("N", "tension at rest"))
    if sea is not None:
        data |= _irregular(seaway, *sea)
    labels: dict[str, Sequence[str]] = {"motion": MOTIONS, "part": PARTS, "tension": TENSIONS}
    labels["cable"] = [line.name for line in seaway.found.lines]
    if seaway.found.bodies:
        labels["buoy"] = [body.name for body in seaway.found.bodies]
    info = attributes(seaway.found.problem) | {"direction_deg": seaway.direction_deg, "comment": LINEAR}
    if high is not None:
        info["height_m"] = height
    return labelled(data, labels, info)


def _motions(seaway: Any, X: NDArray[Any]) -> NDArray[Any]:
    """(buoy, motion, ...)."""
    return np.array([np.array(motion) for motion in seaway.motions(X)])


def _by_line(seaway: Any, values: NDArray[Any]) -> NDArray[Any]:
    """(cable, tension, ...) of (tensions of a Seaway, ...); nan of a top that is free."""
    found = np.full((len(seaway.found.lines), len(TENSIONS), *values.shape[1:]), np.nan, dtype=values.dtype)
    for (what, cable), value in zip(seaway.tension_slopes(), values, strict=True):
        found[cable, TENSIONS.index(what)] = value
    return found


def _amplitudes(seaway: Any, name: str, X: NDArray[Any], words: str) -> dict[str, Variable]:
    found, tensions = {}, _by_line(seaway, seaway.tensions(X))
    if seaway.found.bodies:
        what = "m/m, rad/m", f"motions of C {words}"
        found[name] = (("buoy", "motion", "period", "part"), _motions(seaway, X), what)
    what = "N/m", f"tensions {words}"
    return found | {f"{name}_tension": (("cable", "tension", "period", "part"), tensions, what)}


def _irregular(seaway: Any, bins: Any, X: NDArray[Any]) -> dict[str, Variable]:
    """Spectra and standard deviations."""
    tensions = np.abs(_by_line(seaway, seaway.tensions(X))) ** 2
    elevation = bins.density(np.ones_like(bins.energy))
    spectra, deviations = bins.density(tensions), np.sqrt(tensions @ bins.energy)
    found = {
        "omega": (("omega",), bins.omega, ("rad s-1", "angular frequency")),
        "spectrum": (("omega",), elevation, ("m2 s rad-1", "spectral density of the elevation")),
        "tension_spectrum": (("cable", "tension", "omega"), spectra, ("N2 s rad-1", "of the tensions")),
        "tension_std": (("cable", "tension"), deviations, ("N", "standard deviation of the tensions")),
    }
    if seaway.found.bodies:
        motions = np.abs(_motions(seaway, X)) ** 2
        what = "m2 s/rad, rad2 s/rad", "spectral density of the motions"
        found["motion_spectrum"] = (("buoy", "motion", "omega"), bins.density(motions), what)
        what = "m, rad", "standard deviation of the motions"
        found["motion_std"] = (("buoy", "motion"), np.sqrt(motions @ bins.energy), what)
    return found


def each_buoy(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """(" of its name", empty for the only one, its part) of each buoy."""
    names = names_of(dataset, "buoy")
    return [(f" of {name}" if len(names) > 1 else "", dataset.sel(buoy=name)) for name in names]


def each_tension(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """(name, with that of the cable if there are several, its part) of each tension; not of tops that are free."""
    names = names_of(dataset, "cable")
    found = [
        (f"{what}_{name}" if len(names) > 1 else what, dataset.sel(cable=name, tension=what))
        for what in TENSIONS
        for name in names
    ]
    return [(name, one) for name, one in found if np.isfinite(one.tension_mean)]


def warnings(dataset: xr.Dataset) -> list[str]:
    """Warnings of a response that is no longer linear: a line goes slack."""
    found = []
    for name, one in each_tension(dataset):
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
