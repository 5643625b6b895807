"""One key of all lines, buoys or bodies of a scene at once."""


def keys_of_lines(scene) -> list[str]:
    """Key of the table of each cable: "cable" of the only one, else "cable.NAME"."""
    return [scene.network.key_of(number) for number in range(len(scene.network.cables))]


def keys_of_buoys(scene) -> list[str]:
    """Key of the table of each buoy: "buoy" of the only one, else "buoy.NAME"."""
    return [scene.network.key_of_buoy(name) for name in scene.network.buoys]


def everywhere(scene, key: str, value) -> dict:
    """Changes that give a key of a cable, buoy or joint this value in all of them, by their keys.

    A cable's own key then stands for those of its segments and materials.
    """
    section, _, leaf = key.partition(".")
    if section == "cable":
        return _of_lines(scene, leaf, value)
    if section == "joint":
        return {f"{place}.{leaf}": value for place in _bodies(scene)}
    if section == "buoy" and leaf:
        return {f"{buoy}.{leaf}": value for buoy in keys_of_buoys(scene)}
    if section in ("wind", "external_force"):
        return {key: value} | {f"{buoy}.{key}": value for buoy in keys_of_buoys(scene)}
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
    return [(f"{key}.segments.{k}", s) for key, c in lines for k, s in enumerate(c.segments or [])]
