"""The ways in which a run can end badly."""

import importlib
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

#: What dolfbuoy calls and pip does not bring: packages of the system, all of one build.
OF_THE_SYSTEM = ("dolfinx", "ufl", "ffcx", "basix", "petsc4py", "mpi4py", "h5py")

#: Debian 13: dolfinx itself looks for what it needs, and lists what it does not find.
LISTED = r"^\* (\w+) is "


def printable(text: str) -> str:
    """Text from outside as it may go to a terminal: what is no character to be seen is written as an escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(ValueError):
    """The scene or the command asks for something that is not possible; one sentence, exit code 2.

    The sentence may quote names and values of a stranger; control characters in them are escaped.
    """

    def __init__(self, sentence: object) -> None:
        super().__init__(printable(str(sentence)))


class SolveError(RuntimeError):
    """A nonlinear solve failed; names time, step, block and PETSc's reason; exit code 1."""


class NoResult(SolveError):
    """A run that came to its end and means nothing; record: what it has recorded."""

    def __init__(self, sentence: str, record: "xr.Dataset | None" = None) -> None:
        super().__init__(sentence)
        self.record = record


class NotAccurate(SolveError):
    """An accuracy that was asked for was not reached; record: of the last run, with its bars; exit code 4."""

    def __init__(self, sentence: str, record: "xr.Dataset | None" = None) -> None:
        super().__init__(sentence)
        self.record = record


def missing(error: ImportError) -> "InputError | None":
    """A failed import of one of OF_THE_SYSTEM as one sentence; None if something else failed."""
    name = (error.name or "").partition(".")[0]
    if name not in OF_THE_SYSTEM:
        return next((found for found in map(missing, _causes(error)) if found), None)
    gone = isinstance(error, ModuleNotFoundError)
    what = "is not installed" if gone else f"cannot be imported ({str(error).rstrip('.')})"
    return InputError(
        f"{name} {what}: dolfbuoy needs dolfinx, petsc4py, mpi4py and h5py of the system, which pip does not bring; "
        "docker/install.sh installs them, and dolfbuoy doctor says what is there."
    )


def _causes(error: ImportError) -> Iterator[ImportError]:
    """The failed imports that one without a name is due to."""
    if isinstance(error.__cause__, ImportError):  # of a compiled module
        yield error.__cause__
    for name in re.findall(LISTED, str(error), flags=re.MULTILINE):
        try:
            importlib.import_module(name)
        except ImportError as own:
            yield own
