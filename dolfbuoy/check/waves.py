"""What `check` says of waves: what a sea adds up to, and where waves leave the range of the model."""

import math

import numpy as np

from ..linear import LARGEST_KR
from ..model.airy import AirySum, band_of, components_of, current_felt, dispersion_wavenumber, spectrum_of
from ..model.sea import crest_height, main_propagation, wavenumber
from ..results.extremes import components_needed, crests_of, largest_crest, memory_of
from ..scene.waves import Waves

#: k D of a component from which on a hull of diameter D does more to it than strips know.
SHORTEST_KD = 2
#: Steps of a given size in a period of the waves; significant steepness of seas that exist.
STEPS, STEEPEST = 20, 0.1


def in_waves(scene, lines, buoys, report) -> None:
    """Add to the Report of `check` what it says of the waves of a scene that has some, and of its lines and buoys."""
    if scene.waves.irregular:
        _sea(scene, buoys, report)
    if scene.current:
        _shift(scene, report)
    main = _main_wave(scene)
    k = wavenumber(main)
    way = 2 * math.pi * main.waves.size / math.tanh(k * scene.sea.depth)  # of the water at the surface
    _waves(main, k, report)
    _step(main, report)
    for buoy in buoys:
        said, D = report.about(buoy.name), buoy.shape.max_diameter
        _hull(main, buoy, k * D / 2, said)
        said.add("Keulegan-Carpenter number of the buoy", way / D, "", "at the surface")
    for line in lines:
        number = way / line.material.diameter
        report.about(line.name).add("Keulegan-Carpenter number of the cable", number, "", "at the surface")


def _sea(scene, buoys, report):
    """What the components of an irregular sea add up to."""
    waves, found = scene.waves, components_of(scene.waves)
    m0, m2 = found.moment(0), found.moment(2)
    Tz = 2 * math.pi * math.sqrt(m0 / m2)
    report.add("significant wave height Hs", 4 * math.sqrt(m0), "m", f"of {len(found.amplitude)} components")
    if waves.elevation is None:
        report.add("peak period Tp", waves.main_period, "s", "of the highest component or the spectrum's peak")
    report.add("mean period Tz = 2 pi sqrt(m0/m2)", Tz, "s", f"shortest {2 * math.pi / max(found.frequency):.3g} s")
    _cut(scene, report)
    if scene.gravity:
        steepness = 2 * math.pi * 4 * math.sqrt(m0) / (scene.gravity * Tz**2)
        report.add("significant steepness 2 pi Hs/(g Tz^2)", steepness, "", f"seas stay below {STEEPEST}")
        if steepness > STEEPEST:
            report.warn(f"The significant steepness of {steepness:.3g} is above {STEEPEST}: such a sea would break.")
    _repetition(waves, report)
    _statistics(scene, Tz, report)
    k = AirySum.of(scene).wavenumber
    for buoy in buoys:  # Morison's equation and strips are not meant for these
        count = np.sum(k * buoy.shape.max_diameter > SHORTEST_KD)
        remark = f"of {len(k)}, shorter than {math.pi:.3g} diameters"
        said, k_R = report.about(buoy.name), _wavenumber(scene, Tz) * buoy.shape.max_diameter / 2
        said.add(f"components with k D > {SHORTEST_KD}", count, "", remark)
        said.add("k R of the hull at Tz", k_R, "", f"of waves of {Tz:.3g} s")
        _strips(k_R, f" at the mean period Tz = {Tz:.3g} s", said)


def _wavenumber(scene, period):
    return dispersion_wavenumber(period, scene.sea.depth, scene.gravity)


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
    crests = crests_of(Tz)
    largest = largest_crest(crests)
    height, scatter = largest.mean * crest_height(scene) / 4, 100 * largest.standard_deviation / largest.mean
    report.add("largest crest in 3 h", height, "m", f"+- {scatter:.2g} % from seed to seed")
    if scene.waves.spectrum is not None:
        needed, seeds = components_needed(crests, 0.01), largest.runs_needed(0.03)
        report.add("components for 1 % of that crest", needed, "", f"3 % of it need {seeds} seeds of 3 h")
        if scene.time and scene.time.end:
            scatter = math.sqrt(memory_of(spectrum_of(scene.waves)) / scene.time.end) / 2
            report.add("scatter of Hs in one run", 100 * scatter, "%", "of a Gaussian sea; with fixed amplitudes less")


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


def _waves(scene, k, report):
    w, h, g = scene.waves, scene.sea.depth, scene.gravity
    wavelength, omega = 2 * math.pi / k, 2 * math.pi / w.period
    report.periods["wave"] = w.period
    report.add("wavelength", wavelength, "m", "given" if w.wavelength else "from the dispersion relation")
    if w.wavelength and g:
        exact = 2 * math.pi / dispersion_wavenumber(w.period, h, g)
        mismatch = wavelength / exact - 1
        remark = f"the period gives {exact:.4g} m; omega^2/(g k tanh kh) = {omega**2 / (g * k * math.tanh(k * h)):.5g}"
        report.add("dispersion mismatch of wavelength", 100 * mismatch, "%", remark)
        if abs(mismatch) > 0.1:
            report.warn(f"The wavelength differs from the dispersion relation's by {100 * mismatch:.1f} %.")
    breaking = 0.142 * math.tanh(k * h)
    steepness = 2 * w.size / wavelength
    report.add("wave steepness H/lambda", steepness, "", f"breaking at {breaking:.4g} (Miche)")
    if steepness > breaking:
        report.warn(f"The wave (H/lambda = {steepness:.3g}) is beyond the breaking limit {breaking:.3g}.")


def _step(scene, report):
    """A given step that is long beside the period that a fixed point sees."""
    if scene.time is None or scene.time.tolerance is not None:
        return
    step, omega = scene.time.step, abs(main_propagation(scene).at_ground)
    if STEPS * step * omega > 2 * math.pi:
        period = 2 * math.pi / omega
        report.warn(
            f"time.step = {step:g} s is {step / period:.2g} of the waves' period of {period:.4g} s: take "
            f"{period / STEPS:.2g} s or less, or time.tolerance."
        )


def _strips(k_R, where, report):
    if k_R > LARGEST_KR:
        report.warn(f"k R = {k_R:.3g}{where} is above {LARGEST_KR}: strips of the hull may be 20 to 100 % wrong.")


def _hull(scene, buoy, k_R, report):
    """Where strips leave their range: short waves, and no waves of the buoy's own."""
    ratio, b, wave = k_R / math.pi, buoy.section, scene.waves
    report.add("diffraction parameter D/lambda", ratio, "", "Morison's equation holds below 0.2")
    if ratio >= 0.2:
        report.warn(f"D/lambda = {ratio:.3g} is not below 0.2: diffraction is not negligible.")
    report.add("k R of the hull", k_R, "", "strips are good to 3 % of the motion below 0.4")
    _strips(k_R, "", report)
    if scene.gravity and not buoy.drowned:  # drag linearised to the same work
        floating = buoy.under(buoy.pull)
        area, spheres, _ = buoy.shape.projected(floating.draft)
        linear = 8 / (3 * math.pi) * 0.5 * buoy.density * b.axial_drag * area * 2 * math.pi / wave.period * wave.size
        linear += b.wave_damping[0] if b.wave_damping else 0.0
        inertia = buoy.mass.mass + b.axial_added_mass * buoy.density * spheres
        critical = 2 * math.sqrt(floating.heave_stiffness * inertia)
        of = f"of axial_drag{' and wave_damping' if b.wave_damping else ''}"
        remark = f"{of}, for heave as high as this wave; the hull radiates no waves"
        report.add("heave damping ratio", linear / critical if critical else math.inf, "", remark)
