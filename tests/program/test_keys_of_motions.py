"""Every key of a moving end, joint, failure, bed or time changes the number it should.

Source: the prescribed paths of driven ends, global balances, taut strings with a point mass, Coulomb's law.
"""

import math

import numpy as np
import pytest
from every_key import changed, shows

from dolfbuoy import design, modes, simulate, solve_static, uncertainty
from dolfbuoy.errors import NotAccurate

ROPE = {"length": 20.0, "line_density": 0.5, "diameter": 0.02, "axial_stiffness": 1e6, "elements": 2}
DRIVEN = {
    "gravity": 10.0,
    "cable": {**ROPE, "anchor": [0.0, 0.0, -20.0]},
    "time": {"end": 0.8, "step": 0.2, "output_every": 0.2},
}
PLACE = np.array([1.0, 2.0, 0.5])
SIZE, PERIOD = np.array([0.3, 0.2, 0.1]), 4.0
ROWS = [[0.0, 0.0, 0.0, 0.0], [0.4, 0.1, 0.2, 0.3], [0.8, 0.4, 0.1, 0.0]]


def swing(t, phase=(0.0, 0.0, 0.0), ramp=0.0):
    size = 0.5 * (1 - math.cos(math.pi * min(t / ramp, 1.0))) if ramp else 1.0
    return PLACE + size * SIZE * np.sin(2 * math.pi * t / PERIOD + np.radians(phase))


def tow(t, ramp=0.0):
    if not ramp:
        return PLACE + SIZE * t
    late = max(t - ramp, 0.0)
    t = min(t, ramp)
    return PLACE + SIZE * (late + 0.5 * (t - ramp / math.pi * math.sin(math.pi * t / ramp)))


MOVED = {"amplitude": SIZE.tolist(), "period": PERIOD}
MOTIONS = {
    "swing": (MOVED, swing),
    "phase": (MOVED | {"phase_deg": 90.0}, lambda t: swing(t, (90.0, 90.0, 90.0))),
    "phases": (MOVED | {"phase_deg": [0.0, 90.0, 45.0]}, lambda t: swing(t, (0.0, 90.0, 45.0))),
    "ramp": (MOVED | {"ramp": 0.5}, lambda t: swing(t, ramp=0.5)),
    "tow": ({"velocity": SIZE.tolist()}, tow),
    "tow with a ramp": ({"velocity": SIZE.tolist(), "ramp": 0.5}, lambda t: tow(t, 0.5)),
    "rows": ({"motion": ROWS}, lambda t: PLACE + np.array({row[0]: row[1:] for row in ROWS}[round(t, 6)])),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("holder", ["top", "joint"])
@shows(*(f"{place}.{key}" for place in ("cable.top", "joint") for key in (*MOVED, "phase_deg", "ramp", "velocity")))
@shows("cable.top.motion", "joint.motion", "joint.position", "joint.name", "cable.to")
def test_path_of_a_driven_end(name, holder):
    motion, path = MOTIONS[name]
    if holder == "top":
        scene = changed(DRIVEN, {"cable.top": {"kind": "prescribed", "position": PLACE.tolist(), **motion}})
    else:
        joint = {"name": "ship", "position": PLACE.tolist(), **motion}
        scene = changed(DRIVEN, {"cable.to": "ship", "joint": [joint]})
    run = simulate(scene)
    times = run.time.sel(time=run.frame).values if "motion" not in motion else np.array([0.0, 0.4, 0.8])
    shown = run.cable_position.sel(frame=times, method="nearest").values[:, -1]
    assert shown == pytest.approx(np.array([path(t) for t in times]), rel=1e-9)


# -- joints ------------------------------------------------------------------------------------------------------------

PAIR = {
    "gravity": 10.0,
    "sea": {"depth": 50.0, "density": 1000.0},
    "cable": [
        {**ROPE, "name": "low", "to": "clump"},
        {**ROPE, "name": "high", "from": "clump", "top": {"kind": "free", "force": [0.0, 0.0, 5000.0]}},
    ],
    "joint": [{"name": "clump"}],
}
WEIGHT = (0.5 - 1000.0 * math.pi / 4 * 0.02**2) * 10.0 * 40.0


@pytest.mark.parametrize(
    ("key", "value", "pull"),
    [("mass", 30.0, -300.0), ("volume", 0.02, 200.0), ("drag_area", 0.4, 0.0)],
)
@shows("joint.mass", "joint.volume", "joint.drag_area")
def test_weight_buoyancy_and_drag_of_a_joint(key, value, pull):
    rest = solve_static(changed(PAIR, {f"joint.clump.{key}": value, "current": {"speed": 2.0}}))
    force = rest.anchor_force.sel(cable="low").values
    assert force[2] == pytest.approx(-(5000.0 - WEIGHT + pull), rel=1e-9)
    assert force[0] == pytest.approx(-0.5 * 1000.0 * 0.4 * 4.0 if key == "drag_area" else 0.0, abs=1e-6)


@shows("cable.segments.body.drag_area")
def test_drag_of_a_body_between_segments():
    half = dict(ROPE)
    line = {"segments": [half | {"body": {"drag_area": 0.4}}, half], "top": PAIR["cable"][1]["top"]}
    rest = solve_static({**{k: PAIR[k] for k in ("gravity", "sea")}, "cable": line, "current": {"speed": 2.0}})
    assert rest.anchor_force.values[0, 0] == pytest.approx(-0.5 * 1000.0 * 0.4 * 4.0, rel=1e-9)


def _slowest(body, place):
    """Slowest omega of a taut line with a body in its middle."""
    half = ROPE | {"line_density": 1e-4, "elements": 1}
    taut = {"gravity": 0.0, "sea": PAIR["sea"]}
    if place == "joint":
        ends = {"from": [0.0, 0.0, -45.0], "to": "clump"}, {"from": "clump", "to": [0.0, 0.0, -4.6]}
        taut |= {"cable": [half | {"name": n} | e for n, e in zip("ab", ends, strict=True)]}
        taut |= {"joint": [{"name": "clump", **body}]}
    else:
        taut["cable"] = {"segments": [half | {"body": body}, half], "anchor": [0.0, 0.0, -45.0], "to": [0.0, 0.0, -4.6]}
    return float(modes(taut, number=1).omega[0])


@pytest.mark.parametrize("place", ["joint", "segment"])
@shows("joint.added_mass", "cable.segments.body.added_mass")
def test_added_mass_of_a_body_on_a_taut_line(place):
    body, T = {"mass": 30.0, "volume": 0.02}, 1e6 * 0.01
    for more, mass in (({}, 30.0), ({"added_mass": 0.5}, 40.0)):
        assert _slowest(body | more, place) == pytest.approx(math.sqrt(2 * T / 20.2 / mass), rel=1e-4)


# -- failures ----------------------------------------------------------------------------------------------------------

HUNG = changed(DRIVEN, {"cable.to": [12.0, 0.0, -8.0], "time.end": 0.4, "time.step": 0.05, "cable.elements": 4})
MATERIAL = {"material": {"rope": {}}, "cable.material": "rope"}
PLACES = {"cable.": {}, "material.NAME.": MATERIAL, "cable.segments.": {}}


def parted(place, failure):
    """Run of a hanging line that fails as its cable, its material or its segment says."""
    if place == "cable.":
        return simulate(changed(HUNG, {"cable.fails_at": failure}))
    if place == "material.NAME.":
        return simulate(changed(HUNG, {"cable.material": "rope", "material": {"rope": {"fails_at": failure}}}))
    never = {"rope": {"fails_at": {"tension": 1e9}}}
    segment = {**{k: HUNG["cable"][k] for k in ROPE}, "material": "rope", "fails_at": failure}
    line = {"segments": [segment], "anchor": HUNG["cable"]["anchor"], "to": HUNG["cable"]["to"]}
    return simulate({**HUNG, "cable": line, "material": never})


@pytest.mark.parametrize("place", PLACES)
@shows(*(f"{place}fails_at.{key}" for place in PLACES for key in ("time", "tension", "at")))
def test_when_and_where_a_line_parts(place):
    rest, last = float(solve_static(HUNG).tension_top[0]), 0.5 * 10.0 * 5.0 / 2
    whole, late = parted(place, {"tension": 1.2 * rest}), parted(place, {"time": 0.2})
    assert whole.tension_top.values[-1, 0] == pytest.approx(rest, rel=1e-6)
    assert late.tension_top.sel(time=0.15, method="nearest").values[0] == pytest.approx(rest, rel=1e-6)
    assert late.tension_top.values[-1, 0] < last  # what is left of the element that parts hangs at the end
    assert parted(place, {"tension": 0.8 * rest}).tension_top.values[2:, 0].max() < last
    low = parted(place, {"time": 0.2, "at": 2.0})
    assert low.tension_top.values[-1, 0] > 0.1 * rest > 10 * low.tension_anchor.values[-1, 0]


@pytest.mark.parametrize("place", PLACES)
@shows(*(f"{place}breaking_load" for place in PLACES))
def test_utilisation_of_a_line(place):
    scene = HUNG | {"time": {"end": 0.1, "step": 0.05}}
    if place == "cable.":
        run = simulate(changed(scene, {"cable.breaking_load": 500.0}))
    elif place == "material.NAME.":
        run = simulate(changed(scene, MATERIAL | {"material.rope.breaking_load": 500.0}))
    else:
        segment = {**{k: HUNG["cable"][k] for k in ROPE}, "material": "rope", "breaking_load": 500.0}
        line = {"segments": [segment], "anchor": HUNG["cable"]["anchor"], "to": HUNG["cable"]["to"]}
        run = simulate({**scene, "cable": line, "material": {"rope": {"breaking_load": 1.0}}})
    *_, before, last = run.cable_tension.values[0]
    assert float(run.utilisation.values[0].max()) == pytest.approx((1.5 * last - 0.5 * before) / 500.0, rel=1e-9)


# -- bed ---------------------------------------------------------------------------------------------------------------

WET = (10.0 - 1000.0 * math.pi / 4 * 0.05**2) * 10.0
LYING = {
    "gravity": 10.0,
    "sea": {"depth": 20.0, "density": 1000.0},
    "cable": {
        "length": 40.0,
        "line_density": 10.0,
        "diameter": 0.05,
        "axial_stiffness": 1e8,
        "elements": 8,
        "slack": "tension-only",
        "top": {"kind": "free", "force": [3000.0, 0.0, 0.0]},
    },
    "seabed": {"stiffness": 1e5},
}


@shows("seabed.stiffness")
@pytest.mark.parametrize("stiffness", [1e5, 3e5])
def test_how_deep_a_line_lies(stiffness):
    rest = solve_static(changed(LYING, {"seabed.stiffness": stiffness}))
    assert rest.cable_position.values[-1, 2] == pytest.approx(-20.0 - WET / (stiffness * 0.05), rel=1e-6)


@shows("seabed.friction", "seabed.start", "seabed.stick_length")
def test_friction_of_a_line_that_was_pulled():
    rough = changed(LYING, {"seabed.friction": 0.5})
    pulled = changed(rough, {"seabed.start": "pulled"})
    free, held, loose = (
        solve_static(s).anchor_force.values[0] for s in (rough, pulled, changed(pulled, {"seabed.stick_length": 1.0}))
    )
    assert free[0] == pytest.approx(-3000.0, rel=1e-9)
    assert held[0] == pytest.approx(-3000.0 + 0.5 * (WET * 40.0 - held[2]), rel=0.02)
    assert held[0] > loose[0] + 1.0 > free[0]


@shows("seabed.slope")
def test_a_line_on_a_slope():
    force = solve_static(changed(LYING, {"seabed.slope": [0.1, 0.0]})).anchor_force.values[0]
    down = np.array([1.0, 0.0, 0.1]) / math.sqrt(1.01)
    assert -force @ down == pytest.approx(np.array([3000.0, 0.0, -WET * 40.0]) @ down, rel=1e-4)


@shows("seabed.damping_ratio", "initial.kind", "initial.points")
def test_a_line_that_lands_sinks_less_far_with_more_damping():
    points = [[0.0, 0.0, -20.0], [20.0, 0.0, -19.9], [40.0, 0.0, -20.0]]
    ends = {"cable.top": {"kind": "fixed", "position": points[-1], "force": None}}
    scene = changed(
        LYING, {**ends, "initial": {"kind": "polyline", "points": points}, "time": {"end": 0.3, "step": 0.01}}
    )
    runs = [simulate(changed(scene, {"seabed.damping_ratio": ratio})) for ratio in (0.1, 1.0)]
    lowest = [run.cable_position.values[:, 4, 2].min() for run in runs]
    assert runs[0].cable_position.values[0, 4, 2] == pytest.approx(-19.9)
    assert lowest[0] < lowest[1] - 1e-3


@shows("library")
def test_a_material_of_a_file(tmp_path):
    (tmp_path / "ropes.toml").write_text("[mine]\nline_density = 10.0\ndiameter = 0.05\naxial_stiffness = 1e8\n")
    text = 'library = "ropes.toml"\ngravity = 10.0\n[sea]\ndepth = 20.0\ndensity = 1000.0\n'
    text += '[cable]\nmaterial = "mine"\nlength = 15.0\ntop = {kind = "free", force = [0.0, 0.0, 5e3]}\n'
    (tmp_path / "scene.toml").write_text(text)
    assert -solve_static(tmp_path / "scene.toml").anchor_force.values[0, 2] == pytest.approx(5e3 - 15.0 * WET, rel=1e-9)


# -- waves along a line ------------------------------------------------------------------------------------------------

IN_WAVES = {
    "gravity": 0.0,
    "sea": {"depth": 50.0, "density": 1000.0},
    "cable": {**ROPE, "diameter": 0.1, "length": 40.0, "elements": 20},
    "waves": {"amplitude": 1.0, "period": 8.0, "wavelength": 100.0, "stretching": "none"},
    "time": {"end": 1.0, "step": 1.0},
}
IN_WAVES["cable"] |= {"anchor": [0.0, 0.0, -45.0], "to": [0.0, 0.0, -4.6]}


@pytest.mark.parametrize("place", ["cable.", "material.NAME.", "cable.segments."])
@shows(*(f"{place}tangential_froude_krylov" for place in PLACES))
def test_pressure_of_waves_along_a_line(place):
    def push(word):
        name, line = "tangential_froude_krylov", IN_WAVES["cable"]
        if place == "cable.":
            scene = changed(IN_WAVES, {f"cable.{name}": word})
        elif place == "material.NAME.":
            scene = changed(IN_WAVES, {"cable.material": "rope", "material": {"rope": {name: word}}})
        else:
            segment = {k: line[k] for k in ROPE} | {"material": "rope", name: word}
            ends = {k: line[k] for k in ("anchor", "to")}
            scene = IN_WAVES | {"cable": {"segments": [segment], **ends}, "material": {"rope": {name: not word}}}
        run = simulate(scene)
        return -(run.anchor_force + run.end_tension).values[-1, 0, 2]

    k, omega = 2 * math.pi / 100.0, 2 * math.pi / 8.0
    rise = (math.cosh(k * 45.4) - math.cosh(k * 5.0)) / k / math.sinh(k * 50.0)
    pressure = -1000.0 * math.pi / 4 * 0.1**2 * omega**2 * rise * math.cos(omega)
    assert push(True) - push(False) == pytest.approx(pressure, rel=2e-3)


# -- time --------------------------------------------------------------------------------------------------------------

SWUNG = changed(DRIVEN, {"cable.top": {"kind": "prescribed", "position": [12.0, 0.0, -8.0], **MOVED, "ramp": 0.4}})


@shows("time.end", "time.step", "time.output_every")
def test_instants_of_a_run():
    run = simulate(changed(SWUNG, {"time": {"end": 0.9, "step": 0.3, "output_every": 0.45}}))
    assert run.time.values == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert run.frame.values == pytest.approx([0.0, 0.6, 0.9])


@shows("time.scheme", "time.spectral_radius")
def test_schemes_differ_by_their_error():
    schemes = ("backward-euler", {}), ("bdf2", {}), ("generalized-alpha", {}), ("generalized-alpha", {"radius": 0.1})
    found = []
    for scheme, more in schemes:
        time = {"end": 0.8, "step": 0.05, "scheme": scheme} | {"spectral_" + k: v for k, v in more.items()}
        found.append(float(simulate(changed(SWUNG, {"time": time})).tension_top[-1, 0]))
    assert len({round(value, 6) for value in found}) == 4
    assert max(found) - min(found) < 0.2 * max(found)


@shows("uncertain")
def test_uncertain():
    """Twice the sigma of a number is twice that of what it moves."""
    scene = changed(DRIVEN, {"cable.top": {"kind": "prescribed", "position": PLACE.tolist(), **MOVED}})
    first, second = (
        uncertainty(scene | {"uncertain": {"cable.line_density": sigma}}, of=["tension_top.mean"])
        for sigma in ("1%", "2%")
    )
    assert float(second.sigma[0]) == pytest.approx(2 * float(first.sigma[0]), rel=1e-6)


@shows("design.vary", "design.least", "design.hold", "design.case")
def test_design():
    """Bounds, the least of an expression, a limit, and a load case in which it is reached first."""
    line = {"length": 10.0, "line_density": 3.0, "axial_stiffness": 1e7, "elements": 2}
    scene = {
        "cable": [line | {"name": "line", "from": "weight", "to": [0.0, 0.0, 0.0]}],
        "joint": [{"name": "weight", "mass": 30.0, "volume": 0.0}],
        "time": {"end": 0.4, "step": 0.1},
    }
    section = {"vary": {"cable.line_density": [2.0, 9.0]}, "least": "cable.line_density"}
    hold = ["tension_top.mean < 700"]
    cases = {
        "bound": (section, 2.0),
        "other bound": (section | {"vary": {"cable.line_density": [2.5, 9.0]}}, 2.5),
        "most": (section | {"least": "-cable.line_density"}, 9.0),
        "limit": (section | {"least": "-cable.line_density", "hold": hold}, (700 / 9.81 - 30) / 10),
        "case": (
            section | {"least": "-cable.line_density", "hold": hold, "case": ["gravity=9.81", "gravity=12"]},
            (700 / 12 - 30) / 10,
        ),
    }
    for name, (one, expected) in cases.items():
        assert float(design(scene | {"design": one}).dataset.value[0]) == pytest.approx(expected, rel=1e-4), name


@shows("accuracy.estimate", "accuracy.target", "accuracy.of", "accuracy.rounds")
def test_accuracy():
    """Bars or none; finer steps for a smaller target, other ones for another output, the first for one round."""
    scene = changed(DRIVEN, {"cable.top": {"kind": "prescribed", "position": PLACE.tolist(), **MOVED}, "time.end": 2.0})
    assert "bar" not in simulate(scene, accuracy__estimate="none")
    assert "bar" in simulate(scene, accuracy__estimate="companion")
    steps = {
        name: simulate(scene, **changes).sizes["time"]
        for name, changes in {
            "coarse": {"accuracy__target": 0.1},
            "fine": {"accuracy__target": 1e-5},
            "mean": {"accuracy__target": 1e-5, "accuracy__of": ["tension_top.mean"]},
        }.items()
    }
    assert steps["coarse"] < steps["fine"] < steps["mean"]
    with pytest.raises(NotAccurate) as error:
        simulate(scene, accuracy__target=1e-5, accuracy__rounds=1)
    assert error.value.record.sizes["time"] == steps["coarse"]
