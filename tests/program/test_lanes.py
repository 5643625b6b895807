"""Kernels for several cells at once: the same numbers with every set of instructions, and none that a processor lacks.

Source: the kernels of FFCx for one cell, as dolfinx's assemblers call them.
"""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.model.problem import Problem
from dolfbuoy.solver import c_code, compat, instructions, lanes, loops
from dolfbuoy.solver.floor import Assemblers

SETS = {known.name: known for known in instructions.SETS}
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
    """Writes the text of a kernel into a cache of its own; returns what `lanes` makes of it for a set."""
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)

    def compiled(text, chosen):
        (tmp_path / "text.c").write_text(text)
        return lanes._compiled.__wrapped__(tmp_path / "text.c", "kernel", chosen)

    return compiled


def called(function, cells, w, c, x):
    """A of every cell, (2, cells)."""
    A = c_code.aligned(2 * cells).reshape(2, cells)
    arrays = [A, *(c_code.aligned(a.size).reshape(a.shape) for a in (w, c, x))]
    for array, values in zip(arrays[1:], (w, c, x), strict=True):
        array[:] = values
    ffi = loops.compiled().ffi
    call = ffi.cast("void (*)(double *, double *, double *, double *)", function)
    call(*(ffi.cast("double *", array.ctypes.data) for array in arrays))
    return A


def of_one(monkeypatch, from_text, text):
    """The same kernel for one cell, as it is."""
    monkeypatch.setattr(lanes, "is_known", lambda kernel: False)
    function, cells = from_text(text, SETS["baseline"])
    monkeypatch.undo()
    assert cells == 1
    return function


@pytest.mark.parametrize("chosen", instructions.available(), ids=lambda known: known.name)
def test_every_word_of_a_kernel(chosen, from_text, tmp_path, monkeypatch):
    """Choices, powers, functions and initial values, in the words of all FFCx."""
    data = ", void* custom_data" if compat.KERNEL_TAKES_DATA else ""
    text, rng = OF_ONE % ("kernel", data), np.random.default_rng(3)
    function, cells = from_text(text, chosen)
    assert cells == chosen.lanes
    w, c, x = values_of_cells(rng, cells)
    found = called(function, cells, w, c, x)
    single = of_one(monkeypatch, from_text, text.replace("static const", "const"))
    expected = np.concatenate(
        [called(single, 1, *(np.ascontiguousarray(a[:, [k]]) for a in (w, c, x))) for k in range(cells)], axis=1
    )
    assert np.ptp(expected) > 1
    np.testing.assert_allclose(found, expected, rtol=1e-14)
