"""Nodes of the cable's interval [0, L] of unstretched arc length."""

import numpy as np


def cable_nodes(length, elements, grading=1.0):
    """Increasing arc lengths of the element ends [m], from 0 to `length`.

    elements: a number, or a list of (length, number) per segment from the anchor.  grading: ratio of the last element's
    size to the first's (geometric; within each segment).
    """
    segments = [(length, elements)] if isinstance(elements, int) else elements
    nodes, start = [0.0], 0.0
    for span, count in segments:
        nodes.extend(start + span * _fractions(int(count), grading)[1:])
        start += span
    nodes[-1] = length
    return np.array(nodes)


def number_of_cells(elements) -> int:
    """Total number of elements in the argument of `cable_nodes`: a number, or (length, count) per segment."""
    return elements if isinstance(elements, int) else int(sum(count for _, count in elements))


def _fractions(count, grading):
    if grading == 1.0 or count == 1:
        return np.linspace(0.0, 1.0, count + 1)
    sizes = grading ** (np.arange(count) / (count - 1))
    return np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()
