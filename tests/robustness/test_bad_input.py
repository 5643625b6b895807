"""Invalid and unusual inputs each end with one message naming the key, and exit code 2, before anything is built.

Source: a list of inputs and required messages (bad_input.toml); the messages as recorded, which `RECORD=1 pytest
tests/robustness/test_bad_input.py` renews.
"""

import os
import re
import time
import tomllib
from pathlib import Path

import pytest
import tomli_w

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.feasible import check_feasible
from dolfbuoy.scene import load_scene, merged, parse_assignment, shipped_scenes
from dolfbuoy.scene.reading import parse
from dolfbuoy.statics.first_shape import check_first_shape

CORPUS = tomllib.loads(Path(__file__).with_name("bad_input.toml").read_text())
SENTENCES = Path(__file__).parents[1] / "recorded" / "lines" / "sentences.txt"
RECORDED, SAID = set(SENTENCES.read_text(encoding="utf-8").splitlines()), set[str]()
ANEW = os.environ.get("RECORD") == "1"
KINDS = ("together", "file", "command", "usage")
#: (scene, key, value, words)
VALUES = [
    (scene, key, value, words)
    for scene, keys in CORPUS.items()
    if scene not in KINDS
    for key, cases in keys.items()
    for value, *words in cases
]


PLACES = re.compile(r"/[^ '\"]*/pytest-[^ '\"]*/")


@pytest.fixture(scope="module", autouse=True)
def anew():
    """Sentences are recorded when all were said."""
    yield
    if ANEW:
        SENTENCES.write_text("\n".join(sorted(SAID)) + "\n", encoding="utf-8")


def name(case):
    """Of a test, in characters that a terminal shows."""
    return ascii(case)[:90]


def refused(scene):
    """The sentence in which a scene ends."""
    with pytest.raises(InputError) as caught:
        judge(scene)
    return str(caught.value)


def judge(scene):
    """All that is looked at before anything is built."""
    found = load_scene(scene)
    check_feasible(found)
    check_first_shape(found)


def check_sentence(said, words):
    for word in words:
        assert word in said, said
    assert said.isprintable(), said
    assert said.endswith(".")
    assert not said.endswith("..")
    assert len(said) < 800, said
    assert "instance of" not in said  # no Python in a message to a user
    words = PLACES.sub("FOLDER/", said)
    SAID.add(words)
    assert ANEW or words in RECORDED


def saved(folder, data):
    """A scene as a file."""
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(data), encoding="utf-8")
    return path


def test_there_are_many():
    assert len(VALUES) + sum(len(CORPUS[kind]) for kind in KINDS) >= 450


@pytest.mark.parametrize(("scene", "key", "value", "words"), VALUES, ids=name)
def test_bad_value(tmp_path, scene, key, value, words):
    """In a file, as it comes from a stranger."""
    data = merged(tomllib.loads(shipped_scenes()[scene].read_text()), **{key: value})
    said = refused(saved(tmp_path, data))
    check_sentence(said, [key.partition(".")[0], key.rpartition(".")[2], *words])


@pytest.mark.parametrize("case", CORPUS["together"], ids=name)
def test_values_that_do_not_go_together(case):
    scene = merged(load_scene(case["like"]).to_dict(), **case["set"])
    if case.get("good"):
        load_scene(scene)
    else:
        check_sentence(refused(scene), case["says"])


@pytest.mark.parametrize("case", CORPUS["file"], ids=name)
def test_bad_file(tmp_path, case):
    path = tmp_path / "scene.toml"
    path.write_text(case["text"], encoding="utf-8")
    check_sentence(refused(path), case["says"])


@pytest.mark.parametrize(
    "content",
    [
        b"\xff\xfe\x00",
        b"x = '\xe9'\n",
        b"x = " + b"[" * 20000,
        b"x = " + b"9" * 5000,
        b"x." * 2000 + b"y = 1",
        b"x = {" + b'a.\'b c\'."d\\"e" . ' * 20000 + b"f = 1}",
        b"x = '" + b'"\\' * 1_000_000,
        b"#" * 10_000_001,
    ],
    ids=["UTF-16", "Latin-1", "nested", "digits", "dots", "quoted names", "quotes", "size"],
)
def test_files_that_parsers_stumble_over(tmp_path, content):
    """In a moment: the time of tomllib grows with the square of the names of a key."""
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    start = time.perf_counter()
    check_sentence(refused(path), ["TOML" if len(content) < 10_000_000 else "10,000,000 bytes"])
    assert time.perf_counter() - start < 5.0


def test_the_deepest_key_that_is_read(tmp_path):
    """29 dots, in the file and with --set; numbers, and dots in texts and comments, are no keys."""
    text = f"title = '{'. ' * 40}'\n# {'...' * 40}\n[cable]\nanchor = [{'1.0,2.0,3.0,' * 20}]\n"
    assert len(parse(text)["cable"]["anchor"]) == 60
    names = [f"k{i}" for i in range(31)]
    for read in (parse, lambda text: dict([parse_assignment(text.replace(" ", ""))])):
        assert read(".".join(names[:30]) + " = 1")
        with pytest.raises(ValueError, match="30"):
            read(".".join(names) + " = 1")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cable.elements": [[22 / 100_001, 1]] * 100_001}, ["cable.elements", "100000 segments at most"]),
        ({"initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0]] * 40_001}}, ["initial.points", "at most 40000"]),
        ({"buoy.hull": [[0.0, 1.0]] * 10_001}, ["buoy.hull", "at most 10000"]),
    ],
    ids=["segments", "points", "hull"],
)
def test_lists_are_no_longer_than_a_file_may_hold(changes, words):
    """What is accepted can be written as a scene, and read again."""
    check_sentence(refused(merged(load_scene("short").to_dict(), **changes)), words)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory: a scene, and nothing else when all is over."""
    monkeypatch.chdir(tmp_path)
    saved(tmp_path, tomllib.loads(shipped_scenes()["short"].read_text())).rename("SCENE.toml")
    yield tmp_path
    left = {path.name for path in tmp_path.iterdir()} - {"SCENE.toml", "results"}
    assert not left


@pytest.mark.parametrize("case", [case for case in CORPUS["command"] if not case.get("good")], ids=name)
def test_bad_command(call, folder, case):
    code, _, err = call(*case["line"])
    assert code == 2, err
    assert "Traceback" not in err
    assert err.startswith("Error: ")
    check_sentence(err.rstrip("\n"), case["says"])


@pytest.mark.parametrize("case", CORPUS["usage"], ids=name)
def test_bad_usage(call, folder, case):
    code, _, err = call(*case["line"])
    assert code == 2, err
    assert "Traceback" not in err


@pytest.mark.parametrize("error", [SolveError("steps failed"), InputError("key: must be a number")])
def test_every_message_ends_with_a_full_stop(call, monkeypatch, error):
    """Also those that quote another program's, or are made of parts."""

    def fail(**_):
        raise error

    monkeypatch.setattr("dolfbuoy.commands.main.app", fail)
    assert call("list")[2].endswith(f"{error}.\n")


@pytest.mark.parametrize("line", [("import", "moordyn", "pipe"), ("statistics", "loop")], ids=name)
def test_what_is_no_file(call, tmp_path, monkeypatch, line):
    """A pipe that nobody writes to, a link to itself: no wait, and no traceback."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    os.symlink("loop", "loop")
    code, _, err = call(*line)
    assert code == 2, err
    check_sentence(err.rstrip("\n"), [line[-1]])
