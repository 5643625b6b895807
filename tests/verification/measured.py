"""Measured lines and a measured buoy beside what dolfbuoy and MoorDyn compute for them.

    .venv/bin/python -m tests.verification.measured [--no-moordyn]

Each test is a scene with the numbers that its authors give, nothing fitted; where they leave one open, the row's
remark says what was taken.  Origins and licences of the measured series: tests/reference/README.md.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from dolfbuoy.api import simulate
from dolfbuoy.formats.moordyn_run import run as run_moordyn
from dolfbuoy.formats.to_moordyn import Export, Numerics, export
from dolfbuoy.model.rigid import float_upright, mass_properties, shape_of
from dolfbuoy.results.style import Figure, new_figure
from dolfbuoy.scene import load_scene
from dolfbuoy.studies.peer import beginning
from dolfbuoy.studies.study import Table

from .script import make, start

DATA = Path(__file__).parents[1] / "reference"
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Test:
    """A measured top tension and its scene.

    t, tension: the measured series [s], [N].  peak: mean of the largest tensions of each cycle [N].  mean_cycle:
    period [s] of a mean cycle, whose phase was not measured: the computed one is turned to the largest correlation.
    """

    name: str
    scene: dict[str, Any]
    t: Array
    tension: Array
    peak: float
    remark: str
    mean_cycle: float | None = None


# -- tests ---------------------------------------------------------------------------------------------------------


def chain(period: float, column: int, peak: float) -> Test:
    """Lindahl 1984: 33 m of chain on the bed of a tank, its upper end on a circle of 0.2 m."""
    data = np.genfromtxt(DATA / "measured" / "lindahl_mean_cycle.csv", delimiter=",", comments="#", skip_header=5)
    steel = 0.0818 / 7800
    scene = {
        "sea": {"depth": 3.0, "density": 1000.0},
        "seabed": {"friction": 0.3},
        "cable": {
            "length": 33.0, "line_density": 0.0818, "diameter": 0.0022, "area": steel, "axial_stiffness": 1e4,
            "normal_drag": 2.5, "tangential_drag": 0.5, "added_mass": 1.0, "damping": 2.0, "slack": "tension-only",
            "elements": 66, "anchor": [0.0, 0.0, -3.0],
            "top": {
                "kind": "prescribed", "position": [32.554, 0.0, 0.3], "amplitude": [0.2, 0.0, 0.2],
                "phase_deg": [90.0, 0.0, 0.0], "period": period, "ramp": 2 * period,
            },
        },
        "time": {"end": 10 * period, "step": period / 500, "scheme": "bdf2"},
    }  # fmt: skip
    remark = "added mass 1 and the area of steel are ours, the damping of 2 N s that of other models"
    t = (6 + data[:, 0]) * period
    return Test(f"Lindahl's chain, {period} s", scene, t, data[:, column], peak, remark, period)


def jumper(case: int, shift: float, **sections: Any) -> Test:
    """Lowe and Langley 2006: a hanging jumper without sea bed."""
    t, tension = np.loadtxt(DATA / f"case{case}.csv", delimiter=",").T
    scene = {
        "gravity": 9.807,
        "sea": {"depth": 1000.0, "density": 1000.0},
        "cable": {
            "length": 170.0, "line_density": 165.0, "diameter": 0.396, "axial_stiffness": 5e8, "elements": 40,
            "added_mass": 1.0, "normal_drag": 1.0, "anchor": [-100.0, 0.0, -55.0],
            "top": {"kind": "fixed", "position": [0.0, 0.0, -5.0]} | sections.pop("top", {}),
        },
        **sections,
    }  # fmt: skip
    t, name = t + shift, "Lowe and Langley's jumper, " + ("its top moves" if case == 1 else "in waves")
    kept = (t >= 10.0) & (t <= sections["time"]["end"])  # the transient of a start at rest is over
    tension = 1e3 * tension[kept]
    return Test(name, scene, t[kept], tension, tension.max(), "its bending stiffness is neglected")


def all_tests() -> list[Test]:
    """Every measured line."""
    moves = {"kind": "prescribed", "amplitude": [10.0, 0.0, 0.0], "period": 27.0}
    waves = {"amplitude": 5.0, "period": 10.0, "phase_deg": 230.0, "stretching": "none"}
    still = {"end": 80.0, "step": 0.05, "scheme": "bdf2"}
    return [
        chain(1.252, 1, 72.42),
        chain(3.505, 3, 51.45),
        jumper(1, 0.0, top=moves, time=still),
        jumper(4, 10.0, waves=waves, time={"end": 40.0, "step": 0.025, "scheme": "bdf2"}),
    ]


# -- programs ------------------------------------------------------------------------------------------------------


def by_dolfbuoy(test: Test) -> tuple[Array, Array]:
    """Times [s] and top tension [N]."""
    record = simulate(test.scene)
    return record.time.values, record.tension_top.isel(cable=0).values


def exported(test: Test, step: float | None = None) -> Export:
    """Input of MoorDyn."""
    scene = load_scene(test.scene)
    return export(scene, beginning(scene), Numerics(step=step))


def by_moordyn(test: Test) -> tuple[Array, Array]:
    """As `by_dolfbuoy`, by MoorDyn with a segment for each element; its step is halved until it does not diverge."""
    step = None
    while True:
        written = exported(test, step)
        found = run_moordyn(written, test.scene["time"]["end"])
        if found is not None:
            return found.t, found.tension[:, 0, 1]
        step = written.step / 2


def beside(test: Test, t: Array, tension: Array) -> tuple[Array, float]:
    """A computed top tension [N] at the measured instants, or its mean cycle turned to them; and its largest value, a
    mean over cycles."""
    if test.mean_cycle is None:
        late = (t >= test.t[0]) & (t <= test.t[-1])
        return np.interp(test.t, t, tension), tension[late].max()
    late = t >= test.t[0] - 0.5 * (test.t[1] - test.t[0])
    cycle, phase = np.divmod(t[late] / test.mean_cycle, 1.0)
    bins = np.minimum((phase * len(test.t)).astype(int), len(test.t) - 1)
    mean = np.array([tension[late][bins == k].mean() for k in range(len(test.t))])
    turned = max((np.roll(mean, k) for k in range(len(mean))), key=lambda m: np.corrcoef(m, test.tension)[0, 1])
    whole = [k for k in np.unique(cycle) if (k + 1) * test.mean_cycle <= t[-1] + 1e-9]
    return turned, float(np.mean([tension[late][cycle == k].max() for k in whole]))


PROGRAMS = {"dolfbuoy": by_dolfbuoy, "MoorDyn": by_moordyn}
COLUMNS = {
    "test": "test",
    "program": "program",
    "rms": "rms difference [N]",
    "of_range": "of the range [%]",
    "correlation": "correlation",
    "peak": "largest [N]",
    "measured": "measured [N]",
    "peak_percent": "difference [%]",
}


def study(folder: Path, moordyn: bool) -> list[Table]:
    """A row for each test and program, and a figure of the series."""
    tests, rows, curves = all_tests(), [], []
    for test in tests:
        for program in PROGRAMS if moordyn else ["dolfbuoy"]:
            values, peak = beside(test, *PROGRAMS[program](test))
            rms = float(np.sqrt(np.mean((values - test.tension) ** 2)))
            row = {"test": test.name, "program": program, "rms": rms, "of_range": 100 * rms / np.ptp(test.tension)}
            row |= {"correlation": float(np.corrcoef(values, test.tension)[0, 1]), "peak": peak, "measured": test.peak}
            rows.append(row | {"peak_percent": 100 * (peak / test.peak - 1)})
            curves.append((test, program, values))
    notes = [f"{test.name}: {test.remark}." for test in tests]
    if moordyn:
        notes += [f"MoorDyn, {test.name}: {note}." for test in tests for note in exported(test).notes]
    return [
        Table("measured", rows, "Measured top tensions", COLUMNS, notes, draw(tests, curves)),
        Table("measured-decay", decays(), "Measured heave decay of a sphere", DECAY, DECAY_NOTES),
    ]


# -- the sphere ----------------------------------------------------------------------------------------------------

RADIUS, MASS = 0.15, 7.056
DECAY = {
    "height": "released from [mm]",
    "hull": "hull",
    "period": "first period [s]",
    "period_percent": "difference [%]",
    "rate": "decay rate [1/s]",
    "rate_percent": "difference [%]",
    "trough": "first trough [mm]",
    "trough_percent": "difference [%]",
}
DECAY_NOTES = [
    "Differences are from Kramer et al. 2021. With memory: radiation by Capytaine's coefficients (tests/reference/"
    "sphere_of_kramer.nc), buoyancy of the hull as it is wetted. Without: added mass of half of the displaced mass and "
    'wave_damping = "radiation", the estimate of one constant.',
    "From 150 mm the sphere begins above the water; its waves are those of its place at rest. The code of the same "
    "theory in the paper (LPF2) decays as fast, to 1 %.",
]


def hull_of_sphere(radius: float) -> list[list[float]]:
    """Chords of 3 degrees, which have the volume to 0.1 %."""
    angle = np.linspace(0.0, np.pi, 61)
    hull = np.column_stack([radius * (1 - np.cos(angle)), 2 * radius * np.sin(angle)])
    hull[[0, -1], 1] = 0.0
    return hull.tolist()


def sphere(**coefficients: Any) -> dict[str, Any]:
    """The measured sphere, with the hydrodynamic keys of its hull."""
    return {
        "gravity": 9.82,
        "sea": {"depth": 0.9, "density": 998.2},
        "buoy": {
            "hull": hull_of_sphere(RADIUS), "mass": MASS, "center_of_mass": 0.1152, "inertia": [0.0982, 0.0731],
            **coefficients,
        },
        "time": {"end": 4.0, "step": 0.002, "scheme": "generalized-alpha"},
    }  # fmt: skip


HULLS = {
    "with memory": {"potential_flow": str(DATA / "sphere_of_kramer.nc")},
    "without": {"axial_added_mass": 0.5, "wave_damping": "radiation"},
}


def released(scene: Any, height: float) -> tuple[Array, Array]:
    """(t [s], z over its own rest [m]) of an upright buoy let go at a height [m] above that rest.

    The chords float 0.07 mm deeper than the measured sphere: about its rest their decay from 30 mm would seem 0.5 %
    faster.
    """
    loaded = load_scene(scene)
    mass = mass_properties(loaded.buoys[0])
    rest = mass.height - float_upright(shape_of(loaded.buoys[0]), mass, loaded.sea.density, loaded.gravity).draft
    record = simulate(loaded, initial={"buoy_position": [0.0, 0.0, rest + height]})
    assert np.abs(record.buoy_position.values[:, 0, :2]).max() < 1e-9
    return record.time.values, record.buoy_position.values[:, 0, 2] - rest


def decay(scene: dict[str, Any], height: float) -> tuple[float, float, float]:
    """(first damped period [s], decay rate [1/s], first trough [m]) of the sphere after its release from a height [m]
    above its rest, as the measurements were reduced."""
    t, z = released(scene, height)
    zeros = [a - za * (b - a) / (zb - za) for a, b, za, zb in zip(t, t[1:], z, z[1:], strict=False) if za * zb < 0]
    inner = (np.flatnonzero((z[1:-1] - z[:-2]) * (z[2:] - z[1:-1]) < 0) + 1)[:6]
    slope = np.polyfit(t[inner], np.log(np.abs(z[inner])), 1)[0]
    return 2 * (zeros[1] - zeros[0]), -slope, abs(z[inner[0]])


def measured_decays() -> dict[int, dict[str, float]]:
    """Rows of the measurements by the height [mm]."""
    lines = (DATA / "kramer2021_sphere.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {int(row["H0_mm"]): {name: float(value) for name, value in row.items()} for row in rows}


def decays() -> list[dict[str, Any]]:
    """A row for each height and hull."""
    rows = []
    for height, row in measured_decays().items():
        for hull, coefficients in HULLS.items():
            period, rate, trough = decay(sphere(**coefficients), height / 1000)
            found = {"period": period, "rate": rate, "trough": 1000 * trough}
            exact = {"period": row["T1_s"], "rate": row["decay_per_s"], "trough": row["trough_mm"]}
            apart = {f"{name}_percent": 100 * (found[name] / exact[name] - 1) for name in exact}
            rows.append({"height": height, "hull": hull} | found | apart)
    return rows


def draw(tests: list[Test], curves: list[tuple[Test, str, Array]]) -> Figure:
    """The measured series of every test as points, and the computed ones as lines."""
    figure = new_figure(10.0, 2.4 * len(tests))
    for ax, test in zip(figure.subplots(len(tests), 1, squeeze=False)[:, 0], tests, strict=True):
        ax.plot(test.t, test.tension / 1e3, "k.", markersize=3, label="measured")
        for _, program, values in (curve for curve in curves if curve[0] is test):
            ax.plot(test.t, values / 1e3, label=program)
        ax.set_title(test.name)
        ax.set_ylabel("top tension [kN]")
        ax.set_xlabel("t [s]")
    figure.axes[0].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def main(
    moordyn: Annotated[bool, typer.Option(help="Beside it what MoorDyn computes.")] = True, out: Path | None = None
) -> None:
    """Measured lines beside what is computed for them."""
    make("measured", study, out, moordyn=moordyn)


if __name__ == "__main__":
    start(main)
