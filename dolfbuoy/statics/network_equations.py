"""Equations of a network of catenaries, and their solution without an initial guess.

Unknowns: for every free joint its position x and the bed reaction R; for every piece the tension vector n at its start
and the least height d of the line above the bed.  With l(d) the grounded length, V_0 = n_z, V_1 = V_0 + w (L - l),
V_l the median of 0, V_0, V_1, h = |(n_x, n_y)|, T = |(h, V)|, e = T + T^2/(2 EA):

    n_xy ((asinh(V_1/h) - asinh(V_0/h))/w + l/T_l + L/EA)  =  (x_end - x_start)_xy
    z_start - d = (e_0 - e_l)/w,   z_end - d = (e_1 - e_l)/w            (plus l de_l/dV_l if V_l is not 0)
    sum of the pieces' ends + load + R e_z = 0
    l = 0 if d > 0, L if d < 0;   R z = 0, none of them negative         (z: heights above the bed)

A buoyant piece under the surface is treated upside down: z, n_z, w and V change sign, and so does R of a joint with
only such pieces.  A piece in a current is treated in a frame whose vertical is the direction of weight plus drag.

Tension-only lines have a convex energy, and so has a bed without friction: there is one equilibrium (for slack lines
only the tension is unique), and these are the equations of a saddle point, convex in x and d, concave in the forces and
l.  They are smoothed by one parameter: h^2 -> h^2 + eps^2, an additional compliance eps/F^2, R z = eps, and
d = eps (1/l - 1/(L - l)).  At eps = F, a typical force, they are nearly linear and Newton converges from any guess; eps
is then reduced almost to 0, with the state predicted along the tangent.
"""

import itertools
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import SolveError
from .catenary import Array

if TYPE_CHECKING:
    from .network import Joint, Network

#: Final smoothing relative to a typical force; the additional compliance is removed earlier.
LAST_EPS = 1e-13
#: Final compliance and R z.
LAST_SOFTNESS = 1e-16
#: Acceptable smoothing if slack lines do not allow less.
GOOD_EPS = 1e-6
#: Residual in typical lengths and forces at which a state is accepted: while eps decreases, and finally.
LOOSE, TIGHT = 1e-6, 1e-9
#: Limit of evaluations for a network under a surface: most take a fifth of them.
PATIENCE = 800
TINY = 1e-40  # complex step: derivatives exact to rounding
#: Unknowns up to which dense matrices are used: importing SciPy takes 0.1 s.
DENSE = 200


class State(NamedTuple):
    """Unknowns, smoothing and compliance, with the residual and Jacobian."""

    y: Array
    eps: float
    softness: float
    residual: Array
    jacobian: Any


class Near(NamedTuple):
    """Unknowns of a solution, with their smoothing and unit of force [N]."""

    y: Array
    eps: float
    force_unit: float


class Equations:
    """Residual and Jacobian in units of a typical force and length; `solve` returns the equilibrium in SI units."""

    def __init__(self, network: "Network"):
        self.network, pieces, joints, self.evaluations = network, network.pieces, network.joints, 0
        self.free = np.array([i for i, joint in enumerate(joints) if joint.free], int)
        self.length_unit = max(piece.length for piece in pieces)
        self.force_unit = self._typical_force()
        self.L, self.w, EA = (
            np.array([getattr(piece, name) for piece in pieces], float) for name in ("length", "w", "EA")
        )
        self.L, self.w = self.L / self.length_unit, self.w * self.length_unit / self.force_unit
        self.compliance = self.force_unit / EA
        self.joint = np.array([[piece.start, piece.end] for piece in pieces])
        self.offset = np.array([[piece.start_offset, piece.end_offset] for piece in pieces], float) / self.length_unit
        self.turned = np.diff(self._steps_from_the_lowest()[self.joint])[:, 0] < 0
        for ends in (self.joint, self.offset):
            ends[self.turned] = ends[self.turned, ::-1]
        # 1: over the bed, -1: upside down under the surface; pieces with drag have their own frames
        self.side = np.where([network.floats(piece) for piece in pieces], -1.0, 1.0)
        tilted = np.array([bool(np.any(piece.drag)) for piece in pieces])
        self.touches = (self.side < 0) | ((self.w > 0) & (network.floor is not None) & ~tilted)
        self.drag = np.array([piece.drag for piece in pieces], float) * self.length_unit / self.force_unit
        self.own_w = np.where(
            tilted, np.hypot(np.hypot(*self.drag[:, :2].T), self.w - self.drag[:, 2]), self.side * self.w
        )
        frames = [
            piece.frame if t else np.diag([1.0, 1.0, s]) for piece, t, s in zip(pieces, tilted, self.side, strict=True)
        ]
        self.frames = np.array(frames)
        self.turns = bool(tilted.any() or (self.side < 0).any())
        self.level = np.where(self.side < 0, network.surface or 0.0, network.floor or 0.0) / self.length_unit
        self.joint_side = np.array([self._side_of(i) for i in self.free])
        self.joint_touches = (self.joint_side < 0) | (network.floor is not None)
        under = np.where(self.joint_side < 0, network.surface or 0.0, network.floor or 0.0)
        self.joint_level = under / self.length_unit
        self.columns = np.full(len(joints), -1)
        self.columns[self.free] = 3 * np.arange(len(self.free))

    def _side_of(self, i: int) -> float:
        """-1 for a free joint of floating pieces only and without a downward load, 1 for all others."""
        joint, (start, end) = self.network.joints[i], self.joint.T
        at, load = (start == i) | (end == i), joint.load
        sinks = callable(load) or np.asarray(load)[2] < 0
        return -1.0 if at.any() and np.all(self.side[at] < 0) and not sinks else 1.0

    def _steps_from_the_lowest(self) -> Array:
        """Number of pieces from each joint to the lowest fixed one: Newton is faster if pieces start near the bed."""
        joints = self.network.joints
        heights = np.array([np.inf if joint.position is None or joint.free else joint.position[2] for joint in joints])
        steps = np.where(heights <= heights.min() + 1e-6 * self.length_unit, 0, len(heights))
        before = steps - 1
        while not np.array_equal(steps, before):
            before = steps.copy()
            for a, b in self.joint:
                steps[a], steps[b] = min(steps[a], steps[b] + 1), min(steps[b], steps[a] + 1)
        return steps

    def _typical_force(self) -> float:
        loads = [
            float(np.linalg.norm(self._load(joint, np.zeros(3) if joint.position is None else joint.position)[0]))
            for joint in self.network.joints
            if joint.free
        ]
        forces = [*loads, *(abs(piece.w) * piece.length for piece in self.network.pieces)]
        stiff = [1e-2 * piece.EA for piece in self.network.pieces if np.isfinite(piece.EA)]
        return max(forces) or min(stiff, default=1.0)

    @staticmethod
    def _load(joint: "Joint", position: Any) -> tuple[Array, Array]:
        """Net force on a joint and its derivative."""
        if not callable(joint.load):
            return np.add(joint.load, joint.push), np.zeros((3, 3))
        force, slope = joint.load(np.asarray(position, float))
        return force + joint.push, slope

    @cached_property
    def slices(self) -> list[slice]:
        """Slices of x, n, d and R in the vector of unknowns, and of their equations in the residual."""
        sizes = np.cumsum([0, 3 * len(self.free), 3 * len(self.L), len(self.L), len(self.free)])
        return [slice(a, b) for a, b in itertools.pairwise(sizes)]

    def split(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """x of all joints, n, d, R."""
        x, n, d, R = (y[part] for part in self.slices)
        positions = self.held.copy()
        positions[self.free] = x.reshape(-1, 3)
        return positions, n.reshape(-1, 3), d, R

    @cached_property
    def held(self) -> Array:
        """Positions of fixed joints, and initial guesses for the others."""
        known = [np.asarray(joint.position) for joint in self.network.joints if joint.position is not None]
        middle = np.mean(known, axis=0) if known else np.zeros(3)
        afloat = middle * [1.0, 1.0, 0.0]  # at the water line, where position-dependent loads vary
        guesses = [
            (afloat if callable(joint.load) else middle) if joint.position is None else np.asarray(joint.position)
            for joint in self.network.joints
        ]
        return np.array(guesses, float) / self.length_unit

    def lying(self, d: Array, eps: float) -> Array:
        """Grounded length l of every piece, between 0 and L, from d."""
        if not self.touches.any():
            return np.zeros_like(d)
        d = np.where(self.touches, d, 0.0)
        root = np.sqrt((d * self.L) ** 2 + 4 * eps**2)
        less = np.where(np.real(d) > 0, d, -d)  # from the nearer limit, 0 or L
        small = 2 * eps * self.L / (less * self.L + 2 * eps + root)
        return np.where(self.touches, np.where(np.real(d) > 0, small, self.L - small), 0.0)

    def law(self, nx: Array, ny: Array, V0: Array, d: Array, eps: float, more: float) -> Array:
        """End minus start (3 rows), height of the start and vertical tension at the end, for all pieces."""
        w, c, lying, n_z = self.own_w, self.compliance + more, self.lying(d, eps), V0
        if self.turns:
            nx, ny, V0 = np.einsum("pij,j...p->i...p", self.frames, np.array([nx, ny, V0]))
        h2, hanging = nx**2 + ny**2 + eps**2, self.L - lying
        V1 = V0 + w * hanging
        Vl = np.where(np.real(V0) > 0, V0, np.where(np.real(V1) < 0, V1, 0.0))
        T0, T1, Tl = (np.sqrt(h2 + V**2) for V in (V0, V1, Vl))
        width = _integral_of_one_over_T(V0, V1, T0, T1, np.sqrt(h2), w, hanging) + lying / Tl + self.L * c
        askew = lying * Vl * (1 / Tl + c)
        rise = hanging * (V0 + V1) * (1 / (T0 + T1) + c / 2) + askew
        drop = (V0 - Vl) * (V0 + Vl) / np.where(self.touches, w, 1.0) * (1 / (T0 + Tl) + c / 2)
        height = d + drop - np.where(np.real(V0) > 0, askew, 0.0)
        chord = np.array([nx * width, ny * width, rise])
        if self.turns:
            chord = np.einsum("pij,i...p->j...p", self.frames, chord)
            V1 = n_z + self.w * hanging - self.drag[:, 2] * self.L
        return np.array([*chord, height, V1])

    def evaluate(self, y: Array, eps: float, more: float, jacobian: bool = False) -> Any:
        """Residual, or with `jacobian` (residual, Jacobian)."""
        self.evaluations += 1
        if self.network.surface is not None and self.evaluations > PATIENCE:
            raise SolveError("no rest of lines under the surface was found")
        positions, n, d, R = self.split(y)
        ends, arguments = positions[self.joint] + self.offset, np.array([*n.T, d])
        if jacobian:  # each argument in turn
            nx, ny, V0, least = arguments[:, None] + 1j * TINY * np.eye(4)[:, :, None]
            found = self.law(nx, ny, V0, least, eps, more)
            (*values, V1), slopes = found[:, 0].real, found.imag / TINY
        else:
            *values, V1 = self.law(n[:, 0], n[:, 1], n[:, 2], d, eps, more)
        loads = [self._load(self.network.joints[i], positions[i] * self.length_unit) for i in self.free]
        heights = self.joint_side * (positions[self.free, 2] - self.joint_level)
        free = (R, np.ones_like(R), np.zeros_like(R))
        pair = [np.where(self.joint_touches, a, b) for a, b in zip(_pair(R, heights, more), free, strict=True)]
        residual = np.concatenate([
            self._balance(n, V1, R, loads).ravel(),
            (np.transpose(values[:3]) - (ends[:, 1] - ends[:, 0])).ravel(),
            np.where(self.touches, values[3] - self.side * (ends[:, 0, 2] - self.level), d),
            pair[0],
        ])  # fmt: skip
        return (residual, self._assemble(slopes, loads, *pair[1:])) if jacobian else residual

    def _balance(self, n: Array, V1: Array, R: Array, loads: Sequence[tuple[Array, Array]]) -> Array:
        total: Array = np.zeros_like(self.held)
        np.add.at(total, self.joint[:, 0], n)
        across = n[:, :2] - self.drag[:, :2] * self.L[:, None]
        np.subtract.at(total, self.joint[:, 1], np.column_stack([across, V1]))
        total = total[self.free] + np.array([force for force, _ in loads]).reshape(-1, 3) / self.force_unit
        total[:, 2] += self.joint_side * R
        return total

    @cached_property
    def _places(self) -> list[Array]:
        """(rows, columns) of the entries of the Jacobian, in the order of `_assemble`; negative: absent."""
        x0, n0, d0, R0 = (part.start for part in self.slices)
        pieces, joints = np.arange(len(self.L)), np.arange(len(self.free))
        start, end = (np.where(self.columns[side] < 0, -9, x0 + self.columns[side]) for side in self.joint.T)
        n, d, x, R = n0 + 3 * pieces, d0 + pieces, x0 + 3 * joints, R0 + joints
        found = [place for i in range(3) for place in ((n + i, start + i), (n + i, end + i), (start + i, n + i))]
        found += [(end, n), (end + 1, n + 1), (d, start + 2)]
        for column in (n, n + 1, n + 2, d):
            found += [(row, column) for row in (n, n + 1, n + 2, d, end + 2)]
        found += [(x + i, x + k) for i in range(3) for k in range(3)]
        found += [(x + 2, R), (R, R), (R, x + 2)]
        return [np.concatenate(part) for part in zip(*found, strict=True)]

    def _assemble(self, slopes: Array, loads: Sequence[tuple[Array, Array]], by_R: Array, by_height: Array) -> Any:
        """Jacobian; slopes[row, k]: derivatives of the law with respect to n_x, n_y, n_z and d."""
        one, size = np.ones(len(self.L)), self.slices[-1].stop
        slopes[3] = np.where(self.touches, slopes[3], np.array([[0.0], [0.0], [0.0], [1.0]]))
        slopes[4] *= -1
        derivatives = np.array([slope for _, slope in loads]).reshape(-1, 9).T * self.length_unit / self.force_unit
        values = [one, -one, one] * 3 + [-one, -one, np.where(self.touches, -self.side, 0.0)]
        values += [
            slopes.swapaxes(0, 1).ravel(),
            derivatives.ravel(),
            self.joint_side,
            by_R,
            by_height * self.joint_side,
        ]
        rows, columns = self._places
        use = (rows >= 0) & (columns >= 0)
        rows, columns, entries = rows[use], columns[use], np.concatenate(values)[use]
        if size > DENSE:
            from scipy.sparse import csc_matrix

            return csc_matrix((entries, (rows, columns)), shape=(size, size))
        return np.bincount(rows * size + columns, entries, size * size).reshape(size, size)

    def solve(self, near: Near | None = None) -> tuple[Array, Array, Array, Array, Near]:
        """(positions, n at the start as given, grounded lengths, ends) in SI units, and the state for similar networks.

        near: state of another network with as many joints and pieces, tried first.  Raises SolveError.
        """
        y, eps = self._from(near) or self._follow(self._nowhere())
        state = Near(y.copy(), eps, self.force_unit)
        positions, n, d, _ = self.split(y)
        lying, ends = self.lying(d, eps), positions[self.joint] + self.offset
        n[self.turned, 2] += (self.w * (self.L - lying))[self.turned]
        n[self.turned] -= (self.drag * self.L[:, None])[self.turned]
        n[self.turned] *= -1
        ends[self.turned] = ends[self.turned, ::-1]
        x, lying, ends = (length * self.length_unit for length in (positions, lying, ends))
        return x, n * self.force_unit, lying, ends, state

    def _nowhere(self) -> Array:
        """Initial unknowns at eps = 1: joints at known positions or in the middle, pieces carried by both ends."""
        guess, (places, pulls, _, reactions) = np.zeros(self.slices[-1].stop), self.slices
        guess[places] = self.held[self.free].ravel()
        guess[pulls][2::3] = -self.w * self.L / 2
        guess[reactions] = np.where(self.joint_touches, 0.1, 0.0)
        return guess

    def _from(self, near: Near | None) -> tuple[Array, float] | None:
        """State and smoothing from those of a similar network; None if Newton does not converge from there."""
        if near is None or near.y.size != self.slices[-1].stop or near.eps > LAST_EPS:
            return None
        y = near.y.copy()
        for forces in (self.slices[1], self.slices[3]):
            y[forces] *= near.force_unit / self.force_unit
        try:
            y = self._newton(self._state(y, near.eps, LAST_SOFTNESS), 1e-14, accepted=TIGHT).y
        except SolveError:
            return None
        return None if self._is_broken(y, LAST_SOFTNESS) else (y, near.eps)

    def _is_broken(self, y: Array, softness: float) -> bool:
        """True if the artificial compliance matters, which means that inextensible lines are too short."""
        return bool(softness * np.abs(y[self.slices[1]]).max() > GOOD_EPS)

    def _follow(self, y: Array, eps: float = 1.0, factor: float = 0.1) -> tuple[Array, float]:
        """State and smallest eps, by continuation in eps from 1, with smaller steps if Newton fails."""
        state, softness = self._newton(self._state(y, eps, eps), LOOSE), eps
        try:
            while eps > LAST_EPS:
                target = max(eps * factor, LAST_EPS)
                try:
                    state = self._newton(self._predicted(state, target), LOOSE)
                except SolveError:
                    factor = factor**0.5
                    if factor > 0.9:
                        raise
                else:
                    eps, factor = target, max(factor**2, 1e-4)
            state = self._newton(self._state(state.y, eps, LAST_SOFTNESS), 1e-14, accepted=TIGHT)
            softness = LAST_SOFTNESS
        except SolveError:
            softness = eps
            if eps > GOOD_EPS:
                raise
        if self._is_broken(state.y, softness):
            raise SolveError("no rest of the lines was found: inextensible ones are too short")
        return state.y, eps

    def _state(self, y: Array, eps: float, more: float) -> State:
        return State(y, eps, more, *self.evaluate(y, eps, more, jacobian=True))

    def _predicted(self, state: State, target: float) -> State:
        """State predicted along the tangent: slack tensions and small heights are proportional to eps."""
        y, eps, change = state.y, state.eps, 1e-6 * state.eps
        slope = (self.evaluate(y, eps + change, eps + change) - state.residual) / change
        ahead = self._state(y - (target - eps) * _solved(state.jacobian, slope), target, target)
        stays = np.linalg.norm(self.evaluate(y, target, target))
        return ahead if np.linalg.norm(ahead.residual) < stays else self._state(y, target, target)

    def _newton(self, state: State, enough: float, accepted: float | None = None) -> State:
        """Newton down to a residual of `enough`, or of `accepted` if rounding allows no less."""
        for _ in range(60):
            norm = float(np.linalg.norm(state.residual))
            if norm < enough:
                return state
            step = _solved(state.jacobian, -state.residual)
            for halvings in range(30 if np.all(np.isfinite(step)) else 0):
                fraction = 0.5**halvings
                trial = self._state(state.y + fraction * step, state.eps, state.softness)
                if np.linalg.norm(trial.residual) < (1 - 1e-4 * fraction) * norm:
                    state = trial
                    break
            else:
                break
        if norm > (accepted or enough):
            raise SolveError(f"no rest of the lines was found (residual {norm:.1e} at smoothing {state.eps:.0e})")
        return state


def _solved(matrix: Any, right: Array) -> Any:
    """Solution of a linear system; not finite if it is singular."""
    try:
        if isinstance(matrix, np.ndarray):
            return np.linalg.solve(matrix, right)
        from scipy.sparse.linalg import spsolve

        return spsolve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full_like(right, np.inf)


def _integral_of_one_over_T(V0: Array, V1: Array, T0: Array, T1: Array, h: Array, w: Array, length: Array) -> Array:
    """Integral of 1/T over a hanging length, from whichever of its two forms has no cancellation."""
    across = np.real(V0) * np.real(V1) < 0
    x = np.where(across, 0.0, w * length / (T0 + T1))
    small = np.abs(x) < 1e-3
    safe = np.where(small, 0.5, x)
    along = 2 * length / (T0 + T1) * np.where(small, 1 + x**2 / 3 + x**4 / 5, np.arctanh(safe) / safe)
    return np.where(across, (np.arcsinh(V1 / h) - np.arcsinh(V0 / h)) / np.where(across, w, 1.0), along)


def _pair(a: Array, b: Array, eps: float) -> tuple[Array, Array, Array]:
    """Smoothed Fischer-Burmeister function, 0 where a b = eps with both positive, and its derivatives."""
    size = np.sqrt(a**2 + b**2 + 2 * eps)
    return a + b - size, 1 - a / size, 1 - b / size
