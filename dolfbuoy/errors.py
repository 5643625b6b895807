"""Errors that a run can end with."""

import importlib
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

#: Dependencies not installed by pip: system packages, all from one build.
OF_THE_SYSTEM = ("dolfinx", "ufl", "ffcx", "basix", "petsc4py", "mpi4py", "h5py")

#: Debian 13: dolfinx itself checks its dependencies, and lists missing ones.
LISTED = r"^\* (\w+) is "


def printable(text: str) -> str:
    """External text made safe for a terminal: non-printable characters are escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(ValueError):
    """The scene or command requests something impossible; one sentence, exit code 2.

    The sentence may quote names and values from untrusted input; control characters in them are escaped.
    """

    def __init__(self, sentence: object) -> None:
        super().__init__(printable(str(sentence)))


class SolveError(RuntimeError):
    """A nonlinear solve failed; names time, step, block and PETSc's reason; exit code 1."""


class NoResult(SolveError):
    """A finished run whose results are meaningless; record: its record."""

    def __init__(self, sentence: str, record: "xr.Dataset | None" = None) -> None:
        super().__init__(sentence)
        self.record = record


class NotAccurate(SolveError):
    """The requested accuracy was not reached; record: that of the last run, with its error bars; exit code 4."""

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
    """The failed imports that caused an ImportError without a name."""
    if isinstance(error.__cause__, ImportError):  # from a compiled module
        yield error.__cause__
    for name in re.findall(LISTED, str(error), flags=re.MULTILINE):
        try:
            importlib.import_module(name)
        except ImportError as own:
            yield own
