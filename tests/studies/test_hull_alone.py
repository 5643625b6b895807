"""Parts of the hull study and of the wave runs that check linear responses, each alone.

Source: made-up amplitudes, levers and records, and the same numbers by hand; nothing is run.
"""

import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_up import RECORD, SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.linear.moving import Motions
from dolfbuoy.linear.seaway import Response
from dolfbuoy.model.rigid import mass_properties
from dolfbuoy.studies.physics import hull, response_runs

FREE = load_scene("free-buoy")
MASS = mass_properties(next(iter(FREE.network.buoys.values())))

# -- hulls -------------------------------------------------------------------------------------------------------------


def test_potential_flow_beside_strips(monkeypatch):
    """With mass and stiffness of the free buoy, by hand; as complex numbers, the shortest period first."""
    asked = []
    floating = SimpleNamespace(heave_stiffness=3e4, GM=0.25, draft=1.0)
    monkeypatch.setattr(hull, "_floating", lambda scene: floating)

    def answers(*given):
        asked.append(given)
        return [[2.0, 1.0, 0.1j], [1.0, 0.0, -0.2]]

    flow = SimpleNamespace(periods=[8.0, 5.0], responses=answers, depth=77.0)
    monkeypatch.setattr(hull, "read_capytaine", lambda file: {"a.nc": flow}[file])
    own = [
        Response(T, k, Motions(surge=2.0 + 0.02j, sway=0, heave=heave, roll=0, pitch=0.1j, yaw=0))
        for T, k, heave in ((8.0, 0.05, 0.9), (5.0, 0.1, 0.5))
    ]
    monkeypatch.setattr(hull, "responses", lambda scene, periods, direction: own if direction == 30.0 else None)
    found = hull._flow(FREE, {"file": "a.nc", "direction": 30.0})
    stiffness = (0.0, 3e4, pytest.approx(MASS.mass * FREE.gravity * 0.25))
    assert asked == [((MASS.mass, MASS.mass, MASS.inertia[0]), stiffness)]
    assert found["depth"] == 77.0
    short, long = found["rows"]
    assert (short["period"], long["period"]) == (5.0, 8.0)
    assert long["surge_difference"] == pytest.approx(1.0)
    assert long["heave_difference"] == pytest.approx(10.0)
    assert (long["surge_flow"], long["surge"]) == (2.0, pytest.approx(abs(2.0 + 0.02j)))
    assert (long["pitch_flow_phase"], long["pitch_difference"]) == (pytest.approx(90.0), 0.0)
    assert long["pitch_over_slope_flow"] == pytest.approx(0.1 / 0.05)
    assert (short["heave_difference"], short["heave_flow"]) == (None, 0.0)
    assert short["pitch_difference"] == pytest.approx(100 * abs(0.1j + 0.2) / 0.2)


@pytest.mark.parametrize(
    ("levers", "vanishing", "largest", "at"),
    [
        ([0.0, 1.0, 2.0, 1.0, -1.0, 3.0], 35.0, 2.0, 20.0),
        ([0.0, 1.0, 2.0, 1.0, 0.5, 0.1], None, 2.0, 20.0),
        ([0.0, 1e-9, -1.0, 1.0, 0.5, 2.0], None, 2.0, 50.0),
        ([0.0, 1.0, -1.0, 4.0, 5.0, -5.0], 15.0, 1.0, 10.0),
        ([0.0, 0.5, 1e-9, 4.0, 0.0, 0.0], 20.0, 0.5, 10.0),
    ],
)
def test_where_a_hull_loses_its_stability(levers, vanishing, largest, at):
    """On the line between two heels, beyond the first; the largest lever up to there."""
    rows = [{"heel_deg": 10.0 * k, "lever": lever} for k, lever in enumerate(levers)]
    found = hull._stability(rows)
    assert found["vanishing"] == (None if vanishing is None else pytest.approx(vanishing, abs=1e-6))
    assert (found["largest"], found["heel_of_largest"]) == (largest, at)


@pytest.mark.parametrize(("off", "good"), [(None, True), (0.0, True), (0.9e-3, True), (-0.9e-3, True), (1.1e-3, False)])
def test_pitch_of_potential_flow_is_about_the_centre(off, good, monkeypatch):
    """To a thousandth of the diameter at the keel."""
    floating = hull._floating(FREE)
    diameter = next(iter(FREE.network.buoys.values())).hull[-1][0]
    center = None if off is None else MASS.height - floating.draft + off * diameter
    monkeypatch.setattr(hull, "read_capytaine", lambda file: SimpleNamespace(rotation_height=center))
    if good:
        assert hull.request(FREE, "none", 10.0, "a.nc") == {
            "scene": FREE,
            "runs": [],
            "direction": 10.0,
            "capytaine": "a.nc",
        }
        return
    with pytest.raises(InputError, match=r"a\.nc: pitch is counted about a point"):
        hull.request(FREE, "none", 10.0, "a.nc")


def test_a_cable_that_drowns_its_buoy(monkeypatch):
    """Is a reason; without a cable nothing pulls."""
    monkeypatch.setattr(hull, "righting_curve", lambda scene, heels, pull: [])
    monkeypatch.setattr(hull, "_stability", lambda levers: {})
    assert hull._hydrostatics(FREE, None)["numbers"]["pull"] == 0.0
    gone = []
    problem = SimpleNamespace(end_tension=lambda: (0.0, 0.0, 5e9), destroy=lambda: gone.append(True))
    monkeypatch.setattr(hull, "solve_equilibrium", lambda scene, comm: problem)
    with pytest.raises(SolveError, match=r"pulls at the buoy with 5e\+09 N, under which it cannot float upright"):
        hull._hydrostatics(load_scene("short"), None)
    assert gone == [True]


def test_a_run_beside_a_response(monkeypatch):
    """In waves of a thousandth of the diameter, from the same side."""
    asked, motions = [], dict.fromkeys(hull.MOTIONS, 1.0 + 0j)
    monkeypatch.setattr(hull, "measured", lambda *given: asked.append(given[1:]) or motions)
    own = Response(6.0, 0.1, Motions(surge=1.1, sway=0, heave=1.0, roll=0, pitch=0.9, yaw=0))
    monkeypatch.setattr(hull, "responses", lambda *given: asked.append(given[1:]) or [own])
    (row,) = hull._run(FREE, {"period": 6.0, "direction": 40.0})["rows"]
    widest = max(diameter for _, diameter in FREE.buoy[0].hull)
    assert asked == [(6.0, 40.0, pytest.approx(1e-3 * widest)), ([6.0], 40.0)]
    assert (row["period"], row["surge_difference"], row["heave_run"]) == (6.0, pytest.approx(10.0), 1.0)
    assert row["pitch_over_slope_run"] == pytest.approx(10.0)


def response_row(held, period):
    """A row of the response, each number of its own."""
    row = {"held": held, "period": period, "wavelength": 1.5 * period**2}
    for k, name in enumerate((*hull.MOTIONS, "pitch_over_slope")):
        row |= {name: period / (k + 2), f"{name}_phase": 10.0 * k - period}
    return row


def compared_row(held, period, name):
    row = {"held": held, "period": period, f"pitch_over_slope_{name}": 0.7}
    for motion in hull.MOTIONS:
        row |= {f"{motion}_{name}": 0.5, f"{motion}_{name}_phase": 20.0, motion: 0.4, f"{motion}_difference": 3.0}
    return row


def test_tables_of_a_hull(tmp_path, monkeypatch):
    """Whole periods alone are shown; reasons of what fails; depths of potential flow."""
    numbers = {key: float(k) for k, key in enumerate(hull.NUMBERS)}
    cases = []
    for held in ("moored", "free"):
        levers = [{"heel_deg": heel, "lever": heel / 90} for heel in (0.0, 90.0, 180.0)]
        cases.append({"part": "hydrostatics", "held": held, "rows": levers, "numbers": numbers})
        rows = [response_row(held, T) | {"held": None} for T in (4.0, 4.5, 18.0)]
        rows = [{key: x for key, x in row.items() if key != "held"} for row in rows]
        cases.append({"part": "response", "held": held, "rows": rows, "natural": [{"motion": "heave", "period": 3.0}]})
    cases.append({"part": "run", "held": "moored", "reason": "it falls."})
    cases.append({"part": "run", "held": "free", "rows": [compared_row("free", 6.0, "run")]})
    cases.append({"part": "flow", "held": "free", "depth": 40.0, "rows": [compared_row("free", 8.0, "flow")]})
    monkeypatch.setattr(hull, "evaluate_all", lambda *_: cases)
    tables = hull.study(tmp_path, load_scene("short"), [], 30.0)
    assert [table.name for table in tables] == [
        "hull", "hull-righting", "hull-periods", "hull-response", "", "hull-runs", "hull-potential-flow",
    ]  # fmt: skip
    assert tables[0].notes == ["run, moored: it falls."]
    assert tables[0].rows[3] == {"quantity": "draft", "unit": "m", "moored": 3.0, "free": 3.0}
    assert [row["period"] for row in tables[4].rows] == [4.0, 18.0] * 2
    assert tables[4].title.strip().startswith("Response to small waves towards 30 degrees")
    shortest = (
        2
        * math.pi
        / math.sqrt(hull.LARGEST_KR * 9.81 / (hull.shape_of(hull._buoy(load_scene("short"))).max_diameter / 2))
    )
    assert tables[4].notes[0].startswith(f"Below {shortest:.2g} s")
    assert tables[6].title.startswith("\nPotential flow (depth 40 m, here 20 m)")
    assert [row["held"] for row in tables[5].rows] == ["free"]
    top, below = (tables[3].figure.axes[k] for k in (0, 3))
    marks = [(line.get_marker(), line.get_color(), line.get_xdata().tolist()) for line in top.lines]
    blue, red, ink = hull.COLOR["moored"], hull.COLOR["free"], hull.COLORS["ink"]
    assert marks == [
        ("None", blue, [4.0, 4.5, 18.0]),
        ("None", red, [4.0, 4.5, 18.0]),
        ("o", red, [6.0]),
        ("+", ink, [8.0]),
    ]
    assert len(below.lines) == 4
    assert top.get_ylim() == pytest.approx((0.0, 1.08 * 3 * 2.25))  # a peak of 9 beyond three times the median
    (righting,) = tables[1].figure.axes
    assert [line.get_color() for line in righting.lines[:4]] == [blue, blue, red, red]
    assert righting.lines[1].get_ydata().tolist() == [0, numbers["GM"] * math.radians(20)]


# -- runs in waves -----------------------------------------------------------------------------------------------------


def test_what_is_compared_with_a_run():
    """Motions, turns and tensions with their like: what is below 2 % of the largest does not count, nor does yaw."""
    run = {"surge": 1.0, "sway": 0.0201, "heave": 0.02, "roll": 0.5j, "pitch": -0.01, "yaw": 9.0, "seconds": 1.0}
    run |= {"tension_top": 100.0, "tension_anchor_a": 3.0, "heave of b": -2.0, "surge of b": 0.1}
    own = {name: 1.1 * abs(x) * cmath.exp(1j) for name, x in run.items() if name != "surge of b"}
    found = response_runs.compared(own, run)
    assert set(found) == {"surge", "heave of b", "roll", "tension_top", "tension_anchor_a"}
    assert all(x == pytest.approx(10.0) for x in found.values())
    assert set(response_runs.compared(own, run | {"heave of b": 0.1})) - set(found) == {"sway"}
    assert "heave" not in response_runs.compared(own, run | {"heave of b": 0.1})


def test_a_run_in_a_sea(monkeypatch):
    """Ten peak periods to grow and ten to settle, then 180, of steps of a 200th; the linear answer over the same."""
    asked = []
    monkeypatch.setattr(
        response_runs, "simulate", lambda scene, comm: asked.append(scene) or SimpleNamespace(attrs={"failed_steps": 0})
    )
    waves = load_scene("storm").waves
    T = waves.main_period
    t = np.linspace(0.0, 200 * T, 401)
    heave = np.where(t > 20 * T, np.where(np.arange(401) % 2, 3.0, -3.0), 99.0)
    monkeypatch.setattr(
        response_runs, "_history", lambda scene, direction: asked.append(scene) or (t, {"heave": heave}, None)
    )
    closed = []

    class Seaway:
        def __init__(self, scene, direction):
            asked.append((scene.waves, direction))

        def over_time(self, given, times):
            asked.append((given, times))
            return {"heave": np.where(np.arange(len(times)) % 2, 2.0, -2.0)}

        def destroy(self):
            closed.append(True)

    monkeypatch.setattr(response_runs, "Seaway", Seaway)
    ticks = iter((0.0, 7.0, 10.0, 12.0))
    monkeypatch.setattr(response_runs, "time", SimpleNamespace(monotonic=lambda: next(ticks)))
    own, run = response_runs.measured_in_sea(load_scene("storm"), waves)
    assert own == {"heave": 2.0, "seconds": 2.0}
    assert run == {"heave": 3.0, "seconds": 7.0, "time": 180 * T}
    scene, (linear, direction), (given, times) = asked
    assert (scene.time.end, scene.time.step, scene.time.scheme) == (200 * T, T / 200, "bdf2")
    assert scene.waves.ramp == given.ramp == linear.ramp == 10 * T
    assert (direction, len(times), times[0] > 20 * T, closed) == (waves.direction_deg, 360, True, [True])


def test_the_history_of_a_run(monkeypatch):
    """Places from the first on, along the waves; of a line alone those of its top; steps that failed are refused."""
    monkeypatch.setattr(response_runs, "simulate", lambda scene, comm: RECORD.assign_attrs(failed_steps=0))
    t, found, place = response_runs._history(SCENE, 90.0)
    C = RECORD.buoy_position.values[:, 0]
    np.testing.assert_allclose(found["surge"], C[:, 1] - C[0, 1])
    np.testing.assert_allclose(found["sway"], C[0, 0] - C[:, 0])
    np.testing.assert_allclose(found["heave"], C[:, 2] - C[0, 2])
    np.testing.assert_allclose(found["tension_anchor"], RECORD.tension_anchor.values[:, 0])
    np.testing.assert_allclose(place, C[0])
    assert (len(t), list(found)[6:]) == (401, ["tension_top", "tension_anchor"])
    line = RECORD.drop_dims("buoy").assign_attrs(failed_steps=0)
    monkeypatch.setattr(response_runs, "simulate", lambda scene, comm: line)
    np.testing.assert_allclose(response_runs._history(SCENE, 0.0)[2], RECORD.cable_position.values[0, -1])
    monkeypatch.setattr(response_runs, "simulate", lambda scene, comm: line.assign_attrs(failed_steps=1))
    with pytest.raises(SolveError, match="too rough"):
        response_runs._history(SCENE, 0.0)


def test_ends_that_are_held_still():
    """Where they are at first; others stay as they are."""
    top = load_scene("driven").cables[0].top
    held = response_runs.held_still(load_scene("driven")).cables[0].top
    assert (held.kind, held.position) == ("fixed", pytest.approx(tuple(top.position)))
    assert response_runs.held_still(load_scene("short")) == load_scene("short")
