"""The energy of a run: what is put in is stored or dissipated, and the rest is what the time scheme takes away.

The semi-discrete equations balance exactly.  Tested with the velocity, Eq. (11)_1 says that kinetic, elastic and
gravitational energy of the cable change by the work of its top and of the water.  The mixed tension does no other work
if the cable is inextensible, or if its tension is constant on each element: then Eq. (11)_2 makes T/(1+e) r'.r'_t equal
to T e_t.  The buoy's energy changes by the work of water, wind, external force and cable.  So the defect

    D(t) = E(t) - E(0) - int_0^t (power put in) dt'

belongs to the time integration alone and must vanish with the step at the order of its scheme.
"""

import itertools
from pathlib import Path

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from ...errors import InputError
from ...forms import cable as cable_form
from ...model import effects
from ...model.rigid import rotation_of
from ...motion.simulation import Simulation
from ...results.style import PAGE, new_figure
from ...scene import load_scene
from ...solver.real import real_space
from ...solver.unknowns import Contribution, Part
from ..declaration import declared
from ..study import Table, groups, numbers, orders

WORDS = declared(__file__)

#: Energies [J]; the others are powers [W].
STORED = ("kinetic", "elastic", "gravity")
SCHEMES = ("backward-euler", "bdf2", "generalized-alpha")
SCENES = {"driven": (60.0, (0.04, 0.02, 0.01)), "short": (40.0, (0.04, 0.02, 0.01))}


class Meter:
    """Energies and powers of a Simulation on one rank.

    The powers are those of the effects that the scene calls for (`model.effects`), each in the account that its
    declaration names.  drag: f . v_rel, never positive.  stream: f . v_water of the same forces, what moving water
    does.  inertia: added mass and Froude-Krylov.  buoyancy: of the hull (the cable's is in its weight).  damping: what
    stays in the material of the cable.  outer: wind, external force, rotational damping.  top: of a prescribed end.
    """

    def __init__(self, simulation):
        self.simulation, self._forms = simulation, []
        if simulation.problem.lines:
            self._add(simulation.problem.lines, self._lines(simulation.problem.lines))
        if simulation.problem.buoy:
            self._add(simulation.problem.buoy, self._buoy(simulation.problem.buoy))

    def _add(self, model, densities):
        """densities: [(account, integrand, measure)]; one linear form, whose components are the accounts."""
        names = list(dict.fromkeys(name for name, _, _ in densities))
        test = ufl.TestFunction(real_space(model.mesh, max(len(names), 2)))
        form = sum(value * test[names.index(name)] * measure for name, value, measure in densities)
        part = Part("powers", fem.Function(test.ufl_function_space()), 0)
        self._forms.append((names, part, Contribution(form, part)))

    @staticmethod
    def _lines(lines):
        r, _, e, v, _ = lines.kinematics()
        c, dx, water = lines.cable, lines.dx, lines.sea.flow(r).velocity
        weight = cable_form.weight_in_water(c, lines.gravity, lines.sea.density)
        found = [("kinetic", 0.5 * c.line_density * ufl.inner(v, v), dx), ("gravity", -ufl.inner(weight, r), dx)]
        if e is not None:
            found.append(("elastic", 0.5 * c.EA * e**2, dx))
        for effect, force in lines.water_forces():
            f = cable_form.stretched(c, e, force)
            found += _powers(effect.account, f, v, water, dx)
        return found + [(effect.account, power, dx) for effect, power in lines.material_powers()]

    @staticmethod
    def _buoy(buoy):
        state, found = buoy.kinematics(), []
        v, omega = state.motion.velocity, state.motion.angular_velocity
        for load in (*buoy.point_loads(state), *buoy.water_loads(state)):
            if load.account is None:  # the weight has an energy
                continue
            if load.force is not None:
                found += _powers(load.account, buoy.one * load.force, v, load.water, load.measure)
            if load.torque is not None:
                found.append((load.account, buoy.one * ufl.inner(load.torque, omega), load.measure))
        return found

    def read(self) -> dict[str, float]:
        """All numbers at the present time."""
        accounts = dict.fromkeys(effect.account for effect in effects.EFFECTS)
        values = dict.fromkeys((*STORED, "drag", "stream", *accounts, "top"), 0.0)
        for names, part, contribution in self._forms:
            b = np.zeros(part.size)
            contribution.prepare()
            contribution.add_to_vector(b)
            for name, value in zip(names, b, strict=False):
                values[name] += float(value)
        problem = self.simulation.problem
        if problem.buoy:
            self._add_body(problem.buoy, values)
        elif problem.lines:
            lines = problem.lines
            v = lines.gamma_v.value * problem.system.u[lines.part.slice] + lines.history_v.x.array
            values["top"] = float(self.simulation.end_tension @ v[lines.top_dofs()])
        return values

    def _add_body(self, buoy, values):
        """Energy of the rigid body."""
        y, mass = buoy.fields.of(self.simulation.system.u[buoy.part.slice]), buoy.mass
        R = rotation_of(y.orientation)
        v, omega = y.momentum / mass.mass, R @ (R.T @ y.angular_momentum / np.array(mass.inertia))
        values["kinetic"] += 0.5 * (v @ y.momentum + omega @ y.angular_momentum)
        values["gravity"] += mass.mass * self.simulation.scene.gravity * y.position[2]


def _powers(account, force, velocity, water, measure):
    """[(account, power, measure)] of a force; that of a drag is split into f . v_rel and f . v_water."""
    if account != "drag" or water is None:
        return [(account, ufl.inner(force, velocity), measure)]
    return [(account, ufl.inner(force, velocity - water), measure), ("stream", ufl.inner(force, water), measure)]


def load(name, t_end, step, scheme):
    """A scene of which the balance is exact in space: an elastic cable gets one tension per element."""
    scene = load_scene(name, time={"end": t_end, "step": step, "scheme": scheme, "tolerance": None})
    if scene.cable and np.isfinite(scene.cable.axial_stiffness):
        scene = load_scene(scene, cable__position_degree=1, cable__tension_degree=0)
    return scene


def evaluate(case: dict) -> dict:
    """Work of every kind [J] over the run, stored energy, and the defect; powers are integrated by the trapezoid."""
    scene = load(case["scene"], case["t_end"], case["step"], case["scheme"])
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        meter = Meter(simulation)
        old, t = meter.read(), 0.0
        if old["kinetic"] > 0:
            raise InputError(f"{case['scene']}: the balance starts from rest only.")
        first, work = old, {name: 0.0 for name in old if name not in STORED}
        turnover = 0.0
        for _ in simulation.run():
            new, h = meter.read(), simulation.t - t
            for name in work:
                work[name] += 0.5 * h * (old[name] + new[name])
            turnover += 0.5 * h * (abs(old["drag"]) + abs(new["drag"]))
            old, t = new, simulation.t
        stored = {name: old[name] - first[name] for name in STORED}
        defect = sum(stored.values()) - sum(work.values())
        return {**work, **stored, "defect": defect, "relative": abs(defect) / turnover}
    finally:
        simulation.problem.destroy()


def cases(scene: str | None = None, t_end: float | None = None, steps=None) -> list[dict]:
    """Every scheme with every step, of one scene or of a driven cable and the moored buoy `short`."""
    chosen = {name: SCENES.get(name, (20.0, (0.04, 0.02, 0.01))) for name in ([scene] if scene else SCENES)}
    return [
        {"scene": name, "t_end": t_end or usual_end, "scheme": scheme, "step": step}
        for name, (usual_end, usual_steps) in chosen.items()
        for scheme, step in itertools.product(SCHEMES, steps or usual_steps)
    ]


def structure(case: dict) -> str:
    """What decides which forms are compiled."""
    return case["scene"]


def request(steps: str | None, **given) -> dict:
    """What `cases` takes."""
    return {"steps": numbers("--steps", steps), **given}


def tables(rows: list[dict], **_) -> list[Table]:
    """The balance of every scene."""
    return [_balance(Path(scene).stem, chosen) for scene, chosen in groups(rows, "scene").items()]


def _balance(label, rows):
    for mine in groups(rows, "scheme").values():
        orders(mine, "relative", "step")
    for row in rows:
        row["order"], row["stored"] = row.pop("order_relative"), sum(row[part] for part in STORED)
    shown = {key: title for key, title in WORDS.columns.items() if key == "order" or any(row[key] for row in rows)}
    title = WORDS.say("title", label=label, end=rows[0]["t_end"])
    return Table(f"energy-{label}", rows, title, shown, figure=draw(rows))


def draw(rows: list[dict]):
    """Defect against the step, one line per scheme."""
    figure = new_figure(PAGE / 2, 2.8)
    axes = figure.subplots()
    for scheme, mine in groups(rows, "scheme").items():
        axes.loglog([row["step"] for row in mine], [row["relative"] for row in mine], "o-", label=scheme)
    axes.set(xlabel="step [s]", ylabel="defect / work of the drag")
    axes.legend()
    return figure
