"""Lines of one scene that differ in slack law, stiffness, element pair, strain form and damping.

Source: trusses and catenaries solved with scipy; P1-P0 elements, for which both strain forms have the same solution.
"""

import copy
import itertools
import math

import numpy as np
import pytest
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes
from scipy.optimize import fsolve
from test_networks import apart, defect

from dolfbuoy import load_scene, simulate
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.record import read
from dolfbuoy.statics.equilibrium import solve_equilibrium

G = 9.81
WALL, HOOKS = [0.0, 0.0, 0.0], {"left": [0.0, -3.0, 9.0], "right": [0.0, 3.0, 9.0]}

#: A strut of one element that carries compression, and chains that take none, of other elements.
STRUT = {"length": 6.0, "line_density": 2.0, "axial_stiffness": 4e6, "elements": 1}
CHAIN = {"length": 12.0, "line_density": 15.0, "axial_stiffness": 3e6, "slack": "tension-only"}
CHAIN |= {"position_degree": 2, "tension_degree": 1, "elements": 24}
JIB = {
    "cable": [
        {"name": "strut", "from": WALL, "to": "tip"} | STRUT,
        *({"name": name, "from": hook, "to": "tip"} | CHAIN for name, hook in HOOKS.items()),
    ],
    "joint": [{"name": "tip", "mass": 500.0}],
    "initial": {
        "points": {"strut": [WALL, [5.9, 0.0, -1.0]]}
        | {name: [hook, [4.0, 0.5 * hook[1], 2.0], [5.9, 0.0, -1.0]] for name, hook in HOOKS.items()}
    },
}


def reach(H, V, length, w, EA):
    """(x, z) from start to end of an elastic catenary pulled at its end by H and V (Irvine 1981)."""
    low = V - w * length
    x = H * length / EA + H / w * (math.asinh(V / H) - math.asinh(low / H))
    return x, w * length / EA * (V / w - length / 2) + (math.hypot(H, V) - math.hypot(H, low)) / w


def test_a_strut_beside_chains_at_rest():
    """A jib: the compressed bar is a two-force member with half its weight at the tip, the chains are catenaries."""
    weight = (500.0 + STRUT["line_density"] * STRUT["length"] / 2) * G

    def balance(unknown):
        x, z, H, V = unknown
        across, stretched = math.hypot(x, 3.0), math.hypot(x, z)
        bar = -STRUT["axial_stiffness"] * (stretched / STRUT["length"] - 1) * np.array([x, z]) / stretched
        end = reach(H, V, CHAIN["length"], CHAIN["line_density"] * G, CHAIN["axial_stiffness"])
        force = (bar - [2 * H * x / across, 2 * V + weight]) * 1e-3
        return [*force, end[0] - across, end[1] - z + 9.0]

    x, z, _, _ = fsolve(balance, [5.5, -1.0, 1500.0, -2000.0], xtol=1e-13)
    problem = solve_equilibrium(load_scene(JIB), MPI.COMM_SELF)
    found = problem.system.u[problem.lines.top_dofs(0)]
    np.testing.assert_allclose(found, [x, 0.0, z], atol=2e-4)
    push = STRUT["axial_stiffness"] * (math.hypot(x, z) / STRUT["length"] - 1)
    assert push < -1000.0
    strut = problem.lines.line_of_cell == 0
    np.testing.assert_allclose(problem.lines.mean_tension(problem.system.u)[strut], push, rtol=1e-4)
    problem.destroy()


TABLE = [[0.0, 0.0], [0.2, 300.0], [0.5, 500.0], [1.5, 2500.0]]
NEUTRAL = {"line_density": 1025.0 * 0.001, "area": 0.001, "diameter": 0.036}
FLOAT = {
    "sea": {"depth": 60.0},
    "cable": [
        {"name": "leg", "from": [0, 0, -60], "to": "float", "length": 30.0, "elements": 3} | NEUTRAL,
        {"name": "cord", "from": [25, 0, -60], "to": "float", "length": 20.0, "elements": 7, "axial_stiffness": TABLE}
        | {"position_degree": 2, "tension_degree": 1, "slack": "tension-only"}
        | NEUTRAL,
    ],
    "joint": [{"name": "float", "mass": 100.0, "volume": 0.25}],
}


def test_an_inextensible_leg_beside_a_rubber_cord_at_rest():
    """Straight lines, weightless in water: the leg keeps its length, the cord pulls according to its table."""
    lift = (1025.0 * 0.25 - 100.0) * G
    strains, pulls = np.array(TABLE).T

    def balance(unknown):
        angle, T = unknown
        float_ = 30.0 * np.array([math.sin(angle), math.cos(angle)])
        chord = np.array([25.0, 0.0]) - float_
        reach = np.linalg.norm(chord)
        pull = np.interp(reach / 20.0 - 1, strains, pulls)
        return -T * float_ / 30.0 + pull * chord / reach + [0.0, lift]

    angle, T = fsolve(balance, [0.2, 1000.0], xtol=1e-13)
    problem = solve_equilibrium(load_scene(FLOAT), MPI.COMM_SELF)
    found = problem.system.u[problem.lines.top_dofs(0)]
    np.testing.assert_allclose(found, [30 * math.sin(angle), 0.0, 30 * math.cos(angle) - 60.0], atol=1e-6)
    leg = problem.lines.line_of_cell == 0
    np.testing.assert_allclose(problem.lines.mean_tension(problem.system.u)[leg], T, rtol=1e-7)
    assert len(problem.lines.groups) == 2
    problem.destroy()


def swung(scene, **more):
    """The scene with its first end oscillating."""
    found = copy.deepcopy(scene) | {"time": {"end": 1.0, "step": 0.01, "scheme": "bdf2"}} | more
    start = found["cable"][1]["from"]
    found["joint"] = [*found["joint"], {"name": "swing", "position": start, "amplitude": [0.3, 0.2, 0.1]}]
    found["joint"][-1] |= {"period": 1.5, "ramp": 1.0}
    found["cable"][1]["from"] = "swing"
    return found


def test_energy_of_mixed_lines_is_kept():
    """P1-P0 elements, without spurious work of tension; a damped chain beside a strut, a leg beside a damped cord."""
    plain = {"position_degree": 1, "tension_degree": 0}
    jib, held = copy.deepcopy(JIB), copy.deepcopy(FLOAT)
    jib["cable"][1] |= plain | {"damping": 3e4, "strain_form": "energy"}
    held["cable"][1] |= plain | {"damping": 2e3, "strain_form": "energy"}
    for scene in (swung(jib), swung(held)):
        assert len({line.get("strain_form") for line in scene["cable"]}) == 2
        defects = [defect(scene, step) for step in (0.01, 0.005)]
        assert defects[1][0] < 5e-3 * defects[1][1]
        assert np.log2(defects[0][0] / defects[1][0]) > 1.3


ROPE = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 5e6, "normal_drag": 1.2, "added_mass": 1.0}
#: Bed, friction, growth, a clump, a float, a buoy, waves, and a line that parts.
EVERYTHING = {
    "sea": {"depth": 30.0},
    "seabed": {"friction": 0.5, "start": "pulled"},
    "waves": {"amplitude": 0.8, "period": 4.0},
    "current": {"speed": 0.4},
    "cable": [
        {"name": "west", "from": [-55, 0, -30], "to": "buoy.west", "slack": "tension-only", "damping": 1e4}
        | {"segments": [{"length": 30.0, "elements": 8, "body": {"mass": 80.0}}, {"length": 40.0, "elements": 8}]}
        | ROPE,
        {
            "name": "east",
            "from": [50, 0, -30],
            "to": "buoy.east",
            "length": 62.0,
            "elements": 12,
            "fails_at": {"time": 0.5},
        }
        | {"marine_growth": [[-30, 1.0, 1.0], [0, 1.5, 1.3]]}
        | ROPE,
        {"name": "tail", "from": "hook", "to": "buoy.north", "length": 14.0, "elements": 6} | ROPE,
    ],
    "joint": [{"name": "hook", "mass": 30.0, "volume": 0.01}],
    "buoy": {
        "hull": [[0.0, 2.0], [2.0, 2.0]],
        "mass": 2500.0,
        "center_of_mass": 0.7,
        "fairleads": {"west": [-1.0, 0, 0.2], "east": [1.0, 0, 0.2], "north": [0, 1.0, 0.2]},
    },
    "time": {"end": 1.0, "step": 0.05, "scheme": "bdf2"},
    "solver": {"step_tolerance": 1e-12},
}
QUANTITIES = ("cable_position", "cable_tension", "end_tension", "anchor_force", "buoy_position", "length_on_bed")


def in_groups(scene):
    """The same equations in groups: for P1-P0 both strain forms say |r'| = 1 + e."""
    found = copy.deepcopy(scene)
    found["cable"][1]["strain_form"] = "energy"
    return found


@pytest.mark.parametrize("scheme", [pytest.param("backward-euler", marks=pytest.mark.slow), "bdf2"])
def test_groups_of_lines_are_the_lines(scheme):
    """All options of a scene, with lines on one mesh and on two; in waves, on the bed, with growth, parted."""
    scene = EVERYTHING | {"time": EVERYTHING["time"] | {"scheme": scheme}}
    one, two = (simulate(made) for made in (scene, in_groups(scene)))
    for quantity in QUANTITIES:
        assert apart(one, two, quantity) < 1e-7, quantity
    assert one.attrs["parted"] == two.attrs["parted"] != ""
    for name in ("growth_diameter", "cable_of_node", "segment_of_cell", "s"):
        np.testing.assert_allclose(one[name], two[name], rtol=1e-7)


def test_a_run_of_groups_goes_on_to_the_last_bit(tmp_path):
    """Stopped half way: friction, growth and parted lines are kept in each group."""
    scene = load_scene(in_groups(EVERYTHING))
    whole, half = Simulation(scene, MPI.COMM_SELF), Simulation(scene, MPI.COMM_SELF)
    assert len(list(itertools.islice(half.run(), 12))) == 12
    again = Simulation(scene, MPI.COMM_SELF, state=copy.deepcopy(half.state()))
    for simulation in (whole, again):
        for _ in simulation.run():
            pass
    np.testing.assert_array_equal(whole.system.u, again.system.u)


@pytest.mark.mpi
@needs_mpirun
def test_ranks(tmp_path):
    """Groups on two ranks agree with one rank, to 1e-8 of the size of each quantity."""
    scene = in_groups(EVERYTHING) | {"time": EVERYTHING["time"] | {"end": 0.5}}
    done = start_scenes(2, {"groups": scene}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    alone, together = simulate(scene), read(tmp_path / "groups" / "results.nc")
    for quantity in QUANTITIES:
        assert apart(alone, together, quantity) < 1e-8, quantity


def test_a_line_that_bends_beside_one_that_does_not():
    """With the same degrees; each is at rest as it is alone."""
    common = {"length": 12.0, "line_density": 5.0, "axial_stiffness": 1e6, "position_degree": 2, "tension_degree": 1}
    lines = {
        "stiff": common | {"from": [0.0, 0.0, 0.0], "to": [9.0, 0.0, 1.0], "bending_stiffness": 2e3, "elements": 6},
        "soft": common | {"from": [0.0, 5.0, 0.0], "to": [8.0, 5.0, 0.0], "elements": 6},
    }

    def ends(*names):
        problem = solve_equilibrium(load_scene({"cable": [{"name": n} | lines[n] for n in names]}), MPI.COMM_SELF)
        found = problem.end_forces()["end_tension"]
        problem.destroy()
        return found

    both = ends("stiff", "soft")
    np.testing.assert_allclose(both, np.concatenate([ends("stiff"), ends("soft")]), rtol=1e-8, atol=1e-6)
    assert abs(both[0] - both[1]).max() > 1.0
