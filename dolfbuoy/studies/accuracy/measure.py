"""How far a run is from a finer one: settings, runs, the measure of the error, and the accuracy that is asked for.

The error of a quantity is the rms of its difference from the reference over the run, without the ramp at its start,
relative to the range (max - min) of the reference; of a vector the diagonal of the box of its ranges counts.
"""

import time as clock
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI
from scipy.interpolate import CubicSpline

from ...errors import InputError
from ...meshes import number_of_cells
from ...motion.simulation import Simulation
from ...parallel.cases import key
from ...results.observe import cone_angle
from ...scene import Scene, load_scene

#: What is compared, and its name in a sentence.
QUANTITIES = {
    "tension_top": "top tension",
    "tension_anchor": "anchor tension",
    "buoy_position": "buoy position",
    "cone_angle": "cone angle",
}
#: A case is resolved when its error exceeds the reference's own by this factor.
RESOLVED = 3.0


# -- settings ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Space:
    """Degrees and number of elements; of a scene without cable all are 0."""

    mu: int = 0
    nu: int = 0
    cells: int = 0

    @property
    def pair(self) -> str:
        return f"P{self.mu}-P{self.nu}" if self.mu else "-"

    def __str__(self):
        return f"{self.pair}, {self.cells} elements, " if self.mu else ""


@dataclass(frozen=True)
class Stepping:
    """Scheme and step, or with a tolerance the first step."""

    scheme: str
    step: float
    tolerance: float | None = None

    def __str__(self):
        size = f"dt {self.step:.4g} s" if self.tolerance is None else f"tolerance {self.tolerance:.2g}"
        return f"{SCHEMES[self.scheme]}, {size}"


SCHEMES = {"backward-euler": "backward Euler", "bdf2": "BDF2", "generalized-alpha": "generalized-alpha"}


def space_of(scene: Scene) -> Space:
    """The scene's own elements."""
    c = scene.cable
    return Space(c.position_degree, c.tension_degree, number_of_cells(c.elements)) if c else Space()


def stepping_of(scene: Scene) -> Stepping:
    """The scene's own scheme and step."""
    return Stepping(scene.time.scheme, scene.time.step, scene.time.tolerance)


def with_settings(scene: Scene, space: Space, stepping: Stepping) -> Scene:
    """The scene with these elements and steps; segments of the cable keep their share of the elements."""
    changes = {"time.scheme": stepping.scheme, "time.step": stepping.step, "time.tolerance": stepping.tolerance}
    changes |= {"time.min_step": None} if stepping.tolerance is None else {}
    if space.mu:
        elements = scene.cable.elements
        if not isinstance(elements, int):
            factor = space.cells / number_of_cells(elements)
            elements = [[length, max(1, round(n * factor))] for length, n in elements]
        else:
            elements = space.cells
        degrees = {"cable.position_degree": space.mu, "cable.tension_degree": space.nu}
        changes |= degrees | {"cable.elements": elements}
    return load_scene(scene, **changes)


def period_of(scene: Scene) -> float | None:
    """Period of what drives the scene."""
    if scene.waves:
        return scene.waves.period
    return scene.cable.top.period if scene.cable and scene.cable.top else None


def ramp_of(scene: Scene) -> float:
    """Time in which the drive grows."""
    if scene.waves:
        return scene.waves.ramp
    return scene.cable.top.ramp if scene.cable and scene.cable.top else 0.0


def shortened(scene: Scene, end: float | None = None, periods: int = 2) -> Scene:
    """The scene until `end`: by default the ramp and some periods, or half of a run that nothing drives.

    An adaptive run keeps the milestones and the largest step of the whole run.
    """
    if scene.time is None:
        raise InputError("Missing section [time]: a run needs at least its keys end and step.")
    time, period = scene.time, period_of(scene)
    if end is None:
        end = min(time.end, ramp_of(scene) + periods * period if period else time.end / 2)
    kept = {"time.output_every": time.output_every or time.end / 200 or None}
    kept |= {"time.max_step": time.max_step or time.end / 10 or None}
    return load_scene(scene, **{"time.end": end}, **kept)


def window_start(scene: Scene) -> float:
    """Errors count from here: after the ramp, or a tenth of the run."""
    ramp, end = ramp_of(scene), scene.time.end
    return ramp if 0 < ramp <= 0.8 * end else 0.1 * end


def quantities_of(scene: Scene) -> list[str]:
    """Those of QUANTITIES that vary in the scene."""
    free = scene.cable and scene.cable.top and scene.cable.top.kind == "free"
    tensions = ["tension_top", "tension_anchor"][1 if free else 0 :] if scene.cable else []
    return tensions + (["buoy_position", "cone_angle"] if scene.buoy else [])


def check_quantity(scene: Scene, quantity: str) -> None:
    """Raises InputError for a quantity that the scene does not have."""
    allowed = quantities_of(scene)
    if quantity not in allowed:
        raise InputError(f"--quantity {quantity}: this scene has {', '.join(allowed)}.")


def parse_accuracy(text: str, option: str = "--accuracy") -> float:
    """'1%', '1 %' or '0.01' -> 0.01; raises InputError that names the option."""
    number = text.strip()
    try:
        value = float(number.removesuffix("%")) / 100 if number.endswith("%") else float(number)
    except ValueError:
        value = float("nan")
    if not 1e-5 <= value <= 0.5:
        raise InputError(f"{option} {text}: must be from 0.001% to 50%, written as 1% or 0.01.")
    return value


# -- runs --------------------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """Quantities over time, and what they cost: seconds of the stepping loop alone."""

    t: np.ndarray
    values: dict[str, np.ndarray]
    wall: float = 0.0
    cpu: float = 0.0
    steps: int = 0
    iterations: int = 0
    rejected: int = 0
    failed: int = 0
    unknowns: int = 0

    def save(self, file) -> None:
        """Write times and quantities, for `kept`."""
        np.savez_compressed(file, t=self.t, **self.values)

    @classmethod
    def kept(cls, file) -> "Run":
        """Times and quantities from a file."""
        with np.load(file) as data:
            return cls(data["t"], {name: data[name] for name in data.files if name != "t"})


def with_file(case: dict, folder, name: str) -> dict:
    """The case, and with it the file in which its run is kept."""
    return case | {"file": str(Path(folder) / "cases" / f"{name}-{key(case)}.npz")}


def compute(scene: Scene, names, repeats: int = 1, comm=MPI.COMM_SELF) -> Run:
    """Run a scene; times are medians over the repeats.  Raises SolveError."""
    runs = [_once(scene, names, comm) for _ in range(repeats)]
    run = runs[0]
    run.wall, run.cpu = (float(np.median([getattr(r, key) for r in runs])) for key in ("wall", "cpu"))
    return run


def _once(scene, names, comm):
    simulation = Simulation(scene, comm)  # compiles the forms and finds the equilibrium
    try:
        times, rows = [0.0], [_look(simulation, names)]
        wall, cpu = clock.perf_counter(), clock.process_time()
        for _ in simulation.run():
            times.append(simulation.t)
            rows.append(_look(simulation, names))
        wall, cpu = clock.perf_counter() - wall, clock.process_time() - cpu
        values = {name: np.array([row[name] for row in rows]) for name in names}
        control, system = simulation.control, simulation.system
        counts = (len(times) - 1, simulation.iterations, control.rejected, control.failed, system.unknowns)
        return Run(np.array(times), values, wall, cpu, *counts)
    finally:
        simulation.problem.destroy()


def _look(simulation, names):
    problem = simulation.problem
    state = problem.system.u[problem.state_part.slice] if problem.buoy else None
    how = {
        "tension_top": lambda: float(np.linalg.norm(simulation.end_tension)),
        "tension_anchor": problem.anchor_tension,
        "buoy_position": lambda: state[:3].copy(),
        "cone_angle": lambda: cone_angle(state[6:10]),
    }
    return {name: how[name]() for name in names}


# -- errors ------------------------------------------------------------------------------------------------------------


@dataclass
class Error:
    """rms: of the difference; maximum: of the largest value; both relative to the reference's range."""

    rms: float
    maximum: float


class Reference:
    """A fine run between its times (cubic splines).

    start: errors count from this time on.  whole: the run whose ranges errors are relative to, if it is another.
    """

    def __init__(self, run: Run, start: float, whole: "Reference | None" = None):
        self.start, self.end, self.whole = start, run.t[-1], whole or self
        self.splines = {name: CubicSpline(run.t, values) for name, values in run.values.items()}
        inside = run.t >= start - 1e-9 * self.end
        self.inside = {name: _columns(values)[inside] for name, values in run.values.items()}

    def range_of(self, name: str) -> float:
        """max - min after the start; of a vector the diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.whole.inside[name], axis=0)))

    def error(self, run: Run, name: str) -> Error:
        """Of a run at its own times.  A quantity that does not vary has errors inf, unless they are 0."""
        inside = (run.t >= self.start - 1e-9 * self.end) & (run.t <= self.end * (1 + 1e-9))
        t, values = np.minimum(run.t[inside], self.end), _columns(run.values[name])[inside]
        difference = values - _columns(self.splines[name](t))
        largest = np.abs(values.max(axis=0) - self.inside[name].max(axis=0)).max()
        size = self.range_of(name)
        return Error(_relative(_rms(t, np.linalg.norm(difference, axis=1)), size), _relative(largest, size))


def _columns(values):
    return np.asarray(values, dtype=float).reshape(len(values), -1)


def _rms(t, values):
    """Root of the mean square over time (trapezoidal rule, exact for unequal steps)."""
    if len(t) < 2:
        raise InputError("The run is too short to compare: fewer than two of its times lie after the ramp.")
    squares = values**2
    return float(np.sqrt(np.sum(np.diff(t) * (squares[1:] + squares[:-1]) / 2) / (t[-1] - t[0])))


def _relative(value, size):
    return float(value / size) if size > 0 else (0.0 if value == 0 else float("inf"))


def own_error(changes, highest: float = 2.0) -> float:
    """Richardson: error of the finest of runs that are each twice as fine as the one before.

    changes: errors of each but the last against its next.  The order is that of the last two changes, between 1 and
    `highest`; of a single change it is 2.
    """
    order = min(2.0, highest)
    if len(changes) > 1 and changes[-1] > 0:
        order = min(max(np.log2(changes[-2] / changes[-1]), 1.0), highest) if changes[-2] > 0 else 1.0
    return float(changes[-1] / (2**order - 1))


def resolved(error: float, reference_error: float) -> bool:
    """Whether an error is one of the case and not of its reference."""
    return error >= RESOLVED * reference_error


def bound(error: float, reference_error: float) -> float:
    """What the comparison proves: an error that is not resolved may be as large as this."""
    return max(error, RESOLVED * reference_error)


def pareto(points) -> list[int]:
    """Indices of (time, error) that no other point beats in both, from the fastest on."""
    front, best = [], float("inf")
    for i in sorted(range(len(points)), key=lambda i: tuple(points[i])):
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def percent(error: float) -> str:
    """An error as one would say it."""
    return f"{100 * error:.2g} %"
