"""Upright buoys in still water, free and under the pull of their lines: drafts and metacentric heights."""

import math
from dataclasses import dataclass, replace

from ..meshes import HullShape
from ..model.feasible import hanging_weight, shape_and_mass
from ..model.rigid import Floating, MassProperties, float_upright, weight_per_length
from ..roots import brentq
from ..scene.buoy import Buoy
from ..scene.network import attached_ends
from ..scene.stiffness import secant


@dataclass(frozen=True)
class Upright:
    """An upright buoy in still water; name: "" if there is no other.

    pull: of its lines, downwards [N], at a height above the keel [m]; how: words for it, "" if nothing is known of one.
    righted: whether lines off its axis right it too.
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
        """What pulls it up when it is drowned [N]."""
        return (self.density * self.shape.volume() - self.mass.mass) * self.gravity

    @property
    def drowned(self) -> bool:
        """Whether its lines hold all of it under water."""
        return bool(self.how) and self.pull >= self.spare * (1 - 1e-9)

    def under(self, pull) -> Floating:
        """How it floats under a pull [N].  Raises InputError if it sinks."""
        return float_upright(self.shape, self.mass, self.density, self.gravity, pull, self.height)

    @property
    def GM(self) -> float:
        """Restoring lever per weight under the pull [m]."""
        if not self.drowned:
            return self.under(self.pull).GM
        arm = self.density * self.shape.volume() * (self.shape.centroid() - self.height)
        return arm / self.mass.mass - (self.mass.height - self.height)


def buoys_of(scene, rest=None) -> list[Upright]:
    """The buoys of a scene with water; rest: its equilibrium, a solved static Problem, if it is known."""
    network, found = scene.network, []
    for name, section in network.buoys.items() if scene.sea else ():
        called = name if len(network.buoys) > 1 else ""
        free = Upright(called, section, *shape_and_mass(section), scene.sea.density, scene.gravity)
        found.append(_moored(scene, name, free, rest) if scene.gravity else free)
    return found


def _moored(scene, name, buoy, rest):
    """Under the pull of its lines: of one that hangs straight down, else at rest if that is known."""
    network = scene.network
    ends = [(network.pieces[k], k, i) for k, i in attached_ends(network) if network.pieces[k].ends[i].name == name]
    fairleads = [piece.ends[i].fairlead for piece, _, i in ends]
    places = [buoy.section.fairleads[f] if f else (0.0, 0.0, buoy.section.mooring_height) for f in fairleads]
    buoy = replace(buoy, righted=any(x or y for x, y, _ in places))
    if len(ends) == 1 and not buoy.righted and (far := ends[0][0].ends[1 - ends[0][2]]).held:
        line = ends[0][0].section, far.top.position[2], hanging_weight(scene, name)
        return _above(scene, *line, replace(buoy, height=places[0][2]))
    if rest is None or not ends:
        return buoy
    pulls = [float(rest.end_force(k, i)[2]) for _, k, i in ends]
    if sum(pulls) <= -buoy.mass.mass * buoy.gravity:  # they hold it up, out of the water
        return buoy
    height = sum(pull * z for pull, (_, _, z) in zip(pulls, places, strict=True)) / (sum(pulls) or math.inf)
    return replace(buoy, pull=sum(pulls), height=height, how="with the pull of its lines")


def _above(scene, c, bottom, hanging, buoy):
    """Straight above the lower end of a line: with the weight that hangs of it, or drawn down by it."""
    w, most = weight_per_length(scene, c), buoy.spare * (1 - 1e-12)

    def room(pull):
        """Length of the stretched line less the height of the mooring point above its lower end [m]."""
        middle = pull - w * c.length / 2
        stretched = c.length * (1 + middle / secant(c.axial_stiffness, middle))
        return stretched - (buoy.height - buoy.under(pull).draft - bottom)

    if room(hanging) >= 0:
        return replace(buoy, pull=hanging, how="with the weight of the cable")
    pull = most if room(most) < 0 else float(brentq(room, hanging, most))
    return replace(buoy, pull=pull, how="on its taut cable")
