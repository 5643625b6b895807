"""Studies release the problems they solve, and read the right results: ends, moments, frequencies of made-up problems.

Source: elliptic integrals and frequencies from the studies, inserted into the problems with errors by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from dolfbuoy import load_scene
from dolfbuoy.studies.accuracy import bent, convergence, linear_answer

GONE = []


@pytest.fixture(autouse=True)
def nothing():
    GONE.clear()


def problem(**more):
    return SimpleNamespace(destroy=lambda: GONE.append(True), **more)


@pytest.mark.parametrize(("material", "end"), [("elastic", "Neumann"), ("inextensible", "Dirichlet")])
def test_a_static_cable(material, end, monkeypatch):
    """Its scene is that of the figure; its errors are against the catenary of the same end."""
    asked = []
    monkeypatch.setattr(convergence, "solve_equilibrium", lambda scene, comm: asked.append(scene) or problem())
    monkeypatch.setattr(convergence, "Profile", lambda problem: "profile")
    monkeypatch.setattr(convergence, "errors", lambda profile, exact: asked.append(exact) or {"r_L2": 1.0})
    case = {"material": material, "strain": "exact", "end": end, "mu": 2, "nu": 1, "cells": 8}
    assert convergence.evaluate(case) == {"h": 0.125, "r_L2": 1.0}
    assert GONE == [True]
    scene, exact = asked
    (cable,) = scene.cables
    assert (cable.elements, cable.position_degree, cable.tension_degree) == (8, 2, 1)
    place = np.ravel(exact.position(np.array([1.0])))
    assert place == pytest.approx(convergence.ENDS[material], abs=1e-9 if material == "elastic" else 1e-6)
    if material == "elastic":
        assert (cable.top.kind, tuple(cable.top.force)) == ("free", (0.5, 0.0, 0.75))
        assert scene.solver.quadrature_degree == 20
        assert np.ravel(exact.force(np.array([1.0]))) == pytest.approx([0.5, 0.0, 0.75])
    else:
        assert (cable.top.kind, cable.top.position) == ("fixed", (0.6, 0.0, 0.5))
        assert math.isinf(cable.axial_stiffness)
        assert scene.solver.quadrature_degree is None


def test_a_cantilever_and_a_line_between_clamps(monkeypatch):
    """Distance of the tip over the length; moments and forces relative to the true ones."""
    x, z = bent.elastica(5.0)
    tip = np.array([10 * x + 0.3, 0.0, 10 * z - 0.4])
    moment = np.array([0.0, 50.0 * x * 10 * 1.02, 0.0])
    u = np.concatenate([tip, moment])
    lines = SimpleNamespace(top_dofs=lambda: [0, 1, 2], end_moments=lambda line, end: {(0, 0): [3, 4, 5]}[line, end])
    made = problem(lines=lines, system=SimpleNamespace(u=u))
    monkeypatch.setattr(bent, "solve_equilibrium", lambda scene, comm: made)
    assert bent.cantilever(2, 5) == pytest.approx({"h": 2.0, "tip": 0.05, "moment": 0.02})
    H, M = bent.hanging(2e6)
    lines.end_moments = lambda line, end: {(0, 1): [3, 4, 5]}[line, end]
    made.system.u = np.array([0, 0, 0, 0.6 * M * 0.97, 0.8 * M * 0.97, 0.0])
    made.end_force = lambda line, end: {(0, 1): (1.01 * H, 0.0, 5.0)}[line, end]
    assert bent.between_clamps(2, 6) == pytest.approx({"h": 20.0, "force": 0.01, "moment": 0.03})
    assert GONE == [True, True]


def test_frequencies_of_a_pulled_cantilever(monkeypatch):
    """The worst of the three lowest, each beside the nearest that is found; twice as many and two are asked for."""
    true = bent.swinging()
    asked = []
    found = [0.1, true[0] * 1.001, true[1] * 0.996, true[2] * 1.002, true[2] * 3]
    monkeypatch.setattr(bent, "linearise", lambda scene, comm: asked.append(scene) or problem())
    modes = [SimpleNamespace(omega=omega) for omega in found]
    monkeypatch.setattr(bent, "lowest_modes", lambda problem, count: asked.append(count) or modes)
    assert bent.frequencies(3, 4) == pytest.approx({"h": 2.5, "frequency": 0.004})
    assert GONE == [True]
    scene, count = asked
    assert (count, scene.gravity, scene.cables[0].bending_stiffness) == (8, 0.0, 1e4)
    assert len(true) == 3


@pytest.mark.parametrize("irregular", [False, True])
def test_a_linear_answer(irregular, monkeypatch):
    """The norm of the standard deviations of all of a kind: of a wave amplitudes over the root of two."""
    scene = load_scene("storm" if irregular else "short")
    size = 1.0 if irregular else scene.waves.size

    class Seaway:
        def __init__(self, given, direction):
            assert (given, direction) == (scene, scene.waves.direction_deg)

        def wave(self, omega, wavelength):
            assert omega == pytest.approx(2 * math.pi / scene.waves.period)
            assert wavelength == scene.waves.wavelength
            return "wave"

        def regular(self, wave, height):
            assert (wave, height) == ("wave", scene.waves.size)
            return np.array([3.0, 4.0j, 7.0])

        def named(self, X):
            return dict(zip(("tension_top", "tension_top_b", "heave"), X, strict=True))

        def over_time(self, waves, times):
            assert (waves, times) == (scene.waves, "times")
            turn = 2 * math.pi * np.arange(8) / 8
            sizes = {"tension_top": 3.0, "tension_top_b": 4.0, "heave": 7.0}
            return {name: x * np.cos(turn) + 9.0 for name, x in sizes.items()}

        def destroy(self):
            GONE.append(True)

    monkeypatch.setattr(linear_answer, "Seaway", Seaway)
    found = linear_answer._deviation(scene, ("tension_top",), "times")
    assert found == pytest.approx(size * 5.0 / math.sqrt(2))
    assert linear_answer._deviation(scene, ("sway",), "times") is None
    assert GONE == [True, True]
