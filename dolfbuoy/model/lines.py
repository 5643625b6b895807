"""The cable of a scene on its mesh: spaces, constants and residual."""

import math

import numpy as np
import ufl
from dolfinx import fem

from ..forms import cable as form
from ..forms import coupling
from ..meshes import cable_nodes
from ..solver import compat
from ..solver.real import real_space
from ..solver.unknowns import Block
from .sea import SeaState, ramp

ANCHOR, TOP = 1, 2  # tags of the two ends


def top_position(top, t):
    """r_bnd(t) of the scene's section cable.top, fixed or prescribed [m]."""
    position = np.array(top.position)
    if top.kind == "prescribed":
        angle = 2 * math.pi * t / top.period + math.radians(top.phase_deg)
        position += (ramp(t, top.ramp) * math.sin(angle)) * np.array(top.amplitude)
    return position


class CableModel:
    """Mesh, spaces and forms of the cable; w = (r, T) or (r, T, mean T) is the unknown."""

    def __init__(self, comm, scene, dynamic):
        self.comm, self.scene, self.section = comm, scene, scene.cable
        self.nodes = cable_nodes(self.section.length, self.section.elements, self.section.grading)
        self.mesh = compat.interval_mesh(comm, self.nodes)
        self.space = compat.function_space(self.mesh, self._element())
        self.w = fem.Function(self.space)
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        self._measures()
        self._numbering()
        self._constants()
        self.top_kind = "buoy" if scene.buoy else self.section.top.kind
        #: r_O and T_O as seen from the cable
        self.mooring = fem.Function(real_space(self.mesh, 6)) if scene.buoy else None
        if dynamic:
            self.gamma_v, self.gamma_a = (fem.Constant(self.mesh, 0.0) for _ in range(2))
            self.history_v, self.history_a = fem.Function(self.space), fem.Function(self.space)

    # -- set-up -----------------------------------------------------------------------------------------------------

    @property
    def _averaged(self):
        return self.section.strain == "element-average" and np.isfinite(self.section.axial_stiffness)

    def _element(self):
        c = self.section
        elements = [
            compat.element(self.mesh, "P", c.position_degree, 3),
            compat.element(self.mesh, "DG", c.tension_degree),
        ]
        if self._averaged:
            elements.append(compat.element(self.mesh, "DG", 0))
        return compat.mixed_element(elements)

    def _measures(self):
        mu = self.section.position_degree
        degree = self.scene.solver.quadrature_degree or max(2 * mu + 1, 3 * mu - 3)
        metadata = {"quadrature_degree": degree}
        self.ends = compat.end_tags(self.mesh, 0.0, self.section.length)
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata=metadata)
        self.ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=self.ends)

    def _numbering(self):
        """Where the dofs of w sit on the cable: nodes of r, cells of T."""
        V, r_dofs = compat.collapse(self.space, 0)
        Q, T_dofs = compat.collapse(self.space, 1)
        self.node_s = V.tabulate_dof_coordinates()[:, 0].copy()
        self.node_dofs = np.asarray(r_dofs).reshape(-1, 3)
        self.owned_nodes = V.dofmap.index_map.size_local
        self.cell_ends = compat.cell_ends(self.mesh)
        cells = compat.cell_dofs(Q)
        self.T_dofs, self.T_s = np.asarray(T_dofs)[cells], Q.tabulate_dof_coordinates()[cells, 0]
        self.mean_dofs = None
        if self._averaged:
            Q0, mean_dofs = compat.collapse(self.space, 2)
            self.mean_dofs = np.asarray(mean_dofs)[compat.cell_dofs(Q0)[:, 0]]
        self.anchor_dofs, self.top_dofs = (self._end_dofs(s) for s in (0.0, self.section.length))
        first = np.flatnonzero(np.isclose(self.cell_ends[:, 0], 0.0, atol=1e-9 * self.section.length))
        self._anchor_cell_dofs = self.T_dofs[first].ravel()
        self._at_anchor, self._averaging = self._weights(lambda k: float(k == 0)), self._weights(lambda k: 1 / (k + 1))

    def _end_dofs(self, s):
        return self.node_dofs[np.isclose(self.node_s, s, rtol=0, atol=1e-9 * self.section.length)].ravel()

    def _constants(self):
        scene, c = self.scene, self.section

        def constant(value):
            return fem.Constant(self.mesh, value) if value else None

        area = np.pi * c.diameter**2 / 4 if c.diameter else None
        self.cable = form.Cable(
            line_density=constant(c.line_density),
            EA=constant(c.axial_stiffness) if np.isfinite(c.axial_stiffness) else None,
            diameter=constant(c.diameter),
            area=constant(area),
            added_mass=constant(c.added_mass),
            normal_drag=constant(c.normal_drag),
            tangential_drag=constant(c.tangential_drag),
            tangential_froude_krylov=c.tangential_froude_krylov,
            damping=constant(c.damping),
        )
        self.gravity = fem.Constant(self.mesh, np.array([0.0, 0.0, -scene.gravity]))
        self.end_load = None
        if c.top is not None and c.top.kind == "free" and any(c.top.force):
            self.end_load = fem.Constant(self.mesh, np.array(c.top.force))

    # -- forms ------------------------------------------------------------------------------------------------------

    def residual(self, test, dynamic):
        """Eq. (11) tested by `test`; without inertia, added mass and waves in statics."""
        parts, tests = ufl.split(self.w), ufl.split(test)
        (r, T), (v, q), cable, dx = parts[:2], tests[:2], self.cable, self.dx
        r_t = r_tt = None
        if dynamic:
            r_t = self.gamma_v * r + ufl.split(self.history_v)[0]
            r_tt = self.gamma_a * r + ufl.split(self.history_a)[0]
        e = form.strain(cable, parts[2] if self.mean_dofs is not None else T, r, r_t)
        rho_w = self.sea.density

        F = form.tension_term(r, T, e, v) * dx + form.strain_equation(r, e, q, self.section.strain_form) * dx
        F -= ufl.inner(form.weight_in_water(cable, self.gravity, rho_w), v) * dx
        if self.mean_dofs is not None:
            F += form.mean_strain_equation(T, parts[2], tests[2]) * dx

        if dynamic:
            F += form.inertia(cable, r_tt, v) * dx
        if rho_w is not None:
            f = form.hydrodynamic_force(cable, rho_w, self.sea.flow(r), r, r_t, r_tt)
            if f is not None:
                F -= ufl.inner(form.stretched(cable, e, f), v) * dx
        if self.top_kind == "buoy":
            T_bnd = -ufl.as_vector([self.mooring[3 + i] for i in range(3)])
            F += coupling.end_force(T_bnd, v) * self.ds(TOP)
        elif self.end_load is not None:
            F += coupling.end_force(self.end_load, v) * self.ds(TOP)
        return F

    def attachment(self, test):
        """Eq. (29)_1 tested by the T_O part of `test` (a test function of the mooring space)."""
        r = ufl.split(self.w)[0]
        r_O, t_O = (ufl.as_vector([f[i + k] for i in range(3)]) for f, k in ((self.mooring, 0), (test, 3)))
        return coupling.attachment(r, r_O, t_O) * self.ds(TOP)

    # -- numbers ----------------------------------------------------------------------------------------------------

    @property
    def weight_per_length(self) -> float:
        """Weight in water per unstretched length, w [N/m]; negative for a cable that floats."""
        c, sea = self.section, self.scene.sea
        displaced = sea.density * np.pi * c.diameter**2 / 4 if sea else 0.0
        return (c.line_density - displaced) * self.scene.gravity

    def constrained_dofs(self):
        """Dofs that are given: the anchor and, fixed or prescribed, the top."""
        held = self.top_kind in ("fixed", "prescribed")
        return np.concatenate([self.anchor_dofs, self.top_dofs]) if held else self.anchor_dofs

    def top_position(self, t):
        """r_bnd(t) of a fixed or prescribed top."""
        return top_position(self.section.top, t)

    def constrain(self, u, t):
        """Put the given positions at time t into the local unknowns u."""
        if len(self.anchor_dofs):
            u[self.anchor_dofs] = self.scene.anchor
        if self.top_kind in ("fixed", "prescribed") and len(self.top_dofs):
            u[self.top_dofs] = self.top_position(t)

    def elimination_order(self):
        """Free owned dofs along the cable, each tension after the positions that it constrains.

        In this order the saddle-point matrix has a factorisation without pivoting.
        """
        n = self.space.dofmap.index_map.size_local
        place, kind = np.zeros(len(self.w.x.array)), np.ones(len(self.w.x.array))
        place[self.node_dofs] = self.node_s[:, None]
        kind[self.node_dofs] = 0
        place[self.T_dofs] = self.cell_ends[:, 1][:, None]
        if self.mean_dofs is not None:
            place[self.mean_dofs] = self.cell_ends[:, 1]
            kind[self.mean_dofs] = 2
        order = np.lexsort((np.arange(n), kind[:n], place[:n]))
        return order[~np.isin(order, self.constrained_dofs())]

    def blocks(self, force):
        """Blocks of w; `force` is a typical tension [N]."""
        L, h = self.section.length, np.diff(self.nodes).min()
        rounding = self.section.line_density * h * L
        blocks = [
            Block("cable position", self.node_dofs.ravel(), L, force, self.section.line_density * h * L, 2, unit="m"),
            Block("cable tension", self.T_dofs.ravel(), force, h, rounding=rounding, unit="N"),
        ]
        if self.mean_dofs is not None:
            blocks.append(Block("cable mean tension", self.mean_dofs, force, force * h, rounding=rounding, unit="N"))
        return blocks

    def set_shape(self, u, position, tension):
        """Interpolate position(s) -> (n, 3) and tension(s) -> (n,) into the local unknowns u."""
        u[self.node_dofs] = position(self.node_s)
        u[self.T_dofs] = tension(self.T_s)
        if self.mean_dofs is not None:
            u[self.mean_dofs] = self.mean_tension(u)

    def mean_tension(self, u):
        """Average of T on each owned cell [N]."""
        return u[self.T_dofs] @ self._averaging

    def anchor_tension(self, u):
        """T_h(0) [N], on the rank that owns the first cell; nan elsewhere."""
        return float(self._at_anchor @ u[self._anchor_cell_dofs]) if len(self._anchor_cell_dofs) else np.nan

    def _weights(self, moment):
        """Weights of the T dofs of a cell for a functional with value moment(k) on xi^k, 0 <= xi <= 1.

        All cells number their dofs alike, as affine images of one reference cell.
        """
        ends = self.cell_ends[0]
        xi = (self.T_s[0] - ends[0]) / (ends[1] - ends[0])
        degree = np.arange(len(xi))
        return np.linalg.solve(xi[None, :] ** degree[:, None], [moment(k) for k in degree])
