"""Assembly of blocks and forms to one nonlinear system.

A `Part` is a Function together with the place of its dofs among the unknowns of this rank; the same unknowns may
appear as parts on two meshes (the mooring point and force, on the line and on the hull's axis).  Residual forms are
summed by the part of their test function; the Jacobian is their derivative with respect to every part on the same mesh.

Unknowns and rows are scaled by typical sizes, so that metres, newtons and newton-metre-seconds share one norm.
"""

from collections.abc import Callable, Iterable
from functools import cached_property, partial
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from ..elsewhere import MPI
from . import Array, compat, jit
from .c_code import address, aligned
from .callbacks import Callbacks
from .loops import Hooks, Loop, Scaled, Shared
from .numbering import Numbering, preallocate, set_values
from .tension_only import TensionOnly
from .unknowns import Block, Contribution, Part, Values
from .vector_ops import Work, copies


class System:
    """Residual and Jacobian of a set of parts, in physical values and scaled for PETSc.

    parts: this rank's parts.  residuals: list of (part, linear form).  blocks: cover all local unknowns.  numbering:
    a `Numbering`.  tolerance: for Newton increments, relative to the typical sizes.  law: modifies rows of residual and
    matrix after assembly (`tension_only.TensionOnly`), or None.  noted: linear forms for `functional`.  kind: equal for
    systems of the same forms on other meshes.

    `u` are the physical values of the local unknowns, and `hooks` the functions called before every evaluation.
    """

    def __init__(
        self,
        parts: list[Part],
        residuals: list[tuple[Part, Any]],
        blocks: list[Block],
        numbering: Numbering,
        tolerance: float,
        law: "TensionOnly | None",
        noted: Iterable[Any],
        *,
        kind: object,
    ) -> None:
        self.parts, self.blocks, self.numbering, self.tolerance, self.law = parts, blocks, numbering, tolerance, law
        self.size, self.order = numbering.size, numbering.order
        self.gamma: float | None = None  # that of the scales
        self._slopes: Array | None = None
        number = {id(part.function): k for k, part in enumerate(parts)}
        wanted: list[tuple[Any, ...]] = [(form, part) for part, form in residuals]
        for row, form in residuals:
            for k in sorted(number[id(c)] for c in form.coefficients() if id(c) in number):
                wanted.append((ufl.derivative(form, parts[k].function, parts[k].trial), row, parts[k]))
        compat.sign([form for form, *_ in wanted], kind)
        with jit.helped(self._compilation(wanted)):
            contributions = [Contribution(*one) for one in wanted]
            self.residuals, self.jacobians = contributions[: len(residuals)], contributions[len(residuals) :]
            self._values = Values(parts, [*(c.ufl_form for c in contributions), *noted])
            self.u = self._values.unknowns
            self.hooks = Hooks(self._values.array)
            self.shared = Shared(self.hooks)
            self.add_residuals = Loop(self.residuals, self._values, self.shared, self.size)
            self.add_jacobians = Loop(self.jacobians, self._values, self.shared, spare=len(self.order))
        #: Copy `u` into the parts' Functions.
        self.publish = copies([(part.values, self.u[part.slice]) for part in parts])
        self._b = self.add_residuals.out
        #: Units of the visible unknowns, and 1/units of the rows.
        self.unknown_scales, self.row_scales = np.ones(len(numbering.visible)), np.ones(len(self.order))
        ties = numbering.tied, numbering.tied_to
        self.scaled_unknowns = Scaled(self.u, numbering.visible, self.unknown_scales, ties)
        if numbering.ghosted is None:
            self.scaled_residual = Scaled(self._b, self.order, self.row_scales, ties)
        else:  # scaled after summation over all ranks
            self.scaled_residual = Scaled(self._b, numbering.visible, np.ones(len(numbering.visible)), ties)
        self.A, index = numbering.matrix(), np.append(numbering.global_index, -1)  # -1: no unknown
        # the spare entries are a diagonal, required by the factorisation even if the forms have none
        preallocate(self.A, *(index[np.append(e, self.order)] for e in self.add_jacobians.entries))
        rows, columns = self.add_jacobians.entries
        of_ends = index < 0  # rows that hold reactions, and forces between lines that meet
        of_ends[numbering.tied] = of_ends[numbering.visible[numbering.tied_to]] = True
        found = np.flatnonzero((rows >= 0) & of_ends[rows] & (index[columns] >= 0))
        #: Entries of the Jacobian in rows from which end forces are read: places in its tensors, rows and columns.
        self.entries_of_ends = tuple(np.array(one, dtype=np.int32) for one in (found, rows[found], columns[found]))
        self.add_jacobians.entries = None  # as large as the tensors, and no longer needed
        set_values(self.A, self.add_jacobians.out)
        self.row_vector, self.unknown_vector = numbering.vector(), numbering.vector()
        if law is not None:
            law.attach(self)
        #: Functions called by PETSc; their `numbers.assembled` counts assemblies of the matrix.
        self.callbacks = Callbacks(self)
        self.set_scales(1.0)

    def _compilation(self, wanted: list[tuple[Any, ...]]) -> list[Callable[[], object]]:
        """Steps that compile forms, each with its part or parts, and then their kernels; none on several ranks, where
        compilation is collective."""

        def kernels(*one: Any) -> None:
            found = Contribution(*one)
            values = Values(self.parts, [found.ufl_form])
            Loop([found], values, Shared(Hooks(values.array)), self.size)

        if self.comm.size > 1:
            return []
        return [partial(step, *one) for step in (kernels, Contribution) for one in wanted]

    def set_scales(self, gamma: float) -> bool:
        """Scale unknowns and rows for a step with d/dt ~ gamma; returns whether anything changed."""
        if self.law is not None:
            self.law.set_scales(gamma)
        if self.gamma is not None and abs(gamma - self.gamma) <= 1e-9 * gamma:
            return False
        self.gamma = gamma
        xs, fs = np.ones(self.size), np.ones(self.size)
        for block in self.blocks:
            xs[block.dofs] = block.unknown_size(gamma, self.tolerance)
            fs[block.dofs] = 1 / (block.rest + block.moving * gamma**block.order)
        self.unknown_scales[:], self.row_scales[:] = xs[self.numbering.visible], fs[self.order]
        self.row_vector.setArray(self.row_scales)
        self.unknown_vector.setArray(xs[self.order])
        if (ghosted := self.numbering.ghosted) is not None:  # a ghost has the size that its owner gives it
            self.unknown_vector.copy(ghosted)
            ghosted.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
            with ghosted.localForm() as local:
                self.unknown_scales[:] = local.array_r
        return True

    @cached_property
    def loads(self) -> Array:
        """Loads added to the residual, with its sign, by local unknown: initially zero.

        To be changed in place between solves; a System on which this is never called has none.
        """
        loads = aligned(self.size)
        self.add_residuals.described.begin = address(loads)
        return loads

    def slopes(self, rows: Array, columns: Array) -> tuple[Array, Array]:
        """Numbers added to the Jacobian, like `loads` to the residual, initially zero; to be changed in place.

        Returns all of them, and the places (rows, columns) there of these local unknowns, which a form must couple.
        """
        if self._slopes is None:
            self._slopes = aligned(len(self.add_jacobians.out))
            self.add_jacobians.described.begin = address(self._slopes)
        entries = Loop(self.jacobians, self._values, self.shared).entries
        places = [
            [np.flatnonzero((entries[0] == row) & (entries[1] == column))[0] for column in columns] for row in rows
        ]
        return self._slopes, np.array(places)

    # -- evaluation in physical values ---------------------------------------------------------------------------------

    @property
    def comm(self) -> Any:
        """Communicator of the whole problem."""
        return self.numbering.comm

    @property
    def unknowns(self) -> int:
        """Number of free unknowns of all ranks."""
        return int(self.numbering.unknowns)

    def numbers_of(self, thing: Any) -> Array | None:
        """Values of a Function or Constant as read by the forms: a view, or None if not read."""
        return self._values.of(thing)

    def filled_by_hook(self, *functions: Any) -> None:
        """Declare coefficients whose values a hook writes to `numbers_of` them.

        To be called before a Newton is created for this System.
        """
        self._values.leave(functions)

    def functional(self, forms: Iterable[tuple[Any, Part]]) -> Loop:
        """A Loop for linear forms with the data of residuals, or that were `noted`: [(form, Part of results), ...]."""
        found = [Contribution(form, test) for form, test in forms]
        return Loop(found, self._values, self.shared, sum(c.row.size for c in found))

    def rows_of_jacobian(self, rows: Array) -> Callable[[], Any]:
        """A function that returns rows (local unknowns, constrained ones too) of the Jacobian at the present Functions.

        csr_matrix (rows, free unknowns of all ranks) [physical], as assembled by this rank; rows of tied unknowns are
        not summed.
        """
        from scipy.sparse import csr_matrix

        loop, place = Loop(self.jacobians, self._values, self.shared), np.full(self.size + 1, -1)
        place[rows] = np.arange(len(rows))
        at, columns = place[loop.entries[0]], np.append(self.numbering.global_index, -1)[loop.entries[1]]
        kept = (at >= 0) & (columns >= 0)
        places, shape = (at[kept], columns[kept]), (len(rows), self.unknowns)

        def evaluate() -> Any:
            self._read_functions()
            return csr_matrix((loop()[kept], places), shape)

        return evaluate

    @property
    def read_given(self) -> Work:
        """Function that re-reads coefficients and constants."""
        return self._values.read_given

    def evaluate(self) -> Array:
        """Local residual at the present Functions, constrained rows included (they hold the reactions) [physical].

        The values of the Functions are then also those of `u`.
        """
        self._read_functions()
        b = self.add_residuals()
        if self.law is not None:
            self.law.change_residual(b)
        return b

    def assemble_jacobian(self) -> None:
        """Assemble the unscaled Jacobian at the present Functions in `A`; their values are then also those of `u`."""
        self._read_functions()
        set_values(self.A, self.add_jacobians())
        self.callbacks.numbers.assembled += 1
        if self.law is not None:
            self.law.change_matrix(self.A)

    @property
    def last_residual(self) -> Array:
        """Local residual of the latest evaluation; after a Newton solve, that at the solution [physical]."""
        return self._b

    def _read_functions(self) -> None:
        self._values.read_unknowns()
        self._values.read_given()

    # -- as PETSc sees it ---------------------------------------------------------------------------------------------

    def share(self) -> None:
        """Copy to every tied or ghost unknown in `u` the value of the unknown that represents it."""
        x = self.numbering.vector()
        x.setArray(self.u[self.order] / self.unknown_scales[: len(self.order)])
        self.callbacks.read(x)
        x.destroy()

    def residual_by_block(self) -> dict[str, float]:
        """Largest scaled residual of every block at the present Functions."""
        f = self.numbering.vector()
        self.evaluate()
        self.callbacks.make_residual(f)
        scaled = np.zeros(self.size)
        scaled[self.order] = np.abs(f.array_r)
        f.destroy()
        largest = {b.name: (scaled[b.dofs].max() if len(b.dofs) else 0.0) for b in self.blocks}
        return {name: self.comm.allreduce(value, op=MPI.MAX) for name, value in largest.items()}

    def destroy(self) -> None:
        """Free PETSc objects (sweeps create many systems)."""
        for item in (self.A, self.row_vector, self.unknown_vector, self.numbering):
            item.destroy()
        if self.law is not None:
            self.law.destroy()
