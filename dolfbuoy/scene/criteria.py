"""Criteria that a mooring must meet: safety factors, offsets, lean, freeboard, anchors, and limits of any output."""

import re
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from . import quantities as q
from .quantities import Missing, Wrong
from .section import Section, key

if TYPE_CHECKING:
    from .sections import Scene

#: Breaking load over the largest tension of a dynamic analysis, by condition: API RP 2SK (2005), Sec. 7.2.
API = {"intact": 1.67, "one line broken": 1.25}
#: Partial factors of mean and dynamic tension, by condition and consequence class, and the fraction of the breaking
#: load that counts: DNV-OS-E301, Ch. 2 Sec. 2, ULS and ALS, dynamic analysis.
DNV = {
    ("intact", 1): (1.10, 1.50),
    ("intact", 2): (1.40, 2.10),
    ("one line broken", 1): (1.00, 1.10),
    ("one line broken", 2): (1.00, 1.25),
}
CHARACTERISTIC_STRENGTH = 0.95
_LIMIT = re.compile(r"\s*([a-z_]+)\.(max|min|mean|std)(?:\[([^\]]{1,200})\])?\s*([<>])\s*(\S+)\s*")


class Limit(NamedTuple):
    """A limit on an output: name of its series, statistic ("max", ...), part ("" for any), "<" or ">", bound."""

    series: str
    number: str
    part: str
    sign: str
    bound: float


class Criteria(Section):
    """Criteria that runs and equilibria are judged by."""

    safety: Literal["API", "DNV"] | None = key(
        "safety factors of lines with a breaking load, of API RP 2SK or DNV-OS-E301", default=None
    )
    safety_factor: Annotated[float, Field(ge=1, le=100)] | None = key(
        "least breaking load over largest tension, a number of one's own", "1", default=None
    )
    condition: Literal["intact", "one line broken"] = key("condition that `safety` is for", default="intact")
    consequence_class: Annotated[int, Field(ge=1, le=2)] = key("consequence class of DNV-OS-E301", "1", default=1)
    largest_offset: q.Length | None = key("largest horizontal distance of a buoy from its anchor", "m", default=None)
    largest_lean_deg: Annotated[float, Field(gt=0, le=180)] | None = key(
        "largest angle between a buoy's axis and the vertical", "deg", default=None
    )
    least_freeboard: q.Height | None = key(
        "least height of the lowest point of a hull's rim above the water", "m", default=None
    )
    no_uplift: bool = key("anchors may not be pulled upwards", default=False)
    largest_anchor_force: Annotated[float, Field(gt=0, le=1e10)] | None = key(
        "largest horizontal force on an anchor", "N", default=None
    )
    limits: Annotated[list[q.Expression], Field(max_length=100)] = key(
        "limits of outputs, 'SERIES.max < NUMBER', with .min, .mean, .std, [PART] and > too", default=[]
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.safety is None:
            self.refuse(["condition"], "goes with safety = 'API' or 'DNV'")
        if self.safety != "DNV":
            self.refuse(["consequence_class"], "goes with safety = 'DNV'")
        if all(getattr(self, name) == info.default for name, info in type(self).model_fields.items()):
            raise Missing("safety_factor", "or another criterion: there is none")
        _ = self.parsed
        return self

    @property
    def parsed(self) -> list[Limit]:
        """The parsed limits on outputs.  Raises Wrong for an invalid one."""
        found = []
        for k, text in enumerate(self.limits):
            parts = _LIMIT.fullmatch(text)
            try:
                name, number, part, sign, bound = parts.groups()  # type: ignore[union-attr]
                found.append(Limit(name, number, part or "", sign, q.number_of(bound)))
            except (AttributeError, ValueError):
                allowed = "must be SERIES.max < NUMBER, with max, min, mean or std, < or >, and [PART] if it is of one"
                raise Wrong(f"limits.{k}", text, allowed) from None
        return found


def check_criteria(scene: "Scene") -> None:
    """Raise Missing for criteria on parts that a scene does not have."""
    criteria, network = scene.criteria, scene.network
    if criteria is None:
        return
    strong = any(piece.section.breaking_load for piece in network.pieces)
    if (criteria.safety or criteria.safety_factor) and not strong:
        raise Missing("cable.breaking_load", "criteria.safety and safety_factor are of what it holds")
    for name in ("largest_offset", "largest_lean_deg", "least_freeboard"):
        if getattr(criteria, name) is not None and not network.buoys:
            raise Missing("buoy", f"criteria.{name} is of one")
    if criteria.least_freeboard is not None and scene.sea is None:
        raise Missing("sea", "criteria.least_freeboard is above its surface")
