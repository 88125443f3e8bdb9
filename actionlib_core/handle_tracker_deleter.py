"""Says that a goal's handle is gone, so that nobody will ever end the goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actionlib_core.action_server import ActionServer
    from actionlib_core.status_tracker import StatusTracker


class HandleTrackerDeleter:
    """Calling it gives the goal up: after five seconds the server lists it no more, and its client
    learns that it is LOST.

    Args:
        action_server: The server that tracks the goal.
        status_tracker: The goal.
    """  # noqa: D205  one sentence

    def __init__(self, action_server: ActionServer, status_tracker: StatusTracker) -> None:
        self.action_server = action_server
        self.status_tracker = status_tracker

    def __call__(self, _reference: object = None) -> None:
        """Give the goal up. Also usable as the callback of a `weakref.ref`."""
        self.action_server.release(self.status_tracker)
