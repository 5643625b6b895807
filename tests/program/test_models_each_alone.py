"""More parts of models, each alone: springs at ends, groups of lines, devices, winches, vessels, packing.

Source: the same numbers by hand.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import ufl
from dolfinx import fem
from helpers import REFERENCE
from scipy.interpolate import CubicSpline

from dolfbuoy import InputError, load_scene
from dolfbuoy.coupling import saved
from dolfbuoy.coupling.paths import Path
from dolfbuoy.model import airy, moments, sea, surfacing, varying, winch
from dolfbuoy.model.attachment import Clamp
from dolfbuoy.model.buoy import Buoy
from dolfbuoy.model.drift import Drift, transfer
from dolfbuoy.model.effect import Drawn
from dolfbuoy.model.grounding import Seabed
from dolfbuoy.model.interface import Model
from dolfbuoy.model.line_groups import LineGroups, _Growths
from dolfbuoy.model.lines import Lines
from dolfbuoy.model.memory_fit import ENOUGH, Kernel, States, fitted
from dolfbuoy.model.numbers import Numbers
from dolfbuoy.model.problem import Problem
from dolfbuoy.model.structure import structure_of
from dolfbuoy.model.take_off import TakeOff
from dolfbuoy.solver import compat

FLOAT = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}


@pytest.mark.parametrize(("end", "sign"), [(0, -1), (1, 1)])
def test_torque_of_a_line_on_what_holds_it(end, sign):
    """m x t_b at s = L, and the other way at s = 0; a spring of 4 N m/rad lets 3 N m turn t_b by asin(0.6)."""
    u = np.array([9.0, 0, 0, 1, 3, 0, 0, 9])
    clamp = Fake(slice=slice(1, 7), end=end, _spring_of_body=None)
    assert Clamp.torque_of(clamp, u).tolist() == [0, -3 * sign, 0]
    clamp._spring_of_body = Fake(value=4.0)
    np.testing.assert_allclose(Clamp.torque_of(clamp, u), [0, -2.4 * sign, 0], atol=1e-14)


# -- lines -------------------------------------------------------------------------------------------------------------


def test_the_smallest_stretch():
    """1 + T/EA of the least tension in an element that may turn, of means where these have the strain."""
    mesh = compat.interval_mesh(compat.MPI.COMM_SELF, [0.0, 1.0, 2.0, 3.0])
    number = fem.Function(compat.function_space(mesh, compat.element(mesh, "DG", 0)))
    places = compat.cell_dofs(number.function_space)[:, 0]
    number.x.array[places] = [10.0, 20.0, 5.0]
    lines = Fake(part=Fake(slice=slice(2, 8)), T_dofs=np.arange(6).reshape(3, 2), mean_dofs=None)
    lines.turnable, lines.line_of_cell = np.array([True, False]), np.array([0, 0, 1])
    lines._in_cells = lambda given: Lines._in_cells(lines, given)
    u = np.array([9.0, 9, -2, -5, -4, -8, -99, -99])
    for EA, compliance, least in (
        (number, None, 0.5),
        (compat.constant(mesh, 16.0), None, 0.5),
        (None, compat.constant(mesh, 0.5), -3.0),
    ):
        lines.cable = Fake(EA=EA, compliance=compliance)
        assert Lines.smallest_stretch(lines, u) == least
    number.x.array[places] = [0.25, 0.5, 7.0]
    lines.cable, lines.mean_dofs = Fake(EA=None, compliance=number), np.array([1, 2, 0])
    assert Lines.smallest_stretch(lines, u) == 1 + min(-5 * 0.25, -4 * 0.5)
    lines.turnable[:] = False
    assert Lines.smallest_stretch(lines, u) == 1.0


def test_places_of_groups_of_lines():
    first = Fake(part=Fake(offset=0), force_dofs=lambda: np.array([1, 2]), end_moments=lambda k, i: np.array([k, i]))
    second = Fake(part=Fake(offset=10), force_dofs=lambda: np.array([3]), end_moments=lambda k, i: np.array([k, i]))
    model = Fake(groups=[first, second], holder=lambda piece: (second, piece - 4))
    assert LineGroups.force_dofs(model).tolist() == [1, 2, 13]
    assert LineGroups.end_moments(model, 6, 1).tolist() == [12, 11]
    changed = []
    for group in model.groups:
        group.change = changed.append
    scene = Fake(network="new")
    LineGroups.change(model, scene)
    assert (changed, model.network) == ([scene, scene], "new")


def test_growth_of_groups_of_lines():
    growths = [Fake(growth=Fake(factors=np.ones((n, 2)))) for n in (2, 0, 3)]
    model, values = _Growths(growths), np.arange(10.0).reshape(5, 2)
    model.factors = values
    assert [growth.factors.tolist() for growth in model.groups] == [values[:2].tolist(), [], values[2:].tolist()]
    assert model.factors.tolist() == values.tolist()


def test_what_a_model_has_of_its_own_accord():
    found = Model.places(Fake()), Model.force_dofs(Fake())
    assert [(x.shape, x.dtype.kind) for x in found] == [((0,), "f"), ((0,), "i")]
    assert Model.when_accepted(Fake(), None, None) == []


def test_the_first_buoy_of_a_rank():
    assert Problem.buoy.fget(Fake(buoys={"a": 1, "b": 2})) == 1
    assert Problem.buoy.fget(Fake(buoys={})) is None


# -- devices -----------------------------------------------------------------------------------------------------------


def test_what_a_take_off_notes():
    """Length, tension and power, where its ends move apart; nothing is infinite where they meet."""
    law = Fake(damping=30.0, quadratic_damping=20.0, friction=40.0, friction_speed=0.05, at_rest=lambda x: (7 * x, 0.0))
    ends = [Fake(slice=slice(1, 4)), Fake(slice=slice(5, 8))]
    speeds = [np.array([0.0, 0, 0]), np.array([0.0, 1.0, -0.5])]
    device = Fake(ends=ends, velocities=lambda u: speeds, section=law, numbers=np.zeros(3))
    TakeOff.note(device, np.array([9.0, 1, 0, 0, 9, 1, 3, 4]))
    absorbed = 30 * 0.2 + 20 * 0.2 * 0.2 + 40 * 0.2 / math.hypot(0.2, 0.05)
    np.testing.assert_allclose(device.numbers, [5.0, 35.0 + absorbed, absorbed * 0.2], rtol=1e-12)
    TakeOff.note(device, np.array([9.0, 1, 0, 0, 9, 1, 0, 0]))
    np.testing.assert_allclose(device.numbers, [1e-12, 0, 0], atol=1e-11)


def test_places_and_energies_of_a_take_off():
    found = Fake(ends=[Fake(buoy=True, dofs=lambda: Fake(force=np.array([3, 4, 5]))), Fake(buoy=None)])
    found.holders = [Fake(held=False), Fake(held=True)]
    found.ends[0].slice, found.ends[1].slice = slice(0, 6), slice(6, 9)
    assert TakeOff.force_dofs(found).tolist() == [3, 4, 5]
    assert TakeOff.free(found).tolist() == [0, 1, 2, 3, 4, 5]
    ((number, reaction),) = TakeOff.reactions(found, np.arange(10.0))
    assert (number, reaction.tolist()) == (1, [6, 7, 8])
    spring = Fake(take_off_energy=lambda c, s: ufl.as_ufl(c * 10.0), account="elastic")
    damper = Fake(take_off_energy=None, account="take_off")
    model = Fake(stretch=lambda: Fake(rate=ufl.as_ufl(0.5)), one=2.0, dx="dx", _terms=[(spring, 3.0), (damper, 4.0)])
    model.tensions = lambda s: [(spring, ufl.as_ufl(100.0)), (damper, ufl.as_ufl(8.0))]
    assert [(account, float(value), dx) for account, value, dx in TakeOff.energies(model)] == [
        ("elastic", 60.0, "dx"),
        ("take_off", -8.0, "dx"),
    ]


def test_rates_of_winches(monkeypatch):
    """Of each length's own, in the elements that it has; nothing elsewhere."""
    moved = []
    monkeypatch.setattr(winch.compat, "move_vertices", lambda mesh, now: moved.append((mesh, now)))
    monkeypatch.setattr(winch.compat, "cell_dofs", lambda _: np.array([[2], [0], [1]]))
    model = object.__new__(winch.Winch)
    model.lines = Fake(mesh="mesh", cells_of=[np.array([0]), np.array([1, 2])], sections=[Fake(winch=None)] * 2)
    model.driven, model._now, model._rate = {1: lambda t: 3.0 + 2.0 * t}, "now", None
    model.publish(1.0)
    model._rate = Fake(x=Fake(array=np.full(3, 7.0)), function_space=None)
    model.publish(1.0)
    assert moved == [("mesh", "now")] * 2
    np.testing.assert_allclose(model._rate.x.array, [0.4, 0.4, 0.0], rtol=1e-9)


# -- vessels, wind and waves -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rise", "given"), [(0.4, 0.4), (-2.0, 0.0), (None, 0.0)])
def test_the_highest_place_of_an_end_on_a_vessel(monkeypatch, rise, given):
    """At rest, lifted by the waves, and by the rows of a motion that goes up."""
    monkeypatch.setattr(surfacing, "Riding", Fake)
    monkeypatch.setattr(surfacing, "rider_of", lambda top: Fake(rise=lambda own: 0.25 if own == "bow" else 9.0))
    rows = None if rise is None else [[0.0, 5, 5, 0.1 * rise, 5, 5, 5], [9.0, 5, 5, rise, 5, 5, 5]]
    top = Fake(position=[1.0, 0.0, -3.0], vessel=Fake(motion=rows), own="bow")
    assert surfacing._highest(None, top) == pytest.approx(-2.75 + given)


def test_the_force_of_a_wind_that_is_given():
    wind = {
        "speed_10m": 8.0,
        "area": 2.0,
        "height": 1.0,
        "direction_deg": 90.0,
        "drag_coefficient": 1.5,
        "air_density": 1.2,
    }
    w = load_scene({"sea": {"depth": 9.0}, "buoy": FLOAT, "wind": wind}).network.buoys["buoy"].wind
    size = 0.5 * 1.5 * 1.2 * 2.0 * 64.0
    np.testing.assert_allclose(sea.wind_at(w, 10.0), [0, size, 0], atol=1e-12)
    np.testing.assert_allclose(sea.wind_at(w, 10.0, (4.0, np.array([1.0, 0, 0]))), [size / 4, 0, 0], atol=1e-12)


def test_components_of_one_length_keep_their_order():
    rows = [[0.01 * (k + 1), 6.0, float(7 * k % 360), 0.0] for k in range(60)]
    scene = load_scene({"sea": {"depth": 30.0}, "buoy": FLOAT, "waves": {"components": rows}})
    assert airy.AirySum.of(scene).amplitude.tolist() == [row[0] for row in rows]


def test_slow_drift_of_pairs_of_waves():
    """Newman's mean of both, without strips of their own; along the way that each of them runs."""
    zero, whole = np.zeros((4, 2), complex), np.array([3.0, 5.0])
    left = zero.copy()
    left[3] = 1.0
    pairs = transfer(Drift(whole, left, zero), np.array([1.0, 0.6]), np.array([0.0, 0.8]))
    force = [[(a[:, 0].conj() @ b[:, 1:]).real.tolist() for b in pairs] for a in pairs]
    np.testing.assert_allclose(force, [[[3, 0], [3, 4]], [[3, 0], [3, 4]]])


def test_memory_of_one_motion():
    """Of two states, by which the damping was made; with K(0) = 0."""
    rate = np.array([-0.5 + 1.5j])
    out = rate[None, :] * 1j  # Re(out/rate) = 0
    made = States(rate, np.ones((1, 1), complex), out, 2, 0.0, 0.0, 0.0)
    omega = np.linspace(0.05, 12.0, 120)
    K = made.at(omega)
    if K.real.max() < -K.real.min():
        K = -K
    found = fitted(omega, np.maximum(K.real, 0.0), K.imag / omega[:, None, None], 2)
    assert found.order == 2
    assert found.error < ENOUGH
    np.testing.assert_allclose(found.at(omega)[:, 0, 0], K[:, 0, 0], atol=2 * ENOUGH * abs(K).max())


# -- small things ------------------------------------------------------------------------------------------------------


def test_what_is_drawn_is_drawn_in_the_logarithm():
    assert Drawn(1.0, 2.0) == (1.0, 2.0, False, False)


@pytest.mark.parametrize("content", ["AAAA!AAAAAAA=", "AAAAAAAA"])
def test_bytes_that_are_no_numbers(content):
    with pytest.raises(ValueError, match=r"base64|multiple|size|buffer"):
        saved._tree({"array": content, "dtype": "<f8", "shape": [1]})


def test_a_state_of_another_version_is_refused():
    """Also where what another thing has is known."""
    known = {"a": Path(0.0, [1.0]), "b": Path(0.0, [2.0])}
    session = Fake(scene=Fake(to_toml=lambda: "scene"), paths=known)
    own = {"_series": (0.0, 1.0, 2), "_required": {"c": (np.ones(3), np.zeros(3))}, "_targets": {}, "loads": 0.0}
    own |= {"functions": {}, "paths": {name: dict(vars(path)) for name, path in known.items()}}
    whole = saved.Saved(1, {"x": np.arange(3)}, 5, own, None)
    found = saved.unpack(session, saved.pack(session, whole))
    assert (found.session, found.assembled, found.mark, found.state["x"].tolist()) == (id(session), -1, None, [0, 1, 2])
    assert (found.own["_series"], found.own["_required"]["c"].force.tolist()) == ((0.0, 1.0, 2), [1, 1, 1])
    own["paths"]["b"]["other"] = own["paths"]["b"].pop("before")
    with pytest.raises(InputError, match="one of another version"):
        saved.unpack(session, saved.pack(session, whole))
    del own["loads"]
    with pytest.raises(InputError, match="not those of a packed state"):
        saved.unpack(session, saved.pack(session, whole))
    with pytest.raises(InputError, match="writes a record"):
        saved.pack(session, whole._replace(mark={}))


def test_kinks_of_tables_are_structure():
    """How many there are on either side."""
    line = {"length": 20.0, "line_density": 2.0, "elements": 2, "top": {"kind": "fixed", "position": [15.0, 0, 0]}}
    rows = {
        "above": [[0, 0], [0.01, 1e3], [0.02, 1.5e3]],
        "other": [[0, 0], [0.02, 1e3], [0.03, 1.4e3]],
        "below": [[-0.02, -1.5e3], [-0.01, -1e3], [0, 0]],
        "both": [[-0.02, -1.5e3], [-0.01, -1e3], [0, 0], [0.01, 1e3], [0.02, 1.5e3]],
        "more": [[0, 0], [0.01, 1e3], [0.02, 1.5e3], [0.03, 3e3]],
    }
    found = {
        name: structure_of(load_scene({"cable": line | {"axial_stiffness": table}})) for name, table in rows.items()
    }
    assert found["above"] == found["other"]
    assert len({repr(found[name]) for name in ("above", "below", "both", "more")}) == 4


def test_moments_of_plain_lines_only():
    """The correction of moments knows neither what damps nor what is wound."""
    kinds = [(damping, wound) for damping in (None, 1.0) for wound in (None, 1.0)]
    found = [moments._is_plain(Fake(bending_damping=damping, winch=wound)) for damping, wound in kinds]
    assert found == [True, False, False, False]


def test_spectra_of_gusts():
    """ISO 19901-1 at 10 m and IEC 61400-1 by their formulas, and where the components are."""
    f = np.array([0.0, 0.02])
    npd = 320 * 4.0 / (1 + np.array([0.0, 172 * 0.02 * 2**-0.75]) ** 0.468) ** (5 / (3 * 0.468))
    np.testing.assert_allclose(varying.npd_spectrum(f, 20.0), npd, rtol=1e-12)
    time = 8.1 * 7.0 / 20.0
    kaimal = 4 * time * (0.15 * 20) ** 2 / (1 + 6 * f * time) ** (5 / 3)
    np.testing.assert_allclose(varying.kaimal_spectrum(f, 20.0, 0.15), kaimal, rtol=1e-12)
    wind = {"speed_10m": 20.0, "area": 2.0, "height": 1.0, "gusts": "npd"}
    w = load_scene({"sea": {"depth": 9.0}, "buoy": FLOAT, "wind": wind}).network.buoys["buoy"].wind
    f = varying.Gusts(w, 3).frequency / (2 * np.pi)
    edges = (1 / 600) * 300 ** (np.arange(201) / 200)
    assert np.all((edges[:-1] <= f * (1 + 1e-12)) & (f <= edges[1:] * (1 + 1e-12)))


def test_a_current_that_stops():
    turning = {"speed": 2.0, "direction_deg": 90.0, "over_time": [[0, 1, 0], [1, 0, 0], [2, 1, 90.0]]}
    at = varying.velocity_over_time(load_scene({"sea": {"depth": 9.0}, "buoy": FLOAT, "current": turning}).current)
    for t, velocity in ((0.0, [0, 2, 0]), (0.5, [0, 1, 0]), (1.0, [0, 0, 0]), (1.5, [-1, 0, 0]), (9.0, [-2, 0, 0])):
        np.testing.assert_allclose(at(t), velocity, atol=1e-14)


def test_a_tide_begins_at_once():
    rows = [[0.0, 1.0], [10.0, 3.0], [20.0, 2.0]]
    level = varying.tide_of(load_scene({"sea": {"depth": 9.0, "tide": rows}, "buoy": FLOAT}))
    path = CubicSpline(*np.transpose(rows), bc_type="clamped")
    for t in (0.0, 0.25, 0.9, 15.0, 20.0):
        assert level(t) == pytest.approx(path(t) - 1.0, abs=1e-14)
    assert level(99.0) == pytest.approx(1.0)


def test_a_long_series_of_the_surface_is_that_of_its_instants():
    """Of so many components and times that not all are summed at once; at one point, and at one for each."""
    rows = [[0.01, 4.0 + 0.1 * k, 7.0 * k, 5.0 * k] for k in range(60)]
    waves = airy.AirySum.of(load_scene({"sea": {"depth": 30.0}, "buoy": FLOAT, "waves": {"components": rows}}))
    times = np.linspace(0.0, 900.0, 40_000)
    points = np.column_stack([times / 10, -times / 30])
    fixed, moving = waves.over_time(times, np.array([3.0, -4.0, -9.0])), waves.over_time(times, points)
    for k in (0, 1, 16_667, 20_000, 39_999):
        assert fixed[k] == pytest.approx(waves.elevation(times[k], np.array([3.0, -4.0])), abs=1e-12)
        assert moving[k] == pytest.approx(waves.elevation(times[k], points[k]), abs=1e-12)


def test_damping_beyond_the_highest_frequency():
    """As it falls there, by the last tenth of the frequencies; 0 at 0, where it begins flat."""
    omega = np.linspace(0.1, 10.0, 100)
    B = np.minimum(omega, omega**-5.0)[:, None, None]
    kernel = Kernel(omega, 4.0 * B, 0 * B)
    assert (kernel.fall, kernel.scale[0], kernel.peak) == pytest.approx((5.0, 2.0, 1.0))
    ends = kernel.damping(np.array([0.0, 10.0, 20.0]))[:, 0, 0]
    np.testing.assert_allclose(ends, [0.0, 1e-5, 1e-5 / 32], rtol=1e-9, atol=1e-18)
    assert kernel.damping(np.array([1e-3]))[0, 0, 0] < 1e-4
    assert Kernel(omega, 0.5 + 0 * B, 0 * B).fall == 2.0


def test_who_looks_for_what_lies():
    """One rank over a plane in C; else all together."""
    asked = []
    bed = Fake(ground=None, model=Fake(comm=Fake(size=2)), _sound=lambda *given: asked.append(given))
    Seabed.lying(bed, "u", "out", 3)()
    bed.ground, bed.model.comm.size = "depths", 1
    Seabed.lying(bed, "v", "row", 4)()
    assert asked == [("u", "out", 3), ("v", "row", 4)]


# -- another scene -----------------------------------------------------------------------------------------------------


def test_numbers_of_another_scene():
    """On each element those of its section; one constant where all sections have the same."""
    mesh = compat.interval_mesh(compat.MPI.COMM_SELF, [0.0, 1.0, 2.0, 3.0])
    scenes = [
        Fake(x=x, parts=[Fake(a=a, b=7.0 * x) for a in pair]) for x, pair in ((1.0, (2.0, 3.0)), (5.0, (4.0, 6.0)))
    ]
    numbers = Numbers(mesh, scenes[0], lambda scene: scene.parts, np.array([1, 0, 1]))
    a, b = numbers.per_cell(lambda part: part.a), numbers.per_cell(lambda part: part.b)
    x = numbers.constant(lambda scene, part: scene.x + part.a)
    places = compat.cell_dofs(a.function_space)[:, 0]
    assert (a.x.array[places].tolist(), float(b.value), float(x.value)) == ([3, 2, 3], 7.0, 3.0)
    numbers.change(scenes[1])
    assert (a.x.array[places].tolist(), float(b.value), float(x.value)) == ([6, 4, 6], 35.0, 9.0)
    assert (numbers.scene, numbers.sections) == (scenes[1], scenes[1].parts)


def test_a_buoy_takes_the_numbers_of_another_scene():
    """Its memory of waves and the forces of those that come are those of a buoy that is made for it."""
    hull = {"hull": [[0.0, 2.0], [1.6, 2.0]], "mass": 2576.1, "center_of_mass": 0.6, "inertia": [1500.0, 1300.0]}
    hull |= {"potential_flow": str(REFERENCE / "truncated_cylinder.nc"), "drift": "newman", "memory_order": 2}
    scene = {"sea": {"depth": 20.0}, "waves": {"amplitude": 0.15, "period": 3.0, "direction_deg": 30.0}, "buoy": hull}
    scene |= {"wind": {"speed_10m": 8.0, "area": 1.0, "height": 2.0}, "time": {"end": 1.0, "step": 0.1}}
    other = {"waves.direction_deg": 70.0, "buoy.center_of_mass": 0.5, "buoy.inertia": [1400.0, 1300.0]}
    first, second = load_scene(scene), load_scene(scene, **other)
    used, fresh, before = Buoy(first, "buoy", True), Buoy(second, "buoy", True), Buoy(first, "buoy", True)
    used.change(second)

    def told(buoy):
        yield from (buoy.memory_of_waves._modes[name] for name in ("rate", "into", "out"))
        for force in buoy.of_components:
            yield from force._kept[:3]
        yield buoy.slow_drift._whole
        yield from (number.value for number in (buoy.M, buoy.center, buoy.inertia, buoy.gravity, buoy.offset))

    changed = 0
    for one, new, old in zip(told(used), told(fresh), told(before), strict=True):
        np.testing.assert_array_equal(one, new)
        changed += not np.array_equal(new, old)
    assert changed > 8
    assert (used.section, used.mass) == (second.network.buoys["buoy"], fresh.mass)
