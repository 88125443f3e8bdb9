"""An action server's end of ROS 2's wire: three services and two topics, as rclpy offers them.

A goal is answered once its server accepts or refuses it, after `DECISION_S` at the latest: then it
counts as accepted, and a refusal after that is shown as an abort. Results are held open for whoever
asks, and answered when the goal ends. What does not exist there is left out: texts,
acknowledgements and farewells.
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
    Canceling,
    GoalState,
    join_statuses,
    pack_accepted,
    pack_canceling,
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
    from actionlib_core.wire.ros2.action_messages import Asked
    from actionlib_core.wire.ros2.attachment import Attachment
    from actionlib_core.wire.ros2.graph import End
    from actionlib_core.wire.ros2.names import Token

log = logging.getLogger(__name__)

DECISION_S = 0.2  # a server that has not refused a goal by then has accepted it
REFUSED_KEPT = 10_000  # ids of refused goals, which ROS 2 counts as unknown
PUBLISHED = Quality(express=True, block=False)
STATUS = Quality(express=True, block=False, cache=LATCHED.depth)
_BEFORE_CANCEL: Mapping[int, GoalCode] = {
    Status.PREEMPTING: GoalCode.EXECUTING,
    Status.PREEMPTED: GoalCode.EXECUTING,
    Status.RECALLING: GoalCode.ACCEPTED,
    Status.RECALLED: GoalCode.ACCEPTED,
}


class _Asker(NamedTuple):
    """A request that waits for its answer."""

    query: Query
    attachment: Attachment


class _Undecided(NamedTuple):
    """A goal of which its client does not know yet whether it is accepted."""

    asker: _Asker
    stamp_ns: int
    due: float


class _Shown(NamedTuple):
    """A goal as the list of statuses showed it."""

    status: int
    code: GoalCode
    packed: bytes

    @classmethod
    def make(cls, entry: StatusEntry, code: GoalCode) -> _Shown:
        packed = pack_state(GoalState(goal_uuid(entry.id), entry.stamp_ns, code))
        return cls(entry.status, code, packed)


class RosServerPort:
    """The ends of an action server on a ROS 2 network; see `ports.make_server_port`.

    Threads: any. The listener is called on the network's threads.
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
        self._feedback_lock = threading.Lock()
        self._status_due = self._status_busy = False
        self._ends: dict[str, End] = {}
        self._declared: list[Closable] = []
        self._feedback: PublisherPort | None = None
        self._status: PublisherPort | None = None
        self._shown: dict[str, _Shown] = {}
        self._undecided: dict[str, _Undecided] = {}
        self._waiting: dict[str, list[_Asker]] = {}
        self._refused = Recent(REFUSED_KEPT)
        self._clients: set[str] = set()
        self._last_stamp_ns = 0
        self._timer: Timer | None = None
        self._closed = False

    # -- what the server does ------------------------------------------------------------------

    def open(self, listener: ServerListener) -> None:
        self._listener = listener
        names, transport = self._names, self._ros.transport
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
            for name, answer in (
                (names.get_result, self._on_result),
                (names.cancel_goal, self._on_cancel),
                (names.send_goal, self._on_goal),
            ):
                self._declared.append(transport.queryable(keys[name], answer, complete=True))
            for end in self._ends.values():  # last: who sees them may ask at once
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
        for end in self._ends.values():
            end.close()
        for goal in undecided.values():
            self._reply(goal.asker, pack_accepted(None))
        for askers in waiting.values():
            for asker in askers:
                self._reply(asker, self._unknown)
        for entry in declared:
            entry.close()

    def has_clients(self) -> bool:
        return bool(self._clients)

    def begin_farewell(self) -> bool:
        return False

    def is_farewell_heard(self) -> bool:
        return True

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Send nothing: ROS 2's clients see the tokens go."""

    def pack_result(self, result: Any) -> bytes:
        """Return the whole response, with a status that is put in when it is sent."""
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

        One thread at a time makes the list and sends it, once more when it was asked meanwhile: a
        list made by another thread may be older than what was sent last, and late subscribers would
        see it for ever. No lock is held meanwhile, as the caller may hold the server's.
        """
        with self._lock:
            self._status_due = True
            if self._status_busy:
                return
            self._status_busy = True
        try:
            while self._takes_up_status():
                self._publish_status(self._listener.list_goals())
        except BaseException:
            self._status_busy = False
            raise

    def _takes_up_status(self) -> bool:
        """Return whether there is something to say; if not, the thread is done with it."""
        with self._lock:
            due, self._status_due = self._status_due, False
            self._status_busy = due
            return due

    def _publish_status(self, listed: list[StatusEntry]) -> None:
        """Send the list if it has changed; most goals in it have ended, and are as they were."""
        before = self._shown
        now: dict[str, _Shown] = {}
        skipped: dict[str, _Shown] = {}
        for entry in listed:
            if entry.id in self._undecided:  # it may yet be refused, and never be known
                continue
            known = before.get(entry.id)
            if known is not None and known.status == entry.status:
                now[entry.id] = known
                continue
            code = self._code(entry)
            if code == GoalCode.UNKNOWN:
                continue
            now[entry.id] = _Shown.make(entry, code)
            earlier = _BEFORE_CANCEL.get(entry.status, GoalCode.UNKNOWN)
            if earlier > (known.code if known else GoalCode.UNKNOWN):
                skipped[entry.id] = _Shown.make(entry, earlier)
        if now != before:
            # A client can tell only from the list before a cancel whether the goal has run.
            for each in (now | skipped, now) if skipped else (now,):
                payload = join_statuses([shown.packed for shown in each.values()])
                self._put(self._status, self._names.status, payload)
            self._shown = now
        if self._waiting:
            self._answer_forgotten({entry.id for entry in listed})

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:  # noqa: ARG002  replies never wait
        self._decide(entry.id, accepted=entry.status != Status.REJECTED)
        if entry.status in _BEFORE_CANCEL:
            self.send_status(())  # tells whether it has run, which the result does not
        self._answer(entry.id, self._response(entry, body))

    def _response(self, entry: StatusEntry, body: bytes) -> bytes:
        """Return a result's response: with its status and, where its type has that, the reason."""
        if entry.text and entry.status in {Status.ABORTED, Status.REJECTED}:
            response = self._response_class.from_cdr(body)
            if give_reason(response.result, entry.text):
                body = response.to_cdr()
        return with_status(body, self._code(entry))

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        payload = pack_with_id(goal_uuid(entry.id), body)
        with self._feedback_lock:
            self._put(self._feedback, self._names.feedback, payload)

    def _put(self, publisher: PublisherPort | None, name: str, payload: bytes) -> None:
        if publisher is None or self._closed:
            raise TransportError(
                f"action {self._name!r}: the server is stopped. Try ending goals before."
            )
        publisher.put(payload, self._ends[name].attachment())

    def _code(self, entry: StatusEntry) -> GoalCode:
        """Return the state of a goal as ROS 2 sees it: a refused one is not known."""
        if entry.status == Status.REJECTED and (
            entry.id in self._refused or entry.id in self._undecided
        ):
            return GoalCode.UNKNOWN
        return to_code(entry.status)

    # -- goals ---------------------------------------------------------------------------------

    def _on_goal(self, query: Query) -> None:
        asker = self._asker("a goal", query)
        if asker is None:
            return
        try:
            uuid, body = unpack_with_id(query.payload)
            content = self._on_ros2.from_goal(self._goal_class.from_cdr(body))
        except (ValueError, ActionlibError) as error:
            self._refuse_unreadable("a goal", asker, error)
            return
        goal_id = goal_id_text(uuid)
        known = self._listener.find_end(goal_id)[0].status != Status.LOST
        with self._lock:
            if known or goal_id in self._undecided or self._closed or uuid == NO_GOAL:
                stamp_ns = None
            else:
                stamp_ns = self._last_stamp_ns = max(self._clock.time_ns(), self._last_stamp_ns + 1)
                due = self._clock.now() + DECISION_S
                self._undecided[goal_id] = _Undecided(asker, stamp_ns, due)
        if stamp_ns is None:
            self._reply(asker, pack_accepted(None))
            return
        taken = False
        try:
            taken = self._listener.on_goal(
                goal_id, stamp_ns, content, goal_id_text(asker.attachment.gid)
            )
        finally:
            if not taken:
                self._decide(goal_id, accepted=False)
        self._arm()

    def _decide(self, goal_id: str, *, accepted: bool) -> None:
        """Answer the client that waits to hear about its goal, if it still does."""
        with self._lock:
            found = self._undecided.pop(goal_id, None)
            if found is None:
                return
            if not accepted:
                self._refused.add(goal_id)
        self._reply(found.asker, pack_accepted(found.stamp_ns if accepted else None))

    def _arm(self) -> None:
        """Let the timer run when the oldest undecided goal is due."""
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
        asker = self._asker("a question for a result", query)
        if asker is None:
            return
        try:
            goal_id = goal_id_text(unpack_id(query.payload))
        except ValueError as error:
            self._refuse_unreadable("a question for a result", asker, error)
            return
        with self._lock:  # before looking: the goal may end in between
            if not self._closed:
                self._waiting.setdefault(goal_id, []).append(asker)
        self._answer_ended(goal_id)

    def _answer_ended(self, goal_id: str) -> None:
        """Answer who waits for a goal that has ended or is not known."""
        entry, body = self._listener.find_end(goal_id)
        if entry.status == Status.REJECTED and goal_id in self._undecided:
            return  # about to be answered by who refuses it
        if body is not None:
            self._answer(goal_id, self._response(entry, body))
        elif entry.status in TERMINAL or entry.status == Status.LOST:
            self._answer(goal_id, self._unknown)

    def _answer(self, goal_id: str, response: bytes) -> None:
        with self._lock:
            askers = self._waiting.pop(goal_id, ())
        for asker in askers:
            self._reply(asker, response)

    def _answer_forgotten(self, listed: set[str]) -> None:
        """Answer who waits for goals that were given up and are no longer in the list."""
        with self._lock:
            missing = self._waiting.keys() - listed
        for goal_id in missing:
            self._answer_ended(goal_id)

    # -- cancels -------------------------------------------------------------------------------

    def _on_cancel(self, query: Query) -> None:
        asker = self._asker("a cancel", query)
        if asker is None:
            return
        try:
            asked = unpack_cancel(query.payload)
        except ValueError as error:
            self._refuse_unreadable("a cancel", asker, error)
            return
        self._reply(asker, pack_canceling(self._cancel(asked)))

    def _cancel(self, asked: Asked) -> Canceling:
        """Ask goals to stop; answers with those that now are, and were not before."""
        goal_id = goal_id_text(asked.uuid)
        if asked.uuid != NO_GOAL and not asked.stamp_ns:
            code = self._code(self._listener.find_end(goal_id)[0])
            if code == GoalCode.UNKNOWN:
                return Canceling(CancelCode.UNKNOWN_GOAL, ())
            asked_now = [] if code in ENDED else self._listener.on_cancel(goal_id, 0)
            if not asked_now:
                return Canceling(CancelCode.GOAL_TERMINATED, ())
        else:
            asked_now = [
                now_asked
                for entry in choose_cancelled(self._listener.list_goals(), asked)
                for now_asked in self._listener.on_cancel(entry.id, 0)
            ]
        goals = tuple((goal_uuid(entry.id), entry.stamp_ns) for entry in asked_now)
        return Canceling(CancelCode.NONE, goals)

    # -- requests ------------------------------------------------------------------------------

    def _asker(self, what: str, query: Query) -> _Asker | None:
        """Return who asks; one that does not say so as ROS 2 does gets an error."""
        try:
            return _Asker(query, unpack_attachment(query.attachment))
        except ValueError as error:
            text = f"action '{self._name}': {what} cannot be answered: {error}"
            self._readable.report(what, ActionlibError(text))
            query.reply_error(text)
            query.finish()
            return None

    def _refuse_unreadable(self, what: str, asker: _Asker, error: Exception) -> None:
        """Answer a request that cannot be read; a sender that goes on like this is told of once."""
        sender = asker.attachment.gid.hex()
        text = f"action '{self._name}': {what} of client {sender} cannot be read: {error}"
        self._readable.report(f"{sender} {what}", ActionlibError(text))
        asker.query.reply_error(text)
        asker.query.finish()

    def _reply(self, asker: _Asker, payload: bytes) -> None:
        attachment = answer_to(asker.attachment, self._clock.time_ns())
        asker.query.reply(payload, attachment=attachment)
        asker.query.finish()

    # -- who is there --------------------------------------------------------------------------

    def _on_token(self, token: Token, key: str, alive: bool) -> None:
        if any(token == end.token for end in self._ends.values()):
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

    def _conflict(self, other: Token, *, stays: bool = False) -> ServerConflictError:
        own = self._ros.full_name, self._ros.token.session
        there = other.full_node, other.session
        return ServerConflictError(self._name, *((there, own) if stays else (own, there)))


def choose_cancelled(goals: Iterable[StatusEntry], asked: Asked) -> list[StatusEntry]:
    """Return the goals that a cancel of several is about: all, or those up to a stamp and one more.

    Args:
        goals: All goals of the server.
        asked: A cancel with a stamp, or without both.
    """
    everything = asked.uuid == NO_GOAL and not asked.stamp_ns
    goal_id = goal_id_text(asked.uuid)
    return [
        goal
        for goal in goals
        if goal.status not in TERMINAL
        and (everything or goal.id == goal_id or 0 < goal.stamp_ns <= asked.stamp_ns)
    ]
