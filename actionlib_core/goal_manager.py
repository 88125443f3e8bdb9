"""The goals of one action client, and what is done so that each of them comes to an end."""

from __future__ import annotations

import logging
import os
import threading
import weakref
from typing import TYPE_CHECKING, Any

from actionlib_core._action_wire import pack_goal
from actionlib_core._callbacks import CallbackQueue
from actionlib_core._client_port import ClientPort
from actionlib_core._core.client_goal import ClientGoal, Duty, Path
from actionlib_core._core.known_servers import KnownServers
from actionlib_core._core.recent import Recent
from actionlib_core._core.states import TERMINAL, CommState, Status
from actionlib_core.comm_state_machine import CommStateMachine
from actionlib_core.exceptions import ActionlibError, TransportError
from actionlib_core.shutdown import current_shutdown

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core._action_wire import ActionTypes, StatusEntry
    from actionlib_core.clock import Event, Timer
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint

log = logging.getLogger(__name__)

TICK_S = 0.05  # repetitions and acknowledgements due within this go out together
ACK_AT = 64  # so many acknowledgements go out at once
_ONLY_GOAL: Duty = Duty.GOAL
STATUSES = {int(status): status for status in Status}
UNSURE = " and had not acknowledged the goal, which may or may not have begun"
REMEMBERED = 1024  # ids of ended goals whose result may come again

_managers: weakref.WeakSet[GoalManager] = weakref.WeakSet()


def _free_locks() -> None:
    """Give a forked child locks of its own: who held one then is a thread of its parent."""
    for manager in _managers:
        manager._lock = threading.RLock()  # noqa: SLF001


os.register_at_fork(after_in_child=_free_locks)


class GoalManager:
    """The goals of one client. Registers a goal before it is sent; nothing that comes back is lost.

    Args:
        node: On whose network and clock.
        name: The action's full name.
        types: Its message classes.
        server_lost_timeout: How long a server may be away before its goals are LOST [s].

    Threads: every method may be called from any thread. One lock guards the goals; user callbacks
        run without it, in `callbacks`.
    """

    def __init__(
        self, node: Node, name: str, types: ActionTypes, *, server_lost_timeout: float
    ) -> None:
        self.node = node
        self.name = name
        self.types = types
        self.callbacks = CallbackQueue(node, f"{name} client callbacks")
        self._server_lost_timeout = server_lost_timeout
        self._clock = node.clock
        self._lock = threading.RLock()
        _managers.add(self)
        self._machines: dict[str, CommStateMachine] = {}
        self._ended = Recent(REMEMBERED)
        self._acks: list[str] = []
        self._servers = KnownServers()
        self._waiters: list[Event] = []
        self._timer: Timer | None = None
        self._due = 0.0
        self._closed = False
        self._port = ClientPort(node, name, types, self, self.callbacks.spawn)
        self._port.open()

    def close(self) -> None:
        """Acknowledge what has arrived, leave the name; goals that still run are LOST here."""
        with self._lock:
            if self._closed:
                return
            for machine in list(self._machines.values()):
                self._take(machine, machine.goal.lose("the action client was stopped"))
            self._closed = True
            acks, self._acks = self._acks, []
            if self._timer is not None:
                self._timer.cancel()
            self._wake()
        if acks:
            self._port.send_acks(acks, self._clock.time_ns())
        self._port.close()

    # -- servers -------------------------------------------------------------------------------

    @property
    def server(self) -> Endpoint | None:
        """The action's server, None while there is none of our type."""
        return self._servers.current

    def wait_for_server(self, timeout: float | None) -> bool:
        """Wait for a server; return whether there is one.

        Raises:
            TypeMismatchError: there is one of another type.

        Blocks: until then or until the client is stopped, `timeout` [s] at most; None: no limit,
            but until the program is to end.
        """
        deadline = None if timeout is None else self._clock.now() + timeout
        changed = self._clock.event()
        ending = current_shutdown()
        forget = ending.on_shutdown(changed.set) if timeout is None else None
        try:
            while True:
                with self._lock:
                    if self._closed:
                        return False
                    if self._servers.current is not None:
                        return True
                    self._servers.check_types()
                    changed.clear()
                    if changed not in self._waiters:
                        self._waiters.append(changed)
                left = None if deadline is None else deadline - self._clock.now()
                over = ending.requested() if left is None else left <= 0
                if over or (not changed.wait(left) and left is not None):
                    with self._lock:
                        if changed in self._waiters:
                            self._waiters.remove(changed)
                        return self._servers.current is not None
        finally:
            if forget is not None:
                forget()

    def _wake(self) -> None:
        waiters, self._waiters = self._waiters, []
        for event in waiters:
            event.set()

    def on_server(self, server: Endpoint, error: TypeMismatchError | None) -> None:
        """Take the appearance of a server."""
        now = self._clock.now()
        with self._lock:
            returned, replaced = self._servers.appear(server, error)
            if error is None:
                for old in replaced:
                    self._lose_goals_of(old, f"restarted as session {server.session}")
                self._hurry(now, every=returned)
            elif self._servers.current is None:
                for machine in list(self._machines.values()):
                    if not machine.goal.acknowledged:
                        self._take(machine, machine.goal.lose(str(error)))
            self._wake()

    def on_server_gone(self, server: Endpoint) -> None:
        """Take the disappearance of a server."""
        with self._lock:
            if not self._servers.vanish(server):
                return  # unknown, or of another type
            if self._servers.has_said_farewell(server) or self._server_lost_timeout <= 0:
                self._lose_goals_of(server, "is gone")
            else:
                until = self._clock.now() + self._server_lost_timeout
                self._servers.expect_back(server, until)
                self._arm(until)

    def on_farewell(self, entries: list[StatusEntry], server: Endpoint) -> None:
        """Take the last list of a server that leaves, and answer it.

        Any goal that it does not name it has not taken and never will: the next server gets it.
        """
        now = self._clock.now()
        taken = {entry.id: entry for entry in entries}
        with self._lock:
            if self._closed:
                return
            self._servers.say_farewell(server)
            for machine in list(self._machines.values()):
                goal = machine.goal
                entry = taken.get(goal.id)
                if entry is not None:
                    self._hear(machine, entry, server.session, now)
                elif goal.server in {"", server.session}:
                    self._take(machine, goal.on_untaken(now))
            acks, self._acks = self._acks, []
        self._port.send_acks(acks, self._clock.time_ns(), farewell=True)

    def _hear_foreign(self, session: str) -> None:
        """Take a status list while no server shows a token: send what waits for one."""
        now = self._clock.now()
        with self._lock:
            if self._servers.hear_foreign(session, now):
                self._hurry(now)

    def _hurry(self, now: float, *, every: bool = False) -> None:
        """Send at once what waits for a server; `every` goal, if it has to be asked for anew.

        Needs the lock.
        """
        for machine in self._machines.values():
            if every or not machine.goal.acknowledged:
                machine.goal.hurry(now)
        self._arm(now)

    def _lose_goals_of(self, server: Endpoint, what: str) -> None:
        """Give up the goals that a server has, or may have. Needs the lock."""
        reason = f"the action server of node '{server.node}' (session {server.session}) {what}"
        sessions = self._servers.forget(server)
        for machine in list(self._machines.values()):
            goal = machine.goal
            if goal.offered and goal.server in sessions:
                self._take(machine, goal.lose(reason if goal.acknowledged else reason + UNSURE))

    # -- what the user does --------------------------------------------------------------------

    def send(
        self,
        goal_id: str,
        stamp_ns: int,
        body: bytes,
        *,
        on_transition: Callable[[CommStateMachine, CommState], None] | None,
        on_feedback: Callable[[CommStateMachine, Any], None] | None,
        ack_timeout: float | None = None,
        created: Callable[[CommStateMachine], None] | None = None,
    ) -> CommStateMachine:
        """Send a goal.

        Args:
            goal_id: Its id.
            stamp_ns: Its stamp [ns since the epoch].
            body: The bytes of the XGoal.
            on_transition: See `CommStateMachine`, also for `on_feedback`.
            on_feedback: None when nobody wants any.
            ack_timeout: Without a server that takes it for so long [s] it is LOST.
            created: Called with the machine before anything can come back.

        Raises:
            TypeMismatchError: the action's server has another type.
            TransportError: the client is stopped.
        """
        goal = ClientGoal(goal_id, stamp_ns, ack_timeout=ack_timeout)
        machine = CommStateMachine(goal, self, body, on_transition, on_feedback)
        return self._begin(machine, created)

    def attach(
        self,
        goal_id: str,
        *,
        on_transition: Callable[[CommStateMachine, CommState], None] | None,
        on_feedback: Callable[[CommStateMachine, Any], None] | None,
        ack_timeout: float | None = None,
        created: Callable[[CommStateMachine], None] | None = None,
    ) -> CommStateMachine:
        """Follow a goal that was sent in an earlier life, or that `forget` was called for.

        Arguments and errors as `send`.

        Raises:
            ActionlibError: `goal_id` is none, or this client follows the goal.
        """
        if not isinstance(goal_id, str) or not goal_id:
            raise ActionlibError(
                f"action '{self.name}': goal id: got {goal_id!r}; expected the id of a goal that "
                "was sent, SentGoal.id for example."
            )
        goal = ClientGoal(goal_id, attached=True, ack_timeout=ack_timeout)
        machine = CommStateMachine(goal, self, b"", on_transition, on_feedback)
        return self._begin(machine, created)

    def _begin(
        self, machine: CommStateMachine, created: Callable[[CommStateMachine], None] | None
    ) -> CommStateMachine:
        """Follow a goal and send it, or ask for it; one that was forgotten is taken up again."""
        goal = machine.goal
        with self._lock:
            self._check_open()
            known = self._machines.get(goal.id)
            if known is not None:
                return self._take_up(known, machine, created)
            if self._servers.current is None:
                self._servers.check_types()
            now = self._clock.now()
            duty = goal.begin(now)
            self._machines[goal.id] = machine
            if created is not None:
                created(machine)
            self._arm(goal.due)
        self._fulfil(machine, duty)
        return machine

    def _take_up(
        self,
        known: CommStateMachine,
        wanted: CommStateMachine,
        created: Callable[[CommStateMachine], None] | None,
    ) -> CommStateMachine:
        """Follow a goal again that was forgotten and still runs. Needs the lock.

        Raises:
            ActionlibError: it is followed.
        """
        if not known.forgotten:
            raise ActionlibError(
                f"goal {known.goal.id} on '{self.name}': this client follows it already."
            )
        known.on_transition, known.on_feedback = wanted.on_transition, wanted.on_feedback
        known.settled = wanted.settled
        known.goal.limit_ack(wanted.goal.ack_timeout, self._clock.now())
        self._arm(known.goal.due)
        if created is not None:
            created(known)
        if known.goal.comm is not CommState.WAITING_FOR_GOAL_ACK:
            self._take(known, (known.goal.comm,))
        return known

    def cancel(self, machine: CommStateMachine) -> None:
        """Ask for a goal's end."""
        with self._lock:
            duty = self._cancel(machine)
        self._fulfil(machine, duty)

    def _cancel(self, machine: CommStateMachine) -> Duty:
        """Note that a goal is to end; return what to send. Needs the lock."""
        path, duty = machine.goal.cancel(self._clock.now())
        self._take(machine, path)
        self._arm(machine.goal.due)
        return duty

    def cancel_many(self, stamp_ns: int) -> None:
        """Cancel the goals of all clients: all of them (0), or those at or before a stamp [ns].

        This is said once. Our own goals among them are cancelled by their ids as well: that is
        repeated until the server has heard it.

        Raises:
            TransportError: the client is stopped.
        """
        with self._lock:
            self._check_open()
            meant = [
                machine
                for machine in list(self._machines.values())
                if not stamp_ns or 0 < machine.goal.stamp_ns <= stamp_ns
            ]
            duties = [(machine, self._cancel(machine)) for machine in meant]
        self._port.send_cancel("", stamp_ns)
        for machine, duty in duties:
            if not machine.goal.acknowledged:  # the goal itself may be on its way still
                self._fulfil(machine, duty)

    def _check_open(self) -> None:
        if self._closed:
            raise TransportError(f"action '{self.name}': the client is stopped.")

    def wait_until_over(self, machine: CommStateMachine, timeout: float | None) -> bool:
        """Wait until a goal is over, whatever its callbacks do; for use inside a callback.

        Returns:
            Whether it is over.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        with self._lock:
            if machine.goal.over:
                return True
            if machine.ended is None:
                machine.ended = self._clock.event()
            ended = machine.ended
        return ended.wait(timeout)

    def forget(self, machine: CommStateMachine) -> None:
        """Follow a goal no more; it runs on. Its result is acknowledged when it comes."""
        if machine.goal.over:
            return
        with self._lock:
            machine.on_transition = machine.on_feedback = None
            machine.settled.set()

    # -- what arrives --------------------------------------------------------------------------

    def on_statuses(self, entries: list[StatusEntry], server: str) -> None:
        """Take a status list."""
        if self._servers.current is None:
            self._hear_foreign(server)
        if not self._machines:
            return
        now = self._clock.now()
        with self._lock:
            listed = set()
            for entry in entries:
                listed.add(entry.id)
                machine = self._machines.get(entry.id)
                if machine is not None:
                    self._hear(machine, entry, server, now)
            if len(listed) < len(self._machines) or not listed.issuperset(self._machines):
                answers = self._servers.current is not None
                for machine in list(self._machines.values()):
                    if machine.goal.id not in listed:
                        self._take(machine, machine.goal.on_unlisted(now, answers=answers))
                        self._arm(machine.goal.due)

    def _hear(self, machine: CommStateMachine, entry: StatusEntry, server: str, now: float) -> None:
        status = STATUSES.get(entry.status)
        if status is None:
            log.error("action '%s': unknown status %d of a goal", self.name, entry.status)
            return
        if server:
            machine.goal.server = server
        if not machine.goal.stamp_ns:  # one that was attached to
            machine.goal.stamp_ns = entry.stamp_ns
        before = machine.goal.comm
        self._take(machine, machine.goal.on_status(status, entry.text, now))
        if machine.goal.comm is not before:
            self._arm(machine.goal.due)

    def on_feedback(self, entry: StatusEntry, payload: bytes, start: int, server: str) -> None:
        """Take feedback."""
        machine = self._machines.get(entry.id)
        if machine is None:
            return
        feedback = None
        if machine.on_feedback is not None:
            try:
                feedback = self.types.feedback.from_bytes(payload[start:])
            except (ValueError, ActionlibError) as error:
                log.error("action '%s': feedback cannot be read: %s", self.name, error)  # noqa: TRY400
                return
        with self._lock:
            goal = machine.goal
            if goal.over:
                return
            if entry.status == goal.status and server == goal.server and goal.acknowledged:
                goal.on_sign_of_life(self._clock.now())
            else:
                self._hear(machine, entry, server, self._clock.now())
            if machine.on_feedback is not None and feedback is not None:  # else just taken up
                machine.on_feedback(machine, feedback)

    def on_result(self, entry: StatusEntry, body: bytes, server: str) -> None:
        """Take a result."""
        machine = self._machines.get(entry.id)
        if machine is None:
            if entry.id in self._ended:
                self._acknowledge(entry.id)
            return
        status = STATUSES.get(entry.status, Status.LOST)
        text, result = entry.text, None
        try:
            result = self.types.result.from_bytes(body)
        except (ValueError, ActionlibError) as error:
            status, text = Status.LOST, f"the result cannot be read: {error}"
        self._end(machine, status, text, result, server)

    def on_answer(self, entry: StatusEntry) -> None:
        """Take a status as the answer to a question."""
        machine = self._machines.get(entry.id)
        if machine is None:
            return
        status = STATUSES.get(entry.status)
        if status in TERMINAL:
            self._end(machine, status, entry.text, None, "")
            return
        with self._lock:
            if status is Status.LOST:
                self._take(machine, machine.goal.on_unknown(entry.text))
            else:
                self._hear(machine, entry, "", self._clock.now())

    def _end(
        self, machine: CommStateMachine, status: Status, text: str, result: Any, server: str
    ) -> None:
        with self._lock:
            if server:
                machine.goal.server = server
            now = self._clock.now()
            self._take(machine, machine.goal.on_result(status, text, result, now))
        self._acknowledge(machine.goal.id)

    def _acknowledge(self, goal_id: str) -> None:
        with self._lock:
            if self._closed:
                return
            self._acks.append(goal_id)
            if len(self._acks) < ACK_AT:
                self._arm(self._clock.now() + TICK_S)
                return
            acks, self._acks = self._acks, []
        self._port.send_acks(acks, self._clock.time_ns())

    def _take(self, machine: CommStateMachine, path: Path) -> None:
        """Note the states a goal has passed. Needs the lock."""
        if not path:
            return
        if machine.goal.over:
            self._machines.pop(machine.goal.id, None)
            if machine.ended is not None:
                machine.ended.set()
            self._ended.add(machine.goal.id)
        if machine.on_transition is None:
            if machine.goal.over and machine.on_feedback is not None:
                self.callbacks.call(machine.settled.set)  # behind the last feedback
            elif machine.goal.over:
                machine.settled.set()
            return
        for state in path:
            machine.on_transition(machine, state)

    # -- time ----------------------------------------------------------------------------------

    def _arm(self, due: float) -> None:
        """Let the timer run at `due` or a little later. Needs the lock."""
        if self._closed or (self._timer is not None and self._due <= due):
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = self._clock.call_later(due - self._clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        now = self._clock.now()
        duties = []
        with self._lock:
            self._timer = None
            if self._closed:
                return
            acks, self._acks = self._acks, []
            for server in self._servers.take_overdue(now):
                self._lose_goals_of(server, "is gone")
            for machine in list(self._machines.values()):
                path, duty = machine.goal.tick(now)
                self._take(machine, path)
                if duty:
                    duties.append((machine, duty))
            dues = [machine.goal.due for machine in self._machines.values()]
            dues.extend(self._servers.away.values())
            if dues:
                self._arm(max(min(dues), now + TICK_S))
        if acks:
            self._port.send_acks(acks, self._clock.time_ns())
        for machine, duty in duties:
            self._fulfil(machine, duty)

    def _fulfil(self, machine: CommStateMachine, duty: Duty) -> None:
        """Send what a goal needs."""
        goal = machine.goal
        if duty is _ONLY_GOAL:  # by far the most frequent one
            self._offer(machine)
            return
        if Duty.CANCEL in duty:
            self._port.send_cancel(goal.id, 0)
        if Duty.GOAL in duty:
            self._offer(machine)
        if Duty.ASK in duty and not machine.asking:
            machine.asking = True
            self._port.ask(goal.id, machine.on_answered)

    def _offer(self, machine: CommStateMachine) -> None:
        """Send a goal if a server listens, to that one: then it cannot run twice.

        Others may listen, too, so that it is heard is not enough; and before its subscription is
        known, the token alone is not either.
        """
        goal = machine.goal
        if not self._port.is_heard():
            return
        with self._lock:
            if goal.over:  # cancelled or stopped while it had not been sent
                return
            if not self._servers.may_listen(self._clock.now()):
                return
            server, token = self._servers.current, self._servers.token
            goal.on_offered(server.session if server is not None and token else "")
        stamp_ns = goal.stamp_ns
        self._port.send_goal(pack_goal(stamp_ns, goal.id, stamp_ns, machine.body, token))
        if not goal.offered:  # a farewell came in between: another server may have heard it
            with self._lock:
                goal.on_offered("")
