"""What few scenes meet: vectors among parameters, buoys under water, seas far from the origin, hairpins, no tables.

Source: the numbers by hand, and what is said of them.
"""

import importlib
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import load_scene
from dolfbuoy.check import potential_flow
from dolfbuoy.errors import InputError
from dolfbuoy.sensitivity.derivatives import _outputs
from dolfbuoy.statics.catenary import Catenary
from dolfbuoy.statics.network import LYING, Joint, Network, Piece, Rest
from dolfbuoy.statics.on_bed import Bed

snapshot = importlib.import_module("dolfbuoy.results.snapshot")

LINE = {"length": 10.0, "diameter": 0.1, "line_density": 1.0}


@pytest.mark.parametrize("given", [5, "x", None, [1]])
def test_a_joint_and_a_body_that_are_no_tables(given):
    sea, ends = {"sea": {"depth": 20.0}}, {"anchor": [0.0, 0.0, -5.0], "to": "a"}
    with pytest.raises(InputError, match=r"joint\.0 = .*: must be a section, a table of keys"):
        load_scene(sea | {"cable": [LINE | ends], "joint": [given]})
    if given is None:  # a segment without a body
        return
    with pytest.raises(InputError, match=r"segments\.0\.body = .*: must be a section, a table of keys"):
        load_scene(sea | {"cable": [ends | {"segments": [LINE | {"body": given}, LINE]}], "joint": [{"name": "a"}]})


def test_elasticities_of_numbers_and_vectors():
    """A vector is varied by a factor: its elasticity is the derivative over the output, with no size of its own."""
    scene = load_scene({
        "cable": {**LINE, "anchor": [0.0, 0.0, -5.0], "top": {"kind": "fixed", "position": [0.0, 0.0, 4.0]}},
        "time": {"end": 5.0, "step": 1.0},
    })  # fmt: skip
    t, shape = np.arange(6.0), ("time", "cable")
    level = lambda x: {"tension_top": np.full((6, 1), x)}  # noqa: E731
    found = xr.Dataset(
        {"tension_top": (shape, level(10.0)["tension_top"], {"units": "N", "long_name": "top tension"})},
        {"time": t, "cable": np.array(["cable"], dtype=object), "parameter": np.array(["a", "b"], dtype=object)},
    )
    parameters, pairs = [Fake(value=np.nan), Fake(value=3.0)], [(level(9.0), level(11.0))] * 2
    data = _outputs(scene, parameters, found, pairs, np.array([1.0, 1.0]))
    mean = data.sel(output="tension_top.mean")
    assert mean.output_value == pytest.approx(10.0)
    assert mean.d_output.values == pytest.approx([2.0, 2.0])
    assert mean.elasticity.values == pytest.approx([0.2, 0.6])


@pytest.mark.parametrize("drowned", [True, False])
def test_draft_of_a_file_beside_that_of_a_buoy_under_water(drowned, monkeypatch):
    """A buoy under water has no draft at rest, with which that of the file could be compared."""
    said, none = [], Fake(undisturbed=None, omega=np.ones(1), damping=np.ones((1, 3, 3)), force=np.ones((1, 3)))
    monkeypatch.setattr(potential_flow, "coefficients_of", lambda scene, buoy: none)
    monkeypatch.setattr(potential_flow, "draft_of", lambda scene, buoy: 0.8)
    report = Fake(warn=lambda wrong, text: said.append(text) if wrong else None)
    buoy = Fake(section=None, drowned=drowned, pull=0.0, under=lambda pull: Fake(draft=1.6))
    monkeypatch.setattr(potential_flow, "wavenumbers", lambda *_: 1 / 0)  # what follows is of no concern here
    with pytest.raises(ZeroDivisionError):
        potential_flow._hull(None, buoy, report)
    assert ["0.8 m, the buoy floats at 1.6 m" in text for text in said] == [True] * (not drowned)


@pytest.mark.parametrize("y", [0.0, -500.0])
def test_arrows_in_the_water_stand_wherever_the_buoy_is(y):
    """Eight columns between the bed and the surface."""
    now = Fake(
        buoys=[],
        alone=False,
        direction_deg=0.0,
        bed=-20.0,
        elevation=lambda x: np.zeros(x.shape[:-1]),
        in_hull=lambda points: np.zeros(len(points), dtype=bool),
    )
    points, spacing = snapshot._plane(now, np.array([[-35.0, y - 35.0, -30.0], [35.0, y + 35.0, 10.0]]))
    assert spacing == pytest.approx(9.0)
    assert sorted(set(points[:, 0])) == pytest.approx(np.linspace(-31.5, 31.5, 8))
    assert len(points) == 8 * 3
    assert points[:, 1] == pytest.approx(y)
    assert (points[:, 2] > -20.0).all()


@pytest.mark.parametrize(("share", "hangs"), [(0.9, True), (1.1, False)])
def test_a_hairpin_that_hardly_touches_the_bed_hangs(share, hangs):
    """A length that lies counts from a part of the piece's own length on."""
    L, w = 100.0, 2.0
    joints, bed = [Joint([0.0, 0.0, 0.0]), Joint([0.0, 0.0, 0.0], free=True)], Bed(np.array([0.0, 0.0, 1.0]), 0.0)
    network = Network(joints, [Piece(0, 1, L, w, 1e6)], bed)
    pull = np.array([[0.0, 0.0, -w * L / 2]])
    rest = Rest(network, np.zeros((2, 3)), pull, np.array([share * LYING * L]), np.zeros((1, 2, 3)) + [0.0, 0.0, 50.0])
    assert isinstance(rest.shapes[0], Catenary) == hangs
