"""Variants of a scene, as they are written on the command line or in a table: lists of changes."""

import csv
import itertools
import math
from pathlib import Path

from ..errors import InputError
from . import Scene, build_scene, parse_assignment
from .reading import DEEPEST, NO_SECTION, NO_TABLE, parse
from .sentences import UNKNOWN

MOST_CASES = 100_000


def parse_vary(text: str) -> tuple[str, list]:
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
    except ValueError as error:  # bare words, or a list that is none
        if "[" in values or "{" in values:
            raise InputError(f"--vary {text}: is not valid TOML: {str(error).rstrip('.')}.") from None
        found = [value.strip() for value in values.split(",")]
    if not all(found):
        raise InputError(f"--vary {text}: there is an empty value between the commas.")
    return key, [parse_assignment(f"{key}={value}")[1] for value in found]


def numbers_of(option: str, text: str) -> list[float]:
    """`a,b,c` or `start:stop:step` (stop included) of an option in numbers.  Raises InputError."""
    if ":" in text:
        return [float(number) for number in _range(f"{option} {text}", text.split(":"))]
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = [math.nan]
    if not all(map(math.isfinite, found)):
        raise InputError(f"{option} {text}: must be numbers with commas, or start:stop:step.")
    return found


def _range(text, parts):
    try:
        start, stop, step = (float(part) for part in parts)
        count = math.floor((stop - start) / step + 1e-9) + 1
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"{text}: a range must be start:stop:step in finite numbers, step not zero.") from None
    if count > MOST_CASES:
        raise InputError(f"{text}: the range must hold {MOST_CASES} values at most, not {count:.3g}.")
    if count < 1:
        raise InputError(f"{text}: the range is empty.")
    values = [float(f"{start + i * step:.12g}") for i in range(count)]  # 0.3, not 0.30000000000000004
    return [int(v) for v in values] if all(part.strip().lstrip("+-").isdigit() for part in parts) else values


def cases_of(vary: list[str], table: Path | None) -> list[dict]:
    """Changes of each case: all combinations of `vary`, or the rows of a CSV file whose header names keys."""
    if (table is None) == (not vary):
        raise InputError("--vary: must be given once or more, or --table.")
    if table is not None:
        return _rows(table)
    keys, values = zip(*(parse_vary(text) for text in vary), strict=True)
    if len(set(keys)) < len(keys):
        raise InputError(f"--vary: {max(keys, key=keys.count)} is given more than once.")
    if math.prod(map(len, values)) > MOST_CASES:
        raise InputError(f"--vary: must give {MOST_CASES} cases at most, not {math.prod(map(len, values)):.3g}.")
    return [dict(zip(keys, combination, strict=True)) for combination in itertools.product(*values)]


def _rows(table):
    if not Path(table).is_file():
        raise InputError(f"--table {table}: must be a CSV file.")
    try:
        with open(table, newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"--table {table}: cannot be read as a CSV file: {error}.") from None
    if not rows:
        raise InputError(f"--table {table}: it needs a header of keys and at least one row.")
    if not all(key.strip() for key in header) or len(set(header)) < len(header):
        raise InputError(f"--table {table}: every column needs a key of its own in the header, not {','.join(header)}.")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header) or not all(value.strip() for value in row):
            raise InputError(f"--table {table}: row {number} does not have one value for each of {', '.join(header)}.")
    return [dict(parse_assignment(f"{k}={v}") for k, v in zip(header, row, strict=True)) for row in rows]


def check_known(scene: Scene, key: str) -> None:
    """Refuse a key that no scene has (InputError); whether its values are good shows case by case."""
    try:
        build_scene(scene.to_dict(), {key: scene.to_dict()})
    except InputError as error:
        if any(words in str(error) for words in (UNKNOWN, NO_SECTION, NO_TABLE)):
            raise InputError(f"--vary {key}: {error}") from None
