"""The table of tests/README.md: what each file of tests claims, what it is compared with, and how long it takes.

    .venv/bin/python tests/readme.py [--junit FILE]

FILE: of `pytest --junitxml=FILE`; without it the seconds stay as they are.  The claim is the first line of a file's
docstring, the source its paragraph that begins with "Source:".
"""

import argparse
import ast
import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

TESTS = Path(__file__).parent
README = TESTS / "README.md"
BEGIN, END = "<!-- made by tests/readme.py -->\n", "<!-- end -->\n"

#: Kinds of evidence, strongest first.
FOLDERS = {
    "forms": "UFL functions evaluated in numbers",
    "closed_forms": "exact solutions, recurrences, orders",
    "published": "measurements and other programs",
    "coupling": "balances, derivatives, symmetry, equal trajectories on several ranks",
    "program": "what a user reads, writes and sees",
    "studies": "what the studies say",
    "verification": "scripts that verify the program, and what their tables say",
    "recorded": "what commands print, draw and write, against what they did",
    "robustness": "hard and random scenes, endings of several ranks, wrong changes of the program",
}


def claim_and_source(path) -> tuple[str, str]:
    """The first line of a test file's docstring and its source.  Raises ValueError if it has none."""
    text = ast.get_docstring(ast.parse(path.read_text())) or ""
    source = re.search(r"^Source: (.+?)(?:\n\n|\Z)", text, re.MULTILINE | re.DOTALL)
    if source is None:
        raise ValueError(f"{path.name}: its docstring has no line 'Source: ...' that tells what it is compared with.")
    found = (text.splitlines()[0], " ".join(source[1].split()))
    return tuple(part.removesuffix(".").replace("|", r"\|") for part in found)


def seconds_of(junit) -> Counter:
    """Seconds of each file of a run's XML, by its name without suffix."""
    total = Counter()
    for case in ElementTree.parse(junit).getroot().iter("testcase"):
        name = next((part for part in case.get("classname").split(".") if part.startswith("test_")), "")
        total[name] += float(case.get("time"))
    return total


def known_seconds(text) -> dict[str, str]:
    """Those of a table, by the names of the files."""
    return dict(re.findall(r"^\| .* \| \[(test_\w+)\]\(.*\) \| (\S*) \|$", text, re.MULTILINE))


def table(seconds) -> str:
    """A section per kind of evidence; seconds: text by name of the file."""
    parts = []
    for folder, kind in FOLDERS.items():
        parts.append(f"\n## {folder}/: {kind}\n\n| claim | compared with | file | seconds |\n|---|---|---|---:|\n")
        for path in sorted((TESTS / folder).glob("test_*.py")):
            claim, source = claim_and_source(path)
            link = f"[{path.stem}]({folder}/{path.name})"
            parts.append(f"| {claim} | {source} | {link} | {seconds.get(path.stem, '')} |\n")
    return "".join(parts)


def with_table(text, seconds) -> str:
    """The page with its table made anew."""
    head, rest = text.split(BEGIN)
    return f"{head}{BEGIN}{table(seconds)}{END}{rest.split(END)[1]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--junit", metavar="FILE", help="of pytest --junitxml=FILE")
    options = parser.parse_args()
    text = README.read_text()
    seconds = known_seconds(text)
    if options.junit:
        seconds |= {name: f"{value:.0f}" for name, value in seconds_of(options.junit).items()}
    README.write_text(with_table(text, seconds))


if __name__ == "__main__":
    main()
