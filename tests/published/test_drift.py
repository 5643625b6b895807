"""Mean drift force of a hull from far-field momentum, and Newman's approximation of slow drift in a sea.

Source: scattering by a vertical cylinder in closed form and ray theory; the energy balance of a free body; Capytaine's
own far field (optional); double sums over pairs of waves; an oscillator under Newman's force, and its spectrum.
"""

import math

import numpy as np
import pytest
from dynamics_helpers import running
from helpers import REFERENCE
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt
from scipy.special import hankel1, jv

from dolfbuoy import load_scene, simulate
from dolfbuoy.model.airy import AirySum, spectrum_of
from dolfbuoy.model.drift import mean_drift, of_components, transfer
from dolfbuoy.model.potential_flow import wavenumbers
from dolfbuoy.scene.reading import merged

RHO, G, MASS = 1025.0, 9.81, 2576.1
CYLINDER = {
    "sea": {"depth": 20.0},
    "buoy": {
        "hull": [[0.0, 2.0], [1.6, 2.0]],
        "mass": MASS,
        "center_of_mass": 0.6,
        "inertia": [1500.0, 1300.0],
        "potential_flow": str(REFERENCE / "truncated_cylinder.nc"),
        "drift": "newman",
    },
    "time": {"end": 1.0, "step": 0.05, "scheme": "generalized-alpha"},
}


def low_frequency_mass(scene):
    return MASS + scene.buoys[0].potential_flow.added_mass[0][0]


def measured(period, amplitude=5e-3, **changes):
    """Mean force over squared amplitude that lets a free cylinder drift in a regular wave, and its Drift."""
    waves = {"amplitude": amplitude, "period": period, "ramp": 4 * period}
    scene = load_scene(merged(merged(CYLINDER, waves=waves, **changes), time__end=24 * period, time__step=period / 80))
    run, w = simulate(scene), 2 * np.pi / period
    late = run.time.values > 12 * period - 1e-9
    t, x = run.time.values[late], run.buoy_position.values[late, 0, 0]
    waving = [wave(n * w * t) for n in (1, 2) for wave in (np.cos, np.sin)]
    speeding = np.linalg.lstsq(np.column_stack([t**2 / 2, t, np.ones_like(t), *waving]), x, rcond=None)[0][0]
    return speeding * low_frequency_mass(scene) / amplitude**2, of_components(scene, scene.buoys[0])


@pytest.mark.parametrize("period", [2.6, *(pytest.param(T, marks=pytest.mark.slow) for T in (1.6, 2.2, 3.0, 4.0))])
def test_a_free_cylinder_goes_away_with_the_force_of_the_far_field(period):
    """Within 1.5 % of it, or of the force of the strips where that is larger (up to a hundred times)."""
    force, drift = measured(period, amplitude=0.02 if period > 3.5 else 5e-3)
    assert force == pytest.approx(drift.whole[0], abs=0.015 * max(drift.whole[0], drift.strips[0]))


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, {"waves__stretching": "none"}, {"buoy__disk_averages": True}])
def test_force_of_strips(changes):
    """Without the key: as from first-order motions, five times too large near resonance."""
    force, drift = measured(2.6, buoy__drift=None, **changes)
    assert force == pytest.approx(drift.strips[0], rel=0.01)
    assert force > 4 * drift.whole[0]


SEA = {"spectrum": "jonswap", "significant_height": 0.3, "peak_period": 3.0, "spreading": 10.0, "components": 40}


def test_force_in_a_sea_of_several_directions():
    """Sums over all pairs of waves, where C is and at the instant of the step: 1/2 (D_i + D_j) less strips' part."""
    with running(merged(CYLINDER, waves=SEA | {"kinematics": "exact", "components": 9})) as simulation:
        for _ in range(10):
            simulation.step(0.1)
        buoy = next(iter(simulation.problem.buoys.values()))
        buoy.publish_points()
        found = np.array(buoy.of_components[-1].c.force.value)
        x = buoy.fields.of(simulation.system.u[buoy.part.slice]).position
        waves, drift = AirySum.of(simulation.scene), of_components(simulation.scene, simulation.scene.buoys[0])
        phase = waves.wavenumber * (waves.cosine * x[0] + waves.sine * x[1]) + waves.time_phase(simulation.t)
    way, expected, whole = np.array([waves.cosine, waves.sine]), np.zeros(2), np.zeros(2)
    surge, lean, heave, _ = drift.left
    G1, G2, G3, G4 = drift.right
    for i in range(len(phase)):
        for j in range(len(phase)):
            size = waves.amplitude[i] * waves.amplitude[j]
            turned = np.exp(1j * (phase[j] - phase[i]))
            along = way[:, i] @ way[:, j]
            moved = along * (surge[i].conj() * G1[j] + lean[i].conj() * G2[j]) + heave[i].conj() * G3[j] + G4[j]
            newman = 0.5 * (drift.whole[i] * way[:, i] + drift.whole[j] * way[:, j]) * turned.real
            whole += size * newman
            expected += size * (newman - 0.5 * (moved * turned).real * way[:, j])
        buoy.slow_drift.noting(simulation.system.u)()
    assert found == pytest.approx(expected, rel=1e-9)
    assert buoy.slow_drift.numbers == pytest.approx([*whole, 0.0], rel=1e-9)
    assert np.linalg.norm(expected - whole) > 0.1 * np.linalg.norm(whole)


def test_one_wave_in_any_direction():
    """The force of a single wave is the mean force, along the wave."""
    scene = load_scene(merged(CYLINDER, waves={"amplitude": 0.1, "period": 2.4}))
    drift, angle = of_components(scene, scene.buoys[0]), np.array([0.7])
    pairs = transfer(drift, np.cos(angle), np.sin(angle))[0]
    force = (pairs[:, :1].conj() * pairs[:, 1:]).real.sum(axis=0)
    assert force == pytest.approx((drift.whole - drift.strips) * [math.cos(0.7), math.sin(0.7)])


def test_record_has_the_force():
    """D of the far field times the squared amplitude, along the wave, after the ramp; zero in still water."""
    waves = {"amplitude": 0.1, "period": 2.4, "ramp": 0.3, "direction_deg": 30.0}
    scene = load_scene(merged(CYLINDER, waves=waves, time__end=0.5))
    record, way = simulate(scene), np.array([math.cos(math.pi / 6), 0.5, 0.0])
    force = record.drift_force.values[:, 0]
    assert force[0] == pytest.approx([0.0, 0.0, 0.0])
    assert force[-1] == pytest.approx(0.1**2 * of_components(scene, scene.buoys[0]).whole[0] * way, rel=1e-9)
    assert record.drift_force.attrs["units"] == "N"
    assert "drift_force" not in simulate(merged(CYLINDER, waves=None, time__end=0.1))


def test_long_waves_carry_it_along_without_a_force():
    """D falls with a high power of the frequency, and is not below 0: energy is only scattered."""
    scene = load_scene(CYLINDER | {"waves": {"amplitude": 0.1, "period": 3.0}})
    omega = np.array([0.5, 1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0])
    D = mean_drift(scene, scene.buoys[0], omega, wavenumbers(scene, omega)).whole / (RHO * G)
    assert np.all(np.abs(D[:2]) < 1e-4)
    assert np.all(D[2:] > 0)
    assert D[-1] == pytest.approx(2 / 3, abs=0.06)


# -- slow drift on a soft mooring --------------------------------------------------------------------------------------

STIFFNESS, DAMPING, STEP, RAMP = 200.0, 180.0, 0.06, 20.0
MOORED = merged(
    CYLINDER,
    buoy__center_of_mass=0.65,  # pitch far from the waves, and from half the frequency of heave
    buoy__mooring_height=0.65,
    buoy__initial={"buoy_position": [0.0, 0.0, -0.15]},
    take_off=[
        {
            "name": "spring",
            "from": [-2000.0, 0.0, -0.15],
            "to": "buoy",
            "length": 2000.0,
            "stiffness": STIFFNESS,
            "damping": DAMPING,
        }
    ],
    waves={"spectrum": "jonswap", "significant_height": 0.1, "peak_period": 2.6, "components": 150, "ramp": RAMP},
    time={"end": 620.0, "step": STEP, "scheme": "generalized-alpha"},
)


def slowly(x):
    return filtfilt(*butter(3, 0.12 * 2 * STEP), x)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_drift_of_a_soft_mooring(seed):
    """An oscillator of the same mass under the double sum with the far-field D agrees: 15 % rms, 6 % std."""
    scene = load_scene(merged(MOORED, waves__seed=seed))
    run, waves = simulate(scene), AirySum.of(scene)
    t = np.arange(0.0, 620.0, STEP)
    eta = waves.amplitude * np.exp(1j * (waves.phase - np.outer(t, waves.at_ground)))
    grown = np.where(t < RAMP, 0.5 * (1 - np.cos(np.pi * t / RAMP)), 1.0)
    force = grown**2 * (eta.sum(axis=1).conj() * (eta @ of_components(scene, scene.buoys[0]).whole)).real
    x = v = 0.0
    expected, mass = [], low_frequency_mass(scene)
    for F in force:
        v += STEP * (F - STIFFNESS * x - DAMPING * v) / mass
        x += STEP * v
        expected.append(x)
    found = slowly(np.interp(t, run.time.values, run.buoy_position.values[:, 0, 0]))[t > 150]
    expected = slowly(np.array(expected))[t > 150]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.05)
    assert found.std() == pytest.approx(expected.std(), rel=0.06)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.15 * expected.std()


@pytest.mark.slow
def test_spectrum_of_slow_drift():
    """S_F(mu) = 8 int S(w) S(w + mu) D^2 dw, D the mean at w and w + mu, through the oscillator: over 16 seeds.

    The variance within two and a half of its standard errors, of about 9 %.
    """
    scenes = [load_scene(merged(MOORED, waves__seed=seed, waves__components=300)) for seed in range(20, 36)]
    mass, scene = low_frequency_mass(scenes[0]), scenes[0]
    omega = np.linspace(0.5, 8.0, 3000)
    D = CubicSpline(omega, mean_drift(scene, scene.buoys[0], omega, wavenumbers(scene, omega)).whole)
    spectrum, mu = spectrum_of(scene.waves).density, np.linspace(1e-3, 0.7, 300)
    both = lambda m: spectrum(omega) * spectrum(omega + m) * (D(omega) + D(omega + m)) ** 2 / 4  # noqa: E731
    S_F = [8 * trapezoid(both(m), omega) for m in mu]
    gain = np.abs(STIFFNESS - mu**2 * mass - 1j * mu * DAMPING) ** -2
    variances, means = [], []
    for one in scenes:
        run = simulate(one)
        t = np.arange(0.0, 620.0, STEP)
        x = slowly(np.interp(t, run.time.values, run.buoy_position.values[:, 0, 0]))[t > 150]
        variances.append(x.var())
        means.append(x.mean())
    scatter = np.std(variances) / math.sqrt(len(variances))
    assert np.mean(variances) == pytest.approx(trapezoid(S_F * gain, mu), abs=2.5 * scatter)
    mean = 2 * trapezoid(spectrum(omega) * D(omega), omega) / STIFFNESS
    assert np.mean(means) == pytest.approx(mean, rel=0.05)  # as of single seeds: 4.5 % measured


# -- the far field, by Capytaine ---------------------------------------------------------------------------------------


def solved(draft, depth, omega, around=24):
    """Capytaine's results of a cylinder of radius 1, and its module."""
    import xarray as xr

    cpt = pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    from dolfbuoy.formats.capytaine import Floating, _body
    from dolfbuoy.meshes import HullShape

    body = _body(cpt, Floating(HullShape(((0.0, 2.0), (2 * draft, 2.0))), draft, depth, RHO, G), around, 2)
    cases = {"omega": omega, "radiating_dof": ["Surge", "Heave", "Pitch"], "wave_direction": [0.0]}
    cases |= {"water_depth": [depth], "rho": [RHO], "g": [G]}
    problems = cpt.io.xarray.problems_from_dataset(xr.Dataset(coords=cases), [body])
    return cpt.BEMSolver(method="direct").solve_all(problems, keep_details=True, progress_bar=False)


@pytest.mark.slow
def test_drift_of_a_held_cylinder():
    """A deep one scatters waves as one without end does: within 2 % of the series, which tends to 2/3 rho g R a^2."""
    from dolfbuoy.formats.capytaine import quadratic_forms

    theta, n = np.linspace(0, 2 * np.pi, 400), np.arange(60)

    def series(kR):
        """f = -sum eps_n J_n'/H_n' cos n theta; D = rho g a^2/(2 pi k) int |f|^2 (1 - cos theta)."""
        slope = lambda h: 0.5 * (h(n - 1, kR) - h(n + 1, kR))  # noqa: E731
        with np.errstate(invalid="ignore", over="ignore"):
            ratio = np.nan_to_num(slope(jv) / slope(hankel1)) * np.where(n == 0, 1, 2)
        f = ratio @ np.cos(np.outer(n, theta))
        return trapezoid(np.abs(f) ** 2 * (1 - np.cos(theta)), theta) / (2 * np.pi * kR)

    assert series(30.0) == pytest.approx(2 / 3, rel=0.01)
    k = np.array([1.0, 1.6, 2.4])
    forms = quadratic_forms(solved(3.0, np.inf, np.sqrt(G * k), around=32))
    found = np.array([form[0, 0].real for _, form in sorted(forms.items())]) / (RHO * G)
    assert found == pytest.approx([series(x) for x in k], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [3.0, np.inf])
def test_momentum_and_energy_of_a_free_body(depth):
    """Without dissipation outgoing and incident energy agree, and D = int (1 - cos theta) of the outgoing waves."""
    from dolfbuoy.formats import capytaine

    omega = [1.6, 2.3, 3.2]
    results = solved(0.8, depth, omega)
    forms = capytaine.quadratic_forms(results)
    for w in omega:
        of = {getattr(r, "radiating_dof", ""): r for r in results if abs(float(r.omega) - w) < 1e-9}
        dofs, wave = ("Surge", "Heave", "Pitch"), of[""]
        A, B = (
            np.array([[getattr(of[j], name)[i] for j in dofs] for i in dofs])
            for name in ("added_masses", "radiation_dampings")
        )
        import capytaine as cpt

        undisturbed = cpt.bem.airy_waves.froude_krylov_force(wave)
        X = np.array([wave.forces[i] + undisturbed[i] for i in dofs])
        stiffness = np.diag([0.0, RHO * G * math.pi, 900.0])
        motion = np.linalg.solve(stiffness - w**2 * (np.diag([MASS, MASS, 1500.0]) + A) - 1j * w * B, X)
        y = np.append(1.0, motion)
        H = 1j * y @ np.array([capytaine.kochin(of[name], capytaine.DIRECTIONS) for name in ("", *dofs)])
        turn = 2 * np.pi / len(H)
        taken = -2 * np.pi * RHO * G * wave.wavenumber / w * H[0].imag  # energy over the speed of the crests
        away = 2 * np.pi * RHO * wave.wavenumber * capytaine.weight(wave) * turn * np.abs(H) ** 2
        assert away.sum() == pytest.approx(taken, rel=0.05)
        drift = np.sum(away * (1 - np.cos(turn * np.arange(len(H)))))
        assert (y.conj() @ forms[w] @ y).real == pytest.approx(drift, abs=0.05 * away.sum())


@pytest.mark.slow
def test_far_field_of_capytaine():
    """From sources on panels, and from potential and velocity on the hull: within 6 %, with panels and lid."""
    cpt = pytest.importorskip("capytaine", reason="Capytaine is optional: pip install 'dolfbuoy[potential]'")
    from capytaine.post_pro.kochin import compute_kochin

    from dolfbuoy.formats.capytaine import kochin

    for result in solved(0.8, 20.0, [2.3]):
        sources = cpt.BEMSolver(method="indirect").solve(result.problem, keep_details=True)
        expected = compute_kochin(sources, 2 * np.pi / 8 * np.arange(8))
        assert np.abs(kochin(result, 8) - expected).max() < 0.06 * np.abs(expected).max()
