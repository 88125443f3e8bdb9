"""A server's end of the wire: bytes and keys on one side, goals and answers on the other."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any, Protocol

from actionlib_core._action_wire import (
    ActionKeys,
    action_keys,
    pack_statuses,
    unpack_frame,
    unpack_goal,
    unpack_goal_id,
    unpack_statuses,
)
from actionlib_core._readable import Readable
from actionlib_core.exceptions import (
    ActionlibError,
    ServerConflictError,
    TransportError,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatusArray
from actionlib_core.presence import (
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
from actionlib_core.transport import Quality
from actionlib_core.wire import encoding_of

if TYPE_CHECKING:
    from actionlib_core._action_wire import ActionTypes, StatusEntry
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint
    from actionlib_core.transport import Closable, Presence, PublisherPort, Query, Sample

log = logging.getLogger(__name__)

FAREWELL_LIST_S = 0.2
RESULT = Quality(express=True, block=True)
FAREWELL = RESULT
FEEDBACK = Quality(express=False, block=True)
STATUS = Quality(express=False, block=False)  # said again every second: never worth waiting


class ServerListener(Protocol):
    """Who decides about what arrives. Called on the network's thread."""

    def on_goal(self, goal_id: str, stamp_ns: int, content: Any, client: str) -> None:
        """Take a goal."""

    def on_cancel(self, goal_id: str, stamp_ns: int) -> None:
        """Take a cancel."""

    def on_acknowledged(self, goal_ids: list[str]) -> None:
        """Take the news that results have arrived, or that `farewell_heard` may have changed."""

    def on_question(self, goal_id: str) -> tuple[Any, bytes]:
        """Return the class and the bytes that answer "what of this goal?"."""

    def on_goal_question(self, goal_id: str) -> bytes | None:
        """Return the XActionGoal of a goal; None when it is not known, or no more."""

    def on_client_lost(self, client: str) -> None:
        """Take the death of a client's session."""

    def on_conflict(self, error: ServerConflictError) -> None:
        """Stop: another server has the name."""


class ServerPort:
    """Declares the keys of an action server and speaks on them.

    Args:
        node: On whose network.
        name: The action's full name.
        types: Its message classes.
        listener: Decides.

    Threads: the `send_` methods may be called from any thread; what arrives is handed to `listener`
        on the network's thread.
    """

    def __init__(self, node: Node, name: str, types: ActionTypes, listener: ServerListener) -> None:
        self._node = node
        self._types = types
        self._listener = listener
        self.name = name
        self.keys: ActionKeys = action_keys(name)
        self._lock = threading.Lock()
        self._declared: list[Closable] = []
        self._publishers: dict[tuple[str, bool], PublisherPort] = {}
        self._token: Closable | None = None
        self._clients: dict[str, Endpoint] = {}
        self._unaware: set[str] = set()  # tokens of clients that the farewell has not reached
        self._readable = Readable(log)
        self._closed = False
        endpoint = node.endpoint(
            Kind.ACTION_SERVER,
            name,
            types.action._type,
            types.action._md5sum,
        )
        self.endpoint = with_age(endpoint, node.clock.time_ns())
        self._own_key = token_key(self.endpoint)

    def open(self) -> None:
        """Declare everything; the token comes last, so who sees it can be heard.

        Raises:
            ServerConflictError: the name has a server.
            TransportError: the session is closed.

        Blocks: until the network has said who has the name, 1 s at most.
        """
        transport = self._node.transport
        there = list_endpoints(transport, kind=Kind.ACTION_SERVER, name=self.name)
        if there:
            raise self._conflict(there[0])
        try:
            self._declare()
        except BaseException:
            self.close()
            raise

    def _declare(self) -> None:
        transport = self._node.transport
        self._declared = [
            transport.subscribe(self.keys.goal, self._on_goal, history=False),
            transport.subscribe(self.keys.cancel, self._on_cancel, history=False),
            transport.subscribe(self.keys.ack, self._on_ack, history=False),
            transport.queryable(self.keys.result, self._on_query),
            transport.queryable(self.keys.goal, self._on_goal_query),
        ]
        self._token = transport.declare_alive(self._own_key)
        self._declared += [
            self._token,
            transport.watch_alive(token_pattern(None, self.name), self._on_presence),
        ]

    def close(self) -> None:
        """Undeclare everything; a second call does nothing."""
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
        """Tell whether a client of the action is there."""
        return bool(self._clients)

    def begin_farewell(self) -> bool:
        """Tell whether anybody listens, and note which clients are to answer.

        Raises:
            TransportError: the session is closed.

        Blocks: when only others than known clients listen, until the network has said who there
            is, `FAREWELL_LIST_S` at most.
        """
        if not self._publisher(self.keys.status, GoalStatusArray, FAREWELL).matching():
            return False
        unaware = set(self._clients)
        if not unaware:  # a server that has just started may not have heard of them yet
            pattern = token_pattern(Kind.ACTION_CLIENT, self.name)
            unaware = set(self._node.transport.list_alive(pattern, FAREWELL_LIST_S))
        self._unaware = unaware
        return True

    def send_farewell(self, now_ns: int, taken: list[StatusEntry]) -> None:
        """Say that the server leaves and which goals it has taken, and so which it has not."""
        payload = pack_statuses(now_ns, taken, self._own_key)
        self._publisher(self.keys.status, GoalStatusArray, FAREWELL).put(payload)

    @property
    def farewell_heard(self) -> bool:
        """Whether all clients have answered the farewell."""
        return not self._unaware

    def send_result(self, payload: bytes) -> None:
        """Send an XActionResult."""
        self._publisher(self.keys.result, self._types.action_result, RESULT).put(payload)

    def send_feedback(self, payload: bytes) -> None:
        """Send an XActionFeedback."""
        self._publisher(self.keys.feedback, self._types.action_feedback, FEEDBACK).put(payload)

    def send_status(self, payload: bytes) -> None:
        """Send a GoalStatusArray."""
        self._publisher(self.keys.status, GoalStatusArray, STATUS).put(payload)

    def _publisher(self, key: str, message_class: Any, quality: Quality) -> PublisherPort:
        which = key, quality.express
        publisher = self._publishers.get(which)
        if publisher is None:
            with self._lock:
                if self._closed:
                    raise TransportError(
                        f"action {self.name!r}: the server is stopped. Try ending goals before."
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
            if self._is_of_another(unpack_frame(sample.payload)):
                return
            goal_id, stamp_ns, body = unpack_goal(sample.payload)
            content = self._types.goal.from_bytes(body)
        except (ValueError, ActionlibError) as error:
            self._report_unreadable("a goal", sample, error)
            return
        self._listener.on_goal(goal_id, stamp_ns, content, sample.source)

    def _is_of_another(self, frame: str) -> bool:
        """Tell whether a goal is a late copy of one for another server of this name."""
        if not frame or frame == self._own_key:
            return False
        server = parse_token(frame)
        return server is not None and server.kind is Kind.ACTION_SERVER and server.name == self.name

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
        try:
            goal_id, _ = unpack_goal_id(query.payload)
        except ValueError as error:
            query.reply_error(f"action '{self.name}': {error}; expected an actionlib_msgs/GoalID")
        else:
            message_class, payload = self._listener.on_question(goal_id)
            query.reply(payload, encoding_of(message_class))
        query.finish()

    def _on_goal_query(self, query: Query) -> None:
        try:
            goal_id, _ = unpack_goal_id(query.payload)
        except ValueError as error:
            query.reply_error(f"action '{self.name}': {error}; expected an actionlib_msgs/GoalID")
        else:
            payload = self._listener.on_goal_question(goal_id)
            if payload is None:
                query.reply_error(
                    f"action '{self.name}': goal {goal_id!r} is not known, or no more"
                )
            else:
                query.reply(payload, encoding_of(self._types.action_goal))
        query.finish()

    def _report_unreadable(self, what: str, sample: Sample, error: Exception) -> None:
        """Report a message that is dropped; a sender that goes on like this is told of once."""
        text = f"action '{self.name}': {what} of session {sample.source} cannot be read: {error}"
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
        return ServerConflictError(self.name, *in_conflict(self.endpoint, other, stays=stays))

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
