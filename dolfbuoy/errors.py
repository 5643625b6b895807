"""The two ways in which a run can end badly."""


def printable(text: str) -> str:
    """Text from outside as it may go to a terminal: what is no character to be seen is written as an escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(ValueError):
    """The scene or the command asks for something that is not possible; one sentence, exit code 2.

    The sentence may quote names and values of a stranger; control characters in them are escaped.
    """

    def __init__(self, sentence):
        super().__init__(printable(str(sentence)))


class SolveError(RuntimeError):
    """A nonlinear solve failed; names time, step, block and PETSc's reason; exit code 1."""
