"""Vector instructions of this processor.

Files compiled for them have their name in the cache of compiled forms, and only those for this processor are used: a
cache can be moved.  The variable DOLFBUOY_INSTRUCTIONS selects a smaller set, or `baseline`, which every processor of
the compiler's target has: used to build containers.
"""

import os
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError

VARIABLE = "DOLFBUOY_INSTRUCTIONS"


class Instructions(NamedTuple):
    """A set of vector instructions: required processor flags, compiler options, doubles per vector."""

    name: str
    needs: frozenset[str]
    options: tuple[str, ...]
    lanes: int


#: In increasing order, each including those before it.  Without fused multiply-add all round in the same way, so that
#: results do not depend on the processor or on the cells per vector: a consistent start amplifies rounding by 1/h^2.
SETS = (
    Instructions("baseline", frozenset(), (), 2),
    Instructions("avx2", frozenset({"avx2"}), ("-mavx2",), 4),
    Instructions(
        "avx512",
        frozenset({"avx2", "avx512f", "avx512dq"}),
        ("-mavx2", "-mavx512f", "-mavx512dq", "-mprefer-vector-width=512", "-ffp-contract=off"),
        8,
    ),
)


@cache
def processor_flags() -> frozenset[str]:
    """Flags of the first processor; empty if they cannot be read this way."""
    try:
        with Path("/proc/cpuinfo").open() as lines:
            return frozenset(next((line.split(":")[1] for line in lines if line.startswith("flags")), "").split())
    except OSError:
        return frozenset()


def available() -> list[Instructions]:
    """The sets usable here.  Raises InputError if DOLFBUOY_INSTRUCTIONS is not one of `SETS`."""
    names = [known.name for known in SETS]
    largest = os.environ.get(VARIABLE) or names[-1]
    if largest not in names:
        raise InputError(f"{VARIABLE} = {largest!r}: must be one of {', '.join(names)}.")
    return [known for known in SETS[: names.index(largest) + 1] if known.needs <= processor_flags()]


def best() -> Instructions:
    """The largest set usable here.  Raises InputError as `available`."""
    return available()[-1]
