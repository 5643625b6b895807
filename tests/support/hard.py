"""Shared by the hard cases: base scenes, runs on one rank, refusals, and closed forms independent of the program."""

import math
import tomllib
from pathlib import Path

import numpy as np
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq

from dolfbuoy.api import simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.results.parts import alone
from dolfbuoy.results.summary import warnings
from dolfbuoy.scene import load_scene, merged

INF = float("inf")

SCENES = tomllib.loads(Path(__file__).with_name("hard_scenes.toml").read_text(encoding="utf-8"))
UNIT, SHORT, CHAIN, FLOATING, FLOATING_SPAR, TOP = list(SCENES.values())[:6]
MOORED = SHORT | FLOATING


class Findings:
    """Results of a hard case, each number with its limit; a violated limit fails the test.

    said: the sentences, which stand in the table that `dolfbuoy study hard-cases` makes.
    """

    def __init__(self, node=None):
        self.said = [] if node is None else node.user_properties

    def below(self, what: str, value: float, limit: float, unit: str = "") -> None:
        """A measured number that must not exceed `limit` (nor be NaN)."""
        value = float(value)
        self._note(f"{what} {value:.3g}{unit} (at most {limit:.3g})", math.isfinite(value) and value <= limit)

    def close(self, what: str, value: float, expected: float, relative: float, unit: str = "") -> None:
        """A measured value that must agree with an independent one to within `relative`."""
        value, expected = float(value), float(expected)
        off = abs(value - expected) / abs(expected)
        text = f"{what} {value:.6g}{unit}, expected {expected:.6g} (off by {off:.1e}, at most {relative:.1e})"
        self._note(text, off <= relative)

    def holds(self, what: str, condition) -> None:
        """A statement that must be true."""
        self._note(what if condition else f"not true: {what}", condition)

    def finite(self, record) -> None:
        """No NaN and no infinity anywhere in a record."""
        bad = [n for n, v in record.variables.items() if v.dtype.kind == "f" and not np.isfinite(v.values).all()]
        self._note(f"not finite: {', '.join(bad)}" if bad else "all finite", not bad)

    def says(self, sentences: list[str] | str, words: str) -> None:
        """One of the program's messages must contain `words`; the message is quoted."""
        sentences = [sentences] if isinstance(sentences, str) else sentences
        match = next((s for s in sentences if words in s), None)
        self._note(f'"{match}"' if match else f"nothing said of '{words}' in {sentences}", match is not None)

    def remark(self, text: str) -> None:
        """A number to report, without a limit."""
        self.said.append(("happened", text))

    def _note(self, text, good):
        self.remark(text)
        assert good, text


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
    """The record of a run, which must be finite everywhere."""
    record = run(scene, **kwargs)
    found.finite(record)
    return record


def said(scene: dict, record=None) -> list[str]:
    """Warnings of `check`, or those after the run if a record is given."""
    scene = load_scene(scene)
    return check(scene).warnings if record is None else warnings(record, scene)


def refusal(scene: dict, how=static) -> str:
    """The message of the InputError that a scene must raise."""
    try:
        how(scene)
    except InputError as error:
        return str(error)
    return "it was not refused"


def ending(scene: dict, how=static):
    """(record or None, message): a normal end, or the message of the refusal or failure."""
    try:
        return how(scene), ""
    except (InputError, SolveError) as error:
        return None, str(error)


def turned(degrees: float, axis=(0.0, 1.0, 0.0)) -> list[float]:
    """Quaternion of a rotation about a unit axis."""
    half = math.radians(degrees) / 2
    return [math.cos(half), *(math.sin(half) * np.array(axis)).tolist()]


def shape_of_pulled(force_x: float, force_z: float, L: float, w: float, EA: float) -> np.ndarray:
    """(x, z) of the upper end of a cable held at the origin and pulled by a force, by quadrature of r' = (1+e) t."""

    def tension(s):
        return np.hypot(force_x, force_z - w * (L - s))

    x = quad(lambda s: (1 / tension(s) + 1 / EA) * force_x, 0, L, epsabs=1e-13, epsrel=1e-13)[0]
    z = quad(lambda s: (1 / tension(s) + 1 / EA) * (force_z - w * (L - s)), 0, L, epsabs=1e-13, epsrel=1e-13)[0]
    return np.array([x, z])


def hanging(dx: float, dz: float, L: float = 1.0, w: float = 1.0) -> tuple[float, float]:
    """(H, tension at the upper end) of an inextensible cable between points dx, dz apart: the textbook catenary."""
    chord = np.sqrt(L**2 - dz**2) / dx
    u = brentq(lambda u: np.log(np.sinh(u) / u) - np.log(chord), 1e-9, 700.0, xtol=1e-14)
    H = w * dx / (2 * u)
    return H, float(np.hypot(H, w / 2 * (L + dz / np.tanh(u))))
