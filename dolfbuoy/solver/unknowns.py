"""Unknowns as parts and blocks, and compiled forms that contribute to residual and matrix."""

from collections import namedtuple
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import ufl

from . import Array, compat
from .vector_ops import Work, copies


@dataclass
class Part:
    """Unknowns `offset ... offset + n` of this rank as the dofs of `function`, whose array is `values`."""

    name: str
    function: Any
    offset: int
    test: Any = field(init=False)
    trial: Any = field(init=False)
    values: Array = field(init=False)

    def __post_init__(self) -> None:
        space = self.function.function_space
        self.test, self.trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        self.values = self.function.x.array
        self.size = len(self.values)
        self.slice = slice(self.offset, self.offset + self.size)


@dataclass
class Block:
    """Unknowns of one kind, for scaling and for messages.

    `unknown` is their typical size; that of a residual row is `rest + moving * gamma**order`, with gamma ~ 1/dt.
    Rounding errors of the positions appear in these unknowns as `rounding * gamma**2` or `of_shape` times the machine
    epsilon: forces are second derivatives of positions in time, moments along the line.
    """

    name: str
    dofs: Array  # local indices
    unknown: float
    rest: float
    moving: float = 0.0
    order: int = 1
    rounding: float = 0.0
    of_shape: float = 0.0
    unit: str = ""  # of the unknown

    def unknown_size(self, gamma: float, tolerance: float) -> float:
        """Typical size, enlarged so that `tolerance` times it is not below rounding errors."""
        noise = 100 * float(np.finfo(float).eps) * self.rounding * gamma**2
        return max(self.unknown, noise / tolerance, 100 * float(np.finfo(float).eps) * self.of_shape / tolerance)


class Values:
    """One array with the unknowns of this rank, followed by all other data read by the forms.

    parts: the unknowns.  forms: UFL forms, each of whose coefficients and constants gets a place.  Place 0 holds a zero
    for coefficients that an integral does not read.
    """

    def __init__(self, parts: list[Part], forms: Any) -> None:
        self._places: dict[int, slice] = {}
        unknown, end = [], 1
        self._given: dict[int, tuple[slice, Array]] = {}  # place and values of other data of the forms, by identity
        for part in parts:
            self._places[id(part.function)] = slice(1 + part.offset, 1 + part.slice.stop)
            unknown.append((self._places[id(part.function)], part.values))
            end = max(end, 1 + part.slice.stop)
        unknowns = slice(1, end)
        for form in forms:
            for thing in _read_by(form):
                if id(thing) not in self._places:
                    values = array_of(thing)
                    self._places[id(thing)] = slice(end, end + len(values))
                    self._given[id(thing)] = self._places[id(thing)], values
                    end += len(values)
        self.array = np.zeros(end)
        self.unknowns = self.array[unknowns]
        #: Read the unknowns from the parts' Functions.
        self.read_unknowns = self._reader(unknown)
        self._read_given: Work | None = None

    @property
    def read_given(self) -> Work:
        """Function that re-reads coefficients and constants, such as time, step and wave phase."""
        if self._read_given is None:
            self._read_given = self._reader(self._given.values())
        return self._read_given

    def _reader(self, pieces: Iterable[tuple[slice, Array]]) -> Work:
        return copies([(self.array[place], values) for place, values in pieces])

    def leave(self, things: Any) -> None:
        """Stop reading these, because a hook fills them."""
        for thing in things:
            self._given.pop(id(thing), None)
        self._read_given = None

    def of(self, thing: Any) -> Array | None:
        """The values of a Function or Constant, a view; None if no form reads it."""
        place = self._places.get(id(thing))
        return None if place is None else self.array[place]

    def sources(self, contributions: Any) -> list[tuple[dict[Any, Array], Array]]:
        """Places of each packed coefficient, by integral, and each packed constant of each form in `array`.

        Found by packing the places: the elements here are packed without a transformation.
        """
        things = {id(thing): thing for c in contributions for thing in _read_by(c.ufl_form)}
        read = [(array_of(thing), self._places[key]) for key, thing in things.items()]
        kept = [values.copy() for values, _ in read]
        for values, place in read:
            values[:] = np.arange(place.start, place.stop)
        for contribution in contributions:
            contribution.prepare()
        for (values, _), old in zip(read, kept, strict=True):
            values[:] = old
        ints = partial(np.asarray, dtype=np.int32)
        return [
            ({key: ints(packed) for key, packed in c.coefficients.items()}, ints(c.constants)) for c in contributions
        ]


def _read_by(form: Any) -> list[Any]:
    return [*form.coefficients(), *form.constants()]


def array_of(thing: Any) -> Array:
    """Values of a Function or of a Constant as a flat view."""
    return thing.x.array if hasattr(thing, "x") else np.reshape(thing.value, -1)


class Contribution:
    """One compiled form and its place in the local residual or matrix.

    The methods evaluate it with dolfinx; a System evaluates all its forms in its own loop (loops.Loop).
    """

    def __init__(self, form: Any, row: Any, column: Any = None) -> None:
        self.ufl_form = form
        self.form = compat.compile_form(form)  # kept alive: the C++ object refers to it
        self.cpp = compat.cpp_form(self.form)
        self.row, self.column = row, column
        self.sides = [part for part in (row, column) if part is not None]
        self.constants = self.coefficients = None

    def prepare(self) -> None:
        """Pack constants and coefficients."""
        self.constants, self.coefficients = compat.pack_constants(self.cpp), compat.pack_coefficients(self.cpp)

    def add_to_vector(self, b: Array) -> None:
        """Add to the local residual `b`."""
        compat.assemble_vector(b[self.row.slice], self.cpp, self.constants, self.coefficients)


class Fields:
    """A state of named vectors: Fields(position=3, orientation=4) has seven components.

    `names`; `size`; `slices[name]`.
    """

    def __init__(self, **sizes: int) -> None:
        ends = np.cumsum(list(sizes.values())).tolist()
        self.names, self.size = tuple(sizes), ends[-1]
        self.slices = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        make: Any = namedtuple  # with names unknown to type checkers
        self._tuple = make("State", self.names)

    def of(self, array: Array) -> Any:
        """Views of an array (..., size) by name: `.position` and so on."""
        return self._tuple(*[array[..., place] for place in self.slices.values()])

    def split(self, vector: Any) -> Any:
        """UFL vectors by name, from a UFL vector with `size` components."""
        components = [vector[i] for i in range(self.size)]
        return self._tuple(*(ufl.as_vector(components[place]) for place in self.slices.values()))

    def mask(self, *names: str) -> Array:
        """Mask of the components of these names, a bool array (size,)."""
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
