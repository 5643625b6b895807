"""Atomic writing of files: a new file beside the target is written and finally renamed to it.

So a file is always complete, the old or the new one, and no link prepared by others in a folder is followed.
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
    """Name of a new file beside `path` that replaces it at the end.

    Raises OSError with `path` and the system's reason if it cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    try:
        part.unlink(missing_ok=True)  # left by a killed process, or a link
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666))
        try:
            yield part
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise OSError(error.errno, os.strerror(error.errno or errno.EIO), str(path)) from error
    except RuntimeError as error:  # netCDF4, for any HDF5 error
        raise OSError(errno.EIO, str(error), str(path)) from error


def write_text(path: str | Path, text: str) -> None:
    """Write a text file.  Raises OSError."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def appending(path: str | Path) -> BinaryIO:
    """A file opened for appending.  Raises OSError, for a link too."""
    return os.fdopen(os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o666), "ab")


def made(folder: str | Path, *names: str) -> Path:
    """Create a folder and nested folders below it if they do not exist; returns the last.

    Raises InputError if one of `names` is a link, OSError if one cannot be created.
    """
    path = Path(folder)
    path.mkdir(parents=True, exist_ok=True)
    for name in names:
        path = path / name
        refuse_link(path)
        path.mkdir(exist_ok=True)
    return path


#: Advice about a link among folders that were not given by an option.
GIVEN = "give --out to write there"


def refuse_link(path: str | Path, instead: str = "remove it, or take another folder") -> None:
    """Raise InputError for a folder or file that is a link."""
    if os.path.islink(path):
        raise InputError(f"{path} is a link, and nothing is written through it: {instead}.")


def refuse_present(files: Iterable[Path], overwrite: bool = False) -> None:
    """Raise InputError if one of the files exists, unless they may be overwritten."""
    found = next((file for file in files if os.path.lexists(file)), None)
    if found is not None and not overwrite:
        raise InputError(f"{found} would be replaced: move it away, take another name, or give --overwrite.")
