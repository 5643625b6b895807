"""Settings with which MoorDyn is cheapest for an accuracy, for every mooring that times.py compares.

    .venv/bin/pip install -e '.[benchmark]'
    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/moordyn_settings.py [--only NAME] [--kept DIR]

The integrator with the least product of seconds and error (where it misses the accuracy, the next), 0.95 of its largest
stable step, found by bisection, and the smallest number of segments that meets the accuracy.  Errors are against
dolfbuoy's limit where the two programs have the same, else against MoorDyn's own.  Writes moordyn.toml, which times.py
reads, and results/moordyn.md, the evidence.  An interrupted search goes on where it was.
"""

import argparse
import math
import sys
from functools import cached_property
from pathlib import Path

import machine
from dolfbuoy_settings import ACCURACIES, own_limit
from errors import BOTH, RMS, apart, error_of, extrapolated, parts_of
from moordyn_runs import Settings, best_run
from moorings import END, MAKERS, mooring
from store import kept

from dolfbuoy.results.compare import percent

HERE = Path(__file__).parent
#: Integrators that are tried on a driven cable; "implicit" ones are fixed-point iterations.  Local time steps (LEuler)
#: are the same as Euler there.
INTEGRATORS = ("Euler", "Heun", "RK2", "RK4", "Midpoint3", "Midpoint5", "BEuler5", "ACA5", "Wilson5")
#: On other moorings, and in which MoorDyn's own limit is computed.
FEW, SURE = ("Euler", "RK2", "Midpoint3"), "RK2"


class Search:
    """One mooring; every run is computed once and kept in a folder."""

    def __init__(self, name, options, softer=None):
        self.mooring, self.options, self.softer = mooring(name), options, softer

    def run(self, segments, scheme) -> dict:
        """`best_run`, with its seconds scaled to END."""
        budget = self.options.budget if self.softer else None
        case = {"mooring": self.mooring.name, "segments": segments, "scheme": scheme, "budget": budget}
        found = kept(lambda _: best_run(self.mooring, segments, scheme, budget), case, self.options.kept, say)
        return found | {"seconds": found["rate"] * END} if found["step"] else found

    @cached_property
    def limit(self) -> dict:
        """What errors refer to."""
        finest = self.mooring.segments[1]
        if finest is None:
            return own_limit(self.mooring)
        return extrapolated(*(self.run(finest // 2**k, SURE) for k in (2, 1, 0)), highest=2.0)

    @cached_property
    def integrators(self) -> list[dict]:
        """Of each that is tried: its run, and its error."""
        if self.softer is not None:
            return []
        first, finest = self.mooring.segments
        runs = {scheme: self.run(first, scheme) for scheme in (INTEGRATORS if finest is None else FEW)}
        return [
            {"integrator": scheme, "segments": first, **run, "error": error_of(run, self.limit)}
            for scheme, run in runs.items()
        ]

    @cached_property
    def schemes(self) -> list[str]:
        """By the product of seconds and error: the first grow with the square of the number of segments, the second
        shrinks with it; those of the softer mooring, if there is one."""
        if self.softer is not None:
            return self.softer.schemes
        good = [row for row in self.integrators if math.isfinite(row["error"])]
        return [row["integrator"] for row in sorted(good, key=lambda row: row["seconds"] * row["error"])]

    @staticmethod
    def _too_dear(run):
        """Whether a run was stable, but was not made to its end."""
        return run["step"] is not None and run["curve"] is None

    def parts(self, segments, scheme) -> tuple[dict[str, float], str]:
        """(errors, how they are known): measured, or where a run is too dear those of the softer mooring."""
        run = self.run(segments, scheme)
        if not self._too_dear(run):
            return parts_of(run, self.limit), ""
        return self.softer.parts(segments, scheme)[0], f"error that of {self.softer.mooring.name}"

    def cheapest(self, accuracy, measures=BOTH) -> tuple[str, int] | None:
        """The first integrator that meets an accuracy, and its smallest number of segments; None if none does."""
        found = ((scheme, self.fewest(accuracy, scheme, measures)) for scheme in self.schemes)
        return next((pair for pair in found if pair[1] is not None), None)

    def fewest(self, accuracy, scheme, measures=BOTH) -> int | None:
        """Smallest number of segments that meets an accuracy, to some 5 %; None if none was found."""
        first, finest = self.mooring.segments
        low, high, n = 1, None, first // 2
        if self.softer is not None:
            n = self.softer.fewest(accuracy, scheme, measures) or n
            if self._too_dear(self.run(n, scheme)):
                return n
        for _ in range(14):
            parts, _ = self.parts(n, scheme)
            error = max(parts[name] for name in measures)
            low, high = (low, n) if error <= accuracy else (max(low, n), high)
            if high is not None and high - low <= max(1, 0.05 * high):
                return high
            # errors behave like 1/n to 1/n^2: so far at once, and by halves once it is enclosed
            guess = round(n * min(max((error / accuracy) ** 0.8, 0.4), 2.0)) if error < math.inf else 2 * n
            n = max(guess, low + 1) if high is None else guess if low < guess < high else (low + high) // 2
            if high is None and finest is not None and n > finest // 2:
                if low >= finest // 2:
                    return None  # against its own limit, which is not known well enough
                n = finest // 2
        return high

    def found(self) -> list[dict]:
        """A row per accuracy."""
        rows = []
        for accuracy in ACCURACIES:
            row, found = {"case": self.mooring.name, "accuracy": accuracy}, self.cheapest(accuracy)
            if found is not None:
                scheme, n = found
                parts, note = self.parts(n, scheme)
                run, of_rms = self.run(n, scheme), self.cheapest(accuracy, RMS)
                row |= {"settings": Settings(scheme, n, run["step"]), "error": max(parts.values()), "note": note}
                row |= parts | {"seconds": run["seconds"], "of_rms": None}
                if of_rms not in (None, found):
                    row["of_rms"] = Settings(*of_rms, self.run(of_rms[1], of_rms[0])["step"])
            rows.append(row)
        return rows

    def remark(self) -> str:
        """How well the limit is known, and the other program's."""
        said = f"{self.mooring.name}: the limit is known to {percent(self.limit['own'])} of the range"
        if self.mooring.segments[1] is not None:
            away = apart(self.limit, own_limit(self.mooring))
            return f"{said}; it is MoorDyn's own, {percent(away)} from dolfbuoy's."
        runs = [self.run(self.mooring.segments[0] * 2**k, SURE) for k in range(3)]
        if any(run.get("curve") is None for run in runs):
            return f"{said}; it is dolfbuoy's, MoorDyn's own was too dear to compute."
        return (
            f"{said}; it is dolfbuoy's, {percent(apart(extrapolated(*runs, highest=2.0), self.limit))} from MoorDyn's."
        )


def say(case):
    """One line of progress."""
    print(*case.values(), file=sys.stderr, flush=True)


def toml_of(rows) -> str:
    """moordyn.toml."""
    text = "# Made by moordyn_settings.py: MoorDyn's integrator, segments, step [s], and its error with them.\n"
    for row in rows:
        text += f'\n[[found]]\ncase = "{row["case"]}"\naccuracy = {row["accuracy"]}\n'
        if "settings" in row:
            s = row["settings"]
            text += f'scheme = "{s.scheme}"\nsegments = {s.segments}\nstep = {s.step:.3g}\nerror = {row["error"]:.3g}\n'
            text += "".join(f"{part} = {row[part]:.3g}\n" for part in BOTH)
            text += f'of_rms = "{row["of_rms"]}"\n' if row["of_rms"] else ""
    return text


def markdown_of(searches, rows, notes) -> str:
    """results/moordyn.md."""
    text = "# MoorDyn's settings\n\nMade by `tests/benchmarks/moordyn_settings.py`: what is cheapest for an accuracy "
    text += "of the top tensions, rms and extremes.\n\n"
    text += "| case | accuracy | settings | rms | extremes | seconds for 120 s | | for the rms alone |\n"
    text += "|---|---|---|---|---|---|---|---|\n"
    for row in rows:
        cells = [row["case"], percent(row["accuracy"])]
        if "settings" in row:
            cells += [str(row["settings"]), *(percent(row[part]) for part in BOTH), f"{row['seconds']:.3g}"]
            cells += [row["note"], str(row["of_rms"] or "the same")]
        else:
            cells += ["misses it", "", "", "", "", ""]
        text += f"| {' | '.join(cells)} |\n"
    text += "\nIntegrators, at as many segments and 0.95 of the largest stable step; that with the least product of "
    text += "seconds and error is taken first, others where it misses an accuracy:\n\n"
    text += "| case | segments | integrator | step [s] | seconds for 120 s | error | |\n"
    text += "|---|---|---|---|---|---|---|\n"
    for search in searches:
        for row in search.integrators:
            cells = [search.mooring.name, str(row["segments"]), row["integrator"]]
            if row["step"]:
                cells += [f"{row['step']:.3g}", f"{row['seconds']:.3g}", percent(row["error"])]
            else:
                cells += ["none is stable", "", ""]
            text += f"| {' | '.join(cells)} | {'first' if row['integrator'] == search.schemes[0] else ''} |\n"
    return text + "\n" + "".join(f"- {note}\n" for note in notes)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kept", type=Path, default=Path("results/benchmarks/moordyn"), help="folder of the runs")
    parser.add_argument("--only", default="", help="moorings whose name has this in it; writes nothing")
    parser.add_argument("--budget", type=float, default=8.0, help="CPU seconds of a run, where a softer cable is known")
    options = parser.parse_args()
    searches, rows = {}, []
    for name in MAKERS:
        if options.only in name:
            searches[name] = Search(name, options, searches.get(mooring(name).softer))
            rows += searches[name].found()
    notes = [
        *(search.remark() for search in searches.values()),
        f"{machine.version().capitalize()}; {machine.sentence()}",
    ]
    text = markdown_of(searches.values(), rows, notes)
    print(text)
    if not options.only:
        (HERE / "moordyn.toml").write_text(toml_of(rows))
        (HERE / "results" / "moordyn.md").write_text(text)


if __name__ == "__main__":
    main()
