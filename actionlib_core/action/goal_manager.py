"""`GoalManager`: follows the goals of all clients of an action on one node.

Three objects follow a goal at its client. `ClientGoal` (`actionlib_core.goal.client`) makes the
decisions, `ClientGoalHandle` is the program's view of it, and `GoalManager` connects them with the
network, the clock and the callbacks, under one lock. All clients of an action on one node share a
manager: each result and status list is read once, however many clients there are.

The lock is held neither while user callbacks run nor while messages are sent: both may block, or
lead back into the client.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import os
import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core import border
from actionlib_core.clock import SerialExecutor
from actionlib_core.clock._deadlines import Deadlines
from actionlib_core.exceptions import ActionlibError, TransportError
from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.client import STATUS_LIST_TIMEOUT_S, STATUSES, Duty, KnownServers
from actionlib_core.goal.states import TERMINAL, CommState, Status
from actionlib_core.shutdown import current_shutdown
from actionlib_core.wire.absence import ABSENT_S

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.action._callbacks import CallbackQueue
    from actionlib_core.action.client_goal_handle import ClientGoalHandle
    from actionlib_core.clock import Event, Timer
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.client import Path
    from actionlib_core.goal.ports import ClientPort, Server, StatusEntry
    from actionlib_core.node import Node

log = logging.getLogger(__name__)

# At first the token of a server of a wrong type may be found before that of the right one.
MISMATCH_S = 0.2
TICK_S = 0.05  # repetitions and acknowledgements due within this time are sent together
ACK_AT = 64  # this number of waiting acknowledgements is sent at once
REPEATED_AT_ONCE = 100  # goals for which something is sent again in one tick
REMEMBERED = 1024  # ids of ended goals whose result may arrive again
LATE_S = 2.0  # a timer that is so late means that this process stood still
UNREAD_S = 1.0  # what servers have sent meanwhile is read within this time
CALLBACKS_S = 1.0  # `wait` gives callbacks this time to return after the goal's end

STOPPED = "the action client was stopped"
UNSURE = " and had not acknowledged the goal, which may or may not have begun"

_managers: weakref.WeakSet[GoalManager] = weakref.WeakSet()


def _renew_locks() -> None:
    """Replace the locks in a forked child: a thread that held one exists only in the parent."""
    for manager in _managers:
        manager.lock = threading.RLock()


os.register_at_fork(after_in_child=_renew_locks)


class Owner:
    """One client among those that share a manager. It outlives a dropped `ActionClient`.

    Attributes:
        manager: The goals of all of them.
        callbacks: Runs the user callbacks of this client.
        running: Number of its goals that are not over; guarded by the manager's lock.
        closed: It was stopped.
        dropped: By the program: the end of its last goal stops it.
    """

    __slots__ = ("__weakref__", "callbacks", "closed", "dropped", "manager", "running")
    manager: GoalManager

    def __init__(self, callbacks: CallbackQueue) -> None:
        self.callbacks = callbacks
        self.running = 0
        self.closed = self.dropped = False

    def let_go(self) -> None:
        """Close as soon as no goal runs any more; called when the program has dropped the client.

        Threads: any, at any moment: also in a garbage collection, where this thread may hold the
            lock halfway through a change. So another thread does the work.
        """
        self.manager.node.let_go(self._close_when_idle)

    def _close_when_idle(self) -> None:
        with self.manager.lock:
            self.dropped = True
            idle = not self.running
        if idle:
            self.manager.leave(self)


class GoalManager:
    """The goals of all clients of an action on one node.

    Args:
        node: The clients' node, whose clock counts.
        name: The action's full name.
        port: Their connection to the network.
        spawn: Starts a named thread.
        key: Under which the node shares it (see `Node.shared`); None if it does not.
        server_lost_timeout: How long a server may be away before its goals are LOST [s].
        status_list_timeout: How long a server without a token may be silent before its goals are
            LOST [s].

    Attributes:
        lock: Guards the goals. User callbacks run without it, in the clients' queues.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        port: ClientPort,
        spawn: Callable[[Callable[[], object], str], object],
        *,
        key: tuple[Any, ...] | None = None,
        server_lost_timeout: float,
        status_list_timeout: float = STATUS_LIST_TIMEOUT_S,
    ) -> None:
        self.node = node
        self.name = name
        self.port = port
        self._spawn = spawn
        self._key = key
        self.clock = node.clock
        self.lock = threading.RLock()
        self._owners: set[Owner] = set()
        _managers.add(self)
        self._server_lost_timeout = server_lost_timeout
        self._status_list_timeout = status_list_timeout
        self._servers = KnownServers(status_list_timeout)
        self._gone: dict[Server, str] = {}  # servers that are away -> what has happened to them
        self._goals: dict[str, ClientGoalHandle] = {}  # by id, those that are not over
        # Ids of ended ones, a `Recent`, written out for speed; with the handle if the server was to
        # keep the result.
        self._ended: dict[str, ClientGoalHandle | None] = {}
        self._strangers = Recent(REMEMBERED)  # sessions that were reported
        self._acks: list[str] = []  # goal ids for the next acknowledgement message
        self._ack_timer: Timer | None = None
        self._absence_told = False
        self._absence_timer: Timer | None = None
        self._waiters: list[Event] = []  # of `wait_for_server`; each waking removes them
        # When to look at which goal; not again if there was an earlier look, or it has ended.
        self._looks: Deadlines[tuple[float, ClientGoalHandle]] = Deadlines(self._is_planned)
        self._numbers = itertools.count()
        self._sender = SerialExecutor(node.clock, f"{name} repetitions")
        self._timer: Timer | None = None
        self._due = math.inf  # when the timer runs [s, clock]; without one, never
        self._closed = False
        self._open = True  # to more clients
        port.open(self)  # last, as it already reports the servers that are there
        self._forget_on_close = node.on_close(self.close)

    def join(self, owner: Owner) -> bool:
        """Add a client; return whether that was possible: not if this is closed already."""
        with self.lock:
            if self._open:
                self._owners.add(owner)
            return self._open

    def _tell(self, what: border.What, key: str, value: Any = None, *said: str) -> None:
        """Tell the listeners of the border; call it if there are any."""
        border.tell(what, self.node, self.name, "", key, value, *said)

    def leave(self, owner: Owner) -> None:
        """Stop a client: its goals are LOST. The last one withdraws from the network."""
        with self.lock:
            if owner.closed:
                return
            for handle in list(self._goals.values()) if owner.running else ():
                if handle.owner is owner:
                    self._pass(handle, handle.goal.lose(STOPPED))
            owner.closed = True
            self._owners.discard(owner)
            last = not self._owners
            self._open = self._open and not last  # a new client gets a new manager
            self._wake()
        if last:
            self.close()

    def close(self, why: str = STOPPED) -> None:
        """Withdraw from the network; goals that still run are LOST for all clients."""
        with self.lock:
            if self._closed:
                return
            for handle in list(self._goals.values()):
                self._pass(handle, handle.goal.lose(why))
            self._closed, self._open = True, False
            for owner in self._owners:
                owner.closed = True
            self._forget_on_close()
            if self._key is not None:
                self.node.unshare(self._key, self)
            for timer in (self._timer, self._absence_timer):
                if timer is not None:
                    timer.cancel()
            self._wake()
        # Without the lock: closing waits for the network's callbacks, which may wait for the lock.
        self._send_acks()
        self.port.close()

    # -- calls of the program ------------------------------------------------------------------

    def wait_for_server(self, owner: Owner, timeout: float | None) -> bool:
        """Wait for a server; return whether there is one.

        Raises:
            TypeMismatchError: there is one of another type.

        Blocks: until then or until the client is stopped, `timeout` [s] at most. None: no limit
            except the program's shutdown.
        """
        started = self.clock.now()
        # Only if there is time for `explain_absence`, which takes up to 1 s.
        if timeout is None or timeout > ABSENT_S + 1.0:
            if self._await_server(owner, started + ABSENT_S, ends=timeout is None):
                return True
            if not (owner.closed or (timeout is None and current_shutdown().requested())):
                self._tell_absence()
        deadline = None if timeout is None else started + timeout
        return self._await_server(owner, deadline, ends=timeout is None)

    def _await_server(self, owner: Owner, deadline: float | None, *, ends: bool) -> bool:
        """Wait for a server until `deadline` [s, clock]; `ends`: or until shutdown is requested."""
        changed = self.clock.event()
        ending = current_shutdown()
        forget = ending.on_shutdown(changed.set) if ends else None
        try:
            while True:
                with self.lock:
                    if owner.closed:
                        return False
                    if self._servers.is_there:
                        return True
                    error = self._servers.find_wrong_type()
                    if error is not None:
                        raise error
                    # Under the lock, so that a server that appears from now on sets it again.
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
        """Log, once until there is a server, where it was looked for and what there is.

        Blocks: as `ClientPort.explain_absence`.
        """
        with self.lock:
            if self._absence_told or self._closed or self._servers.is_there:
                return
            self._absence_told = True
        with contextlib.suppress(TransportError):  # the session is closed: the wait ends with it
            why = self._lost_with("all servers") or self.port.explain_absence()
            log.warning("action '%s': no server after %g s: %s", self.name, ABSENT_S, why)

    def _tell_absence_later(self) -> None:
        """Tell of a missing server when a goal has waited for it for some time. Needs the lock."""
        told = self._absence_told or self._absence_timer is not None
        if not told and not self._servers.is_there:
            self._absence_timer = self.clock.call_later(ABSENT_S, self._on_absent)

    def _on_absent(self) -> None:
        """Tell of a missing server, in another thread, if a goal waits for one."""
        with self.lock:
            self._absence_timer = None
            waits = any(not handle.goal.acknowledged for handle in self._goals.values())
        if waits:
            self._spawn(self._tell_absence, f"{self.name} absence")

    def begin(self, handle: ClientGoalHandle) -> None:
        """Follow a goal: send it, or query the server for one that was sent before.

        Raises:
            ActionlibError: the goal is followed already.
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        heard = self.port.is_heard()  # without the lock, for which the network's threads may wait
        with self.lock:
            if handle.owner.closed:
                raise self._stopped()
            goal, now = handle.goal, self.clock.now()
            if goal.over:  # cancelled before it was sent, by another thread or a signal handler
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
            # Before the goal is registered: starting a timer raises when no thread can be started.
            if receiver is not None:
                goal.on_offered(*receiver)
            else:
                self._tell_absence_later()
            if not self._register(handle):  # before sending: the answer may arrive at once
                return
        if receiver is not None:
            self.port.send_goal(
                goal.id,
                goal.stamp_ns,
                handle.body,
                receiver.server,
                age=now - goal.made_at,
                cancel_if_lost=handle.cancel_if_lost,
            )
        elif duty is Duty.ASK:
            self._fulfil(handle, duty)

    def _register(self, handle: ClientGoalHandle) -> bool:
        """Follow a goal from now on. Needs the lock, which a signal handler of this thread has too.

        Returns:
            Whether no such handler has cancelled it meanwhile.
        """
        self._look(handle)
        self._goals[handle.goal.id] = handle
        self._count(handle.owner, 1)
        if handle.goal.over and self._goals.pop(handle.goal.id, None) is not None:
            self._count(handle.owner, -1)  # as `_finish`, for which it came too early
        return not handle.goal.over

    def give_up(self, handle: ClientGoalHandle) -> None:
        """Cancel a goal if `begin` was interrupted once it was followed: nobody has its handle.

        A goal that was sent earlier is only no longer followed.
        """
        if self._goals.get(handle.goal.id) is not handle:
            return
        if handle.goal.attached:
            self.forget(handle)
            return
        with contextlib.suppress(TransportError):  # the session is closed, the reason to give up
            self.cancel(handle)

    def _count(self, owner: Owner, more: int) -> None:
        """Count the goals of a client; a dropped one ends with the last. Needs the lock."""
        owner.running += more
        if owner.dropped and not owner.running:
            owner.let_go()

    def follows_for_another(self, owner: Owner, goal_id: str) -> bool:
        """Return whether another client than `owner` follows a goal."""
        handle = self._goals.get(goal_id)
        return handle is not None and not handle.forgotten and handle.owner is not owner

    def _take_over(self, known: ClientGoalHandle, handle: ClientGoalHandle) -> None:
        """Let a new handle follow a forgotten goal that still runs. Needs the lock."""
        if not known.forgotten:
            raise ActionlibError(
                f"goal {known.goal.id} on '{self.name}': this client follows it already."
            )
        ack_timeout = handle.goal.ack_timeout
        goal = handle.goal = known.goal
        handle.body, handle.asking = known.body, known.asking
        handle.cancel_if_lost, handle.sender = known.cancel_if_lost, known.sender
        goal.limit_ack(ack_timeout, self.clock.now())
        self._goals[goal.id] = handle
        self._count(handle.owner, 1)
        self._count(known.owner, -1)
        self._look(handle)
        if goal.comm is not CommState.WAITING_FOR_GOAL_ACK:
            self._pass(handle, (goal.comm,))

    def cancel(self, handle: ClientGoalHandle) -> None:
        """Cancel a goal."""
        with self.lock:
            duty = self._cancel(handle)
        self._fulfil(handle, duty)

    def _cancel(self, handle: ClientGoalHandle) -> Duty:
        """Mark a goal as cancelled; return what to send. Needs the lock."""
        if border.listeners:
            self._tell("cancel", handle.goal.id)
        path, duty = handle.goal.cancel(self.clock.now())
        self._pass(handle, path)
        self._look(handle)
        return duty

    def cancel_many(self, stamp_ns: int) -> None:
        """Cancel the goals of all clients: all of them (0), or those at or before a stamp [ns].

        That message is sent only once. Our own goals among them are also cancelled by id, which is
        repeated until the server answers.

        Raises:
            TransportError: the client is stopped.
        """
        now, now_ns = self.clock.now(), self.clock.time_ns()
        with self.lock:
            if self._closed:
                raise self._stopped()
            meant = [
                handle
                for handle in list(self._goals.values())
                if not stamp_ns or handle.goal.is_before(stamp_ns, now, now_ns)
            ]
            duties = [(handle, self._cancel(handle)) for handle in meant]
        self.port.send_cancel("", stamp_ns)
        for handle, duty in duties:
            if not handle.goal.acknowledged:  # the cancel may arrive before the goal itself
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
        # Inside a callback, waiting for callbacks would wait for itself.
        if not goal.over or handle.owner.callbacks.is_inside():
            return goal.over
        # The callbacks have until `CALLBACKS_S` after the goal's end, within the timeout.
        now = self.clock.now()
        left = None if deadline is None else deadline - now
        ended_at = now if handle.ended_at is None else handle.ended_at
        patience = max(0.0, ended_at + CALLBACKS_S - now)
        first = patience if left is None else min(patience, left)
        if handle.wait_settled(first):
            return True
        if handle.last_call:  # the program's own done callback: wait for it as in ROS
            handle.wait_settled(None if left is None else left - first)
        elif first == patience:
            log.warning(
                "action '%s': goal %s is over, but a callback of this client has not returned for "
                "%g s and delays the others. Try a faster callback.",
                self.name,
                goal.id,
                CALLBACKS_S,
            )
        return True

    def forget(self, handle: ClientGoalHandle) -> None:
        """Stop following a goal, which runs on. Its result is acknowledged when it arrives."""
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
                if border.listeners:
                    self._tell("server", server.session)
                for old in (server, *replaced):
                    self._gone.pop(old, None)
                for old in replaced:
                    self._lose_goals_of(old, f"restarted as session {server.session}")
                self._hurry(now, every=returned)
            elif self._servers.find_wrong_type() is not None:
                self.clock.call_later(MISMATCH_S, self._lose_mismatched)
            self._wake()

    def _lose_mismatched(self) -> None:
        """Lose the goals that wait for a server, if all servers are of another type."""
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
            if border.listeners:
                self._tell("gone", server.session, None, "", why)
            # A server that has said farewell does not come back: its goals are lost now. Of others
            # it is known a moment later whether only the link to them is lost.
            wait = max(self._server_lost_timeout, self.port.link_delay)
            if self._servers.has_said_farewell(server) or wait <= 0:
                self._lose_goals_of(server, why)
            else:
                until = self.clock.now() + wait
                self._gone[server] = why
                self._servers.expect_back(server, until)
                self._arm(until)

    def on_farewell(self, entries: list[StatusEntry], server: Server) -> None:
        """Handle and acknowledge the last list of a server that leaves.

        A goal missing in it was not taken by the server and will be sent to the next one.
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
                    self._pass(handle, goal.on_entry(entry, server.session, now), entry)
                elif goal.server in {"", server.session}:
                    self._pass(handle, goal.on_untaken(now))
            acks, self._acks = self._acks, []
        self.port.acknowledge(acks, farewell=True)

    def on_stranger(self, session: str) -> None:
        """Report, once, a session whose messages about goals are dropped."""
        with self.lock:
            known = session in self._strangers
            self._strangers.add(session)
        if not known:
            log.error(
                "action '%s': session %s sends as the action's server without being it: its "
                "messages are dropped. Try access rules if it is an intruder, or a token if it is "
                "a server.",
                self.name,
                session or "unknown",
            )

    def _wake(self) -> None:
        """Wake the threads that wait for a server, as there may be one. Needs the lock."""
        if self._servers.is_there:
            self._absence_told = False
        waiters, self._waiters = self._waiters, []
        for event in waiters:
            event.set()

    def _hurry(self, now: float, *, every: bool = False) -> None:
        """Send now what waits for a server; with `every`, query all other goals too.

        Needs the lock.
        """
        for handle in self._goals.values():
            if every or not handle.goal.acknowledged:
                handle.goal.hurry(now)
                self._look(handle)

    def _lose_goals_of(self, server: Server, what: str) -> None:
        """Lose the goals that a server has, or may have. Needs the lock."""
        who = f"the action server of node '{server.node}' (session {server.session})"
        self._lose_goals(self._servers.forget(server), self._lost_with(who) or f"{who} {what}")

    def _lost_with(self, who: str) -> str:
        """Return that the link to all servers is lost, and so are they; "" if it is not lost."""
        link = self.port.lost_link
        return link and f"the link to {link} is lost, and with it {who}, which may still be running"

    def _lose_goals(self, sessions: Collection[str], reason: str) -> None:
        """Lose the goals that these sessions have, or may have. Needs the lock."""
        for handle in list(self._goals.values()):
            goal = handle.goal
            if goal.offered and goal.server in sessions:
                self._pass(handle, goal.lose(reason if goal.acknowledged else reason + UNSURE))

    # -- messages about goals ------------------------------------------------------------------

    def on_statuses(self, entries: list[StatusEntry], session: str, *, whole: bool = True) -> None:
        """Handle a status list, or with `whole` false a part of one."""
        now = self.clock.now()
        servers, goals = self._servers, self._goals
        if servers.current is None or session in servers.foreign:
            self._on_foreign_list(session, now)
        if not goals:  # the usual case of an idle client: needs no lock
            return
        with self.lock:
            speaks, listed = servers.may_speak(session), set()
            for entry in entries:
                listed.add(entry.id)
                handle = goals.get(entry.id)
                if handle is not None and (speaks or self._believes(session, handle)):
                    goal = handle.goal
                    path = goal.on_entry(entry, session, now)
                    quiet = path and handle.on_state is None and not goal.over
                    if quiet and goal.due >= handle.look_at:
                        continue  # what `_pass` would do here is nothing: saves the call
                    if path != ():
                        self._pass(handle, path, entry)
            if whole and (len(listed) < len(goals) or not listed.issuperset(goals)):
                answers = servers.current is not None
                for handle in list(goals.values()):
                    if handle.goal.id not in listed and handle.goal.server in {"", session}:
                        self._pass(handle, handle.goal.on_unlisted(now, answers=answers))
                        self._look(handle)

    def _on_foreign_list(self, session: str, now: float) -> None:
        """Handle a status list of a session that may be a server without a token."""
        with self.lock:
            if self._servers.on_foreign_list(session, now):
                self._hurry(now)
                self._wake()
            if self._goals and session in self._servers.foreign:
                self._arm(self._servers.foreign[session])

    def _believes(self, session: str, handle: ClientGoalHandle) -> bool:
        """Return whether a session may send about a goal; report one that may not."""
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
        feedback = None  # decoded without the lock, and only if it is wanted
        if handle.on_feedback is not None:
            try:
                feedback = self.port.read_feedback(body)
            except (ValueError, ActionlibError) as error:
                log.error("action '%s': feedback cannot be read: %s", self.name, error)  # noqa: TRY400
                return
            if border.listeners and handle.wants_feedback:
                self._tell("feedback", entry.id, feedback)
        with self.lock:
            goal, now = handle.goal, self.clock.now()
            if goal.over:
                return
            # The usual case, many times a second, without the rest of `on_entry`.
            if entry.status == goal.status and session == goal.server and goal.acknowledged:
                goal.on_sign_of_life(now)
            else:
                self._pass(handle, goal.on_entry(entry, session, now), entry)
            if feedback is not None:
                handle.keep_feedback(feedback, len(body))

    def on_result(
        self, entry: StatusEntry, body: bytes | None, session: str, *, answered: bool = False
    ) -> None:
        """Handle a result. `answered`: it is the reply to a query; `body` None: no longer kept."""
        handle = self._goals.get(entry.id)
        if handle is None:
            self._on_repeated_result(entry.id)
            return
        if not (answered or self._believes(session, handle)):
            return
        status, result, unreadable = STATUSES.get(entry.status, Status.LOST), None, ""
        if body is not None:
            try:
                result = self.port.read_result(body)
            except (ValueError, ActionlibError) as error:
                unreadable = f"the server sent a result that cannot be read: {error}"
        if not handle.keeps_result:
            self.acknowledge(entry.id)
        with self.lock:
            goal, now = handle.goal, self.clock.now()
            if session:
                goal.server = session
            if unreadable:
                path = goal.lose(unreadable)
            else:
                path = goal.on_result(status, entry.text, result, now)
            if path:
                self._finish(handle, path)

    def _on_repeated_result(self, goal_id: str) -> None:
        """Acknowledge the result of an ended goal again, as our acknowledgement was lost."""
        if goal_id in self._ended:
            ended = self._ended.get(goal_id)
            if ended is None or not ended.keeps_result:
                self.acknowledge(goal_id)

    def follows(self, goal_id: str) -> bool:
        """Return whether a goal is followed and has not ended."""
        return goal_id in self._goals

    def on_answer(self, entry: StatusEntry, session: str = "") -> None:
        """Handle the status in reply to a query: there is no result, or not yet."""
        handle = self._goals.get(entry.id)
        if handle is None:
            return
        if STATUSES.get(entry.status) in TERMINAL:
            self.on_result(entry, None, session, answered=True)
            return
        with self.lock:
            if entry.status != Status.LOST:
                now = self.clock.now()
                self._pass(handle, handle.goal.on_entry(entry, session, now), entry)
            elif not self._servers.conflict:  # of two servers, the other may have the goal
                self._pass(handle, handle.goal.on_unknown(entry.text))

    def acknowledge(self, goal_id: str) -> None:
        """Acknowledge a result, together with others of the next `TICK_S`."""
        with self.lock:
            if self._closed:
                return
            self._acks.append(goal_id)
            if goal_id in self._ended:
                self._ended[goal_id] = None
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
            # Without the session, the server keeps the results until their time is over.
            with contextlib.suppress(TransportError):
                self.port.acknowledge(acks)

    def _pass(
        self, handle: ClientGoalHandle, path: Path | None, entry: StatusEntry | None = None
    ) -> None:
        """Report the states that a goal has passed because of `entry`. Needs the lock."""
        if path is None:
            log.error("action '%s': unknown status %s of a goal", self.name, entry)
        if not path:
            return
        goal = handle.goal
        if goal.over:
            self._finish(handle, path)
            return
        if border.listeners:
            self._tell("status", goal.id, None, goal.status.name, goal.text)
        if handle.on_state is not None:
            for state in path:
                handle.on_state(state)
        self._look(handle)

    def _finish(self, handle: ClientGoalHandle, path: Path) -> None:
        """Stop following a goal that has ended, and report its end. Needs the lock."""
        now = self.clock.now()
        if border.listeners:
            goal = handle.goal
            self._tell("end", goal.id, goal.result, goal.status.name, goal.text)
        if self._goals.pop(handle.goal.id, None) is not None:  # else it was never sent
            self._count(handle.owner, -1)
        self._ended[handle.goal.id] = handle if handle.keeps_result else None
        if len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]
        handle.ended_at = now
        # Without callbacks, the goal is settled at once, without a thread.
        if handle.on_state is None and handle.on_feedback is None:
            handle.settle()
            return
        handle.note_ended()
        if handle.on_state is None:
            handle.owner.callbacks.call(handle.settle)  # queued behind the last feedback
        else:
            for state in path:
                handle.on_state(state)  # queues the callbacks and behind them `settle`
        # They refer to the handle and perhaps the client: a cycle, freed only by the collector.
        handle.on_state = handle.on_feedback = None

    # -- time and sending ----------------------------------------------------------------------

    def _look(self, handle: ClientGoalHandle) -> None:
        """Let the timer look at a goal when that is due. Needs the lock."""
        due = handle.goal.due
        if due >= handle.look_at:  # it looks earlier anyway, and then again
            return
        handle.look_at = due
        self._looks.push(due, next(self._numbers), (due, handle))
        if due < self._due:
            self._arm(due)

    @staticmethod
    def _is_planned(_number: int, look: tuple[float, ClientGoalHandle]) -> bool:
        due, handle = look
        return due == handle.look_at and not handle.goal.over

    def _arm(self, due: float) -> None:
        """Let the timer run at `due` at the latest. Needs the lock."""
        # One timer serves all goals. Running too early does no harm: it is then set again.
        if self._closed or self._due <= due:
            return
        timer = self.clock.call_later(due - self.clock.now(), self._on_timer)  # or it raises
        if self._timer is not None:
            self._timer.cancel()
        self._timer, self._due = timer, due

    def _look_at_goals(self, now: float) -> list[tuple[ClientGoalHandle, Duty]]:
        """Look at the goals that are due; return what to send for them. Needs the lock."""
        duties: list[tuple[ClientGoalHandle, Duty]] = []
        # The rest is for the next tick: repetitions for thousands of goals at once would keep a
        # busy server from the goals themselves.
        while len(duties) < REPEATED_AT_ONCE:
            first = self._looks.first()
            if first is None or first[0] > now:
                break
            _, handle = self._looks.pop()
            handle.look_at = math.inf
            if self._goals.get(handle.goal.id) is not handle:
                continue  # another handle follows the goal now, or it was never sent
            path, duty = handle.goal.tick(now, self.port.lost_link)
            self._pass(handle, path)
            if duty:
                duties.append((handle, duty))
            if not handle.goal.over:
                self._look(handle)
        return duties

    def _on_timer(self) -> None:
        now = self.clock.now()
        with self.lock:
            if now > self._due + LATE_S:
                self._servers.wait_longer(now + UNREAD_S)
                for handle in self._goals.values():
                    handle.goal.wait_longer(now + UNREAD_S)
            self._timer, self._due = None, math.inf
            if self._closed:
                return
            for server in self._servers.take_overdue(now):
                self._lose_goals_of(server, self._gone.pop(server, "is gone"))
            for session in self._servers.take_silent(now):
                who = f"the action server without a token (session {session or 'unknown'})"
                self._lose_goals(
                    {session},
                    self._lost_with(who)
                    or f"{who} has sent no status list for {self._status_list_timeout:g} s",
                )
            duties = self._look_at_goals(now)
            first = self._looks.first()
            dues = [] if first is None else [first[0]]
            dues.extend(self._servers.away.values())
            dues.extend(self._servers.foreign.values())
            if dues:
                self._arm(max(min(dues), now + TICK_S))
        # Without the lock, for which the network's threads may wait, and not in the timers' thread:
        # queries, which is all that ROS 2 has, wait while a link is full.
        if duties:
            self._sender.submit(partial(self._send_all, duties))

    def _send_all(self, duties: list[tuple[ClientGoalHandle, Duty]]) -> None:
        """Send what goals need again."""
        try:
            for handle, duty in duties:
                self._fulfil(handle, duty, wait=False)
        except TransportError as error:  # the program has closed the session, not the client
            if not self._closed:
                log.warning("action '%s': its goals are LOST: %s", self.name, error)
                self.close(str(error))

    def _fulfil(self, handle: ClientGoalHandle, duty: Duty, *, wait: bool = True) -> None:
        """Send what a goal needs; without `wait`, drop it when the link is full.

        A goal is sent only to one known server, so that it cannot run twice. Two things are needed:
        a subscription (a token may be known earlier, and the goal would be lost) and a server (the
        subscription may be another program's).
        """
        goal = handle.goal
        if Duty.CANCEL in duty:
            self.port.send_cancel(goal.id, 0, wait=wait)
        if Duty.GOAL in duty and self.port.is_heard():
            with self.lock:
                # It may have ended since the duty was decided.
                now = self.clock.now()
                receiver = None if goal.over else self._servers.find_receiver(goal, now)
                if receiver is not None:
                    goal.on_offered(*receiver)
            if receiver is not None:
                age = now - goal.made_at
                self.port.send_goal(
                    goal.id,
                    goal.stamp_ns,
                    handle.body,
                    receiver.server,
                    age=age,
                    wait=wait,
                    cancel_if_lost=handle.cancel_if_lost,
                )
        if Duty.ASK in duty and not handle.asking:
            handle.asking = True
            self.port.ask(goal.id, partial(self._on_answered, goal.id))

    def _on_answered(self, goal_id: str) -> None:
        """Note that a query was answered, or has timed out."""
        handle = self._goals.get(goal_id)
        if handle is not None:
            handle.asking = False
