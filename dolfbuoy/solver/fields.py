"""Names for the components of a state, so that nobody counts offsets."""

from collections import namedtuple
from typing import Any

import numpy as np
import ufl

from . import Array


class Fields:
    """A state of named vectors: Fields(position=3, orientation=4) has seven components.

    `names`; `size`; `slices[name]`.
    """

    def __init__(self, **sizes: int) -> None:
        ends = np.cumsum(list(sizes.values())).tolist()
        self.names, self.size = tuple(sizes), ends[-1]
        self.slices = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        make: Any = namedtuple  # of names that are known here only
        self._tuple = make("State", self.names)

    def of(self, array: Array) -> Any:
        """Views of an array (..., size) by name: `.position` and so on."""
        return self._tuple(*[array[..., place] for place in self.slices.values()])

    def split(self, vector: Any) -> Any:
        """UFL vectors by name, of a UFL vector with `size` components."""
        components = [vector[i] for i in range(self.size)]
        return self._tuple(*(ufl.as_vector(components[place]) for place in self.slices.values()))

    def mask(self, *names: str) -> Array:
        """Which components belong to these names, a bool array (size,)."""
        found = np.zeros(self.size, dtype=bool)
        for name in names:
            found[self.slices[name]] = True
        return found

    def filled(self, **values: Any) -> Array:
        """An array (size,) with a value, or values, for each name."""
        array = np.zeros(self.size)
        for name in self.names:
            array[self.slices[name]] = values[name]
        return array
