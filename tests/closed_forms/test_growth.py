"""Marine growth changes a line's weight, volume, drag and inertia with depth, but not its stiffness.

Source: the weight hanging below a point; the same line defined with the grown properties by hand; one rank; the energy
balance.
"""

import itertools

import numpy as np
import pytest
from alone import simulate, solve_static
from dynamics_helpers import MOORED, merged
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.errors import SolveError
from dolfbuoy.model.growth import mean_factors
from dolfbuoy.motion.energy import STORED, Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.record import read
from dolfbuoy.results.summary import static_rows, summary
from dolfbuoy.statics.equilibrium import solve_equilibrium

RHO, G = 1025.0, 9.81
CHAIN = {"line_density": 22.0, "diameter": 0.06, "area": 0.0028, "axial_stiffness": 4e7, "added_mass": 0.9}
CHAIN |= {"normal_drag": 1.3, "tangential_drag": 0.1}
WATER = {"sea": {"depth": 60.0, "density": RHO}, "current": {"speed": 0.8}, "solver": {"step_tolerance": 1e-12}}
WATER |= {"waves": {"amplitude": 1.0, "period": 6.0, "ramp": 1.0}, "time": {"end": 2.0, "step": 0.05, "scheme": "bdf2"}}
TOP = {"kind": "prescribed", "position": [33.0, 0.0, -2.0], "amplitude": [0.4, 0.3, 0.6], "period": 3.0}
TOP |= {"ramp": 2.0}
DIAMETER, MASS = 1.6, 1.45
GROWN = {"line_density": MASS * 22.0, "diameter": DIAMETER * 0.06, "area": DIAMETER**2 * 0.0028}
TABLE = [[-45.0, 1.0, 1.0], [-20.0, 1.3, 1.2], [-5.0, 1.8, 1.5]]


@pytest.mark.parametrize("degrees", [(1, 0), (3, 2)])
def test_a_line_straight_up(degrees):
    """T falls by the weight that hangs below; each element has the mean of the table over its heights."""
    cable = {"length": 40.0, "line_density": 15.0, "diameter": 0.05, "elements": 16, "marine_growth": TABLE}
    cable |= {"position_degree": degrees[0], "tension_degree": degrees[1], "anchor": [0.0, 0.0, -50.0]}
    top = {"kind": "free", "force": [0.0, 0.0, 2e4]}
    found = solve_static({"sea": {"depth": 60.0, "density": RHO}, "cable": cable | {"top": top}})
    z, rows = -50.0 + 1e-4 * (np.arange(400_000) + 0.5), np.array(TABLE).T
    thicker, heavier = (np.interp(z, rows[0], x).reshape(16, -1).mean(axis=1) for x in rows[1:])
    weight = G * 2.5 * (15.0 * heavier - RHO * np.pi * 0.05**2 / 4 * thicker**2)
    assert float(found.anchor_force[2]) == pytest.approx(weight.sum() - 2e4, rel=1e-8)
    plain = G * 40.0 * (15.0 - RHO * np.pi * 0.05**2 / 4)
    assert float(found.growth_weight.sum()) == pytest.approx(weight.sum() - plain, rel=1e-8)
    assert weight.sum() > 1.05 * plain
    np.testing.assert_allclose(found.cable_position[:, 2], found.s - 50.0, atol=1e-9)


def test_a_run_from_a_given_shape_has_the_growth_of_it():
    """Means of the table over each element as the shape has it, not those of the depth of the water."""
    scene = merged(MOORED, cable__marine_growth=TABLE, time={"end": 0.001, "step": 0.001})
    found = dolfbuoy.simulate(scene | {"initial": {"kind": "straight", "buoy_position": [8.5, 0.0, 0.4]}})
    ends, rows = found.cable_position.values[0, :, 2], np.array(TABLE).T
    z = np.linspace(ends[:-1], ends[1:], 2001)
    for name, column in (("growth_diameter", 1), ("growth_mass", 2)):
        means = np.interp((z[1:] + z[:-1]) / 2, rows[0], rows[column]).mean(axis=0)
        np.testing.assert_allclose(found[name], means, rtol=1e-5)
        assert np.ptp(means) > 0.1


def by_hand():
    """(scene of two segments, the upper one with the grown numbers; the same as one line with a table of one step)."""
    segments = [{"length": 30.0, "elements": 6}, {"length": 40.0, "elements": 8, **GROWN}]
    hand = WATER | {"cable": {**CHAIN, "top": TOP, "segments": segments}}
    joint = float(solve_static(hand).joint_position[0, 2])
    table = [[joint - 1e-9, 1.0, 1.0], [joint + 1e-9, DIAMETER, MASS]]
    cable = {**CHAIN, "top": TOP, "length": 70.0, "elements": [[30.0, 6], [40.0, 8]], "marine_growth": table}
    return hand, WATER | {"cable": cable}


def test_a_step_is_a_segment_with_the_numbers_by_hand():
    """At rest in a current, and in waves with a moved top: weight, drag, added mass, inertia, all of it at once."""
    hand, table = map(simulate, by_hand())
    np.testing.assert_allclose(table.growth_diameter, 6 * [1.0] + 8 * [DIAMETER], rtol=1e-7)
    np.testing.assert_allclose(table.growth_mass, 6 * [1.0] + 8 * [MASS], rtol=1e-7)
    for name in ("cable_position", "cable_tension", "anchor_force", "end_tension"):
        a, b = table[name].values, hand[name].values
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-7 * np.ptp(b))
    assert np.ptp(hand.tension_top.values) > 1000.0
    plain = simulate(by_hand()[1], cable__marine_growth=None)
    assert np.abs(plain.tension_top - hand.tension_top).max() > 0.1 * np.ptp(hand.tension_top.values)


def three_legs():
    scene = load_scene("three-legs").to_dict()
    for cable in scene["cable"][:2]:
        cable["marine_growth"] = TABLE
    return scene


@pytest.mark.parametrize("name", ["short", "lazy-wave", "chain-on-bed", "three-legs"])
def test_growth_and_depth_agree(name):
    """Of the equilibrium; a cable of a network has its own."""
    scene = load_scene(name).to_dict()
    cables = scene["cable"] if isinstance(scene["cable"], list) else [scene["cable"]]
    for cable in cables[:2]:
        cable["marine_growth"] = TABLE
    problem = solve_equilibrium(load_scene(scene))
    growth, lines = problem.lines.growth, problem.lines
    s = lines.node_s
    heights = problem.system.u[lines.node_dofs[:, 2]][np.argsort(s)]
    for k, section in enumerate(lines.sections):
        mine = lines.line_of_cell == k
        z = np.interp(lines.cell_ends[mine], np.sort(s), heights)
        wanted = mean_factors(TABLE, z.min(axis=1), z.max(axis=1)) if section.marine_growth else np.ones((len(z), 2))
        np.testing.assert_allclose(growth.factors[mine], wanted, atol=1e-8)
    assert np.ptp(growth.factors[:, 0]) > 0.1
    problem.destroy()


def hanging(steep):
    """A line made heavy by growth above 30 m, which would float without it."""
    cable = {"length": 88.0, "line_density": 6.0, "diameter": 0.1, "axial_stiffness": 1e6, "elements": 30}
    cable |= {"marine_growth": [[-30.0 - steep, 1.0, 1.0], [-30.0, 1.0, 2.0]]}
    return {"sea": {"depth": 60.0}, "cable": cable | {"top": {"kind": "fixed", "position": [50.0, 0.0, -2.0]}}}


def test_a_line_that_hovers():
    """Drawn to a depth from both sides: in a smooth table it is found, in a steep one there is a sentence."""
    problem = solve_equilibrium(load_scene(hanging(10.0)))
    growth = problem.lines.growth
    np.testing.assert_allclose(growth.at(problem.system.u), growth.factors, atol=1e-8)
    assert problem.smallest_tension() > 100.0
    problem.destroy()
    with pytest.raises(SolveError, match="do not come to agree"):
        solve_equilibrium(load_scene(hanging(0.01)))


def test_means_of_a_table():
    """Over heights divided by rows, over zero height, and beyond the table."""
    low, high = np.array([-50.0, -25.0, -20.0, -3.0]), np.array([-45.0, -15.0, -20.0, 4.0])
    z = low + np.linspace(0.0, 1.0, 200_001)[:, None] * (high - low)
    rows = np.array(TABLE)
    wanted = [np.interp(z, rows[:, 0], rows[:, k]).mean(axis=0) for k in (1, 2)]
    np.testing.assert_allclose(mean_factors(TABLE, low, high), np.transpose(wanted), atol=1e-5)


def test_factors_of_one_change_nothing():
    plain = simulate(by_hand()[1], cable__marine_growth=None)
    ones = simulate(by_hand()[1], cable__marine_growth=[[0.0, 1.0, 1.0]])
    np.testing.assert_allclose(ones.cable_position, plain.cable_position, atol=1e-9)
    np.testing.assert_allclose(ones.tension_top, plain.tension_top, rtol=1e-8)
    assert "marine growth" in ones.attrs["effects"]
    assert "marine growth" not in plain.attrs["effects"]
    assert "growth_mass" not in plain


def test_energy_is_kept():
    """The defect falls with the scheme's second order."""
    defects = []
    for step in (0.02, 0.01):
        scene = {**by_hand()[1], "time": {"end": 1.0, "step": step, "scheme": "bdf2"}}
        scene["cable"] = scene["cable"] | {"marine_growth": TABLE}
        simulation = Simulation(load_scene(scene), MPI.COMM_SELF)
        meter, stored, powers = Meter(simulation), [], []
        for _ in itertools.chain([None], simulation.run()):
            found = meter.read()
            stored.append(sum(found.pop(name) for name in STORED))
            powers.append(list(found.values()))
        simulation.problem.destroy()
        work = step * (np.array(powers)[:-1] + np.array(powers)[1:]) / 2
        defects.append((abs(stored[-1] - stored[0] - work.sum()), np.abs(work).sum()))
    assert defects[1][0] < 2e-3 * defects[1][1]
    assert np.log2(defects[0][0] / defects[1][0]) > 1.4


def test_what_is_said_of_it():
    """By `check`, after a run and after an equilibrium, of each cable that has it."""
    scene = merged(MOORED, cable__marine_growth=TABLE, time={"end": 0.1, "step": 0.05})
    record, weight = dolfbuoy.simulate(scene), solve_static(scene).growth_weight
    said = {name: float(value) for name, value, *_ in check(load_scene(scene)).numbers}
    assert said["marine growth adds in water"] == pytest.approx(float(weight.sum()), rel=1e-9)
    rows = {name: (value, unit) for name, value, unit in summary(record, load_scene(scene))}
    factor = 1e-3 if rows["marine growth adds in water"][1] == "kN" else 1.0
    assert float(rows["marine growth adds in water"][0]) == pytest.approx(factor * float(weight.sum()), rel=1e-3)
    legs = load_scene(three_legs())
    names = [name for name, *_ in static_rows(dolfbuoy.solve_static(legs), legs) if "marine growth" in name]
    assert names == [f"{name}: marine growth adds in water" for name in ("east", "north")]
    names = [name for name, *_ in check(legs).numbers if "marine growth" in name]
    assert names == [f"marine growth adds in water to {name}" for name in ("east", "north")]


SCRIPT = """
import json, sys
import dolfbuoy

for name, scene in json.load(open(sys.argv[1])).items():
    dolfbuoy.simulate(scene, out=name, time__end=0.3)
"""


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks(tmp_path):
    """The same on two ranks."""
    scenes = {"table": by_hand()[1], "legs": three_legs() | {"time": {"end": 0.3, "step": 0.05}}}
    done = start_scenes(2, scenes, tmp_path, SCRIPT)
    assert done.returncode == 0, done.stderr[-2000:]
    for name, scene in scenes.items():
        alone, together = simulate(scene, time__end=0.3), read(tmp_path / name / "results.nc")
        for quantity in ("cable_position", "cable_tension", "growth_diameter", "growth_weight"):
            a, b = alone[quantity].values, together[quantity].values
            assert np.abs(a - b).max() < 1e-8 * np.ptp(a), (name, quantity)
