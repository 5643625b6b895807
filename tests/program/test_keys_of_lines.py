"""Every key of a line, material, joint or end changes the number it should, by the right amount.

Source: global balances (an end carries the weight and loads of the line), Hooke's law, taut strings, paths of driven
ends.  A key of a segment overrides the same key of its material.
"""

import math

import numpy as np
import pytest
from every_key import cases, changed, shows

from dolfbuoy import modes, simulate, solve_static

G, RHO, PULL = 10.0, 1000.0, 4000.0
LINE = {
    "gravity": G,
    "sea": {"depth": 50.0, "density": RHO},
    "cable": {
        "length": 40.0,
        "line_density": 5.0,
        "diameter": 0.05,
        "axial_stiffness": 1e6,
        "elements": 4,
        "top": {"kind": "free", "force": [0.0, 0.0, PULL]},
    },
}
PIECE = {key: LINE["cable"][key] for key in ("line_density", "diameter", "axial_stiffness")}
#: The same line three times: with keys of its own, of a material, of a segment over those of a material.
OF_MATERIAL = changed(
    LINE, {"cable": {**dict.fromkeys(PIECE), "material": "rope"}, "material": {"rope": {**PIECE, "source": "a test"}}}
)
WRONG = {"line_density": 50.0, "diameter": 0.3, "area": 0.1, "axial_stiffness": 3e4, "breaking_load": 1.0}
OF_SEGMENT = {
    **{key: LINE[key] for key in ("gravity", "sea")},
    "cable": {
        "segments": [{**PIECE, "area": math.pi / 4 * 0.05**2, "length": 40.0, "elements": 4, "material": "rope"}],
        "top": LINE["cable"]["top"],
    },
    "material": {"rope": WRONG},
}
SPELLINGS = {"cable.": LINE, "material.NAME.": OF_MATERIAL, "cable.segments.": OF_SEGMENT}
PHYSICAL = {
    "line_density": 7.0,
    "diameter": 0.06,
    "area": 0.004,
    "axial_stiffness": 4e5,
    "marine_growth": [[-60.0, 1.2, 1.5], [0.0, 1.2, 1.5]],
}


def placed(key, value):
    """The scene whose line has a key where the key's dotted name says."""
    prefix = key[: key.rindex(".") + 1] if key[: key.rindex(".") + 1] in SPELLINGS else "cable."
    name = key.removeprefix(prefix)
    place = {"material.NAME.": "material.rope.", "cable.segments.": "cable.segments.0."}.get(prefix, prefix)
    scene = changed(SPELLINGS[prefix], {place + name: value})
    if prefix == "cable.segments." and name == "diameter":
        scene = changed(scene, {"cable.segments.0.area": math.pi / 4 * value**2})
    return scene


def numbers(**line):
    """Pull at the anchor [N] and height of the top [m] of the vertical line, from its weight and Hooke's law."""
    c = {"gravity": G, "density": RHO, "length": 40.0, **PIECE, "pull": PULL, "grown": (1.0, 1.0)} | line
    area = c.get("area", math.pi / 4 * c["diameter"] ** 2) * c["grown"][0] ** 2
    w = (c["line_density"] * c["grown"][1] - c["density"] * area) * c["gravity"]
    L = c["length"]
    return c["pull"] - w * L, -50.0 + L + (c["pull"] * L - w * L**2 / 2) / c["axial_stiffness"]


def found(scene):
    """The same two numbers of a solved scene."""
    rest = solve_static(scene)
    return -rest.anchor_force.values[0, 2], rest.cable_position.values[-1, 2]


@pytest.mark.parametrize(("key", "value"), cases(PHYSICAL, SPELLINGS))
def test_weight_and_stretch_of_a_line(key, value):
    name = key.rpartition(".")[2]
    given = {"grown": (1.2, 1.5)} if name == "marine_growth" else {name: value}
    assert found(placed(key, value)) == pytest.approx(numbers(**given), rel=1e-9)


@pytest.mark.parametrize("scene", SPELLINGS.values(), ids=SPELLINGS)
@shows("cable.material", "cable.segments", "cable.segments.material")
def test_a_line_a_material_and_a_segment_give_one_line(scene):
    assert found(scene) == pytest.approx(numbers(), rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "name"),
    [
        ("gravity", 5.0, "gravity"),
        ("sea.density", 500.0, "density"),
        ("cable.length", 30.0, "length"),
        ("cable.top.force", [0.0, 0.0, 6000.0], "pull"),
    ],
)
@shows("gravity", "sea.density", "cable.length", "cable.top.force", "cable.top.kind")
def test_loads_of_a_line(key, value, name):
    expected = numbers(**{name: value[2] if isinstance(value, list) else value})
    assert found(changed(LINE, {key: value})) == pytest.approx(expected, rel=1e-9)


@shows("cable.segments.length")
def test_the_length_of_a_segment():
    scene = changed(OF_SEGMENT, {"cable.segments.0.length": 30.0})
    assert found(scene) == pytest.approx(numbers(length=30.0), rel=1e-9)


@shows("cable.segments.body.mass", "cable.segments.body.volume")
@pytest.mark.parametrize(("body", "load"), [({"mass": 30.0}, 300.0), ({"volume": 0.02}, -200.0)])
def test_a_clump_and_a_float_on_a_line(body, load):
    half = {**OF_SEGMENT["cable"]["segments"][0], "length": 20.0, "elements": 2}
    scene = changed(OF_SEGMENT, {"cable.segments": [{**half, "body": body}, half]})
    assert found(scene)[0] == pytest.approx(numbers()[0] - load, rel=1e-9)


# -- places ------------------------------------------------------------------------------------------------------------


@shows("sea.depth", "cable.anchor", "cable.from", "cable.to", "cable.top.position")
@pytest.mark.parametrize(
    ("changes", "end", "place"),
    [
        ({"sea.depth": 60.0}, 0, [0.0, 0.0, -60.0]),
        ({"cable.anchor": [1.0, 2.0, -30.0]}, 0, [1.0, 2.0, -30.0]),
        ({"cable.from": [1.0, 2.0, -30.0]}, 0, [1.0, 2.0, -30.0]),
        ({"cable.top": None, "cable.to": [3.0, 4.0, -15.0]}, -1, [3.0, 4.0, -15.0]),
        ({"cable.top": {"kind": "fixed", "position": [3.0, 4.0, -15.0], "force": None}}, -1, [3.0, 4.0, -15.0]),
    ],
)
def test_where_a_line_ends(changes, end, place):
    rest = solve_static(changed(LINE, changes))
    assert rest.cable_position.values[end] == pytest.approx(place, rel=1e-12)


@shows("cable.name")
def test_a_line_is_called_by_its_name():
    rest = solve_static(changed(LINE, {"cable.name": "tether"}))
    assert rest.cable.values.tolist() == ["tether"]


# -- elements ----------------------------------------------------------------------------------------------------------


@shows("cable.elements", "cable.segments.elements", "cable.position_degree", "cable.tension_degree")
@pytest.mark.parametrize(
    ("elements", "mu", "nu", "segments"), [(8, 1, 0, False), (4, 2, 0, False), (4, 2, 1, False), (8, 1, 0, True)]
)
def test_unknowns_of_element_pairs(elements, mu, nu, segments):
    changes = {"cable.position_degree": mu, "cable.tension_degree": nu}
    changes[f"cable.{'segments.0.' if segments else ''}elements"] = elements
    rest = solve_static(changed(OF_SEGMENT if segments else LINE, changes))
    assert rest.attrs["unknowns"] == elements * (3 * mu + nu + 1)
    assert found(changed(LINE, changes if not segments else {}))[0] == pytest.approx(numbers()[0], rel=1e-9)


@shows("cable.grading", "cable.segments.grading")
@pytest.mark.parametrize(("scene", "key"), [(LINE, "cable.grading"), (OF_SEGMENT, "cable.segments.0.grading")])
def test_the_last_element_over_the_first(scene, key):
    sizes = np.diff(solve_static(changed(scene, {key: 5.0})).s)
    assert sizes[-1] / sizes[0] == pytest.approx(5.0, rel=1e-12)


SAG = changed(LINE, {"cable.position_degree": 2, "cable.top": None, "cable.to": [30.0, 0.0, -30.0]})


@shows("cable.strain", "cable.strain_form")
@pytest.mark.parametrize("key", ["cable.strain", "cable.strain_form"])
def test_forms_of_the_strain_differ_by_their_error_only(key):
    other = {"cable.strain": "element-average", "cable.strain_form": "energy"}[key]
    one, two = (
        solve_static(changed(SAG, {"cable.tension_degree": 1, "cable.axial_stiffness": 2e4, **changes}))
        for changes in ({}, {key: other})
    )
    difference = float(abs(two.cable_tension - one.cable_tension).max() / one.cable_tension.max())
    assert 1e-9 < difference < 2e-3


@shows("cable.slack")
def test_a_line_pushed_together_carries_compression_or_none():
    bar = {"gravity": 0.0, "cable": {"length": 1.0, "line_density": 1.0, "axial_stiffness": 1e3, "elements": 2}}
    bar["cable"] |= {"anchor": [0.0, 0.0, 0.0], "to": [0.9, 0.0, 0.0]}
    bar |= {"initial": {"kind": "straight"}, "time": {"end": 0.01, "step": 0.01}}
    laws = "compressive", "tension-only"
    tension = [simulate(changed(bar, {"cable.slack": law})).cable_tension.values[0, 0] for law in laws]
    assert tension == pytest.approx([-100.0, 0.0], abs=1e-5)


# -- water -------------------------------------------------------------------------------------------------------------

STIFF = changed(LINE, {"cable.axial_stiffness": 1e13, "cable.top.force": [0.0, 0.0, 1e9]})
LEVEL = {
    "gravity": 0.0,
    "sea": LINE["sea"],
    "cable": {**PIECE, "elements": 4, "length": 40.0, "anchor": [0.0, 0.0, -20.0], "to": [40.4, 0.0, -20.0]},
}


def along_current(scene):
    """What the water pushes a line along x and y [N]."""
    rest = solve_static(scene)
    return -(rest.anchor_force + rest.end_tension).values[0, :2]


@shows("cable.normal_drag", "current.speed", "current.direction_deg", "current.profile", "current.exponent")
@pytest.mark.parametrize(
    ("current", "squared"),
    [
        ({"speed": 1.0}, 1.0),
        ({"speed": 2.0, "direction_deg": 30.0}, 4.0),
        ({"speed": 2.0, "profile": "power"}, 4.0 * 0.8 ** (2 / 7) / (2 / 7 + 1)),
        ({"speed": 2.0, "profile": "power", "exponent": 0.5}, 4.0 * 0.8 / 2),
        ({"profile": [[-50.0, 1.0], [-30.0, 1.0], [-29.9, 3.0], [0.0, 3.0]]}, (20 * 1.0 + 20 * 9.0) / 40),
    ],
)
def test_drag_across_a_line(current, squared):
    scene = changed(STIFF, {"cable.normal_drag": 1.5, "cable.elements": 40, "current": current})
    size, angle = 0.5 * RHO * 1.5 * 0.05 * squared * 40.0, math.radians(current.get("direction_deg", 0.0))
    force = -solve_static(scene).anchor_force.values[0, :2]
    assert -force == pytest.approx([-size * math.cos(angle), -size * math.sin(angle)], rel=6e-3, abs=1e-3)


@pytest.mark.parametrize(("key", "value"), cases({"normal_drag": 1.5, "tangential_drag": 0.2}, SPELLINGS))
def test_drag_coefficients_wherever_they_stand(key, value):
    way = [0.0, 40.4, 0.0] if key.endswith("normal_drag") else [40.4, 0.0, 0.0]  # across the current, or along it
    place = {"cable.anchor": [0.0, 0.0, -20.0], "cable.to": [way[0], way[1], -20.0], "cable.top": None}
    scene = changed(placed(key, value), {"current": {"speed": 0.1}, "gravity": 0.0, **place})
    assert along_current(scene)[0] == pytest.approx(0.5 * RHO * value * 0.05 * 0.01 * 40.4, rel=1e-4)


# -- inertia and damping: a taut line in still water -------------------------------------------------------------------

TAUT = {"gravity": 0.0, "cable.top": None, "cable.anchor": [0.0, 0.0, -45.0], "cable.to": [0.0, 0.0, -4.6]}


def taut(scene, **more):
    return changed(scene, {**TAUT, **more})


@pytest.mark.parametrize(("key", "value"), cases({"added_mass": 0.7}, SPELLINGS))
def test_added_mass_slows_a_taut_line(key, value):
    without, with_it = (modes(taut(scene), number=1) for scene in (SPELLINGS["cable."], placed(key, value)))
    added = RHO * math.pi / 4 * 0.05**2 * value
    assert (without.omega / with_it.omega).values[0] ** 2 == pytest.approx(1 + 1.01 * added / 5.0, rel=1e-6)


@pytest.mark.parametrize(("key", "value"), cases({"tangential_added_mass": 0.6}, SPELLINGS))
def test_tangential_added_mass_slows_a_stretching_line(key, value):
    """By the water that it takes along; what moves across feels nothing of it."""
    heavy = {**TAUT, "cable.to": [0.0, 0.0, -5.0 + 1e-4]}
    scenes = (changed(scene, heavy) for scene in (SPELLINGS["cable."], placed(key, value)))
    without, with_it = (modes(scene, number=9).set_index(mode="name") for scene in scenes)
    added = RHO * math.pi / 4 * 0.05**2 * value
    for mode, mass in (("cable axial 1", 5.0 + added), ("cable transverse 1", 5.0)):
        slower = (without.sel(mode=mode).omega / with_it.sel(mode=mode).omega).values.ravel()[0]
        assert slower**2 == pytest.approx(mass / 5.0, rel=1e-5)


@pytest.mark.parametrize(("key", "value"), cases({"damping": 300.0}, SPELLINGS))
def test_damping_of_a_stretching_line(key, value):
    heavy = {
        **TAUT,
        "cable.to": [0.0, 0.0, -5.0 + 1e-4],
    }  # hardly taut: the slow modes are across, then come those along
    found = modes(changed(placed(key, value), heavy), number=9).set_index(mode="name").sel(mode="cable axial 1")
    assert float(found.damping_ratio) == pytest.approx(value / 1e6 * float(found.omega) / 2, rel=1e-5)


# -- bending -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", SPELLINGS)
@shows(*(f"{prefix}{name}" for prefix in SPELLINGS for name in ("bending_stiffness", "minimum_bend_radius")))
@shows("cable.from_end.direction", "cable.from_end.rotational_stiffness")
@shows("cable.to_end.direction", "cable.to_end.rotational_stiffness")
def test_bending_at_a_clamp(prefix):
    """2 sqrt(EI T) sin of half the angle to the pull; a spring has k sin of the rest of it, at either end."""
    size = "cable.segments.0.elements" if prefix == "cable.segments." else "cable.elements"
    scene = changed(placed(f"{prefix}bending_stiffness", 1e4), {size: 200})
    radius = {"material.NAME.": "material.rope.", "cable.segments.": "cable.segments.0."}.get(prefix, prefix)
    scene = changed(scene, {f"{radius}minimum_bend_radius": 3.0})
    for end, force, moment in (("from_end", "anchor_force", "anchor_moment"), ("to_end", "end_tension", "end_moment")):
        rest = solve_static(changed(scene, {f"cable.{end}": {"direction": [1.0, 0.0, 1.0]}}))
        T = np.linalg.norm(rest[force].values)
        expected = 2 * math.sqrt(1e4 * T) * math.sin(math.pi / 8)
        assert rest[moment].item() == pytest.approx(expected, rel=0.02)
        assert rest.bend_utilisation.item() == pytest.approx(3.0 * expected / 1e4, rel=0.02)
        spring = {"direction": [1.0, 0.0, 1.0], "rotational_stiffness": 1e3}
        m = solve_static(changed(scene, {f"cable.{end}": spring}))[moment].item()
        left = math.pi / 4 - math.asin(m / 1e3)
        assert m == pytest.approx(2 * math.sqrt(1e4 * T) * math.sin(left / 2), rel=0.03)


@pytest.mark.parametrize(("key", "value"), cases({"bending_damping": 0.1}, SPELLINGS))
def test_bending_damping(key, value):
    """A part beta omega/2 of what EI has in the stiffness of a taut line: EI k^2/(EI k^2 + T)."""
    stiffness = changed(placed(key.replace("damping", "stiffness"), 1e4), {"sea": None, "gravity": 0.0})
    scene = changed(stiffness, {key.replace("NAME", "rope").replace("segments", "segments.0"): value})
    found = modes(scene, 4)
    k = np.array([0.5, 0.5, 1.5, 1.5]) * math.pi / 40  # its upper end is free
    share = 1e4 * k**2 / (1e4 * k**2 + PULL)
    assert found.damping_ratio.values / found.omega.values == pytest.approx(share * value / 2, rel=0.2)


@shows("joint.weld")
def test_a_weld_carries_a_moment():
    """A beam of two pieces, clamped at one end, is a cantilever with a weld, a shorter one with a load without it."""
    half = {"length": 5.0, "line_density": 1.0, "bending_stiffness": 1e4, "elements": 10}
    low = half | {"name": "low", "from": [0.0, 0.0, 0.0], "to": "middle", "from_end": {"direction": [1.0, 0.0, 0.0]}}
    high = half | {"name": "high", "from": "middle", "top": {"kind": "free"}}
    rest = {
        weld: solve_static({"gravity": G, "cable": [low, high], "joint": [{"name": "middle", "weld": weld}]})
        for weld in (True, False)
    }
    drop = {weld: one.cable_position.values[-1, 2] for weld, one in rest.items()}
    assert drop[True] == pytest.approx(-G * 10.0**4 / 8 / 1e4, rel=0.02)
    assert drop[False] == pytest.approx(-5.0 - G * (5.0**4 / 8 + 5.0 * 5.0**3 / 3) / 1e4, rel=1e-3)


@shows("cable.from_end.motion", "cable.from_end.ramp", "cable.to_end.motion", "cable.to_end.ramp")
def test_a_direction_that_turns():
    """The first element of a stiff rod follows; with a ramp, by half at half of it."""
    rows = [[t, math.cos(0.1 * t), 0.0, math.sin(0.1 * t)] for t in (0.0, 1.0, 2.0)]
    rod = {"length": 4.0, "line_density": 1.0, "bending_stiffness": 1e3, "elements": 4, "position_degree": 2}
    rod |= {"tension_degree": 1, "axial_stiffness": 1e6}
    time = {"end": 2.0, "step": 0.05, "scheme": "backward-euler"}
    low = rod | {"anchor": [0.0, 0.0, 0.0], "top": {"kind": "free"}}
    high = rod | {"from": [-4.0, 0.0, 0.0], "top": {"kind": "fixed", "position": [0.0, 0.0, 0.0]}}
    for end, line in (("from_end", low), ("to_end", high)):
        for ramp, turned in ((0.0, 0.2), (4.0, 0.1)):
            scene = {"gravity": 0.0, "cable": line | {end: {"motion": rows, "ramp": ramp}}, "time": time}
            scene["initial"] = (
                {"kind": "straight"}
                if end == "to_end"
                else {
                    "kind": "polyline",
                    "points": [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]],
                }
            )
            r = (
                simulate(scene).cable_position.values[-1][:3]
                if end == "from_end"
                else (simulate(scene).cable_position.values[-1][-1:-4:-1])
            )
            way = (-3 * r[0] + 4 * r[1] - r[2]) * (1 if end == "from_end" else -1)
            assert math.atan2(way[2], way[0]) == pytest.approx(turned, abs=0.03)
