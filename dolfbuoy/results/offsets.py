"""Excursion of a buoy in the horizontal plane: the smallest circle around its track."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def smallest_circle(points: NDArray[Any]) -> tuple[NDArray[Any], float]:
    """(centre, radius) of the smallest circle that encloses all points (n, 2).

    Incremental over the corners of the convex hull: a corner outside lies on the circle of it and all before it.
    """
    points = corners(points)
    points = np.random.default_rng(0).permutation(points)  # expected effort is then proportional to their number
    circle = (points[0], 0.0)
    for i, p in enumerate(points):
        if _outside(circle, p):
            circle = (p, 0.0)
            for j, q in enumerate(points[:i]):
                if _outside(circle, q):
                    circle = ((p + q) / 2, math.dist(p, q) / 2)
                    for r in points[:j]:
                        if _outside(circle, r):
                            circle = _through(p, q, r)
    return circle


def corners(points: NDArray[Any]) -> NDArray[Any]:
    """Corners (k, 2) of the convex hull of points (n, 2), counter-clockwise; for collinear points, the two ends."""
    from scipy.spatial import ConvexHull, QhullError  # slow, and no run needs it

    points = np.unique(np.asarray(points, dtype=float), axis=0)
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):  # fewer than three, or on one line
        along = np.argsort(points @ (points[-1] - points[0]), kind="stable")
        return points[along[[0, -1]]] if len(points) > 1 else points


def _outside(circle: tuple[NDArray[Any], float], p: NDArray[Any]) -> bool:
    centre, radius = circle
    return math.dist(centre, p) > radius * (1 + 1e-12)


def _through(p: NDArray[Any], q: NDArray[Any], r: NDArray[Any]) -> tuple[NDArray[Any], float]:
    """The circle through three points; if collinear, with the farthest two as a diameter."""
    a, b = q - p, r - p
    cross = 2 * (a[0] * b[1] - a[1] * b[0])
    if abs(cross) <= 1e-12 * (a @ a + b @ b):
        pairs = ((p, q), (p, r), (q, r))
        s, t = max(pairs, key=lambda pair: math.dist(*pair))
        return (s + t) / 2, math.dist(s, t) / 2
    shift = np.array([b[1] * (a @ a) - a[1] * (b @ b), a[0] * (b @ b) - b[0] * (a @ a)]) / cross
    return p + shift, float(np.hypot(*shift))
