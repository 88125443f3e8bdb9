"""Decides which robot does what next, using the books in `smachpy_missions.fleet.order_book`."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import current_clock
from actionlib_core.pubsub.service import Service
from smachpy import loginfo, logwarn, register_type
from smachpy_missions.fleet.order_book import DockBook, OrderBook, Stage
from smachpy_missions.interfaces.srv import Permit, PermitResponse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.clock import Event
    from smachpy.states import Pose2D, Waypoint
    from smachpy_missions.fleet.order_book import Entry, Order
    from smachpy_missions.interfaces.srv import PermitRequest

    Task = tuple[str, "Delivery | Waypoint | None"]

SERVICE: Final = "/fleet/permit"


@register_type
@dataclass(frozen=True, slots=True)
class Delivery:
    """One assignment of an order to a robot.

    Attributes:
        order: The order's name.
        attempt: How often the order has been assigned, this time included.
        pickup: Where to fetch the parcel, in the map frame.
        dropoff: Where to bring it.
    """

    order: str
    attempt: int
    pickup: Pose2D
    dropoff: Pose2D


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot of the fleet.

    Attributes:
        name: The prefix of its names, for example robot_0.
        home: Where it waits, in the map frame.
    """

    name: str
    home: Pose2D


@dataclass(slots=True)
class _RobotState:
    """What the dispatcher knows about one robot."""

    news: Event
    seen: Pose2D | None = None
    charge: float | None = None
    at_home: bool = True


class Dispatcher:
    """Assigns tasks to the robots, and answers their requests for permission.

    Args:
        robots: All robots.
        orders: The orders to deliver.
        docks: The docks.
        low: A robot with less charge than this, 0 to 1, charges before its next order.
        on_permit: Called with (robot, step) after a step was granted.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        orders: Sequence[Order],
        docks: Sequence[Waypoint],
        *,
        low: float,
        on_permit: Callable[[str, int], object] = lambda _robot, _step: None,
    ) -> None:
        self.robots = tuple(robots)
        self._orders, self._all_docks, self._low = tuple(orders), tuple(docks), low
        self._on_permit = on_permit
        self._lock = threading.Lock()
        self._service: Service | None = None
        self.open()

    def open(self) -> None:
        """Start a new run: all orders wait, all docks are free."""
        clock = current_clock()
        self.book = OrderBook(self._orders)
        self.docks = DockBook(self._all_docks)
        self._duties = {r.name: _RobotState(clock.event(f"news for {r.name}")) for r in self.robots}
        self._on_duty = {robot.name for robot in self.robots}

    def serve(self) -> Dispatcher:
        """Answer the robots' requests, on the current node, until `close`."""
        self.open()
        self._service = Service(SERVICE, Permit, self.permit)
        return self

    def close(self) -> None:
        """Stop answering."""
        if self._service is not None:
            self._service.close()

    def finish(self) -> str:
        """Close all open orders, and return a report about all of them."""
        with self._lock:
            self.book.close("the fleet has ended")
            blocked = sorted(self.docks.blocked.items())
            docks = [f"  {dock}: needs to be checked, {robot} had it" for dock, robot in blocked]
            report = "\n".join([self.book.report(), *docks])
            done = all(e.stage is Stage.DELIVERED for e in self.book.entries.values())
        (loginfo if done else logwarn)(report)
        return report

    # -- the next task of a robot --------------------------------------------------------------

    def next_task(self, robot: str) -> Task | None:
        """Return the robot's next task and its data; None if it has to wait.

        'deliver' and 'recharge' reserve the order or dock at once; 'park' is the drive home; 'done'
        means that nothing is left to do, 'out' that this robot can do nothing more.
        """
        with self._lock:
            state = self._duties[robot]
            # Cleared before looking, under the lock: news that comes later sets it again, so none
            # is lost between this look and `wait`.
            state.news.clear()
            if state.charge is not None and state.charge < self._low and not self._is_over(state):
                return self._dock(robot, state)
            if not self.book.open:
                return ("done", None) if state.at_home else ("park", None)
            entry = self.book.hand_out(robot)
            if entry is not None:
                state.at_home = False
                order = entry.order
                return "deliver", Delivery(
                    order.name, entry.attempt, entry.pickup, order.dropoff.pose
                )
            return None if state.at_home else ("park", None)

    def _is_over(self, state: _RobotState) -> bool:
        """Return whether all work is done and the robot is at home."""
        return state.at_home and not self.book.open

    def _dock(self, robot: str, state: _RobotState) -> Task | None:
        dock = self.docks.take(robot, state.seen)
        if dock is not None:
            state.at_home = False
            return "recharge", dock
        if self.docks.hopeless:
            self._leave_duty(robot)
            return "out", None
        return None if state.at_home else ("park", None)

    def wait(self, robot: str) -> None:
        """Wait until something has changed since `next_task`, or until `wake`."""
        self._duties[robot].news.wait()

    def wake(self, robot: str) -> None:
        """End a robot's `wait`."""
        self._duties[robot].news.set()

    def _wake_all(self) -> None:
        for state in self._duties.values():
            state.news.set()

    # -- reports from the robots' branches -----------------------------------------------------

    def permit(self, request: PermitRequest) -> PermitResponse:
        """Answer a robot's request for its next step."""
        with self._lock:
            why_not = self.book.permit(request)
        if why_not:
            return PermitResponse(granted=False, reason=why_not)
        self._on_permit(request.robot, request.step)
        return PermitResponse(granted=True)

    def seen(self, robot: str, pose: Pose2D) -> None:
        """Note where a robot is."""
        self._duties[robot].seen = pose

    def parked(self, robot: str) -> None:
        """Note that a robot stands at home."""
        self._duties[robot].at_home = True

    def charged(self, robot: str, charge: float) -> None:
        """Note a robot's charge; 0 means unknown."""
        if charge > 0.0:
            self._duties[robot].charge = charge

    def delivered(self, robot: str, task: Delivery) -> None:
        """Note that an order is delivered."""
        with self._lock:
            entry = self._entry(robot, task)
            if entry is not None:
                self.book.delivered(entry)
            self._wake_all()

    def failed(self, robot: str, task: Delivery, why: str, *, aboard: bool) -> bool:
        """Note that a robot gave up an order; return whether it can take another one."""
        with self._lock:
            entry = self._entry(robot, task)
            if entry is not None:
                self.book.failed(entry, why, aboard=aboard)
            if aboard:
                self._on_duty.discard(robot)
            self.book.give_up(sorted(self._on_duty))
            self._wake_all()
        return not aboard

    def lost(self, robot: str, task: Delivery) -> None:
        """Note that a robot with an order is dead or disconnected."""
        with self._lock:
            entry = self._entry(robot, task)
            if entry is not None:
                logwarn(f"{robot}: lost with {task.order}, while it was {entry.stage}")
                self.book.lost(entry, self._duties[robot].seen)
            self._leave_duty(robot)

    def lost_at(self, robot: str, dock: Waypoint) -> None:
        """Note that a robot is dead or disconnected while it had a dock."""
        with self._lock:
            logwarn(f"{robot}: lost with {dock.name}")
            self.docks.block(dock, robot)
            self._leave_duty(robot)

    def left_dock(self, robot: str, dock: Waypoint, *, left: bool) -> bool:
        """Note whether a robot has left its dock and is home; return whether it can go on."""
        with self._lock:
            if left:
                self.docks.leave(dock, robot)
                self._duties[robot].at_home = True
            else:
                self.docks.block(dock, robot)
                self._leave_duty(robot)
            self._wake_all()
        return left

    def out_of_duty(self, robot: str) -> None:
        """Note that a robot takes no more orders."""
        with self._lock:
            self._leave_duty(robot)

    def _entry(self, robot: str, task: Delivery) -> Entry | None:
        """Return the order's entry; None if the order is no longer this robot's."""
        entry = self.book.entries[task.order]
        return entry if entry.is_at(robot, task.attempt) else None

    def _leave_duty(self, robot: str) -> None:
        self._on_duty.discard(robot)
        self.book.give_up(sorted(self._on_duty))
        self._wake_all()
