"""Sweeps: refusals, one summary file of many runs, failing cases, resumption, and several ranks.

Source: single runs, series with known statistics.
"""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from alone import simulate
from mpi_helpers import needs_mpirun, start

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.results import style
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import STATISTICS, numbers_of
from dolfbuoy.results.series import Series
from dolfbuoy.results.statistics import collect
from dolfbuoy.results.sweep_figure import draw
from dolfbuoy.scene.variants import cases_of, parse_vary
from dolfbuoy.studies import one_case
from dolfbuoy.studies import sweep as sweeping
from dolfbuoy.studies.sweep import check_wavelength, sweep

ROD = {
    "title": "rod",
    "cable": {"length": 3.0, "line_density": 2.0, "elements": 2, "top": {"kind": "free", "force": [1.0, 2.0, 0.0]}},
    "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
    "time": {"end": 0.2, "step": 0.01},
}
VARY = ["cable.line_density=1,2", "gravity=5:9:4"]


def computed_twice(case, **how):
    """In place of `evaluate`, where nothing is left to do."""
    raise AssertionError(f"{case['changes']} is computed again")


# -- what is asked for -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("waves.amplitude=0.5:3:0.5", ("waves.amplitude", [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])),
        ("a=0:0.3:0.1", ("a", [0.0, 0.1, 0.2, 0.3])),
        ("a=1:0:-0.25", ("a", [1.0, 0.75, 0.5, 0.25, 0.0])),
        ("a=0:1:0.4", ("a", [0.0, 0.4, 0.8])),
        ("cable.elements=10:30:10", ("cable.elements", [10, 20, 30])),
        (" a = 4,5 , 6 ", ("a", [4, 5, 6])),
        ("time.scheme=bdf2,backward-euler", ("time.scheme", ["bdf2", "backward-euler"])),
        ("cable.anchor=[0,0,-8],[1, 0, -8]", ("cable.anchor", [[0, 0, -8], [1, 0, -8]])),
        ("cable.tangential_froude_krylov=true,false", ("cable.tangential_froude_krylov", [True, False])),
    ],
)
def test_vary(text, expected):
    key, values = parse_vary(text)
    assert (key, values) == expected
    assert [type(v) for v in values] == [type(v) for v in expected[1]]


BAD = {
    "no value": (["--vary", "gravity"], ["--vary gravity", "start:stop:step"]),
    "no key": (["--vary", "=1,2"], ["--vary =1,2", "section.key"]),
    "empty value": (["--vary", "time.scheme=bdf2,,x"], ["empty value"]),
    "not a range": (["--vary", "gravity=1:2"], ["gravity=1:2", "start:stop:step"]),
    "no step": (["--vary", "gravity=1:2:0"], ["step not zero"]),
    "endless range": (["--vary", "gravity=1:inf:1"], ["finite"]),
    "nan": (["--vary", "gravity=nan:2:1"], ["finite"]),
    "wrong way": (["--vary", "gravity=2:1:1"], ["empty"]),
    "twice": (["--vary", "gravity=1", "--vary", "gravity=2"], ["gravity", "more than once"]),
    "unknown key": (["--vary", "cable.lenght=1,2"], ["cable.lenght", "length"]),
    "key of a number": (["--vary", "gravity.x=1"], ["gravity.x", "not a section"]),
    "nothing": ([], ["--vary", "--table"]),
    "both": (["--vary", "gravity=1", "--table", "good.csv"], ["--vary", "--table"]),
    "no such table": (["--table", "nowhere.csv"], ["nowhere.csv", "must be a CSV file"]),
    "empty table": (["--table", "empty.csv"], ["empty.csv", "at least one row"]),
    "short row": (["--table", "short.csv"], ["short.csv", "row 2", "gravity, cable.length"]),
    "blank cell": (["--table", "blank.csv"], ["blank.csv", "row 1"]),
    "double column": (["--table", "double.csv"], ["double.csv", "gravity,gravity"]),
    "not text": (["--table", "binary.csv"], ["binary.csv", "cannot be read"]),
}
TABLES = {
    "good": b"gravity\n1\n",
    "empty": b"gravity\n",
    "short": b"gravity,cable.length\n1,2\n3\n",
    "blank": b"gravity,cable.length\n1,\n",
    "double": b"gravity,gravity\n1,2\n",
    "binary": b"\xff\xfe\x00\x81",
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_sentence_and_exit_code_2(name, tmp_path, monkeypatch, capsys):
    from dolfbuoy.commands import main as cli

    arguments, words = BAD[name]
    for table, content in TABLES.items():
        (tmp_path / f"{table}.csv").write_bytes(content)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["dolfbuoy", "sweep", "hanging-chain", *arguments])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    err = capsys.readouterr().err
    assert stop.value.code == 2
    assert err.strip().count("\n") == 0
    for word in words:
        assert word in err
    assert not (tmp_path / "results").exists()


def test_cases_of_a_table(tmp_path):
    """With a byte order mark and empty lines, as spreadsheets write them; a list needs quotes."""
    table = tmp_path / "cases.csv"
    rows = ["\ufeffgravity,time.scheme,cable.anchor", '9.81,bdf2,"[0, 0, 1]"', "", '1,x,"[1, 0, 0]"', ""]
    table.write_bytes("\r\n".join(rows).encode())
    assert cases_of([], table) == [
        {"gravity": 9.81, "time.scheme": "bdf2", "cable.anchor": [0, 0, 1]},
        {"gravity": 1, "time.scheme": "x", "cable.anchor": [1, 0, 0]},
    ]


# -- statistics ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("period", [0.37, 1.0, 2.5, 4.9, 7.0])
@pytest.mark.parametrize("uneven", [False, True])
def test_dominant_period_of_a_sinusoid_on_a_trend_is_exact(period, uneven):
    t = np.linspace(0, 20, 901)
    if uneven:
        t = t + 0.3 * np.sin(t) / (1 + t)
    x = 3 + 0.2 * t + 1.7 * np.sin(2 * np.pi * t / period + 0.3)
    assert Series("x", t, x).dominant_period == pytest.approx(period, rel=1e-10)
    early = np.where(t < t[-1] / 2 - 0.1, 50 * np.sin(8 * t), 0.0)  # what the second half does not see
    assert Series("x", t, x + early).dominant_period == pytest.approx(period, rel=1e-10)


def test_dominant_period_is_that_of_the_larger_of_two():
    t = np.linspace(0, 60, 3001)
    one, two = np.sin(2 * np.pi * t / 5.0), np.sin(2 * np.pi * t / 1.3)
    assert Series("x", t, one + 0.6 * two).dominant_period == pytest.approx(5.0, rel=1e-4)
    assert Series("x", t, 0.6 * one + two).dominant_period == pytest.approx(1.3, rel=1e-4)


def test_no_dominant_period():
    t = np.linspace(0, 20, 901)
    assert np.isnan(Series("x", t, np.full_like(t, 3.0)).dominant_period)
    assert np.isnan(Series("x", t, 3.0 + 1e-12 * np.sin(t), noise=3e-9).dominant_period)
    assert np.isnan(Series("x", t[:3], t[:3]).dominant_period)


def test_statistics_of_known_series():
    """x = t^2 on uneven steps: mean 1/3 and deviation sqrt(1/5 - 1/9) up to the trapezoidal rule."""
    t = np.linspace(0, 1, 2001) ** 1.5
    record = xr.Dataset(
        {
            "tension_top": (("time", "cable"), t[:, None] ** 2),
            "buoy_position": (("time", "buoy", "xyz"), np.stack([t, np.cos(40 * t), 0 * t], axis=1)[:, None]),
            "newton_iterations": ("time", np.ones(len(t), dtype=int)),
            "cable_tension": (("frame", "cell"), np.ones((2, 3))),
        },
        coords={"time": t, "xyz": ["x", "y", "z"], "cable": ["port"], "buoy": ["mine"]},
    )
    found = numbers_of(record)
    assert set(found) == {"tension_top of port", *(f"buoy_position_{axis} of mine" for axis in "xyz")}
    top = found["tension_top of port"]
    assert (top["minimum"], top["maximum"]) == (0.0, 1.0)
    assert top["mean"] == pytest.approx(1 / 3, rel=1e-6)
    assert top["standard_deviation"] == pytest.approx(np.sqrt(1 / 5 - 1 / 9), rel=1e-6)
    assert found["buoy_position_y of mine"]["dominant_period"] == pytest.approx(2 * np.pi / 40, rel=1e-9)
    assert np.isnan(found["buoy_position_z of mine"]["dominant_period"])
    assert found["buoy_position_z of mine"]["standard_deviation"] == 0.0


def test_statistics_of_an_angle_that_turns_on():
    """A record has it between -180 and 180 degrees; its mean and range are those of the turning."""
    t = np.linspace(0, 10, 501)
    yaw = 30 * t + 5 * np.sin(4 * t)
    record = xr.Dataset({"yaw": ("time", (yaw + 180) % 360 - 180)}, coords={"time": t})
    assert np.ptp(record.yaw.values) > 300
    found = numbers_of(record)["yaw"]
    assert (found["minimum"], found["maximum"]) == pytest.approx((yaw.min(), yaw.max()))
    assert found["dominant_period"] == pytest.approx(np.pi / 2, rel=1e-6)


# -- whole sweeps ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """(folder, dataset) of a sweep of four cases."""
    folder = tmp_path_factory.mktemp("sweep")
    return folder, sweep(ROD, VARY, None, folder)


def test_sweep_equals_single_runs(swept):
    folder, whole = swept
    assert whole.tension_top_maximum.dims == ("case", "cable")
    dataset = alone(whole)
    assert dataset.sizes["case"] == 4
    assert list(dataset.status.values) == ["done"] * 4
    for i, (density, gravity) in enumerate([(1, 5), (1, 9), (2, 5), (2, 9)]):
        case = dataset.isel(case=i)
        assert (case.cable_line_density, case.gravity) == (density, gravity)
        record = simulate(ROD, cable__line_density=density, gravity=float(gravity))
        for name in ("tension_top", "tension_anchor"):
            assert float(case[f"{name}_maximum"]) == float(record[name].max())
            assert float(case[f"{name}_minimum"]) == float(record[name].min())
            mean = np.trapezoid if hasattr(np, "trapezoid") else np.trapz
            assert float(case[f"{name}_mean"]) == pytest.approx(mean(record[name], record.time) / 0.2, rel=1e-12)
        assert float(case.end_tension_x_maximum) == pytest.approx(1.0, rel=1e-12)
    assert len(np.unique(dataset.tension_anchor_maximum)) == 4
    for suffix in ("png", "svg"):
        assert (folder / f"sweep.{suffix}").stat().st_size > 5000
    with xr.open_dataset(folder / "sweep.nc") as written:
        assert written.tension_top_mean.attrs["units"] == "N"
        assert written.tension_top_dominant_period.attrs["units"] == "s"
        assert all({"units", "long_name"} <= set(v.attrs) for n, v in written.items() if n.startswith("tension"))
        xr.testing.assert_equal(written.load(), whole)


def test_a_finished_sweep_computes_nothing(swept, monkeypatch):
    folder, dataset = swept
    monkeypatch.setattr(sweeping, "evaluate", computed_twice)
    xr.testing.assert_identical(sweep(ROD, VARY, None, folder), dataset)


def test_a_longer_sweep_computes_only_what_is_new(swept, monkeypatch):
    folder, dataset = swept
    seen = []
    whole = sweeping.evaluate
    monkeypatch.setattr(sweeping, "evaluate", lambda case, **how: (seen.append(case["changes"]), whole(case, **how))[1])
    longer = sweep(ROD, ["cable.line_density=1,2,3", VARY[1]], None, folder)
    assert seen == [{"cable.line_density": 3, "gravity": g} for g in (5, 9)]
    xr.testing.assert_equal(longer.isel(case=slice(4)), dataset)


def test_a_failing_case_does_not_stop_the_others(tmp_path, monkeypatch):
    """Refused values, a solve that fails, and any other error; all are kept, and said."""
    whole = one_case.run

    def crash(scene, *options):
        if scene.gravity == 4.0:
            raise ZeroDivisionError("of the test")
        return whole(scene, *options)

    monkeypatch.setattr(one_case, "run", crash)
    table = tmp_path / "cases.csv"
    hopeless = '"{snes_max_it = 1, snes_linesearch_max_it = 1}",1e-300'
    table.write_text(
        "gravity,cable.length,solver.petsc,solver.step_tolerance\n"
        f"5,3,{{}},1e-8\n5,-3,{{}},1e-8\n5,3,{hopeless}\n4,3,{{}},1e-8\n6,3,{{}},1e-8\n"
    )
    dataset = sweep(ROD, [], table, tmp_path)
    status = list(dataset.status.values)
    assert [s.split(":")[0] for s in status] == ["done", "InputError", "SolveError", "ZeroDivisionError", "done"]
    assert "cable.length = -3" in status[1]
    assert "DIVERGED" in status[2]
    assert np.isfinite(dataset.tension_top_mean.values[:, 0]).tolist() == [True, False, False, False, True]
    monkeypatch.setattr(sweeping, "evaluate", computed_twice)  # failed cases are not repeated either
    xr.testing.assert_identical(sweep(ROD, [], table, tmp_path), dataset)


def test_a_sweep_without_any_result_is_written(tmp_path):
    dataset = sweep(ROD, ["cable.length=-1,-2"], None, tmp_path)
    assert all("InputError" in s for s in dataset.status.values)
    assert (tmp_path / "sweep.png").exists()
    assert "cable.length" in (tmp_path / "sweep.html").read_text()


def test_the_figure_of_very_many_cases_is_small(tmp_path):
    """Each of them is a point for its mean and two for its range; as a picture, whatever their number."""
    numbers = [
        {s: k + shift for s, shift in zip(STATISTICS, (-1.0, 2.0, 0.0, 1.0, 1.0), strict=True)} for k in range(3000)
    ]
    rows = [
        {"changes": {"gravity": k / 10}, "status": "done", "statistics": {"tension_top": one}}
        for k, one in enumerate(numbers)
    ]
    figure = draw(collect(rows))
    assert [len(line.get_xdata()) for line in figure.axes[0].lines] == [3000] * 3
    style.save(figure, tmp_path / "sweep")
    assert 10_000 < (tmp_path / "sweep.svg").stat().st_size < 300_000


@pytest.mark.mpi
@needs_mpirun
def test_a_sweep_without_any_result_exits_1_on_all_ranks(tmp_path):
    load_scene(ROD).save(tmp_path / "rod.toml")
    script = (
        "import sys\nfrom mpi4py import MPI\nfrom dolfbuoy.commands import main\n"
        "try:\n    main.main()\n"
        "except SystemExit as stop:\n    open(f'code-{MPI.COMM_WORLD.rank}', 'w').write(str(stop.code))\n"
    )
    (tmp_path / "command.py").write_text(script)
    arguments = ["command.py", "sweep", "rod.toml", "--vary", "cable.line_density=-1,-2", "--out", "sw"]
    done = start(2, arguments, tmp_path)
    assert [(tmp_path / f"code-{rank}").read_text() for rank in range(2)] == ["1", "1"], done.stderr
    assert done.stdout.count("InputError") == 2


WAVES = load_scene("short", time__end=0.02, time__step=0.01).to_dict()


def test_a_period_of_a_fixed_wavelength_does_not_vary(tmp_path):
    with pytest.raises(InputError, match=r"waves\.wavelength = 40\.0: .* --set waves\.wavelength="):
        sweep(WAVES, ["waves.period=4,5"], None, tmp_path)
    assert not list(tmp_path.iterdir())
    free = load_scene(WAVES, waves__wavelength=None)
    for scene, vary in ((free, ["waves.period=4,5"]), (WAVES, ["waves.period=4,5", "waves.wavelength=24,39"])):
        check_wavelength(load_scene(scene), cases_of(vary, None))


def test_set_changes_all_cases(call, tmp_path):
    load_scene(ROD).save(tmp_path / "rod.toml")
    vary = ["--vary", "cable.line_density=1,2", "--set", "gravity=3", "--set", "time.end=0.02"]
    code, out, _ = call("sweep", tmp_path / "rod.toml", "--out", tmp_path / "sw", *vary)
    assert code == 0
    assert "tension top max [N]" in out
    direct = simulate(load_scene(ROD, cable__line_density=2, gravity=3, time__end=0.02))
    swept = alone(xr.load_dataset(tmp_path / "sw" / "sweep.nc"))
    assert float(swept.tension_top_maximum[1]) == float(direct.tension_top.max())


def test_an_interrupted_sweep_goes_on(tmp_path):
    """SIGINT after the first case: exit code 130, finished cases stay as they are, the rest is computed."""
    load_scene(ROD, **{"time.end": 20.0}).save(tmp_path / "rod.toml")  # half a second per case: time for a signal
    dataset = sweep(tmp_path / "rod.toml", VARY, None, tmp_path / "uninterrupted")
    command = [
        sys.executable,
        "-m",
        "dolfbuoy.commands.main",
        "sweep",
        str(tmp_path / "rod.toml"),
        "--out",
        str(tmp_path),
    ]
    command += [word for text in VARY for word in ("--vary", text)]
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background shell ignores it
    )
    deadline = time.monotonic() + 120
    while not any(b'"status":"done"' in file.read_bytes() for file in (tmp_path / "cases").glob("*.jsonl")):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted" in err
    assert "Traceback" not in err
    (file,) = (tmp_path / "cases").glob("*.jsonl")
    finished = file.read_bytes()
    assert 1 <= finished.count(b'"status":"done"') == finished.count(b"\n") < 4
    done = sweep(tmp_path / "rod.toml", VARY, None, tmp_path)
    assert file.read_bytes().startswith(finished)
    assert file.read_bytes().count(b"\n") == 4
    xr.testing.assert_equal(done, dataset)


def test_records_of_cases_are_kept(tmp_path, monkeypatch):
    """A sweep that kept none runs its cases once more; the numbers stay, to the last bit, and so does what is kept."""
    vary = ["cable.line_density=1,-1,2"]
    without = sweep(ROD, vary, None, tmp_path)
    assert "record" not in without
    dataset = sweep(ROD, vary, None, tmp_path, keep=True)
    undated = (one.assign_attrs(created="") for one in (dataset.drop_vars("record"), without))
    xr.testing.assert_identical(*undated)
    assert dataset.record.values[1] == ""
    for case in (0, 2):
        folder = tmp_path / dataset.record.values[case]
        direct = dolfbuoy.simulate(ROD, cable__line_density=case or 1)
        with xr.open_dataset(folder / "results.nc") as kept:
            xr.testing.assert_equal(kept, direct)
        assert f"case cable.line_density = {case or 1}" in (folder / "page.html").read_text()
        assert load_scene(folder / "scene.toml") == load_scene(ROD, cable__line_density=case or 1)
    assert len([path for path in (tmp_path / "records").iterdir() if path.is_dir()]) == 2
    assert not list((tmp_path / "cases" / "running").iterdir())
    monkeypatch.setattr(sweeping, "evaluate", computed_twice)
    xr.testing.assert_identical(sweep(ROD, vary, None, tmp_path, keep=True), dataset)


def test_records_that_have_no_place_are_refused_before_the_first_case(tmp_path):
    (tmp_path / "records").touch()
    with pytest.raises(InputError, match="records cannot hold results: it is a file"):
        sweep(ROD, ["cable.length=1,2"], None, tmp_path, keep=True)
    assert not list((tmp_path / "cases").rglob("*.jsonl"))


@needs_mpirun
@pytest.mark.mpi
def test_three_ranks_are_identical_to_one(swept, tmp_path):
    """A case that fails on one of them does not stop the others."""
    _, dataset = swept
    load_scene(ROD).save(tmp_path / "rod.toml")
    vary = [word for text in (*VARY, "cable.length=3,-3") for word in ("--vary", text)]
    done = start(3, ["-m", "dolfbuoy.commands.main", "sweep", "rod.toml", "--out", "all", *vary], tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.count("8 cases, ") == 1
    with xr.open_dataset(tmp_path / "all" / "sweep.nc") as parallel:
        assert list(parallel.status.values[::2]) == ["done"] * 4
        assert all("cable.length = -3" in status for status in parallel.status.values[1::2])
        for name in dataset:
            np.testing.assert_array_equal(parallel[name].values[::2], dataset[name].values, err_msg=name)


def test_a_lost_interruption_is_noticed(tmp_path, monkeypatch):
    """KeyboardInterrupt that a library swallowed within a case ends the sweep after it."""
    from dolfbuoy.parallel import interruption

    monkeypatch.setattr(interruption, "_received", True)
    with pytest.raises(KeyboardInterrupt):
        sweep(ROD, ["cable.length=1,2"], None, tmp_path)
    assert not list((tmp_path / "cases").glob("*.jsonl"))
