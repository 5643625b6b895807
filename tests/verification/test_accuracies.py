"""Requested accuracies are reached against converged values, at no more than 2.5 times the cost of the last run.

Source: made-up rows; runs with another element pair, a quarter of the step and twice the elements.
"""

import pytest
from verification import accuracies


def test_the_least_accurate_output_counts():
    """Its numbers in percent, and the cost of all runs over the last."""
    rows = [
        {"output": "anchor.max", "of": "cable", "error": 0.004, "own": 0.001, "bar": 0.006, "verdict": "resolved"},
        {"output": "cone_angle.max", "of": "", "error": 0.009, "own": 0.002, "bar": 0.005, "verdict": "resolved"},
    ]
    found = {"rows": rows, "refused": None, "settings": "S", "seconds": 6.0, "last": 3.0}
    line = accuracies.judged("x", found)
    assert (line["worst"], line["said"], line["cost"]) == ("cone_angle.max", "reached", 2.0)
    assert (line["error_percent"], line["own_percent"], line["bar_percent"]) == pytest.approx((0.9, 0.2, 0.5))
    assert accuracies.judged("x", found | {"refused": "1 % was not reached"})["said"] == "1 % was not reached"


@pytest.mark.slow
@pytest.mark.parametrize("only", ["driven", "three-legs", "chain-on-bed"])
def test_what_was_asked_for(tmp_path, only):
    (line,) = accuracies.study(tmp_path, only)[0].rows
    assert line["said"] == "reached"
    assert line["error_percent"] < 100 * accuracies.ACCURACY
    assert line["cost"] < 1.2 * accuracies.COST  # seconds of a machine that is busy
