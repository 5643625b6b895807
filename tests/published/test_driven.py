"""A short, always taut cable driven at its top, against two independent programs converged under refinement.

Source: two independent programs converged under refinement (tests/reference).
"""

import alone
import numpy as np
import pytest
from helpers import reference

DRIVEN = reference("driven")["B_taut"]


def driven(elements, degree, step):
    A, (x, y, z) = DRIVEN["A"], DRIVEN["chord"]
    return {
        "sea": {"depth": 20.0, "density": 1025.0},
        "cable": {
            "length": DRIVEN["L"],
            "line_density": DRIVEN["rho0"],
            "diameter": 0.08,
            "axial_stiffness": 2.3e8,
            "elements": elements,
            "position_degree": degree,
            "tension_degree": degree - 1,
            "added_mass": 0.3,
            "normal_drag": 0.8,
            "tangential_drag": 0.1,
            "top": {
                "kind": "prescribed",
                "position": [x, y, z - 20.0],
                "amplitude": [0.0, 0.0, A],
                "period": DRIVEN["T"],
                "ramp": 10.0,
            },
        },
        "time": {"end": 60.0, "step": step, "output_every": 60.0},
    }


def extremes(elements, degree, step, end=60.0, periods=4):
    """[top max, top min, anchor max] of the last periods [N]."""
    run = alone.simulate(driven(elements, degree, step), time__end=end)
    last = run.time.values > end - periods * DRIVEN["T"] - 1e-9
    top, anchor = run.tension_top.values[last], run.tension_anchor.values[last]
    return np.array([top.max(), top.min(), anchor.max()])


def test_top_tension_in_short():
    """Ten elements of degree 2 and two steps, extrapolated to step zero: 0.1 % of the largest tension."""
    coarse, fine = (extremes(10, 2, step, end=20.0, periods=1) for step in (0.02, 0.01))  # periodic from 15 s on
    limit = 2 * fine - coarse
    assert limit[0] == pytest.approx(DRIVEN["top_max"][0], rel=1e-3)
    assert limit[1] == pytest.approx(DRIVEN["top_min"][0], rel=5e-3)
    assert coarse[0] > fine[0] > limit[0]  # the error of the step is seen, and it is positive


@pytest.mark.slow
def test_convergence_in_mesh_and_step():
    """Order 2 in the mesh for degree 1, order 1 in the step, and the published extremes as limits."""
    steps = (0.01, 0.005, 0.0025)
    table = {
        (N, mu): np.array([extremes(N, mu, h, end=25.0, periods=1) for h in steps])
        for N, mu in ((10, 1), (20, 1), (40, 1), (20, 2))
    }
    limits = {key: (8 * v[2] - 6 * v[1] + v[0]) / 3 for key, v in table.items()}
    for v in table.values():
        assert np.log2((v[0, 0] - v[1, 0]) / (v[1, 0] - v[2, 0])) == pytest.approx(1.0, abs=0.1)
    coarse, middle, fine = (limits[N, 1][0] for N in (10, 20, 40))
    assert np.log2((middle - coarse) / (fine - middle)) == pytest.approx(2.0, abs=0.25)
    for value in (limits[20, 2], fine + (fine - middle) / 3):
        top = value if np.isscalar(value) else value[0]
        assert top == pytest.approx(DRIVEN["top_max"][0], abs=DRIVEN["top_max"][1])
    assert limits[20, 2][1] == pytest.approx(DRIVEN["top_min"][0], abs=DRIVEN["top_min"][1])
