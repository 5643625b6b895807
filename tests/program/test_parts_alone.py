"""Small parts of results, commands and scenes, each alone, to detect slips.

Source: the same numbers by hand; the words that a user reads.
"""

import importlib
import os
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from chains import CHAIN
from dynamics_helpers import MOORED, merged
from made_up import ALONE, RECORD, SCENE
from matplotlib.figure import Figure
from mpi4py import MPI

from dolfbuoy import InputError, api, load_scene
from dolfbuoy.accuracy.outputs import numbers_of, series_after
from dolfbuoy.check import report as checked_report
from dolfbuoy.commands import run as command
from dolfbuoy.commands import statistics
from dolfbuoy.commands.shared import default_folder
from dolfbuoy.coupling import names
from dolfbuoy.errors import SolveError
from dolfbuoy.formats.names import Names
from dolfbuoy.linear import periods
from dolfbuoy.model.structure import structure_of
from dolfbuoy.parallel.cases import _claim
from dolfbuoy.results import folder as folders
from dolfbuoy.results.compare import Reference
from dolfbuoy.results.criteria import Verdict, never_met
from dolfbuoy.results.recorder import Recorder
from dolfbuoy.results.sample import Fatigue, sample_of
from dolfbuoy.results.statistics import Run, together
from dolfbuoy.results.style import at_least
from dolfbuoy.scene.fatigue import TINY
from dolfbuoy.scene.petsc_options import checked
from dolfbuoy.scene.schema import _meaning

calibration, uncertainty = (
    importlib.import_module(f"dolfbuoy.sensitivity.{n}") for n in ("calibration", "uncertainty")
)
Measured, snapshot = calibration.Measured, importlib.import_module("dolfbuoy.results.snapshot")
surroundings = importlib.import_module("dolfbuoy.elsewhere")

# -- results -----------------------------------------------------------------------------------------------------------


def test_the_anchor_of_an_output_is_the_whole_force():
    """All three components, between two instants."""
    found = series_after(RECORD, 2.0, 7.0)
    t = RECORD.time.values
    rows = (t >= 2.0 - 1e-9) & (t <= 7.0 + 1e-9)
    one = found["anchor", "cable"]
    np.testing.assert_allclose(one.x, np.linalg.norm(ALONE.anchor_force.values, axis=1)[rows])
    np.testing.assert_allclose((one.t[0], one.t[-1]), (2.0, 7.0))
    assert numbers_of(one)["mean"] == pytest.approx(np.average(one.x, weights=[0.5, *[1.0] * (len(one.x) - 2), 0.5]))
    np.testing.assert_allclose(found["tension_top", "cable"].x, ALONE.tension_top[rows])


def test_an_output_needs_three_instants():
    """Of two nothing is known between them."""
    assert series_after(RECORD, 2.0, 2.1) == {}
    assert len(series_after(RECORD, 2.0, 2.2)["tension_top", "cable"].x) == 3


@pytest.mark.parametrize(("marked", "left"), [(4, 0), (5, 0), (7, 2), (9, 3)])
def test_a_recorder_goes_back_to_its_mark(marked, left):
    """Of three rows that are not on the disk, where five are, those from before the mark stay."""
    cut, saved = [], []
    record = SimpleNamespace(lengths=lambda: {"time": 5}, cut=lambda lengths: cut.append(lengths) or marked < 5)
    own = SimpleNamespace(_extremes=SimpleNamespace(kept=np.zeros(2)), record=record, _count=3, root=True)
    own.simulation, own.save = SimpleNamespace(comm=MPI.COMM_SELF), lambda: saved.append(own._count)
    Recorder.rewind(own, {"lengths": {"time": marked}, "next_frame": 1.5, "extremes": np.array([2.0, 3.0])})
    assert (own._count, own._next_frame, own._extremes.kept.tolist()) == (left, 1.5, [2.0, 3.0])
    assert cut == [{"time": marked}]
    assert saved == [0] * (marked < 5)


def test_a_limit_is_told_in_the_unit_of_its_value():
    (said,) = never_met([Verdict("horizontal force on anchors", "west", 12345.0, 9876.5, "N")])
    assert said == "Criterion not met: horizontal force on anchors, west: 12.345 kN, at most 9.8765 kN (25 % missing)."


def test_ranges_are_those_of_the_whole_run():
    """Errors of one run relative to the ranges of another one."""
    t = np.linspace(0.0, 10.0, 101)
    wide, narrow = (SimpleNamespace(t=t, values={"a": size * np.sin(t)}) for size in (5.0, 1.0))
    whole = Reference(wide, 1.0)
    own, other = Reference(narrow, 1.0), Reference(narrow, 1.0, whole)
    off = SimpleNamespace(t=t, values={"a": np.sin(t) + 0.1})
    assert own.error(off, "a").rms == pytest.approx(0.1 / own.range_of("a"))
    assert other.error(off, "a").rms == pytest.approx(0.1 / whole.range_of("a"))
    assert whole.range_of("a") == pytest.approx(5 * own.range_of("a"))


def test_a_panel_that_is_too_flat_is_as_high_as_it_must_be():
    axes = Figure().subplots()
    for low, high, expected in ((3.0, 3.2, (2.6, 3.6)), (3.0, 4.5, (3.0, 4.5))):
        axes.set_ylim(low, high)
        at_least(axes, 1.0)
        assert axes.get_ylim() == pytest.approx(expected)


def test_criteria_of_a_sample_are_judged_where_it_begins():
    """Not at the end of the ramp: an offset that is largest before."""
    scene = load_scene(SCENE, criteria={"largest_offset": 3.0})
    early = np.where(RECORD.time < 8.0, 50.0, 2.0)[:, None]
    record = RECORD.assign(offset=(("time", "buoy"), early))
    judged = [sample_of(record, scene, start)["criteria"][0]["value"] for start in (None, 9.0)]
    assert judged == [50.0, 2.0]


def test_peaks_are_numbered_by_their_sets():
    def run(name, peaks):
        numbers = dict.fromkeys(
            ("mean", "standard_deviation", "skewness", "minimum", "maximum", "period", "memory"), 1.0
        )
        kept = {"tension_top of line": [peaks, [1.0] * len(peaks)]}
        sample = {
            "start": 0.0,
            "duration": 10.0,
            "series": {"tension_top of line": numbers},
            "peaks": kept,
            "cycles": kept,
        }
        return Run(name, sample, name)

    found = together([run("a", [5.0, 7.0]), run("b", [6.0, 9.0, 8.0])], Fatigue())
    assert found.tension_top_peak_set.values.tolist() == [0, 0, 1, 1, 1]
    assert found.tension_top_peak.values.tolist() == [7.0, 5.0, 9.0, 8.0, 6.0]
    assert found.tension_top_range_set.values.tolist() == [0, 0, 1, 1, 1]
    assert found.set_of_run.values.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("bed", "crest", "top", "low", "high"),
    [
        (-12.0, 0.5, 0.4, -12.0, 1.024),  # 0.4 + 6 % of the height of 10.4
        (-13.1, 0.5, 0.4, -10.416, 1.024),
        (-12.0, 2.0, 0.4, -12.0, 2.4),
        (-12.0, 2.0, -4.0, -10.24, -3.64),
        (-12.0, 2.0, -1.5, -12.0, 2.4),
    ],
)
def test_the_box_of_a_snapshot(monkeypatch, bed, crest, top, low, high):
    """Everything with some room; water and bed within a quarter of its height."""
    points = np.array([[0.0, 0.0, -10.0], [1.0, 2.0, top]])
    monkeypatch.setattr(snapshot, "crest_height", lambda scene: crest)
    now = SimpleNamespace(alone=False, x=points, points=points, scene=SCENE, bed=bed)
    span = top + 10.0
    box = snapshot._whole(now)
    if bed < -13.0:
        low = -10.0 - 0.04 * span
    np.testing.assert_allclose(box[:, 2], [low, high], atol=1e-9)
    np.testing.assert_allclose(box.mean(axis=0)[:2], [0.5, 1.0])
    np.testing.assert_allclose(
        np.diff(box, axis=0)[0, :2], 2 * np.maximum([0.5 + 0.08 * span, 1.0 + 0.08 * span], 0.22 * span)
    )
    assert snapshot._whole(SimpleNamespace(alone=True, x=points[:0])) is None


def test_deviations_of_a_fit_without_a_known_noise():
    """Residuals of n values and p numbers: variance of their squares over n - p; correlations; what has no effect."""
    J = np.array([[1.0, 2.0, 0.0], [3.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 2.0, 0.0], [1.0, 0.0, 0.0]])
    fun = np.array([0.1, -0.2, 0.3, 0.0, 0.1])
    t = np.arange(5.0)
    measured = [Measured("tension_top", t[:3], 10.0 * t[:3], 2.0), Measured("offset", t[3:], t[3:], 0.5)]
    parameters = [SimpleNamespace(key=key, value=value, unit="m") for key, value in (("a", 1.0), ("b", 2.0))]
    model = SimpleNamespace(has_offset=True, parameters=parameters, measured=measured, runs=7)
    found = SimpleNamespace(jac=J, x=np.array([1.5, 2.5, 0.1]), fun=fun, cost=0.5 * fun @ fun, success=False)
    found.active_mask = np.array([0, 1, 0])
    dataset, sentences = calibration._described(model, found, None, None, None)
    inner = np.linalg.inv(J[:, :2].T @ J[:, :2])
    variance = fun @ fun / (5 - 3)
    np.testing.assert_allclose(dataset.deviation, [*np.sqrt(variance * np.diag(inner)), 0.0], atol=1e-12)
    assert dataset.correlation.values[0, 1] == pytest.approx(inner[0, 1] / np.sqrt(inner[0, 0] * inner[1, 1]))
    np.testing.assert_allclose(dataset.computed, [0.2, 9.6, 20.6, 3.0, 4.05])
    assert dataset.attrs["residual"] == pytest.approx(np.sqrt(fun @ fun / 5))
    assert sentences == [
        "b lies on its bound, 2.5: the best value is beyond it.",
        "time_offset: nothing that was measured depends on it.",
        "The fit has not ended after 7 runs.",
    ]
    known, _ = calibration._described(model, found, None, None, 2.0)
    np.testing.assert_allclose(known.deviation[:2], np.sqrt(np.diag(inner)))


def test_scatter_counts_runs_that_failed():
    """Rows of those that did not are of the answer."""
    numbers = [SimpleNamespace(parameter=SimpleNamespace(key="a"))]
    y = np.array([1.0, np.nan, 3.0, 2.0, np.nan, 4.0])
    values = {uncertainty.Output("tension_top", "max", "line"): y}
    xi = np.array([[0.0], [9.0], [2.0], [1.0], [9.0], [3.0]])
    found = uncertainty._described(load_scene(CHAIN), numbers, values, xi, "samples", None)
    assert (found.attrs["failed"], found.attrs["runs"]) == (2, 6)
    assert (float(found["mean"][0]), float(found.share[0, 0])) == (2.5, pytest.approx(1.0))


# -- commands ----------------------------------------------------------------------------------------------------------


def test_a_point_is_x_and_y():
    assert statistics._point("3,-4.5") == (3.0, -4.5)
    assert statistics._point(None) is None


def test_what_is_left_of_a_run_can_be_copied(monkeypatch):
    """A folder with a blank is quoted; before the first step there is nothing."""
    monkeypatch.setattr(folders, "can_resume", lambda folder, scene: "with" in str(folder))
    said = command._left(SCENE, Path("with blank"))
    assert f"dolfbuoy run --resume {shlex.quote('with blank')} goes on." in said
    assert "before the first step" in command._left(SCENE, Path("empty"))


def test_the_summary_has_the_settings_that_were_found(capsys, monkeypatch, tmp_path):
    """Of the record, which may have been run with others than those of the command."""
    record = RECORD.assign_attrs(scene=load_scene(SCENE, title="as it was run").to_toml())
    monkeypatch.setattr(command, "simulate", lambda **_: record, raising=False)
    monkeypatch.setattr(api, "simulate", lambda **_: record)
    command._compute(load_scene(SCENE, title="as it was asked for"), tmp_path, {}, {"scene": SCENE})
    out = capsys.readouterr().out
    assert "as it was run, " in out
    assert "as it was asked for" not in out


def test_a_default_folder_is_results_and_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert default_folder(None, "sweep-a") == Path("results") / "sweep-a"
    assert default_folder(Path("mine"), "sweep-a") == Path("mine")
    (tmp_path / "results").symlink_to(tmp_path)
    with pytest.raises(InputError, match="link"):
        default_folder(None, "sweep-a")


def test_a_case_is_claimed_once(tmp_path):
    assert [_claim(tmp_path / name) for name in ("1", "2", "1")] == [True, True, False]


def test_a_run_that_fails_leaves_no_problem_behind(monkeypatch):
    """What it broke off is not used again for the next one."""
    cleared = []
    pool = SimpleNamespace(clear=lambda: cleared.append(True))

    def fails(*_):
        raise SolveError("on purpose")

    monkeypatch.setattr(api, "_quietly", fails)
    assert str(api._tried(SCENE, None, pool)) == "on purpose"
    assert cleared == [True]
    monkeypatch.setattr(api, "_quietly", lambda *_: RECORD)
    assert api._tried(SCENE, None, pool) is RECORD
    assert cleared == [True]


@pytest.mark.parametrize(("ranks", "freed"), [(1, 1), (2, 0)])
def test_a_run_that_breaks_off_frees_its_problem(tmp_path, monkeypatch, ranks, freed):
    """Alone: of several ranks the others may be elsewhere, and wait for ever."""
    done = []

    class Breaks:
        def __init__(self, *_, **__):
            self.control, self.problem = None, SimpleNamespace(destroy=lambda: done.append("freed"))

        def run(self):
            raise SolveError("on purpose")

    monkeypatch.setattr(api, "Simulation", Breaks)
    recorder = SimpleNamespace(close=lambda: done.append("closed"))
    monkeypatch.setattr(api, "Recorder", lambda *_, **__: recorder)
    with pytest.raises(SolveError, match="on purpose"):
        api._drive(SCENE, tmp_path, SimpleNamespace(size=ranks, rank=0), None)
    assert done == ["closed", *["freed"] * freed]


@pytest.mark.parametrize("ranks", [1, 2])
def test_periods_of_check_are_those_of_the_rest_that_is_there(monkeypatch, ranks):
    """On one rank; of several each has but its part, and the rest is found anew."""
    seen = []
    monkeypatch.setattr(periods, "moored_periods", lambda scene, problem: seen.append(problem) or {"heave": 3.0})
    problem = SimpleNamespace(
        scene=SCENE, lines=None, comm=SimpleNamespace(size=ranks), system=SimpleNamespace(blocks=[])
    )
    told = SimpleNamespace(periods={})
    checked_report._at_rest(problem, told)
    assert seen == [problem if ranks == 1 else None]
    assert told.periods == {"heave": 3.0}


def test_a_scene_that_was_edited_is_not_replaced(tmp_path, monkeypatch):
    """Where a run goes on to another end, its own scene is written anew, and no other one."""
    first, longer = load_scene(CHAIN), load_scene(CHAIN, time__end=9.0)
    monkeypatch.setattr(folders, "verify", lambda path: None)
    folders.begin(tmp_path, "run", first)
    folders.go_on(tmp_path, longer)
    assert load_scene(tmp_path / "scene.toml") == longer
    text = (tmp_path / "scene.toml").read_text()
    (tmp_path / "scene.toml").write_text(f"{text}\n# mine")
    with pytest.raises(InputError, match=r"scene\.toml would be replaced"):
        folders.go_on(tmp_path, first)
    assert (tmp_path / "scene.toml").read_text().endswith("# mine")


@pytest.mark.parametrize("started", ["PMIX_RANK", "PMI_RANK", None])
def test_settings_of_a_process_alone(monkeypatch, started):
    """Only of one that mpirun or srun did not start, and not beside the user's own."""
    for name in ("PMIX_RANK", "PMI_RANK", *surroundings._ALONE):
        monkeypatch.delenv(name, raising=False)
    if started:
        monkeypatch.setenv(started, "0")
    monkeypatch.setenv("OMPI_MCA_pml", "mine")
    with surroundings._alone():
        there = {name: os.environ.get(name) for name in surroundings._ALONE}
    expected = dict.fromkeys(there) if started else dict(surroundings._ALONE)
    assert there == expected | {"OMPI_MCA_pml": "mine"}
    assert not (surroundings._ALONE.keys() - {"OMPI_MCA_pml"}) & os.environ.keys()


def test_a_winch_is_of_another_structure():
    """Scenes that one problem serves one after the other either have it or not."""
    line = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "anchor": [0, 0, 0]}
    line["top"] = {"kind": "fixed", "position": [0, 0, 9.0]}
    scenes = [load_scene({"cable": line | more}) for more in ({}, {"winch": [[0.0, 10.0], [9.0, 12.0]]})]
    scenes.append(load_scene({"cable": line | {"winch": [[0.0, 10.0], [5.0, 11.0]]}}))
    plain, wound, other = map(structure_of, scenes)
    assert plain != wound
    assert wound == other


def test_which_line_has_an_effect_is_structure():
    """What is called for by the other line of two is another problem, however much of it there is the same."""
    line = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "from": [0, 0, 0]}
    lines = [line | {"name": name, "to": [x, 0.0, 0.0]} for name, x in (("fore", 8.0), ("aft", -8.0))]
    damped = {"damping": 50.0}
    first, second, more = (
        structure_of(load_scene({"cable": cables}))
        for cables in (
            [lines[0] | damped, lines[1]],
            [lines[0], lines[1] | damped],
            [lines[0] | {"damping": 80.0}, lines[1]],
        )
    )
    assert first != second
    assert first == more


# -- sessions and files of others --------------------------------------------------------------------------------------


def test_which_buoys_can_be_driven():
    """One on a line, from rest."""
    for scene, said in (
        ({key: value for key, value in MOORED.items() if key != "cable"}, "no line hangs on it"),
        (merged(MOORED, initial={"buoy_velocity": [1.0, 0.0, 0.0]}), "it begins at rest"),
        (merged(MOORED, initial={"buoy_angular_velocity": [0.0, 0.1, 0.0]}), "it begins at rest"),
    ):
        with pytest.raises(InputError, match=said):
            names.check_body(load_scene(scene).network, "buoy")
    names.check_body(load_scene(MOORED).network, "buoy")


def test_names_of_other_programs():
    """Each once: a number is added to the second, a letter before a digit, and what changes is noted."""
    notes = []
    found = Names("line", notes.append)
    assert [found.of(name) for name in ("a b", "a_b", "a.b", "a b", "7", "ok")] == [
        "a_b", "a_b_2", "a_b_3", "a_b", "line7", "ok",
    ]  # fmt: skip
    assert notes == [
        "line 'a b' is called a_b here",
        "line 'a_b' is called a_b_2 here",
        "line 'a.b' is called a_b_3 here",
        "line '7' is called line7 here",
    ]
    assert len(found.of("x" * 80)) == 50
    assert found.of("x" * 81) == "x" * 40 + "_2"


# -- scenes ------------------------------------------------------------------------------------------------------------


def test_options_that_are_off_are_left_out():
    """And only these: 0 is a value."""
    options = {"pc_type": "ilu", "pc_factor_levels": 0, "snes_monitor": False, "ksp_monitor": True}
    assert checked(options) == {"pc_type": "ilu", "pc_factor_levels": 0, "ksp_monitor": True}


def test_meanings_have_units():
    row = SimpleNamespace(unit="m", range="number > 0", description="length")
    assert _meaning(row) == "length [m]"
    assert _meaning(SimpleNamespace(**vars(row) | {"unit": "1"})) == "length"
    assert _meaning(SimpleNamespace(**vars(row) | {"unit": "", "range": '"a" | "b"'})) == 'length: "a" | "b"'


def test_a_file_with_a_mark_of_its_bytes(tmp_path):
    """As editors of Windows write it."""
    load_scene(CHAIN).save(tmp_path / "scene.toml")
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbf" + (tmp_path / "scene.toml").read_bytes())
    assert load_scene(tmp_path / "marked.toml") == load_scene(CHAIN)


@pytest.mark.parametrize(("radius", "good"), [(0.0, True), (0.3, False), (0.8, False)])
def test_ropes_want_a_scheme_that_forgets(radius, good):
    time = {"end": 1.0, "step": 0.1, "scheme": "generalized-alpha", "spectral_radius": radius}
    scene = CHAIN | {"time": time, "cable": CHAIN["cable"] | {"slack": "tension-only"}}
    if good:
        assert load_scene(scene)
        return
    with pytest.raises(InputError, match=r"needs time\.spectral_radius = 0"):
        load_scene(scene)


@pytest.mark.parametrize(("first", "said"), [(10.0, False), (10.001, True), (9.99, True)])
def test_a_winch_begins_with_the_length(first, said):
    line = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "winch": [[0.0, first], [9.0, 12.0]]}
    scene = {"cable": line | {"anchor": [0, 0, 0], "top": {"kind": "fixed", "position": [0, 0, 9.0]}}}
    if not said:
        assert load_scene(scene)
        return
    with pytest.raises(InputError, match="must begin at t = 0 or later, with length = 10"):
        load_scene(scene)


@pytest.mark.parametrize("name", ["corrosion", "corrosion_rate"])
def test_corrosion_needs_the_steel_of_its_bar(name):
    """Also that of later years, however little of it there is."""
    line = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "breaking_load": 1e6}
    line |= {"anchor": [0, 0, 0], "top": {"kind": "fixed", "position": [0, 0, 9.0]}}
    scene = {"cable": line, "fatigue": {"curve": "API studless", name: 1e-3}}
    with pytest.raises(InputError, match=r"cable\.steel_area: must be given, fatigue\.corrosion thins"):
        load_scene(scene)
    assert load_scene(scene | {"cable": line | {"steel_area": 4e-3}})
    assert 0 < TINY < 1e-6


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"cable": CHAIN["cable"] | {"elements": -3}}, "or a list of [length, number] of segments, or a mesh file."),
        ({"current": {"speed": 1.0, "profile": "linear"}}, "or a table [[z, speed], ...]."),
    ],
)
def test_what_else_a_key_takes_is_said(scene, said):
    with pytest.raises(InputError) as error:
        load_scene({"sea": {"depth": 20.0}} | CHAIN | scene)
    assert str(error.value).endswith(said)
