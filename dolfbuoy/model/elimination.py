"""In which order the pieces of a network and its joints are eliminated."""

import heapq

import numpy as np


def order_of_pieces(pieces):
    """(turn of each piece, whether it goes from s = L to s = 0, {joint: turn}); a joint comes behind the piece of its
    turn.

    A piece begins, if it can, at an end that needs no unknown or whose joint has gone: nothing of it then fills in but
    what lies ahead.  A joint goes when at most one of its pieces is left.
    """
    joints, found, at_joint = {}, {}, {}
    for k, piece in enumerate(pieces):
        for end in piece.ends:
            if end.kind == "joint":
                at_joint.setdefault(end.name, []).append(k)
    waiting = {name: len(there) for name, there in at_joint.items()}
    best = [(*_best_end(piece, joints), k) for k, piece in enumerate(pieces)]  # may hold a piece again, at a lower cost
    heapq.heapify(best)
    while best:
        _, backwards, k = heapq.heappop(best)
        if k in found:
            continue
        turn = len(found)
        found[k] = turn, bool(backwards)
        for end in pieces[k].ends:
            if end.kind == "joint":
                waiting[end.name] -= 1
                if waiting[end.name] <= 1 and end.name not in joints:
                    joints[end.name] = turn + 0.5
                    for left in set(at_joint[end.name]) - found.keys():
                        heapq.heappush(best, (*_best_end(pieces[left], joints), left))
    turns, backwards = zip(*(found[k] for k in range(len(pieces))), strict=True)
    return np.array(turns, dtype=float), np.array(backwards), joints


def _best_end(piece, joints):
    """(what it costs to begin there, the end: 0 or 1)."""
    return min((_cost(end, joints), i) for i, end in enumerate(piece.ends))


def _cost(end, joints):
    if end.kind == "buoy":
        return 1
    return 2 if end.kind == "joint" and end.name not in joints else 0
