"""A folder of results: which process writes in it, and which of its files belong to the program.

`.dolfbuoy.json` lists, separately for each kind of result, the scene's digest, the command, and the files written. Only
these are ever replaced or removed; all other files in the folder are the user's.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..elsewhere import MPI
from ..errors import InputError
from ..parallel.ranks import bcast
from ..scene import load_scene
from ..writing import replacing, write_text
from . import checkpoint
from .record import save, verify

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene

MANIFEST, LOCK = ".dolfbuoy.json", ".dolfbuoy.lock"
#: Files of each kind of result, the record first; a run has figures too.
FILES: dict[str, tuple[str, ...]] = {"run": ("results.nc", "scene.toml", checkpoint.NAME)}
_WITHOUT_RUN = (
    "static",
    "modes",
    "stiffness",
    "offsets",
    "response",
    "periodic",
    "sensitivity",
    "uncertain",
    "calibrate",
    "design",
)
FILES |= {kind: (f"{kind}.nc", f"{kind}.toml") for kind in _WITHOUT_RUN}
FILES["sweep"] = ("sweep.nc", "sweep.png", "sweep.svg", "sweep.html")
FILES["study"] = ("tables.md", "report.md", "hard-cases.md")
DRAWN = ("figures", "paraview")
#: Files that a manifest may list; one that lists others is rejected, so that no file of the user's is ever removed.
_OWN = re.compile(
    "|".join(re.escape(name) for names in FILES.values() for name in names)
    + r"|(figures|paraview)/\w+\.\w+|(page|modes|work-precision|report)\.html|(calibrated|designed)\.toml"
    + r"|[\w-]+\.(csv|json|png|svg)"
)


@contextmanager
def claimed(path: str | Path, comm: Any = MPI.COMM_SELF, shared: bool = False) -> Iterator[None]:
    """Make a folder and lock it, so that only this process, or group of ranks, writes in it.

    Collective; rank 0 holds the lock, which ends with its process.  shared: others that share it may write too. Raises
    InputError if the folder is locked by another, or not writable.
    """
    with _agreed(comm) as root:
        lock = _lock(Path(path), shared) if root else None
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


@contextmanager
def _agreed(comm: Any) -> Iterator[bool]:
    """A block that yields True on rank 0; an InputError raised in it is raised on all ranks."""
    error = None
    try:
        yield comm.rank == 0
    except InputError as refused:
        error = refused
    error = bcast(comm, error)
    if error is not None:
        raise error


def _lock(path: Path, shared: bool) -> int:
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = os.open(path / LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    except FileExistsError:
        raise InputError(f"{path} cannot hold results: it is a file, and must be a folder.") from None
    except OSError as error:
        raise InputError(f"{path} cannot hold results: {error.strerror}; take another folder.") from None
    try:
        fcntl.flock(lock, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise InputError(f"{path} is in use by another run: wait for its end, or take another folder.") from None
    except OSError:
        pass  # a file system without locks
    return lock


def holds(path: str | Path, kind: str, scene: Scene, overwrite: bool = False, comm: Any = MPI.COMM_SELF) -> bool:
    """True if the folder already holds the finished result of this scene; collective.

    kind: a key of FILES.  Raises InputError if other results or a file of the user's would be replaced; overwrite
    allows the former, never the latter.
    """
    found = False
    with _agreed(comm) as root:
        if root:
            found = _holds(Path(path), kind, scene, overwrite)
    return bool(bcast(comm, found))


def _holds(path: Path, kind: str, scene: Scene, overwrite: bool) -> bool:
    entry = _manifest(path).get(kind, {})
    record = path / FILES[kind][0]
    listed = record.name in entry.get("files", ()) and record.exists()
    same = listed and digest(scene) in (entry.get("scene"), entry.get("requested")) and not entry.get("session")
    if same and entry.get("finished") and not overwrite:
        return True
    for name in FILES[kind]:
        _check_own(path, name, entry)
    if overwrite or not listed:
        return False
    if not same:
        raise InputError(
            f"{path} holds the results of another scene: take another folder, or replace them with --overwrite."
        )
    if can_resume(path, scene):
        raise InputError(
            f"{path} holds a run of this scene that was stopped: dolfbuoy run --resume {shlex.quote(str(path))} "
            "goes on with it, --overwrite begins anew."
        )
    return False


def _check_own(path: Path, name: str, entry: dict[str, Any]) -> None:
    """Raise InputError if a file that is not the program's, or an edited scene, would be replaced."""
    file = path / name
    if not os.path.lexists(file):
        return
    own = name in entry.get("files", ()) and (file.is_file() or file.is_symlink())
    if own and (file.suffix != ".toml" or hashlib.sha256(file.read_bytes()).hexdigest() == entry.get("scene")):
        return
    raise InputError(
        f"{file} would be replaced, and dolfbuoy did not write it as it is: move it away, or take another folder."
    )


def digest(scene: Scene) -> str:
    """SHA-256 of the complete scene as text."""
    return hashlib.sha256(scene.to_toml().encode()).hexdigest()


def begin(path: str | Path, kind: str, scene: Scene) -> None:
    """Remove the previous result of this kind, list the new one, and write its scene.  Raises OSError."""
    path = Path(path)
    manifest = _manifest(path)
    for name in manifest.get(kind, {}).get("files", ()):
        if (path / name).parent == path or not (path / name).parent.is_symlink():  # a link leads out of the folder
            (path / name).unlink(missing_ok=True)
    for name in DRAWN:
        with suppress(OSError):  # missing, or holds files of the user's
            (path / name).rmdir()
    _note(path, manifest, kind, scene, FILES[kind])
    _save_scene(path, kind, scene)


def go_on(path: str | Path, scene: Scene, comm: Any = MPI.COMM_SELF) -> None:
    """Record in the manifest that a run is resumed, possibly to a new end; collective.

    Raises InputError for a damaged record, or if an edited scene would be replaced.
    """
    path = Path(path)
    comm.barrier()  # all ranks have read the old scene
    with _agreed(comm) as root:
        if root:
            verify(path / "results.nc")
            manifest = _manifest(path)
            entry = manifest.get("run", {})
            if load_scene(path / "scene.toml") != scene:
                if "scene" in entry:
                    _check_own(path, "scene.toml", entry)
                _save_scene(path, "run", scene)
            _note(path, manifest, "run", scene, (*FILES["run"], *entry.get("files", ())))


def finish(path: str | Path, kind: str, requested: Scene | None = None) -> None:
    """Mark a result as complete; requested: the scene requested, if it differs from that of the result."""
    manifest = _manifest(Path(path))
    manifest[kind]["finished"] = True
    if requested is not None:
        manifest[kind]["requested"] = digest(requested)
    _write(Path(path), manifest)


def keep(path: str | Path, kind: str, scene: Scene, dataset: xr.Dataset, comm: Any = MPI.COMM_SELF) -> None:
    """Write a result at once, replacing the previous one of its kind; collective, saved by rank 0.

    Raises InputError if a file of the user's would be replaced, and OSError.
    """
    with claimed(path, comm):
        holds(path, kind, scene, True, comm)
        if comm.rank == 0:
            begin(path, kind, scene)
            save(dataset, Path(path) / FILES[kind][0])
            finish(path, kind)


def make_ready(path: str | Path, kind: str, scene: Scene, comm: Any = MPI.COMM_SELF) -> None:
    """Check before the work that `keep` will be able to write to the path, if any; collective.

    Raises InputError if the folder cannot be made or is in use, or if a file of the user's would be replaced.
    """
    if path is not None:
        with claimed(path, comm):
            holds(path, kind, scene, True, comm)


def enlist(path: str | Path, files: Iterable[Path], kind: str = "run", comm: Any = MPI.COMM_SELF) -> None:
    """List files about to be written; collective.  Raises InputError if one exists and is the user's."""
    path = Path(path)
    with _agreed(comm) as root:
        if root:
            manifest = _manifest(path)
            entry = manifest.setdefault(kind, {"files": []})
            names = [file.relative_to(path).as_posix() for file in files]
            for name in names:
                _check_own(path, name, entry)
            entry["files"] = list(dict.fromkeys([*entry["files"], *names]))
            _write(path, manifest)


def refuse_own(path: str | Path, names: Iterable[str], kind: str, comm: Any = MPI.COMM_SELF) -> None:
    """Raise InputError, before the work, if one of these files exists and is the user's; collective."""
    with _agreed(comm) as root:
        for name in names if root else ():
            _check_own(Path(path), name, _manifest(Path(path)).get(kind, {}))


def remark(path: str | Path, kind: str, **facts: Any) -> None:
    """Add facts about a result to the manifest, kept until the result is replaced."""
    manifest = _manifest(Path(path))
    manifest[kind] |= facts
    _write(Path(path), manifest)


def remarks(path: str | Path, kind: str) -> dict[str, Any]:
    """The manifest's entry, with the facts of `remark`; empty if there is none."""
    found: dict[str, Any] = _manifest(Path(path)).get(kind, {})
    return found


def can_resume(path: str | Path, scene: Scene) -> bool:
    """True if the folder holds a checkpoint of a run of this scene."""
    entry = _manifest(Path(path)).get("run", {})
    mine = entry.get("scene") == digest(scene) and not entry.get("session")
    return mine and all((Path(path) / name).is_file() for name in FILES["run"])


def is_edited(path: str | Path, scene: Scene) -> bool:
    """True if the scene in a folder is known to differ from that of its run."""
    written = _manifest(Path(path)).get("run", {}).get("scene")
    return written is not None and written != digest(scene)


def _note(path: Path, manifest: dict[str, Any], kind: str, scene: Scene, files: Iterable[str]) -> None:
    command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
    entry = {"scene": digest(scene), "command": command, "finished": False, "files": list(dict.fromkeys(files))}
    _write(path, manifest | {kind: entry})


def _save_scene(path: Path, kind: str, scene: Scene) -> None:
    with replacing(path / FILES[kind][1]) as part:
        scene.save(part)


def _write(path: Path, manifest: dict[str, Any]) -> None:
    write_text(path / MANIFEST, json.dumps(manifest, indent=1))


def _manifest(path: Path) -> dict[str, Any]:
    """Entries of the manifest by kind; empty if there is no manifest.  Raises InputError for a damaged one."""
    file = path / MANIFEST
    try:
        if file.exists() and not file.is_file():
            raise ValueError("a pipe would be read for ever")
        manifest: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        lists = [entry.get("files") for entry in manifest.values()]
        good = manifest.keys() <= FILES.keys() and all(
            isinstance(files, list) and all(isinstance(name, str) and _OWN.fullmatch(name) for name in files)
            for files in lists
        )
    except FileNotFoundError:
        return {}
    except (ValueError, AttributeError, RecursionError):
        good = False
    if not good:
        raise InputError(f"{file}, the list of what is dolfbuoy's in this folder, is damaged: take another folder.")
    return manifest
