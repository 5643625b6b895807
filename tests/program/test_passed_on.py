"""Arguments passed by commands to the code that computes: changed scenes, options and defaults, folders.

Source: the same arguments by hand, in calls stopped before any work begins.
"""

from pathlib import Path

import pytest
import xarray as xr

from dolfbuoy import InputError, load_scene
from dolfbuoy.commands import shared
from dolfbuoy.scene import Scene
from dolfbuoy.studies.accuracy import bent, convergence, inf_sup, work_precision
from dolfbuoy.studies.hard_cases import study as hard_cases
from dolfbuoy.studies.physics import effects, energy, hull


@pytest.fixture
def passed(call, tmp_path, monkeypatch):
    """passed(function, command line): what the function is called with, at which the command ends."""
    monkeypatch.chdir(tmp_path)

    def found(place, *words):
        asked = []

        def stop(*given, **named):
            asked.append((given, named))
            raise InputError("It ends here")

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(place, stop)
            code, out, err = call(*words)
        assert (code, err.splitlines()[-1]) == (2, "Error: It ends here."), (out, err)
        ((given, named),) = asked
        return given, named

    return found


def changed(scene, **wanted):
    """True of a scene in which these numbers are so."""
    assert isinstance(scene, Scene)
    expected = load_scene(scene, **wanted)
    return expected == scene


def test_static(passed):
    (scene,), how = passed("dolfbuoy.api.solve_static", "static", "short", "--set", "cable.length=21.9")
    assert changed(scene, cable__length=21.9)
    assert how == {"out": Path("results/short"), "overwrite": False}
    _, how = passed("dolfbuoy.api.solve_static", "static", "short", "--out", "a", "--overwrite")
    assert how == {"out": Path("a"), "overwrite": True}


def test_run(passed):
    place = "dolfbuoy.api.simulate"
    _, how = passed(place, "run", "short", "--t-end", "7", "--bars", "--set", "waves.amplitude=0.3")
    scene = how.pop("scene")
    assert changed(scene, time__end=7.0, waves__amplitude=0.3, accuracy={"estimate": "both"})
    assert callable(how.pop("progress"))
    assert how == {"out": Path("results/short"), "overwrite": False}
    words = ["--accuracy", "2%", "--of", "tension_top.max,cone_angle.std", "--overwrite", "--out", "a"]
    _, how = passed(place, "run", "short", *words)
    accuracy = how["scene"].accuracy
    assert (accuracy.target, accuracy.of) == (pytest.approx(0.02), ["tension_top.max", "cone_angle.std"])
    assert (accuracy.estimate, how["out"], how["overwrite"]) == ("both", Path("a"), True)
    _, how = passed(place, "run", "short", "--accuracy", "2%", "--out", "b")
    assert (how["scene"].accuracy.of, how["scene"].time.end) == ([], load_scene("short").time.end)
    _, how = passed(place, "run", "short", "--out", "c")
    assert how["scene"] == load_scene("short")


def test_a_run_that_goes_on(passed, monkeypatch):
    """To another end, if one is given."""
    monkeypatch.setattr("dolfbuoy.commands.run._to_be_resumed", lambda folder, end: load_scene("short"))
    for words, end in ((["--t-end", "9"], {"time.end": 9.0}), ([], {})):
        _, how = passed("dolfbuoy.api.simulate", "run", "--resume", "a", *words)
        how.pop("progress")
        assert how == {"resume": Path("a")} | end


@pytest.mark.parametrize(
    ("words", "shows"),
    [
        ([], ["figures", "page.html"]),
        (["--no-plot"], []),
        (["--no-plot", "--page"], ["page.html"]),
        (["--no-page"], ["figures"]),
    ],
)
def test_what_is_shown_of_a_run(words, shows, passed):
    place = "dolfbuoy.commands.run._compute"
    (scene, folder, found, _), _ = passed(place, "run", "short", "--paraview", "--svg", "--instants", "7", *words)
    assert (scene, folder, list(found)) == (load_scene("short"), Path("results/short"), shows)
    if "figures" in found:
        assert found["figures"].keywords == {"paraview": True, "instants": 7, "svg": True}
    (_, _, found, _), _ = passed(place, "run", "short")
    assert found["figures"].keywords == {"paraview": False, "instants": 50, "svg": False}
    assert found["page.html"].args == ("results.nc",)


def test_advise(passed):
    place = "dolfbuoy.studies.accuracy.advise.advise_all"
    (scene, quantity, accuracy, say), how = passed(place, "advise", "driven", "--set", "time.end=9")
    assert changed(scene, time__end=9.0)
    assert (quantity, accuracy, how) == ("tension_top", pytest.approx(0.01), {"of": []})
    assert say is shared.say
    given, _ = passed(place, "advise", "driven", "--quantity", "tension_anchor", "--accuracy", "3%")
    assert given[1:3] == ("tension_anchor", pytest.approx(0.03))
    _, how = passed(place, "advise", "driven", "--of", "tension_top.max,anchor.max")
    assert how == {"of": ["tension_top.max", "anchor.max"]}


def test_plot_page_and_report(passed, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "results.nc").touch()
    assert passed("dolfbuoy.commands.main.draw", "plot", "a") == ((Path("a"), False, 50, False), {})
    given, _ = passed("dolfbuoy.commands.main.draw", "plot", "a", "--paraview", "--svg", "--instants", "7")
    assert given == (Path("a"), True, 7, True)
    assert passed("dolfbuoy.page.folder.write_pages", "page", "a") == ((Path("a"), None), {})
    assert passed("dolfbuoy.page.report.report_of", "report", "a") == ((Path("a"),), {})


def test_small_motions(passed):
    (scene, folder), _ = passed("dolfbuoy.linear_api.stiffness", "stiffness", "short", "--set", "cable.length=21.9")
    assert changed(scene, cable__length=21.9)
    assert folder == Path("results/short")
    (scene, count, folder), how = passed("dolfbuoy.linear_api.modes", "modes", "short")
    assert (count, folder, how) == (10, Path("results/short"), {"direction_deg": 0.0, "oscillating": False})
    (_, folder), how = passed("dolfbuoy.api.periodic", "periodic", "driven")
    assert (folder, how) == (Path("results/driven"), {"accuracy": pytest.approx(1e-4), "most": 1000})


def test_offsets(passed):
    place = "dolfbuoy.api.offsets"
    given, how = passed(place, "offsets", "short", "--force", "0:10:5")
    assert given == (
        load_scene("short"),
        [0.0, 5.0, 10.0],
        [30.0 * k for k in range(12)],
        "force",
        Path("results/short"),
    )
    assert how == {"buoys": None}
    words = ["--current", "0,1", "--directions", "0,400"]
    (_, sizes, turns, what, _), _ = passed(place, "offsets", "short", *words)
    assert (sizes, turns, what) == ([0.0, 1.0], [0.0, 40.0], "current")
    _, how = passed(place, "offsets", "two-buoys", "--force", "1", "--buoy", "some")
    assert how == {"buoys": ["some"]}


def test_response(passed):
    place = "dolfbuoy.linear_api.response"
    sea = ["--significant-height", "2", "--peak-period", "7", "--gamma", "2", "--spreading", "5"]
    words = ["--periods", "5,4", "--height", "1.5", "--direction", "20", "--verify", "6"]
    given, _ = passed(place, "response", "short", *sea, *words, "--out", "a")
    assert given == (load_scene("short"), [4.0, 5.0, 6.0], 1.5, (2.0, 7.0, 2.0, 5.0), 20.0, Path("a"))
    (_, periods, height, sea, direction, _), _ = passed(place, "response", "short")
    assert (height, sea, direction) == (2 * load_scene("short").waves.size, None, None)
    assert len(periods) > 20
    (_, _, height, sea, *_), _ = passed(place, "response", "storm", "--significant-height", "2", "--peak-period", "7")
    assert (height, sea) == (None, (2.0, 7.0, 3.3, None))


def test_potential_flow(passed, monkeypatch):
    monkeypatch.setattr("dolfbuoy.commands.potential._floating", lambda scene, buoy: (scene, buoy))
    place = "dolfbuoy.formats.capytaine.compute_usable"
    ((scene, buoy), around, say), _ = passed(place, "potential", "disc-buoy", "--set", "sea.depth=44")
    assert changed(scene, sea__depth=44.0)
    assert (buoy, around, say) == (None, 32, shared.say)
    ((_, buoy), around, _), _ = passed(place, "potential", "two-buoys", "--buoy", "x", "--around", "16")
    assert (buoy, around) == ("x", 16)
    monkeypatch.setattr(place, lambda *_: "data")
    given, _ = passed("dolfbuoy.formats.capytaine.write", "potential", "disc-buoy")
    assert given == ("data", Path("disc-buoy.nc"))


def test_statistics(passed, monkeypatch):
    place = "dolfbuoy.results.statistics.runs_of"
    assert passed(place, "statistics", "a", "b") == (([Path("a"), Path("b")], None, None), {})
    words = ["--from", "3", "--point", "1,2", "--exponent", "4", "--curve", "1e14 N^3", "--corrosion", "0.01"]
    given, _ = passed(place, "statistics", "a", *words)
    assert given == ([Path("a")], 3.0, (1.0, 2.0))
    monkeypatch.setattr(place, lambda *_: "runs")
    more = ["--safety-factor", "2", "--frequency", "0.5"]
    for some, numbers in (
        ([*words, *more], (4.0, None, 0.5, "1e14 N^3", 0.01, 2.0)),
        ([], (3.0, None, 1.0, None, None, None)),
        (["--curve", "1e14 N^5"], (5.0, None, 1.0, "1e14 N^5", None, None)),
    ):
        (runs, fatigue), _ = passed("dolfbuoy.results.statistics.together", "statistics", "a", *some)
        own = (fatigue.exponent, fatigue.constant, fatigue.frequency, fatigue.curve, fatigue.corrosion)
        assert runs == "runs"
        assert (*own, fatigue.safety_factor) == numbers
    monkeypatch.setattr("dolfbuoy.results.statistics.together", lambda *_: xr.Dataset())
    (runs, table, _, years), _ = passed("dolfbuoy.results.lifetime.lifetime", "statistics", "a", "--scatter", "s.csv")
    assert (runs, table, years) == ("runs", Path("s.csv"), 50.0)
    monkeypatch.setattr("dolfbuoy.results.statistics.run_of", lambda folder: f"run of {folder}")
    given, _ = passed("dolfbuoy.results.lifetime.against_seeds", "statistics", "a", "--design", "d")
    assert given == ("runs", "run of d")


def test_sweep(passed):
    place, vary = "dolfbuoy.studies.sweep", ["--vary", "cable.length=21,22", "--vary", "gravity=9,9.8"]
    given, how = passed(f"{place}.sweep", "sweep", "driven", *vary, "--seeds", "3", "--set", "time.end=2")
    assert changed(given[0], time__end=2.0)
    assert given[1:] == (["cable.length=21,22", "gravity=9,9.8"], None, Path("results/sweep-driven"))
    usual = {"say": shared.say_warnings, "retry": False, "limit": None, "keep": False}
    assert how == usual | {"seeds": 3, "latin": None, "source": "driven --set time.end=2"}
    words = ["--latin", "4", "--retry", "failed", "--time-limit", "60", "--keep", "--out", "a"]
    (_, _, _, folder), how = passed(f"{place}.sweep", "sweep", "driven", "--vary", "cable.length=21:22", *words)
    assert folder == Path("a")
    chosen = {"retry": True, "limit": 60.0, "keep": True, "seeds": None, "latin": 4, "source": "driven"}
    assert how == usual | chosen
    (planned, folder, part), how = passed(f"{place}.run_part", "sweep", "driven", *vary, "--part", "2/3")
    assert (len(planned.changes), folder, str(part), how) == (4, Path("results/sweep-driven"), "part 2 of 3", usual)
    (planned, folder, part), _ = passed(f"{place}.status", "sweep", "driven", *vary, "--status", "--part", "1/2")
    assert (len(planned.changes), folder, str(part)) == (4, Path("results/sweep-driven"), "part 1 of 2")
    (planned, folder), _ = passed(f"{place}.collected", "sweep", "driven", *vary, "--collect")
    assert (len(planned.changes), folder) == (4, Path("results/sweep-driven"))
    given, _ = passed(f"{place}.plan", "sweep", "driven", "--table", "t.csv")
    assert given == (load_scene("driven"), [], Path("t.csv"), None, None, "driven")


def test_scatter(passed):
    place = "dolfbuoy.sensitivity.uncertainty"
    given, _ = passed(place, "uncertain", "short")
    assert given == (load_scene("short"), "first", None, None, Path("results/uncertain-short"))
    words = ["--method", "chaos", "--runs", "9", "--of", "tension_top.max, offset.mean", "--out", "a"]
    given, _ = passed(place, "uncertain", "short", *words)
    assert given[1:] == ("chaos", 9, ["tension_top.max", "offset.mean"], Path("a"))


def test_files_for_others(passed, tmp_path):
    given, _ = passed("dolfbuoy.coupling.fmu.export", "fmu", "three-legs", "--drive", "buoy", "--drive", "east.to")
    assert given == (load_scene("three-legs"), Path("three-legs.fmu"), ["buoy", "east.to"])
    given, _ = passed("dolfbuoy.coupling.fmu.export", "fmu", "three-legs", "--out", "a.fmu")
    assert given[1:] == (Path("a.fmu"), ())
    place = "dolfbuoy.formats.files.read"
    assert passed(place, "import", "map", "x.txt") == (("map", Path("x.txt"), "name", None), {})
    given, _ = passed(place, "import", "map", "x.txt", "--columns", "place", "--depth", "50")
    assert given == ("map", Path("x.txt"), "place", 50.0)
    place = "dolfbuoy.studies.peer.compare"
    assert passed(place, "compare", "moordyn", "driven") == ((load_scene("driven"), None, 1), {})
    given, _ = passed(place, "compare", "moordyn", "driven", "--t-end", "3", "--segments", "2")
    assert given[1:] == (3.0, 2)
    (scene,), _ = passed("dolfbuoy.studies.peer.beginning", "export", "moordyn", "driven", "--set", "time.end=4")
    assert changed(scene, time__end=4.0)
    assert passed("dolfbuoy.coupling.library.build", "library")[0] == (tmp_path / "lib" / "libdolfbuoy.so",)
    assert passed("dolfbuoy.commands.language.write_new", "new", "a") == ((Path("a.toml"), "short"), {})
    given, _ = passed("dolfbuoy.commands.language.write_new", "new", "a.toml", "--like", "driven")
    assert given == (Path("a.toml"), "driven")


@pytest.mark.parametrize(
    ("words", "module", "options"),
    [
        ("inf-sup", inf_sup.study, {}),
        ("bending", bent.study, {}),
        ("convergence", convergence.study, {"figures": (2, 3, 4), "cells": (2, 4, 8, 16, 32, 64)}),
        ("convergence --figure 3 --cells 4,8", convergence.study, {"figures": (3,), "cells": (4, 8)}),
        ("hard-cases", hard_cases, {"only": None, "slow": False}),
        ("hard-cases --only slack --slow", hard_cases, {"only": "slack", "slow": True}),
        ("energy", energy.study, {"scene": None, "t_end": None, "steps": None}),
        ("energy a --t-end 3 --steps 0.1,0.05", energy.study, {"scene": "a", "t_end": 3.0, "steps": [0.1, 0.05]}),
    ],
)
def test_studies(words, module, options, passed):
    name = words.split()[0]
    given, how = passed("dolfbuoy.commands.study._run", "study", *words.split())
    assert (given, how) == ((name, module, None), options)
    (_, _, out), _ = passed("dolfbuoy.commands.study._run", "study", *words.split(), "--out", "a")
    assert out == Path("a")


def test_studies_of_a_scene(passed):
    place = "dolfbuoy.commands.study._run"
    given, how = passed(place, "study", "work-precision", "driven", "--t-end", "21")
    assert given == ("work-precision", work_precision.study, None)
    assert changed(how.pop("scene"), time__end=21.0)
    whole = load_scene("driven")
    assert how.pop("largest") == whole.time.end / 10
    nothing = dict.fromkeys(("pairs", "cells", "schemes", "steps"))
    assert how == nothing | {"tolerances": [1e-3, 1e-4, 1e-5], "newton": [1e-9, 1e-5], "repeats": 3}
    words = "--pairs 1-0,2-1 --cells 4,8 --schemes bdf2,backward-euler --steps 0.1 --tolerances none --newton 1e-6"
    _, how = passed(place, "study", "work-precision", "driven", *words.split(), "--repeats", "2")
    ramp, period = whole.cables[0].top.ramp, whole.cables[0].top.period
    assert how.pop("scene").time.end == pytest.approx(ramp + 4 * period)
    how.pop("largest")
    assert how == {
        "pairs": [(1, 0), (2, 1)],
        "cells": [4, 8],
        "schemes": ["bdf2", "backward-euler"],
        "steps": [0.1],
        "tolerances": [],
        "newton": [1e-6],
        "repeats": 2,
    }
    given, how = passed(place, "study", "effects", "driven")
    assert given == ("effects", effects.study, None)
    assert (how["scene"].time.end, how["threshold"]) == (pytest.approx(ramp + 2 * period), pytest.approx(0.01))
    _, how = passed(place, "study", "effects", "driven", "--t-end", "12", "--threshold", "3%")
    assert (how["scene"].time.end, how["threshold"]) == (12.0, pytest.approx(0.03))
    given, how = passed(place, "study", "hull", "free-buoy")
    assert given == ("hull", hull.study, None)
    own = load_scene("free-buoy")
    usual = {"scene": own, "runs": [4.0, 6.0, 9.0, 14.0], "direction": own.waves.direction_deg, "capytaine": None}
    assert how == usual
    _, how = passed(place, "study", "hull", "free-buoy", "--runs", "none", "--direction", "70")
    assert how == usual | {"runs": [], "direction": 70.0}
    for words, quick in (([], False), (["--quick"], True)):
        given, _ = passed("dolfbuoy.studies.accuracy.report.run", "study", "accuracy", *words)
        assert given == (Path("results/study-accuracy"), quick)
    given, _ = passed("dolfbuoy.studies.accuracy.report.run", "study", "accuracy", "--out", "a")
    assert given == (Path("a"), False)


@pytest.mark.parametrize(("holds", "code"), [(True, 0), (False, 1)])
def test_a_study_that_does_not_hold(holds, code, call, monkeypatch):
    asked = []
    monkeypatch.setattr("dolfbuoy.studies.study.run_command", lambda *given, **how: asked.append((given, how)) or holds)
    assert call("study", "energy", "a")[0] == code
    assert asked == [(("energy", energy.study, None), {"scene": "a", "t_end": None, "steps": None})]
