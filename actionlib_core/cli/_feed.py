"""A queue from callbacks to the main thread, which prints, and which receives Ctrl-C."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actionlib_core.clock import Clock


class Feed:
    """A queue with many writers and one reader.

    Threads: `put` may be called from any thread, `next` from one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._items: deque[Any] = deque()
        self._changed = clock.event()

    def put(self, item: Any) -> None:
        """Append an item."""
        self._items.append(item)
        self._changed.set()

    def next(self, deadline: float | None = None) -> Any:
        """Return the next item.

        Args:
            deadline: A time of the clock [s]; None waits for ever.

        Raises:
            TimeoutError: there was no item by then.

        Blocks: until there is one.
        """
        while True:
            self._changed.clear()  # before the check: a later `put` sets it again
            if self._items:
                return self._items.popleft()
            left = None if deadline is None else deadline - self._clock.now()
            if (left is not None and left <= 0) or not self._changed.wait(left):
                raise TimeoutError
