"""Where the time of a step goes, and the floor to measure it by.

    .venv/bin/python -m tests.verification.step_cost SCENE [--steps 1000]

A scene is run for a number of steps, with a new Jacobian in every iteration and with kept ones, and timed as it goes.
What PETSc calls is timed apart, on a twin of the run: the loops and insertion after every few steps, as often as the
run called them, factorisation and solve many times over at one state.
The floor of a Newton iteration is the loops in C and the direct solver called back to back, with nothing else between
them, in turn and as often as the run called them; it is measured after every few steps, side by side with them.
`ratio`: of Newton's method to the floor; `ratio of a step` counts what surrounds it too: time scheme, predictor,
forcing, record.  All times are this process's time on the processor; a ratio is the median of those of groups of
steps, each side by side with its floor.
"""

import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI
from petsc4py import PETSc

from dolfbuoy.errors import InputError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.recorder import Recorder
from dolfbuoy.scene import load_scene
from dolfbuoy.solver import compat
from dolfbuoy.solver.numbering import set_values
from dolfbuoy.studies.study import Table

from .script import make, start

WARM_UP = 50  # steps before the clock starts
GROUP = 10  # steps that are timed together: a kept Jacobian is new in some of them only
PARTS = ("residual loop", "Jacobian loop", "insertion", "factorisation", "solve")
PARTS += ("SNES and Python", "time scheme", "record")


def typical(function, count: int = 60) -> float:
    """Seconds of a call: median of `count`."""
    times = []
    for _ in range(count):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return float(np.median(times))


def back_to_back(newton):
    """A function of numbers of iterations, residuals and Jacobians: loops and direct solver alone, in turn."""
    system = newton.system
    factorise, solve = direct_solver(newton)

    def floor(n_K, n_R, n_J):
        for k in range(n_K):
            for _ in range(n_J * k // n_K, n_J * (k + 1) // n_K):
                system.add_jacobians()
                factorise()
            solve()
            for _ in range(n_R * k // n_K, n_R * (k + 1) // n_K):
                system.add_residuals()

    return floor


def direct_solver(newton):
    """A factorisation of the present Jacobian, and a solve with it."""
    newton.system.assemble_jacobian()
    A = newton.system.A.copy()
    A.diagonalScale(newton.system.row_vector, newton.system.unknown_vector)
    pc = PETSc.PC().create(A.comm)
    pc.setType("lu")
    pc.setFactorSolverType(newton.direct)
    if newton.direct == "petsc":
        pc.setFactorOrdering("natural")
    pc.setOperators(A)
    pc.setUp()

    def again():
        A.stateIncrease()  # PETSc factorises again only what has changed
        pc.setUp()

    x, y = A.createVecs()
    x.set(1.0)
    return again, lambda: pc.apply(x, y)


def measure(scene, steps: int, keep: bool, count: int = 60) -> dict:
    """One row of the study: seconds per Newton iteration of a run, in parts, and the floor."""
    scene = scene.model_copy(update={"solver": scene.solver.model_copy(update={"keep_jacobian": keep})})
    simulation, twin = (Simulation(scene, MPI.COMM_SELF) for _ in range(2))
    with TemporaryDirectory() as folder:
        recorder = Recorder(simulation, Path(folder))
        marches = [sim.run() for sim in (simulation, twin)]
        for _ in range(WARM_UP):
            recorder.add(*next(marches[0]))
            next(marches[1])
        groups = _groups(simulation, twin, marches[0], recorder, steps // GROUP)
        recorder.close()
    done = GROUP * len(groups["steps"])
    n_K, n_R, n_J = (groups[name].sum() for name in ("iterations", "residuals", "jacobians"))
    row = {"jacobian": "kept" if keep else "new", "unknowns": simulation.system.unknowns, "steps": done}
    row |= {"iterations": n_K / done, "residuals": n_R / done, "jacobians": n_J / done}
    factorise, solve = (typical(work, count) for work in direct_solver(twin.newton))
    row |= _split(groups, n_J / n_K * factorise, solve, done / n_K)
    for sim in (simulation, twin):
        sim.problem.destroy()
    return row


def _groups(simulation, twin, march, recorder, count):
    """Counts of each group of steps, and its seconds: of parts of Newton's method, of steps, record, and floor."""
    newton, end, system = simulation.newton, simulation.scene.time.end, twin.system
    alone, rows = back_to_back(twin.newton), []
    newton.numbers.clocked = True
    insert = partial(set_values, system.A, system.add_jacobians.out)
    while len(rows) < count and end - simulation.t > (GROUP - 0.5) * simulation.scene.time.step:
        counted, in_steps, in_record = _counts(newton), 0.0, 0.0
        newton.numbers.seconds = 0.0
        for _ in range(GROUP):
            begin = time.process_time()
            step = next(march)
            middle = time.process_time()
            recorder.add(*step)
            in_steps += middle - begin
            in_record += time.process_time() - middle
        numbers = [now - then for now, then in zip(_counts(newton), counted, strict=True)]
        calls = (system.add_residuals, numbers[1]), (system.add_jacobians, numbers[2]), (insert, numbers[2])
        parts = [_seconds(work, n) for work, n in calls]
        in_floor = _seconds(partial(alone, *numbers))
        rows.append([*numbers, in_steps, in_record, in_floor, newton.numbers.seconds, *parts])
    names = ["iterations", "residuals", "jacobians", "steps", "record", "floor", "newton"]
    names += ["residuals of it", "jacobians of it", "insertion of it"]
    return dict(zip(names, np.array(rows).T, strict=True))


def _seconds(work, count=1):
    """Of `count` calls."""
    begin = time.process_time()
    for _ in range(count):
        work()
    return time.process_time() - begin


def _counts(newton):
    return newton.iterations_total, newton.numbers.residuals_total, newton.numbers.jacobians_total


def _split(groups, factorisation, solve, steps):
    """Microseconds per Newton iteration; the other times in seconds per iteration; steps: to an iteration."""
    spent = {name: times.mean() * steps / GROUP for name, times in groups.items()}
    split = {
        "residual loop": spent["residuals of it"],
        "Jacobian loop": spent["jacobians of it"],
        "insertion": spent["insertion of it"],
        "factorisation": factorisation,
        "solve": solve,
    }
    split["SNES and Python"] = spent["newton"] - sum(split.values())
    split["time scheme"] = spent["steps"] - spent["newton"]
    split["record"] = spent["record"]
    microseconds = {name: 1e6 * seconds for name, seconds in split.items()}
    return microseconds | {
        "total": 1e6 * sum(split.values()),
        "floor": 1e6 * spent["floor"],
        "ratio": float(np.median(groups["newton"] / groups["floor"])),
        "ratio of a step": float(np.median((groups["steps"] + groups["record"]) / groups["floor"])),
        "milliseconds per step": 1e3 * (spent["steps"] + spent["record"]) / steps,
    }


def study(folder: Path, scene: str, steps: int) -> list[Table]:
    """Measure a scene with new and with kept Jacobians; the rows, shown as columns.

    Raises InputError for a scene without enough steps.
    """
    loaded = load_scene(scene)
    if loaded.time is None:
        raise InputError("time: must be given, step-cost measures a run.")
    if loaded.time.tolerance is not None or loaded.time.end < 2 * WARM_UP * loaded.time.step:
        raise InputError(
            f"step-cost needs a run of at least {2 * WARM_UP} equal steps: no time.tolerance, time.end larger."
        )
    if MPI.COMM_WORLD.size > 1:
        raise InputError("step-cost measures one rank; start it without mpirun.")
    rows = [measure(loaded, steps, keep) for keep in (False, True)]
    headings = {"iterations": "its/step", "residuals": "R/step", "jacobians": "J/step"}
    headings |= {key: key for key in rows[0] if key not in ("jacobian", "steps", "unknowns", *headings)}
    lines = [{"part": said} | {row["jacobian"]: row[key] for row in rows} for key, said in headings.items()]
    versions = ", ".join(f"{key} {value}" for key, value in compat.versions().items())
    notes = [
        f"{row['jacobian']} Jacobians: a Newton iteration takes {row['ratio']:.2f} times its floor of "
        f"{row['floor']:.0f} us, with all that a step does besides {row['ratio of a step']:.2f} times; "
        f"{row['milliseconds per step']:.2f} ms per step"
        for row in rows
    ]
    notes.append(f"{rows[0]['unknowns']} unknowns, {rows[0]['steps']} steps; {versions}")
    title = f"Cost of a Newton iteration of {loaded.title or scene} [us]"
    columns = {"part": "", "new": "new Jacobians", "kept": "kept Jacobians"}
    return [
        Table(f"step_cost_{Path(scene).stem}", rows, notes=notes),
        Table("", lines, title, columns, notes),
    ]


def main(
    scene: str,
    steps: Annotated[int, typer.Option(min=10, help="Steps to measure.")] = 1000,
    out: Path | None = None,
) -> None:
    """Where the time of a Newton iteration goes, beside its floor."""
    make("step-cost", study, out, scene=scene, steps=steps)


if __name__ == "__main__":
    start(main)
