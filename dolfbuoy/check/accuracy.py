"""Expected error bar of a run and cost of 1 % accuracy, from the time step and the fastest relevant motion.

The relative error of a scheme's rate at angular frequency omega is |log(amplification)/(i omega step) - 1|, for BDF2
(omega step)^2/3.  Bars of largest tensions and angles are proportional to its value at the excitation frequency, or at
that of heave, roll or pitch of a buoy if higher: in shipped scenes, with their own elements, they were 0.25 to 3.5
times as large (tests/studies/test_expected_bars.py).
"""

import cmath
import math
from typing import TYPE_CHECKING

from ..accuracy.bars import LARGEST
from ..motion.schemes import make_scheme
from ..scene import Scene
from ..scene.settings import period_of, space_of

if TYPE_CHECKING:
    from .report import Report

#: Motions of a buoy that are excited by slower waves, down to this fraction of their period.
FAST, SLOWEST = ("heave", "roll", "pitch"), 1 / 8
#: Factor by which a bar may be larger or smaller than expected.
SPREAD = 4.0
#: Seconds per step, plus those per buoy, element and degree, and wave component, on the machine of the README.
STEP, OF_BUOY, OF_ELEMENT, OF_COMPONENT = 3e-5, 3e-5, 1e-6, 3e-7
#: Accuracy whose cost is stated.
ASKED = 0.01


def expected(scene: Scene, report: "Report") -> None:
    """Add the expected bar at the scene's own step, and the seconds of a run to 1 %, to a report with periods.

    Adds nothing without an excitation period or if a buoy's motions are unknown, and no bar for adaptive steps.
    """
    period, time = period_of(scene), scene.time
    if time is None or period is None:
        return
    fast = {
        name.replace(",", ""): p
        for name, p in report.periods.items()
        if name.split()[-1] in FAST and p > SLOWEST * period
    }
    if scene.buoys and not fast:
        return
    name, fastest = min([("drive", period), *fast.items()], key=lambda pair: pair[1])
    omega = 2 * math.pi / fastest
    unsure = f"; more where lines snap tight{' or nodes land' if scene.seabed else ''}" if scene.cables else ""
    if time.tolerance is None:
        factor = complex(make_scheme(time.scheme, time.spectral_radius).amplification(omega, time.step))
        bar = abs(cmath.log(factor) / (1j * omega * time.step) - 1)
        low, high = 100 * bar / SPREAD, 100 * bar * SPREAD
        known = f"{low:.2g} to {high:.2g} %" if bar * SPREAD < LARGEST else f"{low:.2g} % or more, or not known"
        remark = f"{known}, step against {name}, {fastest:.3g} s{unsure}"
        report.add("error bar to expect of largest values", 100 * bar, "%", remark)
    steps = [math.sqrt(3 * ASKED * times) / omega for times in (1 / SPREAD, 1.0, SPREAD)]
    each = seconds_of_step(scene)
    shortest, middle, longest = (time.end / step * each for step in reversed(steps))
    remark = f"{shortest:.2g} to {longest:.2g} s, BDF2 with steps of {steps[0]:.2g} to {steps[2]:.2g} s{unsure}"
    report.add(f"time of a run with {100 * ASKED:g} %", middle, "s", remark)


def seconds_of_step(scene: Scene) -> float:
    """Seconds per step of a scene, on the machine of the README."""
    space, waves = space_of(scene), scene.waves
    components = waves.components if waves is not None and waves.irregular else 0
    components = components if isinstance(components, int) else len(components)
    return STEP + OF_BUOY * len(scene.buoys) + OF_ELEMENT * space.mu * space.cells + OF_COMPONENT * components


def seconds_of(scene: Scene) -> float:
    """Seconds per run, on that machine with its `time.step`; 0 without [time]."""
    return scene.time.end / scene.time.step * seconds_of_step(scene) if scene.time else 0.0
