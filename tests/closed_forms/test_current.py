"""A cable in a uniform current against another code's shooting solution, and the rates of convergence.

Source: shooting in extended precision (tests/reference).
"""

import math

import numpy as np
import pytest
from helpers import CableSolution, rates, reference
from scipy.integrate import solve_ivp

from dolfbuoy import load_scene
from dolfbuoy.statics.equilibrium import solve_equilibrium

CASES = reference("cable_in_current")
GRAVITY, DENSITY, DIAMETER, NORMAL_DRAG, TANGENTIAL_DRAG = 9.81, 1025.0, 0.08, 0.8, 0.1
OFFSET = np.array([1.0, 2.0, 0.0])


def anchor_of(case):
    return OFFSET - [0.0, 0.0, 20.0 if case["L"] < 100 else 700.0]


def solve(case, kind, degrees, elements):
    anchor, U = anchor_of(case), np.array(case["U"])
    top = {"kind": "free", "force": case[kind]["T_bnd"]}
    if kind == "dirichlet":
        top = {"kind": "fixed", "position": list(anchor + case[kind]["end"])}
    cable = {
        "length": case["L"],
        "line_density": case["w_sub"] / GRAVITY + DENSITY * math.pi * DIAMETER**2 / 4,
        "diameter": DIAMETER,
        "axial_stiffness": float(case["EA"]),
        "elements": elements,
        "position_degree": degrees[0],
        "tension_degree": degrees[1],
        "anchor": list(anchor),
        "normal_drag": NORMAL_DRAG,
        "tangential_drag": TANGENTIAL_DRAG,
        "top": top,
    }
    current = {"speed": float(np.linalg.norm(U)), "direction_deg": math.degrees(math.atan2(U[1], U[0]))}
    sea = {"depth": -float(anchor[2]), "density": DENSITY, "dry_above": False}  # as the numpy code
    return solve_equilibrium(load_scene({"gravity": GRAVITY, "sea": sea, "current": current, "cable": cable}))


class Exact:
    """Integrated down from the top, where position and force are known: r' = (1+e) t, n' = w e_z - (1+e) f_d."""

    def __init__(self, case, kind):
        self.case, self.U, self.EA = case, np.array(case["U"]), float(case["EA"])
        L, table = case["L"], case[kind]["table"]
        start = np.concatenate([table[-1]["r"], case[kind]["T_bnd"]])
        self.solution = solve_ivp(
            lambda s, y: self.derivative(y), (L, 0.0), start, method="DOP853", rtol=1e-13, atol=1e-10, dense_output=True
        ).sol
        self.anchor = anchor_of(case)
        for row in table:  # this integration and the reference agree
            np.testing.assert_allclose(self.solution(row["s"])[:3], row["r"], atol=2e-9 * L)

    def derivative(self, y):
        n = y[3:]
        T = np.linalg.norm(n)
        t, stretch = n / T, 1 + T / self.EA
        along = self.U @ t
        across = self.U - along * t
        drag = NORMAL_DRAG * np.linalg.norm(across) * across + TANGENTIAL_DRAG * abs(along) * along * t
        force = 0.5 * DENSITY * DIAMETER * stretch * drag - [0, 0, self.case["w_sub"]]
        return np.concatenate([stretch * t, -force])

    def position(self, s):
        return self.solution(s)[:3].T + self.anchor

    def slope(self, s):
        return np.array([self.derivative(y)[:3] for y in self.solution(s).T])

    def tension(self, s):
        return np.linalg.norm(self.solution(s)[3:], axis=0)


@pytest.mark.parametrize("kind", ["neumann", "dirichlet"])
@pytest.mark.parametrize("name", CASES)
def test_reference_values(name, kind):
    """Positions and tensions along the cable, and the force at its end."""
    case = CASES[name]
    problem = solve(case, kind, (3, 2), 64)
    solution, anchor = CableSolution(problem), anchor_of(case)
    for row in case[kind]["table"]:
        r, _, T = solution.at(row["s"])
        np.testing.assert_allclose(r - anchor, row["r"], atol=3e-8 * case["L"], err_msg=f"s = {row['s']}")
        assert pytest.approx(row["T"], rel=3e-6) == T
    np.testing.assert_allclose(problem.end_tension(), case[kind]["T_bnd"], atol=1e-8 * np.linalg.norm(T))
    problem.destroy()


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1), (3, 2)])
@pytest.mark.parametrize("kind", ["neumann", "dirichlet"])
@pytest.mark.parametrize("name", CASES)
def test_orders_of_convergence(name, kind, degrees):
    mu, nu = degrees
    case, sizes = CASES[name], [16, 32, 64] if mu < 3 else [8, 16, 32]
    exact, errors = Exact(case, kind), []
    for n in sizes:
        problem = solve(case, kind, degrees, n)
        errors.append(CableSolution(problem).errors(exact.position, exact.slope, exact.tension, points=8))
        problem.destroy()
    for quantity, order in (("L2r", mu + 1), ("L2slope", mu), ("L2T", nu + 1)):
        observed = rates([e[quantity] for e in errors], sizes)
        assert np.all(np.abs(observed - order) < 0.15), f"{quantity}: {observed} for order {order}"


def test_current_moves_the_cable_out_of_its_plane():
    """The long cable's case is three-dimensional: otherwise the tests above would not see the direction."""
    case = CASES["long_U1_dir60_EA2.3e8"]["dirichlet"]
    assert case["end"][1] == 0
    assert max(abs(row["r"][1]) for row in case["table"]) > 0.05 * 750
