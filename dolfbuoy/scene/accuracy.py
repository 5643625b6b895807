"""The section [accuracy]."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .quantities import Title, Wrong
from .section import Section, key


class Accuracy(Section):
    """Error bars of the outputs of a run; without this section nothing is estimated."""

    estimate: Literal["none", "time", "companion", "both"] = key(
        "companion: from a second, coarser run; time: error of the steps over time; both", default="both"
    )
    target: Annotated[float, Field(ge=1e-5, le=0.5)] | None = key(
        "largest error of the outputs in `of`, relative; with it settings are found that reach it", "1", default=None
    )
    of: Annotated[list[Title], Field(max_length=100)] = key(
        "outputs that must reach it, as tension_top.max; absent: largest tensions and cone angle",
        default=[],
    )
    rounds: Annotated[int, Field(ge=1, le=10)] = key("runs until it is given up", "1", default=4)

    @model_validator(mode="after")
    def _consistent(self):
        for name in ("of", "rounds"):
            value = getattr(self, name)
            if value != type(self).model_fields[name].default and self.target is None:
                raise Wrong(name, value, "goes with a target only")
        if self.target is not None and self.estimate in ("none", "time"):
            raise Wrong("estimate", self.estimate, "does not go with a target, which needs bars")
        return self
