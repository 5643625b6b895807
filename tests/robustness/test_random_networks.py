"""Random networks in either spelling end with satisfied balances, or with one message.

At rest the end forces on every line, joint and buoy balance its weight, the bed reaction and a bounded drag; in motion
every step is finite and complete, and in air momentum changes according to the forces.

Source: balances that hold for any network (network_judge.py).
"""

import numpy as np
import pytest
from network_judge import judge
from random_networks import ending, network
from respelling import respelled

from dolfbuoy import load_scene

#: Quick ones; the others are slow, or compile what others do not need.
FEW = (1, 2, 3, 4, 5, 7, 10, 11)


@pytest.mark.parametrize("number", FEW)
def test_random_network(number):
    assert judge(network(number))[0] in ("done", "refused", "failed")


@pytest.mark.slow
def test_many_random_networks():
    """Most come to their end."""
    found = {number: ending(number, 300.0) for number in range(300)}
    wrong = {number: said for number, said in found.items() if said[0] not in ("done", "refused", "failed")}
    assert not wrong
    ends = [how for how, _ in found.values()]
    assert np.mean([end == "done" for end in ends]) > 0.8


@pytest.mark.parametrize("first", range(0, 400, 100))
def test_either_spelling_of_a_random_network(first):
    """Has the same tables, once they are read."""
    one_of_a_kind = 0
    for number in range(first, first + 100):
        scene = network(number)
        other = respelled(scene)
        one_of_a_kind += other != scene
        assert outcome(other) == outcome(scene), number
    assert one_of_a_kind > 20


def outcome(scene):
    """What is read, or why not."""
    try:
        return load_scene(scene).network
    except ValueError as error:
        return str(error)
