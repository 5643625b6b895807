"""Random scenes over the whole admissible input range, for hypothesis.

A structure says which sections and keys a scene has (what is compiled); every key that it leaves as `...` is drawn
from `ranges`, extreme magnitudes included.  A key of the scene's model that is in neither would never be tried:
`unknown_keys` names those.
"""

import math
import re

import numpy as np
from hypothesis import strategies as st

from dolfbuoy.model import effects
from dolfbuoy.scene import list_keys

ANY = ...  # drawn from `ranges`


def size(low, high, zero=False):
    """Log-uniform between two positive numbers, now and then exactly zero."""
    drawn = st.floats(math.log10(low), math.log10(high)).map(lambda x: float(10**x))
    return st.one_of(drawn, drawn, drawn, st.just(0.0)) if zero else drawn


def vector(low, high):
    """A vector of log-uniform length and any direction, the axes included."""
    direction = st.one_of(
        st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0)]),
        st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: math.hypot(*d) > 1e-3),
    )
    return st.tuples(size(low, high), direction).map(lambda p: [p[0] * c / math.hypot(*p[1]) for c in p[1]])


ANGLE = st.one_of(st.sampled_from([0.0, 90.0, -180.0]), st.floats(-360, 720))

#: Of keys that belong to no effect; the others are declared with theirs (`model.effects`).
OWN = {
    "gravity": st.one_of(st.just(9.81), size(1e-3, 1e2, zero=True)),
    "sea.depth": size(0.5, 6000),
    "sea.density": size(1.0, 3000),
    "cable.length": size(0.1, 5000),
    "cable.line_density": size(1e-3, 1e4),
    "cable.diameter": size(1e-4, 3.0),
    "cable.area": st.one_of(st.none(), size(1e-8, 10.0)),
    "cable.elements": st.integers(1, 8),
    "cable.grading": size(0.2, 5.0),
    "cable.anchor": vector(1e-2, 1e4),
    "cable.top.force": vector(1e-6, 1e9),
    "cable.top.amplitude": vector(1e-6, 1e2),
    "cable.top.period": size(1e-3, 1e4),
    "cable.top.phase_deg": st.one_of(ANGLE, st.tuples(ANGLE, ANGLE, ANGLE).map(list)),
    "seabed.slope": st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)).map(list),
    "cable.top.ramp": size(1e-3, 1e3, zero=True),
    "buoy.mass": size(0.1, 1e7),
    "buoy.center_of_mass": st.floats(-5, 30),
    "buoy.mooring_height": st.floats(-5, 30),
    "waves.direction_deg": ANGLE,
    "waves.phase_deg": ANGLE,
    "current.direction_deg": ANGLE,
    "wind.direction_deg": ANGLE,
    "external_force.force": vector(1e-6, 1e7),
    "initial.buoy_position": vector(1e-3, 1e2),
    "initial.buoy_orientation": st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 1e-3).map(list),
    "initial.buoy_velocity": vector(1e-6, 30),
    "initial.buoy_angular_velocity": vector(1e-6, 10),
    "time.step": size(1e-5, 1.0),
    "time.scheme": st.sampled_from(["backward-euler", "bdf2", "generalized-alpha"]),
    "time.spectral_radius": st.floats(0, 0.999),
    "time.tolerance": st.one_of(st.none(), st.none(), size(1e-6, 1e-1)),
    "buoy.wave_damping": st.one_of(st.none(), st.tuples(size(1e-2, 1e6, True), size(1e-2, 1e6, True)).map(list)),
    "buoy.disk_averages": st.booleans(),
    "solver.hull_cells": st.integers(1, 40),
}


def ranges():
    """Dotted key -> strategy, of everything that can be drawn."""
    return OWN | {key: strategy(drawn) for effect in effects.EFFECTS for key, drawn in effect.drawn.items()}


def strategy(drawn):
    """Values of a key as its effect declares them."""
    return st.floats(drawn.low, drawn.high) if drawn.even else size(drawn.low, drawn.high, drawn.zero)


def coefficients(section, *where):
    """Keys of a section whose effects have a term in the form, in the order of the alphabet."""
    found = [e.key for e in effects.EFFECTS if e.drawn and any(getattr(e, name) for name in where)]
    return sorted(key.removeprefix(f"{section}.") for key in found if key.startswith(f"{section}."))


#: Drawn together with others by `scene_of`, or parts of a structure: they decide what is compiled.
STRUCTURAL = {
    "title", "project", "author", "revision",
    "cable.top.kind", "cable.top.position", "cable.position_degree", "cable.tension_degree", "cable.strain",
    "cable.strain_form", "cable.slack", "cable.tangential_froude_krylov", "buoy.hull", "buoy.inertia",
    "buoy.point_masses", "buoy.point_masses.mass", "buoy.point_masses.height", "waves.stretching", "current.profile",
    "waves.period_seen_from", "waves.spectrum", "waves.spectrum.frequency", "waves.spectrum.direction_deg",
    "waves.spectrum.density", "waves.components", "waves.band", "waves.seed", "waves.amplitudes", "waves.kinematics",
    "waves.elevation", "waves.theory", "waves.order", "waves.crest", "waves.crest_time", "waves.crest_position",
    "waves.crest_sea",
    "buoy.memory_order",
    "initial.kind", "initial.points", "time.end", "seabed.start",
    "seabed.depths.x", "seabed.depths.y", "seabed.depths.depth", "cable.marine_growth", "sea.dry_above",
}  # fmt: skip
#: Not drawn: they serve the user's accuracy and output, not the physics.
LEFT_ALONE = {
    "time.min_step", "time.max_step", "time.output_every", "cable.breaking_load", "solver.petsc", "library",
    "cable.minimum_bend_radius",
    "solver.step_tolerance", "solver.keep_jacobian",
    "solver.quadrature_degree", "solver.hull_quadrature_degree",
    "accuracy.estimate", "accuracy.target", "accuracy.of", "accuracy.rounds", "uncertain",
    "design.vary", "design.least", "design.hold", "design.case",
    "criteria.safety", "criteria.safety_factor", "criteria.condition", "criteria.consequence_class",
    "criteria.largest_offset", "criteria.largest_lean_deg", "criteria.least_freeboard", "criteria.no_uplift",
    "criteria.largest_anchor_force", "criteria.limits",
    "anchor.at", "anchor.weight", "anchor.friction", "anchor.holding_capacity", "anchor.drags", "anchor.density",
    "fatigue.curve", "fatigue.connectors", "fatigue.places", "fatigue.spacing", "fatigue.corrosion",
    "fatigue.corrosion_rate",
    "fatigue.safety_factor", "cable.fatigue_curve", "cable.steel_area",
}  # fmt: skip
#: Of networks, and of what happens at given times: hard cases and tests of their own have these.
OF_NETWORKS = re.compile(
    r"joint\.|vessel\.|take_off\.|material\.|cable\.(name|from|to|from_end|to_end|material|segments|fails_at|winch)\b|cable\.top\.(motion|velocity)"
    r"|buoy\.(name|fairleads|wind|external_force|initial|potential_flow|drift)\b"
    r"|(current|wind|external_force)\.over_time|current\.grid|sea\.tide|wind\.(gusts|turbulence|seed|ramp)\b"
)


def unknown_keys():
    """Keys of the model that no random scene would ever vary."""
    keys = {key.name for key in list_keys() if not OF_NETWORKS.match(key.name)}
    return keys - set(ranges()) - STRUCTURAL - LEFT_ALONE


# -- structures --------------------------------------------------------------------------------------------------------

SEA = {"depth": ANY, "density": ANY}
TIME = {"step": ANY, "scheme": ANY, "spectral_radius": ANY, "tolerance": ANY}
BARE = {"length": ANY, "line_density": ANY, "elements": ANY, "grading": ANY}
WET = BARE | {"diameter": ANY}
LOADED = WET | dict.fromkeys(coefficients("cable", "line"), ANY)
ELASTIC = {"axial_stiffness": ANY}
P2P1 = {"position_degree": 2, "tension_degree": 1}
FIXED, FREE = {"top": {"kind": "fixed"}}, {"top": {"kind": "free", "force": ANY}}
MOVED = {"top": {"kind": "prescribed", "amplitude": ANY, "period": ANY, "phase_deg": ANY, "ramp": ANY}}
WAVES = dict.fromkeys(("amplitude", "period", "direction_deg", "phase_deg", "ramp"), ANY)
IRREGULAR = {"spectrum": "jonswap", "components": 30, "amplitudes": "random"}
IRREGULAR |= dict.fromkeys(("significant_height", "peak_period", "gamma", "spreading", "direction_deg", "ramp"), ANY)
CURRENT = {"speed": ANY, "direction_deg": ANY}
BED = dict.fromkeys(("friction", "stiffness", "damping_ratio", "stick_length", "slope"), ANY)
WIND = dict.fromkeys(("speed_10m", "direction_deg", "drag_coefficient", "area", "height", "air_density"), ANY)
BODY = {"mass": ANY, "mooring_height": ANY}
LOADED_BODY = (
    BODY
    | {"wave_damping": ANY, "disk_averages": ANY}
    | dict.fromkeys(coefficients("buoy", "strip", "face", "body"), ANY)
)
PUSHED = {"kind": "equilibrium", "buoy_velocity": ANY, "buoy_angular_velocity": ANY}
POSED = PUSHED | {"buoy_position": ANY, "buoy_orientation": ANY}

STRUCTURES = {
    "inextensible in air": {"cable": BARE | FIXED},
    "elastic in air": {"cable": BARE | ELASTIC | P2P1 | FIXED},
    "energy form": {
        "cable": BARE | ELASTIC | {"position_degree": 3, "tension_degree": 1, "strain_form": "energy"} | FIXED
    },
    "tension-only": {"sea": SEA, "cable": LOADED | ELASTIC | {"slack": "tension-only"} | FIXED},
    "on a bed": {"sea": SEA, "cable": LOADED | ELASTIC | {"area": ANY} | MOVED, "seabed": BED},
    "rope on a bed": {
        "sea": SEA, "cable": LOADED | ELASTIC | {"slack": "tension-only"} | FIXED, "seabed": BED | {"start": "pulled"},
    },
    "moored on a bed": {"sea": SEA, "cable": LOADED | ELASTIC, "buoy": BODY, "waves": WAVES, "seabed": BED},
    "rope released": {"cable": BARE | {"slack": "tension-only"} | FREE, "initial": {"kind": "polyline"}},
    "damped": {"cable": BARE | ELASTIC | {"damping": ANY} | MOVED},
    "hanging free": {"cable": BARE | FREE | {"anchor": ANY}},
    "released": {"cable": BARE | P2P1 | FREE, "initial": {"kind": "polyline"}},
    "elastic, straight": {"cable": BARE | ELASTIC | FIXED, "initial": {"kind": "straight"}},
    "top moved in water": {"sea": SEA, "cable": LOADED | ELASTIC | MOVED},
    "grown": {"sea": SEA, "cable": LOADED | ELASTIC | MOVED | {"marine_growth": [[-50.0, 1.0, 1.0], [-1.0, 3.0, 2.0]]}},
    "inextensible, top moved": {"sea": SEA, "cable": LOADED | P2P1 | MOVED},
    "stiff line in waves": {
        "sea": SEA, "cable": LOADED | ELASTIC | P2P1 | FIXED | {"bending_stiffness": ANY, "bending_damping": ANY},
        "waves": WAVES,
        "current": CURRENT, "time": TIME,
    },
    "waves and current": {
        "sea": SEA, "cable": LOADED | ELASTIC | FIXED, "waves": WAVES, "current": CURRENT,
    },
    "power law": {
        "sea": SEA, "cable": LOADED | P2P1 | FIXED, "current": CURRENT | {"profile": "power", "exponent": ANY},
    },
    "current table": {
        "sea": SEA, "cable": WET | ELASTIC | {"normal_drag": ANY} | FREE,
        "current": {"direction_deg": ANY, "profile": [[-100.0, 0.2], [-20.0, 1.5], [0.0, 1.0]]},
    },
    "averaged strain": {"sea": SEA, "cable": WET | ELASTIC | P2P1 | {"strain": "element-average"} | FIXED},
    "free buoy in waves": {
        "sea": SEA, "buoy": LOADED_BODY, "waves": WAVES | {"wavelength": ANY, "stretching": "vertical"},
        "wind": WIND, "initial": PUSHED,
    },
    "free buoy in a storm": {
        "sea": SEA, "buoy": LOADED_BODY, "waves": IRREGULAR | {"kinematics": "exact"}, "wind": WIND, "initial": PUSHED,
    },
    "moored in a storm": {
        "gravity": 9.81, "sea": SEA, "cable": LOADED | ELASTIC, "buoy": LOADED_BODY, "waves": IRREGULAR,
    },
    "cable in a storm": {
        "sea": SEA, "cable": LOADED | ELASTIC | FIXED, "waves": IRREGULAR | {"period_seen_from": "water"},
        "current": CURRENT,
    },
    "free body": {"buoy": {"mass": ANY}, "initial": POSED},
    "moored, everything": {
        "sea": SEA, "cable": LOADED | ELASTIC, "buoy": LOADED_BODY, "waves": WAVES, "current": CURRENT, "wind": WIND,
        "external_force": {"force": ANY, "height": ANY},
    },
    "moored, inextensible": {"sea": SEA, "cable": WET, "buoy": BODY, "external_force": {"force": ANY}},
    "moored, posed": {"sea": SEA, "cable": WET | ELASTIC, "buoy": BODY, "initial": POSED},
    "hung": {"cable": BARE, "buoy": BODY, "initial": PUSHED},
}  # fmt: skip


PAIRS = ((1, 0), (2, 0), (2, 1), (3, 0), (3, 2), (4, 1), (4, 3))


@st.composite
def free_structures(draw):
    """A structure put together at random."""
    flag = st.booleans()
    wet, body, rope = draw(flag), draw(flag), draw(flag)
    structure = {"sea": SEA} if wet else {}
    if rope or not body:
        mu, nu = draw(st.sampled_from(PAIRS))
        cable = (LOADED if wet else BARE) | {"position_degree": mu, "tension_degree": nu}
        cable |= (
            ELASTIC | draw(st.sampled_from([{}, {"damping": ANY}, {"strain": "element-average"}])) if draw(flag) else {}
        )
        cable["slack"] = draw(st.sampled_from(["compressive", "compressive", "tension-only"]))
        cable["strain_form"] = draw(st.sampled_from(["paper", "energy"]))
        structure["cable"] = cable if body else cable | draw(st.sampled_from([FIXED, FREE, MOVED]))
    if body:
        structure["buoy"] = LOADED_BODY if draw(flag) else BODY
        structure |= {"wind": WIND} if draw(flag) else {}
        structure |= {"external_force": {"force": ANY, "height": ANY}} if draw(flag) else {}
        structure["initial"] = PUSHED if draw(flag) else {"kind": "equilibrium"}
    if wet and draw(flag):
        regular = WAVES | {"stretching": draw(st.sampled_from(["wheeler", "vertical", "none"]))}
        structure["waves"] = draw(st.sampled_from([regular, regular, IRREGULAR]))
    if wet and draw(flag):
        structure["current"] = CURRENT | draw(st.sampled_from([{}, {"profile": "power", "exponent": ANY}]))
    return structure


@st.composite
def scenes(draw, structure=None):
    """A scene as dict; structure: a value of STRUCTURES."""
    if structure is None:
        structure = STRUCTURES[draw(st.sampled_from(sorted(STRUCTURES)))]
    scene = _drawn(draw, {"time": TIME, "gravity": ANY} | structure, "")
    if "buoy" in scene:
        _shape_buoy(draw, scene)
    if {"buoy", "cable", "sea"} <= scene.keys():
        _balance(draw, scene)
    if "cable" in scene:
        _place_cable(draw, scene)
    if scene["time"]["scheme"] != "generalized-alpha":
        scene["time"].pop("spectral_radius", None)
    steps = draw(st.integers(0, 4))
    scene["time"]["end"] = steps * scene["time"]["step"]
    return scene


def _drawn(draw, structure, prefix):
    result = {}
    for key, value in structure.items():
        if isinstance(value, dict):
            result[key] = _drawn(draw, value, f"{prefix}{key}.")
        else:
            drawn = draw(ranges()[prefix + key]) if value is ANY else value
            if drawn is not None:
                result[key] = drawn
    return result


def _shape_buoy(draw, scene):
    """A hull of two to four stations, masses from light to too heavy, with and without masses above it."""
    buoy = scene["buoy"]
    if "sea" in scene or draw(st.booleans()):
        height, diameter = draw(size(0.1, 30)), draw(size(0.1, 20))
        inner = sorted(draw(st.lists(st.floats(0, 1), max_size=2)))
        heights = [0.0, *(height * z for z in inner), height]
        buoy["hull"] = [[z, diameter * draw(st.one_of(st.just(1.0), st.floats(0.05, 1)))] for z in heights]
        volume = math.pi * diameter**2 / 4 * height
        displaced = volume * scene.get("sea", {"density": 1000.0})["density"]
        buoy["mass"] = displaced * draw(st.one_of(st.floats(0.05, 0.6), size(1e-3, 2)))
        buoy["center_of_mass"] = height * draw(st.floats(-0.5, 1.5))
        buoy["mooring_height"] = height * draw(st.floats(-0.5, 1.5))
        buoy["point_masses"] = [
            {"mass": buoy["mass"] * draw(size(1e-2, 0.5)), "height": height * draw(st.floats(-1, 3))}
            for _ in range(draw(st.integers(0, 2)))
        ]
    else:
        buoy["center_of_mass"] = draw(OWN["buoy.center_of_mass"])
        inertia = [buoy["mass"] * draw(size(1e-4, 1e4)) for _ in range(draw(st.sampled_from([2, 3])))]
        buoy["inertia"] = possible(inertia)


def possible(inertia):
    """The moments of inertia with the largest at most the sum of the others, as it is of every body."""
    if len(inertia) == 2:
        return [inertia[0], min(inertia[1], 2 * inertia[0])]
    largest = int(np.argmax(inertia))
    others = sum(value for i, value in enumerate(inertia) if i != largest)
    return [min(value, others) if i == largest else value for i, value in enumerate(inertia)]


def _balance(draw, scene):
    """Mostly a cable that the buoy can carry and that reaches from the bed to about the water."""
    if draw(st.integers(0, 3)):
        cable, buoy = scene["cable"], scene["buoy"]
        cable["length"] = scene["sea"]["depth"] * draw(st.floats(0.7, 1.5))
        cable["line_density"] = buoy["mass"] / cable["length"] * draw(size(1e-3, 0.3))
        displaced = cable["line_density"] / scene["sea"]["density"] * draw(st.floats(0.05, 0.95))
        cable["diameter"] = math.sqrt(4 * displaced / math.pi)


def _place_cable(draw, scene):
    """Ends of the cable: nearer than its length, at its length, farther; above, below, beside."""
    cable = scene["cable"]
    anchor = np.array(cable.get("anchor", [0.0, 0.0, -scene["sea"]["depth"] if "sea" in scene else 0.0]))
    reach = draw(st.one_of(st.floats(0.001, 0.999), st.sampled_from([0.5, 1.0]), st.floats(0.9, 1.5)))
    initial = scene.get("initial", {})
    if initial.get("kind") == "polyline":
        initial["points"] = _polyline(draw, anchor, cable["length"])
    if "top" in cable and cable["top"]["kind"] != "free":
        cable["top"]["position"] = (anchor + reach * np.array(draw(vector(1, 1))) * cable["length"]).tolist()
    if "amplitude" in cable.get("top", {}) and draw(st.integers(0, 3)):  # mostly a motion within the cable's reach
        amplitude = cable["length"] * abs(1 - reach) * np.array(draw(vector(1e-6, 1)))
        cable["top"]["amplitude"] = amplitude.tolist()
    if "buoy_position" in initial and "buoy" in scene and "sea" in scene:
        initial["buoy_position"] = (anchor + reach * np.array(draw(vector(1, 1))) * cable["length"]).tolist()


def _polyline(draw, anchor, length):
    """A line of up to three straight pieces with the given length."""
    pieces = draw(st.lists(vector(1, 1), min_size=1, max_size=3))
    shares = np.array([draw(st.floats(0.1, 1)) for _ in pieces])
    steps = (shares / shares.sum() * length)[:, None] * np.array(pieces)
    return [anchor.tolist(), *(anchor + np.cumsum(steps, axis=0)).tolist()]
