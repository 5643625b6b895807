"""Parameters of a scene by which results are differentiated."""

import functools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene import Scene
from ..scene.keys import Key, list_keys
from ..scene.library import material, resized, size_of, sizes_made
from ..scene.reading import names_in, varied

#: Sections on the solution of a scene, not its physics.
OF_THE_SOLUTION = ("time", "solver", "accuracy", "uncertain", "design")
#: Keys of the mesh, and others on which nothing depends smoothly.
NO_NUMBER = ("elements", "grading", "position_degree", "tension_degree", "seed", "components", "band", "fails_at")
#: Relative distance of the neighbours of a scene; the same for stiffnesses, whose effects are small compared with the
#: rounding errors of strain times stiffness.
NEAR, STIFF = 1e-4, 1e-3
#: The same for lengths where a line may land or come taut: no derivative exists across such a kink.
WITH_KINKS = 1e-6
#: The same in a run, one-sided: for time shifts, other large changes of the unknowns, and motions with kinks.
OF_PERIODS, ONE_SIDED, ALONG_KINKS = 1e-6, 3e-6, 1e-5


@dataclass(frozen=True)
class Parameter:
    """A number of a scene, an entry of a vector ("cable.top.amplitude.2"), or a vector as a whole.

    value: nan for a vector, which is varied by a factor.  scale: change of the value for x = 1; for a vector 1, as its
    unit.  distance: x of the neighbours on both sides.  near: x of the single neighbour used in a run whose start
    changes much, or in any run if `surely`; 0: none.
    """

    key: str
    unit: str
    value: float
    scale: float
    _names: tuple[str, tuple[int, ...]]
    _whole: Any
    distance: float = NEAR
    near: float = 0.0
    surely: bool = False

    def scene_at(self, scene: Scene, x: float) -> Scene:
        """The scene with a changed number.  Raises InputError if that is not a valid scene."""
        key, index = self._names
        if math.isnan(self.value):
            new = _times(self._whole, 1 + x)
        else:
            new = _replaced(self._whole, index, self.value + x * self.scale)
        try:
            return varied(scene, {key: new})
        except InputError as error:
            raise InputError(
                f"{self.key}: has no derivative here, where its neighbours are no scenes: {error}"
            ) from None


@dataclass(frozen=True)
class Size(Parameter):
    """The size of a library material [mm], which determines its other numbers: `material.NAME.size`."""

    def scene_at(self, scene: Scene, x: float) -> Scene:
        """As `Parameter.scene_at`."""
        name = resized(self._whole, self.value + x * self.scale)
        keys = material(name)
        return varied(scene, {self._names[0]: keys})

    def made(self, size: float, places: int) -> float:
        """Available size this many places above `size` (1: the next that is not smaller) or below it (-1)."""
        sizes = np.array([-math.inf, *sizes_made(self._whole), math.inf])
        above = int(np.searchsorted(sizes, size * (1 - 1e-6)))
        return float(sizes[np.clip(above + places - (places > 0), 0, len(sizes) - 1)])


def _size(scene: Scene, key: str) -> Size | None:
    """The Size of a key such as material.NAME.size, if that material is from the library."""
    head, _, last = key.rpartition(".")
    found = (scene.material or {}).get(head.removeprefix("material."))
    if last != "size" or found is None or found.catalogue is None:
        return None
    size = size_of(found.catalogue)
    return Size(key, "mm", size, size, (head, ()), found.catalogue)


def _times(value: Any, factor: float) -> Any:
    return [_times(item, factor) for item in value] if isinstance(value, list | tuple) else value * factor


def _replaced(value: Any, index: Sequence[int], new: float) -> Any:
    if not index:
        return new
    first, *rest = index
    return [_replaced(item, rest, new) if k == first else item for k, item in enumerate(value)]


def parameters_of(scene: Scene, by: Sequence[str] | None = None) -> list[Parameter]:
    """The Parameters of these keys, by default all numbers of the scene that are not zero.

    Raises InputError for a key that is not a number of the scene.
    """
    data = scene.to_dict()
    there = dict(_numbers(data))
    if by is None:
        smooth = {key: known for key in there if (known := _known(key)) and not _refused(key, known)}
        made = [_parameter(key, (), there[key], known) for key, known in smooth.items() if _counts(key, there[key])]
        return [one for one in _apart(scene, made) if _has_neighbours(scene, one)]
    found = _apart(scene, [_size(scene, key) or _named(there, key, data) for key in dict.fromkeys(by)])
    for one in found:
        for x in (-one.distance, one.distance):
            one.scene_at(scene, x)
    return found


def _apart(scene: Scene, parameters: list[Parameter]) -> list[Parameter]:
    """Parameters with suitable distances of their neighbours."""
    kinks = scene.seabed is not None or any(p.section.slack == "tension-only" for p in scene.network.pieces)

    def distances(one: Parameter) -> Parameter:
        of_length = one.unit == "m" or math.isnan(one.value)
        if one.key.endswith("axial_stiffness"):
            return replace(one, distance=STIFF)
        if ".hull." in one.key:  # a cylinder, whose neighbours are cones
            return one
        moves = one.key.startswith("waves.") or ".top." in one.key
        if kinks and of_length and not moves:  # a point must not land for one neighbour only
            return replace(one, distance=WITH_KINKS)
        if kinks:
            distance = WITH_KINKS if of_length else NEAR
            return replace(one, distance=distance, near=ALONG_KINKS if moves else NEAR, surely=True)
        return replace(one, near=OF_PERIODS if moves and one.unit == "s" else ONE_SIDED, surely=moves)

    return [distances(one) for one in parameters]


def _counts(key: str, value: Any) -> bool:
    """True if a number, or any entry of a vector or hull, is not zero."""
    if not isinstance(value, list | tuple):
        return bool(math.isfinite(value) and value)
    return any(map(bool, value)) and (_is_vector(value) or key.endswith(".hull"))


def _is_vector(value: Any) -> bool:
    return not any(isinstance(item, list | tuple) for item in value)


def _has_neighbours(scene: Scene, parameter: Parameter) -> bool:
    try:
        parameter.scene_at(scene, -parameter.distance)
        parameter.scene_at(scene, parameter.distance)
    except InputError:
        return False
    return True


def _named(there: dict[str, Any], name: str, data: dict[str, Any]) -> Parameter:
    parts = names_in(name, data)
    for count in range(len(parts), 0, -1):
        key, index = ".".join(parts[:count]), parts[count:]
        if key in there and all(part.isascii() and part.isdigit() for part in index):
            break
    else:
        near = [key for key in there if key.rpartition(".")[2] == parts[-1]] or get_close_matches(name, there, 5, 0.0)
        raise InputError(f"--by {name}: is no number of this scene; near it are {', '.join(near)}.")
    known = _known(key)
    if known is None or (why := _refused(key, known)):
        raise InputError(
            f"--by {name}: {why if known else 'is no physical number'}, so that nothing has a derivative by it."
        )
    try:
        return _parameter(key, tuple(map(int, index)), there[key], known)
    except (IndexError, TypeError):
        raise InputError(f"--by {name}: {key} = {there[key]} has no such entry.") from None


def _parameter(key: str, index: tuple[int, ...], whole: Any, known: Key) -> Parameter:
    value = whole
    for place in index:
        value = value[place]
    name = ".".join([key, *map(str, index)])
    if isinstance(value, list | tuple):
        if index or not _counts(key, value):
            raise InputError(f"--by {name}: is no number, but {value}; name one of its entries, {name}.0 and so on.")
        return Parameter(name, "1", math.nan, 1.0, (key, index), _floats(whole))
    if not math.isfinite(value):
        raise InputError(f"--by {name}: is {value}, and nothing has a derivative by it.")
    return Parameter(name, known.unit, float(value), abs(value) or 1.0, (key, index), whole)


def _floats(value: Any) -> Any:
    return [_floats(item) for item in value] if isinstance(value, list | tuple) else float(value)


def _numbers(data: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, value) of all numbers and lists of numbers; tables in a list by name, else by index."""
    for name, value in data.items():
        key = f"{above}.{name}" if above else name
        if isinstance(value, dict):
            yield from _numbers(value, key)
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for place, item in enumerate(value):
                yield from _numbers(item, f"{key}.{item.get('name', place)}")
        elif _all_numbers(value):
            yield key, value


def _all_numbers(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return bool(value) and all(map(_all_numbers, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _known(key: str) -> Key | None:
    """The Key of a dotted name, without the names of tables."""
    return next((one for pattern, one in _patterns() if pattern.fullmatch(key)), None)


@functools.cache
def _patterns() -> list[tuple[re.Pattern[str], Key]]:
    """A pattern for each key of the language, with an optional name or number after each table."""
    found = []
    for one in list_keys():
        *sections, last = one.name.split(".")
        text = "".join(rf"{'[^.]+' if part == 'NAME' else re.escape(part)}\.(?:[^.]+\.)??" for part in sections)
        found.append((re.compile(text + re.escape(last)), one))
    return found


def _refused(key: str, known: Key) -> str:
    """Reason why there is no derivative by this key; empty if there is one."""
    section, last = key.partition(".")[0], key.rpartition(".")[2]
    if section in OF_THE_SOLUTION:
        return f"belongs to [{section}], which says how the scene is computed"
    if last in NO_NUMBER or not known.unit or known.range.startswith("whole number"):
        return "is not a physical number"
    return ""
