"""Lines on a vessel with prescribed motion: their ends follow the rigid body, in statics and at every step.

Source: rotations about space-fixed axes with scipy; the same end motions given as keys of joints, bit for bit.
"""

import base64
import re

import numpy as np
import pytest
import xarray as xr
from every_key import shows
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from dolfbuoy import InputError, Session, figures, load_scene, modes, simulate, solve_static
from dolfbuoy.check.report import derived
from dolfbuoy.model.prescribed_ends import direction_of, motion_of
from dolfbuoy.model.riding import rider_of
from dolfbuoy.model.sea import elevation_at
from dolfbuoy.model.varying import Gusts
from dolfbuoy.page.run_page import data_of
from dolfbuoy.results.devices import winds_of
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.series import series_of
from dolfbuoy.results.summary import summary
from dolfbuoy.scene.cable import EndDirection

ROPE = {"length": 34.0, "line_density": 4.0, "diameter": 0.05, "axial_stiffness": 1e6, "elements": 4}
POINTS = {"bow": [5.0, 1.0, -1.0], "stern": [-5.0, 0.0, -0.5]}
REST, HEADING = [2.0, 3.0, 0.0], 30.0


def motion(t):
    """(shift, [roll, pitch, yaw] in degrees), at rest at t = 0."""
    grown = 1 - np.cos(t)
    return grown * np.array([1.0, -0.5, 0.8]), grown * np.array([4.0, -7.0, 10.0])


TIMES = np.linspace(0.0, 2.0, 41)
ROWS = [[float(x) for x in (t, *motion(t)[0], *motion(t)[1])] for t in TIMES]
SCENE = {
    "sea": {"depth": 30.0, "dry_above": False},
    "vessel": [{"name": "ship", "position": REST, "heading_deg": HEADING, "fairleads": POINTS, "motion": ROWS}],
    "cable": [
        {**ROPE, "name": "one", "from": [20.0, 6.0, -30.0], "to": "ship.bow"},
        {**ROPE, "name": "two", "from": [-18.0, 4.0, -30.0], "to": "ship.stern"},
        {**ROPE, "name": "between", "from": "ship.stern", "to": "ship.bow", "length": 12.0},
    ],
    "time": {"end": 2.0, "step": 0.05, "output_every": 0.05},
}
BOW, STERN = (np.array(point) for point in POINTS.values())


def place(point, t):
    """A point of the vessel, by scipy's rotations."""
    shift, (roll, pitch, yaw) = motion(t)
    turn = Rotation.from_euler("xyz", [roll, pitch, yaw + HEADING], degrees=True)
    return np.array(REST) + shift + turn.apply(point)


def changed(**keys):
    return SCENE | {"vessel": [{**SCENE["vessel"][0], **keys}]}


def ends_of(record):
    """Places of the upper ends of the cables over the frames."""
    cable = record.cable_of_node.values
    return {name: record.cable_position.values[:, cable == k] for k, name in enumerate(record.cable.values)}


@shows("vessel.name", "vessel.position", "vessel.heading_deg", "vessel.fairleads", "vessel.motion")
def test_ends_are_where_a_rigid_body_has_them():
    lines = ends_of(record := simulate(SCENE))
    expected = {
        name: np.array([place(p, t) for t in record.frame.values]) for name, p in (("bow", BOW), ("stern", STERN))
    }
    np.testing.assert_allclose(lines["one"][:, -1], expected["bow"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(lines["two"][:, -1], expected["stern"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(lines["between"][:, 0], expected["stern"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(lines["between"][:, -1], expected["bow"], rtol=0, atol=1e-12)


@shows("vessel.hull")
def test_its_hull_is_drawn_where_it_is():
    """A box with its length along the vessel's x axis, in the snapshot and over time in the page; not where a caller
    moves it, of whom the record says no more than where the lines end."""
    scene = load_scene(changed(hull=[12.0, 4.0, -1.5, 2.0]))
    record = simulate(scene)
    box = np.array([[x, y, z] for x in (-6.0, 6.0) for y in (-2.0, 2.0) for z in (-1.5, 2.0)])
    (shell,) = (frames := Frames(record, scene)).shells
    for t in TIMES[::8]:
        np.testing.assert_allclose(shell.at(t), [place(corner, t) for corner in box], atol=1e-12)
    np.testing.assert_allclose(frames.at(0.8).points[-8:], shell.at(0.8), atol=1e-12)
    assert "vessel" in {text.get_text() for text in figures.snapshot(record).legends[0].get_texts()}
    view = data_of(record, scene)["view"]
    assert {"text": "ship", "vessel": 0} in view["labels"]
    packed = view["vessels"][0]["path"]
    numbers = np.frombuffer(base64.b64decode(packed["data"]), "<i2") * packed["scale"] + packed["offset"]
    np.testing.assert_allclose(numbers.reshape(-1, 8, 3)[-1], shell.at(2.0), atol=packed["scale"])
    (still,) = Frames(record, load_scene(changed(hull=[12.0, 4.0, -1.5, 2.0], motion=None))).shells
    assert not still.moves
    record.attrs["session"] = "driven: one.from, ship"
    assert Frames(record, scene).shells == []


WIND = {"speed_10m": 20.0, "direction_deg": 50.0, "area": 300.0, "height": 6.0}
WINDS = {
    "speed_10m": 25.0,
    "direction_deg": 80.0,
    "area": 400.0,
    "height": 8.0,
    "drag_coefficient": 0.8,
    "air_density": 1.3,
    "over_time": [[0.0, 1.0, 0.0], [2.0, 0.5, 0.0]],
}
GUSTS = {"gusts": "kaimal", "turbulence": 0.15, "seed": 4, "ramp": 1.0}


def blown(t, water=0.0, over_time=None, **keys):
    """1/2 rho C A v10^2 (z/10)^(2/7) at the height over the water of a point of the vessel [N]."""
    c = {"drag_coefficient": 1.0, "air_density": 1.225} | WIND | keys
    z, angle = place([0.0, 0.0, c["height"]], t)[2] - water, np.radians(c["direction_deg"])
    v = c["speed_10m"] * (1 - t / 4 if over_time else 1.0)
    size = 0.5 * c["air_density"] * c["drag_coefficient"] * c["area"] * v**2 * (z / 10) ** (2 / 7)
    return size * np.array([np.cos(angle), np.sin(angle), 0.0])


@shows(*(f"vessel.wind.{key}" for key in WINDS))
def test_wind_on_it():
    """By hand, at a point that the vessel moves; lines do not feel it, a caller who moves it knows better."""
    own = {"wind": WIND}
    record, still = simulate(changed(**own)), simulate(SCENE)
    expected = [blown(t) for t in record.time.values]
    np.testing.assert_allclose(record.wind_force.sel(vessel="ship"), expected, rtol=1e-9, atol=1e-6)
    np.testing.assert_array_equal(record.tension_top, still.tension_top)
    assert "wind_force" not in still
    np.testing.assert_allclose(solve_static(changed(**own)).wind_force[0], blown(0.0), rtol=1e-9, atol=1e-6)
    for key, value in WINDS.items():
        (found,) = winds_of(load_scene(changed(wind=WIND | {key: value}))).values()
        for t in (0.0, 0.8, 1.7):
            np.testing.assert_allclose(found.force(t), blown(t, **{key: value}), rtol=1e-5, atol=1e-6)
    ends = derived(load_scene(changed(wind=WIND | {"over_time": [[0.0, 1.0, 0.0], [1.0, 2.0, 0.0]]}))).warnings
    assert any("ship: wind.over_time ends at 1 s, before the run" in said for said in ends)
    with pytest.raises(InputError, match="it has wind, whose force is known where the scene moves it"):
        Session(changed(motion=None, **own), driven=["ship"])


def test_its_wind_is_shown():
    """In the table of a run, its statistics, the snapshot, and in the page at its place over time."""
    record, scene = simulate(changed(wind=WIND)), load_scene(changed(wind=WIND))
    sizes = [np.linalg.norm(blown(t)) / 1e3 for t in record.time.values]
    (row,) = (row for row in summary(record, scene) if row[0] == "wind force")
    assert [float(x) for x in row[1].split(" ... ")] == pytest.approx([min(sizes), max(sizes)], rel=1e-3)
    assert "wind_force_y of ship" in {series.label for series in series_of(record)}
    ((name, at, push),) = Frames(record, scene).at(0.8).arrows("outside")
    assert name == "wind force"
    np.testing.assert_allclose(at, place([0.0, 0.0, 6.0], 0.8), atol=1e-6)
    np.testing.assert_allclose(push, blown(0.8), rtol=1e-9, atol=1e-6)
    assert any("wind force" in text.get_text() for text in figures.snapshot(record).legends[0].get_texts())
    (packed,) = (force for force in data_of(record, scene)["view"]["forces"] if force["kind"] == "outside")
    for name, last in (("path", place([0.0, 0.0, 6.0], 2.0)), ("values", blown(2.0))):
        numbers = np.frombuffer(base64.b64decode(packed[name]["data"]), "<i2") * packed[name]["scale"]
        np.testing.assert_allclose((numbers + packed[name]["offset"])[-3:], last, atol=packed[name]["scale"])


@shows(*(f"vessel.wind.{key}" for key in GUSTS))
def test_its_wind_is_over_the_wave_and_has_gusts():
    """The sum of a seed, in a run; the height is that over the water there."""
    scene = load_scene(changed(wind=WIND | GUSTS) | {"waves": REGULAR})
    (one,) = winds_of(scene).values()
    gusts = Gusts(scene.vessel[0].wind, 4)
    for t in (0.6, 1.9):
        water = elevation_at(scene, t, place([0.0, 0.0, 6.0], t))
        assert abs(water) > 0.1
        np.testing.assert_allclose(one.force(t), blown(t, water, speed_10m=20.0 + gusts(t)), rtol=1e-5)
    (steady,) = winds_of(scene, moving=False).values()
    np.testing.assert_allclose(steady.force(1.5), blown(1.5), rtol=1e-5, atol=1e-6)


def test_between_rows_they_are_there_to_the_fourth_order():
    network = load_scene(SCENE).network
    errors = []
    for every in (2, 1):
        scene = load_scene(changed(motion=ROWS[::every]))
        path = motion_of(scene.network.pieces[0].ends[1].top)
        errors.append(max(np.abs(path(t) - place(BOW, t)).max() for t in np.linspace(0.3, 1.7, 57)))
    assert network.pieces[0].ends[1].kind == "prescribed"
    assert errors[1] < 1e-5
    assert np.log2(errors[0] / errors[1]) > 3.5


def test_a_run_is_that_of_joints_that_move_so():
    def joint(name, point):
        rest = np.array(REST) + Rotation.from_euler("z", HEADING, degrees=True).apply(point)
        rows = load_scene(SCENE).vessel[0].held(name).motion
        return {"name": name, "position": rest.tolist(), "motion": [list(row) for row in rows]}

    joints = [joint("bow", BOW), joint("stern", STERN)]
    cables = [
        {**cable, **{end: str(cable[end]).removeprefix("ship.") for end in ("from", "to") if "ship" in cable[end]}}
        for cable in SCENE["cable"]
    ]
    other = {name: value for name, value in SCENE.items() if name != "vessel"} | {"joint": joints, "cable": cables}
    one, two = simulate(SCENE), simulate(other)
    for name in ("tension_top", "anchor_force", "cable_position"):
        np.testing.assert_allclose(one[name].values, two[name].values, rtol=1e-9, atol=1e-9)


@shows("vessel.ramp")
def test_a_ramp_lets_it_begin_gently():
    rows = [[t, *(0.5 * np.sin(t) * np.ones(3)), 0.0, 0.0, 0.0] for t in TIMES]
    path = simulate(changed(motion=rows, ramp=1.0))
    bow = ends_of(path)["one"][:, -1]
    grown = 0.5 * (1 - np.cos(np.pi * np.minimum(path.frame.values, 1.0)))
    np.testing.assert_allclose(bow - bow[0], np.outer(grown * 0.5 * np.sin(path.frame.values), np.ones(3)), atol=1e-9)


def test_without_a_motion_it_rests():
    record = solve_static(changed(motion=None))
    still = solve_static(SCENE)
    np.testing.assert_allclose(record.tension_top.values, still.tension_top.values, rtol=1e-9)
    with Session(changed(motion=None), driven=["one.to", "two.to"]) as s:
        s.drive("one.to", place(BOW, 0.0) + [0, 0, 0.01])
        s.step()


def written(tmp_path, kind):
    if kind == "csv":
        text = "\n".join(["t, x, y, z, roll, pitch, yaw", *(", ".join(map(repr, row)) for row in ROWS)])
        (tmp_path / "ship.csv").write_text(text)
        return "ship.csv"
    columns = np.array(ROWS).T
    names = ("time", "surge", "sway", "heave", "roll", "pitch", "yaw")
    data = {
        n: ("time", np.radians(x) if n in names[4:] else x) for n, x in zip(names, columns, strict=True) if n != "time"
    }
    file = xr.Dataset(data, coords={"time": columns[0]})
    for name in names[4:]:
        file[name].attrs["units"] = "rad"
    file.to_netcdf(tmp_path / "ship.nc")
    return "ship.nc"


@pytest.mark.parametrize("kind", ["csv", "netcdf"])
def test_a_file_is_read_with_the_scene(tmp_path, kind):
    name = written(tmp_path, kind)
    load_scene(changed(motion=ROWS[:2])).save(tmp_path / "scene.toml")
    text = (tmp_path / "scene.toml").read_text()
    text = re.sub(r"motion = \[.*?\n\]", f'motion = "{name}"', text, flags=re.DOTALL)
    (tmp_path / "scene.toml").write_text(text)
    found = load_scene(tmp_path / "scene.toml").vessel[0].motion
    np.testing.assert_allclose(found, ROWS, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"fairleads": {}}, "must name a point or more"),
        ({"motion": None, "ramp": 1.0}, "goes with a motion"),
        ({"motion": [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 100]]}, "must not turn by more than 90 degrees"),
        ({"motion": [[0, 0, 0, 0, 0, 0, 0], [0.1, 200, 0, 0, 0, 0, 0]]}, "must not be faster than 1000 m/s"),
        ({"motion": [[1, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0]]}, "must hold rows of growing time"),
        ({"hull": [12.0, 0.0, -1.5, 2.0]}, "must be [length, breadth, keel, deck], the first two above 0"),
        ({"hull": [12.0, 4.0, 2.0, -1.5]}, "and the deck over the keel"),
        ({"wind": WIND | {"seed": 1}}, "seed = 1: goes with gusts"),
        ({"fairleads": {"bow": [5.0, 1.0, -1.0]}}, "must be one of the fairleads of ship: bow"),
    ],
)
def test_what_no_vessel_can_be_is_refused(keys, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        load_scene(changed(**keys))


def test_a_vessel_holds_something_and_has_a_name_of_its_own():
    lone = [{**SCENE["vessel"][0], "name": "other"}]
    with pytest.raises(InputError, match=r"vessel.name = 'other': holds no cable"):
        load_scene(SCENE | {"vessel": [*SCENE["vessel"], *lone]})
    joint = {"name": "ship", "position": [0.0, 0.0, 0.0]}
    with pytest.raises(InputError, match=r"vessel.name = 'ship': is the name of a buoy or a joint"):
        load_scene(SCENE | {"joint": [joint]})


# -- in waves ----------------------------------------------------------------------------------------------------------

PERIODS, ANGLES = (4.0, 8.0, 12.0), (0.0, 90.0, 180.0, 270.0)


def operator(period, angle):
    """(size, phase in degrees) of the six motions, made up; of one curve over periods, and of a direction."""
    turn = np.radians(angle)
    sizes = [0.1 * period, 0.05 * period * (2 + np.sin(turn)), 0.9, 2.0 + np.cos(turn), 1.5, 0.4]
    return [(size, 20.0 * k + 3 * period) for k, size in enumerate(sizes)]


def rows_of(periods=PERIODS, angles=ANGLES):
    pairs = [(period, angle) for period in periods for angle in angles]
    return [[p, a, *np.ravel(operator(p, a)).tolist()] for p, a in pairs]


REGULAR = {"amplitude": 0.7, "period": 8.0, "direction_deg": HEADING + 90.0, "phase_deg": 35.0, "ramp": 1.0}


def riding(waves, **keys):
    return changed(motion=None, raos=rows_of(), **keys) | {"waves": waves}


def in_waves(t, amplitude, k, omega, direction, phase, ramp, six):
    """Shift in the world and angles of a vessel in one wave: every motion leads the elevation by its phase."""
    angle = np.radians(direction)
    there = k * (np.cos(angle) * REST[0] + np.sin(angle) * REST[1]) + phase
    grown = 0.5 * (1 - np.cos(np.pi * t / ramp)) if t < ramp else 1.0
    motions = [grown * amplitude * size * np.cos(omega * t - there + np.radians(lead)) for size, lead in six]
    return Rotation.from_euler("z", HEADING, degrees=True).apply(motions[:3]), np.array(motions[3:])


def fairlead(point, shift, angles):
    turn = Rotation.from_euler("xyz", [angles[0], angles[1], angles[2] + HEADING], degrees=True)
    return np.array(REST) + shift + turn.apply(point)


@shows("vessel.raos")
def test_in_a_regular_wave_its_ends_are_on_the_closed_form():
    record = simulate(riding(REGULAR))
    omega = 2 * np.pi / 8.0
    k = brentq(lambda k: 9.81 * k * np.tanh(30 * k) - omega**2, 1e-3, 1.0, xtol=1e-15)
    wave = (0.7, k, omega, REGULAR["direction_deg"], np.radians(35.0), 1.0, operator(8.0, 90.0))
    lines = ends_of(record)
    for name, point in (("one", BOW), ("two", STERN)):
        expected = [fairlead(point, *in_waves(t, *wave)) for t in record.frame.values]
        np.testing.assert_allclose(lines[name][:, -1], expected, rtol=0, atol=1e-9)
        assert np.ptp(lines[name][:, -1], axis=0).min() > 0.05


@shows("vessel.raos")
def test_in_waves_a_direction_turns_with_the_vessel():
    """And with its heading and a drift; the line's end follows, within what its first element leaves."""
    own = [0.3, -0.2, 1.0]
    stiff = {**SCENE["cable"][0], "bending_stiffness": 1e4, "to_end": {"direction": own}, "position_degree": 2}
    stiff |= {"tension_degree": 1, "elements": [[33.0, 8], [1.0, 4]], "length": 34.0}
    scene = riding(REGULAR) | {"cable": [stiff]}
    clamp = load_scene(scene).network.pieces[0].ends[1].clamp
    omega = 2 * np.pi / 8.0
    k = brentq(lambda k: 9.81 * k * np.tanh(30 * k) - omega**2, 1e-3, 1.0, xtol=1e-15)
    wave = (0.7, k, omega, REGULAR["direction_deg"], np.radians(35.0), 1.0, operator(8.0, 90.0))
    record, found = simulate(scene, time={"end": 2.0}), direction_of(clamp)
    ways = []
    for t in record.frame.values:
        roll, pitch, yaw = in_waves(t, *wave)[1]
        turn = Rotation.from_euler("xyz", [roll, pitch, yaw + HEADING], degrees=True)
        ways.append(turn.apply(own) / np.linalg.norm(own))
        np.testing.assert_allclose(found(t), ways[-1], rtol=0, atol=1e-9)
    ends = record.cable_position.values[:, -3:]
    last = 3 * ends[:, 2] - 4 * ends[:, 1] + ends[:, 0]  # derivative of the parabola at its end
    last /= np.linalg.norm(last, axis=1)[:, None]
    np.testing.assert_allclose(last, ways, rtol=0, atol=2e-3)
    assert np.ptp(ways, axis=0).max() > 0.02


def test_in_several_waves_responses_add_up_and_lie_between_rows():
    sea = {"components": [[0.3, 6.0, 10.0, 40.0], [0.2, 12.0, -60.0, 170.0]], "direction_deg": HEADING, "ramp": 1.0}
    scene = load_scene(riding(sea))
    path = motion_of(scene.network.pieces[0].ends[1].top)

    def between(period, angle):
        low, high = (a for a in PERIODS if a <= period), (a for a in PERIODS if a > period)
        low, high = max(low), min(high, default=None)
        left, below = angle % 360 // 90 * 90.0, (angle % 360) / 90 % 1
        part = 0.0 if high is None else (period - low) / (high - low)
        found = np.zeros(6, complex)
        for p, of_p in ((low, 1 - part), (high or low, part)):
            for a, of_a in ((left, 1 - below), ((left + 90) % 360, below)):
                found += of_p * of_a * np.array([size * np.exp(1j * np.radians(lead)) for size, lead in operator(p, a)])
        return [(abs(one), np.degrees(np.angle(one))) for one in found]

    t, shift, angles = 3.7, np.zeros(3), np.zeros(3)
    for amplitude, period, direction, phase in sea["components"]:
        omega = 2 * np.pi / period
        k = brentq(lambda k, w=omega: 9.81 * k * np.tanh(30 * k) - w**2, 1e-4, 1.0, xtol=1e-15)
        one = in_waves(t, amplitude, k, omega, HEADING + direction, np.radians(phase), 1.0, between(period, direction))
        shift, angles = shift + one[0], angles + one[1]
    np.testing.assert_allclose(path(t), fairlead(BOW, shift, angles), rtol=0, atol=1e-9)


def test_a_direction_turns_with_its_vessel():
    """And with its heading, also where it rests."""
    given, (vessel,) = EndDirection(direction=(0.6, 0.0, -0.8)), load_scene(SCENE).vessel
    for t, *direction in vessel.clamp(given).motion:
        roll, pitch, yaw = motion(t)[1]
        turn = Rotation.from_euler("xyz", [roll, pitch, yaw + HEADING], degrees=True)
        np.testing.assert_allclose(direction, turn.apply([0.6, 0.0, -0.8]), atol=1e-12)
    (still,) = load_scene(changed(motion=None)).vessel
    upright = Rotation.from_euler("z", HEADING, degrees=True)
    np.testing.assert_allclose(still.clamp(given).direction, upright.apply([0.6, 0.0, -0.8]), atol=1e-12)


def test_how_high_a_wave_lifts_a_point():
    """Heave, and roll and pitch by their levers: y of a point for roll, x for pitch."""
    end = load_scene(riding(REGULAR)).network.pieces[0].ends[1].top
    _, _, heave, roll, pitch, _ = (size for size, _ in operator(8.0, 90.0))
    lifted = 0.7 * (heave + np.radians(abs(BOW[1]) * roll + abs(BOW[0]) * pitch))
    assert rider_of(end).rise("bow") == pytest.approx(lifted)
    assert abs(BOW[0]) > abs(BOW[1]) > 0 != roll != pitch


def test_a_drift_is_added_to_the_waves():
    drift = [[0.0, 0, 0, 0, 0, 0, 0], [1.0, 2.0, 0, 0, 0, 0, 5.0], [4.0, 3.0, 0, 0, 0, 0, 5.0]]
    waves = riding(REGULAR)
    both = waves | {"vessel": [{**waves["vessel"][0], "motion": drift}]}
    one, two = (motion_of(load_scene(s).network.pieces[0].ends[1].top) for s in (both, waves))
    np.testing.assert_allclose(one(0.0), two(0.0), rtol=1e-12)
    apart = np.array(one(4.0)) - two(4.0)  # the drift at its end, and the yaw of 5 degrees on the arm of the bow
    arm = np.array(two(4.0)) - REST
    turned = Rotation.from_euler("z", 5.0, degrees=True).apply(arm) - arm
    np.testing.assert_allclose(apart - [3.0, 0.0, 0.0], turned, rtol=0, atol=0.1)


@pytest.mark.parametrize(
    ("scene", "sentence"),
    [
        (changed(motion=None, raos=rows_of()), "vessel.raos are of a response to them"),
        (riding({"theory": "stream", "height": 1.0, "period": 8.0}), "does not go with vessel.raos, which are linear"),
        (changed(motion=None, raos=rows_of()[:-1]), "must have a row for every period in every direction"),
        (changed(motion=None, raos=[*rows_of(), rows_of()[0]]), "must have each period and direction once"),
        (changed(motion=None, raos=[[-1.0, *rows_of()[0][1:]]]), "must have positive periods"),
        (changed(motion=None, raos=[[1.0, 2.0]]), "must be 14"),
    ],
)
def test_operators_that_mean_nothing_are_refused(scene, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        load_scene(scene)


def test_without_waves_it_is_at_rest():
    """`modes` and `check` take the waves away: its lines, one out of the water, end where they do without operators."""
    waves = {"amplitude": 0.5, "period": 8.0}
    points = {"bow": [5.0, 1.0, 1.5], "stern": [-5.0, 0.0, -0.5]}
    calm, ours = changed(motion=None, fairleads=points), riding(waves, fairleads=points)
    for scene in (calm, ours):
        scene["sea"] = {"depth": 30.0}
    found, known = (modes(load_scene(scene), number=3).period.values for scene in (ours, calm))
    np.testing.assert_allclose(found, known, rtol=1e-9)
