"""Checks of potential-flow coefficients: consistency with each other, the hull and the water, and gaps."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model import Array
from ..model.airy import AirySum, dispersion_wavenumber
from ..model.drift import of_components
from ..model.memory_fit import ENOUGH
from ..model.potential_flow import coefficients_of, draft_of, froude_krylov, states_of, wavenumbers
from ..scene import Scene
from .buoys import Upright

if TYPE_CHECKING:
    from .report import Report

#: Relative thresholds of warnings: draft, depth and density; forces; memory; energy of the sea.
OTHER, APART, INCONSISTENT, OUTSIDE = 0.03, 0.05, 0.1, 0.01
#: Fraction of the Froude-Krylov heave force by which the force in the longest waves may differ from it.
LIKE_STRIPS = 0.5
#: Fraction of the mean drift by which strips must be off for a warning.
MUCH = 0.2
#: k h above which waves do not feel the bed.
DEEP = 4.0


def of_potential_flow(scene: Scene, buoys: list[Upright], report: "Report") -> None:
    """Add checks of the potential-flow coefficients of buoys to the Report of `check`.

    Raises InputError for a hull that sinks.
    """
    own = [buoy for buoy in buoys if buoy.section.potential_flow is not None]
    for buoy in own:
        about, flow = report.about(buoy.name), buoy.section.potential_flow
        _memory(scene, buoy, about)
        _hull(scene, buoy, about)
        _water(scene, buoy, about)
        if scene.waves is not None:
            _range(scene, buoy, about)
            if flow is not None and flow.mean_drift is not None:
                _drift(scene, buoy, about)
    report.warn(len(own) > 1, "Of potential flow there is no current in the memory, and no waves between buoys.")


def _memory(scene: Scene, buoy: Upright, report: "Report") -> None:
    for name, states in zip(("heave", "a vertical plane"), states_of(scene, buoy.section), strict=True):
        said = f"error {100 * states.error:.2g} % of the largest K; no current in it"
        report.add(f"states of the radiation memory of {name}", states.order, "", said)
        report.warn(
            states.error > 2 * ENOUGH,
            f"The radiation memory of {name} has an error of {100 * states.error:.2g} % with {states.order} states: "
            "take another buoy.memory_order, or more frequencies.",
        )
        report.warn(
            states.inconsistent > INCONSISTENT,
            f"Damping and added mass of buoy.potential_flow in {name} do not belong together (Kramers and Kronig, "
            f"{100 * states.inconsistent:.2g} % of the largest K): give higher frequencies, a finer mesh, or a lid.",
        )


def _hull(scene: Scene, buoy: Upright, report: "Report") -> None:
    """Check draft, Froude-Krylov force and Haskind's relation."""
    c, draft = coefficients_of(scene, buoy.section), draft_of(scene, buoy.section)
    rest = draft if buoy.drowned else buoy.under(buoy.pull).draft
    report.warn(
        abs(rest / draft - 1) > OTHER,
        f"buoy.potential_flow is of a draft of {draft:.4g} m, the buoy floats at {rest:.4g} m.",
    )
    own = froude_krylov(scene, buoy.section, draft, wavenumbers(scene, c.omega))
    if c.undisturbed is not None:
        apart = _apart(c.undisturbed, own)
        report.add("Froude-Krylov force of the file against the hull's", 100 * apart, "%", "largest difference")
        report.warn(
            apart > APART,
            f"The Froude-Krylov force of buoy.potential_flow is {100 * apart:.2g} % off that of the hull: its unit, "
            "sign, depth or point is another, or it is of another hull.",
        )
    force = c.force + (own if c.undisturbed is None else c.undisturbed)
    surge, heave = ((force[0] * own[0].conj()).real / np.abs(own[0]) ** 2)[[0, 2]]
    report.warn(
        surge < 0 or abs(heave - 1) > LIKE_STRIPS,
        f"In its longest waves the force of buoy.potential_flow is {heave:.2g} times the hull's Froude-Krylov force in "
        f"heave, {surge:.2g} times in surge: its unit is another, or its phases are of exp(+i omega t).",
    )
    of_force = _haskind(scene, c.omega, force)
    damping = np.diagonal(c.damping, axis1=1, axis2=2)
    apart = _apart(damping[:, [0, 2]], of_force[:, [0, 2]])
    report.add("damping of the file against its wave force's", 100 * apart, "%", "Haskind, largest difference")
    report.warn(
        apart > APART,
        f"Damping and wave force of buoy.potential_flow do not belong together (Haskind, {100 * apart:.2g} %): "
        "units, or irregular frequencies, for which Capytaine wants a lid.",
    )


def _drift(scene: Scene, buoy: Upright, report: "Report") -> None:
    """Add the mean drift force in the scene's waves, and the part captured by strips."""
    energy, found = AirySum.of(scene).amplitude ** 2, of_components(scene, buoy.section)
    whole, strips = float(energy @ found.whole), float(energy @ found.strips)
    named = buoy.section.drift is not None
    said = "Newman's approximation" if named else f"buoy.drift = 'newman' has it; strips alone {strips / 1e3:.3g} kN"
    report.add("mean drift force of the waves", whole / 1e3, "kN", f"the buoy free and without drag; {said}")
    report.warn(
        not named and abs(strips - whole) > MUCH * abs(whole),
        f"The mean drift force of the waves is {whole / 1e3:.3g} kN, strips alone make {strips / 1e3:.3g} kN of it: "
        "buoy.drift = 'newman' brings the rest.",
    )


def _haskind(scene: Scene, omega: Array, force: Array) -> Array:
    """Damping (n, 3) consistent with the wave forces: k |F|^2/(4 rho g c_g) in heave, half of that in a plane."""
    sea: Any = scene.sea
    g, h = scene.gravity, sea.depth
    k = wavenumbers(scene, omega)
    kh = np.minimum(k * h, 300.0)
    speed = omega / (2 * k) * (1 + 2 * kh / np.sinh(2 * kh))
    return np.asarray((k / (4 * sea.density * g * speed))[:, None] * np.abs(force) ** 2 * [0.5, 0.5, 1.0])


def _apart(values: Array, exact: Array) -> float:
    """Largest differences in surge and heave relative to their largest values."""
    ends = [0, -1]
    size = np.abs(exact[:, ends]).max(axis=0)
    return float((np.abs(values - exact)[:, ends].max(axis=0) / np.maximum(size, 1e-300)).max())


def _water(scene: Scene, buoy: Upright, report: "Report") -> None:
    flow: Any = buoy.section.potential_flow
    sea: Any = scene.sea
    longest = dispersion_wavenumber(2 * math.pi / flow.omega[0], sea.depth, scene.gravity)
    shallow = min(flow.depth or math.inf, sea.depth)
    report.warn(
        longest * shallow < DEEP and abs((flow.depth or math.inf) / sea.depth - 1) > OTHER,
        f"buoy.potential_flow is for {f'{flow.depth:.4g} m of' if flow.depth else 'deep'} water, the sea has "
        f"{sea.depth:.4g} m: waves of {2 * math.pi / flow.omega[0]:.3g} s feel the bed.",
    )
    report.warn(
        flow.density is not None and abs(flow.density / sea.density - 1) > OTHER,
        f"buoy.potential_flow is for water of {flow.density} kg/m^3, the sea has {sea.density:g} kg/m^3.",
    )


def _range(scene: Scene, buoy: Upright, report: "Report") -> None:
    """Warn of wave energy above the frequencies of the file, where diffraction is that at its highest one."""
    flow: Any = buoy.section.potential_flow
    waves, highest = AirySum.of(scene), flow.omega[-1]
    energy = waves.amplitude**2
    outside = float(energy[waves.in_water > highest].sum() / max(energy.sum(), 1e-300))
    report.warn(
        outside > OUTSIDE,
        f"{100 * outside:.2g} % of the waves' energy is above {highest:.3g} rad/s, where buoy.potential_flow ends.",
    )
