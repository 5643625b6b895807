"""Every number `check` prints: weights, drafts, metacentres, periods, waves, step limits, numerical damping.

Source: closed forms of a floating cylinder, a hanging cable and a linear wave, programmed again here.
"""

import math

import numpy as np
import pytest
from alone import solve_static
from scipy.integrate import quad
from scipy.optimize import brentq

from dolfbuoy import InputError, load_scene
from dolfbuoy.check import check, derived
from dolfbuoy.linear.periods import buoy_periods
from dolfbuoy.model.prescribed_ends import motion_of
from dolfbuoy.model.rigid import float_upright, mass_properties, shape_of
from dolfbuoy.results.summary import remaining_amplitude
from dolfbuoy.results.tables import newtons

RHO, G, DEPTH = 1019.0, 9.7, 24.0
CABLE = {
    "length": 30.0,
    "line_density": 31.0,
    "diameter": 0.09,
    "axial_stiffness": 4e6,
    "elements": 12,
    "added_mass": 0.7,
}
BUOY = {
    "hull": [[0.0, 2.2], [2.4, 2.2]],
    "mass": 1900.0,
    "center_of_mass": 0.7,
    "inertia": [1400.0, 700.0],
    "point_masses": [{"mass": 210.0, "height": 1.6}],
    "mooring_height": 0.35,
    "added_mass": 0.4,
    "axial_added_mass": 0.9,
    "normal_drag": 0.8,
}
MOORED = {
    "gravity": G,
    "sea": {"depth": DEPTH, "density": RHO},
    "cable": CABLE | {"anchor": [3.0, -2.0, -DEPTH], "normal_drag": 0.8},
    "buoy": BUOY,
    "current": {"speed": 0.6, "direction_deg": 40.0},
    "external_force": {"force": [2500.0, 900.0, 0.0]},
}
WEIGHT = (31.0 - RHO * math.pi * 0.09**2 / 4) * G  # of the cable in water [N/m]

MASS, RADIUS = 2110.0, 1.1
CENTER = (1900 * 0.7 + 210 * 1.6) / MASS
TRANSVERSE = 1400 + 1900 * (0.7 - CENTER) ** 2 + 210 * (1.6 - CENTER) ** 2
PLANE = math.pi * RADIUS**2


def numbers_of(scene):
    """(numbers by name, report)."""
    report = check(load_scene(scene))
    return {name: value for name, value, *_ in report.numbers}, report


@pytest.fixture(scope="module")
def moored():
    return numbers_of(MOORED)


def floating(load, pull=0.0):
    """(draft, KB, GM) of the cylinder that displaces `load` [kg] under the pull of its cable [N]."""
    draft = load / (RHO * PLANE)
    KB, BM = draft / 2, RADIUS**2 / (4 * draft)
    return draft, KB, (load * (KB + BM) - MASS * CENTER - pull / G * 0.35) / MASS


def test_cable(moored):
    numbers, report = moored
    assert numbers["cable weight in water per metre"] == pytest.approx(WEIGHT)
    assert numbers["cable weight in water"] == pytest.approx(30 * WEIGHT)
    wave_speed = math.sqrt(4e6 / 31)
    assert report.periods["cable, first axial (fixed ends)"] == pytest.approx(2 * 30 / wave_speed)
    assert numbers["explicit step limit of Eq. (24)"] == pytest.approx(2.5 / wave_speed / (2 * math.sqrt(3)))


def test_explicit_limit_is_that_of_the_shortest_element():
    """Of segments, in air; an inextensible cable has none."""
    scene = {"gravity": G, "cable": {k: v for k, v in CABLE.items() if k != "diameter"} | {"top": {"kind": "free"}}}
    scene["initial"] = {"kind": "straight"}
    scene["cable"] |= {"top": {"kind": "fixed", "position": [20.0, 0.0, 22.0]}, "elements": [[10.0, 8], [20.0, 4]]}
    numbers, report = numbers_of(scene)
    assert numbers["explicit step limit of Eq. (24)"] == pytest.approx(1.25 / math.sqrt(12 * 4e6 / 31))
    limit = "explicit step limit of Eq. (24)"
    assert ("s", "C = 1") in [row[2:] for row in report.numbers if row[0] == limit]
    _, report = numbers_of(scene | {"cable": scene["cable"] | {"position_degree": 2, "tension_degree": 1}})
    assert ("s", "C = 1; for P1, smaller for higher degrees") in [row[2:] for row in report.numbers if row[0] == limit]
    assert numbers["cable weight in air"] == pytest.approx(30 * 31 * G)
    scene["cable"] |= {"axial_stiffness": math.inf}
    scene["initial"] = {"kind": "polyline", "points": [[0, 0, 0], [20.0, 0.0, 22.0]]}
    scene["cable"]["length"], scene["cable"]["elements"] = math.hypot(20, 22), 8
    assert numbers_of(scene)[0]["explicit step limit of Eq. (24)"] == 0


def test_floating(moored):
    """The suspended length is that between bed and buoy, plus half of the remainder."""
    numbers, _ = moored
    pull = WEIGHT * (30 + DEPTH) / 2
    assert numbers["buoy mass with point masses"] == pytest.approx(MASS)
    assert numbers["centre of mass C above keel"] == pytest.approx(CENTER)
    draft, _, GM = floating(MASS)
    assert (numbers["draft, free"], numbers["GM, free"]) == pytest.approx((draft, GM))
    draft, _, GM = floating(MASS + pull / G, pull)
    assert numbers["draft with the weight of the cable"] == pytest.approx(draft)
    assert numbers["GM with the weight of the cable"] == pytest.approx(GM)


def test_floating_on_a_chain_that_lies():
    """On a bed the buoy carries only the suspended part; the equilibrium in still water agrees."""
    scene = {key: value for key, value in MOORED.items() if key not in ("current", "external_force")}
    scene |= {"seabed": {}, "cable": CABLE | {"length": 36.0, "elements": 72}}
    numbers, _ = numbers_of(scene)
    assert numbers["draft with the weight of the cable"] == pytest.approx(floating(MASS + WEIGHT * DEPTH / G)[0])
    rest = solve_static(scene)
    draft = CENTER - float(rest.buoy_position[2])
    assert numbers["draft with the weight of the cable"] == pytest.approx(draft, rel=3e-2)
    assert floating(MASS + WEIGHT * (36 + DEPTH) / 2 / G)[0] > 1.05 * draft


def test_periods_of_the_buoy():
    """Heave with the axial added mass of the bottom disc; pitch about the stationary point."""
    free = {key: value for key, value in MOORED.items() if key in ("gravity", "sea", "buoy")}
    _, report = numbers_of(free)
    draft, KB, GM = floating(MASS)
    heave_mass = MASS + 0.9 * RHO * 2 / 3 * math.pi * RADIUS**3
    assert report.periods["buoy, heave"] == pytest.approx(2 * math.pi * math.sqrt(heave_mass / (RHO * G * PLANE)))
    # body and added mass turn about their common centre; the added mass is a rod as long as the draft
    added, gap = 0.4 * MASS, CENTER - KB
    common = added * gap / (MASS + added)
    inertia = TRANSVERSE + MASS * common**2 + added * ((gap - common) ** 2 + draft**2 / 12)
    assert report.periods["buoy, pitch"] == pytest.approx(2 * math.pi * math.sqrt(inertia / (MASS * G * GM)), rel=1e-6)
    assert "buoy, yaw" not in report.periods


def test_periods_of_a_moored_buoy(moored):
    """As in the hull study: near the free ones in heave, with a slow surge on the cable."""
    _, report = moored
    assert report.periods == report.periods | {
        f"buoy, {k}": v.period for k, v in buoy_periods(load_scene(MOORED)).items()
    }
    assert report.periods["buoy, surge"] > 2 * report.periods["buoy, heave"] > 2.0


def test_heave_damping_of_drag():
    """8/(3 pi) of the drag at the wave's velocity, on the bottom disc; radiation damping if wave_damping is given."""
    free = {key: value for key, value in MOORED.items() if key in ("gravity", "sea")}
    free |= {"buoy": BUOY | {"axial_drag": 0.7}, "waves": {"amplitude": 0.8, "period": 6.0}}
    drag = 8 / (3 * math.pi) * 0.5 * RHO * 0.7 * PLANE * 2 * math.pi / 6 * 0.8
    critical = 2 * math.sqrt(RHO * G * PLANE * (MASS + 0.9 * RHO * 2 / 3 * math.pi * RADIUS**3))
    assert numbers_of(free)[0]["heave damping ratio"] == pytest.approx(drag / critical)
    free["buoy"]["wave_damping"] = [5000.0, 0.0]
    assert numbers_of(free)[0]["heave damping ratio"] == pytest.approx((drag + 5000) / critical)


def test_a_taut_cable_and_one_that_is_too_short():
    """Drafts with a cable that holds the buoy down, and none for a submerged buoy."""
    scene = {key: value for key, value in MOORED.items() if key not in ("current", "external_force")}
    for length in (23.0, 16.0):
        numbers, _ = numbers_of(scene | {"cable": scene["cable"] | {"length": length}})
        rest = solve_static(scene | {"cable": scene["cable"] | {"length": length}})
        if length > 20:
            draft = CENTER - float(rest.buoy_position[2])
            assert numbers["draft on its taut cable"] == pytest.approx(draft, rel=1e-3)
            assert draft > 1.1 * numbers["draft, free"]
        else:
            assert numbers["the cable holds the buoy under water: pull"] == pytest.approx(float(rest.tension_top))
            assert not any("draft" in name and "free" not in name for name in numbers)
            assert "heave damping ratio" not in numbers
        arm = float(rest.displaced_mass) * (float(rest.displaced_mass) / RHO / PLANE / 2 - 0.35) - MASS * (
            CENTER - 0.35
        )
        plane = 0.0 if length < 20 else RHO * math.pi * RADIUS**4 / 4
        GM = next(value for name, value in numbers.items() if name.startswith("GM") and "free" not in name)
        assert pytest.approx((arm + plane) / MASS, rel=2e-3) == GM


@pytest.mark.parametrize("height", [-0.4, 0.0, 1.7])
def test_a_pull_rights_below_and_upsets_above(height):
    """Righting lever at small tilt: buoyancy at the metacentre, weight at C, pull at its point of attachment."""
    buoy = load_scene(MOORED).network.buoys["buoy"]
    shape, mass = shape_of(buoy), mass_properties(buoy)
    found = float_upright(shape, mass, RHO, G, 5e3, height)
    draft, KB = found.draft, found.draft / 2
    assert RHO * PLANE * draft == pytest.approx(MASS + 5e3 / G)
    buoyancy, metacentre = RHO * G * PLANE * draft, KB + RADIUS**2 / (4 * draft)
    moment = buoyancy * metacentre - MASS * G * CENTER - 5e3 * height  # about the keel, per radian
    assert pytest.approx(moment / (MASS * G)) == found.GM


def test_what_heels_over_and_what_is_too_long():
    """A pull high above the keel makes GM negative, reported with its value; a warning about a slack cable."""
    high = {"buoy": BUOY | {"mooring_height": 2.9, "point_masses": [{"mass": 700.0, "height": 3.9}]}}
    scene = {key: value for key, value in MOORED.items() if key not in ("current", "external_force")} | high
    scene["initial"] = {"kind": "straight", "buoy_position": [3.0, -2.0, 4.0]}
    numbers, report = numbers_of(scene)
    GM = numbers["GM with the weight of the cable"]
    assert GM < 0
    assert any(f"GM = {GM:.3g} m is not positive" in warning for warning in report.warnings)
    _, report = numbers_of(MOORED)
    assert any(f"{30 - DEPTH:.3g} m longer than the water is deep" in warning for warning in report.warnings)


def test_equilibrium(moored):
    """The values shown are those of the equilibrium."""
    numbers, _ = moored
    rest = solve_static(MOORED)
    x, y, z = rest.buoy_position.values
    assert math.hypot(x - 3, y + 2) > 2
    assert numbers["equilibrium: offset of C from the anchor"] == pytest.approx(math.hypot(x - 3, y + 2))
    assert numbers["equilibrium: C above still water"] == pytest.approx(z)
    assert numbers["equilibrium: tension at the top"] == pytest.approx(float(rest.tension_top))
    x, y, z = rest.anchor_force.values
    assert numbers["equilibrium: force at the anchor"] == pytest.approx(math.hypot(x, y, z))
    assert numbers["equilibrium: uplift at the anchor"] == pytest.approx(-z)
    assert z < 0 < math.hypot(x, y)
    assert float(rest.tension_top) > 1.2 * float(rest.tension_anchor)


def test_hanging_cable():
    """Tensions under an end force in closed form, and T_n = 2/n int sqrt(m/T) ds of its transverse modes."""
    force = np.array([3000.0, 4000.0, 20000.0])
    cable = CABLE | {"elements": 30, "top": {"kind": "free", "force": force.tolist()}}
    sea = {"depth": 40.0, "density": RHO}  # deeper than the cable is long, so that all of it is in water
    numbers, report = numbers_of({"gravity": G, "sea": sea, "cable": cable})

    def tension(s):
        return math.hypot(5000.0, 20000.0 - WEIGHT * (30.0 - s))

    assert numbers["equilibrium: tension at the top"] == pytest.approx(tension(30.0))
    assert numbers["equilibrium: force at the anchor"] == pytest.approx(tension(0.0))
    assert numbers["equilibrium: uplift at the anchor"] == pytest.approx(20000.0 - WEIGHT * 30.0)
    mass = 31.0 + 0.7 * RHO * math.pi * 0.09**2 / 4
    travel = quad(lambda s: math.sqrt(mass / tension(s)), 0, 30)[0]
    for n in (1, 2):
        assert report.periods[f"cable, transverse {n} (taut, fixed ends)"] == pytest.approx(2 * travel / n, rel=1e-4)
    assert not report.warnings


def test_cable_below_the_bed_and_under_pressure():
    """Depth of a slack cable below the sea bed; the smallest tension where it is compressed."""
    top = {"kind": "fixed", "position": [12.0, 0.0, -4.0]}
    scene = {"gravity": G, "sea": {"depth": 20.0, "density": RHO}, "cable": CABLE | {"top": top}}
    _, report = numbers_of(scene)
    lowest = float(solve_static(scene).cable_position[:, 2].min()) + 20.0
    assert lowest < -1
    assert any(f"hangs up to {-lowest:.3g} m below the sea bed" in warning for warning in report.warnings)
    folded = CABLE | {"elements": 3, "top": {"kind": "fixed", "position": [0.05, 0.0, -1.0]}}
    scene = {"gravity": G, "sea": {"depth": 22.0, "density": RHO}, "cable": folded}
    smallest = float(solve_static(scene).cable_tension.min())
    said = [warning for warning in check(load_scene(scene)).warnings if "compressed" in warning]
    assert len(said) == (smallest <= 0)
    assert all(f"smallest tension {newtons(smallest)}" in warning for warning in said)


SNAP = "pull of a snap at a held end per m/s"


@pytest.mark.parametrize("slack", ["tension-only", "compressive"])
@pytest.mark.parametrize(("damping", "step"), [(0.0, 0.05), (0.0, 0.017), (0.0, 0.01), (8e4, 0.05), (8e4, 0.01)])
def test_snaps(slack, damping, step):
    """c/EA, Z = sqrt(EA rho0) and the 167 ms of a wave along 30 m and back; warnings and their values to two digits."""
    cable = CABLE | {"slack": slack, "damping": damping, "top": {"kind": "fixed", "position": [20.0, 0.0, -3.0]}}
    time = {"end": 1.0, "step": step}
    numbers, report = numbers_of({"sea": {"depth": DEPTH, "density": RHO}, "cable": cable, "time": time})
    remarks = {name: remark for name, _, _, remark in report.numbers}
    assert numbers["cable internal damping"] == damping
    assert remarks["cable internal damping"] == (f"c/EA = {damping / 4e6:g} s" if damping else "none")
    said = [sentence for sentence in report.warnings if "taut" in sentence]
    if slack == "compressive":
        assert SNAP not in numbers
        assert not said
        return
    assert numbers[SNAP] == pytest.approx(math.sqrt(4e6 * 31))
    assert remarks[SNAP] == f"without damping, for {60 * math.sqrt(31 / 4e6):.3g} s at most"
    hidden = f"Where the cable comes taut, steps of {step:g} s hide the peak: it needs 0.017 s, or cable.damping, with "
    hidden = [hidden + "which a run makes its steps smaller there."] if step > 0.017 and not damping else []
    assert [sentence for sentence in said if "hide" in sentence] == hidden
    assert any("no damping" in sentence for sentence in said) == (damping == 0)
    _, report = numbers_of(
        {"sea": {"depth": DEPTH, "density": RHO}, "cable": cable, "time": time | {"tolerance": 1e-2}}
    )
    assert not any("hide" in sentence for sentence in report.warnings)


@pytest.mark.parametrize(("depth", "slack"), [(10.0, "compressive"), (10.0, "tension-only"), (24.0, "compressive")])
def test_who_lies_undamped(depth, slack):
    """One warning about a line on a bed, or one that can go slack; none about one hanging above the bed."""
    cable = CABLE | {"slack": slack, "elements": 30, "top": {"kind": "fixed", "position": [26.0, 0.0, 0.0]}}
    if depth == 24.0:
        cable |= {"anchor": [0.0, 0.0, -5.0]}
    scene = {"sea": {"depth": depth, "density": RHO}, "cable": cable, "seabed": {}}
    for time, damping in ((None, 0.0), ({"end": 1.0, "step": 0.01}, 0.0), ({"end": 1.0, "step": 0.01}, 8e4)):
        more = {"time": time} if time else {}
        numbers, report = numbers_of(scene | more | {"cable": cable | {"damping": damping}})
        assert (numbers["equilibrium: length on the sea bed"] > 0) == (depth == 10.0)
        said = [sentence for sentence in report.warnings if "no damping" in sentence]
        assert len(said) == (bool(time) and damping == 0 and depth == 10.0)


def waves(depth, **section):
    """Numbers of waves over a cable that is not solved for."""
    cable = CABLE | {"top": {"kind": "fixed", "position": [20.0, 0.0, -depth + 21.0]}}
    scene = {"gravity": G, "sea": {"depth": depth, "density": RHO}, "cable": cable, "initial": {"kind": "straight"}}
    return numbers_of(scene | {"waves": section})


@pytest.mark.parametrize("depth", [3.0, 40.0])
def test_waves(depth):
    """Dispersion, Miche's steepness 0.142 tanh kh, and the way of a particle at the surface over the diameter."""
    numbers, report = waves(depth, amplitude=0.3, period=6.0)
    omega = 2 * math.pi / 6
    k = brentq(lambda k: G * k * math.tanh(k * depth) - omega**2, 1e-3, 10, xtol=1e-15)
    assert numbers["wavelength"] == pytest.approx(2 * math.pi / k)
    assert numbers["wave steepness H/lambda"] == pytest.approx(0.6 * k / (2 * math.pi))
    remark = next(remark for name, _, _, remark in report.numbers if name == "wave steepness H/lambda")
    limit = 1 / 7.04 * math.tanh(k * depth)  # Miche's seventh of the wavelength
    assert float(remark.split()[2]) == pytest.approx(limit, rel=2e-3)
    way = 2 * math.pi * 0.3 / math.tanh(k * depth)
    assert numbers["Keulegan-Carpenter number of the cable"] == pytest.approx(way / 0.09)
    assert report.periods["wave"] == 6.0
    assert "dispersion mismatch of wavelength" not in numbers
    for share, breaks in ((0.98, False), (1.02, True)):
        amplitude = share * float(remark.split()[2]) * math.pi / k
        _, report = waves(depth, amplitude=amplitude, period=6.0)
        assert any("breaking" in warning for warning in report.warnings) == breaks


@pytest.mark.parametrize(("factor", "warns"), [(1.15, True), (0.95, False), (0.88, True)])
def test_given_wavelength(factor, warns):
    """Its signed difference in per cent from the dispersion relation."""
    exact = waves(7.0, amplitude=0.1, period=4.0)[0]["wavelength"]
    numbers, report = waves(7.0, amplitude=0.1, period=4.0, wavelength=factor * exact)
    assert numbers["dispersion mismatch of wavelength"] == pytest.approx(100 * (factor - 1))
    assert any("differs from the dispersion" in warning for warning in report.warnings) == warns
    k, omega = 2 * math.pi / (factor * exact), 2 * math.pi / 4
    remark = next(remark for name, _, _, remark in report.numbers if name.startswith("dispersion"))
    assert float(remark.split()[-1]) == pytest.approx(omega**2 / (G * k * math.tanh(7 * k)), rel=1e-4)


def test_buoy_in_waves():
    """Diameter over wavelength, with a warning from 0.2, and the Keulegan-Carpenter number."""
    for wavelength, warns in ((10.9, True), (11.1, False)):
        scene = {key: MOORED[key] for key in ("gravity", "sea", "buoy")}
        scene |= {"waves": {"amplitude": 0.2, "period": 2.4, "wavelength": wavelength}}
        numbers, report = numbers_of(scene)
        assert numbers["diffraction parameter D/lambda"] == pytest.approx(2.2 / wavelength)
        assert any("diffraction is not negligible" in warning for warning in report.warnings) == warns
        way = 2 * math.pi * 0.2 / math.tanh(2 * math.pi / wavelength * DEPTH)
        assert numbers["Keulegan-Carpenter number of the buoy"] == pytest.approx(way / 2.2)


def test_tolerances(moored):
    """Newton's tolerance of each unknown: step_tolerance of lengths, of a mass times lengths a time, of forces."""
    numbers, _ = moored
    fine, _ = numbers_of(MOORED | {"solver": {"step_tolerance": 1e-7}})
    names = [name for name in numbers if name.startswith("tolerance of")]
    assert len(names) >= 4
    assert numbers["tolerance of cable position"] == pytest.approx(1e-9 * 30.0, rel=1e-3)
    for name in names:
        assert fine[name] > 10 * numbers[name]


def test_what_the_scheme_leaves():
    """Backward Euler: (1 + (omega dt)^2)^(-1/2) for each step of the run."""
    scene = load_scene(MOORED | {"time": {"end": 17.0, "step": 0.02}})
    expected = (1 + (2 * math.pi / 3.1 * 0.02) ** 2) ** (-0.5 * 850)
    assert remaining_amplitude(3.1, scene) == pytest.approx(expected)
    assert 0.01 < expected < 0.9


@pytest.mark.parametrize(("ends", "said"), [((0.0, 0.0), True), ((-0.3, 1.3), False)])
def test_a_motion_that_swings_beyond_its_rows(ends, said):
    """Overshoot of the path between rows, in close-up; none if rows are given at the turning points."""
    rows = [[0.0, 0, 0, ends[0]], [1.0, 0, 0, 0.0], [2.0, 0, 0, 1.0], [3.0, 0, 0, ends[1] or 1.0]]
    top = {"kind": "prescribed", "position": [0.0, 0.0, 9.0], "motion": rows}
    scene = load_scene({"cable": {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "top": top}})
    z = np.array([motion_of(scene.network.pieces[0].ends[1].top)(t)[2] for t in np.linspace(0.0, 3.0, 3001)]) - 9.0
    low, high = min(row[3] for row in rows), max(row[3] for row in rows)
    beyond = 100 * max(z.max() - high, low - z.min()) / (high - low)
    warnings = [sentence for sentence in derived(scene).warnings if "beyond its rows" in sentence]
    assert (beyond > 1) == said
    assert len(warnings) == said
    assert all(f"The motion of the top goes {beyond:.2g} % of its range beyond" in sentence for sentence in warnings)


def test_a_start_that_no_line_can_have_is_refused():
    """Straight between its ends, impossible for an inextensible line of another length."""
    line = {"from": [0.0, 0.0, 0.0], "length": 10.0, "line_density": 1.0, "to": [0.0, 0.0, 9.0]}
    with pytest.raises(InputError, match="initial"):
        check({"cable": [line | {"axial_stiffness": math.inf}], "initial": {"kind": "straight"}})
