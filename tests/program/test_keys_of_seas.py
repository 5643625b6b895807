"""Every key of waves and solver changes the number it should; and no key of the language is left untested.

Source: Airy's wave at the buoy, the dispersion relation, JONSWAP's definition, sums of components.
"""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from every_key import SHOWN, changed, shows

from dolfbuoy import simulate, solve_static, wave_components
from dolfbuoy.scene import list_keys

G, DEPTH = 10.0, 50.0
FLOAT = {
    "gravity": G,
    "sea": {"depth": DEPTH, "density": 1000.0},
    "buoy": {"hull": [[0.0, 2.0], [2.0, 2.0]], "mass": 3000.0, "center_of_mass": 0.4},
    "initial": {"buoy_position": [20.0, 10.0, -0.55]},
    "time": {"end": 1.5, "step": 0.5},
}


def wavenumber(omega):
    """Of the dispersion relation omega^2 = g k tanh(k h) [1/m]."""
    k = omega**2 / G
    for _ in range(50):
        k = omega**2 / G / math.tanh(k * DEPTH)
    return k


def at_buoy(run, amplitude, period, direction_deg=0.0, phase_deg=0.0, k=None, current=0.0):
    """Airy's elevation at the places where the buoy was."""
    omega, angle = 2 * math.pi / period, math.radians(direction_deg)
    k = wavenumber(omega) if k is None else k
    x = run.buoy_position.values[:, 0] @ [math.cos(angle), math.sin(angle), 0.0]
    return amplitude * np.cos(k * x - (omega + k * current) * run.time.values + math.radians(phase_deg))


WAVE = {"amplitude": 0.5, "period": 5.0}
REGULAR = {
    "amplitude": ({"amplitude": 0.8}, {"amplitude": 0.8}),
    "height": ({"amplitude": None, "height": 1.8}, {"amplitude": 0.9}),
    "period": ({"period": 6.0}, {"period": 6.0}),
    "wavelength": ({"wavelength": 50.0}, {"k": 2 * math.pi / 50.0}),
    "direction_deg": ({"direction_deg": 70.0}, {"direction_deg": 70.0}),
    "phase_deg": ({"phase_deg": 70.0}, {"phase_deg": 70.0}),
}


@pytest.mark.parametrize("key", REGULAR)
@shows(*(f"waves.{key}" for key in REGULAR))
def test_elevation_of_a_regular_wave(key):
    changes, numbers = REGULAR[key]
    run = simulate(changed(FLOAT, {"waves": WAVE} | {f"waves.{name}": value for name, value in changes.items()}))
    assert run.surface_elevation.values[:, 0] == pytest.approx(at_buoy(run, **(WAVE | numbers)), rel=1e-9)


@shows("waves.theory", "waves.order")
def test_steep_wave():
    """The crest is higher than Airy's by k a^2/2 in deep water (Stokes); few harmonics have it to a millimetre."""
    crest = {}
    for order in (4, 20):
        wave = {"theory": "stream", "height": 2.0, "period": 6.0, "order": order}
        run = simulate(changed(FLOAT, {"waves": wave, "initial.buoy_position": [0.0, 0.0, -0.55], "time.end": 0.5}))
        crest[order] = run.surface_elevation.values[0, 0]
    assert crest[20] - 1.0 == pytest.approx(0.5 * wavenumber(2 * math.pi / 6.0), rel=0.1)
    assert 0 < abs(crest[4] - crest[20]) < 1e-3


@shows("waves.ramp")
def test_ramp_of_a_wave():
    run = simulate(changed(FLOAT, {"waves": WAVE | {"ramp": 1.0}}))
    grown = 0.5 * (1 - np.cos(np.pi * np.minimum(run.time.values, 1.0)))
    assert run.surface_elevation.values[:, 0] == pytest.approx(grown * at_buoy(run, **WAVE), rel=1e-9, abs=1e-12)


@shows("waves.period_seen_from", "current.speed")
@pytest.mark.parametrize("seen_from", ["water", "ground"])
def test_whose_period_it_is(seen_from):
    run = simulate(changed(FLOAT, {"waves": WAVE | {"period_seen_from": seen_from}, "current": {"speed": 1.0}}))
    if seen_from == "water":
        expected = at_buoy(run, **WAVE, current=1.0)
    else:  # omega = sigma + k U, sigma^2 = g k tanh(k h)
        omega = 2 * math.pi / 5.0
        k = wavenumber(omega)
        for _ in range(200):
            k = (omega - k) ** 2 / G / math.tanh(k * DEPTH)
        expected = at_buoy(run, **WAVE, k=k)
    assert run.surface_elevation.values[:, 0] == pytest.approx(expected, rel=1e-9)


@shows("waves.stretching")
def test_stretching_changes_what_is_above_still_water():
    found = []
    for word in ("wheeler", "vertical", "none"):
        scene = changed(FLOAT, {"waves": WAVE | {"stretching": word, "amplitude": 1.0}, "buoy.normal_drag": 1.0})
        found.append(simulate(scene).linear_momentum.values[-1, 0, 0])
    assert len({round(value, 3) for value in found}) == 3
    assert max(found) - min(found) < 0.2 * max(map(abs, found))


# -- seas --------------------------------------------------------------------------------------------------------------

SEA = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 8.0, "components": 60, "seed": 4}


def sea(**changes):
    return wave_components(changed(FLOAT, {"waves": SEA} | {f"waves.{k}": v for k, v in changes.items()}))


def summed(c, run):
    """Elevation at the buoy as the sum of components."""
    parts = zip(*(c[name].values for name in ("amplitude", "period", "direction_deg", "phase_deg")), strict=True)
    return sum(at_buoy(run, *part) for part in parts)


@shows("waves.kinematics")
@pytest.mark.parametrize("kinematics", ["step", "exact"])
def test_elevation_of_a_sea(kinematics):
    scene = changed(FLOAT, {"waves": SEA | {"kinematics": kinematics, "components": 20}})
    run = simulate(scene)
    expected = summed(wave_components(scene), run)
    assert run.surface_elevation.values[:, 0] == pytest.approx(expected, abs=2e-3 if kinematics == "step" else 1e-9)


def jonswap(f, height, period, gamma, band):
    """Energy between the lower end of the band and each frequency [m^2]; the height is that of the whole spectrum."""
    fine = np.linspace(0.2, 30.0, 200001) / period
    x = fine * period
    shape = x**-5.0 * np.exp(-1.25 * x**-4.0)
    shape *= gamma ** np.exp(-((x - 1) ** 2) / (2 * np.where(x <= 1, 0.07, 0.09) ** 2))
    energy = np.concatenate([[0.0], np.cumsum((shape[1:] + shape[:-1]) / 2)])
    low, below = (np.interp(at, fine, energy / energy[-1]) for at in (band[0] / period, f))
    return (below - low) * (height / 4) ** 2


JONSWAPS = {
    "spectrum": {},
    "significant_height": {"significant_height": 3.0},
    "peak_period": {"peak_period": 10.0},
    "gamma": {"gamma": 1.0},
    "band": {"band": [0.8, 1.6]},
    "components": {"components": 200},
}


@pytest.mark.parametrize("key", JONSWAPS)
@shows(*(f"waves.{key}" for key in JONSWAPS))
def test_energy_of_a_sea_below_each_frequency(key):
    given = {"significant_height": 2.0, "peak_period": 8.0, "gamma": 3.3, "band": [0.5, 3.0]} | JONSWAPS[key]
    c = sea(**given)
    order = np.argsort(-c.period.values)
    power = c.amplitude.values[order] ** 2 / 2
    assert len(power) == given.get("components", 60)
    names = "significant_height", "peak_period", "gamma", "band"
    below = jonswap(1 / c.period.values[order], *(given[name] for name in names))
    total = (given["significant_height"] / 4) ** 2
    assert np.cumsum(power) - power / 2 == pytest.approx(below, abs=2e-3 * total)


@shows("waves.spreading", "waves.seed", "waves.amplitudes", "waves.direction_deg")
def test_directions_seeds_and_random_amplitudes():
    one, other, random = sea(), sea(seed=5), sea(amplitudes="random")
    assert np.ptp(one.direction_deg.values) == 0
    assert one.amplitude.values == pytest.approx(other.amplitude.values)
    assert np.abs(one.phase_deg - other.phase_deg).min() > 1e-9
    ratio = (random.amplitude / one.amplitude).values ** 2  # of exponential distribution, mean 1
    assert 0.5 < ratio.std() < 1.6
    wide, narrow = (sea(spreading=s, components=400, direction_deg=30.0).direction_deg.values for s in (2.0, 40.0))
    for s, found in ((2.0, wide), (40.0, narrow)):
        turned = np.radians(found - 30.0)
        assert np.mean(np.cos(turned)) == pytest.approx(s / (s + 1), abs=0.06)  # of cos^2s(theta/2): r1 = s/(s + 1)


@shows("waves.crest", "waves.crest_time", "waves.crest_position", "waves.crest_sea")
def test_a_prescribed_crest():
    """The sum of components has it; of NewWave these are all in phase there."""
    crest = {"crest": 3.0, "crest_time": 12.0, "crest_position": [5.0, 0.0]}
    for kind in ("random", "newwave"):
        c = sea(**crest, crest_sea=kind)
        k = np.array([wavenumber(2 * math.pi / period) for period in c.period.values])
        there = np.radians(c.phase_deg.values) + k * 5.0 - 2 * math.pi / c.period.values * 12.0
        assert c.amplitude.values @ np.cos(there) == pytest.approx(3.0, rel=1e-9)
        in_phase = np.cos(there).min() > 1 - 1e-12
        assert in_phase == (kind == "newwave")


@shows("waves.spectrum.frequency", "waves.spectrum.direction_deg", "waves.spectrum.density")
def test_a_spectrum_over_frequency_and_direction():
    f, theta = np.linspace(0.05, 0.2, 31), np.arange(-60.0, 61.0, 10.0)
    density = np.outer(np.exp(-(((f - 0.1) / 0.01) ** 2)), np.exp(-(((theta - 20.0) / 15.0) ** 2)))
    table = {"frequency": f.tolist(), "direction_deg": theta.tolist(), "density": density.tolist()}
    c = wave_components(changed(FLOAT, {"waves": {"spectrum": table, "components": 300}}))
    power = c.amplitude.values**2 / 2
    assert power.sum() == pytest.approx(0.01 * 15.0 * math.pi, rel=0.02)
    assert (power @ (1 / c.period.values)) / power.sum() == pytest.approx(0.1, rel=0.01)
    assert (power @ c.direction_deg.values) / power.sum() == pytest.approx(20.0, abs=1.0)


@shows("waves.elevation")
def test_a_measured_elevation_comes_back():
    t = np.arange(0.0, 60.0, 0.25)
    eta = 0.5 * np.cos(2 * np.pi * t / 6.0) + 0.3 * np.cos(2 * np.pi * t / 7.5 + 1.0)
    scene = changed(FLOAT, {"waves": {"elevation": np.column_stack([t, eta]).tolist()}})
    c = wave_components(scene)
    phase = np.radians(c.phase_deg.values)[:, None] - 2 * np.pi / c.period.values[:, None] * t
    middle = np.abs(t - 30.0) < 10.0  # its ends are tapered
    assert (c.amplitude.values @ np.cos(phase))[middle] == pytest.approx(eta[middle], abs=0.03)


@pytest.mark.parametrize(("dry", "wet"), [(True, 0.0), (False, 1.0)])
@shows("sea.dry_above")
def test_weight_of_a_line_above_the_water(dry, wet):
    """Carried by its ends."""
    line = {"length": 12.0, "line_density": 5.0, "diameter": 0.05, "elements": 8, "anchor": [0.0, 0.0, 9.0]}
    line["top"] = {"kind": "fixed", "position": [8.0, 0.0, 9.0]}
    rest = solve_static({"gravity": G, "sea": FLOAT["sea"] | {"dry_above": dry}, "cable": line})
    weight = (5.0 - wet * 1000.0 * math.pi * 0.05**2 / 4) * G * 12.0
    assert float((rest.anchor_force + rest.end_tension).values[0, 2]) == pytest.approx(weight, rel=1e-9)


# -- solver ------------------------------------------------------------------------------------------------------------

MOVING = changed(FLOAT, {"waves": WAVE, "buoy.normal_drag": 1.0, "initial": None})


@shows("solver.petsc", "solver.step_tolerance", "solver.keep_jacobian")
def test_settings_of_newton():
    def iterations(**settings):
        return int(simulate(changed(MOVING, {"solver": settings})).newton_iterations.sum())

    usual = iterations()
    assert iterations(step_tolerance=1e-3) < usual
    assert iterations(keep_jacobian=False) < usual
    routes = [solve_static("driven", solver=given).attrs["route"] for given in ({}, {"petsc": {"snes_max_it": 1}})]
    assert routes[0] == "newton" != routes[1]


LEAN = {
    "current": {"speed": 1.0},
    "cable": {"length": 49.5, "line_density": 1.0, "axial_stiffness": 1e6, "diameter": 0.02, "elements": 2},
}


@shows("solver.hull_cells", "solver.hull_quadrature_degree")
def test_points_of_the_hull():
    end = [
        simulate(changed(MOVING, {"solver": settings, "waves.period": 2.5})).linear_momentum.values[1, 0]
        for settings in ({}, {"hull_cells": 6}, {"hull_quadrature_degree": 5})
    ]
    for other in end[1:]:
        assert 0 < np.abs(other - end[0]).max() < 0.01 * np.abs(end[0]).max()


@shows("solver.quadrature_degree")
def test_points_of_a_line():
    line = {"cable": LEAN["cable"] | {"normal_drag": 1.0, "position_degree": 2, "anchor": [0.0, 0.0, -DEPTH]}}
    scene = {"gravity": G, "sea": FLOAT["sea"], "current": {"speed": 1.0, "profile": "power"}, **line}
    scene["cable"]["top"] = {"kind": "fixed", "position": [0.0, 0.0, -2.0]}
    found = [float(solve_static(changed(scene, {"solver.quadrature_degree": n})).tension_top[0]) for n in (2, 12)]
    assert 0 < abs(found[1] / found[0] - 1) < 0.01


# -- all ---------------------------------------------------------------------------------------------------------------

#: Keys that hold words for a reader.
NO_NUMBER = {"title", "material.NAME.source", "material.NAME.catalogue"}


def test_no_key_is_left_out(monkeypatch):
    """Wherever the tests of the keys stand; nor is one shown that is gone."""
    for file in Path(__file__).parents[1].glob("*/test_*.py"):
        if "from every_key import" in file.read_text():
            monkeypatch.syspath_prepend(file.parent)
            importlib.import_module(file.stem)
    keys = {row.name for row in list_keys()}
    assert keys - SHOWN == NO_NUMBER
    assert keys >= SHOWN
