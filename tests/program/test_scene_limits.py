"""Limits of scene values: the last admissible value and the first inadmissible one.

Source: the limits stated in README and the descriptions of keys, by hand; no scene is run.
"""

import math

import pytest
from pydantic import TypeAdapter, ValidationError

from dolfbuoy.scene import anchors, buoy, cable, fatigue, quantities, sections, vessel, waves
from dolfbuoy.scene.potential_flow import PotentialFlow
from dolfbuoy.scene.stiffness import TensionTable, kinks_of, secant
from dolfbuoy.scene.take_off import TakeOff

HULL = {"hull": [[0.0, 1.0], [2.0, 1.0]], "mass": 300.0}
LINE = {"length": 20.0, "line_density": 5.0, "axial_stiffness": 1e5, "elements": 4}
MOVED = {"kind": "prescribed", "position": [0.0, 0.0, 0.0]}
PERIOD = {"period": math.tau, "amplitude": [0.0, 600.0, 800.0]}  # of 1000 m/s
WAVES = {"amplitude": 1.0, "period": 6.0}
SEA = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 7.0}
GUSTS = {"speed_10m": 9.0, "area": 1.0, "height": 1.0, "gusts": "npd"}
SHIP = {"name": "ship", "position": [1.0, 0.0, 0.0], "fairleads": {"bow": [3.0, 0.0, -1.0]}}


def raos(*pairs):
    """Operators of periods and directions."""
    return {"raos": [[period, angle, *[0.0] * 12] for period, angle in pairs]}


def flow(places, column, more=None):
    """Coefficients whose damping of surge is 100 at most, and of a motion a column."""
    n = len(column)
    rows = [[100.0, 0.0, 0.0, 0.0] for _ in range(n)]
    for row, value in zip(rows, column, strict=True):
        row[places] = value
    found = {"omega": [0.1 * (k + 1) for k in range(n)], "damping": rows, "added_mass": [[1.0] * 4] * n}
    found |= {"added_mass_infinite": [1.0, 0.0, 0.0, 0.0], "excitation": [[1.0] * 6] * n, "height": 0.0}
    return found | (more or {})


def low(value, largest=0.0):
    """Twelve numbers of which one is low and one is the largest."""
    return [value, largest, *[0.0] * 10]


@pytest.mark.parametrize(
    ("section", "good", "bad"),
    [
        # hulls: heights may be equal, one with a face; the thinnest slab and the thinnest wire that count
        (buoy.Buoy, HULL | {"hull": [[0, 1], [0, 2], [1, 2]]}, HULL | {"hull": [[0, 1], [0, 2], [0, 1]]}),
        (buoy.Buoy, HULL | {"hull": [[0, 1], [1, 0]]}, HULL | {"hull": [[0, 0], [1, 0]]}),
        (buoy.Buoy, HULL | {"hull": [[0, 1], [1.1e-9, 1], [1.1e-9, 0], [1, 0]]},
         HULL | {"hull": [[0, 1], [0.9e-9, 1], [0.9e-9, 0], [1, 0]]}),
        (buoy.Buoy, HULL | {"hull": [[0, 1e-20], [1, 1]]}, HULL | {"hull": [[0, 0.99e-20], [1, 1]]}),
        (buoy.Buoy, HULL | {"hull": [[0, 0], [1, 1]]}, HULL | {"hull": [[0, -1e-3], [1, 1]]}),
        (buoy.Buoy, HULL | {"hull": [[1e-12, 1], [1, 1]]}, HULL | {"hull": [[1.05e-12, 1], [1, 1]]}),
        (buoy.Buoy, HULL | {"hull": [[-1e-12, 1], [1, 1]]}, HULL | {"hull": [[-1.05e-12, 1], [1, 1]]}),
        (buoy.Buoy, HULL | {"hull": [[0, 1], [1, 1]]}, HULL | {"hull": [[0, 1]]}),
        # moments of a disc are A + B = C
        (buoy.Buoy, HULL | {"inertia": [3.0, 5.0, 8.0 * (1 + 0.9e-9)]}, HULL | {"inertia": [3.0, 5.0, 8.0 + 1e-8]}),
        (buoy.Buoy, HULL | {"inertia": [4.0, 8.0]}, HULL | {"inertia": [4.0, 8.0 + 1e-8]}),
        (buoy.Buoy, HULL | {"inertia": [9.0, 1.0]}, HULL | {"inertia": [9.0]}),
        (buoy.Buoy, HULL | {"inertia": [9.0, 8.0, 2.0]}, HULL | {"inertia": [9.0, 8.0, 2.0, 3.0]}),
        (buoy.Buoy, HULL | {"wave_damping": [1.0, 2.0]}, HULL | {"wave_damping": [1.0, 2.0, 3.0]}),
        (buoy.Buoy, {"mass": 1.0, "inertia": [2.0, 3.0], "center_of_mass": 0.0}, {"mass": 1.0, "inertia": [2.0, 3.0]}),
        (buoy.Buoy, {"mass": 1.0, "inertia": [2.0, 3.0], "center_of_mass": 0.0}, {"mass": 1.0, "center_of_mass": 0.0}),
        *((buoy.Buoy, HULL | {name: "spar"},
           {"mass": 1.0, "inertia": [2.0, 3.0], "center_of_mass": 0.0, name: "spar"})
          for name in ("added_mass", "axial_added_mass", "rotational_added_mass")),
        (buoy.Buoy, HULL | {"fairleads": {"a": [0, 0, 0]}}, HULL | {"fairleads": {}}),
        (buoy.BuoyStart, {"buoy_orientation": [0, 0, 0, 1e-9]}, {"buoy_orientation": [0, 0, 0, 0]}),
        (buoy.Wind, GUSTS, GUSTS | {"turbulence": 0.2}),
        (buoy.Wind, GUSTS | {"gusts": "kaimal", "turbulence": 1.0}, GUSTS | {"gusts": "kaimal"}),
        (buoy.Wind, GUSTS | {"ramp": 3.0, "seed": 1}, {**GUSTS, "gusts": None, "ramp": 3.0}),
        # ends that move
        (cable.Top, MOVED | PERIOD | {"period": math.tau * 1.0001}, MOVED | PERIOD | {"period": math.tau * 0.9999}),
        (cable.Top, MOVED | {"motion": [[0, 0, 0, 0], [1, 600, 0, 799.9]]},
         MOVED | {"motion": [[0, 0, 0, 0], [1, 600, 0, 800.1]]}),
        (cable.Top, MOVED | {"motion": [[2, 0, 0, 0], [4, 0, 1999, 0]]},
         MOVED | {"motion": [[2, 0, 0, 0], [4, 0, 2001, 0]]}),
        (cable.Top, MOVED | {"velocity": [1, 0, 0], "ramp": 2.0},
         {"kind": "fixed", "position": [0, 0, 0], "ramp": 2.0}),
        (cable.Top, {"kind": "free", "force": [1, 0, 0]}, MOVED | {"velocity": [1, 0, 0], "force": [1, 0, 0]}),
        (cable.Top, {"kind": "free"}, {"kind": "fixed"}),
        (cable.EndDirection, {"direction": [0, 0, 1.1e-9]}, {"direction": [0, 0, 1e-9]}),
        (cable.EndDirection, {"motion": [[0, 1, 0, 0], [1, math.cos(1.398), math.sin(1.398), 0]]},
         {"motion": [[0, 1, 0, 0], [1, math.cos(1.401), math.sin(1.401), 0]]}),  # cos 80.2 deg = 0.17
        (cable.EndDirection, {"motion": [[0, 1, 0, 0], [1, 1, 0, 0]], "ramp": 1.0},
         {"direction": [1, 0, 0], "ramp": 1.0}),
        (cable.FailsAt, {"time": 1.0, "at": 2.0}, {"tension": 1.0, "at": 2.0}),
        (cable.FailsAt, {"tension": 1.0}, {"tension": 1.0, "time": 2.0}),
        # elements that add up to the length, whole numbers of them
        (cable.Cable, LINE | {"elements": [[8.0, 1], [12.0 * (1 + 1.6e-9), 3.0]]},
         LINE | {"elements": [[8.0, 1], [12.0 * (1 + 1.7e-9), 3.0]]}),
        (cable.Cable, LINE | {"elements": [[8.0, 2.0], [12.0, 3]]}, LINE | {"elements": [[8.0, 2.5], [12.0, 3]]}),
        (cable.Cable, LINE | {"position_degree": 2, "tension_degree": 1},
         LINE | {"position_degree": 2, "tension_degree": 2}),
        (cable.Cable, LINE | {"damping": 3.0}, LINE | {"damping": 3.0, "axial_stiffness": math.inf}),
        (cable.Cable, LINE | {"bending_stiffness": 1.0}, LINE | {"bending_stiffness": 1.0, "slack": "tension-only"}),
        (cable.Cable, LINE | {"bending_stiffness": 1.0, "bending_damping": 0.1}, LINE | {"bending_damping": 0.1}),
        (cable.Cable, LINE | {"bending_stiffness": 1.0, "minimum_bend_radius": 2.0},
         LINE | {"minimum_bend_radius": 2.0}),
        (cable.Cable, LINE | {"fails_at": {"time": 1.0}},
         LINE | {"fails_at": {"time": 1.0}, "winch": [[0, 20.0], [9, 21.0]]}),
        (cable.Cable, LINE | {"winch": [[0, 20.0 + 1.9e-8], [9, 21.0]]},
         LINE | {"winch": [[0, 20.0 + 2.1e-8], [9, 21.0]]}),
        (cable.Cable, LINE | {"winch": [[1, 20.0], [2, 1019.0]]}, LINE | {"winch": [[1, 20.0], [2, 1021.0]]}),
        # anchors
        (anchors.Anchor, {"weight": 1.0, "friction": 0.5, "drags": True}, {"holding_capacity": 1.0, "drags": True}),
        (anchors.Anchor, {"holding_capacity": 1.0}, {"holding_capacity": 1.0, "weight": 1.0, "friction": 0.5}),
        (anchors.Anchor, {"holding_capacity": 1.0}, {"holding_capacity": 1.0, "friction": 0.5}),
        (anchors.Anchor, {"weight": 1.0, "friction": 0.5}, {"weight": 1.0}),
        # take-offs
        (TakeOff, {"from": "a", "to": "b", "stop_stiffness": 1.0, "shortest": 1.0, "longest": 1.1},
         {"from": "a", "to": "b", "stop_stiffness": 1.0, "shortest": 1.1, "longest": 1.1}),
        (TakeOff, {"from": "a", "to": "b", "stop_stiffness": 1.0, "shortest": 1.0},
         {"from": "a", "to": "b", "stop_stiffness": 1.0}),
        (TakeOff, {"from": "a", "to": "b", "stiffness": 1.0, "length": 0.0},
         {"from": "a", "to": "b", "stiffness": 1.0}),
        # time
        (sections.Time, {"end": 1e9, "step": 1.0}, {"end": 1e9, "step": 0.999}),
        (sections.Time, {"end": 1e8, "step": 1.0, "output_every": 0.1},
         {"end": 1e8, "step": 1.0, "output_every": 0.099}),
        (sections.Time, {"end": 1, "step": 0.1, "tolerance": 0.1, "min_step": 0.2, "max_step": 0.2},
         {"end": 1, "step": 0.1, "tolerance": 0.1, "min_step": 0.21, "max_step": 0.2}),
        (sections.Time, {"end": 1, "step": 0.1, "scheme": "generalized-alpha", "spectral_radius": 0.0},
         {"end": 1, "step": 0.1, "scheme": "bdf2", "spectral_radius": 0.0}),
        (sections.Accuracy, {"target": 0.1, "rounds": 5}, {"rounds": 5}),
        (sections.Accuracy, {"target": 0.1, "estimate": "companion"}, {"target": 0.1, "estimate": "time"}),
        (sections.Accuracy, {"estimate": "none"}, {"target": 0.1, "estimate": "none"}),
        (sections.Initial, {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0]]},
         {"kind": "polyline", "points": [[0, 0, 0]]}),
        (sections.Initial, {"points": {"a": [[0, 0, 0], [1, 0, 0]]}}, {"points": {"a": [[0, 0, 0]]}}),
        (sections.Current, {"profile": [[-9, 1], [0, 2]]}, {"profile": [[-9, 1]]}),
        (sections.Current, {"profile": [[-9, 1], [0, 2]]}, {"profile": [[-9, 1], [-9, 2]]}),
        (sections.Current, {"profile": [[-9, 1], [0, 2]]}, {"profile": [[-9, 1], [0, 2]], "speed": 1.0}),
        (sections.Current, {"grid": [[0, -9, 1, 0], [0, 0, 1, 0]]}, {"grid": [[0, -9, 1, 0], [1, -9, 1, 0]]}),
        (sections.Seabed, {"slope": [0.1, 0.0], "start": "pulled"},
         {"start": "pulled", "depths": {"x": [0, 1], "y": [0, 1], "depth": [[9, 9], [9, 9]]}}),
        # waves
        (waves.Waves, SEA | {"crest": 2.0, "crest_time": 5.0, "ramp": 5.0},
         SEA | {"crest": 2.0, "crest_time": 4.99, "ramp": 5.0}),
        (waves.Waves, SEA | {"crest": 2.0, "crest_time": 5.0}, SEA | {"crest_time": 5.0}),
        (waves.Waves, SEA | {"band": [0.5, 1.5]}, SEA | {"band": [1.5, 1.5]}),
        (waves.Waves, SEA | {"gamma": 2.0}, SEA | {"gamma": 2.0, "spectrum": "pierson-moskowitz"}),
        (waves.Waves, WAVES | {"stretching": "none"}, SEA | {"stretching": "none"}),
        (waves.Waves, {"elevation": [[float(t + (t > 3) * 0.9e-3), t % 3] for t in range(8)]},
         {"elevation": [[float(t + (t > 3) * 1.3e-3), t % 3] for t in range(8)]}),
        (waves.Waves, {"elevation": [[float(t), t % 3] for t in range(8)]},
         {"elevation": [[float(t), t % 3] for t in range(7)]}),
        (waves.DirectionalSpectrum, {"frequency": [0.1, 0.2], "direction_deg": [0, 359.9], "density": [[1, 0], [0, 0]]},
         {"frequency": [0.1, 0.2], "direction_deg": [0, 360], "density": [[1, 0], [0, 0]]}),
        # vessels
        (vessel.Vessel, SHIP | {"hull": [4, 2, -1, -0.9]}, SHIP | {"hull": [4, 2, -1, -1]}),
        (vessel.Vessel, SHIP | {"hull": [4, 2, 0, 1]}, SHIP | {"hull": [4, 0, 0, 1]}),
        (vessel.Vessel, SHIP | raos((1e-3, 0)), SHIP | raos((0, 0))),
        (vessel.Vessel, SHIP | raos((5, 360)), SHIP | raos((5, 360.1))),
        (vessel.Vessel, SHIP | raos((5, -360)), SHIP | raos((5, -360.1))),
        (vessel.Vessel, SHIP | raos((5, 0), (5, 359)), SHIP | raos((5, 0), (5, 360))),
        (vessel.Vessel, SHIP | raos((5, 0), (6, 0)), SHIP | raos((5, 0), (5, 0))),
        (vessel.Vessel, SHIP | raos((5, 0), (6, 0), (5, 9), (6, 9)), SHIP | raos((5, 0), (6, 0), (5, 9))),
        (vessel.Vessel, SHIP | {"motion": [[0] * 7, [1, *[0] * 6]], "ramp": 1.0}, SHIP | {"ramp": 1.0}),
        # a damping below zero: 5 % of the largest; of what hardly radiates, of 5 % of that of surge by added masses
        (PotentialFlow, flow(1, low(-0.199, 4.0)), flow(1, low(-0.201, 4.0))),
        (PotentialFlow, flow(1, low(-0.499), {"added_mass_infinite": [1.0, 2.0, 0.0, 0.0]}),
         flow(1, low(-0.501), {"added_mass_infinite": [1.0, 2.0, 0.0, 0.0]})),
        (PotentialFlow, flow(1, low(-4.99e-4)), flow(1, low(-5.01e-4))),  # or 1e-4 of that of surge
        (PotentialFlow, flow(2, low(-4.49e-3), {"draft": 3.0}), flow(2, low(-4.51e-3), {"draft": 3.0})),
    ],
)  # fmt: skip
def test_the_last_that_is_taken_and_the_first_that_is_refused(section, good, bad):
    section.model_validate(good)
    with pytest.raises(ValidationError):
        section.model_validate(bad)


@pytest.mark.parametrize(
    ("kind", "good", "bad"),
    [
        (quantities.Length, [1e-20, 1e5], [0.0, 0.99e-20, 1.001e5]),
        (quantities.BedStiffness, [1e-9, 1e12], [0.99e-9]),
        (quantities.Stiffness, [1e-20, 1e16, math.inf], [0.99e-20, 1.001e16, math.nan]),
        (quantities.Name, ["a", "é-1_b", "a" * 50], ["1a", "_a", "a b", "", "a" * 51]),
        (quantities.Title, ["", "a b"], ["a\nb", "a\x1b"]),
        (quantities.Spreads, [{"a": "1e10"}, {"a": "lognormal 5 %"}, {"a": 1e-9}], [{"a": "0"}, {"a": "1.1e10"}, {}]),
        (quantities.Vector, [[0, 1.5, -1e5]], [[0, True, 1], [0, 1], [0, 1, 1e300], [0, 1, 10**400], "abc"]),
        (fatigue.CurveText, ["1 N^1", "1 kN^50", "1e-9 MPa^3"],
         ["1 N^0.99", "1 kN^50.1", "0 MPa^3", "-1 N^3", "1 m^3"]),
    ],
)  # fmt: skip
def test_values_at_the_limits_of_their_kind(kind, good, bad):
    adapter = TypeAdapter(kind)
    for value in good:
        adapter.validate_python(value)
    for value in bad:
        with pytest.raises(ValidationError):
            adapter.validate_python(value)


@pytest.mark.parametrize("text", ["1_0", "nan", "inf", "-inf", "1e-400", "3e-999", "1e999", "0x1", "٣", "", "1,5"])
def test_what_is_no_number(text):
    with pytest.raises(ValueError, match="no finite number"):
        quantities.number_of(text)


def test_what_is_a_number():
    texts = [" -1.5e1 ", ".5", "7.", "+2", "0e99", "0.000", "1e-300"]
    assert list(map(quantities.number_of, texts)) == [-15.0, 0.5, 7.0, 2.0, 0.0, 0.0, 1e-300]


def test_a_spread_is_a_distribution_its_size_and_whether_that_is_relative():
    for text, found in (
        (2.5, ("normal", 2.5, False)),
        ("20%", ("normal", 0.2, True)),
        ("lognormal 4 %", ("lognormal", 0.04, True)),
        ("uniform  3", ("uniform", 3.0, False)),
    ):
        assert quantities.spread_of(text) == found


# -- tables of tensions -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ([[k, k] for k in range(50)], [[k, k] for k in range(51)]),
        ([[0, 0], [1, 1]], [[0, 0]]),
        ([[-0.999, -1], [0, 0]], [[-1, -1], [0, 0]]),
        ([[0, 0], [100, 1]], [[0, 0], [100.1, 1]]),
        ([[0, 0], [1, 1e10]], [[0, 0], [1, 1.001e10]]),
        ([[-0.5, -1e10], [0, 0]], [[-0.5, -1.001e10], [0, 0]]),
        ([[0, 0], [1, 1], [2, 1.1]], [[0, 0], [1, 1], [2, 1]]),
        ([[0, 0], [1, 1], [1.1, 2]], [[0, 0], [1, 1], [1, 2]]),
        ([[-0.5, -1], [0, 0]], [[-0.5, -1], [1, 0]]),
    ],
)
def test_a_table_of_tensions_at_its_limits(good, bad):
    TensionTable(good)
    with pytest.raises(ValueError, match="must"):
        TensionTable(bad)


def test_a_table_is_the_slope_from_which_it_is_pulled():
    """From below, where it has a strain below 0; equal tables have equal rows."""
    both, above = TensionTable([[-0.5, -1], [0, 0], [1, 5], [3, 7]]), TensionTable([[0, 0], [1, 5], [3, 7]])
    assert (float(both), float(above)) == (2.0, 5.0)
    assert both.kinks == [(0.0, 0.2 - 0.5), (5.0, 1.0 - 0.2)]
    assert (both == TensionTable(both.rows), both != above, above == 5.0, above != 5.0) == (True, True, True, False)
    assert hash(both) == hash(TensionTable(both.rows)) != hash(above)
    assert (kinks_of(both, True), kinks_of(both, False), kinks_of(5.0, False)) == ([], both.kinks, [])
    below = TensionTable([[-0.9, -9], [-0.5, -1], [0, 0], [1, 2]])
    assert (kinks_of(below, True), kinks_of(below, False)) == (below.kinks[:1], below.kinks[1:])
    assert [secant(both, T) for T in (-2.0, 0.0, 5.0, 6.0)] == pytest.approx([2.0, 2.0, 5.0, 3.0], rel=1e-14)
    assert [both.strain(T) for T in (-2.0, 5.0, 6.0)] == pytest.approx([-1.0, 1.0, 2.0], rel=1e-14)
