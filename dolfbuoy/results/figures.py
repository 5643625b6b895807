"""Figures of a run, for print.

    from dolfbuoy import figures, simulate
    figures.tension(simulate("short"))  # a notebook shows it; figures.tension(record).savefig("tension.pdf") saves it

Each takes a record, from `simulate` or opened with xarray, and optionally its scene, and returns a matplotlib figure.
Raises InputError if the record lacks the data; the caller saves the figure.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

# Importing these registers their figures; `figures.snapshot` is the figure, not the module.
from . import over_time, trajectories
from . import snapshot as _snapshot
from .after_ramp import Missing, TooShort
from .over_time import of_quantity
from .paraview import read_run
from .parts import names_of
from .quantities import QUANTITIES
from .record import fitting
from .style import FIGURES, keep

if TYPE_CHECKING:
    import xarray as xr

__all__ = [*FIGURES, "draw_all"]
#: Order of the figure modules; figures registered elsewhere come last.
_ORDER = {module.__name__: k for k, module in enumerate((trajectories, over_time, _snapshot))}
#: Largest number of cables or buoys with figures of their own, and the quantity whose largest values select them.
MOST_PARTS = 12
CHOSEN_BY = {"cable": "tension_top", "buoy": "cone_angle"}


def __getattr__(name: str) -> Any:
    """The figure of this name."""
    if name not in FIGURES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return FIGURES[name]


def __dir__() -> list[str]:
    return [*globals(), *FIGURES]


def in_order() -> dict[str, Any]:
    """The figures of a run by name, in an order independent of the order of imports."""
    return dict(sorted(FIGURES.items(), key=lambda figure: _ORDER.get(figure[1].__module__, len(_ORDER))))


def draw_all(folder: str | Path, say: Callable[[str], None] = lambda sentence: None, svg: bool = True) -> list[Path]:
    """Draw every figure that the run in `folder` has data for; returns the files in folder/figures/.

    The snapshot shows the whole system.  The other figures are drawn for each cable or buoy, with its name appended if
    there are several; beyond MOST_PARTS, only for those with the largest top tension or cone angle.

    say: called with a sentence for each figure that the run is too short for, and if some parts have no figures.  svg:
    also write each as SVG.  Raises InputError if the folder holds no run.
    """
    record, scene = read_run(folder)
    folder, written, notes = Path(folder), list[Path](), dict[str, None]()
    chosen = {kind: _largest(record, kind, notes) for kind in CHOSEN_BY}
    own = {name: of_quantity(one) for name, one in QUANTITIES.items() if one.figure and name not in FIGURES}
    for name, draw in (in_order() | own).items():
        parts: list[str | None] = [*chosen[draw.part]] if draw.part else []
        for part in parts or [None]:
            try:
                with fitting(folder / "results.nc"):
                    figure = draw(record, scene, **({draw.part: part} if part else {}))
            except Missing:
                continue
            except TooShort as reason:
                notes[str(reason)] = None
                continue
            called = f"{name}_{part.replace('-', '_')}" if part and len(parts) > 1 else name
            written += keep(figure, folder, called, svg=svg)
    for sentence in notes:
        say(sentence)
    return written


def _largest(record: xr.Dataset, kind: str, notes: dict[str, None]) -> list[str]:
    """Names of the cables or buoys of a record that have figures of their own, in their order."""
    names = names_of(record, kind)
    if len(names) <= MOST_PARTS:
        return names
    largest = abs(record[CHOSEN_BY[kind]]).max("time").values
    chosen = f"the {MOST_PARTS} with the largest {CHOSEN_BY[kind]}"
    notes[f"Of {len(names)} {kind}s {chosen} have figures of their own."] = None
    return [names[k] for k in sorted(largest.argsort(kind="stable")[-MOST_PARTS:])]
