"""The worked example of dolfbuoy/coupling/README.md, a user's body on three lines, with any stepping function."""

import re
from functools import cache
from pathlib import Path

import numpy as np

import dolfbuoy

README = Path(dolfbuoy.__file__).parent / "coupling" / "README.md"


def example():
    """The definitions of the example, fresh."""
    (text,) = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    names = {}
    exec(compile(text, str(README), "exec"), names)
    return names


@cache
def built_in():
    """Poses of the built-in buoy."""
    return example()["built_in"]()


def furthest(own):
    """Largest difference from the built-in buoy, of positions and quaternions, relative to their range."""
    found = []
    for part in (slice(0, 3), slice(3, 7)):
        size = np.ptp(built_in()[:, part], axis=0).max()
        assert size > 0.01
        found.append(np.abs(own - built_in())[:, part].max() / size)
    return max(found)
