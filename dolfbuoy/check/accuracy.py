"""Error bar to expect of a run, and what 1 % would take, before it: the step against the fastest motion that matters.

A scheme's rate of a motion of angular frequency omega is off by |log(amplification)/(i omega step) - 1|, of BDF2 by
(omega step)^2/3.  That of the drive, or of the heave, roll or pitch of a buoy where these are faster, is what the bars
of largest tensions and angles are proportional to: in shipped scenes they were 0.25 to 3.5 times as large, with as many
elements as the scenes have (tests/studies/test_expected_bars.py).
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

#: Motions of a buoy that follow a drive which is slower, down to this part of its period.
FAST, SLOWEST = ("heave", "roll", "pitch"), 1 / 8
#: A bar is so many times larger or smaller than expected.
SPREAD = 4.0
#: Seconds of a step, and more for each buoy, degree of an element and component of a sea, on the machine of the README.
STEP, OF_BUOY, OF_ELEMENT, OF_COMPONENT = 3e-5, 3e-5, 1e-6, 3e-7
#: The accuracy whose cost is given.
ASKED = 0.01


def expected(scene: Scene, report: "Report") -> None:
    """Add the expected bar of the scene's own step, and the seconds of a run with 1 %, to a report with its periods.

    Nothing where no period drives the scene, where steps are adaptive or motions of a buoy are not known.
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
    """Seconds that a step of a scene takes, on the machine of the README."""
    space, waves = space_of(scene), scene.waves
    components = waves.components if waves is not None and waves.irregular else 0
    components = components if isinstance(components, int) else len(components)
    return STEP + OF_BUOY * len(scene.buoys) + OF_ELEMENT * space.mu * space.cells + OF_COMPONENT * components


def seconds_of(scene: Scene) -> float:
    """Seconds that a run takes, there and by its `time.step`; none without [time]."""
    return scene.time.end / scene.time.step * seconds_of_step(scene) if scene.time else 0.0
