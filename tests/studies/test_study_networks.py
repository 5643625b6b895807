"""Studies of networks: elements and steps of all lines, effects omitted in all of them, sweeps over one of them.

Source: an independent finer run; the scene with the key removed by hand; single runs.
"""

import numpy as np
import pytest
from alone import simulate
from verification import endurance, explicit_limit, regularisation, touchdown

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model import effects as declared
from dolfbuoy.results import measured as acc
from dolfbuoy.results.compare import Reference
from dolfbuoy.results.sample import numbers_of
from dolfbuoy.results.sweep_figure import draw
from dolfbuoy.scene import settings
from dolfbuoy.scene.settings import Space, Stepping
from dolfbuoy.studies.accuracy import advise as advice
from dolfbuoy.studies.accuracy import work_precision
from dolfbuoy.studies.physics import effects, energy, hull
from dolfbuoy.studies.study import run
from dolfbuoy.studies.sweep import sweep

ROPE = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "added_mass": 0.9, "normal_drag": 1.1}
MOVED = {"position": [22.0, 3.0, -2.0], "amplitude": [0.3, 0.2, 0.5], "period": 3.0, "ramp": 2.0}
BRIDLE = {
    "sea": {"depth": 30.0},
    "current": {"speed": 0.6},
    "time": {"end": 8.0, "step": 0.02, "scheme": "bdf2"},
    "material": {"rope": ROPE, "heavy": ROPE | {"line_density": 20.0, "tangential_drag": 0.1}},
    "joint": [
        {"name": "Y", "mass": 100.0, "volume": 0.05, "drag_area": 0.5, "added_mass": 0.5},
        {"name": "rail", **MOVED},
    ],
    "cable": [
        {"name": "main", "material": "rope", "from": [0.0, 0.0, -30.0], "to": "Y", "segments": [
            {"length": 12.0, "elements": 6, "material": "heavy", "body": {"mass": 20.0, "drag_area": 0.1}},
            {"length": 11.0, "elements": [[5.0, 2], [6.0, 4]], "normal_drag": 1.5},
        ]},
        {"name": "port", "material": "rope", "from": "Y", "to": "rail", "length": 17.0, "elements": 6},
        {"name": "starboard", "material": "rope", "from": [22.0, -4.0, -2.0], "to": "Y", "length": 17.0, "elements": 6},
    ],
}  # fmt: skip


def elements(scene):
    return [piece.section.elements for piece in scene.network.pieces]


def test_lines_that_go_slack_take_the_one_generalized_alpha_that_they_may_have():
    """So that `advise` and `study work-precision` can try all schemes; back in another one nothing of it is left."""
    slack = load_scene("navigation-buoy")
    found = settings.with_settings(slack, settings.space_of(slack), Stepping("generalized-alpha", 0.1))
    assert (found.time.scheme, found.time.spectral_radius) == ("generalized-alpha", 0.0)
    back = settings.with_settings(found, settings.space_of(slack), settings.stepping_of(slack))
    assert back.to_dict() == slack.to_dict()


def test_settings_reach_every_line():
    """Each keeps its share of the elements; the pair and the steps are those of all."""
    scene = load_scene(BRIDLE)
    assert settings.space_of(scene) == Space(1, 0, 24)
    double = settings.with_settings(scene, Space(2, 1, 48), Stepping("generalized-alpha", 0.1))
    assert settings.space_of(double) == Space(2, 1, 48)
    assert elements(double) == [12, [(5.0, 4), (6.0, 8)], 12, 12]
    assert settings.stepping_of(double) == Stepping("generalized-alpha", 0.1)
    back = settings.with_settings(double, Space(1, 0, 24), settings.stepping_of(scene))
    assert elements(back) == elements(scene)
    for cable in ([{**BRIDLE["cable"][0], "to": [20.0, 0.0, -3.0]}], {**BRIDLE["cable"][0], "to": [20.0, 0.0, -3.0]}):
        alone = {name: section for name, section in BRIDLE.items() if name != "joint"}
        one = settings.with_settings(load_scene(alone | {"cable": cable}), Space(3, 2, 6), Stepping("bdf2", 0.1))
        assert elements(one) == [3, [(5.0, 1), (6.0, 2)]]


def test_numbers_of_elements_that_lines_can_share():
    """Near the number asked for, the same when asked for again, and never less than one for each part."""
    scene = load_scene(BRIDLE)
    for cells in range(1, 80):
        found = settings.fitting(scene, Space(2, 1, cells))
        assert abs(found.cells - max(cells, 5)) <= 4
        assert settings.fitting(scene, found) == found
        assert settings.space_of(settings.with_settings(scene, found, Stepping("bdf2", 0.1))) == found
    assert [settings.fitting(load_scene("short"), Space(1, 0, n)).cells for n in range(1, 60)] == list(range(1, 60))


def test_advice_keeps_its_promise():
    """2 % in the tensions at the upper ends, against an independent finer run of another pair and scheme."""
    found = advice.advise(load_scene(BRIDLE), "tension_top", 0.02, lambda text: None)
    assert found.measured <= 0.02
    start = acc.window_start(found.scene)
    mine = acc.compute(found.scene, ["tension_top"])
    fine = settings.with_settings(found.scene, Space(2, 1, 96), Stepping("bdf2", (8.0 - start) / mine.steps / 6))
    assert Reference(acc.compute(fine, ["tension_top"]), start).error(mine, "tension_top").rms <= 0.02
    assert settings.space_of(found.scene) == found.choice.space


def test_work_precision(tmp_path):
    """Cases of lines that share the elements; the finer is the better."""
    scene = load_scene(BRIDLE, time__end=4.0)
    options = {"pairs": [(1, 0)], "cells": [6, 24], "schemes": ["bdf2"], "steps": [0.1], "repeats": 1}
    rows = run(work_precision.study, tmp_path, scene=scene, **options).rows["work-precision"]
    errors = {row["cells"]: row["error_tension_top"] for row in rows if not row["own"]}
    assert list(errors) == [settings.fitting(scene, Space(1, 0, 6)).cells, 24]
    assert 0 < errors[24] < 0.5 * errors[min(errors)]
    assert [row["cells"] for row in rows if row["own"]] == [24]


SAME = {"strain": "element-average", "slack": "tension-only"}
HULL = {"hull": [[0.0, 1.0], [1.2, 1.0]], "mass": 300.0, "center_of_mass": 0.4, "added_mass": 0.5, "normal_drag": 0.9}
HULL |= {"axial_added_mass": 0.6, "axial_drag": 0.8, "rotational_damping": 5.0, "rotational_added_mass": 0.4}


def everything():
    """A network that calls for every effect somewhere: lines, segments, materials, bodies, buoys, their own wind."""
    scene = load_scene(BRIDLE).to_dict()
    scene["material"]["heavy"] |= {"damping": 10.0, "tangential_froude_krylov": False}
    for cable in scene["cable"]:
        cable |= SAME
    main, port, _ = scene["cable"]
    main["segments"][1] |= {"marine_growth": [[-20.0, 1.1, 1.1]], "axial_stiffness": 2e6, "fails_at": {"time": 50.0}}
    port |= {"fails_at": {"tension": 1e6}, "to": "wide.side", "axial_stiffness": float("inf")}
    slim = {**HULL, "name": "slim", "wind": {"speed_10m": 9.0, "area": 1.0, "height": 1.0}, "disk_averages": True}
    wide = {**HULL, "name": "wide", "wave_damping": [50.0, 5.0], "external_force": {"force": [90.0, 0.0, 0.0]}}
    scene["joint"] = scene["joint"][:1]
    scene["buoy"] = [slim, wide | {"fairleads": {"side": [0.5, 0.0, 0.6]}}]
    scene["cable"].append({"name": "leg", "material": "rope", "from": [5.0, 9.0, -30.0], "to": "slim", "length": 34.0})
    scene["cable"][-1] |= SAME
    scene["cable"][2] |= {"slack": "compressive", "bending_stiffness": 50.0, "minimum_bend_radius": 1.0}
    scene["cable"][2]["from_end"] = {"direction": [1.0, 0.0, -1.0]}
    scene["waves"] = {"spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5.0, "spreading": 9.0}
    return load_scene(scene | {"seabed": {"friction": 0.5}})


#: What cannot be left out, because nothing would remain, or goes with what is left out.
ALWAYS = {"inextensible cable", "buoy", "hydrostatics"}
GO_WITH = {"waves": {"cable tangential Froude-Krylov", "disk averages", "wave spreading"}, "sea bed": {"bed friction"}}


#: What no line or buoy of that scene has, and tests of their own leave out.
ELSEWHERE = ("take_off.", "buoy.potential_flow", "buoy.drift", "cable.winch", "cable.tangential_added_mass")
ELSEWHERE += ("cable.bending_damping",)
REMOVABLE = [e.name for e in declared.EFFECTS if e.removable and not e.key.startswith(ELSEWHERE)]


@pytest.mark.parametrize("name", REMOVABLE)
def test_every_effect_can_be_left_out(name):
    """Of every line, segment, material, body and buoy that has it, and of nothing else."""
    scene = everything()
    called = set(declared.names(scene)) - ALWAYS
    assert called == set(REMOVABLE)
    if name == "elastic cable":  # a strain is what the damping of another material needs
        scene = effects.variant(scene, ["cable damping"])
        called -= {"cable damping"}
    left = set(declared.names(effects.variant(scene, [name]))) - ALWAYS
    assert left == called - {name} - GO_WITH.get(name, set())
    assert set(declared.names(effects.variant(scene, only=[]))) == ALWAYS


@pytest.mark.parametrize(
    ("study", "options"),
    [
        (explicit_limit.cable_of, ()),
        (regularisation.request, (1.0,)),
        (endurance.request, (1.0, 0.1, "bdf2", 1e-9)),
        (hull.request, ("none", None, None)),
        (touchdown.request, (1.0,)),
    ],
)
def test_studies_of_one_line_say_so(study, options):
    """In a sentence, before anything is computed."""
    with pytest.raises(InputError, match=r"is a network|and one cable"):
        study("lazy-wave", *options)


def test_what_is_left_out_is_what_hands_take_out():
    """The drag of all lines, and of both bodies; bit for bit."""
    scene = load_scene(BRIDLE, time__end=0.3)
    by_hand = scene.to_dict()
    for material in by_hand["material"].values():
        del material["normal_drag"]
    del by_hand["cable"][0]["segments"][1]["normal_drag"]
    bodies = scene.to_dict()
    bodies["joint"][0]["drag_area"] = bodies["cable"][0]["segments"][0]["body"]["drag_area"] = 0.0
    full = simulate(scene)
    for name, other in (("cable normal drag", by_hand), ("body drag", bodies)):
        without, hands = simulate(effects.variant(scene, [name])), simulate(other)
        for series in ("cable_position", "cable_tension", "joint_position"):
            assert np.array_equal(without[series], hands[series]), (name, series)
        assert np.abs(without.cable_tension - full.cable_tension).max() > 0.1


def test_effects(tmp_path):
    """The table of a network: what its lines and bodies are worth."""
    scene = load_scene(BRIDLE, time__end=3.0, time__step=0.05)
    scene = effects.variant(scene, only=["cable normal drag", "body drag"])
    rows = run(effects.study, tmp_path, scene=scene, threshold=0.01).rows["effects"]
    removed = {row["effect"]: row for row in rows if row["mode"] == "without"}
    assert list(removed) == ["cable normal drag", "body drag"]
    assert removed["cable normal drag"]["change_tension_top"] > 2 * removed["body drag"]["change_tension_top"] > 0
    assert all(row["operations"] < row["base_operations"] for row in removed.values())


def test_a_sweep_over_one_line_of_a_network(tmp_path):
    """Statistics of every cable and joint, as those of single runs."""
    scene = load_scene(BRIDLE, time__end=0.6)
    found = sweep(scene, ["cable.port.length=17.0,17.5", "joint.Y.mass=100.0,150.0"], None, tmp_path)
    assert found.status.values.tolist() == 4 * ["done"]
    for k in (0, 3):
        case = {"cable.port.length": found.cable_port_length[k].item(), "joint.Y.mass": found.joint_Y_mass[k].item()}
        one = numbers_of(dolfbuoy.simulate(load_scene(scene, **case)))
        for name, of in (("tension_top", "port"), ("tension_anchor", "main"), ("joint_position_z", "Y")):
            largest = found[f"{name}_maximum"].sel({"joint" if of == "Y" else "cable": of})
            assert float(largest[k]) == one[f"{name} of {of}"]["maximum"]
    assert len(set(found.tension_top_maximum.sel(cable="port").values)) == 4
    labels = [axes.get_ylabel() for axes in draw(found).axes]
    assert labels == [
        f"tension {end} of {cable} [kN]" for end in ("top", "anchor") for cable in ("main", "port", "starboard")
    ]


def test_energy(tmp_path):
    """The defect falls with the order of the scheme; lines of any degree are measured with one tension an element."""
    scene = load_scene(BRIDLE, **{f"cable.{name}.position_degree": 2 for name in ("main", "port", "starboard")})
    assert settings.space_of(energy.load(scene, 1.0, 0.1, "bdf2")) == Space(1, 0, 24)
    rows = [energy.evaluate({"scene": BRIDLE, "t_end": 1.0, "step": h, "scheme": "bdf2"}) for h in (0.04, 0.02)]
    assert 1.7 < np.log2(rows[0]["defect"] / rows[1]["defect"]) < 2.3
    assert abs(rows[1]["defect"]) < 0.02 * abs(rows[1]["drag"])


def test_energy_where_nothing_is_drained(tmp_path):
    """A chain swings in nothing: its defect is related to the rises and falls of its kinetic energy."""
    scene = tmp_path / "swing.toml"
    scene.write_text(
        '[cable]\nlength = 10.0\nline_density = 5.0\naxial_stiffness = 1e5\nelements = 3\ntop.kind = "prescribed"\n'
        "top.position = [6.0, 0.0, 0.0]\ntop.amplitude = [0.5, 0.0, 0.5]\ntop.period = 2.0\ntop.ramp = 0.5\n"
    )
    (table,) = energy.study(tmp_path, str(scene), 0.8, [0.02, 0.01])
    assert table.columns["relative"] == "defect/swings of kinetic energy"
    assert "drag" not in table.columns
    for row in table.rows:
        assert 0 < row["relative"] < 0.2
    assert [row["order"] > 0.7 for row in table.rows if row["order"] is not None] == 3 * [True]
    scene.write_text(scene.read_text().replace("[0.5, 0.0, 0.5]", "[0.0, 0.0, 0.0]"))
    with pytest.raises(InputError, match="nothing moves"):
        energy.study(tmp_path / "still", str(scene), 0.8, [0.02])
