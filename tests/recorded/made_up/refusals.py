"""Scenes whose parts do not go together and calls of what a scene does not have, each with the sentence it ends in."""

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import tomli_w
import xarray as xr
from made_up import RECORD
from made_up import SCENE as MADE_UP
from told import refused

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.linear.periods import buoy_periods
from dolfbuoy.model.feasible import check_feasible
from dolfbuoy.page import folder
from dolfbuoy.results import figures
from dolfbuoy.results.sample import Fatigue
from dolfbuoy.results.statistics import Run, gumbels, runs_of
from dolfbuoy.scene.variants import cases_of, latin_hypercube, probabilities, with_seeds
from dolfbuoy.statics.equilibrium import _check_determined
from dolfbuoy.statics.first_shape import check_first_shape
from dolfbuoy.statics.righting import righting_curve

DAMPED, CLAMP = {"cable.bending_stiffness": 1e3}, {"direction": [0, 0, 1]}
SEA = {"spectrum": "jonswap", "significant_height": 1.0, "peak_period": 5.0}
WAVES = {"waves": {"amplitude": 0.2, "period": 4.0}}
RISING = [[float(t), 0.1 * (t % 3)] for t in range(9)]
STEEP = {"waves": {"theory": "stream", "height": 1.0, "period": 5.0, "order": 12}}
SINKER = {"anchor": {"weight": 2e4, "friction": 0.7, "drags": True}}
SHIP = {"name": "ship", "position": [1.0, 0.0, 0.0], "fairleads": {"bow": [3.0, 0.0, -1.0]}}
RAOS = [[5.0, 0.0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]]
ON_SHIP = {"cable.to": "ship.bow", "cable.top": None, "cable.from": [30.0, 0.0, -10.0], "cable.anchor": None}
ON_SHIP |= {"cable.length": 40.0}
GRID = [[0.0, -9.0, 1.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
SPECTRUM = {"frequency": [0.1, 0.2], "direction_deg": [0.0, 40.0], "density": [[1.0, 2.0], [2.0, 1.0]]}
LINE = {
    "name": "a",
    "length": 20.0,
    "line_density": 5.0,
    "axial_stiffness": 1e5,
    "elements": 4,
    "from": [0, 0, -20],
} | {"diameter": 0.05}
STIFF = LINE | {"bending_stiffness": 1e3, "position_degree": 2, "tension_degree": 1}
OFF = {"from": "float", "to": [0.0, 0.0, -19.0]}
FLOAT = {"name": "float", "mass": 10.0, "volume": 0.05}
HULL = {"name": "b", "hull": [[0.0, 1.0], [2.0, 1.0]], "mass": 300.0, "center_of_mass": 0.5}
AFLOAT = {"sea": {"depth": 20.0}, "buoy": [HULL], "time": {"end": 1.0, "step": 0.1}}
MOORED = AFLOAT | {"cable": [LINE | {"to": "b"}]}
WATER = {"sea": {"depth": 20.0}, "time": {"end": 1.0, "step": 0.1}}
DEPTHS = {"x": [0.0, 9.0], "y": [0.0, 9.0], "depth": [[20.0, 21.0], [22.0, 23.0]]}
#: (scene, by name or whole; what is changed).
SCENES = [
    # lines
    ("driven", {"cable.segments": []}),
    ("driven", {"cable.top.kind": "fixed", "cable.top.position": None}),
    ("driven", {"cable.top.amplitude": None}),
    ("driven", {"cable.top.period": None}),
    ("driven", {"cable.top.amplitude": None, "cable.top.period": None}),
    ("driven", {"cable.top.velocity": [1.0, 0.0, 0.0]}),
    ("driven", {"cable.top.force": [1.0, 0.0, 0.0]}),
    ("driven", {"cable.top.kind": "fixed"}),
    ("driven", {"cable.fails_at": {"tension": 1e4, "at": 2.0}}),
    ("driven", {"cable.fails_at": {"time": 1.0, "tension": 1e4}}),
    ("driven", {"cable.fails_at": {"time": 1.0, "at": 200.0}}),
    ("driven", DAMPED | {"cable.fails_at": {"time": 1.0}}),
    ("driven", {"cable.minimum_bend_radius": 2.0}),
    ("driven", {"cable.bending_damping": 0.1}),
    ("driven", {"cable.to_end": CLAMP}),
    ("driven", {"cable.winch": [[1.0, 20.0], [3.0, 21.0]]}),
    ("driven", {"cable.winch": [[0.0, 20.0], [0.001, 30.0]], "cable.length": 20.0}),
    ("driven", {"cable.winch": [[0.0, 20.0], [3.0, 21.0]], "cable.length": 20.0, "cable.fails_at": {"time": 1.0}}),
    ("driven", {"cable.anchor": [0, 0, 0], "cable.from": [0, 0, 0]}),
    ("driven", {"cable.axial_stiffness": [[0.0, 0.0]]}),
    ("driven", {"cable.axial_stiffness": [[0.0, 1.0], [0.1, 2.0]]}),
    ("driven", {"cable.axial_stiffness": [[0.0, 0.0], [200.0, 2.0]]}),
    ("driven", {"cable.material": "none of the kind"}),
    (
        WATER
        | {"cable": [LINE | {"to": [5.0, 0, 0], "length": None, "segments": [{"length": 30.0, "material": "none"}]}]},
        {},
    ),
    (WATER | {"cable": [LINE | {"to": [5.0, 0, -5.0], "elements": 1, "axial_stiffness": float("inf")}]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}, STIFF | OFF | {"name": "c"}], "joint": [FLOAT | {"weld": True}]}, {}),
    (WATER | {"cable": [LINE | {"to": "float", "from_end": CLAMP}], "joint": [FLOAT]}, {}),
    (WATER | {"cable": [STIFF | {"to": "float", "to_end": CLAMP}], "joint": [FLOAT]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}, LINE | {"to": [0, 0, 0]}], "joint": [FLOAT]}, {}),
    (WATER | {"cable": [LINE | {"to": "nowhere"}], "joint": [FLOAT]}, {}),
    (WATER | {"cable": [LINE | {"from": "float", "to": "float"}], "joint": [FLOAT]}, {}),
    (WATER | {"cable": [LINE | {"to": [0, 0, -20]}]}, {}),
    (WATER | {"cable": [LINE | {"from": "float", "to": "g"}], "joint": [FLOAT, {"name": "g"}]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}], "joint": [FLOAT, FLOAT]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}], "joint": [FLOAT, {"mass": 1.0}]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}], "joint": [FLOAT, {"name": "spare"}]}, {}),
    (WATER | {"cable": [LINE | {"to": "float"}], "joint": [FLOAT | {"position": [0, 0, 0]}]}, {}),
    (MOORED | {"joint": [{"name": "b"}]}, {}),
    (MOORED | {"vessel": [SHIP | {"name": "b"}]}, {}),
    (MOORED | {"cable": [LINE | {"to": "b.bow"}]}, {}),
    (MOORED | {"buoy": [HULL, HULL | {"name": "c"}]}, {}),
    (
        MOORED
        | {"cable": [LINE | {"to": "b"}, LINE | {"name": "c", "to": "c"}], "buoy": [HULL, HULL | {"name": "c"}]}
        | {"initial": {"buoy_position": [0, 0, 0]}},
        {},
    ),
    (MOORED | {"initial": {"kind": "straight"}}, {}),
    (MOORED | {"initial": {"kind": "polyline", "points": [[0, 0, -20], [0, 0, -20]]}}, {}),
    ("driven", {"initial": {"kind": "polyline", "points": {"other": [[0, 0, 0], [1, 0, 0]]}}}),
    ("three-legs", {"initial": {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0]]}}),
    ("driven", ON_SHIP | {"vessel": [SHIP | {"fairleads": {"stern": [0, 0, 0]}}]}),
    ("driven", ON_SHIP | {"vessel": [SHIP | {"raos": RAOS}]}),
    ("driven", ON_SHIP | STEEP | {"vessel": [SHIP | {"raos": RAOS}]}),
    ("driven", ON_SHIP | {"vessel": [SHIP | {"hull": [0.0, 4.0, -1.0, 2.0]}]}),
    # what holds them
    ("driven", {"take_off": [{"from": [0, 0, 0], "to": [0, 0, 9], "stiffness": 1e3}]}),
    ("driven", {"take_off": [{"from": [0, 0, 0], "to": [0, 0, 9], "length": 1.0}]}),
    ("driven", {"take_off": [{"from": [0, 0, 0], "to": [0, 0, 9], "damping": 1.0, "longest": 1.0}]}),
    ("driven", {"take_off": [{"from": [0, 0, 0], "to": [0, 0, 9], "damping": 1.0, "stop_stiffness": 1.0}]}),
    (
        "driven",
        {
            "take_off": [
                {"from": [0, 0, 0], "to": [0, 0, 9], "damping": 1.0, "stop_stiffness": 1.0}
                | {"longest": 1.0, "shortest": 2.0}
            ]
        },
    ),
    ("chain-on-bed", {"seabed": None} | SINKER),
    ("chain-on-bed", {"seabed.friction": 0.0} | SINKER),
    ("chain-on-bed", {"sea.density": 3000.0} | SINKER),
    ("chain-on-bed", {"cable.anchor": [0.0, 0.0, 40.0]} | SINKER),
    ("chain-on-bed", {"anchor": {"holding_capacity": 1e5, "drags": True}}),
    ("chain-on-bed", {"anchor": {"elsewhere": {"holding_capacity": 1e5}}}),
    ("chain-on-bed", {"seabed.depths": DEPTHS | {"x": [9.0, 0.0]}}),
    ("chain-on-bed", {"seabed.depths": DEPTHS | {"depth": [[20.0, 21.0], [22.0, 23.0, 24.0]]}}),
    ("chain-on-bed", {"fatigue": {"corrosion": 1e-3}}),
    ("chain-on-bed", {"fatigue": {"curve": "API studless", "spacing": 1e-5, "places": ["hog"]}}),
    ("short", {"sea": None, "waves": None, "current": None, "criteria": {"least_freeboard": 0.5}}),
    # buoys
    (MOORED | {"buoy": [HULL | {"fairleads": {}}]}, {}),
    (MOORED | {"buoy": [HULL | {"added_mass": "spar", "mass": 3e3}]}, {}),
    (MOORED | {"buoy": [HULL | {"added_mass": "spar"}], "gravity": 0.0}, {}),
    (MOORED | {"buoy": [HULL | {"wind": {"speed_10m": 9.0, "area": 1.0, "height": 1.0, "gusts": "kaimal"}}]}, {}),
    (MOORED | {"buoy": [HULL | {"hull": None, "inertia": [90.0, 40.0]}]}, {}),
    (MOORED | STEEP | {"buoy": [HULL | {"disk_averages": True}]}, {}),
    (MOORED | {"buoy": [HULL | {"potential_flow": "none.nc"}]}, {}),
    (MOORED | {"buoy": [HULL | {"drift": "newman"}]}, {}),
    # the sea, and time
    *(
        (MOORED | {"waves": waves}, {})
        for waves in (
            SEA | {"significant_height": None},
            {"spectrum": [[0.1, 0.0], [0.2, 0.0]]},
            {"spectrum": SPECTRUM | {"density": [[0.0, 0.0], [0.0, 0.0]]}},
            {"spectrum": SPECTRUM | {"density": [[1.0], [2.0]]}},
            {"spectrum": SPECTRUM | {"direction_deg": [0.0, 400.0]}},
            {"spectrum": SPECTRUM | {"frequency": [0.2, 0.1]}},
            {"spectrum": SPECTRUM, "spreading": 4.0},
            SEA | {"band": [0.9, 0.9]},
            {"period": 5.0},
            {"amplitude": 1.0},
            {},
            {"theory": "stream", "height": 1.0},
            {"theory": "stream", "height": 0.0, "period": 5.0},
            {"theory": "stream", "amplitude": 1.0, "period": 5.0},
            {"amplitude": 1.0, "period": 5.0, "height": 2.0},
            {"amplitude": 1.0, "wavelength": 30.0},
            {"elevation": [*RISING[:8], [9.0, 0.1]]},
            {"elevation": RISING, "period_seen_from": "water"},
            {"elevation": RISING[::-1]},
        )
    ),
    *((MOORED | {"waves": waves, "gravity": 0.0}, {}) for waves in (WAVES["waves"], STEEP["waves"], SEA)),
    *(
        (MOORED | {"current": current}, {})
        for current in (
            {},
            {"profile": "power"},
            {"grid": [[0.0, -9.0, 1.0, 0.0], [0.0, -9.0, 2.0, 0.0]]},
            {"grid": [[0.0, -9.0, 1.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0]]},
            {"grid": GRID, "speed": 1.0},
            {"speed": 1.0, "grid": GRID},
        )
    ),
    (MOORED | {"waves": WAVES["waves"] | {"period_seen_from": "ground"}, "current": {"grid": GRID}}, {}),
    ("short", {"time.output_every": 1e-9}),
    # of bodies, fatigue and starts
    (MOORED | {"buoy": [HULL | {"inertia": [1.0, 1.0, 9.0]}]}, {}),
    (MOORED | {"buoy": [HULL | {"hull": None, "added_mass": "disk", "inertia": [1.0, 1.0]}]}, {}),
    (MOORED | {"buoy": [HULL, HULL | {"name": "c"}], "external_force": {"force": [1.0, 0.0, 0.0]}}, {}),
    ("driven", {"cable.breaking_load": 1e5, "fatigue": {"curve": "API six-strand", "corrosion": 1e-3}}),
    ("driven", {"cable.steel_area": 1e-4, "fatigue": {"curve": "DNV studless", "corrosion": 0.05}}),
    (AFLOAT | {"fatigue": {"curve": "API studless"}}, {}),
    ("three-legs", {"initial": {"kind": "polyline", "points": {"east": [[0, 0, 0], [1, 0, 0]]}}}),
    ("three-legs", {"initial": {"kind": "straight"}}),
    ("driven", {"cable.anchor": [1.0, 2.0]}),
    ("driven", {"nothing": {"a": 1}}),
    ("driven", {"cable": {"length": {"a": 1}}}),
    (WATER | {"cable": [LINE, LINE | {"name": None, "length": -1.0}]}, {}),
    (WATER | {"cable": [LINE, LINE | {"name": "b", "length": -1.0}]}, {}),
    ("chain-on-bed", {"anchor": {"nowhere": {"holding_capacity": 1e5}, "cable.from": {"holding_capacity": 1e5}}}),
    # of networks, and of what starts them
    ("three-legs", {"anchor": [{"at": "nowhere", "holding_capacity": 1e5}]}),
    ("three-legs", {"anchor": [{"at": "cable.east.from", "holding_capacity": 1e5}]}),
    (
        "driven",
        {"cable.top.motion": [[0, 0, 0, 0], [1, 1e4, 0, 0]], "cable.top.amplitude": None, "cable.top.period": None},
    ),
    ("driven", {"cable.top.amplitude": [0.0, 0.0, 900.0], "cable.top.period": 0.1}),
    ("driven", {"cable.breaking_load": 1e5, "fatigue": {"curve": "API six-strand", "spacing": 1e-4}}),
    ("driven", {"cable.breaking_load": 1e5, "fatigue": {"curve": "API studless", "corrosion": 1e-3}}),
    ("driven", {"library": "/"}),
    ("driven", {"take_off": [{"from": [0, 0, 0], "to": [0, 0, 9], "stiffness": 1e3, "length": 1.0}]}),
    ("driven", {"cable.top": None, "cable.to": 5}),
    ("driven", {"cable.name": "1 x"}),
    ("driven", {"cable.top": {"kind": "free"}, "initial.kind": "straight"}),
    (AFLOAT | {"buoy": [HULL, HULL | {"name": None}]}, {}),
    (AFLOAT | {"buoy": [HULL, HULL | {"name": "c"}], "external_force": {"force": [1.0, 0.0, 0.0]}}, {}),
    (AFLOAT | {"buoy": [HULL | {"hull": None, "added_mass": "spar", "inertia": [1.0, 1.0]}]}, {}),
    (
        AFLOAT
        | {
            "buoy": [
                HULL | {"added_mass": "spar", "hull": [[0.0, 1.0], [1.0, 1.0], [1.1, 0.0], [2.0, 0.0], [2.1, 1.0]]}
            ]
        },
        {},
    ),
    (
        WATER
        | {
            "vessel": [SHIP],
            "cable": [STIFF | {"to": "ship.bow", "to_end": {"motion": [[0, 0, 0, 1], [1, 0, 0.1, 1]]}}],
        },
        {},
    ),
    (
        WATER
        | {
            "cable": [
                LINE
                | {"to": [5.0, 0, 0], "length": None, "elements": None}
                | {"segments": [{"length": 9.0, "elements": 2}, {"length": 30.0, "elements": 2, "body": {"mass": 3.0}}]}
            ]
        },
        {},
    ),
    (
        WATER
        | {"cable": [STIFF | {"to": "float"}, STIFF | OFF | {"name": "c", "to": [9, 0, -9], "bending_damping": 0.1}]}
        | {"joint": [{"name": "float", "weld": True}]},
        {},
    ),
    (WATER | {"vessel": [SHIP | {"motion": [[0] * 7, [0] * 7]}]}, {}),
    *(
        (
            AFLOAT
            | {"buoy": [HULL, HULL | {"name": "c"}], "cable": [LINE | {"to": "b"}, LINE | {"name": "d", "to": "c"}]},
            change,
        )
        for change in (
            {"initial": {"kind": "polyline", "points": [[0, 0, -20], [0, 0, -2]]}},
            {"initial": {"kind": "straight"}},
        )
    ),
    *(
        (
            WATER
            | {
                "cable": [LINE | {"to": "Y"}, LINE | {"name": "d", "from": [9, 0, -20], "to": "Y"}],
                "joint": [{"name": "Y"}],
            },
            {"initial": start},
        )
        for start in (
            {"kind": "straight"},
            {"kind": "polyline", "points": [[0, 0, -20], [0, 0, -2]]},
            {"kind": "polyline", "points": {"a": [[0, 0, -20], [4, 0, -2]]}},
            {"kind": "polyline", "points": {"a": [[0, 0, -20], [4, 0, -2]], "d": [[9, 0, -20], [3, 0, -2]]}},
            {"kind": "polyline", "points": {"a": [[0, 0, -20], [0, 0, -20]], "d": [[9, 0, -20], [0, 0, -20]]}},
        )
    ),
    (
        WATER | {"cable": [LINE | {"to": [3, 0, -4]}]},
        {"initial": {"kind": "polyline", "points": [[0, 0, -20], [3, 0, -5]]}},
    ),
    (
        WATER | {"cable": [LINE | {"axial_stiffness": float("inf"), "to": [3, 0, -4]}]},
        {"initial": {"kind": "straight"}},
    ),
]


def looked_at(scene, changes):
    """All that is looked at before anything is built."""
    found = load_scene(scene, **changes)
    check_feasible(found)
    check_first_shape(found)


def determined(scene):
    """Whether anything determines the equilibrium of a scene."""
    _check_determined(SimpleNamespace(scene=scene, network=scene.network))


def table(text):
    """A CSV file."""
    Path("table.csv").write_text(text)
    return Path("table.csv")


def file_of(name, **data):
    """A netCDF file."""
    xr.Dataset(data).to_netcdf(name)
    return name


def named(**keys):
    """A scene file beside those that it names."""
    Path("named.toml").write_text(tomli_w.dumps(AFLOAT | keys))
    return load_scene(Path("named.toml"))


refused(*(partial(looked_at, *case) for case in SCENES))
UNDETERMINED = WATER | {"cable": [LINE | {"axial_stiffness": float("inf"), "to": [0.0, 0.0, 0.0]}]}
THROUGH = {"cable": [LINE | {"to": "Y"}, LINE | {"name": "d", "from": [40.0, 0.0, -20.0], "to": "Y"}]}
THROUGH["cable"] = [line | {"axial_stiffness": float("inf")} for line in THROUGH["cable"]]
refused(
    *(
        partial(determined, load_scene(scene))
        for scene in (
            UNDETERMINED,
            UNDETERMINED | {"cable": [UNDETERMINED["cable"][0] | {"length": 20.001}]},
            WATER | THROUGH | {"joint": [{"name": "Y"}]},
            MOORED | {"gravity": 0.0},
        )
    )
)
DEEP = {"x": ("x", [0.0, 1.0]), "y": ("y", [0.0, 1.0])}
TIMES = {"time": ("time", [0.0, 1.0], {"units": "weeks"}), "depth": ("depth", [0.0, 9.0])}
FLOW = (("time", "depth"), [[0.1, 0.2], [0.3, 0.4]])
refused(
    lambda: named(seabed={"depths": file_of("none.nc", **DEEP)}),
    lambda: named(seabed={"depths": file_of("gap.nc", **DEEP, depth=(("y", "x"), [[20.0, np.nan], [20.0, 20.0]]))}),
    lambda: named(seabed={"depths": str(table("2 2\n0 1\n0 1\n0 0 -20\n"))}),
    lambda: named(current={"grid": file_of("weeks.nc", **TIMES, u=FLOW, v=FLOW)}),
    lambda: named(current={"grid": file_of("half.nc", u=FLOW)}),
    lambda: named(current={"grid": file_of("other.nc", u=("x", [1.0]), v=("x", [1.0]), time=TIMES["time"])}),
    lambda: named(waves={"spectrum": file_of("sea.nc", efth=("freq", [1.0]), freq=("freq", [0.1]))}),
    lambda: named(waves={"spectrum": file_of("seas.nc", a=("freq", [1.0]))}),
    lambda: named(waves={"elevation": str(table("1,2,3\n4,5\n"))}),
    lambda: named(vessel=[SHIP | {"motion": file_of("still.nc", time=TIMES["time"])}]),
)
driven, sinking = load_scene("driven", time__end=0.5), load_scene("short")
sample = {"series": {}, "duration": 9.0}
refused(
    lambda: Fatigue(exponent=0.0),
    lambda: Fatigue(corrosion=-1.0),
    lambda: Fatigue(curve="API studless", constant=1.0),
    lambda: Fatigue(curve="none"),
    lambda: gumbels([Run("a", sample, "x"), Run("b", sample | {"duration": 8.0}, "x")], "tension_top"),
    lambda: gumbels([Run("a", sample, "x"), Run("b", sample, "x")], "tension_top"),
    lambda: runs_of([RECORD]),
    lambda: figures.tension(RECORD.isel(time=slice(0, 0)), MADE_UP),
    lambda: figures.orbit(RECORD, load_scene(MADE_UP, waves=None)),
    lambda: figures.orbit(RECORD.isel(time=slice(0, 20)), MADE_UP),
    lambda: figures.tension(RECORD.isel(cable=0, drop=True), MADE_UP),
    lambda: folder.show(xr.Dataset()),
    lambda: dolfbuoy.stiffness(load_scene("towed-array")),
    lambda: dolfbuoy.response(driven, periods=[5.0], sea=(0.0, 5.0)),
    lambda: dolfbuoy.response(load_scene(driven, sea=None)),
    lambda: dolfbuoy.offsets(driven, [1e3], [0.0]),
    lambda: dolfbuoy.periodic(load_scene(driven, time=None)),
    lambda: dolfbuoy.simulate(load_scene(driven, time=None)),
    lambda: dolfbuoy.wave_components(driven),
    lambda: buoy_periods(driven),
    lambda: righting_curve(driven, [5.0]),
    lambda: righting_curve(sinking, [5.0], pull=1e6),
    lambda: latin_hypercube([], None, 4),
    lambda: latin_hypercube(["a.b=1:2", "a.b=2:3"], None, 4),
    lambda: latin_hypercube(["a.b=1:2"], None, 0),
    lambda: latin_hypercube(["a.b=2:1"], None, 4),
    lambda: with_seeds([{}], 0),
    lambda: with_seeds([{"waves.seed": 3}], 2),
    lambda: probabilities(table("waves.period,probability\n5,0.7\n6,0.7\n")),
    lambda: cases_of([], table("")),
    lambda: cases_of([], table("a.b,a.b\n1,2\n")),
    lambda: cases_of([], table("a.b,c.d\n1\n")),
    lambda: cases_of([], Path("none.csv")),
    lambda: dolfbuoy.statistics([]),
    lambda: dolfbuoy.sensitivities(driven, by=["cable.slack"]),
    lambda: dolfbuoy.sensitivities(driven, by=["cable.elements"]),
    lambda: dolfbuoy.sensitivities(driven, by=["cable.anchor"]),
    lambda: dolfbuoy.sensitivities(driven, by=["cable.length"], of=["cone_angle.max"]),
    lambda: dolfbuoy.sensitivities(load_scene("driven", **{"cable.fails_at": {"time": 1.0}}), by=["cable.length"]),
    lambda: dolfbuoy.uncertainty(driven, of=["cone_angle.max"], uncertain={"cable.length": "1%"}),
    lambda: dolfbuoy.design(driven, {"cable.length": (20.5, 24.0)}, "cable.length", hold=["tension_top.max 5"]),
    lambda: dolfbuoy.design(driven, {"cable.length": (20.5, 24.0)}, "cable.normal_drag"),
    lambda: dolfbuoy.design(driven, {"cable.length": (20.5, 24.0)}, "cone_angle.max"),
)
