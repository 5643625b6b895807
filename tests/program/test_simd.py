"""Kernels for several cells at once: equal numbers with every instruction set, and no unsupported instructions.

Source: FFCx's kernels for one cell, as dolfinx's assemblers call them.
"""

import re
import subprocess

import numpy as np
import pytest
from assemblers import Assemblers
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.core import build
from dolfbuoy.errors import InputError
from dolfbuoy.model.problem import Problem
from dolfbuoy.solver import c_code, compat, instructions, simd

SIZES = simd.Sizes(tensor=2, coefficients=2, constants=2, coordinates=6)  #: of the kernel below
REGISTERS = {"baseline": r"%[yz]mm\d", "avx2": r"%zmm\d", "avx512": r"$^"}  #: which a set does not have

OF_ONE = """void %s(double* restrict A,
    const double* restrict w,
    const double* restrict c,
    const double* restrict coordinate_dofs,
    const int* restrict entity_local_index,
    const uint8_t* restrict quadrature_permutation%s)
{
static const double weights_a[2] = { 0.25, 0.75 };
double sp_a[3];
sp_a[0] = 2 * 3.0;
sp_a[1] = c[0] * sp_a[0];
sp_a[2] = sp_a[1] + (c[0] < 0.5 ? (w[0] > 0.25 ? fmax(w[0], 0.0) : -1.0 / 3) : 1);
for (int iq = 0; iq < 2; ++iq)
{
  // what it is? (that)
  double w0 = 0.0;
  for (int ic = 0; ic < 2; ++ic)
    w0 += w[ic] * weights_a[ic];
  bool sv_a_0 = w0 < 0.4;
  double sv_a_1 = sv_a_0 ? 1 : 0.0;
  bool sv_a_2 = w[0] > 0.2 && w[1] < 0.6;
  double sv_a_3 = sv_a_2 ? exp(w0) : sqrt(w0);
  double sv_a_4 = pow(w0, 3) + pow(w0, -2) + pow(w0, 0.2857) + pow(w0, c[1]) + fmin(w0, 0.3) + fmin(0.3, w0);
  double sv_a_5 = sin(w0) + cos(w0) + acos(w0) + jn(2, w0) + tanh(w0) + log(w0) + fabs(-1 * w0) + atan2(w0, 0.5);
  const double fw0 = (sv_a_1 + sv_a_3 + sv_a_4 * sp_a[2]) * weights_a[iq];
  double temp_0[2] = {0};
  for (int i = 0; i < 2; ++i)
  {
    temp_0[i] = fw0 * coordinate_dofs[3 * i] + sv_a_5;
    A[i] += temp_0[i];
  }
}
}
"""


def values_of_cells(rng, n):
    """w, c and coordinates of n cells, (numbers, cells)."""
    w, x = rng.uniform(0.1, 0.7, (2, n)), rng.uniform(0, 1, (6, n))
    return w, np.repeat(rng.uniform(0.1, 0.7, (2, 1)), n, axis=1), x


@pytest.fixture
def from_text(tmp_path, monkeypatch):
    """Writes the text of a kernel into a cache of its own; returns what `lanes` makes of it for a set, and compares
    with what is compiled of `reference`, for one cell."""
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)

    def compiled(text, chosen, reference=None):
        (tmp_path / "text.c").write_text(text)
        single = of_one(tmp_path, reference or text)
        return simd._compiled.__wrapped__(tmp_path / "text.c", "kernel", chosen, single, SIZES)

    return compiled


def called(function, cells, w, c, x):
    """A of every cell, (2, cells)."""
    A = c_code.aligned(2 * cells).reshape(2, cells)
    arrays = [A, *(c_code.aligned(a.size).reshape(a.shape) for a in (w, c, x))]
    for array, values in zip(arrays[1:], (w, c, x), strict=True):
        array[:] = values
    ffi = c_code.core().ffi
    call = ffi.cast("void (*)(double *, double *, double *, double *)", function)
    call(*(ffi.cast("double *", array.ctypes.data) for array in arrays))
    return A


def of_one(folder, text):
    """A kernel for one cell, as it is."""
    path = folder / f"single-{len(list(folder.iterdir()))}.so"
    simd.compile_kernel(path, simd.text_of(text, "kernel"), "kernel", instructions.SETS[0], lanes=1)
    return simd._address(path)


@pytest.mark.parametrize("chosen", instructions.available(), ids=lambda known: known.name)
def test_every_word_of_a_kernel(chosen, from_text, tmp_path, monkeypatch):
    """Choices, powers, functions and initial values, in the words of all FFCx."""
    data = ", void* custom_data" if compat.KERNEL_TAKES_DATA else ""
    text, rng = OF_ONE % ("kernel", data), np.random.default_rng(3)
    function, cells = from_text(text, chosen)
    assert cells == chosen.lanes
    w, c, x = values_of_cells(rng, cells)
    found = called(function, cells, w, c, x)
    single = of_one(tmp_path, text)
    expected = np.concatenate(
        [called(single, 1, *(np.ascontiguousarray(a[:, [k]]) for a in (w, c, x))) for k in range(cells)], axis=1
    )
    assert np.ptp(expected) > 1
    np.testing.assert_allclose(found, expected, rtol=1e-14)


@pytest.mark.parametrize("chosen", instructions.available(), ids=lambda known: known.name)
@pytest.mark.parametrize("changes", [{"cable__elements": 5}, {"cable": None}], ids=["moored", "no cable"])
def test_a_system(chosen, changes, monkeypatch):
    """Residual and Jacobian of blocks that are not full, against dolfinx's assemblers."""
    monkeypatch.setenv(instructions.VARIABLE, chosen.name)
    problem = Problem(load_scene(merged(MOORED, **changes)), dynamic=True, comm=MPI.COMM_SELF)
    system = problem.system
    system.u[:] = np.random.default_rng(2).uniform(-1, 1, system.size)
    system.publish()
    found = system.evaluate().copy()
    buoy = problem.buoy.hull.points
    for points in (buoy.wet, buoy.cut):
        points.coefficient.x.array[:] = system.numbers_of(points.coefficient)
    system.assemble_jacobian()
    expected = Assemblers(system)
    expected.residuals()
    expected.jacobians()
    expected.A.assemble()
    assert system.add_residuals.described.integrals[0].lanes == chosen.lanes
    np.testing.assert_allclose(found, expected.b, rtol=1e-12, atol=1e-12 * np.abs(found).max())
    a, b = system.A.getValuesCSR()[2], expected.A.getValuesCSR()[2]
    np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-14 * np.abs(b).max())
    problem.destroy()


def test_a_cache_that_travels(from_text, tmp_path, monkeypatch):
    """On a processor that has less, nothing that more was compiled for is loaded; what is loaded needs nothing more."""
    text, libraries = OF_ONE % ("kernel", ", void* custom_data" if compat.KERNEL_TAKES_DATA else ""), {}
    flags = instructions.processor_flags()
    for known in reversed(instructions.available()):
        monkeypatch.setattr(instructions, "processor_flags", lambda known=known: flags & known.needs)
        assert instructions.best() == known
        before = set(tmp_path.glob("dolfbuoy_lanes*.so"))
        _, cells = from_text(text, instructions.best())
        (library,) = set(tmp_path.glob("dolfbuoy_lanes*.so")) - before
        assert cells == known.lanes
        libraries[known.name] = subprocess.run(["objdump", "-d", library], check=True, capture_output=True, text=True)
    for name, listing in libraries.items():
        assert re.search(r"%[xyz]mm\d", listing.stdout)
        assert not re.search(REGISTERS[name], listing.stdout)


def test_the_set_may_be_chosen(monkeypatch):
    monkeypatch.setenv(instructions.VARIABLE, "baseline")
    assert instructions.best().name == "baseline"
    monkeypatch.setenv(instructions.VARIABLE, "avx1024")
    with pytest.raises(InputError, match="avx1024"):
        instructions.best()


def test_what_is_not_known_stays(from_text):
    """A kernel that calls another function serves as it is, for one cell."""
    data = ", void* custom_data" if compat.KERNEL_TAKES_DATA else ""
    text = (OF_ONE % ("kernel", data)).replace("tanh(w0)", "tgamma(w0)")
    assert from_text(text, instructions.best()) is None


def test_a_kernel_with_other_numbers_is_not_used(from_text, caplog):
    """Compared once, where it is compiled, with that for one cell, and said once."""
    text = OF_ONE % ("kernel", ", void* custom_data" if compat.KERNEL_TAKES_DATA else "")
    other = text.replace("weights_a[2] = { 0.25, 0.75 }", "weights_a[2] = { 0.25, 0.750000001 }")
    assert from_text(text, instructions.best(), reference=other) is None
    assert from_text(text, instructions.best(), reference=other) is None
    (said,) = caplog.messages
    assert "kernel" in said
    assert "not used" in said


def test_cells_that_hang_on_last_digits_do_not_count(tmp_path):
    """A kernel with a pole is compared where it is far from it; one that has nothing else is not used."""
    text = OF_ONE % ("kernel", ", void* custom_data" if compat.KERNEL_TAKES_DATA else "")
    single = of_one(tmp_path, text)
    assert simd.difference(single, 1, single, SIZES) == 0.0
    nothing = of_one(tmp_path, text.replace("double w0 = 0.0;", "double w0 = log(-1.0);"))
    assert simd.difference(nothing, 1, nothing, SIZES) == np.inf


def test_without_the_text(monkeypatch, tmp_path):
    """Where FFCx's C is gone, its own kernel serves, cell by cell."""
    monkeypatch.setattr(build, "place_of", lambda kernel: (tmp_path / "gone.so", "kernel"))
    problem = Problem(load_scene(merged(MOORED, cable__elements=5)), dynamic=True, comm=MPI.COMM_SELF)
    loop = problem.system.add_residuals.described
    assert {loop.integrals[k].lanes for k in range(loop.count)} == {1}
    problem.system.u[:] = np.random.default_rng(2).uniform(-1, 1, problem.system.size)
    problem.system.publish()
    assert np.ptp(problem.system.evaluate()) > 1
    problem.destroy()
