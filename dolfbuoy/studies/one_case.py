"""One case of a sweep: run, with a checkpoint if it takes long, and reduced to the stored result."""

import math
import os
import shutil
import time as clock
from contextlib import suppress
from pathlib import Path
from typing import Any

import xarray as xr

from ..accuracy.bars import bars_of, dataset_of
from ..accuracy.companion import companion_of
from ..elsewhere import MPI
from ..errors import InputError, NoResult, SolveError
from ..model.pool import Pool
from ..motion.simulation import Simulation
from ..page.folder import write_pages
from ..parallel import interruption
from ..parallel.cases import key
from ..results import cautions, checkpoint
from ..results import folder as folders
from ..results.bars import by_label
from ..results.record import read
from ..results.recorder import Recorder, Unwritten
from ..results.sample import lives, numbers_of, sample_of
from ..scene import Scene, varied
from ..scene.variants import in_words
from ..version import now
from ..writing import made
from .study import Row

#: Problems of previous cases, reused because set-up may take longer than a case.
POOL = Pool()
#: Bins of the peaks and ranges stored for a case.
BINS = 64


def evaluate(
    case: Row, base: Scene, running: str | None = None, deadline: float = math.inf, keep: str | None = None
) -> Row:
    """Run one case on this rank alone; a failure is a result too, with its reason.

    case: "changes" of the scene `base`, and its digest as "base".  running: folder from which the case can be resumed.
    deadline: on the clock of time.time(), when the case is stopped.  keep: folder in which record and page of the case
    are kept, in a subfolder; needs `running`.  Raises interruption.TimeUp at the deadline, KeyboardInterrupt when
    interrupted.
    """
    begin = clock.monotonic()
    try:
        scene = varied(base, case["changes"])
        folder = Path(running) / key(case) if running else None
        record = run(scene, folder, deadline, keep is not None)
        found: Row = {"status": "done", "statistics": numbers_of(record), "sample": None}
        with suppress(InputError):  # for a run that ends within its ramp
            found["sample"] = sample_of(record, scene, bins=BINS)
            for label, life in lives(found["sample"]).items():
                found["statistics"].setdefault(label, {})["life"] = life
        found["cut"] = cautions.cut(record, scene)
        if scene.accuracy is not None and scene.accuracy.estimate != "none":
            try:
                companion: xr.Dataset | SolveError = run(companion_of(scene), None, deadline)
            except SolveError as error:
                companion = error
            for label, bars in by_label(dataset_of(*bars_of(record, scene, companion), scene)).items():
                found["statistics"].get(label, {}).update(bars)
        if keep is not None and folder is not None:
            _keep(folder, Path(keep) / key(case), case["changes"])
    except Exception as error:  # whatever it is, other cases continue
        found = failed(error)
    found |= {"changes": case["changes"], "base": case["base"]}
    return found | {"seconds": clock.monotonic() - begin, "created": now()}


def failed(error: Exception) -> Row:
    """Result of a case that failed."""
    return {"status": f"{type(error).__name__}: {error}", "statistics": {}, "sample": None}


def _keep(folder: Path, place: Path, changes: Row) -> None:
    """Write the page of a finished case, and move its folder into place."""
    folders.finish(folder, "run")
    folders.remark(folder, "run", case=in_words(changes))
    write_pages(folder, "results.nc")
    made(place.parent, place.name)
    for file in list(folder.iterdir()):
        os.replace(file, place / file.name)
    folder.rmdir()


def run(
    scene: Scene, folder: Path | None = None, deadline: float = math.inf, keep: bool = False, most: float = math.inf
) -> xr.Dataset:
    """The series of a run on this rank alone, resumed from a checkpoint in the folder, which is removed at the end.

    It leaves a checkpoint if interrupted between steps, or at the deadline.  keep: do not remove the folder, with the
    whole record.  most: number of failed steps at which the run is given up (NoResult).
    """
    if clock.time() > deadline:
        raise interruption.TimeUp
    point = None
    if folder is not None and (folder / checkpoint.NAME).is_file():
        with suppress(InputError):  # an unreadable checkpoint is ignored
            kept = checkpoint.load(folder, 1)
            folders.go_on(folder, kept.scene)
            point = kept
    if point is None:
        _remove(folder)
    try:
        simulation = Simulation(scene, MPI.COMM_SELF, state=point and point.states[0], pool=POOL)
        recorder = _CaseRecorder(simulation, folder, point)
        with interruption.held():
            loop = clock.process_time()
            for step, iterations in simulation.run():
                recorder.add(step, iterations)
                if simulation.control.failed > most:
                    raise NoResult(f"{simulation.control.failed} steps failed until t = {simulation.t:.3g} s.")
                if interruption.received() or clock.time() > deadline:
                    recorder.save()
                    raise KeyboardInterrupt if interruption.received() else interruption.TimeUp
            loop = clock.process_time() - loop
        record = recorder.finished(keep).assign_attrs(loop_seconds=loop)
        if (unsound := cautions.refused(record, scene)) is not None:
            raise unsound
    except interruption.TimeUp:
        raise
    except BaseException as error:
        if not isinstance(error, NoResult):
            POOL.clear()  # an interrupted case may have left a problem in any state
        if isinstance(error, Exception):
            _remove(folder)
        raise
    if not keep:
        _remove(folder)
    return record


def _remove(folder: Path | None) -> None:
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


class _CaseRecorder(Unwritten):
    """Writes nothing for a case shorter than a pause, and nothing at all without a folder."""

    shapes = True

    def __init__(self, simulation: Simulation, folder: Path | None, point: Any):
        super().__init__(simulation, folder, point)
        self._somewhere = folder is not None

    def save(self) -> None:
        if not self._somewhere:
            super().save()
            return
        if not self.folder.is_dir():
            made(self.folder.parent, self.folder.name)
            folders.begin(self.folder, "run", self.simulation.scene)
        Recorder.save(self)

    def finished(self, keep: bool) -> xr.Dataset:
        """The record of the whole run; keep: on disk, with its last state."""
        if keep:
            self.save()
        elif self.record.counts["time"] == 0:
            self.record.extremes = self._extremes.values(self.observer)
            return self.series()
        self.close()
        return read(self.folder / "results.nc")
