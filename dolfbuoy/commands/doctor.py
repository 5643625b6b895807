"""Is this machine fit to run dolfbuoy?  Versions, a compiled form, a nonlinear solve, and MPI."""

import importlib.util
import os
import shutil
import subprocess
import sys
from types import ModuleType

from ..errors import OF_THE_SYSTEM, InputError


def installed() -> ModuleType:
    """The module of the versions of packages of the system.  Raises InputError if some of them are missing."""
    absent = [name for name in OF_THE_SYSTEM if importlib.util.find_spec(name) is None]
    if absent:
        raise InputError(
            f"{', '.join(absent)}: not installed for {sys.executable}; docker/install.sh installs them from Debian, "
            "pip cannot."
        )
    from ..solver import compat

    return compat


def examine() -> list[tuple[str, bool, str]]:
    """Name of every check, True if it passed, and the result."""
    compat = installed()
    wanted = ", ".join(f"{major}.{minor} ({debian})" for (major, minor), debian in compat.SUPPORTED.items())
    version = f"found {compat.versions()['dolfinx']}, supported: {wanted}"
    found: list[tuple[str, bool, str]] = [("dolfinx version", compat.supported(), version)]
    for name, probe in (("compile a form and solve with SNES", _solve), ("start MPI on two ranks", _mpi)):
        try:
            found.append((name, True, probe()))
        except Exception as error:  # a doctor reports whatever it finds
            found.append((name, False, f"{type(error).__name__}: {error}"))
    return found


def _solve() -> str:
    from ..api import solve_static
    from ..elsewhere import MPI

    top = {"kind": "fixed", "position": [0.6, 0.0, 0.5]}
    scene = {"gravity": 1.0, "cable": {"length": 1.0, "line_density": 1.0, "elements": 16, "top": top}}
    record = solve_static(scene, comm=MPI.COMM_SELF)
    exact = 0.7984082610988972  # |(H, V)| of the catenary
    error = abs(float(record.tension_top) / exact - 1)
    if error > 0.01:
        raise RuntimeError(f"the top tension of a catenary is off by {100 * error:.2g} %")
    return f"a catenary in {int(record.newton_iterations)} iterations"


def _mpi() -> str:
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        raise RuntimeError("mpirun is not on the PATH")
    code = "from mpi4py import MPI; print(MPI.COMM_WORLD.allreduce(1))"
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMIX_", "PMI_"))}
    environment |= {k: v for k, v in os.environ.items() if k.startswith("OMPI_ALLOW")}
    command = [mpirun, "--oversubscribe", "-n", "2", sys.executable, "-c", code]
    if os.geteuid() == 0:
        command.insert(1, "--allow-run-as-root")
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, check=False)
    if "".join(result.stdout.split()) != "22":  # lines of two ranks may mix
        raise RuntimeError((result.stderr or result.stdout).strip().splitlines()[-1])
    return "two ranks answered"
