"""Scatter of outputs due to uncertain parameters of a scene."""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..accuracy.outputs import Output, outputs_of, unit_of_series
from ..accuracy.target import USUAL, check_outputs
from ..api import simulate
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..parallel.cases import evaluate_all
from ..results.folder import keep, make_ready
from ..results.measured import window_start
from ..scene import Scene, load_scene
from ..scene.quantities import spread_of
from .derivatives import sensitivities
from .parameters import Parameter, parameters_of

if TYPE_CHECKING:
    import xarray as xr

METHODS = ("first", "chaos", "samples")
#: Number of runs that check the first-order method, and the least R^2 for a valid answer.
CHECKS, LEAST = 8, 0.8
#: Points of the expansion used for its 5 and 95 % quantiles; fraction of failed runs that may be left out.
POINTS, FAILED = 100_000, 0.1


@dataclass(frozen=True)
class Uncertain:
    """A parameter with its distribution; sigma: in its own unit."""

    parameter: Parameter
    kind: str
    sigma: float

    def x(self, xi: NDArray[Any]) -> NDArray[Any]:
        """Change of the Parameter, in its scale, for values xi of a standard normal variable."""
        p, sigma = self.parameter, self.sigma
        centre = 1.0 if math.isnan(p.value) else p.value
        if self.kind == "lognormal":
            s = math.sqrt(math.log1p((sigma / centre) ** 2))
            return np.asarray(centre * np.expm1(s * xi - s**2 / 2) / p.scale)
        if self.kind == "uniform":
            from scipy.stats import norm

            xi = math.sqrt(3) * (2 * norm.cdf(xi) - 1)
        return np.asarray(sigma * xi / p.scale)


def uncertain_of(scene: Scene) -> list[Uncertain]:
    """Parameters in the section [uncertain] of a scene.  Raises InputError."""
    if not scene.uncertain:
        raise InputError("uncertain: must be given, with the standard deviation of at least one number of the scene.")
    found = []
    for p, entry in zip(parameters_of(scene, list(scene.uncertain)), scene.uncertain.values(), strict=True):
        kind, sigma, relative = spread_of(entry)
        if kind == "lognormal" and not (math.isnan(p.value) or p.value > 0):
            raise InputError(f"uncertain.{p.key} = {entry!r}: a number with a lognormal distribution must be > 0.")
        if math.isnan(p.value) and not relative:
            raise InputError(f"uncertain.{p.key} = {entry!r}: a vector is varied by a factor, so it must end in %.")
        if relative and p.value == 0:
            raise InputError(f"uncertain.{p.key} = {entry!r}: of a number that is 0 it must be absolute.")
        found.append(Uncertain(p, kind, sigma * (p.scale if relative else 1.0)))
    return found


def uncertainty(
    scene: Scene | str | Path | dict[str, Any],
    method: str = "first",
    runs: int | None = None,
    of: Sequence[str] | None = None,
    out: str | Path | None = None,
    **overrides: Any,
) -> "xr.Dataset":
    """Mean, standard deviation, 5 and 95 % quantiles of outputs of a scene with a section [uncertain].

    method: "first", from derivatives of one run and `CHECKS` runs that check it; "chaos", an expansion of order 2 in
    Hermite polynomials, from twice as many runs as it has terms; "samples", a Latin hypercube (100).  runs: their
    number. of: outputs; default: largest tensions and lean.  out: folder for uncertain.nc and the runs, which are kept
    there, distributed over ranks and not computed again.

    Returns, on rank 0, over `output`: mean, sigma, p05, p95, and r2 of the model in runs not used to fit it; over
    (parameter, output): `share` of the variance due to that parameter alone.  If r2 < 0.8 the linear answer is nan.
    Raises InputError, and SolveError if the run or too many of its variants fail.
    """
    import tempfile

    base = load_scene(load_scene(scene, **overrides), accuracy=None)
    if method not in METHODS:
        raise InputError(f"--method {method}: must be one of {', '.join(METHODS)}.")
    check_outputs(base, of or (), "--of", every=True)
    numbers, comm = uncertain_of(base), MPI.COMM_WORLD
    terms = (len(numbers) + 1) * (len(numbers) + 2) // 2
    least = {"first": 2, "chaos": terms + 2, "samples": 4}[method]
    count = runs or {"first": CHECKS, "chaos": 2 * terms, "samples": 100}[method]
    if count < least:
        raise InputError(f"--runs {count}: must be at least {least} here.")
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return uncertainty(base, method, runs, of, comm.bcast(folder))
    make_ready(out, "uncertain", base, comm)
    xi = _hypercube(count, len(numbers))
    slopes = sensitivities(base, list(base.uncertain or ()), comm=comm) if method == "first" else None
    found = _computed(base, numbers, xi, Path(out))
    if comm.rank != 0:
        from ..results.record import nothing

        return nothing()
    dataset = _described(base, numbers, _of(found, of), xi, method, slopes)
    keep(out, "uncertain", base, dataset)
    return dataset


def _hypercube(count: int, size: int) -> NDArray[Any]:
    """Standard normal variables (count, size), each with one value in every `count`-th of its probability."""
    from scipy.stats import norm

    rng = np.random.default_rng(0)
    cells = np.column_stack([rng.permutation(count) for _ in range(size)])
    return np.asarray(norm.ppf((cells + rng.random((count, size))) / count))


def _computed(base: Scene, numbers: list[Uncertain], xi: NDArray[Any], folder: Path) -> list[dict[str, Any]]:
    """Outputs of the runs, one row each; rows of failed runs have "failed"."""
    x = np.column_stack([one.x(column) for one, column in zip(numbers, xi.T, strict=True)])
    digest = hashlib.sha256(json.dumps(base.to_dict(), sort_keys=True).encode()).hexdigest()[:20]
    cases = [{"base": digest, "x": row.tolist()} for row in x]
    return evaluate_all(partial(_evaluate, base, [one.parameter for one in numbers]), cases, folder) or []


def _evaluate(base: Scene, parameters: list[Parameter], case: dict[str, Any]) -> dict[str, Any]:
    scene = base
    try:
        for p, x in zip(parameters, case["x"], strict=True):
            scene = p.scene_at(scene, x)
        record = simulate(scene, comm=MPI.COMM_SELF)
    except (InputError, SolveError) as error:
        return {"failed": str(error)}
    found = outputs_of(record, window_start(scene))
    return {"outputs": [[*output, value] for output, value in found.items()]}


def _of(rows: list[dict[str, Any]], of: Sequence[str] | None) -> dict[Output, NDArray[Any]]:
    """Values of the requested outputs in all runs, nan in failed ones.  Raises SolveError if too many failed."""
    good = [row for row in rows if "outputs" in row]
    if len(good) < (1 - FAILED) * len(rows):
        raise SolveError(
            f"{len(rows) - len(good)} of {len(rows)} runs failed: {next(r['failed'] for r in rows if 'failed' in r)}"
        )
    found: dict[Output, NDArray[Any]] = {}
    for k, row in enumerate(rows):
        for *names, value in row.get("outputs", ()):
            output = Output(*names)
            if str(output) in (of or USUAL):
                found.setdefault(output, np.full(len(rows), np.nan))[k] = value
    if not found:
        raise InputError(f"--of: this scene has none of {', '.join(of or USUAL)}.")
    return found


def _described(base, numbers, values, xi, method, slopes):
    import xarray as xr

    columns: dict[str, list[Any]] = {name: [] for name in ("mean", "sigma", "p05", "p95", "r2")}
    shares = []
    for output, y in values.items():
        known = np.isfinite(y)
        if method == "first":
            row, share = _first(numbers, slopes, output, xi[known], y[known])
        elif method == "chaos":
            row, share = _chaos(xi[known], y[known])
        else:
            row, share = _sampled(xi[known], y[known])
        for name, value in zip(columns, row, strict=True):
            columns[name].append(value)
        shares.append(share)
    data = {name: ("output", np.array(column)) for name, column in columns.items()}
    data["share"] = (("parameter", "output"), np.array(shares).T)
    data["output_unit"] = ("output", np.array([unit_of_series(o.series) for o in values], dtype=object))
    coords = {
        "output": np.array([str(o) for o in values], dtype=object),
        "output_of": ("output", np.array([o.part for o in values], dtype=object)),
        "parameter": np.array([one.parameter.key for one in numbers], dtype=object),
    }
    attributes = {"title": base.title, "scene": base.to_toml(), "method": method, "runs": len(xi)}
    attributes["failed"] = len(xi) - int(np.isfinite(next(iter(values.values()))).sum())
    return xr.Dataset(data, coords, attributes)


def _first(numbers, slopes, output, xi, y):
    """First-order estimates from derivatives, checked by runs.  The mean is the value of the run."""
    at = np.flatnonzero((slopes.output.values == str(output)) & (slopes.output_of.values == output.part))[0]
    slope = slopes.d_output.values[:, at] * [one.parameter.scale for one in numbers]
    value = float(slopes.output_value.values[at])
    x = np.column_stack([one.x(column) for one, column in zip(numbers, xi.T, strict=True)])
    r2 = 1 - np.sum((y - value - x @ slope) ** 2) / np.sum((y - value) ** 2)
    parts = (slope * [one.sigma / one.parameter.scale for one in numbers]) ** 2
    sigma = math.sqrt(parts.sum())
    if r2 < LEAST:
        return (value, math.nan, math.nan, math.nan, r2), np.full(len(parts), math.nan)
    return (value, sigma, value - 1.6449 * sigma, value + 1.6449 * sigma, r2), parts / max(parts.sum(), 1e-300)


def _terms(size: int) -> list[tuple[int, ...]]:
    """Exponents of the polynomials of order up to 2 in `size` variables, the constant first."""
    units = np.eye(size, dtype=int)
    found = [np.zeros(size, dtype=int), *units]
    found += [units[i] + units[j] for i in range(size) for j in range(i, size)]
    return [tuple(e) for e in found]


def _basis(xi: NDArray[Any]) -> tuple[NDArray[Any], list[tuple[int, ...]]]:
    """Orthonormal Hermite polynomials at points (points, terms), and their exponents."""
    exponents = _terms(xi.shape[1])
    one = np.array([np.ones_like(xi), xi, (xi**2 - 1) / math.sqrt(2)])
    return np.column_stack([np.prod([one[e, :, k] for k, e in enumerate(es)], axis=0) for es in exponents]), exponents


def _chaos(xi, y):
    """Estimates from a least-squares fit; r2 by leave-one-out cross-validation."""
    basis, exponents = _basis(xi)
    c, *_ = np.linalg.lstsq(basis, y, rcond=None)
    hat = np.sum((basis @ np.linalg.pinv(basis.T @ basis)) * basis, axis=1)
    left_out = (y - basis @ c) / np.maximum(1 - hat, 1e-12)
    r2 = 1 - np.sum(left_out**2) / np.sum((y - y.mean()) ** 2)
    variance = float(np.sum(c[1:] ** 2))
    share = [
        sum(a**2 for a, e in zip(c, exponents, strict=True) if e[k] and not any(e[:k] + e[k + 1 :]))
        for k in range(xi.shape[1])
    ]
    points, _ = _basis(np.random.default_rng(1).standard_normal((POINTS, xi.shape[1])))
    low, high = np.percentile(points @ c, [5, 95])
    return (c[0], math.sqrt(variance), low, high, r2), np.array(share) / max(variance, 1e-300)


def _sampled(xi, y):
    """Estimates from samples; shares from correlations with each parameter, 0 for a constant output."""
    low, high = np.percentile(y, [5, 95])
    share = [np.corrcoef(column, y)[0, 1] ** 2 if np.ptp(y) else 0.0 for column in xi.T]
    return (y.mean(), y.std(ddof=1), low, high, math.nan), np.array(share)
