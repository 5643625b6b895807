"""A moored buoy in irregular seas: kinematics per step or per iterate, one component as a regular wave, statistics.

Source: the same program in a regular wave, with exact kinematics, and its linear response; theory of linear systems.
"""

import itertools
import math

import numpy as np
import pytest
from alone import simulate
from dynamics_helpers import merged, running

from dolfbuoy import load_scene
from dolfbuoy.linear.seaway import responses
from dolfbuoy.model.airy import components_of
from dolfbuoy.model.problem import Problem
from dolfbuoy.model.sea import elevation_at
from dolfbuoy.motion.energy import Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.solver.compat import MPI

SHORT = load_scene("short").to_dict()
SEA = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 5.0, "direction_deg": 150.0, "seed": 2}
REGULAR = {"amplitude": 0.8, "period": 5.0, "direction_deg": 150.0, "phase_deg": 30.0, "ramp": 2.0}


def scene_of(waves, buoy=None, **time):
    return {**SHORT, "waves": waves, "buoy": SHORT["buoy"] | (buoy or {}), "time": SHORT["time"] | time}


def trajectory(scene, steps):
    """Unknowns after each of several steps."""
    with running(scene) as simulation:
        return np.array([simulation.system.u.copy() for _, _ in zip(range(steps), simulation.run(), strict=False)])


@pytest.mark.parametrize(
    "buoy", [{}, {"disk_averages": True, "wave_damping": [100.0, 200.0]}], ids=["plain", "averaged"]
)
def test_one_component_is_a_regular_wave(buoy):
    """Forms of a regular wave against sums at points, in all unknowns of 100 steps; also once per step."""
    component = {"components": [[0.8, 5.0, 0.0, 30.0]], "direction_deg": 150.0, "ramp": 2.0}
    expected = trajectory(scene_of(REGULAR, buoy), 100)
    size = np.abs(expected).max(axis=0) + 1e-3 * np.abs(expected).max()
    for kinematics, tolerance in (("exact", 1e-9), ("step", 1e-6)):
        found = trajectory(scene_of(component | {"kinematics": kinematics}, buoy), 100)
        assert (np.abs(found - expected).max(axis=0) / size).max() < tolerance


def test_narrow_band_tends_to_the_regular_wave():
    """Nine components about one period: over 20 s the difference falls with the square of the bandwidth."""
    expected, differences = trajectory(scene_of(REGULAR, step=0.05), 400), []
    for width in (0.02, 0.01, 0.005):
        periods = 5.0 / (1 + width * np.linspace(-1, 1, 9))
        waves = {"components": [[0.8 / 9, T, 0.0, 30.0] for T in periods], "direction_deg": 150.0, "ramp": 2.0}
        found = trajectory(scene_of(waves, step=0.05), 400)
        differences.append(np.abs(found - expected)[:, -13:-10].max())
    assert differences[2] < 0.01
    assert np.all(np.array(differences[:2]) / differences[1:] > 2.5)


def test_once_per_step_beside_exact():
    """rms difference over standard deviation, of position and top tension at dt = 0.1 s: below 1e-3, and far below what
    the scheme itself does to them."""
    runs = {
        name: simulate(scene_of(SEA | {"kinematics": kinematics, "ramp": 10.0}, end=60.0, step=step, scheme="bdf2"))
        for name, kinematics, step in (("step", "step", 0.1), ("exact", "exact", 0.1), ("fine", "step", 0.025))
    }
    late = runs["step"].time.values > 15.0
    for name in ("buoy_position", "tension_top"):
        step, exact = (runs[k][name].values[late] for k in ("step", "exact"))
        fine = runs["fine"][name].values[::4][late]
        deviation = exact.std(axis=0)
        inexact = np.sqrt(np.mean((step - exact) ** 2, axis=0)) / deviation
        scheme = np.sqrt(np.mean((exact - fine) ** 2, axis=0)) / deviation
        assert np.all(inexact < 1e-3)
        assert np.all(inexact < 0.1 * scheme)


@pytest.mark.parametrize(
    ("tilt", "height"), [(0.0, 0.0), (0.3, 0.4), (0.3, -1.2), (1.5707, 0.0), (1.61, -0.07), (2.9, -0.2), (0.4, 3.5)]
)
def test_points_of_a_hull_find_the_water_by_its_expansion(tilt, height):
    """Upright, leaning, lying, upside down, nearly submerged: the wet part agrees with the sums themselves."""
    axis, found = np.array([0.6, 0.8, 0.0]), {}
    for kinematics in ("step", "exact"):
        problem = Problem(load_scene(scene_of(SEA | {"kinematics": kinematics})), dynamic=True)
        (buoy,), wet = problem.buoys.values(), problem.wet_hulls
        state = buoy.fields.of(problem.system.u[buoy.part.slice])
        state.position[:], state.orientation[0] = [3.0, -7.0, height], math.cos(tilt / 2)
        state.orientation[1:] = math.sin(tilt / 2) * axis
        problem.set_time(31.0)
        problem.system.publish()
        problem.system.evaluate()
        wet()
        found[kinematics] = wet.out.copy()
        problem.destroy()
    size = np.maximum(np.abs(found["exact"]), 1e-3 * np.abs(found["exact"]).max())
    assert found["exact"][0] >= 0
    assert np.abs((found["step"] - found["exact"]) / size).max() < 1e-6


@pytest.mark.parametrize("kinematics", ["step", "exact"])
def test_retried_step_is_that_of_who_never_failed(kinematics):
    """A rejected step leaves no trace in the coefficients."""
    scene = scene_of(SEA | {"kinematics": kinematics}, step=0.05)
    with running(scene) as one, running(scene) as other:
        for simulation in (one, other):
            for _, _ in zip(range(20), simulation.run(), strict=False):
                pass
        assert one.step(0.05, judge=lambda h, error: False) is None
        one.newton.numbers.valid = other.newton.numbers.valid = (
            False  # the matrix of the step that was given up is newer
        )
        for simulation in (one, other):
            simulation.step(0.025)
        assert np.array_equal(one.system.u, other.system.u)


def test_record_knows_its_sea():
    """It contains the components; the elevation above C is their sum."""
    scene = load_scene(scene_of(SEA | {"spreading": 8.0, "ramp": 1.0}, end=1.0))
    run, found = simulate(scene), components_of(scene.waves)
    assert np.array_equal(run.wave_amplitude.values, found.amplitude)
    assert np.array_equal(run.wave_phase_deg.values, np.degrees(found.phase))
    assert len(set(run.wave_direction_deg.values)) == 200
    eta = [elevation_at(scene, t, x) for t, x in zip(run.time.values, run.buoy_position.values, strict=True)]
    assert run.surface_elevation.values == pytest.approx(np.array(eta), abs=1e-12)


def test_another_sea_needs_no_new_problem():
    """More components, another seed and depth, exact kinematics: only numbers in the same forms."""
    first, second = (
        load_scene(scene_of(SEA | changes, step=0.05))
        for changes in ({}, {"components": 77, "seed": 5, "kinematics": "exact"})
    )
    with running(second.to_dict()) as fresh, running(first.to_dict()) as used:
        again = Simulation(second, MPI.COMM_SELF, problem=used.problem)
        for simulation in (fresh, again):
            for _, _ in zip(range(20), simulation.run(), strict=False):
                pass
        assert np.array_equal(fresh.system.u, again.system.u)


def test_energy_balances():
    """Kinetic and potential energy gained equal the recorded work: the defect falls with the step."""
    defects = []
    for step in (0.02, 0.01):
        scene = scene_of(SEA | {"ramp": 2.0}, step=step, end=2.0, scheme="bdf2")
        with running(merged(scene, cable__elements=6)) as simulation:
            meter, energy, power, t = Meter(simulation), [], [], []
            for _ in simulation.run():
                read = meter.read()
                energy.append(read["kinetic"] + read["elastic"] + read["gravity"])
                power.append(sum(v for k, v in read.items() if k not in ("kinetic", "elastic", "gravity")))
                t.append(simulation.t)
        half = len(t) // 2
        work = np.sum(0.5 * np.diff(t[half:]) * (np.array(power[half + 1 :]) + power[half:-1]))
        defects.append(abs(energy[-1] - energy[half] - work) / np.ptp(energy[half:]))
    assert defects[0] < 0.05
    assert defects[1] < 0.6 * defects[0]


@pytest.mark.slow
def test_linear_response_of_a_free_buoy():
    """Heave and pitch in a low sea, by bands: variances are those of RAO^2 S, within the statistical error."""
    scene = load_scene("free-buoy").to_dict()
    waves = {"spectrum": "pierson-moskowitz", "significant_height": 0.02, "peak_period": 6.0, "components": 400}
    end, step, start = 2400.0, 0.05, 300.0
    scene |= {
        "waves": waves | {"ramp": 60.0},
        "time": {"end": end, "step": step, "scheme": "bdf2", "output_every": end},
    }
    for name in ("current", "wind", "external_force"):
        scene.pop(name, None)
    run, sea = simulate(scene), components_of(load_scene(scene).waves)
    kept = run.time.values > start
    edges = 2 * math.pi / np.array([9.0, 7.0, 6.0, 5.0, 4.2, 3.6])
    periods = 2 * math.pi / sea.frequency
    inside = (sea.frequency > edges[0]) & (sea.frequency < edges[-1])
    answers = responses(load_scene(scene), periods[inside])
    w = 2 * math.pi * np.fft.rfftfreq(kept.sum(), step)
    for name, part in (("heave", run.buoy_position.values[:, 2]), ("pitch", np.radians(run.pitch.values))):
        signal = part[kept] - part[kept].mean()
        window = np.hanning(len(signal))
        power = np.abs(np.fft.rfft(signal * window)) ** 2 * 2 / (len(signal) * np.sum(window**2))
        size = np.array([abs(getattr(answer.motions, name)) for answer in answers])
        for low, high in itertools.pairwise(edges):
            chosen = (sea.frequency[inside] > low) & (sea.frequency[inside] < high)
            expected = np.sum((size * sea.amplitude[inside])[chosen] ** 2) / 2
            found = np.sum(power[(w > low) & (w < high)])
            error = math.sqrt(2 * math.pi / ((high - low) * (end - start)))  # of a variance over so long and so wide
            assert found == pytest.approx(expected, rel=3 * error), (name, low)
            assert error < 0.2
