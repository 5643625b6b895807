"""The section [waves]: a regular wave, or an irregular sea."""

import itertools
import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from . import quantities as q
from .quantities import Missing, Wrong
from .section import Section, key
from .wave_files import FORMULAS, columns_of, spectrum_of

MOST_COMPONENTS = 10_000
MOST_INSTANTS = 200_000


class DirectionalSpectrum(Section):
    """A spectrum over frequencies and directions, as a netCDF file with efth(freq, dir) holds it."""

    frequency: Annotated[list[q.Frequency], Field(max_length=1000)] = key("frequencies in ascending order", "Hz")
    direction_deg: Annotated[list[q.Angle], Field(max_length=1000)] = key(
        "directions of propagation in ascending order, counterclockwise from x", "deg"
    )
    density: Annotated[list[list[q.SpectralDensity]], Field(max_length=1000)] = key(
        "spectral density, one row per frequency with one number per direction", "m^2/Hz/deg"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("frequency", "direction_deg"):
            _check_rising(name, getattr(self, name), 2)
        if self.direction_deg[-1] - self.direction_deg[0] >= 360:
            raise Wrong("direction_deg", self.direction_deg, "must lie within a full turn")
        if len(self.density) != len(self.frequency) or any(len(r) != len(self.direction_deg) for r in self.density):
            raise Wrong("density", "...", "must hold one row for each frequency, one number for each direction")
        if not any(any(row) for row in self.density):
            raise Wrong("density", "...", "must not be zero everywhere")
        return self


Spectrum = Annotated[
    Literal["jonswap", "pierson-moskowitz"]
    | Annotated[list[q.SpectrumRow], Field(max_length=10_000)]
    | DirectionalSpectrum,
    BeforeValidator(spectrum_of),
]
Components = Annotated[
    Annotated[int, Field(gt=0, le=MOST_COMPONENTS)]
    | Annotated[list[q.Component], Field(min_length=1, max_length=MOST_COMPONENTS)],
    BeforeValidator(columns_of(4, "a number, a table, or the name of a file")),
]
Record = Annotated[
    list[q.Instant],
    Field(max_length=MOST_INSTANTS),
    BeforeValidator(columns_of(2, "a table, or the name of a file")),
]

#: Kinds of waves, by the words of their keys.
REGULAR, SPECTRUM, COMPONENTS, ELEVATION = "period", "spectrum", "components", "elevation"
#: Keys that belong to one kind only.
_OF = {
    REGULAR: ("amplitude", "height", "wavelength", "phase_deg", "theory", "order"),
    SPECTRUM: ("significant_height", "peak_period", "gamma", "spreading", "seed", "amplitudes", "crest"),
}
#: Keys of a prescribed crest, which go with `crest`.
_OF_CREST = ("crest_time", "crest_position", "crest_sea")


class Waves(Section):
    """A regular wave (amplitude or height, period), or an irregular sea (spectrum, components or elevation)."""

    amplitude: Annotated[float, Field(ge=0, le=1e4)] | None = key(
        "wave amplitude a, half the height", "m", default=None
    )
    height: Annotated[float, Field(ge=0, le=2e4)] | None = key("wave height, trough to crest", "m", default=None)
    period: q.Period | None = key("period of a regular wave", "s", default=None)
    wavelength: q.Wavelength | None = key(
        "wavelength; absent: from the dispersion relation; of theory stream instead of the period", "m", default=None
    )
    direction_deg: q.Angle = key("direction of propagation, counterclockwise from x", "deg", default=0.0)
    phase_deg: q.Angle = key("phase of the elevation a cos(k.x - omega t + phase_deg)", "deg", default=0.0)
    ramp: q.Duration = key("ramp-up time of the waves", "s", default=0.0)
    stretching: Literal["wheeler", "vertical", "none"] = key(
        "extrapolation of the wave kinematics above still water", default="wheeler"
    )
    theory: Literal["airy", "stream"] = key(
        "theory of a regular wave: linear, or of finite height by a stream function", default="airy"
    )
    order: Annotated[int, Field(ge=4, le=64)] = key("harmonics of a wave of theory stream", "1", default=20)
    period_seen_from: Literal["water", "ground"] | None = key(
        "frame of the periods in a current: intrinsic (water) or apparent (ground); absent: no Doppler shift",
        default=None,
    )
    spectrum: Spectrum | None = key("wave spectrum, [[f, S], ...] or a file", "Hz, m^2/Hz", default=None)
    significant_height: Annotated[float, Field(ge=0, le=1e4)] | None = key(
        "significant wave height Hs = 4 sqrt(m0)", "m", default=None
    )
    peak_period: q.Period | None = key("peak period Tp of the spectrum", "s", default=None)
    gamma: Annotated[float, Field(ge=1, le=100)] = key("JONSWAP peak-enhancement factor", "1", default=3.3)
    spreading: Annotated[float, Field(gt=0, le=1e4)] | None = key(
        "spreading exponent s of cos^2s(angle/2) about direction_deg; absent: long-crested", "1", default=None
    )
    components: Components = key(
        "number of components, [[amplitude, period, direction_deg, phase_deg], ...] or a file of them",
        "m, s, deg, deg",
        default=200,
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = key(
        "seed of the random phases, directions and amplitudes", "1", default=0
    )
    band: Annotated[list[q.Multiple], Field(min_length=1, max_length=2)] | None = key(
        "frequency band [low, high] over the peak frequency; absent: 0.5 (a table: all) to 99.9 % of m0",
        "1",
        default=None,
    )
    amplitudes: Literal["fixed", "random"] = key(
        "component amplitudes: fixed by the spectrum, or Rayleigh-distributed as in short records", default="fixed"
    )
    kinematics: Literal["step", "exact"] = key(
        "wave kinematics of seas and steep waves: once per step with gradients, or at every iterate", default="step"
    )
    crest: Annotated[float, Field(gt=0, le=1e4)] | None = key(
        "height of a crest that the sea is to have, above still water; absent: none", "m", default=None
    )
    crest_time: q.Duration | None = key("time of that crest", "s", default=None)
    crest_position: q.Pair = key("place [x, y] of that crest", "m", default=(0.0, 0.0))
    crest_sea: Literal["random", "newwave"] = key(
        "sea around that crest: the random one of seed, or its mean shape alone (NewWave)", default="random"
    )
    elevation: Record | None = key(
        "measured surface elevation at x = y = 0, [[t, eta], ...] or a file of these columns", "s, m", default=None
    )

    @model_validator(mode="after")
    def _one_sea(self) -> Self:
        given = [name for name, there in self._kinds().items() if there]
        if len(given) != 1:
            if not given:
                raise Missing("period", "or spectrum, components or elevation of an irregular sea")
            value = getattr(self, given[1])
            value = value if isinstance(value, str | int | float) else "..."
            raise Wrong(given[1], value, f"does not go with {given[0]}: give one of them")
        for kind, names in _OF.items():
            if kind != given[0]:
                self.refuse(names, f"goes with {kind} only, not with {given[0]}")
        if given[0] != REGULAR and self.stretching == "none":
            allowed = "goes with period only: above still water the exponentials of short waves grow without bound"
            raise Wrong("stretching", self.stretching, allowed)
        if self.crest is None:
            self.refuse(_OF_CREST, "goes with crest only")
        elif self.crest_time is None:
            raise Missing("crest_time", f"time at which the crest of {self.crest:g} m comes [s]")
        elif self.crest_time < self.ramp:
            raise Wrong("crest_time", self.crest_time, f"must not lie within the ramp of {self.ramp:g} s")
        checks = {REGULAR: self._regular, SPECTRUM: self._spectrum, ELEVATION: self._elevation}
        checks.get(given[0], lambda: None)()
        return self

    def _kinds(self) -> dict[str, bool]:
        sea = {
            SPECTRUM: self.spectrum is not None,
            COMPONENTS: isinstance(self.components, list),
            ELEVATION: self.elevation is not None,
        }
        sized = self.amplitude is not None or self.height is not None
        return {REGULAR: self.period is not None or (sized and not any(sea.values()))} | sea

    def _regular(self) -> None:
        steep = self.theory == "stream"
        if self.period is None and not (steep and self.wavelength is not None):
            raise Missing("period", "period of a regular wave [s]" + (", or its wavelength" if steep else ""))
        if self.amplitude is None and self.height is None:
            raise Missing("amplitude", "or height, which is twice as much")
        if self.amplitude is not None and self.height is not None:
            raise Wrong("height", self.height, f"does not go with amplitude = {self.amplitude}: give one of them")
        self.refuse(("band", "components"), "goes with an irregular sea only, not with period")
        if self.theory == "airy":
            self.refuse(["kinematics"], "goes with an irregular sea or theory = 'stream', not with an Airy wave")
            self.refuse(["order"], "goes with theory = 'stream' only")
            return
        self.refuse(
            ["amplitude"],
            "does not go with theory = 'stream', whose crest is higher than its trough is deep: give height",
        )
        if self.wavelength is not None:
            both = f"follows from height and period = {self.period} with theory = 'stream': give one of them"
            if self.period is not None:
                raise Wrong("wavelength", self.wavelength, both)
            if self.period_seen_from == "ground":
                raise Wrong("period_seen_from", "ground", "goes with period: a wavelength has the period in the water")
        self.refuse(["stretching"], "does not go with theory = 'stream', which holds up to the crest")
        if not self.height:
            raise Wrong("height", self.height, "must be above 0 with theory = 'stream'")

    def with_period(self, depth: float, gravity: float) -> Self:
        """The same steep wave with its period, which follows from height and wavelength [m, m/s^2]."""
        if self.period is not None or self.wavelength is None:
            return self
        from .stream import steady_wave

        k = 2 * math.pi / self.wavelength
        wave = steady_wave(self.height or 0.0, None, depth, gravity, 0.0, self.order, k)
        return self.model_copy(update={"period": 2 * math.pi / (k * wave.speed), "wavelength": None})

    def _spectrum(self) -> None:
        formula = self.spectrum in FORMULAS if isinstance(self.spectrum, str) else False
        for name in ("significant_height", "peak_period"):
            value = getattr(self, name)
            if formula and value is None:
                raise Missing(name, f"spectrum = {self.spectrum!r} needs it")
            if not formula:
                self.refuse([name], "does not go with a table, which has its own")
        if self.spectrum != "jonswap":
            self.refuse(["gamma"], "goes with 'jonswap' only")
        if isinstance(self.spectrum, DirectionalSpectrum) and self.spreading is not None:
            raise Wrong("spreading", self.spreading, "does not go with a spectrum that has directions")
        if isinstance(self.spectrum, list):
            _check_rising("spectrum", [f for f, _ in self.spectrum], 2)
            if not any(S for _, S in self.spectrum):
                raise Wrong("spectrum", "...", "must not be zero everywhere")
        if self.band is not None and len(self.band) == 2 and self.band[1] <= self.band[0]:
            raise Wrong("band", self.band, "must rise")

    def _elevation(self) -> None:
        times = [t for t, _ in self.elevation or []]
        _check_rising("elevation", times, 8)
        step = (times[-1] - times[0]) / (len(times) - 1)
        if any(abs(b - a - step) > 1e-3 * step for a, b in itertools.pairwise(times)):
            raise Wrong("elevation", "...", "must be given at equal steps of time")
        if self.period_seen_from == "water":
            raise Wrong("period_seen_from", "water", "does not go with an elevation, which the ground sees")

    @property
    def kind(self) -> str:
        """REGULAR, SPECTRUM, COMPONENTS or ELEVATION."""
        return next(name for name, there in self._kinds().items() if there)

    @property
    def irregular(self) -> bool:
        """True if it has more than one period."""
        return self.period is None

    @property
    def summed(self) -> bool:
        """True for a sum of components, computed in C: an irregular sea, or the harmonics of a steep wave."""
        return self.irregular or self.theory == "stream"

    @property
    def size(self) -> float:
        """Amplitude of a regular wave, half the height [m]."""
        return self.amplitude if self.amplitude is not None else (self.height or 0.0) / 2

    @property
    def main_period(self) -> float:
        """Period of the regular wave, or at the peak of the sea; for an elevation, the mean between crossings [s]."""
        given = self.period or self.peak_period
        if given is not None:
            return given
        if isinstance(self.components, list):
            return max(self.components)[1]
        if self.elevation is not None:  # between up-crossings of the mean; else the whole record
            mean = sum(eta for _, eta in self.elevation) / len(self.elevation)
            crossings = [t for (t, a), (_, b) in itertools.pairwise(self.elevation) if a < mean <= b]
            first, *_, last = crossings if len(crossings) > 1 else [self.elevation[0][0], self.elevation[-1][0]]
            return (last - first) / max(len(crossings) - 1, 1)
        if isinstance(self.spectrum, DirectionalSpectrum):
            sums = [sum(row) for row in self.spectrum.density]
            return 1 / self.spectrum.frequency[sums.index(max(sums))]
        rows = self.spectrum if isinstance(self.spectrum, list) else []
        return 1 / max(rows, key=lambda row: row[1])[0]


def _check_rising(name: str, values: Sequence[float], least: int) -> None:
    if len(values) < least or not q.is_rising(values):
        raise Wrong(name, "...", f"must hold at least {least} rows that rise")
