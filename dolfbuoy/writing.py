"""Writing of files: in a fresh file next to their place, which takes it at the end in one atomic step.

So a file is always whole, the old or the new one, and no link that a stranger has prepared in a folder is followed.
"""

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from .errors import InputError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Name of a fresh file beside `path` that takes its place at the end.

    Raises OSError with `path` and the system's reason when it cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    try:
        part.unlink(missing_ok=True)  # of a process that was killed, or a link
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666))
        try:
            yield part
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, os.strerror(error.errno or errno.EIO), str(path)) from error
    except RuntimeError as error:  # netCDF4, for whatever HDF5 runs into
        raise OSError(errno.EIO, str(error), str(path)) from error


def write_text(path: str | Path, text: str) -> None:
    """Write a text file.  Raises OSError."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def appending(path: str | Path) -> BinaryIO:
    """A file, open for what is added at its end.  Raises OSError, for a link too."""
    return os.fdopen(os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o666), "ab")


def made(folder: str | Path, *names: str) -> Path:
    """A folder, and folders within each other below it, made if they are not there; returns the last.

    Raises InputError if one of `names` is a link, OSError.
    """
    path = Path(folder)
    path.mkdir(parents=True, exist_ok=True)
    for name in names:
        path = path / name
        refuse_link(path)
        path.mkdir(exist_ok=True)
    return path


#: What to do about a link among the folders that no option has named.
GIVEN = "give --out to write there"


def refuse_link(path: str | Path, instead: str = "remove it, or take another folder") -> None:
    """Raise InputError for a folder or file that is a link."""
    if os.path.islink(path):
        raise InputError(f"{path} is a link, and nothing is written through it: {instead}.")


def refuse_present(files: Iterable[Path], overwrite: bool = False) -> None:
    """Raise InputError if one of the files is there already, unless they may be overwritten."""
    found = next((file for file in files if os.path.lexists(file)), None)
    if found is not None and not overwrite:
        raise InputError(f"{found} would be replaced: move it away, take another name, or give --overwrite.")
