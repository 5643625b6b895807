"""The linearised equations without the length of quaternions.

R(q_4) does not depend on |q_4|, and (8)_3 keeps it: every quaternion brings an eigenvalue 0 that is no motion.  The
rows and columns of (8)_3 along q_4 are orthogonal to those along small turns, and concern nothing else.  They are made
those of an infinite eigenvalue.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_matrix, diags, identity

from .layout import Body, half_turns


class UnitQuaternions:
    """Exchanges the rows and columns of the quaternions of some bodies; size: of all unknowns."""

    def __init__(self, bodies: list[Body], size: int):
        blocks, self._kept, done = [], np.ones(size), 0
        for body in bodies:
            place = body.at.orientation[0]
            blocks += [identity(place - done), np.column_stack([body.orientation, 2 * half_turns(body.orientation)])]
            self._kept[place], done = 0.0, place + 4
        self._turn = csr_matrix(block_diag([*blocks, identity(size - done)]))

    def without_lengths(self, first: int, *matrices: Any) -> list[csr_matrix]:
        """The rows of a rank, the first of which is given, of K and of what is multiplied with powers of lambda.

        The rows of a body are all of one rank.
        """
        rows = slice(first, first + matrices[0].shape[0])
        left, kept = diags(self._kept[rows]) @ self._turn.T[rows, rows], diags(self._kept)
        K, *others = (left @ A @ self._turn @ kept for A in matrices)
        return [csr_matrix(A) for A in (K + diags(1 - self._kept).tocsr()[rows], *others)]

    def exchanged(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Columns of all unknowns with the exchange."""
        return np.asarray(self._turn.T @ vectors)

    def as_they_were(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Columns of all unknowns without it."""
        return np.asarray(self._turn @ vectors)
