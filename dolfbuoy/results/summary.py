"""Table printed after a run or an equilibrium, and the warnings below it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..meshes import number_of_cells
from ..model.effects import called_by
from ..model.sea import highest_water
from ..motion.schemes import make_scheme
from ..scene.settings import period_of, ramp_of
from . import bars, cautions
from .after_ramp import AFTER
from .cautions import states_of
from .criteria import never_met, verdicts
from .parts import names_of, parts_of
from .quantities import QUANTITIES, over
from .running import maximum, minimum, never_parted, rows_of, warnings_of
from .sample import lives_of
from .series import LASTING, Series, mean_over_time, spoken
from .tables import NOTHING, force_unit, newtons, plain, unit_of, years

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene
    from ..scene.cable import Cable
    from ..scene.network import Network
    from .parts import Part


def summary(record: xr.Dataset, scene: Scene) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of a record: extremes, effort, and amplitude left by the scheme's damping."""
    network, lines = scene.network, parts_of(record, "cable")
    rows = [row for k, part in enumerate(lines) for row in _named(part, _of_line(part.record, *_ends(network, k)))]
    for part in parts_of(record, "anchor"):
        rows += _named(part, _declared(part.record, "anchor"))
    for part in parts_of(record, "take_off"):
        rows += _named(part, [*_declared(part.record, "take_off"), _mean_power(part.record, scene)])
    for kind in ("winch", "vessel"):
        for part in parts_of(record, kind):
            rows += _named(part, _declared(part.record, kind))
    for part in parts_of(record, "buoy"):
        z = part.record.buoy_position.sel(xyz="z")
        places = [_range(f"{axis} of C", part.record.buoy_position.sel(xyz=axis), "m") for axis in "xyz"]
        if "surface_elevation" in record:
            places.append(_range("z of C over the water", z - part.record.surface_elevation, "m"))
        if "lean_at_start" in part.record:
            places.append((QUANTITIES["lean_at_start"].summary, plain(float(part.record.lean_at_start)), "deg"))
        rows += _named(part, [*places, *_declared(part.record, "buoy")])
    rows += _strength(lines)
    for name in network.bodies:
        place = record.joint_position.sel(joint=name)
        rows += [_range(f"{name}: {axis} of the body", place.sel(xyz=axis), "m") for axis in "xyz"]
    if "parted" in record.attrs:
        rows.append(("parted", record.attrs["parted"], ""))
    rows += life_rows(record, scene)
    rows += bars.summary_rows(record)
    steps = record.sizes["time"] - 1
    rows.append(("steps, of which retried", f"{steps}, {record.attrs['failed_steps']}", ""))
    if scene.time and scene.time.tolerance is None and (smaller := record.attrs.get("rejected_steps", 0)):
        rows.append(("steps made smaller where a line came taut", str(smaller), ""))
    if steps:
        rows.append(("Newton iterations per step", f"{float(record.newton_iterations[1:].mean()):.2f}", ""))
    wall = record.attrs["wall_time_s"]
    rows.append(("wall time", f"{wall:.1f}", "s"))
    rows.append(("speed", f"{float(record.time[-1]) / max(wall, 1e-9):.1f}", "x real time"))
    if scene.waves:
        rest = 100 * remaining_amplitude(scene.waves.main_period, scene)
        rows.append((f"left by the scheme of a free {scene.waves.main_period:g} s motion", f"{rest:.1f}", "%"))
    return rows


#: Number of lives shown in the table of a run, shortest first.
MOST_LIVES = 12


def life_rows(record: xr.Dataset, scene: Scene) -> list[tuple[str, str, str]]:
    """Rows of the shortest fatigue lives, if the run went on as after its ramp, also over their safety factor."""
    found, factor, duration = lives_of(record, scene)
    over = f", over safety factor {factor:g}" if factor > 1 else ""
    return [
        (
            f"life of {spoken(label)}, from {duration:.4g} s{over}",
            f"{years(life)}{f', {years(life / factor)}' if over else ''}",
            "years",
        )
        for label, life in sorted(found.items(), key=lambda one: one[1])[:MOST_LIVES]
    ]


def _named(part: Part, rows: Iterable[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """Rows of a part, with its name if there are several."""
    return [(part.named([name])[0], value, unit) for name, value, unit in rows]


def _mean_power(record: xr.Dataset, scene: Scene) -> tuple[str, str, str]:
    """Row of the mean absorbed power after the ramp, over whole periods of a regular wave if there are any."""
    times, power = record.time.values, record.absorbed_power.values
    begin, period = ramp_of(scene), period_of(scene)
    if period and (whole := math.floor((times[-1] - begin) / period + 1 - AFTER)):
        begin = times[-1] - whole * period
    late = times >= begin * AFTER
    mean = float(mean_over_time(times[late], power[late])) if late.any() else math.nan
    unit, factor = unit_of(mean, "W")
    return "mean of the absorbed power", f"{factor * mean:.4g}", unit


def _strength(lines: list[Part]) -> list[tuple[str, str, str]]:
    """Rows of the utilisation and marine growth of each line."""
    return [row for part in lines for row in _named(part, [*rows_of(part.record), *_grown(part.record)])]


def _ends(network: Network, cable: int) -> tuple[str, str]:
    """Names of the ends of a cable, by what they are attached to; "the top" for the only cable, if on a buoy."""
    low, high = network.ends_of(cable)
    return low, "the top" if len(network.cables) == 1 and high in network.buoys else high


def _grown(record: xr.Dataset) -> list[tuple[str, str, str]]:
    """Rows of the weight, diameter and mass that marine growth adds to a cable."""
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


#: Dimensions of the quantities of an equilibrium that are shown, in the order of the table; "": of the whole.
_OF = ("cable", "anchor", "buoy", "take_off", "winch", "vessel", "attachment", "")


def static_rows(record: xr.Dataset, scene: Scene) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of an equilibrium: all numbers and vectors, part by part if there are several."""
    network, found = scene.network, []
    for key, variable in record.data_vars.items():
        of = "".join(str(d) for d in variable.dims if d != "xyz")
        names = names_of(record, of)
        if of not in _OF or (of == "attachment" and len(names) > 1):  # ends of lines, shown already
            continue
        for k, name in enumerate(names or [""]):
            what = QUANTITIES[str(key)].at_ends if of == "cable" and len(names) > 1 else ""
            if what:
                what = what.format(**dict(zip(("low", "high"), network.ends_of(k), strict=True)))
            what = what or variable.attrs["long_name"]
            label = f"{name}: " if len(names) > 1 else ""
            row = _static_row(label + what, variable.values[k] if names else variable.values, variable.attrs["units"])
            found.append(((_OF.index(of), k), row))
    if any(len(names_of(record, of)) > 1 for of in _OF):
        found.sort(key=lambda pair: pair[0])
    rows = [row for _, row in found] + _strength(parts_of(record, "cable"))
    for joint in names_of(record, "joint"):
        position = record.joint_position.sel(joint=joint)
        rows.append(_static_row(f"{joint}: position of the joint", position.values, "m"))
    return rows


def _static_row(what: str, values: NDArray[Any], unit: str) -> tuple[str, str, str]:
    unit, factor = unit_of(values, unit)
    shown = np.where(np.abs(values) < NOTHING, 0.0, factor * values)
    return what, " ".join(f"{v:.6g}" for v in shown.ravel()), unit


def _range(name: str, values: ArrayLike, unit: str, scale: float = 1.0) -> tuple[str, str, str]:
    """Row of `summary` of least and largest values."""
    return name, f"{plain(float(np.min(values)) * scale)} ... {plain(float(np.max(values)) * scale)}", unit


_OF_BENDING = "anchor_moment", "end_moment", "touchdown_moment", "min_bend_radius", "bend_utilisation"


def _of_line(record: xr.Dataset, low: str, high: str) -> list[tuple[str, str, str]]:
    """Rows of `summary` of a cable; low, high: names of the ends s = 0 and s = L."""
    force = np.linalg.norm(record.anchor_force, axis=-1)
    rows = [
        _range(f"tension at {high}", record.tension_top, *force_unit(record.tension_top)),
        _range(f"force at {low}", force, *force_unit(force)),
    ]
    least, largest = minimum(record, "cable_tension").min(), maximum(record, "cable_tension")
    least = 0.0 if -ROUNDING * largest.max() < least < 0 else least
    rows.append(_range("tension of its elements", [least, largest.max()], *force_unit([least, largest.max()])))
    for row, values in ((1, force), (0, record.tension_top.values)):  # each below its range row
        rows[row + 1 : row + 1] = exceeded(record, values)
    rows.append(("s of the largest", f"{float(record.s_cell[largest.argmax()]):.4g}", "m"))
    if "largest_curvature" in record and not record.largest_curvature.any():  # this one does not bend, others do
        record = record.drop_vars(_OF_BENDING, errors="ignore")
    return rows + _declared(record, "cable")


def exceeded(record: xr.Dataset, force: NDArray[Any]) -> list[tuple[str, str, str]]:
    """Row of the level that a force over time [N] exceeds for LASTING seconds; empty for a shorter run."""
    if math.isnan(level := Series("", record.time.values, force).lasting_maximum):
        return []
    unit, factor = force_unit(force)
    return [(f"exceeded there for {LASTING:g} s", f"{factor * level:.4g}", unit)]


def _declared(record: xr.Dataset, kind: str) -> list[tuple[str, str, str]]:
    """Ranges of the quantities of a part that are declared with a `summary`."""
    rows = []
    for quantity in over("time").values():
        if not quantity.summary or quantity.kind != kind or quantity.name not in record:
            continue
        values = record[quantity.name]
        if "xyz" in values.dims:
            values = values.sel(xyz=quantity.component) if quantity.component else np.sqrt((values**2).sum("xyz"))
        values = values.dropna("time")
        if values.size:
            unit = {"1": ""}.get(quantity.unit, quantity.unit).replace("degree", "deg")
            rows.append(_range(quantity.summary, values, *unit_of(values, unit)))
    return rows


def remaining_amplitude(period: float, scene: Scene) -> float:
    """Fraction of a free motion's amplitude left by the scheme at the end of the run, at the scene's step.

    Backward Euler multiplies the amplitude of x_tt = -omega^2 x by (1 + (omega dt)^2)^(-1/2) in each step.
    """
    time: Any = scene.time
    factor = make_scheme(time.scheme, time.spectral_radius).amplification(2 * math.pi / period, time.step)
    return float(abs(factor) ** (time.end / time.step))


#: Fraction of the largest tension below which a negative one counts as rounding error in a slack element.
ROUNDING = 1e-6

#: Number of elements up to which two ranks were slower than one (`tests/benchmarks/scaling.py strong`).
SHARING_SLOWER_TO = 1_000


def sharing_note(scene: Scene, ranks: int) -> str | None:
    """A sentence if one rank would run this scene faster than `ranks`, else None."""
    cells = sum(number_of_cells(piece.section.elements) for piece in scene.network.pieces)
    if ranks == 1 or cells > SHARING_SLOWER_TO:
        return None
    return (
        f"Note: one rank runs this scene faster than {ranks}: up to {SHARING_SLOWER_TO:,} elements sharing a cable "
        f"does not pay, and here are {cells:,}. Ranks do pay in sweep and study, which spread their cases."
    )


def warnings(record: xr.Dataset, scene: Scene) -> list[str]:
    """Warnings where a run left the validity range of its model."""
    found = _of_lines(_left, record, scene) + _of_lines(_snaps, record, scene)
    found += _surfaced_bodies(record, scene) + states_of(record, scene) + never_parted(scene)
    if "parted" in record.attrs:
        found.append(f"Parted: {record.attrs['parted']}.")
    found += _moved_anchors(record, scene)
    found += never_met(verdicts(record, scene))
    found += [record.attrs["bar_says"]] if record.attrs.get("bar_says") else []
    return found + cautions.about_retries(record, scene)


def static_warnings(record: xr.Dataset, scene: Scene) -> list[str]:
    """Warnings about an equilibrium: compressed or slack elements, an unresolved fold, a line below the sea bed."""
    at_once = record.expand_dims("frame") if "cable_position" in record else record
    return (
        _of_lines(_left, at_once, scene)
        + _of_lines(_slack, record, scene)
        + _surfaced_bodies(record, scene)
        + _moved_anchors(record, scene)
        + states_of(record, scene)
    )


def _of_lines(rule: Callable[..., list[str]], record: xr.Dataset, scene: Scene) -> list[str]:
    """Sentences of rule(record of the cable, scene, its number, its sections) for each cable."""
    found = []
    for k, part in enumerate(parts_of(record, "cable")):
        sections = [piece.section for piece in scene.network.pieces if piece.cable == k]
        found += part.named(rule(part.record, scene, k, sections))
    return found


def _snaps(record: xr.Dataset, scene: Scene, cable: int, sections: list[Cable]) -> list[str]:
    """Warnings of peaks resolved by few steps, and of undamped pulses."""
    return cautions.short_peaks(record, *_ends(scene.network, cable)) + cautions.undamped(record, scene, sections)


def _left(record: xr.Dataset, scene: Scene, _cable: int, sections: list[Cable]) -> list[str]:
    """Warnings where a cable left the validity range of its model."""
    section, length = sections[0], sum(each.length for each in sections)
    found = _compressed(record, sections) + _unresolved_fold(record, section)
    lowest = float(minimum(record, "cable_position")[..., 2].min())
    if scene.sea and not scene.seabed and lowest < -scene.sea.depth - 1e-6 * length:
        depth = -scene.sea.depth - lowest
        found.append(f"The cable dipped up to {depth:.3g} m below the sea bed: there is no [seabed] to carry it.")
    if scene.sea is not None and not called_by(scene, "line_wet"):  # equations without a water surface
        highest = float(maximum(record, "cable_position")[..., 2].max()) - highest_water(scene)
        if highest > ABOVE * length:
            found.append(f"The cable rose up to {highest:.3g} m above the water, {UNSEEN}")
    return found + warnings_of(record, section.fails_at is not None)


def _slack(record: xr.Dataset, _scene: Scene, _cable: int, sections: list[Cable]) -> list[str]:
    slack = record.cable_tension.values <= 1e-12 * np.abs(record.cable_tension.values).max()
    if sections[0].slack != "tension-only" or not slack.any():
        return []
    return [
        f"Slack (T = 0) in equilibrium: {_places(record, slack)}; the fold there is shorter than an element, whose "
        "shape is not that of the cable."
    ]


#: Fraction of its length by which a cable may rise above the highest crest without warning.
ABOVE = 0.01
#: End of the warnings about parts above the water in a run whose equations have no surface.
UNSEEN = "where buoyancy and all forces of the water went on: give sea.dry_above = true."


def _moved_anchors(record: xr.Dataset, scene: Scene) -> list[str]:
    """Warnings of anchors that moved or would have moved."""
    if "anchor_use" not in record:
        return []
    found = []
    for name in names_of(record, "anchor"):
        use = record.anchor_use.sel(anchor=name)
        if not (largest := float(use.max())) > 1:
            continue
        when = f" at t = {float(record.time[int(use.argmax('time'))]):g} s" if "time" in record.dims else ""
        pulled = f"it is pulled with {largest:.4g} times what it holds{when}"
        if when and name in scene.network.bodies:
            way = f"it lies {float(record.anchor_moved.sel(anchor=name)[-1]):.3g} m from its place at the end"
            found.append(f"The sinker {name} did not hold: {pulled}; {way}.")
        else:
            found.append(f"The anchor {name} would not hold: {pulled}; here it stays.")
    return found


def _surfaced_bodies(record: xr.Dataset, scene: Scene) -> list[str]:
    """Warnings of floats and clumps above the highest crest, if the equations have no water surface."""
    if scene.sea is None or called_by(scene, "joint_wet"):
        return []
    bodies = {name: record.joint_position.sel(joint=name, xyz="z") for name in scene.network.bodies}
    highest = {name: float(z.max()) - highest_water(scene) for name, z in bodies.items()}
    return [f"{name}: It rose up to {z:.3g} m above the water, {UNSEEN}" for name, z in highest.items() if z > 0]


def _compressed(record: xr.Dataset, sections: list[Cable]) -> list[str]:
    """Warning of compressed elements, where and how much.
    Neither rounding errors nor loads below the buckling load of an element that bends, EI (pi/h)^2, count."""
    least, rods = minimum(record, "cable_tension"), np.array([c.bending_stiffness for c in sections])
    smallest = min(float(least.min()), float(record.tension_anchor.min()))
    if rods.any():
        sizes = np.array([c.length / np.sum(np.atleast_2d(c.elements)[:, -1]) for c in sections])
        least = np.where(least > -(rods * (np.pi / sizes) ** 2)[record.segment_of_cell.values], 0.0, least)
        smallest = float(least.min())
    largest = max(-smallest, float(maximum(record, "cable_tension").max()), float(record.tension_top.max()))
    if smallest >= -ROUNDING * largest:
        return []
    pressed = least < -ROUNDING * largest
    where = _places(record, pressed) if pressed.any() else "the element at the anchor"
    when = "was compressed at times" if "time" in record.dims else "is compressed in this equilibrium"
    return [
        f"The cable {when} (smallest tension {newtons(smallest)}; {where}): a rope would go slack, see cable.slack = "
        "'tension-only'."
    ]


def _unresolved_fold(record: xr.Dataset, section: Cable) -> list[str]:
    """Warning of a fold that is smaller than the elements.

    Neighbouring elements turn by more than 90 degrees, or ends of an element are closer than half its length.
    """
    degree = section.position_degree
    ends = record.cable_position.values[..., ::degree, :]
    chords = np.diff(ends, axis=-2)
    lengths = np.linalg.norm(chords, axis=-1)
    sizes = np.diff(record.s.values.ravel()[::degree])
    dots = (chords[..., 1:, :] * chords[..., :-1, :]).sum(axis=-1)
    turned = dots < np.cos(np.radians(90.0)) * lengths[..., 1:] * lengths[..., :-1]
    bad = lengths < 0.5 * sizes
    bad[..., 1:] |= turned
    bad[..., :-1] |= turned
    if not bad.any():
        return []
    times = f" in {bad.any(axis=-1).sum()} of {len(bad)} frames" if "time" in record.dims else ""
    return [f"A fold of the cable is not resolved{times}: {_places(record, bad.any(axis=0))}; use smaller ones there."]


def _places(record: xr.Dataset, chosen: NDArray[Any]) -> str:
    """Text such as `elements 1 to 3 (s = 0 ... 0.3 m)` for a mask over the elements."""
    numbers = np.flatnonzero(chosen)
    s = record.s.values.ravel()[:: (record.sizes["node"] - 1) // len(chosen)]
    first, last = numbers[0], numbers[-1]
    named = f"element {first + 1}" if first == last else f"elements {first + 1} to {last + 1}"
    if len(numbers) <= last - first:
        named = f"{len(numbers)} of the {named}"
    return f"{named} (s = {s[first]:.4g} ... {s[last + 1]:.4g} m)"
