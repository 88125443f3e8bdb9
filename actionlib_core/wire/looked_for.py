"""What this program looks for without showing a token that would tell others."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class LookedFor:
    """The full names that were looked for.

    No lock, as operations on dicts and lists are atomic: forked processes look for servers too.

    Threads: every method may be called from any thread.
    """

    def __init__(self) -> None:
        self._names: dict[str, None] = {}
        self._listeners: list[Callable[[], object]] = []

    def add(self, name: str) -> None:
        """Note a name; who listens is called in this thread if it is new, and must not block."""
        if name not in self._names:
            self._names[name] = None
            for listener in list(self._listeners):
                listener()

    def names(self) -> list[str]:
        """Return the names so far."""
        return list(self._names)

    def on_new(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` at each new name; returns what ends that."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)


services = LookedFor()
"""Services that were called or waited for, on whatever network."""
actions = LookedFor()
"""Actions whose servers were waited for before there was a client."""
