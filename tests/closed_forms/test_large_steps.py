"""Large steps towards rest reach the equilibrium of Newton's method and of a damped motion.

Source: the same equilibrium by unrelated methods.
"""

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy.model.problem import Problem
from dolfbuoy.scene import load_scene
from dolfbuoy.statics.start import closed_form
from dolfbuoy.statics.ways import WAYS, find_rest


@pytest.mark.parametrize("name", ["large steps", "large steps, smaller first"])
def test_a_chain_on_the_bed(name):
    """From a perturbed start: the chain is lifted and displaced."""
    problem = Problem(load_scene("chain-on-bed"), dynamic=False, comm=MPI.COMM_SELF)
    found = {}
    for spoilt in (False, True):
        start = closed_form(problem)

        def put(start=start, spoilt=spoilt):
            start.put()
            if spoilt:
                for group in problem.lines.groups:
                    inside = (group.node_s > 0) & (group.node_s < problem.lines.longest)
                    problem.system.u[group.part.slice][group.node_dofs[inside]] += [0.2, 0.3, 0.3]
                problem.system.share()

        problem.iterations = 0
        find_rest(problem, put, [way for way in WAYS if way.name == (name if spoilt else "newton")])
        found[spoilt] = problem.system.u.copy(), problem.route, problem.iterations
    problem.destroy()
    assert (found[False][1], found[True][1]) == ("newton", name)
    positions = [u for u, _, _ in found.values()]
    np.testing.assert_allclose(positions[1], positions[0], rtol=1e-6, atol=1e-6 * np.abs(positions[0]).max())
    assert 0 < found[True][2] < 200
