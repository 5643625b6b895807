"""Fatigue of lines: what the ranges of each curve are measured against."""

from typing import TYPE_CHECKING

from ..scene import Scene
from ..scene.fatigue import curve_of, curve_on

if TYPE_CHECKING:
    from .report import Report


def of_fatigue(scene: Scene, report: "Report") -> None:
    """Add the reference of every fatigue curve to the Report of `check`, and a warning where it is likely too high."""
    network, fatigue = scene.network, scene.fatigue
    corrosion = fatigue.corrosion if fatigue else 0.0
    seen: list[tuple[str, float]] = []
    unmeasured: list[str] = []
    for k, piece in enumerate(network.pieces):
        section = piece.section
        for text in dict.fromkeys(curve_on(section, fatigue, linked) for linked in (False, True)):
            if text is None:
                continue
            curve = curve_of(text)
            reference = curve.reference(section.breaking_load, section.steel_area, corrosion)
            if (text, reference) not in seen:
                seen.append((text, reference))
                unit = "N/MPa" if curve.unit == "MPa" else "N"
                report.add(f"R = 1 of the fatigue curve '{text}'", reference, unit, network.name_of(k))
            if curve.of_grade_orq and section.steel_area is None:
                unmeasured.append(network.name_of(k))
    report.warn(
        unmeasured,
        f"Fatigue of {', '.join(dict.fromkeys(unmeasured))}: API refers ranges of chain to the breaking load of grade "
        "ORQ of the same bar, which steel_area would give; with its own one, lives of better grades are too long (R4: "
        "twice).",
    )
