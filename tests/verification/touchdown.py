"""Where a line leaves the sea bed: what elements and steps its tensions need, and what friction laws make of them.

    .venv/bin/python -m tests.verification.touchdown [SCENE] [--t-end 40]

Errors are against the finest run of the same kind; of steps for the line without damping, in which waves are damped
by the scheme only, and with 2 % of critical damping.  A law that is regularised by the velocity is that of the scene
with a memory of one step only, f = mu p v/v_0 below v_0 = ell/step: at rest it lets go.
"""

import itertools
import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.errors import InputError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.compare import percent
from dolfbuoy.results.tables import groups
from dolfbuoy.scene import Scene, load_scene
from dolfbuoy.scene.settings import Space, Stepping, period_of, ramp_of, space_of, with_settings
from dolfbuoy.studies.study import Table

from .script import kept, make, start

PAIRS = ((1, 0), (2, 1), (3, 2))
ELEMENTS, FINEST = (10, 14, 20, 28, 40, 56, 80, 160, 320), Space(3, 2, 640)
#: Steps of a period, and the finest; on elements that do not limit them.
STEPS, MOST_STEPS, STEPPED = (25, 50, 100, 200, 400, 800), 3200, Space(3, 2, 160)
DAMPED = 0.02  # of critical damping, in the first axial mode
SCHEMES = ("backward-euler", "bdf2")
VELOCITY = "by velocity"
#: Friction law -> changes of the scene's [seabed].
LAWS = {
    "none": {"seabed.friction": 0.0},
    "spring and slider": {},
    "stick length / 10": {"seabed.stick_length": 0.1},
    "pulled at the start": {"seabed.start": "pulled"},
    VELOCITY: {},
}
REST = 60.0  # s
ACCURACIES = (0.01, 0.001)


def request(scene: str, t_end: float) -> dict:
    """The scene until t_end."""
    chosen = load_scene(scene, time__end=t_end, time__tolerance=None)
    one = len(chosen.network.pieces) == 1 and not chosen.network.buoys
    if chosen.seabed is None or not one or period_of(chosen) is None:
        raise InputError(
            "seabed: must be given, and one cable whose top is prescribed: this study follows its touchdown."
        )
    return {"scene": chosen}


def _scene(scene, space, stepping, **changes):
    return with_settings(load_scene(scene, **changes), space, stepping).to_dict()


def cases(scene: Scene) -> list[dict]:
    """Elements of each pair, steps of each scheme, laws; and a finest run of the first two."""
    stepping, space, period = Stepping(scene.time.scheme, scene.time.step), space_of(scene), period_of(scene)
    found = []
    for mu, nu in PAIRS:
        found += [{"kind": "elements", "space": [mu, nu, n]} for n in ELEMENTS]
    found.append({"kind": "elements", "space": [FINEST.mu, FINEST.nu, FINEST.cells], "finest": True})
    for case in found:
        case |= {"scene": _scene(scene, Space(*case["space"]), stepping)}
    for line, changes in _lines(scene).items():
        for scheme, count in [*((s, n) for s in SCHEMES for n in STEPS), ("bdf2", MOST_STEPS)]:
            chosen = Stepping(scheme, period / count)
            case = {"kind": "steps", "line": line, "scheme": scheme, "step": chosen.step, "finest": count == MOST_STEPS}
            found.append(case | {"scene": _scene(scene, STEPPED, chosen, **changes)})
    for law, changes in LAWS.items():
        changed = dict(changes)
        if "seabed.stick_length" in changed:
            usual = scene.seabed.stick_length or min(1e-3 * scene.sea.depth, 0.05)
            changed["seabed.stick_length"] *= usual
        found.append({"kind": "laws", "law": law, "scene": _scene(scene, space, stepping, **changed)})
    return found


def _lines(scene):
    """Name -> changes of the line: without damping, and with DAMPED of critical; none where no strain can be damped."""
    c = scene.network.pieces[0].section
    if not (isinstance(c.axial_stiffness, float) and math.isfinite(c.axial_stiffness)):
        return {"": {}}
    critical = 2 * c.length * math.sqrt(c.axial_stiffness * c.line_density) / math.pi
    return {"": {"cable__damping": 0.0}, " damped": {"cable__damping": DAMPED * critical}}


def evaluate(case: dict) -> dict:
    """Tensions at equal times after the ramp, at rest before the run, and if friction laws are compared after it."""
    scene = load_scene(case["scene"])
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        forgets = case.get("law") == VELOCITY
        rest, rows = _tensions(simulation), []
        for _ in simulation.run():
            _forget(simulation, forgets)
            rows.append((simulation.t, *_tensions(simulation)))
        result = {"static_top": rest[0], "static_anchor": rest[1], "failed": simulation.control.failed}
        t, top, anchor = np.array(rows).T
        start = min(ramp_of(scene), 0.5 * scene.time.end)
        at = np.linspace(start, scene.time.end, 401)
        result |= {"top": np.interp(at, t, top).tolist(), "anchor": np.interp(at, t, anchor).tolist()}
        late = t >= start
        result |= {"top_peak": top[late].max(), "anchor_peak": anchor[late].max(), "anchor_least": anchor[late].min()}
        if case["kind"] == "laws":
            result["held"] = _held(simulation, forgets)
        return {key: value if isinstance(value, list) else float(value) for key, value in result.items()}
    finally:
        simulation.problem.destroy()


def _tensions(simulation):
    return float(np.linalg.norm(simulation.end_tension)), simulation.problem.anchor_tension()


def _forget(simulation, forgets):
    if forgets:
        simulation.problem.lines.begin(simulation.system.u)


def _held(simulation, forgets):
    """T_anchor after the top has rested where it is [N]."""
    simulation.stop_ends()
    for _ in simulation.advance(simulation.t + REST):
        _forget(simulation, forgets)
    return simulation.problem.anchor_tension()


# -- tables ------------------------------------------------------------------------------------------------------------


ERRORS = {"top": "T_top", "anchor": "T_anchor", "top_peak": "its peak", "anchor_peak": "its peak"}
FAILED = {"failed": "failed steps"}
AT_REST = {"static_top": "T_top at rest", "static_anchor": "T_anchor at rest"}
COLUMNS = {
    "elements": {"pair": "pair", "elements": "elements"} | AT_REST | ERRORS | FAILED,
    "steps": {"scheme": "scheme", "step": "step [s]"} | ERRORS | FAILED,
    "laws": {
        "law": "friction",
        "static_anchor_N": "T_anchor at rest [N]",
        "top_peak_N": "largest T_top [N]",
        "anchor_peak_N": "largest T_anchor [N]",
        "anchor_least_N": "least [N]",
        "held_N": "T_anchor after a rest [N]",
    },
}


def study(folder: Path, scene: Scene) -> list[Table]:
    """Errors over elements and steps, with what 1 % and 0.1 % need; laws side by side."""
    rows = evaluate_all(evaluate, cases(scene), kept(folder, __file__))
    if rows is None:
        return []
    kinds = groups(rows, "kind")
    elements = _errors(kinds["elements"])
    steps = [row for mine in groups(kinds["steps"], "line").values() for row in _errors(mine)]
    for row in elements:
        row |= {"pair": str(Space(*row["space"]).pair), "elements": row["space"][2]}
    for row in steps:
        row["scheme"] += row.pop("line")
    space, stepped, finest = (str(s).rstrip(", ") for s in (space_of(scene), STEPPED, FINEST))
    titles = {
        "elements": f"Elements, step {scene.time.step:g} s, until t = {scene.time.end:g} s: errors against {finest}; "
        "rms over the range after the ramp; {folder}",
        "steps": f"Steps, {stepped}: errors against bdf2 with {period_of(scene) / MOST_STEPS:g} s of the same line; "
        f"damped: {percent(DAMPED)} of critical in its first axial mode",
        "laws": f"Friction laws, {space}; the top then rests for {REST:g} s",
    }
    moving = {"top": "T_top", "anchor": "T_anchor", "top_peak": "largest T_top", "anchor_peak": "largest T_anchor"}
    notes = {
        "elements": _needed(elements, "pair", "elements", 1, AT_REST | moving),
        "steps": _needed(steps, "scheme", "step", -1, moving),
    }
    found = {"elements": elements, "steps": steps, "laws": [_law(row) for row in kinds["laws"]]}
    return [Table(f"touchdown-{kind}", found[kind], titles[kind], COLUMNS[kind], notes.get(kind, [])) for kind in found]


def _errors(rows):
    """Errors of every row but the finest, relative: values at rest, rms over the range, peaks."""
    finest, found = next(row for row in rows if row.get("finest")), []
    for row in (row for row in rows if not row.get("finest")):
        errors = {key: row[key] / finest[key] - 1 for key in ("static_top", "static_anchor", "top_peak", "anchor_peak")}
        for key in ("top", "anchor"):
            there = np.array(finest[key])
            errors[key] = float(np.sqrt(np.mean((np.array(row[key]) - there) ** 2)) / np.ptp(there))
        kept = {key: row[key] for key in ("kind", "space", "line", "scheme", "step", "failed") if key in row}
        found.append(kept | errors)
    return found


def _law(row):
    names = {"static_anchor": "static_anchor_N", "held": "held_N"}
    names |= {key: f"{key}_N" for key in ("top_peak", "anchor_peak", "anchor_least")}
    return {"law": row["law"]} | {name: row[key] for key, name in names.items()}


def _needed(rows, by, size, sign, quantities):
    """Sentences: the coarsest of each kind from which on the error stays below an accuracy."""
    said = []
    for (key, name), accuracy in itertools.product(quantities.items(), ACCURACIES):
        found = []
        for kind, mine in groups(rows, by).items():
            finest_first = sorted(mine, key=lambda row: -sign * row[size])
            found.append(f"{kind} {_coarsest(finest_first, key, size, accuracy)}")
        said.append(f"{name} to {percent(accuracy)}: {', '.join(found)}")
    return said


def _coarsest(finest_first, key, size, accuracy):
    good = list(itertools.takewhile(lambda row: abs(row[key]) <= accuracy, finest_first))
    return f"{good[-1][size]:g}" if good else "none of these"


def main(
    scene: str = typer.Argument("chain-on-bed", help="With [seabed]."),
    t_end: Annotated[float, typer.Option(min=0.0, help="End of the runs [s].")] = 40.0,
    out: Path | None = None,
) -> None:
    """Where a line leaves the sea bed: elements, steps, friction laws."""
    make("touchdown", study, out, **request(scene, t_end))


if __name__ == "__main__":
    start(main)
