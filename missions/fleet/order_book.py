"""What a fleet's coordinator knows: which order is where, and who has which dock.

An order moves along one line, and every step that cannot be taken back is written down before it is
taken: a robot asks for it (`permit`) and waits for the answer.

    WAITING -> HANDED_OUT -> PICKING_UP -> ABOARD -> HANDING_OVER -> DELIVERED
       ^           |             |            |            |
       +-----------+-------------+------------+            +-> IN_DOUBT
         the robot died or gave up                             the robot died

So when a robot dies, what is written down says what may have happened since:

- before PICKING_UP it has not touched the parcel: the order is given to another robot;
- at PICKING_UP the parcel is at the pickup place, on the shelf or on the robot that stands there;
- at ABOARD it is on the robot, where that was heard of last: another robot takes it from there;
- at HANDING_OVER nobody can know whether the parcel was handed over. The order is IN_DOUBT, and is
  never given to anybody again: that is what "delivered at most once" costs.

Pure decisions: no threads, time or network. `missions.fleet.dispatcher` keeps the callers apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from missions.interfaces.srv import PermitRequest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from smachpy.states import Pose2D, Waypoint

MAX_ATTEMPTS: Final = 4
"""An order is not tried again after this many robots have failed to deliver it."""


class Stage(StrEnum):
    """Where an order stands."""

    WAITING = "waiting"
    HANDED_OUT = "handed out"
    PICKING_UP = "picking up"
    ABOARD = "aboard"
    HANDING_OVER = "handing over"
    DELIVERED = "delivered"
    UNDELIVERED = "undelivered"
    IN_DOUBT = "in doubt"


FINAL: Final = frozenset({Stage.DELIVERED, Stage.UNDELIVERED, Stage.IN_DOUBT})
_UNTOUCHED: Final = frozenset({Stage.HANDED_OUT, Stage.PICKING_UP})

# Step -> the stages in which it may be asked for, and the one that follows. Asked again, because
# the answer was lost, it is granted again.
_STEPS: Final = {
    PermitRequest.PICK_UP: ({Stage.HANDED_OUT, Stage.PICKING_UP}, Stage.PICKING_UP),
    PermitRequest.DRIVE_OFF: ({Stage.PICKING_UP, Stage.ABOARD}, Stage.ABOARD),
    PermitRequest.HAND_OVER: ({Stage.ABOARD, Stage.HANDING_OVER}, Stage.HANDING_OVER),
}


@dataclass(frozen=True, slots=True)
class Order:
    """A parcel to fetch and to hand over.

    Attributes:
        name: One of its kind.
        pickup: Where it lies.
        dropoff: Where it is to go.
    """

    name: str
    pickup: Waypoint
    dropoff: Waypoint


@dataclass(slots=True)
class Entry:
    """What is known of one order.

    Attributes:
        order: The order.
        pickup: Where the parcel is to be fetched now, in the map frame.
        stage: Where it stands.
        robot: Who has it; "" for nobody.
        attempt: How often it was handed out.
        reason: Why it is not delivered.
        failed: The robots that had it before.
    """

    order: Order
    pickup: Pose2D
    stage: Stage = Stage.WAITING
    robot: str = ""
    attempt: int = 0
    reason: str = ""
    failed: list[str] = field(default_factory=list)

    def is_at(self, robot: str, attempt: int) -> bool:
        """Return whether this robot has the order, in this attempt."""
        return bool(robot) and (self.robot, self.attempt) == (robot, attempt)


class OrderBook:
    """All orders of a fleet.

    Args:
        orders: In the order in which they are handed out.

    Attributes:
        entries: By the order's name.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self.entries = {order.name: Entry(order, order.pickup.pose) for order in orders}

    @property
    def open(self) -> bool:
        """Whether any order has not come to its end."""
        return any(entry.stage not in FINAL for entry in self.entries.values())

    def at(self, stage: Stage) -> list[Entry]:
        """Return the orders at a stage."""
        return [entry for entry in self.entries.values() if entry.stage is stage]

    def hand_out(self, robot: str) -> Entry | None:
        """Give `robot` the first order that waits and that it has not failed before."""
        for entry in self.entries.values():
            if entry.stage is Stage.WAITING and robot not in entry.failed:
                entry.stage, entry.robot = Stage.HANDED_OUT, robot
                entry.attempt += 1
                return entry
        return None

    def permit(self, request: PermitRequest) -> str:
        """Write down a step that a robot is about to take.

        Returns:
            Why it must not take it; "" when it may.
        """
        entry = self.entries.get(request.order)
        if entry is None:
            return f"there is no order {request.order!r}"
        if not entry.is_at(request.robot, request.attempt):
            return f"{request.order}: it is no longer {request.robot}'s"
        if request.step not in _STEPS:
            return f"there is no step {request.step}"
        stages, follows = _STEPS[request.step]
        if entry.stage not in stages:
            return f"{request.order}: it is {entry.stage}"
        entry.stage = follows
        return ""

    def delivered(self, entry: Entry) -> None:
        """Note that the robot that has the order says it is done."""
        entry.stage, entry.reason = Stage.DELIVERED, ""

    def failed(self, entry: Entry, why: str, *, aboard: bool) -> None:
        """Note that the robot that has the order gave up; it lives, so its word counts.

        Args:
            entry: The order.
            why: In words.
            aboard: Whether the parcel is on the robot.
        """
        if aboard:
            self._end(entry, Stage.UNDELIVERED, f"aboard {entry.robot}: {why}")
        elif entry.stage in _UNTOUCHED:
            self._wait_again(entry, why)
        else:
            self._end(entry, Stage.IN_DOUBT, f"{entry.robot} has no parcel: {why}")

    def lost(self, entry: Entry, seen: Pose2D | None) -> None:
        """Note that the robot that has the order is dead or cut off; see the module's text.

        Args:
            entry: The order.
            seen: Where the robot was heard of last; None when it never was.
        """
        why = f"{entry.robot} was lost while it was {entry.stage}"
        if entry.stage in _UNTOUCHED:
            self._wait_again(entry, why)
        elif entry.stage is Stage.ABOARD and seen is not None:
            entry.pickup = seen
            self._wait_again(entry, why)
        elif entry.stage is Stage.ABOARD:
            self._end(entry, Stage.UNDELIVERED, f"{why}, nobody knows where")
        elif entry.stage is Stage.HANDING_OVER:
            self._end(entry, Stage.IN_DOUBT, why)

    def give_up(self, robots: Sequence[str]) -> None:
        """End the orders that wait although none of `robots`, all that are left, may take them."""
        for entry in self.at(Stage.WAITING):
            if set(robots) <= set(entry.failed):
                self._end(entry, Stage.UNDELIVERED, _both(entry.reason, "no other robot is left"))

    def close(self, why: str) -> None:
        """End every order that is still open: nobody works on them any more."""
        for entry in self.entries.values():
            if entry.stage is Stage.HANDING_OVER:
                self._end(entry, Stage.IN_DOUBT, f"{why} while {entry.robot} handed it over")
            elif entry.stage is Stage.ABOARD:
                self._end(entry, Stage.UNDELIVERED, f"aboard {entry.robot}: {why}")
            elif entry.stage not in FINAL:
                self._end(entry, Stage.UNDELIVERED, _both(entry.reason, why))

    def report(self) -> str:
        """Return what became of the orders, a line for each that was not delivered."""
        counts = [(stage, len(self.at(stage))) for stage in sorted(FINAL)]
        lines = [", ".join(f"{count} {stage}" for stage, count in counts)]
        lines += [
            f"  {entry.order.name}: {entry.stage}: {entry.reason}"
            for entry in self.entries.values()
            if entry.stage in FINAL - {Stage.DELIVERED}
        ]
        return "\n".join(lines)

    def _wait_again(self, entry: Entry, why: str) -> None:
        entry.failed.append(entry.robot)
        entry.robot, entry.stage, entry.reason = "", Stage.WAITING, why
        if entry.attempt >= MAX_ATTEMPTS:
            self._end(entry, Stage.UNDELIVERED, f"{why}; {entry.attempt} robots have tried")

    def _end(self, entry: Entry, stage: Stage, why: str) -> None:
        entry.stage, entry.reason = stage, why


def _both(before: str, now: str) -> str:
    return f"{before}; {now}" if before else now


class DockBook:
    """Who has which dock; never two robots one dock.

    A dock is taken before its robot sets out, and free again when that says that it has left it.
    The dock of a robot that was lost stays taken: somebody has to look.

    Args:
        docks: The docks.
    """

    def __init__(self, docks: Iterable[Waypoint]) -> None:
        self._docks = {dock.name: dock for dock in docks}
        self.holders: dict[str, str] = {}
        self.blocked: dict[str, str] = {}

    def take(self, robot: str, seen: Pose2D | None) -> Waypoint | None:
        """Give `robot` the free dock that is nearest to it, if there is one."""
        free = [dock for name, dock in self._docks.items() if name not in self.holders]
        if not free:
            return None
        nearest = min(free, key=lambda dock: math.inf if seen is None else dock.pose.distance(seen))
        self.holders[nearest.name] = robot
        return nearest

    def leave(self, dock: Waypoint, robot: str) -> None:
        """Note that `robot` has left its dock."""
        if self.holders.get(dock.name) == robot:
            del self.holders[dock.name]

    def block(self, dock: Waypoint, robot: str) -> None:
        """Note that nobody knows whether `robot` stands on its dock."""
        if self.holders.get(dock.name) == robot:
            self.blocked[dock.name] = robot

    @property
    def hopeless(self) -> bool:
        """Whether no dock will ever be free again by itself."""
        return len(self.blocked) == len(self._docks)
