"""`check` from Python, and its warnings about scenes that would run but give meaningless results, with their numbers.

Source: the same numbers by hand.
"""

import math
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from alone import solve_static

from dolfbuoy import load_scene
from dolfbuoy.check import check, derived
from dolfbuoy.results.running import never_parted

G = 9.81
FLOAT = {"hull": [[0, 2], [2, 2]], "mass": 500.0}


def said_of(scene, words, look=derived):
    """The messages about a scene that contain these words."""
    return [sentence for sentence in look(load_scene(scene)).warnings if words in sentence]


def floating(waves, **sections):
    return {"sea": {"depth": 500.0}, "buoy": FLOAT, "waves": waves} | sections


@pytest.mark.parametrize(
    ("step", "tolerance", "said"), [(5.0, None, 1), (0.45, None, 0), (0.46, None, 1), (5, 1e-3, 0)]
)
def test_a_step_that_is_long_in_waves(step, tolerance, said):
    """Twenty steps per period; with a tolerance the step is adapted."""
    time = {"end": 60.0, "step": step, "scheme": "bdf2"} | ({"tolerance": tolerance} if tolerance else {})
    found = said_of(floating({"amplitude": 1.0, "period": 9.0}, time=time), "time.step")
    assert len(found) == said
    words = f"time.step = {step:g} s is {step / 9:.2g} of the waves' period of 9 s: take 0.45 s or less"
    assert all(sentence.startswith(words) for sentence in found)


def test_a_step_in_the_period_that_the_ground_sees():
    """Waves of 9 s in water moving with a current."""
    waves = {"amplitude": 1.0, "period": 9.0, "period_seen_from": "water"}
    scene = floating(waves, current={"speed": 3.0}, time={"end": 60.0, "step": 0.44})
    seen = 9 / (1 + 3.0 * 2 * math.pi / 9 / G)
    assert f"the waves' period of {seen:.4g} s: take {seen / 20:.2g} s" in said_of(scene, "time.step")[0]
    assert not said_of(scene | {"waves": waves | {"period_seen_from": "ground"}}, "time.step")


@pytest.mark.parametrize("length", [16.0, 30.0])
def test_a_cable_that_drowns_the_hull(length):
    """It uses up all reserve buoyancy."""
    cable = {"length": length, "line_density": 31.0, "diameter": 0.09, "axial_stiffness": 4e6}
    found = said_of({"sea": {"depth": 24.0, "density": 1019.0}, "cable": cable, "buoy": FLOAT}, "under water, held")
    spare = (1019.0 * 2 * math.pi - 500.0) * G
    words = f"All of the hull is under water, held there with {spare / 1000:.4g} kN: its lines are too short"
    assert len(found) == (length < 20)
    assert all(sentence.startswith(words) and "24 m of water" in sentence for sentence in found)


@pytest.mark.parametrize(("height", "said"), [(6.0, 1), (2.0, 0)])
def test_a_sea_that_would_break(height, said):
    """Two components of one period: Hs^2 = 16 m0 = 8 (a1^2 + a2^2)."""
    a, T = height / 4, 4.7
    waves = {"components": [[a, T, 0.0, 0.0], [a, T * (1 + 1e-9), 90.0, 0.0]]}
    steepness = 2 * math.pi * height / (G * T**2)
    assert (steepness > 0.1) == said
    found = said_of(floating(waves), "significant steepness")
    assert found == [f"The significant steepness of {steepness:.3g} is above 0.1: such a sea would break."] * said


@pytest.mark.parametrize(("peak", "at_peak", "at_mean"), [(2.0, 1, 1), (3.0, 0, 1), (9.0, 0, 0)])
def test_strips_at_the_mean_period_too(peak, at_peak, at_mean):
    """k R = (2 pi/T)^2/g of a hull of 1 m radius in deep water; Tz is shorter than Tp."""
    scene = floating({"spectrum": "jonswap", "significant_height": 0.3, "peak_period": peak, "band": [0.5, 5.0]})
    Tz = next(value for name, value, *_ in derived(load_scene(scene)).numbers if name.startswith("mean period Tz"))
    found = said_of(scene, "strips of the hull")
    assert ["at the mean period" in sentence for sentence in found] == [True] * at_mean + [False] * at_peak
    words = f"k R = {(2 * math.pi / Tz) ** 2 / G:.3g} at the mean period Tz = {Tz:.3g} s"
    assert all(sentence.startswith(words) for sentence in found[:at_mean])


def moved(rows, **more):
    top = {"kind": "prescribed", "position": [0.0, 0.0, 9.0], "motion": rows} | more
    return {"cable": {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "top": top}}


def test_a_velocity_that_jumps_from_row_to_row():
    """A triangle at its corners, a swing that begins at full speed; not one that begins at rest or behind a ramp."""
    t = np.linspace(0.0, 10.0, 201)
    rows = {
        "triangle": np.interp(t, [0, 2.5, 7.5, 10], [0, 1, -1, 0]),
        "swing": np.sin(2 * math.pi * t / 5),
        "rest": 1 - np.cos(2 * math.pi * t / 5),
    }
    rows = {name: [[a, 0.0, 0.0, b] for a, b in zip(t, z, strict=True)] for name, z in rows.items()}
    words = "The velocity of the top jumps by "
    assert said_of(moved(rows["triangle"]), words)[0].startswith(f"{words}0.8 m/s from one row of its motion to the")
    assert "at t = 2.5 s" in said_of(moved(rows["triangle"]), words)[0]
    assert said_of(moved(rows["swing"]), words)
    assert not said_of(moved(rows["rest"]), words)
    ends_at_rest = [row for row in rows["swing"] if row[0] <= 8.75]
    assert not said_of(moved(ends_at_rest, ramp=2.0), words)
    assert not said_of(moved([[0.0, 0, 0, 0], [10.0, 0, 0, 5.0]]), words)


@pytest.mark.parametrize("friction", [0.01, 0.5])
def test_what_friction_could_carry(friction):
    """At rest without slip: all that it holds of what lies, or the tension that there is, if that is less."""
    scene = load_scene("chain-on-bed", seabed__friction=friction)
    numbers = {name.removeprefix("equilibrium: "): value for name, value, *_ in check(scene).numbers}
    at_rest = solve_static(scene)
    lies, tension = numbers["length on the sea bed"], float(np.abs(at_rest.anchor_force[0]))  # horizontal, all along
    most = friction * numbers["cable weight in water per metre"] * lies
    assert (most < tension) == (friction == 0.01)
    assert numbers["tension that friction could carry"] == pytest.approx(min(most, tension), rel=2e-3)


def test_what_floats_up():
    """A rope that stands above its ends, and by how much; not a taut one, nor a lazy wave."""
    rope = {"length": 12.0, "line_density": 1.0, "diameter": 0.05, "axial_stiffness": 1e6, "elements": 24}
    rope |= {"anchor": [0.0, 0.0, -20.0], "top": {"kind": "fixed", "position": [8.0, 0.0, -20.0]}}
    scene = {"sea": {"depth": 20.0}, "cable": rope}
    (found,) = said_of(scene, "floats up", check)
    rise = float(solve_static(scene).cable_position[:, 2].max()) + 20
    lift = 12 * (1025 * math.pi * 0.05**2 / 4 - 1.0) * G
    assert found == f"The cable is lighter than water, by {lift:.4g} N: it floats up, {rise:.3g} m above its ends."
    taut = rope | {"length": 8.0, "top": {"kind": "fixed", "position": [0.0, 0.0, -11.9]}}
    assert not said_of(scene | {"cable": taut}, "floats up", check)
    assert not said_of("lazy-wave", "floats up", check)


ROPE = {"length": 12.0, "line_density": 1.0, "axial_stiffness": 1e5, "slack": "tension-only", "anchor": [0, 0, 0]}


def test_a_rope_that_hangs_slack_is_not_compressed():
    """In a fold beneath two ends at one height but 1 mm apart: T = 0 there and nowhere below."""
    rope = ROPE | {"top": {"kind": "fixed", "position": [1e-3, 0, 0]}, "elements": 9}
    assert not said_of({"cable": rope}, "compressed", check)
    strut = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 1e5, "anchor": [0, 0, 0], "elements": 1}
    found = said_of({"cable": strut | {"top": {"kind": "fixed", "position": [0, 0, 0.9]}}}, "compressed", check)
    assert len(found) == 1
    assert "smallest tension -" in found[0]


@pytest.mark.parametrize(("rule", "said"), [(5.5, 1), (5.0, 0), (4.0, 0)])
def test_a_cable_that_would_part_after_the_end(rule, said):
    """Of several pieces with one rule it is said once, by `check` and by the summary."""
    pieces = [{"length": 6.0, "line_density": 1.0, "axial_stiffness": 1e5}] * 2
    cable = {"segments": pieces, "anchor": [0, 0, 0], "top": {"kind": "fixed", "position": [5, 0, 0]}}
    scene = {"cable": cable | {"fails_at": {"time": rule}}, "time": {"end": 5.0, "step": 0.1}}
    found = said_of(scene, "fails_at")
    assert len(found) == said
    assert never_parted(load_scene(scene)) == found
    assert all(s.startswith("cable.fails_at.time = 5.5: is after the end of the run at 5 s, so that") for s in found)


@pytest.mark.parametrize(("degree", "share"), [(1, 0.28), (2, 0.45)])
def test_elements_at_the_touchdown(degree, share):
    """At most this share of the radius of the bend there, H/w = 76.30 kN/(700 N/m) in closed form."""
    report = check("chain-on-bed", cable__position_degree=degree, cable__tension_degree=degree - 1)
    (remark,) = (remark for name, *_, remark in report.numbers if name == "equilibrium: elements at the touchdown")
    most = float(re.fullmatch(r"for 1 % in the top tension (\S+) m at most", remark)[1])
    assert most == pytest.approx(share * 76.30e3 / 700, rel=0.01)


def test_a_rope_that_falls_straight_on_the_bed():
    """No elements resolve its fold; its top tension is its hanging weight, to that of an element; bars bend nowhere."""
    rope = {"length": 30.0, "line_density": 9.0, "diameter": 0.05, "axial_stiffness": 1e6, "slack": "tension-only"}
    rope |= {"anchor": [0.0, 0.0, -20.0], "top": {"kind": "fixed", "position": [0.0, 0.0, 0.0]}, "elements": 9}
    scene = {"sea": {"depth": 20.0}, "seabed": {}, "cable": rope}
    (found,) = said_of(scene, "touchdown", check) + said_of(scene, "falls on the bed", check)
    assert found.endswith("to the weight of an element there, which is 3.33 m long.")
    w = (9.0 - 1025 * math.pi * 0.05**2 / 4) * G
    assert float(solve_static(scene).tension_top) == pytest.approx(20 * w, abs=30 / 9 * w)
    bar = {"name": "bar", "from": "j", "to": "k", "length": 5.0, "line_density": 40.0, "elements": 1, "diameter": 0.1}
    bar |= {"position_degree": 1, "tension_degree": 0}
    ropes = [{**rope, "name": name, "from": end, "to": [x, 0.0, -10.0], "length": 16.0} for name, end, x in
             (("a", "j", -12.0), ("b", "k", 12.0))]  # fmt: skip
    for part in ropes:
        del part["anchor"], part["top"]
    network = {"sea": {"depth": 20.0}, "seabed": {}, "joint": [{"name": "j"}, {"name": "k"}], "cable": [bar, *ropes]}
    assert not any(said.startswith("bar: ") for said in said_of(network, "", check))


@pytest.mark.parametrize(("degree", "given", "off"), [(1, 10, 0.02), (2, 9, 0.01)])
def test_elements_that_are_proposed(degree, given, off):
    """Ten elements, as another program's file may have them, are 2.4 % off; the number that is proposed is within 1 %
    of the closed form, 146.28 kN at the top."""
    keys = {"cable__position_degree": degree, "cable__tension_degree": degree - 1}
    (said,) = said_of(load_scene("chain-on-bed", cable__elements=given, **keys), "at the touchdown", check)
    proposed = int(re.search(r"of equal length elements = (\d+)\.$", said)[1])
    errors = [
        solve_static("chain-on-bed", cable__elements=n, **keys).tension_top.item() / 146.28e3 - 1
        for n in (given, proposed)
    ]
    assert abs(errors[0]) > off
    assert abs(errors[1]) < 0.01


@pytest.mark.parametrize(
    ("stiffness", "high", "said"),
    [
        (100.0, 1.4, []),
        (100.0, 1.6, ["The equilibrium is stretched by 60 %: look at axial_stiffness and length."]),
        ([[0.0, 0.0], [1.0, 100.0]], 1.6, []),
        (
            [[0.0, 0.0], [0.5, 50.0]],
            1.6,
            ["The equilibrium has 60 N, beyond the 50 N of the last row of axial_stiffness."],
        ),
    ],
)
def test_a_line_that_is_pulled_beyond_what_it_is_known_for(stiffness, high, said):
    """A metre of it between two points at this distance."""
    cable = {"length": 1.0, "line_density": 1e-6, "axial_stiffness": stiffness, "elements": 4}
    cable |= {"anchor": [0.0, 0.0, 0.0], "top": {"kind": "fixed", "position": [0.0, 0.0, high]}}
    assert said_of({"cable": cable}, "axial_stiffness", check) == said


@pytest.mark.parametrize(("end", "said"), [(2.0, 0), (2.1, 1)])
def test_a_motion_that_ends_before_the_run(end, said):
    top = {"kind": "prescribed", "position": [0.8, 0.0, 0.0], "motion": [[0, 0, 0, 0], [1, 0.1, 0, 0], [2, 0, 0, 0]]}
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 1e4, "anchor": [0.0, 0.0, 0.0], "top": top}
    found = said_of({"cable": cable, "time": {"end": end, "step": 0.1}}, "it rests then")
    assert found == [f"The motion of the top ends at 2 s, and the run at {end:g} s: it rests then."] * said


@pytest.mark.parametrize(("period", "said"), [(5.0, 0), (4.9, 1), (9.1, 1)])
def test_waves_beyond_the_response_of_a_vessel(period, said):
    operators = [[T, 0.0, *[0.5, 10.0] * 6] for T in (9.0, 5.0)]
    ship = {"name": "ship", "position": [0, 0, 0], "fairleads": {"bow": [0, 0, 0]}, "raos": operators}
    line = {"length": 30.0, "line_density": 5.0, "diameter": 0.03, "axial_stiffness": 1e7, "to": "ship.bow"}
    scene = {"sea": {"depth": 25.0}, "waves": {"amplitude": 0.2, "period": period}, "vessel": [ship], "cable": line}
    found = said_of(scene, "raos of ship")
    words = f"Waves of {period:g} s are beyond the 5 to 9 s of the raos of ship: those of the nearest period are taken."
    assert found == [words] * said


@pytest.mark.slow
def test_a_lot_of_line_in_no_water_is_checked_in_bounded_time():
    """750 m of cable in 0.1 m of water: eigenvalue solvers that do not converge end (75 s of two solvers before)."""
    began = time.process_time()
    found = check("long-bed", **{"sea.depth": 0.1})
    assert time.process_time() - began < 25
    assert "buoy, heave" in found.periods


@pytest.mark.parametrize(
    "before", ["from dolfbuoy import check", "import dolfbuoy.check; from dolfbuoy import check", "import dolfbuoy"]
)
def test_from_python(before):
    """`dolfbuoy.check(scene)` is a function and a package of one name, whichever comes first; not imported before."""
    code = f"""import sys, dolfbuoy
assert "mpi4py" not in sys.modules
{before}
call = dolfbuoy.check if "check" not in globals() else check
for call in (call, dolfbuoy.check):
    report = call("driven", cable__length=21.0)
    assert type(report).__name__ == "Report"
print([value for name, value, *_ in report.numbers if name == "cable weight in water"][0])"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    numbers = {name: value for name, value, *_ in check("driven", cable__length=21.0).numbers}
    assert float(done.stdout) == numbers["cable weight in water"]
