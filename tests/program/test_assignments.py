"""`--set`, `--vary` and overrides: values, words, removed keys; and errors that used to be silent.

Source: the scenes obtained by making the same changes by hand.
"""

from concurrent.futures import ThreadPoolExecutor

import pytest

from dolfbuoy.check import check
from dolfbuoy.elsewhere import MPI
from dolfbuoy.errors import InputError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.parallel import pace
from dolfbuoy.parallel.cases import compute, evaluate_all
from dolfbuoy.scene import load_scene, parse_assignment
from dolfbuoy.scene.variants import parse_vary
from dolfbuoy.studies.sweep import sweep

LINE = {
    "cable": {"length": 3.0, "line_density": 2.0, "elements": 2, "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
    "time": {"end": 0.02, "step": 0.01},
}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("cable.length=3", 3),
        ("cable.length = 3.5 ", 3.5),
        ("title=two words", "two words"),
        ("title='none'", "none"),
        ("cable.anchor=[0, 0, -1]", [0, 0, -1]),
        ("waves=", None),
        ("waves= ", None),
        ("waves.wavelength=none", None),
        ("waves=none", None),
        ("waves.stretching=none", "none"),
        ("solver.petsc.pc_type=none", "none"),
        ("solver.petsc.pc_type=", None),
        ("solver.petsc.ksp_rtol=none", None),
    ],
)
def test_assignment(text, value):
    assert parse_assignment(text) == (text.partition("=")[0].strip(), value)


def test_a_key_is_taken_away():
    changes = dict(parse_assignment(text) for text in ("waves.wavelength=none", "wind=", "buoy.point_masses="))
    scene = load_scene("short", **changes)
    assert (scene.waves.wavelength, scene.wind, scene.buoy[0].point_masses) == (None, None, [])
    assert scene.waves.period == 5.0
    assert (
        load_scene("short", **{"waves.stretching": parse_assignment("waves.stretching=none")[1]}).waves.stretching
        == "none"
    )


def test_a_sweep_takes_a_key_away():
    assert parse_vary("waves.wavelength=none,40.0") == ("waves.wavelength", [None, 40.0])


def test_a_sweep_of_which_nothing_runs_is_exit_code_1(call, tmp_path):
    scene = tmp_path / "line.toml"
    load_scene(LINE).save(scene)
    for values, wanted in (("cable.length=-1,-2", 1), ("cable.length=-1,3.0", 0)):
        code, out, _ = call("sweep", scene, "--vary", values, "--out", tmp_path / values)
        assert code == wanted
        assert "greater than 0" in out


def test_what_is_no_result_stays(tmp_path):
    """A file without any line of a store may be the user's: results go elsewhere, and are found there."""
    first = sweep(LINE, ["cable.line_density=1,2"], None, tmp_path)
    (file,) = (tmp_path / "cases").glob("*.jsonl")
    file.write_bytes(b"\xff\x00garbage")
    for _ in range(2):
        assert sweep(LINE, ["cable.line_density=1,2"], None, tmp_path).equals(first)
        assert file.read_bytes() == b"\xff\x00garbage"
        assert file.with_stem("rank-0-1").read_bytes().count(b'"status":"done"') == 2


def test_a_damaged_result_of_a_case_is_computed_again(tmp_path):
    first = sweep(LINE, ["cable.line_density=1,2"], None, tmp_path)
    (file,) = (tmp_path / "cases").glob("*.jsonl")
    one, two = file.read_bytes().splitlines(keepends=True)
    for content in (one[:30], b"[1, 2\n" + two, one.replace(b"done", b"dane") + two, one + two[:-5]):
        file.write_bytes(content)
        said = []
        assert sweep(LINE, ["cable.line_density=1,2"], None, tmp_path, said.extend).equals(first)
        assert file.read_bytes().count(b'"status":"done"') == file.read_bytes().count(b"\n") == 2
        torn = b"\n" not in content[-1:]
        assert [sentence for sentence in said if "damaged" in sentence] == (
            [] if torn else [f"{file} has 1 damaged line; what they held is computed again."]
        )


def test_a_whole_result_of_a_case_is_not_computed_again(tmp_path):
    cases = [{"x": 1}, {"x": 2}]
    evaluate_all(lambda case: {"y": case["x"]}, cases, tmp_path)
    assert [row["y"] for row in evaluate_all(lambda case: {"y": -1}, cases, tmp_path)] == [1, 2]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"initial.points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.5]]}, "an inextensible cable must keep its cable.length"),
        (
            {"initial.points": [[0.1, 0.0, 0.0], [1.9, 0.0, -2.4]]},
            "initial.points[0] = (0.1, 0.0, 0.0): must be",
        ),
        ({"initial.points": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]}, "the line"),
    ],
)
def test_check_refuses_the_lines_that_run_refuses(changes, words):
    assert check(load_scene(LINE)).effects
    with pytest.raises(InputError) as caught:
        check(load_scene(LINE, **changes))
    assert words in str(caught.value)


@pytest.mark.parametrize("key", ["max_step", "min_step"])
def test_bounds_of_steps_need_a_tolerance(key):
    with pytest.raises(InputError, match=rf"time\.{key} = 0\.5: goes with a tolerance only"):
        load_scene(LINE, **{f"time.{key}": 0.5})
    assert check(load_scene(LINE, **{f"time.{key}": 0.5}, time__tolerance=1e-3)).warnings == []


@pytest.mark.parametrize("inertia", [[1.0, 2.0], [3.0, 4.0, 7.0], [5.0, 5.0, 5.0]])
def test_inertia_of_flat_and_round_bodies_is_possible(inertia):
    """Of a disc the largest moment is the sum of the others."""
    assert load_scene("short", buoy__inertia=inertia).buoy[0].inertia == inertia


@pytest.fixture
def wait(monkeypatch):
    """A clock of its own, which goes on by so many seconds."""
    now = [0.0]
    monkeypatch.setattr("dolfbuoy.parallel.cases.clock.monotonic", lambda: now[0])

    def further(seconds):
        now[0] += seconds
        return {}

    return further


def test_after_the_first_case_a_line_estimates_the_time_of_the_others(tmp_path, wait, capsys):
    evaluate_all(lambda case: wait(30.0), [{"x": x} for x in (1, 2, 3)], tmp_path)
    shown = " ".join(capsys.readouterr().err.split())
    assert "The first of 3 cases took 30 s: about 60 s to go." in shown


def test_before_any_case_an_executor_is_said_to_take_so_long(tmp_path, wait, capsys):
    """By work in seconds, shared by its workers; after the first case by the time that this one took."""
    with ThreadPoolExecutor(2) as executor:
        cases = [{"x": x} for x in (10, 30, 20)]
        compute(lambda case: wait(case["x"] / 2), cases, tmp_path, executor=executor, work=lambda case: case["x"])
    assert "3 cases, 2 at once: about 30 s, by their steps, elements and waves." in " ".join(
        capsys.readouterr().err.split()
    )


def test_the_first_steps_estimate_the_time_of_all_cases(tmp_path, wait, capsys):
    """A case of 20 steps of 0.4 s after 1.6 s: 9.6 s, and 2 and 5.5 times as much work for the others."""

    def run(case):
        scene = load_scene(LINE, time__end=0.2)
        wait(1.6)
        for _ in Simulation(scene, MPI.COMM_SELF).run():
            wait(0.4)
        return {}

    evaluate_all(run, [{"x": x} for x in (2, 4, 11)], tmp_path, work=lambda case: case["x"])
    shown = " ".join(capsys.readouterr().err.split())
    assert shown.index("3 cases: about 82 s, by the first steps.") < shown.index("The first of 3 cases took 9.6 s")
    assert pace.watch is None


def test_runs_that_are_repeated_take_so_much_longer(wait):
    told = []
    with pace.watched(told.append):
        pace.watch.runs = 3
        for step in range(1, 5):
            wait(1.0)
            if pace.watch is not None:
                pace.watch.reached(step, 4)
    assert told == [12.0]
