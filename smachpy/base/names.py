"""The type of several names, which one name is not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator


class Names(Protocol):
    """Several names: a list, tuple or set of texts, but not one text, which has letters.

    A type checker tells them apart by `in`: a list may be asked for anything, a text only for text.
    """

    def __iter__(self) -> Iterator[str]: ...

    def __contains__(self, name: object, /) -> bool: ...
