"""The Python interface: `solve_static`, `offsets`, `simulate`, `periodic`, `wave_components`; see `linear_api` too."""

import tempfile
import warnings
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .elsewhere import MPI
from .errors import InputError, NoResult, NotAccurate, SolveError
from .model.airy import sea_of
from .model.pool import Pool
from .model.prescribed_ends import adrift_nowhere
from .motion.periodic import Cycle, in_equal_steps
from .motion.simulation import Simulation
from .motion.stepping import StepControl
from .parallel import interruption
from .parallel.ranks import bcast
from .results import cautions, checkpoint
from .results import folder as folders
from .results import record as results
from .results.observe import Observer, attributes
from .results.offset_record import Rows
from .results.places import places_of
from .results.recorder import Recorder, Unwritten
from .scene import Scene, load_scene
from .statics.equilibrium import solve_equilibrium
from .statics.offsets import rests

if TYPE_CHECKING:
    import xarray as xr


#: Interval of recorded shapes in a limit cycle, unless the scene gives one, as a fraction of the period.
FRAMES = 1 / 24


def solve_static(
    scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, overwrite=False, **overrides
) -> "xr.Dataset":
    """Equilibrium in the mean current, wind and external force, without waves.

    out: folder for static.nc and static.toml; a record of the same scene there is read, one of another is replaced only
    with `overwrite`.  Returns the record of `results` without time (complete on rank 0).
    Raises InputError for an impossible scene or a folder with other contents, SolveError if the solve fails.
    """
    scene = load_scene(scene, **overrides)
    if out is None:
        return _equilibrium(scene, comm)
    with folders.claimed(out, comm):
        if folders.holds(out, "static", scene, overwrite, comm):
            return _read(Path(out) / "static.nc", comm)
        dataset = _equilibrium(scene, comm)
        if comm.rank == 0:
            folders.begin(out, "static", scene)
            results.save(dataset, Path(out) / "static.nc")
            folders.finish(out, "static")
    return dataset


def _equilibrium(scene, comm):
    problem = solve_equilibrium(scene, comm)
    observer = Observer(problem, places=places_of(problem))
    fixed = observer.fixed()
    values = observer.values(problem.end_forces())
    if problem.lines:
        values |= observer.frame()
    values["newton_iterations"] = problem.iterations
    info = attributes(problem)
    if problem.lines:
        info["smallest_tension_N"] = problem.smallest_tension()
    problem.destroy()
    if comm.rank != 0:
        return results.nothing()
    return results.dataset_of(values, fixed, info, observer.labels())


def offsets(
    scene: "Scene | str | Path | dict",
    sizes,
    directions_deg,
    load="force",
    out=None,
    comm=MPI.COMM_WORLD,
    buoys=None,
    **overrides,
) -> "xr.Dataset":
    """Equilibria under a growing horizontal load in many directions: positions, tensions, slack lines, sunk buoys.

    load: "force" [N], added to the scene's external force, or "current" [m/s], which replaces the scene's.  buoys:
    names of those on which the force acts, in full on each (default: all).  out: folder for offsets.nc.  Returns the
    quantities of an equilibrium over directions and sizes (complete on rank 0), with offsets from the equilibrium
    without current, wind and external force; if none is found, `found` is False.  Raises InputError for an impossible
    scene or one without a moored buoy.
    """
    scene = load_scene(scene, **overrides)
    folders.make_ready(out, "offsets", scene, comm)
    rows, reasons = Rows(load), []
    for rest in rests(scene, load, sizes, directions_deg, comm, buoys):
        rows.add(rest)
        reasons += [] if rest.problem else [rest.reason]
        interruption.check()
    if len(reasons) == len(rows):
        raise SolveError(f"Under none of these loads is there an equilibrium that can be found: {reasons[0]}.")
    try:
        at_rest = _equilibrium(adrift_nowhere(scene), comm)
    except SolveError:
        at_rest = {}
    if comm.rank != 0:
        return results.nothing()
    dataset = rows.dataset(at_rest["buoy_position"].values if "buoy_position" in at_rest else None)
    if out is not None:
        folders.keep(out, "offsets", scene, dataset)
    return dataset


def simulate(
    scene: "Scene | str | Path | dict | None" = None,
    out=None,
    comm=MPI.COMM_WORLD,
    progress=None,
    resume=None,
    overwrite=False,
    **overrides,
) -> "xr.Dataset":
    """Run a scene in time and return its record (complete on rank 0).

    out: folder for results.nc, scene.toml and checkpoint.npz, written during the run.  A finished record of the same
    scene there is read instead; that of another scene, or of a stopped run, is replaced only with `overwrite`, as soon
    as the new run begins; files not from dolfbuoy are never replaced.  progress: called after each step with the
    Simulation and the step's iterations.  overrides: see load_scene.  resume: folder of a stopped run, instead of scene
    and out; only `time__end` may then be changed.  It continues as if it had not been stopped.
    Raises InputError for an impossible scene, folder or resumption, SolveError if a step fails for good, NoResult if
    most steps had to be retried with smaller ones, NotAccurate if the accuracy was not reached, OSError if nothing can
    be written; everything computed until then is on disk.  Warns if many steps were retried.
    """
    if resume is not None:
        ends = [value for key, value in overrides.items() if key.replace("__", ".") == "time.end"]
        if scene is not None or out is not None or len(ends) < len(overrides):
            raise InputError("resume: a run goes on with its own scene and folder; only time__end may be changed.")
        checkpoint.load(resume, comm.size, *ends)  # or there is nothing to lock
        if folders.remarks(resume, "run").get("session"):
            raise InputError(f"{resume} was written by a session: only Session(resume = ...) goes on with it.")
        with folders.claimed(resume, comm):
            point = checkpoint.load(resume, comm.size, *ends)
            folders.go_on(resume, point.scene, comm)
            record = _drive(point.scene, Path(resume), comm, progress, point)
            return _with_bars(_sound(record, point.scene, comm), point.scene, Path(resume), comm)
    scene = load_scene(scene, **overrides)
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return simulate(scene, comm.bcast(folder), comm, progress)
    with folders.claimed(out, comm):
        if folders.holds(out, "run", scene, overwrite, comm):
            record = _read(Path(out) / "results.nc", comm)
        elif scene.accuracy is not None and scene.accuracy.target is not None:
            return _accurate(scene, Path(out), comm, progress)
        else:
            record = _drive(scene, Path(out), comm, progress)
        return _with_bars(_sound(record, scene, comm), scene, Path(out), comm)


def periodic(
    scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, accuracy=1e-4, most=1000, **overrides
) -> "xr.Dataset":
    """One period of the limit cycle of a scene driven by regular waves or a moving end, without its transient.

    The period is divided into equal steps, none larger than the scene's, from t = 0 on, with the wave phase there.
    accuracy: estimated error of end forces and points of lines relative to their ranges (`cycle_error`); most: largest
    number of periods run.  out: folder for periodic.nc.  On one rank.  Raises InputError for a scene that has no cycle,
    SolveError if none is found.
    """
    scene = in_equal_steps(load_scene(scene, **overrides))
    if comm.size > 1:
        raise InputError("A limit cycle is looked for on one rank.")
    folders.make_ready(out, "periodic", scene, comm)
    cycle = Cycle(Simulation(scene, comm))
    try:
        found = cycle.find(accuracy, most)
        begin = cycle.simulation.t
        every = scene.time.output_every or FRAMES * cycle.period
        one = load_scene(scene, **{"time.end": begin + cycle.period, "time.output_every": every})
        with tempfile.TemporaryDirectory() as folder:
            state = cycle.simulation.state() | {"control": {}}
            dataset = _drive(one, Path(folder), comm, None, state=state, control=StepControl(one.time.step))
    finally:
        cycle.simulation.problem.destroy()
    for name in {"time", "frame"} & set(dataset.coords):
        dataset[name] = dataset[name].copy(data=dataset[name].values - begin)
    dataset = dataset.assign_attrs(cycle_periods=found.periods, cycle_error=found.error)
    if out is not None:
        folders.keep(out, "periodic", scene, dataset, comm)
    return dataset


def wave_components(scene: "Scene | str | Path | dict", **overrides) -> "xr.Dataset":
    """The components of a scene's waves, eta = sum a cos(k.x - omega t + phase), over `component`.

    amplitude [m], period [s] (in the frame of `waves.period_seen_from`), direction_deg (towards, from x), phase_deg.
    Raises InputError for an impossible scene or one without waves.
    """
    import xarray as xr

    scene = load_scene(scene, **overrides)
    if scene.waves is None:
        raise InputError("waves: must be given, this scene has none.")
    units = {"amplitude": "m", "period": "s", "direction_deg": "degree", "phase_deg": "degree"}
    values = zip(units, sea_of(scene).as_rows().T, strict=True)
    return xr.Dataset({name: ("component", array, {"units": units[name]}) for name, array in values})


def _drive(scene, folder, comm, progress, point=None, state=None, control=None):
    """Run from the start, a state or a Checkpoint to the end; control: step control, by default that of the scene."""
    if point is None or not point.complete:
        simulation = Simulation(scene, comm, state=point.states[comm.rank] if point else state)
        simulation.control = control or simulation.control
        if point is None and comm.rank == 0:
            folders.begin(folder, "run", scene)
        recorder, done = Recorder(simulation, folder, point, corrected=_corrected(scene)), False
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
    if comm.rank == 0:
        folders.finish(folder, "run")
    return _read(folder / "results.nc", comm, own=point is None)


def _corrected(scene):
    """Factory of the trajectory corrected for the error of time steps, if requested by the scene and possible."""
    if scene.accuracy is None or scene.accuracy.estimate not in ("time", "both"):
        return None
    from .accuracy.companion import followed
    from .motion.corrected import Corrected, can_follow

    if not can_follow(scene):
        return None
    return Corrected if scene.accuracy.estimate == "time" else partial(Corrected, until=followed(scene))


def _with_bars(record, scene, folder, comm):
    """The record of a finished run, with error bars if requested by the scene."""
    if scene.accuracy is None or scene.accuracy.estimate == "none" or bcast(comm, "bar" in record):
        return record
    from .accuracy import bars, companion

    if scene.accuracy.estimate == "time":
        coarse, events = None, {}
    else:
        pool = Pool()  # companions around events differ from each other in numbers only
        coarse = _tried(companion.companion_of(scene), comm, pool)
        windows = bcast(comm, companion.events_of(scene, record) if comm.rank == 0 else None)
        found = {window: _tried(companion.companion_around(scene, window), comm, pool) for window in windows}
        pool.clear()
        events = {window: one for window, one in found.items() if not isinstance(one, Exception)}
    if comm.rank != 0:
        return record
    return _put(record, bars.bars_of(record, scene, coarse, events=events), scene, folder)


def _tried(scene, comm, pool):
    """The record of a run used only for comparison, or the error if it failed."""
    try:
        return _quietly(scene, comm, pool)
    except SolveError as error:
        pool.clear()  # the failed run may have left a problem in an undefined state
        return error


def _accurate(scene, folder, comm, progress):
    """The record of a run with settings whose error bars meet the scene's target.  Raises NotAccurate if none do."""
    from .accuracy import target

    pool = Pool()

    def run(one, last):
        return _sound(_drive(one, folder, comm, progress), one, comm) if last else _quietly(one, comm, pool)

    found = target.reach(scene, run, comm)
    pool.clear()
    record = found.record
    if comm.rank == 0:
        record = _put(record, (found.bars, found.sentences), found.scene, folder)
    if found.worst > target.ENOUGH:
        raise NotAccurate(target.sentence_of(found), record)
    if comm.rank == 0:
        folders.finish(folder, "run", requested=scene)
    return record


def _quietly(scene, comm, pool):
    """The series of a run used only for comparison, without error bars of its own."""
    simulation = Simulation(load_scene(scene, accuracy=None), comm, pool=pool)
    recorder = Unwritten(simulation)
    for step, iterations in simulation.run():
        recorder.add(step, iterations)
        interruption.check()
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        return _sound(recorder.series() if comm.rank == 0 else results.nothing(), scene, comm)


def _put(record, bars, scene, folder):
    """Add error bars to the record, and to the file."""
    from .accuracy.bars import dataset_of

    found = dataset_of(*bars, scene)
    results.put(folder / "results.nc", found)
    return record.merge(found).assign_attrs(found.attrs)


def _sound(record, scene, comm):
    """The record of a finished run, with a warning if steps were often retried.  Raises NoResult if most were."""
    unsound = cautions.refused(record, scene) if comm.rank == 0 else None
    if (sentence := bcast(comm, unsound and str(unsound))) is not None:
        raise unsound or NoResult(sentence)
    if comm.rank == 0 and cautions.cut(record, scene) > cautions.OFTEN:
        warnings.warn(*cautions.about_retries(record, scene), stacklevel=3)
    return record


def _read(path, comm, own=False):
    return results.read(path, own) if comm.rank == 0 else results.nothing()
