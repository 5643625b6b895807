"""Line types of MoorDyn as materials."""

import math
from collections.abc import Callable
from typing import Any

from ..errors import InputError
from ..scene.quantities import number_of
from .moordyn_text import Row, Tables, is_nothing, is_number


def material_of(row: Row, tables: Tables, note: Callable[..., Any]) -> dict[str, float]:
    """The keys of a [material]; note(line, text) of what they leave out.

    Raises InputError for a stiffness that is in another file.
    """
    found = {"line_density": row.number("mass_density"), "diameter": row.number("diameter")}
    static, *more = row["EA"].split("|")
    if not is_number(static):
        what = "is a Syrope model" if "syrope" in row["EA"].lower() else f"is the file {row['EA']}"
        raise InputError(f"line {row.line}: EA {what}, which is not read: give a number in its place.")
    found["axial_stiffness"] = number_of(static)
    found |= {"normal_drag": row.number("Cd", 0.0), "added_mass": row.number("Ca", 0.0)}
    found["tangential_drag"] = math.pi * row.number("CdAx", 0.0)
    if along := row.number("CaAx", 0.0):
        found["tangential_added_mass"] = along
    if more:
        # two springs in series, each with a damper: of both none acts next to the static stiffness
        note(
            row.line,
            f"EA = {row['EA']} with BA = {row.values.get('BA', '0')} is viscoelastic: of these the static "
            "stiffness, the first of EA, is taken, and damping = 0; for motions in waves put the dynamic one in "
            "its place",
        )
    else:
        _damping(row, found, tables, note)
    if not is_nothing(EI := row.values.get("EI", "0")):
        if is_number(EI):
            found["bending_stiffness"] = number_of(EI)
            note(row.line, f"EI = {EI} N m^2: such lines carry compression, and their ends on points are pinned")
        else:
            note(row.line, f"EI = {EI} is no single number, and is not read: bending_stiffness = 0")
    return found


def _damping(row: Row, found: dict[str, float], tables: Tables, note: Callable[..., Any]) -> None:
    text = row.values.get("BA", "0")
    if not is_number(text):
        note(row.line, f"BA = {text} is no single number, and is not read: damping = 0")
    elif number_of(text) > 0:
        columns, units = tables.columns["line types"][1], tables.units.get("line types", [])
        names = [column.lower() for column in columns]
        place = names.index("cintdamp") if "cintdamp" in names else None
        found["damping"] = number_of(text)
        if place is not None and not (place < len(units) and "pa" not in units[place].lower()):
            note(row.line, f"cIntDamp = {row['BA']} Pa s: damping is it times pi Diam^2/4")
            found["damping"] *= math.pi * row.number("diameter") ** 2 / 4
    elif number_of(text) < 0:
        note(
            row.line,
            f"BA = {text} is a share of critical damping of a segment: numerical, for explicit steps; damping = 0",
        )
