"""Inextensible elements with constant tension are rigid rods: exact pendulums, alone, in a chain and below a buoy.

Source: differential equations of rigid rods in extended precision (tests/reference).
"""

import numpy as np
import pytest
from dynamics_helpers import merged, rates, rotation_matrix, simulate_evenly
from helpers import reference

RODS = reference("rods")


def converges(errors, order=1.0, within=0.1):
    """Every consecutive rate is near `order`."""
    found = rates(errors)
    assert np.all(np.abs(found - order) < within), f"rates {found} of errors {errors}"


def chain(case, dt, end):
    """A chain of rods in the x-z plane at the reference's initial angles from the downward vertical."""
    h = case["L"] / case["N"]
    angles = np.array(case["theta0"])
    x, z = np.cumsum(h * np.sin(angles)), np.cumsum(-h * np.cos(angles))
    points = [[0.0, 0.0, 0.0], *([float(a), 0.0, float(b)] for a, b in zip(x, z, strict=True))]
    return {
        "cable": {"length": case["L"], "line_density": case["rho"], "elements": case["N"], "top": {"kind": "free"}},
        "initial": {"kind": "polyline", "points": points},
        "time": {"end": end, "step": dt, "output_every": dt},
    }


@pytest.mark.parametrize("degrees", ["60", "120"])
def test_one_rod(degrees):
    """Angle to first order and the tension at release; beyond 90 degrees the rod starts under compression."""
    table = RODS["one_rod"]["table"][degrees]
    theta0, density, L = np.radians(float(degrees)), 2.4, 1.0
    case = {"N": 1, "L": L, "rho": density, "theta0": [theta0]}
    errors, released = [], []
    for dt in (0.005, 0.0025, 0.00125):
        run = simulate_evenly(chain(case, dt, end=0.5))
        tip = run.cable_position.values[:, -1]
        assert np.abs(np.linalg.norm(tip, axis=1) - L).max() < 1e-12
        at = {round(t, 6): i for i, t in enumerate(run.frame.values)}
        angle = np.arctan2(tip[:, 0], -tip[:, 2])
        errors.append([angle[at[t]] - theta for t, theta in table["theta_at_t"] if t <= 0.5])
        released.append(run.cable_tension.values[0, 0] / (density * 9.81 * L))
    errors = np.array(errors)
    for column in errors.T:
        converges(np.abs(column))
    extrapolated = 2 * errors[1:] - errors[:-1]
    assert np.abs(extrapolated[-1]).max() < 5e-5
    assert released[-1] == pytest.approx(table["T_over_rhogL_release"], abs=1e-5)


def test_force_that_holds_a_swinging_rod():
    """At the hinge, to first order and in the limit: m (r_C,tt - g), with theta_tt = -3 g/(2 L) sin theta."""
    density, L, theta0 = 2.4, 1.0, np.radians(60.0)
    weight, table = density * 9.81 * L, [(t, a) for t, a in RODS["one_rod"]["table"]["60"]["theta_at_t"] if t <= 0.5]
    times, theta = np.array([(0.0, theta0), *table]).T
    pull = weight * (2.5 * np.cos(theta) - 1.5 * np.cos(theta0))  # along the rod
    across = weight / 4 * np.sin(theta)
    x, z = across * np.cos(theta) - pull * np.sin(theta), across * np.sin(theta) + pull * np.cos(theta)
    assert np.ptp(np.hypot(x, z)) > weight
    errors = []
    for dt in (0.005, 0.0025, 0.00125):
        run = simulate_evenly(chain({"N": 1, "L": L, "rho": density, "theta0": [theta0]}, dt, end=0.5))
        found = run.anchor_force.values[np.rint(times / dt).astype(int)] / weight
        assert np.all(found[:, 1] == 0)
        errors.append(found[:, [0, 2]] - np.column_stack([x, z]) / weight)
    assert np.abs(errors[-1][0]).max() < 1e-5  # at release
    converges([np.abs(e[1:]).max() for e in errors])
    assert np.abs(2 * errors[-1] - errors[-2]).max() < 5e-4


def test_force_that_holds_a_hanging_chain():
    """At rest its whole weight, whatever the elements."""
    for elements in (1, 3):
        scene = chain({"N": elements, "L": 3.0, "rho": 2.0, "theta0": [0.0] * elements}, 0.01, end=0.05)
        found = simulate_evenly(scene).anchor_force.values
        weight = np.tile([0.0, 0.0, 3.0 * 2.0 * 9.81], (6, 1))
        assert found[1:] == pytest.approx(weight[1:], rel=1e-9, abs=1e-9)
        assert found[0] == pytest.approx(weight[0], rel=1e-6, abs=1e-9)  # from tiny steps


@pytest.mark.parametrize(("name", "steps"), [("2rods_45_0", (400, 800, 1600)), ("3rods_90", (400, 800, 1600))])
def test_chain_of_rods(name, steps):
    """Nodes and tensions of two and three rods at t = 0.25 s, to first order and in their limit."""
    case = RODS[name]
    row = next(row for row in case["table"] if row["t"] == 0.25)
    nodes, tension = np.array(row["nodes"]), np.array(row["T"])
    position, pull = [], []
    for count in steps:
        scene = merged(chain(case, 0.25 / count, end=0.25), time__output_every=0.25)
        run = simulate_evenly(scene)
        assert np.abs(run.cable_position.values[..., 1]).max() == 0.0
        position.append(run.cable_position.values[-1][:, [0, 2]])
        pull.append(run.cable_tension.values[-1])
    converges([np.abs(r - nodes).max() for r in position])
    converges([np.abs(T - tension).max() for T in pull])
    assert np.abs(2 * position[-1] - position[-2] - nodes).max() < 1e-5
    assert np.abs(2 * pull[-1] - pull[-2] - tension).max() < 1e-3 * tension.max()


def rod_and_buoy(dt, end):
    """Reference cylinder on a rod 19.5 m long, tilted by two degrees, buoy upright, at rest; no fluid coefficients."""
    p, theta = RODS["rod_plus_buoy"]["params"], np.radians(RODS["rod_plus_buoy"]["theta0_deg"])
    diameter = np.sqrt(4 * (p["rho0"] - p["w_sub"] / 9.81) / (np.pi * 1025))
    center = (400 * 0.5 + 150 * 2 + 150 * 3) / 700
    return {
        "sea": {"depth": p["depth"]},
        "cable": {"length": p["L"], "line_density": p["rho0"], "diameter": diameter, "elements": 1},
        "buoy": {
            "hull": [[0.0, 2.4], [1.2, 2.4]],
            "mass": 400.0,
            "center_of_mass": 0.5,
            "inertia": [192.0, 288.0],
            "point_masses": [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 3.0}],
        },
        "initial": {
            "kind": "straight",
            "buoy_position": [p["L"] * np.sin(theta), 0.0, p["L"] * np.cos(theta) - p["depth"] + center],
        },
        "time": {"end": end, "step": dt, "output_every": dt},
    }


def test_rod_and_buoy():
    """A coupled exact ODE: positions, tilt, tension and force on the buoy, to first order and in the limit."""
    table = {row["t"]: row for row in RODS["rod_plus_buoy"]["table"]}
    errors, values = [], []
    for dt in (0.01, 0.005, 0.0025):
        run = simulate_evenly(rod_and_buoy(dt, end=1.0))
        at = [round(t / dt) for t in table]
        axis = np.array([rotation_matrix(q)[:, 2] for q in run.buoy_orientation.values[at]])
        values.append(
            np.column_stack(
                [
                    run.mooring_point.values[at] + [0, 0, 20],
                    run.buoy_position.values[at] + [0, 0, 20],
                    np.degrees(np.arctan2(axis[:, 0], axis[:, 2])),
                    run.mooring_force.values[at],
                    run.cable_tension.values[at, 0],
                ]
            )
        )
        names = ("r_O", "r_C", "phi_deg", "T_O", "T_P0")
        exact = np.array([np.hstack([row[name] for name in names]) for row in table.values()])
        assert values[-1].shape == exact.shape
        errors.append(values[-1] - exact)
    size = np.maximum(np.abs(exact).max(axis=0), [1e-9])
    first = np.abs(np.array(errors)).max(axis=1)
    for column, name in ((0, "x of O"), (3, "x of C"), (6, "tilt"), (7, "T_O,x"), (9, "T_O,z"), (10, "T")):
        found = rates(first[:, column])
        assert np.all(np.abs(found - 1) < 0.12), f"{name}: rates {found}"
    limit = 2 * errors[-1] - errors[-2]
    moving = np.abs(exact).max(axis=0) > 0
    assert np.all(np.abs(limit[:, ~moving]) < 1e-9)
    assert np.abs(limit[:, moving] / size[moving]).max() < 3e-3


def test_rod_and_buoy_at_release():
    """Tension and force on the buoy at t = 0, which no rest position gives."""
    run = simulate_evenly(rod_and_buoy(0.001, end=0.001))
    case = RODS["rod_plus_buoy"]
    assert run.tension_anchor.values[0] == pytest.approx(case["T_P0_at_0"], rel=1e-4)
    assert run.mooring_force.values[0] == pytest.approx(case["T_O_at_0"], abs=1e-4 * case["T_P0_at_0"])
