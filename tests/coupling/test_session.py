"""A session is a run stepped by its caller: driven, loaded, taken back, recorded.

Source: the same motions and forces as keys of a scene, bit for bit; a rigid body integrated by the caller in NumPy (the
example of dolfbuoy/coupling/README.md) against the built-in buoy; the run without steps taken back.
"""

import gc
import re
from pathlib import Path

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start
from own_body import example, furthest
from scipy.spatial.transform import Rotation

import dolfbuoy
from dolfbuoy import InputError, Session, load_scene
from dolfbuoy.coupling import paths
from dolfbuoy.model.prescribed_ends import motion_of
from dolfbuoy.model.rigid import rotation_of
from dolfbuoy.results.record import read

STEP = 0.02
TIME = {"end": 0.6, "step": STEP, "output_every": 0.1}
TOP = {"kind": "fixed", "position": [12.0, 0.5, -3.5]}
ROWS = [[0.0, 0, 0, 0], [0.3, 0.2, 0, 0.3], [0.6, 0, 0.1, -0.2], [1.0, 0, 0, 0]]
LINE = {"sea": MOORED["sea"], "cable": merged(MOORED["cable"], elements=6, top=TOP), "time": TIME}
LONE = merged(MOORED, cable__elements=6, waves__ramp=0.2, time=TIME)
IRREGULAR = merged(LONE, waves=None) | {
    "waves": {"spectrum": "jonswap", "significant_height": 1.5, "peak_period": 5.0, "ramp": 0.2}
}
#: A ship on a line, and on another by a take-off.
SAILING = {"length": 16.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 3}
STILL = {"name": "ship", "position": [1.0, 0.0, 0.0], "heading_deg": 30.0}
STILL["fairleads"] = {"bow": [3.0, 0.0, -1.0], "stern": [-3.0, 1.0, -1.0]}
SHIP = {
    "vessel": [STILL],
    "joint": [{"name": "Y"}],
    "cable": [
        SAILING | {"name": "fore", "from": [12.0, 6.0, -10.0], "to": "ship.bow"},
        SAILING | {"name": "aft", "from": [-10.0, -6.0, -10.0], "to": "Y"},
    ],
    "take_off": {"from": "Y", "to": "ship.stern", "stiffness": 500.0, "length": 1.0, "damping": 300.0},
    "time": {"end": 0.5, "step": 0.1, "scheme": "bdf2"},
}


def moved(scheme="backward-euler"):
    """The line whose end the scene moves along ROWS."""
    top = {**TOP, "kind": "prescribed", "motion": ROWS}
    return load_scene(merged(LINE, cable__top=top, time__scheme=scheme))


def same_records(one, two):
    assert set(one.data_vars) == set(two.data_vars)
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name].values, two[name].values, err_msg=name)


# -- the run that is stepped -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [LONE, IRREGULAR], ids=["regular", "irregular"])
def test_a_session_without_a_word_is_the_run(scene, tmp_path):
    with Session(scene, tmp_path / "own") as s:
        while s.t < 0.6 - 1e-9:
            s.step()
    record = dolfbuoy.simulate(scene)
    same_records(record, read(tmp_path / "own" / "results.nc"))


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
def test_a_driven_end_is_the_end_that_the_scene_moves(scheme, tmp_path):
    scene = moved(scheme)
    motion = motion_of(scene.network.pieces[0].ends[1].top)
    record = dolfbuoy.simulate(scene)
    with Session(merged(LINE, time__scheme=scheme), tmp_path, driven=["cable.to"]) as s:
        for k in range(1, 31):
            s.drive("cable.to", motion(k * STEP))
            s.step()
            np.testing.assert_array_equal(s.pull("cable.to"), -record.end_tension.values[k, 0])
            np.testing.assert_array_equal(s.pull("cable.from"), -record.anchor_force.values[k, 0])
    same_records(record, read(tmp_path / "results.nc"))


def test_a_function_of_time_is_as_good_as_rows():
    scene = moved()
    motion = motion_of(scene.network.pieces[0].ends[1].top)
    record = dolfbuoy.simulate(scene)
    with Session(LINE, driven="cable.to") as s:
        s.drive("cable.to", motion)
        for k in range(1, 4):
            s.advance_to(k * 0.2)  # ten steps each
        assert s.values()["tension_top"][0] == pytest.approx(float(record.tension_top[-1, 0]), rel=1e-9)


def test_steps_of_one_size_are_counted():
    with Session(LINE) as s:
        for _ in range(7):
            s.step(0.1)
        assert s.t == 7 * 0.1


# -- what is driven ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("degree", "with_velocity"), [(2, False), (3, True)])
def test_a_motion_of_the_degree_of_the_interpolation_is_followed_exactly(degree, with_velocity):
    powers = np.array([[0.3, -1.0, 2.0], [1.0, 0.5, 0.2], [-0.7, 0.1, 0.4], [0.9, -0.2, 0.3]])[: degree + 1]

    def place(t):
        return sum(p * t**k for k, p in enumerate(powers))

    def speed(t):
        return sum(k * p * t ** (k - 1) for k, p in enumerate(powers) if k)

    path = paths.Path(0.0, place(0.0))
    for t in (0.5, 0.8, 1.4, 1.6):
        path.go(t, place(t), speed(t) if with_velocity else None)
    for t in np.linspace(1.4, 1.6, 5):
        found, rate = path.at(t)
        np.testing.assert_allclose(found, place(t), rtol=0, atol=1e-13)
        np.testing.assert_allclose(rate, speed(t), rtol=0, atol=1e-12)
    path.stay(2.0)
    np.testing.assert_array_equal(path.at(1.8), [place(1.6), np.zeros(3)])


def test_a_length_is_a_number_after_it_was_a_function():
    path = paths.Length(0.0, [16.0])
    path.function = lambda t: 16.0 - t
    path.follow(0.5, None)
    path.function = None
    path.follow(1.0, path.target("line.winch", 15.0, None, None, None))
    assert path(0.75) == pytest.approx(15.25, rel=1e-15)  # as fast as before


def test_a_turning_body_is_where_it_is_said_to_be_and_turns_as_fast():
    axis, rate = np.array([2.0, -1.0, 2.0]) / 3, 0.7

    def turn(t):
        return [np.cos(rate * t / 2), *(np.sin(rate * t / 2) * axis)]

    pose = paths.Pose(0.0, [0.0, 0.0, 0.0, *turn(0.0)])
    for k in range(1, 4):
        sign = (-1) ** k  # the same orientation
        given = [0.0, 0.0, 0.1 * k], sign * np.array(turn(0.2 * k)), [0, 0, 0.5], rate * axis
        pose.follow(0.2 * k, pose.target("body", *given))
    for t, accuracy in ((0.6, 1e-15), (0.5, 1e-5)):
        position, q, velocity, spin = pose(t)
        np.testing.assert_allclose(abs(q @ turn(t)), 1, rtol=0, atol=accuracy)
        np.testing.assert_allclose(spin, rate * axis, rtol=0, atol=50 * accuracy)
        np.testing.assert_allclose(velocity, [0, 0, 0.5], rtol=0, atol=1e-12)
        np.testing.assert_allclose(position, [0, 0, t / 2], rtol=0, atol=1e-12)


def test_a_buoy_that_is_held_where_it_floats_needs_no_force():
    with Session(merged(LONE, waves=None), driven=["buoy"]) as s:
        before, weight = s.state("buoy"), 700 * 9.81
        for _ in range(5):
            s.step()
        force, moment = s.required("buoy")
        assert max(abs(force)) < 1e-6 * weight
        assert max(abs(moment)) < 1e-6 * weight
        np.testing.assert_array_equal(s.state("buoy").position, before.position)
        np.testing.assert_allclose(s.pulls("buoy").force, s.pull("cable.to"), rtol=1e-12)


def test_a_buoy_begins_where_the_scene_puts_it_and_the_line_rests():
    place = [8.0, 1.0, -1.0]
    scene = merged(LONE, waves=None) | {"initial": {"buoy_position": place}}
    with Session(scene, driven=["buoy"]) as s:
        assert s.simulation.at_rest
        u = s.simulation.system.u.copy()
        s.step()
        np.testing.assert_allclose(s.state("buoy").position, place, atol=1e-15)
        np.testing.assert_allclose(s.simulation.system.u, u, rtol=0, atol=1e-6 * abs(u).max())
        buoyancy = 1025 * 9.81 * np.pi * 1.2**2 * 1.2  # it is under water
        balance = 700 * 9.81 - buoyancy - s.pulls("buoy").force[2]
        assert s.required("buoy").force[2] == pytest.approx(balance, rel=1e-6)


def test_a_driven_buoy_needs_the_force_that_moves_a_free_one():
    """Driving a buoy along the motion of a free one under a load requires that load."""
    push = np.array([500.0, 200.0, -300.0])
    with Session(LONE) as free, Session(LONE, driven=["buoy"]) as held:
        for k in range(1, 9):
            free.load("buoy", push * k)
            free.step()
            y = free.state("buoy")
            held.drive("buoy", y.position, y.orientation, y.velocity, y.angular_velocity)
            held.step()
            for one, two in zip(free.pulls("buoy"), held.pulls("buoy"), strict=True):
                np.testing.assert_allclose(one, two, rtol=0, atol=1e-5 * np.abs(free.pulls("buoy").force).max())
            # the quaternion was made a unit again and its rate is none of the scheme's: a part of 1e-4
            np.testing.assert_allclose(held.required("buoy").force, push * k, rtol=0, atol=2e-4 * 500 * k)


@pytest.mark.parametrize("end", [{}, {"rotational_stiffness": 40.0}], ids=["held", "sprung"])
def test_the_moment_of_a_line_that_bends_is_among_its_pulls(end):
    """A weight hanging askew on a line clamped to it is in balance about C."""
    hanging = {
        "cable": {
            "anchor": [0.0, 0.0, 0.0],
            "length": 3.0,
            "line_density": 0.5,
            "elements": 8,
            "bending_stiffness": 50.0,
        },
        "buoy": {"mass": 20.0, "center_of_mass": 0.0, "inertia": [2.0, 2.0], "mooring_height": 1.0},
        "time": TIME,
    }
    hanging["cable"] |= {"to_end": {"direction": [0.6, 0.0, -0.8], **end}}
    with Session(hanging, driven=["buoy"]) as s:
        for _ in range(2):
            force, moment = s.pulls("buoy")
            arm = rotation_of(s.state("buoy").orientation) @ [0, 0, 1.0]
            assert np.linalg.norm(np.cross(arm, s.pull("cable.to"))) > 5.0
            np.testing.assert_allclose(moment, 0, atol=1e-4)
            np.testing.assert_allclose(force, [0, 0, 20 * 9.81], atol=1e-4)
            s.step()
        np.testing.assert_allclose(np.ravel(s.required("buoy")), 0, atol=1e-4)


# -- loads -------------------------------------------------------------------------------------------------------------


def test_a_load_on_a_buoy_is_the_external_force_of_a_scene():
    force = [300.0, -100.0, 50.0]
    start = {"buoy_position": [0.0, 0.0, -0.5]}
    free = {"sea": MOORED["sea"], "buoy": MOORED["buoy"], "initial": start, "time": TIME}
    record = dolfbuoy.simulate(free | {"external_force": {"force": force}})
    with Session(free) as s:
        s.load("buoy", force)
        for k in range(1, 11):
            s.step()
            np.testing.assert_allclose(
                s.state("buoy").position, record.buoy_position.values[k, 0], rtol=0, atol=1e-9, err_msg=str(k)
            )


def test_a_moment_turns_a_buoy():
    spinner = {"buoy": {"mass": 10.0, "center_of_mass": 0.0, "inertia": [2.0, 4.0]}, "gravity": 0.0, "time": TIME}
    with Session(spinner) as s:
        s.load("buoy", moment=[0.0, 0.0, 8.0])
        for _ in range(10):
            s.step()
        np.testing.assert_allclose(s.state("buoy").angular_velocity, [0, 0, 2.0 * s.t], atol=1e-9)


def test_a_load_on_a_free_end_is_the_force_of_the_scene():
    hanging = merged(LINE, sea=None, cable__top={"kind": "free", "force": [0.0, 0.0, 1.0]})
    hanging["cable"] |= {"anchor": [0.0, 0.0, 0.0], "normal_drag": 0.0, "tangential_drag": 0.0, "added_mass": 0.0}
    with Session(hanging) as s:
        weight = s.pull("cable.from")[2]
        with pytest.raises(InputError, match="point of a line, which takes none"):
            s.load("cable.to", moment=[0.0, 0.0, 1.0])
        s.load("cable.to", [0.0, 0.0, -100.0])
        for _ in range(100):
            s.step(0.1)
        assert s.pull("cable.from")[2] == pytest.approx(weight - 100.0, rel=1e-3)


def test_what_nobody_loads_has_no_loads():
    with Session(LINE, driven="cable.to") as s:
        s.step()
        assert "loads" not in vars(s.simulation.system)


# -- back in time ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
@pytest.mark.parametrize("scene", [LONE, IRREGULAR], ids=["regular", "irregular"])
def test_what_is_taken_back_is_done_again_bit_for_bit(scene, scheme, tmp_path):
    scene = merged(scene, time__scheme=scheme)

    def go(s, begin, end):
        found = []
        for k in range(begin, end):
            s.load("buoy", [100.0 * k, 0.0, 0.0])
            s.step()
            found.append([s.simulation.system.u.copy(), s.values()["tension_top"]])
        return found

    def equal(one, two):
        for (u, T), (v, S) in zip(one, two, strict=True):
            np.testing.assert_array_equal(u, v)
            np.testing.assert_array_equal(T, S)

    with Session(scene, tmp_path / "straight") as s:
        straight = go(s, 0, 12)
    with Session(scene, tmp_path / "back") as s:
        equal(go(s, 0, 2), straight[:2])
        early = s.save()
        go(s, 2, 4)
        later = s.save()
        for _ in range(2):
            s.load("buoy", [-2000.0, 0.0, 0.0])
            s.step(0.007)
            s.step(0.3)  # other steps, another matrix
            s.restore(later)
            equal(go(s, 4, 6), straight[4:6])
        s.restore(early)
        equal(go(s, 2, 12), straight[2:])
    same_records(read(tmp_path / "straight" / "results.nc"), read(tmp_path / "back" / "results.nc"))


@pytest.mark.parametrize("scheme", ["bdf2", "generalized-alpha"])
def test_a_packed_instant_goes_on_in_another_session(scheme, tmp_path):
    """Bit for bit, with loads and driven ends; in an equivalent scene."""
    scene = merged(LONE, time__scheme=scheme)

    def go(s, begin, end):
        for k in range(begin, end):
            s.drive("cable.from", [0.0, 0.02 * np.sin(k), -20.0])
            s.step()
        return s.simulation.system.u.copy()

    with Session(scene, driven="cable.from") as s:
        s.load("buoy", [300.0, 0.0, 0.0])
        go(s, 0, 4)
        content = s.pack(s.save())
        straight = go(s, 4, 9)
    with Session(scene, driven="cable.from") as s:
        s.step(0.007)
        s.restore(s.unpack(content))
        np.testing.assert_array_equal(go(s, 4, 9), straight)
        with pytest.raises(InputError, match="a packed state"):
            s.unpack(content[:-1])
        s.load("buoy", lambda t, state: [0.0, 0.0, 0.0])
        with pytest.raises(InputError, match="function of Python"):
            s.pack(s.save())
    for other, driven in ((merged(scene, waves__amplitude=0.3), "cable.from"), (scene, ())):
        with Session(other, driven=driven) as s, pytest.raises(InputError, match="another scene"):
            s.unpack(content)
    with Session(scene, tmp_path, driven="cable.from") as s:
        with pytest.raises(InputError, match="writes a record"):
            s.restore(s.unpack(content))
        with pytest.raises(InputError, match="writes a record"):
            s.pack(s.save())


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"[1]", b'{"dict": 3}', b"[" * 100000, b'{"dict":[["scene",1]]}', b"\xff\xfe",
     b'{"array": "QUJD", "dtype": "O", "shape": [1]}',
     b'{"dict":[["scene",""],["driven",[]],["state",1],["own",{"dict":[]}]]}'],
)  # fmt: skip
def test_what_is_no_packed_instant(content):
    with Session(LINE) as s, pytest.raises(InputError, match="not those of a packed state"):
        s.unpack(content)


def test_a_record_on_disk_is_cut_too(tmp_path):
    with Session(LONE, tmp_path / "straight") as s:
        for _ in range(20):
            s.step()
    with Session(LONE, tmp_path / "back") as s:
        for _ in range(10):
            s.step()
        here = s.save()
        for _ in range(10):
            s.step()
        s._recorder.save()  # as a pause of wall time does
        s.restore(here)
        for _ in range(5):
            s.step()
        middle = s.save()
        for _ in range(5):
            s.step()
        s.restore(middle)
        for _ in range(5):
            s.step()
    same_records(read(tmp_path / "straight" / "results.nc"), read(tmp_path / "back" / "results.nc"))


def test_sessions_do_not_know_of_each_other():
    def forces(sessions):
        for k in range(1, 6):
            for number, s in enumerate(sessions):
                s.drive("cable.to", np.array(TOP["position"]) + [0.0, 0.0, 0.01 * k * (number + 1)])
                s.step()
        return [s.pull("cable.to") for s in sessions]

    alone = []
    for number in range(2):
        with Session(LINE, driven="cable.to") as s:
            for k in range(1, 6):
                s.drive("cable.to", np.array(TOP["position"]) + [0.0, 0.0, 0.01 * k * (number + 1)])
                s.step()
            alone.append(s.pull("cable.to"))
    with Session(LINE, driven="cable.to") as one, Session(LINE, driven="cable.to") as two:
        np.testing.assert_array_equal(forces([one, two]), alone)
        with pytest.raises(InputError, match="another session"):
            two.restore(one.save())


def test_a_session_goes_on_where_it_stopped(tmp_path):
    with Session(LONE, tmp_path / "whole") as s:
        for _ in range(20):
            s.step()
        whole = s.simulation.system.u.copy()
    with Session(LONE, tmp_path / "parts") as s:
        for _ in range(10):
            s.step()
    with pytest.raises(InputError, match="written by a session"):
        dolfbuoy.simulate(resume=tmp_path / "parts")
    with pytest.raises(InputError, match="results of another scene"):
        dolfbuoy.simulate(LONE, tmp_path / "parts")
    with Session(resume=tmp_path / "parts") as s:
        assert s.t == pytest.approx(10 * STEP)
        for k in range(11, 21):
            s.advance_to(k * STEP)
        np.testing.assert_array_equal(s.simulation.system.u, whole)
    same_records(read(tmp_path / "whole" / "results.nc"), read(tmp_path / "parts" / "results.nc"))


def test_what_is_driven_and_loaded_goes_on_from_the_disk(tmp_path):
    """Bit for bit: parabolas through places before, a vessel's pose, a length, loads; other driven things do not."""
    ship, driven = SHIP | {"time": {"end": 1.0, "step": 0.02, "scheme": "bdf2"}}, ["ship", "fore.from", "aft.winch"]

    def go(s, begin, end):
        for k in range(begin, end):
            s.drive("ship", [1.0 + 0.05 * np.sin(k), 0.0, 0.0], [1.0, 0.01 * k, 0.0, 0.25])
            s.drive("fore.from", [12.0, 6.0, -10.0 + 0.03 * np.sin(k)])
            s.drive("aft.winch", 16.0 - 0.02 * np.sin(k))
            s.step(0.05)
        return s.simulation.system.u.copy(), [*s.pulls("ship"), s.values()["take_off_tension"]]

    with Session(ship, tmp_path, driven=driven) as s:
        s.load("Y", [20.0, 0.0, 0.0])
        go(s, 0, 5)
        here = s.save()
        straight = go(s, 5, 9)
        s.restore(here)
    kept = dict(np.load(tmp_path / "checkpoint.npz"))
    (name,) = (name for name in kept if name.endswith("/session"))
    for spoilt in ("{", '{"dict": [["paths", {"dict": []}]]}', str(kept[name]).replace('"before"', '"other"')):
        np.savez(tmp_path / "checkpoint.npz", **kept | {name: spoilt})
        with pytest.raises(InputError, match=r"The checkpoint's session is not one|drove the same: nothing"):
            Session(resume=tmp_path, driven=driven)
    np.savez(tmp_path / "checkpoint.npz", **kept)
    with pytest.raises(InputError, match=r"drove the same: ship, aft\.winch, fore\.from"):
        Session(resume=tmp_path, driven="ship")
    with Session(resume=tmp_path, driven=driven) as s:
        for one, other in zip(straight, go(s, 5, 9), strict=True):
            for a, b in zip(one, other, strict=True):
                np.testing.assert_array_equal(a, b)


# -- a body of one's own -----------------------------------------------------------------------------------------------


def test_a_body_of_ones_own_moves_like_the_built_in_buoy():
    assert furthest(example()["coupled"]()) < 1e-6


# -- endings -----------------------------------------------------------------------------------------------------------


def resident():
    """Memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


@pytest.mark.parametrize("many", [16, pytest.param(1000, marks=pytest.mark.slow)])
def test_sessions_leave_no_memory_behind(many):
    def several(count):
        for _ in range(count):
            with Session(LINE, driven="cable.to") as s:
                s.step()
                here = s.save()
                s.step()
                s.restore(here)
        gc.collect()
        return resident()

    settled = several(16)
    assert several(many) - settled < 2.0  # one session takes 2 to 3 MB


def test_after_an_error_the_folder_is_free_and_the_record_there(tmp_path):
    def fail():
        with Session(LINE, tmp_path, driven="cable.to") as s:
            s.step()
            raise RuntimeError("the caller's")

    with pytest.raises(RuntimeError, match="caller"):
        fail()
    assert read(tmp_path / "results.nc").sizes["time"] == 2
    with Session(LINE, tmp_path, overwrite=True) as s:
        s.step()


@pytest.mark.parametrize("velocity", [None, [0.1, 0.0, 0.1]], ids=["parabola", "cubic"])
def test_after_a_step_that_failed_another_try_is_as_good_as_the_first(velocity):
    """Even after a partly completed step: the end continues from where it arrived."""

    def pulls(far, dt=STEP):
        with Session(LINE, driven="cable.to") as s:
            for k in range(1, 7):
                place = s.paths["cable.to"].end[1] if k == 1 else [12.0 + 0.1 * k * dt, 0.5, -3.5 + 0.1 * k * dt]
                if k == 4 and far:
                    s.drive("cable.to", [far, 0.0, 0.0])
                    with pytest.raises(dolfbuoy.SolveError):
                        s.step(dt)
                    assert s.t == pytest.approx(3 * dt, abs=1e-12)
                    np.testing.assert_array_equal(s.paths["cable.to"].end[1], [12.0 + 0.3 * dt, 0.5, -3.5 + 0.3 * dt])
                s.drive("cable.to", place, velocity=velocity)
                s.step(dt)
                yield s.pull("cable.to")

    np.testing.assert_allclose([*pulls(1e9)], [*pulls(None)], rtol=1e-9)  # the matrix at hand is another one


def test_a_path_that_is_cut_goes_on_from_there():
    """On the cubic and on the parabola: the rest of the step follows the same curve."""
    for rate in ([0.4], None):
        path, whole = paths.Path(0.0, [1.0]), paths.Path(0.0, [1.0])
        for one in (path, whole):
            one.go(1.0, [2.0], None if rate is None else [0.3])
            one.go(2.0, [2.5], rate)
        value, speed = whole.at(1.5)
        path.cut(1.5)
        np.testing.assert_allclose([*path.at(1.5)], [value, speed], rtol=1e-12)
        path.go(2.0, [2.5], rate)
        assert path.at(1.75)[0] == pytest.approx(whole.at(1.75)[0], abs=1e-12 if rate else 0.02)


@pytest.mark.parametrize(
    ("driven", "sentence"),
    [
        ("top", "driven = 'top': there is no such thing; must be of cable.from, cable.to, cable.winch."),
        ("cable.top", "driven = 'cable.top': there is no such thing; must be of cable.from, cable.to, cable.winch."),
    ],
)
def test_an_unknown_name_is_refused(driven, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Session(LINE, driven=driven)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda s: s.drive("cable.from", [0, 0, 0]), "'cable.from' is not driven: cable.to is, as the session began."),
        (lambda s: s.drive("cable.to", [0, 0]), "position = [0, 0]: must be 3 numbers of 1e+09 at most."),
        (lambda s: s.drive("cable.to", [0, 0, np.nan]), "position = [0, 0, nan]: must be 3 numbers of 1e+09 at most."),
        (lambda s: s.drive("cable.to", [0, 0, 0], [1, 0, 0, 0]), "'cable.to' is an end of a line: it has a position"),
        (lambda s: s.load("cable.to", [1, 0, 0]), "load: 'cable.to' must be of what moves freely: there is nothing."),
        (lambda s: s.pull("buoy"), "pull: 'buoy' must be an end of a line or a joint: cable.from, cable.to."),
        (lambda s: s.state("buoy"), "'buoy' must be a buoy: the scene has none."),
        (lambda s: s.required("buoy"), "'buoy' must be a buoy that is driven: none is."),
        (lambda s: s.step(0.0), "dt = 0.0: must be a positive number of seconds."),
        (lambda s: s.advance_to(-1.0), "t = -1.0: must be after 0 s, the time that was reached."),
    ],
)
def test_what_a_caller_gets_wrong_is_one_sentence(call, sentence):
    with Session(LINE, driven="cable.to") as s, pytest.raises(InputError, match=re.escape(sentence)):
        call(s)


def test_a_scene_that_moves_or_frees_an_end_keeps_it():
    with pytest.raises(InputError, match="the scene moves it"):
        Session(moved(), driven="cable.to")
    with pytest.raises(InputError, match=r"the scene does not hold it; must be of buoy, cable\.from"):
        Session(LONE, driven="cable.to")
    free = {"sea": MOORED["sea"], "buoy": MOORED["buoy"], "time": TIME}
    with pytest.raises(InputError, match="no line hangs on it"):
        Session(free, driven="buoy")
    with pytest.raises(InputError, match="begins at rest"):
        Session(LONE | {"initial": {"buoy_velocity": [1.0, 0.0, 0.0]}}, driven="buoy")


RANKS = """
import sys
import numpy as np
import dolfbuoy

with dolfbuoy.Session("lone.toml", driven=["buoy"]) as s:
    start = s.state("buoy")
    for k in range(1, 6):
        s.drive("buoy", start.position + np.array([0.0, 0.0, 0.01 * k]), start.orientation)
        s.step()
    here = s.save()
    s.step()
    s.restore(here)
    forces = [*s.pulls("buoy").force, *s.required("buoy").force, *s.pull("cable.to")]
    for one in s.comm.gather(forces) or []:
        print(*map(float, one))
"""


@needs_mpirun
@pytest.mark.mpi
def test_two_ranks_step_together(tmp_path):
    load_scene(LONE).save(tmp_path / "lone.toml")
    (tmp_path / "run.py").write_text(RANKS)
    found = []
    for ranks in (1, 2):
        done = start(ranks, ["run.py"], tmp_path)
        assert done.returncode == 0, done.stderr
        found += [np.array(line.split(), dtype=float) for line in done.stdout.splitlines()]
    assert len(found) == 3
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-6, atol=1e-2)


def test_a_free_joint_that_is_driven():
    """It starts at its rest position; driven along its free motion, the lines move as without driving."""
    legs = [
        {
            "name": name,
            "from": foot,
            "to": "Y",
            "length": 10.0,
            "line_density": 1.0,
            "axial_stiffness": 1e5,
            "elements": 3,
        }
        for name, foot in (("one", [0.0, 0.0, 0.0]), ("two", [15.0, 0.0, 0.0]))
    ]
    scene = {
        "cable": legs,
        "joint": [{"name": "Y", "mass": 20.0}],
        "time": {"end": 1.0, "step": 0.02, "scheme": "bdf2"},
    }
    places, tensions = [], []
    with Session(scene) as s:
        rest = s.values()["joint_position"][0].copy()
        s.load("Y", [60.0, 30.0, 10.0])
        for _ in range(20):
            s.step()
            places.append(s.values()["joint_position"][0].copy())
            tensions.append(s.values()["tension_top"].copy())
    with Session(scene, driven="Y") as s:
        np.testing.assert_allclose(s.values()["joint_position"][0], rest, atol=1e-12)
        assert s.pull("Y")[2] == pytest.approx(20.0 * 9.81, rel=1e-9)  # which was the weight of its body
        for k, place in enumerate(places):
            s.drive("Y", place)
            s.step()
            if k > 3:
                np.testing.assert_allclose(s.values()["tension_top"], tensions[k], rtol=1e-4)
    welded = {**scene, "cable": [leg | {"bending_stiffness": 10.0} for leg in legs]}
    with pytest.raises(InputError, match="without a kink"):
        Session(welded | {"joint": [{"name": "Y", "weld": True}]}, driven="Y")


def test_a_vessel_that_is_driven():
    """By its pose at the scene's rows, as these; force and moment are those of its lines and its take-off."""
    still, scene = STILL, SHIP
    rows = [[0.1 * k, 0.02 * k**2, 0.0, 0.01 * k**2, 0.3 * k**2, -0.2 * k**2, 0.5 * k**2] for k in range(6)]
    moved = load_scene(scene | {"vessel": [still | {"motion": rows}]})
    with Session(moved) as one, Session(scene, driven="ship") as s:
        for _, *shift, roll, pitch, yaw in rows[1:]:
            turn = Rotation.from_euler("xyz", [roll, pitch, yaw + 30.0], degrees=True)  # about the axes of the world
            origin, (x, y, z, w) = np.add(shift, still["position"]), turn.as_quat()
            s.drive("ship", origin, [w, x, y, z])
            s.step()
            one.step()
            for name in ("tension_top", "take_off_tension", "absorbed_power"):
                np.testing.assert_allclose(s.values()[name], one.values()[name], rtol=1e-7)
            force, moment = s.pulls("ship")
            bow, stern = (turn.apply(point) for point in still["fairleads"].values())
            way = s.values()["joint_position"][0] - origin - stern
            pull = s.values()["take_off_tension"][0] * way / np.linalg.norm(way)
            np.testing.assert_allclose(force, s.pull("fore.to") + pull, rtol=1e-6)
            np.testing.assert_allclose(moment, np.cross(bow, s.pull("fore.to")) + np.cross(stern, pull), rtol=1e-6)
    with pytest.raises(InputError, match="the scene moves it"):
        Session(moved, driven="ship")
