"""Unknowns as parts and blocks, and compiled forms that add to their residual and matrix."""

from dataclasses import dataclass, field

import numpy as np
import ufl

from . import compat


@dataclass
class Part:
    """Unknowns `offset ... offset + n` of this rank as the dofs of `function`, whose array is `values`."""

    name: str
    function: object
    offset: int
    test: object = field(init=False)
    trial: object = field(init=False)
    values: np.ndarray = field(init=False)

    def __post_init__(self):
        space = self.function.function_space
        self.test, self.trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        self.values = self.function.x.array
        self.size = len(self.values)
        self.slice = slice(self.offset, self.offset + self.size)


@dataclass
class Block:
    """Unknowns of one kind, for scaling and for messages.

    `unknown` is their typical size; a residual row counts as `rest + moving * gamma**order`, gamma = 1/dt-like.
    Rounding in the positions reaches these unknowns as `rounding * gamma**2` times the machine's epsilon: forces are
    second derivatives of positions here.
    """

    name: str
    dofs: np.ndarray  # local indices
    unknown: float
    rest: float
    moving: float = 0.0
    order: int = 1
    rounding: float = 0.0
    unit: str = ""  # of the unknown

    def unknown_size(self, gamma, tolerance):
        """Typical size, enlarged so that `tolerance` times it is not below the rounding noise."""
        noise = 100 * np.finfo(float).eps * self.rounding * gamma**2
        return max(self.unknown, noise / tolerance)

    def residual_size(self, gamma):
        return self.rest + self.moving * gamma**self.order


class Values:
    """Values of the unknowns of this rank and, behind them, of every other Function that the forms read: one array.

    Packed coefficients are an indexed copy of it.  Place 0 holds a zero: not every integral reads every coefficient.
    """

    def __init__(self, parts=()):
        self._places = {id(part.function): slice(1 + part.offset, 1 + part.slice.stop) for part in parts}
        self._functions = [(self._places[id(part.function)], part.values) for part in parts]
        self.unknowns = slice(1, 1 + max((part.slice.stop for part in parts), default=0))
        self.array = np.zeros(self.unknowns.stop)

    def place(self, function):
        """Slice of a Function's values, which get a place if they have none yet."""
        if id(function) not in self._places:
            begin, values = len(self.array), function.x.array
            self._places[id(function)] = slice(begin, begin + len(values))
            self._functions.append((self._places[id(function)], values))
            self.array = np.concatenate([self.array, values])
        return self._places[id(function)]

    def read(self):
        """Read all Functions again."""
        for place, values in self._functions:
            self.array[place] = values


class Contribution:
    """One compiled form and where it adds to the local residual or to the matrix.

    values: shared by the contributions of a system.  Constants are packed by `read_constants`, once per solve; the
    coefficients, by `refresh`, are put straight where the kernels read them.
    """

    def __init__(self, form, row, column=None, values=None):
        self.form = compat.compile_form(form)  # kept alive: the C++ object refers to it
        self.cpp = compat.cpp_form(self.form)
        self.row, self.column, self.values = row, column, values or Values()
        spaces = [p.function.function_space for p in (row, column) if p is not None]
        self._unrolled = any(s.dofmap.index_map_bs > 1 for s in spaces)  # the matrix knows no blocks
        self.constants = compat.pack_constants(self.cpp)
        self.coefficients = compat.pack_coefficients(self.cpp)
        self._packed = self._sources(form.coefficients())

    def _sources(self, functions):
        """[(packed coefficients of an integral, where in `values` each of them is)].

        Found by packing the places: the elements here are packed without a transformation.
        """
        kept = [function.x.array.copy() for function in functions]
        for function in functions:
            place = self.values.place(function)
            function.x.array[:] = np.arange(place.start, place.stop)
        numbers = compat.pack_coefficients(self.cpp)
        for function, values in zip(functions, kept, strict=True):
            function.x.array[:] = values
        return [(self.coefficients[key].reshape(-1), n.ravel().astype(np.intp)) for key, n in numbers.items()]

    def prepare(self):
        """Read constants and Functions again."""
        self.read_constants()
        self.values.read()
        self.refresh()

    def read_constants(self):
        """Read the constants again; time, step and the phase of the wave are among them."""
        if len(self.constants):
            self.constants = compat.pack_constants(self.cpp)

    def refresh(self):
        """Read the coefficients again from `values`."""
        for coefficients, places in self._packed:
            self.values.array.take(places, out=coefficients, mode="clip")  # the mode in which it does not buffer

    def add_to_vector(self, b):
        compat.assemble_vector(b[self.row.slice], self.cpp, self.constants, self.coefficients)

    def add_to_matrix(self, A):
        compat.assemble_matrix(A, self.cpp, self.constants, self.coefficients, [], self._unrolled)
