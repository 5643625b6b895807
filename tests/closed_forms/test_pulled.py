"""Lines laid on a bed with friction and pulled into place: over joints, from either end, on slopes.

Source: the same line in one piece; shooting with scipy for a chain on a slope, with a clump on it.
"""

import math

import numpy as np
import pytest
from alone import simulate, solve_static
from mpi_helpers import needs_mpirun, start_scenes
from scipy.integrate import solve_ivp
from scipy.optimize import root

from dolfbuoy.results.parts import alone
from dolfbuoy.results.record import read

G, L, W, EA, X = 9.81, 560.0, 700.0, 4e8, 520.0
CHAIN = {"line_density": W / G + 1025 * math.pi * 0.1**2 / 4, "diameter": 0.1, "axial_stiffness": EA}
CHAIN |= {"position_degree": 2, "tension_degree": 1}
PIECES = ((20, 25, 35), (30, 30, 20))


def scene(slope_deg=0.0, friction=0.5, depth=100.0, cut=None, turned=False, heading=0.0, body=None, **changes):
    """A chain from a sloped bed to the water line; cut: numbers of elements of its segments; turned: from above."""
    along, tan = np.array([math.cos(heading), math.sin(heading), 0.0]), math.tan(math.radians(slope_deg))
    low, high = [0.0, 0.0, -depth], (X * along).tolist()
    if cut is None:
        cables = CHAIN | {"length": L, "elements": 80, "top": {"kind": "fixed", "position": high}}
    else:
        segments = [{"length": L * n / 80, "elements": n} for n in cut]
        if body:
            segments[0]["body"] = body
        low, high, segments = (high, low, segments[::-1]) if turned else (low, high, segments)
        cables = [CHAIN | {"name": "chain", "from": low, "to": high, "segments": segments}]
    bed = {"friction": friction, "slope": (tan * along[:2]).tolist(), "stiffness": W / 1e-3 / 0.1}
    bed |= {"start": "pulled", "stick_length": 5e-3}
    return {"sea": {"depth": depth}, "cable": cables, "seabed": bed} | changes


#: Slope in degrees, friction, depth at the anchor: the tension dies on the bed, or comes through to the anchor.
BEDS = {
    "flat": (0.0, 0.5, 100.0),
    "flat, comes through": (0.0, 0.2, 100.0),
    "up": (5.0, 0.5, 145.5),
    "down": (-5.0, 0.5, 70.0),
    "down, comes through": (-5.0, 0.2, 70.0),
}
CURRENT = {"speed": 0.8, "direction_deg": 60.0}


def beds(*essential):
    """Parameters of a test, all but the essential ones for the slow tests."""
    return [pytest.param(b, id=n, marks=() if n in essential else pytest.mark.slow) for n, b in BEDS.items()]


@pytest.mark.parametrize(
    "more", [{}, pytest.param({"current": CURRENT}, marks=pytest.mark.slow)], ids=["still", "current"]
)
@pytest.mark.parametrize("bed", beds("down"))
def test_a_pulled_line_cut_into_three_is_the_line(bed, more):
    """From its anchor or from its top, to 1e-9 of length and tension."""
    whole = solve_static(scene(*bed, **more))
    for cut, turned in zip(PIECES, (False, True), strict=True):
        found, way = solve_static(scene(*bed, cut=cut, turned=turned, **more)), -1 if turned else 1
        size = float(whole.tension_top)
        np.testing.assert_allclose(found.cable_position[::way], whole.cable_position, atol=1e-9 * L)
        np.testing.assert_allclose(found.cable_tension[::way], whole.cable_tension, atol=1e-9 * size)
    assert float(whole.anchor_force.dot(whole.anchor_force)) < (0.5 * size) ** 2


def shot(slope_deg, friction, depth, clump=0.0, at=0.0):
    """(tensions at the top and at the anchor, place of the clump) of a chain that is pulled over a slope.

    clump: its weight in water [N], at: arc length where it lies.  Upwards from the touchdown the equations of a chain
    by scipy, downwards T falls by w (sin + mu cos) per metre, and by the same of the clump.
    """
    a = math.radians(slope_deg)
    fall = math.sin(a) + friction * math.cos(a)

    def lying(T, s):
        """(tension, stretched length) down to the anchor."""
        steps = np.linspace(s, 0.0, 20001)
        middle, size = (steps[1:] + steps[:-1]) / 2, s / 20000
        tension = np.maximum(T - W * fall * (s - middle) - clump * fall * (middle < at), 0.0)
        return max(T - W * fall * s - clump * fall, 0.0), np.sum((1 + tension / EA) * size), steps, tension

    def hanging(s, T):
        """(x, z, T) at the top from where the chain leaves the bed."""

        def rates(_, y):
            H, V = y[2:]
            T = math.hypot(H, V)
            return [(1 / T + 1 / EA) * H, (1 / T + 1 / EA) * V, 0.0, W]

        begin = [0.0, 0.0, T * math.cos(a), T * math.sin(a)]
        end = solve_ivp(rates, (s, L), begin, method="DOP853", rtol=1e-11, atol=1e-9).y[:, -1]
        return end[0], end[1], math.hypot(end[2], end[3])

    def missed(y):
        s, T = y * [L, 1e5]
        stretched = lying(T, s)[1]
        x, z, _ = hanging(s, T)
        return [(stretched * math.cos(a) + x - X) / L, (stretched * math.sin(a) + z - depth) / L]

    found = root(missed, [0.6, 0.8], tol=1e-12)
    assert np.abs(missed(found.x)).max() < 1e-9
    s, T = found.x * [L, 1e5]
    anchor, _, steps, tension = lying(T, s)
    below = np.sum(((1 + tension / EA) * s / 20000)[steps[:-1] <= at * (1 + 1e-9)])
    return hanging(s, T)[2], anchor, below * np.array([math.cos(a), 0.0, math.sin(a)])


@pytest.mark.parametrize("bed", beds("flat", "down, comes through"))
def test_a_pulled_chain_on_a_slope(bed):
    """In three segments: tensions of the shooting, to 2e-4 of the top's; the anchor's to what an element rubs."""
    for heading in (0.0, 2.2):
        found, (top, anchor, _) = solve_static(scene(*bed, cut=PIECES[0], heading=heading)), shot(*bed)
        assert float(found.tension_top) == pytest.approx(top, rel=2e-4)
        assert float(np.linalg.norm(found.anchor_force)) == pytest.approx(anchor, abs=0.3 * W * L / 80)


def test_a_chain_too_stiff_to_slide_leaves_its_anchor_nothing():
    """Where friction carries all, whatever EA is: a hundredth of the tension on the bed at most."""
    given = scene(*BEDS["flat"])
    found = solve_static(given | {"cable": given["cable"] | {"axial_stiffness": 7.5e12, "elements": 40}})
    assert np.linalg.norm(found.anchor_force[:2]) < 0.01 * np.linalg.norm(found.end_tension[:2])


@pytest.mark.parametrize("bed", beds("down"))
def test_a_clump_that_was_pulled_over_the_bed(bed):
    """It rubs with its weight; no joint, body or line moves when the run begins, on a bed that holds them."""
    mass = 2000.0
    given = scene(*bed, cut=(20, 60), body={"mass": mass})
    found, (top, anchor, place) = solve_static(given), shot(*bed, clump=mass * G, at=L / 4)
    assert float(found.tension_top) == pytest.approx(top, rel=3e-4)
    assert float(np.linalg.norm(found.anchor_force)) == pytest.approx(anchor, abs=0.3 * W * L / 80)
    np.testing.assert_allclose(found.joint_position[0, ::2], place[::2] - [0.0, bed[2]], atol=0.03)
    run = simulate(given, **{"time": {"end": 2.0, "step": 0.1}})
    np.testing.assert_allclose(run.joint_position, run.joint_position[:1].values.repeat(len(run.time), 0), atol=1e-4)
    np.testing.assert_allclose(run.tension_anchor, float(run.tension_anchor[0]), atol=1e-4 * top)


def legs(friction=0.6, **more):
    """Three legs of chain and lighter chain to a float, over a slope, in a current."""
    parts = [{"length": 400.0, "elements": 20}, {"length": 160.0, "elements": 8, "line_density": 25.0}]
    cables = []
    for name, angle in (("east", 0.0), ("north", 2.0), ("south", 4.4)):
        x, y = 500.0 * math.cos(angle), 500.0 * math.sin(angle)
        low = [x, y, -100.0 + 0.03 * x - 0.02 * y]
        cables.append(CHAIN | {"name": name, "from": low, "to": "float", "segments": parts})
    bed = {"friction": friction, "slope": [0.03, -0.02], "start": "pulled"}
    body = {"name": "float", "mass": 2000.0, "volume": 45.0}
    water = {"depth": 100.0, "dry_above": False}  # the float draws its legs taut wherever it is
    return {"sea": water, "cable": cables, "joint": [body], "seabed": bed, "current": CURRENT} | more


@pytest.mark.slow
def test_every_line_of_a_network_is_pulled():
    """Each is the line alone that is pulled to where the float is."""
    given = legs()
    found = solve_static(given)
    place = found.joint_position.sel(joint="float").values
    for name, cable in zip(found.cable.values, given["cable"], strict=True):
        alone = solve_static({**given, "cable": [cable | {"to": place.tolist()}], "joint": None})
        for force in ("end_tension", "anchor_force"):
            size = np.linalg.norm(alone.end_tension)
            np.testing.assert_allclose(found[force].sel(cable=name), alone[force], atol=5e-3 * size)
    free = solve_static(legs(friction=0.0))
    assert (found.tension_anchor < 0.9 * free.tension_anchor).all()


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
@pytest.mark.parametrize("ranks", [2, 3])
def test_pulled_on_ranks(ranks, tmp_path):
    """Lines, joints and a clump on the bed as on one rank, at rest and after a step."""
    scenes = {"legs": legs(), "clump": scene(5.0, 0.5, 145.5, cut=(20, 60), body={"mass": 2000.0})}
    scenes = {name: given | {"time": {"end": 0.1, "step": 0.1}} for name, given in scenes.items()}
    done = start_scenes(ranks, scenes, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    for name, given in scenes.items():
        one, together = simulate(given), alone(read(tmp_path / name / "results.nc"))
        for quantity in ("cable_position", "cable_tension", "end_tension", "anchor_force"):
            a, b = one[quantity].values, together[quantity].values
            np.testing.assert_allclose(b, a, atol=1e-8 * np.abs(a).max())
