"""Every key of buoy, wind, force, start and steps changes the number it should.

Source: Archimedes, rigid bodies (L = I omega, M r_tt = F), the definitions of the hull's coefficients (forms/hull.py),
the seventh-power wind profile, backward Euler's decay factor.
"""

import math

import numpy as np
import pytest
from every_key import changed, shows

from dolfbuoy import load_scene, modes, simulate, solve_static
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.drift import of_components
from dolfbuoy.model.potential_flow import coefficients_of, states_of
from dolfbuoy.scene.potential_flow import PotentialFlow

G, RHO, R, H, M, COM = 10.0, 1000.0, 1.0, 2.0, 3000.0, 0.4
AREA = math.pi * R**2
FLOAT = {
    "gravity": G,
    "sea": {"depth": 50.0, "density": RHO},
    "buoy": {"hull": [[0.0, 2 * R], [H, 2 * R]], "mass": M, "center_of_mass": COM},
    "time": {"end": 0.05, "step": 0.05},
}
DRY = {"gravity": 0.0, "buoy": FLOAT["buoy"] | {"inertia": [900.0, 700.0]}, "time": FLOAT["time"]}
DRY["initial"] = {"buoy_position": [0.0, 0.0, 10.0]}


def start(scene, name):
    return simulate(scene)[name].values[0, 0]


def change(scene, name):
    """Of a vector in the one step of a scene, per second."""
    values = simulate(scene)[name].values[:, 0]
    return (values[-1] - values[0]) / 0.05


@shows("buoy.hull", "buoy.mass", "buoy.center_of_mass")
@pytest.mark.parametrize(
    ("changes", "height"),
    [
        ({}, COM - M / (RHO * AREA)),
        ({"buoy.mass": 4000.0}, COM - 4000.0 / (RHO * AREA)),
        ({"buoy.center_of_mass": 0.6}, 0.6 - M / (RHO * AREA)),
        ({"buoy.hull": [[0.0, 3.0], [2.0, 3.0]]}, COM - M / (RHO * 2.25 * math.pi)),
        ({"sea.density": 1200.0}, COM - M / (1200.0 * AREA)),
    ],
)
def test_draft_of_a_floating_buoy(changes, height):
    assert solve_static(changed(FLOAT, changes)).buoy_position.values[0, 2] == pytest.approx(height, rel=1e-9)


@shows("buoy.name")
def test_a_buoy_is_called_by_its_name():
    assert solve_static(changed(FLOAT, {"buoy.name": "tall"})).buoy.values.tolist() == ["tall"]


# -- start and inertia -------------------------------------------------------------------------------------------------

TURN = [0.1, 0.2, 0.3]
AXES = {
    "given": ({}, [900.0, 900.0, 700.0]),
    "three": ({"buoy.inertia": [900.0, 800.0, 700.0]}, [900.0, 800.0, 700.0]),
    "of the hull": ({"buoy.inertia": None, "buoy.center_of_mass": None}, [M * (3 + 4) / 12] * 2 + [M / 2]),
    "point mass": (
        {"buoy.point_masses": [{"mass": 1000.0, "height": 2.4}]},
        [900.0 + 3000.0 * 0.5**2 + 1000.0 * 1.5**2] * 2 + [700.0],
    ),
    "higher point mass": (
        {"buoy.point_masses": [{"mass": 1000.0, "height": 4.4}]},
        [900.0 + 3000.0 * 1.0**2 + 1000.0 * 3.0**2] * 2 + [700.0],
    ),
}


@pytest.mark.parametrize("name", AXES)
@shows("buoy.inertia", "buoy.point_masses", "buoy.point_masses.mass", "buoy.point_masses.height")
@shows("initial.buoy_angular_velocity", "buoy.initial.buoy_angular_velocity")
@pytest.mark.parametrize("own", ["", "buoy."])
def test_angular_momentum_at_the_start(name, own):
    changes, inertia = AXES[name]
    scene = changed(DRY, {"initial": None, f"{own}initial": {**DRY["initial"], "buoy_angular_velocity": TURN}})
    assert start(changed(scene, changes), "angular_momentum") == pytest.approx(np.multiply(inertia, TURN), rel=1e-9)


@pytest.mark.parametrize("own", ["", "buoy."])
@shows(*(f"{own}initial.buoy_{key}" for own in ("", "buoy.") for key in ("position", "orientation", "velocity")))
def test_pose_and_velocity_at_the_start(own):
    q4 = [math.cos(0.1), 0.0, math.sin(0.1), 0.0]
    given = {"buoy_position": [1.0, 2.0, 3.0], "buoy_orientation": q4, "buoy_velocity": [0.4, 0.5, 0.6]}
    run = simulate(changed(DRY, {"initial": None, f"{own}initial": given})).isel(time=0, buoy=0)
    assert run.buoy_position.values == pytest.approx([1.0, 2.0, 3.0])
    assert run.buoy_orientation.values == pytest.approx(q4)
    assert run.linear_momentum.values == pytest.approx([M * 0.4, M * 0.5, M * 0.6])


# -- loads of the air --------------------------------------------------------------------------------------------------

BREEZE = {"speed_10m": 20.0, "area": 3.0, "height": 1.4}


def blown(**c):
    """Force of the wind [N]: 1/2 C rho A v10^2 (z/10)^(2/7), z of the place of application, and its lever."""
    c = {"drag_coefficient": 1.0, "air_density": 1.225, "direction_deg": 0.0} | BREEZE | c
    z, angle = 10.0 + c["height"] - COM, math.radians(c["direction_deg"])
    size = 0.5 * c["drag_coefficient"] * c["air_density"] * c["area"] * c["speed_10m"] ** 2 * (z / 10) ** (2 / 7)
    force = size * np.array([math.cos(angle), math.sin(angle), 0.0])
    return force, np.cross([0.0, 0.0, c["height"] - COM], force)


WINDS = {
    "speed_10m": 25.0,
    "area": 4.0,
    "height": 3.0,
    "direction_deg": 40.0,
    "drag_coefficient": 1.5,
    "air_density": 1.3,
}


@pytest.mark.parametrize("key", WINDS)
@pytest.mark.parametrize("own", ["", "buoy."])
@shows(*(f"{own}wind.{key}" for own in ("", "buoy.") for key in WINDS))
def test_wind(key, own):
    scene = changed(DRY, {f"{own}wind": BREEZE | {key: WINDS[key]}, "time": {"end": 1e-3, "step": 1e-3}})
    run = simulate(scene)
    for name, load in zip(("linear_momentum", "angular_momentum"), blown(**{key: WINDS[key]}), strict=True):
        assert run[name].values[-1, 0] / 1e-3 == pytest.approx(load, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("own", ["", "buoy."])
@shows(*(f"{own}external_force.{key}" for own in ("", "buoy.") for key in ("force", "height")))
def test_external_force(own):
    force = [100.0, 200.0, 300.0]
    for more, lever in (({}, 0.0), ({"height": 1.9}, 1.5)):
        scene = changed(DRY, {f"{own}external_force": {"force": force, **more}, "time": {"end": 1e-3, "step": 1e-3}})
        run = simulate(scene)
        assert run.linear_momentum.values[-1, 0] / 1e-3 == pytest.approx(force, rel=1e-9)
        torque = np.cross([0.0, 0.0, lever], force)
        assert run.angular_momentum.values[-1, 0] / 1e-3 == pytest.approx(torque, rel=1e-4, abs=1e-6)


@shows("buoy.rotational_damping")
def test_rotational_damping():
    scene = changed(DRY, {"buoy.rotational_damping": 500.0, "initial.buoy_angular_velocity": [0.0, 0.0, 0.3]})
    L = simulate(scene).angular_momentum.values[:, 0, 2]
    assert L[1] / L[0] == pytest.approx(1 / (1 + 500.0 / 700.0 * 0.05), rel=1e-6)  # one step of backward Euler


# -- loads of the water ------------------------------------------------------------------------------------------------

DRAFT = M / (RHO * AREA)
HALF_SPHERE = 2 / 3 * math.pi * R**3 * RHO


@shows("buoy.axial_added_mass", "buoy.wave_damping")
def test_heave_of_a_floating_buoy():
    stiffness = RHO * G * AREA
    for changes, mass, damping in (
        ({}, M, 0.0),
        ({"buoy.axial_added_mass": 0.8}, M + 0.8 * HALF_SPHERE, 0.0),
        ({"buoy.wave_damping": [2000.0, 0.0]}, M, 2000.0),
    ):
        heave = modes(changed(FLOAT, changes), number=6).set_index(mode="name").sel(mode="heave")
        assert float(heave.omega) == pytest.approx(math.sqrt(stiffness / mass), rel=1e-6)
        assert float(heave.damping_ratio) == pytest.approx(damping / 2 / math.sqrt(stiffness * mass), abs=1e-9)


def _pitch(**changes):
    """omega^2 and damping of pitch; without coupling to surge: C and the hull's added mass at one place."""
    found = modes(changed(FLOAT, changes), number=6).set_index(mode="name").sel(mode="pitch")
    return float(found.omega) ** 2, float(found.damping_ratio)


@shows("buoy.rotational_added_mass")
def test_rotational_added_mass_of_pitch():
    inertia, one = 1e4, {"buoy.inertia": [1e4, 700.0]}
    plain, slowed = _pitch(**one)[0], _pitch(**one, **{"buoy.rotational_added_mass": 0.5})[0]
    added = 0.5 * RHO * 8 / 45 * R**5
    assert plain / slowed == pytest.approx(1 + added / inertia, rel=1e-6)


def test_wave_damping_of_pitch():
    inertia, square = 1e4, _pitch(**{"buoy.inertia": [1e4, 700.0]})[0]
    found = modes(changed(FLOAT, {"buoy.inertia": [inertia, 700.0], "buoy.wave_damping": [0.0, 3000.0]}), number=6)
    turning = found.isel(mode=found.damping_ratio.argmax("mode"))
    assert float(turning.omega) ** 2 == pytest.approx(square, rel=1e-6)
    assert float(turning.damping_ratio) == pytest.approx(3000.0 / (2 * inertia * math.sqrt(square)), rel=1e-6)


@shows("buoy.added_mass")
def test_added_mass_across_the_axis():
    push = {"external_force": {"force": [1.0, 0.0, 0.0], "height": DRAFT / 2}, "buoy.center_of_mass": DRAFT / 2}
    scene = changed(FLOAT, {**push, "buoy.inertia": [1e9, 1e9], "time": {"end": 1e-3, "step": 1e-3}})
    scene = changed(scene, {"initial": {"buoy_position": [0.0, 0.0, -DRAFT / 2]}})
    for C_A in (0.0, 1.0):
        run = simulate(changed(scene, {"buoy.added_mass": C_A}))
        assert run.linear_momentum.values[-1, 0, 0] == pytest.approx(1e-3 / (1 + C_A), rel=1e-4)


@shows("buoy.normal_drag", "buoy.axial_drag")
@pytest.mark.parametrize(
    ("key", "velocity", "area"),
    [("normal_drag", [0.5, 0.0, 0.0], 2 * R * DRAFT), ("axial_drag", [0.0, 0.0, 0.5], AREA)],
)
def test_drag_of_the_hull(key, velocity, area):
    scene = changed(FLOAT, {"initial": {"buoy_position": [0.0, 0.0, COM - DRAFT], "buoy_velocity": velocity}})
    scene = changed(scene, {"time": {"end": 1e-4, "step": 1e-4}})
    plain, braked = (simulate(changed(scene, {f"buoy.{key}": C})).linear_momentum.values[-1, 0] for C in (0.0, 0.7))
    force = (braked - plain) / 1e-4
    assert float(np.abs(force).max()) == pytest.approx(0.5 * RHO * 0.7 * area * 0.25, rel=2e-3)
    assert float(force @ velocity) < 0


@shows("buoy.disk_averages")
def test_short_waves_are_averaged_over_the_disk():
    waves = {"waves": {"amplitude": 0.1, "period": 2.5}, "buoy.added_mass": 1.0}
    plain, averaged = (
        change(changed(FLOAT, {**waves, "buoy.disk_averages": on}), "linear_momentum")[0] for on in (False, True)
    )
    k = (2 * math.pi / 2.5) ** 2 / G
    assert averaged / plain == pytest.approx(1 - (k * R) ** 2 / 8, abs=0.05)
    assert averaged != pytest.approx(plain, rel=1e-3)


W = np.linspace(0.2, 4.0, 39)
_WAVY = 900.0 * W**4 * np.exp(-2 * W)
FLOW = {
    "omega": W.tolist(),
    "added_mass": np.outer(1 + np.exp(-W), [1500.0, 1200.0, 300.0, 0.0]).tolist(),
    "added_mass_infinite": [1500.0, 1200.0, 300.0, 0.0],
    "damping": np.outer(_WAVY, [1.0, 1.0, 0.1, 0.0]).tolist(),
    "excitation": np.outer(np.exp(-W), [0.0, -9e3, 3e4, 0.0, 0.0, -900.0]).tolist(),
    "froude_krylov": np.outer(np.exp(-W), [0.0, -5e3, 3e4, 1e3, 0.0, -900.0]).tolist(),
    "mean_drift": np.outer(W, [4e3, *[0.0] * 15]).tolist(),
    "height": 0.1,
    "draft": 0.9,
}
FLOWING = FLOAT | {"buoy": FLOAT["buoy"] | {"potential_flow": FLOW, "inertia": [2000.0, 1500.0]}}


def of_flow(name, **changes):
    """A coefficient about C, with some keys of the table changed."""
    scene = load_scene(changed(FLOWING, {f"buoy.potential_flow.{key}": value for key, value in changes.items()}))
    return getattr(coefficients_of(scene, scene.buoys[0]), name)


def times(key, factor):
    return (np.array(FLOW[key]) * factor).tolist()


@shows("buoy.drift", "buoy.potential_flow.mean_drift")
def test_drift_of_the_file():
    """A force for the motions as they are alone: twice as large in twice as strong a far field."""
    waves = {"waves": {"amplitude": 0.1, "period": 3.0}, "buoy.drift": "newman"}
    for factor in (1.0, 2.0):
        scene = load_scene(changed(FLOWING, {**waves, "buoy.potential_flow.mean_drift": times("mean_drift", factor)}))
        drift = of_components(scene, scene.buoys[0])
        assert drift.whole[0] == pytest.approx(factor * 4e3 * 2 * math.pi / 3, rel=1e-6)


@shows(*(f"buoy.potential_flow.{name}" for name in PotentialFlow.model_fields if name != "mean_drift"))
@pytest.mark.parametrize(
    ("name", "changes", "factor"),
    [
        ("omega", {"omega": times("omega", 1.1)}, 1.1),
        ("added_mass", {"added_mass": times("added_mass", 1.2)}, 1.2),
        ("at_once", {"added_mass_infinite": times("added_mass_infinite", 1.3)}, 1.3),
        ("damping", {"damping": times("damping", 1.4)}, 1.4),
        ("force", {"excitation": times("excitation", 2.0), "froude_krylov": times("froude_krylov", 2.0)}, 2.0),
        ("undisturbed", {"froude_krylov": times("froude_krylov", 0.5)}, 0.5),
    ],
)
def test_coefficients_of_potential_flow(name, changes, factor):
    assert of_flow(name, **changes) == pytest.approx(factor * of_flow(name), rel=1e-12)


@pytest.mark.parametrize(("key", "value", "up"), [("height", 0.35, 0.25), ("draft", 0.8, -0.1)])
def test_point_of_the_coefficients(key, value, up):
    """Surge and pitch go together by the lever of the point above C: A15 = lever A11, A55 + lever^2 A11."""
    lever = FLOW["height"] + FLOW["draft"] - COM
    for at, moved in ((lever, {}), (lever + up, {key: value})):
        found = of_flow("at_once", **moved)
        assert found[0] == pytest.approx([1500.0, 1500.0 * at, 0.0])
        assert found[1, 1] == pytest.approx(300.0 + 1500.0 * at**2)


@shows("buoy.potential_flow")
def test_a_hull_with_potential_flow_is_released():
    """The first acceleration: what Archimedes' force lacks, over the mass and that of the water at once."""
    drop = {"initial": {"buoy_position": [0.0, 0.0, COM - 0.8]}, "time": {"end": 1e-3, "step": 1e-3}}
    values = simulate(changed(FLOWING, drop)).linear_momentum.values[:, 0, 2]
    lacking = RHO * G * AREA * 0.8 - M * G
    assert (values[-1] - values[0]) / 1e-3 == pytest.approx(lacking * M / (M + 1200.0), rel=1e-3)


@shows("buoy.memory_order")
def test_states_of_the_memory():
    for order in (4, 6):
        scene = load_scene(changed(FLOWING, {"buoy.memory_order": order}))
        assert [states.order for states in states_of(scene, scene.buoys[0])] == [order, order]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"buoy.added_mass": 0.5}, "buoy.added_mass = 0.5: goes without potential_flow"),
        ({"buoy.axial_added_mass": 0.5}, "buoy.axial_added_mass = 0.5: goes without"),
        ({"buoy.rotational_added_mass": 0.5}, "buoy.rotational_added_mass = 0.5: goes without"),
        ({"buoy.wave_damping": [1.0, 0.0]}, "buoy.wave_damping = .*: goes without"),
        ({"buoy.potential_flow": None, "buoy.memory_order": 4}, "buoy.memory_order = 4: goes with potential_flow"),
        ({"buoy.potential_flow": None, "buoy.drift": "newman"}, "buoy.drift = 'newman': goes with potential_flow"),
        (
            {"buoy.potential_flow.mean_drift": None, "buoy.drift": "newman"},
            "buoy.drift = 'newman': needs potential_flow.mean_drift, which the file of `dolfbuoy potential` has",
        ),
        ({"buoy.drift": "pinkster"}, "buoy.drift = 'pinkster': "),
        ({"buoy.potential_flow.damping": times("damping", -1.0)}, "damping = .*must not be below 0"),
        ({"buoy.potential_flow.omega": W[::-1].tolist()}, "omega.*must rise"),
        ({"buoy.potential_flow.damping": FLOW["damping"][:-1]}, "damping = .*a row for each of the 39"),
        ({"buoy.potential_flow": "nowhere.nc"}, "buoy.potential_flow = .*file not found"),
        ({"waves": {"theory": "stream", "height": 1.0, "period": 5.0}}, "waves.theory = 'stream': does not go with"),
        ({"gravity": 0.0}, "gravity = 0.0: carries no waves"),
    ],
)
def test_what_does_not_go_with_potential_flow(changes, said):
    with pytest.raises(InputError, match=said):
        load_scene(changed(FLOWING, changes))


# -- moorings ----------------------------------------------------------------------------------------------------------

TETHER = {"length": 40.0, "line_density": 1.0, "axial_stiffness": 1e6, "diameter": 0.02, "elements": 2}


@shows("buoy.mooring_height")
def test_where_the_tether_is_tied():
    rest = solve_static(changed(FLOAT, {"cable": TETHER | {"length": 49.0}, "buoy.mooring_height": 0.3}))
    lever = (rest.mooring_point.values - rest.buoy_position.values)[0]
    assert lever == pytest.approx([0.0, 0.0, 0.3 - COM], abs=1e-9)


@shows("buoy.fairleads")
def test_where_a_fairlead_is():
    line = TETHER | {"length": 49.0, "anchor": [0.9, 0.0, -50.0], "to": "buoy.side"}
    rest = solve_static(
        changed(FLOAT, {"cable": line, "buoy.fairleads": {"side": [0.9, 0.0, 0.5]}, "buoy.name": "buoy"})
    )
    lever = (rest.mooring_point.values - rest.buoy_position.values)[0]
    assert np.linalg.norm(lever) == pytest.approx(math.hypot(0.9, 0.5 - COM), rel=1e-9)


# -- steps that adapt --------------------------------------------------------------------------------------------------


@shows("time.tolerance", "time.min_step", "time.max_step")
def test_bounds_of_steps_that_adapt():
    def steps(**time):
        time = {"max_step": 0.4, "scheme": "bdf2"} | time
        heave = {"initial": {"buoy_position": [0.0, 0.0, 0.2]}}
        whole = {"end": 1.0, "step": 0.01, "output_every": 0.5, "tolerance": 1e-2, "min_step": 1e-5} | time
        return simulate(changed(FLOAT, {**heave, "time": whole})).time_step.values[1:]

    free, strict, bounded = steps(), steps(tolerance=1e-4), steps(max_step=0.02)
    assert len(strict) > 1.5 * len(free)
    assert free.max() > 0.03
    assert 0.019 < bounded.max() <= 0.02
    with pytest.raises(SolveError, match=r"smallest step 0\.009 s"):
        steps(min_step=0.009, tolerance=1e-7)
