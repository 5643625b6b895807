"""Buoys: mass, draft and metacentre, free and under the pull of their lines, and positions at rest."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ..meshes import HullShape
from ..model.feasible import hanging_weight
from ..model.problem import Problem
from ..model.rigid import Floating, MassProperties, float_upright, mass_properties, shape_of, weight_per_length
from ..model.sea import wavenumber
from ..parallel.ranks import bcast
from ..results.tables import newtons
from ..roots import brentq
from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.cable import Cable
from ..scene.network import attached_ends
from ..scene.stiffness import secant

if TYPE_CHECKING:
    from .report import Report


@dataclass(frozen=True)
class Upright:
    """An upright buoy in still water; name: "" if it is the only one.

    pull: of its lines, downwards [N], at a height above the keel [m]; how: words for it, "" if unknown.
    righted: True if lines attached off its axis also right it.
    """

    name: str
    section: Buoy
    shape: HullShape
    mass: MassProperties
    density: float
    gravity: float
    pull: float = 0.0
    height: float = 0.0
    how: str = ""
    righted: bool = False

    @property
    def spare(self) -> float:
        """Buoyancy minus weight when fully submerged [N]."""
        return float((self.density * self.shape.volume() - self.mass.mass) * self.gravity)

    @property
    def drowned(self) -> bool:
        """True if its lines hold it completely under water."""
        return bool(self.how) and self.pull >= self.spare * (1 - 1e-9)

    def under(self, pull: float) -> Floating:
        """Upright hydrostatics under a pull [N].  Raises InputError if it sinks."""
        return float_upright(self.shape, self.mass, self.density, self.gravity, pull, self.height)

    @property
    def GM(self) -> float:
        """Metacentric height under the pull: righting moment per unit angle and weight [m]."""
        if not self.drowned:
            return self.under(self.pull).GM
        arm = self.density * self.shape.volume() * (self.shape.centroid() - self.height)
        return float(arm / self.mass.mass - (self.mass.height - self.height))


def buoys_of(scene: Scene, rest: Problem | None = None) -> list[Upright]:
    """The buoys of a scene with water that float by their hulls, without bars.

    rest: its equilibrium, a solved static Problem, if known.
    """
    network, found = scene.network, []
    if scene.sea is None:
        return []
    for name, section in network.buoys.items():
        if network.bars_of(name):
            continue
        called = name if len(network.buoys) > 1 else ""
        shape: Any = shape_of(section)
        free = Upright(called, section, shape, mass_properties(section), scene.sea.density, scene.gravity)
        found.append(_moored(scene, name, free, rest) if scene.gravity else free)
    return found


def _moored(scene: Scene, name: str, buoy: Upright, rest: Problem | None) -> Upright:
    """The buoy under the pull of its lines: of a single vertical line, or else as in the equilibrium, if known."""
    network = scene.network
    ends: list[Any] = [(network.pieces[k], k, i) for k, i in attached_ends(network)]
    ends = [(piece, k, i) for piece, k, i in ends if piece.ends[i].name == name]
    fairleads, known = [piece.ends[i].fairlead for piece, _, i in ends], buoy.section.fairleads or {}
    places = [known[f] if f else (0.0, 0.0, buoy.section.mooring_height) for f in fairleads]
    buoy = replace(buoy, righted=any(x or y for x, y, _ in places))
    if len(ends) == 1 and not buoy.righted and (far := ends[0][0].ends[1 - ends[0][2]]).held:
        line = ends[0][0].section, far.top.position[2], hanging_weight(scene, name)
        return _above(scene, *line, replace(buoy, height=places[0][2]))
    if rest is None or not ends:
        return buoy
    pulls = [float(rest.end_force(k, i)[2]) for _, k, i in ends]
    if sum(pulls) <= -buoy.mass.mass * buoy.gravity:  # the lines hold it up, out of the water
        return buoy
    height = sum(pull * z for pull, (_, _, z) in zip(pulls, places, strict=True)) / (sum(pulls) or math.inf)
    return replace(buoy, pull=sum(pulls), height=height, how="with the pull of its lines")


def _above(scene: Scene, c: Cable, bottom: float, hanging: float, buoy: Upright) -> Upright:
    """The buoy vertically above the lower end of a line: carrying its hanging weight, or drawn down by it."""
    w, most = weight_per_length(scene, c), buoy.spare * (1 - 1e-12)

    def room(pull: float) -> float:
        """Length of the stretched line minus the height of the mooring point above its lower end [m]."""
        middle = pull - w * c.length / 2
        stretched = c.length * (1 + middle / secant(c.axial_stiffness, middle))
        return float(stretched - (buoy.height - buoy.under(pull).draft - bottom))

    if room(hanging) >= 0:
        return replace(buoy, pull=hanging, how="with the weight of the cable")
    pull = most if room(most) < 0 else float(brentq(room, hanging, most))
    return replace(buoy, pull=pull, how="on its taut cable")


def of_buoys(depth: float, buoys: Iterable[Upright], report: "Report") -> None:
    """Add masses, drafts and metacentric heights to the Report of `check`."""
    for buoy in buoys:
        about, free, lever = report.about(buoy.name), buoy.under(0.0), "restoring lever per weight of the buoy"
        about.add("buoy mass with point masses", buoy.mass.mass, "kg")
        about.add("centre of mass C above keel", buoy.mass.height, "m")
        about.add("draft, free", free.draft, "m")
        about.add("GM, free", free.GM, "m")
        if buoy.drowned:
            about.add("the cable holds the buoy under water: pull", buoy.spare, "N", "all of its spare buoyancy")
            about.add("GM under water", buoy.GM, "m", lever)
        elif buoy.how:
            about.add(f"draft {buoy.how}", buoy.under(buoy.pull).draft, "m")
            about.add(f"GM {buoy.how}", buoy.GM, "m", lever)
        about.warn(
            buoy.drowned,
            f"All of the hull is under water, held there with {newtons(buoy.spare)}: its lines are too short or too "
            f"heavy for {depth:.4g} m of water.",
        )
        heels = "only its lines right it" if buoy.righted else "the upright buoy is unstable and heels over"
        about.warn(buoy.GM <= 0, f"GM = {buoy.GM:.3g} m is not positive: {heels}.")


def buoys_at_rest(problem: Problem, report: "Report") -> None:
    """Add positions of moored buoys at rest to the Report of `check`; collective."""
    network, places = problem.network, []
    for name, rank in problem.buoy_ranks.items():
        buoy, of = problem.buoys.get(name), f" of {name}" if len(network.buoys) > 1 else ""
        x, y, z = bcast(problem.comm, buoy and buoy.fields.of(problem.system.u[buoy.part.slice]).position, rank)
        ends = [(network.pieces[k], i) for k, i in attached_ends(network)]
        cables = [(piece.cable, i) for piece, i in ends if piece.ends[i].name == name]
        far: list[Any] = [
            network.pieces[network.first_of(c) if i else network.last_of(c)].ends[1 - i] for c, i in cables
        ]
        if far and all(end.held for end in far):
            middle = [sum(end.top.position[axis] for end in far) / len(far) for axis in (0, 1)]
            what = "the anchor" if len(far) == 1 else "the middle of its anchors"
            report.add(f"equilibrium: offset of C{of} from {what}", math.dist((x, y), middle), "m")
        report.add(f"equilibrium: C{of} above still water", z, "m")
        places.append((x, y))
    waves: Any = problem.scene.waves
    if places and waves is not None and waves.crest is not None:
        nearest = min(places, key=partial(math.dist, waves.crest_position))
        _crest_far_away(problem.scene, math.dist(nearest, waves.crest_position), nearest, report)


def _crest_far_away(scene: Scene, away: float, nearest: tuple[float, float], report: "Report") -> None:
    """Warn if a prescribed crest is more than a twentieth of a wavelength from the nearest buoy at rest."""
    waves: Any = scene.waves
    (x, y), there = waves.crest_position, f"waves.crest_position = [{nearest[0]:.3g}, {nearest[1]:.3g}] has it there"
    report.warn(
        away * wavenumber(scene) > 2 * math.pi / 20,
        f"waves.crest_position = [{x:g}, {y:g}] is {away:.3g} m from where the buoy rests; {there}.",
    )
