"""Numbers and warnings of `check`: each function alone on made-up states, at its thresholds and on both sides of them.

Source: hand calculations with the scales of beams, strings, springs and waves in deep water.
"""

import cmath
import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from dynamics_helpers import MOORED
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.check import accuracy, bending, buoys, lines
from dolfbuoy.check.report import Report
from dolfbuoy.meshes import HullShape
from dolfbuoy.model.rigid import MassProperties
from dolfbuoy.model.sea import wavenumber
from dolfbuoy.scene.stiffness import TensionTable

LINE = {"length": 20.0, "line_density": 5.0, "diameter": 0.1, "axial_stiffness": 1e5, "elements": 4}
SEA = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 7.0, "components": 40}
HULL = HullShape(((0.0, 2.0), (2.0, 2.0)))


class Ranks:
    """A communicator of one rank that reports how ranks' numbers would be combined."""

    rank, size = 0, 1

    def __init__(self):
        self.ways = []

    def allreduce(self, value, op=MPI.SUM):
        self.ways.append(op)
        return value


def between(low, high, **more):
    """A line held at both ends, in 40 m of water of 1000 kg/m^3."""
    cable = LINE | {"from": low, "to": high} | more
    return load_scene({"gravity": 10.0, "sea": {"depth": 40.0, "density": 1000.0}, "cable": cable})


def upright(**more):
    """A cylinder of 1 m radius and 2 m height, of 1000 kg."""
    given = {"section": Fake(wave_damping=None, potential_flow=None, axial_drag=2.0, axial_added_mass=0.5)} | more
    return buoys.Upright(
        "", given.pop("section"), HULL, MassProperties(1000.0, 0.8, (9.0, 9.0, 9.0)), 1000.0, 10.0, **given
    )


# -- what a run costs and how right it is ------------------------------------------------------------------------------


def test_seconds_of_a_step():
    """30 us, plus 30 us per buoy, 1 us per degree of an element, 0.3 us per wave component."""
    rows = [[0.2, 3.0, 0.0, 0.0], [0.5, 6.0, 0.0, 0.0]]
    high = {"cable.position_degree": 2, "cable.tension_degree": 1}
    for scene, seconds in (
        (load_scene(MOORED), 30 + 30 + 20),
        (load_scene(MOORED, **high), 30 + 30 + 40),
        (load_scene(MOORED | {"waves": SEA}), 30 + 30 + 20 + 12),
        (load_scene(MOORED | {"waves": {"components": rows}}), 30 + 30 + 20 + 0.6),
    ):
        assert accuracy.seconds_of_step(scene) == pytest.approx(1e-6 * seconds, rel=1e-12)
        assert accuracy.seconds_of(scene) == pytest.approx(1e-6 * seconds * 200, rel=1e-12)
    assert accuracy.seconds_of(load_scene(MOORED, time=None)) == 0.0


@pytest.mark.parametrize(("step", "known"), [(0.02, "0.78 to 13 %"), (0.1, "3.8 % or more, or not known")])
def test_the_error_bar_to_expect(step, known):
    """Of backward Euler and of the fastest motion that a buoy follows; slower ones than an eighth do not count."""
    report = Report([], periods={"one, heave": 2.0, "pitch": 5.0 / 8 * 0.99, "cable, transverse 1": 0.1, "wave": 5.0})
    accuracy.expected(load_scene(MOORED, time__step=step), report)
    (name, bar, unit, said), (cost, seconds, _, steps) = report.numbers
    x = 1j * 2 * math.pi / 2.0 * step
    expected = 100 * abs(cmath.log(1 / (1 - x)) / x - 1)
    assert (name, unit, cost) == ("error bar to expect of largest values", "%", "time of a run with 1 %")
    assert bar == pytest.approx(expected, rel=1e-12)
    assert said == f"{known}, step against one heave, 2 s; more where lines snap tight"
    each, step = 80e-6, math.sqrt(0.03) / math.pi  # of BDF2, (omega step)^2/3 = 1 %
    assert seconds == pytest.approx(2.0 / step * each, rel=1e-12)
    assert steps.startswith(
        f"{1.0 / step * each:.2g} to {4.0 / step * each:.2g} s, BDF2 with steps of {step / 2:.2g} to "
    )
    nothing = Report([], periods={"cable, transverse 1": 0.1})
    accuracy.expected(load_scene(MOORED), nothing)
    assert nothing.numbers == []


# -- lines that bend ---------------------------------------------------------------------------------------------------


def test_lengths_and_moments_at_clamps(monkeypatch):
    """Of an end that is clamped behind one that is not: sqrt(EI/T), 2 sqrt(EI T) sin(angle/2), and elements there."""
    section = Fake(bending_stiffness=4000.0, length=100.0, elements=2, grading=3.0, position_degree=2)
    clamp = Fake(unit=(1.0, 0.0, 0.0), rotational_stiffness=None)
    ends = [Fake(clamp=None), Fake(kind="fixed", clamp=clamp)]
    pieces = [Fake(section=section, ends=ends, cable=k) for k in range(3)]
    pieces[0].section = Fake(bending_stiffness=0.0)
    pieces[1].ends = [Fake(kind="fixed", clamp=clamp)] * 2  # of which the lower one is slack
    force = 1000.0 * np.array([math.cos(0.5), 0.0, math.sin(0.5)])
    network = Fake(pieces=pieces, name_of="abc".__getitem__, cables=list("abc"))
    problem = Fake(network=network, typical_force=1e4, end_force=lambda k, i: force * (1.0 if i else 1e-9))
    solved = Fake(note=lambda: None, values=np.full((3, 2), 7.0), utilisation=[0.0, 0.5, 1.001])
    monkeypatch.setattr(bending, "Bending", lambda _: solved)
    report = Report([])
    bending.bent_at_rest(problem, report)
    moment, said = 2 * math.sqrt(4e6) * math.sin(0.25), "of a taut line at 28.6 deg; computed 7"
    assert report.numbers == [
        *(
            row
            for name in "bc"
            for row in (
                (f"{name}: bending length sqrt(EI/T)", 2.0, "m", "at the upper end, whose element has 75 m"),
                (f"{name}: moment at the upper end", pytest.approx(moment, rel=1e-12), "N m", said),
            )
        ),
        (
            "largest bending stiffness EI",
            4000.0,
            "N m^2",
            "not in the model: torsion, so no loops, and contact of a line with itself",
        ),
        ("b: equilibrium: curvature times minimum_bend_radius", 0.5, "", ""),
        ("c: equilibrium: curvature times minimum_bend_radius", 1.001, "", ""),
    ]
    _, first, second = report.warnings
    assert first.startswith("c: The element at the upper end (75 m) is too long for the bending length 2 m: ")
    assert "with elements of 2 m, by" in first
    assert second == "c: The equilibrium is bent more sharply than minimum_bend_radius allows."
    ends[1].clamp = Fake(unit=(1.0, 0.0, 0.0), rotational_stiffness=5.0)
    report = Report([])
    bending.bent_at_rest(problem, report)
    assert [name for name, *_ in report.numbers if "moment" in name] == ["b: moment at the upper end"]
    for clamp, found in ((Fake(unit=(0.0, 0.6, 0.8)), [0.0, 0.6, 0.8]), (None, [0.0, 0.0, 0.0])):
        ends[1].clamp = clamp
        assert bending.direction_there(problem, 2, 1).tolist() == found


# -- buoys -------------------------------------------------------------------------------------------------------------


def test_a_buoy_under_water_is_righted_by_its_buoyancy():
    """Over the weight, about the point that holds it down."""
    volume = 2 * math.pi
    spare = 10 * (1000 * volume - 1000)
    held = upright(how="on its taut cable", height=0.3)
    assert held.spare == pytest.approx(spare, rel=1e-12)
    for pull, how, drowned in (
        (spare, "x", True),
        (spare * (1 - 0.9e-9), "x", True),
        (spare * 0.9999, "x", False),
        (spare, "", False),
    ):
        assert upright(how=how, pull=pull).drowned == drowned
    assert pytest.approx(volume * (1.0 - 0.3) - (0.8 - 0.3), rel=1e-12) == upright(how="x", pull=spare, height=0.3).GM
    draft = 1 / math.pi
    assert pytest.approx(draft / 2 + math.pi / 4 / 1.0 - 0.8, rel=1e-9) == upright().GM


def test_a_buoy_of_bars_hides_none_that_follow(monkeypatch):
    monkeypatch.setattr(buoys, "shape_of", lambda section: section)
    monkeypatch.setattr(buoys, "mass_properties", lambda section: "mass")
    network = Fake(buoys={"a": 1, "b": 2, "c": 3}, bars_of=lambda name: [0] if name == "b" else [])
    scene = Fake(network=network, sea=Fake(density=1000.0), gravity=0.0)
    assert [(one.name, one.section) for one in buoys.buoys_of(scene)] == [("a", 1), ("c", 3)]
    assert buoys.buoys_of(Fake(network=network, sea=None)) == []


@pytest.mark.parametrize(("away", "said"), [(0.0499, False), (0.0501, True)])
def test_where_buoys_rest(away, said):
    """From the anchor, and within a twentieth of a wave of a prescribed crest."""
    sea = SEA | {"crest": 2.0, "crest_time": 1.0}
    scene = load_scene(MOORED | {"waves": sea})
    length = 2 * math.pi / wavenumber(scene)
    scene = load_scene(scene, **{"waves.crest_position": [3.0, 4.0 + away * length]})
    buoy = Fake(fields=Fake(of=lambda _: Fake(position=(3.0, 4.0, -1.5))), part=Fake(slice=slice(None)))
    problem = Fake(network=scene.network, scene=scene, comm=MPI.COMM_SELF, system=Fake(u=np.zeros(1)))
    problem.buoy_ranks, problem.buoys, report = {"buoy": 0}, {"buoy": buoy}, Report([])
    buoys.buoys_at_rest(problem, report)
    assert report.numbers == [
        ("equilibrium: offset of C from the anchor", 5.0, "m", ""),
        ("equilibrium: C above still water", -1.5, "m", ""),
    ]
    there = f"is {away * length:.3g} m from where the buoy rests; waves.crest_position = [3, 4] has it there."
    assert [sentence.partition("] ")[2] for sentence in report.warnings] == [there] * said


# -- lines -------------------------------------------------------------------------------------------------------------


def test_a_line_is_stretched_beyond_what_it_is_known_for():
    table = TensionTable([[0.0, 0.0], [0.1, 1e3], [0.2, 5e3]])
    assert [lines._stretched(pull, 1e5, " of a") for pull in (0.0, 5e4)] == ["", ""]
    said = "The equilibrium of a is stretched by 50 %: look at axial_stiffness and length."
    assert lines._stretched(5.0001e4, 1e5, " of a") == said
    assert lines._stretched(5e3, table, "") == ""
    said = "The equilibrium has 5.001 kN, beyond the 5 kN of the last row of axial_stiffness."
    assert lines._stretched(5001.0, table, "") == said


@pytest.mark.parametrize(("rise", "said"), [(0.0199, False), (0.0201, True), (1.0, True)])
def test_a_light_line_rises_above_its_ends(rise, said):
    """By more than a thousandth of its length, above the upper end, here its first."""
    scene, z = between([0, 0, -2.0], [9.0, 0, -12.0]), [-2.0, -2.0 + rise, -3.0, -12.0]
    dofs, u = np.arange(12).reshape(4, 3), np.zeros(12)
    u[dofs[:, 2]] = z
    light = Fake(line_of_node=np.zeros(4, int), end_dofs=[[dofs[0], dofs[3]]], node_dofs=dofs)
    problem = Fake(network=scene.network, scene=scene, lines=light, system=Fake(u=u), comm=Ranks())
    report = Report([])
    lines._rising(problem, report, 0)
    assert problem.comm.ways == [MPI.MAX, MPI.MAX]
    weight = 10 * 20 * (1000 * math.pi / 4 * 0.01 - 5)
    floats = f"The cable is lighter than water, by {weight:.4g} N: it floats up, {rise:.3g} m above its ends."
    assert report.warnings == [floats] * said
    problem.scene = problem.network = None
    heavy = between([0, 0, -2.0], [9.0, 0, -12.0], line_density=50.0)
    problem.scene, problem.network, report = heavy, heavy.network, Report([])
    lines._rising(problem, report, 0)
    assert report.warnings == []


@pytest.mark.parametrize(
    ("lowest", "weight", "length", "said"),
    [
        (-20.5, 1.0, 22.0, "At rest the cable hangs up to 0.5 m below the sea bed: there is no [seabed] to carry it."),
        (-20.0, 1.0, 22.0, "The cable is 2 m longer than the water is deep: without load it hangs below its anchor."),
        (-20.0, -1.0, 22.0, None),
        (-20.0, 1.0, 20.0, None),
        (-20.0 - 1e-5, 1.0, 20.0, None),
        (
            -20.0 - 3e-5,
            1.0,
            20.0,
            "At rest the cable hangs up to 3e-05 m below the sea bed: there is no [seabed] to carry it.",
        ),
    ],
)
def test_a_line_that_hangs_below_where_the_bed_would_be(lowest, weight, length, said):
    scene, report = load_scene(MOORED, cable__length=length), Report([])
    dofs, u = np.arange(9).reshape(3, 3), np.zeros(9)
    u[dofs[:, 2]] = [-19.0, lowest, 0.0]
    hung = Fake(node_dofs=dofs, line_of_node=np.zeros(3, int), weight_of=lambda k: weight)
    problem = Fake(network=scene.network, lines=hung, system=Fake(u=u), comm=Ranks())
    lines._hanging(problem, report, 0, 20.0)
    assert problem.comm.ways == [MPI.MAX]
    assert report.warnings == ([said] if said else [])


@pytest.mark.parametrize(
    ("bed", "grown", "tension", "travel"),
    [
        (None, None, 100.0, 2 * 10 * math.sqrt((50 + 15 * math.pi / 4) / 100)),
        (True, None, 100.0, 10 * math.sqrt((50 + 15 * math.pi / 4) / 100)),
        (None, [2.0, 3.0], 100.0, 2 * 10 * math.sqrt((3 * 50 + 4 * 15 * math.pi / 4) / 100)),
        (None, None, 0.0101, 2 * 10 * math.sqrt((50 + 15 * math.pi / 4) / 0.0101)),
        (None, None, 0.0099, None),
    ],
)
def test_periods_of_a_taut_line_across(bed, grown, tension, travel):
    """T_n = 2/n int sqrt(m/T) ds of the free part, with its added mass; a slack line has none."""
    scene = between([0, 0, -30.0], [9.0, 0, -20.0], line_density=50.0, added_mass=1.5)
    growth = None if grown is None else Fake(factors=np.array([grown, grown]))
    taut = Fake(
        line_of_cell=np.zeros(2, int), bed=bed, growth=growth, begins=[100.0], grounded=lambda u, k: Fake(s=5.0)
    )
    taut.cell_ends, taut.mean_tension = np.array([[100.0, 110.0], [110.0, 120.0]]), lambda u: np.full(2, tension)
    problem = Fake(scene=scene, comm=Ranks(), typical_force=100.0, system=Fake(u=None))
    problem.lines = Fake(holder=lambda k: (taut, k))
    report = Report([])
    lines._transverse(problem, report, lines.Line("", [0], scene.network.pieces[0].section, 20.0))
    assert problem.comm.ways == [MPI.SUM, MPI.MIN]
    expected = {} if travel is None else {f"cable, transverse {n} (taut, fixed ends)": 2 * travel / n for n in (1, 2)}
    assert report.periods == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("degree", "h", "length", "rows", "said"),
    [
        (1, 2.8, 50.0, 1, None),
        (1, 2.81, 50.0, 1, "tensions may be more than 1 % wrong; take 2.8 m there, of equal length elements = 18."),
        (2, 4.5, 50.0, 1, None),
        (3, 4.51, 50.0, 1, "tensions may be more than 1 % wrong; take 4.5 m there, of equal length elements = 12."),
        (1, 2.0, 14001.0, 0, "are right to the weight of an element there, which is 2 m long."),
        (1, 2.0, 13999.0, 1, None),
    ],
)
def test_elements_where_a_line_touches_down(degree, h, length, rows, said):
    """0.28 of the radius of curvature there, 0.45 for higher degrees; at most 5000 elements."""
    ends = np.array([[100.0, 100.0 + h], [100.0 + h, 100.0 + h + 9.0], [0.0, 99.0]])
    touching = Fake(cell_ends=ends, begins=[0.0, 100.0], line_of_cell=np.array([1, 1, 0]))
    section = Fake(elements=8, position_degree=degree, axial_stiffness=1e6, length=length)
    problem = Fake(lines=touching, comm=Ranks(), network=Fake(pieces=[None, Fake(section=section)]))
    report = Report([])
    lines._touchdown_elements(problem, report, 1, h / 2, 10.0)
    assert problem.comm.ways == [MPI.MAX]
    assert len(report.numbers) == rows
    assert [sentence[-len(said or "") :] for sentence in report.warnings] == ([said] if said else [])
    for name, number, unit, _ in report.numbers:
        assert (name, number, unit) == ("equilibrium: elements at the touchdown", pytest.approx(h, rel=1e-12), "m")
    section.elements, section.axial_stiffness = 1, math.inf
    lines._touchdown_elements(problem, report, 1, h / 2, 10.0)
    assert len(report.numbers) == rows * (1 if degree == 1 else 2)  # of degree 1 it is a bar


def test_materials_make_parts_of_a_cable():
    part = {"length": 10.0, "elements": 2}
    segments = [part, part | {"length": 7.0}, part | {"line_density": 9.0}]
    cable = {"line_density": 5.0, "diameter": 0.1, "axial_stiffness": 1e5, "from": [0, 0, 0], "to": [9.0, 0, 0]}
    network = load_scene({"cable": cable | {"segments": segments}}).network
    assert [(one.name, one.pieces, one.length) for one in lines.lines_of(network)] == [
        ("cable.0", [0, 1], 17.0),
        ("cable.2", [2], 10.0),
    ]
    network = load_scene({"cable": cable | {"segments": segments[:2]}}).network
    assert [(one.name, one.pieces, one.length) for one in lines.lines_of(network)] == [("", [0, 1], 17.0)]


@pytest.mark.parametrize(
    ("dry", "may", "rows", "said"),
    [
        (True, ["a"], [("a", 4.0), ("b", 2.0)], []),  # of b it is so, whatever it may
        (True, [], [("a", 4.0), ("b", 2.0)], []),
        (False, ["a"], [], ["4 m of a are above the water, ", "2 m of b are above the water, "]),
    ],
)
def test_what_is_out_of_the_water(monkeypatch, dry, may, rows, said):
    """For elements crossing the surface the part above it, for a line lying in it nothing."""
    ends = [{"name": "a", "from": [0, 0, -9.0], "to": [9, 0, 0]}, {"name": "b", "from": [0, 0, -9.0], "to": [-9, 0, 0]}]
    sea = {"sea": {"depth": 40.0}}
    scene = load_scene(sea | {"cable": [{**LINE, **end} for end in ends]})
    z = np.array([-1.0, 3.0, 1.0, 0.0, 0.0, -2.0, 2.0, -5.0])  # 3/4 of 4 m and 1 m of a; half of 4 m of b
    u = np.zeros(24)
    u[2::3] = z
    cells = np.array([[0, 1], [2, 3], [3, 4], [5, 6], [5, 7]])
    monkeypatch.setattr(lines, "compat", Fake(cell_dofs=lambda positions: np.column_stack([cells, cells[:, :1]])))
    monkeypatch.setattr(lines, "surfacing", lambda scene: may)
    monkeypatch.setattr(lines, "called_by", lambda scene, where: ["wet"] * (dry and where == "line_wet"))
    group = Fake(positions=None, part=Fake(slice=slice(None)), node_dofs=np.arange(24).reshape(8, 3))
    group.pieces, group.line_of_cell = [Fake(cable=0), Fake(cable=1)], np.array([0, 0, 0, 1, 1])
    group.cell_ends = np.array([[0.0, 4.0], [4.0, 5.0], [5.0, 9.0], [0.0, 4.0], [4.0, 7.0]])
    problem, report = Fake(network=scene.network, scene=scene, lines=Fake(groups=[group])), Report([])
    problem.system, problem.comm = Fake(u=u), Ranks()
    lines._above_water(problem, report)
    assert problem.comm.ways == [MPI.SUM]
    above = "dry there, in waves above their surface"
    assert report.numbers == [(f"equilibrium: length above the water of {name}", x, "m", above) for name, x in rows]
    assert [sentence[: len(start)] for sentence, start in zip(report.warnings, said, strict=True)] == said


def test_a_bar_of_a_buoy_is_no_line_and_hides_none():
    """It has no length to stretch, so that neither weights nor periods of it are told."""
    hull = {"hull": [[0, 2], [2, 2]], "mass": 500.0, "fairleads": {"a": [0, 0, 0], "b": [1.0, 0, 0]}}
    bar = LINE | {"name": "bar", "from": "buoy.a", "to": "buoy.b", "length": 1.0, "elements": 1}
    rope = LINE | {"name": "rope", "from": [0, 0, -20.0], "to": "buoy.a"}
    scene = load_scene({"gravity": 10.0, "sea": {"depth": 20.0}, "buoy": hull, "cable": [bar, rope]})
    report = Report([])
    lines.of_lines(scene, scene.network, report)
    slowness = math.sqrt(5.0 / 1e5)
    weight = 10 * (5 - 1025 * math.pi / 4 * 0.01)
    assert report.numbers == [
        ("rope: cable weight in water per metre", pytest.approx(weight, rel=1e-12), "N/m", ""),
        ("rope: cable weight in water", pytest.approx(20 * weight, rel=1e-12), "N", ""),
        ("rope: explicit step limit of Eq. (24)", pytest.approx(5 / math.sqrt(12) * slowness, rel=1e-12), "s", "C = 1"),
        ("rope: cable internal damping", 0.0, "N s", "none"),
    ]
    assert report.periods == {"rope, first axial (fixed ends)": pytest.approx(40 * slowness, rel=1e-12)}


@pytest.mark.parametrize(
    ("step", "damping", "said"),
    [(0.028, 0.0, 1), (0.0281, 0.0, 2), (1.0, 3.0, 0)],
)
def test_a_snap_of_a_rope(step, damping, said):
    """An end stopped from v is pulled by sqrt(EA m) v until the wave returns; a tenth of that time shows its peak."""
    scene = between([0, 0, -30.0], [9.0, 0, -20.0], slack="tension-only", damping=damping)
    scene = load_scene(scene, time={"end": 1.0, "step": step})
    report = Report([])
    lines._snaps(scene, scene.network.pieces[0].section, 20.0, report)
    travel = 40 * math.sqrt(5.0 / 1e5)  # 0.283 s
    assert report.numbers == [
        ("cable internal damping", damping, "N s", f"c/EA = {damping / 1e5:.4g} s" if damping else "none"),
        (
            "pull of a snap at a held end per m/s",
            pytest.approx(math.sqrt(5e5), rel=1e-12),
            "N",
            f"without damping, for {travel:.3g} s at most",
        ),
    ]
    assert len(report.warnings) == said
