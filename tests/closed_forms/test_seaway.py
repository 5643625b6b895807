"""Linearised drag in regular and irregular waves against closed forms; linear response against runs in time.

Source: moments of the folded normal distribution, 8/(3 pi) for a cycle, the program's own runs in small waves.
"""

import math

import alone
import numpy as np
import pytest
from mpi4py import MPI
from scipy.stats import norm

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.linear.drag import LinearDrag, Sea, Velocities
from dolfbuoy.linear.linearisation import WithReactions, linearise
from dolfbuoy.linear.seaway import Seaway
from dolfbuoy.linear.spectrum import bins_of, irregular_waves, small_waves
from dolfbuoy.results.labelled import complex_of
from dolfbuoy.results.linear_record import warnings
from dolfbuoy.scene.waves import Waves
from dolfbuoy.studies.physics.response_runs import compared, measured, measured_in_sea

STRING = {
    "sea": {"depth": 50.0},
    "cable": {"length": 40.0, "line_density": 8.0, "diameter": 0.05, "axial_stiffness": 1e8, "elements": 10}
    | {"normal_drag": 1.2, "anchor": [0, 0, -45], "top": {"kind": "fixed", "position": [0, 0, -4.8]}},
}


def slopes(scene, velocities=None):
    """x^T E x and y^T E y of a line that moves evenly across itself; velocities: (sea -> LinearDrag's call)."""
    found = linearise(load_scene(scene), MPI.COMM_SELF, small_waves(load_scene(scene), 5.0))
    places, drag = found.lines[0].places, LinearDrag(Velocities(found), WithReactions(found))
    if velocities is not None:
        velocities(drag, len(places))
    E, values = drag.matrices()[1][: found.K.shape[0]], []
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


@pytest.mark.parametrize("regular", [True, False])
def test_heave_of_a_disc(regular):
    """At resonance, in waves of any height: 1/2 C rho A V of the velocity relative to the water, by hand.

    V is 8/(3 pi) of its amplitude in regular waves, Borgman's sqrt(8/pi) of its standard deviation in a sea.
    """
    D, C, mass, axial = 3.0, 1.4, 3000.0, 0.6
    buoy = {"hull": [[0, D], [1.5, D]], "mass": mass, "center_of_mass": 0.3, "axial_drag": C}
    scene = load_scene({"sea": {"depth": 300.0}, "buoy": buoy | {"axial_added_mass": axial}})
    area = math.pi * D**2 / 4
    draft, added = mass / (1025 * area), axial * 1025 * 2 / 3 * math.pi * (D / 2) ** 3
    k_heave = 1025 * 9.81 * area
    T = 1.15 * 2 * math.pi * math.sqrt((mass + added) / k_heave)
    seaway = Seaway(scene)
    wave, a = seaway.wave(2 * math.pi / T), 0.4
    if regular:
        found, factor = complex(seaway.motions(seaway.regular(wave, a))[0].heave), 8 / (3 * math.pi)
    else:  # Re[X a e^(-i w t)] at once, and a quarter of a period later
        moved = seaway.over_time(Waves(components=[[a, T, 0.0, 0.0]]), np.array([0.0, T / 4]))["heave"]
        found, factor = complex(*moved) / a, math.sqrt(8 / math.pi) / math.sqrt(2)
    small = complex(seaway.motions(seaway.regular(wave))[0].heave)
    seaway.destroy()
    w = 2 * math.pi / T
    k = w**2 / 9.81
    inner = k_heave - w**2 * (mass + added)
    F = small * inner  # undamped: Froude-Krylov and added mass
    keel = -1j * w * math.exp(-k * draft)  # velocity of the water at the keel
    X = small
    for _ in range(200):
        c = 0.5 * C * 1025 * area * factor * abs(-1j * w * X - keel) * a
        X = 0.5 * X + 0.5 * (F + c * keel) / (inner - 1j * w * c)
    assert found == pytest.approx(X, rel=0.02)
    assert abs(found) < 0.95 * abs(small)


def test_drag_settles_at_a_resonance():
    """Heave of `long` at its period, which drag alone holds: one more turn of the iteration changes nothing."""
    scene = load_scene("long")
    seaway = Seaway(scene, 150.0)
    wave = seaway.wave(2 * math.pi / 4.0)
    X = seaway.regular(wave, 1.5)
    seaway.drag.in_cycle(seaway.velocities.relative(X, wave.omega, wave.water), 1.5)
    again = seaway.solve(wave)
    for name, values in seaway.named(X[:, None]).items():
        assert abs(seaway.named(again)[name][0] - values[0]) < 5e-3 * abs(values[0]), name
    assert abs(seaway.named(X[:, None])["heave"][0]) < 0.5 * abs(
        seaway.named(seaway.regular(wave)[:, None])["heave"][0]
    )
    seaway.destroy()


def test_small_waves_against_runs():
    """Motions and tensions of `short` within 1 %; and what each costs."""
    scene, direction = load_scene("short"), 150.0
    found = alone.response(scene, [5.0], comm=MPI.COMM_SELF).isel(period=0)
    own = {name: complex_of(found.rao.sel(motion=name)) for name in found.motion.values}
    own |= {name: complex_of(found.rao_tension.sel(tension=name)) for name in found.tension.values}
    run = measured(scene, 5.0, direction, 1e-3)
    for name in ("surge", "heave", "pitch", "tension_top", "tension_anchor"):
        assert abs(own[name] - run[name]) < 0.01 * abs(run[name]), name
    assert max(map(abs, compared(own, run).values())) < 1


def with_current(name, **more):
    """A shipped scene in a current, which damps it."""
    return load_scene(load_scene(name).to_dict() | {"current": {"speed": 0.8, "direction_deg": 20.0}} | more)


@pytest.mark.parametrize("name", ["bridle", "jumper"])
def test_small_waves_on_held_lines(name):
    """Lines that meet at a joint, and the forces that hold their upper ends: within 0.2 % of a run, phases too."""
    scene, seaway = with_current(name), Seaway(with_current(name))
    own = seaway.named(seaway.solve(seaway.wave(2 * math.pi / 6.0)))
    seaway.destroy()
    run = measured(scene, 6.0, 0.0, 1e-3)
    for key, values in own.items():
        assert abs(values[0] - run[key]) < 2e-3 * abs(run[key]), key
    assert run["unsettled"] < 1e-3


@pytest.mark.slow
def test_small_waves_on_a_network():
    """Two buoys and five lines: within 0.5 %."""
    scene, seaway = load_scene("two-buoys"), Seaway(load_scene("two-buoys"))
    own = {name: values[0] for name, values in seaway.named(seaway.solve(seaway.wave(2 * math.pi / 5.0))).items()}
    seaway.destroy()
    difference = compared(own, measured(scene, 5.0, 0.0, 1e-3))
    assert {"surge of left", "heave of right", "tension_top_between", "tension_anchor_east"} <= set(difference)
    assert max(map(abs, difference.values())) < 0.5


@pytest.mark.slow
def test_low_irregular_sea_against_a_run():
    """Standard deviations of `short` in the same components, from several directions: within 1.5 %."""
    waves = irregular_waves(load_scene("short"), (0.1, 7.0, 3.3, 2.0), 0.0)
    difference = compared(*measured_in_sea(load_scene("short"), waves))
    assert {"surge", "sway", "heave", "pitch", "tension_top", "tension_anchor"} <= set(difference)
    assert max(map(abs, difference.values())) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("period", [5.0, 8.0, 12.0])
def test_waves_of_a_metre_against_runs(period):
    """With the drag linearised: surge and heave within 2 %, tension within 5 %."""
    scene = load_scene("short")
    found = alone.response(scene, [period], height=1.0, comm=MPI.COMM_SELF).isel(period=0)
    own = {name: complex_of(found.rao_drag.sel(motion=name)) for name in found.motion.values}
    own |= {name: complex_of(found.rao_drag_tension.sel(tension=name)) for name in found.tension.values}
    difference = compared(own, measured(scene, period, 150.0, 0.5))
    assert max(abs(difference[name]) for name in ("surge", "heave")) < 2
    assert abs(difference["tension_top"]) < 5


def test_irregular_sea():
    """Energy of the bins, a free disc that follows long waves, and what grows with the height."""
    scene = load_scene("short")
    bins = bins_of(irregular_waves(scene, (2.0, 8.0)))
    assert bins.energy.sum() == pytest.approx(2.0**2 / 16, rel=2e-3)
    assert np.all(np.diff(bins.omega) > 0)
    calm = dolfbuoy.response(scene, [5.0], sea=(0.1, 7.0), comm=MPI.COMM_SELF)
    rough = dolfbuoy.response(scene, [5.0], sea=(2.0, 7.0), comm=MPI.COMM_SELF)
    low, high = (found.squeeze() for found in (calm, rough))
    heave = [found.motion_std.sel(motion="heave").item() for found in (low, high)]
    assert heave[0] == pytest.approx(0.1 / 4, rel=0.1)
    tension = [found.tension_std.values[0] for found in (low, high)]
    assert tension[1] / tension[0] != pytest.approx(20, rel=0.02)  # drag has its part
    total = float(np.trapezoid(low.tension_spectrum[0], low.omega) if hasattr(np, "trapezoid")
                  else np.trapz(low.tension_spectrum[0], low.omega))  # fmt: skip
    assert total == pytest.approx(low.tension_std[0].item() ** 2, rel=0.02)
    assert not warnings(calm)
    assert any("three standard deviations" in sentence for sentence in warnings(rough))
    assert "no extremes" in high.attrs["comment"]


def of_cosines(s):
    """E[cos^2 theta] of cos^2s(theta/2): 1 + the second harmonic s (s - 1)/((s + 1)(s + 2)), halved."""
    return (1 + s * (s - 1) / ((s + 1) * (s + 2))) / 2


@pytest.mark.parametrize("s", [1.0, 4.0])
def test_spreading(s):
    """A small disc goes with the water: along and across the waves as much as their directions say."""
    disc = {"hull": [[0, 0.4], [0.2, 0.4]], "mass": 12.0, "center_of_mass": 0.05, "axial_added_mass": 0.6}
    scene = {"sea": {"depth": 300.0}, "buoy": disc | {"added_mass": 0.5}}
    waves = irregular_waves(load_scene(scene), (0.5, 10.0, 3.3, s), 30.0)
    bins = bins_of(waves)
    turned = np.radians(bins.direction_deg - 30.0)
    assert bins.energy @ np.cos(turned) ** 2 / bins.energy.sum() == pytest.approx(of_cosines(s), rel=2e-3)
    assert bins.density(np.ones_like(bins.energy)) @ bins.width == pytest.approx(bins.energy.sum(), rel=1e-12)
    found = alone.response(scene, [8.0], sea=(0.5, 10.0, 3.3, s), direction_deg=30.0, comm=MPI.COMM_SELF).motion_std
    surge, sway, heave = (found.sel(motion=name).item() for name in ("surge", "sway", "heave"))
    assert (surge / sway) ** 2 == pytest.approx(of_cosines(s) / (1 - of_cosines(s)), rel=0.02)
    assert math.hypot(surge, sway) == pytest.approx(heave, rel=0.05)


def test_many_components():
    """Bins of a long list keep its energy, its mean frequency and its directions."""
    random = np.random.default_rng(1)
    rows = [[0.01, T, d, 0.0] for T, d in zip(random.uniform(3, 12, 4000), random.uniform(-60, 60, 4000), strict=True)]
    few, many = (bins_of(Waves(components=part, direction_deg=170.0)) for part in (rows[:300], rows))
    assert len(few.energy) == 300
    assert len(many.energy) <= 640
    w, turned = 2 * math.pi / np.array(rows)[:, 1], np.radians(np.array(rows)[:, 2])
    assert many.energy.sum() == pytest.approx(4000 * 0.01**2 / 2)
    assert many.energy @ many.omega[many.number] == pytest.approx(many.energy.sum() * w.mean())
    across = np.sin(np.radians(many.direction_deg - 170.0)) ** 2
    assert many.energy @ across == pytest.approx(many.energy.sum() * (np.sin(turned) ** 2).mean(), rel=0.05)


def test_anisotropic_drag():
    """B of velocities that are larger along x than along y, E[d(|v| v_i)/dv_i] = E[|v| + v_i^2/|v|], by quadrature."""
    sizes = np.array([0.9, 0.3])
    along, across = np.array([1.0 + 0j, 0, 0]), np.array([0, 1.0 + 0j, 0])

    def put(drag, n):
        drag.in_sea([Sea([np.tile(v, (n, 1))], []) for v in (along, across)], sizes**2)

    at, weight = np.polynomial.hermite_e.hermegauss(200)
    v = np.array(np.meshgrid(*(size * at for size in sizes), indexing="ij"))
    speed, weight = np.hypot(*v), np.outer(weight, weight) / (2 * math.pi)
    exact = [np.sum(weight * (speed + v[i] ** 2 / speed)) for i in (0, 1)]
    np.testing.assert_allclose(slopes(STRING, put), UNIT[1] * np.array(exact), rtol=0.015)


def test_one_component_over_time():
    """A sea of one component is a regular wave of that phase, but for Borgman's drag, which low waves have none of."""
    scene, row = load_scene("short"), [1e-4, 6.0, 20.0, 75.0]
    seaway = Seaway(scene, 20.0)
    X, times = seaway.solve(seaway.wave(2 * math.pi / 6.0)), np.linspace(0, 12, 25)
    rests, found = seaway.named(X), seaway.over_time(Waves(components=[row]), times)
    wave = seaway.wave(2 * math.pi / 6.0)
    phase = math.radians(row[3]) + wave.k @ seaway.crest
    for name, values in rests.items():
        exact = (row[0] * values[0] * np.exp(1j * (phase - wave.omega * times))).real
        np.testing.assert_allclose(found[name], exact, atol=2e-3 * row[0] * abs(values[0]), err_msg=name)
    seaway.destroy()


def test_a_small_disc_goes_with_the_elevation():
    """Two long components that cross, at a place off the origin: its heave is eta there, sum A cos(k.x - w t + phi)."""
    rows, x = [[1e-3, 10.0, 20.0, 75.0], [2e-3, 12.0, 140.0, -50.0]], np.array([31.0, -17.0])
    disc = {"hull": [[0, 0.4], [0.2, 0.4]], "mass": 12.0, "center_of_mass": 0.05, "axial_added_mass": 0.6}
    line = {"length": 20.0, "line_density": 0.02, "diameter": 0.005, "axial_stiffness": 50.0, "elements": 2}
    scene = load_scene({"sea": {"depth": 300.0}, "buoy": disc, "cable": line | {"anchor": [*x, -24.0]}})
    seaway, times = Seaway(scene, 20.0), np.linspace(0.0, 30.0, 61)
    np.testing.assert_allclose(seaway.crest[:2], x, atol=1e-6)
    heave = seaway.over_time(Waves(components=rows), times)["heave"]
    seaway.destroy()
    exact = np.zeros(len(times))
    for amplitude, period, direction, phase in rows:
        omega, theta = 2 * math.pi / period, math.radians(direction)
        along = x @ [math.cos(theta), math.sin(theta)]  # deep water: k = omega^2/g
        exact += amplitude * np.cos(omega**2 / 9.81 * along - omega * times + math.radians(phase))
    np.testing.assert_allclose(heave, exact, atol=0.02 * 3e-3)


def test_a_scene_with_an_irregular_sea():
    """Its spectrum serves, without an option."""
    waves = {"spectrum": "jonswap", "significant_height": 0.4, "peak_period": 6.0, "direction_deg": 150.0}
    scene = load_scene(load_scene("short").to_dict() | {"waves": waves})
    found = alone.response(scene, [5.0], comm=MPI.COMM_SELF)
    same = alone.response("short", [5.0], sea=(0.4, 6.0, 3.3), comm=MPI.COMM_SELF)
    np.testing.assert_allclose(found.tension_std, same.tension_std, rtol=1e-3)


def test_a_line_without_a_buoy():
    """Tensions at both ends, as its top is held."""
    found = alone.response("jumper", [8.0, 12.0], height=1.0, comm=MPI.COMM_SELF)
    assert found.tension.values.tolist() == ["tension_top", "tension_anchor"]
    assert "rao" not in found
    assert np.all(np.abs(complex_of(found.rao_drag_tension)) > 0)


def test_refusals():
    with pytest.raises(InputError, match=r"needs \[sea\]"):
        alone.response("hanging-chain", comm=MPI.COMM_SELF)
    with pytest.raises(InputError, match="must be a height"):
        alone.response("short", [5.0], sea=(-1.0, 5.0), comm=MPI.COMM_SELF)
