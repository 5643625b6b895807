"""Parts of models, each alone: order of unknowns, structure, time-dependent data, histories.

Source: the same orders and numbers by hand; analytic derivatives of splines.
"""

import gc
import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI
from scipy.interpolate import CubicSpline

from dolfbuoy import load_scene
from dolfbuoy.model import airy, layout, prescribed_ends, problem, varying
from dolfbuoy.model.bodies import Landing
from dolfbuoy.model.interface import Evolution, Model
from dolfbuoy.model.lines import Lines
from dolfbuoy.model.parting import Parting
from dolfbuoy.model.problem import COLLECTED, Problem  # before conftest.py makes the number larger
from dolfbuoy.model.sea import elevation_at, highest_water, strongest, velocity_at
from dolfbuoy.model.structure import structure_of
from dolfbuoy.model.winch import Winch
from dolfbuoy.scene import Top

ROPE = {"length": 20.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 2}
FLOAT = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
HELD = {"top": {"kind": "fixed", "position": [15.0, 0.0, 0.0]}}

# -- order of unknowns -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pieces", "turns", "backwards", "joints"),
    [
        (["fixed buoy"], [0], [False], {}),
        (["buoy fixed"], [0], [True], {}),
        (["Y buoy"], [0], [True], {"Y": 0.5}),
        (["Y Z"], [0], [False], {"Y": 0.5, "Z": 0.5}),
        (["fixed Y", "fixed Y", "Y fixed"], [0, 1, 2], [False] * 3, {"Y": 1.5}),
        (["Y Z", "fixed Y", "Z fixed"], [1, 0, 2], [False] * 3, {"Y": 0.5, "Z": 1.5}),
        (["Y buoy", "Y fixed", "Y fixed"], [2, 0, 1], [False, True, True], {"Y": 1.5}),
        (["buoy buoy", "Y buoy", "fixed Y"], [2, 1, 0], [False, False, False], {"Y": 0.5}),
    ],
)
def test_the_order_of_pieces(pieces, turns, backwards, joints):
    """From ends that need no unknown; a joint goes when one of its pieces is left."""
    kinds = {"fixed": "fixed", "buoy": "buoy"}
    ends = [[Fake(kind=kinds.get(name, "joint"), name=name) for name in piece.split()] for piece in pieces]
    found = layout.order_of_pieces([Fake(ends=pair) for pair in ends])
    assert (found[0].tolist(), found[1].tolist(), found[2]) == (turns, backwards, joints)


def order_of(scene):
    """Names of the unknowns of lines in their order: piece, what and where, r and m of a node once."""
    lines = Lines(MPI.COMM_SELF, load_scene(scene), dynamic=False)
    names, middles = {}, lines.cell_ends.mean(axis=1) - lines.begins[lines.line_of_cell]
    for kind, dofs in (("r", lines.node_dofs), ("m", lines.moment_dofs)):
        for row, s, k in zip(dofs if dofs is not None else (), lines.node_s, lines.line_of_node, strict=False):
            names |= dict.fromkeys(row.tolist(), f"{k}{kind}{s - lines.begins[k]:g}")
    for kind, dofs in (("T", lines.T_dofs[:, 0]), ("e", lines.mean_dofs)):
        for dof, s, k in zip(dofs if dofs is not None else (), middles, lines.line_of_cell, strict=False):
            names[int(dof)] = f"{k}{kind}{s:g}"
    order, keys = lines.elimination_order()
    assert np.all(np.diff(keys[-1]) >= 0)
    return " ".join(dict.fromkeys(names[dof] for dof in order.tolist()))


@pytest.mark.parametrize(
    ("scene", "order"),
    [
        ({"cable": ROPE | HELD}, "0r10 0T5 0T15"),
        ({"cable": ROPE | {"top": {"kind": "free"}}}, "0r10 0T5 0r20 0T15"),
        ({"cable": ROPE | HELD | {"strain": "element-average"}}, "0r10 0T5 0e5 0T15 0e15"),
        ({"cable": ROPE | HELD | {"bending_stiffness": 9.0}}, "0m10 0r10 0T5 0T15"),
        ({"cable": ROPE | {"from": "buoy", "to": [15.0, 0, 0]}, "buoy": FLOAT}, "0r10 0T15 0r0 0T5"),
        (
            {"cable": [ROPE | {"name": n, "from": [x, 0, 0], "to": "Y"} for n, x in (("a", 0.0), ("b", 9.0))]}
            | {"joint": [{"name": "Y"}]},
            "0r10 0T5 0r20 1r20 0T15 1r10 1T5 1T15",  # the tension next to the joint waits for it
        ),
    ],
)
def test_a_tension_follows_the_places_that_it_constrains(scene, order):
    assert order_of(scene) == order


def test_pieces_lie_apart():
    """By a tenth of the longest, within which a place belongs to the one before."""
    begins = layout.laid_out([Fake(length=x) for x in (10.0, 20.0, 5.0)])
    assert begins.tolist() == [0.0, 12.0, 34.0]
    found = layout.Pieces.line_at(Fake(begins=begins, slip=1e-3), np.array([0, 10, 11.998, 11.9995, 12, 33.9, 34, 39]))
    assert found.tolist() == [0, 0, 0, 1, 1, 1, 2, 2]
    assert [x.tolist() for x in layout._grouped(np.array([2, 0, 2, 1]), 4)] == [[1], [3], [0, 2], []]
    values, wanted = np.array([5.0, 1.0, 3.0]), np.array([[1.0, 3.0005], [2.9985, 9.0]])
    assert layout.Layout._found(Fake(slip=1e-3), values, wanted).tolist() == [[1, 2], [-1, -1]]


def test_tension_where_two_elements_meet_is_the_larger():
    lines = Fake(cell_ends=np.array([[0, 2], [2, 4], [10, 13.0]]), begins=np.array([0.0, 10.0]))
    lines.line_of_cell, lines.mean_tension = np.array([0, 0, 1]), lambda u: np.array([5.0, 7.0, 9.0])
    problem = Fake(lines=lines, system=Fake(u=None), comm=MPI.COMM_SELF)
    found = [Problem.tension_at(problem, s, line) for s, line in ((0, 0), (1.9, 0), (2, 0), (4, 0), (0, 1), (3, 1))]
    assert found == [5.0, 5.0, 7.0, 7.0, 9.0, 9.0]
    assert Problem.tension_at(problem, 4.1) == -math.inf


@pytest.mark.parametrize(
    ("at", "cell"),
    [(0.0, 0), (1e-12, 0), (0.5, 0), (0.6, 1), (1.0, 1), (1.1, 2), (1.7, 3), (3.0, 5), (3.6, 7), (9.0, 7), (None, 7)],
)
def test_the_element_at_a_length(at, cell):
    """Of three pieces in elements of 0.5 m, which lie apart on the mesh; between two the one before."""
    lines = Fake(sections=[Fake(length=x) for x in (1.0, 2.0, 1.0)], begins=np.array([0.0, 1.2, 3.4]))
    lines.line_of_cell = np.array([0, 0, 1, 1, 1, 1, 2, 2])
    low = np.array([0.0, 0.5, 1.2, 1.7, 2.2, 2.7, 3.4, 3.9])
    lines.cell_ends = np.column_stack([low, low + 0.5])
    assert np.flatnonzero(Parting._at(Fake(lines=lines), [0, 1, 2], at)).tolist() == [cell]


@pytest.mark.parametrize(("t", "parts"), [(1.999, False), (2.0, True), (2.0 * (1 - 0.5e-12), True), (3.0, True)])
def test_when_a_line_parts(t, parts):
    """At its time, or in the first step behind it, and once."""
    lines = Fake(line_of_cell=np.array([0, 0, 1]), comm=MPI.COMM_SELF)
    model = Fake(lines=lines, parted=Fake(x=Fake(array=np.zeros(3))), memory={"parted_at": np.zeros(3)})
    model._dofs, model._at = np.array([2, 0, 1]), lambda pieces, at: np.array([False, True, False])
    rule = Fake(tension=None, at=5.0, time=2.0)
    assert Parting._part(model, [0], rule, None, t) == parts
    assert model.parted.x.array.tolist() == ([1.0, 0, 0] if parts else [0.0] * 3)
    assert model.memory["parted_at"].tolist() == ([t, 0, 0] if parts else [0.0] * 3)
    if parts:
        assert not Parting._part(model, [0], rule, None, t + 1)


def test_what_holds_a_model_at_rest():
    model = Fake(relaxation=Fake(value=0.0), reference=Fake(x=Fake(array=np.zeros(2))), part=Fake(slice=slice(1, 3)))
    Model.hold(model, np.array([7.0, 8.0, 9.0]), 0.5)
    assert (model.relaxation.value, model.reference.x.array.tolist()) == (4.0, [8.0, 9.0])
    Model.let_go(model)
    assert model.relaxation.value == 0.0
    model.relaxation = None
    Model.hold(model, np.array([1.0, 2.0, 3.0]), 0.5)
    Model.let_go(model)
    assert model.reference.x.array.tolist() == [8.0, 9.0]


def test_a_rule_is_handed_to_its_derivative():
    rates = [(Fake(value=0.0), Fake(x=Fake(array=np.zeros(2)))) for _ in range(2)]
    one = Evolution(Fake(slice=slice(1, 3), size=2), rates, False, [])
    one.hand_out(1, 3.0, np.array([4.0, 5.0]))
    assert [(gamma.value, history.x.array.tolist()) for gamma, history in rates] == [(0, [0, 0]), (3, [4, 5])]
    assert (one.order, one.size, one.values(np.arange(4.0)).tolist()) == (2, 2, [1.0, 2.0])


def test_problems_that_go_are_collected_together(monkeypatch):
    looked = []
    monkeypatch.setattr(gc, "collect", lambda: looked.append(Problem.destroyed))
    monkeypatch.setattr(problem, "COLLECTED", COLLECTED)
    monkeypatch.setattr(Problem, "destroyed", 2 * COLLECTED - 2)
    one = Fake(newton=Fake(destroy=lambda: None))
    for _ in range(COLLECTED + 1):
        Problem.destroy(one)
    assert looked == [2 * COLLECTED]
    monkeypatch.setattr(gc, "isenabled", lambda: False)
    Problem.destroy(one)
    assert looked == [2 * COLLECTED]
    assert Problem.destroyed == 3 * COLLECTED


def test_lengths_of_a_winch():
    lines = Fake(cells_of=[np.array([0, 2])])
    ends = np.array([[1.0, 0, 0, 3.5, 0, 0], [0.0, 0, 0, 50.0, 0, 0], [4.0, 0, 0, 4.25, 0, 0]])
    assert Winch.length_of(Fake(lines=lines, _now=ends), 0) == 2.75


def test_pressure_of_a_body_on_the_bed():
    for gap, pressure in ((-0.25, 20.0), (0.25, 0.0)):
        model = Fake(names=["a", "b"], part=Fake(slice=slice(None)), bodies=["A", "B"])
        bed = Fake(model=model, at=lambda u: u, gap=lambda x: x, parameters_of=lambda body: Fake(stiffness=80.0))
        assert Landing.pressure(bed, "b", np.array([9.0, gap])) == pressure


# -- structure ---------------------------------------------------------------------------------------------------------

FULL = {
    "sea": {"depth": 30.0},
    "waves": {"amplitude": 0.5, "period": 5.0},
    "current": {"profile": [[-30.0, 0.1], [0.0, 0.6]]},
    "seabed": {"slope": [0.1, 0.0]},
    "cable": [
        ROPE | {"name": "a", "from": [0, 0, -30], "to": "Y", "diameter": 0.03, "normal_drag": 1.2},
        ROPE | {"name": "b", "from": [9, 0, -30], "to": "Y", "diameter": 0.03, "normal_drag": 1.2},
        ROPE | {"name": "c", "from": "Y", "to": "buoy.bow", "diameter": 0.03, "normal_drag": 1.2},
    ],
    "joint": [{"name": "Y", "mass": 20.0}],
    "buoy": FLOAT | {"fairleads": {"bow": [0.0, 0.0, 0.1], "stern": [0.0, 0.1, 0.0]}},
    "external_force": {"force": [5.0, 0.0, 0.0], "height": 1.0},
}


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({"waves.amplitude": 0.7, "sea.depth": 31.0, "gravity": 9.7, "buoy.mass": 310.0}, True),
        ({"current.profile": [[-30.0, 0.2], [0.0, 0.5]], "joint": [{"name": "Y", "mass": 21.0}]}, True),
        ({"seabed.slope": [0.2, 0.1], "external_force.force": [1.0, 2.0, 3.0]}, True),
        ({"current.profile": [[-30.0, 0.2], [-9.0, 0.3], [0.0, 0.5]]}, False),
        ({"current.profile": "uniform", "current.speed": 1.0}, False),
        ({"current.profile": None, "current.grid": [[0, -30, 1, 0], [0, 0, 1, 0]]}, False),
        ({"sea.tide": [[0, 0], [60, 1]]}, False),
        ({"waves.stretching": "none"}, False),
        ({"waves": None}, False),
        ({"waves.spectrum": "jonswap", "waves.significant_height": 1.0, "waves.peak_period": 5.0,
          "waves.amplitude": None, "waves.period": None}, False),
        ({"seabed": None}, False),
        ({"seabed.friction": 0.3}, False),
        ({"solver.step_tolerance": 3e-9}, False),
        ({"cable.a.length": 21.0}, False),
        ({"cable.a.elements": 3}, False),
        ({"cable.a.damping": 5.0}, False),
        ({"cable.a.line_density": 3.0}, False),  # a constant of the forms becomes a number of each element
        ({"cable.c.to": "buoy.stern"}, False),
        ({"cable.c.to": "buoy"}, False),
        ({"joint": [{"name": "Y"}]}, False),
        ({"buoy.hull": [[0, 2], [1.7, 2]]}, False),
        ({"external_force.height": None}, False),
        ({"buoy.added_mass": 0.5}, False),
        ({"wind": {"speed_10m": 8.0, "area": 1.0, "height": 2.0}}, False),
    ],
)  # fmt: skip
def test_what_is_structure(change, same):
    assert (structure_of(load_scene(FULL, **change)) == structure_of(load_scene(FULL))) == same


def test_forms_are_those_of_other_meshes():
    """Not those of other ends: held in a direction, by a spring, or pulled."""
    base = {"cable": ROPE | HELD | {"bending_stiffness": 9.0}}
    found = [structure_of(load_scene(base, cable__elements=n, cable__grading=g), False) for n, g in ((2, 1), (3, 2))]
    assert found[0] == found[1]
    directed = {"direction": [1, 0, 0]}
    ends = [None, directed, directed | {"rotational_stiffness": 9.0}]
    kinds = [structure_of(load_scene(base, cable__to_end=end), False) for end in ends]
    free = [{"kind": "free"}, {"kind": "free", "force": [0, 0, 9.0]}]
    kinds += [structure_of(load_scene(base, cable__top=top), False) for top in free]
    assert len(set(map(repr, kinds))) == 5


# -- what is given over time -------------------------------------------------------------------------------------------


def test_a_tow_grows_with_its_ramp():
    """The integral of (1 - cos(pi t/4))/2, then of 1."""
    path = prescribed_ends.motion_of(Top(kind="prescribed", position=[1, 2, 3], velocity=[10.0, 0, -1.0], ramp=4.0))
    for t, way in ((0.0, 0.0), (2.0, 1 - 2 / math.pi), (4.0, 2.0), (6.0, 4.0)):
        assert path(t) == pytest.approx([1 + 10 * way, 2, 3 - way])


def test_rows_that_stay_overshoot_nothing():
    assert prescribed_ends.overshoot([[0, 1, 2, 3], [5, 1, 2, 3], [9, 1, 2, 3]]) == 0.0


def test_a_direction_that_turns_and_damps():
    """beta times its rate, from one side at the start; each of length 1 but for that."""
    rows = np.array([[0, 0, 0.2, 1], [1, 0.5, 0, 2], [2, 1.5, 0.1, 1.0]])
    path = CubicSpline(rows[:, 0], rows[:, 1:], bc_type="clamped")
    clamp = Fake(motion=rows.tolist(), ramp=0.0)
    plain, damped = prescribed_ends.direction_of(clamp), prescribed_ends.direction_of(clamp, 0.3)
    for t in (0.7, 1.4):
        w, slope = path(t), path(t, 1)
        n = w / np.linalg.norm(w)
        np.testing.assert_allclose(plain(t), n, rtol=1e-13)
        rate = (slope - (slope @ n) * n) / np.linalg.norm(w)
        np.testing.assert_allclose(damped(t), n + 0.3 * rate, rtol=1e-6)
    h = prescribed_ends.INSTANT
    np.testing.assert_allclose(damped(0.0), plain(0.0) + 0.3 * (plain(h) - plain(0.0)) / h, rtol=1e-12)
    assert prescribed_ends.direction_of(Fake(motion=None)) is None


def test_scenes_without_what_moves_them():
    own = {"wind": {"speed_10m": 8.0, "area": 1.0, "height": 2.0}, "external_force": {"force": [5.0, 0, 0]}}
    buoys = [FLOAT | {"name": "a", "initial": {"buoy_position": [0, 0, 1.0]}}, FLOAT | {"name": "b"} | own]
    scene = load_scene({"sea": {"depth": 30.0}, "current": {"speed": 1.0}, "buoy": buoys})
    still, rest = prescribed_ends.adrift_nowhere(scene), prescribed_ends.from_rest(scene)
    assert still.current is None
    assert [(b.wind, b.external_force, b.initial is None) for b in still.buoys] == [
        (None, None, False),
        (None, None, True),
    ]
    assert [(b.wind is None, b.initial) for b in rest.buoys] == [(True, None), (False, None)]
    assert rest.current == scene.current


def test_a_grid_of_a_current_beyond_its_rows():
    rows = [[t, z, t + z, t * z] for t in (2.0, 4.0, 8.0) for z in (-5.0, -1.0)]
    grid = varying.Grid(rows[::-1])
    assert grid.z.tolist() == [-5.0, -1.0]
    for t, at in ((0.0, 2.0), (2.0, 2.0), (3.0, 3.0), (5.0, 5.0), (8.0, 8.0), (99.0, 8.0)):
        np.testing.assert_allclose(grid(t), [[at - 5, -5 * at, 0], [at - 1, -at, 0]], rtol=1e-14)
    assert varying.Grid(rows[:2])(77.0).tolist() == [[-3.0, -10.0, 0.0], [1.0, -2.0, 0.0]]


def test_a_wind_that_calms_and_turns():
    """Where it is calm it has the direction of its section; gusts may not turn it round."""
    scene = {"sea": {"depth": 30.0}, "buoy": FLOAT, "waves": {"amplitude": 0.1, "period": 5.0}}
    wind = {"speed_10m": 8.0, "area": 1.0, "height": 2.0, "direction_deg": 90.0}
    found = load_scene(scene | {"wind": wind | {"over_time": [[0, 1, 0], [1, 0, 0], [2, 2, 90.0]]}})
    at = varying.wind_over_time(found.network.buoys["buoy"].wind, None)
    for t, speed, direction in (
        (0.0, 8.0, [0, 1, 0]),
        (1.0, 0.0, [0, 1, 0]),
        (1.5, 8.0, [-1, 0, 0]),
        (9.0, 16.0, [-1, 0, 0]),
    ):
        assert at(t)[0] == pytest.approx(speed)
        np.testing.assert_allclose(at(t)[1], direction, atol=1e-14)
    gusty = (
        load_scene(scene | {"wind": wind | {"gusts": "kaimal", "turbulence": 0.9, "ramp": 0.0}})
        .network.buoys["buoy"]
        .wind
    )
    blows, gusts = varying.wind_over_time(gusty, 3), varying.Gusts(gusty, 3)
    speeds = np.array([blows(t)[0] for t in range(300)])
    np.testing.assert_allclose(speeds, [max(8.0 + gusts(t), 0.0) for t in range(300)])
    assert speeds.min() == 0.0
    assert varying.wind_over_time(gusty, None)(5.0)[0] == 8.0
    calm = varying.Gusts(gusty.model_copy(update={"speed_10m": 0.0}), 3)
    assert (calm(7.0), calm.deviation) == (0.0, 0.0)
    seeds = [
        varying.seed_of(Fake(waves=w), Fake(seed=s)) for w, s in ((Fake(seed=5), 0), (Fake(seed=5), None), (None, None))
    ]
    assert seeds == [0, 5, 0]


def test_water_of_a_scene_at_points():
    scene = load_scene({"sea": {"depth": 30.0, "tide": [[0, 0], [100, 2.0]]}, "buoy": FLOAT})
    points = np.array([[0.0, 0, -1.0], [3.0, 4, -9.0]])
    np.testing.assert_allclose(elevation_at(scene, 100.0, points), [2.0, 2.0], rtol=1e-14)
    assert velocity_at(scene, 100.0, points).tolist() == [[0.0] * 3] * 2
    assert strongest(scene).tolist() == [0.0] * 3
    assert highest_water(scene) == pytest.approx(2.0, rel=1e-14)
    moving = load_scene(scene, current={"profile": [[-30.0, 0.5], [-20.0, 3.0], [0.0, 1.0]], "direction_deg": 90.0})
    np.testing.assert_allclose(velocity_at(moving, 100.0, [[0.0, 0, -18.0]]), [[0, 3.0, 0]], atol=1e-14)
    assert strongest(moving)[1] == pytest.approx(3.0, abs=0.1)
    assert varying.range_of_tide(load_scene({"sea": {"depth": 30.0}, "buoy": FLOAT})) == (0.0, 0.0)


# -- waves, and what is remembered -------------------------------------------------------------------------------------


def test_what_is_remembered(monkeypatch):
    """Of the very same sections, and as many as were used last."""
    monkeypatch.setattr(airy, "_KNOWN", type(airy._KNOWN)(maxlen=3))
    made, things = [], [[k] for k in range(4)]

    def get(*sections):
        return airy.remembered(lambda: made.append(sections) or len(made), *sections)

    assert [get(things[0], "a"), get(things[0]), get(list(things[0]), "a"), get(things[0], "a")] == [1, 2, 3, 1]
    assert len(airy._KNOWN) == 3
    assert (get(things[1]), get(things[0], "a"), get(things[0])) == (4, 1, 5)  # what had waited longest has gone


def test_components_cannot_be_changed():
    waves = load_scene({"sea": {"depth": 30.0}, "buoy": FLOAT, "waves": {"amplitude": 0.1, "period": 5.0}}).waves
    for array in vars(airy.components_of(waves)).values():
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_phases_at_other_times():
    scene = load_scene(
        {"sea": {"depth": 30.0}, "buoy": FLOAT, "waves": {"amplitude": 0.1, "period": 5.0, "phase_deg": 90}}
    )
    waves = airy.AirySum.of(scene)
    for t in (1.0, 1.0, 2.5, 0.0, 12.5):
        phase = waves.time_phase(t)[0]
        assert 0 <= phase < 2 * math.pi
        assert math.remainder(phase - math.pi / 2 + 2 * math.pi * t / 5, 2 * math.pi) == pytest.approx(0, abs=1e-12)
