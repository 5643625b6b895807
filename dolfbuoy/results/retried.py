"""Steps of a run that could not be taken as they were: how many, and from where on it is no result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import NoResult

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene

#: Part of the steps from which on a sentence says that they were cut; and no result is left where so many were.
OFTEN, MOST = 0.05, 0.5


def cut(record: xr.Dataset, scene: Scene) -> float:
    """Part of the steps of a run that could not be taken as they were; with a tolerance, of those that failed."""
    time: Any = scene.time
    steps, failed = record.sizes["time"] - 1, record.attrs.get("failed_steps", 0)
    if not failed or not steps or time.tolerance is not None:
        return float(min(failed / max(steps, 1), 1.0))
    step = time.step
    numbers = np.ceil(record.time.values[1:] / step - 1e-6)
    count = len(np.unique(numbers))  # a step may have been made smaller without having failed
    smaller = numbers[record.time_step.values[1:] < (1 - 1e-6) * step]
    return float(min(len(np.unique(smaller)), failed) / count)


def sentences(record: xr.Dataset, scene: Scene) -> list[str]:
    """A sentence about steps that were retried, if there are any."""
    failed, share = record.attrs.get("failed_steps", 0), cut(record, scene)
    doubt = f", in {100 * share:.3g} % of the run: see whether its numbers stay with a smaller time.step"
    words = f"{failed} steps failed and were retried with smaller ones"
    return [f"{words}{doubt if share > OFTEN else ''}."] if failed else []


def refused(record: xr.Dataset, scene: Scene) -> NoResult | None:
    """The error to raise for a finished run most of whose steps were retried; None for a sound one."""
    if (share := cut(record, scene)) <= MOST:
        return None
    return NoResult(
        f"{100 * share:.3g} % of all steps failed and were retried with smaller ones: what is left is no result; take "
        "a smaller time.step or another time.scheme.",
        record,
    )
