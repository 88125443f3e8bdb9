"""`ActionClient`: any number of goals at once, each followed through its handle."""

from __future__ import annotations

import logging
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core import border
from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.action.client_goal_handle import ClientGoalHandle, CommStateMachine
from actionlib_core.action.goal_id_generator import GoalIDGenerator
from actionlib_core.action.goal_manager import GoalManager, Owner
from actionlib_core.action.sent_goal import SentGoal
from actionlib_core.exceptions import ActionException, ActionlibError, TransportError
from actionlib_core.goal.client import STATUS_LIST_TIMEOUT_S, ClientGoal
from actionlib_core.goal.states import OVER, CommState, SimpleGoalState, TerminalState
from actionlib_core.inputs.arguments import (
    check_function,
    check_limit,
    check_seconds,
    check_wait,
    is_goal_id,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import get_node
from actionlib_core.resources import note_sender
from actionlib_core.time import Time
from actionlib_core.wire.action_types import ActionTypes
from actionlib_core.wire.ports import make_client_port

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

log = logging.getLogger(__name__)

__all__ = [
    "ActionClient",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalIDGenerator",
    "GoalManager",
    "TerminalState",
    "get_name_of_constant",
]

A_co = TypeVar("A_co", covariant=True)
G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")


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


for _states in (CommState, TerminalState, SimpleGoalState, GoalStatus):
    # As in actionlib: programs log `GoalStatus.to_string(client.get_state())`.
    setattr(_states, "to_string", classmethod(get_name_of_constant))  # noqa: B010  for mypy


class ActionClient(Generic[A_co]):
    """Sends goals to an action server and follows each of them to its end.

    `send` is for scripts and tests, `send_goal` for many goals at once; other ways:
    docs/howto/which_way.md.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        node: The client's node; None: the current node.
        server_lost_timeout: How long the server may be away before its goals are LOST [s]; when it
            comes back within this time, the client queries it for what it has missed. Peers need up
            to 8 s to find each other again, so a shorter time is logged as a warning.
        status_list_timeout: How long a server without a token, such as one behind a bridge, may
            send no status list before it counts as gone and its goals are LOST [s].

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: one of the timeouts is not a duration, negative or infinite.
        InvalidNameError: the name breaks the ROS rules.
        TransportError: the network session is closed.

    A client that the program drops still calls the callbacks of its running goals, and withdraws
    from the network when these are over.

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
        status_list_timeout: float | Duration = STATUS_LIST_TIMEOUT_S,
    ) -> None:
        grace = check_seconds(f"action {ns!r}", "server_lost_timeout", server_lost_timeout)
        silence = check_seconds(f"action {ns!r}", "status_list_timeout", status_list_timeout)
        self.node = node if node is not None else get_node()
        self.types = ActionTypes.of(ActionSpec)
        self.ns = self.node.resolve(ns, "action name")
        if border.listeners:
            session = self.node.transport.session_id
            border.tell("client", self.node, self.ns, self.types.action._type, session)
        if 0 < grace < self.node.transport.rediscovery:
            log.warning(
                "action '%s': server_lost_timeout: got %g; on this network it takes up to %g s to "
                "restore a lost link, and goals may be LOST before. Try a longer time, or 0.",
                self.ns,
                grace,
                self.node.transport.rediscovery,
            )
        self._owner = Owner(CallbackQueue(self.node, f"{self.ns} client callbacks"))
        self._limits = grace, silence
        key = ("goals", self.ns, self.types.action, *self._limits, self.node.full_name)
        while True:
            manager = self.node.shared(key, partial(self._make_manager, key))
            if manager.join(self._owner):
                break
            self.node.unshare(key, manager)  # its last client has just left
        self.manager = self._owner.manager = manager
        self._apart: Owner | None = None
        self._ids = GoalIDGenerator(f"/{self.node.full_name}", clock=self.node.clock)
        self._let_go = weakref.finalize(self, self._owner.let_go)
        self._let_go.atexit = False  # there the node closes its clients itself

    def _owner_apart(self) -> Owner:
        """Return an owner for goals that another client of this node follows already.

        It has a manager of its own, as a manager follows a goal once.
        """
        if self._apart is None:
            apart = Owner(self._owner.callbacks)
            apart.manager = self._make_manager(None)
            apart.manager.join(apart)
            self._apart = apart
            weakref.finalize(self, apart.let_go).atexit = False
        return self._apart

    def _make_manager(self, key: tuple[Any, ...] | None) -> GoalManager:
        spawn = CallbackQueue(self.node, f"{self.ns} client").spawn
        grace, silence = self._limits
        return GoalManager(
            self.node,
            self.ns,
            make_client_port(self.node, self.ns, self.types, spawn),
            spawn,
            key=key,
            server_lost_timeout=grace,
            status_list_timeout=silence,
        )

    @property
    def ActionSpec(self) -> Any:  # noqa: N802  actionlib's name
        """The action class."""
        return self.types.action

    def stop(self) -> None:
        """Withdraw from the network. Running goals go on at the server; here they are LOST.

        A server with `on_client_lost="cancel"` cancels them, unless this session has another
        client of the action.
        """
        self._let_go.detach()
        for owner in (self._owner, self._apart):
            if owner is not None:
                owner.manager.leave(owner)

    def wait_for_action_server_to_start(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the action has a server; see `wait_for_server`."""
        return self.wait_for_server(timeout)

    def wait_for_server(self, timeout: float | Duration | None = 0.0) -> bool:
        """Wait until the action has a server.

        Args:
            timeout: Longest wait [s]; 0 and None wait for ever, as in actionlib.

        Returns:
            Whether there is one; False also when the client was stopped or, without a limit, when
            shutdown is requested (`actionlib_core.shutdown`).

        Raises:
            TypeMismatchError: there is one, but of another type.
            InvalidDurationError: `timeout` is not a duration.

        Blocks: until then.
        """
        return self.manager.wait_for_server(
            self._owner, check_wait(f"action '{self.ns}'", "timeout", timeout)
        )

    def send_goal(
        self,
        goal: Any,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
        cancel_on_client_lost: bool = False,
    ) -> ClientGoalHandle:
        """Send a goal. Without a server, it is sent when one appears.

        Args:
            goal: The goal message (XGoal).
            transition_cb: Called with the handle at each new `CommState`.
            feedback_cb: Called with the handle and each XFeedback message.
            ack_timeout: Time within which a server must take the goal [s], else it is LOST. None:
                no limit; 0: it is LOST at once.
            cancel_on_client_lost: The server cancels the goal if this client dies or is cut off,
                whatever its own `on_client_lost` says. Servers of other programs, such as those of
                ROS, do not know this.

        Raises:
            ActionException: `goal` is not of the action's type.
            ActionlibError: `ack_timeout` is not a duration, or negative.
            FieldError: a field of `goal` has a wrong type.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        limit = check_limit(f"action '{self.ns}'", "ack_timeout", ack_timeout)
        handle = self.make_goal(goal, limit, cancel_on_client_lost=cancel_on_client_lost)
        return self._begin(handle, transition_cb, feedback_cb)

    def attach(
        self,
        goal_id: str,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
        *,
        ack_timeout: float | Duration | None = None,
    ) -> ClientGoalHandle:
        """Follow a goal by its id, for example one that this program sent before a restart.

        The server is queried for its state, or for its result when it has ended and the result is
        still kept. A goal that the server does not know is LOST. Arguments and errors as
        `send_goal`.

        Raises:
            ActionlibError: `goal_id` is not an id, or this client follows that goal.
        """
        limit = check_limit(f"action '{self.ns}'", "ack_timeout", ack_timeout)
        return self._begin(self.find_goal(goal_id, limit), transition_cb, feedback_cb)

    def _begin(
        self,
        handle: ClientGoalHandle,
        transition_cb: Callable[[ClientGoalHandle], object] | None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None,
    ) -> ClientGoalHandle:
        check_function(f"action '{self.ns}'", "transition_cb", transition_cb)
        check_function(f"action '{self.ns}'", "feedback_cb", feedback_cb)
        if transition_cb is not None:

            def on_state(state: CommState) -> None:
                handle.call(state, transition_cb, handle)
                if state in OVER:
                    handle.owner.callbacks.call(handle.settle)

            handle.on_state = on_state
        if feedback_cb is not None:
            handle.on_feedback = partial(handle.call_with_feedback, partial(feedback_cb, handle))
        handle.calls_back = transition_cb is not None or feedback_cb is not None
        self._follow(handle)
        return handle

    def send(
        self: ActionClient[Spec[G, R, F]],
        goal: G,
        *,
        timeout: float | Duration | None = None,
        cancel_on_client_lost: bool = False,
    ) -> SentGoal[R, F]:
        """Send a goal for use in a `with` or `async with` block, which cancels it when left early.

        Args:
            goal: The goal message (XGoal).
            timeout: Longest time to its end [s], the wait for a server included; None: no limit.
            cancel_on_client_lost: See `send_goal`.

        Raises:
            ActionException: `goal` is not of the action's type.
            FieldError: a field of `goal` has a wrong type.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        limit = check_limit(f"action '{self.ns}'", "timeout", timeout)
        handle = self.make_goal(goal, cancel_on_client_lost=cancel_on_client_lost)
        return self._send(handle, limit)

    def follow(
        self: ActionClient[Spec[G, R, F]], goal_id: str, *, timeout: float | Duration | None = None
    ) -> SentGoal[R, F]:
        """Follow a goal by its id, for example after a restart; otherwise as `send`."""
        limit = check_limit(f"action '{self.ns}'", "timeout", timeout)
        return self._send(self.find_goal(goal_id), limit)

    def _send(self, handle: ClientGoalHandle, timeout: float | None) -> SentGoal[Any, Any]:
        sent: SentGoal[Any, Any] = SentGoal(handle, timeout)
        self._follow(handle)
        return sent

    def _follow(self, handle: ClientGoalHandle) -> None:
        try:
            handle.manager.begin(handle)
        except BaseException:  # for example Ctrl-C: the goal may be at the server already
            handle.manager.give_up(handle)
            raise

    def cancel_all_goals(self) -> None:
        """Ask the server to cancel all goals, also those of other clients."""
        self.manager.cancel_many(0)

    def cancel_goals_at_and_before_time(self, time: Time | float) -> None:
        """Ask the server to cancel the goals of all clients with a stamp at or before `time`.

        Args:
            time: A `Time`, or seconds since the epoch. 0 means all goals, as in ROS.
        """
        stamp = time if isinstance(time, Time) else Time.from_sec(time)
        self.manager.cancel_many(stamp.to_nsec())

    def make_goal(
        self, goal: Any, ack_timeout: float | None = None, *, cancel_on_client_lost: bool = False
    ) -> ClientGoalHandle:
        """Return a handle for a new goal, which `manager.begin` sends.

        Args:
            goal: The goal message (XGoal). It is packed here: later changes have no effect.
            ack_timeout: See `send_goal` [s].
            cancel_on_client_lost: See `send_goal`.

        Raises:
            ActionException: `goal` is not of the action's type.
            FieldError: a field of it has a wrong type.
        """
        if not isinstance(goal, self.types.goal):
            raise ActionException(
                f"action '{self.ns}': goal: got {goal!r}; expected a message of type "
                f"{self.types.goal._type}."
            )
        goal_id, stamp_ns = self._ids.generate()
        made_at = self.manager.clock.now()
        life = ClientGoal(goal_id, stamp_ns, made_at=made_at, ack_timeout=ack_timeout)
        if border.listeners:
            border.tell("goal", self.node, self.ns, self.types.action._type, goal_id, goal)
        body = self.manager.port.pack_goal(goal)
        handle = ClientGoalHandle(self._owner, life, body, cancel_if_lost=cancel_on_client_lost)
        handle.sender = note_sender(life.id)
        return handle

    def find_goal(self, goal_id: str, ack_timeout: float | None = None) -> ClientGoalHandle:
        """Return a handle for a goal sent earlier, for which `manager.begin` queries the server.

        Raises:
            ActionlibError: `goal_id` is not an id.
            TransportError: the client is stopped.
        """
        if self._owner.closed:  # else it would follow the goal of another client of the node
            raise TransportError(f"action '{self.ns}': the client is stopped.")
        if not is_goal_id(goal_id):
            raise ActionlibError(
                f"action '{self.ns}': goal id: got {goal_id!r}; expected the id of a goal that "
                "was sent, SentGoal.id for example."
            )
        life = ClientGoal(goal_id, attached=True, ack_timeout=ack_timeout)
        other = self.manager.follows_for_another(self._owner, goal_id)
        return ClientGoalHandle(self._owner_apart() if other else self._owner, life)
