"""What all tables of a scene have in common, and how a key is described."""

from typing import Any, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """A table of the scene file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True)


def sections_in(annotation) -> list[type[Section]]:
    """The sections that the type of a key holds: alone, optional, in a list, or one of several forms."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return list(dict.fromkeys(section for part in get_args(annotation) for section in sections_in(part)))


def section_in(annotation) -> type[Section] | None:
    """The first of them."""
    return next(iter(sections_in(annotation)), None)


def is_by_name(annotation) -> bool:
    """Whether a key holds a section for each name."""
    return get_origin(annotation) is dict or any(is_by_name(part) for part in get_args(annotation))


def key(description: str, unit: str | None = None, default: Any = ...) -> Any:
    """A key of the scene: what it is, its unit ("1": none; None: no number), its default (none: the key is required).

    Its type says what values it takes; a key that holds a section is described by the section's docstring.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit} if unit else None)
