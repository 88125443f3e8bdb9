"""The rules of a server that runs one goal at a time: which goal runs, waits or is refused.

Source:
    `SimpleActionServer` of ROS 1 actionlib for the policy "preempt": a newer goal preempts the
    running goal and recalls the waiting one; an older goal that comes late is itself recalled. ROS
    compares stamps, also with those of goals that have ended; see `ServerGoal.is_older_than`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeVar

from actionlib_core.goal.states import TERMINAL, Status

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.goal.server import ServerGoal


class RecordedGoal(Protocol):
    """A goal, as far as these rules need it."""

    @property
    def record(self) -> ServerGoal:
        """The goal's life cycle."""
        ...


G = TypeVar("G", bound=RecordedGoal)

Policy = Literal["preempt", "queue", "reject"]
POLICIES: tuple[Policy, ...] = ("preempt", "queue", "reject")


@dataclass(frozen=True, slots=True)
class Decision(Generic[G]):
    """The reaction to a goal or a cancel that arrived.

    Attributes:
        recall: Goals to end as RECALLED: replaced by a newer goal, or cancelled.
        reject: The new goal, when it is to be ended as REJECTED.
        preempt: Ask the code of the running goal to stop.
        announce: Notify the server's code that a new goal waits.
    """

    recall: tuple[G, ...] = ()
    reject: G | None = None
    preempt: bool = False
    announce: bool = False


@dataclass(slots=True, eq=False)
class _Waiting(Generic[G]):
    """A goal that waits to be accepted, and whether it was cancelled in the meantime."""

    goal: G
    cancelled: bool = False


ANNOUNCE: Decision[Any] = Decision(announce=True)


class SingleGoal(Generic[G]):
    """The policy of one simple action server.

    Args:
        policy: "preempt": a newer goal stops the running one. "queue": goals run one after another,
            in the order they came. "reject": while one runs or waits, others are rejected.

    Attributes:
        current: The goal that was accepted last.
        preempt_requested: Whether its code was asked to stop.
        waiting: The goals that wait to be accepted, oldest first; under "preempt" one at most.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    def __init__(self, policy: Policy = "preempt") -> None:
        if policy not in POLICIES:
            raise ValueError(f"policy: got {policy!r}; expected one of {list(POLICIES)}")
        self.policy = policy
        self.current: G | None = None
        self.preempt_requested = False
        self.waiting: deque[_Waiting[G]] = deque()

    @property
    def next(self) -> G | None:
        """The goal that is accepted next."""
        return self.waiting[0].goal if self.waiting else None

    @property
    def running(self) -> bool:
        """Whether the current goal has not ended."""
        return self.current is not None and self.current.record.status not in TERMINAL

    def _unended(self) -> Iterator[G]:
        """Yield the goal that runs and those that wait."""
        if self.current is not None and self.running:
            yield self.current
        for waiting in self.waiting:
            yield waiting.goal

    def find(self, goal: G) -> G:
        """Return the stored object that equals `goal`, or `goal` itself.

        Handles of one goal are equal but need not be one object, and `on_cancel` compares by `is`.
        """
        known = [self.current, *(waiting.goal for waiting in self.waiting)]
        return next((entry for entry in known if entry is not None and entry == goal), goal)

    def withdraw(self) -> G | None:
        """Remove and return the goal that would be accepted next; None when none waits."""
        return self.waiting.popleft().goal if self.waiting else None

    def on_stop(self) -> list[G]:
        """Request the preempt of the running goal; remove and return the waiting ones."""
        self.preempt_requested = self.running
        waiting = [entry.goal for entry in self.waiting]
        self.waiting.clear()
        return waiting

    def on_goal(self, goal: G, *, recall_waiting: bool = False) -> Decision[G]:
        """Decide about a goal that arrived.

        Args:
            goal: The goal. It may have been cancelled already, by a cancel of all goals.
            recall_waiting: As in `on_cancel`.
        """
        busy = self.running or bool(self.waiting)
        if self.policy == "reject" and busy:
            return Decision(reject=goal)
        cancelled = goal.record.status is Status.RECALLING
        if cancelled and recall_waiting:
            return Decision(recall=(goal,))
        if self.policy == "queue" or not busy:
            self.waiting.append(_Waiting(goal, cancelled))
            return ANNOUNCE
        # "preempt": an older goal that comes late must not stop a newer one.
        if any(goal.record.is_older_than(other.record) for other in self._unended()):
            return Decision(recall=(goal,))
        # The new goal replaces the waiting one at once; the running one only when its code accepts
        # the new goal, or ends.
        older = tuple(waiting.goal for waiting in self.waiting)
        self.waiting.clear()
        self.waiting.append(_Waiting(goal, cancelled))
        self.preempt_requested = self.preempt_requested or self.running
        return Decision(recall=older, preempt=self.running, announce=True)

    def on_cancel(self, goal: G, *, recall_waiting: bool) -> Decision[G]:
        """Decide about a cancel for a goal.

        Args:
            goal: The goal.
            recall_waiting: Recall a waiting goal at once; else it is accepted first, as in ROS, and
                its code finds the preempt already requested.
        """
        if goal is self.current and self.running:
            self.preempt_requested = True
            return Decision(preempt=True)
        for entry in self.waiting:
            if entry.goal is goal:
                if recall_waiting:
                    self.waiting.remove(entry)
                    return Decision(recall=(goal,))
                entry.cancelled = True
        return Decision()

    def accept(self) -> tuple[G | None, G | None]:
        """Make the waiting goal the current one.

        Returns:
            The goal to accept, None when none waits; and the running goal that it replaces, if any.
        """
        if not self.waiting:
            return None, None
        replaced = self.current if self.running else None
        new = self.waiting.popleft()
        self.current = new.goal
        self.preempt_requested = new.cancelled
        return self.current, replaced
