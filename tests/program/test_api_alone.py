"""The Python interface without the code it calls: folder, rank and scene passed to each call, and return values.

Source: the docstrings of the interface; stand-ins for runs, equilibria, modes and folders that report their arguments.
"""

import math
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from chains import CHAIN
from mpi4py import MPI

from dolfbuoy import api, linear_api, load_scene
from dolfbuoy.accuracy import bars, companion, target
from dolfbuoy.errors import InputError, NoResult, NotAccurate, SolveError
from dolfbuoy.motion import corrected

SCENE = load_scene(CHAIN)


class Folders:
    """Folders of results that tell what is done with them."""

    def __init__(self, held=False, remarks=None):
        self.calls, self.held, self.remarked = [], held, remarks or {}

    @contextmanager
    def claimed(self, path, comm):
        self.calls.append(("claimed", path))
        yield
        self.calls.append(("left", path))

    def holds(self, *given):
        self.calls.append(("holds", *given[:2], given[3]))
        return self.held

    def remarks(self, path, kind):
        return self.remarked

    def __getattr__(self, name):
        return lambda *given, **options: self.calls.append((name, *given[:2], *options.items()))


class Results:
    """Records as they are read and written."""

    def __init__(self, calls):
        self.save = lambda dataset, path: calls.append(("save", dataset, path))
        self.put = lambda path, dataset: calls.append(("put", path, dataset))
        self.read = lambda path, own: ("read", path, own)
        self.nothing = lambda: "nothing"
        self.dataset_of = lambda *given: given


@pytest.fixture
def folders(monkeypatch):
    """Stand-ins for folders and records in both modules of the interface."""
    found = Folders()
    for module in (api, linear_api):
        monkeypatch.setattr(module, "folders", found)
        monkeypatch.setattr(module, "results", Results(found.calls))
    return found


def ranks(rank=0, size=1):
    """A communicator whose value of rank 0 is that of all."""
    return Fake(rank=rank, size=size, bcast=lambda value, root=0: value)


# -- equilibria --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rank", [0, 1])
@pytest.mark.parametrize("held", [False, True])
def test_an_equilibrium_is_read_where_it_is_and_written_by_one_rank(monkeypatch, folders, rank, held):
    monkeypatch.setattr(api, "_equilibrium", lambda scene, comm: "record")
    folders.held, path = held, Path("o") / "static.nc"
    found = api.solve_static(SCENE, "o", ranks(rank), overwrite=True)
    assert found == ((("read", path, False) if rank == 0 else "nothing") if held else "record")
    written = [("begin", "o", "static"), ("save", "record", path), ("finish", "o", "static")]
    now = [("holds", "o", "static", True), *(written if rank == 0 and not held else [])]
    assert folders.calls == [("claimed", "o"), *now, ("left", "o")]
    assert api.solve_static(SCENE, comm=ranks(rank)) == "record"


@pytest.mark.parametrize(("lines", "rank"), [(["a"], 0), ([], 0), (["a"], 1)])
def test_an_equilibrium_is_recorded_and_its_problem_freed(monkeypatch, folders, lines, rank):
    freed = []
    problem = Fake(lines=lines, iterations=3, end_forces=lambda: "forces", smallest_tension=lambda: 7.0)
    problem.destroy = lambda: freed.append(True)
    observer = Fake(fixed=lambda: "fixed", values=lambda forces: {"of": forces}, frame=lambda: {"shape": 1})
    observer.labels = lambda: "labels"
    monkeypatch.setattr(api, "solve_equilibrium", lambda scene, comm: problem)
    monkeypatch.setattr(api, "Observer", lambda problem, places: observer)
    monkeypatch.setattr(api, "places_of", lambda problem: None)
    monkeypatch.setattr(api, "attributes", lambda problem: {})
    found = api._equilibrium(SCENE, ranks(rank))
    values = {"of": "forces", "newton_iterations": 3} | ({"shape": 1} if lines else {})
    info = {"smallest_tension_N": 7.0} if lines else {}
    assert found == ("nothing" if rank else (values, "fixed", info, "labels"))
    assert freed == [True]


def test_offsets_need_one_equilibrium(monkeypatch, folders):
    """From where the buoy rests, if it does; kept by its folder."""

    class Rows(list):
        def __init__(self, load):
            self.load = load

        def add(self, rest):
            self.append(rest)

        def dataset(self, origin):
            return self.load, len(self), None if origin is None else origin.tolist()

    place = xr.DataArray([[1.0, 2.0, 3.0]])
    found, lost = Fake(problem="p", reason=""), [Fake(problem=None, reason=word) for word in ("one", "two")]
    monkeypatch.setattr(api, "Rows", Rows)
    monkeypatch.setattr(api, "adrift_nowhere", lambda scene: scene)
    rests, given = [lost[0], found, lost[1]], []
    monkeypatch.setattr(api, "rests", lambda *arguments: given.append(arguments[1:4]) or rests)
    monkeypatch.setattr(api, "_equilibrium", lambda scene, comm: {"buoy_position": place})
    call = partial(api.offsets, SCENE, [1.0], [0.0], comm=ranks())
    assert call(out="o", load="current") == ("current", 3, [[1.0, 2.0, 3.0]])
    assert folders.calls == [("make_ready", "o", "offsets"), ("keep", "o", "offsets")]
    assert given == [("current", [1.0], [0.0])]
    folders.calls.clear()
    monkeypatch.setattr(api, "_equilibrium", lambda scene, comm: {})
    assert call() == ("force", 3, None)
    assert folders.calls == [("make_ready", None, "offsets")]

    def sinks(scene, comm):
        raise SolveError("it sinks")

    monkeypatch.setattr(api, "_equilibrium", sinks)
    assert call() == ("force", 3, None)
    assert api.offsets(SCENE, [1.0], [0.0], comm=ranks(1)) == "nothing"
    rests[:] = lost
    with pytest.raises(SolveError, match=r"there an equilibrium that can be found: one\."):
        call()


# -- runs --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def runs(monkeypatch, folders):
    """Stand-ins for what a run is made of."""
    monkeypatch.setattr(api, "_drive", lambda *given, **options: ("driven", *given, *options.items()))
    monkeypatch.setattr(api, "_sound", lambda record, scene, comm: record)
    monkeypatch.setattr(api, "_with_bars", lambda record, scene, folder, comm: (record, folder))
    monkeypatch.setattr(api, "_accurate", lambda *given: ("accurate", *given))
    return folders


def test_a_run_is_read_driven_or_refined(runs):
    comm, out = ranks(), Path("o")
    assert api.simulate(SCENE, "o", comm, "p") == (("driven", SCENE, out, comm, "p"), out)
    assert runs.calls == [("claimed", "o"), ("holds", "o", "run", False), ("left", "o")]
    asked = load_scene(SCENE, accuracy={"target": 0.1})
    assert api.simulate(asked, "o", comm, "p", overwrite=True) == ("accurate", asked, out, comm, "p")
    barred = load_scene(SCENE, accuracy={})
    assert api.simulate(barred, "o", comm) == (("driven", barred, out, comm, None), out)
    runs.held = True
    assert api.simulate(asked, "o", comm) == (("read", out / "results.nc", False), out)
    runs.held = False
    (_, scene, folder, *_), _ = api.simulate(SCENE, comm=comm, time__end=0.3)
    assert (scene.time.end, folder.exists()) == (0.3, False)


def test_a_run_goes_on_with_its_own_scene(monkeypatch, runs):
    point, loads, comm = Fake(scene=SCENE), [], ranks()
    monkeypatch.setattr(api, "checkpoint", Fake(load=lambda *given: loads.append(given) or point))
    found = api.simulate(resume="o", comm=comm, progress="p", **{"time.end": 9.0})
    assert found == (("driven", SCENE, Path("o"), comm, "p", point), Path("o"))
    assert loads == [("o", 1, 9.0)] * 2
    assert runs.calls == [("claimed", "o"), ("go_on", "o", SCENE), ("left", "o")]
    for options in ({"scene": SCENE}, {"out": "x"}, {"time__step": 0.1}, {"time__end": 1.0, "time__step": 0.1}):
        with pytest.raises(InputError, match="only time__end may be changed"):
            api.simulate(resume="o", comm=comm, **options)
    runs.remarked = {"session": True}
    with pytest.raises(InputError, match="o was written by a session"):
        api.simulate(resume="o", comm=comm)


@pytest.mark.parametrize(("own", "every", "fails"), [(None, 4.0 / 24, False), (0.5, 0.5, False), (None, None, True)])
def test_a_limit_cycle_is_one_period_from_zero(monkeypatch, folders, own, every, fails):
    freed, given = [], {}
    problem = Fake(destroy=lambda: freed.append(True))
    simulation = Fake(t=12.0, problem=problem, state=lambda: {"u": 1})

    def find(accuracy, most):
        given.update(accuracy=accuracy, most=most)
        if fails:
            raise SolveError("none")
        return Fake(periods=3, error=0.01)

    def drive(scene, folder, comm, progress, state, control):
        given.update(end=scene.time.end, every=scene.time.output_every, state=state, step=control.step)
        times = {"time": [12.0, 14.0, 16.0], "frame": [12.0, 16.0]}
        return xr.Dataset({"a": ("time", [1.0, 2.0, 3.0])}, times)

    monkeypatch.setattr(api, "in_equal_steps", lambda scene: scene)
    monkeypatch.setattr(api, "Simulation", lambda scene, comm: simulation)
    monkeypatch.setattr(api, "Cycle", lambda simulation: Fake(find=find, simulation=simulation, period=4.0))
    monkeypatch.setattr(api, "_drive", drive)
    scene = load_scene(SCENE, time__output_every=own)
    if fails:
        with pytest.raises(SolveError, match="none"):
            api.periodic(scene, comm=ranks())
        assert freed == [True]
        return
    found = api.periodic(scene, "o", ranks())
    assert given == {"accuracy": 1e-4, "most": 1000, "end": 16.0, "every": pytest.approx(every), "step": 0.02} | {
        "state": {"u": 1, "control": {}}
    }
    assert (found.time.values.tolist(), found.frame.values.tolist()) == ([0.0, 2.0, 4.0], [0.0, 4.0])
    assert found.attrs == {"cycle_periods": 3, "cycle_error": 0.01}
    assert [call[:3] for call in folders.calls] == [("make_ready", "o", "periodic"), ("keep", "o", "periodic")]
    assert freed == [True]
    with pytest.raises(InputError, match="on one rank"):
        api.periodic(scene, comm=ranks(size=2))


def test_who_follows_the_error_of_the_steps(monkeypatch):
    """Of scenes that ask for it and can have it; beside a companion no longer than that follows."""
    monkeypatch.setattr(companion, "followed", lambda scene: 7.0)
    for estimate, can, found in (("none", True, None), ("companion", True, None), ("time", False, None)):
        monkeypatch.setattr(corrected, "can_follow", lambda scene, can=can: can)
        assert api._corrected(load_scene(SCENE, accuracy={"estimate": estimate})) is found
    monkeypatch.setattr(corrected, "can_follow", lambda scene: True)
    assert api._corrected(SCENE) is None
    assert api._corrected(load_scene(SCENE, accuracy={"estimate": "time"})) is corrected.Corrected
    both = api._corrected(load_scene(SCENE, accuracy={"estimate": "both"}))
    assert (both.func, both.keywords) == (corrected.Corrected, {"until": 7.0})


def test_bars_are_of_a_companion_and_of_those_around_events_that_did_not_fail(monkeypatch):
    events, record = {(0, 1): "one", (2, 3): SolveError("two")}, {"a": 1}
    monkeypatch.setattr(api, "Pool", lambda: Fake(clear=lambda: None))
    monkeypatch.setattr(companion, "companion_of", lambda scene: "coarse")
    monkeypatch.setattr(companion, "events_of", lambda scene, record: list(events))
    monkeypatch.setattr(companion, "companion_around", lambda scene, window: events[window])
    monkeypatch.setattr(api, "_tried", lambda made, comm, pool: made)
    monkeypatch.setattr(bars, "bars_of", lambda record, scene, coarse, events: (coarse, events))
    monkeypatch.setattr(api, "_put", lambda record, found, scene, folder: (*found, folder))
    found = []
    for accuracy in (None, *({"estimate": word} for word in ("none", "time", "companion", "both"))):
        scene = load_scene(SCENE, accuracy=accuracy)
        found.append(api._with_bars(record, scene, "o", ranks()))
        assert api._with_bars({"bar": 1}, scene, "o", ranks()) == {"bar": 1}
    assert found == [record, record, (None, {}, "o"), *[("coarse", {(0, 1): "one"}, "o")] * 2]
    assert (
        api._with_bars(record, scene, "o", Fake(rank=1, size=2, bcast=lambda x, root: [] if x is None else x)) == record
    )


@pytest.mark.parametrize(("share", "warned"), [(0.05, False), (0.0501, True)])
def test_a_record_of_steps_that_were_retried(monkeypatch, share, warned):
    unsound = []
    known = Fake(refused=lambda record, scene: unsound[0] if unsound else None, cut=lambda record, scene: share)
    known.OFTEN, known.about_retries = 0.05, lambda record, scene: ["often."]
    monkeypatch.setattr(api, "cautions", known)
    if warned:
        with pytest.warns(UserWarning, match="often"):
            assert api._sound("record", SCENE, ranks()) == "record"
    else:
        assert api._sound("record", SCENE, ranks()) == "record"
    assert api._sound("record", SCENE, Fake(rank=1, size=2, bcast=lambda value, root: None)) == "record"
    unsound.append(NoResult("most"))
    for comm in (ranks(), Fake(rank=1, size=2, bcast=lambda value, root: "most")):
        with pytest.raises(NoResult, match=r"^most$") as error:
            api._sound("record", SCENE, comm)
        assert (error.value is unsound[0]) == (comm.rank == 0)


@pytest.mark.parametrize(("worst", "good"), [(0.5, True), (1.0, True), (1.001, False)])
def test_a_run_that_must_be_accurate(monkeypatch, folders, worst, good):
    found = Fake(record="record", bars="bars", sentences="said", scene="settled", worst=worst * target.ENOUGH)
    monkeypatch.setattr(target, "reach", lambda scene, run, comm: found)
    monkeypatch.setattr(target, "sentence_of", lambda found: "not enough")
    monkeypatch.setattr(api, "_put", lambda *given: given)
    if good:
        assert api._accurate(SCENE, "o", ranks(), None) == ("record", ("bars", "said"), "settled", "o")
        assert folders.calls == [("finish", "o", "run", ("requested", SCENE))]
        assert api._accurate(SCENE, "o", ranks(1, 2), None) == "record"
    else:
        with pytest.raises(NotAccurate, match="not enough") as error:
            api._accurate(SCENE, "o", ranks(), None)
        assert error.value.record[0] == "record"
    assert len(folders.calls) == good


# -- small motions -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("oscillating", "number", "kinds", "found", "asked"),
    [
        (False, 2, "ooxo", "oo", [2]),
        (True, 2, "xxoxoooo", "oo", [2, 4, 8]),
        (True, 2, "xxo", "o", [2, 4, ]),
        (True, 3, "x" * 600, "", [3, 6, 12, 24]),
    ],
)  # fmt: skip
def test_modes_that_have_a_period(monkeypatch, folders, oscillating, number, kinds, found, asked):
    """Of twice as many each time, until there are enough of them, no others, or too many."""
    counts, freed = [], []
    every = [Fake(kind="oscillates" if kind == "o" else "decays", name=kind) for kind in kinds]
    monkeypatch.setattr(linear_api, "MOST_MODES", 30)
    monkeypatch.setattr(linear_api, "linearise", lambda *_: Fake(bodies=[], destroy=lambda: freed.append(True)))
    monkeypatch.setattr(linear_api, "lowest_modes", lambda _, count, way: counts.append(count) or every[:count])
    monkeypatch.setattr(linear_api, "dataset_of_modes", lambda _, modes: Fake(modes=modes, attrs={}))
    dataset = linear_api.modes(SCENE, number, "o", ranks(), **({"oscillating": True} if oscillating else {}))
    assert ("".join(mode.name for mode in dataset.modes), counts, freed) == (found, asked, [True])
    assert [call[:3] for call in folders.calls] == [("make_ready", "o", "modes"), ("keep", "o", "modes")]
    for wrong in (0, 31):
        with pytest.raises(InputError, match=f"number = {wrong}: must be from 1 to 30"):
            linear_api.modes(SCENE, wrong)


@pytest.mark.parametrize(("size", "bodies", "of_buoys"), [(1, ["b"], True), (2, ["b"], False), (1, [], False)])
def test_beside_a_slack_line_only_buoys_have_modes(monkeypatch, folders, size, bodies, of_buoys):
    monkeypatch.setattr(linear_api, "linearise", lambda *_: Fake(bodies=bodies, destroy=lambda: None))
    monkeypatch.setattr(linear_api, "slack_in", lambda _: "A line is slack")
    monkeypatch.setattr(linear_api, "modes_of_buoys", lambda _, way: [Fake(kind="oscillates", name=f"buoy {way}")])
    monkeypatch.setattr(linear_api, "lowest_modes", lambda *_: [Fake(kind="oscillates", name="all")])
    monkeypatch.setattr(linear_api, "dataset_of_modes", lambda _, modes: Fake(modes=modes, attrs={}))
    dataset = linear_api.modes(SCENE, comm=ranks(size=size), direction_deg=30.0, oscillating=True)
    assert [mode.name for mode in dataset.modes] == (["buoy 30.0"] if of_buoys else ["all"])
    said = "A line is slack; these are the modes of buoys, which the taut part and the bed hold."
    assert dataset.attrs == ({"notes": said} if of_buoys else {})
    assert [call[0] for call in folders.calls] == ["make_ready"]


def test_a_response_by_periods_heights_and_seas(monkeypatch):
    """Of small waves, of half a height, and of a sea with the energy of its bins."""
    seaway = Fake(wave=lambda omega, *more: (omega, *more), regular=lambda wave, size=1e-3: [wave[0], size])
    seaway.irregular = lambda waves, energy: (waves, energy)
    monkeypatch.setattr(linear_api, "dataset_of_response", lambda *given: given[1:])
    bins = Fake(pairs=lambda: [(1.0, 30.0), (2.0, 40.0)], energy="energy")
    monkeypatch.setattr(linear_api, "bins_of", lambda sea: bins)
    periods = np.array([math.pi, 2 * math.pi])
    plain, small, high, height, irregular = linear_api._response(seaway, periods, None, None)
    assert (plain.tolist(), high, height, irregular) == (periods.tolist(), None, None, None)
    np.testing.assert_allclose(small, [[2.0, 1.0], [1e-3, 1e-3]], rtol=1e-14)
    _, _, high, height, irregular = linear_api._response(seaway, periods, 3.0, "sea")
    np.testing.assert_allclose(high, [[2.0, 1.0], [1.5, 1.5]], rtol=1e-14)
    assert (height, irregular) == (3.0, (bins, ([(1.0, 30.0), (2.0, 40.0)], "energy")))


@pytest.mark.parametrize(("given", "found"), [({}, 40.0), ({"direction_deg": 5.0}, 5.0), ({"waves": None}, 0.0)])
def test_a_response_is_to_the_waves_of_the_scene(monkeypatch, folders, given, found):
    """From 2 to 30 s, unless others are wanted; one rank computes it, and frees what it was made of."""
    freed = []
    monkeypatch.setattr(linear_api, "Seaway", lambda scene, way: Fake(way=way, destroy=lambda: freed.append(way)))
    monkeypatch.setattr(linear_api, "irregular_waves", lambda scene, sea, way: (sea, way))
    monkeypatch.setattr(linear_api, "_response", lambda seaway, *given: (seaway.way, *given))
    wave = {"amplitude": 0.5, "period": 5.0, "direction_deg": 40.0}
    scene = load_scene(CHAIN | {"sea": {"depth": 9.0}, "waves": wave}, cable__diameter=0.1)
    way, periods, height, sea = linear_api.response(scene, height=2.0, sea="sea", out="o", comm=ranks(), **given)
    assert (way, height, sea, freed) == (found, 2.0, ("sea", found), [found])
    quarter, whole = np.arange(40) / 4 + 2, np.arange(12, 31)
    assert periods.tolist() == [*quarter, *whole]
    assert linear_api.response(scene, [5, 6], comm=ranks())[1].tolist() == [5.0, 6.0]
    assert linear_api.response(scene, comm=ranks(1)) == "nothing"
    assert [call[:3] for call in folders.calls[:2]] == [("make_ready", "o", "response"), ("keep", "o", "response")]


@pytest.mark.parametrize("held", [False, True])
def test_a_stiffness_is_of_buoys_and_vessels(monkeypatch, folders, held):
    """Vessels alone on each rank; both need something that has one."""
    freed, comms = [], []
    problem = Fake(problem="problem", destroy=lambda: freed.append(True))
    monkeypatch.setattr(linear_api, "linearise", lambda scene, comm: comms.append(comm) or problem)
    monkeypatch.setattr(linear_api, "on_vessels", lambda found: ["vessel"])
    monkeypatch.setattr(linear_api, "restoring", lambda found: "restoring")
    monkeypatch.setattr(linear_api, "dataset_of_stiffness", lambda *given: given)
    line, comm = {"length": 12.0, "line_density": 1.0, "from": [9.0, 0.0, -9.0]}, ranks()
    ship = {"name": "ship", "position": [0, 0, 0], "fairleads": {"bow": [1, 0, 0]}}
    free = {"mass": 1.0, "inertia": [1.0, 1.0], "center_of_mass": 0.0}
    scene = {"cable": line | {"to": "ship.bow"}, "vessel": [ship]} if held else {"cable": line, "buoy": free}
    found = linear_api.stiffness(load_scene(scene), "o", comm)
    assert found == ("problem", "restoring", ["vessel"] if held else [])
    assert (freed, comms) == ([True], [MPI.COMM_SELF if held else comm])
    assert [call[:3] for call in folders.calls] == [("make_ready", "o", "stiffness"), ("keep", "o", "stiffness")]
    with pytest.raises(InputError, match=r"the scene needs \[buoy\] or \[\[vessel\]\]"):
        linear_api.stiffness(SCENE)
