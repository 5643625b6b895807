"""Files next to MoorDyn's input that are named by its options: waves, currents, the sea floor.

In MoorDyn 2 they have fixed names in the folder of the input; in OpenFAST's there is a file `WaterKin`.  A component is
the real part of A exp(i (omega t - k.x)) for `WaveKin` 2, its imaginary part for 7; a record is the elevation at x = y
= 0 of waves that run along x.  Currents do not change the wave frequencies.

Also gravity, water and bed from MoorDyn's options.

MoorDyn always has a bed, of stiffness kBot at the depth WtrDpth; here there is none without water or gravity.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..scene.bathymetry import Depths, depths_from_text
from ..scene.mesh_file import inside
from ..scene.quantities import number_of
from ..scene.wave_files import MOST_BYTES
from .moordyn_text import Tables, is_number

Note = Callable[..., Any]
Array = NDArray[Any]

SEAFLOOR = ("SeafloorFile", "SeafloorPath", "bathymetryFile")
#: Names of MoorDyn's files.
ELEVATION, FREQUENCIES = "wave_elevation.txt", "wave_frequencies.txt"
STEADY, DYNAMIC, GRID = "current_profile.txt", "current_profile_dynamic.txt", "current_profile_4d.txt"
#: Step to which records are resampled [s], unless dtWave is given.
DT_WAVE = 0.25
#: Words for MoorDyn's modes that have no file.
_NO_FILE = {
    "1": "waves come from the program that calls MoorDyn; add [waves]",
    "4": "MoorDyn itself has no waves of this kind",
    "5": "MoorDyn itself has no waves of this kind",
    "6": "MoorDyn itself has no waves of this kind",
}


def found_beside(folder: Path | None, name: str) -> Path | None:
    """The file of a name in the folder of the input, or below it; None if it is not there."""
    if folder is None:
        return None
    for candidate in (name, Path(name).name):
        try:
            path = inside(folder, candidate)
        except ValueError:
            continue
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{name}: must have {MOST_BYTES:,} bytes at most.")
        return path
    return None


def depths_of(tables: Tables, folder: Path | None, names: tuple[str, ...], note: Note) -> Depths | None:
    """The grid of depths named by one of these options; None without it."""
    line, name = tables.option(*names) or (None, None)
    if name is None or is_number(name):
        return None
    path = found_beside(folder, name)
    if path is None:
        if names == SEAFLOOR:
            note(line, f"{names[0]} = {name}: there is no such file beside the input; the bed is flat here")
        return None
    try:
        return Depths.model_validate(depths_from_text(path))
    except ValueError:
        raise InputError(
            f"line {line}: {name}: must hold NX NY, a line of x, one of y, lines x y z; or a title, nGridX N, "
            "nGridY M, a line of x, lines y depth depth ..."
        ) from None


def water(tables: Tables, folder: Path | None, note: Note) -> dict[str, Any]:
    """The sections waves and current from files named by options; note: for parts that are not translated."""
    line, kind = tables.option("WaterKin") or (None, "0")
    if kind == "0" or kind.upper() == "SEASTATE":
        if kind != "0":
            note(line, f"WaterKin = {kind}: waves and current come from OpenFAST; add [waves], [current]")
        line, kind = tables.option("WaveKin") or (None, "0")
    found: dict[str, Any] = {}
    if not is_number(kind):
        return _of_openfast(_text(folder, kind, line, "WaterKin", note), folder, (line, note))
    step = tables.option("dtWave")
    dt = number_of(step[1]) if step and is_number(step[1]) else DT_WAVE
    if waves := _waves(folder, kind, (line, note), dt):
        found["waves"] = waves
    line, kind = tables.option("Currents") or (None, "0")
    if current := _current(folder, kind, (line, note)):
        found["current"] = current
    return found


def _waves(folder: Path | None, kind: str, at: tuple[int | None, Note], dt: float) -> dict[str, Any] | None:
    line, note = at
    mode = f"{float(kind):g}"
    if mode == "0":
        return None
    if mode == "3":
        text = _text(folder, ELEVATION, line, f"WaveKin = {mode}", note)
        return {"elevation": _record(_rows(text, ELEVATION, (2,)), dt, at)} if text else None
    if mode in ("2", "7"):
        text = _text(folder, FREQUENCIES, line, f"WaveKin = {mode}", note)
        return _components(_rows(text, FREQUENCIES, (3, 4)), mode) if text else None
    note(line, f"WaveKin = {mode}: {_NO_FILE.get(mode, 'is not known and not carried over; add [waves]')}")
    return None


def _record(rows: list[list[float]], dt: float, at: tuple[int | None, Note]) -> list[list[float]]:
    """Times from 0 and elevations, as given if steps are equal, else interpolated as in MoorDyn."""
    t, eta = np.array(rows).T
    steps = np.diff(t)
    if not len(steps) or steps.min() <= 0:
        raise InputError(f"{ELEVATION}: must hold times that grow.")
    if np.ptp(steps) > 1e-6 * steps.max():
        even = np.arange(t[0], t[-1] + 1e-9 * dt, dt)
        t, eta = even, np.interp(even, t, eta)
        at[1](at[0], f"{ELEVATION}: its steps are not equal; it is brought to {dt:g} s between its rows")
    else:
        t = t[0] + np.arange(len(t)) * (t[-1] - t[0]) / len(steps)
    return _listed(t, eta)


def _components(rows: list[list[float]], mode: str) -> dict[str, Any]:
    """Components [amplitude, period, direction_deg, phase_deg] of a complex spectrum.

    In mode 2 they are at multiples of the smallest frequency step, interpolated linearly between the rows.
    """
    table = np.array([[*row, 0.0][:4] for row in rows])
    if (np.diff(table[:, 0]) < (0 if mode == "2" else -math.inf)).any() or (table[:, 0] < 0).any():
        raise InputError(f"{FREQUENCIES}: must hold frequencies from 0 on, growing.")
    if mode == "2" and len(table) > 1:
        step = np.diff(table[:, 0]).min()
        even = step * np.arange(round(table[-1, 0] / step) + 1)
        table = np.column_stack([even, *(np.interp(even, table[:, 0], column) for column in table[:, 1:].T)])
    found = []
    for omega, real, imaginary, direction in table:
        if omega > 0 and (real or imaginary):
            phase = -math.degrees(math.atan2(imaginary, real)) + (90.0 if mode == "7" else 0.0)
            found.append([math.hypot(real, imaginary), 2 * math.pi / omega, math.degrees(direction), phase % 360.0])
    if not found:
        raise InputError(f"{FREQUENCIES}: must hold an amplitude that is not 0.")
    return {"components": found}


def _current(folder: Path | None, kind: str, at: tuple[int | None, Note]) -> dict[str, Any] | None:
    line, note = at
    mode = f"{float(kind):g}" if is_number(kind) else kind
    if mode == "0":
        return None
    files = {"1": STEADY, "2": DYNAMIC, "5": GRID}
    if mode not in files:
        note(line, f"Currents = {mode}: MoorDyn itself has no current of this kind")
        return None
    text = _text(folder, files[mode], line, f"Currents = {mode}", note)
    if not text:
        return None
    if mode == "1":
        return _steady(np.array(_rows("\n".join(text.splitlines()[3:]), STEADY, (4,))), at)
    return _dynamic(text, at) if mode == "2" else _everywhere(text, at)


def _steady(rows: Array, at: tuple[int | None, Note]) -> dict[str, Any]:
    """A profile if the whole current has one direction, else a grid with one instant.  rows: z, u, v, w."""
    rows = rows[np.argsort(rows[:, 0])]
    _note_vertical(rows[:, 3:], STEADY, at)
    z, u, v = rows[:, :3].T
    strongest = int(np.argmax(u**2 + v**2))
    angle = math.atan2(v[strongest], u[strongest])
    along, across = u * math.cos(angle) + v * math.sin(angle), v * math.cos(angle) - u * math.sin(angle)
    if len(rows) == 1:
        return {"speed": float(along[0]), "direction_deg": math.degrees(angle)}
    if np.abs(across).max() <= 1e-9 * max(along.max(), 1e-30):
        return {"direction_deg": math.degrees(angle), "profile": _listed(z, along)}
    return {"grid": _listed(0.0, z, u, v)}


def _dynamic(text: str, at: tuple[int | None, Note]) -> dict[str, Any]:
    """A grid over depth and time: depths in line 5, from line 7 times and velocities, all x components first."""
    lines = text.splitlines()
    (z,) = _rows("\n".join(lines[4:5]), DYNAMIC) or [[]]
    rows = _rows("\n".join(lines[6:]), DYNAMIC, tuple(1 + n * len(z) for n in (1, 2, 3)))
    velocities = [np.array([*row[1:], *[0.0] * (1 + 3 * len(z) - len(row))]).reshape(3, -1) for row in rows]
    _note_vertical(np.array([w for *_, w in velocities]), DYNAMIC, at)
    pairs = zip(rows, velocities, strict=True)
    return {"grid": [one for (t, *_), (u, v, _) in pairs for one in _listed(t, z, u, v)]}


def _everywhere(text: str, at: tuple[int | None, Note]) -> dict[str, Any] | None:
    """A grid over depth and time from a file that is also over x and y, if uniform over these."""
    rows = np.array(_rows("\n".join(text.splitlines()[5:]), GRID, (7,)))
    found: dict[tuple[float, float], Array] = {}
    for _, _, z, t, *velocity in rows:
        if np.abs(found.setdefault((t, z), np.array(velocity)) - velocity).max() > 1e-12:
            at[1](at[0], f"{GRID}: a current that changes over x or y is not carried over; add [current]")
            return None
    _note_vertical(rows[:, 6], GRID, at)
    return {"grid": [[float(t), float(z), float(v[0]), float(v[1])] for (t, z), v in sorted(found.items())]}


def _of_openfast(text: str | None, folder: Path | None, at: tuple[int | None, Note]) -> dict[str, Any]:
    """Waves and current from the file WaterKin of OpenFAST's MoorDyn: values followed by names, and a final table."""
    line, note = at
    found: dict[str, Any] = {}
    lines = text.splitlines() if text else []
    values = {words[1].lower(): words[0].strip("\"'") for words in map(str.split, lines) if len(words) > 1}
    mode = values.get("wavekinmod", "0")
    if mode in ("1", "3"):
        name = values.get("wavekinfile", "")
        record = _text(folder, name, line, "WaveKinFile", note)
        if record:
            dt = number_of(values["dtwave"]) if is_number(values.get("dtwave", "")) else DT_WAVE
            found["waves"] = {"elevation": _record(_rows(record, name, (2,)), dt or DT_WAVE, at)}
            if angle := number_of(values.get("wavedir", "0")):
                found["waves"]["direction_deg"] = angle
    elif mode != "0" and lines:
        note(line, f"WaveKinMod = {mode}: waves come from OpenFAST; add [waves]")
    mode = values.get("currentmod", "0")
    if mode == "1":
        start = next(i for i, one in enumerate(lines) if "currentmod" in one.lower())
        rows = np.array(_rows("\n".join(lines[start + 1 :]), "WaterKin", (3,)))
        rows[:, 0] *= -1 if rows[:, 0].max() > 0 else 1  # depths, or heights
        found["current"] = _steady(np.column_stack([rows, np.zeros(len(rows))]), at)
    elif mode != "0" and lines:
        note(line, f"CurrentMod = {mode}: the current comes from OpenFAST; add [current]")
    return found


def _text(folder: Path | None, name: str, line: int | None, who: str, note: Note) -> str | None:
    """Text of a file beside the input; a note if there is none."""
    path = found_beside(folder, name)
    if path is None:
        note(line, f"{who}: there is no file {name} beside the input, and nothing of it is carried over")
        return None
    return path.read_text(encoding="utf-8", errors="replace")


def _rows(text: str, name: str, counts: tuple[int, ...] = ()) -> list[list[float]]:
    """Rows of numbers, of these counts; lines before the first and after the last may be text."""
    found: list[list[float]] = []
    for words in (line.replace(",", " ").split() for line in text.splitlines()):
        if words and all(map(is_number, words)):
            found.append([number_of(word) for word in words])
    if not found or (counts and any(len(row) not in counts for row in found)) or len({len(r) for r in found}) > 2:
        raise InputError(f"{name}: must hold lines of {' or '.join(map(str, counts)) or 'some'} numbers.")
    return found


def _listed(*columns: ArrayLike) -> list[list[float]]:
    """Rows from columns, some of which may be single numbers."""
    rows: list[list[float]] = np.column_stack(np.broadcast_arrays(*columns)).tolist()
    return rows


def _note_vertical(w: Array, name: str, at: tuple[int | None, Note]) -> None:
    """Note a current with a vertical component, once."""
    if np.any(w):
        at[1](at[0], f"{name}: what runs up or down is not carried over")


GRAVITY, DENSITY = ("g", "gravity"), ("rho", "rhoW", "WtrDnsty")
DEPTH = ("WtrDpth", "WtrDepth", "depth")
STIFFNESS, FRICTION = ("kBot", "kb"), ("FrictionCoefficient",)
#: Friction coefficients of MoorDyn in Fortran: across a line and along it.
ACROSS, ALONG = ("mu_kT",), ("mu_kA",)
CARRIED = {name.lower() for name in (*GRAVITY, *DENSITY, *DEPTH, *STIFFNESS, *FRICTION, *ACROSS, *ALONG)}
#: Options for computation and output, without effect on the mooring.
NUMERICAL = {
    "dt", "dtm", "tscheme", "cfl", "tmax", "version", "echo",
    "writelog", "writeunits", "dtout", "outswitch", "disableoutput", "disableouttime",
    "dtic", "tmaxic", "cdscaleic", "threshic", "icgendynamic", "icdfac", "icdt", "ictmax", "icthresh",
    "inertialf", "inertialf_rampt", "unifycurrentgrid",
}  # fmt: skip
#: Options that name other files, or belong to them.
ELSEWHERE = {"wavekin", "currents", "waterkin", "dtwave", *(name.lower() for name in SEAFLOOR)}
#: Defaults of MoorDyn [Pa/m, kg/m^3].
KBOT, WATER = 3e6, 1025.0


def density_of(tables: Tables) -> float:
    """Density of the water [kg/m^3]."""
    return float(_number(tables, *DENSITY, default=WATER)[1])


def world(tables: Tables, places: list[Any], note: Callable[..., Any], folder: Path | None = None) -> dict[str, Any]:
    """Sections from options; places: (line, z [m], "fixed", "moved" or "free") of points.
    folder: of the input, where options may name other files.

    Raises InputError for bad numbers, and if neither an option nor an anchor gives the depth.
    """
    for name, (line, value) in tables.options.items():
        if name in ("cbot", "cb"):
            note(line, f"cBot = {value}: damping of the bed is seabed.damping_ratio here, left at its default")
        elif name not in CARRIED | ELSEWHERE | NUMERICAL:
            note(line, f"the option {name} = {value} is not carried over")
    at, gravity = _number(tables, *GRAVITY)
    found: dict[str, Any] = {} if gravity is None else {"gravity": gravity}
    wet, density = _number(tables, *DENSITY)
    if density == 0:
        note(wet, "the density of the water is 0: there is none here, and no bed, which belongs to a sea")
        return found
    depths = depths_of(tables, folder, SEAFLOOR, note) or depths_of(tables, folder, DEPTH, note)
    depth = _depth(tables, places, note, depths)
    found["sea"] = {"depth": depth} | ({} if density is None else {"density": density})
    bed = _bed(tables, note)
    if bed and gravity == 0:
        note(at, "gravity is 0: there is no bed here, since nothing would lie on it")
    elif bed:
        found["seabed"] = bed | ({"depths": depths.model_dump()} if depths is not None else {})
    return found | water(tables, folder, note)


def _number(tables: Tables, *names: str, default: Any = None) -> tuple[int | None, Any]:
    """Line and value of an option; None and the default if it is missing."""
    line, text = tables.option(*names) or (None, None)
    if text is None:
        return None, default
    if not is_number(text):
        raise InputError(f"line {line}: {names[0]} is {text!r}, which is no number.")
    return line, number_of(text)


def _depth(
    tables: Tables, places: list[tuple[int, float, str]], note: Callable[..., Any], depths: Depths | None
) -> float:
    line, text = tables.option(*DEPTH) or (None, None)
    if depths is not None:
        depth = -float(depths.height(0.0, 0.0))
        note(line, f"the bed is a grid of depths; sea.depth, which waves feel, is its depth at x = y = 0, {depth:g} m")
        return depth
    if text is None or not is_number(text):
        low = min((z for _, z, _ in places), default=0.0)
        if low >= 0 or (low, "fixed") not in [(z, kind) for _, z, kind in places]:
            why = f"line {line}: WtrDpth is the file {text}" if text else "there is no WtrDpth"
            raise InputError(f"{why}, and no fixed point is the deepest: give the depth as OPTIONS, NUMBER WtrDpth.")
        note(line, f"no single depth is given: the deepest point, which is fixed, sets it, {-low:g} m")
        return -low
    depth = number_of(text)
    if depth <= 0:
        raise InputError(f"line {line}: WtrDpth is {text}: must be above 0.")
    for where, z, kind in places:
        if kind != "free" and z < -depth * (1 + 1e-9):
            raise InputError(f"line {where}: z = {z:g} is below the bed, which WtrDpth puts at -{depth:g} m.")
    return depth


def _bed(tables: Tables, note: Callable[..., Any]) -> dict[str, float]:
    where, stiffness = _number(tables, *STIFFNESS, default=KBOT)
    line, friction = _number(tables, *FRICTION)
    if friction is None:
        line, across = _number(tables, *ACROSS, default=0.0)
        other, friction = _number(tables, *ALONG, default=0.0)
        line = other or line
        if across != friction:
            note(
                line,
                f"friction differs across lines (MU_KT = {across:g}) and along them (MU_KA = {friction:g}); here it "
                "does not: that along them is taken",
            )
    if stiffness < 0:
        raise InputError(f"line {where}: kBot is {stiffness:g}: must be 0 or above.")
    if stiffness == 0:
        if friction:
            note(line, "there is no bed (kBot = 0), and no friction on it")
        return {}
    return {"stiffness": stiffness} | ({"friction": friction} if friction else {})
