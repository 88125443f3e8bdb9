"""`SimpleActionClient`: one goal at a time, seen in three states."""

from __future__ import annotations

import logging
import threading
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core.action.client import ActionClient
from actionlib_core.goal.client import STATUS_LIST_TIMEOUT_S
from actionlib_core.goal.states import OVER, STARTED, CommState, SimpleGoalState, Status
from actionlib_core.inputs.arguments import check_functions, check_limit, check_wait

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.action.client_goal_handle import ClientGoalHandle
    from actionlib_core.node import Node
    from actionlib_core.time import Duration, Time

__all__ = ["SimpleActionClient", "SimpleGoalState"]

A_co = TypeVar("A_co", covariant=True)
G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")
log = logging.getLogger(__name__)

_SHOWN = {
    CommState.WAITING_FOR_GOAL_ACK: Status.PENDING,
    CommState.PENDING: Status.PENDING,
    CommState.RECALLING: Status.PENDING,
    CommState.ACTIVE: Status.ACTIVE,
    CommState.PREEMPTING: Status.ACTIVE,
}


class SimpleActionClient(Generic[A_co]):
    """Sends one goal at a time and waits for it.

    For programs with actionlib's names; others: docs/howto/which_way.md.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        node: The client's node; None: the current node.
        server_lost_timeout: How long the server may be away before the goal is LOST [s].
        status_list_timeout: How long a server without a token may be silent [s]; see
            `ActionClient`.

    Attributes:
        action_client: The `ActionClient` beneath.

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: one of the timeouts is not a duration, negative or infinite.
        InvalidNameError: the name breaks the ROS rules.
        TransportError: the network session is closed.

    Threads: every method may be called from any thread and any callback, those of this client
        included. Callbacks run one at a time, in the order active, feedback, done, on a thread of
        their own, without any lock.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: type[A_co],  # noqa: N803  actionlib's name
        *,
        node: Node | None = None,
        server_lost_timeout: float | Duration = 0.0,
        status_list_timeout: float | Duration = STATUS_LIST_TIMEOUT_S,
    ) -> None:
        self.action_client: ActionClient[A_co] = ActionClient(
            ns,
            ActionSpec,
            node=node,
            server_lost_timeout=server_lost_timeout,
            status_list_timeout=status_list_timeout,
        )
        self._handle: ClientGoalHandle | None = None
        self._condition: threading.Condition | None = None  # made when a program asks for it

    # -- actionlib's attributes ----------------------------------------------------------------

    @property
    def gh(self) -> ClientGoalHandle | None:
        """The handle of the goal that is followed."""
        return self._handle

    @property
    def simple_state(self) -> SimpleGoalState:
        """PENDING, ACTIVE or DONE; DONE also when no goal was sent."""
        handle = self._handle
        if handle is None or handle.goal.over:
            return SimpleGoalState.DONE
        begun = handle.goal.begun
        return SimpleGoalState.ACTIVE if begun else SimpleGoalState.PENDING

    @property
    def done_condition(self) -> threading.Condition:
        """A condition that is notified when a goal is over. `wait_for_result` is the better way."""
        if self._condition is None:
            self._condition = threading.Condition()
            handle = self._handle
            if handle is not None and handle.on_state is None:
                # The goal was sent when there was no condition to notify. It may be ending now, so
                # this is decided under the lock.
                with handle.manager.lock:
                    if not (handle.goal.over or handle.settled):
                        handle.calls_back = True
                        handle.on_state = self._make_on_state(handle)
        return self._condition

    # -- the server ----------------------------------------------------------------------------

    def wait_for_server(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the action has a server.

        Args:
            timeout: Longest wait [s]; 0 and None wait for ever, as in actionlib.

        Returns:
            Whether there is one; False also when the client was stopped or, without a limit, when
            shutdown is requested (`actionlib_core.shutdown`).

        Raises:
            TypeMismatchError: there is one, but of another type.

        Blocks: until then.
        """
        return self.action_client.wait_for_server(timeout)

    def stop(self) -> None:
        """Withdraw from the network. A running goal goes on at the server; here it is LOST.

        A server with `on_client_lost="cancel"` cancels it, unless this session has another client
        of the action.
        """
        self.action_client.stop()

    # -- goals ---------------------------------------------------------------------------------

    def send_goal(
        self: SimpleActionClient[Spec[G, R, F]],
        goal: G,
        done_cb: Callable[[int, R | None], object] | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: Callable[[F], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
        cancel_on_client_lost: bool = False,
    ) -> None:
        """Send a goal; the previous goal is no longer followed, but is not cancelled.

        If this raises an error, the previous goal is still followed.

        Args:
            goal: The goal message (XGoal).
            done_cb: Called with the terminal status (`GoalStatus`) and the result message; the
                result is None when the goal is LOST. It may send the next goal.
            active_cb: Called when the goal starts to run.
            feedback_cb: Called with each XFeedback message. When it is too slow, up to 100,000
                messages of together 32 MiB wait for it, then the oldest are dropped. Once the goal
                is over, a call that takes longer than 0.5 s is the last one. Dropped messages are
                logged and counted in `dropped_feedback`.
            ack_timeout: Time within which a server must take the goal [s], else it is LOST. None:
                no limit; 0: it is LOST at once.
            cancel_on_client_lost: See `ActionClient.send_goal`.

        Raises:
            ActionException: `goal` is not of the action's type.
            ActionlibError: `ack_timeout` is not a duration, or negative.
            FieldError: a field of `goal` has a wrong type.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        self._begin(
            self.action_client.make_goal,
            goal,
            done_cb,
            active_cb,
            feedback_cb,
            ack_timeout,
            cancel_on_client_lost=cancel_on_client_lost,
        )

    def attach(
        self: SimpleActionClient[Spec[G, R, F]],
        goal_id: str,
        done_cb: Callable[[int, R | None], object] | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: Callable[[F], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
    ) -> None:
        """Follow a goal by its id: one sent before a restart, or no longer followed.

        It replaces the previous goal as in `send_goal`, which also describes the other arguments;
        see `ActionClient.attach`.
        """
        find = self.action_client.find_goal
        self._begin(find, goal_id, done_cb, active_cb, feedback_cb, ack_timeout)

    def _begin(
        self,
        make: Callable[..., ClientGoalHandle],
        goal: Any,
        done_cb: Callable[[int, Any], object] | None,
        active_cb: Callable[[], object] | None,
        feedback_cb: Callable[[Any], object] | None,
        ack_timeout: float | Duration | None,
        **options: bool,
    ) -> ClientGoalHandle:
        """Send a goal, or query the server for it, and follow it instead of the previous one."""
        where = f"action '{self.action_client.ns}'"
        if done_cb is not None or active_cb is not None or feedback_cb is not None:
            check_functions(where, done_cb=done_cb, active_cb=active_cb, feedback_cb=feedback_cb)
        limit = None if ack_timeout is None else check_limit(where, "ack_timeout", ack_timeout)
        handle = make(goal, limit, **options)
        # Without callbacks, no thread is needed for them: the network's thread wakes the waiters.
        if done_cb is not None or active_cb is not None or self._condition is not None:
            handle.on_state = self._make_on_state(handle, done_cb, active_cb)
        if feedback_cb is not None:
            handle.on_feedback = partial(handle.call_with_feedback, feedback_cb)
        handle.calls_back = handle.on_state is not None or feedback_cb is not None
        # Set before sending: a callback may come at once and must see its own goal.
        former, self._handle = self._handle, handle
        try:
            handle.owner.manager.begin(handle)
            # Only now: if sending has raised an error, the previous goal is still followed.
            if former is not None and not former.goal.over:
                former.manager.forget(former)
        except BaseException:  # for example Ctrl-C: the goal may be at the server already
            if self._handle is handle:
                self._handle = former
            handle.manager.give_up(handle)
            raise
        return handle

    def _make_on_state(
        self,
        handle: ClientGoalHandle,
        done_cb: Callable[[int, Any], object] | None = None,
        active_cb: Callable[[], object] | None = None,
    ) -> Callable[[CommState], object]:
        def on_state(state: CommState) -> None:  # under the manager's lock
            nonlocal active_cb
            if state in STARTED and active_cb is not None:
                handle.call(state, active_cb)
                active_cb = None  # once
            elif state in OVER:
                if done_cb is not None:
                    handle.call(state, done_cb, int(handle.goal.status), handle.goal.result)
                handle.owner.callbacks.call(self._settle, handle)

        return on_state

    def _settle(self, handle: ClientGoalHandle) -> None:
        """Mark a goal as settled: its last callback has returned."""
        handle.settle()
        if self._condition is not None:
            with self._condition:
                self._condition.notify_all()

    def send_goal_and_wait(
        self: SimpleActionClient[Spec[G, R, F]],
        goal: G,
        execute_timeout: float | Duration = 0.0,
        preempt_timeout: float | Duration = 0.0,
    ) -> int:
        """Send a goal and wait for its end; after `execute_timeout`, cancel it and wait again.

        Args:
            goal: The goal message (XGoal).
            execute_timeout: Longest run [s]; 0 or a negative time: no limit.
            preempt_timeout: Longest wait for the end after the cancel [s]; likewise.

        Returns:
            The status (`GoalStatus`); not a final one when `preempt_timeout` was too short, or
            when another goal was sent meanwhile or `stop_tracking_goal` called: the wait then ends
            and nothing is cancelled.

        What interrupts the wait, such as Ctrl-C, cancels the goal.

        Blocks: until the goal is over or both times have passed.
        """
        # Both are checked first: a wrong argument must not leave a robot moving.
        execute = self._check_wait("execute_timeout", execute_timeout)
        preempt = self._check_wait("preempt_timeout", preempt_timeout)
        # This goal, not the client's: another thread may already have sent the next one.
        handle = self._begin(self.action_client.make_goal, goal, None, None, None, None)
        try:
            # It also ends when another thread has sent the next goal: that one is not cancelled.
            if not self._wait(handle, execute) and not handle.forgotten:
                handle.cancel()
                self._wait(handle, preempt)
        except BaseException:  # for example Ctrl-C
            if not handle.forgotten:
                handle.cancel()
            raise
        return self._state_of(handle)

    def wait_for_result(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the goal is over and `done_cb` has returned.

        Called from a callback of this client, it does not wait for callbacks. Otherwise it gives
        callbacks other than `done_cb` 1 s after the goal's end to return.

        Args:
            timeout: Longest wait [s]. 0 and None: no limit, as in actionlib; the wait ends with the
                goal, with its server's death or with the client's `stop`. A requested shutdown does
                not end it, since the goal runs on: use `shutdown.on_shutdown(cancel_goal)`. A
                negative time is no limit either, as in actionlib, but is logged as a warning: it is
                usually a mistake, such as the rest of a time that is already over.

        Returns:
            Whether the goal is over; False also when no goal was sent, or when during the wait
            another one is sent or `stop_tracking_goal` called.

        Raises:
            InvalidDurationError: `timeout` is not a duration.

        Blocks: until then.
        """
        limit = self._check_wait("timeout", timeout)
        handle = self._handle
        if handle is None:
            return False
        return self._wait(handle, limit)

    def _wait(self, handle: ClientGoalHandle, limit: float | None) -> bool:
        """Wait for the end of a goal [s]; return whether it is over."""
        return handle.owner.manager.wait(handle, limit)

    def _check_wait(self, argument: str, timeout: float | Duration | None) -> float | None:
        """Return the limit of a wait for a goal's end; warn of a negative one, as of a mistake."""
        if isinstance(timeout, float) and timeout == 0.0:  # the default: spares the checks
            return None
        where = f"action '{self.action_client.ns}'"
        limit = check_wait(where, argument, timeout)
        if limit != 0.0:
            return limit
        log.warning(
            "%s: %s: got %s, which is negative; waiting for the goal's end without a limit.",
            where,
            argument,
            timeout,
        )
        return None

    def get_result(self: SimpleActionClient[Spec[G, R, F]]) -> R | None:
        """Return the result message, None while there is none."""
        handle = self.gh
        result: R | None = None if handle is None else handle.get_result()
        return result

    @property
    def dropped_feedback(self) -> int:
        """Number of feedback messages dropped because `feedback_cb` was too slow."""
        handle = self.gh
        return 0 if handle is None else handle.dropped_feedback

    def get_state(self) -> int:
        """Return the goal's status (`GoalStatus`).

        RECALLING is shown as PENDING, PREEMPTING as ACTIVE, no goal as LOST. While the answer to a
        cancel is awaited, it is the last status from the server.
        """
        return self._state_of(self._handle)

    def _state_of(self, handle: ClientGoalHandle | None) -> int:
        if handle is None:
            return int(Status.LOST)
        shown = _SHOWN.get(handle.get_comm_state())
        if shown is not None:
            return int(shown)
        status = handle.get_goal_status()
        if status == Status.PREEMPTING:
            return int(Status.ACTIVE)
        return int(Status.PENDING) if status == Status.RECALLING else status

    def get_goal_status_text(self) -> str:
        """Return the text of the last status, or why the goal is lost."""
        handle = self.gh
        return "" if handle is None else handle.get_goal_status_text()

    def cancel_all_goals(self) -> None:
        """Ask the server to cancel all goals, also those of other clients."""
        self.action_client.cancel_all_goals()

    def cancel_goals_at_and_before_time(self, time: Time | float) -> None:
        """Ask the server to cancel the goals of all clients with a stamp at or before `time`.

        Args:
            time: A `Time`, or seconds since the epoch. 0 means all goals, as in ROS.
        """
        self.action_client.cancel_goals_at_and_before_time(time)

    def cancel_goal(self) -> None:
        """Cancel the goal; no effect without a goal."""
        handle = self.gh
        if handle is not None:
            handle.cancel()

    def stop_tracking_goal(self) -> None:
        """Stop following the goal, which is not cancelled. Queued callbacks may still run."""
        handle, self._handle = self._handle, None
        if handle is not None:
            handle.manager.forget(handle)
