"""Drag linearised in waves and seas, against closed forms; the response against runs in time.

Source: moments of the folded normal distribution, 8/(3 pi) of a cycle, the program's own runs in small waves.
"""

import math

import numpy as np
import pytest
from mpi4py import MPI
from scipy.stats import norm

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.linear.drag import LinearDrag, Sea, Velocities
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.response import small_waves
from dolfbuoy.linear.seaway import Seaway
from dolfbuoy.linear.spectrum import bins_of, irregular_waves
from dolfbuoy.results.response_record import complex_of, warnings
from dolfbuoy.studies.physics.response_runs import compared, measured

STRING = {
    "sea": {"depth": 50.0},
    "cable": {"length": 40.0, "line_density": 8.0, "diameter": 0.05, "axial_stiffness": 1e8, "elements": 10}
    | {"normal_drag": 1.2, "anchor": [0, 0, -45], "top": {"kind": "fixed", "position": [0, 0, -4.8]}},
}


def slopes(scene, velocities=None):
    """x^T E x and y^T E y of a line that moves evenly across itself; velocities: (sea -> LinearDrag's call)."""
    found = linearise(load_scene(scene), MPI.COMM_SELF, small_waves(load_scene(scene), 5.0))
    places, drag = found.lines[0].places, LinearDrag(Velocities(found))
    if velocities is not None:
        velocities(drag, len(places))
    E, values = drag.matrices()[1], []
    for axis in (0, 1):
        x = np.zeros(E.shape[1])
        x[places[places[:, axis] >= 0, axis]] = 1.0
        values.append(float(x @ (E @ x)))
    found.destroy()
    return np.array(values)


def flowing(speed):
    return STRING | {"current": {"speed": speed}}


#: (2 |U|, |U|) times this, from a current that is known exactly.
UNIT = slopes(flowing(2.0)) / [4.0, 2.0]


def gaussian(sigma):
    return lambda drag, n: drag.in_sea([Sea([sigma * np.tile([1.0 + 0j, 0, 0], (n, 1))], [])], [1.0])


def mean_size(U, sigma):
    """E|v| of a normal v."""
    return sigma * math.sqrt(2 / math.pi) * math.exp(-(U**2) / 2 / sigma**2) + U * (1 - 2 * norm.cdf(-U / sigma))


def test_slope_in_a_current():
    """The forms' own: 2 |U| along it and |U| across; the unit of all the others."""
    np.testing.assert_allclose(slopes(flowing(0.7)), UNIT * [1.4, 0.7], rtol=2e-3)
    assert np.all(UNIT > 0)
    assert np.abs(slopes(STRING)).max() < 1e-5 * UNIT.max()


@pytest.mark.parametrize("U", [0.0, 0.3, 1.0])
def test_borgman(U):
    """B_xx = 2 E|v| = sqrt(8/pi) sigma without a mean, B_yy = E|v|, with the mean current U."""
    sigma = 0.5
    found = slopes(flowing(U) if U else STRING, gaussian(sigma))
    exact = mean_size(U, sigma)
    if not U:
        assert 2 * exact == pytest.approx(math.sqrt(8 / math.pi) * sigma)
    np.testing.assert_allclose(found, UNIT * [2 * exact, exact], rtol=0.01)


def test_cycle():
    """8/(3 pi) of the amplitude to and fro, all of it round about: work of the drag in a cycle."""
    a = 0.8
    to_and_fro = lambda drag, n: drag.in_cycle(Sea([np.tile([1.0 + 0j, 0, 0], (n, 1))], []), a)  # noqa: E731
    round_about = lambda drag, n: drag.in_cycle(Sea([np.tile([1.0, 1j, 0], (n, 1))], []), a)  # noqa: E731
    assert slopes(STRING, to_and_fro)[0] == pytest.approx(UNIT[0] * 8 / (3 * math.pi) * a, rel=0.01)
    np.testing.assert_allclose(slopes(STRING, round_about), UNIT * a, rtol=1e-3)


def test_heave_of_a_disc():
    """At resonance, in waves of any height: 1/2 C rho A 8/(3 pi) V of the velocity relative to the water, by hand."""
    D, C, mass, axial = 3.0, 1.4, 3000.0, 0.6
    buoy = {"hull": [[0, D], [1.5, D]], "mass": mass, "center_of_mass": 0.3, "axial_drag": C}
    scene = load_scene({"sea": {"depth": 300.0}, "buoy": buoy | {"axial_added_mass": axial}})
    area = math.pi * D**2 / 4
    draft, added = mass / (1025 * area), axial * 1025 * 2 / 3 * math.pi * (D / 2) ** 3
    k_heave = 1025 * 9.81 * area
    T = 1.15 * 2 * math.pi * math.sqrt((mass + added) / k_heave)
    seaway = Seaway(scene)
    wave, a = seaway.wave(2 * math.pi / T), 0.4
    found = complex(seaway.motions(seaway.regular(wave, a))[0].heave)
    small = complex(seaway.motions(seaway.regular(wave))[0].heave)
    seaway.destroy()
    w = 2 * math.pi / T
    k = w**2 / 9.81
    inner = k_heave - w**2 * (mass + added)
    F = small * inner  # undamped: Froude-Krylov and added mass
    keel = -1j * w * math.exp(-k * draft)  # velocity of the water at the keel
    X = small
    for _ in range(200):
        c = 0.5 * C * 1025 * area * 8 / (3 * math.pi) * abs(-1j * w * X - keel) * a
        X = 0.5 * X + 0.5 * (F + c * keel) / (inner - 1j * w * c)
    assert found == pytest.approx(X, rel=0.02)
    assert abs(found) < 0.95 * abs(small)


def test_small_waves_against_runs():
    """Motions and tensions of `short` within 1 %; and what each costs."""
    scene, direction = load_scene("short"), 150.0
    found = dolfbuoy.response(scene, [5.0], comm=MPI.COMM_SELF).isel(period=0)
    own = {name: complex_of(found.rao.sel(motion=name)) for name in found.motion.values}
    own |= {name: complex_of(found.rao_tension.sel(tension=name)) for name in found.tension.values}
    run = measured(scene, 5.0, direction, 1e-3)
    for name in ("surge", "heave", "pitch", "tension_top", "tension_anchor"):
        assert abs(own[name] - run[name]) < 0.01 * abs(run[name]), name
    assert max(map(abs, compared(own, run).values())) < 1


@pytest.mark.slow
@pytest.mark.parametrize("period", [5.0, 8.0, 12.0])
def test_waves_of_a_metre_against_runs(period):
    """With the drag linearised: surge and heave within 2 %, tension within 5 %."""
    scene = load_scene("short")
    found = dolfbuoy.response(scene, [period], height=1.0, comm=MPI.COMM_SELF).isel(period=0)
    own = {name: complex_of(found.rao_drag.sel(motion=name)) for name in found.motion.values}
    own |= {name: complex_of(found.rao_drag_tension.sel(tension=name)) for name in found.tension.values}
    difference = compared(own, measured(scene, period, 150.0, 0.5))
    assert max(abs(difference[name]) for name in ("surge", "heave")) < 2
    assert abs(difference["tension_top"]) < 5


def test_irregular_sea():
    """Energy of the bins, a free disc that follows long waves, and what grows with the height."""
    scene = load_scene("short")
    omega, energies = bins_of(irregular_waves(scene, (2.0, 8.0)))
    assert energies.sum() == pytest.approx(2.0**2 / 16, rel=2e-3)
    assert np.all(np.diff(omega) > 0)
    low = dolfbuoy.response(scene, [5.0], sea=(0.1, 7.0), comm=MPI.COMM_SELF)
    high = dolfbuoy.response(scene, [5.0], sea=(2.0, 7.0), comm=MPI.COMM_SELF)
    heave = [found.motion_std.sel(motion="heave").item() for found in (low, high)]
    assert heave[0] == pytest.approx(0.1 / 4, rel=0.1)
    tension = [found.tension_std.values[0] for found in (low, high)]
    assert tension[1] / tension[0] != pytest.approx(20, rel=0.02)  # drag has its part
    total = float(np.trapezoid(low.tension_spectrum[0], low.omega) if hasattr(np, "trapezoid")
                  else np.trapz(low.tension_spectrum[0], low.omega))  # fmt: skip
    assert total == pytest.approx(low.tension_std[0].item() ** 2, rel=0.02)
    assert not warnings(low)
    assert any("three standard deviations" in sentence for sentence in warnings(high))
    assert "no extremes" in high.attrs["comment"]


def test_a_scene_with_an_irregular_sea():
    """Its spectrum serves, without an option."""
    waves = {"spectrum": "jonswap", "significant_height": 0.4, "peak_period": 6.0, "direction_deg": 150.0}
    scene = load_scene(load_scene("short").to_dict() | {"waves": waves})
    found = dolfbuoy.response(scene, [5.0], comm=MPI.COMM_SELF)
    same = dolfbuoy.response("short", [5.0], sea=(0.4, 6.0, 3.3), comm=MPI.COMM_SELF)
    np.testing.assert_allclose(found.tension_std, same.tension_std, rtol=1e-3)


def test_a_line_without_a_buoy():
    """Tension at its anchor only."""
    found = dolfbuoy.response("jumper", [8.0, 12.0], height=1.0, comm=MPI.COMM_SELF)
    assert found.tension.values.tolist() == ["tension_anchor"]
    assert "rao" not in found
    assert np.all(np.abs(complex_of(found.rao_drag_tension)) > 0)


def test_refusals():
    with pytest.raises(InputError, match=r"needs \[sea\]"):
        dolfbuoy.response("hanging-chain", comm=MPI.COMM_SELF)
    with pytest.raises(InputError, match="must be a height"):
        dolfbuoy.response("short", [5.0], sea=(-1.0, 5.0), comm=MPI.COMM_SELF)
