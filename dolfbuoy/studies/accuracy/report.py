"""`dolfbuoy study accuracy`: all numbers in the README on accuracy and time, from one command.

For each of the paper's scenes, on a shortened run:

- cases that vary the elements at one small step, cases that vary scheme and step on the scene's own elements, and
  combinations in between; all against one reference, as in `work_precision`.  They give the figure and the sentences;
- the error of the schemes alone, against the same elements at a much smaller step;
- the whole run of the paper, by backward Euler and by a second-order scheme on the same elements;

and with them Fig. 2 (static errors of element pairs) and a rigid pendulum, whose free motion a scheme damps.
Cases are stored on disk one by one: an interrupted report continues where it stopped.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...elsewhere import MPI
from ...motion.schemes import make_scheme
from ...motion.simulation import Simulation
from ...parallel.cases import evaluate_all, with_file
from ...results import compare
from ...results import measured as acc
from ...results.compare import Reference
from ...results.folder import enlist
from ...results.measured import Run
from ...results.style import STYLE, matplotlib
from ...scene import Scene, load_scene, settings
from ...scene.sections import SCHEMES
from ...scene.settings import Space, Stepping
from ...writing import refuse_link, write_text
from ..study import Row, Table, save
from ..study import run as run_study
from . import convergence
from . import report_text as text
from . import work_precision as wp
from .report_text import ALPHA, BDF2, BE, PERIOD, SWING

SECOND = (BDF2, ALPHA)


@dataclass(frozen=True)
class Plan:
    """Cases of a scene, run until `end` [s].

    reference: elements and step; its check has half the elements and twice the step.  euler, second: steps of the
    schemes on the scene's own elements, with mesh_step as reference.  spaces: elements of each pair, at space_step by
    generalized-alpha.  mixed: the same for the large steps `mixed_steps` of second-order schemes.  whole: end and step
    of the whole run.
    """

    end: float
    reference: tuple[Space, float]
    mesh_step: float
    euler: tuple[float, ...]
    second: tuple[float, ...]
    spaces: dict[tuple[int, int], tuple[int, ...]]
    space_step: float
    mixed: dict[tuple[int, int], tuple[int, ...]]
    mixed_steps: tuple[float, ...]
    whole: tuple[float, float]
    tolerances: tuple[float, ...] = (0.01, 0.001)
    repeats: int = 3


SHORT = Plan(
    end=20.0,
    reference=(Space(3, 2, 20), 0.005),
    mesh_step=0.005,
    euler=(0.04, 0.02, 0.01, 0.005),
    second=(0.1, 0.05, 0.02, 0.01),
    spaces={(1, 0): (5, 10, 20, 40), (2, 1): (3, 5, 10, 20), (3, 2): (2, 5, 10)},
    space_step=0.02,
    mixed={(2, 1): (5, 10), (3, 2): (5,)},
    mixed_steps=(0.1, 0.05, 0.03),
    whole=(120.0, 0.02),
)
LONG = Plan(
    end=24.0,
    reference=(Space(3, 2, 160), 0.02),
    mesh_step=0.005,
    euler=(0.04, 0.02, 0.01, 0.005),
    second=(0.2, 0.1, 0.05, 0.02),
    spaces={(1, 0): (50, 100, 200, 400), (2, 1): (25, 50, 100, 200), (3, 2): (20, 40, 80)},
    space_step=0.05,
    mixed={(1, 0): (100, 400), (2, 1): (50, 100)},
    mixed_steps=(0.2, 0.1),
    whole=(120.0, 0.04),
)
FULL = {"short": SHORT, "long": LONG}


def _quick(plan: Plan) -> Plan:
    """A small version of a plan, for a quick test."""
    space, step = plan.reference
    return replace(
        plan,
        end=plan.end - 7,
        reference=(Space(space.mu, space.nu, 2 * (space.cells // 5)), 4 * step),
        mesh_step=2 * plan.mesh_step,
        euler=plan.euler[:2],
        second=plan.second[:2],
        spaces={pair: plan.spaces[pair][:2] for pair in ((1, 0), (2, 1))},
        space_step=plan.second[1],
        mixed={(2, 1): plan.mixed[2, 1][:1]},
        mixed_steps=plan.mixed_steps[:1],
        whole=(15.0, plan.second[1]),
        tolerances=plan.tolerances[:1],
        repeats=1,
    )


QUICK = {name: _quick(plan) for name, plan in FULL.items()}


def settings_of(scene: Scene, plan: Plan, largest: float | None) -> list[tuple[Space, Stepping]]:
    """All combinations of elements and steps to be run, without duplicates; largest: of adaptive steps."""
    own = settings.space_of(scene)
    small, mixed = ([Space(*pair, n) for pair in of for n in of[pair]] for of in (plan.spaces, plan.mixed))
    found = [(own, Stepping(BE, h)) for h in plan.euler]
    found += [(own, Stepping(scheme, h)) for scheme in SECOND for h in plan.second]
    found += [(own, Stepping(BDF2, min(plan.second), tolerance, largest)) for tolerance in plan.tolerances]
    found += [(space, Stepping(ALPHA, plan.space_step)) for space in small]
    found += [(s, Stepping(scheme, h)) for s in mixed for scheme in SECOND for h in plan.mixed_steps]
    return list(dict.fromkeys(found))


def fine_cases(scene: Scene, plan: Plan, folder: Path) -> dict[str, Row]:
    """Runs that are not timed: reference and check, own elements at a tiny step, and whole runs.
    The whole runs are by the scene's own scheme and by generalized-alpha."""
    space, step = plan.reference
    own, (end, whole_step) = settings.space_of(scene), plan.whole
    whole = load_scene(scene, **{"time.end": end})
    wanted = {
        "check": (scene, Space(space.mu, space.nu, space.cells // 2), Stepping(ALPHA, 2 * step)),
        "reference": (scene, space, Stepping(ALPHA, step)),
        "mesh": (scene, own, Stepping(ALPHA, plan.mesh_step)),
        "whole_own": (whole, own, settings.stepping_of(scene)),
        "whole": (whole, own, Stepping(ALPHA, whole_step)),
    }
    return {name: with_file(wp.case_of(*how, "reference"), folder, name) for name, how in wanted.items()}


def pendulum(scheme: str, step: float, end: float) -> Row:
    """A scene: an inextensible element of period PERIOD in air, released at rest SWING from its downward vertical."""
    length = 1.5 * 9.81 * (PERIOD / (2 * math.pi)) ** 2  # a rigid rod: omega^2 = 3 g/(2 L)
    tip = [length * math.sin(SWING), 0.0, -length * math.cos(SWING)]
    cable = {"length": length, "line_density": 1.0, "elements": 1, "anchor": [0.0, 0.0, 0.0], "top": {"kind": "free"}}
    time = {"end": end, "step": step, "scheme": scheme}
    return {"cable": cable, "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], tip]}, "time": time}


def evaluate_pendulum(case: Row) -> Row:
    """Fraction of its amplitude that the pendulum has left at the end, and that by linear theory."""
    simulation = Simulation(load_scene(pendulum(case["scheme"], case["step"], case["end"])), MPI.COMM_SELF)
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


def pendulum_cases(quick: bool) -> list[Row]:
    """Every scheme at the paper's step over the paper's run."""
    end = 12.0 if quick else 120.0
    return [{"study": "pendulum", "scheme": scheme, "step": 0.01, "end": end} for scheme in SCHEMES]


def examine(name: str, plan: Plan, folder: Path) -> Row | None:
    """All numbers of a scene, with its figure saved in `folder`; None on all ranks but 0."""
    whole, store = load_scene(name), Path(folder) / "work" / name
    scene, largest = settings.shortened(whole, plan.end), settings.largest_step(whole)
    fine = fine_cases(scene, plan, store)
    references = evaluate_all(wp.evaluate_reference, list(fine.values()), store, wp.structure, wp.work)
    timed = wp.cases(scene, settings_of(scene, plan, largest), fine["reference"], plan.repeats)
    space = settings.space_of(scene)  # runs on its elements are stored
    timed = [with_file(c, store, "own") if (c["pair"], c["cells"]) == (space.pair, space.cells) else c for c in timed]
    found = evaluate_all(wp.evaluate, timed, store, wp.structure, wp.work)
    if found is None or references is None:
        return None
    add_scheme_errors(found, scene, plan, fine["mesh"])
    rows, own = wp.judged(found, scene, fine["check"], fine["reference"])
    messages = wp.notes(rows, own, references[list(fine).index("reference")], MPI.COMM_WORLD.size)
    with matplotlib.rc_context(STYLE):
        save(folder, Table(f"work-precision-{name}", rows, notes=messages, figure=wp.draw(rows, own)))
    return {
        "name": name,
        "end": plan.end,
        "start": acc.window_start(scene),
        "period": settings.period_of(scene),
        "space_step": plan.space_step,
        "repeats": plan.repeats,
        "rows": rows,
        "fronts": wp.front_rows(rows, list(own)),
        "notes": messages,
        "extremes": extremes(scene, fine),
        "whole": plan.whole,
    }


def add_scheme_errors(rows: list[Row], scene: Scene, plan: Plan, mesh: Row) -> None:
    """Add `scheme_error_Q` to the rows on the scene's own elements: against a tiny step on the same elements.

    None if hidden by that run's own error (Richardson, from the smallest step of generalized-alpha).
    """
    truth = Reference(Run.kept(mesh["file"]), acc.window_start(scene))
    kept = [row for row in rows if "file" in row and not row["reason"]]
    names = acc.quantities_of(scene)
    for row in kept:
        run = Run.kept(row["file"])
        row |= {f"scheme_error_{name}": truth.error(run, name).rms for name in names}
    alpha = min((r for r in kept if r["scheme"] == ALPHA), key=lambda row: row["step"])
    ratio = (alpha["step"] / plan.mesh_step) ** 2
    limits = {name: alpha[f"scheme_error_{name}"] / (ratio - 1) for name in names}
    for row in kept:
        for name in names:
            if not compare.resolved(row[f"scheme_error_{name}"], limits[name]):
                row[f"scheme_error_{name}"] = None


def extremes(scene: Scene, fine: dict[str, Row]) -> list[Row]:
    """Largest and smallest values after the ramp in the whole run, by the scene's own and a second-order scheme."""
    start, rows = acc.window_start(scene), []
    own, second = (Run.kept(fine[key]["file"]) for key in ("whole_own", "whole"))
    for name in acc.quantities_of(scene):
        if own.values[name].shape[1] > 1:
            continue
        a, b = (run.values[name][run.t >= start - 1e-9] for run in (own, second))
        row: Row = {"quantity": acc.QUANTITIES[name], "unit": "deg" if name == "cone_angle" else "N"}
        for key, pick in (("largest", np.max), ("smallest", np.min)):
            row |= {f"{key}_own": float(pick(a)), f"{key}_second": float(pick(b))}
        rows.append(row | {"range_own": float(np.ptp(a)), "range_second": float(np.ptp(b))})
    return rows


def run(folder: Path, quick: bool = False) -> None:
    """Compute missing cases, then write report.md, report.json and the figures into `folder`.

    folder/work stores the cases.  quick: a small version, for a quick test; its numbers are not to be quoted.
    """
    folder = Path(folder)
    if MPI.COMM_WORLD.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
    refuse_link(folder / "work")
    cells = (4, 8, 16) if quick else (4, 8, 16, 32)
    static = run_study(convergence.study, folder / "work" / "convergence", figures=(2,), cells=cells).rows
    free = evaluate_all(evaluate_pendulum, pendulum_cases(quick), folder / "work" / "pendulum")
    scenes = [examine(name, plan, folder) for name, plan in (QUICK if quick else FULL).items()]
    if not static:
        return
    facts: Row = {"quick": quick, "machine": acc.machine(), "static": text.static_rows(static["figure2-neumann"])}
    facts |= {"pendulum": free, "scenes": [text.judge(one) for one in scenes if one]}
    facts["recommendations"] = text.recommendations(facts)
    with matplotlib.rc_context(STYLE):
        save(folder, Table("schemes", text.scheme_rows(facts), figure=text.draw(facts["scenes"])))
    enlist(folder, [folder / "report.json", folder / "report.md"], "study")
    write_text(folder / "report.json", json.dumps(facts, indent=1))
    write_text(folder / "report.md", text.markdown(facts))
    print((folder / "report.md").read_text(encoding="utf-8"))
