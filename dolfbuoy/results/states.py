"""Sentences about buoys that are not as a buoy should be: leaning far, capsized, under water."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.rigid import shape_of
from .parts import names_of, parts_of

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene
    from ..scene.buoy import Buoy

#: A cone angle that is called a lean, and one that is a capsize [deg].
LEAN, CAPSIZE = 45.0, 90.0
#: Part of its volume that a buoy has above the water at least, or it is under it.
LEAST_FREEBOARD = 1e-6


def states_of(record: xr.Dataset, scene: Scene) -> list[str]:
    """Sentences about the buoys of a run or an equilibrium, with their names if there are several."""
    found = []
    for name, part in zip(names_of(record, "buoy"), parts_of(record, "buoy"), strict=True):
        found += part.named(_lean(part.record) + _under(part.record, scene, scene.network.buoys[name]))
    return found


def is_under(displaced: Any, scene: Scene, buoy: Buoy) -> Any:
    """True if a buoy that displaces this mass of water [kg] is under water."""
    sea: Any = scene.sea
    hull: Any = shape_of(buoy)
    return displaced >= (1 - LEAST_FREEBOARD) * sea.density * hull.volume()


def _lean(record: xr.Dataset) -> list[str]:
    angle = np.atleast_1d(record.cone_angle.values)
    worst, largest = int(angle.argmax()), angle.max()
    if largest < LEAN:
        return []
    if "time" not in record.dims:
        return [f"The buoy {'is capsized' if largest >= CAPSIZE else 'leans'} at rest: {largest:.3g} degrees."]
    t = record.time.values
    if largest < CAPSIZE:
        return [f"The buoy leaned by up to {largest:.3g} degrees, at t = {t[worst]:g} s."]
    first = t[np.argmax(angle >= CAPSIZE)]
    return [
        f"The buoy capsized: it leaned by more than {CAPSIZE:g} degrees from t = {first:g} s on, up to {largest:.3g}."
    ]


def _under(record: xr.Dataset, scene: Scene, buoy: Buoy) -> list[str]:
    if scene.sea is None or "displaced_mass" not in record:
        return []
    displaced = np.atleast_1d(record.displaced_mass.values)
    under = is_under(displaced, scene, buoy)
    if not under.any():
        return []
    if "time" not in record.dims:
        return ["The buoy is all under water at rest."]
    share, first = 100 * under.mean(), record.time.values[np.argmax(under)]
    return [f"The buoy was all under water in {share:.2g} % of the instants, first at t = {first:g} s."]
