"""Questions that a scene, a record or a state has no answer to, each with the sentence it ends in."""

import json
import os
from contextlib import chdir
from functools import partial
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
import xarray as xr
from told import MOORED, SHIP, refused

import dolfbuoy
from dolfbuoy import InputError, SolveError, load_scene, roots
from dolfbuoy.coupling import Session, saved
from dolfbuoy.formats import to_moordyn
from dolfbuoy.scene import settings
from dolfbuoy.sensitivity import calibration, derivatives, parameters
from dolfbuoy.sensitivity.uncertainty import _of, uncertain_of, uncertainty
from dolfbuoy.solver import instructions
from dolfbuoy.statics import catenary

DRIVEN = load_scene("driven", **{"time.end": 2.0})


def failed(*calls):
    """Print the sentences in which calls end that are not of an input."""
    for call in calls:
        try:
            call()
        except (InputError, SolveError, ValueError, RuntimeError) as error:
            print(f"{type(error).__name__}: {error}")
        else:
            print("done")


def of_calibration():
    """Bounds, records and series that give no fit; what is said of a fit that tells little."""
    t = np.linspace(0.0, 2.0, 21)
    kept = xr.Dataset({"tension_top": ("time", 1e3 + t)}, {"time": t})
    kept.isel(time=0, drop=True).to_netcdf("still.nc")
    stiff = {"cable.axial_stiffness": (1e5, 1e9)}
    for name, record, fit, more in (
        ("no time", kept, stiff, {"time": None}),
        ("a point without a buoy", kept, stiff, {"point": [0.0, 0.0, 1.0]}),
        ("offset that falls", kept, stiff, {"offset": (1.0, 0.0)}),
        ("offset without end", kept, stiff, {"offset": (0.0, np.inf)}),
        ("nothing to fit", kept, {}, {}),
        ("bounds that fall", kept, {"cable.length": (30.0, 20.0)}, {}),
        ("a vector", kept, {"cable.anchor": (0.0, 1.0)}, {}),
        ("no record", "none.nc", stiff, {}),
        ("a record without time", "still.nc", stiff, {}),
        ("another series", kept, stiff, {"of": ["tension_anchor"]}),
        ("few values", kept.isel(time=slice(0, 3)), stiff, {}),
    ):
        print(name, end=": ")
        refused(partial(calibration.calibrate, DRIVEN, record, fit, **{"of": ["tension_top"]} | more))


def of_uncertainty():
    """Spreads that are none, methods and counts."""
    for entry in ({"cable.anchor": 1.0}, {"cable.anchor": "1%"}, {"seabed.slope": "lognormal 2%"}):
        print(entry, end=": ")
        refused(lambda entry=entry: uncertain_of(load_scene("navigation-buoy", uncertain=entry)))
    for entry in ({"cable.top.position.1": "lognormal 1"}, {"cable.top.position.1": "1%"}, {"cable.length": "0.1%"}):
        print(entry, end=": ")
        refused(lambda entry=entry: uncertain_of(load_scene(DRIVEN, uncertain=entry)))
    spread = load_scene(DRIVEN, uncertain={"cable.length": "0.1%"})
    refused(
        partial(uncertainty, spread, method="guess"),
        partial(uncertainty, spread, runs=1),
        partial(uncertainty, spread, method="chaos", runs=4),
        partial(uncertainty, spread, method="samples", runs=3),
    )
    good, bad = {"outputs": [["tension_top", "max", "", 1.0]]}, {"failed": "it fell over."}
    for rows in ([good] * 19 + [bad], [good] * 3 + [bad] * 2):
        failed(lambda rows=rows: print(_of(rows, ["tension_top.max"])))
    failed(lambda: _of([good], ["tension_anchor.max"]))


def of_derivatives():
    """What nothing has a derivative by, or of."""
    rigid = load_scene(DRIVEN, **{"cable.axial_stiffness": np.inf})
    refused(
        partial(derivatives.sensitivities, DRIVEN, what="feelings"),
        partial(derivatives.sensitivities, DRIVEN, by=["cable.length"], of=["tension_top.max"], what="static"),
        partial(derivatives.sensitivities, DRIVEN, by=["cable.length"], of=["utilisation.max"]),
        partial(derivatives.sensitivities, DRIVEN, by=[]),
        partial(parameters.parameters_of, DRIVEN, ["cable.top.position.3"]),
        partial(parameters.parameters_of, DRIVEN, ["cable.top.kind"]),
        partial(parameters.parameters_of, DRIVEN, ["title"]),
        partial(parameters.parameters_of, rigid, ["cable.axial_stiffness"]),
    )


def of_sessions():
    """States that are another's, and ends that cannot be driven."""
    ship = load_scene(SHIP)
    with Session(ship, driven=["ship"]) as one, Session(ship) as other:
        packed = one.pack(one.save())
        tree = json.loads(packed)
        refused(
            lambda: other.unpack(packed),
            lambda: one.unpack(b"nothing"),
            lambda: one.unpack(json.dumps({key: tree[key] for key in list(tree)[:-1]}).encode()),
            lambda: one.unpack(packed.replace(b'"<f8"', b'"|O8"')),
            lambda: one.unpack(packed),
            lambda: saved._plain(print),
        )
        for kind in ("<f8", "<i4", "|b1", "|S8", "|O8"):
            failed(lambda kind=kind: print(saved._tree({"array": "AAAAAAAAAAA=", "dtype": kind, "shape": [-1]})))
    body = SHIP["vessel"][0]
    wind = {"speed_10m": 9.0, "area": 1.0, "height": 1.0}
    bent = [SHIP["cable"][0] | {"bending_stiffness": 1e3, "position_degree": 2, "tension_degree": 1}, SHIP["cable"][1]]
    clamped = [bent[0] | {"to_end": {"direction": [0, 0, 1]}}, bent[1]]
    moored = load_scene(MOORED)
    refused(
        partial(Session, ship, driven=["Y"]),
        partial(Session, load_scene(SHIP, vessel=[body | {"wind": wind}]), driven=["ship"]),
        partial(Session, load_scene(SHIP, cable=clamped), driven=["ship"]),
        partial(Session, load_scene(MOORED, **{"initial.buoy_velocity": [1.0, 0.0, 0.0]}), driven=["buoy"]),
        partial(Session, load_scene("free-buoy"), driven=["buoy"]),
        partial(Session, moored, driven=["nobody"]),
    )


def of_linear_answers():
    """Scenes without modes, stiffness or a response."""
    tow = {"cable.top.velocity": [1.0, 0.0, 0.0], "cable.top.amplitude": None, "cable.top.period": None}
    refused(
        partial(dolfbuoy.modes, load_scene("driven", **tow)),
        partial(dolfbuoy.response, load_scene("driven", sea=None)),
        partial(dolfbuoy.periodic, load_scene("driven", time=None)),
        partial(dolfbuoy.periodic, load_scene("short", **{"waves": None})),
        partial(dolfbuoy.periodic, load_scene("storm")),
    )
    failed(
        lambda: print(catenary.between([0, 0, 0], [3, 0, 4], 5.0, 1.0, np.inf)),
        lambda: print(catenary.between([0, 0, 0], [3, 0, 4], 5.001, 0.0, np.inf)),
        lambda: print(roots.brentq(lambda x: x + 3.0, 0.0, 1.0)),
        lambda: print(roots.brentq(lambda x: np.nan, 0.0, 1.0)),
        lambda: print(roots.brentq(lambda x: x**3 - 0.3, 0.0, 1.0, maxiter=2)),
        lambda: print(f"{roots.brentq(lambda x: x**3 - 0.3, 0.0, 1.0, maxiter=12):.6f}"),
    )
    with patch.dict(os.environ, {instructions.VARIABLE: "abacus"}):
        refused(instructions.available)


def of_exports():
    """What a file of MoorDyn does not hold of scenes, and what it holds of them."""
    deep, line = {"sea": {"depth": 20.0}, "time": {"end": 1.0, "step": 0.1}}, {**MOORED["cable"], "diameter": 0.05}
    steep = {"amplitude": 0.3, "period": 5.0}
    for name, scene in {
        "free": deep | {"cable": line | {"top": {"kind": "free", "force": [1e3, 0.0, 9e3]}, "grading": 1.5}},
        "stretched": deep | {"cable": line, "buoy": MOORED["buoy"], "waves": steep | {"stretching": "vertical"}},
        "thin": deep
        | {"cable": line | {"top": {"kind": "fixed", "position": [9, 0, -1]}, "tangential_froude_krylov": False}},
        "moving": deep | {"cable": line, "buoy": MOORED["buoy"], "initial": {"buoy_velocity": [0.1, 0.0, 0.0]}},
        "sloping": deep | {"cable": line, "buoy": MOORED["buoy"], "seabed": {"slope": [0.05, 0.0], "stiffness": 1e5}},
        "windy": SHIP | {"vessel": [SHIP["vessel"][0] | {"wind": {"speed_10m": 9.0, "area": 1.0, "height": 1.0}}]},
        "sinker": deep
        | {"cable": line, "buoy": MOORED["buoy"], "seabed": {"friction": 0.6, "stiffness": 1e5}}
        | {"anchor": {"weight": 2e4, "friction": 0.7, "drags": True}},
    }.items():
        print(name)
        try:
            found = to_moordyn.export(load_scene(scene))
        except (InputError, SolveError) as error:
            print(f"  refused: {error}")
            continue
        print(*(f"  {note}" for note in found.notes), sep="\n")
        print(
            *(f"  | {row}" for row in found.files["lines.txt"].splitlines() if "Fixed" in row or "Free" in row),
            sep="\n",
        )


def of_settings():
    """Numbers of elements and steps that lines of segments can have."""
    parts = [{"length": 8.0, "elements": 3}, {"length": 14.0, "elements": [[4.0, 2], [10.0, 5]]}]
    several = load_scene(MOORED, **{"cable.segments": parts, "cable.elements": None, "cable.length": None})
    for scene in (DRIVEN, several, load_scene("free-buoy")):
        print(settings.space_of(scene), *settings.spaces(scene, None, [2, 5, 9] if scene.cable else None))
        print(settings.stepping_of(scene), settings.largest_step(scene), settings.keys_of_lines(scene))
        for key in ("cable.normal_drag", "buoy.axial_drag"):
            print(settings.everywhere(scene, key, 0.5))
        for cells in (1, 4, 10, 33):
            print(settings.fitting(scene, settings.Space(2, 1, cells)) if scene.cable else "no line", end=" ")
        for scheme in ("bdf2", "generalized-alpha"):
            space = settings.Space(1, 0, 10) if scene.cable else settings.Space()
            found = settings.with_settings(scene, space, settings.Stepping(scheme, 0.02))
            print(scheme, [cable.elements for cable in found.cables], found.time.model_dump(exclude_none=True))


with TemporaryDirectory() as place, chdir(place):
    of_calibration()
    of_uncertainty()
    of_derivatives()
    of_sessions()
    of_linear_answers()
    of_exports()
    of_settings()
