"""Shipped scenes with one or two keys made wrong, odd or extreme, drawn by number."""

import random
import re
import tomllib

from dolfbuoy.scene import list_keys, merged, shipped_scenes

#: Of whatever kind a key is.
ODD = (
    *(0, -1, 1, 2, 3.5, -0.0, 1e-320, 1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12, 1e300, 10**400, -1e300, True, False),
    *(float("inf"), float("-inf"), float("nan"), "", "x", "nan", "1e3", "\x1b[31m", "ä" * 50, "a" * 300, "buoy"),
    *(
        [],
        {},
        [[]],
        [{}],
        [0, 0, 0],
        [0.0, 0.0, -5.0],
        [1e5, 1e5, 1e5],
        [0, 0],
        [1, 2, 3, 4],
        [["x"]],
        [[0, 0], [0, 0]],
    ),
    *({"x": [0, 0, 0]}, {"kind": "free"}, {"kind": "fixed"}, [[0.0, 1.0], [1.0, 1.0]], "/dev/zero"),
)
#: Numbers of a sensible sign and size, most of which are scenes: what is hard to solve, not to read.
HARD = (1e-9, 1e-6, 1e-3, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1e3, 1e4, 1e6, 1e9)


def _words(key):
    return re.findall(r'"([\w-]+)"', key.range)


def bad_scene(number: int, hard: bool = False) -> dict:
    """The sections of a scene; hard: only numbers, of a size that may be meant."""
    dice = random.Random(number)
    data = tomllib.loads(dice.choice(sorted(shipped_scenes().items()))[1].read_text())
    keys = list_keys()
    for _ in range(dice.choice((1, 1, 2))):
        key = dice.choice(keys)
        values = HARD if hard else (*ODD, *HARD, *_words(key))
        value = dice.choice(values)
        if not hard and dice.random() < 0.1:
            data = _without(data, key.name)
        else:
            data = _placed(data, key.name, value, dice)
    return data


def _placed(data, name, value, dice):
    """The value under a dotted key; in one of several tables."""
    head, _, rest = name.partition(".")
    inner = data.get(head)
    if not rest:
        return data | {head: value}
    if isinstance(inner, list) and inner and isinstance(inner[0], dict):
        place = dice.randrange(len(inner))
        return data | {head: [_placed(one, rest, value, dice) if k == place else one for k, one in enumerate(inner)]}
    return data | {head: _placed(inner if isinstance(inner, dict) else {}, rest, value, dice)}


def _without(data, name):
    return merged(data, **{name.partition(".")[0]: None}) if "." not in name else _cut(data, name)


def _cut(data, name):
    head, _, rest = name.partition(".")
    if not rest:
        return {key: value for key, value in data.items() if key != head}
    inner = data.get(head)
    return data | {head: _cut(inner, rest)} if isinstance(inner, dict) else data
