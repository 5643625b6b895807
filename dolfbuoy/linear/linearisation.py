"""The equations of a scene, linearised about its equilibrium: K x + E x_t + M x_tt = 0.

Rates are affine in the unknowns, v = gamma_v r + h_v and a = gamma_a r + h_a, so the Jacobian of a step is exactly
K + gamma_v E + gamma_a M.  With histories that make all rates zero, three assemblies of it give the matrices.
The state of a buoy is of first order in time: its inertia is in E, that of lines in M.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix, diags, vstack
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from ..elsewhere import MPI
from ..errors import InputError
from ..model.prescribed_ends import adrift_nowhere, from_rest
from ..model.problem import Problem
from ..motion.start import initial_state, start_from
from ..scene.sections import Scene
from ..scene.waves import Waves
from .layout import Body, Hold, LineNodes, bodies_of, holds_of, lines_of


@dataclass
class Linearisation:
    """Stiffness K, damping E and mass M of the free unknowns of this rank's rows, in physical units.

    problem: dynamic, without waves, with the equilibrium `u` as its unknowns; `problem.system.order` are the local
    unknowns of the rows and columns.
    """

    problem: Problem
    u: NDArray[Any]
    K: csr_matrix
    E: csr_matrix
    M: csr_matrix

    @cached_property
    def whole(self) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
        """K, E and M with the rows of all ranks, on every rank; collective at first use."""
        comm = self.problem.comm
        if comm.size == 1:
            return self.K, self.E, self.M
        return tuple(csr_matrix(vstack(comm.allgather(A))) for A in (self.K, self.E, self.M))

    @cached_property
    def bodies(self) -> list[Body]:
        """The buoys, on every rank; collective at first use."""
        return bodies_of(self.problem, self.u)

    @cached_property
    def holds(self) -> list[Hold]:
        """Attachment points of lines on buoys, on every rank; collective at first use."""
        return holds_of(self.problem, self.u)

    @cached_property
    def lines(self) -> list[LineNodes]:
        """The lines, on every rank; collective at first use."""
        return lines_of(self.problem, self.u)

    def destroy(self) -> None:
        """Free PETSc objects."""
        self.problem.destroy()


def linearise(
    scene: Scene, comm: Any = MPI.COMM_WORLD, waves: Waves | None = None, rest: Problem | None = None
) -> Linearisation:
    """Linearise about the equilibrium in the mean current, wind and external force, without waves.

    A buoy without cable is taken in still water.  waves: a section [waves], included in the problem with zero height.
    rest: the equilibrium, a solved static Problem on the same ranks, if known.  Raises InputError for a scene that has
    no equilibrium, SolveError if it is not found.
    """
    _refuse_tow(scene)
    calm = from_rest(scene if scene.cable else adrift_nowhere(scene)).model_copy(update={"waves": None})
    start = start_from(rest) if rest is not None else initial_state(calm, comm)
    regular = waves if waves and not waves.irregular else None
    flat = regular and regular.model_copy(update={"amplitude": 0.0, "height": None, "theory": "airy"})
    problem = Problem(calm.model_copy(update={"waves": flat}), dynamic=True, comm=comm)
    problem.set_time(0.0)
    start.put(problem, problem.system.u)
    problem.system.publish()
    u = problem.system.u.copy()
    K = jacobian(problem, 0.0, 0.0)
    return Linearisation(problem, u, K, jacobian(problem, 1.0, 0.0) - K, jacobian(problem, 0.0, 1.0) - K)


def _refuse_tow(scene: Scene) -> None:
    """Refuse a tow, which moves steadily and has no equilibrium at rest.  Raises InputError."""
    for piece in scene.network.pieces:
        for end in piece.ends:
            if end.top is not None and end.top.velocity:
                key = f"joint.{end.name}" if end.name else f"{scene.network.key_of(piece.cable)}.top"
                raise InputError(
                    f"{key}.velocity = {list(end.top.velocity)}: a tow has no rest to move about; hold the end, in a "
                    "[current] that runs the other way."
                )


def without_rates(problem: Problem) -> None:
    """Set all rates of a Problem to zero, for any unknowns."""
    for evolution in problem.evolutions():
        for level in range(evolution.order):
            evolution.hand_out(level, 0.0, 0.0)


def free_rows(problem: Problem, residual: NDArray[Any]) -> NDArray[Any]:
    """Rows of the free unknowns of a local residual, with those of tied unknowns summed; on one rank only."""
    numbering, total = problem.system.numbering, residual.copy()
    np.add.at(total, numbering.visible[numbering.tied_to], residual[numbering.tied])
    return np.asarray(total[problem.system.order])


def jacobian(problem: Problem, gamma_v: float, gamma_a: float, velocities: NDArray[Any] | None = None) -> Any:
    """K + gamma_v E + gamma_a M at the present unknowns, with zero rates.

    velocities: first rates of local unknowns of second order (lines), to be used instead of zero.
    """
    system: Any = problem.system
    for evolution in problem.evolutions():
        values = evolution.values(system.u)
        for level, gamma in enumerate((gamma_v, gamma_a)[: evolution.order]):
            moves = velocities if level == 0 and evolution.order == 2 else None
            evolution.hand_out(level, gamma, (0.0 if moves is None else evolution.values(moves)) - gamma * values)
    system.assemble_jacobian()
    rows, columns, values = system.A.getValuesCSR()
    return csr_matrix((values.copy(), columns.copy(), rows.copy()), shape=(len(rows) - 1, system.unknowns))


class Equilibrated:
    """Solver of A x = b, columns b, with equilibrated rows and columns.  Raises RuntimeError for a singular A."""

    def __init__(self, A: Any):
        self._rows = 1 / np.maximum(abs(A).max(axis=1).toarray().ravel(), 1e-300)
        A = diags(self._rows) @ A
        self._columns = 1 / np.maximum(abs(A).max(axis=0).toarray().ravel(), 1e-300)
        self._scaled = csc_matrix(A @ diags(self._columns))
        self._factors = splu(self._scaled)

    def __call__(self, b: NDArray[Any]) -> NDArray[Any]:
        """A^-1 b."""
        return np.asarray(self._columns[:, None] * self._factors.solve(self._rows[:, None] * b))

    def condition(self) -> float:
        """Estimated condition number of the scaled A in the 1-norm."""
        solve = self._factors.solve
        inverse = LinearOperator(self._scaled.shape, solve, lambda b: solve(b, "T"), dtype=float)
        return float(onenormest(inverse, t=1) * abs(self._scaled).sum(axis=0).max())  # t > 1 uses random numbers


class WithReactions:
    """K, E and M (n + 3 r, n) of n unknowns and r such ends; on one rank alone.

    ends: cable -> (its force at rest [N], its three rows).
    """

    def __init__(self, found: Linearisation):
        problem: Any = found.problem
        self.found = found
        self.size, self._dofs, self.ends = found.K.shape[1], np.zeros(0, dtype=int), dict[int, Any]()
        without_rates(problem)
        residual = problem.system.evaluate()
        for cable in range(len(problem.network.cables)):
            piece = problem.network.last_of(cable)
            if problem.network.pieces[piece].ends[1].kind in ("fixed", "prescribed", "joint"):
                dofs = problem.lines.top_dofs(piece)
                self.ends[cable] = residual[dofs].copy(), self.size + len(self._dofs) + np.arange(3)
                self._dofs = np.concatenate([self._dofs, dofs])
        self._rows: Any = problem.system.rows_of_jacobian(self._dofs) if self.ends else None
        self.K = self.jacobian(0.0, 0.0)
        self.E, self.M = self.jacobian(1.0, 0.0) - self.K, self.jacobian(0.0, 1.0) - self.K

    @property
    def rows(self) -> int:
        """Number of equations and reactions."""
        return int(self.size + len(self._dofs))

    def jacobian(self, gamma_v: float, gamma_a: float, velocities: NDArray[Any] | None = None) -> csr_matrix:
        """K + gamma_v E + gamma_a M, as `linearisation.jacobian`."""
        inner = jacobian(self.found.problem, gamma_v, gamma_a, velocities)
        return csr_matrix(vstack([inner, self._rows()])) if self.ends else inner

    def of_residual(self, residual: NDArray[Any]) -> NDArray[Any]:
        """Rows of a local residual for these equations."""
        return np.concatenate([free_rows(self.found.problem, residual), residual[self._dofs]])
