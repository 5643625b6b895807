"""The step an explicit time scheme would need: Sect. 4.1.

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

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from scipy.linalg import eigh

from ...errors import InputError
from ...meshes import cable_nodes
from ...results.style import COLORS, PAGE, PALETTE, new_figure
from ...results.tables import groups
from ...scene import load_scene
from ...solver import compat
from ..declaration import declared
from ..study import Table, refuse_network

WORDS = declared(__file__)
STRUCTURE = ("degree",)

DEGREES = (1, 2, 3, 4)
SIZES = (1, 2, 4, 10, 20, 100)
ENDS = ("free-free", "fixed-free", "fixed-fixed")
#: C of dt <= C/omega.
SCHEMES = {"central": 2.0, "RK4": 2 * math.sqrt(2)}

#: The example of Sect. 4.1 and the cables of Sect. 5, with the step of Sect. 5.
PAPER = {name: WORDS.data["all"] | cable for name, cable in WORDS.data["cables"].items()}


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


def request(scene: str | None) -> dict:
    """The cables of the paper, or that of a scene."""
    return {"cables": PAPER if scene is None else {str(scene): cable_of(scene)}}


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
    said = [
        WORDS.say("constants", numbers=", ".join(f"P{k} {c:.4g}" for k, c in constants.items())),
        WORDS.say("per_node", numbers=", ".join(f"P{k} {c / k**2:.3g}" for k, c in constants.items())),
        WORDS.say("explicit"),
    ]
    return said + [WORDS.say("own", **row) for row in limits if row["own"] and row["step"]]


def figure(eigen: list[dict], limits: list[dict]):
    """Largest eigenvalues over N beside the bound (24); explicit steps beside the implicit ones."""
    figure = new_figure(PAGE, 3.3)
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1, 1.1]})
    _draw_eigenvalues(left, eigen)
    _draw_steps(right, limits)
    return figure


def _draw_eigenvalues(axes, rows):
    lines = dict(zip(ENDS, ("-", "--", ":"), strict=True))
    for (k, group), color in zip(groups(rows, "degree").items(), PALETTE, strict=False):
        for end, line in lines.items():
            found = [(row["elements"], row[_key(end)]) for row in group if row[_key(end)]]
            label = end if k == 1 else None
            axes.plot(*zip(*found, strict=True), line, marker=".", ms=4, color=color, label=label)
        axes.text(SIZES[-1] * 1.3, group[-1]["free_free"], f"P{k}", color=color, va="center")
    found = [(row["elements"], row["fixed_free_lumped"]) for row in rows if row["degree"] == 1]
    axes.plot(*zip(*found, strict=True), "--", marker="x", ms=4, color=COLORS["sky"])
    axes.text(SIZES[-1] * 0.12, 2.9, "P1 lumped", color=COLORS["sky"], va="center")
    axes.axhline(12, color="#999999", lw=2.5, alpha=0.6, label="bound (24)")
    axes.set(xscale="log", yscale="log", xlabel="number of elements N", ylabel=r"$\lambda_{max}\,\rho_0 H^2/EA$")
    axes.set_xlim(0.85, SIZES[-1] * 6)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, borderaxespad=0.1)


def _draw_steps(axes, rows):
    cables = groups(rows, "scene")
    marks = {"central": ("o", "blue", "central difference"), "RK4": ("s", "red", "RK4")}
    for i, (name, group) in enumerate(cables.items()):
        axes.text(6 * i + 2, 0.02, name, transform=axes.get_xaxis_transform(), ha="center")
        x = 6 * i + np.arange(len(group))
        for scheme, (mark, color, label) in marks.items():
            y = [row[f"dt_{scheme}"] for row in group]
            axes.plot(x, y, mark, ms=4, color=COLORS[color], label=label if i == 0 else None)
        if group[0]["step"]:
            label = "implicit step" if i == 0 else None
            axes.hlines(group[0]["step"], x[0] - 0.5, x[-1] + 0.5, color=COLORS["ink"], lw=1.5, label=label)
    names = [f"{row['degree']}" + ("*" if row["lumped"] else "") for row in rows]
    axes.set_xticks([6 * i + j for i in range(len(cables)) for j in range(len(rows) // len(cables))], names)
    axes.set(yscale="log", xlabel="degree (1*: lumped mass)", ylabel="time step [s]")
    axes.set_ylim(bottom=0.5 * min(row["dt_central"] for row in rows))
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, borderaxespad=0.1)


def tables(rows: list[dict], cables: dict[str, dict]) -> list[Table]:
    """The eigenvalues, and the steps of every cable."""
    for row in rows:
        row["element"] = f"P{row['degree']}" + (" lumped" if row.get("lumped") else "")
    eigen, limits = groups(rows, "study").values()
    drawn, said = figure(eigen, limits), notes(eigen, limits)
    return [
        Table("eigenvalues", eigen, WORDS.say("eigenvalues"), WORDS.columns["eigenvalues"]),
        Table("explicit-limit", limits, WORDS.say("steps"), WORDS.columns["steps"], said, drawn),
    ]
