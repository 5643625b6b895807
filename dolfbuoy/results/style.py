"""Style and registry of figures: sizes, colours, figures outside pyplot; each draws a record, or names what it lacks.

Whatever draws takes matplotlib from here: it is started elsewhere, without the settings of a stranger's folder.
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

#: Colours of Okabe and Ito, which the colour-blind can tell apart.
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

#: In this order curves take their colours.
PALETTE = [COLORS[name] for name in ("blue", "red", "green", "orange", "sky", "sand", "ink")]

#: How every figure looks; see `matplotlib.rc_context`.
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
    """A figure outside pyplot, in this style whoever draws it; a notebook shows it, once, where it ends a cell."""

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
    """An empty figure of that size [inch], outside pyplot."""
    figure = Picture(figsize=(width, height), constrained_layout=constrained)
    FigureCanvasAgg(figure)
    return figure


def files_of(path: Path, svg: bool = True) -> list[Path]:
    """path.png, and path.svg if it is wanted."""
    return [path.parent / f"{path.name}.{suffix}" for suffix in ("png", "svg")[: 1 + svg]]


def save(figure: Figure, path: Path, svg: bool = True) -> list[Path]:
    """Write path.png, and path.svg if it is wanted."""
    files = files_of(path, svg)
    with replacing(files[0]) as part, matplotlib.rc_context(STYLE):
        print_png(figure, part)
    for file in files[1:]:
        with replacing(file) as part:
            figure.savefig(part, format="svg", metadata={"Date": None})
    return files


def print_png(figure: Figure, path: Path) -> None:
    """Write a PNG as figure.savefig does, which draws all once more before, for the layout; that stands then."""
    figure.set_dpi(STYLE["savefig.dpi"])
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    figure.set_layout_engine("none")
    figure.canvas.print_png(path)


def keep(figure: Figure, folder: Path, name: str, kind: str = "run", svg: bool = True) -> list[Path]:
    """Save a figure as folder/figures/name, files of a result of this kind; returns them."""
    path = Path(folder) / "figures" / name
    made(Path(folder), "figures")
    enlist(folder, files_of(path, svg), kind)
    return save(figure, path, svg)


def plain_ticks(axes: Any) -> None:
    """Numbers such as 0.2 in the place of powers at logarithmic axes."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(LogLocator(subs=()))


def legend_below(figure: Figure, room: float, ncol: int, handles: list[Any] | None = None) -> None:
    """The legend of the whole figure below its panels, in so many inches."""
    entries = {} if handles is None else {"handles": handles}
    figure.legend(loc="lower center", ncol=ncol, **entries)
    share = room / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))


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
