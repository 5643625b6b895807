"""Words and numbers of a report, each alone: loads, outcomes of cases, the governing case, the largest values.

Source: made-up scenes, verdicts and datasets of distinct numbers.
"""

import re

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED
from made_up import SCENE

from dolfbuoy import load_scene
from dolfbuoy.page import report
from dolfbuoy.results import figures, style
from dolfbuoy.results.criteria import Verdict
from dolfbuoy.results.statistics import collect

LINE = {"line_density": 9.0, "diameter": 0.05, "axial_stiffness": 1e6}
TWO = {
    "sea": {"depth": 20.0},
    "seabed": {},
    "cable": [
        LINE | {"name": "fore", "from": [30.0, 0.0, -20.0], "to": "left",
                "segments": [{"length": 12.0}, {"length": 25.5}]},
        LINE | {"name": "aft", "from": [-30.0, 0.0, -20.0], "to": "right", "length": 33.0},
        LINE | {"name": "link", "from": "left", "to": "right", "length": 5.0},
    ],
    "buoy": [
        {"name": name, "hull": [[0, 2], [2, 2]], "mass": mass}
        | {"point_masses": [{"mass": 30.0, "height": 1.0}, {"mass": 11.0, "height": 2.0}]}
        for name, mass in (("left", 500.0), ("right", 700.0))
    ],
}  # fmt: skip


def cells(text):
    """Texts of the cells of each row of the tables of a text."""
    rows = re.findall(r"<tr>(.*?)</tr>", str(text), re.DOTALL)
    return [tuple(re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)) for row in rows]


def test_lines_and_buoys_in_words():
    """Lengths of all segments, names where there are several, masses with what stands on the hull."""
    assert report.in_words(load_scene(TWO)) == [
        "Line fore: 37.5 m in 2 segments, from the anchor to left, in 20 m of water, lying on the sea bed where it "
        "touches it.",
        "Line aft: 33 m, from the anchor to right, in 20 m of water, lying on the sea bed where it touches it.",
        "Line link: 5 m, from left to right, in 20 m of water, lying on the sea bed where it touches it.",
        "Buoy left: 541 kg.",
        "Buoy right: 741 kg.",
        "Loads: no waves.",
    ]


#: Without what moves it.
STILL = {key: value for key, value in MOORED.items() if key not in ("waves", "current", "external_force")}
SLOW = {"current": {"speed": 0.5}}
SEA = {"spectrum": "jonswap", "significant_height": 2.5, "peak_period": 7.25, "seed": 4}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "no waves"),
        (
            SLOW | {"waves": SEA},
            "an irregular sea of Hs = 2.5 m, period 7.25 s, seed 4, a current of 0.5 m/s towards 0 degrees",
        ),
        ({"waves": {"components": [[0.3, 4.0, 0.0, 0.0]]}}, "an irregular sea, period 4 s"),
        (
            {"current": {"profile": [[-20.0, 0.1], [0.0, 0.6]], "direction_deg": 40.0}},
            "no waves, a current by depth towards 40 degrees",
        ),
        (
            {"current": {"speed": 0.7, "over_time": [[0.0, 1.0, 0.0], [60.0, 0.5, 0.0]]}},
            "no waves, a current of 0.7 m/s towards 0 degrees, changing over time",
        ),
    ],
)  # fmt: skip
def test_waves_and_current_in_words(changes, said):
    assert report._sea(load_scene(STILL | changes)) == said
    blown = load_scene(STILL | changes, wind={"speed_10m": 12.5, "area": 1.0, "height": 2.0})
    assert report.in_words(blown)[-1] == f"Loads: {said}, wind of 12.5 m/s 10 m above the water."
    pushed = {"force": [30.0, 0.0, 40.0], "over_time": [[0.0, 0.0, 0.0, 0.0], [9.0, 5.0, 0.0, 0.0]]}
    rough = load_scene(blown, wind__gusts="npd", external_force=pushed)
    gusts, force = "wind of 12.5 m/s 10 m above the water with gusts", "a force of 50 N, changing over time"
    assert report.in_words(rough)[-1] == f"Loads: {said}, {gusts}, {force}."


def test_settings_and_who_computed():
    scene = load_scene(MOORED, time={"end": 90.0, "step": 0.04, "scheme": "bdf2"}, author="A. E.")
    assert report._settings(scene) == [("scheme", "BDF2"), ("step", "0.04 s")]
    assert report._duration(scene) == "90 s"
    assert report._settings(load_scene(MOORED, time=None)) == []
    rows = cells(report._revision(scene, {"created": "today", "version_dolfbuoy": "1.5"}))
    assert rows[-3:] == [("author", "A. E."), ("computed", "today"), ("program", "dolfbuoy 1.5")]
    assert cells(report._revision(scene, {"computed_by": "a twin"}))[-1] == ("program", "a twin")


def test_the_conclusion_names_what_is_closest():
    """The least part of the limit that is left; without one of a limit of 0; what is missed in so many of them."""
    scene = load_scene(MOORED, criteria={"largest_offset": 10.0})
    judged = [
        Verdict("offset", "buoy", 7.0, 10.0, "m"),
        Verdict("freeboard", "buoy", 1.1, 1.0, "m", upper=False),
        Verdict("lean", "buoy", 5.0, 20.0, "deg"),
    ]
    assert "All 3 criteria are met; freeboard is the closest (met, 10 % left)." in report._conclusion(scene, judged)
    near = [*judged, Verdict("tension", "line", 9800.0, 1e4, "N")]  # 200 N, but 2 %
    assert "tension is the closest (met, 2 % left)." in report._conclusion(scene, near)
    calm = [Verdict("no uplift of anchors", "a", -5.0, 0.0, "N")]
    assert "All 1 criteria are met." in report._conclusion(scene, calm)
    missed = [*judged, Verdict("offset of the other", "right", 12.0, 10.0, "m")]
    text = report._conclusion(scene, missed)
    assert "1 of 4 criteria are not met." in text
    assert "12 m, at most 10 m (20 % missing)" in text
    assert "were not judged" in report._conclusion(scene, [])
    assert [row[0] for row in cells(report._criteria(judged))] == ["criterion", "offset", "freeboard", "lean"]


def rows(count, failed=()):
    """Rows of a sweep over two keys; the second number differs from the first."""
    found = []
    for k in range(count):
        numbers = {"mean": 5.0 + k, "minimum": 1.0 + k, "maximum": 9.0 + k, "standard_deviation": 1.0}
        status = "SolveError: no" if k in failed else "done"
        changes = {"waves.amplitude": 0.1 * (k + 1), "current.speed": 2.0 + k}
        criteria = [{"criterion": "offset", "part": "buoy", "value": 6.0, "limit": 10.0 - k, "unit": "m"}]
        row = {
            "changes": changes,
            "status": status,
            "statistics": {} if k in failed else {"tension_top of line": numbers},
        }
        found.append(row | {"criteria": [] if k in failed else criteria})
    return found


def test_cases_in_words():
    """Number, keys with their values, how it ended and what is left; the first 200 of more."""
    first, second, last = report._cases(collect(rows(3, failed=[1])))
    assert first == ("1", "waves.amplitude = 0.1, current.speed = 2.0 (done; offset buoy: 40 % left)")
    assert second == ("2", "waves.amplitude = 0.2, current.speed = 3.0 (SolveError: no)")
    assert last == ("3", f"waves.amplitude = {3 * 0.1}, current.speed = 4.0 (done; offset buoy: 25 % left)")
    every = list(report._cases(collect([rows(1)[0]] * 203)))
    assert (len(every), every[199][0], every[200]) == (201, "200", ("...", "and 3 more"))
    assert len(list(report._cases(collect([rows(1)[0]] * 200)))) == 200


def test_a_sweep_says_how_many_cases_have_no_result(tmp_path):
    dataset = collect(rows(4, failed=[1, 2])).assign_attrs(scene=load_scene(MOORED).to_toml(), varied="waves.amplitude")
    text = report.of_sweep(dataset, tmp_path)
    assert "2 of 4 cases have no result." in text
    assert "<title>Report of a sweep</title>" in text
    whole = collect(rows(2)).assign_attrs(scene=load_scene(MOORED).to_toml(), title="Harbour")
    text = report.of_sweep(whole, tmp_path)
    assert "have no result" not in text
    assert "<title>Harbour</title>" in text
    assert "No criteria were given" in text


def test_extremes_of_all_cases():
    """Least and largest of all of them with the case of the largest, or the least if that counts, and the largest of
    what is most probable."""
    top = {"minimum": [4200.0, 3100.0, 5000.0], "mean": [6e3, 7e3, 8e3], "maximum": [9100.0, 12500.0, 11000.0]}
    lean = {"minimum": [0.5, 0.25, 0.75], "mean": [5.0, 6.0, 7.0], "maximum": [21.0, 20.0, 22.5]}
    slack = {"minimum": [70.0, 60.0, 50.0], "mean": [1e3, 2e3, 3e3], "maximum": [6e3, 9e3, 8e3]}
    data = {f"tension_top_{k}": (("run", "cable"), np.array(v)[:, None], {"units": "N"}) for k, v in top.items()}
    data |= {f"cone_angle_{k}": (("run", "buoy"), np.array(v)[:, None], {"units": "degree"}) for k, v in lean.items()}
    data |= {
        f"smallest_tension_{k}": (("run", "cable"), np.array(v)[:, None], {"units": "N"}) for k, v in slack.items()
    }
    data["tension_top_lasting_maximum"] = ("run", "cable"), np.array([[8e3], [np.nan], [11.5e3]])
    probable = np.array([[[13e3, 1.0, 1.0]], [[14e3, 2.0, 3.0]], [[np.nan] * 3]])
    data["tension_top_most_probable"] = data["smallest_tension_most_probable"] = ("set", "cable", "bound"), probable
    found = xr.Dataset(data, {"run": ["a", "b", "c"], "cable": ["line"], "buoy": ["buoy"]})
    text = report._extremes(found, ["a note"])
    assert cells(text)[1:] == [
        ("tension top [kN]", "3.1", "12.5", "11.5", "14", "b"),
        ("smallest tension [kN]", "0.05", "9", "", "", "c"),
        ("cone angle [degree]", "0.25", "22.5", "", "", "c"),
    ]
    assert "a note" in text
    empty = found.assign(tension_top_maximum=np.nan * found.tension_top_maximum)
    assert [row[0] for row in cells(report._extremes(empty, []))[2:]] == ["cone angle [degree]"]


@pytest.mark.parametrize(("names", "governs"), [(["line"], "line"), (["fore", "aft", "port"], "aft")])
def test_figures_are_of_the_line_with_the_largest_tension(names, governs, monkeypatch):
    """Named where there are several."""
    asked = []
    assert figures.FIGURES is style.FIGURES

    def draw(record, scene, **of):
        asked.append(of)
        return "drawn"

    draw.part = "cable"
    monkeypatch.setattr(style, "FIGURES", {"tension": draw})
    tension = np.array([[5.0, 1.0, 3.0], [4.0, 7.0, 6.0]])[:, : len(names)]
    record = xr.Dataset({"tension_top": (("time", "cable"), tension)}, {"cable": names})
    more = f": {governs}" if len(names) > 1 else ""
    assert list(report._of_run(record, SCENE)) == [(f"Tension at both ends of the line{more}.", "drawn")]
    assert asked == [{"cable": governs}]
    if len(names) > 1:
        known = {"c": record.tension_top, "a": record.tension_top.where(record.cable != "aft")}
        assert [report._governing(xr.Dataset({"tension_top": x}), "cable", names) for x in known.values()] == [
            "aft",
            "port",
        ]
        assert report._governing(xr.Dataset(), "cable", names) == "fore"


def test_what_varies_over_the_cases_of_a_sweep():
    """Values in words, of many the range; the seeds of all cases stand where a sea has its own."""
    data = {"waves_seed": ("case", [3, 4, 3, 5]), "current_speed": ("case", [0.5, 0.5, 1.0, 1.0])}
    data["cable_length"] = "case", np.linspace(10.0, 20.0, 4)
    dataset = xr.Dataset(data, attrs={"varied": "waves.seed, current.speed, cable.length"})
    found = report._varied(dataset)
    assert (found["waves.seed"], found["current.speed"]) == ("3, 4, 5", "0.5, 1.0")
    many = xr.Dataset({"waves_seed": ("case", np.arange(7, 207))}, attrs={"varied": "waves.seed"})
    assert report._varied(many) == {"waves.seed": "7 to 206 (200 values)"}
    scene = load_scene(STILL | SLOW | {"waves": SEA})
    assert "seeds 3, 4, 5, a current" in report.in_words(scene, found["waves.seed"])[-1]
    text = report._inputs(scene, [("1", "a case")], found)
    assert "vary current.speed 0.5, 1.0; cable.length 10.0, " in text
    assert text.count("3, 4, 5") == 1
    assert "Over the cases" not in report._inputs(scene, [("1", "a case")], {"waves.seed": "3, 4, 5"})
    still = load_scene(STILL | SLOW)
    assert "vary waves.seed 3, 4;" in report._inputs(still, [("1", "a case")], {"waves.seed": "3, 4"})
