"""The study of Fig. 5: numbers of a separate code, continuation, conclusions.

Source: a separate numpy code (tests/reference), the folded catenary in closed form.
"""

import json
import math

import matplotlib
import numpy as np
import pytest
from figure_helpers import nothing_overlaps
from scipy.integrate import quad
from verification import rising as study

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.results.style import STYLE
from dolfbuoy.studies.study import run

#: From a separate numpy code: state at z = 0.99 after 19 steps (T_min, T_max, x_max, z_min, |x - exact|, energy).
AT_END = {
    (1, 0, 10): (-0.023562941785, 0.878597218163, 0.041325795903, 0.0, 0.0337043508980, 0.49067503506),
    (2, 0, 5): (0.229659456874, 1.023873011911, 0.01, 0.0, 0.005829483, 0.48527498122),
    (1, 0, 20): (-0.008689318836, 0.942972398972, 0.029297646389, 0.0, 0.022432322716, 0.49030270915),
    (2, 0, 20): (0.0267784390997, 0.972570523443, 0.01, -0.00012033390, 0.004226967, 0.48951169564),
}
AT_START = {(1, 0, 10): (0.0475246794280, 0.852504707905), (2, 0, 5): (0.0578526049881, 0.805276358881)}
TENSIONS = {
    (1, 0, 10): [-0.023562941785408357, 0.0791445720528398, 0.1788085969557162, 0.27871341088135027]
    + [0.3786684783091418, 0.47864231689728987, 0.5786251969838943, 0.6786131222165506]
    + [0.7786041489128732, 0.8785972181632402],
    (2, 0, 5): [0.22965945687432707, 0.4261884392244737, 0.6249237596102225, 0.82427108703518, 1.0238730119106272],
}
NODES = {
    (1, 0, 10): [(0, 0), (0.04132579590289398, 0.09106140012646606), (0.029022269611218007, 0.19030163007778186)],
    (2, 0, 5): [(0, 0), (0.004150593148655384, 0.19353246064111704), (0.006387216389682429, 0.39167617367110136)],
}
KEYS = ("smallest_tension", "largest_tension", "x_max", "z_min", "deviation_x", "potential_energy")
#: The other code looked at fewer points of a curved element.
SAMPLED = {"x_max": 1e-6, "z_min": 2e-7, "deviation_x": 3e-6}


@pytest.fixture(scope="module")
def computed():
    pairs = {pair: dict(zip(("mu", "nu", "cells"), pair, strict=True)) for pair in AT_END}
    return {pair: case | study.evaluate(case | {"stages": study.STAGES}) for pair, case in pairs.items()}


@pytest.mark.parametrize("pair", AT_END)
def test_last_state_equals_that_of_another_code(computed, pair):
    last = computed[pair]["states"][-1]
    for key, expected in zip(KEYS, AT_END[pair], strict=True):
        tolerance = SAMPLED.get(key, 1e-8) if pair[0] > 1 else 1e-8
        assert math.isclose(last[key], expected, rel_tol=1e-8, abs_tol=tolerance), key
    assert last["x_min"] == pytest.approx(0, abs=1e-15)
    if pair in TENSIONS:
        np.testing.assert_allclose(last["tensions"], TENSIONS[pair], atol=1e-10)


@pytest.mark.parametrize("pair", AT_START)
def test_first_state_and_nodes_equal_those_of_another_code(computed, pair):
    first, last = computed[pair]["states"][0], computed[pair]["states"][-1]
    np.testing.assert_allclose([first["smallest_tension"], first["largest_tension"]], AT_START[pair], rtol=1e-9)
    curves = last["curves"]
    ends = slice(0, 3 * len(study.XI), len(study.XI))
    np.testing.assert_allclose(list(zip(curves["x"][ends], curves["z"][ends], strict=True)), NODES[pair], atol=1e-9)


def test_what_the_paper_did_not_say(computed):
    """P1-P0 stands aside, compressed; P2-P0 stays in place but carries 2.4 times the right tension."""
    (rods, bends) = (computed[pair] for pair in study.PAPER)
    ratio = bends["states"][-1]["tensions"][0] / bends["states"][-1]["exact_tensions"][0]
    assert math.isclose(ratio, 2.41, abs_tol=0.01)
    said = study.in_words(rods)
    assert "10 P1-P0: COMPRESSED at z = 0.85" in said[1]
    assert "-0.0236" in said[0]
    assert "where the exact cable keeps to x <= 0.01" in said[0]
    (sentence,) = study.in_words(bends)
    assert "2.4 times the right one (0.0952)" in sentence
    assert "as the exact cable" in sentence
    states = [row["state"] for row in study.stage_rows(rods)]
    assert states == ["in tension"] + 4 * ["compressed"]


def test_exact_folded_catenary():
    """Numbers of the reference for the exact cable with its end at z = 0.99."""
    exact = study.exact_cable(0.99)
    lowest = -exact.V0
    assert math.isclose(exact.H, 0.0010128613785889958, rel_tol=1e-10)
    assert math.isclose(exact.tension(0), 0.005051549512106957, rel_tol=1e-10)
    assert math.isclose(exact.tension(1), 0.995051549512107, rel_tol=1e-12)
    depth = 0.005051549512106957 - 0.0010128613785889958
    assert math.isclose(exact.position(np.array([lowest]))[0, 2], -depth, rel_tol=1e-10)
    mean, _ = quad(exact.tension, 0, 0.2, points=[lowest], epsabs=1e-13)
    assert math.isclose(study.mean_tension(exact, 0.0, 0.2), mean / 0.2, rel_tol=1e-10)


class Stubborn:
    """A problem whose Newton fails if the end moves by more than `reach`."""

    def __init__(self, reach):
        self.system = self.lines = self.newton = self
        self.reach, self.u = reach, np.array([0.01, 0.0, 0.8])
        self.solved = [0.8]

    def top_dofs(self):
        return np.arange(3)

    def solve(self):
        if self.u[2] - self.solved[-1] > self.reach:
            self.u[2] = np.nan
            raise SolveError("too far")
        self.solved.append(float(self.u[2]))


def test_step_is_halved_until_newton_converges():
    problem = Stubborn(reach=0.003)
    assert study.raise_end(problem, 0.8, 0.81) == 2
    assert problem.solved[-1] == 0.81
    np.testing.assert_allclose(np.diff(problem.solved)[:4], 0.0025)


def test_hopeless_continuation_ends_with_the_solvers_error():
    with pytest.raises(SolveError, match="too far"):
        study.raise_end(Stubborn(reach=1e-7), 0.8, 0.81)


def test_study_writes_table_profiles_and_figure_and_resumes(tmp_path, monkeypatch, capsys):
    rows = run(study.study, tmp_path, extra=((4, 1, 3),)).rows["rising"]
    assert [row["discretisation"] for row in rows[:: len(study.STAGES)]] == ["10 P1-P0", "5 P2-P0", "3 P4-P1"]
    assert math.isclose(rows[-1]["smallest_tension"], -0.0351909925, rel_tol=1e-6)
    saved = json.loads((tmp_path / "rising.json").read_text())
    assert saved["rows"] == rows
    assert any("2.4 times" in note for note in saved["notes"])
    elements = json.loads((tmp_path / "rising-elements.json").read_text())["rows"]
    assert len(elements) == len(study.STAGES) * (10 + 5 + 3)
    for name in ("rising.png", "rising.svg", "rising.csv", "rising-elements.csv", "rising-profiles.csv"):
        assert (tmp_path / name).stat().st_size > 1000, name
    monkeypatch.setattr(study, "evaluate", None)
    monkeypatch.setattr(study, "draw", lambda computed: None)
    assert run(study.study, tmp_path, extra=((4, 1, 3),)).rows["rising"] == rows
    assert "compressed" in capsys.readouterr().out


def test_options():
    assert study.parse_pair(None, None) == ()
    assert study.parse_pair("2,1", 7) == ((2, 1, 7),)
    assert study.parse_pair("3,0", None) == ((3, 0, 3),)
    assert len(study.cases(((1, 0, 10),))) == 2  # the paper's own
    for pair, cells, says in (
        (None, 5, "--pair: must be given"),
        ("2", 5, "degrees"),
        ("2,2", 5, "lower"),
        ("2,0", 0, "positive"),
    ):
        with pytest.raises(InputError, match=says):
            study.parse_pair(pair, cells)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_figure_with_any_number_of_discretisations(computed, number):
    """Every curve is that of its state, and no title or legend is cut or lies on another."""
    cases = list(computed.values())[:number]
    with matplotlib.rc_context(STYLE):
        figure = study.draw(cases)
    above = figure.axes[:number]
    for case, axes in zip(cases, above, strict=True):
        curves = {line.get_label(): line.get_data() for line in axes.lines}
        for state in case["states"]:
            drawn = curves[f"end at z = {state['z_end']:.2f}"]
            np.testing.assert_array_equal(drawn, [state["curves"]["x"], state["curves"]["z"]])
    assert nothing_overlaps(figure)
