"""In which order the pieces of a network and its joints are eliminated."""

import numpy as np


def order_of_pieces(pieces):
    """(turn of each piece, whether it goes from s = L to s = 0, {joint: turn}); a joint comes behind the piece of its
    turn.

    A piece begins, if it can, at an end that needs no unknown or whose joint has gone: nothing of it then fills in but
    what lies ahead.  A joint goes when at most one of its pieces is left.
    """
    left, joints, found = list(range(len(pieces))), {}, {}
    waiting = {}
    for piece in pieces:
        for end in piece.ends:
            if end.kind == "joint":
                waiting[end.name] = waiting.get(end.name, 0) + 1
    while left:
        _, backwards, k = min((*_best_end(pieces[k], joints), k) for k in left)
        turn = len(found)
        left.remove(k)
        found[k] = turn, bool(backwards)
        for end in pieces[k].ends:
            if end.kind == "joint":
                waiting[end.name] -= 1
                if waiting[end.name] <= 1 and end.name not in joints:
                    joints[end.name] = turn + 0.5
    turns, backwards = zip(*(found[k] for k in range(len(pieces))), strict=True)
    return np.array(turns, dtype=float), np.array(backwards), joints


def _best_end(piece, joints):
    """(what it costs to begin there, the end: 0 or 1)."""
    return min((_cost(end, joints), i) for i, end in enumerate(piece.ends))


def _cost(end, joints):
    if end.kind == "buoy":
        return 1
    return 2 if end.kind == "joint" and end.name not in joints else 0
