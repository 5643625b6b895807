"""Where the time of a step goes, and the floor below which it cannot fall.

A scene is run for a number of steps, with a new Jacobian in every iteration and with kept ones.  Then, at the state
that it reached, each part of the work is done many times over and timed alone.  The floor of a Newton iteration is the
compiled assemblers and the direct solver called back to back, with nothing else between them, in turn and as often as
the run called them; it is measured after every few steps, side by side with them.  (The parts, each repeated alone,
find their data in the cache and add up to somewhat less.)  `ratio`: of Newton's method to the floor; `ratio of a step`
counts what surrounds it too: time scheme, predictor, forcing, record.  All times are this process's time on the
processor, those of parts medians of the better half of many, since other programs on the machine only ever add to them.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from .. import compat
from ..api import Recorder
from ..assembly import Contribution
from ..dynamics import Simulation
from ..errors import InputError
from ..plot_style import COLORS, PAGE, STYLE, new_figure
from ..scene import load_scene
from .common import save, show

WARM_UP = 50  # steps before the clock starts
GROUP = 10  # steps that are timed together: a kept Jacobian is new in some of them only
PARTS = ("residual kernels", "Jacobian kernels", "insertion", "factorisation", "solve")  # what the floor is made of
PARTS += ("packing", "SNES and Python", "time scheme", "record")


def typical(function, count: int = 60) -> float:
    """Seconds of a call: median of the better half of `count`."""
    times = []
    for _ in range(count):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return better_half(times)


def better_half(times) -> float:
    """Median of the smaller half."""
    return float(np.median(np.sort(times)[: max(1, len(times) // 2)]))


# -- the parts ---------------------------------------------------------------------------------------------------------


def parts(simulation, count: int = 60) -> dict:
    """Seconds of each part of the work at the present state of a Simulation, done once."""
    system = simulation.system
    system.assemble_jacobian()
    every = [*system.residuals, *system.jacobians]
    residuals, jacobians = _assemblers(system)

    def pack(contributions):
        return typical(lambda: system._refresh(contributions), count)

    def constants():
        system._values.read()
        for c in every:
            c.read_constants()

    together = typical(jacobians, count)
    system.A.assemble()
    insertion = min(_insertion(system, count), together)
    factorise, solve = _direct_solver(system)
    return {
        "residual kernels": typical(residuals, count),
        "Jacobian kernels": together - insertion,
        "insertion": insertion,
        "factorisation": typical(factorise, count),
        "solve": typical(solve, count),
        "packing of a residual": pack(system.residuals),
        "packing of a Jacobian": pack(system.jacobians),
        "packing of a solve": typical(constants, count),
    }


def back_to_back(system):
    """A function of numbers of iterations, residuals and Jacobians: assemblers and direct solver alone, in turn."""
    residuals, jacobians = _assemblers(system)
    factorise, solve = _direct_solver(system)

    def floor(n_K, n_R, n_J):
        for k in range(n_K):
            for _ in range(n_J * k // n_K, n_J * (k + 1) // n_K):
                jacobians()
                factorise()
            solve()
            for _ in range(n_R * k // n_K, n_R * (k + 1) // n_K):
                residuals()

    return floor


def _assemblers(system):
    """The compiled forms of all residuals, and of all Jacobians, added up."""
    b = np.zeros(system.size)

    def residuals():
        for c in system.residuals:
            c.add_to_vector(b)

    def jacobians():
        for c in system.jacobians:
            c.add_to_matrix(c.view)

    return residuals, jacobians


def _insertion(system, count):
    """Of the largest Jacobian blocks: the cheapest form with the same element matrices, assembled the same way."""
    cheapest = []
    for part in (p for p in system.parts if p.name in ("cable", "buoy")):
        form = ufl.inner(part.trial, part.test) * ufl.dx(domain=part.function.function_space.mesh, degree=1)
        view = next(c.view for c in system.jacobians if c.row is part and c.column is part)
        cheapest.append((Contribution(form, part, part), view))
    seconds = typical(lambda: [c.add_to_matrix(view) for c, view in cheapest], count)
    system.A.assemble()
    return seconds


def _direct_solver(system):
    """A factorisation of the present Jacobian, and a solve with it."""
    system.assemble_jacobian()
    A = system.A.copy()
    A.diagonalScale(system._row_scale, system._unknown_scale)
    pc = PETSc.PC().create(A.comm)
    pc.setType("lu")
    pc.setFactorSolverType(system.direct)
    if system.direct == "petsc":
        pc.setFactorOrdering("natural")
    pc.setOperators(A)
    pc.setUp()

    def again():
        A.stateIncrease()  # PETSc factorises again only what has changed
        pc.setUp()

    x, y = A.createVecs()
    x.set(1.0)
    return again, lambda: pc.apply(x, y)


# -- runs --------------------------------------------------------------------------------------------------------------


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
        groups = _groups(simulation, marches[0], recorder, back_to_back(twin.system), steps // GROUP)
        recorder.close()
    done = GROUP * len(groups["steps"])
    n_K, n_R, n_J = (groups[name].sum() for name in ("iterations", "residuals", "jacobians"))
    row = {"jacobian": "kept" if keep else "new", "unknowns": simulation.system.unknowns, "steps": done}
    row |= {"iterations": n_K / done, "residuals": n_R / done, "jacobians": n_J / done}
    row |= _split(parts(simulation, count), groups, n_R / n_K, n_J / n_K, done / n_K)
    for sim in (simulation, twin):
        sim.problem.destroy()
    return row


def _groups(simulation, march, recorder, floor, count):
    """Counts of each group of steps, and its seconds: in Newton's method, in steps, in the record, and of the floor."""
    system, end = simulation.system, simulation.scene.time.end
    in_newton, rows = _clocked(system), []
    while len(rows) < count and end - simulation.t > (GROUP - 0.5) * simulation.scene.time.step:
        counted, in_steps, in_record = _counts(system), 0.0, 0.0
        in_newton.clear()
        for _ in range(GROUP):
            begin = time.process_time()
            step = next(march)
            middle = time.process_time()
            recorder.add(*step)
            in_steps += middle - begin
            in_record += time.process_time() - middle
        numbers = [now - then for now, then in zip(_counts(system), counted, strict=True)]
        begin = time.process_time()
        floor(*numbers)
        rows.append([*numbers, sum(in_newton), in_steps, in_record, time.process_time() - begin])
    names = ["iterations", "residuals", "jacobians", "newton", "steps", "record", "floor"]
    return dict(zip(names, np.array(rows).T, strict=True))


def _clocked(system):
    """Seconds of every solve from now on."""
    solve, times = system.solve, []

    def clocked():
        begin = time.process_time()
        iterations = solve()
        times.append(time.process_time() - begin)
        return iterations

    system.solve = clocked
    return times


def _counts(system):
    return system.iterations_total, system.residuals_total, system.jacobians_total


def _split(part, groups, R, J, steps):
    """Microseconds per Newton iteration; R, J, steps: residuals, Jacobians and steps to an iteration."""
    split = {
        "residual kernels": R * part["residual kernels"],
        "Jacobian kernels": J * part["Jacobian kernels"],
        "insertion": J * part["insertion"],
        "factorisation": J * part["factorisation"],
        "solve": part["solve"],
    }
    packing = R * part["packing of a residual"] + J * part["packing of a Jacobian"]
    split["packing"] = packing + steps * part["packing of a solve"]
    newton, step, record, floor = (
        better_half(groups[name]) * steps / GROUP for name in ("newton", "steps", "record", "floor")
    )
    split["SNES and Python"] = newton - sum(split.values())
    split["time scheme"] = step - newton
    split["record"] = record
    microseconds = {name: 1e6 * seconds for name, seconds in split.items()}
    return microseconds | {
        "total": 1e6 * sum(split.values()),
        "floor": 1e6 * floor,
        "ratio": float(np.median(groups["newton"] / groups["floor"])),
        "ratio of a step": float(np.median((groups["steps"] + groups["record"]) / groups["floor"])),
        "milliseconds per step": 1e3 * (step + record) / steps,
    }


# -- the study ---------------------------------------------------------------------------------------------------------


def run(folder: Path, name: str, steps: int) -> None:
    """Measure a scene, print the table, save rows and figure.  Raises InputError for a scene without enough steps."""
    scene = load_scene(name)
    if scene.time is None:
        raise InputError("Missing section [time]: step-cost measures a run.")
    if scene.time.tolerance is not None or scene.time.end < 2 * WARM_UP * scene.time.step:
        raise InputError(
            f"step-cost needs a run of at least {2 * WARM_UP} equal steps: no time.tolerance, time.end larger."
        )
    if MPI.COMM_WORLD.size > 1:
        raise InputError("step-cost measures one rank; start it without mpirun.")
    rows = [measure(scene, steps, keep) for keep in (False, True)]
    columns = {"jacobian": "Jacobian", "iterations": "its/step", "residuals": "R/step", "jacobians": "J/step"}
    columns |= {key: key for key in rows[0] if key not in columns and key not in ("steps", "unknowns")}
    versions = ", ".join(f"{key} {value}" for key, value in compat.versions().items())
    notes = [
        *(
            f"{row['jacobian']} Jacobians: a Newton iteration takes {row['ratio']:.2f} times its floor of "
            f"{row['floor']:.0f} us, with all that a step does besides {row['ratio of a step']:.2f} times; "
            f"{row['milliseconds per step']:.2f} ms per step"
            for row in rows
        ),
        f"{rows[0]['unknowns']} unknowns, {rows[0]['steps']} steps; {versions}",
    ]
    transposed = [
        {"part": heading, **{row["jacobian"]: row[key] for row in rows}}
        for key, heading in columns.items()
        if key != "jacobian"
    ]
    title = f"Cost of a Newton iteration of {scene.title or name} [us]"
    show(title, transposed, {"part": "", "new": "new Jacobians", "kept": "kept Jacobians"}, notes)
    save(folder, f"step_cost_{Path(name).stem}", rows, figure(rows), notes)


def figure(rows: list[dict]):
    """Stacked bars of the parts, and the floor."""
    with matplotlib.rc_context(STYLE):
        fig = new_figure(PAGE, 2.2)
        axes = fig.add_subplot()
        for k, row in enumerate(rows):
            left = 0.0
            for name, color in zip(PARTS, [*list(COLORS.values())[:5], "0.45", "0.6", "0.75", "0.88"], strict=True):
                axes.barh(k, row[name], left=left, height=0.6, color=color, label=name if k == 0 else None)
                left += row[name]
            axes.plot([row["floor"]] * 2, [k - 0.4, k + 0.4], color="k", lw=1.5, label="floor" if k == 0 else None)
        axes.set_yticks(range(len(rows)), [f"{row['jacobian']} Jacobians" for row in rows])
        axes.set_xlabel("microseconds per Newton iteration")
        axes.legend(fontsize="x-small", ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.35), frameon=False)
    return fig
