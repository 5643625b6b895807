"""A command run in an untrusted folder reads only its inputs there, and executes no code from it.

Source: configuration files of libraries, as named in their documentation; every name below the folder that a process
opens or queries (support/looks.c, in front of the C library).
"""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

#: Each leaves the file `ran` behind, or ends in a traceback, where it is read.
HOSTILE = {
    ".petscrc": "-log_view :{folder}/ran\n",
    "petscrc": "-log_view :{folder}/ran\n-dll_append {folder}/evil.so\n",
    "petsc.cfg": "PETSC_ARCH = {folder}\n",
    "slepc.cfg": "PETSC_ARCH = {folder}\n",
    "PETSc.py": "open('{folder}/ran', 'w')\n",
    "ucx.conf": "UCX_LOG_FILE={folder}/ran\nUCX_LOG_LEVEL=trace\n",
    "dolfinx_jit_options.json": '{{"cache_dir": "{folder}/ran"}}',
    "dolfinx_jit_parameters.json": '{{"cache_dir": "{folder}/ran"}}',
    "ffcx_options.json": "{{",
    "ffcx_parameters.json": "{{",
    ".ncrc": "HTTP.COOKIEJAR={folder}/ran\n",
    ".dodsrc": "HTTP.COOKIEJAR={folder}/ran\n",
    ".daprc": "HTTP.COOKIEJAR={folder}/ran\n",
    "matplotlibrc": "savefig.dpi: \udcff\n",
    ".numba_config.yaml": "[",
    "setup.cfg": "[build_ext]\ninclude_dirs = {folder}\n[",
    "pyproject.toml": "[",
    "sitecustomize.py": "open('{folder}/ran', 'w')\n",
    "numpy.py": "open('{folder}/ran', 'w')\n",
    "matplotlib.py": "open('{folder}/ran', 'w')\n",
    "mca-params.conf": "pml = {folder}\n",
}
COMMANDS = (
    "check short",
    "run short --t-end 0.2",
    "sweep hanging-chain --vary time.end=0.01,0.02",
)
SLOW = (
    "plot results/short",
    "static short --out calm",
    "export moordyn hanging-chain",
    "modes short",
    "stiffness short",
    "offsets short --force 0,100 --directions 0",
    "response short --periods 4:6:1",
    "statistics results/long --from 0.1",
    "advise driven --accuracy 5% --set time.end=2",
    "list",
    "doctor",
)


@pytest.fixture(scope="module")
def looks(tmp_path_factory):
    """The library that notes what is looked at."""
    library = tmp_path_factory.mktemp("shim") / "looks.so"
    source = Path(__file__).parents[1] / "support" / "looks.c"
    compiler = sysconfig.get_config_var("CC").split()[0]
    subprocess.run([compiler, "-shared", "-fPIC", "-w", "-o", library, source, "-ldl"], check=True)
    return library


@pytest.fixture
def folder(tmp_path):
    """With all of HOSTILE."""
    for name, text in HOSTILE.items():
        (tmp_path / name).write_bytes(text.format(folder=tmp_path).encode(errors="surrogateescape"))
    return tmp_path


def started(line, folder, looks):
    """(exit code, standard error, names below the folder that were looked at) of a command in a process of its own."""
    noted = folder.with_name("looked-at")
    environment = os.environ | {"LD_PRELOAD": str(looks), "LOOKS_AT": str(folder), "LOOKS_TO": str(noted)}
    command = [Path(sys.executable).with_name("dolfbuoy"), *line.split()]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    names = {line.partition(" ")[2] for line in noted.read_text(errors="replace").splitlines()}
    return done.returncode, done.stderr, names


@pytest.mark.parametrize("line", [*COMMANDS, *(pytest.param(line, marks=pytest.mark.slow) for line in SLOW)])
def test_nothing_of_the_current_folder_is_read(folder, looks, line):
    if "results/" in line:
        code, said, _ = started(f"run {Path(line.split()[1]).name} --t-end 0.2", folder, looks)
        assert code == 0, said
    code, said, names = started(line, folder, looks)
    assert "Traceback" not in said
    assert code == 0, said
    assert {name for name in names if name.split("/")[0] not in ("results", "calm", ".", "")} <= {*line.split()[1:]}
    assert not (folder / "ran").exists()


def test_the_shim_sees_what_is_read(folder, looks):
    """Else the test above says nothing."""
    noted = folder.with_name("looked-at")
    environment = os.environ | {"LD_PRELOAD": str(looks), "LOOKS_AT": str(folder), "LOOKS_TO": str(noted)}
    code = "import os, petsc4py.lib; os.path.exists('a'); petsc4py.lib.getPathArchPETSc(); import matplotlib"
    subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, check=False)
    assert {"a", "petsc.cfg"} <= {line.partition(" ")[2] for line in noted.read_text().splitlines()}
