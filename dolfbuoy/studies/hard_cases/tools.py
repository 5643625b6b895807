"""What the hard cases share: base scenes, runs on one rank, refusals, and closed forms that owe the program nothing."""

import tomllib
from pathlib import Path

import numpy as np
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq

from ...api import simulate, solve_static
from ...check import check
from ...errors import InputError, SolveError
from ...results.parts import alone
from ...results.summary import warnings
from ...scene import load_scene, merged

INF = float("inf")

SCENES = tomllib.loads(Path(__file__).with_name("scenes.toml").read_text(encoding="utf-8"))
UNIT, SHORT, CHAIN, FLOATING, FLOATING_SPAR, TOP = list(SCENES.values())[:6]
MOORED = SHORT | FLOATING


def with_(base: dict, **changes) -> dict:
    """A deep copy of a scene with `section__key=value` changed; a dict is merged into a section, None removes."""
    return merged(base, **changes)


def static(scene: dict):
    """The equilibrium's record, see `alone`."""
    return alone(solve_static(scene, comm=MPI.COMM_SELF))


def run(scene: dict, **kwargs):
    """The run's record, see `alone`."""
    return alone(whole(scene, **kwargs))


def whole(scene: dict, **kwargs):
    """The run's record with all its dimensions."""
    return simulate(scene, comm=MPI.COMM_SELF, **kwargs)


def sound_run(found, scene: dict, **kwargs):
    """The record of a run that must be finite everywhere."""
    record = run(scene, **kwargs)
    found.finite(record)
    return record


def said(scene: dict, record=None) -> list[str]:
    """Warnings of `check`, or with a record those after the run."""
    scene = load_scene(scene)
    return check(scene).warnings if record is None else warnings(record, scene)


def refusal(scene: dict, how=static) -> str:
    """The sentence of the InputError that a scene must end with."""
    try:
        how(scene)
    except InputError as error:
        return str(error)
    return "it was not refused"


def ending(scene: dict, how=static):
    """(record or None, sentence): a right end, or the words of the refusal or failure."""
    try:
        return how(scene), ""
    except (InputError, SolveError) as error:
        return None, str(error)


def shape_of_pulled(force_x: float, force_z: float, L: float, w: float, EA: float) -> np.ndarray:
    """(x, z) of the upper end of a cable held at the origin and pulled by a force, by quadrature of r' = (1+e) t."""

    def tension(s):
        return np.hypot(force_x, force_z - w * (L - s))

    x = quad(lambda s: (1 / tension(s) + 1 / EA) * force_x, 0, L, epsabs=1e-13, epsrel=1e-13)[0]
    z = quad(lambda s: (1 / tension(s) + 1 / EA) * (force_z - w * (L - s)), 0, L, epsabs=1e-13, epsrel=1e-13)[0]
    return np.array([x, z])


def hanging(dx: float, dz: float, L: float = 1.0, w: float = 1.0) -> tuple[float, float]:
    """(H, tension at the upper end) of an inextensible cable between points dx, dz apart: the textbook's catenary."""
    chord = np.sqrt(L**2 - dz**2) / dx
    u = brentq(lambda u: np.log(np.sinh(u) / u) - np.log(chord), 1e-9, 700.0, xtol=1e-14)
    H = w * dx / (2 * u)
    return H, float(np.hypot(H, w / 2 * (L + dz / np.tanh(u))))
