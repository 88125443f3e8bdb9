"""Times at which something is repeated. No threads; time is given."""

from __future__ import annotations


class Backoff:
    """Says when something is to be repeated, after a pause that doubles each time.

    Args:
        now: The current time [s].
        first: The first pause [s].
        longest: The longest pause [s].

    Attributes:
        due: When it is to be repeated next [s].
    """

    __slots__ = ("_longest", "_pause", "due")

    def __init__(self, now: float, first: float, longest: float) -> None:
        self.due = now + first
        self._pause = first
        self._longest = longest

    def is_due(self, now: float) -> bool:
        """Return whether to repeat it now; if so, the next pause begins."""
        if now < self.due:
            return False
        self._pause = min(2 * self._pause, self._longest)
        self.due = now + self._pause
        return True
