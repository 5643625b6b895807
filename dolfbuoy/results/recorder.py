"""Record and checkpoint of a run, written during the run."""

from __future__ import annotations

import json
import math
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..elsewhere import MPI
from ..parallel.ranks import allreduce, bcast
from ..scene.settings import frame_interval
from . import checkpoint
from .observe import Observer, attributes
from .places import Place, places_of
from .quantities import errors
from .record import Record, nothing
from .running import Extremes

if TYPE_CHECKING:
    import xarray as xr

    from ..motion.simulation import Simulation

ROWS, NUMBERS = 1024, 4_000_000  # instants, or numbers, noted before quantities are computed from them


class Recorder:
    """Writes record and checkpoint of a Simulation, step by step; collective, the files belong to rank 0.

    Writes every `pause` seconds of wall time, or less often if that would take more than the fraction `share` of the
    run. late: write first after such a pause, not at once.  corrected: function (Simulation, state) that makes its
    `motion.corrected.Corrected`; time-step errors are then recorded.  more: returns further numbers and texts for the
    states in checkpoints, by name.
    """

    pause, share = 1.0, 0.02
    shapes = True  #: True to record shapes of the lines

    def __init__(
        self,
        simulation: Simulation,
        folder: Path,
        point: checkpoint.Checkpoint | None = None,
        late: bool = False,
        corrected: Callable[..., Any] | None = None,
        more: Callable[[], dict[str, Any]] = dict,
    ) -> None:
        self.simulation, self.folder, self._more, scene = simulation, folder, more, simulation.scene
        places = self._places(point)
        self.observer = Observer(simulation.problem, simulation.latest_end_forces, places)
        self._extremes = Extremes(simulation.problem)
        self.interval = frame_interval(scene)
        self._fixed = fixed = self.observer.fixed() | self.observer.begun()
        self.root = simulation.comm.rank == 0
        labels = self.observer.labels()
        self.record = Record(folder / "results.nc", attributes(simulation.problem), fixed, labels)
        self._drift, self._parted = 0.0, self.observer.parted(fixed)
        self._end = scene.time.end if self.shapes else math.inf
        self._tolerance = 1e-6 * scene.time.step
        rows = max(1, min(ROWS, NUMBERS // (3 + self.observer.width)))
        self._rows, self._count = np.zeros((rows, 3 + self.observer.width)), 0
        kept = point.states[simulation.comm.rank].get("corrected") if point else None
        self._corrected: Any = corrected(simulation, kept) if corrected else None
        if self._corrected:
            self._corrected_observer = Observer(simulation.problem, self._corrected.end_forces, places)
            self._corrected_rows = np.zeros((rows, self.observer.width))
        self._next_frame, self._next_save = 0.0 if self.shapes else math.inf, clock.monotonic() + self.pause
        if point is None:
            self.add(0.0, 0)
            if not late:
                self.save()
        else:
            self._next_frame = point.next_frame
            self._extremes.restore(point.states[simulation.comm.rank].get("extremes"))
            self.record.extremes = self._extremes.values(self.observer)
            if self.root:
                self.record.take_up(point.rows)

    def _places(self, point: checkpoint.Checkpoint | None) -> list[Place]:
        """Places where tensions are recorded, from the lines' shapes at the start; kept in a checkpoint."""
        if point is None:
            return places_of(self.simulation.problem)
        kept: str = point.states[self.simulation.comm.rank].get("fatigue_places", "[]")
        return [Place(*one) for one in json.loads(kept)]

    def add(self, step: float, iterations: int) -> None:
        """Record the present state."""
        sim, noted = self.simulation, self.observer.note()
        self._extremes.note(sim.t)
        if self.root:
            row = self._rows[self._count]
            row[0], row[1], row[2], row[3:] = sim.t, step, iterations, noted
        if self._corrected:
            self._note_corrected(step, noted)
        if self.root:
            self._count += 1
            if self._count == len(self._rows):
                self._make_values()
        if sim.t >= self._next_frame - self._tolerance or sim.t >= self._end - self._tolerance:
            self._next_frame = self.interval * (np.floor((sim.t + self._tolerance) / self.interval) + 1)
            values = self.observer.frame(sim.line_velocity) if sim.problem.lines else {}
            if self.root and values:
                self.record.add({name: [value] for name, value in ({"frame": sim.t} | values).items()})
        if bcast(sim.comm, clock.monotonic() > self._next_save):
            self.save()

    def _note_corrected(self, step: float, noted: Any) -> None:
        """Note the corrected trajectory too; nan where there is none."""
        if step > 0 and self._corrected.follow(step):
            noted = self._corrected_observer.note()
            self._corrected.leave()
        elif step > 0:
            noted = np.nan
        if self.root:
            self._corrected_rows[self._count] = noted

    def _make_values(self) -> None:
        """Compute the quantities of all noted instants and add them to the record."""
        rows, count, self._count = self._rows[: self._count], self._count, 0
        if count == 0:
            return
        values = self.observer.values_of(rows[:, 3:])
        if self._corrected:
            values |= errors(values, self.observer.values_of(self._corrected_rows[:count]))
        steps = {"time": rows[:, 0], "time_step": rows[:, 1], "newton_iterations": rows[:, 2]}
        self.record.add(steps | values)

    def mark(self) -> dict[str, Any]:
        """Mark of the present instant for `rewind`; its row has been added."""
        lengths = self.record.lengths()
        lengths["time"] += self._count
        return {"lengths": lengths, "next_frame": self._next_frame, "extremes": self._extremes.kept.copy()}

    def rewind(self, mark: dict[str, Any]) -> None:
        """Drop everything recorded since a `mark`; the Simulation must be back at that instant.  Collective."""
        self._next_frame, self._extremes.kept[:] = mark["next_frame"], mark["extremes"]
        made = self.record.lengths()["time"]
        self._count = min(max(mark["lengths"]["time"] - made, 0), self._count)
        if bcast(self.simulation.comm, self.root and self.record.cut(mark["lengths"])):
            self.save()  # the checkpoint on disk is later

    def save(self) -> None:
        """Write all rows to disk, then the state after the last one."""
        begin = clock.monotonic()
        comm = self.simulation.comm
        state = self.simulation.state() | self._more() | {"extremes": self._extremes.kept}
        if self.observer.places:
            state["fatigue_places"] = json.dumps(self.observer.places)
        if self._corrected:
            state["corrected"] = self._corrected.state()
        states = comm.gather(state)
        self._drift = allreduce(comm, self.simulation.quaternion_drift, MPI.MAX)  # the buoy is on one rank only
        self._parted = self.observer.parted(self._fixed)
        self.record.extremes = self._extremes.values(self.observer)
        if self.root:
            self._flush()
            scene, rows = self.simulation.scene, self.record.counts
            checkpoint.write(checkpoint.Checkpoint(self.folder, scene, states, rows, self._next_frame))
        end = clock.monotonic()
        self._next_save = end + max(self.pause, (end - begin) / self.share)

    def close(self) -> None:
        """Write the remaining rows to disk.  No checkpoint: a step may have been interrupted.

        Not collective: on several ranks the extremes are those of the last `save`.
        """
        if self.root and (self._count or self.record.pending):
            if self.simulation.comm.size == 1:
                self.record.extremes = self._extremes.values(self.observer)
            self._flush()

    def _flush(self) -> None:
        self._make_values()
        self._put_attributes()
        self.record.flush()

    def _put_attributes(self) -> None:
        """Set the attributes that describe the run so far."""
        sim = self.simulation
        self.record.attributes |= {
            "failed_steps": sim.control.failed,
            "rejected_steps": sim.control.rejected,
            "restarts": sim.control.restarts,
            "quaternion_drift": self._drift,
            "linear_solver_fallbacks": sim.newton.fallbacks,
        }
        if self._parted:
            self.record.attributes["parted"] = self._parted


class Unwritten(Recorder):
    """A Recorder that keeps the series of a run and writes nothing."""

    shapes = False

    def __init__(
        self,
        simulation: Simulation,
        folder: Path | None = None,
        point: checkpoint.Checkpoint | None = None,
        corrected: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(simulation, folder or Path(), point, late=True, corrected=corrected)

    def save(self) -> None:
        """Do nothing, now and later."""
        self._next_save = math.inf

    def series(self) -> xr.Dataset:
        """Everything added over time, in the form returned by `results.record.read`, on rank 0; collective."""
        self._parted = self.observer.parted(self._fixed)
        if not self.root:
            return nothing()
        self._make_values()
        self._put_attributes()
        return self.record.series()
