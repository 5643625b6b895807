"""Which vector instructions this processor has.

What is compiled for them carries their name in the cache of compiled forms, and only what this processor has is ever
looked for: a cache may travel.  The variable DOLFBUOY_INSTRUCTIONS names a smaller set, or `baseline`, which every
processor has that the compiler writes for: containers are built so.
"""

import os
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError

VARIABLE = "DOLFBUOY_INSTRUCTIONS"


class Instructions(NamedTuple):
    """A set of vector instructions: flags of the processor that it takes, options of the compiler, doubles at once."""

    name: str
    needs: frozenset[str]
    options: tuple[str, ...]
    lanes: int


#: From the smallest on; each has those before it.  Without fused products they all round alike, so that processors,
#: and one cell or eight at once, give the same numbers: a consistent start amplifies a last digit by 1/h^2.
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
    """Instruction sets that the first processor names; empty where they cannot be read this way."""
    try:
        with Path("/proc/cpuinfo").open() as lines:
            return frozenset(next((line.split(":")[1] for line in lines if line.startswith("flags")), "").split())
    except OSError:
        return frozenset()


def available() -> list[Instructions]:
    """The sets that may be used here.  Raises InputError if DOLFBUOY_INSTRUCTIONS names none of `SETS`."""
    names = [known.name for known in SETS]
    largest = os.environ.get(VARIABLE) or names[-1]
    if largest not in names:
        raise InputError(f"{VARIABLE} = {largest!r}: must be one of {', '.join(names)}.")
    return [known for known in SETS[: names.index(largest) + 1] if known.needs <= processor_flags()]


def best() -> Instructions:
    """The largest set that may be used here.  Raises InputError as `available`."""
    return available()[-1]
