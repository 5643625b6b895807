"""Functions behind warnings and models, each called alone, without a run.

Source: the same numbers by hand.
"""

import math
import resource
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import ufl
from mpi4py import MPI
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.forms import cable as form
from dolfbuoy.forms import sea
from dolfbuoy.linear import periods
from dolfbuoy.linear.drag import _faces, _WetAxis
from dolfbuoy.linear.layout import Body, LineNodes
from dolfbuoy.linear.moving import _changes_of_sign
from dolfbuoy.linear.natural import check_smooth
from dolfbuoy.linear.stiffness import mooring_stiffness
from dolfbuoy.model import effects, feasible
from dolfbuoy.model.airy import current_felt
from dolfbuoy.model.contact import height_of_bed, plane
from dolfbuoy.model.feasible import check_feasible, hanging_weight
from dolfbuoy.model.growth import Growth
from dolfbuoy.model.line_energy import or_taut
from dolfbuoy.model.line_groups import LineGroups
from dolfbuoy.model.masses import Masses
from dolfbuoy.model.parting import Parting
from dolfbuoy.model.prescribed_ends import overshoot
from dolfbuoy.model.rigid import weight_per_length
from dolfbuoy.model.spectra import _tapered
from dolfbuoy.model.surfacing import _highest
from dolfbuoy.motion.energy import Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.motion.start import Pose, Start, _moorings, _set_buoy
from dolfbuoy.motion.stepping import JumpControl
from dolfbuoy.scene import Top, settings
from dolfbuoy.scene.buoy import BuoyStart
from dolfbuoy.statics import network as still
from dolfbuoy.statics import on_bed
from dolfbuoy.statics.catenary import Catenary
from dolfbuoy.statics.first_shape import given_shapes
from dolfbuoy.statics.offsets import loaded
from dolfbuoy.statics.start import NUDGE, _drawn_apart, _propped

UPRIGHT, UPSIDE_DOWN = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0, 0.0])
SEA = {"depth": 30.0, "density": 1000.0}
CABLE = {"length": 20.0, "line_density": 5.0, "diameter": 0.05, "axial_stiffness": 1e6, "elements": 2}
FLOAT = {"hull": [[0, 2], [2, 2]], "mass": 500.0}
HELD = {"top": {"kind": "fixed", "position": [0.0, 0.0, -12.0]}}


def test_slope_near_a_sample_is_that_of_its_elevation():
    """By finite differences, which are exact for a parabola."""
    numbers = np.random.default_rng(1).uniform(-1, 1, sea.LARGE)
    samples = sea.Samples(ufl.as_vector(numbers.tolist()), 30.0)

    def flow(x, y):
        return sea.sampled_flow(samples, ufl.as_vector([x, y, 0.2]))

    def value(expression):
        return float(apply_algebra_lowering(ufl.as_ufl(expression))(()))

    x, h = (0.3, -0.4), 0.1
    for i in (0, 1):
        low, high = ([c + s * h * (i == k) for k, c in enumerate(x)] for s in (-1, 1))
        slope = (value(flow(*high).elevation) - value(flow(*low).elevation)) / (2 * h)
        assert value(flow(*x).slope[i]) == pytest.approx(slope, rel=1e-12)


# -- groups of lines ---------------------------------------------------------------------------------------------------


def test_tensions_of_groups_of_one_two_and_three_in_an_element():
    rows = [np.array([[0], [1]]), np.array([[4, 5]]), np.array([[7, 8, 9]])]
    groups = [Fake(T_dofs=dofs, part=Fake(offset=10 * k)) for k, dofs in enumerate(rows)]
    found = LineGroups.T_dofs.fget(Fake(groups=groups))
    assert found.tolist() == [[0, 0, 0], [1, 1, 1], [14, 15, 15], [27, 28, 29]]


def test_the_smallest_stretch_is_that_of_any_group():
    groups = [Fake(smallest_stretch=lambda u, x=x: x) for x in (0.9, -0.2, 1.0)]
    assert LineGroups.smallest_stretch(Fake(groups=groups), None) == -0.2


def test_pulled_ends_have_the_numbers_of_the_scene():
    groups = [Fake(numbers=[0, 3], end_loads={1: "a"}), Fake(numbers=[1, 2], end_loads={0: "b", 1: "c"})]
    assert LineGroups.end_loads.fget(Fake(groups=groups)) == {3: "a", 1: "b", 2: "c"}


def test_energy_of_ropes_that_damp_beside_other_lines():
    sections = [Fake(axial_stiffness=100.0, slack=slack, damping=1.0) for slack in ("tension-only", "compressive")]
    constants = Fake(per_cell=lambda number: np.array([number(c) for c in sections]))
    lines = Fake(sections=sections, constants=constants, cable=form.Cable(1.0, None, None, None))
    found = or_taut(lines, np.array([7.0, 8.0]), lambda cable: 2 * cable.EA)
    assert found.tolist() == [200.0, 8.0]


# -- water and bed -----------------------------------------------------------------------------------------------------


def test_the_water_pushes_what_is_wet_of_a_line():
    effect = Fake(line=lambda c, matter, rho_w, flow, point: c * rho_w)
    masses = Fake(where="line", _loads=[(effect, 3.0)], sea=Fake(density=1000.0), water_at=lambda r: None)
    for wet, part in ((None, 1.0), (0.25, 0.25)):
        masses.wet_part = lambda wet=wet: wet
        assert Masses._forces_of_water(masses, None, None, None) == [(effect, part * 3000.0)]


def test_height_of_a_bed_that_slopes_both_ways():
    scene = load_scene({"sea": SEA, "cable": CABLE | HELD, "seabed": {"slope": [0.1, -0.3]}})
    (x, y), (normal, level) = (20.0, 5.0), plane(scene)
    z = height_of_bed(scene, np.array([[x, y]]))[0]
    assert z == pytest.approx(-30.0 + 0.1 * x - 0.3 * y, rel=1e-14)
    assert normal @ [x, y, z] == pytest.approx(level, rel=1e-14)


@pytest.mark.parametrize(
    ("top", "highest"),
    [
        ({"velocity": [9.0, 8.0, 0.1]}, 2.0),
        ({"velocity": [9.0, 8.0, -0.1]}, -8.0),
        ({"motion": [[0, 0, 0, 0], [1, 7, 9, 3]]}, -5.0),
        ({"amplitude": [7, 9, -2], "period": 60}, -6.0),
    ],
)
def test_the_highest_place_of_an_end_that_moves(top, highest):
    scene = load_scene({"cable": CABLE | HELD, "time": {"end": 100.0, "step": 0.5}})
    assert _highest(scene, Top(kind="prescribed", position=[0, 0, -8], **top)) == pytest.approx(highest, rel=1e-14)


def test_current_as_a_wave_feels_it():
    """Kirby and Chen's mean, with its cosh evaluated directly."""
    current = {"speed": 2.0, "profile": "power", "direction_deg": 60.0}
    scene, k, h = load_scene({"sea": SEA, "cable": CABLE | HELD, "current": current}), 0.04, 30.0

    def weighted(z):
        return 2.0 * (1 + z / h) ** (1 / 7) * math.cosh(2 * k * (z + h))

    mean = 2 * k / math.sinh(2 * k * h) * quad(weighted, -h, 0.0, epsrel=1e-10)[0]
    assert current_felt(scene, k, 0.0) == pytest.approx(mean * 0.5, rel=1e-7)


def test_a_taper_takes_half_of_its_part_at_each_end():
    taper = _tapered(100, 0.2)
    assert np.count_nonzero(taper < 1) == 20
    np.testing.assert_allclose(taper[:10], 0.5 * (1 - np.cos(np.pi * (np.arange(10) + 0.5) / 10)), rtol=1e-13)


# -- what is told of a scene -------------------------------------------------------------------------------------------


def test_memory_of_a_run(monkeypatch):
    """Two elements P2-P1 have two more nodes and two tensions each."""
    scene = load_scene({"cable": CABLE | HELD | {"position_degree": 2, "tension_degree": 1}})
    needed = 2 * (2 * 3 + 2) * feasible.PER_UNKNOWN
    monkeypatch.setattr(feasible, "memory", lambda: needed)
    feasible.check_size(scene, MPI.COMM_SELF)
    monkeypatch.setattr(feasible, "memory", lambda: 0.99 * needed)
    with pytest.raises(InputError, match=r"cable.elements = 2 in all: must be fewer"):
        feasible.check_size(scene, MPI.COMM_SELF)


def test_the_limit_of_a_process_is_its_memory(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (12345, 99999))
    assert feasible.memory() == 12345


def test_elastic_and_inextensible_lines_are_both_named():
    stiff = CABLE | {"axial_stiffness": math.inf}
    ends = [{"name": name, "from": [0, 0, 0], "to": [x, 0, 0]} for name, x in (("a", 9.0), ("b", -9.0))]
    for cables, said in (((CABLE, stiff), True), ((CABLE, CABLE), False)):
        scene = load_scene({"cable": [cable | end for cable, end in zip(cables, ends, strict=True)]})
        assert ("inextensible cable" in effects.names(scene)) == said
        assert "elastic cable" in effects.names(scene)


def test_growth_may_make_an_effective_mass_negative():
    light = CABLE | HELD | {"added_mass": -1.0, "line_density": 3.0}
    check_feasible(load_scene({"sea": SEA, "cable": light}))
    effective = 3.0 - 1000.0 * 4 * math.pi / 4 * 0.05**2
    with pytest.raises(InputError, match=f"effective mass {effective:.6g} kg/m"):
        check_feasible(load_scene({"sea": SEA, "cable": light | {"marine_growth": [[-30.0, 2.0, 1.0]]}}))


def test_weight_of_segments_down_to_the_bed():
    """Of 10 m and 20 m, on a bed at 25 m depth: at least the whole upper one and 15 m of the lower one."""
    piece = {key: CABLE[key] for key in ("diameter", "axial_stiffness", "elements")}
    segments = [piece | {"length": 20.0, "line_density": 9.0}, piece | {"length": 10.0, "line_density": 4.0}]
    scene = load_scene({"gravity": 10.0, "sea": SEA | {"depth": 25.0}, "cable": {"segments": segments}, "buoy": FLOAT})
    water = 1000.0 * math.pi / 4 * 0.05**2
    assert hanging_weight(scene, "buoy") == pytest.approx(10 * (10 * (4 - water) + 15 * (9 - water)), rel=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_how_far_a_spline_leaves_its_rows(sign):
    t, z = np.arange(6.0), sign * np.array([0.0, 1.0, 1.0, 1.0, 0.5, 0.3])
    fine = CubicSpline(t, z, bc_type="clamped")(np.linspace(0, 5, 100_001))
    beyond = max(fine.max() - z.max(), z.min() - fine.min())
    found = overshoot(np.column_stack([t, 0 * t, 0 * t, z]))
    assert found == pytest.approx(beyond / np.ptp(z), rel=1e-6)
    assert found > 0.05


# -- parts of lines ----------------------------------------------------------------------------------------------------


def test_an_element_parts_by_its_largest_tension():
    lines = Fake(part=Fake(slice=slice(None)), T_dofs=np.array([[0, 1], [2, 3]]), comm=MPI.COMM_SELF)
    u, mine = np.array([5.0, 9.0, 7.0, 8.0]), np.array([True, True])
    assert Parting._above(Fake(lines=lines), 8.5, u, mine).tolist() == [True, False]
    assert Parting._above(Fake(lines=lines), 9.5, u, mine).tolist() == [False, False]


def test_growth_of_all_elements_on_a_metre():
    scene = load_scene({"sea": SEA, "cable": CABLE | HELD})
    section = scene.network.pieces[0].section
    lines = Fake(sections=[section], line_of_cell=np.zeros(2, int), comm=MPI.COMM_SELF, scene=scene)
    growth = Fake(lines=lines, weights=np.array([30.0, 50.0]))
    assert Growth.weight_per_length(growth, 0) == pytest.approx(weight_per_length(scene, section) + 80 / 20, rel=1e-14)


@pytest.mark.parametrize(("end", "largest"), [(500.0, 50.0), (4.0, 1.0), (1e5, 100.0)])
def test_the_largest_step_of_a_run_that_adapts(end, largest):
    """100 steps, at most a tenth of the run, at least the first; the smallest is a ten-thousandth of it."""
    time = {"end": end, "step": 1.0, "scheme": "bdf2", "tolerance": 1e-3}
    run = Fake(scene=load_scene({"cable": CABLE | HELD, "time": time}), scheme=Fake(order=2))
    control = Simulation._make_control(run)
    assert (control.largest, control.smallest) == (largest, 1e-4)


@pytest.mark.parametrize(("lying", "pushed"), [(5.0, True), (0.0, False)])
def test_a_line_that_lies_without_width_is_drawn_aside(lying, pushed):
    network = still.Network(
        [still.Joint(position=np.zeros(3)), still.Joint(free=True)], [still.Piece(0, 1, 20, 10, 1e6)]
    )
    rest = Fake(pulls=np.zeros((1, 3)), lying=[lying])
    found = _drawn_apart(Fake(scene=Fake(current=None)), network, rest)
    assert found[1].push.tolist() == ([NUDGE * 200.0, 0.0, 0.0] if pushed else [0.0, 0.0, 0.0])


def test_a_strut_is_propped_at_its_length():
    network = still.Network(
        [still.Joint(position=np.zeros(3)), still.Joint(free=True)], [still.Piece(0, 1, 10, 1, 1e6)]
    )
    problem = Fake(law=True, lines=Fake(sections=[Fake(slack="compressive")]))
    rest = Fake(positions=np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0]]))
    prop = _propped(problem, network, rest)[1]
    reach = (1 - NUDGE) * 10
    np.testing.assert_allclose(prop.position, [math.sqrt(reach**2 - 16), 0.0, 4.0], rtol=1e-14, atol=1e-14)
    assert not prop.free


def test_a_line_that_begins_under_the_bed_hangs_free_of_it():
    """Contact is only where it dips below its ends."""
    bed = on_bed.Bed(on_bed.UP, 0.0)
    assert isinstance(on_bed.between(np.array([0.0, 0, -1]), np.array([60.0, 0, 79]), 101.0, 5.0, 1e6, bed), Catenary)
    assert not isinstance(on_bed.between(np.zeros(3), np.array([60.0, 0, 30]), 80.0, 5.0, 1e6, bed), Catenary)


def test_one_inextensible_segment_must_keep_its_length():
    segments = [CABLE | {"length": 10.0}, CABLE | {"length": 10.0, "axial_stiffness": math.inf}]
    line = {"cable": {"segments": segments, "top": {"kind": "fixed", "position": [25.0, 0.0, 0.0]}}}
    line["initial"] = {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [25.0, 0.0, 0.0]]}
    with pytest.raises(InputError, match=r"25 m long, but an inextensible cable must keep"):
        given_shapes(load_scene(line), {})
    segments[1]["axial_stiffness"] = 1e6
    assert len(given_shapes(load_scene(line), {})) == 2


# -- in time -----------------------------------------------------------------------------------------------------------


def test_steps_where_a_tension_jumps():
    """A fifth of the largest tension at most, longer again below a tenth; where the step changes the past is new."""
    control, found = JumpControl(1.0), []
    for step, change in ((1.0, 1.0), (1.0, 3.0), (0.5, 1.5), (0.5, 0.9)):
        found.append((control.judge(step, (change, 10.0)), control.step, control.restart))
    assert found == [(True, 1.0, False), (False, 0.5, True), (True, 0.5, False), (True, 1.0, True)]
    jumping, refused = JumpControl(1.0), 0
    while not jumping.judge(jumping.step, (9.0, 10.0)):
        refused += 1
    assert (refused, jumping.rejected) == (6, 6)  # down to a 64th, which counts whatever it changes


def test_work_at_ends_that_are_pulled_or_moved():
    ends = [Fake(kind=kind) for kind in ("free", "prescribed", "fixed", "buoy")]
    lines = Fake(gamma_v=Fake(value=2.0), part=Fake(slice=slice(3)), history_v=Fake(x=Fake(array=np.ones(3))))
    lines.driven, lines.numbers, lines.pieces, lines.end_dofs = (
        {},
        [0, 1],
        [Fake(ends=ends[:2]), Fake(ends=ends[2:])],
        [[np.arange(3)] * 2] * 2,
    )
    force = {(0, 0): 10.0, (0, 1): 100.0, (1, 0): 1e3, (1, 1): 1e4}
    problem = Fake(lines=Fake(groups=[lines]), system=Fake(u=np.array([1.0, 2.0, 3.0])))
    problem.end_force = lambda piece, end, fresh: np.array([0.0, 0.0, force[piece, end]])
    assert Meter._work_at_ends(problem) == 110.0 * (2 * 3 + 1)
    lines.driven[1, 0] = None  # by a caller
    assert Meter._work_at_ends(problem) == 1110.0 * (2 * 3 + 1)


def test_what_a_line_pulls_at_a_buoy_is_against_what_holds_it():
    scene = load_scene({"sea": SEA, "cable": CABLE | {"length": 40.0}, "buoy": FLOAT})
    forces = {"anchor_force": np.array([[7.0, 8.0, 9.0]]), "end_tension": np.array([[1.0, 2.0, 3.0]])}
    (found,) = _moorings(scene.network, {"buoy": (np.array([5.0, 6.0, 0.5]), UPRIGHT)}, forces)
    np.testing.assert_allclose(found, [5.0, 6.0, -0.5, -1.0, -2.0, -3.0], rtol=1e-14)


@pytest.mark.parametrize("name", ["buoy_velocity", "buoy_angular_velocity"])
def test_a_buoy_that_moves_or_turns_is_not_at_rest(name):
    start = Start(poses={"buoy": Pose(np.zeros(3), UPRIGHT)})
    _set_buoy(start, "buoy", BuoyStart())
    assert start.at_rest
    _set_buoy(start, "buoy", BuoyStart(**{name: [0.0, 0.0, 2.0]}))
    assert not start.at_rest


# -- linear ------------------------------------------------------------------------------------------------------------


def test_faces_of_a_hull_that_widens_and_narrows():
    """Squared radii instead of areas."""
    heights, areas = _faces(Fake(stations=((0.0, 2.0), (1.0, 4.0), (3.0, 0.0))))
    assert (heights.tolist(), areas.tolist()) == ([0.0, 0.5, 2.0, 3.0], [1.0, 3.0, 4.0, 0.0])


@pytest.mark.parametrize(("orientation", "z", "low"), [(UPRIGHT, 0.25, -0.75), (UPSIDE_DOWN, 0.5, -0.5)])
def test_the_wet_axis_of_a_hull_either_way_up(orientation, z, low):
    """Gauss points of the submerged part, and the wet end."""
    shape = Fake(stations=((0.0, 2.0), (2.0, 2.0)), height=2.0)
    body = Body("buoy", np.arange(13), np.array([0.0, 0.0, z]), orientation, 1.0, np.eye(3))
    heights = np.sort(_WetAxis(body, Fake(shape=shape, mass=Fake(height=1.0))).points[:, 2])
    gauss = low / 2 * (1 + np.polynomial.legendre.leggauss(8)[0])
    np.testing.assert_allclose(heights, np.sort(np.append(gauss, low)), atol=1e-12)


def test_of_modes_of_one_name_the_slowest_is_shown(monkeypatch):
    modes = [Fake(kind="oscillates", name="cable in plane 1", shares={"x": 1.0}, period=T) for T in (9.0, 4.0)]
    monkeypatch.setattr(periods, "lowest_modes", lambda *_, **__: modes)
    monkeypatch.setattr(periods, "Moving", lambda _: None)
    assert periods._of_lines(Fake(lines=[1], bodies=[])) == {"cable in plane 1": 9.0}


def test_a_pull_below_the_centre_of_mass_rights():
    """T l in roll and pitch, where nothing of the force changes."""
    hold = Fake(body="buoy", lever=np.array([0.0, 0.0, -1.5]), force=np.array([0.0, 0.0, -8.0]), force_places=[0, 1, 2])
    every = Fake(bodies=[Fake(name="buoy")], stiffness=np.zeros((6, 6)), followers=np.zeros((3, 6)))
    assert np.diag(mooring_stiffness(Fake(holds=[hold]), every)).tolist() == [0.0, 0.0, 0.0, 12.0, 12.0, 0.0]


def test_where_a_line_is_kinked():
    places = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1.2, 0, 0.1]])
    line = LineNodes("cable", np.arange(4.0), places, None)
    problem = Fake(lines=True, smallest_tension=lambda **_: 1.0, typical_force=1.0)
    with pytest.raises(InputError, match=r"the cable is kinked at s = 2 m, where it turns by 173 degrees"):
        check_smooth(Fake(problem=problem, lines=[line]))


def test_half_waves_are_counted_in_both_directions():
    assert _changes_of_sign(np.array([0.0, 1.0, 0.01, -1.0, -0.5, 0.8]) * np.exp(0.7j)) == 2


# -- scenes ------------------------------------------------------------------------------------------------------------


def test_what_ends_are_called():
    line = CABLE | HELD
    assert load_scene({"cable": line}).network.ends_of(0) == ("the anchor", "the top")
    joint = [{"name": "bow", "position": [0.0, 0.0, -12.0]}]
    other = load_scene({"cable": CABLE | {"to": "bow"}, "joint": joint})
    assert other.network.ends_of(0) == ("the anchor", "bow")


def test_a_line_may_part_at_its_end():
    scene = load_scene({"cable": CABLE | HELD | {"fails_at": {"time": 1.0, "at": 20.0}}})
    assert scene.network.pieces[0].section.fails_at.at == 20.0
    with pytest.raises(InputError, match="must be on the cable"):
        load_scene({"cable": CABLE | HELD | {"fails_at": {"time": 1.0, "at": 20.1}}})


def test_a_line_from_fairlead_to_fairlead():
    buoy = FLOAT | {"fairleads": {"port": [0, 1, 1], "bow": [1, 0, 1]}}
    legs = [
        CABLE | {"name": "leg", "from": [0, 0, -30], "to": "buoy.bow"},
        CABLE | {"name": "loop", "from": "buoy.port"},
    ]
    assert load_scene({"sea": SEA, "buoy": buoy, "cable": [legs[0], legs[1] | {"to": "buoy.bow"}]}).network.pieces
    with pytest.raises(InputError, match="its ends must be two places"):
        load_scene({"sea": SEA, "buoy": buoy, "cable": [legs[0], legs[1] | {"to": "buoy.port"}]})


def test_what_a_study_keeps_of_a_scene():
    """Its own largest step, and its longest ramp."""
    time = {"end": 100.0, "step": 0.1, "scheme": "bdf2", "tolerance": 1e-3, "max_step": 2.0}
    moved = {"kind": "prescribed", "amplitude": [0, 0, 1], "period": 5.0, "position": [0, 0, -12.0]}
    cables = [CABLE | {"name": name, "top": moved | {"ramp": ramp}} for name, ramp in (("a", 1.0), ("b", 3.0))]
    scene = load_scene({"cable": cables, "time": time})
    assert settings.ramp_of(scene) == 3.0
    stepping = settings.Stepping("bdf2", 0.2, 1e-4, largest=5.0)
    assert settings.with_settings(scene, settings.space_of(scene), stepping).time.max_step == 2.0


@pytest.mark.parametrize(
    ("end", "step", "period", "interval"),
    [
        (400.0, 0.01, None, 2.0),  # 200 shapes of any run
        (600.0, 0.01, 24.0, 1.0),  # 24 of a period
        (600.0, 0.01, 6.0, 0.5),  # 1200 at most
        (10.0, 0.01, 24.0, 0.05),
        (10.0, 0.1, 24.0, 0.1),
    ],
)
def test_shapes_are_as_dense_as_a_replay_needs(end, step, period, interval):
    moved = {"kind": "prescribed", "amplitude": [0, 0, 1], "period": period, "position": [0, 0, -12.0]}
    time = {"end": end, "step": step, "scheme": "bdf2"}
    scene = load_scene({"cable": CABLE | (HELD if period is None else {"top": moved}), "time": time})
    assert settings.frame_interval(scene) == pytest.approx(interval)


def test_the_main_period_of_a_sea():
    scene = {"sea": SEA, "cable": CABLE | HELD}
    components = [[1.0, 9.0, 0.0, 0.0], [2.0, 5.0, 0.0, 0.0]]
    assert load_scene(scene | {"waves": {"components": components}}).waves.main_period == 5.0
    table = [[0.05, 0.0], [0.1, 1.0], [0.125, 4.0], [0.2, 0.5]]
    assert load_scene(scene | {"waves": {"spectrum": table}}).waves.main_period == 8.0
    record = [[t, math.sin(2 * math.pi * (t + 0.05) / 8)] for t in np.arange(0, 40, 0.1).tolist()]
    assert load_scene(scene | {"waves": {"elevation": record}}).waves.main_period == pytest.approx(8.0, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "section"),
    [("wind", {"speed_10m": 9.0, "area": 2.0, "height": 1.0}), ("external_force", {"force": [1.0, 0.0, 0.0]})],
)
def test_what_acts_on_one_buoy_says_on_which(name, section):
    buoys = [FLOAT | {"name": "east"}, FLOAT | {"name": "west"}]
    with pytest.raises(InputError, match=f"{name} = .*belongs to one buoy, and there are several"):
        load_scene({"sea": SEA, "buoy": buoys, name: section})


def test_how_fast_an_end_may_swing():
    """2 pi a/T."""
    top = {"kind": "prescribed", "amplitude": [0, 0, 200.0], "position": [0, 0, -12.0]}
    assert Top(**top, period=1.3)
    with pytest.raises(InputError, match="must not be faster than 1000 m/s"):
        load_scene({"cable": CABLE | {"top": top | {"period": 1.2}}})


def test_a_table_of_a_current_is_scaled_to_its_speed_at_the_surface():
    current = {"profile": [[-30.0, 0.5], [0.0, 2.0]]}
    found = loaded(load_scene({"sea": SEA, "cable": CABLE | HELD, "current": current}), "current", 3.0, 30.0)
    assert (found.current.profile, found.current.direction_deg) == ([(-30.0, 0.75), (0.0, 3.0)], 30.0)
