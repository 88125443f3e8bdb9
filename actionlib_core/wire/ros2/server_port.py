"""An action server's port to ROS 2's wire: three services and two topics, as in rclpy.

A goal request is answered when the server accepts or refuses the goal. After `DECISION_S` the goal
counts as accepted, and a later refusal is shown as an abort. Requests for results are kept open and
answered when the goal ends. ROS 2 has no status texts, acknowledgements and farewells.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.exceptions import (
    ActionlibError,
    ServerConflictError,
    TransportError,
    TypeMismatchError,
)
from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.interfaces import ros2_action
from actionlib_core.transport import Quality
from actionlib_core.wire.arrivals import Readable
from actionlib_core.wire.ros2.action_messages import (
    CancelResponse,
    GoalState,
    join_statuses,
    pack_accepted,
    pack_cancel_response,
    pack_state,
    pack_with_id,
    unpack_cancel,
    unpack_id,
    unpack_with_id,
    with_status,
)
from actionlib_core.wire.ros2.attachment import answer_to, unpack_attachment
from actionlib_core.wire.ros2.goal_states import ENDED, CancelCode, GoalCode, give_reason, to_code
from actionlib_core.wire.ros2.mapping import action_on_ros2
from actionlib_core.wire.ros2.names import (
    DEFAULT,
    LATCHED,
    NO_GOAL,
    Kind,
    action_names,
    gid_of,
    goal_id_text,
    goal_uuid,
)
from actionlib_core.wire.ros2.network import ros_network

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actionlib_core.clock import Timer
    from actionlib_core.goal.ports import ServerListener, StatusEntry
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, PublisherPort, Query
    from actionlib_core.wire.action_types import ActionTypes
    from actionlib_core.wire.ros2.action_messages import CancelRequest
    from actionlib_core.wire.ros2.attachment import Attachment
    from actionlib_core.wire.ros2.graph import RosEnd
    from actionlib_core.wire.ros2.names import Token

log = logging.getLogger(__name__)

DECISION_S = 0.2  # a goal that was not refused within this time is answered as accepted
REFUSED_KEPT = 10_000  # remembered ids of refused goals: for ROS 2 these are unknown
PUBLISHED = Quality(express=True, block=False)
STATUS = Quality(express=True, block=False, cache=LATCHED.depth)
# The state that a goal had before its cancel, where its status still tells it.
_BEFORE_CANCEL: Mapping[int, GoalCode] = {
    Status.PREEMPTING: GoalCode.EXECUTING,
    Status.PREEMPTED: GoalCode.EXECUTING,
    Status.RECALLING: GoalCode.ACCEPTED,
    Status.RECALLED: GoalCode.ACCEPTED,
}


class _Request(NamedTuple):
    """A request that is not answered yet."""

    query: Query
    attachment: Attachment


class _Undecided(NamedTuple):
    """A goal whose request is not answered yet."""

    request: _Request
    stamp_ns: int
    due: float


class _ShownGoal(NamedTuple):
    """A goal as the last status list showed it, with its bytes for the next list."""

    status: int
    code: GoalCode
    packed: bytes

    @classmethod
    def make(cls, entry: StatusEntry, code: GoalCode) -> _ShownGoal:
        packed = pack_state(GoalState(goal_uuid(entry.id), entry.stamp_ns, code))
        return cls(entry.status, code, packed)


class RosServerPort:
    """The server's port on a ROS 2 network; see `ports.make_server_port`.

    Threads: any. The listener is called on the network's threads, never with `_lock` held: it takes
    the server's lock, and the server calls this port with that lock held.
    """

    def __init__(self, node: Node, name: str, types: ActionTypes) -> None:
        network = ros_network(node, name)
        self._on_ros2 = action = action_on_ros2(network.settings, name, types)
        parts = ros2_action(action.action)
        self._ros = network.ros
        self._clock = node.clock
        self._name = name
        self._goal_class = action.action.Goal
        self._response_class = parts.get_result.response
        self._there = network.name(action.name)
        self._names = names = action_names(self._there)
        self._types = {
            names.send_goal: network.type(parts.send_goal.type, parts.send_goal.hash),
            names.cancel_goal: network.type(parts.cancel_goal.type, parts.cancel_goal.hash),
            names.get_result: network.type(parts.get_result.type, parts.get_result.hash),
            names.feedback: network.type(parts.feedback.type, parts.feedback.hash),
            names.status: network.type(parts.status.type, parts.status.hash),
        }
        self._unknown = with_status(self.pack_result(types.result()), GoalCode.UNKNOWN)
        self._readable = Readable(log)
        self._lock = threading.Lock()
        self._feedback_lock = threading.RLock()  # a signal's handler may publish, too
        self._status_due = self._status_busy = False
        self._ends: dict[str, RosEnd] = {}
        self._declared: list[Closable] = []
        self._feedback: PublisherPort | None = None
        self._status: PublisherPort | None = None
        self._shown: dict[str, _ShownGoal] = {}
        self._undecided: dict[str, _Undecided] = {}
        self._waiting: dict[str, list[_Request]] = {}
        self._refused = Recent(REFUSED_KEPT)
        self._clients: set[str] = set()
        self._last_stamp_ns = 0
        self._timer: Timer | None = None
        self._closed = False

    # -- calls of the server -------------------------------------------------------------------

    def open(self, listener: ServerListener) -> None:
        self._listener = listener
        names, transport = self._names, self._ros.transport
        # Any server of the name has this publisher, whatever its type.
        there = self._ros.list(kind=Kind.PUBLISHER, name=names.status)
        if there:
            raise self._conflict(there[0])
        self._ends = {
            name: self._ros.end(
                Kind.PUBLISHER if name in {names.feedback, names.status} else Kind.SERVICE,
                name,
                ros_type,
                LATCHED if name == names.status else DEFAULT,
            )
            for name, ros_type in self._types.items()
        }
        keys = {name: end.key for name, end in self._ends.items()}
        try:
            self._feedback = transport.publisher(keys[names.feedback], "", PUBLISHED)
            self._declared.append(self._feedback)
            self._status = transport.publisher(keys[names.status], "", STATUS)
            self._declared.append(self._status)
            # `complete`: a client's request may go to this one alone.
            for name, answer in (
                (names.get_result, self._on_result),
                (names.cancel_goal, self._on_cancel),
                (names.send_goal, self._on_goal),
            ):
                self._declared.append(transport.queryable(keys[name], answer, complete=True))
            for end in self._ends.values():  # last: a client that sees them may send at once
                end.show()
            self._declared.append(self._ros.watch_action(self._there, self._on_token))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        with self._lock:
            self._closed = True
            undecided, self._undecided = self._undecided, {}
            waiting, self._waiting = self._waiting, {}
            declared, self._declared = self._declared, []
            timer, self._timer = self._timer, None
        if timer is not None:
            timer.cancel()
        # Tokens first, so that no client sends a new request. Then all open requests are answered:
        # a client of ROS 2 waits for an answer without a time limit.
        for end in self._ends.values():
            end.close()
        for goal in undecided.values():
            self._reply(goal.request, pack_accepted(None))
        for requests in waiting.values():
            for request in requests:
                self._reply(request, self._unknown)
        for entry in declared:
            entry.close()

    def clients(self) -> set[str]:
        return self._clients.copy()

    def begin_farewell(self) -> bool:
        return False

    def is_farewell_heard(self) -> bool:
        return True

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Do nothing: clients of ROS 2 see the tokens disappear."""

    def pack_result(self, result: Any) -> bytes:
        """Return the whole response; `_response` puts the status in when it is sent."""
        result = self._on_ros2.to_result(result)
        response: bytes = self._response_class(status=0, result=result).to_cdr()
        return response

    def pack_feedback(self, feedback: Any) -> bytes:
        body: bytes = self._on_ros2.to_feedback(feedback).to_cdr()
        return body

    def send_accepted(self, entry: StatusEntry) -> None:
        self._decide(entry.id, accepted=True)

    def send_status(self, entries: Iterable[StatusEntry]) -> None:  # noqa: ARG002  see below
        """Send the list of all goals, if anything in it has changed.

        Only one thread at a time makes and sends lists; calls in the meantime let it do so once
        more. If each caller sent its own list, an older one could be sent last, and late
        subscribers would keep getting it. No lock is held while sending, as the caller may hold the
        server's lock.
        """
        with self._lock:
            self._status_due = True
            if self._status_busy:
                return
            self._status_busy = True
        try:
            while self._claim_status():
                self._publish_status(self._listener.list_goals())
        except BaseException:
            self._status_busy = False
            raise

    def _claim_status(self) -> bool:
        """Return whether a list is due; if not, another thread may send the next one."""
        with self._lock:
            due, self._status_due = self._status_due, False
            self._status_busy = due
            return due

    def _publish_status(self, listed: list[StatusEntry]) -> None:
        """Send the list if it has changed.

        Most goals in it have ended, so their bytes are taken from the list before.
        """
        before = self._shown
        now: dict[str, _ShownGoal] = {}
        skipped: dict[str, _ShownGoal] = {}  # goals in a state that no list has shown
        for entry in listed:
            if entry.id in self._undecided:  # it may still be refused: then no list may show it
                continue
            known = before.get(entry.id)
            if known is not None and known.status == entry.status:
                now[entry.id] = known
                continue
            code = self._code(entry)
            if code == GoalCode.UNKNOWN:
                continue
            now[entry.id] = _ShownGoal.make(entry, code)
            earlier = _BEFORE_CANCEL.get(entry.status, GoalCode.UNKNOWN)
            if earlier > (known.code if known else GoalCode.UNKNOWN):
                skipped[entry.id] = _ShownGoal.make(entry, earlier)
        if now != before:
            # Clients see only from the list before a cancel whether the goal has been executing.
            for each in (now | skipped, now) if skipped else (now,):
                payload = join_statuses([shown.packed for shown in each.values()])
                self._put(self._status, self._names.status, payload)
            self._shown = now
        if self._waiting:
            self._answer_forgotten({entry.id for entry in listed})

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:  # noqa: ARG002  replies never wait
        # A goal may end before its request was answered: clients get that answer first.
        self._decide(entry.id, accepted=entry.status != Status.REJECTED)
        if entry.status in _BEFORE_CANCEL:
            self.send_status(())  # shows whether it has been executing; the result does not
        self._answer(entry.id, self._response(entry, body))

    def _response(self, entry: StatusEntry, body: bytes) -> bytes:
        """Return the response for a result, with its status and, if it has a field, the reason."""
        if entry.text and entry.status in {Status.ABORTED, Status.REJECTED}:
            response = self._response_class.from_cdr(body)
            if give_reason(response.result, entry.text):
                body = response.to_cdr()
        return with_status(body, self._code(entry))

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        payload = pack_with_id(goal_uuid(entry.id), body)
        with self._feedback_lock:  # attachments are to be sent in the order of their numbers
            self._put(self._feedback, self._names.feedback, payload)

    def _put(self, publisher: PublisherPort | None, name: str, payload: bytes) -> None:
        if publisher is None or self._closed:
            raise TransportError(
                f"action {self._name!r}: the server is stopped. Try ending goals before."
            )
        publisher.put(payload, self._ends[name].attachment())

    def _code(self, entry: StatusEntry) -> GoalCode:
        """Return the state of a goal for ROS 2, where a refused goal is unknown."""
        if entry.status == Status.REJECTED and (
            entry.id in self._refused or entry.id in self._undecided
        ):
            return GoalCode.UNKNOWN
        return to_code(entry.status)

    # -- goals ---------------------------------------------------------------------------------

    def _on_goal(self, query: Query) -> None:
        request = self._read_request("a goal", query)
        if request is None:
            return
        try:
            uuid, body = unpack_with_id(query.payload)
            content = self._on_ros2.from_goal(self._goal_class.from_cdr(body))
        except (ValueError, ActionlibError) as error:
            self._refuse_unreadable("a goal", request, error)
            return
        goal_id = goal_id_text(uuid)
        known = self._listener.find_end(goal_id)[0].status != Status.LOST
        with self._lock:
            if known or goal_id in self._undecided or self._closed or uuid == NO_GOAL:
                stamp_ns = None
            else:
                # Strictly increasing, so that "cancel all goals up to a stamp" is unambiguous.
                stamp_ns = self._last_stamp_ns = max(self._clock.time_ns(), self._last_stamp_ns + 1)
                due = self._clock.now() + DECISION_S
                self._undecided[goal_id] = _Undecided(request, stamp_ns, due)
        if stamp_ns is None:
            self._reply(request, pack_accepted(None))
            return
        # Noted as undecided before this call, since the server may decide within it.
        taken = False
        try:
            taken = self._listener.on_goal(
                goal_id, stamp_ns, content, goal_id_text(request.attachment.gid)
            )
        finally:
            if not taken:
                self._decide(goal_id, accepted=False)
        self._arm()

    def _decide(self, goal_id: str, *, accepted: bool) -> None:
        """Answer the request for a goal, if that was not done before."""
        with self._lock:
            found = self._undecided.pop(goal_id, None)
            if found is None:
                return
            if not accepted:
                self._refused.add(goal_id)
        self._reply(found.request, pack_accepted(found.stamp_ns if accepted else None))

    def _arm(self) -> None:
        """Start the timer for the oldest undecided goal, if it does not run."""
        with self._lock:
            if self._timer is None and self._undecided and not self._closed:
                due = next(iter(self._undecided.values())).due
                self._timer = self._clock.call_later(due - self._clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        now = self._clock.now()
        with self._lock:
            self._timer = None
            due = [goal_id for goal_id, goal in self._undecided.items() if goal.due <= now]
        for goal_id in due:
            self._decide(goal_id, accepted=True)
        if due:
            self.send_status(())
        self._arm()

    # -- results -------------------------------------------------------------------------------

    def _on_result(self, query: Query) -> None:
        request = self._read_request("a request for a result", query)
        if request is None:
            return
        try:
            goal_id = goal_id_text(unpack_id(query.payload))
        except ValueError as error:
            self._refuse_unreadable("a request for a result", request, error)
            return
        # Before looking whether it has ended: if it ends in between, `send_result` finds this.
        with self._lock:
            closed = self._closed
            if not closed:
                self._waiting.setdefault(goal_id, []).append(request)
        if not closed:
            self._answer_ended(goal_id)
            return
        # `close` has answered those that waited, and nobody will end the goal any more.
        entry, body = self._listener.find_end(goal_id)
        self._reply(request, self._unknown if body is None else self._response(entry, body))

    def _answer_ended(self, goal_id: str) -> None:
        """Answer the requests for the result of a goal that has ended or is unknown."""
        entry, body = self._listener.find_end(goal_id)
        if entry.status == Status.REJECTED and goal_id in self._undecided:
            return  # the thread that refuses it is about to answer
        if body is not None:
            self._answer(goal_id, self._response(entry, body))
        elif entry.status in TERMINAL or entry.status == Status.LOST:
            self._answer(goal_id, self._unknown)

    def _answer(self, goal_id: str, response: bytes) -> None:
        with self._lock:
            requests = self._waiting.pop(goal_id, ())
        for request in requests:
            self._reply(request, response)

    def _answer_forgotten(self, listed: set[str]) -> None:
        """Answer requests for the results of goals that the server has dropped from its list."""
        with self._lock:
            missing = self._waiting.keys() - listed
        for goal_id in missing:
            self._answer_ended(goal_id)

    # -- cancels -------------------------------------------------------------------------------

    def _on_cancel(self, query: Query) -> None:
        request = self._read_request("a cancel", query)
        if request is None:
            return
        try:
            asked = unpack_cancel(query.payload)
        except ValueError as error:
            self._refuse_unreadable("a cancel", request, error)
            return
        self._reply(request, pack_cancel_response(self._cancel(asked)))

    def _cancel(self, asked: CancelRequest) -> CancelResponse:
        """Cancel goals; the response names those that are canceling only since now."""
        goal_id = goal_id_text(asked.uuid)
        # One goal, by its id alone, has error codes of its own; other requests choose from a list.
        if asked.uuid != NO_GOAL and not asked.stamp_ns:
            code = self._code(self._listener.find_end(goal_id)[0])
            if code == GoalCode.UNKNOWN:
                return CancelResponse(CancelCode.UNKNOWN_GOAL, ())
            asked_now = [] if code in ENDED else self._listener.on_cancel(goal_id, 0)
            if not asked_now:
                return CancelResponse(CancelCode.GOAL_TERMINATED, ())
        else:
            asked_now = [
                now_asked
                for entry in choose_cancelled(self._listener.list_goals(), asked)
                for now_asked in self._listener.on_cancel(entry.id, 0)
            ]
        goals = tuple((goal_uuid(entry.id), entry.stamp_ns) for entry in asked_now)
        return CancelResponse(CancelCode.NONE, goals)

    # -- requests ------------------------------------------------------------------------------

    def _read_request(self, what: str, query: Query) -> _Request | None:
        """Return a request with its attachment; without a valid one it is answered with an error.

        The reply's attachment is made from the request's, so no other answer is possible.
        """
        try:
            return _Request(query, unpack_attachment(query.attachment))
        except ValueError as error:
            text = f"action '{self._name}': {what} cannot be answered: {error}"
            self._readable.report(what, ActionlibError(text))
            query.reply_error(text)
            query.finish()
            return None

    def _refuse_unreadable(self, what: str, request: _Request, error: Exception) -> None:
        """Answer a request that cannot be read with an error, and log that once per sender."""
        sender = request.attachment.gid.hex()
        text = f"action '{self._name}': {what} of client {sender} cannot be read: {error}"
        self._readable.report(f"{sender} {what}", ActionlibError(text))
        request.query.reply_error(text)
        request.query.finish()

    def _reply(self, request: _Request, payload: bytes) -> None:
        attachment = answer_to(request.attachment, self._clock.time_ns())
        request.query.reply(payload, attachment=attachment)
        request.query.finish()

    # -- clients and other servers -------------------------------------------------------------

    def _on_token(self, token: Token, key: str, alive: bool) -> None:
        if any(token == end.token for end in self._ends.values()):  # our own tokens are seen, too
            return
        if token.kind is Kind.PUBLISHER and token.name == self._names.status and alive:
            log.error("%s", self._conflict(token, stays=True))
        if token.kind is not Kind.CLIENT or token.name != self._names.send_goal:
            return
        client = goal_id_text(gid_of(key))
        if not alive:
            self._clients.discard(client)
            self._listener.on_client_lost(client)
            return
        self._clients.add(client)
        own = self._types[token.name]
        if (token.type, token.type_hash) != own:
            who = f"a client in node {token.full_node!r}"
            error = TypeMismatchError(self._name, own, (token.type, token.type_hash), by=who)
            self._readable.report(f"{token.session} {token.type} {token.type_hash}", error)
        self._listener.on_client()

    def _conflict(self, other: Token, *, stays: bool = False) -> ServerConflictError:
        own = self._ros.full_name, self._ros.token.session
        there = other.full_node, other.session
        return ServerConflictError(self._name, *((there, own) if stays else (own, there)))


def choose_cancelled(goals: Iterable[StatusEntry], asked: CancelRequest) -> list[StatusEntry]:
    """Return the active goals that a request to cancel several selects.

    Args:
        goals: All goals of the server.
        asked: With a stamp: the goals up to it, and the one with the id. Without both: all goals.
    """
    everything = asked.uuid == NO_GOAL and not asked.stamp_ns
    goal_id = goal_id_text(asked.uuid)
    return [
        goal
        for goal in goals
        if goal.status not in TERMINAL
        and (everything or goal.id == goal_id or 0 < goal.stamp_ns <= asked.stamp_ns)
    ]
