"""Bed friction under a load cycle, and the touchdown of a chain compared with hard contact at its nodes.

Source: Masing's closed form (tests/reference); a complementarity problem with the same elements in plain numpy.
"""

import math

import numpy as np
import pytest
from alone import simulate
from dynamics_helpers import running
from helpers import reference

from dolfbuoy.model.lines import top_position

PULL = reference("bed_and_networks")["cases"]["pull_u1"]


def test_pull_and_return():
    """Slowly by 1 m and back: 3e-3 of the force with a stick length of 5 mm; the ends lie as deep as the rest."""
    case, values = PULL["input"], PULL["values"]
    area, period, z = math.pi * 0.1**2 / 4, 400.0, -20.002
    cable = {"length": case["L"], "line_density": case["w"] / 9.81 + 1025 * area, "diameter": 0.1, "elements": 200}
    end = case["L"] * (1 + case["pretension"] / case["EA"])
    top = {"kind": "prescribed", "position": [end, 0.0, z], "amplitude": [case["pull"], 0.0, 0.0], "period": period}
    scene = {
        "sea": {"depth": 20.0},
        "cable": cable | {"axial_stiffness": case["EA"], "anchor": [0.0, 0.0, z], "top": top},
        "seabed": {"friction": case["mu"], "stick_length": 0.005},
        "time": {"end": period / 2, "step": period / 300},
    }
    run = simulate(scene)
    force = run.end_tension.sel(xyz="x").values
    for at, name in ((period / 4, "F_at_u0"), (5 * period / 12, "F_back_at_half"), (period / 2, "F_back_at_0")):
        assert force[np.argmin(np.abs(run.time.values - at))] == pytest.approx(values[name], rel=3e-3), name
    assert float(run.tension_anchor[-1]) == pytest.approx(values["T_anchor"], rel=3e-3)


# -- hard contact at the nodes -----------------------------------------------------------------------------------------

L, ELEMENTS, EA, RHO, W, DEPTH, X = 60.0, 30, 4e7, 40.0, 350.0, 20.0, 53.0
HEAVE, PERIOD, STEP, END = 1.0, 5.0, 0.02, 7.5
#: The same in a scene: next to no water, and a bed on which the line sinks by 0.1 mm.
THIN = 1e-6
HARD = {
    "gravity": W / RHO,
    "sea": {"depth": DEPTH, "density": THIN},
    "cable": {
        "length": L,
        "line_density": RHO,
        "diameter": 0.1,
        "axial_stiffness": EA,
        "elements": ELEMENTS,
        "top": {"kind": "prescribed", "position": [X, 0, 0], "amplitude": [0, 0, HEAVE], "period": PERIOD, "ramp": 2.0},
    },
    "seabed": {"stiffness": W / 0.1 / 1e-4},
    "time": {"end": END, "step": STEP},
}


class HardContact:
    """P1-P0 elements, backward Euler, z >= -depth perpendicular to what the bed presses, node by node; in the plane."""

    def __init__(self, r):
        self.r, self.v, self.h = r.copy(), np.zeros_like(r), L / ELEMENTS
        n = len(r)
        self.M = np.zeros((n, n))
        for e in range(ELEMENTS):
            self.M[e : e + 2, e : e + 2] += RHO * self.h / 6 * np.array([[2, 1], [1, 2]])

    def tension(self, r):
        return EA * (np.linalg.norm(np.diff(r, axis=0), axis=1) / self.h - 1)

    def forces(self, r):
        """Rows (n, 2) of tension and weight, and their derivative (2 n, 2 n)."""
        d = np.diff(r, axis=0)
        length = np.linalg.norm(d, axis=1)
        t, T = d / length[:, None], self.tension(r)
        f = np.zeros_like(r)
        f[:-1] -= T[:, None] * t
        f[1:] += T[:, None] * t
        f[:, 1] += W * self.h
        f[[0, -1], 1] -= W * self.h / 2
        K = np.zeros((2 * len(r),) * 2)
        for e in range(ELEMENTS):
            along = np.outer(t[e], t[e])
            k = EA / self.h * along + T[e] / length[e] * (np.eye(2) - along)
            a, b = slice(2 * e, 2 * e + 2), slice(2 * e + 2, 2 * e + 4)
            for rows, columns, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                K[rows, columns] += sign * k
        return f, K

    def step(self, top, h):
        """One step; returns the tension at the top, the reaction there."""
        free, r = np.arange(2, 2 * len(self.r) - 2), self.r + h * self.v
        r[0], r[-1] = self.r[0], top
        inertia, p = np.kron(self.M, np.eye(2)) / h**2, np.zeros(len(r))
        lies = np.zeros(len(r), dtype=bool)
        for _ in range(60):
            f, K = self.forces(r)
            R = f.ravel() + inertia @ (r - self.r - h * self.v).ravel()
            before, lies = lies, p - 1e5 * (r[:, 1] + DEPTH) > 0  # the active set of min(p, gap) = 0
            lies[[0, -1]] = False
            J, rhs = (K + inertia).copy(), -R
            held = 2 * np.flatnonzero(lies) + 1
            J[held], rhs[held] = 0.0, -(r.ravel()[held] + DEPTH)
            J[held, held] = 1.0
            change = np.zeros(r.size)
            change[free] = np.linalg.solve(J[np.ix_(free, free)], rhs[free])
            r = r + change.reshape(r.shape)
            p = np.where(lies, (R + (K + inertia) @ change).reshape(r.shape)[:, 1], 0.0)
            if np.abs(change).max() < 1e-11 and np.array_equal(lies, before):
                break
        assert np.abs(change).max() < 1e-11
        assert p.min() >= 0
        assert r[:, 1].min() > -DEPTH - 1e-9
        f, _ = self.forces(r)
        reaction = (f.ravel() + inertia @ (r - self.r - h * self.v).ravel())[-2:]
        self.r, self.v = r, (r - self.r) / h
        return float(np.linalg.norm(reaction)), int(lies.sum())


def test_against_complementarity():
    """Top tension over one and a half periods, touchdown moving over several nodes: equal to 0.2 %."""
    with running(HARD) as simulation:
        lines = simulation.problem.lines
        order = np.argsort(lines.node_s)
        hard = HardContact(simulation.system.u[lines.node_dofs[order]][:, [0, 2]])
        hard.r[:, 1] = np.maximum(hard.r[:, 1], -DEPTH)
        ours, theirs, lying = [], [], []
        for n in range(round(END / STEP)):
            simulation.step(STEP)
            ours.append(np.linalg.norm(simulation.end_tension))
            top = top_position(lines.pieces[0].ends[1].top, (n + 1) * STEP)
            tension, count = hard.step(top[[0, 2]], STEP)
            theirs.append(tension)
            lying.append(count)
    ours, theirs = np.array(ours), np.array(theirs)
    assert max(lying) - min(lying) >= 3
    assert np.ptp(theirs) > 0.3 * theirs.mean()
    assert ours.max() == pytest.approx(theirs.max(), rel=2e-3)
    assert ours.min() == pytest.approx(theirs.min(), rel=1e-2)
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 5e-3 * np.ptp(theirs)
