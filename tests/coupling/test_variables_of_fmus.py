"""All variables and the header of an FMU, for a made-up session that is never solved.

Source: the tables another program reads, by hand.
"""

import platform
import zipfile
from contextlib import nullcontext
from types import SimpleNamespace as Fake
from xml.etree import ElementTree

import pytest

from dolfbuoy import InputError, load_scene
from dolfbuoy.coupling import fmu, paths

ROPE = {"length": 16.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 3}
FLOAT = {"mass": 300.0, "center_of_mass": 0.4, "inertia": [50.0, 70.0], "hull": [[0, 2], [1.6, 2]]}
TIME = {"end": 7.0, "step": 0.25}


def made_fmu():
    """A driven and a free buoy, an end and a length, in the order of a Session."""
    ends = [{"name": "east", "from": [9, 0, 0], "to": "one"}, {"name": "west", "from": [-9, 0, 0], "to": "two"}]
    scene = {"cable": [ROPE | end for end in ends], "buoy": [FLOAT | {"name": n} for n in ("one", "two")]}
    scene = load_scene(scene | {"time": TIME, "title": 'Two "floats"'})
    driven = {"east.winch": paths.Length(0.0, [16.0]), "one": paths.Pose(0.0, [1.0, 2, 3, 0.6, 0.8, 0, 0])}
    driven["west.from"] = paths.Path(0.0, [-9.0, 0.0, 0.5])
    return scene, fmu.layout_of(Fake(scene=scene, paths=driven))


def test_variables_of_an_fmu():
    scene, layout = made_fmu()
    places = dict(zip(("x", "y", "z", "q0", "q1", "q2", "q3"), (1.0, 2.0, 3.0, 0.6, 0.8, 0.0, 0.0), strict=True))
    inputs = {"east.winch.length": ("m", 16.0)}
    inputs |= {f"one.{x}": ("m" if x in "xyz" else None, start) for x, start in places.items()}
    inputs |= {f"west.from.{x}": ("m", start) for x, start in (("x", -9.0), ("y", 0.0), ("z", 0.5))}
    forces = {**dict.fromkeys(("fx", "fy", "fz"), "N"), **dict.fromkeys(("mx", "my", "mz"), "N.m")}
    outputs = {"east.winch.tension": "N"} | {f"one.{f}": unit for f, unit in forces.items()}
    outputs |= {f"west.from.{f}": "N" for f in ("fx", "fy", "fz")}
    loads = {f"two.load_{f}": (unit, 0.0) for f, unit in forces.items()}
    motion = {f"two.{x}": "m" if x in "xyz" else None for x in places}
    motion |= {f"two.v{x}": "m/s" for x in "xyz"} | {f"two.w{x}": "rad/s" for x in "xyz"}
    tensions = {f"{name}.tension_{end}": "N" for end in ("top", "anchor") for name in ("east", "west")}
    expected = [
        *((name, unit, "input", start) for name, (unit, start) in inputs.items()),
        *((name, unit, "output", None) for name, unit in outputs.items()),
        *((name, unit, "input", start) for name, (unit, start) in loads.items()),
        *((name, unit, "output", None) for name, unit in (motion | tensions).items()),
    ]
    assert [(v.name, v.unit, v.causality, v.start) for v in layout.variables] == expected
    assert layout[:5] == (
        ["east.winch", "one", "west.from"],
        [16.0, 1.0, 2.0, 3.0, 0.6, 0.8, 0.0, 0.0, -9.0, 0.0, 0.5],
        (11, 10),
        ["two"],
        ["east", "west"],
    )
    root = ElementTree.fromstring(fmu.description(scene, layout, "floats", "{7}"))
    assert [root.get(key) for key in ("modelName", "instantiationToken")] == ['Two "floats"', "{7}"]
    assert root.find("DefaultExperiment").attrib == {"startTime": "0", "stopTime": "7.0", "stepSize": "0.25"}
    rows = [(v.get("name"), v.get("unit"), v.get("causality"), v.get("start")) for v in root.iter("Float64")]
    starts = [(name, unit, kind, None if start is None else repr(start)) for name, unit, kind, start in expected]
    assert rows == [("time", "s", "independent", None), *starts]
    numbers = {v.get("name"): v.get("valueReference") for v in root.find("ModelVariables")}
    assert list(numbers.values()) == [str(k) for k in range(len(expected) + 2)]
    wanted = [numbers[name] for name, _, kind, _ in expected if kind == "output"]
    for kind in ("Output", "InitialUnknown"):
        assert [v.get("valueReference") for v in root.iter(kind)] == wanted


def test_header_of_an_fmu():
    """Names as bytes, with any characters."""
    _, layout = made_fmu()
    lines = fmu._header(layout._replace(free=["Böje"], starts=[16.0, 0.1]), "{7}").splitlines()
    assert lines[:6] == [
        '#define TOKEN "{7}"', "#define OF_X 11", "#define OF_F 10", "#define DRIVEN_COUNT 3", "#define BUOYS 1",
        "#define CABLES 2",
    ]  # fmt: skip
    one = "\\157\\156\\145"
    assert lines[6].startswith("static const char *const DRIVEN[] = {")
    assert f'"{one}", ' in lines[6]
    assert lines[6].endswith('", 0};')
    assert lines[7] == 'static const char *const FREE_BUOYS[] = {"\\102\\303\\266\\152\\145", 0};'
    assert lines[8:] == ["static const double STARTS[] = {16.0, 0.1, 0};"]


def test_what_an_fmu_says_of_itself():
    """Its capabilities, the parameter for input extrapolation, and units by their exponents."""
    scene, layout = made_fmu()
    root = ElementTree.fromstring(fmu.description(scene, layout, "floats", "{7}"))
    assert (root.get("fmiVersion"), root.get("variableNamingConvention")) == ("3.0", "flat")
    assert root.get("generationTool") == f"dolfbuoy {fmu.__version__}"
    assert root.find("CoSimulation").attrib == {
        "modelIdentifier": "floats",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "canHandleVariableCommunicationStepSize": "true",
    }
    (parameter,) = root.iter("Int32")
    assert parameter.attrib.pop("description").startswith("inputs are places at the end of a step (0)")
    assert parameter.attrib == {
        "name": "extrapolation", "valueReference": "1", "causality": "parameter", "variability": "tunable",
        "start": "1", "min": "0", "max": "2",
    }  # fmt: skip
    assert {unit.get("name"): unit.find("BaseUnit").attrib for unit in root.iter("Unit")} == {
        "s": {"s": "1"}, "m": {"m": "1"}, "m/s": {"m": "1", "s": "-1"}, "rad/s": {"rad": "1", "s": "-1"},
        "N": {"kg": "1", "m": "1", "s": "-2"}, "N.m": {"kg": "1", "m": "2", "s": "-2"},
    }  # fmt: skip
    assert {v.get("variability") for v in root.iter("Float64")} == {"continuous"}
    said = {v.get("name"): v.get("description") for v in root.iter("Float64")}
    assert [said[n] for n in ("east.winch.length", "one.x", "west.from.fx", "two.load_mz", "two.wz")] == [
        "unstretched length", "place", "pull of the lines there", "load at C", "motion of C",
    ]  # fmt: skip
    assert (said["east.tension_top"], said["west.tension_anchor"]) == ("tension at the top", "tension at the anchor")
    timeless = scene.model_copy(update={"time": None, "title": ""})
    root = ElementTree.fromstring(fmu.description(timeless, layout, "floats", "{7}"))
    assert (root.get("modelName"), root.find("DefaultExperiment")) == ("floats", None)


@pytest.mark.parametrize(("file", "name"), [("two floats-1.fmu", "two_floats_1"), ("9.fmu", "scene_9")])
def test_what_an_fmu_holds(file, name, tmp_path, monkeypatch):
    """Its named library, built with its own header, and its scene."""
    scene, layout = made_fmu()
    asked = []

    def build(target, sources, options):
        (include,) = options
        asked.append((target.name, sources, (target.parent / "layout.h").read_text()))
        assert include == f"-I{target.parent}"
        target.write_bytes(b"library")
        return target

    sessions = Fake(comm=Fake(size=1))
    monkeypatch.setattr(fmu, "Session", lambda scene, driven: asked.append(driven) or nullcontext(sessions))
    monkeypatch.setattr(fmu, "layout_of", lambda session: layout)
    monkeypatch.setattr(fmu, "build", build)
    assert fmu.export(scene, tmp_path / file, ["one"]) is layout
    driven, (library, sources, header) = asked
    assert (driven, library, sources) == (["one"], f"{name}.so", [fmu.FOLDER / "fmu.c"])
    with zipfile.ZipFile(tmp_path / file) as made:
        binary = f"binaries/{platform.machine()}-linux/{name}.so"
        assert sorted(made.namelist()) == sorted([binary, "modelDescription.xml", "resources/scene.toml"])
        assert {info.compress_type for info in made.infolist()} == {zipfile.ZIP_DEFLATED}
        assert made.read(binary) == b"library"
        assert made.read("resources/scene.toml").decode() == scene.to_toml()
        root = ElementTree.fromstring(made.read("modelDescription.xml"))
    token = root.get("instantiationToken")
    assert header == fmu._header(layout, token)
    assert (token[0], token[-1], len(token)) == ("{", "}", 38)
    assert root.find("CoSimulation").get("modelIdentifier") == name
    sessions.comm.size = 2
    with pytest.raises(InputError, match="An FMU is made on one rank"):
        fmu.export(scene, tmp_path / "second.fmu")
    assert not (tmp_path / "second.fmu").exists()
