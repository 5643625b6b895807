"""Waves: statistics of a sea, and limits of the model that it exceeds.

Also estimates of coefficients by shape and of radiation damping, and warnings where that is missing.
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..linear import LARGEST_KR
from ..model.airy import AirySum, band_of, components_of, current_felt, dispersion_wavenumber, spectrum_of, stream_wave
from ..model.sea import crest_height, main_propagation, wavenumber
from ..model.spectra import Spectrum
from ..results.extremes import components_needed, crests_of, largest_crest, memory_of
from ..scene import Scene
from ..scene.quantities import Wrong
from ..scene.shapes import BY_SHAPE, SHAPES, SOURCE, estimate
from ..scene.stream import STEEPEST as STEEPEST_WAVE
from ..scene.waves import Waves
from .buoys import Upright
from .lines import Line

if TYPE_CHECKING:
    from .report import Report

#: Excess height of the crest of a steep wave over Airy's above which `check` warns [%].
LOW_CREST = 5.0
#: k D of a component above which a hull of diameter D disturbs it more than strip theory allows.
SHORTEST_KD = 2
#: Largest H/lambda of a steady wave over tanh kd (Miche 1944).
MICHE = 0.142
#: Least number of fixed steps per wave period; largest significant steepness of real seas.
STEPS, STEEPEST = 20, 0.1


def in_waves(scene: Scene, lines: Iterable[Line], buoys: list[Upright], report: "Report") -> None:
    """Add the numbers of the waves, and of lines and buoys in them, to the Report of `check`."""
    wave, sea = scene.waves, scene.sea
    if wave is None or sea is None:
        return
    highest = 2 * wave.size
    if wave.irregular:
        highest = 2 * _sea(scene, wave, sea.depth, buoys, report)
    if scene.current and not scene.current.grid:
        _shift(scene, wave, report)
    in_a_sea = wave.irregular
    if in_a_sea:  # from here on, a regular wave of height Hs and the main period
        kept = {name: getattr(wave, name) for name in ("direction_deg", "period_seen_from")}
        wave = Waves(height=crest_height(scene), period=wave.main_period, **kept)
        scene = scene.model_copy(update={"waves": wave})
    _steepness(scene, highest, report)
    k = wavenumber(scene)
    way = 2 * math.pi * wave.size / math.tanh(k * sea.depth)  # of the water at the surface
    _regular(wave, k, sea.depth, scene.gravity, report)
    omega = abs(main_propagation(scene).at_ground)
    if scene.time is not None and scene.time.tolerance is None and omega:
        step, period = scene.time.step, 2 * math.pi / omega
        report.warn(
            STEPS * step > period,
            f"time.step = {step:g} s is {step / period:.2g} of the waves' period of {period:.4g} s: take "
            f"{period / STEPS:.2g} s or less, or time.tolerance.",
        )
    for buoy in buoys:
        about, D = report.about(buoy.name), buoy.shape.max_diameter
        _hull(scene, wave, buoy, k * D / 2, about, in_a_sea)
        about.add("Keulegan-Carpenter number of the buoy", way / D, "", "at the surface")
    for line in lines:
        number = way / (line.material.diameter or math.nan)
        report.about(line.name).add("Keulegan-Carpenter number of the cable", number, "", "at the surface")


def _sea(scene: Scene, waves: Waves, depth: float, buoys: list[Upright], report: "Report") -> float:
    """Add statistics of an irregular sea; returns the height of its largest crest in 3 h [m]."""
    found, spectrum = components_of(waves), spectrum_of(waves)
    m0, m2 = found.moment(0), found.moment(2)
    Tz = 2 * math.pi * math.sqrt(m0 / m2)
    report.add("significant wave height Hs", 4 * math.sqrt(m0), "m", f"of {len(found.amplitude)} components")
    if waves.elevation is None:
        report.add("peak period Tp", waves.main_period, "s", "of the highest component or the spectrum's peak")
    report.add("mean period Tz = 2 pi sqrt(m0/m2)", Tz, "s", f"shortest {2 * math.pi / max(found.frequency):.3g} s")
    if spectrum is not None:
        low, high = band_of(waves, spectrum)
        remark = f"outside {2 * math.pi / high:.3g} ... {2 * math.pi / max(low, 1e-9):.3g} s"
        ripples = "; most of it in ripples" if isinstance(waves.spectrum, str) else ""  # its tail makes m4 infinite
        for n, more in ((0, ""), (2, ripples)):
            cut = 1 - spectrum.moment(n, low, high) / spectrum.moment(n)
            report.add(f"cut off of m{n}", 100 * cut, "%", remark + more)
    if scene.gravity:
        steepness = 2 * math.pi * 4 * math.sqrt(m0) / (scene.gravity * Tz**2)
        report.add("significant steepness 2 pi Hs/(g Tz^2)", steepness, "", f"seas stay below {STEEPEST}")
        above = f"The significant steepness of {steepness:.3g} is above {STEEPEST}: such a sea would break."
        report.warn(steepness > STEEPEST, above)
    if waves.elevation is not None:
        rows: Any = waves.elevation
        length = (rows[-1][0] - rows[0][0]) * len(rows) / (len(rows) - 1)
        report.add("the sea repeats after", length, "s", "the length of the record")
    elif waves.spectrum is not None:
        report.add("the sea repeats after", math.inf, "s", "bins of equal energy have no common period")
    crest = _statistics(scene, spectrum, Tz, report)
    k = AirySum.of(scene).wavenumber
    for buoy in buoys:  # Morison's equation and strips do not hold for these
        count = np.sum(k * buoy.shape.max_diameter > SHORTEST_KD)
        remark = f"of {len(k)}, shorter than {math.pi:.3g} diameters"
        k_R = dispersion_wavenumber(Tz, depth, scene.gravity) * buoy.shape.max_diameter / 2
        about = report.about(buoy.name)
        about.add(f"components with k D > {SHORTEST_KD}", count, "", remark)
        about.add("k R of the hull at Tz", k_R, "", f"of waves of {Tz:.3g} s")
        _strips(buoy, k_R, f" at the mean period Tz = {Tz:.3g} s", about)
    return crest


def _statistics(scene: Scene, spectrum: Spectrum | None, Tz: float, report: "Report") -> float:
    """Add numbers of components and seeds for extremes, and the scatter of Hs in one run.
    Returns the largest crest in 3 h [m]."""
    crests = crests_of(Tz)
    largest = largest_crest(crests)
    height, scatter = largest.mean * crest_height(scene) / 4, 100 * largest.standard_deviation / largest.mean
    report.add("largest crest in 3 h", height, "m", f"+- {scatter:.2g} % from seed to seed")
    waves: Any = scene.waves
    if waves.crest is not None:
        apart = (waves.crest - height) / (height * scatter / 100)
        remark = f"at t = {waves.crest_time:g} s, {abs(apart):.2g} of that scatter {'above' if apart > 0 else 'below'}"
        report.add("prescribed crest", waves.crest, "m", remark)
        late = scene.time is not None and waves.crest_time >= scene.time.end
        report.warn(late, f"The crest of waves.crest_time = {waves.crest_time:g} s comes after the end of the run.")
    if spectrum is not None:
        needed, seeds = components_needed(crests, 0.01), largest.runs_needed(0.03)
        report.add("components for 1 % of that crest", needed, "", f"3 % of it need {seeds} seeds of 3 h")
        if scene.time and scene.time.end:
            scatter = math.sqrt(memory_of(spectrum) / scene.time.end) / 2
            report.add("scatter of Hs in one run", 100 * scatter, "%", "of a Gaussian sea; with fixed amplitudes less")
    return max(height, waves.crest or 0.0)


def _shift(scene: Scene, waves: Waves, report: "Report") -> None:
    """Add the Doppler shift of the frequency by the current, and the frame in which periods are given."""
    seen, period = waves.period_seen_from, waves.main_period
    found = main_propagation(scene)
    shift = found.wavenumber * current_felt(scene, found.wavenumber, waves.direction_deg)
    who = {
        None: f"not counted: {period:.4g} s is seen from the water and the ground; see waves.period_seen_from",
        "water": f"{period:.4g} s is seen from the water, {2 * math.pi / abs(found.at_ground):.4g} s from the ground",
        "ground": f"{period:.4g} s is seen from the ground, {2 * math.pi / abs(found.in_water):.4g} s from the water",
    }[seen]
    report.add("shift of omega by the current", 100 * shift / found.in_water, "%", who)


def _regular(w: Waves, k: float, h: float, g: float, report: "Report") -> None:
    period: float = w.main_period
    wavelength, omega = 2 * math.pi / k, 2 * math.pi / period
    report.periods["wave"] = period
    origin = "of the steep wave" if w.theory == "stream" else "from the dispersion relation"
    report.add("wavelength", wavelength, "m", "given" if w.wavelength else origin)
    if w.wavelength and g:
        exact = 2 * math.pi / dispersion_wavenumber(period, h, g)
        mismatch = wavelength / exact - 1
        remark = f"the period gives {exact:.4g} m; omega^2/(g k tanh kh) = {omega**2 / (g * k * math.tanh(k * h)):.5g}"
        report.add("dispersion mismatch of wavelength", 100 * mismatch, "%", remark)
        differs = f"The wavelength differs from the dispersion relation's by {100 * mismatch:.1f} %."
        report.warn(abs(mismatch) > 0.1, differs)
    breaking = MICHE * math.tanh(k * h)
    steepness = 2 * w.size / wavelength
    report.add("wave steepness H/lambda", steepness, "", f"breaking at {breaking:.4g} (Miche)")
    report.warn(
        steepness > breaking,
        f"The wave (H/lambda = {steepness:.3g}) is beyond the breaking limit {breaking:.3g}.",
    )


def _steepness(scene: Scene, height: float, report: "Report") -> None:
    """Add the deficit of Airy theory for a regular or a sea's largest wave against the steady wave of its height."""
    waves, sea = scene.waves, scene.sea
    if waves is None or sea is None or not height or not scene.gravity or waves.wavelength is not None:
        return
    update = {"theory": "stream", "height": height, "amplitude": None, "phase_deg": 0.0, "ramp": 0.0}
    steep = scene.model_copy(update={"waves": waves.model_copy(update=update)})
    what = f"a wave of {height:.3g} m and {waves.main_period:.3g} s"
    try:
        found, water = stream_wave(steep), AirySum.of(steep)
    except InputError:
        above = f"The largest wave ({height:.3g} m in {waves.main_period:.3g} s) is"
        largest = f"{above} above {STEEPEST_WAVE} of the height at which it breaks: no theory here holds."
        k = wavenumber(scene)
        own = height <= 2 * waves.size and waves.size * k > math.pi * MICHE * math.tanh(k * sea.depth)
        report.warn(not own, largest)  # `_regular` warns of a regular wave beyond the limit
        return
    length = 2 * math.pi / found.wavenumber
    ursell = height * length**2 / sea.depth**3
    report.add("Ursell number H lambda^2/d^3", ursell, "", f"of {what}; H/lambda = {height / length:.3g}")
    if waves.theory == "stream":
        return
    u = water.flow(0.0, np.array([0.0, 0.0, found.crest]))[0] @ [water.cosine[0], water.sine[0], 0.0]
    linear = AirySum.of(scene.model_copy(update={"waves": waves.model_copy(update={**update, "theory": "airy"})}))
    at_crest = linear.flow(0.0, np.array([0.0, 0.0, height / 2]))[0] @ [linear.cosine[0], linear.sine[0], 0.0]
    crest, speed = 100 * (2 * found.crest / height - 1), 100 * (u / at_crest - 1)
    remark = "Airy's are that much too low there; waves.theory = 'stream' has them"
    report.add("crest of the steep wave above Airy's", crest, "%", f"of {what}")
    report.add("its velocity at the crest above Airy's", speed, "%", remark)
    report.warn(
        crest > LOW_CREST,
        f"Airy's theory has the crest of {what} {crest:.2g} % too low and the velocity there {speed:.2g} %: "
        "waves.theory = 'stream' holds for one regular wave of this height.",
    )


def _strips(buoy: Upright, k_R: float, where: str, report: "Report") -> None:
    high = f"k R = {k_R:.3g}{where} is above {LARGEST_KR}: strips of the hull may be 20 to 100 % wrong."
    report.warn(k_R > LARGEST_KR and buoy.section.potential_flow is None, high)


def _hull(scene: Scene, wave: Waves, buoy: Upright, k_R: float, report: "Report", in_a_sea: bool) -> None:
    """Check limits of strips: short waves, and missing radiation.  in_a_sea: True if the wave stands for a sea."""
    ratio, b, speed = k_R / math.pi, buoy.section, 2 * math.pi / wave.main_period * wave.size
    report.add("diffraction parameter D/lambda", ratio, "", "Morison's equation holds below 0.2")
    strips = b.potential_flow is None
    report.warn(ratio >= 0.2 and strips, f"D/lambda = {ratio:.3g} is not below 0.2: diffraction is not negligible.")
    report.add("k R of the hull", k_R, "", "strips are good to 3 % of the motion below 0.4" if strips else "")
    _strips(buoy, k_R, "", report)
    if scene.gravity and not buoy.drowned:  # drag linearised for equal work
        floating = buoy.under(buoy.pull)
        area, spheres, _ = buoy.shape.projected(floating.draft)
        linear = 8 / (3 * math.pi) * 0.5 * buoy.density * b.axial_drag * area * speed
        linear += b.wave_damping[0] if b.wave_damping else 0.0
        inertia = buoy.mass.mass + b.axial_added_mass * buoy.density * spheres
        critical = 2 * math.sqrt(floating.heave_stiffness * inertia)
        of = f"of axial_drag{' and wave_damping' if b.wave_damping else ''}"
        without = "; the hull radiates no waves" if strips else "; radiation comes on top"
        remark = f"{of}, for heave as high as this wave{'' if b.wave_damping else without}"
        ratio = linear / critical if critical else math.inf
        report.add("heave damping ratio", ratio, "", remark)
        if strips:
            of_radiation(scene, wave, ratio, buoy, report, IN_A_SEA if in_a_sea else NEAR)


#: Range of the draft of the equivalent cylinder over that of the hull in which it represents the hull.
LIKE = 0.67, 1.5
#: Range of natural period over wave period in which resonance matters, for regular waves and a sea: in the tail of a
#: sea, S ~ omega^-5, it adds 2.7 r^4/zeta of its variance; r: ratio of periods, zeta: damping ratio.
NEAR, IN_A_SEA = (0.8, 1.25), (0.2, 1.4)
#: Radiation damping ratio that matters: relative to that of drag in heave, and absolute in pitch.
MUCH, LEAST = 0.5, 0.03


def of_shapes(scene: Scene, buoys: list[Upright], report: "Report") -> None:
    """Add the values of coefficients given by shape to the Report of `check`, and warn outside their range."""
    raw = dict(zip(scene.network.buoys, scene.buoys, strict=True))
    for buoy in buoys:
        about, found = report.about(buoy.name), buoy.section
        given = raw[buoy.name or next(iter(raw))]
        names = {key: value for key in (*BY_SHAPE, "wave_damping") if isinstance(value := getattr(given, key), str)}
        for key, shape in names.items():
            if key in BY_SHAPE:
                about.add(f"{key} of a {shape}", getattr(found, key), "", SOURCE)
            else:
                for motion, size, unit in zip(
                    ("heave", "pitch"), found.wave_damping or (), ("N s/m", "N m s"), strict=False
                ):
                    about.add(f"radiation damping in {motion}", size, unit, SOURCE)
        if not names:
            continue
        of = estimate(scene, given)
        slender, likeness = of.cylinder.draft / of.cylinder.radius, of.cylinder.draft / of.draft
        for shape in dict.fromkeys(shape for shape in names.values() if shape in SHAPES):
            low, high = SHAPES[shape]
            limits = f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
            about.warn(
                not low <= slender <= high,
                f"A draft of {slender:.2g} radii is not that of a {shape}, {limits}: coefficients by this shape are "
                "a guess.",
            )
        about.warn(
            not LIKE[0] <= likeness <= LIKE[1],
            f"The hull is no cylinder: one with its water plane has {likeness:.2g} of its draft, so that coefficients "
            "by shape are rough.",
        )


def of_radiation(
    scene: Scene, waves: Waves, of_drag: float, buoy: Upright, report: "Report", band: tuple[float, float]
) -> None:
    """Warn if radiation would damp a resonance of the hull, but the scene has no radiation damping.

    of_drag: damping ratio of heave by drag.  band: range of natural period over wave period that counts as resonance.
    """
    low, high = band
    if buoy.section.wave_damping is not None or getattr(buoy.section, "potential_flow", None) is not None:
        return
    try:
        found = estimate(scene, buoy.section)
    except (Wrong, InputError):  # it is submerged or has no water plane
        return
    for motion, omega, (added, damping), inertia, enough in (
        ("heave", found.heave, found.of_heave, buoy.mass.mass, MUCH * of_drag),
        ("pitch", found.pitch, found.of_pitch, buoy.mass.inertia[0], LEAST),
    ):
        ratio, period = damping / (2 * omega * (inertia + added)), 2 * math.pi / omega
        report.add(f"{motion} damping ratio by waves of its own", ratio, "", f"an estimate; period {period:.3g} s")
        drag = f", by drag {of_drag:.2g}" if motion == "heave" else ""
        report.warn(
            ratio > enough and low <= period / waves.main_period <= high,
            f"The natural period of {motion}, {period:.3g} s, is among those of the waves, and the hull makes waves "
            f"that damp it with a ratio of {ratio:.2g}{drag}: buoy.wave_damping = 'radiation' has them.",
        )
