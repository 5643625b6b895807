"""The version of dolfbuoy."""

__version__ = "0.1.0"
