"""Numbers of scenes that something varies, expressions of them and their slopes; accelerations of a turning buoy."""

import importlib
from types import SimpleNamespace

import numpy as np
import xarray as xr
from told import refused, show

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.sensitivity.accelerations import accelerations, arms_of
from dolfbuoy.sensitivity.expressions import Dual, Expression
from dolfbuoy.sensitivity.parameters import parameters_of
from dolfbuoy.statics.offsets import loaded

design = importlib.import_module("dolfbuoy.sensitivity.design")  # a function hides it


def of_scenes():
    """Every number of the shipped scenes by which anything has a derivative, and the scene beside it."""
    for name in ("short", "three-legs", "lazy-wave", "wave-rider", "navigation-buoy"):
        scene = load_scene(name)
        for p in parameters_of(scene):
            print(name, p.key, p.unit, f"{p.value:.8g} {p.scale:.8g} {p.distance:.8g}")
            beside = parameters_of(p.scene_at(scene, 0.25), [p.key])[0]
            print("beside", f"{beside.value:.8g} {beside.scale:.8g}")
    three = load_scene("three-legs")
    wanted = ("cable.east.length", "buoy.inertia.0", "material.rope.diameter", "buoy.hull.1.1", "current.speed")
    for p in parameters_of(three, wanted):
        print(p.key, p.unit, p.value, p.scale)
    wrong = ["buoy.hull", "buoy.hull.9.9", "buoy.fairleads.north.1", "cable.east.elements", "time.step"]
    wrong += ["buoy.name", "nothing", "title", "cable"]
    refused(*(lambda name=name: parameters_of(three, [name]) for name in wrong))
    chained = {"length": 50.0, "material": "chain R3 studless 40 mm", "elements": 10}
    scene = load_scene({"sea": {"depth": 20.0}, "cable": chained | {"top": {"kind": "fixed", "position": [40, 0, -2]}}})
    for p in parameters_of(scene):
        print(p.key, p.unit, f"{p.value:.8g} {p.scale:.8g}")
    (p,) = parameters_of(scene, ["material.chain-R3-studless-40-mm.size"])
    print(p, [p.made(size, places) for size in (39.0, 40.0, 41.0, 999.0) for places in (-1, 1, 2)])
    print(p.scene_at(scene, 0.1).material)


def of_expressions():
    """Values and slopes, and what is no expression."""
    known = {"a": Dual(3.0, np.array([1.0, 0.0])), "b.c[d e]": Dual(-2.0, np.array([0.5, 2.0]))}
    good = ["a + b.c[d e]", "a - b.c[d e] * 2", "-(a / b.c[d e]) ** 2", "a ** -1.5 + .5e1"]
    good += ["2 - 3 - a", "12 / 3 / a", "-a", "7"]
    for text in good:
        found = Expression(text, "--least").at(known.__getitem__, 2)
        print(text, Expression(text, "").names, f"{found.value:.10g}", *(f"{x:.10g}" for x in found.slope))
    bad = ["a +", "(a", "a)", "a ** b", "a $ 2 and much more of it", "* a", "1" * 1001, "(" * 31 + "a" + ")" * 31]
    bad += ["1e999", "", "a b", "2 ** -a"]
    refused(*(lambda text=text: Expression(text, "--least") for text in bad))
    never = ["a / 0", "b.c[d e] ** .5", "(a - 3) ** -1", "9 ** 999 ** 9", "a ** 9999"]
    for text in never:
        try:
            print(text, Expression(text, "--hold").at(known.__getitem__, 2))
        except InputError as error:
            print(f"refused: {error}")


def of_accelerations():
    """Of a point of two buoys that move and turn."""
    t = np.array([0.0, 0.1, 0.2, 0.35, 0.5, 0.6])
    numbers, turn = np.random.default_rng(2), np.outer(t, [0.3, 0.5])
    x = np.stack([np.outer(t**2, [1.0, 0.5, 0.1]), np.outer(np.sin(t), [0.0, 1.0, 2.0])], axis=1)
    half = [np.cos(turn / 2), 0.6 * np.sin(turn / 2), 0.0 * turn, 0.8 * np.sin(turn / 2)]
    axes = ("time", "buoy", "xyz"), ("time", "buoy", "quaternion")
    by = [("parameter", *names) for names in axes]
    found = {"buoy_position": (axes[0], x), "buoy_orientation": (axes[1], np.stack(half, axis=-1))}
    found |= {"d_buoy_position": (by[0], numbers.normal(size=(2, 6, 2, 3)))}
    found |= {"d_buoy_orientation": (by[1], numbers.normal(size=(2, 6, 2, 4)))}
    record = xr.Dataset(found, {"time": t, "buoy": ["one", "two"]})
    arms = {"one": np.array([0.2, -0.1, 1.5]), "two": np.array([0.0, 0.3, -0.4])}
    slopes = {name: numbers.normal(size=(2, 3)) for name in arms}
    for label, values, rates in accelerations(record, arms, slopes):
        show({label: values, f"{label} slopes": rates})
    for label, values, rates in accelerations(record, {"two": arms["two"]}):
        show({label: values, f"{label} slopes": rates})
    show(arms_of(load_scene("two-buoys"), (0.1, 0.2, 2.0)))


def of_loads():
    """Scenes whose loads are varied."""
    for name in ("short", "two-buoys", "three-legs", "storm"):
        scene = load_scene(name)
        for load, size in (("force", 500.0), ("current", 1.2)):
            varied = loaded(scene, load, size, 30.0)
            print(name, load, varied.current, [buoy.external_force for buoy in varied.network.buoys.values()])
    rows = load_scene("short", current=None)
    print("none", loaded(rows, "current", 0.7, 45.0).current)
    rows = load_scene("short", **{"current.speed": None, "current.profile": [[-20.0, 0.2], [0.0, 0.8]]})
    print("rows", loaded(rows, "current", 1.6, 45.0).current)
    still = load_scene("short", **{"current.speed": None, "current.profile": [[-20.0, 0.2], [0.0, 0.0]]})
    refused(lambda: loaded(still, "current", 1.6, 45.0))


def of_designs():
    """Soft maxima of series and their slopes; sizes that are made beside those that were found."""
    t = np.arange(0.0, 6.0, 0.5)
    values = np.array([3.0 + np.sin(t), 2.0 + np.cos(2 * t)]).T
    found = {"tension_top": (("time", "cable"), values), "tension_anchor": (("time", "cable"), values - 9.0)}
    found |= {"d_tension_top": (("parameter", "time", "cable"), np.stack([values**2, np.cos(values)]))}
    found |= {"d_tension_anchor": found["d_tension_top"]}
    record = xr.Dataset(found, {"time": t, "cable": ["one", "two"], "parameter": ["a", "b"]})
    for name in ("tension_top.soft_max", "tension_top.soft_max[two]"):
        soft = design._soft(record, name, 1.0)
        show({f"{name} {soft.value:.9g}": soft.slope})
    refused(
        lambda: design._soft(record, "tension_anchor.soft_max", 1.0), lambda: design._soft(record, "none.soft_max", 1.0)
    )
    chained = {"length": 50.0, "material": "chain R3 studless 40 mm", "elements": 10}
    scene = load_scene({"sea": {"depth": 20.0}, "cable": chained | {"top": {"kind": "fixed", "position": [40, 0, -2]}}})
    sizes = parameters_of(scene, ["material.chain-R3-studless-40-mm.size"])
    at = lambda x: (Dual(-x[0], np.array([-1.0])), [])  # noqa: E731
    for most in (44.5, 41.5, 39.0, 35.5):
        search = SimpleNamespace(parameters=sizes, at=at, room=lambda x, most=most: np.array([most - x[0]]))
        low, high = np.array([36.0]), np.array([60.0])
        print(most, *design._in_sizes_made(search, np.array([40.7]), "as found", low, high))


of_scenes()
of_expressions()
of_accelerations()
of_loads()
of_designs()
