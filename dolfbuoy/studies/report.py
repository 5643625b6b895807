"""`dolfbuoy report`: everything the README says about accuracy and time, from one command.

For each of the paper's scenes, on a shortened run:

- cases that vary the elements at one small step, cases that vary scheme and step on the scene's own elements, and
  combinations between; all against one reference, as in `work_precision`.  They make the figure and the sentences;
- the error of the schemes alone: the same elements at a much smaller step are the truth;
- the whole run of the paper, by backward Euler and by a scheme of second order on the same elements;

and beside them Fig. 2 (static errors of element pairs) and a rigid pendulum, whose free motion a scheme damps.
Everything is kept on disk, case by case: an interrupted report goes on where it was.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..motion.schemes import make_scheme
from ..motion.simulation import Simulation
from ..scene import Scene, load_scene
from . import accuracy as acc
from . import convergence
from . import report_text as text
from . import work_precision as wp
from .accuracy import Reference, Space, Stepping
from .common import evaluate_all, save
from .report_text import ALPHA, BDF2, BE

SECOND = (BDF2, ALPHA)
#: Of the pendulum, as in the paper's Sect. 5.1 [s], and how far it swings [rad].
PERIOD, SWING = 5.0, 0.02


@dataclass(frozen=True)
class Plan:
    """What is run of a scene until `end` [s].

    reference: elements and step; its check has half and twice of them.  euler, second: steps of the schemes on the
    scene's own elements, of which mesh_step is the truth.  spaces: at space_step by generalized-alpha.  mixed: elements
    for the large steps `mixed_steps` of the schemes of second order.  whole: end and step of the whole run.
    """

    end: float
    reference: tuple[Space, float]
    mesh_step: float
    euler: tuple[float, ...]
    second: tuple[float, ...]
    tolerances: tuple[float, ...]
    spaces: tuple[Space, ...]
    space_step: float
    mixed: tuple[Space, ...]
    mixed_steps: tuple[float, ...]
    whole: tuple[float, float]
    repeats: int = 3


def _spaces(*pairs):
    return tuple(Space(mu, nu, n) for mu, nu, cells in pairs for n in cells)


FULL = {
    "short": Plan(
        end=20.0,
        reference=(Space(3, 2, 20), 0.005),
        mesh_step=0.005,
        euler=(0.04, 0.02, 0.01, 0.005),
        second=(0.1, 0.05, 0.02, 0.01),
        tolerances=(1e-2, 1e-3),
        spaces=_spaces((1, 0, (5, 10, 20, 40)), (2, 1, (3, 5, 10, 20)), (3, 2, (2, 5, 10))),
        space_step=0.02,
        mixed=_spaces((2, 1, (5, 10)), (3, 2, (5,))),
        mixed_steps=(0.1, 0.05, 0.03),
        whole=(120.0, 0.02),
    ),
    "long": Plan(
        end=24.0,
        reference=(Space(3, 2, 160), 0.02),
        mesh_step=0.005,
        euler=(0.04, 0.02, 0.01, 0.005),
        second=(0.2, 0.1, 0.05, 0.02),
        tolerances=(1e-2, 1e-3),
        spaces=_spaces((1, 0, (50, 100, 200, 400)), (2, 1, (25, 50, 100, 200)), (3, 2, (20, 40, 80))),
        space_step=0.05,
        mixed=_spaces((1, 0, (100, 400)), (2, 1, (50, 100))),
        mixed_steps=(0.2, 0.1),
        whole=(120.0, 0.04),
    ),
}
QUICK = {
    "short": Plan(
        end=13.0,
        reference=(Space(3, 2, 8), 0.02),
        mesh_step=0.01,
        euler=(0.04, 0.02),
        second=(0.1, 0.05),
        tolerances=(1e-2,),
        spaces=_spaces((1, 0, (5, 10)), (2, 1, (3, 5))),
        space_step=0.05,
        mixed=_spaces((2, 1, (5,))),
        mixed_steps=(0.1,),
        whole=(15.0, 0.05),
        repeats=1,
    ),
    "long": Plan(
        end=15.0,
        reference=(Space(3, 2, 40), 0.05),
        mesh_step=0.025,
        euler=(0.1, 0.05),
        second=(0.2, 0.1),
        tolerances=(1e-2,),
        spaces=_spaces((1, 0, (50, 100)), (2, 1, (25, 50))),
        space_step=0.1,
        mixed=_spaces((2, 1, (50,))),
        mixed_steps=(0.2,),
        whole=(15.0, 0.1),
        repeats=1,
    ),
}


# -- cases -------------------------------------------------------------------------------------------------------------


def settings_of(scene: Scene, plan: Plan) -> list[tuple[Space, Stepping]]:
    """All combinations of elements and steps that are run, each once."""
    own = acc.space_of(scene)
    found = [(own, Stepping(BE, h)) for h in plan.euler]
    found += [(own, Stepping(scheme, h)) for scheme in SECOND for h in plan.second]
    found += [(own, Stepping(BDF2, min(plan.second), tolerance)) for tolerance in plan.tolerances]
    found += [(space, Stepping(ALPHA, plan.space_step)) for space in plan.spaces]
    found += [(s, Stepping(scheme, h)) for s in plan.mixed for scheme in SECOND for h in plan.mixed_steps]
    return list(dict.fromkeys(found))


def fine_cases(scene: Scene, plan: Plan, folder: Path) -> dict[str, dict]:
    """The runs that are not timed: the reference and its check, the scene's own elements at a tiny step, and the whole
    run by the scene's own scheme and by generalized-alpha."""
    space, step = plan.reference
    own, (end, whole_step) = acc.space_of(scene), plan.whole
    whole = load_scene(scene, **{"time.end": end})
    wanted = {
        "check": (scene, Space(space.mu, space.nu, space.cells // 2), Stepping(ALPHA, 2 * step)),
        "reference": (scene, space, Stepping(ALPHA, step)),
        "mesh": (scene, own, Stepping(ALPHA, plan.mesh_step)),
        "whole_own": (whole, own, acc.stepping_of(scene)),
        "whole": (whole, own, Stepping(ALPHA, whole_step)),
    }
    store = Path(folder) / "cases"
    return {
        name: wp.case_of(*how, "reference") | {"file": str(store / f"{name}-{how[1].cells}-{how[2].step:g}.npz")}
        for name, how in wanted.items()
    }


def timed_cases(scene: Scene, plan: Plan, reference: dict) -> list[dict]:
    """The cases of the figure; the quantities of those on the scene's own elements are kept."""
    own, store = acc.space_of(scene), Path(reference["file"]).parent
    cases = wp.cases(scene, settings_of(scene, plan), reference, plan.repeats)
    for case in cases:
        if (case["pair"], case["cells"]) == (own.pair, own.cells):
            name = f"{case['scheme']}-{case['tolerance'] or case['step']:g}{'-adaptive' if case['tolerance'] else ''}"
            case["file"] = str(store / f"{name}.npz")
    return cases


def pendulum(scheme: str, step: float, end: float) -> dict:
    """A scene: an inextensible element of period PERIOD in air, released at rest SWING from its downward vertical."""
    length = 1.5 * 9.81 * (PERIOD / (2 * math.pi)) ** 2  # a rigid rod: omega^2 = 3 g/(2 L)
    tip = [length * math.sin(SWING), 0.0, -length * math.cos(SWING)]
    cable = {"length": length, "line_density": 1.0, "elements": 1, "anchor": [0.0, 0.0, 0.0], "top": {"kind": "free"}}
    time = {"end": end, "step": step, "scheme": scheme}
    return {"cable": cable, "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], tip]}, "time": time}


def evaluate_pendulum(case: dict) -> dict:
    """Share of its amplitude that the pendulum has left at the end, and that of the linear theory."""
    simulation = Simulation(load_scene(pendulum(case["scheme"], case["step"], case["end"])), wp.MPI.COMM_SELF)
    try:
        for _ in simulation.run():
            pass
        tip = simulation.problem.lines.top_dofs()
        x, _, z = simulation.system.u[tip]
        u, _, w = simulation.line_velocity[tip]
        angle, rate = math.atan2(x, -z), (x * w - z * u) / (x * x + z * z)
    finally:
        simulation.problem.destroy()
    omega = 2 * math.pi / PERIOD
    factor = make_scheme(case["scheme"]).amplification(omega, case["step"])
    left = math.hypot(angle, rate / omega) / SWING
    return {"remaining": left, "theory": abs(factor) ** round(case["end"] / case["step"])}


def pendulum_cases(quick: bool) -> list[dict]:
    """Every scheme at the paper's step over the paper's run."""
    end = 12.0 if quick else 120.0
    return [{"study": "pendulum", "scheme": scheme, "step": 0.01, "end": end} for scheme in acc.SCHEMES]


# -- judgement of one scene --------------------------------------------------------------------------------------------


def examine(name: str, plan: Plan, folder: Path) -> dict | None:
    """All numbers of a scene, with its figure saved in `folder`; None on all ranks but 0."""
    scene, store = acc.shortened(load_scene(name), plan.end), Path(folder) / "work" / name
    fine = fine_cases(scene, plan, store)
    evaluate_all(wp.evaluate_reference, list(fine.values()), store, wp.structure)
    found = evaluate_all(wp.evaluate, timed_cases(scene, plan, fine["reference"]), store, wp.structure)
    if found is None:
        return None
    own = wp.reference_errors(scene, fine["check"], fine["reference"])
    add_scheme_errors(found, scene, plan, fine["mesh"])
    rows = wp.mark([{k: v for k, v in row.items() if k not in wp.HIDDEN} for row in found], own)
    said = wp.notes(rows, own, fine["reference"], wp.MPI.COMM_WORLD.size)
    save(folder, f"work-precision-{name}", rows, wp.draw(rows, own), said)
    return {
        "name": name,
        "end": plan.end,
        "start": acc.window_start(scene),
        "period": acc.period_of(scene),
        "space_step": plan.space_step,
        "repeats": plan.repeats,
        "rows": rows,
        "fronts": wp.front_rows(rows, own),
        "notes": said,
        "extremes": extremes(scene, fine),
        "whole": plan.whole,
    }


def add_scheme_errors(rows: list[dict], scene: Scene, plan: Plan, mesh: dict) -> None:
    """Add `scheme_error_Q` to the rows on the scene's own elements: against a tiny step on the same elements.

    None where that run's own error (Richardson, from the smallest step of generalized-alpha) hides it.
    """
    truth = Reference(wp.read_run(mesh["file"]), acc.window_start(scene))
    kept = [row for row in rows if "file" in row and not row["reason"]]
    names = acc.quantities_of(scene)
    for row in kept:
        run = wp.read_run(row["file"])
        row |= {f"scheme_error_{name}": truth.error(run, name).rms for name in names}
    alpha = min((r for r in kept if r["scheme"] == ALPHA), key=lambda row: row["step"])
    ratio = (alpha["step"] / plan.mesh_step) ** 2
    limits = {name: alpha[f"scheme_error_{name}"] / (ratio - 1) for name in names}
    for row in kept:
        for name in names:
            if not acc.resolved(row[f"scheme_error_{name}"], limits[name]):
                row[f"scheme_error_{name}"] = None


def extremes(scene: Scene, fine: dict[str, dict]) -> list[dict]:
    """Largest and smallest value after the ramp in the whole run: by the scene's own scheme, and of second order."""
    start, rows = acc.window_start(scene), []
    own, second = (wp.read_run(fine[key]["file"]) for key in ("whole_own", "whole"))
    for name in acc.quantities_of(scene):
        if own.values[name].ndim > 1:
            continue
        a, b = (run.values[name][run.t >= start - 1e-9] for run in (own, second))
        row = {"quantity": acc.QUANTITIES[name], "unit": "deg" if name == "cone_angle" else "N"}
        for key, pick in (("largest", np.max), ("smallest", np.min)):
            row |= {f"{key}_own": float(pick(a)), f"{key}_second": float(pick(b))}
        rows.append(row | {"range_own": float(np.ptp(a)), "range_second": float(np.ptp(b))})
    return rows


# -- command -----------------------------------------------------------------------------------------------------------


def run(folder: Path, quick: bool = False) -> None:
    """Compute what is missing, then write report.md, report.json and the figures into `folder`.

    folder/work keeps the cases.  quick: a small version, to see that all works; its numbers are not worth quoting.
    """
    folder = Path(folder)
    if wp.MPI.COMM_WORLD.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
    static = convergence.run(folder / "work" / "convergence", (2,), (4, 8, 16) if quick else (4, 8, 16, 32))
    free = evaluate_all(evaluate_pendulum, pendulum_cases(quick), folder / "work" / "pendulum")
    scenes = [examine(name, plan, folder) for name, plan in (QUICK if quick else FULL).items()]
    if static is None:
        return
    facts = {"quick": quick, "machine": text.machine(), "static": text.static_rows(static[2, "Neumann"])}
    facts |= {"pendulum": free, "scenes": [text.judge(facts_of_scene) for facts_of_scene in scenes]}
    facts["recommendations"] = text.recommendations(facts)
    save(folder, "schemes", text.scheme_rows(facts), text.draw(facts["scenes"]))
    (folder / "report.json").write_text(json.dumps(facts, indent=1))
    (folder / "report.md").write_text(text.markdown(facts))
    print((folder / "report.md").read_text())
