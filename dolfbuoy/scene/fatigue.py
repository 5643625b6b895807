"""The section [fatigue], and fatigue curves by name or by their constant with its unit.

N = K R^-m cycles of range R lead to failure.  R is a tension over a reference load (T-N curves: API RP 2SK, 3rd edition
2005; polyester: DNVGL-OS-E301 2018), or a stress in the steel (S-N curves: DNV-OS-E301).  API refers chain and links to
the breaking load of grade ORQ of the same bar, even if the chain has a better grade; this is used if `steel_area` gives
the bar.  K of wires falls with the mean tension.
"""

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field

from . import quantities as q
from .library import chain_strength
from .quantities import Missing, Wrong
from .section import Section, key

if TYPE_CHECKING:
    from .cable import Cable
    from .sections import Scene

#: Breaking load of a bar of oil rig quality over d^2 (44 - 0.08 d), d in mm [kN/mm^2] (IACS; API Spec 2F).
ORQ = 0.0211


class Curve(NamedTuple):
    """N = 10^(log_constant + by_mean Lm) R^-exponent; Lm: mean tension over the reference load.

    unit: of R: "MBL" for a tension over the reference load, "MPa" for a stress, "N" or "kN" for a tension.
    bar: True for the bar of a chain, which corrosion thins.
    """

    name: str
    exponent: float
    log_constant: float
    unit: str
    by_mean: float = 0.0
    bar: bool = False

    @property
    def of_grade_orq(self) -> bool:
        """True if ranges refer to the breaking load of grade ORQ of the same bar, unless the chain's own is less."""
        return self.bar and self.name.startswith("API")

    @property
    def needs(self) -> str:
        """Key of the line required by the unit of the ranges; empty if none is."""
        return {"MBL": "breaking_load", "MPa": "steel_area"}.get(self.unit, "")

    def reference(
        self, breaking_load: float | None = None, steel_area: float | None = None, corrosion: float = 0.0
    ) -> float:
        """Tension at which R = 1 [N], of a bar that has lost `corrosion` of its diameter [m].

        Raises Missing for a required key of the line, Wrong for a corrosion that leaves nothing.
        """
        numbers = {"breaking_load": breaking_load, "steel_area": steel_area}
        if self.needs and numbers[self.needs] is None:
            raise Missing(self.needs, f"the fatigue curve '{self.name}' refers ranges to it")
        whole = left = 0.0
        if self.bar and steel_area is not None:
            whole = math.sqrt(2 * steel_area / math.pi)  # two bars carry a link
            left = whole - corrosion
            if not left > 0:
                raise Wrong("fatigue.corrosion", corrosion, f"must be less than the bar of the chain, {whole:.4g} m")
        elif self.bar and corrosion:
            raise Missing("steel_area", f"fatigue.corrosion thins the bar of '{self.name}'")
        if self.unit == "MPa":
            return 1e6 * (steel_area or 0.0) * (left / whole if whole else 1.0) ** 2
        if self.unit != "MBL":
            return {"N": 1.0, "kN": 1e3}[self.unit]
        load = breaking_load or 0.0
        if corrosion and whole:
            load *= chain_strength(1.0, 1e3 * left) / chain_strength(1.0, 1e3 * whole)
        return min(load, chain_strength(ORQ, 1e3 * left)) if whole and self.of_grade_orq else load


def _named() -> Iterator[Curve]:
    for name, constant in (("studless", 316.0), ("studlink", 1000.0), ("connecting link", 178.0)):
        yield Curve(f"API {name}", 3.0, math.log10(constant), "MBL", bar=True)
    yield Curve("API six-strand", 4.09, 3.20, "MBL", -2.79)
    yield Curve("API spiral strand", 5.05, 3.25, "MBL", -3.43)
    yield Curve("DNV studless", 3.0, math.log10(6.0e10), "MPa", bar=True)
    yield Curve("DNV studlink", 3.0, math.log10(1.2e11), "MPa", bar=True)
    yield Curve("DNV six-strand", 4.0, math.log10(3.4e14), "MPa")
    yield Curve("DNV spiral strand", 4.8, math.log10(1.7e17), "MPa")
    yield Curve("DNV polyester", 13.46, math.log10(0.259), "MBL")


#: Curves by their names in a scene.
CURVES = {curve.name: curve for curve in _named()}
_OWN = re.compile(r"(\S+) (N|kN|MPa|MBL)\^(\S+)")
FORMS = "'6e10 MPa^3', '316 MBL^3' (of tensions over the breaking load) or '1e15 N^3'"


def curve_of(text: str) -> Curve:
    """The curve of a name, or of a constant with the unit of its ranges.  Raises ValueError."""
    if text in CURVES:
        return CURVES[text]
    found = _OWN.fullmatch(text)
    try:
        constant, exponent = (q.number_of(found[k]) for k in (1, 3)) if found else (0.0, 0.0)
    except ValueError:
        constant, exponent = 0.0, 0.0
    if found is None or not (constant > 0 and 1 <= exponent <= 50):
        raise ValueError(
            f"must be one of {', '.join(CURVES)}, or the constant of a curve with the unit of its ranges, like {FORMS}"
        )
    return Curve(text, exponent, math.log10(constant), found[2], bar=found[2] in ("MPa", "MBL"))


def _known(text: str) -> str:
    curve_of(text)
    return text


CurveText = Annotated[str, Field(max_length=100), AfterValidator(_known)]
SteelArea = Annotated[float, Field(gt=0, le=10)]
MOST_PLACES = 10_000
TINY = 1e-12


class Fatigue(Section):
    """Fatigue of lines: what `statistics` takes for it, and where tensions are recorded besides the ends."""

    curve: CurveText | None = key("curve of lines without a fatigue_curve of their own", default=None)
    connectors: CurveText | None = key(
        "curve of the links at ends and between segments; absent: that of the line there", default=None
    )
    places: list[Literal["joints", "touchdown", "hog", "sag"]] = key(
        "places where the tension is recorded, as the line lies at the start",
        default=["joints", "touchdown", "hog", "sag"],
    )
    spacing: q.Length | None = key("distance of further places along each line; absent: none", "m", default=None)
    corrosion: Annotated[float, Field(ge=0, le=0.1)] = key(
        "diameter that the bar of a chain has lost, in the fatigue only", "m", default=0.0
    )
    corrosion_rate: Annotated[float, Field(ge=0, le=0.01)] = key(
        "diameter that the bar of a chain loses in a year of its life, in the fatigue only", "m", default=0.0
    )
    safety_factor: Annotated[float, Field(ge=1, le=100)] = key(
        "factor that the life is divided by; 3 after API RP 2SK", "1", default=3.0
    )


def curve_on(section: "Cable", fatigue: Fatigue | None, linked: bool = False) -> str | None:
    """Text of the curve of a piece of line, or None; linked: at an end or a joint."""
    own = section.fatigue_curve or (fatigue.curve if fatigue else None)
    return (fatigue.connectors if fatigue and linked else None) or own


def check_fatigue(scene: "Scene") -> None:
    """Raise Wrong or Missing for curves of lines that lack the reference of their ranges."""
    network, fatigue = scene.network, scene.fatigue
    corrosion, thinned, any_curve = fatigue.corrosion if fatigue else 0.0, False, False
    rate = fatigue.corrosion_rate if fatigue else 0.0
    for piece in network.pieces:
        for text in {curve_on(piece.section, fatigue, linked) for linked in (False, True)} - {None}:
            curve, any_curve = curve_of(text or ""), True
            thinned |= curve.bar
            try:
                curve.reference(piece.section.breaking_load, piece.section.steel_area, corrosion + TINY * rate)
            except Missing as error:
                raise Missing(f"{network.key_of(piece.cable)}.{error.key}", error.why) from None
            except Wrong as error:
                raise Wrong(error.key, corrosion, error.allowed) from None  # as it was given
    if fatigue is None:
        return
    if not network.pieces:
        raise Missing("cable", "[fatigue] is of lines")
    if not any_curve:
        raise Missing("fatigue.curve", f"or fatigue_curve of a material: one of {', '.join(CURVES)}, or a constant")
    for name in ("corrosion", "corrosion_rate"):
        if getattr(fatigue, name) and not thinned:
            raise Wrong(f"fatigue.{name}", getattr(fatigue, name), "goes with chains: no line here has a curve of one")
    length = sum(piece.section.length for piece in network.pieces)
    if fatigue.spacing is not None and length > MOST_PLACES * fatigue.spacing:
        allowed = f"must be at least {length / MOST_PLACES:g} m, for {MOST_PLACES} places at most"
        raise Wrong("fatigue.spacing", fatigue.spacing, allowed)
