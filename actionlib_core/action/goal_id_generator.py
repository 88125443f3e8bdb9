"""Goal ids: `<node>-<n>-<secs>.<nsecs>`, as ROS 1 actionlib makes them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from actionlib_core.clock import current_clock
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core.clock import Clock

_count = itertools.count(1)  # one per process: `next` is atomic


class GoalIDGenerator:
    """Makes ids that differ from all others on the network.

    Args:
        name: What an id begins with; the name of the default node when None.
        clock: Gives the stamp; the current clock when None.

    Threads: any; ids never repeat within a process, those of a virtual clock never on that clock.
    """

    def __init__(self, name: str | None = None, *, clock: Clock | None = None) -> None:
        if name is None:
            from actionlib_core.node import get_node

            name = get_node().name
        self._clock = clock
        self.name = ""
        self.set_name(name)

    def set_name(self, name: str) -> None:
        """Set what ids begin with.

        Args:
            name: Usually the node's name.
        """
        self.name = name

    def generate(self) -> tuple[str, int]:
        """Return a new id and its stamp [ns since the epoch]."""
        clock = self._clock if self._clock is not None else current_clock()
        stamp_ns = clock.time_ns()
        secs, nsecs = divmod(stamp_ns, 1_000_000_000)
        count = getattr(clock, "numbers", _count)  # a virtual clock's own: each run has the same
        return f"{self.name}-{next(count)}-{secs}.{nsecs}", stamp_ns

    def generate_ID(self) -> GoalID:  # noqa: N802  actionlib's name
        """Return a new id, stamped with the present time."""
        goal_id, stamp_ns = self.generate()
        return GoalID(stamp=Time(0, stamp_ns), id=goal_id)
