"""Unknowns as parts and blocks, and compiled forms that add to their residual and matrix."""

from dataclasses import dataclass, field

import numpy as np
import ufl

from . import compat


@dataclass
class Part:
    """Unknowns `offset ... offset + n` of this rank as the dofs of `function`."""

    name: str
    function: object
    offset: int
    test: object = field(init=False)
    trial: object = field(init=False)

    def __post_init__(self):
        space = self.function.function_space
        self.test, self.trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        self.size = len(self.function.x.array)
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

    def unknown_size(self, gamma, tolerance):
        """Typical size, enlarged so that `tolerance` times it is not below the rounding noise."""
        noise = 100 * np.finfo(float).eps * self.rounding * gamma**2
        return max(self.unknown, noise / tolerance)

    def residual_size(self, gamma):
        return self.rest + self.moving * gamma**self.order


class Contribution:
    """One compiled form and where it adds to the local residual or to the matrix.

    Constants and coefficients are packed once per solve (`prepare`); within a solve only the values of the unknowns
    change, and these are put straight where the kernels read them.
    """

    def __init__(self, form, row, column=None, unknowns=()):
        self.form = compat.compile_form(form)  # kept alive: the C++ object refers to it
        self.cpp = compat.cpp_form(self.form)
        self.row, self.column = row, column
        spaces = [p.function.function_space for p in (row, column) if p is not None]
        self._unrolled = any(s.dofmap.index_map_bs > 1 for s in spaces)  # the matrix knows no blocks
        live = [part for part in unknowns if part.function in form.coefficients()]
        self._live, self._unchanging = self._places(live), False
        self.prepare()
        self._unchanging = len(form.coefficients()) == len(live) and not len(self.constants)

    def _places(self, unknowns):
        """{key of an integral: (places in its packed coefficients, unknowns that belong there)}.

        Found by packing the numbers of the unknowns: the elements here are packed without a transformation.
        """
        kept = [part.function.x.array.copy() for part in unknowns]
        packed = []
        for sign in (1, -1):
            for part in unknowns:
                part.function.x.array[:] = sign * np.arange(part.slice.start + 1, part.slice.stop + 1)
            packed.append({key: np.array(array) for key, array in compat.pack_coefficients(self.cpp).items()})
        for part, values in zip(unknowns, kept, strict=True):
            part.function.x.array[:] = values
        places = {}
        for key, numbers in packed[0].items():
            where = np.flatnonzero(numbers != packed[1][key])
            if len(where):
                places[key] = where, numbers.ravel()[where].astype(np.intp) - 1
        return places

    def prepare(self, unknowns_too=True):
        """Read constants (time, step and phase of the wave are among them) and Functions again."""
        if self._unchanging and not unknowns_too:
            return
        self.constants = compat.pack_constants(self.cpp)
        self.coefficients = compat.pack_coefficients(self.cpp)
        self._flat = [(self.coefficients[key].reshape(-1), *places) for key, places in self._live.items()]

    def refresh(self, u):
        """Read the local unknowns `u`, and nothing else, again."""
        for coefficients, places, unknowns in self._flat:
            coefficients[places] = u[unknowns]

    def add_to_vector(self, b):
        compat.assemble_vector(b[self.row.slice], self.cpp, self.constants, self.coefficients)

    def add_to_matrix(self, A):
        compat.assemble_matrix(A, self.cpp, self.constants, self.coefficients, [], self._unrolled)
