"""Runs reduced to the quantities that are compared, and to their cost."""

from __future__ import annotations

import platform
import time as clock
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..errors import InputError
from ..motion.simulation import Simulation
from ..parallel import pace
from ..scene import Scene
from ..scene.settings import ramp_of
from ..writing import replacing
from . import quantities
from .attitude import cone_angle

#: Quantities that are compared, and their names in sentences.
QUANTITIES = {name: one.compared for name, one in quantities.QUANTITIES.items() if one.compared}


def window_start(scene: Scene) -> float:
    """Time from which errors count: the end of the ramp, or a tenth of the run [s]."""
    time: Any = scene.time
    ramp, end = ramp_of(scene), time.end
    return ramp if 0 < ramp <= 0.8 * end else 0.1 * end


def quantities_of(scene: Scene) -> list[str]:
    """Names in QUANTITIES that vary in the scene."""
    network = scene.network
    tops = [network.pieces[network.last_of(cable)].ends[1] for cable in range(len(network.cables))]
    free = all(end.kind == "free" for end in tops)
    tensions = ["tension_top", "tension_anchor"][1 if free else 0 :] if tops else []
    return tensions + (["buoy_position", "cone_angle"] if network.buoys else [])


def check_quantity(scene: Scene, quantity: str) -> None:
    """Raise InputError for a quantity that the scene does not have."""
    allowed = quantities_of(scene)
    if quantity not in allowed:
        raise InputError(f"--quantity {quantity}: this scene has {', '.join(allowed)}.")


@dataclass
class Run:
    """Quantities (time, numbers), and their cost: wall and CPU seconds of the stepping loop alone."""

    t: NDArray[Any]
    values: dict[str, NDArray[Any]]
    wall: float = 0.0
    cpu: float = 0.0
    steps: int = 0
    iterations: int = 0
    rejected: int = 0
    failed: int = 0
    unknowns: int = 0

    def save(self, file: Any) -> None:
        """Write times and quantities, for `kept`."""
        with replacing(file) as part, open(part, "wb") as open_part:
            np.savez_compressed(open_part, t=self.t, **self.values)

    @classmethod
    def kept(cls, file: Any) -> Run:
        """Times and quantities from a file."""
        with np.load(file) as data:
            return cls(data["t"], {name: data[name] for name in data.files if name != "t"})


def compute(scene: Scene, names: Iterable[str], repeats: int = 1, comm: Any = MPI.COMM_SELF) -> Run:
    """Run a scene; wall and CPU times are medians over the repeats.  Raises SolveError."""
    if pace.watch is not None:
        pace.watch.runs = repeats
    runs = [_once(scene, names, comm) for _ in range(repeats)]
    run = runs[0]
    run.wall, run.cpu = (float(np.median([getattr(r, key) for r in runs])) for key in ("wall", "cpu"))
    return run


def _once(scene: Scene, names: Iterable[str], comm: Any) -> Run:
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


def _look(simulation: Any, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Present values of the quantities, of all cables or buoys side by side."""
    problem = simulation.problem
    states = [buoy.fields.of(problem.system.u[buoy.part.slice]) for buoy in problem.buoys.values()]
    how = {
        "tension_top": lambda: np.linalg.norm(simulation.end_tension, axis=-1),
        "tension_anchor": lambda: [problem.anchor_tension(cable) for cable in range(len(problem.network.cables))],
        "buoy_position": lambda: np.concatenate([state.position for state in states]),
        "cone_angle": lambda: [cone_angle(state.orientation) for state in states],
    }
    return {name: np.ravel(how[name]()) for name in names}


def machine() -> str:
    """Name of the processor on which the times were measured."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()
