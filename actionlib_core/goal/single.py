"""One goal at a time: which goal runs, which waits, which is turned away.

Source:
    `SimpleActionServer` of ROS 1 actionlib for the policy "preempt": a newer goal preempts the one
    that runs and recalls the one that waits; a goal with an older stamp is recalled itself.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeVar

from actionlib_core.goal.states import TERMINAL

if TYPE_CHECKING:
    from actionlib_core.goal.server import ServerGoal


class Goal(Protocol):
    """What this needs to know of a goal."""

    @property
    def record(self) -> ServerGoal:
        """Its place in the life cycle."""
        ...


G = TypeVar("G", bound=Goal)

Policy = Literal["preempt", "queue", "reject"]
POLICIES: tuple[Policy, ...] = ("preempt", "queue", "reject")


@dataclass(frozen=True, slots=True)
class Decision(Generic[G]):
    """What is to be done with a goal or a cancel that arrived.

    Attributes:
        recall: Goals to answer with RECALLED: a newer one came, or they were cancelled.
        reject: The new goal, when it is to be answered with REJECTED.
        preempt: Tell the running goal's code to stop.
        announce: Tell that a new goal waits.
    """

    recall: tuple[G, ...] = ()
    reject: G | None = None
    preempt: bool = False
    announce: bool = False


@dataclass(slots=True, eq=False)
class _Waiting(Generic[G]):
    """A goal that waits to be accepted, and whether it was asked to stop meanwhile."""

    goal: G
    stamp_ns: int
    cancelled: bool = False


ANNOUNCE: Decision[Any] = Decision(announce=True)


class SingleGoal(Generic[G]):
    """The policy of one simple action server.

    Args:
        policy: "preempt": a newer goal stops the running one. "queue": goals run one after another,
            in the order they came. "reject": while one runs or waits, others are rejected.

    Attributes:
        current: The goal that was accepted last.
        preempt_requested: It was asked to stop.
        waiting: The goals that wait to be accepted.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    def __init__(self, policy: Policy = "preempt") -> None:
        if policy not in POLICIES:
            raise ValueError(f"policy: got {policy!r}; expected one of {list(POLICIES)}")
        self.policy = policy
        self.current: G | None = None
        self.preempt_requested = False
        self.waiting: deque[_Waiting[G]] = deque()
        self._current_stamp_ns = 0

    @property
    def next(self) -> G | None:
        """The goal that is accepted next."""
        return self.waiting[0].goal if self.waiting else None

    @property
    def running(self) -> bool:
        """Whether the current goal has not ended."""
        return self.current is not None and self.current.record.status not in TERMINAL

    def find(self, goal: G) -> G:
        """Return the object known here that equals `goal`, else `goal`."""
        known = [self.current, *(waiting.goal for waiting in self.waiting)]
        return next((entry for entry in known if entry is not None and entry == goal), goal)

    def withdraw(self) -> G | None:
        """Take the goal out that waits to be accepted next; None when none waits."""
        return self.waiting.popleft().goal if self.waiting else None

    def on_stop(self) -> list[G]:
        """Note that everything ends; return the goals that wait, which wait no more."""
        self.preempt_requested = self.running
        waiting = [entry.goal for entry in self.waiting]
        self.waiting.clear()
        return waiting

    def on_goal(self, goal: G, stamp_ns: int) -> Decision[G]:
        """Take a goal that arrived."""
        if self.policy == "queue":
            self.waiting.append(_Waiting(goal, stamp_ns))
            return ANNOUNCE
        if self.policy == "reject":
            if self.running or self.waiting:
                return Decision(reject=goal)
            self.waiting.append(_Waiting(goal, stamp_ns))
            return ANNOUNCE
        newest = self.waiting[-1].stamp_ns if self.waiting else 0
        if stamp_ns < newest or stamp_ns < self._current_stamp_ns:
            return Decision(recall=(goal,))
        if not self.waiting and not self.running:
            self.waiting.append(_Waiting(goal, stamp_ns))
            return ANNOUNCE
        older = tuple(waiting.goal for waiting in self.waiting)
        self.waiting.clear()
        self.waiting.append(_Waiting(goal, stamp_ns))
        self.preempt_requested = self.preempt_requested or self.running
        return Decision(recall=older, preempt=self.running, announce=True)

    def on_cancel(self, goal: G, *, recall_waiting: bool) -> Decision[G]:
        """Take a cancel for a goal.

        Args:
            goal: The goal.
            recall_waiting: A goal that only waits is recalled at once; else it is accepted first,
                as in ROS, and finds itself preempted.
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
            The goal to accept, None when none waits; and the one it pushes aside, if any runs.
        """
        if not self.waiting:
            return None, None
        pushed = self.current if self.running else None
        new = self.waiting.popleft()
        self.current, self._current_stamp_ns = new.goal, new.stamp_ns
        self.preempt_requested = new.cancelled
        return self.current, pushed
