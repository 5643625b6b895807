"""Loops of the C core, each alone on a few made-up numbers.

Source: the same sums with NumPy.
"""

import numpy as np
import pytest

from dolfbuoy.solver.c_code import address, core
from dolfbuoy.solver.loops import Scaled

RANDOM = np.random.default_rng(5)


def pairs(z):
    """Real and imaginary parts in turn."""
    return np.ascontiguousarray(np.stack([np.real(z), np.imag(z)], axis=-1))


def complexes(*shape):
    """Any complex numbers."""
    return RANDOM.normal(size=shape) + 1j * RANDOM.normal(size=shape)


def made(kind, **given):
    """A struct of the core, with what it points to, which is to stay alive."""
    arrays = {name: np.ascontiguousarray(x) for name, x in given.items() if not isinstance(x, int)}
    numbers = {name: x for name, x in given.items() if isinstance(x, int)}
    return core().ffi.new(f"{kind} *", {**numbers, **{name: address(x) for name, x in arrays.items()}}), arrays


def test_entries_that_are_tied_add_up_what_stands_in_their_places():
    """Put goes to all places of an entry, take adds to what another place has given; each in units of the entry."""
    values, scale = np.array([1.0, 2.0, 4.0, 8.0]), np.array([10.0, 100.0])
    entries = Scaled(values, [0, 2], scale, ([1, 3], [1, 1]))
    np.testing.assert_array_equal(entries.take(), [10, 100 * (4 + 2 + 8)])
    entries.put(np.array([3.0, 5.0]))
    np.testing.assert_array_equal(values, [30, 500, 500, 500])


@pytest.mark.parametrize("once", [False, True])
def test_force_of_diffracted_waves_and_its_slope(once):
    """A sum of components at the place of the body, kept while the time is the same if it is taken once."""
    count = 4
    kx, ky, phase = RANDOM.normal(size=(3, count))
    transfer, position = complexes(count, 5), np.array([0.7, -1.3, 0.2])
    given = {"kx": kx, "ky": ky, "phase": phase, "scale": np.array([0.6]), "transfer": pairs(transfer)}
    room = {"force": np.zeros(5), "slope": np.zeros((5, 2)), "place": np.zeros(2)}
    serial = np.array([3], np.int32)
    context, kept = made("diffraction", count=count, **given, position=position, **room)
    if once:
        context.serial = core().ffi.from_buffer("int[]", serial)

    def force(x, y):
        return 0.6 * (transfer * np.exp(1j * (kx * x + ky * y + phase))[:, None]).real.sum(axis=0)

    def check(x, y, h=1e-6):
        core().lib.diffract(context, core().ffi.NULL)
        slopes = [force(x + h, y) - force(x - h, y), force(x, y + h) - force(x, y - h)]
        np.testing.assert_allclose(kept["force"], force(x, y), rtol=1e-12)
        np.testing.assert_allclose(kept["slope"], np.transpose(slopes) / (2 * h), rtol=1e-7, atol=1e-8)
        np.testing.assert_array_equal(kept["place"], [x, y])

    check(0.7, -1.3)
    kept["position"][:2] = 2.0, 0.4
    check(*((0.7, -1.3) if once else (2.0, 0.4)))
    serial[0] = 4
    check(2.0, 0.4)


def test_memory_of_waves_of_one_step():
    """z = (into . v - history)/(gamma - rate), and what is left of F = -Re(out z) by it."""
    modes = 3
    rate, history, into, out = -1 + complexes(modes), complexes(modes), complexes(modes, 5), complexes(modes, 5)
    quaternion, momentum, angular = (RANDOM.normal(size=n) for n in (4, 3, 3))
    a, (b, c, d) = quaternion[0], quaternion[1:]
    cross = np.array([[0, -d, c], [d, 0, -b], [-c, b, 0]])
    R = np.eye(3) + 2 * (a * cross + cross @ cross) / (quaternion @ quaternion)
    mass, inertia, gamma = 7.0, np.array([3.0, 3.0, 5.0]), 12.0
    turn = R @ ((R.T @ angular) / inertia)
    v = np.concatenate([momentum / mass, np.cross(turn, R[:, 2])[:2]])
    rule = {"rate": pairs(rate), "into": pairs(into), "out": pairs(out), "history": pairs(history)}
    state = {"momentum": momentum, "quaternion": quaternion, "angular_momentum": angular}
    numbers = {"mass": np.array([mass]), "inertia": inertia, "gamma": np.array([gamma])}
    room = {"damping": np.ones((5, 5)), "force": np.ones(5), "states": np.zeros((modes, 2))}
    context, kept = made("memory", modes=modes, **rule, **state, **numbers, **room)
    core().lib.recall(context)
    z = (into @ v - history) / (gamma - rate)
    np.testing.assert_allclose(kept["states"], pairs(z), rtol=1e-12)
    core().lib.eliminate(context)
    np.testing.assert_allclose(kept["force"] - kept["damping"] @ v, -(out.T @ z).real, rtol=1e-12)
    free = (out.T @ (history / (gamma - rate))).real
    np.testing.assert_allclose(kept["force"], free, rtol=1e-12)
