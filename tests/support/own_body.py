"""The worked example of dolfbuoy/coupling/README.md, a body of one's own on three lines, with any way to step it."""

import re
from functools import cache
from pathlib import Path

import numpy as np

import dolfbuoy

README = Path(dolfbuoy.__file__).parent / "coupling" / "README.md"


def example():
    """What the example defines, fresh."""
    (text,) = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    names = {}
    exec(compile(text, str(README), "exec"), names)
    return names


@cache
def built_in():
    """Poses of the buoy that is built in."""
    return example()["built_in"]()


def furthest(own):
    """Largest difference from the built-in buoy, of positions and of quaternions, over their range."""
    found = []
    for part in (slice(0, 3), slice(3, 7)):
        size = np.ptp(built_in()[:, part], axis=0).max()
        assert size > 0.01
        found.append(np.abs(own - built_in())[:, part].max() / size)
    return max(found)
