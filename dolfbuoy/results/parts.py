"""Parts of a record: the variables of one cable, or of one buoy."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import InputError
from .places import AT
from .quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

#: Dimensions of the variables that belong to a cable, buoy, anchor, take-off, winch and vessel.
OWN = {"cable": {"cable", "segment", "node", "cell", "place"}, "buoy": {"buoy"}, "anchor": {"anchor"}}
OWN |= {"take_off": {"take_off"}, "winch": {"winch"}, "vessel": {"vessel"}}
#: Dimensions that a part of a record keeps if they are its own, and drops otherwise.
_SHARED = {"attachment", "joint"}.union(*OWN.values())


class Part(NamedTuple):
    """label: the name, empty for the only one.  record: without the dimension `cable` or `buoy`, now a scalar."""

    label: str
    record: "xr.Dataset"

    def named(self, sentences: Iterable[str]) -> list[str]:
        """Sentences about this part, with its name if there are several."""
        return [f"{self.label}: {sentence}" if self.label else sentence for sentence in sentences]


def names_of(record: "xr.Dataset", kind: str) -> list[str]:
    """Names of the cables or buoys of a record.  Raises InputError for a record that was squeezed."""
    if kind in record.dims:
        return list(record[kind].values.tolist())
    for name in record.data_vars:
        if name in QUANTITIES and kind in QUANTITIES[name].dims:
            raise InputError(f"{name} of this record has no dimension {kind}: give the record as it was, not squeezed.")
    return []


def parts_of(record: "xr.Dataset", *kinds: str) -> list[Part]:
    """The parts of all cables, then all buoys, and so on.  Lazy: nothing is copied."""
    named = [(kind, name, names_of(record, kind)) for kind in kinds for name in names_of(record, kind)]
    return [Part(name if len(names) > 1 else "", part_of(record, kind, name)) for kind, name, names in named]


def part_of(record: "xr.Dataset", kind: str, name: str) -> "xr.Dataset":
    """The record of the cable, or the buoy, of this name."""
    found = record.drop_dims((_SHARED - OWN[kind]) & set(record.dims))
    number = names_of(record, kind).index(name)
    if "segment" in found.dims:
        mine = [segment for segment in names_of(record, "segment") if segment.partition(".")[0] == name]
        found = found.sel(segment=mine) if mine else found.drop_dims("segment")
    if "place" in found.dims:
        of = [place.partition(AT)[0].partition(".")[0] == name for place in names_of(record, "place")]
        found = found.isel(place=np.flatnonzero(of)) if any(of) else found.drop_dims("place")
    for dimension in {"node", "cell"} & set(found.dims):
        own = np.flatnonzero(found[f"{kind}_of_{dimension}"].values == number)
        found = found.isel({dimension: slice(own[0], own[-1] + 1)})
    return found.isel({kind: number})


def alone(record: "xr.Dataset") -> "xr.Dataset":
    """A record without the dimensions cable, buoy, ... of size 1, for interactive use."""
    kinds = ("cable", "buoy", "attachment", "anchor", "segment", "take_off", "winch")
    return record.squeeze([d for d in kinds if record.sizes.get(d) == 1], drop=True)
