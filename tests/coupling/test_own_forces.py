"""Forces from a caller's function of time and state are solved implicitly with the step.

Source: recurrences of BDF2 for a mass on a spring and a damper, in NumPy; loads given as numbers; a spring so stiff
that a force lagged by one step would be unstable; conservation of energy.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged

from dolfbuoy import InputError, Session
from dolfbuoy.coupling.paths import product
from dolfbuoy.results.record import read
from dolfbuoy.studies.physics import energy

STEP = 0.02
TIME = {"end": 1.0, "step": STEP, "scheme": "bdf2"}
MASS = 10.0
POINT = {
    "gravity": 0.0,
    "buoy": {"mass": MASS, "center_of_mass": 0.0, "inertia": [2.0, 4.0]},
    "initial": {"buoy_position": [1.0, 0.5, -0.5]},
    "time": TIME,
}
LONE = merged(MOORED, cable__elements=6, waves__ramp=0.2, time=TIME | {"scheme": "backward-euler"})
CHAIN = {
    "gravity": 9.81,
    "cable": [
        {"name": "one", "from": [0.0, 0.0, 0.0], "to": "Y", "length": 10.0, "line_density": 1.0, "elements": 3},
        {"name": "two", "from": [15.0, 0.0, 0.0], "to": "Y", "length": 10.0, "line_density": 1.0, "elements": 3},
    ],
    "joint": [{"name": "Y", "mass": 20.0}],
    "time": TIME,
}


def oscillator(k, c, x, count):
    """x of m x_tt = -k x - c x_t by BDF2 from rest."""
    last = before = np.array([x, 0.0])
    A, found = np.array([[0.0, 1.0], [-k / MASS, -c / MASS]]), []
    for _ in range(count):
        last, before = np.linalg.solve(1.5 * np.eye(2) - STEP * A, 2 * last - 0.5 * before), last
        found.append(last[0])
    return np.array(found)


@pytest.mark.parametrize("stiffness", [50.0, 1e8])
def test_a_spring_and_a_damper_are_in_the_equations(stiffness):
    damping = 0.3 * np.sqrt(stiffness * MASS)
    with Session(POINT) as s:
        start, found = s.state("buoy").position, []
        s.load("buoy", lambda t, y: -stiffness * y.position - damping * y.velocity)
        for _ in range(20):
            s.step()
            found.append(s.state("buoy").position)
            assert s.simulation.newton.numbers.iterations <= 3
    expected = np.outer(oscillator(stiffness, damping, 1.0, 20), start)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4)  # a run begins with tiny steps that find its rates


def test_a_function_that_is_constant_is_a_load():
    with Session(LONE) as one, Session(LONE) as two:
        one.load("buoy", [300.0, 0.0, 50.0], [0.0, 20.0, 0.0])
        two.load("buoy", lambda t, y: ([300.0, 0.0, 50.0], [0.0, 20.0, 0.0]))
        for _ in range(10):
            one.step()
            two.step()
            np.testing.assert_allclose(one.state("buoy").position, two.state("buoy").position, rtol=0, atol=1e-9)


def test_a_function_is_asked_at_the_end_of_its_step():
    """It is evaluated at the end of the step, the time the step is solved for."""
    times = []
    with Session(POINT) as s:
        s.load("buoy", lambda t, y: (times.append(t), np.zeros(3))[1])
        for _ in range(3):
            times.clear()
            s.step()
            assert times[-1] == pytest.approx(s.t, abs=1e-12)
            assert max(times) <= s.t + 1e-12


def test_a_moment_turns_back_what_turns():
    with Session(LONE) as s:
        s.load("buoy", lambda t, y: (np.zeros(3), -1e7 * y.angular_velocity))
        start = s.state("buoy")
        for _ in range(20):
            s.step()
        assert np.abs(s.state("buoy").orientation - start.orientation).max() < 2e-4
    with Session(LONE) as s:
        for _ in range(20):
            s.step()
        assert np.abs(s.state("buoy").orientation - start.orientation).max() > 2e-3


def test_a_damper_at_a_joint_keeps_it_still():
    def moved(damping):
        with Session(CHAIN) as s:
            start = s.values()["joint_position"][0]
            s.load("Y", lambda t, y: np.array([400.0, 0.0, 0.0]) - damping * y.velocity)
            for _ in range(10):
                s.step()
                assert s.simulation.newton.numbers.iterations <= 6
            return np.linalg.norm(s.values()["joint_position"][0] - start)

    assert moved(0.0) > 0.02
    assert moved(1e6) < 1e-3


def test_functions_go_back_with_the_state():
    def spring(t, y):
        return -500.0 * y.position

    with Session(LONE) as s:
        s.load("buoy", spring)
        s.step()
        here = s.save()
        s.step()
        u = s.simulation.system.u.copy()
        s.load("buoy", [1e4, 0.0, 0.0])
        s.step()
        s.restore(here)
        s.step()
        np.testing.assert_array_equal(s.simulation.system.u, u)


@pytest.mark.parametrize(("scene", "name", "count"), [(LONE, "buoy", 7), (CHAIN, "Y", 8)], ids=["buoy", "joint"])
def test_a_session_with_functions_goes_on_from_the_disk(scene, name, count, tmp_path):
    """Bit for bit, with the matrix that contains their slopes and a continued step count."""

    def controller(t, y):
        return [300.0 * np.sin(3 * t), 0.0, 20.0] - 400.0 * y.velocity - 30.0 * y.position

    with Session(scene, tmp_path / "whole") as s:
        s.load(name, controller)
        for _ in range(16):
            s.step(0.013)
        whole, assembled = s.simulation.system.u.copy(), s.simulation.newton.numbers.assembled
    with Session(scene, tmp_path / "parts") as s:
        s.load(name, controller)
        for _ in range(count):
            s.step(0.013)
        before = s.simulation.newton.numbers.assembled
        assert s.simulation.newton.numbers.valid  # a matrix that is kept for the next step
    with Session(resume=tmp_path / "parts") as s:
        s.load(name, controller)
        for _ in range(16 - count):
            s.step(0.013)
        np.testing.assert_array_equal(s.simulation.system.u, whole)
        assert before + s.simulation.newton.numbers.assembled == assembled
    series = [read(tmp_path / part / "results.nc") for part in ("whole", "parts")]
    np.testing.assert_array_equal(*(one.tension_top for one in series))


def test_a_function_that_is_not_given_again_is_no_load(tmp_path):
    """After a resumption; a constant load remains."""
    with Session(POINT | {"gravity": 0.0}, tmp_path) as s:
        s.load("buoy", lambda t, y: [70.0, 0.0, 0.0])
        s.step()
    with Session(resume=tmp_path) as s:
        speed = s.state("buoy").velocity
        s.step()
        np.testing.assert_allclose(s.state("buoy").velocity, speed, rtol=0, atol=0.5 * np.linalg.norm(speed))
        s.load("buoy", [0.0, 50.0, 0.0])
        s.step()
        here = s.state("buoy").velocity
    with Session(resume=tmp_path) as s:
        s.step()
        assert s.state("buoy").velocity[1] - here[1] == pytest.approx(50.0 * STEP / MASS, rel=0.2)


#: Two lines meet at a joint, one ends on a buoy; elements with one tension each, for which the balance is exact.
EXACT = {"line_density": 1.0, "axial_stiffness": 2e4, "elements": 3, "position_degree": 1, "tension_degree": 0}
BOTH = {
    "gravity": 9.81,
    "cable": [
        EXACT | {"name": "one", "from": [0.0, 0.0, 0.0], "to": "Y", "length": 10.0},
        EXACT | {"name": "two", "from": [15.0, 0.0, 0.0], "to": "Y", "length": 10.0},
        EXACT | {"name": "three", "from": "Y", "to": "buoy.f", "length": 6.0},
    ],
    "joint": [{"name": "Y"}],
    "buoy": {"mass": 30.0, "center_of_mass": 0.0, "inertia": [2.0, 4.0], "fairleads": {"f": [0.2, 0.1, 0.4]}},
    "time": {"end": 1.0, "step": 0.02},
}


def pulled_by(s, steps):
    """Steps of a session with joint and buoy forces and moments from functions, and a driven first end."""

    def controller(t, y):
        spun = -8.0 * y.angular_velocity + [2.0 * np.sin(5 * t), 1.0 * np.sin(3 * t), 0.0]
        return [60.0 * np.sin(3 * t), 30.0 * np.sin(2 * t), 0.0] - 20.0 * y.velocity, spun

    s.load("buoy", controller)
    s.load("Y", lambda t, y: [0.0, 200.0 * np.sin(2 * t), 0.0] - (10.0 + 10.0 * abs(y.velocity)) * y.velocity)
    s.drive("one.from", lambda t: np.array([0.0, 0.2 * np.sin(2 * t) ** 2, 0.0]))
    for _ in range(steps):
        s.step()
        yield


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2), ("generalized-alpha", 2)])
def test_energy_that_functions_put_in_and_take_out(scheme, order):
    """A separate item of work: stored energy minus work of functions and driven ends vanishes with the order."""
    rows = []
    for step in (0.01, 0.005):
        with Session(BOTH, time={"scheme": scheme, "step": step}, driven="one.from") as s:
            rows.append(energy.balance(s.simulation, pulled_by(s, round(1.2 / step)), "both"))
    assert rows[-1]["loads"] > 200
    assert rows[-1]["top"] > 5
    assert np.log2(rows[-2]["defect"] / rows[-1]["defect"]) == pytest.approx(order, abs=0.15)
    assert abs(rows[-1]["defect"]) < {1: 3.0, 2: 0.03}[order]


def test_energy_of_a_buoy_that_is_driven():
    """The driving force and moment do the work recorded as `required`."""
    rows = []
    for step in (0.02, 0.01):
        with Session(BOTH, time={"scheme": "generalized-alpha", "step": step}, driven="buoy") as s:
            s.drive("buoy", swaying(s.state("buoy")))
            steps = (s.step() for _ in range(round(1.2 / step)))
            rows.append(energy.balance(s.simulation, steps, "both"))
    assert rows[1]["top"] > 5
    assert np.log2(rows[0]["defect"] / rows[1]["defect"]) == pytest.approx(2, abs=0.2)
    assert abs(rows[1]["defect"]) < 0.01 * abs(rows[1]["top"])


def swaying(rest):
    """Motion of C sideways, and about the x axis, from rest."""

    def motion(t):
        shift, speed = 0.3 * np.sin(3 * t) ** 2, 0.9 * np.sin(6 * t)
        angle, spin = 0.4 * np.sin(2 * t) ** 2, 0.8 * np.sin(4 * t)
        turn = product([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0], rest.orientation)
        return rest.position + [0.0, shift, 0.0], turn, [0.0, speed, 0.0], [spin, 0.0, 0.0]

    return motion


def test_an_error_of_the_function_is_the_callers_and_leaves_the_state():
    def fail(t, y):
        raise ZeroDivisionError("the caller's")

    with Session(LONE) as s:
        s.step()
        u = s.simulation.system.u.copy()
        s.load("buoy", fail)
        with pytest.raises(ZeroDivisionError, match="caller"):
            s.step()
        np.testing.assert_array_equal(s.simulation.system.u, u)
        s.load("buoy", lambda t, y: [1.0, 2.0])
        with pytest.raises(InputError, match="a function gave"):
            s.step()
        s.load("buoy")
        s.step()
