"""Nonlinear material given as a table T(e): hanging and taut strings, vibration of one element, energy, refusals.

Source: strains from the table by numpy's interpolation and by quadrature, an oscillator with scipy.
"""

import math
import pickle

import numpy as np
import pytest
from dynamics_helpers import running
from scipy.integrate import solve_ivp

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.forms import cable as form
from dolfbuoy.motion.consistent import make_consistent
from dolfbuoy.motion.schemes import Predictor
from dolfbuoy.scene.stiffness import TensionTable
from dolfbuoy.statics.equilibrium import solve_equilibrium

#: Rubber: soft in the middle, stiff at the end, another stiffness when pushed.
ROWS = [[-0.5, -200.0], [0.0, 0.0], [0.3, 30.0], [1.2, 60.0], [1.8, 160.0]]
STRAINS, TENSIONS = np.array(ROWS).T


def strain(T):
    return np.interp(T, TENSIONS, STRAINS)


def hanging(stiffness, elements=16, force=20.0, **more):
    """A string of 10 m and 100 N that is pulled downwards at its lower end, with r(s) at s = L below."""
    cable = {"length": 10.0, "line_density": 10.0, "axial_stiffness": stiffness, "elements": elements}
    cable |= {"position_degree": 2, "tension_degree": 1, "anchor": [0.0, 0.0, 0.0]}
    cable |= {"top": {"kind": "free", "force": [0.0, 0.0, -force]}}
    return load_scene({"gravity": 1.0, "cable": cable | more, "time": {"end": 1.0, "step": 0.01}})


def lowest(scene):
    """z of the free end, and T at the held one."""
    problem = solve_equilibrium(scene)
    lines, u = problem.lines, problem.system.u
    found = u[lines.end_dofs[0][1]][2], u[lines.T_dofs.ravel()[np.argmin(lines.T_s.ravel())]]
    problem.destroy()
    return found


def test_hanging_string_with_bends_between_elements():
    """T = 20 ... 120 N; the table bends where T is 30 and 60 N, which is s = 9 and 6 m."""
    elements = [[6.0, 6], [3.0, 3], [1.0, 1]]
    s = (np.arange(100_000) + 0.5) / 1e4
    z, T = lowest(hanging(ROWS, elements))
    assert pytest.approx(120.0, rel=1e-12) == T
    assert z == pytest.approx(-np.mean(1 + strain(20 + 10 * (10 - s))) * 10, rel=1e-9)


def test_hanging_string_with_bends_anywhere_converges():
    s = (np.arange(1_000_000) + 0.5) / 1e5
    exact = -np.mean(1 + strain(17.3 + 10 * (10 - s))) * 10
    errors = [abs(lowest(hanging(ROWS, n, force=17.3))[0] - exact) for n in (8, 32)]
    assert errors[1] < min(errors[0] / 4, 2e-4)


def test_rows_on_a_line_are_hookes_law():
    on_a_line = [[-0.1, -50.0], [0.0, 0.0], [0.2, 100.0], [1.0, 500.0]]
    np.testing.assert_allclose(lowest(hanging(on_a_line)), lowest(hanging(500.0)), rtol=1e-12)


def test_taut_and_hanging_between_two_points():
    """A line without weight to speak of, three times as long as it was; and one that sags, with one stiffness less."""
    taut = {"position": [0.0, 0.0, -25.0], "kind": "fixed"}
    scene = hanging(ROWS, line_density=1e-6, top=taut)
    problem = solve_equilibrium(scene)
    np.testing.assert_allclose(problem.system.u[problem.lines.T_dofs], np.interp(1.5, STRAINS, TENSIONS), rtol=1e-6)
    problem.destroy()
    sagging = hanging(ROWS, top={"position": [8.0, 0.0, 0.0], "kind": "fixed"})
    problem = solve_equilibrium(sagging)
    T = problem.system.u[problem.lines.T_dofs]
    assert T.min() > 10
    ends = [problem.system.u[dofs] for dofs in problem.lines.end_dofs[0]]
    np.testing.assert_allclose(ends, [[0, 0, 0], [8, 0, 0]], atol=1e-12)
    problem.destroy()


def one_element(rows, step, end, stretch):
    """x(t) of the free end of one bar P1-P0 without weight, let go where it is `stretch` times as long."""
    cable = {"length": 1.0, "line_density": 3.0, "axial_stiffness": rows, "elements": 1, "top": {"kind": "free"}}
    scene = {"gravity": 0.0, "cable": cable, "time": {"end": end, "step": step, "scheme": "generalized-alpha"}}
    scene |= {"initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [stretch, 0.0, 0.0]]}}
    found = []
    with running(load_scene(scene | {"solver": {"step_tolerance": 1e-11}})) as simulation:
        simulation.begin()
        make_consistent(simulation)
        simulation.predictor = Predictor()
        simulation.predictor.add(0.0, simulation.system.u)
        dof = simulation.problem.lines.end_dofs[0][1][0]
        for _ in simulation.run():
            found.append((simulation.t, simulation.system.u[dof]))
    return np.array(found).T


def test_one_element_vibrates_as_the_oscillator_of_its_table():
    """rho0 L/3 x_tt = -T(x/L - 1), through several bends and below its own length."""

    def motion(_, state):
        return state[1], -np.interp(state[0] - 1, STRAINS, TENSIONS)

    exact = solve_ivp(motion, (0, 2.0), (2.0, 0.0), rtol=1e-10, atol=1e-10, dense_output=True)
    errors = []
    for step in (0.01, 0.0025):
        t, x = one_element(ROWS, step, 2.0, 2.0)
        errors.append(np.abs(x - exact.sol(t)[0]).max())
        assert x.min() < 0.9
        assert x.max() > 1.9
    assert errors[1] < min(errors[0] / 3, 2e-2)


@pytest.mark.parametrize("T", [-150.0, -10.0, 0.0, 12.0, 45.0, 60.0, 130.0, 300.0])
@pytest.mark.parametrize("compliance", [False, True])
def test_energy_is_the_work_of_the_tension(T, compliance):
    """e and its energy as forms have them, in numbers."""
    table = TensionTable(ROWS)
    kinks = tuple(form.Kink(kink, change, kink < 0) for kink, change in table.kinks)
    law = form.Cable(1.0, EA=float(table), kinks=kinks, compliance=1 / float(table) if compliance else None)
    outside = STRAINS[-1] + (T - TENSIONS[-1]) * 0.6 / 100 if TENSIONS[-1] < T else strain(T)
    e = float(form.strain(law, T))
    assert e == pytest.approx(outside, abs=1e-14)
    assert table.strain(T) == pytest.approx(outside, abs=1e-14)
    x = (np.arange(200_000) + 0.5) / 200_000 * e
    beyond = 160.0 + (x - 1.8) / 0.6 * 100
    work = np.mean(np.where(x > 1.8, beyond, np.interp(x, STRAINS, TENSIONS))) * e
    assert float(form.elastic_energy(law, e, T, None, None)) == pytest.approx(work, rel=1e-7, abs=1e-12)


def test_a_table_is_a_number_and_survives_files():
    table = TensionTable(ROWS)
    assert float(table) == 400.0  # where it is pushed: Hooke's law and its first bend meet at 0
    assert float(TensionTable(ROWS[1:])) == 100.0
    assert table == TensionTable(ROWS)
    assert table != TensionTable([*ROWS[:-1], [1.9, 160.0]])
    assert pickle.loads(pickle.dumps(table)).rows == table.rows
    scene = hanging(ROWS)
    again = load_scene(scene.to_dict())
    assert again == scene
    assert "axial_stiffness = [\n" in scene.to_toml() or "axial_stiffness = [[" in scene.to_toml()
    assert math.isfinite(again.network.pieces[0].section.axial_stiffness)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([[0.0, 0.0]], "2 to 50 rows"),
        ([[0.0, 0.0], [0.1, 5.0], [0.1, 7.0]], "grow from row to row"),
        ([[0.0, 0.0], [0.1, 5.0], [0.2, 5.0]], "grow from row to row"),
        ([[0.1, 1.0], [0.2, 5.0]], r"one of them \[0, 0\]"),
        ([[-1.0, -1.0], [0.0, 0.0]], "above -1"),
        ([[0.0, 0.0], [0.1, "x"]], "2 finite numbers"),
        ([[0.0, 0.0, 1.0], [0.1, 1.0, 1.0]], "2 finite numbers"),
    ],
)
def test_what_is_no_law_of_a_material(rows, said):
    with pytest.raises(InputError, match=rf"axial_stiffness.*{said}"):
        hanging(rows)


def test_strain_of_a_tension_on_both_sides_of_zero():
    """Between the rows of a table and beyond them, where the last line goes on."""
    rows = np.array([[-0.03, -5e3], [-0.01, -3e3], [0.0, 0.0], [0.02, 1e3], [0.03, 6e3]])
    table, tensions = TensionTable(rows.tolist()), np.linspace(-5e3, 6e3, 23)
    np.testing.assert_allclose(
        [table.strain(T) for T in tensions], np.interp(tensions, rows[:, 1], rows[:, 0]), atol=1e-15
    )
    assert table.strain(-7e3) == pytest.approx(-0.05, rel=1e-12)
    assert table.strain(11e3) == pytest.approx(0.04, rel=1e-12)
