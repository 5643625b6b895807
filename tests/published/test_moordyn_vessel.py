"""One vessel motion series in this program and in MoorDyn: equal positions at equal times, tensions compared.

Source: MoorDyn from PyPI (the extra `test`; skipped without it), lumped masses and explicit steps.
"""

import itertools
import math
from pathlib import Path

import alone
import numpy as np
import pytest

from dolfbuoy import Session, load_scene, solve_static
from dolfbuoy.formats.moordyn_run import run, silent
from dolfbuoy.formats.to_moordyn import Numerics, export, start_of
from dolfbuoy.model.lines import top_position

END, RAMP = 30.0, 8.0
WAVES = ((0.35, 6.0, 0.0), (0.2, 4.4, 1.3), (0.12, 3.1, 2.1))  # sizes [m], periods [s], phases


def six(t):
    """x, y, z [m], roll, pitch, yaw [deg] of a vessel in three waves."""
    swing = [sum(a * math.sin(2 * math.pi * t / T + e + k) for a, T, e in WAVES) for k in range(6)]
    return [0.8 * swing[0], 0.3 * swing[1], swing[2], 2.0 * swing[3], 3.0 * swing[4], 1.0 * swing[5]]


ROPE = {
    **{"length": 64.0, "elements": 24, "line_density": 15.0, "diameter": 0.06, "axial_stiffness": 4e6},
    **{"normal_drag": 1.2, "added_mass": 1.0, "tangential_drag": 0.05, "position_degree": 2, "tension_degree": 1},
}
SCENE = {
    "sea": {"depth": 300.0},
    "vessel": [
        {
            **{"name": "ship", "position": [0.0, 0.0, 0.0], "heading_deg": 20.0, "ramp": RAMP},
            "fairleads": {"bow": [12.0, 0.0, -2.0], "stern": [-12.0, 2.0, -2.0]},
            "motion": [[0.25 * k, *six(0.25 * k)] for k in range(4 * int(END) + 1)],
        }
    ],
    "cable": [
        ROPE | {"name": "fore", "from": [60.0, 20.0, -42.0], "to": "ship.bow"},
        ROPE | {"name": "aft", "from": [-60.0, -20.0, -42.0], "to": "ship.stern"},
    ],
    "time": {"end": END, "step": 0.02, "scheme": "bdf2"},
}


def judge(t, ours, theirs):
    """Rms differences of the series and of the extremes after the ramp, relative to the range of each line."""
    late = t > RAMP
    a, b = ours[late], theirs[late]
    size = np.ptp(a, axis=0)
    extremes = [np.abs(getattr(a, f)(axis=0) - getattr(b, f)(axis=0)) / size for f in ("max", "min")]
    return np.sqrt(np.mean((a - b) ** 2, axis=0)) / size, np.max(extremes, axis=0)


@pytest.mark.slow
def test_a_vessel_moves_both():
    """[[vessel]] rows here, MoorDyn's points moved along the same spline: within 0.3 % of the range."""
    pytest.importorskip("moordyn")
    scene = load_scene(SCENE)
    record = alone.simulate(scene)
    assert record.cable_tension.values.min() > 0
    written = export(scene, start_of(solve_static(scene)), Numerics(segments=2))
    theirs = run(written, END, per_call=5)
    assert theirs is not None
    for end, name in ((1, "tension_top"), (0, "tension_anchor")):
        ours = np.array([np.interp(theirs.t, record.time, values) for values in record[name].values.T]).T
        rms, extremes = judge(theirs.t, ours, theirs.tension[:, :, end])
        assert rms.max() < 0.003
        assert extremes.max() < 0.01


@pytest.mark.slow
def test_a_caller_drives_both(tmp_path):
    """Ends moved step by step by a caller, in a Session and in MoorDyn."""
    moordyn = pytest.importorskip("moordyn")
    scene, step = load_scene(SCENE), 0.02
    tops = [scene.network.pieces[k].ends[1].top for k in (0, 1)]
    times = step * np.arange(int(12.0 / step) + 1)
    places = [np.concatenate([top_position(top, t) for top in tops]) for t in times]
    held = {key: SCENE[key] for key in ("sea", "time")} | {
        "cable": [line | {"to": places[0][3 * k : 3 * k + 3].tolist()} for k, line in enumerate(SCENE["cable"])]
    }
    ours = []
    with Session(held, driven=["fore.to", "aft.to"]) as s:
        for place in places[1:]:
            s.drive("fore.to", place[:3])
            s.drive("aft.to", place[3:])
            s.step(step)
            ours.append([np.linalg.norm(s.pull(name)) for name in ("fore.to", "aft.to")])
    written = export(scene, start_of(solve_static(scene)), Numerics(segments=2))
    for name, text in written.files.items():
        (tmp_path / name).write_text(text)
    with silent():
        system = moordyn.Create(str(Path(tmp_path) / next(iter(written.files))))
        try:
            moordyn.Init(system, places[0].tolist(), [0.0] * 6)
            theirs = []
            for k, (a, b) in enumerate(itertools.pairwise(places)):
                force = moordyn.Step(system, a.tolist(), ((b - a) / step).tolist(), k * step, step)
                theirs.append(np.linalg.norm(np.reshape(force, (2, 3)), axis=1))
        finally:
            moordyn.Close(system)
    t = step * np.arange(1, len(places))
    rms, _ = judge(t, np.array(ours), np.array(theirs))
    assert rms.max() < 0.005
