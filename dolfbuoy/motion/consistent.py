"""Consistent initial values: what velocity, acceleration and tension a given start really has.

The tension of an inextensible cable, and the force at a mooring point, are second derivatives in disguise.  At t = 0
they follow from the positions, the velocity that the constraints admit, and the loads.
"""

import numpy as np
from mpi4py import MPI

from ..solver import compat
from .schemes import BackwardEuler, Predictor, Series

#: Components p and L_C of the buoy's state (r_C, p, q_4, L_C).
MOMENTA = np.isin(np.arange(13), [3, 4, 5, 10, 11, 12])


def make_consistent(simulation) -> None:
    """Project the velocity onto the constraints and find the tension and acceleration that go with it.

    By tiny backward-Euler steps: the first one finds the admissible velocity that is nearest in kinetic energy.  All is
    right up to the square of that step.  The tension of an elastic cable is exactly that of its stretch, unless that
    tells only the mean of an element (strain = "element-average").
    """
    u0, scheme, simulation.scheme = simulation.system.u.copy(), simulation.scheme, BackwardEuler()
    h = max(1e-3 * simulation.scene.time.step, 1e-5)  # not smaller: rounding in the tension grows like 1/h^2
    first = _settle(simulation, u0, h)
    second = _settle(simulation, u0, h)  # what it adds to an admissible velocity, both have added
    for name, series in simulation.series.items():
        series.rate, series.values[0] = (2 * a - b for a, b in zip(first[name], second[name], strict=True))
    if simulation.cable:
        simulation.series["r"].second = simulation.series["v"].rate
        if np.isfinite(simulation.scene.cable.axial_stiffness) and simulation.cable.mean_dofs is None:
            _solve_tension(simulation, u0)
    if simulation.buoy:
        u0[simulation.problem.state_part.slice] = simulation.series["y"].values[0]
    simulation.t, simulation.scheme, simulation.quaternion_drift = 0.0, scheme, 0.0
    simulation.system.u[:] = u0
    simulation.problem.set_time(0.0)


def _settle(simulation, u0, h):
    """Three steps of h from the positions u0 with the velocity at hand, and back; puts the forces of t = 0 into u0.

    Returns name -> (rate, value), with which the series begin anew.  Velocities are centred at t = 0: those of the
    first two steps belong to h/2 and 3 h/2, as the positions tell.  Accelerations and forces are extrapolated from the
    ends of the second and third step, because the first one is a blow.
    """
    problem, system = simulation.problem, simulation.system
    system.u[:], simulation.t = u0, 0.0
    found = []
    for _ in range(3):
        simulation.predictor = Predictor(1)
        simulation.predictor.add(simulation.t, system.u)
        simulation.step(h)
        rates = {name: (series.rate, series.values[0]) for name, series in simulation.series.items()}
        found.append((rates, system.u.copy(), simulation.end_tension))
    (rates1, _, _), (rates2, u2, end2), (rates3, u3, end3) = found

    def velocity(name, which):
        return 1.5 * rates1[name][which] - 0.5 * rates2[name][which]

    forces = _force_dofs(simulation)
    u0[forces] = 3 * u2[forces] - 2 * u3[forces]
    begin = {}
    if simulation.cable:
        begin["r"] = velocity("r", 0), u0[problem.cable_part.slice]
        begin["v"] = 3 * rates2["v"][0] - 2 * rates3["v"][0], velocity("r", 0)
        simulation.end_tension = 3 * end2 - 2 * end3
    if simulation.buoy:
        rate = np.where(MOMENTA, 3 * rates2["y"][0] - 2 * rates3["y"][0], velocity("y", 0))
        begin["y"] = rate, np.where(MOMENTA, velocity("y", 1), u0[problem.state_part.slice])
    lagged = {"r": False, "v": True, "y": MOMENTA}
    for name, (rate, value) in begin.items():
        simulation.series[name] = Series(value, rate, lagged[name])
    if simulation.buoy:
        simulation.series["y"].second = np.where(MOMENTA, 0.0, (rates3["y"][0] - rates2["y"][0]) / h)
    return begin


def _tension_dofs(cable):
    """Local unknowns that are tensions of the cable."""
    dofs = cable.T_dofs.ravel()
    return dofs if cable.mean_dofs is None else np.concatenate([dofs, cable.mean_dofs])


def _force_dofs(simulation):
    """Local unknowns that are tensions, or the force at the mooring point."""
    dofs, mooring = np.zeros(0, dtype=int), simulation.problem.mooring_slice
    if simulation.cable:
        dofs = _tension_dofs(simulation.cable)
    if mooring and simulation.buoy:
        dofs = np.concatenate([dofs, np.arange(mooring.start + 3, mooring.stop)])
    return dofs


def _solve_tension(simulation, u0):
    """Put into u0 the tension of an elastic cable with the positions of u0 and the velocity of its series.

    Newton on the rows of the strain equation (11)_2, element by element.
    """
    system, cable = simulation.system, simulation.cable
    cable.gamma_v.value, cable.history_v.x.array[:] = 0.0, simulation.series["r"].rate
    cells = cable.T_dofs[: cable.mesh.topology.index_map(1).size_local].astype(np.int32)
    numbers = system.lgmap.apply(cells).reshape(cells.shape)
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
    compat.scatter_forward(cable.w)
    u0[simulation.problem.cable_part.slice] = cable.w.x.array
