"""Rest of lines on which grows what belongs to the depths where they rest: by turns, until both agree."""

import numpy as np
from mpi4py import MPI

from ..errors import SolveError
from ..parallel.ranks import combined
from .continuation import is_compressed

#: Factors that change by less have been found.
SETTLED = 1e-9
ROUNDS = 100


def settle(problem, rest) -> None:
    """Equilibrium and growth of a static Problem; `rest` solves for the former from nowhere.  Raises SolveError.

    A line that hovers where the table is steep may swing from round to round; then each takes half of what it wants.
    """
    growth, share, last = problem.lines.growth, 1.0, np.inf
    growth.factors = growth.of_the_water()
    rest()
    for _ in range(ROUNDS):
        now, wanted = growth.factors, growth.at(problem.system.u)
        change = combined(problem.comm, float(np.abs(wanted - now).max(initial=0.0)), MPI.MAX)
        if change <= SETTLED:
            return
        share, last = share if change < last else share / 2, change
        growth.factors = now + share * (wanted - now)
        _go_on(problem, rest)
    raise SolveError(
        f"cable.marine_growth and the depths at which the cable rests with it did not agree in {ROUNDS} rounds: where "
        "the table is steep there may be several equilibria; give a smoother one"
    )


def _go_on(problem, rest):
    """From the last equilibrium, or where Newton fails or compresses something from nowhere."""
    spent, before = problem.iterations, problem.system.u.copy()
    try:
        problem.iterations += problem.newton.solve()
        if not is_compressed(problem):
            return
    except SolveError:
        problem.system.u[:] = before
    spent = problem.iterations
    rest()
    problem.iterations += spent
