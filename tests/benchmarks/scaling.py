"""How cost grows: with the elements of one cable, with its stiffness, with ranks, with solvers, and for many scenes.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/scaling.py [linear|stiffness|strong|weak|sweep ...] [--quick]

Without a name all five are done.  Each case is a program of its own, under mpirun where it has several ranks, so that
its memory is its own; finished cases are kept in DIR/cases and an interrupted benchmark goes on where it was.  The
cable is that of `driven`, P1-P0, in as many elements as asked for.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time as clock
from pathlib import Path

import machine
import matplotlib
import numpy as np
from store import kept

from dolfbuoy.parallel.cases import fingerprint
from dolfbuoy.results.style import COLORS, PAGE, STYLE, new_figure
from dolfbuoy.results.tables import show
from dolfbuoy.studies.study import Table, save

#: Linear solvers of the steps, by name: a PETSc package for a factorisation that ranks share, or PETSc options.  The
#: default is "petsc", elimination along the cable, by each rank for itself.
SOLVERS = {
    "default": None,
    "mumps": "mumps",
    "superlu_dist": "superlu_dist",
    "gmres + bjacobi/ilu(3)": {
        "ksp_type": "gmres",
        "pc_type": "bjacobi",
        "sub_pc_type": "ilu",
        "sub_pc_factor_levels": 3,
    },
    "gmres + bjacobi/lu": {"ksp_type": "gmres", "pc_type": "bjacobi", "sub_pc_type": "lu"},
    "gmres + asm/lu": {"ksp_type": "gmres", "pc_type": "asm", "sub_pc_type": "lu"},
}
#: Elimination along the cable, as the default solver does (a saddle point has zeros on its diagonal).
NATURAL = {"sub_pc_factor_mat_ordering_type": "natural", "ksp_max_it": 200, "ksp_pc_side": "right"}
STEPS = 4
#: Above this, less is measured: a case takes minutes.
LARGE = 100_000


# -- one case, in a process of its own ---------------------------------------------------------------------------------


def evaluate_here(case: dict) -> dict | None:
    """Equilibrium and a few steps of each scheme; seconds, iterations and memory; None on all ranks but 0."""
    from mpi4py import MPI

    from dolfbuoy.errors import SolveError
    from dolfbuoy.motion.simulation import Simulation
    from dolfbuoy.scene import load_scene

    comm = MPI.COMM_WORLD
    changes = {"cable.elements": case["elements"], "cable.position_degree": 1, "cable.tension_degree": 0}
    changes |= {"cable.axial_stiffness": case.get("axial_stiffness", 2.3e8)}
    result = {"ranks": comm.size}
    for scheme in ("backward-euler", "bdf2") if case["elements"] <= LARGE else ("bdf2",):
        time = {"end": 100.0, "step": 0.01, "scheme": scheme}
        scene = load_scene("driven", **changes, time=time)
        comm.barrier()
        begin = clock.perf_counter()
        simulation = Simulation(scene, comm)
        result["setup_s"] = clock.perf_counter() - begin  # the second time: forms are compiled
        _use(simulation.newton, SOLVERS[case["solver"]])
        try:
            result |= _steps(simulation, scheme, comm)
        except SolveError as error:
            return {"failed": str(error)} if comm.rank == 0 else None
        result["unknowns"] = simulation.system.unknowns
        simulation.problem.destroy()
    result["memory_MB"] = comm.allreduce(_memory())
    return result if comm.rank == 0 else None


def _use(newton, solver):
    """Another linear solver, in the way of one that a scene asks for."""
    newton.everywhere &= solver is None
    if isinstance(solver, str):
        newton.direct = solver
    elif solver:
        newton.options.scene = solver | NATURAL
    newton.choose_solver(newton.direct)


def _steps(simulation, scheme, comm):
    simulation.step(0.01)  # the first of BDF2 is one of backward Euler; factorisation and caches warm up
    before, ksp = simulation.newton.iterations_total, simulation.newton.snes.getKSP()
    fallbacks = simulation.newton.fallbacks
    iterations, seconds = 0, []
    for _ in range(STEPS):
        comm.barrier()
        begin = clock.perf_counter()
        count = simulation.step(0.01)
        seconds.append((clock.perf_counter() - begin) / count)
        iterations += count
    assert iterations == simulation.newton.iterations_total - before
    found = {"iteration_s": float(np.median(seconds)), "iterations_per_step": iterations / STEPS}
    found |= {"linear_iterations": ksp.getIterationNumber()}
    found |= {"fallbacks": simulation.newton.fallbacks - fallbacks}
    return {f"{scheme}_{key}": value for key, value in found.items()}


def _memory():
    """Resident memory of this process at its peak [MB]."""
    text = Path("/proc/self/status").read_text()
    return int(text.split("VmHWM:")[1].split()[0]) / 1024


def evaluate(case: dict) -> dict:
    """A case in a process of its own."""
    case = {key: value for key, value in case.items() if key != "sources"}
    command = [sys.executable, __file__, "--one", json.dumps(case)]
    return _launch(command, case["ranks"])


def _launch(command, ranks):
    """The JSON that a command prints last, under mpirun with several ranks."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        environment |= {"OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_btl": "^tcp"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"failed": (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1][:200]}
    return json.loads(done.stdout.strip().splitlines()[-1])


# -- studies -----------------------------------------------------------------------------------------------------------


def linear(ask, options):
    """Time and memory of one process, 20 to 20,000 elements; exponents between the larger sizes."""
    sizes = (20, 60, 200, 600, 2000) if options.quick else (20, 60, 200, 600, 2000, 6000, 20000)
    rows = [ask(elements=n, ranks=1, solver="default") for n in sizes]
    base = rows[0]["memory_MB"]
    for before, row in zip([None, *rows], rows, strict=False):
        row["kB_per_element"] = 1024 * (row["memory_MB"] - base) / row["elements"]
        if before:
            ratio = math.log(row["elements"] / before["elements"])
            row["exponent"] = math.log(row["bdf2_iteration_s"] / before["bdf2_iteration_s"]) / ratio
    return rows


def stiffness(ask, options):
    """Iterations and time of an iteration from EA = 1e6 N to inextensible, at one size."""
    values = (1e6, 2.3e8, 1e12, math.inf) if options.quick else (1e6, 1e7, 2.3e8, 1e10, 1e12, math.inf)
    return [ask(elements=200, ranks=1, solver="default", axial_stiffness=value) for value in values]


def strong(ask, options):
    """One cable of each size on 1 and 2 ranks, with every solver."""
    sizes = (1000, 10000) if options.quick else (1000, 3000, 10000, 30000, 100000, 300000, 1000000)
    rows = []
    for n in (n for n in sizes if n <= options.largest):
        for solver in SOLVERS:
            if n > LARGE and solver not in ("default", "gmres + bjacobi/lu"):
                continue  # minutes each
            for ranks in (1, 2):
                rows.append(ask(elements=n, ranks=ranks, solver=solver))
    serial = {row["elements"]: row for row in rows if row["ranks"] == 1 and row["solver"] == "default"}
    for row in rows:
        if "failed" not in row:
            row["speedup"] = serial[row["elements"]]["bdf2_iteration_s"] / row["bdf2_iteration_s"]
    return rows


def _pays_from(rows):
    """From which size on two ranks are faster than the one-rank default, for each solver."""
    said, sizes = [], sorted({row["elements"] for row in rows})
    for solver in dict.fromkeys(row["solver"] for row in rows):
        faster = {r["elements"] for r in rows if (r["solver"], r["ranks"]) == (solver, 2) and r.get("speedup", 0) > 1}
        first = next((n for i, n in enumerate(sizes) if set(sizes[i:]) <= faster), None)
        said.append(f"{solver}: two ranks pay {f'from {first:,} elements on' if first else 'at no size measured'}.")
    return said


def weak(ask, options):
    """As many elements on each of 1 and 2 ranks."""
    sizes = (1000, 10000) if options.quick else (1000, 10000, 100000, 500000)
    rows = []
    for n in (n for n in sizes if n <= options.largest):
        pair = [ask(elements=n * ranks, ranks=ranks, solver="default") for ranks in (1, 2)]
        for row in pair:
            row["efficiency"] = pair[0]["bdf2_iteration_s"] / row["bdf2_iteration_s"] if "failed" not in row else None
        rows += pair
    return rows


def sweep(ask, options):
    """Independent scenes on 1, 2 and 3 ranks."""
    count = 8 if options.quick else 64
    rows = [ask(sweep=count, ranks=ranks) for ranks in (1, 2, 3)]
    for row in rows:
        if "failed" not in row:
            row["speedup"] = rows[0]["wall_s"] / row["wall_s"]
    return rows


def evaluate_sweep(case):
    """Wall time of `dolfbuoy sweep` over variants of `short`, forms compiled before."""
    end = 1.0 if case["sweep"] < 64 else 5.0
    amplitudes = ",".join(f"{a:.4f}" for a in np.linspace(0.5, 1.5, case["sweep"]))
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "cases.csv"
        rows = "\n".join(f"{a},{end}" for a in amplitudes.split(","))
        table.write_text(f"waves.amplitude,time.end\n{rows}\n")
        arguments = {"table": str(table), "out": str(Path(folder) / "out")}
        return _launch([sys.executable, __file__, "--one", json.dumps(arguments)], case["ranks"])


def sweep_here(case: dict) -> dict | None:
    """The sweep of a table by all ranks; None on all but 0."""
    from mpi4py import MPI

    from dolfbuoy.studies.sweep import sweep as run_all

    comm = MPI.COMM_WORLD
    comm.barrier()
    begin = clock.perf_counter()
    found = run_all("short", [], Path(case["table"]), Path(case["out"]))
    if found is None:
        return None
    return {"wall_s": clock.perf_counter() - begin, "done": int((found.status == "done").sum())}


STUDIES = {study.__name__: study for study in (linear, stiffness, strong, weak, sweep)}
COLUMNS = {
    "elements": "elements",
    "axial_stiffness": "EA [N]",
    "sweep": "scenes",
    "ranks": "ranks",
    "solver": "solver",
    "setup_s": "set-up [s]",
    "backward-euler_iteration_s": "Newton it., BE [s]",
    "bdf2_iteration_s": "Newton it., BDF2 [s]",
    "backward-euler_iterations_per_step": "it./step, BE",
    "bdf2_iterations_per_step": "it./step, BDF2",
    "bdf2_linear_iterations": "lin. it.",
    "memory_MB": "memory [MB]",
    "kB_per_element": "kB/element",
    "exponent": "exponent",
    "wall_s": "wall [s]",
    "speedup": "speed-up",
    "efficiency": "efficiency",
    "failed": "failed",
}


@matplotlib.rc_context(STYLE)
def draw(name, rows):
    """Time of an iteration over elements; None for studies without sizes."""
    if name not in ("linear", "strong"):
        return None
    figure = new_figure(PAGE / 2, 2.6)
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log", xlabel="elements", ylabel="time of a Newton iteration, BDF2 [s]")
    lines = {}
    for row in rows:
        if "failed" not in row:
            lines.setdefault((row["solver"], row["ranks"]), []).append((row["elements"], row["bdf2_iteration_s"]))
    colors = dict(zip(SOLVERS, [COLORS[c] for c in ("ink", "blue", "red", "green", "orange", "sky")], strict=True))
    for (solver, ranks), line in lines.items():
        style = "o-" if ranks == 1 else "o--"
        axes.plot(*zip(*line, strict=True), style, ms=3, color=colors[solver], label=f"{solver}, {ranks} rank(s)")
    axes.legend(fontsize=5.5)
    return figure


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=", ".join(STUDIES))
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/scaling"))
    parser.add_argument("--quick", action="store_true", help="small sizes")
    parser.add_argument("--largest", type=int, default=10**6, help="elements, of strong and weak [1000000]")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        case = json.loads(options.one)
        result = sweep_here(case) if "table" in case else evaluate_here(case)
        if result is not None:
            print(json.dumps(result))
        return
    if unknown := set(options.studies) - set(STUDIES):
        parser.error(f"no study {', '.join(sorted(unknown))}; there are {', '.join(STUDIES)}")

    def ask(**case):
        do = evaluate_sweep if "sweep" in case else evaluate
        found = kept(do, case | {"sources": fingerprint()}, options.out, lambda c: print(c, file=sys.stderr))
        return case | found

    for name in options.studies or STUDIES:
        rows = STUDIES[name](ask, options)
        used = {key: heading for key, heading in COLUMNS.items() if any(row.get(key) is not None for row in rows)}
        notes = [machine.sentence(), *(_pays_from(rows) if name == "strong" else [])]
        show(f"{name}: {STUDIES[name].__doc__.splitlines()[0]}", rows, used, notes)
        save(options.out, Table(f"scaling-{name}", rows, notes=notes, figure=draw(name, rows)))


if __name__ == "__main__":
    main()
