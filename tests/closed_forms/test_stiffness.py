"""Restoring matrices against differences of equilibria, a closed-form catenary, and hydrostatics.

Source: equilibria of `static` under small loads and motions, Irvine's catenary, rho g A and GM of a cylinder, MoorPy's
coupled stiffness of a body.
"""

import math

import alone
import numpy as np
import pytest
from alone import solve_static
from dynamics_helpers import MOORED, merged
from mpi4py import MPI
from scipy.spatial.transform import Rotation

import dolfbuoy
from dolfbuoy import InputError, SolveError, load_scene
from dolfbuoy.results.linear_record import notes
from dolfbuoy.statics import catenary

#: Loads: force [N] and height above the keel at which they act [m].
LOADS = [((2.0, 0.0, 0.0), None), ((0.0, 2.0, 0.0), None), ((0.0, 0.0, 5.0), None)]
LOADS += [((0.5, 0.0, 0.0), 4.0), ((0.0, 0.5, 0.0), 4.0)]


def at_rest(scene, force, height):
    """r_C and orientation under a force; "external_force" of the scene must be absent."""
    loaded = merged(scene, external_force={"force": list(force)} | ({} if height is None else {"height": height}))
    record = solve_static(load_scene(loaded), comm=MPI.COMM_SELF)
    w, *v = record.buoy_orientation.values
    return record.buoy_position.values, Rotation.from_quat([*v, w]), record


@pytest.mark.parametrize("current", [None, {"speed": 0.8, "direction_deg": 25.0}], ids=["still", "current"])
def test_against_differences_of_equilibria(current):
    """K dx = dF, with the torque of a force that acts above C; yaw, which nothing holds, does not count."""
    scene = {key: value for key, value in MOORED.items() if key not in ("waves", "time", "external_force", "current")}
    base = {"force": [900.0, 300.0, 0.0]}
    scene |= {"current": current} if current else {"wind": None}
    scene = {key: value for key, value in scene.items() if value is not None}
    K = alone.stiffness(merged(scene, external_force=base), comm=MPI.COMM_SELF).total.values
    for step, height in LOADS:
        sides = []
        for sign in (1, -1):
            force = np.array(base["force"]) + sign * np.array(step)
            sides.append(_pose(scene, force, height, base["force"], sign * np.array(step)))
        (a, R_a, F_a), (b, R_b, F_b) = sides
        dF = (F_a - F_b) / 2
        dx = np.concatenate([a - b, (R_a * R_b.inv()).as_rotvec()]) / 2
        size = np.abs(K) @ np.abs(dx)
        assert np.all(np.abs(K @ dx - dF)[:5] < 2e-4 * size[:5]), (step, height, K @ dx, dF)


def _pose(scene, force, height, base, step):
    """Equilibrium under the base force at C and a step at a height; forces at two places, as one and a torque."""
    if height is None:
        r, R, _ = at_rest(scene, force, None)
        return r, R, np.concatenate([step, np.zeros(3)])
    total, share = np.array(force), None
    body = load_scene(merged(scene, external_force={"force": list(base)}))
    mass = dolfbuoy.model.rigid.mass_properties(body.buoy[0])
    share = np.linalg.norm(step) / np.linalg.norm(total)  # one force at a height of its own makes the same torque
    r, R, _ = at_rest(scene, total, mass.height + share * (height - mass.height) * np.sign(step @ total))
    lever = R.as_matrix()[:, 2] * (share * (height - mass.height) * np.sign(step @ total))
    return r, R, np.concatenate([step, np.cross(lever, total)])


def test_catenary():
    """The mooring's block of forces and displacements, mooring at C: differences of the closed form."""
    length, w, EA, depth = 60.0, 80.0, 5e5, 40.0
    scene = {
        "sea": {"depth": depth},
        "cable": {"length": length, "line_density": w / 9.81 + 1025 * math.pi * 0.04**2 / 4, "diameter": 0.04}
        | {"axial_stiffness": EA, "elements": 24, "position_degree": 4, "tension_degree": 3},
        "buoy": {"hull": [[0.0, 2.0], [2.0, 2.0]], "mass": 2500.0, "center_of_mass": 0.6, "mooring_height": 0.6},
        "external_force": {"force": [3000.0, 1000.0, 0.0]},
    }
    found = alone.stiffness(scene, comm=MPI.COMM_SELF)
    record = solve_static(scene, comm=MPI.COMM_SELF)
    r, exact, h = record.mooring_point.values, np.zeros((3, 3)), 1e-4
    for i, e in enumerate(np.eye(3)):
        pulls = []
        for sign in (1, -1):
            shape = catenary.between([0, 0, -depth], r + sign * h * e, length, w, EA)
            pulls.append(shape.H * shape.along + [0, 0, float(shape.vertical(length))])
        exact[:, i] = (pulls[0] - pulls[1]) / (2 * h)  # T_bnd pulls the end, and its reaction the buoy back
    np.testing.assert_allclose(found.mooring.values[:3, :3], exact, atol=1e-5 * np.abs(exact).max())
    np.testing.assert_allclose(found.mooring.values[:3, 3:], 0, atol=1e-6 * np.abs(exact).max())


def test_floating_cylinder():
    """rho g A in heave, weight times GM in roll and pitch, nothing else."""
    D, mass, z_C = 2.4, 3000.0, 0.5
    scene = {"sea": {"depth": 50.0}, "buoy": {"hull": [[0, D], [3, D]], "mass": mass, "center_of_mass": z_C}}
    found = alone.stiffness(scene, comm=MPI.COMM_SELF)
    area = math.pi * D**2 / 4
    draft = mass / (1025 * area)
    GM = draft / 2 + D**4 * math.pi / 64 / (area * draft) - z_C
    exact = np.diag([0, 0, 1025 * 9.81 * area, mass * 9.81 * GM, mass * 9.81 * GM, 0])
    np.testing.assert_allclose(found.hull.values, exact, atol=1e-6 * exact.max())
    assert np.abs(found.mooring.values).max() == 0
    np.testing.assert_allclose(np.sort(found.hull_eigenvalue.values)[-1], exact[2, 2], rtol=1e-6)


def on_taut_line(EA, **more):
    """A buoy on a line that has no sag in still water."""
    scene = merged(MOORED, cable__axial_stiffness=EA, cable__length=18.9, cable__elements=4)
    scene["cable"]["line_density"] = 5.3
    kept = {key: value for key, value in scene.items() if key not in ("current", "external_force", "waves", "time")}
    return kept | more


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (900.0, 300.0, 0.0)], ids=["upright", "oblique"])
def test_taut_and_inextensible(force):
    """Rigid along the line, and nowhere else; across it as on a line that is very stiff."""
    more = {"external_force": {"force": list(force)}}
    found = alone.stiffness(on_taut_line(math.inf, **more), comm=MPI.COMM_SELF)
    stiff = alone.stiffness(on_taut_line(1e12, **more), comm=MPI.COMM_SELF)
    for name in ("mooring_eigenvalue", "total_eigenvalue"):
        assert np.isinf(found[name].values[-1])
        np.testing.assert_allclose(found[name].values[1:-1], stiff[name].values[1:-1], rtol=1e-5)
    assert stiff.mooring_eigenvalue.values[-1] > 1e10
    assert np.isfinite(found.hull.values).all()
    direction = found.rigid.values[-1]
    forces = (stiff.mooring.values @ direction)[:3]
    np.testing.assert_allclose(
        forces / np.linalg.norm(forces), direction[:3] / np.linalg.norm(direction[:3]), atol=1e-6
    )
    assert np.isinf(found.mooring.values[2, 2])
    assert np.isinf(found.mooring.values).sum() == (1 if force[0] == 0 else 25)
    plain = [one.mooring_across if one is found else one.mooring for one in (found, stiff)]
    across = np.array([0.0, 1.0, -direction[1] / direction[2], 0, 0, 0])
    values = [across @ matrix.values @ across for matrix in plain]
    assert values[0] == pytest.approx(values[1], rel=1e-5)


def test_what_is_said():
    """An inextensible taut line holds rigidly; what flows has no potential; a cable alone has no matrix."""
    rigid = on_taut_line(math.inf)
    said = " ".join(notes(alone.stiffness(rigid, comm=MPI.COMM_SELF), load_scene(rigid)))
    assert "holds rigidly" in said
    flowing = {key: value for key, value in MOORED.items() if key not in ("waves", "time")}
    assert "not symmetric" in " ".join(notes(alone.stiffness(flowing, comm=MPI.COMM_SELF), load_scene(flowing)))
    with pytest.raises(InputError, match=r"needs \[buoy\]"):
        alone.stiffness("driven")


def test_a_start_of_its_own_is_no_equilibrium():
    """A buoy whose own table says where its run begins has the matrices of its equilibrium."""
    scene = {
        key: value for key, value in MOORED.items() if key not in ("current", "external_force", "waves", "time", "wind")
    }
    begins = merged(scene, buoy__initial={"buoy_position": [3.0, 1.0, 0.4], "buoy_velocity": [1.0, 0.0, 0.0]})
    found, known = (alone.stiffness(one, comm=MPI.COMM_SELF).total.values for one in (begins, scene))
    np.testing.assert_allclose(found, known, atol=1e-7 * np.abs(known).max())


# -- vessels --------------------------------------------------------------------------------------------------------

POINTS = {"bow": [5.0, 1.0, -1.0], "port": [-4.0, 3.0, -0.5], "stern": [-5.0, 0.0, 0.5]}
FEET = {"bow": [24.0, 6.0, -30.0], "port": [-16.0, 20.0, -30.0], "stern": [-20.0, -12.0, -30.0]}
ROPE = {"length": 38.0, "line_density": 4.0, "diameter": 0.05, "axial_stiffness": 1e5, "elements": 8}
PLACE = np.array([1.0, -1.0, 0.0])
BUOY = {"hull": [[0.0, 1.5], [1.2, 1.5]], "mass": 800.0, "center_of_mass": 0.5}


def on_vessel(x=(0.0,) * 6, hawser=False, elements=8):
    """Three ropes on a vessel that is moved by x (turns in rad); hawser: the last one by way of a buoy."""
    rows = [[t, *x[:3], *np.degrees(x[3:])] for t in (0.0, 1.0)]
    ship = {"name": "ship", "position": PLACE.tolist(), "fairleads": POINTS, "motion": rows}
    lines = [
        {**ROPE, "elements": elements, "name": name, "from": foot, "to": f"ship.{name}"} for name, foot in FEET.items()
    ]
    scene = {"sea": {"depth": 30.0, "dry_above": False}, "vessel": [ship], "cable": lines}
    if hawser:
        lines[2] |= {"to": "buoy", "length": 32.0}
        lines.append({**ROPE, "name": "hawser", "from": "ship.stern", "to": "buoy", "length": 7.0})
        scene["buoy"] = BUOY
    return scene


def pulled(x, **more):
    """Force and moment (6,) of the ropes on the moved vessel, by the forces at their ends."""
    record = dolfbuoy.solve_static(on_vessel(x, **more), comm=MPI.COMM_SELF)
    turn, total = Rotation.from_rotvec(x[3:]), np.zeros(6)
    for name in POINTS:
        line = record.sel(cable="hawser" if more and name == "stern" else name)
        force = -(line.anchor_force if more and name == "stern" else line.end_tension).values
        total += np.concatenate([force, np.cross(turn.apply(POINTS[name]), force)])
    return total


@pytest.mark.parametrize("hawser", [False, True], ids=["alone", "with a buoy that follows"])
def test_vessel_against_differences_of_equilibria(hawser):
    """Forces and moments over displacements along, and turns about, an axis; the buoy may turn freely in yaw."""
    found = dolfbuoy.stiffness(on_vessel(hawser=hawser), comm=MPI.COMM_SELF)
    K, more = found.vessel_mooring.sel(vessel="ship").values, {"hawser": True} if hawser else {}
    np.testing.assert_allclose(found.vessel_pull.values[0], pulled(np.zeros(6), **more), atol=1e-6 * np.abs(K).max())
    for axis in (0, 2, 4):
        step = 1e-3 * np.eye(6)[axis]
        exact = (pulled(-step, **more) - pulled(step, **more)) / 2e-3
        np.testing.assert_allclose(K[:, axis], exact, atol=2e-5 * np.abs(K).max())
    assert np.abs(K[:3, :3] - K[:3, :3].T).max() < 1e-6 * np.abs(K).max()


def beside_a_rigid_leg(x=0.0):
    """A rope from a vessel, moved by x, to a buoy on a straight leg that neither weighs in water nor stretches."""
    neutral = 1025 * math.pi * ROPE["diameter"] ** 2 / 4
    leg = ROPE | {"name": "leg", "from": [0.0, 0.0, -30.0], "to": "buoy", "length": 28.0, "axial_stiffness": math.inf}
    rope = ROPE | {"name": "rope", "from": "buoy", "to": "ship.bow", "length": 11.0}
    ship = {"name": "ship", "position": [5.0 + x, 0.0, -1.0], "fairleads": {"bow": [5.0, 0.0, 0.0]}}
    return {
        **{"sea": {"depth": 30.0, "dry_above": False}, "buoy": BUOY, "vessel": [ship]},
        "cable": [leg | {"line_density": neutral}, rope],
    }


def test_a_buoy_on_a_rigid_leg_follows_a_vessel():
    """Between its buoy, held, and the anchor the leg has no slack of any kind; the buoy swings on it."""
    found = dolfbuoy.stiffness(beside_a_rigid_leg(), comm=MPI.COMM_SELF).vessel_mooring.values[0]
    pulls = [
        -dolfbuoy.solve_static(beside_a_rigid_leg(x), comm=MPI.COMM_SELF).sel(cable="rope").end_tension.values
        for x in (-1e-3, 1e-3)
    ]
    np.testing.assert_allclose(found[:3, 0], (pulls[0] - pulls[1]) / 2e-3, rtol=1e-5, atol=1e-5 * found[0, 0])
    held = dolfbuoy.stiffness(beside_a_rigid_leg() | {"buoy": BUOY | {"mass": 100.0}}, comm=MPI.COMM_SELF)
    assert held.vessel_mooring.values[0, 0, 0] > 1.02 * found[0, 0]  # a stiffer leg follows less


@pytest.mark.parametrize("length", [31.0, 40.0])
def test_a_fold_has_no_stiffness(length):
    """From one end to another above it a cable hangs in a fold that may turn: no number stands for that."""
    scene = on_vessel()
    scene["vessel"][0]["fairleads"] = POINTS | {"bow": [23.0, 7.0, 0.0]}  # above its anchor
    scene["cable"][0] |= {"length": length, "axial_stiffness": math.inf}
    with pytest.raises(SolveError, match="a fold that may turn about the vertical"):
        dolfbuoy.stiffness(scene, comm=MPI.COMM_SELF)


def test_spring_of_a_take_off_on_a_vessel():
    """What a spring from the bow to a moored buoy, which follows, adds: differences of its force in equilibria."""
    scene = on_vessel()
    spring = {"from": [15.0, 0.0, -1.0], "to": "buoy", "stiffness": 400.0, "length": 2.0}
    scene |= {
        "take_off": spring | {"from": "ship.bow"},
        "buoy": BUOY | {"initial": {"buoy_position": [12.0, 0.0, 0.0]}},
    }
    scene["cable"].append({**ROPE, "name": "stay", "from": [30.0, 0.0, -30.0], "to": "buoy", "length": 40.0})
    with_spring = dolfbuoy.stiffness(scene, comm=MPI.COMM_SELF)
    alone_there = dolfbuoy.stiffness(on_vessel(), comm=MPI.COMM_SELF)
    added = (with_spring.vessel_mooring - alone_there.vessel_mooring).values[0]
    steps, pulls = (1e-3, -1e-3), []
    for step in steps:
        moved = scene | {"vessel": on_vessel(step * np.eye(6)[0])["vessel"]}
        rest = dolfbuoy.solve_static(moved, comm=MPI.COMM_SELF)
        bow = PLACE + POINTS["bow"] + [step, 0.0, 0.0]
        buoy = rest.buoy_position.values[0]
        turn = Rotation.from_quat(np.roll(rest.buoy_orientation.values[0], -1))
        arm = turn.apply([0.0, 0.0, -BUOY["center_of_mass"]])
        line = buoy + arm - bow
        assert np.linalg.norm(line) == pytest.approx(rest.take_off_length.item(), rel=1e-9)
        pulls.append(rest.take_off_tension.item() * line / np.linalg.norm(line))
    exact = -(pulls[0] - pulls[1]) / (steps[0] - steps[1])
    np.testing.assert_allclose(added[:3, 0], exact, atol=1e-4 * np.abs(exact).max())


@pytest.mark.filterwarnings("ignore")  # MoorPy's own, of numpy and matplotlib
def test_vessel_against_moorpy():
    moorpy = pytest.importorskip("moorpy")
    system = moorpy.System(depth=300.0, rho=1025.0, g=9.81)
    system.addBody(-1, [*PLACE, 0.0, 0.0, 0.0])
    w = (ROPE["line_density"] - 1025 * math.pi * ROPE["diameter"] ** 2 / 4) * 9.81
    kind = {"name": "rope", "d_vol": 0.0, "m": w / 9.81, "w": w, "EA": ROPE["axial_stiffness"], "EAd": 0.0}
    for number, (name, foot) in enumerate(FEET.items()):
        system.addPoint(1, foot)
        system.addPoint(1, PLACE + POINTS[name])
        system.bodyList[0].attachPoint(2 * number + 2, POINTS[name])
        system.addLine(ROPE["length"], kind, pointA=2 * number + 1, pointB=2 * number + 2, cb=0.0)
    system.initialize()
    system.solveEquilibrium(tol=1e-8)
    exact = system.getCoupledStiffnessA(lines_only=True)
    K = dolfbuoy.stiffness(on_vessel(elements=40), comm=MPI.COMM_SELF).vessel_mooring.values[0]
    np.testing.assert_allclose(K, exact, atol=1e-3 * np.abs(exact).max())


def test_vessel_that_holds_a_direction_is_refused():
    scene = on_vessel()
    scene["cable"][0] |= {"bending_stiffness": 10.0, "to_end": {"direction": [0.0, 0.0, 1.0]}}
    with pytest.raises(InputError, match="holds a line in a direction"):
        dolfbuoy.stiffness(scene, comm=MPI.COMM_SELF)
