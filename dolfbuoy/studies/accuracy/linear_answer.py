"""The cheapest answer of all: the linear response to the scene's regular wave, beside a run in time."""

import math
import time

import numpy as np

from ...errors import InputError, SolveError
from ...linear.seaway import Seaway
from ...results.compare import percent
from ...results.measured import QUANTITIES, Run

#: What the linear response says of a run.
ANSWERED = ("tension_top", "tension_anchor", "buoy_position")


def linear_answer(scene, run: Run, quantity: str, start: float) -> str | None:
    """A sentence on the standard deviation of a quantity after `start` [s], and what it cost.

    None where it does not apply: no regular wave, no water, another quantity, or no linear response.
    """
    if scene.waves is None or scene.waves.irregular or scene.sea is None or quantity not in ANSWERED:
        return None
    began = time.monotonic()
    try:
        own = _deviation(scene, quantity)
    except (InputError, SolveError):
        return None
    seconds = time.monotonic() - began
    values = run.values[quantity][run.t >= start]
    measured = float(np.sqrt(np.sum(np.var(values.reshape(len(values), -1), axis=0))))
    if own is None or not measured:
        return None
    return (
        f"linear response: {seconds:.2g} s, the standard deviation of the {QUANTITIES[quantity]} "
        f"{percent(abs(own / measured - 1))} off; that run in time: {run.wall:.2g} s."
    )


def _deviation(scene, quantity):
    """Of the linear response to the scene's wave, drag linearised; None if there is no such quantity."""
    seaway = Seaway(scene, scene.waves.direction_deg)
    try:
        X = seaway.regular(seaway.wave(2 * math.pi / scene.waves.period), scene.waves.size)
        bodies = seaway.found.bodies
        places = {"buoy_position": bodies[0].motion(X)[:3]} if len(bodies) == 1 else {}
        moved = (places | seaway.tensions(X)).get(quantity)
        return None if moved is None else scene.waves.size * float(np.linalg.norm(moved)) / math.sqrt(2)
    finally:
        seaway.destroy()
