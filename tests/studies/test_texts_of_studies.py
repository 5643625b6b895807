"""Tables, sentences and figures of studies, from made-up rows.

Source: the same numbers by hand; nothing is run.
"""

import pytest
from matplotlib.figure import Figure

from dolfbuoy.results import measured as acc
from dolfbuoy.studies import hard_cases
from dolfbuoy.studies.accuracy import inf_sup
from dolfbuoy.studies.accuracy import report_text as text
from dolfbuoy.studies.physics import effects

NAMES = ("tension_top", "buoy_position")


def row(effect, changes, most=(0.0, 0.0), mode="without", reason=None):
    """A row of the study of effects; changes and most: of NAMES."""
    found = {"effect": effect, "mode": mode, "reason": reason, "step_time": 3e-3, "base_step_time": 2.5e-3}
    found |= {f"change_{n}": x for n, x in zip(NAMES, changes, strict=True)}
    found |= {f"max_change_{n}": x for n, x in zip(NAMES, most, strict=True)}
    found |= {"unknowns": 30, "base_unknowns": 33, "operations": 120, "base_operations": 100}
    return found | {"forms": 4, "base_forms": 4, "time_ratio": 1.2}


ROWS = [
    row("waves", (0.5, 0.02), (0.4, 0.6)),
    row("wind", (0.002, 0.01), (0.001, 0.03)),
    row("growth", (0.0, 0.00001), (0.0, 0.0)),
    row("buoyancy", (0.0, 0.0), reason="it sinks."),
    row("waves", (0.7, 0.1), mode="alone"),
    row("both", (0.005, 0.004), mode="together"),
]


def test_what_a_scene_needs():
    """The larger of all changes against the threshold; what cannot be left out is needed."""
    assert effects.largest(ROWS[1], NAMES) == (0.01, "buoy_position")
    assert effects.largest(ROWS[0], NAMES, "max_change_") == (0.6, "buoy_position")
    assert effects.judge(ROWS, NAMES, 0.01) == (["waves", "buoyancy"], ["wind", "growth"])
    assert effects.judge(ROWS, NAMES, 0.009) == (["waves", "wind", "buoyancy"], ["growth"])
    top, position = (acc.QUANTITIES[name] for name in NAMES)
    said = effects.notes(ROWS, NAMES, 0.01)
    assert said[0] == f"For 1 % this scene needs: waves ({top} 50 %), buoyancy (without it: it sinks)."
    assert said[1] == f"For 1 % this scene pays in vain for: wind ({position} 1 %), growth ({position} 0.001 %)."
    assert said[2] == f"But wind moves the maximum of {position} by 3 %."
    assert said[3] == (f"Without all of these at once: {top} changes by 0.5 %; a step takes 120 % of its time.")
    loud = [*ROWS[:-1], row("both", (0.05, 0.004), mode="together")]
    assert ", together they count; a step" in effects.notes(loud, NAMES, 0.01)[3]


def test_rows_of_the_study_of_effects():
    """Changes in per cent, differences of what a step costs; what changes most comes first, behind the impossible."""
    shown = effects._shown(ROWS[1], NAMES)
    assert shown["tension_top"] == "0.2 / 0.1"
    assert shown["buoy_position"] == "1 / 3"
    assert (shown["unknowns"], shown["operations"], shown["forms"]) == ("-3", "+20", "+0")
    assert shown["time"] == "+0.50 (+20 %)"
    assert [effects._share(x) for x in (0.0, 0.00009, 0.12345, 99.9, 100.0)] == ["0", "<0.01", "12", "10000", ">9999"]
    tables = effects.questions(ROWS, NAMES)
    order = [line["effect"] for line in tables[0].rows]
    assert order == ["buoyancy", "waves", "wind", "growth", "all in vain at once"]
    assert tables[0].rows[0]["tension_top"] == "impossible"
    assert [line["effect"] for line in tables[2].rows] == ["waves"]


def test_schemes_and_extremes_in_the_report():
    """Seconds with the step that needs them; differences in per cent of the range of the finer run."""
    found = {"seconds": 12.34, "note": "extrapolated", "size": 0.0267, "per_period": 80.0}
    lines = [{"name": "BDF2", "scheme": "bdf2", "order": 2.0, "at_paper_step": 0.0123, "0.01": found, "0.001": None}]
    scene = {"name": "short", "schemes": lines, "rows": [{"own": False, "step": 1.0}, {"own": True, "step": 0.05}]}
    shown = text._schemes(scene)
    assert "| error at dt 0.05 s |" in shown
    assert "| 1.2 % | 12 s (extrapolated), dt 0.027 s | not reached |" in shown
    extreme = {"quantity": "top tension", "unit": "N", "largest_own": 5100.0, "largest_second": 5000.0}
    extreme |= {"smallest_own": 900.0, "smallest_second": 1000.0, "range_second": 4000.0}
    shown = text._extremes(scene | {"whole": (60.0, 0.01), "extremes": [extreme]})
    assert "| largest top tension | 5.1 kN | 5 kN | +2.50 % |" in shown
    assert "| smallest top tension | 0.9 kN | 1 kN | -2.50 % |" in shown
    assert (
        "`short` until 60 s on its own elements: backward Euler at dt 0.05 s and generalized-alpha at dt 0.01 s"
        in shown
    )
    words = text._of_all(scene, "schemes", 0.01)
    assert words == "`short`, 1 % in time alone: BDF2 12 s (extrapolated) at dt 0.027 s (80 steps per period)."
    assert text._of_all(scene, "schemes", 0.001) == ""


def test_cases_are_chosen_by_how_their_names_begin(tmp_path, monkeypatch):
    body = '"""Asked.  Must show: that."""'
    names = ("cable_slack", "slack_cable", "other")
    (tmp_path / "test_hard_x.py").write_text("".join(f"def test_{n}():\n    {body}\n\n\n" for n in names))
    (tmp_path / "pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["slow: or not"]\n')
    monkeypatch.setattr(hard_cases, "TESTS", tmp_path)
    assert [case["name"] for case in hard_cases.cases(only="slack")] == ["slack-cable"]
    assert len(hard_cases.cases()) == 3
    assert (hard_cases.cases()[0]["asked"], hard_cases.cases()[0]["must_show"]) == ("Asked", "that")


@pytest.mark.parametrize(("mu", "nu", "line"), [(2, 1, "-"), (2, 2, "--"), (1, 2, ":")])
def test_lines_of_inf_sup_tell_the_pairs(mu, nu, line):
    """Solid where T is of a lower degree; a zero is a cross at the floor."""
    rows = [{"mu": mu, "nu": nu, "h": h, "reduced_low": 0.1 * h, "continuous_low": 0.4} for h in (1.0, 0.5)]
    axes = Figure().subplots()
    inf_sup._draw(axes, rows, "low")
    whole, drawn = axes.lines
    assert drawn.get_linestyle() == line
    assert drawn.get_xydata().tolist() == [[1.0, 0.1], [0.5, 0.05]]
    assert set(whole.get_ydata()) == {0.4}
    axes = Figure().subplots()
    inf_sup._draw(axes, [one | {"reduced_low": 0.0} for one in rows], "low")
    assert (axes.lines[1].get_marker(), set(axes.lines[1].get_ydata())) == ("x", {inf_sup.FLOOR})
