"""Derivatives of runs of random scenes and networks, with respect to one number of each.

Source: central differences of whole runs with the same steps, at two increments.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from test_tangents import NETWORK, ON_BED, SEA, SHORT, derivative, difference

import dolfbuoy
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.sensitivity.parameters import parameters_of

TOP = {"kind": "prescribed", "position": [12.0, 3.0, -2.0], "amplitude": [0.5, 0.3, 1.0], "period": 4.0, "ramp": 0.3}
DRIVEN = {
    "sea": MOORED["sea"],
    "current": MOORED["current"],
    "cable": merged(MOORED["cable"], elements=6, top=TOP),
    "time": SHORT["time"],
    "solver": SHORT["solver"],
}
SCENES = {
    "moored": SHORT,
    "irregular": merged(SHORT, waves=None) | SEA,
    "driven": DRIVEN,
    "bed": ON_BED,
    "network": NETWORK,
}
SCHEMES = "backward-euler", "bdf2", "generalized-alpha"
#: Agreement that is asked for, relative to the largest derivative of each unknown and force, and to that of all.
LIMIT, ROUNDING = 1e-3, 1e-7
#: Cases of ten in which there may be nothing to compare with: central differences at two distances differ by a third or
#: more of what they differ from the derivative.  Seen: a snap between the two (top.ramp, a line on a bed), rounding of
#: tensions whose derivatives are a thousandth of the largest (added mass, inertia, stiffness), rounding of what has no
#: effect at all (damping of a turn that does not happen), rounding of starts at a distance of 1e-6 (lengths on a bed).
EXCUSED = 3


def random_case(number):
    """(name of its structure, scene, one of its numbers) for a seed: all physical numbers times 0.85 to 1.2."""
    random = np.random.default_rng(number)
    name = list(SCENES)[number % len(SCENES)]
    schemes = SCHEMES[:2] if name == "bed" else SCHEMES  # a line that goes slack takes no generalized-alpha
    scene = dolfbuoy.load_scene(SCENES[name], **{"time.scheme": schemes[random.integers(len(schemes))]})
    for one in parameters_of(scene):
        if np.isnan(one.value) or one.value == 0:
            continue
        factor = random.uniform(0.95, 1.05) if one.unit == "m" else random.uniform(0.85, 1.2)
        try:
            (here,) = parameters_of(scene, [one.key])
            scene = here.scene_at(scene, (factor - 1) * here.value / here.scale)
        except InputError:
            continue
    parameters = parameters_of(scene)
    return name, scene, parameters[random.integers(len(parameters))]


def verdict(scene, parameter):
    """(largest error over its tolerance, the same for one central difference against another)."""
    steps, found = derivative(scene, parameter)
    distances = (x * parameter.distance for x in (3, 1, 0.1))
    far, middle, near = (difference(scene, parameter, steps, eps) for eps in distances)
    size = np.abs(middle).max(axis=0)
    counts = size > 1e-6 * size.max()
    allowed = (LIMIT * size + ROUNDING * size.max())[counts]

    def apart(one, other):
        return float((np.abs(one - other).max(axis=0)[counts] / allowed).max(initial=0.0))

    return min(apart(found, one) for one in (far, middle, near)), apart(near, middle)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(5))
def test_as_central_differences(block):
    """Ten scenes each; one that does not start is replaced."""
    done, number, excused = 0, 1000 * block, []
    while done < 10:
        number += 1
        try:
            name, scene, parameter = random_case(number)
            error, own = verdict(scene, parameter)
        except (SolveError, InputError):
            continue
        done += 1
        assert error <= 1 or own > error / 3, (number, name, scene.time.scheme, parameter.key, error, own)
        if error > 1:
            excused.append((number, name, parameter.key, error, own))
    assert len(excused) <= EXCUSED, excused
