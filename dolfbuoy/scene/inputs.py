"""A scene in words: every value that differs from its default, by section."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from .floats import SOURCE as SOURCE_OF_FLOATS
from .floats import float_of
from .section import Section, unit_of
from .sections import Scene
from .shapes import BY_SHAPE, SOURCE

#: Top-level keys shown in the heading of a page or report.
OF_REPORTS = ("title", "project", "author", "revision")
#: Numbers from which digits are grouped.
MANY = 1e4
#: Longest list whose numbers are shown; for a longer one, only the count.
MOST_NUMBERS = 12


class Input(NamedTuple):
    """A value as text: its section ("cable.top", "joint.clump"), meaning, value and unit ("" without one)."""

    section: str
    meaning: str
    value: str
    unit: str


def inputs_of(scene: Scene) -> list[Input]:
    """The values of a scene that differ from their defaults, in the order of the scene file."""
    return [*_within(scene, ""), *_by_shape(scene)]


def _by_shape(scene: Scene) -> Iterator[Input]:
    """Values of coefficients given by shape, with their source."""
    for given, buoy in zip(scene.buoys, scene.network.buoys.values(), strict=True):
        for name in (*BY_SHAPE, "wave_damping"):
            if isinstance(getattr(given, name), str):
                unit = unit_of(type(buoy).model_fields[name])
                value = _text([float(f"{x:.4g}") for x in buoy.wave_damping or ()]) if unit != "1" else ""
                text = value or _text(float(f"{getattr(buoy, name):.4g}"))
                yield Input("buoy", f"{name.replace('_', ' ')}: {SOURCE}", text, "" if unit == "1" else unit)


def _within(section: Section, path: str) -> Iterator[Input]:
    inner, resolved = [], getattr(section, "resolved", type(section)).model_fields  # its defaults hold
    for name, info in type(section).model_fields.items():
        value, stands = getattr(section, name), resolved.get(name, info)
        if value is None or value in (info.default, stands.default) or (not path and name in OF_REPORTS):
            continue
        here = f"{path}.{name}".strip(".")
        if parts := _sections(value):
            inner += [(part, f"{here}.{label}" if label else here) for label, part in parts.items()]
        elif info.description and name != "name":
            unit = unit_of(info)
            plain = unit == "1" or isinstance(value, str) or ("," in unit and isinstance(value, int | float))
            yield Input(path, info.description.partition(";")[0], _text(value), "" if plain else unit)
    if "float" in type(section).model_fields and (called := float_of(section)):
        yield Input(path, f"mooring float: {SOURCE_OF_FLOATS}", called, "")
    for part, here in inner:
        yield from _within(part, here)


def _sections(value: Any) -> dict[str, Section]:
    """Sections in a value by name; a single one needs no name."""
    if isinstance(value, Section):
        return {"": value}
    if isinstance(value, dict):
        return {name: part for name, part in value.items() if isinstance(part, Section)}
    if isinstance(value, list | tuple) and value and isinstance(value[0], Section):
        alone = len(value) == 1
        return {"" if alone else getattr(part, "name", None) or str(k + 1): part for k, part in enumerate(value)}
    return {}


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        count = sum(len(row) if isinstance(row, list | tuple) else 1 for row in value)
        return f"{len(value)} rows" if count > MOST_NUMBERS else f"[{', '.join(map(_text, value))}]"
    if isinstance(value, dict):
        return ", ".join(f"{name} = {_text(one)}" for name, one in value.items())
    if isinstance(value, int | float) and MANY <= abs(value) < 1e15:
        return f"{float(f'{value:.6g}'):,.0f}"  # 66,953,600: the exponent of 6.69536e+07 is easily missed
    return f"{value:g}" if isinstance(value, int | float) else str(value)
