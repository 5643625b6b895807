"""What the command `dolfbuoy` starts; light, so that an interruption of its imports ends in one word too."""

import sys

from ..parallel import interruption


def main():
    """The command line from the first moment to the last."""
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
