"""Style and registry of figures: sizes, colours, figures outside pyplot, and the decorator of drawing functions.

All drawing code imports matplotlib from here, where it is loaded without settings from the current folder.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..elsewhere import matplotlib as matplotlib
from ..writing import made, replacing
from .after_ramp import Missing, scene_of
from .folder import enlist
from .parts import names_of, part_of

# isort: split
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection as LineCollection
from matplotlib.figure import Figure as Figure
from matplotlib.lines import Line2D as Line2D
from matplotlib.patches import Circle as Circle
from matplotlib.patches import Patch as Patch
from matplotlib.ticker import FixedLocator as FixedLocator
from matplotlib.ticker import FuncFormatter, LogLocator

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene

#: Width of a text column and of a page [inch].
COLUMN, PAGE = 3.5, 7.0

#: Colours of Okabe and Ito, distinguishable by the colour-blind.
COLORS = {
    "blue": "#0072B2",
    "red": "#D55E00",
    "green": "#009E73",
    "sky": "#56B4E9",
    "orange": "#E69F00",
    "ink": "#222222",
    "sand": "#C9B68C",
    "purple": "#CC79A7",
}

#: Order in which curves take their colours.
PALETTE = [COLORS[name] for name in ("blue", "red", "green", "orange", "sky", "sand", "ink")]

#: Settings of all figures; see `matplotlib.rc_context`.
STYLE = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "axes.prop_cycle": matplotlib.cycler(color=PALETTE),
    "lines.linewidth": 1.0,
    "figure.facecolor": "white",
    "savefig.dpi": 200,
    "svg.hashsalt": "dolfbuoy",
}


class Picture(Figure):  # type: ignore[misc]  # matplotlib has no types
    """A figure outside pyplot, always in this style; a notebook shows it once, if it ends a cell."""

    def draw(self, renderer: Any) -> None:
        with matplotlib.rc_context(STYLE):
            super().draw(renderer)

    def savefig(self, *arguments: Any, **options: Any) -> None:
        with matplotlib.rc_context(STYLE):
            super().savefig(*arguments, **options)

    def _repr_png_(self) -> bytes:
        """PNG for notebooks that never imported pyplot, which would register it."""
        shown = io.BytesIO()
        self.savefig(shown, format="png", dpi=150)
        return shown.getvalue()


def new_figure(width: float, height: float, constrained: bool = True) -> Picture:
    """An empty figure of this size [inch], outside pyplot."""
    figure = Picture(figsize=(width, height), constrained_layout=constrained)
    FigureCanvasAgg(figure)
    return figure


def files_of(path: Path, svg: bool = True) -> list[Path]:
    """path.png, and path.svg if requested."""
    return [path.parent / f"{path.name}.{suffix}" for suffix in ("png", "svg")[: 1 + svg]]


def save(figure: Figure, path: Path, svg: bool = True) -> list[Path]:
    """Write path.png, and path.svg if requested; returns the files."""
    files = files_of(path, svg)
    with replacing(files[0]) as part, matplotlib.rc_context(STYLE):
        print_png(figure, part)
    for file in files[1:]:
        with replacing(file) as part:
            figure.savefig(part, format="svg", metadata={"Date": None})
    return files


def print_png(figure: Figure, path: Path) -> None:
    """Write a PNG as figure.savefig does, but without its extra drawing for the layout; fixes the layout."""
    figure.set_dpi(STYLE["savefig.dpi"])
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    figure.set_layout_engine("none")
    figure.canvas.print_png(path)


def keep(figure: Figure, folder: Path, name: str, kind: str = "run", svg: bool = True) -> list[Path]:
    """Save a figure as folder/figures/name, listed as files of a result of this kind; returns them."""
    path = Path(folder) / "figures" / name
    made(Path(folder), "figures")
    enlist(folder, files_of(path, svg), kind)
    return save(figure, path, svg)


def plain_ticks(axes: Any) -> None:
    """Label logarithmic axes with numbers such as 0.2 instead of powers."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(LogLocator(subs=()))


def legend_below(figure: Figure, room: float, ncol: int, handles: list[Any] | None = None) -> None:
    """Place the legend of the whole figure below its panels; room: its height [inch]."""
    entries = {} if handles is None else {"handles": handles}
    figure.legend(loc="lower center", ncol=ncol, **entries)
    share = room / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))


#: Functions of (record, scene) that draw the figures, by file name; registered by `figure_of`.
FIGURES: dict[str, Any] = {}


def figure_of(*needs: str, part: str | None = None) -> Callable[..., Any]:
    """Decorator as `draws` that also registers the function, for every run with the variables."""

    def register(draw: Any) -> Any:
        FIGURES[draw.__name__] = draws(*needs, part=part)(draw)
        return FIGURES[draw.__name__]

    return register


def draws(*needs: str, part: str | None = None) -> Callable[..., Any]:
    """Decorator that makes a function (record, scene=None, ...) that draws these variables of a record as a figure.

    The scene defaults to that in the record.  part: "cable" or "buoy" if it draws one; this is then also a keyword for
    its name, by default that of the only one.  The function raises Missing for a record without the variables or the
    part, TooShort for one that ends too early.
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
    """Name of the cable or buoy to draw: the given one, or the only one.  Raises Missing."""
    names = names_of(record, part)
    if name not in names and (name is not None or len(names) > 1):
        fault = f"{part} = {name!r} is none" if name is not None else f"give {part}=NAME"
        raise Missing(f"figures.{figure} draws one {part} of {', '.join(names)}: {fault}.")
    return names[0] if name is None else name


def at_least(axes: Any, span: float = 1e-3) -> None:
    """Widen the axis limits so that the rounding noise of a constant does not fill the panel."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - span / 2, (low + high) / 2 + span / 2)


def legend_above(axes: Any, ncol: int) -> None:
    """Place the legend above a panel, from its left edge."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=ncol, borderaxespad=0.1, columnspacing=1.2)
