"""Radiation memory in a run: energy from driven motions, balances, retried steps, several buoys.

Source: the damping in the file (tests/reference), the energy balance, a force-free steady motion, single buoys.
"""

import numpy as np
import pytest
from dynamics_helpers import running
from helpers import REFERENCE
from scipy.interpolate import CubicSpline

from dolfbuoy import load_scene, simulate
from dolfbuoy.model.potential_flow import coefficients_of
from dolfbuoy.motion.energy import STORED, Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.scene.reading import merged

SCHEMES = "backward-euler", "bdf2", "generalized-alpha"
CYLINDER = {
    "sea": {"depth": 20.0},
    "buoy": {
        "hull": [[0.0, 2.0], [1.6, 2.0]],
        "mass": 2576.1,
        "center_of_mass": 0.6,
        "inertia": [1500.0, 1300.0],
        "potential_flow": str(REFERENCE / "truncated_cylinder.nc"),
    },
    "time": {"end": 12.0, "step": 0.02, "scheme": "generalized-alpha"},
}
#: Amplitudes of the velocities of C along x and z [m/s], and of pitch [1/s], as complex numbers.
MOTIONS = {"heave": (0, 0.1, 0), "surge": (0.1, 0, 0), "pitch": (0, 0, 0.05), "both": (0.1, 0.05j, 0.1 - 0.05j)}


def driven(velocity, omega):
    """t -> pose and motion of the cylinder: Re[V exp(-i omega t)] about its rest position."""

    def motion(t):
        turning = np.exp(-1j * omega * t)
        v, x = (np.multiply(velocity, factor).real for factor in (turning, 1j / omega * turning))
        q4 = np.array([np.cos(x[2] / 2), 0.0, np.sin(x[2] / 2), 0.0])
        place = np.array([x[0], 0.0, x[1] - 0.2])
        return place, q4, np.array([v[0], 0.0, v[1]]), np.array([0.0, v[2], 0.0])

    return motion


def powers(scene, motion, instants):
    """Radiated powers during a driven run."""
    simulation = Simulation(scene, driven={next(iter(scene.network.buoys)): motion})
    meter, found = Meter(simulation), []
    for t in instants:
        for _ in simulation.advance(t):
            pass
        found.append(meter.read()["radiation"])
    simulation.problem.destroy()
    return np.array(found)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in ("heave", "both") else pytest.mark.slow) for n in MOTIONS]
)
def test_still_water_takes_the_energy_of_the_file(name):
    """Over a period of driven motion: half the damping times the squared velocities, to 1 % of the largest."""
    scene, velocity = load_scene(CYLINDER), np.array(MOTIONS[name])
    c, three = coefficients_of(scene, scene.buoys[0]), velocity[[0, 2, 1]]  # the axis leans by pitch
    expected = CubicSpline(c.omega, -0.5 * (three.conj() @ c.damping @ three).real)
    for omega in (1.5, 2.7, 4.0):
        period = 2 * np.pi / omega
        found = powers(scene, driven(velocity, omega), 3 * period + period / 40 * np.arange(1, 41)).mean()
        assert found < 0
        if name != "pitch":  # about C it radiates next to nothing
            assert found == pytest.approx(float(expected(omega)), abs=0.01 * -expected(c.omega).min())


def test_no_force_at_constant_speed():
    """After an impulsive start, waves are radiated at first, but not in steady motion."""

    def motion(t):
        return np.array([0.5 * t, 0.0, -0.2]), np.array([1.0, 0, 0, 0]), np.array([0.5, 0.0, 0.0]), np.zeros(3)

    found = powers(load_scene(CYLINDER), motion, [0.5, 1.0, 30.0])
    assert found[:2].min() < -1.0
    assert abs(found[-1]) < 1e-4 * abs(found[:2]).max()


WAVES = {"amplitude": 0.15, "period": 3.0, "ramp": 2.0, "direction_deg": 30.0}
START = {"buoy_position": [0.0, 0.0, 0.1], "buoy_velocity": [0.2, 0.0, 0.0]}


SEA = {"spectrum": "jonswap", "significant_height": 0.3, "peak_period": 3.0}


@pytest.mark.parametrize("waves", [None, *(pytest.param(waves, marks=pytest.mark.slow) for waves in (WAVES, SEA))])
def test_energy_balances(waves):
    """Kinetic and potential energy gained equal the recorded work, including radiation."""
    defects, taken = [], 0.0
    for step in (0.04, 0.02):
        scene = merged(CYLINDER, waves=waves, time__step=step, time__scheme="bdf2", time__end=4.0)
        scene = merged(scene, buoy__initial=START, buoy__drift="newman" if waves else None)
        with running(scene) as simulation:
            meter, energy, power, t = Meter(simulation), [], [], []
            for _ in simulation.run():
                read = meter.read()
                energy.append(sum(read[name] for name in STORED))
                power.append(sum(read.values()) - energy[-1])
                t.append(simulation.t)
                taken += read["radiation"]
        half = len(t) // 4
        work = np.sum(0.5 * np.diff(t[half:]) * (np.array(power[half + 1 :]) + power[half:-1]))
        defects.append(abs(energy[-1] - energy[half] - work) / np.ptp(energy[half:]))
    assert taken < 0
    assert defects[0] < 0.05
    assert defects[1] < 0.6 * defects[0]


@pytest.mark.parametrize("scheme", ["bdf2", *(pytest.param(s, marks=pytest.mark.slow) for s in SCHEMES[::2])])
def test_a_step_that_does_not_count_leaves_the_memory(scheme):
    """Rejected steps change nothing, to the last bit; smaller ones follow the same waves."""
    scene = merged(CYLINDER, buoy__initial=START, time__scheme=scheme, waves=WAVES)
    scene = merged(scene, solver={"keep_jacobian": False})  # a matrix that is kept differs, and rounding with it
    with running(scene) as plain, running(scene) as tried:
        for k in range(40):
            plain.step(0.02)
            if k % 3 == 0:
                assert tried.step(0.05, judge=lambda *_: False) is None
            tried.step(0.02)
        assert np.array_equal(plain.system.u, tried.system.u)
        memory = plain.past.evolutions[-1], plain.past.places[-1]
        assert np.abs(plain.past.series[0].values[0][memory[1]]).max() > 0
        for one, two in zip(plain.past.series, tried.past.series, strict=True):
            assert np.array_equal(one.values[0], two.values[0])


def test_several_buoys():
    """Two distant buoys move as each alone: waves from one do not act on the other."""
    alone = merged(CYLINDER, waves=WAVES, time__end=2.0)
    places = ([0.0, 0.0, -0.1], [40.0, 7.0, -0.25])
    buoys = [
        alone["buoy"] | {"name": name, "initial": {"buoy_position": place}}
        for name, place in zip(("one", "two"), places, strict=True)
    ]
    both = simulate(alone | {"buoy": buoys})
    for k, buoy in enumerate(buoys):
        single = simulate(alone | {"buoy": buoy})
        assert both.buoy_position.values[:, k] == pytest.approx(single.buoy_position.values[:, 0], abs=1e-7)
    assert np.ptp(both.buoy_position.values[:, :, 2], axis=0).min() > 0.05


@pytest.mark.slow
def test_a_small_wave_moves_it_as_its_response_says():
    """Heave, surge and pitch in a small wave, in time and from `response`."""
    from dolfbuoy.linear.seaway import responses

    period, amplitude = 2.6, 1e-3
    scene = load_scene(
        merged(
            CYLINDER,
            waves={"amplitude": amplitude, "period": period, "ramp": 10.0},
            time={"end": 30 * period, "step": period / 60, "scheme": "generalized-alpha"},
        )
    )
    run = simulate(scene)
    late = run.time.values > 20 * period - 1e-6
    t, z = run.time.values[late], run.buoy_position.values[late, 0, 2]
    basis = np.column_stack([np.cos(2 * np.pi * t / period), np.sin(2 * np.pi * t / period), np.ones_like(t)])
    found = np.hypot(*np.linalg.lstsq(basis, z, rcond=None)[0][:2]) / amplitude
    exact = abs(responses(scene, [period])[0].motions.heave)
    assert found == pytest.approx(exact, rel=0.01)
