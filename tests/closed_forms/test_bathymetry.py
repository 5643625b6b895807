"""Uneven sea beds: lines and bodies over a grid of depths.

Source: the plane bed, sampled on a grid; equilibrium of a weight on a parabola; finite differences of the residual; the
numbers written to the files; MoorDyn.
"""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from alone import simulate
from every_key import shows
from scipy.sparse import csr_matrix

from dolfbuoy import InputError, load_scene, solve_static
from dolfbuoy.formats.moordyn_run import run
from dolfbuoy.formats.to_moordyn import Numerics, export, start_of
from dolfbuoy.model.problem import Problem
from dolfbuoy.studies.physics import energy

SLOPE, DEPTH = (0.03, -0.02), 100.0
CHAIN = {
    "sea": {"depth": DEPTH},
    "seabed": {"friction": 0.5},
    "cable": {
        **{"length": 400.0, "elements": 20, "line_density": 100.0, "diameter": 0.15, "axial_stiffness": 1e8},
        **{"position_degree": 2, "tension_degree": 1, "from": [0.0, 0.0, -DEPTH]},
        "top": {"kind": "prescribed", "position": [350.0, 20.0, 0.0], "amplitude": [2.0, 0.0, 2.0], "period": 8.0},
    },
    "time": {"end": 1.0, "step": 0.1, "scheme": "bdf2"},
}
X, Y = [-300.0, -50.0, 200.0, 420.0, 700.0], [-300.0, 10.0, 300.0]


def grid(depth, x=X, y=Y):
    """Table of a function (x, y) -> depth."""
    return {"x": list(x), "y": list(y), "depth": [[float(depth(a, b)) for a in x] for b in y]}


PLANE = grid(lambda x, y: DEPTH - SLOPE[0] * x - SLOPE[1] * y)
HILL = grid(
    lambda x, y: DEPTH - 8 * math.exp(-(((x - 150) / 50) ** 2) - ((y - 10) / 60) ** 2),
    np.linspace(-100, 500, 31),
    np.linspace(-200, 200, 21),
)


@shows("seabed.depths.x", "seabed.depths.y", "seabed.depths.depth")
def test_a_plane_as_a_grid():
    """At rest and in motion, with friction: same results as on the sloped plane bed."""
    plane, table = (load_scene(CHAIN, seabed=more) for more in ({"slope": list(SLOPE)}, {"depths": PLANE}))
    one, other = solve_static(plane), solve_static(table)
    assert float(one.length_on_bed[0]) > 50
    for name in ("tension_top", "tension_anchor", "length_on_bed"):
        assert float(other[name][0]) == pytest.approx(float(one[name][0]), rel=1e-9)
    one, other = simulate(plane), simulate(table)
    np.testing.assert_allclose(other.tension_top, one.tension_top, rtol=3e-6)  # as far as Newton goes
    np.testing.assert_allclose(other.cable_position, one.cable_position, atol=1e-6)


def test_a_line_on_a_hill():
    """It lies on the hill with the sag it has on a plane, but with a different tension."""
    flat, hill = solve_static(CHAIN), solve_static(load_scene(CHAIN, seabed__depths=HILL))
    bed = load_scene(CHAIN, seabed__depths=HILL).seabed.depths
    nodes = hill.cable_position.values
    height = nodes[:, 2] - bed.height(nodes[:, 0], nodes[:, 1])
    low = nodes[:, 0] < 150
    assert np.abs(height[low][1:]).max() < 0.1
    assert nodes[low, 2].max() > -DEPTH + 7
    tops, feet = ([float(rest[f"tension_{end}"][0]) for rest in (flat, hill)] for end in ("top", "anchor"))
    assert abs(tops[1] / tops[0] - 1) > 0.01
    # without friction T - w z is the same all along, whatever the bed: nothing is lost over the hill
    assert tops[1] - feet[1] == pytest.approx(tops[0] - feet[0], rel=1e-3)


def test_beyond_the_grid():
    """The bed continues with the depths of the border, and interpolates exactly at grid points and lines."""
    bed = load_scene(CHAIN, seabed__depths=HILL).seabed.depths
    assert bed.height(-500.0, 0.0) == pytest.approx(bed.height(-100.0, 0.0))
    slopes = load_scene(CHAIN, seabed__depths=PLANE).seabed.depths.derivatives(*np.array([[900.0, 0.0], [0.0, 0.0]]).T)
    np.testing.assert_allclose(slopes[:, 1:3], [[0.0, SLOPE[1]], SLOPE], atol=1e-12)
    x, y = np.meshgrid(HILL["x"], HILL["y"])
    np.testing.assert_allclose(bed.height(x, y), -np.array(HILL["depth"]), atol=1e-9)
    spots, h = np.array([[120.0, 30.0], [140.0, -20.0], [-400.0, 5.0]]).T, 1e-4
    found = bed.derivatives(*spots)
    for k, (dx, dy) in {1: (h, 0.0), 2: (0.0, h)}.items():
        sides = [bed.derivatives(spots[0] + s * dx, spots[1] + s * dy) for s in (1, -1)]
        slopes = (sides[0] - sides[1]) / (2 * h)
        np.testing.assert_allclose(found[:, k], slopes[:, 0], atol=1e-7)
        np.testing.assert_allclose(found[:, 2 + k : 4 + k], slopes[:, 1:3], atol=1e-6)


CURVE, WEIGHT = 0.01, 500.0


def test_a_weight_on_a_parabola():
    """A clump on a line slides down until the line balances gravity along the bed."""
    lines = np.linspace(-60.0, 60.0, 13)
    scene = {
        "sea": {"depth": 50.0},
        "seabed": {"depths": grid(lambda x, y: 50.0 - CURVE * x**2, lines, lines)},
        "joint": [{"name": "clump", "mass": WEIGHT, "volume": 0.1}],
        "cable": {
            **{"length": 30.0, "elements": 4, "line_density": 0.2, "diameter": 0.01, "axial_stiffness": 1e6},
            **{"from": [55.0, 0.0, 1.0 - 50.0 + CURVE * 55.0**2], "to": "clump"},
        },
    }
    rest = solve_static(scene)
    x, y, z = rest.joint_position.sel(joint="clump").values
    pull = -rest.end_tension.values[0]  # of the line on the clump
    down = np.array([0.0, 0.0, -9.81 * (WEIGHT - 1025.0 * 0.1)])
    along = np.array([1.0, 0.0, 2 * CURVE * x]) / math.hypot(1.0, 2 * CURVE * x)
    assert 20 < x < 35
    assert (y, z) == pytest.approx((0.0, -50.0 + CURVE * x**2), abs=0.02)
    assert abs((pull + down) @ along) < 1e-5 * np.linalg.norm(down)
    assert abs(down @ along) > 0.3 * np.linalg.norm(down)


@pytest.mark.parametrize("dynamic", [False, True])
def test_jacobian(dynamic):
    """Exact, including slope and curvature of the bed: finite differences converge to it."""
    problem = Problem(load_scene(CHAIN, seabed={"depths": HILL, "stiffness": 1e4}), dynamic=dynamic)
    system, rng = problem.system, np.random.default_rng(2)
    try:
        problem.set_time(0.0)
        n = system.numbering.unknowns
        u, nodes = system.u.copy(), problem.lines.node_dofs
        u[nodes[:, 0]], u[nodes[:, 1]] = np.linspace(100, 200, len(nodes)), rng.uniform(-20, 40, len(nodes))
        bed = problem.scene.seabed.depths.height(u[nodes[:, 0]], u[nodes[:, 1]])
        u[nodes[:, 2]] = bed - rng.uniform(0, 3, len(nodes))
        u[problem.force_dofs()] = 1e4
        for evolution in problem.evolutions() if dynamic else ():
            for level in range(evolution.order):
                evolution.hand_out(level, 3.0, rng.normal(size=evolution.size))
        index, direction = system.numbering.global_index, rng.normal(size=n)
        moved = np.where(index >= 0, direction[np.maximum(index, 0)], 0.0)
        moved[problem.force_dofs()] *= 100.0

        def residual(h):
            system.u[:] = u + h * moved
            system.publish()
            return system.evaluate()[index >= 0].copy()

        residual(0.0)
        system.assemble_jacobian()
        rows, columns, values = system.A.getValuesCSR()
        change = np.zeros(n)
        change[index[index >= 0]] = moved[index >= 0]
        slope = (csr_matrix((values, columns, rows), shape=(n, n)) @ change)[index[index >= 0]]
        sizes = [np.linalg.norm((residual(h) - residual(-h)) / (2 * h) - slope) for h in (1e-3, 1e-4)]
        assert sizes[1] < 1e-6 * np.linalg.norm(slope)
        assert sizes[1] < 0.2 * sizes[0]
    finally:
        problem.destroy()


@pytest.mark.slow
def test_energy_on_a_hill():
    """It closes almost as well as on a plane, where contact impacts leave order 1."""
    defects = []
    for bed in ({}, {"depths": HILL}):
        scene = load_scene(CHAIN, seabed=bed | {"friction": 0.0}, cable__normal_drag=1.2, cable__top__ramp=4.0)
        case = {"scene": scene, "t_end": 4.0, "scheme": "bdf2"}
        rows = [energy.evaluate(case | {"step": step}) for step in (0.04, 0.02, 0.01)]
        defects.append([abs(row["defect"]) for row in rows])
        assert defects[-1][2] < 1e-3 * abs(rows[2]["top"])
    flat, hill = np.array(defects)
    assert (hill < 1.3 * flat).all()
    assert (hill[1:] < 0.6 * hill[:-1]).all()


@pytest.mark.slow
def test_against_moordyn():
    """A chain at rest on the hill, given to MoorDyn every 5 m; the hill makes 1.3 % of the tension."""
    pytest.importorskip("moordyn")
    line = {"elements": 40, "axial_stiffness": 2e7, "normal_drag": 1.0, "damping": 2e5, "position_degree": 1}
    line |= {"tension_degree": 0, "top": None, "to": [350.0, 20.0, 0.0]}
    bed = {"depths": HILL, "friction": 0.0, "stiffness": 3e4}
    scene = load_scene(CHAIN, seabed=bed, **{f"cable__{key}": value for key, value in line.items()})
    rest = solve_static(scene)
    written = export(scene, start_of(rest), Numerics())
    x, y = np.linspace(-100, 500, 121), np.linspace(-200, 200, 81)
    heights = scene.seabed.depths.height(*np.meshgrid(x, y, indexing="ij"))
    points = [f"{a} {b} {heights[i, j]}" for i, a in enumerate(x) for j, b in enumerate(y)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "floor.txt"
        path.write_text("\n".join(["121 81", " ".join(map(str, x)), " ".join(map(str, y)), *points]) + "\n")
        name = next(iter(written.files))
        written.files[name] = written.files[name].replace("--- OPTIONS ---", f"--- OPTIONS ---\n{path} SeafloorFile")
        found = run(written, 60.0)
    assert found is not None
    low, high = found.tension[-1, 0]
    assert high == pytest.approx(float(rest.tension_top[0]), rel=2e-3)
    assert low == pytest.approx(float(rest.tension_anchor[0]), rel=2e-3)
    assert high > 1.008 * float(solve_static(load_scene(scene, seabed__depths=None)).tension_top[0])


TEXT = """--- MoorDyn Bathymetry Input File ---
nGridX 3
nGridY 2
      -100.0  50.0  400.0
-50.0   90.0  95.0  100.0
 80.0   91.0  96.5  101.0
"""


def test_files(tmp_path):
    """MoorDyn and netCDF files, with depths or heights, give the table they contain."""
    (tmp_path / "bed.txt").write_text(TEXT)
    values = np.array([[90.0, 95.0, 100.0], [91.0, 96.5, 101.0]])
    axes = {"y": [-50.0, 80.0], "x": [-100.0, 50.0, 400.0]}
    xr.Dataset({"depth": (("y", "x"), values)}, axes).to_netcdf(tmp_path / "depth.nc")
    heights = xr.Dataset({"elevation": (("x", "y"), -values.T)}, axes)
    heights.isel(y=[1, 0]).to_netcdf(tmp_path / "height.nc")
    points = "".join(f"{x} {y} {-values[j, i]}\n" for i, x in enumerate(axes["x"]) for j, y in enumerate(axes["y"]))
    (tmp_path / "floor.txt").write_text(f"3 2\n-100 50 400\n-50 80\n{points}")
    for name in ("bed.txt", "floor.txt", "depth.nc", "height.nc"):
        found = load_scene(CHAIN, seabed__depths=str(tmp_path / name)).seabed.depths
        np.testing.assert_array_equal(found.depth, values)
        assert (found.x, found.y) == (axes["x"], axes["y"])


BAD = [
    ({"depths": grid(lambda x, y: 1.0, [0.0, 1.0, 1.0])}, "seabed.depths.x = '[...]': must be growing numbers"),
    ({"depths": PLANE | {"y": Y[:2]}}, "must hold one row for each y, one number for each x"),
    ({"depths": PLANE, "slope": [0.1, 0.0]}, "does not go with depths, which have their own"),
    ({"depths": PLANE, "start": "pulled"}, "does not go with depths, only with a plane bed"),
]


@pytest.mark.parametrize(("bed", "sentence"), BAD)
def test_a_bed_that_cannot_be(bed, sentence):
    with pytest.raises(InputError, match="seabed") as error:
        load_scene(CHAIN, seabed=bed)
    assert sentence in str(error.value)


def test_a_file_that_is_no_bathymetry(tmp_path):
    (tmp_path / "bed.txt").write_text(TEXT.replace("nGridY 2", "nGridY 3"))
    with pytest.raises(InputError, match="its file must be MoorDyn's"):
        load_scene(CHAIN, seabed__depths=str(tmp_path / "bed.txt"))
