"""Twenty random moorings in still water against MoorPy: tensions and positions, half of them with chain on the bed.

Source: MoorPy from PyPI (the extra `test`; skipped without it), quasi-static catenaries in nested solves.
"""

import numpy as np
import pytest

from dolfbuoy.statics.network import Joint, Network, Piece, solve
from dolfbuoy.statics.on_bed import UP, Bed

DEPTH, RHO, G = 100.0, 1025.0, 9.81


def mooring(seed, on_bed):
    """Two to five legs of one to three pieces with clumps and floats between, tied to a free or fixed hub."""
    random = np.random.default_rng(seed)
    hub_load = (*random.normal(size=2) * 2e4, random.uniform(1, 3) * 2e5) if on_bed else (0.0, 0.0, 2e5)
    joints, pieces = [Joint((0.0, 0.0, -10.0), free=seed % 3 > 0, load=hub_load)], []
    legs = random.integers(2, 6)
    for leg in range(legs):
        angle = 2 * np.pi * (leg + 0.3 * random.random()) / legs
        radius = random.uniform(2.5, 4.5) * DEPTH if on_bed else random.uniform(0.6, 1.2) * DEPTH
        foot = radius * np.cos(angle), radius * np.sin(angle), -DEPTH if on_bed else -DEPTH * random.uniform(0.7, 0.95)
        joints.append(Joint(foot))
        count = random.integers(1, 4)
        length = np.hypot(radius, DEPTH) * (random.uniform(1.0, 1.02) if on_bed else random.uniform(1.02, 1.1))
        at = len(joints) - 1
        for number in range(count):
            w = random.uniform(500, 900) if on_bed and number == 0 else random.uniform(50, 400)
            EA = 10 ** random.uniform(6.5, 8.5)
            if number < count - 1:
                lift = 0.0 if on_bed else random.uniform(-1, 1)
                joints.append(Joint(free=True, load=(0.0, 0.0, 3e3 * lift)))
            end = len(joints) - 1 if number < count - 1 else 0
            pieces.append(Piece(at, end, length / count, w, EA))
            at = end
    return Network(joints, pieces, Bed(UP, -DEPTH) if on_bed else None)


def by_moorpy(moorpy, network, start):
    """Positions of joints and end tensions of pieces.

    `start`: where MoorPy's own Newton begins; from farther away it does not find all of these.
    """
    system = moorpy.System(depth=DEPTH if network.bed is not None else 10 * DEPTH, rho=RHO, g=G)
    for joint, position in zip(network.joints, start, strict=True):
        mass, volume = (-joint.load[2] / G, 0.0) if joint.free else (0.0, 0.0)
        push = np.array([*joint.load[:2], 0.0]) if joint.free else np.zeros(3)
        system.addPoint(0 if joint.free else 1, position, m=mass, v=volume, fExt=push)
    for number, piece in enumerate(network.pieces):
        kind = {"name": str(number), "d_vol": 0.0, "m": piece.w / G, "w": piece.w, "EA": piece.EA, "EAd": 0.0}
        system.addLine(piece.length, kind, pointA=piece.start + 1, pointB=piece.end + 1, cb=0.0)
    system.initialize()
    system.solveEquilibrium(tol=1e-7, maxIter=2000)
    return np.array([point.r for point in system.pointList]), np.array([[line.TA, line.TB] for line in system.lineList])


@pytest.mark.filterwarnings("ignore")  # MoorPy's own, of numpy and matplotlib
@pytest.mark.parametrize("on_bed", [False, True])
@pytest.mark.parametrize(
    "seed", [0, 1, 2, 3, 4, 6, 7, 8, pytest.param(9, marks=pytest.mark.slow), 10]
)  # MoorPy leaves the rest of 5 on a bed
def test_random_moorings(seed, on_bed):
    moorpy = pytest.importorskip("moorpy")
    network = mooring(seed, on_bed)
    rest = solve(network)
    tensions = np.array(
        [s.tension(np.array([0.0, p.length])) for s, p in zip(rest.shapes, network.pieces, strict=True)]
    )
    positions, others = by_moorpy(moorpy, network, rest.positions)
    rel = 1e-3 if on_bed else 1e-6
    np.testing.assert_allclose(tensions, others, rtol=rel)
    np.testing.assert_allclose(rest.positions, positions, atol=rel * DEPTH)
    assert on_bed == (sum(shape.length_on_bed for shape in rest.shapes) > 0.1 * DEPTH)
