"""Executes the tutorial, and writes what it printed and drew into it; needs the extra `notebook`.

    .venv/bin/python tests/tutorial.py

Outputs of more than a megabyte (the replay) are not kept: a reader gets them by running the cell.
"""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

TUTORIAL = Path(__file__).parent.parent / "dolfbuoy" / "scenes" / "tutorial.ipynb"
MOST = 500_000


def size(output):
    """Characters of an output."""
    return len(str(output.get("data", "")))


def main():
    notebook = nbformat.read(TUTORIAL, as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(TUTORIAL.parent)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it was run
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if size(output) < MOST]
    nbformat.write(notebook, TUTORIAL)


if __name__ == "__main__":
    main()
