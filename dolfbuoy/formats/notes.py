"""Notes on what a translation could not carry over, or changed on the way."""

from dataclasses import dataclass

from ..errors import printable


@dataclass(frozen=True)
class Note:
    """A sentence; line: of the file that it is about, None for the whole of it."""

    text: str
    line: int | None = None

    def __str__(self) -> str:
        return printable(f"line {self.line}: {self.text}" if self.line else self.text)
