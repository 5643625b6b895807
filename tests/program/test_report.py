"""The report of a run or a sweep: signatures, inputs, load cases, criteria, figures; one self-contained file.

Source: the record and the scene, read by hand.
"""

import re

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged
from every_key import shows

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.page.report import _governing
from dolfbuoy.results.record import read
from dolfbuoy.solver import compat
from dolfbuoy.studies.sweep import sweep

SIGNED = {"project": "Harbour <b>light</b>", "author": "A. Engineer", "revision": "C2"}
RUN = SIGNED | merged(
    MOORED,
    cable__elements=4,
    waves__ramp=0.5,
    criteria={"largest_offset": 1.0, "largest_lean_deg": 80.0},
    time={"end": 3.0, "step": 0.05},
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report") / "run"
    dolfbuoy.simulate(load_scene(RUN, title="Tether"), out=folder)
    return folder


@pytest.fixture
def text(folder, call):
    code, out, _ = call("report", folder)
    assert code == 0
    assert out.strip().endswith(str(folder / "report.html"))
    return (folder / "report.html").read_text(encoding="utf-8")


def cells(text, first):
    """Texts of the other cells of the row that begins so."""
    row = re.search(rf'<th scope="row">{re.escape(first)}</th>(.*?)</tr>', text)[1]
    return re.findall(r"<td>(.*?)</td>", row)


@shows("project", "author", "revision")
def test_who_signs_what(text):
    assert cells(text, "project") == ["Harbour &lt;b&gt;light&lt;/b&gt;"]
    assert (cells(text, "author"), cells(text, "revision")) == (["A. Engineer"], ["C2"])
    assert f"dolfbuoy {dolfbuoy.__version__}" in text


def test_inputs_and_load_case(text):
    assert "Line: 22 m, from the anchor to buoy, in 20 m of water." in text
    assert "Buoy: 700 kg." in text
    assert "<td>unstretched length</td><td>22</td><td>m</td>" in text
    (case,) = cells(text, "run")
    assert case == "3 s, regular waves of 1.6 m and 5 s, a current of 0.5 m/s towards 0 degrees"


def test_the_verdict_comes_first(text, folder):
    largest = float(read(folder / "results.nc").offset.max())
    assert "1 of 2 criteria are not met." in text
    assert text.index("1 of 2 criteria") < text.index("Load cases")
    part, value, limit, unit, says = cells(text, "offset")
    assert (part, limit, unit) == ("buoy", "&lt;= 1", "m")
    assert float(value) == pytest.approx(largest, rel=1e-4)
    assert says.startswith("not met, ")
    assert cells(text, "lean")[-1].startswith("met, ")


def test_one_file_that_needs_nothing(text):
    """Figures are in it, and no script; nothing is fetched, and nothing from the scene is markup."""
    assert text.count('<img src="data:image/png;base64,') >= 4
    assert "default-src 'none'; img-src data:; style-src" in text
    assert not re.search(r'(src|href)="(?!data:image/png)', text)
    assert '<script type="module"></script>' in text
    assert "<b>light" not in text


def test_of_a_sweep(tmp_path, call):
    """Cases, what governs in which of them, the largest of each quantity."""
    found = sweep(load_scene(RUN), ["current.speed=0.2,0.9"], None, tmp_path)
    assert call("report", tmp_path)[0] == 0
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    first = cells(text, "1")[0]
    assert first.startswith("current.speed = 0.2 (done; offset buoy: ")
    missing = float(re.search(r"offset buoy: (\S+) % missing", first)[1])
    assert -missing == pytest.approx(float(found.criterion_left[0]), rel=5e-3)
    assert "All cases are this scene, but for what varies." in text
    for name, version in compat.versions().items():
        assert cells(text, name) == [version]
    assert cells(text, "offset")[0] == "buoy, current.speed = 0.9"
    (found,) = [row for row in re.findall(r"<tr>.*?</tr>", text) if '<th scope="row">tension top [kN]</th>' in row]
    assert "current.speed = 0.9" in found


def test_of_a_scene_without_criteria(tmp_path, call):
    dolfbuoy.simulate(load_scene(RUN, criteria=None, time__end=1.0), out=tmp_path / "run")
    assert call("report", tmp_path / "run")[0] == 0
    assert "No criteria were given" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "DIR: must be the folder"),
        (("nowhere",), "holds neither a run nor a sweep"),
        (("--out", "x"), "study accuracy"),
    ],
)
def test_what_has_no_report(arguments, said, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = call("report", *arguments)
    assert code == 2
    assert said in err.replace("\n", " ")


def test_figures_are_of_what_governs():
    """The line that is pulled hardest and the buoy that leans most; of a record without these the first."""
    tension = (("time", "cable"), [[1.0, 5.0, 2.0], [3.0, 4.0, np.nan]])
    record = xr.Dataset({"tension_top": tension, "cone_angle": (("time", "buoy"), [[1.0, 2.0], [9.0, 3.0]])})
    assert _governing(record, "cable", ["east", "north", "south"]) == "north"
    assert _governing(record, "buoy", ["a", "b"]) == "a"
    assert _governing(record.drop_vars("tension_top"), "cable", ["east", "north"]) == "east"
    assert _governing(record, "cable", []) is None
