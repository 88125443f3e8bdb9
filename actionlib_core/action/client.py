"""`ActionClient`: any number of goals at once, each followed through its handle.

Three objects hold a goal at its client: `ClientGoal` decides (`actionlib_core.goal.client`), the
`ClientGoalHandle` around it is what programs hold, and the client's `GoalManager` brings decisions,
network, time and callbacks together, under one lock.
"""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core._arguments import (
    check_delay,
    check_function,
    check_limit,
    check_seconds,
    check_wait,
)
from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.action.goal_id_generator import GoalIDGenerator
from actionlib_core.action.sent_goal import SentGoal
from actionlib_core.exceptions import ActionException, ActionlibError, TransportError
from actionlib_core.goal.bounded import Backlog, Recent
from actionlib_core.goal.client import STATUS_LIST_TIMEOUT_S, ClientGoal, Duty, KnownServers, Path
from actionlib_core.goal.states import TERMINAL, CommState, Status, TerminalState
from actionlib_core.node import get_node
from actionlib_core.shutdown import current_shutdown
from actionlib_core.time import Time
from actionlib_core.wire.action_messages import ActionTypes
from actionlib_core.wire.ports import make_client_port

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.clock import Event, Timer
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.ports import ClientPort, Server, StatusEntry
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

log = logging.getLogger(__name__)

__all__ = [
    "ActionClient",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalManager",
    "TerminalState",
    "get_name_of_constant",
]

# Among the tokens that a client finds at first, one of a wrong type may come before the right one.
MISMATCH_S = 0.2
TICK_S = 0.05  # repetitions and acknowledgements due within this time go out together
ACK_AT = 64  # or as soon as so many acknowledgements wait
REMEMBERED = 1024  # ids of ended goals whose result may come again
FEEDBACK_S = 0.5  # a feedback callback that takes longer after the goal's end gets no more feedback
ABSENT_S = 3.0  # who has waited so long for a server is told where it was looked for
CALLBACKS_S = 1.0  # waiting for a goal's end waits no longer for callbacks that do not return

UNSURE = " and had not acknowledged the goal, which may or may not have begun"

_STATUSES = {int(status): status for status in Status}
_OVER = frozenset({CommState.DONE, CommState.LOST})

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


class ClientGoalHandle:
    """One goal as its client holds it. Two handles are equal when they are of one goal.

    Dropping the handle changes nothing: the goal is followed until it is over. ROS's attribute
    `comm_state_machine` is the handle itself.

    Args:
        manager: The client's goals.
        goal: The goal's life cycle.
        body: The packed goal message.

    Attributes:
        goal: See above.
        manager: See above.
        body: See above.
        on_state: Called under the manager's lock with each state passed; must only note it.
        on_feedback: The same, when feedback has come; None when nobody wants any.
        feedback: The feedback that nobody has taken; guarded by the manager's lock.
        keeps_result: The server is to keep the result until `acknowledge` is called.
        calls_back: The goal has callbacks, for which `settled` waits.
        settled: Set when the goal is over and its last callback has returned, or nobody follows it.
        ended: Set when the goal is over or nobody follows it; made when somebody waits for that.
        ended_at: When the goal was over [s, clock]; None while it is not.
        last_call: The callback that reports the goal's end has begun.
        asking: A question about the goal is under way.

    Threads: every method may be called from any thread and any callback.
    """

    __slots__ = (
        "__weakref__",
        "_shown",
        "_shown_to",
        "asking",
        "body",
        "calls_back",
        "ended",
        "ended_at",
        "feedback",
        "goal",
        "keeps_result",
        "last_call",
        "manager",
        "on_feedback",
        "on_state",
        "settled",
    )

    def __init__(self, manager: GoalManager, goal: ClientGoal, body: bytes = b"") -> None:
        self.manager = manager
        self.goal = goal
        self.body = body
        self.on_state: Callable[[CommState], object] | None = None
        self.on_feedback: Callable[[], object] | None = None
        self.feedback: Backlog[Any] = Backlog()
        self.calls_back = False
        self.settled: Event = manager.clock.event()
        self.ended: Event | None = None
        self.ended_at: float | None = None
        self.last_call = False
        self.keeps_result = False
        self.asking = False
        self._shown: CommState | None = None
        self._shown_to = 0

    # -- for programs --------------------------------------------------------------------------

    def cancel(self) -> None:
        """Ask for the goal's end. The answer comes as a transition; a goal that is over stays."""
        self.manager.cancel(self)

    def get_comm_state(self) -> CommState:
        """Return where the goal stands; in a transition callback, the state it is called for."""
        if self._shown is not None and self._shown_to == threading.get_ident():
            return self._shown
        return self.goal.comm

    def get_goal_status(self) -> int:
        """Return the last status the server gave (`GoalStatus`); LOST once the goal is lost."""
        return int(self.goal.status)

    def get_goal_status_text(self) -> str:
        """Return what the server said about the status, or why the goal is lost."""
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
        """How many feedback messages were dropped, as the callback was slower than they came."""
        return self.feedback.dropped

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the goal is over and its last callback has returned.

        Called from a callback of this client, it does not wait for callbacks. Nor does it wait
        longer than 1 s after the goal's end for one that does not return, but for the transition
        callback that reports the end.

        Args:
            timeout: Longest wait [s]; None waits for ever (a server that dies ends the wait).

        Returns:
            Whether it is over; False also when nobody follows it any more.

        Blocks: until then.
        """
        return self.manager.wait(self, check_delay(f"goal {self.goal.id}", "timeout", timeout))

    @property
    def comm_state_machine(self) -> ClientGoalHandle:
        """The handle itself, for programs that use ROS's attribute."""
        return self

    @property
    def state(self) -> CommState:
        """As `get_comm_state`."""
        return self.get_comm_state()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ClientGoalHandle):
            return NotImplemented
        return self.goal is other.goal

    def __hash__(self) -> int:
        return hash(self.goal.id)

    def __repr__(self) -> str:
        return f"<ClientGoalHandle {self.goal.id} {self.goal.comm.name} {self.goal.status.name}>"

    # -- for whoever follows the goal ----------------------------------------------------------

    def acknowledge(self) -> None:
        """Let the server forget a result that it was to keep (`keeps_result`)."""
        self.manager.acknowledge(self.goal.id)

    @property
    def forgotten(self) -> bool:
        """Whether the goal runs on and nobody follows it."""
        return self.settled.is_set() and not self.goal.over

    def call(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        """Run a user callback, for which the goal stands in `state`, after those before it."""
        self.manager.callbacks.call(self._show, state, callback, *args)

    def _show(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        self._shown_to, self._shown = threading.get_ident(), state
        self.last_call = state in _OVER
        try:
            callback(*args)
        finally:
            self._shown = None

    def call_with_feedback(self, callback: Callable[[Any], object]) -> None:
        """Run a user callback with the next feedback, after the callbacks before it."""
        self.manager.callbacks.call(self._deliver_feedback, callback)

    def _deliver_feedback(self, callback: Callable[[Any], object]) -> None:
        feedback = self.take_feedback()
        if feedback is not None:
            started = self.manager.clock.now()
            try:
                callback(feedback)
            finally:
                self.drop_feedback_after(started)

    def take_feedback(self) -> Any:
        """Return the next feedback; None when none waits."""
        with self.manager.lock:
            return self.feedback.take()

    def drop_feedback_after(self, started: float, limit: float = FEEDBACK_S) -> None:
        """Drop what waits if the goal is over and a callback did not keep up.

        That is one that has taken longer than `limit` [s] since it `started` or, if that was later,
        since the end of the goal. What is dropped is counted and logged.
        """
        ended_at = self.ended_at
        if ended_at is None or self.manager.clock.now() < max(started, ended_at) + limit:
            return
        with self.manager.lock:
            dropped = self.feedback.drop_all()
        if dropped:
            log.warning(
                "action '%s': goal %s is over: the last %d messages of its feedback were dropped, "
                "%d in all, as its callback is slower than they came.",
                self.manager.name,
                self.goal.id,
                dropped,
                self.feedback.dropped,
            )


CommStateMachine = ClientGoalHandle
"""ROS's name for what a client keeps of one goal."""


_managers: weakref.WeakSet[GoalManager] = weakref.WeakSet()


def _renew_locks() -> None:
    """Give a forked child locks of its own: who held one then is a thread of its parent."""
    for manager in _managers:
        manager.lock = threading.RLock()


os.register_at_fork(after_in_child=_renew_locks)


class GoalManager:
    """The goals of one client. Registers a goal before it is sent; nothing that comes back is lost.

    It outlives an `ActionClient` that is dropped, until the goals are over.

    Args:
        node: On whose clock.
        name: The action's full name.
        port: The way to the network.
        callbacks: Where user callbacks run.
        server_lost_timeout: How long a server may be away before its goals are LOST [s].
        status_list_timeout: How long a server that does not show itself may be silent before they
            are [s].

    Attributes:
        lock: Guards the goals. User callbacks run without it, in `callbacks`.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        port: ClientPort,
        callbacks: CallbackQueue,
        *,
        server_lost_timeout: float,
        status_list_timeout: float = STATUS_LIST_TIMEOUT_S,
    ) -> None:
        self.node = node
        self.name = name
        self.port = port
        self.callbacks = callbacks
        self.clock = node.clock
        self.lock = threading.RLock()
        _managers.add(self)
        self._server_lost_timeout = server_lost_timeout
        self._status_list_timeout = status_list_timeout
        self._servers = KnownServers(status_list_timeout)
        self._goals: dict[str, ClientGoalHandle] = {}
        self._ended = Recent(REMEMBERED)
        self._strangers = Recent(REMEMBERED)
        self._acks: list[str] = []
        self._waiters: list[Event] = []
        self._timer: Timer | None = None
        self._due = 0.0
        self._closed = False
        self._dropped = False
        port.open(self)
        self._forget_on_close = node.on_close(self.close)

    def close(self) -> None:
        """Acknowledge what has arrived, leave the name; goals that still run are LOST here."""
        with self.lock:
            if self._closed:
                return
            for handle in list(self._goals.values()):
                self._pass(handle, handle.goal.lose("the action client was stopped"))
            self._closed = True
            self._forget_on_close()
            acks, self._acks = self._acks, []
            if self._timer is not None:
                self._timer.cancel()
            self._wake()
        if acks:
            self.port.acknowledge(acks)
        self.port.close()

    def let_go(self) -> None:
        """Close once no goal runs any more: the client was dropped.

        Threads: any, also one that collects garbage, at any moment.
        """
        self.node.let_go(self._close_when_idle)

    def _close_when_idle(self) -> None:
        with self.lock:
            self._dropped = True
            idle = not self._goals
        if idle:
            self.close()

    # -- what the program does -----------------------------------------------------------------

    def wait_for_server(self, timeout: float | None) -> bool:
        """Wait for a server; return whether there is one.

        Raises:
            TypeMismatchError: there is one of another type.

        Blocks: until then or until the client is stopped, `timeout` [s] at most; None: no limit,
            but until the program is to end.
        """
        started = self.clock.now()
        if timeout is None or timeout > ABSENT_S + 1.0:  # looking around takes up to a second
            if self._await_server(started + ABSENT_S, ends=timeout is None):
                return True
            if not (self._closed or (timeout is None and current_shutdown().requested())):
                self._tell_absence()
        deadline = None if timeout is None else started + timeout
        return self._await_server(deadline, ends=timeout is None)

    def _await_server(self, deadline: float | None, *, ends: bool) -> bool:
        """Wait for a server until `deadline` [s, clock]; `ends`: or until the program is to end."""
        changed = self.clock.event()
        ending = current_shutdown()
        forget = ending.on_shutdown(changed.set) if ends else None
        try:
            while True:
                with self.lock:
                    if self._closed:
                        return False
                    if self._servers.is_there:
                        return True
                    error = self._servers.find_wrong_type()
                    if error is not None:
                        raise error
                    changed.clear()
                    if changed not in self._waiters:
                        self._waiters.append(changed)
                left = None if deadline is None else deadline - self.clock.now()
                over = (ends and ending.requested()) or (left is not None and left <= 0)
                if over or (not changed.wait(left) and left is not None):
                    with self.lock:
                        if changed in self._waiters:
                            self._waiters.remove(changed)
                        return self._servers.is_there
        finally:
            if forget is not None:
                forget()

    def _tell_absence(self) -> None:
        """Say where a server was looked for in vain, where the network knows more of it."""
        with contextlib.suppress(TransportError):  # the session is closed: the wait ends with it
            why = self.port.explain_absence()
            if why:
                log.warning("action '%s': no server after %g s: %s", self.name, ABSENT_S, why)

    def begin(self, handle: ClientGoalHandle) -> None:
        """Follow a goal: send it, or ask for one that was sent before.

        Raises:
            ActionlibError: the goal is followed already.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        with self.lock:
            if self._closed:
                raise self._stopped()
            goal = handle.goal
            known = self._goals.get(goal.id)
            if known is not None:
                self._take_over(known, handle)
                return
            error = self._servers.find_wrong_type()
            if error is not None:
                raise error
            duty = goal.begin(self.clock.now())
            self._goals[goal.id] = handle
            self._arm(goal.due)
        self._fulfil(handle, duty)

    def _take_over(self, known: ClientGoalHandle, handle: ClientGoalHandle) -> None:
        """Let `handle` follow a goal that was forgotten and still runs. Needs the lock."""
        if not known.forgotten:
            raise ActionlibError(
                f"goal {known.goal.id} on '{self.name}': this client follows it already."
            )
        ack_timeout = handle.goal.ack_timeout
        goal = handle.goal = known.goal
        handle.body, handle.asking = known.body, known.asking
        goal.limit_ack(ack_timeout, self.clock.now())
        self._goals[goal.id] = handle
        self._arm(goal.due)
        if goal.comm is not CommState.WAITING_FOR_GOAL_ACK:
            self._pass(handle, (goal.comm,))

    def cancel(self, handle: ClientGoalHandle) -> None:
        """Ask for a goal's end."""
        with self.lock:
            duty = self._cancel(handle)
        self._fulfil(handle, duty)

    def _cancel(self, handle: ClientGoalHandle) -> Duty:
        """Note that a goal is to end; return what to send. Needs the lock."""
        path, duty = handle.goal.cancel(self.clock.now())
        self._pass(handle, path)
        self._arm(handle.goal.due)
        return duty

    def cancel_many(self, stamp_ns: int) -> None:
        """Cancel the goals of all clients: all of them (0), or those at or before a stamp [ns].

        This is said once. Our own goals among them are cancelled by their ids as well: that is
        repeated until the server has heard it.

        Raises:
            TransportError: the client is stopped.
        """
        with self.lock:
            if self._closed:
                raise self._stopped()
            meant = [
                handle
                for handle in list(self._goals.values())
                if not stamp_ns or 0 < handle.goal.stamp_ns <= stamp_ns
            ]
            duties = [(handle, self._cancel(handle)) for handle in meant]
        self.port.send_cancel("", stamp_ns)
        for handle, duty in duties:
            if not handle.goal.acknowledged:  # the goal itself may still be on its way
                self._fulfil(handle, duty)

    def _stopped(self) -> TransportError:
        return TransportError(f"action '{self.name}': the client is stopped.")

    def wait(self, handle: ClientGoalHandle, timeout: float | None) -> bool:
        """Wait until a goal is over and its callbacks have returned; see `ClientGoalHandle.wait`.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        goal = handle.goal
        if not handle.calls_back:
            handle.settled.wait(timeout)
            return goal.over
        deadline = None if timeout is None else self.clock.now() + timeout
        with self.lock:
            if not goal.over and not handle.forgotten and handle.ended is None:
                handle.ended = self.clock.event()
            ended = handle.ended
        if ended is not None:
            ended.wait(timeout)
        if not goal.over or self.callbacks.is_inside():
            return goal.over
        now = self.clock.now()
        left = None if deadline is None else deadline - now
        ended_at = now if handle.ended_at is None else handle.ended_at
        patience = max(0.0, ended_at + CALLBACKS_S - now)
        first = patience if left is None else min(patience, left)
        if handle.settled.wait(first):
            return True
        if handle.last_call:
            handle.settled.wait(None if left is None else left - first)
        elif first == patience:
            log.warning(
                "action '%s': goal %s is over, but a callback of this client has not returned for "
                "%g s: those that wait behind it are late. Try a callback that takes no time.",
                self.name,
                goal.id,
                CALLBACKS_S,
            )
        return True

    def forget(self, handle: ClientGoalHandle) -> None:
        """Follow a goal no more; it runs on. Its result is acknowledged when it comes."""
        with self.lock:
            if handle.goal.over:
                return
            handle.on_state = handle.on_feedback = None
            handle.settled.set()
            if handle.ended is not None:
                handle.ended.set()

    # -- servers -------------------------------------------------------------------------------

    def on_server(self, server: Server, error: TypeMismatchError | None) -> None:
        """Handle the appearance of a server."""
        now = self.clock.now()
        with self.lock:
            returned, replaced = self._servers.appear(server, error, now)
            if error is None:
                for old in replaced:
                    self._lose_goals_of(old, f"restarted as session {server.session}")
                self._hurry(now, every=returned)
            elif self._servers.find_wrong_type() is not None:
                self.clock.call_later(MISMATCH_S, self._lose_mismatched)
            self._wake()

    def _lose_mismatched(self) -> None:
        """Give up the goals that wait for a server, if there is only one of another type."""
        with self.lock:
            error = self._servers.find_wrong_type()
            for handle in list(self._goals.values()):
                if error is not None and not handle.goal.acknowledged:
                    self._pass(handle, handle.goal.lose(str(error)))

    def on_server_gone(self, server: Server, why: str = "is gone") -> None:
        """Handle the disappearance of a server."""
        with self.lock:
            if not self._servers.vanish(server):
                return  # unknown, or of another type
            if self._servers.has_said_farewell(server) or self._server_lost_timeout <= 0:
                self._lose_goals_of(server, why)
            else:
                until = self.clock.now() + self._server_lost_timeout
                self._servers.expect_back(server, until)
                self._arm(until)

    def on_farewell(self, entries: list[StatusEntry], server: Server) -> None:
        """Handle the last list of a server that leaves, and answer it.

        Any goal that it does not name it has not taken and never will: the next server gets it.
        """
        now = self.clock.now()
        taken = {entry.id: entry for entry in entries}
        with self.lock:
            if self._closed:
                return
            self._servers.say_farewell(server)
            for handle in list(self._goals.values()):
                goal = handle.goal
                entry = taken.get(goal.id)
                if entry is not None:
                    self._hear(handle, entry, server.session, now)
                elif goal.server in {"", server.session}:
                    self._pass(handle, goal.on_untaken(now))
            acks, self._acks = self._acks, []
        self.port.acknowledge(acks, farewell=True)

    def on_stranger(self, session: str) -> None:
        """Report, once, a session whose words about goals are dropped."""
        with self.lock:
            known = session in self._strangers
            self._strangers.add(session)
        if not known:
            log.error(
                "action '%s': session %s speaks for the action's server, which it is not: its "
                "messages are dropped. Try access rules if it is a stranger, or a token if it is a "
                "server.",
                self.name,
                session or "unknown",
            )

    def _wake(self) -> None:
        """Wake those who wait for a server. Needs the lock."""
        waiters, self._waiters = self._waiters, []
        for event in waiters:
            event.set()

    def _hurry(self, now: float, *, every: bool = False) -> None:
        """Send at once what waits for a server; `every` goal, if it has to be asked for anew.

        Needs the lock.
        """
        for handle in self._goals.values():
            if every or not handle.goal.acknowledged:
                handle.goal.hurry(now)
        self._arm(now)

    def _lose_goals_of(self, server: Server, what: str) -> None:
        """Give up the goals that a server has, or may have. Needs the lock."""
        reason = f"the action server of node '{server.node}' (session {server.session}) {what}"
        self._lose_goals(self._servers.forget(server), reason)

    def _lose_goals(self, sessions: Collection[str], reason: str) -> None:
        """Give up the goals that these sessions have, or may have. Needs the lock."""
        for handle in list(self._goals.values()):
            goal = handle.goal
            if goal.offered and goal.server in sessions:
                self._pass(handle, goal.lose(reason if goal.acknowledged else reason + UNSURE))

    # -- what arrives about goals --------------------------------------------------------------

    def on_statuses(self, entries: list[StatusEntry], session: str, *, whole: bool = True) -> None:
        """Handle a status list, or with `whole` false a part of one."""
        now = self.clock.now()
        servers, goals = self._servers, self._goals
        if servers.current is None or session in servers.foreign:
            with self.lock:
                if servers.hear_foreign(session, now):
                    self._hurry(now)
                    self._wake()
                if goals and session in servers.foreign:
                    self._arm(servers.foreign[session])
        if not goals:
            return
        with self.lock:
            listed = set()
            for entry in entries:
                listed.add(entry.id)
                handle = goals.get(entry.id)
                if handle is not None and (
                    servers.may_speak(session) or self._believes(session, handle)
                ):
                    self._hear(handle, entry, session, now)
            if whole and (len(listed) < len(goals) or not listed.issuperset(goals)):
                answers = servers.current is not None
                for handle in list(goals.values()):
                    if handle.goal.id not in listed and handle.goal.server in {"", session}:
                        self._pass(handle, handle.goal.on_unlisted(now, answers=answers))
                        self._arm(handle.goal.due)

    def _hear(self, handle: ClientGoalHandle, entry: StatusEntry, session: str, now: float) -> None:
        """Take a status. Needs the lock."""
        status = _STATUSES.get(entry.status)
        if status is None:
            log.error("action '%s': unknown status %d of a goal", self.name, entry.status)
            return
        goal = handle.goal
        if not goal.stamp_ns:  # one that was attached to
            goal.stamp_ns = entry.stamp_ns
        before = goal.comm
        path = goal.on_status(status, entry.text, now)
        due = goal.due
        if session and goal.acknowledged:  # not one that knows of the cancel only
            goal.server = session
        if goal.comm is not before:
            self._arm(due)
        if path:
            self._pass(handle, path)

    def _believes(self, session: str, handle: ClientGoalHandle) -> bool:
        """Tell whether a session that is no server may speak of a goal; report one that may not."""
        goal = handle.goal
        if goal.acknowledged and session == goal.server:
            return True
        self.on_stranger(session)
        return False

    def on_feedback(self, entry: StatusEntry, body: bytes, session: str) -> None:
        """Handle feedback."""
        handle = self._goals.get(entry.id)
        if handle is None:
            return
        if not (self._servers.may_speak(session) or self._believes(session, handle)):
            return
        feedback = None
        if handle.on_feedback is not None:
            try:
                feedback = self.port.read_feedback(body)
            except (ValueError, ActionlibError) as error:
                log.error("action '%s': feedback cannot be read: %s", self.name, error)  # noqa: TRY400
                return
        with self.lock:
            goal, now = handle.goal, self.clock.now()
            if goal.over:
                return
            if entry.status == goal.status and session == goal.server and goal.acknowledged:
                goal.on_sign_of_life(now)
            else:
                self._hear(handle, entry, session, now)
            if handle.on_feedback is None or feedback is None:  # the latter: just taken over
                return
            dropped_before = handle.feedback.dropped
            if handle.feedback.add(feedback, len(body)):
                handle.on_feedback()
            elif not dropped_before:
                log.warning(
                    "action '%s': the feedback of goal %s comes faster than it is taken, and the "
                    "oldest of %d messages is dropped. Try a callback that takes no time.",
                    self.name,
                    goal.id,
                    len(handle.feedback),
                )

    def on_result(
        self, entry: StatusEntry, body: bytes, session: str, *, answered: bool = False
    ) -> None:
        """Handle a result; `answered`: it was asked for."""
        handle = self._goals.get(entry.id)
        if handle is None:
            if entry.id in self._ended:
                self.acknowledge(entry.id)
            return
        may_speak = answered or self._servers.may_speak(session)
        if not may_speak and not self._believes(session, handle):
            return
        status = _STATUSES.get(entry.status, Status.LOST)
        text, result = entry.text, None
        try:
            result = self.port.read_result(body)
        except (ValueError, ActionlibError) as error:
            status, text = Status.LOST, f"the result cannot be read: {error}"
        self._end(handle, status, text, result, session)

    def follows(self, goal_id: str) -> bool:
        """Return whether a goal is followed, and not over."""
        return goal_id in self._goals

    def on_answer(self, entry: StatusEntry, session: str = "") -> None:
        """Handle a status that was asked for: there is no result, or not yet."""
        handle = self._goals.get(entry.id)
        if handle is None:
            return
        status = _STATUSES.get(entry.status)
        if status in TERMINAL:
            self._end(handle, status, entry.text, None, session)
            return
        with self.lock:
            if status is not Status.LOST:
                self._hear(handle, entry, session, self.clock.now())
            elif not self._servers.conflict:  # else another server may have it
                self._pass(handle, handle.goal.on_unknown(entry.text))

    def _end(
        self, handle: ClientGoalHandle, status: Status, text: str, result: Any, session: str
    ) -> None:
        with self.lock:
            goal = handle.goal
            if session:
                goal.server = session
            self._pass(handle, goal.on_result(status, text, result, self.clock.now()))
        if not handle.keeps_result:
            self.acknowledge(goal.id)

    def acknowledge(self, goal_id: str) -> None:
        """Tell the server, soon, that a result has arrived."""
        with self.lock:
            if self._closed:
                return
            self._acks.append(goal_id)
            if len(self._acks) < ACK_AT:
                self._arm(self.clock.now() + TICK_S)
                return
            acks, self._acks = self._acks, []
        self.port.acknowledge(acks)

    def _pass(self, handle: ClientGoalHandle, path: Path) -> None:
        """Report the states that a goal has passed. Needs the lock."""
        if not path:
            return
        goal = handle.goal
        if goal.over:
            self._goals.pop(goal.id, None)
            handle.ended_at = self.clock.now()
            if handle.ended is not None:
                handle.ended.set()
            self._ended.add(goal.id)
            if self._dropped and not self._goals:
                self.let_go()
        if handle.on_state is not None:
            for state in path:
                handle.on_state(state)
        elif goal.over and handle.on_feedback is not None:
            self.callbacks.call(handle.settled.set)  # behind the last feedback
        elif goal.over:
            handle.settled.set()
        if goal.over:  # they hold the handle and maybe its client, which would stay until a gc
            handle.on_state = handle.on_feedback = None

    # -- time, and what is sent ----------------------------------------------------------------

    def _arm(self, due: float) -> None:
        """Let the timer run at `due` or a little later. Needs the lock."""
        if self._closed or (self._timer is not None and self._due <= due):
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = self.clock.call_later(due - self.clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        now = self.clock.now()
        duties = []
        with self.lock:
            self._timer = None
            if self._closed:
                return
            acks, self._acks = self._acks, []
            for server in self._servers.take_overdue(now):
                self._lose_goals_of(server, "is gone")
            for session in self._servers.take_silent(now):
                self._lose_goals(
                    {session},
                    f"the action server without a token (session {session or 'unknown'}) has sent "
                    f"no status list for {self._status_list_timeout:g} s",
                )
            for handle in list(self._goals.values()):
                path, duty = handle.goal.tick(now)
                self._pass(handle, path)
                if duty:
                    duties.append((handle, duty))
            dues = [handle.goal.due for handle in self._goals.values()]
            dues.extend(self._servers.away.values())
            dues.extend(self._servers.foreign.values())
            if dues:
                self._arm(max(min(dues), now + TICK_S))
        if acks:
            self.port.acknowledge(acks)
        for handle, duty in duties:
            self._fulfil(handle, duty, wait=False)  # a full link must not hold up other timers

    def _fulfil(self, handle: ClientGoalHandle, duty: Duty, *, wait: bool = True) -> None:
        """Send what a goal needs; without `wait`, not what finds the link full.

        A goal is sent only if a server listens, and to that one: then it cannot run twice. Others
        may listen too, so that it is heard is not enough; nor is a token, before the subscription
        of its server is known.
        """
        goal = handle.goal
        if Duty.CANCEL in duty:
            self.port.send_cancel(goal.id, 0, wait=wait)
        if Duty.GOAL in duty and self.port.is_heard():
            with self.lock:
                # It may have been cancelled or lost while it had not been sent.
                receiver = (
                    None if goal.over else self._servers.find_receiver(goal, self.clock.now())
                )
                if receiver is not None:
                    goal.on_offered(*receiver)
            if receiver is not None:
                self.port.send_goal(goal.id, goal.stamp_ns, handle.body, receiver.server, wait=wait)
        if Duty.ASK in duty and not handle.asking:
            handle.asking = True
            self.port.ask(goal.id, partial(self._on_answered, goal.id))

    def _on_answered(self, goal_id: str) -> None:
        """Note that a question was answered, or that its time is over."""
        handle = self._goals.get(goal_id)
        if handle is not None:
            handle.asking = False


class ActionClient(Generic[A_co]):
    """Sends goals to an action server and follows each of them to its end.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        node: Where; the current node when None.
        server_lost_timeout: How long the server may be away before its goals are LOST [s]; within
            it a server that comes back is asked for what was missed. Peers find each other again
            within 8 s; a shorter time is warned of.
        status_list_timeout: How long a server that shows no token, as behind a bridge, may send no
            status list before it counts as gone and its goals are LOST [s].

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: one of the timeouts is no time, negative or without end.
        InvalidNameError: the name breaks the ROS rules.
        TransportError: the network session is closed.

    A client that the program drops leaves the name once its goals are over; until then their
    callbacks come.

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
        if 0 < grace < self.node.transport.rediscovery:
            log.warning(
                "action '%s': server_lost_timeout: got %g; on this network a link that was lost is "
                "found again within %g s, and goals may be LOST before. Try a longer one, or 0.",
                self.ns,
                grace,
                self.node.transport.rediscovery,
            )
        callbacks = CallbackQueue(self.node, f"{self.ns} client callbacks")
        self.manager = GoalManager(
            self.node,
            self.ns,
            make_client_port(self.node, self.ns, self.types, callbacks.spawn),
            callbacks,
            server_lost_timeout=grace,
            status_list_timeout=silence,
        )
        self._ids = GoalIDGenerator(f"/{self.node.full_name}", clock=self.node.clock)
        self._let_go = weakref.finalize(self, self.manager.let_go)
        self._let_go.atexit = False

    @property
    def ActionSpec(self) -> Any:  # noqa: N802  actionlib's name
        """The action class."""
        return self.types.action

    def stop(self) -> None:
        """Leave the name. Goals that run go on at the server; here they are LOST.

        A server with `on_client_lost="cancel"` cancels them, unless another client of the action
        is left in this session.
        """
        self._let_go.detach()
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
            InvalidDurationError: `timeout` is no time.

        Blocks: until then.
        """
        return self.manager.wait_for_server(check_wait(f"action '{self.ns}'", "timeout", timeout))

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
        limit = check_limit(f"action '{self.ns}'", "ack_timeout", ack_timeout)
        return self._begin(self.make_goal(goal, limit), transition_cb, feedback_cb)

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
                if state in _OVER:
                    handle.manager.callbacks.call(handle.settled.set)

            handle.on_state = on_state
        if feedback_cb is not None:
            handle.on_feedback = partial(handle.call_with_feedback, partial(feedback_cb, handle))
        handle.calls_back = transition_cb is not None or feedback_cb is not None
        self.manager.begin(handle)
        return handle

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
        limit = check_limit(f"action '{self.ns}'", "timeout", timeout)
        return self._send(self.make_goal(goal), limit)

    def follow(
        self: ActionClient[Spec[G, R, F]], goal_id: str, *, timeout: float | Duration | None = None
    ) -> SentGoal[R, F]:
        """Follow a goal sent in an earlier life of this program; as `send`, but by its id."""
        limit = check_limit(f"action '{self.ns}'", "timeout", timeout)
        return self._send(self.find_goal(goal_id), limit)

    def _send(self, handle: ClientGoalHandle, timeout: float | None) -> SentGoal[Any, Any]:
        sent: SentGoal[Any, Any] = SentGoal(handle, timeout)
        self.manager.begin(handle)
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

    def make_goal(self, goal: Any, ack_timeout: float | None = None) -> ClientGoalHandle:
        """Return a handle for a new goal, which `manager.begin` sends.

        Args:
            goal: The goal message (XGoal); later changes of it do not matter.
            ack_timeout: See `send_goal` [s].

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
        life = ClientGoal(goal_id, stamp_ns, ack_timeout=ack_timeout)
        return ClientGoalHandle(self.manager, life, self.manager.port.pack_goal(goal))

    def find_goal(self, goal_id: str, ack_timeout: float | None = None) -> ClientGoalHandle:
        """Return a handle for a goal sent earlier, which `manager.begin` asks for.

        Raises:
            ActionlibError: `goal_id` is no id.
        """
        if not isinstance(goal_id, str) or not goal_id:
            raise ActionlibError(
                f"action '{self.ns}': goal id: got {goal_id!r}; expected the id of a goal that "
                "was sent, SentGoal.id for example."
            )
        life = ClientGoal(goal_id, attached=True, ack_timeout=ack_timeout)
        return ClientGoalHandle(self.manager, life)
