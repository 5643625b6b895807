"""What a comparison of two programs looks like: table, markdown, figure of time against error."""

from pathlib import Path

import matplotlib
from rich.console import Console
from rich.table import Table

from dolfbuoy.results.compare import percent
from dolfbuoy.results.style import COLORS, PAGE, STYLE, new_figure, plain_ticks

HEADINGS = ("case", "accuracy", "MoorDyn", "error", "time [s]", "dolfbuoy", "error", "time [s]", "faster", "aim")


def _cells(row):
    """The cells of a row, as text."""
    name = row.get("case") or f"{row['cable']}, EA x {row['stiffness']:g}"
    cells = [name, percent(row["accuracy"])]
    for program in ("moordyn", "dolfbuoy"):
        cells.append(row[f"{program}_settings"])
        cells.append(percent(row[f"{program}_error"]) if f"{program}_error" in row else "-")
        cells.append(_seconds(row, program))
    cells.append(f"{_plain(row['ratio'], 2)} x" if row["ratio"] else "-")
    return [*cells, f"{row['aim']:g} x" if row["aim"] else ""]


def _seconds(row, program):
    if f"{program}_cpu" not in row:
        return "-"
    return f"{_plain(row[f'{program}_cpu'], 3)} ± {_plain(row[f'{program}_spread'], 1)}"


def _plain(number, digits):
    """Significant digits without an exponent."""
    return f"{float(f'{number:.{digits}g}'):,.10g}"


def _remarks(rows):
    """Notes of single rows, and what the references are good for."""
    said = []
    for row in rows:
        name = row.get("case") or f"{row['cable']}, EA x {row['stiffness']:g}"
        for program, label in (("moordyn", "MoorDyn"), ("dolfbuoy", "dolfbuoy")):
            if row.get(f"{program}_note"):
                said.append(f"{name}, {percent(row['accuracy'])}: {label} {row[f'{program}_note']}.")
    for name, row in {row["cable"] + f" EA x {row['stiffness']:g}": row for row in rows if "stiffness" in row}.items():
        differ = row["programs_differ"]
        said.append(
            f"{name}: the reference is known to {percent(row['reference_own'])} of the range; MoorDyn's own limit "
            + (f"differs by {percent(differ)}." if differ is not None else "was too dear to compute.")
        )
    return said


def table(rows: list[dict], notes: list[str]) -> None:
    """Print the rows."""
    shown = Table(title="Seconds at equal accuracy", title_justify="left", show_edge=False, pad_edge=False)
    for i, heading in enumerate(HEADINGS):
        shown.add_column(heading, justify="left" if i in (0, 2, 5) else "right")
    for row in rows:
        shown.add_row(*_cells(row))
    console = Console()
    console.print(shown)
    for note in [*_remarks(rows), *notes]:
        console.print(note, soft_wrap=True, highlight=False)


def write_markdown(path: Path, rows: list[dict], notes: list[str]) -> None:
    """The same as a markdown table."""
    lines = ["| " + " | ".join(HEADINGS) + " |", "|" + "---|" * len(HEADINGS)]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    lines += ["", *(f"- {note}" for note in [*_remarks(rows), *notes])]
    path.write_text("\n".join(lines) + "\n")


@matplotlib.rc_context(STYLE)
def draw(rows: list[dict], points: list[dict]):
    """Time against error, a panel per case; rings: the settings of the table.  Errors above 10 % are left out."""
    points = [point for point in points if point["error"] <= 0.1]
    cases = list(dict.fromkeys((row["cable"], row["stiffness"]) for row in rows))
    columns = min(3, len(cases))
    lines = -(-len(cases) // columns)
    figure = new_figure(PAGE, 0.6 + 2.0 * lines)
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axis, (cable, stiffness) in zip(axes.flat, cases, strict=False):
        _panel(axis, cable, stiffness, rows, points)
    for axis in axes[-1]:
        axis.set_xlabel("error [% of the range]")
    for axis in axes[:, 0]:
        axis.set_ylabel("CPU time for 120 s [s]")
    axes[0, 0].legend()
    return figure


def _panel(axis, cable, stiffness, rows, points):
    axis.set(xscale="log", yscale="log", title=f"{cable} cable, EA x {stiffness:g}")
    for program, color in (("MoorDyn", COLORS["red"]), ("dolfbuoy", COLORS["blue"])):
        mine = [p for p in points if (p["cable"], p["stiffness"], p["program"]) == (cable, stiffness, program)]
        mine = sorted({(100 * p["error"], p["seconds"]) for p in mine})
        axis.plot(*zip(*mine, strict=True), "o", color=color, ms=2.5, alpha=0.6) if mine else None
        key = program.lower()
        used = [r for r in rows if (r["cable"], r["stiffness"]) == (cable, stiffness) and f"{key}_cpu" in r]
        chosen = [(100 * r[f"{key}_error"], r[f"{key}_cpu"]) for r in used]
        if chosen:
            axis.plot(*zip(*chosen, strict=True), "o-", color=color, ms=5, mfc="none", label=program)
    for accuracy in sorted({row["accuracy"] for row in rows}):
        axis.axvline(100 * accuracy, color=COLORS["ink"], lw=0.6, ls=":")
    plain_ticks(axis)
