"""Roots and rotations equal those of scipy to the last bit, for starts that avoid importing scipy.

Source: scipy's brentq and Rotation.
"""

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy import optimize
from scipy.spatial.transform import Rotation

from dolfbuoy.model.rigid import rotation_of
from dolfbuoy.roots import brentq

RANDOM = np.random.default_rng(41)
FUNCTIONS = {
    "cubic": lambda x: x**3 - 2 * x - 0.3,
    "flat": lambda x: (x - 0.4) ** 9,
    "steep": lambda x: math.atan(1e6 * (x - 0.1)) + 0.3,
    "step": lambda x: math.copysign(1.0, x - 0.3),
    "stairs": lambda x: math.floor(10 * x) + 0.5,
    "exponential": lambda x: math.exp(5 * x) - 2.0,
    "small": lambda x: 1e-100 * (x - 0.2) ** 3,
    "nearly linear": lambda x: x + 1e-9 * math.sin(1e3 * x),
    "zero at an end": lambda x: x - 1.0,
}


def called(method, f, *args, **options):
    """What came of it, and every place where the function was asked for."""
    places = []

    def noted(x):
        places.append(x)
        return f(x)

    try:
        return method(noted, *args, **options), places
    except (RuntimeError, ValueError) as error:
        return type(error), places


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("options", [{}, {"xtol": 1e-15, "rtol": 1e-15}, {"xtol": 1e-3}, {"maxiter": 4}])
def test_as_scipy(name, options):
    """At the same places, also where there is no root between the ends or too few iterations."""
    ends = [(-1.0, 1.0), (1.0, -1.5), *RANDOM.uniform(-2.0, 2.0, (60, 2))]
    found = [called(brentq, FUNCTIONS[name], a, b, **options) for a, b in ends]
    assert found == [called(optimize.brentq, FUNCTIONS[name], a, b, **options) for a, b in ends]
    assert options or any(isinstance(root, float) for root, _ in found)


def test_nan():
    with pytest.raises(ValueError, match="NaN"):
        brentq(lambda x: math.nan if x == 1.0 else -1.0, 0.0, 1.0)


def test_rotations():
    for size in (1.0, 1e-3, 7.0):
        for q4 in size * RANDOM.standard_normal((100, 4)):
            np.testing.assert_array_equal(rotation_of(q4), Rotation.from_quat([*q4[1:], q4[0]]).as_matrix())


FIRST_STEP = """
import os, sys
import rich.progress

def first(*_, **__):
    print([name for name in ("scipy", "matplotlib", "xarray", "pandas") if name in sys.modules], flush=True)
    os._exit(0)

rich.progress.Progress.update = first
sys.argv = ["dolfbuoy", "run", *sys.argv[1:]]
from dolfbuoy.commands.entry import main
main()
"""


def test_first_step(tmp_path):
    """What takes long to import is not needed until then."""
    command = [sys.executable, "-c", FIRST_STEP, "driven", "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr
