"""Where a benchmark ran: processor, cores, versions."""

import contextlib
import importlib.metadata as metadata
import os
import platform
import subprocess
from pathlib import Path

import dolfbuoy
from dolfbuoy.solver import compat


def description() -> dict[str, str]:
    """Name -> value, for a table's notes."""
    found = {"processor": _processor(), "cores": str(os.cpu_count()), "system": platform.platform(terse=True)}
    found |= {name: value for name, value in compat.versions().items() if name in ("dolfinx", "petsc", "python")}
    with contextlib.suppress(metadata.PackageNotFoundError):
        found["MoorDyn"] = metadata.version("moordyn")
    return found


def version() -> str:
    """'version 0.1.0 (commit af51f78)' of the program here."""
    command = ["git", "-C", Path(__file__).parent, "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    return f"version {dolfbuoy.__version__} (commit {commit})"


def sentence() -> str:
    """The description in one line."""
    return ", ".join(f"{name} {value}" for name, value in description().items()) + "."


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
