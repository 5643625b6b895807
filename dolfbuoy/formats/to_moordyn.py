"""A scene as input of MoorDyn 2: lines, points, bodies with rods, sea bed, regular wave, current.

Differences in meaning, and how they are translated (MoorDyn's manual, "Line Types", "Rod Types", "Options"):

- tangential drag refers to the surface pi d l there and to the drag diameter l here: CdAx = C_dt d/(pi Diam);
- a single diameter gives volume and drag: Diam is that of the volume, and drag coefficients are scaled;
- internal damping: BA if the scene has `damping`, else BA = -1, critical damping of a segment's highest axial mode, as
  its manual recommends.  It vanishes with the segment length; without it MoorDyn rings;
- the hull consists of massless cylinders (rods) on a body; added mass and drag of faces act at the rods' ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.rigid import mass_properties
from ..scene.network import Network
from ..scene.stiffness import TensionTable
from . import moordyn_water
from .names import Note

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.buoy import Buoy
    from ..scene.cable import Cable, Top
    from ..scene.network import End, Piece
    from ..scene.sections import Scene

#: Number of cylinders of equal volume that replace each cone of a hull.
CONE_PARTS = 4
#: Segments of a rod, and of a line per element.
ROD_SEGMENTS = 18
#: Default step as a fraction of 1/omega of a segment's highest axial mode: below every stability limit.
STEP = 0.8
#: EA of an inextensible line as a multiple of its weight.
STIFF = 1e4

#: Keys of a buoy without a counterpart in MoorDyn.
LEFT_OUT = ("rotational_added_mass", "wave_damping", "disk_averages", "rotational_damping", "potential_flow")


@dataclass(frozen=True)
class Numerics:
    """Integrator and step [s] of MoorDyn; segments: per element of a line."""

    scheme: str = "RK2"
    step: float | None = None
    segments: int = 1


@dataclass
class Start:
    """Positions of free joints and centres of buoys at the start [m], by name."""

    joints: dict[str, NDArray[Any]] = field(default_factory=dict)
    buoys: dict[str, NDArray[Any]] = field(default_factory=dict)


@dataclass
class Export:
    """Files by name, MoorDyn's input first; notes on parts not translated; the step [s]; and the driven ends.
    Driven or held ends are points, in the order in which MoorDyn takes their positions, as `Top` sections."""

    files: dict[str, str]
    notes: list[Note]
    step: float
    driven: list[Any]


def start_of(record: xr.Dataset) -> Start:
    """The Start from an equilibrium of the scene (`dolfbuoy.solve_static`), or from an instant of a run."""
    found = Start()
    if "joint_position" in record:
        found.joints = {str(name): record.joint_position.sel(joint=name).values for name in record.joint.values}
    if "buoy_position" in record:
        found.buoys = {str(name): record.buoy_position.sel(buoy=name).values for name in record.buoy.values}
    return found


def export(scene: Scene, start: Start | None = None, numerics: Numerics | None = None) -> Export:
    """MoorDyn's input for a scene with a cable.  start: of free parts; default: the scene's own, or the origin."""
    return _Writer(scene, start or Start(), numerics or Numerics()).export()


class _Writer:
    def __init__(self, scene: Scene, start: Start, numerics: Numerics):
        self.scene, self.start, self.numerics = scene, start, numerics
        self.network: Network = scene.network
        self.notes: list[Note] = []
        self.points: list[tuple[Any, ...]] = []
        self.lines: list[tuple[Any, ...]] = []
        self.driven: list[Top] = []
        self.types: dict[tuple[str, ...], tuple[Any, ...]] = {}
        self.joints: dict[Any, int] = {}

    def note(self, text: str) -> None:
        if text not in [note.text for note in self.notes]:
            self.notes.append(Note(text))

    def export(self) -> Export:
        if self.network.take_offs:
            self.note(f"power take-offs are left out, which MoorDyn does not have: {', '.join(self.network.take_offs)}")
        if any(piece.section.winch for piece in self.network.pieces):
            self.note("winches are left out, which MoorDyn does not have: lines keep their first length")
        bodies, rod_types, rods = self._bodies()
        for number, piece in enumerate(self.network.pieces, 1):
            name, segments = self._type(piece), self.numerics.segments * _elements(piece.section)
            ends = [self._point(piece.section, end) for end in piece.ends]
            self.lines.append((number, name, *ends, piece.section.length, segments, "-"))
        # 1/omega of the highest axial mode of a segment [s]
        axial = (
            c.length / (self.numerics.segments * _elements(c)) * math.sqrt(c.line_density / self._stiffness(c)) / 2
            for c in (piece.section for piece in self.network.pieces)
        )
        step = self.numerics.step or STEP * min(axial)
        text = _table("LINE TYPES", "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx", *self.types.values())
        if bodies:
            text += _table("ROD TYPES", "TypeName Diam Mass/m Cd Ca CdEnd CaEnd", *rod_types)
            columns = "ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG* I* Volume CdA* Ca*"
            text += _table("BODIES", columns, *bodies)
            text += _table("RODS", "ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs RodOutputs", *rods)
        text += _table("POINTS", "ID Attachment X Y Z Mass Volume CdA Ca", *self.points)
        text += _table("LINES", "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs", *self.lines)
        options, files = moordyn_water.options(self.scene, self.network, self.note)
        options = dict[str, Any](dtM=step, tScheme=self.numerics.scheme, writeLog=0) | options
        text += "--- OPTIONS ---\n" + "".join(f"{_word(value)} {key}\n" for key, value in options.items())
        self._left_out()
        title = self.scene.title or "a scene"
        whole = f"{title}\nwritten by dolfbuoy\n{text}--- need this line ---\n"
        return Export({"lines.txt": whole} | files, self.notes, step, self.driven)

    def _type(self, piece: Piece) -> Any:
        c = piece.section
        key = tuple(str(getattr(c, name)) for name in _OF_A_TYPE)
        if key in self.types:
            return self.types[key][0]
        name, drag = f"type{len(self.types) + 1}", c.diameter or 0.0
        diameter = math.sqrt(4 * c.area / math.pi) if c.area else drag
        wide = drag / diameter if diameter else 0.0
        EA = self._stiffness(c)
        along = c.tangential_drag * wide / math.pi
        self.types[key] = (
            name, diameter or 1e-3, c.line_density, EA, c.damping or -1.0, c.bending_stiffness,
            c.normal_drag * wide, c.added_mass, along, c.tangential_added_mass,
        )  # fmt: skip
        if not c.damping:
            self.note("BA = -1: critical damping of each segment's shortest vibration, which this scene does not have")
        return name

    def _stiffness(self, c: Cable) -> Any:
        own: Any = c.axial_stiffness
        if isinstance(own, TensionTable):
            self.note("axial_stiffness: of a table only the slope at 0 is carried over")
        elif math.isinf(own):
            EA = STIFF * c.line_density * max(self.scene.gravity, 1.0) * c.length
            self.note(f"axial_stiffness: MoorDyn has no inextensible line: EA = {STIFF:g} times the line's weight")
            return EA
        return float(own)

    def _point(self, section: Cable, end: End) -> Any:
        key = end.name if end.kind != "buoy" else (end.name, end.fairlead, section.length)
        if end.name is not None and key in self.joints:
            return self.joints[key]
        number = len(self.points) + 1
        self.points.append((number, *self._place(end)))
        if end.name is not None:
            self.joints[key] = number
        return number

    def _place(self, end: End) -> tuple[float | str, ...]:
        none = (0.0,) * 4
        name, top = end.name or "", end.top
        if top is not None and end.kind in ("fixed", "prescribed"):
            moved = end.kind == "prescribed" or "." in name  # a fairlead of a vessel, which may be at rest
            if moved:
                self.driven.append(top)
            return ("Coupled" if moved else "Fixed", *(top.position or ()), *none)
        if end.is_on_sinker:
            self.note("anchor.drags: a point of MoorDyn has no friction, so that the sinker is fixed")
            return ("Fixed", *(end.position or ()), *none)
        if end.kind == "buoy":
            buoy = self.network.buoys[name]
            place = (buoy.fairleads or {})[end.fairlead] if end.fairlead else (0.0, 0.0, buoy.mooring_height)
            return (f"Body{list(self.network.buoys).index(name) + 1}", *place, *none)
        if end.kind == "free":
            if top is not None and any(top.force):
                self.note("cable.top.force is not carried over")
            return ("Free", 0.0, 0.0, 0.0, *none)
        body, at = self.network.bodies.get(name), self.start.joints.get(name, np.zeros(3)).tolist()
        return ("Free", *at, *((body.mass, body.volume, body.drag_area, body.added_mass) if body else none))

    def _bodies(self) -> tuple[list[Any], list[Any], list[Any]]:
        bodies, types, rods = list[Any](), list[Any](), list[Any]()
        for number, (name, buoy) in enumerate(self.network.buoys.items(), 1):
            own = mass_properties(buoy)
            begins = buoy.initial.buoy_position if buoy.initial else None
            center = self.start.buoys.get(name, np.array(begins or (0.0, 0.0, 0.0)))
            place = (center[0], center[1], center[2] - own.height)
            inertia = "|".join(f"{value:.14g}" for value in own.inertia)
            bodies.append(
                (number, "Free", *place, 0.0, 0.0, 0.0, own.mass, f"0|0|{own.height:.14g}", inertia, 0.0, 0.0, 0.0)
            )
            shape: Any = buoy.hull
            for low, high, diameter in self._cylinders(buoy):
                kind = f"rod{len(types) + 1}"
                drag = self._ends_share(buoy, 2), self._ends_share(buoy, 3)
                types.append(
                    (kind, diameter, 0.0, buoy.normal_drag, buoy.added_mass)
                    + (buoy.axial_drag * drag[0], buoy.axial_added_mass * drag[1])
                )
                segments = max(2, round(ROD_SEGMENTS * (high - low) / shape[-1][0]))
                rods.append((len(rods) + 1, kind, f"Body{number}", 0.0, 0.0, low, 0.0, 0.0, high, segments, "-"))
        return bodies, types, rods

    def _cylinders(self, buoy: Buoy) -> list[tuple[float, float, float]]:
        """(low, high, diameter) of the cylinders of a hull, from the keel up."""
        found, stations = list[tuple[float, float, float]](), np.array(buoy.hull or [], dtype=float).tolist()
        for (low, d0), (high, d1) in pairwise(stations):
            if high <= low:
                continue
            if d0 == d1:
                found.append((low, high, d0))
                continue
            self.note(f"hull: MoorDyn has no cones; each is made of {CONE_PARTS} cylinders of its volume")
            edges = np.linspace(0.0, 1.0, CONE_PARTS + 1)
            for a, b in pairwise(edges):
                da, db = d0 + a * (d1 - d0), d0 + b * (d1 - d0)
                mean = math.sqrt((da * da + da * db + db * db) / 3)
                found.append((float(low + a * (high - low)), float(low + b * (high - low)), mean))
        return found

    def _ends_share(self, buoy: Buoy, power: int) -> float:
        """Ratio of hull faces to rod ends by this power of the diameter, to scale the end coefficients."""
        cylinders = self._cylinders(buoy)
        diameters = [0.0, *(d for _, _, d in cylinders), 0.0]
        faces = sum(abs(b**power - a**power) for a, b in pairwise(diameters))
        if len(cylinders) > 1:
            self.note(
                "hull: drag and added mass of MoorDyn's rod ends are scaled so that the sum over all ends is the hull's"
            )
        return faces / sum(2 * d**power for _, _, d in cylinders)

    def _left_out(self) -> None:
        scene = self.scene
        for name in ("wind", "external_force"):
            if getattr(scene, name) is not None or any(getattr(b, name, None) for b in self.network.buoys.values()):
                self.note(f"[{name}] is not carried over")
        if any(vessel.wind is not None for vessel in scene.vessel or []):
            self.note("vessel.wind is not carried over: it moves nothing, its force is an output")
        for buoy in self.network.buoys.values():
            for name in LEFT_OUT:
                if getattr(buoy, name):
                    self.note(f"buoy.{name} is not carried over")
            for name in ("buoy_orientation", "buoy_velocity", "buoy_angular_velocity"):
                if getattr(buoy.initial, name):
                    self.note(f"initial.{name} is not carried over: a body begins upright and at rest")
        for piece in self.network.pieces:
            for name in ("fails_at", "marine_growth"):
                if getattr(piece.section, name):
                    self.note(f"{name} is not carried over")
            if piece.section.grading != 1 or isinstance(piece.section.elements, list):
                self.note("elements: MoorDyn's segments of a line are equally long")
            if piece.section.slack == "compressive":
                self.note("slack: MoorDyn's lines carry no compression, those of this scene do")
            if piece.section.bending_damping:
                self.note("bending_damping: MoorDyn's lines have none")
            if any(end.clamp for end in piece.ends):
                self.note("direction: an end that has one is pinned there, a rod would have to hold it")
            if piece.section.bending_stiffness and self.network.welds:
                self.note("weld: MoorDyn's lines are hinged at every point")
            if not piece.section.tangential_froude_krylov:
                self.note("tangential_froude_krylov: MoorDyn's lines feel it always")


_OF_A_TYPE = ["line_density", "diameter", "area", "axial_stiffness", "damping"]
_OF_A_TYPE += ["added_mass", "tangential_added_mass", "normal_drag", "tangential_drag", "bending_stiffness"]


def _elements(section: Cable) -> int:
    counts: Any = section.elements
    total = counts if isinstance(counts, int) else sum(int(count) for _, count in counts)
    return max(2, total)  # MoorDyn's lines have two segments at least


def _table(name: str, columns: str, *rows: Any) -> str:
    lines = [f"--- {name} ---", columns, " ".join("(-)" for _ in columns.split())]
    lines += [" ".join(map(_word, row)) for row in rows]
    return "\n".join(lines) + "\n"


def _word(value: float | str) -> str:
    return f"{value:.14g}" if isinstance(value, float) else str(value)
