"""As many buoys and lines as fit in memory.

Source: the same buoy or line alone; scenes that are too large are refused before anything is built.
"""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from dynamics_helpers import running
from mpi4py import MPI
from scipy.sparse.linalg import ArpackNoConvergence

from dolfbuoy import load_scene, simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.errors import InputError
from dolfbuoy.linear import periods
from dolfbuoy.model import feasible
from dolfbuoy.results import figures
from dolfbuoy.solver import loops
from dolfbuoy.solver.c_code import address, core

HULL = {"hull": [[0.0, 1.0], [1.0, 1.0]], "mass": 400.0, "center_of_mass": 0.3, "normal_drag": 1.0, "added_mass": 0.5}
SPECTRUM = {"spectrum": "jonswap", "significant_height": 1.0, "peak_period": 6.0, "components": 20}
SEAS = {"regular": {"amplitude": 0.3, "period": 5.0, "phase_deg": 70.0}, "irregular": SPECTRUM}
GIVEN = {"solver": {"step_tolerance": 1e-10}, "time": {"end": 1.0, "step": 0.05}}
TOP = {"kind": "prescribed", "amplitude": [0.5, 0.0, 0.5], "period": 6.0, "ramp": 1.0}
LINE = {"length": 60.0, "line_density": 5.0, "diameter": 0.03, "axial_stiffness": 1e7, "elements": 20}
LINE |= {"normal_drag": 1.2, "added_mass": 1.0}


def buoys_at(places, sea):
    """Free buoys at these x [m]."""
    tables = [HULL | {"name": f"b{k}", "initial": {"buoy_position": [x, 0.0, 0.1]}} for k, x in enumerate(places)]
    return GIVEN | {"sea": {"depth": 20.0}, "waves": SEAS[sea], "buoy": tables}


def lines_at(places):
    """Lines to moving tops, side by side at these y [m]."""
    tables = [
        LINE | {"name": f"c{k}", "from": [0.0, y, -50.0], "top": TOP | {"position": [20.0, y, -10.0]}}
        for k, y in enumerate(places)
    ]
    return GIVEN | {"sea": {"depth": 50.0}, "cable": tables}


def after_steps(scene, steps=12):
    """States of the buoys (buoys, 13), if any, and forces holding the cable ends."""
    with running(load_scene(scene)) as simulation:
        for _ in range(steps):
            simulation.step(simulation.scene.time.step)
        problem = simulation.problem
        states = [simulation.system.u[buoy.part.slice].copy() for buoy in problem.buoys.values()]
        return np.array(states), simulation.end_forces


@pytest.mark.parametrize(
    ("count", "sea"),
    [(4, "irregular"), pytest.param(100, "regular", marks=pytest.mark.slow),
     pytest.param(100, "irregular", marks=pytest.mark.slow)],
)  # fmt: skip
def test_free_buoys(count, sea):
    """Each moves as if it were alone."""
    places = 7.3 * np.arange(count)
    many, _ = after_steps(buoys_at(places, sea))
    for k in (0, count // 2, count - 1):
        (alone,), _ = after_steps(buoys_at(places[[k]], sea))
        np.testing.assert_allclose(many[k], alone, rtol=0, atol=1e-8 * np.abs(alone).max())
        assert abs(alone[2] - 0.1) > 0.01  # it heaves


def test_hundreds_of_hooks():
    """All are called, in order."""
    called, values = [], np.zeros(1)
    hooks = loops.Hooks(values)
    for k in range(300):
        hooks.add(lambda array, k=k: called.append((k, array is values)))
    both = {"values": address(values), "out": address(values)}
    core().lib.add_up(core().ffi.new("evaluation *", {"before": hooks.described, **both}))
    assert called == [(k, True) for k in range(300)]


@pytest.mark.parametrize("count", [4, pytest.param(300, marks=pytest.mark.slow)])
def test_lines(count):
    """Tensions are those of each line alone, at rest and in motion."""
    places = 30.0 * np.arange(count)
    many, alone = solve_static(lines_at(places)), solve_static(lines_at([0.0]))
    np.testing.assert_allclose(many.tension_top, np.full(count, float(np.squeeze(alone.tension_top))), rtol=1e-9)
    _, many = after_steps(lines_at(places))
    _, alone = after_steps(lines_at([0.0]))
    for name, force in alone.items():
        np.testing.assert_allclose(many[name], np.repeat(force, count, axis=0), rtol=0, atol=1e-7 * np.abs(force).max())
    at_rest = float(np.squeeze(solve_static(lines_at([0.0])).tension_top))
    assert abs(np.linalg.norm(alone["end_tension"]) / at_rest - 1) > 0.01  # it is moved


def test_buoys_without_a_cable_at_rest():
    """Each floats at the draft it has alone, in any wind; `check` has rows for each."""
    heavy = HULL | {"name": "heavy", "mass": 600.0, "wind": {"speed_10m": 9.0, "drag_coefficient": 1.0, "area": 1.0}}
    heavy["wind"]["height"] = 1.5
    scene = {"sea": {"depth": 20.0}, "buoy": [HULL | {"name": "light"}, heavy]}
    found = solve_static(scene)
    np.testing.assert_allclose(found.displaced_mass, [400.0, 600.0], rtol=1e-9)
    draft = np.array([400.0, 600.0]) / (1025.0 * np.pi / 4)
    np.testing.assert_allclose(found.buoy_position[:, 2], 0.3 - draft, atol=1e-9)
    rows = {name: value for name, value, *_ in check(load_scene(scene)).numbers}
    np.testing.assert_allclose([rows["light: draft, free"], rows["heavy: draft, free"]], draft, rtol=1e-9)


@pytest.mark.parametrize("count", [1, 300])
def test_more_elements_than_memory_holds(count):
    """One message, at once."""
    scene = lines_at(30.0 * np.arange(count))
    for cable in scene["cable"]:
        cable |= {"elements": 10_000_000, "position_degree": 4, "tension_degree": 3}
    begin = time.monotonic()
    with pytest.raises(
        InputError, match=rf"^cable.elements = {count}0000000 in all: must be fewer, they take [\d.e+]+ GB"
    ):
        feasible.check_size(load_scene(scene), SimpleNamespace(size=1) if count > 1 else MPI.COMM_SELF)
    assert time.monotonic() - begin < 5


@pytest.mark.parametrize("ask", [solve_static, simulate, check])
def test_more_buoys_than_memory_holds(ask, monkeypatch):
    """One message, before any buoy is processed."""
    monkeypatch.setattr(feasible, "memory", lambda: 5 * feasible.PER_BUOY)
    feasible.check_size(load_scene(buoys_at(range(5), "regular")), MPI.COMM_SELF)
    monkeypatch.setattr(feasible, "float_upright", lambda *given: pytest.fail("a draft was computed"))
    with pytest.raises(InputError, match=r"^buoy: 6 tables in all: must be fewer, they take"):
        ask(buoys_at(range(6), "regular"))


#: Lines from 10 m around to one buoy, so that there are hundreds of modes alike.
AROUND = {"sea": {"depth": 20.0}, "buoy": {"hull": [[0.0, 3.0], [5.0, 3.0]], "mass": 1000.0}}


def around(count):
    angles, line = 2 * np.pi * np.arange(count) / count, LINE | {"length": 25.0, "elements": 4, "to": "buoy"}
    places = np.column_stack([10 * np.cos(angles), 10 * np.sin(angles), np.full(count, -20.0)]).tolist()
    return AROUND | {"cable": [line | {"name": f"c{k}", "anchor": place} for k, place in enumerate(places)]}


def test_modes_that_are_not_found_next_to_one_frequency(monkeypatch):
    """Periods of the buoy then come from modes near the other frequencies."""
    found, called, eigs = check(around(3)).periods, [], periods.eigs

    def one_fails(*given, **how):
        called.append(how)
        if len(called) == 3:
            raise ArpackNoConvergence("none", np.zeros(0), np.zeros((0, 0)))
        return eigs(*given, **how)

    monkeypatch.setattr(periods, "DENSE", 0)
    monkeypatch.setattr(periods, "eigs", one_fails)
    assert check(around(3)).periods == pytest.approx(found, rel=1e-6)
    assert len(called) == len(periods.FREQUENCIES)


@pytest.mark.slow
def test_check_of_hundreds_of_lines():
    """Rows of each line, whatever modes are found among hundreds alike: those of the buoy are of one of the whole."""
    report = check(around(300))
    names = [name for name, *_ in report.numbers]
    assert all(any(name.startswith(f"c{k}: ") for name in names) for k in range(300))
    assert any(name.startswith("buoy, ") for name in report.periods)


def test_figures_of_the_largest(tmp_path, monkeypatch):
    """Of many cables, those with the largest tension have figures of their own, and a message says so."""
    scene, said = lines_at([0.0, 30.0, 60.0, 90.0]), []
    for cable, length in zip(scene["cable"], (60.0, 50.0, 60.0, 49.0), strict=True):
        cable["length"] = length
    simulate(scene | {"time": {"end": 0.2, "step": 0.05}}, out=tmp_path / "run")
    monkeypatch.setattr(figures, "MOST_PARTS", 2)
    drawn = {path.stem for path in figures.draw_all(tmp_path / "run", said.append)}
    assert {name for name in drawn if name.startswith("tension")} == {
        "tension_c0",
        "tension_c2",
    }  # the longer hang deeper
    assert said.count("Of 4 cables the 2 with the largest tension_top have figures of their own.") == 1
    assert len(said) == len(set(said))
