"""The books of a fleet's coordinator: the state of each order, and the robot at each dock.

An order moves along one line. A robot asks (`permit`) before every step that cannot be undone, and
the step is written down before the robot gets its answer.

    WAITING -> HANDED_OUT -> PICKING_UP -> ABOARD -> HANDING_OVER -> DELIVERED
       ^           |             |            |            |
       +-----------+-------------+------------+            +-> IN_DOUBT
         the robot died or gave up                             the robot died

So when a robot dies, the book shows what may have happened since:

- before PICKING_UP it has not touched the parcel: another robot gets the order;
- at PICKING_UP the parcel is at the pickup place, on the shelf or on the robot that stands there;
- at ABOARD it is on the robot, at its last known pose: another robot fetches it there;
- at HANDING_OVER nobody can know whether the parcel was handed over. The order is IN_DOUBT and is
  never assigned again: that is the price of "delivered at most once".

Pure decisions: no threads, time or network. `smachpy_missions.fleet.dispatcher` holds the lock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from smachpy_missions.interfaces.srv import PermitRequest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from smachpy.states import Pose2D, Waypoint

MAX_ATTEMPTS: Final = 4
"""After this many failed attempts an order is not assigned again."""


class Stage(StrEnum):
    """The stage of an order."""

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

# Step -> the stages in which it may be requested, and the stage that follows. A step that was
# granted is granted again: the robot repeats its request if the answer was lost.
_STEPS: Final = {
    PermitRequest.PICK_UP: ({Stage.HANDED_OUT, Stage.PICKING_UP}, Stage.PICKING_UP),
    PermitRequest.DRIVE_OFF: ({Stage.PICKING_UP, Stage.ABOARD}, Stage.ABOARD),
    PermitRequest.HAND_OVER: ({Stage.ABOARD, Stage.HANDING_OVER}, Stage.HANDING_OVER),
}


@dataclass(frozen=True, slots=True)
class Order:
    """A parcel to fetch and to hand over.

    Attributes:
        name: A unique name.
        pickup: Where the parcel is.
        dropoff: Where it goes.
    """

    name: str
    pickup: Waypoint
    dropoff: Waypoint


@dataclass(slots=True)
class Entry:
    """The state of one order.

    Attributes:
        order: The order.
        pickup: Where to fetch the parcel now, in the map frame; it moves with a lost robot.
        stage: The stage.
        robot: The robot that has it; "" for none.
        attempt: How often it has been assigned.
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
        """Return whether this robot has the order, in this attempt.

        The attempt number tells an old assignment of a robot that was disconnected from a new one.
        """
        return bool(robot) and (self.robot, self.attempt) == (robot, attempt)


class OrderBook:
    """All orders of a fleet.

    Args:
        orders: In the order in which they are assigned.

    Attributes:
        entries: By the order's name.
    """

    def __init__(self, orders: Iterable[Order]) -> None:
        self.entries = {order.name: Entry(order, order.pickup.pose) for order in orders}

    @property
    def open(self) -> bool:
        """Whether any order is not finished."""
        return any(entry.stage not in FINAL for entry in self.entries.values())

    def at(self, stage: Stage) -> list[Entry]:
        """Return the orders at a stage."""
        return [entry for entry in self.entries.values() if entry.stage is stage]

    def hand_out(self, robot: str) -> Entry | None:
        """Assign to `robot` the first waiting order that it has not failed before."""
        for entry in self.entries.values():
            if entry.stage is Stage.WAITING and robot not in entry.failed:
                entry.stage, entry.robot = Stage.HANDED_OUT, robot
                entry.attempt += 1
                return entry
        return None

    def permit(self, request: PermitRequest) -> str:
        """Write down a step that a robot is about to take.

        Returns:
            Why the step is refused; "" if it is granted.
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
        """Note that the robot reports the order as delivered."""
        entry.stage, entry.reason = Stage.DELIVERED, ""

    def failed(self, entry: Entry, why: str, *, aboard: bool) -> None:
        """Note that the robot gave up. It is alive, so its report is trusted.

        Args:
            entry: The order.
            why: The reason, in words.
            aboard: Whether the parcel is on the robot.
        """
        if aboard:
            self._end(entry, Stage.UNDELIVERED, f"aboard {entry.robot}: {why}")
        elif entry.stage in _UNTOUCHED:
            self._wait_again(entry, why)
        else:
            self._end(entry, Stage.IN_DOUBT, f"{entry.robot} has no parcel: {why}")

    def lost(self, entry: Entry, seen: Pose2D | None) -> None:
        """Note that the robot is dead or disconnected; the module's text lists the cases.

        Args:
            entry: The order.
            seen: The robot's last known pose, if any.
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
        """Close the waiting orders that none of `robots`, all that are left, may take."""
        for entry in self.at(Stage.WAITING):
            if set(robots) <= set(entry.failed):
                self._end(entry, Stage.UNDELIVERED, _both(entry.reason, "no other robot is left"))

    def close(self, why: str) -> None:
        """Close every open order: nobody works on them any more."""
        for entry in self.entries.values():
            if entry.stage is Stage.HANDING_OVER:
                self._end(entry, Stage.IN_DOUBT, f"{why} while {entry.robot} handed it over")
            elif entry.stage is Stage.ABOARD:
                self._end(entry, Stage.UNDELIVERED, f"aboard {entry.robot}: {why}")
            elif entry.stage not in FINAL:
                self._end(entry, Stage.UNDELIVERED, _both(entry.reason, why))

    def report(self) -> str:
        """Return a report: counts, and a line for each order that was not delivered."""
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
    """Which robot has which dock; no dock is given to two robots.

    A dock is reserved before its robot sets out, and is free again when the robot reports that it
    has left. The dock of a lost robot stays reserved until a person has checked it.

    Args:
        docks: The docks.
    """

    def __init__(self, docks: Iterable[Waypoint]) -> None:
        self._docks = {dock.name: dock for dock in docks}
        self.holders: dict[str, str] = {}
        self.blocked: dict[str, str] = {}

    def take(self, robot: str, seen: Pose2D | None) -> Waypoint | None:
        """Reserve for `robot` the nearest free dock, if any."""
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
        """Note that `robot` may still stand on its dock."""
        if self.holders.get(dock.name) == robot:
            self.blocked[dock.name] = robot

    @property
    def hopeless(self) -> bool:
        """Whether every dock is blocked, so that waiting is useless."""
        return len(self.blocked) == len(self._docks)
