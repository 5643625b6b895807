"""Folds and snaps under both slack laws.

Source: closed forms, two independent programs.
"""

from functools import partial

import numpy as np
import pytest
from hard import SHORT, UNIT, ending, hanging, run, said, sound_run, static, with_
from mpi4py import MPI

from dolfbuoy.api import solve_static
from dolfbuoy.results.summary import static_warnings
from dolfbuoy.scene import load_scene

LAWS = ("compressive", "tension-only")


def test_fold_unresolved(found):
    """Ends at (0, 0, 0) and (0.01, 0, 0.8), a fold of 0.0015 in elements of 0.05, both slack laws.  Must show: the
    unresolved fold is said; T >= 0 with tension-only; compression said with the other; the top tension right to the
    element's weight.
    """
    scene = with_(UNIT, cable={"position_degree": 1, "tension_degree": 0}, cable__top__position=[0.01, 0.0, 0.8])
    for law in LAWS:
        case = with_(scene, cable__slack=law)
        record, words = ending(case, partial(solve_static, comm=MPI.COMM_SELF))
        if record is None:
            found.remark(law)
            found.says(words, "DIVERGED")
            continue
        off = abs(record.tension_top.item() - hanging(0.01, 0.8)[1])
        found.below(f"{law}: top tension off by", off, 0.05, " w L")
        found.says(static_warnings(record, load_scene(case)), "A fold of the cable is not resolved")
        smallest = record.attrs["smallest_tension_N"]
        if law == "tension-only":
            found.below(f"{law}: -min T", -smallest, 1e-9)
        elif smallest <= 0:
            found.says(said(case), "compressed")


@pytest.mark.slow
def test_straight_tension_only(found):
    """A run that starts on the straight chord, 14 % too short, tension-only.  Must show: nothing springs: slack at
    once, T >= 0 throughout, the catenary at last.
    """
    scene = with_(SHORT, sea__depth=40.0, cable={"anchor": [0.0, 0.0, -20.0], "normal_drag": 1.2})
    scene = with_(scene, cable={"slack": "tension-only"}, time={"end": 60.0, "step": 0.05})
    scene = with_(scene, cable__top={"kind": "fixed", "position": [15.0, 0.0, -20.0 + np.sqrt(19**2 - 15**2)]})
    rest = static(scene)
    record = sound_run(found, with_(scene, initial={"kind": "straight"}))
    found.below("-min T", -float(record.cable_tension[1:].min()), 1e-6, " N")
    off = np.abs(record.cable_position[-1] - rest.cable_position.values).max()
    found.below("from the catenary after 60 s", off, 1e-3, " m")


@pytest.mark.slow("expensive")
def test_snap_load(found):
    """`driven-slack` for 30 s as shipped and tension-only: the lower part goes slack and snaps in every period.  Must
    show: 8850 +- 5 N at the top (two independent programs) within 1 %, at most 160 elements, no artificial damping.
    """
    for law in LAWS:
        scene = with_(load_scene("driven-slack").to_dict(), cable={"slack": law, "elements": 80}, time={"end": 30.0})
        record = run(with_(scene, time={"step": 0.005, "scheme": "bdf2"}))
        last = record.sel(time=slice(15.0, None))
        found.finite(record)
        found.close(f"{law}: largest top tension of the last 15 s", last.tension_top.max(), 8850.0, 1e-2, " N")
        found.remark(f"at the anchor {float(last.tension_anchor.max()):.5g} N (others: 5256 +- 10)")
        found.remark(f"smallest element tension {float(record.cable_tension.min()):.4g} N")
