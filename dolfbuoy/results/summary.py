"""What matters of a run, in a few lines."""

import math

import numpy as np

from ..meshes import number_of_cells
from ..model.material import weight_per_length
from ..model.sea import crest_height
from ..motion.schemes import make_scheme
from ..scene.network import is_network, network_of, single
from .parts import parts_of
from .tables import force_unit, unit_of
from .utilisation import rows_of, warnings_of


def summary(record, scene) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of a record: extremes, effort, and what the scheme's damping leaves."""
    rows, ends = [], _ends(scene)
    for name, part, _ in parts_of(record, scene):
        found = [*_extremes(part, *ends.get(name, ENDS)), *rows_of(part), *_grown(part)]
        rows += [(f"{name}: {what}" if name else what, value, unit) for what, value, unit in found]
    for name in network_of(scene).bodies:
        place = record.joint_position.sel(joint=name)
        rows += [_range(f"{name}: {axis} of the body", place.sel(xyz=axis), "m") for axis in "xyz"]
    if "parted" in record.attrs:
        rows.append(("parted", record.attrs["parted"], ""))
    steps = record.sizes["time"] - 1
    rows.append(("steps, of which retried", f"{steps}, {record.attrs['failed_steps']}", ""))
    if steps:
        rows.append(("Newton iterations per step", f"{float(record.newton_iterations[1:].mean()):.2f}", ""))
    wall = record.attrs["wall_time_s"]
    rows.append(("wall time", f"{wall:.1f}", "s"))
    rows.append(("speed", f"{float(record.time[-1]) / max(wall, 1e-9):.1f}", "x real time"))
    if scene.waves:
        rest = 100 * remaining_amplitude(scene.waves.main_period, scene)
        rows.append((f"left by the scheme of a free {scene.waves.main_period:g} s motion", f"{rest:.1f}", "%"))
    return rows


#: What the ends of a cable are called that is alone.
ENDS = "the anchor", "the top"


def _ends(scene):
    """Of each cable of a network what its ends are called."""
    network = network_of(scene)
    return {name: network.ends_of(k) for k, name in enumerate(network.cables)} if is_network(scene) else {}


def _grown(record):
    """What marine growth adds to a cable."""
    if "growth_weight" not in record:
        return []
    weight, largest = float(record.growth_weight.sum()), (record.growth_diameter.max(), record.growth_mass.max())
    if max(largest) == 1:
        return []
    unit, factor = force_unit(weight)
    return [
        ("marine growth adds in water", f"{factor * weight:.4g}", unit),
        ("its largest factors of diameter and mass", ", ".join(f"{float(x):.4g}" for x in largest), ""),
    ]


def static_rows(record, scene) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of an equilibrium: all numbers and vectors; of a network by cable, buoy and joint."""
    rows, ends = [], _ends(scene)
    for name, part, _ in parts_of(record, scene):
        if name:  # of the whole network
            part = part.drop_vars("newton_iterations")
        for variable in part.data_vars.values():
            if variable.name != "utilisation" and (variable.ndim == 0 or variable.dims == ("xyz",)):
                what = _at_ends(variable, *ends[name]) if name in ends else variable.attrs["long_name"]
                rows.append(_static_row(f"{name}: {what}" if name else what, variable.values, variable.attrs["units"]))
        found = [*rows_of(part), *_grown(part)]
        rows += [(f"{name}: {what}" if name else what, value, unit) for what, value, unit in found]
    for joint in record.get("joint", ()):
        position = record.joint_position.sel(joint=joint)
        rows.append(_static_row(f"{joint.item()}: position of the joint", position.values, "m"))
    return rows


def _at_ends(variable, low, high):
    """What a quantity of a cable in a network is, with the names of the ends."""
    of_ends = {
        "tension_top": f"tension at {high}, |T_bnd|",
        "tension_anchor": f"tension at {low}, T_h(0)",
        "anchor_force": f"force that holds it at {low}",
        "end_tension": f"force that holds it at {high}, T_bnd",
    }
    return of_ends.get(variable.name, variable.attrs["long_name"])


def _static_row(what, values, unit):
    unit, factor = unit_of(values, unit)
    return what, " ".join(f"{factor * v:.6g}" for v in values.ravel()), unit


def _range(name, values, unit, scale=1.0):
    """Row of `summary` of least and largest values."""
    return name, f"{float(np.min(values)) * scale:.4g} ... {float(np.max(values)) * scale:.4g}", unit


def _extremes(record, low, high):
    """Rows of `summary` of one cable, one buoy, or both of a scene that is no network; low, high: what the ends s = 0
    and s = L are called."""
    rows = []

    def extremes(*row):
        rows.append(_range(*row))

    if "tension_top" in record:
        extremes(f"tension at {high} |T_bnd|", record.tension_top, *force_unit(record.tension_top))
    if "anchor_force" in record:
        force, uplift = np.linalg.norm(record.anchor_force, axis=-1), -record.anchor_force.sel(xyz="z")
        extremes(f"force at {low}", force, *force_unit(force))
        extremes(f"uplift at {low}", uplift, *force_unit(force))
    if "length_on_bed" in record:
        extremes("length on the sea bed", record.length_on_bed, "m")
        if np.isfinite(record.touchdown).any():
            extremes("x of the touchdown", record.touchdown.sel(xyz="x").dropna("time"), "m")
    if "buoy_position" in record:
        for axis in "xyz":
            extremes(f"{axis} of C", record.buoy_position.sel(xyz=axis), "m")
        if "surface_elevation" in record:
            extremes("z of C over the water", record.buoy_position.sel(xyz="z") - record.surface_elevation, "m")
        extremes("cone angle", record.cone_angle, "deg")
    return rows


def remaining_amplitude(period, scene) -> float:
    """Fraction of a free motion's amplitude that the scheme leaves at the end of the run, at the scene's step.

    Backward Euler multiplies the amplitude of x_tt = -omega^2 x by (1 + (omega dt)^2)^(-1/2) in each step.
    """
    time = scene.time
    factor = make_scheme(time.scheme, time.spectral_radius).amplification(2 * math.pi / period, time.step)
    return float(abs(factor) ** (time.end / time.step))


#: Elements of a cable up to which two ranks were slower than one (`tests/benchmarks/scaling.py strong`).
SHARING_SLOWER_TO = 1_000_000


def sharing_note(scene, ranks: int) -> str | None:
    """A sentence if one rank would run this scene faster than so many; None if not."""
    cells = sum(number_of_cells(piece.section.elements) for piece in network_of(scene).pieces)
    if ranks == 1 or cells > SHARING_SLOWER_TO:
        return None
    return (
        f"Note: one rank runs this scene faster than {ranks}: up to {SHARING_SLOWER_TO:,} elements sharing a cable "
        f"does not pay, and here are {cells:,}. Ranks do pay in sweep and study, which spread their cases."
    )


def warnings(record, scene) -> list[str]:
    """Sentences about where a run left the range of its model."""
    if is_network(scene):
        return _of_parts(warnings, record, scene) + _out_of_water(record, scene)
    found = []
    if "cable_tension" in record:
        found += _compressed(record, scene) + _unresolved_fold(record, scene)
        lowest = float(record.cable_position.sel(xyz="z").min())
        if scene.sea and not scene.seabed and lowest < -scene.sea.depth - 1e-6 * single(scene).cable.length:
            depth = -scene.sea.depth - lowest
            found.append(f"The cable dipped up to {depth:.3g} m below the sea bed: there is no [seabed] to carry it.")
        found += _rising(record, scene) + warnings_of(record, single(scene).cable.fails_at is not None)
    if "parted" in record.attrs:
        found.append(f"Parted: {record.attrs['parted']}.")
    if record.attrs.get("failed_steps"):
        found.append(f"{record.attrs['failed_steps']} steps failed and were retried with smaller ones.")
    return found


def static_warnings(record, scene) -> list[str]:
    """Sentences about the faults of an equilibrium: compressed or slack elements, an unresolved fold, the sea bed."""
    if is_network(scene):
        return _of_parts(static_warnings, record, scene) + _out_of_water(record, scene)
    if "cable_tension" not in record:
        return []
    found = warnings(record.expand_dims("frame"), scene)
    slack = record.cable_tension.values <= 1e-12 * np.abs(record.cable_tension.values).max()
    if single(scene).cable.slack == "tension-only" and slack.any():
        found.append(
            f"Slack (T = 0) in equilibrium: {_places(record, slack)}; the fold there is shorter than an element, whose "
            "shape is not that of the cable."
        )
    return found


def _of_parts(say, record, scene):
    """Sentences about each cable of a network, by its name; what is said of the whole run is said once."""
    found = []
    for name, part, alone in parts_of(record, scene):
        found += [f"{name}: {sentence}" if "cable" in sentence.lower() else sentence for sentence in say(part, alone)]
    return list(dict.fromkeys(found))


def _rising(record, scene):
    """A line lighter than water that rises out of it by a hundredth of its length: its buoyancy knows no surface."""
    if scene.sea is None or weight_per_length(scene, single(scene).cable) >= 0:
        return []
    highest = float(record.cable_position.sel(xyz="z").max()) - crest_height(scene)
    if highest <= 0.01 * single(scene).cable.length:
        return []
    return [
        f"The cable is lighter than water and rose up to {highest:.3g} m above it, which its buoyancy does not know of."
    ]


def _out_of_water(record, scene):
    """Floats that rise above the highest crest: their buoyancy does not know of the surface."""
    found = []
    for name, body in network_of(scene).bodies.items() if scene.sea else ():
        highest = float(record.joint_position.sel(joint=name, xyz="z").max()) - crest_height(scene)
        if highest > 0 and body.mass < scene.sea.density * body.volume:
            found.append(
                f"{name}: The float rose up to {highest:.3g} m above the water, which a body at a joint does not know "
                "of: what floats at the surface is a [[buoy]]."
            )
    return found


def _compressed(record, scene):
    """What was pushed, where and how much; rounding is not counted."""
    tension = np.atleast_2d(record.cable_tension.values)
    smallest = min(float(tension.min()), float(record.tension_anchor.min()))
    largest = max(float(np.abs(tension).max()), float(record.tension_top.max()))
    if smallest >= -1e-6 * largest:
        return []
    pressed = (tension < -1e-6 * largest).any(axis=0)
    where = _places(record, pressed) if pressed.any() else "the element at the anchor"
    when = "was compressed at times" if "time" in record.dims else "is compressed in this equilibrium"
    return [
        f"The cable {when} (smallest tension {smallest:.4g} N; {where}): a rope would go slack, see cable.slack = "
        "'tension-only'."
    ]


def _unresolved_fold(record, scene, corner=90.0, short=0.5):
    """Where neighbouring elements turn by more than `corner` degrees, or the ends of an element are nearer than `short`
    times its length: the fold of the cable is smaller than the elements."""
    degree = single(scene).cable.position_degree
    ends = record.cable_position.values[..., ::degree, :]
    chords = np.diff(ends, axis=-2)
    lengths = np.linalg.norm(chords, axis=-1)
    sizes = np.diff(record.s.values.ravel()[::degree])
    dots = (chords[..., 1:, :] * chords[..., :-1, :]).sum(axis=-1)
    turned = dots < np.cos(np.radians(corner)) * lengths[..., 1:] * lengths[..., :-1]
    bad = lengths < short * sizes
    bad[..., 1:] |= turned
    bad[..., :-1] |= turned
    if not bad.any():
        return []
    times = f" in {bad.any(axis=-1).sum()} of {len(bad)} frames" if "time" in record.dims else ""
    return [f"A fold of the cable is not resolved{times}: {_places(record, bad.any(axis=0))}; use smaller ones there."]


def _places(record, chosen):
    """`elements 1 to 3 (s = 0 ... 0.3 m)` of a mask over the elements."""
    numbers = np.flatnonzero(chosen)
    s = record.s.values.ravel()[:: (record.sizes["node"] - 1) // len(chosen)]
    first, last = numbers[0], numbers[-1]
    named = f"element {first + 1}" if first == last else f"elements {first + 1} to {last + 1}"
    if len(numbers) <= last - first:
        named = f"{len(numbers)} of the {named}"
    return f"{named} (s = {s[first]:.4g} ... {s[last + 1]:.4g} m)"
