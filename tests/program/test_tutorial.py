"""Every cell of the tutorial runs, and prints the output shown below it.

Source: the notebook itself, dolfbuoy/scenes/tutorial.ipynb, with the output of an earlier run.
"""

import contextlib
import io
import json
from importlib import resources

import pytest

TEXT = (resources.files("dolfbuoy") / "scenes" / "tutorial.ipynb").read_text()
CELLS = json.loads(TEXT)["cells"]


def printed(cell):
    return "".join("".join(output["text"]) for output in cell["outputs"] if output["output_type"] == "stream")


def numbers(text):
    """Numbers of a text and the words between them."""
    found, words = [], []
    for word in text.split():
        try:
            found.append(float(word.strip("(),")))
        except ValueError:
            words.append(word)
    return found, words


def test_tutorial_is_small_and_holds_no_page():
    """A page in it would be that of an older program."""
    assert len(TEXT) < 300_000
    kinds = {kind for cell in CELLS for output in cell.get("outputs", []) for kind in output.get("data", {})}
    assert kinds == {"image/png", "text/plain"}


@pytest.mark.slow
def test_tutorial_prints_what_it_says():
    names = {}
    for cell in CELLS:
        if cell["cell_type"] == "code":
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                exec(compile("".join(cell["source"]), "tutorial", "exec"), names)
            found, words = numbers(said.getvalue())
            expected, text = numbers(printed(cell))
            assert words == text
            assert found == pytest.approx(expected, rel=1e-2, abs=0.011, nan_ok=True)  # the last digit that is printed
