"""Unknowns, compiled forms and Newton's method: knows no buoy.

Whatever is imported from here first starts PETSc, and MPI with it.
"""

import os
import sys

# Must be set before the libraries behind numpy and PETSc start their threads; the user's own value is kept.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import petsc4py

if "petsc4py.PETSc" not in sys.modules:  # Ctrl-C, SIGTERM and a closed pipe are Python's business, not PETSc's
    petsc4py.init(["dolfbuoy", "-no_signal_handler"])
