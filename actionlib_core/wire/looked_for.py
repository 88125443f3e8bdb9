"""The services and actions that this program has looked for, which no token shows.

The bridge to ROS 1 reads them from here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class LookedFor:
    """A set of full names.

    Without a lock, as operations on dicts and lists are atomic: a lock that another thread holds at
    a fork would stay locked in the forked process.

    Threads: every method may be called from any thread.
    """

    def __init__(self) -> None:
        self._names: dict[str, None] = {}
        self._listeners: list[Callable[[], object]] = []

    def add(self, name: str) -> None:
        """Add a name; if it is new, call the listeners in this thread. They must not block."""
        if name not in self._names:
            self._names[name] = None
            for listener in list(self._listeners):
                listener()

    def names(self) -> list[str]:
        """Return all names."""
        return list(self._names)

    def on_new(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` at each new name; return a function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)


services = LookedFor()
"""Services that were called or waited for, on any network."""
actions = LookedFor()
"""Actions whose servers were waited for before there was a client."""
