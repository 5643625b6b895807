"""The two ways in which a run can end badly."""


class InputError(ValueError):
    """The scene or the command asks for something that is not possible; one sentence, exit code 2."""


class SolveError(RuntimeError):
    """A nonlinear solve failed; names time, step, block and PETSc's reason; exit code 1."""
