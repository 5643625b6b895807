"""Elements and steps of a scene, its excitation, and the scene with other settings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ..meshes import number_of_cells
from . import Scene, load_scene
from .cable import Top
from .lines import Body
from .quantities import number_of
from .sections import SCHEMES, Solver, Time

#: Default Newton tolerance.
NEWTON: float = Solver.model_fields["step_tolerance"].default


@dataclass(frozen=True)
class Space:
    """Degrees and number of elements; all 0 for a scene without cable."""

    mu: int = 0
    nu: int = 0
    cells: int = 0

    @property
    def pair(self) -> str:
        return f"P{self.mu}-P{self.nu}" if self.mu else "-"

    def __str__(self) -> str:
        return f"{self.pair}, {self.cells} elements, " if self.mu else ""


@dataclass(frozen=True)
class Stepping:
    """Scheme and step; with a tolerance, the first step, and the largest if it is not the default.

    newton: Newton's tolerance.
    """

    scheme: str
    step: float
    tolerance: float | None = None
    largest: float | None = None
    newton: float = NEWTON

    def __str__(self) -> str:
        size = f"dt {self.step:.4g} s" if self.tolerance is None else f"tolerance {self.tolerance:.2g}"
        return f"{SCHEMES[self.scheme]}, {size}" + (f", Newton {self.newton:.2g}" if self.newton != NEWTON else "")


def space_of(scene: Scene) -> Space:
    """The scene's own elements, over all lines of a network, which share their degrees."""
    sections = [piece.section for piece in scene.network.pieces]
    if not sections:
        return Space()
    c = sections[0]
    return Space(c.position_degree, c.tension_degree, sum(number_of_cells(c.elements) for c in sections))


def fitting(scene: Scene, space: Space) -> Space:
    """The space with a nearby number of elements that is divisible among the lines and segments in proportion."""
    total, parts = space_of(scene).cells, [piece.section.elements for piece in scene.network.pieces]
    cells = space.cells
    while True:  # the sum of the shares never falls as the number grows, so that this ends
        found = sum(number_of_cells(_share(elements, cells / total)) for elements in parts)
        if found == cells:
            return Space(space.mu, space.nu, cells)
        cells = found


def _share(elements: Any, factor: float) -> Any:
    """Elements of a line, scaled by a factor."""
    if isinstance(elements, int):
        return max(1, round(elements * factor))
    return [[length, max(1, round(n * factor))] for length, n in elements]


def stepping_of(scene: Scene) -> Stepping:
    """The scene's own scheme and step."""
    time = check_time(scene)
    return Stepping(time.scheme, time.step, time.tolerance, time.max_step, scene.solver.step_tolerance)


def largest_step(scene: Scene) -> float | None:
    """Largest step of an adaptive run of the scene [s]; None if the run has no length."""
    return check_time(scene).max_step or check_time(scene).end / 10 or None


def with_settings(scene: Scene, space: Space, stepping: Stepping) -> Scene:
    """The scene with these elements and steps; lines and their segments keep their share of the elements."""
    changes = {"time.scheme": stepping.scheme, "time.step": stepping.step, "time.tolerance": stepping.tolerance}
    changes["solver.step_tolerance"] = stepping.newton
    if stepping.tolerance is None:
        changes |= {"time.min_step": None, "time.max_step": None}
    else:
        changes |= {"time.max_step": check_time(scene).max_step or stepping.largest}
    if stepping.scheme != "generalized-alpha":
        changes["time.spectral_radius"] = None
    elif any(piece.section.slack != "compressive" for piece in scene.network.pieces):
        changes["time.spectral_radius"] = 0.0  # others gain energy at every snap and are not allowed in such a scene
    if space.mu:
        changes |= _of_lines(scene, space)
    return load_scene(scene, **changes)


def _of_lines(scene: Scene, space: Space) -> dict[str, Any]:
    """Changes of degrees and elements, by their keys."""
    changes, factor, keys = {}, space.cells / space_of(scene).cells, keys_of_lines(scene)
    for piece in scene.network.pieces:
        key, line = keys[piece.cable], scene.cables[piece.cable]
        place = f"{key}.segments.{piece.number}" if line.segments else key
        changes[f"{place}.elements"] = _share(piece.section.elements, factor)
        changes |= {f"{key}.position_degree": space.mu, f"{key}.tension_degree": space.nu}
    return changes


def keys_of_lines(scene: Scene) -> list[str]:
    """Key of the table of each cable: "cable" for the only one, else "cable.NAME"."""
    return [scene.network.key_of(number) for number in range(len(scene.network.cables))]


def everywhere(scene: Scene, key: str, value: Any) -> dict[str, Any]:
    """Changes that give a key of a cable, buoy or joint this value in all of them, by their keys.

    A cable's own key then replaces those of its segments and materials.
    """
    (section, _, leaf), lines = key.partition("."), keys_of_lines(scene)
    buoys = [scene.network.key_of_buoy(name) for name in scene.network.buoys]
    each = zip(lines, scene.cables, strict=True)
    segments = {f"{line}.segments.{k}": s for line, cable in each for k, s in enumerate(cable.segments or [])}
    if section == "cable":
        over = segments | {f"material.{name}": material for name, material in (scene.material or {}).items()}
        removed = [place for place, table in over.items() if leaf in type(table).model_fields]
        return {f"{place}.{leaf}": None for place in removed} | {f"{line}.{leaf}": value for line in lines}
    if section == "joint":
        held = [f"{place}.body" for place, segment in segments.items() if segment.body is not None]
        kept = held if leaf in Body.model_fields else []
        return {f"{place}.{leaf}": value for place in [*(f"joint.{j.name}" for j in scene.joint or []), *kept]}
    if section == "buoy" and leaf:
        return {f"{buoy}.{leaf}": value for buoy in buoys}
    if section in ("wind", "external_force"):
        return {key: value} | {f"{buoy}.{key}": value for buoy in buoys}
    return {key: value}


def period_of(scene: Scene) -> float | None:
    """Period of the scene's excitation."""
    if scene.waves:
        return scene.waves.main_period
    return next((top.period for top in _moved(scene) if top.period), None)


def ramp_of(scene: Scene) -> float:
    """Time over which the excitation grows."""
    if scene.waves:
        return scene.waves.ramp
    return max((top.ramp for top in _moved(scene)), default=0.0)


#: Recorded shapes per excitation period, for a replay; their least and largest number in any run.
FRAMES_OF_A_PERIOD, LEAST_FRAMES, MOST_FRAMES = 24, 200, 1200


def frame_interval(scene: Scene) -> float:
    """Time between two recorded shapes of the cables [s]: `time.output_every`, or as a replay needs."""
    time = check_time(scene)
    if time.output_every:
        return time.output_every
    dense = (period_of(scene) or math.inf) / FRAMES_OF_A_PERIOD
    return max(min(time.end / LEAST_FRAMES, max(dense, time.end / MOST_FRAMES)), time.step)


def _moved(scene: Scene) -> list[Top]:
    """Ends of lines that are moved or pulled."""
    return [end.top for piece in scene.network.pieces for end in piece.ends if end.top and end.kind != "fixed"]


def check_time(scene: Scene) -> Time:
    """Section [time] of a scene.  Raises InputError if the scene has none and cannot run."""
    if scene.time is None:
        raise InputError("time: must be given, a run needs at least its keys end and step.")
    return scene.time


def shortened(scene: Scene, end: float | None = None, periods: int = 2) -> Scene:
    """The scene until `end`: by default the ramp and some periods, or half of a run without excitation.

    An adaptive run keeps the milestones and largest step of the whole run.
    """
    time, period = check_time(scene), period_of(scene)
    if end is None:
        end = min(time.end, ramp_of(scene) + periods * period if period else time.end / 2)
    kept: dict[str, Any] = {"time.output_every": frame_interval(scene)}
    kept |= {"time.max_step": largest_step(scene)} if time.tolerance is not None else {}
    return load_scene(scene, **{"time.end": end}, **kept)


def spaces(
    scene: Scene, pairs: Sequence[tuple[int, int]] | None = None, cells: Sequence[int] | None = None
) -> list[Space]:
    """Pairs times numbers of elements; by default 1/4, 1/2 and all of the scene's elements."""
    if not scene.cable:
        return [Space()]
    n = space_of(scene).cells
    cells = cells or sorted({max(2, n // 4), max(2, n // 2), n})
    found = [fitting(scene, Space(mu, nu, k)) for mu, nu in pairs or ((1, 0), (2, 1), (3, 2)) for k in cells]
    return list(dict.fromkeys(found))


def parse_numbers(option: str, text: str | None, kind: type = float) -> list[Any] | None:
    """Positive numbers with commas, or `none`; raises InputError naming the option."""
    if text is None:
        return None
    try:
        found = [number_of(part) for part in text.split(",")] if text != "none" else []
    except ValueError:
        found = [-1]
    if kind is int:
        found = [int(number) if number == int(number) else -1 for number in found]
    if not all(0 < number < math.inf for number in found):
        raise InputError(f"{option} {text}: must be positive numbers with commas.")
    return found
