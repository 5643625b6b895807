"""Natural modes: strings, chains, rods, hanging bodies, catenaries, Irvine's theory; names, kinds, refusals.

Source: closed forms, and exact linearised catenaries in tests/reference (mpmath, Galerkin and shooting).
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from alone import modes
from helpers import rates, reference
from mpi4py import MPI
from scipy.sparse import csr_matrix

from dolfbuoy import load_scene
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.moving import Moving, named
from dolfbuoy.linear.natural import lowest_modes
from dolfbuoy.solver.quadratic import Quadratic
from dolfbuoy.statics import catenary

CASES = reference("modes")
HULL = reference("hull")
RHO = 1025.0
HIGH = {"position_degree": 4, "tension_degree": 3}


def modes_of(scene, number=10):
    found = linearise(load_scene(scene), MPI.COMM_SELF)
    try:
        modes = lowest_modes(found, number)
    finally:
        found.destroy()
    assert max(mode.residual for mode in modes) < 1e-8
    return modes


def omegas(modes, *words):
    """Of the modes whose name has one of these words in it."""
    return [mode.omega for mode in modes if any(word in mode.name for word in words)]


def taut(line_density, T, EA, length, elements=8, **cable):
    """A string without weight between two points, stretched to the tension T."""
    top = {"kind": "fixed", "position": [length * (1 + T / EA), 0.0, 0.0]}
    body = {"line_density": line_density, "length": length, "axial_stiffness": EA, "elements": elements, "top": top}
    return {"gravity": 0.0, "cable": body | HIGH | cable}


def test_string():
    """Every transverse frequency twice, longitudinal ones apart; names count the half waves."""
    case, exact = CASES["string_dry"]["input"], CASES["string_dry"]["expected"]["omega"]
    modes = modes_of(taut(case["rho0"], case["T"], case["EA"], case["L"], elements=6), 9)
    transverse, axial = omegas(modes, "plane")[:6], omegas(modes, "axial")
    np.testing.assert_allclose(transverse, np.repeat(exact["transverse"], 2), rtol=1e-6)
    np.testing.assert_allclose(axial, exact["longitudinal"][: len(axial)], rtol=1e-6)
    for n in (1, 2, 3):
        assert {f"cable in plane {n}", f"cable out of plane {n}"} <= {mode.name for mode in modes}
    assert all(mode.kind == "oscillates" and abs(mode.damping_ratio) < 1e-9 for mode in modes)


def test_kelvin_voigt():
    """lambda of the longitudinal modes of a damped string, far above all transverse ones that its elements have."""
    case, exact = CASES["kelvin_voigt"]["input"], CASES["kelvin_voigt"]["expected"]["lambda"]
    modes = modes_of(taut(case["rho0"], case["T"], case["EA"], case["L"], damping=case["c"], elements=6), 52)
    axial = [mode for mode in modes if "axial" in mode.name][:3]
    for mode, (real, imaginary) in zip(axial, exact, strict=True):
        assert mode.root == pytest.approx(complex(real, imaginary), rel=1e-6)
        assert mode.damping_ratio == pytest.approx(-real / math.hypot(real, imaginary), rel=1e-6)


def hanging(case, **more):
    top = {"kind": "free"}
    return {"cable": {"length": case["L"], "line_density": case.get("rho0", 1.3), "top": top} | more}


def test_chain():
    case, exact = CASES["chain_dry"]["input"], CASES["chain_dry"]["expected"]["omega"]
    modes = modes_of(hanging(case, elements=16, **HIGH))
    np.testing.assert_allclose([mode.omega for mode in modes], np.repeat(exact, 2), rtol=1e-6)
    assert [mode.name for mode in modes] == [f"cable transverse {n}" for n in (1, 1, 2, 2, 3, 3, 4, 4, 5, 5)]


@pytest.mark.parametrize("count", [1, 3])
def test_rods(count):
    """Inextensible P1-P0 elements are rigid rods: so many modes in each plane, and no more."""
    case, exact = CASES[f"rods_{count}"]["input"], CASES[f"rods_{count}"]["expected"]["omega"]
    modes = modes_of(hanging(case, elements=count))
    np.testing.assert_allclose([mode.omega for mode in modes], np.repeat(exact, 2), rtol=1e-6)


def test_chain_with_body():
    case, exact = CASES["chain_with_body"]["input"], CASES["chain_with_body"]["expected"]["omega"]
    body = {"mass": case["mass"], "center_of_mass": 0.0, "mooring_height": case["C_below_mooring"]}
    cable = {"length": case["L"], "line_density": case["rho0"], "elements": 8} | HIGH
    scene = {"buoy": body | {"inertia": [case["I_transverse"], 5.0]}, "cable": cable}
    modes = modes_of(scene, 9)
    assert (modes[0].name, modes[0].kind, modes[0].omega) == ("yaw", "drifts", 0.0)
    np.testing.assert_allclose([mode.omega for mode in modes[1:]], np.repeat(exact, 2), rtol=1e-6)
    assert sum(modes[1].shares.values()) == pytest.approx(1)


def afloat(case, **buoy):
    """A cylinder of reference/hull.json in deep water."""
    stations = {"hull": [[0.0, case["D"]], [1.5 * case["draft"], case["D"]]], "center_of_mass": case["z_C"]}
    body = {"inertia": [case["I_transverse"], 900.0], "added_mass": case["C_A"]}
    return {"sea": {"depth": 1e5, "density": RHO}, "buoy": stations | body | buoy}


@pytest.mark.parametrize("name", ["float_cylinder", "float_spar_CA1"])
def test_floating(name):
    """Three drifts, pitch and roll as the reference has them, and heave, whose added mass is that of its disc alone."""
    case, exact = HULL[name]["input"], HULL[name]["expected"]["out"]
    axial = case["axial_added_mass"]
    modes = modes_of(afloat(case, mass=exact["mass"], axial_added_mass=axial))
    assert [mode.kind for mode in modes] == ["drifts"] * 3 + ["oscillates"] * 3
    disc = RHO * 2 / 3 * math.pi * (case["D"] / 2) ** 3 * axial
    heave = math.sqrt(RHO * 9.81 * math.pi * case["D"] ** 2 / 4 / (exact["mass"] + disc))
    for way, omega in (("pitch", exact["omega_pitch"]), ("roll", exact["omega_pitch"]), ("heave", heave)):
        assert omegas(modes, way) == [pytest.approx(omega, rel=1e-6)]


@pytest.mark.parametrize("elements", [8, 10])
def test_moored_buoy(elements):
    """On an inextensible vertical cable: it swings and pitches, the cable swings, each in two planes; no heave.

    With 8 elements LAPACK cannot order the values of SLEPc's first attempt; with 10 a vector of the zeros is none.
    """
    case, exact = HULL["moored_buoy"]["input"], HULL["moored_buoy"]["expected"]["omega"]
    buoy = {"hull": [[0.0, case["hull_D"]], [case["hull_height"], case["hull_D"]]], "center_of_mass": case["z_C"]}
    buoy |= {"mass": case["mass"], "inertia": [case["I_transverse"], 400.0], "added_mass": case["C_A"]}
    cable = {
        "length": case["L"],
        "line_density": case["rho0"],
        "diameter": case["cable_diameter"],
        "elements": elements,
    }
    cable |= {"added_mass": case["cable_C_A"], "axial_stiffness": math.inf} | HIGH
    modes = modes_of({"sea": {"depth": case["depth"], "density": RHO}, "buoy": buoy, "cable": cable}, 9)
    assert (modes[0].name, modes[0].kind) == ("yaw", "drifts")
    np.testing.assert_allclose([mode.omega for mode in modes[1:]], np.repeat(exact, 2), rtol=1e-6)


@pytest.mark.parametrize("name", ["catenary_sagging_95", "catenary_deep_70", "catenary_short_in_water"])
def test_catenary(name):
    """In plane and out of it."""
    case, exact = CASES[name]["input"], CASES[name]["expected"]
    rho, top = case["rho"], {"kind": "fixed", "position": [case["X"], 0.0, case["Z"]]}
    cable = {"length": case["L"], "line_density": rho, "axial_stiffness": float(case["EA"]), "top": top} | HIGH
    scene = {"cable": cable | {"elements": 16, "anchor": [0.0, 0.0, 0.0]}}
    if "ma" in case:  # as much of water as takes the rest of the weight
        area = (rho - case["w"] / 9.81) / 1025.0
        scene["sea"] = {"depth": 100.0, "density": 1025.0}
        scene["cable"] |= {"diameter": math.sqrt(4 * area / math.pi), "added_mass": case["ma"] / (1025.0 * area)}
        scene["cable"] |= {"anchor": [0.0, 0.0, -100.0]}
        top["position"] = [case["X"], 0.0, case["Z"] - 100.0]
    modes = modes_of(scene, 9)
    for way in ("in plane", "out of plane"):
        found = omegas(modes, way)[:4]
        np.testing.assert_allclose(found, exact[way.replace(" ", "_")][: len(found)], rtol=1e-6)
        assert len(found) >= 3


def parabolic(lambda2, sag):
    """A shallow cable with sag/span and Irvine's lambda^2 = (m g l/H)^2 l/(H L_e/EA), and l sqrt(m/H) of it."""
    span, weight = 100.0, 9.81
    H = weight * span / (8 * sag)
    EA = lambda2 * H * (1 + 8 * sag**2) / (weight * span / H) ** 2
    length = span * (1 + 8 / 3 * sag**2) / (1 + H / EA)
    top = {"kind": "fixed", "position": [span, 0.0, 0.0]}
    cable = {"length": length, "line_density": 1.0, "axial_stiffness": EA, "elements": 24, "top": top} | HIGH
    shape = catenary.between([0, 0, 0], top["position"], length, weight, EA)
    assert pytest.approx(shape.H, rel=0.02) == H
    return {"cable": cable}, span * math.sqrt(1.0 / shape.H)


@pytest.mark.parametrize("lambda2", [20, 100])
def test_irvine(lambda2):
    """The exact model tends to the parabolic theory like (sag/span)^2."""
    exact = CASES[f"irvine_{lambda2}"]["expected"]
    exact = np.sort([*exact["Omega_symmetric"][:2], *exact["Omega_antisymmetric"][:1]])
    sags, errors = [0.04, 0.02, 0.01], []
    for sag in sags:
        scene, unit = parabolic(lambda2, sag)
        found = unit * np.array(omegas(modes_of(scene, 12), "in plane", "axial")[:3])
        errors.append(np.abs(found / exact - 1).max())
    assert errors[-1] < 2e-3
    assert np.all(rates(errors, 1 / np.array(sags)) > 1.6)


def test_heave_on_a_short_stiff_line_is_found_among_much_stiffer_modes():
    """omega = sqrt(EA/(L (M + m/3))), of a random scene in which it was lost; the next are 6 and 300 times as fast."""
    mass, EA = 64391.0, 4.2e6
    buoy = {"mass": mass, "mooring_height": 28.8, "center_of_mass": 1e-6, "inertia": [193500.0, 64391.0]}
    pair = {"position_degree": 3, "tension_degree": 2, "elements": 8, "grading": 3.65}
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": EA} | pair
    push = {"force": [1.0, 0.0, 0.0], "height": 0.0}
    found = modes({"cable": cable, "buoy": buoy, "external_force": push}, 6)
    expected = np.sqrt(EA / (mass + 1 / 3))
    assert np.abs(found.omega.values - expected).min() < 1e-5 * expected


def test_backward_errors_of_pairs_by_hand():
    """|(K + lambda E + lambda^2 M) x| over the sum of the terms' sizes times |x|."""
    rng = np.random.default_rng(0)
    problem = Quadratic(MPI.COMM_SELF, *(csr_matrix(rng.normal(size=(4, 4))) for _ in range(3)), 1.0)
    root, x = 0.3 + 5j, rng.normal(size=(4, 1)) + 1j * rng.normal(size=(4, 1))
    K, E, M = (matrix.toarray() for matrix in (problem.K, problem.E, problem.M))
    sizes = np.linalg.norm(K) + abs(root) * np.linalg.norm(E) + abs(root) ** 2 * np.linalg.norm(M)
    expected = np.linalg.norm((K + root * E + root**2 * M) @ x) / (sizes * np.linalg.norm(x))
    assert problem.residuals(np.array([root]), x) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("more", [-3e-9, 0.0, 3e-9])
def test_names_and_sizes_of_symmetric_modes_do_not_hang_on_rounding(more):
    """Of two legs that move alike the first is named first, and is 1 where it moves most."""
    assert named({"north": 0.5 + more, "south": 0.5 - more}, {"north": 2}) == "north 2 + south"
    assert named({"north": 0.49, "south": 0.51}, {}) == "south + north"
    ends = SimpleNamespace(moved=lambda x: x[:, None])
    moving = SimpleNamespace(bodies=[], lines=[ends])
    x = np.array([0.1, -2 * (1 + more), 2 * (1 - more), 1.0])
    assert Moving.sized(moving, x) == pytest.approx([-0.05, 1.0, -1.0, -0.5], rel=1e-8)
    assert Moving.sized(moving, np.array([1.0, -1.01])) == pytest.approx([-1 / 1.01, 1.0])
