"""The Python interface: `modes`, `stiffness`, `response`; separate from `api`, as a run in time does not need it."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .elsewhere import MPI
from .errors import InputError
from .linear.linearisation import linearise
from .linear.natural import lowest_modes, slack_in
from .linear.periods import modes_of_buoys
from .linear.seaway import Seaway
from .linear.spectrum import bins_of, check_periods, irregular_waves
from .linear.stiffness import on_vessels, refuse_directions, restoring
from .results import folder as folders
from .results import record as results
from .results.linear_record import dataset_of_response, dataset_of_stiffness
from .results.mode_record import dataset_of_modes
from .scene import Scene, load_scene

if TYPE_CHECKING:
    import xarray as xr

#: Default periods of the linear response [s].
PERIODS = np.concatenate([np.arange(2.0, 12.0, 0.25), np.arange(12.0, 30.5, 1.0)])
#: Largest number of modes: all those of a long line take hours, and the fastest are artefacts of its elements.
MOST_MODES = 500


def modes(
    scene: "Scene | str | Path | dict",
    number=10,
    out=None,
    comm=MPI.COMM_WORLD,
    direction_deg=0.0,
    oscillating=False,
    **overrides,
) -> "xr.Dataset":
    """Natural modes about the equilibrium in the mean current, wind and external force, the slowest first.

    number: number of modes, conjugate pairs counted once, at most MOST_MODES; fewer if there are not as many.  out:
    folder for modes.nc.  direction_deg: direction of surge, from x.  oscillating: only modes with a period.  Returns
    eigenvalues, damping, names and shapes (complete on rank 0); if a line is slack, only those of buoys, as stated in
    `notes` (on one rank).  Raises InputError for an impossible scene, or for a state with a slack or kinked line;
    SolveError if the equilibrium or the modes are not found.
    """
    if not 1 <= number <= MOST_MODES:
        raise InputError(f"number = {number}: must be from 1 to {MOST_MODES}.")
    scene = load_scene(scene, **overrides)
    folders.make_ready(out, "modes", scene, comm)
    found = linearise(scene, comm)
    try:
        slack = slack_in(found) if comm.size == 1 and found.bodies else None
        of_buoys = modes_of_buoys(found, direction_deg) if slack else None
        count, chosen = number, of_buoys or lowest_modes(found, number, direction_deg)
        while oscillating and not of_buoys and len([m for m in chosen if m.kind == "oscillates"]) < number:
            count *= 2
            if len(chosen) < count // 2 or count > MOST_MODES:
                break
            chosen = lowest_modes(found, count, direction_deg)
        modes = [mode for mode in chosen if not oscillating or mode.kind == "oscillates"][:number]
        dataset = dataset_of_modes(found, modes)
        if of_buoys:
            dataset.attrs["notes"] = f"{slack}; these are the modes of buoys, which the taut part and the bed hold."
    finally:
        found.destroy()
    if out is not None:
        folders.keep(out, "modes", scene, dataset, comm)
    return dataset


def stiffness(scene: "Scene | str | Path | dict", out=None, comm=MPI.COMM_WORLD, **overrides) -> "xr.Dataset":
    """Restoring matrices (6, 6) at equilibrium: for buoys about C, due to the mooring, the hull, and both; for vessels,
    which are held, about their reference points, due to the mooring.

    Forces [N] and torques [N m] that hold a displacement of 1 m or a rotation of 1 rad, in world axes.  out: folder for
    stiffness.nc.  Raises InputError for an impossible scene or one without a buoy or vessel, SolveError if the
    equilibrium is not found or a line is slack.
    """
    scene = load_scene(scene, **overrides)
    if scene.buoy is None and not scene.vessel:
        raise InputError("A restoring matrix is that of a buoy or a vessel: the scene needs [buoy] or [[vessel]].")
    refuse_directions(scene)
    folders.make_ready(out, "stiffness", scene, comm)
    found = linearise(scene, MPI.COMM_SELF if scene.vessel else comm)
    try:
        vessels = on_vessels(found) if scene.vessel else []
        dataset = dataset_of_stiffness(found.problem, restoring(found), vessels)
    finally:
        found.destroy()
    if out is not None:
        folders.keep(out, "stiffness", scene, dataset, comm)
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

    height: height of regular waves [m], for which drag is also linearised.  sea: (significant height [m], peak period
    [s], gamma, spreading exponent s or None) of a JONSWAP sea; by default the scene's, if irregular.  direction_deg:
    (main) direction of the waves, by default the scene's.  out: folder for response.nc.  Complete on rank 0, which
    alone computes it.  Raises InputError for an impossible scene, SolveError if the equilibrium is not found or the
    drag does not converge.
    """
    scene = load_scene(scene, **overrides)
    check_periods("periods =", PERIODS if periods is None else periods)
    if comm.rank != 0:
        return results.nothing()
    folders.make_ready(out, "response", scene)
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
        bins = bins_of(sea)
        irregular = bins, seaway.irregular([seaway.wave(*pair) for pair in bins.pairs()], bins.energy)
    return dataset_of_response(seaway, periods, small, high, height, irregular)
