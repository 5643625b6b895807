"""The buoy of a scene: 13 numbers for its motion (7 for its pose in statics), 6 for the mooring, on the hull's axis."""

import numpy as np
import ufl
from dolfinx import fem

from ..forms import buoy as body
from ..forms import coupling, hull, wind
from ..forms.rotation import rotation_matrix
from ..meshes import HullShape
from ..solver import compat
from ..solver.real import real_space
from ..solver.unknowns import Block
from .rigid import mass_properties
from .sea import SeaState, heading

KEEL, TOP = 1, 2  # tags of the ends of the axis
#: Length over which a strip of an upright hull passes from wet to dry, in axis cells: four cells' points resolve it.
SOFTENING_CELLS = 2.0


def part_of(vector, start, size):
    """Components start ... start + size of a UFL vector."""
    return ufl.as_vector([vector[start + i] for i in range(size)])


class BuoyModel:
    """Axis mesh, Real spaces and forms of the buoy.

    Dynamics: state = (r_C, p, q_4, L_C).  Statics: state = (r_C, q_4).  mooring = (r_O, T_O), only with a cable.
    """

    def __init__(self, scene, dynamic):
        self.scene, self.section, self.dynamic = scene, scene.buoy, dynamic
        self.shape = HullShape(tuple(scene.buoy.hull)) if scene.buoy.hull else None
        self.mass = mass_properties(scene.buoy, self.shape)
        nodes = self.shape.nodes(scene.solver.hull_cells) if self.shape else np.array([0.0, 1.0])
        self.mesh = compat.interval_mesh(compat.MPI.COMM_SELF, nodes)
        self.state = fem.Function(real_space(self.mesh, 13 if dynamic else 7))
        self.mooring = fem.Function(real_space(self.mesh, 6)) if scene.cable else None
        if dynamic:
            self.gamma, self.history = fem.Constant(self.mesh, 0.0), fem.Function(self.state.function_space)
        else:
            self.relaxation = fem.Constant(self.mesh, 0.0)
            self.reference = fem.Function(self.state.function_space)
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        degree = scene.solver.hull_quadrature_degree
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": degree})
        self.ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=compat.end_tags(self.mesh, nodes[0], nodes[-1]))
        self._constants(nodes)

    def _constants(self, nodes):
        b, mesh = self.section, self.mesh

        def constant(value):
            return fem.Constant(mesh, value) if value else None

        self.one = fem.Constant(mesh, 1.0)
        self.M, self.center = fem.Constant(mesh, self.mass.mass), fem.Constant(mesh, self.mass.height)
        self.inertia = fem.Constant(mesh, np.array(self.mass.inertia))
        self.gravity = fem.Constant(mesh, np.array([0.0, 0.0, -self.scene.gravity]))
        self.spin_damping = constant(b.rotational_damping)
        self.offset = self._offset(b.mooring_height)
        if self.scene.sea:
            softening = SOFTENING_CELLS * np.diff(nodes).max()
            self.hull = hull.Hull(
                radius=self._radius(),
                softening=fem.Constant(mesh, softening),
                added_mass=constant(b.added_mass),
                normal_drag=constant(b.normal_drag),
                axial_added_mass=constant(b.axial_added_mass),
                axial_drag=constant(b.axial_drag),
            )

    def _offset(self, height):
        """Body vector from C to the axis point at `height` above the keel."""
        return fem.Constant(self.mesh, np.array([0.0, 0.0, height - self.mass.height]))

    def _radius(self):
        space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 1))
        R, cells, ends = fem.Function(space), compat.cell_dofs(space), compat.cell_ends(self.mesh)
        zeta = space.tabulate_dof_coordinates()[cells, 0]
        R.x.array[cells] = self.shape.radius(zeta, ends.mean(axis=1)[:, None])
        return R

    # -- forms ------------------------------------------------------------------------------------------------------

    def _kinematics(self):
        """(r_C, q4, motion) as UFL; motion is None in statics."""
        y = self.state
        if not self.dynamic:
            return part_of(y, 0, 3), part_of(y, 3, 4), None
        r_C, p, q4, L_C = part_of(y, 0, 3), part_of(y, 3, 3), part_of(y, 6, 4), part_of(y, 10, 3)
        _, p_t, _, L_C_t = self._rates()
        R = rotation_matrix(q4)
        return r_C, q4, hull.body_motion(R, self.M, self.inertia, p, p_t, L_C, L_C_t)

    def _rates(self):
        """Time derivatives of (r_C, p, q4, L_C), affine in the unknown."""
        rate = self.gamma * self.state + self.history
        return part_of(rate, 0, 3), part_of(rate, 3, 3), part_of(rate, 6, 4), part_of(rate, 10, 3)

    def _point_loads(self, r_C, q4):
        """Force and torque about C of everything that acts at a point: weight, wind, external force, cable."""
        scene = self.scene
        force, torques = self.M * self.gravity, []
        if scene.wind is not None:
            w, direction = scene.wind, fem.Constant(self.mesh, heading(scene.wind.direction_deg))
            values = (w.speed_10m, w.drag_coefficient, w.air_density, w.area)
            speed, C, rho_air, A_T = (fem.Constant(self.mesh, v) for v in values)
            offset = self._offset(w.height)
            x = r_C + rotation_matrix(q4) * offset
            eta = self.sea.flow(x).elevation
            F_wind = wind.wind_force(x[2] if eta is None else x[2] - eta, direction, speed, C, rho_air, A_T)
            force = force + F_wind
            torques.append(body.point_torque(q4, offset, F_wind))
        if scene.external_force is not None:
            F_ext = fem.Constant(self.mesh, np.array(scene.external_force.force))
            force = force + F_ext
            if scene.external_force.height is not None:
                torques.append(body.point_torque(q4, self._offset(scene.external_force.height), F_ext))
        if self.mooring is not None:
            T_O = part_of(self.mooring, 3, 3)
            force = force + T_O
            torques.append(body.point_torque(q4, self.offset, T_O))
        return force, torques

    def residuals(self, state, mooring):
        """Eqs. (8), (9), (10) as [(part, form), ...]; in statics the equilibrium of the same loads."""
        r_C, q4, motion = self._kinematics()
        point, one, y = self.ds(KEEL), self.one, state.test
        force, torques = self._point_loads(r_C, q4)
        test_force, test_torque = (
            (part_of(y, 3, 3), part_of(y, 10, 3)) if self.dynamic else (part_of(y, 0, 3), part_of(y, 4, 3))
        )
        if self.dynamic:
            r_C_t, p_t, q4_t, L_C_t = self._rates()
            p, L_C = part_of(self.state, 3, 3), part_of(self.state, 10, 3)
            if self.spin_damping is not None:
                torques.append(body.axial_damping(q4, L_C, self.inertia, self.spin_damping))
            torque = sum(torques[1:], torques[0]) if torques else ufl.zero(3)
            F = body.translation(r_C_t, p, self.M, part_of(y, 0, 3)) + body.linear_momentum(p_t, force, test_force)
            F += body.orientation(q4_t, q4, L_C, self.inertia, part_of(y, 6, 4))
            F += body.angular_momentum(L_C_t, torque, test_torque)
        else:
            torque = sum(torques[1:], torques[0]) if torques else ufl.zero(3)
            reference = part_of(self.reference, 0, 3), part_of(self.reference, 3, 4)
            moment, length = self._sizes()[1:3]
            inertia, gauge = fem.Constant(self.mesh, max(self.mass.inertia)), fem.Constant(self.mesh, moment * length)
            tests = test_force, y[3], test_torque
            F = body.equilibrium(r_C, q4, force, torque, reference, self.M, inertia, self.relaxation, gauge, tests)
            if self.mooring is None:
                F += body.held_horizontally(r_C, reference[0], gauge, test_force)
        F = one * F * point
        if self.scene.sea is not None:
            F += self._hull_loads(r_C, q4, motion, test_force, test_torque)
        result = [(state, F)]
        if mooring is not None:
            r_O, test = part_of(self.mooring, 0, 3), part_of(mooring.test, 0, 3)
            result.append((mooring, one * coupling.rigid_link(r_O, r_C, q4, self.offset, test) * point))
        return result

    def _section_at(self, r_C, q4):
        """Strip at the axis coordinate: (lever from C, axis d, flow, wet area, first moment)."""
        zeta = ufl.SpatialCoordinate(self.mesh)[0]
        d = hull.axis(q4)
        lever = (zeta - self.center) * d
        flow = self.sea.flow(r_C + lever)
        area, moment = hull.wet_section(self.hull.radius, self.hull.softening, d, r_C + lever, flow.elevation)
        return lever, d, flow, area, moment

    def _hull_loads(self, r_C, q4, motion, test_force, test_torque):
        rho_w = self.sea.density
        lever, d, flow, area, moment = self._section_at(r_C, q4)
        force, torque = hull.hydrostatics(rho_w, self.gravity, area, moment, lever)
        F_hyd, tau_hyd = hull.strip_loads(self.hull, rho_w, area, moment, lever, d, flow, motion)
        if F_hyd is not None:
            force, torque = force + F_hyd, torque + tau_hyd
        F = -(ufl.inner(force, test_force) + ufl.inner(torque, test_torque)) * self.dx
        disc = hull.end_disc_force(self.hull, rho_w, area, lever, d, flow, motion)
        if disc is not None:
            F -= self.one * ufl.inner(disc, test_force) * self.ds
        return F

    def wet_hull_form(self):
        """Linear form of [M_D, rho_w integral of position (3), H_sub, integral of wet diameter, elevation above C]."""
        test = ufl.TestFunction(real_space(self.mesh, 7))
        r_C, q4, _ = self._kinematics()
        lever, _, _, area, moment = self._section_at(r_C, q4)
        wet = area / (ufl.pi * self.hull.radius**2)
        where = area * (r_C + lever) + moment
        rho_w = self.sea.density
        form = rho_w * (area * test[0] + sum(where[i] * test[1 + i] for i in range(3))) * self.dx
        form += (wet * test[4] + 2 * self.hull.radius * wet * test[5]) * self.dx
        eta = self.sea.flow(r_C).elevation
        return form if eta is None else form + self.one * eta * test[6] * self.ds(KEEL)

    # -- numbers ----------------------------------------------------------------------------------------------------

    def _sizes(self):
        """Typical length [m], force [N], moment arm [m] and speed [m/s]."""
        g = max(self.scene.gravity, 1.0)
        length = self.shape.height if self.shape else 1.0
        return length, self.mass.mass * g, length, np.sqrt(g * length)

    @property
    def state_sizes(self):
        """Typical sizes of the 13 numbers (r_C, p, q_4, L_C), for relative errors."""
        length, _, _, speed = self._sizes()
        spin = max(self.mass.inertia) * speed / length
        return np.repeat([length, self.mass.mass * speed, 1.0, spin], [3, 3, 4, 3])

    def blocks(self, offset, mooring_offset, cable_length=None, force=0.0):
        """Blocks of the 19 (or 13) numbers; with their places among the local unknowns."""
        length, weight, arm, speed = self._sizes()
        reach, force = max(length, cable_length or 0.0), max(weight, force)
        spin = max(self.mass.inertia) * speed / length

        def at(start, n):
            return np.arange(start, start + n)

        if self.dynamic:
            blocks = [
                Block("buoy position r_C", at(offset, 3), reach, 0.0, reach, unit="m"),
                Block(
                    "buoy momentum p",
                    at(offset + 3, 3),
                    self.mass.mass * speed,
                    force,
                    self.mass.mass * speed,
                    unit="N s",
                ),
                Block("buoy orientation q_4", at(offset + 6, 4), 1.0, 0.0, 1.0),
                Block("buoy angular momentum L_C", at(offset + 10, 3), spin, force * arm, spin, unit="N m s"),
            ]
        else:
            blocks = [
                Block("buoy position r_C", at(offset, 3), reach, force, unit="m"),
                Block("buoy orientation q_4", at(offset + 3, 1), 1.0, 1.0),
                Block("buoy torque balance", at(offset + 4, 3), 1.0, force * arm),
            ]
        if self.mooring is not None:
            blocks.append(Block("mooring point r_O", at(mooring_offset, 3), reach, reach, unit="m"))
            mass = self.mass.mass
            blocks.append(
                Block("mooring force T_O", at(mooring_offset + 3, 3), force, reach, rounding=mass * reach, unit="N")
            )
        return blocks
