"""From callbacks to the main thread, which prints and gets the Ctrl-C."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actionlib_core.clock import Clock


class Feed:
    """Hands what callbacks bring to the main thread.

    Threads: `put` may be called from any; `next` is for one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._items: deque[Any] = deque()
        self._changed = clock.event()

    def put(self, item: Any) -> None:
        """Take one item in."""
        self._items.append(item)
        self._changed.set()

    def next(self, deadline: float | None = None) -> Any:
        """Return the next item.

        Args:
            deadline: A time of the clock [s]; None waits for ever.

        Raises:
            TimeoutError: nothing has come by then.

        Blocks: until there is one.
        """
        while True:
            self._changed.clear()
            if self._items:
                return self._items.popleft()
            left = None if deadline is None else deadline - self._clock.now()
            if (left is not None and left <= 0) or not self._changed.wait(left):
                raise TimeoutError
