"""Parameters of a scene from measured series, by least squares with exact derivatives."""

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..results.folder import enlist, keep, make_ready
from ..results.measured import window_start
from ..results.quantities import QUANTITIES
from ..results.series import series_of
from ..scene import Scene, load_scene
from ..scene.quantities import number_of
from ..writing import write_text
from .accelerations import accelerations, arms_of
from .derivatives import of_run
from .parameters import Parameter, parameters_of

if TYPE_CHECKING:
    import xarray as xr

#: Correlation beyond which two parameters cannot be told apart, and largest size of a CSV file [bytes].
SAME, MOST_BYTES = 0.99, 100_000_000
#: Relative change at which a fit ends, and largest number of runs.
ENDS, MOST = 1e-6, 40
#: Residuals of a failed run, in standard deviations of the measurement, so that the step is rejected.
LOST = 1e3


class Measured(NamedTuple):
    """A measured series: its label, instants [s] and values; scale: divisor of its residuals."""

    label: str
    t: NDArray[Any]
    x: NDArray[Any]
    scale: float


@dataclass(frozen=True)
class Fit:
    """Result of `calibrate`; scene: with the estimates.

    dataset: over `parameter` estimate, deviation (one standard deviation), at_bound and `correlation`, over `sample`
    measured, computed, `series` and time; attributes: runs, residual (rms, relative to the scales of the series).
    """

    scene: Scene
    dataset: "xr.Dataset"
    sentences: list[str]


def calibrate(
    scene: Scene | str | Path | dict[str, Any],
    record: "xr.Dataset | str | Path",
    fit: Mapping[str, tuple[float, float]],
    of: Sequence[str] = ("tension_top",),
    noise: float | None = None,
    out: str | Path | None = None,
    point: Sequence[float] | None = None,
    offset: tuple[float, float] | None = None,
    **overrides: Any,
) -> Fit:
    """Estimate parameters of a scene within bounds by fitting its run to measured series after the ramp.

    record: of a run, or a CSV file with a column `time` [s] and one for each series.  fit: key -> (low, high); starts
    from the scene's value, or the middle if that is outside.  of: series, such as tension_top, buoy_position_z,
    "tension_top of port".  noise: standard deviation of the measurement, in its unit; default: that of the residuals.
    out: folder for calibrate.nc and calibrated.toml.  point: of the buoys, with its height above the keel [m]; series
    may then be its acceleration_x, _y and _z along the fixed axes, without gravity [m/s^2].  offset: bounds of the time
    by which the record's clock is ahead of the run's [s], which is then also estimated, as "time_offset".

    Trust-region method within bounds (scipy.optimize.least_squares); a step to a run that fails is rejected.  On one
    rank.  Raises InputError for an invalid scene, key or record, SolveError if the first run fails.
    """
    from scipy.optimize import least_squares

    base = load_scene(load_scene(scene, **overrides), accuracy=None)
    if MPI.COMM_WORLD.size > 1:
        raise InputError("A scene is calibrated on one rank.")
    if base.time is None:
        raise InputError("time: must be given, a run needs at least its keys end and step.")
    parameters, low, high, start = begin_of(base, fit, "--fit")
    if point is not None and (len(point) != 3 or not np.isfinite(point).all() or not base.network.buoys):
        raise InputError("--point: must be three finite numbers X,Y,Z [m], in a scene with a buoy.")
    if offset is not None:
        if not -math.inf < offset[0] < offset[1] < math.inf:
            raise InputError(f"--offset {offset[0]:g}..{offset[1]:g}: must be finite numbers that rise.")
        low, high = np.append(low, offset[0]), np.append(high, offset[1])
        start = np.append(start, 0.0 if offset[0] < 0 < offset[1] else sum(offset) / 2)
    measured = _measured(record, base, of, noise, point, offset or (0.0, 0.0))
    make_ready(out, "calibrate", base)
    model = _Model(base, parameters, measured, point, offset is not None)
    if model.residuals(start).max() >= LOST:
        raise SolveError(f"The first run of the fit fails: {model.reason}")
    found = least_squares(
        model.residuals,
        start,
        model.jacobian,
        (low, high),
        x_scale=np.maximum(high - low, 1e-300) / 4,
        xtol=ENDS,
        ftol=ENDS**1.5,
        gtol=1e-12,
        max_nfev=MOST,
    )
    fitted = model.scene_at(found.x)
    dataset, sentences = _described(model, found, low, high, noise)
    finish(dataset, base, fitted, out, "calibrate", "calibrated.toml")
    return Fit(fitted, dataset, sentences)


def finish(dataset: "xr.Dataset", base: Scene, found: Scene, out: str | Path | None, kind: str, name: str) -> None:
    """Add the scene found to the dataset, and write both to the folder, if any; name: file of the scene."""
    dataset.attrs |= {"title": base.title, "scene": found.to_toml()}
    if out is not None:
        keep(out, kind, base, dataset)
        enlist(out, [Path(out) / name], kind)
        write_text(Path(out) / name, found.to_toml())


def begin_of(
    base: Scene, fit: Mapping[str, tuple[float, float]], option: str
) -> tuple[list[Parameter], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """(parameters, lower bounds, upper bounds, start).  Raises InputError naming the option."""
    if not fit:
        raise InputError(f"{option}: must be given, KEY=LOW..HIGH.")
    bounds = np.array([tuple(map(float, pair)) for pair in fit.values()])
    for key, (low, high) in zip(fit, bounds, strict=True):
        if not -math.inf < low < high < math.inf:
            raise InputError(f"{option} {key}={low:g}..{high:g}: must be finite numbers that rise.")
    parameters = parameters_of(base, list(fit))
    for p in parameters:
        if math.isnan(p.value):
            raise InputError(f"{option} {p.key}: is a vector; name its entries, {p.key}.0 and so on.")
    low, high = bounds.T
    value = np.array([p.value for p in parameters])
    inside = (low < value) & (value < high)
    return parameters, low, high, np.where(inside, value, (low + high) / 2)


def _measured(record, base, of, noise, point, offset):
    """Series of a record within the run, after its ramp, for any allowed time offset.  Raises InputError."""
    found = (
        _of_csv(Path(record))
        if isinstance(record, str | Path) and Path(record).suffix == ".csv"
        else _of_record(record, base, point)
    )
    begin, end, chosen = window_start(base) + offset[1], base.time.end + offset[0], []
    for name in of:
        labels = [label for label in found if label == name or label.startswith(f"{name} of ")]
        if not labels:
            raise InputError(f"--of {name}: the record has {', '.join(list(found)[:30])}.")
        for label in labels:
            t, x = found[label]
            inside = (t >= begin - 1e-9) & (t <= end + 1e-9) & np.isfinite(x)
            if inside.sum() < 4:
                raise InputError(f"--of {name}: the record has fewer than 4 values from {begin:g} to {end:g} s.")
            chosen.append(Measured(label, t[inside], x[inside], noise or float(x[inside].std()) or 1.0))
    return chosen


def _of_record(record, base, point):
    from ..results.record import read

    if isinstance(record, str | Path) and not Path(record).is_file():
        raise InputError(f"--record {record}: must be a file, results.nc of a run or CSV with a column time.")
    dataset = read(record) if isinstance(record, str | Path) else record
    if "time" not in dataset:
        raise InputError(f"--record {record}: has no series over time.")
    found = {one.label: (one.t, one.x) for one in series_of(dataset)}
    if point is not None and "buoy_orientation" in dataset:
        found |= {label: (dataset.time.values, x) for label, x, _ in accelerations(dataset, arms_of(base, point))}
    return found


def _of_csv(path):
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"--record {path}: must have {MOST_BYTES // 1_000_000} MB at most.")
        with open(path, newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
        table = [[number_of(cell) for cell in row] for row in rows]
    except OSError as error:
        raise InputError(f"--record {path}: cannot be read: {error.strerror}.") from None
    except (ValueError, UnicodeDecodeError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"--record {path}: must hold a header and rows of numbers: {str(error).rstrip('.')}."
        ) from None
    names = [name.strip() for name in header]
    if "time" not in names or not table or any(len(row) != len(names) for row in table):
        raise InputError(
            f"--record {path}: needs a column time and, in every row, a number for each of {', '.join(names)}."
        )
    columns = np.array(table).T
    t = columns[names.index("time")]
    if np.any(np.diff(t) <= 0):
        raise InputError(f"--record {path}: its times must rise.")
    return {name: (t, x) for name, x in zip(names, columns, strict=True) if name != "time"}


class _Model:
    """Runs of a scene with other parameters, compared with the measurement.

    point: whose accelerations are compared, or None.  has_offset: True if the last value is the time offset.
    """

    def __init__(
        self,
        base: Scene,
        parameters: list[Parameter],
        measured: list[Measured],
        point: Sequence[float] | None,
        has_offset: bool,
    ) -> None:
        self.base, self.parameters, self.measured = base, parameters, measured
        self.point, self.has_offset = point, has_offset
        self.runs, self.reason = 0, ""
        self._known: dict[tuple[float, ...], Any] = {}

    def scene_at(self, values: NDArray[Any]) -> Scene:
        scene = self.base
        for p, value in zip(self.parameters, values[: len(self.parameters)], strict=True):
            scene = p.scene_at(scene, (float(value) - p.value) / p.scale)
        return scene

    def residuals(self, values: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(self._at(values)[0])

    def jacobian(self, values: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(self._at(values)[1])

    def _at(self, values):
        """(residuals, their derivatives by the values) at these values."""
        key = tuple(map(float, values))
        if key not in self._known:
            self._known[key] = self._computed(values)
        return self._known[key]

    def _computed(self, values):
        self.runs += 1
        try:
            scene = self.scene_at(values)
            here = parameters_of(scene, [p.key for p in self.parameters])
            dataset = of_run(scene, here, MPI.COMM_SELF)
        except (InputError, SolveError) as error:
            self.reason = str(error)
            count = sum(len(one.t) for one in self.measured)
            return np.full(count, LOST), np.zeros((count, len(values)))
        series, rows, slopes = dict(columns(dataset)), [], []
        if self.point is not None:
            series |= self._accelerations(scene, here, dataset)
        t, offset = dataset.time.values, float(values[-1]) if self.has_offset else 0.0
        for one in self.measured:
            label = (
                one.label
                if one.label in series
                else next((k for k in series if k.startswith(f"{one.label} of ")), None)
            )
            if label is None:
                raise InputError(f"--of {one.label}: the run has {', '.join(series)}.")
            x, slope = series[label]
            if self.has_offset:
                slope = [*slope, -np.gradient(x, t)]
            rows.append((np.interp(one.t - offset, t, x) - one.x) / one.scale)
            slopes.append(np.array([np.interp(one.t - offset, t, row) for row in slope]).T / one.scale)
        return np.concatenate(rows), np.concatenate(slopes)

    def _accelerations(self, scene, parameters, dataset):
        """label -> (accelerations of the point, derivatives by the parameters)."""
        slopes = {name: np.zeros((len(parameters), 3)) for name in scene.network.buoys}
        for k, p in enumerate(parameters):
            below, above = (arms_of(p.scene_at(scene, x), self.point) for x in (-p.distance, p.distance))
            for name, rows in slopes.items():
                rows[k] = (above[name] - below[name]) / (2 * p.distance * p.scale)
        found = accelerations(dataset, arms_of(scene, self.point), slopes)
        return {label: (x, rates) for label, x, rates in found}


def columns(dataset: "xr.Dataset") -> Iterator[tuple[str, tuple[NDArray[Any], Any]]]:
    """(label, (values, derivatives by the parameters)) of every series of a run with derivatives."""
    names = [name for name in dataset.data_vars if name in QUANTITIES and "time" in dataset[name].dims]
    base = dataset[names].drop_vars("parameter", errors="ignore")
    slopes = [
        row
        for name in names
        for row in np.moveaxis(
            dataset[f"d_{name}"].values.reshape(dataset.sizes["parameter"], dataset.sizes["time"], -1), 2, 0
        )
    ]
    for one, slope in zip(series_of(base), slopes, strict=True):
        yield one.label, (one.x, slope)


def inverse_of_squares(J: NDArray[Any]) -> NDArray[Any]:
    """(J^T J)^-1, computed with normalised columns, 0 where a column is 0.
    Otherwise the small derivatives by a stiffness in N, next to a coefficient, would be taken for rounding errors."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    found: NDArray[Any] = np.linalg.pinv((J / size).T @ (J / size)) / np.outer(size, size)
    return found


def _described(model, found, low, high, noise):
    """Dataset of estimates, their deviations and correlations, and sentences about them."""
    import xarray as xr

    more = ["time_offset"] if model.has_offset else []
    keys = np.array([*(p.key for p in model.parameters), *more], dtype=object)
    J, n = found.jac, len(found.x)
    free = max(1, len(found.fun) - n)
    variance = 1.0 if noise else 2 * found.cost / free
    covariance = variance * inverse_of_squares(J)
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(deviation, deviation))
    at_bound = found.active_mask != 0
    sentences = []
    for i in range(n):
        if at_bound[i]:
            sentences.append(f"{keys[i]} lies on its bound, {found.x[i]:.4g}: the best value is beyond it.")
        if not np.abs(J[:, i]).max() > 0:
            sentences.append(f"{keys[i]}: nothing that was measured depends on it.")
        for j in range(i):
            if abs(correlation[i, j]) > SAME:
                sentences.append(
                    f"{keys[j]} and {keys[i]} are not separable: their correlation is {correlation[i, j]:.4f}."
                )
    if not found.success:
        sentences.append(f"The fit has not ended after {model.runs} runs.")
    labels = np.concatenate([np.full(len(one.t), one.label, dtype=object) for one in model.measured])
    scale = np.concatenate([np.full(len(one.t), one.scale) for one in model.measured])
    measured = np.concatenate([one.x for one in model.measured])
    dataset = xr.Dataset(
        {
            "estimate": ("parameter", found.x),
            "deviation": ("parameter", deviation),
            "begin": ("parameter", np.array([*(p.value for p in model.parameters), *(0.0 for _ in more)])),
            "parameter_unit": (
                "parameter",
                np.array([*(p.unit for p in model.parameters), *("s" for _ in more)], dtype=object),
            ),
            "at_bound": ("parameter", at_bound),
            "correlation": (("parameter", "other"), correlation),
            "measured": ("sample", measured),
            "computed": ("sample", measured + found.fun * scale),
            "series": ("sample", labels),
            "time": ("sample", np.concatenate([one.t for one in model.measured])),
        },
        {"parameter": keys, "other": keys},
        {"runs": model.runs, "residual": float(np.sqrt(np.mean(found.fun**2)))},
    )
    return dataset, sentences
