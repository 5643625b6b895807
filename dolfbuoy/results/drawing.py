"""What figures of a run have in common: they take a record, with what it has draw a figure, and say what they miss."""

import functools
from collections.abc import Callable

from ..scene.network import is_network
from .behind_ramp import Missing, scene_of
from .style import STYLE, matplotlib


def figure_of(*needs: str, network: bool = False) -> Callable:
    """A function (record, scene=None, ...) that draws what these variables of a record say, as a figure.

    The scene is by default the one that the record carries.  network: whether it draws a whole network too.  The
    function raises Missing for a record without the variables, TooShort for one that ends too early.
    """

    def decorate(draw):
        @functools.wraps(draw)
        def figure(record, scene=None, *arguments, **options):
            missing = [name for name in needs if name not in record]
            if missing:
                raise Missing(f"figures.{draw.__name__} needs {missing[0]}, which this record does not have.")
            if not record.sizes.get("time"):
                raise Missing("This is not the record of a run: compute it with simulate, or dolfbuoy run.")
            scene = scene or scene_of(record)
            if is_network(scene) and not network:
                raise Missing(
                    f"figures.{draw.__name__} draws one cable or one buoy: give record and scene of one of "
                    "results.parts.parts_of(record, scene), as figures.draw_all does."
                )
            with matplotlib.rc_context(STYLE):
                return draw(record, scene, *arguments, **options)

        return figure

    return decorate


def at_least(axes, span: float = 1e-3) -> None:
    """Keep rounding noise of a constant from filling the panel."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - span / 2, (low + high) / 2 + span / 2)


def legend_above(axes, ncol: int) -> None:
    """The legend over a panel, from its left."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=ncol, borderaxespad=0.1, columnspacing=1.2)
