"""Variants of a scene from the command line or a table: lists of changes."""

import csv
import hashlib
import inspect
import itertools
import json
import math
from pathlib import Path
from typing import Any

from ..errors import InputError
from . import Scene, build_scene, parse_assignment
from .quantities import number_of
from .reading import DEEPEST, NO_SECTION, NO_TABLE, parse
from .sentences import UNKNOWN

MOST_CASES = 100_000
#: Column of a table of cases that is not a scene key: the probability of the case.
PROBABILITY = "probability"
SEED = "waves.seed"


def parse_vary(text: str) -> tuple[str, list[Any]]:
    """`key=a,b,c` or `key=start:stop:step` (stop included) -> (key, values).  Raises InputError."""
    key, equals, values = (part.strip() for part in text.partition("="))
    if not text.strip().isprintable():
        raise InputError(f"--vary {text}: must be on one line, without control characters.")
    if not key or not equals or not values:
        raise InputError(f"--vary {text}: must have the form section.key=a,b,c or section.key=start:stop:step.")
    if key.count(".") >= DEEPEST:
        raise InputError(f"--vary {key[:50]}...: must have {DEEPEST} names in its key at most.")
    if ":" in values:
        return key, _range(f"--vary {text}", values.split(":"))
    try:
        return key, parse(f"values = [{values}]")["values"]
    except ValueError as error:  # bare words, or an invalid list
        if "[" in values or "{" in values:
            raise InputError(f"--vary {text}: is not valid TOML: {str(error).rstrip('.')}.") from None
        found = [value.strip() for value in values.split(",")]
    if not all(found):
        raise InputError(f"--vary {text}: there is an empty value between the commas.")
    return key, [parse_assignment(f"{key}={value}")[1] for value in found]


def numbers_of(option: str, text: str) -> list[float]:
    """Numbers of an option given as `a,b,c` or `start:stop:step` (stop included).  Raises InputError."""
    if ":" in text:
        return [float(number) for number in _range(f"{option} {text}", text.split(":"))]
    try:
        found = [number_of(part) for part in text.split(",")]
    except ValueError:
        found = [math.nan]
    if not all(map(math.isfinite, found)):
        raise InputError(f"{option} {text}: must be numbers with commas, or start:stop:step.")
    return found


def _range(text: str, parts: list[str]) -> list[Any]:
    try:
        start, stop, step = (number_of(part) for part in parts)
        count = math.floor((stop - start) / step + 1e-9) + 1
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"{text}: a range must be start:stop:step in finite numbers, step not zero.") from None
    if count > MOST_CASES:
        raise InputError(f"{text}: the range must hold {MOST_CASES} values at most, not {count:.3g}.")
    if count < 1:
        raise InputError(f"{text}: the range is empty.")
    values = [float(f"{start + i * step:.12g}") for i in range(count)]  # 0.3, not 0.30000000000000004
    return [int(v) for v in values] if all(part.strip().lstrip("+-").isdigit() for part in parts) else values


def cases_of(vary: list[str], table: Path | None, seeds: int | None = None) -> list[dict[str, Any]]:
    """Changes of each case: all combinations of `vary`, or the rows of a CSV file whose header names keys; with seeds,
    these may be the only difference."""
    if not vary and table is None and seeds is not None:
        return [{}]
    if (table is None) == (not vary):
        raise InputError("--vary: must be given once or more, or --table, or --seeds.")
    if table is not None:
        return _rows(table)
    keys, values = zip(*map(parse_vary, vary), strict=True)
    if len(set(keys)) < len(keys):
        raise InputError(f"--vary: {max(keys, key=keys.count)} is given more than once.")
    if math.prod(map(len, values)) > MOST_CASES:
        raise InputError(f"--vary: must give {MOST_CASES} cases at most, not {math.prod(map(len, values)):.3g}.")
    return [dict(zip(keys, combination, strict=True)) for combination in itertools.product(*values)]


def latin_hypercube(vary: list[str], table: Path | None, count: int) -> list[dict[str, Any]]:
    """Changes of `count` cases by a Latin hypercube over the ranges KEY=low:high of `vary`.  Raises InputError.
    Each key has one value in every `count`-th of its range (scipy.stats.qmc.LatinHypercube)."""
    import numpy as np
    from scipy.stats import qmc

    if table is not None or not vary:
        raise InputError("--latin: needs --vary KEY=low:high for each key that it samples, and no --table.")
    ranges = dict(_limits(text) for text in vary)
    if len(ranges) < len(vary):
        raise InputError("--vary: a key is given more than once.")
    if not 1 <= count <= MOST_CASES:
        raise InputError(f"--latin {count}: must be from 1 to {MOST_CASES}.")
    low, high = np.array(list(ranges.values())).T
    name = "rng" if "rng" in inspect.signature(qmc.LatinHypercube).parameters else "seed"  # scipy 1.15 calls it so
    points = qmc.LatinHypercube(len(ranges), **{name: np.random.default_rng(0)}).random(count)
    return [dict(zip(ranges, map(float, low + point * (high - low)), strict=True)) for point in points]


def _limits(text: str) -> tuple[str, tuple[float, float]]:
    """`key=low:high` -> (key, (low, high))."""
    key, equals, values = (part.strip() for part in text.partition("="))
    try:
        low, high = (number_of(part) for part in values.split(":"))
    except ValueError:
        low = high = math.nan
    if not (equals and key and text.isprintable() and -math.inf < low < high < math.inf):
        raise InputError(f"--vary {text}: with --latin it must be section.key=low:high in finite numbers that rise.")
    return key, (low, high)


def with_seeds(changes: list[dict[str, Any]], seeds: int) -> list[dict[str, Any]]:
    """Each case repeated `seeds` times with its own values of waves.seed.  Raises InputError.
    They follow from the case and the repetition alone, independent of other cases and of the process."""
    if seeds < 1 or len(changes) * seeds > MOST_CASES:
        raise InputError(f"--seeds {seeds}: must be at least 1, and give {MOST_CASES} cases at most.")
    if any(SEED in change for change in changes):
        raise InputError(f"--seeds {seeds}: does not go with {SEED} among the keys that vary.")
    found = []
    for change, k in itertools.product(changes, range(seeds)):
        digest = hashlib.sha256(json.dumps([change, k], sort_keys=True).encode()).digest()
        found.append(change | {SEED: int.from_bytes(digest[:4], "big")})
    return found


def probabilities(table: Path) -> list[tuple[dict[str, Any], float]]:
    """[(changes, probability), ...] of a scatter diagram: a table of cases with a column `probability`.

    Raises InputError if that column is missing, or does not hold probabilities with a sum of at most 1.
    """
    rows = _rows(table, "--scatter")
    try:
        found = [(row, float(row.pop(PROBABILITY))) for row in rows]
        good = all(p >= 0 for _, p in found) and sum(p for _, p in found) <= 1 + 1e-6
    except (KeyError, TypeError, ValueError):
        good = False
    if not good:
        raise InputError(f"--scatter {table}: needs a column {PROBABILITY} of numbers >= 0 whose sum is 1 at most.")
    return found


def _rows(table: Path, option: str = "--table") -> list[dict[str, Any]]:
    if not Path(table).is_file():
        raise InputError(f"{option} {table}: must be a CSV file.")
    try:
        with open(table, newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{option} {table}: cannot be read as a CSV file: {error}.") from None
    if not rows:
        raise InputError(f"{option} {table}: it needs a header of keys and at least one row.")
    if not all(key.strip() for key in header) or len(set(header)) < len(header):
        raise InputError(f"{option} {table}: every column needs a key of its own in its header, {','.join(header)}.")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header) or not all(value.strip() for value in row):
            raise InputError(f"{option} {table}: row {number} does not have one value for each of {', '.join(header)}.")
    found = [dict(parse_assignment(f"{k}={v}") for k, v in zip(header, row, strict=True)) for row in rows]
    return found if option == "--scatter" else [{k: v for k, v in row.items() if k != PROBABILITY} for row in found]


def check_known(scene: Scene, key: str) -> None:
    """Raise InputError for a key that no scene has; its values are checked case by case."""
    try:
        build_scene(scene.to_dict(), {key: {}})  # a value that is invalid for every key, for another reason
    except InputError as error:
        if any(words in str(error) for words in (UNKNOWN, NO_SECTION, NO_TABLE)):
            raise InputError(f"--vary {key}: {error}") from None


def in_words(changes: dict[str, Any]) -> str:
    """The changes of a case: "key = value, ..."."""
    return ", ".join(f"{key} = {value}" for key, value in changes.items())
