"""Falling chains of rods, their states, and the orders of the schemes used."""

import numpy as np

SCHEMES = {"backward-euler": 1, "bdf2": 2, "generalized-alpha": 2}


def rods(angles, scheme, step, length=1.0, density=1.0):
    """A hanging chain of rods at these angles from the downward vertical, released at rest."""
    h = length / len(angles)
    x, z = np.cumsum(h * np.sin(angles)), np.cumsum(-h * np.cos(angles))
    points = [[0.0, 0.0, 0.0], *([float(a), 0.0, float(b)] for a, b in zip(x, z, strict=True))]
    return {
        "cable": {"length": length, "line_density": density, "elements": len(angles), "top": {"kind": "free"}},
        "initial": {"kind": "polyline", "points": points},
        "time": {"end": 10.0, "step": step, "scheme": scheme},
    }


def two_rods(scheme, step):
    return rods(np.radians([45.0, 0.0]), scheme, step)


def state(simulation):
    """(r, v, T) at the nodes and in the elements, starting from the anchor."""
    cable, u = simulation.problem.lines, simulation.system.u
    nodes, cells = np.argsort(cable.node_s), np.argsort(cable.cell_ends[:, 0])
    velocity = simulation.past.series[0].rate
    return u[cable.node_dofs[nodes]], velocity[cable.node_dofs[nodes]], u[cable.T_dofs[cells]]
