"""Names of another program's parts, as a scene allows them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

LONGEST = 50


class Names:
    """Names of one kind, each once: letters, digits, _ and -, a letter first; note(text) of those that change."""

    def __init__(self, what: str, note: Callable[..., Any]):
        self.what, self.note, self.found = what, note, dict[str, str]()

    def of(self, name: str) -> str:
        """The name in the scene."""
        if name not in self.found:
            self.found[name] = self._fresh(name)
            if self.found[name] != name:
                self.note(f"{self.what} {name!r} is called {self.found[name]} here")
        return str(self.found[name])

    def _fresh(self, name: str) -> str:
        own = re.sub(r"[^0-9A-Za-z_-]", "_", name)
        own = (own if own[:1].isalpha() else f"{self.what}{own}")[:LONGEST]
        taken = set(self.found.values())
        return own if own not in taken else next(n for k in range(2, 10**6) if (n := f"{own[:40]}_{k}") not in taken)
