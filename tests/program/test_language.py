"""Scenes can be written without reading the source: keys, schema, new scenes, and editor support.

Source: the shipped scenes, the list of keys, and the rules of JSON Schema in an independent validator.
"""

import json
import math
import re
import tomllib

import language
import pytest

import dolfbuoy
from dolfbuoy.errors import InputError
from dolfbuoy.scene import list_keys, load_scene, shipped_scenes
from dolfbuoy.scene.petsc_options import ALLOWED
from dolfbuoy.scene.reading import recommended
from dolfbuoy.scene.schema import FILE, schema
from dolfbuoy.scene.settings import period_of

SCHEMA = schema()
KINDS = {"string": str, "boolean": bool, "object": dict, "array": list}


def faults(value, rule, path="scene"):
    """Where a value breaks a rule of JSON Schema; of the words of draft 2020-12 those that the schema uses."""
    unknown = set(rule) - WORDS
    assert not unknown, unknown
    if "$ref" in rule:
        yield from faults(value, SCHEMA["$defs"][rule["$ref"].removeprefix("#/$defs/")], path)
    if "if" in rule:
        fits = not any(faults(value, rule["if"], path))
        yield from faults(value, rule["then" if fits else "else"], path)
    if "anyOf" in rule and all(any(faults(value, choice)) for choice in rule["anyOf"]):
        yield f"{path}: none of the choices"
    if "enum" in rule and value not in rule["enum"]:
        yield f"{path}: not one of the words"
    if "type" in rule and not is_a(value, rule["type"]):
        yield f"{path}: no {rule['type']}"
    elif isinstance(value, dict):
        yield from faults_of_table(value, rule, path)
    elif isinstance(value, list):
        yield from faults_of_list(value, rule, path)
    elif is_a(value, "number") and not in_bounds(value, rule):
        yield f"{path}: out of bounds"


WORDS = {
    "$ref", "$defs", "$schema", "title", "description", "default", "type", "anyOf", "enum", "const", "properties",
    "required", "additionalProperties", "items", "prefixItems", "minItems", "maxItems", "minimum", "maximum",
    "exclusiveMinimum", "exclusiveMaximum", "maxLength", "if", "then", "else", "propertyNames",
}  # fmt: skip


def is_a(value, kind):
    if kind == "number":
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, KINDS[kind])


def in_bounds(value, rule):
    return (
        rule.get("minimum", -math.inf) <= value <= rule.get("maximum", math.inf)
        and value > rule.get("exclusiveMinimum", -math.inf)
        and ("exclusiveMaximum" not in rule or value < rule["exclusiveMaximum"])
    )


def faults_of_table(value, rule, path):
    for name in set(rule.get("required", [])) - set(value):
        yield f"{path}.{name}: missing"
    for name, item in value.items():
        inner = rule.get("properties", {}).get(name, rule.get("additionalProperties", True))
        if inner is False:
            yield f"{path}.{name}: unknown"
        elif inner is not True:
            yield from faults(item, inner, f"{path}.{name}")


def faults_of_list(value, rule, path):
    if not rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", math.inf):
        yield f"{path}: wrong length"
    rules = rule.get("prefixItems", []) or [rule.get("items", {})] * len(value)
    for i, (item, inner) in enumerate(zip(value, rules, strict=False)):
        yield from faults(item, inner, f"{path}[{i}]")


@pytest.mark.parametrize("name", shipped_scenes())
def test_schema_accepts_the_shipped_scenes(name):
    text = shipped_scenes()[name].read_text()
    assert list(faults(tomllib.loads(text), SCHEMA)) == []
    assert list(faults(load_scene(name).to_dict(), SCHEMA)) == []
    assert text.startswith(f"#:schema {FILE.name}\n")


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"cable.lenght": 3.0}, "scene.cable.lenght: unknown"),
        ({"cable.length": "long"}, "scene.cable.length: no number"),
        ({"cable.length": 0.0}, "scene.cable.length: out of bounds"),
        ({"cable.elements": 2.5}, "scene.cable.elements: none of the choices"),
        ({"cable.anchor": [0.0, 1.0]}, "scene.cable.anchor: wrong length"),
        ({"buoy.mass": None}, "scene.buoy.mass: missing"),
        ({"buoy.point_masses": [{"mass": 1.0}]}, "scene.buoy.point_masses[0].height: missing"),
        ({"time.scheme": "rk4"}, "scene.time.scheme: not one of the words"),
        ({"external_force.force": [1e12, 0.0, 0.0]}, "scene.external_force.force[0]: out of bounds"),
        ({"solver.petsc": {"pc_type": "python"}}, "scene.solver.petsc.pc_type: not one of the words"),
        ({"solver.petsc": {"snes_view": True}}, "scene.solver.petsc.snes_view: unknown"),
    ],
    ids=str,
)
def test_schema_refuses_what_the_models_refuse(changes, where):
    data = dolfbuoy.load_scene("short").to_dict()
    changed = dolfbuoy.scene.merged(data, **changes)
    assert where in list(faults(changed, SCHEMA))
    with pytest.raises(InputError):
        load_scene(changed)


def test_schema_lets_a_file_stand_for_a_motion():
    """As for elements and seas: the models take the name of a file of rows too."""
    end = {"position": [0.0, 0.0, 5.0], "motion": "surge.csv"}
    cable = {"length": 6.0, "line_density": 1.0, "top": {"kind": "prescribed", **end}}
    assert list(faults({"cable": cable, "joint": [{"name": "winch", **end}]}, SCHEMA)) == []
    cable["top"]["motion"] = 3.0
    assert list(faults({"cable": cable}, SCHEMA)) == ["scene.cable.top.motion: none of the choices"]


def tables_in(node):
    """The tables that a node of the schema lets through, in whatever form."""
    if "$ref" in node:
        yield from tables_in(SCHEMA["$defs"][node["$ref"].removeprefix("#/$defs/")])
    inner = [node.get(name) for name in ("else", "then", "items", "additionalProperties")]
    for one in [*inner, *node.get("anyOf", ())]:
        if isinstance(one, dict):
            yield from tables_in(one)
    yield node


def test_schema_has_every_key_with_description_and_unit():
    for key in list_keys():
        nodes = [SCHEMA]
        for part in key.name.split("."):
            inner = [one["properties"] for node in nodes for one in tables_in(node) if "properties" in one]
            nodes = [table[part] for table in inner if part in table] or nodes  # NAME: any name
        node = nodes[0]
        assert node["description"].startswith(key.description), key.name
        assert key.unit in ("", "1") or node["description"].endswith(f" [{key.unit}]"), key.name
    assert set(SCHEMA["$defs"]["Solver"]["properties"]["petsc"]["properties"]) == set(ALLOWED)


def test_files_are_those_that_the_command_makes(call):
    code, out, _ = call("schema")
    assert code == 0
    assert json.loads(out) == json.loads(FILE.read_text()) == SCHEMA
    text = language.README.read_text()
    assert language.with_table(text) == text


def test_keys(call):
    code, out, _ = call("keys", "cable.top")
    assert code == 0
    rows = {line.split()[0]: line for line in out.splitlines() if line.startswith("cable.top.")}
    assert set(rows) == {key.name for key in list_keys() if key.name.startswith("cable.top.")}
    assert '"prescribed"' in rows["cable.top.kind"]
    assert " s " in rows["cable.top.period"]
    assert all(key.name in call("keys")[1] for key in list_keys()[::20])


@pytest.mark.parametrize("like", ["short", "driven", "hanging-chain", "jumper-waves", "free-buoy"])
def test_new_scene_is_the_one_it_is_like_and_names_every_key(call, tmp_path, monkeypatch, like):
    monkeypatch.chdir(tmp_path)
    code, out, _ = call("new", "mine", "--like", like)
    assert code == 0
    assert "mine.toml" in out
    path = tmp_path / "mine.toml"
    assert load_scene(path) == load_scene(like, title="mine", **recommended(like))
    text = path.read_text()
    assert text.startswith("#:schema schema.json\n")
    assert (tmp_path / "schema.json").read_bytes() == FILE.read_bytes()
    for key in list_keys():
        leaf = key.name.rpartition(".")[2]
        assert any(f"{sign}{leaf}{end}" in text for sign, end in (("\n", " ="), ("# ", " ="), ("#     ", ":"))), leaf
        assert key.description in text
    assert max(map(len, text.splitlines())) < 180


def test_new_scene_begins_with_the_step_that_bars_recommend(call, tmp_path):
    """BDF2 with 250 to 313 steps a period for `short`, not the paper's scheme; 50 at least; a file's own stay."""
    time = load_scene("short", **recommended("short")).time
    assert (time.scheme, time.end) == ("bdf2", 120.0)
    assert 5.0 / 320 <= time.step <= 5.0 / 250
    for name in shipped_scenes():
        scene, found = load_scene(name), recommended(name)
        assert not found or found["time__step"] <= period_of(scene) / 50, name
        assert load_scene(scene, **found).time.end == scene.time.end if scene.time else not found
    assert recommended("towed-array") == recommended("short-bed") == {}  # no period; bars that are never known
    path = tmp_path / "own.toml"
    load_scene("short", time__step=0.013).save(path)
    assert call("new", tmp_path / "other", "--like", path)[0] == 0
    assert load_scene(tmp_path / "other.toml").time.step == 0.013


def test_defaults_behind_a_hash_are_those_of_the_models(call, tmp_path):
    """Every key that is commented out together with a value may be switched on and changes nothing."""
    path = tmp_path / "mine.toml"
    assert call("new", path)[0] == 0
    lines, section = [], ""
    for line in path.read_text().splitlines():
        section = line if "[" in line.partition(" ")[0] or line.startswith("# [") else section
        value = line.removeprefix("# ").partition(" = ")[2].partition("  # ")[0].strip()
        switched = re.match("# [^ ]", line) and value and " = " in line[:40] and not section.startswith("# [")
        lines.append(line.removeprefix("# ") if switched else line)
    assert sum(a != b for a, b in zip(lines, path.read_text().splitlines(), strict=True)) > 8
    (tmp_path / "all.toml").write_text("\n".join(lines))
    found, wanted = (
        load_scene(tmp_path / "all.toml").to_dict(),
        load_scene("short", title="mine", **recommended("short")).to_dict(),
    )
    assert found["current"].pop("exponent") == pytest.approx(wanted["current"].pop("exponent"), rel=1e-5)
    assert found == wanted


def test_new_scene_never_replaces_a_file(call, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    for name in (path, tmp_path / "mine"):
        code, _, err = call("new", name)
        assert code == 2
        assert "mine.toml" in err
        assert path.read_text() == "precious"
    (tmp_path / "schema.json").write_text("another one")
    assert call("new", tmp_path / "yours")[0] == 0
    assert (tmp_path / "schema.json").read_text() == "another one"


def test_version_and_interface(call):
    code, out, _ = call("--version")
    assert code == 0
    assert out == f"dolfbuoy {dolfbuoy.__version__}\n"
    assert {"load_scene", "simulate", "solve_static", "InputError", "SolveError"} <= set(dir(dolfbuoy))


def test_a_byte_order_mark_is_no_fault(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + shipped_scenes()["short"].read_bytes())
    assert load_scene(path) == load_scene("short")
