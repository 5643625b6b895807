"""Keys of a network's sections, and one key of all its lines, buoys or bodies at once."""


def keys_of_lines(scene) -> list[str]:
    """Key of each section of a cable: "cable", or "cable.NAME" in a list."""
    return _keys("cable", scene.cable)


def _keys(section, value):
    if isinstance(value, list):
        return [f"{section}.{table.name or number}" for number, table in enumerate(value)]
    return [] if value is None else [section]


def everywhere(scene, key: str, value) -> dict:
    """Changes that give a key of the one cable, buoy or joint this value in all of a network, by their keys.

    A cable's own key then stands for those of its segments and materials.
    """
    section, _, leaf = key.partition(".")
    if not scene.is_network:
        return {key: value}
    if section == "cable":
        return _of_lines(scene, leaf, value)
    if section == "joint":
        return {f"{place}.{leaf}": value for place in _bodies(scene)}
    if section == "buoy" and leaf:
        return {f"{buoy}.{leaf}": value for buoy in _keys("buoy", scene.buoy)}
    if section in ("wind", "external_force") and isinstance(scene.buoy, list):
        return {key: value} | {f"{buoy}.{key}": value for buoy in _keys("buoy", scene.buoy)}
    return {key: value}


def _of_lines(scene, leaf, value):
    removed = [place for place, _ in _segments(scene)] + [f"material.{name}" for name in scene.material or {}]
    given = {f"{line}.{leaf}": value for line in keys_of_lines(scene)}
    return {f"{place}.{leaf}": None for place in removed} | given


def _bodies(scene):
    """Keys of all bodies at joints."""
    held = [f"{place}.body" for place, segment in _segments(scene) if segment.body is not None]
    return [f"joint.{joint.name}" for joint in scene.joint or []] + held


def _segments(scene):
    """[(key, section), ...] of all segments."""
    lines = zip(keys_of_lines(scene), scene.cables, strict=True)
    return [(f"{key}.segments.{k}", s) for key, c in lines for k, s in enumerate(getattr(c, "segments", None) or [])]
