"""Sections of a scene, typed and bounded.

A missing section switches its effect off.  SI units; degrees only where the key's name says so.
"""

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import tomli_w
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from . import quantities as q
from .anchors import Anchor, given_anchors, with_sinkers
from .bathymetry import BedGrid
from .buoy import Buoy, BuoyStart, ExternalForce, Turning, Wind
from .criteria import Criteria, check_criteria
from .fatigue import Fatigue, check_fatigue
from .lines import PHYSICAL, SHARED, SIZE, Joint, Line, Material
from .network import Network, resolved
from .network_checks import check_network
from .petsc_options import checked
from .quantities import Missing, Wrong
from .section import Section, key
from .take_off import TakeOff
from .vessel import Vessel
from .wave_files import MOST_ROWS, grid_of, rows_of
from .waves import Waves

Tide = Annotated[list[q.Instant], *rows_of(2), Field(min_length=2)]


class Sea(Section):
    """Water.  Without it the scene is dry: no hydrostatics, no Morison forces, no waves, no current."""

    depth: q.Length = key("water depth; the sea bed is at z = -depth", "m")
    density: q.Density = key("water density", "kg/m^3", default=1025.0)
    tide: Tide | None = key(
        "height of still water over time, [[t, z], ...] or a file; counted from that at t = 0", "s, m", default=None
    )
    dry_above: bool | None = key(
        "treat lines and joint bodies as dry above the surface; absent: if any of them can surface", default=None
    )


CurrentGrid = Annotated[list[q.CurrentInTime], Field(min_length=2, max_length=MOST_ROWS), BeforeValidator(grid_of)]


class Current(Section):
    """A current; in a table the speeds stand in place of `speed`, in a grid all of it."""

    speed: q.Speed | None = key("current speed at and above still water", "m/s", default=None)
    direction_deg: q.Angle = key(
        "direction towards which the current flows, counterclockwise from x", "deg", default=0.0
    )
    profile: Literal["uniform", "power"] | q.Rows = key(
        "vertical profile, or a table [[z, speed], ...]", "m, m/s", default="uniform"
    )
    exponent: Annotated[float, Field(gt=0, le=1)] = key(
        "exponent of the power law (1 + z/depth)^exponent", "1", default=1 / 7
    )
    over_time: Turning | None = key(
        "factor of the speed and turn over time, [[t, factor, turn], ...], or a file", "s, 1, deg", default=None
    )
    grid: CurrentGrid | None = key(
        "velocity over depth and time, [[t, z, u, v], ...], or a file", "s, m, m/s", default=None
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.grid is not None:
            self.refuse(("speed", "direction_deg", "profile", "over_time"), "does not go with a grid, which has it all")
            times, heights = {row[0] for row in self.grid}, {row[1] for row in self.grid}
            if len(heights) < 2 or len({row[:2] for row in self.grid}) < len(self.grid):
                raise Wrong("grid", "[...]", "must hold two heights z or more, each once at a time")
            if len(self.grid) != len(times) * len(heights):
                raise Wrong("grid", "[...]", "must hold a row for every height z at every time t")
        elif isinstance(self.profile, list):
            if len(self.profile) < 2 or not q.is_rising([z for z, _ in self.profile]):
                raise Wrong("profile", self.profile, "must hold at least two rows [z, speed] with z increasing")
            if self.speed is not None:
                raise Wrong("speed", self.speed, "does not go with a table: the speeds stand in profile")
        elif self.speed is None:
            raise Missing("speed", "or a table of speeds as profile")
        return self


class Seabed(Section):
    """A bed that carries lines and bodies: the plane z = -depth + slope . (x, y)."""

    friction: q.Coefficient = key("Coulomb friction coefficient mu", "1", default=0.0)
    stiffness: q.BedStiffness | None = key(
        "normal stiffness, pressure per penetration; absent: penetration of 1e-4 depth or 1 cm at most",
        "Pa/m",
        default=None,
    )
    damping_ratio: q.Coefficient = key("damping ratio of normal contact; 1: critical", "1", default=1.0)
    stick_length: q.Length | None = key(
        "displacement over which Coulomb friction is mobilised; absent: 1e-3 depth, 5 cm at most", "m", default=None
    )
    slope: q.Slope = key("slope of the sea bed [dz/dx, dz/dy]", "1", default=(0.0, 0.0))
    depths: BedGrid | None = None
    start: Literal["frictionless", "pulled"] = key(
        "initial friction state: none, or that of lines laid slack on the bed and then pulled", default="frictionless"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.depths is not None:
            self.refuse(["slope"], "does not go with depths, which have their own")
            self.refuse(["start"], "does not go with depths, only with a plane bed")
        return self


Corners = Annotated[list[q.Vector], Field(max_length=40_000)]


class Initial(BuoyStart):
    """Start of a run."""

    kind: Literal["equilibrium", "straight", "polyline"] = key("initial shape of the cables", default="equilibrium")
    points: Corners | dict[q.Name, Corners] | None = key(
        "vertices of the initial shape, or of a first guess, from the anchor up; for several cables by name",
        "m",
        default=None,
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.kind == "polyline" and self.points is None:
            raise Wrong("kind", self.kind, "needs points")
        if self.kind == "straight":
            self.refuse(["points"], "goes with kind 'polyline' or 'equilibrium' only")
        for points in self.points.values() if isinstance(self.points, dict) else [self.points]:
            if points is not None and len(points) < 2:
                raise Wrong("points", points, "must be at least two points")
        return self


MOST_STEPS = 1e9
#: Time schemes, and their names in sentences; implemented in motion/schemes.py.
SCHEMES = {"backward-euler": "backward Euler", "bdf2": "BDF2", "generalized-alpha": "generalized-alpha"}


class Time(Section):
    """Time integration."""

    end: q.Duration = key("end time of the run", "s")
    step: q.Step = key("time step; with a tolerance the first one", "s")
    scheme: Literal["backward-euler", "bdf2", "generalized-alpha"] = key(
        "time integration scheme", default="backward-euler"
    )
    spectral_radius: Annotated[float, Field(ge=0, lt=1)] = key(
        "spectral radius at infinite frequency of generalized-alpha (numerical damping)", "1", default=0.8
    )
    tolerance: q.Tolerance | None = key(
        "relative local error tolerance of adaptive steps; absent: constant steps", "1", default=None
    )
    min_step: q.Step | None = key("smallest adaptive step; absent: 1e-4 step", "s", default=None)
    max_step: q.Step | None = key("largest adaptive step; absent: 100 step, end/10 at most", "s", default=None)
    output_every: q.Step | None = key("output interval of cable shapes; absent: end/200", "s", default=None)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.end > MOST_STEPS * self.step:
            raise Wrong("step", self.step, f"must be at least end / {MOST_STEPS:g}, and end is {self.end:g}")
        if self.output_every is not None and self.end > MOST_STEPS * self.output_every:
            raise Wrong("output_every", self.output_every, f"must be at least end / {MOST_STEPS:g}")
        if self.tolerance is None:
            self.refuse(("min_step", "max_step"), "goes with a tolerance only; without one all steps are equal")
        if self.min_step is not None and self.max_step is not None and self.min_step > self.max_step:
            raise Wrong("min_step", self.min_step, f"must not be above max_step = {self.max_step}")
        if self.scheme != "generalized-alpha":
            self.refuse(["spectral_radius"], f"goes with 'generalized-alpha', not '{self.scheme}'")
        return self


class Accuracy(Section):
    """Error bars of the outputs of a run; without this section nothing is estimated."""

    estimate: Literal["none", "time", "companion", "both"] = key(
        "companion: from a second, coarser run; time: error of the steps over time; both", default="both"
    )
    target: Annotated[float, Field(ge=1e-5, le=0.5)] | None = key(
        "largest error of the outputs in `of`, relative; with it settings are found that reach it", "1", default=None
    )
    of: Annotated[list[q.Title], Field(max_length=100)] = key(
        "outputs that must reach it, as tension_top.max; absent: largest tensions and cone angle", default=[]
    )
    rounds: Annotated[int, Field(ge=1, le=10)] = key("runs until it is given up", "1", default=4)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.target is None:
            self.refuse(("of", "rounds"), "goes with a target only")
        elif self.estimate in ("none", "time"):
            raise Wrong("estimate", self.estimate, "does not go with a target, which needs bars")
        return self


class Design(Section):
    """Numbers that `dolfbuoy design` chooses, what is to be least, and limits; options of the command come first."""

    vary: Annotated[dict[q.Title, q.Pair], Field(min_length=1, max_length=100)] | None = key(
        "least and largest value of each number that may be chosen, by its key", "1", default=None
    )
    least: q.Expression | None = key("expression of keys and outputs that is to be least", default=None)
    hold: Annotated[list[q.Expression], Field(max_length=100)] = key(
        "limits, 'EXPRESSION < LIMIT' or 'EXPRESSION > LIMIT'", default=[]
    )
    case: Annotated[list[q.Expression], Field(max_length=100)] = key(
        "load cases, 'KEY=VALUE;...' each: changes of the scene with which limits hold too", default=[]
    )


class Solver(Section):
    """Nonlinear solver; `petsc` holds options of PETSc's SNES (`petsc_options`), for example {snes_monitor = true}."""

    petsc: Annotated[dict[str, Any], AfterValidator(checked)] = key(
        "options of PETSc's nonlinear and linear solvers; allowed ones: petsc_options", default={}
    )
    step_tolerance: q.Tolerance = key("Newton convergence tolerance, relative to typical magnitudes", "1", default=1e-9)
    quadrature_degree: q.Degree | None = key(
        "quadrature degree on the cable; absent: chosen from position_degree", "1", default=None
    )
    keep_jacobian: bool = key("in runs, reuse the Jacobian as long as Newton converges fast with it", default=True)
    hull_cells: Annotated[int, Field(ge=1, le=1000)] = key(
        "approximate number of integration cells over the hull's height; each is split at the water surface",
        "1",
        default=2,
    )
    hull_quadrature_degree: q.Degree = key(
        "quadrature degree on hull cells cut by the surface; a third of it on wet ones", "1", default=17
    )


def _as_list(value: Any) -> list[Any]:
    """Convert a single table to a list of one."""
    if isinstance(value, dict | Section):
        return [value]
    if not isinstance(value, list) or not value:
        raise ValueError("must be a section, a table of keys, or a list of such tables")
    return value


Cables = Annotated[list[Line], BeforeValidator(_as_list)]
Buoys = Annotated[list[Buoy], BeforeValidator(_as_list)]
Anchors = Annotated[list[Anchor], BeforeValidator(_as_list)]
TakeOffs = Annotated[list[TakeOff], BeforeValidator(_as_list)]
#: Tables of which a scene may have several; a single one may also be written as [cable].
SEVERAL = ("cable", "buoy", "anchor", "take_off")


class Scene(Section):
    """A complete scene."""

    title: q.Title = key("title of the scene in figures and tables", default="")
    project: q.Title = key("project that reports name", default="")
    author: q.Title = key("author that reports name", default="")
    revision: q.Title = key("revision that reports name", default="")
    gravity: q.Gravity = key("gravitational acceleration", "m/s^2", default=9.81)
    sea: Sea | None = None
    cable: Cables | None = None
    buoy: Buoys | None = None
    joint: list[Joint] | None = None
    vessel: list[Vessel] | None = None
    anchor: Anchors | None = None
    take_off: TakeOffs | None = None
    library: str | None = key("TOML file of user-defined materials, one table of keys per name", default=None)
    material: dict[q.Name, Material] | None = None
    waves: Waves | None = None
    current: Current | None = None
    wind: Wind | None = None
    external_force: ExternalForce | None = None
    seabed: Seabed | None = None
    initial: Initial = Initial.model_construct()  # same as Initial(), for which pydantic would build a validator
    time: Time | None = None
    accuracy: Accuracy | None = None
    uncertain: q.Spreads | None = key(
        "1 sigma of numbers by their keys: 20.0, '20%', 'lognormal 20%' or 'uniform 5%'", "1", default=None
    )
    design: Design | None = None
    criteria: Criteria | None = None
    fatigue: Fatigue | None = None
    solver: Solver = Solver.model_construct()

    @model_validator(mode="after")
    def _sections(self) -> Self:
        def need(section: str, other: str, why: str) -> None:
            if getattr(self, section) is not None and getattr(self, other) is None:
                raise Missing(other, f"[{section}] needs [{other}]: {why}")

        if self.cable is None and self.buoy is None:
            raise Missing("cable", "or buoy: without them nothing would move")
        need("waves", "sea", "without it there is no water")
        need("current", "sea", "without it there is no water")
        if self.waves is not None and self.sea is not None and self.waves.theory == "stream":
            if self.gravity == 0:
                raise Wrong("gravity", self.gravity, "carries no waves of theory = 'stream'")
            self.__dict__["waves"] = self.waves.with_period(self.sea.depth, self.gravity)
        if self.waves is not None and self.gravity == 0 and self.waves.irregular:
            raise Wrong(
                "gravity", self.gravity, "carries no irregular sea of [waves]: no dispersion relation gives wavelengths"
            )
        if self.waves is not None and self.gravity == 0 and self.waves.wavelength is None:
            raise Missing("waves.wavelength", "without gravity no dispersion relation gives it")
        if any(vessel.raos for vessel in self.vessel or []):
            if self.waves is None:
                raise Missing("waves", "vessel.raos are of a response to them")
            if self.waves.theory == "stream":
                raise Wrong("waves.theory", "stream", "does not go with vessel.raos, which are linear")
        current = self.current
        if current is not None and self.waves is not None and self.waves.period_seen_from is not None:
            for name in ("over_time", "grid"):
                if getattr(current, name) is not None:
                    allowed = f"goes with a steady current, and current.{name} changes it: leave it out"
                    raise Wrong("waves.period_seen_from", self.waves.period_seen_from, allowed)
        need("seabed", "sea", "its depth says where the bed is")
        need("seabed", "cable", "it carries lines")
        if self.seabed is not None and self.gravity == 0:
            raise Wrong("gravity", self.gravity, "does not go with [seabed]: nothing would lie on it")
        need("wind", "buoy", "it acts on the buoy only")
        need("external_force", "buoy", "it acts on the buoy only")
        check_network(self)
        given_anchors(self)
        check_criteria(self)
        check_fatigue(self)
        slack = {piece.section.slack for piece in self.network.pieces} - {"compressive"}
        if slack and self.time and self.time.scheme == "generalized-alpha" and self.time.spectral_radius > 0:
            # it stores an acceleration, which an impact invalidates: it gains energy from every snap
            allowed = f"with generalized-alpha needs time.spectral_radius = 0, not {self.time.spectral_radius}: "
            raise Wrong("cable.slack", slack.pop(), f"{allowed}others gain energy whenever the cable snaps taut")
        if self.waves is not None and self.waves.theory == "stream" and any(buoy.disk_averages for buoy in self.buoys):
            raise Wrong("buoy.disk_averages", True, "goes with linear waves, not with waves.theory = 'stream'")
        if self.gravity == 0 and any(b.potential_flow for b in self.buoys):
            raise Wrong("gravity", self.gravity, "carries no waves of buoy.potential_flow")
        if self.waves is not None and self.waves.theory == "stream" and any(b.potential_flow for b in self.buoys):
            raise Wrong("waves.theory", "stream", "does not go with buoy.potential_flow, whose diffraction is linear")
        if self.sea is not None and any(buoy.hull is None for buoy in self.buoys):
            raise Missing("buoy.hull", "the sea needs it")
        return self

    @cached_property
    def network(self) -> Network:
        """Resolved topology: pieces of line, joints, bodies and buoys."""
        return with_sinkers(self, resolved(self))

    def model_copy(self, **how: Any) -> Self:
        """A copy with some sections replaced, which resolves its network anew."""
        copied = super().model_copy(**how)
        copied.__dict__.pop("network", None)
        return copied

    @property
    def cables(self) -> list[Line]:
        return self.cable or []

    @property
    def buoys(self) -> list[Buoy]:
        return self.buoy or []

    @property
    def take_offs(self) -> list[TakeOff]:
        return self.take_off or []

    def __eq__(self, other: object) -> bool:
        """Scenes are equal if they are once all defaults are written out."""
        return self.to_dict() == other.to_dict() if isinstance(other, Scene) else NotImplemented

    def to_dict(self, sections: set[str] | None = None) -> dict[str, Any]:
        """All values, defaults included, that reproduce this scene, or some sections."""
        found = _without_none(self.model_dump(include=sections))
        if "cable" in found:
            found["cable"] = [self._complete(table, k) for k, table in enumerate(found["cable"])]
        return {name: value[0] if name in SEVERAL and len(value) == 1 else value for name, value in found.items()}

    def _complete(self, table: dict[str, Any], cable: int) -> dict[str, Any]:
        """The table of a cable with all defaults that are not overridden by segments or a material."""
        names = {*SHARED, *SIZE, *PHYSICAL}
        names -= {*SIZE, *PHYSICAL} if "segments" in table else {*PHYSICAL} if "material" in table else set()
        section = self.network.pieces[self.network.first_of(cable)].section
        whole = _without_none(section.model_dump(include=names)) | table
        return {name: whole[name] for name in type(self.cables[cable]).model_fields if name in whole}

    def to_toml(self) -> str:
        """The complete scene as a scene file."""
        return tomli_w.dumps(self.to_dict())

    def save(self, path: str | Path) -> None:
        """Write the complete scene as TOML."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_without_none(v) for v in value]
    return value
