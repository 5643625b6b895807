"""Resolution required at a touchdown, and the effect of friction laws.

Source: the closed form at rest; friction with and without memory.
"""

import pytest
from helpers import reference
from verification import touchdown as study

from dolfbuoy.errors import InputError
from dolfbuoy.studies.study import run

VALUES = reference("bed_and_networks")["cases"]["bed_chain100_frictionless"]["values"]


@pytest.fixture
def few(monkeypatch):
    """Two sizes of each kind, a short rest, and a finest run that is not too fine."""
    monkeypatch.setattr(study, "PAIRS", ((1, 0), (2, 1)))
    monkeypatch.setattr(study, "ELEMENTS", (14, 40))
    monkeypatch.setattr(study, "FINEST", study.Space(2, 1, 80))
    monkeypatch.setattr(study, "STEPS", (25, 100))
    monkeypatch.setattr(study, "MOST_STEPS", 400)
    monkeypatch.setattr(study, "STEPPED", study.Space(2, 1, 40))
    monkeypatch.setattr(study, "REST", 20.0)
    return study.request("chain-on-bed", 20.0)


@pytest.mark.slow
def test_touchdown(few, tmp_path):
    tables = run(study.study, tmp_path, **few).rows
    elements = {(row["pair"], row["elements"]): row for row in tables["touchdown-elements"]}
    assert abs(elements["P1-P0", 14]["static_top"]) > 0.01 > abs(elements["P2-P1", 14]["static_top"])
    assert elements["P2-P1", 40]["top"] < elements["P2-P1", 14]["top"]
    steps = {(row["scheme"], row["step"]): row for row in tables["touchdown-steps"]}
    assert steps["bdf2", 0.1]["top"] < steps["backward-euler", 0.1]["top"]
    assert steps["bdf2 damped", 0.1]["top"] < steps["bdf2", 0.1]["top"]
    laws = {row["law"]: row for row in tables["touchdown-laws"]}
    at_rest = VALUES["T_anchor"]
    assert laws["none"]["static_anchor_N"] == pytest.approx(at_rest, rel=2e-3)
    assert laws["pulled at the start"]["static_anchor_N"] < 0.02 * at_rest
    swing = {law: row["anchor_peak_N"] - row["anchor_least_N"] for law, row in laws.items()}
    assert swing["stick length / 10"] < swing["spring and slider"] < 0.9 * swing["none"]
    assert swing["by velocity"] == pytest.approx(swing["none"], rel=0.1)
    assert laws["none"]["top_peak_N"] == pytest.approx(laws["spring and slider"]["top_peak_N"], rel=0.01)


@pytest.mark.parametrize("scene", ["short-bed", "driven", "hanging-chain"])
def test_other_scenes_have_no_such_touchdown(scene):
    with pytest.raises(InputError, match="seabed: must be given"):
        study.request(scene, 5.0)
