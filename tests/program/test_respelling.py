"""A scene gives the same `check`, equilibrium and first steps with single and with double brackets.

Source: the same scene in the other spelling.
"""

import math

import numpy as np
import pytest
from figure_scenes import MOORED, NETWORK
from mpi4py import MPI
from respelling import respelled, spelled

from dolfbuoy import InputError, load_scene, simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.scene import shipped_scenes
from dolfbuoy.sensitivity.design import design
from dolfbuoy.sensitivity.parameters import parameters_of

#: A cable longer than the water is deep under a plain cylinder: it hangs slack, without anything that pulls.
SLACK = {
    "sea": {"depth": 20.0},
    "cable": MOORED["cable"] | {"elements": 20},
    "buoy": {"hull": [[0.0, 1.6], [2.8, 1.6]], "mass": 2400.0, "center_of_mass": 0.9},
    "time": {"end": 1.0, "step": 0.02},
}
#: Scenes beside the shipped ones: everything at once, one slack line, a material by its name, buoys alone.
OTHERS = {
    "moored": MOORED,
    "several": NETWORK,
    "slack": SLACK,
    "material": MOORED | {"cable": {"length": 22.0, "elements": 6, "material": "polyester 60 mm"}},
    "alone": {"sea": {"depth": 20.0}, "buoy": SLACK["buoy"], "time": SLACK["time"]},
}
QUICK = ["moored", "slack", "material", "alone", "navigation-buoy", "chain-on-bed", "hanging-chain"]


def both(name):
    """The scene as it is spelled, and respelled."""
    scene = OTHERS[name] if name in OTHERS else spelled(name)
    return scene, respelled(scene)


def is_spelled_twice(name):
    """Whether there is one cable or one buoy in it."""
    scene, other = both(name)
    return scene != other


SLOW = [name for name in (*shipped_scenes(), *OTHERS) if name not in QUICK and is_spelled_twice(name)]


every_scene = pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])


@every_scene
def test_check_says_the_same(name):
    assert is_spelled_twice(name)
    one, other = (check(load_scene(scene), MPI.COMM_SELF) for scene in both(name))
    assert [row[0] for row in one.numbers] == [row[0] for row in other.numbers]
    for (what, value, *said), (_, respelled_value, *respelled_said) in zip(one.numbers, other.numbers, strict=True):
        assert said == respelled_said, what
        assert respelled_value == pytest.approx(value, rel=1e-9, abs=1e-12, nan_ok=True), what
    assert one.effects == other.effects
    assert one.warnings == other.warnings
    assert other.periods == pytest.approx(one.periods, rel=1e-6)


def same(one, other):
    """Two records hold the same, to 1e-9 of the largest number of each quantity."""
    one, other = one.squeeze(drop=True), other.squeeze(drop=True)
    assert set(one.variables) == set(other.variables)
    for name in one.data_vars:
        a, b = one[name].values, other[name].values
        assert a.shape == b.shape, name
        if a.dtype.kind == "f":
            scale = np.nanmax(np.abs(a), initial=0.0)
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * scale, equal_nan=True, err_msg=name)
        else:
            assert np.array_equal(a, b), name


@every_scene
def test_the_same_rest_in_the_same_way(name):
    scene, other = (load_scene(scene) for scene in both(name))
    if scene.initial.kind != "equilibrium":
        assert other.initial == scene.initial  # a towed or released line has no rest to find
        return
    rest, respelled_rest = (solve_static(scene, comm=MPI.COMM_SELF) for scene in (scene, other))
    assert respelled_rest.attrs["route"] == rest.attrs["route"]
    assert int(respelled_rest.newton_iterations) == int(rest.newton_iterations)
    same(rest, respelled_rest)


@every_scene
def test_the_same_first_steps(name):
    scene, other = both(name)
    end = 10 * scene["time"]["step"]
    record, respelled_record = (simulate(load_scene(s, time__end=end), comm=MPI.COMM_SELF) for s in (scene, other))
    assert len(record.time) >= 11
    assert math.isclose(float(record.time[-1]), end)
    same(record, respelled_record)


@pytest.mark.parametrize("name", [None, "riser"])
@pytest.mark.parametrize("brackets", [False, True])
def test_a_key_of_the_only_cable_is_one_number(name, brackets):
    """Without a name, counted, and by its name: in changes, derivatives and expressions of a design."""
    cable = MOORED["cable"] | ({"name": name} if name else {})
    scene = load_scene(MOORED | {"cable": [cable] if brackets else cable})
    keys = ["cable.length", "cable.0.length", f"cable.{name or 'cable'}.length"]
    assert {load_scene(scene, **{key: 31.0}).cables[0].length for key in keys} == {31.0}
    assert {parameter.key for parameter in parameters_of(scene, keys)} == {"cable.length"}
    for vary, least in ((keys[0], keys[2]), (keys[2], keys[0])):
        found = design(scene, {vary: (24.0, 30.0)}, least, [f"{keys[1]} > 25"])
        assert found.scene.cables[0].length == pytest.approx(25.0, rel=1e-6)
    with pytest.raises(InputError, match=r"^--by cable\.other\.length: is no number of this scene"):
        parameters_of(scene, ["cable.other.length"])
