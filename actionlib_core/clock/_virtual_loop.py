"""An asyncio event loop on a virtual clock; it has no sockets."""

from __future__ import annotations

import asyncio
import selectors
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from _typeshed import FileDescriptorLike as _File

    from actionlib_core.clock._virtual import VirtualClock


class _VirtualSelector(selectors.BaseSelector):
    """A selector without sockets, which waits for the clock only."""

    def __init__(self, clock: VirtualClock) -> None:
        self.wakeup = clock.event("a coroutine")
        self._keys: dict[object, selectors.SelectorKey] = {}

    def register(self, fileobj: _File, events: int, data: object = None) -> selectors.SelectorKey:
        fd = fileobj if isinstance(fileobj, int) else fileobj.fileno()
        key = selectors.SelectorKey(fileobj, fd, events, data)
        self._keys[fileobj] = key
        return key

    def unregister(self, fileobj: _File) -> selectors.SelectorKey:
        return self._keys.pop(fileobj)

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:
            self.wakeup.name = _describe_tasks()
        self.wakeup.wait(timeout)
        self.wakeup.clear()
        return []

    def get_map(self) -> Mapping[object, selectors.SelectorKey]:  # type: ignore[override]
        return self._keys


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop with the time of a virtual clock."""

    def __init__(self, clock: VirtualClock) -> None:
        self._virtual_clock = clock
        self._virtual_selector = _VirtualSelector(clock)
        super().__init__(self._virtual_selector)

    def time(self) -> float:
        return self._virtual_clock.now()

    # Other threads wake asyncio's own loop through a pair of sockets, this one through an event of
    # the clock.
    def _make_self_pipe(self) -> None:
        """Open no sockets."""

    def _close_self_pipe(self) -> None:
        """Close no sockets."""

    def _write_to_self(self) -> None:
        self._virtual_selector.wakeup.set()


def _describe_tasks() -> str:
    names = sorted(task.get_name() for task in asyncio.all_tasks() if not task.done())
    return f"coroutines {', '.join(names)}"
