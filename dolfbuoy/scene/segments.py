"""Segments of a line with all keys: their own, and those of the line, materials and the library."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import ValidationError

from .cable import Cable
from .library import FORMS
from .lines import PHYSICAL, SHARED, SIZE, Line, Material, Segment
from .quantities import Missing, Wrong
from .section import Section, unit_of


def sections_of(line: Line, materials: Mapping[str, Material], key: str) -> list[Cable]:
    """A section [cable] for each segment of a cable: its own keys, else those of its material, else of the cable.

    key: of the cable, for messages.  Raises Wrong or Missing.
    """
    own = _over(_material(line, materials, key), _given(line, (*PHYSICAL, *SHARED)))
    if line.segments is None:
        return [_section(own | _given(line, SIZE), key)]
    found = []
    for k, segment in enumerate(line.segments):
        place = f"{key}.segments.{k}"
        keys = _over(own, _material(segment, materials, place))
        found.append(_section(_over(keys, _given(segment, (*SIZE, *PHYSICAL))), place))
    return found


def _over(keys: dict[str, Any], nearer: dict[str, Any]) -> dict[str, Any]:
    """Keys overridden by more specific ones; if these make a piece inextensible, its damping is dropped."""
    if math.isinf(nearer.get("axial_stiffness", 0.0)) and "damping" not in nearer:
        keys = {name: value for name, value in keys.items() if name != "damping"}
    return keys | nearer


def _given(section: Section, names: Iterable[str]) -> dict[str, Any]:
    return {name: value for name in names if (value := getattr(section, name, None)) is not None}


def _material(piece: Line | Segment, materials: Mapping[str, Material], key: str) -> dict[str, Any]:
    if piece.material is None:
        return {}
    if piece.material not in materials:
        known = ", ".join(materials) or "there is none"
        allowed = f"must be the name of a [material.NAME]: {known}; or one of the library, like {FORMS}"
        raise Wrong(f"{key}.material", piece.material, allowed)
    return _given(materials[piece.material], PHYSICAL)


def _section(keys: dict[str, Any], place: str) -> Cable:
    try:
        return Cable.model_validate(keys)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join([place, *map(str, first["loc"])])
        cause = first.get("ctx", {}).get("error")
        if first["type"] == "missing":
            info = Cable.model_fields[str(first["loc"][0])]
            raise Missing(where, f"{info.description} [{unit_of(info)}]") from None
        if isinstance(cause, Wrong):
            raise Wrong(f"{where}.{cause.key}", cause.value, cause.allowed) from None
        raise Wrong(where, first["input"], first["msg"]) from None
