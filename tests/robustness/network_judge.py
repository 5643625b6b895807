"""What every network, however random, owes its user: balances that hold, or one sentence that says why not."""

import math

import numpy as np
from mpi4py import MPI
from random_judge import check_failure, check_refusal

from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.rigid import cross_section, mass_properties
from dolfbuoy.model.surfacing import surfacing
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.observe import Observer
from dolfbuoy.statics.equilibrium import solve_equilibrium

#: Part of the largest force by which a balance may be missed.
BALANCED = 1e-6
#: Largest residual of an equation, relative to what is typical of it.
SOLVED = 1e-4


def judge(data) -> tuple[str, str]:
    """("done", way to the equilibrium), ("refused", why) or ("failed", why); fails by assertion."""
    try:
        scene = load_scene(data)
        problem = solve_equilibrium(scene, MPI.COMM_SELF)
        route = problem.route
        check_rest(problem)
        problem.destroy()
        check_report(check(scene, MPI.COMM_SELF))
        check_motion(scene)
    except InputError as error:
        check_refusal(str(error))
        return "refused", str(error)
    except SolveError as error:
        check_failure(str(error))
        return "failed", str(error)
    return "done", route


def check_report(report):
    """Numbers, not none; sentences, each once."""
    none = [name for name, value, *_ in report.numbers if math.isnan(value) and "breaking load" not in name]
    assert not none, none
    assert all(period > 0 for period in report.periods.values()), report.periods
    assert len(set(report.warnings)) == len(report.warnings), report.warnings


# -- rest --------------------------------------------------------------------------------------------------------------


def check_rest(problem):
    """Forces on every line, joint and buoy add up; elements are as long as their tension says."""
    network, scene = problem.network, problem.scene
    assert np.isfinite(problem.system.u).all()
    ends = {(k, i): problem.end_force(k, i) for k in range(len(network.pieces)) for i in (0, 1)}
    left = {name: size for name, size in problem.system.residual_by_block().items() if size > SOLVED}
    assert not left, f"{left} is left of the equations"
    largest = max([1e-3, *(np.linalg.norm(force) for force in ends.values())])
    for cable, name in enumerate(network.cables):
        check_cable(problem, cable, ends, largest, name)
    if problem.lines:
        check_lengths(problem)
    values = Observer(problem).values(problem.end_forces())
    displaced = np.atleast_1d(values.get("displaced_mass", np.zeros(len(network.buoys))))
    for k, (name, buoy) in enumerate(network.buoys.items()):
        pulls = [force for (p, i), force in ends.items() if network.pieces[p].ends[i].name == name]
        check_buoy(scene, buoy, displaced[k], pulls, largest, name)
    for name in network.bodies.keys() | {name for name, held in network.joints.items() if held is None}:
        pulls = [force for (p, i), force in ends.items() if network.pieces[p].ends[i].name == name]
        if scene.seabed is None:
            check_joint(problem, name, pulls, largest)


def _loads(mass, volume, scene):
    """Weight in water [N]."""
    return scene.gravity * (mass - (scene.sea.density * volume if scene.sea else 0.0)) * np.array([0.0, 0.0, -1.0])


def check_cable(problem, cable, ends, largest, name):
    """What holds its ends is its weight, less what the bed carries, and the drag of a current at most."""
    scene, network = problem.scene, problem.network
    pieces, bodies = network.pieces_of(cable), network.bodies
    total = ends[pieces[0], 0] + ends[pieces[-1], 1]
    noise = BALANCED * largest
    drag, weight = 0.0, np.zeros(3)
    for k in pieces:
        c = network.pieces[k].section
        wet, doubt = wet_length(problem, k)
        area = cross_section(c) if scene.sea else 0.0
        weight += c.length * _loads(c.line_density, area * wet / c.length, scene)
        noise += doubt * scene.gravity * (scene.sea.density if scene.sea else 0.0) * area
        joint = network.pieces[k].ends[1].name
        if k != pieces[-1] and joint in bodies:
            weight += _loads(bodies[joint].mass, wet_volume(problem, joint), scene)
            drag += _dynamic_pressure(scene) * bodies[joint].drag_area
        if scene.current:
            stretched = c.length * (
                1 + max(problem.lines.mean_tension(problem.system.u).max(), 0.0) / c.axial_stiffness
            )
            drag += _dynamic_pressure(scene) * c.diameter * (c.normal_drag + c.tangential_drag) * 4 * stretched
        noise += 1e-13 * (c.axial_stiffness if math.isfinite(c.axial_stiffness) else 0.0)
    missing = total + weight
    if scene.seabed is None:
        assert np.linalg.norm(missing) <= drag + noise, f"{name}: {missing} N are missing, {drag:.4g} N of drag at most"
        return
    carried = -missing[2]  # by the bed, and by what drag lifts
    assert carried >= -drag - noise, f"{name}: the bed pulls with {-carried:.6g} N"
    friction = scene.seabed.friction if scene.seabed.start == "pulled" else 0.0
    tilt = math.hypot(*scene.seabed.slope)
    most = (friction + tilt) * (1 + tilt) * (abs(carried) + np.linalg.norm(weight)) + drag + noise
    assert math.hypot(*missing[:2]) <= most, f"{name}: {missing} N are missing, the bed carries {carried:.6g} N"


def wet_length(problem, piece):
    """Length of a piece below still water, and that of elements that have the surface near them [m]."""
    lines, c = problem.lines, problem.network.pieces[piece].section
    scene = problem.scene
    asked = scene.sea and (bool(surfacing(scene)) if scene.sea.dry_above is None else scene.sea.dry_above)
    if not asked:
        return c.length, 0.0
    nodes = np.flatnonzero(lines.line_of_node == piece)
    s, z, dry, doubt = lines.node_s[nodes], problem.system.u[lines.node_dofs[nodes]][:, 2], 0.0, 0.0
    for first, last in lines.cell_ends[lines.line_of_cell == piece]:
        mine, fine = (first - 1e-9 <= s) & (s <= last + 1e-9), np.linspace(-1.0, 1.0, 2001)
        size = last - first
        height = np.polynomial.Polynomial.fit(s[mine], z[mine], mine.sum() - 1, domain=[first, last])
        z_fine = np.polynomial.polynomial.polyval(fine, height.coef)
        dry += size * (z_fine > 0).mean()
        doubt += size * (np.abs(z_fine).min() < 0.3 * size)  # what a point of the quadrature stands for
    return c.length - dry, doubt


def _dynamic_pressure(scene):
    if scene.current is None:
        return 0.0
    return 0.5 * scene.sea.density * scene.current.speed**2


def wet_volume(problem, joint):
    """Volume of a body below still water: of a ball of its volume, of which a cap may be dry [m^3]."""
    scene, volume = problem.scene, problem.network.bodies[joint].volume
    asked = scene.sea and (bool(surfacing(scene)) if scene.sea.dry_above is None else scene.sea.dry_above)
    if not asked or volume == 0:
        return volume
    observer = Observer(problem)
    place = observer.labels()["joint"].tolist().index(joint)
    z, R = observer.values(problem.end_forces())["joint_position"][place][2], (0.75 * volume / math.pi) ** (1 / 3)
    cap = min(max(z + R, 0.0), 2 * R)  # height of what is above the water
    return volume - math.pi * cap**2 * (3 * R - cap) / 3


def check_joint(problem, name, pulls, largest):
    """The forces of lines on a joint, and what sits there, add up."""
    scene, body = problem.scene, problem.network.bodies.get(name)
    weight = _loads(body.mass, wet_volume(problem, name), scene) if body else np.zeros(3)
    drag = _dynamic_pressure(scene) * body.drag_area if body else 0.0
    missing = np.linalg.norm(weight - sum(pulls))
    assert missing <= 1.001 * drag + BALANCED * largest, f"{name}: {missing:.6g} N are missing"


def check_buoy(scene, buoy, displaced, pulls, largest, name):
    """Weight, buoyancy, external force and lines add up; wind and current push at most as they can."""
    mass = mass_properties(buoy).mass
    force = np.array([0.0, 0.0, (displaced - mass) * scene.gravity]) - sum(pulls, np.zeros(3))
    if not pulls:  # it drifts, and is looked at in still water
        assert abs(force[2]) <= BALANCED * mass * scene.gravity, f"{name}: {force} N are missing"
        return
    if buoy.external_force:
        force += buoy.external_force.force
    most = BALANCED * max(largest, mass * scene.gravity)
    if buoy.wind:
        w = buoy.wind
        most += 2 * w.air_density * w.drag_coefficient * w.area * w.speed_10m**2
    if buoy.hull:
        wide, tall = max(d for _, d in buoy.hull), buoy.hull[-1][0]
        most += 2 * _dynamic_pressure(scene) * (buoy.normal_drag + buoy.axial_drag) * wide * (tall + wide)
    assert np.linalg.norm(force) <= most, f"{name}: {force} N are missing, {most:.4g} N at most"


def check_lengths(problem):
    """Of degree 1: elements are as long as their tension says, slack ones shorter."""
    lines, u = problem.lines, problem.system.u
    for k, piece in enumerate(problem.network.pieces):
        if piece.section.position_degree > 1:
            continue
        nodes = np.flatnonzero(lines.line_of_node == k)
        nodes = nodes[np.argsort(lines.node_s[nodes])]
        cells = np.flatnonzero(lines.line_of_cell == k)
        cells = cells[np.argsort(lines.cell_ends[cells, 0])]
        r, s, T, c = u[lines.node_dofs[nodes]], lines.node_s[nodes], lines.mean_tension(u)[cells], piece.section
        chord = np.linalg.norm(np.diff(r, axis=0), axis=1) / np.diff(s)
        table = getattr(c.axial_stiffness, "strain", None)
        strain = np.array([table(x) for x in T]) if table else T / c.axial_stiffness
        near = 1e-6 * max(1.0, np.abs(strain).max()) + 1e-13 * (1 + np.abs(r).max() / np.diff(s).min())
        off = chord - 1 - strain
        least = np.abs(T).max() * 1e-6 if c.slack == "tension-only" else -np.inf
        assert np.abs(off[least < T]).max(initial=0.0) < near, (
            f"{problem.network.name_of(k)}: {off} of strain are missing"
        )
        assert off.max() < near, f"{problem.network.name_of(k)}: slack elements are longer than they are"


# -- motion ------------------------------------------------------------------------------------------------------------


def check_motion(scene):
    """To the end, finite; every step solves its equations, and in air momentum changes as the forces say."""
    simulation, steps = Simulation(scene, MPI.COMM_SELF), 0
    problem = simulation.problem
    try:
        for _ in simulation.run():
            steps += 1
            assert np.isfinite(problem.system.u).all()
            for buoy in problem.buoys.values():
                q4 = buoy.fields.of(problem.system.u[buoy.part.slice]).orientation
                assert abs(np.linalg.norm(q4) - 1) < 1e-9
            if scene.sea is None:
                check_momentum(problem)
        assert abs(simulation.t - scene.time.end) <= 1e-9 * scene.time.step
        assert steps or not scene.time.end
    finally:
        problem.destroy()


def check_momentum(problem):
    """What holds the ends of a network in air is its weight and what accelerates it."""
    lines, network, u = problem.lines, problem.network, problem.system.u
    if lines is None or any(piece.section.position_degree > 1 for piece in network.pieces):
        return
    g, needed = np.array([0.0, 0.0, problem.scene.gravity]), np.zeros(3)
    for k, piece in enumerate(network.pieces):
        group, number = lines.holder(k)
        mine = np.flatnonzero(group.line_of_node == number)
        mine = mine[np.argsort(group.node_s[mine])]
        a = (group.gamma_a.value * u[group.part.slice] + group.history_a.x.array)[group.node_dofs[mine]] + g
        needed += piece.section.line_density * np.diff(group.node_s[mine]) @ (a[1:] + a[:-1]) / 2
    if problem.bodies:
        bodies = problem.bodies
        a = (bodies.gamma_a.value * u[bodies.part.slice] + bodies.history_a.x.array)[bodies.dofs] + g
        needed += np.array([body.mass for body in bodies.bodies]) @ a
    outside = [(k, i) for k, piece in enumerate(network.pieces) for i in (0, 1) if piece.ends[i].held]
    outside += [
        (k, i) for k, piece in enumerate(network.pieces) for i in (0, 1) if piece.ends[i].kind in ("free", "buoy")
    ]
    ends = [problem.end_force(*end, fresh=False) for end in outside]
    scale = max([np.abs(needed).max(), *(np.abs(force).max() for force in ends)])
    missing = sum(ends, np.zeros(3)) - needed
    assert np.abs(missing).max() <= 1e-6 * scale, f"{missing} N of {scale:.6g} N are missing in motion"
