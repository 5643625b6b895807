"""`advise --of` and `run --accuracy` on made-up runs: a known motion, plus errors that are powers of sizes."""

import math
import sys
from pathlib import Path
from unittest.mock import patch

import numpy as np
import xarray as xr

from dolfbuoy.accuracy import companion, target
from dolfbuoy.accuracy.bars import bars_of
from dolfbuoy.commands import main as cli
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.results.quantities import ERROR, QUANTITIES
from dolfbuoy.scene import load_scene, settings
from dolfbuoy.studies.accuracy import cheapest

ORDERS = {"backward-euler": (1, 0.08), "bdf2": (2, 0.3), "generalized-alpha": (2, 0.2)}
#: What makes runs fail, and errors larger in whole runs than in their beginnings.
TROUBLE = {"fail": lambda space, stepping: False, "worse": 1.0, "lost": lambda space, stepping: False}


def run(scene, last=True, most=math.inf):
    """A run of a scene with a cable, as `one_case.run`."""
    space, stepping = settings.space_of(scene), settings.stepping_of(scene)
    if TROUBLE["fail"](space, stepping):
        raise SolveError("Made up to fail.")
    order, constant = ORDERS[stepping.scheme]
    period = settings.period_of(scene)
    t = np.append(np.arange(0, scene.time.end - 0.5 * stepping.step, stepping.step), scene.time.end)
    phase = 2 * math.pi * t / period
    off = constant * (stepping.step * 6 / period) ** order + 0.5 * (space.mu * space.cells) ** -(space.mu + 0.5)
    off *= TROUBLE["worse"] if scene.time.end > 24 else 1.0
    if TROUBLE["lost"](space, stepping):
        phase = phase + 1
    beats = 1 + 0.2 * np.sin(0.37 * phase) + 0.3 * np.exp(-(((t - 0.8 * scene.time.end) / period) ** 2))
    top = 7e3 + 2e3 * beats * np.cos(phase) + 2e3 * off * np.cos(phase + 0.7)
    anchor = 4e3 + 1e3 * beats * np.cos(phase + 0.4) + 3e3 * off * np.cos(phase + 0.1)
    force = anchor[:, None] * np.array([0.6, 0.0, -0.8])
    series = {"tension_top": top, "tension_anchor": anchor, "anchor_force": force}
    shape = {name: (len(t), 1, -1) if name == "anchor_force" else (len(t), 1) for name in series}
    data = {name: (("time", *QUANTITIES[name].dims), x.reshape(shape[name])) for name, x in series.items()}
    data["newton_iterations"] = "time", np.full(len(t), 3)
    speed = {"backward-euler": 0.7, "bdf2": 0.9}.get(stepping.scheme, 1.0)
    seconds = len(t) * (5 * space.mu**2 * space.cells + 30) * 1e-5 * speed
    coordinates = {"time": t, "cable": ["cable"], "xyz": ["x", "y", "z"]}
    return xr.Dataset(data, coordinates, {"loop_seconds": seconds, "failed_steps": 0, "end": scene.time.end})


def advised(accuracy, of=("tension_top.max", "anchor.max"), scene=None, **trouble):
    """What is said and found, under these troubles."""
    with patch.dict(TROUBLE, trouble), patch.object(cheapest, "run", run):
        scene = scene or load_scene("driven", time__end=25.0)
        try:
            found = cheapest.cheapest(scene, list(of), accuracy)
        except (SolveError, InputError) as error:
            print(type(error).__name__, error)
            return None
    for choice in found.candidates:
        print(choice, f"{choice.share:.5g} {choice.seconds:.5g}")
    for row in found.rows:
        print("pilot", " ".join(f"{x:.5g}" if isinstance(x, float) else str(x) for x in row.values()))
    print(f"worst {found.found.worst:.5g} {found.found.output}")
    return found


def told():
    """Advice for a driven cable, of which runs fail, are worse than predicted, or go another way."""
    cheapest.report(advised(0.01), Path("advice"))
    cheapest.report(advised(0.002, worse=3.0), Path("worse"))
    advised(0.01, of=["tension_top.min"], scene=load_scene("driven", time__end=80.0), worse=0.5)
    advised(0.01, lost=lambda space, stepping: stepping.scheme != "bdf2" and stepping.step < 0.06)
    advised(0.01, fail=lambda space, stepping: stepping.scheme == "bdf2" and stepping.step > 0.1)
    advised(0.001, scene=load_scene("driven", time__end=25.0, cable__slack="tension-only"))
    advised(0.01, lost=lambda space, stepping: (1000 * stepping.step) % 7 > 3)
    advised(0.01, of=["tension_top.lasting"])
    for accuracy, rounds, worse in ((0.01, 6, 1.0), (0.003, 6, 1.0), (0.001, 3, 1.0), (0.01, 6, 30.0)):
        scene = load_scene("driven", time__end=25.0, accuracy={"target": accuracy, "rounds": rounds})
        with patch.dict(TROUBLE, worse=worse):
            found = target.reach(scene, run)
        print(settings.space_of(found.scene), settings.stepping_of(found.scene), f"{found.worst:.5g} {found.output}")
        print(target.sentence_of(found), *found.sentences)
    always = lambda space, stepping: True  # noqa: E731
    for trouble in ({"fail": always}, {"lost": lambda space, stepping: space.cells % 3 == 1}):
        with patch.dict(TROUBLE, trouble):
            try:
                print(target.sentence_of(target.reach(scene, run)))
            except SolveError as error:
                print("SolveError", error)


def around():
    """Companions of runs of a sea: of the beginning, and around its extremes."""
    for name, end in (("storm", 600.0), ("storm", 120.0), ("three-legs", 400.0), ("driven", 100.0), ("short", 40.0)):
        scene = load_scene(name, time__end=end)
        coarse = companion.companion_of(scene)
        print(name, settings.space_of(coarse), settings.stepping_of(coarse), coarse.time.end)
        print(f"{companion.covered(scene):.6g} {companion.followed(scene):.6g}")
    scene = load_scene("storm", time__end=600.0)
    record = run(scene)
    events = companion.events_of(scene, record)
    for event in events:
        print(" ".join(f"{x:.6g}" for x in event))
    coarse = companion.companion_around(scene, events[0])
    print(settings.space_of(coarse), settings.stepping_of(coarse), f"{coarse.time.end:.6g}", coarse.waves.ramp)
    for row in coarse.waves.components[:12]:
        print(" ".join(f"{x:.6g}" for x in row))
    adaptive = load_scene("driven", time__tolerance=1e-3, time__min_step=1e-3, time__max_step=0.2)
    print(companion.companion_of(adaptive).time)


def bars():
    """Bars of a long sea with runs around its extremes, of runs that ring, retry, or leave what corrects them."""
    scene = load_scene("storm", time__end=600.0)
    record, coarse = run(scene), run(companion.companion_of(scene))
    events = {event: run(companion.companion_around(scene, event)) for event in companion.events_of(scene, record)}
    wrong = record.tension_top * (0.002 + 0.001 * np.sin(record.time))
    corrected = record.assign({f"tension_top{ERROR}": wrong})
    gone = record.assign({f"tension_top{ERROR}": wrong.where(record.time < 30)})
    zigzag = record.assign(tension_top=record.tension_top + 60 * (-1.0) ** np.arange(record.sizes["time"])[:, None])
    holes = record.assign(tension_anchor=record.tension_anchor.where(record.time < 400))
    slack = load_scene(scene, cable__slack="tension-only")
    for name, own, of, other, more in (
        ("sea", scene, record, coarse, {"events": events}),
        ("ratio", scene, record, coarse, {"ratio": 3.0}),
        ("corrected", scene, corrected, coarse, {}),
        ("steps", scene, corrected, None, {}),
        ("gone", scene, gone, coarse, {}),
        ("zigzag", scene, zigzag, coarse, {}),
        ("holes", scene, holes, coarse, {}),
        ("retried", scene, record.assign_attrs(failed_steps=3), coarse, {}),
        ("coarse retried", scene, record, coarse.assign_attrs(failed_steps=3), {}),
        ("failed", scene, record, SolveError("Made up."), {}),
        ("slack", slack, record, coarse, {}),
    ):
        found, sentences = bars_of(of, own, other, **more)
        print(f"bars {name}:", *sentences)
        for output, bar in found.items():
            if output.series != "anchor" or name == "sea":
                print(" ", output, output.part, *(f"{x:.5g}" if isinstance(x, float) else x for x in bar))


def by_command():
    """The command that advises, and the scene that it writes."""
    words = "dolfbuoy advise driven --set time.end=25 --of tension_top.max --write advised.toml --out commanded"
    with patch.object(cheapest, "run", run), patch.object(sys, "argv", words.split()):
        try:
            cli.main()
        except SystemExit as end:
            print("exit code", end.code or 0)


told()
by_command()
around()
bars()
