"""Energies and powers of a run, from the equations it solves.

The semi-discrete equations balance exactly.  With the velocity as test function, Eq. (11)_1 equates the change of the
cable's kinetic, elastic and gravitational energy to the work at its top and of the water.  The mixed tension does no
other work if the cable is inextensible or its tension is constant on each element: then T/(1+e) r'.r'_t = T e_t by
Eq. (11)_2.  Bending stores 1/2 |m|^2/EI.  The buoy's energy changes by the work of water, wind, external force and
cable.
"""

from functools import partial

import numpy as np
import ufl
from dolfinx import fem

from ..forms import cable as cable_form
from ..model import effects
from ..model.line_energy import elastic_energies, material_powers, spring_energies
from ..model.rigid import rotation_of
from ..solver import compat
from ..solver.unknowns import Contribution, Part

#: Accounts that are energies [J]; all others are powers [W].
STORED = ("kinetic", "elastic", "gravity")


class Meter:
    """Energies and powers of a Simulation on one rank.

    The powers are those of the effects of the scene (`model.effects`), each in the account given by its declaration.
    drag: f . v_rel, never positive.  stream: f . v_water of the same forces, the work of the moving water.  inertia:
    added mass and Froude-Krylov forces.  buoyancy: that of the hull, and of lines and bodies that may leave the water
    (otherwise it is included in their weight).  damping: dissipation in the material of the cable, and wave radiation.
    drift: mean drift.  bed: dampers of the sea bed (its springs are elastic).  friction: bed friction.  outer: wind,
    external force, rotational damping.  take_off: absorption by power take-offs, never positive.  top: moved ends and
    buoys.  winch: power fed into lines by winches.  loads: those applied by a caller to buoys, joints and ends, as
    numbers or functions (`coupling`).
    """

    def __init__(self, simulation):
        self.simulation, self._forms = simulation, []
        for lines in simulation.problem.lines.groups if simulation.problem.lines else ():
            c, e = lines.cable, lines.kinematics()[2]
            own = [("elastic", energy) for energy in elastic_energies(lines)]
            own += [(effect.account, power) for effect, power in material_powers(lines)]
            own += [("winch", lines.winch.power())] if lines.winch else []
            springs = [("elastic", *spring) for spring in spring_energies(lines)]
            springs += [
                ("elastic", *a.clamp.energy()) for a in simulation.problem.attachments if self._sprung(a, lines)
            ]
            masses = self._masses(lines, c.line_density, partial(cable_form.stretched, c, e), own)
            self._add(lines, [*masses, *springs])
        if simulation.problem.bodies:
            bodies = simulation.problem.bodies
            self._add(bodies, self._masses(bodies, bodies.body.mass, lambda force: force))
        for device in simulation.problem.take_offs:
            self._add(device, device.energies())
        for buoy in simulation.problem.buoys.values():
            self._add(buoy, self._buoy(buoy))

    def _add(self, model, densities):
        """Add one linear form whose components are the accounts; densities: [(account, integrand, measure)]."""
        if not densities:
            return
        names = list(dict.fromkeys(name for name, _, _ in densities))
        test = ufl.TestFunction(compat.real_space(model.mesh, max(len(names), 2)))
        form = sum(value * test[names.index(name)] * measure for name, value, measure in densities)
        part = Part("powers", fem.Function(test.ufl_function_space()), 0)
        self._forms.append((names, part, Contribution(form, part)))

    @staticmethod
    def _sprung(attachment, lines):
        return attachment.lines is lines and attachment.clamp is not None and attachment.clamp.sprung

    @staticmethod
    def _masses(model, density, stretched, own=()):
        """Densities of lines or bodies; density: mass density, stretched: force -> force per dx, own: further ones."""
        (r, *_, v, _), dx = model.kinematics(), model.dx
        water = model.water_at(r).velocity
        found = [("kinetic", 0.5 * density * ufl.inner(v, v), dx), *_weight(model.weight(), r, v, dx)]
        for effect, force in model.water_forces():
            found += _powers(effect.account, stretched(force), v, water, dx)
        powers = [*own, *(model.bed.powers() if model.bed is not None else ())]
        return found + [(account, value, dx) for account, value in powers]

    @staticmethod
    def _buoy(buoy):
        state, found = buoy.kinematics(), []
        v, omega = state.motion.velocity, state.motion.angular_velocity
        for load in (*buoy.point_loads(state), *buoy.water_loads(state)):
            if load.account is None:  # weight is accounted for as energy
                continue
            if load.force is not None:
                found += _powers(load.account, buoy.one * load.force, v, load.water, load.measure)
            if load.torque is not None:
                found.append((load.account, buoy.one * ufl.inner(load.torque, omega), load.measure))
        return found

    def read(self) -> dict[str, float]:
        """All energies and powers at the present time."""
        accounts = dict.fromkeys(effect.account for effect in effects.EFFECTS)
        values = dict.fromkeys((*STORED, "drag", "stream", *accounts, "top", "loads"), 0.0)
        problem = self.simulation.problem
        for model in problem.models:
            model.publish_points()
        for lines in problem.lines.groups if problem.lines else ():
            lines.publish_lengths(self.simulation.t)
        for names, part, contribution in self._forms:
            b = np.zeros(part.size)
            contribution.prepare()
            contribution.add_to_vector(b)
            for name, value in zip(names, b, strict=False):
                values[name] += float(value)
        loads = vars(problem.system).get("loads", np.zeros(problem.system.size))
        for buoy in problem.buoys.values():
            y, mass = buoy.fields.of(problem.system.u[buoy.part.slice]), buoy.mass
            R = rotation_of(y.orientation)
            v, omega = y.momentum / mass.mass, R @ (R.T @ y.angular_momentum / np.array(mass.inertia))
            values["kinetic"] += 0.5 * (v @ y.momentum + omega @ y.angular_momentum)
            values["gravity"] += mass.mass * self.simulation.scene.gravity * y.position[2]
            account, rows = ("loads", -loads) if buoy.motion is None else ("top", problem.system.last_residual)
            put = buoy.fields.of(rows[buoy.part.slice])
            values[account] += float(put.momentum @ v + put.angular_momentum @ omega)
        for model in (*(problem.lines.groups if problem.lines else ()), *([problem.bodies] if problem.bodies else [])):
            values["loads"] -= float(loads[model.part.slice] @ _velocity(model, problem.system.u))
        if problem.lines:
            values["top"] += self._work_at_ends(problem)
        for device in problem.take_offs:
            v = device.velocities(problem.system.u)
            values["top"] += sum(float(f @ v[i]) for i, f in device.reactions(problem.system.last_residual))
        return values

    @staticmethod
    def _work_at_ends(problem):
        """Power of the forces on free and moved ends [W]."""
        found = 0.0
        for lines in problem.lines.groups:
            v = _velocity(lines, problem.system.u)
            for k, number in enumerate(lines.numbers):
                for i, end in enumerate(lines.pieces[k].ends):
                    if end.kind in ("prescribed", "free") or (k, i) in lines.driven:
                        found += float(problem.end_force(number, i, fresh=False) @ v[lines.end_dofs[k][i]])
        return found


def _velocity(model, u):
    """Velocity of the unknowns of lines or bodies [m/s]."""
    return model.gamma_v.value * u[model.part.slice] + model.history_v.x.array


def _weight(forces, r, v, measure):
    """[(account, energy or power, measure)] of a weight, and of a separate buoyancy if there is one."""
    weight, *buoyancy = forces
    return [("gravity", -ufl.inner(weight, r), measure), *(("buoyancy", ufl.inner(f, v), measure) for f in buoyancy)]


def _powers(account, force, velocity, water, measure):
    """[(account, power, measure)] of a force; for drag, split into f . v_rel and f . v_water."""
    if account != "drag" or water is None:
        return [(account, ufl.inner(force, velocity), measure)]
    return [(account, ufl.inner(force, velocity - water), measure), ("stream", ufl.inner(force, water), measure)]
