"""Results as handled by commands: files written, output shown, and warnings.

Source: made-up results, and the same numbers and files by hand.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import InputError, load_scene
from dolfbuoy.accuracy.bars import RESOLVED, Bar
from dolfbuoy.commands import main, potential, response, run, shared, statistics, sweep
from dolfbuoy.results.linear_record import HELD
from dolfbuoy.studies.accuracy import advise, cheapest

# -- runs --------------------------------------------------------------------------------------------------------------


def test_a_run_is_shown_now_and_then(monkeypatch):
    """Twenty times a second, and at its end; iterations of all steps count."""
    now = [0.0]
    monkeypatch.setattr(run, "clock", SimpleNamespace(monotonic=lambda: now[0]))
    bar = run._Bar(load_scene("driven", time__end=10.0))
    with bar:
        assert bar.progress.live.is_started
        shown = []
        for t, clock, iterations in ((1, 5.0, 2), (2, 5.0499, 4), (3, 5.051, 9), (4, 5.06, 1), (10 - 1e-9, 5.061, 4)):
            now[0] = clock
            bar.update(SimpleNamespace(t=t), iterations)
            shown.append((bar.progress.tasks[0].completed, bar.progress.tasks[0].fields["newton"]))
    assert shown == [(1, 2.0), (1, 2.0), (3, 5.0), (3, 5.0), (10 - 1e-9, 4.0)]
    assert run._Bar(load_scene("driven", time=None)).end == 0.0


def test_where_files_of_a_run_are(monkeypatch, capsys):
    """Files for ParaView where they are wanted; of how many instants; how figures are drawn."""
    asked = []
    monkeypatch.setattr("dolfbuoy.results.figures.draw_all", lambda *given: asked.append(given[0::2]) or ["a", "b"])
    monkeypatch.setattr("dolfbuoy.results.paraview.export", lambda *given: asked.append(given) or ["c"])
    run.draw(Path("x"), False, 7, True)
    run.draw(Path("x"), True, 7, False)
    assert asked == [(Path("x"), True), (Path("x"), False), (Path("x"), 7)]
    assert capsys.readouterr().out == "2 files in x/figures\n3 files in x/figures and x/paraview\n"


# -- responses ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("scene", "held"), [("driven", True), ("short", False)])
def test_ends_that_are_held_are_told(scene, held, call, tmp_path, monkeypatch):
    ticks = iter((10.0, 13.21))
    made = SimpleNamespace(monotonic=lambda: next(ticks))
    monkeypatch.setattr(response, "time", made)
    monkeypatch.setattr("dolfbuoy.linear_api.response", lambda *_: xr.Dataset())
    monkeypatch.setattr("dolfbuoy.results.linear_record.warnings", lambda found: ["it is rough"])
    monkeypatch.setattr(response, "_show_response", lambda *_: None)
    drawn = []
    monkeypatch.setattr(response, "_draw_response", lambda *given: drawn.append(given[1:]))
    code, out, _ = call("response", scene, "--periods", "4,5", "--out", tmp_path)
    assert code == 0
    assert "2 periods took 3.2 s." in out
    assert (HELD in out) == held
    assert "Warning: it is rough" in out
    assert drawn == [([], tmp_path)]


@pytest.mark.parametrize(("whole", "shown"), [(4, 16), (5, 5)])
def test_few_periods_of_many(whole, shown):
    """Round ones where there are five of them, else as many that are evenly spread."""
    others = np.linspace(3.1, 3.9, 20)
    periods = np.sort([*others, *[4.0, 5.0, 6.0, 7.0, 8.0][:whole]])
    found = xr.Dataset({"x": ("period", periods)}, {"period": periods})
    assert response._few_periods(found).sizes["period"] == shown
    assert response._few_periods(found.isel(period=slice(17))).sizes["period"] == 16
    assert response._few_periods(found.isel(period=slice(16))).sizes["period"] == 16


# -- potential flow ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("tilt", "warned"), [(5.0, False), (5.01, True)])
def test_a_hull_as_it_floats(tilt, warned, monkeypatch, capsys):
    """Of the buoy that is named its draft and its lean."""
    scene = load_scene("two-buoys")
    first, second = scene.network.buoys
    rest = SimpleNamespace(cone_angle=xr.DataArray([50.0, tilt]), buoy_position=xr.DataArray([[9, 9, 9], [1, 2, 0.25]]))
    monkeypatch.setattr("dolfbuoy.api.solve_static", lambda scene: rest)
    found = potential._floating(scene, second)
    height = potential_height(scene, second)
    assert found.draft == pytest.approx(height - 0.25)
    assert found.depth == scene.sea.depth
    out = capsys.readouterr().out
    assert ("At rest the buoy leans by 5.01 deg" in out) == ("leans" in out) == warned
    for name in (None, "other"):
        with pytest.raises(InputError, match=f"must be one of {first}, {second}"):
            potential._floating(scene, name)
    alone = load_scene("disc-buoy")
    rest.cone_angle, rest.buoy_position = xr.DataArray(1.0), xr.DataArray([0.0, 0.0, 0.5])
    (name,) = alone.network.buoys
    for given in (None, name):
        assert potential._floating(alone, given).draft == pytest.approx(potential_height(alone, name) - 0.5)
    with pytest.raises(InputError, match="needs"):
        potential._floating(load_scene("driven"), None)


def potential_height(scene, name):
    """Of C above the keel, by the masses."""
    buoy = scene.network.buoys[name]
    masses = [(buoy.mass, buoy.center_of_mass), *((one.mass, one.height) for one in buoy.point_masses or [])]
    return sum(mass * height for mass, height in masses) / sum(mass for mass, _ in masses)


# -- statistics --------------------------------------------------------------------------------------------------------


def test_files_of_statistics(call, tmp_path, monkeypatch):
    """A file of each that is asked for, each shown from its own; none is replaced unless that is wanted."""
    monkeypatch.chdir(tmp_path)
    shown = []
    for name in ("statistics.runs_of", "statistics.run_of", "statistics_figures.draw_all"):
        monkeypatch.setattr(f"dolfbuoy.results.{name}", lambda *_: None)
    for place, number in (("statistics.together", 1), ("lifetime.lifetime", 2), ("lifetime.against_seeds", 3)):
        monkeypatch.setattr(f"dolfbuoy.results.{place}", lambda *_, number=number: xr.Dataset(attrs={"n": number}))
    for name in ("show", "_show_life", "_show_design"):
        monkeypatch.setattr(statistics, name, lambda *given, name=name: shown.append((name, given[0].n, given[1])))
    monkeypatch.setattr(statistics.os.path, "realpath", lambda path: "/far/away")
    folder = Path("results/statistics-away")
    assert call("statistics", "a")[0] == 0
    assert shown == [("show", 1, folder)]
    assert sorted(path.name for path in folder.glob("*.nc")) == ["statistics.nc"]
    words = ["statistics", "a", "--scatter", "s.csv", "--design", "d"]
    assert call(*words)[0] == 2
    assert call(*words, "--overwrite")[0] == 0
    assert shown[1:] == [("show", 1, folder), ("_show_life", 2, folder), ("_show_design", 3, folder / "design.nc")]
    kept = {path.name: xr.load_dataset(path).n for path in folder.glob("*.nc")}
    assert kept == {"statistics.nc": 1, "lifetime.nc": 2, "design.nc": 3}


def test_lives_of_several_lines(monkeypatch):
    """Each by its name, where there are several of a series; what has no number has no row."""
    shown = []
    monkeypatch.setattr(statistics, "print_table", lambda title, headings, rows: shown.append((title, headings, rows)))
    numbers = {"damage_per_year": [0.5, 0.0, np.nan, 0.25], "equivalent_load": [2e3, 3e3, np.nan, 4e5]}
    numbers |= {"largest": [9e3, np.nan, np.nan, 8e5], "life": [np.nan, np.nan, np.nan, 3.0]}
    data = {name: ("row", x) for name, x in numbers.items()} | {"unit": ("row", np.array(["N"] * 4, dtype=object))}
    names = np.array(["tension_top", "tension_top", "offset", "tension_anchor"], dtype=object)
    data |= {"series": ("row", names), "part": ("row", np.array(["a", "b", "buoy", "a"], dtype=object))}
    attributes = {"safety_factor": 2.0, "probability": 0.345, "years": 20.0, "notes": ""}
    statistics._show_life(xr.Dataset(data, attrs=attributes), Path("x"))
    ((title, headings, rows),) = shown
    assert title == "\nA life in these seas, 34.5 % of the time, x/lifetime.nc"
    assert headings[2:] == ["life [years]", "over safety factor 2", "equivalent load", "once in 20 years"]
    assert rows == [
        ["tension top of a", "0.5", "2", "1", "2 kN", "9 kN"],
        ["tension top of b", "0", "-", "-", "3 kN", "-"],
        ["tension anchor", "0.25", "3", "1.5", "400 kN", "800 kN"],
    ]


# -- advice ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["quantity", "outputs", "other rank"])
def test_advice_is_shown_and_written(kind, call, tmp_path, monkeypatch):
    """By the first rank; the file is of the advised scene."""
    scene = load_scene("driven", time__step=0.123)
    told = []
    advice = advise.Advice(scene, None, 0.0, [], None, [])
    found = SimpleNamespace(bars={"a": Bar(1.0, 0.1, RESOLVED)})
    verified = cheapest.Verified(scene, 0.01, None, found, [], [], [])
    result = {"quantity": advice, "outputs": verified, "other rank": scene}[kind]
    monkeypatch.setattr(advise, "advise_all", lambda *_, **__: result)
    monkeypatch.setattr(advise, "report", lambda *given: told.append(("quantity", *given)))
    monkeypatch.setattr(cheapest, "report", lambda *given: told.append(("outputs", *given)))
    words = ["advise", "driven", "--out", tmp_path / "a", "--write", tmp_path / "new.toml"]
    assert call(*words)[0] == 0
    assert told == ([] if kind == "other rank" else [(kind, result, tmp_path / "a")])
    assert (tmp_path / "new.toml").is_file() == (kind != "other rank")
    if kind == "other rank":
        return
    assert load_scene(tmp_path / "new.toml") == scene
    assert call(*words)[0] == 2
    assert call(*words, "--overwrite")[0] == 0
    code, _, err = call(*words[:-1], tmp_path)
    assert (code, "must be a file, not a folder" in err) == (2, True)


def test_what_is_refused_before_the_work(call, tmp_path, monkeypatch):
    """Outputs that there are not, files of one's own; a command without its name is told how to go on."""
    monkeypatch.chdir(tmp_path)
    code, _, err = call("advise", "driven", "--of", "beauty.max", "--out", "a")
    assert (code, "must be an output of this scene" in err) == (2, True)
    Path("own.nc").write_text("mine")
    code, _, err = call("potential", "disc-buoy", "--out", "own.nc")
    assert (code, "own.nc" in err) == (2, True)
    code, _, err = call("advise", "short", "--set", "buoy.mass=1e6", "--out", "a")
    assert (code, "sinks" in err) == (2, True)
    assert [path.name for path in tmp_path.iterdir()] == ["own.nc"]
    assert Path("own.nc").read_text() == "mine"
    for words, file in (
        (["fmu", "driven", "--out", "mine/own.fmu"], "own.fmu"),
        (["compare", "moordyn", "driven", "--out", "mine"], "comparison.json"),
        (["library", "--out", "mine"], "libdolfbuoy.so"),
    ):
        Path("mine").mkdir(exist_ok=True)
        (tmp_path / "mine" / file).write_text("mine")
        code, _, err = call(*words)
        assert (code, f"{file} would be replaced" in err) == (2, True), err
        assert (tmp_path / "mine" / file).read_text() == "mine"
    for words in ([], ["study"]):
        _, out, err = call(*words)
        assert "Example: " in out + err


def test_figures_of_a_scene_that_was_edited(monkeypatch, capsys, tmp_path):
    """Are drawn, with a warning; where nothing was edited, or no scene is kept, without one."""
    drawn = []
    monkeypatch.setattr(main, "draw", lambda *given: drawn.append(given))
    monkeypatch.setattr("dolfbuoy.results.checkpoint.read_scene", lambda folder: "scene")
    (tmp_path / "results.nc").touch()
    for there, edited, warned in ((False, True, False), (True, False, False), (True, True, True)):
        if there:
            (tmp_path / "scene.toml").touch()
        monkeypatch.setattr("dolfbuoy.results.folder.is_edited", lambda folder, scene, edited=edited: edited)
        main.plot(tmp_path, svg=True)
        assert ("is no longer the scene of the run" in capsys.readouterr().out) == warned
    assert drawn == [(tmp_path, False, 50, True)] * 3


def test_a_limit_cycle_is_warned_of(call, monkeypatch, tmp_path):
    record = xr.Dataset(attrs={"cycle_periods": 3, "cycle_error": 0.01})
    monkeypatch.setattr("dolfbuoy.api.periodic", lambda *_, **__: record)
    monkeypatch.setattr("dolfbuoy.results.summary.summary", lambda *_: [])
    monkeypatch.setattr("dolfbuoy.results.summary.warnings", lambda *_: ["it is rough"])
    code, out, _ = call("periodic", "driven", "--out", tmp_path)
    assert (code, "Warning: it is rough" in out) == (0, True)


def test_hours_that_a_sweep_still_takes(monkeypatch):
    """Of one core, to two digits."""
    tables = []
    monkeypatch.setattr(shared, "print_table", lambda title, headings, rows: tables.append(rows))
    found = {"cases": 2, "done": 1, "failed": 0, "missing": 1, "begun": 0, "seconds": 4860.5}
    sweep._show_status(found | {"reasons": {}, "damaged": [], "foreign": 0}, Path("s"), None)
    assert tables == [
        [
            ("all", "2", ""),
            ("done", "1", "4860 s each"),
            ("failed", "0", ""),
            ("missing", "1", "about 1.4 h of one core"),
        ]
    ]


# -- tables ------------------------------------------------------------------------------------------------------------


def test_numbers_stand_to_the_right():
    """Of a value, and of what is left after the run; words do not."""
    shown = shared.table_of("Title", "quantity", "value", "unit", "after the run")
    assert [column.justify for column in shown.columns] == ["left", "right", "left", "right"]
    assert shown.title == "Title"
