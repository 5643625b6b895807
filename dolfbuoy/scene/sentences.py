"""What pydantic finds wrong with a scene, as one sentence."""

from pydantic import ValidationError

from .sections import Scene, section_in


def sentence(error: ValidationError) -> str:
    """The first thing that is wrong, as one sentence with key, value and what is allowed."""
    first = error.errors()[0]
    location = [str(part) for part in first["loc"] if not _is_type_tag(part)]
    key, message = ".".join(location) or "scene", first["msg"]
    if first["type"] == "extra_forbidden":
        return f"Unknown key {key}; allowed here: {', '.join(_fields(location[:-1]))}."
    if first["type"] == "missing":
        return f"Missing key {key}."
    if first["type"] == "value_error":
        value = "" if isinstance(first["input"], dict) else f" = {first['input']!r}"
        return f"{key}{value}: {message.removeprefix('Value error, ')}."
    if first["type"] == "model_type":
        return f"{key} = {first['input']!r}: must be a section, a table of keys."
    unions = {"cable.elements": "or a list of [length, number] of segments, or a mesh file"}
    unions["current.profile"] = "or a table [[z, speed], ...]"
    if key in unions:
        message = f"{message} {unions[key]}"
    return f"{key} = {first['input']!r}: {message[0].lower()}{message[1:]}."


def _is_type_tag(part) -> bool:
    """Pydantic names the member of a union it tried; that is no key of the file."""
    return isinstance(part, str) and ("[" in part or "-" in part or part in ("int", "float", "constrained"))


def _fields(location) -> list[str]:
    """Keys of the section at a location."""
    model = Scene
    for name in location:
        info = model.model_fields.get(name)
        model = (info and section_in(info.annotation)) or model
    return sorted(model.model_fields)
