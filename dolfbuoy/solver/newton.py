"""What Newton's method of a System is told from outside or decides by itself: PETSc options, age of the matrix."""

from petsc4py import PETSc

from ..errors import InputError


class JacobianAge:
    """When the matrix of an earlier iteration or step still serves.

    With a kept matrix Newton's increments shrink by a factor instead of squaring.  Such an iteration costs a third of
    one with a new matrix, or less, so that keeping it pays while the factor is small.
    """

    SLOW = 0.1  #: shrinking of the increments from which on a new matrix is due
    MANY = 4  #: iterations of a solve after which the next one begins with a new matrix
    MARGIN = 0.01  #: part of the tolerance that has to be met, as the last increment does not square the error

    def __init__(self, keep):
        self.keep = keep
        self.valid = False  # the matrix at hand may be used
        self.kept = False  # ... and is not that of the present iterate

    def assembled(self):
        """The matrix at hand is now that of the present iterate."""
        self.valid, self.kept = True, False

    def judge(self, ratio):
        """The increment was `ratio` times the one before it."""
        self.valid = self.keep and ratio <= self.SLOW

    def judge_solve(self, iterations):
        """A solve has ended."""
        self.valid = self.valid and self.keep and iterations < self.MANY


class SolverOptions:
    """Line search and the scene's own PETSc options (solver.petsc), under a prefix of one system's own.

    The scene's stay in the database until a solve has ended: solvers within a preconditioner read theirs only then.
    """

    def __init__(self, scene=None):
        self.scene, self._in_database = dict(scene or {}), []

    def apply(self, snes):
        """Let a SNES read them.  Raises InputError for what PETSc refuses."""
        db, options, prefix = PETSc.Options(), {"snes_linesearch_type": "bt", **self.scene}, f"dolfbuoy_{id(self)}_"
        snes.setOptionsPrefix(prefix)
        self._in_database = [prefix + key for key in options]
        for key, value in zip(self._in_database, options.values(), strict=True):
            db[key] = None if value is True else value  # a flag has no value
        try:
            snes.setFromOptions()
        except PETSc.Error as error:
            self.forget()
            raise self.refused(error) from None
        if not self.scene:
            self.forget()

    def forget(self):
        """Take them out of PETSc's database."""
        db = PETSc.Options()
        while self._in_database:
            del db[self._in_database.pop()]

    def refused(self, error):
        """InputError for an error of PETSc."""
        return InputError(f"solver.petsc = {self.scene}: PETSc refuses it (error {error.ierr}).")


def reason_name(reason):
    """PETSc's name of a SNES reason."""
    names = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int)}
    return names.get(reason, str(reason))
