"""One goal of an action state: when to cancel or abandon it, and which outcome follows.

    RUNNING --preempt, failure, a timeout--> CANCELLING --goal's end, preempt_timeout--> ENDED
       |                                                                                   ^
       +------------------------------------ goal's end -----------------------------------+

`GoalRun` decides; it gets the time as an argument and never waits. `GoalFollower` sends the goal,
watches it and carries out the decisions, so that no goal keeps running by accident.
"""

from __future__ import annotations

import enum
import math
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.shutdown import current_shutdown
from smachpy.engine.interrupt import Interruption
from smachpy.engine.journal import NO_JOURNAL
from smachpy.events import GoalDone, GoalFeedback, GoalSent

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.client import ActionClient
    from actionlib_core.action.client_goal_handle import ClientGoalHandle
    from actionlib_core.clock import Timer
    from actionlib_core.goal.states import CommState
    from smachpy.actions.wakeup import Wakeup
    from smachpy.engine.frame import Frame, Scope

SUCCEEDED = "succeeded"
ABORTED = "aborted"
PREEMPTED = "preempted"
OUTCOMES = (SUCCEEDED, ABORTED, PREEMPTED)

INTERRUPTED = "a callback of the state did not return; nobody waits for the goal any more"
STOPPED_S = 0.2  # time for the rest of the feedback after this state has cancelled the goal [s]
STOPPED = frozenset({"PREEMPTED", "RECALLED", "LOST"})


class GoalDuty(enum.Enum):
    """What `GoalFollower` has to do now."""

    WAIT = enum.auto()
    CANCEL = enum.auto()
    ABANDON = enum.auto()
    FINISH = enum.auto()


class GoalRun:
    """The state of the goal of one execution.

    Args:
        accept_timeout: Time after which a goal is cancelled that a server has acknowledged but not
            accepted, because it waits there behind others [s]; None for no limit.
        exec_timeout: Time after which the goal is cancelled, from its acceptance by a server [s];
            None for no limit.
        preempt_timeout: Time that a cancelled goal has to end before it is abandoned [s]; None for
            no limit.

    Attributes:
        begun_at: When a server accepted it [s]; None before.
        preempted: The state was asked to stop while the goal ran.
        timed_out: The timeout that passed while the goal ran or waited, for people; "" for none.
        status: Name of its final goal status; "" while it runs, "LOST" if it was abandoned.
        text: The text of the server, or of the client in its place, about the end.
        abandoned: The state no longer waits for the goal; it may still run on the server.

    Threads: not thread-safe.
    """

    __slots__ = (
        "_accept_timeout",
        "_deadline",
        "_failed",
        "_is_taken_over",
        "_preempt_timeout",
        "abandoned",
        "begun_at",
        "cancelling",
        "exec_timeout",
        "preempted",
        "status",
        "text",
        "timed_out",
    )

    def __init__(
        self,
        *,
        accept_timeout: float | None,
        exec_timeout: float | None,
        preempt_timeout: float | None,
    ) -> None:
        self._accept_timeout = accept_timeout
        self.exec_timeout = exec_timeout
        self._preempt_timeout = preempt_timeout
        self._deadline: float | None = None
        self.begun_at: float | None = None
        self._failed = False
        self._is_taken_over = False
        self.preempted = False
        self.timed_out = ""
        self.cancelling = False
        self.abandoned = False
        self.status = ""
        self.text = ""

    @property
    def deadline(self) -> float | None:
        """When `step` must be called even if nothing happens [s]; None for never."""
        return self._deadline

    def left(self, now: float) -> float:
        """Return the rest of `exec_timeout` [s]; infinity if there is none or it has not begun."""
        if self.exec_timeout is None or self.begun_at is None:
            return math.inf
        return max(0.0, self.begun_at + self.exec_timeout - now)

    def on_acknowledged(self, sent_at: float) -> None:
        """Record that a server has the goal, which was sent at a time [s]."""
        waits = self.begun_at is None and not self.cancelling
        if waits and self._deadline is None and self._accept_timeout is not None:
            self._deadline = sent_at + self._accept_timeout

    def on_begun(self, at: float) -> None:
        """Record when a server accepted the goal [s]; `exec_timeout` begins at that moment."""
        if self.begun_at is None:
            self.begun_at = at
            if not self.cancelling:
                self._deadline = None if self.exec_timeout is None else at + self.exec_timeout

    def on_preempt(self, *, is_taken_over: bool = False) -> None:
        """Record that the state was asked to stop, and whether another process follows the goal."""
        if not self.status:
            self.preempted, self._is_taken_over = True, is_taken_over

    def on_failure(self) -> None:
        """Record that a callback raised: the goal must be cancelled, although nobody asked."""
        if not self.status:
            self._failed = True

    def on_end(self, status: str, text: str) -> None:
        """Record that the goal ended, with the name of a final goal status."""
        if not self.status:
            self.status, self.text = status, text

    def step(self, now: float) -> GoalDuty:
        """Return what to do now; call it after every event and at `deadline`."""
        if self.status:
            return GoalDuty.FINISH
        # One deadline: that of the acceptance, then `exec_timeout`, after a cancel
        # `preempt_timeout`.
        late = self._deadline is not None and now >= self._deadline
        asked = self.preempted or self._failed
        if self._is_taken_over:
            self.abandoned, self.status = True, "LOST"
            self.text = "another process follows the goal"
            return GoalDuty.ABANDON
        if not self.cancelling and (asked or late):
            if late and not asked:
                self.timed_out = (
                    f"not accepted within server_wait_timeout={self._accept_timeout:g} s"
                    if self.begun_at is None
                    else f"cancelled after exec_timeout={self.exec_timeout:g} s"
                )
            self.cancelling = True
            grace = self._preempt_timeout
            self._deadline = None if grace is None else now + grace
            return GoalDuty.CANCEL
        if self.cancelling and late:
            self.abandoned = True
            self.status = "LOST"
            self.text = (
                f"the action server has not ended it {self._preempt_timeout:g} s after the cancel"
            )
            return GoalDuty.ABANDON
        return GoalDuty.WAIT

    @property
    def outcome(self) -> str:
        """The outcome of the state, once the goal has ended.

        Source:
            smach_ros: a goal that somebody else stopped is 'aborted'; only a preempt of this state
            leads to 'preempted'. So does a goal that was recalled or lost after that preempt.
        """
        if self.status == "SUCCEEDED":
            return SUCCEEDED
        if self.preempted and self.status in STOPPED:
            return PREEMPTED
        return ABORTED

    @property
    def reason(self) -> str:
        """The reason of 'aborted' or 'preempted', for people."""
        words = [self.status]
        if self.timed_out:
            words.append(self.timed_out)
        if self.text:
            words.append(self.text)
        return ": ".join(words)


class GoalFollower:
    """Carries out the decisions of a `GoalRun` about one goal.

    This happens in the state's thread. While that thread is inside a callback or a listener, which
    may block, `hurry` lets another thread cancel the goal.

    Args:
        client: Sends the goal.
        wake: The event on which the state's thread waits.
        scope: Publishes the events; None outside of any machine.
        run: Makes the decisions.
        preempt_requested: Returns whether the state must stop; called in any thread.
        on_late: Called when `exec_timeout` passes while the state's thread is in the user's code;
            maybe more than once, in any thread.
        wants_feedback: The state itself needs the feedback. If neither it nor a listener does,
            feedback does not wake the state's thread.
        frame: Where the state runs. The journal of a durable run records the goal before it is sent
            or published.

    Attributes:
        run: See above.
        accepted: The server has started the goal.
        result: The result message once it has arrived, else None.
        unanswered: No server has acknowledged the goal.
        adopted: An earlier process has sent it.
        lost_link: What connects the client with all servers, while that is lost.

    Threads: all methods belong to the state's thread except `hurry` and the callbacks of the
        client, which run under the client's lock and only set flags.
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
        self._journal = NO_JOURNAL if frame is None else frame.run.journal
        self._ending = current_shutdown()
        self._kept: set[str] = set()  # of "taken" and "begun" what is in the journal
        self._kept_result: Any = None
        self._handle: ClientGoalHandle | None = None
        self._sent_at = 0.0
        self._lock = threading.Lock()  # guards `run` and the timer
        self._inside = False  # the state's thread is in the user's code, or about to be
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

    @property
    def lost_link(self) -> str:
        """See the class."""
        return self._client.manager.port.lost_link

    def send(
        self, goal: Any, *, ack_timeout: float | None, cancel_on_client_lost: bool = False
    ) -> None:
        """Send `goal`; it is LOST if no server acknowledges it within `ack_timeout` [s].

        With `cancel_on_client_lost` the server cancels it if this process dies.

        Raises:
            ActionException, FieldError: the goal is not of the action's type.
            TypeMismatchError: the server is of another type.
            TransportError: the node is closed.
        """
        handle = self._client.make_goal(
            goal, ack_timeout, cancel_on_client_lost=cancel_on_client_lost
        )
        if self._frame is not None:
            self._journal.goal_sent(self._frame, self._client.ns, handle.goal.id)
        self._begin(handle, goal)

    def adopt(self, kept: Any, *, ack_timeout: float | None) -> None:
        """Follow a goal that an earlier process has sent.

        Args:
            kept: Its record in the journal.
            ack_timeout: It is LOST if no server knows it within this time [s].
        """
        self.adopted = True
        if kept["taken_ns"] is not None:
            self._kept.add("taken")
        begun_ns = kept.get("begun_ns", kept["taken_ns"])  # old journals do not have it
        if begun_ns is not None:
            # `exec_timeout` counts from the acceptance, the outage included. The journal has wall
            # time, because the monotonic clock of another process means nothing here.
            clock = self._wake.clock
            self.run.on_begun(clock.now() - max(0.0, (clock.time_ns() - begun_ns) / 1e9))
            self._kept.add("begun")
        if kept["status"]:  # it had ended before the outage
            self.goal_id = kept["id"]
            if self._preempt_requested():
                self.run.on_preempt()
            self.run.on_end(kept["status"], kept["text"])
            self._kept_result = kept["result"]
            return
        self._begin(self._client.find_goal(kept["id"], ack_timeout), None)

    def _begin(self, handle: ClientGoalHandle, goal: Any) -> None:
        self._handle = handle
        self._sent_at = self._wake.clock.now()
        handle.keeps_result = self._journal.is_durable
        handle.on_state = self._note_state
        handle.on_feedback = self._note_feedback
        handle.wants_feedback = self._wants_feedback
        if not self._journal.is_durable:  # else the next process follows the goal
            self._ending.cancels.add(self.cancel)
            if self._ending.is_last:
                self.cancel()  # the process is about to end: the goal is not sent
        handle.manager.begin(handle)
        self.goal_id = handle.goal.id
        self._inside = True
        self._act()
        self._emit(GoalSent, self.goal_id, goal)
        self._inside = False

    def call_off(self, goal_id: str) -> None:
        """Let the server recall a goal that it does not know, in case it still arrives."""
        self._client.manager.port.send_cancel(goal_id, 0)

    def follow(self, on_feedback: Callable[[Any], object]) -> None:
        """Wait until the goal has ended or is abandoned.

        Args:
            on_feedback: Called with each feedback message, in this thread. If it raises, the goal
                is cancelled, and the exception is raised after its end. Messages that are still
                waiting a short time after the end are dropped and reported.

        Blocks: until then; after a preempt or `exec_timeout`, at most `preempt_timeout` and the
            current call of `on_feedback`.
        """
        handle = self._handle
        assert handle is not None
        failure: Exception | None = None
        while True:
            self._wake.clear()
            # Read before the feedback: if the goal is over, all its feedback has arrived.
            over = handle.goal.over
            feedback = handle.take_feedback()
            # Set before `_act`: what becomes due after that is done by `hurry` in another thread.
            self._inside = feedback is not None
            step = self._act()
            self._keep_progress(handle)
            if step is not GoalDuty.WAIT:
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
                except Exception as error:  # noqa: BLE001  raised below, after the goal's end
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

    def _keep_progress(self, handle: ClientGoalHandle) -> None:
        """Write to the journal, once each, that a server has the goal and that it has begun it."""
        if self._frame is None:
            return
        begun = handle.goal.begun
        if begun and "begun" not in self._kept:
            self._kept |= {"taken", "begun"}
        elif handle.goal.acknowledged and not self._kept:
            self._kept.add("taken")
        else:
            return
        self._journal.goal_taken(self._frame, self.goal_id, begun=begun)

    def _keep_end(self, handle: ClientGoalHandle) -> None:
        """Write the goal's end to the journal; only then acknowledge it to the server.

        If this process ends in between, the next one gets the result from the server again.
        """
        run = self.run
        # Of an unanswered one, a resumed process must decide again what to do about it.
        kept = self._frame is not None and not (run.status == "LOST" and self.unanswered)
        if self._frame is not None and kept:
            facts = (self.goal_id, run.status, run.text, self.result)
            self._journal.goal_done(self._frame, *facts, preempted=run.preempted)
        handle.keeps_result = False  # from now on, it is acknowledged whenever it comes
        if kept and handle.goal.over and run.status != "LOST":
            handle.acknowledge()

    def cancel(self) -> None:
        """Cancel the goal, if it was sent and has not ended."""
        handle = self._handle
        if handle is not None and not handle.goal.over:
            handle.cancel()

    def close(self) -> None:
        """Stop other threads from acting for the state."""
        self._ending.cancels.discard(self.cancel)
        self._inside = False
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()

    def hurry(self) -> None:
        """Do what is due although the state's thread is in the user's code.

        Threads: any, also in a signal handler; never waits.
        """
        # In another thread: the caller may hold the run's lock, or have interrupted a lock's
        # holder.
        if self._inside:
            clock = self._wake.clock
            try:
                clock.spawn(self._act_if_busy, name=f"goal of {self._client.ns}")
            except RuntimeError:  # the system has no thread left: that of the timers does it
                clock.call_later(0.0, self._act_if_busy)

    def _act_if_busy(self) -> None:
        if self._inside:
            self._act()

    def _act(self) -> GoalDuty:
        """Do what is due, set a timer for what will be, and return the last step."""
        handle = self._handle
        assert handle is not None
        clock = self._wake.clock
        with self._lock:
            if self._preempt_requested():
                self.run.on_preempt(is_taken_over=self._journal.is_taken_over)
            if handle.goal.begun:
                self.run.on_begun(clock.now())
            elif handle.goal.acknowledged:
                self.run.on_acknowledged(self._sent_at)
            if handle.goal.over and not self.run.status:
                step = GoalDuty.WAIT  # `follow` handles the rest of the feedback first
            else:
                step = self.run.step(clock.now())
            if step is GoalDuty.CANCEL:
                handle.cancel()
                step = self.run.step(clock.now())
            if step is GoalDuty.ABANDON:
                handle.manager.forget(handle)
            late = self._inside and not self.run.left(clock.now())
            due = self.run.deadline
            if self._inside and due is not None and due != self._timer_due:
                if self._timer is not None:
                    self._timer.cancel()
                self._timer = clock.call_later(due - clock.now(), self.hurry)
                self._timer_due = due
        if late and self._on_late is not None:  # takes the run's lock, so not under this one
            self._on_late()
        return step

    def _note_state(self, _state: CommState) -> None:
        self._wake.set()
        self.hurry()  # `exec_timeout` begins when a server has accepted the goal

    def _note_feedback(self) -> None:
        scope = self._scope
        watched = scope is not None and scope.is_watched
        if self._wants_feedback or watched:
            self._wake.set()
        elif self._handle is not None:
            self._handle.take_feedback()  # nobody needs it

    def _emit(self, kind: Any, *fields: Any) -> None:
        if self._scope is not None:
            self._scope.emit(kind, self._client.ns, *fields)
