"""A scene as input of MoorDyn: the same cable, or the same cable and buoy, in MoorDyn's own terms.

Conversions, each because MoorDyn defines the number otherwise (its manual, section "Line Types"):

- tangential drag refers to the surface pi d l there and to the diameter d l here: CdAx = C_dt/pi;
- EA, mass, diameter, normal drag (on d l), added mass (of the displaced water) and weight in water are the same;
- tangential added mass is 0 in this model: CaAx = 0.  The tangential Froude-Krylov force is then on, as here;
- internal damping BA = -1: critical damping of the shortest axial vibration of a segment, as its manual recommends.
  It vanishes with the segment's length; without it neither program agrees with anything, because MoorDyn rings;
- the sea bed is put ten depths down for a cable without waves, so that MoorDyn's contact plays no part.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dolfbuoy.model.sea import wavenumber
from dolfbuoy.scene import Scene

#: Segments of the rod that is the hull (24 and 48 change nothing).
ROD = 18
#: Points of MoorDyn's table of the wave to a wave length, and to a period; it interpolates linearly.
PER_WAVE = 64


@dataclass(frozen=True)
class Numerics:
    """Segments, integrator and step [s] of a MoorDyn run."""

    segments: int
    scheme: str
    step: float


def write(folder: Path, scene: Scene, numerics: Numerics) -> Path:
    """Write lines.txt, and with a buoy its waves and current, into `folder`; returns its path."""
    text = _cable_type(scene)
    text += _rod_type(scene) + _body(scene) if scene.buoy else ""
    text += _points(scene) + _line(scene, numerics) + _options(scene, numerics)
    path = Path(folder) / "lines.txt"
    path.write_text(f"{scene.title}\nwritten for a benchmark\n{text}--- need this line ---\n")
    if scene.waves:
        (path.parent / "wave_frequencies.txt").write_text(_wave(scene))
        (path.parent / "water_grid.txt").write_text(_grid(scene))
    if scene.current:
        (path.parent / "current_profile.txt").write_text(_current(scene))
    return path


def _table(name, columns, *rows):
    lines = [f"--- {name} ---", columns, " ".join("(-)" for _ in columns.split())]
    lines += [" ".join(f"{value:.14g}" if isinstance(value, float) else str(value) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def _cable_type(scene):
    c = scene.cable
    row = ("cable", c.diameter, c.line_density, c.axial_stiffness, -1.0, 0.0)
    row += (c.normal_drag, c.added_mass, c.tangential_drag / math.pi, 0.0)
    return _table("LINE TYPES", "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx", row)


def _rod_type(scene):
    """The hull, which must be a cylinder, without mass (the body has it)."""
    b = scene.buoy
    (_, diameter), (_, other) = b.hull
    assert diameter == other, "MoorDyn's rod is a cylinder"
    row = ("hull", diameter, 0.0, b.normal_drag, b.added_mass, b.axial_drag, b.axial_added_mass)
    return _table("ROD TYPES", "TypeName Diam Mass/m Cd Ca CdEnd CaEnd", row)


def _body(scene):
    """Body 1, its reference point at the keel, and rod 1, the hull on it."""
    b, height, draft = scene.buoy, scene.buoy.hull[-1][0], -scene.initial.buoy_position[2] + scene.buoy.center_of_mass
    transverse, axial = b.inertia
    center, inertia = f"0|0|{b.center_of_mass:.14g}", f"{transverse:.14g}|{transverse:.14g}|{axial:.14g}"
    x, y, _ = scene.initial.buoy_position
    body = (1, "Free", x, y, -draft, 0.0, 0.0, 0.0, b.mass, center, inertia, 0.0, 0.0, 0.0)
    rod = (1, "hull", "Body1", 0.0, 0.0, 0.0, 0.0, 0.0, height, ROD, "-")
    text = _table("BODIES", "ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG* I* Volume CdA* Ca*", body)
    return text + _table("RODS", "ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs RodOutputs", rod)


def _points(scene):
    none = (0.0, 0.0, 0.0, 0.0)
    if scene.buoy:
        top = (2, "Body1", 0.0, 0.0, scene.buoy.mooring_height, *none)
    else:
        top = (2, "Coupled", *scene.cable.top.position, *none)
    rows = ((1, "Fixed", *scene.anchor, *none), top)
    return _table("POINTS", "ID Attachment X Y Z Mass Volume CdA Ca", *rows)


def _line(scene, numerics):
    row = (1, "cable", 1, 2, scene.cable.length, numerics.segments, "-")
    return _table("LINES", "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs", row)


def _options(scene, numerics):
    bed = scene.sea.depth * (1 if scene.waves else 10)  # waves need the true depth
    options = {"writeLog": 0, "dtM": numerics.step, "tScheme": numerics.scheme, "g": scene.gravity}
    options |= {"rho": scene.sea.density, "WtrDpth": bed, "kBot": 0, "cBot": 0, "TmaxIC": 0}
    options |= {"disableOutput": 1, "disableOutTime": 1}
    if scene.waves:
        options |= {"WaveKin": 2}
    if scene.current:
        options |= {"Currents": 1}
    return "--- OPTIONS ---\n" + "".join(f"{value} {key}\n" for key, value in options.items())


def _wave(scene):
    """A spectrum with one component.

    The empty ones set the table in time that MoorDyn makes of it: their spacing its length, the last one its steps.  It
    is longer than the run, because MoorDyn reads a wrong value where the table begins again, and the cable rings.
    """
    w = scene.waves
    assert (w.direction_deg, w.phase_deg) == (0, 0), "the grid resolves waves along x"
    omega, periods = 2 * math.pi / w.period, math.ceil(scene.time.end / w.period) + 1
    rows = [(i * omega / periods, w.size if i == periods else 0.0) for i in range(periods * PER_WAVE // 2 + 1)]
    return "".join(f"{frequency:.14g} {amplitude:.14g} 0 0\n" for frequency, amplitude in rows)


def _grid(scene):
    """Points of its table in space: PER_WAVE to a wave length along x and, near the surface, down z; constant in y.

    Along x it reaches half a wave length from the buoy; where the cable goes beyond, the wave is felt no more.
    """
    wave, depth = 2 * math.pi / wavenumber(scene), scene.sea.depth
    x = scene.initial.buoy_position[0] + wave * np.linspace(-0.5, 0.5, PER_WAVE + 1)
    shallow = np.arange(0.0, min(depth, wave / 2), wave / PER_WAVE)
    deep = np.linspace(shallow[-1], depth, 12)[1:]
    z = -np.concatenate([shallow, deep])[::-1]
    lists = ["1\n" + " ".join(f"{value:.6f}" for value in values) for values in (x, (-1e4, 1e4), z)]
    return "waves\nx, y, z\nkind of list, values\n" + "\n".join(lists) + "\n"


def _current(scene):
    angle = math.radians(scene.current.direction_deg)
    rows = [(z, u * math.cos(angle), u * math.sin(angle), 0.0) for z, u in scene.current.profile]
    return "current\nprofile\nz ux uy uz\n" + "".join(" ".join(f"{v:.14g}" for v in row) + "\n" for row in rows)
