"""Hard scenes, each with what a trustworthy program must show and a check that measures it."""

from importlib import import_module

from .case import CATALOGUE

for _module in ("cable", "cable_motion", "slack", "buoy", "network", "numerics"):  # the order of the catalogue
    import_module(f".{_module}", __name__)

__all__ = ["CATALOGUE"]
