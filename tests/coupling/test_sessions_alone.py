"""Parts of a session, each alone: its start, loads, steps taken back, output and end.

Source: the promises of README and the docstrings of Session; made-up simulations that record their calls.
"""

from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy import InputError, load_scene
from dolfbuoy.coupling import saved, session
from dolfbuoy.coupling.session import Session
from dolfbuoy.model.buoy import MOTION

# -- the beginning -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"scene": "short", "resume": "x"},
        {"resume": "x", "out": "y"},
        {"resume": "x", "time__end": 3.0},
    ],
)
def test_a_session_has_one_scene(given):
    with pytest.raises(InputError, match="A session needs a scene, or resume = a folder, which then brings"):
        Session(comm=MPI.COMM_SELF, **given)


@pytest.mark.parametrize("rank", [0, 1])
def test_a_folder_is_taken(monkeypatch, rank):
    """Rank 0 writes; an existing run is kept unless `overwrite`; a resumed run is not restarted."""
    told, there = [], []
    s = Fake(scene="scene", comm=Fake(rank=rank))
    fakes = {name: lambda *given, name=name, **more: told.append((name, *given, more)) for name in ("begin", "remark")}
    fakes |= {"holds": lambda *given: there.append(given) or len(there) == 2}
    fakes |= {"go_on": lambda *given: told.append(("go_on", *given, {}))}
    monkeypatch.setattr(session, "folders", Fake(**fakes))
    folder = Path("x")
    remark = [("remark", folder, "run", {"session": True})] * (rank == 0)
    Session._take(s, folder, None, True)
    assert told == [("begin", folder, "run", "scene", {})] * (rank == 0) + remark
    assert there == [(folder, "run", "scene", True, s.comm)]
    told.clear()
    with pytest.raises(InputError, match="x holds a run of this scene: take another folder, or overwrite = True"):
        Session._take(s, folder, None, False)
    assert not told
    Session._take(s, folder, "checkpoint", False)
    assert told == [("go_on", folder, "scene", s.comm, {}), *remark]
    assert len(there) == 2


def test_a_driven_body_is_where_its_scene_has_it_until_it_has_a_path():
    s = Fake(paths={"a": lambda t: ("there", t)})
    assert Session._place(s, "a", 2.5) == ("there", 2.5)
    assert Session._place(s, "b", 2.5) is None


# -- loads -------------------------------------------------------------------------------------------------------------


class Made:
    """A load function that records when it is stopped."""

    def __init__(self, simulation, rows, buoy):
        self.made, self.function, self.stopped = (simulation, rows, buoy), None, 0

    def stop(self):
        self.stopped += 1
        self.function = None


@pytest.fixture
def loaded(monkeypatch):
    rows = {"buoy": (6, np.arange(2, 8)), "end": (3, np.arange(8, 11)), "far": (6, np.zeros(0, int))}
    monkeypatch.setattr(session.names, "loaded_rows", lambda problem, name, paths: rows[name])
    monkeypatch.setattr(session, "Force", Made)
    numbers = Fake(valid=True)
    simulation = Fake(
        problem=Fake(buoys={"buoy": "body"}), newton=Fake(numbers=numbers), system=Fake(loads=np.zeros(12))
    )
    return Fake(simulation=simulation, paths={}, _forces={}, _awaited=set(), t=1.5)


def test_loads_that_are_numbers(loaded):
    """Against the rows of the equations; a point of a line takes no moment but that of 0."""
    Session.load(loaded, "buoy", [1, 2, 3], [4, 5, 6])
    Session.load(loaded, "end", [7, 8, 9], [0, 0, 0])
    Session.load(loaded, "far", [7, 8, 9])
    assert loaded.simulation.system.loads.tolist() == [0, 0, -1, -2, -3, -4, -5, -6, -7, -8, -9, 0]
    Session.load(loaded, "buoy")
    assert loaded.simulation.system.loads.tolist() == [0] * 8 + [-7, -8, -9, 0]
    assert loaded.simulation.newton.numbers.valid
    with pytest.raises(InputError, match="moment: 'end' is a point of a line, which takes none"):
        Session.load(loaded, "end", [1, 2, 3], [0, 0, 1e-9])
    for load in ([1e15, 0, 0], [-1e15, 0, 0]):
        Session.load(loaded, "end", load)
    for key, value in (("force", [2e15, 0, 0]), ("moment", [0, 0, -2e15])):
        with pytest.raises(InputError, match=rf"{key} = .* must be 3 numbers of 1e\+15 at most"):
            Session.load(loaded, "buoy", **{key: value})


def test_loads_that_are_functions(loaded):
    """One Force for each part; the matrix is recomputed unless kept with this function's slopes."""
    numbers = loaded.simulation.newton.numbers
    Session.load(loaded, "buoy", one := lambda t, state: [t, 0, 0])
    force = loaded._forces["buoy"]
    assert force.made[0] is loaded.simulation
    assert (force.made[1].tolist(), force.made[2], force.function) == ([*range(2, 8)], "body", one)
    assert not numbers.valid
    numbers.valid, loaded._awaited = True, {(1.5, "buoy")}
    Session.load(loaded, "buoy", other := lambda t, state: [0, t, 0])
    assert loaded._forces == {"buoy": force}
    assert (force.function, numbers.valid, force.stopped) == (other, True, 0)
    Session.load(loaded, "far", one)
    assert [*loaded._forces] == ["buoy"]
    Session.load(loaded, "buoy", [1, 2, 3])
    assert (force.stopped, loaded.simulation.system.loads[2:5].tolist()) == (1, [-1, -2, -3])
    Session.load(loaded, "end", one)
    assert loaded._forces["end"].made[2] is None


def test_rows_that_are_loaded():
    """Of a buoy the rows of both momenta; of a joint with a body that body's; else of an end that is on this rank."""
    rope = {"length": 16.0, "line_density": 2.0, "elements": 3}
    hull = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
    lines = [{"name": "a", "from": [0, 0, 0], "to": "Y"}, {"name": "b", "from": "Y", "to": "Z"}]
    lines += [{"name": "c", "from": "Z", "to": "float"}, {"name": "d", "from": [9, 0, 0], "top": {"kind": "free"}}]
    scene = load_scene(
        {
            "cable": [rope | line for line in lines],
            "joint": [{"name": "Y", "mass": 5.0}, {"name": "Z"}],
            "buoy": hull | {"name": "float"},
        }
    )
    owned = []
    at = {(k, i): np.array([100 * k + 10 * i + j for j in range(3)]) for k in range(4) for i in (0, 1)}
    ends = [[at[k, 0], at[k, 1]] for k in range(4)]
    held = Fake(end_dofs=ends, owns_end=lambda piece, end: owned.append((piece, end)) or True)
    bodies = Fake(part=Fake(offset=1000), names=["X", "Y"], dofs=np.array([[0, 1, 2], [3, 4, 5]]))
    buoys = {"float": Fake(part=Fake(slice=slice(2000, 2013)))}
    problem = Fake(network=scene.network, buoys=buoys, bodies=bodies, lines=held)

    def rows(name, driven=()):
        count, found = session.names.loaded_rows(problem, name, driven)
        return count, found.tolist()

    momenta = MOTION.of(np.arange(2000, 2013))
    assert rows("float") == (6, [*momenta.momentum, *momenta.angular_momentum])
    assert rows("Y") == (3, [1003, 1004, 1005])
    assert not owned
    assert rows("Z") == (3, at[owned[-1]].tolist())
    assert owned[-1] in ((1, 1), (2, 0))
    assert rows("d.to") == (3, at[3, 1].tolist())
    said = r"must be of what moves freely: Y, Z, d.to\."
    for name in ("float", "a.from", "x"):
        with pytest.raises(InputError, match=f"load: {name!r} {said}"):
            rows(name, ["float"])
    problem.buoys, problem.bodies, held.owns_end = {}, None, lambda piece, end: False
    assert [rows(name) for name in ("float", "Y", "Z", "d.to")] == [(6, []), (3, []), (3, []), (3, [])]


# -- back to an instant ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("recorded", [True, False])
@pytest.mark.parametrize("assembled", [7, 8])
@pytest.mark.parametrize("matrix", [None, "matrix"])
def test_an_instant_is_restored(monkeypatch, recorded, assembled, matrix):
    """With the matrix that is still there; functions as they were, and the record as long."""
    back, marks, own = [], [], {"functions": {"a": "function"}}
    monkeypatch.setattr(session, "put_back", lambda *given: back.append(given))
    numbers = Fake(assembled=7, valid="before", kept=True)
    simulation = Fake(newton=Fake(numbers=numbers), restore=lambda state: back.append(state))
    forces = {name: Made(0, 0, 0) for name in "ab"}
    forces["b"].function = "later"
    s = Fake(simulation=simulation, _forces=forces, _recorder=Fake(rewind=marks.append) if recorded else None)
    state = {"t": 1.0, "newton": {"matrix": matrix, "other": 3}}
    Session.restore(s, session.Saved(id(s), state, assembled, own, "mark" if recorded else None))
    same = assembled == 7
    assert back == [{"t": 1.0, "newton": {"matrix": None if same else matrix, "other": 3}}, (s, own)]
    assert state["newton"]["matrix"] == matrix
    assert (numbers.valid, numbers.kept) == ((matrix is not None, False) if same else ("before", True))
    assert [(one.function, one.stopped) for one in forces.values()] == [("function", 1), (None, 1)]
    assert marks == ["mark"] * recorded


def test_instants_that_cannot_be_restored():
    s = Fake(_recorder="recorder", simulation=None)
    with pytest.raises(InputError, match="restore: the state is that of another session"):
        Session.restore(s, session.Saved(id(s) + 1, {}, 0, {}, "mark"))
    with pytest.raises(InputError, match="restore: the session writes a record, which a state from elsewhere has no"):
        Session.restore(s, session.Saved(id(s), {}, 0, {}, None))
    with pytest.raises(InputError, match="pack: the session writes a record, which another one would not go on with"):
        saved.pack(s, session.Saved(id(s), {}, 0, {}, "mark"))


# -- the end -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rank", [0, 1])
def test_a_session_ends_once(monkeypatch, rank):
    """With a complete record; after an error with the record so far."""
    told = []
    monkeypatch.setattr(session, "folders", Fake(finish=lambda *given: told.append(given)))
    for error, done in ((None, ["save", *[("x", "run")] * (rank == 0), "freed"]), (ValueError, ["close", "freed"])):
        told.clear()
        s = object.__new__(Session)
        s.comm, s._open = Fake(rank=rank), ExitStack()
        s._open.callback(told.append, "freed")
        s._recorder = Fake(folder="x", save=lambda: told.append("save"), close=lambda: told.append("close"))
        assert s.__enter__() is s
        s.__exit__(error, None, None)
        s.close()
        assert told == done
        assert s._recorder is None
