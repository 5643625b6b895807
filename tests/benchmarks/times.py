"""All rows of the table against MoorDyn, timed in one run: seconds for the same accuracy, on one core.

    .venv/bin/pip install -e '.[benchmark]'
    OMP_NUM_THREADS=1 COLUMNS=200 .venv/bin/python tests/benchmarks/times.py [--rows REGEX] [--repeats N] [--out DIR]

MoorDyn runs at the settings that moordyn_settings.py found for it (moordyn.toml).  dolfbuoy's errors are measured
anew, and its settings (from those of times.toml on) made stricter or coarser until they just do.  Then the programs
take turns, row by row, as often as there are repeats.  The table shows medians and half the range of CPU seconds of
the steps alone.  Rows are kept in results/benchmarks/times as long as the program's sources do not change: --rows times
some of them ("short|buoy", "0.1 %"), in a process of its own if there is a core for it, and the table and the figure,
times.md and times.png, are made of all that are there.
"""

import argparse
import json
import math
import re
import sys
import tomllib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import dolfbuoy_settings
import machine
import moordyn_runs
import numpy as np
from comparison import draw, in_short, table, write_markdown
from errors import BOTH, RMS
from moorings import END, mooring

from dolfbuoy.parallel.cases import fingerprint
from dolfbuoy.results.compare import percent

HERE = Path(__file__).parent
ROWS = tomllib.loads((HERE / "times.toml").read_text())["row"]
FOUND = tomllib.loads((HERE / "moordyn.toml").read_text())["found"]


@dataclass
class Row:
    """A case at an accuracy; theirs(), ours(): CPU seconds of END once; shown: the cells of the table."""

    theirs: object
    ours: object
    shown: dict
    seconds: dict = field(default_factory=lambda: {"moordyn": [], "dolfbuoy": []})

    def time(self):
        """Both programs once."""
        self.seconds["moordyn"].append(self.theirs())
        self.seconds["dolfbuoy"].append(self.ours())

    def cells(self):
        """For `comparison.table`."""
        found = dict(self.shown)
        for program, seconds in self.seconds.items():
            found[f"{program}_cpu"], found[f"{program}_spread"] = float(np.median(seconds)), float(np.ptp(seconds) / 2)
        return found | {"ratio": found["moordyn_cpu"] / found["dolfbuoy_cpu"]}


@cache
def fit(name):
    """dolfbuoy's limit on a mooring, and what is known of its settings."""
    return dolfbuoy_settings.Fit(mooring(name))


def row_of(given, theirs, options) -> Row:
    """Of a row of times.toml and MoorDyn's settings for it."""
    name, accuracy = given["case"], given["accuracy"]
    of_rms, _ = fit(name).cheapest(given["dolfbuoy"], accuracy, RMS)
    way, error = fit(name).cheapest(given["dolfbuoy"], accuracy)
    chosen = moordyn_runs.Settings(theirs["scheme"], theirs["segments"], theirs["step"])
    probe = min(END, moordyn_runs.PROBE * chosen.step)
    rate = moordyn_runs.seconds_of(mooring(name), chosen, probe) / probe
    if math.isnan(rate):
        sys.exit(f"{name}: MoorDyn diverges with {chosen}; moordyn_settings.py finds its settings anew.")
    end = min(END, options.repeat_seconds / rate)
    shown = {"case": name, "accuracy": accuracy, "aim": given.get("aim"), "readme": given.get("readme")}
    shown |= {"moordyn_settings": str(chosen), "moordyn_error": theirs["error"]}
    shown |= {"dolfbuoy_settings": "".join(map(str, way)), "dolfbuoy_error": error, "misses": error > accuracy}
    shown |= {f"moordyn_{part}": theirs.get(part) for part in BOTH} | {"moordyn_of_rms": theirs.get("of_rms")}
    shown |= {f"dolfbuoy_{part}": size for part, size in fit(name).parts(way).items()}
    shown["dolfbuoy_of_rms"] = None if of_rms == way else "".join(map(str, of_rms))
    return Row(
        lambda: moordyn_runs.seconds_of(mooring(name), chosen, end) * END / end,
        lambda: dolfbuoy_settings.seconds_of(mooring(name), way),
        shown,
    )


def kept_file(options, given):
    """Where a row is kept."""
    name = re.sub(r"\W+", "-", f"{given['case']} {given['accuracy']}")
    return options.kept / f"{fingerprint()[:12]}-{name}.json"


def timed(options):
    """Time the rows that are asked for, and keep them."""
    rows = []
    for given, theirs in zip(ROWS, FOUND, strict=True):
        assert (given["case"], given["accuracy"]) == (theirs["case"], theirs["accuracy"])
        name = f"{given['case']}, {percent(given['accuracy'])}"
        if re.search(options.rows, name) and "scheme" in theirs:
            print(name, file=sys.stderr, flush=True)
            rows.append((kept_file(options, given), row_of(given, theirs, options)))
    for _ in range(options.repeats):
        for _, row in rows:
            row.time()
    options.kept.mkdir(parents=True, exist_ok=True)
    for file, row in rows:
        file.write_text(json.dumps(row.cells()))


def notes_of(options):
    """What is said below the table."""
    missed = [f"{f['case']}, {percent(f['accuracy'])}: MoorDyn misses it." for f in FOUND if "scheme" not in f]
    return [
        *missed,
        f"{machine.version().capitalize()}; {machine.sentence()}",
        f"Median and half the range of {options.repeats} runs, CPU seconds for {END:g} s.",
    ]


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", default="", help="those whose name, as the table has it, matches")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--repeat-seconds", type=float, default=4.0, help="of a repeat of MoorDyn, at most")
    parser.add_argument("--kept", type=Path, default=Path("results/benchmarks/times"), help="folder of the rows")
    parser.add_argument("--out", type=Path, default=HERE / "results", help="folder of times.md and times.png")
    options = parser.parse_args()
    timed(options)
    options.out.mkdir(parents=True, exist_ok=True)
    files = [kept_file(options, given) for given in ROWS]
    cells, notes = [json.loads(file.read_text()) for file in files if file.is_file()], notes_of(options)
    if not cells:
        sys.exit(f"--rows {options.rows}: no row has such a name.")
    table(cells, notes)
    print("\n" + in_short(cells))
    write_markdown(options.out / "times.md", cells, notes)
    draw(cells).savefig(options.out / "times.png")


if __name__ == "__main__":
    main()
