"""The hull study: its numbers equal those of its parts, runs agree with the linear response, and refusals.

Source: hydrostatics of a cylinder in closed form, time-domain runs of the same scene.
"""

import json
import math

import numpy as np
import pytest
from helpers import REFERENCE, reference

from dolfbuoy import load_scene
from dolfbuoy.commands.main import app
from dolfbuoy.errors import InputError
from dolfbuoy.linear.seaway import responses
from dolfbuoy.studies.physics import hull
from dolfbuoy.studies.physics.response_runs import harmonics, measured

DISC = reference("hull")["rao_capytaine_disc"]["input"]
SCENE = {
    "sea": {"depth": 200.0},
    "buoy": {
        "hull": DISC["hull"],
        "mass": DISC["mass"],
        "center_of_mass": DISC["z_C"],
        "inertia": DISC["inertia"],
        "added_mass": 0.38,
        "axial_added_mass": 1.1,
        "rotational_added_mass": 1.17,
    },
}


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """What the command prints and writes, with a run and potential flow."""
    folder = tmp_path_factory.mktemp("hull")
    load_scene(SCENE).save(folder / "disc.toml")
    capytaine = ["--capytaine", str(REFERENCE / "disc.nc")]
    command = ["study", "hull", str(folder / "disc.toml"), "--runs", "6", "--out", str(folder / "out"), *capytaine]
    app(command, standalone_mode=False)
    return folder / "out"


def rows_of(out, name):
    return json.loads((out / f"{name}.json").read_text())["rows"]


def test_hydrostatics(out):
    """Draft, KB, BM, GM and stiffness of a disc by hand; the levers begin with GM."""
    found = {row["quantity"]: row["free"] for row in rows_of(out, "hull")}
    BM = 1.5**2 / (4 * 0.5)
    for name, exact in (("draft", 0.5), ("KB", 0.25), ("BM", BM), ("KG", 0.5)):
        assert found[name] == pytest.approx(exact, rel=1e-6)
    assert found["heave stiffness"] == pytest.approx(1025 * 9.81 * math.pi * 1.5**2, rel=1e-6)
    levers = rows_of(out, "hull-righting")
    assert [row["heel_deg"] for row in levers] == list(range(0, 181, 5))
    assert levers[1]["lever"] == pytest.approx((BM - 0.25) * math.sin(math.radians(5)), rel=0.01)


def test_a_cable_pulls_its_buoy_down():
    """By more than half the weight of the buoy: water displaced carries both."""
    numbers = hull._hydrostatics(load_scene("short"), None)["numbers"]
    assert numbers["pull"] > 0.5 * numbers["mass"] * 9.81
    assert numbers["displaced_mass"] == pytest.approx(numbers["mass"] + numbers["pull"] / 9.81, rel=1e-9)


def test_runs_and_potential_flow_stand_beside(out):
    """A run within 1 % of the response, potential flow within the 3 % of the strips."""
    (run,) = rows_of(out, "hull-runs")
    flow = {round(row["period"]): row for row in rows_of(out, "hull-potential-flow")}
    for motion in hull.MOTIONS:
        assert run[f"{motion}_difference"] < 1
        assert flow[8][f"{motion}_difference"] < 3
    by_period = {row["period"]: row for row in rows_of(out, "hull-response")}
    assert by_period[6.0]["surge"] == pytest.approx(run["surge"])
    assert {"heave", "pitch"} <= {row["motion"] for row in rows_of(out, "hull-periods")}
    for name in ("hull-response", "hull-righting"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_response_of_a_moored_buoy():
    """In its current, waves oblique to it: runs in time within 0.5 %, the cable's mass and drag included."""
    scene = load_scene("short")
    linear, run = responses(scene, [4.0], 150.0)[0].motions, measured(scene, 4.0, 150.0, 2.4e-3)
    for name in ("surge", "heave", "roll", "pitch"):
        assert run[name] == pytest.approx(getattr(linear, name), rel=5e-3), name


def test_harmonics_of_a_record():
    """X of Re[X exp(-i omega t)] beside a slow drift."""
    t, omega, X = np.linspace(3.0, 25.0, 500), 1.3, 0.4 - 0.7j
    found = harmonics(t, np.column_stack([(X * np.exp(-1j * omega * t)).real + 0.2 - 0.01 * t + 1e-3 * t**2]), omega)
    assert found[0] == pytest.approx(X, abs=1e-10)


def test_moored_and_free():
    """A buoy that capsizes without its cable is looked at moored only; one without cable free only."""
    held = {(case["part"], case["held"]) for case in hull.cases(load_scene("short"), [6.0])}
    assert held == {(part, "moored") for part in ("hydrostatics", "response", "run")} | {("hydrostatics", "free")}
    assert {case["held"] for case in hull.cases(load_scene(SCENE))} == {"free"}


def test_waves_come_from_where_they_do_in_the_scene():
    """Or along x, if it has none."""
    scenes = (SCENE, "short", load_scene("short", waves__direction_deg=40.0))
    assert [hull.request(scene, "none", None, None)["direction"] for scene in scenes] == [0.0, 150.0, 40.0]
    assert hull.request("short", "none", 70.0, None)["direction"] == 70.0


def test_another_file_of_potential_flow_is_another_case(tmp_path):
    """Cases are known again by their numbers, so that what is in the file is one of them."""
    found = []
    for content in (b"1", b"2"):
        (tmp_path / "flow.nc").write_bytes(content)
        found.append(
            [one for one in hull.cases(load_scene(SCENE), (), 0.0, tmp_path / "flow.nc") if one["part"] == "flow"]
        )
    ((first,), (second,)) = found
    assert first["file"] == second["file"]
    assert first != second


@pytest.mark.parametrize("periods", ["0", "-4", "inf"])
def test_no_run_has_such_a_period(periods):
    with pytest.raises(InputError, match="--runs"):
        hull.request("short", periods, None, None)


@pytest.mark.parametrize(
    ("scene", "capytaine", "said"),
    [
        ("driven", None, r"needs \[buoy\]"),
        ("short", REFERENCE / "disc.nc", "does not float upright without its cable"),
        ("free-buoy", REFERENCE / "disc.nc", "must be C of the free buoy"),
    ],
)
def test_what_it_refuses(scene, capytaine, said):
    with pytest.raises(InputError, match=said):
        hull.request(scene, "none", None, capytaine)
