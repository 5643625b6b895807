"""`modes`, `stiffness` and `offsets`: printed and written output, from the command line, Python and several ranks.

Source: the promises of README and the interface.
"""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
import xarray as xr
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy import InputError
from dolfbuoy.linear.periods import buoy_periods
from dolfbuoy.results.mode_figures import mode_shape
from dolfbuoy.results.mode_record import moving
from dolfbuoy.scene import load_scene

FEW = ["--set", "cable.elements=6"]


def test_modes_prints_and_writes(call, tmp_path):
    """A table, modes.nc with the names of the interface, a figure and a moving mesh of every mode."""
    code, out, _ = call("modes", "short", *FEW, "--number", 4, "--paraview", "--out", tmp_path)
    assert code == 0
    for text in ("sway", "surge", "nothing holds it", "damping ratio", "residual"):
        assert text in out
    found = xr.load_dataset(tmp_path / "modes.nc")
    assert found.eigenvalue.dims == ("mode", "part")
    assert found.cable_position.dims == ("mode", "part", "node", "xyz")
    root = found.eigenvalue.values[1:] @ [1, 1j]
    np.testing.assert_allclose(found.omega.values[1:], np.abs(root))
    np.testing.assert_allclose(found.damping_ratio.values[1:], -root.real / np.abs(root))
    assert np.isnan(found.damping_ratio.values[0])
    assert found.residual.values.max() < 1e-8
    shapes = [found.cable_position, found.buoy_position, found.buoy_rotation]
    largest = np.max([np.abs(s.values[:, 0]).reshape(4, -1).max(axis=1) for s in shapes], axis=0)
    np.testing.assert_allclose(largest, 1)
    for n in range(1, 5):
        assert (tmp_path / "figures" / f"mode_{n:02d}.png").stat().st_size > 5000
        assert (tmp_path / "paraview" / f"mode_{n:02d}_hull.pvd").is_file()
        period = found.period.values[n - 1] if n > 1 else 1.0  # what has none is shown in 1 s
        film = (tmp_path / "paraview" / f"mode_{n:02d}_hull.pvd").read_text()
        times = [float(t) for t in re.findall(r'timestep="([^"]*)"', film)]
        np.testing.assert_allclose(times, period * np.arange(16) / 16)
    assert "nothing holds it" in (tmp_path / "modes.html").read_text()
    again = call("modes", tmp_path / "modes.toml", "--number", 2, "--out", tmp_path)
    assert again[0] == 0
    assert not (tmp_path / "paraview" / "mode_01_hull.pvd").exists()
    assert not (tmp_path / "figures" / "mode_03.png").exists()


def test_a_file_of_the_user_stays(call, tmp_path):
    (tmp_path / "modes.nc").write_text("mine")
    code, _, err = call("modes", "hanging-chain", "--no-plot", "--out", tmp_path)
    assert code == 2
    assert "would be replaced" in err
    assert (tmp_path / "modes.nc").read_text() == "mine"


def test_a_figure_is_enlarged_and_says_so():
    found = dolfbuoy.modes("hanging-chain", 3, comm=MPI.COMM_SELF)
    figure = mode_shape(found, 3, load_scene("hanging-chain"))
    assert "cable transverse 2" in figure._suptitle.get_text()
    rest, largest, later, _ = (line.get_xydata() for line in figure.axes[0].lines)
    np.testing.assert_allclose((largest + later) / 2, rest, atol=1e-12)
    aside = figure.axes[1].lines[1].get_xydata() - figure.axes[1].lines[0].get_xydata()
    assert np.abs([*(largest - rest), *aside]).max() > 0.1 * np.ptp(rest)


def test_a_mode_moves_as_its_complex_shape():
    """x(t) = rest + size Re(phase x), displacements, turns and tensions; the largest is a part of what is shown."""
    rng = np.random.default_rng(6)
    shape, tension, rest = rng.uniform(-1, 1, (1, 2, 4, 3)), rng.uniform(-9, 9, (1, 2, 3)), rng.uniform(0, 30, (4, 3))
    data = {"cable_position": (("mode", "part", "node", "xyz"), shape), "rest_cable_position": (("node", "xyz"), rest)}
    data |= {"cable_tension": (("mode", "part", "cell"), tension)}
    phases = np.exp(1j * np.array([0.0, 0.4, 2.0]))
    found = moving(xr.Dataset(data), 1, [0.0, 1.0, 2.0], phases)
    size = 0.12 * np.ptp(rest, axis=0).max() / np.abs(shape).max()
    for k, phase in enumerate(phases):
        moved = size * (phase * (shape[0, 0] + 1j * shape[0, 1])).real
        np.testing.assert_allclose(found.cable_position[k], rest + moved)
        np.testing.assert_allclose(found.cable_tension[k], size * (phase * (tension[0, 0] + 1j * tension[0, 1])).real)


def test_stiffness_prints_and_writes(call, tmp_path):
    code, out, _ = call("stiffness", "short", *FEW, "--out", tmp_path)
    assert code == 0
    for text in ("mooring", "hull", "tau_z", "Eigenvalues of the symmetric parts"):
        assert text in out
    found = xr.load_dataset(tmp_path / "stiffness.nc")
    np.testing.assert_allclose(found.total, found.mooring + found.hull, rtol=1e-12, atol=1e-6)


def test_stiffness_of_a_vessel_prints_and_writes(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rope = "length = 23.0, line_density = 4.0, diameter = 0.05, axial_stiffness = 1e5, elements = 4"
    lines = [f'{{name = "{p}", from = [{x}, 0, -20], to = "ship.{p}", {rope}}}' for p, x in (("bow", 15), ("aft", -15))]
    ship = '{name = "ship", position = [0, 0, 0], fairleads = {bow = [3, 0, 0], aft = [-3, 0, 0]}}'
    Path("held.toml").write_text(f"sea = {{depth = 20.0}}\nvessel = [{ship}]\ncable = [{', '.join(lines)}]\n")
    code, out, _ = call("stiffness", "held.toml")
    assert code == 0
    said = " ".join(out.split())
    for text in ("the mooring about the reference point of ship", "tau_z", "in world axes, about its reference point"):
        assert text in said
    found = xr.load_dataset("results/held/stiffness.nc")
    assert found.vessel_mooring.shape == (1, 6, 6)
    assert "total" not in found


def test_offsets_prints_and_writes(call, tmp_path):
    options = ["--force", "0:1000:500", "--directions", "0,360,90", "--out", tmp_path]
    code, out, _ = call("offsets", "short", *FEW, *options)
    assert code == 0
    assert "offset [m]" in out
    found = xr.load_dataset(tmp_path / "offsets.nc")
    assert found.direction.values.tolist() == [0.0, 90.0]  # 360 is 0
    assert found.force.values.tolist() == [0.0, 500.0, 1000.0]
    assert (tmp_path / "figures" / "offsets.png").is_file()
    x, y = found.offset_along.values[:, 0].ravel()  # without a force that of the current
    np.testing.assert_allclose(found.offset.values[:, 0], np.hypot(x, y), rtol=1e-9)
    assert x > 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["short"], "and not both"),
        (["short", "--force", "1", "--current", "1"], "and not both"),
        (["short", "--force", "a"], "--force a: must be numbers"),
        (["short", "--force", "0:1:0"], "--force 0:1:0: a range"),
        (["driven", "--force", "1"], "those of moored buoys"),
        (["two-buoys", "--force", "1", "--buoy", "middle"], "buoy middle: must be one of left, right"),
        (["two-buoys", "--current", "1", "--buoy", "left"], "--buoy: goes with --force"),
    ],
)
def test_offsets_refuses(call, tmp_path, options, words):
    code, _, err = call("offsets", *options, "--out", tmp_path)
    assert code == 2
    assert words in err.replace("\n", " ")


@pytest.mark.parametrize(
    "command",
    ["modes short", "stiffness short", "offsets short --force 1", "response short", "periodic long", "static short"],
)
def test_where_results_go_is_seen_before_the_work(call, tmp_path, monkeypatch, command):
    (tmp_path / "file").write_text("mine")
    monkeypatch.setattr("dolfbuoy.model.problem.Problem.__init__", lambda *_, **__: pytest.fail("work has begun"))
    code, _, err = call(*command.split(), "--out", tmp_path / "file")
    assert (code, err) == (2, f"Error: {tmp_path / 'file'} cannot hold results: it is a file, and must be a folder.\n")


def test_loads_that_nothing_withstands(call, tmp_path):
    code, _, err = call("offsets", "short", "--force", "1e30", "--directions", "0", "--out", tmp_path)
    assert code == 1
    assert "Under none of these loads is there an equilibrium" in err


def test_slack_and_kinked_states_have_no_modes():
    """A rope without load or weight, and a fold finer than its elements."""
    top = {"kind": "fixed", "position": [0.5, 0.0, 0.0]}
    slack = {"cable": {"length": 1.0, "line_density": 1.0, "elements": 8, "axial_stiffness": 1e3, "top": top}}
    slack["cable"] |= {"slack": "tension-only"}
    folded = {"cable": slack["cable"] | {"top": {"kind": "fixed", "position": [0.001, 0.0, 0.0]}}}
    with pytest.raises(InputError, match=r"slack|kinked"):
        dolfbuoy.modes(folded, comm=MPI.COMM_SELF)
    assert dolfbuoy.modes(slack, comm=MPI.COMM_SELF).sizes["mode"] == 10


def test_beside_a_slack_line_there_are_the_modes_of_buoys(call, tmp_path):
    """The periods that `check` lists, with shapes; heave is that of the hull with its added mass, which hangs free."""
    scene = load_scene("navigation-buoy")
    code, out, err = call("modes", "navigation-buoy", "--out", tmp_path / "m", "--no-plot")
    assert (code, err) == (0, "")
    assert "At rest a line is slack" in " ".join(out.split())
    assert "these are the modes of buoys" in " ".join(out.split())
    found, periods = xr.load_dataset(tmp_path / "m" / "modes.nc"), buoy_periods(scene)
    for name in ("surge", "sway", "heave", "roll", "pitch"):
        (k,) = np.flatnonzero([str(one).startswith(name) for one in found.name.values])
        assert float(found.period[k]) == pytest.approx(periods[name].period, rel=1e-9)
        assert float(found.residual[k]) < 1e-12
        assert max(float(np.abs(found[f"buoy_{what}"][k]).max()) for what in ("position", "rotation")) > 0.1
    assert np.all(np.diff(found.omega) > 0)


SCRIPT = """
import json, sys
import dolfbuoy

for name, scene in json.load(open(sys.argv[1])).items():
    dolfbuoy.modes(scene, 8, out=name)
    dolfbuoy.stiffness(scene, out=name) if "buoy" in scene else None
"""
ALIKE = {
    "moored": load_scene("short", cable__elements=30).to_dict(),
    "inextensible": load_scene("short", cable__elements=24, cable__axial_stiffness=None).to_dict(),
    "averaged": load_scene("driven", cable__strain="element-average", cable__position_degree=2).to_dict(),
    "tension-only": load_scene("driven", cable__slack="tension-only").to_dict(),
}
for _scene in ALIKE.values():
    _scene.pop("waves", None)


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks_find_the_same(tmp_path):
    """SLEPc on two ranks, and on one.

    The derivative of the hull's loads in its height has the error of their quadrature, 1e-5: it differs with rounding.
    """
    process = start_scenes(2, ALIKE, tmp_path, SCRIPT)
    assert process.returncode == 0, process.stderr
    for name, scene in ALIKE.items():
        alone, shared = dolfbuoy.modes(scene, 8, comm=MPI.COMM_SELF), xr.load_dataset(tmp_path / name / "modes.nc")
        scatter = 1e-4 if "buoy" in scene else 1e-8
        roots = [found.eigenvalue.values @ [1, 1j] for found in (shared, alone)]
        np.testing.assert_allclose(*roots, rtol=scatter, atol=1e-8, err_msg=name)
        assert shared.residual.values.max() < 1e-8
        if "buoy" in scene:
            matrix = dolfbuoy.stiffness(scene, comm=MPI.COMM_SELF).total
            shared = xr.load_dataset(tmp_path / name / "stiffness.nc").total
            np.testing.assert_allclose(shared, matrix, rtol=1e-3, atol=1e-4 * np.abs(matrix.values).max())


def test_response_prints_and_writes(call, tmp_path):
    """Amplitudes, spectra, a run in time beside them, and that it is linear."""
    sea = ["--significant-height", 2, "--peak-period", 6, "--periods", "5,9", "--verify", "9", "--height", 0.2]
    code, out, _ = call("response", "short", *FEW, *sea, "--out", tmp_path)
    assert code == 0
    for text in ("small waves", "waves of 0.2 m", "no extremes", "9 s against a run", "three standard deviations"):
        assert text in out
    found = xr.load_dataset(tmp_path / "response.nc")
    assert found.period.values.tolist() == [5.0, 9.0]
    assert {"rao", "rao_drag_tension", "motion_spectrum", "tension_std"} <= set(found)
    for name in ("response_amplitudes.png", "response_spectra.svg"):
        assert (tmp_path / "figures" / name).stat().st_size > 5000


@pytest.mark.parametrize(
    ("options", "texts"),
    [
        (["modes", "two-buoys", "--number", 2, "--no-plot"], ["left sway + right sway"]),
        (["modes", "lazy-wave", "--number", 2, "--no-plot"], ["cable out of plane 1"]),
        (["stiffness", "two-buoys"], ["about C of left", "about C of right"]),
        (
            ["offsets", "two-buoys", "--force", "0,6000", "--buoy", "left", "--directions", "0:270:90"],
            ["offset of right [m]", "the watch circle of left has a radius of ", "offsets.png"],
        ),
        (["offsets", "three-legs", "--force", "0,1000", "--directions", "0"], ["offset [m]", "offsets.png"]),
        (
            ["response", "free-buoy", "--periods", "8", "--significant-height", 1, "--peak-period", 7],
            ["surge", "Standard dev"],
        ),
        (
            ["response", "two-buoys", "--periods", "8"],
            ["left [m, deg]", "right [m, deg]", "tension_anchor", "southwest"],
        ),
        (
            ["response", "bridle", "--periods", "8", "--height", 0.1, "--verify", 8],
            ["tension_top_main -", "held still"],
        ),
    ],
)
def test_networks(call, tmp_path, options, texts):
    code, out, _ = call(*options, "--out", tmp_path)
    assert code == 0
    for text in texts:
        assert text in out


def test_networks_move_in_paraview(call, tmp_path):
    """A moving mesh of every cable and hull; over a period the mean place is that at rest."""
    code, _, _ = call("modes", "two-buoys", "--number", 1, "--paraview", "--out", tmp_path)
    assert code == 0
    assert {path.stem for path in (tmp_path / "paraview").glob("*.pvd")} == {"mode_01_cable", "mode_01_hull"}
    rest = xr.load_dataset(tmp_path / "modes.nc")
    meshes = {
        kind: [meshio.read(path) for path in sorted((tmp_path / "paraview").glob(f"mode_01_{kind}_*.vtu"))]
        for kind in ("cable", "hull")
    }
    points = np.array([mesh.points for mesh in meshes["cable"]])
    np.testing.assert_allclose(points.mean(axis=0), rest.rest_cable_position.values, atol=1e-6)
    assert np.ptp(points[:, rest.cable_of_node.values == 2], axis=0).max() > 1
    hulls = np.array([mesh.points for mesh in meshes["hull"]])
    first = meshes["hull"][0]
    left = np.unique(first.cells_dict["quad"][first.cell_data["buoy [1]"][0] == 0])
    assert np.ptp(hulls[:, left], axis=0).max() > 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["stiffness", "bridle"], "needs [buoy]"),
    ],
)
def test_networks_refuse(call, tmp_path, options, words):
    code, _, err = call(*options, "--out", tmp_path)
    assert code == 2
    assert words in err.replace("\n", " ")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["short", "--significant-height", 1], "both or none"),
        (["short", "--periods", "0,1"], "--periods 0: must be from 0.01 to 10000 s"),
        (["short", "--verify", "1e-9"], "--verify 1e-09: must be from 0.01 to 10000 s"),
        (["short", "--significant-height", 1, "--peak-period", 5, "--gamma", 1e9], "gamma = 1000000000.0"),
        (["short", "--spreading", 2], "--spreading: goes with"),
        (["short", "--verify", "sea"], "--verify sea: there is none"),
        (["short", "--verify", "see"], "--verify see: must be positive numbers"),
        (["hanging-chain"], r"needs [sea]"),
    ],
)
def test_response_refuses(call, tmp_path, options, words):
    code, _, err = call("response", *options, "--out", tmp_path)
    assert code == 2
    assert words in err.replace("\n", " ")
