"""Figures of a run, which one would print.

    from dolfbuoy import figures, simulate
    figures.tension(simulate("short"))  # in a notebook it is shown; figures.tension(record).savefig("tension.pdf")

Each takes a record, from `simulate` or opened with xarray, and perhaps its scene, and returns a figure of matplotlib.
It raises InputError where the record lacks what it needs; saving is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

# Their figures register themselves when they are imported; `figures.snapshot` is the figure, not the module.
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
#: Places of the modules of figures; those that others register come last.
_ORDER = {module.__name__: k for k, module in enumerate((trajectories, over_time, _snapshot))}
#: Cables or buoys that have figures of their own: those with the largest value of a quantity.
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
    """The figures of a run by name, in one order whichever of their modules was imported first."""
    return dict(sorted(FIGURES.items(), key=lambda figure: _ORDER.get(figure[1].__module__, len(_ORDER))))


def draw_all(folder: str | Path, say: Callable[[str], None] = lambda sentence: None, svg: bool = True) -> list[Path]:
    """Draw every figure that the run in `folder` has data for; returns the files in folder/figures/.

    The snapshot is of the whole; of several cables or buoys each has its own of the others, with its name after that
    of the figure; of more than MOST_PARTS those with the largest tension at the top or cone angle.

    say: called with a sentence on each figure that the run is too short for, and if some have no figures.  svg:
    whether each is written as SVG too.  Raises InputError if the folder holds no run.
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
