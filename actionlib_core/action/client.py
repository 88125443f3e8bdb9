"""`ActionClient`: any number of goals at once, each followed through its handle.

Three objects hold a goal at its client: `ClientGoal` decides (`actionlib_core.goal.client`), the
`ClientGoalHandle` around it is what programs hold, and the client's `GoalManager` brings decisions,
network, time and callbacks together, under one lock.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import os
import threading
import weakref
from dataclasses import dataclass
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
from actionlib_core.action.sent_goal import SentGoal
from actionlib_core.clock import current_clock
from actionlib_core.exceptions import ActionException, ActionlibError, TransportError
from actionlib_core.goal.bounded import Backlog, Recent
from actionlib_core.goal.client import (
    STATUS_LIST_TIMEOUT_S,
    STATUSES,
    ClientGoal,
    Duty,
    KnownServers,
    Path,
)
from actionlib_core.goal.states import TERMINAL, CommState, Status, TerminalState
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
from actionlib_core.node import get_node
from actionlib_core.shutdown import current_shutdown
from actionlib_core.time import Time
from actionlib_core.wire.action_types import ActionTypes
from actionlib_core.wire.ports import make_client_port

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.clock import Clock, Event, Timer
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
    "GoalIDGenerator",
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

_OVER = frozenset({CommState.DONE, CommState.LOST})

A_co = TypeVar("A_co", covariant=True)
G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")


_count = itertools.count(1)  # one per process: `next` is atomic


class GoalIDGenerator:
    """Makes ids that differ from all others on the network.

    Args:
        name: What an id begins with; the name of the default node when None.
        clock: Gives the stamp; the current clock when None.

    Threads: any; ids never repeat within a process, those of a virtual clock never on that clock.
    """

    def __init__(self, name: str | None = None, *, clock: Clock | None = None) -> None:
        if name is None:
            name = get_node().name
        self._clock = clock
        self.name = ""
        self.set_name(name)

    def set_name(self, name: str) -> None:
        """Set what ids begin with.

        Args:
            name: Usually the node's name.
        """
        self.name = name

    def generate(self) -> tuple[str, int]:
        """Return a new id and its stamp [ns since the epoch]."""
        clock = self._clock if self._clock is not None else current_clock()
        stamp_ns = clock.time_ns()
        secs, nsecs = divmod(stamp_ns, 1_000_000_000)
        count = getattr(clock, "numbers", _count)  # a virtual clock's own: each run has the same
        return f"{self.name}-{next(count)}-{secs}.{nsecs}", stamp_ns

    def generate_ID(self) -> GoalID:  # noqa: N802  actionlib's name
        """Return a new id, stamped with the present time."""
        goal_id, stamp_ns = self.generate()
        return GoalID(stamp=Time(0, stamp_ns), id=goal_id)


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


@dataclass(slots=True, weakref_slot=True, eq=False, repr=False)
class ClientGoalHandle:
    """One goal as its client holds it. Two handles are equal when they are of one goal.

    Dropping the handle changes nothing: the goal is followed until it is over. ROS's attribute
    `comm_state_machine` is the handle itself.

    Attributes:
        manager: The client's goals.
        goal: The goal's life cycle.
        body: The packed goal message.
        on_state: Called under the manager's lock with each state passed; must only note it.
        on_feedback: The same, when feedback has come; None when nobody wants any.
        feedback: The feedback that nobody has taken, None while none has come; guarded by the
            manager's lock.
        keeps_result: The server is to keep the result until `acknowledge` is called.
        calls_back: The goal has callbacks, which `wait` waits for.
        settled: The goal is over and its last callback has returned, or nobody follows it.
        ended_at: When the goal was over [s, clock]; None while it is not.
        last_call: The callback that reports the goal's end has begun.
        asking: A question about the goal is under way.

    Threads: every method may be called from any thread and any callback.
    """

    manager: GoalManager
    goal: ClientGoal
    body: bytes = b""
    on_state: Callable[[CommState], object] | None = None
    on_feedback: Callable[[], object] | None = None
    feedback: Backlog[Any] | None = None
    keeps_result: bool = False
    calls_back: bool = False
    settled: bool = False
    ended_at: float | None = None
    last_call: bool = False
    asking: bool = False
    # Most goals are waited for once at most: these exist when somebody waits.
    _ended: Event | None = None
    _settled: Event | None = None
    _shown: CommState | None = None
    _shown_to: int = 0

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
        return 0 if self.feedback is None else self.feedback.dropped

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
        return self.settled and not self.goal.over

    def note_ended(self) -> None:
        """Wake those who wait for the goal's end. Needs the manager's lock."""
        if self._ended is not None:
            self._ended.set()

    def settle(self) -> None:
        """Note that the goal is over, or nobody follows it, and its last callback has returned."""
        with self.manager.lock:
            self.settled = True
            for event in (self._ended, self._settled):  # a goal that is forgotten ends both waits
                if event is not None:
                    event.set()

    def wait_ended(self, timeout: float | None) -> None:
        """Wait until the goal is over or nobody follows it, `timeout` [s] at most."""
        with self.manager.lock:
            if self.goal.over or self.settled:
                return
            ended = self._ended = self._ended or self.manager.clock.event()
        ended.wait(timeout)

    def wait_settled(self, timeout: float | None) -> bool:
        """Wait until the goal is settled, `timeout` [s] at most; return whether it is."""
        with self.manager.lock:
            if self.settled:
                return True
            settled = self._settled = self._settled or self.manager.clock.event()
        return settled.wait(timeout)

    def call(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        """Run a user callback, for which the goal stands in `state`, after those before it."""
        self.manager.callbacks.call(self._show, state, callback, *args)

    def _show(self, state: CommState, callback: Callable[..., object], *args: object) -> None:
        # The thread first: another one that reads in between must not take the state for its own.
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

    def keep_feedback(self, feedback: Any, size: int) -> None:
        """Keep feedback of `size` bytes for whoever wants it. Needs the manager's lock."""
        if self.on_feedback is None:  # the goal was forgotten since the feedback was read
            return
        if self.feedback is None:
            self.feedback = Backlog()
        dropped_before = self.feedback.dropped
        if self.feedback.add(feedback, size):
            self.on_feedback()
        elif not dropped_before:
            log.warning(
                "action '%s': the feedback of goal %s comes faster than it is taken, and the "
                "oldest of %d messages is dropped. Try a callback that takes no time.",
                self.manager.name,
                self.goal.id,
                len(self.feedback),
            )

    def take_feedback(self) -> Any:
        """Return the next feedback; None when none waits."""
        with self.manager.lock:
            return None if self.feedback is None else self.feedback.take()

    def drop_feedback_after(self, started: float, limit: float = FEEDBACK_S) -> None:
        """Drop what waits if the goal is over and a callback did not keep up.

        That is one that has taken longer than `limit` [s] since it `started` or, if that was later,
        since the end of the goal. What is dropped is counted and logged.
        """
        ended_at = self.ended_at
        if ended_at is None or self.manager.clock.now() < max(started, ended_at) + limit:
            return
        with self.manager.lock:
            dropped = 0 if self.feedback is None else self.feedback.drop_all()
        if dropped:
            log.warning(
                "action '%s': goal %s is over: the last %d messages of its feedback were dropped, "
                "%d in all, as its callback is slower than they came.",
                self.manager.name,
                self.goal.id,
                dropped,
                self.dropped_feedback,
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
        self._goals: dict[str, ClientGoalHandle] = {}  # by id, those that are not over
        self._ended: dict[str, None] = {}  # ids of the others: a `Recent`, written out for speed
        self._strangers = Recent(REMEMBERED)  # sessions that were reported
        self._acks: list[str] = []  # ids of goals whose result is here, for the next message
        self._ack_timer: Timer | None = None
        self._waiters: list[Event] = []  # for a server; woken once, they come again
        self._timer: Timer | None = None
        self._due = math.inf  # when the timer runs [s, clock]; without one, never
        self._closed = False
        self._dropped = False  # the last goal that ends closes this
        port.open(self)  # last: the network tells at once of the servers that are there
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
            if self._timer is not None:
                self._timer.cancel()
            self._wake()
        # Without the lock: closing waits for callbacks of the network, which may wait for it.
        self._send_acks()
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
                    changed.clear()  # with the lock: a server that appears now sets it again
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
        heard = self.port.is_heard()  # asks the network, which may itself wait for our lock
        with self.lock:
            if self._closed:
                raise self._stopped()
            goal, now = handle.goal, self.clock.now()
            if goal.over:  # cancelled meanwhile, by another thread or a signal handler
                return
            known = self._goals.get(goal.id)
            if known is not None:
                self._take_over(known, handle)
                return
            error = self._servers.find_wrong_type()
            if error is not None:
                raise error
            duty, receiver = goal.begin(now), None
            if heard and duty is Duty.GOAL:
                receiver = self._servers.find_receiver(goal, now)
            if receiver is not None:
                goal.on_offered(*receiver)
            if goal.due < self._due:
                self._arm(goal.due)  # before the next line: it raises when there is no thread
            self._goals[goal.id] = handle  # before it is sent: the answer may be here at once
        if receiver is not None:
            self.port.send_goal(goal.id, goal.stamp_ns, handle.body, receiver.server)
        elif duty is Duty.ASK:
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
            handle.wait_settled(timeout)
            return goal.over
        deadline = None if timeout is None else self.clock.now() + timeout
        handle.wait_ended(timeout)
        if not goal.over or self.callbacks.is_inside():
            return goal.over
        now = self.clock.now()
        left = None if deadline is None else deadline - now
        ended_at = now if handle.ended_at is None else handle.ended_at
        patience = max(0.0, ended_at + CALLBACKS_S - now)
        first = patience if left is None else min(patience, left)
        if handle.wait_settled(first):
            return True
        if handle.last_call:
            handle.wait_settled(None if left is None else left - first)
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
            handle.settle()  # it stays in `_goals`, so that its result is acknowledged

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
                    self._pass(handle, goal.hear(entry, server.session, now), entry)
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
            self._hear_foreign(session, now)
        if not goals:  # so it is with most lists that a client hears: no lock for them
            return
        with self.lock:
            speaks, listed = servers.may_speak(session), set()
            for entry in entries:
                listed.add(entry.id)
                handle = goals.get(entry.id)
                if handle is not None and (speaks or self._believes(session, handle)):
                    goal = handle.goal
                    path = goal.hear(entry, session, now)
                    if path and handle.on_state is None and not goal.over and goal.due >= self._due:
                        continue  # nobody is to be told, and the timer looks in time
                    if path != ():
                        self._pass(handle, path, entry)
            if whole and (len(listed) < len(goals) or not listed.issuperset(goals)):
                answers = servers.current is not None
                for handle in list(goals.values()):
                    if handle.goal.id not in listed and handle.goal.server in {"", session}:
                        self._pass(handle, handle.goal.on_unlisted(now, answers=answers))
                        self._arm(handle.goal.due)

    def _hear_foreign(self, session: str, now: float) -> None:
        """Take a status list of a session that may stand for a server without a token."""
        with self.lock:
            if self._servers.hear_foreign(session, now):
                self._hurry(now)
                self._wake()
            if self._goals and session in self._servers.foreign:
                self._arm(self._servers.foreign[session])

    def _believes(self, session: str, handle: ClientGoalHandle) -> bool:
        """Tell whether a session may speak of a goal; report one that may not."""
        goal = handle.goal
        its_own = goal.acknowledged and session == goal.server
        if its_own or self._servers.may_speak(session):
            return True
        self.on_stranger(session)
        return False

    def on_feedback(self, entry: StatusEntry, body: bytes, session: str) -> None:
        """Handle feedback."""
        handle = self._goals.get(entry.id)
        if handle is None:
            return
        if not self._believes(session, handle):
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
                self._pass(handle, goal.hear(entry, session, now), entry)
            if feedback is not None:
                handle.keep_feedback(feedback, len(body))

    def on_result(
        self, entry: StatusEntry, body: bytes | None, session: str, *, answered: bool = False
    ) -> None:
        """Handle a result; `answered`: it was asked for, and without a `body` is not kept."""
        handle = self._goals.get(entry.id)
        if handle is None:
            if entry.id in self._ended:  # the first acknowledgement was lost
                self.acknowledge(entry.id)
            return
        if not (answered or self._believes(session, handle)):
            return
        status, text, result = STATUSES.get(entry.status, Status.LOST), entry.text, None
        if body is not None:
            try:
                result = self.port.read_result(body)
            except (ValueError, ActionlibError) as error:
                status, text = Status.LOST, f"the result cannot be read: {error}"
        if not handle.keeps_result:
            self.acknowledge(entry.id)
        with self.lock:
            goal, now = handle.goal, self.clock.now()
            if session:
                goal.server = session
            path = goal.on_result(status, text, result, now)
            if path:
                self._finish(handle, path)

    def follows(self, goal_id: str) -> bool:
        """Return whether a goal is followed, and not over."""
        return goal_id in self._goals

    def on_answer(self, entry: StatusEntry, session: str = "") -> None:
        """Handle a status that was asked for: there is no result, or not yet."""
        handle = self._goals.get(entry.id)
        if handle is None:
            return
        if STATUSES.get(entry.status) in TERMINAL:
            self.on_result(entry, None, session, answered=True)
            return
        with self.lock:
            if entry.status != Status.LOST:
                now = self.clock.now()
                self._pass(handle, handle.goal.hear(entry, session, now), entry)
            elif not self._servers.conflict:  # else another server may have it
                self._pass(handle, handle.goal.on_unknown(entry.text))

    def acknowledge(self, goal_id: str) -> None:
        """Tell the server, soon, that a result has arrived."""
        with self.lock:
            if self._closed:
                return
            self._acks.append(goal_id)
            count = len(self._acks)
            if count == 1:
                self._ack_timer = self.clock.call_later(TICK_S, self._send_acks)
        if count >= ACK_AT:
            self._send_acks()

    def _send_acks(self) -> None:
        with self.lock:
            acks, self._acks = self._acks, []
            if self._ack_timer is not None:
                self._ack_timer.cancel()
        if acks:
            self.port.acknowledge(acks)

    def _pass(
        self, handle: ClientGoalHandle, path: Path | None, entry: StatusEntry | None = None
    ) -> None:
        """Act on the states that a goal has passed, by `entry`. Needs the lock."""
        if path is None:
            log.error("action '%s': unknown status %s of a goal", self.name, entry)
        if not path:
            return
        goal = handle.goal
        if goal.over:
            self._finish(handle, path)
            return
        if handle.on_state is not None:
            for state in path:
                handle.on_state(state)
        if goal.due < self._due:
            self._arm(goal.due)

    def _finish(self, handle: ClientGoalHandle, path: Path) -> None:
        """Follow a goal that is over no more, and say so. Needs the lock."""
        now = self.clock.now()
        self._goals.pop(handle.goal.id, None)
        self._ended[handle.goal.id] = None
        if len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]
        handle.ended_at = now
        if self._dropped and not self._goals:
            self.let_go()
        if handle.on_state is None and handle.on_feedback is None:
            handle.settle()
            return
        handle.note_ended()
        if handle.on_state is None:
            self.callbacks.call(handle.settle)  # behind the last feedback
        else:
            for state in path:
                handle.on_state(state)  # settles the handle behind the callbacks it queues
        # They hold the handle and maybe its client, which would stay until a garbage collection.
        handle.on_state = handle.on_feedback = None

    # -- time, and what is sent ----------------------------------------------------------------

    def _arm(self, due: float) -> None:
        """Let the timer run at `due` or a little later. Needs the lock."""
        if self._closed or self._due <= due:  # too early does no harm: it looks, and is set anew
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = self.clock.call_later(due - self.clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        now = self.clock.now()
        duties = []  # fulfilled without the lock, which the network's threads wait for
        with self.lock:
            self._timer, self._due = None, math.inf
            if self._closed:
                return
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
                now = self.clock.now()
                receiver = None if goal.over else self._servers.find_receiver(goal, now)
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
                    handle.manager.callbacks.call(handle.settle)

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
