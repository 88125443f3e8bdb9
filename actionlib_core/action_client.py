"""`ActionClient`: any number of goals at once, each followed through its handle."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core._action_wire import ActionTypes
from actionlib_core._arguments import check_function, check_limit, check_seconds
from actionlib_core._core.states import CommState, TerminalState
from actionlib_core.comm_state_machine import CommStateMachine
from actionlib_core.exceptions import ActionException
from actionlib_core.goal_id_generator import GoalIDGenerator
from actionlib_core.goal_manager import GoalManager
from actionlib_core.node import get_node
from actionlib_core.sent_goal import SentGoal
from actionlib_core.time import Time, to_seconds

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core._action_spec import ActionSpec as Spec
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

__all__ = [
    "FOR_EVER",
    "ActionClient",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalManager",
    "TerminalState",
    "get_name_of_constant",
    "to_timeout",
]

A_co = TypeVar("A_co", covariant=True)
G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")

FOR_EVER = 0.0
"""What actionlib's timeouts mean by zero."""


def get_name_of_constant(C: Any, n: int) -> str:  # noqa: N803  actionlib's name
    """Return the name of the constant of class `C` that has the value `n`.

    Args:
        C: For example `CommState`, `TerminalState` or `GoalStatus`.
        n: The value.

    Returns:
        The name, or "???" when there is none.
    """
    for name in dir(C):
        if not name.startswith("_") and isinstance(getattr(C, name), int) and getattr(C, name) == n:
            return name
    return "???"


def to_timeout(timeout: float | Duration | None) -> float | None:
    """Return a timeout in seconds by actionlib's rule: zero waits for ever, as None does."""
    seconds = to_seconds(timeout)
    return None if seconds is None or seconds == FOR_EVER else seconds


class ClientGoalHandle:
    """One goal as its client holds it. Two handles are equal when they are of one goal.

    Dropping the handle changes nothing: the goal is followed until it is over.

    Threads: every method may be called from any thread and any callback.
    """

    __slots__ = ("__weakref__", "comm_state_machine")

    def __init__(self, comm_state_machine: CommStateMachine) -> None:
        self.comm_state_machine = comm_state_machine

    def cancel(self) -> None:
        """Ask for the goal's end. The answer comes as a transition; a goal that is over stays."""
        self.comm_state_machine.manager.cancel(self.comm_state_machine)

    def get_comm_state(self) -> CommState:
        """Return where the goal stands; in a transition callback, the state it is called for."""
        return self.comm_state_machine.state

    def get_goal_status(self) -> int:
        """Return the last status the server gave (`GoalStatus`); LOST once the goal is lost."""
        return int(self.comm_state_machine.goal.status)

    def get_goal_status_text(self) -> str:
        """Return what the server said about the status, or why the goal is lost."""
        return self.comm_state_machine.goal.text

    def get_result(self) -> Any:
        """Return the result message, None while there is none."""
        return self.comm_state_machine.goal.result

    def get_terminal_state(self) -> TerminalState:
        """Return how the goal ended.

        Raises:
            ActionException: it has not ended.
        """
        machine = self.comm_state_machine
        if not machine.goal.over:
            raise ActionException(
                f"goal {machine.goal.id} on '{machine.manager.name}': get_terminal_state(): got "
                f"{machine.goal.comm.name}; expected DONE or LOST. Try waiting for the result."
            )
        return TerminalState(machine.goal.status)

    def get_goal_id(self) -> str:
        """Return the goal's id."""
        return self.comm_state_machine.goal.id

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the goal is over and its last callback has returned.

        Called from a callback of this client, it does not wait for callbacks.

        Args:
            timeout: Longest wait [s]; None waits for ever (a server that dies ends the wait).

        Returns:
            Whether it is over.

        Blocks: until then.
        """
        machine = self.comm_state_machine
        if machine.manager.callbacks.is_inside():
            return machine.manager.wait_until_over(machine, timeout)
        return machine.settled.wait(timeout)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ClientGoalHandle):
            return NotImplemented
        return self.comm_state_machine is other.comm_state_machine

    def __hash__(self) -> int:
        return hash(self.comm_state_machine.goal.id)

    def __repr__(self) -> str:
        goal = self.comm_state_machine.goal
        return f"<ClientGoalHandle {goal.id} {goal.comm.name} {goal.status.name}>"


class ActionClient(Generic[A_co]):
    """Sends goals to an action server and follows each of them to its end.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        node: Where; the current node when None.
        server_lost_timeout: How long the server may be away before its goals are LOST [s]; within
            it a server that comes back is asked for what was missed.

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: `server_lost_timeout` is no time, negative or without end.
        InvalidNameError: the name breaks the ROS rules.
        TransportError: the network session is closed.

    Threads: every method may be called from any thread and any callback. Callbacks run one at a
        time, in order, on a thread of their own, without any lock.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: type[A_co],  # noqa: N803  actionlib's name
        *,
        node: Node | None = None,
        server_lost_timeout: float | Duration = 0.0,
    ) -> None:
        grace = check_seconds(f"action {ns!r}", "server_lost_timeout", server_lost_timeout)
        self.node = node if node is not None else get_node()
        self.types = ActionTypes.of(ActionSpec)
        self.ns = self.node.resolve(ns, "action name")
        self.manager = GoalManager(self.node, self.ns, self.types, server_lost_timeout=grace)
        self._ids = GoalIDGenerator(f"/{self.node.full_name}", clock=self.node.clock)
        self._forget = self.node.on_close(self.stop)

    @property
    def ActionSpec(self) -> Any:  # noqa: N802  actionlib's name
        """The action class."""
        return self.types.action

    def stop(self) -> None:
        """Leave the name. Goals that run go on at the server; here they are LOST.

        A server with `on_client_lost="cancel"` cancels them, unless another client of the action
        is left in this session.
        """
        self._forget()
        self.manager.close()

    def wait_for_action_server_to_start(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the action has a server; see `wait_for_server`."""
        return self.wait_for_server(timeout)

    def wait_for_server(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the action has a server.

        Args:
            timeout: Longest wait [s]; 0 and None wait for ever, as in actionlib.

        Returns:
            Whether there is one; False also when the client was stopped or, without a limit, when
            the program is to end (`actionlib_core.shutdown`).

        Raises:
            TypeMismatchError: there is one, but of another type.

        Blocks: until then.
        """
        return self.manager.wait_for_server(to_timeout(timeout))

    def send_goal(
        self,
        goal: Any,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
    ) -> ClientGoalHandle:
        """Send a goal. Without a server it waits and goes out when one appears.

        Args:
            goal: The goal message (XGoal).
            transition_cb: Called with the handle at each new `CommState`.
            feedback_cb: Called with the handle and each XFeedback message.
            ack_timeout: When no server has taken the goal after so long [s], it is LOST; None: it
                waits as long as it takes; 0: it is LOST at once.

        Raises:
            ActionException: `goal` is not of the action's type.
            ActionlibError: `ack_timeout` is no time, or negative.
            FieldError: a field of `goal` has a wrong type.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        machine = self.manager.send(
            *self.pack(goal),
            on_transition=self._on_transition(transition_cb),
            on_feedback=self._on_feedback(feedback_cb),
            ack_timeout=check_limit(f"action '{self.ns}'", "ack_timeout", ack_timeout),
        )
        return ClientGoalHandle(machine)

    def attach(
        self,
        goal_id: str,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
    ) -> ClientGoalHandle:
        """Follow a goal that an earlier life of this program sent, by its id.

        The server is asked for it: its state, or its result when it has ended and the result is
        still kept. A goal the server does not know is LOST. Arguments and errors as `send_goal`.

        Raises:
            ActionlibError: `goal_id` is no id, or this client follows that goal.
        """
        machine = self.manager.attach(
            goal_id,
            on_transition=self._on_transition(transition_cb),
            on_feedback=self._on_feedback(feedback_cb),
            ack_timeout=check_limit(f"action '{self.ns}'", "ack_timeout", ack_timeout),
        )
        return ClientGoalHandle(machine)

    def send(
        self: ActionClient[Spec[G, R, F]], goal: G, *, timeout: float | Duration | None = None
    ) -> SentGoal[R, F]:
        """Send a goal for use in a `with` or `async with` block, which cancels it when left early.

        Args:
            goal: The goal message (XGoal).
            timeout: Longest time to its end [s], the wait for a server included; None: no limit.

        Raises:
            ActionException: `goal` is not of the action's type.
            FieldError: a field of `goal` has a wrong type.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        sent: SentGoal[R, F] = SentGoal(self.node, self.ns, to_seconds(timeout))
        self.manager.send(
            *self.pack(goal),
            on_transition=sent.on_transition,
            on_feedback=sent.on_feedback,
            created=sent.on_created,
        )
        return sent

    def follow(
        self: ActionClient[Spec[G, R, F]], goal_id: str, *, timeout: float | Duration | None = None
    ) -> SentGoal[R, F]:
        """Follow a goal sent in an earlier life of this program; as `send`, but by its id."""
        sent: SentGoal[R, F] = SentGoal(self.node, self.ns, to_seconds(timeout))
        self.manager.attach(
            goal_id,
            on_transition=sent.on_transition,
            on_feedback=sent.on_feedback,
            created=sent.on_created,
        )
        return sent

    def cancel_all_goals(self) -> None:
        """Ask the server to end all goals, also those of other clients."""
        self.manager.cancel_many(0)

    def cancel_goals_at_and_before_time(self, time: Time | float) -> None:
        """Ask the server to end the goals with a stamp at or before `time`, of all clients.

        Args:
            time: A `Time`, or seconds since the epoch.
        """
        stamp = time if isinstance(time, Time) else Time.from_sec(time)
        self.manager.cancel_many(stamp.to_nsec())

    def pack(self, goal: Any) -> tuple[str, int, bytes]:
        """Return a new goal id, its stamp [ns] and the bytes of a goal.

        Raises:
            ActionException: `goal` is not of the action's type.
            FieldError: a field of it has a wrong type.
        """
        if not isinstance(goal, self.types.goal):
            raise ActionException(
                f"action '{self.ns}': goal: got {goal!r}; expected a message of type "
                f"{self.types.goal._type}."
            )
        return *self._ids.generate(), goal.to_bytes()

    def _on_transition(
        self, callback: Callable[[ClientGoalHandle], object] | None
    ) -> Callable[[CommStateMachine, CommState], None] | None:
        if callback is None:
            return None
        check_function(f"action '{self.ns}'", "transition_cb", callback)
        call = self.manager.callbacks.call

        def note(machine: CommStateMachine, state: CommState) -> None:
            call(machine.show, state, callback, ClientGoalHandle(machine))
            if state in {CommState.DONE, CommState.LOST}:
                call(machine.settled.set)

        return note

    def _on_feedback(
        self, callback: Callable[[ClientGoalHandle, Any], object] | None
    ) -> Callable[[CommStateMachine, Any], None] | None:
        if callback is None:
            return None
        check_function(f"action '{self.ns}'", "feedback_cb", callback)
        call = self.manager.callbacks.call

        def note(machine: CommStateMachine, feedback: Any) -> None:
            call(partial(callback, ClientGoalHandle(machine), feedback))

        return note
