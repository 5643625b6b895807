"""Forces and motions of hulls in small waves: Froude-Krylov forces, long waves free and moored, natural periods.

Source: closed forms with Bessel functions, the isobars that a small body follows, periods in tests/reference (mpmath).
"""

import math

import numpy as np
import pytest
from alone import solve_static
from helpers import reference, reference_buoy
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.periods import buoy_periods
from dolfbuoy.linear.seaway import responses
from dolfbuoy.linear.spectrum import force, small_waves
from dolfbuoy.model.buoy import MOTION
from dolfbuoy.model.rigid import float_upright, mass_properties, shape_of

HULL = reference("hull")
RHO, G = 1025.0, 9.81


def floating(case, height, inertia, **buoy):
    """A cylinder D of tests/reference afloat in deep water."""
    mass = RHO * math.pi / 4 * case["D"] ** 2 * case["draft"]
    body = {"hull": [[0.0, case["D"]], [height, case["D"]]], "mass": mass, "center_of_mass": case["z_C"]}
    return {"sea": {"depth": 1e5, "density": RHO}, "buoy": body | {"inertia": inertia} | buoy}


DISC = floating(
    HULL["rao_capytaine_disc"]["input"],
    1.0,
    [2500.0, 4000.0],
    added_mass=0.38,
    axial_added_mass=1.1,
    rotational_added_mass=1.17,
)
CYLINDER = floating(HULL["long_wave_pitch_cylinder"]["input"], 2.4, [3500.0, 4000.0], added_mass=0.8)
SPAR = floating(HULL["froude_krylov_spar"]["input"], 10.0, [40000.0, 900.0], added_mass=1.0)


@pytest.mark.parametrize("averaged", [False, True])
@pytest.mark.parametrize("name", ["disc", "spar"])
def test_froude_krylov(name, averaged):
    """Heave with the elevation, surge and pitch about C with sin(omega t); without averages the error is (kR)^2."""
    case, rows = (HULL[f"froude_krylov_{name}"][key] for key in ("input", "expected"))
    scene = load_scene(floating(case, 2 * case["draft"], [1.0, 1.0], disk_averages=averaged))
    found = linearise(scene, MPI.COMM_SELF, small_waves(scene, 5.0))
    for row in rows:
        problem = found.problem
        problem.change(problem.scene.model_copy(update={"waves": small_waves(scene, row["T"])}))
        crest, later = (MOTION.of(-force(found, phase)) for phase in (0.0, -math.pi / 2))
        short = (row["k"] * case["D"] / 2) ** 2
        pairs = [
            (later.momentum[0], row["surge"], short / 8),
            (crest.momentum[2], row["heave"], short / 8),
            (later.angular_momentum[1], row["pitch"], short / 6),
        ]
        for mine, exact, tolerance in pairs:
            assert mine == pytest.approx(exact, rel=1e-3 if averaged else tolerance + 0.005)
        assert abs(crest.momentum[0]) < 1e-6 * abs(row["surge"])
    found.destroy()


@pytest.mark.parametrize("scene", [DISC, CYLINDER, SPAR], ids=["disc", "cylinder", "spar"])
def test_long_waves_free(scene):
    """pitch/slope + 1 falls like (pitch period/T)^2; surge and heave tend to those of the water."""
    scene = load_scene(scene)
    long = 10 * buoy_periods(scene)["pitch"].period
    first, second = responses(scene, [long, 2 * long])
    errors = [abs(found.pitch_over_slope + 1) for found in (first, second)]
    assert errors[0] < 0.05
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)
    limit = [(4 * b - a) / 3 for a, b in zip(first.motions, second.motions, strict=True)]  # errors fall with T^-2
    assert limit[0] == pytest.approx(1j, abs=0.01)
    assert limit[2] == pytest.approx(1, abs=0.01)
    assert np.abs([limit[1], limit[3], limit[5]]).max() < 1e-6


def test_pitch_at_20_seconds():
    """Potential flow has -1.0005 for the disc and -1.022 for the cylinder."""
    assert responses(load_scene(DISC), [20.0])[0].pitch_over_slope == pytest.approx(-1.0005, rel=0.015)
    exact = HULL["long_wave_pitch_cylinder"]["expected"]["at_T_20_s_potential_flow"]
    assert responses(load_scene(CYLINDER), [20.0])[0].pitch_over_slope == pytest.approx(exact, rel=0.015)


def on_a_rope(buoy, pull, draft):
    """A buoy on a weightless rope so long that its pull is the same for any position of the buoy."""
    depth, EA = 1e5, 1e5
    rope = {"line_density": 1e-7, "diameter": 1e-6, "axial_stiffness": EA, "elements": 4}
    length = (depth - draft) / (1 + pull / EA)
    return load_scene({"sea": {"depth": depth, "density": RHO}, "buoy": buoy, "cable": rope | {"length": length}})


@pytest.mark.parametrize("C_A", [0.0, None], ids=["without added mass", "with it"])
@pytest.mark.parametrize(
    ("buoy", "pull", "draft"),
    [(load_scene("short").to_dict()["buoy"], 4481.0, 2.4), (DISC["buoy"], 1310.0, 0.52)],
    ids=["short", "disc"],
)
def test_long_waves_moored(buoy, pull, draft, C_A):
    """The pull does not turn with the isobars: pitch/slope = -h/(h + T (KG - KO)), positive for `short`.

    The buoy, lighter than the water that it displaces, then moves more than the water, and its added mass holds it back
    at KB: to -h comes T (KB - KG) mu/(M + mu), mu = C_A rho V.  At finite periods errors go with T^-2 (pitch) and
    T^2 (the rope's stiffness in surge).
    """
    buoy = buoy | ({} if C_A is None else {"added_mass": C_A})
    scene = on_a_rope(buoy, pull, draft)
    buoy = scene.buoy[0]
    shape, mass = shape_of(buoy), mass_properties(buoy)
    at_rest = solve_static(scene)
    T = float(at_rest.end_tension[2])
    assert pytest.approx(pull, rel=0.02) == T
    upright = float_upright(shape, mass, RHO, G, T, 0.0)
    h = G * upright.displaced_mass * (upright.KB + upright.BM - mass.height)
    mu = buoy.added_mass * upright.displaced_mass
    added = T * (upright.KB - mass.height) * mu / (mass.mass + mu)
    periods = np.array([10.0, 20.0, 40.0])
    found = np.array([x.pitch_over_slope for x in responses(scene, periods)])
    assert np.abs(found.imag).max() < 0.01 * np.abs(found).min()
    limit = np.linalg.solve(np.column_stack([np.ones(3), periods**-2, periods**2]), found.real)[0]
    assert limit == pytest.approx((added - h) / (h + T * mass.height), rel=0.01)
    assert (limit > 0) == (buoy is not DISC["buoy"] and h < 0)


@pytest.mark.parametrize("name", ["float_cylinder", "float_spar_CA1"])
def test_periods_of_floating_cylinders(name):
    """Heave without the added mass across the axis: omega^2 = rho g A/(M + axial part)."""
    case, exact = HULL[name]["input"], HULL[name]["expected"]["out"]
    body = {"added_mass": case["C_A"], "axial_added_mass": case["axial_added_mass"]}
    found = buoy_periods(load_scene(floating(case, 1.5 * case["draft"], [case["I_transverse"], 900.0], **body)))
    area, disc = math.pi * case["D"] ** 2 / 4, RHO * 2 / 3 * math.pi * (case["D"] / 2) ** 3
    heave = 2 * math.pi * math.sqrt((exact["mass"] + disc * case["axial_added_mass"]) / (RHO * G * area))
    assert found["heave"].period == pytest.approx(heave, rel=1e-6)
    for name in ("roll", "pitch"):
        assert found[name].period == pytest.approx(exact["T_pitch"], rel=1e-6)
        assert abs(found[name].damping_ratio) < 1e-6
    assert not {"surge", "sway", "yaw"} & set(found)


def test_periods_of_a_moored_buoy():
    """On an inextensible vertical cable: lateral swing and pitch, no heave."""
    case, exact = HULL["moored_buoy"]["input"], HULL["moored_buoy"]["expected"]["omega"]
    found = buoy_periods(
        load_scene(
            {
                "sea": {"depth": case["depth"], "density": RHO},
                "buoy": {
                    "hull": [[0.0, case["hull_D"]], [case["hull_height"], case["hull_D"]]],
                    "mass": case["mass"],
                    "center_of_mass": case["z_C"],
                    "inertia": [case["I_transverse"], 400.0],
                    "added_mass": case["C_A"],
                },
                "cable": {
                    "length": case["L"],
                    "line_density": case["rho0"],
                    "diameter": case["cable_diameter"],
                    "added_mass": case["cable_C_A"],
                    "axial_stiffness": math.inf,
                    "elements": 8,
                    "position_degree": 2,
                    "tension_degree": 1,
                },
            }
        )
    )
    for name, omega in (("surge", exact[0]), ("sway", exact[0]), ("roll", exact[1]), ("pitch", exact[1])):
        assert 2 * math.pi / found[name].period == pytest.approx(omega, rel=1e-6), name
    assert "heave" not in found


def test_periods_of_the_reference_cylinder():
    """Heave and pitch of tests/reference/buoy.json, without added mass; pitch with C_A 0.3 too."""
    exact = reference("buoy")["cylinder"]
    for C_A in ("0", "0.3"):
        buoy = reference_buoy("buoyA_short", added_mass=float(C_A))
        found = buoy_periods(load_scene({"sea": {"depth": 20.0}, "buoy": buoy}))
        assert found["heave"].period == pytest.approx(exact["T_heave"]["0"], rel=1e-6)
        assert found["pitch"].period == pytest.approx(exact["T_pitch"][C_A], rel=2e-3)


def test_damping_ratio():
    """Of heave: c/(2 sqrt(k m)) of a linear damper, at the undamped period."""
    m = HULL["rao_capytaine_disc"]["input"]["mass"] + RHO * 2 / 3 * math.pi * 1.5**3 * 1.1
    k = RHO * G * math.pi * 1.5**2
    found = buoy_periods(load_scene(DISC, buoy__wave_damping=[0.3 * 2 * math.sqrt(k * m), 0.0]))["heave"]
    assert found.damping_ratio == pytest.approx(0.3, rel=1e-5)
    assert found.period == pytest.approx(2 * math.pi * math.sqrt(m / k), rel=1e-5)
    assert found.share == pytest.approx(1, abs=1e-6)


def test_many_unknowns():
    """Shift and invert about several frequencies finds what the whole spectrum has."""
    scene = load_scene("short")
    few = buoy_periods(scene)
    many = buoy_periods(load_scene(scene, cable__elements=80))
    assert set(many) == set(few)
    for name in ("heave", "roll", "pitch"):
        assert many[name].period == pytest.approx(few[name].period, rel=0.02)


def test_waves_from_any_side():
    """A buoy without a cable responds equally in all directions, whatever its own axes."""
    ahead = responses(load_scene(DISC), [6.0])[0].motions
    for direction in (73.0, 180.0):
        np.testing.assert_allclose(responses(load_scene(DISC), [6.0], direction)[0].motions, ahead, atol=1e-6)


def test_current_does_not_carry_a_free_buoy_away():
    """Linearised where it floats in still water; with a current it would be at rest nowhere."""
    still = responses(load_scene(DISC), [6.0])[0]
    carried = responses(load_scene(DISC, current={"speed": 1.0}, buoy__normal_drag=1.0), [6.0])[0]
    np.testing.assert_allclose(carried.motions, still.motions, atol=1e-4)  # drag of still water is quadratic


@pytest.mark.parametrize("what", [buoy_periods, lambda scene: responses(scene, [5.0])])
def test_what_has_no_response(what):
    with pytest.raises(InputError, match=r"needs? \[buoy\], \[sea\] and gravity"):
        what(load_scene("driven"))
