"""The version of dolfbuoy, and the date that results are stamped with."""

import time

__version__ = "0.3.0"


def now() -> str:
    """Universal time, as in ISO 8601."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
