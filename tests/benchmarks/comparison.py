"""What a comparison of two programs looks like: table, markdown, figure of time against error."""

from pathlib import Path

import matplotlib
from errors import BOTH
from matplotlib.ticker import LogLocator
from rich.console import Console
from rich.table import Table

from dolfbuoy.results.compare import percent
from dolfbuoy.results.style import COLORS, PAGE, STYLE, new_figure, plain_ticks

OF_PROGRAM = ("rms", "extremes", "time [s]")
HEADINGS = ("case", "accuracy", "MoorDyn", *OF_PROGRAM, "dolfbuoy", *OF_PROGRAM, "faster", "aim")
TITLE = """# Times beside MoorDyn

Made by `tests/benchmarks/times.py`; MoorDyn's settings by `tests/benchmarks/moordyn_settings.py`
([moordyn.md](moordyn.md)), which also says against what errors are measured. Both programs were timed in turn.

![time against error, both programs](times.png)

"""


def _cells(row):
    """The cells of a row, as text."""
    cells = [row["case"], percent(row["accuracy"])]
    for program in ("moordyn", "dolfbuoy"):
        spread = _plain(row[f"{program}_spread"], 1)
        parts = [row[f"{program}_{part}"] for part in BOTH]
        shown = ["" if part is None else percent(part) for part in parts]
        cells += [row[f"{program}_settings"], *shown, f"{_cpu(row, program)} ± {spread}"]
    return [*cells, _faster(row), f"{row['aim']:g} x" if row["aim"] else ""]


def _cpu(row, program):
    return _plain(row[f"{program}_cpu"], 3)


def _faster(row):
    return f"{_plain(row['ratio'], 2)} x"


def _plain(number, digits):
    """Significant digits without an exponent."""
    return f"{float(f'{number:.{digits}g}'):,.10g}"


def _remarks(rows):
    found = []
    for row in rows:
        name = f"{row['case']}, {percent(row['accuracy'])}"
        found += [f"{name}: dolfbuoy misses the accuracy."] if row["misses"] else []
        others = {"MoorDyn": row["moordyn_of_rms"], "dolfbuoy": row["dolfbuoy_of_rms"]}
        changed = [f"{program} with {text}" for program, text in others.items() if text]
        found += [f"{name}: asked of the rms alone, cheapest are {' and '.join(changed)}."] if changed else []
    return found


def table(rows: list[dict], notes: list[str]) -> None:
    """Print the rows."""
    shown = Table(title="Seconds at equal accuracy", title_justify="left", show_edge=False, pad_edge=False)
    for i, heading in enumerate(HEADINGS):
        shown.add_column(heading, justify="left" if i in (0, 2, 6) else "right")
    for row in rows:
        shown.add_row(*_cells(row))
    console = Console()
    console.print(shown)
    for note in [*_remarks(rows), *notes]:
        console.print(note, soft_wrap=True, highlight=False)


def write_markdown(path: Path, rows: list[dict], notes: list[str]) -> None:
    """The same as a markdown table, below a title."""
    lines = ["| " + " | ".join(HEADINGS) + " |", "|" + "---|" * len(HEADINGS)]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    lines += ["", *(f"- {note}" for note in [*_remarks(rows), *notes])]
    path.write_text(TITLE + "\n".join(lines) + "\n")


def in_short(rows: list[dict]) -> str:
    """The table of the README at the top: a line per case that has a name there, at 1 % and 0.1 %."""
    lines = []
    for case, name in {row["case"]: row["readme"] for row in rows if row["readme"]}.items():
        cells = [name]
        for accuracy in (0.01, 0.001):
            row = next((row for row in rows if (row["case"], row["accuracy"]) == (case, accuracy)), None)
            cells += (
                [f"{_cpu(row, 'dolfbuoy')} s", f"{_cpu(row, 'moordyn')} s", _faster(row)] if row else ["", "missed", ""]
            )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


@matplotlib.rc_context(STYLE)
def draw(rows: list[dict]):
    """Time against error at the settings of the table, a panel per case."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    columns = min(3, len(cases))
    lines = -(-len(cases) // columns)
    figure = new_figure(PAGE, 0.6 + 1.7 * lines)
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axis, case in zip(axes.flat, cases, strict=False):
        _panel(axis, case, [row for row in rows if row["case"] == case])
    for axis in axes.flat[len(cases) :]:
        axis.set_axis_off()
    for axis in axes.flat[max(0, len(cases) - columns) : len(cases)]:
        axis.set_xlabel("error [% of the range]")
        axis.tick_params(labelbottom=True)
    for axis in axes[:, 0]:
        axis.set_ylabel("CPU time for 120 s [s]")
    axes[0, 0].legend()
    return figure


def _panel(axis, case, rows):
    axis.set(xscale="log", yscale="log", title=case)
    for program, marker, color in (("MoorDyn", "s", COLORS["red"]), ("dolfbuoy", "o", COLORS["blue"])):
        key = program.lower()
        found = [(100 * row[f"{key}_error"], row[f"{key}_cpu"]) for row in rows]
        axis.plot(*zip(*found, strict=True), marker + "-", color=color, ms=4, label=program)
    for row in rows:
        axis.axvline(100 * row["accuracy"], color=COLORS["ink"], lw=0.6, ls=":")
    plain_ticks(axis)
    axis.yaxis.set_major_locator(LogLocator())
