"""Measured lines and buoys beside what dolfbuoy and MoorDyn compute for them.

    .venv/bin/python -m tests.verification.measured [--no-moordyn]

Each test is a scene with the numbers that its authors give, nothing fitted; where they leave one open, the row's
remark says what was taken.  Origins and licences of the measured series: tests/reference/README.md.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from dolfbuoy.api import simulate
from dolfbuoy.formats.moordyn_run import run as run_moordyn
from dolfbuoy.formats.to_moordyn import Export, Numerics, export
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
    return [Table("measured", rows, "Measured top tensions", COLUMNS, notes, draw(tests, curves))]


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
