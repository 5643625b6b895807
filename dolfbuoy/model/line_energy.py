"""Energy stored and power dissipated in the material of lines, for balances."""

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import ufl

from ..forms import bending
from ..forms import cable as form
from ..forms.kinds import Expr
from ..scene.stiffness import TensionTable
from . import effects

if TYPE_CHECKING:
    from .lines import Lines


def material_powers(lines: "Lines") -> list[tuple[effects.Effect, Expr]]:
    """[(effect, power of the material per unstretched length [W/m] as UFL)], for balances."""
    r, T, e, r_t, _ = lines.kinematics()
    taut = partial(form.taut_damping_power, r=r, T=T, e=e, r_t=r_t)
    return [(effect, or_taut(lines, effect.line_power(c, r, r_t), taut)) for effect, c in lines.powers]


def elastic_energies(lines: "Lines") -> list[Expr]:
    """Stretching and bending energies per unstretched length [J/m] as UFL, for balances."""
    r, T, e, r_t, _ = lines.kinematics()
    found = []
    if e is not None:
        found.append(or_taut(lines, form.elastic_energy(lines.cable, e, T, r, r_t), partial(form.taut_energy, r=r)))
    if lines.moment_dofs is not None:
        m = ufl.split(lines.w)[-1]
        if lines.blended:
            found.append(bending.blended_energy(r, m, lines.EI, ufl.CellVolume(lines.mesh)))
        if lines.bending_damping is not None:
            m = bending.elastic_moment(m, lines.EI, lines.bending_damping, r, r_t)
        found.append(bending.bending_energy(m, lines.EI))
    return found


def spring_energies(lines: "Lines") -> list[tuple[Expr, ufl.Measure]]:
    """[(energy [J] as UFL, measure of its end)] of the springs at ends not on a buoy."""
    springs = [(k, i, t_0, spring) for (k, i), (t_0, spring) in lines.clamps.items() if spring is not None]
    m = ufl.split(lines.w)[-1]
    return [(bending.spring_energy(t_0, m, k, i), lines.end_measure(n, i)) for n, i, t_0, k in springs]


def or_taut(lines: "Lines", value: Expr, taut: Callable[..., Expr]) -> Expr:
    """`value`, but `taut` on damped tension-only lines with Hooke's law, where T does not give the strain if slack."""

    def goes(c):
        hooke = not isinstance(c.axial_stiffness, TensionTable) and math.isfinite(c.axial_stiffness)
        return float(c.slack == "tension-only" and c.damping > 0 and hooke)

    ropes = {goes(c) for c in lines.sections}
    if ropes == {0.0}:
        return value
    stiff = lines.constants.per_cell(lambda c: c.axial_stiffness if goes(c) else 0.0)
    rope, of_ropes = lines.constants.per_cell(goes), taut(lines.cable._replace(EA=stiff))
    return of_ropes if ropes == {1.0} else rope * of_ropes + (1 - rope) * value
