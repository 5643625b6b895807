"""What an engineer looks at before a run: derived numbers of a scene, and where its model leaves its range."""

from .report import Report, check, derived

__all__ = ["Report", "check", "derived"]
