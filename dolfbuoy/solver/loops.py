"""The loop over cells in C.

dolfinx's assemblers take packed coefficients and insert the tensor of every cell by itself.  Here one call of C does
all forms of a residual or of a Jacobian: it gathers coefficients and constants of a cell from one array, calls the
same kernel, and adds the tensor to a vector or leaves it where PETSc's COO assembly reads it (measured by
tests/verification/step_cost.py).  What has to be copied around that is done by C as well.

Several cells are done at once, one in each lane of the vector registers (`lanes`).  Their numbers stand lane by lane:
all that belongs to a cell is in blocks (cells of a block // lanes, numbers of a cell, lanes).
"""

from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from . import Array, c_code, compat, simd
from .c_code import address, core
from .unknowns import Contribution, Values
from .vector_ops import Work

#: Places that loops read, by their content.
_SAME: WeakValueDictionary[bytes, Array] = WeakValueDictionary()


class Scaled:
    """Some entries of an array in units of their own, as PETSc sees them: entry k is scale[k] * values[places[k]].

    scale: may be changed, in place.  ties: (places, entries): what is put into an entry goes to these places too, and
    what is taken from there is added to the entry.  `described`: for C.
    """

    def __init__(self, values: Any, places: Any, scale: Array, ties: tuple[Any, Any] = ((), ())) -> None:
        self.x = np.zeros(len(places))
        places, tied, to = (np.asarray(a, dtype=np.int32) for a in (places, *ties))
        self._alive = {"values": values, "scale": scale, "places": places, "tied": tied, "to": to}
        arrays = {name: address(array) for name, array in self._alive.items()}
        self.described = core().ffi.new("scaled *", {**arrays, "n": len(places), "ties": len(tied)})
        self._x = address(self.x)

    def take(self) -> Array:
        """x, from the values."""
        core().lib.take(self.described, self._x)
        return self.x

    def of(self, values: Array) -> "Scaled":
        """The same entries of another array."""
        one = self._alive
        return Scaled(values, one["places"], one["scale"], (one["tied"], one["to"]))

    def put(self, x: Array) -> None:
        """values[places[k]] = scale[k] * x[k]."""
        core().lib.put(self.described, core().ffi.from_buffer("double[]", x))


class Hooks:
    """Functions that are called before every evaluation of a residual or a Jacobian, in the order of `add`.

    A hook may change what the kernels are about to read: coefficients in the array `values` of a `Values`, and the
    coordinates of a mesh.  Residual and Jacobian at one state must see the same.
    """

    def __init__(self, values: Any) -> None:
        self.values, self.described = values, core().ffi.new("hooks *")
        self._alive: list[Any] = []
        self._room: Any = []  # for hooks, of which `described` counts those in use
        self._error: Any = None
        self.failed = np.zeros(1, dtype=np.int32)  #: for C: whether one has raised

    def add(self, function: str | int | Callable[[Array], object], context: Any = None) -> None:
        """function: name of one of the core, with its context, or the address of another
        void (*)(void *context, double *values), with that of its context; or a Python function of the array.

        What a Python function raises is raised by the evaluation, and the numbers of that evaluation mean nothing.
        """
        ffi, place = core().ffi, self.described.count
        if isinstance(function, str):
            function = ffi.addressof(core().lib, function)
        elif not isinstance(function, int):
            call = partial(lambda python, *_: python(self.values), function)
            function = ffi.callback("void(void *, double *)", call, onerror=self._failed)
            self._alive.append(function)
        if place == len(self._room):
            grown = ffi.new("hook[]", 2 * place + 8)
            grown[0:place] = self._room
            self.described.all = self._room = grown
        one = self._room[place]
        one.call, one.context = ffi.cast("hook_function *", function), ffi.cast("void *", context or 0)
        self.described.count += 1

    def _failed(self, kind: Any, error: Any, traceback: Any) -> None:
        self._error, self.failed[0] = error, 1

    def check(self) -> None:
        """Raise what a hook has raised."""
        if self._error is not None:
            error, self._error, self.failed[0] = self._error, None, 0
            raise error


class Shared:
    """Hooks of a System, and arrays that a hook may write: the same ones for all of its loops."""

    def __init__(self, hooks: Hooks) -> None:
        self.hooks = hooks
        self._coordinates: dict[int, tuple[Any, Array]] = {}
        self._counts: dict[tuple[int, bytes], tuple[Any, Array]] = {}

    def coordinates(self, mesh: Any) -> Array:
        """Vertices of the owned cells of a mesh (cells, 3 x vertices), where its quadrature points can be moved."""
        if id(mesh) not in self._coordinates:
            self._coordinates[id(mesh)] = mesh, np.ascontiguousarray(compat.cell_coordinates(mesh), dtype=np.float64)
        return self._coordinates[id(mesh)][1]

    def count(self, mesh: Any, cells: Array) -> Array:
        """Number of the cells, from the first on, that all integrals over these cells look at: an array of one."""
        key = id(mesh), np.asarray(cells, dtype=np.int32).tobytes()
        if key not in self._counts:
            self._counts[key] = mesh, np.array([len(cells)], dtype=np.int32)
        return self._counts[key][1]


class Loop:
    """The forms of `contributions`, added up by one call.

    values: a `Values` with all their unknowns, coefficients and constants.  shared: what all loops of a System
    share (`Shared`).  A residual is added to an array of `size` local unknowns.  Of Jacobians (size None) `out`
    holds the tensors, whose `entries` belong to local unknowns (rows, columns; -1: to none), and after them `spare`
    zeros.  `described`: for C.
    """

    def __init__(
        self,
        contributions: list["Contribution"],
        values: "Values",
        shared: Shared,
        size: int | None = None,
        spare: int = 0,
    ) -> None:
        self._shared, self._first, ffi, room = shared, 0, core().ffi, 0
        self._alive: list[Any] = []
        self._entries: list[Array] = []
        self._dofs: dict[int, Array] = {}
        sources = zip(contributions, values.sources(contributions), strict=True)
        found = [(c, integral, packed) for c, packed in sources for integral in compat.integrals(c.form, ffi)]
        described = ffi.new("integral[]", max(1, len(found)))
        for one, (c, integral, (coefficients, constants)) in zip(described, found, strict=False):
            dofs = [part.offset + self._dofs_of(part.function.function_space)[integral.cells] for part in c.sides]
            one.tensor = np.prod([d.shape[1] for d in dofs])
            self._inputs(one, c, integral, coefficients[integral.key], constants)
            self._outputs(one, dofs, size is None)
            room = max(room, one.lanes * (one.constants + one.coefficients + one.coordinates + one.tensor))
        if size is None:
            self.entries = np.concatenate([np.zeros((2, 0), np.int32), *self._entries], axis=1)
            size = self.entries.shape[1] + spare
        del self._entries, self._dofs
        self.out = c_code.aligned(size)
        self._alive.append(described)
        self.described = ffi.new("evaluation *", {"integrals": described, "count": len(found), "length": size})
        self.described.before, self.described.out = shared.hooks.described, address(self.out)
        self.described.values, self.described.room = self._doubles(values.array), room

    def __call__(self) -> Array:
        """`out`, from the present `values`."""
        core().lib.add_up(self.described)
        self._shared.hooks.check()
        return self.out

    def in_c(self, hooks: bool = True) -> Work:
        """The same for `together`; what a hook raises is raised by the next evaluation from Python.

        hooks: else those of the latest evaluation are good enough.
        """
        if hooks:
            return Work("integrate_all", self.described, self)
        described, none = core().ffi.new("evaluation *", self.described[0]), core().ffi.new("hooks *")
        described.before = none
        return Work("integrate_all", described, (self, none))

    def _inputs(
        self, one: Any, contribution: "Contribution", integral: Any, coefficients: Array, constants: Array
    ) -> None:
        cells, mesh = integral.cells, contribution.row.function.function_space.mesh
        x = self._shared.coordinates(mesh)
        one.coefficients, one.constants, one.coordinates = coefficients.shape[1], len(constants), x.shape[1]
        one.kernel, one.lanes = integral.kernel, 1
        if integral.facets is not None:
            one.facets = self._ints(integral.facets)
        elif len(cells) > 1:
            sizes = simd.Sizes(one.tensor, one.coefficients, one.constants, one.coordinates)
            one.kernel, one.lanes = simd.several(integral.kernel, sizes) or (integral.kernel, 1)
        one.cells = self._kept(self._shared.count(mesh, cells))
        one.apart = 3 if mesh.geometry.dim == 1 else 1
        common = np.all(coefficients == coefficients[:1], axis=0) & (len(cells) > 0)
        one.common, one.order = common.sum(), self._ints(np.argsort(~common, kind="stable"))
        one.w_common, one.w = self._ints(coefficients[:1, common]), self._by_lanes(one, coefficients[:, ~common])
        one.c, one.mesh = self._ints(constants), self._doubles(x)
        one.x = self._by_lanes(one, x.shape[1] * np.asarray(cells)[:, None] + np.arange(0, x.shape[1], one.apart))

    def _outputs(self, one: Any, dofs: list[Array], is_matrix: bool) -> None:
        one.shared = all(np.all(d == d[:1]) for d in dofs)
        if not is_matrix:
            one.targets = self._ints(dofs[0][:1]) if one.shared else self._by_lanes(one, dofs[0])
            return
        one.first = self._first
        if one.shared:
            one.targets = self._ints(one.first + np.arange(one.tensor))
            dofs = [d[:1] for d in dofs]
        rows, columns = dofs  # of every entry of the cells' tensors, (cells, entries)
        pair = np.repeat(rows, columns.shape[1], axis=1), np.tile(columns, rows.shape[1])
        entries = np.stack([_blocks(e, 1 if one.shared else one.lanes, -1).ravel() for e in pair])
        self._entries.append(np.pad(entries, ((0, 0), (0, -entries.shape[1] % c_code.ALIGNED)), constant_values=-1))
        self._first += self._entries[-1].shape[1]

    def _dofs_of(self, space: Any) -> Array:
        """Dofs of every owned cell, blocks one by one."""
        if id(space) not in self._dofs:
            blocks, size = compat.cell_dofs(space), space.dofmap.bs
            dofs = size * blocks[:, :, None] + np.arange(size, dtype=np.int32)
            self._dofs[id(space)] = dofs.reshape(len(blocks), -1)
        return self._dofs[id(space)]

    def _by_lanes(self, one: Any, numbers: Array) -> Any:
        """Address of numbers of every cell (cells, numbers); lanes that are too many do what the last cell does."""
        return self._ints(_blocks(numbers, one.lanes, numbers[-1:]))

    def _ints(self, array: Any) -> Any:
        """Address of numbers that nobody changes: of one array, where loops of several scenes have the same."""
        array = np.ascontiguousarray(array, dtype=np.int32)
        return self._kept(_SAME.setdefault(array.tobytes(), array))

    def _doubles(self, array: Any) -> Any:
        return self._kept(np.ascontiguousarray(array, dtype=np.float64))

    def _kept(self, array: Array) -> Any:
        self._alive.append(array)
        return address(array)


def _blocks(numbers: Array, lanes: int, more: Any) -> Array:
    """(cells, numbers of a cell) -> (blocks, numbers of a cell, lanes); more: of the cells that are too many."""
    cells, n = numbers.shape
    blocks = -(-cells // lanes)
    filled = np.empty((blocks * lanes, n), dtype=np.int32)
    filled[:cells], filled[cells:] = numbers, more
    return filled.reshape(blocks, lanes, n).swapaxes(1, 2)
