"""`GoalIDGenerator`, in the module that has it in ROS 1."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from actionlib_core.clock import current_clock, wall_time
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
from actionlib_core.node import get_node
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core.clock import Clock

__all__ = ["GoalIDGenerator"]

_count = itertools.count(1)  # for the whole process; `next` is atomic, so it needs no lock


class GoalIDGenerator:
    """Makes ids that differ from all others on the network.

    Args:
        name: Prefix of the ids; None: the name of the default node.
        clock: Source of the stamps; None: the current clock.

    Threads: any; ids never repeat within a process, those of a virtual clock never on that clock.
    """

    def __init__(self, name: str | None = None, *, clock: Clock | None = None) -> None:
        if name is None:
            name = get_node().name
        self._clock = clock
        self._wall_time = None if clock is None else wall_time(clock)
        self.name = ""
        self.set_name(name)

    def set_name(self, name: str) -> None:
        """Set the prefix of the ids.

        Args:
            name: Usually the node's name.
        """
        self.name = name

    def generate(self) -> tuple[str, int]:
        """Return a new id and its stamp [ns since the epoch], later than those before."""
        clock = self._clock if self._clock is not None else current_clock()
        stamp_ns = (self._wall_time or wall_time(clock)).stamp_ns()
        secs, nsecs = divmod(stamp_ns, 1_000_000_000)
        # A virtual clock counts by itself, so that repeated runs of a test have the same ids.
        count = getattr(clock, "numbers", _count)
        return f"{self.name}-{next(count)}-{secs}.{nsecs}", stamp_ns

    def generate_ID(self) -> GoalID:  # noqa: N802  actionlib's name
        """Return a new id, stamped with the present time."""
        goal_id, stamp_ns = self.generate()
        return GoalID(stamp=Time(0, stamp_ns), id=goal_id)
