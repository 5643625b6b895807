"""What both programs compute: driven cables, one of which bends, moored buoys, a chain on the bed, three lines, a sea.

The cables are in still water, with their tops moved; all of a cable is taut, where the two models are the same:
MoorDyn has no compression.  The buoys are slender cylinders, which is what both programs know, on the same cables, in a
regular wave and a uniform current that keeps the cable taut.  What is not the same in the two programs:

- MoorDyn integrates the pressure of the wave over a rod, dolfbuoy cuts each strip by the local water plane and adds
  the force of the undisturbed acceleration along the axis (Eq. (10)): equal for a slender hull;
- added mass of strips acts across the axis in MoorDyn and in all directions in Eq. (10): it is left out in both;
- dolfbuoy's wave grows, MoorDyn's starts at full height;
- dolfbuoy damps rotation about the axis; MoorDyn's cylinder has no yaw moment at all;
- MoorDyn starts from an upright body and the catenary without current, dolfbuoy from equilibrium;
- damping of the bed, and friction on it, which is left out;
- the waves between the points of MoorDyn's table, which it interpolates linearly.
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from dolfbuoy import load_scene, solve_static
from dolfbuoy.scene import Scene, settings

#: The whole run whose cost is compared [s].
END = 120.0


@dataclass(frozen=True)
class Mooring:
    """A scene as long as errors are measured, over the last `window` seconds.

    period: to which steps refer [s].  finest: scheme, pair, elements and steps to a period of dolfbuoy's limit; they
    are doubled twice.  segments: of MoorDyn, where its settings are looked for first, and of its own limit, halved
    twice; None where both programs are measured against dolfbuoy's.  softer: the mooring whose integrator is used.
    """

    name: str
    scene: Scene
    window: float
    period: float
    finest: tuple
    segments: tuple[int, int | None]
    softer: str | None = None

    @property
    def until(self) -> float:
        """How long errors are measured [s]."""
        return self.scene.time.end

    def lasting(self, end) -> Scene:
        """The scene until then."""
        return load_scene(self.scene, **{"time.end": end})

    @cached_property
    def rest(self):
        """Its equilibrium."""
        return solve_static(self.scene)


# -- cables ------------------------------------------------------------------------------------------------------------

CABLES = "short", "long"
#: Top of the long cable, moved in the period of the scene's wave; all of the cable stays taut (2 kN at least).
LONG_TOP = {
    "kind": "prescribed",
    "position": [320.0, 0.0, -100.0],
    "amplitude": [0.0, 0.0, 1.0],
    "period": 6.0,
    "ramp": 12.0,
}
WITHOUT_BUOY = {"buoy": None, "waves": None, "current": None, "wind": None, "external_force": None}
FINEST = {"short": (6, 240), "long": (16, 240)}


def cable(name, which, stiffness, bending=0.0) -> Mooring:
    """The short or the long cable with its top moved, axial stiffness times `stiffness`: the ramp and three periods.

    bending: EI [N m^2]; ends are pinned.
    """
    scene = load_scene("driven") if which == "short" else load_scene("long", **WITHOUT_BUOY, cable__top=LONG_TOP)
    period = settings.period_of(scene)
    changes = {"cable.axial_stiffness": stiffness * scene.network.pieces[0].section.axial_stiffness}
    changes["cable.bending_stiffness"] = bending
    scene = load_scene(scene, **changes, **{"time.end": settings.ramp_of(scene) + 3 * period})
    softer = f"{which}, EA x {stiffness // 100}" if stiffness > 1 else None
    first = 20 if which == "short" else 50
    return Mooring(name, scene, period, period, ("generalized-alpha", (3, 2), *FINEST[which]), (first, None), softer)


# -- buoys -------------------------------------------------------------------------------------------------------------

#: Slender spars, so that the moment of the water plane, which the two models treat differently, is small.
BUOYS = {
    "short": {"hull": [[0.0, 0.8], [6.0, 0.8]], "mass": 1500.0, "center_of_mass": 1.6, "inertia": [3200.0, 120.0]},
    "long": {"hull": [[0.0, 1.4], [9.0, 1.4]], "mass": 4200.0, "center_of_mass": 2.0, "inertia": [13000.0, 1000.0]},
}
STRIPS = {"added_mass": 0.0, "normal_drag": 0.8, "axial_added_mass": 0.64, "axial_drag": 1.1}
STRIPS |= {"rotational_damping": 2000.0}
#: Speed of the current [m/s], across and against the waves.
CURRENT = {"short": 1.2, "long": 0.8}
#: The long mooring drifts for minutes.
UNTIL = {"short": 60.0, "long": END}


def buoy(name, which) -> Mooring:
    """A buoy on the short or the long cable, in waves and current, until it moves periodically."""
    base = load_scene(which).to_dict()
    depth, period = base["sea"]["depth"], base["waves"]["period"]
    data = {key: base[key] for key in ("sea", "cable", "time")}
    data |= {"title": f"Moored cylinder, {which} cable", "buoy": BUOYS[which] | STRIPS}
    data |= {"waves": {"amplitude": 1.0, "direction_deg": 0.0, "period": period, "ramp": 2 * period}}
    profile = [[-depth, CURRENT[which]], [0.0, CURRENT[which]]]
    data |= {"current": {"profile": profile, "direction_deg": 150.0}}
    scene = load_scene(data, **{"time.end": UNTIL[which]})
    finest = "generalized-alpha", (3, 2), FINEST[which][0], 120
    return Mooring(name, scene, period, period, finest, (10, 80) if which == "short" else (35, 400))


# -- more --------------------------------------------------------------------------------------------------------------


def chain(name) -> Mooring:
    """The shipped chain with its top driven, without friction, which the programs understand differently."""
    scene = load_scene("chain-on-bed", **{"seabed.friction": 0.0, "time.end": 60.0})
    return Mooring(name, scene, 20.0, 10.0, ("bdf2", (2, 1), 40, 96), (112, 896))


def three_lines(name) -> Mooring:
    """A spar on the three ropes of `three-legs`, in its wave."""
    data = load_scene("three-legs").to_dict()
    hull = {"hull": [[0.0, 1.2], [6.0, 1.2]], "mass": 2500.0, "center_of_mass": 1.2, "inertia": [8000.0, 400.0]}
    angles = {"east": 0.0, "north": 2 * math.pi / 3, "south": -2 * math.pi / 3}
    places = {at: [0.6 * math.cos(angle), 0.6 * math.sin(angle), 0.5] for at, angle in angles.items()}
    data["buoy"] = STRIPS | hull | {"fairleads": places}
    data["waves"] |= {"direction_deg": 0.0}
    scene = load_scene(data, **{"time.end": 60.0})
    return Mooring(name, scene, 10.0, 5.0, ("generalized-alpha", (2, 1), 48, 96), (14, 160))


#: Of the irregular sea: lowest frequency, and steps from it [rad/s]; significant height [m]; peak frequency [rad/s].
LOWEST, APART, HEIGHT, PEAK = 0.5, 0.02, 3.0, 1.0


def components():
    """[[amplitude, period, direction, phase], ...] of Bretschneider's spectrum, phases by chance."""
    w = LOWEST + APART * np.arange(100)
    density = 5 / 16 * HEIGHT**2 * PEAK**4 / w**5 * np.exp(-1.25 * (PEAK / w) ** 4)
    phases = np.random.Generator(np.random.PCG64(1)).uniform(0, 360, 100)
    rows = zip(np.sqrt(2 * density * APART), 2 * math.pi / w, phases, strict=True)
    return [[float(a), float(T), 0.0, float(p)] for a, T, p in rows]


def irregular(name) -> Mooring:
    """A light rope that is held under an irregular sea; MoorDyn's table of waves is stretched as Wheeler did."""
    data = load_scene("driven").to_dict()
    rope = {"axial_stiffness": 2e6, "line_density": 14.0, "diameter": 0.1, "normal_drag": 1.2, "added_mass": 1.0}
    data["cable"] |= rope | {"top": {"kind": "fixed", "position": [14.0, 0.0, -3.5]}}
    data["waves"] = {"components": components(), "ramp": 10.0, "stretching": "wheeler"}
    scene = load_scene(data, **{"time.end": 60.0})
    return Mooring(name, scene, 40.0, 5.0, ("generalized-alpha", (2, 1), 16, 96), (28, 160))


MAKERS = {f"{which}, EA x {EA}": (cable, which, EA) for which in CABLES for EA in (1, 100, 10000)}
MAKERS |= {"short, EI = 1 kN m2": (cable, "short", 1, 1e3)}
MAKERS |= {f"buoy, {which} cable": (buoy, which) for which in CABLES}
MAKERS |= {"chain on the bed, driven": (chain,), "three lines on a buoy": (three_lines,)}
MAKERS |= {"irregular sea, 100 components": (irregular,)}


@cache
def mooring(name) -> Mooring:
    """One of MAKERS."""
    make, *about = MAKERS[name]
    return make(name, *about)
