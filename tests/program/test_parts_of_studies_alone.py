"""Parts of derivatives, designs, take-offs, pages and studies, each alone.

Source: closed forms and made-up rows; nothing is run.
"""

import importlib
import re
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
import xarray as xr
from chains import CHAIN
from made_up import SCENE
from ufl import as_ufl

from dolfbuoy import InputError, load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.forms import take_off
from dolfbuoy.meshes.files import read_nodes
from dolfbuoy.page.run_page import inputs, movers
from dolfbuoy.results import linear_record
from dolfbuoy.scene.inputs import inputs_of
from dolfbuoy.sensitivity.expressions import Dual
from dolfbuoy.sensitivity.parameters import Parameter, parameters_of
from dolfbuoy.sensitivity.uncertainty import _of
from dolfbuoy.studies import sweep
from dolfbuoy.studies.accuracy import pilot, report_text, work_precision
from dolfbuoy.studies.physics import energy

# -- take-offs and files -----------------------------------------------------------------------------------------------


def test_energies_of_a_take_off():
    """1/2 k (l - l_0)^2 of its spring, T_0 l of its pretension, 1/2 k_s of what is beyond its stops."""
    stretch = SimpleNamespace(length=as_ufl(7.5), rate=None)
    spring = SimpleNamespace(stiffness=4e3, length=7.0, longest=7.2, shortest=6.0)
    assert float(take_off.spring_energy(spring, stretch)) == pytest.approx(0.5 * 4e3 * 0.5**2)
    assert float(take_off.pretension_energy(300.0, stretch)) == pytest.approx(300 * 7.5)
    assert float(take_off.stops_energy(spring, stretch)) == pytest.approx(0.5 * 4e3 * 0.3**2)
    short = SimpleNamespace(length=as_ufl(5.6), rate=None)
    assert float(take_off.stops_energy(spring, short)) == pytest.approx(0.5 * 4e3 * 0.4**2)


@pytest.mark.parametrize(("first", "good"), [(0.0, True), (0.003, False), (-0.003, False)])
def test_a_mesh_of_a_line_begins_at_its_lower_end(first, good, tmp_path):
    points = np.array([[first, 0, 0], [4.0, 0, 0], [10.0, 0, 0]])
    meshio.Mesh(points, [("line", [[0, 1], [1, 2]])]).write(tmp_path / "line.vtu")
    if good:
        assert read_nodes(tmp_path / "line.vtu").tolist() == [0.0, 4.0, 10.0]
        return
    with pytest.raises(ValueError, match="not at 0"):
        read_nodes(tmp_path / "line.vtu")


def test_shapes_of_some_cables():
    """Of those that there are; others have their own."""
    line = {"length": 30.0, "line_density": 5.0, "axial_stiffness": 1e6, "from": [0, 0, 0]}
    cables = [line | {"name": name, "to": [20.0, y, 0.0]} for name, y in (("fore", 0.0), ("aft", 9.0))]
    shape = [[0.0, 0.0, 0.0], [10.0, 0.0, -11.0], [20.0, 0.0, 0.0]]
    assert load_scene(
        {"cable": cables, "initial": {"kind": "polyline", "points": {"fore": shape}}},
    )
    with pytest.raises(InputError, match=r"initial\.points = .*port.*: must be of the cables: fore, aft"):
        load_scene({"cable": cables, "initial": {"kind": "polyline", "points": {"fore": shape, "port": shape}}})


# -- derivatives and designs -------------------------------------------------------------------------------------------


def test_both_neighbours_of_a_number_must_be_scenes(monkeypatch):
    seen, whole = [], Parameter.scene_at
    monkeypatch.setattr(Parameter, "scene_at", lambda self, scene, x: seen.append(x) or whole(self, scene, x))
    (one,) = parameters_of(load_scene(CHAIN), ["cable.length"])
    assert seen == [-one.distance, one.distance]
    assert one.distance > 0


def test_a_run_that_fails_is_beyond_every_limit():
    """As far on the wrong side of each as the rule says, with the slopes that were known last."""
    module = importlib.import_module("dolfbuoy.sensitivity.design")
    limits = [
        SimpleNamespace(bound=700.0, sign=1),
        SimpleNamespace(bound=-3.0, sign=-1),
        SimpleNamespace(bound=0.0, sign=1),
    ]
    slopes = [np.array([1.0, 2.0]), np.array([3.0, 4.0]), np.array([5.0, 6.0])]
    known = [Dual(1.0, slope) for slope in slopes]
    search = SimpleNamespace(limits=limits, _last=(Dual(5.0, np.array([7.0, 8.0])), known))
    least, far = module._Search._lost(search, np.zeros(2))
    assert least.value == 5.0 * (1 + module.LOST)
    assert [one.value for one in far] == [700 * (1 + module.LOST), -3 * (1 + module.LOST), module.LOST]
    assert all((limit.bound - one.value) * limit.sign < 0 for limit, one in zip(limits, far, strict=True))
    assert [one.slope.tolist() for one in far] == [slope.tolist() for slope in slopes]
    first, others = module._Search._lost(SimpleNamespace(limits=limits, _last=None), np.zeros(2))
    assert [first.value, *(one.value for one in others)] == [np.inf] * 4


def test_a_limit_of_a_part_is_held_against_its_own_bar(monkeypatch):
    """Of two cables the second; a limit of all of them against each, and what is not known is said where it varies."""
    design = importlib.import_module("dolfbuoy.sensitivity.design")
    rows = [("tension_top.max", part, value, bar) for part, value, bar in (("one", 900.0, 50.0), ("two", 980.0, 5.0))]
    rows += [
        (f"tension_top.{end}", part, value, 0.0)
        for part in ("one", "two")
        for end, value in (("std", 30.0), ("mean", 700.0))
    ]
    data = dict(zip(("output", "output_of", "bar_value", "bar"), zip(*rows, strict=True), strict=True))
    data["bar_verdict"] = ["both", design.NONE, *["both"] * 4]
    record = xr.Dataset({name: ("output", list(values)) for name, values in data.items()})
    monkeypatch.setattr(design, "simulate", lambda *_, **__: record)
    told = []
    for text in ("tension_top.max[two] < 1000", "tension_top.max[one] < 940", "tension_top.max < 1000"):
        dataset = xr.Dataset()
        search = SimpleNamespace(limits=[design._limit(text)], cases=[{}], needs_run=True)
        told.append((design._within_bars(SCENE, search, dataset), dataset.limit_bar.values.tolist()))
    assert told == [
        (["tension_top.max[two] < 1000: nothing is known of the error of 980."], [5.0]),
        (["tension_top.max[one] < 940: its error bar reaches beyond, 900 +- 50."], [50.0]),
        (["tension_top.max < 1000: nothing is known of the error of 980."], [50.0]),
    ]


def test_a_pilot_has_errors_of_what_changes_little():
    """A range of half a metre is one; what stays as it is has none."""
    t = np.linspace(0.0, 10.0, 101)
    whole, off, still = (
        SimpleNamespace(t=t, values={"heave": values})
        for values in (0.25 * np.cos(np.pi * t), 0.25 * np.cos(np.pi * t) + 0.05, np.full(101, 2.0))
    )
    asked = SimpleNamespace(start=0.0, quantity="heave")
    assert pilot.Pilot.difference(asked, off, whole) == pytest.approx(0.1)
    with pytest.raises(InputError, match="--quantity heave: it does not change"):
        pilot.Pilot.difference(asked, off, still)


def test_a_case_that_will_not_run_is_no_work():
    """Others take what the whole scene takes, in proportion to their steps."""
    whole, half = (sweep._work(SCENE, {"changes": {"time.end": end}}) for end in (SCENE.time.end, SCENE.time.end / 2))
    assert whole == pytest.approx(2 * half)
    assert half > 0
    assert sweep._work(SCENE, {"changes": {"cable.length": -1.0}}) == 0.0


# -- pages and notes ---------------------------------------------------------------------------------------------------


def test_inputs_of_a_page_are_counted():
    text = inputs(SCENE, "waves, current")
    assert f"<summary>{len(inputs_of(SCENE))} values that differ from their defaults</summary>" in text
    assert text.count("<tr>") == len(inputs_of(SCENE)) + 1
    assert "Effects: waves, current" in text
    assert "Effects" not in inputs(SCENE, "")


def test_bars_of_what_moves_the_answer():
    """To the right or to the left of the middle, the largest 30 wide, the others in proportion to it."""
    values = np.array([[4.0], [-8.0], [1.0], [np.nan]])
    data = {"elasticity": (("parameter", "output"), values), "parameter_value": ("parameter", [1.0, 2.0, 3.0, 4.0])}
    data["parameter_unit"] = "parameter", np.array(["m"] * 4, dtype=object)
    labels = {"parameter": np.array(list("abcd"), dtype=object), "output": np.array(["offset.mean"], dtype=object)}
    labels["output_of"] = "output", np.array(["buoy"], dtype=object)
    text = movers(xr.Dataset(data, labels, {"scene": SCENE.to_toml()}), SCENE)
    bars = [tuple(map(float, pair)) for pair in re.findall(r'<rect x="([^"]*)" y="1" width="([^"]*)"', text)]
    assert bars == [(0.0, 30.0), (30.0, 15.0), (30.0, 3.75), (30.0, 0.0)]


def test_why_a_stiffness_is_not_symmetric():
    """Of a buoy by the torques of its quaternion, of a vessel by a moment about axes that do not turn."""
    even, odd = np.eye(3) * 1e3, np.eye(3) * 1e3
    odd[0, 1] = 1.0
    scene = load_scene(CHAIN)
    dims = ("reaction", "motion")
    for name, words in (("total", "the quaternion's torques"), ("vessel_mooring", "a moment about fixed axes")):
        said = linear_record.notes(xr.Dataset({name: (dims, odd)}), scene)
        assert said[-1] == f"The matrices are not symmetric: current, wind and {words} have no potential."
        assert len(linear_record.notes(xr.Dataset({name: (dims, even)}), scene)) == len(said) - 1
    bed = load_scene("chain-on-bed")
    assert linear_record.on_friction(bed)[0].startswith("Friction of the bed sticks")
    assert linear_record.on_friction(load_scene(bed, seabed__friction=0.0)) == [
        "Friction of the bed is 0: what lies slides freely."
    ]
    assert linear_record.on_friction(scene) == []


# -- studies -----------------------------------------------------------------------------------------------------------


def test_errors_of_schemes_are_drawn_in_per_cent():
    """Over seconds, fixed steps apart from adaptive ones."""
    rows = [
        {
            "pair": "P1-P0",
            "cells": 4,
            "scheme": scheme,
            "tolerance": tolerance,
            "own": k == 0,
            "reason": None,
            "wall": wall,
        }
        | {report_text.ERROR_IN_TIME: error, "step": 0.1}
        for k, (scheme, tolerance, wall, error) in enumerate(
            [
                ("backward-euler", None, 2.0, 0.03),
                ("bdf2", None, 4.0, 0.001),
                ("bdf2", None, 1.0, 0.02),
                ("bdf2", 1e-3, 3.0, 0.005),
            ]
        )
    ]
    (axes,) = report_text.draw([{"name": "short", "rows": rows}]).axes
    found = {line.get_label(): line.get_xydata().tolist() for line in axes.lines}
    assert found["backward Euler"] == [[2.0, pytest.approx(3.0)]]
    assert found["BDF2"] == [[1.0, pytest.approx(2.0)], [4.0, pytest.approx(0.1)]]
    assert found["BDF2, adaptive"] == [[3.0, pytest.approx(0.5)]]


def test_errors_of_a_reference_by_richardson(monkeypatch):
    """A third of the change to a run of half as many steps, of rms and maximum each."""
    changes = SimpleNamespace(rms=0.03, maximum=0.06)
    monkeypatch.setattr(work_precision, "Reference", lambda *_: SimpleNamespace(error=lambda *_: changes))
    monkeypatch.setattr(work_precision.Run, "kept", lambda file: file)
    monkeypatch.setattr(work_precision, "mark", lambda rows, own: rows)
    scene = load_scene("short")
    _, own = work_precision.judged([], scene, {"file": "a"}, {"file": "b"})
    assert {name: (one.rms, one.maximum) for name, one in own.items()}["tension_top"] == pytest.approx((0.01, 0.02))


def test_steps_of_the_balance_of_energy():
    """Those of a scene of one's own too: halved from 0.04 s on."""
    found = energy.cases("wave-rider")
    assert [row["step"] for row in found if row["scheme"] == "bdf2"] == [0.04, 0.02, 0.01]
    assert {row["t_end"] for row in found} == {20.0}


def test_how_many_runs_failed():
    """More than a part of them leaves no spread to speak of."""
    rows = [{"outputs": [["tension_top", "max", "", 5.0]]}, {"failed": "The line goes slack."}]
    with pytest.raises(SolveError, match=r"^1 of 2 runs failed: The line goes slack\.$"):
        _of(rows, None)
