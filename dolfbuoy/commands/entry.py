"""What the command `dolfbuoy` starts; light, so that an interruption of its imports ends in one word too."""

import gc
import os
import sys

from ..parallel import interruption


def main():
    """The command line from the first moment to the last."""
    gc.set_threshold(300_000)  # what imports and forms make stays: looking for garbage in it is a tenth of a start
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # there are none: it asks all installed packages for them
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


if __name__ == "__main__":
    main()
