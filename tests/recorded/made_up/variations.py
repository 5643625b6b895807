"""A made-up record in variations that runs rarely have, and numbers at the limits of their formats."""

from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import xarray as xr
from fingerprint import of_array
from made_up import RECORD
from made_up import SCENE as MADE_UP
from told import MOORED, refused, show

from dolfbuoy import load_scene
from dolfbuoy.accuracy import bars as all_bars
from dolfbuoy.accuracy import outputs, target
from dolfbuoy.accuracy.bars import NONE, Bar
from dolfbuoy.linear import natural
from dolfbuoy.page import pack, report
from dolfbuoy.results import after_ramp, bars, cautions, figures, offset_record, offsets, summary, tables
from dolfbuoy.results.series import Series

DRY = load_scene(MADE_UP, **{"sea.dry_above": False})
OVER = np.array([0.0, 1.0, 0.0, 1.0, 1.0, 0.0])


def of_summary():
    """Rows and warnings of a record with less, or more, than most."""
    plain = summary.summary(RECORD, MADE_UP)
    for name, record, scene in (
        ("no elevation", RECORD.drop_vars(["surface_elevation", "lean_at_start"]), MADE_UP),
        ("smaller steps", RECORD.assign_attrs(rejected_steps=3), MADE_UP),
        ("begun", RECORD.isel(time=slice(0, 1)), MADE_UP),
        ("straight", RECORD.assign(largest_curvature=0 * RECORD.cable_tension_maximum), MADE_UP),
    ):
        rows = summary.summary(record, scene)
        print(name, *(row for row in rows if row not in plain), *(f"without {row}" for row in plain if row not in rows))
    said = summary.warnings(RECORD, MADE_UP)
    high = RECORD.cable_position_maximum + np.array([0.0, 0.0, 9.0])
    pushed = RECORD.assign(cable_tension_minimum=RECORD.cable_tension_minimum - 9e3 * OVER)
    for name, record, scene in (
        ("high", RECORD.assign(cable_position_maximum=high), DRY),
        ("pushed", pushed, MADE_UP),
        ("deep", RECORD.assign(cable_position_minimum=RECORD.cable_position_minimum - 2.5), MADE_UP),
        ("parted", RECORD.assign_attrs(parted="cable at t = 3 s"), MADE_UP),
    ):
        print(name, *(sentence for sentence in summary.warnings(record, scene) if sentence not in said))
    still, loose = RECORD.isel(time=0, frame=0), load_scene(MADE_UP, **{"cable.slack": "tension-only"})
    for holes in (OVER, np.ones(6), np.zeros(6), np.arange(6) == 2):
        slack = still.assign(cable_tension=still.cable_tension * (1 - holes))
        print(summary.static_warnings(slack.drop_vars("cable_tension_minimum"), loose))
    use, moved = np.array([[0.4, 1.2], [0.5, 3.5], [0.3, 0.2]]), np.array([[0.0, 0.0], [0.0, 0.8], [0.0, 1.25]])
    anchors = xr.Dataset({"anchor_use": (("time", "anchor"), use), "anchor_moved": (("time", "anchor"), moved)})
    anchors = anchors.assign_coords(time=[0.0, 0.5, 1.0], anchor=["a.from", "b.from"])
    for bodies in ({}, {"b.from": 1}):
        scene = SimpleNamespace(network=SimpleNamespace(bodies=bodies))
        print(summary._moved_anchors(anchors, scene), summary._moved_anchors(anchors.isel(time=1), scene))
    print([summary.sharing_note(MADE_UP, ranks) for ranks in (1, 2)])
    with patch.object(summary, "SHARING_SLOWER_TO", 5):
        print([summary.sharing_note(load_scene(MADE_UP, **{"cable.elements": n}), 2) for n in (5, 6)])
    print(cautions.states_of(RECORD.drop_vars("displaced_mass", errors="ignore"), MADE_UP))


def of_numbers():
    """Texts of numbers, at and beside where their form changes."""
    sizes = [0.0, 1e-13, 9.9e-5, 1.23456e-5, 1e-4, 0.00012345, 0.1, 999.94, 999.96, 12345.6, 9.9995e5, 9.999e14, 1e15]
    for number in (*sizes, 1.5e15, -3.14159e-7, -0.0):
        texts = tables.plain(number), tables.rounded(number), tables.rounded(number, 5), tables.newtons(number)
        print(f"{number!r}:", *texts, *tables.force_unit([number, None]))
    print([tables.years(x) for x in (0.123, 12.3, 999_000.0, 999_999.0, 1e6, 1e7)])
    print([tables._text(*x) for x in ((None,), (3,), (3.14159,), (31415.9, 1e-3), ("word",), (999.96, 1.0))])
    print([bars.number_with(1234.5678, bar) for bar in (np.nan, 0.0, 1e-15, 0.0123, 0.0996, 9.96, 12.3, 1234.0)])
    for values in (np.array([np.nan, np.nan]), np.array([1.0, 1.0]), np.array([0.0, 0.5, np.nan, 2.0])):
        print(pack.coarse(values))
    column = np.sin(np.arange(40.0))
    print([pack.chosen_rows([column, -column], count).tolist() for count in (50, 40, 39, 12, 3)])
    points = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]])
    print([(of_array(np.asarray(c)), round(r, 9)) for c, r in (offsets._through(*three) for three in points)])


def of_outputs():
    """Numbers of series that are short, straight, or without end; targets that were not reached."""
    t = np.arange(6.0)
    for x in (t, t[::-1], 0 * t, (t - 2.4) ** 2, -np.abs(t - 2.0), np.where(t > 3, np.inf, t)):
        print({name: round(float(value), 9) for name, value in outputs.numbers_of(Series("tension_top", t, x)).items()})
    kept = RECORD[["tension_top", "anchor_force"]].isel(time=slice(0, 5))
    for start, end in ((0.0, np.inf), (0.2, np.inf), (0.3, np.inf), (0.0, 0.2), (0.0, 0.1)):
        print(start, end, {key: len(one.t) for key, one in outputs.series_after(kept, start, end).items()})
    scene = load_scene(MADE_UP, **{"accuracy.target": 0.01, "accuracy.of": ["tension_top.max", "offset.mean"]})
    known = {}
    for series, part, values in (("tension_top", "cable", (9e3, 40.0, 5e3)), ("offset", "buoy", (7.0, 2.0, 4.0))):
        for number, value in zip(("max", "min", "mean"), values, strict=True):
            known[outputs.Output(series, number, part)] = Bar(value, 0.02 * value, NONE)
    print(*target.wanted_of(scene, known))
    refused(lambda: target.wanted_of(load_scene(scene, **{"accuracy.of": ["cone_angle.max"]}), known))
    for output in known:
        print(output, target.scale_of(output, known))
    for worst in (0.5, 1.0, 2.0, 50.0, np.inf):
        for output in known if worst == 2.0 else [next(iter(known))]:
            found = SimpleNamespace(scene=scene, output=output, bars=known, worst=worst, sentences=["It is rough."])
            print(worst, round(target._refinement(found), 6), target.sentence_of(found))


def of_bars():
    """Errors of series from one beside them, whose sizes, phases and ends differ."""
    t = np.linspace(0.0, 12.0, 121)
    x = 5.0 + 2.0 * np.sin(t)

    def series(values):
        return Series("tension_top", t, values, 1e-9)

    for name, other in {
        "larger": 5.0 + 2.1 * np.sin(t),
        "shifted": x + 0.25,
        "late": 5.0 + 2.0 * np.sin(t - 0.4),
        "another way": 5.0 - 2.0 * np.sin(t),
        "not finite": np.where(t > 9, np.inf, x),
        "the same": x,
    }.items():
        fine, coarse = series(x), series(other)
        for factor, whole in ((1.0, False), (3.0, False), (3.0, True)):
            errors, rms, lost = all_bars._compared(series(2 * x), fine, coarse, factor, whole)
            print(
                name, factor, whole, {key: round(float(e), 7) for key, e in errors.items()}, round(float(rms), 7), lost
            )
        errors, rms = all_bars._of_steps(series(3 * x), fine, coarse)
        print(name, "of steps", {key: round(float(e), 7) for key, e in errors.items()}, round(float(rms), 7))
    still = series(0 * t + 1.0)
    print(all_bars._compared(still, still, still, 3.0), all_bars._of_steps(still, None, still))
    tangents = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0.9, np.sqrt(0.19)], [0, -0.9, np.sqrt(0.19)]])
    for several in (1, 2):
        line = SimpleNamespace(s=np.arange(5.0), tangents=tangents, name="east")
        with patch.object(natural, "slack_in", lambda _: None):
            refused(lambda n=several, line=line: natural.check_smooth(SimpleNamespace(lines=[line] * n)))
    with patch.object(natural, "slack_in", lambda _: "At rest the cable is slack"):
        refused(lambda: natural.check_smooth(SimpleNamespace(lines=[])))


def of_pages():
    """Seas in words, cases of sweeps, what a page has of many."""
    spectrum = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 7.0, "seed": 3}
    rows = [[float(t), 0.1 * (t % 3)] for t in range(9)]
    seas = {
        "no waves": {"waves": None, "current": None},
        "regular": {"waves": {"amplitude": 0.7, "period": 5.0}, "current": {"speed": 0.8, "direction_deg": 30.0}},
        "irregular": {"waves": spectrum, "sea.tide": [[0.0, 0.5], [3600.0, -0.75]]},
        "measured": {"waves": {"elevation": rows}, "current": {"profile": [[-20.0, 0.1], [0.0, 0.9]]}},
        "table": {"waves": {"spectrum": [[0.1, 0.0], [0.15, 2.0], [0.3, 0.0]]}},
        "grid": {"waves": None, "current": {"grid": [[0.0, -9.0, 1.0, 0.0], [0.0, 0.0, 1.0, 0.0]]}},
        "turning": {"waves": None, "current": {"speed": 1.0, "over_time": [[0.0, 1.0, 0.0], [9.0, 1.5, 40.0]]}},
    }
    for name, change in seas.items():
        scene = load_scene(MOORED | {"waves": None, "current": None}, **change)
        print(name, "|", report._sea(scene), "|", report._sea(scene, "1 to 9"), "|", report._duration(scene))
    cases = np.arange(report.MOST_CASES + 2)
    data = {
        "cable_length": ("case", 20.0 + cases),
        "status": ("case", np.where(cases % 3, "done", "failed")),
        "criterion": ("case", np.where(cases % 2, "offset", "lean")),
        "criterion_left": ("case", np.where(cases % 5, 12.345 - cases, np.nan)),
        "shortest_life": ("case", np.where(cases % 4, 10.0 ** (cases % 9), np.nan)),
        "shortest_life_of": ("case", np.where(cases % 2, "cable", "other")),
        "cut_steps": ("case", 0.01 * cases / len(cases)),
    }
    swept = xr.Dataset(data, attrs={"varied": "cable.length"})
    told = list(report._cases(swept))
    print(*told[:7], len(told), told[-1])
    few = swept.isel(case=slice(0, report.MOST_VALUES))
    print(
        report._varied(swept),
        report._varied(few),
        report._varied(swept.assign(cable_length=("case", data["status"][1]))),
    )
    parts = [f"line{k:02}" for k in range(figures.MOST_PARTS + 3)]
    many = xr.Dataset(
        {"tension_top": (("time", "cable"), np.outer([1.0, -2.0], np.arange(len(parts)) % 17))}, {"cable": parts}
    )
    notes = {}
    print(figures._largest(many, "cable", notes), *notes)
    print(figures._largest(many.isel(cable=slice(0, figures.MOST_PARTS)), "cable", notes), len(notes))
    both = xr.concat([RECORD.assign_coords(cable=[name]) for name in ("a", "b")], "cable", data_vars="minimal")
    refused(
        lambda: figures.tension(both.isel(time=0), MADE_UP),
        lambda: figures.orbit(RECORD, MADE_UP, buoy="other"),
        lambda: figures.orbit(RECORD.drop_vars("buoy_position"), MADE_UP),
    )


def of_offsets():
    """Warnings of what is drawn, by direction and load."""
    bad = np.array([[1, 0, 0], [1, 1, 0], [1, 0, 1], [0, 0, 0]], dtype=bool).T
    for load, sizes in (("force", [1e3, 2e3, 4e3, 8e3]), ("current", [0.5, 1.0, 1.5, 2.0])):
        for buoys in (1, 2):
            data = {name: (("direction", load), bad[k : k + 1]) for k, name in enumerate(("slack", "under"))}
            data |= {"found": (("direction", load), ~bad[2:]), "place": ("buoy", np.zeros(buoys))}
            print(*offset_record.sentences(xr.Dataset(data, {"direction": [30.0], load: sizes})), sep="\n")
    print(offset_record._circle(np.array([[0.0, np.nan], [1.0, 0.0]])), offset_record._circle(np.eye(2)))


def of_densities():
    """Power densities of a series with a period, and without."""
    t = np.arange(0.0, 60.0, 0.1)
    x = np.sin(2 * np.pi * t / 4.0) + 0.3 * np.cos(2 * np.pi * t / 1.7)
    for period in (None, 4.0, 60.0):
        f, S = after_ramp.density(t, x, period)
        show({f"f {period}": f, f"S {period}": S})


of_summary()
of_numbers()
of_outputs()
of_bars()
of_pages()
of_offsets()
of_densities()
