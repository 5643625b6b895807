"""A rod as a plane chain of rigid links joined by springs, from Lagrange's equations."""

import numpy as np
from scipy.integrate import solve_ivp


def falling_rod(length, density, EI, gravity, links, times):
    """(x, z) of the tip [m] at `times` [s], (times, 2), of a rod along x that is clamped at the origin and let go.

    Links are uniform; their angles are the coordinates.  Springs have EI/h between links and 2 EI/h at the clamp, so
    that the error is of order h^2.
    """
    h = length / links
    arms = h * (np.tri(links, k=-1) + 0.5 * np.eye(links))  # of the centre of each link, in units of the links' vectors
    coupling = density * h * arms.T @ arms
    weights = density * h * gravity * arms.sum(axis=0)
    inertia = density * h**3 / 12 * np.eye(links)
    springs = np.append(2.0, np.ones(links - 1)) * EI / h

    def rate(_, state):
        angles, speeds = np.split(state, 2)
        apart = angles[:, None] - angles
        moments = springs * np.diff(angles, prepend=0.0)
        torque = np.append(moments[1:], 0.0) - moments - weights * np.cos(angles)
        torque -= (coupling * np.sin(apart)) @ speeds**2
        return np.concatenate([speeds, np.linalg.solve(coupling * np.cos(apart) + inertia, torque)])

    start = np.zeros(2 * links)
    found = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-9).y[:links]
    return h * np.column_stack([np.cos(found).sum(axis=0), np.sin(found).sum(axis=0)])
