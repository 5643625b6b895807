"""Executes the tutorial, and writes what it printed and drew into it; needs the extra `notebook`.

    .venv/bin/python tests/tutorial.py

Pages (the replay) are not kept: they are large, go stale with the page's code, and a forge does not show them.
"""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

TUTORIAL = Path(__file__).parent.parent / "dolfbuoy" / "scenes" / "tutorial.ipynb"


def main():
    notebook = nbformat.read(TUTORIAL, as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(TUTORIAL.parent)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it was run
        if cell.cell_type == "code":
            for output in cell.outputs:
                output.get("data", {}).pop("text/html", None)  # what stands there as text stays
    nbformat.write(notebook, TUTORIAL)


if __name__ == "__main__":
    main()
