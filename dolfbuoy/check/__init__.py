"""Derived numbers of a scene before a run, and warnings where its model leaves its range."""

import sys
from types import ModuleType

from .report import Report, check, derived

__all__ = ["Report", "check", "derived"]


class _Called(ModuleType):
    """This package, which `dolfbuoy.check(scene)` calls as the function: both have that name."""

    __call__ = staticmethod(check)


sys.modules[__name__].__class__ = _Called
