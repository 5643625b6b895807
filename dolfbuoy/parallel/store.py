"""Results of cases on disk, in append-only files, one for each computing process.

A line is a checksum and a JSON object {"key", "program", "attempt", "result"}; the latest attempt of a key counts.  A
killed process leaves at most one incomplete line at the end of its file, which is ignored, and removed by the next
process writing there.  Damaged lines are ignored too: their cases are computed again.
"""

import json
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from ..writing import appending, replacing

SUFFIX = ".jsonl"
#: Beginning of a line, and the part before its result, as written by `Writer`.
_LINE = re.compile(rb'^[0-9a-f]{8} \{"key":', re.MULTILINE)
_HEAD = re.compile(rb'\{"key":"([^"\\]*)","program":"([^"\\]*)","attempt":(\d+),"result":')


class Entry(NamedTuple):
    """Place of a result: attempt, file and offset of its line."""

    attempt: int
    file: Path
    place: int


class Store:
    """Results of one program in the files below a folder, which are scanned once, on creation.

    Results remain on disk until requested: thousands of them would not fit in the memory of many processes.
    entries: key -> Entry.  damaged: messages about files with damaged lines.  foreign: results of another program.
    """

    def __init__(self, folder: Path, program: str):
        self.folder, self.program = Path(folder), program
        self.entries: dict[str, Entry] = {}
        self.damaged: list[str] = []
        self.foreign = 0
        for file in sorted(self.folder.rglob(f"*{SUFFIX}")):
            if file.is_file():
                self._read(file)

    def result(self, key: str) -> dict[str, Any] | None:
        """Result of a case; None if it has none."""
        return next(self.results([key]))

    def results(self, keys: list[str] | None = None) -> Iterator[dict[str, Any] | None]:
        """Results of these cases, or of all."""
        opened, file = None, None
        try:
            for key in self.entries if keys is None else keys:
                entry = self.entries.get(key)
                if entry is None:
                    yield None
                    continue
                if file is None or entry.file != opened:
                    if file is not None:
                        file.close()
                    opened, file = entry.file, entry.file.open("rb")
                file.seek(entry.place)
                yield json.loads(file.readline().partition(b" ")[2])["result"]
        finally:
            if file is not None:
                file.close()

    def _read(self, file: Path) -> None:
        bad = 0
        for place, head in _heads(file):
            if head is None:
                bad += 1
                continue
            key, program, attempt = head[1].decode(), head[2].decode(), int(head[3])
            if program != self.program:
                self.foreign += 1
            elif key not in self.entries or attempt >= self.entries[key].attempt:
                self.entries[key] = Entry(attempt, file, place)
        if bad:
            lines = "1 damaged line" if bad == 1 else f"{bad} damaged lines"
            self.damaged.append(f"{file} has {lines}; what they held is computed again.")

    def attempt(self, key: str) -> int:
        """Number of the next attempt at a case."""
        return self.entries[key].attempt + 1 if key in self.entries else 0


class Writer:
    """Adds results to one file of a store; no other process may write there."""

    def __init__(self, file: Path, program: str):
        self._path, self._program = file, program
        self._file: BinaryIO | None = None

    def add(self, key: str, result: dict[str, Any], attempt: int = 0) -> None:
        """Write a result to disk.  Raises OSError."""
        entry = {"key": key, "program": self._program, "attempt": attempt, "result": result}
        text = json.dumps(entry, separators=(",", ":")).encode()
        self._file = self._file or self._opened()
        self._file.write(b"%08x %s\n" % (zlib.crc32(text), text))
        self._file.flush()

    def _opened(self) -> BinaryIO:
        """Open the file after atomically removing incomplete or damaged lines.

        A user's file without any line of a store is left alone, and the next similar path is used.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        path, number = self._path, 0
        while self._path.is_file() and self._path.stat().st_size and not _LINE.search(self._path.read_bytes()):
            number += 1
            self._path = path.with_stem(f"{path.stem}-{number}")
        old = self._path.read_bytes().splitlines(keepends=True) if self._path.is_file() else []
        good = [line for line in old if line.endswith(b"\n") and _head(line)]
        if len(good) < len(old) or (old and self._path.stat().st_nlink > 1):
            with replacing(self._path) as part:
                part.write_bytes(b"".join(good))
        return appending(self._path)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


def _heads(file: Path) -> Iterator[tuple[int, re.Match[bytes] | None]]:
    """(place, head) of the lines of a file, None for a damaged one; an incomplete last line is left out."""
    with open(file, "rb") as lines:
        place = 0
        for line in lines:
            if line.endswith(b"\n"):
                yield place, _head(line)
            place += len(line)


def _head(line: bytes) -> re.Match[bytes] | None:
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    return _HEAD.match(text) if checksum == b"%08x" % zlib.crc32(text) else None
