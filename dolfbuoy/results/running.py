"""Extremes of the lines over all steps of a run, those between its frames too, and what a record says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..scene.settings import ramp_of
from ..solver.vector_ops import widening
from .after_ramp import BEHIND, after_ramp
from .series import mean_over_time

if TYPE_CHECKING:
    import xarray as xr

    from ..model.problem import Problem
    from ..scene import Scene
    from .observe import Observer


class Extremes:
    """Least and largest value of every unknown of the lines of a Problem, of all instants that were noted.

    kept: (until the ramp ends, from there on) x (least, largest) x unknowns of this rank, +-inf while there is none.
    The tension of an element is that at its nodes of T, both its ends among them: of degree 0 it is constant on it.
    """

    def __init__(self, problem: Problem) -> None:
        self._lines = problem.lines
        part: Any = problem.lines.part if problem.lines else None
        unknowns = problem.system.u[part.slice if part else slice(0)]
        self._ramp = ramp_of(problem.scene) * BEHIND
        self.kept = np.empty((2, 2, len(unknowns)))
        self.kept[:, 0], self.kept[:, 1] = np.inf, -np.inf
        self._until, self._after = (widening(unknowns, *rows) for rows in self.kept)

    def note(self, t: float) -> None:
        """Take the present unknowns, which are those of the time t."""
        (self._after if t >= self._ramp else self._until)()

    def restore(self, kept: ArrayLike) -> None:
        """Take up those of a checkpoint.  Raises InputError if they are of other unknowns."""
        kept = np.asarray(kept)
        if kept.shape != self.kept.shape or kept.dtype != self.kept.dtype:
            raise InputError("The extremes in the checkpoint are not of this scene: the run can only begin anew.")
        self.kept[:] = kept

    def values(self, observer: Observer) -> dict[str, NDArray[Any]]:
        """By their names in a record, along the lines, on rank 0; collective.

        Those after the ramp are there if there is a ramp, and once it is over.
        """
        lines = self._lines
        if lines is None:
            return {}
        places = lines.node_dofs[: lines.owned_nodes]
        whole = self.kept[:, 0].min(axis=0), self.kept[:, 1].max(axis=0)
        cells = {
            f"cable_tension_{name}{ending}": getattr(rows[lines.T_dofs], fold)(axis=1)
            for ending, of_span in (("", whole), ("_after_ramp", self.kept[1]))
            for (name, fold), rows in zip((("minimum", "min"), ("maximum", "max")), of_span, strict=True)
        }
        loads = np.array([piece.section.breaking_load or np.nan for piece in lines.pieces])
        if np.isfinite(loads).any():
            cells["cable_utilisation_maximum"] = cells["cable_tension_maximum"] / loads[lines.line_of_cell]
        nodes = {"cable_position_minimum": whole[0][places], "cable_position_maximum": whole[1][places]}
        found = observer.along(nodes, cells)
        return {
            name: values
            for name, values in found.items()
            if not name.endswith("_after_ramp") or (self._ramp > 0 and np.isfinite(values).all())
        }


class Envelope(NamedTuple):
    """Tension of each element of a cable [N], after the ramp: extremes of all steps, mean of the recorded frames."""

    least: NDArray[Any]
    mean: NDArray[Any]
    largest: NDArray[Any]
    begin: float
    end: float
    frames: int


def envelope_of(record: xr.Dataset, scene: Scene) -> Envelope:
    """Envelope of the record of one cable.  Raises TooShort if there are fewer than two frames after the ramp."""
    frames = record.frame.values
    rows = after_ramp(frames, scene, 2, "envelope of the tension")
    mean = mean_over_time(frames[rows], record.cable_tension.values[rows])
    least, largest = (
        record.get(f"cable_tension_{name}_after_ramp", record[f"cable_tension_{name}"]).values
        for name in ("minimum", "maximum")
    )
    begin = record.time.values[after_ramp(record.time.values, scene, 1, "envelope of the tension")[0]]
    return Envelope(least, mean, largest, float(begin), float(frames[-1]), len(rows))


def minimum(record: xr.Dataset, name: str) -> NDArray[Any]:
    """Least `cable_tension` or `cable_position` of all steps of a run; of an equilibrium what it is."""
    kept = f"{name}_minimum"
    return record[kept].values if kept in record else record[name].min("frame").values


def maximum(record: xr.Dataset, name: str) -> NDArray[Any]:
    """Largest values, as `minimum`."""
    kept = f"{name}_maximum"
    return record[kept].values if kept in record else record[name].max("frame").values
