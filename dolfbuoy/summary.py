"""What matters of a run, in a few lines."""

import numpy as np

from .check import remaining_amplitude


def summary(record, scene) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of a record: extremes, effort, and what the scheme's damping leaves."""
    rows = []

    def extremes(name, values, unit, scale=1.0):
        rows.append((name, f"{np.min(values) * scale:.4g} ... {np.max(values) * scale:.4g}", unit))

    if "tension_top" in record:
        extremes("tension at the top |T_bnd|", record.tension_top, "kN", 1e-3)
        extremes("tension at the anchor T_h(0)", record.tension_anchor, "kN", 1e-3)
    if "buoy_position" in record:
        for axis in "xyz":
            extremes(f"{axis} of C", record.buoy_position.sel(xyz=axis), "m")
        if "surface_elevation" in record:
            extremes("z of C over the water", record.buoy_position.sel(xyz="z") - record.surface_elevation, "m")
        extremes("cone angle", record.cone_angle, "deg")
    steps = record.sizes["time"] - 1
    rows.append(("steps, of which retried", f"{steps}, {record.attrs['failed_steps']}", ""))
    if steps:
        rows.append(("Newton iterations per step", f"{float(record.newton_iterations[1:].mean()):.2f}", ""))
    wall = record.attrs["wall_time_s"]
    rows.append(("wall time", f"{wall:.1f}", "s"))
    rows.append(("speed", f"{float(record.time[-1]) / max(wall, 1e-9):.1f}", "x real time"))
    if scene.waves:
        rest = 100 * remaining_amplitude(scene.waves.period, scene)
        rows.append((f"left by the scheme of a free {scene.waves.period:g} s motion", f"{rest:.1f}", "%"))
    return rows


#: Elements of a cable from which on two ranks are faster than one (`tests/benchmarks/scaling.py strong`).
SHARING_PAYS_FROM = 100_000


def sharing_note(scene, ranks: int) -> str | None:
    """A sentence if one rank would run this scene faster than so many; None if not."""
    elements = scene.cable.elements if scene.cable else 0
    cells = elements if isinstance(elements, int) else int(sum(count for _, count in elements))
    if ranks == 1 or cells >= SHARING_PAYS_FROM:
        return None
    return (
        f"Note: one rank runs this scene faster than {ranks}: sharing a cable pays from about {SHARING_PAYS_FROM:,} "
        f"elements on, and here are {cells:,}. Ranks do pay in sweep and study, which spread their cases."
    )


def warnings(record, scene) -> list[str]:
    """Sentences about where a run left the range of its model."""
    found = []
    if "cable_tension" in record:
        smallest = min(float(record.cable_tension.min()), float(record.tension_anchor.min()))
        if smallest < 0:
            found.append(
                f"The cable was compressed at times (smallest tension {smallest:.4g} N): a rope would go slack."
            )
        lowest = float(record.cable_position.sel(xyz="z").min())
        if scene.sea and lowest < -scene.sea.depth - 1e-6 * scene.cable.length:
            depth = -scene.sea.depth - lowest
            found.append(f"The cable dipped up to {depth:.3g} m below the sea bed, which this model does not know.")
    if record.attrs["failed_steps"]:
        found.append(f"{record.attrs['failed_steps']} steps failed and were retried with smaller ones.")
    return found
