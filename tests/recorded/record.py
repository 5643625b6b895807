"""Runs the commands of a case in a folder and tells what they print, draw and write.

OMP_NUM_THREADS=1 .venv/bin/python tests/recorded/record.py [NAME ...]   # records anew, all or those
"""

import contextlib
import io
import itertools
import os
import re
import runpy
import shlex
import shutil
import sys
import tempfile
import tomllib
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

HERE = Path(__file__).parent
KEPT = {"cases", "records"}  #: folders of a sweep's cases
CASES = tomllib.loads((HERE / "cases.toml").read_text())


def path_of(name: str) -> Path:
    """The recorded lines of a case."""
    return HERE / "lines" / f"{name}.txt"


def lines_of(name: str, folder: Path, call) -> list[str]:
    """What the commands of a case do in an empty folder; `call` runs a command line (conftest.py)."""
    from fingerprint import of_figure, of_file, of_text
    from matplotlib.figure import Figure

    from dolfbuoy.results import measured, style

    case, lines, seen = CASES[name], [], set()
    ticks = partial(next, itertools.count())
    for file, text in case.get("files", {}).items():
        (folder / file).write_text(text)
    for file in case.get("copies", []):
        shutil.copy(HERE / "inputs" / file, folder)

    def drawn(figure, target, *arguments, **options):
        figure.draw_without_rendering()
        place = Path(target).name if isinstance(target, str | Path) else "a page"
        told = of_figure(figure, **{key: value for key, value in options.items() if key != "metadata"})
        again = "\n".join(told) in seen
        seen.add("\n".join(told))
        lines.append(f"-- picture {place.split('.')[0]}{' as before' * again}")
        lines.extend([] if again else told)
        return saved(figure, target, *arguments, **options | {"dpi": 10})

    def printed(figure, path):
        drawn(figure, path, format="png")
        figure.set_layout_engine("none")

    saved = Figure.savefig
    given = set(folder.rglob("*"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", drawn)
        patch.setattr(style, "print_png", printed)
        patch.setattr(measured, "clock", SimpleNamespace(perf_counter=ticks, process_time=ticks))
        for command in case.get("commands", []):
            code, out, err = call(*shlex.split(command))
            lines += [f"== {command}: {code}", *of_text(out, folder), *of_text(err, folder)]
        for script in case.get("scripts", []):
            with contextlib.redirect_stdout(io.StringIO()) as said:
                runpy.run_path(str(HERE / "made_up" / script), run_name="__main__")
            lines += [f"== {script}", *of_text(said.getvalue(), folder)]
    found = (path for path in folder.rglob("*") if path.is_file() and path not in given)
    for path in sorted(path for path in found if not KEPT & set(path.relative_to(folder).parts)):
        told = of_file(path, folder)
        lines += [f"-- file {path.relative_to(folder)}", *told]
    drop = re.compile(case.get("drop", r"(?!)"))
    return [line.replace("\n", " / ") for line in lines if not drop.search(line)]


def command_line():
    """Function that calls a command: its arguments -> exit code, what it prints, what it says of errors."""
    from dolfbuoy.commands import main as cli

    cli.out.width = cli.err.width = 300

    def call(*arguments):
        sys.argv = ["dolfbuoy", *map(str, arguments)]
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as stop:
            cli.main()
        return stop.value.code or 0, out.getvalue(), err.getvalue()

    return call


def main(names):
    """Write the lines of all cases, or of those named."""
    import time

    call = command_line()
    for name in names or CASES:
        start = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            lines = lines_of(name, Path(folder), call)
            os.chdir(HERE)
        path_of(name).parent.mkdir(exist_ok=True)
        path_of(name).write_text("\n".join(lines) + "\n")
        print(f"{name}: {len(lines)} lines, {time.process_time() - start:.1f} s of CPU")


if __name__ == "__main__":
    sys.path.append(str(HERE.parent / "support"))  # as pytest has it
    main(sys.argv[1:])
