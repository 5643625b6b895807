"""Outputs of a run: maximum, minimum, mean and standard deviation of its series after the ramp."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..results.quantities import declared
from ..results.sample import lasts
from ..results.series import Series, begun, place_of, series_of

if TYPE_CHECKING:
    import xarray as xr

#: Statistics of a series, and for forces the level exceeded for a second.
NUMBERS = ("max", "min", "mean", "std")
LASTING = "lasting"
#: Magnitude of the force that holds the lower end of a cable.
ANCHOR = "anchor"


class Output(NamedTuple):
    """A statistic of a series: `tension_top`, `max`; part: name of the cable or buoy, empty if neither."""

    series: str
    number: str
    part: str = ""

    def __str__(self) -> str:
        return f"{self.series}.{self.number}"


def series_after(record: "xr.Dataset", start: float, end: float = math.inf) -> dict[tuple[str, str], Series]:
    """Series by (name, part) between two instants [s]: those with a curve, a row of the summary or a name."""
    found = {}
    for series in [*series_of(record), *_anchors(record)]:
        if series.label.startswith(f"{ANCHOR} of "):
            name, part = ANCHOR, series.label.removeprefix(f"{ANCHOR} of ")
        else:
            name, _, part = place_of(series.label)
        if name != ANCHOR and not declared(name).has_outputs:
            continue
        kept = (series.t >= start - 1e-9 * max(abs(start), 1.0)) & (series.t <= end * (1 + 1e-9))
        if kept.sum() > 2 and not np.isinf(series.x[kept]).all():  # such as the radius of a line that never bends
            found[name, part] = Series(series.label, series.t[kept], series.x[kept], series.noise)
    return found


def _anchors(record: "xr.Dataset") -> Iterator[Series]:
    if "anchor_force" not in record:
        return
    sizes = np.linalg.norm(record.anchor_force.values, axis=-1)
    for name, x in zip(record.cable.values.tolist(), sizes.T, strict=True):
        yield Series(f"{ANCHOR} of {name}", record.time.values, x, 1e-9 * sizes.max())


def numbers_of(series: Series) -> dict[str, float]:
    """Statistics of a series in its unit; extremes from a parabola through the extreme step and its neighbours.

    A series that is not finite everywhere, such as the radius of a line that is straight at times, has no "std".
    """
    if not np.isfinite(series.x).all():
        return {"max": series.maximum, "min": series.minimum, "mean": series.mean, "std": math.nan}
    return {
        "max": _vertex(series.t, series.x),
        "min": -_vertex(series.t, -series.x),
        "mean": series.mean,
        "std": series.standard_deviation,
    }


def outputs_of(record: "xr.Dataset", start: float) -> dict[Output, float]:
    """All outputs after an instant [s], with the lasting maximum of forces, and initial values as "max"."""
    found = {}
    for (name, part), one in series_after(record, start).items():
        found |= {Output(name, number, part): x for number, x in numbers_of(one).items()}
        if name != ANCHOR and lasts(one.label):
            found[Output(name, LASTING, part)] = one.lasting_maximum
    return found | {Output((place := place_of(one.label)).name, "max", place.part): one.mean for one in begun(record)}


def _vertex(t: np.ndarray, x: np.ndarray) -> float:
    """Largest value of x, at the vertex of the parabola through the highest step and its neighbours."""
    i = int(x.argmax())
    if not 0 < i < len(x) - 1:
        return float(x[i])
    before, after = (x[i] - x[i - 1]) / (t[i] - t[i - 1]), (x[i + 1] - x[i]) / (t[i + 1] - t[i])
    curvature = (after - before) / (t[i + 1] - t[i - 1])  # half of the second derivative
    if curvature == 0:
        return float(x[i])
    slope = before + curvature * (t[i] - t[i - 1])  # at the highest step
    return float(x[i] - slope**2 / (4 * curvature))


def unit_of_series(name: str) -> str:
    """Unit of a series by its name."""
    return "N" if name == ANCHOR else declared(name).unit
