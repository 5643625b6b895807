"""A host process that imports and uses dolfbuoy is left unchanged: environment, modules, libraries.

Source: the state of the process before, and a form of its own, compiled to the same text as without dolfbuoy.
"""

import os
import subprocess
import sys

import pytest

from dolfbuoy.elsewhere import _ALONE, _alone

HOST = """
import gc, logging, os, signal, sys

def state():
    import dolfinx.jit, ffcx, ffcx.codegeneration.jit, ufl
    options = ffcx.parameters if hasattr(ffcx, "parameters") else ffcx.options
    counter = "_globalcount" if hasattr(ufl.Constant, "_globalcount") else "_counter"
    reading = "_load_parameters" if hasattr(dolfinx.jit, "_load_parameters") else "_load_options"
    return {
        "compiler": dolfinx.jit.ffcx_jit,
        "cache": ffcx.codegeneration.jit.get_cached_module,
        "options": getattr(dolfinx.jit, reading),
        "options of FFCx": getattr(options, reading),
        "counter": getattr(ufl.Constant, counter),
        "pkg_resources": sys.modules.get("pkg_resources"),
        "logging": logging.root.manager.disable,
        "signals": [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)],
        "folder": os.getcwd(),
        "garbage": [gc.isenabled(), gc.get_threshold(), gc.get_freeze_count()],
        "symbols": sys.getdlopenflags(),
        "arguments": list(sys.argv),
        "environment": dict(os.environ),
    }

def compiled():
    # name in the cache, made of text and options, of a form of the host's own
    import dolfinx.jit, ufl
    from dolfinx import fem, mesh
    from mpi4py import MPI
    space = getattr(fem, "functionspace", None) or fem.FunctionSpace
    V = space(mesh.create_unit_interval(MPI.COMM_SELF, 2), ("Lagrange", 1))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    k = [fem.Constant(V.mesh, 1.0) for _ in range(2)]
    form = ufl.inner(k[0] * ufl.grad(u), ufl.grad(v)) * ufl.dx + k[1] * u * v * ufl.dx
    return dolfinx.jit.ffcx_jit(MPI.COMM_SELF, form)[1].__name__

first = sys.argv.pop(1)
if first == "host":
    import dolfinx
    own, before = compiled(), state()
    import dolfbuoy
    assert state() == before
else:
    environment = dict(os.environ)
    import dolfbuoy
    assert not {"numpy", "mpi4py.MPI", "petsc4py.PETSc", "dolfinx", "ufl"} & sys.modules.keys()
    assert dict(os.environ) == environment
dolfbuoy.simulate("driven", **{"time.end": 0.1})
if first == "host":
    after = state()
    assert after["counter"] == before["counter"]
    assert after == before, {name for name in before if before[name] != after[name]}
    assert compiled() == own
else:
    assert dict(os.environ) == environment
    assert "pkg_resources" not in sys.modules
    import ufl
    assert getattr(ufl.Constant, "_globalcount", 0) < 1000
print("as it was")
"""


@pytest.mark.parametrize("first", ["host", "dolfbuoy"])
def test_a_host_is_left_as_it_was(first, tmp_path):
    """Whoever starts the libraries; a run is within."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("OMP", "PMI"))}
    command = [sys.executable, "-c", HOST, first, "argument"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stdout == "as it was\n", done.stderr[-2000:]


@pytest.mark.parametrize(("started", "alone"), [((), True), (("PMI_RANK",), False), (("PMIX_RANK",), False)])
def test_a_process_alone_starts_mpi_quickly(started, alone, monkeypatch):
    """Without daemon and network; not one that mpirun or srun has started, and not a user who chooses otherwise."""
    layer, transport = "OMPI_MCA_pml", "OMPI_MCA_btl"
    for name in ("PMI_RANK", "PMIX_RANK", *_ALONE):
        monkeypatch.delenv(name, raising=False)
    for name in started:
        monkeypatch.setenv(name, "0")
    monkeypatch.setenv(transport, "tcp")
    with _alone():
        assert (os.environ.get(layer) == "ob1") == alone
        assert os.environ[transport] == "tcp"
    assert layer not in os.environ
    assert os.environ[transport] == "tcp"
