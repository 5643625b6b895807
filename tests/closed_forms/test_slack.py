"""The tension-only law: convex minimisation, free fall, the two-sided law in tension, and snap loads.

Source: convex minimisation with scipy, free fall by hand, the two-sided law where nothing is slack.
"""

import math

import alone
import numpy as np
import pytest
from dynamics_helpers import running
from helpers import reference
from scipy.optimize import minimize

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, NoResult
from dolfbuoy.results import parts
from dolfbuoy.results.summary import warnings
from dolfbuoy.statics.equilibrium import solve_equilibrium

INF = math.inf


def folded(elements, z, EA=INF, degrees=(1, 0), slack="tension-only", **cable):
    section = {"length": 1.0, "line_density": 1.0, "axial_stiffness": EA, "elements": elements, "slack": slack}
    section |= {"position_degree": degrees[0], "tension_degree": degrees[1]}
    section["top"] = {"kind": "fixed", "position": [0.01, 0.0, z]}
    return load_scene({"gravity": 1.0, "cable": section | cable})


def solution(scene):
    """(nodes in order, T in order) of the equilibrium."""
    problem = solve_equilibrium(scene)
    cable, u = problem.lines, problem.system.u
    r = u[cable.node_dofs[np.argsort(cable.node_s)]].copy()
    cells = np.argsort(cable.T_s.mean(axis=1))
    T = u[cable.T_dofs[cells]].copy()
    top = problem.end_tension()
    problem.destroy()
    return r, T, top


# -- statics -----------------------------------------------------------------------------------------------------------


def minimal_energy(elements, z, EA=INF):
    """Heights and x of the inner nodes that minimise the energy of a chain of weightless links whose ends carry the
    weight, links at most as long as they are (EA = inf) or elastic in tension only."""
    h, ends = 1.0 / elements, np.array([[0.0, 0.0], [0.01, z]])

    def stretch(x):
        nodes = np.vstack([ends[:1], x.reshape(-1, 2), ends[1:]])
        return np.linalg.norm(np.diff(nodes, axis=0), axis=1) / h

    def energy(x):
        strain = 0.0 if EA == INF else np.maximum(stretch(x) - 1, 0.0)
        elastic = 0.0 if EA == INF else 0.5 * EA * h * (strain**2).sum()
        return h * x[1::2].sum() + elastic

    start = (ends[0] + np.linspace(0, 1, elements + 1)[1:-1, None] * (ends[1] - ends[0]) * 0.9).ravel()
    if EA == INF:
        limits = [{"type": "ineq", "fun": lambda x: 1 - stretch(x) ** 2}]
        found = minimize(energy, start, method="SLSQP", constraints=limits, options={"ftol": 1e-15, "maxiter": 500})
    else:
        found = minimize(energy, start, method="BFGS", options={"gtol": 1e-10, "maxiter": 5000})
    return found.x.reshape(-1, 2), found.fun


@pytest.mark.parametrize("EA", [INF, 20.0])
@pytest.mark.parametrize(("elements", "z"), [(5, 0.8), (5, 0.99), (10, 0.99)])
def test_coarse_fold_is_the_minimum_of_a_convex_energy(elements, z, EA):
    """Too few elements for the fold: the lowest is slack, and no other state has less energy."""
    r, T, _ = solution(folded(elements, z, EA))
    nodes, lowest = minimal_energy(elements, z, EA)
    np.testing.assert_allclose(r[1:-1, [0, 2]], nodes, atol=2e-6)
    elastic = 0.0 if EA == INF else 0.5 / EA / elements * (T**2).sum()
    assert r[1:-1, 2].sum() / elements + elastic == pytest.approx(lowest, abs=1e-9)
    assert T.min() == 0.0 or EA == 20.0
    assert T.min() >= 0.0
    length = np.linalg.norm(np.diff(r, axis=0), axis=1) * elements
    slack = T[:, 0] == 0
    np.testing.assert_allclose(length[~slack], 1 + T[~slack, 0] / EA, rtol=1e-10)
    assert (length[slack] < 1).all()


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1), (2, 0), (3, 2)])
@pytest.mark.parametrize("EA", [INF, 5.0])
def test_laws_agree_in_tension(degrees, EA):
    """Where the two-sided law ends in tension its solution satisfies the other law: the same unknowns."""
    top = {"kind": "fixed", "position": [0.6, 0.0, 0.5]}
    states = [solution(folded(16, 0.5, EA, degrees, law, top=top)) for law in ("compressive", "tension-only")]
    assert states[0][1].min() > 0
    for two_sided, one_sided in zip(*states, strict=True):
        np.testing.assert_allclose(one_sided, two_sided, atol=1e-9)


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1), (2, 0), (3, 2), (4, 3)])
@pytest.mark.parametrize("elements", [5, 10, 20])
def test_no_state_is_compressed_and_the_ends_carry_the_weight(degrees, elements):
    r, T, top = solution(folded(elements, 0.99, degrees=degrees))
    assert T.min() >= 0
    assert np.abs(r[:, 0]).max() <= 0.01 * (1 + 1e-9)  # the two-sided law stands aside (verification/rising.py)
    assert top[2] == pytest.approx(0.995, abs=0.15)


@pytest.mark.parametrize(("degrees", "gain"), [((1, 0), 3.0), ((2, 1), 5.0)])
def test_unresolved_fold_is_nearer_than_with_compression(degrees, gain):
    """Error of r against the exact fold of depth 0.004, 10 elements."""
    from verification.slack import fold

    case = {"z_end": 0.99, "mu": degrees[0], "nu": degrees[1], "cells": 10}
    two, one = (fold(case | {"slack": law}) for law in ("compressive", "tension-only"))
    assert two["T_min"] < 0 <= one["T_min"]
    assert two["r_L2"] > gain * one["r_L2"]
    assert two["T_L2"] > one["T_L2"]


def test_jacobian_is_the_derivative_on_both_sides_of_the_maximum():
    """Directional differences at a state with slack and taut rows, away from the kink."""
    problem = solve_equilibrium(folded(6, 0.9, 20.0, (2, 1)))
    system, rng = problem.system, np.random.default_rng(3)
    system.u[:] += 0.05 * rng.standard_normal(system.size)
    system.u[problem.lines.T_dofs] += 2.0 * rng.standard_normal(problem.lines.T_dofs.shape)
    system.publish()
    u, free = system.u.copy(), system.order
    system.evaluate()
    slack = problem.law.slack.copy()
    assert 0 < slack.sum() < len(slack)
    system.assemble_jacobian()
    rows = system.A.getValues(range(len(free)), range(len(free)))
    direction, step = rng.standard_normal(len(free)), 1e-6
    values = []
    for sign in (1, -1):
        system.u[:] = u
        system.u[free] += sign * step * direction
        system.publish()
        values.append(system.evaluate()[free].copy())
        np.testing.assert_array_equal(problem.law.slack, slack)
    np.testing.assert_allclose(rows @ direction, (values[0] - values[1]) / (2 * step), rtol=1e-6, atol=1e-8)
    problem.destroy()


# -- dynamics ----------------------------------------------------------------------------------------------------------


def upside_down(slack, scheme="backward-euler", step=0.005, end=0.5):
    """One inextensible element stood on its anchor."""
    cable = {"length": 1.0, "line_density": 2.0, "elements": 1, "slack": slack, "top": {"kind": "free"}}
    initial = {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]}
    return {"cable": cable, "initial": initial, "time": {"end": end, "step": step, "scheme": scheme}}


def test_a_rope_stood_on_end_falls_freely_and_comes_taut():
    """Slack: mass/3 at the end under half the weight, 3/2 g exactly as backward Euler sums it; then it hangs."""
    step, g = 0.005, 9.81
    with running(upside_down("tension-only", step=step, end=2.0)) as simulation:
        z, T, drop = [], [], []
        for _ in simulation.run():
            u = simulation.system.u
            z.append(u[simulation.problem.lines.top_dofs()][2])
            T.append(u[simulation.problem.lines.T_dofs.ravel()][0])
    z, T, n = np.array(z), np.array(T), np.arange(1, len(z) + 1)
    falling = 1 - 1.5 * g * step**2 * n * (n + 1) / 2
    drop = falling > -1
    np.testing.assert_allclose(z[drop], falling[drop], atol=1e-7)
    assert np.abs(T[drop]).max() < 1e-6
    assert z.min() > -1 - 1e-9
    taut = np.argmax(~drop)
    speed = 1.5 * g * step * taut  # of the last free step; the impulse of T takes it away, with the weight's
    pulled = T[taut : taut + 100]
    assert pulled.sum() * step == pytest.approx(2.0 / 3 * speed + 2.0 * g / 2 * 100 * step, rel=1e-9)
    assert z[-1] == pytest.approx(-1, abs=1e-9)
    assert T[-1] == pytest.approx(2.0 * g / 2, rel=1e-6)


def test_two_sided_rope_stands_on_end():
    """The same start under the two-sided law is a rod in (unstable) equilibrium, compressed by half its weight."""
    record = alone.simulate(upside_down("compressive", end=0.05))
    np.testing.assert_allclose(record.tension_anchor[1:], -2.0 * 9.81 / 2, rtol=1e-6)


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2"])
def test_laws_agree_in_motion_in_tension(scheme):
    """Always taut: the same record, with the same iterations."""
    time = {"end": 1.0, "step": 0.02, "scheme": scheme}
    runs = [  # the tension-only law never keeps a Jacobian
        alone.simulate("driven", time=time, cable={"elements": 10, "slack": law}, solver={"keep_jacobian": False})
        for law in ("compressive", "tension-only")
    ]
    np.testing.assert_allclose(runs[1].tension_top, runs[0].tension_top, rtol=1e-8)
    np.testing.assert_array_equal(runs[1].newton_iterations, runs[0].newton_iterations)


def test_slack_cable_is_never_pushed():
    """driven-slack until after the first snaps: compressed by the two-sided law, T >= 0 by the other, same tension
    before the first slack."""
    runs = {}
    for law in ("compressive", "tension-only"):
        cable = {"elements": 10, "position_degree": 2, "tension_degree": 1, "slack": law}
        time = {"end": 13.0, "step": 0.02, "output_every": 0.02, "scheme": "backward-euler"}
        scene = load_scene("driven-slack", cable=cable, time=time)
        whole = dolfbuoy.simulate(scene)
        runs[law] = whole.squeeze()
        assert runs[law].attrs["failed_steps"] == 0
        said = " ".join(warnings(whole, scene))
        assert ("The cable was compressed at times" in said) == (law == "compressive")
    two, one = runs.values()
    assert float(two.tension_anchor.min()) < -100
    assert float(one.tension_anchor.min()) > -1e-3
    assert float(one.cable_tension.min()) > -1e-3
    first = int(np.argmax(two.cable_tension.values.min(axis=1) < 0))
    np.testing.assert_allclose(one.tension_top[: first - 1], two.tension_top[: first - 1], rtol=1e-2)


def test_only_who_asks_pays():
    from dolfbuoy.model.problem import Problem
    from dolfbuoy.solver.system import System

    problem = Problem(load_scene("driven"), dynamic=True)
    assert type(problem.system) is System
    problem.destroy()


def test_refusals():
    for change, says in (
        ({"cable.slack": "sometimes"}, "compressive"),
        ({"cable.slack": "tension-only", "time.scheme": "generalized-alpha"}, "spectral_radius"),
        ({"cable.damping": 1.0, "cable.axial_stiffness": INF}, "finite axial_stiffness"),
        ({"cable.damping": -1.0}, "greater than or equal to 0"),
    ):
        with pytest.raises(InputError, match=says):
            load_scene("driven", **change)
    scene = load_scene(
        "driven", **{"cable.slack": "tension-only", "time.scheme": "generalized-alpha"}, time__spectral_radius=0.0
    )
    assert scene.network.pieces[0].section.slack == "tension-only"


# -- snap loads --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_snap_loads_of_the_shipped_scene():
    """driven-slack as shipped: the largest top tension within 1 % of two independent programs, at most 160 elements."""
    scene = load_scene("driven-slack")
    assert scene.network.pieces[0].section.elements <= 160
    assert scene.network.pieces[0].section.damping == 0
    run = alone.simulate(scene)
    last = run.time > 40.0 - 1e-9
    expected = reference("driven")["A_slack"]
    assert float(run.tension_top[last].max()) == pytest.approx(expected["top_max"][0], rel=0.01)
    assert float(run.tension_anchor[last].max()) == pytest.approx(expected["anchor_max"][0], rel=0.02)


def test_study_writes_its_table_and_says_what_it_saw(tmp_path, monkeypatch, capsys):
    """A short version of the study: a coarse fold, and runs until just after the first snaps."""
    from verification import slack as study

    from dolfbuoy.studies.study import run

    monkeypatch.setattr(study, "FOLDED_CELLS", (10,))
    monkeypatch.setattr(study, "SNAP_CELLS", {(1, 0): (5,), (2, 1): (5,)})
    monkeypatch.setattr(study, "SNAP_STEPS", (("backward-euler", 0.05),))
    monkeypatch.setattr(study, "SNAP_COUNTS", 3.0)
    rows = run(study.study, tmp_path, t_end=13.0).rows["slack"]
    assert len(rows) == 2 * 4 + 4
    by_law = {row["slack"]: row for row in rows if row["kind"] == "snap" and row["mu"] == 2}
    assert by_law["compressive"]["T_min"] < -100
    assert by_law["tension-only"]["T_min"] >= 0
    assert all(abs(row["top_error"]) < 0.2 for row in by_law.values())
    assert (tmp_path / "slack.csv").stat().st_size > 1000
    said = capsys.readouterr().out
    assert "Folded: the two-sided law ends compressed in 3 cases" in said
    assert "Snap, tension-only: largest error at the top" in said


def ended(scene):
    """The record of a run, whether or not most of its steps were retried."""
    try:
        return alone.simulate(scene)
    except NoResult as error:
        return parts.alone(error.record)


@pytest.mark.parametrize(("elements", "force", "end"), [(2, 1e4, 1.0), (3, 10.0, 2.0)])
def test_a_damped_increment_is_no_sign_of_convergence(elements, force, end):
    """A chain thrown up in long steps: the line search damps much, and T >= 0, no element too long, all the same."""
    run = ended(
        {
            "cable": {
                "length": 1.0,
                "line_density": 1.0,
                "elements": elements,
                "slack": "tension-only",
                "top": {"kind": "free", "force": [0.0, 0.0, force]},
            },
            "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]},
            "time": {"step": 1.0, "end": end},
        }
    )
    chord = np.linalg.norm(np.diff(run.cable_position.values, axis=1), axis=-1) * elements
    assert run.cable_tension.values.min() >= -1e-9 * force
    assert chord.max() <= 1 + 1e-8
    assert chord[run.cable_tension.values > 1e-6 * force] == pytest.approx(1.0, abs=1e-8)
