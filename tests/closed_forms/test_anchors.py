"""Fixed anchors: the sinker weight that prevents sliding, and holding capacities.

Source: a block on a plane by hand, which slides as soon as H > mu (W - V).
"""

from types import SimpleNamespace

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from every_key import shows

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.results.noted import Design
from dolfbuoy.results.summary import static_warnings, warnings
from dolfbuoy.scene.anchors import anchors_of

RUN = merged(MOORED, cable__elements=4, time={"end": 1.0, "step": 0.05})
del RUN["current"]  # whose drag along the line has a vertical part


@pytest.fixture(scope="module")
def pulls():
    """(H, V) of the static line on its anchor [N]: the force on its upper end, less its submerged weight."""
    found = dolfbuoy.solve_static(load_scene(RUN))
    c = load_scene(RUN).network.pieces[0].section
    z = found.end_tension.values[0, 2]
    drag = np.hypot(*found.anchor_force.values[0, :2])
    return float(drag), z - 9.81 * c.length * (c.line_density - 1025 * np.pi * c.diameter**2 / 4)


@shows("anchor.weight", "anchor.friction", "anchor.at")
@pytest.mark.parametrize("friction", [0.3, 0.8])
@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_sinker_drags_if_its_friction_is_less_than_the_pull(pulls, friction, part):
    """Both sides of the limit by 1 % of the weight."""
    H, V = pulls
    weight = part * (H / friction + V)
    scene = load_scene(RUN | {"anchor": {"at": "cable.from", "weight": weight, "friction": friction}})
    found = dolfbuoy.solve_static(scene)
    drags = friction * (weight - V) < H
    assert drags == (part < 1)
    assert (float(found.anchor_use) > 1) == drags
    assert found.needed_weight.item() == pytest.approx(H / friction + V, rel=1e-5)
    assert any("would not hold" in sentence for sentence in static_warnings(found, scene)) == drags


@shows("anchor.holding_capacity")
def test_an_embedded_anchor_holds_its_capacity(pulls):
    scene = load_scene(RUN | {"anchor": {"holding_capacity": 2 * pulls[0]}})
    found = dolfbuoy.solve_static(scene)
    assert found.anchor_use.item() == pytest.approx(0.5, rel=1e-6)
    assert "needed_weight" not in found


def test_the_worst_instant_of_a_run_counts():
    """Every step is checked; the message gives the largest utilisation and its time."""
    scene = load_scene(RUN | {"anchor": {"weight": 100.0, "friction": 0.5}})
    record = dolfbuoy.simulate(scene)
    H, V = record.anchor_horizontal.values[:, 0], record.anchor_uplift.values[:, 0]
    np.testing.assert_allclose(record.needed_weight.values[:, 0], H / 0.5 + V, rtol=1e-14)
    use = record.anchor_use.values[:, 0]
    np.testing.assert_allclose(use, (H / 0.5 + V) / 100.0, rtol=1e-13)
    (said,) = [sentence for sentence in warnings(record, scene) if "would not hold" in sentence]
    assert f"{use.max():.4g} times what it holds at t = {record.time.values[use.argmax()]:g} s" in said


@pytest.mark.parametrize(("use", "count"), [(0.999, 0), (1.0, 0), (1.001, 1), (1.05, 1)])
def test_what_is_more_than_an_anchor_holds_is_told(use, count):
    """Reported from a utilisation of 1, at which the anchor just holds."""
    scene = load_scene(RUN | {"anchor": {"holding_capacity": 1e6}})
    record = dolfbuoy.solve_static(scene)
    record["anchor_use"] = 0 * record.anchor_use + use
    assert sum("would not hold" in sentence for sentence in static_warnings(record, scene)) == count


def test_one_table_serves_all_anchors():
    scene = load_scene("three-legs", anchor={"weight": 5e4, "friction": 0.6})
    found = dolfbuoy.solve_static(scene)
    assert found.anchor_use.shape == (3,)
    np.testing.assert_allclose(
        found.anchor_use, (found.anchor_horizontal / 0.6 + found.anchor_uplift) / 5e4, rtol=1e-12
    )


SINKER = {"weight": 1e4, "friction": 0.5}


@pytest.mark.parametrize(
    ("anchor", "said"),
    [
        ({}, "anchor.weight: must be given, with friction, or else holding_capacity"),
        ({"weight": 1e4}, "anchor.friction: must be given, with weight"),
        ({"holding_capacity": 1e4, "friction": 0.5}, "anchor.friction: must be given, with weight, and not without it"),
        (SINKER | {"holding_capacity": 1e4}, "anchor.weight: must be given, with friction, or else holding_capacity"),
        (SINKER | {"at": "port.from"}, "anchor.at = 'port.from': must be one of the anchors: cable.from"),
        ([SINKER, SINKER], "anchor.at = 'cable.from': is given twice"),
        (SINKER | {"friction": 0.0}, "anchor.friction"),
    ],
)
def test_what_is_no_anchor(anchor, said):
    with pytest.raises(InputError) as error:
        load_scene(RUN | {"anchor": anchor})
    assert said in str(error.value)


def test_no_anchor_is_forgotten():
    with pytest.raises(InputError, match=r"for north.from, south.from too"):
        load_scene("three-legs", anchor=[SINKER | {"at": "east.from"}])


def test_a_sinker_is_pulled_by_both_horizontal_components():
    """H/mu + V, whichever way H points."""
    design = Design.__new__(Design)
    design.anchors, design.given = ["a", "b"], {"a": SimpleNamespace(friction=0.5), "b": SimpleNamespace(friction=0.8)}
    pulls = np.array([[[300.0, 400.0, 100.0], [0.0, 80.0, -20.0]]])
    np.testing.assert_allclose(design.needed_weight(pulls), [[500 / 0.5 + 100, 80 / 0.8 - 20]])


def test_ends_of_a_line_are_anchors_by_their_own_names():
    """The lower of two fixed ends, or both at equal height; from and to as defined."""
    line = {"length": 30.0, "line_density": 5.0, "axial_stiffness": 1e6}
    for low, high, expected in (
        ([0.0, 0, -9.0], [20.0, 0, -1.0], {"one.from": [(0, 0)]}),
        ([0.0, 0, -1.0], [20.0, 0, -9.0], {"one.to": [(0, 1)]}),
        ([0.0, 0, -5.0], [20.0, 0, -5.0], {"one.from": [(0, 0)], "one.to": [(0, 1)]}),
    ):
        scene = load_scene({"cable": [line | {"name": "one", "from": low, "to": high}]})
        assert anchors_of(scene.network) == expected
