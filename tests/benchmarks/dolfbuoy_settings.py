"""dolfbuoy on a mooring: the limit to which its runs tend, and the cheapest settings that meet an accuracy."""

import math
from dataclasses import replace

from errors import BOTH, extrapolated, kept_of, parts_of
from moorings import END, Mooring

from dolfbuoy.errors import SolveError
from dolfbuoy.results import measured
from dolfbuoy.scene import settings
from dolfbuoy.scene.settings import Space, Stepping

ACCURACIES = (0.01, 0.001)


def _run(mooring, way, end):
    """way: Space and Stepping."""
    return measured.compute(settings.with_settings(mooring.lasting(end), *way), ["tension_top"])


def run(mooring: Mooring, way) -> dict | None:
    """What errors are measured on; None if it fails."""
    try:
        found = _run(mooring, way, mooring.until)
    except SolveError:
        return None
    return kept_of(found.t, found.values["tension_top"], mooring)


def seconds_of(mooring: Mooring, way) -> float:
    """CPU seconds of the steps until END."""
    return _run(mooring, way, END).cpu


def own_limit(mooring: Mooring) -> dict:
    """Of three refinements in space and time, extrapolated."""
    scheme, pair, cells, steps = mooring.finest
    ways = [(Space(*pair, cells * 2**k), Stepping(scheme, mooring.period / (steps * 2**k))) for k in range(3)]
    return extrapolated(*(run(mooring, way) for way in ways))


class Fit:
    """The cheapest settings of a mooring, from some that may be too strict or too coarse."""

    def __init__(self, mooring: Mooring):
        self.mooring, self.limit, self.known, self.measures = mooring, own_limit(mooring), {}, BOTH

    def parts(self, way) -> dict[str, float]:
        """Errors of Space and Stepping, as `parts_of`."""
        if way not in self.known:
            self.known[way] = parts_of(run(self.mooring, way), self.limit)
        return self.known[way]

    def error(self, way) -> float:
        """The larger part of those that are asked for."""
        return max(self.parts(way)[name] for name in self.measures)

    def cheapest(self, given, accuracy, measures=BOTH) -> tuple[tuple[Space, Stepping], float]:
        """Of the given ones, [mu, nu, elements, scheme, step] each, made stricter and coarser until they just do: the
        settings, and their error in these measures.  Newton's tolerance is a hundredth of the accuracy."""
        self.measures, found = measures, []
        for mu, nu, cells, scheme, step in given:
            way = Space(mu, nu, cells), Stepping(scheme, step, newton=accuracy / 100)
            for _ in range(8):
                if self.error(way) <= accuracy:
                    break
                way = self._finer(*way)
            found.append(self._coarsened(way, accuracy))
        return min(found, key=lambda pair: (pair[1] > accuracy, seconds_of(self.mooring, pair[0])))

    def _finer(self, space, stepping):
        space = replace(space, cells=round(1.15 * space.cells + 0.5))
        return settings.fitting(self.mooring.scene, space), replace(stepping, step=0.85 * stepping.step)

    def _coarsened(self, way, accuracy):
        """Larger steps and fewer elements in turn, as long as the accuracy holds: as MoorDyn's fewest segments."""
        tried = True
        while tried:
            tried = False
            for coarser in (self._larger_step, self._fewer_elements):
                candidate = coarser(*way)
                if candidate and self.error(candidate) <= accuracy:
                    way, tried = candidate, True
        return way, self.error(way)

    def _larger_step(self, space, stepping):
        return space, replace(stepping, step=1.25 * stepping.step)

    def _fewer_elements(self, space, stepping):
        """None where there are none fewer: every line has one."""
        fewer = settings.fitting(self.mooring.scene, replace(space, cells=max(2, math.floor(0.75 * space.cells + 0.5))))
        return (fewer, stepping) if fewer.cells < space.cells else None
