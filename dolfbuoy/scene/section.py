"""What all tables of a scene have in common, and how a key is described."""

from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """A table of the scene file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


def section_in(annotation) -> type[Section] | None:
    """The section that the type of a key holds: alone, optional, or in a list."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    return next(filter(None, map(section_in, get_args(annotation))), None)


def key(description: str, unit: str | None = None, default: Any = ...) -> Any:
    """A key of the scene: what it is, its unit ("1": none; None: no number), its default (none: the key is required).

    Its type says what values it takes; a key that holds a section is described by the section's docstring.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit} if unit else None)
