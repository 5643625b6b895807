"""A moored buoy in waves with dolfbuoy and with MoorDyn's 6-DOF body: seconds for the same accuracy, on one core.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/moored_buoy.py [--quick] [--out DIR]

The hull is a slender cylinder, which is what both programs know, on the cable of `short` or of `long`, in a regular
wave and a uniform current that keeps the cable taut.  In MoorDyn it is a free body (mass, centre, inertia) with a rod
(Morison's forces, buoyancy, end discs).  Wave, drag, end discs and equilibrium are the same in both; what is not:

- MoorDyn integrates the pressure of the wave over the rod, dolfbuoy cuts each strip by the local water plane and adds
  the force of the undisturbed acceleration along the axis (Eq. (10)): equal for a slender hull;
- added mass of strips acts across the axis in MoorDyn and in all directions in Eq. (10): it is left out in both;
- dolfbuoy's wave grows over two periods, MoorDyn's starts at full height;
- dolfbuoy damps rotation about the axis; MoorDyn's cylinder has no yaw moment at all;
- MoorDyn starts from an upright body and the catenary without current, dolfbuoy from equilibrium.

Each program is therefore measured against its own converged solution in the last period; how far these are apart is
said.  MoorDyn's wave is a table on a grid (WaveKin 2): its sum of components (WaveKin 7) knows no pressure and leaves a
floating body where it is.
"""

import argparse
import sys
from pathlib import Path

import machine
import moordyn_runs
from cable_runs import END, advised, coarsened, error_of, extrapolated, kept_of, settings_of, settings_text, spread
from comparison import table, write_markdown
from moordyn_input import Numerics
from store import kept

from dolfbuoy.api import solve_static
from dolfbuoy.errors import SolveError
from dolfbuoy.parallel.cases import fingerprint
from dolfbuoy.results import compare
from dolfbuoy.results import measured as acc
from dolfbuoy.scene import Scene, load_scene, settings
from dolfbuoy.studies.accuracy.advise import advise
from dolfbuoy.studies.study import Table, save

ACCURACIES = (0.01, 0.001)
AIM = 10.0
#: Segments of the cable: coarsest, then up by halves of a doubling; the reference has twice the last.
LADDER = {"short": (5, 7, 10, 14, 20, 28, 40), "long": (12, 18, 25, 35, 50, 70, 100)}
#: Integrators that are tried; Euler is unstable with the body of `short` and rings on `long`.
SCHEMES = ("RK2", "Midpoint3")
#: Steps of MoorDyn in a call from Python: it updates the waves once per call, and their jumps make the cable ring.
PER_CALL = 10
#: End of the runs that errors are measured on; the last period counts [s].  The long mooring drifts for minutes.
UNTIL = {"short": 60.0, "long": END}

#: Slender spars, so that the moment of the water plane, which the two models treat differently, is small.
BUOYS = {
    "short": {
        "hull": [[0.0, 0.8], [6.0, 0.8]],
        "mass": 1500.0,
        "center_of_mass": 1.6,
        "inertia": [3200.0, 120.0],
    },
    "long": {
        "hull": [[0.0, 1.4], [9.0, 1.4]],
        "mass": 4200.0,
        "center_of_mass": 2.0,
        "inertia": [13000.0, 1000.0],
    },
}
COMMON = {
    "added_mass": 0.0,
    "normal_drag": 0.8,
    "axial_added_mass": 0.64,
    "axial_drag": 1.1,
    "rotational_damping": 2000.0,
}
WAVES = {"amplitude": 1.0, "direction_deg": 0.0}
#: Speed [m/s], across and against the waves, so that the cable stays taut.
CURRENT = {"short": 1.2, "long": 0.8}
CURRENT_DIRECTION = 150.0


def scene_of(cable: str, end: float) -> Scene:
    """The scene of a cable's buoy; `initial.buoy_position` is where MoorDyn's body starts, upright."""
    base = load_scene(cable).to_dict()
    depth, period = base["sea"]["depth"], base["waves"]["period"]
    data = {key: base[key] for key in ("sea", "cable", "time")}
    data |= {"title": f"Moored cylinder, {cable} cable", "buoy": BUOYS[cable] | COMMON}
    data |= {"waves": WAVES | {"period": period, "ramp": 2 * period}}
    profile = [[-depth, CURRENT[cable]], [0.0, CURRENT[cable]]]
    data |= {"current": {"profile": profile, "direction_deg": CURRENT_DIRECTION}}
    data["time"] = base["time"] | {"end": end}
    return load_scene(data)


# -- runs: dict -> dict ------------------------------------------------------------------------------------------------


def evaluate(case: dict) -> dict:
    """One run; `what` says which."""
    kinds = {"dolfbuoy": _dolfbuoy, "advise": _advise, "moordyn": _moordyn, "time": _time, "start": _start}
    return kinds[case["what"]](case)


def _start(case):
    """Equilibrium of the buoy."""
    record = solve_static(scene_of(case["cable"], case["end"]))
    return {"position": record.buoy_position.values.tolist()}


def _dolfbuoy(case):
    scene = settings.with_settings(
        scene_of(case["cable"], case["end"]), settings.Space(*case["space"]), settings.Stepping(*case["stepping"])
    )
    try:
        return kept_of(acc.compute(scene, ["tension_top"]), scene)
    except SolveError:
        return {"curve": None}


def _advise(case):
    scene = scene_of(case["cable"], case["end"])
    return settings_of(advise(scene, "tension_top", case["accuracy"], say=lambda text: None).scene)


def _moordyn(case):
    scene = _placed(case)
    limit = moordyn_runs.largest_stable(scene, case["segments"], case["scheme"])
    numerics = Numerics(case["segments"], case["scheme"], moordyn_runs.MARGIN * limit)
    for _ in range(4):
        found = moordyn_runs.run(scene, numerics, case["end"], PER_CALL) if limit else None
        if found is not None:
            return {"step": numerics.step, "cpu_per_second": found.cpu / case["end"]} | kept_of(found, scene)
        numerics = Numerics(case["segments"], case["scheme"], 0.9 * numerics.step)
    return {"step": None, "curve": None}


def _time(case):
    factor = END / case["end"]
    if "numerics" in case:
        scene, numerics = _placed(case), Numerics(**case["numerics"])
        runs = [moordyn_runs.run(scene, numerics, case["end"], PER_CALL) for _ in range(case["repeats"])]
    else:
        scene = scene_of(case["cable"], case["end"])
        scene = settings.with_settings(scene, settings.Space(*case["space"]), settings.Stepping(*case["stepping"]))
        runs = [acc.compute(scene, ["tension_top"]) for _ in range(case["repeats"])]
    return {key: [factor * getattr(found, key) for found in runs if found] for key in ("cpu", "wall")}


def _placed(case):
    return load_scene(scene_of(case["cable"], case["end"]), initial__buoy_position=case["start"])


# -- comparison --------------------------------------------------------------------------------------------------------


class Comparison:
    """One buoy with both programs; everything is computed once and kept in options.out."""

    def __init__(self, cable, options):
        self.cable, self.options = cable, options
        self.until = UNTIL[cable]
        self.period = scene_of(cable, END).waves.period
        self.start = self.ask("start")["position"]

    def ask(self, what, end=None, **case):
        """Result of one run, kept on disk; those of dolfbuoy only as long as its sources do not change."""
        own = what in ("dolfbuoy", "advise") or (what == "time" and "numerics" not in case)
        version = {"sources": fingerprint()} if own else {}
        case = {"what": what, "cable": self.cable, "end": end or self.until, **case}
        return kept(evaluate, case | version, self.options.out, lambda c: print(c, file=sys.stderr, flush=True))

    def lumped(self, segments, scheme):
        return self.ask("moordyn", segments=segments, scheme=scheme, start=self.start)

    def moordyn_rows(self):
        """A dict per accuracy."""
        ladder = LADDER[self.cable][: 3 if self.options.quick else None]
        schemes = {s: self.lumped(ladder[0], s) for s in SCHEMES}
        stable = {s: run for s, run in schemes.items() if run["step"]}
        scheme = min(stable, key=lambda s: stable[s]["cpu_per_second"])
        fine = [self.lumped(round(ladder[-1] * f), scheme) for f in (0.5, 1, 2)]
        self.moordyn_reference = extrapolated(*fine, highest=2.0)
        rows = []
        for accuracy in ACCURACIES:
            runs = {n: self.lumped(n, scheme) for n in (*ladder, 2 * ladder[-1])}
            good = [n for n, run in runs.items() if error_of(run, self.moordyn_reference) <= accuracy]
            if not good:
                rows.append({"settings": "-", "note": f"needs more than {2 * ladder[-1]} segments"})
                continue
            n = min(good)
            numerics = {"segments": n, "scheme": scheme, "step": runs[n]["step"]}
            seconds = runs[n]["cpu_per_second"] * END
            end = END * min(1.0, self.options.repeat_seconds / seconds)
            time = self.ask("time", end=end, numerics=numerics, repeats=self.options.repeats, start=self.start)
            row = {"settings": f"{scheme}, {n} segments, dt {numerics['step']:.2g} s", **spread(time)}
            note = f"timed on {end:.3g} s" if end < END else ""
            rows.append(row | {"error": error_of(runs[n], self.moordyn_reference), "note": note})
        return rows

    def dolfbuoy_rows(self):
        """A dict per accuracy."""
        cells = {"short": 6, "long": 16}[self.cable]
        fine = [
            self.ask("dolfbuoy", space=[3, 2, cells * 2**k], stepping=["generalized-alpha", self.period / (120 * 2**k)])
            for k in range(2 if self.options.quick else 3)
        ]
        self.reference = extrapolated(*([fine[0]] if len(fine) == 2 else []), *fine)
        return [self._dolfbuoy_row(accuracy) for accuracy in ACCURACIES]

    def _dolfbuoy_row(self, accuracy):
        """The cheapest of what is advised for this and for the sharper accuracies, made coarser."""
        choices = [self._advised(sharper, accuracy) for sharper in ACCURACIES if sharper <= accuracy]
        advice, settings, error = min(choices, key=self._seconds)
        note = f"advised: {settings_text(advice)}" if settings != advice else ""
        if error > accuracy:
            note = "misses the accuracy"
        time = self.ask("time", end=END, repeats=self.options.repeats, **settings)
        return {"settings": settings_text(settings), "error": error, **spread(time), "note": note}

    def _advised(self, sharper, accuracy):
        """(advice for one accuracy, made coarser as far as another one allows, error)."""
        settings, error = advised(self.ask, sharper, self._error_of_settings)
        if error > sharper:
            return settings, settings, error
        return settings, *coarsened(settings, error, accuracy, self._error_of_settings)

    def _seconds(self, choice):
        return self.ask("dolfbuoy", **choice[1]).get("cpu", float("inf"))

    def _error_of_settings(self, settings):
        return error_of(self.ask("dolfbuoy", **settings), self.reference)

    def rows(self):
        """A row per accuracy, and a note about the two limits."""
        theirs, ours = self.moordyn_rows(), self.dolfbuoy_rows()
        rows = []
        for accuracy, m, d in zip(ACCURACIES, theirs, ours, strict=True):
            row = {"case": f"buoy, {self.cable} cable", "accuracy": accuracy, "aim": AIM}
            row |= {f"moordyn_{k}": v for k, v in m.items()} | {f"dolfbuoy_{k}": v for k, v in d.items()}
            rows.append(row | {"ratio": m["cpu"] / d["cpu"] if "cpu" in m else None})
        return rows, (
            f"buoy, {self.cable} cable: converged top tension {_limit(self.reference)} in dolfbuoy and "
            f"{_limit(self.moordyn_reference)} in MoorDyn; each error is against the program's own limit."
        )


def _limit(reference):
    """'5.55 ... 9.59 kN (known to 0.1 %)'."""
    known = compare.percent(reference["own"])
    return f"{reference['min'] / 1e3:.2f} ... {reference['max'] / 1e3:.2f} kN (known to {known})"


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/moored-buoy"))
    parser.add_argument("--quick", action="store_true", help="short cable, few segments, one repeat")
    parser.add_argument("--repeats", type=int, help="timed runs [5, quick 1]")
    parser.add_argument("--repeat-seconds", type=float, default=15.0, help="of a repeat of MoorDyn")
    options = parser.parse_args()
    options.repeats = options.repeats or (1 if options.quick else 5)
    rows, notes = [], [machine.sentence()]
    for cable in ("short",) if options.quick else ("short", "long"):
        found, note = Comparison(cable, options).rows()
        rows += found
        notes.append(note)
    table(rows, notes)
    save(options.out, Table("moored-buoy", rows, notes=notes))
    write_markdown(options.out / "moored-buoy.md", rows, notes)


if __name__ == "__main__":
    main()
