"""The closed-form catenary against values computed outside this project."""

import numpy as np
import pytest

from dolfbuoy import catenary


def test_inextensible_between_two_points():
    shape = catenary.between((0, 0, 0), (0.6, 0, 0.5), L=1.0, w=1.0, EA=np.inf)
    assert pytest.approx(0.19509924559345990705, rel=1e-13) == shape.H
    assert pytest.approx(-0.22579586945055138055, rel=1e-13) == shape.V0
    np.testing.assert_allclose(shape.position(np.array([1.0])), [[0.6, 0, 0.5]], atol=1e-14)
