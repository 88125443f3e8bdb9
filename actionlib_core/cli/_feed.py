"""A queue from callbacks to the main thread, which prints, and which receives Ctrl-C."""

from __future__ import annotations

import sys
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.goal.bounded import Backlog

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock


class Feed:
    """A bounded queue with many writers and one reader.

    When what reads our output is slow (`| less`), the oldest items are dropped; standard error says
    so at first, and each time that their number has doubled.

    Threads: `put` may be called from any thread, `next` from one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()  # guards `_items`
        self._items: Backlog[Any] = Backlog()
        self._told = 0  # of the items that were dropped
        self._changed = clock.event()

    def put(self, item: Any, size_of: Callable[[Any], int]) -> None:
        """Append an item; `size_of` returns its size [bytes], and is called if others wait."""
        size = size_of(item) if self._items else 0
        with self._lock:
            self._items.add(item, size)
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
            with self._lock:
                item = self._items.take()
            if item is not None:
                self._tell_dropped()
                return item
            left = None if deadline is None else deadline - self._clock.now()
            if (left is not None and left <= 0) or not self._changed.wait(left):
                raise TimeoutError

    def _tell_dropped(self) -> None:
        dropped = self._items.dropped
        if dropped and dropped >= 2 * self._told:
            self._told = dropped
            text = f"{dropped} messages were dropped: they came faster than they were read"
            print(f"actionlib: {text}", file=sys.stderr)
