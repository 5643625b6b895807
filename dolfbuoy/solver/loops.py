"""The loop over cells in C.

dolfinx's assemblers take packed coefficients and insert the tensor of every cell separately.  Here one C call evaluates
all forms of a residual or Jacobian: it gathers the coefficients and constants of a cell from one array, calls the same
kernel, and adds the tensor to a vector or stores it where PETSc's COO assembly reads it (measured by
tests/verification/step_cost.py).  The necessary copies are done in C as well.

Several cells are evaluated at once, one in each lane of the vector registers (`lanes`).  Their data are interleaved:
everything for the cells is in blocks, shape (cells // lanes, numbers of a cell, lanes).
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

#: Index arrays of loops, by content, for sharing.
_SAME: WeakValueDictionary[bytes, Array] = WeakValueDictionary()


class Scaled:
    """Scaled entries of an array, as PETSc sees them: entry k is scale[k] * values[places[k]].

    scale: may be changed in place.  ties: (places, entries): `put` copies an entry to these places too, and `take`
    adds their values to the entry.  `described`: for C.
    """

    def __init__(self, values: Any, places: Any, scale: Array, ties: tuple[Any, Any] = ((), ())) -> None:
        self.x = np.zeros(len(places))
        places, tied, to = (np.asarray(a, dtype=np.int32) for a in (places, *ties))
        self._alive = {"values": values, "scale": scale, "places": places, "tied": tied, "to": to}
        arrays = {name: address(array) for name, array in self._alive.items()}
        self.described = core().ffi.new("scaled *", {**arrays, "n": len(places), "ties": len(tied)})
        self._x = address(self.x)

    def take(self) -> Array:
        """Read x from the values."""
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
    """Functions called before every evaluation of a residual or Jacobian, in the order of `add`.

    A hook may change the data of the kernels: coefficients in the array `values` of a `Values`, and the coordinates of
    a mesh.  They must be the same for residual and Jacobian at one state.
    """

    def __init__(self, values: Any) -> None:
        self.values, self.described = values, core().ffi.new("hooks *")
        self._alive: list[Any] = []
        self._room: Any = []  # storage for hooks; `described` has the number in use
        self._error: Any = None
        self.failed = np.zeros(1, dtype=np.int32)  #: for C: 1 if one has raised an exception

    def add(self, function: str | int | Callable[[Array], object], context: Any = None) -> None:
        """Add a hook; function: name of a core function, with its context, or the address of another
        void (*)(void *context, double *values), with that of its context; or a Python function of the array.

        Exceptions of a Python function are raised by the evaluation, whose results are then meaningless.
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
        """Raise the exception of a hook, if any."""
        if self._error is not None:
            error, self._error, self.failed[0] = self._error, None, 0
            raise error


class Shared:
    """Hooks of a System, and arrays that a hook may write to, shared by all its loops."""

    def __init__(self, hooks: Hooks) -> None:
        self.hooks = hooks
        self._coordinates: dict[int, tuple[Any, Array]] = {}
        self._counts: dict[tuple[int, bytes], tuple[Any, Array]] = {}

    def coordinates(self, mesh: Any) -> Array:
        """Vertices of the owned cells of a mesh (cells, 3 x vertices); changing them moves the quadrature points."""
        if id(mesh) not in self._coordinates:
            self._coordinates[id(mesh)] = mesh, np.ascontiguousarray(compat.cell_coordinates(mesh), dtype=np.float64)
        return self._coordinates[id(mesh)][1]

    def count(self, mesh: Any, cells: Array) -> Array:
        """Array (1,) with the number of cells, from the first on, used by all integrals over these cells."""
        key = id(mesh), np.asarray(cells, dtype=np.int32).tobytes()
        if key not in self._counts:
            self._counts[key] = mesh, np.array([len(cells)], dtype=np.int32)
        return self._counts[key][1]


class Loop:
    """The forms of `contributions`, summed by one call.

    values: a `Values` with all their unknowns, coefficients and constants.  shared: the `Shared` of all loops of a
    System.  A residual is added to an array of `size` local unknowns.  For Jacobians (size None) `out` holds the
    tensors, whose `entries` are local unknowns (rows, columns; -1: none), followed by `spare` zeros.  `described`:
    for C.
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
        """The same for `together`; exceptions of a hook are raised by the next evaluation from Python.

        hooks: whether to call the hooks, or use the data of the latest evaluation.
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
        """Dofs of every owned cell, with blocks expanded."""
        if id(space) not in self._dofs:
            blocks, size = compat.cell_dofs(space), space.dofmap.bs
            dofs = size * blocks[:, :, None] + np.arange(size, dtype=np.int32)
            self._dofs[id(space)] = dofs.reshape(len(blocks), -1)
        return self._dofs[id(space)]

    def _by_lanes(self, one: Any, numbers: Array) -> Any:
        """Address of interleaved numbers of every cell (cells, numbers); surplus lanes repeat the last cell."""
        return self._ints(_blocks(numbers, one.lanes, numbers[-1:]))

    def _ints(self, array: Any) -> Any:
        """Address of constant integers; equal arrays of several loops are shared."""
        array = np.ascontiguousarray(array, dtype=np.int32)
        return self._kept(_SAME.setdefault(array.tobytes(), array))

    def _doubles(self, array: Any) -> Any:
        return self._kept(np.ascontiguousarray(array, dtype=np.float64))

    def _kept(self, array: Array) -> Any:
        self._alive.append(array)
        return address(array)


def _blocks(numbers: Array, lanes: int, more: Any) -> Array:
    """(cells, numbers of a cell) -> (blocks, numbers of a cell, lanes); more: numbers for the surplus lanes."""
    cells, n = numbers.shape
    blocks = -(-cells // lanes)
    filled = np.empty((blocks * lanes, n), dtype=np.int32)
    filled[:cells], filled[cells:] = numbers, more
    return filled.reshape(blocks, lanes, n).swapaxes(1, 2)
