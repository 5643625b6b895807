"""Power take-offs between lines, buoys and vessels: energy balance, exact Jacobian, resumption, ranks.

Source: conservation of energy; finite differences of the residual; the run without interruption, or on one rank.
"""

import itertools
import math

import numpy as np
import pytest
from alone import simulate
from dynamics_helpers import merged
from mpi_helpers import needs_mpirun, start_scenes
from scipy.sparse import csr_matrix

from dolfbuoy import Session, load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.results.record import read
from dolfbuoy.studies.physics import energy

ROPE = {
    "length": 32.0,
    "elements": 5,
    "line_density": 2.0,
    "diameter": 0.03,
    "axial_stiffness": 2e5,
    "normal_drag": 1.2,
    "position_degree": 1,
    "tension_degree": 0,
}
HULL = {
    "hull": [[0.0, 1.2], [2.0, 1.2]],
    "mass": 900.0,
    "center_of_mass": 0.8,
    "inertia": [600.0, 200.0],
    "added_mass": 0.8,
    "normal_drag": 0.8,
    "axial_drag": 0.5,
    "axial_added_mass": 0.6,
    "fairleads": {"f": [0.6, 0.0, 0.2], "g": [-0.6, 0.1, 0.2]},
}
WATER = {
    "sea": {"depth": 30.0},
    "waves": {"amplitude": 0.7, "period": 5.0, "ramp": 5.0},
    "time": {"end": 10.0, "step": 0.02, "scheme": "bdf2"},
}
ALL = {
    "stiffness": 3000.0,
    "length": 8.0,
    "damping": 2e3,
    "quadratic_damping": 500.0,
    "friction": 200.0,
    "friction_speed": 0.05,
    "longest": 9.2,
    "stop_stiffness": 1e4,
    "pretension": 100.0,
}
#: A line in series with one; two buoys on their lines, one between them; a buoy and a vessel.
SERIES = WATER | {
    "joint": [{"name": "j"}],
    "cable": ROPE | {"length": 20.0, "from": "j", "to": "buoy"},
    "buoy": HULL,
    "take_off": ALL | {"from": [0.0, 0.0, -30.0], "to": "j"},
    "current": {"speed": 0.3},
}
BETWEEN = WATER | {
    "buoy": [HULL | {"name": "a"}, HULL | {"name": "b"}],
    "cable": [
        ROPE | {"name": "p", "from": [-10.0, 0.0, -30.0], "to": "a.f"},
        ROPE | {"name": "q", "from": [10.0, 0.0, -30.0], "to": "b.g"},
    ],
    "take_off": {
        **{"name": "t", "from": "a.g", "to": "b.f", "stiffness": 1500.0, "length": 3.0, "damping": 3e3},
        **{"longest": 6.0, "shortest": 2.0, "stop_stiffness": 2e4},
    },
}
#: x and z of the ship, at rest at first.
SAILED = [[t, 0.5 * math.sin(t) * (1 - math.exp(-t)), 0, 0.4 * t * math.exp(-t / 3), 0, 0, 0] for t in range(20)]
SHIP = {"name": "ship", "position": [12.0, 0.0, 1.0], "fairleads": {"s": [0.0, 0.0, 0.0]}, "motion": SAILED}
VESSEL = WATER | {
    "vessel": [SHIP],
    "buoy": HULL,
    "cable": ROPE | {"from": [-10.0, 0.0, -30.0], "to": "buoy"},
    "take_off": {"from": "buoy.f", "to": "ship.s", "stiffness": 800.0, "length": 9.0, "damping": 1e3},
}
SCENES = {"series": SERIES, "between": BETWEEN, "vessel": VESSEL}


def balance(scene, end, step, scheme):
    """Row of `study energy`."""
    return energy.evaluate({"scene": load_scene(scene), "t_end": end, "step": step, "scheme": scheme})


@pytest.mark.parametrize("name", ["series", "between"])
def test_energy_of_what_a_take_off_absorbs(name):
    """Absorbed energy leaves the system; the defect vanishes with the order of the scheme."""
    rows = [balance(SCENES[name], 3.0, step, "generalized-alpha") for step in (0.04, 0.02)]
    assert rows[1]["take_off"] < -1
    assert abs(rows[1]["take_off"]) > 100 * abs(rows[1]["defect"])
    assert math.log2(rows[0]["defect"] / rows[1]["defect"]) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2), ("generalized-alpha", 2)])
@pytest.mark.parametrize("name", SCENES)
def test_energy(name, scheme, order):
    """With all schemes, and active end stops; a vessel does the work of its end."""
    steps = (0.01, 0.005, 0.0025) if order > 1 else (0.0025, 0.00125, 0.000625)  # which takes away more itself
    rows = [balance(SCENES[name], 10.0, step, scheme) for step in steps]
    found = [math.log2(abs(a["defect"] / b["defect"])) for a, b in itertools.pairwise(rows)]
    assert found[-1] == pytest.approx(order, abs=0.15)
    assert -rows[-1]["take_off"] > 20 * abs(rows[-1]["defect"])
    assert (abs(rows[-1]["top"]) > 100) == (name == "vessel")


@pytest.mark.parametrize("name", SCENES)
def test_jacobian(name):
    """Against central differences of the residual, far from rest, with rates."""
    problem = Problem(load_scene(SCENES[name]), dynamic=True)
    system, rng = problem.system, np.random.default_rng(1)
    try:
        problem.set_time(1.3)
        forces = np.isin(range(len(system.u)), problem.force_dofs())
        system.u[:] = rng.normal(size=len(system.u)) * np.where(forces, 1e3, 1.0)
        for evolution in problem.evolutions():
            for level in range(evolution.order):
                evolution.hand_out(level, 30.0, rng.normal(size=evolution.size))
        system.share()
        system.publish()
        system.assemble_jacobian()
        rows, columns, values = system.A.getValuesCSR()
        index = system.numbering.global_index
        places = [
            dof for device in problem.take_offs for end in device.ends for dof in range(end.slice.start, end.slice.stop)
        ]
        chosen, x = {int(index[dof]) for dof in places} - {-1}, system.u.copy()
        assert len(chosen) >= 3
        matrix = csr_matrix((values, columns, rows), shape=(system.unknowns, system.unknowns)).toarray()
        for k in chosen:
            moved, sides = index == k, []
            size = 1e-4 * max(1.0, float(np.abs(x[moved]).max()))
            for sign in (1, -1):
                system.u[:] = x + sign * size * moved
                system.publish()
                sides.append(np.bincount(index[index >= 0], system.evaluate()[index >= 0], system.unknowns))
            difference = (sides[0] - sides[1]) / (2 * size)
            np.testing.assert_allclose(matrix[:, k], difference, rtol=0, atol=2e-5 * np.abs(difference).max())
    finally:
        problem.destroy()


def test_save_restore_and_resume(tmp_path):
    """Bit for bit, in memory and from disk."""
    scene = merged(BETWEEN, time__end=0.8, time__step=0.04)
    expected = simulate(scene)
    with Session(scene, tmp_path / "run") as s:
        for _ in range(10):
            s.step()
        here = s.save()
        s.step()
        s.step()
        s.restore(here)
        s.step()
    with Session(resume=tmp_path / "run") as s:
        for k in range(12, 21):
            s.advance_to(k * 0.04)
    found = read(tmp_path / "run" / "results.nc")
    for name in ("absorbed_power", "take_off_tension", "take_off_length", "tension_top", "buoy_position"):
        np.testing.assert_array_equal(found[name].values, expected[name].values.reshape(found[name].shape))


def test_a_take_off_that_does_nothing_changes_nothing():
    """A take-off without parameters leaves the trajectory unchanged, to rounding."""
    scene = merged(SERIES, time__end=0.4, take_off=None, cable={"from": [0.0, 0.0, -30.0], "length": 31.0}, joint=None)
    idle = scene | {"take_off": {"from": [5.0, 0.0, 0.0], "to": "buoy.f"}}
    one, other = simulate(scene), simulate(idle)
    np.testing.assert_allclose(one.tension_top.values, other.tension_top.values, rtol=1e-9)
    assert not other.absorbed_power.values.any()


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_two_ranks(tmp_path):
    """As on one rank, to 1e-7."""
    scenes = {name: merged(scene, time__end=1.0) for name, scene in SCENES.items()}
    expected = {name: simulate(scene) for name, scene in scenes.items()}
    done = start_scenes(2, scenes, tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    for name, one in expected.items():
        two = read(tmp_path / name / "results.nc")
        for series in ("take_off_tension", "absorbed_power", "buoy_position"):
            values = one[series].values.reshape(two[series].shape)
            assert np.abs(two[series].values - values).max() < 1e-7 * np.ptp(values)
