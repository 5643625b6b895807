"""Derived numbers of a scene before a run, and warnings where its model leaves its validity range."""

import sys
from types import ModuleType

from .report import Report, check, derived

__all__ = ["Report", "check", "derived"]


class _Called(ModuleType):
    """This package made callable, as `dolfbuoy.check` is both the package and the function."""

    __call__ = staticmethod(check)


sys.modules[__name__].__class__ = _Called
