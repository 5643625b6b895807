"""Parted lines in record and pictures: two pieces from that moment on, with a gap at the break.

Source: time and place from the scene's rule; node numbers by hand.
"""

import meshio
import numpy as np
import pytest
from chromium import CHROMIUM, browser
from mpi_helpers import needs_mpirun, start_scenes
from test_page import data_of

from dolfbuoy import figures, load_scene, simulate
from dolfbuoy.page.run_page import run_page
from dolfbuoy.results.frame import Frames, pieces_of
from dolfbuoy.results.paraview import export
from dolfbuoy.results.record import read

#: In vacuum, of equal elements; one parts in its middle, between nodes 4 and 6, one at its upper end, one not at all.
ELEMENTS, PER, TIME = 4, 2, 0.1
LINE = {"length": 4.0, "line_density": 3.0, "elements": ELEMENTS, "position_degree": PER, "tension_degree": 1}
RULES = {"middle": {"time": TIME, "at": 2.5}, "top": {"time": 0.16}, "whole": {"tension": 1e9}}
SCENE = {
    "cable": [
        LINE
        | {"name": name, "from": [0.0, y, 0.0], "fails_at": rule}
        | {"top": {"kind": "fixed", "position": [3.0, y, 0.0]}}
        for y, (name, rule) in enumerate(RULES.items())
    ],
    "time": {"end": 0.24, "step": 0.02, "output_every": 0.02, "scheme": "backward-euler"},
}
NODES = PER * ELEMENTS + 1
#: First and last node of the pieces of each line in the end; what is left of the top at the upper end is a point.
PIECES = {"middle": [(0, 2 * PER), (3 * PER, NODES - 1)], "top": [(0, 3 * PER)], "whole": [(0, NODES - 1)]}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """(folder, record)."""
    folder = tmp_path_factory.mktemp("parted")
    return folder, simulate(SCENE, out=folder)


def test_pieces_of_a_line():
    """On both sides of each element that is gone; a node alone is none."""
    x = np.arange(21.0).reshape(7, 3)
    for gone, expected in (
        ([], [(0, 6)]),
        ([1], [(0, 2), (4, 6)]),
        ([0], [(2, 6)]),
        ([2], [(0, 4)]),
        ([0, 1], [(4, 6)]),
        ([0, 1, 2], []),
    ):
        whole = np.ones(3, dtype=bool)
        whole[gone] = False
        found = [(int(piece[0, 0]) // 3, int(piece[-1, 0]) // 3) for piece in pieces_of(x, whole)]
        assert found == expected


def test_a_record_says_when_every_element_parted(run):
    _, record = run
    since = record.parted_at.values.reshape(3, ELEMENTS)
    assert record.parted_at.attrs["units"] == "s"
    expected = np.full((3, ELEMENTS), np.nan)
    expected[0, 2], expected[1, 3] = TIME, 0.16
    np.testing.assert_allclose(since, expected, rtol=1e-12)
    assert record.attrs["format"] == 2
    whole = {k: v for k, v in SCENE["cable"][2].items() if k != "fails_at"}
    assert "parted_at" not in simulate(SCENE | {"cable": [whole]}, time__end=0.04)


def test_a_record_that_is_cut_back_forgets_what_came_later(tmp_path):
    """Resumed to another end, it has what it would have had without a stop."""
    first = simulate(load_scene(SCENE, time__end=0.06), out=tmp_path)
    assert np.isnan(first.parted_at).all()
    again = simulate(resume=tmp_path, time__end=0.12)
    assert np.flatnonzero(np.isfinite(again.parted_at)).tolist() == [2]
    np.testing.assert_array_equal(again.parted_at, simulate(load_scene(SCENE, time__end=0.12)).parted_at)


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks(tmp_path):
    """One order of elements on any number of ranks."""
    done = start_scenes(2, {"lines": SCENE}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    together = read(tmp_path / "lines" / "results.nc")
    assert np.flatnonzero(np.isfinite(together.parted_at)).tolist() == [2, 2 * ELEMENTS - 1]


def expected_pieces(record, time):
    """Nodes of all pieces at a frame."""
    x = record.cable_position.sel(frame=time, method="nearest").values.reshape(3, NODES, 3)
    for number, (name, pieces) in enumerate(PIECES.items()):
        parted = time >= RULES[name].get("time", np.inf) - 1e-9
        for first, last in pieces if parted else [(0, NODES - 1)]:
            yield name, x[number, first : last + 1]


@pytest.mark.parametrize("time", [0.08, 0.1, 0.14, 0.24])
def test_a_snapshot_draws_the_pieces(run, time):
    """In space and from above, each where the record has it, and nothing else."""
    _, record = run
    expected = [nodes for _, nodes in expected_pieces(record, time)]
    assert len(expected) == (3 if time < TIME else 4)
    frame = Frames(record, load_scene(SCENE)).at(time)
    for found, nodes in zip([piece for _, pieces in frame.lines for piece in pieces], expected, strict=True):
        np.testing.assert_array_equal(found, nodes)
    space, *plan = figures.snapshot(record, time=time).axes
    drawn = [np.transpose(line.get_data_3d()) for line in space.lines if line.get_linestyle() == "-"]
    for curves, width in ((drawn, 3), *(([line.get_xydata() for line in axes.lines], 2) for axes in plan)):
        found = [curve for curve in curves if len(curve) > 1]
        assert len(found) == len(expected)
        for curve, nodes in zip(found, expected, strict=True):
            np.testing.assert_allclose(curve, nodes[:, :width])
    labels = {text.get_text() for text in space.figure.legends[0].get_texts()}
    assert labels >= set(RULES)


def test_shapes_are_drawn_in_pieces(run):
    """Each with the colour of its time."""
    _, record = run
    (lines,) = figures.shapes(record, cable="middle").axes[0].collections
    found = zip(np.array(lines.get_array()), lines.get_segments(), strict=True)
    expected = [
        (t, nodes[:, [0, 2]])
        for t in record.frame.values
        for name, nodes in expected_pieces(record, float(t))
        if name == "middle"
    ]
    assert len(expected) == record.sizes["frame"] + 8
    for (t, curve), (time, nodes) in zip(found, expected, strict=True):
        assert t == pytest.approx(time)
        np.testing.assert_allclose(curve, nodes)


def test_paraview_leaves_out_what_parted(run):
    """Straight pieces from node to node, with the numbers of their elements' line and segment."""
    folder, record = run
    export(folder)
    for i, time in enumerate(record.frame.values):
        mesh = meshio.read(folder / "paraview" / f"cable_{i:04d}.vtu")
        np.testing.assert_array_equal(mesh.points, record.cable_position.values[i])
        gone = [k for k, t in ((0, TIME), (1, 0.16)) if time >= t - 1e-9]
        missing = {k * NODES + n for k in gone for n in range(PER * (2 + k), PER * (3 + k))}
        first = [k * NODES + n for k in range(3) for n in range(NODES - 1) if k * NODES + n not in missing]
        np.testing.assert_array_equal(mesh.cells_dict["line"], np.column_stack([first, np.add(first, 1)]))
        np.testing.assert_array_equal(mesh.cell_data["cable [1]"][0], np.array(first) // NODES)


def test_a_page_holds_when_elements_parted(run):
    _, record = run
    parted = data_of(run_page(record))["view"]["lines"]["parted"]
    assert parted == {"2": pytest.approx(TIME), "7": pytest.approx(0.16)}


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_the_replay_shows_a_gap(run, tmp_path):
    """From the time on at which the line parts, and not before; else the picture is that of lines that are whole."""
    _, record = run
    pages = {"parted": run_page(record), "whole": run_page(record.drop_vars("parted_at"))}
    seen = {}
    with browser(tmp_path / "chromium") as window:
        for name, page in pages.items():
            (tmp_path / f"{name}.html").write_text(page)
            window.open(tmp_path / f"{name}.html", width=760, height=560)
            for time in (0.08, 0.14):
                window.choose("time", time)
                window.pause()
                seen[name, time] = window.run("document.getElementById('canvas').toDataURL()")
            assert window.errors() == []
    assert seen["parted", 0.08] == seen["whole", 0.08]
    assert seen["parted", 0.14] != seen["whole", 0.14]
