"""Orders of lines that bend: a cantilever with P L^2/EI = 5 against elliptic integrals.

The place of its tip and the moment at its root converge with order 2 mu, as the nodes of a cable do.
"""

import math
from pathlib import Path

import numpy as np

from ...elsewhere import MPI
from ...results.compare import orders
from ...results.tables import groups
from ...scene import load_scene
from ...statics.equilibrium import solve_equilibrium
from ..study import Row, Table

PAIRS = ((1, 0), (2, 1), (3, 2), (4, 3))
CELLS = (4, 8, 16, 32)
LOAD, STIFFNESS, LENGTH = 50.0, 1000.0, 10.0
#: Errors below this are rounding.
ROUNDING = 1e-10


def elastica(load: float) -> tuple[float, float]:
    """(x, z) of the tip over the length, of a cantilever along x with a dead load P across it; load: P L^2/EI."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

    def modulus(angle: float) -> tuple[float, float]:
        m = (1 + math.sin(angle)) / 2
        return m, math.asin(1 / math.sqrt(2 * m))

    def left(angle: float) -> float:
        m, amplitude = modulus(angle)
        return float(ellipk(m) - ellipkinc(amplitude, m) - math.sqrt(load))

    angle = brentq(left, 1e-6, math.pi / 2 - 1e-9, xtol=1e-15, rtol=1e-14)
    m, amplitude = modulus(angle)
    z = 1 - 2 * (ellipe(m) - ellipeinc(amplitude, m)) / math.sqrt(load)
    return math.sqrt(2 * math.sin(angle) / load), float(z)


def cantilever(mu: int, cells: int) -> Row:
    """Errors of the tip's place over the length, and of the moment at the root."""
    cable = {
        "length": LENGTH, "line_density": 1.0, "bending_stiffness": STIFFNESS, "elements": cells, "position_degree": mu,
        "tension_degree": mu - 1, "anchor": [0.0, 0.0, 0.0], "from_end": {"direction": [1.0, 0.0, 0.0]},
        "top": {"kind": "free", "force": [0.0, 0.0, LOAD]},
    }  # fmt: skip
    problem = solve_equilibrium(load_scene({"gravity": 0.0, "cable": cable}), MPI.COMM_SELF)
    lines, u = problem.lines, problem.system.u
    tip, root = u[lines.top_dofs()], np.linalg.norm(u[lines.end_moments(0, 0)])
    problem.destroy()
    x, z = elastica(LOAD * LENGTH**2 / STIFFNESS)
    off = math.hypot(tip[0] - x * LENGTH, tip[2] - z * LENGTH) / LENGTH
    return {"pair": f"P{mu}-P{mu - 1}", "h": LENGTH / cells, "cells": cells, "tip": off,
            "moment": abs(root / (LOAD * x * LENGTH) - 1)}  # fmt: skip


def study(folder: Path, cells: tuple[int, ...] = CELLS) -> list[Table]:
    """Table of the cantilever."""
    rows = [cantilever(mu, n) for mu, _ in PAIRS for n in cells]
    for curve in groups(rows, "pair").values():
        for name in ("tip", "moment"):
            orders(curve, name)
            for row in curve:
                if row[name] < ROUNDING:
                    row[f"order_{name}"] = None
    shown = {"pair": "pair", "cells": "elements", "tip": "tip", "order_tip": "order"}
    shown |= {"moment": "moment at the root", "order_moment": "order"}
    return [Table("cantilever", rows, "Errors of a cantilever with P L^2/EI = 5; order 2 mu is expected", shown)]
