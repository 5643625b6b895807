"""Coefficients by shape, and the damping by the waves that a hull makes: estimates, and where they are missing."""

import math
from typing import TYPE_CHECKING

from ..errors import InputError
from ..scene import Scene
from ..scene.quantities import Wrong
from ..scene.shapes import BY_SHAPE, SHAPES, SOURCE, Estimate, estimate
from ..scene.waves import Waves
from .buoys import Upright

if TYPE_CHECKING:
    from .report import Report

#: Draft of the cylinder over that of the hull within which it stands for the hull.
LIKE = 0.67, 1.5
#: Natural period over the period of the waves, regular ones and those of a sea, within which resonance counts: in the
#: tail of a sea, S ~ omega^-5, the part 2.7 r^4/zeta of its variance; r: ratio of periods, zeta: damping ratio.
NEAR, IN_A_SEA = (0.8, 1.25), (0.2, 1.4)
#: A damping ratio of waves that counts: next to that of drag in heave, and alone in pitch.
MUCH, LEAST = 0.5, 0.03


def of_shapes(scene: Scene, buoys: list[Upright], report: "Report") -> None:
    """Add numbers of coefficients that are given by shape to the Report of `check`, and warn outside their range."""
    raw = dict(zip(scene.network.buoys, scene.buoys, strict=True))
    for buoy in buoys:
        about, found = report.about(buoy.name), buoy.section
        given = raw[buoy.name or next(iter(raw))]
        names = {key: value for key in (*BY_SHAPE, "wave_damping") if isinstance(value := getattr(given, key), str)}
        for key, shape in names.items():
            if key in BY_SHAPE:
                about.add(f"{key} of a {shape}", getattr(found, key), "", SOURCE)
            else:
                for motion, size, unit in zip(
                    ("heave", "pitch"), found.wave_damping or (), ("N s/m", "N m s"), strict=False
                ):
                    about.add(f"radiation damping in {motion}", size, unit, SOURCE)
        if not names:
            continue
        of = estimate(scene, given)
        slender, likeness = of.cylinder.draft / of.cylinder.radius, of.cylinder.draft / of.draft
        for shape in dict.fromkeys(shape for shape in names.values() if shape in SHAPES):
            low, high = SHAPES[shape]
            limits = f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
            about.warn(
                not low <= slender <= high,
                f"A draft of {slender:.2g} radii is not that of a {shape}, {limits}: coefficients by this shape are "
                "a guess.",
            )
        about.warn(
            not LIKE[0] <= likeness <= LIKE[1],
            f"The hull is no cylinder: one with its water plane has {likeness:.2g} of its draft, so that coefficients "
            "by shape are rough.",
        )


def of_radiation(
    scene: Scene, waves: Waves, of_drag: float, buoy: Upright, report: "Report", band: tuple[float, float]
) -> None:
    """Warn where the waves that a hull makes would damp its resonance and the scene has none of that damping.

    of_drag: damping ratio of heave by drag.  band: natural periods over that of the waves within which it resounds.
    """
    low, high = band
    if buoy.section.wave_damping is not None or getattr(buoy.section, "potential_flow", None) is not None:
        return
    try:
        found = estimate(scene, buoy.section)
    except (Wrong, InputError):  # it is drowned or has no water plane
        return
    for motion, omega, ratio, enough in (
        ("heave", found.heave, _heave_ratio(buoy, found), MUCH * of_drag),
        ("pitch", found.pitch, _pitch_ratio(buoy, found), LEAST),
    ):
        period = 2 * math.pi / omega
        report.add(f"{motion} damping ratio by waves of its own", ratio, "", f"an estimate; period {period:.3g} s")
        drag = f", by drag {of_drag:.2g}" if motion == "heave" else ""
        report.warn(
            ratio > enough and low <= period / waves.main_period <= high,
            f"The natural period of {motion}, {period:.3g} s, is among those of the waves, and the hull makes waves "
            f"that damp it with a ratio of {ratio:.2g}{drag}: buoy.wave_damping = 'radiation' has them.",
        )


def _heave_ratio(buoy: Upright, found: Estimate) -> float:
    return found.of_heave[1] / (2 * found.heave * (buoy.mass.mass + found.of_heave[0]))


def _pitch_ratio(buoy: Upright, found: Estimate) -> float:
    return found.of_pitch[1] / (2 * found.pitch * (buoy.mass.inertia[0] + found.of_pitch[0]))
