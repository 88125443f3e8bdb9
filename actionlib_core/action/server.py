"""`ActionServer`: any number of goals at once, each accepted, refused and ended by your code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.action.goal_keeper import GoalKeeper, OnClientLost
from actionlib_core.action.server_goal_handle import ServerGoalHandle
from actionlib_core.exceptions import ActionException, text_of
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.server import RESULT_TIMEOUT_S
from actionlib_core.goal.states import TERMINAL
from actionlib_core.inputs.arguments import check_delay, check_function, check_seconds
from actionlib_core.node import get_node
from actionlib_core.shutdown import exits_on_signals
from actionlib_core.wire.action_types import ActionTypes
from actionlib_core.wire.ports import make_server_port

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actionlib_core.exceptions import ServerConflictError
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

__all__ = ["ActionServer", "OnClientLost", "OnRestart", "ServerGoalHandle", "nop_cb"]

OnRestart = Literal["abort", "resume"]

STOP_GRACE_S = 0.4  # `stop` gives the code of goals this time to end what they have begun


def nop_cb(goal_handle: ServerGoalHandle) -> None:
    """Do nothing; the default callback."""


class ActionServer:
    """Offers an action; every goal is a `ServerGoalHandle` that your callbacks accept and end.

    For goals that run at the same time, or are accepted late; others: docs/howto/which_way.md.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        goal_cb: Called with the handle of each new goal, which it or later code accepts or rejects.
        cancel_cb: Called with the handle of each goal that is asked to stop.
        auto_start: Start at once. With False, call `start` when everything is ready.
        node: The server's node; None: the current node.
        on_client_lost: What happens to the goals of a client that died: "continue" as in ROS, or
            "cancel", as if the client had cancelled them.
        result_timeout: How long a result waits for a client that lost its link [s]; 0 or more.
        direct: The callbacks return at once and may be called on the network's thread.
        on_stopped: Called when the server has stopped by itself; must return at once too.
        durable: A file in which goals and results survive the end of the process; servers may share
            one. None: they are in memory only.
        on_restart: With `durable`, what happens to a goal that was accepted when the process was
            killed: "abort" ends it ABORTED, with the reason; "resume" calls `goal_cb` again, with a
            handle that is `resumed`. A goal that was not yet accepted is always treated as new.

    Attributes:
        lock: Guards the server's data. While it is held, no goal changes; do not block with it.
        keeper: The server's goals.

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: a callback is not a function, or `result_timeout` is not a duration.
        InvalidNameError: the name breaks the ROS rules.
        DurableGoalsError: the file cannot be used (from `start`).
        ServerConflictError: the name has a server already (from `start`).
        TransportError: the network session is closed.

    Threads: callbacks run one at a time, in order, on a thread of their own, without any lock. A
        cancel callback waits 20 ms at most for other callbacks to return, then it runs beside them,
        in another thread; it never starts before the goal callback of its goal.
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
        direct: bool = False,
        on_stopped: Callable[[], object] | None = None,
        durable: str | Path | None = None,
        on_restart: OnRestart = "abort",
    ) -> None:
        if on_restart not in {"abort", "resume"}:
            raise ActionException(
                f"action {ns!r}: on_restart: got {on_restart!r}; expected 'abort' or 'resume'."
            )
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
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.callback_queue = CallbackQueue(self.node, f"{self.ns} callbacks")
        self.keeper = GoalKeeper(
            self.node,
            self.ns,
            self.types,
            make_server_port(self.node, self.ns, self.types),
            on_client_lost=on_client_lost,
            result_timeout=keep,
            deliver_goal=goal_cb if direct else self._deliver_goal,
            deliver_cancel=cancel_cb if direct else self._deliver_cancel,
            on_stopped=self._note_stopped,
            durable=durable,
            resumes=on_restart == "resume",
        )
        self._on_stopped = on_stopped
        self._stopping = direct  # whether the goals were asked to stop; else the owner asks them
        self.lock = self.keeper.lock
        self._forget: Callable[[], None] | None = None
        self._started = False
        if auto_start:
            self.start()

    def start(self) -> None:
        """Offer the action; a second call does nothing.

        Raises:
            ServerConflictError: the name has a server already.
            TransportError: the network session is closed.
            ActionException: the server was stopped.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """
        with self.lock:
            if self.keeper.stopped:
                raise ActionException(
                    f"action '{self.ns}': start(): the server was stopped; expected one that was "
                    "not. Try making a new one."
                )
            if self._started:
                return
            self._started = True
        # Without the lock, as opening waits for the network.
        self._forget = self.node.on_close(self.stop)  # raises when the node is closed
        self.keeper.used = self.node.offer(f"action server '/{self.ns}'")
        try:
            self.initialize()
        except BaseException:
            self._forget()
            self._started = False
            raise

    def initialize(self) -> None:
        """Declare the action's keys; `start` does it."""
        try:
            kept = self.keeper.restore()
            self.keeper.port.open(self.keeper)
        except BaseException:
            self.keeper.close_file()
            raise
        self.keeper.settle(kept)  # after `open`, without which clients would not get its messages

    def stop(self) -> None:
        """Ask all goals to stop, end them (ABORTED, or REJECTED if not accepted), and withdraw.

        Clients receive the result of each goal, then the server's absence; goals that came too late
        are sent to the next server. A second call does nothing, nor does one before `start`. A
        stopped server cannot be started again.

        Blocks: until the cancel callbacks have returned, 0.4 s at most, and then until the clients
            have acknowledged the ends of all goals, 0.7 s at most.
        """
        with self.lock:
            if self.keeper.stopped or not self._started:
                return
        try:
            if self._ask_to_stop() and not self.callback_queue.is_inside():
                told = self.node.clock.event(f"the cancel callbacks of {self.ns}")
                self.callback_queue.call_urgently(told.set)
                told.wait(STOP_GRACE_S)
            self.keeper.stop()
        finally:
            if self._forget is not None:
                self._forget()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has stopped; for programs that do nothing else.

        Returns:
            Whether it has stopped.

        Raises:
            ServerConflictError: it stopped because an older server has the name.
            SystemExit: SIGTERM, SIGHUP or SIGQUIT has come in the main thread, and the program
                has no handler for it. The end of the program stops the server and its goal.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        self.keeper.used()
        limit = check_delay(f"action '{self.ns}'", "timeout", timeout)
        with exits_on_signals():
            left = self.keeper.left.wait(limit)
        if self.error is not None:
            raise self.error
        return left

    @property
    def error(self) -> ServerConflictError | None:
        """Why the server has stopped by itself; None: it has not."""
        return self.keeper.error

    @property
    def stopped(self) -> bool:
        """Whether the server has withdrawn from the network."""
        return self.keeper.stopped

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
    def status_list(self) -> list[ServerGoalHandle]:
        """The goals in the present status list."""
        with self.lock:
            tags = [goal.tag for goal in self.keeper.goals.listed()]
        return [tag for tag in tags if isinstance(tag, ServerGoalHandle)]

    def register_goal_callback(self, cb: Callable[[ServerGoalHandle], object] | None) -> None:
        """Replace the goal callback; None removes it."""
        check_function(f"action '{self.ns}'", "cb", cb)
        self.goal_callback = cb if cb is not None else nop_cb

    def register_cancel_callback(
        self, cancel_cb: Callable[[ServerGoalHandle], object] | None
    ) -> None:
        """Replace the cancel callback; None removes it."""
        check_function(f"action '{self.ns}'", "cancel_cb", cancel_cb)
        self.cancel_callback = cancel_cb if cancel_cb is not None else nop_cb

    def publish_result(self, status: GoalStatus, result: Any) -> None:
        """Send a result under any status. Usually a handle does this.

        Raises:
            FieldError: `result` does not fit the action.
        """
        self.keeper.send_result(_entry_of(status), result)

    def publish_feedback(self, status: GoalStatus, feedback: Any) -> None:
        """Send feedback for the goal in `status`.

        Raises:
            FieldError: `feedback` does not fit the action.
        """
        self.keeper.send_feedback(_entry_of(status), feedback)

    def publish_status(self) -> None:
        """Send the list of all goals now."""
        self.keeper.status.publish()

    def publish_status_async(self, event: object = None) -> None:  # noqa: ARG002  actionlib's
        """Send the list of all goals; the form that ROS timers call."""
        self.publish_status()

    # -- callbacks -----------------------------------------------------------------------------

    def _ask_to_stop(self) -> list[ServerGoalHandle]:
        """Ask all goals to stop, as no cancel will come any more; return those that were asked."""
        with self.lock:
            if self._stopping:
                return []
            self._stopping = True
        self.keeper.close_to_goals()
        asked = [handle for handle in self.status_list if self.keeper.request_cancel(handle)]
        for handle in asked:
            self._deliver_cancel(handle)
        return asked

    def _note_stopped(self) -> None:
        """Unregister from the node and notify the owner: the server has stopped by itself."""
        if self._forget is not None:
            self._forget()
        self._ask_to_stop()
        if self._on_stopped is not None:
            self._on_stopped()

    def _deliver_goal(self, handle: ServerGoalHandle) -> None:
        try:
            self.callback_queue.call(self._run_goal_callback, handle)
        except RuntimeError as error:  # no thread can be started, the system's limit
            self.keeper.give_up(handle, f"The goal cannot run: {error}")
        else:
            self.keeper.status.on_arrival()

    def _run_goal_callback(self, handle: ServerGoalHandle) -> None:
        """Call the goal callback, unless the goal has ended; if it raises, end the goal."""
        # Under the lock: a cancel came before this and waits, or will be delivered on its own.
        with self.lock:
            handle.begun = True
            cancelled = handle.cancel_waits
        if handle.record.status in TERMINAL:  # ended as its turn came too late
            return
        if cancelled:
            self.callback_queue.call_urgently(self._run_cancel_callback, handle)
        try:
            self.goal_callback(handle)
        except BaseException as error:  # also `sys.exit`, which ends this thread
            text = text_of(error, str if isinstance(error, Exception) else repr)
            self.keeper.give_up(handle, f"Exception in goal callback: {text}")
            raise

    def _deliver_cancel(self, handle: ServerGoalHandle) -> None:
        """Queue the cancel callback, at once or when the goal callback starts."""
        with self.lock:
            if not handle.begun:
                handle.cancel_waits = True
                return
        self.callback_queue.call_urgently(self._run_cancel_callback, handle)

    def _run_cancel_callback(self, handle: ServerGoalHandle) -> None:
        """Call the cancel callback, unless the goal has ended in the meantime."""
        if handle.record.status not in TERMINAL:
            self.cancel_callback(handle)


def _entry_of(status: GoalStatus) -> StatusEntry:
    """Return a status message as an entry of the status list."""
    goal_id = status.goal_id
    return StatusEntry(goal_id.id, goal_id.stamp.to_nsec(), status.status, status.text)
