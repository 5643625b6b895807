"""What is made from the scene language: scenes/schema.json, and the table of keys in scenes/README.md.

.venv/bin/python tests/language.py
"""

from dolfbuoy.scene.keys import list_keys
from dolfbuoy.scene.schema import FILE, as_text

README = FILE.parent / "README.md"
BEGIN, END = "<!-- made by tests/language.py -->\n", "<!-- end -->\n"


def table() -> str:
    """Every key in Markdown."""
    rows = ["| key | unit | default | range | meaning |", "|---|---|---|---|---|"]
    for key in list_keys():
        cells = [f"`{key.name}`", key.unit, key.default and f"`{key.default}`", key.range, key.description]
        rows.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(rows) + "\n"


def with_table(text: str) -> str:
    """The page with its table made anew."""
    head, rest = text.split(BEGIN)
    return f"{head}{BEGIN}{table()}{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    FILE.write_text(as_text())
    README.write_text(with_table(README.read_text()))
