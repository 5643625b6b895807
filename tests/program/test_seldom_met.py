"""Rare cases: vectors among parameters, submerged buoys, seas far from the origin, hairpins, limits met exactly.

Source: the numbers by hand, and the messages about them.
"""

import importlib
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import load_scene
from dolfbuoy.check import potential_flow, report
from dolfbuoy.coupling import Session
from dolfbuoy.errors import InputError
from dolfbuoy.model import memory_fit
from dolfbuoy.motion.stepping import JumpControl
from dolfbuoy.sensitivity.derivatives import _outputs
from dolfbuoy.statics.catenary import Catenary
from dolfbuoy.statics.network import LYING, Joint, Network, Piece, Rest
from dolfbuoy.statics.on_bed import Bed
from dolfbuoy.studies.physics import hull

snapshot = importlib.import_module("dolfbuoy.results.snapshot")

CYLINDER = {"hull": [[0.0, 1.0], [2.0, 1.0]], "mass": 500.0}
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


@pytest.mark.parametrize(("rows", "columns"), [("0 0\n60 1.5\n", 2), ("0 0 0\n60 1.5 0\n", 3)])
def test_a_tide_in_a_file_has_two_columns(rows, columns, tmp_path):
    (tmp_path / "tide.txt").write_text(rows)
    sea = {
        "sea": {"depth": 20.0, "tide": str(tmp_path / "tide.txt")},
        "buoy": {"hull": [[0, 1], [2, 1]], "mass": 500.0},
    }
    if columns == 2:
        assert [list(row) for row in load_scene(sea).sea.tide] == [[0.0, 0.0], [60.0, 1.5]]
    else:
        with pytest.raises(InputError, match=r"sea\.tide"):
            load_scene(sea)


def test_a_free_hull_of_the_study_bears_nothing_but_itself():
    """Draft and stiffness of a cylinder by hand."""
    cylinder = load_scene({"sea": {"depth": 20.0, "density": 1000.0}, "buoy": CYLINDER})
    area = np.pi / 4
    found = hull._floating(cylinder)
    assert found.draft == pytest.approx(0.5 / area, rel=1e-9)
    assert found.heave_stiffness == pytest.approx(1000.0 * 9.81 * area, rel=1e-9)


def test_a_step_is_halved_down_to_a_64th():
    for parts, counts in ((63.5, False), (64.5, True)):
        assert JumpControl(1.0).judge(2 / parts, (9.0, 1.0)) is counts


def test_one_per_cent_beyond_the_rows_is_allowed(monkeypatch):
    said = []
    top = Fake(name="top", top=Fake(motion=[[0.0, 0.0, 0.0, 0.0], [9.0, 0.0, 0.0, 0.0]]))
    network = Fake(pieces=[Fake(ends=[top])], ends_of=lambda cable: [])
    monkeypatch.setattr(report, "_jump", lambda top: (False, 0.0))
    for beyond in (0.01, 0.0101):
        monkeypatch.setattr(report, "overshoot", lambda rows, beyond=beyond: beyond)
        warn = lambda wrong, text: said.append((wrong, text[:27]))  # noqa: E731
        report._motions(Fake(network=network, time=None, vessel=None, waves=None), Fake(warn=warn))
    assert [wrong for wrong, text in said if text == "The motion of top goes 1 % "] == [False, True]


def test_energy_that_states_give_back():
    """The most negative of the damping over all frequencies, up to three times the highest of the file."""
    omega = np.linspace(0.1, 5.0, 50)
    peak = np.exp(-(((omega - 2.0) / 0.3) ** 2))[:, None, None]
    kernel = memory_fit.Kernel(omega, peak, 0 * peak)
    rate, into = np.array([-0.4 + 2.0j, -0.5 + 3.0j]), np.array([[1.0 + 0j], [1.0 + 0j]])
    found = memory_fit._judged(kernel, kernel.transformed(omega), 4, rate, into, False)
    lowest = (found.at(np.linspace(0.0, 15.0, 1500)) / kernel.scale / kernel.scale)[:, 0, 0].real.min()
    assert lowest < -1e-3
    assert found.given_back == pytest.approx(-lowest, rel=1e-9)


def test_a_session_that_goes_on_solves_for_nothing_again(tmp_path, monkeypatch):
    scene = {
        "cable": LINE | {"axial_stiffness": 1e4, "anchor": [0.0, 0.0, -9.0], "elements": 3, "top": {"kind": "free"}}
    }
    scene |= {"gravity": 9.81, "time": {"end": 1.0, "step": 0.1}}
    with Session(scene, tmp_path) as session:
        session.advance_to(0.5)
    monkeypatch.setattr(Session, "_find_required", lambda session: pytest.fail("it was known"))
    with Session(resume=tmp_path) as session:
        assert session.t == pytest.approx(0.5)


@pytest.mark.parametrize(("turn", "taken"), [(79.0, True), (81.0, False)])
def test_directions_that_turn_may_have_any_length(turn, taken):
    rows = [[0.0, 0.0, 0.0, 9.0], [1.0, 0.0, 7.0 * np.sin(np.radians(turn)), 7.0 * np.cos(np.radians(turn))]]
    end = {"motion": rows}
    line = LINE | {"axial_stiffness": 1e4, "bending_stiffness": 9.0, "anchor": [0.0, 0.0, -9.0], "to_end": end}
    scene = {"sea": {"depth": 20.0}, "cable": line | {"top": {"kind": "fixed", "position": [0.0, 0.0, 0.9]}}}
    if taken:
        assert load_scene(scene).cable[0].to_end.motion == [tuple(row) for row in rows]
    else:
        with pytest.raises(InputError, match="turn by less than 80 degrees"):
            load_scene(scene)
