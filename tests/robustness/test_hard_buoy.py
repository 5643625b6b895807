"""Difficult scenes of a buoy.

Source: Archimedes, Euler's equations, growth rates by hand.
"""

import math

import numpy as np
import pytest
from hard import FLOATING, FLOATING_SPAR, MOORED, SHORT, TOP, refusal, run, said, sound_run, static, with_

SPAR = FLOATING_SPAR["buoy"]


def turned(degrees: float, axis=(0.0, 1.0, 0.0)) -> list[float]:
    """Quaternion of a turn about a unit axis."""
    half = math.radians(degrees) / 2
    return [math.cos(half), *(math.sin(half) * np.array(axis)).tolist()]


def _unit(found, record):
    off = np.abs(np.linalg.norm(record.buoy_orientation, axis=1) - 1).max()
    found.below("| |q| - 1 |", off, 1e-12)


def _rights_itself(found, degrees):
    start = {"buoy_orientation": turned(degrees), "buoy_position": [0.0, 0.0, -0.5]}
    record = sound_run(found, with_(FLOATING_SPAR, initial=start, time={"end": 60.0, "step": 0.05}))
    _unit(found, record)
    found.below("cone angle after 60 s", record.cone_angle[-1], 1.0, " deg")
    found.below("M_D/M - 1 after 60 s", abs(float(record.displaced_mass[-1]) / 1200 - 1), 2e-3)
    found.holds(f"it started at {degrees} degrees", abs(float(record.cone_angle[0]) - degrees) < 1e-6)


@pytest.mark.slow
def test_capsized(found):
    """A stable spar, started 179 degrees over.  Must show: it rights itself; M_D = M; |q| = 1."""
    _rights_itself(found, 179.0)


@pytest.mark.slow
def test_horizontal(found):
    """A stable spar, started lying in the water.  Must show: it rights itself; M_D = M; |q| = 1."""
    _rights_itself(found, 90.0)


@pytest.mark.slow
def test_capsized_moored(found):
    """The same spar, moored, started 170 degrees over with its cable.  Must show: it rights itself and returns to the
    moored equilibrium.
    """
    scene = with_(SHORT, buoy=SPAR, cable__length=19.0, time={"end": 60.0, "step": 0.05})
    rest = static(scene)
    q = turned(170.0)
    r_O = np.array([2.0, 0.0, -1.6])
    axis = np.array([math.sin(math.radians(170.0)), 0.0, math.cos(math.radians(170.0))])
    start = {"buoy_orientation": q, "buoy_position": (r_O + 0.5 * axis).tolist()}
    record = sound_run(found, with_(scene, initial=start))
    _unit(found, record)
    found.below("cone angle after 60 s", record.cone_angle[-1], 0.05, " deg")
    found.close("top tension", record.tension_top[-1], float(rest.tension_top), 1e-4, " N")


def test_submerged(found):
    """A cable of 15 m in 20 m of water holds the spar down.  Must show: T = (rho V - M) g; all is wet."""
    record = static(with_(SHORT, buoy=SPAR, cable__length=15.0))
    volume = math.pi / 4 * 3.0
    found.close("displaced mass", record.displaced_mass, 1025 * volume, 1e-9, " kg")
    found.close("top tension", record.tension_top, (1025 * volume - 1200) * 9.81, 1e-9, " N")
    found.close("wetted length", record.submerged_length, 3.0, 1e-9, " m")


@pytest.mark.slow
def test_dropped(found):
    """The spar let go with its keel 3 m above the water.  Must show: free fall, splash, a heave that dies out around
    its draft.
    """
    z0 = 3.5
    scene = with_(FLOATING_SPAR, initial={"buoy_position": [0.0, 0.0, z0]})
    scene = with_(scene, time={"end": 40.0, "step": 0.02, "scheme": "bdf2"})
    record = sound_run(found, scene)
    k = int(np.argmin(np.abs(record.time.values - 0.7)))
    fallen = z0 - float(record.buoy_position[k, 2])
    found.close("fallen in 0.7 s", fallen, 9.81 * float(record.time[k]) ** 2 / 2, 5e-4, " m")
    speed = -float(record.linear_momentum[:, 2].min()) / 1200
    found.remark(f"largest speed {speed:.3g} m/s (at the water sqrt(2 g 3 m) = 7.67)")
    excess = record.displaced_mass / 1200 - 1
    first, last = excess[(record.time > 1) & (record.time < 11)], excess[record.time > 30]
    found.below("mean of M_D/M - 1 over the last 10 s", abs(float(last.mean())), 1e-3)
    found.below("its swing there over that of the first 10 s", float(last.max() / first.max()), 0.2)


@pytest.mark.slow
def test_spinning(found):
    """A body that turns with 10 rad/s askew of its axis, without torque.  Must show: L stays; the axis goes round L
    with |L|/I_t (Euler).
    """
    omega = 10 * np.array([0.6, 0.0, 0.8])
    time = {"end": 2.0, "step": 0.001, "scheme": "bdf2"}
    record = run(with_(TOP, initial__buoy_angular_velocity=omega.tolist(), time=time))
    L = np.array([2.0, 2.0, 1.0]) * omega
    found.below("change of L", np.abs(record.angular_momentum - L).max() / np.linalg.norm(L), 1e-12)
    _unit(found, record)
    n, angle = L / np.linalg.norm(L), np.linalg.norm(L) / 2.0 * float(record.time[-1])
    e3 = np.array([0.0, 0.0, 1.0])
    expected = e3 * math.cos(angle) + np.cross(n, e3) * math.sin(angle) + n * (n @ e3) * (1 - math.cos(angle))
    q0, q1, q2, q3 = record.buoy_orientation[-1].values
    axis = np.array([2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 1 - 2 * (q1**2 + q2**2)])
    found.below("axis after 2 s off by", np.abs(axis - expected).max(), 2e-4)


@pytest.mark.slow
def test_hundred_turns(found):
    """A hundred full turns head over heels at 10 rad/s.  Must show: unit quaternion to 1e-12, L kept, no step harder
    than another.
    """
    time = {"end": 100 * 2 * math.pi / 10, "step": 0.01, "scheme": "generalized-alpha"}
    record = run(with_(TOP, initial__buoy_angular_velocity=[0.0, 10.0, 0.0], time=time))
    _unit(found, record)
    found.finite(record)
    found.below("change of L", np.abs(record.angular_momentum - [0.0, 20.0, 0.0]).max() / 20, 1e-12)
    found.below("most Newton iterations in a step", record.newton_iterations[1:].max(), 3)
    found.below("failed steps", record.attrs["failed_steps"], 0)
    q = record.buoy_orientation[-1].values
    angle = 2 * math.atan2(q[2], q[0])
    found.remark(f"angle after 100 turns {math.degrees((angle + math.pi) % (2 * math.pi) - math.pi):.3g} deg")


@pytest.mark.slow
def test_gm_negative(found):
    """GM < 0: a mass on a mast of 10 m, 0.001 rad off upright.  Must show: said; capsizes with the growth rate sqrt(M
    g |GM|/I) and settles.
    """
    bare = with_(FLOATING, buoy={"added_mass": 0.0, "normal_drag": 0.0, "axial_drag": 0.0, "rotational_damping": 0.0})
    bare["buoy"]["point_masses"] = [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 10.0}]
    found.says(said(bare), "is not positive")
    center = (400 * 0.5 + 150 * 2 + 150 * 10) / 700
    inertia = 192 + 400 * (center - 0.5) ** 2 + 150 * (center - 2) ** 2 + 150 * (center - 10) ** 2
    draft = 700 / (1025 * math.pi * 1.2**2)
    GM = draft / 2 + 1.2**2 / (4 * draft) - center
    rate = math.sqrt(700 * 9.81 * -GM / inertia)
    start = {"buoy_orientation": turned(math.degrees(1e-3))}
    record = run(with_(bare, initial=start, time={"end": 12.0, "step": 0.01, "scheme": "bdf2"}))
    angle, t = np.radians(record.cone_angle.values), record.time.values
    inside = (angle > 0.004) & (angle < 0.04) & (np.maximum.accumulate(angle) == angle)
    measured = np.polyfit(t[inside], np.log(angle[inside]), 1)[0]
    found.close(f"growth rate (GM = {GM:.3g} m)", measured, rate, 1e-2, " 1/s")
    wet = with_(bare, buoy={"added_mass": 0.3, "normal_drag": 1.2, "axial_drag": 1.2, "rotational_damping": 200.0})
    record = sound_run(found, with_(wet, initial=start, time={"end": 120.0, "step": 0.05}))
    _unit(found, record)
    tail = record.cone_angle[record.time > 110]
    found.below("cone angle moves in the last 10 s by", np.ptp(tail.values), 0.2, " deg")
    found.below("M_D/M - 1 at the end", abs(float(record.displaced_mass[-1]) / 700 - 1), 1e-5)
    found.remark(f"it lies at {float(tail[-1]):.3g} deg")


def test_effective_mass(found):
    """C_A so negative that M + C_A rho V <= 0, or rho0 + C_A rho A <= 0.  Must show: refused."""
    found.says(refusal(with_(MOORED, buoy__added_mass=-0.7)), "is not positive")
    found.says(refusal(with_(MOORED, cable={"added_mass": -6.0})), "is not positive")


def test_sinks(found):
    """A buoy of 50 kg on a cable of 276 kg/m.  Must show: said that it sinks."""
    small = {"hull": [[0.0, 0.6], [0.6, 0.6]], "mass": 50.0, "point_masses": [], "inertia": [3.0, 2.0]}
    found.says(refusal(with_(MOORED, buoy=small, cable__line_density=276.0)), "sinks")


@pytest.mark.slow
def test_breaking_wave(found):
    """A wave at the breaking limit of Miche, and 20 % beyond.  Must show: beyond: warned; both end finite."""
    k = 2 * math.pi / 38.9106728271416
    limit = 0.142 * math.tanh(k * 20.0) * 38.9106728271416 / 2
    scene = with_(MOORED, waves={"period": 5.0, "amplitude": 0.999 * limit, "ramp": 5.0})
    found.holds("nothing said at 0.999 of it", not any("breaking" in s for s in said(scene)))
    beyond = with_(scene, waves__amplitude=1.2 * limit)
    found.says(said(beyond), "beyond the breaking limit")
    for name, case in (("at the limit", scene), ("beyond", beyond)):
        record = sound_run(found, with_(case, time={"end": 12.0, "step": 0.02}))
        found.remark(f"{name}: top tension up to {float(record.tension_top.max()):.4g} N")


def test_short_wave(found):
    """A wavelength below five diameters of the buoy.  Must show: warned: diffraction."""
    found.says(said(with_(MOORED, waves={"period": 2.5, "amplitude": 0.1})), "diffraction")
    found.holds(
        "not for 5 s", not any("diffraction" in s for s in said(with_(MOORED, waves={"period": 5.0, "amplitude": 0.1})))
    )


def test_zero_amplitude(found):
    """Waves of amplitude 0.  Must show: the run without waves, to 1e-14."""
    scene = with_(MOORED, current={"speed": 0.5}, time={"end": 0.2, "step": 0.01})
    calm, zero = run(scene), run(with_(scene, waves={"period": 5.0, "amplitude": 0.0}))
    off = np.abs(calm.buoy_position - zero.buoy_position).max() / 20.0
    found.below("buoy's position differs by", off, 1e-14, " of the depth")
    found.below("top tension differs by", np.abs(calm.tension_top / zero.tension_top - 1).max(), 1e-13)


def test_deep_water(found):
    """T = 1.5 s in 700 m: kh = 1252, cosh kh overflows.  Must show: e^(kz); a finite run."""
    import ufl

    from dolfbuoy.forms import sea
    from dolfbuoy.model.airy import dispersion_wavenumber

    k = dispersion_wavenumber(1.5, 700.0, 9.81)
    found.close("kh", k * 700, 1252.005541875646, 1e-12)
    wave = sea.Wave(1.0, k, 2 * math.pi / 1.5, 0.0, 1.0, 0.0, 700.0, "none")
    flow = sea.flow(ufl.as_vector([ufl.as_ufl(c) for c in (0.0, 0.0, -1.0)]), wave, None)
    decay = float(flow.velocity[0](())) / (2 * math.pi / 1.5)
    found.close("velocity 1 m down / at the surface", decay, 0.16719753094153764, 1e-12)
    long = {"length": 710.0, "line_density": 9.3, "elements": 20}
    scene = with_(MOORED, sea__depth=700.0, cable=long, waves={"period": 1.5, "amplitude": 0.1})
    scene = with_(scene, buoy={"hull": [[0.0, 4.0], [3.0, 4.0]]}, time={"end": 1.0, "step": 0.02})
    found.finite(run(scene))
