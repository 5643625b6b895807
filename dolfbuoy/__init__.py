"""dolfbuoy: simulation of a tethered buoy with FEniCSx.

    from dolfbuoy import load_scene, simulate, solve_static
    record = simulate(load_scene("short"), time={"end": 5.0})

The model and the interpretation of ambiguous passages of the paper are described in forms/README.md and in the
docstrings of `dolfbuoy.forms`.
"""

import importlib

from .elsewhere import elsewhere
from .errors import InputError, SolveError
from .version import __version__ as __version__

#: Functions of the interface and their modules, imported at first use.
_OF_API = dict.fromkeys(("offsets", "periodic", "simulate", "solve_static", "wave_components"), "api")
_OF_API |= dict.fromkeys(("modes", "response", "stiffness"), "linear_api")
_OF_API |= {"check": "check", "show": "page.folder"}
_OF_API["Session"] = "coupling"
_OF_API |= dict.fromkeys(("calibrate", "design", "sensitivities", "uncertainty"), "sensitivity")
__all__ = ["InputError", "SolveError", "figures", "load_scene", "statistics", *_OF_API]


def __dir__():
    return sorted({*globals(), *__all__})


def __getattr__(name):
    """Import the interface at first use: `import dolfbuoy` alone does not start MPI."""
    if name == "load_scene":
        from .scene import load_scene

        return load_scene
    if name in _OF_API:
        try:
            with elsewhere():  # this starts libraries
                module = importlib.import_module(f".{_OF_API[name]}", __name__)
        except ImportError as error:
            from .errors import missing

            if missing(error) is None:
                raise
            raise ImportError(str(missing(error))) from None
        return getattr(module, name)
    if name == "figures":
        from .results import figures

        return figures
    if name == "statistics":
        from .results.statistics import statistics

        return statistics
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
