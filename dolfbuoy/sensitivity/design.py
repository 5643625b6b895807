"""Numbers of a scene for which an expression is least while others stay below limits."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

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
from .parameters import parameters_of

if TYPE_CHECKING:
    import xarray as xr

#: Iterations at most; relative change with which a search ends; part of a limit by which it may be missed.
MOST, ENDS, MISSED = 60, 1e-7, 1e-4
#: What an output counts as in a run that failed, in limits: a step there is not taken.
LOST = 100.0
#: Ending of outputs that are soft maxima, and how sharp these are.
SOFT, SHARP = ".soft_max", 60.0


@dataclass(frozen=True)
class Design:
    """Result of `design`; scene: with the numbers found.

    dataset: over `parameter` value and begin, over `limit` value, bound, active and multiplier (by how much the least
    expression falls for a unit more of the limit); attributes: least, runs.
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
    """Numbers within bounds for which `least` is least and everything in `hold` is kept, by SLSQP with derivatives.

    vary: key -> (low, high).  least: an expression of keys and outputs (`expressions`).  hold: "EXPRESSION < LIMIT" or
    "EXPRESSION > LIMIT".  cases: load cases, changes of the scene each; limits hold in all of them, and `least` counts
    the largest.  What is not given is that of the scene's section [design].  out: folder for design.nc and
    designed.toml.  On one rank.

    Raises InputError for what is no expression, key or output, SolveError where the first run fails or nothing is
    found that keeps the limits.
    """
    from scipy.optimize import minimize

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
    width = high - low
    scale = max(abs(first[0].value), 1e-300)

    def constraint(k):
        limit = search.limits[k]
        size = max(abs(limit.bound), 1e-300)
        return {
            "type": "ineq",
            "fun": lambda z: (limit.bound - search.at(low + z * width)[1][k].value) * limit.sign / size,
            "jac": lambda z: -search.at(low + z * width)[1][k].slope * width * limit.sign / size,
        }

    found = minimize(
        lambda z: search.at(low + z * width)[0].value / scale,
        (start - low) / width,
        jac=lambda z: search.at(low + z * width)[0].slope * width / scale,
        bounds=[(0.0, 1.0)] * len(start),
        constraints=[constraint(k) for k in range(len(search.limits))],
        method="SLSQP",
        options={"maxiter": MOST, "ftol": ENDS},
    )
    best = low + np.clip(found.x, 0, 1) * width
    fitted = search.scene_at(best)
    dataset, sentences = _described(search, best, start, low, high, found)
    finish(dataset, base, fitted, out, "design", "designed.toml")
    return Design(fitted, dataset, sentences)


@dataclass(frozen=True)
class Limit:
    """sign x (bound - expression) >= 0."""

    text: str
    expression: Expression
    bound: float
    sign: float


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
    """Values of expressions for other numbers of a scene, in all load cases."""

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
                continue  # an output, or nothing: shows in the first run
        self._needs_run = any(name not in self._keys for name in names)
        if not any(p.key in self._keys for p in parameters) and not self._needs_run:
            raise InputError(f"--least {least.text}: nothing in it depends on what varies.")

    def scene_at(self, values):
        scene = self.base
        for p, value in zip(self.parameters, values, strict=True):
            scene = p.scene_at(scene, (float(value) - p.value) / p.scale)
        return scene

    def at(self, values):
        """(least, [limits]): Duals, the worst of all load cases."""
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
        dataset = None
        if self._needs_run:
            self.runs += 1
            dataset = of_run(scene, parameters_of(scene, [p.key for p in self.parameters]), MPI.COMM_SELF)

        def value_of(name):
            if name in self._keys:
                (here,) = parameters_of(scene, [name])
                return Dual(here.value, np.array([float(p.key == here.key) for p in self.parameters]))
            return _soft(dataset, name, window_start(scene)) if SOFT in name else _output(dataset, name)

        size = len(values)
        return self.least.at(value_of, size), [limit.expression.at(value_of, size) for limit in self.limits]


def _output(dataset: "xr.Dataset", name: str) -> Dual:
    """An output of a run; without the name of a part the largest of all, of a smallest value the smallest."""
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
    """Soft maximum m (1 + log(mean of exp(60 (x/m - 1)))/60) of the values x of a series after the ramp, m the largest.

    It moves smoothly where one crest takes the place of another as the largest, and is lower where crests are narrow.
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
            # by m: the terms of the exponents -x/m^2, and the factor in front
            of_m = value / m - (weight @ x) / (weight.sum() * m)
            found.append(Dual(value, slopes @ weight / weight.sum() + of_m * slopes[:, x.argmax()]))
    if not found:
        raise InputError(f"{name}: the run has no such series.")
    return max(found, key=lambda one: one.value)


def _described(search, best, start, low, high, found):
    """Numbers, limits with their multipliers, and sentences."""
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
    if active.any() and inside.any():  # least + sum multiplier x sign x limit is stationary in what is not on a bound
        rows = np.array([s * d.slope[inside] for s, d, a in zip(signs, limits, active, strict=True) if a])
        multipliers[active] = np.linalg.lstsq(rows.T, -least.slope[inside], rcond=None)[0]
    keys = [p.key for p in search.parameters]
    sentences = [
        f"{key} lies on its bound, {value:.6g}." for key, value, one in zip(keys, best, inside, strict=True) if not one
    ]
    if not found.success:
        sentences.append(f"The search has not ended: {found.message}.")
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
