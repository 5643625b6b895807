"""Power take-offs: their law at rest and in motion, absorbed power, and admissible attachments.

Source: the equation of motion of a mass on a spring with dampers, friction and end stops, integrated with scipy; the
linear heave of a float by hand; balances of forces.
"""

import math

import numpy as np
import pytest
from alone import simulate
from every_key import shows
from scipy.integrate import solve_ivp, trapezoid

from dolfbuoy import InputError, Session, load_scene, solve_static
from dolfbuoy.commands.sweep import _show
from dolfbuoy.model.sea import wavenumber
from dolfbuoy.motion.energy import Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.studies.sweep import sweep

MASS, LIFT = 100.0, 1500.0
LAW = {
    "pretension": 120.0,
    "stiffness": 400.0,
    "length": 3.0,
    "damping": 30.0,
    "quadratic_damping": 20.0,
    "friction": 40.0,
    "friction_speed": 0.05,
    "shortest": 3.2,
    "longest": 4.4,
    "stop_stiffness": 3000.0,
}
#: A mass that a force lifts, on a take-off to the ground.
LIFTED = {
    "gravity": 10.0,
    "buoy": {"mass": MASS, "inertia": [10.0, 10.0], "center_of_mass": 0.5},
    "external_force": {"force": [0.0, 0.0, LIFT], "height": 1.0},
    "take_off": {"from": [0.0, 0.0, 0.0], "to": "buoy", **LAW},
}


def tension(law, length, rate=0.0):
    """The law, by hand."""
    T = law["pretension"] + law["stiffness"] * (length - law["length"])
    T += law["stop_stiffness"] * (max(length - law["longest"], 0.0) - max(law["shortest"] - length, 0.0))
    T += (law["damping"] + law["quadratic_damping"] * abs(rate)) * rate
    return T + law["friction"] * rate / math.hypot(rate, law["friction_speed"])


@pytest.mark.parametrize("lift", [1500.0, 1800.0, 1050.0])
@shows("take_off.name", "take_off.from", "take_off.to")
def test_length_and_tension_at_rest(lift):
    """On the spring alone, and on either end stop."""
    rest = solve_static(load_scene(LIFTED, external_force__force=[0.0, 0.0, lift], take_off__name="pull"))
    length, T = (float(rest[f"take_off_{name}"].sel(take_off="pull")) for name in ("length", "tension"))
    assert pytest.approx(lift - 10 * MASS, rel=1e-8, abs=1e-6) == T
    assert tension(LAW, length) == pytest.approx(T, rel=1e-8, abs=1e-6)
    assert float(rest.buoy_position.sel(xyz="z")[0]) == pytest.approx(length + 0.5, rel=1e-9)
    assert float(rest.absorbed_power[0]) == 0


CHANGES = [
    {},
    {"pretension": 250.0},
    {"stiffness": 600.0},
    {"length": 2.8},
    {"damping": 120.0},
    {"quadratic_damping": 100.0},
    {"friction": 150.0},
    {"friction_speed": 0.5},
    {"shortest": 3.6},
    {"longest": 3.9},
    {"stop_stiffness": 9000.0},
]


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: next(iter(change), "as given"))
@shows(*(f"take_off.{name}" for name in LAW))
def test_swing_on_a_take_off(change):
    """From a place away from rest, against scipy; and the power is that of the terms with the speed."""
    law = LAW | change
    start = {"initial": {"buoy_position": [0.0, 0.0, 3.4]}, "time": {"end": 2.0, "step": 0.004, "scheme": "bdf2"}}
    run = simulate(load_scene(LIFTED | start, take_off=LIFTED["take_off"] | change))
    times = run.time.values
    exact = solve_ivp(
        lambda t, y: [y[1], (LIFT - 10 * MASS - tension(law, *y)) / MASS],
        (0.0, 2.0),
        [2.9, 0.0],
        t_eval=times,
        rtol=1e-9,
        atol=1e-9,
        max_step=0.01,
    ).y
    heights = run.buoy_position.sel(xyz="z").values.ravel() - 0.5
    assert np.ptp(exact[0]) > 0.5
    assert np.abs(heights - exact[0]).max() < 2e-3 * np.ptp(exact[0])
    power = [(tension(law, *y) - tension(law, y[0])) * y[1] for y in exact.T]
    assert np.abs(run.absorbed_power.values.ravel() - power)[2:].max() < 0.03 * max(power)
    assert np.abs(run.take_off_length.values.ravel() - heights).max() < 1e-9


def test_a_damper_of_ones_own_is_that_of_a_take_off():
    """Linear and quadratic, by a function in a session or by the take-off: the same motion, and so the same energy."""
    start = {"initial": {"buoy_position": [0.0, 0.0, 3.4]}, "time": {"end": 1.0, "step": 0.02, "scheme": "bdf2"}}

    def heights(**change):
        with Session(LIFTED | start | {"take_off": LIFTED["take_off"] | change}) as s:
            if change:
                s.load("buoy", lambda t, y: -(LAW["damping"] + LAW["quadratic_damping"] * abs(y.velocity)) * y.velocity)
            for _ in range(50):
                s.step()
                yield s.state("buoy").position[2]

    built_in, own = [*heights()], [*heights(damping=0.0, quadratic_damping=0.0)]
    assert np.ptp(built_in) > 0.5
    np.testing.assert_allclose(own, built_in, rtol=0, atol=5e-7)  # where Newton stops


#: A float on a take-off to the sea bed.
RADIUS, DEPTH, WEIGHT, STIFFNESS = 1.5, 30.0, 8000.0, 2000.0
ABSORBER = {
    "sea": {"depth": DEPTH},
    "buoy": {
        "hull": [[0.0, 2 * RADIUS], [3.0, 2 * RADIUS]],
        "mass": WEIGHT,
        "center_of_mass": 1.0,
        "inertia": [2e4, 1e4],
        "added_mass": 1.0,
        "axial_added_mass": 1.0,
    },
    "take_off": {"from": [0.0, 0.0, -DEPTH], "to": "buoy", "stiffness": STIFFNESS, "length": 20.0, "damping": 8e3},
    "waves": {"amplitude": 0.02, "period": 6.0, "ramp": 18.0},
    "time": {"end": 72.0, "step": 0.04, "scheme": "bdf2"},
}


def linear_power(scene, draft, damping):
    """Mean power of the linear heave in regular waves [W]: pressure at the keel, added mass of its disk."""
    omega, k, a = 2 * math.pi / scene.waves.period, wavenumber(scene), scene.waves.amplitude
    spring, added = 1025.0 * 9.81 * math.pi * RADIUS**2, 1025.0 * 2 / 3 * math.pi * RADIUS**3
    at_keel = math.cosh(k * (DEPTH - draft)) / math.cosh(k * DEPTH)
    acceleration = -(omega**2) * math.sinh(k * (DEPTH - draft)) / math.sinh(k * DEPTH)
    moving = spring + STIFFNESS - omega**2 * (WEIGHT + added) - 1j * omega * damping
    heave = abs(a * (spring * at_keel + added * acceleration) / moving)
    return damping * (omega * heave) ** 2 / 2


def mean_power(record, scene):
    """Mean over the last four periods [W]."""
    late = record.time.values >= scene.time.end - 4 * scene.waves.period - 1e-9
    power, times = record.absorbed_power.values.ravel()[late], record.time.values[late]
    return trapezoid(power, times) / (times[-1] - times[0])


def test_mean_power_of_a_point_absorber():
    """Of a float that heaves in small waves, for three dampings: that of the linear response to 0.5 %."""
    drafts = []
    for damping in (4e3, 8e3, 2e4):
        scene = load_scene(ABSORBER, take_off__damping=damping)
        record = simulate(scene)
        drafts.append(1.0 - record.buoy_position.sel(xyz="z").values.ravel()[0])
        assert mean_power(record, scene) == pytest.approx(linear_power(scene, drafts[-1], damping), rel=5e-3)
    assert np.ptp(drafts) == 0


def test_energy_of_a_take_off():
    """Of its spring 1/2 k x^2, and what its damper takes, -d v^2, of a float that is let go below its rest."""
    start = {"initial": {"buoy_position": [0.0, 0.0, -1.5]}, "time": {"end": 1.0, "step": 0.04, "scheme": "bdf2"}}
    simulation = Simulation(load_scene({key: value for key, value in ABSORBER.items() if key != "waves"} | start))
    meter = Meter(simulation)
    for _ in range(5):
        simulation.step(0.04)
    device = simulation.problem.take_offs[0]
    device.note(simulation.system.u)
    length, tension, _ = device.numbers
    found, speed = meter.read(), (tension - STIFFNESS * (length - 20.0)) / 8e3
    simulation.problem.destroy()
    assert abs(speed) > 0.1
    assert found["elastic"] == pytest.approx(STIFFNESS * (length - 20.0) ** 2 / 2, rel=1e-9)
    assert found["take_off"] == pytest.approx(-8e3 * speed**2, rel=1e-6)


def test_power_matrix_of_a_sweep(tmp_path, capsys, monkeypatch):
    """Over two heights and two periods: a column of the dataset and of the table, with the square of the height."""
    monkeypatch.setenv("COLUMNS", "250")
    scene = load_scene(ABSORBER, time={"end": 36.0, "step": 0.06})
    vary = ["waves.amplitude=0.02,0.04", "waves.period=5,7"]
    found = sweep(scene, vary, None, tmp_path / "sweep")
    matrix = found.absorbed_power_mean.values.reshape(2, 2)
    assert (matrix > 0.1).all()
    assert matrix[1] / matrix[0] == pytest.approx([4.0, 4.0], rel=0.01)
    assert float(found.take_off_tension_maximum.max()) > 1e4
    _show(found, tmp_path)
    lines = capsys.readouterr().out.replace("┃", "│").splitlines()
    title, *rows = (line.split("│") for line in lines if "│" in line)
    (column,) = (k for k, word in enumerate(title) if word.split() == ["absorbed", "power", "mean", "[W]"])
    np.testing.assert_allclose([float(row[column]) for row in rows], matrix.ravel(), rtol=1e-4)


ROPE = {"length": 20.0, "elements": 4, "line_density": 2.0, "diameter": 0.03, "axial_stiffness": 2e5}
BUOY = {"hull": [[0.0, 1.2], [2.0, 1.2]], "mass": 900.0, "center_of_mass": 0.8, "inertia": [600.0, 200.0]}


def test_rest_of_a_line_on_a_take_off():
    """In series: what the line pulls at its lower end stretches the spring, and the joint is where both end."""
    scene = {
        "sea": {"depth": 30.0},
        "joint": [{"name": "j"}],
        "cable": dict(ROPE, **{"from": "j"}, to="buoy"),
        "buoy": BUOY,
        "take_off": {"from": [0.0, 0.0, -30.0], "to": "j", "stiffness": 3000.0, "length": 8.0},
    }
    rest = solve_static(scene)
    length, T = float(rest.take_off_length[0]), float(rest.take_off_tension[0])
    assert pytest.approx(3000.0 * (length - 8.0), rel=1e-9) == T
    assert pytest.approx(np.linalg.norm(rest.anchor_force.values), rel=1e-8) == T
    assert rest.joint_position.sel(joint="j", xyz="z") == pytest.approx(-30.0 + length, rel=1e-9)


BAD = [
    ({"length": None}, "take_off.length: must be given, the spring needs it."),
    ({"stiffness": 0.0}, "take_off.length = 3.0: goes with a stiffness."),
    ({"stop_stiffness": 0.0}, "take_off.stop_stiffness: must be given, the end stops need it."),
    ({"shortest": 5.0}, "take_off.shortest = 5.0: must be below longest = 4.4."),
    ({"to": [1.0, 0.0, 0.0]}, "must be another place than from, and one of the two must be free to move"),
    ({"to": "ship"}, "take_off.to = 'ship': must be [x, y, z] or one of the joints, buoys and vessels: buoy."),
]


@pytest.mark.parametrize(("change", "sentence"), BAD)
def test_a_take_off_that_cannot_be(change, sentence):
    with pytest.raises(InputError, match="take_off") as error:
        load_scene(LIFTED, **{f"take_off__{key}": value for key, value in change.items()})
    assert sentence in str(error.value)


FLOAT = {"hull": [[0.0, 0.9], [0.9, 0.9]], "mass": 225.0, "center_of_mass": 0.3, "normal_drag": 0.8}
SPRING = {"from": [0.0, 0.0, -20.0], "to": "buoy", "stiffness": 500.0, "length": 15.0}
#: A spring; one that is left only when its end stop holds, far from where it starts; a pull that is always the same.
HOLDS = {
    "spring": SPRING,
    "end stop": SPRING | {"stiffness": 50.0, "longest": 21.0, "stop_stiffness": 1e6},
    "pretension": {"from": [0.0, 0.0, -20.0], "to": "buoy", "pretension": 500.0},
}


@pytest.mark.parametrize("pushed", [{"external_force": {"force": [250.0, 0.0, 0.0], "height": 0.0}},
                                    {"current": {"speed": 1.0}}], ids=["force", "current"])  # fmt: skip
@pytest.mark.parametrize("device", HOLDS.values(), ids=HOLDS)
def test_a_float_without_lines_that_is_pushed_aside(device, pushed):
    """On a take-off alone: its pull, weight, buoyancy and what pushes are in balance, by its law along its way."""
    rest = solve_static({"sea": {"depth": 20.0}, "buoy": FLOAT, "take_off": device} | pushed)
    length, T = float(rest.take_off_length[0]), float(rest.take_off_tension[0])
    absent = {"pretension": 0.0, "stiffness": 0.0, "length": 0.0, "damping": 0.0, "quadratic_damping": 0.0}
    absent |= {"friction": 0.0, "friction_speed": 1.0, "longest": 1e9, "shortest": 0.0, "stop_stiffness": 0.0}
    assert tension(absent | device, length) == pytest.approx(T, rel=1e-6)
    tilt = math.radians(float(rest.cone_angle[0]))
    axis, across = np.array([math.sin(tilt), 0.0, math.cos(tilt)]), np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    way = rest.buoy_position.values[0] - 0.3 * axis + [0.0, 0.0, 20.0]
    drag = 0.5 * 1025.0 * 0.8 * 0.9 * float(rest.submerged_length[0]) * math.cos(tilt) ** 2 * across
    lift = (float(rest.displaced_mass[0]) - 225.0) * 9.81
    push = [250.0, 0.0, lift] if "external_force" in pushed else drag + [0.0, 0.0, lift]
    assert (tilt > 0.05) == ("current" in pushed)  # a force on the keel leaves it upright
    assert length == pytest.approx(np.linalg.norm(way), rel=1e-9)
    np.testing.assert_allclose(T * way / length, push, atol=1e-5 * T)


def draft(mass):
    """Draft of a FLOAT of this mass [m], by Archimedes."""
    return mass / (1025.0 * math.pi * 0.45**2)


FIRST, SECOND = FLOAT | {"name": "a"}, FLOAT | {"name": "b", "mass": 260.0}
SPRUNG, DAMPED = {"stiffness": 100.0, "length": 5.0}, {"damping": 100.0}


@pytest.mark.parametrize("device", [SPRUNG, DAMPED], ids=["spring", "damper"])
def test_floats_that_nothing_but_a_take_off_joins(device):
    """Each floats at its own draft, whatever stream there is, where the take-off between them does not pull."""
    third = FLOAT | {"name": "c", "mass": 300.0}
    more = {"current": {"speed": 0.7}, "waves": {"amplitude": 0.3, "period": 5.0}, "time": {"end": 1.0, "step": 0.05}}
    scene = {
        "sea": {"depth": 20.0},
        "buoy": [FIRST, SECOND, third],
        "take_off": device | {"from": "a", "to": "b"},
    } | more
    rest = solve_static(scene)
    keels = rest.buoy_position.values[:, 2] - 0.3
    np.testing.assert_allclose(keels, [-draft(mass) for mass in (225.0, 260.0, 300.0)], atol=1e-8)
    assert float(rest.take_off_tension[0]) == pytest.approx(0.0, abs=1e-6)
    if "length" in device:
        assert float(rest.take_off_length[0]) == pytest.approx(5.0, rel=1e-8)
    else:
        assert abs(float(np.diff(rest.buoy_position.values[:2, 0])[0])) >= 0.9  # beside each other
    run = simulate(scene)
    assert float(abs(run.take_off_tension).max()) > 1.0  # the waves move one more than the other


def test_a_float_on_a_spring_beside_one_that_is_free():
    rest = solve_static({"sea": {"depth": 20.0}, "buoy": [FIRST, SECOND], "take_off": SPRING | {"to": "a"}})
    (first, second), T = rest.buoy_position.values[:, 2] - 0.3, float(rest.take_off_tension[0])
    assert second == pytest.approx(-draft(260.0), abs=1e-8)
    assert pytest.approx(500.0 * (first + 20.0 - 15.0), rel=1e-8) == T
    assert -first == pytest.approx(draft(225.0 + T / 9.81), rel=1e-8)


def test_two_masses_on_a_spring_that_nothing_carries():
    """They begin where the spring does not pull, and fall side by side as one alone does."""
    mass = {"mass": MASS, "inertia": [10.0, 10.0], "center_of_mass": 0.5}
    device = {"from": "a", "to": "b", "stiffness": 100.0, "length": 2.0}
    time = {"time": {"end": 0.5, "step": 0.01, "scheme": "bdf2"}}
    run = simulate({"buoy": [mass | {"name": "a"}, mass | {"name": "b"}], "take_off": device} | time)
    alone = simulate({"buoy": mass} | time).buoy_position.sel(xyz="z").values
    np.testing.assert_allclose(run.buoy_position.sel(xyz="z").values, np.column_stack([alone, alone]), atol=1e-8)
    assert alone[-1] < -1.0
    np.testing.assert_allclose(run.take_off_length, 2.0, rtol=1e-5)
