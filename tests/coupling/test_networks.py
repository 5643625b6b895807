"""Connected lines: joints, bodies, bridles, several buoys.

Source: the same line in one piece; each part alone; the network mirrored and rotated; the energy balance; one rank.
"""

import copy
import itertools

import numpy as np
import pytest
from alone import simulate, solve_static
from dynamics_helpers import MOORED
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.motion.energy import STORED, Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.measured import compute, quantities_of
from dolfbuoy.results.record import read
from dolfbuoy.results.summary import static_rows, static_warnings, summary, warnings
from dolfbuoy.scene.settings import period_of, ramp_of

ROPE = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "added_mass": 0.9}
ROPE |= {"normal_drag": 1.1, "tangential_drag": 0.1}
TOP = {"kind": "prescribed", "position": [30.0, 3.0, -4.0], "amplitude": [0.3, 0.2, 0.5], "period": 2.0, "ramp": 1.0}
WATER = {"sea": {"depth": 30.0}, "current": {"speed": 0.6, "direction_deg": 40.0}, "solver": {"step_tolerance": 1e-12}}
TIME = {"time": {"end": 5.0, "step": 0.05, "scheme": "bdf2"}}
WHOLE = {**WATER, **TIME, "cable": {**ROPE, "length": 48.0, "elements": 12, "top": TOP}}
CUT = {**WATER, **TIME, "cable": {**ROPE, "top": TOP, "segments": [
    {"length": 16.0, "elements": 4}, {"length": 8.0, "elements": 2}, {"length": 24.0, "elements": 6},
]}}  # fmt: skip

BRIDLE = {
    **WATER,
    "waves": {"amplitude": 0.5, "period": 4.0, "direction_deg": 20.0, "ramp": 1.0},
    "time": {"end": 1.5, "step": 0.05, "scheme": "bdf2"},
    "material": {"rope": ROPE},
    "joint": [
        {"name": "Y", "mass": 200.0, "volume": 0.1, "drag_area": 0.5, "added_mass": 0.5},
        {"name": "rail", "position": [30.0, 3.0, -4.0], "amplitude": [0.3, 0.2, 0.5], "period": 2.0, "ramp": 1.0},
    ],
    "cable": [
        {"name": "main", "material": "rope", "from": [0.0, 0.0, -30.0], "to": "Y", "segments": [
            {"length": 12.0, "elements": 4, "body": {"mass": 20.0}},
            {"length": 14.0, "elements": 6, "axial_stiffness": float("inf"), "line_density": 9.0},
        ]},
        {"name": "port", "material": "rope", "from": "Y", "to": "rail", "length": 18.0, "elements": 5},
        {"name": "starboard", "material": "rope", "from": [30.0, -5.0, -4.0], "to": "Y", "length": 19.0, "elements": 5},
    ],
}  # fmt: skip

HULL = {**MOORED["buoy"], "hull": [[0.0, 1.0], [0.8, 1.0], [0.8, 3.0], [2.0, 3.0]], "mass": 4000.0}
HULL |= {"center_of_mass": 0.9, "inertia": [4000.0, 5000.0], "point_masses": [], "rotational_damping": 0.0}
DIRECTIONS = {"east": 0.0, "north": 2.1, "south": -2.0}


def spread(x, name, legs=DIRECTIONS):
    """(cables, buoy) of a hull at x on legs from fairleads off its axis."""
    around = {leg: [1.5 * np.cos(a), 1.5 * np.sin(a), 0.8] for leg, a in legs.items()}
    cables = [
        {**ROPE, "name": f"{name}-{leg}", "from": [x + 40 * np.cos(a), 40 * np.sin(a), -30.0], "to": f"{name}.{leg}",
         "length": 52.0, "elements": 6}
        for leg, a in legs.items()
    ]  # fmt: skip
    return cables, {**HULL, "name": name, "fairleads": around}


def moored(*parts, **changes):
    cables = [cable for cables, _ in parts for cable in cables]
    scene = {**BRIDLE, "cable": cables, "buoy": [buoy for _, buoy in parts], **changes}
    return {name: section for name, section in scene.items() if name not in ("joint", "material")}


def apart(a, b, name):
    """Largest difference of a quantity between two records, relative to its range."""
    a, b = a[name].values, b[name].values
    return np.abs(a - b).max() / np.ptp(a)


def test_a_line_cut_into_three_is_the_line():
    """Positions and tensions over five seconds, to 1e-10 of the length and of the tension range."""
    whole, cut = simulate(WHOLE), simulate(CUT)
    np.testing.assert_allclose(whole.s, cut.s, rtol=1e-15)
    assert cut.segment_of_cell.values.tolist() == 4 * [0] + 2 * [1] + 6 * [2]
    np.testing.assert_allclose(cut.cable_position, whole.cable_position, rtol=0, atol=48e-10)
    for name in ("cable_tension", "end_tension", "anchor_force", "tension_top"):
        assert apart(whole, cut, name) < 1e-10, name
    assert np.ptp(whole.cable_position.values, axis=0).max() > 0.5
    assert cut.joint.values.tolist() == ["cable.1", "cable.2"]


def test_cutting_brings_no_unknowns():
    assert solve_static(WHOLE).attrs["unknowns"] == solve_static(CUT).attrs["unknowns"]


def test_forces_of_lines_on_a_joint_add_up():
    """Line forces on the body of a moving joint balance its inertia, weight and hydrodynamic force."""
    simulation = Simulation(load_scene(BRIDLE), MPI.COMM_SELF)
    problem = simulation.problem
    ends = [(0, 1), (1, 0)]  # both pieces of the main line, between them 20 kg
    for _ in simulation.run():
        total = sum(problem.end_force(*end, fresh=False) for end in ends)
        k = problem.bodies.names.index("main.1")
        v = problem.bodies
        dofs = v.dofs[k]
        r_tt = v.gamma_a.value * problem.system.u[v.part.offset + dofs] + v.history_a.x.array[dofs]
        np.testing.assert_allclose(total, -20.0 * (r_tt + [0.0, 0.0, 9.81]), atol=1e-4)
    assert np.linalg.norm(problem.end_force(0, 1)) > 500.0
    problem.destroy()


def test_momentum_of_a_whole_network():
    """At every step end forces, weights and inertia balance, line by line and body by body."""
    scene = {name: section for name, section in BRIDLE.items() if name not in ("sea", "current", "waves")}
    scene["joint"] = [{"name": "Y", "mass": 200.0}, BRIDLE["joint"][1]]
    simulation = Simulation(load_scene(scene), MPI.COMM_SELF)
    problem, lines, bodies = simulation.problem, simulation.problem.lines, simulation.problem.bodies
    held, largest = [(k, i) for k, i, _ in lines.held_ends()], 0.0
    assert held == [(0, 0), (2, 1), (3, 0)]
    for _ in simulation.run():
        u = problem.system.u
        a = (lines.gamma_a.value * u[lines.part.slice] + lines.history_a.x.array)[lines.node_dofs]
        needed = sum(lines.sections[k].line_density * integral(lines, k, a + [0.0, 0.0, 9.81]) for k in range(4))
        a = (bodies.gamma_a.value * u[bodies.part.slice] + bodies.history_a.x.array)[bodies.dofs]
        needed += np.array([body.mass for body in bodies.bodies]) @ (a + [0.0, 0.0, 9.81])
        total = sum(problem.end_force(*end, fresh=False) for end in held)
        np.testing.assert_allclose(total, needed, atol=1e-8 * np.abs(needed).max())
        largest = max(largest, np.abs(needed[:2]).max())
    assert largest > 100.0  # it swings
    problem.destroy()


def integral(lines, piece, values):
    """Integral over a piece of a line of P1 elements, from nodal values."""
    mine = np.flatnonzero(lines.line_of_node == piece)
    mine = mine[np.argsort(lines.node_s[mine])]
    sizes, v = np.diff(lines.node_s[mine]), values[mine]
    return sizes @ (v[1:] + v[:-1]) / 2


def turned(scene, matrix, heading):
    """The scene with all its vectors rotated, and its directions by `heading`."""
    scene = copy.deepcopy(scene)

    def turn(vector):
        return (matrix @ np.array(vector)).tolist()

    for joint in scene.get("joint", []):
        for name in ("position", "amplitude"):
            if name in joint:
                joint[name] = turn(joint[name])
    for cable in scene["cable"]:
        for name in ("from", "to"):
            if isinstance(cable[name], list):
                cable[name] = turn(cable[name])
    for buoy in scene.get("buoy", []):
        buoy["fairleads"] = {name: turn(point) for name, point in buoy["fairleads"].items()}
    for name in ("waves", "current"):
        scene[name]["direction_deg"] = heading(scene[name]["direction_deg"])
    return scene


TURN, MIRROR = 1.1, np.diag([1.0, -1.0, 1.0])
TURNED = np.array([[np.cos(TURN), -np.sin(TURN), 0], [np.sin(TURN), np.cos(TURN), 0], [0, 0, 1.0]])


#: Twelve legs that are not all alike.
TWELVE = {f"l{k}": k * np.pi / 6 + 0.05 * k * k % 0.3 for k in range(12)}


@pytest.mark.parametrize(
    "scene", [BRIDLE, moored(spread(0.0, "one")), moored(spread(0.0, "one", TWELVE))], ids=["bridle", "three", "twelve"]
)
@pytest.mark.parametrize(
    ("matrix", "heading"),
    [(TURNED, lambda a: a + np.degrees(TURN)), (MIRROR, lambda a: -a)],
    ids=["turned", "mirrored"],
)
def test_a_turned_and_a_mirrored_network(scene, matrix, heading):
    """Positions to 1e-10 of a line's length, tensions to 1e-10 of their range."""
    straight, other = simulate(scene), simulate(turned(scene, matrix, heading))
    length = min(cable.get("length", 26.0) for cable in scene["cable"])
    np.testing.assert_allclose(other.cable_position, straight.cable_position.values @ matrix.T, atol=1e-10 * length)
    for name in ("tension_top", "tension_anchor"):
        assert apart(straight, other, name) < 1e-10, name


def test_a_float_above_the_water_is_told():
    """A warning, in a run and at rest, if buoyancy does not end at the surface."""
    line = ROPE | {"name": "line", "from": [0.0, 0.0, -20.0], "to": "float", "length": 24.0, "elements": 6}
    sea = {"depth": 20.0, "dry_above": False}
    scene = {"sea": sea, "cable": [line], "joint": [{"name": "float", "volume": 1.0, "mass": 100.0}]}
    found, run = dolfbuoy.solve_static(scene), dolfbuoy.simulate(scene | {"time": {"end": 0.1, "step": 0.1}})
    z = float(found.joint_position[0, 2])
    said = f"float: It rose up to {z:.3g} m above the water, where buoyancy"
    for sentences in (static_warnings(found, load_scene(scene)), warnings(run, load_scene(scene))):
        assert sum(sentence.startswith(said) for sentence in sentences) == 1
    rows = {name: value for name, value, _ in summary(run, load_scene(scene, time={"end": 0.1, "step": 0.1}))}
    assert rows["float: z of the body"].split()[0] == f"{z:.4g}"
    deep = {**scene, "cable": [line | {"length": 15.0}]}
    assert static_warnings(dolfbuoy.solve_static(deep), load_scene(deep)) == []


def test_two_buoys_apart_are_two_answers():
    """They do not affect each other."""
    first, second = spread(0.0, "left"), spread(200.0, "right", {"east": 0.2, "north": 1.9, "south": -2.2})
    both = simulate(moored(first, second))
    assert both.buoy.values.tolist() == ["left", "right"]
    for k, part in enumerate((first, second)):
        alone = simulate(moored(part))
        np.testing.assert_allclose(both.buoy_position[:, k], alone.buoy_position, atol=1e-8)
        np.testing.assert_allclose(both.pitch[:, k], alone.pitch, atol=1e-6)
        tension = both.tension_top[:, 3 * k : 3 * k + 3].values
        np.testing.assert_allclose(tension, alone.tension_top, atol=1e-7 * tension.max())
        assert np.ptp(alone.buoy_position.values, axis=0).max() > 0.1


def shared():
    """Two buoys with a line between them and two legs each."""
    cables, left = spread(0.0, "left", {"west": np.pi, "north": 1.8})
    more, right = spread(25.0, "right", {"east": 0.0, "south": -1.9})
    left["fairleads"]["fore"], right["fairleads"]["aft"] = [1.5, 0.0, 0.8], [-1.5, 0.0, 0.8]
    line = {**ROPE, "name": "between", "from": "left.fore", "to": "right.aft", "length": 24.0, "elements": 6}
    return moored((cables, left), (more, right), cable=[*cables, line, *more])


def test_action_and_reaction_of_a_shared_line():
    """Balance of the whole network: anchor forces, weights, buoyancy; here at rest, without waves or current."""
    scene = {name: section for name, section in shared().items() if name not in ("waves", "current", "time")}
    at_rest = solve_static(scene)
    assert at_rest.attachment.values.tolist()[:3] == ["left-west.to", "left-north.to", "between.from"]
    lines = sum(cable["length"] for cable in scene["cable"]) * (12.0 - 1025.0 * np.pi * 0.05**2 / 4)
    weight = 9.81 * (lines + 2 * 4000.0 - at_rest.displaced_mass.values.sum())
    held = at_rest.anchor_force.values[[0, 1, 3, 4]].sum(axis=0)
    np.testing.assert_allclose(held, [0.0, 0.0, weight], atol=1e-4)
    assert at_rest.tension_top.values.min() > 100.0


def test_energy_of_a_network_is_kept():
    """The defect falls with the scheme's second order; with bodies, a prescribed joint and two buoys."""
    for scene in (BRIDLE, shared()):
        defects = [defect(scene, step) for step in (0.02, 0.01)]
        assert defects[1][0] < 2e-3 * defects[1][1]
        assert np.log2(defects[0][0] / defects[1][0]) > 1.4


def test_energy_of_a_network_that_rubs():
    """On a bed with friction, also with a clump: the defect falls with the step and is a thousandth of the work."""
    lying = {
        "name": "lying",
        "material": "rope",
        "from": [0.0, 0.0, -30.0],
        "to": "clump",
        "length": 20.0,
        "elements": 10,
    }
    rising = lying | {"name": "rising", "from": "clump", "to": "ship", "length": 45.0, "elements": 15}
    ship = {"name": "ship", "position": [50.0, 0.0, -2.0], "amplitude": [0.5, 0.5, 0.5], "period": 2.0, "ramp": 1.0}
    scene = {**WATER, "cable": [lying, rising], "joint": [{"name": "clump", "mass": 100.0, "volume": 0.02}, ship]}
    heavy = ROPE | {"line_density": 30.0, "damping": 1e3}
    scene |= {"seabed": {"friction": 0.5, "stiffness": 2e4, "start": "pulled"}, "material": {"rope": heavy}}
    assert float(solve_static(scene).length_on_bed.sel(cable="lying")) > 15.0
    defects = [defect(scene, step) for step in (0.01, 0.005)]
    assert defects[1][0] < 1e-3 * defects[1][1]
    assert defects[1][0] < 0.55 * defects[0][0]


def defect(scene, step):
    """(spurious energy, work done) in a second [J]."""
    simulation = Simulation(load_scene({**scene, "time": {"end": 1.0, "step": step, "scheme": "bdf2"}}), MPI.COMM_SELF)
    meter, stored, powers = Meter(simulation), [], []
    for _ in itertools.chain([None], simulation.run()):
        found = meter.read()
        stored.append(sum(found.pop(name) for name in STORED))
        powers.append(list(found.values()))
    simulation.problem.destroy()
    work = step * (np.array(powers)[:-1] + np.array(powers)[1:]) / 2
    return abs(stored[-1] - stored[0] - work.sum()), np.abs(work).sum()


def test_a_table_is_a_list_of_one():
    """[[cable]] and [[buoy]] with one table each are [cable] and [buoy], from another start of Newton."""
    scene = {**MOORED, "time": {"end": 0.3, "step": 0.02}}
    plain, listed = simulate(scene), simulate({**scene, "cable": [scene["cable"]], "buoy": [scene["buoy"]]})
    assert plain.attrs["unknowns"] == listed.attrs["unknowns"]
    for name in ("cable_position", "buoy_position", "tension_top", "mooring_force"):
        a, b = listed[name].values, plain[name].values
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-7 * np.abs(b).max())


def test_one_of_several_is_named():
    scene = load_scene(
        BRIDLE, **{"cable.port.length": 17.0, "joint.Y.mass": 150.0, "cable.main.segments.1.elements": 7}
    )
    assert [cable.length for cable in scene.cables] == [None, 17.0, 19.0]
    assert scene.joint[0].mass == 150.0
    assert scene.cables[0].segments[1].elements == 7


def test_what_is_said_of_a_network():
    """Each line, buoy and joint by name; parted legs, with place and time, in summary, record and a message."""
    scene = load_scene(shared(), **{"cable.between.fails_at": {"time": 0.1}, "time.end": 0.3})
    scene = load_scene(scene, **{"cable.right-east.fails_at": {"time": 0.05, "at": 1.0}})
    record = dolfbuoy.simulate(scene)
    assert record.attrs["parted"] == "right-east at s = 4.33333 m, t = 0.05 s; between at s = 22 m, t = 0.1 s"
    assert f"Parted: {record.attrs['parted']}." in warnings(record, scene)
    rows = {name: value for name, value, _ in summary(record, scene)}
    assert rows["parted"] == record.attrs["parted"]
    z = record.buoy_position.sel(buoy="right", xyz="z")
    assert rows["right: z of C"] == f"{float(z.min()):.4g} ... {float(z.max()):.4g}"
    assert rows["between: force at left.fore"].count("...") == 1
    bridle, found = load_scene(BRIDLE), dolfbuoy.solve_static(BRIDLE)
    rows = {name: value for name, value, _ in static_rows(found, bridle)}
    tension = float(found.tension_top.sel(cable="port"))
    assert rows["port: tension at rail"] == f"{tension / 1e3:.6g}"
    assert float(rows["Y: position of the joint"].split()[2]) == pytest.approx(float(found.joint_position[0, 2]), 1e-5)


def test_a_compressed_line_of_a_network_is_named():
    """In the record of an equilibrium; a rope would go slack."""
    found = dolfbuoy.solve_static(BRIDLE)
    found.cable_tension[found.cable_of_cell.values == 1] *= -1.0
    said = static_warnings(found, load_scene(BRIDLE))
    assert next(sentence for sentence in said if "compressed" in sentence).startswith("port: The cable is compressed")


def test_lines_and_buoys_of_a_network_are_compared():
    """Recorded top tension of each line and position of each buoy; the driven end is found."""
    scene = load_scene(shared(), time__end=0.2)
    names = quantities_of(scene)
    run, record = compute(scene, names), simulate(scene)
    for name in names:
        assert np.array_equal(run.values[name].reshape(len(run.t), -1), record[name].values.reshape(len(run.t), -1))
    held = load_scene({name: section for name, section in BRIDLE.items() if name != "waves"})
    assert (period_of(held), ramp_of(held)) == (2.0, 1.0)


@pytest.mark.mpi
@needs_mpirun
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_ranks(ranks, tmp_path):
    """The same trajectory on two and three ranks, to 1e-8 of the size of each quantity."""
    bridle = copy.deepcopy(BRIDLE)
    bridle["cable"][0]["segments"][1]["axial_stiffness"] = 1e7  # JSON knows no inf
    scenes = {"bridle": bridle, "shared": shared()}
    done = start_scenes(ranks, scenes, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    for name, scene in scenes.items():
        alone, together = simulate(scene), read(tmp_path / name / "results.nc")
        assert together.attrs["linear_solver_fallbacks"] == 0  # the pieces of all ranks go in the order of one rank
        for quantity in ("cable_position", "cable_tension", "end_tension", "anchor_force"):
            assert apart(alone, together, quantity) < 1e-8, (name, quantity)
