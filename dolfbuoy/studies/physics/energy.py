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
from ...forms import hull as hull_form
from ...model.buoy import KEEL
from ...motion.simulation import Simulation
from ...motion.start import rotation_of
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

    drag: on cable and hull, f . v_rel, never positive.  stream: f . v_water of the same forces, what moving water does.
    inertia: added mass and Froude-Krylov.  buoyancy: of the hull (the cable's is in its weight).  top: of the
    prescribed end.  outer: wind, external force, rotational damping.
    """

    def __init__(self, simulation):
        self.simulation, self._forms = simulation, []
        if simulation.cable:
            self._add(*self._cable(simulation.cable))
        if simulation.buoy:
            self._add(*self._buoy(simulation.buoy))

    def _add(self, names, form):
        part = Part("powers", fem.Function(form.arguments()[0].ufl_function_space()), 0)
        self._forms.append((names, part, Contribution(form, part)))

    @staticmethod
    def _cable(model):
        """Names, and the linear form whose components are the numbers."""
        parts, c = ufl.split(model.w), model.cable
        r, T = parts[:2]
        e = cable_form.strain(c, parts[2] if model.mean_dofs is not None else T)
        v = model.gamma_v * r + ufl.split(model.history_v)[0]
        a = model.gamma_a * r + ufl.split(model.history_a)[0]
        rho_w, flow = model.sea.density, model.sea.flow(r)
        weight = cable_form.weight_in_water(c, model.gravity, rho_w)
        values = {"kinetic": 0.5 * c.line_density * ufl.inner(v, v), "gravity": -ufl.inner(weight, r)}
        if e is not None:
            values["elastic"] = 0.5 * c.EA * e**2
        if rho_w is not None:
            f = cable_form.hydrodynamic_force(c, rho_w, flow._replace(acceleration=None), r, v)
            if f is not None:
                values |= _drag_powers(cable_form.stretched(c, e, f), v, flow.velocity)
            c = c._replace(normal_drag=None, tangential_drag=None)
            f = cable_form.hydrodynamic_force(c, rho_w, flow, r, v, a)
            if f is not None:
                values["inertia"] = ufl.inner(cable_form.stretched(c, e, f), v)
        test = ufl.TestFunction(real_space(model.mesh, len(values)))
        return list(values), sum(value * test[i] for i, value in enumerate(values.values())) * model.dx

    @staticmethod
    def _buoy(model):
        r_C, q4, motion = model._kinematics()
        names = ("outer", "buoyancy", "drag", "stream", "inertia")
        test = dict(zip(names, ufl.TestFunction(real_space(model.mesh, len(names))), strict=True))

        def work(force, torque):
            return ufl.inner(force, motion.velocity) + ufl.inner(torque, motion.angular_velocity)

        force, torques = model._point_loads(r_C, q4)  # weight and cable among them: `read` takes them off
        if model.spin_damping is not None:
            d = hull_form.axis(q4)
            torques = [*torques, -model.spin_damping * ufl.dot(motion.angular_velocity, d) * d]
        form = model.one * work(force, sum(torques, start=ufl.zero(3))) * test["outer"] * model.ds(KEEL)
        if model.sea.density is None:
            return names, form
        lever, d, flow, area, moment = model._section_at(r_C, q4)
        strip = model.sea.density, area, moment, lever, d
        end = model.sea.density, area, lever, d
        form += work(*hull_form.hydrostatics(strip[0], model.gravity, *strip[1:4])) * test["buoyancy"] * model.dx
        still = flow._replace(acceleration=None)
        parts = {
            "drag": (model.hull._replace(added_mass=None, axial_added_mass=None), still),
            "inertia": (model.hull._replace(normal_drag=None, axial_drag=None), flow),
        }
        for name, (hull, water) in parts.items():
            loads = [(*hull_form.strip_loads(hull, *strip, water, motion), model.dx)]
            disc = hull_form.end_disc_force(hull, *end, water, motion)
            if disc is not None:
                loads.append((disc, ufl.cross(lever, disc), model.ds))
            for force, torque, measure in loads:
                if force is None:
                    continue
                by_water = ufl.inner(force, flow.velocity) if name == "drag" and flow.velocity is not None else 0
                form += model.one * (work(force, torque) - by_water) * test[name] * measure
                if by_water != 0:
                    form += model.one * by_water * test["stream"] * measure
        return names, form

    def read(self) -> dict[str, float]:
        """All numbers at the present time."""
        values = dict.fromkeys((*STORED, "drag", "stream", "inertia", "buoyancy", "outer", "top"), 0.0)
        for names, part, contribution in self._forms:
            b = np.zeros(part.size)
            contribution.prepare()
            contribution.add_to_vector(b)
            for name, value in zip(names, b, strict=True):
                values[name] += float(value)
        sim = self.simulation
        if sim.buoy:
            self._add_body(values)
        elif sim.cable:
            v = sim.cable.gamma_v.value * sim.system.u + sim.cable.history_v.x.array
            values["top"] = float(sim.end_tension @ v[sim.cable.top_dofs])
        return values

    def _add_body(self, values):
        """Energy of the rigid body; its weight is in that, and its cable is no outer force."""
        sim = self.simulation
        mass, y = sim.buoy.mass, sim.system.u[sim.problem.state_part.slice]
        R = rotation_of(y[6:10])
        v, omega = y[3:6] / mass.mass, R @ (R.T @ y[10:13] / np.array(mass.inertia))
        weight = mass.mass * sim.scene.gravity
        values["kinetic"] += 0.5 * (v @ y[3:6] + omega @ y[10:13])
        values["gravity"] += weight * y[2]
        values["outer"] += weight * v[2]
        if sim.problem.mooring_slice:
            lever = R @ [0.0, 0.0, sim.scene.buoy.mooring_height - mass.height]
            T_O = sim.system.u[sim.problem.mooring_slice][3:]
            values["outer"] -= T_O @ (v + np.cross(omega, lever))


def _drag_powers(f, v, water):
    """f . v as f . v_rel and f . v_water; in still water there is nothing of the latter."""
    if water is None:
        return {"drag": ufl.inner(f, v)}
    return {"drag": ufl.inner(f, v - water), "stream": ufl.inner(f, water)}


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
