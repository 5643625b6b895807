"""Orders of bending lines: errors of a cantilever, a hanging line between clamps, and frequencies under tension.

Against elliptic integrals, Kirchhoff's equations and a transcendental equation.
Nodal positions and moments, end forces and frequencies converge with order 2 mu, as for a cable.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...elsewhere import MPI
from ...linear.linearisation import linearise
from ...linear.natural import lowest_modes
from ...results.compare import orders
from ...results.tables import groups
from ...scene import load_scene
from ...statics.equilibrium import solve_equilibrium
from ..study import Row, Table

PAIRS = ((1, 0), (2, 1), (3, 2), (4, 3))
CELLS = (4, 8, 16, 32, 64)
LOAD, STIFFNESS, LENGTH = 50.0, 1000.0, 10.0
#: Length [m], distance between the ends [m], weight [N/m] and EI [N m^2] of the hanging line, clamped along the chord.
HANGING = 120.0, 100.0, 200.0, 2e6
#: EI [N m^2], tip tension [N] and mass [kg/m] of the vibrating cantilever; number of frequencies.
BEAM, SWINGING = (1e4, 1e3, 5.0), 3
#: Errors below this are rounding errors: of Newton's solutions, and of eigenvalues.
ROUNDING, ROUNDING_OF_MODES = 2e-12, 1e-10


# -- what is true ------------------------------------------------------------------------------------------------------


def elastica(load: float) -> tuple[float, float]:
    """(x, z)/L of the tip of a cantilever along x with a transverse dead load P; load: P L^2/EI."""
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


def hanging(EI: float) -> tuple[float, float]:
    """(H, M) of the hanging line: pull along the chord [N], end moment [N m]; by shooting from the middle."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import fsolve

    length, span, w, _ = HANGING

    def slopes(s: float, y: Any, H: float) -> list[float]:
        _, theta, M = y
        return [math.cos(theta), M / EI, H * math.sin(theta) - w * s * math.cos(theta)]

    def end(unknowns: Any) -> Any:
        H, M = unknowns
        return solve_ivp(slopes, (0.0, length / 2), [0.0, 0.0, M], "DOP853", args=(H,), rtol=1e-13, atol=1e-13).y[:, -1]

    slack = w * span / math.sqrt(24 * (length / span - 1))  # of a shallow parabola
    found = fsolve(lambda x: end(x)[:2] - [span / 2, 0.0], [slack, EI * w / slack], xtol=1e-13)
    return float(found[0]), abs(float(end(found)[2]))


def swinging() -> list[float]:
    """Frequencies of the cantilever under tension [rad/s]: zeros of the determinant of its end conditions."""
    from scipy.optimize import brentq

    EI, T, mass = BEAM

    def determinant(omega: float) -> float:
        root = math.sqrt(T**2 + 4 * EI * mass * omega**2)
        a, b = math.sqrt((root + T) / (2 * EI)), math.sqrt((root - T) / (2 * EI))
        ch, sh, c, s = math.cosh(a * LENGTH), math.sinh(a * LENGTH), math.cos(b * LENGTH), math.sin(b * LENGTH)
        # y = A (ch - c) + B (sh/a - s/b): moment and shear are 0 at the tip
        moment = a**2 * ch + b**2 * c, a * sh + b * s
        shear = EI * (a**3 * sh - b**3 * s) - T * (a * sh + b * s), EI * (a**2 * ch + b**2 * c) - T * (ch - c)
        return (moment[0] * shear[1] - moment[1] * shear[0]) / ch

    at = np.linspace(0.01, 300.0, 3000)
    signs = np.sign([determinant(omega) for omega in at])
    places = np.flatnonzero(signs[1:] != signs[:-1])[:SWINGING]
    return [brentq(determinant, at[k], at[k + 1], xtol=1e-14, rtol=1e-14) for k in places]


# -- what is computed --------------------------------------------------------------------------------------------------


def scene_of(mu: int, cells: int, gravity: float, **cable: Any) -> dict[str, Any]:
    """A line from the origin, clamped along x there, with elements P_mu-P_(mu-1)."""
    held = {"anchor": [0.0, 0.0, 0.0], "from_end": {"direction": [1.0, 0.0, 0.0]}}
    size = {"elements": cells, "position_degree": mu, "tension_degree": mu - 1}
    return {"gravity": gravity, "cable": held | size | cable}


def cantilever(mu: int, cells: int) -> Row:
    """Errors of the tip position relative to the length, and of the root moment."""
    top = {"kind": "free", "force": [0.0, 0.0, LOAD]}
    scene = scene_of(mu, cells, 0.0, top=top, length=LENGTH, line_density=1.0, bending_stiffness=STIFFNESS)
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    lines, u = problem.lines, problem.system.u
    tip, root = u[lines.top_dofs()], np.linalg.norm(u[lines.end_moments(0, 0)])
    problem.destroy()
    x, z = elastica(LOAD * LENGTH**2 / STIFFNESS)
    off = math.hypot(tip[0] - x * LENGTH, tip[2] - z * LENGTH) / LENGTH
    return {"h": LENGTH / cells, "tip": off, "moment": abs(root / (LOAD * x * LENGTH) - 1)}


def between_clamps(mu: int, cells: int) -> Row:
    """Errors of the force and moment at the ends of the hanging line."""
    length, span, w, EI = HANGING
    cable = {"length": length, "line_density": w, "bending_stiffness": EI, "to_end": {"direction": [1.0, 0.0, 0.0]}}
    cable["top"] = {"kind": "fixed", "position": [span, 0.0, 0.0]}
    problem = solve_equilibrium(load_scene(scene_of(mu, cells, 1.0, **cable)), MPI.COMM_SELF)
    force, moment = problem.end_force(0, 1), np.linalg.norm(problem.system.u[problem.lines.end_moments(0, 1)])
    problem.destroy()
    H, M = hanging(EI)
    return {"h": length / cells, "force": abs(force[0] / H - 1), "moment": abs(moment / M - 1)}


def frequencies(mu: int, cells: int) -> Row:
    """Largest error of the lowest frequencies of the cantilever under tension."""
    EI, T, mass = BEAM
    top = {"kind": "free", "force": [T, 0.0, 0.0]}
    scene = scene_of(mu, cells, 0.0, top=top, length=LENGTH, line_density=mass, bending_stiffness=EI)
    found = linearise(load_scene(scene), MPI.COMM_SELF)
    omega = np.array([mode.omega for mode in lowest_modes(found, 2 * SWINGING + 2)])
    found.destroy()
    off = [np.abs(omega / one - 1).min() for one in swinging()]
    return {"h": LENGTH / cells, "frequency": max(off)}


# -- tables ------------------------------------------------------------------------------------------------------------

TABLES = {
    "cantilever": (
        cantilever, f"Errors of a cantilever with P L^2/EI = {LOAD * LENGTH**2 / STIFFNESS:g}",
        {"tip": "tip", "moment": "moment at the root"},
    ),
    "clamped": (
        between_clamps, "Errors of a line that hangs between clamps, EI = {3:g} N m2".format(*HANGING),
        {"force": "end force", "moment": "end moment"},
    ),
    "beam": (
        frequencies, f"Errors of the lowest {SWINGING} frequencies of a pulled cantilever", {"frequency": "largest"},
    ),
}  # fmt: skip


def study(folder: Path, cells: Sequence[int] = CELLS) -> list[Table]:
    """Tables of the cantilever, of the line between clamps, and of frequencies."""
    made = []
    for name, (evaluate, title, errors) in TABLES.items():
        sizes = [(mu, nu, n) for mu, nu in PAIRS for n in cells]
        rows: list[Row] = [{"pair": f"P{mu}-P{nu}", "cells": n} | evaluate(mu, n) for mu, nu, n in sizes]
        shown = {"pair": "pair", "cells": "elements"}
        for error, heading in errors.items():
            shown |= {error: heading, f"order_{error}": "order"}
            for curve in groups(rows, "pair").values():
                orders(curve, error)
            least = ROUNDING_OF_MODES if error == "frequency" else ROUNDING
            for row in (row for row in rows if row[error] < least):
                row[f"order_{error}"] = None
        made.append(Table(name, rows, f"{title}; order 2 mu is expected", shown))
    return made
