"""Tables and figures of results/, each made anew by its command.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/renew.py [NAME ...] [--before PYTHON --equal-to PYTHON]

Without a name all of them, one after the other: half an hour on two cores that nothing else uses.  What the commands
write stays in DIR, so that studies that were interrupted go on.  --before, --equal-to: as `before_and_now.py` has them;
it is left out without them.  releases.md is made by docker/verify.sh, moordyn.md by moordyn_settings.py.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time as clock
from dataclasses import dataclass
from pathlib import Path

from machine import sentence, version

HERE = Path(__file__).parent
BIN = Path(sys.executable).parent
#: What mpirun needs in a container.
MPI_AS_ROOT = dict.fromkeys(("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"), "1")


@dataclass(frozen=True)
class Made:
    """How a file of results/ is made.

    title: its heading.  commands: of dolfbuoy, python, mpirun or a script here, {out} being a folder of their own.
    taken: the file of that folder that holds the tables; None: what is printed.  figures: further files of it.
    words: below the head.
    """

    title: str
    commands: tuple[str, ...]
    taken: str | None = "tables.md"
    figures: tuple[str, ...] = ()
    words: str = ""


_FRONTS = tuple(f"work-precision-{scene}.png" for scene in ("short", "long"))
_VARIED = "--vary waves.amplitude=0.5:1.5:0.5 --vary waves.period=4,5,6"
MADE = {
    "step-cost": Made(
        "What a Newton iteration costs",
        tuple(f"python -m tests.verification.step_cost {scene} --out {{out}}" for scene in ("driven", "short", "long")),
        words="The floor is the loops in C and the direct solver, called back to back as often as the run called them, "
        "and measured side by side with the steps.",
    ),
    "before-and-now": Made(
        "Steps and starts beside an earlier version",
        ("before_and_now.py {before} --equal-to {equal_to}",),
        None,
        words="Beside commit af51f78; results of `short` and `long` are compared with b2f6111, since physics has "
        "changed before it. Median of five (smallest to largest).",
    ),
    "accuracy": Made("", ("dolfbuoy study accuracy --out {out}",), "report.md", (*_FRONTS, "schemes.png")),
    "bending": Made(
        "A step with bending beside that of the same line without",
        ("stiff_lines.py --blocks 20",),
        None,
        words="Medians of the blocks' microseconds on the processor and of their ratios; how far the quarters of these "
        "are apart; Newton's iterations and new matrices of a step.",
    ),
    "energy": Made("Energy balance", ("dolfbuoy study energy --out {out}",)),
    "slack": Made("Both slack laws", ("python -m tests.verification.slack --out {out}",)),
    "regularisation": Made("Regularisations", ("python -m tests.verification.regularisation short --out {out}",)),
    "touchdown": Made("Touchdown", ("python -m tests.verification.touchdown --out {out}",)),
    "touchdown-bent": Made(
        "Touchdown with bending and without",
        ("python -m tests.verification.touchdown_bent --out {out}",),
        words="Where a line lifts its curvature jumps, and the direction there has an order of about 2 at most; with "
        "bending there is a layer sqrt(EI/H), which higher degrees resolve until the kink of the bed is left.",
    ),
    "measured": Made(
        "Measured lines", ("python -m tests.verification.measured --out {out}",), figures=("measured.png",)
    ),
    "hard-cases": Made("Hard cases", ("dolfbuoy study hard-cases --slow --out {out}",), "hard-cases.md"),
    "times": Made("", ("times.py --out {out}",), "times.md", ("times.png",)),
    "bars": Made(
        "What error bars cost",
        ("bars.py --turns 9",),
        None,
        words="Seconds on the processor of the loop over all steps, and what companions and the part of the steps add, "
        "over these; `all`: of the whole run, set-up and files too. Medians of nine turns, of shares of the same turn.",
    ),
    "sweep": Made(
        "A sweep",
        (f"mpirun -n 2 dolfbuoy sweep short --set time.end=20 --set waves.wavelength= {_VARIED} --out {{out}}",),
        None,
        words="Dispersion gives the wavelengths: that of `short` is taken away.",
    ),
    "scaling": Made(
        "Scaling",
        ("scaling.py linear stiffness strong weak sweep --out {out}",),
        None,
        words="The cable of `driven`, P1-P0, BDF2 at 0.01 s. What follows from it: [size, stiffness]"
        "(../README.md#size-and-stiffness) and [ranks](../README.md#ranks).",
    ),
}


def run(command: str, printed: Path) -> None:
    """Run it, what it prints in a file; exit if it fails."""
    name, *rest = command.split()
    program = [sys.executable, str(HERE / name)] if name.endswith(".py") else [str(BIN / name)]
    if name == "mpirun":
        program = [shutil.which("mpirun") or sys.exit("mpirun is not installed.")]
        rest = [str(BIN / word) if word == "dolfbuoy" else word for word in rest]
    # os.environ: without what MPI adds to that of this process, with which mpirun would not start
    root = {"PYTHONPATH": str(HERE.parents[1])}  # where python -m finds tests.verification
    how = {"cwd": printed.parent, "env": dict(os.environ) | MPI_AS_ROOT | root}
    with open(printed, "a", encoding="utf-8") as file:
        code = subprocess.run([*program, *rest], stdout=file, **how).returncode
    if code:
        sys.exit(f"{command}: exit code {code}")


def head(made: Made) -> str:
    """Heading, command and where it ran."""
    told = [" ".join(c.replace(" --out {out}", "").split()) for c in made.commands]
    told = [c.format(before="PYTHON", equal_to="PYTHON") for c in told]
    by = " and ".join(f"`{c}`" for c in told)
    where = f"Made by {by} of {version()}; {sentence()}"
    return "\n\n".join(part for part in (f"# {made.title}", where, made.words) if part) + "\n\n"


def make(name: str, folder: Path, **versions: str) -> None:
    """Run the commands of a file of results/ and put together what they made."""
    made, text = MADE[name], ""
    for place, command in enumerate(made.commands):
        out = (folder / f"{name}-{place}").absolute()
        out.mkdir(parents=True, exist_ok=True)
        printed = out / "printed.txt"
        printed.write_text("")
        run(command.format(out=out / "made", **versions), printed)
        text += (out / "made" / made.taken if made.taken else printed).read_text(encoding="utf-8") + "\n"
        for figure in made.figures:
            shutil.copyfile(out / "made" / figure, HERE / "results" / figure)
    text = text.strip().removeprefix(sentence()).lstrip()  # which the head has
    if made.taken is None and not text.startswith("|"):
        lines = text.replace(f"{folder.absolute()}/", "").splitlines()
        text = "\n".join(["```", *(line.rstrip() for line in lines), "```"])
    (HERE / "results" / f"{name}.md").write_text(
        (head(made) if made.title else "") + text.rstrip() + "\n", encoding="utf-8"
    )


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(MADE))
    parser.add_argument("--dir", type=Path, default=Path("results/renew"), metavar="DIR")
    parser.add_argument("--before", metavar="PYTHON")
    parser.add_argument("--equal-to", metavar="PYTHON")
    options = parser.parse_args()
    if unknown := set(options.names) - set(MADE):
        parser.error(f"no table {', '.join(sorted(unknown))}; there are {', '.join(MADE)}")
    os.environ |= {"OMP_NUM_THREADS": "1", "COLUMNS": "200", "TERM": "dumb"}
    for name in options.names or MADE:
        if name == "before-and-now" and not options.before:
            print("before-and-now: left out, without --before")
            continue
        begin = clock.perf_counter()
        make(name, options.dir, before=options.before, equal_to=options.equal_to)
        print(f"{name}: {clock.perf_counter() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
