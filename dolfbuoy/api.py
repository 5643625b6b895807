"""The Python interface: `load_scene`, `solve_static`, `simulate`."""

import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from mpi4py import MPI

from . import results
from .dynamics import Simulation
from .observe import Observer, attributes
from .scene import Scene, load_scene
from .statics import solve_equilibrium


def solve_static(scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, **overrides) -> xr.Dataset:
    """Equilibrium in the mean current, wind and external force, without waves.

    out: folder for static.nc and scene.toml.  Returns the record of `results` without time (complete on rank 0).
    Raises InputError for an impossible scene, SolveError when the solve fails.
    """
    scene = load_scene(scene, **overrides)
    folder = _folder(scene, out, comm)
    problem = solve_equilibrium(scene, comm)
    observer = Observer(problem)
    fixed = observer.fixed()
    values = observer.values(problem.end_tension() if problem.cable else None)
    if problem.cable:
        values |= observer.frame()
    values["newton_iterations"] = problem.iterations
    values["smallest_tension"] = problem.smallest_tension() if problem.cable else None
    smallest = values.pop("smallest_tension")
    info = attributes(problem) | ({"smallest_tension_N": smallest} if smallest is not None else {})
    problem.destroy()
    if comm.rank != 0:
        return xr.Dataset()
    dataset = results.dataset_of(values, fixed, info)
    if folder is not None:
        dataset.to_netcdf(folder / "static.nc", engine="netcdf4")
    return dataset


def simulate(
    scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, progress=None, **overrides
) -> xr.Dataset:
    """Run a scene in time and return its record (complete on rank 0).

    out: folder for results.nc and scene.toml, written as the run goes.  progress: called after each step with the
    Simulation and the step's iterations.  overrides: see load_scene.  Raises InputError for an impossible scene,
    SolveError when a step fails for good; everything computed until then is on disk.
    """
    scene = load_scene(scene, **overrides)
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return simulate(scene, comm.bcast(folder), comm, progress)
    folder = _folder(scene, out, comm)
    simulation = Simulation(scene, comm)
    recorder = Recorder(simulation, folder / "results.nc")
    try:
        for step, iterations in simulation.run():
            recorder.add(step, iterations)
            if progress is not None:
                progress(simulation, iterations)
    finally:
        recorder.close()
        simulation.problem.destroy()
    return results.read(folder / "results.nc") if comm.rank == 0 else xr.Dataset()


class Recorder:
    """Writes the record of a Simulation, step by step; collective, the file belongs to rank 0."""

    def __init__(self, simulation, path):
        self.simulation, scene = simulation, simulation.scene
        self.observer = Observer(simulation.problem)
        self.interval = scene.time.output_every or max(scene.time.end / 200, scene.time.step)
        fixed = self.observer.fixed()
        self.root = simulation.comm.rank == 0
        self.record = results.Record(path, attributes(simulation.problem), fixed) if self.root else None
        self._next_frame = 0.0
        self.add(0.0, 0)
        if self.root:
            self.record.flush()

    def add(self, step, iterations):
        """The present state."""
        sim = self.simulation
        values = {"time": sim.t, "time_step": step, "newton_iterations": iterations}
        values |= self.observer.values(sim.end_tension)
        tolerance = 1e-6 * sim.scene.time.step
        if sim.cable and (sim.t >= self._next_frame - tolerance or sim.t >= sim.scene.time.end - tolerance):
            values |= {"frame": sim.t} | self.observer.frame()
            self._next_frame = self.interval * (np.floor((sim.t + tolerance) / self.interval) + 1)
        if self.root:
            self.record.add(values)

    def close(self):
        """Write what is left, with the run's totals."""
        if not self.root:
            return
        sim = self.simulation
        self.record.attributes |= {
            "failed_steps": sim.control.failed,
            "rejected_steps": sim.control.rejected,
            "restarts": sim.control.restarts,
            "quaternion_drift": sim.quaternion_drift,
            "linear_solver_fallbacks": sim.system.fallbacks,
        }
        self.record.flush()


def _folder(scene, out, comm):
    """Make the folder of a run and put the complete scene into it."""
    if out is None:
        return None
    folder = Path(out)
    if comm.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
        scene.save(folder / "scene.toml")
    comm.barrier()
    return folder
