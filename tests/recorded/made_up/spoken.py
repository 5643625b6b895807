"""Sentences about what rarely happens: failed steps, an interrupted run, settings that do not keep a promise."""

import json
from contextlib import chdir, redirect_stderr, redirect_stdout, suppress
from functools import partial
from io import StringIO
from itertools import chain, product, repeat
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import typer
import xarray as xr
from fingerprint import of_figure
from made_up import SCENE as MADE_UP
from told import MOORED, refused

from dolfbuoy import InputError, SolveError, load_scene
from dolfbuoy.accuracy.bars import NONE, Bar
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.commands import run as run_command
from dolfbuoy.commands import shared as cli
from dolfbuoy.commands import sweep as sweep_command
from dolfbuoy.page import folder as page_folder
from dolfbuoy.results import folder as result_folder
from dolfbuoy.results import running
from dolfbuoy.scene.settings import Space, Stepping
from dolfbuoy.statics import first_shape, rods
from dolfbuoy.studies import hard_cases
from dolfbuoy.studies import sweep as sweep_study
from dolfbuoy.studies.accuracy import advise, cheapest, convergence, pilot
from dolfbuoy.studies.physics import effects, energy

COSTS = ("unknowns", "operations", "forms")
CHOICE = cheapest.Choice(Space(1, 0, 8), Stepping("bdf2", 0.1), 0.5, 3.0)


def spoken(call, *arguments):
    """What a call prints, on either stream, and how it ends."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(out), suppress(typer.Exit):
        try:
            call(*arguments)
        except (InputError, SolveError) as error:
            print(f"{type(error).__name__}: {error}")
        except typer.Exit as stop:
            print(f"exit {stop.exit_code}")
    for line in out.getvalue().splitlines():
        print(f"  {line.rstrip()}")


def of_sweeps():
    """The end of a sweep, and how far it is."""
    cut = {"none": [0.0, 0.0, 0.04], "one": [0.0, 0.3, 0.04], "two": [0.06, 0.3, 0.1234]}
    for name, share in cut.items():
        print(name)
        with patch.object(sweep_command, "_show", lambda *_: None):
            for status in (["done", "failed", "done"], ["failed"] * 3):
                data = {"cut_steps": ("case", share), "status": ("case", status)}
                spoken(sweep_command._end, xr.Dataset(data), Path("s"))
    spoken(sweep_command._end, None, Path("s"))
    found = {"cases": 9, "done": 4, "failed": 2, "missing": 3, "begun": 5, "seconds": 1234.5, "foreign": 7}
    found |= {"damaged": ["a.jsonl is damaged."], "reasons": {"steps failed": 1, "it sank": 3}}
    nothing = dict.fromkeys(found, 0) | {"damaged": [], "reasons": {}}
    for numbers, part in ((found, None), (found, "part 1/2"), (nothing, None)):
        spoken(sweep_command._show_status, numbers, Path("s"), part)
    Path("s/cases/a").mkdir(parents=True)
    print(sweep_command._what_is_left(Path("s")))
    Path("s/cases/a/b.jsonl").write_text("")
    print(sweep_command._what_is_left(Path("s")))
    refused(lambda: sweep_study.collected(None, Path("none")))


def of_runs():
    """What is left of a run, what a page shows, cables that would have broken."""
    for resumable in (False, True):
        with patch.object(result_folder, "can_resume", lambda *_, can=resumable: can):
            print(run_command._left(MADE_UP, Path("a folder")))
    shown = page_folder.Shown("<p>a & b</p>", 500)
    print(shown._repr_html_(), repr(shown))
    entry = {"run": {"files": ["results.nc"], "scene": result_folder.digest(MADE_UP), "finished": False}}
    Path("begun").mkdir()
    Path("begun/results.nc").write_text("")
    Path("begun", result_folder.MANIFEST).write_text(json.dumps(entry))
    with patch.object(result_folder, "can_resume", lambda *_: True):
        refused(partial(result_folder.holds, "begun", "run", MADE_UP))
    for values in ([0.4, 0.99], [0.4, 1.0], [1.234, 0.5], [1.5, 2.0]):
        with patch.object(running, "_largest", lambda _, x=values: [("", x[0]), ("segment 1", x[1])]):
            print(running.rows_of(None), running.warnings_of(None, True), running.warnings_of(None, False))


def of_shapes():
    """Lines of several segments along given points; springs that are too weak."""
    points = {"kind": "polyline", "points": [[0.0, 0.0, -20.0], [6.0, 0.0, -12.0], [6.0, 3.0, -4.0]]}
    parts = [{"length": 8.0, "elements": 2}, {"length": 12.0, "elements": 3}]
    line = MOORED["cable"] | {"segments": parts, "length": None, "elements": None}
    line |= {"top": {"kind": "fixed", "position": [6.0, 3.0, -4.0]}}
    scene = load_scene({"sea": {"depth": 20.0}, "cable": line, "initial": points, "time": MOORED["time"]})
    for piece, shape in zip(scene.network.pieces, first_shape.given_shapes(scene, {}), strict=True):
        print(piece.section.length, shape(np.linspace(0.0, piece.section.length, 3)).round(6).tolist())
    bent = {"bending_stiffness": 1e3, "position_degree": 2, "tension_degree": 1}
    held = {"direction": [0, 0, 1], "rotational_stiffness": 500.0}
    stiff = MOORED["cable"] | bent | {"top": {"kind": "fixed", "position": [6.0, 3.0, -4.0]}}
    network = load_scene({"sea": {"depth": 20.0}, "cable": stiff | {"from_end": held, "to_end": held}}).network
    for low, high in ((400.0, 600.0), (501.0, 499.0), (500.0, 500.0)):
        shape = rods.Bent(*(None,) * (len(rods.Bent.__dataclass_fields__)))
        shape.__dict__["moments"] = np.array([[low, 0.0, 0.0], [9e9, 0, 0], [0.0, high, 0.0]])
        print(rods.weak_springs(network, [shape]))


def of_studies():
    """Energies that do not move, advice that is not kept, pilots that fail."""
    for moving, drag in ((1.0, 0.0), (0.0, 0.0), (0.0, 2.0)):
        powers = {"drag": -drag, "kinetic": moving, "elastic": 3.0, "gravity": 4.0}
        with patch.object(energy, "Meter", lambda _, x=powers: SimpleNamespace(read=lambda: dict(x))):
            spoken(lambda: print(energy.balance(SimpleNamespace(t=1.0), [0], "still")))
    with patch.object(hard_cases, "TESTS", Path("nowhere")):
        refused(hard_cases.cases)
    item = SimpleNamespace(name="test_much_wind", iter_markers=lambda _: [], function=of_studies, nodeid="a")
    item.path = Path("test_hard_x")
    with patch.object(hard_cases, "_pytest", lambda *_: ([item], [])):
        refused(partial(hard_cases.cases, "calm"))
        print({key: value for key, value in hard_cases.cases("much")[0].items() if key != "tests"})
    crash = SimpleNamespace(reprcrash=SimpleNamespace(message="it fell"))
    report = SimpleNamespace(failed=True, longrepr=crash, user_properties=[])
    good = SimpleNamespace(failed=False, user_properties=[("happened", "it floats"), ("other", "x")])
    for reports in ([good], [report], [good, report], []):
        with patch.object(hard_cases, "_pytest", lambda *_, x=reports: ([], x)):
            print(hard_cases.evaluate({"test": "a"}))
    space, stepping = SimpleNamespace(), SimpleNamespace()
    said = []
    made = SimpleNamespace(runs={}, scene=MADE_UP, quantity="tension_top", say=said.append, accuracy=0.01, start=0.0)
    with patch.object(pilot.acc, "compute", side_effect=SolveError("steps failed.")), patch.object(pilot, "settings"):
        print(pilot.Pilot.run(made, "P1-P0, ", "0.1 s"), pilot.Pilot.run(made, "P1-P0, ", "0.1 s"), said)
    still = SimpleNamespace(range_of=lambda _: 0.0)
    with patch.object(pilot, "Reference", lambda *_: still):
        refused(lambda: pilot.Pilot.difference(made, space, stepping))
    for changes in ([0.04, 0.002], [0.04, 0.02, 0.001], [0.04, 0.03, 0.029, 0.0001], [None, 0.04, None]):
        runs, left = iter((0.0, *changes)), iter([x for x in changes if x is not None] + [0.01] * 9)
        made.run, made.difference = (lambda *_, runs=runs: next(runs)), (lambda *_, left=left: next(left))
        chosen = [(k, k) for k in range(1 + len(changes))]
        spoken(lambda chosen=chosen: print(pilot.Pilot.refine(made, chosen, "in time", 2.0)))
    for errors in ([0.001], [0.02, 0.003], [0.02, 0.02, 0.02], [None]):
        runs = chain(errors, repeat(errors[-1]))
        choices = [SimpleNamespace(space=k, stepping=k, error=0.004) for k in range(3)]
        trial = SimpleNamespace(best="P2-P1", finest=0.01, own_time=1e-3, own_space=1e-4, accuracy=0.01)
        trial.quantity = "tension_top"
        trial.run = lambda space, _, runs=runs: "truth" if space == "P2-P1" else next(runs)
        trial.candidates, trial.scene, trial.whole, trial.start = (
            (lambda _, found=choices: found),
            MADE_UP,
            MADE_UP,
            0.0,
        )
        trial.difference, trial.say = (lambda run, _: run), said.append
        with (
            patch.object(advise, "Stepping", lambda *_: " by 0.01 s"),
            patch("dolfbuoy.studies.accuracy.linear_answer.linear_answer", lambda *_: ""),
            patch.object(advise.settings, "with_settings", lambda *_: "settled"),
        ):
            spoken(lambda trial=trial: print(advise.verified(trial, 3).notes))


def of_choices():
    """Settings that do not keep what the pilot expected of them, and those that do."""
    output, bars = Output("tension_top", "max", "cable"), {}
    for number, value in zip(("max", "min", "mean"), (9e3, 4e3, 6e3), strict=True):
        bars[output._replace(number=number)] = Bar(value, 0.004 * value, NONE)
    asked, scene = [], load_scene(MADE_UP, **{"time.end": 2.0})

    class Pilot:
        """A pilot with one choice."""

        rows, scene, measure = (), load_scene(MADE_UP, **{"time.end": 1.0}), staticmethod(lambda: None)

        def __init__(self, *_):
            """It takes no time."""

        def candidates(self, worse, others):
            """The choice, whatever was worse."""
            asked.append(([round(x, 4) for x in worse.values()], round(others, 4)))
            return [CHOICE][: 9 - len(asked)]

    def tried(*outcomes):
        left = iter(outcomes)
        with (
            patch.object(cheapest, "Pilot", Pilot),
            patch.object(cheapest, "with_settings", lambda scene, *_: scene),
            patch.object(cheapest, "_verified", lambda _: next(left)),
            patch.object(cheapest, "_by_a_finer_run", lambda found: found.finer),
        ):
            asked.clear()
            spoken(lambda: print(cheapest.cheapest(scene, ["tension_top.max"], 0.01).notes))
        print(*asked)

    def found(worst, finer=np.inf):
        sentences = ["It is rough."]
        return SimpleNamespace(output=output, bars=bars, worst=worst, finer=finer, sentences=sentences)

    tried(found(0.6, 0.8))
    tried(SolveError("steps failed."), found(np.inf), found(0.8), found(1.3), found(0.6, 1.2), found(0.69, 0.9))
    tried(*[found(4.0)] * 9)


def of_effects():
    """Needs of a scene, what it pays in vain, and what both together change."""
    names = ["tension_top", "cone_angle"]
    size = {"time_ratio": 0.8, "step_time": 0.00123, "base_step_time": 0.00254}
    size |= {f"{side}{key}": number for side in ("", "base_") for key, number in zip(COSTS, (60, 900, 4), strict=True)}
    rows = []
    for mode, effect, top, cone, peak, reason in (
        ("without", "waves", 0.4, 0.2, 0.5, ""),
        ("without", "current", 0.0099, 0.0101, 0.02, ""),
        ("without", "wind", 0.001, 0.01, 0.03, ""),
        ("without", "cable drag", 0.0, 0.002, 0.001, ""),
        ("without", "tension only", None, None, None, "it falls."),
        ("alone", "waves", 0.3, 0.1, 0.4, ""),
    ):
        changes = {"change_tension_top": top, "change_cone_angle": cone, "max_change_tension_top": peak}
        changes |= {"max_change_cone_angle": peak}
        rows.append(size | changes | {"mode": mode, "effect": effect, "reason": reason})
    for both in (None, {"change": 0.005}, {"change": 0.05}, {"reason": "it sinks."}):
        change = (both or {}).get("change")
        together = rows[0] | {"mode": "together", "effect": "all of these", "reason": (both or {}).get("reason", "")}
        together |= {f"{kind}change_{name}": change for name in names for kind in ("", "max_")}
        print(*effects.notes([*rows, together] if both else rows, names, 0.01), sep="\n")
    for table in effects.questions([*rows, together], names):
        print(table.title.strip(), table.columns, *table.rows, *table.notes, sep="\n")
    print(*of_figure(effects.draw(rows, names, 0.01)), sep="\n")
    print([effects._share(change) for change in (0.0, 9.9e-5, 1e-4, 0.01234, 1.0, 99.9, 100.0)])


def of_orders():
    """Verdicts on the orders of made-up errors."""
    for strains, lag, tension, rounding in (
        (("element-average", "exact"), 0.0, 1.0, False),
        (("element-average",), 0.05, 1.0, True),
        (("exact",), 0.2, 0.0, False),
    ):
        rows = []
        for strain, mu, cells in product(strains, (1, 2), (2, 4)):
            row = {
                "mu": mu,
                "nu": mu - 1,
                "cells": cells,
                "strain": strain,
                "end": "Neumann",
                "smallest_tension": tension,
            }
            for k, name in enumerate(convergence.ERRORS):
                row |= {name: 0.1 / cells ** (mu + k), f"theory_{name}": mu + k, f"rounding_{name}": rounding}
                row |= {f"order_{name}": None if cells == 2 else mu + k - lag}
            rows.append(row | {"material": "elastic", "figure": 3})
        for kept in (rows, [row for row in rows if row["mu"] == 2]):
            print(*convergence.in_words(kept), sep="\n")
        print([convergence.texts(row) for row in rows[:2]])


with TemporaryDirectory() as place, chdir(place):
    cli.out.width = cli.err.width = 300
    of_sweeps()
    of_runs()
    of_shapes()
    of_studies()
    of_choices()
    of_effects()
    of_orders()
