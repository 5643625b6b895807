"""Where a line that bends leaves the sea bed: a layer that higher degrees resolve, not a jump of the curvature.

    .venv/bin/python -m tests.verification.touchdown_bent [SCENE]

At rest on a smooth bed, with EI = 0 and with an EI whose layer sqrt(EI/H) is a fiftieth of the line: errors of H, of
the shape and of the direction near the touchdown, by pair and elements, against P3-P2 on many.  The pressure of the bed
has a kink where the line lifts; a quadrature of high degree keeps its error below those of the elements.
"""

import math
from pathlib import Path

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.errors import InputError
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.compare import orders
from dolfbuoy.results.tables import groups
from dolfbuoy.scene import Scene, load_scene
from dolfbuoy.scene.settings import Space, Stepping, with_settings
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.studies.accuracy.convergence import Profile, lagrange
from dolfbuoy.studies.study import Table

from .script import kept, make, start

DEGREES, ELEMENTS, FINEST = (1, 2, 3, 4), (20, 40, 80, 160, 320), Space(3, 2, 1280)
QUADRATURE = 24
#: Elements up to which orders are told: beyond, errors are those of the kink.
RESOLVED = 80
#: Length of the layer, and of what is looked at on each side of the touchdown, over that of the line.
LAYER, NEAR = 1 / 50, 1 / 7
#: Places along the line at which shapes are compared.
POINTS = 5000
ERRORS = {"H": "H", "z": "z, rms [m]", "direction": "r', rms"}


def request(scene: str) -> dict:
    """The scene without friction, of one cable that may be pushed."""
    changes = {"seabed.friction": 0.0, "cable.slack": "compressive", "sea.dry_above": False}
    plain = load_scene(scene)
    if plain.seabed is None or len(plain.network.pieces) != 1 or plain.network.buoys:
        raise InputError("seabed: must be given, and one cable: this study follows its touchdown.")
    return {"scene": load_scene(plain, **changes, **{"solver.quadrature_degree": QUADRATURE})}


def cases(scene: Scene) -> list[dict]:
    """Every pair and number of elements with both stiffnesses, and a finest one of each."""
    layer = LAYER * scene.network.pieces[0].section.length
    H = evaluate({"scene": scene.to_dict()})["H"]
    spaces = [Space(mu, mu - 1, n) for mu in DEGREES for n in ELEMENTS]
    found = []
    for EI in (0.0, float(f"{H * layer**2:.1g}")):
        bent = load_scene(scene, **{"cable.bending_stiffness": EI})
        for space in [*spaces, FINEST]:
            fitted = with_settings(bent, space, Stepping(scene.time.scheme, scene.time.step))
            found.append({"EI": EI, "space": [space.mu, space.nu, space.cells], "scene": fitted.to_dict()})
    return found


def evaluate(case: dict) -> dict:
    """H [N], how much lies [m], and z [m] and r' at equal distances along the line."""
    problem = solve_equilibrium(load_scene(case["scene"]), MPI.COMM_SELF)
    try:
        profile, lying = Profile(problem), problem.lines.grounded(problem.system.u).length
        z, direction = at(profile, (np.arange(POINTS) + 0.5) / POINTS)
        H = float(problem.end_force(0, 1)[0])
        return {"H": H, "lying": lying, "z": z[:, 2].tolist(), "direction": direction.tolist()}
    finally:
        problem.destroy()


def at(profile: Profile, share) -> tuple[np.ndarray, np.ndarray]:
    """r and r' there, of the length; all elements are alike."""
    count, h = len(profile.sizes), profile.sizes[0]
    cell = (share * count).astype(int)
    value, slope = lagrange((profile.s[0] - profile.s[0, [0, -1]].mean()) * 2 / h, 2 * (share * count - cell) - 1)
    r = profile.r[cell]
    return np.einsum("ij,ijk->ik", value, r), 2 / h * np.einsum("ij,ijk->ik", slope, r)


def study(folder: Path, scene: Scene) -> list[Table]:
    """Errors and orders, with and without bending."""
    found = evaluate_all(evaluate, wanted := cases(scene), kept(folder, __file__))
    if found is None:
        return []
    length, tables = scene.network.pieces[0].section.length, []
    for EI, mine in groups([one | row for one, row in zip(wanted, found, strict=True)], "EI").items():
        finest, rows = mine[-1], [row_of(row, mine[-1], length) for row in mine[:-1]]
        curves = groups(rows, "pair")
        for curve in curves.values():
            for name in ERRORS:
                orders(curve, name)
        mean = ", ".join(f"{pair} {mean_order(curve, 'direction'):.1f}" for pair, curve in curves.items())
        notes = [f"Order of r' from {ELEMENTS[0]} to {RESOLVED} elements: {mean}"]
        layer = f", layer {math.sqrt(EI / finest['H']):.3g} m" if EI else ""
        title = (
            f"EI = {EI:g} N m2{layer}, {length:g} m of line: errors at the touchdown against {Space(*finest['space'])}"
        )
        shown = {"pair": "pair", "elements": "elements"}
        for name, heading in ERRORS.items():
            shown |= {name: heading, f"order_{name}": "order"}
        tables.append(Table("touchdown-bent" if EI else "touchdown-cable", rows, title.rstrip(", "), shown, notes))
    return tables


def mean_order(curve: list[dict], name: str) -> float:
    """Order from the first row to that of RESOLVED elements."""
    first, last = curve[0], next(row for row in curve if row["elements"] == RESOLVED)
    return math.log(first[name] / last[name]) / math.log(first["h"] / last["h"])


def row_of(row: dict, finest: dict, length: float) -> dict:
    """Errors of a case: of H relative, of the others over what is near the touchdown."""
    share = (np.arange(POINTS) + 0.5) / POINTS
    near = np.abs(share - finest["lying"] / length) < NEAR
    off = {name: np.subtract(row[name], finest[name])[near] for name in ("z", "direction")}
    space = Space(*row["space"])
    return {
        "pair": space.pair, "elements": space.cells, "h": length / space.cells,
        "H": abs(row["H"] / finest["H"] - 1), "z": float(np.sqrt(np.mean(off["z"] ** 2))),
        "direction": float(np.sqrt(np.mean((off["direction"] ** 2).sum(axis=1)))),
    }  # fmt: skip


def main(scene: str = typer.Argument("chain-on-bed", help="With [seabed]."), out: Path | None = None) -> None:
    """Where a line leaves the sea bed, with bending and without."""
    make("touchdown-bent", study, out, **request(scene))


if __name__ == "__main__":
    start(main)
