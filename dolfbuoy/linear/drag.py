"""Linearised drag in waves of finite height: its derivative, averaged over the velocities in the waves.

|v| v has zero derivative at rest.  In a Gaussian sea the best linear law is B_ij = E[d(|v| v_i)/dv_j] for the relative
velocity with its mean, the current (Borgman; Atalik and Utku).  The forms provide d/dv exactly: B is the mean of the
exact K and E over samples of the velocity, for every term that depends on velocity; no drag law is implemented again.

- Every node of a line has samples from its own covariance, with common random numbers.
- A hull has samples of its six velocities relative to the water, whose motion is approximated by a rigid one across the
  wet axis (least squares), and by its mean over the wet faces along the axis.
- In regular waves the samples are phases of the motion.  There the least-squares law is 2/3 of the mean derivative, for
  every velocity ellipse without a mean (|v| v is homogeneous of degree 2); so amplitudes are multiplied by 2/3.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags

from ..model.rigid import rotation_of
from .layout import Body, nodes_of
from .linearisation import Linearisation, WithReactions

#: Amplitude factor with which the mean derivative is the least-squares one of a cycle.
CYCLE = 2 / 3
#: Phases of a cycle; pairs of opposite samples of a Gaussian velocity.
PHASES, PAIRS = 16, 64


@dataclass
class Sea:
    """Complex amplitudes of the water velocity at one frequency, per metre.

    at_nodes: one array (n, 3) for each line.  on_hulls: (6,) for each body, velocity of C and angular velocity.
    """

    at_nodes: list[NDArray[Any]]
    on_hulls: list[NDArray[Any]]


class Velocities:
    """Conversion between velocities and the unknowns of the linearised equations."""

    def __init__(self, found: Linearisation):
        self.found = found
        self._axes = [_WetAxis(body, found.problem.buoys[body.name]) for body in found.bodies]

    def of_water(self, velocity: Callable[..., Any]) -> Sea:
        """Sea for a water velocity given as a function of points (n, 3)."""
        at_nodes = [velocity(line.positions) for line in self.found.lines]
        return Sea(at_nodes, [axis.fit @ velocity(axis.points).ravel() for axis in self._axes])

    def relative(self, X: NDArray[Any], omega: float, water: Sea) -> Sea:
        """Velocities relative to the water, for a motion Re[X exp(-i omega t)]."""
        found = self.found
        at_nodes = [-1j * omega * line.moved(X) - u for line, u in zip(found.lines, water.at_nodes, strict=True)]
        on_hulls = [-1j * omega * body.motion(X) - u for body, u in zip(found.bodies, water.on_hulls, strict=True)]
        return Sea(at_nodes, on_hulls)

    def as_rates(self, velocity: Sea) -> tuple[NDArray[Any], NDArray[Any]]:
        """(rates of the lines' unknowns, state of the buoys) with these velocities, both by local unknown."""
        problem = self.found.problem
        kind = np.result_type(*velocity.at_nodes, *velocity.on_hulls, float)
        rates, state = (np.zeros(problem.system.size, kind) for _ in range(2))
        for dofs, values in zip(self._nodes, velocity.at_nodes, strict=True):
            rates[dofs] = values
        self._tie(rates)
        for body, values in zip(self.found.bodies, velocity.on_hulls, strict=True):
            state[problem.system.order[body.at.momentum]] = body.mass * values[:3]
            state[problem.system.order[body.at.angular_momentum]] = body.inertia @ values[3:]
        return rates, state

    def _tie(self, rates: NDArray[Any]) -> None:
        """Copy the rate of one of the tied unknowns at a joint to the others."""
        index, given = self.found.problem.system.numbering.global_index, np.zeros(len(rates), dtype=bool)
        for dofs in self._nodes:
            given[dofs] = index[dofs] >= 0
        shared, free = np.zeros(self.found.K.shape[1], rates.dtype), index >= 0
        shared[index[given]] = rates[given]
        rates[free] = shared[index[free]]

    @cached_property
    def _nodes(self) -> list[NDArray[Any]]:
        lines: Any = self.found.problem.lines
        return [] if lines is None else nodes_of(lines)


class _WetAxis:
    """Points on the wet axis of a body, and the matrix (6, 3 points) from water velocities there to six velocities.

    Across the axis: least-squares fit of a rigid motion.  Along it: the mean over the wet faces.
    """

    def __init__(self, body: Body, buoy: Any):
        legendre: Any = np.polynomial.legendre
        d, x = rotation_of(body.orientation)[:, 2], legendre.leggauss(8)[0]
        shape, center = buoy.shape, buoy.mass.height
        surface = center - body.position[2] / d[2] if abs(d[2]) > 1e-6 else shape.height
        low, high = (0.0, min(surface, shape.height)) if d[2] > 0 else (max(surface, 0.0), shape.height)
        heights, areas = _faces(shape)
        wet = (heights >= low) & (heights <= high)
        heights, areas = (heights[wet], areas[wet]) if areas[wet].sum() > 0 else (np.array([low]), np.ones(1))
        along = (low + high) / 2 + max(high - low, 0.0) / 2 * x
        levers = (np.concatenate([along, heights]) - center)[:, None] * d
        self.points = body.position + levers
        across = np.eye(3) - np.outer(d, d)
        rigid = np.vstack([across @ np.hstack([np.eye(3), -_crossing(lever)]) for lever in levers[: len(x)]])
        nearest = np.linalg.pinv(rigid) @ np.kron(np.eye(len(x)), across)
        mean = np.vstack([np.kron(areas / areas.sum(), np.outer(d, d)), np.zeros((3, 3 * len(areas)))])
        self.fit = np.hstack([nearest, mean])


def _faces(shape: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Heights and areas of the faces of a hull normal to its axis: ends, steps and cones."""
    z, R = np.array(shape.stations, dtype=float).T
    squares = (R / 2) ** 2
    heights = np.concatenate([z[:1], (z[1:] + z[:-1]) / 2, z[-1:]])
    return heights, np.concatenate([squares[:1], np.abs(np.diff(squares)), squares[-1:]])


def _crossing(v: NDArray[Any]) -> NDArray[Any]:
    """Matrix of the cross product v x."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


class LinearDrag:
    """Additions to K and E due to drag in waves, and to the wave forces; equations: those with rows of reactions."""

    def __init__(self, velocities: Velocities, equations: WithReactions):
        self.velocities, self.found, self.equations = velocities, velocities.found, equations
        self.forget()

    def forget(self) -> None:
        """Reset to small waves."""
        self.dK = self.dE = csr_matrix(self.equations.K.shape)
        self._sums: tuple[Any, Any] | None = None

    def in_cycle(self, relative: Sea, amplitude: float, share: float = 1.0) -> None:
        """Average in regular waves, from the relative velocities per metre; share: relaxation factor of the update."""
        phases = CYCLE * amplitude * np.exp(-2j * np.pi * (np.arange(PHASES) + 0.5) / PHASES)
        samples = (
            Sea([(v * z).real for v in relative.at_nodes], [(v * z).real for v in relative.on_hulls]) for z in phases
        )
        self._average(samples, share)

    def in_sea(self, relatives: list[Sea], energies: NDArray[Any] | list[float], share: float = 1.0) -> None:
        """Average in a Gaussian sea; energies: S dw [m^2] at the velocities' frequencies.  share: see `in_cycle`."""
        nodes = [_roots(np.array(v), energies) for v in zip(*(r.at_nodes for r in relatives), strict=True)]
        hulls = [_roots(np.array(v), energies) for v in zip(*(r.on_hulls for r in relatives), strict=True)]
        samples = (
            Sea([sign * (root @ xi[:3]) for root in nodes], [sign * (root @ xi[3:]) for root in hulls])
            for xi in self._normal
            for sign in (1, -1)
        )
        self._average(samples, share)

    @cached_property
    def _normal(self) -> Any:
        """Nine quasi-random normal numbers, PAIRS times, with variance 1."""
        from scipy.stats import norm, qmc  # 0.2 s of every start

        numbers = norm.ppf(qmc.Sobol(9, scramble=True, seed=0).random(PAIRS))
        return numbers / np.sqrt((numbers**2).mean(axis=0))

    def _average(self, samples: Iterator[Any], share: float) -> None:
        found, problem = self.found, self.found.problem
        K, E, count = 0, 0, 0
        for sample in samples:
            rates, state = self.velocities.as_rates(sample)
            problem.system.u[:] = found.u + state
            problem.system.publish()
            at_rest = self.equations.jacobian(0.0, 0.0, rates)
            K, E, count = K + at_rest, E + self.equations.jacobian(1.0, 0.0, rates) - at_rest, count + 1
        problem.system.u[:] = found.u
        problem.system.publish()
        dK, dE = (K / count - self.equations.K) @ self._momenta, E / count - self.equations.E
        if share < 1:
            dK, dE = share * dK + (1 - share) * self.dK, share * dE + (1 - share) * self.dE
        self.dK, self.dE = csr_matrix(dK), csr_matrix(dE)
        self._sums = None

    @cached_property
    def _momenta(self) -> Any:
        """Projector on the columns of buoy velocities: other changes of K by waves are not damping."""
        kept = np.zeros(self.equations.size)
        for body in self.found.bodies:
            kept[[*body.at.momentum, *body.at.angular_momentum]] = 1.0
        return diags(kept)

    def matrices(self) -> tuple[Any, Any]:
        """K and E including the linearised drag."""
        if self._sums is None:
            self._sums = self.equations.K + self.dK, self.equations.E + self.dE
        return self._sums

    def force(self, water: Sea) -> NDArray[Any]:
        """Contribution of drag to the derivative of the residual with respect to the wave amplitude."""
        rates, state = (values[self.found.problem.system.order] for values in self.velocities.as_rates(water))
        return np.asarray(-(self.dE @ rates + self.dK @ state))


def _roots(velocities: NDArray[Any], energies: NDArray[Any] | list[float]) -> Any:
    """Symmetric square roots (..., d, d) of the covariances of complex velocities (frequencies, ..., d)."""
    covariance = np.einsum("n,n...i,n...j->...ij", energies, velocities, velocities.conj()).real
    values, vectors = np.linalg.eigh(covariance)
    return (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]) @ np.swapaxes(vectors, -1, -2)
