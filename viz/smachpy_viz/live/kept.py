"""The numbered records that a machine keeps, each with the JSON text that all pages get."""

from __future__ import annotations

import itertools
import json
import zlib
from collections import deque
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

PACKED: Final = 256_000
"""About so many characters of text are compressed together."""

LEVEL: Final = 1
"""Of `zlib`: a tenth of the size in little time."""


class Kept:
    """Records with their numbers and texts, oldest first.

    Args:
        packs: Whether all but the newest are compressed; then none can be removed.

    Attributes:
        size: Length of the texts [characters].
    """

    def __init__(self, *, packs: bool = False) -> None:
        self.size = 0
        self._packs = packs
        self._packed: list[bytes] = []  # texts, a line each
        self._newest: deque[tuple[int, dict[str, Any], str]] = deque()
        self._unpacked = 0  # length of the texts of the newest

    def append(self, number: int, record: dict[str, Any], text: str) -> None:
        """Add a record after the others."""
        self._newest.append((number, record, text))
        self.size += len(text)
        self._unpacked += len(text)
        if self._packs and self._unpacked > 2 * PACKED:
            texts = []
            while self._unpacked > PACKED and len(self._newest) > 1:
                texts.append(self._newest.popleft()[2])
                self._unpacked -= len(texts[-1])
            self._packed.append(zlib.compress("\n".join(texts).encode(), LEVEL))

    def __len__(self) -> int:
        """Return the number of records, without those that are packed."""
        return len(self._newest)

    @property
    def oldest(self) -> int:
        """Number of the oldest record that is not packed; 0 for none."""
        return self._newest[0][0] if self._newest else 0

    def popleft(self) -> tuple[int, dict[str, Any]]:
        """Remove the oldest record; return it with its number."""
        number, record, text = self._newest.popleft()
        self.size -= len(text)
        self._unpacked -= len(text)
        return number, record

    def after(self, number: int) -> list[str] | None:
        """Return the texts of the records after a number; None if one of them may be packed."""
        # From the end: a page usually lacks only the newest of thousands.
        newer = itertools.takewhile(lambda one: one[0] > number, reversed(self._newest))
        texts = [text for _, _, text in newer]
        if self._packed and len(texts) == len(self._newest):
            return None
        texts.reverse()
        return texts

    def parts(self) -> Iterator[str]:
        """Return the texts, several joined by commas; they may be iterated later."""
        newest = [",".join(text for _, _, text in self._newest)] if self._newest else []
        lines = (zlib.decompress(one).decode() for one in list(self._packed))
        return itertools.chain((text.replace("\n", ",") for text in lines), newest)

    def records(self) -> list[dict[str, Any]] | Packed:
        """Return the records; they may be used later."""
        newest = [record for _, record, _ in self._newest]
        return Packed(list(self._packed), newest) if self._packed else newest

    def reversed(self) -> Iterator[dict[str, Any]]:
        """Yield the records, the newest first."""
        yield from (record for _, record, _ in reversed(self._newest))
        for one in reversed(self._packed):
            yield from reversed(_unpacked(one))


def with_commas(parts: Iterable[str]) -> Iterator[str]:
    """Yield the parts with commas between them."""
    for number, part in enumerate(parts):
        if number:
            yield ","
        yield part


class Packed:
    """Records of which most are decompressed while they are iterated."""

    def __init__(self, packed: list[bytes], newest: list[dict[str, Any]]) -> None:
        self._packed = packed
        self._newest = newest

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the records, the oldest first."""
        for one in self._packed:
            yield from _unpacked(one)
        yield from self._newest


def _unpacked(packed: bytes) -> list[dict[str, Any]]:
    return [json.loads(line) for line in zlib.decompress(packed).decode().split("\n")]
