"""How figures look: sizes, colours, and figures outside pyplot."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

#: Width of a text column and of a page [inch].
COLUMN, PAGE = 3.5, 7.0

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
    "lines.linewidth": 1.0,
    "figure.facecolor": "white",
    "savefig.dpi": 200,
    "svg.hashsalt": "dolfbuoy",
}

#: Colours of Okabe and Ito, which the colour-blind can tell apart.
COLORS = {
    "blue": "#0072B2",
    "red": "#D55E00",
    "green": "#009E73",
    "sky": "#56B4E9",
    "orange": "#E69F00",
    "ink": "#222222",
    "sand": "#C9B68C",
}


def new_figure(width: float, height: float, constrained: bool = True) -> Figure:
    """An empty figure of that size [inch], outside pyplot."""
    figure = Figure(figsize=(width, height), constrained_layout=constrained)
    FigureCanvasAgg(figure)
    return figure
