"""Inf-sup constants against a separate code, numpy with other bases, and theory.

Source: a separate code (tests/reference), numpy with other bases, theory.
"""

import json
import math

import numpy as np
import pytest
from helpers import reference
from numpy.polynomial import legendre
from scipy.integrate import quad

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.studies.accuracy import inf_sup
from dolfbuoy.studies.study import run

REFERENCE = reference("inf_sup")
PAIRS = [(int(name[1]), int(name[3])) for name in REFERENCE["catenary"]["discrete"]]
STABLE = [(mu, nu) for mu, nu in PAIRS if nu < mu]
STATES = ("catenary", "folded", "straight")
SIZES = (4, 8, 16)
GAUSS_LOBATTO = {1: [], 2: [0.0], 3: [-(5**-0.5), 5**-0.5], 4: [-((3 / 7) ** 0.5), 0.0, (3 / 7) ** 0.5]}


@pytest.fixture(scope="module")
def rows():
    """Everything for all states, pairs and sizes of this file."""
    cases = inf_sup.cases(STATES, PAIRS, SIZES)
    return [case | inf_sup.evaluate(case) for case in cases]


def select(rows, state, pair):
    return [row for row in rows if row["state"] == state and (row["mu"], row["nu"]) == pair]


def numpy_constants(position, mu, nu, elements, fixed):
    """All beta in orthonormal Legendre bases of w' and q: no element, no form and no factorisation in common.

    w' is any piecewise P_(mu-1); a fixed end leaves those of mean zero.
    """
    h = 1 / elements
    nodes = np.array([-1.0, *GAUSS_LOBATTO[mu], 1.0])
    x, weights = legendre.leggauss(mu + nu + 2)
    basis = np.column_stack([math.sqrt((2 * k + 1) / h) * legendre.legval(x, [0] * k + [1]) for k in range(nu + mu)])
    G = np.zeros((elements, nu + 1, elements, 3, mu))
    for e in range(elements):
        r = np.linalg.solve(legendre.legvander(nodes, mu), position(h * (e + (nodes + 1) / 2)))
        slope = legendre.legval(x, legendre.legder(r)) * 2 / h
        G[e, :, e] = np.einsum("x,xq,ix,xw->qiw", weights * h / 2, basis[:, : nu + 1], slope, basis[:, :mu])
    G = G.reshape(elements * (nu + 1), elements, 3, mu)
    if fixed:
        G[..., 0] -= G[..., 0].mean(axis=1, keepdims=True)
    beta = np.linalg.svd(G.reshape(len(G), -1), compute_uv=False)
    return np.sort(np.concatenate([beta, np.zeros(len(G) - len(beta))]))


@pytest.mark.parametrize("state", REFERENCE)
@pytest.mark.parametrize("pair", PAIRS)
def test_constants_of_the_reference(rows, state, pair):
    for row in select(rows, state, pair):
        if row["elements"] == 8:
            continue
        for key, expected in REFERENCE[state]["discrete"]["P{}P{}".format(*pair)][str(row["elements"])].items():
            # the reference takes square roots of eigenvalues: its zeros are 1e-8
            tolerance = 1e-10 if expected > 1e-6 else 1e-7
            assert row[key] == pytest.approx(expected, rel=0, abs=tolerance), (key, row["elements"])


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("pair", PAIRS)
def test_constants_in_other_bases(rows, state, pair):
    for row in select(rows, state, pair):
        for end in ("dir", "free"):
            beta = numpy_constants(inf_sup.STATES[state].position, *pair, row["elements"], fixed=end == "dir")
            assert row[f"beta_{end}"] == pytest.approx(beta[0], rel=1e-8, abs=1e-13)
            assert row[f"n_zero_{end}"] == (beta < 1e-13).sum()


def test_matrices_are_those_of_the_norms():
    A, B, M, s = inf_sup.newton_matrix("straight", 2, 1, 3)
    direction = np.array([0.6, 0.0, 0.8])
    w = (s.reshape(-1, 3) ** 2 * direction).ravel()  # w' = 2 s d
    assert w @ A @ w == pytest.approx(4 / 3, rel=1e-13)  # |w'|^2
    ones = np.ones(len(M))
    assert ones @ M @ ones == pytest.approx(1, rel=1e-13)  # |1|^2
    assert ones @ B @ w == pytest.approx(1, rel=1e-13)  # (1, r'.w')
    np.testing.assert_allclose(A, A.T, atol=1e-13)


def test_constant_of_the_cable_itself():
    assert inf_sup.continuous_constant("catenary", "dir") == pytest.approx(
        REFERENCE["catenary"]["continuous_dir"], rel=1e-11
    )
    assert inf_sup.continuous_constant("straight", "dir") == 0
    assert all(inf_sup.continuous_constant(state, "free") == 1 for state in STATES)
    shape = inf_sup.STATES["folded"]

    def mean(f):
        return quad(lambda s: f(2 * math.atan2(shape.vertical(s), shape.H)), 0, 1, points=[-shape.V0], limit=400)[0]

    largest = (1 + math.hypot(mean(math.cos), mean(math.sin))) / 2  # of the mean of t t^T, by the double angle
    assert inf_sup.continuous_constant("folded", "dir") == pytest.approx(math.sqrt(1 - largest), rel=1e-6)


@pytest.mark.parametrize("pair", STABLE)
def test_stable_pairs_tend_to_the_cable_itself(rows, pair):
    radius = inf_sup.STATES["catenary"].H  # w = 1: the smallest radius of curvature is H/w
    found = select(rows, "catenary", pair)
    gaps = [abs(row["beta_dir"] - row["continuous_dir"]) for row in found]
    assert gaps[2] < gaps[1] / 3 < gaps[0] / 9  # order 2 at least
    for row in found:
        assert row["beta_free"] > math.sqrt(1 - (row["h"] / (2 * radius)) ** 2)


def test_verdicts(rows):
    for state in STATES:
        for mu, nu in PAIRS:
            for end in ("dir", "free"):
                word, order = inf_sup.verdict(select(rows, state, (mu, nu)), end)
                if nu < mu:
                    assert word == "stable", (state, mu, nu, end)
                elif state == "straight" or nu > 2 * mu - 2:
                    assert word == "spurious"
                else:
                    assert word == "decays"
                    assert order == pytest.approx(1, abs=0.25)  # nu = mu: O(h)


def test_stable_pairs_keep_away_from_zero_on_a_fold_they_do_not_resolve(rows):
    for pair in STABLE:
        found = select(rows, "folded", pair)
        assert min(row["beta_free"] for row in found) > 0.15
        assert min(row["beta_dir"] / row["continuous_dir"] for row in found) > 0.5


def test_words_name_the_pairs(rows):
    stable, unstable, *_ = inf_sup.notes(rows)
    assert all(f"P{mu}-P{nu}" in (stable if nu < mu else unstable) for mu, nu in PAIRS)
    assert all(f"P{mu}-P{nu}" not in (unstable if nu < mu else stable) for mu, nu in PAIRS)


def test_study_covers_what_it_claims():
    assert {(mu, nu) for mu, nu in inf_sup.PAIRS if nu < mu} == {(m, n) for m in range(1, 5) for n in range(m)}
    assert {(k, k) for k in range(1, 5)} < set(inf_sup.PAIRS)
    assert any(nu > mu for mu, nu in inf_sup.PAIRS)


@pytest.mark.parametrize("pair", [(1, 1), (2, 3)])
def test_a_scene_refuses_the_counter_examples(pair):
    cable = {"length": 1.0, "line_density": 1.0, "position_degree": pair[0], "tension_degree": pair[1]}
    with pytest.raises(InputError, match="unstable"):
        load_scene({"cable": cable | {"top": {"kind": "free"}}})


def test_files(tmp_path, monkeypatch, capsys):
    cases = inf_sup.cases(("catenary", "straight"), [(1, 0), (1, 1), (2, 2)], (4, 8))
    monkeypatch.setattr(inf_sup, "cases", lambda: cases)
    run(inf_sup.study, tmp_path)
    written = json.loads((tmp_path / "inf-sup.json").read_text())
    assert len(written["rows"]) == len(cases)
    for name in ("inf-sup.csv", "inf-sup.png", "inf-sup.svg", "inf-sup-summary.csv"):
        assert (tmp_path / name).stat().st_size > 100
    assert "Stable at every state and both kinds of end: P1-P0." in capsys.readouterr().out


def test_mean_of_tangents_along_a_line():
    shape = inf_sup.STATES["catenary"]
    tangent = lambda s: np.array([shape.H, shape.vertical(s)]) / shape.tension(s)  # noqa: E731
    mean = [[quad(lambda s, i=i, j=j: tangent(s)[i] * tangent(s)[j], 0, 1)[0] for j in (0, 1)] for i in (0, 1)]
    np.testing.assert_allclose(inf_sup.mean_tangent_product(shape), mean, atol=1e-9)
