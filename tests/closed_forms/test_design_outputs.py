"""Design outputs of a mooring: anchor loads, offsets, freeboard, levels exceeded for a given time.

Source: balance of forces, points of a rotated circle, triangular and sine series by hand.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from scipy.spatial.transform import Rotation

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import sample_of
from dolfbuoy.results.series import Series
from dolfbuoy.studies.one_case import evaluate

RUN = load_scene(merged(MOORED, cable__elements=6, time={"end": 3.0, "step": 0.05}))


@pytest.fixture(scope="module")
def record():
    return dolfbuoy.simulate(RUN)


def test_what_hangs_on_an_anchor():
    """The upper end carries the line's submerged weight and the uplift, and an equal horizontal force."""
    found = alone(dolfbuoy.solve_static(load_scene(RUN, current=None)))
    (piece,) = RUN.network.pieces
    c = piece.section
    weight = 9.81 * c.length * (c.line_density - 1025 * np.pi * c.diameter**2 / 4)
    *aside, up = found.end_tension.values
    assert float(found.anchor_uplift) == pytest.approx(up - weight, rel=1e-6)
    assert float(found.anchor_horizontal) == pytest.approx(np.hypot(*aside), abs=1e-6 * up)


def test_lines_on_one_joint_are_one_anchor():
    line = {"line_density": 5.0, "axial_stiffness": 1e5, "length": 11.0, "elements": 6}
    ends = {"a": [4.0, 0.0, 10.0], "b": [0.0, 3.0, 10.0], "c": [-1.0, -1.0, 10.0]}
    legs = [line | {"name": name, "from": "A", "to": place} for name, place in ends.items()]
    legs[1] |= {"from": [0.0, 3.0, 10.0], "to": "A"}
    scene = {"cable": legs, "joint": [{"name": "A", "position": [0.0, 0.0, 0.0]}]}
    record = dolfbuoy.solve_static(load_scene(scene))
    assert record.anchor.values.tolist() == ["A"]
    tops = record.end_tension.values + [[0, 0, 0]]
    tops[1] = record.anchor_force.values[1]
    x, y, z = tops.sum(axis=0)
    assert record.anchor_uplift.item() == pytest.approx(z - 3 * 9.81 * 55.0, rel=1e-8)
    assert record.anchor_horizontal.item() == pytest.approx(np.hypot(x, y), rel=1e-8)


def test_an_offset_is_from_the_middle_of_the_anchors():
    """The legs' anchors lie on a circle around the origin; a buoy that is not anchored has no offset."""
    record = dolfbuoy.solve_static("three-legs")
    assert record.anchor.values.tolist() == ["east.from", "north.from", "south.from"]
    assert record.offset.item() == pytest.approx(np.hypot(*record.buoy_position.values[0, :2]), rel=1e-4)
    moved = dolfbuoy.solve_static(load_scene(RUN, cable__anchor=[3.0, -7.0, -20.0]))
    x, y, _ = moved.buoy_position.values[0]
    assert moved.offset.item() == pytest.approx(np.hypot(x - 3, y + 7), rel=1e-12)
    assert "offset" not in dolfbuoy.simulate("free-buoy", time__end=0.1)


def test_freeboard_is_of_the_lowest_point_of_the_rim(record):
    (buoy,) = RUN.network.buoys.values()
    top, diameter = buoy.hull[-1]
    masses = [(buoy.mass, buoy.center_of_mass), *((one.mass, one.height) for one in buoy.point_masses)]
    centre = sum(m * z for m, z in masses) / sum(m for m, _ in masses)
    turn = np.linspace(0, 2 * np.pi, 20001)
    rim = np.stack([diameter / 2 * np.cos(turn), diameter / 2 * np.sin(turn), 0 * turn + top - centre], 1)
    for row in (0, 20, -1):
        one = alone(record).isel(time=row)
        q0, *q = one.buoy_orientation.values
        lowest = (Rotation.from_quat([*q, q0]).apply(rim) + one.buoy_position.values)[:, 2].min()
        assert float(one.freeboard) == pytest.approx(lowest - float(one.surface_elevation), abs=1e-7)
    assert np.ptp(record.freeboard.values) > 0.01


def test_the_smallest_tension_is_of_every_step(record):
    found = sample_of(record, RUN, start=0.0)["series"]["smallest_tension of cable"]
    assert found["minimum"] == record.cable_tension_minimum.values.min() == record.smallest_tension.values.min()
    assert found["mean"] < sample_of(record, RUN, start=0.0)["series"]["tension_top of cable"]["mean"]
    every = np.searchsorted(record.time.values, record.frame.values - 1e-9)
    of_frames = record.cable_tension.values.min(axis=1)  # means of elements, between the ends of which T varies
    assert (record.smallest_tension.values[every, 0] <= of_frames * (1 + 1e-12)).all()


def test_the_lean_at_rest_is_that_of_the_first_instant(record):
    """A number of the sample, of statistics and of cases of a sweep, beside the largest."""
    found = sample_of(record, RUN, start=1.0)["series"]
    first = float(record.cone_angle[0, 0])
    assert found["lean_at_start of buoy"] | {"mean": first, "maximum": first} == found["lean_at_start of buoy"]
    assert found["cone_angle of buoy"]["maximum"] == record.cone_angle.values[20:].max() != first
    assert record.lean_at_start.values.tolist() == [first]
    assert record.lean_at_start.attrs["units"] == "degree"
    late = sample_of(record.isel(time=slice(20, None)), RUN, start=1.0)["series"]  # whatever is cut off the record
    assert late["lean_at_start of buoy"]["mean"] == first
    case = evaluate({"changes": {"waves.ramp": 1.0}, "base": ""}, RUN)
    assert case["statistics"]["lean_at_start of buoy"] == {"maximum": pytest.approx(first, rel=1e-12)}
    assert case["statistics"]["cone_angle of buoy"]["maximum"] >= first


@pytest.mark.parametrize("step", [np.array([0.0, 0.1, 0.4, 0.7]), np.linspace(0, 17, 1001)])
def test_rounding_deviates_by_nothing(step):
    """The mean of equal numbers is off by rounding, which must not give a standard deviation."""
    assert Series("tension", step, np.full(len(step), 1537.3)).standard_deviation == 0
    small = Series("tension", step, 1e-9 * np.cos(step)).standard_deviation
    assert Series("tension", step, 1537.3 + 1e-9 * np.cos(step)).standard_deviation == pytest.approx(small, rel=1e-2)


@pytest.mark.parametrize(
    ("t", "x", "level"),
    [
        ([0, 3, 5, 7, 10], [1, 1, 11, 1, 1], 8.5),  # a triangle 4 s wide is 1 s wide a quarter of its height below
        ([0, 4.75, 5, 5.25, 10], [1, 1, 11, 1, 1], 1.0),  # one that is half a second wide
        ([0, 0.4, 0.9], [1, 2, 1], np.nan),
        (np.linspace(0, 20, 20001), 2 * np.sin(np.linspace(0, 20, 20001) * np.pi / 2), 2 * np.cos(np.pi / 4)),
        ([0, 2, 4], [3, 3, 3], 3.0),
        ([0, 0.25, 0.5, 5], [9, 9, 2, 1], 2 - 0.5 / 4.5),  # from the beginning on
    ],
)
def test_a_level_that_lasts(t, x, level):
    series = Series("tension", np.asarray(t, dtype=float), np.asarray(x, dtype=float))
    assert series.lasting_maximum == pytest.approx(level, abs=2e-6, nan_ok=True)
