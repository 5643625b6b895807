"""Difficult networks.

Source: catenaries joined without finite elements (`statics.network`), weights, symmetry.
"""

import math

import numpy as np
from hard import INF, SCENES, run, sound_run, static, with_
from mpi4py import MPI

from dolfbuoy.scene import load_scene
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.network import solve
from dolfbuoy.statics.start import still_network

LAWS = ("compressive", "tension-only")
LINE, BRIDLE, FLOATS, LEG = (SCENES[name] for name in ("LINE", "BRIDLE", "FLOATS", "LEG"))
G = 9.81


def line(name, low, high, length, weight, **more):
    """A [[cable]] without volume, of a weight per metre [N/m]."""
    return LINE | {"name": name, "from": low, "to": high, "length": length, "line_density": weight / G} | more


def compared(found, scene, law, positions=1e-3, tensions=5e-3):
    """Ends of all pieces and their tensions against the closed form of the network in still water; none compressed."""
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    rest, lines, u = solve(still_network(problem)), problem.lines, problem.system.u
    T, off, wrong = u[lines.T_dofs], 0.0, 0.0
    for piece, shape in enumerate(rest.shapes):
        mine, ends = lines.line_of_cell == piece, rest.ends[piece]
        wrong = max(wrong, np.abs(T[mine] - shape.tension(lines.T_s[mine] - lines.begins[piece])).max())
        off = max(off, *(np.abs(u[lines.end_dofs[piece][end]] - ends[end]).max() for end in (0, 1)))
    found.below(f"{law}: ends off by", off / lines.longest, positions, " L")
    found.below("tensions off by", wrong / T.max(), tensions, " of the largest")
    found.holds("all in tension", T.min() > 0)
    problem.destroy()
    return rest


def test_slack_bridle_leg(found):
    """A bridle with one leg so long that it hangs slack below the ring, both slack laws.  Must show: the state of
    three catenaries that meet, all of it in tension.
    """
    legs = [("leg1", [150.0, 8.0, -5.0], 35.0), ("leg2", [150.0, -6.0, -5.0], 60.0)]
    for law in LAWS:
        cables = [line("main", [0.0, 0.0, -100.0], "ring", 145.0, 300.0, slack=law)]
        cables += [line(name, "ring", place, length, 150.0, slack=law) for name, place, length in legs]
        rest = compared(found, BRIDLE | {"cable": cables}, law)
        slack, taut = (np.linalg.norm(rest.pulls[piece]) for piece in (2, 1))
        found.below("tension of the slack leg over that of the other", slack / taut, 0.05)


def _floats(high, length, law, weight=30.0):
    """Two moored floats, and a line between them."""
    wet = {"slack": law, "diameter": 0.01, "normal_drag": 1.2, "added_mass": 1.0}
    cables = [
        line("a", [0.0, 0.0, -50.0], "A", 48.0, 50.0, **wet),
        line("b", [60.0, 0.0, -50.0], "B", 48.0, 50.0, **wet),
        line("shared", "A", high, length, weight, **wet),
    ]
    return FLOATS | {"cable": cables}


def test_slack_between_floats(found):
    """A line between two moored floats that hangs slack; a taut one between a float and a boat that comes nearer and
    goes away again; both laws.  Must show: the catenaries that meet, slack and taut, as in slow motion; T >= 0
    throughout; no failed step.
    """
    for law in LAWS:
        compared(found, _floats("B", 90.0, law), law)
        scene = _floats("boat", 31.0, law)
        boat = {"name": "boat", "position": [48.0, 4.0, 0.0], "amplitude": [12.0, 0.0, 0.0], "period": 400.0}
        scene["joint"] = [*scene["joint"], boat | {"phase_deg": 90.0}]
        record = sound_run(found, with_(scene, time={"end": 400.0, "step": 0.05, "scheme": "bdf2"}))
        T, taut, slack = record.tension_top.sel(cable="shared"), _pull_at(scene, 60.0), _pull_at(scene, 36.0)
        found.below("tension of the line when slack over that when taut, of the catenaries", slack / taut, 0.1)
        for t, expected in ((0.0, taut), (200.0, slack), (400.0, taut)):
            found.close(f"{law}: in the run, at {t:g} s", T.sel(time=t, method="nearest"), expected, 1e-2, " N")
        found.below("-min T", -float(record.cable_tension.min()), 1e-6, " N")
        found.below("failed steps", record.attrs["failed_steps"], 0)


def _pull_at(scene, x):
    """Tension at the boat of the closed form, when it is at x [N]."""
    joints = [*scene["joint"][:-1], {"name": "boat", "position": [x, 4.0, 0.0]}]
    problem = solve_equilibrium(load_scene(scene | {"joint": joints}), MPI.COMM_SELF)
    rest = solve(still_network(problem))
    problem.destroy()
    return float(rest.shapes[2].tension(np.array([31.0]))[0])


def test_loop(found):
    """A float and a clump with two lines between them, a closed loop.  Must show: the catenaries that meet, all of
    them in tension.
    """
    for law in LAWS:
        wet = {"slack": law, "diameter": 0.01}
        cables = [
            line("up", [0.0, 0.0, -50.0], "A", 40.0, 100.0, **wet),
            line("down", "A", "B", 25.0, 100.0, **wet),
            line("back", "B", [20.0, 5.0, -50.0], 40.0, 100.0, **wet),
            line("across", "B", "A", 30.0, 50.0, **wet),
        ]
        joints = [{"name": "A", "mass": 500.0, "volume": 4.0}, {"name": "B", "mass": 100.0}]
        scene = FLOATS | {"cable": cables, "joint": joints, "sea": {"depth": 500.0}}
        compared(found, scene, law)


def test_twelve_legs(found):
    """Twelve legs to one float.  Must show: equal tensions, which hold its lift."""
    angles = np.arange(12) * math.pi / 6
    feet = [
        [520 * math.cos(angle), 520 * math.sin(angle), -300.0] for angle in angles
    ]  # the float stays below the surface
    legs = [line(f"leg{i}", foot, "hub", **LEG) for i, foot in enumerate(feet)]
    scene = FLOATS | {"cable": legs, "joint": [{"name": "hub", "volume": 120.0, "mass": 2000.0}]}
    rest = static(with_(scene, sea={"depth": 500.0}))
    pull = np.linalg.norm(rest.end_tension.values, axis=1)
    found.below("tensions apart by", np.ptp(pull) / pull.max(), 1e-10)
    found.close("sum of their vertical parts", rest.end_tension[:, 2].sum(), (120 * 1025 - 2000) * G, 1e-9, " N")


def test_weightless_joint(found):
    """A driven line cut by joints without mass, elastic and inextensible, from rest and set off at once.  Must show:
    the motion of the line that is not cut to 1e-10; set off at once, a start that is off by no more than rounding,
    eps L/h^2 of its tiny steps.
    """
    wet = {"diameter": 0.01, "normal_drag": 1.2, "added_mass": 1.0}
    top = {"kind": "prescribed", "position": [30.0, 0.0, 0.0], "amplitude": [0.0, 1.0, 1.0], "period": 4.0, "ramp": 2.0}
    both = LINE | wet | {"line_density": 5.0, "anchor": [0.0, 0.0, -50.0], "top": top}
    size, step = ("length", "elements"), 0.05
    times = {"sea": {"depth": 200.0}, "time": {"end": 5.0, "step": step, "scheme": "bdf2"}}
    times |= {"solver": {"step_tolerance": 1e-12}}
    cut = [{"length": 22.0, "elements": 8}, {"length": 27.5, "elements": 10}, {"length": 16.5, "elements": 6}]
    parts = {key: value for key, value in both.items() if key not in size} | {"segments": cut}
    whole = both | {"length": 66.0, "elements": 24}
    for EA in (1e6, INF):
        x, y = (run(times | {"cable": cable | {"axial_stiffness": EA}}) for cable in (parts, whole))
        found.below(f"EA = {EA:g}: top tension of the cut line off by", _apart(x, y), 1e-10)
    # set off at once: the tension of the start is an acceleration, 3 a2 - 2 a3 of tiny steps h (motion/consistent.py),
    # h^2 a3 = r3 - 2 r2 + r1: so -2 r3 + 7 r2 - 8 r1 + 3 r0, all but r0 rounded by at most eps L/2, in both runs
    at_once = {"top": {key: value for key, value in top.items() if key != "ramp"}}
    x, y = (run(times | {"cable": cable | at_once | {"axial_stiffness": INF}}) for cable in (parts, whole))
    rounding = (2 + 7 + 8) * np.finfo(float).eps * 66.0 / (1e-3 * step) ** 2 * 66.0 * 5.0
    found.below("set off at once", _apart(x, y), rounding / np.ptp(y.tension_top.values))
    found.below("... at the end", _apart(x, y, -20), 1e-9)


def _apart(x, y, first=0):
    """Largest difference of two top tensions, from an instant on, over their range."""
    a, b = x.tension_top.values.ravel(), y.tension_top.values
    return np.abs(a - b)[first:].max() / np.ptp(b)


def test_light_between_heavy(found):
    """A piece lighter than water between heavy ones, both slack laws.  Must show: the catenaries that meet, all of
    them in tension.
    """
    for law in LAWS:
        wet = {"slack": law, "diameter": 0.01, "elements": 40}
        cables = [
            line("low", [0.0, 0.0, -300.0], "p", 100.0, 411.0, **wet),
            line("light", "p", "q", 50.0, 1.0, **(wet | {"diameter": 0.4})),
            line("high", "q", [115.0, 0.0, -200.0], 90.0, 411.0, **wet),
        ]
        scene = FLOATS | {"cable": cables, "joint": [{"name": "p"}, {"name": "q"}], "sea": {"depth": 500.0}}
        compared(found, scene, law)


# -- on a bed ----------------------------------------------------------------------------------------------------------


def _chain_leg(name, low, high, elements=40, **more):
    """560 m of chain, 700 N/m in water."""
    density = 700 / G + 1025 * math.pi / 4 * 0.05**2
    heavy = {"line_density": density, "diameter": 0.05, "axial_stiffness": 4e8, "elements": elements}
    return line(name, low, high, 560.0, 700.0) | heavy | more


BED = {"sea": {"depth": 100.0}, "seabed": {}, "time": FLOATS["time"]}
ANCHORS = [[520 * math.cos(a), 520 * math.sin(a), -100.0] for a in np.radians([0.0, 120.0, 240.0])]


def test_joint_on_the_bed(found):
    """A chain with a joint without mass where it lies on the bed.  Must show: the closed form of the chain in one
    piece.
    """
    size = ("length", "elements", "from", "to")
    for law in LAWS:
        leg = {k: v for k, v in _chain_leg("leg", None, None, slack=law).items() if k not in size}
        segments = [{"length": 100.0, "elements": 10}, {"length": 460.0, "elements": 46}]
        leg |= {"anchor": ANCHORS[0], "top": {"kind": "fixed", "position": [0.0, 0.0, 0.0]}, "segments": segments}
        rest = static(BED | {"cable": [leg]})
        found.close(f"{law}: top tension", float(np.ravel(rest.tension_top)[0]), 146281.019440192, 2e-3, " N")
        found.below("the joint's depth in the bed", -100 - float(rest.joint_position[0, 2]), 0.02, " m")


def test_clump_lands_and_lifts(found):
    """A clump lowered onto a bed with friction, its wire slack and moved sideways, and lifted again.  Must show: it
    stays where it lies; no failed step; T >= 0; it hangs as before.
    """
    rows = [
        [0, 0, 0, 0],
        [2, 0, 0, 0],
        [6, 0, 0, -3],
        [8, 0, 0, -3],
        [10, 0.3, 0, -3],
        [12, 0.3, 0, -3],
        [17, 0.3, 0, 0],
    ]
    ship = {"name": "ship", "position": [0.0, 0.0, 0.0], "motion": [*rows, [30, 0.3, 0, 0]]}
    clump = {"name": "clump", "mass": 500.0, "volume": 0.1, "drag_area": 0.5, "added_mass": 0.5}
    wire = line(
        "wire", "clump", "ship", 8.0, 20.0, diameter=0.02, normal_drag=1.2, added_mass=1.0, slack="tension-only"
    )
    scene = BED | {"sea": {"depth": 10.0}, "seabed": {"friction": 0.5}, "cable": [wire], "joint": [clump, ship]}
    record = run(with_(scene, time={"end": 30.0, "step": 0.02, "scheme": "bdf2"}))
    found.finite(record.drop_vars("touchdown"))  # which is nowhere where nothing lies
    x, z, t = record.joint_position[:, 0, 0].values, record.joint_position[:, 0, 2].values, record.time.values
    lies = (t > 7) & (t < 12)
    found.below("it lies on the bed to", np.abs(z[lies] + 10).max(), 0.003, " m")
    found.below("it slides while its wire is slack", np.ptp(x[lies]), 0.01, " m")
    found.close("where it hangs again", z[-1], z[0], 2e-3, " m")
    found.below("failed steps", record.attrs["failed_steps"], 0)
    found.below("-min T", -float(record.cable_tension[1:].min()), 1e-6, " N")


def test_leg_on_its_side(found):
    """Three legs held at a point so near one anchor that its leg lies slack on the bed, H = 0.  Must show: the weight
    of what hangs of it, found by relaxation.
    """
    hub = {"name": "hub", "position": [70.0, 0.0, 0.0]}
    for law in LAWS:
        legs = [_chain_leg(name, place, "hub", slack=law) for name, place in zip("abc", ANCHORS, strict=True)]
        record = static(BED | {"cable": legs, "joint": [hub]})
        # straight down to the bed, and its stretch: w a + w^2 a^2/(2 EA) = 100 w
        found.close(f"{law}: top tension of the slack leg", float(record.tension_top[0]), 69993.876, 5e-2, " N")
        found.says(record.attrs["route"], "relaxation")
        smallest = record.attrs["smallest_tension_N"]
        if law == "tension-only":
            found.below("-min T", -smallest, 1e-6, " N")
        else:
            found.remark(f"the record tells the smallest tension: {smallest:.4g} N")
