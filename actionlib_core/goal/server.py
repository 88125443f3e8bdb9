"""The server's rules: the goals of one action server and the reactions to messages.

`ServerGoals` only decides; `GoalKeeper` (`actionlib_core.action.goal_keeper`) sends, calls the
program's callbacks and keeps time.
"""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from actionlib_core.goal.life_cycle import server_life_cycle
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import TERMINAL, Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

# A finished goal, and a cancel that came before its goal, stay in the status list for this time.
LISTED_S = 5.0  # ROS's parameter status_list_timeout
RESULT_TIMEOUT_S = 60.0  # a result without acknowledgement is kept for this time
REPEATED_S = 0.1  # a copy of a goal that was sent this long after the goal was made is a repetition
ON_ITS_WAY_S = 0.05  # a goal that comes this long after a cancel may have been sent before it
CANCELS = 16  # remembered cancels by stamp
MEMORY_S = 3600.0  # ids of finished goals are remembered, so that a late copy is not run again
MEMORY_GOALS = 100_000  # limit on their number; the oldest is forgotten first

TEXT_CANCELLED_BEFORE = (
    "This goal handle was canceled by the action server because its timestamp is before the "
    "timestamp of the last cancel request"
)
TEXT_CANCEL_CAME_FIRST = "This goal was canceled before it arrived"


class Arrival(enum.Enum):
    """The server's decision about a goal that arrived."""

    NEW = enum.auto()
    """Run it."""
    RECALLED = enum.auto()
    """Its cancel came first: answer RECALLED, never run it."""
    REPEAT = enum.auto()
    """A repetition: send its status or result again."""
    LATE = enum.auto()
    """The server takes no more goals: do not answer, so that the next server may have it."""


@dataclass(slots=True, eq=False)
class ServerGoal:
    """One goal as its server sees it.

    Attributes:
        id: The goal's id, unique on the network.
        stamp_ns: When the client sent it, by its clock [ns since the epoch]; cancels compare it.
        status: Its state in the server's life cycle.
        text: The text of that status.
        client: Session id of its sender; "" when unknown.
        made_at: When the client first sent it, as far as known [s, clock].
        age: Time from that until the copy was sent that has arrived first [s].
        cancel_if_lost: It is cancelled when its client dies.
        superseded: While it ran, a newer goal or another user of its resource asked it to stop,
            which its status does not show.
        arrived: False while only a cancel has come for this id.
        result: The result as it is sent, once there is one.
        listed_until: End of its time in the status list [s, clock]; None: no end yet, or passed.
        kept_until: End of its result's time [s, clock]; None: no end yet.
        tag: Data of the caller, which is not read here.
    """

    id: str
    stamp_ns: int
    status: Status = Status.PENDING
    text: str = ""
    client: str = ""
    made_at: float = 0.0
    age: float = 0.0
    cancel_if_lost: bool = False
    superseded: bool = False
    arrived: bool = True
    result: object = None
    listed_until: float | None = None
    kept_until: float | None = None
    tag: object = None

    def entry(self) -> StatusEntry:
        """Return its entry in the status list."""
        return StatusEntry(self.id, self.stamp_ns, self.status, self.text)

    def is_older_than(self, other: ServerGoal) -> bool:
        """Return whether this goal, which has just arrived, was sent before one that is here.

        That is so only for a repetition, as its first copy may have been lost: first copies arrive
        in order. Stamps are compared only between goals of one client, which makes them increasing:
        the clocks of two computers differ, and a clock may be set at any time.
        """
        if self.age < REPEATED_S:
            return False
        if self.client and self.client == other.client:
            return self.stamp_ns < other.stamp_ns
        return self.made_at < other.made_at


class ServerGoals:
    """The goals of one action server.

    Args:
        name: The action's name, for errors.
        result_timeout: How long a result waits for its acknowledgement [s].

    Attributes:
        closed: No more goals are taken.
        tracked: Id -> goal that runs, or whose end its client may not know yet.
        forgotten: For a file of the goals: id and status of each whose result is no longer kept;
            id and None once the id is forgotten too. The caller empties it; None: nobody does.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    def __init__(self, name: str, *, result_timeout: float = RESULT_TIMEOUT_S) -> None:
        self.name = name
        self.result_timeout = result_timeout
        self.tracked: dict[str, ServerGoal] = {}
        self.forgotten: list[tuple[str, Status | None]] | None = None
        # Status, when it was forgotten, whether acknowledged. Tuples of plain numbers, because
        # CPython's garbage collector does not have to visit these, of which there may be 100,000.
        self._past: dict[str, tuple[int, float, bool]] = {}
        # Its ids in order. `next(iter(dict))` steps over the gaps of all entries deleted before.
        self._oldest: deque[str] = deque()
        self.closed = False
        # Cancels by stamp, for goals that are still on their way: the stamp [ns], and when it came
        # [s, clock]. The latest comes last; an earlier one stays while its stamp is greater.
        self._cancels: list[tuple[int, float]] = []
        self._steps = server_life_cycle()

    def find(self, goal_id: str) -> ServerGoal | None:
        """Return the goal that is tracked under this id."""
        goal = self.tracked.get(goal_id)
        return goal if goal is not None and goal.arrived else None

    def past_status(self, goal_id: str) -> Status | None:
        """Return the end of a goal whose result is no longer kept; None: not known."""
        past = self._past.get(goal_id)
        return None if past is None else Status(past[0])

    def on_goal(self, arrived: ServerGoal, now: float) -> tuple[Arrival, ServerGoal | None]:
        """Decide about a goal that arrived, for the first time or again.

        Returns:
            The decision, and the tracked goal; None for the repetition of a goal that is no longer
            tracked, and for one that comes too late.
        """
        known = self.tracked.get(arrived.id)
        if known is not None and known.arrived:
            return Arrival.REPEAT, known
        if known is None and arrived.id in self._past:
            return Arrival.REPEAT, None
        if self.closed:
            return Arrival.LATE, None
        self.tracked[arrived.id] = arrived
        if known is not None:  # not arrived: the entry that an early cancel has left
            text = TEXT_CANCEL_CAME_FIRST
        elif self._is_cancelled(arrived):
            text = TEXT_CANCELLED_BEFORE
        else:
            return Arrival.NEW, arrived
        self.step(arrived, "cancel", "the cancel that came first", now, text)
        return Arrival.RECALLED, arrived

    def _is_cancelled(self, arrived: ServerGoal) -> bool:
        """Return whether a goal was sent before a cancel by stamp that came first.

        Its stamp alone does not show that: its client's clock may be behind, or was put back.
        """
        return arrived.stamp_ns > 0 and any(
            arrived.stamp_ns <= stamp_ns and arrived.made_at <= came_at + ON_ITS_WAY_S
            for stamp_ns, came_at in self._cancels
        )

    def on_cancel(self, goal_id: str, stamp_ns: int, now: float) -> list[ServerGoal]:
        """Apply the four cancel rules of actionlib.

        Neither id nor stamp: all goals. Stamp only: goals at or before it. Id only: that goal.
        Both: that goal and those at or before the stamp.

        A cancel for an unknown id is remembered for `LISTED_S`: a goal with that id that arrives
        later is recalled. So is a goal that was sent before this cancel, comes after it, and has a
        stamp at or before the cancel's.

        Returns:
            The goals that this cancel asks to stop and that were not asked before.
        """
        if goal_id and not stamp_ns:  # the usual one: no walk over all, which a thousand may send
            named = self.tracked.get(goal_id)
            meant = [] if named is None else [named]
        else:
            meant = [
                goal
                for goal in self.tracked.values()
                if goal.id == goal_id or not stamp_ns or 0 < goal.stamp_ns <= stamp_ns
            ]
        asked = [goal for goal in meant if self.request_cancel(goal)]
        if goal_id and goal_id not in self.tracked and goal_id not in self._past:
            self.tracked[goal_id] = ServerGoal(
                goal_id, 0, Status.RECALLING, arrived=False, listed_until=now + LISTED_S
            )
        if stamp_ns:
            self._cancels = [cancel for cancel in self._cancels if cancel[0] > stamp_ns]
            self._cancels.append((stamp_ns, now))
            del self._cancels[:-CANCELS]
        return asked

    def on_client_lost(self, client: str, *, every: bool = True) -> list[ServerGoal]:
        """Ask the goals of a dead client to stop; return those that were not asked before.

        Args:
            client: Session id of the client.
            every: All its goals; else those that it has sent with `cancel_if_lost`.
        """
        return [
            goal
            for goal in self.tracked.values()
            if goal.client == client
            and (every or goal.cancel_if_lost)
            and self.request_cancel(goal)
        ]

    def request_cancel(self, goal: ServerGoal) -> bool:
        """Mark a goal as asked to stop; False when it has ended or was asked before."""
        path = self._steps.steps.get((goal.status, "request_cancel"))
        if path is None or not goal.arrived:
            return False
        goal.status = path[-1]
        return True

    def step(
        self, goal: ServerGoal, event: str, call: str, now: float, text: str = ""
    ) -> StatusEntry:
        """Apply an event to a goal; a goal that has ended is forgotten after some time.

        Args:
            goal: The goal.
            event: Event of the server's table.
            call: What the user called, for the error.
            now: The time [s, clock].
            text: The text of its new status.

        Returns:
            Its new entry in the status list.

        Raises:
            IllegalTransitionError: its status does not allow the event.
        """
        # Looked up here too: `LifeCycle.step` wants a text for its error, which takes time to make.
        path = self._steps.steps.get((goal.status, event))
        if path is None:
            where = f"goal {goal.id} on '{self.name}'"
            path = self._steps.step(goal.status, event, goal=where, call=call)
        goal.status = path[-1]
        goal.text = text
        if goal.status in TERMINAL:
            goal.listed_until = now + LISTED_S
            goal.kept_until = now + self.result_timeout
        return StatusEntry(goal.id, goal.stamp_ns, goal.status, text)

    def on_acknowledged(self, goal_ids: Iterable[str], now: float) -> None:
        """Forget results that have arrived at their clients."""
        for goal_id in goal_ids:
            goal = self.tracked.get(goal_id)
            if goal is not None and goal.kept_until is not None:
                self._forget(goal, now, acknowledged=True)

    def has_unacknowledged(self) -> bool:
        """Return whether a result waits for its acknowledgement."""
        return any(goal.kept_until is not None for goal in self.tracked.values())

    def release(self, goal: ServerGoal, now: float) -> None:
        """Note that no code will end this goal: it becomes LOST after `LISTED_S`."""
        if goal.status not in TERMINAL:
            goal.listed_until = now + LISTED_S

    def restore(self, goal: ServerGoal, now: float) -> None:
        """Track a goal that an earlier server process had taken; its result is kept once more."""
        self.tracked[goal.id] = goal
        if goal.status in TERMINAL:  # not listed: nobody knows how long ago it has ended
            goal.kept_until = now + self.result_timeout

    def restore_past(self, goal_id: str, status: int, now: float) -> None:
        """Remember the end of an earlier server's goal, so that a late copy is not run."""
        if goal_id not in self._past:
            self._past[goal_id] = (status, now, True)
            self._oldest.append(goal_id)

    def close(self) -> None:
        """Take no more goals."""
        self.closed = True

    def taken(self) -> Iterator[tuple[str, Status, ServerGoal | None]]:
        """Yield id, status and goal of all goals ever taken whose end is not acknowledged.

        The goal is None when its result is no longer kept.
        """
        for goal in self.tracked.values():
            if goal.arrived:
                yield goal.id, goal.status, goal
        for goal_id, (status, _, acknowledged) in self._past.items():
            if not acknowledged:
                yield goal_id, Status(status), None

    def listed(self) -> list[ServerGoal]:
        """Return the goals of the status list."""
        return [
            goal
            for goal in self.tracked.values()
            if goal.listed_until is not None or goal.status not in TERMINAL
        ]

    def list_statuses(self) -> list[StatusEntry]:
        """Return the status list: `entry` of each of `listed`, written out for speed."""
        return [
            StatusEntry(goal.id, goal.stamp_ns, goal.status, goal.text)
            for goal in self.tracked.values()
            if goal.listed_until is not None or goal.status not in TERMINAL
        ]

    def expire(self, now: float) -> float | None:
        """Forget what is past its time; return when to call again [s, clock]; None: never."""
        soonest: float | None = None
        for goal in list(self.tracked.values()):  # a copy, as `_expire` removes goals
            due = self._expire(goal, now)
            if due is not None and (soonest is None or due < soonest):
                soonest = due
        self._trim(now)
        return soonest

    def _expire(self, goal: ServerGoal, now: float) -> float | None:
        if goal.listed_until is not None and goal.listed_until <= now:
            goal.listed_until = None
            if not goal.arrived:  # an early cancel: its goal never came
                del self.tracked[goal.id]
                return None
            if goal.status not in TERMINAL:  # see `release`
                goal.status = Status.LOST
                self._forget(goal, now)
                return None
        if goal.kept_until is not None and goal.kept_until <= now:
            self._forget(goal, now)
            return None
        return goal.listed_until if goal.listed_until is not None else goal.kept_until

    def _forget(self, goal: ServerGoal, now: float, *, acknowledged: bool = False) -> None:
        del self.tracked[goal.id]
        self._past[goal.id] = (int(goal.status), now, acknowledged)
        self._oldest.append(goal.id)
        if self.forgotten is not None:
            self.forgotten.append((goal.id, goal.status))
        # Not only in `expire`: many goals may end between two of its calls.
        if len(self._past) > MEMORY_GOALS:
            self._trim(now)

    def _trim(self, now: float) -> None:
        """Drop remembered ids beyond the limits; the oldest come first."""
        while self._oldest:
            oldest = self._oldest[0]
            if len(self._past) <= MEMORY_GOALS and self._past[oldest][1] + MEMORY_S > now:
                return
            del self._past[self._oldest.popleft()]
            if self.forgotten is not None:
                self.forgotten.append((oldest, None))
