"""Sizes of steps that controls choose after made-up errors and failures; devices against their stops."""

import numpy as np
from told import ROPE

from dolfbuoy import SolveError, load_scene
from dolfbuoy.motion.stepping import AdaptiveControl, JumpControl, StepControl
from dolfbuoy.statics import adrift


def stepped(name, control, errors, remaining=10.0):
    """Steps on the way to a milestone; errors: of each, None where it fails."""
    rows = []
    for error in errors:
        step = control.propose(remaining)
        try:
            counts = control.judge(step, error) if error != "fails" else control.fail(step, "it diverged")
        except SolveError as reason:
            rows.append(f"{step:.5g} {reason}")
            break
        remaining -= step if counts else 0.0
        rows.append(f"{step:.5g}{'' if counts else '!'}{' anew' * control.restart}")
        control.restart = False
        if remaining < 1e-12:
            break
    print(name, ", ".join(rows), control.accepted, control.rejected, control.failed, control.restarts)


FAILS = ["fails"]
stepped("equal", StepControl(0.3), [None] * 5, 1.0)
stepped("halved", StepControl(0.25), [None, *FAILS * 2, *[None] * 9], 1.5)
stepped("lost", StepControl(0.25), FAILS * 20)
stepped("least", StepControl(0.25, smallest=0.0625), FAILS * 20)
CHANGES = [0.1, 0.1, 0.3, 0.12, 0.19, 0.05, 0.05, 0.05, 0.201, 0.2, 0.1, 0.099, 0.05]
stepped("jump", JumpControl(0.25), [(change, 1.0) for change in CHANGES])
stepped("far jump", JumpControl(0.25), [(9.0, 1.0)] * 9)
stepped("growing jump", JumpControl(0.25), [(size / 4, size) for size in (1.0, 2.0, 1.0, 0.5, 0.25)])
LOCAL = [None, None, 0.5, 0.5, 0.01, 0.01, 0.01, 0.01, 0.3, 0.6, 0.7, 0.9, 1.1, 0.8, 1.5, 0.1, 0.1, 0.1, 0.1]
stepped("local", AdaptiveControl(0.01, 2, 1e-4, 0.5), LOCAL)
stepped(
    "kink", AdaptiveControl(0.1, 2, 1e-4, 0.5), [0.5, 8.0, 7.0, 9.0, *[5.0] * 5, 0.4, *FAILS, 0.4, 1e-9, 1e-9, 1e-9]
)
stepped("noise", AdaptiveControl(0.1, 1, 0.09, 0.5), [0.5, 3.0, 2.0, 2.0])
stepped("end", AdaptiveControl(0.1, 1, 1e-3, 0.2), [0.7] * 9, 0.35)
take_off = {"from": "Y", "to": [0.0, 0.0, -9.0], "stiffness": 100.0, "length": 1.0, "pretension": 30.0, "damping": 1.0}
take_off |= {"longest": 3.0, "shortest": 0.5, "stop_stiffness": 1e4}
scene = load_scene(
    {"cable": ROPE | {"from": [0.0, 0.0, -20.0], "to": "Y"}, "joint": [{"name": "Y"}], "take_off": take_off}
    | {"time": {"end": 1.0, "step": 0.1}}
)
print([scene.take_offs[0].at_rest(length) for length in np.array([0.1, 0.5, 1.0, 2.0, 3.0, 3.5])])
HULL = {"hull": [[0.0, 1.0], [2.0, 1.4]], "mass": 300.0, "center_of_mass": 0.5}
WIDE = {"hull": [[0.0, 3.0], [1.0, 3.0]], "mass": 900.0, "center_of_mass": 0.2}
DEVICE = {"stiffness": 1e3, "length": 5.0}
afloat = {"sea": {"depth": 20.0}, "time": {"end": 1.0, "step": 0.1}}
afloat |= {"buoy": [HULL | {"name": "a"}, WIDE | {"name": "b"}, HULL | {"name": "c"}]}
for take_offs in (
    [DEVICE | {"from": "a", "to": "b"}, DEVICE | {"from": "b", "to": "c", "length": 0.0}],
    [DEVICE | {"from": "c", "to": "b"}, DEVICE | {"from": [0.0, 0.0, -20.0], "to": "a"}],
    [
        {"from": "c", "to": "b", "damping": 9.0},
        DEVICE | {"from": "a", "to": [0.0, 0.0, -20.0]},
        DEVICE | {"from": "a", "to": "c"},
    ],
):
    named = [device | {"name": f"d{k}"} for k, device in enumerate(take_offs)]
    scene = load_scene(afloat | {"take_off": named})
    held = sorted(adrift.held_by_take_offs(scene.network), key=str)
    places = adrift.places_adrift(scene, lambda section: section.length or 0.0)
    print(held, {name: [round(float(x), 6) for x in place] for name, place in places.items()})
for change in ({}, {"gravity": 0.0}, {"sea": None}):
    print(round(adrift.floating_height(scene.model_copy(update=change), scene.network.buoys["b"]), 9))
