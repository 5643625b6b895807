"""Parts of the scene language, each alone: anchors, sinkers, criteria, materials, cases, elements and steps.

Source: the same numbers and sentences by hand; no scene is run.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from pydantic import ValidationError

from dolfbuoy import InputError, load_scene
from dolfbuoy.scene import anchors, bathymetry, fatigue, inputs, settings, variants, waves
from dolfbuoy.scene.criteria import Criteria, Limit
from dolfbuoy.scene.library import CHAIN_SIZES, MOST_LOAD, ROPE_SIZES, material, resized, size_of, sizes_made
from dolfbuoy.scene.take_off import TakeOff

LINE = {"length": 20.0, "line_density": 5.0, "axial_stiffness": 1e5, "elements": 4}


# -- networks ----------------------------------------------------------------------------------------------------------


def test_anchors_at_one_height_are_two_and_of_a_leg_the_lower_end():
    level = load_scene({"cable": LINE | {"from": [0, 0, -9.0], "to": [9, 0, -9.0]}})
    assert anchors.anchors_of(level.network) == {"cable.from": [(0, 0)], "cable.to": [(0, 1)]}
    leg = load_scene({"cable": LINE | {"from": [0, 0, -8.0], "to": [9, 0, -9.0]}})
    assert anchors.anchors_of(leg.network) == {"cable.to": [(0, 1)]}


@pytest.mark.parametrize(("off", "good"), [(0.99e-4, True), (1.01e-4, False), (-0.99e-4, True), (-1.01e-4, False)])
def test_a_sinker_lies_on_the_bed(off, good):
    """Within a ten thousandth of the depth; its mass and volume are those of its weight in water."""
    place = [10.0, 5.0, -50.0 + 0.1 * 10 - 0.2 * 5 + 50 * off]
    scene = {
        "gravity": 10.0,
        "sea": {"depth": 50.0, "density": 1000.0},
        "seabed": {"friction": 0.3, "slope": [0.1, -0.2]},
        "anchor": {"weight": 3e4, "friction": 0.7, "density": 2500.0, "drags": True},
        "cable": LINE | {"diameter": 0.05, "from": place, "to": [10.0, 5.0, -31.0]},
    }
    if not good:
        with pytest.raises(InputError, match=r"and cable.from is at z = [-.\d]+ m, the bed at -50\.$"):
            load_scene(scene)
        return
    body = load_scene(scene).network.bodies["cable.from"]
    assert (body.volume, body.mass, body.friction) == pytest.approx((2.0, 5000.0, 0.7), rel=1e-14)
    assert body.place == pytest.approx((10.0, 5.0, -50.0), abs=1e-12)
    with pytest.raises(InputError, match="must be above that of the water, 2500 kg"):
        load_scene(scene, sea__density=2500.0)


def test_a_sinker_on_a_grid_of_depths():
    grid = {"x": [0.0, 20.0], "y": [0.0, 10.0], "depth": [[50.0, 52.0], [54.0, 56.0]]}
    scene = {
        "sea": {"depth": 50.0},
        "seabed": {"friction": 0.3, "depths": grid},
        "anchor": {"weight": 3e4, "friction": 0.7, "drags": True},
        "cable": LINE | {"diameter": 0.05, "from": [10.0, 5.0, -53.0], "to": [10.0, 5.0, -34.0]},
    }
    assert load_scene(scene).network.bodies["cable.from"].place == pytest.approx((10.0, 5.0, -53.0), rel=1e-12)


def test_a_line_may_part_at_its_very_end():
    line = {"cable": LINE | {"from": [0, 0, 0], "to": [9, 0, 0], "fails_at": {"time": 1.0, "at": 20.0}}}
    assert load_scene(line).network.pieces[0].section.fails_at.at == 20.0
    with pytest.raises(InputError, match="must be on the cable, 0 to length = 20 m"):
        load_scene(line, cable__fails_at__at=20.001)


@pytest.mark.parametrize(
    ("cable", "said"),
    [
        ({"length": None}, "cable.length: must be given, unstretched length [m]."),
        (
            {"length": None, "elements": None, "line_density": None}
            | {"segments": [{"length": 9.0, "line_density": 1.0}, {"length": 9.0}]},
            "cable.segments.1.line_density: must be given, mass per unstretched length [kg/m].",
        ),
    ],
)
def test_what_a_line_lacks_is_said_with_its_place(cable, said):
    with pytest.raises(InputError) as error:
        load_scene({"cable": LINE | {"from": [0, 0, 0], "to": [9, 0, 0]} | cable})
    assert str(error.value) == said


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"gravity": 1.0}, "cable: must be given, or buoy: without them nothing would move."),
        (
            {"buoy": {"mass": 1.0, "center_of_mass": 1.0}},
            "buoy.inertia: must be given, a buoy without hull needs inertia and center_of_mass.",
        ),
        (
            {"buoy": {"mass": 1.0, "inertia": [1.0, 1.0]}},
            "buoy.center_of_mass: must be given, a buoy without hull needs inertia and center_of_mass.",
        ),
        (
            {"cable": LINE | {"from": [0, 0, 0], "top": {"kind": "free"}}, "initial": {"kind": "straight"}},
            "initial.kind = 'straight': needs cable.top.position, the end of the straight line.",
        ),
    ],
)
def test_what_a_scene_lacks(scene, said):
    with pytest.raises(InputError) as error:
        load_scene(scene)
    assert str(error.value) == said


def test_limits_of_outputs_are_read_as_they_are_written():
    given = ["tension_top.max[east] < 5e3", "offset.std >-2", "freeboard.min>0.5", " lean.mean [a b]"]
    assert Criteria(limits=given[:3]).parsed == [
        Limit("tension_top", "max", "east", "<", 5000.0),
        Limit("offset", "std", "", ">", -2.0),
        Limit("freeboard", "min", "", ">", 0.5),
    ]
    with pytest.raises(ValidationError, match=r"limits.1 = ' lean.mean \[a b\]': must be SERIES.max < NUMBER"):
        Criteria(limits=given[::3])


# -- materials ---------------------------------------------------------------------------------------------------------


def test_sizes_that_are_made():
    """Bars of chains by ISO 1704 and IACS UR W22, ropes by ISO 2307 and in steps of 8 mm above it."""
    bars = "11 12.5 14 16 17.5 19 20.5 22 24 26 28 30 32 34 36 38 40 42 44 46 48 50 52 54 56 58 60 62 64 66 68 70 "
    bars += "73 76 78 81 84 87 90 92 95 97 100 102 105 107 111 114 117 120 122 124 127 130 132 137 142 147 152 157 "
    bars += "162 165 168 171 175 178 180 185"
    ropes = "5 6 8 9 10 12 14 16 18 20 22 24 26 28 30 32 36 40 44 48 52 56 60 64 68 72 76 80 88 96 104 112 120 128 "
    ropes += "136 144 152 160 168 176 184 192 200 208 216 224 232 240 248"
    assert sizes_made("chain R3 studless 19 mm") == CHAIN_SIZES == tuple(map(float, bars.split()))
    assert sizes_made("nylon 24 mm") == ROPE_SIZES == tuple(map(float, ropes.split()))


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ("chain R3 studless 5 mm", "chain R3 studless 4.9 mm"),
        ("nylon 250 mm", "nylon 250.1 mm"),
        ("chain R3 studless 19 mm less 18.9 mm", "chain R3 studless 19 mm less 19 mm"),
        ("polyester 60 mm at 60 %", "polyester 60 mm at 60.1 %"),
        ("polyester 60 mm at 0.1 %", "polyester 60 mm at 0 %"),
        ("wire 40 mm", "wire 40 mm at 20 %"),
    ],
)
def test_sizes_and_loads_of_materials(good, bad):
    assert material(good)["catalogue"] == good
    with pytest.raises(InputError, match=r"must have|has one stiffness"):
        material(bad)
    assert MOST_LOAD == 60.0


def test_a_material_of_another_size():
    """The first size is that of the bar, the second what it has lost."""
    name = "chain R3 studless 19 mm less 2 mm"
    assert size_of(name) == 19.0
    assert resized(name, 20.5) == "chain R3 studless 20.5 mm less 2 mm"
    assert resized("nylon 24 mm", 1 / 3) == "nylon 0.333333333 mm"
    for other in ("rope 24 mm", "nylon thick"):
        with pytest.raises(InputError, match="must be written like"):
            size_of(other)


# -- cases -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("column", "good"),
    [((0.25, 0.75), True), ((0.25, 0.7500009), True), ((0.25, 0.7500011), False), ((0, 1), True), ((-0.1, 0.5), False),
     ((0.25, "often"), False)],
)  # fmt: skip
def test_probabilities_of_a_scatter_diagram(tmp_path, column, good):
    table = tmp_path / "scatter.csv"
    table.write_text("waves.period,probability\n" + "".join(f"{5 + k},{p}\n" for k, p in enumerate(column)))
    if good:
        assert variants.probabilities(table) == [({"waves.period": 5 + k}, p) for k, p in enumerate(column)]
        return
    with pytest.raises(InputError, match="needs a column probability of numbers >= 0 whose sum is 1 at most"):
        variants.probabilities(table)


def test_words_of_cases():
    """Bare words are texts, or take a key away."""
    assert variants.parse_vary("waves.stretching = wheeler, vertical") == ("waves.stretching", ["wheeler", "vertical"])
    assert variants.parse_vary("sea.tide=none,a.csv") == ("sea.tide", [None, "a.csv"])
    assert variants.parse_vary("waves.stretching=none,wheeler") == ("waves.stretching", ["none", "wheeler"])


# -- depths ------------------------------------------------------------------------------------------------------------


def test_a_grid_of_three_lines_is_a_parabola_and_flat_beyond_its_border():
    """-z = 20 + x + x^2/4 + x y: heights and slopes of the polynomial, held along what is beyond."""

    def depth(x, y):
        return 20 + x + x**2 / 4 + x * y

    x, y = [0.0, 1.0, 4.0], [0.0, 2.0]
    grid = bathymetry.Depths(x=x, y=y, depth=[[depth(a, b) for a in x] for b in y])
    assert grid.height(2.0, 0.5) == pytest.approx(-depth(2.0, 0.5), rel=1e-12)
    assert grid.height(9.0, -3.0) == pytest.approx(-depth(4.0, 0.0), rel=1e-12)
    inside = [-depth(2.0, 0.5), -(1 + 2.0 / 2 + 0.5), -2.0, -0.5, -1.0, 0.0]
    np.testing.assert_allclose(grid.derivatives(np.array(2.0), np.array(0.5)), inside, atol=1e-11)
    beyond = [-depth(4.0, 0.5), 0.0, -4.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(grid.derivatives(np.array(5.0), np.array(0.5)), beyond, atol=1e-11)


def test_tension_of_a_take_off_at_rest():
    """A spring from its length on, and end stops beyond theirs: at the limit itself they have no stiffness yet."""
    one = TakeOff.model_validate(
        {"from": "a", "to": "b", "stiffness": 10.0, "length": 3.0, "pretension": 7.0}
        | {"shortest": 2.0, "longest": 5.0, "stop_stiffness": 100.0}
    )
    found = [one.at_rest(length) for length in (1.5, 2.0, 4.0, 5.0, 6.0)]
    assert found == [(-58.0, 110.0), (-3.0, 10.0), (17.0, 10.0), (27.0, 10.0), (137.0, 110.0)]
    assert one.holds
    damper = {"from": "a", "to": "b", "damping": 3.0}
    assert [TakeOff.model_validate(damper | more).holds for more in ({}, {"pretension": -1.0})] == [False, True]


@pytest.mark.parametrize(
    ("keys", "period"),
    [
        ({"components": [[0.2, 3.0, 0, 0], [0.5, 6.0, 0, 0], [0.4, 9.0, 0, 0]]}, 6.0),
        ({"elevation": [[float(t), math.sin(math.pi * (t + 0.5) / 4)] for t in range(40)]}, 8.0),
        ({"elevation": [[float(t), t] for t in range(12)]}, 11.0),
        ({"spectrum": [[0.1, 1.0], [0.125, 3.0], [0.2, 2.0]]}, 8.0),
        (
            {"spectrum": {"frequency": [0.1, 0.2, 0.5], "direction_deg": [0, 9], "density": [[3, 0], [2, 2], [1, 0]]}},
            5.0,
        ),
    ],
)
def test_the_main_period_is_that_of_what_is_highest(keys, period):
    assert waves.Waves.model_validate(keys).main_period == pytest.approx(period, rel=1e-12)


def test_where_the_curve_of_a_line_comes_from():
    """Its own before that of all; at links that of connectors, if there is one."""
    own, bare = Fake(fatigue_curve="API studless"), Fake(fatigue_curve=None)
    both, one = (
        Fake(curve="API studlink", connectors="API connecting link"),
        Fake(curve="API studlink", connectors=None),
    )
    curves = [
        (own, both, False, "API studless"), (own, both, True, "API connecting link"), (own, one, True, "API studless"),
        (bare, one, False, "API studlink"), (bare, both, True, "API connecting link"),
        (own, None, True, "API studless"), (bare, None, True, None),
    ]  # fmt: skip
    for section, given, linked, text in curves:
        assert fatigue.curve_on(section, given, linked) == text


# -- elements, steps and what drives a scene ---------------------------------------------------------------------------

HELD = {"cable": LINE | {"from": [0, 0, 0], "to": [9.0, 0, 0]}, "time": {"end": 1000.0, "step": 0.5}}
TOP = {"kind": "prescribed", "position": [9.0, 0, 0], "amplitude": [1.0, 0, 0], "ramp": 4.0}


def driven(period, **changes):
    """A line whose end moves with a period."""
    line = LINE | {"from": [0, 0, 0], "top": TOP | {"period": period}}
    return load_scene({"cable": line, "time": HELD["time"]}, **changes)


def test_how_often_shapes_are_recorded():
    """24 in a period, 200 to 1200 in a run, as far as there are steps; or as the scene says."""
    scenes = [driven(period) for period in (24.0, 12.0, 240.0)]
    scenes += [load_scene(HELD), driven(24.0, time__step=6.0), driven(24.0, time__output_every=3.0)]
    found = [settings.frame_interval(scene) for scene in scenes]
    assert found == pytest.approx([1.0, 1000 / 1200, 5.0, 5.0, 6.0, 3.0], rel=1e-14)


def test_a_shorter_run():
    """The ramp and two periods, or half of it without; with adaptive steps as large ones as the whole has."""
    tolerance = {"time__tolerance": 1e-3}
    for scene, options, end, largest in (
        (driven(6.0), {}, 16.0, None),
        (driven(6.0), {"periods": 3}, 22.0, None),
        (driven(6.0, time__end=12.0), {}, 12.0, None),
        (load_scene(HELD), {}, 500.0, None),
        (driven(6.0), {"end": 7.0}, 7.0, None),
        (driven(6.0, **tolerance), {}, 16.0, 100.0),
        (driven(6.0, time__max_step=9.0, **tolerance), {}, 16.0, 9.0),
    ):
        time = settings.shortened(scene, **options).time
        assert (time.end, time.max_step, time.output_every) == (end, largest, settings.frame_interval(scene))
    assert settings.largest_step(load_scene(HELD, time__end=0.0)) is None


def test_what_drives_a_scene():
    sea = {"depth": 20.0}
    wave = load_scene(HELD, sea=sea, cable__diameter=0.1, waves={"amplitude": 1.0, "period": 5.0, "ramp": 3.0})
    found = [(settings.period_of(scene), settings.ramp_of(scene)) for scene in (driven(6.0), wave, load_scene(HELD))]
    assert found == [(6.0, 4.0), (5.0, 3.0), (None, 0.0)]


def test_elements_of_lines_in_their_shares():
    """Of 3 and 7 elements: half of each is 2 and 4, of which there are 6, which stay 2 and 4."""
    ends = [{"name": name, "from": [0, 0, 0], "to": [x, 0, 0]} for name, x in (("a", 9.0), ("b", -9.0))]
    scene = load_scene({"cable": [LINE | end | {"elements": n} for end, n in zip(ends, (3, 7), strict=True)]})
    assert settings.fitting(scene, settings.Space(2, 1, 5)) == settings.Space(2, 1, 6)
    one = load_scene(HELD, cable__elements=10)
    expected = [settings.Space(mu, mu - 1, n) for mu in (1, 2, 3) for n in (2, 5, 10)]
    assert settings.spaces(one) == expected
    assert settings.spaces(load_scene(HELD), [(2, 0)]) == [settings.Space(2, 0, 2), settings.Space(2, 0, 4)]
    assert str(settings.Space(2, 1, 5)) == "P2-P1, 5 elements, "
    assert (str(settings.Space()), settings.Space().pair) == ("", "-")


def test_steps_in_words():
    for given, text in (
        (("bdf2", 0.123456), "BDF2, dt 0.1235 s"),
        (("bdf2", 0.1, 0.00123), "BDF2, tolerance 0.0012"),
        (("backward-euler", 0.1, None, None, 1.04e-6), "backward Euler, dt 0.1 s, Newton 1e-06"),
    ):
        assert str(settings.Stepping(*given)) == text


@pytest.mark.parametrize(
    ("text", "kind", "found"),
    [(None, float, None), ("none", float, []), ("1,2.5", float, [1.0, 2.5]), ("3, 4", int, [3, 4]), ("2.5", int, None),
     ("0", float, None), ("1,-2", float, None), ("x", float, None), ("1,,2", int, None)],
)  # fmt: skip
def test_numbers_of_an_option(text, kind, found):
    if found is not None or text is None:
        assert settings.parse_numbers("--steps", text, kind) == found
        return
    with pytest.raises(InputError, match=f"--steps {text}: must be positive numbers with commas"):
        settings.parse_numbers("--steps", text, kind)


def test_a_key_everywhere():
    """In lines over their segments and materials, in joints and the bodies between segments, in all buoys."""
    hull = {"hull": [[0, 2], [2, 2]], "mass": 500.0}
    part = {"length": 10.0, "elements": 2}
    lines = [
        {"name": "a", "from": [0, 0, -9], "to": "j", "material": "rope"}
        | {"segments": [part | {"body": {"mass": 3.0}}, part]},
        {"name": "b", "from": "j", "to": "one", "material": "rope"} | part,
    ]
    scene = load_scene(
        {"sea": {"depth": 20.0}, "buoy": [hull | {"name": "one"}, hull | {"name": "two"}], "cable": lines}
        | {"joint": [{"name": "j", "mass": 1.0}], "material": {"rope": {"line_density": 2.0, "diameter": 0.1}}}
        | {"take_off": {"from": "one", "to": "two", "damping": 1.0}}
    )
    over = {f"{one}.diameter": None for one in ("cable.a.segments.0", "cable.a.segments.1", "material.rope")}
    force = ["external_force", "buoy.one.external_force", "buoy.two.external_force"]
    for key, value, found in (
        (
            "cable.diameter",
            0.2,
            over | {"cable.a.diameter": 0.2, "cable.b.diameter": 0.2},
        ),
        ("cable.slack", "x", {"cable.a.slack": "x", "cable.b.slack": "x"}),
        ("joint.mass", 2.0, {"joint.j.mass": 2.0, "cable.a.segments.0.body.mass": 2.0}),
        ("joint.ramp", 2.0, {"joint.j.ramp": 2.0}),
        ("buoy.mass", 2.0, {"buoy.one.mass": 2.0, "buoy.two.mass": 2.0}),
        ("buoy", None, {"buoy": None}),
        ("wind.area", 2.0, {"wind.area": 2.0, "buoy.one.wind.area": 2.0, "buoy.two.wind.area": 2.0}),
        (
            "external_force",
            None,
            dict.fromkeys(force),
        ),
        ("gravity", 1.0, {"gravity": 1.0}),
    ):
        assert settings.everywhere(scene, key, value) == found


def test_values_in_words():
    """Digits in groups from 10000 on, lists of up to 12 numbers."""
    for value, text in [
        (True, "yes"), (False, "no"), (9999.4, "9999.4"), (1e4, "10,000"), (-66953612.3, "-66,953,600"),
        (9e14, "900,000,000,000,000"), (1e15, "1e+15"), (0.00012345678, "0.000123457"), ("word", "word"),
        ([1, 2.5], "[1, 2.5]"), (list(range(12)), "[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]"),
        (list(range(13)), "13 rows"), ([[k, 0] for k in range(7)], "7 rows"),
        ([[k, 0] for k in range(6)], "[[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [5, 0]]"),
        ({"a": (1, 2), "b": 3}, "a = [1, 2], b = 3"),
    ]:  # fmt: skip
        assert inputs._text(value) == text
