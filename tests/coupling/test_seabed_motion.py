"""Lines moving on a sea bed: sticking friction, energy, momentum, rejected steps.

Source: balances of momentum and energy; the state of rest itself.
"""

import numpy as np
import pytest
import ufl
from alone import simulate
from dolfinx import fem
from dynamics_helpers import merged, running
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.model import contact as bed
from dolfbuoy.model.lines import top_position
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion.energy import STORED, Meter
from dolfbuoy.solver.compat import real_space
from dolfbuoy.solver.unknowns import Contribution, Part

CHAIN = {
    "sea": {"depth": 20.0, "dry_above": False},  # its top heaves out of it: the balances have one weight
    "cable": {
        "length": 60.0,
        "line_density": 40.0,
        "diameter": 0.09,
        "area": 0.005,
        "axial_stiffness": 5e5,
        "elements": 16,
        "added_mass": 1.0,
        "normal_drag": 1.4,
        "tangential_drag": 0.3,
        "top": {
            "kind": "prescribed",
            "position": [52.0, 0.0, 0.0],
            "amplitude": [0.6, 0.3, 1.0],
            "phase_deg": [40.0, 100.0, 0.0],
            "period": 6.0,
            "ramp": 3.0,
        },
    },
    "seabed": {"friction": 0.7},
    "time": {"end": 6.0, "step": 0.02, "scheme": "bdf2"},
}
PAIRS = [{"position_degree": mu, "tension_degree": nu} for mu, nu in ((1, 0), (2, 1), (3, 2))]
LAWS = ["compressive", "tension-only"]
SCHEMES = ["backward-euler", "bdf2", "generalized-alpha"]


def still(scene):
    """The scene with its top at rest."""
    top = {"kind": "fixed", "position": scene["cable"]["top"]["position"]}
    return scene | {"cable": scene["cable"] | {"top": top}}


@pytest.mark.parametrize("slack", LAWS)
@pytest.mark.parametrize("pair", PAIRS, ids=str)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_pair_law_and_scheme_moves(pair, slack, scheme):
    """No step fails, the touchdown travels, and some points slide."""
    radius = {"spectral_radius": 0.0} if scheme == "generalized-alpha" else {}
    scene = merged(CHAIN, cable=merged(CHAIN["cable"], slack=slack, **pair), time__end=3.0, time__scheme=scheme)
    scene["time"] |= radius
    with running(scene) as simulation:
        lines, bed = simulation.problem.lines, simulation.problem.lines.bed
        held, lying = bed.holds, []
        for _ in simulation.run():
            lying.append(bed.grounded(simulation.system.u).length)
        assert simulation.control.failed == 0
        assert np.ptp(lying) > 1.0
        lies = bed.gap(bed.points.of(simulation.system.u[lines.node_dofs])) < 0
        assert np.abs(bed.holds - held)[lies].max() > 0.01


@pytest.mark.parametrize("slack", LAWS)
def test_friction_holds_for_a_minute(slack):
    """At rest, tension held by friction does not relax to the frictionless value."""
    scene = still(merged(CHAIN, cable__slack=slack, seabed__start="pulled", time={"end": 60.0, "step": 0.1}))
    run = simulate(scene)
    free = simulate(merged(scene, seabed={"friction": 0.7, "start": "frictionless"}, time__end=0.0))
    loose = float(free.tension_anchor[0])
    assert float(run.tension_anchor[0]) < 0.8 * loose
    for tension in (run.tension_anchor.values, run.tension_top.values):
        assert np.abs(tension - tension[0]).max() < 1e-5 * loose


def test_friction_holds_after_a_motion():
    """After a storm: once the top is at rest, the tension on the bed stays constant."""
    scene = merged(CHAIN, cable__slack="tension-only", time={"end": 0.0, "step": 0.02, "scheme": "backward-euler"})
    with running(scene) as simulation:
        for _ in simulation.advance(4.5):
            pass
        lines = simulation.problem.lines
        place = top_position(lines.pieces[0].ends[1].top, simulation.t)
        simulation.stop_ends()
        for _ in simulation.advance(40.0):
            pass
        first = simulation.problem.anchor_tension()
        for _ in simulation.advance(60.0):
            pass
        assert simulation.problem.anchor_tension() == pytest.approx(first, rel=1e-4)
    frictionless = simulate(still(merged(scene, cable__top__position=place.tolist(), seabed=None, time__end=0.0)))
    assert abs(first - float(frictionless.tension_anchor[0])) > 0.05 * first


def work_of(scene):
    """(work of each kind, change of stored energy, turnover of the top) over a run, by the trapezoidal rule [J]."""
    with running(scene) as simulation:
        meter = Meter(simulation)
        old, t = meter.read(), 0.0
        first, work, turnover = old, {name: 0.0 for name in old if name not in STORED}, 0.0
        for _ in simulation.run():
            new, h = meter.read(), simulation.t - t
            for name in work:
                work[name] += 0.5 * h * (old[name] + new[name])
            turnover += 0.5 * h * (abs(old["top"]) + abs(new["top"]))
            old, t = new, simulation.t
    return work, {name: old[name] - first[name] for name in STORED}, turnover


class Taken:
    """What backward Euler takes from a line of straight elements in a step [J], in plain numpy, all of it >= 0.

    Of inertia 1/2 rho0 |dv|^2, and of convex energies E the defect E'(x_1) (x_1 - x_0) - E(x_1) + E(x_0): of the
    stretch at every element, and of the springs of the bed at every point of the quadrature.
    """

    def __init__(self, simulation):
        self.simulation, self.lines = simulation, simulation.problem.lines
        c, lines = self.lines.section, self.lines
        self.h, self.EA, self.rho = c.length / c.elements, c.axial_stiffness, c.line_density
        self.k = bed.parameters_of_line(lines.scene, c, bed.hardness(lines.scene, [c])).stiffness
        self.old = self.state()

    def state(self):
        """(positions, velocities, tensions, gap at two Gauss points of each element) in order along the line."""
        lines, u = self.lines, self.simulation.system.u
        order = np.argsort(lines.node_s)
        r, v = u[lines.node_dofs][order], self.simulation.line_velocity[lines.node_dofs][order]
        T = u[lines.T_dofs[np.argsort(lines.T_s[:, 0]), 0]]
        z = r[:, 2] + lines.scene.sea.depth
        at = 0.5 + np.array([[-0.5], [0.5]]) / np.sqrt(3)
        return r, v, T, (1 - at) * z[:-1] + at * z[1:]

    def step(self):
        """Since the last call."""
        (r0, v0, T0, g0), new = self.old, self.state()
        r, v, T, g = self.old = new
        dv, h = v - v0, self.h
        inertia = 0.5 * self.rho * h * (dv[:-1] ** 2 + dv[:-1] * dv[1:] + dv[1:] ** 2).sum() / 3
        slope, change = np.diff(r, axis=0) / h, np.diff(r - r0, axis=0) / h
        stretch = h * (T / (1 + T / self.EA) * (slope * change).sum(axis=1) - (T**2 - T0**2) / (2 * self.EA)).sum()
        below, before = np.maximum(-g, 0), np.maximum(-g0, 0)
        springs = 0.5 * h * self.k * (-below * (g - g0) - (below**2 - before**2) / 2).sum()
        return np.array([inertia, stretch, springs])


def balance_of(scene):
    """(work, stored energy, turnover of the top [J], loss to backward Euler) with powers at the ends of steps."""
    with running(scene) as simulation:
        meter, taken = Meter(simulation), Taken(simulation)
        first, t = meter.read(), 0.0
        work, turnover, lost = {name: 0.0 for name in first if name not in STORED}, 0.0, np.zeros(3)
        for _ in simulation.run():
            last, h = meter.read(), simulation.t - t
            for name in work:
                work[name] += h * last[name]
            turnover += h * abs(last["top"])
            one = taken.step()
            assert one.min() > -1e-9 * turnover
            lost, t = lost + one, simulation.t
    return work, {name: last[name] - first[name] for name in STORED}, turnover, lost


@pytest.mark.parametrize("step", [0.02, 0.005])
def test_energy_to_the_last_joule(step):
    """On the default bed work is stored, dissipated, or taken by the scheme, and how much that is, is known.

    So no account of bed or friction waits for smaller steps.  What the scheme takes are the elastic waves that every
    landing of a node starts; without damping of the line it falls with the step to the power of 0.8.
    """
    time = {"step": step, "scheme": "backward-euler", "end": 6.0}
    work, stored, turnover, lost = balance_of(merged(CHAIN, solver={"step_tolerance": 1e-12}, time=time))
    assert abs(sum(stored.values()) - sum(work.values()) + lost.sum()) < 1e-7 * turnover
    assert work["friction"] < -2e-3 * turnover
    assert work["bed"] < -5e-4 * turnover
    assert lost.min() > 5e-5 * turnover


@pytest.mark.parametrize(("scheme", "steps"), [("backward-euler", 6.4e-4), ("bdf2", 0.01)])
def test_order_of_the_energy(scheme, steps):
    """On the default bed, of a line whose waves are damped, work is stored or dissipated with order 1 at least.

    Of backward Euler once steps resolve how a node lands: it is 0.9 at 0.01 s, and grows to 1 from below.
    """
    defects = []
    for step in (steps, steps / 2):
        scene = merged(CHAIN, cable__damping=1e4, time={"step": step, "scheme": scheme, "end": 6.0})
        work, stored, turnover = work_of(scene)
        assert work["friction"] < -2e-3 * turnover
        assert work["bed"] < -1e-3 * turnover
        defects.append(abs(sum(stored.values()) - sum(work.values())) / turnover)
    assert np.log2(defects[0] / defects[1]) > 0.97
    assert defects[-1] < 1e-4


@pytest.mark.parametrize(("elements", "degree"), [(40, 1), (40, 2)])
def test_energy_at_the_shipped_step(elements, degree):
    """`chain-on-bed` with friction and dampers: the defect is far below 1e-3 of the work of its top."""
    changes = {"cable__elements": elements, "cable__position_degree": degree, "cable__tension_degree": degree - 1}
    scene, defects = load_scene("chain-on-bed", **changes).to_dict(), []
    for step in (scene["time"]["step"], scene["time"]["step"] / 2):
        work, stored, turnover = work_of(merged(scene, time__step=step))
        defects.append(abs(sum(stored.values()) - sum(work.values())) / turnover)
        assert work["friction"] < -1e-5 * turnover
        assert work["bed"] < -1e-5 * turnover
    assert defects[0] < 1e-4
    assert np.log2(defects[0] / defects[1]) > 1


@pytest.mark.parametrize("scheme", SCHEMES)
def test_momentum(scheme):
    """Anchor, top, weight, bed and friction are the rate of momentum of the line at every step, to rounding."""
    dry = {"added_mass": 0.0, "normal_drag": 0.0, "tangential_drag": 0.0, "position_degree": 2, "tension_degree": 1}
    scene = merged(CHAIN, cable=CHAIN["cable"] | dry, time={"end": 0.0, "step": 0.02, "scheme": scheme})
    with running(scene) as simulation:
        lines, c = simulation.problem.lines, simulation.problem.lines.section
        order = np.argsort(lines.node_s)
        h = c.length / c.elements
        weights = np.zeros(2 * c.elements + 1)
        for k in range(c.elements):
            weights[2 * k : 2 * k + 3] += h * np.array([1, 4, 1]) / 6
        meter = BedForce(simulation)
        largest = 0.0
        for _ in range(40):
            held = lines.memory["bed_holds"].copy()
            simulation.step(0.02)
            bed = meter.read(held)
            a = lines.gamma_a.value * simulation.system.u[lines.part.slice] + lines.history_a.x.array
            rate = c.line_density * weights @ a[lines.node_dofs[order]]
            outside = sum(simulation.end_forces.values())[0] + bed - [0, 0, lines.weight_of(0) * c.length]
            assert np.abs(outside - rate).max() < 1e-8 * np.abs(bed).max()
            largest = max(largest, np.abs(rate).max())
        assert largest > 100
        assert np.abs(bed[:2]).max() > 10


class BedForce:
    """Force of bed and friction on the line [N], as they act in the equations of a step: at what friction held then."""

    def __init__(self, simulation):
        lines, self.simulation = simulation.problem.lines, simulation
        test = ufl.TestFunction(real_space(lines.mesh, 3))
        total = sum(ufl.inner(force, test) * lines.dx for _, force in lines.bed.forces())
        self.part = Part("bed", fem.Function(test.ufl_function_space()), 0)
        self.contribution = Contribution(total, self.part)

    def read(self, held):
        b, memory = np.zeros(3), self.simulation.problem.lines.memory["bed_holds"]
        after = memory.copy()
        memory[:] = held
        self.contribution.prepare()
        self.contribution.add_to_vector(b)
        memory[:] = after
        return b


def test_a_step_that_is_given_up_leaves_the_memory(monkeypatch):
    """Rejected by its error, or not solved: friction is unchanged."""
    with running(merged(CHAIN, time__end=4.0)) as simulation:
        for _ in simulation.advance(3.0):
            pass
        memory = simulation.problem.lines.memory["bed_holds"]
        before, u = memory.copy(), simulation.system.u.copy()
        assert simulation.step(0.02, judge=lambda h, error: False) is None
        np.testing.assert_array_equal(memory, before)

        with monkeypatch.context() as broken:
            broken.setattr(simulation.newton, "fault", lambda: "no such state")
            with pytest.raises(SolveError, match="no such state"):
                simulation.step(0.02)
        np.testing.assert_array_equal(memory, before)
        np.testing.assert_array_equal(simulation.system.u, u)
        simulation.step(0.02)
        assert np.abs(memory - before).max() > 1e-4


def test_adaptive_steps():
    """Close to the tension with small equal steps, with a moving touchdown."""
    scene = merged(CHAIN, time__end=4.5, cable__damping=1e4)
    fine = simulate(merged(scene, time__step=0.002))
    run = simulate(merged(scene, time__tolerance=1e-3))
    assert np.ptp(run.time_step.values[1:]) > 1e-3
    error = np.abs(np.interp(fine.time, run.time, run.tension_top) - fine.tension_top).max()
    assert error < 0.02 * float(np.ptp(fine.tension_top.values))


@pytest.mark.parametrize("start", ["frictionless", "pulled"])
def test_linearised_about_what_friction_holds(start):
    """It is also an equilibrium of the linearised problem, with grounded parts held along the bed by k_t."""
    found = linearise(load_scene(still(merged(CHAIN, seabed__start=start))), MPI.COMM_SELF)
    problem = found.problem
    problem.system.publish()
    residual = problem.system.evaluate()[problem.system.order] * problem.system.row_scales
    assert np.abs(residual).max() < 1e-6
    free = linearise(load_scene(still(merged(CHAIN, seabed__friction=0.0))), MPI.COMM_SELF)
    sideways = np.flatnonzero(np.isin(problem.system.order, problem.lines.node_dofs[:, 1]))
    added = (found.K.diagonal() - free.K.diagonal())[sideways]
    w, h = problem.lines.weight_of(0), 60.0 / 16
    assert added.max() == pytest.approx(0.7 * w / 0.02 * 2 * h / 3, rel=0.05)  # ell = 1e-3 depth
    assert abs(added[-1]) < 0.02 * added.max()  # what hangs is free
    for one in (found, free):
        one.problem.destroy()


def test_jacobian_on_the_bed():
    """Against central differences, with points that press, sink, rise, stick and slide."""
    problem = Problem(load_scene(merged(CHAIN, cable=merged(CHAIN["cable"], **PAIRS[1]))), True, MPI.COMM_SELF)
    lines, system, rng = problem.lines, problem.system, np.random.default_rng(8)
    lines.set_shape(
        system.u,
        lambda s: np.column_stack([0.98 * s, 0.1 * np.sin(s), -20.0 + 0.004 * np.sin(0.7 * s)]),
        lambda s: 3e3 + 100 * np.cos(s),
    )
    problem.set_time(0.3)
    r = system.u[lines.part.slice].copy()
    held = lines.bed.points.of(r[lines.node_dofs])
    lines.bed.hold(held + 0.03 * rng.normal(size=held.shape))
    lines.gamma_v.value, lines.gamma_a.value = 20.0, 400.0
    lines.history_v.x.array[:] = -20.0 * r + rng.uniform(-0.3, 0.3, len(r))
    lines.history_a.x.array[:] = -400.0 * r
    system.publish()
    system.assemble_jacobian()
    start, direction = system.u.copy(), np.zeros(system.size)
    direction[system.order] = rng.uniform(-1, 1, len(system.order)) * system.unknown_scales[: len(system.order)]
    x, y = system.A.createVecs()
    x.setArray(direction[system.order])
    system.A.mult(x, y)

    def residual(size):
        system.u[:] = start + size * direction
        system.publish()
        return system.evaluate()[system.order].copy()

    size = 1e-8
    change = (residual(size) - residual(-size)) / (2 * size)
    assert np.abs(change - y.array).max() < 1e-5 * np.abs(change).max()
    assert lines.bed.grounded(start).length > 10
    problem.destroy()
