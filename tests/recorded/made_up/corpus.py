"""The bad values of tests/robustness/bad_input.toml, each with the sentence it ends in."""

import tomllib
from functools import cache, partial
from pathlib import Path

from told import refused

from dolfbuoy import load_scene
from dolfbuoy.model.feasible import check_feasible
from dolfbuoy.scene import merged, shipped_scenes
from dolfbuoy.statics.first_shape import check_first_shape

CORPUS = tomllib.loads((Path(__file__).parents[2] / "robustness" / "bad_input.toml").read_text())


@cache
def keys_of(name):
    """A shipped scene as its keys."""
    return tomllib.loads(shipped_scenes()[name].read_text())


def judge(name, changes):
    """All that is looked at before anything is built."""
    found = load_scene(merged(keys_of(name), **changes))
    check_feasible(found)
    check_first_shape(found)


for name in sorted(CORPUS.keys() & shipped_scenes().keys()):
    for key, cases in CORPUS[name].items():
        refused(*(partial(judge, name, {key: value}) for value, *_ in cases))
refused(*(partial(judge, case["like"], case["set"]) for case in CORPUS["together"]))
