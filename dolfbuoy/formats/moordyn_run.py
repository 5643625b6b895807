"""Running MoorDyn on an exported scene: tensions and motions over time."""

import math
import os
import tempfile
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..model.lines import top_position
from .to_moordyn import Export

#: MoorDyn's steps per call: driven ends keep their speed within it, and jumps in between make stiff lines ring.
PER_CALL = 10
#: Factor that shortens calls: MoorDyn takes one more step if they are longer, even by rounding.
SHORTER = 1 - 1e-12


@dataclass
class Series:
    """Times t [s]; tension (t, line, end: 0 lower, 1 upper) [N]; body (t, body, 3): positions of keels [m].
    force (t, 3 driven ends): their holding forces [N]; CPU seconds of MoorDyn's steps and of reading results."""

    t: NDArray[Any]
    tension: NDArray[Any]
    body: NDArray[Any]
    force: NDArray[Any]
    seconds: float


def moordyn_module() -> Any:
    """MoorDyn's Python module.  Raises InputError if it is not installed."""
    try:
        import moordyn
    except ImportError:
        raise InputError("MoorDyn is not installed: pip install moordyn (the extra `benchmark`).") from None
    return moordyn


def run(export: Export, end: float, most: int = 50_000, per_call: int | None = None) -> Series | None:
    """Run to t = end [s]; None if it diverges.  most: largest number of instants; per_call: MoorDyn's steps per call.

    End tensions are extrapolated linearly from the two nearest nodes, as MoorDyn's own lack the weight of half a
    segment.
    """
    moordyn = moordyn_module()
    step = export.step * (per_call or (1 if export.driven else PER_CALL)) * SHORTER
    steps = math.ceil(end / step - 1e-9)
    every = -(-steps // most)
    t = np.arange(steps + 1) * step
    places = np.array([np.concatenate([top_position(top, at) for top in export.driven] or [np.zeros(0)]) for at in t])
    speeds = np.diff(places, axis=0) / step
    with tempfile.TemporaryDirectory() as folder, silent():
        for name, text in export.files.items():
            (Path(folder) / name).write_text(text)
        system = moordyn.Create(str(Path(folder) / next(iter(export.files))))
        try:
            moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
            moordyn.Init(system, places[0].tolist(), [0.0] * places.shape[1])
            lines = [moordyn.GetLine(system, i + 1) for i in range(moordyn.GetNumberLines(system))]
            bodies = [moordyn.GetBody(system, i + 1) for i in range(moordyn.GetNumberBodies(system))]
            tension, body, held = [], [], []
            begin = clock.process_time()
            for i in range(steps):
                force = moordyn.Step(system, places[i].tolist(), speeds[i].tolist(), float(t[i]), step)
                if (i + 1) % every == 0:
                    tension.append([_ends(moordyn, line) for line in lines])
                    body.append([moordyn.GetBodyState(own)[0][:3] for own in bodies])
                    held.append(force)
            seconds = clock.process_time() - begin
        except RuntimeError:
            return None  # "MoorDyn reported an error": NaN
        finally:
            moordyn.Close(system)
    found = Series(
        t[every::every], np.array(tension), np.array(body).reshape(len(body), -1, 3), np.array(held), seconds
    )
    return found if np.isfinite(found.tension).all() and np.isfinite(found.body).all() else None


def _ends(moordyn: Any, line: Any) -> tuple[float, float]:
    last = moordyn.GetLineN(line)
    sizes = {
        node: math.hypot(*moordyn.GetLineNodeTen(line, node)) for node in {1, min(2, last), last - 1, max(last - 2, 0)}
    }
    low = 2 * sizes[1] - sizes[min(2, last)] if last > 2 else sizes[1]
    high = 2 * sizes[last - 1] - sizes[max(last - 2, 0)] if last > 2 else sizes[1]
    return low, high


@contextmanager
def silent() -> Iterator[Any]:
    """Silence MoorDyn, which writes to the standard output of the process, not of Python."""
    saved, null = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    try:
        yield
    finally:
        for number, copy in enumerate(saved, start=1):
            os.dup2(copy, number)
            os.close(copy)
        os.close(null)
