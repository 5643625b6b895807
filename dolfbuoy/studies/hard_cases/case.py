"""What a hard case is: what is asked, what a trustworthy program must show, and a check that measures it."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

#: name -> HardCase, in the order of the catalogue.
CATALOGUE: dict[str, "HardCase"] = {}
_TEXT = tomllib.loads(Path(__file__).with_name("catalogue.toml").read_text(encoding="utf-8"))
_WORDS = {name: {"group": group, **words} for group, named in _TEXT.items() for name, words in named.items()}


class Findings:
    """What happened in a case: measured numbers with their limits, and sentences that the program said."""

    def __init__(self):
        self.said: list[str] = []
        self.failed: list[str] = []

    def below(self, what: str, value: float, limit: float, unit: str = "") -> None:
        """A measured size that must not exceed `limit` (and must be a number)."""
        value = float(value)
        text = f"{what} {value:.3g}{unit} (at most {limit:.3g})"
        self._note(text, np.isfinite(value) and value <= limit)

    def close(self, what: str, value: float, expected: float, relative: float, unit: str = "") -> None:
        """A measured value that must agree with an independent one to `relative`."""
        value, expected = float(value), float(expected)
        off = abs(value - expected) / abs(expected)
        text = f"{what} {value:.6g}{unit}, expected {expected:.6g} (off by {off:.1e}, at most {relative:.1e})"
        self._note(text, np.isfinite(off) and off <= relative)

    def holds(self, what: str, condition) -> None:
        """A statement that must be true."""
        self._note(what if condition else f"not true: {what}", bool(condition))

    def finite(self, record) -> None:
        """No NaN and no infinity anywhere in a record."""
        bad = [n for n, v in record.variables.items() if v.dtype.kind == "f" and not np.isfinite(v.values).all()]
        self._note(f"not finite: {', '.join(bad)}" if bad else "all finite", not bad)

    def says(self, sentences: list[str] | str, words: str) -> None:
        """One of the program's sentences must contain `words`; the sentence is quoted."""
        sentences = [sentences] if isinstance(sentences, str) else sentences
        match = next((s for s in sentences if words in s), None)
        self._note(f'"{match}"' if match else f"nothing said of '{words}' in {sentences}", match is not None)

    def remark(self, text: str) -> None:
        """A number worth telling, without a verdict."""
        self.said.append(text)

    def _note(self, text, good):
        self.said.append(text)
        if not good:
            self.failed.append(text)


@dataclass(frozen=True)
class HardCase:
    """One scene, or a few of a kind, with the check of what they must show."""

    name: str
    group: str
    asked: str
    must_show: str
    check: Callable[[Findings], None] = field(repr=False)
    slow: bool = False

    def evaluate(self) -> dict:
        """{"passed": bool, "happened": text, "failed": [text]}; whatever is raised is a failure, and told."""
        found = Findings()
        try:
            self.check(found)
        except Exception as error:
            found.holds(f"{type(error).__name__}: {error}", False)
        if not found.said:
            found.holds("something was measured", False)
        return {"passed": not found.failed, "happened": "; ".join(found.said), "failed": found.failed}


def hard_case(check):
    """Decorator: the function, which writes into a Findings, becomes the case of its name in catalogue.toml."""
    name = check.__name__.replace("_", "-")
    if name in CATALOGUE:
        raise ValueError(f"two hard cases are called {name}")
    CATALOGUE[name] = HardCase(name=name, check=check, **_WORDS[name])
    return check
