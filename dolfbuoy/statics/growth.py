"""Fixed-point iteration between the equilibrium of lines and the marine growth at their depths.

With a steep table a line may oscillate from round to round; so each step is relaxed by Aitken's rule (Kuettler and
Wall, Comput. Mech. 43, 2008), and halved repeatedly if Newton finds no equilibrium.
"""

from collections.abc import Callable

import numpy as np

from ..elsewhere import MPI
from ..errors import SolveError
from ..model.problem import Problem
from ..parallel.ranks import allreduce
from .catenary import Array
from .ways import is_compressed

#: Change of the factors below which they are accepted.
SETTLED = 1e-9
ROUNDS = 200
#: Lower limit of the relaxation factor of Aitken's rule.
LEAST = 0.02
NONE = (
    "cable.marine_growth and the depths at which the cable rests with it do not come to agree (a line may hover where "
    "the table is steep: give a smoother one)"
)


def settle(problem: Problem, rest: Callable[[], None]) -> None:
    """Find equilibrium and growth of a static Problem; `rest` finds the former from scratch.  Raises SolveError."""
    growth, share, last = problem.lines.growth, 1.0, None
    growth.factors = growth.of_the_water()
    rest()
    for _ in range(ROUNDS):
        now = growth.factors
        way = growth.at(problem.system.u) - now
        if allreduce(problem.comm, float(np.abs(way).max(initial=0.0)), MPI.MAX) <= SETTLED:
            return
        if last is not None:
            turn = way - last
            along, size = (allreduce(problem.comm, float((a * turn).sum()), MPI.SUM) for a in (last, turn))
            share = min(max(-share * along / size, LEAST), 1.0) if size else share
        share, last = _go(problem, now, way, share, rest), way
    raise SolveError(f"{NONE} in {ROUNDS} rounds")


def _go(problem: Problem, now: Array, way: Array, share: float, rest: Callable[[], None]) -> float:
    """Take this share of the step, or a smaller one, from the last equilibrium or from scratch; return the share."""
    before, spent = problem.system.u.copy(), problem.iterations
    pressed, why = is_compressed(problem), None
    ways = [(share, False), (share, True), *((share / 2**k, False) for k in range(1, 12))]
    for tried, from_nowhere in ways:
        problem.lines.growth.factors = now + tried * way
        try:
            if from_nowhere:
                rest()
                problem.iterations += spent
            else:
                problem.iterations += problem.newton.solve()
                if is_compressed(problem) and not pressed:
                    raise SolveError("the cable is compressed")
            return float(tried)
        except SolveError as error:
            problem.system.u[:], why = before, why or error
    raise SolveError(f"{NONE}: {why}")
