"""The step an explicit time scheme would need, beside the implicit one: Sect. 4.1.

    .venv/bin/python -m tests.verification.explicit_limit [SCENE]

A straight cable without loads moves along itself by rho0 u_tt = (EA u')' (22), with elements M u_tt + K u = 0 (23),
the sign of K being that of a stiffness.  Its fastest motion has omega^2 = the largest lambda of K x = lambda M x, and
an explicit scheme is stable only for dt <= C/omega: C = 2 (central difference), 2 sqrt(2) (classical Runge-Kutta),
0 (forward Euler, unstable for every step).  On a mesh lambda is at most that of its elements one by one,

    lambda <= c_mu EA/(rho0 H^2),    c_1 = 12 (24),

reached by a cable with free ends; c_mu is the largest lambda of one free element with EA = rho0 = H = 1.  For P1 on N
equal elements lambda rho0 H^2/EA = 6 (1 - cos x)/(2 + cos x), with a lumped mass 2 (1 - cos x); x = pi (free-free),
(2N-1) pi/(2N) (fixed-free), (N-1) pi/N (fixed-fixed).
"""

import math
from operator import itemgetter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import ufl
from dolfinx import fem
from mpi4py import MPI
from scipy.linalg import eigh

from dolfbuoy.errors import InputError
from dolfbuoy.meshes import cable_nodes
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.tables import groups
from dolfbuoy.scene import load_scene
from dolfbuoy.solver import compat
from dolfbuoy.studies.study import Table, refuse_network

from .script import kept, make, start

DEGREES = (1, 2, 3, 4)
SIZES = (1, 2, 4, 10, 20, 100)
ENDS = ("free-free", "fixed-free", "fixed-fixed")
#: C of dt <= C/omega.
SCHEMES = {"central": 2.0, "RK4": 2 * math.sqrt(2)}

#: The example of Sect. 4.1 and the cables of Sect. 5, with the step of Sect. 5.
PAPER = {
    name: {"length": L, "elements": n, "rho0": rho0, "EA": 2.3e8, "grading": 1.0, "degree": 1, "end": "fixed-free"}
    | {"step": 0.01}
    for name, L, n, rho0 in (("Sect. 4.1", 1000.0, 100, 27.6), ("short", 22.0, 20, 27.6), ("long", 750.0, 200, 9.3))
}


def matrices(nodes, degree: int, rho0: float, EA: float):
    """Dense (K, M, s): K = EA (u', v'), M = rho0 (u, v), and s of every row."""
    mesh = compat.interval_mesh(MPI.COMM_SELF, nodes)
    V = compat.function_space(mesh, compat.element(mesh, "P", degree))
    stiffness, density = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    a = compat.compile_form((stiffness * u.dx(0) * v.dx(0) + density * u * v) * ufl.dx)
    stiffness.value = EA
    K = fem.assemble_matrix(a).to_dense()
    stiffness.value, density.value = 0.0, rho0
    return K, fem.assemble_matrix(a).to_dense(), V.tabulate_dof_coordinates()[:, 0]


def largest(K, M, s, end: str, lumped: bool = False) -> float | None:
    """Largest lambda of K x = lambda M x with ends as in `ENDS`; None if nothing is free to move."""
    fixed = {"free-free": [], "fixed-free": [s.min()], "fixed-fixed": [s.min(), s.max()]}[end]
    keep = ~np.isin(s, fixed)
    if not keep.any():
        return None
    M = np.diag(M.sum(axis=1)) if lumped else M
    last = int(keep.sum()) - 1
    pair = (matrix[np.ix_(keep, keep)] for matrix in (K, M))
    return float(eigh(*pair, eigvals_only=True, subset_by_index=(last, last))[0])


def element_constant(degree: int) -> float:
    """c_mu of the bound (24)."""
    return largest(*matrices([0.0, 1.0], degree, 1.0, 1.0), "free-free")


def eigenvalues(case: dict) -> dict:
    """lambda rho0 H^2/EA of N equal elements for all ends, P1 with lumped mass too."""
    n = case["elements"]
    K, M, s = matrices(np.linspace(0.0, n, n + 1), case["degree"], 1.0, 1.0)
    result = {_key(end): largest(K, M, s, end) for end in ENDS}
    if case["degree"] == 1:
        result |= {f"{_key(end)}_lumped": largest(K, M, s, end, lumped=True) for end in ENDS}
    return result


def _key(end):
    return end.replace("-", "_")


def steps(case: dict) -> dict:
    """Largest frequencies [rad/s] and explicit steps [s] of a cable on its own mesh, with elements of one degree."""
    nodes = cable_nodes(case["length"], case["elements"], case["grading"])
    H, wave = float(np.diff(nodes).min()), math.sqrt(case["EA"] / case["rho0"])
    K, M, s = matrices(nodes, case["degree"], case["rho0"], case["EA"])
    bound = math.sqrt(4.0 if case["lumped"] else element_constant(case["degree"])) * wave / H
    true = math.sqrt(largest(K, M, s, case["end"], case["lumped"]))
    result = {"H": H, "wave_speed": wave, "omega_12": math.sqrt(12) * wave / H}
    result |= {"omega_bound": bound, "omega_true": true}
    for scheme, C in SCHEMES.items():
        result |= {f"dt_{scheme}": C / bound, f"dt_true_{scheme}": C / true}
        result[f"steps_{scheme}"] = case["step"] * bound / C if case["step"] else None
    return result


def evaluate(case: dict) -> dict:
    """Results of either kind of case."""
    return (eigenvalues if case["study"] == "eigenvalues" else steps)(case)


def cable_of(scene: str) -> dict:
    """What the limit depends on, from the scene; a cable that hangs from a buoy counts as free there.

    The mass of the buoy at the end only lowers the frequencies.  Raises InputError without an elastic cable.
    """
    loaded = load_scene(scene)
    refuse_network(loaded)
    if not loaded.network.pieces:
        raise InputError("cable: must be given, without it there is no explicit limit to speak of.")
    (piece,) = loaded.network.pieces
    c, top = piece.section, piece.ends[1]
    if math.isinf(c.axial_stiffness):
        raise InputError(
            "cable.axial_stiffness = inf: waves along an inextensible cable are infinitely fast and no explicit step "
            "is stable; give a finite axial_stiffness."
        )
    held = top.held
    elements = c.elements if isinstance(c.elements, int) else [list(segment) for segment in c.elements]
    cable = {"length": c.length, "elements": elements, "grading": c.grading, "rho0": c.line_density}
    cable |= {"EA": c.axial_stiffness, "degree": c.position_degree, "end": "fixed-fixed" if held else "fixed-free"}
    return cable | {"step": loaded.time.step if loaded.time else None}


def cases(cables: dict[str, dict], sizes=SIZES, degrees=DEGREES) -> list[dict]:
    """The eigenvalues for every degree, and the steps of every cable with each degree on its own mesh."""
    result = [{"study": "eigenvalues", "degree": k, "elements": n} for k in degrees for n in sizes]
    for name, cable in cables.items():
        for degree, lumped in [(k, False) for k in degrees] + [(1, True)]:
            own = degree == cable["degree"] and not lumped
            result.append({"study": "steps", "scene": name, **cable, "degree": degree, "lumped": lumped, "own": own})
    return result


def notes(eigen: list[dict], limits: list[dict]) -> list[str]:
    """The answer in words."""
    constants = {row["degree"]: row["free_free"] for row in eigen}
    sharp, per_node = (
        ", ".join(f"P{k} {c / k**power:.{digits}g}" for k, c in constants.items()) for power, digits in ((0, 4), (2, 3))
    )
    said = [
        f"Largest lambda rho0 H^2/EA: {sharp}.  The 12 of (24) is the sharp bound for P1 alone (lumped: 4).",
        f"With the distance H/k of the nodes instead of H: {per_node}.  Higher degrees pay even for the same nodes.",
        "An explicit scheme needs this step whatever it resolves, and its steps are cheap only with a lumped mass; "
        "forward Euler is unstable for every step, and for EA = inf every explicit scheme is.  Drag and the coupling "
        "with the buoy are not counted.",
    ]
    return said + [_own(row) for row in limits if row["own"] and row["step"]]


def _own(row):
    explicit = f"{row['dt_central']:.2g} s (central difference) or {row['dt_RK4']:.2g} s (RK4, four evaluations)"
    counts = f"{row['steps_central']:.0f} or {row['steps_RK4']:.0f} explicit steps for one implicit step"
    return f"{row['scene']} ({row['element']}): explicit dt <= {explicit}, implicit dt = {row['step']:.2g} s: {counts}."


EIGENVALUES = {"element": "element", "elements": "N"} | {_key(end): end for end in ENDS}
EIGENVALUES |= {f"{_key(end)}_lumped": f"{end}, lumped" for end in ENDS}
STEPS = {
    "scene": "cable",
    "element": "element",
    "H": "H [m]",
    "omega_12": "(24) with 12 [1/s]",
    "omega_bound": "bound [1/s]",
    "omega_true": "true [1/s]",
    "dt_central": "dt, central [s]",
    "dt_RK4": "dt, RK4 [s]",
    "step": "implicit dt [s]",
    "steps_central": "steps for one",
}


def study(folder: Path, cables: dict[str, dict]) -> list[Table]:
    """The eigenvalues, and the steps of every cable."""
    rows = evaluate_all(evaluate, cases(cables), kept(folder, __file__), itemgetter("degree"))
    if rows is None:
        return []
    for row in rows:
        row["element"] = f"P{row['degree']}" + (" lumped" if row.get("lumped") else "")
    eigen, limits = groups(rows, "study").values()
    title = "Largest frequency and explicit step; steps for one implicit step by central difference"
    return [
        Table("eigenvalues", eigen, "Largest lambda rho0 H^2/EA; the bound (24) is 12", EIGENVALUES),
        Table("explicit-limit", limits, title, STEPS, notes(eigen, limits)),
    ]


def main(
    scene: Annotated[str | None, typer.Argument(help="Default: the cables of the paper.")] = None,
    out: Path | None = None,
) -> None:
    """Step an explicit method would need, Eq. (24), beside the implicit one."""
    make("explicit-limit", study, out, cables=PAPER if scene is None else {scene: cable_of(scene)})


if __name__ == "__main__":
    start(main)
