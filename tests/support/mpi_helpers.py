"""Shared by the tests that start mpirun."""

import json
import os
import shutil
import subprocess
import sys
import tempfile

import pytest

#: Beginnings of what Open MPI puts into the environment of a process that mpirun has not started.
SINGLE = ("PMIX_", "OMPI_MCA_ess", "OMPI_MCA_orte_", "OMPI_MCA_pmix", "ORTE_SCHIZO_DETECTION")
needs_mpirun = pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is not installed")


def environment(**more):
    """Environment of a process that may start more ranks than there are cores, also as root."""
    # A pytest that has started MPI itself leaves its own to its workers, with which mpirun ends without a word.
    found = {key: value for key, value in os.environ.items() if not key.startswith(SINGLE)}
    found |= {"OMP_NUM_THREADS": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
    found["PRTE_MCA_rmaps_default_mapping_policy"] = ":oversubscribe"
    if os.geteuid() == 0:  # Open MPI refuses to run as root otherwise
        found |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    found.setdefault("OMPI_MCA_btl", "^tcp")  # processes of one machine
    return found | {key: str(value) for key, value in more.items()}


def command(ranks, arguments):
    """mpirun with Python and its arguments."""
    return ["mpirun", "-n", str(ranks), sys.executable, *map(str, arguments)]


def start(ranks, arguments, folder, timeout=300, **more):
    """A finished mpirun process; more: variables of its environment."""
    with tempfile.TemporaryDirectory(prefix="ompi-") as own:  # another mpirun that ends would take a common one along
        sessions = {"OMPI_MCA_orte_tmpdir_base": own, "PRTE_MCA_prte_tmpdir_base": own}
        options = {"cwd": folder, "env": environment(**sessions, **more), "timeout": timeout}
        return subprocess.run(command(ranks, arguments), capture_output=True, text=True, **options)


#: Runs each scene of scenes.json in a folder of its name.
SIMULATE = """
import json, sys
import dolfbuoy

for name, scene in json.load(open(sys.argv[1])).items():
    dolfbuoy.simulate(scene, out=name)
"""


def start_scenes(ranks, scenes, folder, script=SIMULATE, *arguments):
    """A finished mpirun process of a script that is given the path of scenes.json, with named scenes."""
    (folder / "run.py").write_text(script)
    (folder / "scenes.json").write_text(json.dumps(scenes))
    return start(ranks, ["run.py", "scenes.json", *arguments], folder, timeout=600)
