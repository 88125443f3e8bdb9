"""`ActionServer`: any number of goals at once, each accepted, refused and ended by your code."""

from __future__ import annotations

import contextlib
import logging
import threading
from typing import TYPE_CHECKING, Any, Literal

from actionlib_core._action_wire import (
    ActionTypes,
    StatusEntry,
    pack_goal,
    pack_report,
    pack_status,
    pack_statuses,
)
from actionlib_core._arguments import check_function, check_seconds
from actionlib_core._callbacks import CallbackQueue
from actionlib_core._core.server_goals import RESULT_TIMEOUT_S, Arrival, ServerGoal, ServerGoals
from actionlib_core._core.states import TERMINAL, Status
from actionlib_core._server_port import ServerPort
from actionlib_core._status_publisher import StatusPublisher
from actionlib_core.exceptions import (
    ActionException,
    IllegalTransitionError,
    ServerConflictError,
    TransportError,
)
from actionlib_core.goal_id_generator import GoalIDGenerator
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus, GoalStatusArray
from actionlib_core.node import get_node
from actionlib_core.server_goal_handle import ServerGoalHandle
from actionlib_core.status_tracker import (
    StatusTracker,
    entry_of,
    entry_of_status,
    text_of_past,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Event
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

log = logging.getLogger(__name__)

DRAIN_S = 0.7  # how long `stop` waits for acknowledgements; less as one of many on a node
FAREWELL_S = 0.1  # it says farewell again after so long

ACCEPTED = frozenset({Status.ACTIVE, Status.PREEMPTING})

TEXT_STOPPED = "The action server was stopped"
TEXT_CLIENT_LOST = "The client that sent this goal is gone"

OnClientLost = Literal["continue", "cancel"]


def nop_cb(goal_handle: ServerGoalHandle) -> None:
    """Do nothing; the default callback."""


class ActionServer:
    """Offers an action; every goal is a `ServerGoalHandle` that your callbacks accept and end.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        goal_cb: Called with the handle of each new goal; it or later code accepts or rejects it.
        cancel_cb: Called with the handle of each goal that is asked to stop.
        auto_start: Start at once. With False, call `start` when everything is ready.
        node: Where; the current node when None.
        on_client_lost: What happens to the goals of a client that died: "continue" as in ROS, or
            "cancel", as if the client had cancelled them.
        result_timeout: How long a result waits for a client that lost its link [s]; 0 or more.

    Attributes:
        lock: Guards the server's data. Holding it keeps goals as they are; never wait with it.
        error: Why the server stopped by itself, None while all is well.

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: a callback is no function, or `result_timeout` no length of time.
        InvalidNameError: the name breaks the ROS rules.
        ServerConflictError: the name has a server already (from `start`).
        TransportError: the network session is closed.

    Threads: callbacks run one at a time, in order, on a thread of their own, without any lock.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: Any,  # noqa: N803  actionlib's name
        goal_cb: Callable[[ServerGoalHandle], object] = nop_cb,
        cancel_cb: Callable[[ServerGoalHandle], object] = nop_cb,
        auto_start: bool = True,
        *,
        node: Node | None = None,
        on_client_lost: OnClientLost = "continue",
        result_timeout: float | Duration = RESULT_TIMEOUT_S,
    ) -> None:
        if on_client_lost not in {"continue", "cancel"}:
            raise ActionException(
                f"action {ns!r}: on_client_lost: got {on_client_lost!r}; "
                "expected 'continue' or 'cancel'."
            )
        check_function(f"action {ns!r}", "goal_cb", goal_cb)
        check_function(f"action {ns!r}", "cancel_cb", cancel_cb)
        keep = check_seconds(f"action {ns!r}", "result_timeout", result_timeout)
        self.node = node if node is not None else get_node()
        self.types = ActionTypes.of(ActionSpec)
        self.ns = self.node.resolve(ns, "action name")
        self.lock = threading.RLock()
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.error: ServerConflictError | None = None
        self._on_client_lost = on_client_lost
        self._clock = self.node.clock
        self._goals = ServerGoals(self.ns, result_timeout=keep)
        self._ids = GoalIDGenerator(f"/{self.node.full_name}", clock=self._clock)
        self._port = ServerPort(self.node, self.ns, self.types, self)
        self.callback_queue = CallbackQueue(self.node, f"{self.ns} callbacks")
        self._forget: Callable[[], None] | None = None
        self._started = False
        self._stopped = False
        self._drained: Event | None = None
        self._left = self._clock.event(f"the end of action server {self.ns}")
        self._status = StatusPublisher(self._clock, self.lock, self._goals, self._send_status)
        if auto_start:
            self.start()

    def start(self) -> None:
        """Offer the action; a second call does nothing.

        Raises:
            ServerConflictError: the name has a server already.
            TransportError: the network session is closed.
            ActionException: the server was stopped.

        Blocks: until the network has said who has the name, 1 s at most.
        """
        with self.lock:
            if self._stopped:
                raise ActionException(
                    f"action '{self.ns}': start(): the server was stopped; expected one that was "
                    "not. Try making a new one."
                )
            if self._started:
                return
            self._started = True
        self._forget = self.node.on_close(self.stop)
        try:
            self.initialize()
        except BaseException:
            self._forget()
            self._started = False
            raise

    def initialize(self) -> None:
        """Declare the action's keys; `start` does it."""
        self._port.open()

    def stop(self) -> None:
        """End all goals (ABORTED, or REJECTED when not yet accepted) and leave the name.

        Clients see the result of each goal, then the server's absence; what they sent too late goes
        to the next server. A second call does nothing, nor does one before `start`. A server that
        was stopped is not started again.

        Blocks: until the clients have heard all that, `DRAIN_S` at most.
        """
        with self.lock:
            if self._stopped or not self._started:
                return
            self._goals.close()
            open_goals = [goal for goal in self._goals.listed() if goal.status not in TERMINAL]
        try:
            for goal in open_goals:
                if goal.arrived and isinstance(goal.tag, StatusTracker):
                    self.give_up(goal.tag, TEXT_STOPPED)
            self._say_farewell()
        finally:
            self._leave()

    def close_to_goals(self) -> None:
        """Take no more goals, what comes from now on is for the next server; not for users."""
        with self.lock:
            self._goals.close()

    def _say_farewell(self) -> None:
        """Name the goals that were ever taken, so that clients know which were not.

        Stays until they have that and the results: the end of the token may overtake them.
        """
        now = self._clock.now()
        with self.lock:
            drained = self._drained = self._clock.event("clients that take their results")
            taken = [
                StatusEntry(goal_id, 0, status, text_of_past(status))
                if goal is None
                else entry_of(goal)
                for goal_id, status, goal in self._goals.taken()
            ]
        until = now + self.node.time_to_leave(DRAIN_S)
        with contextlib.suppress(TransportError):  # the session is closed: nobody can be told
            listened = self._port.begin_farewell()
            while listened:
                self._port.send_farewell(self._clock.time_ns(), taken)
                left = until - self._clock.now()
                if self._is_drained() or left <= 0 or drained.wait(min(left, FAREWELL_S)):
                    return

    def _is_drained(self) -> bool:
        if not self._port.has_clients():
            return True
        with self.lock:
            return self._port.farewell_heard and not self._goals.has_unacknowledged()

    def _leave(self) -> None:
        with self.lock:
            self._stopped = True
            self._status.close()
        if self._forget is not None:
            self._forget()
        try:
            self._port.close()
        finally:
            self._left.set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has stopped; for programs that do nothing else.

        Returns:
            Whether it has stopped.

        Raises:
            ServerConflictError: it stopped because an older server has the name.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        left = self._left.wait(timeout)
        if self.error is not None:
            raise self.error
        return left

    @property
    def stopped(self) -> bool:
        """Whether the server has left its name."""
        return self._stopped

    @property
    def ActionSpec(self) -> Any:  # noqa: N802  actionlib's names
        """The action class."""
        return self.types.action

    @property
    def ActionGoal(self) -> Any:  # noqa: N802
        """The class XActionGoal."""
        return self.types.action_goal

    @property
    def ActionResult(self) -> Any:  # noqa: N802
        """The class XActionResult."""
        return self.types.action_result

    @property
    def ActionResultType(self) -> Any:  # noqa: N802
        """The class XResult."""
        return self.types.result

    @property
    def ActionFeedback(self) -> Any:  # noqa: N802
        """The class XActionFeedback."""
        return self.types.action_feedback

    @property
    def status_list(self) -> list[StatusTracker]:
        """The goals that the status list names now."""
        with self.lock:
            tags = [goal.tag for goal in self._goals.listed()]
        return [tag for tag in tags if isinstance(tag, StatusTracker)]

    def register_goal_callback(self, cb: Callable[[ServerGoalHandle], object] | None) -> None:
        """Replace the goal callback; None takes it away."""
        check_function(f"action '{self.ns}'", "cb", cb)
        self.goal_callback = cb if cb is not None else nop_cb

    def register_cancel_callback(
        self, cancel_cb: Callable[[ServerGoalHandle], object] | None
    ) -> None:
        """Replace the cancel callback; None takes it away."""
        check_function(f"action '{self.ns}'", "cancel_cb", cancel_cb)
        self.cancel_callback = cancel_cb if cancel_cb is not None else nop_cb

    def accept(self, tracker: StatusTracker, text: str = "") -> None:
        """Accept a goal; as `ServerGoalHandle.set_accepted`."""
        text = self._readable(text, "set_accepted()")
        with self.lock:
            self._goals.step(tracker.record, "accept", "set_accepted()", text)
        self._status.on_change()

    def request_cancel(self, tracker: StatusTracker) -> bool:
        """Mark a goal as asked to stop; see `ServerGoalHandle.set_cancel_requested`."""
        with self.lock:
            changed = self._goals.request_cancel(tracker.record)
        if changed:
            self._status.on_change()
        return changed

    def finish(self, tracker: StatusTracker, event: str, call: str, result: Any, text: str) -> None:
        """End a goal by an event of the server's table: move it, keep its result, send it.

        `call` is what the user called; a `result` of None sends one with default values.

        Raises:
            IllegalTransitionError: the goal's state does not allow it.
            ActionException: `result` is not of the action's type, or `text` is no text.
            FieldError: a field of `result` has a wrong type.
        """
        # Whatever can fail comes first: a goal that has ended must have a result.
        body = self._body(result, self.types.result, call)
        text = self._readable(text, call)
        record = tracker.record
        with self.lock:
            self._goals.step(record, event, call, text)
            payload = pack_report(self._clock.time_ns(), entry_of(record), body)
            record.result = payload
            self._goals.finish(record, self._clock.now())
            stopped = self._stopped
        if not stopped:
            self._port.send_result(payload)
            self._status.on_change()

    def release(self, tracker: StatusTracker) -> None:
        """Give up a goal that nobody will end; its client learns that it is LOST."""
        with self.lock:
            self._goals.release(tracker.record, self._clock.now())
        self._status.on_change()

    def publish_result(self, status: GoalStatus, result: Any) -> None:
        """Send a result under any status. Handles do it for you.

        Raises:
            FieldError: `result` does not fit the action.
        """
        body = self._body(result, self.types.result, "publish_result()")
        self._port.send_result(pack_report(self._clock.time_ns(), entry_of_status(status), body))

    def publish_feedback(self, status: GoalStatus, feedback: Any) -> None:
        """Send feedback for the goal that `status` names.

        Raises:
            FieldError: `feedback` does not fit the action.
        """
        body = self._body(feedback, self.types.feedback, "publish_feedback()")
        self._port.send_feedback(pack_report(self._clock.time_ns(), entry_of_status(status), body))

    def send_feedback(self, tracker: StatusTracker, feedback: Any) -> None:
        """Send feedback for a goal, without a status message in between."""
        body = self._body(feedback, self.types.feedback, "publish_feedback()")
        entry = entry_of(tracker.record)
        self._port.send_feedback(pack_report(self._clock.time_ns(), entry, body))

    def _body(self, message: Any, expected: Any, call: str) -> bytes:
        if message is None:
            message = expected()
        elif not isinstance(message, expected):
            raise ActionException(
                f"action '{self.ns}': {call}: got {message!r}; expected a message of type "
                f"{expected._type}."
            )
        body: bytes = message.to_bytes()
        return body

    def _readable(self, text: Any, call: str) -> str:
        """Return `text` as it can be sent; characters that UTF-8 does not have are escaped."""
        if not isinstance(text, str):
            raise ActionException(
                f"action '{self.ns}': {call}: text: got {text!r}; expected a string. Try str(...)."
            )
        return text if text.isascii() else text.encode("utf-8", "backslashreplace").decode()

    def _send_status(self, goals: list[ServerGoal]) -> None:
        entries = [entry_of(goal) for goal in goals]
        try:
            self._port.send_status(pack_statuses(self._clock.time_ns(), entries))
        except TransportError:
            if not self._goals.closed:  # else `stop` came in between
                raise

    # -- what arrives (on the network's thread) ------------------------------------------------

    def on_goal(self, goal_id: str, stamp_ns: int, content: Any, client: str) -> None:
        """Take a goal from the network; not for users."""
        if not goal_id:
            goal_id, stamp_ns = self._ids.generate()
        record = ServerGoal(goal_id, stamp_ns or self._clock.time_ns(), client=client)
        with self.lock:
            if self._stopped:
                return
            arrival, known = self._goals.on_goal(record, self._clock.now())
            if arrival is Arrival.LATE:
                return
            tracker = StatusTracker.arrived(record, content, self.types)
            if arrival is Arrival.RECALLED:
                empty = self.types.result().to_bytes()
                record.result = pack_report(self._clock.time_ns(), entry_of(record), empty)
        if arrival is Arrival.NEW:
            self._deliver_goal(ServerGoalHandle(tracker, self))
            return
        self._say_again(goal_id, known)

    def _say_again(self, goal_id: str, goal: ServerGoal | None) -> None:
        """Answer a copy of a known goal."""
        if goal is None:
            with self.lock:
                status = self._goals.past_status(goal_id) or Status.LOST
            entry = StatusEntry(goal_id, 0, status, text_of_past(status))
            self._port.send_status(pack_statuses(self._clock.time_ns(), [entry]))
        elif isinstance(goal.result, bytes):
            self._port.send_result(goal.result)
        self._status.on_change()

    def on_cancel(self, goal_id: str, stamp_ns: int) -> None:
        """Take a cancel from the network; not for users."""
        with self.lock:
            asked = self._goals.on_cancel(goal_id, stamp_ns, self._clock.now())
        self._tell_cancelled(asked)

    def on_client_lost(self, client: str) -> None:
        """Take the death of a client; not for users."""
        if self._on_client_lost == "continue":
            return
        with self.lock:
            asked = self._goals.on_client_lost(client)
            for goal in asked:
                goal.text = TEXT_CLIENT_LOST
        self._tell_cancelled(asked)

    def _tell_cancelled(self, asked: list[ServerGoal]) -> None:
        for goal in asked:
            if isinstance(goal.tag, StatusTracker):
                self._deliver_cancel(ServerGoalHandle(goal.tag, self))
        self._status.on_change()

    def on_acknowledged(self, goal_ids: list[str]) -> None:
        """Take acknowledgements from the network; not for users."""
        with self.lock:
            self._goals.on_acknowledged(goal_ids, self._clock.now())
            if self._drained is not None and self._is_drained():
                self._drained.set()

    def on_question(self, goal_id: str) -> tuple[Any, bytes]:
        """Answer what became of a goal, or of all; not for users."""
        with self.lock:
            if not goal_id:
                entries = [entry_of(goal) for goal in self._goals.listed()]
                return GoalStatusArray, pack_statuses(self._clock.time_ns(), entries)
            goal = self._goals.find(goal_id)
            if goal is not None and isinstance(goal.result, bytes):
                return self.types.action_result, goal.result
            if goal is not None:
                return GoalStatus, pack_status(entry_of(goal))
            status = self._goals.past_status(goal_id) or Status.LOST
            return GoalStatus, pack_status(StatusEntry(goal_id, 0, status, text_of_past(status)))

    def on_goal_question(self, goal_id: str) -> bytes | None:
        """Answer what a goal was; not for users."""
        with self.lock:
            goal = self._goals.find(goal_id)
            if goal is None or not isinstance(goal.tag, StatusTracker):
                return None
            content = goal.tag.content
        return pack_goal(self._clock.time_ns(), goal.id, goal.stamp_ns, content.to_bytes())

    def on_conflict(self, error: ServerConflictError) -> None:
        """Leave the name to the older server; not for users."""
        with self.lock:
            if self.error is not None or self._stopped:
                return
            self.error = error
            self._goals.close()
        log.error("%s", error)
        self._leave()

    # Subclasses that only note what came need no thread for it.

    def _deliver_goal(self, handle: ServerGoalHandle) -> None:
        self.callback_queue.call(self._run_goal_callback, handle)
        self._status.on_change()

    def _run_goal_callback(self, handle: ServerGoalHandle) -> None:
        """Give a goal to the user's code; one that it raises on is ended, not forgotten."""
        try:
            self.goal_callback(handle)
        except Exception as error:
            self.give_up(handle.status_tracker, f"Exception in goal callback: {error}")
            raise
        except BaseException as error:  # `sys.exit`, which ends this thread
            self.give_up(handle.status_tracker, f"Exception in goal callback: {error!r}")
            raise

    def give_up(self, tracker: StatusTracker, text: str) -> None:
        """End a goal that its code has left without an end; one that has ended stays."""
        status = tracker.record.status
        if status not in TERMINAL:
            event = "abort" if status in ACCEPTED else "reject"
            try:
                self.finish(tracker, event, "the end of its callback", None, text)
            except IllegalTransitionError:
                return  # another thread has just ended it
            except TransportError:
                if not self._goals.closed:  # else the server stops after its session was closed
                    raise

    def _deliver_cancel(self, handle: ServerGoalHandle) -> None:
        self.callback_queue.call(self._run_cancel_callback, handle)

    def _run_cancel_callback(self, handle: ServerGoalHandle) -> None:
        """Tell the user's code of a cancel, unless the goal has ended since."""
        if handle.status_tracker.record.status not in TERMINAL:
            self.cancel_callback(handle)

    def hurry_status(self) -> None:
        """Send the list of all goals now if it has changed; not for users."""
        self._status.hurry()

    def publish_status(self) -> None:
        """Send the list of all goals now."""
        self._status.publish()

    def publish_status_async(self, event: object = None) -> None:  # noqa: ARG002  actionlib's
        """Send the list of all goals; the form that ROS timers call."""
        self.publish_status()
