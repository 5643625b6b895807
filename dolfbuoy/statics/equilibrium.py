"""Equilibrium of a scene: of a cable between two points or under an end force, and of a moored or free buoy."""

import math

import numpy as np

from ..errors import InputError, SolveError
from ..model.feasible import check_feasible, shape_and_mass
from ..model.hydrostatics import float_upright
from ..model.lines import top_position
from ..model.problem import MPI, Problem
from ..model.rigid import rotation_of
from ..model.sea import heading, wind_at
from ..model.seabed import plane, rubs
from ..roots import brentq
from ..scene.network import is_network, single
from ..scene.stretching import TensionTable, secant
from . import catenary, on_bed
from .continuation import begin, march, solve_cable
from .growth import settle
from .moorings import solve_network
from .pulled import pull
from .relaxation import relax


def solve_equilibrium(scene, comm=MPI.COMM_WORLD, make=Problem) -> Problem:
    """Solve for rest in the mean current, wind and external force (no waves); the solution is in `problem.system.u`.

    make: what makes a Problem of (scene, dynamic, comm); another than Problem may use one again (`model.pool`).

    Raises InputError for a scene that has no equilibrium, SolveError if the solve fails.
    """
    check_feasible(scene)
    if not scene.cables:
        return _free_buoys(scene, comm, make)
    problem = make(scene, dynamic=False, comm=comm)
    if problem.lines.growth is None:
        _rest(problem)
    else:
        settle(problem, lambda: _rest(problem))
    if scene.seabed is not None and rubs(scene, dynamic=False):
        pull(problem)
    return problem


def _rest(problem):
    """Without friction, from nowhere."""
    if is_network(problem.scene):
        solve_network(problem)
    elif single(problem.scene).buoy is None:
        solve_cable(problem, _cable_start(problem.scene, problem.lines.weight_per_length))
    else:
        _moored_buoy(problem)


def _bed(scene):
    """The bed of the closed form, without friction."""
    return on_bed.Bed(*plane(scene))


# -- cable alone -------------------------------------------------------------------------------------------------------


def _cable_start(scene, w):
    """Closed-form shape without current: between its ends, or under its end force."""
    c = single(scene).cable
    if c.top.kind == "free":
        if w == 0 and scene.current is None and not any(c.top.force):
            raise InputError(
                f"cable.top.force = {list(c.top.force)}: nothing pulls at this cable, which has no weight here either: "
                "nothing determines its equilibrium; give a force, weight or a current, or take another initial.kind."
            )
        return _by_hooke(c, lambda EA: _under_end_force(scene, c.top.force, w, EA))
    end = top_position(c.top, 0.0)
    distance = np.linalg.norm(end - np.array(single(scene).anchor))
    if math.isinf(c.axial_stiffness) and distance >= c.length * (1 - 1e-12):
        raise InputError(
            f"cable.length = {c.length}: must not be the distance of its ends: an inextensible cable is then exactly "
            "taut and its tension undetermined; give a finite axial_stiffness or a longer cable."
        )
    if w == 0 and scene.current is None and distance < c.length:
        raise InputError(
            f"cable.line_density = {c.line_density}: this cable has no weight here and is longer than the "
            f"{distance:.6g} m between its ends: nothing determines its equilibrium; give it weight or a current, or "
            "take another initial.kind."
        )
    ends, bed = (single(scene).anchor, end, c.length, w), _bed(scene) if scene.seabed else None
    return _by_hooke(c, lambda EA: on_bed.between(*ends, EA, bed) if bed else catenary.between(*ends, EA))


def _by_hooke(cable, shape_of, rounds=20):
    """Closed form with the one stiffness that a table T(e) has, roughly, where the line is pulled hardest."""
    shape = shape_of(float(cable.axial_stiffness))
    for _ in range(rounds if isinstance(cable.axial_stiffness, TensionTable) else 0):
        T = float(np.max(shape.tension(np.array([0.0, cable.length]))))
        shape = shape_of(secant(cable.axial_stiffness, T))
    return shape


def _under_end_force(scene, force, w, EA=None):
    """Closed-form shape under an end force, on the bed if there is one."""
    c = single(scene).cable
    given = single(scene).anchor, force, c.length, w, float(c.axial_stiffness) if EA is None else EA
    return on_bed.under_end_force(*given, _bed(scene)) if scene.seabed else catenary.under_end_force(*given)


# -- buoy --------------------------------------------------------------------------------------------------------------


def _free_buoys(scene, comm, make):
    """Buoys without cables float upright in still water; steady loads across would carry them away for ever."""
    loads = {"wind": None, "external_force": None}
    calm = loads | {"current": None, "waves": None, "buoy": [buoy.model_copy(update=loads) for buoy in scene.buoys]}
    problem = make(scene.model_copy(update=calm), dynamic=False, comm=comm)
    floats = scene.sea is not None and scene.gravity
    for buoy in problem.buoys.values():
        height = 0.0
        if floats:
            draft = float_upright(buoy.shape, buoy.mass, scene.sea.density, scene.gravity).draft
            height = buoy.mass.height - draft
        pose = np.array([0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0])
        problem.system.u[buoy.part.slice] = buoy.reference.x.array[:] = pose
    if floats:
        problem.iterations, problem.route = problem.newton.solve(), "newton"
    else:
        problem.system.publish()
        problem.iterations, problem.route = 0, "none: it floats where it is"
    return problem


def _moored_buoy(problem):
    """Newton from the catenary under the estimated loads; if that fails, pseudo-transient continuation."""
    scene = problem.scene
    if not (scene.gravity or scene.current or single(scene).wind or single(scene).external_force):
        raise InputError(
            "gravity = 0.0: no load holds the moored buoy, which may rest anywhere within reach of its cable: nothing "
            "determines its equilibrium; give gravity, current, wind or external_force, or initial.buoy_position."
        )
    if scene.sea is None or not scene.gravity:
        shape, r_O, q4 = _hanging_start(scene, problem.lines.weight_per_length)
    else:
        shape, r_O, q4 = _floating_start(scene, problem.lines.weight_per_length)
    begin(problem, shape)
    _start_buoy(problem, shape, r_O, q4)
    problem.iterations, problem.route = 0, "newton"
    try:
        _newton(problem)
    except SolveError:
        begin(problem, shape)
        _start_buoy(problem, shape, r_O, q4)
        if problem.lines.bed is None:
            _continue(problem)
        else:
            problem.route = "relaxation"
            relax(problem)


def _newton(problem):
    """Newton; where it fails, the current is raised step by step."""
    start = problem.system.u.copy()
    try:
        problem.iterations += problem.newton.solve()
    except SolveError:
        if problem.scene.current is None:
            raise
        problem.system.u[:], problem.route = start, "current"
        march(problem, lambda x: _scale_current(problem, x))


def _scale_current(problem, fraction):
    for model in problem.models:
        model.sea.scale_current(fraction)


def _start_buoy(problem, shape, r_O, q4):
    if not problem.buoy:
        return
    u, buoy = problem.system.u, problem.buoy
    pose = np.concatenate([r_O - rotation_of(q4) @ buoy.offset.value, q4])
    u[buoy.part.slice] = pose
    L = single(problem.scene).cable.length
    H, V = shape.H, float(shape.vertical(L))
    u[problem.attachments[0].slice] = np.concatenate([r_O, -(H * shape.along + np.array([0.0, 0.0, V]))])
    buoy.reference.x.array[:] = pose


def _continue(problem, growth=4.0, steps=60):
    """Pseudo-transient continuation: rest, a heavy body relaxed in steps theta that grow, and Newton at the end."""
    system, theta, iterations = problem.system, 0.1, 0
    for _ in range(steps):
        saved = system.u.copy()
        if problem.buoy:
            problem.buoy.relaxation.value = theta**-2 if theta < 1e4 else 0.0
            problem.buoy.reference.x.array[:] = saved[problem.buoy.part.slice]
        try:
            iterations += problem.newton.solve()
        except SolveError:
            theta /= growth**1.5
            if theta < 1e-4:
                raise
            continue
        if theta >= 1e4:
            problem.iterations, problem.route = iterations, "pseudo-transient continuation"
            return
        theta *= growth
    raise SolveError(f"the equilibrium was not reached in {steps} steps of pseudo-transient continuation")


def _hanging_start(scene, w):
    """A body that no water carries: its cable in line with the load, its mooring point towards the cable."""
    load = np.array([0.0, 0.0, -single(scene).buoy.mass * scene.gravity])
    if single(scene).external_force:
        load += single(scene).external_force.force
    if scene.sea:
        load[:2] = _horizontal_load(scene, shape_and_mass(single(scene).buoy)[0])[:2]
    shape = _under_end_force(scene, load, w)
    lever = single(scene).buoy.mooring_height - shape_and_mass(single(scene).buoy)[1].height
    upright = load[2] > 0 if lever == 0 else load[2] * lever < 0  # C is where the load pulls it
    q4 = np.array([1.0, 0.0, 0.0, 0.0] if upright else [0.0, 1.0, 0.0, 0.0])
    return shape, shape.position(np.array([single(scene).cable.length]))[0], q4


def _floating_start(scene, w):
    """Upright buoy on a cable whose end force is estimated from the loads."""
    c, (hull, mass) = single(scene).cable, shape_and_mass(single(scene).buoy)
    g = scene.gravity
    H_vector = _horizontal_load(scene, hull)
    H = max(float(np.hypot(*H_vector[:2])), 1e-3 * abs(w) * c.length, 1e-3 * mass.mass * g * 1e-3)
    along = H_vector / np.linalg.norm(H_vector) if np.any(H_vector) else np.array([1.0, 0.0, 0.0])

    def top_of(V):
        return _under_end_force(scene, H * along + [0, 0, V], w)

    def gap(V):
        """Height of the cable's end above the mooring point of a buoy that carries V."""
        load = min(max(mass.mass + V / g, 0.0), scene.sea.density * hull.volume() * (1 - 1e-9))
        draft = brentq(lambda d: scene.sea.density * hull.volume(d) - load, 0.0, hull.height)
        z_mooring = -draft + single(scene).buoy.mooring_height
        return float(top_of(V).position(np.array([c.length]))[0, 2]) - z_mooring

    low, high = -abs(w) * c.length - mass.mass * g, abs(w) * c.length + scene.sea.density * hull.volume() * g
    V = brentq(gap, low, high) if gap(low) < 0 < gap(high) else high
    shape = top_of(V)
    return shape, shape.position(np.array([c.length]))[0], np.array([1.0, 0.0, 0.0, 0.0])


def _horizontal_load(scene, hull):
    """Estimate of the horizontal force on buoy and half the cable [N]."""
    total = np.zeros(3)
    if single(scene).external_force:
        total[:2] += single(scene).external_force.force[:2]
    if single(scene).wind:
        total += wind_at(single(scene).wind, max(single(scene).wind.height, 0.1))
    if scene.current:
        c, cable, rho = scene.current, single(scene).cable, scene.sea.density
        speed = c.speed if c.speed is not None else max(s for _, s in c.profile)
        area = single(scene).buoy.normal_drag * hull.max_diameter * hull.height / 2
        area += cable.normal_drag * cable.diameter * cable.length / 2
        total += 0.5 * rho * area * speed**2 * heading(c.direction_deg)
    return total
