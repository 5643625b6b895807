"""Design criteria of a mooring: safety factors, offsets, tilt, freeboard, uplift, and limits on outputs.

Source: factors of API RP 2SK and DNV-OS-E301; hand calculations from made-up and computed records.
"""

import json

import numpy as np
import pytest
from chains import CHAIN
from dynamics_helpers import MOORED, merged
from every_key import shows

import dolfbuoy
from dolfbuoy import InputError, load_scene, statistics
from dolfbuoy.commands.sweep import _show
from dolfbuoy.page.run_page import run_page
from dolfbuoy.results.criteria import Verdict, governing, never_met, verdicts
from dolfbuoy.results.summary import warnings
from dolfbuoy.studies.sweep import sweep

RUN = merged(MOORED, cable__elements=4, cable__breaking_load=1e5, time={"end": 2.0, "step": 0.05})


@pytest.fixture(scope="module")
def record():
    return dolfbuoy.simulate(RUN)


def judged(record, **criteria):
    """Verdicts on these criteria."""
    return verdicts(record, load_scene(RUN | {"criteria": criteria}))


def made_up(record, **values):
    """The record with other values of series, constant or a whole series."""
    return record.assign({k: (record[k].dims, np.broadcast_to(v, record[k].T.shape).T) for k, v in values.items()})


@pytest.mark.parametrize("missed", [-0.01, 0.01, 1e-6])
def test_one_per_cent_is_missed(record, missed):
    """An upper and a lower limit, and by how much they are missed."""
    value = float(record.offset.max())
    (one,) = judged(record, largest_offset=value / (1 + missed))
    assert one.met == (missed < 0)
    assert one.use == pytest.approx(-missed, rel=1e-9)
    low = float(record.freeboard.min())
    (one,) = judged(record, least_freeboard=low + missed)
    assert one.met == (missed < 0)
    assert (one.value, one.margin) == (low, pytest.approx(-missed, abs=1e-15))
    assert Verdict("offset", "buoy", 10.1, 10.0, "m").says == "not met, 1 % missing"
    assert Verdict("offset", "buoy", 10.0, 10.0, "m").says == "met, 0 % left"
    assert Verdict("offset", "buoy", 10.1, 10.0, "m", bar=0.2).says == "not met, 1 % missing, within its error bar"
    assert Verdict("freeboard", "buoy", -0.05, 0.0, "m", upper=False).says == "not met, 0.05 m missing"


@shows("criteria.safety", "criteria.safety_factor", "criteria.condition", "criteria.consequence_class")
def test_safety_factors(record):
    """Mean tension 40 kN, maximum 60 kN, breaking load 100 kN; by hand."""
    half = len(record.time) // 2
    use = np.concatenate([np.full(half, 0.2), np.full(len(record.time) - half, 0.6)])
    made = made_up(record, utilisation=use)
    mean = float(np.trapezoid(use, record.time) if hasattr(np, "trapezoid") else np.trapz(use, record.time)) / 2.0
    (own,) = judged(made, safety_factor=1.7)
    assert (own.value, own.limit, own.met) == (pytest.approx(1 / 0.6), 1.7, False)
    for condition, factor, good in (("intact", 1.67, False), ("one line broken", 1.25, True)):
        (one,) = judged(made, safety="API", condition=condition)
        assert (one.limit, one.met) == (factor, good)
    for condition, level, factors in (
        ("intact", 1, (1.1, 1.5)),
        ("intact", 2, (1.4, 2.1)),
        ("one line broken", 1, (1.0, 1.1)),
        ("one line broken", 2, (1.0, 1.25)),
    ):
        (one,) = judged(made, safety="DNV", condition=condition, consequence_class=level)
        expected = (factors[0] * mean + factors[1] * (0.6 - mean)) / 0.95
        assert (one.value, one.met) == (pytest.approx(expected), expected <= 1)
        assert one.criterion == f"DNV-OS-E301, {condition}, class {level}: use of the strength"


def test_what_comes_in_the_ramp_does_not_count(record):
    """Nor times before another given start."""
    early = np.where(record.time < 1.0, 5.0, np.where(record.time < 1.5, 2.0, 1.0))
    scene = load_scene(RUN | {"criteria": {"largest_offset": 3.0}}, waves__ramp=1.0)
    made = made_up(record, offset=early)
    assert [one.value for start in (None, 0.0, 1.5) for one in verdicts(made, scene, start)] == [2.0, 5.0, 1.0]


def test_the_bar_of_a_safety_factor_is_that_of_its_inverse(record):
    (part,) = record.segment.values.tolist()
    of = {"output": ("output", ["utilisation.max"]), "output_of": ("output", [part])}
    bar = {"bar": ("output", [0.03]), "bar_verdict": ("output", ["resolved"])}
    made = made_up(record, utilisation=0.6).assign(bar).assign_coords(of)
    (own,) = judged(made, safety_factor=1.7)
    assert own.bar == pytest.approx(abs(1 / 0.63 - 1 / 0.57) / 2, rel=0.01)
    (use,) = judged(made, safety="DNV")
    assert use.bar == pytest.approx(1.5 * 0.03 / 0.95)


@shows("criteria.largest_offset", "criteria.largest_lean_deg", "criteria.least_freeboard", "criteria.no_uplift")
@shows("criteria.largest_anchor_force", "criteria.limits")
def test_each_criterion_is_of_its_number(record):
    names = {
        "largest_offset": (record.offset.max(), 5.0),
        "largest_lean_deg": (record.cone_angle.max(), 3.0),
        "least_freeboard": (record.freeboard.min(), -1.0),
        "largest_anchor_force": (record.anchor_horizontal.max(), 900.0),
    }
    for name, (value, limit) in names.items():
        (one,) = judged(record, **{name: limit})
        assert (one.value, one.limit) == (float(value), limit)
    (uplift,) = judged(record, no_uplift=True)
    assert (uplift.value, uplift.met) == (float(record.anchor_uplift.max()), False)
    largest = max(float(record[name].max()) for name in ("anchor_horizontal", "tension_top"))
    for part, met in ((0.9e-4, True), (1.1e-4, False)):  # what the springs of a bed lift is none
        (one,) = judged(made_up(record, anchor_uplift=part * largest), no_uplift=True)
        assert one.met == met
    (calm,) = judged(made_up(record, anchor_uplift=-3.0), no_uplift=True)
    assert calm.met
    one, other = judged(record, limits=["tension_top.min > 1e3", "buoy_position_z.mean[buoy] < 0.5"])
    assert (one.value, one.upper) == (float(record.tension_top.min()), False)
    assert other.value == pytest.approx(np.average(record.buoy_position[:, 0, 2], weights=np.r_[0.5, np.ones(39), 0.5]))


def test_the_part_with_the_least_left_governs():
    scene = load_scene(
        "three-legs", current__direction_deg=40.0, criteria={"largest_anchor_force": 6000.0, "no_uplift": True}
    )
    record = dolfbuoy.solve_static(scene)
    uplift, horizontal = governing(verdicts(record, scene))
    assert horizontal.part == str(record.anchor.values[int(record.anchor_horizontal.values.argmax())])
    assert uplift.part == str(record.anchor.values[int(record.anchor_uplift.values.argmax())])
    assert horizontal.value == float(record.anchor_horizontal.max())


def test_what_is_missed_is_told_everywhere(record, tmp_path, call, capsys):
    """In the summary's warnings, on the page, in check, a sweep and its statistics."""
    scene = load_scene(RUN | {"criteria": {"largest_offset": 1.0}})
    said = [s for s in warnings(record, scene) if s.startswith("Criterion not met: offset, buoy: ")]
    assert len(said) == 1
    value, sign = float(record.offset.max()), judged(record, largest_offset=1.0)[0].says.partition(", ")[2]
    assert said[0].endswith(f"{value:.5g} m, at most 1 m ({sign}).")
    (low,), least = never_met(judged(record, least_freeboard=50.0)), float(record.freeboard.min())
    assert low.startswith(f"Criterion not met: freeboard, buoy: {least:.5g} m, at least 50 m (")
    page = run_page(record, scene)
    assert '<th scope="row">offset</th><td>buoy</td>' in page
    found = dolfbuoy.check(scene)
    assert next(value for name, value, *_ in found.numbers if name == "at rest: offset") > 1.0
    assert any("At rest already: Criterion not met: offset" in sentence for sentence in found.warnings)
    swept = sweep(load_scene(scene, waves__ramp=0.0), ["current.speed=0.2,0.6"], None, tmp_path)
    rows = json.loads(statistics(tmp_path).attrs["criteria"])
    assert rows[0][:2] == ["offset", "buoy, current.speed = 0.6"]
    assert json.loads(swept.attrs["criteria"]) == rows
    _show(swept, tmp_path)
    shown = capsys.readouterr().out
    assert "governed by" in shown
    assert "current.speed = 0.6" in " ".join(shown.split())
    scene.save(tmp_path / "scene.toml")
    code, out, _ = call("static", tmp_path / "scene.toml", "--out", tmp_path / "static")
    assert code == 0
    assert "not met" in out


@pytest.mark.parametrize(
    ("criteria", "said"),
    [
        ({}, "criteria.safety_factor: must be given, or another criterion"),
        ({"condition": "one line broken", "largest_offset": 3.0}, "criteria.condition = 'one line broken': goes with"),
        ({"consequence_class": 2, "safety": "API"}, "criteria.consequence_class = 2: goes with safety = 'DNV'"),
        ({"limits": ["tension_top < 3"]}, "criteria.limits.0 = 'tension_top < 3': must be SERIES.max < NUMBER"),
        ({"limits": ["tension_top.max < 1_0"]}, "must be SERIES.max < NUMBER"),
        ({"safety_factor": 0.5}, "criteria.safety_factor"),
        ({"safety": "ABS"}, "criteria.safety"),
    ],
)
def test_what_is_no_criterion(criteria, said):
    with pytest.raises(InputError) as error:
        load_scene(RUN | {"criteria": criteria})
    assert said in str(error.value)


def test_criteria_of_what_is_not_there(record):
    with pytest.raises(InputError, match=r"cable.breaking_load: must be given"):
        load_scene(MOORED | {"criteria": {"safety_factor": 2.0}})
    with pytest.raises(InputError, match=r"buoy: must be given, criteria.largest_offset"):
        load_scene(CHAIN | {"criteria": {"largest_offset": 2.0}})
    with pytest.raises(InputError, match=r"'tension_tip.max < 3' is of what this scene does not record; it has "):
        judged(record, limits=["tension_tip.max < 3"])
    with pytest.raises(InputError, match=r"\[port\] must be one of cable\."):
        judged(record, limits=["tension_top.max[port] < 3"])
