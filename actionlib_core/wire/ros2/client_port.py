"""An action client's port to ROS 2's wire: three service clients and two subscriptions.

`GoalExchange` decides what to request for a goal; this module sends the requests, watches the
tokens of servers, and reports to the client. ROS 2 has no acknowledgements and farewells: a server
keeps a result for its own `result_timeout`.
"""

from __future__ import annotations

import contextlib
import logging
import threading
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar
from uuid import uuid4

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import ActionlibError, TransportError
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import Status
from actionlib_core.interfaces import ros2_action
from actionlib_core.wire.arrivals import Bursts, Readable
from actionlib_core.wire.ros2.action_messages import (
    CancelRequest,
    find_states,
    pack_cancel,
    pack_id,
    pack_with_id,
    status_in,
    unpack_accepted,
    unpack_cancel_response,
    unpack_with_id,
)
from actionlib_core.wire.ros2.attachment import unpack_attachment
from actionlib_core.wire.ros2.diagnosis import explain_absence, explain_mismatch
from actionlib_core.wire.ros2.goal_exchange import ENDS, TEXT_UNKNOWN, Duty, GoalExchange
from actionlib_core.wire.ros2.goal_states import CancelCode, reason_of
from actionlib_core.wire.ros2.graph import ActionServers
from actionlib_core.wire.ros2.link_probe import LinkProbe
from actionlib_core.wire.ros2.mapping import action_on_ros2
from actionlib_core.wire.ros2.names import (
    DEFAULT,
    LATCHED,
    NO_GOAL,
    Kind,
    action_names,
    goal_uuid,
)
from actionlib_core.wire.ros2.network import ros_network

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Timer
    from actionlib_core.exceptions import TypeMismatchError
    from actionlib_core.goal.ports import ClientListener
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Reply, Sample
    from actionlib_core.wire.action_types import ActionTypes
    from actionlib_core.wire.ros2.action_messages import CancelResponse
    from actionlib_core.wire.ros2.graph import RosEnd, RosServer
    from actionlib_core.wire.ros2.names import Token

T = TypeVar("T")

log = logging.getLogger(__name__)

MAX_IN_FLIGHT = 8  # unanswered goals; a ROS 2 server queues 10 requests and drops the oldest
PAUSE_S = 0.1  # before an unanswered request is repeated; doubled each time
MAX_PAUSE_S = 2.0
LATE_ANSWERS_S = 0.03  # answers of a leaving server are awaited for this time after its tokens went


class _OpenGoal:
    """A goal and its open requests."""

    __slots__ = ("body", "exchange", "id", "on_done", "open", "pause", "server", "uuid")

    def __init__(self, goal_id: str, body: bytes, server: str, *, attached: bool = False) -> None:
        self.id = goal_id
        self.uuid = goal_uuid(goal_id)
        self.body = body
        self.server = server
        self.exchange = GoalExchange(attached=attached)
        self.pause = PAUSE_S
        self.on_done: list[Callable[[], None]] = []
        self.open: dict[RosEnd, Closable] = {}  # requests that are not answered yet, by service


class RosClientPort:
    """The client's port on a ROS 2 network; see `ports.make_client_port`.

    `GoalExchange` is called with `_lock` held, and the steps that it returns are carried out
    without: they call the listener and the network, which may call back into this object.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        spawn: Callable[[Callable[[], object], str], object],
    ) -> None:
        self._network = network = ros_network(node, name)
        self._clock = node.clock
        self._name = name
        self._types = types
        self._on_ros2 = there = action_on_ros2(network.settings, name, types)
        self._parts = parts = ros2_action(there.action)
        name_there = network.name(there.name)
        names = action_names(name_there)
        send, cancel, result, feedback, status = (
            network.type(part.type, part.hash)
            for part in (
                parts.send_goal,
                parts.cancel_goal,
                parts.get_result,
                parts.feedback,
                parts.status,
            )
        )
        end = network.ros.end
        self._send = end(Kind.CLIENT, names.send_goal, send)
        self._cancel = end(Kind.CLIENT, names.cancel_goal, cancel)
        self._result = end(Kind.CLIENT, names.get_result, result)
        self._feedback_end = end(Kind.SUBSCRIPTION, names.feedback, feedback, DEFAULT)
        self._status_end = end(Kind.SUBSCRIPTION, names.status, status, LATCHED)
        self._servers = ActionServers(name_there, (send, cancel, result, feedback, status))
        self._lock = threading.Lock()
        self._closed = False
        self._declared: list[Closable] = []
        # The last status list, and the gid of its publisher with its sequence number.
        self._last_status: Sample | None = None
        self._last_number: tuple[bytes, int] | None = None
        # The same goals by id and by UUID: the first is the client's key, the second the wire's.
        self._goals: dict[str, _OpenGoal] = {}
        self._by_uuid: dict[bytes, _OpenGoal] = {}
        # Goals that wait to be sent, and those whose request is not answered.
        self._queue: deque[_OpenGoal] = deque()
        self._sending: set[_OpenGoal] = set()
        # Servers with the error about their types; servers whose tokens are there but that did not
        # answer a probe; servers whose tokens are gone and whose last answers may still come. A
        # server is in one of the three.
        self._present: dict[RosServer, TypeMismatchError | None] = {}
        self._silent: set[RosServer] = set()
        self._leaving: dict[RosServer, Timer] = {}
        self._probing = False  # a request for the result of an unknown goal is open
        self._probe = LinkProbe(
            node.clock,
            network.settings.probe,
            self._send_probe,
            lambda: bool((self._goals and self._present) or self._silent),
            self._on_silent,
        )
        self._readable = Readable(log)
        self._later = SerialExecutor(node.clock, f"{name} queries")
        self._feedback: Bursts[Sample] = Bursts(node.clock, spawn, self._on_feedback)

    def open(self, listener: ClientListener) -> None:
        self._listener = listener
        subscribe = self._network.transport.subscribe
        ends = (self._send, self._cancel, self._result, self._feedback_end, self._status_end)
        # Subscribe first and show the tokens last: a server that sees them may publish at once.
        self._declared = [
            self._subscribe_to_status(),
            subscribe(self._feedback_end.key, self._feedback.take, history=False),
            *ends,
            self._network.ros.watch_action(self._servers.name, self._on_token),
        ]
        for end in ends:
            end.show()

    def _subscribe_to_status(self) -> Closable:
        return self._network.transport.subscribe(self._status_end.key, self._on_status, cached=1)

    def close(self) -> None:
        self._probe.close()
        with self._lock:
            declared, self._declared = self._declared, []
            for goal in self._goals.values():
                declared += goal.open.values()
                goal.open.clear()
            self._closed = True
            timers = list(self._leaving.values())
            self._leaving.clear()
        for timer in timers:
            timer.cancel()
        for entry in reversed(declared):
            entry.close()

    # -- calls of the client -------------------------------------------------------------------

    def is_heard(self) -> bool:
        return None in list(self._present.values())  # a copy: a token may come meanwhile

    @property
    def lost_link(self) -> str:
        return self._network.transport.lost_link

    @property
    def link_delay(self) -> float:
        return self._network.transport.link_delay

    def explain_absence(self) -> str:
        settings = self._network.settings
        others = self._network.ros.list_others()
        return explain_absence(self._servers.name, others, settings.domain, settings.router)

    def pack_goal(self, goal: Any) -> bytes:
        body: bytes = self._on_ros2.to_goal(goal).to_cdr()
        return body

    def read_feedback(self, body: bytes) -> Any:
        message = self._parts.feedback.message.from_cdr(body)
        return self._on_ros2.from_feedback(message.feedback)

    def read_result(self, body: bytes) -> Any:
        if not body:  # a goal that never began
            return self._types.result()
        response = self._parts.get_result.response.from_cdr(body)
        return self._on_ros2.from_result(response.result)

    def send_goal(
        self,
        goal_id: str,
        stamp_ns: int,  # noqa: ARG002  the server stamps it
        body: bytes,
        server: RosServer | None,
        *,
        age: float = 0.0,  # noqa: ARG002  for a ROS 2 server, order is that of arrival
        wait: bool = True,  # noqa: ARG002  a request is not dropped
        cancel_if_lost: bool = False,
    ) -> None:
        """Send a goal, unless it is already on its way; the client calls this repeatedly.

        Raises:
            TransportError: the client is stopped.
        """
        with self._lock:
            if self._closed:
                raise TransportError(f"action '{self._name}': the client is stopped.")
            goal = self._goals.get(goal_id)
            if goal is None:
                goal = self._keep(_OpenGoal(goal_id, body, server.session if server else ""))
                if cancel_if_lost:
                    log.warning(
                        "action '%s': goal %s: cancel_on_client_lost has no effect on ROS 2's "
                        "wire: its servers do not look for the client. Try a server with "
                        'on_client_lost="cancel".',
                        *(self._name, goal_id),
                    )
            step = goal.exchange.want()
        self._do(goal, step)

    def send_cancel(self, goal_id: str, stamp_ns: int, *, wait: bool = True) -> None:
        if not goal_id:
            self._cancel_many(stamp_ns)
            return
        with self._lock:
            goal = self._goals.get(goal_id)
            if goal is None:
                goal = self._keep(_OpenGoal(goal_id, b"", "", attached=True))
            step = goal.exchange.cancel(again=not wait)
        self._do(goal, step)

    def _cancel_many(self, stamp_ns: int) -> None:
        def on_answer(answer: CancelResponse, _: Reply) -> None:
            for uuid, _stamp in answer.goals:
                goal = self._by_uuid.get(uuid)
                if goal is not None:
                    with self._lock:
                        step = goal.exchange.on_cancel_answer(CancelCode.NONE, listed=True)
                    self._do(goal, step)

        request = pack_cancel(CancelRequest(NO_GOAL, stamp_ns))
        self._ask(None, self._cancel, request, unpack_cancel_response, on_answer)

    def acknowledge(self, goal_ids: list[str], *, farewell: bool = False) -> None:
        """Do nothing: ROS 2 has no acknowledgements."""

    def ask(self, goal_id: str, on_done: Callable[[], None]) -> None:
        with self._lock:
            goal = self._goals.get(goal_id)
            known = goal is not None
            if goal is None:  # an earlier process has sent it
                goal = self._keep(_OpenGoal(goal_id, b"", "", attached=True))
            step = goal.exchange.ask_again() if self._present else Duty.NOTHING
            # Added before `_do` sends the request, whose answer may come at once.
            waits = goal.exchange.asking
            if waits:
                goal.on_done.append(on_done)
        if not waits:
            on_done()
        self._do(goal, step)
        # The last list was read when this goal was not followed yet, and may contain it.
        if not known and self._last_status is not None:
            with contextlib.suppress(ValueError):  # reported when it arrived
                self._read_states(self._last_status)

    def _keep(self, goal: _OpenGoal) -> _OpenGoal:
        """Keep a new goal. Needs the lock."""
        self._goals[goal.id] = self._by_uuid[goal.uuid] = goal
        goal.server = goal.server or next((server.session for server in self._present), "")
        return goal

    def _drop(self, goal: _OpenGoal) -> None:
        """Forget a goal that has ended, or that the client no longer follows."""
        with self._lock:
            self._goals.pop(goal.id, None)
            self._by_uuid.pop(goal.uuid, None)
            if goal in self._queue:
                self._queue.remove(goal)
            requests = self._withdraw(goal)
        for request in requests:
            request.close()
        self._send_next()  # the goal may have been one of the `MAX_IN_FLIGHT`

    def _withdraw(self, goal: _OpenGoal) -> list[Closable]:
        """Return a goal's open requests, for the caller to close without the lock. Needs the lock.

        They count as unanswered from now on.
        """
        self._sending.discard(goal)
        requests = list(goal.open.values())
        goal.open.clear()
        goal.exchange.on_link_lost()
        return requests

    # -- steps of GoalExchange -----------------------------------------------------------------

    def _do(self, goal: _OpenGoal, step: int) -> None:
        """Carry out the steps that `GoalExchange` has returned."""
        if step & Duty.ASK:  # first: its round trip goes on while the client is notified
            self._ask_result(goal)
        if step & Duty.NOTIFY:
            self._notify(goal)
        if not step & ~(Duty.ASK | Duty.NOTIFY):
            return
        if step & Duty.QUEUE:
            self._enqueue(goal)
        if step & Duty.ASK_LATER:
            self._clock.call_later(goal.pause, partial(self._ask_apart, goal))
            goal.pause = min(2 * goal.pause, MAX_PAUSE_S)
        if step & Duty.CANCEL:
            self._ask_cancel(goal)
        if step & Duty.KEEPS_RUNNING:
            log.warning("action '%s': the server refused to cancel goal %s", self._name, goal.id)
        for end, status, text in ENDS:
            if step & end:
                self._end(goal, status, text)

    def _notify(self, goal: _OpenGoal) -> None:
        """Report the goal's status to the client."""
        # The client takes the sender of a status for a server, so none is reported before a
        # server's tokens are there; `_on_token` does it then.
        if not self._present:
            return
        status = goal.exchange.status
        report = partial(self._listener.on_statuses, session=goal.server, whole=False)
        # RECALLING alone does not show that the server has the goal: on our own wire it may mean a
        # cancel that arrived first (see `ClientGoal`).
        if status is Status.RECALLING:
            report([StatusEntry(goal.id, 0, Status.PENDING, "")])
        report([StatusEntry(goal.id, 0, status, "")])

    def _end(self, goal: _OpenGoal, status: Status, text: str) -> None:
        self._drop(goal)
        entry = StatusEntry(goal.id, 0, status, text)
        if status is not Status.LOST:
            self._listener.on_result(entry, b"", goal.server, answered=True)
        elif text is TEXT_UNKNOWN:
            self._listener.on_answer(entry, goal.server)
        else:
            self._listener.on_statuses([entry], goal.server, whole=False)

    def _enqueue(self, goal: _OpenGoal) -> None:
        """Put a goal into the queue, if the client still follows it."""
        if not self._listener.follows(goal.id):
            self._drop(goal)
            return
        with self._lock:
            self._queue.append(goal)
        self._probe.watch()
        self._send_next()

    def _send_next(self) -> None:
        """Send queued goals while fewer than `MAX_IN_FLIGHT` are unanswered."""
        while True:
            with self._lock:
                if not self._queue or len(self._sending) >= MAX_IN_FLIGHT or self._closed:
                    return
                goal = self._queue.popleft()
                self._sending.add(goal)
                goal.exchange.on_sent(self._clock.now())
            self._ask(
                goal,
                self._send,
                pack_with_id(goal.uuid, goal.body),
                unpack_accepted,
                partial(self._on_sent_answer, goal),
                partial(self._on_sent_done, goal),
            )

    def _on_sent_answer(self, goal: _OpenGoal, stamp_ns: int | None, reply: Reply) -> None:
        with self._lock:
            self._note_sender(goal, reply.source)
            step = goal.exchange.on_answer(accepted=stamp_ns is not None)
        self._do(goal, step)

    def _on_sent_done(self, goal: _OpenGoal, answered: bool) -> None:
        with self._lock:
            step = Duty.NOTHING if answered else goal.exchange.on_unanswered()
        self._do(goal, step)
        self._send_next()

    def _ask_result(self, goal: _OpenGoal) -> None:
        self._probe.watch()
        self._ask(
            goal,
            self._result,
            pack_id(goal.uuid),
            status_in,
            partial(self._on_result, goal),
            partial(self._on_result_done, goal),
        )

    def _on_result(self, goal: _OpenGoal, code: int, reply: Reply) -> None:
        self._feedback.flush()  # the user gets feedback before the result
        with self._lock:
            step = goal.exchange.on_result(code, self._clock.now())
            status = goal.exchange.status
            goal.open.pop(self._result, None)  # it ends by itself, so `_drop` need not close it
        if not step & Duty.END:
            self._do(goal, step)
            return
        self._drop(goal)
        text = "" if status is Status.SUCCEEDED else self._reason(reply.payload)
        entry = StatusEntry(goal.id, 0, status, text)
        session = reply.source or goal.server
        self._listener.on_result(entry, reply.payload, session, answered=True)

    def _reason(self, response: bytes) -> str:
        try:
            return reason_of(self._parts.get_result.response.from_cdr(response).result)
        except (ValueError, ActionlibError):  # reported when the result is read
            return ""

    def _on_result_done(self, goal: _OpenGoal, answered: bool) -> None:
        with self._lock:
            callbacks, goal.on_done = goal.on_done, []
            step = Duty.NOTHING if answered else goal.exchange.on_no_result()
        for on_done in callbacks:
            on_done()
        self._do(goal, step)

    def _ask_apart(self, goal: _OpenGoal) -> None:
        """Request a result again, not in the timers' thread: a query waits while a link is full."""
        self._later.submit(partial(self._ask_again, goal))

    def _ask_again(self, goal: _OpenGoal) -> None:
        """Request a result again, if there is a server to answer."""
        with self._lock:
            known = not self._closed and self._goals.get(goal.id) is goal
            step = goal.exchange.ask_again() if known and self._present else Duty.NOTHING
        # A goal that the client has given up is dropped instead of being requested for ever.
        if step and not self._listener.follows(goal.id):
            self._drop(goal)
        else:
            self._do(goal, step)

    def _ask_cancel(self, goal: _OpenGoal) -> None:
        self._ask(
            goal,
            self._cancel,
            pack_cancel(CancelRequest(goal.uuid, 0)),
            unpack_cancel_response,
            partial(self._on_cancel_answer, goal),
            partial(self._on_cancel_done, goal),
        )

    def _on_cancel_answer(self, goal: _OpenGoal, answer: CancelResponse, _: Reply) -> None:
        listed = any(uuid == goal.uuid for uuid, _ in answer.goals)
        with self._lock:
            step = goal.exchange.on_cancel_answer(answer.code, listed=listed)
        self._do(goal, step)

    def _on_cancel_done(self, goal: _OpenGoal, answered: bool) -> None:
        with self._lock:
            if not answered:
                goal.exchange.on_no_cancel_answer()
        if not self._listener.follows(goal.id):
            self._drop(goal)

    # -- requests ------------------------------------------------------------------------------

    def _ask(
        self,
        goal: _OpenGoal | None,
        end: RosEnd,
        request: bytes,
        read: Callable[[bytes], T],
        on_answer: Callable[[T, Reply], object],
        on_done: Callable[[bool], object] = bool,
    ) -> None:
        """Send a request to one server; the first answer that can be parsed counts.

        Args:
            goal: The goal that it is about; it holds the request until its end. None: no goal.
            end: Our endpoint of the service.
            request: The request.
            read: Parses an answer; raises ValueError.
            on_answer: Gets the parsed answer and the reply.
            on_done: Called at the end with whether there was one; not called when the request was
                withdrawn.
        """
        answered = over = False

        def take(reply: Reply) -> None:
            nonlocal answered
            self._note_received()
            if self._closed or answered:
                return
            try:
                answer = _parse(reply, read)
            except ValueError as error:
                self._report("an answer", error)
                return
            answered = True
            on_answer(answer, reply)

        def done() -> None:
            nonlocal over
            with self._lock:
                over = True
                if goal is not None:
                    goal.open.pop(end, None)
                if end is self._send and goal is not None:
                    self._sending.discard(goal)
            if not self._closed:
                on_done(answered)

        try:
            asked = self._network.transport.query(
                end.key,
                request,
                attachment=end.attachment(),
                best=True,  # one server: a goal must not run in two
                timeout=self._network.patience(),
                on_reply=take,
                on_done=done,
            )
        except TransportError as error:
            self._readable.report("ask", error)
            done()
            return
        with self._lock:
            # It may be over before `query` has returned: then there is nothing to keep.
            if goal is not None and not over:
                goal.open[end] = asked

    def _report(self, what: str, error: object) -> None:
        """Log a dropped message, once per kind, as a server may send many of them."""
        text = f"action '{self._name}': {what} cannot be read: {error}"
        self._readable.report(what, ActionlibError(text))

    # -- topics --------------------------------------------------------------------------------

    def _on_status(self, sample: Sample) -> None:
        self._feedback.flush()  # the user gets the feedback that was received before
        self._last_status = sample
        self._note_received()
        # Without a gap, this list has the next number of the same publisher. The number is kept
        # only if the list could be read.
        last, self._last_number = self._last_number, None
        try:
            number, _, gid = unpack_attachment(sample.attachment)
            self._read_states(sample, unbroken=(gid, number - 1) == last)
        except ValueError as error:
            self._report("a status", error)
            return
        self._last_number = gid, number

    def _read_states(self, sample: Sample, *, unbroken: bool = False) -> None:
        """Handle the states of followed goals in a status list.

        Raises:
            ValueError: the list cannot be read.
        """
        with self._lock:
            wanted = set(self._by_uuid)
        states = find_states(sample.payload, wanted)
        steps = []
        with self._lock:
            for uuid, code in states:
                # A goal may have been dropped since, and a list may be older than other messages.
                goal = self._by_uuid.get(uuid)
                if goal is not None and code >= goal.exchange.code:
                    self._note_sender(goal, sample.source)
                    steps.append((goal, goal.exchange.on_state(code, unbroken=unbroken)))
        for goal, step in steps:
            self._do(goal, step)

    def _on_feedback(self, sample: Sample) -> None:
        self._note_received()
        try:
            uuid, _ = unpack_with_id(sample.payload)
        except ValueError as error:
            self._report("feedback", error)
            return
        with self._lock:
            goal = self._by_uuid.get(uuid)
            if goal is None:
                return
            self._note_sender(goal, sample.source)
            step = goal.exchange.on_feedback()
            status = goal.exchange.status
        self._do(goal, step)
        entry = StatusEntry(goal.id, 0, status, "")
        self._listener.on_feedback(entry, sample.payload, goal.server)

    def _note_sender(self, goal: _OpenGoal, session: str) -> None:
        """Note which of several servers has a goal, if known. Needs the lock."""
        if session != goal.server and any(server.session == session for server in self._present):
            goal.server = session

    # -- servers -------------------------------------------------------------------------------

    def _on_token(self, token: Token, key: str, alive: bool) -> None:  # noqa: ARG002
        with self._lock:
            change = self._servers.on_token(token, alive=alive)
            if change is None:
                return
        server = change.server
        error = explain_mismatch(self._name, change, self._network.settings.distro)
        with self._lock:
            self._silent.discard(server)
            if change.alive:
                self._present[server] = error
                for goal in self._goals.values():
                    goal.server = goal.server or server.session
            else:
                self._present.pop(server, None)
        if not change.alive:
            self._lose_soon(server)
            return
        self._lose_now()
        self._note_received()
        if error is not None:
            self._readable.report(f"{server.session} {server.node}", error)
        self._listener.on_server(server, error)
        with self._lock:
            heard_of = [goal for goal in self._goals.values() if goal.exchange.code]
        for goal in heard_of:  # their statuses came before the server's tokens: see `_notify`
            self._notify(goal)

    def _lose_soon(self, server: RosServer) -> None:
        """Handle the loss of a server a little later: its last answers may come after the tokens.

        Without open requests there is nothing to wait for.
        """
        with self._lock:
            asked = any(goal.open for goal in self._goals.values())
            if asked and not self._closed:
                later = self._clock.call_later(LATE_ANSWERS_S, partial(self._lose_now, server))
                self._leaving[server] = later
        if not asked:
            self._lose(server, "is gone")

    def _lose_now(self, only: RosServer | None = None) -> None:
        """Handle the loss of a server that has left, or of all that have."""
        with self._lock:
            left = [server for server in self._leaving if only in {None, server}]
            timers = [self._leaving.pop(server) for server in left]
        for timer in timers:
            timer.cancel()
        for server in left:
            self._lose(server, "is gone")

    def _lose(self, server: RosServer, why: str) -> None:
        """Handle the loss of a server: requests to it will not be answered."""
        self._feedback.flush()
        self._listener.on_server_gone(server, why)
        with self._lock:
            # A goal without a known server may have been sent to this one.
            mine = [g for g in self._goals.values() if g.server in {"", server.session}]
            requests = [request for goal in mine for request in self._withdraw(goal)]
            callbacks = [on_done for goal in mine for on_done in goal.on_done]
            for goal in mine:
                goal.on_done.clear()
                if goal in self._queue:
                    self._queue.remove(goal)
        for request in requests:
            request.close()
        for on_done in callbacks:
            on_done()
        for goal in mine:
            if not self._listener.follows(goal.id):
                self._drop(goal)

    def _note_received(self) -> None:
        """Note that a server has sent something; silent servers count as present again."""
        self._probe.note_received()
        if not self._silent:
            return
        with self._lock:
            back, self._silent = self._silent, set()
            self._present.update(dict.fromkeys(back))
        for server in back:
            self._listener.on_server(server, None)

    def _send_probe(self) -> Closable:
        """Request the last status or, if there was none yet, the result of an unknown goal.

        The second is answered by the server's executor, which is not busy as it has no goals. Only
        one such request is open at a time: a suspended server would queue them, and real requests
        would drop out of its queue of 10.
        """
        if self._last_status is not None:
            return self._subscribe_to_status()

        def on_done(_: bool) -> None:
            self._probing = False

        if not self._probing:
            self._probing = True
            asked = pack_id(uuid4().bytes)
            self._ask(None, self._result, asked, status_in, lambda *_: None, on_done)
        return contextlib.ExitStack()  # nothing to close: a late answer counts as well

    def _on_silent(self, seconds: float) -> None:
        """Count servers that do not answer as lost, although their tokens are present."""
        with self._lock:
            silent = [server for server, error in self._present.items() if error is None]
            self._silent.update(silent)
            for server in silent:
                del self._present[server]
        for server in silent:
            self._lose(server, f"has not been heard for {seconds:.1f} s")


def _parse(reply: Reply, read: Callable[[bytes], T]) -> T:
    """Return the answer in a reply.

    Raises:
        ValueError: the reply is an error, or it cannot be parsed.
    """
    if reply.error:
        raise ValueError(reply.payload.decode(errors="replace") or "an error without a text")
    return read(reply.payload)
