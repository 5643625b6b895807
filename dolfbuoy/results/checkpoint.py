"""Checkpoints, from which a run resumes: one file next to its record, replaced in one atomic step.

The record is written first, so that if the run is killed at any moment the record reaches at least to the checkpoint;
anything beyond it is cut off and computed again.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import Scene, kept_scene, load_scene
from ..writing import replacing
from .record import undamaged

FORMAT = 5  #: raised together with that of the record
NAME = "checkpoint.npz"


@dataclass
class Checkpoint:
    """A resumable run of `scene` in `folder`: the states of all ranks, and the length of the record."""

    folder: Path
    scene: Scene
    states: list[dict[str, Any]]
    rows: dict[str, int]
    next_frame: float

    @property
    def t(self) -> float:
        """Time reached [s]."""
        return float(self.states[0]["t"])

    @property
    def complete(self) -> bool:
        """True if nothing is left to do."""
        time: Any = self.scene.time
        return bool(self.t >= time.end - 1e-9 * time.step)


def write(point: Checkpoint) -> None:
    """Write a checkpoint to disk.  Raises OSError with the file's name."""
    tree = {name: getattr(point, name) for name in ("states", "rows", "next_frame")}
    tree |= {"format": FORMAT, "scene": point.scene.to_toml()}
    with replacing(point.folder / NAME) as part, open(part, "wb") as file:
        np.savez(file, **_flatten(tree))


def load(folder: str | Path, ranks: int, end: float | None = None) -> Checkpoint:
    """The checkpoint of a run on this number of ranks.

    end: new end of the run [s], not before the time reached.  Raises InputError if there is no run, or a different one.
    """
    folder = Path(folder)
    for name in ("scene.toml", "results.nc", NAME):
        if not (folder / name).is_file():
            raise InputError(f"{folder} holds no run that can be resumed: it has no {name}.")
    tree = _read(folder / NAME)
    if len(tree["states"]) != ranks:
        raise InputError(f"{folder} holds a run on {len(tree['states'])} MPI ranks; it cannot be resumed on {ranks}.")
    scene = read_scene(folder, end)
    difference = _difference(tree["scene"].to_dict(), scene.to_dict())
    if difference:
        raise InputError(f"{folder / 'scene.toml'} is no longer the scene of the run: {difference} is different.")
    point = Checkpoint(folder, scene, tree["states"], tree["rows"], tree["next_frame"])
    time: Any = scene.time
    if end is not None and end < point.t - 1e-9 * time.step:
        raise InputError(f"time.end = {end:g}: the run has reached t = {point.t:g} s already.")
    return point


def read_scene(folder: Path, end: float | None = None) -> Scene:
    """The scene of the run in a folder, optionally with a new end [s].  Raises InputError for a damaged file."""
    file = folder / "scene.toml"
    try:
        scene = load_scene(file)
    except InputError as error:
        reason = str(error).removeprefix(f"Scene file {file} ").rstrip(".")
        raise InputError(
            f"{file} is damaged: {reason}; restore it, or compute the run again in another folder."
        ) from None
    return scene if end is None else load_scene(scene, **{"time.end": end})


def _read(path: Path) -> dict[str, Any]:
    otherwise = "is damaged, or not a checkpoint: the run can only begin anew, with --overwrite."
    with undamaged(path, otherwise), open(path, "rb") as file, np.load(file) as leaves:
        tree: dict[str, Any] = _unflatten(dict(leaves))
        number = tree["format"]
        if number == FORMAT:
            kept = {name: tree[name] for name in ("states", "rows", "next_frame")}
            tree = kept | {"scene": kept_scene(tree["scene"])}
            if not min(tree["rows"][axis] for axis in ("time", "frame")) >= 0 <= min(s["t"] for s in tree["states"]):
                raise ValueError("times and numbers of rows are not negative")
    if number != FORMAT:
        raise InputError(
            f"{path} has format {number}, and this version resumes format {FORMAT} only, whose records have the "
            "extremes of every step: the run can only begin anew, with --overwrite."
        )
    return tree


def _flatten(tree: Any, path: str = "") -> dict[str, NDArray[Any]]:
    """Nested dicts and lists -> {"a/0/b": array}; None is left out."""
    if tree is None:
        return {}
    if not isinstance(tree, dict | list):
        return {path: np.asarray(tree)}
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    prefix = f"{path}/" if path else ""
    return {name: leaf for key, item in items for name, leaf in _flatten(item, f"{prefix}{key}").items()}


def _unflatten(leaves: dict[str, NDArray[Any]]) -> Any:
    """Inverse of _flatten; a dict with numbers as keys becomes a list, a 0-d array a number or text."""
    tree: dict[str, Any] = {}
    for path, leaf in leaves.items():
        *branches, last = path.split("/")
        node = tree
        for key in branches:
            node = node.setdefault(key, {})
        node[last] = leaf if leaf.ndim else leaf.item()
    return _with_lists(tree)


def _with_lists(node: Any) -> Any:
    if not isinstance(node, dict):
        return node
    if node and all(key.isdigit() for key in node):
        return [_with_lists(node[str(i)]) for i in range(len(node))]
    return {key: _with_lists(item) for key, item in node.items()}


def _difference(a: Any, b: Any, path: str = "") -> str | None:
    """Key of the first value in which two scenes differ, or None; the end of the run may differ."""
    if not (isinstance(a, dict) and isinstance(b, dict)):
        return None if a == b or path == "time.end" else path
    prefix = f"{path}." if path else ""
    found = (_difference(a.get(key), b.get(key), f"{prefix}{key}") for key in sorted({*a, *b}))
    return next((key for key in found if key), None)
