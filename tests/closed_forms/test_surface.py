"""Lines and joint bodies that leave the water: at rest, in motion, in small motion, and where this is checked.

Source: catenaries of one and of two weights (scipy), Archimedes for floats, a string on an elastic foundation.
"""

import itertools
import math

import numpy as np
import pytest
from alone import simulate, solve_static
from dynamics_helpers import merged
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.natural import lowest_modes
from dolfbuoy.model.effects import names
from dolfbuoy.model.problem import Problem
from dolfbuoy.model.surfacing import surfacing
from dolfbuoy.results.record import read
from dolfbuoy.results.summary import static_warnings
from dolfbuoy.statics import catenary
from dolfbuoy.studies.physics import energy

G, RHO, EA = 9.81, 1025.0, 1e7
DEGREE_2 = {"position_degree": 2, "tension_degree": 1}
LINE = {"length": 50.0, "line_density": 20.0, "diameter": 0.1, "axial_stiffness": EA, "anchor": [0.0, 0.0, -25.0]}
AREA = math.pi * LINE["diameter"] ** 2 / 4
SEA = {"depth": 70.0}
UNSEEN = "where buoyancy and all forces of the water went on: give sea.dry_above = true."


def held(*position):
    return {"kind": "fixed", "position": list(position)}


def weight(wet):
    return (LINE["line_density"] - wet * RHO * AREA) * G


@pytest.mark.parametrize(("dry", "wet"), [({}, 0.0), ({"dry_above": False}, 1.0)])
def test_a_line_above_the_water(dry, wet):
    """Ten metres at z = 20 m have their weight in air."""
    cable = LINE | DEGREE_2 | {"length": 10.0, "anchor": [0.0, 0.0, 20.0], "top": held(8.0, 0.0, 20.0)}
    found = solve_static({"sea": SEA | dry, "cable": cable})
    exact = catenary.between(cable["anchor"], cable["top"]["position"], 10.0, weight(wet), EA)
    assert float(found.tension_top) == pytest.approx(float(exact.tension(10.0)), rel=1e-6)


def test_a_line_lighter_than_water_above_it():
    """Hangs there as any other."""
    cable = LINE | DEGREE_2 | {"length": 10.0, "anchor": [0.0, 0.0, 20.0], "top": held(8.0, 0.0, 20.0)}
    cable |= {"line_density": 0.5 * RHO * AREA}
    found = solve_static({"sea": SEA, "cable": cable})
    exact = catenary.between(cable["anchor"], cable["top"]["position"], 10.0, 0.5 * RHO * AREA * G, EA)
    assert float(found.tension_top) == pytest.approx(float(exact.tension(10.0)), rel=1e-6)
    assert float(found.cable_position[..., 2].max()) == pytest.approx(20.0)


def two_part_catenary(top, L):
    """Forces (H, V) at both ends of LINE, wet below z = 0 only: shooting from the anchor."""

    def shoot(log_H, V):
        H, s, y = math.exp(log_H), 0.0, np.array([0.0, LINE["anchor"][2], V])
        while s < L * (1 - 1e-12):
            w, turn = weight(y[1] < 0), lambda s, y: y[1]
            turn.terminal, turn.direction = True, 1 if y[1] < 0 else -1

            def slope(s, y, w=w):
                T = math.hypot(H, y[2])
                return [(1 / T + 1 / EA) * H, (1 / T + 1 / EA) * y[2], w]

            part = solve_ivp(slope, (s, L), y, events=turn, rtol=1e-12, atol=1e-12)
            s, y = part.t[-1], part.y[:, -1]
            y[1] = abs(y[1])  # above, from where it came through
        return y

    mean = catenary.between(LINE["anchor"], top, L, weight(0.5), EA)
    log_H, V0 = fsolve(lambda p: shoot(*p)[:2] - [top[0], top[2]], [math.log(mean.H), mean.V0], xtol=1e-13)
    return math.hypot(math.exp(log_H), V0), math.hypot(math.exp(log_H), shoot(log_H, V0)[2])


@pytest.mark.parametrize(("degrees", "elements", "rel"), [({}, 40, 1e-3), (DEGREE_2, 40, 4e-4), (DEGREE_2, 80, 5e-5)])
def test_a_line_through_the_surface(degrees, elements, rel):
    """Tensions at both ends against two catenaries that meet at the surface."""
    top = [30.0, 0.0, 12.0]
    found = solve_static({"sea": SEA, "cable": LINE | degrees | {"elements": elements, "top": held(*top)}})
    exact = two_part_catenary(top, LINE["length"])
    forces = np.linalg.norm(found.anchor_force), float(found.tension_top)
    np.testing.assert_allclose(forces, exact, rtol=rel)


def test_a_line_under_water_is_as_it_was():
    """In current and waves, forces that could end at the surface and do not."""
    scene = {"sea": SEA, "current": {"speed": 1.0}, "waves": {"amplitude": 1.0, "period": 5.0, "ramp": 0.1}}
    scene["cable"] = LINE | {"added_mass": 1.0, "normal_drag": 1.2, "top": held(35.0, 0.0, -4.0), "elements": 8}
    scene["time"] = {"end": 0.5, "step": 0.05}
    assert "surface" not in ", ".join(names(load_scene(scene)))
    plain, asked = simulate(scene), simulate(merged(scene, sea__dry_above=True))
    np.testing.assert_allclose(asked.tension_top, plain.tension_top, rtol=1e-10)
    assert "water that ends at the surface" in asked.attrs["effects"]


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_what_floats_at_the_surface(share):
    """A line between two ends, and a ball on a line that hangs slack: each displaces its weight."""
    c = brentq(lambda c: 0.5 + 0.75 * c - 0.25 * c**3 - share, -1, 1)
    z = -c * LINE["diameter"] / 2
    hose = LINE | {"line_density": share * RHO * AREA, "anchor": [0.0, 0.0, z], "top": held(50.005, 0.0, z)}
    found = solve_static({"sea": SEA | {"dry_above": True}, "cable": hose})
    np.testing.assert_allclose(found.cable_position[:, 2], z, atol=1e-8)
    volume, line = 4 / 3 * math.pi * 0.5**3, {"length": 30.0, "line_density": RHO * 1e-6, "area": 1e-6}
    line |= {"name": "line", "from": [0.0, 0.0, -25.0], "to": "ball", "diameter": 0.01, "slack": "tension-only"}
    line |= {"axial_stiffness": 1e5}
    scene = {"sea": SEA, "cable": [line], "joint": [{"name": "ball", "volume": volume, "mass": share * RHO * volume}]}
    assert float(solve_static(scene).joint_position[0, 2]) == pytest.approx(-0.5 * c, abs=1e-4)


def test_small_motions_at_the_surface():
    """A string that floats half under water: T n^2 pi^2/L^2 and what it displaces per depth, 3/4 rho A g/R."""
    T, L, m = 5e3, 50.0, RHO * AREA / 2
    string = LINE | {"line_density": m, "anchor": [0.0, 0.0, 0.0], "top": held(L * (1 + T / EA), 0.0, 0.0)}
    scene = {"sea": SEA | {"dry_above": True}, "cable": string | {"position_degree": 4, "tension_degree": 3}}
    found = linearise(load_scene(scene | {"cable": scene["cable"] | {"elements": 8, "added_mass": 1.0}}), MPI.COMM_SELF)
    modes = lowest_modes(found, 10)
    found.destroy()
    bedding, mass = 0.75 * RHO * AREA * G / (LINE["diameter"] / 2), m + 0.5 * RHO * AREA
    for n in (1, 2):
        string = T * (n * math.pi / L) ** 2
        for omega in (math.sqrt(string / mass), math.sqrt((string + bedding) / mass)):
            assert min(abs(mode.omega / omega - 1) for mode in modes) < 1e-3


TOP = {"kind": "prescribed", "position": [30.0, 0.0, 1.0], "amplitude": [0.0, 2.0, 3.0], "period": 4.0, "ramp": 0.5}
DRAG = {"normal_drag": 1.2, "tangential_drag": 0.05, "added_mass": 1.0}
MOVING = {
    "sea": {"depth": 25.0},
    "waves": {"amplitude": 0.8, "period": 4.0, "ramp": 0.3},
    "cable": LINE | DRAG | {"elements": 8, "top": TOP},
    "time": {"end": 0.8, "step": 0.02},
}
IRREGULAR = {"spectrum": "jonswap", "significant_height": 1.0, "peak_period": 4.0, "components": 20}


@pytest.mark.parametrize(("waves", "dynamic"), [(MOVING["waves"], True), (IRREGULAR, True), (None, False)])
def test_the_jacobian_is_exact(waves, dynamic):
    """Taylor's remainder falls with the square of the step where the surface cuts elements."""
    scene, rng = load_scene({k: v for k, v in {**MOVING, "waves": waves}.items() if v}), np.random.default_rng(3)
    if waves:  # without the kinks of stretching
        scene = scene.model_copy(update={"waves": scene.waves.model_copy(update={"stretching": "none"})})
    problem = Problem(scene, dynamic=dynamic)
    system, lines = problem.system, problem.lines
    z = np.linspace(-25.0, 8.0, len(lines.node_s))[np.argsort(np.argsort(lines.node_s))]
    system.u[lines.node_dofs] = np.column_stack([0.9 * lines.node_s, 0 * z, z]) + rng.normal(0, 0.1, (len(z), 3))
    system.u[lines.T_dofs] = 3e3
    problem.set_time(1.3)
    if dynamic:
        lines.gamma_v.value, lines.gamma_a.value = 2.0, 4.0
    u, direction = system.u.copy(), np.zeros_like(system.u)
    direction[system.order] = rng.uniform(-1, 1, len(system.order))

    def residual(h):
        system.u[:] = u + h * direction
        system.publish()
        return system.evaluate().copy()

    F0 = residual(0.0)
    system.assemble_jacobian()
    rows, columns, values = system.A.getValuesCSR()
    slope = np.array([values[a:b] @ direction[system.order][columns[a:b]] for a, b in itertools.pairwise(rows)])
    sizes = [np.abs((residual(h) - F0)[system.order] - h * slope).max() for h in (1e-3, 5e-4, 2.5e-4)]
    np.testing.assert_allclose(np.log2(np.divide(sizes[:-1], sizes[1:])), 2, atol=0.1)
    problem.destroy()


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2), ("generalized-alpha", 2)])
def test_the_energy_balance(scheme, order, monkeypatch):
    """Of a line that is pulled out of the water and let back: the defect vanishes with the order of the scheme."""
    scene = merged(MOVING, waves=None, time={"end": 1.2})
    time = {"scheme": scheme} | ({"spectral_radius": 0.5} if scheme == "generalized-alpha" else {})
    monkeypatch.setattr(energy, "load", lambda *args: load_scene(scene, time=time | {"step": args[2]}))
    rows = [energy.evaluate({"scene": "", "t_end": 1.2, "step": h, "scheme": scheme}) for h in (0.02, 0.01)]
    assert abs(rows[1]["buoyancy"]) > 3 * abs(rows[1]["defect"])
    assert math.log2(rows[0]["defect"] / rows[1]["defect"]) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
def test_a_run_that_is_resumed(scheme, tmp_path):
    """Bit for bit."""
    scene = merged(MOVING, time__scheme=scheme, time__end=0.4) | {"waves": IRREGULAR}
    expected = dolfbuoy.simulate(scene)
    dolfbuoy.simulate(merged(scene, time__end=0.2), out=tmp_path)
    again = dolfbuoy.simulate(resume=tmp_path, **{"time.end": 0.4})
    np.testing.assert_array_equal(again.tension_top, expected.tension_top)


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_two_ranks(tmp_path):
    done = start_scenes(2, {"moving": MOVING}, tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    found, expected = read(tmp_path / "moving" / "results.nc"), dolfbuoy.simulate(MOVING)
    np.testing.assert_allclose(found.tension_top, expected.tension_top, rtol=1e-8)


DRAWN = {"kind": "polyline", "points": [[0, 0, -25], [30, 0, 2]]}
#: A line that hangs deep, and a first shape that rises up to 0.5 m below still water.
SUNK = LINE | {"length": 31.0, "top": held(30, 0, -9)}
BELOW = {"kind": "polyline", "points": [[0, 0, -25], [20, 0, -0.5], [30, 0, -9]]}
ROPE = LINE | {"line_density": 5.0}
BUOY = {"hull": [[0, 2], [2, 2]], "mass": 2500.0, "fairleads": {"deck": [0, 0, 2.0], "side": [1.0, 0, 0.3]}}


@pytest.mark.parametrize(
    ("leaves", "scene"),
    [
        (False, {"cable": LINE | {"top": held(30, 0, 0)}}),
        (True, {"cable": LINE | {"top": held(30, 0, 0.1)}}),
        (True, {"cable": LINE | {"top": held(30, 0, -1)}, "waves": {"height": 2.2, "period": 6.0}}),
        (False, {"cable": LINE | {"top": held(30, 0, -1)}, "waves": {"height": 1.8, "period": 6.0}}),
        (True, {"cable": LINE | {"top": TOP | {"position": [30, 0, -2.9]}}}),
        (False, {"cable": LINE | {"top": TOP | {"position": [30, 0, -3.1]}}}),
        (True, {"cable": LINE | {"top": {"kind": "free", "force": [0, 0, 1e4]}}}),
        (False, {"cable": LINE | {"length": 24.0, "top": {"kind": "free", "force": [0, 0, 1e4]}}}),
        (True, {"cable": ROPE | {"anchor": [0, 0, -5], "top": held(30, 0, -5)}}),
        (False, {"cable": ROPE | {"length": 31.0, "anchor": [0, 0, -5], "top": held(30, 0, -5)}}),
        (False, {"cable": LINE | {"to": "buoy"}, "buoy": BUOY}),
        (False, {"cable": LINE | {"to": "buoy.side"}, "buoy": BUOY}),
        (True, {"cable": LINE | {"to": "buoy.deck"}, "buoy": BUOY}),
        (True, {"cable": LINE | {"to": "J"}, "joint": [{"name": "J", "mass": 1.0, "volume": 1.0}]}),
        (False, {"cable": LINE | {"to": "J"}, "joint": [{"name": "J", "mass": 1e3, "volume": 0.1}]}),
        (True, {"cable": LINE | {"top": {"kind": "free"}}, "initial": DRAWN}),
        (False, {"cable": SUNK, "initial": BELOW, "waves": {"height": 0.8, "period": 6.0}}),
        (True, {"cable": SUNK, "initial": BELOW, "waves": {"height": 1.2, "period": 6.0}}),
    ],
)  # fmt: skip
def test_who_leaves_the_water(leaves, scene):
    """By ends, joints, floats, what is lighter than water, and the first shape; nothing else is compiled."""
    found = load_scene({"sea": {"depth": 25.0}} | scene)
    assert surfacing(found) == (["cable"] if leaves else [])
    assert ("water that ends at the surface" in names(found)) == leaves
    assert surfacing(load_scene({"cable": LINE | {"top": held(30, 0, 1)}})) == []


def test_what_is_said():
    """By `check` the length in air; where a scene wants it otherwise that it is none there, in a run too."""
    cable = LINE | {"length": 10.0, "anchor": [0, 0, -2.0], "top": held(8.0, 0, 3.0), "elements": 40}
    report = check(load_scene({"sea": SEA, "cable": cable}))
    (length,) = (value for name, value, *_ in report.numbers if name == "equilibrium: length above the water")
    assert 3.8 < length < 3.9
    asked = load_scene({"sea": SEA | {"dry_above": False}, "cable": cable})
    (sentence,) = (s for s in check(asked).warnings if "above the water" in s)
    assert sentence.endswith(UNSEEN)
    assert f"The cable rose up to 3 m above the water, {UNSEEN}" in static_warnings(dolfbuoy.solve_static(asked), asked)
