"""Closed streams, an unwritable temporary folder, a locale without umlauts: one message each.

Source: shell and environment settings; each command in a process of its own.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w
from chains import CHAIN

DOLFBUOY = str(Path(sys.executable).with_name("dolfbuoy"))
ASCII = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.fixture
def scene(tmp_path):
    """With umlauts in its name, its title and its folder's name."""
    path = tmp_path / "Böje.toml"
    path.write_text(tomli_w.dumps({"title": "Böje Ölhafen"} | CHAIN), encoding="utf-8")
    return path


def ended(folder, line, redirected="", **environment):
    """(exit code, standard output, standard error) of a command line of sh."""
    command = f'exec "{DOLFBUOY}" {line} {redirected}'
    made = os.environ | environment
    done = subprocess.run(["sh", "-c", command], cwd=folder, env=made, capture_output=True, timeout=120, check=False)
    return done.returncode, *(text.decode(errors="replace") for text in (done.stdout, done.stderr))


def check_sentence(said):
    assert "Traceback" not in said
    *_, last = said.splitlines()
    assert last.startswith("Error: ")
    assert last.endswith(".")


@pytest.mark.parametrize("line", ["check Böje.toml", "list", "run Böje.toml", "--help", "export moordyn Böje.toml"])
def test_standard_output_is_closed(scene, line):
    """Nothing is computed, and no file takes its number."""
    code, _, said = ended(scene.parent, line, ">&-")
    assert code == 1
    assert said.count("\n") == 1
    check_sentence(said)
    assert sorted(path.name for path in scene.parent.iterdir()) == ["Böje.toml"]


def test_standard_output_is_full(scene):
    code, _, said = ended(scene.parent, "check Böje.toml", ">/dev/full")
    assert code == 1
    check_sentence(said)


@pytest.mark.parametrize(
    "closed", [*(pytest.param(one, marks=pytest.mark.slow) for one in ("2>&-", "<&-")), "<&- 2>&-"]
)
def test_other_streams_are_closed(scene, closed):
    code, said, _ = ended(scene.parent, "run Böje.toml --no-plot", closed)
    assert code == 0
    assert "Böje" in said


@pytest.mark.parametrize("name", ["TMPDIR", "TEMP", "TMP"])
@pytest.mark.parametrize("folder", ["/proc", "/dev/null/x", "/etc/hostname", "/tmp/is/not/there"])
def test_a_temporary_folder_that_cannot_be_written(scene, name, folder):
    """Open MPI would end the process with a page of text."""
    others = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), "")
    code, _, said = ended(scene.parent, "run Böje.toml --no-plot", **others | {name: folder})
    assert code == 2
    assert said.count("\n") == 1
    assert f"{name} = '{folder}'" in said
    check_sentence(said)


@pytest.mark.parametrize(
    "line",
    [
        "check Böje.toml",
        "run Böje.toml --out new",
        *(
            pytest.param(line, marks=pytest.mark.slow)
            for line in (
                "list",
                "keys",
                "export moordyn Böje.toml --out new",
                "sweep Böje.toml --vary time.end=0.02 --out new",
            )
        ),
    ],
)
def test_umlauts_where_the_locale_has_none(scene, line):
    """Texts are written in UTF-8 and shown with escapes."""
    code, shown, said = ended(scene.parent, line, **ASCII)
    assert code == 0, said
    assert shown.isascii()


@pytest.mark.parametrize(
    "line",
    [
        "run Böje.toml",
        pytest.param("sweep Böje.toml --vary time.end=0.02", marks=pytest.mark.slow),
        "check Ä.toml",
        "new ü",
    ],
)
def test_names_of_results_that_the_locale_cannot_write(scene, line):
    code, _, said = ended(scene.parent, line, **ASCII)
    assert code == 2
    check_sentence(said)
