"""Problems release all their PETSc objects, also after an exception.

Source: counts of created and destroyed problems.
"""

from functools import partial

import pytest
from mpi4py import MPI

from dolfbuoy import Session, load_scene
from dolfbuoy.coupling import names
from dolfbuoy.errors import SolveError
from dolfbuoy.linear import periods, seaway
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion import start, tangent
from dolfbuoy.results import measured
from dolfbuoy.sensitivity import derivatives, parameters
from dolfbuoy.statics import offsets, righting, ways

HANGING = partial(load_scene, "driven", **{"cable.elements": 4, "time.end": 0.2, "time.step": 0.1})
FALLING = partial(load_scene, "hanging-chain", **{"cable.elements": 4, "time.end": 0.02, "time.step": 0.01})
JOINED = partial(
    load_scene,
    {
        "joint": [{"name": "Y"}],
        "cable": [
            {"name": "a", "from": [0, 0, 0], "to": "Y", "length": 6.0, "line_density": 2.0, "elements": 2},
            {"name": "b", "from": [8, 0, 0], "to": "Y", "length": 6.0, "line_density": 2.0, "elements": 2},
        ],
        "time": {"end": 1.0, "step": 0.1},
    },
)
AFLOAT, MOORED = partial(load_scene, "free-buoy"), partial(load_scene, "short", **{"cable.elements": 4})


@pytest.fixture
def there(monkeypatch):
    """Problems that were made and are not destroyed yet, by their identity, and all that were made."""
    now, every, make, destroy = set(), [], Problem.__init__, Problem.destroy

    def made(self, *arguments, **options):
        make(self, *arguments, **options)
        now.add(id(self))
        every.append(self)  # so that no identity comes twice

    def gone(self):
        now.discard(id(self))
        destroy(self)

    monkeypatch.setattr(Problem, "__init__", made)
    monkeypatch.setattr(Problem, "destroy", gone)
    return now, every


def numbers_of(scene, *keys):
    return scene, parameters.parameters_of(scene, list(keys))


def fails(*_, **__):
    raise SolveError("it diverged")


CALLS = {
    "derivatives of a run": (
        lambda: derivatives.of_run(*numbers_of(HANGING(), "cable.line_density"), MPI.COMM_SELF),
        4,
    ),
    "derivatives of what moves": (
        lambda: derivatives.of_run(*numbers_of(FALLING(), "cable.line_density"), MPI.COMM_SELF),
        6,
    ),
    "derivatives at rest": (
        lambda: derivatives.of_equilibrium(*numbers_of(HANGING(), "cable.line_density"), MPI.COMM_SELF),
        1,
    ),
    "periods of buoys": (lambda: periods.buoy_periods(AFLOAT()), 2),
    "periods of what is moored": (lambda: periods.moored_periods(MOORED()), 2),
    "response": (lambda: seaway.responses(AFLOAT(), [5.0]), 2),
    "righting levers": (lambda: righting.righting_curve(AFLOAT(), [10.0]), 1),
    "offsets": (lambda: list(offsets.rests(MOORED(), "force", [10.0, 20.0], [0.0], MPI.COMM_SELF)), 1),
    "the first offset": (lambda: next(offsets.rests(MOORED(), "force", [10.0], [0.0], MPI.COMM_SELF)), 1),
    "a start at rest": (lambda: start.initial_state(HANGING(), MPI.COMM_SELF), 1),
    "a start along a line": (lambda: start.initial_state(load_scene("hanging-chain"), MPI.COMM_SELF), 1),
    "a start between poses": (
        lambda: start.initial_state(MOORED(**{"buoy.initial.buoy_position": [1.0, 0.0, -0.5]}), MPI.COMM_SELF),
        1,
    ),
    "runs of which a quantity is kept": (lambda: measured.compute(HANGING(), ["tension_top"], repeats=2), 2),
    "a free joint that is driven": (lambda: names.holding_joints(JOINED(), ["Y"], MPI.COMM_SELF), 1),
    "a session": (lambda: Session(HANGING(), comm=MPI.COMM_SELF).close(), 1),
}


@pytest.mark.parametrize(("call", "least"), CALLS.values(), ids=CALLS)
def test_nothing_is_left(call, least, there):
    now, every = there
    call()
    assert (len(now), len(every) >= least) == (0, True)


def test_nothing_is_left_of_neighbours_that_cannot_be_made(there, monkeypatch):
    """Of the run, and of those that were made before."""
    now, every = there
    scene, numbers = numbers_of(HANGING(), "cable.line_density", "cable.length")
    begun = tangent.Pair.__init__

    def second(self, run, direction, make):
        if direction.key == "cable.length":
            fails()
        begun(self, run, direction, make)

    monkeypatch.setattr(tangent.Pair, "__init__", second)
    with pytest.raises(SolveError, match="it diverged"):
        derivatives.of_run(scene, numbers, MPI.COMM_SELF)
    assert (len(now), len(every) >= 2) == (0, True)


@pytest.mark.parametrize(
    ("module", "name", "call"),
    [
        (periods, "natural_periods", lambda: periods.buoy_periods(AFLOAT())),
        (periods, "natural_periods", lambda: periods.moored_periods(MOORED())),
        (seaway.Seaway, "wave", lambda: seaway.responses(AFLOAT(), [5.0])),
        (righting, "_lift", lambda: righting.righting_curve(AFLOAT(), [10.0])),
        (measured, "_look", lambda: measured.compute(HANGING(), ["tension_top"])),
        (names, "_place_of", lambda: names.holding_joints(JOINED(), ["Y"], MPI.COMM_SELF)),
        (Session, "_find_required", lambda: Session(HANGING(), comm=MPI.COMM_SELF)),
    ],
)
def test_nothing_is_left_of_what_fails(module, name, call, there, monkeypatch):
    now, every = there
    monkeypatch.setattr(module, name, fails)
    with pytest.raises(SolveError, match="it diverged"):
        call()
    assert (len(now), len(every) >= 1) == (0, True)


@pytest.mark.parametrize("name", ["driven", "driven-slack"])
def test_no_object_of_petsc_is_left(name):
    """Of a system with a law and of one without."""
    problem = Problem(load_scene(name), dynamic=True, comm=MPI.COMM_SELF)
    system, newton = problem.system, problem.newton
    objects = [system.A, system.row_vector, system.unknown_vector, system.numbering.lgmap]
    objects += [newton.snes, newton.x, newton._f, newton._increment]
    objects += [system.law._diagonal] if system.law is not None else []
    assert len(objects) == (9 if name == "driven-slack" else 8)
    assert all(one.handle for one in objects)
    problem.destroy()
    assert not any(one.handle for one in objects)


@pytest.mark.parametrize("works", [True, False])
def test_the_problem_of_the_other_law_is_given_back(works, there, monkeypatch):
    """And its iterations are counted where it works."""
    now, every = there
    problem = Problem(HANGING(), dynamic=False, comm=MPI.COMM_SELF)
    problem.iterations, seen = 100, []

    def found(other, put, given):
        put()
        seen.append((other.law is None, [way.name for way in given]))
        other.iterations += 7
        if not works:
            fails()

    monkeypatch.setattr(ways, "find_rest", found)
    monkeypatch.setattr(ways, "newton", lambda problem: None)
    if works:
        ways.by_the_other_law(problem)
    else:
        with pytest.raises(SolveError):
            ways.by_the_other_law(problem)
    assert (len(now), len(every)) == (1, 2)
    assert problem.iterations == (107 if works else 100)
    assert seen == [(False, ["newton", "large steps", "large steps, smaller first", "current", "relaxation"])]
    problem.destroy()
