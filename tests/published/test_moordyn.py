"""Driven lines in still water against MoorDyn: extreme top tensions of three legs, and a cable that bends.

Source: MoorDyn from PyPI (the extra `test`; skipped without it), lumped masses and explicit steps; both programs
refined.
"""

import math
from typing import NamedTuple

import alone
import numpy as np
import pytest

from dolfbuoy.formats.moordyn_run import run as moordyn_run
from dolfbuoy.formats.moordyn_run import silent
from dolfbuoy.formats.to_moordyn import export
from dolfbuoy.model.lines import top_position
from dolfbuoy.scene import Top, load_scene

ROPE = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6}
ADDED_MASS, TANGENTIAL_DRAG = 1.0, 0.1
LENGTH, DEPTH, END = 50.0, 300.0, 30.0
#: No two legs alike under the motion; the bed is far below both.
FEET = [(40 * math.cos(angle), 40 * math.sin(angle), -30.0) for angle in (0.0, 2.0, 4.2)]
HUB = [0.0, 0.0, -5.0]


class Case(NamedTuple):
    """Motion of the hub about its mean position, and the normal drag coefficient of the legs."""

    amplitude: tuple[float, float, float]
    period: float
    normal_drag: float

    @property
    def top(self):
        """Keys of the end with this motion."""
        return {"position": HUB, "amplitude": self.amplitude, "period": self.period, "ramp": 6.0}


CASES = {
    "drag": Case((-0.3, 0.1, 1.2), period=6.0, normal_drag=1.2),
    "inertia": Case((-0.1, 0.05, 0.5), period=3.0, normal_drag=0.3),  # a fifth of the added mass is 2 % of the range
}


def extremes(case, t, tension):
    """Extremes of each leg over the last two periods [N], an array (peak or trough, leg)."""
    last = tension[t > END - 2 * case.period]
    return np.array([last.max(axis=0), last.min(axis=0)])


def ours(case, elements, step):
    """Extremes with P2-P1 and BDF2; the legs stay taut, since MoorDyn's carry no compression."""
    water = {"added_mass": ADDED_MASS, "normal_drag": case.normal_drag, "tangential_drag": TANGENTIAL_DRAG}
    size = {"length": LENGTH, "elements": elements, "position_degree": 2, "tension_degree": 1}
    legs = [ROPE | water | size | {"name": f"leg{i}", "from": foot, "to": "hub"} for i, foot in enumerate(FEET)]
    time = {"end": END, "step": step, "scheme": "bdf2"}
    joint = {"name": "hub"} | case.top
    found = alone.simulate({"sea": {"depth": DEPTH}, "cable": legs, "joint": [joint], "time": time})
    assert found.cable_tension.values.min() > 0.0
    return extremes(case, found.time.values, found.tension_top.values)


def write(path, case, segments, step):
    """MoorDyn's input.

    Tangential drag refers to the surface pi d l there and to the diameter d l here; BA = -1 is critical damping of the
    shortest axial vibration of a segment, which vanishes with it, and without which MoorDyn rings.
    """
    rope = ("rope", ROPE["diameter"], ROPE["line_density"], ROPE["axial_stiffness"], -1.0, 0.0)
    rope += (case.normal_drag, ADDED_MASS, TANGENTIAL_DRAG / math.pi, 0.0)
    points = [(i, "Fixed", *foot, 0, 0, 0, 0) for i, foot in enumerate(FEET, 1)]
    points.append((4, "Coupled", *HUB, 0, 0, 0, 0))
    lines = [(i, "rope", i, 4, LENGTH, segments, "-") for i in (1, 2, 3)]
    options = {"writeLog": 0, "dtM": step, "tScheme": "Euler", "g": 9.81, "rho": 1025.0, "WtrDpth": DEPTH, "kBot": 0}
    options |= {"cBot": 0, "TmaxIC": 0, "disableOutput": 1, "disableOutTime": 1}
    text = "three legs\nfor a test\n"
    text += table("LINE TYPES", "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx", rope)
    text += table("POINTS", "ID Attachment X Y Z Mass Volume CdA Ca", *points)
    text += table("LINES", "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs", *lines)
    text += "--- OPTIONS ---\n" + "".join(f"{value} {key}\n" for key, value in options.items())
    path.write_text(text + "--- need this line ---\n")


def table(name, columns, *rows):
    units = " ".join("(-)" for _ in columns.split())
    return "\n".join([f"--- {name} ---", columns, units, *(" ".join(map(str, row)) for row in rows)]) + "\n"


def theirs(moordyn, path, case, segments, step):
    """Extremes, extrapolated from the last two nodes: MoorDyn's own end force lacks half a segment's weight."""
    write(path, case, segments, step)
    t = np.arange(round(END / step) + 1) * step
    top = Top(kind="prescribed", **case.top)
    places = np.array([top_position(top, time) for time in t])
    speeds = np.diff(places, axis=0) / step
    with silent():
        system = moordyn.Create(str(path))
        moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
        moordyn.Init(system, places[0].tolist(), [0.0] * 3)
        lines = [moordyn.GetLine(system, i) for i in (1, 2, 3)]
        found = []
        for time, place, speed in zip(t, places.tolist(), speeds.tolist(), strict=False):
            moordyn.Step(system, place, speed, float(time), step)
            found.append([top_tension(moordyn, line, segments) for line in lines])
        moordyn.Close(system)
    return extremes(case, t[1:], np.array(found))


def top_tension(moordyn, line, segments):
    near, far = (math.hypot(*moordyn.GetLineNodeTen(line, segments - k)) for k in (1, 2))
    return 2 * near - far


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_three_legs(case, tmp_path):
    """Each program within 1 % of itself on half the segments and steps, and both within 1 % of each other.

    Of the range of each leg's tension, which is less than its peak.
    """
    moordyn = pytest.importorskip("moordyn")
    coarse, fine = ours(case, 20, 0.02), ours(case, 40, 0.01)
    others = [theirs(moordyn, tmp_path / "lines.txt", case, *numerics) for numerics in ((20, 0.001), (40, 0.0005))]
    allowed = 0.01 * (fine[0] - fine[1])
    for x, y in ((coarse, fine), others, (fine, others[1])):
        print(np.round(x, 1).tolist(), np.round(y, 1).tolist(), np.abs((x - y) / allowed).max())
        assert (np.abs(x - y) < allowed).all()


@pytest.mark.slow
def test_a_driven_cable_that_bends():
    """`driven` with EI = 1 kN m^2, pinned: top tension over two periods, and the reduction of its peak by EI."""
    pytest.importorskip("moordyn")
    peaks, series = [], None
    for EI in (0.0, 1e3):
        scene = load_scene("driven", cable={"bending_stiffness": EI, "slack": "compressive"}, time={"end": 30.0})
        run, other = alone.simulate(scene), moordyn_run(export(scene), 30.0)
        t = np.arange(20.0, 30.0, 0.02)
        series = [np.interp(t, run.time, run.tension_top.values.ravel()), np.interp(t, other.t, other.tension[:, 0, 1])]
        peaks.append([one.max() for one in series])
    ours, theirs = series
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 0.005 * np.ptp(ours)
    assert ours.max() == pytest.approx(theirs.max(), rel=2e-3)
    change = np.subtract(*peaks)
    assert change[0] > 40.0
    assert change[0] == pytest.approx(change[1], rel=0.1)
