"""Gravity, water and bed of MoorDyn's options.

Its bed is everywhere, of the stiffness kBot at the depth WtrDpth; without water or gravity nothing lies on one here.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..scene.bathymetry import Depths
from ..scene.quantities import number_of
from .moordyn_files import SEAFLOOR, depths_of, water
from .moordyn_text import Tables, is_number

GRAVITY, DENSITY = ("g", "gravity"), ("rho", "rhoW", "WtrDnsty")
DEPTH = ("WtrDpth", "WtrDepth", "depth")
STIFFNESS, FRICTION = ("kBot", "kb"), ("FrictionCoefficient",)
#: Of MoorDyn in Fortran: across a line and along it.
ACROSS, ALONG = ("mu_kT",), ("mu_kA",)
CARRIED = {name.lower() for name in (*GRAVITY, *DENSITY, *DEPTH, *STIFFNESS, *FRICTION, *ACROSS, *ALONG)}
#: Options for how MoorDyn computes and what it writes, without effect on the mooring.
NUMERICAL = {
    "dt", "dtm", "tscheme", "cfl", "tmax", "version", "echo",
    "writelog", "writeunits", "dtout", "outswitch", "disableoutput", "disableouttime",
    "dtic", "tmaxic", "cdscaleic", "threshic", "icgendynamic", "icdfac", "icdt", "ictmax", "icthresh",
    "inertialf", "inertialf_rampt", "unifycurrentgrid",
}  # fmt: skip
#: Options that name other files than the input, or go with them.
ELSEWHERE = {"wavekin", "currents", "waterkin", "dtwave", *(name.lower() for name in SEAFLOOR)}
#: Defaults of MoorDyn [Pa/m, kg/m^3].
KBOT, WATER = 3e6, 1025.0


def density_of(tables: Tables) -> float:
    """Density of the water [kg/m^3]."""
    return float(_number(tables, *DENSITY, default=WATER)[1])


def world(tables: Tables, places: list[Any], note: Callable[..., Any], folder: Path | None = None) -> dict[str, Any]:
    """The sections that options make.  places: (line, z [m], "fixed", "moved" or "free") of points; note; folder: of
    the input, where other files may be that options name.

    Raises InputError for numbers that are none, and for a depth that neither an option nor an anchor gives.
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
    """Line and value of an option; None and the default without it."""
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
