"""The Python interface: `load_scene`, `solve_static`, `simulate`, `modes`, `stiffness`, `offsets`, `response`,
`wave_components`."""

import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from .errors import InputError, SolveError
from .linear.linearisation import linearise
from .linear.natural import lowest_modes
from .linear.seaway import Seaway
from .linear.spectrum import bins_of, irregular_waves
from .linear.stiffness import condensed, mooring_stiffness
from .model.components import components_of
from .motion.simulation import Simulation
from .parallel import interruption
from .results import checkpoint
from .results import folder as folders
from .results import record as results
from .results.mode_record import dataset_of_modes
from .results.observe import Observer, attributes
from .results.offset_record import Rows
from .results.recorder import Recorder
from .results.response_record import dataset_of_response
from .results.stiffness_record import dataset_of_stiffness
from .scene import Scene, load_scene
from .statics.equilibrium import solve_equilibrium
from .statics.offsets import rests

if TYPE_CHECKING:
    import xarray as xr

#: Of the linear response, unless others are given [s].
PERIODS = np.concatenate([np.arange(2.0, 12.0, 0.25), np.arange(12.0, 30.5, 1.0)])


def solve_static(
    scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, overwrite=False, **overrides
) -> "xr.Dataset":
    """Equilibrium in the mean current, wind and external force, without waves.

    out: folder for static.nc and static.toml; what it holds of the same scene is read, of another it is replaced with
    `overwrite` only.  Returns the record of `results` without time (complete on rank 0).
    Raises InputError for an impossible scene or a folder with something else in it, SolveError when the solve fails.
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
    observer = Observer(problem)
    fixed = observer.fixed()
    values = observer.values(problem.end_forces())
    if problem.lines:
        values |= observer.frame()
    values["newton_iterations"] = problem.iterations
    info = attributes(problem) | {"route": problem.route}
    if problem.lines:
        info["smallest_tension_N"] = problem.smallest_tension()
    problem.destroy()
    if comm.rank != 0:
        return results.nothing()
    return results.dataset_of(values, fixed, info, observer.labels())


def modes(
    scene: "Scene | str | Path | dict", number=10, out=None, comm=MPI.COMM_WORLD, direction_deg=0.0, **overrides
) -> "xr.Dataset":
    """Natural modes about the equilibrium in the mean current, wind and external force, the slowest first.

    number: of modes, a pair of conjugates once; fewer if there are not as many.  out: folder for modes.nc.
    direction_deg: of surge and roll, from x.  Returns eigenvalues, damping, names and shapes (complete on rank 0).
    Raises InputError for an impossible scene, or for a state with a line that is slack or kinked; SolveError if the
    equilibrium or the modes are not found.
    """
    scene = load_scene(scene, **overrides)
    found = linearise(scene, comm)
    try:
        dataset = dataset_of_modes(found, lowest_modes(found, number, direction_deg))
    finally:
        found.destroy()
    if out is not None:
        folders.keep(out, "modes", scene, dataset, comm)
    return dataset


def stiffness(scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, **overrides) -> "xr.Dataset":
    """Restoring matrices (6, 6) about C at the equilibrium: of the mooring, of the hull, and of both.

    Forces [N] and torques [N m] that hold a displacement of 1 m or a turn of 1 rad, in world axes.  out: folder for
    stiffness.nc.  Raises InputError for an impossible scene or one without a buoy, SolveError if the equilibrium is not
    found or a line is slack.
    """
    scene = load_scene(scene, **overrides)
    if scene.buoy is None:
        raise InputError("A restoring matrix is that of a buoy: the scene needs [buoy].")
    found = linearise(scene, comm)
    try:
        every = condensed(found)
        dataset = dataset_of_stiffness(found.problem, every.bodies, every.stiffness, mooring_stiffness(found, every))
    finally:
        found.destroy()
    if out is not None:
        folders.keep(out, "stiffness", scene, dataset, comm)
    return dataset


def offsets(
    scene: "Scene | str | Path | dict", sizes, directions_deg, load="force", out=None, comm=MPI.COMM_WORLD, **overrides
) -> "xr.Dataset":
    """Equilibria under a growing horizontal load from many sides: positions, tensions, and what goes slack or under.

    load: "force" [N], added to the scene's external force, or "current" [m/s], in its place.  out: folder for
    offsets.nc.  Returns what a record says of an equilibrium over directions and sizes (complete on rank 0); where
    there is none, `found` is False.  Raises InputError for an impossible scene or one without a moored buoy.
    """
    scene = load_scene(scene, **overrides)
    rows = Rows(load)
    for rest in rests(scene, load, sizes, directions_deg, comm):
        rows.add(rest)
        interruption.check()
    try:
        at_rest = _equilibrium(scene, comm)
    except SolveError:
        at_rest = {}
    if comm.rank != 0:
        return results.nothing()
    dataset = rows.dataset(at_rest["buoy_position"].values if "buoy_position" in at_rest else None)
    if out is not None:
        folders.keep(out, "offsets", scene, dataset)
    return dataset


def response(
    scene: "Scene | str | Path | dict",
    periods=None,
    height=None,
    sea=None,
    direction_deg=None,
    out=None,
    comm=MPI.COMM_WORLD,
    **overrides,
) -> "xr.Dataset":
    """Linear response to waves: amplitudes per metre over periods [s] (default: 2 to 30 s), and to an irregular sea.

    height: of regular waves [m], for whose velocities the drag is linearised too.  sea: (significant height [m], peak
    period [s], gamma) of a JONSWAP sea; by default the scene's, if it is irregular; all of it runs in one direction.
    direction_deg: of the waves, by default the scene's.  out: folder for response.nc.  Complete on rank 0, which alone
    computes it.  Raises InputError for an impossible scene, SolveError if the equilibrium is not found or the drag does
    not settle.
    """
    scene = load_scene(scene, **overrides)
    if comm.rank != 0:
        return results.nothing()
    if direction_deg is None:
        direction_deg = scene.waves.direction_deg if scene.waves else 0.0
    seaway = Seaway(scene, direction_deg)
    try:
        irregular = irregular_waves(scene, sea, direction_deg)
        dataset = _response(seaway, PERIODS if periods is None else np.asarray(periods, float), height, irregular)
    finally:
        seaway.destroy()
    if out is not None:
        folders.keep(out, "response", scene, dataset)
    return dataset


def _response(seaway, periods, height, sea):
    waves = [seaway.wave(2 * math.pi / T) for T in periods]
    small, high, irregular = np.array([seaway.regular(wave) for wave in waves]).T, None, None
    if height:
        high = np.array([seaway.regular(wave, height / 2) for wave in waves]).T
    if sea is not None:
        omega, energies = bins_of(sea)
        seaway.drag.forget()
        irregular = omega, energies, seaway.irregular([seaway.wave(w) for w in omega], energies)
    return dataset_of_response(seaway, periods, small, high, height, irregular)


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

    out: folder for results.nc, scene.toml and checkpoint.npz, written as the run goes.  The finished record of the same
    scene that is there already is read instead; that of another scene, or of a run that was stopped, is replaced with
    `overwrite` only, as soon as the new one begins, and what is not dolfbuoy's never.  progress: called after each step
    with the Simulation and the step's iterations.  overrides: see load_scene.  resume: folder of a run that was
    stopped, instead of scene and out; only `time__end` may then be changed.  It goes on as if it had not been stopped.
    Raises InputError for an impossible scene, folder or resumption, SolveError when a step fails for good, OSError when
    nothing can be written; everything computed until then is on disk.
    """
    if resume is not None:
        ends = [value for key, value in overrides.items() if key.replace("__", ".") == "time.end"]
        if scene is not None or out is not None or len(ends) < len(overrides):
            raise InputError("resume: a run goes on with its own scene and folder; only time__end may be changed.")
        checkpoint.load(resume, comm.size, *ends)  # or there is nothing to lock
        with folders.claimed(resume, comm):
            point = checkpoint.load(resume, comm.size, *ends)
            folders.go_on(resume, point.scene, comm)
            return _drive(point.scene, Path(resume), comm, progress, point)
    scene = load_scene(scene, **overrides)
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return simulate(scene, comm.bcast(folder), comm, progress)
    with folders.claimed(out, comm):
        if folders.holds(out, "run", scene, overwrite, comm):
            return _read(Path(out) / "results.nc", comm)
        return _drive(scene, Path(out), comm, progress)


def wave_components(scene: "Scene | str | Path | dict", **overrides) -> "xr.Dataset":
    """The components that a scene's waves are made of, eta = sum a cos(k.x - omega t + phase), over `component`.

    amplitude [m], period [s] (as `waves.period_seen_from` says), direction_deg (towards, from x), phase_deg.
    Raises InputError for an impossible scene or one without waves.
    """
    import xarray as xr

    scene = load_scene(scene, **overrides)
    if scene.waves is None:
        raise InputError("waves: must be given, this scene has none.")
    units = {"amplitude": "m", "period": "s", "direction_deg": "degree", "phase_deg": "degree"}
    values = zip(units, components_of(scene.waves).as_rows().T, strict=True)
    return xr.Dataset({name: ("component", array, {"units": units[name]}) for name, array in values})


def _drive(scene, folder, comm, progress, point=None):
    """From the start or a Checkpoint to the end."""
    if point is None or not point.complete:
        simulation = Simulation(scene, comm, state=point and point.states[comm.rank])
        if point is None and comm.rank == 0:
            folders.begin(folder, "run", scene)
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
    if comm.rank == 0:
        folders.finish(folder, "run")
    return _read(folder / "results.nc", comm)


def _read(path, comm):
    return results.read(path) if comm.rank == 0 else results.nothing()
