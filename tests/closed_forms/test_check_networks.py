"""`check` of several lines, segments and buoys reports for each, by name, what it reports for one alone.

Source: the closed forms of test_check, equilibria of `static`, the same buoy or line alone.
"""

import math

import pytest
from alone import solve_static
from test_check import (
    BUOY,
    CENTER,
    DEPTH,
    MASS,
    MOORED,
    RADIUS,
    RHO,
    WEIGHT,
    G,
    floating,
    numbers_of,
)  # fmt: skip

LEGS = {
    "gravity": G,
    "sea": {"depth": DEPTH, "density": RHO},
    "cable": [
        {"name": name, "from": [30.0 * math.cos(angle), 30.0 * math.sin(angle), -DEPTH], "to": f"buoy.{name}",
         "material": "rope", "length": 38.0, "elements": 8}
        for name, angle in (("a", 0.0), ("b", 2 * math.pi / 3), ("c", 4 * math.pi / 3))
    ],
    "material": {"rope": {"line_density": 9.0, "diameter": 0.06, "axial_stiffness": 3e6, "added_mass": 1.0}},
    "buoy": BUOY | {"fairleads": {
        name: [math.cos(angle), math.sin(angle), 0.35]
        for name, angle in (("a", 0.0), ("b", 2 * math.pi / 3), ("c", 4 * math.pi / 3))
    }},
}  # fmt: skip


def test_a_buoy_under_the_pull_of_its_legs():
    """Between three legs in still water its draft is that at rest; its GM is that with their pull at 0.35 m."""
    numbers, report = numbers_of(LEGS)
    rest = solve_static(LEGS)
    pull = float(rest.displaced_mass) * G - MASS * G
    draft, _, GM = floating(MASS + pull / G, pull)
    assert numbers["draft with the pull of its lines"] == pytest.approx(draft, rel=1e-6)
    assert numbers["GM with the pull of its lines"] == pytest.approx(GM, rel=1e-6)
    assert draft == pytest.approx(CENTER - float(rest.buoy_position[2]), rel=1e-6)
    assert numbers["draft, free"] == pytest.approx(floating(MASS)[0])
    assert numbers["equilibrium: offset of C from the middle of its anchors"] == pytest.approx(0.0, abs=1e-5)
    assert numbers["equilibrium: C above still water"] == pytest.approx(float(rest.buoy_position[2]))
    assert not report.warnings


def test_rows_of_every_line():
    """By name where there are several: weight, axial period, Keulegan-Carpenter number; other materials, other rows."""
    thin = {"line_density": 2.0, "diameter": 0.03, "axial_stiffness": 1e6}
    legs = [LEGS["cable"][0] | thin, *LEGS["cable"][1:]]
    numbers, report = numbers_of(LEGS | {"cable": legs, "waves": {"amplitude": 0.4, "period": 5.0}})
    for name, m, d, EA in (("a", 2.0, 0.03, 1e6), ("b", 9.0, 0.06, 3e6), ("c", 9.0, 0.06, 3e6)):
        assert numbers[f"{name}: cable weight in water"] == pytest.approx(38 * (m - RHO * math.pi * d**2 / 4) * G)
        assert report.periods[f"{name}, first axial (fixed ends)"] == pytest.approx(2 * 38 * math.sqrt(m / EA))
        assert numbers[f"{name}: explicit step limit of Eq. (24)"] == pytest.approx(38 / 8 * math.sqrt(m / EA / 12))
        k = 2 * math.pi / numbers["wavelength"]
        way = 2 * math.pi * 0.4 / math.tanh(k * DEPTH)
        assert numbers[f"{name}: Keulegan-Carpenter number of the cable"] == pytest.approx(way / d)
        assert f"equilibrium: tension of {name} at buoy.{name}" in numbers
    assert numbers["k R of the hull"] == pytest.approx(k * RADIUS)
    assert numbers["Keulegan-Carpenter number of the buoy"] == pytest.approx(way / 2.2)
    assert numbers["heave damping ratio"] == 0.0


def test_pieces_of_other_materials():
    """Parts of one material count as one; material between them has its own rows."""
    rope = {"length": 10.0, "elements": 4}
    segments = [rope, rope, rope | {"line_density": 40.0, "elements": 2}]
    line = {key: value for key, value in MOORED["cable"].items() if key not in ("length", "elements")}
    numbers, report = numbers_of(MOORED | {"cable": line | {"segments": segments}})
    heavy = (40.0 - RHO * math.pi * 0.09**2 / 4) * G
    assert numbers["cable.0: cable weight in water"] == pytest.approx(20 * WEIGHT)
    assert numbers["cable.2: cable weight in water"] == pytest.approx(10 * heavy)
    assert "cable.1: cable weight in water" not in numbers
    assert report.periods["cable.2, first axial (fixed ends)"] == pytest.approx(20 * math.sqrt(40 / 4e6))
    assert any(f"{30 - DEPTH:.3g} m longer than the water is deep" in warning for warning in report.warnings)
    assert numbers["equilibrium: offset of C from the anchor"] > 2


def test_a_material_by_its_name_hides_nothing():
    """Equal rows, periods and warnings for keys in [cable] and in [material.NAME]."""
    keys = ("line_density", "diameter", "axial_stiffness", "added_mass", "normal_drag")
    own, line = {key: MOORED["cable"][key] for key in keys}, MOORED["cable"]
    named = {key: value for key, value in line.items() if key not in keys} | {"material": "chain"}
    waves = {"waves": {"amplitude": 0.4, "period": 5.0}}
    numbers, report = numbers_of(MOORED | waves)
    other, other_report = numbers_of(MOORED | waves | {"cable": named, "material": {"chain": own}})
    assert other == pytest.approx(numbers, rel=1e-9)
    assert other_report.warnings == report.warnings
    assert other_report.periods == pytest.approx(report.periods, rel=1e-6)
    assert {"k R of the hull", "heave damping ratio", "equilibrium: offset of C from the anchor"} <= set(numbers)


def test_buoys_without_a_cable():
    """Each by name: draft, metacentre and periods as for a single buoy."""
    alone = {key: MOORED[key] for key in ("gravity", "sea")} | {"waves": {"amplitude": 0.2, "period": 5.0}}
    light = BUOY | {"mass": 1500.0, "inertia": [1200.0, 700.0]}
    numbers, report = numbers_of(alone | {"buoy": [BUOY | {"name": "one"}, light | {"name": "other"}]})
    for name, buoy in (("one", BUOY), ("other", light)):
        expected, expected_report = numbers_of(alone | {"buoy": buoy})
        for row in ("draft, free", "GM, free", "k R of the hull", "heave damping ratio"):
            assert numbers[f"{name}: {row}"] == pytest.approx(expected[row])
        for motion in ("heave", "pitch"):
            period = expected_report.periods[f"buoy, {motion}"]
            assert report.periods[f"{name} {motion}"] == pytest.approx(period, rel=1e-6)
