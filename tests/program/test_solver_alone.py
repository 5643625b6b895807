"""Parts of the solver, each alone: sizes of unknowns, numbering, ties, decisions of Newton's method, shifts of modes.

Source: the same numbers by hand; made-up solvers with prescribed outcomes.
"""

import logging
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import ufl
from dolfinx.mesh import locate_entities_boundary
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix, diags

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.solver import compat, newton, quadratic
from dolfbuoy.solver.loops import Scaled
from dolfbuoy.solver.newton import Newton, SolverOptions
from dolfbuoy.solver.numbering import Numbering
from dolfbuoy.solver.system import System
from dolfbuoy.solver.unknowns import Block

EPS = 2.0**-52
REASON = PETSc.SNES.ConvergedReason


# -- sizes ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("block", "gamma", "size"),
    [
        ({"unknown": 1e-12}, 1e6, 1e-12),
        ({"unknown": 3.0, "rounding": 1e3}, 10.0, 3.0),
        ({"unknown": 3.0, "rounding": 1e3}, 1e4, 100 * EPS * 1e3 * 1e8 / 1e-9),
        ({"unknown": 3.0, "of_shape": 1e7}, 1e4, 100 * EPS * 1e7 / 1e-9),
        ({"unknown": 3.0, "of_shape": 1e5}, 1e4, 3.0),
    ],
)
def test_sizes_of_unknowns_are_above_the_rounding(block, gamma, size):
    """A hundred roundings of a second derivative, in time or along the line, are no increment."""
    one = Block("a block", np.zeros(1, int), rest=1.0, **block)
    assert one.unknown_size(gamma, 1e-9) == pytest.approx(size, rel=1e-14)
    assert (one.unit, one.moving, one.order) == ("", 0.0, 1)


def test_scales_of_unknowns_and_rows():
    """Rows by what they have at rest and in motion; the same step, but for rounding, changes nothing."""
    blocks = [
        Block("one", np.array([0, 2]), unknown=2.0, rest=4.0, moving=0.5, order=2),
        Block("two", np.array([1, 3]), unknown=8.0, rest=1.0, moving=3.0),
    ]
    vectors = ([], [])
    rows, unknowns = (Fake(setArray=lambda values, told=told: told.append(values.copy())) for told in vectors)
    system = Fake(law=None, gamma=None, size=4, blocks=blocks, tolerance=1e-9, order=np.array([3, 0]))
    system.numbering = Fake(visible=np.array([3, 0, 2]), ghosted=None)
    system.unknown_scales, system.row_scales, system.row_vector, system.unknown_vector = (
        np.ones(3),
        np.ones(2),
        rows,
        unknowns,
    )
    assert System.set_scales(system, 4.0)
    np.testing.assert_array_equal(system.unknown_scales, [8.0, 2.0, 2.0])
    np.testing.assert_array_equal(system.row_scales, [1 / (1 + 3 * 4), 1 / (4 + 0.5 * 16)])
    np.testing.assert_array_equal(vectors, [[[1 / 13, 1 / 12]], [[8.0, 2.0]]])
    assert not System.set_scales(system, 4.0 * (1 + 0.9e-9))
    assert not System.set_scales(system, 4.0 * (1 - 0.9e-9))
    assert system.gamma == 4.0
    assert System.set_scales(system, 4.0 * (1 + 1.1e-9))
    assert System.set_scales(system, 4.0 * (1 - 1.1e-9))


def test_entries_in_units_of_their_own_with_ties():
    """What is put into an entry goes to those that are tied to it, and what these have is added to it."""
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    entries = Scaled(values, [3, 0], np.array([10.0, 0.5]), ([1, 4], [0, 0]))
    np.testing.assert_array_equal(entries.take(), [10 * (4 + 2 + 5), 0.5])
    entries.put(np.array([7.0, -2.0]))
    np.testing.assert_array_equal(values, [-1.0, 70.0, 3.0, 70.0, 70.0])
    others = np.array([1.0, 1.0, 0.0, 2.0, 3.0])
    np.testing.assert_array_equal(entries.of(others).take(), [60.0, 0.5])
    np.testing.assert_array_equal(values, [-1.0, 70.0, 3.0, 70.0, 70.0])


def test_numbers_of_owned_of_ghosts_and_of_what_is_tied():
    """A ghost that is constrained is none; the first unknown has the number 0."""
    ghosts, ties = (np.array([4, 5]), np.array([0, -1])), (np.array([2, 6]), np.array([0, 4]))
    found = Numbering(MPI.COMM_SELF, 7, [1, 0, 3], ghosts=ghosts, ties=ties)
    assert found.unknowns == 3
    np.testing.assert_array_equal(found.global_index, [1, 0, 1, 2, 0, -1, 0])
    np.testing.assert_array_equal(found.visible, [1, 0, 3, 4])
    np.testing.assert_array_equal(found.ghosts, [4])
    np.testing.assert_array_equal((found.tied, found.tied_to), [[2, 6], [1, 3]])
    assert (found.ghosted, found.elimination) == (None, None)
    found.destroy()


def test_signatures_are_kept_of_the_latest_kinds(monkeypatch):
    """Of systems alike one; of other numbers of integrals another; the kind that was not asked for goes first."""
    known, asked = {}, []
    monkeypatch.setattr(compat, "_SIGNATURES", known)
    monkeypatch.setattr(compat, "_MOST_KINDS", 2)

    def form(name, integrals=1):
        sign = lambda: asked.append(name) or f"of {name}"  # noqa: E731
        one = Fake(signature=sign, integrals=lambda: [0] * integrals, coefficients=list, constants=list)
        return one

    def signed(name, kind, **given):
        one = form(name, **given)
        compat.sign([one], kind)
        return one._signature

    assert [signed("a", 1), signed("b", 1), signed("c", 1, integrals=2)] == ["of a", "of a", "of c"]
    assert [signed("d", 1), signed("e", 2), signed("f", 1)] == ["of a", "of e", "of a"]  # 2 took the place of c
    assert [signed("g", 3), signed("h", 1), signed("i", 2)] == ["of g", "of a", "of i"]
    assert (asked, len(known)) == (["a", "c", "e", "g", "i"], 2)


def test_forms_are_compiled_by_one_process_each():
    """Without options of the current folder; what dolfinx has is in its place again afterwards."""
    theirs = {(module, name): getattr(module, name) for module, name, _ in compat._OURS}
    assert len(theirs) == 3
    with compat._compiler():
        ours = {(module, name): getattr(module, name) for module, name in theirs}
        assert all(ours[key] is one for (*key, one), key in zip(compat._OURS, map(tuple, theirs), strict=True))
        assert not any(ours[key] is theirs[key] for key in theirs)
    assert {(module, name): getattr(module, name) for module, name in theirs} == theirs


def test_each_form_is_compiled_once_and_quietly(monkeypatch, tmp_path):
    """Forms by their signatures, meshes by their elements; anew with other options, and for another cache."""
    compiled, mesh = [], compat.interval_mesh(MPI.COMM_SELF, np.array([0.0, 1.0]))
    space = compat.function_space(mesh, compat.element(mesh, "Lagrange", 1))
    forms = [ufl.TestFunction(space) * factor * ufl.dx for factor in (2.0, 2.0, 3.0)]
    monkeypatch.setattr(compat, "_FOUND", {})

    def compiler(what, *arguments, **options):
        compiled.append((what, arguments, options))
        return len(compiled), logging.root.manager.disable

    monkeypatch.setattr(compat, "_one_at_a_time", compiler)
    assert [compat._once(form, {}, jit={})[0] for form in forms] == [1, 1, 2]
    assert [compat._once(one, {}, jit={})[0] for one in (mesh.ufl_domain(), mesh.ufl_domain())] == [3, 3]
    assert compat._once(forms[0], {}, jit={}) == (1, logging.INFO)
    assert logging.root.manager.disable == 0
    assert compat._once(forms[0], {"degree": 2}, jit={})[0] == 4
    assert compat._once(forms[0], {}, jit={"own": 1})[0] == 5
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)
    assert compat._once(forms[0], {}, jit={})[0] == 6
    assert compiled[0] == (forms[0], ({},), {"jit": {}})


def test_meshes_of_pieces_that_do_not_touch():
    """Cells from node to node of each piece; tags of cells by where their middles are, of ends by their places."""
    mesh = compat.interval_mesh(MPI.COMM_SELF, np.array([0.0, 1.0, 3.0]), np.array([4.0, 5.5]))
    order = np.argsort(compat.cell_ends(mesh)[:, 0])
    np.testing.assert_allclose(compat.cell_ends(mesh)[order], [[0.0, 1.0], [1.0, 3.0], [4.0, 5.5]])
    tags = compat.cell_tags(mesh, {7: (0.6, 2.0), 9: (2.0, 9.0)})  # the limits are in none
    np.testing.assert_array_equal(tags.values[order], [0, 0, 9])
    ends = compat.end_tags(mesh, 5.5, 0.0, 3.0, 4.0)
    for tag, place in enumerate((5.5, 0.0, 3.0, 4.0), start=1):
        (facet,) = locate_entities_boundary(mesh, 0, lambda x, place=place: np.abs(x[0] - place) < 1e-9)
        assert ends.values[ends.indices == facet].tolist() == [tag]
    compat.move_vertices(mesh, 2 * compat.cell_coordinates(mesh))
    np.testing.assert_allclose(compat.cell_ends(mesh)[order], [[0.0, 2.0], [2.0, 6.0], [8.0, 11.0]])
    points, weights = compat.interval_quadrature(3)
    assert (points**3 @ weights, len(points)) == (pytest.approx(0.25), 2)


# -- Newton's method --------------------------------------------------------------------------------------------------


class Solver:
    """Newton's method whose runs end as they are told to: (iterations, reason), ..."""

    def __init__(self, *ends, keep=False, valid=False, direct="petsc", stalled=False):
        self.ends, self.done, self.direct, self.fallbacks = list(ends), [], direct, 0
        self.numbers = Fake(keep=keep, valid=valid)
        self._stalled_at_rounding = lambda reason: stalled
        self.system = Fake(residual_by_block=lambda: {"cable position": 1.0})

    def _checked(self):
        return self.ends.pop(0)

    def _run(self):
        self.done.append(("run", self.numbers.keep, self.numbers.valid))
        return self._checked()

    def choose_solver(self, package):
        self.done.append(package)


SOLVED, STEPS, LINEAR, SEARCH = 4, REASON.DIVERGED_MAX_IT, REASON.DIVERGED_LINEAR_SOLVE, REASON.DIVERGED_LINE_SEARCH


@pytest.mark.parametrize(
    ("given", "found", "done", "valid"),
    [
        (Solver((2, SOLVED), valid=True, keep=True), (2, None), [], True),
        (Solver((4, SOLVED), valid=True, keep=True), (4, None), [], False),
        (Solver((2, SOLVED), valid=True), (2, None), [], False),
        (Solver((3, STEPS), (2, SOLVED), keep=True, valid=True), (5, None), [("run", False, False)], False),
        (Solver((0, LINEAR), (1, SOLVED)), (1, None), ["mumps", ("run", False, False), "petsc"], False),
        (Solver((2, 0)), (2, None), [], False),
        (Solver((9, SEARCH), stalled=True), (9, None), [], False),
        (
            Solver((1, SEARCH), (2, LINEAR), (4, LINEAR), keep=True),
            (7, "DIVERGED_LINEAR_SOLVE after 7 iterations, largest residual in cable position"),
            [("run", False, False), "mumps", ("run", True, False), "petsc"],
            False,
        ),
        (
            Solver((0, LINEAR), direct="mumps"),
            (0, "DIVERGED_LINEAR_SOLVE after 0 iterations, largest residual in cable position"),
            [],
            False,
        ),
    ],
)
def test_a_new_matrix_and_then_pivots_are_tried(given, found, done, valid):
    """With all iterations counted; a matrix is kept where there are few; it may be kept again afterwards."""
    keep = given.numbers.keep
    assert Newton._solve_as_best(given) == found
    assert (given.done, bool(given.numbers.valid), given.numbers.keep) == (done, valid, keep)
    assert given.fallbacks == given.done.count("mumps")


def test_it_may_keep_matrices_again_whatever_is_raised():
    given = Solver((3, STEPS), keep=True)
    with pytest.raises(IndexError):
        Newton._solve_as_best(given)
    assert given.numbers.keep


@pytest.mark.parametrize(
    ("error", "reason", "found", "again"),
    [(0, SOLVED, (3, SOLVED), False), (0, LINEAR, (3, LINEAR), True), (76, 0, (3, LINEAR), True)],
)
def test_a_matrix_that_is_singular_is_set_up_anew(error, reason, found, again):
    """Whether PETSc says so or a package; the scene's options are gone, and hooks are asked, in any case."""
    done = []
    given = Fake(numbers=Fake(error=error, reason=reason, iterations=3), direct="petsc", choose_solver=done.append)
    given.options = Fake(forget=lambda: done.append("forgotten"))
    given.system = Fake(hooks=Fake(check=lambda: done.append("checked")))
    assert Newton._checked(given) == found
    assert done == ["forgotten", *["petsc"] * again, "checked"]


def test_what_petsc_refuses_is_the_scenes_and_all_else_is_raised():
    options = SolverOptions({"pc_type": "nothing"})
    given = Fake(numbers=Fake(error=86, reason=0, iterations=0), options=options)
    with pytest.raises(InputError, match=r"solver.petsc = {'pc_type': 'nothing'}: PETSc refuses it \(error 86\)"):
        Newton._checked(given)
    given.numbers.error = 55
    with pytest.raises(PETSc.Error) as raised:
        Newton._checked(given)
    assert raised.value.ierr == 55


@pytest.mark.parametrize(
    ("in_order", "reason", "stalled", "found"),
    [
        (True, SOLVED, False, (3, True)),
        (False, STEPS, False, (3, False)),
        (False, SEARCH, True, (3, True)),
        (False, LINEAR, False, None),
    ],
)
def test_approaching_ends_with_its_iterations(in_order, reason, stalled, found):
    """Where a linear system has no solution all is as it was; the next solve has as many iterations as ever."""
    done, tolerances = [], []
    given = Fake(begin=lambda: done.append("begun"), _go_back=lambda: done.append("back"), numbers=Fake())
    given.numbers.in_order, given.numbers.iterations = in_order, 3
    given.snes = Fake(setTolerances=lambda **given: tolerances.append(given))
    given.system = Fake(publish=lambda: done.append("published"))
    given._checked, given._stalled_at_rounding = lambda: (3, reason), lambda reason: stalled
    if found:
        assert Newton.approach(given, 4) == found
    else:
        with pytest.raises(SolveError, match="no step of Newton's method was found"):
            Newton.approach(given, 4)
    assert done == (["begun"] if found else ["begun", "back", "published"])
    assert tolerances == [{"rtol": 0, "atol": 0, "stol": 0, "max_it": most} for most in (4, newton._MOST)]


@pytest.mark.parametrize(
    ("in_order", "own", "physical", "said"),
    [
        (True, None, None, None),
        (False, None, None, None),
        (False, "worn", "thin", "worn"),
        (True, None, "thin", "thin"),
    ],
)
def test_a_solution_must_be_one_that_can_be(in_order, own, physical, said):
    """Else all is as it was; iterations count either way, and options of a scene go with the solve."""
    done = []
    given = Fake(numbers=Fake(in_order=in_order, iterations=2), iterations_total=10, fault=lambda: physical)
    given.options = Fake(scene={"a": 1}, forget=lambda: done.append("forgotten"))
    given._solve_as_best, given._go_back = lambda: (5, own), lambda: done.append("back")
    given.system = Fake(publish=lambda: done.append("published"))
    if said:
        with pytest.raises(SolveError, match=said):
            Newton.end(given)
    else:
        assert Newton.end(given) == (2 if in_order else 5)
    assert given.iterations_total == (12 if in_order else 15)
    assert done == ["forgotten", *(["back", "published"] if said else [])]


def test_options_of_a_scene_are_in_the_database_for_one_solve():
    """A flag has no value; a line search that goes back is the default; what PETSc refuses does not stay there."""
    seen = {}

    class Snes:
        error = None

        def setOptionsPrefix(self, prefix):
            self.prefix = prefix

        def setFromOptions(self):
            seen.update(
                {k.removeprefix(self.prefix): v for k, v in PETSc.Options().getAll().items() if self.prefix in k}
            )
            if self.error:
                raise PETSc.Error(self.error)

    before, snes = PETSc.Options().getAll(), Snes()
    options = SolverOptions({"ksp_monitor": True, "ksp_rtol": 1e-5})
    options.apply(snes)
    assert {name: value or "" for name, value in seen.items()} == {
        "snes_linesearch_type": "bt",
        "ksp_monitor": "",
        "ksp_rtol": "1e-05",
    }
    assert len(PETSc.Options().getAll()) == len(before) + 3
    options.forget()
    SolverOptions().apply(snes)
    assert PETSc.Options().getAll() == before
    snes.error = 62
    with pytest.raises(InputError, match="error 62"):
        options.apply(snes)
    assert PETSc.Options().getAll() == before


# -- eigenvalues ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unknowns", "count", "small"),
    [(120, 1, True), (121, 1, False), (121, 60, False), (121, 61, True), (122, 61, True)],
)
def test_how_many_are_computed_at_once(unknowns, count, small):
    assert quadratic.Quadratic.is_small(Fake(K=np.zeros((1, unknowns))), count) is small


@pytest.mark.parametrize(
    ("restarts", "fails", "asked"),
    [(500, 0, [9]), (500, 1, [9, 16]), (500, 2, [9, 16, 23]), (500, 3, [9, 16, 23]), (quadratic.FEW, 1, [9])],
)
def test_more_are_asked_for_where_some_cannot_be_put_in_order(restarts, fails, asked):
    """Three times, and once where they are no more than news."""
    counts = []

    def pairs(count):
        counts.append(count)
        if len(counts) <= fails:
            raise SolveError("in no order")
        return count

    problem = Fake(pairs=pairs, restarts=restarts)
    if fails < len(asked):
        assert quadratic._tried(problem, 9) == asked[-1]
    else:
        with pytest.raises(SolveError, match="in no order"):
            quadratic._tried(problem, 9)
    assert counts == asked


@pytest.mark.parametrize(
    ("count", "unknowns", "asked", "found"),
    [
        (2, 30, [12], [-0.5, 0.5]),  # of four, as far as 2 from -1, those within 1 of 0
        (3, 30, [14, 28], [-0.5, 0.5, -1.5, 2j, -3.0, 4j, 6j]),  # within 11.04 of 0
        (3, 21, [14, 21], [-0.5, 0.5, -1.5, 2j, -3.0, 4j, 6j]),
        (3, 14, [14], [-0.5, 0.5]),
    ],
)
def test_those_next_to_zero_are_found_next_to_minus_one(count, unknowns, asked, found):
    """Those nearer to 0 than any that may be missing; until there are enough, or all, twice as many are asked for."""
    every, counts = np.array([-0.5, -1.5, 2j, -2j, 0.5, -3.0, 4j, -4j, 6j, -6j, 12j, -12j]), []

    def pairs(count):
        counts.append(count)
        near = every[np.argsort(np.abs(every + 1), kind="stable")][: count - 8]
        return near, 10 * near[None]

    problem = Fake(pairs=pairs, restarts=500, K=np.zeros((30, unknowns)))
    same, roots, vectors = quadratic._nearest(problem, count)
    assert (same, counts) == (problem, asked)
    np.testing.assert_allclose(sorted(roots, key=lambda root: (abs(root), root.real)), found)
    np.testing.assert_array_equal(vectors, 10 * roots[None])


def test_rows_and_columns_in_equilibrium():
    """The largest entry of each is near 1; one of zeros stays as it is."""
    A = csr_matrix(np.array([[1e8, 0.0, 2e3], [0.0, 0.0, 0.0], [5e-2, 0.0, 1e-6]]))
    rows, columns = quadratic._equilibrated(MPI.COMM_SELF, A)
    scaled = (diags(rows) @ A @ diags(columns)).toarray()
    np.testing.assert_allclose(scaled.max(axis=1), [1.0, 0.0, 1.0], rtol=0.1)
    np.testing.assert_allclose(scaled.max(axis=0), [1.0, 0.0, 1.0], rtol=0.1)
    assert (rows[1], columns[1]) == (1.0, 1.0)
    one, two = quadratic._equilibrated(MPI.COMM_SELF, csr_matrix(np.diag([4.0, 100.0])), sweeps=1)
    np.testing.assert_allclose([one, two], [[0.5, 0.1]] * 2, rtol=1e-14)
