"""An action server's end of the wire: keys and ROS 1's messages."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import (
    ActionlibError,
    ServerConflictError,
    TransportError,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.transport import Quality
from actionlib_core.wire.action_messages import (
    action_keys,
    pack_goal,
    pack_report,
    pack_status,
    pack_statuses,
    unpack_frame,
    unpack_goal,
    unpack_goal_id,
    unpack_statuses,
)
from actionlib_core.wire.arrivals import Readable
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import (
    Kind,
    find_mismatch,
    in_conflict,
    is_younger,
    list_endpoints,
    parse_token,
    token_key,
    token_pattern,
    with_age,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.goal.ports import ServerListener, StatusEntry
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, PublisherPort, Query, Sample
    from actionlib_core.wire.action_messages import ActionTypes
    from actionlib_core.wire.presence import Endpoint

log = logging.getLogger(__name__)

FAREWELL_LIST_S = 0.2
RESULT = Quality(express=True, block=True)
RESULT_OR_NOT = Quality(express=True, block=False)  # a client that misses it asks for it
FEEDBACK = Quality(express=False, block=True)
STATUS = Quality(express=False, block=False)  # said again every second: never worth waiting


class ActionServerPort:
    """Declares the keys of an action server and speaks on them.

    Args:
        node: On whose network.
        name: The action's full name.
        types: Its message classes.

    Threads: any. The listener is called on the network's threads.
    """

    def __init__(self, node: Node, name: str, types: ActionTypes) -> None:
        self._node = node
        self._clock = node.clock
        self._types = types
        self._name = name
        self._keys = action_keys(name)
        self._lock = threading.Lock()
        self._declared: list[Closable] = []
        self._publishers: dict[tuple[str, Quality], PublisherPort] = {}
        self._token: Closable | None = None
        self._clients: dict[str, Endpoint] = {}
        self._unaware: set[str] = set()  # tokens of clients that the farewell has not reached
        self._readable = Readable(log)
        self._closed = False
        action = types.action
        endpoint = node.endpoint(Kind.ACTION_SERVER, name, action._type, action._md5sum)
        self.endpoint = with_age(endpoint, node.clock.time_ns())
        self._own_key = token_key(self.endpoint)

    def open(self, listener: ServerListener) -> None:
        self._listener = listener
        transport, keys = self._node.transport, self._keys
        there = list_endpoints(transport, kind=Kind.ACTION_SERVER, name=self._name)
        if there:
            raise self._conflict(there[0])
        try:
            self._declared = [
                transport.subscribe(keys.goal, self._on_goal, history=False),
                transport.subscribe(keys.cancel, self._on_cancel, history=False),
                transport.subscribe(keys.ack, self._on_ack, history=False),
                transport.queryable(keys.result, self._on_query),
                transport.queryable(keys.goal, self._on_goal_query),
            ]
            self._token = transport.declare_alive(self._own_key)
            self._declared += [
                self._token,
                transport.watch_alive(token_pattern(None, self._name), self._on_presence),
            ]
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        with self._lock:
            self._closed = True
            declared, self._declared = self._declared, []
            declared.extend(self._publishers.values())
            self._publishers = {}
            token, self._token = self._token, None
        # The token goes last: while it shows, a client that is not heard knows that it is not.
        declared.sort(key=lambda entry: entry is token)
        for entry in declared:
            entry.close()

    def has_clients(self) -> bool:
        return bool(self._clients)

    def begin_farewell(self) -> bool:
        if not self._publisher(self._keys.status, GoalStatusArray, RESULT).matching():
            return False
        unaware = set(self._clients)
        if not unaware:  # a server that has just started may not have heard of them yet
            pattern = token_pattern(Kind.ACTION_CLIENT, self._name)
            unaware = set(self._node.transport.list_alive(pattern, FAREWELL_LIST_S))
        self._unaware = unaware
        return True

    def is_farewell_heard(self) -> bool:
        return not self._unaware

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Send a GoalStatusArray whose frame id is our token."""
        payload = pack_statuses(self._clock.time_ns(), taken, self._own_key)
        self._publisher(self._keys.status, GoalStatusArray, RESULT).put(payload)

    def pack_result(self, result: Any) -> bytes:
        body: bytes = result.to_bytes()
        return body

    def pack_feedback(self, feedback: Any) -> bytes:
        body: bytes = feedback.to_bytes()
        return body

    def send_accepted(self, entry: StatusEntry) -> None:
        """Send nothing: the status list says it."""

    def send_status(self, entries: Iterable[StatusEntry]) -> None:
        statuses = self._publisher(self._keys.status, GoalStatusArray, STATUS)
        statuses.put(pack_statuses(self._clock.time_ns(), entries))

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:
        quality = RESULT if wait else RESULT_OR_NOT
        results = self._publisher(self._keys.result, self._types.action_result, quality)
        results.put(pack_report(self._clock.time_ns(), entry, body))

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        feedback = self._publisher(self._keys.feedback, self._types.action_feedback, FEEDBACK)
        feedback.put(pack_report(self._clock.time_ns(), entry, body))

    def _publisher(self, key: str, message_class: Any, quality: Quality) -> PublisherPort:
        which = key, quality
        publisher = self._publishers.get(which)
        if publisher is None:
            with self._lock:
                if self._closed:
                    raise TransportError(
                        f"action {self._name!r}: the server is stopped. Try ending goals before."
                    )
                publisher = self._publishers.get(which)
                if publisher is None:
                    publisher = self._publishers[which] = self._node.transport.publisher(
                        key, encoding_of(message_class), quality
                    )
        return publisher

    # -- what arrives --------------------------------------------------------------------------

    def _on_goal(self, sample: Sample) -> None:
        if not self._readable.check(sample, self._types.action_goal):
            return
        try:
            receiver = unpack_frame(sample.payload)
            goal_id, stamp_ns, body = unpack_goal(sample.payload)
            if receiver not in {"", self._own_key} and self._is_of_another(receiver):
                return
            content = self._types.goal.from_bytes(body)
        except (ValueError, ActionlibError) as error:
            self._report_unreadable("a goal", sample, error)
            return
        self._listener.on_goal(goal_id, stamp_ns, content, sample.source)

    def _is_of_another(self, frame: str) -> bool:
        """Return whether a goal is a late copy of one for another server of this name."""
        server = parse_token(frame)
        return (
            server is not None and server.kind is Kind.ACTION_SERVER and server.name == self._name
        )

    def _on_cancel(self, sample: Sample) -> None:
        if not self._readable.check(sample, GoalID):
            return
        try:
            goal_id, stamp_ns = unpack_goal_id(sample.payload)
        except ValueError as error:
            self._report_unreadable("a cancel", sample, error)
            return
        self._listener.on_cancel(goal_id, stamp_ns)

    def _on_ack(self, sample: Sample) -> None:
        try:
            entries = unpack_statuses(sample.payload)
            self._unaware.discard(unpack_frame(sample.payload))
        except ValueError as error:
            self._report_unreadable("an acknowledgement", sample, error)
            return
        self._listener.on_acknowledged([entry.id for entry in entries])

    def _on_query(self, query: Query) -> None:
        """Answer what became of a goal; without an id, the status list."""
        goal_id = self._read_question(query)
        if goal_id:
            entry, body = self._listener.find_end(goal_id)
            if body is None:
                query.reply(pack_status(entry), encoding_of(GoalStatus))
            else:
                report = pack_report(self._clock.time_ns(), entry, body)
                query.reply(report, encoding_of(self._types.action_result))
        elif goal_id is not None:
            statuses = pack_statuses(self._clock.time_ns(), self._listener.list_goals())
            query.reply(statuses, encoding_of(GoalStatusArray))
        query.finish()

    def _on_goal_query(self, query: Query) -> None:
        """Answer what a goal was."""
        goal_id = self._read_question(query)
        if goal_id is not None:
            found = self._listener.find_goal(goal_id)
            if found is None:
                query.reply_error(
                    f"action '{self._name}': goal {goal_id!r} is not known, or no more"
                )
            else:
                stamp_ns, content = found
                goal = pack_goal(self._clock.time_ns(), goal_id, stamp_ns, content.to_bytes())
                query.reply(goal, encoding_of(self._types.action_goal))
        query.finish()

    def _read_question(self, query: Query) -> str | None:
        """Return the goal id that a query is about; None when it was refused."""
        try:
            return unpack_goal_id(query.payload)[0]
        except ValueError as error:
            query.reply_error(f"action '{self._name}': {error}; expected an actionlib_msgs/GoalID")
            return None

    def _report_unreadable(self, what: str, sample: Sample, error: Exception) -> None:
        """Report a message that is dropped; a sender that goes on like this is told of once."""
        text = f"action '{self._name}': {what} of session {sample.source} cannot be read: {error}"
        self._readable.report(f"{sample.source} {what}", ActionlibError(text))

    # -- who is there --------------------------------------------------------------------------

    def _on_presence(self, presence: Presence) -> None:
        other = parse_token(presence.key)
        if other is None or other == self.endpoint:
            return
        if other.kind is Kind.ACTION_SERVER and presence.alive:
            self._meet_server(other)
        elif other.kind is Kind.ACTION_CLIENT:
            self._meet_client(presence, other)

    def _meet_server(self, other: Endpoint) -> None:
        if is_younger(self.endpoint, other):
            self._listener.on_conflict(self._conflict(other))
        else:
            log.error("%s", self._conflict(other, stays=True))

    def _conflict(self, other: Endpoint, *, stays: bool = False) -> ServerConflictError:
        return ServerConflictError(self._name, *in_conflict(self.endpoint, other, stays=stays))

    def _meet_client(self, presence: Presence, client: Endpoint) -> None:
        if presence.alive:
            self._clients[presence.key] = client
            error = find_mismatch([client], self.endpoint)
            if error is not None:
                self._readable.report(f"{client.session} {client.type} {client.md5}", error)
        elif self._clients.pop(presence.key, None) is not None:
            if presence.key in self._unaware:
                self._unaware.discard(presence.key)
                self._listener.on_acknowledged([])
            if not any(end.session == client.session for end in self._clients.values()):
                self._listener.on_client_lost(client.session)
