"""The study of effects: omitted effects, the resulting changes, and the costs.

Source: runs with the effect removed by hand.
"""

import json
import math
from dataclasses import replace

import pytest
from dynamics_helpers import MOORED, merged
from scipy.integrate import quad

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model import effects
from dolfbuoy.results import measured as acc
from dolfbuoy.studies import sea
from dolfbuoy.studies.physics import effects as study
from dolfbuoy.studies.study import run

SCENE = merged(MOORED, cable__elements=3, waves__ramp=0.1, time={"end": 0.4, "step": 0.02})
#: What cannot be left out, because nothing would remain.
ALWAYS = {"inextensible cable", "buoy", "hydrostatics"}

#: What goes with what is left out.
GO_WITH = {"waves": {"cable tangential Froude-Krylov", "disk averages", "wave spreading"}, "sea bed": {"bed friction"}}

STORM = {"spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5.0, "spreading": 10.0, "components": 10}


def test_every_effect_can_be_left_out():
    """Whatever `effects.names` can name is in the table, and leaving it out takes the name away."""
    scene = load_scene(
        SCENE,
        wind={"speed_10m": 8.0, "area": 1.0, "height": 2.0},
        buoy__axial_added_mass=1.0,
        buoy__rotational_added_mass=0.5,
        buoy__wave_damping=[10.0, 10.0],
        buoy__disk_averages=True,
        cable__strain="element-average",
        cable__slack="tension-only",
        cable__damping=100.0,
        cable__fails_at={"time": 1.0},
        sea__dry_above=True,
        cable__marine_growth=[[-3.0, 1.0, 1.0], [-1.0, 1.2, 1.1]],
        seabed={"friction": 0.5},
        waves={"amplitude": None, "period": None} | STORM,
    )
    names = study.effects_of(scene)
    every = {e.name for e in effects.EFFECTS if e.removable and not e.key.startswith("joint.")}
    every -= {"bending"}  # of lines that can be pushed
    elsewhere = (
        "take_off.",
        "buoy.potential_flow",
        "buoy.drift",
        "cable.winch",
        "cable.tangential_added_mass",
        "cable.bending_damping",
    )
    every -= {e.name for e in effects.EFFECTS if e.key.startswith(elsewhere)}  # of other scenes
    assert set(names) == set(effects.names(scene)) - ALWAYS == every
    with pytest.raises(InputError, match="damping = 100"):  # a strain is what it damps
        study.variant(scene, ["elastic cable"])
    for name in set(names) - {"elastic cable"}:
        left = set(names) - {name} - GO_WITH.get(name, set())
        assert set(effects.names(study.variant(scene, [name]))) - ALWAYS == left
    assert set(effects.names(study.variant(scene, only=[]))) == ALWAYS
    assert set(effects.names(study.variant(scene, only=["current"]))) == ALWAYS | {"current"}


def test_an_effect_that_cannot_be_left_out(monkeypatch):
    """The reason stands in the row, and the effect is needed."""
    scene = load_scene(SCENE)
    listed = [replace(e, key="sea") if e.name == "waves" else e for e in effects.EFFECTS]
    monkeypatch.setattr(effects, "EFFECTS", listed)
    case = next(case for case in study.cases(scene, []) if case["effect"] == "waves")
    row = case | study.evaluate(case | {"files": {"full": __file__}})
    assert "needs [sea]" in row["reason"]
    assert study.judge([row], acc.quantities_of(scene), 0.01) == (["waves"], [])
    assert "without it" in study.notes([row], acc.quantities_of(scene), 0.01)[0]


@pytest.mark.slow
def test_study(tmp_path):
    """All files, both modes of every effect, operations that add up, and the verdict from the numbers."""
    scene = load_scene(merged(SCENE, external_force=None, current=None, buoy__normal_drag=0.0, buoy__axial_drag=0.0))
    scene = study.variant(scene, only=["waves", "buoy rotational damping"])
    rows = run(study.study, tmp_path, scene=scene, threshold=0.01).rows["effects"]
    names = acc.quantities_of(scene)
    removed = {row["effect"]: row for row in rows if row["mode"] == "without"}
    assert list(removed) == study.effects_of(scene)
    assert {row["effect"] for row in rows if row["mode"] == "alone"} == set(removed)
    assert all((tmp_path / f"effects.{suffix}").stat().st_size > 500 for suffix in ("json", "csv", "png", "svg"))
    for row in removed.values():
        assert row["reason"] is None
        assert row["operations"] < row["base_operations"]
        assert row["unknowns"] == row["base_unknowns"]
        assert row["step_time"] > 0
    assert study.largest(removed["waves"], names)[0] > 0.1
    assert study.largest(removed["buoy rotational damping"], names)[0] == pytest.approx(0.0, abs=1e-9)
    notes = json.loads((tmp_path / "effects.json").read_text())["notes"]
    assert "needs: waves" in notes[0]
    assert "rotational damping" in notes[1]


def _interval(crests, seeds):
    """Half of it in percent: u and b have the moments of the largest of N Rayleigh crests, and the estimate of u the
    deviation sqrt(1.1087/(n - 4)) b."""
    mean, square = (
        quad(lambda x, n=n: -n * x ** (n - 1) * math.expm1(crests * math.log1p(-math.exp(-(x**2) / 2))), 1e-9, 12)[0]
        for n in (1, 2)
    )
    b = math.sqrt(6 * (square - mean**2)) / math.pi
    return f"{100 * 1.96 * math.sqrt(1.1087 / (seeds - 4)) * b / (mean - 0.5772156649 * b):.2g}"


def test_an_irregular_sea_says_what_its_statistics_take(tmp_path):
    """Components for the threshold, what more of them cost, and what runs and seeds tell."""
    scene = load_scene(
        SCENE, waves={"amplitude": None, "period": None} | STORM | {"spreading": None, "components": 100}
    )
    scene = study.variant(scene, only=["waves"])
    rows = run(study.study, tmp_path, scene=scene, threshold=0.02).rows["effects"]
    (row,) = (row for row in rows if row["mode"] == "components")
    crests = 10800 / sea.mean_period(scene)
    assert row["components"] == math.ceil((math.log(crests) / 2 - 1) / (4 * 0.02))
    assert 0.2 < row["time_ratio"] < 1.5
    *_, components, statistics = json.loads((tmp_path / "effects.json").read_text())["notes"]
    expected = f"{row['components']} components keep its largest crest of 3 h within 2 %; the scene has 100.  With"
    assert expected in components
    assert f"above the mean, +- {_interval(crests, 10)} %: 10 seeds; +- {_interval(crests, 30)} %: 30" in statistics


def test_computing_time_of_seeds():
    """Ten seeds of three hours of a scene of 600 s that takes 12 s: 36 minutes."""
    storm = load_scene("storm")
    said, ten, thirty = (
        sea.of_statistics(storm, 12.0),
        *(_interval(10800 / sea.mean_period(storm), n) for n in (10, 30)),
    )
    assert "12 % by 9.7 min, 2.8 % by 3 h" in said
    assert f"+- {ten} %: 10 seeds, 36 min of computing; +- {thirty} %: 30 seeds, 1.8 h of computing" in said
    assert not sea.has_seeds(load_scene("short"))


def test_a_wrong_threshold_is_named():
    with pytest.raises(InputError, match="--threshold lots: must be"):
        study.request(SCENE, 0.4, "lots")
