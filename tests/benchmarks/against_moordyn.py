"""A driven cable in still water with dolfbuoy and with MoorDyn: seconds for the same accuracy, on one core.

    .venv/bin/pip install -e '.[benchmark]'
    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/against_moordyn.py [--quick] [--out DIR]

An interrupted benchmark goes on where it was.  MoorDyn runs at 0.95 of its largest stable step, found by bisection in
each case, with the integrator that is cheapest there, and with the smallest number of segments that meets the accuracy;
dolfbuoy at the settings that `dolfbuoy advise` gives, made coarser where they are better than asked for.  Both errors
are against one converged reference, dolfbuoy extrapolated; how far MoorDyn extrapolated is from it is said.  Seconds
are CPU seconds of the stepping loop.
"""

import argparse
import math
import sys
from pathlib import Path

import cable_runs as runs
import machine
from comparison import draw, table, write_markdown
from store import kept

from dolfbuoy.parallel.cases import fingerprint
from dolfbuoy.results.tables import show
from dolfbuoy.scene import settings
from dolfbuoy.studies.study import Table, save

ACCURACIES = (0.01, 0.001)
#: Times that dolfbuoy is meant to be faster, by factor of EA.
AIMS = {1.0: 5.0, 100.0: None, 10000.0: 100.0}
#: Integrators that are tried at EA x 1; the one that is cheapest for its error is used.
#: Local time steps (LEuler) are the same as Euler on one line.
INTEGRATORS = ("Euler", "Heun", "RK2", "RK4", "Midpoint3", "Midpoint5", "BEuler5", "ACA5", "Wilson5")
#: Segments at which integrators are compared, and from which the search for their number starts.
SEGMENTS = {"short": 20, "long": 50}
#: dolfbuoy's reference: P3-P2 with this many elements and steps per period, and twice refined in both.
REFERENCE = {"short": (6, 240), "long": (16, 240)}


class Comparison:
    """One cable at one stiffness; everything is computed once and kept in `folder`."""

    def __init__(self, cable, stiffness, options, softer=None):
        self.cable, self.stiffness, self.options, self.softer = cable, stiffness, options, softer
        scene = runs.scene_of(cable, stiffness)
        self.period, self.until = settings.period_of(scene), runs.compared_until(scene)
        self.points = []  # what the figure shows

    def ask(self, what, end=None, **case):
        """Result of one run, kept on disk; those of dolfbuoy only as long as its sources do not change."""
        own = what in ("dolfbuoy", "advise") or (what == "time" and "numerics" not in case)
        version = {"sources": fingerprint()} if own else {}
        case = {"what": what, "cable": self.cable, "stiffness": self.stiffness, "end": end or self.until, **case}
        return kept(runs.evaluate, case | version, self.options.out, announce)

    # -- reference

    def converge(self):
        """The reference; and how far MoorDyn's own limit is from it, relative to the range (None: too dear)."""
        cells, steps = REFERENCE[self.cable]
        levels = range(2 if self.options.quick else 3)
        fine = [self._fine(cells * 2**k, steps * 2**k) for k in levels]
        self.reference = runs.extrapolated(*([fine[0]] if len(fine) == 2 else []), *fine)
        self.difference = self._agreement()

    def _fine(self, cells, steps):
        stepping = ["generalized-alpha", self.period / steps]
        return self.ask("dolfbuoy", space=[3, 2, cells], stepping=stepping)

    def _agreement(self):
        found = [self.lumped(SEGMENTS[self.cable] * 2**k) for k in range(3)]
        if any(run.get("curve") is None for run in found):
            return None
        limit = runs.extrapolated(*found, highest=2.0)
        size = self.reference["max"] - self.reference["min"]
        return max(abs(limit[key] - self.reference[key]) for key in ("max", "min")) / size

    # -- MoorDyn

    def lumped(self, segments, scheme=None):
        """MoorDyn with this many segments, not run to the end if that takes longer than the budget."""
        scheme = scheme or self.scheme
        return self.ask("moordyn", segments=int(segments), scheme=scheme, budget=self.options.budget)

    def choose_integrator(self):
        """The integrator with the least product of seconds and error: the first grows with the square of the number of
        segments, the second shrinks with it."""
        if self.softer is not None:
            self.scheme, self.integrators = self.softer.scheme, []
            return
        tried = INTEGRATORS if not self.options.quick else INTEGRATORS[:4]
        n, rows = SEGMENTS[self.cable], []
        cells, steps = REFERENCE[self.cable]
        reference = self._fine(cells * 2, steps * 2)
        for scheme in tried:
            run = self.lumped(n, scheme)
            if run["step"] is None:
                rows.append({"cable": self.cable, "integrator": scheme, "remark": "no stable step found"})
                continue
            seconds, error = run["cpu_per_second"] * runs.END, runs.error_of(run, reference)
            row = {"cable": self.cable, "integrator": scheme, "segments": n, "step": run["step"], "seconds": seconds}
            rows.append(row | {"error_percent": 100 * error, "remark": ""})
        good = [row for row in rows if "seconds" in row]
        best = min(good, key=lambda row: row["seconds"] * row["error_percent"])
        best["remark"] = "used"
        self.scheme, self.integrators = best["integrator"], rows

    def error_of_segments(self, n):
        """(error, how it is known): measured, or taken from the softer cable where a run is too dear."""
        run = self.lumped(n)
        if run.get("curve") is not None:
            error = runs.error_of(run, self.reference)
            self.points.append({"program": "MoorDyn", "seconds": run["cpu_per_second"] * runs.END, "error": error})
            return error, ""
        if self.softer is None:
            return math.inf, "too dear"
        return self.softer.error_of_segments(n)[0], f"error from EA x {self.softer.stiffness:g}"

    def fewest_segments(self, accuracy):
        """Smallest number of segments that meets an accuracy, to some 5 %; None if none within the budget does."""
        low, high, n = 1, None, SEGMENTS[self.cable] // 2
        errors = {}
        for _ in range(14):
            errors[n], known = self.error_of_segments(n)
            if errors[n] <= accuracy:
                high = n
            else:
                low = max(low, n)
            if high is not None and (high - low <= max(1, 0.05 * high)):
                break
            if math.isinf(errors[n]):
                return None, known
            n = self._next(n, low, high, errors[n] / accuracy)
        return high, known

    @staticmethod
    def _next(n, low, high, missing):
        """Error behaves like 1/n to 1/n^2: go that far, and bisect once it is enclosed."""
        guess = round(n * min(max(missing**0.8, 0.4), 2.0))
        if high is None:
            return max(guess, low + 1)
        return guess if low < guess < high else (low + high) // 2

    def moordyn_row(self, accuracy):
        """Settings, error and seconds of MoorDyn at an accuracy."""
        n, known = self.fewest_segments(accuracy)
        if n is None:
            return {"settings": "-", "note": known}
        error, known = self.error_of_segments(n)
        run = self.lumped(n)
        numerics = {"segments": n, "scheme": self.scheme, "step": run["step"]}
        whole = run["cpu_per_second"] * runs.END
        end = runs.END
        if whole > 4 * self.options.repeat_seconds:  # cost is proportional to simulated time
            end = runs.END * self.options.repeat_seconds / whole
        time = self.ask("time", end=end, numerics=numerics, repeats=self.options.repeats)
        notes = [known] if known else []
        notes += [f"timed on {end:.3g} s"] if end < runs.END else []
        text = f"{self.scheme}, {n} segments, dt {run['step']:.2g} s"
        return {"settings": text, "error": error, **runs.spread(time), "note": ", ".join(notes)}

    # -- dolfbuoy

    def dolfbuoy_row(self, accuracy):
        """Settings that `advise` gives, stricter where these miss the extremes, coarser where there is room."""
        settings, error = runs.advised(self.ask, accuracy, self.error_of_settings)
        note = "misses the accuracy" if error > accuracy else ""
        if error <= accuracy:
            advised = settings
            settings, error = runs.coarsened(settings, error, accuracy, self.error_of_settings)
            note = f"advised: {runs.settings_text(advised)}" if settings != advised else ""
        time = self.ask("time", end=runs.END, repeats=self.options.repeats, **settings)
        return {"settings": runs.settings_text(settings), "error": error, **runs.spread(time), "note": note}

    def error_of_settings(self, settings):
        """Error of dolfbuoy, inf if it fails; a point of the figure."""
        run = self.ask("dolfbuoy", **settings)
        error = runs.error_of(run, self.reference)
        if math.isfinite(error):
            seconds = run["cpu"] * runs.END / self.until
            self.points.append({"program": "dolfbuoy", "seconds": seconds, "error": error})
        return error

    def rows(self):
        """A row per accuracy; and the points of the figure are complete."""
        self.choose_integrator()
        self.converge()
        rows = []
        for accuracy in ACCURACIES:
            theirs, ours = self.moordyn_row(accuracy), self.dolfbuoy_row(accuracy)
            row = {"cable": self.cable, "stiffness": self.stiffness, "accuracy": accuracy, "aim": AIMS[self.stiffness]}
            row |= {f"moordyn_{key}": value for key, value in theirs.items()}
            row |= {f"dolfbuoy_{key}": value for key, value in ours.items()}
            row["ratio"] = theirs["cpu"] / ours["cpu"] if "cpu" in theirs else None
            rows.append(row | {"reference_own": self.reference["own"], "programs_differ": self.difference})
        return rows


def announce(case):
    """One line of progress."""
    said = [
        f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in case.items() if key != "sources"
    ]
    print(" ".join(said), file=sys.stderr, flush=True)


def compare(options):
    """All cables and stiffnesses; table, JSON, markdown and figure."""
    stiffnesses = (1.0, 100.0) if options.quick else tuple(AIMS)
    rows, integrators, points = [], [], []
    for cable in ("short",) if options.quick else ("short", "long"):
        softer = None
        for stiffness in stiffnesses:
            comparison = Comparison(cable, stiffness, options, softer)
            rows += comparison.rows()
            integrators += comparison.integrators
            case = {"cable": cable, "stiffness": stiffness}
            points += [case | point for point in comparison.points]
            softer = comparison
    notes = [
        machine.sentence(),
        f"Median and half the range of {options.repeats} runs, CPU seconds for {runs.END:g} s.",
    ]
    columns = {"cable": "cable", "integrator": "integrator", "segments": "segments", "step": "0.95 of stable step [s]"}
    columns |= {"seconds": "time [s]", "error_percent": "error [%]", "remark": ""}
    show("MoorDyn's integrators at EA x 1", integrators, columns)
    table(rows, notes)
    save(options.out, Table("moordyn", rows, notes=notes, figure=draw(rows, points)))
    save(options.out, Table("moordyn-integrators", integrators))
    write_markdown(options.out / "moordyn.md", rows, notes)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/moordyn"))
    parser.add_argument("--quick", action="store_true", help="short cable, EA x 1 and 100, one repeat")
    parser.add_argument("--repeats", type=int, help="timed runs [5, quick 1]")
    parser.add_argument("--budget", type=float, help="CPU seconds of a run of MoorDyn for its accuracy [150, quick 15]")
    parser.add_argument("--repeat-seconds", type=float, default=8.0, help="of a repeat, if a run takes four times it")
    options = parser.parse_args()
    options.repeats = options.repeats or (1 if options.quick else 5)
    options.budget = options.budget or (15.0 if options.quick else 150.0)
    compare(options)


if __name__ == "__main__":
    main()
