"""Numbers and warnings of `check` about waves, radiation and weather: each function alone, at its thresholds.

Source: waves in deep water by hand; linearised drag; differences of tabulated values.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from test_check_alone import upright

from dolfbuoy.check import potential_flow, waves, weather
from dolfbuoy.check.report import Report
from dolfbuoy.errors import InputError
from dolfbuoy.scene.waves import Waves

DEEP = Fake(sea=Fake(density=1000.0, depth=1e4), gravity=10.0)


def test_damping_that_belongs_to_a_force():
    """Haskind in deep water: k |F|^2/(4 rho g c_g) in heave, half of that of a plane; c_g = g/(2 omega)."""
    omega, force = np.array([1.0, 2.0]), np.array([[3.0, 1j, 4.0 + 3.0j], [2.0, 1.0, 1.0]])
    found = potential_flow._haskind(DEEP, omega, force)
    heave = omega**2 / 10 / (4 * 1000 * 10 * 10 / (2 * omega))
    np.testing.assert_allclose(found, heave[:, None] * np.abs(force) ** 2 * [0.5, 0.5, 1.0], rtol=1e-9)


def test_how_far_two_are_apart():
    """In surge or heave, relative to the largest of each; pitch does not count."""
    exact = np.array([[2.0, 5.0, 10.0], [4.0, 5.0, -20.0]])
    for changed, apart in (([1.0, 0, 0], 0.25), ([0, 9.0, 0], 0.0), ([0, 0, 10.0], 0.5), ([1.0, 0, 1.0], 0.25)):
        assert potential_flow._apart(exact + np.array([changed, [0, 0, 0]]), exact) == apart


@pytest.mark.parametrize(
    ("depth", "density", "given", "said"),
    [
        (
            100.0,
            1000.0,
            None,
            "buoy.potential_flow is for deep water, the sea has 100 m: waves of 15.7 s feel the bed.",
        ),
        (250.0, 1000.0, None, None),  # k h = 4.0
        (
            249.0,
            1000.0,
            None,
            "buoy.potential_flow is for deep water, the sea has 249 m: waves of 15.7 s feel the bed.",
        ),
        (
            251.0,
            1000.0,
            100.0,
            "buoy.potential_flow is for 100 m of water, the sea has 251 m: waves of 15.7 s feel the bed.",
        ),
        (100.0, 1000.0, 102.9, None),
        (
            100.0,
            1000.0,
            103.1,
            "buoy.potential_flow is for 103.1 m of water, the sea has 100 m: waves of 15.7 s feel the bed.",
        ),
        (
            100.0,
            1031.0,
            100.0,
            "buoy.potential_flow is for water of 1000.0 kg/m^3, the sea has 1031 kg/m^3.",
        ),
        (100.0, 1029.0, 100.0, None),
    ],
)
def test_coefficients_of_other_water(monkeypatch, depth, density, given, said):
    """k h from 4 up is deep; differences of 3 % in depth or density are accepted."""
    monkeypatch.setattr(potential_flow, "dispersion_wavenumber", lambda T, depth, g: (2 * math.pi / T) ** 2 / g)
    flow = Fake(omega=[0.4, 2.0], depth=given, density=1000.0)
    report = Report([])
    scene = Fake(sea=Fake(depth=depth, density=density), gravity=10.0)
    potential_flow._water(scene, Fake(section=Fake(potential_flow=flow)), report)
    assert report.warnings == ([said] if said else [])
    flow.density = None
    report = Report([])
    potential_flow._water(scene, Fake(section=Fake(potential_flow=flow)), report)
    assert report.warnings == ([said] if said and "kg/m^3" not in said else [])


@pytest.mark.parametrize(("last", "said"), [(0.1, []), (0.1011, ["1 % of the waves' energy is above 2 rad/s"])])
def test_waves_beyond_the_coefficients(monkeypatch, last, said):
    """More than a hundredth of their energy, strictly above the last frequency."""
    sea = Fake(amplitude=np.array([1.0, last]), in_water=np.array([2.0, 2.1]))
    monkeypatch.setattr(potential_flow, "AirySum", Fake(of=lambda scene: sea))
    report = Report([])
    potential_flow._range(None, Fake(section=Fake(potential_flow=Fake(omega=[0.1, 2.0]))), report)
    assert [sentence.split(",")[0] for sentence in report.warnings] == said


@pytest.mark.parametrize(
    ("period", "heave", "of_drag", "motions"),
    [
        (8.0, 0.1, 0.19, ["heave", "pitch"]),
        (8.0, 0.1, 0.21, ["pitch"]),
        (10.0 / 1.25, 0.1, 0.0, ["heave", "pitch"]),
        (10.0 / 1.26, 0.1, 0.0, []),
        (10.0 / 0.8, 0.1, 0.0, ["heave", "pitch"]),
        (10.0 / 0.79, 0.1, 0.0, []),
    ],
)
def test_radiation_that_would_damp_a_resonance(monkeypatch, period, heave, of_drag, motions):
    """Half of the drag damping in heave, 3 % in pitch, within 0.8 to 1.25 of the wave period."""
    omega = 2 * math.pi / 10.0
    found = Fake(
        heave=omega, pitch=omega, of_heave=(500.0, 2 * omega * 1500 * heave), of_pitch=(1.0, 2 * omega * 10 * 0.031)
    )
    monkeypatch.setattr(waves, "estimate", lambda scene, section: found)
    report = Report([])
    waves.of_radiation(None, Fake(main_period=period), of_drag, upright(), report, waves.NEAR)
    assert report.numbers == [
        ("heave damping ratio by waves of its own", pytest.approx(heave, rel=1e-12), "", "an estimate; period 10 s"),
        ("pitch damping ratio by waves of its own", pytest.approx(0.031, rel=1e-12), "", "an estimate; period 10 s"),
    ]
    assert [sentence.split(",")[0].removeprefix("The natural period of ") for sentence in report.warnings] == motions
    given = Fake(wave_damping=[1.0, 2.0], potential_flow=None), Fake(wave_damping=None, potential_flow="flow")
    for section in given:
        waves.of_radiation(None, Fake(main_period=period), of_drag, upright(section=section), report, waves.NEAR)

    def drowned(scene, section):
        raise InputError("it sinks")

    monkeypatch.setattr(waves, "estimate", drowned)
    waves.of_radiation(None, Fake(main_period=period), of_drag, upright(), report, waves.NEAR)
    assert len(report.numbers) == 2


@pytest.mark.parametrize(
    ("amplitude", "wavelength", "theory", "mismatch", "warnings"),
    [
        (1.0, None, "airy", None, []),
        (1.0, 10 * 36 / (2 * math.pi) * 1.101, "airy", 10.1, ["differs"]),
        (1.0, 10 * 36 / (2 * math.pi) * 0.901, "airy", -9.9, []),
        (0.0711 * 57.29578, None, "airy", None, ["breaking"]),
        (0.0709 * 57.29578, None, "airy", None, []),
    ],
)
def test_a_regular_wave(amplitude, wavelength, theory, mismatch, warnings):
    """In deep water: wavelength g T^2/(2 pi); breaking above 0.142 of that in height."""
    wave = Waves(amplitude=amplitude, period=6.0, wavelength=wavelength, theory=theory)
    length, report = wavelength or 57.29578, Report([])
    waves._regular(wave, 2 * math.pi / length, 1e4, 10.0, report)
    numbers = {name: (value, unit, said) for name, value, unit, said in report.numbers}
    given = "given" if wavelength else "from the dispersion relation"
    assert numbers.pop("wavelength") == (pytest.approx(length, rel=1e-9), "m", given)
    steep = numbers.pop("wave steepness H/lambda")
    assert steep == (pytest.approx(2 * amplitude / length, rel=1e-9), "", "breaking at 0.142 (Miche)")
    if mismatch is None:
        assert numbers == {}
    else:
        value, unit, said = numbers["dispersion mismatch of wavelength"]
        assert (value, unit) == (pytest.approx(mismatch, rel=1e-4), "%")
        assert said == f"the period gives 57.3 m; omega^2/(g k tanh kh) = {1 + mismatch / 100:.5g}"
    assert report.periods == {"wave": 6.0}
    assert ["differs" if "differs" in said else "breaking" for said in report.warnings] == warnings


@pytest.mark.parametrize(
    ("ratio", "flow", "said"),
    [(0.19, None, []), (0.199, None, ["k R"]), (0.2, None, ["k R", "D/lambda"]), (0.2, "flow", [])],
)
def test_a_hull_in_waves(monkeypatch, ratio, flow, said):
    """Heave damping from drag of equal work: 8/(3 pi) rho/2 C A u over twice sqrt(k m)."""
    monkeypatch.setattr(waves, "of_radiation", lambda *given: told.append(given[2]))
    told, section = [], Fake(wave_damping=None, potential_flow=flow, axial_drag=2.0, axial_added_mass=0.5)
    wave = Waves(amplitude=0.5, period=6.0)
    for more, linear in ((None, 0.0), ([300.0, 1.0], 300.0)):
        section.wave_damping = more
        report = Report([])
        waves._hull(Fake(gravity=10.0), wave, upright(section=section), ratio * math.pi, report, False)
        numbers = {name: value for name, value, *_ in report.numbers}
        assert numbers["diffraction parameter D/lambda"] == pytest.approx(ratio, rel=1e-12)
        assert numbers["k R of the hull"] == pytest.approx(ratio * math.pi, rel=1e-12)
        area, spheres, _ = upright().shape.projected(1 / math.pi)
        drag = 8 / (3 * math.pi) * 500 * 2.0 * area * (0.5 * 2 * math.pi / 6) + linear
        critical = 2 * math.sqrt(1000 * 10 * math.pi * (1000 + 0.5 * 1000 * spheres))
        assert numbers["heave damping ratio"] == pytest.approx(drag / critical, rel=1e-6)
        if flow is None:
            assert told.pop() == pytest.approx(drag / critical, rel=1e-6)
        assert told == []
        assert sorted(("k R" if "strips" in one else "D/lambda") for one in report.warnings) == sorted(said)
    report = Report([])
    waves._hull(Fake(gravity=0.0), wave, upright(section=section), 1.0, report, False)
    assert "heave damping ratio" not in {name for name, *_ in report.numbers}


def test_how_fast_a_current_changes():
    """The largest change from row to row in a second, of the fastest layer; of a grid at any height."""
    rows = [[0.0, 1.0, 0.0], [10.0, 1.5, 0.0], [14.0, 1.1, 0.0]]
    for current, rate in (
        (Fake(grid=None, over_time=rows, speed=2.0, profile="uniform"), 0.2),
        (Fake(grid=None, over_time=rows, speed=None, profile=[[-9.0, 0.5], [0.0, 3.0], [1.0, 1.0]]), 0.3),
        (Fake(grid=None, over_time=None, speed=2.0, profile="uniform"), 0.0),
        (Fake(grid=[[0, -9, 1, 0], [0, 0, 1, 0], [5, -9, 1, 0], [5, 0, 4, 4.0]]), 1.0),
        (Fake(grid=[[0, -9, 1, 0], [0, 0, 1, 0]]), 0.0),
    ):
        assert weather._rate(current) == pytest.approx(rate, rel=1e-12)
