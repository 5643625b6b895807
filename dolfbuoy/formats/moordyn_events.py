"""Failures and external loads of MoorDyn in Fortran."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .moordyn_body import ends_of, numbers
from .moordyn_rods import Places, key_of
from .moordyn_text import Row, Tables

Note = Callable[..., Any]


def failures(tables: Tables, cables: dict[str, dict[str, Any]], note: Note) -> None:
    """Set the time or tension at which cables, by the numbers of their lines, part; note(line, text)."""
    ends = {row["id"]: [key_of(row[end]) for end in "AB"] for row in tables.of("lines") if "id" in row.values}
    for row in tables.of("failure"):
        point, names = key_of(row["point"]), row["lines"].split(",")
        line = names[0]
        if len(names) > 1 or line not in cables or point not in ends[line]:
            what = "several lines" if len(names) > 1 else "a line that does not end there"
            note(row.line, f"the failure at point {row['point']} is of {what}, and is not carried over")
        elif cables[line].get("slack") is None:
            note(row.line, f"line {line} bends, and does not part: its failure is not carried over")
        else:
            cables[line]["fails_at"] = _rule(row, line, ends[line].index(point), cables[line]["length"], note)
            if not cables[line]["fails_at"]:
                del cables[line]["fails_at"]


def _rule(row: Row, line: str, end: int, length: float, note: Note) -> dict[str, float]:
    time, tension = row.number("time", 0.0), row.number("tension", 0.0)
    if time > 0:
        if tension > 0:
            note(row.line, f"line {line} parts at {time:g} s here, and not at {tension:g} N, should that come before")
        return {"time": time, "at": end * length}
    if tension > 0:
        note(row.line, f"line {line} parts where its tension is largest, once that is {tension:g} N")
        return {"tension": tension}
    return {}


def external_loads(tables: Tables, places: Places, note: Note) -> None:
    """Set constant forces on buoys from those on their bodies and rods; note(line, text): for all others."""
    for row in tables.of("external loads"):
        name, force = row["object"].lower(), numbers(row, "force", (3,))
        buoy = places.buoys.get(name.removeprefix("body"), places.buoys.get(name))
        if any(numbers(row, column, (2, 3)).any() for column in ("linear", "quadratic") if column in row.values):
            note(row.line, f"the damping of {row['object']} is not carried over")
        if not force.any():
            continue
        on_rod = next((rod for rod in tables.of("rods") if name == f"rod{rod.values.get('id')}"), None)
        at = None if buoy is None else buoy.own(np.zeros(3) if on_rod is None else ends_of(on_rod)[0])
        if buoy is None or at is None or np.abs(at[:2]).max() > 1e-6 or row.values.get("frame", "G").upper() == "L":
            note(row.line, f"the force on {row['object']} is not carried over: here buoys have one, on their axis")
        else:
            buoy.section["external_force"] = {"force": force.tolist(), "height": float(at[2]) + 0.0}
