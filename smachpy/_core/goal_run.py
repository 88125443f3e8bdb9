"""One execution of an action state as decisions: when to cancel, when to give up, which outcome.

    RUNNING --preempt, failure, exec_timeout--> CANCELLING --goal's end, preempt_timeout--> ENDED
       |                                                                                      ^
       +------------------------------------- goal's end -------------------------------------+

Time is an argument, nothing waits here; `smachpy.simple_action_state` carries the decisions out.
"""

from __future__ import annotations

import enum

SUCCEEDED = "succeeded"
ABORTED = "aborted"
PREEMPTED = "preempted"
OUTCOMES = (SUCCEEDED, ABORTED, PREEMPTED)

_STOPPED = frozenset({"PREEMPTED", "RECALLED", "LOST"})


class Step(enum.Enum):
    """What the shell has to do now."""

    WAIT = enum.auto()
    CANCEL = enum.auto()
    ABANDON = enum.auto()
    FINISH = enum.auto()


class GoalRun:
    """What happened to the goal of one execution.

    Args:
        exec_timeout: The goal is cancelled so long [s] after a server took it; None: no limit.
        preempt_timeout: A cancelled goal that has not ended after so long [s] is abandoned; None:
            no limit.

    Attributes:
        preempted: A preempt was asked for while the goal ran.
        timed_out: `exec_timeout` passed while the goal ran.
        status: Name of the goal status it ended with; "" while it runs, "LOST" when abandoned.
        text: What the server, or the client for it, said about that.
        abandoned: The goal was given up; it may still run on the server.

    Threads: none of its own, no lock; the owner calls it from one thread.
    """

    __slots__ = (
        "_deadline",
        "_failed",
        "_preempt_timeout",
        "_taken",
        "abandoned",
        "cancelling",
        "exec_timeout",
        "preempted",
        "status",
        "text",
        "timed_out",
    )

    def __init__(self, *, exec_timeout: float | None, preempt_timeout: float | None) -> None:
        self.exec_timeout = exec_timeout
        self._preempt_timeout = preempt_timeout
        self._deadline: float | None = None
        self._taken = False
        self._failed = False
        self.preempted = False
        self.timed_out = False
        self.cancelling = False
        self.abandoned = False
        self.status = ""
        self.text = ""

    @property
    def deadline(self) -> float | None:
        """When `step` has something to do though nothing happens [s]; None: never."""
        return self._deadline

    def on_taken(self, now: float) -> None:
        """Note that a server has the goal; from then on `exec_timeout` counts."""
        if not self._taken:
            self._taken = True
            if self.exec_timeout is not None and not self.cancelling:
                self._deadline = now + self.exec_timeout

    def on_preempt(self) -> None:
        """Note that the state is to stop."""
        if not self.status:
            self.preempted = True

    def on_failure(self) -> None:
        """Note that a callback raised: the goal is to be cancelled, without a preempt."""
        if not self.status:
            self._failed = True

    def on_end(self, status: str, text: str) -> None:
        """Note that the goal ended, with the name of a final goal status."""
        if not self.status:
            self.status, self.text = status, text

    def step(self, now: float) -> Step:
        """Return what to do; to be called after every event and at `deadline`."""
        if self.status:
            return Step.FINISH
        late = self._deadline is not None and now >= self._deadline
        asked = self.preempted or self._failed
        if not self.cancelling and (asked or late):
            self.timed_out = late and not asked
            self.cancelling = True
            grace = self._preempt_timeout
            self._deadline = None if grace is None else now + grace
            return Step.CANCEL
        if self.cancelling and late:
            self.abandoned = True
            self.status = "LOST"
            self.text = (
                f"the action server has not ended it {self._preempt_timeout:g} s after the cancel"
            )
            return Step.ABANDON
        return Step.WAIT

    @property
    def outcome(self) -> str:
        """The outcome of the state, once the goal has ended.

        Source:
            smach_ros: a goal that somebody else stopped is 'aborted'; only a preempt from above
            makes 'preempted'. A goal that was recalled or lost after that preempt is 'preempted'
            too.
        """
        if self.status == "SUCCEEDED":
            return SUCCEEDED
        if self.preempted and self.status in _STOPPED:
            return PREEMPTED
        return ABORTED

    @property
    def reason(self) -> str:
        """Why it is 'aborted' or 'preempted', in words."""
        words = [self.status]
        if self.timed_out:
            words.append(f"cancelled after exec_timeout={self.exec_timeout:g} s")
        if self.text:
            words.append(self.text)
        return ": ".join(words)
