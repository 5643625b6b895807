"""Energy balance of a run: input is stored or dissipated; the defect is numerical damping of the time scheme.

The semi-discrete equations balance exactly (see `motion.energy`).  So the defect

    D(t) = E(t) - E(0) - int_0^t (power put in) dt'

belongs to the time integration alone and must vanish with the step at the order of its scheme.
"""

import itertools
from collections.abc import Iterable
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from ...elsewhere import MPI
from ...errors import InputError
from ...motion.energy import STORED, Meter
from ...motion.simulation import Simulation
from ...parallel.cases import evaluate_all
from ...results.compare import orders
from ...results.style import PAGE, Figure, new_figure, plain_ticks
from ...results.tables import groups
from ...scene import Scene, load_scene
from ...scene.sections import SCHEMES
from ...scene.settings import everywhere
from ..study import Row, Table

#: Key of a row -> heading.
COLUMNS = {
    "scheme": "scheme",
    "step": "step [s]",
    "top": "top [J]",
    "stream": "moving water [J]",
    "inertia": "water's inertia [J]",
    "buoyancy": "buoyancy [J]",
    "outer": "wind, F_ext [J]",
    "damping": "damping [J]",
    "drag": "drag [J]",
    "bed": "bed [J]",
    "friction": "bed friction [J]",
    "take_off": "take-offs [J]",
    "winch": "winches [J]",
    "stored": "stored [J]",
    "defect": "defect [J]",
    "relative": "",
    "order": "order",
}
SCENES = {"driven": (60.0, (0.04, 0.02, 0.01)), "short": (40.0, (0.04, 0.02, 0.01))}


def load(name: str | Row, t_end: float, step: float, scheme: str) -> Scene:
    """A scene with an exact balance in space: an elastic cable gets one tension per element.

    Cables that go slack allow generalized-alpha only without memory of fast motions.
    """
    scene = load_scene(name, time={"end": t_end, "step": step, "scheme": "backward-euler", "tolerance": None})
    sections = [piece.section for piece in scene.network.pieces]
    radius = {"spectral_radius": 0.0} if any(c.slack == "tension-only" for c in sections) else {}
    scene = load_scene(scene, time={"scheme": scheme} | (radius if scheme == "generalized-alpha" else {}))
    if any(np.isfinite(c.axial_stiffness) for c in sections):
        degrees = everywhere(scene, "cable.position_degree", 1) | everywhere(scene, "cable.tension_degree", 0)
        scene = load_scene(scene, **degrees)
    return scene


def evaluate(case: Row) -> Row:
    """The balance of a run."""
    scene = load(case["scene"], case["t_end"], case["step"], case["scheme"])
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        return balance(simulation, simulation.run(), case["scene"])
    finally:
        simulation.problem.destroy()


def balance(simulation: Simulation, steps: Iterable[Any], name: str) -> Row:
    """Work of each kind [J] over steps from rest, stored energy, and the defect; trapezoidal rule for powers.

    steps: iterator that takes a step each time.  relative: to the work of drag or, without drag, to the total variation
    of the kinetic energy.  Raises InputError if nothing moves, or if something moves at the start.
    """
    meter = Meter(simulation)
    old, t = meter.read(), 0.0
    if old["kinetic"] > 0:
        raise InputError(f"SCENE = '{name}': must start from rest, as the balance does.")
    first, work = old, {name: 0.0 for name in old if name not in STORED}
    drained = swung = 0.0
    for _ in steps:
        new, h = meter.read(), simulation.t - t
        for account in work:
            work[account] += 0.5 * h * (old[account] + new[account])
        drained += 0.5 * h * (abs(old["drag"]) + abs(new["drag"]))
        swung += abs(new["kinetic"] - old["kinetic"])
        old, t = new, simulation.t
    stored = {name: old[name] - first[name] for name in STORED}
    defect = sum(stored.values()) - sum(work.values())
    over = drained or swung
    if over <= 1e-14 * sum(abs(first[name]) for name in STORED):  # rounding
        raise InputError(f"SCENE = '{name}': nothing moves, so that there is no energy to balance.")
    return {**work, **stored, "defect": defect, "relative": abs(defect) / over}


def cases(scene: str | None = None, t_end: float | None = None, steps: Any = None) -> list[Row]:
    """Every scheme with every step, for one scene or for a driven cable and the moored buoy `short`."""
    chosen = {name: SCENES.get(name, (20.0, (0.04, 0.02, 0.01))) for name in ([scene] if scene else SCENES)}
    return [
        {"scene": name, "t_end": t_end or usual_end, "scheme": scheme, "step": step}
        for name, (usual_end, usual_steps) in chosen.items()
        for scheme, step in itertools.product(SCHEMES, steps or usual_steps)
    ]


def _steps(case: Row) -> float:
    return float(case["t_end"] / case["step"])


def study(
    folder: Path, scene: str | None = None, t_end: float | None = None, steps: list[float] | None = None
) -> list[Table]:
    """Tables of the balance of every scene."""
    found, tables = evaluate_all(evaluate, cases(scene, t_end, steps), folder, itemgetter("scene"), _steps), []
    for name, rows in groups(found or [], "scene").items():
        for mine in groups(rows, "scheme").values():
            orders(mine, "relative", "step")
        for row in rows:
            row["order"], row["stored"] = row.pop("order_relative"), sum(row[part] for part in STORED)
        shown = {key: title for key, title in COLUMNS.items() if key == "order" or any(row[key] for row in rows)}
        shown["relative"] = f"defect/{_over(rows)}"
        title = f"Energy of {Path(name).stem} over {rows[0]['t_end']:g} s: stored - put in = defect"
        tables.append(Table(f"energy-{Path(name).stem}", rows, title, shown, figure=draw(rows)))
    return tables


def _over(rows: list[Row]) -> str:
    """Words for the denominator of the relative defects of a scene."""
    return "drag" if any(row["drag"] for row in rows) else "swings of kinetic energy"


def draw(rows: list[Row]) -> Figure:
    """Defect against the step, one line per scheme."""
    figure = new_figure(PAGE / 2, 2.8)
    axes = figure.subplots()
    for scheme, mine in groups(rows, "scheme").items():
        axes.loglog([row["step"] for row in mine], [row["relative"] for row in mine], "o-", label=scheme)
    axes.set(xlabel="step [s]", ylabel=f"defect / {_over(rows)}")
    plain_ticks(axes)
    axes.legend()
    return figure
