"""`ClientGoalHandle`: a program's view of one goal that it has sent."""

from __future__ import annotations

import logging
import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionException
from actionlib_core.goal.bounded import Backlog
from actionlib_core.goal.states import OVER, CommState, TerminalState
from actionlib_core.inputs.arguments import check_delay

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.goal_manager import GoalManager, Owner
    from actionlib_core.clock import Event
    from actionlib_core.goal.client import ClientGoal

log = logging.getLogger(__name__)

FEEDBACK_S = 0.5  # a feedback callback slower than this after the goal's end is the last one


@dataclass(slots=True, weakref_slot=True, eq=False, repr=False)
class ClientGoalHandle:
    """A program's handle for one goal. Two handles are equal when they belong to the same goal.

    Dropping the handle changes nothing: the goal is followed until it is over. ROS's attribute
    `comm_state_machine` is the handle itself.

    Attributes:
        owner: The client that follows it.
        goal: The goal's life cycle.
        body: The packed goal message.
        on_state: Called under the manager's lock with each state passed; must not block.
        on_feedback: The same, for feedback; None when no feedback is wanted.
        feedback: Feedback that was not taken yet, None before the first; guarded by the manager's
            lock.
        wants_feedback: Feedback reaches code of the program; else it is only shown.
        cancel_if_lost: The server is to cancel the goal when this client dies.
        keeps_result: The server is to keep the result until `acknowledge` is called.
        calls_back: The goal has callbacks, which `wait` waits for.
        settled: The goal is over and its last callback has returned, or it is no longer followed.
        ended_at: When the goal ended [s, clock]; None before.
        last_call: The callback that reports the goal's end has started.
        asking: A query about the goal is pending.
        look_at: When the manager's timer looks at the goal [s, clock].
        sender: What `resources.note_sender` returned for the goal.

    Threads: every method may be called from any thread and any callback.
    """

    owner: Owner
    goal: ClientGoal
    body: bytes = b""
    on_state: Callable[[CommState], object] | None = None
    on_feedback: Callable[[], object] | None = None
    feedback: Backlog[Any] | None = None
    wants_feedback: bool = True
    cancel_if_lost: bool = False
    keeps_result: bool = False
    calls_back: bool = False
    settled: bool = False
    ended_at: float | None = None
    last_call: bool = False
    asking: bool = False
    look_at: float = math.inf
    sender: object = None
    # Made by the first thread that waits: most goals need neither of them.
    _ended: Event | None = None
    _settled: Event | None = None
    # During a transition callback: the state that it reports, and the callback's thread. Other
    # threads see the goal's present state.
    _shown: CommState | None = None
    _shown_to: int = 0

    @property
    def manager(self) -> GoalManager:
        """The goals of all clients of the action."""
        return self.owner.manager

    # -- for programs --------------------------------------------------------------------------

    def cancel(self) -> None:
        """Cancel the goal; the server's answer comes as a transition. No effect after its end."""
        self.manager.cancel(self)

    def get_comm_state(self) -> CommState:
        """Return the goal's state; in a transition callback, the state that it reports."""
        if self._shown is not None and self._shown_to == threading.get_ident():
            return self._shown
        return self.goal.comm

    def get_goal_status(self) -> int:
        """Return the last status from the server (`GoalStatus`); LOST once the goal is lost."""
        return int(self.goal.status)

    def get_goal_status_text(self) -> str:
        """Return the text of the last status, or why the goal is lost."""
        return self.goal.text

    def get_result(self) -> Any:
        """Return the result message, None while there is none."""
        return self.goal.result

    def get_terminal_state(self) -> TerminalState:
        """Return how the goal ended.

        Raises:
            ActionException: it has not ended.
        """
        if not self.goal.over:
            raise ActionException(
                f"goal {self.goal.id} on '{self.manager.name}': get_terminal_state(): got "
                f"{self.goal.comm.name}; expected DONE or LOST. Try waiting for the result."
            )
        return TerminalState(self.goal.status)

    def get_goal_id(self) -> str:
        """Return the goal's id."""
        return self.goal.id

    @property
    def dropped_feedback(self) -> int:
        """Number of feedback messages dropped because the callback was too slow."""
        return 0 if self.feedback is None else self.feedback.dropped

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the goal is over and its last callback has returned.

        Called from a callback of this client, it does not wait for callbacks. Otherwise it gives
        them 1 s after the goal's end to return; only for the transition callback that reports the
        end it waits without this limit.

        Args:
            timeout: Longest wait [s]; None waits for ever (a server that dies ends the wait).

        Returns:
            Whether it is over; False also when it is no longer followed.

        Blocks: until then.
        """
        return self.manager.wait(self, check_delay(f"goal {self.goal.id}", "timeout", timeout))

    @property
    def comm_state_machine(self) -> ClientGoalHandle:
        """The handle itself, for programs that use ROS's attribute."""
        return self

    @property
    def state(self) -> CommState:
        """Where the goal is in its life at the client."""
        return self.get_comm_state()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ClientGoalHandle):
            return NotImplemented
        return self.goal is other.goal

    def __hash__(self) -> int:
        return hash(self.goal.id)

    def __repr__(self) -> str:
        return f"<ClientGoalHandle {self.goal.id} {self.goal.comm.name} {self.goal.status.name}>"

    # -- for the client classes ----------------------------------------------------------------

    def acknowledge(self) -> None:
        """Let the server forget a result that it was to keep (`keeps_result`)."""
        self.manager.acknowledge(self.goal.id)

    @property
    def forgotten(self) -> bool:
        """Whether the goal still runs but is no longer followed."""
        return self.settled and not self.goal.over

    def note_ended(self) -> None:
        """Wake the threads that wait for the goal's end. Needs the manager's lock."""
        if self._ended is not None:
            self._ended.set()

    def settle(self) -> None:
        """Set `settled`, and wake the threads that wait for it."""
        with self.manager.lock:
            self.settled = True
            for event in (self._ended, self._settled):  # forgetting a goal ends both waits
                if event is not None:
                    event.set()

    def wait_ended(self, timeout: float | None) -> None:
        """Wait until the goal is over or no longer followed, `timeout` [s] at most."""
        with self.manager.lock:
            if self.goal.over or self.settled:
                return
            ended = self._ended = self._ended or self.manager.clock.event()
        ended.wait(timeout)

    def wait_settled(self, timeout: float | None) -> bool:
        """Wait until the goal is settled, `timeout` [s] at most; return whether it is."""
        manager = self.owner.manager
        with manager.lock:
            if self.settled:
                return True
            settled = self._settled = self._settled or manager.clock.event()
        return settled.wait(timeout)

    def call(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        """Queue a user callback in which `get_comm_state` returns `state`."""
        self.owner.callbacks.call(self._show, state, callback, *args)

    def _show(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        # The thread first: in the other order, another thread could read this state in between.
        self._shown_to, self._shown = threading.get_ident(), state
        self.last_call = state in OVER
        try:
            callback(*args)
        finally:
            self._shown = None

    def call_with_feedback(self, callback: Callable[[Any], object]) -> None:
        """Queue a user callback that is called with the next feedback."""
        self.owner.callbacks.call(self._deliver_feedback, callback)

    def _deliver_feedback(self, callback: Callable[[Any], object]) -> None:
        feedback = self.take_feedback()
        if feedback is not None:
            started = self.manager.clock.now()
            try:
                callback(feedback)
            finally:
                self.drop_feedback_after(started)

    def keep_feedback(self, feedback: Any, size: int) -> None:
        """Store feedback of `size` bytes until it is taken. Needs the manager's lock."""
        if self.on_feedback is None:  # the goal was forgotten while the feedback was decoded
            return
        if self.feedback is None:
            self.feedback = Backlog()
        dropped_before = self.feedback.dropped
        if self.feedback.add(feedback, size):
            self.on_feedback()
        elif not dropped_before:
            log.warning(
                "action '%s': the feedback of goal %s arrives faster than it is processed: of %d "
                "waiting messages, the oldest is dropped. Try a faster callback.",
                self.manager.name,
                self.goal.id,
                len(self.feedback),
            )

    def take_feedback(self) -> Any:
        """Remove and return the oldest feedback; None when there is none."""
        if self.feedback is None:  # the usual case of a goal without feedback, without the lock
            return None
        with self.manager.lock:
            return self.feedback.take()

    def drop_feedback_after(self, started: float, limit: float = FEEDBACK_S) -> None:
        """Drop the remaining feedback if the goal is over and a callback was too slow.

        It was too slow if it has taken longer than `limit` [s] since it `started` or, if that was
        later, since the goal's end. The done callback is queued behind the feedback, so it would
        come much too late. The dropped messages are counted and logged.
        """
        ended_at = self.ended_at
        if ended_at is None or self.manager.clock.now() < max(started, ended_at) + limit:
            return
        with self.manager.lock:
            dropped = 0 if self.feedback is None else self.feedback.drop_all()
        if dropped:
            log.warning(
                "action '%s': goal %s is over: its last %d feedback messages were dropped (%d in "
                "all), because the callback is too slow.",
                self.manager.name,
                self.goal.id,
                dropped,
                self.dropped_feedback,
            )


CommStateMachine = ClientGoalHandle
"""ROS's name for a client's record of one goal."""
