"""Places where the equations are rounded off, and how much of the rounding is seen in results.

    .venv/bin/python -m tests.verification.regularisation [SCENE] [--t-end 15]

- |v| in drag is sqrt(v.v + eps^2), eps = 1e-6 m/s (`forms.morison.SMOOTHING_SPEED`): |v|v has no second derivative at
  v = 0, and sqrt none at all.  The force is off by eps^2/(2 v^2) of itself at the speed v.
- The surface cuts the disks of a hull over the height R sin(tilt), and no less than R times `forms.hull.LEAST_TILT`,
  over which the water plane of an upright hull is spread.
- Faces of a hull go under water over R times `forms.hull.FACE_TILT`: added mass of an upright disc would come at once.
- Integrals along the axis of the hull have points whose number is a key of the scene.

Each scale is multiplied by factors, everything else left alone.  Changes are relative to the scale as it is.
"""

from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.api import simulate, solve_static
from dolfbuoy.errors import InputError
from dolfbuoy.forms import hull, morison
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.parts import alone
from dolfbuoy.scene import Scene, load_scene
from dolfbuoy.studies.study import Table, refuse_network

from .script import kept, make, start

#: What is rounded off -> (module, name of its scale, unit, factors).
SCALES = {
    "|v| in drag": (morison, "SMOOTHING_SPEED", "m/s", (1.0, 1e-2, 1e2, 1e4)),
    "cut of an upright hull": (hull, "LEAST_TILT", "rad", (1.0, 0.1, 1e2, 1e4)),
    "faces going under": (hull, "FACE_TILT", "rad", (1.0, 0.2, 0.5, 2.0)),
}
#: Factors of the degree of quadrature where the surface cuts the hull.
DEGREES = (1.0, 9 / 17, 13 / 17, 25 / 17)
POINTS = "points of the hull"


@contextmanager
def scaled(what: str, factor: float):
    """The scale of `what` times `factor` while forms are built."""
    module, name, _, _ = SCALES[what]
    usual = getattr(module, name)
    setattr(module, name, factor * usual)
    try:
        yield factor * usual
    finally:
        setattr(module, name, usual)


def request(scene: str, t_end: float) -> dict:
    """The scene until t_end."""
    scene = load_scene(scene, time__end=t_end)
    refuse_network(scene)
    return {"scene": scene}


def cases(scene: Scene) -> list[dict]:
    """One per scale and factor; those that the scene has nothing of are left out."""
    if scene.sea is None:
        raise InputError("sea: must be given, without it there is neither drag nor a wet hull, and nothing to vary.")
    chosen = {
        what: factors for what, (module, _, _, factors) in SCALES.items() if module is not hull or scene.network.buoys
    }
    if scene.network.buoys:
        chosen[POINTS] = DEGREES
    data = scene.to_dict()
    return [
        {"study": "regularisation", "what": what, "factor": f, "scene": data}
        for what, factors in chosen.items()
        for f in factors
    ]


def evaluate(case: dict) -> dict:
    """Equilibrium and run with one scale changed."""
    scene = load_scene(case["scene"])
    if case["what"] == POINTS:
        degree = round(case["factor"] * scene.solver.hull_quadrature_degree)
        scene, changed = load_scene(case["scene"], solver__hull_quadrature_degree=degree), nullcontext(degree)
    else:
        changed = scaled(case["what"], case["factor"])
    with changed as scale:
        rest = alone(solve_static(scene, comm=MPI.COMM_SELF))
        run = alone(simulate(scene, comm=MPI.COMM_SELF))
    moving, at_rest = map(_followed, (run, rest))
    result = {"scale": scale, "static_height": float(at_rest[2]), "track": moving.values.tolist()}
    if scene.network.cables:
        result |= {"static_tension": float(rest.tension_top), "largest_tension": float(run.tension_top.max())}
    return result


def _followed(record):
    """Position of the buoy, without one of the middle of the cable."""
    if "buoy_position" in record:
        return record.buoy_position
    return record.cable_position.isel(node=record.sizes["node"] // 2)


def compare(rows: list[dict]) -> list[dict]:
    """Rows for the table: changes against the row of the same kind with factor 1."""
    usual = {row["what"]: row for row in rows if row["factor"] == 1.0}
    return [_compared(row, usual[row["what"]]) for row in rows]


def _compared(row, usual):
    result = {k: row[k] for k in ("what", "factor", "scale", "static_height")}
    result["unit"] = SCALES[row["what"]][2] if row["what"] in SCALES else "degree"
    result["change_static_height"] = row["static_height"] - usual["static_height"]
    for key in ("static_tension", "largest_tension"):
        if key in row:
            result |= {key: row[key], f"change_{key}": row[key] / usual[key] - 1}
    here, there = np.array(row["track"]), np.array(usual["track"])
    if here.shape == there.shape:  # a step that was cut makes another instant
        result["change_position"] = float(np.sqrt(((here - there) ** 2).sum(axis=1).mean()))
    return result


COLUMNS = {
    "what": "rounded off",
    "scale": "scale",
    "unit": "",
    "static_tension": "T at rest [N]",
    "static_height": "z at rest [m]",
    "largest_tension": "largest T [N]",
    "change_static_tension": "change",
    "change_static_height": "change of z [m]",
    "change_largest_tension": "change",
    "change_position": "rms change of position [m]",
}


def study(folder: Path, scene: Scene) -> list[Table]:
    """What every scale changes."""
    rows = evaluate_all(evaluate, cases(scene), kept(folder, __file__))
    if rows is None:
        return []
    tilts = f"{hull.LEAST_TILT:g} and {hull.FACE_TILT:g} rad"
    usual = f"Default scales: {morison.SMOOTHING_SPEED:g} m/s, {tilts}."
    title = f"Regularisations, until t = {scene.time.end:g} s; {{folder}}"
    return [Table("regularisation", compare(rows), title, COLUMNS, [usual])]


def main(
    scene: str = typer.Argument("short"),
    t_end: Annotated[float, typer.Option(min=0.0, help="End of the runs [s].")] = 15.0,
    out: Path | None = None,
) -> None:
    """What rounding off |v| and the wet hull changes."""
    make("regularisation", study, out, **request(scene, t_end))


if __name__ == "__main__":
    start(main)
