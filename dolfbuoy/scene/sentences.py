"""What pydantic finds wrong with a scene, as one sentence."""

from pydantic import ValidationError

from .quantities import Wrong
from .section import section_in
from .sections import Scene

#: What else a key takes, where the message speaks only of its numbers.
_OR = {
    "cable.elements": "or a list of [length, number] of segments, or a mesh file",
    "current.profile": "or a table [[z, speed], ...]",
}
_LONGEST = 200  # characters of a value


def sentence(error: ValidationError) -> str:
    """The first thing that is wrong, as one sentence with key, value and what is allowed."""
    first = error.errors()[0]
    unknown = first["type"] == "extra_forbidden"
    location = [str(part) for part in first["loc"] if unknown or not _is_type_tag(part)]
    key, message = ".".join(location) or "scene", first["msg"].replace(" after validation", "")
    if unknown:
        return (
            f"Unknown key {_short('.'.join(location)) or repr('')}; allowed here: {', '.join(_fields(location[:-1]))}."
        )
    if first["type"] == "missing":
        return f"Missing key {key}."
    if first["type"] == "value_error":
        cause = first["ctx"]["error"]
        if isinstance(cause, Wrong):
            return f"{'.'.join([*location, cause.key])} = {shown(cause.value)}: {cause.allowed}."
        value = "" if isinstance(first["input"], dict) else f" = {shown(first['input'])}"
        return f"{key}{value}: {message.removeprefix('Value error, ')}."
    if first["type"] == "model_type":
        return f"{key} = {shown(first['input'])}: must be a section, a table of keys."
    if key in _OR:
        message = f"{message} {_OR[key]}"
    return f"{key} = {shown(first['input'])}: {message[0].lower()}{message[1:]}."


def shown(value) -> str:
    """A value as it stands in a message: at most some lines of it."""
    try:
        return _short(repr(value))
    except (RecursionError, ValueError):  # nested without end; a whole number of thousands of digits
        return f"({type(value).__name__})"


def _short(text):
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _is_type_tag(part) -> bool:
    """Pydantic names the member of a union it tried; that is no key of the file."""
    return isinstance(part, str) and (
        "[" in part or part.startswith("constrained") or part in ("int", "float", "bool", "str")
    )


def _fields(location) -> list[str]:
    """Keys of the section at a location."""
    model = Scene
    for name in location:
        info = model.model_fields.get(name)
        model = (info and section_in(info.annotation)) or model
    return sorted(model.model_fields)
