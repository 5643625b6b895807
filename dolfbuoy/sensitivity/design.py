"""Parameters of a scene that minimise an expression while others stay within limits."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..accuracy.bars import NONE
from ..api import simulate
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..results.folder import make_ready
from ..results.measured import window_start
from ..results.series import OF_PART
from ..scene import Scene, load_scene, parse_assignment
from ..scene.quantities import number_of
from .calibration import begin_of, columns, finish
from .derivatives import of_run
from .expressions import Dual, Expression
from .parameters import Parameter, Size, parameters_of

if TYPE_CHECKING:
    import xarray as xr

#: Largest number of iterations; relative change at which a search ends; relative tolerance of a limit.
MOST, ENDS, MISSED = 60, 1e-7, 1e-4
#: Number of available sizes of library materials that are tried, starting from the nearest.
SIZES_TRIED = 4
#: Value of an output in a failed run, in multiples of its limit, so that the step is rejected.
LOST = 100.0
#: Ending of outputs that are soft maxima, and their sharpness.
SOFT, SHARP = ".soft_max", 60.0


@dataclass(frozen=True)
class Design:
    """Result of `design`; scene: with the parameters found.

    dataset: over `parameter` value and begin, over `limit` value, bound, active and multiplier (decrease of the minimum
    per unit increase of the limit); attributes: least, runs.
    """

    scene: Scene
    dataset: "xr.Dataset"
    sentences: list[str]


def design(
    scene: Scene | str | Path | dict[str, Any],
    vary: Mapping[str, tuple[float, float]] | None = None,
    least: str | None = None,
    hold: Sequence[str] | None = None,
    cases: Sequence[Mapping[str, Any]] | None = None,
    out: str | Path | None = None,
    **overrides: Any,
) -> Design:
    """Find parameters within bounds that minimise `least` subject to `hold`, by SLSQP with derivatives.

    vary: key -> (low, high).  least: an expression of keys and outputs (`expressions`).  hold: "EXPRESSION < LIMIT" or
    "EXPRESSION > LIMIT".  cases: load cases, each a set of changes of the scene; limits hold in all, and the largest
    `least` is minimised.  Defaults are those of the scene's section [design].  out: folder for design.nc and
    designed.toml.  On one rank.

    Raises InputError for an invalid expression, key or output, SolveError if the first run fails or if nothing is found
    that meets the limits.
    """
    base = load_scene(load_scene(scene, **overrides), accuracy=None)
    if MPI.COMM_WORLD.size > 1:
        raise InputError("A design is found on one rank.")
    given = base.design
    vary = vary or (given.vary if given else None) or {}
    least = least or (given.least if given else None)
    hold = hold or (given.hold if given else [])
    if not cases:
        texts = given.case if given else []
        cases = [dict(parse_assignment(part) for part in text.split(";")) for text in texts]
    if not least:
        raise InputError("--least: must be given, or least in the section [design] of the scene.")
    parameters, low, high, start = begin_of(base, vary, "--vary")
    search = _Search(base, parameters, Expression(least, "--least"), [_limit(text) for text in hold], cases)
    make_ready(out, "design", base)
    first = search.at(start)
    if search.reason:
        raise SolveError(f"The first run of the design fails: {search.reason}")
    best, ended = search.least_within(start, low, high, np.ones(len(start), dtype=bool), abs(first[0].value))
    best, ended = _in_sizes_made(search, best, ended, low, high)
    fitted = search.scene_at(best)
    dataset, sentences = _described(search, best, start, low, high)
    sentences += [] if ended is None else [f"The search has not ended: {ended}."]
    sentences += _within_bars(fitted, search, dataset)
    finish(dataset, base, fitted, out, "design", "designed.toml")
    return Design(fitted, dataset, sentences)


@dataclass(frozen=True)
class Limit:
    """The limit sign x (bound - expression) >= 0."""

    text: str
    expression: Expression
    bound: float
    sign: float

    @property
    def output(self) -> tuple[str, str] | None:
        """(output, part) if the expression is a single output of a run; part: empty for all parts."""
        name = self.expression.text.strip()
        output, _, part = name.partition("[")
        return (output, part.rstrip("]")) if list(self.expression.names) == [name] and "." in name else None


def _limit(text: str) -> Limit:
    left, sign, right = re.split(r"([<>])", text, maxsplit=1) if re.search("[<>]", text) else ("", "", "")
    try:
        bound = number_of(right.removeprefix("="))
    except ValueError:
        bound = math.nan
    if not left.strip() or not math.isfinite(bound):
        raise InputError(f'--hold {text}: must have the form "EXPRESSION < LIMIT" or "EXPRESSION > LIMIT".')
    return Limit(text.strip(), Expression(left, "--hold"), bound, 1.0 if sign == "<" else -1.0)


class _Search:
    """Values of the expressions for other parameters of a scene, in all load cases."""

    def __init__(self, base, parameters, least, limits, cases):
        self.base, self.parameters, self.least, self.limits = base, parameters, least, limits
        self.cases = list(cases) or [{}]
        self.runs, self.reason, self._known = 0, "", {}
        self._last: Any = None
        names = {name for e in (least, *(limit.expression for limit in limits)) for name in e.names}
        self._keys = {}
        for name in names:
            try:
                (self._keys[name],) = parameters_of(base, [name])
            except InputError:
                continue  # an output, or unknown: shows in the first run
        self.needs_run = any(name not in self._keys for name in names)
        if not {p.key for p in parameters} & {p.key for p in self._keys.values()} and not self.needs_run:
            raise InputError(f"--least {least.text}: nothing in it depends on what varies.")

    def least_within(self, start, low, high, free, scale):
        """Minimise the expression over the `free` parameters; returns them, and a message if not converged.

        scale: typical size of the expression.
        """
        from scipy.optimize import minimize

        width, scale = (high - low)[free], max(scale, 1e-300)

        def values_at(z):
            values = start.copy()
            values[free] = low[free] + z * width
            return values

        def constraint(k):
            limit = self.limits[k]
            size = max(abs(limit.bound), 1e-300)
            return {
                "type": "ineq",
                "fun": lambda z: (limit.bound - self.at(values_at(z))[1][k].value) * limit.sign / size,
                "jac": lambda z: -self.at(values_at(z))[1][k].slope[free] * width * limit.sign / size,
            }

        found = minimize(
            lambda z: self.at(values_at(z))[0].value / scale,
            (start - low)[free] / width,
            jac=lambda z: self.at(values_at(z))[0].slope[free] * width / scale,
            bounds=[(0.0, 1.0)] * int(free.sum()),
            constraints=[constraint(k) for k in range(len(self.limits))],
            method="SLSQP",
            options={"maxiter": MOST, "ftol": ENDS},
        )
        return values_at(np.clip(found.x, 0, 1)), None if found.success else found.message

    def room(self, values):
        """Relative margin of each limit at these values."""
        bounds = np.array([limit.bound for limit in self.limits])
        found = np.array([one.value for one in self.at(values)[1]])
        signs = np.array([limit.sign for limit in self.limits])
        return signs * (bounds - found) / np.maximum(np.abs(bounds), 1e-300)

    def scene_at(self, values):
        scene = self.base
        for p, value in zip(self.parameters, values, strict=True):
            scene = p.scene_at(scene, (float(value) - p.value) / p.scale)
        return scene

    def at(self, values):
        """(least, [limits]) as Duals, each the worst of all load cases."""
        key = tuple(map(float, values))
        if key not in self._known:
            self._known[key] = self._computed(np.array(values))
        return self._known[key]

    def _computed(self, values):
        try:
            scene = self.scene_at(values)
            found = [self._of_case(load_scene(scene, **case), values) for case in self.cases]
        except SolveError as error:
            self.reason = str(error)
            return self._lost(values)
        least = max((one for one, _ in found), key=lambda d: d.value)
        rows = zip(*(limits for _, limits in found), strict=True)
        limits = [max(row, key=lambda d, s=lim.sign: s * d.value) for row, lim in zip(rows, self.limits, strict=True)]
        self._last = least, limits
        return least, limits

    def _lost(self, values):
        if self._last is None:
            return Dual(math.inf, np.zeros(len(values))), [Dual(math.inf, np.zeros(len(values))) for _ in self.limits]
        least, limits = self._last
        far = [
            Dual(lim.bound + lim.sign * LOST * abs(lim.bound or 1.0), d.slope)
            for lim, d in zip(self.limits, limits, strict=True)
        ]
        return Dual(least.value + LOST * abs(least.value), least.slope), far

    def _of_case(self, scene, values):
        dataset, parameters = None, parameters_of(scene, [p.key for p in self.parameters])
        if self.needs_run:
            self.runs += 1
            dataset = of_run(scene, parameters, MPI.COMM_SELF)

        def value_of(name):
            if name in self._keys:
                return _number(scene, name, parameters)
            return _soft(dataset, name, window_start(scene)) if SOFT in name else _output(dataset, name)

        size = len(values)
        return self.least.at(value_of, size), [limit.expression.at(value_of, size) for limit in self.limits]


def _number(scene: Scene, name: str, parameters: Sequence[Parameter]) -> Dual:
    """A number of a scene with its slopes, also by a size of a library material, which changes several numbers."""
    (here,) = parameters_of(scene, [name])

    def slope(p: Parameter) -> float:
        if not isinstance(p, Size):
            return float(p.key == here.key)
        below, above = (parameters_of(p.scene_at(scene, x), [name])[0].value for x in (-p.distance, p.distance))
        return (above - below) / (2 * p.distance * p.scale)

    return Dual(here.value, np.array([slope(p) for p in parameters]))


def _output(dataset: "xr.Dataset", name: str) -> Dual:
    """An output of a run; without a part's name, the largest of all parts (the smallest for `.min`)."""
    output, _, part = name.partition("[")
    names, parts = dataset.output.values.astype(str), dataset.output_of.values.astype(str)
    there = np.flatnonzero((names == output) & ((parts == part.rstrip("]")) if part else True))
    if not len(there):
        raise InputError(
            f"{name}: is neither a number of this scene nor an output of its run ({', '.join(dict.fromkeys(names))})."
        )
    values = dataset.output_value.values[there]
    at = there[values.argmin() if output.endswith(".min") else values.argmax()]
    return Dual(float(dataset.output_value.values[at]), dataset.d_output.values[:, at])


def _soft(dataset: "xr.Dataset", name: str, begin: float) -> Dual:
    """Soft maximum m (1 + log(mean of exp(60 (x/m - 1)))/60) of a series x after the ramp, m = max x.

    It changes smoothly when another crest becomes the largest, and is lower for narrow crests.
    """
    output, _, part = name.partition("[")
    of = output.removesuffix(SOFT) + (f"{OF_PART}{part.rstrip(']')}" if part else "")
    late, found = dataset.time.values >= begin - 1e-9, []
    for label, (x, slopes) in columns(dataset):
        if label == of or (not part and label.startswith(of + OF_PART)):
            x, slopes = x[late], np.asarray(slopes)[:, late]
            m = float(x.max())
            if not m > 0:
                raise InputError(f"{name}: a soft maximum is that of a series that becomes positive.")
            weight = np.exp(SHARP * (x / m - 1))
            value = m * (1 + math.log(weight.mean()) / SHARP)
            # derivative by m: of the exponents, -x/m^2, and of the factor in front
            of_m = value / m - (weight @ x) / (weight.sum() * m)
            found.append(Dual(value, slopes @ weight / weight.sum() + of_m * slopes[:, x.argmax()]))
    if not found:
        raise InputError(f"{name}: the run has no such series.")
    return max(found, key=lambda one: one.value)


def _in_sizes_made(search, best, ended, low, high):
    """Change sizes of library materials to the nearest available ones that meet the limits; optimise the rest again.

    Returns the values given, and a reason, if no such sizes are within their bounds.
    """
    sizes = np.array([isinstance(p, Size) for p in search.parameters], dtype=bool)
    if not sizes.any():
        return best, ended
    scale = abs(search.at(best)[0].value)
    for away in range(1, SIZES_TRIED + 1):
        found = []
        for places in (away, -away):
            near = best.copy()
            near[sizes] = [search.parameters[k].made(best[k], places) for k in np.flatnonzero(sizes)]
            if (low <= near).all() and (near <= high).all():
                found.append((near, None) if sizes.all() else search.least_within(near, low, high, ~sizes, scale))
        kept = [one for one in found if (search.room(one[0]) >= -MISSED).all()]
        if kept:
            return min(kept, key=lambda one: search.at(one[0])[0].value)
    return best, "no sizes that are made keep the limits within the bounds; these are not made"


def _within_bars(fitted, search, dataset):
    """Sentences about limits on single outputs that their error bars exceed, from a run of each case with bars.

    Adds the largest bar over all cases for each such limit to the dataset (nan if unknown).
    """
    outputs = {k: limit.output for k, limit in enumerate(search.limits) if limit.output}
    bars, sentences = np.full(len(search.limits), math.nan), []
    for case in search.cases if search.needs_run and outputs else []:
        record = simulate(load_scene(fitted, **case), comm=MPI.COMM_SELF, accuracy={"estimate": "companion"})
        names, parts = record.output.values.astype(str), record.output_of.values.astype(str)
        for k, (name, part) in outputs.items():
            limit = search.limits[k]
            for i in np.flatnonzero((names == name) & ((parts == part) if part else True)):
                value, bar = float(record.bar_value[i]), float(record.bar[i])
                bars[k] = np.fmax(bars[k], bar)
                if limit.sign * (limit.bound - value) + MISSED * abs(limit.bound) < bar:
                    sentences.append(f"{limit.text}: its error bar reaches beyond, {value:.6g} +- {bar:.2g}.")
                elif record.bar_verdict.values[i] == NONE and not _rests(record, name, parts[i]):
                    sentences.append(f"{limit.text}: nothing is known of the error of {value:.6g}.")
    dataset["limit_bar"] = "limit", bars
    return sentences


def _rests(record: "xr.Dataset", name: str, part: str) -> bool:
    """True if the series of an output hardly varies."""
    names, parts = record.output.values.astype(str), record.output_of.values.astype(str)
    of_series = {end: (names == f"{name.rpartition('.')[0]}.{end}") & (parts == part) for end in ("std", "mean")}
    values = np.abs(record.bar_value.values)
    std, mean = (float(values[of_series[end]].max(initial=0.0)) for end in ("std", "mean"))
    return std <= MISSED * mean


def _described(search, best, start, low, high):
    """Dataset of parameters and limits with their multipliers, and sentences."""
    import xarray as xr

    least, limits = search.at(best)
    bounds = np.array([limit.bound for limit in search.limits])
    values = np.array([d.value for d in limits])
    signs = np.array([limit.sign for limit in search.limits])
    room = signs * (bounds - values) / np.maximum(np.abs(bounds), 1e-300)
    if (room < -MISSED).any() or (search.reason and not math.isfinite(least.value)):
        k = int(room.argmin())
        raise SolveError(f"Nothing was found that keeps {search.limits[k].text}: the nearest has {values[k]:.6g}.")
    active = room < 10 * MISSED
    inside = (best - low > 1e-6 * (high - low)) & (high - best > 1e-6 * (high - low))
    multipliers = np.zeros(len(limits))
    if active.any() and inside.any():  # least + sum multiplier x sign x limit is stationary off the bounds
        rows = np.array([s * d.slope[inside] for s, d, a in zip(signs, limits, active, strict=True) if a])
        multipliers[active] = np.linalg.lstsq(rows.T, -least.slope[inside], rcond=None)[0]
    keys = [p.key for p in search.parameters]
    sentences = [
        f"{key} lies on its bound, {value:.6g}." for key, value, one in zip(keys, best, inside, strict=True) if not one
    ]
    dataset = xr.Dataset(
        {
            "value": ("parameter", best),
            "begin": ("parameter", start),
            "parameter_unit": ("parameter", np.array([p.unit for p in search.parameters], dtype=object)),
            "limit_value": ("limit", values),
            "limit_bound": ("limit", bounds),
            "active": ("limit", active),
            "multiplier": ("limit", multipliers),
        },
        {
            "parameter": np.array(keys, dtype=object),
            "limit": np.array([one.text for one in search.limits], dtype=object),
        },
        {"least": least.value, "least_of": search.least.text, "runs": search.runs},
    )
    return dataset, sentences
