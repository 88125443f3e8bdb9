"""One goal of an action state: when to cancel it, when to give it up, which outcome it means.

    RUNNING --preempt, failure, exec_timeout--> CANCELLING --goal's end, preempt_timeout--> ENDED
       |                                                                                      ^
       +------------------------------------- goal's end -------------------------------------+

`GoalRun` decides: time is an argument there, and nothing waits. `GoalExchange` sends the goal,
watches it and carries the decisions out, so that no goal is left behind by accident.
"""

from __future__ import annotations

import enum
import math
import threading
from typing import TYPE_CHECKING, Any

from smachpy.events import GoalDone, GoalFeedback, GoalSent
from smachpy.run.interrupt import Interruption

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.client import ActionClient, ClientGoalHandle
    from actionlib_core.clock import Timer
    from actionlib_core.goal.states import CommState
    from smachpy.actions.wakeup import Wakeup
    from smachpy.run.frame import Frame, Scope

SUCCEEDED = "succeeded"
ABORTED = "aborted"
PREEMPTED = "preempted"
OUTCOMES = (SUCCEEDED, ABORTED, PREEMPTED)

INTERRUPTED = "a callback of the state did not return; nobody waits for the goal any more"
STOPPED_S = 0.2  # a goal that this state has cancelled is over: so much longer for its feedback
STOPPED = frozenset({"PREEMPTED", "RECALLED", "LOST"})


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
        taken_at: When a server took it [s]; None: none has.
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
        "abandoned",
        "cancelling",
        "exec_timeout",
        "preempted",
        "status",
        "taken_at",
        "text",
        "timed_out",
    )

    def __init__(self, *, exec_timeout: float | None, preempt_timeout: float | None) -> None:
        self.exec_timeout = exec_timeout
        self._preempt_timeout = preempt_timeout
        self._deadline: float | None = None
        self.taken_at: float | None = None
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

    def left(self, now: float) -> float:
        """Return what is left of `exec_timeout` [s]; infinity without one or before it begins."""
        if self.exec_timeout is None or self.taken_at is None:
            return math.inf
        return max(0.0, self.taken_at + self.exec_timeout - now)

    def on_taken(self, at: float) -> None:
        """Note when a server took the goal [s]; from then on `exec_timeout` counts."""
        if self.taken_at is None:
            self.taken_at = at
            if self.exec_timeout is not None and not self.cancelling:
                self._deadline = at + self.exec_timeout

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
        if self.preempted and self.status in STOPPED:
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


class GoalExchange:
    """Carries out what `GoalRun` decides about one goal.

    The state's thread does it. While that thread is in a callback or a listener, which may take its
    time, `hurry` lets another thread cancel the goal.

    Args:
        client: Sends the goal.
        wake: What the state's thread waits on.
        scope: Where the events go; None outside any machine.
        run: The decisions.
        preempt_requested: Whether the state is to stop; any thread may ask.
        on_late: Called when `exec_timeout` is over while the state's thread is in foreign code,
            maybe more than once, in any thread.
        wants_feedback: Somebody besides the listeners wants the feedback: without either, feedback
            does not wake the state's thread.
        frame: Where the state runs; a journal of its run hears of the goal before anybody does.

    Attributes:
        run: See above.
        accepted: The server has begun with the goal.
        result: The result message once it is there, else None.
        unanswered: No server has said a word about the goal.
        adopted: An earlier process has sent it.

    Threads: everything belongs to the state's thread, apart from `hurry` and from what the client
        tells: that is only noted, under the client's lock.
    """

    def __init__(
        self,
        client: ActionClient[Any],
        wake: Wakeup,
        scope: Scope | None,
        run: GoalRun,
        preempt_requested: Callable[[], bool],
        *,
        on_late: Callable[[], object] | None = None,
        wants_feedback: bool = True,
        frame: Frame | None = None,
    ) -> None:
        self.run = run
        self.goal_id = ""
        self.adopted = False
        self._client = client
        self._wake = wake
        self._scope = scope
        self._preempt_requested = preempt_requested
        self._on_late = on_late
        self._wants_feedback = wants_feedback
        self._frame = frame
        self._journal = None if frame is None else frame.run.journal
        self._is_taken_kept = False
        self._kept_result: Any = None
        self._handle: ClientGoalHandle | None = None
        self._lock = threading.Lock()  # guards `run` and the timer
        self._inside = False  # the state's thread is in foreign code, or about to be
        self._timer: Timer | None = None
        self._timer_due: float | None = None

    @property
    def accepted(self) -> bool:
        """See the class."""
        return self._handle is not None and self._handle.goal.begun

    @property
    def result(self) -> Any:
        """See the class."""
        handle = self._handle
        if handle is None:
            return self._kept_result
        return None if self.run.abandoned else handle.goal.result

    @property
    def unanswered(self) -> bool:
        """See the class."""
        return self._handle is not None and not self._handle.goal.acknowledged

    def send(self, goal: Any, *, ack_timeout: float | None) -> None:
        """Send `goal`; when no server takes it within `ack_timeout` [s] it is LOST.

        Raises:
            ActionException, FieldError: the goal is not of the action's type.
            TypeMismatchError: the server is of another type.
            TransportError: the node is closed.
        """
        handle = self._client.make_goal(goal, ack_timeout)
        if self._journal is not None and self._frame is not None:
            self._journal.goal_sent(self._frame, self._client.ns, handle.goal.id)
        self._begin(handle, goal)

    def adopt(self, kept: Any, *, ack_timeout: float | None) -> None:
        """Follow a goal that an earlier process has sent, as `send` does a new one.

        Args:
            kept: What the journal knows of it.
            ack_timeout: When no server knows of it within so long [s] it is LOST.
        """
        self.adopted = True
        if kept["taken_ns"] is not None:
            clock = self._wake.clock
            self.run.on_taken(clock.now() - (clock.time_ns() - kept["taken_ns"]) / 1e9)
            self._is_taken_kept = True
        if kept["status"]:  # it had ended
            self.goal_id = kept["id"]
            if self._preempt_requested():  # as it was when the goal was stopped
                self.run.on_preempt()
            self.run.on_end(kept["status"], kept["text"])
            self._kept_result = kept["result"]
            return
        self._begin(self._client.find_goal(kept["id"], ack_timeout), None)

    def _begin(self, handle: ClientGoalHandle, goal: Any) -> None:
        self._handle = handle
        handle.keeps_result = self._journal is not None
        handle.on_state = self._note_state
        handle.on_feedback = self._note_feedback
        handle.manager.begin(handle)
        self.goal_id = handle.goal.id
        self._inside = True
        self._act()
        self._emit(GoalSent, self.goal_id, goal)
        self._inside = False

    def call_off(self, goal_id: str) -> None:
        """Let the server recall a goal that it does not know, should it still come."""
        self._client.manager.port.send_cancel(goal_id, 0)

    def follow(self, on_feedback: Callable[[Any], object]) -> None:
        """Wait until the goal has ended or is abandoned.

        Args:
            on_feedback: Called with each feedback message, in this thread. When it raises, the goal
                is cancelled, its end awaited, and the exception goes on. What it has not got soon
                after the goal's end is dropped and reported.

        Blocks: until then; a preempt or `exec_timeout` bounds it by `preempt_timeout`, and by the
            one call of `on_feedback` that is under way.
        """
        handle = self._handle
        assert handle is not None
        failure: Exception | None = None
        while True:
            self._wake.clear()
            over = handle.goal.over  # before the feedback: what was sent before the end is seen
            feedback = handle.take_feedback()
            self._inside = feedback is not None  # from here on `hurry` acts if this thread is busy
            step = self._act()
            self._keep_taken(handle)
            if step is not Step.WAIT:
                break
            if feedback is not None:
                started = self._wake.clock.now()
                try:
                    self._emit(GoalFeedback, self.goal_id, feedback)
                    if failure is None:
                        on_feedback(feedback)
                except Interruption:
                    self._emit(GoalDone, self.goal_id, self.run.status or "LOST", INTERRUPTED, None)
                    raise
                except Exception as error:  # noqa: BLE001  raised again when the goal has ended
                    failure = error
                    self.run.on_failure()
                if self.run.cancelling:
                    handle.drop_feedback_after(0.0, STOPPED_S)
                else:
                    handle.drop_feedback_after(started)
            elif over:
                self.run.on_end(handle.goal.status.name, handle.goal.text)
                break
            else:
                self._wake.wait_until(self.run.deadline)
        self._keep_end(handle)
        self._emit(GoalDone, self.goal_id, self.run.status, self.run.text, self.result)
        if failure is not None:
            raise failure

    def _keep_taken(self, handle: ClientGoalHandle) -> None:
        """Write, once, that a server has the goal."""
        if self._is_taken_kept or not handle.goal.acknowledged:
            return
        if self._journal is not None and self._frame is not None:
            self._is_taken_kept = True
            self._journal.goal_taken(self._frame, self.goal_id)

    def _keep_end(self, handle: ClientGoalHandle) -> None:
        """Write how the goal ended; only then may the server forget it."""
        handle.keeps_result = False
        run = self.run
        if run.status == "LOST" and self.unanswered:
            return  # what follows is decided after this, and again by a process that goes on
        if self._journal is not None and self._frame is not None:
            facts = (self.goal_id, run.status, run.text, self.result)
            self._journal.goal_done(self._frame, *facts, preempted=run.preempted)
            if handle.goal.over and run.status != "LOST":
                handle.acknowledge()

    def cancel(self) -> None:
        """Ask the server to end the goal, if it was sent and has not ended."""
        handle = self._handle
        if handle is not None and not handle.goal.over:
            handle.cancel()

    def close(self) -> None:
        """Let no other thread act for the state any more."""
        self._inside = False
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()

    def hurry(self) -> None:
        """Do what is due now although the state's thread is in foreign code.

        Threads: any, also in a signal handler; never waits.
        """
        if self._inside:
            self._wake.clock.spawn(self._act_if_busy, name=f"goal of {self._client.ns}")

    def _act_if_busy(self) -> None:
        if self._inside:
            self._act()

    def _act(self) -> Step:
        """Do what is due, and see to it that somebody does what will be; return the last step."""
        handle = self._handle
        assert handle is not None
        clock = self._wake.clock
        with self._lock:
            if self._preempt_requested():
                self.run.on_preempt()
            if handle.goal.acknowledged:
                self.run.on_taken(clock.now())
            if handle.goal.over and not self.run.status:
                step = Step.WAIT  # for the feedback that came before the end
            else:
                step = self.run.step(clock.now())
            if step is Step.CANCEL:
                handle.cancel()
                step = self.run.step(clock.now())
            if step is Step.ABANDON:
                handle.manager.forget(handle)
            late = self._inside and not self.run.left(clock.now())
            due = self.run.deadline
            if self._inside and due is not None and due != self._timer_due:
                if self._timer is not None:
                    self._timer.cancel()
                self._timer = clock.call_later(due - clock.now(), self.hurry)
                self._timer_due = due
        if late and self._on_late is not None:
            self._on_late()
        return step

    def _note_state(self, _state: CommState) -> None:
        self._wake.set()
        self.hurry()  # `exec_timeout` begins when a server has taken the goal

    def _note_feedback(self) -> None:
        scope = self._scope
        watched = scope is not None and scope.is_watched
        if self._wants_feedback or watched:
            self._wake.set()
        elif self._handle is not None:
            self._handle.take_feedback()

    def _emit(self, kind: Any, *fields: Any) -> None:
        if self._scope is not None:
            self._scope.emit(kind, self._client.ns, *fields)
