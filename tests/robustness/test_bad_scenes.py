"""Random wrong, odd and extreme scenes are each accepted, or refused in one message, without traceback or delay.

Source: what is promised for any input; at most one in a hundred may break it.
"""

import signal
from collections import Counter

import pytest
from bad_scenes import bad_scene

from dolfbuoy import simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.feasible import check_feasible
from dolfbuoy.scene import load_scene
from dolfbuoy.statics.first_shape import check_first_shape

#: Of a scene before it counts as one that hangs [s].
PATIENCE = 60


def read(data):
    """All that is looked at before anything is built."""
    scene = load_scene(data)
    check_feasible(scene)
    check_first_shape(scene)
    return scene


def first_steps(scene):
    """Ten steps, of a scene with [time]."""
    if scene.time is not None:
        simulate(scene, time={"end": min(scene.time.end, 10 * scene.time.step)})


def ends(numbers, hard=False, then=lambda scene: None):
    """(how the scenes of these numbers end, what broke the promise)."""
    found, broken = Counter(), []
    former = signal.signal(signal.SIGALRM, _wait_is_over)
    try:
        for number in numbers:
            signal.alarm(PATIENCE)
            try:
                then(read(bad_scene(number, hard)))
                found["scene"] += 1
            except (InputError, SolveError) as error:
                found["sentence"] += 1
                if not _is_sentence(str(error)):
                    broken.append((number, str(error)))
            except Exception as error:  # that is what is looked for
                broken.append((number, repr(error)))
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)
    return found, broken


def _wait_is_over(*_):
    raise TimeoutError


def _is_sentence(said):
    return said.isprintable() and len(said) < 800 and "instance of" not in said and "Traceback" not in said


def test_a_hundred_are_read_or_refused():
    found, broken = ends(range(100))
    assert broken == []
    assert min(found.values()) >= 5


@pytest.mark.slow
def test_two_thousand_are_read_or_refused():
    _, broken = ends(range(100, 2100))
    assert len(broken) <= 20, broken


@pytest.mark.slow
@pytest.mark.parametrize("then", [check, solve_static, first_steps])
def test_what_is_read_is_solved_or_fails_in_a_sentence(then):
    _, broken = ends(range(200), True, then)
    assert len(broken) <= 2, broken
