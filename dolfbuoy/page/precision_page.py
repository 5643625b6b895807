"""The page of `study work-precision`: error over time of every quantity, Pareto fronts, all cases, and the answer."""

from typing import Any

from ..results.compare import pareto
from ..results.measured import QUANTITIES
from . import html
from .document import tag


def precision_page(rows: list[dict[str, Any]], notes: list[str], scene: str = "") -> str:
    """HTML of the rows and notes of work-precision.json, and of the title of its scene."""
    title = f"Work and precision of {scene}" if scene else "Work and precision"
    names = [name for name in QUANTITIES if any(f"bound_{name}" in row for row in rows)]
    return html.page(
        title,
        [f"{len(rows)} cases against a finer reference"],
        tag("div", id="charts", class_="grid"),
        html.section("answer", "The answer", html.paragraphs(notes), class_="whole"),
        html.section("cases", "Cases", tag("div", id="table"), class_="whole"),
        data=data_of(rows, names),
        script="precision",
    )


def data_of(rows: list[dict[str, Any]], names: list[str]) -> dict[str, Any]:
    """Data for the script of the page."""
    return {
        "kind": "precision",
        "quantities": [{"key": name, "name": QUANTITIES[name], "front": _front(rows, name)} for name in names],
        "rows": rows,
    }


def _front(rows: list[dict[str, Any]], name: str) -> list[int]:
    """Rows that no other beats in time and error, from the fastest on."""
    done = [i for i, row in enumerate(rows) if row.get(f"bound_{name}") is not None]
    return [done[i] for i in pareto([(rows[i]["wall"], rows[i][f"bound_{name}"]) for i in done])]
