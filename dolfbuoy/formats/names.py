"""Names of another program's parts in a form that a scene allows, and notes on parts not translated."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import printable

LONGEST = 50


class Names:
    """Unique names of one kind: letters, digits, _ and -, a letter first; note(text): for names that change."""

    def __init__(self, what: str, note: Callable[..., Any]):
        self.what, self.note, self.found = what, note, dict[str, str]()

    def of(self, name: str) -> str:
        """The name in the scene."""
        if name not in self.found:
            own = re.sub(r"[^0-9A-Za-z_-]", "_", name)
            own = (own if own[:1].isalpha() else f"{self.what}{own}")[:LONGEST]
            taken = set(self.found.values())
            if own in taken:
                own = next(n for k in range(2, 10**6) if (n := f"{own[:40]}_{k}") not in taken)
            self.found[name] = own
            if own != name:
                self.note(f"{self.what} {name!r} is called {own} here")
        return self.found[name]


@dataclass(frozen=True)
class Note:
    """A sentence; line: of the file that it concerns, None for the whole file."""

    text: str
    line: int | None = None

    def __str__(self) -> str:
        return printable(f"line {self.line}: {self.text}" if self.line else self.text)
