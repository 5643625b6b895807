"""Start of the command `dolfbuoy`; light, so that an interruption of its imports ends in one word too."""

import gc
import os
import sys

from ..parallel import interruption


def main() -> None:
    """The command line from the first moment to the last."""
    gc.set_threshold(300_000)  # what imports and forms make stays: looking for garbage in it is a tenth of a start
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # there are none: it asks all installed packages for them
    _open_streams()
    sys.setdlopenflags(os.RTLD_LAZY)  # of 85,000 functions of PETSc's libraries few are ever called, and looked up
    interruption.listen()
    try:
        from .main import main as command

        command()
    except SystemExit:
        raise
    except BaseException:
        if not interruption.received():
            raise
        print("Interrupted.", file=sys.stderr)
        sys.exit(130)
    finally:
        interruption.ignore()  # what still comes is the end of Python and of MPI


def _open_streams() -> None:
    """Open standard streams, or the next file that is opened would take their numbers, and what C prints; a
    character that the terminal's locale does not have is shown as an escape."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, os.fdopen(number, mode))
            if number == 1:
                print("Error: standard output is closed; > /dev/null takes what is printed.", file=sys.stderr)
                sys.exit(1)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # none that a test has put there
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
