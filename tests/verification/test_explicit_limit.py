"""Largest eigenvalues of a cable against exact formulas and a separate code, and the resulting limits on steps.

Source: exact eigenvalues of chains, eigenvalues of a separate code (tests/reference), stability of computed steps.
"""

import json
import math

import numpy as np
import pytest
from helpers import reference
from verification import explicit_limit as study

from dolfbuoy.errors import InputError
from dolfbuoy.meshes import cable_nodes
from dolfbuoy.studies.study import run

REFERENCE = reference("explicit_limit")
KEYS = ("free_free", "fixed_free", "fixed_fixed")
CABLE = {"length": 7.0, "elements": 4, "rho0": 3.0, "EA": 500.0}


def angle(end, n):
    return {"free_free": math.pi, "fixed_free": (2 * n - 1) * math.pi / (2 * n), "fixed_fixed": (n - 1) * math.pi / n}[
        end
    ]


@pytest.mark.parametrize("n", [1, 2, 3, 7, 20])
def test_linear_elements_have_the_exact_eigenvalues(n):
    found = study.eigenvalues({"degree": 1, "elements": n})
    for end in KEYS:
        if end == "fixed_fixed" and n == 1:
            assert found[end] is None
            continue
        c = math.cos(angle(end, n))
        assert found[end] == pytest.approx(6 * (1 - c) / (2 + c), rel=1e-12)
        assert found[f"{end}_lumped"] == pytest.approx(2 * (1 - c), rel=1e-12)


@pytest.mark.parametrize("degree", study.DEGREES)
def test_eigenvalues_of_the_reference(degree):
    for n, expected in REFERENCE["lambda"][str(degree)].items():
        found = study.eigenvalues({"degree": degree, "elements": int(n)})
        assert len(expected) >= 3
        for key, value in expected.items():
            assert found[key] == pytest.approx(value, rel=1e-10), (n, key)


def test_bound_of_every_degree():
    constants = [study.element_constant(k) for k in study.DEGREES]
    assert constants == pytest.approx([12, 60, 170.12490249604, 380.23513150933], rel=1e-12)
    per_node = [c / k**2 for c, k in zip(constants, study.DEGREES, strict=True)]
    assert per_node == sorted(per_node)  # higher degrees pay even for the same distance of nodes


@pytest.mark.parametrize("degree", study.DEGREES)
def test_bound_holds_on_a_graded_mesh_and_is_reached_by_no_other_element(degree):
    nodes = cable_nodes(7.0, 5, grading=6.0)
    K, M, s = study.matrices(nodes, degree, 3.0, 500.0)
    smallest, largest = np.diff(nodes).min(), np.diff(nodes).max()
    bound = study.element_constant(degree) * 500.0 / 3.0
    found = study.largest(K, M, s, "free-free")
    assert bound / largest**2 < found <= bound / smallest**2 * (1 + 1e-12)


@pytest.mark.parametrize(
    ("name", "key"), [("Sect. 4.1", "paper_example"), ("short", "short_case"), ("long", "long_case")]
)
def test_steps_of_the_paper(name, key):
    expected, cable = REFERENCE["dt_limits"][key], study.PAPER[name]
    found = study.steps({**cable, "lumped": False})
    assert found["H"] == pytest.approx(expected["H"])
    assert found["wave_speed"] == pytest.approx(expected["wave_speed"])
    assert [found["omega_12"], found["omega_bound"]] == pytest.approx([expected["omega_bound"]] * 2)
    assert 1 / found["omega_bound"] == pytest.approx(expected["dt_C1"])
    assert found["dt_central"] == pytest.approx(expected["dt_central_difference"])
    assert found["dt_RK4"] == pytest.approx(expected["dt_RK4"], rel=1e-6)
    assert found["steps_central"] == pytest.approx(0.01 / expected["dt_central_difference"])
    assert study.steps({**cable, "lumped": True})["dt_central"] == pytest.approx(expected["dt_lumped_CD"])
    held = study.steps({**cable, "end": "fixed-fixed", "lumped": False})
    assert held["omega_true"] == pytest.approx(expected["omega_true_fixed_fixed"], rel=1e-9)
    assert held["omega_true"] < found["omega_true"] < found["omega_bound"]


def central(K, x, v, dt):
    """Growth of the displacement over many steps of the central difference."""
    before, now = x - dt * v, x
    for _ in range(2000):
        before, now = now, 2 * now - before - dt**2 * K @ now
        if np.abs(now).max() > 1e6:
            return math.inf
    return np.abs(now).max()


def runge_kutta(K, x, v, dt):
    """The same over steps of the classical Runge-Kutta scheme."""
    zero, one = np.zeros_like(K), np.eye(len(K))
    A = dt * np.block([[zero, one], [-K, zero]])
    step = sum((np.linalg.matrix_power(A, k) / math.factorial(k) for k in range(1, 5)), np.eye(2 * len(K)))
    return np.abs(np.linalg.matrix_power(step, 2000) @ np.concatenate([x, v])).max()


@pytest.mark.parametrize(("scheme", "advance"), [("central", central), ("RK4", runge_kutta)])
@pytest.mark.parametrize("degree", [1, 3])
def test_steps_are_the_limit_of_stability(scheme, advance, degree):
    cable = {**CABLE, "grading": 1.0, "degree": degree, "end": "fixed-free", "step": None, "lumped": False}
    found = study.steps(cable)
    assert found[f"steps_{scheme}"] is None
    K, M, s = study.matrices(cable_nodes(7.0, 4), degree, 3.0, 500.0)
    keep = s > 0
    K = np.linalg.solve(M[np.ix_(keep, keep)], K[np.ix_(keep, keep)])
    x, v = np.random.default_rng(3).normal(size=(2, len(K)))
    limit = found[f"dt_true_{scheme}"]
    assert advance(K, x, v, 0.99 * limit) < 1e3
    assert advance(K, x, v, 1.01 * limit) > 1e6
    assert found[f"dt_{scheme}"] <= limit  # the bound is on the safe side


def test_shipped_scenes_have_the_numbers_of_the_paper():
    for name in ("short", "long"):
        cable = study.cable_of(name)
        assert {key: cable[key] for key in study.PAPER[name]} == study.PAPER[name]


def test_scenes_without_a_limit_are_refused():
    base = {"cable": {"length": 1.0, "line_density": 1.0, "top": {"kind": "free"}}}
    with pytest.raises(InputError, match="infinitely fast"):
        study.cable_of(base)
    with pytest.raises(InputError, match="cable: must be given"):
        study.cable_of("free-buoy")
    base["cable"] |= {"axial_stiffness": 4.0, "top": {"kind": "fixed", "position": [0.5, 0.0, 0.0]}}
    assert study.cable_of(base)["end"] == "fixed-fixed"


def test_files(tmp_path, monkeypatch, capsys):
    cases = study.cases
    monkeypatch.setattr(study, "cases", lambda cables: cases(cables, sizes=(1, 2), degrees=(1, 2)))
    run(study.study, tmp_path, cables={"short": study.cable_of("short")})
    rows = json.loads((tmp_path / "explicit-limit.json").read_text())["rows"]
    assert [row["element"] for row in rows] == ["P1", "P2", "P1 lumped"]
    assert [row["own"] for row in rows] == [True, False, False]
    assert (tmp_path / "eigenvalues.csv").stat().st_size > 100
    assert "45 or 32 explicit steps for one implicit step" in capsys.readouterr().out
