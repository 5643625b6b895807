"""Many short cases: how many a second, beside another version of the program, and whether kills cost any.

    .venv/bin/python tests/benchmarks/cases.py [--cases 1000] [--end 10] [--against TREE/.venv/bin/dolfbuoy]

`short` with as many amplitudes, to `--end` seconds, in as many parts as there are cores.  All parts are killed when a
third of the cases is done (SIGKILL), and stopped when two thirds are (SIGTERM); the same commands go on.  Then each
case must have one line in the store, and every line that was there before a kill must still be.  In between, after each
third, the other program runs its own `sweep` of a third of `--their-cases` of these cases under mpirun, so that both
see the same machine.  What it needs to start is taken off: it would be shared by as many cases.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import sentence

OWN = [sys.executable, "-c", "from dolfbuoy.commands.entry import main; main()"]
ENVIRONMENT = os.environ | {
    "OMP_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}


def table_of(count: int, end: float, file: Path) -> None:
    """Amplitudes from 0.5 to 1.5 m."""
    amplitudes = [f"{0.5 + k / max(count - 1, 1):.6f}" for k in range(count)]
    file.write_text("waves.amplitude,time.end\n" + "".join(f"{a},{end:g}\n" for a in amplitudes))


def lines_of(folder: Path) -> dict[Path, bytes]:
    """Whole lines of every file of a store."""
    found = {file: file.read_bytes() for file in (folder / "cases").rglob("*.jsonl")}
    return {file: content[: content.rfind(b"\n") + 1] for file, content in found.items()}


def number_of(lines: dict[Path, bytes]) -> int:
    return sum(content.count(b"\n") for content in lines.values())


def leg(command: list[str], folder: Path, parts: int, until: float, how: signal.Signals) -> float:
    """Run all parts until so many cases are done, then send them a signal; wall seconds."""
    begin = time.perf_counter()
    running = [
        subprocess.Popen([*command, "--part", f"{i}/{parts}"], env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=log)
        for i in range(1, parts + 1)
        for log in [open(folder.parent / f"part-{i}.log", "a")]  # noqa: SIM115  # the process keeps it
    ]
    while any(process.poll() is None for process in running):
        if number_of(lines_of(folder)) >= until:
            for process in running:
                process.send_signal(how)
            break
        time.sleep(0.2)
    for process in running:
        process.wait()
    return time.perf_counter() - begin


def ours(count: int, end: float, parts: int, between=lambda: None) -> dict:
    """A sweep that is killed once and stopped once; between: called after each third, and not counted."""
    with tempfile.TemporaryDirectory() as place:
        table, folder = Path(place) / "cases.csv", Path(place) / "out"
        table_of(count, end, table)
        command = [*OWN, "sweep", "short", "--table", str(table), "--out", str(folder)]
        seconds, before = 0.0, {}
        for share, how in ((1 / 3, signal.SIGKILL), (2 / 3, signal.SIGTERM), (2.0, signal.SIGTERM)):
            seconds += leg(command, folder, parts, share * count, how)
            now = lines_of(folder)
            if not all(now[file].startswith(content) for file, content in before.items()):
                sys.exit("Lines of the store are lost.")
            before = now
            between()
        results = [json.loads(line.partition(b" ")[2]) for content in before.values() for line in content.splitlines()]
        keys = [result["key"] for result in results]
        if len(keys) != count or len(set(keys)) != count or any(r["result"]["status"] != "done" for r in results):
            sys.exit(f"{count} cases have {len(keys)} results, {len(set(keys))} of them different.")
        done = subprocess.run([*command, "--collect"], env=ENVIRONMENT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        alone = sum(result["result"]["seconds"] for result in results)
        return {"seconds": seconds, "alone": alone, "bytes": sum(map(len, before.values()))}


def theirs(program: str, count: int, end: float, ranks: int) -> float:
    """Wall seconds of the other program's sweep."""
    with tempfile.TemporaryDirectory() as place:
        table = Path(place) / "cases.csv"
        table_of(count, end, table)
        command = [
            "mpirun",
            "-n",
            str(ranks),
            program,
            "sweep",
            "short",
            "--table",
            str(table),
            "--out",
            f"{place}/out",
        ]
        begin = time.perf_counter()
        done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return time.perf_counter() - begin


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--end", type=float, default=10.0, help="of each case [s]")
    parser.add_argument("--parts", type=int, default=os.cpu_count())
    parser.add_argument("--against", help="another version's dolfbuoy")
    parser.add_argument("--their-cases", type=int, default=60)
    parser.add_argument("--their-ranks", type=int, default=os.cpu_count())
    options = parser.parse_args()
    if shutil.which(options.against or "mpirun") is None:
        parser.error(f"there is no {options.against}")
    ours(3 * options.parts, 0.1, options.parts)  # compiles
    few, rest, took = options.their_ranks, options.their_cases // 3, []
    if options.against:
        theirs(options.against, 4, 0.1, options.their_ranks)  # compiles
        start = theirs(options.against, few, 0.1, options.their_ranks)

    def between():
        if options.against:
            took.append(theirs(options.against, rest, options.end, options.their_ranks) - start)

    found = ours(options.cases, options.end, options.parts, between)
    rate = options.cases / found["seconds"]
    print(sentence())
    print(f"{options.cases} cases of short to {options.end:g} s in {options.parts} parts, killed once, stopped once:")
    print(f"{found['seconds']:.1f} s, {rate:.3g} cases per second, three starts of each part among them;")
    print(f"{found['alone'] / options.cases:.3g} s and {found['bytes'] / options.cases / 1000:.3g} kB of each case;")
    print("nothing was computed twice, nothing is lost.")
    if options.against:
        rates = sorted(rest / seconds for seconds in took)
        print(f"{options.against}: 3 times {rest} cases in between, on {options.their_ranks} ranks:")
        print(f"{', '.join(f'{r:.3g}' for r in rates)} cases per second without its start of {start:.1f} s;")
        print(f"{rate / rates[1]:.3g} times as many cases per second ({rate / rates[2]:.3g} to {rate / rates[0]:.3g}).")


if __name__ == "__main__":
    main()
