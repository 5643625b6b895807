"""Compatibility with all supported versions of dolfinx, the only file that depends on the version.

It is determined once, from the version number, on import.  Algorithms do not differ between versions: the
functions below hide only names and signatures.
"""

import functools
import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# The functions below call these constructors with the arguments of either version.
import basix
import dolfinx
import ffcx
import numpy as np
import petsc4py
import ufl
from dolfinx import cpp as _cpp
from dolfinx import fem
from dolfinx import jit as dolfinx_jit
from dolfinx import mesh as dmesh
from petsc4py import PETSc

from ..elsewhere import MPI, elsewhere
from . import jit
from .jit import COMPILER

#: dolfinx versions on which the tests have passed, with the Debian release that ships them.
SUPPORTED = {(0, 5): "Debian 12", (0, 9): "Debian 13", (0, 11): "Debian sid"}

VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
LEGACY = VERSION < (0, 8)  # UFL elements, dolfinx.cpp objects without a Python layer
SEVERAL = VERSION >= (0, 11)  # meshes may have several cell types: lists of one dofmap where there was one dofmap
KERNEL_TAKES_DATA = VERSION >= (0, 10)  # compiled kernels have one more argument

if LEGACY:
    import ffcx.parameters
else:
    import basix.ufl  # not part of basix by itself
    import ffcx.options

#: UFL sorts the constants of a sum by their numbers as text, so that 10 comes before 9: ours all have equally many
#: digits.  Otherwise the form of a scene, and its rounding errors, would depend on what was built before it.
_numbers = itertools.count(1_000_000)

JIT_OPTIONS = {"cffi_extra_compile_args": COMPILER}


def _read_elsewhere(module, name):
    """(module, name, function) for options of a library, read from the user's home, not from the current folder."""
    with elsewhere():
        found = getattr(module, name)()
    return module, name, lambda: found


#: Replacements of functions of dolfinx and FFCx while a form is compiled here; `one_at_a_time` follows below.
_OURS = [
    _read_elsewhere(dolfinx_jit, "_load_parameters" if LEGACY else "_load_options"),
    _read_elsewhere(*((ffcx.parameters, "_load_parameters") if LEGACY else (ffcx.options, "_load_options"))),
]


@contextmanager
def _compiler() -> Iterator[None]:
    """Compile without options of the current folder, each form once and by one process; then restore the functions."""
    theirs = [(module, name, getattr(module, name)) for module, name, _ in _OURS]
    for module, name, ours in _OURS:
        setattr(module, name, ours)
    try:
        yield
    finally:
        for module, name, their in theirs:
            setattr(module, name, their)


def supported() -> bool:
    """True if the installed dolfinx is one of `SUPPORTED`."""
    return VERSION in SUPPORTED


def jit_cache() -> Path:
    """Folder in which dolfinx keeps compiled forms."""
    with _compiler():
        options = (dolfinx_jit.get_parameters if LEGACY else dolfinx_jit.get_options)({})
    return Path(options["cache_dir"])


def interval_mesh(comm, *pieces):
    """Mesh of disjoint pieces with these nodes each (increasing, the same on every rank), distributed over the ranks of
    `comm`."""
    nodes = np.concatenate(pieces).astype(np.float64).reshape(-1, 1)
    left = np.concatenate([np.full(len(piece), True) for piece in pieces])
    left[np.cumsum([len(piece) for piece in pieces]) - 1] = False
    left = np.flatnonzero(left)
    cells = np.column_stack([left, left + 1]).astype(np.int64)
    if comm.rank != 0:  # the root's mesh is distributed; other ranks contribute nothing
        nodes, cells = nodes[:0], cells[:0]
    if LEGACY:
        cell = ufl.Cell("interval", geometric_dimension=1)
        # FFCx 0.5 switches to this variant when it compiles: otherwise the name of a form in the cache would change
        # with compilation, and differ between the compiling rank and the others.
        domain = ufl.Mesh(ufl.VectorElement("Lagrange", cell, 1, variant="equispaced"))
        return dmesh.create_mesh(comm, cells, nodes, domain)
    return dmesh.create_mesh(comm, cells, x=nodes, e=basix.ufl.element("Lagrange", "interval", 1, shape=(1,)))


def element(mesh, family, degree, size=1):
    """Element of `size` components on an interval mesh."""
    if LEGACY:
        if size == 1:
            return ufl.FiniteElement(family, mesh.ufl_cell(), degree)
        return ufl.VectorElement(family, mesh.ufl_cell(), degree, dim=size)
    discontinuous = family == "DG"
    shape = () if size == 1 else (size,)
    return basix.ufl.element("Lagrange", "interval", degree, shape=shape, discontinuous=discontinuous)


def quadrature_element(mesh, degree, size):
    """`size` numbers at each point of the quadrature of a degree, on an interval mesh."""
    if LEGACY:
        return ufl.VectorElement("Quadrature", mesh.ufl_cell(), degree, dim=size, quad_scheme="default")
    return basix.ufl.quadrature_element("interval", value_shape=(size,), degree=degree)


def mixed_element(elements):
    """Mixed element."""
    return ufl.MixedElement(elements) if LEGACY else basix.ufl.mixed_element(elements)


def function_space(mesh, element):
    """Function space of an element."""
    with _compiler():
        if LEGACY:
            return fem.FunctionSpace(mesh, element, jit_params=JIT_OPTIONS)
        return fem.functionspace(mesh, element)


def constant(mesh, value) -> fem.Constant:
    """A constant for forms, numbered by `_numbers`."""
    counter, number = ("_globalcount", next(_numbers)) if LEGACY else ("_counter", _numbers)
    theirs = getattr(ufl.Constant, counter)
    setattr(ufl.Constant, counter, number)
    try:
        return fem.Constant(mesh, value)
    finally:
        setattr(ufl.Constant, counter, theirs)


def real_space(mesh, size):
    """Space of `size` global numbers (size > 1), independent of position; its Function has an array of `size` values.

    A vector of piecewise constants with the same dofs in every cell.  It resides entirely on one rank; other ranks
    have unused copies, because only `ds` terms at a line's end couple it to the line.
    """
    space = function_space(mesh, element(mesh, "DG", 0, size))
    cells = space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts
    offsets, dofs = np.arange(cells + 1, dtype=np.int32), np.zeros(cells, dtype=np.int32)
    index_map, adjacency = _cpp.common.IndexMap(MPI.COMM_SELF, 1), _cpp.graph.AdjacencyList_int32(dofs, offsets)
    dofmap = _cpp.fem.DofMap(space._cpp_object.dofmap.dof_layout, index_map, size, adjacency, size)
    if LEGACY:
        cpp_space = _cpp.fem.FunctionSpace(mesh._mesh, space._cpp_object.element, dofmap)
        return fem.FunctionSpace(mesh, space.ufl_element(), cpp_space)
    shape = () if SEVERAL else (space._cpp_object.value_shape,)
    cpp_space = _cpp.fem.FunctionSpace_float64(mesh._cpp_object, space._cpp_object.element, dofmap, *shape)
    return fem.FunctionSpace(mesh, space.ufl_element(), cpp_space)


def collapse(space, component):
    """Component of a mixed space as a separate space, and its dofs in `space`."""
    collapsed, dofs = space.sub(component).collapse()
    return collapsed, np.asarray(dofs[0] if SEVERAL else dofs)


# dolfinx gives no other access to the local part of its collective compilation.
_OPTIONS = "jit_params" if LEGACY else "jit_options"
_one_at_a_time = jit.one_at_a_time(dolfinx_jit.ffcx_jit.__wrapped__, _OPTIONS, jit_cache)

#: Forms compiled or found in this process, by everything they depend on; a search by FFCx takes a millisecond.
_FOUND: dict[object, object] = {}


@functools.wraps(_one_at_a_time)
def _once(what, *arguments, **options):
    described = what.ufl_coordinate_element() if isinstance(what, ufl.Mesh) else what
    text = what.signature() if isinstance(what, ufl.Form) else repr(described)
    key = type(what), text, repr(arguments), repr(options), jit_cache()
    if key not in _FOUND:
        with jit.quiet_compiler():
            _FOUND[key] = _one_at_a_time(what, *arguments, **options)
    return _FOUND[key]


_OURS.append((dolfinx_jit, "ffcx_jit", dolfinx_jit.mpi_jit_decorator(_once)))


#: Signatures of the forms of systems of a kind, by which FFCx finds compiled forms; the latest `_MOST_KINDS` kinds.
_SIGNATURES: dict[object, list[str]] = {}
_MOST_KINDS = 256


def sign(forms, kind):
    """Copy the signatures from another system of this kind to forms: computing them is a quarter of the set-up time."""
    read_by = [(len(form.integrals()), len(form.coefficients()), len(form.constants())) for form in forms]
    what = (kind, *read_by)
    known = _SIGNATURES.pop(what, None) or [form.signature() for form in forms]
    while len(_SIGNATURES) >= _MOST_KINDS:
        del _SIGNATURES[next(iter(_SIGNATURES))]
    _SIGNATURES[what] = known
    for form, signature in zip(forms, known, strict=True):
        form._signature = signature


def compile_form(form):
    """Compile a UFL form, or find it in the cache."""
    with _compiler():
        return fem.form(form, **{_OPTIONS: JIT_OPTIONS})


def cpp_form(form):
    """The object passed to the C++ assemblers."""
    return form if LEGACY else form._cpp_object


pack_constants = _cpp.fem.pack_constants
pack_coefficients = _cpp.fem.pack_coefficients
assemble_vector = _cpp.fem.assemble_vector


@dataclass
class Integral:
    """Integral of a compiled form: address of its kernel, owned cells, and the facet of each, if any."""

    kernel: int
    cells: np.ndarray
    facets: np.ndarray | None
    key: tuple  #: key of its packed coefficients


def integrals(form, ffi) -> list[Integral]:
    """The integrals of a compiled form, which are over cells and exterior facets; ffi: any of cffi's."""
    found, cpp, ufcx = [], cpp_form(form), form.ufcx_form
    kinds = fem.IntegralType.cell, fem.IntegralType.exterior_facet
    if not set(cpp.integral_types) <= set(kinds):
        raise NotImplementedError(f"only integrals over cells and exterior facets are added up: {cpp.integral_types}")
    for place, kind in enumerate(kinds):
        if LEGACY:
            compiled, ids = ufcx.integrals(place), ufcx.integral_ids(place)
            listed = range(ufcx.num_integrals(place))
        else:
            compiled, ids, ends = ufcx.form_integrals, ufcx.form_integral_ids, ufcx.form_integral_offsets
            listed = range(ends[place], ends[place + 1])
        for k in listed:
            number = k - listed.start if SEVERAL else ids[k]
            entities = np.asarray(cpp.domains(kind, number))
            facets = None
            if place == 1:
                entities, facets = entities.reshape(-1, 2).T
            kernel = int(ffi.cast("uintptr_t", compiled[k].tabulate_tensor_float64))
            found.append(Integral(kernel, entities, facets, (kind, number)))
    return found


def cell_coordinates(mesh):
    """Vertices of every owned cell in the layout of the kernels: (cells, 3 x vertices)."""
    cells = mesh.topology.index_map(1).size_local
    return mesh.geometry.x[_geometry_dofs(mesh)[:cells]].reshape(cells, -1)


def move_vertices(mesh, coordinates):
    """Move the vertices of the owned cells to coordinates as from `cell_coordinates`."""
    cells = mesh.topology.index_map(1).size_local
    mesh.geometry.x[_geometry_dofs(mesh)[:cells]] = coordinates.reshape(cells, -1, 3)


def versions() -> dict[str, str]:
    """Versions of the software that a result depends on."""
    import platform

    return {
        "python": platform.python_version(),
        "dolfinx": dolfinx.__version__,
        "ufl": ufl.__version__ if hasattr(ufl, "__version__") else "unknown",
        "petsc": ".".join(str(n) for n in PETSc.Sys.getVersion()),
        "petsc4py": petsc4py.__version__,
        "numpy": np.__version__,
        "mpi": MPI.Get_library_version().split(",")[0].strip("\x00 \n"),
    }


def cell_dofs(space):
    """Dofs of every owned cell, one row per cell (blocks for a blocked space)."""
    cells = space.mesh.topology.index_map(1).size_local
    dofmap = space._cpp_object.dofmap
    if LEGACY:
        return np.array(dofmap.list().array).reshape(-1, dofmap.dof_layout.num_dofs)[:cells]
    return np.asarray(dofmap.map())[:cells]


def cell_ends(mesh):
    """Coordinates of the two ends of every owned cell of an interval mesh, smaller first."""
    cells = mesh.topology.index_map(1).size_local
    ends = mesh.geometry.x[_geometry_dofs(mesh)[:cells], 0]
    return np.sort(ends, axis=1)


def _geometry_dofs(mesh):
    if LEGACY:
        return mesh.geometry.dofmap.array.reshape(-1, 2)
    return np.asarray(mesh.geometry.dofmaps[0] if SEVERAL else mesh.geometry.dofmap)


def interval_quadrature(degree):
    """Quadrature points between 0 and 1, and weights, of compiled forms on a cell."""
    points, weights = basix.make_quadrature(basix.CellType.interval, degree)
    return np.asarray(points).ravel(), np.asarray(weights)


def cell_tags(mesh, groups):
    """Cell tags of an interval mesh; groups: {tag: (low, high)}, ranges of cell midpoints."""
    middles = cell_ends(mesh).mean(axis=1)
    values = np.zeros(len(middles), dtype=np.int32)
    for tag, (low, high) in groups.items():
        values[(middles > low) & (middles < high)] = tag
    return dmesh.meshtags(mesh, 1, np.arange(len(middles), dtype=np.int32), values)


def end_tags(mesh, *places):
    """Facet tags 1, 2, ... at the coordinates of the ends of the mesh."""
    found = [dmesh.locate_entities_boundary(mesh, 0, lambda x, at=at: np.isclose(x[0], at)) for at in places]
    facets = np.concatenate(found).astype(np.int32)
    values = np.concatenate([np.full(len(f), tag, dtype=np.int32) for tag, f in enumerate(found, start=1)])
    order = np.argsort(facets)
    mesh.topology.create_connectivity(0, 1)
    return dmesh.meshtags(mesh, 0, facets[order], values[order])
