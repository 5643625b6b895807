"""What `check` says of lines that come taut with a jerk or land on the bed: what they pull with, and who damps it."""

import math

from ..results.snaps import PULSES

#: Steps in which an elastic wave runs along a line and back for the peak of a snap (12 gave 6 % less than 25, 6 gave
#: 18 % less), without damping, with which a run makes its steps small enough by itself.
STEPS_OF_A_WAVE = 10


def of_snaps(scene, material, length, report) -> None:
    """Add damping, and what a snap pulls with, of an elastic line to the Report of `check`.

    A line that moves by v along itself until it is taut pulls by Z v at an end that holds it, Z = sqrt(EA rho0), and by
    half of that where it meets line at rest: exactly without damping, and until the elastic wave is back.
    """
    tau = material.damping / material.axial_stiffness
    report.add("cable internal damping", material.damping, "N s", f"c/EA = {tau:.4g} s" if tau else "none")
    if material.slack != "tension-only":
        return
    travel = 2 * length * math.sqrt(material.line_density / material.axial_stiffness)
    pull = math.sqrt(material.line_density * material.axial_stiffness)
    report.add("pull of a snap at a held end per m/s", pull, "N", f"without damping, for {travel:.3g} s at most")
    undamped(scene, material, report)
    longest = f"{travel / STEPS_OF_A_WAVE:.2g}"
    if scene.time and not tau and scene.time.tolerance is None and scene.time.step > float(longest):
        report.warn(
            f"Where the cable comes taut, steps of {scene.time.step:g} s hide the peak: it needs {longest} s, or "
            "cable.damping, with which a run makes its steps smaller there."
        )


def undamped(scene, material, report) -> None:
    """Warn of an elastic line in motion without damping, which can come taut or lies on a bed."""
    if scene.time and not material.damping and math.isfinite(material.axial_stiffness):
        report.warn(f"The cable has {PULSES}")
