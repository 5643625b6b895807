"""Layout checks of figures, besides their curves."""

import itertools
import math

import numpy as np
import pytest
from matplotlib.text import Text
from matplotlib.transforms import Bbox


def nothing_overlaps(figure) -> bool:
    """True if no texts of a figure overlap and none is cut off; else the assertion shows them."""
    found = overlapping(figure)
    assert not found
    return True


def overlapping(figure) -> list:
    """Pairs of overlapping texts in a figure, and single texts that are cut off."""
    drawn, draw = [], Text.draw
    figure.draw_without_rendering()  # lays it out
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", lambda text, renderer: (drawn.append(text), draw(text, renderer)))
        figure.draw_without_rendering()
    texts = {id(t): (t.get_text(), squares(t)) for t in drawn if t.get_visible() and t.get_text().strip()}
    pairs = itertools.combinations(texts.values(), 2)
    found = [(s, t) for (s, a), (t, b) in pairs if any(x.overlaps(y) for x in a for y in b)]
    whole = figure.bbox.padded(1)
    return found + [t for t, boxes in texts.values() if not all(contains(whole, box) for box in boxes)]


def squares(text):
    """A text, rotated or not, as small squares along its midline; the last pixel at each side is ignored."""
    angle, box = math.radians(text.get_rotation()), text.get_window_extent()
    middle = np.array([box.x0 + box.x1, box.y0 + box.y1]) / 2
    c, s = abs(math.cos(angle)), abs(math.sin(angle))
    width, height = box.width, box.height
    if abs(c * c - s * s) > 0.1:
        width, height = np.linalg.solve([[c, s], [s, c]], [box.width, box.height])
    if angle == 0:
        return [box.padded(-1)]
    direction = np.array([math.cos(angle), math.sin(angle)])
    half = min(width, height) / 2
    along = np.linspace(-1, 1, math.ceil(width / height) + 1) * (width / 2 - half)
    return [Bbox([middle + a * direction - half + 1, middle + a * direction + half - 1]) for a in along]


def contains(whole, box):
    return whole.x0 <= box.x0 and whole.y0 <= box.y0 and box.x1 <= whole.x1 and box.y1 <= whole.y1
