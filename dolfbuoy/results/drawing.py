"""What figures of a run have in common: they take a record, with what it has draw a figure, and say what they miss."""

import functools
import tomllib
from collections.abc import Callable

import matplotlib
import numpy as np

from ..errors import InputError
from ..scene import build_scene
from ..scene.settings import ramp_of
from .statistics import TURNING
from .style import STYLE


class Missing(InputError):
    """A record, or a scene, without what a figure shows."""


class TooShort(InputError):
    """A record that ends before there is enough of it for a figure."""


def figure_of(*needs: str) -> Callable:
    """A function (record, scene=None, ...) that draws what these variables of a record say, as a figure.

    The scene is by default the one that the record carries.  The function raises Missing for a record without the
    variables, TooShort for one that ends too early.
    """

    def decorate(draw):
        @functools.wraps(draw)
        def figure(record, scene=None, *arguments, **options):
            missing = [name for name in needs if name not in record]
            if missing:
                raise Missing(f"figures.{draw.__name__} needs {missing[0]}, which this record does not have.")
            if not record.sizes.get("time"):
                raise Missing("This is not the record of a run: compute it with simulate, or dolfbuoy run.")
            with matplotlib.rc_context(STYLE):
                return draw(record, scene or scene_of(record), *arguments, **options)

        return figure

    return decorate


def scene_of(record):
    """The scene of a record, which stands in its attributes.  Raises InputError if it does not."""
    if "scene" not in record.attrs:
        raise InputError("This record does not carry its scene: give the scene beside it.")
    return build_scene(tomllib.loads(record.attrs["scene"]))


def after_ramp(times: np.ndarray, scene, at_least: int, what: str) -> np.ndarray:
    """Rows of the times from the end of the scene's ramp on.  Raises TooShort, in whose name, if these are too few."""
    ramp = ramp_of(scene)
    rows = np.flatnonzero(times >= ramp * (1 - 1e-9))
    if len(rows) < at_least:
        behind = f"the ramp of {ramp:g} s" if ramp else "the start"
        raise TooShort(f"No {what}: it needs {at_least} instants after {behind}, the record has {len(rows)}.")
    return rows


def at_least(axes, span: float = 1e-3) -> None:
    """Keep rounding noise of a constant from filling the panel."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - span / 2, (low + high) / 2 + span / 2)


def legend_above(axes, ncol: int) -> None:
    """The legend over a panel, from its left."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=ncol, borderaxespad=0.1, columnspacing=1.2)


def mean_over_time(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Of values (time, ...), by the trapezoidal rule."""
    return np.average((values[1:] + values[:-1]) / 2, axis=0, weights=np.diff(t))


def unwrapped(record, name: str) -> np.ndarray:
    """An angle of the record [degree]; where it turns on over 180 degrees, without the jump."""
    values = record[name].values
    return np.unwrap(values, period=360) if name in TURNING else values
