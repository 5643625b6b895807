"""The Python interface: `load_scene`, `solve_static`, `simulate`."""

import tempfile
import time as clock
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from .errors import InputError
from .motion.simulation import Simulation
from .parallel import interruption
from .parallel.ranks import combined, told
from .results import checkpoint
from .results import record as results
from .results.observe import Observer, attributes
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
    values = observer.values(problem.end_tension() if problem.lines else None)
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


class Recorder:
    """Writes record and checkpoint of a Simulation, step by step; collective, the files belong to rank 0.

    Every `pause` seconds of wall time, and less often where that would cost more than the `share` of the run.
    """

    pause, share = 1.0, 0.02

    def __init__(self, simulation, folder, point=None):
        self.simulation, self.folder, scene = simulation, folder, simulation.scene
        self.observer = Observer(simulation.problem)
        self.interval = scene.time.output_every or max(scene.time.end / 200, scene.time.step)
        fixed = self.observer.fixed()
        self.root = simulation.comm.rank == 0
        self.record = results.Record(folder / "results.nc", attributes(simulation.problem), fixed)
        self._drift = 0.0
        self._next_frame, self._next_save = 0.0, clock.monotonic() + self.pause
        if point is None:
            self.add(0.0, 0)
            self.save()
        else:
            self._next_frame = point.next_frame
            if self.root:
                self.record.take_up(point.rows)

    def add(self, step, iterations):
        """The present state."""
        sim = self.simulation
        values = {"time": sim.t, "time_step": step, "newton_iterations": iterations}
        values |= self.observer.values(sim.end_tension)
        tolerance = 1e-6 * sim.scene.time.step
        if sim.problem.lines and (sim.t >= self._next_frame - tolerance or sim.t >= sim.scene.time.end - tolerance):
            values |= {"frame": sim.t} | self.observer.frame()
            self._next_frame = self.interval * (np.floor((sim.t + tolerance) / self.interval) + 1)
        if self.root:
            self.record.add(values)
        if told(sim.comm, clock.monotonic() > self._next_save):
            self.save()

    def save(self):
        """Bring all rows to the disk, then the state after the last one."""
        begin = clock.monotonic()
        comm = self.simulation.comm
        states = comm.gather(self.simulation.state())
        self._drift = combined(comm, self.simulation.quaternion_drift, MPI.MAX)  # the buoy is on one rank only
        if self.root:
            self._flush()
            scene, rows = self.simulation.scene, self.record.counts
            checkpoint.write(checkpoint.Checkpoint(self.folder, scene, states, rows, self._next_frame))
        end = clock.monotonic()
        self._next_save = end + max(self.pause, (end - begin) / self.share)

    def close(self):
        """Bring what is left to the disk.  No checkpoint: a step may have been broken off in the middle."""
        if self.root and self.record.pending:
            self._flush()

    def _flush(self):
        sim = self.simulation
        self.record.attributes |= {
            "failed_steps": sim.control.failed,
            "rejected_steps": sim.control.rejected,
            "restarts": sim.control.restarts,
            "quaternion_drift": self._drift,
            "linear_solver_fallbacks": sim.newton.fallbacks,
        }
        self.record.flush()


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
