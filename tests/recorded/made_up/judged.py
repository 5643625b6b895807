"""Judgements of made-up records; files, stores and cases; gusts, tides, and a linear answer from coefficients."""

import itertools
import sys
from contextlib import redirect_stderr
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import xarray as xr
from told import MOORED, refused, show

from dolfbuoy import load_scene
from dolfbuoy.linear import potential_flow
from dolfbuoy.model import varying
from dolfbuoy.parallel import cases
from dolfbuoy.parallel.cases import _Progress, duration, evaluate_all, rows_of, store_in
from dolfbuoy.parallel.store import Store, Writer
from dolfbuoy.results import cautions, extremes
from dolfbuoy.sensitivity.calibration import _of_csv

REFERENCE = Path(__file__).parents[2] / "reference"
SCENE = load_scene(MOORED)


def of_extremes():
    draws = np.random.default_rng(4)
    for runs in (10, 25):
        found = extremes.fit_gumbel(draws.gumbel(7.0, 1.5, runs))
        print(found, f"{found.mean:.6g} {found.standard_deviation:.6g} {found.most_probable(18.0):.6g}")
        low, high = found.interval(18.0)
        print(f"{low:.4g} {high:.4g}", found.above([8.0, 15.0], 18.0).round(6))
        print([f"{found.uncertainty(runs, 18.0, base):.6g}" for base in (0.0, 2.0)], found.runs_needed(0.05, 18.0))
    refused(lambda: extremes.fit_gumbel(range(9)), lambda: extremes.fit_gumbel([3.0] * 12))


def of_buoys():
    t, under = np.arange(5.0), SCENE.sea.density * np.pi * 1.44 * 1.2
    for largest in (44.0, 60.0, 95.0):
        angle = np.array([1.0, 0.5, 0.91, 1.0, 0.2])[:, None] * largest
        mass = np.array([0.5, 1.0, 0.9, 1.0, 1.0])[:, None] * under
        data = {"cone_angle": (("time", "buoy"), angle), "displaced_mass": (("time", "buoy"), mass)}
        record = xr.Dataset(data, {"time": t, "buoy": ["buoy"]})
        print(cautions.states_of(record, SCENE), cautions.states_of(record.isel(time=3), SCENE))


def of_steps():
    step = SCENE.time.step
    sizes = step * np.array([1.0, 0.5, 0.5, 1.0, 0.25, 0.75, 1.0, 1.0])
    t = np.concatenate([[0.0], np.cumsum(sizes)])
    data = {"time_step": ("time", np.concatenate([[0.0], sizes]))}
    for failed in (0, 1, 2, 9):
        record = xr.Dataset(data, {"time": t}, {"failed_steps": failed})
        print(cautions.cut(record, SCENE), cautions.about_retries(record, SCENE), cautions.refused(record, SCENE))
    halves = {"time_step": ("time", [0, 0.5 * step, 0.5 * step])}
    many = xr.Dataset(halves, {"time": [0, 0.5 * step, step]}, {"failed_steps": 3})
    print(cautions.refused(many, SCENE))
    force = np.array([1.0, 1.1, 1.0, 4.0, 9.0, 3.0, 1.0, 1.2, 1.0])
    print([cautions.steps_of_peak(x) for x in (force, force[:5], np.ones(4), np.maximum(force, 8.5))])
    both = {"anchor_force": (("time", "xyz"), np.outer(force, [600.0, 0.0, 800.0])), "tension_top": ("time", force)}
    print(cautions.short_peaks(xr.Dataset(both, {"time": np.arange(9) * 0.1}), "the anchor", "the top"))


def of_files():
    for name, content in {
        "good.csv": "\ufefftime, a ,b\n0,1,2\n\n0.5,1e1,-2\n",
        "still.csv": "time,a\n0,1\n0,2\n",
        "words.csv": "time,a\n0,one\n1,2\n",
        "short.csv": "time,a\n0,1\n1\n",
        "timeless.csv": "t,a\n0,1\n",
        "empty.csv": "",
    }.items():
        Path(name).write_text(content, encoding="utf-8")
        refused(lambda name=name: [show({k: pair[0], f"{k} x": pair[1]}) for k, pair in _of_csv(Path(name)).items()])
    refused(lambda: _of_csv(Path("missing.csv")))
    Path("store").mkdir()
    writer = Writer(Path("store/a.jsonl"), "one")
    for number, name in enumerate(("x", "y", "x")):
        writer.add(name, {"value": number}, attempt=number)
    writer.close()
    file = next(Path("store").iterdir())
    file.write_bytes(file.read_bytes() + b"torn and\nnothing\nmore")
    for program in ("one", "two"):
        store = Store(Path("store"), program)
        print(sorted(store.entries), store.damaged, store.foreign, store.attempt("x"), store.attempt("z"))
        print(list(store.results(["y", "z", "x"])), list(store.results()))
    writer = Writer(file, "two")
    writer.add("y", {"value": 7})
    writer.close()
    print(len(file.read_bytes().splitlines()), Store(Path("store"), "two").result("y"))


def of_cases():
    calls = []
    cases = [{"a": a} for a in (3, 1, 3, 2)]
    for _ in range(2):
        rows = evaluate_all(lambda case: calls.append(case["a"]) or {"b": case["a"] ** 2}, cases, Path("cases of it"))
        print(rows, calls)
    print(rows_of([{"a": 2}, {"a": 9}], Path("cases of it")), len(store_in(Path("cases of it")).entries))
    print([duration(x) for x in (0.3, 1.4, 89.0, 91.0, 5000.0, 5500.0, 1e5, 2e5, 1e7)])
    progress = _Progress({0: 1.0, 1: 3.0, 2: 4.0}, ranks=2)
    print([progress._left(i, 10.0) for i in (0, 1, 2)], _Progress({0: 2.0})._left(0, 5.0))


class Looked:
    """A future that is done when it has been looked at as often as its number says."""

    def __init__(self, evaluate, case):
        self.evaluate, self.case, self.looks = evaluate, case, iter([False] * case["a"])

    def done(self):
        return next(self.looks, True)

    def result(self):
        return self.evaluate(self.case)

    def cancel(self):
        print("cancelled", self.case)


def of_workers():
    """What an executor evaluates, and what is said of the time: two clocks of made-up ticks."""

    def squared(case):
        if case["a"] == 2:
            raise ValueError("two")
        return {"b": case["a"] ** 2}

    cases_of = [{"a": a} for a in (3, 1, 2, 4, 1)]
    for number, pace in enumerate((5.0, 40.0)):
        clock = SimpleNamespace(monotonic=partial(next, itertools.count(0.0, pace)), sleep=lambda s: print("slept", s))
        more = {
            "executor": SimpleNamespace(submit=Looked, num_workers=3),
            "failed": lambda error: {"failed": str(error)},
            "work": lambda case, pace=pace: pace * case["a"],
        }
        with patch.object(cases, "clock", clock), redirect_stderr(sys.stdout):
            cases.compute(squared, cases_of, Path(f"workers {number}"), **more)
            cases.compute(
                squared, cases_of[:2] + [{"a": 7}, {"a": 8}], Path(f"workers {number}"), work=lambda case: 1.0
            )
        print(rows_of([{"a": 3}, {"a": 2}, {"a": 8}], Path(f"workers {number}")))
    try:
        cases.compute(squared, [{"a": 2}], Path("workers"), executor=SimpleNamespace(submit=Looked))
    except ValueError as error:
        print("raised", error, cases._workers(SimpleNamespace(_max_workers=5)), cases._workers(None))


def of_winds():
    wind = MOORED | {"wind": {"speed_10m": 12.0, "direction_deg": 30.0, "area": 2.0, "height": 3.0}}
    f = np.array([0.001, 0.01, 0.1, 0.5])
    for more in (
        {"gusts": "npd", "seed": 3, "ramp": 2.0},
        {"gusts": "kaimal", "turbulence": 0.2},
        {"over_time": [[0, 1, 0], [9, 0, 90]]},
    ):
        scene = load_scene(wind | {"wind": wind["wind"] | more})
        section = next(iter(scene.network.buoys.values())).wind
        seed = varying.seed_of(scene, section)
        at = varying.wind_over_time(section, seed)
        show({"spectrum": varying.spectrum_of(section)(f), "speed": [at(t)[0] for t in (0.0, 1.0, 4.0, 9.0)]})
        show({"towards": np.array([at(t)[1] for t in (0.0, 4.0, 9.0)]), "seed": [seed]})
        show({"deviation": [varying.Gusts(section, 5).deviation]})
    for rows in (
        [[0, -30, 0.1, 0.0], [0, 0, 0.5, 0.1]],
        [[0, 0, 0.5, 0.1], [0, -30, 0.1, 0.0], [9, -30, 0, 1], [9, 0, 1, 0]],
    ):
        grid = varying.Grid(rows)
        show({"z": grid.z, "grid": np.array([grid(t) for t in (-1.0, 0.0, 3.0, 20.0)])})
    tide = load_scene(MOORED | {"sea": {"depth": 20.0, "tide": [[0, 0.2], [10, 0.5], [40, -0.3]]}})
    show({"tide": [varying.tide_of(tide)(t) for t in (0.0, 5.0, 15.0, 60.0)], "range": varying.range_of_tide(tide)})
    show({"rate": [varying.rate_of_tide(tide.sea.tide)]})


def of_coefficients():
    with xr.open_dataset(REFERENCE / "sphere.nc") as data:
        inside = np.isfinite(data.omega.values) & (data.omega.values > 0)
        data.isel(omega=np.flatnonzero(inside)[::-1]).to_netcdf("finite.nc")
    found = potential_flow.read_capytaine(Path("finite.nc"))
    answer = found.responses((2500.0, 2500.0, 1500.0), (10.0, 3e4, 9e3))
    show({"real": answer.real, "imaginary": answer.imag, "periods": found.periods, "force": abs(found.force)})
    show({"added mass": found.added_mass, "damping": found.damping})
    print(found.rotation_height, found.depth)
    refused(lambda: potential_flow.read_capytaine(Path("missing.nc")))


of_extremes()
of_buoys()
of_steps()
of_files()
of_cases()
of_workers()
of_winds()
of_coefficients()
