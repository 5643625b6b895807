"""What every scene, however random, owes its user: a right end, or one sentence that says why there is none."""

import re

import numpy as np
from alone import simulate, solve_static
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.surfacing import surfacing


def _line(scene):
    """The only piece of line."""
    return scene.network.pieces[0]


def judge(data):
    """Solve the equilibrium and run the scene; returns how it ended, or fails by assertion."""
    try:
        scene = load_scene(data)
        if _starts_at_rest(scene):
            check_static(solve_static(scene, comm=MPI.COMM_SELF), scene)
        check_run(simulate(scene, comm=MPI.COMM_SELF), scene)
    except InputError as error:
        check_refusal(str(error))
        return "refused"
    except SolveError as error:
        check_failure(str(error))
        return "failed"
    return "done"


def _starts_at_rest(scene):
    return scene.initial.kind == "equilibrium" and scene.initial.buoy_position is None


def _stands_still(scene):
    given = scene.initial.buoy_velocity is not None or scene.initial.buoy_angular_velocity is not None
    moved = _line(scene).ends[1].top is not None and _line(scene).ends[1].top.kind == "prescribed"
    return _starts_at_rest(scene) and not given and not moved


def check_refusal(message):
    """One sentence with a key of the scene in it."""
    assert "\n" not in message
    assert message.endswith(".")
    assert len(message) < 400
    assert re.search(r"\b\w+\.\w+\b|\[[a-z_.]+\]", message), message


def check_failure(message):
    """PETSc's reason, or that of the program."""
    assert "\n" not in message
    reasons = ("DIVERGED", "tolerance", "damped motion", "inside out", "the yaw of", "no rest of lines under")
    reasons += ("retried with smaller ones",)
    assert any(reason in message for reason in reasons), message


def _finite(record):
    for name, values in record.variables.items():
        if values.dtype.kind == "f" and name != "touchdown":  # nan where nothing lies
            assert np.isfinite(values.values).all(), f"{name} is not finite"


def _weight(scene):
    """Weight in water per length [N/m]."""
    return _line(scene).section.line_density * scene.gravity - _buoyancy(scene)


def _buoyancy(scene):
    """Weight of the displaced water per length [N/m]."""
    section = _line(scene).section
    area = section.area or (np.pi * section.diameter**2 / 4 if section.diameter else 0.0)
    return scene.sea.density * area * scene.gravity if scene.sea else 0.0


def _dry(record, scene):
    """(length out of the water above the middle of the first element, length of elements at the surface) [m].

    Elements are straight; those at the surface may count as wet or dry as their few points of quadrature do.
    """
    asked = scene.sea and (bool(surfacing(scene)) if scene.sea.dry_above is None else scene.sea.dry_above)
    if not asked:
        return 0.0, 0.0
    z, sizes = record.cable_position.values[:, 2], np.diff(record.s.values)
    low, high = np.minimum(z[:-1], z[1:]), np.maximum(z[:-1], z[1:])
    crossing = (low < 0.3 * sizes) & (high > -0.3 * sizes)
    dry = np.where(low >= 0, sizes, 0.0)
    dry[0] /= 2
    return float(dry.sum()), float(sizes[crossing].sum())


def check_static(record, scene):
    """Finite, unit quaternion, strain law, and the forces that hold the cable add up to its weight."""
    _finite(record)
    if "buoy_orientation" in record:
        assert abs(np.linalg.norm(record.buoy_orientation) - 1) < 1e-9
    if scene.cable:
        check_lengths(record.cable_position.values, record.cable_tension.values, record.s.values, scene)
    if scene.cable and scene.current is None and _line(scene).section.position_degree == 1 and not scene.seabed:
        _check_balance(record, scene)
    if scene.buoy and scene.sea and scene.cable and scene.gravity and not (scene.current or scene.wind):
        lift = (float(record.displaced_mass) - _mass(scene)) * scene.gravity
        lift += scene.external_force.force[2] if scene.external_force else 0.0
        scale = max(_mass(scene) * scene.gravity, float(record.tension_top))
        assert abs(float(record.end_tension[2]) - lift) < 1e-6 * scale


def _mass(scene):
    return scene.buoy[0].mass + sum(m.mass for m in scene.buoy[0].point_masses)


def _check_balance(record, scene):
    """End force = pull of the first element + weight of all that hangs above its middle.

    The program knows forces to 1e-9 of a typical one, which without gravity is that of the line's mass at 1 m/s^2.
    """
    r, s, T = record.cable_position.values, record.s.values, record.cable_tension.values
    tangent = (r[1] - r[0]) / np.linalg.norm(r[1] - r[0])
    hanging = _weight(scene) * (s[-1] - s[1] / 2)
    if "growth_weight" in record:
        hanging += float(record.growth_weight.sum() - record.growth_weight[0] / 2)
    dry, doubt = _dry(record, scene)
    if dry + doubt > 0 and "growth_weight" in record:
        return  # what grows has a buoyancy of its own
    hanging += _buoyancy(scene) * dry
    rest = record.end_tension.values - T[0] * tangent - [0, 0, hanging]
    c = _line(scene).section
    noise = _tension_noise(scene) + 1e-9 * c.line_density * c.length + _buoyancy(scene) * doubt
    assert np.abs(rest).max() <= 1e-6 * max(np.abs(T).max(), abs(hanging)) + noise + 1e-12, (rest, T, hanging)


def _tension_noise(scene):
    """Tension that one rounding of the positions makes [N]."""
    EA, c = _line(scene).section.axial_stiffness, _line(scene).section
    return 0.0 if np.isinf(EA) else 1e-14 * EA * (1 + np.abs(_line(scene).ends[0].top.position).max() / c.length)


def _motion_noise(scene, h):
    """Tension that one rounding of the positions makes through the inertia of an element in the shortest step [N]."""
    if scene.time is None:
        return 0.0
    c = _line(scene).section
    shortest = min(scene.time.step, max(1e-3 * scene.time.step, 1e-5))  # the start, adaptive steps
    return 4 * np.finfo(float).eps * c.line_density * h * c.length / shortest**2


def check_lengths(position, tension, s, scene):
    """P1-P0: every element has the length that its tension gives it, a slack one is shorter."""
    c = _line(scene).section
    if c.position_degree > 1 or c.damping or not position.size:
        return
    chord = np.linalg.norm(np.diff(position, axis=-2), axis=-1) / np.diff(s)
    stretch = 1 + tension / c.axial_stiffness
    tolerance = 1e-6 * max(1, np.abs(stretch).max()) + 1e-14 * (1 + np.abs(position).max() / np.diff(s).min())
    if c.slack == "compressive":
        assert np.abs(chord - stretch).max() < tolerance, (chord, stretch)
        return
    noise = _motion_noise(scene, np.diff(s).max()) + 1e-9
    pulled = tension > 1e-6 * np.abs(tension).max() + noise
    assert tension.min() >= -1e-6 * np.abs(tension).max() - noise, tension
    assert (chord - stretch).max() < tolerance, (chord, stretch)
    assert np.all(np.abs(chord - stretch)[pulled] < tolerance), (chord, stretch, tension)


def check_run(record, scene):
    """Finite, complete, unit quaternion, strain law."""
    _finite(record)
    time = record.time.values
    assert np.all(np.diff(time) > 0)
    assert time[0] == 0
    assert abs(time[-1] - scene.time.end) <= 1e-9 * scene.time.step
    if "buoy_orientation" in record:
        assert np.abs(np.linalg.norm(record.buoy_orientation, axis=1) - 1).max() < 1e-12
    if scene.cable:
        first = 0 if _stands_still(scene) else 1  # the start is projected, its tension is that of a first tiny step
        check_lengths(record.cable_position.values[first:], record.cable_tension.values[first:], record.s.values, scene)
