"""Record and checkpoint of a run, written as it goes."""

import time as clock

import numpy as np
from mpi4py import MPI

from ..parallel.ranks import combined, told
from . import checkpoint
from .observe import Observer, attributes
from .record import Record


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
        labels = self.observer.labels()
        self.record = Record(folder / "results.nc", attributes(simulation.problem), fixed, labels)
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
        values |= self.observer.values(sim.end_forces)
        tolerance = 1e-6 * sim.scene.time.step
        if sim.problem.lines and (sim.t >= self._next_frame - tolerance or sim.t >= sim.scene.time.end - tolerance):
            values |= {"frame": sim.t} | self.observer.frame(sim.line_velocity)
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
