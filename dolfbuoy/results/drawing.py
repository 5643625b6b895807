"""Registry of the figures of a run, and what they share: each draws a record, or names the variable that it lacks."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .after_ramp import Missing, scene_of
from .parts import names_of, part_of
from .style import STYLE, matplotlib

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene
    from .style import Figure

#: Name of the files: what draws them, from (record, scene); `figure_of` puts a figure in.
FIGURES: dict[str, Any] = {}


def figure_of(*needs: str, part: str | None = None) -> Callable[..., Any]:
    """Decorator of a function that `draws`, which makes it a figure of every run that has the variables."""

    def register(draw: Any) -> Any:
        FIGURES[draw.__name__] = draws(*needs, part=part)(draw)
        return FIGURES[draw.__name__]

    return register


def draws(*needs: str, part: str | None = None) -> Callable[..., Any]:
    """A function (record, scene=None, ...) that draws these variables of a record as a figure.

    The scene is by default the one that the record carries.  part: "cable" or "buoy" if it draws one, which then is a
    keyword too: the name of the one, by default of the only one.  The function raises Missing for a record without the
    variables, or without that part, TooShort for one that ends too early.
    """

    def decorate(draw: Any) -> Any:
        @functools.wraps(draw)
        def figure(record: xr.Dataset, scene: Scene | None = None, *arguments: Any, **options: Any) -> Figure:
            missing = [name for name in needs if name not in record]
            if missing:
                raise Missing(f"figures.{draw.__name__} needs {missing[0]}, which this record does not have.")
            if not record.sizes.get("time"):
                raise Missing("This is not the record of a run: compute it with simulate, or dolfbuoy run.")
            scene = scene or scene_of(record)
            if part is not None:
                record = part_of(record, part, _chosen(record, part, draw.__name__, options.pop(part, None)))
            with matplotlib.rc_context(STYLE):
                return draw(record, scene, *arguments, **options)

        vars(figure)["part"] = part
        return figure

    return decorate


def _chosen(record: xr.Dataset, part: str, figure: str, name: str | None) -> str:
    """A name of a record's cables or buoys: this one, or that of the only one."""
    names = names_of(record, part)
    if name not in names and (name is not None or len(names) > 1):
        fault = f"{part} = {name!r} is none" if name is not None else f"give {part}=NAME"
        raise Missing(f"figures.{figure} draws one {part} of {', '.join(names)}: {fault}.")
    return names[0] if name is None else name


def at_least(axes: Any, span: float = 1e-3) -> None:
    """Keep rounding noise of a constant from filling the panel."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - span / 2, (low + high) / 2 + span / 2)


def legend_above(axes: Any, ncol: int) -> None:
    """The legend over a panel, from its left."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=ncol, borderaxespad=0.1, columnspacing=1.2)
