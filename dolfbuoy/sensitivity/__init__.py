"""Derivatives of results by the numbers of a scene."""

from .derivatives import sensitivities

__all__ = ["sensitivities"]
