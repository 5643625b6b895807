"""The loop over cells in C.

dolfinx's assemblers take packed coefficients and insert the tensor of every cell by itself.  Here one call of C does
all forms of a residual or of a Jacobian: it gathers coefficients and constants of a cell from one array, calls the
same kernel, and adds the tensor to a vector or leaves it where PETSc's COO assembly reads it (`study step-cost`
measures what that brings).  What has to be copied around that is done by C as well.

Several cells are done at once, one in each lane of the vector registers (`lanes`).  Their numbers stand lane by lane:
all that belongs to a cell is in blocks (cells of a block // lanes, numbers of a cell, lanes).
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from . import c_code, compat, lanes
from .c_code import address

_DECLARATIONS = """
typedef struct {
    uintptr_t kernel;          /* for one cell: tabulate_tensor of FFCx; for several: of `lanes` */
    int lanes;                 /* cells at once */
    const int *cells;          /* how many; the last lanes may be too many */
    int tensor, coefficients, constants, coordinates;  /* numbers of a cell */
    const int *w, *c, *x;      /* places of coefficients (of each cell) and constants in `values`, and in `mesh` */
    const double *mesh;        /* coordinates of all cells of the mesh */
    int shared;                /* all cells have the same dofs: one tensor is the sum of all */
    const int *targets;        /* places of the tensors in `out`; NULL: one after the other, from `first` on */
    ptrdiff_t first;
    const int *facets;         /* local number of the facet, or NULL; then there is one lane */
} integral;

typedef struct {
    uintptr_t call;            /* void (*)(void *context, double *values) */
    void *context;
} hook;

typedef struct {
    int count;
    const hook *hooks;
} hooks;

void add_up(const hooks *before, const integral *integrals, int count, double *values, double *work, double *out,
            ptrdiff_t length);
void put(const double *x, const double *scale, const int *places, ptrdiff_t n, const int *tied, const int *to,
         ptrdiff_t ties, double *values);
void take(const double *values, const double *scale, const int *places, ptrdiff_t n, const int *tied, const int *to,
          ptrdiff_t ties, double *x);
"""

_SOURCE = """
#include <stdint.h>
#include <stddef.h>
#include <string.h>
typedef void (*tabulate_tensor)(double *, const double *, const double *, const double *, const int *,
                                const uint8_t *%s);

typedef void (*several)(double *, const double *, const double *, const double *);

static void gather(double *to, const double *from, const int *places, ptrdiff_t n)
{
    for (ptrdiff_t k = 0; k < n; ++k)
        to[k] = from[places[k]];
}

static void spread(double *to, const double *from, const int *places, int n, int lanes)
{
    for (int k = 0; k < n; ++k)
        for (int lane = 0; lane < lanes; ++lane)
            to[k * lanes + lane] = from[places[k]];
}

/* Adds the tensors of the first `used` lanes. */
static void scatter(const integral *I, const double *tensor, ptrdiff_t begin, int used, double *out)
{
    const int *targets = I->targets + (I->shared ? 0 : begin * I->tensor);
    for (int k = 0; k < I->tensor; ++k)
        for (int lane = 0; lane < used; ++lane)
            out[I->shared ? targets[k] : targets[k * I->lanes + lane]] += tensor[k * I->lanes + lane];
}

static void integrate(const integral *I, const double *values, double *work, double *out)
{
    static const uint8_t permutation[2] = {0, 0};
    const int lanes = I->lanes, cells = *I->cells;
    double *c = work, *w = c + lanes * I->constants, *x = w + lanes * I->coefficients;
    double *own = x + lanes * I->coordinates;
    spread(c, values, I->c, I->constants, lanes);
    for (ptrdiff_t begin = 0; begin < cells; begin += lanes) {
        double *tensor = I->targets ? own : out + I->first + begin * I->tensor;
        gather(w, values, I->w + begin * I->coefficients, lanes * I->coefficients);
        gather(x, I->mesh, I->x + begin * I->coordinates, lanes * I->coordinates);
        if (I->targets)
            memset(own, 0, lanes * I->tensor * sizeof(double));
        if (lanes > 1)
            ((several)I->kernel)(tensor, w, c, x);
        else
            ((tabulate_tensor)I->kernel)(tensor, w, c, x, I->facets ? I->facets + begin : NULL, permutation%s);
        if (I->targets)
            scatter(I, own, begin, cells - begin < lanes ? cells - begin : lanes, out);
    }
}

void add_up(const hooks *before, const integral *integrals, int count, double *values, double *work, double *out,
            ptrdiff_t length)
{
    for (int n = 0; n < before->count; ++n)
        ((void (*)(void *, double *))before->hooks[n].call)(before->hooks[n].context, values);
    memset(out, 0, length * sizeof(double));
    for (int n = 0; n < count; ++n)
        integrate(integrals + n, values, work, out);
}

void put(const double *x, const double *scale, const int *places, ptrdiff_t n, const int *tied, const int *to,
         ptrdiff_t ties, double *values)
{
    for (ptrdiff_t k = 0; k < n; ++k)
        values[places[k]] = scale[k] * x[k];
    for (ptrdiff_t k = 0; k < ties; ++k)
        values[tied[k]] = scale[to[k]] * x[to[k]];
}

void take(const double *values, const double *scale, const int *places, ptrdiff_t n, const int *tied, const int *to,
          ptrdiff_t ties, double *x)
{
    for (ptrdiff_t k = 0; k < n; ++k)
        x[k] = scale[k] * values[places[k]];
    for (ptrdiff_t k = 0; k < ties; ++k)
        x[to[k]] += scale[to[k]] * values[tied[k]];
}
"""


def compiled():
    """The compiled module."""
    more = (", void *", ", NULL") if compat.KERNEL_TAKES_DATA else ("", "")
    return c_code.module("loops", _DECLARATIONS, _SOURCE % more)


def function(name):
    """Address of one of its functions, for other C."""
    library = compiled()
    return library.ffi.cast("void *", library.ffi.addressof(library.lib, name))


class Scaled:
    """Some entries of an array in units of their own, as PETSc sees them: entry k is scale[k] * values[places[k]].

    scale: may be changed, in place.  ties: (places, entries): what is put into an entry goes to these places too, and
    what is taken from there is added to the entry.  `arguments`: of put and take but the arrays, for C.
    """

    def __init__(self, values, places, scale, ties=((), ())):
        self._library, self.x = compiled(), np.zeros(len(places))
        places, tied, to = (np.array(a, dtype=np.int32) for a in (places, *ties))
        self._alive = values, scale, places, tied, to, self.x
        self._values, self._scale, places, *pairs, self._x = map(address, self._alive)
        self._which = places, len(self.x), *pairs, len(tied)
        self.arguments = self._values, self._scale, *self._which

    def take(self):
        """x, from the values."""
        self._library.lib.take(self._values, self._scale, *self._which, self._x)
        return self.x

    def put(self, x):
        """values[places[k]] = scale[k] * x[k]."""
        x = self._library.ffi.from_buffer("double[]", x)
        self._library.lib.put(x, self._scale, *self._which, self._values)


class Hooks:
    """What is called before every evaluation of a residual or a Jacobian, in the order of `add`.

    A hook may change what the kernels are about to read: coefficients in the array `values` of a `Values`, and the
    `Coordinates` of a mesh.  Residual and Jacobian at one state must see the same.
    """

    def __init__(self, values):
        self._library, self.values = compiled(), values
        self.described, self._alive = self._library.ffi.new("hooks *"), []
        self._room = []  # for hooks, of which `described` counts those in use
        self._error, self.failed = None, np.zeros(1, dtype=np.int32)  #: for C: whether one has raised

    def add(self, function, context=None):
        """function: void (*)(void *context, double *values) of any cffi library, or a Python function of the array.

        What a Python function raises is raised by the evaluation, and the numbers of that evaluation mean nothing.
        """
        ffi, place = self._library.ffi, self.described.count
        if not isinstance(function, int):
            function, context = self._from_python(function), None
        if place == len(self._room):
            self._room = ffi.new("hook[]", [*self._room, *[(0, ffi.NULL)] * (place + 8)])
            self.described.hooks = self._room
        self._room[place] = function, ffi.cast("void *", context or 0)
        self.described.count += 1

    def _from_python(self, function):
        ffi = self._library.ffi

        def failed(kind, error, traceback):
            self._error, self.failed[0] = error, 1

        wrapped = ffi.callback("void(void *, double *)", lambda *_: function(self.values), onerror=failed)
        self._alive.append(wrapped)
        return int(ffi.cast("uintptr_t", wrapped))

    def check(self):
        """Raise what a hook has raised."""
        if self._error is not None:
            error, self._error, self.failed[0] = self._error, None, 0
            raise error


class Coordinates:
    """Vertices of the owned cells of each mesh, one array (cells, 3 x vertices) for all forms on it.

    Whoever moves the quadrature points of a mesh writes there.
    """

    def __init__(self):
        self._arrays = {}

    def of(self, mesh):
        """The array of a mesh."""
        key = id(mesh)
        if key not in self._arrays:
            self._arrays[key] = mesh, np.ascontiguousarray(compat.cell_coordinates(mesh), dtype=np.float64)
        return self._arrays[key][1]


class Counts:
    """How many cells of an integral are looked at, from the first on: all of them unless a hook writes less there."""

    def __init__(self):
        self._counts = {}

    def of(self, mesh, cells):
        """The number, as an array of one, that all integrals over these cells of a mesh read."""
        key = id(mesh), np.asarray(cells, dtype=np.int32).tobytes()
        if key not in self._counts:
            self._counts[key] = mesh, np.array([len(cells)], dtype=np.int32)
        return self._counts[key][1]


class Shared(NamedTuple):
    """What the loops of a System read besides their forms' values."""

    hooks: Hooks
    coordinates: Coordinates
    counts: Counts


class Loop:
    """The forms of `contributions`, added up by one call.

    values: a `Values` that knows all their unknowns, coefficients and constants.  shared: what all loops of a System
    share (`Shared`).  A residual is added to an array of `size` local unknowns.  Of Jacobians (size None) `out`
    holds the tensors, whose `entries` belong to local unknowns (rows, columns; -1: to none), and behind them `spare`
    zeros.  `arguments` are those of add_up.
    """

    def __init__(self, contributions, values, shared, size=None, spare=0):
        self._alive, self._shared = [], shared
        ffi, self._entries, self._dofs, self._first, work = compiled().ffi, [], {}, 0, 1
        sources = zip(contributions, values.sources(contributions), strict=True)
        found = [(c, integral, packed) for c, packed in sources for integral in compat.integrals(c.form, ffi)]
        described = ffi.new("integral[]", max(1, len(found)))
        for one, (c, integral, (coefficients, constants)) in zip(described, found, strict=False):
            self._inputs(one, c, integral, coefficients[integral.key], constants)
            self._outputs(one, c, integral, size is None)
            work = max(work, one.lanes * (one.constants + one.coefficients + one.coordinates + one.tensor))
        if size is None:
            self.entries = np.concatenate([np.zeros((2, 0), np.int32), *self._entries], axis=1)
            size = self.entries.shape[1] + spare
        del self._entries, self._dofs
        self.out = c_code.aligned(size)
        inputs, outputs = (self._doubles(a) for a in (values.array, c_code.aligned(work))), self._doubles(self.out)
        self.arguments = shared.hooks.described, described, len(found), *inputs, outputs, size
        self._call = partial(compiled().lib.add_up, *self.arguments)

    def __call__(self):
        """`out`, from the present `values`."""
        self._call()
        self._shared.hooks.check()
        return self.out

    def _inputs(self, one, contribution, integral, coefficients, constants):
        cells, mesh = integral.cells, contribution.row.function.function_space.mesh
        x = self._shared.coordinates.of(mesh)
        one.kernel, one.lanes = integral.kernel, 1
        if integral.facets is not None:
            one.facets = self._ints(integral.facets)
        elif len(cells) > 1:
            one.kernel, one.lanes = lanes.several(integral.kernel) or (integral.kernel, 1)
        one.cells = self._kept(self._shared.counts.of(mesh, cells))
        one.coefficients, one.constants, one.coordinates = coefficients.shape[1], len(constants), x.shape[1]
        one.w, one.c, one.mesh = self._by_lanes(one, coefficients), self._ints(constants), self._doubles(x)
        one.x = self._by_lanes(one, x.shape[1] * np.asarray(cells)[:, None] + np.arange(x.shape[1]))

    def _outputs(self, one, contribution, integral, is_matrix):
        dofs = [
            part.offset + self._dofs_of(part.function.function_space)[integral.cells] for part in contribution.sides
        ]
        one.tensor, one.shared = np.prod([d.shape[1] for d in dofs]), all(np.all(d == d[:1]) for d in dofs)
        if not is_matrix:
            one.targets = self._ints(dofs[0][:1]) if one.shared else self._by_lanes(one, dofs[0])
            return
        one.first = self._first
        if one.shared:
            one.targets = self._ints(one.first + np.arange(one.tensor))
            dofs = [d[:1] for d in dofs]
        entries = np.stack([_blocks(e, 1 if one.shared else one.lanes, -1).ravel() for e in _entries(*dofs)])
        self._entries.append(np.pad(entries, ((0, 0), (0, -entries.shape[1] % c_code.ALIGNED)), constant_values=-1))
        self._first += self._entries[-1].shape[1]

    def _dofs_of(self, space):
        if id(space) not in self._dofs:
            self._dofs[id(space)] = _unrolled(space)
        return self._dofs[id(space)]

    def _by_lanes(self, one, numbers):
        """Of every cell (cells, numbers); lanes that are too many do what the last cell does."""
        return self._ints(_blocks(numbers, one.lanes, numbers[-1:]))

    def _ints(self, array):
        return self._kept(np.ascontiguousarray(array, dtype=np.int32))

    def _doubles(self, array):
        return self._kept(np.ascontiguousarray(array, dtype=np.float64))

    def _kept(self, array):
        self._alive.append(array)
        return address(array)


def _blocks(numbers, lanes, more):
    """(cells, numbers of a cell) -> (blocks, numbers of a cell, lanes); more: of the cells that are too many."""
    cells, n = numbers.shape
    blocks = -(-cells // lanes)
    filled = np.empty((blocks * lanes, n), dtype=np.int32)
    filled[:cells], filled[cells:] = numbers, more
    return filled.reshape(blocks, lanes, n).swapaxes(1, 2)


def _unrolled(space):
    """Dofs of every owned cell, blocks one by one."""
    blocks, size = compat.cell_dofs(space), space.dofmap.bs
    return (size * blocks[:, :, None] + np.arange(size, dtype=np.int32)).reshape(len(blocks), -1)


def _entries(rows, columns):
    """Row and column of every entry of the cells' tensors, (cells, entries) each."""
    m, n = rows.shape[1], columns.shape[1]
    return np.repeat(rows, n, axis=1), np.tile(columns, m)
