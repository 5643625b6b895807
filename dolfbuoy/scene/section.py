"""The base of all tables of a scene, and the description of a key."""

from collections.abc import Iterable
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from .quantities import Wrong


class Section(BaseModel):
    """A table of the scene file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True)

    def refuse(self, names: Iterable[str], allowed: str) -> None:
        """Raise Wrong for the first of these keys with a value other than its default."""
        for name in names:
            if (value := getattr(self, name)) != type(self).model_fields[name].default:
                raise Wrong(name, value, allowed)


def sections_in(annotation: Any) -> list[type[Section]]:
    """The sections in the type of a key: alone, optional, in a list, or one of several forms."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return list(dict.fromkeys(section for part in get_args(annotation) for section in sections_in(part)))


def holds_several(annotation: Any, kind: type = dict) -> bool:
    """True if a key holds a section for each name, or a list of sections (kind: dict, list)."""
    return get_origin(annotation) is kind or any(holds_several(part, kind) for part in get_args(annotation))


def unit_of(info: FieldInfo) -> str:
    """Unit of a key; empty if it is not a number."""
    return str(info.json_schema_extra.get("unit", "")) if isinstance(info.json_schema_extra, dict) else ""


def key(description: str, unit: str | None = None, default: Any = ...) -> Any:
    """A key of the scene: what it is, its unit ("1": none; None: no number), its default (none: the key is required).

    Its type is that of the values it takes; a key that holds a section is described by the section's docstring.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit} if unit else None)
