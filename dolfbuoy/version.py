"""The version of dolfbuoy."""

__version__ = "0.2.0"
