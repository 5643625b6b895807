"""What `check` says of waves: what a sea adds up to, and where waves leave the range of the model."""

import math

import numpy as np

from ..linear import LARGEST_KR
from ..model.airy import AirySum
from ..model.components import band_of, components_of, current_felt, dispersion_wavenumber, spectrum_of
from ..model.feasible import drowned, pull_upright, shape_and_mass
from ..model.hydrostatics import float_upright
from ..model.sea import crest_height, main_propagation, wavenumber
from ..model.sea_statistics import components_needed, largest_crest, scatter_of_m0, seeds_needed
from ..scene.network import single
from ..scene.waves import Waves

#: What extremes are counted over [s].
THREE_HOURS = 10800.0

#: k D of a component from which on a hull of diameter D does more to it than strips know.
SHORTEST_KD = 2


def in_waves(scene, report) -> None:
    """Add to the Report of `check` what it says of the waves of a scene that has some."""
    _sea(scene, report)
    _waves(_main_wave(scene), report)


def _sea(scene, report):
    """What the components of an irregular sea add up to, and what a current makes of the periods."""
    waves = scene.waves
    if waves.irregular:
        found = components_of(waves)
        m0, m2 = found.moment(0), found.moment(2)
        Tz = 2 * math.pi * math.sqrt(m0 / m2)
        report.add("significant wave height Hs", 4 * math.sqrt(m0), "m", f"of {len(found.amplitude)} components")
        if waves.elevation is None:
            report.add("peak period Tp", waves.main_period, "s", "of the highest component or the spectrum's peak")
        report.add("mean period Tz = 2 pi sqrt(m0/m2)", Tz, "s", f"shortest {2 * math.pi / max(found.frequency):.3g} s")
        _cut(scene, report)
        if scene.gravity:
            steepness = 2 * math.pi * 4 * math.sqrt(m0) / (scene.gravity * Tz**2)
            report.add("significant steepness 2 pi Hs/(g Tz^2)", steepness, "", "seas stay below 0.1")
        _repetition(waves, report)
        _statistics(scene, Tz, report)
        _short_components(scene, found, report)
    if scene.current:
        _shift(scene, report)


def _cut(scene, report):
    """What the band leaves out of a spectrum."""
    spectrum = spectrum_of(scene.waves)
    if spectrum is None:
        return
    band = band_of(scene.waves, spectrum)
    for n in (0, 2):
        cut = 1 - spectrum.moment(n, *band) / spectrum.moment(n)
        remark = f"outside {2 * math.pi / band[1]:.3g} ... {2 * math.pi / max(band[0], 1e-9):.3g} s"
        if n == 2 and isinstance(scene.waves.spectrum, str):  # its tail carries m4 = inf
            remark += "; most of it in ripples"
        report.add(f"cut off of m{n}", 100 * cut, "%", remark)


def _repetition(waves, report):
    if waves.elevation is not None:
        times = [t for t, _ in waves.elevation]
        length = (times[-1] - times[0]) * len(times) / (len(times) - 1)
        report.add("the sea repeats after", length, "s", "the length of the record")
    elif waves.spectrum is not None:
        report.add("the sea repeats after", math.inf, "s", "bins of equal energy have no common period")


def _statistics(scene, Tz, report):
    """How many components and seeds extremes of this sea need, and what one run tells of its height."""
    crests = max(THREE_HOURS / Tz, 2.0)
    mean, deviation = largest_crest(crests)
    height, scatter = mean * crest_height(scene) / 4, 100 * deviation / mean
    report.add("largest crest in 3 h", height, "m", f"+- {scatter:.2g} % from seed to seed")
    if scene.waves.spectrum is not None:
        needed, seeds = components_needed(crests, 0.01), seeds_needed(crests, 0.03)
        report.add("components for 1 % of that crest", needed, "", f"3 % of it need {seeds} seeds of 3 h")
        if scene.time and scene.time.end:
            scatter = scatter_of_m0(spectrum_of(scene.waves), scene.time.end)
            report.add("scatter of Hs in one run", 50 * scatter, "%", "of a Gaussian sea; with fixed amplitudes less")


def _short_components(scene, found, report):
    """Components for which Morison's equation and strips are not meant."""
    if single(scene).buoy is None or single(scene).buoy.hull is None:
        return
    diameter = shape_and_mass(single(scene).buoy)[0].max_diameter
    k = AirySum.of(scene).wavenumber
    count = int(np.sum(k * diameter > SHORTEST_KD))
    report.add(f"components with k D > {SHORTEST_KD}", count, "", f"of {len(k)}, shorter than {math.pi:.3g} diameters")


def _shift(scene, report):
    """One sentence on who sees the periods."""
    seen, period = scene.waves.period_seen_from, scene.waves.main_period
    found = main_propagation(scene)
    shift = found.wavenumber * current_felt(scene, found.wavenumber, scene.waves.direction_deg)
    who = {
        None: f"not counted: {period:.4g} s is seen from the water and the ground; see waves.period_seen_from",
        "water": f"{period:.4g} s is seen from the water, {2 * math.pi / abs(found.at_ground):.4g} s from the ground",
        "ground": f"{period:.4g} s is seen from the ground, {2 * math.pi / abs(found.in_water):.4g} s from the water",
    }[seen]
    report.add("shift of omega by the current", 100 * shift / found.in_water, "%", who)


def _main_wave(scene):
    """The scene, its irregular sea as a regular wave of Hs and the main period."""
    waves = scene.waves
    if not waves.irregular:
        return scene
    kept = {name: getattr(waves, name) for name in ("direction_deg", "period_seen_from")}
    return scene.model_copy(update={"waves": Waves(height=crest_height(scene), period=waves.main_period, **kept)})


def _waves(scene, report):
    w, h, g = scene.waves, scene.sea.depth, scene.gravity
    k, omega = wavenumber(scene), 2 * math.pi / w.period
    wavelength = 2 * math.pi / k
    report.periods["wave"] = w.period
    report.add("wavelength", wavelength, "m", "given" if w.wavelength else "from the dispersion relation")
    if w.wavelength and g:
        exact = 2 * math.pi / dispersion_wavenumber(w.period, h, g)
        mismatch = wavelength / exact - 1
        remark = f"the period gives {exact:.4g} m; omega^2/(g k tanh kh) = {omega**2 / (g * k * math.tanh(k * h)):.5g}"
        report.add("dispersion mismatch of wavelength", 100 * mismatch, "%", remark)
        if abs(mismatch) > 0.1:
            report.warnings.append(f"The wavelength differs from the dispersion relation's by {100 * mismatch:.1f} %.")
    breaking = 0.142 * math.tanh(k * h)
    steepness = 2 * w.size / wavelength
    report.add("wave steepness H/lambda", steepness, "", f"breaking at {breaking:.4g} (Miche)")
    if steepness > breaking:
        report.warnings.append(f"The wave (H/lambda = {steepness:.3g}) is beyond the breaking limit {breaking:.3g}.")
    if single(scene).buoy:
        diameter = shape_and_mass(single(scene).buoy)[0].max_diameter
        ratio = diameter / wavelength
        report.add("diffraction parameter D/lambda", ratio, "", "Morison's equation holds below 0.2")
        if ratio >= 0.2:
            report.warnings.append(f"D/lambda = {ratio:.3g} is not below 0.2: diffraction is not negligible.")
        _strips(scene, report, k * diameter / 2)
        _keulegan_carpenter(report, "buoy", scene, k, diameter)
    if single(scene).cable:
        _keulegan_carpenter(report, "cable", scene, k, single(scene).cable.diameter)


def _strips(scene, report, k_R):
    """Where strips leave their range: short waves, and no waves of the buoy's own."""
    report.add("k R of the hull", k_R, "", "strips are good to 3 % of the motion below 0.4")
    if k_R > LARGEST_KR:
        report.warnings.append(f"k R = {k_R:.3g} is above {LARGEST_KR}: strips of the hull may be 20 to 100 % wrong.")
    if not scene.gravity or drowned(scene, next(iter(scene.network.buoys))):
        return
    damping = _heave_damping(scene)
    given = " and wave_damping" if single(scene).buoy.wave_damping else ""
    remark = f"of axial_drag{given}, for heave as high as this wave; the hull radiates no waves"
    report.add("heave damping ratio", damping, "", remark)


def _heave_damping(scene):
    """Damping ratio that drag gives to a heave of the wave's amplitude and period, linearised to the same work."""
    shape, mass = shape_and_mass(single(scene).buoy)
    b, rho_w, omega = single(scene).buoy, scene.sea.density, 2 * math.pi / scene.waves.period
    floating = float_upright(shape, mass, rho_w, scene.gravity, pull_upright(scene, next(iter(scene.network.buoys))))
    area, spheres, _ = shape.projected(floating.draft)
    linear = 8 / (3 * math.pi) * 0.5 * rho_w * b.axial_drag * area * omega * scene.waves.size
    linear += b.wave_damping[0] if b.wave_damping else 0.0
    inertia = mass.mass + b.axial_added_mass * rho_w * spheres
    return linear / (2 * math.sqrt(floating.heave_stiffness * inertia)) if floating.heave_stiffness else math.inf


def _keulegan_carpenter(report, name, scene, k, diameter):
    speed = 2 * math.pi / scene.waves.period * scene.waves.size / math.tanh(k * scene.sea.depth)
    report.add(f"Keulegan-Carpenter number of the {name}", speed * scene.waves.period / diameter, "", "at the surface")
