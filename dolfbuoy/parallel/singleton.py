"""A process alone: Open MPI needs no daemon there and no network, each of which takes 0.2 s to start."""

import os

_SETTINGS = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}
_ours = set()


def before_mpi() -> None:
    """Say so in the environment, unless mpirun or srun started this process; what the user has set there stays."""
    if not {"PMIX_RANK", "PMI_RANK"} & os.environ.keys():
        _ours.update(_SETTINGS.keys() - os.environ.keys())
        os.environ.update({name: _SETTINGS[name] for name in _ours})


def after_mpi() -> None:
    """Take it back: what is started from here may be several, and mpirun would pass it on to them."""
    for name in _ours:
        os.environ.pop(name, None)
    _ours.clear()
