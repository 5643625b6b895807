"""Difficult motions of a cable.

Source: rigid rods, falling chains, catenaries, other programs.
"""

import math

import numpy as np
import pytest
from hard import CHAIN, INF, SHORT, ending, run, said, sound_run, static, whole, with_
from mpi4py import MPI
from scipy.integrate import quad

from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.parts import alone
from dolfbuoy.scene import load_scene


def _energies(scene) -> tuple[np.ndarray, np.ndarray]:
    """(times, kinetic + potential energy) of a P1 chain without strain, with the scheme's own velocities."""
    simulation = Simulation(load_scene(scene), MPI.COMM_SELF)
    try:
        cable, g = simulation.problem.lines, simulation.scene.gravity
        c = cable.section
        order = np.argsort(cable.node_s)
        h = np.diff(cable.node_s[order])

        def energy():
            r = simulation.system.u[cable.node_dofs[order]]
            v = simulation.line_velocity[cable.node_dofs[order]]
            squares = (v[1:] ** 2 + v[1:] * v[:-1] + v[:-1] ** 2).sum(axis=1) / 3
            return c.line_density * float(h @ (squares / 2 + g * (r[1:, 2] + r[:-1, 2]) / 2))

        history = [(0.0, energy())]
        history += [(simulation.t, energy()) for _ in simulation.run()]
        return tuple(np.array(history).T)
    finally:
        simulation.problem.destroy()


@pytest.mark.slow
def test_driven_inextensible_limit(found):
    """Top driven as in `driven`, EA = 1e6 ... 1e14 N and EA = inf.  Must show: the same tension in the limit; Newton's
    iterations flat.
    """
    scene = load_scene("driven", time__end=0.5).to_dict()
    tops, iterations = [], []
    for EA in (1e6, 1e8, 1e10, 1e12, 1e14, INF):
        record = run(with_(scene, cable__axial_stiffness=EA))
        tops.append(record.tension_top.values)
        iterations.append(float(record.newton_iterations[1:].mean()))
    for EA, top in zip((1e6, 1e8, 1e10, 1e12, 1e14), tops, strict=False):
        limit = 4e4 / EA  # the strain T/EA, about 7000 N/EA, times some five for the sag that it changes
        found.below(f"EA = {EA:g}: top tension off by", np.abs(top / tops[-1] - 1).max(), limit)
    found.below("spread of iterations per step", max(iterations) - min(iterations), 1)


@pytest.mark.slow
def test_whip(found):
    """An inextensible chain released from the horizontal: three rods, and 20 elements for 2 s.  Must show: the motion
    of three rigid rods; no energy gained when the end whips.
    """
    three = run(with_(CHAIN, cable__elements=3, time={"end": 0.25, "output_every": 0.05}))
    angles = np.array([0.7495011118522598, 1.3106885391978178, 1.6741109192903898])
    found.close("x of the end at 0.25 s", three.cable_position[-1, -1, 0], np.sin(angles).sum() / 3, 1e-4)
    found.close("z of the end at 0.25 s", three.cable_position[-1, -1, 2], -np.cos(angles).sum() / 3, 1e-4)
    scene = with_(CHAIN, cable__elements=20, time={"end": 2.0})
    _, energy = _energies(scene)
    swing = 9.81 / 2  # between horizontal and hanging
    found.below("largest gain of energy / energy of the swing", (energy - energy[0]).max() / swing, 5e-4)
    found.remark(f"lost in 2 s: {(energy[0] - energy[-1]) / swing:.2g}")
    # 40 elements at 2 ms: jumps of the tension that generalized-alpha keeps grow; no radius, no jumps
    coarse = with_(CHAIN, cable__elements=40, time={"end": 1.0, "step": 2e-3, "output_every": 0.01})
    _, words = ending(coarse, run)
    found.says(words, "time.spectral_radius = 0.8")
    for choice in ({"spectral_radius": 0.0}, {"scheme": "bdf2"}, {"scheme": "backward-euler"}):
        record = sound_run(found, with_(coarse, time=choice))
        found.remark(f"40 elements at 2 ms, {choice}: {record.attrs['failed_steps']} steps cut")


@pytest.mark.slow
def test_falling_chain(found):
    """A folded chain, both ends beside each other at the same height, one is let go.  Must show: it falls faster than
    a stone: with its energy kept it takes 0.91 of a stone's time for the first 0.75 L.
    """
    L, d, down = 2.0, 0.1, 0.75  # the fold, d wide, is resolved by the elements
    depth = math.sqrt(L**2 / 4 - d**2 / 4)
    # the end whips at last: generalized-alpha of radius 0.8 keeps the jumps of the tension, and no step is small enough
    time = {"end": 0.53, "step": 5e-4, "output_every": 0.002, "scheme": "bdf2"}
    scene = with_(CHAIN, cable={"length": L, "elements": 80}, time=time)
    scene["initial"]["points"] = [[0.0, 0.0, 0.0], [d / 2, 0.0, -depth], [d, 0.0, 0.0]]
    record = sound_run(found, scene)
    # (dy/dt)^2 = g y (2L - y)/(L - y), here with L the whole chain: Calkin and March, Am. J. Phys. 57 (1989) 154
    g = 9.81
    expected = quad(lambda y: math.sqrt((L - y) / (g * y * (2 * L - y))), 0, down * L)[0]
    z = record.cable_position[:, -1, 2].values
    when = float(np.interp(down * L, -z, record.frame))
    found.close(
        f"time for the end to fall {down * L} m", when, expected, d / L, " s"
    )  # the theory is that of a narrow fold
    stone = math.sqrt(2 * down * L / g)
    found.below("that time / a stone's", when / stone, 0.95)


@pytest.mark.slow
def test_shaken_2hz(found):
    """The top of `driven` shaken at 2 Hz, 5 cm.  Must show: a tension that stays when step and elements are refined."""
    scene = load_scene("driven").to_dict()
    top = {"amplitude": [0.0, 0.0, 0.05], "period": 0.5, "ramp": 1.0}
    scene = with_(scene, cable__top=top, time={"end": 2.0, "step": 0.005, "scheme": "bdf2"})
    coarse, fine = run(scene), run(with_(scene, time__step=0.0025, cable__elements=20))
    found.finite(fine)
    found.close("largest top tension, refined", fine.tension_top.max(), float(coarse.tension_top.max()), 1e-2, " N")
    found.below("failed steps", fine.attrs["failed_steps"], 0)


def test_sign_change(found):
    """One rigid rod released at 120 degrees: pressed at first, pulled below.  Must show: the pendulum's angle and
    tension, from -rho g L/4 at the start; compression is said.
    """
    angle = math.radians(120.0)
    scene = with_(CHAIN, time={"end": 1.0, "step": 5e-4, "output_every": 5e-4})
    scene["initial"]["points"] = [[0.0, 0.0, 0.0], [math.sin(angle), 0.0, -math.cos(angle)]]
    full = whole(scene)
    record = alone(full)
    frames = record.frame.values
    for t, expected in ((0.5, 0.4092369789783202), (1.0, -1.994959693836354)):
        x, _, z = record.cable_position[np.argmin(np.abs(frames - t)), -1].values
        found.below(f"angle at {t} s off by", abs(math.atan2(x, -z) - expected), 1e-5)  # (omega dt)^2
    found.below("T at release off by", abs(float(record.tension_anchor[1]) + 9.81 / 4), 5e-5, " N")
    found.close("largest T, at the bottom", record.tension_anchor.max(), 2 * 9.81, 1e-5, " N")
    found.says(said(scene, full), "compressed")


def test_still_water(found):
    """Still water, everything at rest: v_rel = 0 everywhere in the drag.  Must show: no 0/0 in its derivative; the
    equilibrium stays to the last digits.
    """
    top = {"kind": "fixed", "position": [12.0, 0.0, -3.5]}
    scene = with_(SHORT, cable__top=top, time={"end": 1.0, "step": 0.02, "output_every": 0.02})
    record = sound_run(found, scene)
    moved = np.abs(record.cable_position - record.cable_position[0]).max()
    found.below("largest displacement in 1 s", moved, 1e-11, " m")
    found.below("change of the top tension", np.ptp(record.tension_top.values) / float(record.tension_top[0]), 1e-10)


@pytest.mark.slow
def test_straight_run(found):
    """A run that starts on the straight chord, 14 % pressed together (19 m for 22 m).  Must show: it springs into a
    sag and comes to rest in the catenary, or says that it is pressed together.
    """
    _comes_to_rest(found, {"kind": "straight"})


@pytest.mark.slow
def test_arch_run(found):
    """A run that starts on an upward arch of the cable's length, heavier than water.  Must show: it sinks and comes to
    rest in the catenary, in tension.
    """
    height = math.sqrt(11.0**2 - 6.0**2)
    _comes_to_rest(
        found, {"kind": "polyline", "points": [[0.0, 0.0, -20.0], [6.0, 0.0, -20 + height], [12.0, 0.0, -20.0]]}
    )


def _comes_to_rest(found, initial):
    end = [12.0, 0.0, -20.0] if initial["kind"] == "polyline" else [15.0, 0.0, -20.0 + math.sqrt(19**2 - 15**2)]
    scene = with_(SHORT, cable__top={"kind": "fixed", "position": end}, time={"end": 60.0, "step": 0.05})
    scene = with_(scene, sea__depth=40.0, cable={"anchor": [0.0, 0.0, -20.0], "normal_drag": 1.2})
    rest = static(scene)
    full = whole(with_(scene, initial=initial))
    found.finite(full)
    record = alone(full)
    off = float(np.abs(record.cable_position[-1] - rest.cable_position.values).max())
    if record.cable_tension[-1].min() < 0:
        found.remark(f"after 60 s {off:.3g} m from the catenary")
        found.says(said(scene, full), "compressed")
    else:
        found.below("from the catenary after 60 s", off, 1e-3, " m")
    found.remark(f"{record.attrs['failed_steps']} steps were cut")
