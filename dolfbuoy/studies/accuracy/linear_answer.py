"""The cheapest estimate: linear response to the scene's waves, compared with a run in time."""

import math
import time
from typing import Any

import numpy as np

from ...errors import InputError, SolveError
from ...linear.seaway import Seaway
from ...results.compare import percent
from ...results.measured import QUANTITIES, Run
from ...results.tables import rounded
from ...scene import Scene
from ...statics.catenary import Array

#: Quantities of a run given by the linear response, and its names for them.
ANSWERED = {
    "tension_top": ("tension_top",),
    "tension_anchor": ("tension_anchor",),
    "buoy_position": ("surge", "sway", "heave"),
}


def linear_answer(scene: Scene, run: Run, quantity: str, start: float) -> str | None:
    """A sentence on the standard deviation of a quantity after `start` [s], and its cost.

    Over all lines and buoys together; in an irregular sea, with the same components over the same time.  None if it
    does not apply: no waves or water, moved ends, another quantity, or no linear response.
    """
    moved = any(end.kind == "prescribed" for piece in scene.network.pieces for end in piece.ends)
    if scene.waves is None or scene.sea is None or moved or quantity not in ANSWERED:
        return None
    began, kept = time.monotonic(), run.t >= start
    try:
        own = _deviation(scene, ANSWERED[quantity], run.t[kept])
    except (InputError, SolveError):
        return None
    seconds, values = time.monotonic() - began, run.values[quantity][kept]
    measured = float(np.sqrt(np.sum(np.var(values.reshape(len(values), -1), axis=0))))
    if own is None or not measured:
        return None
    return (
        f"linear response: {rounded(seconds)} s, the standard deviation of the {QUANTITIES[quantity]} "
        f"{percent(abs(own / measured - 1))} off; that run in time: {rounded(run.wall)} s."
    )


def _deviation(scene: Scene, kinds: tuple[str, ...], times: Array) -> float | None:
    """Deviation by the linear response to the scene's waves, drag linearised; None if no such quantity exists."""
    waves: Any = scene.waves
    seaway = Seaway(scene, waves.direction_deg)
    try:
        if waves.irregular:
            found = seaway.over_time(waves, times)
        else:  # over a cycle
            wave, turns = seaway.wave(2 * math.pi / waves.period, wavelength=waves.wavelength), np.arange(8) / 8
            X = seaway.named(seaway.regular(wave, waves.size)[:, None])
            cycle = np.exp(2j * math.pi * turns)
            found = {name: waves.size * (values[0] * cycle).real for name, values in X.items()}
    finally:
        seaway.destroy()
    sizes = [np.std(values) for name, values in found.items() if name.startswith(kinds)]
    return float(np.linalg.norm(sizes)) if sizes else None
