"""Derivatives of equilibria and periods with respect to numbers of the scene.

Source: closed forms: the catenary on a bed, a straight streamer in a current, a mass on a wire, a buoy on a spring.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import dolfbuoy

G = 9.81
INEXTENSIBLE = {"axial_stiffness": float("inf"), "position_degree": 2, "tension_degree": 1}


def test_chain_on_a_bed():
    """T = H + w h at the top of a chain that lies and rises to a held end, by its weight and by the depth; the held
    end of the mooring says H: of a length L = X - H/w acosh(1 + w h/H) + sqrt(h^2 + 2 H h/w)."""
    length, height, reach, density, diameter = 200.0, 60.0, 180.0, 50.0, 0.03

    def tension(line_density, h):
        w = (line_density - 1025 * math.pi * diameter**2 / 4) * G

        def spare(H):
            return reach - H / w * math.acosh(1 + w * h / H) + math.sqrt(h**2 + 2 * H * h / w) - length

        return brentq(spare, 1e2, 1e6, xtol=1e-9) + w * h

    scene = {
        "sea": {"depth": height},
        "seabed": {"stiffness": 1e9},
        "cable": INEXTENSIBLE
        | {
            "length": length,
            "line_density": density,
            "diameter": diameter,
            "elements": 400,
            "top": {"kind": "fixed", "position": [reach, 0.0, 0.0]},
        },
    }
    found = dolfbuoy.sensitivities(scene, ["cable.line_density", "sea.depth"], what="static")
    by_density = (tension(density + 0.01, height) - tension(density - 0.01, height)) / 0.02
    by_depth = (tension(density, height + 0.01) - tension(density, height - 0.01)) / 0.02
    assert found.tension_top.values[0] == pytest.approx(tension(density, height), rel=1e-4)
    assert found.d_tension_top.values[:, 0] == pytest.approx([by_density, by_depth], rel=1e-3)


def test_streamer():
    """A light rope that is held below and free above hangs straight in a current, its lift against the drag across it,
    w cos a = 1/2 rho C_n D U^2 sin^2 a, and pulls w sin a and the drag along it."""
    diameter, density, speed, across, along, length = 0.05, 1.0, 1.0, 1.2, 0.02, 40.0

    def tension(line_density, U):
        lift = (1025 * math.pi * diameter**2 / 4 - line_density) * G
        drag = 0.5 * 1025 * diameter * U**2
        a = brentq(lambda a: lift * math.cos(a) - across * drag * math.sin(a) ** 2, 1e-6, math.pi / 2)
        return length * (lift * math.sin(a) + along * drag * math.cos(a) ** 2)

    scene = {
        "sea": {"depth": 100.0},
        "current": {"speed": speed},
        "cable": INEXTENSIBLE
        | {
            "length": length,
            "line_density": density,
            "diameter": diameter,
            "elements": 4,
            "normal_drag": across,
            "tangential_drag": along,
            "top": {"kind": "free"},
        },
    }
    found = dolfbuoy.sensitivities(scene, ["cable.line_density", "current.speed"], what="static")
    expected = [
        (tension(density + 1e-4, speed) - tension(density - 1e-4, speed)) / 2e-4,
        (tension(density, speed + 1e-4) - tension(density, speed - 1e-4)) / 2e-4,
    ]
    assert found.tension_anchor.values[0] == pytest.approx(tension(density, speed), rel=1e-4)
    assert found.d_tension_anchor.values[:, 0] == pytest.approx(expected, rel=1e-3)


def test_mass_on_a_wire():
    """T = 2 pi sqrt((M + m L/3) L/EA) of a weight below a light wire, by its mass and the stiffness."""
    mass, length, ea = 500.0, 20.0, 1e5
    scene = {
        "cable": [
            {
                "name": "wire",
                "length": length,
                "line_density": 1e-3,
                "axial_stiffness": ea,
                "strain_form": "energy",
                "elements": 4,
                "from": [0.0, 0.0, 0.0],
                "to": "weight",
            }
        ],
        "joint": [{"name": "weight", "mass": mass, "volume": 0.0}],
    }
    found = dolfbuoy.sensitivities(scene, ["joint.weight.mass", "cable.axial_stiffness"], what="modes")
    expected = 2 * math.pi * math.sqrt((mass + 1e-3 * length / 3) * length / ea)
    k = np.abs(found.period.values - expected).argmin()
    assert found.period.values[k] == pytest.approx(expected, rel=1e-4)
    assert found.d_period.values[:, k] == pytest.approx([expected / mass / 2, -expected / ea / 2], rel=1e-3)


def test_buoy_on_a_spring():
    """T = 2 pi sqrt(M L/EA) of a buoy in air on a light elastic line, by its mass and the stiffness."""
    mass, length, ea = 6000.0, 1.0, 4e5
    scene = {
        "buoy": {"mass": mass, "mooring_height": 2.0, "center_of_mass": 1.0, "inertia": [9000.0, 6000.0]},
        "cable": {"length": length, "line_density": 1e-2, "axial_stiffness": ea, "elements": 2},
    }
    found = dolfbuoy.sensitivities(scene, ["buoy.mass", "cable.axial_stiffness"], what="modes")
    expected = 2 * math.pi * math.sqrt(mass * length / ea)
    k = np.nanargmin(np.abs(found.period.values - expected))
    assert found.period.values[k] == pytest.approx(expected, rel=1e-5)
    assert found.d_period.values[:, k] == pytest.approx([expected / mass / 2, -expected / ea / 2], rel=1e-3)
