"""Spectra of a run: how the variance of motion and tension is spread over frequencies."""

from .after_ramp import density, enough_for_a_spectrum
from .drawing import figure_of, legend_above
from .series import unwrapped
from .style import COLORS, COLUMN, Figure, new_figure
from .tables import force_unit

#: Decades that are shown below the peak.
DECADES = 6
#: What a panel reaches up to at least [unit of the quantity squared / Hz]: rounding of a constant does not fill it.
NOISE = 1e-12
_LINES = (("-", "blue"), ("--", "red"), ("-.", "green"))


@figure_of("buoy_position", part="buoy")
def motion_spectrum(record, scene=None) -> Figure:
    """Power spectral density of the position of C after the ramp, and of its turns if the record has them."""
    x = record.buoy_position.values
    panels = [("m", [(name, x[:, i]) for i, name in enumerate("xyz")])]
    turns = [(name, unwrapped(record, name)) for name in ("roll", "pitch", "yaw") if name in record]
    return _spectra(record, scene, "spectrum of the motion", panels + ([("°", turns)] if turns else []))


@figure_of("tension_top", "tension_anchor", part="cable")
def tension_spectrum(record, scene=None) -> Figure:
    """Power spectral density of the tension at both ends of the cable after the ramp."""
    unit, factor = force_unit(record.tension_top)
    ends = [("upper end", factor * record.tension_top.values), ("anchor", factor * record.tension_anchor.values)]
    return _spectra(record, scene, "spectrum of the tension", [(unit, ends)])


def _spectra(record, scene, what, panels):
    """A panel per (unit, series), its peak and the frequency of the drive marked."""
    t = record.time.values
    rows, period = enough_for_a_spectrum(t, scene, what)
    figure = new_figure(COLUMN, 0.6 + 2.1 * len(panels))
    grid = figure.subplots(len(panels), squeeze=False)[:, 0]
    for axes, (unit, series) in zip(grid, panels, strict=True):
        _draw(axes, [(name, *density(t[rows], values[rows], period)) for name, values in series], period)
        axes.set_ylabel(f"spectral density [{unit}²/Hz]")
    grid[-1].set_xlabel("frequency [Hz]")
    figure.align_ylabels(grid)
    return figure


def _draw(axes, curves, period):
    for (name, f, S), (line, color) in zip(curves, _LINES, strict=False):
        axes.plot(f, S, line, color=COLORS[color], label=name)
    _, f, S = max(curves, key=lambda curve: curve[2].max())
    peak, highest = f[S.argmax()], max(S.max(), NOISE)
    axes.plot(peak, S.max(), "o", color=COLORS["ink"], ms=4, mfc="none", ls="none", label=f"peak {peak:.3g} Hz")
    floor = highest / 10 ** (DECADES - 1)
    end = f[floor <= S].max(initial=2 * peak)
    if period is not None:
        axes.axvline(1 / period, color="#888888", lw=0.8, ls=":", label=f"drive {1 / period:.3g} Hz")
        end = max(end, 4 / period)
    axes.set(yscale="log", ylim=(highest / 10**DECADES, 4 * highest), xlim=(0, max(end, 4 * f[1])))
    legend_above(axes, len(curves))
