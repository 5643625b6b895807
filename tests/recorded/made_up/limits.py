"""Values at, below and above what is allowed at most, with small limits where the own ones are large."""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
from told import SHIP

from dolfbuoy import InputError, load_scene
from dolfbuoy.formats import moordyn_text
from dolfbuoy.formats.names import LONGEST, Names
from dolfbuoy.results.devices import DECK, SIDES, corners_of
from dolfbuoy.scene import cable, reading, sentences, variants, wave_files
from dolfbuoy.sensitivity import expressions

DRIVEN = load_scene("driven")


def beside(what, call, *values):
    """Print for each value whether it is allowed."""
    for value in values:
        try:
            call(value)
        except (InputError, ValueError) as error:
            print(f"{what} {value}: {error}"[:220])
        else:
            print(f"{what} {value}: allowed")


def of_variants():
    """Numbers of cases."""
    with patch.object(variants, "MOST_CASES", 4):
        beside("range", partial(variants.numbers_of, "x"), "1:4:1", "1:5:1", "1:4.999:1", "4:1:-1", "5:1:-1", "1:0.5:1")
        beside("product", lambda n: variants.cases_of(["a.b=1,2", f"a.c={','.join('12345'[:n])}"], None), 2, 3)
        beside("latin", lambda n: len(variants.latin_hypercube(["a.b=1:2"], None, n)), 0, 1, 4, 5)
        beside("seeds", lambda n: variants.with_seeds([{}, {"a": 1}], n), 0, 1, 2, 3)
    print([variants.numbers_of("x", text) for text in ("0:0.3:0.1", "1:2:0.25", "3:1:-1", "1,2.5", "0:0.2999999:0.1")])


def of_scenes():
    """Sizes of lists, steps, motions, files and names."""
    several = partial(load_scene, DRIVEN)
    with patch.object(cable, "MOST_SEGMENTS", 3), patch.object(cable, "MOST_ELEMENTS", 40):
        beside("segments", lambda n: several(**{"cable.elements": [[22.0 / n, 2]] * n}), 3, 4)
        beside("elements", lambda n: several(**{"cable.elements": [[11.0, n], [11.0, 20]]}), 20, 21)
    beside("step", lambda h: several(**{"time.end": 1.0, "time.step": h}), 1.1e-9, 1e-9, 0.9e-9)
    beside(
        "min_step", lambda h: several(**{"time.tolerance": 1e-3, "time.min_step": h, "time.max_step": 0.1}), 0.1, 0.11
    )
    moved = {"cable.top.amplitude": None, "cable.top.period": None}
    beside("speed", lambda v: several(**moved | {"cable.top.motion": [[0, 0, 0, 0], [1, v, 0, 0]]}), 1000.0, 1001.0)
    body = SHIP["vessel"][0]
    for column, values in ((1, (1000.0, 1001.0)), (6, (90.0, 91.0))):
        still, end = [0.0] * 7, [0.01 if column > 3 else 1.0] + [0.0] * 6
        still[0], end[0] = 0.0, 1.0
        beside(
            f"column {column}",
            lambda v, k=column, end=end, still=still: load_scene(
                SHIP, vessel=[body | {"motion": [still, [*end[:k], v, *end[k + 1 :]]]}]
            ),
            *values,
        )
    beside("name", lambda n: several(**{"cable.name": "n" * n}), 50, 51)
    beside("title", lambda n: several(title="t" * n), 200, 201)
    beside("names in a key", lambda n: reading.parse(".".join(["a"] * n) + " = 1"), 30, 31)
    with TemporaryDirectory() as place, patch.object(wave_files, "MOST_BYTES", 8):
        for size in (8, 9):
            Path(place, "a.csv").write_bytes(b"0 1\n2 3 4"[:size])
            try:
                print("bytes", size, wave_files.file_of(str(Path(place, "a.csv")), "a table").stat().st_size)
            except ValueError as error:
                print("bytes", size, error)
    print([len(sentences.shown("x" * n)) for n in (197, 198, 199, 200)])
    print(
        [
            len(Names("line", lambda text: None).of(letter * count))
            for letter in "a1"
            for count in (LONGEST - 1, LONGEST, LONGEST + 1)
        ]
    )
    names = Names("line", print)
    print([names.of(name) for name in ("a b", "a_b", "a-b", "7", "é", "x" * 60, "x" * 61, "a b")])
    long = ["x" * (expressions.LONGEST + more) for more in (0, 1)]
    for text in (*long, *("(" * deep + "1" + ")" * deep for deep in (30, 31))):
        try:
            print("expression", len(text), type(expressions.Expression(text, "here")).__name__)
        except (InputError, ValueError) as error:
            print("expression", len(text), f"{error}"[-60:])


def of_columns():
    """What names of columns of MoorDyn's files mean, by section."""
    own = {name for names in moordyn_text._IN.values() for name in names}
    every = sorted(own | {name for names in moordyn_text.COLUMNS.values() for name in names})
    for section in (*moordyn_text.NEEDED, "failure", "external loads", "control"):
        print(section, *(f"{name}:{moordyn_text.canonical(section, name)}" for name in every))


def of_boxes():
    """Areas and heights of the sides of a vessel's box, whose last one is its deck."""
    for side in (*SIDES, DECK):
        a, b, c, d = np.array(corners_of((7.0, 3.0, -1.0, 1.0)))[side]
        print(np.linalg.norm(np.cross(c - a, d - b)) / 2, (a + b + c + d) / 4)


of_variants()
of_scenes()
of_columns()
of_boxes()
