"""Tension over breaking load: for each segment that has one, at every step, in record, summary, sweep and check.

Source: the recorded tensions; a record on one rank.
"""

import numpy as np
import pytest
from alone import simulate, solve_static
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.results.parts import alone
from dolfbuoy.results.record import read
from dolfbuoy.results.sample import numbers_of
from dolfbuoy.results.summary import static_rows, static_warnings, summary, warnings

SCENE = merged(
    MOORED, cable__breaking_load=2e4, cable__elements=6, time={"end": 0.5, "step": 0.05, "output_every": 0.05}
)


def legs():
    """One leg of a breaking load, one of three segments of which two have one, and one without."""
    scene = load_scene("three-legs").to_dict() | {"time": {"end": 0.3, "step": 0.05, "output_every": 0.05}}
    east, north, _ = scene["cable"]
    east["breaking_load"] = 1e4
    length = north.pop("length")
    material = {"breaking_load": 5e3}
    for key in ("elements", "grading"):
        north.pop(key, None)
    north["segments"] = [
        {"length": length / 4, "elements": 4, **material},
        {"length": length / 4, "elements": 4},
        {"length": length / 2, "elements": 8, **material},
    ]
    return scene


def largest(T):
    """Of equal elements of degree 0, up to both ends."""
    T = T.values
    return np.max([T.max(axis=1), *(T[:, i] + (T[:, i] - T[:, j]) / 2 for i, j in ((0, 1), (-1, -2)))], axis=0)


@pytest.mark.parametrize("elements", [1, 2, 7, [[10.0, 3], [2.0, 5]]])
@pytest.mark.parametrize("pair", [(1, 0), (2, 1), (3, 2)])
def test_no_weight_is_missing(pair, elements):
    """A chain that hangs in two segments: what holds each of them, over its breaking load, for any elements."""
    degrees = {"position_degree": pair[0], "tension_degree": pair[1], "breaking_load": 1e4}
    lengths = [(12.0, 20.0), (8.0, 5.0)]
    segments = [{"length": L, "line_density": w, "elements": elements if L == 12 else 2} for L, w in lengths]
    cable = degrees | {"segments": segments, "from": [0.0, 0.0, 0.0], "top": {"kind": "free"}, "axial_stiffness": 1e8}
    found = solve_static({"cable": [cable]})
    held = 9.81 * np.array([12 * 20.0 + 8 * 5.0, 8 * 5.0])
    np.testing.assert_allclose(found.utilisation, held / 1e4, rtol=1e-6)
    assert np.linalg.norm(found.anchor_force) == pytest.approx(1e4 * float(found.utilisation[0]), rel=1e-6)


def test_one_cable():
    """The largest tension of its elements at every instant; it goes on into statistics, and so into sweeps."""
    scene = load_scene(SCENE)
    whole = dolfbuoy.simulate(scene)
    record = alone(whole)
    np.testing.assert_allclose(record.utilisation, largest(record.cable_tension) / 2e4, rtol=1e-12)
    most = float(record.utilisation.max())
    assert ("largest tension over breaking load", f"{most:.4g}", "") in summary(whole, scene)
    assert numbers_of(whole)["utilisation of cable"]["maximum"] == most
    assert "utilisation" not in simulate(load_scene(SCENE, cable__breaking_load=None))
    assert not any("breaking load" in sentence for sentence in warnings(whole, scene))


def test_it_changes_nothing_else():
    """It is no physics: all other series are the same bits."""
    with_it, without = simulate(SCENE), simulate(SCENE, cable__breaking_load=None)
    for name in ("cable_position", "tension_top", "buoy_position"):
        assert np.array_equal(with_it[name], without[name])


def test_segments_of_a_network():
    """Those that have a breaking load, by name; who is above it is warned."""
    scene = load_scene(legs())
    record, rest = dolfbuoy.simulate(scene), dolfbuoy.solve_static(scene)
    assert record.segment.values.tolist() == ["east", "north.0", "north.2"]
    for name, cable, segment, load in (("east", 0, 0, 1e4), ("north.0", 1, 0, 5e3), ("north.2", 1, 2, 5e3)):
        mine = (record.cable_of_cell == cable) & (record.segment_of_cell == segment)
        expected = largest(record.cable_tension.where(mine, drop=True)) / load
        np.testing.assert_allclose(record.utilisation.sel(segment=name), expected, rtol=1e-12)
        most = record[["cable_utilisation_maximum", "cable_tension_maximum"]].where(mine, drop=True)
        np.testing.assert_allclose(most.cable_utilisation_maximum, most.cable_tension_maximum / load, rtol=1e-12)
    rows = {name: value for name, value, _ in summary(record, scene) if "breaking" in name}
    assert list(rows) == [
        f"{cable}: largest tension over breaking load{segment}"
        for cable, segment in (("east", ""), ("north", ", segment 0"), ("north", ", segment 2"))
    ]
    assert rows["east: largest tension over breaking load"] == f"{float(record.utilisation.max('time')[0]):.4g}"
    assert [name for name, *_ in static_rows(rest, scene) if "breaking" in name] == list(rows)
    for said in (warnings(record, scene), static_warnings(rest, scene)):
        above = [sentence for sentence in said if "breaking load" in sentence]
        assert len(above) == 1
        assert above[0].startswith("north: The tension of the cable is above its breaking load: 1.")
        assert above[0].endswith("(segment 2); here it does not part, see cable.fails_at.")


def test_check_says_it():
    numbers = {name: value for name, value, *_ in check(load_scene(SCENE)).numbers}
    at_rest = float(solve_static(SCENE).utilisation)
    assert numbers["equilibrium: largest tension over breaking load"] == pytest.approx(at_rest, rel=1e-9)
    report = check(load_scene(legs()))
    assert sum("largest tension over breaking load of" in name for name, *_ in report.numbers) == 3
    assert "The equilibrium is above the breaking load of north.2." in report.warnings


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks(tmp_path):
    """A segment that lies on one of two ranks."""
    done = start_scenes(2, {"legs": legs()}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    one, together = simulate(legs()), read(tmp_path / "legs" / "results.nc")
    np.testing.assert_allclose(together.utilisation, one.utilisation, rtol=1e-8)
