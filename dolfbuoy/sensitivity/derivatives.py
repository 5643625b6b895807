"""Derivatives of a run, an equilibrium, modes or a response by the parameters of a scene."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..accuracy.outputs import outputs_of, unit_of_series
from ..accuracy.target import check_outputs
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..model.pool import Pool
from ..model.problem import Problem
from ..motion.simulation import Simulation
from ..motion.tangent import Tangents
from ..parallel import interruption
from ..results.folder import keep, make_ready
from ..results.measured import window_start
from ..results.observe import Observer
from ..results.quantities import QUANTITIES, less
from ..results.record import LABELS
from ..scene import Scene, load_scene
from ..solver.vector_ops import together
from ..statics.equilibrium import solve_equilibrium
from .parameters import STIFF, Parameter, parameters_of

if TYPE_CHECKING:
    import xarray as xr

#: Number of instants noted before quantities are computed from them.
ROWS = 1024
MODES = 10  #: number of natural periods
#: Fraction of the largest statistic of a series below which another one is 0, such as the tension of a slack line.
ROUNDING = 1e-12
Values = dict[str, Any]  #: arrays of quantities by name


def sensitivities(
    scene: Scene | str | Path | dict[str, Any],
    by: Sequence[str] | None = None,
    of: Sequence[str] | None = None,
    out: str | Path | None = None,
    what: str = "run",
    comm: Any = MPI.COMM_WORLD,
    progress: Callable[[Simulation], object] | None = None,
    **overrides: Any,
) -> "xr.Dataset":
    """Derivatives of the results of a scene by its parameters.

    by: keys of numbers, entries of vectors ("cable.top.amplitude.2") or whole vectors, which are varied by a factor;
    default: all that are not zero.  of: outputs, such as tension_top.max; default: all.  out: folder for
    sensitivity.nc.  what: "run", "static" (the equilibrium), "modes" (natural periods and damping of the slowest ten)
    or "response" (to waves, linear).

    Returns a dataset over `parameter`, complete on rank 0: `d_NAME` of every series, (parameter, time, ...), without
    time at rest, or over mode; for a run also `d_output` (parameter, output), per unit of the parameter, and
    `elasticity`, the percentage change per one per cent.  Steps, meshes and slack elements are the run's.

    Raises InputError for a scene or key without derivatives, SolveError if one is not found.
    """
    found = load_scene(scene, **overrides)
    found, parameters = load_scene(found, accuracy=None), parameters_of(found, by)
    if what not in KINDS:
        raise InputError(f"what = {what!r}: must be one of {', '.join(KINDS)}.")
    if not parameters:
        raise InputError("by: this scene has no number that anything has a derivative by.")
    if what == "run":
        check_outputs(found, of or (), "--of", every=True)
    elif of:
        raise InputError("--of: goes with the outputs of a run.")
    make_ready(out, "sensitivity", found, comm)
    dataset = of_run(found, parameters, comm, progress) if what == "run" else KINDS[what](found, parameters, comm)
    there = comm.bcast(dataset.output.values.tolist() if of and comm.rank == 0 else [])
    if absent := sorted(set(of or ()) - set(there)):
        raise InputError(
            f"--of {absent[0]}: is of what this scene does not have, as utilisation without a breaking load."
        )
    if of and comm.rank == 0:
        dataset = dataset.isel(output=np.isin(dataset.output.values.astype(str), list(of)))
    if out is not None:
        keep(out, "sensitivity", found, dataset, comm)
    return dataset


def of_run(
    scene: Scene,
    parameters: Sequence[Parameter],
    comm: Any = MPI.COMM_WORLD,
    progress: Callable[[Simulation], object] | None = None,
) -> "xr.Dataset":
    """Series of a run, and derivatives of series and outputs by the parameters (complete on rank 0).

    Raises InputError for a scene without derivatives, SolveError if a step or a derivative is not found.
    """
    if any(piece.section.fails_at for piece in scene.network.pieces):
        raise InputError("fails_at: nothing has a derivative across the instant in which a line parts.")
    run, pool = Simulation(scene, comm), Pool()

    def neighbour(other):
        return Simulation(other, comm, problem=Problem(other, True, comm), pool=pool)

    with ExitStack() as ending:
        ending.callback(pool.clear)
        ending.callback(run.problem.destroy)
        tangents = Tangents(run, parameters, neighbour)
        ending.callback(tangents.destroy)
        seen = list(dict.fromkeys([run, *(one for pair in tangents.pairs for one in (pair.other, pair.near))]))
        notes, times = _Notes(seen), [0.0]
        notes.add()
        for _ in run.run():
            times.append(run.t)
            notes.add()
            if tangents.fault:
                raise SolveError(tangents.fault)
            interruption.check()
            if progress is not None:
                progress(run)
        labels = notes.observers[0].labels()
        values = dict(zip(seen, notes.values(), strict=True))
    pairs = [(values[pair.other], values[pair.near]) for pair in tangents.pairs]
    apart = [pair.apart for pair in tangents.pairs]
    return _dataset(scene, parameters, values[run], pairs, apart, labels, np.array(times))


def of_equilibrium(scene: Scene, parameters: Sequence[Parameter], comm: Any = MPI.COMM_WORLD) -> "xr.Dataset":
    """Quantities of the equilibrium and their derivatives (complete on rank 0).  Raises InputError, SolveError."""
    pool, labels = Pool(), {}

    def rest(one):
        problem = solve_equilibrium(one, comm, pool.problem)
        observer = Observer(problem)
        labels.update(observer.labels())
        return observer.values(problem.end_forces())

    try:
        values = rest(scene)
        pairs = [[rest(p.scene_at(scene, x)) for x in (-p.distance, p.distance)] for p in parameters]
    finally:
        pool.clear()
    return _dataset(scene, parameters, values, pairs, [2 * p.distance for p in parameters], labels)


def of_modes(scene: Scene, parameters: Sequence[Parameter], comm: Any = MPI.COMM_WORLD) -> "xr.Dataset":
    """Periods and damping of the slowest modes, and their derivatives, from the same modes of neighbouring scenes.

    Raises InputError, SolveError.
    """
    from ..linear_api import modes

    base = modes(scene, MODES, comm=comm)
    eigenvalues = base.eigenvalue.values @ (1, 1j)
    slopes = {name: [] for name in ("period", "damping_ratio")}
    for p in parameters:
        pair = []
        for x in (-STIFF, STIFF):
            near = modes(p.scene_at(scene, x), MODES + 4, comm=comm)
            which = np.abs(near.eigenvalue.values @ (1, 1j) - eigenvalues[:, None]).argmin(axis=1)
            pair.append(near.isel(mode=which))
        for name, rows in slopes.items():
            rows.append(less(pair[1][name].values, pair[0][name].values) / (2 * STIFF * p.scale))
    for name, rows in slopes.items():
        text = {"long_name": f"derivative of the {name.replace('_', ' ')}", "units": "over parameter_unit"}
        base[f"d_{name}"] = (("parameter", "mode"), np.array(rows), text)
    return _labelled(base, scene, parameters)


def of_response(scene: Scene, parameters: Sequence[Parameter], comm: Any = MPI.COMM_WORLD) -> "xr.Dataset":
    """Linear response to waves and its derivatives at the same periods.  Raises InputError, SolveError."""
    from ..linear_api import response

    base = response(scene, comm=comm)
    if comm.rank != 0:
        return base
    names = [name for name, one in base.data_vars.items() if one.dtype.kind == "f" and one.dims]
    found = base.copy()
    periods = base.period.values
    pairs = [
        [response(p.scene_at(scene, x), periods, comm=comm) for x in (-p.distance, p.distance)] for p in parameters
    ]
    for name in names:
        slopes = [
            less(high[name].values, low[name].values) / (2 * p.distance * p.scale)
            for p, (low, high) in zip(parameters, pairs, strict=True)
        ]
        text = {"long_name": f"derivative of {base[name].attrs.get('long_name', name)}", "units": "over parameter_unit"}
        found[f"d_{name}"] = (("parameter", *base[name].dims), np.array(slopes), text)
    return _labelled(found, scene, parameters)


#: Functions that compute results with derivatives, by kind.
KINDS: dict[str, Any] = {"run": of_run, "static": of_equilibrium, "modes": of_modes, "response": of_response}


class _Notes:
    """Quantities of Simulations at the noted instants."""

    def __init__(self, simulations: Sequence[Simulation]) -> None:
        self.observers = [Observer(one.problem, one.latest_end_forces, (), k > 0) for k, one in enumerate(simulations)]
        self._begun = [one.begun() for one in self.observers]
        ends = np.cumsum([one.width for one in self.observers])
        self._now, self._ends = np.zeros(ends[-1]), ends[:-1]
        places = np.split(self._now, self._ends)
        self._take = together(*(one.noting(out) for one, out in zip(self.observers, places, strict=True)))
        self._rows, self._count = np.zeros((ROWS, ends[-1])), 0
        self._parts: list[list[Values]] = [[] for _ in simulations]

    def add(self) -> None:
        """Note the present instant.  Collective."""
        self._take()
        self._rows[self._count] = self._now
        self._count += 1
        if self._count == ROWS:
            self._make()

    def _make(self) -> None:
        columns = np.split(self._rows[: self._count], self._ends, axis=1)
        for observer, parts, rows in zip(self.observers, self._parts, columns, strict=True):
            parts.append(observer.values_of(rows.copy()))
        self._count = 0

    def values(self) -> list[Values]:
        """Quantities of each simulation, on rank 0."""
        if self._count:
            self._make()
        on_root = self.observers[0].comm.rank == 0
        return [
            {n: np.concatenate([one[n] for one in parts]) for n in parts[0] if on_root} | begun
            for parts, begun in zip(self._parts, self._begun, strict=True)
        ]


def _dataset(scene, parameters, values, pairs, apart, labels, times=None):
    """Dataset of values, derivatives and outputs by name.

    pairs: values of two scenes for each parameter; apart: their distances in x.
    """
    import xarray as xr

    above = () if times is None else ("time",)
    names = {name: one for name, one in QUANTITIES.items() if name in values and not one.effort}
    over = np.array([1 / (x * p.scale) for p, x in zip(parameters, apart, strict=True)])
    known = labels | LABELS | ({} if times is None else {"time": times})
    dims = {name: (*(above if one.over else ()), *one.dims) for name, one in names.items()}
    data = {name: (dims[name], values[name], one.attributes()) for name, one in names.items()}
    coords = {name: known[name] for name in set().union(*dims.values()) if name in known}
    found = xr.Dataset(data, coords)
    for name, one in names.items():
        slope = np.array([h * less(high[name], low[name]) for h, (low, high) in zip(over, pairs, strict=True)])
        text = {"long_name": f"derivative of {one.long_name}", "units": f"{one.unit} over parameter_unit"}
        found[f"d_{name}"] = (("parameter", *dims[name]), slope, text)
    found = _labelled(found, scene, parameters)
    return found.merge(_outputs(scene, parameters, found, pairs, over)) if times is not None else found


def _labelled(found, scene, parameters):
    """Add names, values and units of the parameters."""
    found = found.assign_coords(parameter=np.array([p.key for p in parameters], dtype=object))
    found["parameter_value"] = ("parameter", np.array([p.value for p in parameters]))
    found["parameter_unit"] = ("parameter", np.array([p.unit for p in parameters], dtype=object))
    return found.assign_attrs(title=scene.title, scene=scene.to_toml())


def _outputs(scene, parameters, found, pairs, over):
    """Outputs after the ramp, their derivatives and elasticities."""
    import xarray as xr

    start = window_start(scene)

    def outputs(values):
        record = {n: (found[n].dims, values[n], found[n].attrs) for n in found.data_vars if n in values}
        return outputs_of(xr.Dataset(record, found.coords).drop_vars("parameter"), start)

    base = outputs({name: found[name].values for name in found.data_vars})
    slopes = np.zeros((len(parameters), len(base)))
    for row, h, (low, high) in zip(slopes, over, pairs, strict=True):
        below, above = outputs(low), outputs(high)
        row[:] = [h * less(above[output], below[output]) for output in base]
    value = np.array(list(base.values()))
    sizes = np.array([1.0 if np.isnan(p.value) else p.value for p in parameters])
    sizes_of = [max(abs(x) for o, x in base.items() if o[::2] == output[::2]) for output in base]  # of their series
    with np.errstate(divide="ignore", invalid="ignore"):
        rounding = np.abs(value) <= ROUNDING * np.array(sizes_of)
        elasticity = np.where(rounding, np.nan, slopes * sizes[:, None] / value)
    texts = (
        "derivative of the output, in its unit over parameter_unit",
        "change of the output in per cent for one per cent of the parameter",
    )
    made = {
        "output_value": ("output", value, {"long_name": "value of the output after the ramp"}),
        "output_unit": ("output", np.array([unit_of_series(o.series) for o in base], dtype=object)),
        "d_output": (("parameter", "output"), slopes, {"long_name": texts[0]}),
        "elasticity": (("parameter", "output"), elasticity, {"long_name": texts[1], "units": "1"}),
    }
    names = np.array([str(o) for o in base], dtype=object), np.array([o.part for o in base], dtype=object)
    return xr.Dataset(made, {"output": names[0], "output_of": ("output", names[1])})
