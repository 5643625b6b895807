"""The Python interface: `load_scene`, `solve_static`, `simulate`."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from .errors import InputError
from .motion.simulation import Simulation
from .parallel import interruption
from .results import checkpoint
from .results import record as results
from .results.observe import Observer, attributes
from .results.recorder import Recorder
from .scene import Scene, load_scene
from .statics.equilibrium import solve_equilibrium

if TYPE_CHECKING:
    import xarray as xr


def solve_static(scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, **overrides) -> "xr.Dataset":
    """Equilibrium in the mean current, wind and external force, without waves.

    out: folder for static.nc and scene.toml.  Returns the record of `results` without time (complete on rank 0).
    Raises InputError for an impossible scene, SolveError when the solve fails.
    """
    scene = load_scene(scene, **overrides)
    folder = _folder(scene, out, comm)
    problem = solve_equilibrium(scene, comm)
    observer = Observer(problem)
    fixed = observer.fixed()
    values = observer.values(problem.end_tension())
    if problem.lines:
        values |= observer.frame()
    values["newton_iterations"] = problem.iterations
    info = attributes(problem) | {"route": problem.route}
    if problem.lines:
        info["smallest_tension_N"] = problem.smallest_tension()
    problem.destroy()
    if comm.rank != 0:
        return results.nothing()
    dataset = results.dataset_of(values, fixed, info)
    if folder is not None:
        with results.replacing(folder / "static.nc") as part:
            results.reserve(part, dataset.nbytes + 2**17)
            dataset.to_netcdf(part, engine="netcdf4")
    return dataset


def simulate(
    scene: "Scene | str | Path | dict | None" = None,
    out=None,
    comm=MPI.COMM_WORLD,
    progress=None,
    resume=None,
    **overrides,
) -> "xr.Dataset":
    """Run a scene in time and return its record (complete on rank 0).

    out: folder for results.nc, scene.toml and checkpoint.npz, written as the run goes.  progress: called after each
    step with the Simulation and the step's iterations.  overrides: see load_scene.  resume: folder of a run that was
    stopped, instead of scene and out; only `time__end` may then be changed.  It goes on as if it had not been stopped.
    Raises InputError for an impossible scene or resumption, SolveError when a step fails for good, OSError when
    nothing can be written; everything computed until then is on disk.
    """
    if resume is not None:
        ends = [value for key, value in overrides.items() if key.replace("__", ".") == "time.end"]
        if scene is not None or out is not None or len(ends) < len(overrides):
            raise InputError("resume: a run goes on with its own scene and folder; only time__end may be changed.")
        point = checkpoint.load(resume, comm.size, *ends)
        return _drive(point.scene, _folder(point.scene, resume, comm), comm, progress, point)
    scene = load_scene(scene, **overrides)
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return simulate(scene, comm.bcast(folder), comm, progress)
    if comm.rank == 0:
        (Path(out) / checkpoint.NAME).unlink(missing_ok=True)  # of another run
    return _drive(scene, _folder(scene, out, comm), comm, progress)


def _drive(scene, folder, comm, progress, point=None):
    """From the start or a Checkpoint to the end."""
    if point is None or not point.complete:
        simulation = Simulation(scene, comm, state=point and point.states[comm.rank])
        recorder, done = Recorder(simulation, folder, point), False
        try:
            for step, iterations in simulation.run():
                recorder.add(step, iterations)
                interruption.check()
                if progress is not None:
                    progress(simulation, iterations)
            recorder.save()
            done = True
        finally:
            recorder.close()
            if done or comm.size == 1:  # collective: after an error on this rank, the others may be elsewhere
                simulation.problem.destroy()
    return results.read(folder / "results.nc") if comm.rank == 0 else results.nothing()


def _folder(scene, out, comm):
    """Make the folder of a run and put the complete scene into it."""
    if out is None:
        return None
    folder = Path(out)
    comm.barrier()  # nobody reads the old scene any more
    if comm.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
        with results.replacing(folder / "scene.toml") as part:
            scene.save(part)
    comm.barrier()
    return folder
