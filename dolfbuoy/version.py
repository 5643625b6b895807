"""The version of dolfbuoy, and the time stamp of results."""

import time

__version__ = "0.3.0"


def now() -> str:
    """Present universal time in ISO 8601 format."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
