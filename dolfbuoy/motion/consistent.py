"""Consistent initial values: velocity, acceleration and tension for a given start.

The tension of an inextensible cable and the force at a mooring point are Lagrange multipliers (index 3).  At t = 0
they follow from the positions, the velocity admitted by the constraints, and the loads.
"""

import numpy as np

from ..elsewhere import MPI
from .schemes import BackwardEuler, Predictor


def make_consistent(simulation) -> None:
    """Project the velocity onto the constraints and find the corresponding tension and acceleration.

    This uses tiny backward-Euler steps, the first of which finds the admissible velocity nearest in kinetic energy.
    Errors are of the order of that step squared.  The tension of an elastic cable is exactly that of its stretch,
    unless only its element mean is defined (strain = "element-average").
    """
    u0, past, scheme = simulation.system.u.copy(), simulation.past, simulation.scheme
    past.use(BackwardEuler())
    memory = [{name: values.copy() for name, values in model.items()} for model in simulation.memory]
    h = max(1e-3 * simulation.scene.time.step, 1e-5)  # not smaller: rounding in the tension grows like 1/h^2
    first = _settle(simulation, u0, h)
    second = _settle(simulation, u0, h)  # its change of an admissible velocity is in both, and cancels below
    for series, (rate1, value1), (rate2, value2) in zip(past.series, first, second, strict=True):
        series.rate, series.values[0][:] = 2 * rate1 - rate2, 2 * value1 - value2
    for series, rate in zip(past.series, past.series[1:], strict=False):
        series.second[: len(rate.rate)] = rate.rate
    for lines in simulation.problem.lines.groups if simulation.problem.lines else ():
        if lines.elastic and lines.mean_dofs is None:
            _solve_tension(simulation, lines, u0)
    for evolution, place in zip(past.evolutions, past.places, strict=True):  # momenta: the admissible ones
        values = evolution.values(u0)
        values[:] = np.where(evolution.lagged, past.series[0].values[0][place], values)
    for model, kept in zip(simulation.memory, memory, strict=True):
        for name, values in model.items():
            values[:] = kept[name]
    past.use(scheme)
    simulation.t = 0.0
    simulation.system.u[:] = u0
    simulation.problem.set_time(0.0)


def _settle(simulation, u0, h):
    """Take three steps of h from the positions u0 with the present velocity, and return; set the forces at t = 0 in u0.

    Returns [(rate, value) of each series], with which the series restart.  Velocities are centred at t = 0: those
    of the first two steps belong to h/2 and 3 h/2, as the positions show.  Accelerations and forces are extrapolated
    from the ends of the second and third step, because the first one contains an impulse.
    """
    system, past = simulation.system, simulation.past
    system.u[:], simulation.t = u0, 0.0
    found = []
    for _ in range(3):
        simulation.predictor = Predictor(1)
        simulation.predictor.add(simulation.t, system.u)
        simulation.step(h)
        known = [(series.rate.copy(), series.values[0].copy()) for series in past.series]
        found.append((known, system.u.copy(), simulation.end_forces))
    (known1, _, _), (known2, u2, end2), (known3, u3, end3) = found
    forces = simulation.problem.force_dofs()
    u0[forces] = 3 * u2[forces] - 2 * u3[forces]
    simulation.set_end_forces({name: 3 * end2[name] - 2 * end3[name] for name in end2})
    of_levels = zip(past.series, zip(known1, known2, known3, strict=True), strict=True)
    begin = [_at_start(known, series.lagged, past.entries(u0)) for series, known in of_levels]
    past.set_series([(value, rate) for rate, value in begin])
    for series, (rate2, _), (rate3, _) in zip(past.series, known2, known3, strict=True):
        series.second = np.where(series.lagged, 0.0, (rate3 - rate2) / h)
    return begin


def _at_start(of_step, lagged, positions):
    """(rate, value) of a series at t = 0, from those after three steps; positions: initial values.

    First derivatives computed by the scheme (rates of positions and values of momenta) are centred; second derivatives
    are extrapolated.
    """
    (rate1, value1), (rate2, value2), (rate3, _) = of_step
    rate = np.where(lagged, 3 * rate2 - 2 * rate3, 1.5 * rate1 - 0.5 * rate2)
    return rate, np.where(lagged, 1.5 * value1 - 0.5 * value2, positions[: len(rate)])


def _solve_tension(simulation, lines, u0):
    """Set the tension of elastic lines in u0 from the positions in u0 and the velocity of their past.

    Newton's method on the rows of the strain equation (11)_2, element by element.
    """
    system = simulation.system
    evolution = next(evolution for evolution in simulation.past.evolutions if evolution.part is lines.part)
    evolution.hand_out(0, 0.0, simulation.past.rate_of(lines.part))
    cells = (lines.T_dofs[lines.stretches] + lines.part.offset).astype(np.int32)
    numbers = system.numbering.lgmap.apply(cells).reshape(cells.shape)
    system.u[:] = u0
    for _ in range(20):
        system.publish()
        residual = system.evaluate()[cells]
        system.assemble_jacobian()
        matrices = [system.A.getValues(n, n) for n in numbers]
        change = np.array([np.linalg.solve(A, b) for A, b in zip(matrices, residual, strict=True)]).reshape(cells.shape)
        system.u[cells] -= change
        T = system.u[cells]
        done = np.abs(change).max(initial=0.0) <= 1e-12 * np.abs(T).max(initial=simulation.problem.typical_force)
        if simulation.comm.allreduce(bool(done), op=MPI.LAND):
            break
    system.publish()
    lines.w.x.scatter_forward()
    u0[lines.part.slice] = lines.w.x.array
